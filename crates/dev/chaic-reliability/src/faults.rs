//! Exhaustive injection of file faults: each operation of a command fails in each way.
//!
//! For each fault the command runs in a fresh copy of its inputs. Then:
//! 1. it does not panic, and reports a failure in one line. If it reports success, its result is
//!    complete;
//! 2. readers accept no half-written result;
//! 3. the recovery gives the files of an undisturbed command, byte by byte, and no others. If
//!    contents are random, only the names of the files are compared.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context as _, Result};
use chaic_files::faults::{CRASHED, FaultKind, FaultPlan};
use clap::Args;

use crate::command_output::CommandOutput;
use crate::commands::{FileOperation, run};
use crate::folder::{copy, differences};
use crate::scenario::{select, words};
use crate::trial::Trial;

/// Options of `faults`.
#[derive(Args)]
pub struct FaultOptions {
    /// Names of scenarios (default: all).
    scenarios: Vec<String>,
    /// Kinds of faults, separated by commas (default: all).
    #[arg(long, value_delimiter = ',')]
    kinds: Vec<FaultKind>,
    /// Take every N-th case only, 1 to 1000000.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: u32,
    /// Number of cases at the same time, 1 to 256.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=256))]
    jobs: u32,
}

/// Runs the scenarios; returns whether all cases passed.
///
/// # Errors
/// If a scenario cannot be prepared.
pub fn run_all(options: &FaultOptions) -> Result<bool> {
    let kinds: &[FaultKind] =
        if options.kinds.is_empty() { &FaultKind::ALL } else { &options.kinds };
    let mut n_failures = 0;
    println!("| scenario | operations | faults | failures | seconds |\n|---|--:|--:|--:|--:|");
    for scenario in select(&options.scenarios)? {
        let began = Instant::now();
        let dir = tempfile::tempdir().context("no temporary folder")?;
        let inputs = scenario.prepare_inputs(dir.path())?;
        let trial = Trial::new(scenario, &inputs, dir.path())?;
        let cases = cases(&trial.operations, kinds, options.every as usize);
        let failures = run_cases(&trial, &cases, dir.path(), options.jobs as usize)?;
        for failure in &failures {
            eprintln!("{failure}");
        }
        n_failures += failures.len();
        println!(
            "| {} | {} | {} | {} | {:.0} |",
            scenario.name,
            trial.operations.len(),
            cases.len(),
            failures.len(),
            began.elapsed().as_secs_f64()
        );
    }
    Ok(n_failures == 0)
}

/// Returns the faults of all operations.
fn cases(operations: &[FileOperation], kinds: &[FaultKind], every: usize) -> Vec<FaultPlan> {
    let faults = operations.iter().flat_map(|operation| {
        let kinds = kinds.iter().filter(|kind| operation.can_fail(**kind));
        let FileOperation { path, index, .. } = operation;
        kinds.map(|kind| FaultPlan { path: path.into(), index: *index, kind: *kind })
    });
    faults.step_by(every).collect()
}

/// Runs cases in parallel; returns a line for each failure.
fn run_cases(
    trial: &Trial<'_>,
    cases: &[FaultPlan],
    folder: &Path,
    jobs: usize,
) -> Result<Vec<String>> {
    let (next, failures) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = &|worker: usize| -> Result<()> {
        while let Some(fault) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            let at = folder.join(format!("case-{worker}"));
            if let Err(problem) = check(trial, fault, &at) {
                let FaultPlan { path, index, kind } = fault;
                let (name, kind, path) = (trial.scenario.name, kind.name(), path.display());
                let line = format!("{name}: {kind} at operation {index} on {path}: {problem:#}");
                failures.lock().expect("no worker panics").push(line);
            }
            std::fs::remove_dir_all(&at)?;
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs).map(|worker| scope.spawn(move || work(worker))).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("no worker panics"))
    })?;
    Ok(failures.into_inner().expect("no worker panics"))
}

/// Runs the command with a fault in the folder `at`, and checks the promises of this module.
fn check(trial: &Trial<'_>, fault: &FaultPlan, at: &Path) -> Result<()> {
    copy(trial.inputs, at)?;
    let ended = run(at, &words(trial.scenario.command), Some(fault))?;
    check_end(trial, fault.kind, &ended, at).context("the command")?;
    trial.check_readers(at)?;
    trial.complete(at)
}

/// Checks exit code and output of the command with the fault.
fn check_end(trial: &Trial<'_>, fault: FaultKind, ended: &CommandOutput, at: &Path) -> Result<()> {
    if fault.ends_process() {
        let code = ended.code;
        anyhow::ensure!(code == Some(CRASHED), "exit code {code:?} instead of a crash");
        return Ok(());
    }
    if let Some(problem) = ended.problem() {
        anyhow::bail!(problem);
    }
    if fault == FaultKind::ShortWrite {
        anyhow::ensure!(
            ended.code == Some(0),
            "a short write is an error: {}",
            ended.stderr.trim()
        );
    }
    if ended.code == Some(0) {
        let changed = differences(&trial.scenario.result(at)?, &trial.expected);
        anyhow::ensure!(changed.is_empty(), "success with different files: {changed:?}");
    }
    Ok(())
}
