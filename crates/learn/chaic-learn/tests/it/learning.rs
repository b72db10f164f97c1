//! Trainings learn: losses fall, experts label the states of an episode, and the learner drives its fraction of the
//! episodes.

use std::collections::BTreeMap;
use std::fs;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use chaic_env::RewardWeights;
use chaic_learn::actor_critic::ActorCritic;
use chaic_learn::cloning::{Demonstration, ExpertInfo};
use chaic_learn::opponent::network::OpponentInput;
use chaic_learn::policy::ActionSelection;
use chaic_learn::policy_kind::{PolicyKind, PolicyWeights};
use chaic_learn::ppo::{PpoConfig, Schedule, Trajectory, Transition, update};
use chaic_learn::rollout::{RolloutContext, RolloutEpisode, rollout, rollout_with_expert};
use chaic_learn::train::{CloningConfig, ExpertConfig, PolicyTrainer, RolloutConfig};
use chaic_learn::visual::actions::ActionSpace;
use chaic_learn::visual::network::VisualNetwork;
use chaic_learn::visual::observation::{
    IMAGE_CHANNELS, IMAGE_SIZE, MAP, N_STATE_FEATURES, VisualObservation,
};
use chaic_training::{Learner, Metrics, Trainer as _};
use rayon::prelude::*;

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

fn context() -> RolloutContext<'static> {
    RolloutContext {
        perception: &GroundTruthPerceptionFactory,
        image_size: 32,
        selection: ActionSelection::TRAINING,
        gamma: 0.9995,
        rewards: RewardWeights::CUMULATIVE,
        stop: &NEVER_STOP,
    }
}

/// Returns a policy with random weights.
fn random_policy() -> Arc<PolicyWeights> {
    let model = PolicyKind::PLAIN.network();
    let parameters = model.network.init_parameters(1);
    Arc::new(PolicyWeights::new(PolicyKind::PLAIN, &model, parameters))
}

#[test]
fn the_loss_of_cloning_falls_and_the_learner_drives_from_the_second_iteration() {
    // Returns metrics and demonstrations of two iterations.
    let iterate_twice = |learner_fraction: f32| -> [(Metrics, Vec<u8>); 2] {
        let folder = tempfile::tempdir().unwrap();
        let config = CloningConfig {
            expert: ExpertConfig { helper: "rhp".to_owned() },
            learner_fraction,
            n_steps: 15,
            batch_size: 64,
            rollout: RolloutConfig {
                episodes: 2,
                tasks: vec![TaskId::LowTarget, TaskId::MovingHouse],
                image_size: 32,
                ..RolloutConfig::default()
            },
            ..CloningConfig::default()
        };
        let trainer =
            PolicyTrainer::<CloningConfig>::new(&config, folder.path(), &mut |_| (), &NEVER_STOP);
        let mut trainer = trainer.unwrap().unwrap();
        [0, 1].map(|iteration| {
            let metrics = trainer.step(&NEVER_STOP).unwrap().unwrap();
            let path = folder.path().join(format!("demonstrations-{iteration:06}.bin"));
            (metrics, fs::read(path).unwrap())
        })
    };
    let [by_expert, by_learner] = [0.0, 1.0].map(iterate_twice);
    assert!(by_expert[0] == by_learner[0], "the expert drives the first iteration");
    assert!(by_expert[1].1 != by_learner[1].1, "the learner drives the second one");
    let [first, second] = [0, 1].map(|iteration: usize| by_expert[iteration].0["loss"]);
    assert!(second < first, "{first}, then {second}");
}

#[test]
fn experts_label_the_states_of_an_episode() {
    let names = ["infer_no_planner", "infer_no_constraint", "infer_known_goal", "follow"];
    let weights = random_policy();
    let label = |name: &&'static str| {
        let expert = ExpertInfo::find_expert(name).unwrap();
        let episode = RolloutEpisode::new("low_target/gen/40000001");
        let labeled = rollout_with_expert(&episode, &weights, &context(), expert, 0.0);
        let (demonstrations, _) = labeled.unwrap().unwrap();
        (*name, demonstrations)
    };
    let labeled: BTreeMap<&str, Vec<Demonstration>> = names.par_iter().map(label).collect();
    for (name, demonstrations) in &labeled {
        assert!(!demonstrations.is_empty(), "{name}");
        let is_valid = |d: &Demonstration| d.action < d.observation.n_candidates;
        assert!(demonstrations.iter().all(is_valid), "{name}");
    }
    assert!(labeled["follow"] != labeled["infer_no_planner"]);
}

/// Asserts that repeated updates on the same decisions lower the value loss to this fraction.
fn check_value_loss<M: ActorCritic>(
    config: &PpoConfig,
    model: &M,
    trajectories: &[Trajectory<M::Observation>],
    max_fraction: f64,
) {
    let mut learner = Learner::new(model.network(), 1, config.shards);
    let mut losses = Vec::new();
    for iteration in 0..8 {
        let schedule = Schedule { seed: 1, iteration, progress_remaining: 1.0 };
        let metrics =
            update(config, model, &mut learner, trajectories, None, schedule, &NEVER_STOP).unwrap();
        losses.push(metrics.value_loss);
    }
    assert!(losses[7] < max_fraction * losses[0], "{losses:?}");
}

#[test]
fn ppo_lowers_the_value_loss_of_an_episode() {
    let weights = random_policy();
    let episode = RolloutEpisode::new("moving_house/gen/40000001");
    let result = rollout(&episode, &weights, &context()).unwrap().unwrap();
    assert!(result.trajectory.transitions.iter().any(|t| t.reward != 0.0));
    let config =
        PpoConfig { n_epochs: 2, batch_size: 32, learning_rate: 1e-3, ..PpoConfig::default() };
    check_value_loss(&config, &weights.model, &[result.trajectory], 0.9);
}

#[test]
fn visual_policies_learn_values_from_colors() {
    let mut rng = RngStream::new(1, "images", 0);
    // Red images have a reward of 1, blue ones of -1. A constant value has a loss of 1.
    let decision = |k: usize| {
        let is_red = k.is_multiple_of(2);
        let pixel = if is_red { [200, 30, 30, 90] } else { [30, 30, 200, 90] };
        let mut noisy = || pixel.map(|byte: u8| byte + rng.below(30) as u8);
        let pixels: Vec<[u8; IMAGE_CHANNELS]> =
            (0..IMAGE_SIZE * IMAGE_SIZE).map(|_| noisy()).collect();
        let observation = VisualObservation {
            image: pixels.concat(),
            map: vec![0; MAP.len()],
            state: [0; N_STATE_FEATURES],
            opponent: Vec::new(),
        };
        let reward = if is_red { 1.0 } else { -1.0 };
        let transition = Transition {
            observation,
            action: k % ActionSpace::Primitives.n_actions(),
            log_prob: -2.0,
            value: 0.0,
            reward,
            duration: 1.0,
        };
        Trajectory { transitions: vec![transition], bootstrap_value: 0.0 }
    };
    let trajectories: Vec<Trajectory<VisualObservation>> = (0..8).map(decision).collect();
    let model = VisualNetwork::new(ActionSpace::Primitives, OpponentInput::None);
    let config =
        PpoConfig { n_epochs: 2, batch_size: 4, learning_rate: 3e-3, ..PpoConfig::default() };
    check_value_loss(&config, &model, &trajectories, 0.8);
}
