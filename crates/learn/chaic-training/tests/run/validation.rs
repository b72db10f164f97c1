//! A validation whose metrics are not finite ends the training, and leaves nothing behind. One without
//! a score replaces no weights that have one.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_training::{CURVES, CurveRecord, Phase, Trainer as _, TrainingError, TrainingRun};

use crate::{INFINITE, Toy, ToyConfig, UNDEFINED, final_files};

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

fn start(folder: &Path) -> TrainingRun<Toy<true>> {
    let config = ToyConfig::default();
    let started = TrainingRun::start(folder, &config, None, &mut |_| (), &NEVER_STOP);
    started.unwrap().unwrap()
}

#[test]
fn a_score_that_is_not_finite_is_never_the_best() {
    let dir = tempfile::tempdir().unwrap();
    let [broken, whole] = ["broken", "whole"].map(|name| dir.path().join(name));
    let mut run = start(&broken);
    fs::write(broken.join(INFINITE), "").unwrap();
    let error = run.run(&NEVER_STOP, &mut |_| ()).unwrap_err();
    assert!(matches!(error, TrainingError::NonFiniteMetric(8)), "{error}");
    drop(run);
    assert!(!broken.join(Toy::<true>::WEIGHTS).exists());
    let curves = fs::read_to_string(broken.join(CURVES)).unwrap();
    assert!(curves.contains("train") && !curves.contains("validation"), "{curves}");
    // The last checkpoint is kept, and the training ends as one without the fault.
    let resumed = TrainingRun::<Toy<true>>::resume(&broken, &mut |_| (), &NEVER_STOP);
    let mut run = resumed.unwrap().unwrap();
    assert_eq!(run.progress(), (5, 24));
    assert!(run.run(&NEVER_STOP, &mut |_| ()).unwrap());
    assert!(start(&whole).run(&NEVER_STOP, &mut |_| ()).unwrap());
    assert!(final_files(&broken) == final_files(&whole));
}

#[test]
fn weights_without_a_score_replace_none_that_have_one() {
    let dir = tempfile::tempdir().unwrap();
    // Returns the weights after each validation. Those after `last_scored` have no score.
    let train = |last_scored: u64| {
        let folder = dir.path().join(last_scored.to_string());
        let mut weights = Vec::new();
        let mut report = |record: &CurveRecord| {
            if record.step >= last_scored {
                fs::write(folder.join(UNDEFINED), "").unwrap();
            }
            if record.phase == Phase::Validation {
                assert_eq!(record.metrics.contains_key("score"), record.step <= last_scored);
                weights.push(fs::read(folder.join(Toy::<true>::WEIGHTS)).unwrap());
            }
        };
        assert!(start(&folder).run(&NEVER_STOP, &mut report).unwrap());
        weights
    };
    let scored = train(8);
    assert!(scored.len() == 3 && scored.iter().all(|weights| *weights == scored[0]));
    // Without any score, the last weights are kept.
    let unscored = train(0);
    assert!(unscored[0] == scored[0]);
    assert!(unscored[1] != unscored[0] && unscored[2] != unscored[1]);
}
