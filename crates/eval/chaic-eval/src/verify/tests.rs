//! Tests of the messages of differences.

use chaic_core::agent::ChildState;
use chaic_core::{Action, Frame};
use chaic_env::Digest;
use chaic_env::trace::ChildRecord;

use super::*;

fn decision(frame: Frame, agent: AgentId, digest: u64) -> Decision {
    Decision { frame, agent, action: Action::TurnLeft, digest: Digest(digest), thought: None }
}

#[test]
fn a_difference_names_frame_agent_and_both_records() {
    let decided = |frame, digest| Record::Decision(decision(frame, AgentId::HELPER, digest));
    let ran = Record::Child(ChildRecord { frame: 40, state: ChildState::RunAway });
    let before = decision(20, AgentId::PARTNER, 3);
    let (one, two) = ("0000000000000001", "0000000000000002");
    let line = |frame, digest| format!(r#"[{frame},1,"turn_left","{digest}"]"#);
    let rows = [
        (
            (Some(decided(30, 1)), decided(30, 2), None),
            format!(
                "frame 30, helper: the state's digest is {one} in the trace, {two} in the \
                 re-simulation"
            ),
        ),
        (
            (Some(decided(29, 1)), decided(30, 1), Some(&before)),
            format!(
                "frame 30, helper: the trace has {}, the re-simulation has {}; the decision before \
                 it is the partner's \"turn_left\" at frame 20",
                line(29, one),
                line(30, one)
            ),
        ),
        (
            (Some(decided(30, 1)), ran.clone(), None),
            format!(
                "frame 40, child: the trace has {}, the re-simulation has {}",
                line(30, one),
                ran.to_line()
            ),
        ),
        (
            (None, decided(30, 2), None),
            format!("frame 30, helper: the trace ends, the re-simulation has {}", line(30, two)),
        ),
    ];
    for ((recorded, simulated, last), expected) in rows {
        let found = mismatch(Path::new("t.jsonl"), recorded.as_ref(), &simulated, last);
        assert_eq!(found.to_string(), format!("t.jsonl: {expected}"));
    }
}

#[test]
fn a_difference_at_the_end_names_no_agent() {
    let end = |done| {
        let (total, complete, digest) = (3.0, false, Digest(4));
        let frame = 90;
        End { frame, done, total, complete, away_frames: 0, stuck_frames: 0, digest }
    };
    let (recorded, simulated) = (Record::End(end(1.0)), Record::End(end(2.0)));
    let found = mismatch(Path::new("t.jsonl"), Some(&recorded), &simulated, None);
    assert_eq!((found.frame, found.agent), (90, None));
    let text = found.to_string();
    assert!(text.starts_with("t.jsonl: frame 90: the trace has {\"end\":"), "{text}");
}
