//! Comparison of two runs by their episodes.

use std::collections::BTreeSet;

use chaic_core::TaskId;
use chaic_env::RunKey;

use super::folder::RunFolder;
use super::options::{FILES, RunOptions};
use crate::error::{EvalError, Result};
use crate::metrics::RunResult;

/// A run that is compared with another one.
#[derive(Clone, Copy, Debug)]
pub struct ComparedRun<'a> {
    /// Folder of the run.
    pub folder: &'a RunFolder,
    /// Options of the run.
    pub options: &'a RunOptions,
    /// Results of the run.
    pub results: &'a [RunResult],
}

/// Checks that episodes with the same task and id are the same in both runs. Only runs of episode
/// files can have others.
///
/// # Errors
/// [`EvalError::Options`] with the first episode that differs; if an episode can't be read.
pub fn check_same_episodes(a: ComparedRun<'_>, b: ComparedRun<'_>) -> Result<()> {
    if [a, b].iter().all(|run| run.options.split != FILES) {
        return Ok(());
    }
    let name = |result: &RunResult| (result.key.task, result.key.episode.clone());
    let names_of_b: BTreeSet<(TaskId, String)> = b.results.iter().map(name).collect();
    let mut common: BTreeSet<(TaskId, String)> = a.results.iter().map(name).collect();
    common.retain(|name| names_of_b.contains(name));
    for (task, episode) in common {
        let key = RunKey { task, helper: String::new(), episode, seed: 0 };
        let [in_a, in_b] = [a, b].map(|run| run.folder.episode(run.options, &key));
        if in_a?.setup() != in_b?.setup() {
            return Err(EvalError::Options(format!(
                "{} and {} have different episodes with the name {}; compare runs of the same episode \
                 files",
                a.folder.path().display(),
                b.folder.path().display(),
                key.episode,
            )));
        }
    }
    Ok(())
}
