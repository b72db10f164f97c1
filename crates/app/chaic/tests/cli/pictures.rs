//! Promises on images, videos, scenes and episode files, and on `chaic bench`.

use std::fs;
use std::path::Path;

use crate::*;

/// Images that `chaic render` writes.
const PICTURES: [&str; 8] = [
    "rgb.png",
    "depth.png",
    "ids.png",
    "ids.json",
    "classes.png",
    "classes.json",
    "normals.png",
    "plan.png",
];

#[test]
fn a_page_contains_the_replays_of_a_run_and_runs_are_compared() {
    let dir = short_episodes();
    let at = dir.path();
    run_ok(at, &EVAL);
    let report = fs::read_to_string(at.join("run/report.html")).expect("a text file");
    // Two episodes with and without helper.
    assert_eq!(report.matches("class=\"chaic-replay\"").count(), 4);
    assert!(
        report.contains("Watch from")
            && report.contains("--helper none,rhp --episodes DIR --size 48")
    );
    assert!(run_ok(at, &["view", "run"]).contains("4 replays of"));
    let page = fs::read_to_string(at.join("run/view.html")).expect("a text file");
    assert_eq!(page.matches("class=\"chaic-replay\"").count(), 4);
    assert!(page.contains("gen&#x2f;0, rhp, seed 0"), "slashes are escaped");
    let one = ["view", "run", "gen/0", "--helper", "rhp", "--max", "1", "--out", "one.html"];
    let out = output_of(at, &one);
    assert!(text(&out.stdout).contains("1 replay of") && text(&out.stderr).contains("1 more"));
    let error = run_err(at, &["view", "run", "obstacle/test/00"]);
    assert!(error.contains("obstacle/test/00") && error.contains("4 traces, for"), "{error}");
    let error = run_err(at, &["view", "run", "--helper", "oracle"]);
    assert!(error.contains("no traces with oracle"), "{error}");

    run_ok(at, &[&EVAL[..5], &["--size", "64", "--out", "again"]].concat());
    let table = run_ok(at, &["report", "run", "--baseline", "again"]);
    assert!(table.contains("TR minus that in again") && table.contains("RHP"), "{table}");
    let error = run_err(at, &["report", "run", "--baseline", "again", "--format", "csv"]);
    assert!(error.contains("choose --format text or md"), "{error}");
}

#[test]
fn a_page_to_play_and_single_traces() {
    let dir = tempfile::tempdir().expect("a folder");
    let at = dir.path();
    let episode = "low_target/test/00/wheelchair";
    assert!(run_ok(at, &["play", episode]).contains("1 episode in"));
    let page = fs::read_to_string(at.join("play.html")).expect("a text file");
    assert!(page.contains("id=\"game\"") && page.contains("<option>infer</option>"));
    assert!(run_err(at, &["play", "low_target/test/99"]).contains("low_target/test/99"));

    let eval = ["eval", "--task", "low_target", "--n-episodes", "1", "--helper", "none"];
    run_ok(at, &[&eval[..], &["--size", "32", "--out", "run"]].concat());
    let trace = "run/traces/low_target/none/test-00-s0.jsonl";
    assert!(run_ok(at, &["verify", trace]).contains("decisions: all digests agree"));
    let recorded = fs::read_to_string(at.join(trace)).expect("a text file");
    let altered = recorded.replacen("turn_left", "turn_right", 1);
    fs::write(at.join("altered.jsonl"), altered).expect("written");
    let output = output_of(at, &["verify", "altered.jsonl"]);
    assert!(!output.status.success() && text(&output.stdout).contains("DIFFERS altered.jsonl"));
    // A trace may end early, as that of a game. With a part of another line it is damaged.
    let short: String = recorded.split_inclusive('\n').take(200).collect();
    fs::write(at.join("cut.jsonl"), format!("{short}{{\"frame\":")).expect("written");
    fs::write(at.join("short.jsonl"), short).expect("written");
    let output = output_of(at, &["verify", "cut.jsonl", "--format", "json"]);
    assert!(!output.status.success() && text(&output.stdout).contains("\"passed\": false"));
    let output = output_of(at, &["verify", "short.jsonl"]);
    assert!(output.status.success() && text(&output.stdout).contains("all digests agree"));
    fs::write(at.join("foreign.jsonl"), "{}\n").expect("written");
    assert!(run_err(at, &["verify", "foreign.jsonl"]).contains("foreign.jsonl"));
    let absent = recorded.replacen("low_target/test/00", "low_target/test/99", 1);
    fs::write(at.join("absent.jsonl"), &absent).expect("written");
    let output = output_of(at, &["verify", "absent.jsonl"]);
    let message = text(&output.stderr);
    assert!(message.contains("absent.jsonl: no episode `low_target/test/99`"), "{message}");
    assert_eq!(output.status.code(), Some(1), "{message}");
    // Such a trace is altered at the place of a planned one, and otherwise no part of the run.
    let path = at.join(trace);
    fs::write(path.with_file_name("test-99-s0.jsonl"), &absent).expect("written");
    fs::write(path, absent).expect("written");
    for (episode, problem) in [
        ("low_target/test/00", "the trace was altered, so it is not explained"),
        ("low_target/test/99", "run has no trace of low_target/test/99"),
    ] {
        let output = output_of(at, &["explain", "run", episode]);
        let message = text(&output.stderr);
        assert!(message.contains(problem), "{message}");
        assert_eq!(output.status.code(), Some(1), "{message}");
    }
}

#[test]
fn images_and_episode_files() {
    let dir = short_episodes();
    let at = dir.path();
    let file = "short/no_constraint-0.json";
    let printed = run_ok(
        at,
        &["render", file, "--agent", "partner", "--frame", "20", "--out", "p", "--size", "64"],
    );
    assert!(printed.contains("partner"), "{printed}");
    for name in PICTURES {
        assert!(at.join("p").join(name).exists(), "{name}");
    }
    let classes = fs::read_to_string(at.join("p/classes.json")).expect("a text file");
    assert!(serde_json::from_str::<std::collections::BTreeMap<u8, String>>(&classes).is_ok());
    let ids = fs::read_to_string(at.join("p/ids.json")).expect("a text file");
    assert!(ids.contains("\"floor\""), "{ids}");
    let child = run_err(at, &["render", file, "--agent", "child", "--out", "c"]);
    assert!(child.contains("has no child"), "{child}");

    run_ok(at, &["episodes", "show", "obstacle/test/00", "--out", "plan.png", "--width", "200"]);
    assert!(at.join("plan.png").exists());
    let list = run_ok(at, &["episodes", "list", "--task", "obstacle"]);
    assert!(list.contains("obstacle/test/11"), "{list}");
    let json = run_ok(at, &["episodes", "list", "--task", "obstacle,shopping", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json.as_array().map(Vec::len), Some(24));
    let empty = ["episodes", "list", "--split", "standard", "--task", "tremor", "--format", "json"];
    assert_eq!(run_ok(at, &empty), "[]\n");
    assert!(run_ok(at, &["episodes", "schema"]).contains("chaic-episode"));

    assert!(run_ok(at, &["episodes", "validate", file]).contains("fine"));
    let good = fs::read_to_string(at.join(file)).expect("a text file");
    fs::write(
        at.join("bad.json"),
        good.replacen(&format!("\"horizon\": {FRAMES}"), "\"horizon\": 0", 1),
    )
    .expect("the disk has space");
    fs::write(at.join("torn.json"), &good[..good.len() / 2]).expect("the disk has space");
    let found =
        run_err(at, &["episodes", "validate", file, "bad.json", "torn.json", "missing.json"]);
    for words in
        ["bad.json: setup.horizon", "torn.json: ends prematurely", "missing.json", "3 of 4"]
    {
        assert!(found.contains(words), "{words}: {found}");
    }
}

#[test]
fn appearances_change_colors_only() {
    let dir = short_episodes();
    let at = dir.path();
    let render = ["render", "short/no_constraint-0.json", "--frame", "20", "--size", "64"];
    let folders = ["canonical", "evening", "varied:3"].map(|appearance| {
        run_ok(at, &[&render[..], &["--appearance", appearance, "--out", appearance]].concat());
        at.join(appearance)
    });
    run_ok(at, &[&render[..], &["--out", "usual"]].concat());
    let file = |folder: &Path, name: &str| fs::read(folder.join(name)).expect("it was written");
    for name in PICTURES {
        assert!(file(&at.join("usual"), name) == file(&folders[0], name), "{name}");
        let others: Vec<Vec<u8>> = folders.iter().map(|folder| file(folder, name)).collect();
        let is_color = ["rgb.png", "plan.png"].contains(&name);
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            assert_eq!(others[a] != others[b], is_color, "{name} of {a} and {b}");
        }
    }
    for wrong in ["", "dusk", "varied", "varied:-1", "varied:x"] {
        let out = output_of(at, &[&render[..], &["--appearance", wrong, "--out", "w"]].concat());
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{wrong:?}: {message}");
        assert!(
            message.contains(APPEARANCES) && message.contains("--appearance"),
            "{wrong:?}: {message}"
        );
    }
    assert!(!at.join("w").exists());
}

#[test]
fn a_replay_has_the_appearance_of_the_run() {
    let dir = short_episodes();
    let at = dir.path();
    let eval = ["eval", "--episodes", "short", "--task", "no_constraint", "--helper", "rhp"];
    let id = "no_constraint/gen/0";
    let pictures = ["canonical", "evening"].map(|appearance| {
        let message = ["--size", "48", "--appearance", appearance, "--out", appearance];
        run_ok(at, &[&eval[..], &message].concat());
        assert!(run_ok(at, &["verify", appearance]).contains("1 trace"));
        let video = format!("{appearance}.gif");
        run_ok(at, &["replay", appearance, id, "--every", "40", "--out", &video]);
        fs::read(at.join(video)).expect("it was written")
    });
    assert!(pictures[0] != pictures[1], "the replay has the default appearance");
    let trace = |run: &str| {
        let path = at.join(run).join("traces/no_constraint/rhp/gen-0-s0.jsonl");
        fs::read_to_string(path).expect("a text file")
    };
    let (day, evening) = (trace("canonical"), trace("evening"));
    assert_eq!(day, evening.replacen(",\"appearance\":\"evening\"", "", 1));

    // A trace that contradicts its run, or is invalid, is detected.
    for (changed, words) in [
        (day, "the first line differs from the one that this run writes: appearance"),
        (evening.replacen("\"evening\"", "\"dusk\"", 1), APPEARANCES),
    ] {
        fs::write(at.join("evening/traces/no_constraint/rhp/gen-0-s0.jsonl"), changed)
            .expect("the disk has space");
        let message = run_err(at, &["verify", "evening"]);
        assert!(message.contains(words), "{words}: {message}");
    }
    let message = run_err(at, &["replay", "evening", id, "--out", "x.gif"]);
    assert!(message.contains("line 1") && message.contains(APPEARANCES), "{message}");
}

#[test]
fn scene_files_and_benchmarks() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let id = "shopping/test/00";
    let message = run_ok(at, &["scene", "export", id, "--out", "s.glb", "--detail", "1"]);
    let scene = gltf::Gltf::open(at.join("s.glb")).expect("the file is valid");
    let count = |primitive: gltf::Primitive| primitive.indices().map_or(0, |i| i.count() / 3);
    let meshes = scene.nodes().filter_map(|node| node.mesh());
    let triangles: usize = meshes.flat_map(|m| m.primitives()).map(count).sum();
    assert!(message.contains(&format!("{id} in ")), "{message}");
    assert!(message.ends_with(&format!(" nodes with {triangles} triangles\n")), "{message}");
    let names: Vec<&str> = scene.nodes().filter_map(|node| node.name()).collect();
    for name in ["floor#1", "person#8", "eye of partner", "eye of helper", "bike#"] {
        assert!(names.iter().any(|n| n.starts_with(name)), "{name}: {names:?}");
    }
    let house = "obstacle/test/00";
    let whole = run_ok(at, &["scene", "export", house, "--out", "a.glb"]);
    let open = run_ok(at, &["scene", "export", house, "--out", "b.glb", "--no-ceiling"]);
    assert_ne!(whole.split(' ').nth(3), open.split(' ').nth(3), "{whole}{open}");
    for (arguments, words) in [
        (["obstacle/test/99", "--out", "x.glb"], "obstacle/test/99"),
        ([house, "--out", "nowhere/x.glb"], "can't write nowhere/x.glb"),
        ([house, "--out", "x.obj"], "ends in .glb"),
    ] {
        let message = run_err(at, &[&["scene", "export"], &arguments[..]].concat());
        assert!(
            message.contains(words) && message.lines().count() <= 4,
            "{arguments:?}: {message}"
        );
    }

    let quick = ["--seconds", "0.01", "--format", "json"];
    let looked_at = ["bench", "render", "--size", "32", "--threads", "2"];
    let json = run_ok(at, &[&looked_at[..], &quick].concat());
    let speed: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!((&speed["objects"], &speed["size"]), (&150.into(), &32.into()));
    assert!(speed["triangles"].as_u64() > Some(10_000), "{speed}");
    for figure in ["ms_per_frame", "frames_per_second"] {
        assert!(speed[figure].as_f64() > Some(0.0), "{figure}: {speed}");
    }
    let text =
        run_ok(at, &["bench", "render", "--episode", id, "--size", "32", "--seconds", "0.01"]);
    assert!(text.starts_with(id) && text.contains("ms a frame"), "{text}");
    let json =
        run_ok(at, &[&["bench", "world", "--task", "obstacle,shopping"], &quick[..]].concat());
    let speeds: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(speeds[1]["episode"], id);
    assert!(speeds[0]["frames_per_second"].as_f64() > Some(0.0), "{speeds}");
    run_ok(at, &["bench", "scene", "--size", "32", "--out", "b"]);
    let cameras = fs::read_to_string(at.join("b/cameras.json")).expect("a text file");
    let cameras: serde_json::Value = serde_json::from_str(&cameras).expect("it is JSON");
    assert_eq!(cameras["cameras"].as_array().map(Vec::len), Some(16));
    assert!(at.join("b/scene.glb").exists() && at.join("b/chaic.png").exists());
    for wrong in [["--channels", "rgb+smell"], ["--threads", "0"], ["--seconds", "never"]] {
        let out = output_of(at, &[&["bench", "render"], &wrong[..]].concat());
        assert_eq!(out.status.code(), Some(2), "{wrong:?}: {}", self::text(&out.stderr));
    }
    let out = output_of(at, &["bench", "env", "--task", "obstacle,one_handed"]);
    let message = self::text(&out.stderr);
    assert!(message.contains("one_handed has no training episode"), "{message}");
    assert_eq!(out.status.code(), Some(2), "{message}");
}

#[test]
fn the_gpu_renderer_is_measured_if_the_build_has_it() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let arguments =
        ["bench", "render", "--gpu=any", "--worlds", "2", "--size", "32", "--seconds", "0.01"];
    if cfg!(feature = "gpu") {
        let speed: serde_json::Value = serde_json::from_str(&run_ok(
            dir.path(),
            &[&arguments[..], &["--format", "json"]].concat(),
        ))
        .expect("JSON");
        assert!(speed["worlds"] == 2 && speed["views"] == 2, "{speed}");
    } else {
        assert!(run_err(dir.path(), &arguments).contains("--features gpu"));
    }
    let both = output_of(dir.path(), &[&arguments[..], &["--threads", "2"]].concat());
    assert_eq!(both.status.code(), Some(2));
}
