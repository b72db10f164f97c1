//! PPO updates equal those of Stable-Baselines3 on recorded rollouts
//! (`benches/stable_baselines3/record.py`).

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use chaic_learn::actor_critic::{ActorCritic, ActorCriticOutput, OutputGrad, log_softmax};
use chaic_learn::ppo::{PpoConfig, Schedule, Trajectory, Transition, compute_gae, update};
use chaic_nn::{Network, Node, Pass, Shape, Tensor};
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
    logits: Node,
    value: Node,
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
        pass: &mut Pass,
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
        pass: &mut Pass,
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
