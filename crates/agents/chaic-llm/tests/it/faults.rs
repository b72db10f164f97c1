//! Promise: no endpoint failure loses an episode. With three failures of each kind in ten requests,
//! every episode of every task ends with a score.

use std::time::Duration;

use chaic_core::TaskId;
use chaic_llm::LanguageHelpers;
use chaic_llm::settings::FailureAction;
use chaic_llm_standin::Options;
use chaic_llm_standin::faults::FaultKind;

use crate::common::{Fixture, flag, standin, summary};

const RATE: f64 = 0.3;

#[test]
fn every_episode_gets_a_score_despite_failures() {
    let fixture = Fixture::new(&TaskId::paper().collect::<Vec<_>>(), 150);
    let request = fixture.request(&["llm"]);
    for kind in FaultKind::ALL {
        let (standin, settings) = standin(Options {
            faults: vec![(kind, RATE)],
            stall: Duration::from_millis(400),
            ..Options::default()
        });
        let language = LanguageHelpers::live(settings, flag()).unwrap();
        let (is_complete, results) = fixture.play(kind.name(), &request, &language);
        assert!(is_complete && results.len() == 8, "{}: {:?}", kind.name(), language.problem());
        for result in &results {
            assert_eq!(summary(result).frames, 150);
        }
        let stats = standin.stats();
        assert!(stats.faults[kind.name()] > 0, "{stats:?}");
        let n = |name: &str| -> u64 {
            results.iter().filter_map(|r| summary(r).counts.get(name)).sum()
        };
        if kind == FaultKind::PlanNotListed {
            assert!(n("helper.asked_again") > 0);
        } else {
            assert!(n("helper.faults") > 0, "{}", kind.name());
            assert_eq!(n("helper.asked_again"), 0, "{}", kind.name());
        }
    }
}

#[test]
fn an_endpoint_that_is_gone_pauses_the_run_and_one_that_is_back_finishes_it() {
    let fixture = Fixture::new(&[TaskId::NoConstraint, TaskId::Obstacle], 150);
    let request = fixture.request(&["llm", "random"]);
    let (gone, mut settings) = standin(Options::default());
    settings.retry.on_failure = FailureAction::Pause;
    settings.retry.max_attempts = 3;
    drop(gone);
    let language = LanguageHelpers::live(settings.clone(), flag()).unwrap();
    let (is_complete, results) = fixture.play("run", &request, &language);
    assert!(!is_complete);
    assert!(
        results.iter().all(|r| r.key.helper == "random"),
        "episodes with failed requests have no score"
    );
    let problem = language.problem().unwrap();
    assert!(problem.contains("tried 3 times") && problem.contains("connection"), "{problem}");

    let (_back, back) = standin(Options::default());
    settings.endpoint.url = back.endpoint.url;
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let (is_complete, results) = fixture.play("run", &request, &language);
    assert!(is_complete && results.len() == 4, "{:?}", language.problem());
    results.iter().for_each(|r| assert!(r.summary().is_some()));
}

#[test]
fn permanent_failures_are_not_retried() {
    let fixture = Fixture::new(&[TaskId::NoConstraint], 100);
    let key = Some("right".to_owned());
    let (standin, mut settings) = standin(Options { key, ..Options::default() });
    settings.retry.on_failure = FailureAction::Pause;
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    assert!(!fixture.play("run", &fixture.request(&["llm"]), &language).0);
    assert_eq!(standin.stats().requests, 1);
    let problem = language.problem().unwrap();
    assert!(problem.contains("tried once") && problem.contains("401"), "{problem}");
}
