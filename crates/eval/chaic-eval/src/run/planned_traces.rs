//! Traces of the episode runs that a run plays.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use chaic_env::RunKey;
use chaic_env::trace::Trace;

use super::{EpisodeJob, RunFolder};
use crate::error::Result;

/// Returns the paths of the traces of planned episode runs, sorted, and a warning for each trace that the
/// run does not play, such as a copy. An empty plan is unknown: all episode runs count as planned.
///
/// # Errors
/// If a folder can't be read.
pub fn planned_traces(
    folder: &RunFolder,
    planned: &[EpisodeJob],
) -> Result<(Vec<PathBuf>, Vec<String>)> {
    let paths: BTreeSet<PathBuf> = planned.iter().map(|job| folder.trace(&job.key)).collect();
    let is_planned = |path: &PathBuf| paths.is_empty() || paths.contains(path);
    let (kept, left_out): (Vec<PathBuf>, Vec<PathBuf>) =
        folder.traces()?.into_iter().partition(is_planned);
    let warning = |path: &PathBuf| {
        let shown = path.display();
        format!("{shown}: this run doesn't play that episode run, so its trace is left out")
    };
    let warnings = left_out.iter().map(warning).collect();
    Ok((kept, warnings))
}

/// Returns a warning if the trace of an episode run has the name of another one; such a trace is left out.
pub fn misplaced_trace(folder: &RunFolder, path: &Path, key: &RunKey) -> Option<String> {
    let RunKey { helper, episode, seed, .. } = key;
    (folder.trace(key) != path).then(|| {
        let shown = path.display();
        format!(
            "{shown}: it is the trace of {episode} with {helper} and seed {seed}, so it is left out"
        )
    })
}

/// Calls `visit` with each of the [`planned_traces`], except those that [are misplaced](misplaced_trace).
///
/// Returns warnings about traces that are damaged or left out.
///
/// # Errors
/// If a trace can't be read; errors of `visit`.
pub fn visit_planned_traces(
    folder: &RunFolder,
    planned: &[EpisodeJob],
    visit: &mut dyn FnMut(&Trace) -> Result<()>,
) -> Result<Vec<String>> {
    let (paths, mut warnings) = planned_traces(folder, planned)?;
    for path in paths {
        let (trace, found) = folder.read_trace(&path)?;
        warnings.extend(found.iter().map(ToString::to_string));
        match misplaced_trace(folder, &path, &trace.header.key()) {
            Some(warning) => warnings.push(warning),
            None => visit(&trace)?,
        }
    }
    Ok(warnings)
}
