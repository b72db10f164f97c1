//! Promise: examples follow the stated rule and open where the runs diverge.

use chaic_core::{AgentId, ClassId, EntityId};

use super::*;
use crate::metrics::RunStatus;
use crate::metrics::tests::{case, result};

/// Completed run of four objects; deliveries at these frames count.
fn run(helper: &str, episode: &str, frames: &[Frame]) -> RunResult {
    let mut run = result(case(helper, episode, frames.len() as f64, 4.0));
    let RunStatus::Done(summary) = &mut run.status else { unreachable!("a completed run") };
    summary.deliveries = frames
        .iter()
        .map(|frame| crate::metrics::Delivery {
            frame: *frame,
            object: EntityId(40),
            class: ClassId::named("apple"),
            by: AgentId::HELPER,
            counted: true,
            together: false,
            handed: false,
        })
        .collect();
    run
}

fn selected(examples: &[Example]) -> Vec<(ExampleRole, &str, Frame)> {
    examples.iter().map(|e| (e.role, e.key.episode.as_str(), e.frame)).collect()
}

#[test]
fn the_typical_the_best_and_the_worst_episode_are_selected() {
    let results = [
        run("none", "a", &[100]),
        run("rhp", "a", &[90, 300, 400]),
        run("none", "b", &[100, 200]),
        run("rhp", "b", &[500]),
        run("none", "c", &[100]),
        run("rhp", "c", &[100, 700]),
        run("none", "d", &[]),
        run("rhp", "d", &[]),
    ];
    let found = examples(&results, "rhp", Some("none"));
    let expected = [
        // Differences: a 0.5, b -0.25, c 0.25, d 0; their mean is 0.125, and c comes before d.
        (ExampleRole::Typical, "c", 700),
        (ExampleRole::Best, "a", 400),
        (ExampleRole::Worst, "b", 200),
    ];
    assert_eq!(selected(&found), expected);
    assert_eq!((found[0].rate, found[0].baseline_rate), (0.5, Some(0.25)));
}

#[test]
fn runs_without_a_completed_counterpart_are_no_examples() {
    let failed = RunResult {
        status: RunStatus::Error { message: "boom".to_owned() },
        ..run("none", "a", &[])
    };
    let results = [failed, run("rhp", "a", &[90]), run("rhp", "b", &[90])];
    assert_eq!(examples(&results, "rhp", Some("none")), []);
}

#[test]
fn without_baseline_the_transport_rate_decides() {
    let results = [run("rhp", "a", &[]), run("rhp", "b", &[90, 95])];
    let found = examples(&results, "rhp", None);
    assert_eq!(selected(&found), [(ExampleRole::Best, "b", 90), (ExampleRole::Worst, "a", 0)]);
    assert_eq!(found[0].baseline_rate, None);
}
