//! Promises of `chaic train`: it checks inputs before it writes, locks its folder and ends soon after a signal. A killed
//! training resumes with the same result.

use std::fs;

use super::{output_of, run_err, text};
#[cfg(unix)]
use {
    super::{run_ok, start},
    std::collections::BTreeSet,
    std::path::Path,
    std::process::{Child, Command},
    std::time::{Duration, Instant},
};

const TRAININGS: [&str; 7] =
    ["detector", "behavior", "ppo", "clone", "visual", "partner", "opponent"];
/// Longest time until a training ends after a signal. On an idle machine it is 5 s.
#[cfg(unix)]
const SOON: Duration = Duration::from_secs(20);

#[test]
fn inputs_are_checked_before_the_folder_is_made() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("text"), "no weights").expect("it is written");
    for training in TRAININGS {
        for weights in ["missing", "text"] {
            let begun = run_err(at, &["train", training, "--out", "o", "--weights", weights]);
            assert!(begun.contains(weights) && begun.lines().count() == 1, "{begun}");
            assert!(!at.join("o").exists(), "{training}");
            let resumed = run_err(at, &["train", training, "--out", "o", "--resume"]);
            assert!(resumed.contains("o holds no training"), "{resumed}");
            assert!(!at.join("o").exists(), "{training}");
        }
    }
}

#[test]
fn configurations_out_of_bounds_are_refused_by_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (training, config, reply) in [
        ("ppo", "[ppo]\nclip_range = -1", "`ppo.clip_range` is -1; it must be from 0.001 to 1"),
        ("ppo", "[ppo]\nclip_range = nan", "`ppo.clip_range` is nan"),
        ("ppo", "[ppo]\nclip_range_vf = -1", "`ppo.clip_range_vf` is -1"),
        ("ppo", "[ppo]\nlearning_rate = -1", "`ppo.learning_rate` is -1"),
        ("ppo", "[ppo]\ngamma = -1", "`ppo.gamma` is -1"),
        ("ppo", "[ppo]\nshards = 4294967296", "`ppo.shards` is 4294967296"),
        ("ppo", "[rollout]\nvalidation_episodes = 4294967296", "from 1 to 1000"),
        ("clone", "learning_rate = nan", "`learning_rate` is nan"),
        ("detector", "shards = 9223372036854775807", "an integer from 1 to 256"),
        ("visual", "n_envs = 4294967296", "`n_envs` is 4294967296"),
    ] {
        fs::write(at.join("c.toml"), config).expect("it is written");
        let out = output_of(at, &["train", training, "--config", "c.toml", "--out", "o"]);
        assert_eq!(out.status.code(), Some(2), "{config}");
        let complaint = text(&out.stderr);
        assert!(complaint.contains("c.toml: `") && complaint.contains(reply), "{complaint}");
        assert!(!at.join("o").exists(), "{config}");
    }
}

#[test]
fn unknown_and_doubly_set_keys_are_one_line_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (config, reply) in [
        ("[ppo]\ndiscount = 0.9\ngamma = 0.9\n", "duplicate field `gamma`"),
        ("[ppo]\nlearn_rate = 0.1\n", "line 2: unknown field `learn_rate`"),
    ] {
        fs::write(at.join("c.toml"), config).expect("it is written");
        let out = output_of(at, &["train", "ppo", "--config", "c.toml", "--out", "o"]);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{message}");
        assert!(message.contains("c.toml: ") && message.contains(reply), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
    fs::write(at.join("llm.toml"), "[request]\nmodle = \"m\"\n").expect("it is written");
    let play = ["eval", "--helper", "llm", "--llm-config", "llm.toml", "--out", "o"];
    let out = output_of(at, &play);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    assert!(message.contains("llm.toml: line 2: unknown field `modle`"), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(!at.join("o").exists());
}

#[test]
fn requests_larger_than_memory_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let bench = ["bench", "env", "--envs", "8192", "--size", "1024"];
    let out = output_of(at, &bench);
    let complaint = text(&out.stderr);
    assert!(out.status.code() == Some(2) && complaint.contains("--envs times"), "{complaint}");
    for seeds in ["4294967295", "10001", "0", "-1"] {
        let out = output_of(at, &["eval", &format!("--seeds={seeds}"), "--out", "o"]);
        let complaint = text(&out.stderr);
        assert!(out.status.code() == Some(2) && complaint.contains("1..=10000"), "{complaint}");
    }
    assert!(!at.join("o").exists());
}

/// Waits until a file exists and is not empty.
#[cfg(unix)]
fn wait_until_written(path: &Path) {
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
fn a_signal_ends_a_validation_soon_and_resuming_repeats_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let one_stage = ["--steps", "1", "--set", "second_stage.steps=0"];
    let child = start(at, &[&["train", "detection", "--out", "o"][..], &one_stage].concat());
    // The loss is recorded before the validation, which takes minutes.
    let curves = at.join("o/curves.jsonl");
    wait_until_written(&curves);
    let began = Instant::now();
    signal(&child, "-TERM");
    let ended = child.wait_with_output().expect("it ends");
    assert!(began.elapsed() < SOON, "{:?}", began.elapsed());
    assert_eq!(ended.status.code(), Some(130));
    let reply = text(&ended.stderr);
    assert!(reply.contains("continue with: chaic train detection --resume --out o"), "{reply}");
    let before = fs::read_to_string(&curves).expect("it exists");
    assert!(before.lines().count() == 1 && !before.contains("validation"), "{before}");
    assert!(!at.join("o/detector.safetensors").exists());
    // With other shards, the next step would see views again, or leave some out.
    let config = at.join("o/config.toml");
    let written = fs::read_to_string(&config).expect("it exists");
    fs::write(&config, written.replace("shards = 2", "shards = 1")).expect("it is written");
    let refused = run_err(at, &["train", "detection", "--resume", "--out", "o"]);
    assert!(refused.contains("`shards` is 1, but was 2 when the training began"), "{refused}");
    fs::write(&config, written).expect("it is written");
    // The resumed run repeats the validation, which can be stopped again.
    let child = start(at, &["train", "detection", "--resume", "--out", "o"]);
    std::thread::sleep(Duration::from_secs(1));
    signal(&child, "-TERM");
    assert_eq!(child.wait_with_output().expect("it ends").status.code(), Some(130));
    assert_eq!(fs::read_to_string(&curves).expect("it exists"), before);
}

#[cfg(unix)]
#[test]
fn a_killed_training_was_locked_and_resumes_with_the_same_curves() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let few = ["--of-each", "20", "--episodes", "1", "--image-size", "32"];
    run_ok(at, &[&["collect", "opponent", "--out", "w"][..], &few].concat());
    let small = "steps = 300\nwarm_up = 1\nbatch_size = 8\nvalidation_max_per_class = 5\nwindows = \"w\"\n\
                 [collect]\nepisodes = 1\nimage_size = 32\n";
    fs::write(at.join("c.toml"), small).expect("it is written");
    let train = ["train", "opponent", "--config", "c.toml", "--out"];
    run_ok(at, &[&train[..], &["whole"]].concat());
    let files = |folder: &str| {
        ["checkpoint.bin", "curves.jsonl", "opponent.safetensors"]
            .map(|name| fs::read(at.join(folder).join(name)).expect("it exists"))
    };
    let child = start(at, &[&train[..], &["killed"]].concat());
    wait_until_written(&at.join("killed/curves.jsonl"));
    // Paused, so that it does not finish before it is killed.
    signal(&child, "-STOP");
    for other in [&["--resume", "--out", "killed"][..], &["--out", "killed"]] {
        let refused = run_err(at, &[&["train", "opponent"][..], other].concat());
        assert!(refused.contains("in use by another `chaic train`"), "{refused}");
    }
    signal(&child, "-KILL");
    child.wait_with_output().expect("it ends");
    run_ok(at, &["train", "opponent", "--resume", "--out", "killed"]);
    assert!(files("killed") == files("whole"));
    let curves = fs::read_to_string(at.join("killed/curves.jsonl")).expect("it exists");
    let lines: BTreeSet<&str> = curves.lines().collect();
    assert_eq!(lines.len(), curves.lines().count(), "no line twice");
}
