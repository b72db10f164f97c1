//! A validation whose metrics are not finite ends the training, and leaves nothing behind.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_training::{CURVES, Trainer as _, TrainingError, TrainingRun};

use crate::{INFINITE, Toy, ToyConfig, final_files};

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
