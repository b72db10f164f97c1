//! Promise: a policy that was trained is a helper of a run, whose traces verify; mistakes are told in one line.

use std::fs;

use super::{ill, well};

#[test]
fn a_trained_policy_is_a_helper() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let small = "iterations = 1\n[play]\nepisodes = 1\nvalidation_episodes = 1\nimage_size = 16\n\
                 tasks = [\"low_target\"]\n";
    fs::write(at.join("small.toml"), small).expect("it is written");
    let trained = well(at, &["train", "clone", "--config", "small.toml", "--out", "t"]);
    assert!(trained.contains("chaic eval --helper mine=policy:t/policy.safetensors"), "{trained}");
    let again = ["train", "ppo", "--config", "small.toml", "--weights", "t/policy.safetensors"];
    well(at, &[&again[..], &["--out", "u"]].concat());
    let helper = "mine=policy:u/policy.safetensors";
    let eval = ["eval", "--task", "low_target", "--first", "1", "--out", "run", "--helper"];
    let report = well(at, &[&eval[..], &[helper]].concat());
    assert!(report.contains("mine"), "{report}");
    well(at, &["verify", "run"]);
    // Other weights than those that it was begun with.
    let other =
        ["eval", "--resume", "--out", "run", "--helper", "mine=policy:t/policy.safetensors"];
    assert!(ill(at, &other).contains("begun with other weights for `mine`"));
    for (helper, problem) in [
        ("mine=policy:small.toml", "small.toml"),
        ("mine=policy:missing", "missing"),
        ("rhp=policy:u/policy.safetensors", "there is a helper `rhp` already"),
    ] {
        let told = ill(at, &["eval", "--task", "low_target", "--out", "x", "--helper", helper]);
        assert!(told.contains(problem) && told.lines().count() == 1, "{told}");
    }
}
