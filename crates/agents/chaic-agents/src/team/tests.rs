//! Small team problems for the tests of simulation and search.

use chaic_core::rng::RngStream;
use chaic_core::{ClassId, Vec2};

use super::problem::{GoalHypothesis, Place, PlaceKind, TeamMember, TeamProblem};
use crate::rules::PlannerRules;
use crate::track::TrackId;

/// Creates a person with two hands who walks 0.1 m per frame.
pub fn worker() -> TeamMember {
    TeamMember {
        speed_m_per_frame: 0.1,
        docking_frames: 0.0,
        loose: Vec::new(),
        contained: None,
        n_loose: 2,
        carries_containers: true,
        is_blocked: false,
        deliver_below: 0.25,
    }
}

/// Creates a problem of 2000 frames in the plane without walls. The goal wants many objects of
/// class 0 and none of class 1. An obstacle is on a path if it is within 0.1 m of the straight line.
pub fn plane(helper: Vec2, partner: Option<Vec2>, places: &[(PlaceKind, Vec2)]) -> TeamProblem {
    let place = |(i, (kind, at)): (usize, &(PlaceKind, Vec2))| Place {
        track: TrackId(20 + i as u32),
        class: ClassId::named("apple"),
        kind: *kind,
        class_index: (*kind == PlaceKind::Target).then_some(0),
        position: *at,
        stand: *at,
        is_known_to_partner: true,
        partner_chance: 1.0,
    };
    let origins: Vec<Vec2> =
        places.iter().map(|p| p.1).chain([helper, partner.unwrap_or_default()]).collect();
    let passes = |from: Vec2, to: Vec2, obstacle: Vec2| {
        from.distance(obstacle) + obstacle.distance(to) < from.distance(to) + 0.1
    };
    let on_path = |from: Vec2, to: Vec2| {
        let bits = places.iter().enumerate().filter(|(_, (kind, at))| {
            *kind == PlaceKind::Obstacle && *at != to && passes(from, to, *at)
        });
        bits.fold(0_u64, |all, (i, _)| all | 1 << i)
    };
    let row = |from: &Vec2| places.iter().map(|(_, to)| from.distance(*to)).collect();
    let bits = |from: &Vec2| places.iter().map(|(_, to)| on_path(*from, *to)).collect();
    TeamProblem {
        places: places.iter().enumerate().map(place).collect(),
        path_m: origins.iter().map(row).collect(),
        obstacles_on_path: origins.iter().map(bits).collect(),
        classes: vec![ClassId::named("apple"), ClassId::named("banana")],
        hypotheses: vec![GoalHypothesis { probability: 1.0, missing: vec![9.0, 0.0] }],
        frames_left: 2000.0,
        horizon: 2000.0,
        helper: worker(),
        partner: partner.map(|_| worker()),
        container_capacity: 3,
        rules: PlannerRules::paper(),
    }
}

/// Creates a problem on a line: all coordinates are x in meters.
pub fn line(helper: f32, partner: Option<f32>, places: &[(PlaceKind, f32)]) -> TeamProblem {
    let at = |x: f32| Vec2::new(x, 0.0);
    let places: Vec<(PlaceKind, Vec2)> = places.iter().map(|(kind, x)| (*kind, at(*x))).collect();
    plane(at(helper), partner.map(at), &places)
}

/// Creates a random problem: targets of two classes, goal places, and perhaps a container, an
/// obstacle and a partner.
pub fn random_problem(rng: &mut RngStream) -> TeamProblem {
    let mut kinds = vec![PlaceKind::Target; 2 + rng.below(5)];
    kinds.extend(vec![PlaceKind::Goal; 1 + rng.below(2)]);
    kinds.extend(vec![PlaceKind::Container; rng.below(2)]);
    kinds.extend(vec![PlaceKind::Obstacle; rng.below(2)]);
    let mut at = || Vec2::new(rng.range(-10.0, 10.0), rng.range(-10.0, 10.0));
    let places: Vec<(PlaceKind, Vec2)> = kinds.iter().map(|kind| (*kind, at())).collect();
    let (helper, partner) = (at(), at());
    let mut problem = plane(helper, rng.chance(0.7).then_some(partner), &places);
    for place in problem.places.iter_mut().filter(|p| p.kind == PlaceKind::Target) {
        place.class_index = Some(rng.below(2));
        place.is_known_to_partner = rng.chance(0.7);
        place.partner_chance = rng.unit();
    }
    let goal = |probability, missing| GoalHypothesis { probability, missing };
    problem.hypotheses = vec![goal(0.7, vec![3.0, 0.0]), goal(0.3, vec![0.0, 3.0])];
    problem.frames_left = rng.range(300.0, 2000.0);
    problem
}
