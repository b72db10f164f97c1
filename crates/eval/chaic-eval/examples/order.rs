//! Checks the expected order of helpers, no helper < RHP < oracle, with a margin: `cargo run
//! --release -p chaic-eval --example order`.
//!
//! Plays the first bundled training episodes of each task with each helper. Fails (exit 1) if mean
//! transport rates over all tasks differ by less than [`MARGIN`]. It prints 0.30, 0.57 and 0.74:
//! the margin is a fifth and a third of the distances, so that only a broken helper or world fails.

use std::process::ExitCode;

use chaic_agents::PlannerRules;
use chaic_core::TaskId;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_env::{Env, EpisodeConfig};
use chaic_episodes::{Episode, Split, episodes};
use chaic_eval::Result;
use rayon::prelude::*;

/// Minimum difference of the mean transport rates of two neighbors.
const MARGIN: f64 = 0.05;
/// Number of episodes per task.
const EPISODES: usize = 3;
/// Helpers in the expected order.
const HELPERS: [&str; 3] = ["none", "rhp", "oracle"];

/// Plays an episode; returns the delivered fraction of the goal.
fn transport_rate(episode: &Episode, helper: &str) -> Result<f64> {
    let config = EpisodeConfig { image_size: Some(256), ..EpisodeConfig::new(episode, helper) };
    let mut env = Env::new(config, BuiltInHelpers.make(helper, PlannerRules::paper()))?;
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
    eprintln!("error: transport rates are not {} with a margin of {MARGIN}", HELPERS.join(" < "));
    Ok(ExitCode::FAILURE)
}
