//! A training leaves weights that helpers see by, a run says by what they saw, and what can't be read is
//! one clear line.

use std::fs;

use super::{ill, well};

/// An episode with small images.
const EVAL: [&str; 9] =
    ["eval", "--task", "high_goal", "--first", "1", "--helper", "rhp", "--size", "64"];

/// Small images, two steps: it learns nothing.
const TINY: &str = "
steps = 2
warm_up = 1
[[crops]]
views = 1
of_view = 1
side_px = 64
anywhere = 0.3
[[crops]]
views = 1
of_view = 1
side_px = 32
anywhere = 0.3
[views]
size_px = 64
";

#[test]
fn weights_of_a_training_are_what_helpers_see_by() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("tiny.toml"), TINY).unwrap();
    let train = ["train", "detector", "--config", "tiny.toml", "--out", "training"];
    well(dir, &train);
    let curves = fs::read_to_string(dir.join("training/curves.jsonl")).unwrap();
    assert!(curves.contains("\"of\":\"validation\",\"step\":2"), "{curves}");
    assert!(ill(dir, &train).contains("--resume"));
    let weights = "training/detector.safetensors";
    let evaluate = ["eval-perception", "detection", "--weights", weights, "--views", "2"];
    well(dir, &[&evaluate[..], &["--json", "report.json"]].concat());
    let report = fs::read(dir.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert!(report["map50"].is_f64() && report["map"].is_f64(), "{report}");
    // By untrained eyes nothing much is delivered; but the run is whole and says by what it saw.
    let sight = format!("learned:{weights}");
    well(dir, &[&EVAL[..], &["--perception", &sight, "--out", "run"]].concat());
    let scores = fs::read_to_string(dir.join("run/scores.json")).unwrap();
    let scores: serde_json::Value = serde_json::from_str(&scores).unwrap();
    let rhp = &scores["helpers"]["rhp"];
    assert!(rhp["perception"].as_str().is_some_and(|by| by.starts_with("learned ")), "{rhp}");
    assert!(!rhp["grants"].as_array().unwrap().iter().any(|g| g == "ids"), "{rhp}");
    well(dir, &["verify", "run"]);
    let bytes = fs::read(dir.join(weights)).unwrap();
    fs::write(dir.join("cut.safetensors"), &bytes[..bytes.len() / 2]).unwrap();
    let error = ill(dir, &[&EVAL[..], &["--perception", "learned:cut.safetensors"]].concat());
    assert!(error.contains("cut.safetensors") && error.lines().count() == 1, "{error}");
}

#[test]
fn noisy_perception_is_recorded_and_unknown_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let json = r#"{"missed": [[5, 0.1]], "misnamed": 0.1, "invented": 0.5, "scores": [0.9, 0.5]}"#;
    fs::write(dir.join("rates.json"), json).unwrap();
    well(dir, &[&EVAL[..], &["--perception", "noisy:rates.json", "--out", "run"]].concat());
    assert!(fs::read_to_string(dir.join("run/run.json")).unwrap().contains("noisy:rates.json"));
    well(dir, &["verify", "run"]);
    for nonsense in ["perfect", "learned:", "noisy:nowhere"] {
        let error = ill(dir, &[&EVAL[..], &["--perception", nonsense]].concat());
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

/// A clip or two of one episode: it learns nothing.
const TINY_BEHAVIOR: &str = "
steps = 1
warm_up = 1
clips = 1
[collect]
of_each = 1
episodes = 1
";

#[test]
fn weights_of_a_behavior_training_are_what_helpers_recognize_by() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("tiny.toml"), TINY_BEHAVIOR).unwrap();
    well(dir, &["train", "behavior", "--config", "tiny.toml", "--out", "training"]);
    let weights = "training/behavior.safetensors";
    let evaluate = ["eval-perception", "behavior", "--weights", weights, "--perception", "gt"];
    let few = ["--episodes", "1", "--clips", "2", "--json", "report.json"];
    well(dir, &[&evaluate[..], &few].concat());
    let report = fs::read(dir.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert!(report["top1"].is_f64() && report["confusion"].is_object(), "{report}");
    let behavior = format!("learned:{weights}");
    well(dir, &[&EVAL[..], &["--behavior", &behavior, "--out", "run"]].concat());
    let scores = fs::read_to_string(dir.join("run/scores.json")).unwrap();
    assert!(scores.contains("ground_truth, behavior learned "), "{scores}");
    let report = fs::read_to_string(dir.join("run/report.md")).unwrap();
    assert!(report.contains("ids from ground truth, learned behavior"), "{report}");
    well(dir, &["verify", "run"]);
    for nonsense in ["perfect", "learned:nowhere"] {
        let error = ill(dir, &[&EVAL[..], &["--behavior", nonsense]].concat());
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
