//! Trainings are not resumed with other values of the settings on which their checkpoints depend.

use std::fs;
use std::sync::atomic::AtomicBool;

use chaic_core::TaskId;
use chaic_learn::partner::train::{PartnerCloningConfig, PartnerCloningTrainer};
use chaic_learn::train::{CloningConfig, PolicyTrainer, PpoTrainingConfig, RolloutConfig};
use chaic_learn::visual::train::{VisualConfig, VisualTrainer};
use chaic_training::{CONFIG, Trainer, TrainingRun};

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

/// Starts a training and asserts that it is not resumed after any of these edits of its configuration:
/// text before, text after, and the beginning of the message.
fn check<T: Trainer>(config: &T::Config, edits: &[[&str; 3]]) {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let started = TrainingRun::<T>::start(folder, config, None, &mut |_| (), &NEVER_STOP);
    drop(started.unwrap().unwrap());
    let text = fs::read_to_string(folder.join(CONFIG)).unwrap();
    for [before, after, expected] in edits {
        assert!(text.contains(before), "{before} in {text}");
        fs::write(folder.join(CONFIG), text.replacen(before, after, 1)).unwrap();
        let resumed = TrainingRun::<T>::resume(folder, &mut |_| (), &NEVER_STOP);
        let problem = resumed.err().unwrap();
        assert!(problem.is_usage(), "{problem}");
        let problem = problem.to_string();
        let expected = format!("config.toml: {expected} when the training began; set it back, or");
        assert!(problem.contains(&expected) && !problem.contains('\n'), "{problem}");
    }
}

#[test]
fn plan_policies_keep_their_inputs_labels_and_validation_episodes() {
    let rollout = RolloutConfig {
        tasks: vec![TaskId::LowTarget],
        image_size: 32,
        validation_episodes: 1,
        ..RolloutConfig::default()
    };
    let config = PpoTrainingConfig { rollout: rollout.clone(), ..PpoTrainingConfig::default() };
    check::<PolicyTrainer<PpoTrainingConfig>>(
        &config,
        &[
            [
                "\"low_target\"",
                "\"shopping\"",
                "`rollout.tasks` is [\"shopping\"], but was [\"low_target\"]",
            ],
            [
                "validation_episodes = 1",
                "validation_episodes = 2",
                "`rollout.validation_episodes` is 2, but was 1",
            ],
            // It needs another network.
            [
                "n_past_decisions = 0",
                "n_past_decisions = 4",
                "`rollout.n_past_decisions` is 4, but was 0",
            ],
        ],
    );
    check::<PolicyTrainer<CloningConfig>>(
        &CloningConfig { rollout, ..CloningConfig::default() },
        &[
            ["\"infer\"", "\"rhp\"", "`expert.helper` is \"rhp\", but was \"infer\""],
            ["gamma = 0.9998", "gamma = 0.9", "`gamma` is 0.9, but was 0.9998"],
            ["held = 2.0", "held = 1.0", "`rollout.rewards.held` is 1.0, but was 2.0"],
            ["image_size = 32", "image_size = 64", "`rollout.image_size` is 64, but was 32"],
        ],
    );
}

#[test]
fn visual_policies_keep_the_episodes_whose_actions_are_replayed() {
    check::<VisualTrainer>(
        &VisualConfig { image_size: 128, ..VisualConfig::default() },
        &[
            [
                "\"no_constraint\"",
                "\"shopping\"",
                "`tasks` is [\"shopping\"], but was [\"no_constraint\"]",
            ],
            ["\"gen\"", "\"gen-standard\"", "`splits` is [\"gen-standard\"], but was [\"gen\"]"],
            ["\"plans\"", "\"primitives\"", "`action_space` is \"primitives\", but was \"plans\""],
            ["seed = 1", "seed = 2", "`seed` is 2, but was 1"],
            ["n_envs = 1", "n_envs = 2", "`n_envs` is 2, but was 1"],
            ["image_size = 128", "image_size = 256", "`image_size` is 256, but was 128"],
        ],
    );
}

#[test]
fn partners_keep_the_episodes_that_they_imitate() {
    let config = PartnerCloningConfig {
        tasks: vec![TaskId::LowTarget],
        image_size: 64,
        validation_episodes: 1,
        ..PartnerCloningConfig::default()
    };
    check::<PartnerCloningTrainer>(
        &config,
        &[
            [
                "\"rhp\"",
                "\"infer\"",
                "`helpers` is [\"none\", \"infer\"], but was [\"none\", \"rhp\"]",
            ],
            ["\nepisodes = 64", "\nepisodes = 32", "`episodes` is 32, but was 64"],
            ["seed = 1", "seed = 2", "`seed` is 2, but was 1"],
        ],
    );
}
