//! Promises of every training's folder: a training that is stopped or killed anywhere ends with the same files as
//! one that is not; a beginning that fails leaves nothing to resume; one process trains in a folder at a time.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamRules, Network};
use chaic_training::bounds::{BoundTable, RATE, STEPS, integer};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{
    CHECKPOINT, CONFIG, CURVES, Checkpoint, CheckpointError, Figures, INITIAL_WEIGHTS, Learner, Of,
    Record, Training, TrainingError, TrainingRun, figures,
};
use serde::{Deserialize, Serialize};

/// A file in the folder that makes the next validation be stopped.
const INTERRUPT: &str = "interrupt";
const WEIGHTS_KIND: &str = "toy 1";

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ToyRules {
    steps: u64,
    rate: f32,
    /// The step whose weights are not finite; 0 for none.
    breaks_at: u64,
    /// Whether the training can't be prepared: 1 for yes.
    fails: u8,
    a: u8,
    b: u8,
}

impl Default for ToyRules {
    fn default() -> ToyRules {
        ToyRules { steps: 24, rate: 0.1, breaks_at: 0, fails: 0, a: 0, b: 0 }
    }
}

/// Moves three numbers towards 1.
struct Toy {
    rules: ToyRules,
    folder: PathBuf,
    network: Network,
    learner: Learner,
}

fn network() -> Network {
    let mut network = Network::default();
    network.aside("numbers", 3);
    network
}

impl Training for Toy {
    type Rules = ToyRules;
    const KIND: &'static str = "toy";
    const BOUNDS: BoundTable = &[
        ("steps", STEPS),
        ("rate", RATE),
        ("breaks_at", integer(0, 1000)),
        ("fails", integer(0, 1)),
        ("a", integer(0, 1)),
        ("b", integer(0, 1)),
    ];
    const WEIGHTS: &'static str = "toy.safetensors";
    const RECORD_STEPS: u64 = 3;
    const CHECKPOINT_STEPS: u64 = 5;
    const VALIDATION_STEPS: u64 = 8;

    fn new(
        rules: &ToyRules,
        folder: &Path,
        _: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<Toy>, TrainingError> {
        if rules.fails == 1 {
            return Err(TrainingError::of_data(std::io::Error::other("no data")));
        }
        let learner = Learner::new(&network(), 1, 2);
        let (rules, folder) = (rules.clone(), folder.to_owned());
        let toy = Toy { rules, folder, network: network(), learner };
        Ok((!stop.load(Ordering::Relaxed)).then_some(toy))
    }

    fn check(_: &ToyRules) -> Result<(), String> {
        Ok(())
    }

    fn read_weights(_: &ToyRules, bytes: &[u8]) -> Result<Vec<f32>, WeightsError> {
        weights::from_bytes(&network(), bytes, WEIGHTS_KIND)
    }

    fn network(&self) -> &Network {
        &self.network
    }

    fn steps(&self) -> u64 {
        self.rules.steps
    }

    fn taken(&self) -> u64 {
        self.learner.adam.steps
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn begin_with(&mut self, numbers: Vec<f32>) {
        self.learner.begin_with(numbers);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.learner.load(checkpoint).map(Some)
    }

    fn step(&mut self, stop: &AtomicBool) -> Option<Figures> {
        let step = self.taken() + 1;
        let rules = AdamRules::default();
        let losses = self.learner.step(
            &self.network,
            (&rules, self.rules.rate),
            |shard, numbers, _, gradient| {
                for (g, x) in gradient.iter_mut().zip(numbers) {
                    *g = x - 1.0 - 0.01 * (step + shard as u64) as f32;
                }
                (!stop.load(Ordering::Relaxed)).then(|| f64::from(gradient[0].abs()))
            },
        )?;
        if step == self.rules.breaks_at {
            self.learner.numbers[1] = f32::NAN;
        }
        Some(figures([("loss", losses[0]), ("other", losses[1])]))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError> {
        if fs::remove_file(self.folder.join(INTERRUPT)).is_ok() {
            stop.store(true, Ordering::Relaxed);
            return Ok(None);
        }
        let bytes = weights::to_bytes(&self.network, &self.learner.numbers, WEIGHTS_KIND)?;
        Ok(Some((figures([("x", f64::from(self.learner.numbers[0]))]), bytes)))
    }
}

fn begin(folder: &Path, rules: &ToyRules) -> TrainingRun<Toy> {
    let never = AtomicBool::new(false);
    TrainingRun::begin(folder, rules, None, &mut |_| (), &never).unwrap().unwrap()
}

fn resume(folder: &Path) -> Result<TrainingRun<Toy>, TrainingError> {
    let never = AtomicBool::new(false);
    TrainingRun::resume(folder, &mut |_| (), &never).map(|run| run.expect("nobody stops it"))
}

/// Takes all steps that are left, and returns whether it came to the end.
fn go_on(run: &mut TrainingRun<Toy>, report: &mut dyn FnMut(&Record, &AtomicBool)) -> bool {
    let stop = AtomicBool::new(false);
    run.go_on(&stop, &mut |record| report(record, &stop)).unwrap()
}

/// Returns the files that a training ends with.
fn ends_with(folder: &Path) -> [Vec<u8>; 3] {
    [CHECKPOINT, CURVES, Toy::WEIGHTS].map(|name| fs::read(folder.join(name)).unwrap())
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
    let whole = dir.path().join("whole");
    let mut run = begin(&whole, &ToyRules::default());
    // What lies there at each record is what a process leaves that is killed then.
    let mut killed = Vec::new();
    assert!(go_on(&mut run, &mut |record, _| {
        let left = dir.path().join(format!("{:?}-{}", record.of, record.step));
        copy(&whole, &left);
        killed.push(left);
    }));
    let expected = ends_with(&whole);
    assert_eq!(killed.len(), 8 + 3);
    for left in killed {
        let curves = fs::read_to_string(left.join(CURVES)).unwrap();
        // Half of the next line.
        fs::write(left.join(CURVES), curves + "{\"of\":\"loss\",\"st").unwrap();
        assert!(go_on(&mut resume(&left).unwrap(), &mut |_, _| ()));
        assert!(ends_with(&left) == expected, "{}", left.display());
    }
}

#[test]
fn a_training_that_is_stopped_anywhere_ends_with_the_same_files() {
    let dir = tempfile::tempdir().unwrap();
    let whole = dir.path().join("whole");
    assert!(go_on(&mut begin(&whole, &ToyRules::default()), &mut |_, _| ()));
    let expected = ends_with(&whole);
    // At every record.
    let stopped = dir.path().join("stopped");
    let mut run = begin(&stopped, &ToyRules::default());
    let mut n_stops = 0;
    while !go_on(&mut run, &mut |_, stop| stop.store(true, Ordering::Relaxed)) {
        drop(run);
        run = resume(&stopped).unwrap();
        n_stops += 1;
        assert!(n_stops < 50);
    }
    assert!(n_stops >= 8 && ends_with(&stopped) == expected);
    // In every validation, the last one too.
    let interrupted = dir.path().join("interrupted");
    let mut run = begin(&interrupted, &ToyRules::default());
    for (before, step) in [(6, 8), (15, 16), (24, 24)] {
        let is_last = |record: &Record| record.of == Of::Loss && record.step == before;
        assert!(!go_on(&mut run, &mut |record, _| {
            if is_last(record) {
                fs::write(interrupted.join(INTERRUPT), "").unwrap();
            }
        }));
        assert_eq!(run.extent().0, step);
        let curves = fs::read_to_string(interrupted.join(CURVES)).unwrap();
        assert!(!curves.contains(&format!("\"validation\",\"step\":{step}")), "{curves}");
        drop(run);
        run = resume(&interrupted).unwrap();
    }
    assert!(go_on(&mut run, &mut |_, _| ()));
    assert!(ends_with(&interrupted) == expected);
}

#[test]
fn one_process_trains_in_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let run = begin(dir.path(), &ToyRules::default());
    let error = resume(dir.path()).err().unwrap();
    assert!(matches!(error, TrainingError::Locked(_)), "{error}");
    assert!(error.to_string().contains("in use by another `chaic train`"));
    let never = AtomicBool::new(false);
    let begun =
        TrainingRun::<Toy>::begin(dir.path(), &ToyRules::default(), None, &mut |_| (), &never);
    assert!(matches!(begun, Err(TrainingError::Locked(_))));
    drop(run);
    resume(dir.path()).unwrap();
}

#[test]
fn a_beginning_that_fails_leaves_nothing_to_resume() {
    let dir = tempfile::tempdir().unwrap();
    let (out, never) = (dir.path().join("out"), AtomicBool::new(false));
    let other = dir.path().join("other");
    fs::write(&other, "no weights").unwrap();
    let usual = ToyRules::default();
    for (rules, weights, word) in [
        (ToyRules { rate: f32::NAN, ..usual.clone() }, None, "`rate`"),
        (ToyRules { steps: u64::MAX, ..usual.clone() }, None, "can't be used"),
        (usual.clone(), Some(dir.path().join("missing")), "missing"),
        (usual.clone(), Some(other), "no weights"),
        (ToyRules { fails: 1, ..usual }, None, "no data"),
    ] {
        let begun =
            TrainingRun::<Toy>::begin(&out, &rules, weights.as_deref(), &mut |_| (), &never);
        let error = begun.err().unwrap().to_string();
        assert!(error.contains(word) && !error.contains('\n'), "{error}");
        assert!(!out.exists(), "{error}");
        assert!(resume(&out).is_err());
    }
    // In a folder that was there, no more than its lock file is left.
    fs::create_dir(&out).unwrap();
    let fails = ToyRules { fails: 1, ..ToyRules::default() };
    assert!(TrainingRun::<Toy>::begin(&out, &fails, None, &mut |_| (), &never).is_err());
    assert!(resume(&out).is_err());
    assert!(go_on(&mut begin(&out, &ToyRules::default()), &mut |_, _| ()));
    assert!(resume(&out).is_ok(), "what is done can be resumed, and has nothing to do");
}

#[test]
fn a_training_that_is_stopped_before_its_first_step_keeps_its_initial_weights() {
    let dir = tempfile::tempdir().unwrap();
    let (path, never) = (dir.path().join("weights"), AtomicBool::new(false));
    let bytes = weights::to_bytes(&network(), &[5.0, 6.0, 7.0], WEIGHTS_KIND).unwrap();
    fs::write(&path, bytes).unwrap();
    let ends = [false, true].map(|is_stopped| {
        let out = dir.path().join(format!("{is_stopped}"));
        let (rules, stop) = (ToyRules::default(), AtomicBool::new(is_stopped));
        let begun = TrainingRun::<Toy>::begin(&out, &rules, Some(&path), &mut |_| (), &stop);
        let mut run = match begun.unwrap() {
            Some(run) => run,
            None => {
                assert!(is_stopped && out.join(INITIAL_WEIGHTS).exists());
                TrainingRun::resume(&out, &mut |_| (), &never).unwrap().unwrap()
            }
        };
        assert!(go_on(&mut run, &mut |_, _| ()));
        ends_with(&out)
    });
    assert!(ends[0] == ends[1]);
    let random = dir.path().join("random");
    assert!(go_on(&mut begin(&random, &ToyRules::default()), &mut |_, _| ()));
    assert!(ends[0] != ends_with(&random), "the weights matter");
}

#[test]
fn weights_that_are_not_finite_are_neither_kept_nor_written() {
    for (breaks_at, kept) in [(12, 10), (15, 10), (16, 15)] {
        let dir = tempfile::tempdir().unwrap();
        let mut run = begin(dir.path(), &ToyRules { breaks_at, ..ToyRules::default() });
        let error = run.go_on(&AtomicBool::new(false), &mut |_| ()).unwrap_err();
        let is_told =
            matches!(error, TrainingError::NotFinite { .. } | TrainingError::NotANumber(_));
        assert!(is_told && error.to_string().contains("the last checkpoint is kept"), "{error}");
        drop(run);
        let weights = fs::read(dir.path().join(Toy::WEIGHTS)).unwrap();
        assert!(Toy::read_weights(&ToyRules::default(), &weights).is_ok());
        assert_eq!(resume(dir.path()).unwrap().extent(), (kept, 24));
    }
}

#[test]
fn checkpoints_that_are_lost_damaged_or_of_format_1_are_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    refuses_damaged_checkpoints(&mut {
        let mut toy =
            Toy::new(&ToyRules::default(), dir.path(), &mut |_| (), &AtomicBool::new(false))
                .unwrap()
                .unwrap();
        toy.step(&AtomicBool::new(false));
        toy
    });
    bounds_every_number::<Toy>();
    assert!(go_on(&mut begin(dir.path(), &ToyRules::default()), &mut |_, _| ()));
    let path = dir.path().join(CHECKPOINT);
    let whole = fs::read(&path).unwrap();
    let refused = |bytes: Option<&[u8]>| {
        fs::remove_file(&path).unwrap();
        bytes.iter().for_each(|bytes| fs::write(&path, bytes).unwrap());
        let curves = fs::read(dir.path().join(CURVES)).unwrap();
        let error = resume(dir.path()).err().unwrap().to_string();
        assert!(error.contains("checkpoint.bin is ") && !error.contains('\n'), "{error}");
        assert!(fs::read(dir.path().join(CURVES)).unwrap() == curves, "curves stay as they are");
        fs::write(&path, &whole).unwrap();
        error
    };
    assert!(refused(None).contains("is missing, but the training has taken steps"));
    assert!(refused(Some(&whole[..50])).contains("is damaged: its digest"));
    // Steps, then numbers, as it was before version 2.
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
