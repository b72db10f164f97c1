//! Promises: windows are numbers within bounds with labels that fit them, and survive being written; the model learns
//! from them, the same bits whether or not it was interrupted; reports count right.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::TaskId;
use chaic_core::capability::Persona;
use chaic_learn::choice_network::Decision;
use chaic_learn::opponent::collect::{CollectRules, Part, Sample, collect, read, write};
use chaic_learn::opponent::network::{OpponentModel, network};
use chaic_learn::opponent::report::Report;
use chaic_learn::opponent::train::{OpponentRules, OpponentTraining};
use chaic_learn::opponent::window::{N_CLASS, N_STATE};
use chaic_learn::opponent::{Goal, N_LIMITS, limits_of};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{CHECKPOINT, CONFIG, CURVES, Training, TrainingError, TrainingRun};

static NEVER: AtomicBool = AtomicBool::new(false);

fn few() -> CollectRules {
    CollectRules {
        of_each: 30,
        episodes: 3,
        tasks: vec![TaskId::LowTarget, TaskId::Shopping, TaskId::MovingHouse],
        image_size: 64,
        granted: true,
        ..CollectRules::default()
    }
}

#[test]
fn windows_are_within_bounds_and_survive_being_written() {
    let samples = collect(Part::Test, &few(), &mut |_| (), &NEVER).unwrap().unwrap();
    assert!(samples.iter().any(|s| s.goal == Goal::Unknown));
    assert!(samples.iter().any(|s| s.target.is_some()));
    for sample in &samples {
        let Decision { state, choices, n_choices } = &sample.window;
        assert_eq!((state.len(), choices.len()), (N_STATE, n_choices * N_CLASS));
        let all = || state.iter().chain(choices);
        assert!(all().all(|x| (-1.0..=1.0).contains(x)), "{:?}", all().collect::<Vec<_>>());
        assert!(sample.target.is_none_or(|t| t < *n_choices && sample.goal == Goal::Pick));
        let is_seen = state[0] > 0.0;
        assert_eq!(is_seen, sample.goal != Goal::Unknown, "{sample:?}");
        assert!(sample.limits.iter().all(|x| (0.0..=1.0).contains(x)));
    }
    assert!(samples == collect(Part::Test, &few(), &mut |_| (), &NEVER).unwrap().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("windows.safetensors");
    write(&path, &samples).unwrap();
    assert!(samples == read(&path).unwrap());
    let bytes = fs::read(&path).unwrap();
    for n in [0, 7, bytes.len() / 2, bytes.len() - 1] {
        fs::write(&path, &bytes[..n]).unwrap();
        let problem = read(&path).err().unwrap().to_string();
        assert!(problem.contains("windows.safetensors") && !problem.contains('\n'), "{problem}");
    }
}

#[test]
fn limits_are_those_of_bodies() {
    let of = |persona: Persona| limits_of(&persona.capability());
    assert_eq!(of(Persona::Adult), [1.0; N_LIMITS]);
    assert_eq!(of(Persona::Child), [0.0, 1.0, 0.0, 1.0, 1.0]);
    assert_eq!(of(Persona::Wheelchair), [0.0, 0.0, 0.8, 1.0, 0.0]);
    assert_eq!(of(Persona::Rider)[3], 0.0);
    assert_eq!(of(Persona::Frail)[2], 0.0);
}

#[test]
fn the_model_learns_and_a_pause_changes_no_bit() {
    let rules = OpponentRules {
        steps: 60,
        warm_up: 5,
        validation_of_each: 10,
        collect: few(),
        ..OpponentRules::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let mut quiet = |_: &str| ();
    let stop = AtomicBool::new(false);
    let checkpoints = [false, true].map(|pauses| {
        let out = folder.path().join(format!("{pauses}"));
        let begun = TrainingRun::<OpponentTraining>::begin(&out, &rules, None, &mut quiet, &stop);
        let mut run = begun.unwrap().unwrap();
        if pauses {
            // It is asked before the first step, which is not taken then.
            stop.store(true, Ordering::Relaxed);
            assert!(!run.go_on(&stop, &mut |_| {}).unwrap());
            stop.store(false, Ordering::Relaxed);
            drop(run);
            run = TrainingRun::resume(&out, &mut quiet, &stop).unwrap().unwrap();
        }
        assert!(run.go_on(&stop, &mut |_| {}).unwrap());
        fs::read(out.join(CHECKPOINT)).unwrap()
    });
    assert!(checkpoints[0] == checkpoints[1]);
    let out = folder.path().join("false");
    let curves = fs::read_to_string(out.join(CURVES)).unwrap();
    assert!(curves.contains("goal_accuracy"), "{curves}");
    // What it learned from, it tells better than it began with.
    let samples = read(&out.join("windows.safetensors")).unwrap();
    let bytes = fs::read(out.join("opponent.safetensors")).unwrap();
    let learned = Report::of(&OpponentModel::from_bytes(&bytes).unwrap(), &samples, &NEVER);
    let begun = Report::of(&OpponentModel::new(network().network.begin(1)), &samples, &NEVER);
    let (learned, begun) = (learned.unwrap(), begun.unwrap());
    assert!(learned.goal_accuracy.mean > begun.goal_accuracy.mean + 0.3, "{learned:?} {begun:?}");
    assert!(learned.limits_error.mean < begun.limits_error.mean, "{learned:?} {begun:?}");
}

#[test]
fn reports_count_each_goal_as_much() {
    let sample = |goal: Goal, episode: u32| Sample {
        window: Decision {
            state: vec![0.0; N_STATE],
            choices: vec![0.0; 2 * N_CLASS],
            n_choices: 2,
        },
        goal,
        target: (goal == Goal::Pick).then_some(0),
        limits: [1.0; N_LIMITS],
        episode,
    };
    // All windows are alike, so one goal is told of all of them.
    let mut samples: Vec<Sample> = (0..9).map(|k| sample(Goal::Unknown, k)).collect();
    samples.push(sample(Goal::Pick, 9));
    let report = Report::of(&OpponentModel::new(network().network.begin(1)), &samples, &NEVER);
    let report = report.unwrap();
    let column = |k: usize| report.confusion.iter().map(|row| row[k]).sum::<usize>();
    let told = (0..Goal::ALL.len()).find(|k| column(*k) == 10).unwrap();
    let is_right = [Goal::Unknown, Goal::Pick].iter().any(|goal| goal.index() == told);
    let accuracy = if is_right { 0.5 } else { 0.0 };
    assert!((report.goal_accuracy.mean - accuracy).abs() < 1e-9, "{report:?}");
    assert_eq!((report.goal_accuracy.n, report.target_accuracy.n), (10, 1));
}

#[test]
fn damaged_checkpoints_and_numbers_out_of_bounds_are_refused() {
    let rules = OpponentRules {
        steps: 60,
        validation_of_each: 10,
        collect: CollectRules { episodes: 1, ..few() },
        ..OpponentRules::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let training = OpponentTraining::new(&rules, folder.path(), &mut |_| (), &NEVER);
    let mut training = training.unwrap().unwrap();
    refuses_damaged_checkpoints(&mut training);
    bounds_every_number::<OpponentTraining>();
    let raised = AtomicBool::new(true);
    assert!(training.validate(&raised).unwrap().is_none());
    assert!(collect(Part::Test, &few(), &mut |_| (), &raised).unwrap().is_none());
}

#[test]
fn windows_that_cannot_be_read_are_refused_before_the_folder_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let (out, empty) = (folder.path().join("out"), folder.path().join("empty"));
    write(&empty, &[]).unwrap();
    for (windows, word) in [(folder.path().join("missing"), "missing"), (empty, "no windows")] {
        let rules = OpponentRules { windows: Some(windows), ..OpponentRules::default() };
        let begun = TrainingRun::<OpponentTraining>::begin(&out, &rules, None, &mut |_| (), &NEVER);
        let error = begun.err().unwrap();
        assert!(matches!(error, TrainingError::Rules(_)), "{error}");
        assert!(error.to_string().contains(word), "{error}");
        assert!(!out.join(CONFIG).exists() && !out.exists());
    }
}
