//! Lists objects that people cannot reach in the original's episodes: `cargo run --release -p
//! chaic-import --example reach -- DATASET TDW`.
//!
//! Searches paths for each agent to everything that the task needs (targets, containers, goal
//! places) on a grid of 2 cm. If an agent's body is too wide, prints the largest radius that has a
//! path.

use std::collections::BTreeMap;
use std::error::Error;

use chaic_core::{AgentId, Role};
use chaic_episodes::{Episode, ReachabilityParams, unreachable_objects};
use chaic_import::{OnError, Sources, import};
use chaic_world::{Rules, Setup};

/// Side of the grid's cells, meters.
const CELL_M: f32 = 0.02;
/// Smallest radius that is tried, meters.
const MIN_RADIUS_M: f32 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dataset, tdw] = &arguments[..] else { return Err("usage: reach DATASET TDW".into()) };
    let sources = Sources { dataset: dataset.into(), tdw: tdw.into(), half: None };
    let imported = import(&sources, OnError::Stop)?;
    let mut n_incomplete = 0;
    for episode in &imported.episodes {
        for agent in episode.setup().agents() {
            n_incomplete += usize::from(report(episode, agent));
        }
    }
    println!("{} episodes, {n_incomplete} agents cannot reach everything", imported.episodes.len());
    Ok(())
}

/// Prints the objects that an agent cannot reach; returns whether there are any.
fn report(episode: &Episode, agent: AgentId) -> bool {
    let setup = episode.setup();
    let radius_m = setup.people[agent.index()].capability().radius_m;
    let unreachable = unreachable(setup, agent, radius_m);
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for k in &unreachable {
        let max_radius_m = max_radius_m(setup, agent, *k, radius_m);
        let (role, class) = (role(setup, *k), setup.things[*k].class);
        *kinds
            .entry(format!("{role} {class}, reachable for radii up to {max_radius_m:.2} m"))
            .or_default() += 1;
    }
    for (line, n) in &kinds {
        println!("{}: {} ({radius_m:.2} m): {n} x {line}", episode.id(), agent.role_name());
    }
    !unreachable.is_empty()
}

fn unreachable(setup: &Setup, agent: AgentId, radius_m: f32) -> Vec<usize> {
    let reach_m = Rules::paper().reach_limit_m;
    unreachable_objects(setup, agent, ReachabilityParams { radius_m, reach_m, cell_m: CELL_M })
}

fn role(setup: &Setup, k: usize) -> &'static str {
    if setup.goal_places.contains(&Setup::entity(k)) {
        return "goal";
    }
    match setup.things[k].class.info().role {
        Role::Container => "container",
        Role::Obstacle => "obstacle",
        _ => "target",
    }
}

/// Returns the largest radius, to a centimeter, that has a path to an object.
fn max_radius_m(setup: &Setup, agent: AgentId, k: usize, below_m: f32) -> f32 {
    let has_path = |radius_m: &f32| !unreachable(setup, agent, *radius_m).contains(&k);
    let n = ((below_m - MIN_RADIUS_M) / 0.01) as u32;
    (0..=n).map(|i| below_m - 0.01 * i as f32).find(has_path).unwrap_or(0.0)
}
