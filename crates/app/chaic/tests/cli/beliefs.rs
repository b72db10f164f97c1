//! Promise: beliefs in traces are explained in sentences and records, drawn in replays, and scored;
//! losses are split by cause.

use std::fs;
use std::path::Path;

use crate::*;

const ID: &str = "no_constraint/gen/0";

fn json(at: &Path, arguments: &[&str]) -> serde_json::Value {
    let text = run_ok(at, &[arguments, &["--format", "json"]].concat());
    serde_json::from_str(&text).expect("it is JSON")
}

#[test]
fn beliefs_are_explained_drawn_and_scored() {
    let dir = short_episodes();
    let at = dir.path();
    let eval = ["eval", "--episodes", "short", "--helper", "infer,rhp", "--size", "64"];
    run_ok(at, &[&eval[..], &["--out", "run"]].concat());

    let text = run_ok(at, &["explain", "run", ID]);
    assert!(text.starts_with("no_constraint/gen/0 with infer, seed 0\nframe     0  "), "{text}");
    for words in ["It knows nothing: fruit 25 %", "ends at frame 80 with", "Deliveries: partner 0"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(text.contains("Goal:       believed ") && text.contains("Person:     "), "{text}");
    let records = json(at, &["explain", "run", ID, "--seed", "0"]);
    assert_eq!((&records["helper"], &records["records_belief"]), (&"infer".into(), &true.into()));
    assert_eq!(records["timeline"][0]["kind"], "first_belief");
    assert_eq!(records["timeline"][0]["goals"].as_array().map(Vec::len), Some(4));
    let rules = run_ok(at, &["explain", "run", ID, "--helper", "rhp"]);
    assert!(rules.contains("records no belief") && rules.contains("It plans: "), "{rules}");

    let replay = ["replay", "run", ID, "--helper", "infer", "--every", "40", "--out", "r.gif"];
    assert!(run_ok(at, &replay).contains("3 images"));

    // The yard has no score, because furniture is its only target set.
    let scores = json(at, &["report", "run", "--belief"]);
    let tasks = scores["helpers"]["infer"]["tasks"].as_object().expect("scores by task");
    assert_eq!(tasks.keys().collect::<Vec<_>>(), ["no_constraint"]);
    assert_eq!(scores["helpers"].as_object().map(serde_json::Map::len), Some(1), "{scores}");
    let csv = run_ok(at, &["report", "run", "--belief", "--format", "csv"]);
    assert!(csv.starts_with("helper,task,runs,true_set_200,"), "{csv}");
    assert_eq!(csv.lines().count(), 3, "{csv}");
    for (format, words) in [("text", "expected calibration"), ("md", "| Helper | Task | runs |")] {
        let report = run_ok(at, &["report", "run", "--belief", "--format", format]);
        assert!(report.contains(words), "{report}");
    }
    // A trace that the run does not play, such as one of earlier options.
    let trace = at.join("run/traces/no_constraint/infer/gen-0-s0.jsonl");
    fs::copy(&trace, trace.with_file_name("gen-0-s7.jsonl")).expect("the disk has space");
    let out = output_of(at, &["report", "run", "--belief", "--format", "csv"]);
    assert_eq!(crate::text(&out.stdout), csv);
    let warnings = crate::text(&out.stderr);
    assert!(warnings.contains("gen-0-s7.jsonl: this run doesn't play"), "{warnings}");
}

#[test]
fn losses_are_reported_with_another_partner_too() {
    let dir = short_episodes();
    let at = dir.path();
    let helpers = "none,rhp,infer,infer_known_goal,oracle_plan";
    let eval = ["eval", "--episodes", "short", "--helper", helpers, "--size", "32", "--out", "run"];
    run_ok(at, &[&eval[..], &["--partner", "farthest"]].concat());
    let recorded = fs::read_to_string(at.join("run/run.json")).expect("a text file");
    assert!(recorded.contains("\"farthest\""), "{recorded}");
    run_ok(at, &["verify", "run"]);
    let losses = json(at, &["report", "run", "--losses"]);
    let helpers = losses["helpers"].as_array().expect("a list");
    let causes = |k: usize| -> Vec<&str> {
        let listed = helpers[k]["losses"].as_array().expect("a list").iter();
        listed.map(|loss| loss["cause"].as_str().expect("a name")).collect()
    };
    assert_eq!(causes(0), ["total", "search", "inference", "planning"]);
    assert_eq!(causes(2), ["total", "search"]);
}

#[test]
fn errors_of_explanations_and_belief_reports_are_clear() {
    let dir = short_episodes();
    let at = dir.path();
    let eval = ["eval", "--episodes", "short", "--task", "no_constraint", "--size", "32"];
    run_ok(at, &[&eval[..], &["--helper", "none", "--out", "run"]].concat());
    run_ok(at, &[&eval[..], &["--helper", "none", "--no-traces", "--out", "untraced"]].concat());
    for (arguments, words) in [
        (&["explain", "nowhere", ID][..], "no run.json"),
        (&["explain", "run", "obstacle/test/00"], "no trace of obstacle/test/00"),
        (
            &["explain", "run", ID, "--helper", "infer"],
            "no trace of no_constraint/gen/0 with helper",
        ),
        (&["explain", "run", ID, "--seed", "3"], "and seed 3"),
        (&["explain", "untraced", ID], "--no-traces"),
        (&["report", "nowhere", "--belief"], "no run.json"),
        (&["report", "untraced", "--belief"], "--no-traces"),
        (&["report", "run", "--belief"], "no whole trace with a belief"),
        (&["report", "run", "--belief", "--from-traces"], "cannot be used with"),
        (&["report", "run", "--losses"], "losses need the helpers oracle_plan in the same run"),
        (&["report", "run", "--losses", "--belief"], "cannot be used with"),
    ] {
        let message = run_err(at, arguments);
        assert!(message.contains(words), "{arguments:?}: {message}");
        assert!(message.lines().count() <= 8, "{message}");
    }

    let path = at.join("run/traces/no_constraint/none/gen-0-s0.jsonl");
    let trace = fs::read_to_string(&path).expect("a text file");
    fs::write(&path, trace.replacen("\"turn_left\"", "\"turn_right\"", 1))
        .expect("the disk has space");
    let message = run_err(at, &["explain", "run", ID]);
    assert!(message.contains("the trace was altered, so it is not explained"), "{message}");
    // A damaged trace is explained up to its last whole record.
    let lines: Vec<&str> = trace.lines().collect();
    let half = format!("{}\n[40,0,", lines[..lines.len() / 2].join("\n"));
    fs::write(&path, half).expect("the disk has space");
    let out = output_of(at, &["explain", "run", ID]);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    assert!(text(&out.stdout).contains("The trace is cut off after frame"));
}
