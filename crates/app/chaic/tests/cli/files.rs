//! Files that commands take and leave: no dead ends, no torn files, no waiting, clear refusals.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::*;

const PLAY: [&str; 6] = ["eval", "--helper", "none", "--size", "32", "--episodes"];

#[test]
fn a_run_that_was_stopped_before_it_began_is_no_dead_end() {
    let dir = workshop();
    let at = dir.path();
    let begin = [&PLAY[..], &["short", "--out", "run"]].concat();
    // What is left by a kill while episodes are copied.
    fs::create_dir_all(at.join("run/episodes")).expect("there is room");
    for name in [".lock", "episodes/moving_house-gen-0.json.tmp"] {
        fs::write(at.join("run").join(name), "").expect("there is room");
    }
    let out = chaic(at, &["eval", "--resume", "--out", "run"]);
    let said = text(&out.stderr);
    assert!(said.contains("give its command again without --resume"), "{said}");
    assert_eq!(out.status.code(), Some(1));
    well(at, &begin);
    assert_eq!(fs::read_dir(at.join("run/episodes")).expect("it is there").count(), 2);

    // A mistake of the user leaves nothing that blocks.
    fs::copy(at.join("short/no_constraint-0.json"), at.join("short/twin.json"))
        .expect("there is room");
    let begin = [&PLAY[..], &["short", "--out", "second"]].concat();
    let out = chaic(at, &begin);
    assert!(text(&out.stderr).contains("two episodes that are named like no_constraint/gen/0"));
    assert_eq!(out.status.code(), Some(2));
    assert!(!at.join("second").exists());
    fs::remove_file(at.join("short/twin.json")).expect("it is there");
    well(at, &begin);
}

#[test]
fn an_altered_run_is_found_out() {
    let dir = workshop();
    let at = dir.path();
    let out = "my run";
    let printed = well(at, &[&PLAY[..], &["short", "--out", out]].concat());
    assert!(printed.contains("chaic verify 'my run'\n"), "{printed}");
    let good = well(at, &["verify", out]);
    for words in ["2 of 2 episode runs are finished", "2 traces", "what the results give"] {
        assert!(good.contains(words), "{words}: {good}");
    }
    let change = |name: &str, from: &str, to: &str| {
        let path = at.join(out).join(name);
        let text = fs::read_to_string(&path).expect("it is text");
        assert!(text.contains(from), "{from} is in {name}");
        fs::write(&path, text.replacen(from, to, 1)).expect("there is room");
        (path, text)
    };
    fs::write(at.join("r.gif"), "an older one").expect("there is room");
    let replay = ["replay", out, "no_constraint/gen/0", "--every", "40", "--out", "r.gif"];
    for (from, to) in [
        ("\"turn_left\"", "\"turn_right\""),
        ("\"helper\":\"none\"", "\"helper\":\"rhp\""),
        ("\"complete\":false", "\"complete\":true"),
        ("\"world_seed\":", "\"world_seed\":1"),
    ] {
        let (path, text) = change("traces/no_constraint/none/gen-0-s0.jsonl", from, to);
        let out = chaic(at, &replay);
        let said = self::text(&out.stderr);
        assert!(said.contains("the trace was altered, so no video is made"), "{from}: {said}");
        assert_eq!(out.status.code(), Some(1), "{from}");
        assert_eq!(fs::read(at.join("r.gif")).expect("it is there"), b"an older one");
        assert!(!at.join("r.gif.partial").exists());
        fs::write(path, text).expect("there is room");
    }
    well(at, &replay);
    for (name, from, to, words) in [
        ("scores.json", "0.", "1.", "ALTERED scores.json"),
        ("report.md", "# chaic", "# Chaic", "ALTERED report.md"),
        ("results.jsonl", "\"status\":\"done\"", "\"x_status\":\"done\"", "line 1: missing field"),
        ("results.jsonl", "\"total\"", "\"sum\":0,\"total\"", "unknown field `sum`"),
        ("run.json", "\"rules\": \"paper\"", "\"rules\": \"compat\"", "was changed after the run"),
    ] {
        let (path, text) = change(name, from, to);
        let said = ill(at, &["verify", out]);
        assert!(said.contains(words), "{name}: {said}");
        fs::write(path, text).expect("there is room");
    }
    let journal = at.join(out).join("results.jsonl");
    let lines = fs::read_to_string(&journal).expect("it is text");
    fs::write(&journal, &lines[..=lines.find('\n').expect("it has lines")]).expect("there is room");
    let said = ill(at, &["verify", out]);
    assert!(said.contains("1 of 2 episode runs are finished; missing: 1, first "), "{said}");
}

#[test]
fn an_episode_has_bounds() {
    let dir = workshop();
    let at = dir.path();
    let file = at.join("short/no_constraint-0.json");
    let text = fs::read_to_string(&file).expect("it is text");
    let mut episode: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    for field in ["rooms", "openings", "floors"] {
        let mut long = episode.clone();
        let entries = long["setup"][field].as_array_mut().expect("it is a list");
        *entries = vec![entries[0].clone(); 2000];
        fs::write(at.join("long.json"), long.to_string()).expect("there is room");
        let said = ill(at, &["episodes", "validate", "long.json"]);
        assert!(said.contains(&format!("setup.{field}: has 2000 entries, at most")), "{said}");
    }
    episode["version"] = 7.into();
    fs::write(at.join("old.json"), episode.to_string()).expect("there is room");
    let said = ill(at, &["episodes", "validate", "old.json"]);
    assert!(said.contains("version: is 7, this program reads version 1"), "{said}");
}

#[cfg(unix)]
#[test]
fn nobody_waits_for_what_is_no_file() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir(at.join("odd")).expect("there is room");
    fs::create_dir(at.join("folder.json")).expect("there is room");
    let made = Command::new("mkfifo").arg(at.join("odd/pipe.json")).status();
    assert!(made.expect("there is a mkfifo").success());
    let pipe = "odd/pipe.json: it is no regular file";
    for (arguments, words) in [
        (&["episodes", "validate", "odd/pipe.json"][..], pipe),
        (&["episodes", "show", "odd/pipe.json", "--out", "x.png"], pipe),
        (&[&PLAY[..], &["odd", "--out", "run"]].concat(), pipe),
        (&["episodes", "validate", "folder.json"], "folder.json: it is a folder"),
        (&["scene", "export", "folder.json", "--out", "x.glb"], "folder.json: it is a folder"),
    ] {
        let said = ill(at, arguments);
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
    assert!(!at.join("run").exists());
}

/// Runs a command behind limits of the shell.
#[cfg(target_os = "linux")]
fn limited(at: &Path, limits: &str, arguments: &[&str]) -> std::process::Output {
    let script = format!("{limits}; exec \"$0\" \"$@\"");
    let mut shell = Command::new("sh");
    shell.current_dir(at).args(["-c", &script]).arg(cargo_bin!("chaic")).args(arguments);
    let out = shell.stdin(Stdio::null()).output().expect("there is a shell");
    // The standard library panics in a new thread, before its work begins, where its stack just fits and the one
    // for its signals doesn't.
    let said = text(&out.stderr);
    let is_ours = said.contains("panicked") && !said.contains("alternative stack");
    assert!(!is_ours, "{arguments:?}: {said}");
    out
}

#[cfg(target_os = "linux")]
#[test]
fn what_has_no_room_leaves_no_torn_file_and_names_its_path() {
    let dir = workshop();
    let at = dir.path();
    well(at, &[&PLAY[..], &["short", "--out", "run"]].concat());
    // Files of at most 8 blocks of 512 bytes: an error of the write, as of a full disk.
    let small = "trap '' XFSZ; ulimit -f 8";
    let file = "short/no_constraint-0.json";
    for (arguments, left) in [
        (&["report", "run", "--figure", "f.png"][..], "f.png"),
        (&["scene", "export", file, "--out", "s.glb"], "s.glb"),
        (&["episodes", "show", file, "--out", "p.png"], "p.png"),
        (&["render", file, "--size", "256", "--out", "r"], "r/rgb.png"),
        (&["replay", "run", "no_constraint/gen/0", "--out", "v.gif"], "v.gif"),
    ] {
        if !left.contains('/') {
            fs::write(at.join(left), "an older one").expect("there is room");
        }
        let out = limited(at, small, arguments);
        let said = text(&out.stderr);
        assert!(said.contains(left) && said.contains("File too large"), "{arguments:?}: {said}");
        assert_eq!(out.status.code(), Some(1), "{arguments:?}");
        let kept = fs::read(at.join(left)).unwrap_or(b"an older one".to_vec());
        assert_eq!(kept, b"an older one", "{arguments:?}");
        for suffix in [".tmp", ".partial"] {
            assert!(!at.join(format!("{left}{suffix}")).exists(), "{left}{suffix}");
        }
    }
    let out = limited(at, "exec >/dev/full", &["report", "run"]);
    let said = text(&out.stderr);
    assert!(said.contains("can't write to the standard output: No space left"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_job_without_a_thread_is_a_message() {
    let dir = workshop();
    let at = dir.path();
    // Address space for some threads, each with its stack, and not for so many.
    let limit = "ulimit -v 1200000";
    let out = limited(at, limit, &["verify", "--help"]);
    assert!(out.status.success(), "the limit leaves room for the program itself");
    let eval = [&PLAY[..], &["short", "--seeds", "600", "--jobs", "1000", "--out", "run"]].concat();
    let out = limited(at, limit, &eval);
    let said = text(&out.stderr);
    assert!(!out.status.success() && said.contains("thread"), "{said}");
    assert!(out.status.code().is_some(), "no signal ends it: {said}");
}

#[test]
fn exit_codes_are_those_of_the_table() {
    let dir = workshop();
    let at = dir.path();
    let usage = ["eval", "--out", "run"];
    for (arguments, code, words) in [
        (&["episodes", "schema"][..], 0, ""),
        (&["report", "nowhere"], 1, "no run.json"),
        (&["eval", "--resume", "--out", "nowhere"], 1, "no run.json"),
        (&["episodes", "validate", "nowhere.json"], 1, "can't open nowhere.json"),
        (&["render", "obstacle/test/99", "--out", "x"], 2, "obstacle/test/99"),
        (&[&usage[..], &["--helper", "nobody"]].concat(), 2, "follow, llm, llm-told, vlm"),
        (&[&usage[..], &["--partner", "nobody"]].concat(), 2, "the partners are rules, llm, vlm"),
        (&[&usage[..], &["--seeds", "0"]].concat(), 2, "0 is not in 1..="),
        (&["eval", "--nonsense"], 2, "--nonsense"),
    ] {
        let out = chaic(at, arguments);
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
    assert!(!at.join("run").exists());
}
