//! Links and special files in the folder of a run.

use std::os::unix::fs::symlink;

use super::*;

/// Moves an entry out of the run and puts a link in its place.
fn link(run: &Path, name: &str) {
    let moved = run.with_extension("moved");
    fs::rename(run.join(name), &moved).unwrap();
    symlink(&moved, run.join(name)).unwrap();
}

fn pipe(path: PathBuf) {
    let _ = fs::remove_file(&path);
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

fn endless(path: PathBuf) {
    fs::remove_file(&path).unwrap();
    symlink("/dev/zero", path).unwrap();
}

const ATTACKS: &[Attack] = &[
    (
        "trace is a pipe",
        Rewritten,
        "its trace is not a regular file: it is no regular file",
        |run| {
            maximize_score(run);
            pipe(run.join(TRACE));
        },
    ),
    (
        "trace leads to /dev/zero",
        Rewritten,
        "its trace is not a regular file: it is a link",
        |run| {
            maximize_score(run);
            endless(run.join(TRACE));
        },
    ),
    ("trace is a link", Rewritten, "its trace is not a regular file: it is a link", |run| {
        link(run, TRACE)
    }),
    (
        "trace is a dangling link",
        Rewritten,
        "its trace is not a regular file: it is a link",
        |run| {
            fs::remove_file(run.join(TRACE)).unwrap();
            symlink("nowhere", run.join(TRACE)).unwrap();
        },
    ),
    ("helper's folder is a link", Rewritten, "lies in a linked folder", |run| {
        link(run, TRACES_OF_HELPER);
    }),
    ("task's folder is a link", Rewritten, "lies in a linked folder", |run| {
        link(run, "traces/low_target");
    }),
    ("traces is a link", Rewritten, "lies in a linked folder", |run| link(run, "traces")),
    ("pipe among traces", Rewritten, "it is not a trace: it is no regular file", |run| {
        pipe(run.join(TRACES_OF_HELPER).join("short-0-s1.jsonl"));
    }),
    ("link among traces", Rewritten, "it is not a trace: it is a link", |run| {
        symlink("short-0-s0.jsonl", run.join(TRACES_OF_HELPER).join("short-0-s1.jsonl")).unwrap();
    }),
    ("trace is a hard link to another", Rewritten, "the one of another episode run", |run| {
        let other = run.join(TRACE.replace("low_target", "shopping"));
        fs::remove_file(&other).unwrap();
        fs::hard_link(run.join(TRACE), other).unwrap();
    }),
    ("results are a pipe", Kept, "results.jsonl: it is no regular file", |run| {
        pipe(run.join("results.jsonl"));
    }),
    ("results lead to /dev/zero", Kept, "results.jsonl: it is a link", |run| {
        endless(run.join("results.jsonl"));
    }),
    ("results are a link", Kept, "results.jsonl: it is a link", |run| {
        link(run, "results.jsonl");
    }),
    ("run.json is a link", Kept, "run.json: it is a link", |run| link(run, "run.json")),
    ("run.json is a pipe", Kept, "run.json: it is no regular file", |run| {
        pipe(run.join("run.json"));
    }),
    ("scores are a link", Kept, "altered: [\"scores.json\"]", |run| link(run, "scores.json")),
    ("report is a pipe", Kept, "altered: [\"report.md\"]", |run| pipe(run.join("report.md"))),
    ("picture is a link", Kept, "altered: [\"figure.png\"]", |run| link(run, "figure.png")),
    ("episodes is a link", Rewritten, "episodes", |run| link(run, "episodes")),
    ("an episode is a link", Rewritten, "episodes", |run| {
        link(run, "episodes/low_target-short-0.json");
    }),
    ("an episode is a pipe", Rewritten, "episodes", |run| {
        pipe(run.join("episodes/low_target-short-0.json"));
    }),
];

#[test]
fn runs_with_links_or_special_files_fail() {
    check_attacks(ATTACKS);
}

#[test]
fn a_run_that_is_named_by_a_link_passes() {
    let source = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let (dir, helpers) = (tempfile::tempdir().unwrap(), TestHelpers::new());
    whole_run(&dir.path().join("good"), &source, &helpers);
    symlink("good", dir.path().join("named")).unwrap();
    assert_eq!(problems(&dir.path().join("named"), &helpers), "");
}

#[test]
fn a_resumed_run_does_not_follow_links() {
    let source = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let (dir, helpers) = (tempfile::tempdir().unwrap(), TestHelpers::new());
    let good = dir.path().join("good");
    whole_run(&good, &source, &helpers);
    let resume = |path: &Path| {
        let (mut run, _) = Run::open(path, FolderMode::Resume, &RunRequest::default(), &helpers)?;
        run.play(1, &helpers, &helpers.stop, &mut |_| ())
    };
    for (k, name) in
        ["results.jsonl", ".lock", "run.json", "traces", "traces/low_target", "episodes"]
            .iter()
            .enumerate()
    {
        let run = dir.path().join(k.to_string());
        copy_folder(&good, &run);
        // The episode run is played again, so its trace is written.
        fs::remove_file(run.join(TRACE)).unwrap();
        link(&run, name);
        let moved = run.with_extension("moved");
        if *name == "results.jsonl" {
            // A torn record, which resuming cuts off.
            append(moved.clone(), b"{\"task");
        }
        let before = entries_with_lengths(&moved);
        let error = resume(&run).unwrap_err().to_string();
        assert!(error.contains("it is a link"), "{name}: {error}");
        assert_eq!(entries_with_lengths(&moved), before, "{name}");
    }
}

/// Lists paths, kinds and lengths of all entries below a path.
fn entries_with_lengths(path: &Path) -> Vec<(chaic_files::DirectoryEntry, u64)> {
    let found = chaic_files::walk(path, 9).unwrap().into_iter();
    found.map(|e| (e.clone(), fs::symlink_metadata(&e.path).unwrap().len())).collect()
}
