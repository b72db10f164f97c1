//! Promises: helpers use trained weights, a run records its perception, and unreadable weights are one clear error.

use std::fs;

use super::{output_of, run_err, run_ok, shorten, text};

/// Arguments of a run of a short episode with small images.
const EVAL: [&str; 7] = ["eval", "--episodes", "short", "--helper", "rhp", "--size", "64"];

/// Returns a folder with a short episode in `short/`.
fn short_episode() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("the disk has space");
    let generate = ["episodes", "generate", "--task", "high_goal", "--seeds", "0..1"];
    run_ok(folder.path(), &[&generate[..], &["--out", "short"]].concat());
    shorten(&folder.path().join("short"));
    folder
}

/// Configuration of a training with few small images and one step of each stage.
const TINY: &str = "
steps = 1
warm_up = 1
validation_views = 8
calibration_views = 8
[[crops]]
views = 1
crops_per_view = 1
side_px = 64
uniform_crop_fraction = 0.3
[[crops]]
views = 1
crops_per_view = 1
side_px = 32
uniform_crop_fraction = 0.3
[views]
size_px = 64
[second_stage]
steps = 1
views = 1
";

#[test]
fn helpers_detect_objects_with_trained_weights() {
    let folder = short_episode();
    let dir = folder.path();
    fs::write(dir.join("tiny.toml"), TINY).unwrap();
    let train = ["train", "detector", "--config", "tiny.toml", "--out", "training"];
    run_ok(dir, &train);
    let curves = fs::read_to_string(dir.join("training/curves.jsonl")).unwrap();
    assert!(curves.contains("\"phase\":\"validation\",\"step\":2"), "{curves}");
    assert!(run_err(dir, &train).contains("--resume"));
    let weights = "training/detector.safetensors";
    let evaluate = ["eval", "perception", "--weights", weights, "--views", "2"];
    let files = ["--json", "report.json", "--coco", "coco", "--faults", "faults.json"];
    let printed = run_ok(dir, &[&evaluate[..], &files].concat());
    assert!(printed.contains("\n2 all-classes views, canonical appearance, "), "{printed}");
    let coco = fs::read_to_string(dir.join("coco/annotations.json")).unwrap();
    assert!(coco.contains("all-classes views of chaic, canonical look"), "{coco}");
    let report = fs::read(dir.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert!(report["map50"].is_f64() && report["map"].is_f64(), "{report}");
    // No class has that many instances in two views.
    assert!(report["map50_of_frequent"][0].is_null(), "{report}");
    assert!(printed.contains("0 classes with at least 50 instances: map50 /\n"), "{printed}");
    for file in ["annotations.json", "detections.json"] {
        let coco = fs::read(dir.join("coco").join(file)).unwrap();
        serde_json::from_slice::<serde_json::Value>(&coco).unwrap();
    }
    let curves = fs::read_to_string(dir.join("training/curves.svg")).unwrap();
    assert!(curves.contains("map50, validation"), "{curves}");
    let noisy = ["--perception", "noisy:faults.json", "--out", "noisy"];
    run_ok(dir, &[&EVAL[..], &noisy].concat());
    // Another training can start from these weights.
    let again = ["train", "detector", "--config", "tiny.toml", "--out", "again", "--weights"];
    run_ok(dir, &[&again[..], &[weights]].concat());
    // An untrained detector delivers little, but the run is complete and records its perception.
    let sight = format!("learned:{weights}");
    run_ok(dir, &[&EVAL[..], &["--perception", &sight, "--out", "run"]].concat());
    let scores = fs::read_to_string(dir.join("run/scores.json")).unwrap();
    let scores: serde_json::Value = serde_json::from_str(&scores).unwrap();
    let rhp = &scores["helpers"]["rhp"];
    assert!(rhp["perception"].as_str().is_some_and(|by| by.starts_with("learned ")), "{rhp}");
    assert!(!rhp["grants"].as_array().unwrap().iter().any(|g| g == "ids"), "{rhp}");
    run_ok(dir, &["verify", "run"]);
    let bytes = fs::read(dir.join(weights)).unwrap();
    fs::write(dir.join("cut.safetensors"), &bytes[..bytes.len() / 2]).unwrap();
    let error = run_err(dir, &[&EVAL[..], &["--perception", "learned:cut.safetensors"]].concat());
    assert!(error.contains("cut.safetensors") && error.lines().count() == 1, "{error}");
}

#[test]
fn noisy_perception_is_recorded_and_unknown_ones_are_refused() {
    let folder = short_episode();
    let dir = folder.path();
    let json = r#"{"miss_rate_by_area": [[5, 0.1]], "misclassification_rate": 0.1, "false_positives_per_image": 0.5, "scores": [0.9, 0.5]}"#;
    fs::write(dir.join("rates.json"), json).unwrap();
    run_ok(dir, &[&EVAL[..], &["--perception", "noisy:rates.json", "--out", "run"]].concat());
    assert!(fs::read_to_string(dir.join("run/run.json")).unwrap().contains("noisy:rates.json"));
    run_ok(dir, &["verify", "run"]);
    for perception in ["noisy", "gt_tracks"] {
        run_ok(dir, &[&EVAL[..], &["--perception", perception, "--out", perception]].concat());
    }
    for nonsense in ["perfect", "learned:", "noisy:nowhere"] {
        let error = run_err(dir, &[&EVAL[..], &["--perception", nonsense]].concat());
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    let size = ["eval", "--episodes", "short", "--helper", "rhp", "--size", "100"];
    let error = run_err(dir, &[&size[..], &["--perception", "learned", "--out", "size"]].concat());
    assert!(error.contains("multiple of 32, not 100") && error.lines().count() == 1, "{error}");
}

/// Configuration of a training with one clip.
const TINY_BEHAVIOR: &str = "
steps = 1
warm_up = 1
batch_size = 1
[collect]
max_per_class = 1
episodes = 1
";

#[test]
fn helpers_recognize_behavior_with_trained_weights() {
    let folder = short_episode();
    let dir = folder.path();
    fs::write(dir.join("tiny.toml"), TINY_BEHAVIOR).unwrap();
    run_ok(dir, &["train", "behavior", "--config", "tiny.toml", "--out", "training"]);
    let weights = "training/behavior.safetensors";
    let evaluate = ["eval", "behavior", "--weights", weights, "--perception", "gt"];
    let few = ["--episodes", "1", "--clips", "2", "--json", "report.json"];
    let printed = run_ok(dir, &[&evaluate[..], &few].concat());
    assert!(printed.contains(" with gt perception, canonical appearance; columns"), "{printed}");
    let report = fs::read(dir.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert!(report["clips"].is_u64() && report["confusion"].is_object(), "{report}");
    let kept = [&evaluate[..], &few, &["--clip-folder", "clips"]].concat();
    let first = run_ok(dir, &kept);
    fs::write(dir.join("clips/clips-000000.safetensors"), "no clips").unwrap();
    assert!(run_err(dir, &kept).contains("holds no clips"));
    fs::remove_file(dir.join("clips/clips-000000.safetensors")).unwrap();
    assert_eq!(run_ok(dir, &kept), first);
    let other = output_of(dir, &[&kept[..], &["--appearance", "varied"]].concat());
    assert!(text(&other.stderr).contains("of another configuration"));
    let behavior = format!("learned:{weights}");
    run_ok(dir, &[&EVAL[..], &["--behavior", &behavior, "--out", "run"]].concat());
    let scores = fs::read_to_string(dir.join("run/scores.json")).unwrap();
    assert!(scores.contains("ground_truth, behavior learned "), "{scores}");
    let report = fs::read_to_string(dir.join("run/report.md")).unwrap();
    assert!(report.contains("ids from ground truth, learned behavior"), "{report}");
    run_ok(dir, &["verify", "run"]);
    run_ok(dir, &[&EVAL[..], &["--perception", "noisy", "--out", "as the detector"]].concat());
    for nonsense in ["perfect", "learned:nowhere"] {
        let error = run_err(dir, &[&EVAL[..], &["--behavior", nonsense]].concat());
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn tracks_are_evaluated() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let tracks = ["eval", "tracks", "--n-episodes", "1", "--json", "tracks.json"];
    let printed = run_ok(dir, &[&tracks[..], &["--perception", "gt_masks"]].concat());
    assert!(printed.contains("precision of memory"), "{printed}");
    let report = fs::read(dir.join("tracks.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert!(report["memory_recall"]["value"].as_f64().unwrap() > 0.8, "{report}");
    // One episode has no interval.
    assert!(report["memory_recall"]["interval"].is_null(), "{report}");
    assert!(printed.contains(" +- / of ") && !printed.contains("+- 0.000"), "{printed}");
    let error = run_err(dir, &["eval", "tracks", "--n-episodes", "5001"]);
    assert!(error.contains("1..=5000"), "{error}");
    let error = run_err(dir, &[&tracks[..], &["--perception", "perfect"]].concat());
    assert!(error.contains("no perception `perfect`"), "{error}");
}

#[test]
fn the_hidden_track_uses_images_alone_and_replays_show_detections() {
    let folder = short_episode();
    let dir = folder.path();
    run_ok(dir, &[&EVAL[..], &["--track", "hidden", "--out", "run"]].concat());
    let scores = fs::read_to_string(dir.join("run/scores.json")).unwrap();
    let scores: serde_json::Value = serde_json::from_str(&scores).unwrap();
    let by = scores["helpers"]["rhp"]["perception"].as_str().unwrap();
    assert!(by.starts_with("learned ") && by.contains("behavior learned "), "{by}");
    assert!(dir.join("run/traces/high_goal/rhp").is_dir());
    let replay = ["replay", "run", "high_goal/gen/0", "--every", "20", "--out", "a.gif"];
    run_ok(dir, &[&replay[..], &["--fps", "5", "--masks"]].concat());
    assert!(fs::metadata(dir.join("a.gif")).unwrap().len() > 10_000);
    assert_eq!(scores["track"], "hidden");
    let report = fs::read_to_string(dir.join("run/report.md")).unwrap();
    assert!(report.contains("Track: `hidden`."), "{report}");
    assert!(run_ok(dir, &["report", "run"]).contains("Track hidden"));
    run_ok(dir, &["verify", "run"]);
    run_ok(dir, &["eval", "--resume", "--track", "hidden", "--out", "run"]);
    let error = run_err(dir, &["eval", "--resume", "--track", "unrestricted", "--out", "run"]);
    assert!(error.contains("--track"), "{error}");
    run_ok(dir, &["merge", "--out", "merged", "run"]);
    let merged = fs::read_to_string(dir.join("merged/run.json")).unwrap();
    assert!(merged.contains("\"track\": \"hidden\""), "{merged}");
    // A trace with more grants than the track allows.
    let trace = dir.join("run/traces/high_goal/rhp/gen-0-s0.jsonl");
    let text = fs::read_to_string(&trace).unwrap();
    let (head, rest) = text.split_once('\n').unwrap();
    let mut header: serde_json::Value = serde_json::from_str(head).unwrap();
    header["people"][1]["grants"]["behavior"] = true.into();
    fs::write(&trace, format!("{header}\n{rest}")).unwrap();
    let error = run_err(dir, &["verify", "run"]);
    assert!(error.contains("is granted behavior, which the hidden track refuses"), "{error}");
}

#[test]
fn the_hidden_track_refuses_grants_of_every_kind_of_helper() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let refused = |arguments: &[&str]| {
        let play = ["eval", "--track", "hidden", "--out", "run", "--task", "high_goal"];
        let out = output_of(dir, &[&play[..], arguments].concat());
        assert_eq!(out.status.code(), Some(2), "{arguments:?}");
        let error = text(&out.stderr);
        assert_eq!(error.lines().count(), 1, "{error}");
        assert!(!dir.join("run/run.json").exists());
        error
    };
    for grant in ["ids", "goal", "progress", "behavior", "positions", "task", "state"] {
        let error = refused(&["--helper", "mine=exec:true", "--exec-grants", grant]);
        let message = format!("`mine` is granted {grant}, which the hidden track refuses");
        assert!(error.contains(&message), "{error}");
    }
    let error = refused(&["--helper", "none,rhp,oracle"]);
    assert!(error.contains("`oracle` is granted goal, progress, behavior"), "{error}");
    let endpoint = ["--endpoint", "http://127.0.0.1:9/v1", "--model", "none", "--llm-key-env", ""];
    let error = refused(&[&["--helper", "llm_known_task"], &endpoint[..]].concat());
    assert!(error.contains("`llm_known_task` is granted task"), "{error}");
    for sight in [["--perception", "gt"], ["--behavior", "gt"]] {
        let error = refused(&[&["--helper", "mine=exec:true"], &sight[..]].concat());
        assert!(error.contains("hidden track needs"), "{error}");
    }
    let error = refused(&["--helper", "mine=exec:true", "--rules", "compat"]);
    assert!(error.contains("--set world.joint_lift=paper"), "{error}");
    let error = refused(&["--helper", "rhp", "--set", "planner.knows_partner_behavior=true"]);
    assert!(error.contains("planner.knows_partner_behavior"), "{error}");
}

#[test]
fn data_sets_are_complete_and_collected_once() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let collect = ["collect", "detection", "--views", "3", "--out", "views"];
    run_ok(dir, &collect);
    assert!(run_err(dir, &collect).contains("isn't empty"));
    let read = |file: &str| fs::read(dir.join("views").join(file)).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&read("annotations.json")).unwrap();
    let images = json["images"].as_array().unwrap();
    let annotations = json["annotations"].as_array().unwrap();
    assert!(images.len() == 3 && annotations.len() > 3, "{}", annotations.len());
    for image in images {
        let name = image["file_name"].as_str().unwrap();
        let color = image::load_from_memory(&read(&format!("images/{name}"))).unwrap();
        let depth = image::load_from_memory(&read(&format!("depth/{name}"))).unwrap();
        assert_eq!((color.width(), color.color()), (512, image::ColorType::Rgb8));
        assert_eq!((depth.height(), depth.color()), (512, image::ColorType::L16));
        assert!(depth.into_luma16().pixels().any(|p| p.0[0] > 500), "nothing is farther off");
    }
    let statistics: serde_json::Value = serde_json::from_slice(&read("statistics.json")).unwrap();
    let counted = |sizes: &serde_json::Value| -> u64 {
        sizes.as_array().unwrap().iter().filter_map(serde_json::Value::as_u64).sum()
    };
    let all: u64 = statistics.as_object().unwrap().values().map(counted).sum();
    assert_eq!(all, annotations.len() as u64);

    let clips = ["collect", "behavior", "--perception", "gt", "--episodes", "1", "--out", "clips"];
    run_ok(dir, &[&clips[..], &["--clips", "2"]].concat());
    let file = dir.join("clips/clips-000000.safetensors");
    let written = fs::metadata(&file).unwrap().modified().unwrap();
    run_ok(dir, &[&clips[..], &["--clips", "2"]].concat());
    assert_eq!(fs::metadata(&file).unwrap().modified().unwrap(), written, "it was written again");
    let other = output_of(dir, &[&clips[..], &["--clips", "3"]].concat());
    assert!(text(&other.stderr).contains("of another configuration"));
    assert_eq!(other.status.code(), Some(2));
}
