//! Whether helpers stand in the expected order, no helper < RHP < oracle, with a wide margin:
//! `cargo run --release -p chaic-eval --example order`.
//!
//! Plays the first bundled training episodes of each task with each of them, and fails (exit 1) where
//! the mean transport rates over all tasks lie nearer than [`MARGIN`]. It prints 0.30, 0.57 and 0.74: the
//! margin is a fifth and a third of the distances, so that only a broken helper or world fails.

use std::process::ExitCode;

use chaic_agents::PlannerRules;
use chaic_core::TaskId;
use chaic_env::minds::{BuiltIn, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_env::{Appearance, Env, EpisodeConfig};
use chaic_episodes::{Episode, Split, episodes};
use chaic_eval::Result;
use rayon::prelude::*;

/// Least difference of the mean transport rates of two neighbors.
const MARGIN: f64 = 0.05;
/// Episodes of each task.
const EPISODES: usize = 3;
/// In the expected order.
const HELPERS: [&str; 3] = ["none", "rhp", "oracle"];

/// Part of what was wanted that is delivered at the end.
fn transport_rate(episode: &Episode, helper: &str) -> Result<f64> {
    let config = EpisodeConfig {
        episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper,
        partner: None,
        image_size: Some(256),
        appearance: Appearance::Canonical,
    };
    let mut env = Env::new(config, BuiltIn.make(helper, PlannerRules::paper()))?;
    env.advance(None)?;
    let (done, total) = env.world().progress();
    Ok(done / total)
}

fn main() -> Result<ExitCode> {
    let first = |task| episodes(&Split::Train, task).take(EPISODES);
    let all = TaskId::paper().flat_map(first).collect::<std::result::Result<Vec<_>, _>>()?;
    let mut means = Vec::new();
    for helper in HELPERS {
        let rates = all.par_iter().map(|episode| transport_rate(episode, helper));
        let rates = rates.collect::<Result<Vec<f64>>>()?;
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        println!("{helper}: transport rate {mean:.3} over {} episodes", rates.len());
        means.push(mean);
    }
    let is_in_order = means.windows(2).all(|pair| pair[1] - pair[0] > MARGIN);
    if is_in_order {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("error: {} don't lie {MARGIN} apart each", HELPERS.join(" < "));
    Ok(ExitCode::FAILURE)
}
