//! However an endpoint fails, no episode is lost: at three failures in ten requests of every kind,
//! every episode of every task ends with a score.

use std::time::Duration;

use chaic_core::TaskId;
use chaic_llm::Language;
use chaic_llm::settings::Then;
use chaic_llm_standin::Options;
use chaic_llm_standin::faults::FaultKind;

use crate::common::{Bench, flag, standin, summary};

const RATE: f64 = 0.3;

#[test]
fn no_episode_is_lost_whatever_goes_wrong() {
    let bench = Bench::new(&TaskId::paper().collect::<Vec<_>>(), 150);
    let given = bench.given(&["llm"]);
    for kind in FaultKind::ALL {
        let (standin, settings) = standin(Options {
            faults: vec![(kind, RATE)],
            stall: Duration::from_millis(400),
            ..Options::default()
        });
        let language = Language::live(settings, flag()).unwrap();
        let (is_whole, results) = bench.play(kind.name(), &given, &language);
        assert!(is_whole && results.len() == 8, "{}: {:?}", kind.name(), language.problem());
        for result in &results {
            assert_eq!(summary(result).frames, 150);
        }
        let seen = standin.seen();
        assert!(seen.faults[kind.name()] > 0, "{seen:?}");
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
    let bench = Bench::new(&[TaskId::NoConstraint, TaskId::Obstacle], 150);
    let given = bench.given(&["llm", "random"]);
    let (gone, mut settings) = standin(Options::default());
    settings.faults.then = Then::Pause;
    settings.faults.attempts = 3;
    drop(gone);
    let language = Language::live(settings.clone(), flag()).unwrap();
    let (is_whole, results) = bench.play("run", &given, &language);
    assert!(!is_whole);
    assert!(results.iter().all(|r| r.key.helper == "random"), "what asked in vain has no score");
    let problem = language.problem().unwrap();
    assert!(problem.contains("tried 3 times") && problem.contains("connection"), "{problem}");

    let (_back, back) = standin(Options::default());
    settings.endpoint.url = back.endpoint.url;
    let language = Language::live(settings, flag()).unwrap();
    let (is_whole, results) = bench.play("run", &given, &language);
    assert!(is_whole && results.len() == 4, "{:?}", language.problem());
    results.iter().for_each(|r| assert!(r.summary().is_some()));
}

#[test]
fn what_can_not_pass_is_not_tried_again() {
    let bench = Bench::new(&[TaskId::NoConstraint], 100);
    let key = Some("right".to_owned());
    let (standin, mut settings) = standin(Options { key, ..Options::default() });
    settings.faults.then = Then::Pause;
    let language = Language::live(settings, flag()).unwrap();
    assert!(!bench.play("run", &bench.given(&["llm"]), &language).0);
    assert_eq!(standin.seen().requests, 1);
    let problem = language.problem().unwrap();
    assert!(problem.contains("tried once") && problem.contains("401"), "{problem}");
}
