//! Promise: a small sample of every measurement of docs/reliability.md passes, and a broken promise is
//! reported.

#[path = "../src/command_output.rs"]
mod command_output;

use std::process::{Command, Output};

use command_output::CommandOutput;

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
fn output_explains_findings_but_no_other_exit_code() {
    let problem = |code: Option<i32>, stdout: &str, stderr: &str| {
        CommandOutput { code, stdout: stdout.to_owned(), stderr: stderr.to_owned() }.problem()
    };
    for code in [Some(1), Some(2)] {
        assert_eq!(problem(code, "", "error: the disk is full\n"), None);
        assert_eq!(problem(code, "a table\n", "note\nerror: the disk is full\n"), None);
        assert!(problem(code, "a table\n", "error: first\nerror: second\n").is_some());
    }
    assert_eq!(problem(Some(0), "", ""), None);
    assert_eq!(problem(Some(1), "FOUND a file of no episode run\n", ""), None);
    let unexplained = [(Some(1), ""), (Some(1), "\n"), (Some(2), "a table\n"), (None, "a table\n")];
    for (code, stdout) in unexplained {
        assert!(problem(code, stdout, "warning: slow\n").is_some(), "{code:?}, {stdout:?}");
    }
    for code in [Some(0), Some(101)] {
        let panic = problem(code, "a table\n", "thread 'main' panicked at a.rs\n");
        assert!(panic.is_some_and(|text| text.starts_with("panic: ")), "{code:?}");
    }
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

/// The plot of the learning curves fails once, at the only validation.
#[test]
fn a_plot_that_failed_is_drawn_at_the_end_of_a_training() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (config, out) = (path("c.toml"), path("t"));
    let text = "steps = 1\nwarm_up = 1\nbatch_size = 1\nvalidation_max_per_class = 5\n\
                [collect]\nepisodes = 1\nimage_size = 32\n";
    std::fs::write(&config, text).expect("the disk has space");
    let temporary = path("t/curves.svg.tmp");
    let plan = ["chaic", "--fault", "io-error", "--path", &temporary, "--at", "0", "--"];
    let train = ["train", "opponent", "--config", &config, "--out", &out];
    let trained = reliability(&[&plan[..], &train[..]].concat());
    let messages = String::from_utf8_lossy(&trained.stderr).into_owned();
    assert!(trained.status.success() && messages.contains("curves.svg"), "{messages}");
    assert!(folder.path().join("t/curves.svg").exists(), "{messages}");
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

/// The folder of a submission gets its name after its files are on the device. The command ends before it plays.
#[test]
fn a_submission_is_extracted_completely_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mine = at.join("mine");
    std::fs::create_dir(&mine).expect("the disk has space");
    let manifest = format!(
        "version = 1\nname = \"random\"\nrelease = \"1.0\"\nauthors = [\"A. Author\"]\nlicense = \"MIT\"\n\
         description = \"Random valid plans.\"\nchaic = \"{}\"\n[helper]\nbuilt_in = \"random\"\n\
         [training]\nhardware = \"none\"\ncore_hours = 0\n[public]\nsplit = \"standard\"\n",
        env!("CARGO_PKG_VERSION")
    );
    std::fs::write(mine.join("submission.toml"), &manifest).expect("the disk has space");
    let path = |name: &str| at.join(name).to_str().expect("the path is UTF-8").to_owned();
    let (mine, out, temporary) = (path("mine"), path("out"), path("out/submission.tmp"));
    let episodes = path("episodes");
    let generate = ["chaic", "--", "episodes", "generate", "--task", "shopping", "--seeds", "0..1"];
    run_ok(&[&generate[..], &["--out", &episodes]].concat());
    // Operations on the temporary folder: create and rename; of an interrupted extraction, remove before.
    let play = |fault: &str, index: &str| {
        let plan = ["chaic", "--fault", fault, "--path", &temporary, "--at", index, "--"];
        let command = ["submit", "run", &mine, "--episodes", &episodes, "--out", &out];
        let mut program = Command::new(env!("CARGO_BIN_EXE_chaic-reliability"));
        // A crash leaves temporary files.
        let program = program.args(plan).args(command).env("TMPDIR", at);
        let status = program.output().expect("the program starts").status;
        assert_eq!(status.code(), Some(86), "{fault}");
        std::fs::read_to_string(at.join("out/submission/submission.toml")).ok()
    };
    assert_eq!(play("crash-before", "1"), None);
    assert!(at.join("out/submission.tmp/submission.toml").exists());
    assert_eq!(play("power-failure", "2"), Some(manifest));
    assert!(!at.join("out/submission.tmp").exists());
}

#[test]
fn killed_commands_are_completed() {
    run_ok(&["kills", "merge", "--kills", "1"]);
}

/// Returns the names of the parsers in a table.
fn parsers(table: &str) -> Vec<String> {
    let rows = table.lines().skip(2);
    rows.filter_map(|row| row.split('|').nth(1)).map(|name| name.trim().to_owned()).collect()
}

/// Every parser has a corpus.
#[test]
fn no_parser_breaks_on_its_corpus_and_a_few_changes() {
    let mut tested = parsers(&run_ok(&["fuzz", "--inputs", "100", "--seconds", "600"]));
    tested.sort();
    let corpus = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/corpus"));
    let folders = corpus.expect("the corpus").map(|entry| entry.expect("an entry").file_name());
    let mut kept: Vec<String> = folders.filter_map(|name| name.into_string().ok()).collect();
    kept.sort();
    assert_eq!(tested, kept);
}

#[test]
fn parsers_in_processes_of_their_own_have_rows_in_order() {
    let options = ["--inputs", "5", "--seconds", "600", "--jobs", "2"];
    let table = run_ok(&[&["fuzz", "secret", "llm-answer"][..], &options].concat());
    assert_eq!(parsers(&table), ["llm-answer", "secret"], "{table}");
}
