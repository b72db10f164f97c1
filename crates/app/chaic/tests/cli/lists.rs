//! Promises on the short report, `chaic show`, `chaic list` and `chaic doctor`: they fit a terminal, and have JSON.

use serde_json::Value;

use crate::*;

fn json(dir: &Path, arguments: &[&str]) -> Value {
    let text = run_ok(dir, &[arguments, &["--format", "json"]].concat());
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {text}"))
}

#[test]
fn the_short_report_fits_a_terminal() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    for task in [
        "no_constraint",
        "high_target",
        "high_container",
        "high_goal",
        "low_target",
        "obstacle",
        "shopping",
        "moving_house",
        "one_handed",
        "tremor",
    ] {
        let generate =
            ["episodes", "generate", "--task", task, "--seeds", "0..3", "--out", "short"];
        run_ok(at, &generate);
    }
    shorten(&at.join("short"));
    let helpers = "none,random,rhp,oracle,follow";
    let eval = ["eval", "--episodes", "short", "--helper", helpers, "--size", "16"];
    let text = run_ok(at, &[&eval[..], &["--no-traces", "--out", "run"]].concat());
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.len() <= 40, "{} lines: {text}", lines.len());
    assert!(lines.iter().all(|line| line.chars().count() <= 100), "{text}");
    for title in ["w/o", "Random", "RHP", "Oracle", "Follow"] {
        assert!(lines.iter().any(|line| line.starts_with(title)), "{title}: {text}");
    }
    assert_eq!(lines.iter().filter(|line| line.starts_with("Granted: ")).count(), 4, "{text}");
    for path in ["Report:  run/report.md", "Run:     run"] {
        assert!(lines.contains(&path), "{path}: {text}");
    }
    let report = fs::read_to_string(at.join("run/report.md")).expect("a text file");
    assert!(report.contains("TR(EI)") && report.lines().count() > 40, "{report}");

    let shown = run_ok(at, &["show", "run"]);
    assert!(shown.contains("Helpers:    none, random"), "{shown}");
    assert!(shown.contains("150 of 150 episode runs") && shown.contains("Follow"), "{shown}");
    let shown = json(at, &["show", "run"]);
    assert_eq!(shown["episode_runs"]["finished"], 150);
    let scores: Value = serde_json::from_str(&run_ok(at, &["report", "run", "--format", "json"]))
        .expect("it is JSON");
    assert_eq!(shown["scores"], scores);
    let listed = json(at, &["list", "runs", "."]);
    assert_eq!(listed[0]["finished"], 150);
    assert!(run_ok(at, &["list", "runs", "."]).contains("150 of 150"));
    assert!(run_ok(at, &["list", "runs"]).contains("no runs in runs"));
    let merged = json(at, &["merge", "--out", "merged", "run"]);
    assert_eq!(merged["scores"], scores);
}

#[test]
fn lists_name_everything_that_options_take() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let names = |kind: &str| -> Vec<String> {
        let listed = json(at, &["list", kind]);
        let rows = listed.as_array().expect("a list").iter();
        rows.map(|row| row["name"].as_str().expect("a name").to_owned()).collect()
    };
    let helpers = names("helpers");
    assert_eq!(helpers.len(), 21, "{helpers:?}");
    for helper in &helpers {
        let refused = run_err(at, &["eval", "--helper", helper, "--first", "0", "--out", "r"]);
        assert!(!refused.contains("unknown helper"), "{refused}");
    }
    let partners = names("partners");
    assert_eq!(partners.len(), 11, "{partners:?}");
    for partner in &partners {
        let refused = run_err(at, &["eval", "--partner", partner, "--first", "0", "--out", "r"]);
        assert!(!refused.contains("unknown partner"), "{refused}");
    }
    assert_eq!(names("tasks").len(), 12);
    assert!(names("rules").contains(&"world.failed_put_on_can_deliver".to_owned()));
    let people = json(at, &["list", "people"]);
    assert_eq!(people["people"].as_array().map(Vec::len), Some(6));
    assert_eq!(people["impairments"].as_array().map(Vec::len), Some(4));
    for kind in ["helpers", "tasks", "people", "partners", "rules"] {
        let text = run_ok(at, &["list", kind]);
        assert!(text.starts_with('┌'), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    }
    for wrong in [&["list", "tasks", "--format", "csv"][..], &["list", "colors"]] {
        assert_eq!(output_of(at, wrong).status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn results_of_commands_are_json_on_request() {
    let dir = short_episodes();
    let at = dir.path();
    let eval = ["eval", "--episodes", "short", "--helper", "none", "--size", "32", "--out", "run"];
    let played = json(at, &eval);
    assert_eq!(played["run"], "run");
    assert!(played["scores"]["tasks"]["no_constraint"]["none"]["tr"].is_f64(), "{played}");
    assert_eq!(json(at, &["verify", "run"])["passed"], true);
    let replay = ["replay", "run", "no_constraint/gen/0", "--out", "r.gif", "--every", "40"];
    assert_eq!(json(at, &replay)["images"], 3);
    let files = ["episodes", "validate", "short/no_constraint-0.json"];
    assert_eq!(json(at, &files)["checked"], 1);
    let scene = ["scene", "export", "shopping/test/00", "--out", "s.glb", "--detail", "0"];
    assert_eq!(json(at, &scene)["episode"], "shopping/test/00");
    let render = ["render", "short/no_constraint-0.json", "--size", "32", "--out", "p"];
    assert_eq!(json(at, &render)["agent"], "helper");
    assert_eq!(
        run_err(at, &["llm", "templates", "--out", "t", "--format", "md"]).lines().count(),
        1
    );
    // The option may also stand before the command.
    let tasks = run_ok(at, &["--format", "json", "list", "tasks"]);
    assert!(tasks.starts_with("[\n"), "{tasks}");
}

#[test]
fn doctor_describes_this_machine() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let text = run_ok(dir.path(), &["doctor"]);
    for check in ["processor", "vector instructions", "sandbox", "detector weights", "folder"] {
        assert!(text.contains(check), "{check}: {text}");
    }
    let found = json(dir.path(), &["doctor"]);
    assert_eq!(found["passed"], true);
    assert!(found["machine"]["cores"].as_u64() > Some(0), "{found}");
}
