//! Traces of the episode runs that a run plays.

use std::collections::BTreeSet;
use std::path::PathBuf;

use chaic_env::RunKey;
use chaic_env::trace::Trace;

use super::{EpisodeJob, RunFolder};
use crate::error::Result;

/// Calls `visit` with each trace of a planned episode run, in the order of their paths. Leaves out traces
/// that the run does not play, and those of another episode run than their name says. An empty plan is
/// unknown: all episode runs count as planned.
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
    let paths: BTreeSet<PathBuf> = planned.iter().map(|job| folder.trace(&job.key)).collect();
    let mut warnings = Vec::new();
    for path in folder.traces()? {
        let shown = path.display();
        if !paths.is_empty() && !paths.contains(&path) {
            warnings.push(format!(
                "{shown}: this run doesn't play that episode run, so its trace is left out"
            ));
            continue;
        }
        let (trace, found) = folder.read_trace(&path)?;
        warnings.extend(found.iter().map(ToString::to_string));
        let key = trace.header.key();
        if folder.trace(&key) != path {
            let RunKey { helper, episode, seed, .. } = key;
            warnings.push(format!(
                "{shown}: it is the trace of {episode} with {helper} and seed {seed}, so it is left out"
            ));
            continue;
        }
        visit(&trace)?;
    }
    Ok(warnings)
}
