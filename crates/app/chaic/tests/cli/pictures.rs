//! Pictures, videos, scenes and episodes as files, and the benches.

use std::fs;
use std::path::Path;

use crate::*;

/// What `chaic render` writes.
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
fn pictures_and_episodes() {
    let dir = workshop();
    let at = dir.path();
    let file = "short/no_constraint-0.json";
    let printed = well(
        at,
        &["render", file, "--agent", "partner", "--frame", "20", "--out", "p", "--size", "64"],
    );
    assert!(printed.contains("partner"), "{printed}");
    for name in PICTURES {
        assert!(at.join("p").join(name).exists(), "{name}");
    }
    let classes = fs::read_to_string(at.join("p/classes.json")).expect("it is text");
    assert!(serde_json::from_str::<std::collections::BTreeMap<u8, String>>(&classes).is_ok());
    let ids = fs::read_to_string(at.join("p/ids.json")).expect("it is text");
    assert!(ids.contains("\"floor\""), "{ids}");
    let child = ill(at, &["render", file, "--agent", "child", "--out", "c"]);
    assert!(child.contains("has no child"), "{child}");

    well(at, &["episodes", "show", "obstacle/test/00", "--out", "plan.png", "--width", "200"]);
    assert!(at.join("plan.png").exists());
    let list = well(at, &["episodes", "list", "--task", "obstacle"]);
    assert!(list.contains("obstacle/test/11"), "{list}");
    let json = well(at, &["episodes", "list", "--task", "obstacle,shopping", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json.as_array().map(Vec::len), Some(24));
    assert!(well(at, &["episodes", "schema"]).contains("chaic-episode"));

    assert!(well(at, &["episodes", "validate", file]).contains("fine"));
    let good = fs::read_to_string(at.join(file)).expect("it is text");
    fs::write(
        at.join("bad.json"),
        good.replacen(&format!("\"horizon\": {FRAMES}"), "\"horizon\": 0", 1),
    )
    .expect("there is room");
    fs::write(at.join("torn.json"), &good[..good.len() / 2]).expect("there is room");
    let found = ill(at, &["episodes", "validate", file, "bad.json", "torn.json", "missing.json"]);
    for words in ["bad.json: setup.horizon", "torn.json: ends too early", "missing.json", "3 of 4"]
    {
        assert!(found.contains(words), "{words}: {found}");
    }
}

#[test]
fn appearances_change_colors_and_nothing_else() {
    let dir = workshop();
    let at = dir.path();
    let render = ["render", "short/no_constraint-0.json", "--frame", "20", "--size", "64"];
    let folders = ["canonical", "evening", "varied:3"].map(|appearance| {
        well(at, &[&render[..], &["--appearance", appearance, "--out", appearance]].concat());
        at.join(appearance)
    });
    well(at, &[&render[..], &["--out", "usual"]].concat());
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
        let out = chaic(at, &[&render[..], &["--appearance", wrong, "--out", "w"]].concat());
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{wrong:?}: {said}");
        assert!(said.contains(APPEARANCES) && said.contains("--appearance"), "{wrong:?}: {said}");
    }
    assert!(!at.join("w").exists());
}

#[test]
fn a_replay_looks_like_what_was_played() {
    let dir = workshop();
    let at = dir.path();
    let eval = ["eval", "--episodes", "short", "--task", "no_constraint", "--helper", "rhp"];
    let id = "no_constraint/gen/0";
    let pictures = ["canonical", "evening"].map(|appearance| {
        let said = ["--size", "48", "--appearance", appearance, "--out", appearance];
        well(at, &[&eval[..], &said].concat());
        assert!(well(at, &["verify", appearance]).contains("1 trace"));
        let video = format!("{appearance}.gif");
        well(at, &["replay", appearance, id, "--every", "40", "--out", &video]);
        fs::read(at.join(video)).expect("it was written")
    });
    assert!(pictures[0] != pictures[1], "the light of what was played is lost");
    let trace = |run: &str| {
        let path = at.join(run).join("traces/no_constraint/rhp/gen-0-s0.jsonl");
        fs::read_to_string(path).expect("it is text")
    };
    let (day, evening) = (trace("canonical"), trace("evening"));
    assert_eq!(day, evening.replacen(",\"appearance\":\"evening\"", "", 1));

    // A trace that says something else than its run is found out, and so is nonsense.
    for (changed, words) in [
        (day, "the first line is not what this run has: appearance"),
        (evening.replacen("\"evening\"", "\"dusk\"", 1), APPEARANCES),
    ] {
        fs::write(at.join("evening/traces/no_constraint/rhp/gen-0-s0.jsonl"), changed)
            .expect("there is room");
        let said = ill(at, &["verify", "evening"]);
        assert!(said.contains(words), "{words}: {said}");
    }
    let said = ill(at, &["replay", "evening", id, "--out", "x.gif"]);
    assert!(said.contains("line 1") && said.contains(APPEARANCES), "{said}");
}

#[test]
fn scenes_as_files_and_what_the_machine_reaches() {
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    let id = "shopping/test/00";
    let said = well(at, &["scene", "export", id, "--out", "s.glb", "--detail", "1"]);
    let scene = gltf::Gltf::open(at.join("s.glb")).expect("the file is valid");
    let count = |primitive: gltf::Primitive| primitive.indices().map_or(0, |i| i.count() / 3);
    let meshes = scene.nodes().filter_map(|node| node.mesh());
    let triangles: usize = meshes.flat_map(|m| m.primitives()).map(count).sum();
    assert!(said.contains(&format!("{id} in ")), "{said}");
    assert!(said.ends_with(&format!(" nodes with {triangles} triangles\n")), "{said}");
    let names: Vec<&str> = scene.nodes().filter_map(|node| node.name()).collect();
    for name in ["floor#1", "person#8", "eye of partner", "eye of helper", "bike#"] {
        assert!(names.iter().any(|n| n.starts_with(name)), "{name}: {names:?}");
    }
    let house = "obstacle/test/00";
    let whole = well(at, &["scene", "export", house, "--out", "a.glb"]);
    let open = well(at, &["scene", "export", house, "--out", "b.glb", "--no-ceiling"]);
    assert_ne!(whole.split(' ').nth(3), open.split(' ').nth(3), "{whole}{open}");
    for (arguments, words) in [
        (["obstacle/test/99", "--out", "x.glb"], "obstacle/test/99"),
        ([house, "--out", "nowhere/x.glb"], "can't write nowhere/x.glb"),
        ([house, "--out", "x.obj"], "ends in .glb"),
    ] {
        let said = ill(at, &[&["scene", "export"], &arguments[..]].concat());
        assert!(said.contains(words) && said.lines().count() <= 4, "{arguments:?}: {said}");
    }

    let quick = ["--seconds", "0.01", "--format", "json"];
    let looked_at = ["bench", "render", "--size", "32", "--threads", "2"];
    let json = well(at, &[&looked_at[..], &quick].concat());
    let speed: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!((&speed["objects"], &speed["size"]), (&150.into(), &32.into()));
    assert!(speed["triangles"].as_u64() > Some(10_000), "{speed}");
    for figure in ["ms_per_frame", "frames_per_second"] {
        assert!(speed[figure].as_f64() > Some(0.0), "{figure}: {speed}");
    }
    let text = well(at, &["bench", "render", "--episode", id, "--size", "32", "--seconds", "0.01"]);
    assert!(text.starts_with(id) && text.contains("ms a frame"), "{text}");
    let json = well(at, &[&["bench", "world", "--task", "obstacle,shopping"], &quick[..]].concat());
    let speeds: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(speeds[1]["episode"], id);
    assert!(speeds[0]["frames_per_second"].as_f64() > Some(0.0), "{speeds}");
    well(at, &["bench", "scene", "--size", "32", "--out", "b"]);
    let cameras = fs::read_to_string(at.join("b/cameras.json")).expect("it is text");
    let cameras: serde_json::Value = serde_json::from_str(&cameras).expect("it is JSON");
    assert_eq!(cameras["cameras"].as_array().map(Vec::len), Some(16));
    assert!(at.join("b/scene.glb").exists() && at.join("b/chaic.png").exists());
    for wrong in [["--channels", "rgb+smell"], ["--threads", "0"], ["--seconds", "never"]] {
        let out = chaic(at, &[&["bench", "render"], &wrong[..]].concat());
        assert_eq!(out.status.code(), Some(2), "{wrong:?}: {}", self::text(&out.stderr));
    }
}
