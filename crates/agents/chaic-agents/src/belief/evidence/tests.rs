use chaic_core::observation::{Grants, HeldIdentity, ObservedAction};
use chaic_core::{AgentId, EntityId, Hand, Vec3};

use super::*;
use crate::behavior::{BehaviorModel, GroundTruthBehavior, InferredBehavior};
use crate::belief::tests::house;
use crate::memory::ActionRecord;
use crate::perception::{Detection, Percepts};
use crate::test_support::Toy;

const APPLE: TrackId = TrackId(20);
const PEN: TrackId = TrackId(21);

fn detection(track: TrackId, class: &str, at: [f32; 3]) -> Detection {
    Detection {
        track,
        class: ClassId::named(class),
        confidence: 1.0,
        person: u16::try_from(track.0).ok().and_then(|e| EntityId(e).agent()),
        pixel: [0, 0],
        position_in_world: at.into(),
        bottom_m: at[1],
        top_m: at[1] + 0.1,
        n_pixels: 100,
        footprint: vec![],
    }
}

fn apple(at: [f32; 3]) -> Detection {
    detection(APPLE, "apple", at)
}

/// A partner of 1.2 m.
fn partner(x: f32, z: f32) -> Detection {
    let track = EntityId::from_agent(AgentId::PARTNER).into();
    Detection { top_m: 1.2, ..detection(track, "person", [x, 0.7, z]) }
}

/// An observer at the origin that looks toward -z.
struct Observer {
    toy: Toy,
    briefing: Briefing,
    memory: Memory,
    model: Box<dyn BehaviorModel>,
    evidence: Evidence,
}

impl Observer {
    fn new(grants: Grants) -> Observer {
        let toy = Toy::room(16.0, 16.0);
        let briefing = Briefing { grants, bounds: toy.bounds(), ..house() };
        let model: Box<dyn BehaviorModel> = match grants.behavior {
            true => Box::new(GroundTruthBehavior::default()),
            false => Box::new(InferredBehavior::new(AgentId::PARTNER)),
        };
        let memory = Memory::new(&briefing, crate::PlannerRules::paper());
        Observer { toy, briefing, memory, model, evidence: Evidence::default() }
    }

    fn observe(&mut self, frame: Frame, detections: &[Detection]) -> &Evidence {
        self.observe_granted(frame, detections, |_| ())
    }

    fn observe_granted(
        &mut self,
        frame: Frame,
        detections: &[Detection],
        grant: impl FnOnce(&mut chaic_core::observation::GrantedInfo),
    ) -> &Evidence {
        self.toy.frame = frame;
        let mut observation = self.toy.observe();
        grant(&mut observation.granted);
        let percepts = Percepts { detections: detections.to_vec(), ..Percepts::default() };
        self.memory.update(&self.briefing, &observation, &percepts);
        self.model.observe(&observation, &self.memory);
        self.evidence.observe(&self.briefing, &self.memory, self.model.log());
        &self.evidence
    }

    fn strength(&self, track: TrackId) -> Option<f32> {
        self.evidence.taken.get(&track).map(|t| t.strength)
    }
}

#[test]
fn an_object_held_at_two_places_is_certainly_taken() {
    let mut observer = Observer::new(Grants::NONE);
    observer.observe(80, &[partner(0.0, -3.0), apple([0.3, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), None, "there was no time to pick it up");
    observer.observe(110, &[partner(0.0, -3.0), apple([0.3, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), Some(0.4), "it may lie behind the hands");
    observer.observe(120, &[partner(0.4, -3.0), apple([0.7, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), Some(0.4), "less than 0.6 m away");
    observer.observe(130, &[partner(0.8, -3.0), apple([1.1, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), Some(1.0));
    let take = observer.evidence.taken[&APPLE];
    assert_eq!((take.class, take.frame, take.top_m), (ClassId::named("apple"), 130, None));
    // Certain takes are never retracted.
    observer.observe(900, &[apple([1.1, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), Some(1.0));
}

#[test]
fn a_person_who_passes_a_lying_object_does_not_hold_it() {
    let mut observer = Observer::new(Grants::NONE);
    // First seen beside the person, so memory takes it for held; the person passes by.
    for (frame, x) in [(110, -0.6), (120, -0.2), (130, 0.2), (140, 0.6)] {
        observer.observe(frame, &[partner(x, -3.0), apple([0.0, 0.8, -3.0])]);
        assert_eq!(observer.strength(APPLE), Some(0.4), "{x}");
    }
    // Seen alone, it still lies at its place.
    observer.observe(150, &[partner(2.0, -3.0), apple([0.0, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), None);
    let top_m = observer.evidence.lying_top_m(APPLE).expect("it was seen lying");
    assert!((top_m - 0.9).abs() < 1e-5, "{top_m}");
}

#[test]
fn an_object_that_was_seen_lying_elsewhere_is_probably_taken() {
    let mut observer = Observer::new(Grants::NONE);
    observer.observe(0, &[apple([2.0, 1.7, -4.0])]);
    observer.observe(100, &[partner(0.0, -3.0), apple([0.3, 0.8, -3.0])]);
    assert_eq!(observer.strength(APPLE), Some(0.8));
    let top_m = observer.evidence.taken[&APPLE].top_m.expect("it was seen lying");
    assert!((top_m - 1.8).abs() < 1e-5, "the top before the take, not in the hands");
}

#[test]
fn a_vanished_object_is_weak_evidence_and_returns() {
    let mut observer = Observer::new(Grants::NONE);
    observer.toy.size = 256;
    let at = [0.0, 1.2, -2.0];
    observer.observe(0, &[apple(at)]);
    for frame in [110, 120] {
        assert!(observer.observe(frame, &[]).taken.is_empty(), "overlooked once or twice");
    }
    for frame in [130, 140] {
        observer.observe(frame, &[]);
    }
    assert_eq!(observer.strength(APPLE), Some(0.3));
    assert!(observer.observe(150, &[apple(at)]).taken.is_empty(), "it is there again");
}

#[test]
fn the_agents_own_pick_ups_never_count() {
    let mut observer = Observer::new(Grants::NONE);
    observer.observe(0, &[apple([2.0, 0.8, -4.0])]);
    observer.memory.history.push(ActionRecord {
        frame: 5,
        action: Action::PickUp { object: APPLE, hand: Hand::Left },
        outcome: Outcome::Success,
    });
    observer.memory.objects.mark_absent(APPLE);
    observer.observe(10, &[]);
    assert_eq!(observer.strength(APPLE), None, "it vanished into the own hands");
    observer.memory.delivered.insert(APPLE);
    observer.memory.objects.mark_out_of_play(APPLE);
    let evidence = observer.observe(20, &[]);
    assert!(evidence.taken.is_empty());
    assert_eq!(evidence.delivered.keys().collect::<Vec<_>>(), [&APPLE]);
    // Others have delivered a pen.
    observer.observe(30, &[detection(PEN, "pen", [1.0, 0.5, -4.0])]);
    observer.memory.delivered.insert(PEN);
    observer.observe(40, &[]);
    assert_eq!((observer.strength(APPLE), observer.strength(PEN)), (None, Some(1.0)));
    assert_eq!(observer.evidence.delivered.len(), 2);
}

#[test]
fn granted_behavior_is_certain() {
    let mut observer = Observer::new(Grants { behavior: true, ..Grants::IDS });
    let pen = detection(PEN, "pen", [1.0, 1.7, -4.0]);
    observer.observe(0, &[apple([2.0, 0.8, -4.0]), pen]);
    let held = HeldIdentity {
        entity: EntityId(20),
        class: ClassId::named("apple"),
        contents: vec![(EntityId(22), ClassId::named("bed"))],
    };
    let action = ObservedAction {
        agent: AgentId::PARTNER,
        frame: 45,
        action: Action::PickUp { object: EntityId(21), hand: Hand::Left },
        outcome: Some(Outcome::Failure(FailureReason::BeyondLimits)),
    };
    for frame in [50, 60] {
        observer.observe_granted(frame, &[], |granted| {
            granted.partner_hands = Some([Some(held.clone()), None]);
            granted.behavior = vec![
                action,
                // Other failures, and those of other agents, say nothing about limits.
                ObservedAction {
                    frame: 46,
                    outcome: Some(Outcome::Failure(FailureReason::Blocked)),
                    ..action
                },
                ObservedAction { agent: AgentId::CHILD, ..action },
            ];
        });
    }
    assert_eq!(observer.strength(APPLE), Some(1.0));
    assert_eq!(observer.evidence.taken.len(), 1, "a bed is no possible target");
    let [failed] = observer.evidence.failed[..] else { panic!("one attempt is counted once") };
    assert_eq!((failed.track, failed.kind, failed.frame), (PEN, AttemptKind::PickUp, 45));
    assert!((failed.top_m - 1.8).abs() < 1e-5 && failed.strength == 1.0);
}

#[test]
fn a_successful_pick_up_counts_only_if_behavior_is_granted() {
    for (grants, expected) in
        [(Grants { behavior: true, ..Grants::IDS }, Some(1.0)), (Grants::IDS, None)]
    {
        let mut observer = Observer::new(grants);
        observer.observe(0, &[apple([2.0, 0.8, -4.0])]);
        let mut log = BehaviorLog::default();
        log.actions.push(crate::behavior::ObservedInteraction {
            agent: AgentId::PARTNER,
            frame: 8,
            action: Action::PickUp { object: APPLE, hand: Hand::Left },
            outcome: Some(Outcome::Success),
        });
        observer.evidence.observe(&observer.briefing, &observer.memory, &log);
        assert_eq!(observer.strength(APPLE), expected);
    }
}

#[test]
fn the_partner_passes_objects_that_still_lie_there_afterwards() {
    let mut observer = Observer::new(Grants::NONE);
    let at = [0.0, 0.5, -4.0];
    observer.observe(0, &[apple(at)]);
    observer.observe(10, &[partner(0.5, -3.5), apple(at)]);
    observer.observe(60, &[partner(3.5, -3.5), apple(at)]);
    assert!(observer.evidence.passed.is_empty(), "too soon");
    observer.observe(80, &[partner(3.5, -3.5)]);
    assert!(observer.evidence.passed.is_empty(), "the object was not seen since");
    observer.observe(90, &[apple(at)]);
    assert_eq!(observer.evidence.passed.get(&APPLE), Some(&ClassId::named("apple")));
    // A take refutes it.
    observer.observe(100, &[partner(1.4, -3.0), apple([1.7, 0.8, -3.0])]);
    assert!(observer.strength(APPLE).is_some() && observer.evidence.passed.is_empty());
}

#[test]
fn hidden_or_distant_objects_and_full_hands_are_no_passing() {
    let at = [0.6, 0.5, -4.0];
    for (case, wall, start_x, n_held) in
        [("hidden", true, -0.6, 0), ("distant", false, -2.5, 0), ("full hands", false, -0.6, 2)]
    {
        let mut observer = Observer::new(Grants::NONE);
        if wall {
            observer.toy.add_wall([-0.3, -6.0], [-0.2, -2.0]);
            observer.toy.stand([2.5, -4.0], std::f32::consts::FRAC_PI_2);
        }
        let mut detections = vec![apple(at)];
        observer.observe(0, &detections);
        detections.push(partner(start_x, -4.0));
        for k in 0..n_held {
            detections.push(detection(TrackId(30 + k), "key", [start_x, 0.8, -3.8]));
        }
        observer.observe(10, &detections);
        observer.observe(120, &[partner(-4.5, -4.0), apple(at)]);
        assert!(observer.evidence.passed.is_empty(), "{case}");
        // The partner comes again, visibly and with free hands.
        observer.observe(250, &[partner(1.5, -4.0), apple(at)]);
        observer.observe(400, &[partner(-4.5, -4.0), apple(at)]);
        assert_eq!(observer.evidence.passed.len(), 1, "{case}");
    }
}

#[test]
fn the_highest_point_needs_confirmation() {
    let mut observer = Observer::new(Grants::NONE);
    let body = |top_m: f32| Detection { top_m, ..partner(3.0, -4.0) };
    for (k, (top_m, expected)) in
        [(0.8, 0.8), (1.18, 0.9), (1.2, 1.2), (1.9, 1.3), (2.5, 1.3)].into_iter().enumerate()
    {
        let frame = 10 * (k as Frame + 1);
        let evidence = observer.observe(frame, &[body(top_m)]);
        assert!((evidence.max_top_m - expected).abs() < 1e-5, "{}", evidence.max_top_m);
        assert_eq!(evidence.last_seen, Some(frame));
    }
    assert_eq!(observer.evidence.n_sightings, 4, "a body of 2.5 m is an error");
    // A granted position shows no body.
    let pose = chaic_core::geom::Pose { position: Vec3::new(3.0, 0.0, -4.0), yaw_rad: 0.0 };
    observer.observe_granted(60, &[], |granted| granted.poses = vec![(AgentId::PARTNER, pose)]);
    assert_eq!((observer.evidence.n_sightings, observer.evidence.last_seen), (4, Some(60)));
    // In one frame with a detection, the detection's top counts.
    observer.observe_granted(70, &[body(1.25)], |granted| {
        granted.poses = vec![(AgentId::PARTNER, pose)];
    });
    assert_eq!(observer.evidence.n_sightings, 5);
}

#[test]
fn the_speed_follows_from_sightings() {
    let mut observer = Observer::new(Grants::NONE);
    for k in 0..30 {
        observer.observe(10 * k, &[partner(-3.5 + 0.236 * k as f32, -4.0)]);
    }
    let speed = observer.evidence.speed.expect("many sightings");
    assert!((speed - 0.0236).abs() < 5e-4, "{speed}");
}

#[test]
fn reliabilities_grow_with_the_strength() {
    for (strength, expected) in
        [(0.0, 0.0), (0.15, 0.25), (0.3, 0.5), (0.4, 0.92), (0.6, 0.94), (1.0, 0.98), (2.0, 0.98)]
    {
        assert!((reliability(strength) - expected).abs() < 1e-5, "{strength}");
    }
}
