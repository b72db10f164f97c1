//! Features lie within bounds. Equal seeds give equal weights, with or without an interruption.
//! Errors about bad files take one line.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::TaskId;
use chaic_env::RewardWeights;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_learn::candidate_scorer::CandidateSet;
use chaic_learn::features::{N_PLAN_FEATURES, N_STATE_FEATURES};
use chaic_learn::helpers::{NamedPolicy, PolicyRegistry};
use chaic_learn::opponent;
use chaic_learn::opponent::network::OpponentInput;
use chaic_learn::policy::ActionSelection;
use chaic_learn::policy_kind::{PolicyKind, PolicyWeights};
use chaic_learn::ppo::PpoConfig;
use chaic_learn::rollout::{RolloutContext, RolloutEpisode, rollout};
use chaic_learn::train::{CloningConfig, PolicyTrainer, PpoTrainingConfig, RolloutConfig};
use chaic_learn::visual::actions::ActionSpace;
use chaic_learn::visual::train::{VisualConfig, VisualTrainer};
use chaic_nn::weights;
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::run::checkpoint_bytes;
use chaic_training::{
    CHECKPOINT, CONFIG, CURVES, Trainer, TrainingError, TrainingRun, parse_config, read_config_with,
};

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

fn small_rollout() -> RolloutConfig {
    RolloutConfig {
        episodes: 2,
        tasks: vec![TaskId::LowTarget, TaskId::MovingHouse],
        image_size: 32,
        validation_episodes: 1,
        ..RolloutConfig::default()
    }
}

/// Returns the checkpoint after all steps, with or without an interruption before the last one.
fn run_training<T: Trainer>(config: &T::Config, folder: &Path, is_paused: bool) -> Vec<u8> {
    let mut quiet = |_: &str| ();
    let stop = AtomicBool::new(false);
    let mut run =
        TrainingRun::<T>::start(folder, config, None, &mut quiet, &stop).unwrap().unwrap();
    if is_paused {
        let is_complete = run.run(&stop, &mut |_| {
            stop.store(true, Ordering::Relaxed);
        });
        assert!(!is_complete.unwrap());
        drop(run);
        stop.store(false, Ordering::Relaxed);
        run = TrainingRun::<T>::resume(folder, &mut quiet, &stop).unwrap().unwrap();
        assert_eq!(run.progress(), (1, 2));
    }
    assert!(run.run(&stop, &mut |_| {}).unwrap());
    fs::read(folder.join(CHECKPOINT)).unwrap()
}

#[test]
fn interrupted_trainings_end_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let ppo = PpoTrainingConfig {
        iterations: 2,
        rollout: small_rollout(),
        ..PpoTrainingConfig::default()
    };
    let [uninterrupted, resumed] = [false, true].map(|is_paused| {
        let folder = folder.path().join(format!("policy {is_paused}"));
        run_training::<PolicyTrainer<PpoTrainingConfig>>(&ppo, &folder, is_paused)
    });
    assert!(uninterrupted == resumed);
    let clone = CloningConfig {
        iterations: 2,
        n_steps: 5,
        rollout: RolloutConfig {
            infer_hint: true,
            n_past_decisions: 4,
            partners: vec!["slow".to_owned()],
            ..small_rollout()
        },
        ..CloningConfig::default()
    };
    let [uninterrupted, resumed] = [false, true].map(|is_paused| {
        let folder = folder.path().join(format!("clone {is_paused}"));
        run_training::<PolicyTrainer<CloningConfig>>(&clone, &folder, is_paused)
    });
    assert!(uninterrupted == resumed);
    // A trained policy is a helper of a run.
    let weights =
        folder.path().join("policy true").join(PolicyTrainer::<PpoTrainingConfig>::WEIGHTS);
    let policy = NamedPolicy::read("mine", &weights).unwrap();
    let helpers = PolicyRegistry::bundled(&BuiltInHelpers, Arc::new(GroundTruthPerceptionFactory))
        .with_policies(vec![policy])
        .unwrap();
    assert!(helpers.names().contains(&"mine".to_owned()));
    assert!(helpers.make("mine", chaic_agents::PlannerRules::paper()).is_some());
    // A truncated checkpoint.
    let folder = folder.path().join("policy true");
    fs::write(folder.join(CHECKPOINT), &uninterrupted[..uninterrupted.len() / 2]).unwrap();
    let refused =
        TrainingRun::<PolicyTrainer<PpoTrainingConfig>>::resume(&folder, &mut |_| (), &NEVER_STOP);
    assert!(matches!(refused, Err(TrainingError::Checkpoint { .. })));
}

#[test]
fn experts_generators_and_penalties_are_checked_before_a_training() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut config = PpoTrainingConfig { rollout: small_rollout(), ..PpoTrainingConfig::default() };
    config.ppo.kl_coef = 0.1;
    let started = TrainingRun::<PolicyTrainer<PpoTrainingConfig>>::start(
        &out,
        &config,
        None,
        &mut |_| (),
        &NEVER_STOP,
    );
    let problem = started.err().unwrap().to_string();
    assert!(problem.contains("kl_coef") && problem.contains("--weights"), "{problem}");
    assert!(!out.exists());
    let mut config = VisualConfig::default();
    config.ppo.kl_coef = 0.1;
    let started =
        TrainingRun::<VisualTrainer>::start(&out, &config, None, &mut |_| (), &NEVER_STOP);
    let problem = started.err().unwrap().to_string();
    assert!(problem.contains("kl_coef") && problem.contains("--weights"), "{problem}");
    assert!(!out.exists());
    // A resumed training takes no weights.
    let config = PpoTrainingConfig { rollout: small_rollout(), ..PpoTrainingConfig::default() };
    type PpoRun = TrainingRun<PolicyTrainer<PpoTrainingConfig>>;
    drop(PpoRun::start(&out, &config, None, &mut |_| (), &NEVER_STOP).unwrap().unwrap());
    let text = fs::read_to_string(out.join(CONFIG)).unwrap();
    fs::write(out.join(CONFIG), text.replace("kl_coef = 0.0", "kl_coef = 0.5")).unwrap();
    let resumed = PpoRun::resume(&out, &mut |_| (), &NEVER_STOP);
    let problem = resumed.err().unwrap().to_string();
    assert!(problem.contains("only a new training takes by --weights"), "{problem}");
    for (text, words) in [
        ("[expert]\nhelper = \"random\"", ["expert.helper", "follow, rhp, oracle"]),
        ("[rollout]\nsplits = [\"test\"]", ["rollout.splits", "gen, gen-standard"]),
        ("[rollout]\nsplits = []", ["rollout.splits", "empty"]),
        ("[rollout]\npartners = [\"fast\"]", ["rollout.partners", "rules, farthest"]),
        ("[rollout]\nappearance = \"dark\"", ["`dark`", "`canonical` or `varied`"]),
    ] {
        let problem = parse_config::<PolicyTrainer<CloningConfig>>(text).unwrap_err();
        assert!(words.iter().all(|word| problem.contains(word)), "{problem}");
    }
}

#[test]
fn assignments_replace_values_of_the_file_before_they_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("visual.toml");
    fs::write(&path, "n_updates = 7\nopponent = \"missing\"\ntasks = []\n").unwrap();
    let weights = folder.path().join("opponent.safetensors");
    let network = opponent::network::network().network;
    let kind = opponent::network::kind(false);
    let bytes = weights::to_bytes(&network, &network.init_parameters(1), kind).unwrap();
    fs::write(&weights, bytes).unwrap();
    let of_opponent = format!("opponent={}", weights.display());
    let read = |set: &[String]| read_config_with::<VisualTrainer>(Some(&path), set);
    assert!(read(&[]).is_err() && read(std::slice::from_ref(&of_opponent)).is_err());
    let config = read(&[of_opponent, "tasks=[\"shopping\"]".to_owned()]).unwrap();
    assert_eq!((config.n_updates, config.opponent), (7, Some(weights)));
    assert_eq!(config.tasks, [TaskId::Shopping]);
}

#[test]
fn inputs_are_normalized_only_from_the_start() {
    let kind = PolicyKind::PLAIN;
    let model = kind.network();
    let mut parameters = model.network.init_parameters(1);
    let mut config = PpoTrainingConfig { rollout: small_rollout(), ..PpoTrainingConfig::default() };
    config.rollout.normalize = true;
    let read = |config: &PpoTrainingConfig, parameters: &[f32]| {
        let bytes = weights::to_bytes(&model.network, parameters, &kind.name()).unwrap();
        PolicyTrainer::read_weights(config, &bytes)
    };
    let problem = read(&config, &parameters).unwrap_err().to_string();
    assert!(problem.contains("rollout.normalize"), "{problem}");
    assert!(read(&PpoTrainingConfig::default(), &parameters).is_ok());
    let (n_state, n_plan) = kind.n_features();
    let observation = CandidateSet {
        state: vec![0.5; n_state],
        candidates: vec![0.5; n_plan],
        n_candidates: 1,
        memory: Vec::new(),
    };
    model.update_normalizer(&mut parameters, std::iter::once(&observation), 0);
    assert!(read(&config, &parameters).is_ok());
}

#[test]
fn a_training_whose_opponent_or_normalizer_changed_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("opponent");
    let write = |seed: u64, is_granted: bool| {
        let network = opponent::network::network().network;
        let parameters = network.init_parameters(seed);
        let kind = opponent::network::kind(is_granted);
        fs::write(&path, weights::to_bytes(&network, &parameters, kind).unwrap()).unwrap();
    };
    let mut config = PpoTrainingConfig { rollout: small_rollout(), ..PpoTrainingConfig::default() };
    config.rollout.opponent = Some(path.clone());
    let new = |config: &PpoTrainingConfig| {
        let trainer = PolicyTrainer::new(config, folder.path(), &mut |_| (), &NEVER_STOP);
        trainer.unwrap().unwrap()
    };
    write(1, false);
    let mut checkpoint = new(&config).checkpoint();
    checkpoint.insert_integers("policy.iterations", vec![1]);
    assert_eq!(new(&config).resume(&checkpoint, &NEVER_STOP), Ok(Some(())));
    let refused = |config: &PpoTrainingConfig, word: &str| {
        let mut trainer = new(config);
        let before = trainer.checkpoint();
        let problem = trainer.resume(&checkpoint, &NEVER_STOP).unwrap_err().to_string();
        assert!(problem.contains(word) && !problem.contains('\n'), "{problem}");
        assert!(trainer.checkpoint() == before);
    };
    let mut normalized = config.clone();
    normalized.rollout.normalize = true;
    refused(&normalized, "`rollout.normalize`");
    write(2, true);
    refused(&config, "`rollout.opponent` has changed");
}

#[test]
fn damaged_checkpoints_and_values_out_of_bounds_are_refused() {
    fn check<T: Trainer>(config: &T::Config) {
        let folder = tempfile::tempdir().unwrap();
        let trainer = T::new(config, folder.path(), &mut |_| (), &NEVER_STOP);
        let mut trainer = trainer.unwrap().unwrap();
        // Sections of taken decisions are empty before the first step.
        trainer.step(&NEVER_STOP).unwrap().unwrap();
        refuses_damaged_checkpoints(&mut trainer);
        bounds_every_number::<T>();
    }
    let policy = PpoTrainingConfig { rollout: small_rollout(), ..PpoTrainingConfig::default() };
    check::<PolicyTrainer<PpoTrainingConfig>>(&policy);
    check::<PolicyTrainer<CloningConfig>>(&CloningConfig {
        n_steps: 5,
        rollout: small_rollout(),
        ..CloningConfig::default()
    });
    check::<VisualTrainer>(&VisualConfig { n_envs: 2, ..VisualConfig::default() });
}

#[test]
fn missing_keys_of_inner_tables_have_the_defaults_of_the_training() {
    let ppo = parse_config::<PolicyTrainer<PpoTrainingConfig>>;
    let mut expected = PpoTrainingConfig::default();
    expected.ppo.kl_coef = 0.5;
    assert_eq!(ppo("[ppo]\nkl_coef = 0.5"), Ok(expected));
    let mut expected = PpoTrainingConfig::default();
    (expected.ppo.gamma, expected.ppo.adam.beta1) = (0.5, 0.25);
    assert_eq!(ppo("[ppo]\ndiscount = 0.5\n[ppo.adam]\nbeta1 = 0.25"), Ok(expected));
    let mut expected = CloningConfig::default();
    expected.adam.beta1 = 0.25;
    assert_eq!(parse_config::<PolicyTrainer<CloningConfig>>("[adam]\nbeta1 = 0.25"), Ok(expected));
    let mut expected = VisualConfig::default();
    (expected.ppo.n_epochs, expected.rewards.delivered) = (4, 5.0);
    let visual = parse_config::<VisualTrainer>("[ppo]\nn_epochs = 4\n[rewards]\ndelivered = 5.0");
    assert_eq!(visual, Ok(expected));
}

#[test]
fn configurations_that_exceed_memory_are_refused_by_key() {
    for (text, names) in [
        ("n_envs = 1024\nimage_size = 512", ["n_envs", "image_size"]),
        ("n_envs = 1024\nn_steps = 1024", ["n_envs", "n_steps"]),
    ] {
        let problem = parse_config::<VisualTrainer>(text).unwrap_err();
        assert!(names.iter().all(|name| problem.contains(name)), "{problem}");
    }
    // Demonstrations take 16 GiB at most.
    let clone = |max_episodes: usize, n_past_decisions: usize| {
        let rollout = format!("[rollout]\nn_past_decisions = {n_past_decisions}");
        parse_config::<PolicyTrainer<CloningConfig>>(&format!(
            "max_episodes = {max_episodes}\n{rollout}"
        ))
    };
    let default = CloningConfig::default().max_episodes;
    for (max_episodes, n_past_decisions) in [(default, 8), (default, 32), (100_000, 0)] {
        assert!(clone(max_episodes, n_past_decisions).is_ok(), "{max_episodes}");
    }
    let problem = clone(100_000, 8).unwrap_err();
    let names = ["`max_episodes` is 100000", "`rollout.n_past_decisions = 8`", "1 to 37347"];
    assert!(names.iter().all(|name| problem.contains(name)), "{problem}");
}

/// Raises the flag after a delay, as a signal may at any time.
fn raise_after(delay: Duration) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let is_raised = Arc::clone(&stop);
    std::thread::spawn(move || {
        std::thread::sleep(delay);
        is_raised.store(true, Ordering::Relaxed);
    });
    stop
}

#[test]
fn stopped_steps_change_nothing() {
    fn check<T: Trainer>(config: &T::Config) {
        let folder = tempfile::tempdir().unwrap();
        let new = || T::new(config, folder.path(), &mut |_| (), &NEVER_STOP).unwrap().unwrap();
        let (mut uninterrupted, mut stopped) = (new(), new());
        let before = stopped.checkpoint();
        let mut n_stopped = 0;
        for delay_ms in [0, 20, 60, 120, 200] {
            let stop = raise_after(Duration::from_millis(delay_ms));
            if stopped.step(&stop).unwrap().is_some() {
                // The step ended before the flag was raised.
                stopped = new();
                continue;
            }
            n_stopped += 1;
            assert!(stopped.checkpoint() == before, "{} after {delay_ms} ms", T::KIND);
        }
        assert!(n_stopped > 0, "{}", T::KIND);
        let [expected, found] = [&mut uninterrupted, &mut stopped].map(|t| t.step(&NEVER_STOP));
        assert!(expected.unwrap() == found.unwrap());
        assert_eq!(uninterrupted.steps_done(), 1);
        assert!(uninterrupted.checkpoint() == stopped.checkpoint(), "{}", T::KIND);
        let is_raised = AtomicBool::new(true);
        assert!(stopped.validate(&is_raised).unwrap().is_none());
        assert!(T::new(config, folder.path(), &mut |_| (), &is_raised).is_ok());
    }
    let policy = PpoTrainingConfig { rollout: small_rollout(), ..PpoTrainingConfig::default() };
    check::<PolicyTrainer<PpoTrainingConfig>>(&policy);
    check::<PolicyTrainer<CloningConfig>>(&CloningConfig {
        n_steps: 5,
        rollout: small_rollout(),
        ..CloningConfig::default()
    });
    for action_space in ActionSpace::ALL {
        check::<VisualTrainer>(&visual(action_space));
    }
}

/// Returns a configuration in which updates end within episodes and episodes within updates.
fn visual(action_space: ActionSpace) -> VisualConfig {
    VisualConfig {
        action_space,
        n_updates: 2,
        n_envs: 2,
        n_steps: match action_space {
            ActionSpace::Plans => 40,
            ActionSpace::Primitives => 150,
        },
        image_size: 128,
        tasks: vec![TaskId::MovingHouse],
        validation_episodes: 1,
        ppo: PpoConfig { batch_size: 50, n_epochs: 1, shards: 2, ..PpoConfig::default() },
        ..VisualConfig::default()
    }
}

/// Writes random weights of an opponent model that is granted the partner's actions; returns the
/// parameters.
fn write_opponent(file: &Path) -> Vec<f32> {
    let network = opponent::network::network().network;
    let parameters = network.init_parameters(7);
    let kind = opponent::network::kind(true);
    fs::write(file, weights::to_bytes(&network, &parameters, kind).unwrap()).unwrap();
    parameters
}

/// Else the opponent model would read inputs on which it was not trained.
#[test]
fn trainings_with_a_granted_opponent_model_need_granted_behavior() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("opponent.safetensors");
    write_opponent(&file);
    for (behavior, is_refused) in [("gt", false), ("learned", true)] {
        let keys = format!("opponent = {file:?}\nbehavior = {behavior:?}");
        let in_rollout = format!("[rollout]\n{keys}");
        for (problem, table) in [
            (parse_config::<VisualTrainer>(&keys).err(), ""),
            (parse_config::<PolicyTrainer<CloningConfig>>(&in_rollout).err(), "rollout."),
        ] {
            assert_eq!(problem.is_some(), is_refused, "{problem:?}");
            let expected = format!("needs `{table}behavior = \"gt\"`");
            assert!(problem.is_none_or(|problem| problem.contains(&expected)), "{expected}");
        }
    }
}

#[test]
fn interrupted_visual_trainings_end_with_the_same_bits() {
    for action_space in ActionSpace::ALL {
        check_interrupted_visual_training(action_space);
    }
}

fn check_interrupted_visual_training(action_space: ActionSpace) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("opponent.safetensors");
    write_opponent(&file);
    let config = VisualConfig { opponent: Some(file), ..visual(action_space) };
    let checkpoints = [false, true].map(|is_paused| {
        let out = folder.path().join(format!("{is_paused}"));
        let mut quiet = |_: &str| ();
        let started =
            TrainingRun::<VisualTrainer>::start(&out, &config, None, &mut quiet, &NEVER_STOP);
        let mut run = started.unwrap().unwrap();
        if is_paused {
            drop(run);
            let trainer = VisualTrainer::new(&config, &out, &mut quiet, &NEVER_STOP);
            let mut trainer = trainer.unwrap().unwrap();
            let metrics = trainer.step(&NEVER_STOP).unwrap().unwrap();
            let bytes = checkpoint_bytes(&trainer, &[metrics]).unwrap();
            fs::write(out.join(CHECKPOINT), bytes).unwrap();
            run = TrainingRun::resume(&out, &mut quiet, &NEVER_STOP).unwrap().unwrap();
            assert_eq!(run.progress(), (1, 2));
        }
        assert!(run.run(&NEVER_STOP, &mut |_| {}).unwrap());
        fs::read(out.join(CHECKPOINT)).unwrap()
    });
    assert!(checkpoints[0] == checkpoints[1]);
    let curves = fs::read_to_string(folder.path().join("true").join(CURVES)).unwrap();
    assert!(curves.contains("\"tr_baseline\""), "{curves}");
    let weights = folder.path().join("true").join(VisualTrainer::WEIGHTS);
    let policy = NamedPolicy::read("mine", &weights).unwrap();
    let helpers = PolicyRegistry::bundled(&BuiltInHelpers, Arc::new(GroundTruthPerceptionFactory))
        .with_policies(vec![policy])
        .unwrap();
    let helper = helpers.make("mine", chaic_agents::PlannerRules::paper()).unwrap();
    assert!(helper.grants.behavior, "as the opponent model");
}

#[test]
fn policy_weights_include_the_opponent_model() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("opponent.safetensors");
    let parameters = write_opponent(&file);
    let rollout_config = RolloutConfig { opponent: Some(file.clone()), ..small_rollout() };
    let config = PpoTrainingConfig {
        iterations: 2,
        rollout: rollout_config,
        ..PpoTrainingConfig::default()
    };
    let [uninterrupted, resumed] = [false, true].map(|is_paused| {
        let folder = folder.path().join(format!("policy {is_paused}"));
        run_training::<PolicyTrainer<PpoTrainingConfig>>(&config, &folder, is_paused)
    });
    assert!(uninterrupted == resumed);
    let file_name = PolicyTrainer::<PpoTrainingConfig>::WEIGHTS;
    let bytes = fs::read(folder.path().join("policy true").join(file_name)).unwrap();
    let policy = PolicyWeights::from_bytes(&bytes).unwrap();
    assert_eq!(policy.kind.opponent, OpponentInput::Granted);
    assert_eq!(policy.opponent.unwrap().parameters(), parameters);
    // A training from these weights has the model that it names, not that of the weights.
    let other_file = folder.path().join("other.safetensors");
    let network = opponent::network::network().network;
    let other = network.init_parameters(8);
    let kind = opponent::network::kind(true);
    fs::write(&other_file, weights::to_bytes(&network, &other, kind).unwrap()).unwrap();
    let rollout = RolloutConfig { opponent: Some(other_file), ..config.rollout.clone() };
    let other_config = PpoTrainingConfig { rollout, ..config.clone() };
    let initial = PolicyTrainer::<PpoTrainingConfig>::read_weights(&other_config, &bytes).unwrap();
    assert!(initial.windows(other.len()).any(|window| window == other));
    // A missing file or one of another network is refused before anything is written.
    for (bytes, word) in [(&b"nothing"[..], "not a weights file"), (&bytes, "plan policy")] {
        fs::write(&file, bytes).unwrap();
        let problem = PolicyTrainer::<PpoTrainingConfig>::check(&config).unwrap_err();
        assert!(problem.contains("opponent.safetensors") && problem.contains(word), "{problem}");
    }
}

#[test]
fn features_lie_within_bounds_and_rewards_sum_to_the_score() {
    let model = PolicyKind::PLAIN.network();
    let parameters = model.network.init_parameters(1);
    let weights = Arc::new(PolicyWeights::new(PolicyKind::PLAIN, &model, parameters));
    let context = RolloutContext {
        perception: &GroundTruthPerceptionFactory,
        image_size: 64,
        selection: ActionSelection::TRAINING,
        gamma: 1.0,
        rewards: RewardWeights { delivered: 1.0, ..RewardWeights::NONE },
        stop: &NEVER_STOP,
    };
    for id in ["shopping/gen/40000001", "obstacle/gen/40000001"] {
        let result = rollout(&RolloutEpisode::new(id), &weights, &context).unwrap().unwrap();
        let mut reward = 0.0;
        let mut frames = 0.0;
        for transition in &result.trajectory.transitions {
            let decision = &transition.observation;
            assert_eq!(decision.state.len(), N_STATE_FEATURES);
            assert_eq!(decision.candidates.len(), decision.n_candidates * N_PLAN_FEATURES);
            let all = decision.state.iter().chain(&decision.candidates);
            assert!(all.clone().all(|x| (-1.0..=1.0).contains(x)), "{all:?}");
            reward += f64::from(transition.reward);
            frames += f64::from(transition.duration);
        }
        // Rewards sum to the score, except for the partner's deliveries before the first decision.
        assert!(reward <= result.tr + 1e-6 && reward >= 0.0, "{reward} of {}", result.tr);
        assert!(frames <= f64::from(result.frames));
        assert!(result.trajectory.transitions.len() > 5);
        assert!((result.tr - reward).abs() < 1e-4, "{reward} of {}", result.tr);
    }
}
