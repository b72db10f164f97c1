//! Promise: a trained policy plays as a helper, and its traces can be verified and exported. Errors are one line.

use std::fs;

use super::{run_err, run_ok};

#[test]
fn an_opponent_model_is_an_input_of_a_policy() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let few = ["--of-each", "20", "--episodes", "1", "--image-size", "32"];
    let collected = run_ok(at, &[&["collect", "opponent", "--out", "w"][..], &few].concat());
    assert!(collected.contains("pick"), "{collected}");
    let small = "steps = 2\nwarm_up = 1\nvalidation_max_per_class = 5\nwindows = \"w\"\n\
                 [collect]\nepisodes = 1\nimage_size = 32\n";
    fs::write(at.join("model.toml"), small).expect("it is written");
    run_ok(at, &["train", "opponent", "--config", "model.toml", "--out", "o"]);
    let weights = "o/opponent.safetensors";
    let reply = run_ok(at, &[&["eval", "opponent", "--weights", weights][..], &few].concat());
    assert!(reply.contains("goal accuracy") && reply.contains("no_wheelchair"), "{reply}");
    assert!(reply.contains(" ± /  ("), "one episode has no standard error: {reply}");
    assert!(run_err(at, &["eval", "opponent", "--weights", "w"]).contains('w'));
    let policy = "iterations = 1\n[rollout]\nepisodes = 1\nvalidation_episodes = 1\nimage_size = 16\n\
                  tasks = [\"low_target\"]\nopponent = \"o/opponent.safetensors\"\n";
    fs::write(at.join("policy.toml"), policy).expect("it is written");
    run_ok(at, &["train", "ppo", "--config", "policy.toml", "--out", "p"]);
    // The weights of the policy contain the model.
    fs::remove_file(at.join(weights)).expect("it exists");
    let helper = "smart=policy:p/policy.safetensors";
    let eval = ["eval", "--task", "moving_house", "--first", "1", "--out", "run"];
    run_ok(at, &[&eval[..], &["--helper", helper]].concat());
    // Exports the played episode.
    let exported = run_ok(at, &["export", "lerobot", "run", "--out", "set", "--every", "30"]);
    assert!(exported.contains("1 episode"), "{exported}");
    assert!(run_err(at, &["export", "lerobot", "run", "--out", "set"]).contains("isn't empty"));
    assert!(run_err(at, &["export", "lerobot", "p", "--out", "x"]).contains("is not a run"));
    for file in ["README.md", "croissant.json"] {
        let text = fs::read_to_string(at.join("set").join(file)).expect("it was written");
        assert!(text.contains("next.reward"), "{text}");
    }
}

/// The files of an exported split are playable, and its metadata describes them.
#[test]
fn a_split_is_exported_with_metadata() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let export = ["export", "episodes", "--split", "gen:7..9", "--task", "shopping,moving_house"];
    let export = [&export[..], &["--out", "set"]].concat();
    assert!(run_ok(at, &export).contains("4 episodes"));
    assert!(run_err(at, &export).contains("isn't empty"));
    run_ok(at, &["episodes", "validate", "set/episodes/shopping-7.json"]);
    let metadata = fs::read(at.join("set/croissant.json")).expect("it was written");
    let metadata: serde_json::Value = serde_json::from_slice(&metadata).expect("JSON");
    assert_eq!(metadata["distribution"][0]["includes"], "episodes/*.json");
    assert_eq!(
        metadata["recordSet"][0]["field"][1]["source"]["extract"]["jsonPath"],
        "$.setup.task"
    );
    let none = ["export", "episodes", "--split", "train", "--task", "tremor", "--out", "none"];
    assert!(run_err(at, &none).contains("no episodes"));

    // Files of a folder are exported like a split.
    let files = ["export", "episodes", "--episodes", "set/episodes"];
    let some = [&files[..], &["--task", "shopping", "--out", "some"]].concat();
    assert!(run_ok(at, &some).contains("2 episodes"));
    let [split, folder] = ["set", "some"]
        .map(|set| fs::read(at.join(set).join("episodes/shopping-8.json")).expect("an episode"));
    assert!(split == folder);
    let both = [&files[..], &["--split", "train", "--out", "both"]].concat();
    assert!(run_err(at, &both).contains("cannot be used with"));
    let none = [&files[..], &["--task", "obstacle", "--out", "none"]].concat();
    assert!(run_err(at, &none).contains("no episode file (*.json) of these tasks"));
    fs::create_dir(at.join("empty")).expect("the disk has space");
    let empty = run_err(at, &["export", "episodes", "--episodes", "empty", "--out", "none"]);
    assert!(empty.contains("empty holds no episode file (*.json)\n"), "{empty}");
    // An edited episode is not generated.
    super::shorten(&at.join("set/episodes"));
    let edited = run_err(at, &[&files[..], &["--out", "edited"]].concat());
    assert!(
        edited.contains("no generator of this version") && !at.join("edited").exists(),
        "{edited}"
    );
}

#[test]
fn a_trained_policy_is_a_helper() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let small = "iterations = 1\n[rollout]\nepisodes = 1\nvalidation_episodes = 1\nimage_size = 16\n\
                 tasks = [\"low_target\"]\n";
    fs::write(at.join("small.toml"), small).expect("it is written");
    let trained = run_ok(at, &["train", "clone", "--config", "small.toml", "--out", "t"]);
    assert!(trained.contains("chaic eval --helper mine=policy:t/policy.safetensors"), "{trained}");
    for (assignment, problem) in [
        ("rollout.image_size=8", "16 to 1024"),
        ("rollout.size=64", "unknown field `size`"),
        ("rollout.tasks=[]", "`rollout.tasks` is empty"),
        ("image_size", "expected KEY=VALUE"),
    ] {
        let wrong = ["train", "ppo", "--config", "small.toml", "--out", "x", "--set", assignment];
        let reply = run_err(at, &wrong);
        assert!(reply.contains(problem) && reply.lines().count() == 1, "{reply}");
    }
    let again = ["train", "ppo", "--config", "small.toml", "--weights", "t/policy.safetensors"];
    run_ok(at, &[&again[..], &["--out", "u", "--set", "rollout.image_size=32"]].concat());
    let config = fs::read_to_string(at.join("u/config.toml")).expect("it exists");
    assert!(config.contains("image_size = 32"), "{config}");
    let helper = "none,mine=policy:u/policy.safetensors";
    let few = ["--task", "low_target", "--first", "1", "--size", "64"];
    let eval = [&["eval"], &few[..], &["--out", "run", "--helper"]].concat();
    let report = run_ok(at, &[&eval[..], &[helper]].concat());
    assert!(report.contains("mine") && report.contains("w/o"), "{report}");
    run_ok(at, &["verify", "run"]);
    // The weights differ from those of the run.
    let other =
        ["eval", "--resume", "--out", "run", "--helper", "none,mine=policy:t/policy.safetensors"];
    assert!(run_err(at, &other).contains("started with other weights for `mine`"));
    for (helper, problem) in [
        ("mine=policy:small.toml", "small.toml"),
        ("mine=policy:missing", "missing"),
        ("rhp=policy:u/policy.safetensors", "there is a helper `rhp` already"),
        ("a b=policy:u/policy.safetensors", "`a b` is not a valid name"),
    ] {
        let reply =
            run_err(at, &["eval", "--task", "low_target", "--out", "x", "--helper", helper]);
        assert!(reply.contains(problem) && reply.lines().count() == 1, "{reply}");
    }
}

#[test]
fn a_bundled_helper_is_listed_played_and_verified() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    assert!(run_ok(at, &["list", "helpers"]).contains("cloned"));
    let eval = ["eval", "--task", "low_target", "--first", "1", "--size", "64", "--out", "run"];
    run_ok(at, &[&eval[..], &["--helper", "cloned"]].concat());
    run_ok(at, &["verify", "run"]);
    // run.json and the trace name the weights.
    let file = at.join("run/run.json");
    let text = fs::read_to_string(&file).expect("it exists");
    let run: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    let digest = run["granted"]["weights"]["cloned"].as_str().expect("a digest");
    fs::write(&file, text.replace(digest, "000000000000")).expect("it is written");
    assert!(run_err(at, &["verify", "run"]).contains("names other weights"));
}
