//! A bare room for tests of single rules.
#![allow(dead_code, missing_docs, reason = "each test file uses a part of it")]

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, Rect};
use chaic_core::{AgentId, ClassId, EntityId, Outcome, ResolvedAction, TaskId, Vec2, Vec3};
use chaic_world::{AgentSpec, Event, ObjectSpec, Rules, Setup, Snapshot, State, Wall, World};

/// Agent 0.
pub const A: AgentId = AgentId::PARTNER;
/// Agent 1.
pub const B: AgentId = AgentId::HELPER;

pub fn at(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

pub fn thing(class: &str, position: Vec3) -> ObjectSpec {
    ObjectSpec::new(ClassId::named(class), position, 0.0)
}

pub fn person(persona: Persona, x: f32, z: f32) -> AgentSpec {
    AgentSpec::new(persona, Pose { position: at(x, 0.0, z), yaw_rad: 0.0 }, 0)
}

pub fn wall(a: [f32; 2], b: [f32; 2]) -> Wall {
    Wall {
        a: Vec2::from(a),
        b: Vec2::from(b),
        thickness_m: 0.12,
        bottom_m: 0.0,
        top_m: 2.9,
        color: [200, 200, 190],
    }
}

/// A hall of 20 by 20 m with a bed as the goal place in the far corner; the goal is one apple.
pub fn hall(things: Vec<ObjectSpec>, people: Vec<AgentSpec>) -> Setup {
    let mut objects = vec![thing("bed", at(-8.0, 0.0, -8.0))];
    objects.extend(things);
    Setup {
        task: TaskId::NoConstraint,
        seed: 1,
        horizon: 3000,
        bounds: Rect::new([-10.0, -10.0], [10.0, 10.0]),
        ceiling_m: Some(2.9),
        rooms: vec![],
        walls: vec![],
        openings: vec![],
        floors: vec![],
        things: objects,
        people,
        goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
        goal_places: vec![Setup::entity(0)],
    }
}

/// Returns the id of the k-th object after the bed.
pub fn nth(k: usize) -> EntityId {
    Setup::entity(1 + k)
}

pub fn world(setup: Setup) -> World {
    World::new(setup, Rules::paper()).expect("the test's setup is valid")
}

/// Runs one action of `agent` to its end without submitting actions for the others. Returns its
/// outcome and its duration in frames.
pub fn run(world: &mut World, agent: AgentId, action: ResolvedAction) -> (Outcome, u32) {
    let start = world.state().frame;
    world.submit(agent, action).expect("the agent waits");
    while world.state().agents[agent.index()].activity.is_some() && !world.is_over() {
        world.tick();
    }
    let outcome = world.state().agents[agent.index()].last.map(|(_, o)| o);
    (outcome.expect("an action has ended"), world.state().frame - start)
}

/// Replaces the state of the world.
pub fn restore(world: &mut World, state: &State) {
    let bytes = postcard::to_stdvec(state).expect("a state is plain data");
    world.restore(&Snapshot(bytes)).expect("the snapshot is of this world");
}

pub fn has_event(world: &mut World, predicate: impl Fn(&Event) -> bool) -> bool {
    world.drain_events().iter().any(predicate)
}
