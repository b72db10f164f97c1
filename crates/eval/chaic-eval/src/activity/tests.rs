//! Promise: every frame after an agent's first decision belongs to one activity.

use chaic_core::{Action, EntityId, FailureReason, Hand};
use chaic_env::trace::{Decision, End, TraceEvent};
use chaic_env::{Digest, EpisodeConfig, trace_header};
use chaic_episodes::find_episode;
use chaic_world::Event;

use super::*;

#[test]
fn decisions_divide_the_time_and_failures_have_reasons() {
    let agent = AgentId::HELPER;
    let pick = Action::PickUp { object: EntityId(40), hand: Hand::Left };
    let decision = |frame, agent, action| {
        Record::Decision(Decision { frame, agent, action, digest: Digest(0), thought: None })
    };
    let ended = |frame, agent, action, outcome| {
        let event = Event { frame, kind: EventKind::Ended { agent, action, outcome } };
        Record::Event(TraceEvent { event, class: None })
    };
    let failure = Outcome::Failure(FailureReason::HandFull);
    let records = vec![
        decision(10, agent, Action::MoveForward),
        decision(20, AgentId::PARTNER, Action::Wait { frames: 3 }),
        decision(40, agent, pick),
        ended(60, agent, pick, failure),
        ended(60, AgentId::PARTNER, pick, failure),
        ended(65, agent, Action::MoveForward, Outcome::Failure(FailureReason::Blocked)),
        decision(70, agent, Action::Wait { frames: 3 }),
        Record::End(End {
            frame: 100,
            done: 0.0,
            total: 1.0,
            complete: false,
            away_frames: 0,
            stuck_frames: 0,
            digest: Digest(0),
        }),
    ];
    let episode = find_episode("high_goal/test/00").unwrap();
    let header = trace_header(EpisodeConfig::new(&episode, "rhp"), None).unwrap();
    let trace = Trace { header, records };
    let mut totals = ActivityTotals::default();
    totals.add(&trace, agent);
    let frames = [ActivityKind::Walk, ActivityKind::Interact, ActivityKind::Wait];
    assert_eq!(frames.map(|kind| totals.frames[&kind]), [30, 30, 30]);
    assert_eq!((totals.attempts, totals.failures["hand full"]), (1, 1));
    assert!((totals.fraction(ActivityKind::Walk) - 1.0 / 3.0).abs() < 1e-9);
}
