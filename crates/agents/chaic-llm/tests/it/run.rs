//! Promises: a run with language helpers is complete, replays offline bit for bit, resumes after an
//! interruption, and sends no answered request twice.

use std::sync::atomic::{AtomicUsize, Ordering};

use chaic_core::TaskId;
use chaic_env::helper_registry::HelperRegistry as _;
use chaic_eval::run::RunFolder;
use chaic_eval::verify::verify_run;
use chaic_llm::exchange::{DecisionSource, Purpose, Reply};
use chaic_llm::settings::{AnswerForm, FailureAction, Fallback, ImageEncoding, PromptSteps};
use chaic_llm::{LanguageHelpers, record};
use chaic_llm_standin::{Options, ResponseMode};

use crate::common::{Fixture, decided, exchanges, files, flag, standin, summary};

#[test]
fn a_replay_is_identical_bit_for_bit() {
    let fixture = Fixture::new(&[TaskId::NoConstraint, TaskId::Shopping], 400);
    let (standin, mut settings) = standin(Options::default());
    // The charge for thinking is part of the record.
    settings.request.frames_per_second = 200.0;
    let request = fixture.request(&["none", "llm", "llm_known_task", "vlm"]);
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let (is_complete, results) = fixture.play("live", &request, &language);
    assert!(is_complete && results.len() == 8);
    let asked = standin.stats();
    assert!(asked.answered > 20 && asked.images > 10, "{asked:?}");
    assert_eq!(asked.with_schema, asked.answered);
    drop(standin);
    for result in results.iter().filter(|r| r.key.helper != "none") {
        let counts = &summary(result).counts;
        assert!(counts["helper.decisions"] > 2, "{counts:?}");
        assert_eq!(counts["helper.decided_by_model"], counts["helper.decisions"]);
        assert!(counts["helper.thinking_frames"] > 0);
    }

    let replay = LanguageHelpers::replay(&fixture.path("live"), flag()).unwrap();
    assert!(!replay.is_slow("llm"));
    let (is_complete, again) = fixture.play("again", &request, &replay);
    assert_eq!(replay.problem(), None);
    assert!(is_complete);
    assert_eq!(again, results);
    for folder in ["traces", "llm/no_constraint", "llm/shopping"] {
        let [live, again] = ["live", "again"].map(|run| files(&fixture.path(run).join(folder)));
        assert!(!live.is_empty() && live == again, "{folder} differs");
    }

    // Traces name their grants and contain the granted data.
    let (folder, options) = RunFolder::read(&fixture.path("live")).unwrap();
    let offline = LanguageHelpers::recorded(&fixture.path("live"), flag()).unwrap().unwrap();
    let report = verify_run(&folder, &options, &offline, 2, &|_| {}).unwrap();
    assert!(report.mismatches.is_empty(), "{:?}", report.mismatches);
    let trace = |helper: &str| {
        let path = fixture.path("live/traces/shopping").join(helper).join("short-0-s0.jsonl");
        std::fs::read_to_string(path).unwrap().lines().next().unwrap().to_owned()
    };
    assert!(
        trace("llm_known_task").contains("\"task\":true")
            && !trace("llm").contains("\"task\":true")
    );
}

#[test]
fn a_replay_of_another_run_stops_with_a_reason() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 200);
    let (_standin, settings) = standin(Options::default());
    let live = LanguageHelpers::live(settings, flag()).unwrap();
    fixture.play("live", &fixture.request(&["llm"]), &live);
    let mut other = fixture.request(&["llm"]);
    other.image_size = Some(96);
    let replay = LanguageHelpers::replay(&fixture.path("live"), flag()).unwrap();
    let (is_complete, results) = fixture.play("other", &other, &replay);
    assert!(!is_complete && results.is_empty());
    let problem = replay.problem().unwrap();
    assert!(problem.contains("replay differs at frame"), "{problem}");
    let missing = LanguageHelpers::replay(&fixture.path("nowhere"), flag());
    assert!(missing.err().unwrap().to_string().contains("no record"));
}

#[test]
fn answered_requests_are_not_repeated_after_a_pause() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 400);
    let request = fixture.request(&["llm"]);
    let (standin, settings) = standin(Options::default());
    let whole = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    let (_, expected) = fixture.play("whole", &request, &whole);
    let n_whole = standin.stats().answered;
    assert!(n_whole > 4);
    // With a budget of two requests a session, the run pauses repeatedly.
    let mut sessions = 0;
    let results = loop {
        sessions += 1;
        let mut settings = settings.clone();
        settings.budget.max_requests = Some(2 * sessions);
        let language = LanguageHelpers::live(settings, flag()).unwrap();
        let (is_complete, results) = fixture.play("cut", &request, &language);
        if is_complete {
            break results;
        }
        let problem = language.problem().unwrap();
        assert!(problem.contains("budget of requests"), "{problem}");
    };
    assert_eq!(standin.stats().answered, 2 * n_whole, "each question was asked once");
    assert_eq!(sessions, (n_whole as u64).div_ceil(2));
    assert_eq!(results, expected);
    assert_eq!(
        files(&fixture.path("whole/traces")),
        files(&fixture.path("cut/traces")),
        "an interrupted run has the same traces"
    );
    // Resuming requires equal settings.
    let mut other = settings;
    other.request.temperature = Some(0.1);
    let language = LanguageHelpers::live(other, flag()).unwrap();
    let error = language.attach(&fixture.path("cut")).unwrap_err().to_string();
    assert!(error.contains("request.temperature 0.7, not 0.1"), "{error}");
}

#[test]
fn no_answer_is_paid_for_that_the_record_may_have_no_room_for() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 60);
    let request = fixture.request(&["llm"]);
    let (standin, mut settings) = standin(Options::default());
    let max_answer_bytes = settings.endpoint.max_answer_bytes;
    // The record has less room.
    settings.endpoint.max_answer_bytes = 1 << 30;
    for _ in 0..2 {
        let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
        assert!(!fixture.play("run", &request, &language).0);
        let problem = language.problem().unwrap();
        assert!(problem.contains("may have no room for the next answer"), "{problem}");
    }
    assert_eq!(standin.stats().requests, 0);
    settings.endpoint.max_answer_bytes = max_answer_bytes;
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    assert!(fixture.play("run", &request, &language).0, "{:?}", language.problem());
}

#[test]
fn a_record_that_cannot_be_continued_stops_the_run_and_is_kept() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 60);
    let request = fixture.request(&["llm"]);
    let (standin, settings) = standin(Options::default());
    let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    let (_, results) = fixture.play("run", &request, &language);
    let n_asked = standin.stats().requests;
    // The episode is played again, but a line of its record has changed.
    let run = fixture.path("run");
    std::fs::remove_file(run.join("results.jsonl")).unwrap();
    let path = record::path(&run, &results[0].key, chaic_core::AgentId::HELPER);
    let whole = std::fs::read_to_string(&path).unwrap();
    let damaged = whole.replacen("\"ask_hash\":\"", "\"ask_hash\":\"x", 1);
    assert_ne!(damaged, whole);
    std::fs::write(&path, &damaged).unwrap();
    let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    assert!(!fixture.play("run", &request, &language).0);
    let problem = language.problem().unwrap();
    assert!(problem.contains("may hold paid answers") && problem.contains("line 2"), "{problem}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), damaged);
    assert_eq!(standin.stats().requests, n_asked);
    // Without it, the questions are asked again.
    std::fs::remove_file(&path).unwrap();
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    assert_eq!(fixture.play("run", &request, &language), (true, results));
    assert_eq!(standin.stats().requests, 2 * n_asked);
}

#[test]
fn budgets_are_exceeded_by_one_request_at_most_and_the_fallback_continues() {
    let fixture = Fixture::new(&[TaskId::NoConstraint, TaskId::HighTarget, TaskId::Obstacle], 300);
    let request = fixture.request(&["llm", "llm_known_task"]);
    for (k, money) in [None, Some(0.004)].into_iter().enumerate() {
        let (standin, mut settings) = standin(Options::default());
        settings.budget.on_exhausted = FailureAction::Fallback;
        settings.request.fallback = Fallback::Rules;
        settings.price.prompt_per_million = 1.0;
        settings.price.answer_per_million = 2.0;
        settings.budget.max_cost = money;
        settings.budget.max_tokens = money.is_none().then_some(3000);
        let language = LanguageHelpers::live(settings, flag()).unwrap();
        let (is_complete, results) = fixture.play(&format!("run{k}"), &request, &language);
        assert!(is_complete && results.len() == 6);
        let spent = language.spent().unwrap();
        let max_tokens = fixture
            .records(&format!("run{k}"))
            .iter()
            .flat_map(|r| exchanges(r).iter().map(|e| e.usage()).collect::<Vec<_>>())
            .map(|u| u.prompt + u.answer)
            .max()
            .unwrap();
        match money {
            None => assert!((3000..3000 + max_tokens).contains(&spent.tokens), "{spent:?}"),
            Some(money) => {
                let max_money = money + 2.0 * max_tokens as f64 / 1e6;
                assert!(spent.cost >= money && spent.cost < max_money, "{spent:?}");
            }
        }
        assert_eq!(spent.requests as usize, standin.stats().requests);
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
fn two_steps_and_refused_schemas_work() {
    let fixture = Fixture::new(&[TaskId::LowTarget], 250);
    let request = fixture.request(&["vlm"]);
    let (server, mut settings) = standin(Options::default());
    settings.request.steps = PromptSteps::Two;
    settings.request.images.format = ImageEncoding::Jpeg;
    settings.request.images.count = 3;
    let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    assert!(fixture.play("two", &request, &language).0);
    for record in fixture.records("two") {
        let purposes: Vec<Purpose> = exchanges(&record).iter().map(|e| e.request.purpose).collect();
        let n = decided(&record).iter().filter(|d| d.source == DecisionSource::Model).count();
        assert_eq!(purposes, [Purpose::Think, Purpose::Choose].repeat(n));
        for exchange in exchanges(&record) {
            assert!(exchange.request.messages[0].images.len() <= 3);
        }
    }
    assert_eq!(server.stats().with_schema, 0);
    drop(server);

    let (server, mut settings) = standin(Options { refuses_schema: true, ..Options::default() });
    let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    let (is_complete, results) = fixture.play("error", &request, &language);
    assert!(is_complete);
    assert_eq!(server.stats().with_schema, 1, "it is tried once in an episode");
    assert!(!summary(&results[0]).counts.contains_key("helper.fallback_fault"));
    settings.request.answer_format = AnswerForm::Schema;
    let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    assert!(!fixture.play("schema_only", &request, &language).0);
    assert!(language.problem().unwrap().contains("request.answer_format"));
    let (_other, accepting) = standin(Options::default());
    settings.endpoint.url = accepting.endpoint.url;
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let (is_complete, results) = fixture.play("schema_only", &request, &language);
    assert!(is_complete, "another endpoint continues the run: {:?}", language.problem());
    assert!(summary(&results[0]).counts["helper.decided_by_model"] > 0);
}

#[test]
fn blank_reasoning_is_not_sent_as_an_empty_message() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 100);
    let answer = |question: &chaic_llm_standin::script::Question| {
        if question.last.contains("step by step") { " ".to_owned() } else { question.answer() }
    };
    let response_mode = ResponseMode::Function(Box::new(answer));
    let (_standin, mut settings) = standin(Options { response_mode, ..Options::default() });
    settings.request.steps = PromptSteps::Two;
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    assert!(fixture.play("run", &fixture.request(&["llm"]), &language).0);
    let records = fixture.records("run");
    let choices = exchanges(&records[0]).into_iter();
    let choices: Vec<_> = choices.filter(|e| e.request.purpose == Purpose::Choose).collect();
    assert!(!choices.is_empty());
    for exchange in choices {
        assert_eq!(exchange.request.messages[1].text, "(nothing)");
    }
}

#[test]
fn an_invalid_answer_is_requested_once_more_with_the_reason() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 150);
    for (fallback, plan) in
        [(Fallback::Explore, "explore"), (Fallback::Wait, "wait"), (Fallback::Rules, "turn around")]
    {
        let answer = |_: &chaic_llm_standin::script::Question| "I would rather not.".to_owned();
        let response_mode = ResponseMode::Function(Box::new(answer));
        let (standin, mut settings) = standin(Options { response_mode, ..Options::default() });
        settings.request.fallback = fallback;
        let name = format!("{fallback:?}");
        let language = LanguageHelpers::live(settings, flag()).unwrap();
        let (is_complete, results) = fixture.play(&name, &fixture.request(&["llm"]), &language);
        assert!(is_complete);
        let counts = &summary(&results[0]).counts;
        let n = counts["helper.decisions"];
        assert_eq!(counts["helper.fallback_invalid"], n);
        assert_eq!(counts["helper.asked_again"], n);
        assert_eq!(standin.stats().answered as u64, 2 * n);
        assert!(standin.stats().last_text.contains("can't be used: it doesn't name the number"));
        let record = &fixture.records(&name)[0];
        assert_eq!(decided(record)[0].plan, plan);
    }
}

#[test]
fn an_answer_that_was_cut_off_is_requested_again() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 150);
    let answer = |_: &chaic_llm_standin::script::Question| {
        "{\"reasoning\": \"Plan 1 would be bad beca".to_owned()
    };
    let response_mode = ResponseMode::Function(Box::new(answer));
    let options = Options { response_mode, finish_reason: "length", ..Options::default() };
    let (standin, settings) = standin(options);
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let (is_complete, results) = fixture.play("run", &fixture.request(&["llm"]), &language);
    assert!(is_complete);
    let counts = &summary(&results[0]).counts;
    assert_eq!(counts["helper.fallback_invalid"], counts["helper.decisions"]);
    assert!(standin.stats().last_text.contains("can't be used: it is cut off"));
}

#[test]
fn a_model_can_control_the_partner() {
    let fixture = Fixture::new(&[TaskId::Obstacle, TaskId::Shopping], 300);
    let (standin, settings) = standin(Options::default());
    let mut request = fixture.request(&["none", "rhp"]);
    request.partner = Some("llm".to_owned());
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let (is_complete, results) = fixture.play("run", &request, &language);
    assert!(is_complete && results.len() == 4);
    for record in fixture.records("run") {
        let text = &exchanges(&record)[0].request.messages[0].text;
        assert!(text.contains("Wanted: "), "it knows its goal");
        assert!(!text.contains("remove the obstacle"), "obstacles are left to the helper");
    }
    let stats = standin.stats();
    assert!(stats.answered > 4 && stats.images == 0);
    assert!(summary(&results[0]).counts["partner.decisions"] > 1);
    let header = std::fs::read_to_string(fixture.path("run/traces/obstacle/rhp/short-0-s0.jsonl"));
    assert!(header.unwrap().lines().next().unwrap().contains("\"partner\":\"llm\""));
    let path = record::path(&fixture.path("run"), &results[0].key, chaic_core::AgentId::PARTNER);
    assert!(path.exists());
}

#[test]
fn requests_in_flight_do_not_block_other_episodes() {
    use std::sync::{Arc, Condvar, Mutex};
    // The stand-in answers after sixteen requests, and after all episodes without requests are
    // finished. If requests blocked those, the run would never end.
    let fixture = Fixture::new(&TaskId::paper().collect::<Vec<_>>(), 60);
    let open = Arc::new((Mutex::new(false), Condvar::new()));
    let waiting = Arc::new(AtomicUsize::new(0));
    let answer = {
        let (open, waiting) = (Arc::clone(&open), Arc::clone(&waiting));
        move |question: &chaic_llm_standin::script::Question| {
            waiting.fetch_add(1, Ordering::SeqCst);
            let (lock, changed) = &*open;
            let is_open = lock.lock().unwrap();
            drop(changed.wait_while(is_open, |is_open| !*is_open).unwrap());
            question.answer()
        }
    };
    let (standin, mut settings) = standin(Options {
        response_mode: ResponseMode::Function(Box::new(answer)),
        ..Options::default()
    });
    settings.endpoint.timeout_secs = 600.0;
    settings.endpoint.max_concurrent_requests = 16;
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let mut request = fixture.request(&["none", "random", "llm", "llm_known_task"]);
    request.seeds = Some(2);
    let path = fixture.path("run");
    let access = chaic_eval::run::FolderMode::New;
    let (mut run, _) = chaic_eval::run::Run::open(&path, access, &request, &language).unwrap();
    language.attach(&path).unwrap();
    let mut n_others = 0;
    let stop = language.stop();
    let is_complete = run.play(1, &language, stop, &mut |progress| {
        if let chaic_eval::run::JobEvent::Finished(finished) = progress
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
    assert!(is_complete.unwrap());
    assert_eq!(run.results().len(), 64);
    assert_eq!(standin.stats().max_in_flight, 16);
}

#[test]
fn replies_are_recorded_unchanged() {
    let fixture = Fixture::new(&[TaskId::HighGoal], 120);
    let (_standin, settings) = standin(Options::default());
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    fixture.play("run", &fixture.request(&["llm"]), &language);
    for exchange in exchanges(&fixture.records("run")[0]) {
        assert_eq!(exchange.damage(), None);
        let Reply::Answer { text, usage, .. } = &exchange.reply else { panic!("{exchange:?}") };
        assert!(text.contains("not a language model") && usage.prompt > 100 && !usage.estimated);
    }
}
