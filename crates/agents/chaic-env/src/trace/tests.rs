//! Tests that a trace is read as it was written, up to the point where it was cut.

use std::path::Path;

use chaic_core::agent::{BelievedObject, ChildState, PartnerBelief, Thought};
use chaic_core::capability::Impairment;
use chaic_core::observation::FrameHistorySpec;
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
            weights: None,
            recording: None,
            input: None,
            is_live: false,
            agent: AgentId::PARTNER,
            persona: Persona::Wheelchair,
            impairments: Impairments::new(Impairment::Tremor),
            grants: Grants::PARTNER,
            sensors: SensorConfig::DEPTH_AND_IDS,
        }],
        renderer: "cpu".to_owned(),
        appearance: Appearance::Canonical,
        branch_of: None,
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
        mode: Some("x".to_owned()),
        last_observed: Some("partner picked up apple #31".to_owned()),
        perceived: vec![BelievedObject {
            name: "t31".to_owned(),
            class: ClassId::named("apple"),
            position_cm: [120, 80, -35],
        }],
        belief: Some(Box::new(PartnerBelief {
            goals: vec![("fruit".to_owned(), 750), ("bread".to_owned(), 250)],
            people: vec![("child".to_owned(), 1000)],
            extra: vec![ClassId::named("key")],
            position_cm: Some([120, -35]),
            evidence: vec!["took apple #31".to_owned()],
            ..PartnerBelief::default()
        })),
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
fn a_trace_is_read_as_it_was_written() {
    let (trace, warnings) = parse(written().as_bytes(), Path::new("t.jsonl")).unwrap();
    assert_eq!(trace, Trace { header: header(), records: records() });
    assert_eq!(warnings, []);
    assert_eq!(trace.decisions().count(), 2);
}

#[test]
fn a_cut_at_any_byte_keeps_all_complete_records() {
    let bytes = written().into_bytes();
    let header_len = bytes.iter().position(|b| *b == b'\n').unwrap() + 1;
    for cut in 0..bytes.len() {
        let parsed = parse(&bytes[..cut], Path::new("t.jsonl"));
        if cut < header_len {
            assert!(matches!(parsed, Err(EnvError::Unreadable { line: 1, .. })), "{cut}");
            continue;
        }
        let (trace, warnings) = parsed.unwrap();
        let n_complete = bytes[header_len..cut].iter().filter(|b| **b == b'\n').count();
        assert_eq!(trace.records, records()[..n_complete], "{cut}");
        assert!(
            warnings.contains(&TraceWarning::NoEnd { path: "t.jsonl".into(), records: n_complete })
        );
        let torn = bytes[cut - 1] != b'\n';
        assert_eq!(warnings.len(), 1 + usize::from(torn), "{cut}");
    }
}

#[test]
fn another_version_is_refused_with_its_number() {
    let text = written();
    let own = format!("\"version\":{VERSION}");
    assert!(text.contains(&own), "{text}");
    let other = text.replacen(&own, "\"version\":77", 1);
    let error = parse(other.as_bytes(), Path::new("t.jsonl")).unwrap_err().to_string();
    let expected = format!("versions {MIN_VERSION} to {VERSION}");
    assert!(error.contains("version 77") && error.contains(&expected), "{error}");
    assert!(error.contains("chaic 0.1.0"), "{error}");
}

#[test]
fn another_format_and_impossible_rules_are_refused() {
    let text = written();
    let problem =
        |text: &str| parse(text.as_bytes(), Path::new("t.jsonl")).unwrap_err().to_string();
    let other = text.replacen("\"chaic-trace\"", "\"chaic-run\"", 1);
    assert_ne!(other, text);
    assert!(problem(&other).contains("its format is `chaic-run`"), "{}", problem(&other));
    let mut wrong = [RuleSet::PAPER; 3];
    wrong[0].world.turn_rad = 13.0;
    wrong[1].world.durations.pause = u32::MAX;
    wrong[2].world.durations.open_hand = 0;
    for (rules, name) in wrong.into_iter().zip(["turn_rad", "pause", "open_hand"]) {
        let line = serde_json::to_string(&Header { rules, ..header() }).unwrap();
        assert!(problem(&(line + "\n")).contains(name), "{name}");
    }
}

#[test]
fn only_a_noncanonical_appearance_is_written() {
    let line = |appearance| serde_json::to_string(&Header { appearance, ..header() }).unwrap();
    let read = |line: &str| parse(format!("{line}\n").as_bytes(), Path::new("t.jsonl"));
    let canonical = line(Appearance::Canonical);
    assert!(!canonical.contains("appearance"), "as in traces without this field: {canonical}");
    for appearance in
        [Appearance::Canonical, Appearance::Evening, Appearance::Varied { seed: u64::MAX }]
    {
        assert_eq!(read(&line(appearance)).unwrap().0.header.appearance, appearance);
    }
    let evening = line(Appearance::Evening);
    assert!(evening.ends_with(",\"appearance\":\"evening\"}"), "{evening}");
    for (wrong, expected) in [
        ("\"dusk\"", "no appearance \"dusk\", expected canonical, evening or varied:SEED"),
        ("\"varied:-1\"", "no appearance \"varied:-1\""),
        ("3", "expected a string"),
    ] {
        let error = read(&evening.replace("\"evening\"", wrong)).unwrap_err().to_string();
        assert!(error.starts_with("t.jsonl: line 1: ") && error.contains(expected), "{error}");
    }
}

/// Returns a trace that contains every key that version 3 renamed.
fn trace_with_renamed_keys(version: u32) -> Trace {
    let spec = FrameHistorySpec { image_size: 128, every_frames: 3, max_len: 64 };
    let mut header = Header { version, ..header() };
    header.people[0].sensors.frame_history = Some(spec);
    Trace { header, records: records() }
}

#[test]
fn lines_have_the_keys_of_their_version() {
    let sensors_and_thought = |version| {
        let trace = trace_with_renamed_keys(version);
        let mut lines = trace.lines();
        let (header, decision) = (lines.next().unwrap(), lines.next().unwrap());
        let sensors = header.split_once("\"positions\":false},").unwrap().1;
        let sensors = sensors.split_once("}]").unwrap().0;
        let thought = decision.split_once("#31\\n\",").unwrap().1;
        (sensors.to_owned(), thought.to_owned())
    };
    let (sensors, thought) = sensors_and_thought(VERSION);
    assert_eq!(
        sensors,
        r#""sensors":{"image_size":512,"rgb":false,"depth":true,"ids":true,"frame_history":{"image_size":128,"every_frames":3,"max_len":64}}"#
    );
    assert_eq!(
        thought,
        r#""mode":"x","last_observed":"partner picked up apple #31","perceived":[["t31","apple",[120,80,-35]]],"belief":{"goals":[["fruit",750],["bread",250]],"people":[["child",1000]],"extra":["key"],"position_cm":[120,-35],"evidence":["took apple #31"]}}]"#
    );
    let (sensors, thought) = sensors_and_thought(3);
    assert!(sensors.contains("frame_history") && thought.contains("last_observed"));
    let (sensors, thought) = sensors_and_thought(2);
    assert_eq!(
        sensors,
        r#""senses":{"image_size":512,"rgb":false,"depth":true,"ids":true,"film":{"image_size":128,"every_frames":3,"most":64}}"#
    );
    assert_eq!(
        thought,
        r#""mood":"x","noticed":"partner picked up apple #31","sees":[["t31","apple",[120,80,-35]]],"belief":{"goals":[["fruit",750],["bread",250]],"people":[["child",1000]],"extra":["key"],"position_cm":[120,-35],"evidence":["took apple #31"]}}]"#
    );
}

#[test]
fn headers_have_the_rules_of_their_version() {
    let header = |version| trace_with_renamed_keys(version).lines().next().unwrap();
    for (old, new) in
        [("gap", "pause"), ("held_frames", "seen_held_ignore_frames"), ("limits", "plan_timeouts")]
    {
        let has = |version, key: &str| header(version).contains(&format!("\"{key}\":"));
        assert!(has(VERSION, new) && !has(VERSION, old), "{old}");
        assert!(has(3, old) && !has(3, new), "{old}");
    }
}

#[test]
fn traces_of_all_readable_versions_are_read() {
    for version in MIN_VERSION..=VERSION {
        let trace = trace_with_renamed_keys(version);
        let text: String = trace.lines().map(|line| line + "\n").collect();
        assert_eq!(parse(text.as_bytes(), Path::new("t.jsonl")).unwrap(), (trace, Vec::new()));
    }
}

#[test]
fn text_that_looks_like_a_key_is_not_renamed() {
    let mut trace = trace_with_renamed_keys(2);
    let Record::Decision(decision) = &mut trace.records[0] else { unreachable!("a decision") };
    let thought = decision.thought.as_mut().unwrap();
    thought.plan = r#"{"plan":"","mode":"x","sensors":1},"#.to_owned();
    let text: String = trace.lines().map(|line| line + "\n").collect();
    assert_eq!(parse(text.as_bytes(), Path::new("t.jsonl")).unwrap().0, trace);
}
