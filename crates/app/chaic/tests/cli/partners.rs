//! Promise: a run with several partners resumes, verifies, merges and reports like any run, and wrong
//! lists of partners are refused with one line before anything is written.

use std::fs;
use std::path::Path;

use crate::*;

const LIST: &str = r#"{
  "format": "chaic-partners",
  "version": 1,
  "partners": [
    { "name": "hasty", "person": "+speed150" },
    { "name": "drawn", "partner": "drawn:7", "person": "+tires" }
  ]
}"#;
const PLAY: [&str; 12] = [
    "eval",
    "--episodes",
    "short",
    "--helper",
    "none,random",
    "--size",
    "32",
    "--task",
    "no_constraint",
    "--partners",
    "list.json",
    "--out",
];

/// Returns a folder with short episodes, two of them without constraint, and a list of partners.
fn with_list() -> tempfile::TempDir {
    let dir = short_episodes();
    let generate = ["episodes", "generate", "--task", "no_constraint", "--seeds", "1..2"];
    run_ok(dir.path(), &[&generate[..], &["--out", "short"]].concat());
    shorten(&dir.path().join("short"));
    fs::write(dir.path().join("list.json"), LIST).expect("the disk has space");
    dir
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn runs_with_several_partners_resume_verify_and_report() {
    let dir = with_list();
    let at = dir.path();
    let printed = run_ok(at, &[&PLAY[..], &["s"]].concat());
    for words in ["Robustness: gain of TR", "Share of the gain kept", "hasty", "drawn"] {
        assert!(printed.contains(words), "{words}: {printed}");
    }
    // Traces name all habits, so that they replay without the distribution of drawn partners.
    let trace = "s/drawn/traces/no_constraint/random/gen-1--tires-s0.jsonl";
    let trace = read(&at.join(trace));
    assert!(trace.lines().next().expect("a header").contains("\"partner\":\"habits:"), "{trace}");
    assert!(read(&at.join("s/hasty/results.jsonl")).contains("no_constraint/gen/0/+speed150"));
    let verified = run_ok(at, &["verify", "s"]);
    assert!(verified.contains("the runs differ in the partner only"), "{verified}");
    run_ok(at, &["verify", "s/drawn"]);
    let runs = run_ok(at, &["list", "runs", ".", "--format", "json"]);
    assert_eq!(runs.matches("\"run\"").count(), 3, "{runs}");
    let report: serde_json::Value =
        serde_json::from_str(&run_ok(at, &["report", "s", "--format", "json"])).expect("JSON");
    assert_eq!(report["helpers"][0]["partners"].as_array().map(Vec::len), Some(2));
    assert_eq!(report["helpers"][0]["episodes"], 2);
    assert_eq!(report["episode_runs"]["planned"], 12);
    assert_eq!(report["partners"]["hasty"], "+speed150");
    let csv = run_ok(at, &["report", "s", "--format", "csv"]);
    assert_eq!(csv.lines().count(), 1 + 3 * 2, "{csv}");

    // An interrupted run plays what is missing.
    let whole = read(&at.join("s/robustness.json"));
    for file in ["s/drawn/results.jsonl", "s/robustness.json", "s/drawn/report.md"] {
        fs::remove_file(at.join(file)).expect("it exists");
    }
    assert!(run_err(at, &["verify", "s"]).contains("robustness.json: it is missing"));
    run_ok(at, &["eval", "--resume", "--out", "s", "--partners", "list.json"]);
    assert_eq!(read(&at.join("s/robustness.json")), whole);
    run_ok(at, &["verify", "s"]);

    // Other partners are refused, and so are forged reports and other runs.
    fs::write(at.join("other.json"), LIST.replace("drawn:7", "drawn:8")).expect("space");
    let refused = run_err(at, &["eval", "--resume", "--out", "s", "--partners", "other.json"]);
    assert!(refused.contains("was started with other partners"), "{refused}");
    for (option, value) in [("--partner", "drawn:7"), ("--person", "child")] {
        let refused = run_err(at, &["eval", "--resume", "--out", "s", option, value]);
        assert!(refused.contains("s has runs with several partners; omit --partner"), "{refused}");
    }
    for arguments in [&["report", "s", "--losses"][..], &["show", "s"]] {
        let refused = run_err(at, arguments);
        assert!(refused.contains("name one of them, such as s/rules"), "{refused}");
    }
    fs::write(at.join("s/robustness.json"), whole.replace("\"mean\": ", "\"mean\": 1"))
        .expect("space");
    fs::create_dir(at.join("s/more")).expect("the disk has space");
    let found = run_err(at, &["verify", "s"]);
    assert!(found.contains("robustness.json: it differs from the results"), "{found}");
    assert!(found.contains("s/more: it is no file of a folder with several partners"), "{found}");
}

#[test]
fn shards_with_several_partners_are_merged() {
    let dir = with_list();
    let at = dir.path();
    run_ok(at, &[&PLAY[..], &["whole"]].concat());
    for (shard, out) in [("1/2", "a"), ("2/2", "b")] {
        run_ok(at, &[&PLAY[..], &[out, "--shard", shard]].concat());
    }
    run_ok(at, &["merge", "--out", "merged", "a", "b"]);
    let report = |run: &str| read(&at.join(run).join("robustness.json"));
    assert_eq!(report("merged"), report("whole"));
    run_ok(at, &["verify", "merged"]);
    // A merge that was stopped before its last files is repeated.
    for removed in [&["drawn/report.html"][..], &["hasty/report.html", "drawn"]] {
        for file in removed.iter().chain(&["robustness.md"]) {
            let path = at.join("merged").join(file);
            let is_removed =
                if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
            is_removed.expect("it exists");
        }
        run_ok(at, &["merge", "--out", "merged", "a", "b"]);
        assert_eq!(report("merged"), report("whole"));
        for file in ["drawn/report.html", "hasty/report.html", "robustness.md"] {
            assert!(at.join("merged").join(file).is_file(), "{file}");
        }
    }
    assert!(run_err(at, &["merge", "--out", "merged", "a", "b"]).contains("isn't empty"));
    // Shards of other runs are not merged into this folder.
    fs::remove_file(at.join("merged/robustness.md")).expect("it exists");
    assert!(run_err(at, &["merge", "--out", "merged", "a"]).contains("isn't empty"));
    let refused = run_err(at, &["merge", "--out", "c", "a", "whole/rules"]);
    assert!(refused.contains("has no runs with several partners"), "{refused}");
    let refused = run_err(at, &["eval", "--resume", "--out", "whole/rules", "--partners", "suite"]);
    assert!(refused.contains("is a run with one partner"), "{refused}");
}

#[test]
fn wrong_partners_are_refused_with_one_line() {
    let dir = with_list();
    let at = dir.path();
    let play = |more: &[&str]| {
        let refused = run_err(at, &[&PLAY[..9], more, &["--out", "s"]].concat());
        assert!(!at.join("s").exists(), "{refused}");
        assert_eq!(
            refused.lines().filter(|line| line.starts_with("error")).count(),
            1,
            "{refused}"
        );
        refused
    };
    for (from, to, words) in [
        ("\"drawn:7\"", "\"ogre\"", "wrong.json: `drawn`: unknown partner `ogre`"),
        ("\"drawn:7\"", "\"habits:pause=999\"", "from 0 to 600"),
        ("+speed150", "+speed300", "50 to 200"),
        ("\"hasty\"", "\"drawn\"", "two partners have the name `drawn`"),
        ("\"hasty\"", "\"../x\"", "letters, digits"),
        ("+tires", "rider", "0 bicycles"),
        ("\"version\": 1,", "", "missing field `version`"),
    ] {
        let list = LIST.replace(from, to);
        assert_ne!(list, LIST, "{from}");
        fs::write(at.join("wrong.json"), list).expect("the disk has space");
        let refused = play(&["--partners", "wrong.json"]);
        assert!(refused.contains(words), "{words}: {refused}");
    }
    assert!(play(&["--partners", "missing.json"]).contains("no such file; give `suite`"));
    assert!(play(&["--partners", "suite", "--partner", "slow"]).contains("--partner"));
    let alone = ["eval", "--episodes", "short", "--helper", "rhp", "--partners", "list.json"];
    assert!(run_err(at, &[&alone[..], &["--out", "s"]].concat()).contains("add none"));
    let unused = play(&["--partners", "list.json", "--endpoint", "http://localhost:1/v1"]);
    assert!(unused.contains("no helper or partner asks a language model"), "{unused}");
    assert!(play(&["--partner", "habits:order=last"]).contains("nearest, farthest, random"));
}

#[test]
fn a_recorded_partner_repeats_a_trace_and_is_named_by_its_digest() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let play = ["eval", "--task", "no_constraint", "--size", "64", "--helper", "none"];
    let play = |more: &[&'static str]| [&play[..], more].concat();
    let split = ["--split", "gen:12..13", "--out"];
    run_ok(at, &play(&[&split[..], &["a", "--partner", "one_by_one"]].concat()));
    let trace = "a/traces/no_constraint/none/gen-12-s0.jsonl";
    for (out, partner) in
        [("b", "recorded:a/traces/no_constraint/none/gen-12-s0.jsonl"), ("c", "recorded:a")]
    {
        run_ok(at, &play(&[&split[..], &[out, "--partner", partner]].concat()));
    }
    let header = |run: &str| {
        let trace = read(&at.join(trace.replacen('a', run, 1)));
        let header = trace.lines().next().expect("a header").to_owned();
        serde_json::from_str::<serde_json::Value>(&header).expect("JSON")
    };
    let name = header("b")["partner"].as_str().expect("a name").to_owned();
    let digest = name.strip_prefix("recorded:").expect("its kind").to_owned();
    assert_eq!(header("b")["people"][0]["recording"], digest.as_str());
    assert_eq!(header("b")["partner"], header("c")["partner"]);
    assert!(read(&at.join("b/run.json")).contains(&name));
    let scores = |run: &str| {
        let results = read(&at.join(run).join("results.jsonl"));
        let result: serde_json::Value = serde_json::from_str(&results).expect("JSON");
        (result["done"].clone(), result["total"].clone())
    };
    assert_eq!(scores("a"), scores("b"), "it delivers what the recorded partner delivered");
    // Verification needs the trace only.
    fs::remove_dir_all(at.join("a")).expect("it exists");
    run_ok(at, &["verify", "b"]);

    // A resumed run needs the recording again, and other episodes are refused before the run begins.
    let refused = run_err(at, &["eval", "--resume", "--out", "b"]);
    assert!(refused.contains("comes from a file"), "{refused}");
    let recorded = "recorded:b/traces/no_constraint/none/gen-12-s0.jsonl";
    let other = ["--split", "gen:12..14", "--out", "d", "--partner", recorded];
    let refused = run_err(at, &play(&other));
    assert!(refused.contains("no recording of no_constraint/gen/13"), "{refused}");
    assert!(!at.join("d").exists());
    let body = ["--split", "gen:12..13", "--out", "d", "--person", "child", "--partner", recorded];
    assert!(run_err(at, &play(&body)).contains("no recording of"));
    for (partner, words) in [
        ("recorded:missing", "missing"),
        ("policy:b/run.json", "not a weights file"),
        ("recorded:", "`recorded:` has no path after the colon"),
        ("policy:", "`policy:` has no path after the colon"),
    ] {
        let refused = run_err(at, &play(&[&split[..], &["d", "--partner", partner]].concat()));
        assert!(refused.contains(words) && refused.lines().count() <= 2, "{refused}");
    }
}

/// The scripted server stands in for a language model, and a trace of the ordinary partner for a recorded person.
#[test]
fn a_list_may_name_a_language_model_and_a_recorded_person() {
    use chaic_llm_standin::{Options, StandIn};
    const PEOPLE: &str = r#"{
      "format": "chaic-partners",
      "version": 1,
      "partners": [
        { "name": "model", "partner": "llm" },
        { "name": "person", "partner": "recorded:alone" }
      ]
    }"#;
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let generate = ["episodes", "generate", "--task", "no_constraint", "--seeds", "12..13"];
    run_ok(at, &[&generate[..], &["--out", "short"]].concat());
    // The partner picks up its first object in frame 127.
    shorten_to(&at.join("short"), 200);
    let play = ["eval", "--episodes", "short", "--size", "16", "--helper"];
    run_ok(at, &[&play[..], &["none", "--out", "alone"]].concat());
    fs::write(at.join("people.json"), PEOPLE).expect("the disk has space");
    let standin = StandIn::start(Options::default()).expect("a port is free");
    let url = standin.url();
    let model = ["--endpoint", &url, "--model", "standin", "--partners", "people.json"];
    run_ok(at, &[&play[..], &["none,random", "--out", "s"], &model].concat());
    let header = |partner: &str| {
        let trace = format!("s/{partner}/traces/no_constraint/random/gen-12-s0.jsonl");
        read(&at.join(trace)).lines().next().expect("a header").to_owned()
    };
    assert!(header("model").contains(r#""partner":"llm""#), "{}", header("model"));
    assert!(header("person").contains(r#""partner":"recorded:"#), "{}", header("person"));
    let repeated = read(&at.join("s/person/results.jsonl"));
    assert!(repeated.contains(r#""partner.repeated":1"#), "{repeated}");
    // The list names files, so a resumed run needs it again.
    let resume = ["eval", "--resume", "--out", "s"];
    let refused = run_err(at, &resume);
    assert!(refused.contains("the partner `person` of s comes from a file"), "{refused}");
    assert!(refused.contains("with --partners FILE"), "{refused}");
    run_ok(at, &[&resume[..], &model].concat());
    // Verification needs neither the server nor the recording.
    drop(standin);
    fs::remove_dir_all(at.join("alone")).expect("it exists");
    let verified = run_ok(at, &["verify", "s"]);
    assert!(verified.contains("the runs differ in the partner only"), "{verified}");
}
