//! Promise: `chaic verify` fails on a run whose folder was forged. Each row of the tables is an
//! attack. The report is written again after an attack, unless it is the target, so that it does
//! not reveal the attack.

#[cfg(unix)]
mod special_files;

use std::collections::BTreeMap;

use super::*;
use crate::report::{Report, write_files};

/// The attacked trace and its folder.
const TRACE: &str = "traces/low_target/turner/short-0-s0.jsonl";
const TRACES_OF_HELPER: &str = "traces/low_target/turner";

/// Plays two tasks with two helpers and writes the report.
fn whole_run(path: &Path, source: &tempfile::TempDir, helpers: &TestHelpers) {
    let request = RunRequest { seeds: None, ..request(source, &["none", "turner"]) };
    let (mut run, _) = Run::open(path, FolderMode::New, &request, helpers).unwrap();
    assert!(play(&mut run, 2, helpers));
    drop(run);
    write_report(path);
}

/// Writes the report of the results, if they can be read.
fn write_report(path: &Path) {
    let Ok((folder, options)) = RunFolder::read(path) else { return };
    let planned = planned(&folder, &options).unwrap_or_default();
    let Ok((results, _)) = read_results(&folder.results(), &planned) else { return };
    let granted = folder.granted().unwrap();
    let (results, planned, formulas) = (&results, &planned, crate::metrics::FormulaSet::Paper);
    let (version, granted) = (chaic_env::CHAIC_VERSION, granted.as_ref());
    let report = Report { version, options: &options, results, planned, granted, formulas };
    write_files(&folder, &report).unwrap();
}

/// Verifies a run and returns the problems, one per line.
fn problems(path: &Path, helpers: &TestHelpers) -> String {
    let report = RunFolder::read(path).and_then(|(folder, options)| {
        crate::verify::verify_run(&folder, &options, helpers, 1, &|_| ())
    });
    let report = match report {
        Ok(report) => report,
        Err(error) => return error.to_string(),
    };
    let mismatches = report.mismatches.iter().map(ToString::to_string);
    let findings = report.findings.iter().map(ToString::to_string);
    let warnings = report.warnings.iter().map(ToString::to_string);
    let mut problems: Vec<String> = mismatches.chain(findings).chain(warnings).collect();
    if !report.report.has_passed() {
        problems.push(format!("{:?}", report.report));
    }
    if !report.coverage.is_complete() {
        problems.push(report.coverage.to_string());
    }
    assert_eq!(problems.is_empty(), report.has_passed(), "{problems:?}");
    problems.join("\n")
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in chaic_files::entries(from).unwrap() {
        let copy = to.join(entry.file_name().unwrap());
        if entry.is_dir() {
            copy_folder(&entry, &copy);
        } else {
            fs::copy(&entry, copy).unwrap();
        }
    }
}

/// Changes a text file.
fn change(path: PathBuf, change: impl FnOnce(&str) -> String) {
    let text = fs::read_to_string(&path).unwrap();
    let changed = change(&text);
    assert!(changed != text, "nothing is changed in {}", path.display());
    fs::write(path, changed).unwrap();
}

fn replace(path: PathBuf, from: &str, to: &str) {
    change(path, |text| text.replacen(from, to, 1));
}

fn append(path: PathBuf, bytes: &[u8]) {
    let text = fs::read(&path).unwrap();
    fs::write(path, [&text, bytes].concat()).unwrap();
}

/// Changes the result of the attacked episode run.
fn forge(run: &Path, forgery: impl Fn(&mut serde_json::Value)) {
    change(run.join("results.jsonl"), |text| {
        let line = |line: &str| {
            let mut result: serde_json::Value = serde_json::from_str(line).unwrap();
            if result["task"] == "low_target" && result["helper"] == "turner" {
                forgery(&mut result);
            }
            result.to_string() + "\n"
        };
        text.lines().map(line).collect()
    });
}

/// Sets the attacked result to the maximum.
fn maximize_score(run: &Path) {
    forge(run, |result| result["done"] = result["total"].clone());
}

/// Removes the attacked episode run.
fn hide_attacked(run: &Path) {
    replace(run.join("results.jsonl"), &line_of_attacked(run), "");
    fs::remove_file(run.join(TRACE)).unwrap();
}

/// Changes options and grants in `run.json`, and renews the digest of the options.
fn rewrite_run_file(run: &Path, change: impl FnOnce(&mut RunOptions, &mut RunGrants)) {
    let (folder, mut options) = RunFolder::read(run).unwrap();
    let mut granted = folder.granted().unwrap().unwrap();
    change(&mut options, &mut granted);
    folder.write_options(&options, &granted, None, HelperFiles::new()).unwrap();
}

/// Returns an entry of the grants in `run.json`.
fn entry(name: &str, value: &str) -> BTreeMap<String, String> {
    BTreeMap::from([(name.to_owned(), value.to_owned())])
}

/// Returns the journal line of the attacked episode run.
fn line_of_attacked(run: &Path) -> String {
    let text = fs::read_to_string(run.join("results.jsonl")).unwrap();
    let is_it = |l: &&str| l.contains("\"low_target\"") && l.contains("\"turner\"");
    text.lines().find(is_it).unwrap().to_owned() + "\n"
}

fn last_line(path: &Path) -> String {
    fs::read_to_string(path).unwrap().lines().last().unwrap().to_owned() + "\n"
}

/// Treatment of the report after an attack.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AfterAttack {
    Rewritten,
    Kept,
}
use AfterAttack::{Kept, Rewritten};

type Attack = (&'static str, AfterAttack, &'static str, fn(&Path));

/// Attacks that work on any system.
const ATTACKS: &[Attack] = &[
    ("better result", Rewritten, "differs from the one of the trace", maximize_score),
    ("trace is a folder", Rewritten, "its trace is not a regular file: it is a folder", |run| {
        maximize_score(run);
        fs::remove_file(run.join(TRACE)).unwrap();
        fs::create_dir(run.join(TRACE)).unwrap();
    }),
    ("no trace", Rewritten, "its trace is missing", |run| {
        maximize_score(run);
        fs::remove_file(run.join(TRACE)).unwrap();
    }),
    ("no traces at all", Rewritten, "its trace is missing", |run| {
        fs::remove_dir_all(run.join("traces")).unwrap();
    }),
    ("traces is a file", Rewritten, "traces: it is not a trace", |run| {
        fs::remove_dir_all(run.join("traces")).unwrap();
        fs::write(run.join("traces"), "").unwrap();
    }),
    ("empty trace", Rewritten, "can't be checked", |run| fs::write(run.join(TRACE), "").unwrap()),
    ("trace without its end", Rewritten, "the episode's end is missing", |run| {
        let end = last_line(&run.join(TRACE));
        replace(run.join(TRACE), &end, "");
    }),
    ("better end", Rewritten, "the re-simulation has", |run| {
        maximize_score(run);
        replace(run.join(TRACE), "\"done\":0.0", "\"done\":8.0");
    }),
    ("second end", Rewritten, "follows the end of the trace", |run| {
        append(run.join(TRACE), last_line(&run.join(TRACE)).as_bytes());
    }),
    ("better second end", Rewritten, "follows the end of the trace", |run| {
        let end = last_line(&run.join(TRACE)).replacen("\"done\":0.0", "\"done\":1.0", 1);
        append(run.join(TRACE), end.as_bytes());
    }),
    ("record after the end", Rewritten, "follows the end of the trace", |run| {
        append(run.join(TRACE), b"{\"frame\":90,\"event\":\"over\",\"complete\":true}\n");
    }),
    ("torn record after the end", Rewritten, "follows the end of the trace", |run| {
        append(run.join(TRACE), b"[90,0,");
    }),
    ("no UTF-8 after the end", Rewritten, "follows the end of the trace", |run| {
        append(run.join(TRACE), b"\xff\xfe\n");
    }),
    ("very long line after the end", Rewritten, "follows the end of the trace", |run| {
        append(run.join(TRACE), &vec![b' '; 9 << 20]);
    }),
    ("empty line in a trace", Rewritten, "line 2", |run| replace(run.join(TRACE), "\n", "\n\n")),
    ("other line breaks", Rewritten, "differs from the form that chaic writes", |run| {
        change(run.join(TRACE), |text| text.replace('\n', "\r\n"));
    }),
    (
        "extra field in the header",
        Rewritten,
        "line 1 differs from the form that chaic writes",
        |run| {
            replace(run.join(TRACE), "{\"format\"", "{\"note\":1,\"format\"");
        },
    ),
    ("duplicate field in the header", Rewritten, "duplicate field", |run| {
        replace(run.join(TRACE), "{\"format\"", "{\"seed\":0,\"format\"");
    }),
    ("extra field in an event", Rewritten, "differs from the form that chaic writes", |run| {
        replace(run.join(TRACE), "{\"frame\"", "{\"note\":1,\"frame\"");
    }),
    ("extra field beside the end", Rewritten, "differs from the form that chaic writes", |run| {
        change(run.join(TRACE), |text| text.replacen("}}\n", "},\"note\":1}\n", 1));
    }),
    ("extra entry in a decision", Rewritten, "trailing", |run| {
        change(run.join(TRACE), |text| {
            let second = text.lines().nth(1).unwrap();
            text.replacen(second, &second.replace(']', ",null,7]"), 1)
        });
    }),
    ("other version of chaic in a trace", Rewritten, "another version of chaic", |run| {
        let now = format!("\"chaic\":\"{}\"", chaic_env::CHAIC_VERSION);
        replace(run.join(TRACE), &now, "\"chaic\":\"0.0.9\"");
    }),
    ("trace of another seed", Rewritten, "doesn't play that episode run", |run| {
        let other = run.join(TRACE.replace("-s0", "-s1"));
        fs::copy(run.join(TRACE), other).unwrap();
    }),
    ("trace of another helper", Rewritten, "doesn't play that episode run", |run| {
        fs::create_dir_all(run.join("traces/low_target/oracle")).unwrap();
        fs::copy(run.join(TRACE), run.join(TRACE.replace("turner", "oracle"))).unwrap();
    }),
    ("trace of another task", Rewritten, "doesn't play that episode run", |run| {
        copy_folder(&run.join("traces/low_target"), &run.join("traces/tremor"));
    }),
    ("path in other case", Rewritten, "doesn't play that episode run", |run| {
        fs::create_dir_all(run.join("traces/low_target/Turner")).unwrap();
        fs::copy(run.join(TRACE), run.join(TRACE.replace("turner", "Turner"))).unwrap();
    }),
    ("extension in other case", Rewritten, "it is not a trace of this run", |run| {
        fs::copy(run.join(TRACE), run.join(TRACE.replace(".jsonl", ".JSONL"))).unwrap();
    }),
    ("trace in place of another", Rewritten, "the one of another episode run", |run| {
        fs::copy(run.join(TRACE), run.join(TRACE.replace("low_target", "shopping"))).unwrap();
    }),
    ("unfinished trace", Rewritten, "it is an unfinished trace", |run| {
        fs::write(run.join(format!("{TRACE}.partial")), "").unwrap();
    }),
    ("stray file among traces", Rewritten, "it is not a trace of this run", |run| {
        fs::write(run.join("traces/letter.txt"), "dear").unwrap();
    }),
    ("folder below a helper's", Rewritten, "it is not a trace: it is a folder", |run| {
        copy_folder(&run.join("traces/shopping"), &run.join(TRACES_OF_HELPER).join("more"));
    }),
    ("result without its run", Rewritten, "which this run doesn't play", |run| {
        let line = line_of_attacked(run).replace("\"seed\":0", "\"seed\":7");
        append(run.join("results.jsonl"), line.as_bytes());
    }),
    ("trace without its result", Rewritten, "no finished result of this run", |run| {
        replace(run.join("results.jsonl"), &line_of_attacked(run), "");
    }),
    ("finished result recorded as failed", Rewritten, "no finished result of this run", |run| {
        forge(run, |result| {
            let mut broken = serde_json::json!({"status": "error", "message": "failed"});
            for name in RunKey::FIELDS {
                broken[name] = result[name].clone();
            }
            *result = broken;
        });
    }),
    ("duplicate result", Rewritten, "is a second result of low_target/short/0", |run| {
        append(run.join("results.jsonl"), line_of_attacked(run).as_bytes());
    }),
    ("better result before the good one", Rewritten, "is a second result", |run| {
        let good = line_of_attacked(run);
        maximize_score(run);
        append(run.join("results.jsonl"), good.as_bytes());
    }),
    ("better result after the good one", Rewritten, "is a second result", |run| {
        let good = line_of_attacked(run);
        maximize_score(run);
        let forged = line_of_attacked(run);
        replace(run.join("results.jsonl"), &forged, &good);
        append(run.join("results.jsonl"), forged.as_bytes());
    }),
    ("extra field in a result", Rewritten, "unknown field `note`", |run| {
        forge(run, |result| result["note"] = 1.into());
    }),
    ("duplicate field in a result", Rewritten, "the field `done` occurs twice", |run| {
        replace(run.join("results.jsonl"), "\"done\":", "\"done\":9.0,\"done\":");
    }),
    (
        "counter of an agent without counters",
        Rewritten,
        "built-in agents have no counters",
        |run| {
            replace(
                run.join("results.jsonl"),
                "\"digest\"",
                "\"counts\":{\"partner.x\":1},\"digest\"",
            );
        },
    ),
    (
        "one result without diagnostic metrics",
        Rewritten,
        "differs from the one of the trace",
        |run| {
            forge(run, |result| drop(result.as_object_mut().unwrap().remove("measures")));
        },
    ),
    ("no diagnostic metrics at all", Rewritten, "differs from the one of the trace", |run| {
        change(run.join("results.jsonl"), |text| {
            let line = |line: &str| {
                let mut result: serde_json::Value = serde_json::from_str(line).unwrap();
                result.as_object_mut().unwrap().remove("measures");
                result.to_string() + "\n"
            };
            text.lines().map(line).collect()
        });
    }),
    ("torn result after the others", Rewritten, "is cut off", |run| {
        append(run.join("results.jsonl"), b"{\"task\":\"low_target\"");
    }),
    ("no UTF-8 in results", Rewritten, "results.jsonl: line 5", |run| {
        append(run.join("results.jsonl"), b"\xff\xfe\n");
    }),
    ("very long result", Rewritten, "line 5: is longer than", |run| {
        append(run.join("results.jsonl"), &vec![b' '; 9 << 20]);
    }),
    ("results are a folder", Kept, "results.jsonl: it is a folder", |run| {
        fs::remove_file(run.join("results.jsonl")).unwrap();
        fs::create_dir(run.join("results.jsonl")).unwrap();
    }),
    ("no scores", Kept, "missing: [\"scores.json\"]", |run| {
        fs::remove_file(run.join("scores.json")).unwrap();
    }),
    ("no report", Kept, "missing: [\"report.md\"]", |run| {
        fs::remove_file(run.join("report.md")).unwrap();
    }),
    ("no figure", Kept, "missing: [\"figure.svg\"]", |run| {
        fs::remove_file(run.join("figure.svg")).unwrap();
    }),
    ("better scores", Kept, "altered: [\"scores.json\"]", |run| {
        replace(run.join("scores.json"), "0.0", "1.0");
    }),
    ("report is a folder", Kept, "altered: [\"report.md\"]", |run| {
        fs::remove_file(run.join("report.md")).unwrap();
        fs::create_dir(run.join("report.md")).unwrap();
    }),
    ("no episodes", Rewritten, "episodes", |run| fs::remove_dir_all(run.join("episodes")).unwrap()),
    ("easier episode", Rewritten, "differs from the one that this run writes: setup", |run| {
        let copy = run.join("episodes/low_target-short-0.json");
        replace(copy, "\"horizon\": 90", "\"horizon\": 91");
    }),
    ("episode under another name", Rewritten, "under another name", |run| {
        let copy = run.join("episodes/low_target-short-0.json");
        fs::copy(&copy, run.join("episodes/a.json")).unwrap();
    }),
    ("extra field in run.json", Rewritten, "run.json: its form differs", |run| {
        replace(run.join("run.json"), "\"format\"", "\"note\": 1,\n  \"format\"");
    }),
    ("no grants in run.json", Rewritten, "it lacks the grants of helpers", |run| {
        change(run.join("run.json"), |text| {
            let mut file: serde_json::Value = serde_json::from_str(text).unwrap();
            file.as_object_mut().unwrap().remove("granted");
            serde_json::to_string_pretty(&file).unwrap() + "\n"
        });
    }),
    (
        "grants of an unknown helper in run.json",
        Rewritten,
        "its grants are not those of the helpers that play",
        |run| {
            replace(run.join("run.json"), "\"turner\": {", "\"turnip\": {");
        },
    ),
    ("no seeds in run.json", Rewritten, "the run plays no episode", |run| {
        hide_attacked(run);
        rewrite_run_file(run, |options, _| options.seeds = 0);
    }),
    ("no tasks in run.json", Rewritten, "the run plays no episode", |run| {
        hide_attacked(run);
        rewrite_run_file(run, |options, _| options.tasks.clear());
    }),
    ("no helpers in run.json", Rewritten, "the run plays no episode", |run| {
        hide_attacked(run);
        rewrite_run_file(run, |options, granted| {
            options.helpers.clear();
            granted.helpers.clear();
        });
    }),
    ("isolation in run.json only", Rewritten, "run.json names another isolation", |run| {
        rewrite_run_file(run, |_, granted| granted.isolation = entry("turner", "sandbox"));
    }),
    ("weights in run.json only", Rewritten, "run.json names other weights", |run| {
        rewrite_run_file(run, |_, granted| granted.weights = entry("turner", "0123456789ab"));
    }),
    ("perception of no helper", Rewritten, "the perception of helpers that do not play", |run| {
        rewrite_run_file(run, |_, granted| granted.perception = entry("none", "learned"));
    }),
    ("isolation of no helper", Rewritten, "the isolation of helpers that do not play", |run| {
        rewrite_run_file(run, |_, granted| granted.isolation = entry("none", "sandbox"));
    }),
    ("weights of another helper", Rewritten, "the weights of helpers that do not play", |run| {
        rewrite_run_file(run, |_, granted| granted.weights = entry("oracle", "0123456789ab"));
    }),
    ("files of no helper", Rewritten, "the files of helpers that do not play", |run| {
        let (folder, options) = RunFolder::read(run).unwrap();
        let granted = folder.granted().unwrap().unwrap();
        let files = HelperFiles::from([("none".to_owned(), BTreeMap::new())]);
        folder.write_options(&options, &granted, None, files).unwrap();
    }),
    ("grants of no helper", Rewritten, "its grants are not those of the helpers", |run| {
        rewrite_run_file(run, |_, granted| {
            granted.helpers.insert("none".to_owned(), Grants::ORACLE);
        });
    }),
    ("other grants in run.json", Rewritten, "not those that such an agent requests", |run| {
        rewrite_run_file(run, |_, granted| granted.partner = Grants::NONE);
    }),
    ("one trace of two helpers", Rewritten, "6 results are finished, but 4 traces", |run| {
        rewrite_run_file(run, |options, granted| {
            options.helpers.push("./turner".to_owned());
            granted.helpers.insert("./turner".to_owned(), Grants::NONE);
        });
        change(run.join("results.jsonl"), |text| {
            let lines = text.lines().filter(|line| line.contains("\"turner\""));
            let copies = lines.map(|line| line.replace("\"turner\"", "\"./turner\"") + "\n");
            text.to_owned() + &copies.collect::<String>()
        });
    }),
    ("other version in run.json", Rewritten, "OtherVersion", |run| {
        replace(run.join("run.json"), chaic_env::CHAIC_VERSION, "0.0.9");
    }),
];

fn check_attacks(attacks: &[Attack]) {
    let source = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let (dir, helpers) = (tempfile::tempdir().unwrap(), TestHelpers::new());
    let good = dir.path().join("good");
    whole_run(&good, &source, &helpers);
    assert_eq!(problems(&good, &helpers), "");
    copy_folder(&good, &dir.path().join("copy"));
    assert_eq!(problems(&dir.path().join("copy"), &helpers), "", "a copy passes");
    let mut undetected = Vec::new();
    for (k, (name, report, expected, attack)) in attacks.iter().enumerate() {
        let run = dir.path().join(k.to_string());
        copy_folder(&good, &run);
        attack(&run);
        if *report == Rewritten {
            write_report(&run);
        }
        let found = problems(&run, &helpers);
        if !found.contains(expected) {
            undetected.push(format!("{name}: expected {expected:?}, verify reported {found:?}"));
        }
    }
    assert!(undetected.is_empty(), "{}", undetected.join("\n"));
}

#[test]
fn forged_runs_fail() {
    assert!(ATTACKS.len() >= 25, "the issue requires 25 attacks");
    check_attacks(ATTACKS);
}

/// A run of a split ignores episode files in its folder.
#[test]
fn episode_files_in_a_run_of_a_split_are_ignored() {
    let (dir, helpers) = (tempfile::tempdir().unwrap(), TestHelpers::new());
    let request = RunRequest {
        episodes: None,
        split: Some(chaic_episodes::Split::Test),
        tasks: Some(vec![TaskId::LowTarget]),
        n_episodes: Some(1),
        ..request(&dir, &["turner"])
    };
    let (run, _) = Run::open(&dir.path().join("run"), FolderMode::New, &request, &helpers).unwrap();
    let key = &run.planned()[0].key;
    let bundled = run.folder().episode(run.options(), key).unwrap();
    let mut setup = bundled.clone().into_setup();
    setup.horizon = HORIZON;
    let easier = Episode::new(bundled.id(), "test", None, setup).unwrap();
    let copy = run.folder().episode_copy(key.task, &key.episode);
    fs::create_dir_all(copy.parent().unwrap()).unwrap();
    fs::write(&copy, easier.to_json()).unwrap();
    assert!(run.folder().episode(run.options(), key).unwrap() == bundled);
    drop(run);
    let found = problems(&dir.path().join("run"), &helpers);
    assert!(found.contains("this run plays the split test, which has no episode files"), "{found}");
}
