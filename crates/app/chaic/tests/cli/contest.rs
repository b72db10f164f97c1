//! Promises on contests: a submission is checked, played, scored and verified by the documented commands. An altered
//! trace or score is found, and keeps its submission out of the leaderboard. A submission reads its own files only,
//! gives the same score in every folder, and needs the whole sandbox.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::cargo::cargo_bin;

#[cfg(target_os = "linux")]
use super::sandbox::output_without_namespaces;
use super::{command, run_ok, short_episodes, shorten, text};

/// Runs `chaic` with its own folder in the search path, so that a submission can name it as an installed program.
fn output_of(at: &Path, arguments: &[&str]) -> Output {
    let program = cargo_bin!("chaic").to_path_buf();
    let own = program.parent().expect("a folder").to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::iter::once(own).chain(std::env::split_paths(&path));
    let path = std::env::join_paths(folders).expect("they were joined before");
    let out = command(at, arguments).env("PATH", path).output().expect("the command starts");
    let stderr = text(&out.stderr);
    assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
    out
}

fn succeed(at: &Path, arguments: &[&str]) -> String {
    let out = output_of(at, arguments);
    assert!(out.status.success(), "{arguments:?}: {}{}", text(&out.stdout), text(&out.stderr));
    text(&out.stdout)
}

/// Runs a command that must report a problem; returns its output.
fn fail(at: &Path, arguments: &[&str]) -> String {
    let out = output_of(at, arguments);
    assert_eq!(out.status.code(), Some(1), "{arguments:?}: {}", text(&out.stdout));
    text(&out.stdout) + &text(&out.stderr)
}

/// Writes the manifest of a submission.
fn write_manifest(folder: &Path, name: &str, helper: &str, grants: &str) {
    fs::create_dir_all(folder).expect("the disk has space");
    let manifest = format!(
        "version = 1\nname = \"{name}\"\nrelease = \"1.0\"\nauthors = [\"A. <b>Author</b>\"]\n\
         license = \"MIT\"\ndescription = \"Random valid plans.\"\nchaic = \"{}\"\n\
         [helper]\n{helper}\n[play]\ngrants = [{grants}]\n\
         [training]\nhardware = \"none\"\ncore_hours = 0\n\
         [public]\nsplit = \"standard\"\ntasks = [\"no_constraint\"]\nn_episodes = 1\n",
        env!("CARGO_PKG_VERSION")
    );
    fs::write(folder.join("submission.toml"), manifest).expect("the disk has space");
}

/// Option with which a program also plays on systems without a whole sandbox.
const PARTIAL: &str = "--allow-partial-sandbox";

const GRANTS: &str = "\"ids\", \"goal_place\"";

/// Arguments of a public run.
const PUBLIC: [&str; 9] =
    ["eval", "--split", "standard", "--task", "no_constraint", "--n-episodes", "1", "--size", "32"];

/// Writes the submission of a program, `mine`, with its public run.
fn write_program(at: &Path) {
    let command = r#"command = ["chaic", "helper", "serve", "random"]"#;
    write_manifest(&at.join("mine"), "mine", command, GRANTS);
    fs::create_dir_all(at.join("mine/helper")).expect("the disk has space");
    fs::write(at.join("mine/helper/NOTES"), "The program is installed.").expect("it has space");
    let helper = ["--helper", "none,mine=exec:chaic helper serve random"];
    let more = ["--exec-grants", "ids,goal_place", "--out", "mine/public"];
    succeed(at, &[&PUBLIC[..], &helper, &more].concat());
}

/// Writes the submission of the built-in helper `random`, with its public run.
fn write_built_in(at: &Path) {
    write_manifest(&at.join("other"), "random", "built_in = \"random\"", GRANTS);
    let helper = ["--helper", "none,random", "--out", "other/public"];
    succeed(at, &[&PUBLIC[..], &helper].concat());
}

/// Replaces a part of a text file; returns the earlier content.
fn replace(path: &Path, from: &str, to: &str) -> String {
    let whole = fs::read_to_string(path).expect("a text file");
    assert!(whole.contains(from), "{from}");
    fs::write(path, whole.replacen(from, to, 1)).expect("the disk has space");
    whole
}

#[test]
fn a_contest_from_end_to_end() {
    let dir = short_episodes();
    let at = dir.path();
    write_program(at);
    let checked = succeed(at, &["submit", "check", "mine", PARTIAL]);
    for words in ["ok      archive, SHA-256 ", "it exits after `bye`", "public run: 2 traces"] {
        assert!(checked.contains(words), "{words}: {checked}");
    }
    for name in ["mine.tar", "again.tar"] {
        succeed(at, &["submit", "pack", "mine", "--out", name]);
    }
    let [first, again] = ["mine.tar", "again.tar"].map(|name| fs::read(at.join(name)));
    assert!(first.expect("an archive") == again.expect("an archive"));

    let play =
        ["submit", "run", "mine.tar", PARTIAL, "--rhp", "--out", "results/mine", "--episodes"];
    let unscored = fail(at, &["submit", "score", "results/mine"]);
    assert!(unscored.contains("results/mine"), "{unscored}");
    let problem = fail(at, &[&play[..], &["nodir"]].concat());
    assert!(problem.contains("nodir") && !at.join("results").exists(), "{problem}");
    let played = succeed(at, &[&play[..], &["short"]].concat());
    assert!(played.contains("results/mine/run: 6 episode runs"), "{played}");
    let journal = fs::read(at.join("results/mine/run/results.jsonl")).expect("results");
    succeed(at, &[&play[..], &["short"]].concat());
    assert!(fs::read(at.join("results/mine/run/results.jsonl")).expect("results") == journal);

    succeed(at, &["submit", "score", "results/mine"]);
    succeed(at, &["submit", "score", "results/mine", "--out", "again.json"]);
    let score_path = at.join("results/mine/score.json");
    let score = fs::read_to_string(&score_path).expect("a score");
    assert_eq!(score, fs::read_to_string(at.join("again.json")).expect("a score"));
    assert!(!score.contains(&at.display().to_string()), "a score has no paths");
    let confirmed = succeed(at, &["submit", "verify", "results/mine"]);
    assert!(confirmed.contains("confirmed by 6 traces"), "{confirmed}");

    // Folders of the wrong level.
    let problem = fail(at, &["submit", "verify", "results"]);
    assert!(problem.contains("name the folder that `chaic submit run` wrote"), "{problem}");
    let problem = fail(at, &["leaderboard", "build", "results/mine", "--out", "none.html"]);
    assert!(problem.contains("is one folder of chaic submit run"), "{problem}");
    assert!(!at.join("none.html").exists());

    // A second submission plays other episodes, so it is in another table.
    write_built_in(at);
    let generate = ["episodes", "generate", "--task", "no_constraint", "--seeds", "5..6"];
    run_ok(at, &[&generate[..], &["--out", "short2"]].concat());
    shorten(&at.join("short2"));
    let play = ["submit", "run", "other", "--out", "results/other", "--episodes", "short2"];
    succeed(at, &play);
    succeed(at, &["submit", "score", "results/other"]);
    let build = ["leaderboard", "build", "results", "--out"];
    let built = succeed(at, &[&build[..], &["page.html"]].concat());
    assert!(built.contains("page.html: 2 submissions in 2 tables"), "{built}");
    let page = fs::read_to_string(at.join("page.html")).expect("a page");
    assert!(page.contains("A. &lt;b&gt;Author&lt;") && !page.contains("<b>Author"), "{page}");
    for words in ["difference to RHP", "difference to no helper", "goal place, ids"] {
        assert!(page.contains(words), "{words}: {page}");
    }
    let csv = fs::read_to_string(at.join("page.csv")).expect("values");
    assert_eq!(csv.lines().count(), 1 + 3 + 2, "{csv}");
    succeed(at, &[&build[..], &["page2.html"]].concat());
    for kind in ["html", "json", "csv"] {
        let [a, b] = ["page", "page2"].map(|name| fs::read(at.join(format!("{name}.{kind}"))));
        assert!(a.expect("a file") == b.expect("a file"), "{kind}");
    }

    // One byte of one trace.
    let trace = at.join("results/mine/run/traces/no_constraint/mine/gen-0-s0.jsonl");
    let whole = replace(&trace, "\"turn_left\"", "\"turn_right\"");
    let problem = fail(at, &["submit", "verify", "results/mine"]);
    assert!(problem.contains("DIFFERS ") && problem.contains("gen-0-s0.jsonl"), "{problem}");
    let built = fail(at, &[&build[..], &["page.html"]].concat());
    assert!(built.contains("REFUSED mine: run/traces/no_constraint/mine/gen-0"), "{built}");
    assert!(built.contains("page.html: 1 submission in 1 table"), "{built}");
    let page = fs::read_to_string(at.join("page.html")).expect("a page");
    assert!(page.contains("Refused submissions") && page.contains("<b>mine</b>"), "{page}");
    fs::write(&trace, whole).expect("the disk has space");

    let whole = replace(&score_path, "\"tr\": ", "\"tr\": 1");
    let problem = fail(at, &["submit", "verify", "results/mine/score.json"]);
    assert!(problem.contains("score.json: line "), "{problem}");
    fs::write(&score_path, whole).expect("the disk has space");
    let seal = ["episodes", "seal", "--secret", "secret", "--task", "shopping", "--n-episodes"];
    run_ok(at, &[&seal[..], &["1", "--out", "sealed"]].concat());
    let commitment = ["--commitment", "sealed/commitment.json"];
    let problem = fail(at, &[&["submit", "verify", "results/mine"], &commitment[..]].concat());
    assert!(problem.contains("the episodes differ from those of the commitment"), "{problem}");
    succeed(at, &["submit", "verify", "results/mine"]);
}

#[test]
fn a_public_run_must_be_that_of_the_manifest() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_built_in(at);
    let checked = succeed(at, &["submit", "check", "other"]);
    assert!(checked.contains("the built-in helper has the grants of the manifest"), "{checked}");
    let manifest = at.join("other/submission.toml");
    for (from, to, words) in [
        (
            GRANTS,
            "\"ids\"",
            "random plays with the grants ids, goal_place, but submission.toml has",
        ),
        ("n_episodes = 1", "n_episodes = 2", "the number of episodes of the run is `1`, but"),
        ("\"standard\"", "\"test\"", "the split of the run is `standard`, but"),
        ("[\"no_constraint\"]", "[\"shopping\"]", "the tasks of the run is `no_constraint`, but"),
    ] {
        let whole = replace(&manifest, from, to);
        let problem = fail(at, &["submit", "check", "other"]);
        assert!(problem.contains("FAILED  public run") && problem.contains(words), "{problem}");
        fs::write(&manifest, whole).expect("the disk has space");
    }
    let trace = at.join("other/public/traces/no_constraint/random/standard-000-s0.jsonl");
    let whole = replace(&trace, "\"turn_left\"", "\"turn_right\"");
    let problem = fail(at, &["submit", "check", "other"]);
    assert!(problem.contains("`public`: other/public/traces/"), "{problem}");
    fs::write(&trace, whole).expect("the disk has space");
    fs::remove_dir_all(at.join("other/public")).expect("it exists");
    let problem = fail(at, &["submit", "check", "other"]);
    assert!(problem.contains("no run.json"), "{problem}");
}

#[test]
fn a_submission_reads_its_own_files_only() {
    let dir = short_episodes();
    let at = dir.path();
    fs::write(at.join("secret"), "sesame-open").expect("the disk has space");
    let secret = at.join("secret").display().to_string();
    // The command names the secret, so that the sandbox would open it for a command of the user.
    let line = format!(r#"command = ["sh", "spy.sh", "{secret}", "secret"]"#);
    write_manifest(&at.join("spy"), "spy", &line, "");
    fs::create_dir_all(at.join("spy/helper")).expect("the disk has space");
    let script = "cat words; cat \"$@\" ../../run/run.json ../submission.toml; exit 1";
    fs::write(at.join("spy/helper/spy.sh"), format!("{{ {script}; }} >&2")).expect("it has space");
    fs::write(at.join("spy/helper/words"), "words-are-here").expect("the disk has space");
    let played = ["submit", "run", "spy", PARTIAL, "--episodes", "short", "--out", "results/spy"];
    let message = fail(at, &played);
    assert!(message.contains("failed, zero each: 2"), "{message}");
    let results = fs::read_to_string(at.join("results/spy/run/results.jsonl")).expect("results");
    assert!(results.contains("words-are-here"), "{results}");
    let run = fs::read_to_string(at.join("results/spy/run/run.json")).expect("a run");
    if run.contains(r#""spy": "sandbox""#) {
        for hidden in ["sesame", "renderer", "A. <b>Author"] {
            assert!(!results.contains(hidden), "{hidden}: {results}");
        }
    }
    // Failed runs score zero, and the score is confirmed.
    succeed(at, &["submit", "score", "results/spy"]);
    succeed(at, &["submit", "verify", "results/spy"]);
}

/// Writes the submission of a program, `mine`, without a public run: the example in Python, or an installed program on
/// systems without Python.
fn write_unchecked_program(at: &Path) {
    let python = std::process::Command::new("python3").arg("--version").output();
    let words = match python {
        Ok(out) if out.status.success() => r#""python3", "helper.py""#,
        _ => r#""chaic", "helper", "serve", "random""#,
    };
    write_manifest(&at.join("mine"), "mine", &format!("command = [{words}]"), GRANTS);
    let helper = at.join("mine/helper");
    fs::create_dir_all(&helper).expect("the disk has space");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../examples/python_helper");
    for file in ["chaic_helper.py", "helper.py"] {
        fs::copy(example.join(file), helper.join(file)).expect("the disk has space");
    }
}

#[test]
fn the_same_archive_gives_the_same_score_in_another_folder() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let generate = ["episodes", "generate", "--task", "no_constraint", "--seeds", "0..1"];
    run_ok(at, &[&generate[..], &["--out", "short"]].concat());
    shorten(&at.join("short"));
    write_unchecked_program(at);
    succeed(at, &["submit", "pack", "mine", "--out", "mine.tar"]);
    let [first, second] = [("first", "1"), ("second", "2")].map(|(out, jobs)| {
        let play = ["submit", "run", "mine.tar", PARTIAL, "--episodes", "short", "--out", out];
        succeed(at, &[&play[..], &["--jobs", jobs]].concat());
        succeed(at, &["submit", "score", out]);
        fs::read_to_string(at.join(out).join("score.json")).expect("a score")
    });
    assert!(first.contains("\"trace_sha256\""), "{first}");
    assert_eq!(first, second);
}

#[cfg(unix)]
#[test]
fn a_linked_result_is_refused_and_not_left_out() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    for folder in ["elsewhere/mine", "results"] {
        fs::create_dir_all(at.join(folder)).expect("the disk has space");
    }
    std::os::unix::fs::symlink(at.join("elsewhere/mine"), at.join("results/mine")).expect("a link");
    let built = fail(at, &["leaderboard", "build", "results", "--out", "page.html"]);
    assert!(built.contains("REFUSED mine: it is a link; put the folder itself there"), "{built}");
}

/// Makes a wheel of the example in Python: arguments are the folder of the example and the wheel.
const MAKE_WHEEL: &str = r#"
import sys, zipfile

example, wheel = sys.argv[1:]
with zipfile.ZipFile(wheel, "w") as archive:
    with open(example + "/helper.py") as helper:
        main = helper.read().replace("from chaic_helper", "from .chaic_helper")
    archive.writestr("nearest/__init__.py", "")
    archive.writestr("nearest/__main__.py", main)
    archive.write(example + "/chaic_helper.py", "nearest/chaic_helper.py")
    info = "nearest-1.0.dist-info/"
    archive.writestr(info + "METADATA", "Metadata-Version: 2.1\nName: nearest\nVersion: 1.0\n")
    archive.writestr(info + "WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
    archive.writestr(info + "RECORD", "")
"#;

/// Makes a wheel and installs it into `mine/helper`, as docs/arena.md describes. Returns false on systems without
/// Python or pip.
fn install_wheel(at: &Path) -> bool {
    let python = |arguments: &[&str]| {
        let out = std::process::Command::new("python3").args(arguments).current_dir(at).output();
        out.is_ok_and(|out| out.status.success())
    };
    if !python(&["-m", "pip", "--version"]) {
        return false;
    }
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../examples/python_helper");
    let wheel = "nearest-1.0-py3-none-any.whl";
    assert!(python(&["-c", MAKE_WHEEL, example, wheel]), "the wheel is made");
    let install = ["-m", "pip", "install", "--no-deps", "--no-index", "--target", "mine/helper"];
    assert!(python(&[&install[..], &[wheel]].concat()), "the wheel is installed");
    true
}

#[test]
fn a_wheel_is_submitted_and_scored() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_manifest(&at.join("mine"), "mine", r#"command = ["python3", "-m", "nearest"]"#, GRANTS);
    if !install_wheel(at) {
        return;
    }
    let generate = ["episodes", "generate", "--task", "no_constraint", "--seeds", "0..1"];
    run_ok(at, &[&generate[..], &["--out", "short"]].concat());
    shorten(&at.join("short"));
    // pip compiles the modules; the archive has no bytecode.
    succeed(at, &["submit", "pack", "mine", "--out", "mine.tar"]);
    let play = ["submit", "run", "mine.tar", PARTIAL, "--episodes", "short", "--out", "result"];
    let played = succeed(at, &play);
    assert!(played.contains("2 episode runs") && !played.contains("failed"), "{played}");
    assert!(at.join("result/submission/helper/nearest/__main__.py").exists());
    succeed(at, &["submit", "score", "result"]);
    let confirmed = succeed(at, &["submit", "verify", "result"]);
    assert!(confirmed.contains("confirmed by 2 traces"), "{confirmed}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_program_needs_the_whole_sandbox_or_the_option_of_the_organizer() {
    let dir = short_episodes();
    let at = dir.path();
    write_manifest(&at.join("mine"), "mine", r#"command = ["sh", "helper.sh"]"#, "");
    fs::create_dir_all(at.join("mine/helper")).expect("the disk has space");
    fs::write(at.join("mine/helper/helper.sh"), "exit 1").expect("the disk has space");
    let play = ["submit", "run", "mine", "--episodes", "short", "--out", "results"];
    for refused in [&play[..], &["submit", "check", "mine"]] {
        let Some(out) = output_without_namespaces(at, refused) else { return };
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{message}");
        let expected = "error: mine would run in a sandbox without namespaces";
        assert!(message.contains(expected) && message.contains(PARTIAL), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
    assert!(!at.join("results/run").exists());
    let out = output_without_namespaces(at, &[&play[..], &[PARTIAL]].concat()).expect("as before");
    let message = text(&out.stderr);
    assert!(message.contains("warning: mine runs in a sandbox without namespaces"), "{message}");
    let run = fs::read_to_string(at.join("results/run/run.json")).expect("a run");
    assert!(run.contains(r#""mine": "sandbox without namespaces"#), "{run}");
}
