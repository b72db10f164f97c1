//! Walks of a partner past an apple and a banana in an open room.

use super::*;
use crate::belief::tests::house;
use crate::perception::{Detection, Percepts};
use crate::test_support::{Toy, seen};

const APPLE: TrackId = TrackId(20);

/// The apple in the east and a banana in the west of the partner, who starts at (0, -3).
fn fruit() -> Vec<Detection> {
    vec![
        seen(APPLE, "apple", [3.0, 0.0, -3.0], 0.1, 0.1),
        seen(TrackId(21), "banana", [-4.5, 0.0, -3.0], 0.1, 0.1),
    ]
}

/// An observer far from the objects, who tracks the partner.
struct Observer {
    briefing: Briefing,
    memory: Memory,
    log: BehaviorLog,
    walks: ObservedWalks,
}

impl Observer {
    fn new(detections: &[Detection]) -> Observer {
        Observer::in_room(&Toy::room(16.0, 16.0), detections)
    }

    fn in_room(toy: &Toy, detections: &[Detection]) -> Observer {
        let (bounds, layout) = (toy.bounds(), Some(toy.layout()));
        let briefing = Briefing { bounds, layout, ..house() };
        let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
        let percepts = Percepts { detections: detections.to_vec(), ..Percepts::default() };
        memory.update(&briefing, &toy.observe(), &percepts);
        let (log, walks) = (BehaviorLog::default(), ObservedWalks::default());
        Observer { briefing, memory, log, walks }
    }

    /// Sees the partner at these x on the line z = -3, every 20 frames from this frame on.
    fn walk(&mut self, from: Frame, xs: &[f32]) {
        for (frame, x) in (from..).step_by(20).zip(xs) {
            self.memory.frame = frame;
            let at = Vec2::new(*x, -3.0);
            self.walks.observe(&self.briefing, &self.memory, &self.log, at);
        }
    }

    fn frames(&self, classes: &[&str]) -> f32 {
        let bit = |name: &&str| class_bit(&self.briefing, ClassId::named(name));
        self.walks.frames(classes.iter().map(bit).fold(0, |all, bit| all | bit))
    }

    fn hold(&mut self, classes: &[&str], frame: Frame) {
        let held = (60..).map(TrackId).zip(classes.iter().map(|c| ClassId::named(c)));
        self.log.partner_holds = held.collect();
        self.log.partner_holds_frame = Some(frame);
    }
}

/// Two walks away from the apple and towards the banana.
const AWAY: [f32; 3] = [0.0, -1.0, -2.0];

#[test]
fn two_walks_away_from_an_apple_speak_against_apples() {
    let mut observer = Observer::new(&fruit());
    observer.walk(0, &AWAY);
    assert_eq!(observer.frames(&["apple"]), 40.0);
    assert_eq!(observer.frames(&["banana"]), 0.0, "it approached the banana");
    // If both are wanted, the walk to the banana explains everything.
    assert_eq!(observer.frames(&["apple", "banana"]), 0.0);
    assert_eq!(observer.frames(&["orange"]), 0.0);
    assert_eq!(observer.frames(&["apple", "orange"]), 40.0);
    assert!(!observer.walks.frames.is_empty());
}

#[test]
fn a_walk_towards_the_apple_does_not() {
    let mut observer = Observer::new(&fruit()[..1]);
    observer.walk(0, &[0.0, 1.0, 2.0]);
    assert!(observer.walks.frames.is_empty());
    // A walk that passes the apple within reach does not count either.
    let mut observer = Observer::new(&fruit()[..1]);
    observer.walk(0, &[3.2, 4.1]);
    assert_eq!(observer.frames(&["apple"]), 0.0);
    observer.walk(40, &[5.2]);
    assert_eq!(observer.frames(&["apple"]), 20.0, "it left");
}

#[test]
fn the_angle_to_the_walk_decides() {
    // Seen from (0, -3), which the walk leaves to the west: 40 and 50 degrees off.
    for (degrees, frames) in [(40.0_f32, 0.0), (50.0, 20.0)] {
        let (sin, cos) = (
            chaic_core::geom::math::sin(degrees.to_radians()),
            chaic_core::geom::math::cos(degrees.to_radians()),
        );
        let at = [-4.0 * cos, 0.0, -3.0 - 4.0 * sin];
        let mut observer = Observer::new(&[seen(APPLE, "apple", at, 0.1, 0.1)]);
        observer.walk(0, &[0.0, -0.9]);
        assert_eq!(observer.frames(&["apple"]), frames, "{degrees} degrees");
    }
}

#[test]
fn full_hands_explain_every_walk() {
    for (held, frames) in [
        (&["apple", "banana"][..], 0.0),
        (&["pen", "pen"], 0.0),
        (&["apple"], 40.0),
        (&[], 40.0),
        // A container is no target, so one more object fits.
        (&["wicker_basket", "apple"], 40.0),
    ] {
        let mut observer = Observer::new(&fruit());
        observer.hold(held, 0);
        observer.walk(0, &AWAY);
        assert_eq!(observer.frames(&["apple"]), frames, "{held:?}");
    }
    // A load that was seen long ago says nothing.
    let mut observer = Observer::new(&fruit());
    observer.hold(&["apple", "banana"], 0);
    observer.walk(400, &AWAY);
    assert_eq!(observer.frames(&["apple"]), 40.0);
}

#[test]
fn a_container_ahead_explains_the_walk_unless_the_partner_has_one() {
    let basket = seen(TrackId(22), "wicker_basket", [-4.0, 0.0, -3.0], 0.3, 0.3);
    let mut observer = Observer::new(&[fruit(), vec![basket]].concat());
    observer.walk(0, &AWAY);
    assert!(observer.walks.frames.is_empty());
    observer.hold(&["wicker_basket"], 100);
    observer.walk(100, &AWAY);
    assert_eq!(observer.frames(&["apple"]), 40.0);
}

#[test]
fn slow_and_late_walks_do_not_count() {
    // 100 frames for one meter contain a stop.
    let mut observer = Observer::new(&fruit());
    observer.walk(0, &[0.0, -0.1, -0.2, -0.3, -0.4, -1.0]);
    assert!(observer.walks.frames.is_empty());
    // The walk after the stop counts.
    observer.walk(120, &[-2.0]);
    assert_eq!(observer.frames(&["apple"]), 20.0);
    // A partner that stands still never counts.
    let mut observer = Observer::new(&fruit());
    observer.walk(0, &[0.0; 50]);
    assert!(observer.walks.frames.is_empty());
    // After 60 % of the episode it may be on its way to the goal place.
    let mut observer = Observer::new(&fruit());
    let late = observer.briefing.horizon * 6 / 10 + 20;
    observer.walk(late, &AWAY);
    assert!(observer.walks.frames.is_empty());
    let mut observer = Observer::new(&fruit());
    observer.walk(late - 100, &AWAY);
    assert!(!observer.walks.frames.is_empty());
}

#[test]
fn only_known_objects_that_lie_there_count() {
    // Too far away to notice.
    let mut observer = Observer::new(&[seen(APPLE, "apple", [7.0, 0.0, -3.0], 0.1, 0.1)]);
    observer.walk(0, &AWAY);
    assert!(observer.walks.frames.is_empty());
    // Behind a wall.
    let mut toy = Toy::room(16.0, 16.0);
    toy.add_wall([1.4, -8.0], [1.6, 8.0]);
    let mut observer = Observer::in_room(&toy, &fruit());
    observer.walk(0, &AWAY);
    assert!(observer.walks.frames.is_empty());
    // No possible target.
    let mut observer = Observer::new(&[seen(APPLE, "trashbin", [3.0, 0.0, -3.0], 0.4, 0.9)]);
    observer.walk(0, &AWAY);
    assert!(observer.walks.frames.is_empty());
    // Taken between the two walks.
    let mut observer = Observer::new(&fruit());
    observer.walk(0, &AWAY[..2]);
    observer.memory.objects.mark_held(APPLE, 1000);
    observer.walk(40, &AWAY[2..]);
    assert_eq!(observer.frames(&["apple"]), 20.0);
}

#[test]
fn nothing_counts_without_sightings() {
    let mut observer = Observer::new(&fruit());
    assert!(observer.walks.frames.is_empty());
    observer.walk(0, &[0.0]);
    assert!(observer.walks.frames.is_empty(), "one sighting is no walk");
    let mut observer = Observer::new(&[]);
    observer.walk(0, &AWAY);
    assert!(observer.walks.frames.is_empty(), "no objects");
    assert_eq!(observer.frames(&["apple", "banana"]), 0.0);
}
