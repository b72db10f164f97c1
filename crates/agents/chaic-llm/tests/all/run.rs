//! A run with language helpers, from the prompt to the score: it is whole, it plays again offline
//! bit for bit, it goes on where it was cut short, and nothing that was answered is asked twice.

use std::sync::atomic::{AtomicUsize, Ordering};

use chaic_core::TaskId;
use chaic_env::minds::Helpers as _;
use chaic_eval::run::RunFolder;
use chaic_eval::verify::verify_run;
use chaic_llm::exchange::{By, Purpose, Reply};
use chaic_llm::settings::{Fallback, Form, PictureFormat, Steps, Then};
use chaic_llm::{Language, record};
use chaic_llm_standin::{Manner, Options};

use crate::common::{Bench, decided, exchanges, files, flag, standin, summary};

#[test]
fn it_plays_again_offline_bit_for_bit() {
    let bench = Bench::new(&[TaskId::NoConstraint, TaskId::Shopping], 400);
    let (standin, mut settings) = standin(Options::default());
    // The charge for thinking is part of what is recorded.
    settings.asking.frames_per_second = 200.0;
    let given = bench.given(&["none", "llm", "llm-told", "vlm"]);
    let language = Language::live(settings, flag()).unwrap();
    let (is_whole, results) = bench.play("live", &given, &language);
    assert!(is_whole && results.len() == 8);
    let asked = standin.seen();
    assert!(asked.answered > 20 && asked.pictures > 10, "{asked:?}");
    assert_eq!(asked.with_schema, asked.answered);
    drop(standin);
    for result in results.iter().filter(|r| r.key.helper != "none") {
        let counts = &summary(result).counts;
        assert!(counts["helper.decisions"] > 2, "{counts:?}");
        assert_eq!(counts["helper.decided_by_model"], counts["helper.decisions"]);
        assert!(counts["helper.thinking_frames"] > 0);
    }

    let replay = Language::replay(&bench.path("live"), flag()).unwrap();
    assert!(!replay.waits("llm"));
    let (is_whole, again) = bench.play("again", &given, &replay);
    assert_eq!(replay.problem(), None);
    assert!(is_whole);
    assert_eq!(again, results);
    for folder in ["traces", "llm/no_constraint", "llm/shopping"] {
        let [live, again] = ["live", "again"].map(|run| files(&bench.path(run).join(folder)));
        assert!(!live.is_empty() && live == again, "{folder} differs");
    }

    // Traces say what they were granted, and hold it.
    let (folder, options) = RunFolder::read(&bench.path("live")).unwrap();
    let offline = Language::recorded(&bench.path("live"), flag()).unwrap().unwrap();
    let verdict = verify_run(&folder, &options, &offline, 2, &|_| {}).unwrap();
    assert!(verdict.mismatches.is_empty(), "{:?}", verdict.mismatches);
    let trace = |helper: &str| {
        let path = bench.path("live/traces/shopping").join(helper).join("short-0-s0.jsonl");
        std::fs::read_to_string(path).unwrap().lines().next().unwrap().to_owned()
    };
    assert!(trace("llm-told").contains("\"task\":true") && !trace("llm").contains("\"task\":true"));
}

#[test]
fn a_replay_of_something_else_stops_and_says_why() {
    let bench = Bench::new(&[TaskId::NoConstraint], 200);
    let (_standin, settings) = standin(Options::default());
    let live = Language::live(settings, flag()).unwrap();
    bench.play("live", &bench.given(&["llm"]), &live);
    let mut other = bench.given(&["llm"]);
    other.size = Some(96);
    let replay = Language::replay(&bench.path("live"), flag()).unwrap();
    let (is_whole, results) = bench.play("other", &other, &replay);
    assert!(!is_whole && results.is_empty());
    let problem = replay.problem().unwrap();
    assert!(problem.contains("replay differs at frame"), "{problem}");
    let missing = Language::replay(&bench.path("nowhere"), flag());
    assert!(missing.err().unwrap().to_string().contains("no record"));
}

#[test]
fn what_was_answered_is_not_asked_again_after_a_pause() {
    let bench = Bench::new(&[TaskId::NoConstraint], 400);
    let given = bench.given(&["llm"]);
    let (standin, settings) = standin(Options::default());
    let whole = Language::live(settings.clone(), flag()).unwrap();
    let (_, expected) = bench.play("whole", &given, &whole);
    let n_whole = standin.seen().answered;
    assert!(n_whole > 4);
    // The same with a budget of two requests a session: it pauses again and again.
    let mut sessions = 0;
    let results = loop {
        sessions += 1;
        let mut settings = settings.clone();
        settings.budget.requests = Some(2 * sessions);
        let language = Language::live(settings, flag()).unwrap();
        let (is_whole, results) = bench.play("cut", &given, &language);
        if is_whole {
            break results;
        }
        let problem = language.problem().unwrap();
        assert!(problem.contains("budget of requests"), "{problem}");
    };
    assert_eq!(standin.seen().answered, 2 * n_whole, "each question was asked once");
    assert_eq!(sessions, (n_whole as u64).div_ceil(2));
    assert_eq!(results, expected);
    assert_eq!(
        files(&bench.path("whole/traces")),
        files(&bench.path("cut/traces")),
        "a run that was cut short is the same"
    );
    // It is gone on with as it was begun only.
    let mut other = settings;
    other.asking.temperature = Some(0.1);
    let language = Language::live(other, flag()).unwrap();
    let refused = language.attach(&bench.path("cut")).unwrap_err().to_string();
    assert!(refused.contains("asking.temperature 0.7, not 0.1"), "{refused}");
}

#[test]
fn budgets_are_overrun_by_one_request_at_most_and_the_fallback_goes_on() {
    let bench = Bench::new(&[TaskId::NoConstraint, TaskId::HighTarget, TaskId::Obstacle], 300);
    let given = bench.given(&["llm", "llm-told"]);
    for (k, money) in [None, Some(0.004)].into_iter().enumerate() {
        let (standin, mut settings) = standin(Options::default());
        settings.budget.then = Then::Fallback;
        settings.asking.fallback = Fallback::Rules;
        settings.price.prompt_per_million = 1.0;
        settings.price.answer_per_million = 2.0;
        settings.budget.money = money;
        settings.budget.tokens = money.is_none().then_some(3000);
        let language = Language::live(settings, flag()).unwrap();
        let (is_whole, results) = bench.play(&format!("run{k}"), &given, &language);
        assert!(is_whole && results.len() == 6);
        let spent = language.spent().unwrap();
        let dearest = bench
            .records(&format!("run{k}"))
            .iter()
            .flat_map(|r| exchanges(r).iter().map(|e| e.usage()).collect::<Vec<_>>())
            .map(|u| u.prompt + u.answer)
            .max()
            .unwrap();
        match money {
            None => assert!((3000..3000 + dearest).contains(&spent.tokens), "{spent:?}"),
            Some(money) => {
                let most = money + 2.0 * dearest as f64 / 1e6;
                assert!(spent.money >= money && spent.money < most, "{spent:?}");
            }
        }
        assert_eq!(spent.requests as usize, standin.seen().requests);
        let n = |name: &str| -> u64 {
            results.iter().filter_map(|r| summary(r).counts.get(name)).sum()
        };
        assert!(n("helper.fallback_budget") > 0);
        let by_fallback =
            n("helper.decisions") - n("helper.decided_by_model") - n("helper.only_plan");
        assert_eq!(by_fallback, n("helper.fallback_budget"));
    }
}

#[test]
fn two_steps_texts_and_refused_schemas() {
    let bench = Bench::new(&[TaskId::LowTarget], 250);
    let given = bench.given(&["vlm"]);
    let (server, mut settings) = standin(Options::default());
    settings.asking.steps = Steps::Two;
    settings.asking.images.format = PictureFormat::Jpeg;
    settings.asking.images.count = 3;
    let language = Language::live(settings.clone(), flag()).unwrap();
    assert!(bench.play("two", &given, &language).0);
    for record in bench.records("two") {
        let purposes: Vec<Purpose> = exchanges(&record).iter().map(|e| e.ask.purpose).collect();
        let n = decided(&record).iter().filter(|d| d.by == By::Model).count();
        assert_eq!(purposes, [Purpose::Think, Purpose::Choose].repeat(n));
        for exchange in exchanges(&record) {
            assert!(exchange.ask.messages[0].images.len() <= 3);
        }
    }
    assert_eq!(server.seen().with_schema, 0);
    drop(server);

    let (server, mut settings) = standin(Options { refuses_schema: true, ..Options::default() });
    let language = Language::live(settings.clone(), flag()).unwrap();
    let (is_whole, results) = bench.play("refused", &given, &language);
    assert!(is_whole);
    assert_eq!(server.seen().with_schema, 1, "it is tried once in an episode");
    assert!(!summary(&results[0]).counts.contains_key("helper.fallback_fault"));
    settings.asking.form = Form::Schema;
    let language = Language::live(settings, flag()).unwrap();
    assert!(!bench.play("insists", &given, &language).0);
    assert!(language.problem().unwrap().contains("asking.form"));
}

#[test]
fn an_answer_of_no_use_is_asked_for_again_once_with_the_reason() {
    let bench = Bench::new(&[TaskId::NoConstraint], 150);
    for (fallback, plan) in
        [(Fallback::Explore, "explore"), (Fallback::Wait, "wait"), (Fallback::Rules, "turn around")]
    {
        let say = |_: &chaic_llm_standin::script::Question| "I would rather not.".to_owned();
        let manner = Manner::Say(Box::new(say));
        let (standin, mut settings) = standin(Options { manner, ..Options::default() });
        settings.asking.fallback = fallback;
        let name = format!("{fallback:?}");
        let language = Language::live(settings, flag()).unwrap();
        let (is_whole, results) = bench.play(&name, &bench.given(&["llm"]), &language);
        assert!(is_whole);
        let counts = &summary(&results[0]).counts;
        let n = counts["helper.decisions"];
        assert_eq!(counts["helper.fallback_invalid"], n);
        assert_eq!(counts["helper.asked_again"], n);
        assert_eq!(standin.seen().answered as u64, 2 * n);
        assert!(standin.seen().last_text.contains("can't be used: it doesn't name the number"));
        let record = &bench.records(&name)[0];
        assert_eq!(decided(record)[0].plan, plan);
    }
}

#[test]
fn the_partner_may_be_driven_by_a_model_too() {
    let bench = Bench::new(&[TaskId::Obstacle, TaskId::Shopping], 300);
    let (standin, settings) = standin(Options::default());
    let mut given = bench.given(&["none", "rhp"]);
    given.partner = Some("llm".to_owned());
    let language = Language::live(settings, flag()).unwrap();
    let (is_whole, results) = bench.play("run", &given, &language);
    assert!(is_whole && results.len() == 4);
    for record in bench.records("run") {
        let text = &exchanges(&record)[0].ask.messages[0].text;
        assert!(text.contains("Wanted: "), "it knows its goal");
        assert!(!text.contains("remove the obstacle"), "obstacles are left to others");
    }
    let seen = standin.seen();
    assert!(seen.answered > 4 && seen.pictures == 0);
    assert!(summary(&results[0]).counts["partner.decisions"] > 1);
    let header = std::fs::read_to_string(bench.path("run/traces/obstacle/rhp/short-0-s0.jsonl"));
    assert!(header.unwrap().lines().next().unwrap().contains("\"partner\":\"llm\""));
    let path = record::path(&bench.path("run"), &results[0].key, chaic_core::AgentId::PARTNER);
    assert!(path.exists());
}

#[test]
fn sixteen_questions_in_flight_hold_nobody_up() {
    use std::sync::{Arc, Condvar, Mutex};
    // Nothing is answered until sixteen questions are there, and every episode that asks nobody
    // has been played to its end: were those held up, nobody would ever go on.
    let bench = Bench::new(&TaskId::paper().collect::<Vec<_>>(), 60);
    let open = Arc::new((Mutex::new(false), Condvar::new()));
    let waiting = Arc::new(AtomicUsize::new(0));
    let say = {
        let (open, waiting) = (Arc::clone(&open), Arc::clone(&waiting));
        move |question: &chaic_llm_standin::script::Question| {
            waiting.fetch_add(1, Ordering::SeqCst);
            let (lock, changed) = &*open;
            let is_open = lock.lock().unwrap();
            drop(changed.wait_while(is_open, |is_open| !*is_open).unwrap());
            question.answer()
        }
    };
    let (standin, mut settings) =
        standin(Options { manner: Manner::Say(Box::new(say)), ..Options::default() });
    settings.endpoint.timeout_secs = 600.0;
    settings.endpoint.in_flight = 16;
    let language = Language::live(settings, flag()).unwrap();
    let mut given = bench.given(&["none", "random", "llm", "llm-told"]);
    given.seeds = Some(2);
    let path = bench.path("run");
    let access = chaic_eval::run::Access::Begin;
    let (mut run, _) = chaic_eval::run::Run::open(&path, access, &given, &language).unwrap();
    language.attach(&path).unwrap();
    let mut n_others = 0;
    let stop = language.stop();
    let is_whole = run.play(1, &language, stop, &mut |progress| {
        if let chaic_eval::run::Progress::Finished(finished) = progress
            && !finished.result.key.helper.starts_with("llm")
        {
            n_others += 1;
            if n_others == 32 {
                while waiting.load(Ordering::SeqCst) < 16 {
                    std::thread::yield_now();
                }
                *open.0.lock().unwrap() = true;
                open.1.notify_all();
            }
        }
    });
    assert!(is_whole.unwrap());
    assert_eq!(run.results().len(), 64);
    assert_eq!(standin.seen().most_in_flight, 16);
}

#[test]
fn a_reply_is_on_the_disk_as_it_came() {
    let bench = Bench::new(&[TaskId::HighGoal], 120);
    let (_standin, settings) = standin(Options::default());
    let language = Language::live(settings, flag()).unwrap();
    bench.play("run", &bench.given(&["llm"]), &language);
    for exchange in exchanges(&bench.records("run")[0]) {
        assert_eq!(exchange.damage(), None);
        let Reply::Answer { text, usage, .. } = &exchange.reply else { panic!("{exchange:?}") };
        assert!(text.contains("not a language model") && usage.prompt > 100 && !usage.estimated);
    }
}
