//! `chaic replay`.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use chaic_env::minds::{BuiltIn, Helpers};
use chaic_eval::EvalError;
use chaic_eval::replay::{self, ReplayOptions};
use chaic_eval::run::RunFolder;
use chaic_eval::trace_file;
use chaic_eval::verify::verify_trace;
use chaic_llm::Language;

use super::{bars, llm};
use crate::arguments::ReplayArguments;
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, counted, say};

/// Makes a video of a recorded episode.
pub fn run(arguments: &ReplayArguments) -> Result<Ended> {
    let ReplayArguments { run, episode, out, helper, seed, fps, every } = arguments;
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let path = replay::find_trace(&folder, episode, helper.as_deref(), *seed)?;
    let (trace, warnings) = trace_file::read(&path)?;
    for warning in warnings {
        complain(&format!("warning: {warning}"));
    }
    let language = Language::recorded(run, llm::never())?;
    let helpers = language.as_ref().map_or(&BuiltIn as &dyn Helpers, |l| l);
    if let Some(difference) = verify_trace(&folder, &options, helpers, &trace, &path)? {
        bail!("the trace was altered, so no video is made: {difference}");
    }
    let key = trace.header.key();
    let episode = folder.episode(&key)?;
    let bar = bars::plain(trace.end().map_or(0, |e| u64::from(e.frame)), "frames");
    let video = ReplayOptions { fps: *fps, every: *every };
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let mut progress = |frame| {
        bar.set_position(u64::from(frame));
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let pictures = replay::write(&trace, &episode, video, out, &mut progress);
    bar.finish_and_clear();
    let Some(pictures) = pictures? else {
        complain(&format!("stopped; {} is not written", out.display()));
        return Ok(Ended::Interrupted);
    };
    say(&format!(
        "{}: {} of {} with {}\n",
        out.display(),
        counted(pictures as usize, "picture"),
        key.episode,
        key.helper
    ))?;
    Ok(Ended::Well)
}
