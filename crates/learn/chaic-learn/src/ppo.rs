//! Proximal policy optimization (Schulman et al. 2017) for decisions of variable duration.

use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::geom::math;
use chaic_core::rng::RngStream;
use chaic_nn::simd::widest;
use chaic_nn::{AdamWConfig, TrainingPass};
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, FRACTION, LEARNING_RATE, SHARDS, integer, real,
};
use chaic_training::{Learner, Metrics, metrics};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::actor_critic::{ActorCritic, ActorCriticOutput, Optimizer, OutputGrad, optimizer_step};
use crate::candidate_scorer::CandidateSet;

/// Hyperparameters of PPO, named as in Stable-Baselines3.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PpoConfig {
    /// Discount factor per time unit.
    #[serde(alias = "discount")]
    pub gamma: f32,
    /// GAE lambda, 0 to 1: 0 is one-step TD, 1 is Monte Carlo.
    #[serde(alias = "trace")]
    pub gae_lambda: f32,
    /// Clip range of the probability ratio.
    #[serde(alias = "clip")]
    pub clip_range: f32,
    /// Range in which the value may change in an update; 0 disables it.
    #[serde(alias = "clip_value")]
    pub clip_range_vf: f32,
    /// Coefficient of the entropy bonus.
    #[serde(alias = "entropy")]
    pub ent_coef: f32,
    /// Coefficient of the value loss.
    #[serde(alias = "value")]
    pub vf_coef: f32,
    /// Coefficient of the KL divergence from the initial policy (`--weights`), nats.
    pub kl_coef: f32,
    /// Passes over the decisions of an iteration.
    #[serde(alias = "epochs")]
    pub n_epochs: usize,
    /// Decisions per minibatch.
    #[serde(alias = "batch")]
    pub batch_size: usize,
    /// AdamW step size.
    #[serde(alias = "rate")]
    pub learning_rate: f32,
    /// Lets the learning rate fall linearly to 0.
    #[serde(alias = "rate_falls")]
    pub anneal_lr: bool,
    /// Parts of a minibatch that run in parallel.
    pub shards: usize,
    /// Ends the update before the first step whose approximate KL exceeds `1.5 * target_kl` (nats);
    /// 0 disables it.
    #[serde(alias = "divergence")]
    pub target_kl: f32,
    /// Optimizer.
    pub adam: AdamWConfig,
}

impl Default for PpoConfig {
    /// Defaults of Stable-Baselines3, except for a larger minibatch.
    fn default() -> PpoConfig {
        PpoConfig {
            gamma: 0.99,
            gae_lambda: 0.95,
            clip_range: 0.2,
            clip_range_vf: 0.0,
            ent_coef: 0.0,
            vf_coef: 0.5,
            kl_coef: 0.0,
            n_epochs: 10,
            batch_size: 256,
            learning_rate: 3e-4,
            anneal_lr: false,
            shards: 2,
            target_kl: 0.0,
            adam: AdamWConfig {
                beta2: 0.999,
                epsilon: 1e-5,
                weight_decay: 0.0,
                max_grad_norm: 0.5,
                ..AdamWConfig::default()
            },
        }
    }
}

/// Returns the bounds of [`PpoConfig`] for minibatches of at most this many decisions.
pub(crate) const fn ppo_bounds(max_batch: i64) -> [(&'static str, Bound); 13] {
    [
        ("gamma", FRACTION),
        ("gae_lambda", FRACTION),
        // With a clip range of 0 nothing is learned; with more than 1, probabilities may drop to 0
        // in one step.
        ("clip_range", real(1e-3, 1.0)),
        ("clip_range_vf", real(0.0, 1e6)),
        ("ent_coef", real(0.0, 100.0)),
        ("vf_coef", real(0.0, 100.0)),
        ("kl_coef", real(0.0, 100.0)),
        ("n_epochs", integer(1, 1000)),
        ("batch_size", integer(1, max_batch)),
        ("learning_rate", LEARNING_RATE),
        ("shards", SHARDS),
        ("target_kl", real(0.0, 100.0)),
        ("adam", ADAM),
    ]
}
/// Bounds of [`PpoConfig`] for decisions between plans.
pub(crate) const PPO_BOUNDS: BoundTable = &ppo_bounds(MAX_BATCH);
/// Maximum number of decisions, demonstrations or windows per optimizer step. A pass over them
/// takes 1.5 s and 3 GB and cannot be stopped.
pub(crate) const MAX_BATCH: i64 = 1 << 14;

/// Decision with its outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition<S = CandidateSet> {
    /// Observation.
    pub observation: S,
    /// Index of the chosen action.
    pub action: usize,
    /// Log-probability of the action under the policy that chose it.
    pub log_prob: f32,
    /// Value estimate of the policy that chose it.
    pub value: f32,
    /// Rewards until the next decision or the end, discounted to this one.
    pub reward: f32,
    /// Time until the next decision or the end, time units.
    pub duration: f32,
}

/// Decisions of one episode, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<S = CandidateSet> {
    /// Decisions.
    pub transitions: Vec<Transition<S>>,
    /// Value estimate after the last decision; 0 if the episode has ended.
    pub bootstrap_value: f32,
}

impl<S> Default for Trajectory<S> {
    fn default() -> Trajectory<S> {
        Trajectory { transitions: Vec::new(), bootstrap_value: 0.0 }
    }
}

/// Decision with its advantage and value target.
struct PpoSample<'a, S> {
    transition: &'a Transition<S>,
    advantage: f32,
    /// Return that the value estimate is trained towards.
    value_target: f32,
    /// Log-probabilities of the initial policy; empty without a KL penalty.
    reference: Vec<f32>,
}

/// Metrics of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PpoMetrics {
    /// Mean clipped surrogate loss.
    pub policy_loss: f64,
    /// Mean squared value error.
    pub value_loss: f64,
    /// Mean entropy of the action distribution, nats.
    pub entropy: f64,
    /// Approximate KL divergence from the old policy in the last epoch, nats (Schulman's
    /// non-negative estimator).
    pub approx_kl: f64,
    /// Fraction of decisions whose ratio is clipped.
    pub clip_fraction: f64,
    /// Mean KL divergence from the initial policy, nats; 0 without `kl_coef`.
    pub reference_kl: f64,
    /// Explained variance of the returns before the update.
    pub explained_variance: f64,
}

impl PpoMetrics {
    /// Returns the metrics by name, for the curves of a training.
    pub fn to_metrics(self) -> Metrics {
        metrics([
            ("policy_loss", self.policy_loss),
            ("value_loss", self.value_loss),
            ("entropy", self.entropy),
            ("approx_kl", self.approx_kl),
            ("clip_fraction", self.clip_fraction),
            ("reference_kl", self.reference_kl),
            ("explained_variance", self.explained_variance),
        ])
    }
}

/// Returns advantages by generalized advantage estimation (Schulman et al. 2016) for a semi-Markov
/// process: a step of duration `d` is discounted by `gamma^d`.
pub fn compute_gae<S>(config: &PpoConfig, trajectory: &Trajectory<S>) -> Vec<f32> {
    let mut next_value = trajectory.bootstrap_value;
    let mut next_advantage = 0.0;
    let mut advantages: Vec<f32> = trajectory
        .transitions
        .iter()
        .rev()
        .map(|t| {
            let gamma = math::powf(config.gamma, t.duration);
            let td_error = t.reward + gamma * next_value - t.value;
            next_advantage = td_error + gamma * config.gae_lambda * next_advantage;
            next_value = t.value;
            next_advantage
        })
        .collect();
    advantages.reverse();
    advantages
}

/// Position of an update in a training.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    /// Seed of the shuffles.
    pub seed: u64,
    /// Index of the update, which selects the shuffles.
    pub iteration: u64,
    /// Remaining fraction of the training, 1 to 0.
    pub progress_remaining: f32,
}

/// Runs `n_epochs` of minibatch PPO on `trajectories`, as Stable-Baselines3 does.
///
/// `reference` holds the parameters of the initial policy, from which the KL penalty measures the
/// divergence. `schedule` seeds the shuffle and anneals the learning rate. Returns `None` if `stop`
/// is raised; some steps may have been taken.
pub fn update<M: ActorCritic>(
    config: &PpoConfig,
    model: &M,
    learner: &mut Learner,
    trajectories: &[Trajectory<M::Observation>],
    reference: Option<&[f32]>,
    schedule: Schedule,
    stop: &AtomicBool,
) -> Option<PpoMetrics> {
    let mut samples: Vec<PpoSample<'_, M::Observation>> = Vec::new();
    for trajectory in trajectories {
        let advantages = compute_gae(config, trajectory);
        samples.extend(trajectory.transitions.iter().zip(advantages).map(|(t, advantage)| {
            let value_target = advantage + t.value;
            PpoSample { transition: t, advantage, value_target, reference: Vec::new() }
        }));
    }
    if let Some(reference) = reference {
        samples.par_chunks_mut(REFERENCE_BATCH).for_each(|batch| {
            // If `stop` is raised, the first minibatch returns `None`.
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let mut pass = TrainingPass::new(model.network(), widest());
            let observations = batch.iter().map(|s| &s.transition.observation);
            let outputs = model.forward(reference, observations, &mut pass);
            batch.iter_mut().zip(outputs).for_each(|(s, output)| s.reference = output.log_probs);
        });
    }
    let mut metrics =
        PpoMetrics { explained_variance: explained_variance(&samples), ..PpoMetrics::default() };
    let Schedule { seed, iteration, progress_remaining } = schedule;
    let learning_rate =
        config.learning_rate * if config.anneal_lr { progress_remaining } else { 1.0 };
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let mut n_batches = 0.0;
    'epochs: for epoch in 0..config.n_epochs {
        let index = iteration * config.n_epochs as u64 + epoch as u64;
        RngStream::new(seed, "batches", index).shuffle(&mut order);
        let mut approx_kls: Vec<f64> = Vec::new();
        for batch in order.chunks(config.batch_size) {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let batch: Vec<&PpoSample<'_, M::Observation>> =
                batch.iter().map(|k| &samples[*k]).collect();
            let normalizer = AdvantageNormalizer::new(&batch);
            let mean_over_batch = |shards: &[PpoMetrics], metric: fn(&PpoMetrics) -> f64| {
                shards.iter().map(metric).sum::<f64>() / batch.len() as f64
            };
            let exceeds_target = |shards: &[PpoMetrics]| {
                let approx_kl = mean_over_batch(shards, |m| m.approx_kl);
                config.target_kl > 0.0 && approx_kl > 1.5 * f64::from(config.target_kl)
            };
            let shards = optimizer_step(
                model,
                learner,
                Optimizer { adam: &config.adam, learning_rate },
                &batch,
                |sample| &sample.transition.observation,
                |sample, output, weight, stats| {
                    let advantage = normalizer.apply(sample.advantage);
                    gradient(config, sample, advantage, output, weight, stats)
                },
                |shards| !exceeds_target(shards),
            );
            let mean = |metric: fn(&PpoMetrics) -> f64| mean_over_batch(&shards, metric);
            metrics.policy_loss += mean(|m| m.policy_loss);
            metrics.value_loss += mean(|m| m.value_loss);
            metrics.entropy += mean(|m| m.entropy);
            approx_kls.push(mean(|m| m.approx_kl));
            metrics.approx_kl = approx_kls.iter().sum::<f64>() / approx_kls.len() as f64;
            metrics.clip_fraction += mean(|m| m.clip_fraction);
            metrics.reference_kl += mean(|m| m.reference_kl);
            n_batches += 1.0;
            if exceeds_target(&shards) {
                break 'epochs;
            }
        }
    }
    let n = f64::max(n_batches, 1.0);
    Some(PpoMetrics {
        policy_loss: metrics.policy_loss / n,
        value_loss: metrics.value_loss / n,
        entropy: metrics.entropy / n,
        approx_kl: metrics.approx_kl,
        clip_fraction: metrics.clip_fraction / n,
        reference_kl: metrics.reference_kl / n,
        explained_variance: metrics.explained_variance,
    })
}

/// Returns the gradient of the loss of one decision, multiplied by `weight`, and adds the metrics
/// of the decision. `advantage` is normalized.
fn gradient<S>(
    config: &PpoConfig,
    sample: &PpoSample<'_, S>,
    advantage: f32,
    output: &ActorCriticOutput,
    weight: f32,
    metrics: &mut PpoMetrics,
) -> OutputGrad {
    let PpoSample { transition, value_target, reference, .. } = sample;
    let log_ratio = output.log_probs[transition.action] - transition.log_prob;
    let ratio = math::exp(log_ratio);
    let clipped = ratio.clamp(1.0 - config.clip_range, 1.0 + config.clip_range);
    let is_clipped = clipped * advantage < ratio * advantage;
    let grad_log_prob = if is_clipped { 0.0 } else { -advantage * ratio };
    let entropy = output.entropy();
    // Log-ratios to the initial policy, whose mean is the KL divergence.
    let reference_ratio = |k: usize| reference.get(k).map_or(0.0, |r| output.log_probs[k] - r);
    let probability = output.log_probs.iter().map(|l| (math::exp(*l), *l)).enumerate();
    let reference_kl: f32 = probability.clone().map(|(k, (p, _))| p * reference_ratio(k)).sum();
    let logits = probability.map(|(k, (p, l))| {
        let grad_logit = f32::from(u8::from(k == transition.action)) - p;
        let grad_entropy = -p * (l + entropy);
        let grad_kl = p * (reference_ratio(k) - reference_kl);
        let grad = grad_log_prob * grad_logit - config.ent_coef * grad_entropy;
        weight * (grad + config.kl_coef * grad_kl)
    });
    let logits = logits.collect();
    let change = output.value() - transition.value;
    let is_clipped_value = config.clip_range_vf > 0.0 && change.abs() > config.clip_range_vf;
    // A clipped value does not depend on the network.
    let (value, slope) = if is_clipped_value {
        (transition.value + change.clamp(-config.clip_range_vf, config.clip_range_vf), 0.0)
    } else {
        (output.value(), 1.0)
    };
    let error = value - value_target;
    let grad_value = slope * weight * config.vf_coef * 2.0 * error;
    metrics.policy_loss -= f64::from((ratio * advantage).min(clipped * advantage));
    metrics.value_loss += f64::from(error * error);
    metrics.reference_kl += f64::from(reference_kl);
    metrics.entropy += f64::from(entropy);
    metrics.approx_kl += f64::from(ratio - 1.0 - log_ratio);
    metrics.clip_fraction += f64::from(u8::from((ratio - 1.0).abs() > config.clip_range));
    OutputGrad { logits, values: vec![grad_value] }
}

/// Batch size for the evaluation of the initial policy, decisions.
const REFERENCE_BATCH: usize = 256;

/// Normalizes the advantages of a minibatch to mean 0 and variance 1; a single one is unchanged.
struct AdvantageNormalizer {
    mean: f64,
    std_dev: f64,
}

impl AdvantageNormalizer {
    fn new<S>(batch: &[&PpoSample<'_, S>]) -> AdvantageNormalizer {
        let n = batch.len() as f64;
        if batch.len() < 2 {
            return AdvantageNormalizer { mean: 0.0, std_dev: 1.0 };
        }
        let mean = batch.iter().map(|s| f64::from(s.advantage)).sum::<f64>() / n;
        let sum_squares = batch.iter().map(|s| square(f64::from(s.advantage) - mean)).sum::<f64>();
        AdvantageNormalizer { mean, std_dev: (sum_squares / (n - 1.0)).sqrt() + 1e-8 }
    }

    fn apply(&self, advantage: f32) -> f32 {
        ((f64::from(advantage) - self.mean) / self.std_dev) as f32
    }
}

fn square(x: f64) -> f64 {
    x * x
}

fn explained_variance<S>(samples: &[PpoSample<'_, S>]) -> f64 {
    let n = samples.len().max(1) as f64;
    let variance = |value: &dyn Fn(&PpoSample<'_, S>) -> f64| {
        let mean = samples.iter().map(value).sum::<f64>() / n;
        samples.iter().map(|s| square(value(s) - mean)).sum::<f64>() / n
    };
    let target_variance = variance(&|s| f64::from(s.value_target));
    if target_variance <= 0.0 {
        return 0.0;
    }
    1.0 - variance(&|s| f64::from(s.value_target - s.transition.value)) / target_variance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actor_critic::log_softmax;

    fn transition(value: f32, reward: f32, duration: f32) -> Transition {
        Transition {
            observation: CandidateSet::default(),
            action: 0,
            log_prob: 0.0,
            value,
            reward,
            duration,
        }
    }

    #[test]
    fn advantages_are_discounted_by_durations() {
        let config = PpoConfig { gamma: 0.5, gae_lambda: 1.0, ..PpoConfig::default() };
        let transitions = vec![transition(1.0, 2.0, 2.0), transition(3.0, 4.0, 1.0)];
        let trajectory = Trajectory { transitions, bootstrap_value: 8.0 };
        // With lambda = 1 advantages are returns minus values: the last return is 4 + 8 / 2, the
        // first 2 + 8 / 4.
        assert_eq!(compute_gae(&config, &trajectory), [4.0 - 1.0, 8.0 - 3.0]);
        let config = PpoConfig { gae_lambda: 0.0, ..config };
        assert_eq!(compute_gae(&config, &trajectory), [2.0 + 3.0 / 4.0 - 1.0, 8.0 - 3.0]);
    }

    #[test]
    fn the_penalty_is_the_divergence_from_the_initial_policy() {
        let config = PpoConfig { kl_coef: 0.7, ..PpoConfig::default() };
        let reference = log_softmax(&[0.3, -0.4, 1.1]);
        let logits = [0.8, 0.1, -0.5];
        let divergence = |logits: &[f32; 3]| -> f32 {
            let log_probs = log_softmax(logits);
            log_probs.iter().zip(&reference).map(|(l, r)| math::exp(*l) * (l - r)).sum()
        };
        let transition = transition(0.0, 0.0, 1.0);
        let sample = PpoSample {
            transition: &transition,
            advantage: 0.0,
            value_target: 0.0,
            reference: reference.clone(),
        };
        let output = ActorCriticOutput { log_probs: log_softmax(&logits), values: vec![0.0] };
        let mut metrics = PpoMetrics::default();
        let grad = gradient(&config, &sample, 0.0, &output, 1.0, &mut metrics);
        assert!((metrics.reference_kl - f64::from(divergence(&logits))).abs() < 1e-6);
        for k in 0..logits.len() {
            let shifted = |step: f32| {
                let mut logits = logits;
                logits[k] += step;
                divergence(&logits)
            };
            let slope = config.kl_coef * (shifted(1e-2) - shifted(-1e-2)) / 2e-2;
            assert!((grad.logits[k] - slope).abs() < 1e-4, "{} {slope}", grad.logits[k]);
        }
    }

    #[test]
    fn clipped_ratios_have_no_gradient() {
        let config = PpoConfig::default();
        let mut transition = transition(0.0, 0.0, 1.0);
        transition.log_prob = math::ln(0.5);
        let output = |p: f32| ActorCriticOutput {
            log_probs: vec![math::ln(p), math::ln(1.0 - p)],
            values: vec![0.0],
        };
        let grad = |p: f32, advantage: f32| {
            let transition = &transition;
            let sample =
                PpoSample { transition, advantage, value_target: 0.0, reference: Vec::new() };
            let metrics = &mut PpoMetrics::default();
            gradient(&config, &sample, advantage, &output(p), 1.0, metrics).logits[0]
        };
        assert!(grad(0.5, 1.0) < 0.0 && grad(0.5, -1.0) > 0.0);
        assert_eq!(grad(0.7, 1.0), 0.0);
        assert!(grad(0.7, -1.0) > 0.0, "a harmful increase has a gradient");
        assert_eq!(grad(0.3, -1.0), 0.0);
    }
}
