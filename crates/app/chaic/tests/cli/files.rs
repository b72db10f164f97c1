//! Promises on files: no unusable folders, no torn files, no blocking, clear errors.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::*;

const PLAY: [&str; 6] = ["eval", "--helper", "none", "--size", "32", "--episodes"];

#[test]
fn a_run_stopped_before_its_start_can_be_started_again() {
    let dir = short_episodes();
    let at = dir.path();
    let begin = [&PLAY[..], &["short", "--out", "run"]].concat();
    // Files that a kill leaves while episodes are copied.
    fs::create_dir_all(at.join("run/episodes")).expect("the disk has space");
    for name in [".lock", "episodes/moving_house-gen-0.json.tmp"] {
        fs::write(at.join("run").join(name), "").expect("the disk has space");
    }
    let out = output_of(at, &["eval", "--resume", "--out", "run"]);
    let message = text(&out.stderr);
    assert!(message.contains("give its command again without --resume"), "{message}");
    assert_eq!(out.status.code(), Some(1));
    run_ok(at, &begin);
    assert_eq!(fs::read_dir(at.join("run/episodes")).expect("it exists").count(), 2);

    // A mistake of the user leaves no files.
    fs::copy(at.join("short/no_constraint-0.json"), at.join("short/twin.json"))
        .expect("the disk has space");
    let begin = [&PLAY[..], &["short", "--out", "second"]].concat();
    let out = output_of(at, &begin);
    assert!(text(&out.stderr).contains("two episodes that are named like no_constraint/gen/0"));
    assert_eq!(out.status.code(), Some(2));
    assert!(!at.join("second").exists());
    fs::remove_file(at.join("short/twin.json")).expect("it exists");
    run_ok(at, &begin);
}

#[test]
fn verify_detects_an_altered_run() {
    let dir = short_episodes();
    let at = dir.path();
    let out = "my run";
    let printed = run_ok(at, &[&PLAY[..], &["short", "--out", out]].concat());
    assert!(printed.contains("chaic verify 'my run'\n"), "{printed}");
    let good = run_ok(at, &["verify", out]);
    for words in ["2 of 2 episode runs are finished", "2 traces", "agrees with the results"] {
        assert!(good.contains(words), "{words}: {good}");
    }
    let change = |name: &str, from: &str, to: &str| {
        let path = at.join(out).join(name);
        let text = fs::read_to_string(&path).expect("a text file");
        assert!(text.contains(from), "{from} is in {name}");
        fs::write(&path, text.replacen(from, to, 1)).expect("the disk has space");
        (path, text)
    };
    fs::write(at.join("r.gif"), "an older one").expect("the disk has space");
    let replay = ["replay", out, "no_constraint/gen/0", "--every", "40", "--out", "r.gif"];
    for (from, to) in [
        ("\"turn_left\"", "\"turn_right\""),
        ("\"helper\":\"none\"", "\"helper\":\"rhp\""),
        ("\"complete\":false", "\"complete\":true"),
        ("\"world_seed\":", "\"world_seed\":1"),
    ] {
        let (path, text) = change("traces/no_constraint/none/gen-0-s0.jsonl", from, to);
        let out = output_of(at, &replay);
        let message = self::text(&out.stderr);
        assert!(
            message.contains("the trace was altered, so no video is made"),
            "{from}: {message}"
        );
        assert_eq!(out.status.code(), Some(1), "{from}");
        assert_eq!(fs::read(at.join("r.gif")).expect("it exists"), b"an older one");
        assert!(!at.join("r.gif.partial").exists());
        fs::write(path, text).expect("the disk has space");
    }
    run_ok(at, &replay);
    for (name, from, to, words) in [
        ("scores.json", "0.", "1.", "ALTERED scores.json"),
        ("report.md", "# chaic", "# Chaic", "ALTERED report.md"),
        ("results.jsonl", "\"status\":\"done\"", "\"x_status\":\"done\"", "line 1: missing field"),
        ("results.jsonl", "\"total\"", "\"sum\":0,\"total\"", "unknown field `sum`"),
        ("run.json", "\"rules\": \"paper\"", "\"rules\": \"compat\"", "was changed after the run"),
    ] {
        let (path, text) = change(name, from, to);
        let message = run_err(at, &["verify", out]);
        assert!(message.contains(words), "{name}: {message}");
        fs::write(path, text).expect("the disk has space");
    }
    let journal = at.join(out).join("results.jsonl");
    let lines = fs::read_to_string(&journal).expect("a text file");
    fs::write(&journal, &lines[..=lines.find('\n').expect("it has lines")])
        .expect("the disk has space");
    let message = run_err(at, &["verify", out]);
    assert!(message.contains("1 of 2 episode runs are finished; missing: 1, first "), "{message}");
}

#[test]
fn episodes_out_of_bounds_are_refused() {
    let dir = short_episodes();
    let at = dir.path();
    let file = at.join("short/no_constraint-0.json");
    let text = fs::read_to_string(&file).expect("a text file");
    let mut episode: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    for field in ["rooms", "openings", "floors"] {
        let mut long = episode.clone();
        let entries = long["setup"][field].as_array_mut().expect("it is a list");
        *entries = vec![entries[0].clone(); 2000];
        fs::write(at.join("long.json"), long.to_string()).expect("the disk has space");
        let message = run_err(at, &["episodes", "validate", "long.json"]);
        assert!(
            message.contains(&format!("setup.{field}: has 2000 entries, at most")),
            "{message}"
        );
    }
    episode["version"] = 7.into();
    fs::write(at.join("old.json"), episode.to_string()).expect("the disk has space");
    let message = run_err(at, &["episodes", "validate", "old.json"]);
    assert!(message.contains("version: is 7, this program reads version 1"), "{message}");
}

/// Nothing was played before the message, so one line is printed.
#[test]
fn paths_of_results_are_checked_before_the_work() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    fs::create_dir(at.join("folder")).expect("the disk has space");
    fs::write(at.join("file"), "").expect("the disk has space");
    let few = ["--n-episodes", "1"];
    let detection = ["eval", "detection", "--views", "1"];
    for (command, option) in [
        (&detection[..], "--json"),
        (&detection, "--error-rates"),
        (&detection, "--coco"),
        (&[&["collect", "opponent"], &few[..]].concat(), "--out"),
        (&[&["eval", "opponent", "--weights", "w"], &few[..]].concat(), "--json"),
        (&[&["eval", "behavior", "--perception", "gt"], &few[..]].concat(), "--json"),
        (&[&["eval", "tracks", "--perception", "gt_masks"], &few[..]].concat(), "--json"),
    ] {
        let cases = match option {
            "--coco" => [("file", "file is no folder"), ("file/inner", "file is no folder")],
            _ => [("nodir/x", "there is no folder nodir"), ("folder", "it is a folder")],
        };
        for (path, problem) in cases {
            let message = run_err(at, &[command, &[option, path]].concat());
            assert!(message.contains(problem), "{command:?} {option}: {message}");
            assert_eq!(message.lines().count(), 1, "{command:?} {option}: {message}");
        }
    }
}

#[cfg(unix)]
#[test]
fn special_files_are_refused_without_waiting() {
    let dir = short_episodes();
    let at = dir.path();
    fs::create_dir(at.join("odd")).expect("the disk has space");
    fs::create_dir(at.join("folder.json")).expect("the disk has space");
    let made = Command::new("mkfifo").arg(at.join("odd/pipe.json")).status();
    assert!(made.expect("there is a mkfifo").success());
    let pipe = "odd/pipe.json: it is no regular file";
    for (arguments, words) in [
        (&["episodes", "validate", "odd/pipe.json"][..], pipe),
        (&["episodes", "show", "odd/pipe.json", "--out", "x.png"], pipe),
        (&[&PLAY[..], &["odd", "--out", "run"]].concat(), pipe),
        (&["episodes", "validate", "folder.json"], "folder.json: it is a folder"),
        (&["scene", "export", "folder.json", "--out", "x.glb"], "folder.json: it is a folder"),
    ] {
        let message = run_err(at, arguments);
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
    assert!(!at.join("run").exists());
}

/// Runs a command under limits set by the shell.
#[cfg(target_os = "linux")]
fn limited(at: &Path, limits: &str, arguments: &[&str]) -> std::process::Output {
    let script = format!("{limits}; exec \"$0\" \"$@\"");
    let mut shell = Command::new("sh");
    shell.current_dir(at).args(["-c", &script]).arg(cargo_bin!("chaic")).args(arguments);
    let out = shell.stdin(Stdio::null()).output().expect("there is a shell");
    let message = text(&out.stderr);
    assert!(!message.contains("panicked"), "{arguments:?}: {message}");
    out
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_no_torn_file_and_the_error_names_the_path() {
    let dir = short_episodes();
    let at = dir.path();
    run_ok(at, &[&PLAY[..], &["short", "--out", "run"]].concat());
    // Files of at most 8 blocks of 512 bytes: writes fail as on a full disk.
    let small = "trap '' XFSZ; ulimit -f 8";
    let file = "short/no_constraint-0.json";
    for (arguments, left) in [
        (&["report", "run", "--figure", "f.png"][..], "f.png"),
        (&["scene", "export", file, "--out", "s.glb"], "s.glb"),
        (&["episodes", "show", file, "--out", "p.png"], "p.png"),
        (&["render", file, "--size", "256", "--out", "r"], "r/rgb.png"),
        (&["replay", "run", "no_constraint/gen/0", "--out", "v.gif"], "v.gif"),
    ] {
        if !left.contains('/') {
            fs::write(at.join(left), "an older one").expect("the disk has space");
        }
        let out = limited(at, small, arguments);
        let message = text(&out.stderr);
        assert!(
            message.contains(left) && message.contains("File too large"),
            "{arguments:?}: {message}"
        );
        assert_eq!(out.status.code(), Some(1), "{arguments:?}");
        let kept = fs::read(at.join(left)).unwrap_or(b"an older one".to_vec());
        assert_eq!(kept, b"an older one", "{arguments:?}");
        for suffix in [".tmp", ".partial"] {
            assert!(!at.join(format!("{left}{suffix}")).exists(), "{left}{suffix}");
        }
    }
    let out = limited(at, "exec >/dev/full", &["report", "run"]);
    let message = text(&out.stderr);
    assert!(message.contains("can't write to the standard output: No space left"), "{message}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_missing_thread_is_an_error_message() {
    let dir = short_episodes();
    let at = dir.path();
    let eval = [&PLAY[..], &["short", "--seeds", "2", "--jobs", "16", "--out", "run"]].concat();
    // With stacks of 64 TiB no thread starts. With those of 1 GiB some start, but not all: the address space
    // has 4.3 GiB.
    for limits in [
        "export RUST_MIN_STACK=70368744177664",
        "export RUST_MIN_STACK=1073741824; ulimit -v 4500000",
    ] {
        let help = limited(at, limits, &["verify", "--help"]);
        assert!(help.status.success(), "the program itself starts: {}", text(&help.stderr));
        let out = limited(at, limits, &eval);
        let message = text(&out.stderr);
        assert!(message.contains("unavailable"), "{limits}: {message}");
        assert_eq!(out.status.code(), Some(1), "{limits}, no signal ends it: {message}");
    }
}

#[test]
fn exit_codes_agree_with_the_documentation() {
    let dir = short_episodes();
    let at = dir.path();
    let usage = ["eval", "--out", "run"];
    let generate = ["episodes", "generate", "--task", "obstacle", "--out", "x", "--seeds"];
    for (arguments, code, words) in [
        (&["episodes", "schema"][..], 0, ""),
        (&["report", "nowhere"], 1, "no run.json"),
        (&["eval", "--resume", "--out", "nowhere"], 1, "no run.json"),
        (&["episodes", "validate", "nowhere.json"], 1, "can't open nowhere.json"),
        (&["render", "obstacle/test/99", "--out", "x"], 2, "obstacle/test/99"),
        (&[&generate[..], &["0..824633720833"]].concat(), 2, "A < B <= 824633720832"),
        (
            &[&usage[..], &["--helper", "nobody"]].concat(),
            2,
            "oracle_plan, llm, llm_known_task, vlm",
        ),
        (&[&usage[..], &["--partner", "nobody"]].concat(), 2, "the partners are rules, farthest"),
        (&[&usage[..], &["--seeds", "0"]].concat(), 2, "0 is not in 1..="),
        (&["eval", "--nonsense"], 2, "--nonsense"),
    ] {
        let out = output_of(at, arguments);
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {message}");
        assert!(message.contains(words), "{arguments:?}: {message}");
    }
    assert!(!at.join("run").exists());
}
