//! A training is resumed only with the settings on which its checkpoint depends.

use std::fs;
use std::sync::atomic::AtomicBool;

use chaic_training::run::checkpoint_bytes;
use chaic_training::{CHECKPOINT, CONFIG, Trainer as _, TrainingError};

use crate::{Toy, ToyConfig, final_files, resume, run_to_end, start};

#[test]
fn fixed_settings_stay_and_others_may_change() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    drop(start(folder, &ToyConfig::default()));
    let text = fs::read_to_string(folder.join(CONFIG)).unwrap();
    let edit = |before: &str, after: &str| {
        assert!(text.contains(before), "{text}");
        fs::write(folder.join(CONFIG), text.replace(before, after)).unwrap();
    };
    let refuse = |expected: &str| {
        let error = resume(folder).err().unwrap();
        assert!(matches!(error, TrainingError::Config { .. }) && error.is_usage(), "{error}");
        let problem = error.to_string();
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
    };
    edit("\na = 0", "\na = 1");
    refuse("config.toml: `a` is 1, but was 0 when the training began; set it back, or start");
    // The same after some steps.
    edit("steps = 24", "steps = 3");
    assert!(run_to_end(&mut resume(folder).unwrap(), &mut |_, _| ()));
    let before = final_files(folder);
    edit("\na = 0", "\na = 1");
    refuse("`a` is 1, but was 0");
    assert!(final_files(folder) == before);
    for (before, after) in [("\nb = 0", "\nb = 1"), ("rate = 0.1", "rate = 0.2")] {
        edit(before, after);
        drop(resume(folder).unwrap());
    }
}

#[test]
fn a_checkpoint_of_an_earlier_build_takes_the_settings_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let config = ToyConfig { a: 1, ..ToyConfig::default() };
    drop(start(folder, &config));
    let toy = <Toy>::new(&config, folder, &mut |_| (), &AtomicBool::new(false));
    let bytes = checkpoint_bytes(&toy.unwrap().unwrap(), &[]).unwrap();
    fs::write(folder.join(CHECKPOINT), bytes).unwrap();
    let text = fs::read_to_string(folder.join(CONFIG)).unwrap();
    fs::write(folder.join(CONFIG), text.replace("\na = 1", "\na = 0")).unwrap();
    assert!(run_to_end(&mut resume(folder).unwrap(), &mut |_, _| ()));
    fs::write(folder.join(CONFIG), text).unwrap();
    let problem = resume(folder).err().unwrap().to_string();
    assert!(problem.contains("`a` is 1, but was 0"), "{problem}");
}
