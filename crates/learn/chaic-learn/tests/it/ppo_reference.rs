//! PPO updates equal those of Stable-Baselines3 on recorded rollouts
//! (`benches/stable_baselines3/record.py`). The recordings have decisions of one time unit and one minibatch per
//! epoch; durations and minibatches are compared with the formulas.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use chaic_core::geom::math;
use chaic_core::rng::RngStream;
use chaic_learn::actor_critic::{ActorCritic, ActorCriticOutput, OutputGrad, log_softmax};
use chaic_learn::ppo::{PpoConfig, Schedule, Trajectory, Transition, compute_gae, update};
use chaic_nn::{Network, NodeId, Shape, Tensor, TrainingPass};
use chaic_training::Learner;
use serde::Deserialize;

const N_FEATURES: usize = 5;
const N_ACTIONS: usize = 3;

#[derive(Deserialize)]
struct Recording {
    cases: Vec<Case>,
}

/// One update with the rollout before it.
#[derive(Deserialize)]
struct Case {
    settings: BTreeMap<String, f32>,
    observations: Vec<f32>,
    actions: Vec<f32>,
    rewards: Vec<f32>,
    values: Vec<f32>,
    log_probs: Vec<f32>,
    advantages: Vec<f32>,
    episode_starts: Vec<bool>,
    last_value: f32,
    last_done: bool,
    before: Vec<f32>,
    after: Vec<f32>,
    metrics: BTreeMap<String, f64>,
}

/// Linear policy and value.
struct Linear {
    network: Network,
    logits: NodeId,
    value: NodeId,
}

impl Linear {
    fn new() -> Linear {
        let mut network = Network::default();
        let input = network.input(N_FEATURES);
        let logits = network.output_head("logits", input, N_ACTIONS);
        let value = network.output_head("value", input, 1);
        Linear { network, logits, value }
    }
}

impl ActorCritic for Linear {
    type Observation = Vec<f32>;

    fn network(&self) -> &Network {
        &self.network
    }

    fn forward<'a>(
        &self,
        parameters: &[f32],
        observations: impl Iterator<Item = &'a Vec<f32>> + Clone,
        pass: &mut TrainingPass,
    ) -> Vec<ActorCriticOutput> {
        let data: Vec<f32> = observations.flatten().copied().collect();
        let n = data.len() / N_FEATURES;
        let shape = Shape { n, height: 1, width: 1, channels: N_FEATURES };
        pass.forward(&self.network, parameters, &Tensor { shape, data });
        let logits = pass.activation(self.logits).data.chunks_exact(N_ACTIONS);
        let outputs = logits.zip(&pass.activation(self.value).data);
        let output = |(logits, value): (&[f32], &f32)| ActorCriticOutput {
            log_probs: log_softmax(logits),
            values: vec![*value],
        };
        outputs.map(output).collect()
    }

    fn backward(
        &self,
        parameters: &[f32],
        grad_outputs: &[OutputGrad],
        pass: &mut TrainingPass,
        grad_parameters: &mut [f32],
    ) {
        pass.zero_gradients();
        let logits = grad_outputs.iter().flat_map(|g| g.logits.clone()).collect();
        pass.gradient(self.logits).data = logits;
        pass.gradient(self.value).data = grad_outputs.iter().map(|g| g.values[0]).collect();
        pass.backward(&self.network, parameters, grad_parameters);
    }
}

impl Case {
    fn config(&self) -> PpoConfig {
        let n_steps = self.rewards.len();
        let mut config = PpoConfig { batch_size: n_steps, shards: 1, ..PpoConfig::default() };
        for (name, value) in &self.settings {
            match name.as_str() {
                "gamma" => config.gamma = *value,
                "gae_lambda" => config.gae_lambda = *value,
                "n_epochs" => config.n_epochs = *value as usize,
                "learning_rate" => config.learning_rate = *value,
                "ent_coef" => config.ent_coef = *value,
                "vf_coef" => config.vf_coef = *value,
                "clip_range" => config.clip_range = *value,
                "clip_range_vf" => config.clip_range_vf = *value,
                "target_kl" => config.target_kl = *value,
                _ => panic!("unknown setting {name}"),
            }
        }
        config
    }

    /// Returns the episodes of the rollout.
    fn trajectories(&self) -> Vec<Trajectory<Vec<f32>>> {
        let mut all: Vec<Trajectory<Vec<f32>>> = Vec::new();
        for k in 0..self.rewards.len() {
            if k == 0 || self.episode_starts[k] {
                all.push(Trajectory::default());
            }
            let trajectory = all.last_mut().expect("an episode has started");
            trajectory.transitions.push(Transition {
                observation: self.observations[N_FEATURES * k..][..N_FEATURES].to_vec(),
                action: self.actions[k] as usize,
                log_prob: self.log_probs[k],
                value: self.values[k],
                reward: self.rewards[k],
                duration: 1.0,
            });
        }
        let last = all.last_mut().expect("the rollout has decisions");
        last.bootstrap_value = if self.last_done { 0.0 } else { self.last_value };
        all
    }
}

fn assert_close(name: &str, found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-5 * (1.0 + expected.abs()),
        "{name}: {found}, {expected}"
    );
}

#[test]
fn updates_equal_those_of_stable_baselines3() {
    let text = include_str!("../fixtures/ppo_updates.json");
    let recording: Recording = serde_json::from_str(text).unwrap();
    let mut clips_values = false;
    let mut clips_ratios = false;
    for case in &recording.cases {
        let (config, trajectories) = (case.config(), case.trajectories());
        let advantages = trajectories.iter().flat_map(|t| compute_gae(&config, t));
        for (found, expected) in advantages.zip(&case.advantages) {
            assert_close("advantage", f64::from(found), f64::from(*expected));
        }
        let model = Linear::new();
        let mut learner = Learner::new(&model.network, 1, config.shards);
        learner.load_parameters(case.before.clone());
        let schedule = Schedule { seed: 1, iteration: 0, progress_remaining: 1.0 };
        let stop = AtomicBool::new(false);
        let metrics =
            update(&config, &model, &mut learner, &trajectories, None, schedule, &stop).unwrap();
        for (found, expected) in learner.parameters.iter().zip(&case.after) {
            assert_close("parameter", f64::from(*found), f64::from(*expected));
        }
        let found = metrics.to_metrics();
        for (name, expected) in &case.metrics {
            assert_close(name, found[name], *expected);
        }
        clips_values |= config.clip_range_vf > 0.0;
        clips_ratios |= metrics.clip_fraction > 0.0;
    }
    assert!(clips_values && clips_ratios && recording.cases.len() == 3);
}

/// Returns the advantages of a semi-Markov process by their definition: TD errors, discounted by `gamma` for each
/// frame and by `gae_lambda` for each decision between.
fn reference_advantages(config: &PpoConfig, trajectory: &Trajectory<Vec<f32>>) -> Vec<f64> {
    let steps = &trajectory.transitions;
    let discount = |frames: f32| {
        (0..frames as usize).fold(1.0, |product, _| product * f64::from(config.gamma))
    };
    let td_error = |k: usize| {
        let next_value = steps.get(k + 1).map_or(trajectory.bootstrap_value, |step| step.value);
        f64::from(steps[k].reward) + discount(steps[k].duration) * f64::from(next_value)
            - f64::from(steps[k].value)
    };
    let advantage = |first: usize| {
        let later = (first..steps.len()).map(|k| {
            let frames: f32 = steps[first..k].iter().map(|step| step.duration).sum();
            let lambdas = (first..k).fold(1.0, |product, _| product * f64::from(config.gae_lambda));
            discount(frames) * lambdas * td_error(k)
        });
        later.sum::<f64>()
    };
    (0..steps.len()).map(advantage).collect()
}

#[test]
fn advantages_of_decisions_of_any_duration_follow_from_their_td_errors() {
    let mut rng = RngStream::new(1, "advantages", 0);
    for (gamma, gae_lambda) in [(0.9995, 0.98), (0.99, 0.95), (0.99, 0.0), (0.999, 1.0)] {
        let config = PpoConfig { gamma, gae_lambda, ..PpoConfig::default() };
        let mut step = || Transition {
            observation: Vec::new(),
            action: 0,
            log_prob: 0.0,
            value: rng.range(-1.0, 1.0),
            reward: rng.range(-1.0, 1.0),
            duration: (1 + rng.below(200)) as f32,
        };
        let transitions: Vec<Transition<Vec<f32>>> = (0..40).map(|_| step()).collect();
        let trajectory = Trajectory { transitions, bootstrap_value: 0.7 };
        let expected = reference_advantages(&config, &trajectory);
        let found = compute_gae(&config, &trajectory);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.into_iter().zip(expected) {
            let error = (f64::from(found) - expected).abs();
            assert!(error < 1e-4, "gamma {gamma}, lambda {gae_lambda}: {found} is not {expected}");
        }
    }
}

/// Normalizes the rewards of a minibatch to mean 0 and variance 1.
fn normalize_rewards(batch: &mut [Trajectory<Vec<f32>>]) {
    let rewards: Vec<f64> = batch.iter().map(|t| f64::from(t.transitions[0].reward)).collect();
    let n = rewards.len() as f64;
    let mean = rewards.iter().sum::<f64>() / n;
    let variance = rewards.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
    for (trajectory, reward) in batch.iter_mut().zip(rewards) {
        trajectory.transitions[0].reward = ((reward - mean) / variance.sqrt()) as f32;
    }
}

#[test]
fn advantages_are_normalized_within_each_minibatch() {
    const SEED: u64 = 3;
    // Without a value loss, rewards are advantages and have no other effect.
    let config = PpoConfig {
        n_epochs: 1,
        batch_size: 4,
        learning_rate: 0.01,
        vf_coef: 0.0,
        shards: 1,
        ..PpoConfig::default()
    };
    let mut rng = RngStream::new(1, "minibatches", 0);
    let decision = |_: usize| {
        let transition: Transition<Vec<f32>> = Transition {
            observation: (0..N_FEATURES).map(|_| rng.range(-1.0, 1.0)).collect(),
            action: rng.below(N_ACTIONS),
            log_prob: math::ln(1.0 / N_ACTIONS as f32),
            value: 0.0,
            reward: rng.range(0.5, 9.0),
            duration: 1.0,
        };
        Trajectory { transitions: vec![transition], bootstrap_value: 0.0 }
    };
    let decisions: Vec<Trajectory<Vec<f32>>> = (0..12).map(decision).collect();
    let model = Linear::new();
    let learn = |learner: &mut Learner, config: &PpoConfig, decisions: &[Trajectory<Vec<f32>>]| {
        let schedule = Schedule { seed: SEED, iteration: 0, progress_remaining: 1.0 };
        update(config, &model, learner, decisions, None, schedule, &AtomicBool::new(false))
            .unwrap();
    };
    let mut whole = Learner::new(&model.network, 1, 1);
    learn(&mut whole, &config, &decisions);
    // The same minibatches one by one, with rewards that are normalized here.
    let mut order: Vec<usize> = (0..decisions.len()).collect();
    RngStream::new(SEED, "batches", 0).shuffle(&mut order);
    let mut by_batch = Learner::new(&model.network, 1, 1);
    for batch in order.chunks(config.batch_size) {
        let mut batch: Vec<Trajectory<Vec<f32>>> =
            batch.iter().map(|k| decisions[*k].clone()).collect();
        normalize_rewards(&mut batch);
        learn(&mut by_batch, &config, &batch);
    }
    for (found, expected) in whole.parameters.iter().zip(&by_batch.parameters) {
        assert_close("parameter", f64::from(*found), f64::from(*expected));
    }
    assert_ne!(whole.parameters, Learner::new(&model.network, 1, 1).parameters);
}
