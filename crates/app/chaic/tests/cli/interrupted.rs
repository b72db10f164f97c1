//! What is left when a command is stopped, or its reader leaves.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::*;

#[test]
fn a_reader_that_leaves_is_no_error() {
    let dir = tempfile::tempdir().expect("there is room");
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
fn a_list_without_end_ends_with_its_reader() {
    use std::io::Read as _;
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    let list = ["episodes", "list", "--task", "moving_house", "--split"];
    for (format, begin) in [("table", "┌"), ("json", "[\n  {\n")] {
        // So many take years.
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
    // More than one table, and still one JSON.
    let some = [&list[..], &["gen:0..97", "--format"]].concat();
    let tables = well(at, &[&some[..], &["table"]].concat());
    assert_eq!(tables.matches("Episode").count(), 2, "{tables}");
    assert_eq!(tables.matches("moving_house/gen/").count(), 97, "{tables}");
    let json = well(at, &[&some[..], &["json"]].concat());
    let json: Vec<serde_json::Value> = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json.len(), 97);
    assert_eq!(json[96]["id"], "moving_house/gen/96");
}

/// Waits until something is under way below `path`.
#[cfg(unix)]
fn until_under_way(path: &Path) {
    use std::time::{Duration, Instant};
    let began = Instant::now();
    let is_under_way = || files(path).iter().any(|p| p.ends_with(".partial"));
    while !is_under_way() {
        assert!(began.elapsed() < Duration::from_secs(60), "nothing begins");
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
fn an_interrupted_run_goes_on() {
    let dir = workshop();
    let at = dir.path();
    // Longer than the moment between beginning and signal.
    let long = ["eval", "--task", "no_constraint", "--first", "1", "--helper", "none,rhp"];
    for (signal, code) in [("-INT", Some(130)), ("-KILL", None)] {
        let out = format!("run{signal}");
        let mut arguments = long.to_vec();
        arguments.extend(["--jobs", "1", "--out", &out]);
        let child = start(at, &arguments);
        until_under_way(&at.join(&out).join("traces"));
        // While it runs, nobody else may.
        let second = ill(at, &["eval", "--resume", "--out", &out]);
        assert!(second.contains("in use by another"), "{second}");
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("there is a kill");
        assert!(sent.success());
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), code);
        if code.is_some() {
            let said = text(&ended.stderr);
            assert!(said.contains(&format!("chaic eval --resume --out {out}")), "{said}");
        }
        assert!(ill(at, &["report", &out]).contains("no finished episode"));
    }
}

#[cfg(unix)]
#[test]
fn interrupted_generation_leaves_whole_episodes_and_says_how_to_go_on() {
    let dir = tempfile::tempdir().expect("there is room");
    let at = dir.path();
    let generate =
        ["episodes", "generate", "--task", "shopping", "--seeds", "0..1000000", "--out", "g"];
    let child = start(at, &generate);
    let began = std::time::Instant::now();
    while !files(&at.join("g")).iter().any(|name| name.ends_with(".json")) {
        assert!(began.elapsed().as_secs() < 60, "nothing begins");
        std::thread::yield_now();
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("there is a kill").success());
    let ended = child.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(130));
    let made = files(&at.join("g"));
    let said = text(&ended.stderr);
    assert!(said.contains(&format!("--seeds {}..1000000 makes the rest", made.len())), "{said}");
    let validate: Vec<&str> =
        ["episodes", "validate"].into_iter().chain(made.iter().map(String::as_str)).collect();
    well(at, &validate);
}

#[cfg(unix)]
#[test]
fn an_interrupted_replay_leaves_no_torn_video() {
    let dir = workshop();
    let at = dir.path();
    well(at, &["eval", "--episodes", "short", "--helper", "none", "--size", "48", "--out", "run"]);
    for (signal, code) in [("-INT", Some(130)), ("-KILL", None)] {
        let out = format!("video{signal}/r.gif");
        fs::create_dir(at.join(format!("video{signal}"))).expect("there is room");
        fs::write(at.join(&out), "an older one").expect("there is room");
        let replay = ["replay", "run", "no_constraint/gen/0", "--every", "1", "--out", &out];
        let child = start(at, &replay);
        until_under_way(&at.join(format!("video{signal}")));
        let id = child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("there is a kill");
        assert!(sent.success());
        let ended = child.wait_with_output().expect("it ends");
        assert_eq!(ended.status.code(), code);
        let said = text(&ended.stderr);
        assert_eq!(said.contains("r.gif is not written"), code.is_some(), "{said}");
        assert_eq!(fs::read(at.join(&out)).expect("it is there"), b"an older one");
        // What Ctrl-C leaves is what was there.
        let left = files(&at.join(format!("video{signal}")));
        assert_eq!(left.len(), if code.is_some() { 1 } else { 2 }, "{left:?}");
    }
}
