//! Promise: each grant gives its own information and no other. The granted state is complete and true.

use chaic_core::action::{Action, Hand, Outcome};
use chaic_core::briefing::TaskDisclosure;
use chaic_core::capability::Persona;
use chaic_core::geom::Rect;
use chaic_core::observation::{GrantedInfo, Grants, ObjectState};
use chaic_core::{AgentId, ClassId, EntityId, ResolvedAction, TaskId, Vec2, Vec3};
use chaic_world::{Opening, Room, RoomKind, World};

use crate::common::*;

const STATE: Grants = Grants { state: true, ..Grants::NONE };

/// Creates two rooms with a basket, an apple, an obstacle, a fixed apple and a table.
fn rooms() -> World {
    let mut decoration = thing("apple", at(3.0, 0.0, 6.0));
    decoration.fixed = true;
    let things = vec![
        thing("wicker_basket", at(0.0, 0.0, -0.6)),
        thing("apple", at(0.6, 0.0, 0.0)),
        thing("trashbin", at(5.0, 0.0, -5.0)),
        decoration,
        thing("dining_table", at(5.0, 0.0, 5.0)),
    ];
    let people = vec![person(Persona::Adult, 0.0, 0.0), person(Persona::Helper, 0.0, 8.0)];
    let mut setup = hall(things, people);
    let room = |min, max| Room { kind: RoomKind::Office, rect: Rect::new(min, max) };
    setup.rooms = vec![room([-10.0, -10.0], [1.9, 10.0]), room([2.1, -10.0], [10.0, 10.0])];
    setup.walls = vec![wall([2.0, -10.0], [2.0, -0.5]), wall([2.0, 0.5], [2.0, 10.0])];
    let mut lintel = wall([2.0, -0.5], [2.0, 0.5]);
    lintel.bottom_m = 2.1;
    setup.walls.push(lintel);
    setup.openings =
        vec![Opening { a: Vec2::new(2.0, -0.5), b: Vec2::new(2.0, 0.5), rooms: [0, 1] }];
    world(setup)
}

fn granted(w: &World, grants: Grants) -> GrantedInfo {
    w.granted(B, grants, &[])
}

fn state_of(w: &World, entity: EntityId) -> Option<ObjectState> {
    let state = granted(w, STATE).state.expect("it is granted");
    state.objects.into_iter().find(|o| o.entity == entity)
}

fn pick_up(object: EntityId, hand: Hand) -> ResolvedAction {
    Action::PickUp { object, hand }
}

#[test]
fn without_the_grant_neither_state_nor_layout_is_given() {
    let w = rooms();
    let others = Grants { state: false, ..Grants::ALL };
    assert_eq!(granted(&w, others).state, None);
    assert_eq!(granted(&w, others).partner_hands, None, "the partner is not in view");
    assert_eq!(w.briefing(B, others, 0).layout, None);
    assert_eq!(granted(&w, STATE).partner_hands, None, "behavior is not granted");
    assert!(w.briefing(B, STATE, 0).layout.is_some());
}

#[test]
fn a_briefing_has_goal_place_goal_task_and_layout_by_their_grants() {
    let w = rooms();
    let bed = ClassId::named("bed");
    for (name, _) in Grants::NONE.named() {
        let briefing = w.briefing(B, Grants::from_names([name]).expect("a grant"), 0);
        assert!(briefing.goal_places.contains(&bed));
        assert_eq!(briefing.goal_places.len() == 1, name == "goal_place", "{name}");
        assert_eq!(briefing.goal, (name == "goal").then(|| w.setup().goal.clone()), "{name}");
        let disclosure =
            TaskDisclosure { task: TaskId::NoConstraint, partner: Persona::Adult.into() };
        assert_eq!(briefing.disclosure, (name == "task").then_some(disclosure), "{name}");
        assert_eq!(briefing.layout.is_some(), name == "state", "{name}");
    }
}

#[test]
fn an_observation_has_the_information_of_its_grants() {
    let mut w = rooms();
    assert_eq!(run(&mut w, A, pick_up(nth(0), Hand::Left)).0, Outcome::Success);
    let (partner, helper, apple) = (EntityId::from_agent(A), EntityId::from_agent(B), nth(1));
    let mut state = w.state().clone();
    state.objects[2].delivered = Some(0);
    restore(&mut w, &state);
    for (name, _) in Grants::NONE.named() {
        let grants = Grants::from_names([name]).expect("a grant");
        for in_view in [vec![], vec![partner], vec![partner, apple]] {
            let seen = w.granted(B, grants, &in_view);
            let given = |grant: &str, n: usize| if name == grant { n } else { 0 };
            let (n_people, n_apples) =
                (in_view.len().min(1), usize::from(in_view.contains(&apple)));
            assert_eq!(seen.classes.len(), given("ids", in_view.len()), "{name}");
            let n_delivered = given("ids", n_apples) + given("progress", 1);
            assert_eq!(seen.delivered.len(), n_delivered, "{name}");
            assert_eq!(seen.goal.is_some(), name == "goal");
            assert_eq!(seen.behavior.len(), given("behavior", n_people), "{name}");
            let n_hands = usize::from(seen.partner_hands.is_some());
            assert_eq!(n_hands, given("behavior", n_people), "{name}");
            assert_eq!(seen.poses.len(), given("positions", 2), "{name}");
            assert_eq!(seen.state.is_some(), name == "state");
        }
    }
    // Each of the two observes the hands of the other.
    let behavior = Grants { behavior: true, ..Grants::NONE };
    let hands = |me, other| w.granted(me, behavior, &[other]).partner_hands.expect("in view");
    let held = hands(B, partner).map(|held| held.map(|held| held.entity));
    assert_eq!(held, [Some(nth(0)), None]);
    assert_eq!(hands(A, helper), [None, None]);
}

#[test]
fn the_state_lists_movable_objects_and_possible_goal_places_with_their_true_extents() {
    let w = rooms();
    let state = granted(&w, STATE).state.expect("it is granted");
    let listed: Vec<&str> = state.objects.iter().map(|o| o.class.name()).collect();
    assert_eq!(listed, ["bed", "wicker_basket", "apple", "trashbin"]);
    assert_eq!(state.goal_places, [EntityId::FIRST_OBJECT]);
    for object in &state.objects {
        let spec = w.setup().object(object.entity).expect("it exists");
        let size = spec.size_m();
        let center = spec.position + Vec3::Y * 0.5 * size.y;
        assert!(object.position_in_world.distance(center) < 1e-4, "{object:?}");
        assert!((object.bottom_m - spec.position.y).abs() < 1e-4, "{object:?}");
        assert!((object.top_m - spec.position.y - size.y).abs() < 1e-4, "{object:?}");
        assert_eq!((object.holder, object.container, object.is_gone), (None, None, false));
        let outline = &object.footprint;
        assert_eq!(outline.is_empty(), object.class.info().is_carriable());
        let next = outline.iter().cycle().skip(1);
        let gaps = outline.iter().zip(next).map(|(a, b)| a.distance(*b));
        assert!(gaps.fold(0.0, f32::max) <= ObjectState::OUTLINE_SPACING_M + 1e-4);
        if !outline.is_empty() {
            let low = outline.iter().copied().reduce(Vec2::min).expect("not empty");
            let high = outline.iter().copied().reduce(Vec2::max).expect("not empty");
            assert!((high - low).distance(Vec2::new(size.x, size.z)) < 1e-4, "{object:?}");
        }
    }
}

#[test]
fn holders_containers_and_deliveries_follow_the_objects() {
    let mut w = rooms();
    let (basket, apple) = (nth(0), nth(1));
    for action in [pick_up(basket, Hand::Left), pick_up(apple, Hand::Right)] {
        assert_eq!(run(&mut w, A, action).0, Outcome::Success);
    }
    let held = state_of(&w, apple).expect("listed");
    assert_eq!((held.holder, held.container), (Some(A), None));
    assert_eq!(run(&mut w, A, Action::PutIn).0, Outcome::Success);
    let inside = state_of(&w, apple).expect("listed");
    assert_eq!((inside.holder, inside.container), (Some(A), Some(basket)));
    assert_eq!(state_of(&w, basket).expect("listed").holder, Some(A));
    let seen = granted(&w, Grants { behavior: true, ..STATE });
    let hands = seen.partner_hands.expect("given at any place");
    assert_eq!(hands[0].as_ref().map(|h| h.contents.len()), Some(1));
    assert_eq!(seen.behavior.iter().map(|b| b.agent).collect::<Vec<AgentId>>(), [A]);
}

#[test]
fn a_running_put_in_is_granted_behavior() {
    let mut w = rooms();
    for action in [pick_up(nth(0), Hand::Left), pick_up(nth(1), Hand::Right)] {
        assert_eq!(run(&mut w, A, action).0, Outcome::Success);
    }
    w.submit(A, Action::PutIn).expect("the agent waits");
    w.tick();
    let seen = granted(&w, Grants { behavior: true, ..STATE }).behavior;
    let actions: Vec<_> = seen.iter().map(|b| (b.action, b.outcome)).collect();
    assert_eq!(actions, [(Action::PutIn, None)]);
}

#[test]
fn the_layout_has_rooms_doorways_walls_and_fixed_furniture() {
    let w = rooms();
    let layout = w.briefing(B, STATE, 0).layout.expect("it is granted");
    let is_floor = |x, z| layout.floors.iter().any(|f| f.contains(Vec2::new(x, z)));
    assert!(is_floor(0.0, 0.0) && is_floor(2.0, 0.0) && is_floor(5.0, 0.0));
    assert!(!is_floor(2.0, 5.0), "inside the wall");
    // At 1 m above the floor.
    let is_blocked = |x, z| {
        let at = Vec2::new(x, z);
        let cuts = |y: [f32; 2]| y[0] < 1.0 && y[1] > 0.1;
        layout.blocks.iter().any(|b| cuts(b.y_range_m) && b.contains(at, 0.0))
    };
    assert!(is_blocked(2.0, 5.0) && is_blocked(-8.0, -8.0) && is_blocked(5.0, 5.0));
    assert!(!is_blocked(2.0, 0.0), "a lintel");
    assert!(!is_blocked(5.0, -5.0), "a movable obstacle");
    assert!(layout.blocks.iter().any(|b| b.contains(Vec2::new(2.0, 0.0), 0.0)), "the lintel");
}
