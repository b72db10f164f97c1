//! Starts that fail: a refused one leaves nothing, and one whose file operation fails keeps the
//! collected data.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_nn::weights;
use chaic_training::{TrainingError, TrainingRun};

use crate::{Toy, ToyConfig, WEIGHTS_KIND, final_files, network, resume, run_to_end, start};

#[test]
fn a_refused_start_leaves_nothing_to_resume() {
    let dir = tempfile::tempdir().unwrap();
    let (out, never) = (dir.path().join("out"), AtomicBool::new(false));
    let other = dir.path().join("other");
    fs::write(&other, "no weights").unwrap();
    let valid = ToyConfig::default();
    for (config, weights, word) in [
        (ToyConfig { learning_rate: f32::NAN, ..valid.clone() }, None, "`learning_rate`"),
        (ToyConfig { steps: u64::MAX, ..valid.clone() }, None, "can't be used"),
        (valid.clone(), Some(dir.path().join("missing")), "missing"),
        (valid.clone(), Some(other), "not a weights file"),
        (ToyConfig { fails: 1, ..valid }, None, "no data"),
    ] {
        let started =
            TrainingRun::<Toy>::start(&out, &config, weights.as_deref(), &mut |_| (), &never);
        let error = started.err().unwrap().to_string();
        assert!(error.contains(word) && !error.contains('\n'), "{error}");
        assert!(!out.exists(), "{error}");
        assert!(resume(&out).is_err());
    }
    // In a folder that existed before, only the lock file is left.
    fs::create_dir(&out).unwrap();
    let fails = ToyConfig { fails: 1, ..ToyConfig::default() };
    assert!(TrainingRun::<Toy>::start(&out, &fails, None, &mut |_| (), &never).is_err());
    let error = resume(&out).err().unwrap().to_string();
    assert!(error.contains("out holds no training"), "{error}");
    assert!(run_to_end(&mut start(&out, &ToyConfig::default()), &mut |_, _| ()));
    assert!(resume(&out).is_ok(), "a finished training can be resumed and has no steps left");
}

#[test]
fn a_start_whose_file_operation_fails_keeps_the_collected_data() {
    let dir = tempfile::tempdir().unwrap();
    let [out, whole, initial] = ["out", "whole", "initial"].map(|name| dir.path().join(name));
    let bytes = weights::to_bytes(&network(), &[5.0, 6.0, 7.0], WEIGHTS_KIND).unwrap();
    fs::write(&initial, bytes).unwrap();
    let never = AtomicBool::new(false);
    let begin = |folder: &Path, config: &ToyConfig| {
        TrainingRun::<Toy>::start(folder, config, Some(&initial), &mut |_| (), &never)
    };
    let fails = ToyConfig { fails: 2, ..ToyConfig::default() };
    let error = begin(&out, &fails).err().unwrap();
    let message = error.to_string();
    assert!(message.contains("disk full; the collected data is kept, continue with --resume"));
    assert!(matches!(error, TrainingError::Collection(_)) && !message.contains('\n'), "{message}");
    assert!(out.join("clips/train/0").exists() && out.join("windows").exists());
    assert!(matches!(begin(&out, &fails).err(), Some(TrainingError::NotEmpty(_))));
    assert!(run_to_end(&mut resume(&out).unwrap(), &mut |_, _| ()));
    let mut run = begin(&whole, &ToyConfig::default()).unwrap().unwrap();
    assert!(run_to_end(&mut run, &mut |_, _| ()));
    assert!(final_files(&out) == final_files(&whole));
}
