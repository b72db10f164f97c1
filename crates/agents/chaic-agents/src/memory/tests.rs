//! The granted state: the memory knows what no image shows, and follows its changes. The history: it
//! contains all interactions of the agent itself. Withdrawn objects are forgotten.

use super::*;
use crate::decision::{Plan, valid_plans};
use crate::perception::{GroundTruthIds, Perception as _};
use crate::test_support::{Toy, ToyObject, seen};

/// Toy world whose state is granted, with the memory of an agent in it.
struct Granted {
    toy: Toy,
    briefing: Briefing,
    memory: Memory,
    state: WorldState,
}

impl Granted {
    fn new(toy: Toy, goal_places: &[TrackId]) -> Granted {
        let grants = Grants { state: true, ..Grants::PLANNER };
        let briefing = Briefing { layout: Some(toy.layout()), grants, ..toy.briefing() };
        let memory = Memory::new(&briefing, PlannerRules::paper());
        let state = toy.state(goal_places);
        Granted { toy, briefing, memory, state }
    }

    fn update(&mut self) {
        let mut observation = self.toy.observe();
        observation.granted.state = Some(self.state.clone());
        let percepts = GroundTruthIds.perceive(&observation);
        self.memory.update(&self.briefing, &observation, &percepts);
        self.memory.refresh();
        self.toy.frame += 10;
    }

    /// Returns the change count and the layout version after another update.
    fn versions(&mut self) -> (u32, u32) {
        self.update();
        (self.memory.objects.change_count(), self.memory.objects.layout_version())
    }

    fn object(&mut self, track: TrackId) -> &mut chaic_core::observation::ObjectState {
        let of_track =
            |o: &&mut chaic_core::observation::ObjectState| TrackId::from(o.entity) == track;
        self.state.objects.iter_mut().find(of_track).expect("it is in the state")
    }

    fn can_take(&self, track: TrackId) -> bool {
        let plans = valid_plans(&self.memory, &self.briefing);
        plans.iter().any(|p| matches!(p, Plan::PickUp(s) | Plan::LiftWith(s) if s.track == track))
    }
}

/// Creates two rooms with a door; returns the world, and the apple and the two beds behind the wall.
fn rooms() -> (Toy, TrackId, [TrackId; 2]) {
    let mut toy = Toy::room(10.0, 6.0);
    toy.add_wall([-0.05, -3.0], [0.05, 0.4]);
    toy.add_wall([-0.05, 1.4], [0.05, 3.0]);
    let apple = toy.add(ToyObject::new("apple", [4.0, 0.0, -2.0], [0.16, 0.12, 0.16]));
    let beds = [2.0, -4.0].map(|x| toy.add(ToyObject::new("bed", [x, 0.0, 2.2], [1.2, 0.5, 1.2])));
    toy.stand([-4.0, -2.0], 0.0);
    (toy, apple, beds)
}

#[test]
fn an_unseen_object_is_reachable() {
    let (toy, apple, _) = rooms();
    let mut world = Granted::new(toy, &[]);
    world.update();
    assert!(world.can_take(apple));
    assert_eq!(world.memory.class_of(apple), Some(ClassId::named("apple")));
    let object = world.memory.objects.get(apple).expect("placed").clone();
    let path_m = world.memory.path_length_to(&object).expect("a path");
    assert!(path_m > 8.5, "through the door: {path_m}");
    // Without the grant it is unknown.
    let observation = world.toy.observe();
    let mut memory = Memory::new(&world.toy.briefing(), PlannerRules::paper());
    memory.update(&world.toy.briefing(), &observation, &GroundTruthIds.perceive(&observation));
    assert!(memory.objects.get(apple).is_none());
}

#[test]
fn only_granted_goal_places_count() {
    let (toy, _, beds) = rooms();
    let mut world = Granted::new(toy, &beds[..1]);
    world.update();
    let tracks = |w: &Granted| -> Vec<TrackId> {
        w.memory.goal_places().iter().map(|(t, _)| t.track).collect()
    };
    assert_eq!(tracks(&world), beds[..1]);
    assert!(world.memory.objects.get(beds[1]).is_some(), "known, but no goal place");
    world.state.goal_places.push(chaic_core::EntityId(beds[1].0 as u16));
    world.update();
    assert_eq!(tracks(&world), [beds[1], beds[0]], "the nearer one first");
}

#[test]
fn an_unchanged_state_changes_nothing_in_view_or_out_of_view() {
    let (mut toy, _, _) = rooms();
    let near = toy.add(ToyObject::new("apple", [-4.0, 0.0, -2.5], [0.16, 0.12, 0.16]));
    toy.add(ToyObject::new("trashbin", [-2.0, 0.0, -2.5], [0.4, 0.6, 0.4]));
    let mut world = Granted::new(toy, &[]);
    world.toy.stand([-4.0, 0.0], 0.0);
    let before = world.versions();
    let layout = world.memory.objects.layout_version();
    for _ in 0..3 {
        assert_eq!(world.versions(), before);
    }
    let seen = world.memory.objects.get(near).expect("placed");
    assert_eq!(
        (seen.last_seen, world.memory.objects.layout_version()),
        (world.memory.frame, layout)
    );
}

#[test]
fn moves_holders_containers_and_deliveries_are_followed() {
    let (toy, apple, _) = rooms();
    let mut world = Granted::new(toy, &[]);
    let start = world.versions();
    world.object(apple).position_in_world.x -= 0.04;
    assert_eq!(world.versions(), start, "within the tolerance");
    world.object(apple).position_in_world.x -= 0.5;
    assert!(world.versions().0 > start.0 && world.can_take(apple));

    world.object(apple).holder = Some(AgentId::PARTNER);
    let held = world.versions();
    assert!(!world.can_take(apple));
    world.object(apple).position_in_world.x -= 1.0;
    assert_eq!(world.versions(), held, "carried about");
    world.object(apple).holder = None;
    assert!(world.versions().0 > held.0 && world.can_take(apple), "put down");

    let basket = chaic_core::EntityId(999);
    world.object(apple).container = Some(basket);
    world.update();
    assert!(!world.can_take(apple), "in a container that no agent holds");
    world.object(apple).container = None;
    world.update();
    assert!(world.can_take(apple));

    world.object(apple).is_gone = true;
    world.update();
    assert!(
        !world.can_take(apple) && world.memory.objects.get(apple).expect("known").is_out_of_play
    );
}

#[test]
fn objects_in_the_own_hands_stay_there() {
    let (mut toy, apple, _) = rooms();
    let mut world = {
        toy.hold(0, apple);
        Granted::new(toy, &[])
    };
    world.object(apple).holder = Some(AgentId::HELPER);
    world.update();
    assert!(world.memory.hands.holds(apple) && !world.can_take(apple));
    assert!(world.memory.objects.get(apple).is_none());
}

#[test]
fn a_person_who_has_left_raises_no_costs_after_a_long_action() {
    let toy = Toy::room(8.0, 8.0);
    let briefing = toy.briefing();
    let mut memory = Memory::new(&briefing, PlannerRules::paper());
    let at = Vec3::new(0.0, 0.0, -2.0);
    let mut cost_at = |frame, is_there: bool| {
        let mut observation = toy.observe();
        (observation.frame, observation.images) = (frame, Default::default());
        let pose = Pose { position: at, yaw_rad: 0.0 };
        let granted = is_there.then_some((AgentId::PARTNER, pose));
        observation.granted.poses = granted.into_iter().collect();
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        memory.refresh();
        let cell = memory.map.grid().cell_at(to_xz(at)).expect("inside the room");
        memory.costs().cost(cell)
    };
    let before = cost_at(0, false);
    assert!(cost_at(10, true) > before);
    assert_eq!(cost_at(10 + 2 * PEOPLE_FRAMES, false), before);
}

#[test]
fn the_history_contains_interactions_only() {
    let (toy, apple, _) = rooms();
    let mut world = Granted::new(toy, &[]);
    let hand = chaic_core::Hand::Left;
    let pick_up = Action::PickUp { object: apple, hand };
    for action in [Action::MoveForward, pick_up, Action::PutIn, Action::Wait { frames: 5 }] {
        world.memory.last = Some((action, Outcome::Success));
        world.update();
    }
    let actions: Vec<Intent> = world.memory.history.iter().map(|record| record.action).collect();
    assert_eq!(actions, [pick_up, Action::PutIn]);
}

#[test]
fn withdrawn_objects_are_forgotten_and_withdrawn_targets_are_not_taken() {
    let toy = Toy::room(8.0, 8.0);
    let briefing = toy.briefing();
    let mut memory = Memory::new(&briefing, PlannerRules::paper());
    let [bed, basket, apple] = [0, 1, 2].map(|k| TrackId(TrackId::FIRST_SELF_ASSIGNED.0 + k));
    // Behind the agent.
    let bed_seen = seen(bed, "bed", [2.0, 0.0, 2.0], 1.2, 0.5);
    let basket_seen = seen(basket, "wicker_basket", [0.0, 0.0, 2.0], 0.3, 0.3);
    let apple_seen = seen(apple, "apple", [-2.0, 0.0, 2.0], 0.1, 0.1);
    let mut present_after = |percepts: &Percepts| {
        memory.update(&briefing, &toy.observe(), percepts);
        let is_present = |track| memory.objects.get(track).is_some_and(|object| object.is_present);
        [bed, basket, apple].map(is_present)
    };
    let detections = vec![bed_seen, basket_seen, apple_seen];
    let detected = Percepts { detections, ..Percepts::default() };
    assert_eq!(present_after(&detected), [true; 3]);
    let retracted = Percepts { retracted: vec![bed, basket, apple], ..Percepts::default() };
    assert_eq!(present_after(&retracted), [false, false, true]);
    assert_eq!(present_after(&detected), [true; 3], "all are detected again");
}
