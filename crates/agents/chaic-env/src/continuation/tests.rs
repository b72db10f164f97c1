//! Promises: a continuation repeats the records before its frame, verifies, and knows what was seen before;
//! what cannot be continued is refused.

use chaic_core::observation::Grants;
use chaic_episodes::find_episode;

use super::*;
use crate::helper_registry::{NONE, built_in_partner};
use crate::rules::RuleSet;
use crate::{AgentRerun, RerunStatus};

/// Frame from which the other helper decides.
const FROM: Frame = 400;

fn episode() -> Episode {
    short_episode("no_constraint/test/00")
}

fn short_episode(id: &str) -> Episode {
    let mut setup = find_episode(id).unwrap().into_setup();
    setup.horizon = 800;
    Episode::new(id, "short", None, setup).unwrap()
}

/// Plays an episode with images of 64 pixels; returns the trace as a file.
fn played(helper: &str, partner: Option<&str>) -> String {
    played_episode(&episode(), RuleSet::PAPER, helper, partner)
}

fn played_episode(
    episode: &Episode,
    rule_set: RuleSet,
    helper: &str,
    partner: Option<&str>,
) -> String {
    let rules = rule_set.planner;
    let made = partner.map(|name| built_in_partner(name, rules).unwrap());
    let agents = EpisodeAgents::new(BuiltInHelpers.make(helper, rules), made);
    let config = EpisodeConfig::new(episode, helper);
    let config = EpisodeConfig { rules: rule_set, image_size: Some(64), partner, ..config };
    let mut env = Env::new(config, agents).unwrap();
    let (header, mut records) = (env.header().clone(), Vec::new());
    let mut sink = |record: &Record| {
        records.push(record.clone());
        Ok::<(), AgentError>(())
    };
    env.run(&AtomicBool::new(false), None, &mut sink).unwrap();
    file(&Trace { header, records })
}

fn file(trace: &Trace) -> String {
    trace.lines().map(|line| line + "\n").collect()
}

fn continued(trace: &str, name: &str) -> Result<Trace, ContinuationError> {
    continue_with(trace.as_bytes(), &episode(), FROM, name, &BuiltInHelpers)
}

/// Returns the records before the frame.
fn before(trace: &Trace) -> Vec<Record> {
    let is_before = |record: &&Record| match record {
        Record::Decision(decision) => decision.frame < FROM,
        Record::Child(child) => child.frame < FROM,
        Record::Event(event) => event.event.frame < FROM,
        Record::End(_) => false,
    };
    trace.records.iter().filter(is_before).cloned().collect()
}

#[test]
fn a_continuation_repeats_what_was_before_and_verifies() {
    for (partner, name) in [(None, "oracle"), (Some("habits:load=1"), "random")] {
        let parent = played("rhp", partner);
        let (trace, _) = parse(parent.as_bytes(), "trace".as_ref()).unwrap();
        let branch = continued(&parent, name).unwrap();
        assert_eq!(before(&branch), before(&trace));
        assert_ne!(branch.records, trace.records, "{name} decides differently");
        let header = &branch.header;
        assert_eq!((header.helper.as_str(), header.partner.as_deref()), (name, partner));
        assert_eq!(header.branch_of, Some(BranchPoint::new(parent.as_bytes(), FROM)));
        let mut playback = Playback::new(&branch, &episode()).unwrap();
        while playback.step().unwrap().is_some() {}
        assert_eq!(playback.n_decisions(), branch.decisions().count());
    }
}

#[test]
fn a_helper_that_took_over_acts_again_as_recorded_and_remembers_what_was_before() {
    let parent = played("rhp", None);
    let branch = continued(&parent, "rhp").unwrap();
    assert!(branch.end().is_some());
    let mut rerun = AgentRerun::new(&branch, &episode(), &BuiltInHelpers).unwrap();
    let mut n_helper = 0;
    while let Some(moments) = rerun.step().unwrap() {
        for moment in moments.iter().filter(|moment| moment.agent == AgentId::HELPER) {
            assert!(moment.frame >= FROM, "another trace decides before");
            if n_helper == 0 {
                let n_seen_before =
                    moment.memory.objects.iter().filter(|object| object.last_seen < FROM).count();
                assert!(n_seen_before > 0, "it remembers what it observed before");
            }
            n_helper += 1;
        }
    }
    assert!(n_helper > 5);
    assert!(rerun.statuses().all(|(_, status)| status == RerunStatus::Equal));
}

#[test]
fn a_continuation_survives_joint_lifts_of_the_original_rules() {
    let episode = short_episode("moving_house/train/01");
    let parent = played_episode(&episode, RuleSet::COMPAT, "rhp", None);
    assert!(parent.contains("lifted_together"), "the partner engages the helper");
    let branch =
        continue_with(parent.as_bytes(), &episode, 700, "random", &BuiltInHelpers).unwrap();
    assert!(branch.end().is_some());
}

/// Helpers without grants.
struct WithoutGrants;

impl HelperRegistry for WithoutGrants {
    fn names(&self) -> Vec<String> {
        BuiltInHelpers.names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        Some(Helper { grants: Grants::NONE, ..BuiltInHelpers.make(name, rules)? })
    }
}

#[test]
fn what_cannot_be_continued_is_refused() {
    let parent = played("rhp", None);
    let refused = |trace: &str, name: &str| continued(trace, name).unwrap_err();
    assert!(matches!(refused(&parent, "rl"), ContinuationError::Env(_)));
    assert!(matches!(refused(&parent, NONE), ContinuationError::Agents(_)));
    assert!(matches!(refused("{}\n", "rhp"), ContinuationError::Env(_)));
    let of_person = parent.replacen("\"helper\":", "\"partner\":\"human\",\"helper\":", 1);
    assert!(matches!(refused(&of_person, "rhp"), ContinuationError::Agents(_)));
    let altered = parent.replacen("[0,1,", "[1,1,", 1);
    assert!(matches!(refused(&altered, "rhp"), ContinuationError::Env(_)));
    let bytes = parent.as_bytes();
    let at_end = continue_with(bytes, &episode(), 800, "rhp", &BuiltInHelpers).unwrap_err();
    assert!(matches!(at_end, ContinuationError::End { last_frame: 800, .. }), "{at_end}");
    let unseen = continue_with(bytes, &episode(), FROM, "rhp", &WithoutGrants).unwrap_err();
    assert!(unseen.to_string().contains("no grant of ids"), "{unseen}");
    let alone = played(NONE, None);
    let error = refused(&alone, "rhp").to_string();
    assert!(error.contains("the trace has no helper"), "{error}");
}
