//! Promises: a study is checked, built, exported and deleted as documented; errors are one line. The pages themselves
//! have tests in `web`.

use std::fs;
use std::path::Path;

use crate::*;

const STUDY: &str = r#"title = "Shelves"
consent = "text.txt"
instructions = "text.txt"
debrief = "text.txt"
completion_code = "DONE"
participants = 6
timeout_minutes = 60
design = "latin_square"
episodes = ["high_target/test/00", "high_target/test/01"]

[factors]
helper = ["none", "rhp"]

[forms]
at_end = ["sus"]
"#;
const CODE: &str = "K7QXM2RBTA";

fn write_study(at: &Path) {
    fs::write(at.join("study.toml"), STUDY).expect("the disk has space");
    fs::write(at.join("text.txt"), "Plain words.\n").expect("the disk has space");
}

#[test]
fn a_study_is_checked_and_built() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_study(at);
    let check = ["study", "check", "study.toml", "--participants", "1000", "--dropout", "20"];
    let printed = run_ok(at, &check);
    for words in ["2 conditions for 6 slots", "helper=rhp", "1000 arrive, 20 % drop out"] {
        assert!(printed.contains(words), "{words}: {printed}");
    }
    let json = run_ok(at, &[&check[..], &["--format", "json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    let counts = &json["simulation"];
    let number = |name: &str| counts[name].as_u64().expect("a number");
    assert!(number("largest") - number("smallest") <= 6, "{counts}");
    assert!((750..850).contains(&number("completed")), "{counts}");

    let printed = run_ok(at, &["study", "build", "study.toml", "--out", "page.html"]);
    assert!(printed.contains("page.html#1 to page.html#6"), "{printed}");
    assert!(printed.contains("contains the goals"), "{printed}");
    let page = fs::read_to_string(at.join("page.html")).expect("a page");
    assert!(page.contains("<chaic-study>") && !page.contains("src="));
    run_ok(at, &["study", "build", "study.toml", "--out", "again.html"]);
    assert!(page == fs::read_to_string(at.join("again.html")).expect("a page"), "equal bytes");

    let wrong = STUDY.replace("participants = 6", "participants = 0");
    fs::write(at.join("study.toml"), wrong).expect("the disk has space");
    let refused = run_err(at, &["study", "build", "study.toml", "--out", "none.html"]);
    assert!(refused.contains("study.toml: `participants` must be from 1 to 10000"), "{refused}");
    assert_eq!(refused.lines().count(), 1, "{refused}");
    assert!(!at.join("none.html").exists());
    for (from, to) in [("test/01", "test/99"), ("timeout_minutes", "timeout"), ("rhp", "nobody")] {
        fs::write(at.join("study.toml"), STUDY.replace(from, to)).expect("the disk has space");
        let out = output_of(at, &["study", "check", "study.toml"]);
        let refused = text(&out.stderr);
        assert!(refused.contains("study.toml: ") && refused.contains(to), "{refused}");
        assert_eq!(out.status.code(), Some(2), "{refused}");
    }
}

#[test]
fn a_simulator_on_the_server_is_explained_and_not_built() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_study(at);
    let printed = run_ok(at, &["study", "check", "study.toml"]);
    assert!(printed.contains("the page simulates the episodes"), "{printed}");
    let server = STUDY.replace("[factors]", "[play]\nsimulator = \"server\"\n\n[factors]");
    fs::write(at.join("study.toml"), server).expect("the disk has space");
    let printed = run_ok(at, &["study", "check", "study.toml"]);
    assert!(printed.contains("the server simulates the episodes"), "{printed}");
    let refused = run_err(at, &["study", "build", "study.toml", "--out", "none.html"]);
    assert!(refused.contains("needs a server; use `chaic study serve`"), "{refused}");
    assert_eq!(refused.lines().count(), 1, "{refused}");
    assert!(!at.join("none.html").exists());
}

#[test]
fn collected_files_are_exported_and_deleted() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_study(at);
    let json = run_ok(at, &["study", "check", "study.toml", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    let start = serde_json::json!({
        "type": "start", "format": "chaic-study-data", "version": 1, "chaic": "0.1.0",
        "study": json["digest"], "code": CODE, "slot": 2,
    });
    fs::create_dir(at.join("data")).expect("the disk has space");
    let file = at.join("data/any name.jsonl");
    let trials = [0, 1].map(|trial| {
        [
            serde_json::json!({ "type": "trial", "trial": trial }),
            serde_json::json!({ "type": "trial_end", "trial": trial, "outcome": "left" }),
        ]
    });
    let records = std::iter::once(start).chain(trials.into_iter().flatten());
    let records = records.chain([serde_json::json!({ "type": "complete" })]);
    let lines: String = records.map(|record| format!("{record}\n")).collect();
    fs::write(&file, lines).expect("the disk has space");
    let export = ["study", "export", "data", "--study", "study.toml", "--out"];
    let printed = run_ok(at, &[&export[..], &["set"]].concat());
    assert!(printed.contains("1 participant, 1 complete; 0 of 0 traces verified"), "{printed}");
    assert!(printed.contains("5 open slots: 1, 3, 4, 5, 6"), "{printed}");
    assert!(at.join("set/dataset_description.json").is_file());
    let refused = run_err(at, &[&export[..], &["set"]].concat());
    assert!(refused.contains("set is not empty"), "{refused}");

    // A participant whose last record is half written.
    let torn = at.join("data/torn.jsonl");
    let whole = fs::read_to_string(&file).expect("a text");
    let cut = whole.replace(CODE, "ABCDEFGH23");
    fs::write(&torn, &cut[..cut.len() - 5]).expect("the disk has space");
    let exported = output_of(at, &[&export[..], &["set of two"]].concat());
    let warning = text(&exported.stderr);
    assert!(exported.status.success(), "{warning}");
    assert!(text(&exported.stdout).contains("2 participants, 1 complete"), "{warning}");
    assert!(
        warning.contains("warning: data/torn.jsonl, line 6: the line is incomplete"),
        "{warning}"
    );
    fs::remove_file(&torn).expect("it exists");

    let printed = run_ok(at, &["study", "delete", CODE, "data"]);
    assert_eq!(printed, format!("data: 1 file and 0 rows of {CODE} removed\n"));
    assert!(!file.exists());
    let refused = run_err(at, &["study", "delete", "../set", "data"]);
    assert!(refused.contains("is no participant code"), "{refused}");

    fs::write(&file, "{}\n").expect("the disk has space");
    let refused = run_err(at, &[&export[..], &["other"]].concat());
    assert!(refused.contains("any name.jsonl, line 1: no record"), "{refused}");
    assert_eq!(refused.lines().count(), 1, "{refused}");
}

/// The server itself has tests in `chaic-study-server` and, with the page, in `web`.
#[test]
fn a_study_is_served_if_the_build_has_the_server() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_study(at);
    let serve = ["study", "serve", "study.toml", "--data", "data"];
    if !cfg!(feature = "study-server") {
        assert!(run_err(at, &serve).contains("--features study-server"));
        return;
    }
    for (options, words) in [
        (["--listen", "0.0.0.0:0"], "add --host NAME"),
        (["--host", "https://study.example.org"], "is no name of a server"),
    ] {
        let out = output_of(at, &[&serve[..], &options].concat());
        let refused = text(&out.stderr);
        assert!(refused.contains(words), "{refused}");
        assert_eq!((refused.lines().count(), out.status.code()), (1, Some(2)), "{refused}");
    }
    fs::create_dir_all(at.join("data")).expect("the disk has space");
    fs::write(at.join(format!("data/{CODE}.jsonl")), "{}\n").expect("the disk has space");
    let refused = run_err(at, &[&serve[..], &["--listen", "127.0.0.1:0"]].concat());
    assert!(refused.contains(&format!("{CODE}.jsonl, line 1: no record")), "{refused}");
    assert_eq!(refused.lines().count(), 1, "{refused}");
}

#[cfg(feature = "study-server")]
#[test]
fn wrong_helpers_of_a_server_are_refused() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_study(at);
    let refused = |helper: &[&str], words: &str| {
        let serve = ["study", "serve", "study.toml", "--data", "data", "--listen", "127.0.0.1:0"];
        let error = run_err(at, &[&serve[..], helper].concat());
        assert!(error.contains(words), "{error}");
    };
    let mine = ["--helper", "mine=exec:true"];
    refused(&mine, "--helper needs `play.simulator = \"server\"`");
    let server = STUDY
        .replace("\"rhp\"]", "\"mine\"]")
        .replace("[factors]", "[play]\nsimulator = \"server\"\n\n[factors]");
    fs::write(at.join("study.toml"), server).expect("the disk has space");
    refused(&[], "unknown helper `mine`");
    refused(&["--helper", "rhp"], "--helper rhp has no command");
    refused(&[&mine[..], &["--helper", "other=exec:true"]].concat(), "the helper `other`");
    refused(&["--helper", "mine=policy:none.safetensors"], "none.safetensors");
}
