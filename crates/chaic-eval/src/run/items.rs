//! The episode runs that a run consists of.

use std::collections::BTreeSet;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use chaic_episodes::{Episode, MAX_EPISODE_BYTES, Split};
use chaic_protocol::{Frame, TaskId};

use crate::error::{EvalError, Result};
use crate::metrics::RunKey;
use crate::run::folder::{RunFolder, write_whole};
use crate::run::options::{FILES, RunOptions};

/// One episode run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Which.
    pub key: RunKey,
    /// How long it may take.
    pub horizon: Frame,
}

/// A name for files that belong to an episode: its id without the task, `/` and `:` as `-`.
///
/// ```
/// use chaic_protocol::TaskId;
/// assert_eq!(chaic_eval::run::slug(TaskId::Obstacle, "obstacle/test/07"), "test-07");
/// ```
pub fn slug(task: TaskId, id: &str) -> String {
    let rest = id.strip_prefix(task.name()).and_then(|r| r.strip_prefix('/')).unwrap_or(id);
    let safe = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '-' };
    // No name becomes hidden, or one of the two special ones.
    rest.trim_start_matches('.').chars().map(safe).collect()
}

/// All episode runs that a run consists of, finished or not: episode by episode, so that a run that
/// is cut short can be compared.
///
/// # Errors
/// If the options name no episodes, or the run's copies of episode files can't be read.
pub fn planned(folder: &RunFolder, options: &RunOptions) -> Result<Vec<Item>> {
    /// A longer list is no benchmark but a mistake, and fills the memory.
    const MAX_ITEMS: usize = 1_000_000;
    let own = if options.split == FILES { read_files(&folder.episode_files())? } else { vec![] };
    let n_each = options.helpers.len().saturating_mul(options.seeds as usize);
    let mut items = Vec::new();
    for task in &options.tasks {
        let limit = (MAX_ITEMS - items.len()) / n_each.max(1);
        let episodes = episodes(options, &own, *task, limit)?;
        if episodes.is_empty() {
            let text = format!("there is no episode of {task} to play");
            return Err(EvalError::Options(text));
        }
        for (episode, horizon) in episodes {
            for seed in 0..options.seeds {
                for helper in &options.helpers {
                    let (task, helper, episode) = (*task, helper.clone(), episode.clone());
                    items.push(Item { key: RunKey { task, helper, episode, seed }, horizon });
                }
            }
        }
    }
    Ok(items)
}

/// Ids and horizons of a task's episodes, `at_most` so many generated ones; `own` are those of the
/// run's files. Generated episodes are made when they are played: there may be more than memory
/// holds.
fn episodes(
    options: &RunOptions,
    own: &[Episode],
    task: TaskId,
    at_most: usize,
) -> Result<Vec<(String, Frame)>> {
    let limit = options.first.map_or(usize::MAX, |n| n as usize);
    if options.split == FILES {
        let own =
            own.iter().filter(|e| e.task() == task).map(|e| (e.id().to_owned(), e.setup().horizon));
        return Ok(own.take(limit).collect());
    }
    let split: Split = options.split.parse()?;
    let horizon = task.info().horizon;
    let n = split.len_per_task().min(limit);
    if n > at_most {
        let text =
            format!("{n} episodes of {task} are too many for one run; give --first or fewer seeds");
        return Err(EvalError::Options(text));
    }
    Ok((0..n).map(|k| (split.episode_id(task, k), horizon)).collect())
}

/// The episodes in a folder's `.json` files, in the order of their ids.
fn read_files(folder: &Path) -> Result<Vec<Episode>> {
    let mut episodes = Vec::new();
    for path in episode_files(folder)? {
        let bytes = read_bounded(&path)?;
        episodes.push(Episode::parse(&bytes, &path.display().to_string())?);
    }
    episodes.sort_by(|a, b| a.id().cmp(b.id()));
    Ok(episodes)
}

/// A folder's `.json` files, in the order of their names.
fn episode_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let list = fs::read_dir(folder).and_then(|d| d.map(|e| e.map(|e| e.path())).collect());
    let mut files: Vec<PathBuf> = list.map_err(EvalError::io("list", folder))?;
    files.retain(|p| p.extension().is_some_and(|e| e == "json"));
    files.sort();
    Ok(files)
}

/// The bytes of an episode file; of a file that is too long so many that its reader says so.
pub(super) fn read_bounded(path: &Path) -> Result<Vec<u8>> {
    let file = fs::File::open(path).map_err(EvalError::io("open", path))?;
    let mut bytes = Vec::new();
    let read = file.take(MAX_EPISODE_BYTES as u64 + 1).read_to_end(&mut bytes);
    read.map_err(EvalError::io("read", path))?;
    Ok(bytes)
}

/// The tasks of the episodes in a folder, in the paper's order.
pub(crate) fn tasks_of_files(folder: &Path) -> Result<Vec<TaskId>> {
    let present: BTreeSet<TaskId> = read_files(folder)?.iter().map(Episode::task).collect();
    if present.is_empty() {
        let text = format!("{} holds no episode file (*.json)", folder.display());
        return Err(EvalError::Options(text));
    }
    Ok(TaskId::all().filter(|t| present.contains(t)).collect())
}

/// Whether `source` still holds just the episodes that the run has copies of: whoever names other
/// ones while going on with it means another run.
pub(super) fn check_episode_files(
    source: &Path,
    tasks: &[TaskId],
    folder: &RunFolder,
) -> Result<()> {
    if same_files(source, &folder.episode_files())? {
        return Ok(());
    }
    let mut named = read_files(source)?;
    named.retain(|e| tasks.contains(&e.task()));
    let copies = read_files(&folder.episode_files())?;
    let other = named.iter().find(|e| !copies.contains(e));
    let Some(other) = other.or_else(|| copies.iter().find(|e| !named.contains(e))) else {
        return Ok(());
    };
    Err(EvalError::Options(format!(
        "{} was begun with other episodes than --episodes {}, see {}; leave --episodes away to go \
         on, or choose another --out",
        folder.path().display(),
        source.display(),
        other.id()
    )))
}

/// Whether two folders hold the same episode files, byte by byte: quicker than to read them.
fn same_files(a: &Path, b: &Path) -> Result<bool> {
    let (a, b) = (episode_files(a)?, episode_files(b)?);
    let names = |files: &[PathBuf]| -> Vec<_> {
        files.iter().filter_map(|p| p.file_name().map(ToOwned::to_owned)).collect()
    };
    if names(&a) != names(&b) {
        return Ok(false);
    }
    for (a, b) in a.iter().zip(&b) {
        if read_bounded(a)? != read_bounded(b)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Copies the episodes of `source` into the run, which then needs nothing from elsewhere.
pub(super) fn copy_episode_files(
    source: &Path,
    tasks: &[TaskId],
    folder: &RunFolder,
) -> Result<()> {
    let to = folder.episode_files();
    fs::create_dir_all(&to).map_err(EvalError::io("make the folder", &to))?;
    let mut names = BTreeSet::new();
    for episode in read_files(source)?.iter().filter(|e| tasks.contains(&e.task())) {
        let copy = folder.episode_copy(episode.task(), episode.id());
        if !names.insert(copy.clone()) {
            let (id, source) = (episode.id(), source.display());
            let text = format!("{source} holds two episodes that are named like {id}; rename one");
            return Err(EvalError::Options(text));
        }
        write_whole(&copy, episode.to_json().as_bytes())?;
    }
    Ok(())
}
