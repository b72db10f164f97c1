//! Rules of where one goes, by which way, and how near.

use super::*;
use crate::execution::navigate::{Destination, Nav, Navigator};
use crate::mapping::{OccupancyMap, Space};
use chaic_core::Vec2;

/// Draws the whole place of a situation by where each cell lies.
fn draw(s: &mut Situated, space: impl Fn(Vec2) -> Space) {
    s.memory = Memory::new(&s.briefing, s.memory.rules);
    let grid = *s.memory.map.grid();
    let spaces: Vec<Space> = (0..grid.n_cells()).map(|c| space(grid.center(c))).collect();
    s.memory.map = OccupancyMap::of_spaces(grid, &spaces);
}

#[test]
fn a_wall_without_a_door_ends_a_careful_way_and_no_other() {
    for (walking, has_way) in [(Walking::Careful, false), (Walking::Lattice, true)] {
        let mut s = Situated::new(PlannerRules { walking, ..PAPER });
        draw(&mut s, |p| if p.x > 1.0 && p.x < 1.4 { Space::Wall } else { Space::Free });
        let beyond = Destination::near(Vec2::new(2.0, 0.0), 0.3);
        let nav = Navigator::default().step(&mut s.memory, &beyond);
        assert_eq!(matches!(nav, Nav::Act(_)), has_way, "{nav:?}");
        assert_eq!(nav == Nav::Unreachable, !has_way, "{nav:?}");
    }
}

#[test]
fn borders_of_the_known_run_out_and_random_places_do_not() {
    for exploration in [Exploration::Frontier, Exploration::Sampled] {
        let mut s = Situated::new(PlannerRules { exploration, ..PAPER });
        draw(&mut s, |_| Space::Free);
        let mut executor = Executor::new(&s.briefing);
        let progress = s.begin(&mut executor, Plan::Explore);
        assert!(matches!(progress, Progress::Act(_)), "{progress:?}");
        assert_eq!(executor.is_explored(), exploration == Exploration::Frontier);
    }
}

#[test]
fn of_two_goal_places_the_nearest_is_chosen_or_any() {
    let mut toy = Toy::room(8.0, 8.0);
    let near = toy.add(ToyObject::new("bed", [-0.9, 0.0, -1.2], [0.6, 1.0, 0.6]));
    let far = toy.add(ToyObject::new("bed", [0.9, 0.0, -1.3], [0.6, 1.0, 0.6]));
    toy.stand([0.0, 0.0], 0.0);
    for place_choice in [PlaceChoice::Nearest, PlaceChoice::Random] {
        let mut n_far = 0;
        for seed in 0..20 {
            let mut s = Situated::new(PlannerRules { place_choice, ..PAPER });
            s.briefing.seed = seed;
            s.hands[0] = Some(carried("apple", 30, &[]));
            s.look(&toy);
            // Both are within reach of where one stands.
            let progress = s.begin(&mut Executor::new(&s.briefing), Plan::Deliver);
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
fn one_picks_up_and_puts_down_from_as_near_as_the_rules_say() {
    for class in ["apple", "bed"] {
        let (memory, briefing, track) = memory_of(class, PAPER);
        let off_m = memory.things.get(track).expect("seen").distance_from(memory.here());
        let (plan, interaction) = match class {
            "apple" => (
                Plan::PickUp(subject(class, track.0)),
                Action::PickUp { object: track, hand: Hand::Left },
            ),
            _ => (Plan::Deliver, Action::PutOn { place: track, hand: Hand::Left }),
        };
        let step = |pick_within_m, put_within_m| {
            let mut s = Situated::new(PAPER);
            (s.memory, s.briefing) = (memory.clone(), briefing.clone());
            s.memory.rules = PlannerRules { pick_within_m, put_within_m, ..PAPER };
            s.hands[0] = (plan == Plan::Deliver).then(|| carried("apple", 30, &[]));
            s.begin(&mut Executor::new(&briefing), plan)
        };
        // Whether one does it from here; otherwise one goes on.
        let does = |pick_within_m, put_within_m| {
            let Progress::Act(action) = step(pick_within_m, put_within_m) else {
                panic!("it can be done");
            };
            action == interaction
        };
        let (less_m, more_m) = (off_m - 0.05, off_m + 0.05);
        let picks = class == "apple";
        assert_eq!([does(more_m, less_m), does(less_m, more_m)], [picks, !picks], "{class}");
    }
}

#[test]
fn on_the_lattice_one_goes_to_where_an_object_was_and_a_rider_to_where_the_goal_was() {
    use chaic_core::AgentId;
    use chaic_core::capability::Gait;
    use std::f32::consts::FRAC_PI_2;
    // Seen straight ahead and, once the plan has begun and one has turned round, ahead again.
    for (class, gait, turns_back) in
        [("apple", Gait::Walk, true), ("bed", Gait::Walk, false), ("bed", Gait::WalkBike, true)]
    {
        let mut s = Situated::new(PlannerRules { walking: Walking::Lattice, ..PAPER });
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
                Some(executor) => s.go_on(executor, plan),
                none => s.begin(none.insert(Executor::new(&s.briefing)), plan),
            });
        }
        let ahead = Progress::Act(Action::MoveForward);
        let went_on = progress.iter().map(|p| *p == ahead).collect::<Vec<_>>();
        assert_eq!(went_on, [true, !turns_back], "{class} {gait:?}: {progress:?}");
    }
}
