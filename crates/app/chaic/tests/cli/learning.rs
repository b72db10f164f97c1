//! Promise: a policy that was trained is a helper of a run, whose traces verify and become data sets; mistakes are told
//! in one line.

use std::fs;

use super::{ill, well};

#[test]
fn an_opponent_model_tells_a_policy_of_its_partner() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let few = ["--of-each", "20", "--episodes", "1", "--image-size", "32"];
    let collected = well(at, &[&["collect", "opponent", "--out", "w"][..], &few].concat());
    assert!(collected.contains("pick"), "{collected}");
    let small = "steps = 2\nwarm_up = 1\nvalidation_of_each = 5\nwindows = \"w\"\n\
                 [collect]\nepisodes = 1\nimage_size = 32\n";
    fs::write(at.join("model.toml"), small).expect("it is written");
    well(at, &["train", "opponent", "--config", "model.toml", "--out", "o"]);
    let weights = "o/opponent.safetensors";
    let told = well(at, &[&["eval-opponent", "--weights", weights][..], &few].concat());
    assert!(told.contains("goal accuracy") && told.contains("no_wheelchair"), "{told}");
    assert!(ill(at, &["eval-opponent", "--weights", "w"]).contains('w'));
    let policy = "iterations = 1\n[play]\nepisodes = 1\nvalidation_episodes = 1\nimage_size = 16\n\
                  tasks = [\"low_target\"]\nopponent = \"o/opponent.safetensors\"\n";
    fs::write(at.join("policy.toml"), policy).expect("it is written");
    well(at, &["train", "ppo", "--config", "policy.toml", "--out", "p"]);
    // The model is within the policy's weights.
    fs::remove_file(at.join(weights)).expect("it is there");
    let helper = "smart=policy:p/policy.safetensors";
    let eval = ["eval", "--task", "moving_house", "--first", "1", "--out", "run"];
    well(at, &[&eval[..], &["--helper", helper]].concat());
    // What was played becomes a data set.
    let exported = well(at, &["export", "lerobot", "run", "--out", "set", "--every", "30"]);
    assert!(exported.contains("1 episode"), "{exported}");
    assert!(ill(at, &["export", "lerobot", "run", "--out", "set"]).contains("isn't empty"));
    assert!(ill(at, &["export", "lerobot", "p", "--out", "x"]).contains("is no run"));
}

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
