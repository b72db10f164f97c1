//! Promise: after a merge is killed at any moment, the folder is a complete run, or the same merge
//! can be repeated. (Issue 35: leftover `*.tmp` files blocked both merge and resume.)

use super::*;

/// Plays two shards of a run; returns their parent folder and paths.
fn shards(helpers: &TestHelpers) -> (tempfile::TempDir, Vec<PathBuf>) {
    let files = episode_files(&[TaskId::Obstacle], 2);
    let dir = tempfile::tempdir().unwrap();
    let parts = (1..=2).map(|number| {
        let path = dir.path().join(format!("part{number}"));
        let request = request(&files, &["none", "turner"]);
        let (mut part, _) = Run::open(&path, FolderMode::New, &request, helpers).unwrap();
        let shard = Shard::new(number, 2).unwrap();
        assert!(part.play_shard(shard, 1, helpers, &helpers.stop, &mut |_| ()).unwrap());
        path
    });
    let parts = parts.collect();
    (dir, parts)
}

/// Returns names and contents of all files below a folder.
fn files_below(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let found = chaic_files::walk(folder, 9).unwrap().into_iter();
    let name = |path: &Path| path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
    found.map(|e| (name(&e.path), fs::read(&e.path).unwrap())).collect()
}

/// Sorts the files of a merged run by the order in which they are written.
fn in_order(files: &[(String, Vec<u8>)]) -> Vec<(String, Vec<u8>)> {
    let order = ["episodes/", "traces/", "results.jsonl", "scores.json", "report.md", "figure.svg"];
    let order = order.into_iter().chain(["figure.png", "run.json"]);
    let with_prefix =
        |prefix: &'static str| files.iter().filter(move |(name, _)| name.starts_with(prefix));
    let written: Vec<_> = order.flat_map(with_prefix).cloned().collect();
    assert_eq!(written.len() + 1, files.len(), "all but the lock: {files:?}");
    written
}

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_merge_that_was_stopped_at_any_step_is_repeated_or_complete() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let reference = dir.path().join("reference");
    drop(merge(&reference, &parts).unwrap());
    let whole = files_below(&reference);
    assert!(!reference.join(".merging").exists());
    let steps = in_order(&whole);
    for n_done in 0..=steps.len() {
        for leaves_unfinished in [false, true] {
            let out = dir.path().join(format!("{n_done}-{leaves_unfinished}"));
            for name in [".lock", ".merging"] {
                write(&out, name, b"");
            }
            for (name, bytes) in &steps[..n_done] {
                write(&out, name, bytes);
            }
            if let Some((name, bytes)) = steps.get(n_done).filter(|_| leaves_unfinished) {
                let half = &bytes[..bytes.len() / 2];
                match name.contains('/') {
                    true => write(&out, name, half),
                    false => write(&out, &format!("{name}.tmp"), half),
                }
            }
            if n_done == steps.len() {
                let (folder, options) = RunFolder::read(&out).unwrap();
                let report = crate::verify::verify_run(&folder, &options, &helpers, 1, &|_| ());
                assert!(report.unwrap().has_passed(), "only the marker is left");
                let request = RunRequest::default();
                drop(Run::open(&out, FolderMode::Resume, &request, &helpers).unwrap());
            } else {
                for access in [FolderMode::New, FolderMode::Resume] {
                    let error = RunFolder::lock(&out, access).unwrap_err();
                    assert!(
                        matches!(error, EvalError::InterruptedMerge { .. }),
                        "{n_done}: {error}"
                    );
                }
                let error = RunFolder::check_started(&out).unwrap_err();
                assert!(error.to_string().contains("run the same `chaic merge` again"), "{error}");
                drop(merge(&out, &parts).unwrap());
            }
            assert_eq!(files_below(&out), whole, "{n_done} {leaves_unfinished}");
        }
    }
    // Before the first step.
    for (k, names) in [&[][..], &[".lock"]].iter().enumerate() {
        let out = dir.path().join(format!("first{k}"));
        fs::create_dir(&out).unwrap();
        names.iter().for_each(|name| write(&out, name, b""));
        drop(merge(&out, &parts).unwrap());
        assert_eq!(files_below(&out), whole);
    }
}

#[test]
fn a_partly_cleared_merge_is_repeated() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let reference = dir.path().join("reference");
    drop(merge(&reference, &parts).unwrap());
    let whole = files_below(&reference);
    let left = [
        "episodes/a.json",
        "traces/x/y/z.jsonl",
        "results.jsonl.tmp",
        "scores.json",
        "run.json.tmp",
    ];
    for subset in 0..1_u32 << left.len() {
        let out = dir.path().join(subset.to_string());
        write(&out, ".lock", b"");
        write(&out, ".merging", b"");
        for (_, name) in left.iter().enumerate().filter(|(k, _)| subset >> k & 1 == 1) {
            write(&out, name, b"{ torn");
        }
        drop(merge(&out, &parts).unwrap());
        assert_eq!(files_below(&out), whole, "{subset}");
    }
}

#[test]
fn a_merge_removes_files_of_merges_only() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let cases: [&[&str]; 4] = [
        &["letter.txt"],
        &[".lock", "results.jsonl"],
        &[".lock", ".merging", "letter.txt"],
        &[".lock", ".merging", "run.json"],
    ];
    for (k, names) in cases.iter().enumerate() {
        let out = dir.path().join(k.to_string());
        names.iter().for_each(|name| write(&out, name, b"dear"));
        let before = files_below(&out);
        let error = merge(&out, &parts).unwrap_err();
        assert!(matches!(error, EvalError::NotEmpty { .. }), "{names:?}: {error}");
        let kept = |(name, _): &(String, Vec<u8>)| name != ".lock";
        assert!(files_below(&out).iter().filter(|f| kept(f)).eq(before.iter().filter(|f| kept(f))));
    }
}

#[test]
fn a_merge_copies_regular_files_only_and_no_result_without_its_trace() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let folder = RunFolder::read(&parts[1]).unwrap().0;
    let trace = folder.traces().unwrap().remove(0);
    let bytes = fs::read(&trace).unwrap();
    let refused = |name: &str| {
        let out = dir.path().join(name);
        let error = merge(&out, &parts).unwrap_err().to_string();
        assert!(error.contains("has no trace of obstacle/short/"), "{error}");
        assert!(error.contains("chaic eval --resume --out"), "{error}");
        assert!(!out.exists());
    };
    fs::remove_file(&trace).unwrap();
    refused("missing");
    fs::create_dir(&trace).unwrap();
    refused("folder");
    fs::remove_dir(&trace).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("/etc/passwd", &trace).unwrap();
        refused("link");
        fs::remove_file(&trace).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&trace).status().unwrap().success());
        refused("pipe");
        fs::remove_file(&trace).unwrap();
    }
    fs::write(&trace, bytes).unwrap();
    #[cfg(unix)]
    {
        let copy = chaic_files::entries(&parts[0].join("episodes")).unwrap().remove(0);
        fs::rename(&copy, dir.path().join("moved")).unwrap();
        std::os::unix::fs::symlink(dir.path().join("moved"), &copy).unwrap();
        let error = merge(&dir.path().join("linked"), &parts).unwrap_err().to_string();
        assert!(error.contains("it is a link"), "{error}");
        assert!(!dir.path().join("linked").exists());
        fs::remove_file(&copy).unwrap();
        fs::rename(dir.path().join("moved"), &copy).unwrap();
    }
    drop(merge(&dir.path().join("good"), &parts).unwrap());
}

#[test]
fn parts_with_other_episodes_or_results_are_refused() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let out = dir.path().join("out");
    let refused = || {
        let error = merge(&out, &parts).unwrap_err().to_string();
        assert!(!out.exists(), "{error}");
        error
    };
    // Another version of an episode.
    let copy = chaic_files::entries(&parts[1].join("episodes")).unwrap().remove(0);
    let text = fs::read_to_string(&copy).unwrap();
    fs::write(&copy, text.replacen("\"split\": \"short\"", "\"split\": \"other\"", 1)).unwrap();
    assert_ne!(fs::read_to_string(&copy).unwrap(), text);
    assert!(refused().contains("have other episode files"));
    // One episode is missing.
    fs::remove_file(&copy).unwrap();
    assert!(refused().contains("have other episode files"));
    fs::write(&copy, text).unwrap();
    // A result of an unplanned episode run.
    let journal = parts[1].join("results.jsonl");
    let lines = fs::read_to_string(&journal).unwrap();
    let unplanned = lines.lines().next().unwrap().replacen("obstacle/short/", "obstacle/long/", 1);
    fs::write(&journal, format!("{lines}{unplanned}\n")).unwrap();
    assert!(refused().contains("which this run doesn't play"));
    fs::write(&journal, lines).unwrap();
    drop(merge(&out, &parts).unwrap());
}

#[test]
fn parts_played_with_other_commands_are_refused() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let out = dir.path().join("out");
    let (mine, other) =
        (r#"{"name": "mine", "command": "a.py"}"#, r#"{"name": "other", "command": "b.py"}"#);
    let record = |part: usize, commands: &str| {
        write(&parts[part], "commands.json", commands.as_bytes());
    };
    let refused = || {
        let error = merge(&out, &parts).unwrap_err();
        assert!(error.is_usage() && !out.exists(), "{error}");
        error.to_string()
    };
    // The second part has no commands, others, and no valid ones.
    record(0, &format!("[{mine}, {other}]"));
    assert!(refused().contains("were played with other commands or limits; play all shards with"));
    record(1, &format!("[{mine}]"));
    assert!(refused().contains("were played with other commands"));
    record(1, &format!("[{mine}, {other}").replace("a.py", "c.py"));
    assert!(matches!(merge(&out, &parts), Err(EvalError::Env(EnvError::Unreadable { .. }))));
    record(1, &format!("[{mine}, {other}]").replace("a.py", "c.py"));
    assert!(refused().contains("were played with other commands"));
    // A run that is resumed may name them in another order.
    record(1, &format!("[{other}, {mine}]"));
    drop(merge(&out, &parts).unwrap());
    let commands = |folder: &Path| fs::read(folder.join("commands.json")).unwrap();
    assert_eq!(commands(&out), commands(&parts[0]));
    drop(reopen_merged(&out, &parts).unwrap());
    record(1, &format!("[{other}]"));
    let error = reopen_merged(&out, &parts).unwrap_err();
    assert!(matches!(error, EvalError::NotEmpty { .. }), "{error}");
}

#[test]
fn a_result_is_merged_if_one_of_the_parts_has_its_trace() {
    let helpers = TestHelpers::new();
    let (dir, parts) = shards(&helpers);
    let reference = dir.path().join("reference");
    drop(merge(&reference, &parts).unwrap());
    let copy = dir.path().join("copy");
    files_below(&parts[0]).iter().for_each(|(name, bytes)| write(&copy, name, bytes));
    let trace = RunFolder::read(&copy).unwrap().0.traces().unwrap().remove(0);
    fs::remove_file(trace).unwrap();
    for (name, order) in
        [("before", [&copy, &parts[0], &parts[1]]), ("after", [&parts[0], &parts[1], &copy])]
    {
        let out = dir.path().join(name);
        drop(merge(&out, &order.map(PathBuf::clone)).unwrap());
        assert!(files_below(&out) == files_below(&reference), "the copy comes {name} its original");
    }
    let error = merge(&dir.path().join("out"), &[copy, parts[1].clone()]).unwrap_err();
    assert!(matches!(error, EvalError::Untraced { .. }), "{error}");
}

#[test]
fn results_without_traces_are_played_again() {
    let files = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let dir = tempfile::tempdir().unwrap();
    let (path, helpers) = (dir.path().join("run"), TestHelpers::new());
    let request = request(&files, &["none", "turner"]);
    let (mut run, _) = Run::open(&path, FolderMode::New, &request, &helpers).unwrap();
    assert!(play(&mut run, 1, &helpers));
    assert_eq!(run.untraced_note(), None);
    drop(run);
    let whole = files_below(&path);
    let traces = RunFolder::read(&path).unwrap().0.traces().unwrap();
    let journal = path.join("results.jsonl");
    let sorted_lines = |text: &str| {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    let before = fs::read_to_string(&journal).unwrap();
    for removed in [&traces[..1], &traces[2..5], &traces[..]] {
        removed.iter().for_each(|trace| fs::remove_file(trace).unwrap());
        let (mut run, _) =
            Run::open(&path, FolderMode::Resume, &RunRequest::default(), &helpers).unwrap();
        let n = removed.len();
        assert_eq!(run.progress(), RunProgress { total: 8, finished: 8 - n, errors: 0 });
        let note = run.untraced_note().unwrap();
        assert!(
            note.starts_with(&format!("traces of {n} of 8 finished episode runs are missing")),
            "{note}"
        );
        // The old results stay until the episodes have been played again.
        assert_eq!(fs::read_to_string(&journal).unwrap().len(), before.len());
        assert!(play(&mut run, 2, &helpers));
        assert_eq!(run.untraced_note(), None);
        drop(run);
        let after = fs::read_to_string(&journal).unwrap();
        assert_eq!(sorted_lines(&after), sorted_lines(&before));
        let without_results = |files: &[(String, Vec<u8>)]| {
            let mut files = files.to_vec();
            files.retain(|(name, _)| name != "results.jsonl");
            files
        };
        assert!(without_results(&files_below(&path)) == without_results(&whole), "the same bits");
    }
    // Killed after the last result was appended, before the journal was rewritten.
    let twice = before.lines().next().unwrap().to_owned() + "\n";
    fs::write(&journal, before.clone() + &twice).unwrap();
    drop(Run::open(&path, FolderMode::Resume, &RunRequest::default(), &helpers).unwrap());
    assert_eq!(sorted_lines(&fs::read_to_string(&journal).unwrap()), sorted_lines(&before));
}
