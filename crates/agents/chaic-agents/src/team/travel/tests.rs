use chaic_core::ClassId;
use chaic_core::rng::RngStream;

use super::*;
use crate::memory::Memory;
use crate::perception::Percepts;
use crate::test_support::{DrawnMap, Toy, seen};
use crate::{PlannerRules, TrackId};

/// Room of 40 by 24 cells (5 by 3 m) with walls around it, and a wall in the column `wall` if given,
/// with a door in the rows `door`.
fn room(wall: Option<usize>, door: std::ops::Range<usize>) -> CostMap {
    let cell = |i: usize, j: usize| {
        let is_border = i == 0 || j == 0 || i == 39 || j == 23;
        let is_wall = is_border || wall == Some(i) && !door.contains(&j);
        if is_wall { '#' } else { '.' }
    };
    let row = |j| (0..40).map(|i| cell(i, j)).collect::<String>();
    DrawnMap::parse(&(0..24).map(row).collect::<Vec<String>>().join("\n")).costs(0.1)
}

/// Position of a cell by column and row.
fn at(costs: &CostMap, column: usize, row: usize) -> Vec2 {
    costs.grid().center(row * 40 + column)
}

fn field(costs: &CostMap, from: Vec2) -> CostField {
    CostField::new(costs, from, &mut Search::new(costs.grid().n_cells()))
}

fn travel(costs: &CostMap, from: Vec2, to: Vec2, obstacles: &[Vec2]) -> Option<Travel> {
    trace(costs, &field(costs, from), to, obstacles, 0.75)
}

#[test]
fn paths_in_a_room_are_about_as_long_as_the_straight_line() {
    let costs = room(None, 0..0);
    let mut rng = RngStream::new(1, "travel", 0);
    for _ in 0..40 {
        let mut cell = || at(&costs, 6 + rng.below(28), 6 + rng.below(12));
        let (from, to) = (cell(), cell());
        let straight_m = from.distance(to);
        let length_m = travel(&costs, from, to, &[]).expect("one room").length_m;
        let (low_m, high_m) = (straight_m - 1e-3, 1.25 * straight_m + 1e-3);
        assert!((low_m..=high_m).contains(&length_m), "{length_m} m for {straight_m} m");
    }
}

#[test]
fn a_path_through_a_doorway_passes_the_obstacle_in_it() {
    let costs = room(Some(20), 16..22);
    let (from, to) = (at(&costs, 5, 5), at(&costs, 34, 5));
    let door = at(&costs, 20, 18);
    let obstacles = [at(&costs, 37, 20), door, at(&costs, 20, 4)];
    let through = travel(&costs, from, to, &obstacles).expect("the door is open");
    assert_eq!(through.obstacles, 0b010, "neither the far corner nor behind the wall");
    let via_m = from.distance(door) + door.distance(to);
    assert!((0.8 * via_m..1.25 * via_m).contains(&through.length_m), "{through:?} {via_m}");
    let here = travel(&costs, from, at(&costs, 5, 18), &obstacles).expect("the same room");
    assert_eq!(here.obstacles, 0);
    assert_eq!(
        travel(&costs, from, from, &obstacles),
        Some(Travel { length_m: 0.0, obstacles: 0 })
    );
}

#[test]
fn there_is_no_path_through_a_wall() {
    let costs = room(Some(20), 0..0);
    let from = at(&costs, 5, 5);
    assert_eq!(travel(&costs, from, at(&costs, 34, 5), &[]), None);
    // A place in the wall stands for the nearest cell beside it.
    let beside = travel(&costs, from, at(&costs, 20, 5), &[]).expect("within 0.4 m");
    assert!((1.5..1.9).contains(&beside.length_m), "{beside:?}");
    assert_eq!(travel(&costs, Vec2::splat(99.0), from, &[]), None, "from outside the map");
    assert_eq!(travel(&costs, from, Vec2::splat(99.0), &[]), None, "to outside the map");
}

#[test]
fn paths_are_those_of_a_search_over_the_whole_map() {
    for seed in 0..60 {
        let mut rng = RngStream::new(seed, "partial fields", 0);
        let row = |rng: &mut RngStream| -> String {
            (0..40).map(|_| [".", ".", ".", ".", "?", "#"][rng.below(6)]).collect()
        };
        let rows: Vec<String> = (0..24).map(|_| row(&mut rng)).collect();
        let costs = DrawnMap::parse(&rows.join("\n")).costs(0.05);
        let mut position = || at(&costs, rng.below(40), rng.below(24));
        let origin = position();
        let obstacles = [position(), position()];
        let mut places: Vec<Vec2> = (0..6).map(|_| position()).collect();
        let whole = field(&costs, origin);
        let mut cache = TravelCache::default();
        // A place that is added later is final too.
        for n in [3, 6] {
            let field = cache.field(&costs, 1, origin, places[..n].iter().copied());
            for place in &places[..n] {
                let [expected, found] =
                    [&whole, field].map(|f| trace(&costs, f, *place, &obstacles, 0.75));
                assert_eq!(found, expected, "seed {seed}");
            }
        }
        // Some searches end before they have covered the map.
        places.truncate(1);
        let near = cache.field(&costs, 2, places[0], places.iter().copied());
        assert!(near.is_final(costs.grid().cell_at(places[0]).expect("it is inside")));
    }
}

#[test]
fn cost_fields_are_kept_until_the_origin_moves_or_the_epoch_changes() {
    let (open, closed) = (room(Some(20), 16..22), room(Some(20), 0..0));
    let (here, far) = (at(&open, 5, 5), at(&open, 34, 5));
    let mut cache = TravelCache::default();
    cache.start(1);
    let is_open = |cache: &mut TravelCache, costs: &CostMap, origin: Vec2| {
        let field = cache.field(costs, 3, origin, std::iter::once(far));
        trace(costs, field, far, &[], 0.75).is_some()
    };
    assert!(is_open(&mut cache, &open, here));
    assert!(is_open(&mut cache, &closed, here + Vec2::new(0.05, 0.0)), "kept");
    assert!(!is_open(&mut cache, &closed, here + Vec2::new(0.2, 0.0)), "the origin moved");
    assert!(!is_open(&mut cache, &open, here + Vec2::new(0.2, 0.0)), "kept");
    cache.start(1);
    assert!(!is_open(&mut cache, &open, here + Vec2::new(0.2, 0.0)), "the same epoch");
    cache.start(2);
    assert!(is_open(&mut cache, &open, here + Vec2::new(0.2, 0.0)), "a new epoch");
}

#[test]
fn the_place_to_stand_is_near_the_object_and_kept_until_it_moves() {
    let toy = Toy::room(8.0, 6.0);
    let briefing = chaic_core::Briefing { layout: Some(toy.layout()), ..toy.briefing() };
    let mut cache = TravelCache::default();
    cache.start(1);
    let mut stand = |x: f32| {
        let apple = seen(TrackId(20), "apple", [x, 0.0, 1.0], 0.1, 0.1);
        let percepts = Percepts { detections: vec![apple], ..Percepts::default() };
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        memory.update(&briefing, &toy.observe(), &percepts);
        memory.refresh();
        let object = memory.objects.get(TrackId(20)).expect("seen");
        assert_eq!(object.class, ClassId::named("apple"));
        let path_costs = memory.path_costs().expect("refreshed");
        let within_m = memory.rules.pick_within_m;
        let stand = cache.stand(path_costs, object, within_m, 0.7);
        let stand = stand.expect("a free room");
        (stand, stand.distance(Vec2::new(x, 1.0)))
    };
    let (first, first_m) = stand(-3.0);
    assert!(first_m <= PlannerRules::paper().pick_within_m, "{first_m} m");
    assert!(first.distance(Vec2::ZERO) < 3.0, "on the near side: {first}");
    assert_eq!(stand(-2.8).0, first, "it moved by less than 0.3 m");
    let (moved, moved_m) = stand(2.0);
    assert!(moved != first && moved_m <= PlannerRules::paper().pick_within_m, "{moved}");
}
