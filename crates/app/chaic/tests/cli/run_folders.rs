//! Promise: forged or booby-trapped run folders make no command wait, read or write through a link, or pass `verify`.
//! A killed merge can be repeated.

use std::fs;
use std::path::{Path, PathBuf};

use crate::*;

const PLAY: [&str; 8] =
    ["eval", "--helper", "none", "--size", "32", "--episodes", "short", "--out"];
const TRACE: &str = "traces/no_constraint/none/gen-0-s0.jsonl";

/// Returns a workshop with a complete run in `run/`.
fn played() -> tempfile::TempDir {
    let dir = workshop();
    well(dir.path(), &[&PLAY[..], &["run"]].concat());
    dir
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("there is room");
    for entry in fs::read_dir(from).expect("it is there") {
        let from = entry.expect("it is there").path();
        let copy = to.join(from.file_name().expect("it has a name"));
        match from.is_dir() {
            true => copy_folder(&from, &copy),
            false => drop(fs::copy(&from, copy).expect("there is room")),
        }
    }
}

/// Sets every result of a run to full marks.
fn win(run: &Path) {
    let path = run.join("results.jsonl");
    let text = fs::read_to_string(&path).expect("it is text");
    let forged = text.lines().map(|line| {
        let mut result: serde_json::Value = serde_json::from_str(line).expect("it is JSON");
        result["done"] = result["total"].clone();
        result.to_string() + "\n"
    });
    fs::write(&path, forged.collect::<String>()).expect("there is room");
}

#[test]
fn better_results_whose_traces_are_folders_are_not_passed() {
    let dir = played();
    let at = dir.path();
    win(&at.join("run"));
    for task in ["no_constraint", "moving_house"] {
        let trace = at.join(TRACE.replace("traces/", "run/traces/").replace("no_constraint", task));
        fs::remove_file(&trace).expect("it is there");
        fs::create_dir(&trace).expect("there is room");
    }
    let said = ill(at, &["eval", "--resume", "--out", "run"]);
    assert!(said.contains("are missing; they are played again"), "{said}");
    let said = ill(at, &["verify", "run"]);
    assert!(said.contains("its trace is not a regular file: it is a folder"), "{said}");
}

#[test]
fn what_verify_finds_in_a_folder_it_names() {
    let dir = played();
    let at = dir.path();
    let run = at.join("run");
    fs::write(run.join(TRACE.replace(".jsonl", ".jsonl.partial")), "").expect("there is room");
    fs::remove_file(run.join("scores.json")).expect("it is there");
    let said = ill(at, &["verify", "run"]);
    for words in ["FOUND run/traces/", "unfinished trace", "other findings in the folder: 1"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(said.contains("MISSING scores.json: write the report by chaic eval"), "{said}");
    fs::remove_file(run.join(TRACE.replace(".jsonl", ".jsonl.partial"))).expect("it is there");
    well(at, &["eval", "--resume", "--out", "run"]);
    well(at, &["verify", "run"]);
}

#[test]
fn a_run_whose_traces_are_gone_is_played_again() {
    let dir = played();
    let at = dir.path();
    let results = fs::read_to_string(at.join("run/results.jsonl")).expect("it is text");
    let trace = fs::read(at.join("run").join(TRACE)).expect("it is there");
    fs::remove_dir_all(at.join("run/traces")).expect("it is there");
    let out = chaic(at, &["eval", "--resume", "--out", "run", "--jobs", "1"]);
    let said = text(&out.stderr);
    assert!(out.status.success(), "{said}");
    let note = "traces of 2 of 2 finished episode runs are missing; they are played again, first ";
    assert!(said.contains(note) && !said.contains("finished already"), "{said}");
    let sorted = |text: &str| {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    let again = fs::read_to_string(at.join("run/results.jsonl")).expect("it is text");
    assert_eq!(sorted(&again), sorted(&results));
    assert_eq!(fs::read(at.join("run").join(TRACE)).expect("it is there"), trace);
    well(at, &["verify", "run"]);
}

#[test]
fn altered_and_cut_traces_are_not_shown_as_if_they_were_whole() {
    let dir = played();
    let at = dir.path();
    let trace = at.join("run").join(TRACE);
    let whole = fs::read_to_string(&trace).expect("it is text");
    let replay = ["replay", "run", "no_constraint/gen/0", "--every", "40", "--out", "r.gif"];
    let export = ["export", "lerobot", "run", "--agent", "partner", "--image-size", "32", "--out"];

    fs::write(&trace, whole.replacen("\"turn_left\"", "\"turn_right\"", 1)).expect("there is room");
    let said = ill(at, &[&export[..], &["altered"]].concat());
    assert!(said.contains("a trace was altered, so nothing is exported"), "{said}");
    assert!(said.contains("gen-0-s0.jsonl") && !at.join("altered").exists(), "{said}");
    assert!(ill(at, &replay).contains("the trace was altered"));

    let before_end = whole.trim_end().rfind('\n').expect("it has lines") + 1;
    let behind_end = format!("{whole}{}", &whole[before_end..]);
    for (k, cut) in
        [&whole[..before_end], &whole[..whole.len() - 5], &behind_end].iter().enumerate()
    {
        fs::write(&trace, cut).expect("there is room");
        let data = format!("cut{k}");
        let out = chaic(at, &[&export[..], &[&data]].concat());
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{said}");
        assert!(said.contains("gen-0-s0.jsonl: ") && said.contains("left out 1 trace"), "{said}");
        assert!(text(&out.stdout).contains("1 episode, "), "the other one");
        let out = chaic(at, &replay);
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{said}");
        assert!(said.contains("gen-0-s0.jsonl: "), "{said}");
    }
    let of_task = [&export[..], &["none", "--task", "no_constraint"]].concat();
    assert!(ill(at, &of_task).contains("has no such episodes"));
    fs::write(&trace, whole).expect("there is room");
    well(at, &[&export[..], &["whole"]].concat());
    well(at, &replay);
}

#[cfg(unix)]
mod traps {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;

    fn pipe(path: &Path) {
        fs::remove_file(path).expect("it is there");
        assert!(Command::new("mkfifo").arg(path).status().expect("there is a mkfifo").success());
    }

    #[test]
    fn no_command_waits_for_a_pipe_or_reads_without_end() {
        let dir = played();
        let at = dir.path();
        let commands: [&[&str]; 6] = [
            &["verify", "trap"],
            &["report", "trap"],
            &["eval", "--resume", "--out", "trap"],
            &["merge", "--out", "merged", "trap"],
            &["replay", "trap", "no_constraint/gen/0", "--out", "r.gif"],
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
                        fs::remove_file(&path).expect("it is there");
                        symlink("/dev/zero", &path).expect("there is room");
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
                    let out = chaic(at, command);
                    let said = text(&out.stderr) + &text(&out.stdout);
                    assert_eq!(out.status.success(), !reads_it, "{command:?} {name}: {said}");
                    if command[0] == "eval" && name == TRACE {
                        // The trace was played again.
                        well(at, &["verify", "trap"]);
                        fs::remove_file(&path).expect("it is there");
                        symlink("/dev/zero", &path).expect("there is room");
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
        fs::rename(&journal, at.join("mine")).expect("it is there");
        // A torn record, which resuming cuts off.
        fs::write(at.join("mine"), "dear").expect("there is room");
        symlink(at.join("mine"), &journal).expect("there is room");
        let said = ill(at, &["eval", "--resume", "--out", "run"]);
        assert!(said.contains("results.jsonl: it is a link"), "{said}");
        assert_eq!(fs::read(at.join("mine")).expect("it is there"), b"dear");

        let dir = played();
        let at = dir.path();
        fs::write(at.join("mine"), "dear").expect("there is room");
        for name in ["scores.json", "report.md", "figure.svg"] {
            let path = at.join("run").join(name);
            fs::remove_file(&path).expect("it is there");
            symlink(at.join("mine"), &path).expect("there is room");
            symlink(at.join("mine"), at.join(format!("run/{name}.tmp"))).expect("there is room");
        }
        symlink(at.join("mine"), at.join("r.gif.partial")).expect("there is room");
        well(at, &["eval", "--resume", "--out", "run"]);
        well(at, &["replay", "run", "no_constraint/gen/0", "--every", "40", "--out", "r.gif"]);
        well(at, &["verify", "run"]);
        assert_eq!(fs::read(at.join("mine")).expect("it is there"), b"dear");
    }

    #[test]
    fn what_a_user_names_may_be_a_link() {
        let dir = played();
        let at = dir.path();
        symlink("run", at.join("latest")).expect("there is room");
        symlink("short", at.join("episodes")).expect("there is room");
        well(at, &["verify", "latest"]);
        well(at, &["eval", "--resume", "--out", "latest", "--episodes", "episodes"]);
        fs::create_dir(at.join("linked")).expect("there is room");
        let episode = at.join("short/no_constraint-0.json");
        symlink(episode, at.join("linked/no_constraint-0.json")).expect("there is room");
        well(at, &["episodes", "validate", "linked/no_constraint-0.json"]);
    }

    /// Lists the files below a folder.
    fn files(folder: &Path) -> Vec<PathBuf> {
        let found = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
        found.flat_map(|p| if p.is_dir() { files(&p) } else { vec![p] }).collect()
    }

    /// The assertions hold for any moment of the kill.
    #[test]
    fn a_merge_that_is_killed_is_no_dead_end() {
        let dir = workshop();
        let at = dir.path();
        for shard in ["1", "2"] {
            let (part, of) = (format!("part{shard}"), format!("{shard}/2"));
            well(at, &[&PLAY[..], &[&part, "--seeds", "12", "--shard", &of]].concat());
        }
        let merge = |out: &str| -> Vec<String> {
            ["merge", "--out", out, "part1", "part2"].map(str::to_owned).to_vec()
        };
        let arguments = |out: &str| merge(out);
        let run = |out: &str| {
            let arguments = arguments(out);
            well(at, &arguments.iter().map(String::as_str).collect::<Vec<_>>())
        };
        let printed = run("reference");
        well(at, &["verify", "reference"]);
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
                    let said = ill(at, &["eval", "--resume", "--out", &out]);
                    assert!(said.contains("run the same `chaic merge` again"), "{said}");
                }
                assert_eq!(run(&out), printed, "{n}");
            }
            well(at, &["verify", &out]);
            well(at, &["eval", "--resume", "--out", &out]);
            for name in ["results.jsonl", "run.json", "scores.json", "report.md"] {
                let read =
                    |folder: &str| fs::read(at.join(folder).join(name)).expect("it is there");
                assert_eq!(read(&out), read("reference"), "{n} {name}");
            }
        }
    }
}
