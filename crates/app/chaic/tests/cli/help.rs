//! Promises on help, completions, manual pages and suggestions.

use crate::*;

/// Commands with their own help, from the lists of `chaic --help` and of each group.
fn commands(dir: &Path) -> Vec<Vec<String>> {
    let mut found = vec![Vec::new()];
    let mut open: Vec<Vec<String>> = vec![Vec::new()];
    while let Some(parent) = open.pop() {
        let mut arguments: Vec<&str> = parent.iter().map(String::as_str).collect();
        arguments.push("--help");
        let help = run_ok(dir, &arguments);
        let headings = ["Play:", "Inspect:", "Learn:", "Check:", "Contest:", "Shell:", "Commands:"];
        let mut is_list = false;
        for line in help.lines() {
            if !line.starts_with(' ') {
                is_list = headings.contains(&line);
                continue;
            }
            // Names are indented by two spaces.
            let is_name = line.starts_with("  ") && !line.starts_with("   ");
            let name =
                line.split_whitespace().next().filter(|n| *n != "help" && is_list && is_name);
            if let Some(name) = name {
                let child = [&parent[..], &[name.to_owned()]].concat();
                found.push(child.clone());
                open.push(child);
            }
        }
    }
    found
}

#[test]
fn every_command_has_examples_and_defaults_in_its_help() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let commands = commands(dir.path());
    assert!(commands.len() > 40, "{commands:?}");
    for command in commands {
        let mut arguments: Vec<&str> = command.iter().map(String::as_str).collect();
        arguments.push("--help");
        let help = run_ok(dir.path(), &arguments);
        let (_, examples) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("{help}"));
        let lines = examples.lines().filter(|line| line.starts_with("  chaic"));
        assert_eq!(lines.count(), 3, "{help}");
        assert!(!help.to_lowercase().contains("usual"), "{help}");
        arguments.pop();
        arguments.push("-h");
        assert!(!run_ok(dir.path(), &arguments).contains("Examples:"), "{command:?}");
    }
    let help = run_ok(dir.path(), &["render", "--help"]);
    for default in ["[default: helper]", "[default: 512]", "[default: paper]", "[default: text]"] {
        assert!(help.contains(default), "{default}: {help}");
    }
}

#[test]
fn the_help_has_groups_in_order() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let help = run_ok(dir.path(), &["--help"]);
    let headings: Vec<&str> =
        help.lines().filter(|line| line.ends_with(':') && !line.starts_with(' ')).collect();
    let expected =
        ["Play:", "Inspect:", "Learn:", "Check:", "Contest:", "Shell:", "Options:", "Examples:"];
    assert_eq!(headings, expected, "{help}");
    assert!(help.contains("Exit codes"), "{help}");
    assert!(help.lines().all(|line| line.chars().count() <= 100), "{help}");
    let colored = run_ok(dir.path(), &["--color", "always", "--help"]);
    assert!(colored.contains("\u{1b}[") && !help.contains('\u{1b}'), "{colored}");
}

#[test]
fn misspelled_names_have_suggestions() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    for (arguments, suggestion) in [
        (&["eval", "--helper", "none,orakel", "--out", "r"][..], "did you mean `oracle`?"),
        (&["eval", "--helper", "rph", "--out", "r"], "did you mean `rhp`?"),
        (&["eval", "--task", "shoping", "--out", "r"], "did you mean `shopping`?"),
        (&["eval", "--partner", "rule", "--out", "r"], "did you mean `rules`?"),
        (
            &["eval", "--set", "world.failed_put_on_can_delivr=true", "--out", "r"],
            "`world.failed_put_on_can_deliver`?",
        ),
        (&["eval", "--helper", "exec:true", "--exec-grants", "goals"], "did you mean `goal`?"),
        (&["fidelity", "--episodes", "e", "--task", "obstacles", "--out", "f"], "`obstacle`?"),
        (&["helper", "serve", "randm"], "did you mean `random`?"),
        (&["episodes", "generate", "--task", "tremors", "--seeds", "0..1", "--out", "e"], "tremor"),
        (&["epsiodes", "list"], "'episodes'"),
        (&["eval", "--helpr", "none"], "'--helper'"),
    ] {
        let out = output_of(at, arguments);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {}", text(&out.stderr));
        let message = text(&out.stderr);
        assert!(message.contains(suggestion), "{arguments:?}: {message}");
    }
    for unlike in ["nobody", "foo"] {
        let message = run_err(at, &["eval", "--helper", unlike, "--out", "r"]);
        assert!(!message.contains("did you mean"), "{message}");
    }
}

#[test]
fn old_spellings_work() {
    let dir = tempfile::tempdir().expect("the disk has space");
    for old in [
        &["eval-perception", "detection", "--look", "canonical"][..],
        &["eval-perception", "behavior", "--look", "varied"],
        &["eval-behavior"],
        &["eval-opponent"],
        &["eval", "detection"],
    ] {
        let missing = [old, &["--weights", "missing"]].concat();
        let message = run_err(dir.path(), &missing);
        assert!(message.contains("can't open missing"), "{old:?}: {message}");
    }
    let views = ["collect", "detection", "--of", "validation", "--look", "varied", "--views", "1"];
    run_ok(dir.path(), &[&views[..], &["--out", "views"]].concat());
}

#[test]
fn completions_and_manual_pages_name_the_commands() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    for shell in ["bash", "zsh", "fish"] {
        let script = run_ok(at, &["completions", shell]);
        for name in ["episodes", "doctor", "completions"] {
            assert!(script.contains(name), "{shell}: {name}");
        }
    }
    let pages: serde_json::Value =
        serde_json::from_str(&run_ok(at, &["man", "man1", "--format", "json"])).expect("JSON");
    let pages = pages["pages"].as_array().expect("a list").len();
    assert!(pages > 40, "{pages} pages");
    for page in ["chaic.1", "chaic-eval.1", "chaic-eval-detection.1", "chaic-train-ppo.1"] {
        let page = fs::read_to_string(at.join("man1").join(page)).expect(page);
        assert!(page.contains("Examples") && page.contains(".TH"), "{page}");
    }
    assert!(!at.join("man1/chaic-eval-opponent-help.1").exists());
    let message = run_err(at, &["completions", "bash", "--format", "json"]);
    assert!(message.contains("prints text only"), "{message}");
}

#[test]
fn quiet_runs_print_no_progress() {
    let dir = short_episodes();
    let at = dir.path();
    let play = ["eval", "--episodes", "short", "--helper", "none", "--size", "32", "--out"];
    let out = output_of(at, &[&play[..], &["run"]].concat());
    assert!(text(&out.stderr).contains("2 episode runs"), "{}", text(&out.stderr));
    let out = output_of(at, &[&play[..], &["again", "--quiet"]].concat());
    assert_eq!(text(&out.stderr), "");
    assert!(text(&out.stdout).contains("again/report.md"), "{}", text(&out.stdout));
    let out = output_of(at, &["--color=always", "report", "nowhere"]);
    assert!(text(&out.stderr).contains("\u{1b}[1;31merror:"), "{}", text(&out.stderr));
}
