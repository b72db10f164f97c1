//! Promise: a small sample of every measurement of docs/reliability.md passes, and a broken promise is
//! reported.

use std::process::{Command, Output};

fn reliability(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_chaic-reliability"));
    command.args(arguments).output().expect("the program starts")
}

fn run_ok(arguments: &[&str]) -> String {
    let output = reliability(arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn file_faults_of_a_merge_and_of_seals_leave_no_corrupt_result() {
    let table = run_ok(&["faults", "merge", "seal", "secret", "--every", "60"]);
    assert_eq!(table.lines().count(), 5, "{table}");
    let n_failures = |line: &str| line.split('|').nth(4).map(|cell| cell.trim().to_owned());
    assert!(table.lines().skip(2).all(|line| n_failures(line).as_deref() == Some("0")), "{table}");
}

#[test]
fn a_fault_ends_the_command_or_is_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("e");
    let generate = ["episodes", "generate", "--task", "shopping", "--seeds", "0..1", "--out"];
    let run = |fault: &str| {
        let out = out.to_str().expect("the path is UTF-8");
        let temporary = format!("{out}/shopping-0.json.tmp");
        let plan = ["chaic", "--fault", fault, "--path", &temporary, "--at", "1", "--"];
        reliability(&[&plan[..], &generate[..], &[out]].concat())
    };
    let crashed = run("crash-before");
    assert_eq!(crashed.status.code(), Some(86));
    assert!(!out.join("shopping-0.json").exists());
    let full = run("no-space");
    let error = String::from_utf8_lossy(&full.stderr).into_owned();
    assert_eq!(full.status.code(), Some(1), "{error}");
    assert!(error.starts_with("error: can't write") && error.lines().count() == 1, "{error}");
    let power = run("power-failure");
    assert_eq!(power.status.code(), Some(86));
    let temporary = std::fs::read(out.join("shopping-0.json.tmp")).expect("a file without content");
    assert!(temporary.is_empty() && !out.join("shopping-0.json").exists());
}

/// A drawn secret has a temporary file with the id of its process.
#[test]
fn a_fault_hits_the_temporary_file_of_its_process() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (secret, out, log) = (path("s"), path("sealed"), path("operations"));
    let seal = |options: &[&str]| {
        let command = ["--", "episodes", "seal", "--task", "shopping", "--n-episodes", "1"];
        let files = ["--secret", &secret, "--out", &out];
        reliability(&[&["chaic"][..], options, &command[..], &files[..]].concat())
    };
    let temporary = format!("{secret}.PROCESS.tmp");
    let crashed = seal(&["--fault", "crash-before", "--path", &temporary, "--at", "1"]);
    assert_eq!(crashed.status.code(), Some(86));
    assert!(!folder.path().join("s").exists());
    assert!(seal(&["--log", &log]).status.success());
    let operations = std::fs::read_to_string(&log).expect("the list of operations");
    assert!(operations.contains(&format!("Rename\t{temporary}\n")), "{operations}");
}

#[test]
fn killed_commands_are_completed() {
    run_ok(&["kills", "merge", "--kills", "1"]);
}

#[test]
fn no_parser_breaks_on_its_corpus_and_a_few_changes() {
    let table = run_ok(&["fuzz", "--inputs", "100", "--seconds", "600"]);
    assert!(table.lines().count() > 15, "{table}");
}
