//! Whole benchmarks: what is played, in which folder, by how many workers.
//!
//! A run folder holds `run.json` (what is played), `results.jsonl` (a line for each finished
//! episode run), `traces/`, copies of episode files in `episodes/`, and, once finished, the
//! report. `docs/reference/trace.md` describes them.

mod environment;
mod estimate;
mod folder;
mod granted;
mod items;
mod journal;
mod options;
mod shard;
mod unique_names;
mod worker;

pub use environment::environments;
pub use folder::{Access, RunFolder};
pub use granted::RunGrants;
pub use items::{Item, planned, tasks_of_files};
pub(crate) use journal::read_journal;
pub use journal::{Journal, read_results};
pub(crate) use options::FILES;
pub use options::{MAX_IMAGE_SIZE, MIN_IMAGE_SIZE, RunOptions, RunRequest};
pub use shard::{Shard, merge};
pub use worker::{Finished, Progress};

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_env::RunKey;
use chaic_env::minds::{Helpers, NONE};
use chaic_env::trace::Warning;
use chaic_episodes::Episode;

use crate::error::{EvalError, Result};
use crate::metrics::{Ending, RunResult};
use crate::run::folder::EPISODES;

/// A run with its folder, which nobody else writes to as long as this exists.
#[derive(Debug)]
pub struct Run {
    folder: RunFolder,
    options: RunOptions,
    granted: RunGrants,
    journal: Journal,
    items: Vec<Item>,
    results: Vec<RunResult>,
    /// Finished results whose traces are missing. Their episode runs count as missing and are played again;
    /// their lines stay in the journal until then.
    untraced: Vec<RunResult>,
}

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Episode runs in all.
    pub total: usize,
    /// Of these, finished ones.
    pub finished: usize,
    /// Of the finished ones, those that broke down.
    pub errors: usize,
}

impl Run {
    /// Begins a run in an empty or new folder, or goes on with the one that is there.
    ///
    /// # Errors
    /// If the folder is in use, isn't empty (`resume` not given), or holds a run with other
    /// options; if options name unknown helpers or no episodes.
    pub fn open(
        path: &Path,
        access: Access,
        given: &RunRequest,
        helpers: &dyn Helpers,
    ) -> Result<(Run, Vec<Warning>)> {
        // What is asked for is checked before anything is written.
        let is_resumed = access == Access::Resume && RunFolder::is_run(path);
        let fresh = if is_resumed { None } else { Some(Fresh::of(path, given, helpers)?) };
        let (folder, recorded) = RunFolder::lock(path, access)?;
        let (options, granted, items) = match (recorded, fresh) {
            (Some(recorded), _) => resume(&folder, &recorded, given, helpers)?,
            (None, Some(fresh)) => fresh.begin(&folder, helpers)?,
            // It was removed between the first look and the lock.
            (None, None) => return Err(EvalError::NotARun { path: path.to_owned() }),
        };
        let (mut journal, results, warnings) = Journal::open(&folder.results(), &items)?;
        journal.compact(results.iter())?;
        let is_traced =
            |r: &RunResult| !options.traces || r.summary().is_none() || folder.has_trace(&r.key);
        let (results, untraced) = results.into_iter().partition(is_traced);
        Ok((Run { folder, options, granted, journal, items, results, untraced }, warnings))
    }

    /// Returns a one-line note about finished episode runs that are played again because their traces are
    /// missing; `None` if there are none.
    pub fn untraced_note(&self) -> Option<String> {
        let RunKey { helper, episode, seed, .. } = &self.untraced.first()?.key;
        Some(format!(
            "traces of {} of {} finished episode runs are missing; they are played again, first {episode} \
             with {helper} and seed {seed}",
            self.untraced.len(),
            self.untraced.len() + self.results.iter().filter(|r| r.summary().is_some()).count(),
        ))
    }

    /// The folder.
    pub fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// What is played.
    pub fn options(&self) -> &RunOptions {
        &self.options
    }

    /// What everybody is granted.
    pub fn granted(&self) -> &RunGrants {
        &self.granted
    }

    /// The results so far.
    pub fn results(&self) -> &[RunResult] {
        &self.results
    }

    /// All episode runs that it consists of, finished or not.
    pub fn planned(&self) -> &[Item] {
        &self.items
    }

    /// How far it has come.
    pub fn extent(&self) -> Extent {
        let errors =
            self.results.iter().filter(|r| matches!(r.ending, Ending::Error { .. })).count();
        Extent { total: self.items.len(), finished: self.results.len(), errors }
    }

    /// Whether this program plays as the one that began the run, whatever its version says: plays one
    /// finished episode run of each helper again, of different tasks where there are, and compares
    /// the results. Nothing is written, and language models aren't asked.
    ///
    /// # Errors
    /// [`EvalError::OtherCode`] if one comes out otherwise; if an episode can't be read.
    pub fn check_code(&self, helpers: &dyn Helpers, stop: &AtomicBool) -> Result<()> {
        let options = RunOptions { traces: false, ..self.options.clone() };
        let crew = worker::Crew { folder: &self.folder, options: &options, helpers, stop };
        let mut finished: Vec<&RunResult> =
            self.results.iter().filter(|r| r.summary().is_some()).collect();
        finished.sort_by(|a, b| a.key.cmp(&b.key));
        let names = &self.options.helpers;
        for (k, name) in names.iter().enumerate() {
            let of_helper: Vec<&RunResult> =
                finished.iter().copied().filter(|r| r.key.helper == *name).collect();
            let Some(then) = of_helper.get(k * of_helper.len() / names.len()) else { continue };
            // Nothing comes out if the caller stops it.
            let now =
                if crew.waits(&then.key) { None } else { crew.play_one(&then.key, &mut |_| ())? };
            if now.is_some_and(|now| now != **then) {
                let (path, key) = (self.folder.path().to_owned(), then.key.clone());
                return Err(EvalError::OtherCode { path, key });
            }
        }
        Ok(())
    }

    /// Plays all that is missing, see [`Run::play_shard`].
    ///
    /// # Errors
    /// As [`Run::play_shard`].
    pub fn play(
        &mut self,
        jobs: usize,
        helpers: &dyn Helpers,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(&Progress),
    ) -> Result<bool> {
        self.play_shard(Shard::WHOLE, jobs, helpers, stop, progress)
    }

    /// Plays what is missing in a shard, and again what broke down, on `jobs` threads, and on some more what
    /// [waits](Helpers::waits). `progress` hears of everything in the calling thread.
    ///
    /// Returns whether all has been played; otherwise `stop` was raised.
    ///
    /// # Errors
    /// If a file can't be read or written. What was finished before is kept.
    pub fn play_shard(
        &mut self,
        shard: Shard,
        jobs: usize,
        helpers: &dyn Helpers,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(&Progress),
    ) -> Result<bool> {
        let is_done = |r: &&RunResult| r.summary().is_some();
        let done: BTreeSet<&RunKey> = self.results.iter().filter(is_done).map(|r| &r.key).collect();
        let of_shard = self.items.iter().enumerate().filter(|(k, _)| shard.has(*k));
        let missing: Vec<Item> =
            of_shard.map(|(_, item)| item).filter(|i| !done.contains(&i.key)).cloned().collect();
        let (journal, results) = (&mut self.journal, &mut self.results);
        let untraced = &mut self.untraced;
        let crew = worker::Crew { folder: &self.folder, options: &self.options, helpers, stop };
        let played = crew.play(&missing, jobs.max(1), progress, &mut |result| {
            if untraced.iter().any(|r| r.key == result.key) {
                journal.expect_repetition();
            }
            journal.append(result)?;
            untraced.retain(|r| r.key != result.key);
            results.retain(|r| r.key != result.key);
            results.push(result.clone());
            Ok(())
        });
        self.journal.compact(self.results.iter().chain(&self.untraced))?;
        played
    }
}

/// What a run plays, what it grants, and its episode runs.
type Opened = (RunOptions, RunGrants, Vec<Item>);

/// A run that is not begun yet.
struct Fresh {
    options: RunOptions,
    items: Vec<Item>,
    /// Episodes from files; `None` where they are of a split.
    own: Option<Vec<Episode>>,
}

impl Fresh {
    fn of(path: &Path, given: &RunRequest, helpers: &dyn Helpers) -> Result<Fresh> {
        // What lies in the run's own place for copies may be removed; a user's files never are.
        let place = fs::canonicalize(path.join(EPISODES)).ok();
        let source = given.episodes.as_ref().and_then(|s| fs::canonicalize(s).ok());
        if place.is_some() && place == source {
            return Err(EvalError::NotEmpty { path: path.to_owned() });
        }
        let options = given.begin()?;
        check(&options, helpers)?;
        let source = given.episodes.as_ref();
        let own = source.map(|s| items::read_source(s, &options)).transpose()?;
        let items = items::plan(&options, own.as_deref().unwrap_or_default())?;
        if own.is_none() && options.partner_is.is_some() {
            items::check_partner(&items)?;
        }
        Ok(Fresh { options, items, own })
    }

    /// Writes all that a run needs, and `run.json` last: until then the folder holds no run, and
    /// the next beginning removes what is there.
    fn begin(self, folder: &RunFolder, helpers: &dyn Helpers) -> Result<Opened> {
        if let Some(own) = &self.own {
            items::copy_episodes(own, folder)?;
        }
        helpers.attach(folder.path())?;
        let granted = RunGrants::of(&self.options, helpers)?;
        folder.write_options(&self.options, &granted)?;
        Ok((self.options, granted, self.items))
    }
}

fn resume(
    folder: &RunFolder,
    recorded: &RunOptions,
    given: &RunRequest,
    helpers: &dyn Helpers,
) -> Result<Opened> {
    let options = given.resume(recorded, folder.path())?;
    check(&options, helpers)?;
    if let Some(source) = &given.episodes {
        items::check_episode_files(source, &options, folder)?;
    }
    let items = planned(folder, &options)?;
    let granted = RunGrants::of(&options, helpers)?;
    folder.check_grants(&granted)?;
    helpers.attach(folder.path())?;
    Ok((options, granted, items))
}

fn check(options: &RunOptions, helpers: &dyn Helpers) -> Result<()> {
    RunGrants::of(options, helpers).map(drop)
}

/// The names that may stand behind `--helper`.
pub fn helper_names(helpers: &dyn Helpers) -> Vec<String> {
    std::iter::once(NONE.to_owned()).chain(helpers.names()).collect()
}

#[cfg(test)]
mod tests;
