//! Runs of whole benchmarks: plan, run folder, journal and worker threads.
//!
//! A run folder holds `run.json` (the options), `results.jsonl` (one line per finished episode
//! run), `traces/`, copies of episode files in `episodes/`, and the report after the run is
//! finished. `docs/reference/trace.md` describes these files.

mod comparison;
mod environment;
mod estimate;
mod folder;
mod granted;
mod helper_files;
mod journal;
mod options;
mod plan;
mod planned_traces;
mod shard;
mod unique_names;
mod worker;

pub use crate::episode_file::tasks_of_files;
pub use comparison::{ComparedRun, check_same_episodes};
pub use folder::{FolderMode, RunFolder};
pub(crate) use folder::{PARTNERS_FILE, has_partners};
pub use granted::RunGrants;
pub use helper_files::{HelperFiles, file_digests};
pub(crate) use journal::read_journal;
pub use journal::{Journal, read_results};
pub(crate) use options::FILES;
pub use options::{MAX_IMAGE_SIZE, MIN_IMAGE_SIZE, RunOptions, RunRequest};
pub use plan::{EpisodeJob, environments, planned};
pub use planned_traces::{misplaced_trace, planned_traces, visit_planned_traces};
pub(crate) use shard::reopen_merged;
pub use shard::{Shard, merge};
pub use worker::{FinishedJob, JobEvent};

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_env::RunKey;
use chaic_env::helper_registry::{HelperRegistry, NONE};
use chaic_env::trace::TraceWarning;
use chaic_episodes::Episode;

use crate::error::{EvalError, Result};
use crate::metrics::{RunResult, RunStatus};
use crate::run::folder::EPISODES;

/// A run with exclusive write access to its folder.
#[derive(Debug)]
pub struct Run {
    folder: RunFolder,
    options: RunOptions,
    granted: RunGrants,
    journal: Journal,
    planned: Vec<EpisodeJob>,
    results: Vec<RunResult>,
    /// Finished results whose traces are missing. Their episode runs count as missing and are
    /// played again; their lines stay in the journal until then.
    untraced: Vec<RunResult>,
}

/// Progress of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunProgress {
    /// Number of planned episode runs.
    pub total: usize,
    /// Number of finished episode runs, including failed ones.
    pub finished: usize,
    /// Number of failed episode runs.
    pub errors: usize,
}

impl Run {
    /// Starts a run in an empty or new folder, or resumes the run in the folder.
    ///
    /// # Errors
    /// If the folder is in use, is not empty without `--resume`, or holds a run with other options;
    /// if the options name unknown helpers or no episodes.
    pub fn open(
        path: &Path,
        access: FolderMode,
        request: &RunRequest,
        helpers: &dyn HelperRegistry,
    ) -> Result<(Run, Vec<TraceWarning>)> {
        // The options are checked before anything is written.
        let is_resumed = access == FolderMode::Resume && RunFolder::is_run(path);
        let new_run =
            if is_resumed { None } else { Some(NewRun::prepare(path, request, helpers)?) };
        let (folder, recorded) = RunFolder::lock(path, access)?;
        let (options, granted, planned) = match (recorded, new_run) {
            (Some(recorded), _) => resume(&folder, &recorded, request, helpers)?,
            (None, Some(new_run)) => new_run.write(&folder, helpers)?,
            // The run was removed between the check above and the lock.
            (None, None) => return Err(EvalError::NotARun { path: path.to_owned() }),
        };
        let (mut journal, results, warnings) = Journal::open(&folder.results(), &planned)?;
        journal.compact(&results)?;
        let is_traced =
            |r: &RunResult| !options.traces || r.summary().is_none() || folder.has_trace(&r.key);
        let (results, untraced) = results.into_iter().partition(is_traced);
        Ok((Run { folder, options, granted, journal, planned, results, untraced }, warnings))
    }

    /// Checks that a new run can be opened in a folder with these options, and writes nothing.
    ///
    /// # Errors
    /// If the options are invalid, or name unknown agents or no episodes.
    pub fn check(path: &Path, request: &RunRequest, helpers: &dyn HelperRegistry) -> Result<()> {
        NewRun::prepare(path, request, helpers).map(drop)
    }

    /// Returns a one-line note about finished episode runs that are played again because their
    /// traces are missing; `None` if there are none.
    pub fn untraced_note(&self) -> Option<String> {
        let RunKey { helper, episode, seed, .. } = &self.untraced.first()?.key;
        Some(format!(
            "traces of {} of {} finished episode runs are missing; they are played again, first {episode} \
             with {helper} and seed {seed}",
            self.untraced.len(),
            self.untraced.len() + self.results.iter().filter(|r| r.summary().is_some()).count(),
        ))
    }

    /// Returns the run's folder.
    pub fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// Returns the options of the run.
    pub fn options(&self) -> &RunOptions {
        &self.options
    }

    /// Returns the grants of the agents.
    pub fn granted(&self) -> &RunGrants {
        &self.granted
    }

    /// Returns the results so far.
    pub fn results(&self) -> &[RunResult] {
        &self.results
    }

    /// Returns all planned episode runs, finished or not.
    pub fn planned(&self) -> &[EpisodeJob] {
        &self.planned
    }

    /// Returns the progress.
    pub fn progress(&self) -> RunProgress {
        let errors =
            self.results.iter().filter(|r| matches!(r.status, RunStatus::Error { .. })).count();
        RunProgress { total: self.planned.len(), finished: self.results.len(), errors }
    }

    /// Checks that this program gives the results of the program that started the run. Plays one
    /// finished episode run of each helper again, of different tasks if possible, and compares the
    /// results. Skips helpers that query language models, and writes nothing.
    ///
    /// # Errors
    /// [`EvalError::OtherBuild`] if a result differs; if an episode can't be read.
    pub fn check_build(&self, helpers: &dyn HelperRegistry, stop: &AtomicBool) -> Result<()> {
        let options = RunOptions { traces: false, ..self.options.clone() };
        let pool = worker::WorkerPool { folder: &self.folder, options: &options, helpers, stop };
        let mut finished: Vec<&RunResult> =
            self.results.iter().filter(|r| r.summary().is_some()).collect();
        finished.sort_by(|a, b| a.key.cmp(&b.key));
        let names = &self.options.helpers;
        for (k, name) in names.iter().enumerate() {
            let helper_results: Vec<&RunResult> =
                finished.iter().copied().filter(|r| r.key.helper == *name).collect();
            let Some(recorded) = helper_results.get(k * helper_results.len() / names.len()) else {
                continue;
            };
            // There is no result if the caller stops it.
            let repeated = if pool.waits(&recorded.key) {
                None
            } else {
                pool.play_one(&recorded.key, &mut |_| ())?
            };
            if repeated.is_some_and(|repeated| repeated != **recorded) {
                let (path, key) = (self.folder.path().to_owned(), recorded.key.clone());
                return Err(EvalError::OtherBuild { path, key });
            }
        }
        Ok(())
    }

    /// Plays all missing episode runs, see [`Run::play_shard`].
    ///
    /// # Errors
    /// As [`Run::play_shard`].
    pub fn play(
        &mut self,
        jobs: usize,
        helpers: &dyn HelperRegistry,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(&JobEvent),
    ) -> Result<bool> {
        self.play_shard(Shard::WHOLE, jobs, helpers, stop, progress)
    }

    /// Plays the missing and failed episode runs of a shard on `jobs` threads. Uses extra threads
    /// for helpers that [wait for remote services](HelperRegistry::is_slow). Calls `progress` for
    /// each event in the calling thread.
    ///
    /// Returns true if all episode runs were played, false if `stop` was raised.
    ///
    /// # Errors
    /// If a file can't be read or written. Episode runs that were finished before are kept.
    pub fn play_shard(
        &mut self,
        shard: Shard,
        jobs: usize,
        helpers: &dyn HelperRegistry,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(&JobEvent),
    ) -> Result<bool> {
        let is_done = |r: &&RunResult| r.summary().is_some();
        let done: BTreeSet<&RunKey> = self.results.iter().filter(is_done).map(|r| &r.key).collect();
        let n_helpers = self.options.helpers.len();
        let shard_jobs =
            self.planned.iter().enumerate().filter(|(k, _)| shard.contains(*k, n_helpers));
        let missing: Vec<EpisodeJob> = shard_jobs
            .map(|(_, job)| job)
            .filter(|job| !done.contains(&job.key))
            .cloned()
            .collect();
        // The memory of a long run stays constant: its results are read from the journal at the end.
        self.results = Vec::new();
        let (journal, untraced) = (&mut self.journal, &mut self.untraced);
        let pool =
            worker::WorkerPool { folder: &self.folder, options: &self.options, helpers, stop };
        let played = pool.play(&missing, jobs.max(1), progress, &mut |result| {
            if untraced.iter().any(|r| r.key == result.key) {
                journal.mark_duplicate();
            }
            journal.append(result)?;
            untraced.retain(|r| r.key != result.key);
            Ok(())
        });
        let is_read = self.read_results();
        let is_finished = played?;
        is_read.map(|()| is_finished)
    }

    /// Reads the results from the journal, and removes replaced ones from it.
    fn read_results(&mut self) -> Result<()> {
        let (results, _) = read_results(&self.folder.results(), &self.planned)?;
        self.journal.compact(&results)?;
        let untraced: BTreeSet<&RunKey> = self.untraced.iter().map(|r| &r.key).collect();
        self.results = results.into_iter().filter(|r| !untraced.contains(&r.key)).collect();
        Ok(())
    }
}

/// Options, grants and planned episode runs of an opened run.
type Opened = (RunOptions, RunGrants, Vec<EpisodeJob>);

/// A run before its folder is written.
struct NewRun {
    options: RunOptions,
    planned: Vec<EpisodeJob>,
    /// Episodes from files; `None` if the episodes are from a split.
    episodes: Option<Vec<Episode>>,
    /// Files of the commands of its helpers.
    files: HelperFiles,
}

impl NewRun {
    fn prepare(path: &Path, request: &RunRequest, helpers: &dyn HelperRegistry) -> Result<NewRun> {
        // A run may clear its folder for copies, so that folder can't be the user's source.
        let copies = fs::canonicalize(path.join(EPISODES)).ok();
        let source = request.episodes.as_ref().and_then(|s| fs::canonicalize(s).ok());
        if copies.is_some() && copies == source {
            return Err(EvalError::NotEmpty { path: path.to_owned() });
        }
        let options = request.new_options()?;
        check_options(&options, helpers)?;
        let source = request.episodes.as_ref();
        let episodes = source.map(|s| plan::read_source(s, &options)).transpose()?;
        let planned = plan::plan(&options, episodes.as_deref().unwrap_or_default())?;
        if episodes.is_none() && options.person.is_some() {
            plan::check_partner(&planned)?;
        }
        if let Some(name) = &options.partner
            && let Some(playable) = helpers.partner_episodes(name)
        {
            plan::check_recorded(&planned, episodes.as_deref(), &playable)?;
        }
        let mut files = request.helper_files.clone();
        files.retain(|helper, files| options.helpers.contains(helper) && !files.is_empty());
        Ok(NewRun { options, planned, episodes, files })
    }

    /// Writes the files that a run needs, and `run.json` last. A folder without it holds no run,
    /// and the next start removes its files.
    fn write(self, folder: &RunFolder, helpers: &dyn HelperRegistry) -> Result<Opened> {
        if let Some(episodes) = &self.episodes {
            plan::copy_episodes(episodes, folder)?;
        }
        helpers.attach_run(folder.path())?;
        let granted = RunGrants::new(&self.options, helpers)?;
        let images = granted.requested_images(&self.options, helpers)?;
        folder.write_options(&self.options, &granted, images, self.files)?;
        Ok((self.options, granted, self.planned))
    }
}

fn resume(
    folder: &RunFolder,
    recorded: &RunOptions,
    request: &RunRequest,
    helpers: &dyn HelperRegistry,
) -> Result<Opened> {
    let options = request.resumed_options(recorded, folder.path())?;
    check_options(&options, helpers)?;
    if let Some(source) = &request.episodes {
        plan::check_episode_files(source, &options, folder)?;
    }
    let planned = plan::planned(folder, &options)?;
    let granted = RunGrants::new(&options, helpers)?;
    folder.check_grants(&granted)?;
    folder.check_images(granted.requested_images(&options, helpers)?.as_ref())?;
    folder.check_helper_files(&request.helper_files)?;
    helpers.attach_run(folder.path())?;
    Ok((options, granted, planned))
}

/// Checks that helpers and partner exist, that the track allows them, and that every helper can play every
/// task.
fn check_options(options: &RunOptions, helpers: &dyn HelperRegistry) -> Result<()> {
    RunGrants::new(options, helpers)?;
    for helper in &options.helpers {
        for task in &options.tasks {
            helpers.check_task(helper, *task).map_err(EvalError::Options)?;
        }
    }
    Ok(())
}

/// Returns the names that `--helper` accepts.
pub fn helper_names(helpers: &dyn HelperRegistry) -> Vec<String> {
    std::iter::once(NONE.to_owned()).chain(helpers.names()).collect()
}

#[cfg(test)]
mod tests;
