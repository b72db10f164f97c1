//! Promise: with forged run folders no command blocks, or reads or writes through a link, and none passes `verify`.
//! A killed merge can be repeated.

use std::fs;
use std::path::{Path, PathBuf};

use crate::*;

const PLAY: [&str; 8] =
    ["eval", "--helper", "none", "--size", "32", "--episodes", "short", "--out"];
const TRACE: &str = "traces/no_constraint/none/gen-0-s0.jsonl";

/// Returns a folder with short episodes and a complete run in `run/`.
fn played() -> tempfile::TempDir {
    let dir = short_episodes();
    run_ok(dir.path(), &[&PLAY[..], &["run"]].concat());
    dir
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("the disk has space");
    for entry in fs::read_dir(from).expect("it exists") {
        let from = entry.expect("it exists").path();
        let copy = to.join(from.file_name().expect("it has a name"));
        match from.is_dir() {
            true => copy_folder(&from, &copy),
            false => drop(fs::copy(&from, copy).expect("the disk has space")),
        }
    }
}

/// Sets every result of a run to the maximum.
fn win(run: &Path) {
    let path = run.join("results.jsonl");
    let text = fs::read_to_string(&path).expect("a text file");
    let forged = text.lines().map(|line| {
        let mut result: serde_json::Value = serde_json::from_str(line).expect("it is JSON");
        result["done"] = result["total"].clone();
        result.to_string() + "\n"
    });
    fs::write(&path, forged.collect::<String>()).expect("the disk has space");
}

#[test]
fn forged_results_whose_traces_are_folders_fail_verification() {
    let dir = played();
    let at = dir.path();
    win(&at.join("run"));
    for task in ["no_constraint", "moving_house"] {
        let trace = at.join(TRACE.replace("traces/", "run/traces/").replace("no_constraint", task));
        fs::remove_file(&trace).expect("it exists");
        fs::create_dir(&trace).expect("the disk has space");
    }
    let message = run_err(at, &["eval", "--resume", "--out", "run"]);
    assert!(message.contains("are missing; they are played again"), "{message}");
    let message = run_err(at, &["verify", "run"]);
    assert!(message.contains("its trace is not a regular file: it is a folder"), "{message}");
}

#[test]
fn verify_names_the_findings_in_a_folder() {
    let dir = played();
    let at = dir.path();
    let run = at.join("run");
    fs::write(run.join(TRACE.replace(".jsonl", ".jsonl.partial")), "").expect("the disk has space");
    fs::remove_file(run.join("scores.json")).expect("it exists");
    let message = run_err(at, &["verify", "run"]);
    for words in ["FOUND run/traces/", "unfinished trace", "other findings in the folder: 1"] {
        assert!(message.contains(words), "{words}: {message}");
    }
    assert!(message.contains("MISSING scores.json: write the report with chaic eval"), "{message}");
    fs::remove_file(run.join(TRACE.replace(".jsonl", ".jsonl.partial"))).expect("it exists");
    run_ok(at, &["eval", "--resume", "--out", "run"]);
    run_ok(at, &["verify", "run"]);
}

#[test]
fn episode_runs_without_traces_are_played_again() {
    let dir = played();
    let at = dir.path();
    let results = fs::read_to_string(at.join("run/results.jsonl")).expect("a text file");
    let trace = fs::read(at.join("run").join(TRACE)).expect("it exists");
    fs::remove_dir_all(at.join("run/traces")).expect("it exists");
    let out = output_of(at, &["eval", "--resume", "--out", "run", "--jobs", "1"]);
    let message = text(&out.stderr);
    assert!(out.status.success(), "{message}");
    let note = "traces of 2 of 2 finished episode runs are missing; they are played again, first ";
    assert!(message.contains(note) && !message.contains("finished already"), "{message}");
    let sorted = |text: &str| {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    let again = fs::read_to_string(at.join("run/results.jsonl")).expect("a text file");
    assert_eq!(sorted(&again), sorted(&results));
    assert_eq!(fs::read(at.join("run").join(TRACE)).expect("it exists"), trace);
    run_ok(at, &["verify", "run"]);
}

#[test]
fn failed_episode_runs_count_as_zero_in_reports_from_traces() {
    let dir = played();
    let at = dir.path();
    let journal = at.join("run/results.jsonl");
    let lines = fs::read_to_string(&journal).expect("a text file");
    let line = |line: &str| {
        let mut result: serde_json::Value = serde_json::from_str(line).expect("it is JSON");
        if result["task"] == "no_constraint" {
            let key = ["task", "helper", "episode", "seed"];
            result.as_object_mut().expect("fields").retain(|name, _| key.contains(&name.as_str()));
            result["status"] = "error".into();
            result["message"] = "the episode broke down: out of ideas".into();
        }
        result.to_string() + "\n"
    };
    fs::write(&journal, lines.lines().map(line).collect::<String>()).expect("the disk has space");
    fs::remove_file(at.join("run").join(TRACE)).expect("it exists");
    let report = run_ok(at, &["report", "run", "--from-traces", "--format", "json"]);
    assert_eq!(report, run_ok(at, &["report", "run", "--format", "json"]));
    let report: serde_json::Value = serde_json::from_str(&report).expect("it is JSON");
    let counts = serde_json::json!({"planned": 2, "scored": 2, "broken": 1, "missing": 0});
    assert_eq!(report["episode_runs"], counts);
}

#[test]
fn traces_of_other_episode_runs_are_left_out() {
    let dir = played();
    let at = dir.path();
    let trace = at.join("run").join(TRACE);
    let report = || {
        let out = output_of(at, &["report", "run", "--from-traces", "--format", "json"]);
        assert!(out.status.success(), "{out:?}");
        (text(&out.stdout), text(&out.stderr))
    };
    let (whole, warnings) = report();
    assert!(!warnings.contains("left out"), "{warnings}");
    // A copy with the name of a seed that the run does not have.
    let unplanned = trace.with_file_name("gen-0-s7.jsonl");
    fs::copy(&trace, &unplanned).expect("the disk has space");
    let (found, warnings) = report();
    assert_eq!(found, whole);
    let expected =
        "gen-0-s7.jsonl: this run doesn't play that episode run, so its trace is left out";
    assert!(warnings.contains(expected), "{warnings}");
    let export =
        ["export", "lerobot", "run", "--agent", "partner", "--size", "32", "--every", "30"];
    for (command, reply) in [
        (&["view", "run"][..], "2 replays of"),
        (&[&export[..], &["--out", "set"]].concat()[..], "set: 2 episodes"),
    ] {
        let out = output_of(at, command);
        let (reply_found, warnings) = (text(&out.stdout), text(&out.stderr));
        assert!(out.status.success() && reply_found.contains(reply), "{reply_found}{warnings}");
        assert!(warnings.contains(expected), "{warnings}");
    }
    let shown = run_ok(at, &["show", "run", "--format", "json"]);
    let shown: serde_json::Value = serde_json::from_str(&shown).expect("it is JSON");
    assert_eq!(shown["traces"], 2);
    for command in [&["replay", "--out", "r.gif"][..], &["explain"]] {
        let select = ["run", "no_constraint/gen/0", "--seed", "7"];
        let refused = run_err(at, &[&command[..1], &select[..], &command[1..]].concat());
        assert!(refused.contains("and seed 7") && refused.contains("2 traces"), "{refused}");
    }
    fs::remove_file(&unplanned).expect("it exists");
    // A copy in the place of another trace counts neither twice nor as the other one.
    let other = at.join("run").join(TRACE.replace("no_constraint", "moving_house"));
    fs::copy(&trace, other).expect("the disk has space");
    let (found, warnings) = report();
    let expected = "it is the trace of no_constraint/gen/0 with none and seed 0, so it is left out";
    assert!(warnings.contains(expected) && warnings.contains("1 of 2 finished"), "{warnings}");
    let out = output_of(at, &["view", "run"]);
    assert!(text(&out.stderr).contains(expected), "{out:?}");
    assert!(text(&out.stdout).contains("1 replay of"), "{out:?}");
    let found: serde_json::Value = serde_json::from_str(&found).expect("it is JSON");
    let counts = serde_json::json!({"planned": 2, "scored": 1, "broken": 0, "missing": 1});
    assert_eq!(found["episode_runs"], counts);
}

#[test]
fn differences_are_of_the_same_episodes_and_name_missing_ones() {
    let dir = played();
    let at = dir.path();
    let compare = ["report", "run", "--baseline", "again"];
    run_ok(at, &[&PLAY[..], &["again"]].concat());
    run_ok(at, &compare);
    let journal = at.join("run/results.jsonl");
    let lines = fs::read_to_string(&journal).expect("a text file");
    let first = lines.lines().next().expect("a result").to_owned() + "\n";
    fs::write(&journal, first).expect("the disk has space");
    let out = output_of(at, &compare);
    assert!(text(&out.stderr).contains("Unfinished: 1 of 2 episode runs"), "{out:?}");
    fs::write(&journal, lines).expect("the disk has space");

    // The same name for another episode.
    for entry in fs::read_dir(at.join("short")).expect("it exists") {
        let path = entry.expect("it exists").path();
        let episode = fs::read_to_string(&path).expect("a text file");
        let longer = episode.replacen("\"horizon\": 80", "\"horizon\": 90", 1);
        assert_ne!(longer, episode);
        fs::write(&path, longer).expect("the disk has space");
    }
    run_ok(at, &[&PLAY[..], &["other"]].concat());
    let out = output_of(at, &["report", "run", "--baseline", "other"]);
    assert_eq!(out.status.code(), Some(2));
    let refused = text(&out.stderr);
    assert!(refused.contains("run and other have different episodes with the name"), "{refused}");
}

#[test]
fn altered_and_cut_traces_are_refused_or_reported() {
    let dir = played();
    let at = dir.path();
    let trace = at.join("run").join(TRACE);
    let whole = fs::read_to_string(&trace).expect("a text file");
    let replay = ["replay", "run", "no_constraint/gen/0", "--every", "40", "--out", "r.gif"];
    let export = ["export", "lerobot", "run", "--agent", "partner", "--image-size", "32", "--out"];

    fs::write(&trace, whole.replacen("\"turn_left\"", "\"turn_right\"", 1))
        .expect("the disk has space");
    let message = run_err(at, &[&export[..], &["altered"]].concat());
    assert!(message.contains("a trace was altered, so nothing is exported"), "{message}");
    assert!(message.contains("gen-0-s0.jsonl") && !at.join("altered").exists(), "{message}");
    assert!(run_err(at, &replay).contains("the trace was altered"));

    let before_end = whole.trim_end().rfind('\n').expect("it has lines") + 1;
    let behind_end = format!("{whole}{}", &whole[before_end..]);
    for (k, cut) in
        [&whole[..before_end], &whole[..whole.len() - 5], &behind_end].iter().enumerate()
    {
        fs::write(&trace, cut).expect("the disk has space");
        let data = format!("cut{k}");
        let out = output_of(at, &[&export[..], &[&data]].concat());
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{message}");
        assert!(
            message.contains("gen-0-s0.jsonl: ") && message.contains("left out 1 trace"),
            "{message}"
        );
        assert!(text(&out.stdout).contains("1 episode, "), "the other one");
        let out = output_of(at, &replay);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{message}");
        assert!(message.contains("gen-0-s0.jsonl: "), "{message}");
    }
    let of_task = [&export[..], &["none", "--task", "no_constraint"]].concat();
    assert!(run_err(at, &of_task).contains("no such trace that is whole; 1 trace cut off"));
    fs::write(&trace, whole).expect("the disk has space");
    run_ok(at, &[&export[..], &["whole"]].concat());
    run_ok(at, &replay);
}

#[cfg(unix)]
mod traps {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;

    fn pipe(path: &Path) {
        fs::remove_file(path).expect("it exists");
        assert!(Command::new("mkfifo").arg(path).status().expect("there is a mkfifo").success());
    }

    #[test]
    fn no_command_blocks_on_a_pipe_or_reads_without_limit() {
        let dir = played();
        let at = dir.path();
        let commands: [&[&str]; 6] = [
            &["verify", "trap"],
            &["report", "trap"],
            &["eval", "--resume", "--out", "trap"],
            &["merge", "--out", "merged", "trap"],
            &["replay", "trap", "no_constraint/gen/0", "--every", "40", "--out", "r.gif"],
            &["export", "lerobot", "trap", "--agent", "partner", "--out", "data"],
        ];
        for name in ["results.jsonl", "run.json", TRACE] {
            for is_pipe in [true, false] {
                let _ = fs::remove_dir_all(at.join("trap"));
                copy_folder(&at.join("run"), &at.join("trap"));
                let path = at.join("trap").join(name);
                match is_pipe {
                    true => pipe(&path),
                    false => {
                        fs::remove_file(&path).expect("it exists");
                        symlink("/dev/zero", &path).expect("the disk has space");
                    }
                }
                for command in commands {
                    let reads_it = match command[0] {
                        // `report` reads no traces, `export` reads no results, and `eval` replaces the
                        // trace.
                        "eval" | "export" => {
                            name != TRACE && (name, command[0]) != ("results.jsonl", "export")
                        }
                        "replay" => name != "results.jsonl",
                        "report" => name != TRACE,
                        _ => true,
                    };
                    let out = output_of(at, command);
                    let message = text(&out.stderr) + &text(&out.stdout);
                    assert_eq!(out.status.success(), !reads_it, "{command:?} {name}: {message}");
                    if command[0] == "eval" && name == TRACE {
                        // The trace was played again.
                        run_ok(at, &["verify", "trap"]);
                        fs::remove_file(&path).expect("it exists");
                        symlink("/dev/zero", &path).expect("the disk has space");
                    }
                    let _ = fs::remove_dir_all(at.join("data"));
                }
                assert!(!at.join("merged").exists());
            }
        }
    }

    #[test]
    fn a_linked_journal_is_not_emptied_and_no_report_is_redirected() {
        let dir = played();
        let at = dir.path();
        let journal = at.join("run/results.jsonl");
        fs::rename(&journal, at.join("mine")).expect("it exists");
        // An incomplete record, which resuming removes.
        fs::write(at.join("mine"), "dear").expect("the disk has space");
        symlink(at.join("mine"), &journal).expect("the disk has space");
        let message = run_err(at, &["eval", "--resume", "--out", "run"]);
        assert!(message.contains("results.jsonl: it is a link"), "{message}");
        assert_eq!(fs::read(at.join("mine")).expect("it exists"), b"dear");

        let dir = played();
        let at = dir.path();
        fs::write(at.join("mine"), "dear").expect("the disk has space");
        for name in ["scores.json", "report.md", "figure.svg"] {
            let path = at.join("run").join(name);
            fs::remove_file(&path).expect("it exists");
            symlink(at.join("mine"), &path).expect("the disk has space");
            symlink(at.join("mine"), at.join(format!("run/{name}.tmp")))
                .expect("the disk has space");
        }
        symlink(at.join("mine"), at.join("r.gif.partial")).expect("the disk has space");
        run_ok(at, &["eval", "--resume", "--out", "run"]);
        run_ok(at, &["replay", "run", "no_constraint/gen/0", "--every", "40", "--out", "r.gif"]);
        run_ok(at, &["verify", "run"]);
        assert_eq!(fs::read(at.join("mine")).expect("it exists"), b"dear");
    }

    #[test]
    fn paths_given_by_the_user_may_be_links() {
        let dir = played();
        let at = dir.path();
        symlink("run", at.join("latest")).expect("the disk has space");
        symlink("short", at.join("episodes")).expect("the disk has space");
        run_ok(at, &["verify", "latest"]);
        run_ok(at, &["eval", "--resume", "--out", "latest", "--episodes", "episodes"]);
        fs::create_dir(at.join("linked")).expect("the disk has space");
        let episode = at.join("short/no_constraint-0.json");
        symlink(episode, at.join("linked/no_constraint-0.json")).expect("the disk has space");
        run_ok(at, &["episodes", "validate", "linked/no_constraint-0.json"]);
    }

    /// Lists the files below a folder.
    fn files(folder: &Path) -> Vec<PathBuf> {
        let found = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        found.flat_map(|p| if p.is_dir() { files(&p) } else { vec![p] }).collect()
    }

    /// The assertions hold at whatever time the process is killed.
    #[test]
    fn a_killed_merge_can_be_repeated() {
        let dir = short_episodes();
        let at = dir.path();
        for shard in ["1", "2"] {
            let (part, of) = (format!("part{shard}"), format!("{shard}/2"));
            run_ok(at, &[&PLAY[..], &[&part, "--seeds", "12", "--shard", &of]].concat());
        }
        let merge = |out: &str| -> Vec<String> {
            ["merge", "--out", out, "part1", "part2"].map(str::to_owned).to_vec()
        };
        let arguments = |out: &str| merge(out);
        let run = |out: &str| {
            let arguments = arguments(out);
            run_ok(at, &arguments.iter().map(String::as_str).collect::<Vec<_>>())
        };
        let printed = run("reference");
        run_ok(at, &["verify", "reference"]);
        let n_files = files(&at.join("reference")).len();
        for n in (0..=n_files).step_by(4) {
            let out = format!("out{n}");
            let arguments = arguments(&out);
            let mut child = start(at, &arguments.iter().map(String::as_str).collect::<Vec<_>>());
            while files(&at.join(&out)).len() < n && child.try_wait().expect("it runs").is_none() {
                std::thread::yield_now();
            }
            child.kill().expect("it can be killed");
            child.wait().expect("it ends");
            if !at.join(&out).join("run.json").exists() {
                if at.join(&out).join(".merging").exists() {
                    let message = run_err(at, &["eval", "--resume", "--out", &out]);
                    assert!(message.contains("run the same `chaic merge` again"), "{message}");
                }
                assert_eq!(run(&out), printed.replace("reference", &out), "{n}");
            }
            run_ok(at, &["verify", &out]);
            run_ok(at, &["eval", "--resume", "--out", &out]);
            for name in ["results.jsonl", "run.json", "scores.json", "report.md"] {
                let read = |folder: &str| fs::read(at.join(folder).join(name)).expect("it exists");
                assert_eq!(read(&out), read("reference"), "{n} {name}");
            }
        }
    }
}
