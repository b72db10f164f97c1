use chaic_core::rng::RngStream;

use super::*;
use crate::mapping::grid::CELL_M;
use crate::perception::{GroundTruthIds, Perception as _};
use crate::test_support::{Toy, ToyObject, seen};

fn observe(map: &mut SemanticMap, toy: &Toy, people: &[Vec3]) {
    let observation = toy.observe();
    let percepts = GroundTruthIds.perceive(&observation);
    map.update(&percepts.detections, people, 300, observation.frame);
    map.forget_missing(&observation);
}

#[test]
fn the_footprint_of_the_largest_object_is_complete() {
    // The area, and the squares on the outline at any angle.
    let n_points = |class: ClassId| {
        let [x, _, z] = class.info().size_m.map(|m| m / CELL_M);
        (x * z + 2.0 * std::f32::consts::SQRT_2 * (x + z)) as usize + 4
    };
    let most = ClassId::all().map(n_points).max().expect("there are classes");
    assert!(2 * most <= MAX_FOOTPRINT, "{most} points");
    // A truck is seen in two parts.
    let part = |columns: std::ops::Range<u16>| {
        let points = columns.flat_map(|i| (0..20_u16).map(move |j| [i, j]));
        let footprint = points.map(|cell| CELL_M * Vec2::from(cell.map(f32::from))).collect();
        Detection { footprint, ..seen(TrackId(30), "truck", [3.0, 0.0, 1.0], 2.0, 2.0) }
    };
    let mut map = SemanticMap::default();
    map.update(&[part(0..30)], &[], 300, 1);
    map.update(&[part(20..50)], &[], 300, 2);
    let truck = map.get(TrackId(30)).expect("seen");
    assert_eq!(truck.footprint.len(), 50 * 20);
    let end = CELL_M * Vec2::new(49.0, 19.0);
    assert!(truck.distance_from(end) < 1e-3);
}

#[test]
fn the_layout_changes_when_an_obstacle_is_held_and_when_that_time_has_passed() {
    for (class, is_obstacle) in [("trashbin", true), ("apple", false)] {
        let detection = seen(TrackId(30), class, [1.0, 0.0, 1.0], 0.3, 0.3);
        let mut map = SemanticMap::default();
        map.update(std::slice::from_ref(&detection), &[], 300, 1);
        let mut before = map.layout_version();
        let mut has_changed = |map: &SemanticMap| {
            let previous = std::mem::replace(&mut before, map.layout_version());
            map.layout_version() != previous
        };
        map.mark_held(TrackId(30), 50);
        assert_eq!(has_changed(&map), is_obstacle, "{class} is held");
        map.count_newly_available(10, 49);
        assert!(!has_changed(&map));
        map.count_newly_available(49, 60);
        assert_eq!(has_changed(&map), is_obstacle, "{class} is no longer held");
        // In a person's hands.
        let hands = [detection.position_in_world];
        map.update(std::slice::from_ref(&detection), &hands, 300, 61);
        let is_held = map.get(TrackId(30)).expect("seen").held_until > 61;
        assert_eq!(has_changed(&map), is_obstacle && is_held);
        map.update(std::slice::from_ref(&detection), &[], 300, 62);
        assert_eq!(has_changed(&map), is_obstacle && is_held);
    }
}

#[test]
fn known_points_leave_a_footprint_as_a_merge_does() {
    let bits =
        |list: &[Vec2]| list.iter().map(|p| [p.x.to_bits(), p.y.to_bits()]).collect::<Vec<_>>();
    let sort = |list: &mut [Vec2]| list.sort_by(|a, b| compare_points((a.x, a.y), (b.x, b.y)));
    let mut n_unchanged = 0;
    for seed in 0..4000 {
        let mut rng = RngStream::new(seed, "footprints", 0);
        let values = [-0.125, -0.0, 0.0, 0.125, 0.25, if seed % 8 == 0 { f32::NAN } else { 1.0 }];
        let mut point = || Vec2::new(values[rng.below(6)], values[rng.below(6)]);
        let mut old: Vec<Vec2> = (0..seed % 12).map(|_| point()).collect();
        let mut extra = point();
        if seed % 4 > 0 {
            sort(&mut old);
            old.dedup_by_key(|p| [p.x.to_bits(), p.y.to_bits()]);
        }
        if seed % 500 == 7 {
            // The longest list that a merge keeps, and lists that it cuts.
            let n_points = MAX_FOOTPRINT - 1 + rng.below(3);
            old = (0..n_points).map(|k| Vec2::new(0.125 * k as f32, 0.0)).collect();
            extra = old[rng.below(n_points)];
        }
        let mut new: Vec<Vec2> = old.iter().copied().filter(|_| rng.chance(0.7)).collect();
        if rng.chance(0.3) {
            new.push(extra);
        }
        if rng.chance(0.8) {
            sort(&mut new);
        }
        let mut object = MappedObject::new(&seen(TrackId(30), "truck", [0.0; 3], 2.0, 2.0), 1);
        object.footprint.clone_from(&old);
        object.merge_footprint(&new);
        assert_eq!(bits(&object.footprint), bits(&merge(&old, &new)), "{seed}: {old:?} {new:?}");
        n_unchanged += u32::from(is_merge_unchanged(&old, &new));
    }
    assert!((1000..3500).contains(&n_unchanged), "{n_unchanged}");
}

#[test]
fn an_object_is_forgotten_when_its_place_is_seen_empty_but_not_when_hidden() {
    for hidden in [false, true] {
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -1.9], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = SemanticMap::default();
        observe(&mut map, &toy, &[]);
        assert!(map.get(apple).expect("seen").is_available(toy.frame));
        toy.remove(apple);
        if hidden {
            toy.add(ToyObject::new("cabinet", [0.0, 0.0, -1.5], [1.0, 1.0, 0.3]));
        }
        for _ in 0..MISSES {
            toy.frame += 1;
            observe(&mut map, &toy, &[]);
        }
        assert_eq!(map.get(apple).expect("still in the map").is_present, hidden);
    }
}

#[test]
fn an_object_visible_from_some_positions_only_is_forgotten_less_and_less_often() {
    let mut toy = Toy::room(8.0, 8.0);
    toy.size = 256;
    let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -1.9], [0.2, 0.2, 0.2]));
    toy.stand([0.0, 0.0], 0.0);
    let shown = GroundTruthIds.perceive(&toy.observe()).detections;
    toy.remove(apple);
    let mut map = SemanticMap::default();
    let mut n_forgotten = 0;
    for _ in 0..50 {
        map.update(&shown, &[], 300, toy.frame);
        for _ in 0..2 * MISSES {
            toy.frame += 1;
            observe(&mut map, &toy, &[]);
        }
        n_forgotten += u32::from(!map.get(apple).expect("in the map").is_present);
    }
    assert_eq!(n_forgotten, 1);
}

#[test]
fn unseen_objects_are_forgotten_until_the_next_sighting() {
    let mut toy = Toy::room(8.0, 8.0);
    let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -2.5], [0.2, 0.2, 0.2]));
    let bed = toy.add(ToyObject::new("bed", [2.0, 0.0, -3.0], [1.0, 0.5, 2.0]));
    toy.stand([0.0, 0.0], 0.0);
    let mut map = SemanticMap::default();
    observe(&mut map, &toy, &[]);
    let is_present = |map: &SemanticMap, track| map.get(track).expect("seen").is_present;
    map.forget_unseen(100, None, toy.frame + 100);
    map.forget_unseen(100, Some(apple), toy.frame + 101);
    assert!(is_present(&map, apple), "not yet, and not the object to which the agent goes");
    map.forget_unseen(100, None, toy.frame + 101);
    assert!(!is_present(&map, apple) && is_present(&map, bed), "furniture stays");
    let n_changes = map.change_count();
    toy.frame += 200;
    observe(&mut map, &toy, &[]);
    assert!(is_present(&map, apple) && map.change_count() > n_changes);
}

#[test]
fn an_object_carried_by_a_person_is_not_available() {
    let mut toy = Toy::room(8.0, 8.0);
    let apple = toy.add(ToyObject::new("apple", [0.0, 1.0, -2.5], [0.2, 0.2, 0.2]));
    toy.stand([0.0, 0.0], 0.0);
    let mut map = SemanticMap::default();
    observe(&mut map, &toy, &[Vec3::new(0.0, 0.9, -2.9)]);
    assert!(!map.get(apple).expect("seen").is_available(toy.frame));
    toy.frame += 1;
    observe(&mut map, &toy, &[Vec3::new(0.0, 0.9, -2.9)]);
    assert!(!map.get(apple).expect("seen").is_available(toy.frame), "still in hand");
    toy.frame += 1;
    observe(&mut map, &toy, &[Vec3::new(2.0, 0.9, -2.9)]);
    assert!(map.get(apple).expect("seen").is_available(toy.frame), "put down again");
}

#[test]
fn an_ignored_object_that_becomes_available_counts_as_a_change() {
    let mut toy = Toy::room(8.0, 8.0);
    let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -2.5], [0.2, 0.2, 0.2]));
    toy.stand([0.0, 0.0], 0.0);
    let mut map = SemanticMap::default();
    observe(&mut map, &toy, &[]);
    map.ignore(apple, 500);
    assert!(!map.get(apple).expect("seen").is_available(499));
    let n_changes = map.change_count();
    map.count_newly_available(400, 500);
    assert!(map.get(apple).expect("seen").is_available(500) && map.change_count() > n_changes);
}

#[test]
fn the_distance_of_a_large_object_is_that_of_its_nearest_point() {
    let mut toy = Toy::room(12.0, 12.0);
    let bed = toy.add(ToyObject::new("bed", [0.0, 0.0, -3.0], [6.0, 0.5, 2.0]));
    toy.stand([0.0, 1.0], 0.0);
    let mut map = SemanticMap::default();
    observe(&mut map, &toy, &[]);
    let bed = map.get(bed).expect("seen");
    assert!((bed.distance_from(Vec2::new(2.4, -1.0)) - 1.0).abs() < 0.15);
    assert!(bed.distance_from(Vec2::new(0.0, 0.0)) > 1.8);
}
