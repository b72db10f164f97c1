//! Promise: a stopped run does not wait for a silent endpoint; earlier answers are complete on
//! disk, and the run resumes from there.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use chaic_core::TaskId;
use chaic_llm::LanguageHelpers;
use chaic_llm::settings::FailureAction;
use chaic_llm_standin::script::Question;
use chaic_llm_standin::{Options, ResponseMode};

use crate::common::{Fixture, exchanges, files, flag, settings, standin, stop};

#[test]
fn a_stopped_run_does_not_wait_and_resumes_later() {
    const ANSWERED: usize = 2;
    let fixture = Fixture::new(&[TaskId::NoConstraint], 300);
    let request = fixture.request(&["llm"]);
    let (_server, working) = standin(Options::default());
    let whole = LanguageHelpers::live(working.clone(), flag()).unwrap();
    let (_, expected) = fixture.play("whole", &request, &whole);

    // Set at the third request, which is never answered.
    let stop_flag = flag();
    let asked = AtomicUsize::new(0);
    let answer = move |question: &Question| {
        if asked.fetch_add(1, Ordering::SeqCst) < ANSWERED {
            return question.answer();
        }
        stop_flag.store(true, Ordering::SeqCst);
        loop {
            std::thread::park();
        }
    };
    let response_mode = ResponseMode::Function(Box::new(answer));
    let (_stalling_server, mut stalling) = standin(Options { response_mode, ..Options::default() });
    stalling.endpoint.timeout_secs = 86_400.0;
    stalling.retry.on_failure = FailureAction::Pause;
    let language = LanguageHelpers::live(stalling, stop_flag).unwrap();
    let (is_complete, results) = fixture.play("cut", &request, &language);
    assert!(!is_complete && results.is_empty());
    assert_eq!(language.problem(), None, "the user stopped it");
    assert!(stop(&language).load(Ordering::SeqCst));
    let records = fixture.records("cut");
    assert_eq!(exchanges(&records[0]).len(), ANSWERED);
    for (path, bytes) in files(&fixture.path("cut/llm/no_constraint")) {
        assert!(bytes.ends_with(b"\n"), "{} has a torn line", path.display());
    }

    let language = LanguageHelpers::live(working, flag()).unwrap();
    let (is_complete, results) = fixture.play("cut", &request, &language);
    assert!(is_complete, "{:?}", language.problem());
    assert_eq!(results, expected);
    assert_eq!(files(&fixture.path("whole/traces")), files(&fixture.path("cut/traces")));
}

#[test]
fn an_unreachable_endpoint_is_reported_before_the_run_pauses() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 100);
    let (gone, _) = standin(Options::default());
    let mut settings = settings(&gone.url());
    settings.retry.on_failure = FailureAction::Pause;
    drop(gone);
    let stop_flag = flag();
    let language = LanguageHelpers::live(settings, stop_flag).unwrap();
    let messages = Arc::new(Mutex::new(Vec::new()));
    let for_listener = Arc::clone(&messages);
    language.listen(Box::new(move |line: &str| {
        let is_stopped = stop_flag.load(Ordering::SeqCst);
        for_listener.lock().unwrap().push((line.to_owned(), is_stopped));
    }));
    assert!(!fixture.play("run", &fixture.request(&["llm"]), &language).0);
    let messages = messages.lock().unwrap();
    let (line, is_stopped) = &messages[0];
    assert!(
        line.contains("cannot be reached at the moment") && line.contains("connection"),
        "{line}"
    );
    assert!(!is_stopped, "it is reported while retries continue");
    assert_eq!(messages.len(), 1, "{messages:?}");
}
