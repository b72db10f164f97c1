//! Configurations with the keys of earlier versions are read as those with current keys. An old key
//! besides its current one, and an unknown key, are refused with one clear message.

use chaic_learn::opponent::train::OpponentTrainer;
use chaic_learn::train::{CloningConfig, PolicyTrainer, PpoTrainingConfig};
use chaic_learn::visual::train::VisualTrainer;
use chaic_training::conformance::check_renamed_keys;
use chaic_training::parse_config;

type Ppo = PolicyTrainer<PpoTrainingConfig>;
type Cloning = PolicyTrainer<CloningConfig>;

#[test]
fn old_keys_are_read_and_conflicting_and_unknown_keys_are_refused() {
    const PLAY: (&str, &str, &str) = ("play", "rollout", "{ episodes = 3 }");
    check_renamed_keys::<Ppo>("", &[PLAY]);
    check_renamed_keys::<Ppo>(
        "[ppo]\n",
        &[
            ("discount", "gamma", "0.5"),
            ("trace", "gae_lambda", "0.25"),
            ("clip", "clip_range", "0.125"),
            ("clip_value", "clip_range_vf", "0.5"),
            ("entropy", "ent_coef", "0.0625"),
            ("value", "vf_coef", "0.75"),
            ("epochs", "n_epochs", "2"),
            ("batch", "batch_size", "32"),
            ("rate", "learning_rate", "0.5"),
            ("rate_falls", "anneal_lr", "false"),
            ("divergence", "target_kl", "0.25"),
        ],
    );
    check_renamed_keys::<Ppo>("[ppo.adam]\n", &[("clip_norm", "max_grad_norm", "2.0")]);
    check_renamed_keys::<Ppo>(
        "[rollout]\n",
        &[("proposals", "infer_hint", "true"), ("memory", "n_past_decisions", "2")],
    );
    check_renamed_keys::<Ppo>(
        "[rollout.rewards]\n",
        &[
            ("team", "delivered", "1.0"),
            ("own", "own_delivered", "1.0"),
            ("way_per_m", "remaining_per_m", "0.5"),
        ],
    );
    check_renamed_keys::<Cloning>(
        "",
        &[
            PLAY,
            ("teacher", "expert", "{ helper = \"rhp\" }"),
            ("mixed", "learner_fraction", "0.25"),
            ("discount", "gamma", "0.5"),
            ("batch", "batch_size", "32"),
            ("rate", "learning_rate", "0.5"),
        ],
    );
    check_renamed_keys::<VisualTrainer>(
        "",
        &[("updates", "n_updates", "7"), ("envs", "n_envs", "2"), ("rollout", "n_steps", "5")],
    );
    check_renamed_keys::<VisualTrainer>(
        "[rewards]\ndelivered = 10.0\ninvalid = 0.1\n",
        &[("approached_per_m", "progress_per_m", "0.5")],
    );
    check_renamed_keys::<OpponentTrainer>(
        "",
        &[
            ("batch", "batch_size", "32"),
            ("rate", "learning_rate", "0.5"),
            ("target", "target_coef", "2.0"),
            ("limits", "limits_coef", "3.0"),
            ("validation_of_each", "validation_max_per_class", "5"),
        ],
    );
    check_renamed_keys::<OpponentTrainer>("[collect]\n", &[("of_each", "max_per_class", "7")]);
}

#[test]
fn values_of_old_keys_are_checked_against_the_bounds_of_current_ones() {
    for (text, expected) in [
        ("[ppo]\ndiscount = 1.5", "`ppo.gamma` is 1.5"),
        ("[play]\nepisodes = 0", "`rollout.episodes` is 0"),
        ("[rollout.rewards]\nteam = 2000.0", "`rollout.rewards.delivered` is 2000"),
    ] {
        let problem = parse_config::<Ppo>(text).unwrap_err();
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
    }
}
