//! Problems of toy worlds with two rooms.

use super::*;
use crate::PlannerRules;
use crate::perception::{Detection, Percepts};
use crate::test_support::{Toy, seen};
use chaic_core::capability::Persona;

const BED: TrackId = TrackId(40);
const APPLE: TrackId = TrackId(41);
const BANANA: TrackId = TrackId(42);
const BIN: TrackId = TrackId(43);

/// Creates two rooms of 6 by 6 m. The door at x = 0 is 1.6 m wide, or closed.
fn rooms(has_door: bool) -> Toy {
    let mut toy = Toy::room(12.0, 6.0);
    let half = if has_door { 0.8 } else { 0.0 };
    toy.add_wall([-0.05, -3.0], [0.05, -half]);
    toy.add_wall([-0.05, half], [0.05, 3.0]);
    toy.stand([-3.0, 0.0], 0.0);
    toy
}

/// Bed and banana in the room of the helper, the apple in the other room.
fn detections() -> Vec<Detection> {
    vec![
        seen(BED, "bed", [-5.0, 0.0, -2.0], 1.4, 0.5),
        seen(APPLE, "apple", [4.0, 0.0, 0.0], 0.1, 0.1),
        seen(BANANA, "banana", [-2.0, 0.0, 2.0], 0.1, 0.1),
    ]
}

fn bin(x: f32, z: f32) -> Detection {
    seen(BIN, "trashbin", [x, 0.0, z], 0.4, 0.9)
}

/// Scene with a memory of these detections.
struct Scene {
    briefing: Briefing,
    memory: Memory,
}

impl Scene {
    fn new(toy: &Toy, detections: &[Detection]) -> Scene {
        let briefing = Briefing { layout: Some(toy.layout()), ..toy.briefing() };
        let memory = Memory::new(&briefing, PlannerRules::paper());
        let mut scene = Scene { briefing, memory };
        scene.observe(toy, detections);
        scene
    }

    fn observe(&mut self, toy: &Toy, detections: &[Detection]) {
        let percepts = Percepts { detections: detections.to_vec(), ..Percepts::default() };
        self.memory.update(&self.briefing, &toy.observe(), &percepts);
        self.memory.refresh();
    }

    fn build(&self, partner: &PartnerModel) -> Option<TeamProblem> {
        ProblemBuilder::default().build(&self.briefing, &self.memory, partner)
    }
}

/// Partner who wants three apples or two bananas.
fn partner(persona: Persona, position: Option<Vec2>) -> PartnerModel {
    let wanted = |class: &str, n: f32| BTreeMap::from([(ClassId::named(class), n)]);
    PartnerModel {
        capability: persona.capability(),
        position,
        holds: Vec::new(),
        goals: vec![(0.75, wanted("apple", 3.0)), (0.25, wanted("banana", 2.0))],
    }
}

fn adult() -> PartnerModel {
    partner(Persona::Adult, None)
}

fn index(problem: &TeamProblem, track: TrackId) -> Option<usize> {
    problem.places.iter().position(|p| p.track == track)
}

#[test]
fn places_paths_and_goals_come_from_memory_and_belief() {
    let scene = Scene::new(&rooms(true), &detections());
    let problem = scene.build(&adult()).expect("all is known");
    let place = |track| index(&problem, track).expect("a place");
    let (bed, apple, banana) = (place(BED), place(APPLE), place(BANANA));
    assert_eq!(problem.places.len(), 3);
    assert_eq!(problem.places[bed].kind, PlaceKind::Goal);
    assert_eq!(problem.places[apple].kind, PlaceKind::Target);
    let class = |i: usize| problem.places[i].class_index.map(|c| problem.classes[c].name());
    assert_eq!([class(bed), class(apple), class(banana)], [None, Some("apple"), Some("banana")]);
    let here = scene.memory.position();
    for to in [bed, apple, banana] {
        let straight_m = DETOUR * here.distance(problem.places[to].stand);
        let path_m = problem.path_m[problem.helper_row()][to];
        let is_near = path_m > straight_m - 0.2 && path_m < 1.25 * straight_m + 0.2;
        assert!(is_near, "{path_m} m for {straight_m} m to {to}");
        assert_eq!(problem.path_m[to][to], 0.0);
        assert_eq!(problem.path_m[problem.partner_row()][to], NO_PATH_M, "nobody has seen it");
    }
    let there_and_back = problem.path_m[bed][apple] / problem.path_m[apple][bed];
    assert!((0.9..1.1).contains(&there_and_back), "{there_and_back}");
    assert!(problem.partner.is_none());
    let missing: Vec<(f32, Vec<f32>)> =
        problem.hypotheses.iter().map(|h| (h.probability, h.missing.clone())).collect();
    let index_of = |name| problem.classes.iter().position(|c| c.name() == name).expect("wanted");
    let (a, b) = (index_of("apple"), index_of("banana"));
    assert_eq!((missing[0].0, missing[0].1[a], missing[0].1[b]), (0.75, 3.0, 0.0));
    assert_eq!((missing[1].0, missing[1].1[a], missing[1].1[b]), (0.25, 0.0, 2.0));
    assert_eq!((problem.frames_left, problem.horizon), (3000.0 - MARGIN_FRAMES, 3000.0));
}

#[test]
fn there_is_no_problem_without_a_goal_place_or_paths() {
    let scene = Scene::new(&rooms(true), &detections()[1..]);
    assert_eq!(scene.build(&adult()), None);
    let mut scene = Scene::new(&rooms(true), &[]);
    assert_eq!(scene.build(&adult()), None);
    scene.memory = Memory::new(&scene.briefing, PlannerRules::paper());
    assert_eq!(scene.build(&adult()), None);
    // A belief without goals gives an empty problem.
    let scene = Scene::new(&rooms(true), &detections());
    let nothing = PartnerModel { goals: Vec::new(), ..adult() };
    let problem = scene.build(&nothing).expect("the bed is known");
    assert_eq!((problem.places.len(), problem.hypotheses.len()), (1, 0));
}

#[test]
fn an_obstacle_in_the_doorway_is_on_the_paths_through_it() {
    let all = [detections(), vec![bin(0.0, 0.0)]].concat();
    let scene = Scene::new(&rooms(true), &all);
    let wheelchair = partner(Persona::Wheelchair, Some(Vec2::new(-2.5, 0.0)));
    let problem = scene.build(&wheelchair).expect("all is known");
    let place = |track| index(&problem, track).expect("a place");
    let (bed, apple, banana, bin_place) = (place(BED), place(APPLE), place(BANANA), place(BIN));
    assert_eq!(problem.places[bin_place].kind, PlaceKind::Obstacle);
    let bit = 1 << bin_place;
    for from in [problem.helper_row(), problem.partner_row(), bed, banana] {
        assert_eq!(problem.obstacles_on_path[from][apple], bit, "from {from}");
    }
    assert_eq!(problem.obstacles_on_path[apple][bed], bit);
    assert_eq!(problem.obstacles_on_path[problem.helper_row()][bed], 0);
    assert_eq!(problem.obstacles_on_path[banana][bed], 0);
    assert!(problem.partner.expect("it was seen").is_blocked);
    // In the middle of a room it is no obstacle.
    let all = [detections(), vec![bin(-3.0, -1.5)]].concat();
    let problem = Scene::new(&rooms(true), &all).build(&wheelchair).expect("all is known");
    assert_eq!(index(&problem, BIN), None);
}

#[test]
fn a_partner_in_a_closed_room_gets_a_long_path_with_all_obstacles() {
    let scene = Scene::new(&rooms(false), &detections());
    let position = Vec2::new(3.0, 0.0);
    let problem = scene.build(&partner(Persona::Adult, Some(position))).expect("the bed is near");
    assert_eq!(index(&problem, APPLE), None, "the helper cannot get there");
    let bed = index(&problem, BED).expect("a place");
    let straight_m = position.distance(problem.places[bed].stand);
    let path_m = problem.path_m[problem.partner_row()][bed];
    assert!((path_m - (1.5 * straight_m + 1.0)).abs() < 1e-3, "{path_m} for {straight_m}");
}

#[test]
fn objects_that_somebody_holds_or_has_delivered_are_no_places() {
    let mut toy = rooms(true);
    let hidden = [0.0, -9.0, 0.0];
    let [first, second] =
        [0, 1].map(|_| toy.add(crate::test_support::ToyObject::new("apple", hidden, [0.1; 3])));
    let mut scene = Scene::new(&toy, &detections());
    let holds = vec![(BANANA, ClassId::named("banana"))];
    let holder = PartnerModel { holds, ..partner(Persona::Adult, Some(Vec2::new(-2.0, 0.0))) };
    let problem = scene.build(&holder).expect("all is known");
    assert_eq!(index(&problem, BANANA), None);
    assert!(index(&problem, APPLE).is_some());
    let banana = problem.classes.iter().position(|c| c.name() == "banana").expect("wanted");
    let worker = problem.partner.expect("it was seen");
    assert_eq!((worker.loose, worker.contained), (vec![banana], None));
    // Two apples are delivered: one of three is missing, and no more bananas than before.
    toy.delivered = vec![first, second];
    scene.observe(&toy, &detections());
    let problem = scene.build(&adult()).expect("all is known");
    let apple = problem.classes.iter().position(|c| c.name() == "apple").expect("wanted");
    assert_eq!(problem.hypotheses[0].missing[apple], 1.0);
    assert_eq!(problem.hypotheses[1].missing[apple], 0.0, "never negative");
    assert_eq!(problem.hypotheses[1].missing[banana], 2.0);
    assert!(index(&problem, BANANA).is_some(), "it lies there again");
}

#[test]
fn hands_and_body_of_the_partner_determine_its_worker() {
    let scene = Scene::new(&rooms(true), &detections());
    let at = Some(Vec2::new(-2.0, 0.0));
    let worker = |model: &PartnerModel| {
        scene.build(model).expect("all is known").partner.expect("it was seen")
    };
    let adult = worker(&partner(Persona::Adult, at));
    assert_eq!((adult.n_loose, adult.carries_containers, adult.is_blocked), (2, true, false));
    let rider = worker(&partner(Persona::Rider, at));
    assert_eq!((rider.n_loose, rider.carries_containers), (3, false));
    assert!(rider.docking_frames > 0.0 && rider.speed_m_per_frame < adult.speed_m_per_frame);
    let holds = ["wicker_basket", "apple"].map(|c| (TrackId(60), ClassId::named(c))).to_vec();
    let with_basket = worker(&PartnerModel { holds, ..partner(Persona::Adult, at) });
    assert_eq!((with_basket.loose, with_basket.contained), (vec![], Some(vec![0])));
}

#[test]
fn heights_limit_the_chances_of_the_partner() {
    let mut all = detections();
    all.push(seen(TrackId(50), "apple", [-3.0, 1.8, 2.0], 0.1, 0.1));
    let scene = Scene::new(&rooms(true), &all);
    let chances = |persona| {
        let problem = scene.build(&partner(persona, None)).expect("all is known");
        [TrackId(50), BANANA, BED]
            .map(|t| problem.places[index(&problem, t).expect("a place")].partner_chance)
    };
    assert_eq!(chances(Persona::Adult), [1.0; 3]);
    let [high, low, bed] = chances(Persona::Child);
    assert!(high < 0.5 && low == 1.0 && bed == 1.0, "{high} {low} {bed}");
    let [high, low, bed] = chances(Persona::Wheelchair);
    assert!(high < 0.5 && low < 0.5 && bed == 1.0, "{high} {low} {bed}");
}

#[test]
fn the_partner_knows_what_it_saw_from_where_it_stood() {
    let mut all = detections();
    all.push(seen(TrackId(50), "apple", [-5.5, 0.0, 2.5], 0.1, 0.1));
    let scene = Scene::new(&rooms(true), &all);
    let known = |position: [f32; 2]| {
        let mut builder = ProblemBuilder::default();
        builder.observe_partner(&scene.memory, position.into());
        let problem = builder.build(&scene.briefing, &scene.memory, &adult()).expect("known");
        [APPLE, BANANA, TrackId(50), BED]
            .map(|t| problem.places[index(&problem, t).expect("a place")].is_known_to_partner)
    };
    // Apple in the other room, banana, apple in the same room, and the bed, which it always knows.
    assert_eq!(known([-2.0, -2.0]), [false, true, true, true], "a wall hides the apple");
    assert_eq!(known([5.0, 0.0]), [true, false, false, true]);
    assert_eq!(known([-2.0, 0.0]), [true; 4], "it sees through the doorway");
    assert_eq!(known([99.0, 0.0]), [false, false, false, true]);
}

#[test]
fn only_the_three_nearest_containers_are_kept() {
    let mut all = detections();
    for k in 0..5_u16 {
        let x = -5.0 + 0.9 * f32::from(k);
        all.push(seen(TrackId(50 + u32::from(k)), "wicker_basket", [x, 0.0, 2.5], 0.3, 0.3));
    }
    let scene = Scene::new(&rooms(true), &all);
    let problem = scene.build(&adult()).expect("all is known");
    let kept: Vec<u32> =
        problem.places_of(PlaceKind::Container).map(|i| problem.places[i].track.0).collect();
    assert_eq!(kept.len(), 3);
    assert!(kept.contains(&52), "the nearest one: {kept:?}");
}
