//! Promise: an explanation names each change of the belief and of the plans once, with its reason.

use chaic_core::agent::Thought;
use chaic_core::{Action, ClassId, FailureReason, Hand, Outcome};
use chaic_env::trace::{Decision, End, TraceEvent};
use chaic_env::{Digest, EpisodeConfig, trace_header};
use chaic_episodes::{Episode, find_episode};
use chaic_world::Event;

use super::*;

fn episode() -> Episode {
    find_episode("high_goal/test/00").unwrap()
}

fn decision(frame: Frame, agent: AgentId, thought: Option<Thought>) -> Record {
    let action = Action::MoveForward;
    Record::Decision(Decision { frame, agent, action, digest: Digest(0), thought })
}

fn event(frame: Frame, kind: EventKind, class: Option<&str>) -> Record {
    let class = class.map(ClassId::named);
    Record::Event(TraceEvent { event: Event { frame, kind }, class })
}

/// Returns a thought with the probabilities of fruit and bread, and of child and adult.
fn thought(goals: [u16; 2], people: [u16; 2], evidence: &[&str], plan: &[&str]) -> Thought {
    let named = |names: [&str; 2], p: [u16; 2]| {
        names.into_iter().zip(p).map(|(name, p)| (name.to_owned(), p)).collect()
    };
    let texts = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect();
    Thought {
        plan: "explore".to_owned(),
        mode: Some(if goals[0].max(goals[1]) < 700 { "watch" } else { "plan" }.to_owned()),
        belief: Some(Box::new(PartnerBelief {
            goals: named(["fruit", "bread"], goals),
            people: named(["child", "adult"], people),
            evidence: texts(evidence),
            plan: texts(plan),
            ..PartnerBelief::default()
        })),
        ..Thought::default()
    }
}

fn trace(helper: &str, records: Vec<Record>) -> Trace {
    let episode = episode();
    let header = trace_header(EpisodeConfig::new(&episode, helper), None).unwrap();
    Trace { header, records }
}

/// Returns the lines of the timeline as `FRAME TEXT`.
fn lines(records: Vec<Record>) -> Vec<String> {
    let explanation = explain(&trace("infer", records), episode().setup());
    explanation.timeline.iter().map(|entry| format!("{} {}", entry.frame, entry.text)).collect()
}

fn helper(frame: Frame, thought: Thought) -> Record {
    decision(frame, AgentId::HELPER, Some(thought))
}

#[test]
fn a_belief_is_explained_from_the_prior_to_the_plan() {
    let took = "took apple #40 (92 % reliable)";
    let records = vec![
        helper(0, thought([500, 500], [600, 400], &[], &[])),
        decision(0, AgentId::PARTNER, Some(Thought { plan: "a".into(), ..Thought::default() })),
        decision(1, AgentId::HELPER, None),
        helper(20, thought([510, 490], [610, 390], &[], &[])),
        helper(400, thought([730, 270], [620, 380], &[took], &["pick up apple #41", "deliver"])),
        helper(410, thought([735, 265], [880, 120], &[took], &["pick up apple #41", "deliver"])),
        helper(500, thought([750, 250], [880, 120], &[took], &["deliver"])),
        helper(600, thought([300, 700], [880, 120], &[], &[])),
    ];
    assert_eq!(
        lines(records),
        [
            "0 It knows nothing: fruit 50 %, bread 50 %. The partner may be: child 60 %, adult 40 %.",
            "0 It plans: explore.",
            "400 Saw: took apple #40 (92 % reliable). fruit 73 % (was 50 %).",
            "400 The goal is clear; it changes from watching to planning: pick up apple #41, deliver.",
            "410 It believes that the partner is a child: 88 % (was 60 %).",
            "500 It plans: deliver.",
            "600 Retracted: took apple #40 (92 % reliable). bread 70 % (was 27 %).",
            "600 It plans: explore.",
        ]
    );
}

#[test]
fn thresholds_are_reported_once() {
    let with = |p: u16| thought([p, 1000 - p], [600, 400], &[], &[]);
    let records = [490, 505, 520, 695, 650, 710, 890, 900, 905, 690]
        .iter()
        .zip(0..)
        .map(|(p, k)| helper(k, Thought { mode: None, ..with(*p) }));
    let goals: Vec<String> =
        lines(records.collect()).into_iter().filter(|line| line.contains("the goal is")).collect();
    assert_eq!(
        goals,
        [
            "1 It believes that the goal is fruit 51 % (was 49 %).",
            "5 It believes that the goal is fruit 71 % (was 51 %).",
            "7 It believes that the goal is fruit 90 % (was 71 %).",
            "9 It believes that the goal is fruit 69 % (was 90 %).",
        ]
    );
}

#[test]
fn a_reliability_is_no_new_observation() {
    let with = |text: &str| thought([600, 400], [600, 400], &[text], &[]);
    let records = vec![
        helper(0, thought([600, 400], [600, 400], &[], &[])),
        helper(5, with("took apple #40 (50 % reliable)")),
        helper(9, with("took apple #40 (92 % reliable)")),
        helper(12, with("took apple #41 (50 % reliable)")),
    ];
    assert_eq!(
        lines(records)[2..],
        [
            "5 Saw: took apple #40 (50 % reliable).",
            "12 Saw: took apple #41 (50 % reliable). Retracted: took apple #40 (92 % reliable).",
        ]
    );
}

#[test]
fn events_and_the_end_are_explained() {
    let episode = episode();
    let object = episode.setup().entities().next().unwrap();
    let label = episode.setup().object(object).unwrap().class.info().label;
    let action = Action::PickUp { object, hand: Hand::Left };
    let outcome = Outcome::Failure(FailureReason::BeyondLimits);
    let delivered = |by, counted| EventKind::Delivered { object, by, counted };
    let records = vec![
        helper(0, thought([500, 500], [600, 400], &[], &[])),
        event(8, EventKind::Ended { agent: AgentId::PARTNER, action, outcome }, None),
        event(9, EventKind::Taken { agent: AgentId::PARTNER, object }, None),
        event(50, delivered(AgentId::PARTNER, true), Some("apple")),
        event(60, delivered(AgentId::HELPER, false), Some("apple")),
        event(60, delivered(AgentId::HELPER, true), Some("plastic_basket")),
        event(65, delivered(AgentId::HELPER, true), Some("vase")),
        helper(70, thought([800, 200], [300, 700], &[], &["deliver"])),
    ];
    let explanation = explain(&trace("infer", records.clone()), episode.setup());
    let text = explanation.text();
    for expected in [
        "high_goal/test/00 with infer, seed 0\n".to_owned(),
        format!(
            "frame     8  Partner fails to pick up {label} {object}: beyond this person's limits.\n"
        ),
        format!("frame    50  Partner delivers {label} {object}, which counts.\n"),
        format!("frame    60  Helper delivers {label} {object}, which does not count.\n"),
        "The trace is cut off after frame 70.\n".to_owned(),
        "Deliveries: partner 1, counted 1; helper 2, counted 1.\n".to_owned(),
    ] {
        assert!(text.contains(&expected), "{expected}: {text}");
    }

    let end = End {
        frame: 3000,
        done: 1.0,
        total: 9.0,
        complete: false,
        away_frames: 0,
        stuck_frames: 0,
        digest: Digest(0),
    };
    let records = [records, vec![Record::End(end)]].concat();
    let explanation = explain(&trace("infer", records), episode.setup());
    assert_eq!((explanation.end.frame, explanation.end.progress), (3000, Some([1.0, 9.0])));
    let text = explanation.text();
    assert!(text.contains("The episode ends at frame 3000 with 1 of 9 done.\n"), "{text}");
    let json = serde_json::to_value(&explanation).unwrap();
    assert_eq!(json["timeline"][0]["kind"], "first_belief");
    assert_eq!(json["timeline"][2]["kind"], "failed");
    assert_eq!(json["timeline"][2]["agent"], "partner");
    assert_eq!(json["end"]["person"]["believed"], "adult");
}

#[test]
fn the_final_belief_is_compared_with_the_truth() {
    let mut episode_run = trace(
        "infer",
        vec![
            helper(0, thought([800, 200], [600, 400], &[], &[])),
            helper(10, thought([300, 700], [600, 400], &[], &[])),
            helper(20, thought([710, 290], [600, 400], &[], &[])),
            helper(30, thought([900, 100], [600, 400], &[], &[])),
        ],
    );
    let episode = episode();
    let mut setup = episode.setup().clone();
    setup.goal.targets = vec![(ClassId::named("apple"), 3), (ClassId::named("bread"), 1)];
    let person = episode_run.header.people[0].persona;
    let summary = explain(&episode_run, &setup).end;
    let goal = summary.goal.unwrap();
    assert_eq!((goal.believed.as_str(), goal.probability), ("fruit", 900));
    assert_eq!((goal.truth, summary.identified), (Some("fruit"), Some(20)));
    assert_eq!(summary.person.unwrap().truth, Some(person.name()));
    setup.goal.targets = vec![(ClassId::named("bread"), 3)];
    let explanation = explain(&episode_run, &setup);
    let expected = "Goal:       believed fruit (90 %), but bread (10 %) is true. It is not \
                    identified at the end.\n";
    assert!(explanation.text().contains(expected), "{}", explanation.text());
    episode_run.records.clear();
    assert_eq!(explain(&episode_run, &setup).end.goal, None);
}

#[test]
fn a_helper_without_belief_is_explained_by_its_plans() {
    let plan =
        |frame, text: &str| helper(frame, Thought { plan: text.to_owned(), ..Thought::default() });
    let records = vec![plan(0, "explore"), plan(7, "go to apple #31"), plan(9, "go to apple #31")];
    let explanation = explain(&trace("rhp", records), episode().setup());
    assert!(!explanation.records_belief);
    let text = explanation.text();
    let expected = "The helper records no belief; these are its plans and the events.\n\
                    frame     0  It plans: explore.\n\
                    frame     7  It plans: go to apple #31.\n\
                    The trace is cut off";
    assert!(text.contains(expected), "{text}");
}
