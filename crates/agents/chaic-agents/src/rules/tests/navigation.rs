//! Rules about destinations, paths and distances.

use super::*;
use crate::execution::destination::Destination;
use crate::execution::navigation::NavigationStep;
use crate::execution::new_navigator;
use crate::mapping::{CellOccupancy, OccupancyMap};
use chaic_core::Vec2;

/// Replaces the map; `space` gives the state of each cell by its center.
fn set_map(s: &mut Scenario, state: impl Fn(Vec2) -> CellOccupancy) {
    s.memory = Memory::new(&s.briefing, s.memory.rules);
    let grid = *s.memory.map.grid();
    let cells: Vec<CellOccupancy> = (0..grid.n_cells()).map(|c| state(grid.center(c))).collect();
    s.memory.map = OccupancyMap::from_cells(grid, &cells);
}

#[test]
fn a_wall_without_a_door_blocks_careful_but_not_lattice_navigation() {
    for (walking, has_way) in [(Walking::Careful, false), (Walking::Lattice, true)] {
        let mut s = Scenario::new(PlannerRules { walking, ..PAPER });
        set_map(&mut s, |p| {
            if p.x > 1.0 && p.x < 1.4 { CellOccupancy::Wall } else { CellOccupancy::Free }
        });
        let beyond = Destination::near(Vec2::new(2.0, 0.0), 0.3);
        let step = new_navigator(walking).step(&mut s.memory, &beyond);
        assert_eq!(matches!(step, NavigationStep::Act(_)), has_way, "{step:?}");
        assert_eq!(step == NavigationStep::Unreachable, !has_way, "{step:?}");
    }
}

#[test]
fn frontiers_run_out_and_random_targets_do_not() {
    for exploration in [Exploration::Frontier, Exploration::Sampled] {
        let mut s = Scenario::new(PlannerRules { exploration, ..PAPER });
        set_map(&mut s, |_| CellOccupancy::Free);
        let mut executor = Executor::new(&s.briefing, &s.memory.rules);
        let progress = s.start_plan(&mut executor, Plan::Explore);
        assert!(matches!(progress, Progress::Act(_)), "{progress:?}");
        assert_eq!(executor.is_explored(), exploration == Exploration::Frontier);
    }
}

#[test]
fn the_nearest_or_a_random_goal_place_is_chosen() {
    let mut toy = Toy::room(8.0, 8.0);
    let near = toy.add(ToyObject::new("bed", [-0.9, 0.0, -1.2], [0.6, 1.0, 0.6]));
    let far = toy.add(ToyObject::new("bed", [0.9, 0.0, -1.3], [0.6, 1.0, 0.6]));
    toy.stand([0.0, 0.0], 0.0);
    for place_choice in [PlaceChoice::Nearest, PlaceChoice::Random] {
        let mut n_far = 0;
        for seed in 0..20 {
            let mut s = Scenario::new(PlannerRules { place_choice, ..PAPER });
            s.briefing.seed = seed;
            s.hands[0] = Some(carried("apple", 30, &[]));
            s.observe(&toy);
            // Both are within reach of the body.
            let progress =
                s.start_plan(&mut Executor::new(&s.briefing, &s.memory.rules), Plan::Deliver);
            let Progress::Act(Action::PutOn { place, .. }) = progress else {
                panic!("it puts down: {progress:?}");
            };
            assert!(place == near || place == far);
            n_far += u32::from(place == far);
        }
        match place_choice {
            PlaceChoice::Nearest => assert_eq!(n_far, 0),
            // 10 expected, standard deviation 2.2.
            PlaceChoice::Random => assert!((2..=18).contains(&n_far), "{n_far}"),
        }
    }
}

#[test]
fn a_delivery_to_another_place_starts_another_approach() {
    use chaic_core::AgentId;
    use chaic_core::capability::Gait;
    use std::f32::consts::FRAC_PI_2;
    // The rider approaches the position that the place had when the approach began.
    let mut s = Scenario::new(PlannerRules { walking: Walking::Lattice, ..PAPER });
    (s.briefing.me, s.briefing.capability.gait) = (AgentId::PARTNER, Gait::WalkBike);
    let mut toy = Toy::room(10.0, 10.0);
    let beds = [-3.0, 3.0].map(|x| toy.add(ToyObject::new("bed", [x, 0.0, 0.0], [0.3, 0.6, 0.3])));
    s.hands[0] = Some(carried("apple", 90, &[]));
    toy.stand([0.0, 0.0], FRAC_PI_2);
    s.observe(&toy);
    let mut executor = Executor::new(&s.briefing, &s.memory.rules);
    let ahead = Progress::Act(Action::MoveForward);
    assert_eq!(s.start_plan(&mut executor, Plan::Deliver), ahead);
    // The first bed is gone, and the second one is straight ahead.
    toy.stand([0.0, 0.0], -FRAC_PI_2);
    let observation = toy.observe();
    s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
    s.memory.objects.mark_absent(beds[0]);
    assert_eq!(s.continue_plan(&mut executor, Plan::Deliver), ahead);
}

#[test]
fn interactions_start_at_the_distances_in_the_rules() {
    for class in ["apple", "bed"] {
        let (memory, briefing, track) = memory_of(class, PAPER);
        let distance_m = memory.objects.get(track).expect("seen").distance_from(memory.position());
        let (plan, interaction) = match class {
            "apple" => (
                Plan::PickUp(subject(class, track.0)),
                Action::PickUp { object: track, hand: Hand::Left },
            ),
            _ => (Plan::Deliver, Action::PutOn { place: track, hand: Hand::Left }),
        };
        let step = |pick_within_m, put_within_m| {
            let mut s = Scenario::new(PAPER);
            (s.memory, s.briefing) = (memory.clone(), briefing.clone());
            s.memory.rules = PlannerRules { pick_within_m, put_within_m, ..PAPER };
            s.hands[0] = (plan == Plan::Deliver).then(|| carried("apple", 30, &[]));
            s.start_plan(&mut Executor::new(&briefing, &s.memory.rules), plan)
        };
        // Returns whether the interaction is performed from here, rather than another step.
        let interacts = |pick_within_m, put_within_m| {
            let Progress::Act(action) = step(pick_within_m, put_within_m) else {
                panic!("it can be done");
            };
            action == interaction
        };
        let (less_m, more_m) = (distance_m - 0.05, distance_m + 0.05);
        let picks = class == "apple";
        assert_eq!(
            [interacts(more_m, less_m), interacts(less_m, more_m)],
            [picks, !picks],
            "{class}"
        );
    }
}

#[test]
fn lattice_navigation_approaches_the_initial_position_of_objects_and_for_riders_of_the_goal() {
    use chaic_core::AgentId;
    use chaic_core::capability::Gait;
    use std::f32::consts::FRAC_PI_2;
    // Seen straight ahead and, after the plan began and the agent turned around, ahead again.
    for (class, gait, turns_back) in
        [("apple", Gait::Walk, true), ("bed", Gait::Walk, false), ("bed", Gait::WalkBike, true)]
    {
        let mut s = Scenario::new(PlannerRules { walking: Walking::Lattice, ..PAPER });
        (s.briefing.me, s.briefing.capability.gait) = (AgentId::PARTNER, gait);
        let mut executor = None;
        let mut progress = Vec::new();
        for (x, yaw_rad) in [(-3.0, FRAC_PI_2), (3.0, -FRAC_PI_2)] {
            let mut toy = Toy::room(10.0, 10.0);
            let track = toy.add(ToyObject::new(class, [x, 0.0, 0.0], [0.3, 0.6, 0.3]));
            toy.stand([0.0, 0.0], yaw_rad);
            let observation = toy.observe();
            if executor.is_none() {
                (s.briefing.bounds, s.briefing.goal_places) =
                    (toy.bounds(), vec![ClassId::named("bed")]);
                s.memory = Memory::new(&s.briefing, s.memory.rules);
            }
            s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
            let plan = match class {
                "apple" => Plan::PickUp(subject(class, track.0)),
                _ => Plan::Deliver,
            };
            s.hands[0] = (plan == Plan::Deliver).then(|| carried("apple", 90, &[]));
            progress.push(match &mut executor {
                Some(executor) => s.continue_plan(executor, plan),
                none => {
                    s.start_plan(none.insert(Executor::new(&s.briefing, &s.memory.rules)), plan)
                }
            });
        }
        let ahead = Progress::Act(Action::MoveForward);
        let stepped_ahead = progress.iter().map(|p| *p == ahead).collect::<Vec<_>>();
        assert_eq!(stepped_ahead, [true, !turns_back], "{class} {gait:?}: {progress:?}");
    }
}
