//! Promises on helper processes.

use std::fs;

use assert_cmd::cargo::cargo_bin;

use super::{command, output_of, run_err, run_ok, short_episodes, text};

#[test]
fn a_served_helper_plays_like_the_built_in_one() {
    let dir = short_episodes();
    let program = cargo_bin!("chaic").display().to_string();
    let served = format!("served=exec:'{program}' helper serve rhp");
    let play = ["eval", "--episodes", "short", "--helper", "rhp", "--helper", &served];
    let grants = ["--exec-grants", "ids,goal_place"];
    let out = ["--size", "48", "--out", "run"];
    let all: Vec<&str> = play.iter().chain(&grants).chain(&out).copied().collect();
    let table = run_ok(dir.path(), &all);
    assert!(table.contains("served") && !table.contains("no grants"), "{table}");
    let run = dir.path().join("run");
    for task in ["no_constraint", "moving_house"] {
        let traces = run.join("traces").join(task);
        let last = |helper: &str| {
            let traces = fs::read_dir(traces.join(helper)).expect("it played");
            let path = traces.map(|e| e.expect("it exists").path()).next().expect("a trace");
            let text = fs::read_to_string(path).expect("a text file");
            text.lines().skip(1).map(str::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(last("served"), last("rhp"), "{task}");
    }
    assert!(run_ok(dir.path(), &["verify", "run"]).contains("all digests agree"));

    // The folder of a run does not choose the command.
    let commands = run.join("commands.json");
    let written = fs::read_to_string(&commands).expect("it is noted");
    assert!(written.contains("helper serve rhp"), "{written}");
    let proof = dir.path().join("proof");
    let planted = format!(r#"[{{"name":"served","command":"touch '{}'"}}]"#, proof.display());
    let resume = ["eval", "--resume", "--out", "run"];
    fs::write(&commands, &planted).expect("the disk has space");
    let bare = output_of(dir.path(), &resume);
    assert_eq!(bare.status.code(), Some(2), "{}", text(&bare.stderr));
    let again = ["--helper", "rhp", "--helper", &served, "--exec-grants", "ids,goal_place"];
    let again: Vec<&str> = resume.iter().chain(&again).copied().collect();
    let message = run_err(dir.path(), &again);
    assert!(message.contains("a command is only run if you name it"), "{message}");
    assert!(!proof.exists(), "what the folder named was run");
    fs::write(&commands, written).expect("the disk has space");
    run_ok(dir.path(), &again);
    let fewer: Vec<&str> = again[..again.len() - 2].to_vec();
    let message = run_err(dir.path(), &fewer);
    assert!(message.contains("the grants of helpers or partner differ"), "{message}");
}

#[test]
fn a_failing_helper_scores_zero_with_a_reason() {
    let dir = short_episodes();
    let play = ["eval", "--episodes", "short", "--size", "48", "--out", "run"];
    let broken = ["--helper", "exec:echo no weights >&2; exit 1"];
    let out = output_of(dir.path(), &play.iter().chain(&broken).copied().collect::<Vec<_>>());
    assert_eq!(out.status.code(), Some(1), "it ends with findings");
    let message = text(&out.stderr);
    assert!(message.contains("exited before its answer; standard error: no weights"), "{message}");
    let results = fs::read_to_string(dir.path().join("run/results.jsonl")).expect("it exists");
    assert_eq!(results.lines().filter(|l| l.contains("no weights")).count(), 2, "{results}");
}

#[test]
fn a_run_is_not_resumed_with_an_edited_script() {
    let dir = short_episodes();
    let at = dir.path();
    let script = at.join("helper.sh");
    let write = |text: &str| fs::write(&script, text).expect("the disk has space");
    write("exit 1\n");
    let helper = ["--helper", "exec:sh helper.sh 2>&1 --log=out.log"];
    let play = ["eval", "--episodes", "short", "--size", "48", "--out", "run"];
    let resume = ["eval", "--resume", "--out", "run"];
    let status = |words: &[&str]| output_of(at, &[words, &helper[..]].concat()).status.code();
    assert_eq!(status(&play), Some(1));
    // This file did not exist at the start of the run, so the helper may have written it.
    fs::write(at.join("out.log"), "").expect("the disk has space");
    assert_eq!(status(&resume), Some(1), "failed episode runs are played again");
    write("exit 2\n");
    let refused = output_of(at, &[&resume[..], &helper[..]].concat());
    let message = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    let expected = "run was started with another content of helper.sh, which exec runs or reads";
    assert!(message.contains(expected), "{message}");
    fs::remove_file(&script).expect("it exists");
    assert_eq!(status(&resume), Some(2));
    write("exit 1\n");
    assert_eq!(status(&resume), Some(1));
}

/// The helper prints its environment to standard error, which the run records.
#[test]
fn a_helper_inherits_only_the_named_environment_variables() {
    let dir = short_episodes();
    let play = ["eval", "--episodes", "short", "--size", "48", "--no-traces"];
    let telling = ["--helper", "exec:env >&2; exit 1"];
    let environment = |extra: &[&str], out: &str| {
        let all: Vec<&str> = play.iter().chain(&telling).chain(extra).copied().collect();
        let mut command = command(dir.path(), &all);
        command.args(["--out", out]);
        let keys = ["OPENAI_API_KEY", "MY_LLM_KEY", "HF_TOKEN", "AWS_SECRET_ACCESS_KEY"];
        command.envs(keys.map(|name| (name, "sesame-open")));
        command.envs([("LC_ALL", "C"), ("OMP_NUM_THREADS", "3"), ("WEIGHTS_AT", "/weights")]);
        let ended = command.output().expect("the command starts");
        assert_eq!(ended.status.code(), Some(1), "{}", text(&ended.stderr));
        fs::read_to_string(dir.path().join(out).join("results.jsonl")).expect("it exists")
    };
    let bare = environment(&[], "bare");
    for allowed in ["PATH=", "LC_ALL=C", "OMP_NUM_THREADS=3"] {
        assert!(bare.contains(allowed), "{allowed}: {bare}");
    }
    let is_key = |word: &&str| bare.to_uppercase().contains(word);
    let found = ["_KEY", "TOKEN", "SECRET", "SESAME"].into_iter().find(is_key);
    assert_eq!(found, None, "{bare}");
    assert!(!bare.contains("WEIGHTS_AT"), "{bare}");

    let named = environment(&["--exec-env", "WEIGHTS_AT", "--exec-env", "UNSET"], "named");
    assert!(named.contains("WEIGHTS_AT=/weights") && !named.contains("sesame"), "{named}");
    let commands = dir.path().join("named/commands.json");
    let recorded = fs::read_to_string(commands).expect("it exists");
    assert!(recorded.contains("WEIGHTS_AT") && !recorded.contains("/weights"), "{recorded}");
    let resume = ["eval", "--resume", "--out", "named", telling[0], telling[1]];
    assert!(run_err(dir.path(), &resume).contains("--exec-env WEIGHTS_AT"));
    assert_eq!(output_of(dir.path(), &["eval", "--exec-env", "A=b"]).status.code(), Some(2));
}

#[test]
fn a_command_is_checked_from_the_command_line() {
    let dir = short_episodes();
    let program = cargo_bin!("chaic").display().to_string();
    let served = format!("'{program}' helper serve random");
    let granted = ["helper", "check", &served, "--exec-grants", "ids,goal_place"];
    let kept = run_ok(dir.path(), &granted);
    assert!(kept.contains("follows the protocol") && !kept.contains("FAILED"), "{kept}");
    let refused = run_err(dir.path(), &granted[..3]);
    let problem = "failed: the briefing lacks the grants ids,goal_place; give --exec-grants";
    assert!(refused.contains(problem), "{refused}");
    let out = output_of(dir.path(), &["helper", "check", "cat"]);
    assert_eq!(out.status.code(), Some(1));
    assert!(text(&out.stdout).contains("1 check failed"), "{}", text(&out.stdout));
    for wrong in [
        &["eval", "--helper", "exec:"][..],
        &["eval", "--helper", "rhp=exec:true"],
        &["eval", "--helper", "exec:true", "--helper", "exec:false"],
        &["eval", "--helper", "exec:true", "--exec-grants", "gold"],
        &["eval", "--helper", "exec:true", "--exec-decision-s", "soon"],
        &["eval", "--helper", "none", "--exec-read", "nofile", "--out", "none"],
        &["eval", "--helper", "policy:", "--out", "none"],
        &["eval", "--helper", "none", "--perception", "learned:", "--out", "none"],
        &["helper", "serve", "nobody"],
        &["helper", "serve", "none"],
        &["helper", "check", ""],
    ] {
        assert_eq!(output_of(dir.path(), wrong).status.code(), Some(2), "{wrong:?}");
    }
    assert!(!dir.path().join("none").exists());
}
