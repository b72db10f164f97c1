//! Planning: the episode runs of a run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use chaic_core::task::TaskOrigin;
use chaic_core::{Frame, TaskId};
use chaic_env::{Digest, RunKey, slug};
use chaic_episodes::{Episode, EpisodeError, Split, SplitError, find_episode};
use chaic_files::{create_folders_below, write_atomically};
use rayon::prelude::*;

use crate::episode_file::{
    episode_files, parse_episode_files, read_episode_file, read_episode_files,
};
use crate::error::{EvalError, Result};
use crate::metrics::Environments;
use crate::run::environment::environment;
use crate::run::folder::RunFolder;
use crate::run::options::{FILES, RunOptions};

/// One planned episode run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EpisodeJob {
    /// Task, helper, episode and seed.
    pub key: RunKey,
    /// Maximum number of frames.
    pub horizon: Frame,
    /// Name of the environment. Episodes in the same environment are not independent samples.
    pub environment: String,
}

/// Returns all episode runs of a run, finished or not, grouped by episode so that an interrupted
/// run has comparable results.
///
/// # Errors
/// If the options select no episode run, or the run's copies of episode files can't be read.
pub fn planned(folder: &RunFolder, options: &RunOptions) -> Result<Vec<EpisodeJob>> {
    let files = if options.split == FILES { read_copies(folder)? } else { vec![] };
    plan(options, &files)
}

/// Reads the run's copies of episodes, sorted by id.
fn read_copies(folder: &RunFolder) -> Result<Vec<Episode>> {
    parse_episode_files(&folder.episode_files(), &|path| folder.copy_bytes(path))
}

/// Plans a run from its options and, for the split `files`, its episodes.
///
/// # Errors
/// If a task has no episode or too many, or the plan is empty: callers take an empty plan for an
/// unknown one.
pub(super) fn plan(options: &RunOptions, files: &[Episode]) -> Result<Vec<EpisodeJob>> {
    /// Maximum number of episode runs; a longer list is a mistake and exhausts memory.
    const MAX_JOBS: usize = 1_000_000;
    let n_per_episode = options.helpers.len().saturating_mul(options.seeds as usize);
    let mut jobs = Vec::new();
    for task in &options.tasks {
        let limit = (MAX_JOBS - jobs.len()) / n_per_episode.max(1);
        let episodes = episodes(options, files, *task, limit)?;
        if episodes.is_empty() {
            let hint = match task.info().origin {
                TaskOrigin::Chaic if options.split != FILES => {
                    "; use generated ones: give --split gen:0..12"
                }
                _ => "",
            };
            let text = format!("there is no episode of {task} to play{hint}");
            return Err(EvalError::Options(text));
        }
        for EpisodePlan { id, horizon, environment } in episodes {
            for seed in 0..options.seeds {
                for helper in &options.helpers {
                    let (task, helper, episode) = (*task, helper.clone(), id.clone());
                    let key = RunKey { task, helper, episode, seed };
                    jobs.push(EpisodeJob { key, horizon, environment: environment.clone() });
                }
            }
        }
    }
    if jobs.is_empty() {
        let text = "the run plays no episode: its tasks, helpers or seeds are empty";
        return Err(EvalError::Options(text.to_owned()));
    }
    Ok(jobs)
}

/// Maximum number of episodes per task that [`check_partner`] generates; more would delay the start
/// of the run. It exceeds the size of all splits with a fixed size.
const MAX_CHECKED_PER_TASK: usize = 200;

/// Checks that the episodes can be played with the requested partner: a person may need a bicycle, or
/// not fit at the start. Later episodes of a task with more than [`MAX_CHECKED_PER_TASK`] are checked
/// when they are played.
///
/// # Errors
/// One line with the number of unplayable episodes and the problem of the first one.
pub(super) fn check_partner(jobs: &[EpisodeJob]) -> Result<()> {
    let mut by_task: BTreeMap<TaskId, Vec<&str>> = BTreeMap::new();
    for RunKey { task, episode, .. } in jobs.iter().map(|job| &job.key) {
        let ids = by_task.entry(*task).or_default();
        // The runs of one episode are consecutive.
        if ids.len() < MAX_CHECKED_PER_TASK && ids.last() != Some(&episode.as_str()) {
            ids.push(episode);
        }
    }
    let ids: Vec<&str> = by_task.into_values().flatten().collect();
    let problems: Vec<SplitError> =
        ids.par_iter().filter_map(|id| find_episode(id).err()).collect();
    let Some(first) = problems.first() else { return Ok(()) };
    let (n, n_checked) = (problems.len(), ids.len());
    Err(EvalError::Options(format!(
        "{n} of {n_checked} episodes can't be played with this partner, first {first}"
    )))
}

/// Checks that the partner has a recording of every planned episode. `playable` has the digests of the
/// setups of recorded episodes.
///
/// # Errors
/// One line that names the first episode without a recording.
pub(super) fn check_recorded(
    jobs: &[EpisodeJob],
    files: Option<&[Episode]>,
    playable: &BTreeMap<String, Digest>,
) -> Result<()> {
    let planned: BTreeSet<(TaskId, &str)> =
        jobs.iter().map(|job| (job.key.task, job.key.episode.as_str())).collect();
    for (task, id) in planned {
        let recorded = playable.get(id).ok_or_else(|| {
            let n = playable.len();
            let first = playable.keys().next().map_or("", String::as_str);
            let known =
                if n == 1 { first.to_owned() } else { format!("{n} episodes, such as {first}") };
            EvalError::Options(format!(
                "the partner has no recording of {id}; it has one of {known}"
            ))
        })?;
        let setup = match files {
            Some(files) => {
                let file = files.iter().find(|e| e.task() == task && e.id() == id);
                file.map(|e| Digest::of_setup(e.setup()))
            }
            None => Some(Digest::of_setup(find_episode(id)?.setup())),
        };
        if setup.is_some_and(|setup| setup != *recorded) {
            return Err(EvalError::Options(format!(
                "the recording of {id} is of another version of the episode; use the chaic that wrote it"
            )));
        }
    }
    Ok(())
}

/// Returns the environments of planned episodes.
pub fn environments(jobs: &[EpisodeJob]) -> Environments {
    let entry = |job: &EpisodeJob| (job.key.task, job.key.episode.clone(), job.environment.clone());
    Environments::new(jobs.iter().map(entry))
}

/// Plan of one episode.
struct EpisodePlan {
    id: String,
    horizon: Frame,
    environment: String,
}

/// Returns a task's episodes; `files` are the episodes from files. Generated episodes are created
/// when they are played, because all of them may not fit in memory.
///
/// # Errors
/// If there are more than `max` episodes.
fn episodes(
    options: &RunOptions,
    files: &[Episode],
    task: TaskId,
    max: usize,
) -> Result<Vec<EpisodePlan>> {
    let limit = options.n_episodes.map_or(usize::MAX, |n| n as usize);
    if options.split == FILES {
        let plan = |e: &Episode| {
            let (id, horizon) = (e.id().to_owned(), e.setup().horizon);
            EpisodePlan { id, horizon, environment: environment(e) }
        };
        let task_files = || files.iter().filter(|e| e.task() == task).take(limit);
        check_count(task_files().count(), max, task)?;
        return Ok(task_files().map(plan).collect());
    }
    let split: Split = options.split.parse()?;
    let horizon = task.info().horizon;
    let n = split.len_of(task).min(limit);
    check_count(n, max, task)?;
    let partner = options.person.map_or_else(String::new, |kind| format!("/{kind}"));
    let plan = |k: usize| EpisodePlan {
        id: split.episode_id(task, k) + &partner,
        horizon,
        environment: split.environment(task, k as u64),
    };
    Ok((0..n).map(plan).collect())
}

/// Fails if a task has more than `max` episodes.
fn check_count(n: usize, max: usize, task: TaskId) -> Result<()> {
    if n > max {
        let text = format!(
            "{n} episodes of {task} are too many for one run; give --n-episodes or fewer seeds"
        );
        return Err(EvalError::Options(text));
    }
    Ok(())
}

/// Checks that `source` holds the same episodes as the run's copies. With other episodes it would
/// be another run.
pub(super) fn check_episode_files(
    source: &Path,
    options: &RunOptions,
    folder: &RunFolder,
) -> Result<()> {
    if same_files(source, folder)? {
        return Ok(());
    }
    let named = read_with_partner(source, options)?;
    let copies = read_copies(folder)?;
    let different = named.iter().find(|e| !copies.contains(e));
    let Some(different) = different.or_else(|| copies.iter().find(|e| !named.contains(e))) else {
        return Ok(());
    };
    Err(EvalError::Options(format!(
        "{} was started with other episodes than --episodes {}, see {}; omit --episodes to resume \
         it, or choose another --out",
        folder.path().display(),
        source.display(),
        different.id()
    )))
}

/// Compares the episode files of a folder with those of the run byte by byte, which is faster than
/// parsing them.
fn same_files(source: &Path, folder: &RunFolder) -> Result<bool> {
    same_bytes(source, &read_episode_file, folder)
}

/// Compares names and bytes of two runs' copies of episodes.
pub(super) fn same_copies(a: &RunFolder, b: &RunFolder) -> Result<bool> {
    same_bytes(&a.episode_files(), &|path| a.copy_bytes(path), b)
}

/// Compares names and bytes of the episode files of a folder with those of the run.
fn same_bytes(
    source: &Path,
    read: &dyn Fn(&Path) -> Result<Vec<u8>>,
    folder: &RunFolder,
) -> Result<bool> {
    let (a, b) = (episode_files(source)?, episode_files(&folder.episode_files())?);
    let names = |files: &[PathBuf]| -> Vec<_> {
        files.iter().filter_map(|p| p.file_name().map(ToOwned::to_owned)).collect()
    };
    if names(&a) != names(&b) {
        return Ok(false);
    }
    for (a, b) in a.iter().zip(&b) {
        if read(a)? != folder.copy_bytes(b)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Reads the episodes of the run's tasks from a user's folder, with the run's partner.
///
/// # Errors
/// [`EvalError::Options`] if an episode can't be played with this partner.
fn read_with_partner(source: &Path, options: &RunOptions) -> Result<Vec<Episode>> {
    let episodes = read_episode_files(source)?.into_iter();
    let selected = episodes.filter(|e| options.tasks.contains(&e.task()));
    selected
        .map(|episode| match options.person {
            Some(kind) => {
                let unplayable = |error: EpisodeError| EvalError::Options(error.to_string());
                episode.with_partner(kind).map_err(unplayable)
            }
            None => Ok(episode),
        })
        .collect()
}

/// Reads the episodes of the run's tasks from a user's folder, to be copied.
///
/// # Errors
/// If an episode can't be read, a task has none, or two would be copied to the same file.
pub(super) fn read_source(source: &Path, options: &RunOptions) -> Result<Vec<Episode>> {
    let episodes = read_with_partner(source, options)?;
    let is_missing = |task: &&TaskId| !episodes.iter().any(|e| e.task() == **task);
    if let Some(task) = options.tasks.iter().find(is_missing) {
        let text = format!("{} holds no episode file (*.json) of {task}", source.display());
        return Err(EvalError::Options(text));
    }
    let mut names = BTreeSet::new();
    for episode in &episodes {
        if !names.insert((episode.task(), slug(episode.task(), episode.id()))) {
            let (id, source) = (episode.id(), source.display());
            let text = format!("{source} holds two episodes that are named like {id}; rename one");
            return Err(EvalError::Options(text));
        }
    }
    Ok(episodes)
}

/// Copies episodes into the run, which then does not depend on other folders.
pub(super) fn copy_episodes(episodes: &[Episode], folder: &RunFolder) -> Result<()> {
    create_folders_below(folder.path(), &folder.episode_files())?;
    for episode in episodes {
        let copy = folder.episode_copy(episode.task(), episode.id());
        write_atomically(&copy, episode.to_json().as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns an episode of each of two tasks; both have the same id.
    fn episodes_with_one_id() -> [Episode; 2] {
        ["low_target/test/00", "high_target/test/01"].map(|id| {
            let setup = find_episode(id).unwrap().into_setup();
            Episode::new("same", "files", None, setup).unwrap()
        })
    }

    fn jobs(episodes: &[Episode]) -> Vec<EpisodeJob> {
        let job = |episode: &Episode| {
            let (task, helper, episode_id) =
                (episode.task(), "rhp".to_owned(), episode.id().to_owned());
            let key = RunKey { task, helper, episode: episode_id, seed: 0 };
            EpisodeJob { key, horizon: 100, environment: environment(episode) }
        };
        episodes.iter().map(job).collect()
    }

    #[test]
    fn all_planned_episodes_are_checked_with_the_partner() {
        let job = |k: u32, person: &str| {
            let (task, helper) = (TaskId::HighTarget, "rhp".to_owned());
            let episode = format!("{task}/test/{k:02}/{person}");
            let key = RunKey { task, helper, episode, seed: 0 };
            EpisodeJob { key, horizon: 100, environment: String::new() }
        };
        check_partner(&[job(0, "child"), job(1, "child")]).unwrap();
        // Houses have no bicycle.
        let jobs = [job(0, "child"), job(1, "child"), job(2, "rider"), job(2, "rider")];
        let error = check_partner(&jobs).unwrap_err();
        let text = error.to_string();
        assert!(error.is_usage() && text.starts_with("1 of 3 episodes"), "{text}");
        assert!(text.contains("first high_target/test/02/rider") && text.contains("0 bicycles"));
    }

    #[test]
    fn episodes_of_two_tasks_may_have_the_same_id() {
        let files = episodes_with_one_id();
        let jobs = jobs(&files);
        let environments = environments(&jobs);
        for job in &jobs {
            assert_eq!(environments.get(job.key.task, "same"), job.environment);
        }
        assert_ne!(jobs[0].environment, jobs[1].environment);
        // The recording is of the first task only.
        let playable = BTreeMap::from([("same".to_owned(), Digest::of_setup(files[0].setup()))]);
        check_recorded(&jobs[..1], Some(&files), &playable).unwrap();
        let error = check_recorded(&jobs, Some(&files), &playable).unwrap_err().to_string();
        assert!(error.contains("is of another version of the episode"), "{error}");
    }
}
