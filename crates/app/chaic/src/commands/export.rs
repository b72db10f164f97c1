//! `chaic export`.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use chaic_env::minds::{Helpers, Seeing};
use chaic_eval::EvalError;
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::verify::verify_trace;
use chaic_export::lerobot::{LeRobotOptions, LeRobotWriter};
use chaic_llm::Language;

use super::{bars, llm, sight};
use crate::arguments::{ExportCommand, LeRobotArguments};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, counted, quoted_path, say};

/// Exports.
pub fn export(command: &ExportCommand) -> Result<Ended> {
    match command {
        ExportCommand::Lerobot(arguments) => lerobot(arguments),
    }
}

fn lerobot(arguments: &LeRobotArguments) -> Result<Ended> {
    let LeRobotArguments { run, out, agent, every, image_size, .. } = arguments;
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let Selected { traces, n_cut } = select(arguments, &folder, &options)?;
    if traces.is_empty() {
        bail!("{} has no such episodes", folder.path().display());
    }
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let wanted = LeRobotOptions { agent: *agent, every: *every, image_size: *image_size };
    let mut writer = LeRobotWriter::create(out, wanted)?;
    let bar = bars::plain(traces.len() as u64, "episodes");
    let mut n = 0;
    for path in &traces {
        // One at a time: traces of a large run don't fit into memory together.
        let (trace, _) = folder.read_trace(path)?;
        let episode = folder.episode(&options, &trace.header.key())?;
        if !writer.add(&trace, &episode, &mut || !stop.load(Ordering::Relaxed))? {
            break;
        }
        n += 1;
        bar.set_position(n);
    }
    bar.finish_and_clear();
    let n_frames = writer.finish()?;
    let episodes = counted(n as usize, "episode");
    say(&format!("{}: {episodes}, {}\n", quoted_path(out), counted(n_frames, "moment")))?;
    if (n as usize) < traces.len() {
        complain("stopped; what is there is a whole data set of fewer episodes");
        return Ok(Ended::Interrupted);
    }
    if n_cut > 0 {
        complain(&format!("left out {} (cut off or damaged)", counted(n_cut, "trace")));
        return Ok(Ended::WithFindings);
    }
    Ok(Ended::Well)
}

/// Traces selected for export.
struct Selected {
    traces: Vec<PathBuf>,
    /// Number of traces left out because they are cut off or damaged.
    n_cut: usize,
}

/// Selects and verifies the traces to export, before anything is written. Fails on an altered trace.
fn select(
    arguments: &LeRobotArguments,
    folder: &RunFolder,
    options: &RunOptions,
) -> Result<Selected> {
    let LeRobotArguments { run, agent, helper, task, .. } = arguments;
    let seeing = Seeing { sight: sight::recorded(options) };
    let language = Language::recorded(run, llm::never())?;
    let language = language.map(|language| language.with_sight(Arc::clone(&seeing.sight)));
    let helpers = language.as_ref().map_or(&seeing as &dyn Helpers, |l| l);
    let mut selected = Selected { traces: Vec::new(), n_cut: 0 };
    for path in folder.traces()? {
        let (trace, warnings) = folder.read_trace(&path)?;
        let is_wanted = helper.as_ref().is_none_or(|h| *h == trace.header.helper)
            && task.is_none_or(|t| t == trace.header.task)
            && trace.header.people.iter().any(|p| p.agent == *agent);
        if !is_wanted {
            continue;
        }
        for warning in &warnings {
            complain(&format!("warning: {warning}"));
        }
        if !warnings.is_empty() {
            selected.n_cut += 1;
            continue;
        }
        if let Some(difference) = verify_trace(folder, options, helpers, &trace, &path)? {
            bail!("a trace was altered, so nothing is exported: {difference}");
        }
        selected.traces.push(path);
    }
    Ok(selected)
}
