//! Lists what people can't get at in the original's episodes:
//! `cargo run --release -p chaic-import --example reach -- DATASET TDW`.
//!
//! For each agent, everything that the task needs is looked for on a grid of 2 cm: targets,
//! containers, goal places. Where a body as wide as its own finds no way, the widest that does is
//! told.

use std::collections::BTreeMap;
use std::error::Error;

use chaic_core::{AgentId, Role};
use chaic_episodes::{Episode, Walker, out_of_reach};
use chaic_import::{OnError, Sources, import};
use chaic_world::{Rules, Setup};

/// Side of the grid's cells, metres.
const CELL_M: f32 = 0.02;
/// No body is narrower, metres.
const NARROWEST_M: f32 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dataset, tdw] = &arguments[..] else { return Err("usage: reach DATASET TDW".into()) };
    let sources = Sources { dataset: dataset.into(), tdw: tdw.into(), half: None };
    let imported = import(&sources, OnError::Stop)?;
    let mut n_missed = 0;
    for episode in &imported.episodes {
        for agent in episode.setup().agents() {
            n_missed += usize::from(report(episode, agent));
        }
    }
    println!("{} episodes, {n_missed} agents miss something", imported.episodes.len());
    Ok(())
}

/// Says what an agent misses; whether it misses anything.
fn report(episode: &Episode, agent: AgentId) -> bool {
    let setup = episode.setup();
    let radius_m = setup.people[agent.index()].capability().radius_m;
    let missed = missed(setup, agent, radius_m);
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for k in &missed {
        let widest_m = widest(setup, agent, *k, radius_m);
        let (role, class) = (role(setup, *k), setup.things[*k].class);
        *kinds.entry(format!("{role} {class}, for radii up to {widest_m:.2} m")).or_default() += 1;
    }
    for (line, n) in &kinds {
        println!("{}: {} ({radius_m:.2} m): {n} x {line}", episode.id(), agent.word());
    }
    !missed.is_empty()
}

fn missed(setup: &Setup, agent: AgentId, radius_m: f32) -> Vec<usize> {
    let reach_m = Rules::paper().reach_limit_m;
    out_of_reach(setup, agent, Walker { radius_m, reach_m, cell_m: CELL_M })
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

/// The widest radius, to a centimetre, that finds a way to a thing.
fn widest(setup: &Setup, agent: AgentId, k: usize, below_m: f32) -> f32 {
    let gets_there = |radius_m: &f32| !missed(setup, agent, *radius_m).contains(&k);
    let n = ((below_m - NARROWEST_M) / 0.01) as u32;
    (0..=n).map(|i| below_m - 0.01 * i as f32).find(gets_there).unwrap_or(0.0)
}
