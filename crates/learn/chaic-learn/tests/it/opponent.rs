//! Windows lie within bounds, have consistent labels and are read back unchanged. The model learns,
//! with the same bits after an interruption. Reports count correctly.

use std::fs::{self, File};
use std::sync::atomic::AtomicBool;

use chaic_core::TaskId;
use chaic_core::capability::Persona;
use chaic_learn::candidate_scorer::CandidateSet;
use chaic_learn::opponent::collect::{
    DatasetSplit, LabeledWindow, MAX_WINDOW_BYTES, WindowCollectionConfig, collect, read,
    read_from_user_path, write,
};
use chaic_learn::opponent::network::{OpponentModel, network};
use chaic_learn::opponent::report::OpponentReport;
use chaic_learn::opponent::train::{OpponentConfig, OpponentTrainer};
use chaic_learn::opponent::window::{N_CLASS_FEATURES, N_STATE_FEATURES};
use chaic_learn::opponent::{N_BODY_LIMITS, OpponentGoal, limits};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::run::checkpoint_bytes;
use chaic_training::{CHECKPOINT, CONFIG, CURVES, Metrics, Trainer, TrainingError, TrainingRun};

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

fn small_collection() -> WindowCollectionConfig {
    WindowCollectionConfig {
        max_per_class: 30,
        episodes: 3,
        tasks: vec![TaskId::LowTarget, TaskId::Shopping, TaskId::MovingHouse],
        image_size: 64,
        granted: true,
        ..WindowCollectionConfig::default()
    }
}

#[test]
fn windows_are_within_bounds_and_read_back_unchanged() {
    let samples = collect(DatasetSplit::Test, &small_collection(), &mut |_| (), &NEVER_STOP)
        .unwrap()
        .unwrap();
    assert!(samples.iter().any(|s| s.goal == OpponentGoal::Unknown));
    assert!(samples.iter().any(|s| s.target.is_some()));
    for sample in &samples {
        let CandidateSet { state, candidates, n_candidates, .. } = &sample.window;
        assert_eq!(
            (state.len(), candidates.len()),
            (N_STATE_FEATURES, n_candidates * N_CLASS_FEATURES)
        );
        let all = || state.iter().chain(candidates);
        assert!(all().all(|x| (-1.0..=1.0).contains(x)), "{:?}", all().collect::<Vec<_>>());
        assert!(
            sample.target.is_none_or(|t| t < *n_candidates && sample.goal == OpponentGoal::Pick)
        );
        let is_visible = state[0] > 0.0;
        assert_eq!(is_visible, sample.goal != OpponentGoal::Unknown, "{sample:?}");
        assert!(sample.limits.iter().all(|x| (0.0..=1.0).contains(x)));
    }
    assert!(
        samples
            == collect(DatasetSplit::Test, &small_collection(), &mut |_| (), &NEVER_STOP)
                .unwrap()
                .unwrap()
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("windows.safetensors");
    write(&path, &samples, true).unwrap();
    assert!(samples == read(&path, true).unwrap());
    assert!(samples == read_from_user_path(&path, true).unwrap());
    let problem = read(&path, false).unwrap_err().to_string();
    assert!(problem.contains("granted = true"), "{problem}");
    let bytes = fs::read(&path).unwrap();
    for n in [0, 7, bytes.len() / 2, bytes.len() - 1] {
        fs::write(&path, &bytes[..n]).unwrap();
        let problem = read(&path, true).err().unwrap().to_string();
        assert!(problem.contains("windows.safetensors") && !problem.contains('\n'), "{problem}");
    }
}

/// While the partner goes to pick something up, the rules with the belief about its goal give the class
/// of the object a much higher probability than other classes.
#[test]
fn the_rules_and_the_belief_tell_the_target_of_the_partner() {
    let config = WindowCollectionConfig {
        max_per_class: 200,
        episodes: 4,
        tasks: vec![TaskId::LowTarget, TaskId::NoConstraint],
        image_size: 128,
        ..small_collection()
    };
    let samples = collect(DatasetSplit::Test, &config, &mut |_| (), &NEVER_STOP).unwrap().unwrap();
    let (mut of_target, mut of_others) = (0.0, 0.0);
    for (window, target) in samples.iter().filter_map(|s| Some((&s.window, s.target?))) {
        for (k, row) in window.candidates.chunks_exact(N_CLASS_FEATURES).enumerate() {
            // `is_next` is the last feature of a class.
            match k == target {
                true => of_target += row[N_CLASS_FEATURES - 1],
                false => of_others += row[N_CLASS_FEATURES - 1] / (window.n_candidates - 1) as f32,
            }
        }
    }
    assert!(of_target > 3.0 * of_others, "{of_target} {of_others}");
}

#[test]
fn limits_describe_the_body() {
    let limits_of = |persona: Persona| limits(&persona.capability());
    assert_eq!(limits_of(Persona::Adult), [1.0; N_BODY_LIMITS]);
    assert_eq!(limits_of(Persona::Child), [0.0, 1.0, 0.0, 1.0, 1.0]);
    assert_eq!(limits_of(Persona::Wheelchair), [0.0, 0.0, 0.8, 1.0, 0.0]);
    assert_eq!(limits_of(Persona::Rider)[3], 0.0);
    assert_eq!(limits_of(Persona::Frail)[2], 0.0);
}

#[test]
fn the_model_learns_and_interruption_changes_no_bit() {
    let config = OpponentConfig {
        steps: 60,
        warm_up: 5,
        validation_max_per_class: 10,
        collect: small_collection(),
        ..OpponentConfig::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let mut ignore_progress = |_: &str| ();
    let ends = [false, true].map(|is_paused| {
        let out = folder.path().join(format!("{is_paused}"));
        let started = TrainingRun::<OpponentTrainer>::start(
            &out,
            &config,
            None,
            &mut ignore_progress,
            &NEVER_STOP,
        );
        let mut run = started.unwrap().unwrap();
        if is_paused {
            drop(run);
            // After these steps, optimizer and averages differ from those of a new training.
            let trainer = OpponentTrainer::new(&config, &out, &mut ignore_progress, &NEVER_STOP);
            let mut trainer = trainer.unwrap().unwrap();
            let taken: Vec<Metrics> =
                (0..7).map(|_| trainer.step(&NEVER_STOP).unwrap().unwrap()).collect();
            fs::write(out.join(CHECKPOINT), checkpoint_bytes(&trainer, &taken).unwrap()).unwrap();
            run = TrainingRun::resume(&out, &mut ignore_progress, &NEVER_STOP).unwrap().unwrap();
            assert_eq!(run.progress(), (7, 60));
        }
        assert!(run.run(&NEVER_STOP, &mut |_| {}).unwrap());
        [CHECKPOINT, CURVES, OpponentTrainer::WEIGHTS].map(|name| fs::read(out.join(name)).unwrap())
    });
    assert!(ends[0] == ends[1]);
    let out = folder.path().join("false");
    let curves = fs::read_to_string(out.join(CURVES)).unwrap();
    assert!(curves.contains("goal_accuracy"), "{curves}");
    // On its training data the trained model is better than the initial one.
    let samples = read(&out.join("windows.safetensors"), true).unwrap();
    let bytes = fs::read(out.join("opponent.safetensors")).unwrap();
    let learned =
        OpponentReport::new(&OpponentModel::from_bytes(&bytes).unwrap(), &samples, &NEVER_STOP);
    let initial = OpponentReport::new(
        &OpponentModel::new(network().network.init_parameters(1), false),
        &samples,
        &NEVER_STOP,
    );
    let (learned, initial) = (learned.unwrap(), initial.unwrap());
    let [accuracy, before] = [&learned, &initial].map(|report| report.goal_accuracy.mean.unwrap());
    assert!(accuracy > before + 0.3, "{learned:?} {initial:?}");
    let [error, before] = [&learned, &initial].map(|report| report.limits_error.mean.unwrap());
    assert!(error < before, "{learned:?} {initial:?}");
}

#[test]
fn a_fraction_of_the_training_windows_can_validate() {
    let folder = tempfile::tempdir().unwrap();
    let config = OpponentConfig {
        steps: 2,
        held_out_fraction: 0.25,
        collect: WindowCollectionConfig { episodes: 1, ..small_collection() },
        ..OpponentConfig::default()
    };
    let out = folder.path().join("out");
    let run = TrainingRun::<OpponentTrainer>::start(&out, &config, None, &mut |_| (), &NEVER_STOP);
    assert!(run.unwrap().unwrap().run(&NEVER_STOP, &mut |_| {}).unwrap());
    assert!(out.join(OpponentTrainer::WEIGHTS).exists());
    assert!(!out.join("validation.safetensors").exists(), "no other episode was played");
    // The training continues only with the settings of its windows.
    let resume =
        || TrainingRun::<OpponentTrainer>::resume(&out, &mut |_| (), &NEVER_STOP).map(drop);
    let text = fs::read_to_string(out.join(CONFIG)).unwrap();
    for (before, after, problem) in [
        ("image_size = 64", "image_size = 80", "`collect.image_size` is 80, but was 64 when"),
        ("held_out_fraction = 0.25", "held_out_fraction = 0.5", "`held_out_fraction` is 0.5"),
        ("held_out_fraction = 0.25", "held_out_fraction = 0.0", "`held_out_fraction` is 0, but"),
        ("seed = 1", "seed = 2", "`seed` is 2, but was 1 when the windows were collected"),
    ] {
        assert!(text.contains(before), "{text}");
        fs::write(out.join(CONFIG), text.replacen(before, after, 1)).unwrap();
        let refused = resume().unwrap_err();
        assert!(refused.is_usage(), "{refused}");
        let refused = refused.to_string();
        assert!(refused.contains(problem) && !refused.contains('\n'), "{refused}");
    }
    fs::write(out.join(CONFIG), text.replacen("steps = 2", "steps = 3", 1)).unwrap();
    resume().unwrap();
    // A folder of an earlier build has no record of its settings.
    fs::remove_file(out.join("data.json")).unwrap();
    fs::write(out.join(CONFIG), text.replacen("image_size = 64", "image_size = 80", 1)).unwrap();
    resume().unwrap();
}

/// Learned recognition strips the grant, so its windows would be labeled wrongly.
#[test]
fn granted_windows_need_granted_behavior() {
    let config = |behavior: &str, granted| WindowCollectionConfig {
        behavior: behavior.to_owned(),
        granted,
        ..WindowCollectionConfig::default()
    };
    for (behavior, granted) in [("gt", true), ("gt", false), ("learned", false)] {
        assert_eq!(config(behavior, granted).check(), Ok(()));
    }
    let problem = config("learned", true).check().unwrap_err();
    assert!(
        problem.starts_with("`collect.granted` needs `collect.behavior = \"gt\"`"),
        "{problem}"
    );
}

/// Returns a window without features.
fn sample(goal: OpponentGoal, episode: u32) -> LabeledWindow {
    LabeledWindow {
        window: CandidateSet {
            state: vec![0.0; N_STATE_FEATURES],
            candidates: vec![0.0; 2 * N_CLASS_FEATURES],
            n_candidates: 2,
            memory: Vec::new(),
        },
        goal,
        target: (goal == OpponentGoal::Pick).then_some(0),
        limits: [1.0; N_BODY_LIMITS],
        episode,
    }
}

#[test]
fn a_training_is_not_resumed_with_another_file_of_windows() {
    let folder = tempfile::tempdir().unwrap();
    let (out, path) = (folder.path().join("out"), folder.path().join("w"));
    let write_windows = |n: u32| {
        let samples: Vec<LabeledWindow> = (0..n).map(|k| sample(OpponentGoal::Wait, k)).collect();
        write(&path, &samples, false).unwrap();
    };
    write_windows(4);
    let windows = Some(path.clone());
    let config = OpponentConfig { windows, held_out_fraction: 0.5, ..OpponentConfig::default() };
    let run = TrainingRun::<OpponentTrainer>::start(&out, &config, None, &mut |_| (), &NEVER_STOP);
    drop(run.unwrap().unwrap());
    let resume =
        || TrainingRun::<OpponentTrainer>::resume(&out, &mut |_| (), &NEVER_STOP).map(drop);
    write_windows(5);
    let problem = resume().unwrap_err().to_string();
    assert!(problem.contains("the data of `windows` has changed"), "{problem}");
    write_windows(4);
    resume().unwrap();
}

#[test]
fn a_training_without_validation_windows_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w");
    write(&path, &[sample(OpponentGoal::Wait, 0)], false).unwrap();
    write(&folder.path().join("validation.safetensors"), &[], false).unwrap();
    let config = OpponentConfig { windows: Some(path), ..OpponentConfig::default() };
    let trainer = OpponentTrainer::new(&config, folder.path(), &mut |_| (), &NEVER_STOP);
    let problem = trainer.err().unwrap().to_string();
    assert!(problem.contains("no validation windows"), "{problem}");
}

#[test]
fn windows_beyond_the_maximum_memory_are_refused() {
    let collection = |max_per_class, episodes| WindowCollectionConfig {
        max_per_class,
        episodes,
        ..WindowCollectionConfig::default()
    };
    // An episode gives at most 40 windows per goal.
    for (max_per_class, episodes) in [(100_000, 2_400), (1_000_000, 2_400), (20_000, 100_000)] {
        assert_eq!(collection(max_per_class, episodes).check_memory(), Ok(()));
    }
    let collect = collection(1_000_000, 100_000);
    let problem = collect.check_memory().unwrap_err();
    assert!(problem.contains("maximum of 8 GiB") && !problem.contains('\n'), "{problem}");
    let config = OpponentConfig { collect, ..OpponentConfig::default() };
    assert_eq!(OpponentTrainer::check(&config), Err(problem));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w");
    // The file has no content on the disk.
    File::create(&path).unwrap().set_len(MAX_WINDOW_BYTES + 1).unwrap();
    for problem in [read(&path, false), read_from_user_path(&path, false)].map(Result::unwrap_err) {
        assert!(problem.to_string().contains("more than the maximum"), "{problem}");
    }
}

#[test]
fn reports_weight_goals_equally() {
    // All windows are equal, so the same goal is predicted for all of them.
    let mut samples: Vec<LabeledWindow> =
        (0..9).map(|k| sample(OpponentGoal::Unknown, k)).collect();
    samples.push(sample(OpponentGoal::Pick, 9));
    let report = OpponentReport::new(
        &OpponentModel::new(network().network.init_parameters(1), false),
        &samples,
        &NEVER_STOP,
    );
    let report = report.unwrap();
    let column = |k: usize| report.confusion.iter().map(|row| row[k]).sum::<usize>();
    let predicted = (0..OpponentGoal::ALL.len()).find(|k| column(*k) == 10).unwrap();
    let is_correct =
        [OpponentGoal::Unknown, OpponentGoal::Pick].iter().any(|goal| goal.index() == predicted);
    let accuracy = if is_correct { 0.5 } else { 0.0 };
    assert!((report.goal_accuracy.mean.unwrap() - accuracy).abs() < 1e-9, "{report:?}");
    assert_eq!((report.goal_accuracy.n, report.target_accuracy.n), (10, 1));
}

#[test]
fn undefined_values_of_a_report_are_slashes_and_null() {
    let model = OpponentModel::new(network().network.init_parameters(1), false);
    let report = |samples: &[LabeledWindow]| {
        let report = OpponentReport::new(&model, samples, &NEVER_STOP).unwrap();
        (report.text(), serde_json::to_value(&report).unwrap())
    };
    // Two windows of one episode, none of them with a target.
    let (text, json) = report(&[sample(OpponentGoal::Wait, 3), sample(OpponentGoal::Wait, 3)]);
    assert!(text.contains("target accuracy    / ± /  (0 windows)"), "{text}");
    assert!(json["goal_accuracy"]["mean"].is_f64(), "{json}");
    for (value, key) in [
        ("goal_accuracy", "standard_error"),
        ("target_accuracy", "mean"),
        ("target_accuracy", "standard_error"),
    ] {
        assert!(json[value][key].is_null(), "{json}");
    }
    let (text, json) = report(&[]);
    assert!(!text.contains("0.000") && text.contains("calibration error  /\n"), "{text}");
    assert!(json["calibration_error"].is_null(), "{json}");
    assert!(json["error_of_limit"]["strength"].is_null(), "{json}");
}

#[test]
fn damaged_checkpoints_and_values_out_of_bounds_are_refused() {
    let config = OpponentConfig {
        steps: 60,
        validation_max_per_class: 10,
        collect: WindowCollectionConfig { episodes: 1, ..small_collection() },
        ..OpponentConfig::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let trainer = OpponentTrainer::new(&config, folder.path(), &mut |_| (), &NEVER_STOP);
    let mut trainer = trainer.unwrap().unwrap();
    refuses_damaged_checkpoints(&mut trainer);
    bounds_every_number::<OpponentTrainer>();
    let is_raised = AtomicBool::new(true);
    assert!(trainer.validate(&is_raised).unwrap().is_none());
    assert!(
        collect(DatasetSplit::Test, &small_collection(), &mut |_| (), &is_raised)
            .unwrap()
            .is_none()
    );
}

#[test]
fn windows_that_cannot_be_read_are_refused_before_the_folder_is_created() {
    let folder = tempfile::tempdir().unwrap();
    let (out, empty) = (folder.path().join("out"), folder.path().join("empty"));
    write(&empty, &[], false).unwrap();
    for (windows, word) in [(folder.path().join("missing"), "missing"), (empty, "no windows")] {
        let config = OpponentConfig { windows: Some(windows), ..OpponentConfig::default() };
        let started =
            TrainingRun::<OpponentTrainer>::start(&out, &config, None, &mut |_| (), &NEVER_STOP);
        let error = started.err().unwrap();
        assert!(matches!(error, TrainingError::InvalidConfig(_)), "{error}");
        assert!(error.to_string().contains(word), "{error}");
        assert!(!out.join(CONFIG).exists() && !out.exists());
    }
}
