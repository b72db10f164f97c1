//! A run that is to stop doesn't wait for an endpoint that says nothing; what was answered before is
//! whole on the disk, and the run goes on from there.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use chaic_core::TaskId;
use chaic_llm::Language;
use chaic_llm::settings::Then;
use chaic_llm_standin::script::Question;
use chaic_llm_standin::{Manner, Options};

use crate::common::{Bench, exchanges, files, flag, settings, standin, stop};

#[test]
fn who_stops_the_run_waits_for_no_answer_and_goes_on_later() {
    const ANSWERED: usize = 2;
    let bench = Bench::new(&[TaskId::NoConstraint], 300);
    let given = bench.given(&["llm"]);
    let (_server, well) = standin(Options::default());
    let whole = Language::live(well.clone(), flag()).unwrap();
    let (_, expected) = bench.play("whole", &given, &whole);

    // Raised where the third question comes in, which nobody ever answers.
    let raised = flag();
    let asked = AtomicUsize::new(0);
    let say = move |question: &Question| {
        if asked.fetch_add(1, Ordering::SeqCst) < ANSWERED {
            return question.answer();
        }
        raised.store(true, Ordering::SeqCst);
        loop {
            std::thread::park();
        }
    };
    let manner = Manner::Say(Box::new(say));
    let (_stalls, mut ill) = standin(Options { manner, ..Options::default() });
    ill.endpoint.timeout_secs = 86_400.0;
    ill.faults.then = Then::Pause;
    let language = Language::live(ill, raised).unwrap();
    let (is_whole, results) = bench.play("cut", &given, &language);
    assert!(!is_whole && results.is_empty());
    assert_eq!(language.problem(), None, "its user has stopped it, and knows why");
    assert!(stop(&language).load(Ordering::SeqCst));
    let records = bench.records("cut");
    assert_eq!(exchanges(&records[0]).len(), ANSWERED);
    for (path, bytes) in files(&bench.path("cut/llm/no_constraint")) {
        assert!(bytes.ends_with(b"\n"), "{} has a torn line", path.display());
    }

    let language = Language::live(well, flag()).unwrap();
    let (is_whole, results) = bench.play("cut", &given, &language);
    assert!(is_whole, "{:?}", language.problem());
    assert_eq!(results, expected);
    assert_eq!(files(&bench.path("whole/traces")), files(&bench.path("cut/traces")));
}

#[test]
fn an_endpoint_that_is_gone_is_told_of_before_the_run_gives_up() {
    let bench = Bench::new(&[TaskId::NoConstraint], 100);
    let (gone, _) = standin(Options::default());
    let mut settings = settings(&gone.url());
    settings.faults.then = Then::Pause;
    drop(gone);
    let raised = flag();
    let language = Language::live(settings, raised).unwrap();
    let told = Arc::new(Mutex::new(Vec::new()));
    let for_listener = Arc::clone(&told);
    language.listen(Box::new(move |line: &str| {
        let is_stopped = raised.load(Ordering::SeqCst);
        for_listener.lock().unwrap().push((line.to_owned(), is_stopped));
    }));
    assert!(!bench.play("run", &bench.given(&["llm"]), &language).0);
    let told = told.lock().unwrap();
    let (line, is_stopped) = &told[0];
    assert!(line.contains("can't be asked just now") && line.contains("connection"), "{line}");
    assert!(!is_stopped, "while it goes on trying");
    assert_eq!(told.len(), 1, "once: {told:?}");
}
