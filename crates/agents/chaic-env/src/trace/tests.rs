//! A trace reads back as it was written, up to wherever it was cut.

use std::path::Path;

use chaic_core::agent::{Believed, ChildState, Thought};
use chaic_core::capability::Impairment;
use chaic_core::{Action, AgentId, ClassId, EntityId, FailureReason, Hand, Outcome};
use chaic_world::{Event, EventKind};

use super::*;
use crate::error::EnvError;

fn header() -> Header {
    Header {
        format: FORMAT.to_owned(),
        version: VERSION,
        chaic: "0.1.0".to_owned(),
        task: TaskId::Obstacle,
        episode: "obstacle/test/07".to_owned(),
        setup: Digest(7),
        seed: 0,
        world_seed: u64::MAX,
        rules: RuleSet::PAPER,
        helper: "rhp".to_owned(),
        partner: None,
        people: vec![Participant {
            perception: None,
            isolation: None,
            agent: AgentId::PARTNER,
            persona: Persona::Wheelchair,
            impairments: Impairments::of(Impairment::Tremor),
            grants: Grants::PARTNER,
            senses: Senses::DEPTH_AND_IDS,
        }],
        renderer: "cpu".to_owned(),
        appearance: Appearance::Canonical,
    }
}

fn records() -> Vec<Record> {
    let pick = Action::PickUp { object: EntityId(31), hand: Hand::Left };
    let event =
        |frame, kind, class| Record::Event(TraceEvent { event: Event { frame, kind }, class });
    let decision = |frame, action, thought| {
        let (agent, digest) = (AgentId::HELPER, Digest(0xdead_beef));
        Record::Decision(Decision { frame, agent, action, digest, thought })
    };
    let thought = Thought {
        plan: "go to \"apple\" #31\n".to_owned(),
        mood: Some("x".to_owned()),
        noticed: Some("partner picked up apple #31".to_owned()),
        sees: vec![Believed {
            name: "t31".to_owned(),
            class: ClassId::named("apple"),
            at_cm: [120, 80, -35],
        }],
    };
    let failed = Outcome::Failure(FailureReason::OutOfReach);
    vec![
        decision(0, pick, Some(thought)),
        event(9, EventKind::Ended { agent: AgentId::HELPER, action: pick, outcome: failed }, None),
        decision(9, Action::MoveForward, None),
        event(
            20,
            EventKind::Delivered { object: EntityId(31), by: AgentId::HELPER, counted: true },
            Some(ClassId::named("apple")),
        ),
        Record::Child(ChildRecord { frame: 20, state: ChildState::RunAway }),
        event(30, EventKind::ChildAway { away: true }, None),
        Record::End(End {
            frame: 30,
            done: 1.0,
            total: 3.0,
            complete: false,
            away_frames: 4,
            stuck_frames: 5,
            digest: Digest(1),
        }),
    ]
}

fn written() -> String {
    let lines = std::iter::once(header().to_line());
    lines.chain(records().iter().map(Record::to_line)).map(|line| line + "\n").collect()
}

#[test]
fn reads_back_what_was_written() {
    let (trace, warnings) = parse(written().as_bytes(), Path::new("t.jsonl")).unwrap();
    assert_eq!(trace, Trace { header: header(), records: records() });
    assert_eq!(warnings, []);
    assert_eq!(trace.decisions().count(), 2);
}

#[test]
fn a_cut_at_any_byte_leaves_all_whole_records() {
    let bytes = written().into_bytes();
    let header_len = bytes.iter().position(|b| *b == b'\n').unwrap() + 1;
    for cut in 0..bytes.len() {
        let parsed = parse(&bytes[..cut], Path::new("t.jsonl"));
        if cut < header_len {
            assert!(matches!(parsed, Err(EnvError::Unreadable { line: 1, .. })), "{cut}");
            continue;
        }
        let (trace, warnings) = parsed.unwrap();
        let whole = bytes[header_len..cut].iter().filter(|b| **b == b'\n').count();
        assert_eq!(trace.records, records()[..whole], "{cut}");
        assert!(warnings.contains(&Warning::NoEnd { path: "t.jsonl".into(), records: whole }));
        let torn = bytes[cut - 1] != b'\n';
        assert_eq!(warnings.len(), 1 + usize::from(torn), "{cut}");
    }
}

#[test]
fn another_version_is_named() {
    let text = written();
    let own = format!("\"version\":{VERSION}");
    assert!(text.contains(&own), "{text}");
    let other = text.replacen(&own, "\"version\":77", 1);
    let error = parse(other.as_bytes(), Path::new("t.jsonl")).unwrap_err().to_string();
    let expected = format!("version {VERSION}");
    assert!(error.contains("version 77") && error.contains(&expected), "{error}");
    assert!(error.contains("chaic 0.1.0"), "{error}");
}

#[test]
fn the_appearance_is_told_where_it_is_not_the_usual() {
    let line = |appearance| serde_json::to_string(&Header { appearance, ..header() }).unwrap();
    let read = |line: &str| parse(format!("{line}\n").as_bytes(), Path::new("t.jsonl"));
    let usual = line(Appearance::Canonical);
    assert!(!usual.contains("appearance"), "as in traces from before there was a choice: {usual}");
    for appearance in
        [Appearance::Canonical, Appearance::Evening, Appearance::Varied { seed: u64::MAX }]
    {
        assert_eq!(read(&line(appearance)).unwrap().0.header.appearance, appearance);
    }
    let evening = line(Appearance::Evening);
    assert!(evening.ends_with(",\"appearance\":\"evening\"}"), "{evening}");
    for (wrong, words) in [
        ("\"dusk\"", "no appearance \"dusk\", expected canonical, evening or varied:SEED"),
        ("\"varied:-1\"", "no appearance \"varied:-1\""),
        ("3", "expected a string"),
    ] {
        let error = read(&evening.replace("\"evening\"", wrong)).unwrap_err().to_string();
        assert!(error.starts_with("t.jsonl: line 1: ") && error.contains(words), "{error}");
    }
}
