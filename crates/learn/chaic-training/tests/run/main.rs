//! Properties of a training folder: a training that is stopped or killed anywhere ends with the
//! same files as an uninterrupted one. A refused start leaves nothing to resume. Only one process
//! trains in a folder.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::{fs, io};

use chaic_files::FileError;
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamWConfig, Network, TrainingPass};
use chaic_training::bounds::{BoundTable, LEARNING_RATE, STEPS, integer};
use chaic_training::checkpoint::Identity;
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::run::checkpoint_bytes;
use chaic_training::{
    CHECKPOINT, CONFIG, CURVES, Checkpoint, CheckpointError, CurveRecord, INITIAL_WEIGHTS, Learner,
    Metrics, Phase, Trainer, TrainingError, TrainingRun, defined_metrics, metrics,
};
use serde::{Deserialize, Serialize};

mod configuration;
mod failed_start;
mod settings;
mod validation;

/// File in the folder that interrupts the next validation.
const INTERRUPT: &str = "interrupt";
/// File in the folder that makes the score of the next validation infinite.
const INFINITE: &str = "infinite";
/// File in the folder that makes the score of the next validation undefined.
const UNDEFINED: &str = "undefined";
const WEIGHTS_KIND: &str = "toy 1";
/// First step with other metrics, in the middle of a record.
const SECOND_STAGE: u64 = 14;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ToyConfig {
    steps: u64,
    #[serde(alias = "rate")]
    learning_rate: f32,
    /// Step whose weights are not finite; 0 for none.
    breaks_at: u64,
    /// 1 if the collected data is refused, 2 if a file operation fails once, else 0.
    fails: u8,
    /// Digest of the input data; 0 without such data.
    input: u64,
    a: u8,
    b: u8,
}

impl Default for ToyConfig {
    fn default() -> ToyConfig {
        ToyConfig { steps: 24, learning_rate: 0.1, breaks_at: 0, fails: 0, input: 0, a: 0, b: 0 }
    }
}

/// Trainer that moves three parameters towards 1. `HAS_SCORE` keeps the weights whose first
/// parameter is nearest to [`BEST_X`].
struct Toy<const HAS_SCORE: bool = false> {
    config: ToyConfig,
    folder: PathBuf,
    network: Network,
    learner: Learner,
}

fn network() -> Network {
    let mut network = Network::default();
    network.extra_parameters("weights", 3);
    network
}

/// First parameter with the best score.
const BEST_X: f64 = 0.5;

impl<const HAS_SCORE: bool> Trainer for Toy<HAS_SCORE> {
    type Config = ToyConfig;
    const KIND: &'static str = "toy";
    const BOUNDS: BoundTable = &[
        ("steps", STEPS),
        ("learning_rate", LEARNING_RATE),
        ("breaks_at", integer(0, 1000)),
        ("fails", integer(0, 2)),
        ("input", integer(0, 9)),
        ("a", integer(0, 1)),
        ("b", integer(0, 1)),
    ];
    const WEIGHTS: &'static str = "toy.safetensors";
    const RECORD_STEPS: u64 = 3;
    const CHECKPOINT_STEPS: u64 = 5;
    const VALIDATION_STEPS: u64 = 8;
    const SCORE: Option<&'static str> = if HAS_SCORE { Some("score") } else { None };
    const INPUT_KEY: &'static str = "input";
    const DATA: &'static [&'static str] = &["clips", "windows", "missing"];

    fn new(
        config: &ToyConfig,
        folder: &Path,
        _: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<Toy<HAS_SCORE>>, TrainingError> {
        if config.fails > 0 && !folder.join("clips").exists() {
            fs::create_dir_all(folder.join("clips/train")).unwrap();
            fs::write(folder.join("clips/train/0"), "").unwrap();
            fs::write(folder.join("windows"), "").unwrap();
            return Err(match config.fails {
                1 => TrainingError::from_data(io::Error::other("no data")),
                _ => FileError::context("write", folder)(io::Error::other("disk full")).into(),
            });
        }
        let learner = Learner::new(&network(), 1, 2);
        let (config, folder) = (config.clone(), folder.to_owned());
        let toy = Toy { config, folder, network: network(), learner };
        Ok((!stop.load(Ordering::Relaxed)).then_some(toy))
    }

    fn check(_: &ToyConfig) -> Result<(), String> {
        Ok(())
    }

    fn read_weights(_: &ToyConfig, bytes: &[u8]) -> Result<Vec<f32>, WeightsError> {
        weights::from_bytes(&network(), bytes, WEIGHTS_KIND)
    }

    fn fixed_keys() -> Vec<&'static str> {
        vec!["a"]
    }

    fn network(&self) -> &Network {
        &self.network
    }

    fn total_steps(&self) -> u64 {
        self.config.steps
    }

    fn steps_done(&self) -> u64 {
        self.learner.adam.steps
    }

    fn input_digest(&self) -> Option<u64> {
        Some(self.config.input).filter(|digest| *digest > 0)
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn load_parameters(&mut self, parameters: Vec<f32>) {
        self.learner.load_parameters(parameters);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.learner.load(checkpoint).map(Some)
    }

    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let step = self.steps_done() + 1;
        let gradient =
            |shard: usize, parameters: &[f32], _: &mut TrainingPass, gradient: &mut [f32]| {
                for (g, x) in gradient.iter_mut().zip(parameters) {
                    *g = x - 1.0 - 0.01 * (step + shard as u64) as f32;
                }
                (!stop.load(Ordering::Relaxed)).then(|| f64::from(gradient[0].abs()))
            };
        let (adam, learning_rate) = (AdamWConfig::default(), self.config.learning_rate);
        let losses = self.learner.step(&self.network, &adam, learning_rate, gradient);
        let Some(losses) = losses else { return Ok(None) };
        if step == self.config.breaks_at {
            self.learner.parameters[1] = f32::NAN;
        }
        // As in a training of two stages, later steps have other metrics.
        Ok(Some(match step < SECOND_STAGE {
            true => metrics([("loss", losses[0]), ("other", losses[1])]),
            false => metrics([("loss", losses[0]), ("stage", step as f64), ("third", losses[1])]),
        }))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        if fs::remove_file(self.folder.join(INTERRUPT)).is_ok() {
            stop.store(true, Ordering::Relaxed);
            return Ok(None);
        }
        let bytes = weights::to_bytes(&self.network, &self.learner.parameters, WEIGHTS_KIND)?;
        let x = f64::from(self.learner.parameters[0]);
        let is_infinite = fs::remove_file(self.folder.join(INFINITE)).is_ok();
        let score = if is_infinite { f64::INFINITY } else { -(x - BEST_X).abs() };
        let is_undefined = fs::remove_file(self.folder.join(UNDEFINED)).is_ok();
        let score = (!is_undefined).then_some(score);
        Ok(Some((defined_metrics([("x", Some(x)), ("score", score)]), bytes)))
    }
}

#[test]
fn the_weights_with_the_best_score_are_kept_across_interruptions() {
    for is_paused in [false, true] {
        let dir = tempfile::tempdir().unwrap();
        let stop = AtomicBool::new(false);
        let mut records: Vec<CurveRecord> = Vec::new();
        let config = ToyConfig { steps: 40, ..ToyConfig::default() };
        let started =
            TrainingRun::<Toy<true>>::start(dir.path(), &config, None, &mut |_| (), &stop);
        let mut run = started.unwrap().unwrap();
        let mut record = |record: &CurveRecord| {
            records.push(record.clone());
            stop.store(is_paused && record.step == 24, Ordering::Relaxed);
        };
        while !run.run(&stop, &mut record).unwrap() {
            drop(run);
            stop.store(false, Ordering::Relaxed);
            run = TrainingRun::resume(dir.path(), &mut |_| (), &stop).unwrap().unwrap();
        }
        let validations = records.iter().filter(|record| record.phase == Phase::Validation);
        let scores: Vec<(f64, f64)> =
            validations.map(|record| (record.metrics["score"], record.metrics["x"])).collect();
        let best = scores.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert_ne!(scores.last(), Some(&best), "{scores:?}");
        let bytes = fs::read(dir.path().join(Toy::<true>::WEIGHTS)).unwrap();
        let parameters = weights::from_bytes(&network(), &bytes, WEIGHTS_KIND).unwrap();
        assert_eq!(f64::from(parameters[0]), best.1, "{scores:?}");
    }
}

fn start(folder: &Path, config: &ToyConfig) -> TrainingRun<Toy> {
    let never = AtomicBool::new(false);
    TrainingRun::start(folder, config, None, &mut |_| (), &never).unwrap().unwrap()
}

fn resume(folder: &Path) -> Result<TrainingRun<Toy>, TrainingError> {
    let never = AtomicBool::new(false);
    TrainingRun::resume(folder, &mut |_| (), &never)
        .map(|run| run.expect("the stop flag is not raised"))
}

/// Takes all remaining steps; returns whether all were taken.
fn run_to_end(
    run: &mut TrainingRun<Toy>,
    report: &mut dyn FnMut(&CurveRecord, &AtomicBool),
) -> bool {
    let stop = AtomicBool::new(false);
    run.run(&stop, &mut |record| report(record, &stop)).unwrap()
}

/// Returns the files at the end of a training.
fn final_files(folder: &Path) -> [Vec<u8>; 3] {
    [CHECKPOINT, CURVES, <Toy>::WEIGHTS].map(|name| fs::read(folder.join(name)).unwrap())
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
    }
}

#[test]
fn a_training_that_is_killed_anywhere_ends_with_the_same_files() {
    let dir = tempfile::tempdir().unwrap();
    let uninterrupted = dir.path().join("whole");
    let mut run = start(&uninterrupted, &ToyConfig::default());
    // The folder at each record is what a process leaves that is killed then.
    let mut killed = Vec::new();
    assert!(run_to_end(&mut run, &mut |record, _| {
        let killed_at = dir.path().join(format!("{:?}-{}", record.phase, record.step));
        copy(&uninterrupted, &killed_at);
        killed.push(killed_at);
    }));
    let expected = final_files(&uninterrupted);
    assert_eq!(killed.len(), 8 + 3);
    for folder in killed {
        let curves = fs::read_to_string(folder.join(CURVES)).unwrap();
        // Half of the next line.
        fs::write(folder.join(CURVES), curves + "{\"phase\":\"train\",\"st").unwrap();
        assert!(run_to_end(&mut resume(&folder).unwrap(), &mut |_, _| ()));
        assert!(final_files(&folder) == expected, "{}", folder.display());
    }
}

#[test]
fn a_training_that_is_killed_twice_before_its_second_checkpoint_is_resumed() {
    let dir = tempfile::tempdir().unwrap();
    let [whole, killed, again] = ["whole", "killed", "again"].map(|name| dir.path().join(name));
    assert!(run_to_end(&mut start(&whole, &ToyConfig::default()), &mut |_, _| ()));
    // Killed when it had written its configuration alone.
    drop(start(&killed, &ToyConfig::default()));
    fs::remove_file(killed.join(CHECKPOINT)).unwrap();
    assert!(run_to_end(&mut resume(&killed).unwrap(), &mut |record, _| {
        if !again.exists() {
            assert!(record.step < 5, "before the second checkpoint");
            copy(&killed, &again);
        }
    }));
    assert!(run_to_end(&mut resume(&again).unwrap(), &mut |_, _| ()));
    assert!(final_files(&again) == final_files(&whole));
}

#[test]
fn a_training_that_is_stopped_anywhere_ends_with_the_same_files() {
    let dir = tempfile::tempdir().unwrap();
    let uninterrupted = dir.path().join("whole");
    assert!(run_to_end(&mut start(&uninterrupted, &ToyConfig::default()), &mut |_, _| ()));
    let expected = final_files(&uninterrupted);
    // At every record.
    let stopped = dir.path().join("stopped");
    let mut run = start(&stopped, &ToyConfig::default());
    let mut n_stops = 0;
    while !run_to_end(&mut run, &mut |_, stop| stop.store(true, Ordering::Relaxed)) {
        drop(run);
        run = resume(&stopped).unwrap();
        n_stops += 1;
        assert!(n_stops < 50);
    }
    assert!(n_stops >= 8 && final_files(&stopped) == expected);
    // In every validation, including the last one.
    let interrupted = dir.path().join("interrupted");
    let mut run = start(&interrupted, &ToyConfig::default());
    for (before, step) in [(6, 8), (15, 16), (24, 24)] {
        let is_last = |record: &CurveRecord| record.phase == Phase::Train && record.step == before;
        assert!(!run_to_end(&mut run, &mut |record, _| {
            if is_last(record) {
                fs::write(interrupted.join(INTERRUPT), "").unwrap();
            }
        }));
        assert_eq!(run.progress().0, step);
        let curves = fs::read_to_string(interrupted.join(CURVES)).unwrap();
        assert!(!curves.contains(&format!("\"validation\",\"step\":{step}")), "{curves}");
        drop(run);
        run = resume(&interrupted).unwrap();
    }
    assert!(run_to_end(&mut run, &mut |_, _| ()));
    assert!(final_files(&interrupted) == expected);
}

#[test]
fn metrics_of_a_new_stage_are_averaged_over_its_steps() {
    let dir = tempfile::tempdir().unwrap();
    let mut records = Vec::new();
    let mut run = start(dir.path(), &ToyConfig::default());
    run.run(&AtomicBool::new(false), &mut |record| records.push(record.clone())).unwrap();
    // The record of step 15 covers steps 13 to 15.
    let mixed = records.iter().find(|r| r.phase == Phase::Train && r.step == 15).unwrap();
    assert_eq!(mixed.metrics["stage"], 14.5);
    let next = records.iter().find(|r| r.phase == Phase::Train && r.step == 18).unwrap();
    assert_eq!(next.metrics["stage"], 17.0);
    assert!(mixed.metrics.contains_key("other") && !next.metrics.contains_key("other"));
}

#[test]
fn a_training_that_is_cut_short_has_the_weights_of_its_last_step() {
    let dir = tempfile::tempdir().unwrap();
    let mut run = start(dir.path(), &ToyConfig::default());
    let stop_at = |record: &CurveRecord, stop: &AtomicBool| {
        stop.store(record.step == 3, Ordering::Relaxed);
    };
    assert!(!run_to_end(&mut run, &mut |record, stop| stop_at(record, stop)));
    let (n_done, _) = run.progress();
    assert!(n_done < 8 && !dir.path().join(Toy::<false>::WEIGHTS).exists(), "no validation yet");
    drop(run);
    let path = dir.path().join(CONFIG);
    let config = fs::read_to_string(&path).unwrap();
    fs::write(&path, config.replace("steps = 24", &format!("steps = {n_done}"))).unwrap();
    let mut run = resume(dir.path()).unwrap();
    assert_eq!(run.progress(), (n_done, n_done));
    // A process that is killed after this line does not validate again.
    assert!(run_to_end(&mut run, &mut |record, _| {
        assert_eq!(record.phase, Phase::Validation);
        assert!(dir.path().join(Toy::<false>::WEIGHTS).exists());
    }));
    let curves = fs::read_to_string(dir.path().join(CURVES)).unwrap();
    assert!(curves.contains(&format!("\"validation\",\"step\":{n_done}")), "{curves}");
}

#[test]
fn a_training_shorter_than_the_validation_interval_validates_at_its_end() {
    let dir = tempfile::tempdir().unwrap();
    let mut records = Vec::new();
    let mut run = start(dir.path(), &ToyConfig { steps: 5, ..ToyConfig::default() });
    assert!(run_to_end(&mut run, &mut |record, _| records.push((record.phase, record.step))));
    assert_eq!(records.last(), Some(&(Phase::Validation, 5)));
    assert!(dir.path().join(<Toy>::WEIGHTS).exists());
}

#[test]
fn a_second_process_in_a_folder_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = start(dir.path(), &ToyConfig::default());
    let error = resume(dir.path()).err().unwrap();
    assert!(matches!(error, TrainingError::Locked(_)), "{error}");
    assert!(error.to_string().contains("in use by another `chaic train`"));
    let never = AtomicBool::new(false);
    let started =
        TrainingRun::<Toy>::start(dir.path(), &ToyConfig::default(), None, &mut |_| (), &never);
    assert!(matches!(started, Err(TrainingError::Locked(_))));
    drop(run);
    resume(dir.path()).unwrap();
}

#[test]
fn a_training_that_is_stopped_before_its_first_step_keeps_its_initial_weights() {
    let dir = tempfile::tempdir().unwrap();
    let (path, never) = (dir.path().join("weights"), AtomicBool::new(false));
    let bytes = weights::to_bytes(&network(), &[5.0, 6.0, 7.0], WEIGHTS_KIND).unwrap();
    fs::write(&path, bytes).unwrap();
    let ends = [false, true].map(|is_stopped| {
        let out = dir.path().join(format!("{is_stopped}"));
        let (config, stop) = (ToyConfig::default(), AtomicBool::new(is_stopped));
        let started = TrainingRun::<Toy>::start(&out, &config, Some(&path), &mut |_| (), &stop);
        let mut run = match started.unwrap() {
            Some(run) => run,
            None => {
                assert!(is_stopped && out.join(INITIAL_WEIGHTS).exists());
                TrainingRun::resume(&out, &mut |_| (), &never).unwrap().unwrap()
            }
        };
        assert!(run_to_end(&mut run, &mut |_, _| ()));
        final_files(&out)
    });
    assert!(ends[0] == ends[1]);
    let random = dir.path().join("random");
    assert!(run_to_end(&mut start(&random, &ToyConfig::default()), &mut |_, _| ()));
    assert!(ends[0] != final_files(&random), "the initial weights have an effect");
    // A start that was killed before it wrote the configuration left its weights.
    let left = dir.path().join("left");
    fs::create_dir(&left).unwrap();
    fs::copy(&path, left.join(INITIAL_WEIGHTS)).unwrap();
    let (config, stop) = (ToyConfig::default(), AtomicBool::new(true));
    let started = TrainingRun::<Toy>::start(&left, &config, None, &mut |_| (), &stop);
    assert!(started.unwrap().is_none());
    assert!(run_to_end(&mut resume(&left).unwrap(), &mut |_, _| ()));
    assert!(final_files(&left) == final_files(&random));
}

#[test]
fn non_finite_weights_are_not_written() {
    // The checkpoint after step 15 and the validation after step 16 find them.
    for (breaks_at, found_at, kept) in [(12, 15, 10), (15, 15, 10), (16, 16, 15)] {
        let dir = tempfile::tempdir().unwrap();
        let mut run = start(dir.path(), &ToyConfig { breaks_at, ..ToyConfig::default() });
        let error = run.run(&AtomicBool::new(false), &mut |_| ()).unwrap_err();
        let is_reported =
            matches!(error, TrainingError::NotFinite { .. } | TrainingError::NonFiniteMetric(_));
        let message = error.to_string();
        assert!(is_reported && message.contains("the last checkpoint is kept"), "{message}");
        assert!(message.contains(&format!("step {found_at}")), "{message}");
        drop(run);
        let weights = fs::read(dir.path().join(<Toy>::WEIGHTS)).unwrap();
        assert!(<Toy>::read_weights(&ToyConfig::default(), &weights).is_ok());
        assert_eq!(resume(dir.path()).unwrap().progress(), (kept, 24));
    }
}

#[test]
fn missing_damaged_and_version_1_checkpoints_are_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    refuses_damaged_checkpoints(&mut {
        let mut toy =
            <Toy>::new(&ToyConfig::default(), dir.path(), &mut |_| (), &AtomicBool::new(false))
                .unwrap()
                .unwrap();
        toy.step(&AtomicBool::new(false)).unwrap();
        toy
    });
    bounds_every_number::<Toy>();
    assert!(run_to_end(&mut start(dir.path(), &ToyConfig::default()), &mut |_, _| ()));
    let path = dir.path().join(CHECKPOINT);
    let complete = fs::read(&path).unwrap();
    let refused = |bytes: Option<&[u8]>| {
        fs::remove_file(&path).unwrap();
        bytes.iter().for_each(|bytes| fs::write(&path, bytes).unwrap());
        let curves = fs::read(dir.path().join(CURVES)).unwrap();
        let error = resume(dir.path()).err().unwrap().to_string();
        assert!(error.contains("checkpoint.bin is ") && !error.contains('\n'), "{error}");
        assert!(fs::read(dir.path().join(CURVES)).unwrap() == curves, "the curves are unchanged");
        fs::write(&path, &complete).unwrap();
        error
    };
    assert!(refused(None).contains("is missing, but the training has taken steps"));
    assert!(refused(Some(&complete[..50])).contains("is damaged: its digest"));
    // Steps, then parameters, as before version 2.
    let version_1 = [&7u64.to_le_bytes()[..], &[0; 48]].concat();
    assert!(refused(Some(&version_1)).contains("format version 1 is no longer read"));
    resume(dir.path()).unwrap();
    // Fewer steps than were taken.
    let config = fs::read_to_string(dir.path().join(CONFIG)).unwrap();
    assert!(config.contains("steps = 24  # 1 to 1000000000"), "{config}");
    fs::write(dir.path().join(CONFIG), config.replace("steps = 24", "steps = 23")).unwrap();
    let error = resume(dir.path()).err().unwrap().to_string();
    assert!(error.contains("has 24 steps taken, of 23"), "{error}");
}

#[test]
fn a_training_is_resumed_only_with_the_data_with_which_it_began() {
    let dir = tempfile::tempdir().unwrap();
    let config = ToyConfig { input: 7, ..ToyConfig::default() };
    drop(start(dir.path(), &config));
    let path = dir.path().join(CONFIG);
    let text = fs::read_to_string(&path).unwrap();
    for input in ["input = 8", "input = 0"] {
        fs::write(&path, text.replace("input = 7", input)).unwrap();
        let error = resume(dir.path()).err().unwrap().to_string();
        assert!(error.contains("the data of `input` has changed"), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }
    fs::write(&path, &text).unwrap();
    drop(resume(dir.path()).unwrap());
    // A checkpoint of an earlier version has no digest of the data.
    let toy = <Toy>::new(&config, dir.path(), &mut |_| (), &AtomicBool::new(false));
    let mut checkpoint = toy.unwrap().unwrap().checkpoint();
    for name in ["run.figure_names", "run.figure_counts"] {
        checkpoint.insert_bytes(name, Vec::new());
    }
    for name in ["run.figures", "run.best_score"] {
        checkpoint.insert_doubles(name, Vec::new());
    }
    checkpoint.insert_integers("run.validation_is_due", vec![0]);
    let bytes = checkpoint.to_bytes(&Identity::new(<Toy>::KIND, &network())).unwrap();
    fs::write(dir.path().join(CHECKPOINT), bytes).unwrap();
    resume(dir.path()).unwrap();
}

#[test]
fn the_training_of_another_kind_is_named() {
    let dir = tempfile::tempdir().unwrap();
    drop(start(dir.path(), &ToyConfig::default()));
    let path = dir.path().join(CONFIG);
    fs::write(&path, "other = 1\n").unwrap();
    let error = resume(dir.path()).err().unwrap().to_string();
    assert!(error.contains("config.toml: line 1: unknown field `other`"), "{error}");
    let checkpoint = Checkpoint::default().to_bytes(&Identity::new("other", &network())).unwrap();
    fs::write(dir.path().join(CHECKPOINT), checkpoint).unwrap();
    let error = resume(dir.path()).err().unwrap().to_string();
    let expected = "holds a training of `chaic train other`, not of `chaic train toy`";
    assert!(error.contains(expected) && !error.contains('\n'), "{error}");
}

#[test]
fn a_training_of_an_earlier_version_is_resumed() {
    let dir = tempfile::tempdir().unwrap();
    drop(start(dir.path(), &ToyConfig::default()));
    let config = fs::read_to_string(dir.path().join(CONFIG)).unwrap();
    let old_config = config.replace("learning_rate", "rate");
    assert_ne!(old_config, config);
    fs::write(dir.path().join(CONFIG), old_config).unwrap();
    let stop = AtomicBool::new(false);
    let mut toy =
        <Toy>::new(&ToyConfig::default(), dir.path(), &mut |_| (), &stop).unwrap().unwrap();
    let old_names =
        toy.step(&stop).unwrap().map(|_| metrics([("clipped", 0.5), ("objective", 2.0)]));
    let bytes = checkpoint_bytes(&toy, &[old_names.unwrap()]).unwrap();
    fs::write(dir.path().join(CHECKPOINT), bytes).unwrap();
    let mut records = Vec::new();
    assert!(run_to_end(&mut resume(dir.path()).unwrap(), &mut |record, _| {
        records.push(record.clone());
    }));
    let names: Vec<&str> = records[0].metrics.keys().map(|name| &**name).collect();
    assert_eq!(names, ["clip_fraction", "loss", "other", "policy_loss"]);
}
