//! Promises: the command works as documented, errors are one clear line, and nothing panics.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;

mod beliefs;
mod contest;
mod contest_partners;
mod files;
mod help;
mod interrupted;
mod language;
mod learning;
mod lists;
mod messages;
mod partners;
mod perception;
mod pictures;
mod run_folders;
mod sandbox;
mod splits;
mod studies;
mod subprocess;
mod training;

/// Frames of the episodes of these tests.
const FRAMES: u32 = 80;

fn output_of(dir: &Path, arguments: &[&str]) -> Output {
    let out = command(dir, arguments).output().expect("the command starts");
    let stderr = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
    out
}

fn command(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(cargo_bin!("chaic"));
    command.current_dir(dir).args(arguments).stdin(Stdio::null());
    command
}

/// Starts a command in the background.
fn start(dir: &Path, arguments: &[&str]) -> Child {
    let mut command = command(dir, arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text is UTF-8")
}

/// Runs a command that must succeed, and returns its standard output.
fn run_ok(dir: &Path, arguments: &[&str]) -> String {
    let out = output_of(dir, arguments);
    assert!(out.status.success(), "{arguments:?}: {}", text(&out.stderr));
    text(&out.stdout)
}

/// Runs a command that must fail, and returns its output.
fn run_err(dir: &Path, arguments: &[&str]) -> String {
    let out = output_of(dir, arguments);
    assert!(!out.status.success(), "{arguments:?} succeeded");
    text(&out.stderr) + &text(&out.stdout)
}

/// Part of the error for a wrong appearance.
const APPEARANCES: &str = "expected canonical, evening or varied:SEED";

/// Returns a folder with short episodes in `short/`.
fn short_episodes() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("the disk has space");
    for task in ["no_constraint", "moving_house"] {
        let generate =
            ["episodes", "generate", "--task", task, "--seeds", "0..1", "--out", "short"];
        assert_eq!(run_ok(dir.path(), &generate), format!("short: 1 episode of {task}\n"));
    }
    shorten(&dir.path().join("short"));
    dir
}

/// Shortens the episode files of a folder to [`FRAMES`].
fn shorten(folder: &Path) {
    shorten_to(folder, FRAMES);
}

/// Sets the length of the episode files of a folder.
fn shorten_to(folder: &Path, frames: u32) {
    for entry in fs::read_dir(folder).expect("it exists") {
        let path = entry.expect("it exists").path();
        let json = fs::read_to_string(&path).expect("a text file");
        let begin = json.find("\"horizon\": ").expect("an episode has one") + 11;
        let end = begin + json[begin..].find(',').expect("more follows");
        let short = format!("{}{frames}{}", &json[..begin], &json[end..]);
        fs::write(&path, short).expect("the disk has space");
    }
}

const EVAL: [&str; 9] =
    ["eval", "--episodes", "short", "--helper", "none,rhp", "--size", "48", "--out", "run"];

#[test]
fn a_run_from_end_to_end() {
    let dir = short_episodes();
    let at = dir.path();
    let printed = run_ok(at, &EVAL);
    for word in ["Transport rate", "RHP", "Moving", "run/report.md"] {
        assert!(printed.contains(word), "{word}: {printed}");
    }
    let report = ["scores.json", "report.md", "report.html", "figure.svg", "figure.png"];
    for file in ["run.json", "results.jsonl"].into_iter().chain(report) {
        assert!(at.join("run").join(file).exists(), "{file}");
    }

    let scores = fs::read_to_string(at.join("run/scores.json")).expect("a text file");
    assert_eq!(run_ok(at, &["report", "run", "--format", "json"]), scores);
    assert_eq!(run_ok(at, &["report", "run", "--format", "json", "--from-traces"]), scores);
    let csv = run_ok(at, &["report", "run", "--format", "csv", "--formulas", "original"]);
    assert_eq!(csv.lines().count(), 5, "{csv}");
    assert!(run_ok(at, &["report", "run", "--format", "md"]).starts_with("# chaic run"));
    run_ok(at, &["report", "run", "--figure", "f.svg"]);
    assert!(at.join("f.svg").exists());

    // Another run in the folder is refused. The same run has nothing to do.
    assert!(run_err(at, &EVAL).contains("isn't empty"));
    let again = run_ok(at, &["eval", "--resume", "--out", "run"]);
    let without_time = |text: &str| {
        text.lines()
            .filter(|line| !line.starts_with("Time:"))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(without_time(&again), without_time(&printed));
    assert_eq!(fs::read_to_string(at.join("run/scores.json")).expect("a text file"), scores);
    let other = run_err(at, &["eval", "--resume", "--out", "run", "--helper", "rhp"]);
    assert!(other.contains("--helper none,rhp, not rhp"), "{other}");
    run_ok(at, &["eval", "--resume", "--out", "run", "--helper", "rhp,none"]);
    for language in [["--endpoint", "http://localhost/v1"], ["--model", "m"]] {
        let other = run_err(at, &[&["eval", "--resume", "--out", "run"], &language[..]].concat());
        assert!(other.contains("was started without a language model"), "{other}");
    }
    fs::create_dir(at.join("none")).expect("the disk has space");
    let resume = ["eval", "--resume", "--out", "run", "--episodes"];
    run_ok(at, &[&resume[..], &["short"]].concat());
    let other = run_err(at, &[&resume[..], &["none"]].concat());
    assert!(other.contains("started with other episodes than --episodes none"), "{other}");

    assert!(run_ok(at, &["verify", "run", "--jobs", "2"]).contains("4 traces"));
    let trace = at.join("run/traces/no_constraint/rhp/gen-0-s0.jsonl");
    let whole = fs::read_to_string(&trace).expect("a text file");
    fs::write(&trace, whole.replacen("\"turn_left\"", "\"turn_right\"", 1))
        .expect("the disk has space");
    let out = output_of(at, &["verify", "run"]);
    assert_eq!(out.status.code(), Some(1));
    let found = text(&out.stdout);
    assert!(
        found.contains("gen-0-s0.jsonl: frame 0, helper") && found.contains("partner's"),
        "{found}"
    );
    fs::write(&trace, &whole[..whole.len() - 5]).expect("the disk has space");
    let out = output_of(at, &["verify", "run"]);
    assert!(text(&out.stderr).contains("is cut off"), "{}", text(&out.stderr));
    let out = output_of(at, &["report", "run", "--from-traces"]);
    let missing = "1 of 4 finished episode runs have no whole trace and are left out, first \
                   no_constraint/gen/0 with rhp and seed 0";
    assert!(text(&out.stderr).contains(missing), "{}", text(&out.stderr));
    let json = run_ok(at, &["report", "run", "--from-traces", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json["episode_runs"]["planned"], 4);
    assert_eq!(json["episode_runs"]["scored"], 3);
    fs::rename(at.join("run/traces"), at.join("run/elsewhere")).expect("it exists");
    let message = run_err(at, &["report", "run", "--from-traces"]);
    assert!(
        message.contains("4 of 4 finished") && message.contains("no whole trace yet"),
        "{message}"
    );
    fs::rename(at.join("run/elsewhere"), at.join("run/traces")).expect("it exists");
    fs::write(&trace, whole).expect("the disk has space");

    let replay = ["replay", "run", "no_constraint/gen/0", "--out", "r.gif", "--every", "40"];
    assert!(run_ok(at, &replay).contains("3 images of no_constraint/gen/0 with rhp"));
    let unknown = run_err(at, &["replay", "run", "obstacle/test/00", "--out", "r.gif"]);
    assert!(unknown.contains("no trace of obstacle/test/00") && unknown.contains("for example"));
}

#[test]
fn fidelity_from_end_to_end() {
    let dir = short_episodes();
    let at = dir.path();
    let begin = [
        "fidelity",
        "--episodes",
        "short",
        "--task",
        "no_constraint",
        "--first",
        "1",
        "--seeds",
        "1",
        "--helper",
        "none,rhp",
        "--size",
        "48",
        "--switch",
        "world.blocking",
        "--out",
        "fid",
        "--doc",
        "docs/f.md",
    ];
    assert!(run_ok(at, &begin).contains("Document: docs/f.md"));
    let doc = |name: &str| fs::read_to_string(at.join(name)).expect("a text file");
    let whole = doc("docs/f.md");
    for words in
        ["## Rules of the paper", "creeps to stops", "(images/f-compat.svg)", "of the kind gen"]
    {
        assert!(whole.contains(words), "{words}: {whole}");
    }
    assert!(!whole.contains("unfinished"), "{whole}");
    assert!(at.join("docs/images/f-paper.svg").exists());

    // Every part is an ordinary run. Switches record no traces.
    assert!(run_ok(at, &["report", "fid/compat"]).contains("RHP"));
    assert!(run_ok(at, &["verify", "fid/paper"]).contains("2 traces"));
    let switch = "fid/switch/world.blocking";
    assert!(run_ok(at, &["report", switch, "--format", "md"]).contains("world.blocking=paper"));
    let id = "no_constraint/gen/0";
    for command in [
        &["verify", switch][..],
        &["report", switch, "--from-traces"],
        &["replay", switch, id, "--out", "r.gif"],
    ] {
        assert!(run_err(at, command).contains("--no-traces"), "{command:?}");
    }

    // A resumed experiment compares the episodes.
    fs::create_dir(at.join("none")).expect("the disk has space");
    let resume = ["fidelity", "--resume", "--out", "fid", "--episodes"];
    run_ok(at, &[&resume[..], &["short"]].concat());
    let other = output_of(at, &[&resume[..], &["none"]].concat());
    let message = text(&other.stderr);
    assert!(message.contains("started with other episodes than --episodes none"), "{message}");
    assert_eq!(other.status.code(), Some(2), "{message}");

    // A killed run lacks a result and the report. The document names what is missing, and a resumed run
    // gives the same document.
    assert!(run_err(at, &begin).contains("isn't empty"));
    let letter = ["fidelity", "--resume", "--out", "fid", "--doc", "run.txt"];
    fs::write(at.join("run.txt"), "dear").expect("the disk has space");
    assert!(run_err(at, &letter).contains("not a document of this kind"));
    let journal = at.join("fid/compat/results.jsonl");
    let lines = fs::read_to_string(&journal).expect("a text file");
    let first = lines.find('\n').expect("it has lines") + 1;
    fs::write(&journal, &lines[..first]).expect("the disk has space");
    fs::remove_file(at.join("fid/compat/report.md")).expect("it exists");
    let message = run_err(at, &["fidelity", "--only-document", "--out", "fid"]);
    assert!(message.contains("1 episode run is missing"), "{message}");
    assert!(doc("fid/fidelity.md").contains("- `compat`: 1 of 2 are missing"));
    let report = output_of(at, &["report", "fid/compat", "--format", "csv"]);
    assert!(text(&report.stderr).contains("Unfinished: 1 of 2"), "{}", text(&report.stderr));
    fs::remove_dir_all(at.join("short")).expect("it exists");
    // A build with other results for the same episode does not add its results.
    let other = at.join("fid/paper/results.jsonl");
    let ours = fs::read_to_string(&other).expect("a text file");
    let at_digest = ours.rfind("\"digest\":\"").expect("it has one") + 10;
    let theirs = format!("{}{}{}", &ours[..at_digest], "0123456789abcdef", &ours[at_digest + 16..]);
    fs::write(&other, theirs).expect("the disk has space");
    let message = run_err(at, &["fidelity", "--resume", "--out", "fid"]);
    assert!(message.contains("gives another result than before"), "{message}");
    assert!(
        message.contains("no_constraint/gen/0 with ") && !message.contains("--resume"),
        "{message}"
    );
    assert_eq!(fs::read_to_string(&journal).expect("a text file"), lines[..first]);
    fs::write(&other, ours).expect("the disk has space");
    run_ok(at, &["fidelity", "--resume", "--out", "fid", "--doc", "docs/f.md"]);
    assert_eq!(doc("docs/f.md"), whole);
}

#[test]
fn fidelity_names_the_episodes_until_a_run_has_copies() {
    let dir = short_episodes();
    let at = dir.path();
    let options = ["--episodes", "short", "--out", "fid", "--doc", "f.md"];
    let begin = ["fidelity", "--task", "no_constraint", "--seeds", "1", "--helper", "none,rhp"];
    let begin = [&begin[..], &["--size", "48", "--no-switches"], &options].concat();
    run_ok(at, &begin);
    // The run of a part cannot be opened, because its folder holds something else.
    for (part, option) in [("paper", ""), ("compat", " --episodes short")] {
        let folder = at.join("fid").join(part);
        fs::remove_dir_all(&folder).expect("it exists");
        fs::create_dir(&folder).expect("the disk has space");
        fs::write(folder.join("letter.txt"), "dear").expect("the disk has space");
        let message = run_err(at, &[&["fidelity", "--resume"], &options[..]].concat());
        let hint = format!("continue with: chaic fidelity --resume --out fid{option} --doc f.md");
        assert!(message.contains(&hint), "{hint}: {message}");
    }
}

#[test]
fn wrong_option_values_end_in_the_same_exit_code() {
    let dir = short_episodes();
    let at = dir.path();
    run_ok(
        at,
        &["eval", "--episodes", "short", "--helper", "none", "--size", "32", "--out", "run"],
    );
    let replay = ["replay", "run", "no_constraint/gen/0", "--helper", "none", "--every", "40"];
    for arguments in [
        &["eval", "--task", "lunch"][..],
        &["eval", "--helper", "nobody", "--out", "r"],
        &["eval", "--size", "5", "--out", "r"],
        &["eval", "--seeds", "0", "--out", "r"],
        &["eval", "--appearance", "varied", "--out", "r"],
        &["eval", "--set", "world.gravity=1", "--out", "r"],
        &["eval", "--split", "test", "--episodes", "short", "--out", "r"],
        &["eval", "--resume", "--out", "run", "--first", "1"],
        &["eval", "--resume", "--out", "run", "--model", "m"],
        &["eval", "--model", "m", "--out", "r"],
        &["report", "run", "--figure", "f.txt"],
        &["export", "lerobot", "run", "--out", "set", "--size", "33"],
        &["export", "lerobot", "run", "--out", "set", "--every", "7"],
        &["export", "episodes", "--split", "train", "--task", "tremor", "--out", "set"],
        &["fidelity", "--episodes", "short", "--helper", "rhp", "--out", "f"],
        &["study", "delete", "lowercase", "short"],
        &[&replay[..], &["--out", "r.avi"]].concat()[..],
        &[&replay[..], &["--out", "r.gif", "--fps", "51"]].concat()[..],
        &["episodes", "generate", "--task", "obstacle", "--seeds", "3..3", "--out", "x"],
    ] {
        let out = output_of(at, arguments);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {}", text(&out.stderr));
    }
    assert_eq!(output_of(at, &["report", "nowhere"]).status.code(), Some(1), "nothing is there");
}

#[test]
fn language_helpers_from_an_endpoint_to_the_report() {
    use chaic_llm_standin::{Options, StandIn};
    let dir = short_episodes();
    let at = dir.path();
    let standin = StandIn::start(Options::default()).expect("a port is free");
    let url = standin.url();
    let check = run_ok(at, &["llm", "check", "--endpoint", &url, "--model", "standin"]);
    assert!(check.contains("by JSON schema: answers in") && check.contains("as text"), "{check}");
    let eval = ["eval", "--episodes", "short", "--helper", "none,llm,vlm", "--size", "48"];
    let live = [&eval[..], &["--endpoint", &url, "--model", "standin", "--out", "live"]].concat();
    let printed = run_ok(at, &live);
    let report = fs::read_to_string(at.join("live/report.md")).expect("a text file");
    assert!(printed.contains("LLM") && printed.contains("VLM"), "{printed}");
    for words in ["LLM", "VLM", "helper: decided by model", "helper: prompt tokens"] {
        assert!(report.contains(words), "{words}: {report}");
    }
    drop(standin);
    let scores = run_ok(at, &["report", "live", "--format", "json"]);
    let again = [&eval[..], &["--llm", "replay:live", "--out", "again"]].concat();
    run_ok(at, &again);
    assert_eq!(run_ok(at, &["report", "again", "--format", "json"]), scores);
    assert!(run_ok(at, &["verify", "again"]).contains("6 traces"));

    let shown = run_ok(at, &["llm", "show", "live", "no_constraint/gen/0"]);
    for words in ["## Plans", "not a language model", ">>> frame 0: ", "decisions", "## Task"] {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    let vlm = ["llm", "show", "live", "no_constraint/gen/0", "--helper", "vlm", "--brief"];
    assert!(!run_ok(at, &vlm).contains("## Task"));

    run_ok(at, &["llm", "templates", "--out", "mine"]);
    assert!(at.join("mine/task.txt").exists());
    fs::write(at.join("mine/task.txt"), "{{ nonsense }}").expect("the disk has space");
    fs::write(at.join("mine.toml"), "[request]\ntemplates = \"mine\"\n")
        .expect("the disk has space");
    let llm = ["eval", "--episodes", "short", "--helper", "llm", "--out", "r"];
    let remote = "https://models.example.org/v1";
    let mistyped = [
        (
            &["--llm-config", "mine.toml", "--endpoint", &url, "--model", "m"][..],
            "task.txt: line 1",
        ),
        (&["--model", "m"], "give --endpoint"),
        (&["--endpoint", &url], "give --model"),
        (&["--endpoint", "https://a:sesame@b/v1", "--model", "m"], "the bare address"),
        (
            &["--endpoint", remote, "--model", "m", "--llm-config", "nokey.toml"],
            "CHAIC_TEST_NO_KEY",
        ),
        (&["--llm", "replay:nowhere"], "holds no record of a language model"),
        (&["--llm", "nowhere"], "write replay:DIR"),
        (&["--partner", "llm2", "--endpoint", &url, "--model", "m"], "one_by_one, llm, vlm"),
        (&["--llm-config", "short"], "can't read short"),
        // No server answers any more.
        (
            &["--endpoint", &url, "--model", "m", "--llm-config", "quick.toml"],
            "paused: the model cannot be reached",
        ),
    ];
    fs::write(at.join("nokey.toml"), "[endpoint]\nkey_env = \"CHAIC_TEST_NO_KEY\"\n")
        .expect("the disk has space");
    fs::write(at.join("quick.toml"), "[retry]\nmax_attempts = 1\n").expect("the disk has space");
    for (arguments, words) in mistyped {
        let message = run_err(at, &[&llm[..], arguments].concat());
        assert!(message.contains(words) && !message.contains("sesame"), "{arguments:?}: {message}");
    }
    assert!(run_err(at, &["eval", "--endpoint", &url, "--out", "x"]).contains("--helper llm"));
    assert!(run_err(at, &["llm", "show", "live", "shopping/test/00"]).contains("no trace of"));
}

#[test]
fn errors_are_clear() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    for (arguments, words) in [
        (&["eval", "--task", "lunch", "--out", "r"][..], "unknown task `lunch`"),
        (&["eval", "--helper", "nobody", "--out", "r"], "unknown helper `nobody`"),
        (&["eval", "--split", "gen:5..5", "--out", "r"], "no split `gen:5..5`"),
        (&["eval", "--size", "5", "--out", "r"], "5 is not in 16..=2048"),
        (&["eval", "--seeds", "0", "--out", "r"], "0 is not in 1..="),
        (&["eval", "--appearance", "dusk", "--out", "r"], APPEARANCES),
        (&["render", "shopping/test/00", "--appearance", "varied:x", "--out", "r"], APPEARANCES),
        (&["eval", "--rules", "mine", "--out", "r"], "they are paper and compat"),
        (&["eval", "--set", "world.gravity=1", "--out", "r"], "chaic list rules"),
        (&["eval", "--episodes", "nowhere", "--out", "r"], "nowhere"),
        (&["report", "nowhere"], "no run.json"),
        (&["verify", "nowhere"], "no run.json"),
        (&["replay", "nowhere", "obstacle/test/00", "--out", "x.mp4"], "no run.json"),
        (&["render", "obstacle/test/99", "--out", "x"], "obstacle/test/99"),
        (&["episodes", "show", "nowhere.json", "--out", "x.png"], "nowhere.json"),
        (&["episodes", "generate", "--task", "obstacle", "--seeds", "3..3", "--out", "x"], "A..B"),
        (
            &["import", "original", "--dataset", "nowhere", "--tdw", "nowhere", "--out", "x"],
            "contains no tdw package",
        ),
    ] {
        let message = run_err(at, arguments);
        assert!(message.contains(words), "{arguments:?}: {message}");
        assert!(message.lines().count() <= 8, "{message}");
    }
    assert_eq!(
        fs::read_dir(at)
            .expect("it exists")
            .filter(|e| {
                // A run that never started leaves at most its empty folder.
                e.as_ref().is_ok_and(|e| e.path().join("run.json").exists())
            })
            .count(),
        0
    );
}
