//! Commands that are killed at random times (SIGKILL), and completed afterwards.
//!
//! The times depend on the machine and its load. The check does not: the files must equal those of
//! an undisturbed command.

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use chaic_core::rng::RngStream;
use clap::Args;

use crate::commands::chaic;
use crate::folder::copy;
use crate::scenario::{select, words};
use crate::trial::Trial;

/// Time between two messages about the progress.
const PROGRESS_INTERVAL: Duration = Duration::from_secs(10);

/// Maximum number of kills of one command and of its recovery commands.
const MAX_KILLS: usize = 3;

/// Options of `kills`.
#[derive(Args)]
pub struct KillOptions {
    /// Names of scenarios.
    #[arg(default_values = ["run", "long-train"])]
    scenarios: Vec<String>,
    /// Number of kills per scenario, 1 to 1000000.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    kills: u32,
    /// Seed of the times.
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Kills the commands; returns whether all were completed.
///
/// # Errors
/// If a scenario cannot be prepared.
pub fn run_all(options: &KillOptions) -> Result<bool> {
    let mut n_failures = 0;
    println!("| scenario | kills | commands | failures | seconds |\n|---|--:|--:|--:|--:|");
    for scenario in select(&options.scenarios)? {
        let began = Instant::now();
        let dir = tempfile::tempdir().context("no temporary folder")?;
        let inputs = scenario.prepare_inputs(dir.path())?;
        let trial = Trial::new(scenario, &inputs, dir.path())?;
        let duration = duration(&trial, &dir.path().join("timed"))?;
        let (mut n_kills, mut n_commands, mut failures) = (0, 0, 0);
        let mut last_message = began;
        while n_kills < options.kills {
            if last_message.elapsed() >= PROGRESS_INTERVAL {
                last_message = Instant::now();
                eprintln!(
                    "{}: {n_kills} of {} kills, {failures} failures",
                    scenario.name, options.kills
                );
            }
            let mut rng = RngStream::new(options.seed, scenario.name, n_commands);
            let at = dir.path().join("killed");
            copy(&inputs, &at)?;
            n_kills += kill(&trial, &at, duration, &mut rng)?;
            n_commands += 1;
            if let Err(problem) = trial.check_readers(&at).and_then(|()| trial.complete(&at)) {
                eprintln!("{}, command {n_commands}: {problem:#}", scenario.name);
                failures += 1;
            }
            std::fs::remove_dir_all(&at)?;
        }
        n_failures += failures;
        let (name, seconds) = (scenario.name, began.elapsed().as_secs_f64());
        println!("| {name} | {n_kills} | {n_commands} | {failures} | {seconds:.0} |");
    }
    Ok(n_failures == 0)
}

/// Returns the time that the undisturbed command takes.
fn duration(trial: &Trial<'_>, at: &Path) -> Result<Duration> {
    copy(trial.inputs, at)?;
    let began = Instant::now();
    crate::commands::run_ok(at, &words(trial.scenario.command))?;
    Ok(began.elapsed())
}

/// Starts and kills the command and its recovery commands, at random times; returns the number of
/// processes that were killed before they ended.
fn kill(trial: &Trial<'_>, at: &Path, duration: Duration, rng: &mut RngStream) -> Result<u32> {
    let mut n_killed = 0;
    for _ in 0..=rng.below(MAX_KILLS) {
        let arguments = words(trial.recovery_command(at)?);
        let mut command = chaic(at, None, None)?;
        command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().context("can't start")?;
        std::thread::sleep(duration.mul_f32(rng.unit()));
        let has_ended = child.try_wait()?.is_some();
        child.kill()?;
        child.wait()?;
        n_killed += u32::from(!has_ended);
    }
    Ok(n_killed)
}
