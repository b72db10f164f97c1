//! `chaic export`.

use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use chaic_eval::run::RunFolder;
use chaic_eval::{EvalError, trace_file};
use chaic_export::lerobot::{LeRobotOptions, LeRobotWriter};

use super::bars;
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
    let LeRobotArguments { run, out, agent, helper, task, every, image_size } = arguments;
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let mut traces = Vec::new();
    for path in folder.traces()? {
        let (trace, warnings) = trace_file::read(&path)?;
        let is_wanted = helper.as_ref().is_none_or(|h| *h == trace.header.helper)
            && task.is_none_or(|t| t == trace.header.task)
            && trace.header.people.iter().any(|p| p.agent == *agent);
        if !is_wanted {
            continue;
        }
        for warning in warnings {
            complain(&format!("warning: {warning}"));
        }
        traces.push(path);
    }
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
        let (trace, _) = trace_file::read(path)?;
        let episode = folder.episode(&trace.header.key())?;
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
    Ok(Ended::Well)
}
