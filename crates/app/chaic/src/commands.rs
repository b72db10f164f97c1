//! The commands, one per file.

pub mod bench;
pub mod collect;
pub mod doctor;
pub mod episodes;
pub mod eval;
pub mod explain;
pub mod export;
pub mod fidelity;
pub mod helper;
pub mod import;
pub mod leaderboard;
pub mod list;
pub mod llm;
pub mod merge;
pub mod opponent;
pub mod perception;
pub mod play;
pub mod render;
pub mod replay;
pub mod report;
pub mod scene;
pub mod shell;
pub mod show;
pub mod study;
pub mod submit;
pub mod train;
pub mod verify;
pub mod view;

mod bars;
mod datasets;
mod eval_partners;
mod eval_session;
mod given_partners;
mod output_path;
mod recorded;
mod run_perception;
mod sealed;
mod study_serve;
mod submit_run;
mod submitted;
mod summary;

use std::path::{Path, PathBuf};

use anyhow::Result;
use chaic_episodes::{Episode, find_episode};
use chaic_eval::run::{RunFolder, RunOptions, planned, planned_traces};
use chaic_eval::{EvalError, read_episode_file};
use chaic_files::write_atomically;
use chaic_learn::bundled::{BundledHelper, BundledPartner};
use chaic_llm::language::{helper_names, partner_names};
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;

use crate::exit::ExitStatus;
use crate::output::{OutputFormat, print_error};

/// Returns the episode that an argument names: the file of this name if there is one, else the episode of this id.
///
/// # Errors
/// If neither exists, or the file is not a valid episode.
fn episode(argument: &str) -> Result<Episode> {
    let path = Path::new(argument);
    let is_name = argument.ends_with(".json") || (path.exists() && !path.is_dir());
    if is_name {
        return Ok(Episode::parse(&read_episode_file(path)?, argument)?);
    }
    Ok(find_episode(argument)?)
}

/// Returns all names that `--helper` accepts, without `none`.
fn all_helper_names() -> Vec<String> {
    let bundled = BundledHelper::all().iter().map(|helper| helper.name.to_owned());
    helper_names().into_iter().chain(bundled).collect()
}

/// Returns the names of all partners except `rules`; built-in ones come first.
fn all_partner_names() -> Vec<String> {
    let bundled = BundledPartner::all().iter().map(|partner| partner.name.to_owned());
    partner_names().into_iter().chain(bundled).collect()
}

/// Returns the number of parallel jobs: the given number, or one per core.
fn jobs(given: Option<u16>) -> usize {
    /// Maximum number of jobs: more than the cores of any machine.
    const MAX_JOBS: usize = 1024;
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    given.map_or_else(cores, usize::from).min(MAX_JOBS)
}

/// Starts the shared thread pool, which also renders the images of one frame in parallel.
///
/// # Errors
/// If the system refuses the threads.
fn start_threads(jobs: usize) -> Result<()> {
    // More threads than jobs would only wait.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build_global();
    // The text of this error already contains its cause.
    pool.map_err(|error| anyhow::anyhow!("can't start threads: {error}"))
}

/// Returns an empty table with a header.
fn table<const N: usize>(header: [&str; N]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(header);
    table
}

/// Writes a report to the file of `--json`, if given.
///
/// # Errors
/// If the file cannot be written.
fn write_json(path: Option<&Path>, report: &impl Serialize) -> Result<()> {
    if let Some(path) = path {
        let json = serde_json::to_string_pretty(report).expect("reports serialize") + "\n";
        write_atomically(path, json.as_bytes())?;
    }
    Ok(())
}

/// Returns the traces of the episode runs that a run plays, and warnings about the others. If its episode
/// files no longer exist, the planned episode runs are unknown, and all traces are returned.
///
/// # Errors
/// If a folder cannot be read.
fn traces_of_plan(
    folder: &RunFolder,
    options: &RunOptions,
) -> Result<(Vec<PathBuf>, Vec<String>), EvalError> {
    planned_traces(folder, &planned(folder, options).unwrap_or_default())
}

/// Reports that a command without partial results was stopped, and returns its exit status.
fn stopped_without_result() -> ExitStatus {
    print_error("stopped; nothing was written");
    ExitStatus::Interrupted
}

/// Refuses JSON for a command that prints text only.
///
/// # Errors
/// A usage error if the format is not text.
fn require_text(format: OutputFormat, command: &str) -> Result<()> {
    if format == OutputFormat::Text {
        return Ok(());
    }
    let text = format!("`{command}` prints text only; leave out --format {}", format.name());
    Err(EvalError::Options(text).into())
}
