//! Promises on interrupted commands and closed pipes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::*;

#[test]
fn a_closed_pipe_is_not_an_error() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let mut child = command(dir.path(), &["episodes", "schema"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let out = child.wait_with_output().expect("it ends");
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert_eq!(text(&out.stderr), "");
}

#[test]
fn an_endless_list_ends_when_the_pipe_is_closed() {
    use std::io::Read as _;
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let list = ["episodes", "list", "--task", "moving_house", "--split"];
    for (format, begin) in [("table", "┌"), ("json", "[\n  {\n")] {
        // All of these would take years.
        let endless = [&list[..], &["gen:0..100000000000", "--format", format]].concat();
        let mut child = start(at, &endless);
        let mut out = child.stdout.take().expect("it is piped");
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let mut read = vec![0; begin.len()];
            let _ = sender.send(out.read_exact(&mut read).map(|()| read));
        });
        let read = receiver.recv_timeout(std::time::Duration::from_secs(120));
        if read.is_err() {
            child.kill().expect("it runs");
        }
        let read = read.expect("it prints while it goes").expect("it prints");
        assert_eq!(text(&read), begin);
        let ended = child.wait_with_output().expect("it ends");
        assert!(ended.status.success(), "{}", text(&ended.stderr));
        assert_eq!(text(&ended.stderr), "");
    }
    // Several tables, but one JSON document.
    let some = [&list[..], &["gen:0..97", "--format"]].concat();
    let tables = run_ok(at, &[&some[..], &["table"]].concat());
    assert_eq!(tables.matches("Episode").count(), 2, "{tables}");
    assert_eq!(tables.matches("moving_house/gen/").count(), 97, "{tables}");
    let json = run_ok(at, &[&some[..], &["json"]].concat());
    let json: Vec<serde_json::Value> = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json.len(), 97);
    assert_eq!(json[96]["id"], "moving_house/gen/96");
}

/// Waits until there is an unfinished file below `path`.
#[cfg(unix)]
fn wait_for_partial_file(path: &Path) {
    use std::time::{Duration, Instant};
    let began = Instant::now();
    let is_under_way = || files(path).iter().any(|p| p.ends_with(".partial"));
    while !is_under_way() {
        assert!(began.elapsed() < Duration::from_secs(60), "nothing starts");
        std::thread::yield_now();
    }
}

#[cfg(unix)]
fn files(folder: &Path) -> Vec<String> {
    let entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    entries
        .into_iter()
        .flat_map(|p| if p.is_dir() { files(&p) } else { vec![p.display().to_string()] })
        .collect()
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_names_the_command_that_resumes_it() {
    let dir = short_episodes();
    let at = dir.path();
    // Long enough to receive the signal while it runs.
    let long = ["eval", "--task", "no_constraint", "--first", "1", "--helper", "none,rhp"];
    for (signal, code) in [("-INT", Some(130)), ("-KILL", None)] {
        let out = format!("run{signal}");
        let mut arguments = long.to_vec();
        arguments.extend(["--jobs", "1", "--out", &out]);
        let child = start(at, &arguments);
        wait_for_partial_file(&at.join(&out).join("traces"));
        // The folder is locked while the run is played.
        let second = run_err(at, &["eval", "--resume", "--out", &out]);
        assert!(second.contains("in use by another"), "{second}");
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("there is a kill");
        assert!(sent.success());
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), code);
        if code.is_some() {
            let message = text(&ended.stderr);
            assert!(message.contains(&format!("chaic eval --resume --out {out}")), "{message}");
        }
        assert!(run_err(at, &["report", &out]).contains("no finished episode"));
    }
}

#[cfg(unix)]
#[test]
fn interrupted_generation_leaves_valid_episodes_and_names_the_rest() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let generate =
        ["episodes", "generate", "--task", "shopping", "--seeds", "0..1000000", "--out", "g"];
    let child = start(at, &generate);
    let began = std::time::Instant::now();
    while !files(&at.join("g")).iter().any(|name| name.ends_with(".json")) {
        assert!(began.elapsed().as_secs() < 60, "nothing starts");
        std::thread::yield_now();
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("there is a kill").success());
    let ended = child.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(130));
    let made = files(&at.join("g"));
    let message = text(&ended.stderr);
    assert!(
        message.contains(&format!("--seeds {}..1000000 makes the rest", made.len())),
        "{message}"
    );
    let validate: Vec<&str> =
        ["episodes", "validate"].into_iter().chain(made.iter().map(String::as_str)).collect();
    run_ok(at, &validate);
}

#[cfg(unix)]
#[test]
fn an_interrupted_replay_leaves_no_torn_video() {
    let dir = short_episodes();
    let at = dir.path();
    run_ok(
        at,
        &["eval", "--episodes", "short", "--helper", "none", "--size", "48", "--out", "run"],
    );
    for (signal, code) in [("-INT", Some(130)), ("-KILL", None)] {
        let out = format!("video{signal}/r.gif");
        fs::create_dir(at.join(format!("video{signal}"))).expect("the disk has space");
        fs::write(at.join(&out), "an older one").expect("the disk has space");
        let replay = ["replay", "run", "no_constraint/gen/0", "--every", "1", "--out", &out];
        let child = start(at, &replay);
        wait_for_partial_file(&at.join(format!("video{signal}")));
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("there is a kill");
        assert!(sent.success());
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), code);
        let message = text(&ended.stderr);
        assert_eq!(message.contains("r.gif is not written"), code.is_some(), "{message}");
        assert_eq!(fs::read(at.join(&out)).expect("it exists"), b"an older one");
        // Ctrl-C does not change the older file.
        let left = files(&at.join(format!("video{signal}")));
        assert_eq!(left.len(), if code.is_some() { 1 } else { 2 }, "{left:?}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_evaluation_of_a_detector_says_so() {
    use std::io::{BufRead as _, BufReader, Read as _};
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let evaluate = ["eval", "detection", "--views", "100000", "--jobs", "1"];
    let mut child = start(at, &[&evaluate[..], &["--json", "report.json"]].concat());
    let mut messages = BufReader::new(child.stderr.take().expect("it is piped"));
    let mut message = String::new();
    messages.read_line(&mut message).expect("it names the number of views when it starts");
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().expect("there is a kill").success());
    messages.read_to_string(&mut message).expect("it is text");
    assert_eq!(child.wait().expect("it ends").code(), Some(130), "{message}");
    assert!(message.contains("stopped; nothing was written\n"), "{message}");
    assert!(!at.join("report.json").exists());
}
