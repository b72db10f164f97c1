//! Runs held against their traces, their results and what they granted.

use std::path::PathBuf;

use super::*;

/// A run of one short episode with the turner, its trace, and the folder that it is in.
fn played_once(helpers: &TestHelpers) -> (Run, PathBuf, tempfile::TempDir) {
    let files = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let given = RunRequest { seeds: None, ..given(&files, &["turner"]) };
    let (mut run, _) = Run::open(dir.path(), Access::Begin, &given, helpers).unwrap();
    assert!(play(&mut run, 1, helpers));
    let path = run.folder().traces().unwrap().remove(0);
    (run, path, dir)
}

#[test]
fn verify_finds_what_was_changed() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let text = fs::read_to_string(&path).unwrap();
    let verify = || crate::verify::verify_run(run.folder(), run.options(), &helpers, 1, &|_| ());
    let verdict = || verify().unwrap();
    assert_eq!(verdict().mismatches, []);
    let changes = [
        // The second decision of the helper: the next digest differs.
        ("1,\"turn_left\"", "1,\"turn_right\"", "digest"),
        ("\"out_of_reach\"", "\"blocked\"", "played again it is"),
        ("\"complete\":false", "\"complete\":true", "played again it is"),
        ("\"seed\":0", "", "results.jsonl has this run"),
        // The first line: who was told what, by which rules, in which world.
        ("\"seed\":0", "\"seed\":1", "another episode run"),
        ("\"goal\":false", "\"goal\":true", "not what this run has: people"),
        ("\"container_capacity\":3", "\"container_capacity\":4", "not what this run has: rules"),
        ("\"world_seed\":", "\"world_seed\":9", "not what this run has: world_seed"),
        ("\"setup\":\"", "\"setup\":\"0", "can't be checked"),
    ];
    for (from, to, said) in changes {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from} is there");
        if said.contains("results.jsonl") {
            fs::remove_file(&path).unwrap();
        } else {
            fs::write(&path, changed).unwrap();
        }
        let mismatches = verdict().mismatches;
        assert_eq!(mismatches.len(), 1, "{from}");
        let said_so = mismatches[0].to_string();
        assert!(said_so.contains(said) && said_so.contains("short-0-s0.jsonl"), "{said_so}");
        fs::write(&path, &text).unwrap();
    }
    assert_eq!(verdict().mismatches, []);
}

#[test]
fn verify_holds_a_helper_that_is_not_at_hand_to_what_the_run_granted() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let text = fs::read_to_string(&path).unwrap();
    let verdict = || {
        let built_in = chaic_env::minds::BuiltIn;
        crate::verify::verify_run(run.folder(), run.options(), &built_in, 1, &|_| ()).unwrap()
    };
    assert_eq!(verdict().mismatches, []);
    fs::write(&path, text.replacen("\"goal\":false", "\"goal\":true", 1)).unwrap();
    let mismatches = verdict().mismatches;
    assert_eq!(mismatches.len(), 1);
    assert!(mismatches[0].problem.contains("not what this run has: people"), "{mismatches:?}");
}

#[test]
fn verify_counts_results_and_compares_the_report() {
    let source = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let given = RunRequest { seeds: None, ..given(&source, &["none", "turner"]) };
    let (mut run, _) = Run::open(dir.path(), Access::Begin, &given, &helpers).unwrap();
    assert!(play(&mut run, 1, &helpers));
    let verdict =
        || crate::verify::verify_run(run.folder(), run.options(), &helpers, 2, &|_| ()).unwrap();
    let compared = |missing: &[&'static str], altered: &[&'static str]| ReportState::Compared {
        missing: missing.to_vec(),
        altered: altered.to_vec(),
    };
    let files = ["scores.json", "report.md", "figure.svg"];
    assert_eq!(verdict().report, compared(&files, &[]));
    assert!(!verdict().is_good() && verdict().findings.is_empty());
    // As an older version left it, and with another number than the trace gives.
    let journal = run.folder().results();
    let lines = fs::read_to_string(&journal).unwrap();
    let changed = |change: &dyn Fn(&mut serde_json::Value)| {
        let line = |line: &str| {
            let mut result: serde_json::Value = serde_json::from_str(line).unwrap();
            change(&mut result);
            result.to_string() + "\n"
        };
        fs::write(&journal, lines.lines().map(line).collect::<String>()).unwrap();
        verdict().mismatches.len()
    };
    let measured = |r: &serde_json::Value| r.get("measures").is_some();
    assert!(lines.lines().any(|l| measured(&serde_json::from_str(l).unwrap())), "{lines}");
    assert_eq!(changed(&|r| drop(r.as_object_mut().unwrap().remove("measures"))), 0);
    let n_altered = changed(&|r| {
        if measured(r) {
            r["measures"]["partner_failures"] = 0.125.into();
        }
    });
    assert!(n_altered > 0);
    fs::write(&journal, &lines).unwrap();
    let report = crate::report::Report {
        options: run.options(),
        results: run.results(),
        planned: run.planned(),
        granted: Some(run.granted()),
        formulas: crate::metrics::FormulaSet::Paper,
    };
    crate::report::write_files(run.folder(), &report).unwrap();
    assert_eq!(verdict().report, compared(&[], &[]));
    assert!(verdict().is_good());
    assert_eq!(verdict().coverage.to_string(), "4 of 4 episode runs are finished");
    for name in files {
        let file = run.folder().join(name);
        let text = fs::read_to_string(&file).unwrap();
        for other in [text.replacen('0', "1", 1), format!("{text}\n"), String::new()] {
            fs::write(&file, other).unwrap();
            assert_eq!(verdict().report, compared(&[], &[name]));
            assert!(!verdict().is_good());
        }
        fs::write(&file, text).unwrap();
    }
    // A line less, and one that says that an episode broke down.
    let journal = run.folder().results();
    let lines = fs::read_to_string(&journal).unwrap();
    let (first, rest) = lines.split_once('\n').unwrap();
    fs::write(&journal, rest).unwrap();
    let said = verdict().coverage.to_string();
    assert!(said.contains("3 of 4 episode runs are finished; missing: 1, first "), "{said}");
    assert!(!verdict().is_good());
    let key: RunKey = serde_json::from_str::<RunResult>(first).unwrap().key;
    let ending = Ending::Error { message: "the episode broke down: as it is told".to_owned() };
    let broken = serde_json::to_string(&RunResult { key, ending }).unwrap();
    fs::write(&journal, format!("{broken}\n{rest}")).unwrap();
    let said = verdict().coverage.to_string();
    assert!(said.contains("3 of 4 episode runs are finished; broke down: 1, first "), "{said}");
    assert!(!verdict().is_good());
    fs::write(&journal, &lines).unwrap();
    assert!(verdict().is_good());

    // A trace that another chaic wrote concerns the whole run: one line says so.
    let trace = run.folder().traces().unwrap().remove(1);
    let now = format!("\"version\":{}", chaic_env::trace::VERSION);
    let text = fs::read_to_string(&trace).unwrap();
    fs::write(&trace, text.replacen(&now, "\"version\":99", 1)).unwrap();
    let error = crate::verify::verify_run(run.folder(), run.options(), &helpers, 2, &|_| ());
    let error = error.unwrap_err().to_string();
    assert!(error.contains("is of chaic-trace version 99") && error.contains("use the chaic that"));
    assert_eq!(error.lines().count(), 1, "{error}");
}
