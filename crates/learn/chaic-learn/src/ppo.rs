//! Proximal policy optimization (Schulman et al. 2017), for decisions that last differently long.

use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::geom::math;
use chaic_core::rng::Stream;
use chaic_nn::AdamRules;
use chaic_training::Learner;
use chaic_training::bounds::{ADAM, Bound, BoundTable, RATE, SHARDS, SHARE, integer, real};
use serde::{Deserialize, Serialize};

use crate::actor_critic::{ActorCritic, BySaid, Said, step};
use crate::choice_network::Decision;

/// How it learns. What Stable-Baselines3 calls a number is said in brackets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PpoRules {
    /// How much less a reward counts that comes a unit of time later (gamma).
    pub discount: f32,
    /// How far ahead advantages look before they trust values, 0 to 1 (gae_lambda).
    pub trace: f32,
    /// By how much a choice may become likelier or less likely at once (clip_range).
    pub clip: f32,
    /// By how much a value may change at once; 0 for no limit (clip_range_vf).
    pub clip_value: f32,
    /// What entropy is worth (ent_coef).
    pub entropy: f32,
    /// What an error of the value costs (vf_coef).
    pub value: f32,
    /// How often each decision is learned from (n_epochs).
    pub epochs: usize,
    /// Decisions of each step (batch_size).
    pub batch: usize,
    /// Rate of steps (learning_rate).
    pub rate: f32,
    /// Whether the rate falls in a line to nothing at the end.
    pub rate_falls: bool,
    /// Parts of a batch that are worked on side by side.
    pub shards: usize,
    /// An iteration ends early when the mean divergence from the old policy exceeds one and a half times this,
    /// nats (target_kl); 0 for no limit.
    pub divergence: f32,
    /// How steps are taken.
    pub adam: AdamRules,
}

impl Default for PpoRules {
    /// As in Stable-Baselines3, but for larger batches.
    fn default() -> PpoRules {
        PpoRules {
            discount: 0.99,
            trace: 0.95,
            clip: 0.2,
            clip_value: 0.0,
            entropy: 0.0,
            value: 0.5,
            epochs: 10,
            batch: 256,
            rate: 3e-4,
            rate_falls: false,
            shards: 2,
            divergence: 0.0,
            adam: AdamRules {
                beta2: 0.999,
                epsilon: 1e-5,
                weight_decay: 0.0,
                clip_norm: 0.5,
                ..AdamRules::default()
            },
        }
    }
}

/// Returns the bounds of [`PpoRules`] for batches of at most this many decisions.
pub(crate) const fn ppo_bounds(max_batch: i64) -> [(&'static str, Bound); 12] {
    [
        ("discount", SHARE),
        ("trace", SHARE),
        // Without room for change nothing is learned; beyond 1 probabilities may fall to 0 at once.
        ("clip", real(1e-3, 1.0)),
        ("clip_value", real(0.0, 1e6)),
        ("entropy", real(0.0, 100.0)),
        ("value", real(0.0, 100.0)),
        ("epochs", integer(1, 1000)),
        ("batch", integer(1, max_batch)),
        ("rate", RATE),
        ("shards", SHARDS),
        ("divergence", real(0.0, 100.0)),
        ("adam", ADAM),
    ]
}
/// Bounds of [`PpoRules`] where decisions are lists of plans.
pub(crate) const PPO_BOUNDS: BoundTable = &ppo_bounds(MAX_BATCH);
/// Largest number of decisions, lessons or windows of an optimizer step. A pass over them takes 1.5 s and 3 GB, and
/// can't be stopped.
pub(crate) const MAX_BATCH: i64 = 1 << 14;

/// A decision and what came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition<S = Decision> {
    /// What was known.
    pub decision: S,
    /// Which choice was made.
    pub choice: usize,
    /// The logarithm of its probability then.
    pub log_probability: f32,
    /// The return that was expected then.
    pub value: f32,
    /// What came of it until the next decision, or the end.
    pub reward: f32,
    /// How long that took, units of time.
    pub duration: f32,
}

/// The decisions of one episode, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory<S = Decision> {
    /// The decisions.
    pub transitions: Vec<Transition<S>>,
    /// The return that is expected after the last one: 0 where nothing comes after it.
    pub value_after: f32,
}

impl<S> Default for Trajectory<S> {
    fn default() -> Trajectory<S> {
        Trajectory { transitions: Vec::new(), value_after: 0.0 }
    }
}

/// A decision to learn from.
struct Sample<'a, S> {
    transition: &'a Transition<S>,
    advantage: f32,
    /// What the value should have been.
    target: f32,
}

/// What an iteration was like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Told {
    /// Mean of the clipped objective, to be made small.
    pub objective: f64,
    /// Mean squared error of values, halved.
    pub value_loss: f64,
    /// Mean entropy of choices, nats.
    pub entropy: f64,
    /// Mean divergence from the policy that played, nats (Schulman's estimate that is never negative).
    pub divergence: f64,
    /// Share of decisions whose gradient was clipped.
    pub clipped: f64,
    /// Share of the returns' variance that values explained, before learning.
    pub explained_variance: f64,
}

/// Advantages by generalized estimation (Schulman et al. 2016), where a decision that lasts `d` units of time
/// discounts what follows by the `d`th power.
pub fn advantages<S>(rules: &PpoRules, trajectory: &Trajectory<S>) -> Vec<f32> {
    let mut next_value = trajectory.value_after;
    let mut next_advantage = 0.0;
    let mut reversed: Vec<f32> = trajectory
        .transitions
        .iter()
        .rev()
        .map(|t| {
            let discount = math::powf(rules.discount, t.duration);
            let surprise = t.reward + discount * next_value - t.value;
            next_advantage = surprise + discount * rules.trace * next_advantage;
            next_value = t.value;
            next_advantage
        })
        .collect();
    reversed.reverse();
    reversed
}

/// Makes a policy better by what came of it. `iteration` names the order in which decisions are looked at; `rest`
/// is the share of the training that is left. Returns `None` if `stop` is raised meanwhile; some steps may have
/// been taken then.
pub fn improve<M: ActorCritic>(
    rules: &PpoRules,
    model: &M,
    learner: &mut Learner,
    trajectories: &[Trajectory<M::Seen>],
    (seed, iteration, rest): (u64, u64, f32),
    stop: &AtomicBool,
) -> Option<Told> {
    let mut samples: Vec<Sample<'_, M::Seen>> = Vec::new();
    for trajectory in trajectories {
        let advantages = advantages(rules, trajectory);
        samples.extend(trajectory.transitions.iter().zip(advantages).map(|(t, advantage)| {
            Sample { transition: t, advantage, target: advantage + t.value }
        }));
    }
    let mut told = Told { explained_variance: explained_variance(&samples), ..Told::default() };
    normalize(&mut samples);
    let rate = rules.rate * if rules.rate_falls { rest } else { 1.0 };
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let mut n_batches = 0.0;
    'epochs: for epoch in 0..rules.epochs {
        let index = iteration * rules.epochs as u64 + epoch as u64;
        Stream::new(seed, "batches", index).shuffle(&mut order);
        for batch in order.chunks(rules.batch) {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let batch: Vec<&Sample<'_, M::Seen>> = batch.iter().map(|k| &samples[*k]).collect();
            let how = (&mut *learner, &rules.adam, rate);
            let by = |s: &Sample<'_, M::Seen>, said: &Said, share, told: &mut Told| {
                gradient(rules, s, said, share, told)
            };
            let parts = step(model, how, &batch, |s| &s.transition.decision, by);
            let mean =
                |of: fn(&Told) -> f64| parts.iter().map(of).sum::<f64>() / batch.len() as f64;
            let divergence = mean(|t| t.divergence);
            told.objective += mean(|t| t.objective);
            told.value_loss += mean(|t| t.value_loss);
            told.entropy += mean(|t| t.entropy);
            told.divergence += divergence;
            told.clipped += mean(|t| t.clipped);
            n_batches += 1.0;
            if rules.divergence > 0.0 && divergence > 1.5 * f64::from(rules.divergence) {
                break 'epochs;
            }
        }
    }
    let n = f64::max(n_batches, 1.0);
    let Told { objective, value_loss, entropy, divergence, clipped, explained_variance } = told;
    Some(Told {
        objective: objective / n,
        value_loss: value_loss / n,
        entropy: entropy / n,
        divergence: divergence / n,
        clipped: clipped / n,
        explained_variance,
    })
}

/// The gradient of the loss of one decision; adds what it was like to `told`.
fn gradient<S>(
    rules: &PpoRules,
    sample: &Sample<'_, S>,
    said: &Said,
    part: f32,
    told: &mut Told,
) -> BySaid {
    let Sample { transition, advantage, target } = sample;
    let change = said.log_probabilities[transition.choice] - transition.log_probability;
    let ratio = math::exp(change);
    let clipped = ratio.clamp(1.0 - rules.clip, 1.0 + rules.clip);
    let is_clipped = clipped * advantage < ratio * advantage;
    let by_choice = if is_clipped { 0.0 } else { -advantage * ratio };
    let entropy = said.entropy();
    let probability = said.log_probabilities.iter().map(|l| (math::exp(*l), *l));
    let logits = probability.enumerate().map(|(k, (p, l))| {
        let by_log_probability = f32::from(u8::from(k == transition.choice)) - p;
        part * (by_choice * by_log_probability + rules.entropy * p * (l + entropy))
    });
    let logits = logits.collect();
    let error = said.value() - target;
    let moved = said.value() - transition.value;
    // Where the value has moved as far as it may and the error is no larger there, it stays.
    let limited = transition.value + moved.clamp(-rules.clip_value, rules.clip_value) - target;
    let stays = rules.clip_value > 0.0 && limited * limited > error * error;
    let value = if stays { 0.0 } else { part * rules.value * error };
    told.objective -= f64::from((ratio * advantage).min(clipped * advantage));
    told.value_loss += f64::from(0.5 * error * error);
    told.entropy += f64::from(entropy);
    told.divergence += f64::from(ratio - 1.0 - change);
    told.clipped += f64::from(u8::from((ratio - 1.0).abs() > rules.clip));
    BySaid { logits, of_state: vec![value] }
}

/// Gives advantages a mean of 0 and a variance of 1.
fn normalize<S>(samples: &mut [Sample<'_, S>]) {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().map(|s| f64::from(s.advantage)).sum::<f64>() / n;
    let variance = samples.iter().map(|s| square(f64::from(s.advantage) - mean)).sum::<f64>() / n;
    let deviation = variance.sqrt() + 1e-8;
    for sample in samples {
        sample.advantage = ((f64::from(sample.advantage) - mean) / deviation) as f32;
    }
}

fn square(x: f64) -> f64 {
    x * x
}

fn explained_variance<S>(samples: &[Sample<'_, S>]) -> f64 {
    let n = samples.len().max(1) as f64;
    let variance = |of: &dyn Fn(&Sample<'_, S>) -> f64| {
        let mean = samples.iter().map(of).sum::<f64>() / n;
        samples.iter().map(|s| square(of(s) - mean)).sum::<f64>() / n
    };
    let of_targets = variance(&|s| f64::from(s.target));
    if of_targets <= 0.0 {
        return 0.0;
    }
    1.0 - variance(&|s| f64::from(s.target - s.transition.value)) / of_targets
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transition(value: f32, reward: f32, duration: f32) -> Transition {
        Transition {
            decision: Decision::default(),
            choice: 0,
            log_probability: 0.0,
            value,
            reward,
            duration,
        }
    }

    #[test]
    fn advantages_are_discounted_by_how_long_decisions_take() {
        let rules = PpoRules { discount: 0.5, trace: 1.0, ..PpoRules::default() };
        let transitions = vec![transition(1.0, 2.0, 2.0), transition(3.0, 4.0, 1.0)];
        let trajectory = Trajectory { transitions, value_after: 8.0 };
        // With a trace of 1, advantages are returns less values: the last return is 4 + 8 / 2, the one
        // before it 2 + 8 / 4.
        assert_eq!(advantages(&rules, &trajectory), [4.0 - 1.0, 8.0 - 3.0]);
        let rules = PpoRules { trace: 0.0, ..rules };
        assert_eq!(advantages(&rules, &trajectory), [2.0 + 3.0 / 4.0 - 1.0, 8.0 - 3.0]);
    }

    #[test]
    fn what_is_likely_enough_already_is_left_alone() {
        let rules = PpoRules::default();
        let mut transition = transition(0.0, 0.0, 1.0);
        transition.log_probability = math::ln(0.5);
        let said = |p: f32| Said {
            log_probabilities: vec![math::ln(p), math::ln(1.0 - p)],
            of_state: vec![0.0],
        };
        let by = |p: f32, advantage: f32| {
            let sample = Sample { transition: &transition, advantage, target: 0.0 };
            gradient(&rules, &sample, &said(p), 1.0, &mut Told::default()).logits[0]
        };
        assert!(by(0.5, 1.0) < 0.0 && by(0.5, -1.0) > 0.0);
        assert_eq!(by(0.7, 1.0), 0.0);
        assert!(by(0.7, -1.0) > 0.0, "what became likelier by mistake is taken back");
        assert_eq!(by(0.3, -1.0), 0.0);
    }
}
