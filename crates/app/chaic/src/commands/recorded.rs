//! The helpers of a run that was played, and a verified trace of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, bail};
use chaic_env::helper_registry::{BuiltInWithPerception, HelperRegistry};
use chaic_env::trace::Trace;
use chaic_episodes::Episode;
use chaic_eval::EvalError;
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::verify::verify_trace;
use chaic_learn::helpers::PolicyRegistry;
use chaic_llm::LanguageHelpers;

use super::{llm, run_perception, traces_of_plan};
use crate::output::print_warning;

/// A trace whose records equal those of a re-simulation.
pub(super) struct RecordedEpisode {
    pub options: RunOptions,
    pub trace: Trace,
    pub episode: Episode,
    /// False if the trace is cut off or continues after its end.
    pub is_whole: bool,
}

/// Reads and verifies the trace that `find` selects among those of planned episode runs. Prints warnings about
/// a damaged trace. `result` is the consequence in the error message about an altered trace, such as `no video
/// is made`.
///
/// # Errors
/// If the folder is no run, or the trace is missing, unreadable or altered.
pub(super) fn read_recorded(
    run: &Path,
    find: impl FnOnce(&RunFolder, &[PathBuf]) -> Result<PathBuf, EvalError>,
    result: &str,
) -> Result<RecordedEpisode> {
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let (traces, _) = traces_of_plan(&folder, &options)?;
    let path = find(&folder, &traces)?;
    let (trace, warnings) = folder.read_trace(&path)?;
    for warning in &warnings {
        print_warning(&warning.to_string());
    }
    let helpers = RecordedHelpers::new(run, &options)?;
    if let Some(difference) = verify_trace(&folder, &options, &helpers.registry(), &trace, &path)? {
        bail!("the trace was altered, so {result}: {difference}");
    }
    let episode = folder.episode(&options, &trace.header.key())?;
    Ok(RecordedEpisode { options, trace, episode, is_whole: warnings.is_empty() })
}

/// Helpers of a run that was played, except helper processes and policies from files.
pub struct RecordedHelpers {
    built_in: BuiltInWithPerception,
    language: Option<LanguageHelpers>,
}

impl RecordedHelpers {
    /// Creates the helpers of a run with these options.
    ///
    /// # Errors
    /// If the records of language helpers cannot be read.
    pub fn new(run: &Path, options: &RunOptions) -> Result<RecordedHelpers> {
        let perception = run_perception::recorded_perception(options);
        let language = LanguageHelpers::recorded(run, llm::never())?;
        let language = language.map(|language| language.with_perception(Arc::clone(&perception)));
        Ok(RecordedHelpers { built_in: BuiltInWithPerception { perception }, language })
    }

    /// Returns the registry of these helpers and the bundled ones.
    pub fn registry(&self) -> PolicyRegistry<'_> {
        let fallback: &dyn HelperRegistry = match &self.language {
            Some(language) => language,
            None => &self.built_in,
        };
        PolicyRegistry::bundled(fallback, Arc::clone(&self.built_in.perception))
    }
}
