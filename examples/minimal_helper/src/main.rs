//! Two helpers, evaluated against no helper: copy this folder and start.
//!
//! `NearestFirst` chooses among plans; chaic perceives, remembers and executes them. `Walker` (walker.rs)
//! decides every single action from depth and instance ids. `cargo run --release -p minimal-helper` plays
//! three tasks with both and prints the table. docs/tutorial-rust.md explains each part.

mod walker;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use chaic_agents::PlanningAgent;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_core::observation::Grants;
use chaic_core::{Agent, AgentError, Briefing, TaskId};
use chaic_env::CHAIC_VERSION;
use chaic_env::helper_registry::{Helper, HelperRegistry};
use chaic_env::rules::PlannerRules;
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::{Format, Report};
use chaic_eval::run::{FolderMode, Run, RunRequest};

use crate::walker::Walker;

/// Picks up the nearest possible target; delivers when both hands are full or time is short.
struct NearestFirst;

impl Policy for NearestFirst {
    fn reset(&mut self, _: &Briefing) {}

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let is_late = context.memory.frame > context.briefing.horizon / 4 * 3;
        let rank = |plan: &Plan| match plan {
            Plan::Deliver if is_late => 0,
            Plan::PickUp(_) => 1,
            Plan::Deliver => 2,
            Plan::Explore => 3,
            _ => 4,
        };
        Ok(valid.iter().copied().min_by_key(rank).unwrap_or(Plan::Explore))
    }
}

/// Makes the helpers of this example by name.
struct Own;

impl HelperRegistry for Own {
    fn names(&self) -> Vec<String> {
        vec!["nearest".to_owned(), "walker".to_owned()]
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        let agent: Box<dyn Agent> = match name {
            "nearest" => Box::new(PlanningAgent::new(NearestFirst, rules)),
            "walker" => Box::new(Walker::default()),
            _ => return None,
        };
        Some(Helper { agent, grants: Grants::PLANNER })
    }
}

/// Plays the first test episodes of some tasks into a run folder; continues a run that was interrupted.
fn evaluate(out: &Path, tasks: &[TaskId], n_episodes: u32) -> Result<Run> {
    let request = RunRequest {
        tasks: Some(tasks.to_vec()),
        helpers: Some(["none", "nearest", "walker"].map(str::to_owned).to_vec()),
        n_episodes: Some(n_episodes),
        ..RunRequest::default()
    };
    let (mut run, _) = Run::open(out, FolderMode::Resume, &request, &Own)?;
    run.play(2, &Own, &AtomicBool::new(false), &mut |_| {})?;
    Ok(run)
}

fn main() -> Result<()> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "runs/minimal".to_owned());
    let tasks = [TaskId::NoConstraint, TaskId::LowTarget, TaskId::MovingHouse];
    let run = evaluate(Path::new(&out), &tasks, 4)?;
    let (options, results, planned) = (run.options(), run.results(), run.planned());
    let (granted, formulas) = (Some(run.granted()), FormulaSet::Paper);
    let report = Report { version: CHAIC_VERSION, options, results, planned, granted, formulas };
    println!("{}", report.text(Format::Table));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_first_beats_no_helper() -> Result<()> {
        let folder = tempfile::tempdir()?;
        let run = evaluate(folder.path(), &[TaskId::LowTarget, TaskId::MovingHouse], 3)?;
        let rates = |helper: &str| -> Vec<f64> {
            let results = run.results().iter().filter(|r| r.key.helper == helper);
            results.filter_map(|r| r.summary()).map(|summary| summary.rate()).collect()
        };
        let [none, nearest, walker] = ["none", "nearest", "walker"].map(rates);
        assert_eq!([none.len(), nearest.len(), walker.len()], [6; 3]);
        let sum = |rates: &[f64]| rates.iter().sum::<f64>();
        assert!(sum(&nearest) > sum(&none) + 0.6, "{none:?} {nearest:?} {walker:?}");
        Ok(())
    }
}
