//! The command from outside: what the documentation promises works, errors are one clear line, and
//! nothing panics.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;

/// Frames of the episodes of these tests.
const FRAMES: u32 = 80;

fn chaic(dir: &Path, arguments: &[&str]) -> Output {
    let out = command(dir, arguments).output().expect("the command starts");
    let stderr = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
    out
}

fn command(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("chaic"));
    command.current_dir(dir).args(arguments).stdin(Stdio::null());
    command
}

/// A command that goes on beside the test.
fn start(dir: &Path, arguments: &[&str]) -> Child {
    let mut command = command(dir, arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text is UTF-8")
}

/// What a command that must succeed prints.
fn well(dir: &Path, arguments: &[&str]) -> String {
    let out = chaic(dir, arguments);
    assert!(out.status.success(), "{arguments:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// What a command that must fail complains of.
fn ill(dir: &Path, arguments: &[&str]) -> String {
    let out = chaic(dir, arguments);
    assert!(!out.status.success(), "{arguments:?} went well");
    text(&out.stderr) + &text(&out.stdout)
}

/// A folder with short episodes in `short/`.
fn workshop() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("there is room");
    for task in ["no_constraint", "moving_house"] {
        let generate =
            ["episodes", "generate", "--task", task, "--seeds", "0..1", "--out", "short"];
        assert_eq!(well(dir.path(), &generate), format!("short: 1 episode of {task}\n"));
    }
    for entry in fs::read_dir(dir.path().join("short")).expect("it is there") {
        let path = entry.expect("it is there").path();
        let json = fs::read_to_string(&path).expect("it is text");
        let begin = json.find("\"horizon\": ").expect("an episode has one") + 11;
        let end = begin + json[begin..].find(',').expect("more follows");
        let short = format!("{}{FRAMES}{}", &json[..begin], &json[end..]);
        fs::write(&path, short).expect("there is room");
    }
    dir
}

const EVAL: [&str; 9] =
    ["eval", "--episodes", "short", "--helper", "none,rhp", "--size", "48", "--out", "run"];

#[test]
fn a_run_from_end_to_end() {
    let dir = workshop();
    let at = dir.path();
    let printed = well(at, &EVAL);
    for word in ["TR(EI)", "RHP", "Moving house", "chaic replay run", "run/report.md"] {
        assert!(printed.contains(word), "{word}: {printed}");
    }
    for file in
        ["run.json", "results.jsonl", "scores.json", "report.md", "figure.svg", "figure.png"]
    {
        assert!(at.join("run").join(file).exists(), "{file}");
    }

    let scores = fs::read_to_string(at.join("run/scores.json")).expect("it is text");
    assert_eq!(well(at, &["report", "run", "--format", "json"]), scores);
    assert_eq!(well(at, &["report", "run", "--format", "json", "--from-traces"]), scores);
    let csv = well(at, &["report", "run", "--format", "csv", "--formulas", "original"]);
    assert_eq!(csv.lines().count(), 5, "{csv}");
    assert!(well(at, &["report", "run", "--format", "md"]).starts_with("# chaic run"));
    well(at, &["report", "run", "--figure", "f.svg"]);
    assert!(at.join("f.svg").exists());

    // Another run on the folder is refused, the same one has nothing to do.
    assert!(ill(at, &EVAL).contains("isn't empty"));
    let again = well(at, &["eval", "--resume", "--out", "run"]);
    assert!(again.contains("4 episode runs"), "{again}");
    assert_eq!(fs::read_to_string(at.join("run/scores.json")).expect("it is text"), scores);
    let other = ill(at, &["eval", "--resume", "--out", "run", "--helper", "rhp"]);
    assert!(other.contains("--helper none,rhp, not rhp"), "{other}");
    well(at, &["eval", "--resume", "--out", "run", "--helper", "rhp,none"]);
    for language in [["--endpoint", "http://localhost/v1"], ["--model", "m"]] {
        let other = ill(at, &[&["eval", "--resume", "--out", "run"], &language[..]].concat());
        assert!(other.contains("begun with no helper or partner that asks"), "{other}");
    }
    fs::create_dir(at.join("none")).expect("there is room");
    let resume = ["eval", "--resume", "--out", "run", "--episodes"];
    well(at, &[&resume[..], &["short"]].concat());
    let other = ill(at, &[&resume[..], &["none"]].concat());
    assert!(other.contains("begun with other episodes than --episodes none"), "{other}");

    assert!(well(at, &["verify", "run", "--jobs", "2"]).contains("4 traces"));
    let trace = at.join("run/traces/no_constraint/rhp/gen-0-s0.jsonl");
    let whole = fs::read_to_string(&trace).expect("it is text");
    fs::write(&trace, whole.replacen("\"turn_left\"", "\"turn_right\"", 1)).expect("there is room");
    let out = chaic(at, &["verify", "run"]);
    assert_eq!(out.status.code(), Some(1));
    let found = text(&out.stdout);
    assert!(
        found.contains("gen-0-s0.jsonl: frame 0, helper") && found.contains("partner's"),
        "{found}"
    );
    fs::write(&trace, &whole[..whole.len() - 5]).expect("there is room");
    let out = chaic(at, &["verify", "run"]);
    assert!(text(&out.stderr).contains("is cut off"), "{}", text(&out.stderr));
    let out = chaic(at, &["report", "run", "--from-traces"]);
    let missing = "1 of 4 finished episode runs have no whole trace and are left out, first \
                   no_constraint/gen/0 with rhp and seed 0";
    assert!(text(&out.stderr).contains(missing), "{}", text(&out.stderr));
    let json = well(at, &["report", "run", "--from-traces", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json["episode_runs"]["planned"], 4);
    assert_eq!(json["episode_runs"]["scored"], 3);
    fs::rename(at.join("run/traces"), at.join("run/elsewhere")).expect("it is there");
    let said = ill(at, &["report", "run", "--from-traces"]);
    assert!(said.contains("4 of 4 finished") && said.contains("no whole trace yet"), "{said}");
    fs::rename(at.join("run/elsewhere"), at.join("run/traces")).expect("it is there");
    fs::write(&trace, whole).expect("there is room");

    let replay = ["replay", "run", "no_constraint/gen/0", "--out", "r.gif", "--every", "40"];
    assert!(well(at, &replay).contains("3 pictures of no_constraint/gen/0 with rhp"));
    let unknown = ill(at, &["replay", "run", "obstacle/test/00", "--out", "r.gif"]);
    assert!(unknown.contains("no trace of obstacle/test/00") && unknown.contains("for example"));
}

#[test]
fn fidelity_from_end_to_end() {
    let dir = workshop();
    let at = dir.path();
    let begin = [
        "fidelity",
        "--episodes",
        "short",
        "--task",
        "no_constraint",
        "--first",
        "1",
        "--seeds",
        "1",
        "--helper",
        "none,rhp",
        "--size",
        "48",
        "--switch",
        "world.blocking",
        "--out",
        "fid",
        "--doc",
        "docs/f.md",
    ];
    assert!(well(at, &begin).contains("Document: docs/f.md"));
    let doc = |name: &str| fs::read_to_string(at.join(name)).expect("it is text");
    let whole = doc("docs/f.md");
    for words in
        ["## By the paper's rules", "creeps to stops", "(images/f-compat.svg)", "of the kind gen"]
    {
        assert!(whole.contains(words), "{words}: {whole}");
    }
    assert!(!whole.contains("unfinished"), "{whole}");
    assert!(at.join("docs/images/f-paper.svg").exists());

    // Every part is a run like any other; switches keep no traces, and say so.
    assert!(well(at, &["report", "fid/compat"]).contains("RHP"));
    assert!(well(at, &["verify", "fid/paper"]).contains("2 traces"));
    let switch = "fid/switch/world.blocking";
    assert!(well(at, &["report", switch, "--format", "md"]).contains("world.blocking=paper"));
    let id = "no_constraint/gen/0";
    for command in [
        &["verify", switch][..],
        &["report", switch, "--from-traces"],
        &["replay", switch, id, "--out", "r.gif"],
    ] {
        assert!(ill(at, command).contains("--no-traces"), "{command:?}");
    }

    // What a killed run leaves: a result less, and no report. The document says what is missing,
    // and going on makes the same one.
    assert!(ill(at, &begin).contains("isn't empty"));
    let letter = ["fidelity", "--resume", "--out", "fid", "--doc", "run.txt"];
    fs::write(at.join("run.txt"), "dear").expect("there is room");
    assert!(ill(at, &letter).contains("no document of this kind"));
    let journal = at.join("fid/compat/results.jsonl");
    let lines = fs::read_to_string(&journal).expect("it is text");
    let first = lines.find('\n').expect("it has lines") + 1;
    fs::write(&journal, &lines[..first]).expect("there is room");
    fs::remove_file(at.join("fid/compat/report.md")).expect("it is there");
    let said = ill(at, &["fidelity", "--only-document", "--out", "fid"]);
    assert!(said.contains("1 episode runs are missing"), "{said}");
    assert!(doc("fid/fidelity.md").contains("- `compat`: 1 of 2 are missing"));
    let report = chaic(at, &["report", "fid/compat", "--format", "csv"]);
    assert!(text(&report.stderr).contains("Unfinished: 1 of 2"), "{}", text(&report.stderr));
    fs::remove_dir_all(at.join("short")).expect("it is there");
    // Another build, by whose rules an episode comes out otherwise, doesn't mix its results in.
    let other = at.join("fid/paper/results.jsonl");
    let ours = fs::read_to_string(&other).expect("it is text");
    let at_digest = ours.rfind("\"digest\":\"").expect("it has one") + 10;
    let theirs = format!("{}{}{}", &ours[..at_digest], "0123456789abcdef", &ours[at_digest + 16..]);
    fs::write(&other, theirs).expect("there is room");
    let said = ill(at, &["fidelity", "--resume", "--out", "fid"]);
    assert!(said.contains("comes out otherwise than it did"), "{said}");
    assert!(said.contains("no_constraint/gen/0 with ") && !said.contains("--resume"), "{said}");
    assert_eq!(fs::read_to_string(&journal).expect("it is text"), lines[..first]);
    fs::write(&other, ours).expect("there is room");
    well(at, &["fidelity", "--resume", "--out", "fid", "--doc", "docs/f.md"]);
    assert_eq!(doc("docs/f.md"), whole);
}

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

/// What a wrong appearance is answered with.
const APPEARANCES: &str = "expected canonical, evening or varied:SEED";

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

#[test]
fn wrong_option_values_end_in_the_same_exit_code() {
    let dir = workshop();
    let at = dir.path();
    well(at, &["eval", "--episodes", "short", "--helper", "none", "--size", "32", "--out", "run"]);
    let replay = ["replay", "run", "no_constraint/gen/0", "--helper", "none", "--every", "40"];
    for arguments in [
        &["eval", "--task", "lunch"][..],
        &["eval", "--helper", "nobody", "--out", "r"],
        &["eval", "--size", "5", "--out", "r"],
        &["eval", "--seeds", "0", "--out", "r"],
        &["eval", "--appearance", "varied", "--out", "r"],
        &["eval", "--set", "world.gravity=1", "--out", "r"],
        &["eval", "--split", "test", "--episodes", "short", "--out", "r"],
        &["eval", "--resume", "--out", "run", "--first", "1"],
        &["eval", "--resume", "--out", "run", "--model", "m"],
        &["eval", "--model", "m", "--out", "r"],
        &["report", "run", "--figure", "f.txt"],
        &[&replay[..], &["--out", "r.avi"]].concat()[..],
        &[&replay[..], &["--out", "r.gif", "--fps", "51"]].concat()[..],
        &["episodes", "generate", "--task", "obstacle", "--seeds", "3..3", "--out", "x"],
    ] {
        let out = chaic(at, arguments);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {}", text(&out.stderr));
    }
    assert_eq!(chaic(at, &["report", "nowhere"]).status.code(), Some(1), "nothing is there");
}

#[test]
fn language_helpers_from_an_endpoint_to_a_table_row() {
    use chaic_llm_standin::{Options, StandIn};
    let dir = workshop();
    let at = dir.path();
    let standin = StandIn::start(Options::default()).expect("a port is free");
    let url = standin.url();
    let check = well(at, &["llm", "check", "--endpoint", &url, "--model", "standin"]);
    assert!(check.contains("by JSON schema: answers in") && check.contains("as text"), "{check}");
    let eval = ["eval", "--episodes", "short", "--helper", "none,llm,vlm", "--size", "48"];
    let live = [&eval[..], &["--endpoint", &url, "--model", "standin", "--out", "live"]].concat();
    let printed = well(at, &live);
    for words in ["LLM+BM", "VLM", "helper: decided by model", "helper: prompt tokens"] {
        assert!(printed.contains(words), "{words}: {printed}");
    }
    drop(standin);
    let scores = well(at, &["report", "live", "--format", "json"]);
    let again = [&eval[..], &["--llm", "replay:live", "--out", "again"]].concat();
    well(at, &again);
    assert_eq!(well(at, &["report", "again", "--format", "json"]), scores);
    assert!(well(at, &["verify", "again"]).contains("6 traces"));

    let shown = well(at, &["llm", "show", "live", "no_constraint/gen/0"]);
    for words in ["## Plans", "not a language model", ">>> frame 0: ", "decisions", "## Task"] {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    let vlm = ["llm", "show", "live", "no_constraint/gen/0", "--helper", "vlm", "--brief"];
    assert!(!well(at, &vlm).contains("## Task"));

    well(at, &["llm", "templates", "--out", "mine"]);
    assert!(at.join("mine/task.txt").exists());
    fs::write(at.join("mine/task.txt"), "{{ nonsense }}").expect("there is room");
    fs::write(at.join("mine.toml"), "[asking]\ntemplates = \"mine\"\n").expect("there is room");
    let llm = ["eval", "--episodes", "short", "--helper", "llm", "--out", "r"];
    let remote = "https://models.example.org/v1";
    let mistyped = [
        (
            &["--llm-config", "mine.toml", "--endpoint", &url, "--model", "m"][..],
            "task.txt: line 1",
        ),
        (&["--model", "m"], "give --endpoint"),
        (&["--endpoint", &url], "give --model"),
        (&["--endpoint", "https://a:sesame@b/v1", "--model", "m"], "the bare address"),
        (
            &["--endpoint", remote, "--model", "m", "--llm-config", "nokey.toml"],
            "CHAIC_TEST_NO_KEY",
        ),
        (&["--llm", "replay:nowhere"], "holds no record of a language model"),
        (&["--llm", "nowhere"], "write replay:DIR"),
        (&["--partner", "llm2", "--endpoint", &url, "--model", "m"], "rules, llm, vlm"),
        (&["--llm-config", "short"], "can't read short"),
        // Nobody answers any more.
        (
            &["--endpoint", &url, "--model", "m", "--llm-config", "quick.toml"],
            "paused: the model can't",
        ),
    ];
    fs::write(at.join("nokey.toml"), "[endpoint]\nkey_env = \"CHAIC_TEST_NO_KEY\"\n")
        .expect("there is room");
    fs::write(at.join("quick.toml"), "[faults]\nattempts = 1\n").expect("there is room");
    for (arguments, words) in mistyped {
        let said = ill(at, &[&llm[..], arguments].concat());
        assert!(said.contains(words) && !said.contains("sesame"), "{arguments:?}: {said}");
    }
    assert!(ill(at, &["eval", "--endpoint", &url, "--out", "x"]).contains("--helper llm"));
    assert!(ill(at, &["llm", "show", "live", "shopping/test/00"]).contains("no trace of"));
}

#[test]
fn errors_are_clear() {
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    for (arguments, words) in [
        (&["eval", "--task", "lunch", "--out", "r"][..], "unknown task `lunch`"),
        (&["eval", "--helper", "nobody", "--out", "r"], "unknown helper `nobody`"),
        (&["eval", "--split", "gen:5..5", "--out", "r"], "no split `gen:5..5`"),
        (&["eval", "--size", "5", "--out", "r"], "--size is 5"),
        (&["eval", "--seeds", "0", "--out", "r"], "at least 1"),
        (&["eval", "--appearance", "dusk", "--out", "r"], APPEARANCES),
        (&["render", "shopping/test/00", "--appearance", "varied:x", "--out", "r"], APPEARANCES),
        (&["eval", "--rules", "mine", "--out", "r"], "they are paper and compat"),
        (&["eval", "--set", "world.gravity=1", "--out", "r"], "world.dropped_counts"),
        (&["eval", "--episodes", "nowhere", "--out", "r"], "nowhere"),
        (&["report", "nowhere"], "no run.json"),
        (&["verify", "nowhere"], "no run.json"),
        (&["replay", "nowhere", "obstacle/test/00", "--out", "x.mp4"], "no run.json"),
        (&["render", "obstacle/test/99", "--out", "x"], "obstacle/test/99"),
        (&["episodes", "show", "nowhere.json", "--out", "x.png"], "nowhere.json"),
        (&["episodes", "generate", "--task", "obstacle", "--seeds", "3..3", "--out", "x"], "A..B"),
        (
            &["import", "original", "--dataset", "nowhere", "--tdw", "nowhere", "--out", "x"],
            "holds no tdw package",
        ),
    ] {
        let said = ill(at, arguments);
        assert!(said.contains(words), "{arguments:?}: {said}");
        assert!(said.lines().count() <= 8, "{said}");
    }
    assert_eq!(
        fs::read_dir(at)
            .expect("it is there")
            .filter(|e| {
                // A run that never began leaves at most its empty folder.
                e.as_ref().is_ok_and(|e| e.path().join("run.json").exists())
            })
            .count(),
        0
    );
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let dir = tempfile::tempdir().expect("there is room");
    let mut child = command(dir.path(), &["episodes", "schema"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let out = child.wait_with_output().expect("it ends");
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert_eq!(text(&out.stderr), "");
}

#[test]
fn a_list_without_end_ends_with_its_reader() {
    use std::io::Read as _;
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    let list = ["episodes", "list", "--task", "moving_house", "--split"];
    for (format, begin) in [("table", "┌"), ("json", "[\n  {\n")] {
        // So many take years.
        let endless = [&list[..], &["gen:0..100000000000", "--format", format]].concat();
        let mut child = start(at, &endless);
        let mut out = child.stdout.take().expect("it is piped");
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let mut read = vec![0; begin.len()];
            let _ = sender.send(out.read_exact(&mut read).map(|()| read));
        });
        let read = receiver.recv_timeout(std::time::Duration::from_secs(120));
        if read.is_err() {
            child.kill().expect("it runs");
        }
        let read = read.expect("it prints while it goes").expect("it prints");
        assert_eq!(text(&read), begin);
        let ended = child.wait_with_output().expect("it ends");
        assert!(ended.status.success(), "{}", text(&ended.stderr));
        assert_eq!(text(&ended.stderr), "");
    }
    // More than one table, and still one JSON.
    let some = [&list[..], &["gen:0..97", "--format"]].concat();
    let tables = well(at, &[&some[..], &["table"]].concat());
    assert_eq!(tables.matches("Episode").count(), 2, "{tables}");
    assert_eq!(tables.matches("moving_house/gen/").count(), 97, "{tables}");
    let json = well(at, &[&some[..], &["json"]].concat());
    let json: Vec<serde_json::Value> = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json.len(), 97);
    assert_eq!(json[96]["id"], "moving_house/gen/96");
}

/// Waits until something is under way below `path`.
#[cfg(unix)]
fn until_under_way(path: &Path) {
    use std::time::{Duration, Instant};
    let began = Instant::now();
    let is_under_way = || files(path).iter().any(|p| p.ends_with(".partial"));
    while !is_under_way() {
        assert!(began.elapsed() < Duration::from_secs(60), "nothing begins");
        std::thread::yield_now();
    }
}

#[cfg(unix)]
fn files(folder: &Path) -> Vec<String> {
    let entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    entries
        .into_iter()
        .flat_map(|p| if p.is_dir() { files(&p) } else { vec![p.display().to_string()] })
        .collect()
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on() {
    let dir = workshop();
    let at = dir.path();
    // Longer than the moment between beginning and signal.
    let long = ["eval", "--task", "no_constraint", "--first", "1", "--helper", "none,rhp"];
    for (signal, code) in [("-INT", Some(130)), ("-KILL", None)] {
        let out = format!("run{signal}");
        let mut arguments = long.to_vec();
        arguments.extend(["--jobs", "1", "--out", &out]);
        let child = start(at, &arguments);
        until_under_way(&at.join(&out).join("traces"));
        // While it runs, nobody else may.
        let second = ill(at, &["eval", "--resume", "--out", &out]);
        assert!(second.contains("in use by another"), "{second}");
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("there is a kill");
        assert!(sent.success());
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), code);
        if code.is_some() {
            let said = text(&ended.stderr);
            assert!(said.contains(&format!("chaic eval --resume --out {out}")), "{said}");
        }
        assert!(ill(at, &["report", &out]).contains("no finished episode"));
    }
}

#[cfg(unix)]
#[test]
fn interrupted_generation_leaves_whole_episodes_and_says_how_to_go_on() {
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    let generate =
        ["episodes", "generate", "--task", "shopping", "--seeds", "0..1000000", "--out", "g"];
    let child = start(at, &generate);
    let began = std::time::Instant::now();
    while !files(&at.join("g")).iter().any(|name| name.ends_with(".json")) {
        assert!(began.elapsed().as_secs() < 60, "nothing begins");
        std::thread::yield_now();
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("there is a kill").success());
    let ended = child.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(130));
    let made = files(&at.join("g"));
    let said = text(&ended.stderr);
    assert!(said.contains(&format!("--seeds {}..1000000 makes the rest", made.len())), "{said}");
    let validate: Vec<&str> =
        ["episodes", "validate"].into_iter().chain(made.iter().map(String::as_str)).collect();
    well(at, &validate);
}

#[cfg(unix)]
#[test]
fn an_interrupted_replay_leaves_no_torn_video() {
    let dir = workshop();
    let at = dir.path();
    well(at, &["eval", "--episodes", "short", "--helper", "none", "--size", "48", "--out", "run"]);
    for (signal, code) in [("-INT", Some(130)), ("-KILL", None)] {
        let out = format!("video{signal}/r.gif");
        fs::create_dir(at.join(format!("video{signal}"))).expect("there is room");
        fs::write(at.join(&out), "an older one").expect("there is room");
        let replay = ["replay", "run", "no_constraint/gen/0", "--every", "1", "--out", &out];
        let child = start(at, &replay);
        until_under_way(&at.join(format!("video{signal}")));
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("there is a kill");
        assert!(sent.success());
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), code);
        let said = text(&ended.stderr);
        assert_eq!(said.contains("r.gif is not written"), code.is_some(), "{said}");
        assert_eq!(fs::read(at.join(&out)).expect("it is there"), b"an older one");
        // What Ctrl-C leaves is what was there.
        let left = files(&at.join(format!("video{signal}")));
        assert_eq!(left.len(), if code.is_some() { 1 } else { 2 }, "{left:?}");
    }
}
