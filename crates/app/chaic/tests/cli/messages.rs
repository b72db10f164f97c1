//! Promises on messages: paths of any name are printed, errors say what there is instead, and counts are in correct
//! English.

use serde_json::Value;

use crate::*;

const PLAY: [&str; 7] = ["eval", "--episodes", "short", "--helper", "none", "--size", "32"];

fn json(dir: &Path, arguments: &[&str]) -> Value {
    let text = run_ok(dir, &[arguments, &["--format", "json"]].concat());
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {text}"))
}

#[cfg(target_os = "linux")]
#[test]
fn paths_that_are_not_utf8_are_printed() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    let dir = short_episodes();
    let at = dir.path();
    let output = |arguments: &[&str], path: &[u8], more: &[&str]| {
        let mut started = command(at, arguments);
        let out = started.arg(OsStr::from_bytes(path)).args(more).output();
        let out = out.expect("the command starts");
        assert!(!text(&out.stderr).contains("panicked"), "{arguments:?}: {}", text(&out.stderr));
        out
    };
    let json = |arguments: &[&str], path: &[u8], code: i32| -> Value {
        let out = output(arguments, path, &["--format", "json"]);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {}", text(&out.stderr));
        serde_json::from_slice(&out.stdout).expect("it is JSON")
    };
    let run = b"r\xff";
    let played = json(&[&PLAY[..], &["--out"]].concat(), run, 0);
    assert_eq!(played["run"], "r\u{fffd}");
    assert_eq!(played["page"], "r\u{fffd}/report.html");
    assert_eq!(json(&["show"], run, 0)["run"], "r\u{fffd}");
    assert_eq!(json(&["verify"], run, 0)["passed"], true);
    assert_eq!(json(&["view"], run, 0)["out"], "r\u{fffd}/view.html");
    for (arguments, path) in [
        (&["render", "short/no_constraint-0.json", "--size", "32", "--out"][..], &b"f\xff"[..]),
        (&["episodes", "show", "short/no_constraint-0.json", "--out"], b"s\xff.png"),
        (&["episodes", "generate", "--task", "shopping", "--seeds", "0..1", "--out"], b"e\xff"),
        (&["export", "episodes", "--split", "gen:0..1", "--task", "shopping", "--out"], b"d\xff"),
        (&["play", "shopping/test/00", "--out"], b"p\xff.html"),
        (&["llm", "templates", "--out"], b"t\xff"),
    ] {
        let printed = json(arguments, path, 0);
        let out = printed["out"].as_str().expect("a path");
        assert!(out.contains('\u{fffd}'), "{arguments:?}: {printed}");
    }
    // A difference is reported, whatever the name of the folder.
    let trace = at.join(OsStr::from_bytes(run)).join("traces/no_constraint/none/gen-0-s0.jsonl");
    fs::remove_file(trace).expect("it exists");
    let found = json(&["verify"], run, 1);
    let path = found["mismatches"][0]["path"].as_str().expect("a path");
    assert!(path.starts_with("r\u{fffd}/traces/"), "{found}");
    // The sandbox hides the folder of the run by its name.
    let external = ["eval", "--episodes", "short", "--helper", "exec:true", "--out"];
    let out = output(&external, b"x\xff", &[]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("is not UTF-8"), "{}", text(&out.stderr));
}

#[test]
fn paths_are_quoted_in_text_and_plain_in_json() {
    let dir = short_episodes();
    let at = dir.path();
    let played = json(at, &[&PLAY[..], &["--out", "my rün"]].concat());
    assert_eq!((&played["run"], &played["page"]), (&"my rün".into(), &"my rün/report.html".into()));
    assert_eq!(played["verify"], "chaic verify 'my rün'", "a command is for a shell");
    let again = run_ok(at, &["eval", "--resume", "--out", "my rün"]);
    assert!(again.contains("Page:    'my rün/report.html'\n"), "{again}");
}

#[test]
fn closing_hints_name_episodes_that_have_a_trace() {
    let dir = short_episodes();
    let at = dir.path();
    let broken = ["--helper", "broken=exec:exit 1"];
    let out = output_of(at, &[&PLAY[..], &broken, &["--out", "both"]].concat());
    let printed = text(&out.stdout);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    assert!(printed.contains(" --helper none --out replay.mp4"), "{printed}");
    let play = ["eval", "--episodes", "short", "--task", "no_constraint", "--out", "failed"];
    let out = output_of(at, &[&play[..], &broken].concat());
    let printed = text(&out.stdout);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    for label in ["Replay:", "View:", "Verify:"] {
        assert!(!printed.contains(label), "{label}: {printed}");
    }
    assert!(printed.contains("* 1 episode run failed and counts as zero"), "{printed}");
}

#[test]
fn runs_without_a_folder_that_start_together_have_their_own() {
    let dir = short_episodes();
    let at = dir.path();
    let running: Vec<Child> = (0..3).map(|_| start(at, &PLAY)).collect();
    for child in running {
        let out = child.wait_with_output().expect("it ends");
        assert!(out.status.success(), "{}", text(&out.stderr));
    }
    for run in ["eval", "eval-2", "eval-3"] {
        run_ok(at, &["verify", &format!("runs/{run}")]);
    }
}

#[test]
fn counts_of_one_are_singular() {
    let dir = short_episodes();
    let at = dir.path();
    let first = ["--task", "no_constraint", "--first", "1", "--out", "one"];
    run_ok(at, &[&PLAY[..], &first].concat());
    let shown = run_ok(at, &["show", "one"]);
    assert!(shown.contains("the first episode of each task"), "{shown}");
    assert!(shown.contains("1 of 1 episode run, failed: 0"), "{shown}");
    let report = fs::read_to_string(at.join("one/report.md")).expect("a text file");
    assert!(report.contains("first episode of each task"), "{report}");
    assert!(report.contains("\n1 episode run.\n"), "{report}");
    let unknown = run_err(at, &["replay", "one", "obstacle/test/00", "--out", "r.gif"]);
    assert!(unknown.contains("it has one trace, traces/no_constraint/none/gen-0"), "{unknown}");
    run_ok(at, &[&PLAY[..], &["--out", "two"]].concat());
    let out = output_of(at, &["view", "two", "--max", "1"]);
    assert!(text(&out.stderr).contains("1 more replay is left out"), "{}", text(&out.stderr));
}

#[test]
fn progress_names_the_seed_if_there_are_several() {
    let dir = short_episodes();
    let at = dir.path();
    let play = [&PLAY[..], &["--task", "no_constraint", "--out"]].concat();
    let out = output_of(at, &[&play[..], &["several", "--seeds", "2"]].concat());
    for line in
        ["no_constraint/gen/0 with none, seed 0: ", "no_constraint/gen/0 with none, seed 1: "]
    {
        assert!(text(&out.stderr).contains(line), "{line}: {}", text(&out.stderr));
    }
    let out = output_of(at, &[&play[..], &["one"]].concat());
    assert!(text(&out.stderr).contains("no_constraint/gen/0 with none: "), "{out:?}");
}

#[test]
fn errors_say_what_there_is_instead() {
    let dir = short_episodes();
    let at = dir.path();
    run_ok(at, &[&PLAY[..], &["--out", "run"]].concat());
    let export = ["export", "lerobot", "run", "--out", "set"];
    let partner = [&export[..], &["--agent", "partner"]].concat();
    let rhp = [&partner[..], &["--helper", "rhp"]].concat();
    let obstacle = [&partner[..], &["--task", "obstacle"]].concat();
    let has = "its traces have helpers: none; tasks: moving_house, no_constraint; agents: partner";
    for (arguments, code, words) in [
        (&["list", "runs", "nowhere"][..], 1, &["can't list nowhere"][..]),
        (
            &[&export[..], &["--agent", "child"]].concat(),
            1,
            &["no trace of the agent child; ", has],
        ),
        (&rhp, 1, &["no trace of the agent partner with helper rhp; ", has]),
        (&obstacle, 1, &["no trace of the agent partner in obstacle; ", has]),
        (&["report", "run", "--format", "xml"], 2, &["text, json, md, csv"]),
        (&["report", "run", "--belief"], 1, &["moving_house, which has a single target set"]),
        (&["llm", "check", "--llm", "replay:run"], 2, &["unexpected argument '--llm'"]),
    ] {
        let out = output_of(at, arguments);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {message}");
        for word in words {
            assert!(message.contains(word), "{arguments:?}: {word}: {message}");
        }
    }
    assert!(!at.join("set").exists());
}

#[test]
fn a_test_question_names_the_address_that_fails() {
    use chaic_llm_standin::{Options, StandIn};
    let dir = tempfile::tempdir().expect("the disk has space");
    let gone = StandIn::start(Options::default()).expect("a port is free");
    let url = gone.url();
    drop(gone);
    let check = ["llm", "check", "--endpoint", &url, "--model", "m"];
    let message = run_err(dir.path(), &check);
    assert!(message.contains(&format!("error: {url}: the connection failed")), "{message}");
}
