//! Promises on language models: keys and prompts go only to endpoints that the user names, a silent endpoint does not
//! block Ctrl-C, and control characters are escaped.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use chaic_llm_standin::{Options, ResponseMode, StandIn};
use serde_json::Value;

use crate::*;

const LLM: [&str; 6] = ["eval", "--episodes", "short", "--size", "48", "--helper"];

fn standin(options: Options) -> StandIn {
    StandIn::start(options).expect("a port is free")
}

fn play<'a>(url: &'a str, out: &'a str) -> Vec<&'a str> {
    [&LLM[..], &["llm", "--endpoint", url, "--model", "standin", "--out", out]].concat()
}

#[test]
fn a_run_folder_does_not_choose_the_endpoint_or_the_key() {
    let dir = short_episodes();
    let at = dir.path();
    let (mine, theirs) = (standin(Options::default()), standin(Options::default()));
    let url = mine.url();
    run_ok(at, &play(&url, "run"));
    let n_asked = mine.stats().requests;
    // A forged folder: another address, a variable with a secret, and a missing answer.
    let path = at.join("run/llm/settings.json");
    let recorded = fs::read_to_string(&path).expect("a text file");
    let forged = recorded
        .replace(&url, &theirs.url())
        .replace("\"key_env\": null", "\"key_env\": \"CHAIC_TEST_SECRET\"");
    assert!(forged.contains(&theirs.url()) && forged.contains("CHAIC_TEST_SECRET"), "{recorded}");
    fs::write(&path, forged).expect("the disk has space");
    fs::remove_dir_all(at.join("run/llm/no_constraint")).expect("it exists");
    fs::remove_file(at.join("run/results.jsonl")).expect("it exists");
    let resume = |more: &[&str]| {
        let arguments = [&["eval", "--resume", "--out", "run"], more].concat();
        let mut command = command(at, &arguments);
        command.env("CHAIC_TEST_SECRET", "sesame").output().expect("the command starts")
    };
    for more in [&[][..], &["--endpoint", &url], &["--llm-key-env", "CHAIC_TEST_SECRET"]] {
        let out = resume(more);
        let message = text(&out.stderr);
        assert!(!out.status.success(), "{more:?} goes on");
        for words in [&theirs.url(), "CHAIC_TEST_SECRET", "--endpoint"] {
            assert!(message.contains(words), "{words}: {message}");
        }
        assert!(!message.contains("sesame") && message.lines().count() == 1, "{message}");
    }
    assert_eq!((mine.stats().requests, theirs.stats().requests), (n_asked, 0));
    let out = resume(&["--endpoint", &url, "--llm-key-env", ""]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(mine.stats().requests > n_asked && theirs.stats().requests == 0);
    // A run that was stopped before it recorded its endpoint needs the options again.
    fs::remove_dir_all(at.join("run/llm")).expect("it exists");
    fs::remove_file(at.join("run/results.jsonl")).expect("it exists");
    assert!(text(&resume(&["--endpoint", &url]).stderr).contains("give --model"));
    let out = resume(&["--endpoint", &url, "--model", "standin"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
}

#[test]
fn plain_http_to_another_machine_needs_a_flag() {
    let dir = short_episodes();
    let at = dir.path();
    let url = "http://models.example.org/v1";
    for command in [&["llm", "check"][..], &[&LLM[..], &["llm", "--out", "r"]].concat()] {
        let ask = [command, &["--endpoint", url, "--model", "m"]].concat();
        let message = run_err(at, &ask);
        assert!(message.contains("plain http to another machine"), "{message}");
        assert!(message.contains("--llm-allow-http"), "{message}");
        // With the flag, the missing key is the next error.
        let key = ["--llm-allow-http", "--llm-key-env", "CHAIC_TEST_NO_KEY"];
        let message = run_err(at, &[&ask[..], &key].concat());
        assert!(message.contains("CHAIC_TEST_NO_KEY holds no key"), "{message}");
        let message =
            run_err(at, &[&ask[..], &["--llm-allow-http", "--llm-key-env", "sk-1"]].concat());
        assert!(
            message.contains("endpoint.key_env is no name") && !message.contains("sk-1"),
            "{message}"
        );
    }
    assert!(!at.join("r").exists());
}

#[test]
fn settings_out_of_range_are_refused() {
    let dir = short_episodes();
    let at = dir.path();
    let server = standin(Options::default());
    let url = server.url();
    for (text, words) in [
        ("[request]\ntemperature = nan", "request.temperature is NaN, expected 0 to 2"),
        ("[request]\ntemperature = -0.1", "request.temperature is -0.1"),
        ("[request]\ntop_p = inf", "request.top_p is inf, expected 0 to 1"),
        ("[request]\ntop_p = 1.5", "request.top_p is 1.5"),
        ("[request.extra]\nmin_p = nan", "request.extra.min_p is no finite number"),
        ("[budget]\nmax_cost = nan", "budget.max_cost is NaN"),
        ("[budget]\nmax_minutes = -1.0", "budget.max_minutes is -1"),
        ("[budget]\ntokens = -1", "expected an integer from 0 to 9223372036854775807"),
        ("[budget]\nrequests = 1.5", "expected an integer from 0 to 9223372036854775807"),
        (
            "[budget]\nrequests = 99999999999999999999",
            "line 2: 99999999999999999999 exceeds 64 bits",
        ),
        ("[price]\nprompt_per_million = inf", "price.prompt_per_million is inf"),
    ] {
        fs::write(at.join("llm.toml"), format!("{text}\n")).expect("the disk has space");
        let config = ["--llm-config", "llm.toml"];
        let check = ["llm", "check", "--endpoint", &url, "--model", "m"];
        for command in [&play(&url, "r")[..], &check] {
            let message = run_err(at, &[command, &config].concat());
            assert!(message.contains(words), "{text}: {message}");
        }
    }
    assert_eq!(server.stats().requests, 0);
    assert!(!at.join("r").exists());
}

#[test]
fn prompts_contain_failed_attempts_that_the_behavior_network_recognizes() {
    /// Maximum difference between the end of an attempt and its recognition, frames.
    const TOLERANCE: u64 = 120;
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    // Prompts without and with images: of `llm` and `vlm`.
    let prompts = Arc::new(Mutex::new([String::new(), String::new()]));
    let record = Arc::clone(&prompts);
    // The helper follows the partner whenever it can.
    let say = move |question: &chaic_llm_standin::script::Question| {
        let has_images = usize::from(question.images > 0);
        record.lock().expect("no panic")[has_images].push_str(&question.text);
        let follow = question.plans().iter().position(|plan| plan.contains("follow the partner"));
        question.format_answer(follow.map_or(1, |k| k + 1), "It follows the partner.")
    };
    let server = standin(Options {
        response_mode: ResponseMode::Function(Box::new(say)),
        ..Options::default()
    });
    let episode = ["--task", "high_target", "--split", "gen-standard:5019..5020"];
    let options = ["--behavior", "learned", "--size", "128", "--helper", "llm,vlm", "--out", "run"];
    let endpoint = ["--endpoint", &server.url(), "--model", "standin"];
    run_ok(at, &[&["eval"][..], &episode, &options, &endpoint].concat());
    let prompts = prompts.lock().expect("no panic");
    for (helper, prompts) in [("llm", &prompts[0]), ("vlm", &prompts[1])] {
        let trace = at.join("run/traces/high_target").join(helper);
        let trace = fs::read_to_string(trace.join("gen-standard-5019-s0.jsonl"));
        let trace = trace.expect("a text file");
        let events = trace.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        let failed = events.filter_map(|event| {
            let is_failure = event["agent"] == 0 && event["outcome"]["failure"] == "beyond_limits";
            let object = event["action"]["pick_up"]["object"].as_u64()?;
            is_failure.then(|| Some((event["frame"].as_u64()?, object)))?
        });
        let failed: Vec<(u64, u64)> = failed.collect();
        // Lines such as "- frame 216: pick up apple #87, failed (beyond this person's limits)".
        let recognized = |(frame, object): &(u64, u64)| {
            prompts.lines().any(|line| {
                let line =
                    line.strip_prefix("- frame ").and_then(|rest| rest.split_once(": pick up "));
                line.is_some_and(|(at, what)| {
                    let at: Option<u64> = at.parse().ok();
                    let is_near = at.is_some_and(|at| at.abs_diff(*frame) <= TOLERANCE);
                    is_near && what.contains(&format!(" #{object}, failed (beyond"))
                })
            })
        };
        let is_recognized = !failed.is_empty() && failed.iter().any(recognized);
        assert!(is_recognized, "{helper}: {failed:?}");
    }
    let report = fs::read_to_string(at.join("run/report.md")).expect("a text file");
    assert!(report.contains("LLM+BM") && report.contains("VLM+BM"), "{report}");
}

#[test]
fn shards_with_a_language_model_are_played_in_one_folder() {
    let dir = short_episodes();
    let at = dir.path();
    let server = standin(Options::default());
    let url = server.url();
    let out = output_of(at, &[&play(&url, "run")[..], &["--shard", "1/2"]].concat());
    let message = text(&out.stderr);
    assert!(out.status.success() && message.contains("can't be merged"), "{message}");
    assert!(message.contains("--resume --out run --shard I/N"), "{message}");
    assert!(!message.contains("chaic merge"), "{message}");
    let resume = ["eval", "--resume", "--out", "run", "--endpoint", &url, "--shard", "2/2"];
    assert!(run_ok(at, &resume).contains("LLM"));
}

#[test]
fn no_control_character_reaches_the_terminal() {
    const EVIL: &str = "\u{1b}]0;owned\u{7}\u{1b}[2J\r\u{9b}31m\u{202e}";
    let dir = short_episodes();
    let at = dir.path();
    let say = |question: &chaic_llm_standin::script::Question| {
        question.format_answer(1, &format!("Dear {EVIL} reader."))
    };
    let server = standin(Options {
        response_mode: ResponseMode::Function(Box::new(say)),
        ..Options::default()
    });
    let url = server.url();
    run_ok(at, &play(&url, "run"));
    let shown = run_ok(at, &["llm", "show", "run", "no_constraint/gen/0"]);
    assert!(shown.contains("Dear ") && shown.contains("\\u001b]0;owned\\u0007"), "{shown}");

    let escaped = serde_json::to_string(EVIL).expect("a text is JSON");
    let inner = escaped.trim_matches('"');
    let episode = at.join("short/no_constraint-0.json");
    let good = fs::read_to_string(&episode).expect("a text file");
    fs::write(at.join("field.json"), good.replacen('{', &format!("{{{escaped}: 1,"), 1))
        .expect("the disk has space");
    fs::write(at.join("id.json"), good.replace("no_constraint/gen/0", inner))
        .expect("the disk has space");
    fs::write(
        at.join("class.json"),
        good.replacen("\"class\": \"", &format!("\"class\": \"{inner}"), 1),
    )
    .expect("the disk has space");
    let trace = at.join("run/traces/no_constraint/llm/gen-0-s0.jsonl");
    let lines = fs::read_to_string(&trace).expect("a text file");
    let altered = lines.replacen("\"turn_left\"", &escaped, 1).replacen("\"explore\"", &escaped, 1);
    assert_ne!(altered, lines);
    fs::write(&trace, altered).expect("the disk has space");
    for arguments in [
        &["llm", "show", "run", "no_constraint/gen/0"][..],
        &["episodes", "validate", "field.json", "id.json", "class.json"],
        &["episodes", "show", "field.json", "--out", "x.png"],
        &["episodes", "show", EVIL, "--out", "x.png"],
        &["episodes", "show", "id.json", "--out", "x.png"],
        &["eval", "--episodes", EVIL, "--out", "r"],
        &["verify", "run"],
        &["replay", "run", "no_constraint/gen/0", "--helper", "llm", "--out", "x.gif"],
        &["report", "run", "--from-traces"],
        &["llm", "check", "--endpoint", &url, "--model", EVIL],
    ] {
        let out = output_of(at, arguments);
        let printed = text(&out.stdout) + &text(&out.stderr);
        let is_evil = |c: char| c.is_control() && c != '\n' && c != '\t' || c == '\u{202e}';
        assert!(!printed.is_empty() && !printed.contains(is_evil), "{arguments:?}: {printed:?}");
    }
    let message = run_err(at, &["episodes", "validate", "field.json"]);
    assert!(message.contains("\\u001b"), "what was there is reply: {message}");
}

#[test]
fn a_record_without_a_trace_is_shown() {
    let dir = short_episodes();
    let at = dir.path();
    let server = standin(Options::default());
    let url = server.url();
    run_ok(at, &[&play(&url, "run")[..], &["--no-traces"]].concat());
    let show = ["llm", "show", "run", "no_constraint/gen/0"];
    let out = output_of(at, &show);
    let (shown, warning) = (text(&out.stdout), text(&out.stderr));
    assert!(shown.starts_with("no_constraint/gen/0 with helper llm, seed 0"), "{shown}");
    assert!(shown.contains("## Plans") && shown.contains(">>> frame "), "{shown}");
    assert!(out.status.success() && warning.contains("has no trace"), "{warning}");
    for wrong in [&["--seed", "1"], &["--agent", "partner"]] {
        let message = run_err(at, &[&show[..], wrong].concat());
        assert!(message.contains("has no trace of no_constraint/gen/0"), "{message}");
    }
}

/// Waits until `is_true`. After a timeout it kills `child` and fails.
#[cfg(unix)]
fn until(child: &mut Child, what: &str, mut is_true: impl FnMut(&mut Child) -> bool) {
    let began = Instant::now();
    while !is_true(child) {
        if began.elapsed() > Duration::from_secs(120) {
            child.kill().expect("it runs");
            panic!("{what} does not happen");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[cfg(unix)]
fn interrupt(child: &Child) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("there is a kill").success());
}

#[cfg(unix)]
#[test]
fn a_silent_endpoint_does_not_block_ctrl_c() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    const ANSWERED: usize = 2;
    let dir = short_episodes();
    let at = dir.path();
    let asked = AtomicUsize::new(0);
    let say = move |question: &chaic_llm_standin::script::Question| {
        if asked.fetch_add(1, Ordering::SeqCst) < ANSWERED {
            return question.answer();
        }
        loop {
            std::thread::park();
        }
    };
    let stalls = standin(Options {
        response_mode: ResponseMode::Function(Box::new(say)),
        ..Options::default()
    });
    fs::write(at.join("slow.toml"), "[endpoint]\ntimeout_secs = 86400.0\n")
        .expect("the disk has space");
    let url = stalls.url();
    let task = ["--llm-config", "slow.toml", "--task", "no_constraint"];
    let mut child = start(at, &[&play(&url, "run")[..], &task].concat());
    until(&mut child, "the stalled question", |_| stalls.stats().requests > ANSWERED);
    interrupt(&child);
    until(&mut child, "its end", |child| child.try_wait().expect("it can be asked").is_some());
    let ended = child.wait_with_output().expect("it has ended");
    let message = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(130), "{message}");
    let options = ["--llm-config", "slow.toml", "--model", "standin"];
    let hint = format!("chaic eval --resume --out run --endpoint {url} {}", options.join(" "));
    assert!(message.contains(&hint), "{message}");

    let record = at.join("run/llm/no_constraint/llm/gen-0-s0.helper.jsonl");
    let record = fs::read_to_string(record).expect("a text file");
    assert!(record.ends_with('\n'));
    let is_whole = |line: &str| serde_json::from_str::<serde_json::Value>(line).is_ok();
    assert!(record.lines().all(is_whole), "{record}");
    let answers = record.lines().filter(|line| line.contains("\"answer\":{")).count();
    assert_eq!(answers, ANSWERED, "{record}");
    let shown = run_ok(at, &["llm", "show", "run", "no_constraint/gen/0", "--brief"]);
    assert!(shown.contains(&format!("{ANSWERED:>8} questions")), "{shown}");

    let answers = standin(Options::default());
    let url = answers.url();
    let resume = ["eval", "--resume", "--out", "run", "--endpoint", &url];
    assert!(run_ok(at, &[&resume[..], &options].concat()).contains("LLM"));
    let whole = [&play(&url, "whole")[..], &task].concat();
    run_ok(at, &whole);
    let scores = |run: &str| run_ok(at, &["report", run, "--format", "json"]);
    assert_eq!(scores("run"), scores("whole"), "a resumed run has the same scores");
    assert!(run_ok(at, &["verify", "run"]).contains("1 trace"));
}

#[cfg(unix)]
#[test]
fn a_lost_endpoint_is_reported_while_it_is_retried() {
    use std::io::{BufRead as _, BufReader};
    let dir = short_episodes();
    let at = dir.path();
    let gone = standin(Options::default());
    let url = gone.url();
    drop(gone);
    let mut child = start(at, &play(&url, "run"));
    let stderr = child.stderr.take().expect("it is piped");
    let mut lines = BufReader::new(stderr).lines().map(|line| line.expect("a text file"));
    let message = lines.find(|line| line.contains("cannot be reached"));
    let message = message.expect("it says so");
    assert!(
        message.contains("at the moment: the connection failed (connection refused)"),
        "{message}"
    );
    interrupt(&child);
    until(&mut child, "its end", |child| child.try_wait().expect("it can be asked").is_some());
    assert_eq!(child.wait().expect("it has ended").code(), Some(130));
    let message: Vec<String> = lines.collect();
    assert!(
        message.iter().any(|line| line.contains("chaic eval --resume --out run")),
        "{message:?}"
    );
    let back = standin(Options::default());
    run_ok(at, &["eval", "--resume", "--out", "run", "--endpoint", &back.url()]);
}
