//! A bare room to try rules in.
#![allow(dead_code, missing_docs, reason = "each test file uses its own part")]

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, Rect};
use chaic_core::{AgentId, ClassId, EntityId, Outcome, ResolvedAction, TaskId, Vec2, Vec3};
use chaic_world::{Event, Person, Rules, Setup, Thing, Wall, World};

/// Agent 0.
pub const A: AgentId = AgentId::PARTNER;
/// Agent 1.
pub const B: AgentId = AgentId::HELPER;

pub fn at(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

pub fn thing(class: &str, position: Vec3) -> Thing {
    Thing::new(ClassId::named(class), position, 0.0)
}

pub fn person(persona: Persona, x: f32, z: f32) -> Person {
    Person::new(persona, Pose { position: at(x, 0.0, z), yaw_rad: 0.0 }, 0)
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

/// A hall of 20 by 20 m with a bed as the goal in the far corner; one apple is wanted.
pub fn hall(things: Vec<Thing>, people: Vec<Person>) -> Setup {
    let mut all = vec![thing("bed", at(-8.0, 0.0, -8.0))];
    all.extend(things);
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
        things: all,
        people,
        goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
        goal_places: vec![Setup::entity(0)],
    }
}

/// The k-th thing after the bed.
pub fn nth(k: usize) -> EntityId {
    Setup::entity(1 + k)
}

pub fn world(setup: Setup) -> World {
    World::new(setup, Rules::paper()).expect("the test's setup is valid")
}

/// Lets `agent` do one action to its end while everybody else waits; returns its outcome and
/// the frames it took.
pub fn run(world: &mut World, agent: AgentId, action: ResolvedAction) -> (Outcome, u32) {
    let began = world.state().frame;
    world.submit(agent, action).expect("the agent is free");
    while world.state().people[agent.index()].activity.is_some() && !world.is_over() {
        world.tick();
    }
    let outcome = world.state().people[agent.index()].last.map(|(_, o)| o);
    (outcome.expect("an action has ended"), world.state().frame - began)
}

pub fn happened(world: &mut World, what: impl Fn(&Event) -> bool) -> bool {
    world.drain_events().iter().any(what)
}
