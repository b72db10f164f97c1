//! Files of participants: checks, export and deletion.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, AgentId};
use chaic_env::trace::Record;
use chaic_env::{AdvanceOutcome, AgentSlot, Env, EpisodeAgents, EpisodeConfig};
use serde_json::{Value, json};

use super::{SMALL, StudyError, StudyPlan, folder_with, plan_of};
use crate::data::{FORMAT, ParticipantData, VERSION};
use crate::deletion::delete;
use crate::export::export;
use crate::study::PERSON;
use crate::study::Seat;

const CODE: &str = "K7QXM2RBTA";
const OTHER: &str = "ABCDEFGH23";

/// Plays some turns of a trial as the page does, and returns the lines of its trace.
fn played(plan: &StudyPlan, number: usize, slot: u32) -> String {
    let trial = plan.trials(slot)[number];
    assert_eq!(plan.conditions()[trial.condition].seat, Seat::Partner);
    let episode = &plan.episodes()[trial.episode];
    let sensors = SensorConfig { image_size: 32, ..SensorConfig::NONE };
    let person = Some(AgentSlot::external(Grants::NONE, sensors));
    let config = EpisodeConfig {
        partner: Some(PERSON),
        image_size: Some(32),
        ..EpisodeConfig::new(episode, plan.helper(trial))
    };
    let mut env =
        Env::new(config, EpisodeAgents { helper: None, partner: person }).expect("an env");
    let mut header = env.header().clone();
    header.people[0].input = Some("plans".to_owned());
    let mut lines = header.to_line() + "\n";
    for _ in 0..6 {
        let mut sink = |record: &Record| -> Result<(), chaic_core::AgentError> {
            lines.push_str(&(record.to_line() + "\n"));
            Ok(())
        };
        while env.run_frame(&mut sink).expect("it advances") != AdvanceOutcome::NeedsAction {}
        env.submit(AgentId::PARTNER, Action::TurnLeft);
    }
    lines
}

/// Returns the records of a participant who plays the practice episode in two parts.
fn records(plan: &StudyPlan, code: &str, slot: u32) -> Vec<Value> {
    let trace = played(plan, 0, slot);
    let (first, rest) = trace.split_at(trace.find('\n').expect("a line") + 1);
    let trust = json!({ "confident": 6, "reliable": null, "trust": 7 });
    vec![
        json!({ "type": "start", "format": FORMAT, "version": VERSION, "chaic": "0.1.0",
                "study": plan.digest(), "code": code, "slot": slot }),
        json!({ "type": "instructed" }),
        json!({ "type": "trial", "trial": 0 }),
        json!({ "type": "trace", "trial": 0, "text": first }),
        json!({ "type": "trace", "trial": 0, "text": rest }),
        json!({ "type": "trial_end", "trial": 0, "outcome": "stopped" }),
        json!({ "type": "trial", "trial": 1 }),
        json!({ "type": "trial_end", "trial": 1, "outcome": "left" }),
        json!({ "type": "answers", "position": 1, "form": "trust", "ratings": trust }),
        json!({ "type": "trial", "trial": 2 }),
        json!({ "type": "trial_end", "trial": 2, "outcome": "left" }),
        json!({ "type": "trial", "trial": 3 }),
        json!({ "type": "trial_end", "trial": 3, "outcome": "left" }),
        json!({ "type": "complete" }),
    ]
}

fn write(folder: &Path, name: &str, records: &[Value]) -> PathBuf {
    let path = folder.join(name);
    let lines: Vec<String> = records.iter().map(|record| format!("{record}\n")).collect();
    fs::write(&path, lines.concat()).expect("the disk has space");
    path
}

/// Returns the rows of a table as maps from column to cell. Cells of these tests have no commas.
fn rows(out: &Path, name: &str) -> Vec<BTreeMap<String, String>> {
    let files = fs::read_dir(out.join("data")).expect("a folder").flatten();
    let path = files.map(|f| f.path()).find(|p| p.to_string_lossy().contains(name));
    let text = fs::read_to_string(path.expect("the table")).expect("a text");
    let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let mut lines = text.lines().map(split);
    let columns = lines.next().expect("a header");
    lines.map(|cells| columns.iter().cloned().zip(cells).collect()).collect()
}

#[test]
fn an_export_has_verified_traces_answers_and_scores() {
    let (dir, path) = folder_with(SMALL);
    let plan = plan_of(&path).expect("a valid study");
    let data = dir.path().join("data");
    fs::create_dir(&data).expect("the disk has space");
    write(&data, "a.jsonl", &records(&plan, CODE, 2));
    let unfinished = records(&plan, OTHER, 5);
    write(&data, "b.jsonl", &unfinished[..4]);
    let out = dir.path().join("out");
    let report = export(&plan, std::slice::from_ref(&data), &out).expect("valid data");
    assert_eq!((report.participants, report.completed), (2, 1));
    // The trace of the second participant has its header only, and verifies as such.
    assert_eq!((report.traces, report.verified.len()), (2, 2), "{report:?}");
    assert_eq!(report.problems, Vec::<String>::new());
    assert_eq!(report.open_slots.len(), 47);
    assert!(!report.open_slots.contains(&2) && report.open_slots.contains(&5));

    let trials = rows(&out, "trials");
    let cells = |k: usize, name: &str| trials[k][name].clone();
    assert_eq!(
        [cells(0, "outcome"), cells(1, "outcome"), cells(2, "outcome")],
        ["stopped", "left", "left"]
    );
    assert_eq!([cells(0, "verified"), cells(1, "verified")], ["1", "0"]);
    assert_eq!([cells(0, "condition"), cells(0, "factor_helper")], ["", ""], "practice");
    assert_eq!(cells(0, "trace"), format!("traces/{CODE}/trial-00.jsonl"));
    let answers = rows(&out, "answers");
    let ratings: Vec<&str> = answers.iter().map(|row| row["rating"].as_str()).collect();
    assert_eq!(ratings, ["6", "", "7"]);
    let condition = &plan.conditions()[plan.trials(2)[1].condition];
    assert_eq!(answers[0]["factor_helper"], condition.helper);
    assert_eq!(rows(&out, "scores")[0]["score"], "", "an item has no answer");
    let text = fs::read_to_string(out.join("dataset_description.json")).expect("a text");
    let description: Value = serde_json::from_str(&text).expect("JSON");
    let variables = description["variableMeasured"].as_array().expect("a list");
    let names: Vec<&str> = variables.iter().filter_map(|v| v["name"].as_str()).collect();
    for column in trials[0].keys().chain(answers[0].keys()) {
        assert!(names.contains(&column.as_str()), "{column}");
    }

    for key in ["@context", "@type", "name", "description"] {
        assert!(description[key].as_str().is_some_and(|text| !text.is_empty()), "{key}");
    }
    for entry in fs::read_dir(out.join("data")).expect("a folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("ASCII");
        assert!(is_psych_ds_name(&name), "{name}");
    }

    let error = export(&plan, &[data], &out).expect_err("the folder is not empty");
    assert!(matches!(error, StudyError::NotEmpty { .. }), "{error}");
}

/// Returns whether a data file has a name of Psych-DS: pairs of a keyword in lower case and an
/// alphanumeric value, joined by underscores, before `_data.csv`.
fn is_psych_ds_name(name: &str) -> bool {
    let Some(pairs) = name.strip_suffix("_data.csv") else { return false };
    pairs.split('_').all(|pair| {
        pair.split_once('-').is_some_and(|(keyword, value)| {
            let is_keyword = keyword.chars().all(|c| c.is_ascii_lowercase());
            let is_value = value.chars().all(|c| c.is_ascii_alphanumeric());
            is_keyword && is_value && !keyword.is_empty() && !value.is_empty()
        })
    })
}

#[test]
fn altered_traces_are_exported_as_not_verified() {
    let (dir, path) = folder_with(SMALL);
    let plan = plan_of(&path).expect("a valid study");
    let text = |record: &Value| record["text"].as_str().expect("a text").to_owned();
    for (k, old, new) in [
        (4, "turn_left", "turn_right"),
        (3, "\"helper\":\"none\"", "\"helper\":\"rhp\""),
        (3, "\"input\":\"plans\"", "\"input\":\"steps\""),
        (4, "[2,", "[?,"),
    ] {
        let mut records = records(&plan, CODE, 1);
        let altered = text(&records[k]).replacen(old, new, 1);
        assert_ne!(altered, text(&records[k]), "{old}");
        records[k]["text"] = json!(altered);
        let file = write(dir.path(), "a.jsonl", &records);
        let out = dir.path().join(format!("out-{new}").replace(['"', ':', '?', '[', ','], "-"));
        let report = export(&plan, &[file], &out).expect("valid records");
        assert_eq!(
            (report.traces, report.verified.len(), report.problems.len()),
            (1, 0, 1),
            "{report:?}"
        );
        assert_eq!(rows(&out, "trials")[0]["verified"], "0");
    }
}

#[test]
fn hostile_files_are_refused_in_one_line() {
    let (dir, path) = folder_with(SMALL);
    let plan = plan_of(&path).expect("a valid study");
    let good = records(&plan, CODE, 1);
    let with = |k: usize, key: &str, value: Value| {
        let mut records = good.clone();
        records[k][key] = value;
        records
    };
    let mut repeated = good.clone();
    repeated.insert(2, good[2].clone());
    let ratings = |value: Value| with(8, "ratings", value);
    let mut early = good.clone();
    early.remove(12);
    let mut at_once = good.clone();
    at_once.remove(5);
    let late = [good.clone(), vec![json!({ "type": "instructed" })]].concat();
    for (records, words) in [
        (Vec::new(), "line 1: the first record must be `start`"),
        (good[1..].to_vec(), "the first record must be `start`"),
        (with(0, "version", json!(2)), "expected `chaic-study-data` 1"),
        (with(0, "name", json!("a person")), "unknown field `name`"),
        (with(0, "study", json!("0".repeat(64))), "of another study: digest 00000000"),
        (with(0, "code", json!("../../etc")), "is no participant code"),
        (with(0, "slot", json!(49)), "no slot 49"),
        (with(0, "slot", json!(-1)), "line 1: no record"),
        (repeated, "trial 0 begins twice"),
        (early, "`complete` after 3 of 4 trials"),
        (at_once, "trial 1 begins while trial 0 runs"),
        (with(2, "trial", json!(1)), "trial 1 begins before trial 0"),
        (late, "a record after `complete`"),
        (with(2, "trial", json!(4)), "has no trial 4"),
        (with(4, "trial", json!(1)), "trial 1 is not running"),
        (with(5, "outcome", json!("won")), "unknown variant `won`"),
        (with(1, "time", json!("10:30")), "unknown field `time`"),
        (ratings(json!({ "confident": 6 })), "the answers are not those of the form `trust`"),
        (
            ratings(json!({ "confident": 8, "reliable": 1, "trust": 1 })),
            "the form `trust` has no rating 8",
        ),
        (with(8, "form", json!("sus")), "no form `sus` is due there"),
        (with(8, "position", json!(4)), "is not due at position 4"),
    ] {
        let file = write(dir.path(), "bad.jsonl", &records);
        let out = dir.path().join("none");
        let message = export(&plan, &[file], &out).expect_err(words).to_string();
        assert!(message.contains(words), "{words}: {message}");
        assert!(!message.contains('\n') && !out.exists(), "{message}");
    }
    let large = vec![b' '; (16 << 20) + 1];
    let error = ParticipantData::parse(&large, &path).expect_err("too large").to_string();
    assert!(error.contains("the file is longer than 16777216 bytes"), "{error}");
    let twice = [write(dir.path(), "a.jsonl", &good), write(dir.path(), "b.jsonl", &good)];
    let message = export(&plan, &twice, &dir.path().join("none")).expect_err("twice").to_string();
    assert!(message.contains("a second file of participant"), "{message}");
}

#[test]
fn an_incomplete_last_line_is_left_out_and_reported() {
    let (dir, path) = folder_with(SMALL);
    let plan = plan_of(&path).expect("a valid study");
    let records = records(&plan, CODE, 1);
    let whole: Vec<String> = records.iter().map(|record| format!("{record}\n")).collect();
    let file = dir.path().join("a.jsonl");
    let exported = |bytes: &[u8], out: &str| {
        fs::write(&file, bytes).expect("the disk has space");
        export(&plan, std::slice::from_ref(&file), &dir.path().join(out))
    };
    let (before, last) = (whole[..13].concat(), &whole[13]);
    for (k, torn) in [&last[..8], "{\"type\":\"na\u{ef}"].into_iter().enumerate() {
        // The second line ends within a character.
        let text = format!("{before}{torn}");
        let report = exported(&text.as_bytes()[..text.len() - 1], &format!("torn{k}"));
        let report = report.expect("the other records are whole");
        assert_eq!((report.participants, report.completed, report.traces), (1, 0, 1));
        let note = format!("{}, line 14: the line is incomplete and left out", file.display());
        assert_eq!(report.problems, [note]);
    }
    // Only the end of the line is missing.
    let text = whole.concat();
    let report = exported(text.trim_end().as_bytes(), "unterminated").expect("valid records");
    assert_eq!((report.completed, report.problems), (1, Vec::new()));
    // An interrupted write leaves no damage elsewhere.
    let damaged = text.replacen("\"type\":\"instructed\"}", "\"type\":\"instr", 1);
    let message = exported(damaged.as_bytes(), "damaged").expect_err("line 2").to_string();
    assert!(message.contains("a.jsonl, line 2: no record"), "{message}");
    let message = exported(b"{\"type\":\"sta", "empty").expect_err("no record").to_string();
    assert!(message.contains("the first record must be `start`"), "{message}");
    assert!(!dir.path().join("damaged").exists() && !dir.path().join("empty").exists());
}

#[test]
fn a_deleted_participant_leaves_no_bytes_behind() {
    let (dir, path) = folder_with(SMALL);
    let plan = plan_of(&path).expect("a valid study");
    let all = dir.path().join("all");
    fs::create_dir(&all).expect("the disk has space");
    // The name of a file does not matter.
    write(&all, "download (1).jsonl", &records(&plan, CODE, 2));
    let other = write(&all, "other.jsonl", &records(&plan, OTHER, 3));
    export(&plan, std::slice::from_ref(&all), &all.join("out")).expect("valid data");
    let derived = all.join("out").join("lerobot-partner");
    fs::create_dir(&derived).expect("the disk has space");
    fs::write(derived.join("a.mp4"), "images").expect("the disk has space");
    assert_eq!(
        delete(OTHER, &all.join("out")).expect("a code").unsearched,
        std::slice::from_ref(&derived)
    );
    fs::remove_dir_all(&derived).expect("it exists");
    let deleted = delete(CODE, &all).expect("a code");
    assert_eq!(deleted.files.len(), 2, "{deleted:?}");
    assert_eq!(deleted.rows, 3 + 1 + 4, "{deleted:?}");
    assert_eq!(deleted.unsearched, Vec::<PathBuf>::new());
    for entry in chaic_files::walk(&all, 8).expect("a folder") {
        let bytes = fs::read(&entry.path).expect("a file");
        assert!(!String::from_utf8_lossy(&bytes).contains(CODE), "{entry:?}");
        assert!(!entry.path.to_string_lossy().contains(CODE), "{entry:?}");
    }
    assert!(other.exists());
    assert_eq!(delete(CODE, &all).expect("a code").files.len(), 0, "a repetition finds nothing");
    assert!(matches!(delete("..", &all), Err(StudyError::Code(_))));
    assert!(delete(CODE, &dir.path().join("absent")).is_err());
}
