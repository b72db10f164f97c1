//! Whom a run with a language model asks, and what it prints: keys and questions go to nobody whom
//! the user hasn't named, an endpoint that says nothing holds nobody up, and control characters stay
//! what they are: characters.

use std::time::{Duration, Instant};

use chaic_llm_standin::{Manner, Options, StandIn};

use crate::*;

const LLM: [&str; 6] = ["eval", "--episodes", "short", "--size", "48", "--helper"];

fn standin(options: Options) -> StandIn {
    StandIn::start(options).expect("a port is free")
}

fn play<'a>(url: &'a str, out: &'a str) -> Vec<&'a str> {
    [&LLM[..], &["llm", "--endpoint", url, "--model", "standin", "--out", out]].concat()
}

#[test]
fn a_run_folder_does_not_decide_who_is_asked_with_which_key() {
    let dir = workshop();
    let at = dir.path();
    let (mine, theirs) = (standin(Options::default()), standin(Options::default()));
    let url = mine.url();
    well(at, &play(&url, "run"));
    let n_asked = mine.seen().requests;
    // Somebody else's folder: another address, a variable that holds a secret, something to ask.
    let path = at.join("run/llm/settings.json");
    let recorded = fs::read_to_string(&path).expect("it is text");
    let forged = recorded
        .replace(&url, &theirs.url())
        .replace("\"key_env\": null", "\"key_env\": \"CHAIC_TEST_SECRET\"");
    assert!(forged.contains(&theirs.url()) && forged.contains("CHAIC_TEST_SECRET"), "{recorded}");
    fs::write(&path, forged).expect("there is room");
    fs::remove_dir_all(at.join("run/llm/no_constraint")).expect("it is there");
    fs::remove_file(at.join("run/results.jsonl")).expect("it is there");
    let resume = |more: &[&str]| {
        let arguments = [&["eval", "--resume", "--out", "run"], more].concat();
        let mut command = command(at, &arguments);
        command.env("CHAIC_TEST_SECRET", "sesame").output().expect("the command starts")
    };
    for more in [&[][..], &["--endpoint", &url], &["--llm-key-env", "CHAIC_TEST_SECRET"]] {
        let out = resume(more);
        let said = text(&out.stderr);
        assert!(!out.status.success(), "{more:?} goes on");
        for words in [&theirs.url(), "CHAIC_TEST_SECRET", "--endpoint"] {
            assert!(said.contains(words), "{words}: {said}");
        }
        assert!(!said.contains("sesame") && said.lines().count() == 1, "{said}");
    }
    assert_eq!((mine.seen().requests, theirs.seen().requests), (n_asked, 0));
    let out = resume(&["--endpoint", &url, "--llm-key-env", ""]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(mine.seen().requests > n_asked && theirs.seen().requests == 0);
    // A run that was stopped before it had recorded whom it asks is begun with them again.
    fs::remove_dir_all(at.join("run/llm")).expect("it is there");
    fs::remove_file(at.join("run/results.jsonl")).expect("it is there");
    assert!(text(&resume(&["--endpoint", &url]).stderr).contains("give --model"));
    let out = resume(&["--endpoint", &url, "--model", "standin"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
}

#[test]
fn what_goes_over_the_wire_in_the_open_is_asked_for() {
    let dir = workshop();
    let at = dir.path();
    let url = "http://models.example.org/v1";
    for command in [&["llm", "check"][..], &[&LLM[..], &["llm", "--out", "r"]].concat()] {
        let ask = [command, &["--endpoint", url, "--model", "m"]].concat();
        let said = ill(at, &ask);
        assert!(said.contains("plain http to another machine"), "{said}");
        assert!(said.contains("--llm-allow-http"), "{said}");
        // With the flag it goes on, to the key that isn't there.
        let key = ["--llm-allow-http", "--llm-key-env", "CHAIC_TEST_NO_KEY"];
        let said = ill(at, &[&ask[..], &key].concat());
        assert!(said.contains("CHAIC_TEST_NO_KEY holds no key"), "{said}");
        let said = ill(at, &[&ask[..], &["--llm-allow-http", "--llm-key-env", "sk-1"]].concat());
        assert!(said.contains("endpoint.key_env is no name") && !said.contains("sk-1"), "{said}");
    }
    assert!(!at.join("r").exists());
}

#[test]
fn settings_that_are_no_numbers_are_refused() {
    let dir = workshop();
    let at = dir.path();
    let server = standin(Options::default());
    let url = server.url();
    for (text, words) in [
        ("[asking]\ntemperature = nan", "asking.temperature is NaN, expected 0 to 2"),
        ("[asking]\ntemperature = -0.1", "asking.temperature is -0.1"),
        ("[asking]\ntop_p = inf", "asking.top_p is inf, expected 0 to 1"),
        ("[asking]\ntop_p = 1.5", "asking.top_p is 1.5"),
        ("[asking.extra]\nmin_p = nan", "asking.extra.min_p is no finite number"),
        ("[budget]\nmoney = nan", "budget.money is NaN"),
        ("[budget]\nminutes = -1.0", "budget.minutes is -1"),
        ("[budget]\ntokens = -1", "expected u64"),
        ("[budget]\nrequests = 1.5", "expected u64"),
        ("[price]\nprompt_per_million = inf", "price.prompt_per_million is inf"),
    ] {
        fs::write(at.join("llm.toml"), format!("{text}\n")).expect("there is room");
        let config = ["--llm-config", "llm.toml"];
        let check = ["llm", "check", "--endpoint", &url, "--model", "m"];
        for command in [&play(&url, "r")[..], &check] {
            let said = ill(at, &[command, &config].concat());
            assert!(said.contains(words), "{text}: {said}");
        }
    }
    assert_eq!(server.seen().requests, 0);
    assert!(!at.join("r").exists());
}

#[test]
fn no_control_character_gets_to_the_terminal() {
    const EVIL: &str = "\u{1b}]0;owned\u{7}\u{1b}[2J\r\u{9b}31m\u{202e}";
    let dir = workshop();
    let at = dir.path();
    let say = |question: &chaic_llm_standin::script::Question| {
        question.form(1, &format!("Dear {EVIL} reader."))
    };
    let server = standin(Options { manner: Manner::Say(Box::new(say)), ..Options::default() });
    let url = server.url();
    well(at, &play(&url, "run"));
    let shown = well(at, &["llm", "show", "run", "no_constraint/gen/0"]);
    assert!(shown.contains("Dear ") && shown.contains("\\u001b]0;owned\\u0007"), "{shown}");

    let escaped = serde_json::to_string(EVIL).expect("a text is JSON");
    let inner = escaped.trim_matches('"');
    let episode = at.join("short/no_constraint-0.json");
    let good = fs::read_to_string(&episode).expect("it is text");
    fs::write(at.join("field.json"), good.replacen('{', &format!("{{{escaped}: 1,"), 1))
        .expect("there is room");
    fs::write(at.join("id.json"), good.replace("no_constraint/gen/0", inner))
        .expect("there is room");
    fs::write(
        at.join("class.json"),
        good.replacen("\"class\": \"", &format!("\"class\": \"{inner}"), 1),
    )
    .expect("there is room");
    let trace = at.join("run/traces/no_constraint/llm/gen-0-s0.jsonl");
    let lines = fs::read_to_string(&trace).expect("it is text");
    let altered = lines.replacen("\"turn_left\"", &escaped, 1).replacen("\"explore\"", &escaped, 1);
    assert_ne!(altered, lines);
    fs::write(&trace, altered).expect("there is room");
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
        let out = chaic(at, arguments);
        let printed = text(&out.stdout) + &text(&out.stderr);
        let is_evil = |c: char| c.is_control() && c != '\n' && c != '\t' || c == '\u{202e}';
        assert!(!printed.is_empty() && !printed.contains(is_evil), "{arguments:?}: {printed:?}");
    }
    let said = ill(at, &["episodes", "validate", "field.json"]);
    assert!(said.contains("\\u001b"), "what was there is told: {said}");
}

/// Waits until `is_true`; where it never is, the test has failed, and `child` is ended.
#[cfg(unix)]
fn until(child: &mut Child, what: &str, mut is_true: impl FnMut(&mut Child) -> bool) {
    let began = Instant::now();
    while !is_true(child) {
        if began.elapsed() > Duration::from_secs(120) {
            child.kill().expect("it runs");
            panic!("{what} doesn't come about");
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
fn an_endpoint_that_says_nothing_holds_up_nobody_who_stops_the_run() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    const ANSWERED: usize = 2;
    let dir = workshop();
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
    let stalls = standin(Options { manner: Manner::Say(Box::new(say)), ..Options::default() });
    fs::write(at.join("slow.toml"), "[endpoint]\ntimeout_secs = 86400.0\n").expect("there is room");
    let url = stalls.url();
    let task = ["--llm-config", "slow.toml", "--task", "no_constraint"];
    let mut child = start(at, &[&play(&url, "run")[..], &task].concat());
    until(&mut child, "the stalled question", |_| stalls.seen().requests > ANSWERED);
    interrupt(&child);
    until(&mut child, "its end", |child| child.try_wait().expect("it can be asked").is_some());
    let ended = child.wait_with_output().expect("it has ended");
    let said = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(130), "{said}");
    let hint = format!("chaic eval --resume --out run --endpoint {url} --llm-config slow.toml");
    assert!(said.contains(&hint), "{said}");

    let record = at.join("run/llm/no_constraint/llm/gen-0-s0.helper.jsonl");
    let record = fs::read_to_string(record).expect("it is text");
    assert!(record.ends_with('\n'));
    let is_whole = |line: &str| serde_json::from_str::<serde_json::Value>(line).is_ok();
    assert!(record.lines().all(is_whole), "{record}");
    let answers = record.lines().filter(|line| line.contains("\"answer\":{")).count();
    assert_eq!(answers, ANSWERED, "{record}");

    let answers = standin(Options::default());
    let url = answers.url();
    let resume = ["eval", "--resume", "--out", "run", "--endpoint", &url];
    assert!(well(at, &resume).contains("LLM"));
    let whole = [&play(&url, "whole")[..], &task].concat();
    well(at, &whole);
    let scores = |run: &str| well(at, &["report", run, "--format", "json"]);
    assert_eq!(scores("run"), scores("whole"), "a run that was cut short is the same");
    assert!(well(at, &["verify", "run"]).contains("1 trace"));
}

#[cfg(unix)]
#[test]
fn an_endpoint_that_is_gone_says_so_while_it_is_tried() {
    use std::io::{BufRead as _, BufReader};
    let dir = workshop();
    let at = dir.path();
    let gone = standin(Options::default());
    let url = gone.url();
    drop(gone);
    let mut child = start(at, &play(&url, "run"));
    let stderr = child.stderr.take().expect("it is piped");
    let mut lines = BufReader::new(stderr).lines().map(|line| line.expect("it is text"));
    let told = lines.find(|line| line.contains("can't be asked"));
    let told = told.expect("it says so");
    assert!(told.contains("just now: the connection failed (connection refused)"), "{told}");
    interrupt(&child);
    until(&mut child, "its end", |child| child.try_wait().expect("it can be asked").is_some());
    assert_eq!(child.wait().expect("it has ended").code(), Some(130));
    let said: Vec<String> = lines.collect();
    assert!(said.iter().any(|line| line.contains("chaic eval --resume --out run")), "{said:?}");
    let back = standin(Options::default());
    well(at, &["eval", "--resume", "--out", "run", "--endpoint", &back.url()]);
}
