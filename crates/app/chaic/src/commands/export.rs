//! `chaic export`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use chaic_core::TaskId;
use chaic_env::trace::Header;
use chaic_episodes::{Episode, Split, SplitError, episodes};
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::verify::verify_trace;
use chaic_eval::{EvalError, read_episode_files};
use chaic_export::episodes::EpisodeSetWriter;
use chaic_export::lerobot::{LeRobotOptions, LeRobotWriter};
use serde_json::json;

use super::recorded::RecordedHelpers;
use super::{bars, stopped_without_result, traces_of_plan};
use crate::arguments::{EpisodesArguments, ExportCommand, LeRobotArguments};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{
    OutputFormat, counted, json_path, print_error, print_result, print_warning, quoted_path,
};

/// Exports recorded episodes, a split or episode files.
pub fn run(command: &ExportCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        ExportCommand::Lerobot(arguments) => lerobot(arguments, format),
        ExportCommand::Episodes(arguments) => export_episodes(arguments, format),
    }
}

fn export_episodes(arguments: &EpisodesArguments, format: OutputFormat) -> Result<ExitStatus> {
    let EpisodesArguments { split, episodes: folder, task, out } = arguments;
    let tasks = task.as_ref().map(|tasks| tasks.0.clone());
    if let Some(folder) = folder {
        let is_selected =
            |episode: &Episode| tasks.as_ref().is_none_or(|tasks| tasks.contains(&episode.task()));
        let mut selected = read_episode_files(folder)?;
        selected.retain(is_selected);
        if selected.is_empty() {
            let of_tasks = if tasks.is_some() { " of these tasks" } else { "" };
            let text = format!("{} holds no episode file (*.json){of_tasks}", folder.display());
            return Err(EvalError::Options(text).into());
        }
        let total = selected.len() as u64;
        let mut selected = selected.into_iter().map(Ok::<Episode, SplitError>);
        return write_episodes(out, None, total, &mut selected, format);
    }
    let split = split.as_ref().context("give --split or --episodes")?;
    let tasks = tasks.unwrap_or_else(|| TaskId::paper().collect());
    let total: u64 = tasks.iter().map(|task| split.len_of(*task) as u64).sum();
    if total == 0 {
        let text = "has no episodes of these tasks, which are not the paper's; choose gen:A..B";
        return Err(EvalError::Options(format!("{split} {text}")).into());
    }
    let mut generated = tasks.iter().flat_map(|task| episodes(split, *task));
    write_episodes(out, Some(split), total, &mut generated, format)
}

/// Writes a data set of episodes; `split` is absent for episodes from files.
fn write_episodes(
    out: &Path,
    split: Option<&Split>,
    total: u64,
    episodes: &mut dyn Iterator<Item = Result<Episode, SplitError>>,
    format: OutputFormat,
) -> Result<ExitStatus> {
    let stop = interrupt::stop_flag()?;
    let mut writer = EpisodeSetWriter::create(out)?;
    let bar = bars::count_bar(total, "episodes");
    let mut is_complete = true;
    for episode in episodes {
        if stop.load(Ordering::Relaxed) {
            is_complete = false;
            break;
        }
        match split {
            Some(_) => writer.add(&episode?)?,
            None => writer.add_from_file(&episode?)?,
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let n = writer.finish(split)?;
    if n == 0 {
        return Ok(stopped_without_result());
    }
    let text = format!("{}: {}\n", quoted_path(out), counted(n, "episode"));
    print_result(format, &json!({ "out": json_path(out), "episodes": n }), &text)?;
    if !is_complete {
        print_error("stopped; the folder holds a valid data set of fewer episodes");
        return Ok(ExitStatus::Interrupted);
    }
    Ok(ExitStatus::Success)
}

fn lerobot(arguments: &LeRobotArguments, format: OutputFormat) -> Result<ExitStatus> {
    let LeRobotArguments { run, out, agent, every, size, creator, .. } = arguments;
    let options_of_set = LeRobotOptions { agent: *agent, every: *every, image_size: *size };
    options_of_set.check()?;
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let SelectedTraces { traces, n_cut, contents } = select(arguments, &folder, &options)?;
    if traces.is_empty() {
        bail!("{} has {}", folder.path().display(), nothing_selected(arguments, n_cut, &contents));
    }
    let stop = interrupt::stop_flag()?;
    let writer = LeRobotWriter::create(out, options_of_set)?;
    let mut writer = writer.with_creators(creator.clone());
    let bar = bars::count_bar(traces.len() as u64, "episodes");
    let mut n = 0;
    for path in &traces {
        // Traces are read one at a time, because all traces of a large run do not fit into memory.
        let (trace, _) = folder.read_trace(path)?;
        let episode = folder.episode(&options, &trace.header.key())?;
        if !writer.add(&trace, &episode, &mut || !stop.load(Ordering::Relaxed))? {
            break;
        }
        n += 1;
        bar.set_position(n);
    }
    bar.finish_and_clear();
    if n == 0 {
        return Ok(stopped_without_result());
    }
    let n_samples = writer.finish()?;
    let episodes = counted(n as usize, "episode");
    let text = format!("{}: {episodes}, {}\n", quoted_path(out), counted(n_samples, "sample"));
    let json = json!({
        "out": json_path(out), "episodes": n, "samples": n_samples, "damaged_traces": n_cut,
    });
    print_result(format, &json, &text)?;
    if (n as usize) < traces.len() {
        print_error("stopped; the folder holds a valid data set of fewer episodes");
        return Ok(ExitStatus::Interrupted);
    }
    if n_cut > 0 {
        print_error(&format!("left out {} (cut off or damaged)", counted(n_cut, "trace")));
    }
    Ok(ExitStatus::from_findings(n_cut > 0))
}

/// Traces selected for export.
struct SelectedTraces {
    traces: Vec<PathBuf>,
    /// Number of traces that are excluded because they are cut off or damaged.
    n_cut: usize,
    /// Helpers, tasks and agents of all traces of the run.
    contents: TraceContents,
}

/// Helpers, tasks and agents of traces.
#[derive(Default)]
struct TraceContents {
    helpers: BTreeSet<String>,
    tasks: BTreeSet<&'static str>,
    agents: BTreeSet<&'static str>,
}

impl TraceContents {
    fn add(&mut self, header: &Header) {
        self.helpers.insert(header.helper.clone());
        self.tasks.insert(header.task.name());
        self.agents.extend(header.people.iter().map(|person| person.agent.role_name()));
    }
}

/// Returns an error message that describes which traces a run has instead of the requested ones.
fn nothing_selected(
    arguments: &LeRobotArguments,
    n_cut: usize,
    contents: &TraceContents,
) -> String {
    let LeRobotArguments { agent, helper, task, .. } = arguments;
    let TraceContents { helpers, tasks, agents } = contents;
    if n_cut > 0 {
        let cut = counted(n_cut, "trace");
        return format!("no such trace that is whole; {cut} cut off or damaged");
    }
    if helpers.is_empty() {
        return "no trace".to_owned();
    }
    let helper = helper.as_ref().map_or(String::new(), |helper| format!(" with helper {helper}"));
    let task = task.map_or(String::new(), |task| format!(" in {task}"));
    let helpers: Vec<&str> = helpers.iter().map(String::as_str).collect();
    let list = |names: &BTreeSet<&str>| names.iter().copied().collect::<Vec<_>>().join(", ");
    format!(
        "no trace of the agent {agent}{helper}{task}; its traces have helpers: {}; tasks: {}; \
         agents: {}",
        helpers.join(", "),
        list(tasks),
        list(agents)
    )
}

/// Selects and verifies the traces to export, before anything is written. Fails on an altered trace.
fn select(
    arguments: &LeRobotArguments,
    folder: &RunFolder,
    options: &RunOptions,
) -> Result<SelectedTraces> {
    let LeRobotArguments { run, agent, helper, task, .. } = arguments;
    let helpers = RecordedHelpers::new(run, options)?;
    let mut selected =
        SelectedTraces { traces: Vec::new(), n_cut: 0, contents: TraceContents::default() };
    let (traces, left_out) = traces_of_plan(folder, options)?;
    left_out.iter().for_each(|warning| print_warning(warning));
    for path in traces {
        let (trace, warnings) = folder.read_trace(&path)?;
        selected.contents.add(&trace.header);
        let is_wanted = helper.as_ref().is_none_or(|h| *h == trace.header.helper)
            && task.is_none_or(|t| t == trace.header.task)
            && trace.header.people.iter().any(|p| p.agent == *agent);
        if !is_wanted {
            continue;
        }
        for warning in &warnings {
            print_warning(&warning.to_string());
        }
        if !warnings.is_empty() {
            selected.n_cut += 1;
            continue;
        }
        if let Some(difference) = verify_trace(folder, options, &helpers.registry(), &trace, &path)?
        {
            bail!("a trace was altered, so nothing is exported: {difference}");
        }
        selected.traces.push(path);
    }
    Ok(selected)
}
