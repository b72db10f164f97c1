//! Promises: a thing keeps its track while it lies, is carried, or is put down by oneself; two of a
//! kind have two; what is unsure is told when it is seen again; the own burden is none.

use chaic_agents::track::Carried;
use chaic_core::briefing::{Companion, Relation};
use chaic_core::geom::yaw_rotation;

use super::*;
use crate::labels::label_of;

const SIDE_PX: u32 = 256;

fn label(class: &str) -> u8 {
    label_of(ClassId::by_name(class))
}

fn seen(class: &str, score: f32, at: [f32; 3]) -> Sighting {
    let position_in_world = Vec3::from(at);
    let extent = Extent {
        pixel: [3, 4],
        position_in_world,
        bottom_m: at[1] - 0.05,
        top_m: at[1] + 0.05,
        n_pixels: 400,
        footprint: Vec::new(),
    };
    Sighting { label: label(class), score, extent }
}

fn person(top_m: f32, at: [f32; 3]) -> Sighting {
    let mut sighting = seen("person", 0.9, at);
    (sighting.extent.bottom_m, sighting.extent.top_m) = (0.0, top_m);
    sighting
}

struct Looker {
    tracker: Tracker,
    now: Frame,
    pose: Pose,
}

impl Looker {
    fn new(companions: &[(AgentId, Relation)]) -> Looker {
        let companion = |(agent, relation): &(AgentId, Relation)| Companion {
            agent: *agent,
            relation: *relation,
        };
        let companions = companions.iter().map(companion).collect();
        let tracker = Tracker { companions, height_m: 1.75, ..Tracker::default() };
        Looker { tracker, now: 0, pose: Pose::default() }
    }

    fn look(&mut self, sightings: &[Sighting]) -> Vec<Detection> {
        self.now += 10;
        let camera = Camera {
            eye_in_world: self.pose.position + 1.65 * Vec3::Y,
            world_from_camera: yaw_rotation(self.pose.yaw_rad),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: SIDE_PX,
            height: SIDE_PX,
        };
        // So far off that nothing is hidden.
        let depth_m = vec![50.0; (SIDE_PX * SIDE_PX) as usize];
        self.tracker.update(sightings, (self.now, self.pose), (&depth_m, &camera)).0
    }

    fn hold(&mut self, held: Option<(TrackId, &str)>) {
        let carried = held.map(|(track, class)| Carried {
            what: Some((track, ClassId::named(class))),
            contents: Vec::new(),
            n_contents: 0,
        });
        self.tracker.feel(&Hands { hands: [carried, None], is_joint: false }, None);
    }
}

fn tracks(found: &[Detection]) -> Vec<TrackId> {
    found.iter().map(|d| d.track).collect()
}

#[test]
fn what_lies_keeps_its_track_and_two_of_a_kind_have_two() {
    let mut looker = Looker::new(&[]);
    let (left, right) = ([-1.0, 0.8, -3.0], [1.0, 0.8, -3.0]);
    let first = looker.look(&[seen("apple", 0.9, left), seen("apple", 0.9, right)]);
    assert_eq!(first.len(), 2);
    // In another order, a little off.
    let again =
        looker.look(&[seen("apple", 0.9, [1.1, 0.8, -3.0]), seen("apple", 0.9, [-1.1, 0.8, -3.0])]);
    assert_eq!(tracks(&again), tracks(&first));
    assert!(again[1].position_in_world.x > 0.0);
    // Taken for something else for once.
    let other = looker.look(&[seen("orange", 0.9, left)]);
    assert_eq!((other[0].track, other[0].class.name()), (first[0].track, "apple"));
    let elsewhere = looker.look(&[seen("apple", 0.9, [4.0, 0.8, -3.0])]);
    assert!(!tracks(&first).contains(&elsewhere[0].track));
}

#[test]
fn what_is_unsure_is_told_when_it_is_seen_again_and_not_after_its_place_was_seen_empty() {
    let mut looker = Looker::new(&[]);
    let at = [0.0, 1.0, -2.0];
    assert!(looker.look(&[seen("wicker_basket", 0.4, at)]).is_empty());
    assert_eq!(looker.look(&[seen("wicker_basket", 0.4, at)]).len(), 0);
    assert_eq!(looker.look(&[seen("wicker_basket", 0.4, at)]).len(), 1);
    let mut looker = Looker::new(&[]);
    looker.look(&[seen("wicker_basket", 0.4, at)]);
    looker.look(&[]);
    looker.look(&[seen("wicker_basket", 0.4, at)]);
    assert!(looker.look(&[seen("wicker_basket", 0.4, at)]).is_empty(), "seen empty in between");
    assert!(looker.look(&[seen("wicker_basket", 0.15, at)]).is_empty(), "that is nothing");
}

#[test]
fn what_one_lets_go_of_is_the_same_where_it_lies_then() {
    let mut looker = Looker::new(&[]);
    let apple = looker.look(&[seen("apple", 0.9, [0.0, 0.8, -1.0])])[0].track;
    looker.hold(Some((apple, "apple")));
    let in_hand = Vec3::new(-0.2, 0.57 * 1.75, -0.31 * 1.75);
    assert!(looker.look(&[seen("apple", 0.9, in_hand.into())]).is_empty(), "it is the own burden");
    looker.pose.position = Vec3::new(6.0, 0.0, 0.0);
    looker.look(&[]);
    looker.hold(None);
    let put = looker.look(&[seen("apple", 0.9, [6.3, 0.5, -1.2])]);
    assert_eq!(tracks(&put), [apple]);
}

#[test]
fn what_somebody_carries_keeps_its_track_on_the_way() {
    let partner = (AgentId::PARTNER, Relation::Partner);
    let mut looker = Looker::new(&[partner]);
    let mut at = [0.0, 1.0, -3.0];
    let first = looker.look(&[person(1.7, at), seen("apple", 0.9, at)]);
    let apple = first.iter().find(|d| d.person.is_none()).expect("it is seen").track;
    for _ in 0..5 {
        at[0] += 0.6;
        let found = looker.look(&[person(1.7, at), seen("apple", 0.9, at)]);
        assert!(tracks(&found).contains(&apple) && found.len() == 2, "{found:?}");
    }
}

#[test]
fn people_are_told_apart_by_height_and_by_where_they_were() {
    let companions = [(AgentId::PARTNER, Relation::Partner), (AgentId::CHILD, Relation::Child)];
    let mut looker = Looker::new(&companions);
    let of = |found: &[Detection], agent: AgentId| {
        found.iter().find(|d| d.person == Some(agent)).map(|d| d.position_in_world.x)
    };
    let found = looker.look(&[person(1.2, [-1.0, 0.6, -3.0]), person(1.7, [1.0, 0.9, -3.0])]);
    assert_eq!(of(&found, AgentId::CHILD), Some(-1.0));
    assert_eq!(of(&found, AgentId::PARTNER), Some(1.0));
    let found = looker.look(&[person(1.2, [-1.2, 0.6, -3.0])]);
    assert_eq!((of(&found, AgentId::CHILD), found.len()), (Some(-1.2), 1));
    // Whoever is alone is the one companion that there is.
    let mut looker = Looker::new(&companions[..1]);
    let found = looker.look(&[person(1.2, [-1.0, 0.6, -3.0])]);
    assert_eq!(of(&found, AgentId::PARTNER), Some(-1.0));
}
