//! Promises of `chaic train`: inputs are checked before anything is written, one process trains in a folder, a signal
//! ends it soon, and a training that was killed goes on without a trace of that.

use std::fs;

use super::{chaic, ill, text};
#[cfg(unix)]
use {
    super::{start, well},
    std::collections::BTreeSet,
    std::path::Path,
    std::process::{Child, Command},
    std::time::{Duration, Instant},
};

const TRAININGS: [&str; 6] = ["detector", "behavior", "ppo", "clone", "primitive", "opponent"];
/// Longest time that a training takes to end after a signal. It is 5 s where the machine does nothing else.
#[cfg(unix)]
const SOON: Duration = Duration::from_secs(20);

#[test]
fn inputs_are_checked_before_the_folder_is_made() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("text"), "no weights").expect("it is written");
    for training in TRAININGS {
        for weights in ["missing", "text"] {
            let begun = ill(at, &["train", training, "--out", "o", "--weights", weights]);
            assert!(begun.contains(weights) && begun.lines().count() == 1, "{begun}");
            assert!(!at.join("o").exists(), "{training}");
            ill(at, &["train", training, "--out", "o", "--resume"]);
            assert!(!at.join("o").exists(), "{training}");
        }
    }
}

#[test]
fn configurations_out_of_bounds_are_refused_by_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (training, config, told) in [
        ("ppo", "[ppo]\nclip = -1", "`ppo.clip` is -1; it must be from 0.001 to 1"),
        ("ppo", "[ppo]\nclip = nan", "`ppo.clip` is nan"),
        ("ppo", "[ppo]\nclip_value = -1", "`ppo.clip_value` is -1"),
        ("ppo", "[ppo]\nrate = -1", "`ppo.rate` is -1"),
        ("ppo", "[ppo]\ndiscount = -1", "`ppo.discount` is -1"),
        ("ppo", "[ppo]\nshards = 4294967296", "`ppo.shards` is 4294967296"),
        ("ppo", "[play]\nvalidation_episodes = 4294967296", "from 1 to 1000"),
        ("clone", "rate = nan", "`rate` is nan"),
        ("detector", "shards = 9223372036854775807", "a whole number from 1 to 256"),
        ("primitive", "envs = 4294967296", "`envs` is 4294967296"),
    ] {
        fs::write(at.join("c.toml"), config).expect("it is written");
        let out = chaic(at, &["train", training, "--config", "c.toml", "--out", "o"]);
        assert_eq!(out.status.code(), Some(2), "{config}");
        let complaint = text(&out.stderr);
        assert!(complaint.contains("c.toml: `") && complaint.contains(told), "{complaint}");
        assert!(!at.join("o").exists(), "{config}");
    }
}

#[test]
fn what_memory_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let bench = ["bench", "env", "--envs", "8192", "--size", "1024"];
    let out = chaic(at, &bench);
    let complaint = text(&out.stderr);
    assert!(out.status.code() == Some(2) && complaint.contains("--envs times"), "{complaint}");
    for seeds in ["4294967295", "10001", "0", "-1"] {
        let out = chaic(at, &["eval", &format!("--seeds={seeds}"), "--out", "o"]);
        let complaint = text(&out.stderr);
        assert!(out.status.code() == Some(2) && complaint.contains("1..=10000"), "{complaint}");
    }
    assert!(!at.join("o").exists());
}

/// Waits until a file is there and not empty.
#[cfg(unix)]
fn until_written(path: &Path) {
    let began = Instant::now();
    while fs::metadata(path).map_or(0, |found| found.len()) == 0 {
        assert!(began.elapsed() < Duration::from_secs(120), "{} is not written", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(unix)]
fn signal(child: &Child, signal: &str) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args([signal, &id]).status().expect("there is a kill").success());
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_validation_soon_and_it_is_done_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let child = start(at, &["train", "detector", "--steps", "1", "--out", "o"]);
    // The loss is recorded before the validation, which takes minutes.
    let curves = at.join("o/curves.jsonl");
    until_written(&curves);
    let began = Instant::now();
    signal(&child, "-TERM");
    let ended = child.wait_with_output().expect("it ends");
    assert!(began.elapsed() < SOON, "{:?}", began.elapsed());
    assert_eq!(ended.status.code(), Some(130));
    let told = text(&ended.stderr);
    assert!(told.contains("go on with: chaic train detector --resume --out o"), "{told}");
    let before = fs::read_to_string(&curves).expect("it is there");
    assert!(before.lines().count() == 1 && !before.contains("validation"), "{before}");
    assert!(!at.join("o/detector.safetensors").exists());
    // The validation is gone on with, and can be ended again.
    let child = start(at, &["train", "detector", "--resume", "--out", "o"]);
    std::thread::sleep(Duration::from_secs(1));
    signal(&child, "-TERM");
    assert_eq!(child.wait_with_output().expect("it ends").status.code(), Some(130));
    assert_eq!(fs::read_to_string(&curves).expect("it is there"), before);
}

#[cfg(unix)]
#[test]
fn a_training_that_is_killed_is_locked_until_then_and_goes_on_with_the_same_curves() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let few = ["--of-each", "20", "--episodes", "1", "--image-size", "32"];
    well(at, &[&["collect", "opponent", "--out", "w"][..], &few].concat());
    let small = "steps = 6000\nwarm_up = 1\nbatch = 8\nvalidation_of_each = 5\nwindows = \"w\"\n\
                 [collect]\nepisodes = 1\nimage_size = 32\n";
    fs::write(at.join("c.toml"), small).expect("it is written");
    let train = ["train", "opponent", "--config", "c.toml", "--out"];
    well(at, &[&train[..], &["whole"]].concat());
    let files = |folder: &str| {
        ["checkpoint.bin", "curves.jsonl", "opponent.safetensors"]
            .map(|name| fs::read(at.join(folder).join(name)).expect("it is there"))
    };
    let child = start(at, &[&train[..], &["killed"]].concat());
    until_written(&at.join("killed/curves.jsonl"));
    // It doesn't end by itself before it is killed.
    signal(&child, "-STOP");
    for other in [&["--resume", "--out", "killed"][..], &["--out", "killed"]] {
        let refused = ill(at, &[&["train", "opponent"][..], other].concat());
        assert!(refused.contains("in use by another `chaic train`"), "{refused}");
    }
    signal(&child, "-KILL");
    child.wait_with_output().expect("it ends");
    well(at, &["train", "opponent", "--resume", "--out", "killed"]);
    assert!(files("killed") == files("whole"));
    let curves = fs::read_to_string(at.join("killed/curves.jsonl")).expect("it is there");
    let lines: BTreeSet<&str> = curves.lines().collect();
    assert_eq!(lines.len(), curves.lines().count(), "no line twice");
}
