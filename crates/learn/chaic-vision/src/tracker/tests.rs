//! Promises: an object keeps its track while it lies, is carried or is put down; two objects of one
//! class have two tracks; uncertain objects are reported after a second detection; held objects and
//! their contents are no detections; only images that can show an object are evidence against it.

use chaic_agents::track::CarriedObject;
use chaic_core::Hand;
use chaic_core::briefing::{Companion, CompanionRole};
use chaic_core::geom::yaw_rotation;
use chaic_core::rng::RngStream;

use super::*;
use crate::labels::label_of;

const SIDE_PX: u32 = 256;

fn label(class: &str) -> u8 {
    label_of(ClassId::from_name(class))
}

fn measurement(class: &str, score: f32, at: [f32; 3]) -> Measurement {
    let position_in_world = Vec3::from(at);
    let extent = SegmentMeasurement {
        pixel: [3, 4],
        position_in_world,
        bottom_m: at[1] - 0.05,
        top_m: at[1] + 0.05,
        n_pixels: 400,
        footprint: Vec::new(),
    };
    Measurement { names: vec![(label(class), score)], extent }
}

fn person(top_m: f32, at: [f32; 3]) -> Measurement {
    let mut measurement = measurement("person", 0.9, at);
    (measurement.extent.bottom_m, measurement.extent.top_m) = (0.0, top_m);
    measurement
}

/// Camera of an adult at this pose.
fn camera(pose: Pose) -> Camera {
    Camera {
        eye_in_world: pose.position + 1.65 * Vec3::Y,
        world_from_camera: yaw_rotation(pose.yaw_rad),
        vertical_fov_rad: Camera::EYE_FOV_RAD,
        width: SIDE_PX,
        height: SIDE_PX,
    }
}

struct Observer {
    tracker: Tracker,
    now: Frame,
    pose: Pose,
    /// Step to the right before each image, meters: the same view again is no new evidence.
    step_m: f32,
}

impl Observer {
    fn new(companions: &[(AgentId, CompanionRole)]) -> Observer {
        let companion =
            |(agent, role): &(AgentId, CompanionRole)| Companion { agent: *agent, role: *role };
        let companions = companions.iter().map(companion).collect();
        let tracker = Tracker { companions, height_m: 1.75, ..Tracker::default() };
        Observer { tracker, now: 0, pose: Pose::default(), step_m: 0.001 }
    }

    fn observe(&mut self, measurements: &[Measurement]) -> Vec<Detection> {
        self.now += 10;
        self.pose.position.x += self.step_m;
        let camera = camera(self.pose);
        // Far away, so that nothing is occluded.
        let depth_m = vec![50.0; (SIDE_PX * SIDE_PX) as usize];
        self.tracker.update(measurements, self.now, self.pose, &depth_m, &camera).0
    }

    fn hold(&mut self, held: Option<(TrackId, &str)>) {
        let carried = held.map(|(track, class)| CarriedObject {
            object: Some((track, ClassId::named(class))),
            contents: Vec::new(),
            n_contents: 0,
        });
        self.tracker.update_hands(&Hands { hands: [carried, None], is_joint: false }, None);
    }
}

fn track(observer: &Observer, id: TrackId) -> &Track {
    observer.tracker.tracks.iter().find(|track| track.id == id).expect("it is known")
}

/// A refrigerator with these visible points from above.
fn refrigerator(points: &[[f32; 2]]) -> Measurement {
    let footprint: Vec<Vec2> = points.iter().map(|point| Vec2::from(*point)).collect();
    let mean = footprint.iter().sum::<Vec2>() / footprint.len() as f32;
    let mut seen = measurement("refrigerator", 0.9, [mean.x, 1.0, mean.y]);
    (seen.extent.top_m, seen.extent.footprint) = (1.8, footprint);
    seen
}

fn tracks(found: &[Detection]) -> Vec<TrackId> {
    found.iter().map(|d| d.track).collect()
}

#[test]
fn static_objects_keep_their_tracks() {
    let mut observer = Observer::new(&[]);
    let (left, right) = ([-1.0, 0.8, -3.0], [1.0, 0.8, -3.0]);
    let first =
        observer.observe(&[measurement("apple", 0.9, left), measurement("apple", 0.9, right)]);
    assert_eq!(first.len(), 2);
    // Different order, small displacement.
    let second = observer.observe(&[
        measurement("apple", 0.9, [1.1, 0.8, -3.0]),
        measurement("apple", 0.9, [-1.1, 0.8, -3.0]),
    ]);
    assert_eq!(tracks(&second), tracks(&first));
    assert!(second[1].position_in_world.x > 0.0);
    // One detection with a wrong class.
    let other = observer.observe(&[measurement("orange", 0.9, left)]);
    assert_eq!((other[0].track, other[0].class.name()), (first[0].track, "apple"));
    let elsewhere = observer.observe(&[measurement("apple", 0.9, [4.0, 0.8, -3.0])]);
    assert!(!tracks(&first).contains(&elsewhere[0].track));
}

#[test]
fn uncertain_objects_need_several_detections() {
    let mut observer = Observer::new(&[]);
    let at = [0.0, 1.0, -2.0];
    assert!(observer.observe(&[measurement("wicker_basket", 0.4, at)]).is_empty());
    assert_eq!(observer.observe(&[measurement("wicker_basket", 0.4, at)]).len(), 0);
    assert_eq!(observer.observe(&[measurement("wicker_basket", 0.4, at)]).len(), 1);
    let mut observer = Observer::new(&[]);
    observer.observe(&[measurement("wicker_basket", 0.4, at)]);
    observer.observe(&[]);
    observer.observe(&[measurement("wicker_basket", 0.4, at)]);
    assert!(
        observer.observe(&[measurement("wicker_basket", 0.4, at)]).is_empty(),
        "its place was visible and empty"
    );
    assert!(
        observer.observe(&[measurement("wicker_basket", 0.15, at)]).is_empty(),
        "the score is too low"
    );
}

#[test]
fn repeated_detections_with_several_names_make_the_class_certain() {
    let mut observer = Observer::new(&[]);
    let at = [0.0, 1.0, -2.0];
    let mut uncertain = measurement("apple", 0.6, at);
    uncertain.names.push((label("orange"), 0.3));
    let first = observer.observe(std::slice::from_ref(&uncertain));
    assert!((0.3..0.8).contains(&first[0].confidence), "{}", first[0].confidence);
    for _ in 0..8 {
        observer.observe(std::slice::from_ref(&uncertain));
    }
    let last = observer.observe(std::slice::from_ref(&uncertain));
    assert_eq!((last[0].track, last[0].class.name()), (first[0].track, "apple"));
    assert!(last[0].confidence > 0.9, "{}", last[0].confidence);
    // The order of the names changes, and the object has moved a little.
    let reversed = Measurement {
        names: vec![(label("orange"), 0.5), (label("apple"), 0.4)],
        ..measurement("orange", 0.5, [0.25, 1.0, -2.0])
    };
    let next = observer.observe(&[reversed]);
    assert_eq!((next[0].track, next[0].class.name()), (first[0].track, "apple"));
}

#[test]
fn released_objects_keep_their_track() {
    let mut observer = Observer::new(&[]);
    let apple = observer.observe(&[measurement("apple", 0.9, [0.0, 0.8, -1.0])])[0].track;
    observer.hold(Some((apple, "apple")));
    let in_hand = Vec3::new(-0.2, 0.57 * 1.75, -0.31 * 1.75);
    assert!(
        observer.observe(&[measurement("apple", 0.9, in_hand.into())]).is_empty(),
        "it is held by the agent"
    );
    observer.pose.position = Vec3::new(6.0, 0.0, 0.0);
    observer.observe(&[]);
    observer.hold(None);
    let released = observer.observe(&[measurement("apple", 0.9, [6.3, 0.5, -1.2])]);
    assert_eq!(tracks(&released), [apple]);
}

#[test]
fn large_objects_keep_their_track_in_all_views_and_touching_ones_have_two() {
    let [x, _, z] = ClassId::named("refrigerator").info().size_m;
    // Points along a line from `from` to `to`, as seen from above.
    let seen = |from: Vec2, to: Vec2| {
        let footprint: Vec<Vec2> = (0..=8).map(|k| from.lerp(to, k as f32 / 8.0)).collect();
        let middle = from.lerp(to, 0.5);
        let mut seen = measurement("refrigerator", 0.9, [middle.x, 1.0, middle.y]);
        (seen.extent.top_m, seen.extent.footprint) = (1.8, footprint);
        seen
    };
    let corner = Vec2::new(0.0, -4.0);
    let front = seen(corner, corner + Vec2::new(x, 0.0));
    let side = seen(corner, corner - Vec2::new(0.0, z));
    let mut observer = Observer::new(&[]);
    let first = tracks(&observer.observe(std::slice::from_ref(&front)));
    assert_eq!(tracks(&observer.observe(&[side])), first);
    let neighbor = seen(corner + Vec2::new(x, 0.0), corner + Vec2::new(2.0 * x, 0.0));
    let both = tracks(&observer.observe(&[neighbor, front]));
    assert!(both.len() == 2 && both.contains(&first[0]), "{both:?}");
}

fn object(measurement: &Measurement, in_hand: bool) -> DetectedObject<'_> {
    DetectedObject { measurement, in_hand, plan_extent: OnceCell::new() }
}

/// Cost of a match that compares labels first, whatever the distance.
fn reference_cost(
    tracker: &Tracker,
    track: &Track,
    object: &DetectedObject<'_>,
    now: Frame,
) -> Option<f32> {
    let (config, measurement) = (&tracker.config, object.measurement);
    let position = measurement.extent.position_in_world;
    let distance_m = track.position.distance(position);
    let agreement = track.agreement(measurement);
    if agreement < MIN_AGREEMENT {
        let is_same_kind = pixel_kind(track.label) == pixel_kind(measurement.label());
        return (is_same_kind && distance_m < config.max_relabeled_m).then_some(1.0 + distance_m);
    }
    if track.is_released {
        let distance_m = horizontal_distance(track.position, position);
        return (distance_m < config.max_released_m).then_some(distance_m / config.max_static_m);
    }
    let similarity_cost = DISAGREEMENT_COST * (1.0 - agreement);
    let may_be_carried = track.is_carried || object.in_hand;
    if !may_be_carried && let Some(extent) = &track.extent {
        let seen = PlanExtent::new(&measurement.extent.footprint)?;
        let distance_m = extent.center().distance(seen.center());
        let is_same = config.is_one_object(track.label, extent, &seen);
        return is_same.then_some(distance_m / config.max_static_m + similarity_cost);
    }
    let n_frames = (now - track.last_seen) as f32;
    let max_walk_m = config.max_static_m + config.carried_m_per_frame * n_frames;
    let max_m = match may_be_carried {
        true if track.is_carried && object.in_hand => max_walk_m,
        true => max_walk_m.min(config.max_carried_m),
        false => config.max_static_m,
    };
    (distance_m < max_m).then_some(distance_m / config.max_static_m + similarity_cost)
}

#[test]
fn costs_are_bit_identical_to_those_that_compare_the_labels_of_all_pairs() {
    let draw = |rng: &mut RngStream| {
        let class = ["apple", "orange", "refrigerator", "trashbin"][rng.below(4)];
        let reach_m = [0.1, 0.5, 3.0][rng.below(3)];
        let at = [(); 3].map(|()| rng.range(-reach_m, reach_m));
        let mut drawn = measurement(class, rng.range(0.3, 0.9), at);
        if rng.chance(0.3) {
            drawn.names.push((label("banana"), 0.1));
        }
        let n_points = rng.below(9);
        let mut point = || Vec2::new(at[0] + rng.range(-0.4, 0.4), at[2] + rng.range(-0.4, 0.4));
        drawn.extent.footprint = (0..n_points).map(|_| point()).collect();
        drawn
    };
    let mut rng = RngStream::new(1, "pairs", 0);
    let mut n_possible = 0;
    for _ in 0..3000 {
        let [first, second] = [(); 2].map(|()| draw(&mut rng));
        let [was_in_hand, in_hand, is_released] = [0.3, 0.3, 0.2].map(|p| rng.chance(p));
        let mut tracker = Tracker::default();
        let seen_first = object(&first, was_in_hand);
        tracker.start_track(&seen_first, 0);
        let (config, now) = (tracker.config, 30);
        let track = &mut tracker.tracks[0];
        track.add_evidence(&first, &config);
        track.locate(&seen_first, 0, &config);
        track.is_released = is_released;
        let (track, second) = (&tracker.tracks[0], object(&second, in_hand));
        let [cost, expected] =
            [tracker.cost(track, &second, now), reference_cost(&tracker, track, &second, now)];
        assert_eq!(cost.map(f32::to_bits), expected.map(f32::to_bits), "{track:?}");
        n_possible += usize::from(cost.is_some());
    }
    assert!((100..2900).contains(&n_possible), "{n_possible}");
}

#[test]
fn contents_of_a_held_container_are_no_detections() {
    let mut observer = Observer::new(&[]);
    let basket = observer.observe(&[measurement("plastic_basket", 0.9, [0.0, 0.8, -1.0])])[0].track;
    let above = [-0.2, 1.25, -0.31 * 1.75];
    for (n_contents, n_detections) in [(0, 1), (1, 0)] {
        let carried = CarriedObject {
            object: Some((basket, ClassId::named("plastic_basket"))),
            contents: Vec::new(),
            n_contents,
        };
        observer
            .tracker
            .update_hands(&Hands { hands: [Some(carried), None], is_joint: false }, None);
        assert_eq!(observer.observe(&[measurement("pen", 0.9, above)]).len(), n_detections);
    }
}

#[test]
fn carried_objects_keep_their_track() {
    let partner = (AgentId::PARTNER, CompanionRole::Partner);
    let mut observer = Observer::new(&[partner]);
    let mut at = [0.0, 1.0, -3.0];
    let first = observer.observe(&[person(1.7, at), measurement("apple", 0.9, at)]);
    let apple = first.iter().find(|d| d.person.is_none()).expect("the apple is visible").track;
    for _ in 0..5 {
        at[0] += 0.6;
        let found = observer.observe(&[person(1.7, at), measurement("apple", 0.9, at)]);
        assert!(tracks(&found).contains(&apple) && found.len() == 2, "{found:?}");
    }
    // The person is seen again later, far away.
    observer.now += 1000;
    at[0] += 12.0;
    let found = observer.observe(&[person(1.7, at), measurement("apple", 0.9, at)]);
    assert!(tracks(&found).contains(&apple), "{found:?}");
}

#[test]
fn people_are_associated_by_height_and_position() {
    let companions =
        [(AgentId::PARTNER, CompanionRole::Partner), (AgentId::CHILD, CompanionRole::Child)];
    let mut observer = Observer::new(&companions);
    let x_of = |found: &[Detection], agent: AgentId| {
        found.iter().find(|d| d.person == Some(agent)).map(|d| d.position_in_world.x)
    };
    let found = observer.observe(&[person(1.2, [-1.0, 0.6, -3.0]), person(1.7, [1.0, 0.9, -3.0])]);
    assert_eq!(x_of(&found, AgentId::CHILD), Some(-1.0));
    assert_eq!(x_of(&found, AgentId::PARTNER), Some(1.0));
    let found = observer.observe(&[person(1.2, [-1.2, 0.6, -3.0])]);
    assert_eq!((x_of(&found, AgentId::CHILD), found.len()), (Some(-1.2), 1));
    // A single person is the only companion.
    let mut observer = Observer::new(&companions[..1]);
    let found = observer.observe(&[person(1.2, [-1.0, 0.6, -3.0])]);
    assert_eq!(x_of(&found, AgentId::PARTNER), Some(-1.0));
}

#[test]
fn pixels_within_a_known_obstacle_are_not_static_until_it_is_removed() {
    let mut observer = Observer::new(&[]);
    let mut bin = measurement("trashbin", 0.9, [0.0, 0.4, -3.0]);
    bin.extent.footprint = (-1..=1).map(|k| Vec2::new(0.125 * k as f32, -3.0)).collect();
    let found = observer.observe(std::slice::from_ref(&bin));
    let camera = camera(Pose::default());
    // A plane through the obstacle.
    let depth_m = vec![3.0; (SIDE_PX * SIDE_PX) as usize];
    let masked = |observer: &Observer| {
        let mut mask = vec![false; depth_m.len()];
        observer.tracker.mask_movables(&depth_m, &camera, 1, &mut mask);
        mask
    };
    let mask = masked(&observer);
    let at = |x: f32, y: f32| {
        let (px, _) = camera.project(Vec3::new(x, y, -3.0)).expect("in view");
        mask[px.y as usize * SIDE_PX as usize + px.x as usize]
    };
    // Inside, in the margin, beside it, the floor, and a wall above it.
    let points = [(0.0, 0.5), (0.2, 0.5), (0.4, 0.5), (0.0, 0.03), (0.0, 1.2)];
    assert_eq!(points.map(|(x, y)| at(x, y)), [true, true, false, false, false]);
    let obstacle = found[0].track;
    let removal = Action::RemoveObstacle { obstacle, hand: Hand::Left };
    observer.tracker.update_hands(&Hands::default(), Some((removal, Outcome::Success)));
    observer.observe(&[]);
    assert!(!masked(&observer).contains(&true));
}

#[test]
fn an_object_held_for_a_smaller_one_is_not_static_and_hides_no_detection() {
    let mut observer = Observer::new(&[]);
    let pen = observer.observe(&[measurement("pen", 0.9, [0.0, 0.8, -1.0])])[0].track;
    observer.hold(Some((pen, "pen")));
    // A point in front of the left hand, farther from it than a pen reaches.
    let point = Vec3::new(-0.5, 1.0, -0.7);
    let camera = camera(Pose::default());
    let (px, _) = camera.project(point).expect("in view");
    let k = px.y as usize * SIDE_PX as usize + px.x as usize;
    let masked = |depth: f32| {
        let depth_m = vec![depth; (SIDE_PX * SIDE_PX) as usize];
        let mut mask = vec![false; depth_m.len()];
        observer.tracker.mask_held(observer.pose, &depth_m, &camera, 1, &mut mask);
        mask[k]
    };
    assert_eq!([masked(0.7), masked(1.5)], [true, false]);
    assert_eq!(observer.observe(&[measurement("apple", 0.9, point.into())]).len(), 1);
}

#[test]
fn a_missed_object_has_a_pixel_at_its_place_if_the_depth_is_that_of_the_object() {
    let mut observer = Observer::new(&[]);
    let at = [0.5, 0.8, -3.0];
    let apple = observer.observe(&[measurement("apple", 0.9, at)])[0].track;
    let camera = camera(observer.pose);
    let (px, depth) = camera.project(Vec3::from(at)).expect("it is ahead");
    let missed = |observer: &Observer, depth_m: f32| {
        let depth_m = vec![depth_m; (SIDE_PX * SIDE_PX) as usize];
        observer.tracker.missed(observer.now, &depth_m, &camera)
    };
    assert!(missed(&observer, depth).is_empty(), "it is detected");
    observer.observe(&[]);
    assert_eq!(missed(&observer, depth), [(apple, [px.x as u32, px.y as u32])]);
    for other in [depth - 0.5, depth + 0.5] {
        assert!(missed(&observer, other).is_empty(), "occluded, or gone");
    }
    let turned = Pose { yaw_rad: std::f32::consts::PI, ..observer.pose };
    let depth_m = vec![depth; (SIDE_PX * SIDE_PX) as usize];
    let behind = observer.tracker.missed(observer.now, &depth_m, &self::camera(turned));
    assert!(behind.is_empty(), "behind");
    observer.hold(Some((apple, "apple")));
    observer.observe(&[]);
    assert!(missed(&observer, depth).is_empty(), "held");
}

#[test]
fn images_that_cannot_show_an_object_are_no_evidence_against_it() {
    let partner = (AgentId::PARTNER, CompanionRole::Partner);
    let is_lowered = |observer: &mut Observer, id: TrackId| {
        let before = track(observer, id).log_odds;
        observer.observe(&[]);
        track(observer, id).log_odds < before
    };
    let ahead = [0.0, 1.0, -2.0];
    // At rest, in full view; at the border; within the range of detections, and beyond it.
    for (class, at, expected) in [
        ("wicker_basket", ahead, true),
        ("wicker_basket", [-1.9, 1.0, -2.0], false),
        ("truck", [0.0, 1.0, -9.5], true),
        ("truck", [0.0, 1.0, -10.5], false),
    ] {
        let mut observer = Observer::new(&[]);
        let id = observer.observe(&[measurement(class, 0.9, at)])[0].track;
        assert_eq!(is_lowered(&mut observer, id), expected, "{class} at {at:?}");
    }
    let mut observer = Observer::new(&[partner]);
    let found = observer.observe(&[person(1.7, ahead), measurement("wicker_basket", 0.9, ahead)]);
    let basket = found.iter().find(|d| d.person.is_none()).expect("the basket is visible").track;
    assert!(!is_lowered(&mut observer, basket), "the partner carries it");
    observer.hold(Some((basket, "wicker_basket")));
    observer.observe(&[]);
    observer.hold(None);
    observer.observe(&[]);
    // The place of the release is in view.
    observer.pose.position.z += 2.5;
    assert!(!is_lowered(&mut observer, basket), "it lies near the place of the release");
}

#[test]
fn the_same_view_again_is_no_new_evidence() {
    let mut observer = Observer::new(&[]);
    observer.step_m = 0.0;
    let uncertain = measurement("wicker_basket", 0.4, [0.0, 1.0, -2.0]);
    for _ in 0..9 {
        assert!(observer.observe(std::slice::from_ref(&uncertain)).is_empty());
    }
    observer.step_m = 0.1;
    observer.observe(std::slice::from_ref(&uncertain));
    let basket = observer.observe(std::slice::from_ref(&uncertain))[0].track;
    let seen = track(&observer, basket).log_odds;
    observer.observe(&[]);
    let missed = track(&observer, basket).log_odds;
    assert!(missed < seen, "{missed}, {seen}");
    observer.step_m = 0.0;
    observer.observe(&[]);
    assert_eq!(track(&observer, basket).log_odds, missed);
}

#[test]
fn parts_of_an_object_are_no_objects_in_any_order() {
    let row = |from: f32, to: f32| {
        let point = |k: u8| [from + (to - from) * f32::from(k) / 8.0, -4.0];
        refrigerator(&[0, 1, 2, 3, 4, 5, 6, 7, 8].map(point))
    };
    let (left, right) = (row(0.0, 0.6), row(0.55, 0.9));
    for parts in [[left.clone(), right.clone()], [right, left]] {
        let mut observer = Observer::new(&[]);
        let whole = tracks(&observer.observe(&[row(0.0, 0.9)]));
        assert_eq!(tracks(&observer.observe(&parts)), whole);
    }
}

#[test]
fn a_mask_too_large_for_one_object_neither_moves_a_known_one_nor_starts_another() {
    let front = refrigerator(&[[0.0, -4.0], [0.45, -4.0], [0.9, -4.0]]);
    let mut observer = Observer::new(&[]);
    let first = observer.observe(&[front]);
    let id = first[0].track;
    // With its surroundings on one side.
    let larger = refrigerator(&[[-2.0, -4.0], [-1.0, -4.0], [0.0, -4.0], [0.9, -4.0]]);
    let again = observer.observe(&[larger]);
    assert_eq!(tracks(&again), [id]);
    assert_eq!(again[0].position_in_world, first[0].position_in_world);
    assert_eq!(again[0].footprint, [Vec2::new(0.0, -4.0), Vec2::new(0.9, -4.0)]);
    // The side; then a mask that contains the center only, so that the extents do not match.
    observer.observe(&[refrigerator(&[[0.0, -4.0], [0.0, -4.4], [0.0, -4.75]])]);
    let before = track(&observer, id).clone();
    let rows = [-4.4, -4.15, -3.9].map(|z| [0.2, 1.1, 2.0, 2.8].map(|x| [x, z]));
    assert!(observer.observe(&[refrigerator(rows.as_flattened())]).is_empty());
    assert_eq!(observer.tracker.tracks.len(), 1);
    let after = track(&observer, id);
    assert_eq!((after.position, after.log_odds), (before.position, before.log_odds));
}

#[test]
fn what_lies_or_stands_beside_a_person_is_not_carried() {
    let partner = (AgentId::PARTNER, CompanionRole::Partner);
    let mut observer = Observer::new(&[partner]);
    let (beside, at) = (person(1.7, [0.5, 0.9, -3.0]), [0.0, 0.8, -3.0]);
    let stove = measurement("stove", 0.9, [1.0, 0.8, -3.0]);
    let apple = observer.observe(&[measurement("apple", 0.9, at)])[0].track;
    let mut is_carried = |at: [f32; 3]| {
        observer.observe(&[beside.clone(), measurement("apple", 0.9, at), stove.clone()]);
        let carried = observer.tracker.tracks.iter().filter(|track| track.is_carried);
        carried.map(|track| track.id).collect::<Vec<_>>()
    };
    assert!(is_carried(at).is_empty(), "both are where they were");
    assert_eq!(is_carried([0.3, 1.0, -3.0]), [apple]);
    assert_eq!(is_carried([0.3, 1.0, -3.0]), [apple], "the person stands still");
}

#[test]
fn a_reported_object_is_withdrawn_once_when_it_rather_does_not_exist() {
    let mut observer = Observer::new(&[]);
    let uncertain = measurement("refrigerator", 0.6, [0.0, 1.0, -4.0]);
    let id = observer.observe(std::slice::from_ref(&uncertain))[0].track;
    observer.observe(&[]);
    assert!(observer.tracker.take_retracted().is_empty(), "it may exist");
    observer.observe(&[]);
    assert_eq!(observer.tracker.take_retracted(), [id]);
    observer.observe(&[]);
    assert!(observer.tracker.take_retracted().is_empty(), "once");
    // Never reported.
    observer.observe(&[measurement("refrigerator", 0.3, [3.0, 1.0, -4.0])]);
    assert!(observer.tracker.take_retracted().is_empty(), "it was not reported");
}
