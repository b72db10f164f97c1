//! Briefings and evidence for the tests of beliefs, and tests of the whole.

use chaic_core::task::SceneKind;
use chaic_core::{ClassId, Role};

use super::*;
use crate::TrackId;
use crate::test_support::Toy;

fn briefing_of(scene: SceneKind) -> Briefing {
    let sets = scene::target_sets(scene);
    let is_fragile = |c: ClassId| scene == SceneKind::House && c.info().role == Role::Fragile;
    let is_possible =
        |c: &ClassId| c.info().sets.iter().any(|s| sets.contains(s)) || is_fragile(*c);
    let possible_targets = ClassId::all().filter(is_possible).collect();
    Briefing { possible_targets, ..Toy::room(12.0, 12.0).briefing() }
}

/// Returns a briefing with all possible targets of houses.
pub fn house() -> Briefing {
    briefing_of(SceneKind::House)
}

/// Returns a briefing with all possible targets of streets.
pub fn street() -> Briefing {
    briefing_of(SceneKind::Street)
}

/// Returns a briefing with all possible targets of yards.
pub fn yard() -> Briefing {
    briefing_of(SceneKind::Yard)
}

/// Creates evidence by setting fields.
pub fn evidence_with(set: impl FnOnce(&mut Evidence)) -> Evidence {
    let mut evidence = Evidence::default();
    set(&mut evidence);
    evidence
}

/// Creates a take of an object whose former place is unknown.
pub fn taken(class: &str, strength: f32) -> PickUpEvidence {
    PickUpEvidence { class: ClassId::named(class), strength, frame: 10, top_m: None }
}

/// Creates a failed pick-up that is certain.
pub fn failed(track: u32, class: &str, top_m: f32) -> FailedAttempt {
    FailedAttempt {
        class: ClassId::named(class),
        top_m,
        frame: 10,
        track: TrackId(track),
        kind: AttemptKind::PickUp,
        strength: 1.0,
    }
}

#[test]
fn houses_have_15_possible_targets_of_four_sets() {
    assert_eq!(house().possible_targets.len(), 15);
    assert_eq!(scene::scene_of(&house().possible_targets), Some(SceneKind::House));
    assert_eq!(scene::scene_of(&street().possible_targets), Some(SceneKind::Street));
    assert_eq!(scene::scene_of(&yard().possible_targets), Some(SceneKind::Yard));
    assert_eq!(scene::scene_of(&[]), None);
    // Apple and orange occur in both kinds of scene, bananas of this class in houses only.
    assert_eq!(
        scene::scene_of(&Toy::room(4.0, 4.0).briefing().possible_targets),
        Some(SceneKind::House)
    );
}

#[test]
fn a_partner_that_is_never_seen_leaves_the_prior() {
    let briefing = house();
    let prior = Belief::new(&briefing);
    let mut belief = prior.clone();
    let mut toy = Toy::room(12.0, 12.0);
    let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
    for frame in [0, 50, 100] {
        toy.frame = frame;
        memory.update(&briefing, &toy.observe(), &crate::perception::Percepts::default());
        belief.observe(&briefing, &memory, &BehaviorLog::default());
    }
    assert_eq!(belief.goal.set_probabilities(), prior.goal.set_probabilities());
    assert_eq!(belief.constraint.probabilities(), prior.constraint.probabilities());
    assert_eq!((belief.evidence.n_sightings, belief.evidence.last_seen), (0, None));
}

#[test]
fn posteriors_are_proper_without_possible_hypotheses() {
    assert!(posterior(&[]).is_empty());
    assert_eq!(posterior(&[(0.0, -1.0)]), vec![0.0]);
    // Log-likelihoods far below the range of exp.
    assert_eq!(posterior(&[(0.5, -1e4), (0.5, -1e4), (0.0, 0.0)]), vec![0.5, 0.5, 0.0]);
}
