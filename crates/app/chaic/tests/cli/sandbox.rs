//! Promise: helper processes run in a sandbox, which the run records.

#[cfg(target_os = "linux")]
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
#[cfg(target_os = "linux")]
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use super::{command, output_of, run_err, run_ok, short_episodes, start, text};

/// Returns the arguments of a small run with one helper process.
fn play<'a>(line: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let first = ["eval", "--episodes", "short", "--size", "48", "--out", out, "--helper", line];
    first.iter().chain(more).copied().collect()
}

fn granted(run: &Path) -> serde_json::Value {
    let text = fs::read_to_string(run.join("run.json")).expect("it exists");
    serde_json::from_str::<serde_json::Value>(&text).expect("it is JSON")["granted"].clone()
}

/// Returns whether this system enforces every part of the sandbox. If not, the tests check the record only.
fn is_whole(run: &Path) -> bool {
    let isolation = granted(run)["isolation"]["exec"].as_str().expect("it is recorded").to_owned();
    assert!(isolation.starts_with("sandbox"), "{isolation}");
    isolation == "sandbox"
}

#[test]
fn a_helper_sees_neither_the_run_nor_the_start_folder() {
    let dir = short_episodes();
    let spy = "exec:{ cat run/run.json; ls run short; cat /proc/*/cmdline; } >&2; exit 1";
    let out = output_of(dir.path(), &play(spy, "run", &[]));
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    let run = dir.path().join("run");
    if is_whole(&run) {
        let results = fs::read_to_string(run.join("results.jsonl")).expect("it exists");
        assert!(results.contains("No such file"), "{results}");
        for secret in ["digest", "options", "no_constraint-0.json", "--episodes"] {
            assert!(!results.contains(secret), "{secret}: {results}");
        }
    }
    let trusted = "exec:{ head -c 200 open/run.json; ls short; } >&2; exit 1";
    output_of(dir.path(), &play(trusted, "open", &["--exec-trust"]));
    let results = fs::read_to_string(dir.path().join("open/results.jsonl")).expect("it exists");
    for secret in ["renderer", "no_constraint"] {
        assert!(results.contains(secret), "{secret}: {results}");
    }
}

#[test]
fn the_record_says_how_a_helper_was_confined() {
    let dir = short_episodes();
    let program = assert_cmd::cargo::cargo_bin!("chaic").display().to_string();
    let served = format!("exec:'{program}' helper serve random");
    let grants = ["--exec-grants", "ids,goal_place"];
    let table = run_ok(dir.path(), &play(&served, "run", &grants));
    let run = dir.path().join("run");
    if is_whole(&run) {
        assert!(table.contains("process in a"), "{table}");
    }
    let trusted = [&grants[..], &["--exec-trust"]].concat();
    let table = run_ok(dir.path(), &play(&served, "open", &trusted));
    assert!(table.contains("trusted process"), "{table}");
    let open = dir.path().join("open");
    assert_eq!(granted(&open)["isolation"]["exec"], "trusted");
    for file in ["report.md", "scores.json"] {
        let text = fs::read_to_string(open.join(file)).expect("it exists");
        assert!(text.contains("trusted"), "{file}: {text}");
    }
    run_ok(dir.path(), &["verify", "run"]);
    run_ok(dir.path(), &["verify", "open"]);

    // The sandbox does not affect the episode: the traces differ in the record only.
    let trace = |run: &Path| {
        let folder = run.join("traces/no_constraint/exec");
        let mut files = fs::read_dir(folder).expect("it played");
        fs::read_to_string(files.next().expect("a trace").expect("it exists").path()).expect("text")
    };
    let (confined, trusted) = (trace(&run), trace(&open));
    assert!(
        confined.contains(r#""isolation":"sandbox"#)
            && trusted.contains(r#""isolation":"trusted""#)
    );
    let rest = |trace: &str| trace.lines().skip(1).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(rest(&confined), rest(&trusted));

    // Neither a resumed run nor a trace can change it.
    let resume = ["eval", "--resume", "--out", "run", "--helper", &served];
    let resume = [&resume[..], &trusted_arguments()].concat();
    assert!(run_err(dir.path(), &resume).contains("start a new run"));
    let json = fs::read_to_string(open.join("run.json")).expect("it exists");
    fs::write(open.join("run.json"), json.replace("\"trusted\"", "\"sandbox\"")).expect("room");
    assert!(run_err(dir.path(), &["verify", "open"]).contains("names another isolation"));
}

fn trusted_arguments() -> [&'static str; 3] {
    ["--exec-grants", "ids,goal_place", "--exec-trust"]
}

#[test]
fn a_helper_reads_files_of_its_command_line_and_those_the_user_adds() {
    let dir = short_episodes();
    for folder in ["mine", "data"] {
        fs::create_dir(dir.path().join(folder)).expect("the disk has space");
    }
    fs::write(dir.path().join("data/weights"), "weights-are-here").expect("the disk has space");
    fs::write(dir.path().join("mine/words"), "words-are-here").expect("the disk has space");
    let script = "cat \"$(dirname \"$0\")/words\" data/weights >&2; exit 1";
    fs::write(dir.path().join("mine/helper.sh"), script).expect("the disk has space");
    let line = "exec:sh mine/helper.sh";
    let message = |out: &str, more: &[&str]| {
        output_of(dir.path(), &play(line, out, more));
        fs::read_to_string(dir.path().join(out).join("results.jsonl")).expect("it exists")
    };
    let bare = message("bare", &[]);
    assert!(bare.contains("words-are-here"), "{bare}");
    if is_whole(&dir.path().join("bare")) {
        assert!(!bare.contains("weights-are-here"), "{bare}");
    }
    assert!(message("more", &["--exec-read", "data"]).contains("weights-are-here"));
    // The folder of the run stays hidden even inside a readable folder.
    #[cfg(unix)]
    std::os::unix::fs::symlink("data", dir.path().join("alias")).expect("the disk has space");
    let spy = "exec:cat data/run/run.json data/weights >&2; exit 1";
    output_of(dir.path(), &play(spy, "alias/run", &["--exec-read", "data"]));
    let run = dir.path().join("data/run");
    let message = fs::read_to_string(run.join("results.jsonl")).expect("it exists");
    assert!(message.contains("weights-are-here"), "{message}");
    assert!(!is_whole(&run) || !message.contains("renderer"), "{message}");
    // The folder of the episodes stays hidden, too.
    let spy = "exec:ls short >&2; cat data/weights >&2; exit 1";
    let readable = ["--exec-read", "short", "--exec-read", "data"];
    output_of(dir.path(), &play(spy, "hidden", &readable));
    let run = dir.path().join("hidden");
    let message = fs::read_to_string(run.join("results.jsonl")).expect("it exists");
    assert!(message.contains("weights-are-here"), "{message}");
    assert!(!is_whole(&run) || !message.contains("no_constraint-0.json"), "{message}");
    for (path, problem) in [("nowhere", "--exec-read nowhere"), ("/", "--exec-trust")] {
        let out = output_of(dir.path(), &play(line, "none", &["--exec-read", path]));
        assert_eq!(out.status.code(), Some(2), "{path}: {}", text(&out.stderr));
        assert!(text(&out.stderr).contains(problem), "{path}: {}", text(&out.stderr));
    }
}

/// Returns whether a process with this argument runs.
#[cfg(target_os = "linux")]
fn runs(argument: &str) -> bool {
    let entries = fs::read_dir("/proc").expect("it exists").flatten();
    entries.into_iter().any(|entry| {
        let line = fs::read(entry.path().join("cmdline")).unwrap_or_default();
        line.starts_with(b"sleep") && line.split(|b| *b == 0).any(|w| w == argument.as_bytes())
    })
}

#[cfg(target_os = "linux")]
fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let began = Instant::now();
    while !holds() {
        assert!(began.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn no_helper_outlives_a_killed_command() {
    let dir = short_episodes();
    for (number, more) in [("86420.125", &[][..]), ("86420.375", &["--exec-trust"])] {
        // A process that left its session, and one that never answers.
        let line = format!("exec:setsid sleep {number} & exec sleep {number}");
        let mut child = start(dir.path(), &play(&line, &format!("run{number}"), more));
        wait_until("the helper starts", || runs(number));
        child.kill().expect("it runs");
        child.wait().expect("it ends");
        wait_until("the helper ends with its run", || !runs(number));
    }
}

/// Runs `chaic` where no process can make user namespaces, so that one part of the sandbox is missing. Returns `None`
/// if this system does not let a test take namespaces away.
#[cfg(target_os = "linux")]
pub fn output_without_namespaces(dir: &Path, arguments: &[&str]) -> Option<Output> {
    let none = "echo 0 > /proc/sys/user/max_user_namespaces 2>/dev/null || exit 77; exec \"$@\"";
    let inside = |program: &OsStr, arguments: &[&str]| {
        let mut outer = Command::new("unshare");
        outer.args(["--user", "--map-root-user", "sh", "-c", none, "sh"]).arg(program);
        outer.args(arguments).current_dir(dir).output().ok()
    };
    inside(OsStr::new("true"), &[]).filter(|out| out.status.success())?;
    inside(command(dir, &[]).get_program(), arguments)
}

#[test]
#[cfg(target_os = "linux")]
fn an_incomplete_sandbox_is_reported_and_the_hidden_track_refuses_it() {
    let dir = short_episodes();
    let without = |arguments: &[&str]| output_without_namespaces(dir.path(), arguments);
    let line = "exec:echo silent; exit 1";
    let Some(out) = without(&play(line, "run", &[])) else { return };
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{message}");
    assert!(message.contains("warning: exec runs in a sandbox without namespaces"), "{message}");
    let run = dir.path().join("run");
    assert_eq!(granted(&run)["isolation"]["exec"], "sandbox without namespaces");
    let hidden = without(&play(line, "hidden", &["--track", "hidden"])).expect("as before");
    let message = text(&hidden.stderr);
    assert_eq!(hidden.status.code(), Some(2), "{message}");
    assert!(message.contains("the hidden track needs the whole sandbox"), "{message}");
    let trusted = without(&play(line, "trusted", &["--track", "hidden", "--exec-trust"]));
    assert_eq!(trusted.expect("as before").status.code(), Some(1));
}

/// Landlock alone hides the folders of the run and of the episodes inside a readable folder.
#[test]
#[cfg(target_os = "linux")]
fn a_run_is_hidden_inside_a_readable_folder_without_namespaces() {
    let dir = short_episodes();
    fs::write(dir.path().join("weights"), "weights-are-here").expect("the disk has space");
    let spy = "exec:{ head -c 200 run/run.json; ls short; cat weights; } >&2; exit 1";
    let readable = play(spy, "run", &["--exec-read", "."]);
    if output_without_namespaces(dir.path(), &readable).is_none() {
        return;
    }
    let run = dir.path().join("run");
    // Without Landlock nothing is hidden.
    if granted(&run)["isolation"]["exec"] != "sandbox without namespaces" {
        return;
    }
    let results = fs::read_to_string(run.join("results.jsonl")).expect("it exists");
    assert!(results.contains("weights-are-here"), "{results}");
    for secret in ["renderer", "no_constraint-0.json"] {
        assert!(!results.contains(secret), "{secret}: {results}");
    }
}
