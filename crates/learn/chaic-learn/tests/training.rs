//! Promises: what a policy is told lies within bounds; the same seed gives the same weights, whether or not a
//! training was interrupted; bad files are told in one line.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use chaic_agents::sight::TrueSight;
use chaic_core::TaskId;
use chaic_env::minds::{BuiltIn, Helpers as _};
use chaic_learn::features::{N_PLAN, N_STATE};
use chaic_learn::helpers::{NamedPolicy, Policies};
use chaic_learn::opponent;
use chaic_learn::policy::Choosing;
use chaic_learn::ppo::PpoRules;
use chaic_learn::primitive::train::{PrimitiveRules, PrimitiveTraining};
use chaic_learn::rewards::Rewards;
use chaic_learn::rollout::{RolloutRules, play};
use chaic_learn::train::{Cloning, Kind, PlayRules, PolicyTraining, Reinforcement, from_bytes};
use chaic_nn::weights;
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::run::checkpoint_bytes;
use chaic_training::{CHECKPOINT, Training, TrainingError, TrainingRun, parse_rules};

static NEVER: AtomicBool = AtomicBool::new(false);

fn small() -> PlayRules {
    PlayRules {
        episodes: 2,
        tasks: vec![TaskId::LowTarget, TaskId::MovingHouse],
        image_size: 32,
        validation_episodes: 1,
        ..PlayRules::default()
    }
}

/// The checkpoint after all steps, with a pause before the last one or without.
fn trained<T: Training>(rules: &T::Rules, folder: &Path, pauses: bool) -> Vec<u8> {
    let mut quiet = |_: &str| ();
    let stop = AtomicBool::new(false);
    let mut run = TrainingRun::<T>::begin(folder, rules, None, &mut quiet, &stop).unwrap().unwrap();
    if pauses {
        let is_whole = run.go_on(&stop, &mut |_| {
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        assert!(!is_whole.unwrap());
        drop(run);
        stop.store(false, std::sync::atomic::Ordering::Relaxed);
        run = TrainingRun::<T>::resume(folder, &mut quiet, &stop).unwrap().unwrap();
        assert_eq!(run.extent(), (1, 2));
    }
    assert!(run.go_on(&stop, &mut |_| {}).unwrap());
    fs::read(folder.join(CHECKPOINT)).unwrap()
}

#[test]
fn a_training_that_was_interrupted_ends_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let policy = Reinforcement { iterations: 2, play: small(), ..Reinforcement::default() };
    let [whole, paused] = [false, true].map(|pauses| {
        let folder = folder.path().join(format!("policy {pauses}"));
        trained::<PolicyTraining<Reinforcement>>(&policy, &folder, pauses)
    });
    assert!(whole == paused);
    let clone = Cloning { iterations: 2, play: small(), ..Cloning::default() };
    let [whole, paused] = [false, true].map(|pauses| {
        let folder = folder.path().join(format!("clone {pauses}"));
        trained::<PolicyTraining<Cloning>>(&clone, &folder, pauses)
    });
    assert!(whole == paused);
    // What was trained is a helper of a run.
    let weights = folder.path().join("policy true").join(PolicyTraining::<Reinforcement>::WEIGHTS);
    let read = NamedPolicy::read("mine", &weights).unwrap();
    let helpers = Policies::beside(&BuiltIn, vec![read], Arc::new(TrueSight)).unwrap();
    assert!(helpers.names().contains(&"mine".to_owned()));
    assert!(helpers.make("mine", chaic_agents::PlannerRules::paper()).is_some());
    // A checkpoint that was cut off.
    let folder = folder.path().join("policy true");
    fs::write(folder.join(CHECKPOINT), &whole[..whole.len() / 2]).unwrap();
    let refused =
        TrainingRun::<PolicyTraining<Reinforcement>>::resume(&folder, &mut |_| (), &NEVER);
    assert!(matches!(refused, Err(TrainingError::Checkpoint { .. })));
}

#[test]
fn damaged_checkpoints_and_numbers_out_of_bounds_are_refused() {
    fn check<T: Training>(rules: &T::Rules) {
        let folder = tempfile::tempdir().unwrap();
        let training = T::new(rules, folder.path(), &mut |_| (), &NEVER);
        refuses_damaged_checkpoints(&mut training.unwrap().unwrap());
        bounds_every_number::<T>();
    }
    let policy = Reinforcement { play: small(), ..Reinforcement::default() };
    check::<PolicyTraining<Reinforcement>>(&policy);
    check::<PolicyTraining<Cloning>>(&Cloning { play: small(), ..Cloning::default() });
    check::<PrimitiveTraining>(&PrimitiveRules { envs: 2, ..PrimitiveRules::default() });
}

#[test]
fn what_memory_cannot_hold_is_refused_by_name() {
    for (text, names) in [
        ("envs = 1024\nimage_size = 512", ["envs", "image_size"]),
        ("envs = 1024\nrollout = 1024", ["envs", "rollout"]),
    ] {
        let problem = parse_rules::<PrimitiveTraining>(text).unwrap_err();
        assert!(names.iter().all(|name| problem.contains(name)), "{problem}");
    }
}

/// Raises the flag after a while, as a signal may at any moment.
fn raised_after(delay: Duration) -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&stop);
    std::thread::spawn(move || {
        std::thread::sleep(delay);
        raised.store(true, Ordering::Relaxed);
    });
    stop
}

#[test]
fn steps_that_are_stopped_anywhere_change_nothing() {
    fn check<T: Training>(rules: &T::Rules) {
        let folder = tempfile::tempdir().unwrap();
        let new = || T::new(rules, folder.path(), &mut |_| (), &NEVER).unwrap().unwrap();
        let (mut whole, mut stopped) = (new(), new());
        let before = stopped.checkpoint();
        let mut n_stopped = 0;
        for delay_ms in [0, 20, 60, 120, 200] {
            let stop = raised_after(Duration::from_millis(delay_ms));
            if stopped.step(&stop).is_some() {
                // It was done before the flag was raised.
                stopped = new();
                continue;
            }
            n_stopped += 1;
            assert!(stopped.checkpoint() == before, "{} after {delay_ms} ms", T::KIND);
        }
        assert!(n_stopped > 0, "{}", T::KIND);
        assert!(whole.step(&NEVER) == stopped.step(&NEVER) && taken(&whole) == 1);
        assert!(whole.checkpoint() == stopped.checkpoint(), "{}", T::KIND);
        let raised = AtomicBool::new(true);
        assert!(stopped.validate(&raised).unwrap().is_none());
        assert!(T::new(rules, folder.path(), &mut |_| (), &raised).is_ok());
    }
    fn taken<T: Training>(training: &T) -> u64 {
        training.taken()
    }
    let policy = Reinforcement { play: small(), ..Reinforcement::default() };
    check::<PolicyTraining<Reinforcement>>(&policy);
    check::<PolicyTraining<Cloning>>(&Cloning { play: small(), ..Cloning::default() });
    check::<PrimitiveTraining>(&primitive());
}

/// Updates end within episodes, and episodes within updates.
fn primitive() -> PrimitiveRules {
    PrimitiveRules {
        updates: 2,
        envs: 2,
        rollout: 150,
        tasks: vec![TaskId::MovingHouse],
        validation_episodes: 1,
        ppo: PpoRules { batch: 50, epochs: 1, shards: 2, ..PpoRules::default() },
        ..PrimitiveRules::default()
    }
}

#[test]
fn single_actions_are_learned_with_the_same_bits_after_a_pause() {
    let rules = primitive();
    let folder = tempfile::tempdir().unwrap();
    let checkpoints = [false, true].map(|pauses| {
        let out = folder.path().join(format!("{pauses}"));
        let mut quiet = |_: &str| ();
        let begun = TrainingRun::<PrimitiveTraining>::begin(&out, &rules, None, &mut quiet, &NEVER);
        let mut run = begun.unwrap().unwrap();
        if pauses {
            drop(run);
            let one = PrimitiveTraining::new(&rules, &out, &mut quiet, &NEVER);
            let mut one = one.unwrap().unwrap();
            let figures = one.step(&NEVER).unwrap();
            let bytes = checkpoint_bytes(&one, &[figures]).unwrap();
            fs::write(out.join(CHECKPOINT), bytes).unwrap();
            run = TrainingRun::resume(&out, &mut quiet, &NEVER).unwrap().unwrap();
            assert_eq!(run.extent(), (1, 2));
        }
        assert!(run.go_on(&NEVER, &mut |_| {}).unwrap());
        fs::read(out.join(CHECKPOINT)).unwrap()
    });
    assert!(checkpoints[0] == checkpoints[1]);
    let weights = folder.path().join("true").join(PrimitiveTraining::WEIGHTS);
    let read = NamedPolicy::read("mine", &weights).unwrap();
    let helpers = Policies::beside(&BuiltIn, vec![read], Arc::new(TrueSight)).unwrap();
    assert!(helpers.make("mine", chaic_agents::PlannerRules::paper()).is_some());
}

#[test]
fn a_policy_carries_its_opponent_model_along() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("opponent.safetensors");
    let network = opponent::network::network().network;
    let numbers = network.begin(7);
    let bytes = weights::to_bytes(&network, &numbers, opponent::network::KIND).unwrap();
    fs::write(&file, bytes).unwrap();
    let play = PlayRules { opponent: Some(file.clone()), ..small() };
    let rules = Reinforcement { iterations: 2, play, ..Reinforcement::default() };
    let [whole, paused] = [false, true].map(|pauses| {
        let folder = folder.path().join(format!("policy {pauses}"));
        trained::<PolicyTraining<Reinforcement>>(&rules, &folder, pauses)
    });
    assert!(whole == paused);
    let weights = PolicyTraining::<Reinforcement>::WEIGHTS;
    let bytes = fs::read(folder.path().join("policy true").join(weights)).unwrap();
    let (kind, policy) = from_bytes(&bytes).unwrap();
    assert_eq!(kind, Kind::WithOpponent);
    assert_eq!(policy.opponent.unwrap().numbers(), numbers);
    // What isn't there, or is another network, is told before anything is written.
    for (bytes, word) in [(&b"nothing"[..], "no weights"), (&bytes, "plan policy")] {
        fs::write(&file, bytes).unwrap();
        let problem = PolicyTraining::<Reinforcement>::check(&rules).unwrap_err();
        assert!(problem.contains("opponent.safetensors") && problem.contains(word), "{problem}");
    }
}

#[test]
fn what_a_policy_is_told_lies_within_bounds() {
    let model = Kind::Plain.network();
    let numbers = model.network.begin(1);
    let trained = Arc::new(Kind::Plain.trained(&model, numbers));
    let rules = RolloutRules {
        sight: &TrueSight,
        image_size: 64,
        choosing: Choosing::Sampled,
        rewards: Rewards { team: 1.0, own: 0.0, held: 0.0, emergency: 0.0, ..Rewards::default() },
        stop: &NEVER,
    };
    for id in ["shopping/gen/40000001", "obstacle/gen/40000001"] {
        let played = play(id, 0, &trained, &rules).unwrap().unwrap();
        let mut reward = 0.0;
        let mut frames = 0.0;
        for transition in &played.trajectory.transitions {
            let decision = &transition.decision;
            assert_eq!(decision.state.len(), N_STATE);
            assert_eq!(decision.choices.len(), decision.n_choices * N_PLAN);
            let all = decision.state.iter().chain(&decision.choices);
            assert!(all.clone().all(|x| (-1.0..=1.0).contains(x)), "{all:?}");
            reward += f64::from(transition.reward);
            frames += f64::from(transition.duration);
        }
        // What is rewarded is what is scored, but for what the partner did before the first choice.
        assert!(reward <= played.tr + 1e-6 && reward >= 0.0, "{reward} of {}", played.tr);
        assert!(frames <= f64::from(played.frames));
        let first = played.trajectory.transitions.len() > 5;
        assert!(first && (played.tr - reward).abs() < 1e-4, "{reward} of {}", played.tr);
    }
}

#[test]
fn weights_of_something_else_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("other.safetensors");
    for bytes in [&b""[..], b"not a file of weights", include_bytes!("training.rs")] {
        fs::write(&file, bytes).unwrap();
        let problem = NamedPolicy::read("mine", &file).err().unwrap().to_string();
        assert!(problem.contains("other.safetensors") && !problem.contains('\n'), "{problem}");
    }
    assert!(NamedPolicy::read("mine", &folder.path().join("missing")).is_err());
}
