//! A verified trace of a run, for commands that show one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, bail};
use chaic_env::helper_registry::{BuiltInWithPerception, HelperRegistry};
use chaic_env::trace::Trace;
use chaic_episodes::Episode;
use chaic_eval::EvalError;
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::verify::verify_trace;
use chaic_llm::LanguageHelpers;

use super::{llm, run_perception};
use crate::output::print_warning;

/// A trace whose records equal those of a re-simulation.
pub(super) struct RecordedEpisode {
    pub options: RunOptions,
    pub trace: Trace,
    pub episode: Episode,
    /// False if the trace is cut off or continues after its end.
    pub is_whole: bool,
}

/// Reads and verifies the trace that `find` selects. Prints warnings about a damaged one.
/// `result` names the missing output if the trace was altered, such as `no video is made`.
///
/// # Errors
/// If the folder is no run, or the trace is missing, unreadable or altered.
pub(super) fn read_recorded(
    run: &Path,
    find: impl FnOnce(&RunFolder) -> Result<PathBuf, EvalError>,
    result: &str,
) -> Result<RecordedEpisode> {
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let path = find(&folder)?;
    let (trace, warnings) = folder.read_trace(&path)?;
    for warning in &warnings {
        print_warning(&warning.to_string());
    }
    let built_in =
        BuiltInWithPerception { perception: run_perception::recorded_perception(&options) };
    let language = LanguageHelpers::recorded(run, llm::never())?;
    let language =
        language.map(|language| language.with_perception(Arc::clone(&built_in.perception)));
    let helpers = language.as_ref().map_or(&built_in as &dyn HelperRegistry, |l| l);
    if let Some(difference) = verify_trace(&folder, &options, helpers, &trace, &path)? {
        bail!("the trace was altered, so {result}: {difference}");
    }
    let episode = folder.episode(&options, &trace.header.key())?;
    Ok(RecordedEpisode { options, trace, episode, is_whole: warnings.is_empty() })
}
