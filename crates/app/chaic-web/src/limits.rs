//! Objects of the task, and the partner's limits that they exceed.

use chaic_core::geom::to_xz;
use chaic_core::{AgentId, Role};
use chaic_render::floor_plan;
use chaic_world::{ObjectLocation, World};
use serde::Serialize;

use crate::memory_history::rounded;

/// Limit that an object exceeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// Its top is above the reach.
    TooHigh,
    /// Its top is below the reach.
    TooLow,
    /// Its mass exceeds the strength.
    TooHeavy,
}

/// Object of the task that lies or stands somewhere or is held.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskObject {
    /// Class and number, for example `apple #31`.
    pub name: String,
    /// Position on the map, relative to its width.
    pub at: [f32; 2],
    /// Limits of the partner that it exceeds.
    pub limits: Vec<Limit>,
    /// Height of its top, meters.
    pub top_m: f32,
    /// Mass, kilograms.
    pub mass_kg: f32,
}

/// Returns the movable objects of the goal, containers and obstacles, without delivered and broken ones.
/// An object that exceeds a limit cannot be picked up by the partner without a chance of failure.
pub fn task_objects(world: &World) -> Vec<TaskObject> {
    let setup = world.setup();
    let Some(partner) = setup.people.get(AgentId::PARTNER.index()) else { return Vec::new() };
    let capability = partner.capability();
    let [low_m, high_m] = capability.pick_range_m;
    let things = setup.entities().zip(&setup.things).zip(&world.state().objects);
    let movable = things.filter(|((_, thing), state)| {
        let matters = matches!(thing.class.info().role, Role::Container | Role::Obstacle)
            || setup.goal.count(thing.class) > 0;
        let is_done = state.location == ObjectLocation::Broken || state.delivered.is_some();
        matters && !thing.fixed && !is_done
    });
    let objects = movable.map(|((entity, thing), state)| {
        let (top_m, info) = (world.top_height_m(entity), thing.class.info());
        let checks = [
            (top_m > high_m, Limit::TooHigh),
            (top_m < low_m, Limit::TooLow),
            (info.mass_kg > capability.strength_kg, Limit::TooHeavy),
        ];
        let limits: Vec<Limit> = checks
            .into_iter()
            .filter(|(is_beyond, _)| *is_beyond)
            .map(|(_, limit)| limit)
            .collect();
        TaskObject {
            name: format!("{} #{}", info.label, entity.0),
            at: rounded(floor_plan::position_on_map(world, to_xz(state.position))),
            limits,
            top_m,
            mass_kg: info.mass_kg,
        }
    });
    objects.collect()
}
