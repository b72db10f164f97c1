//! The episode runs that a run consists of.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use chaic_core::task::Origin;
use chaic_core::{Frame, TaskId};
use chaic_env::{RunKey, slug};
use chaic_episodes::{Episode, Split, find_episode};
use chaic_files::{entries, make_folders_below, write_whole};

use crate::error::{EvalError, Result};
use crate::read_episode_file;
use crate::run::environment::environment;
use crate::run::folder::RunFolder;
use crate::run::options::{FILES, RunOptions};

/// One episode run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Which.
    pub key: RunKey,
    /// How long it may take.
    pub horizon: Frame,
    /// The name of its surroundings; episodes that share them are no independent samples.
    pub environment: String,
}

/// All episode runs that a run consists of, finished or not: episode by episode, so that a run that
/// is cut short can be compared.
///
/// # Errors
/// If the options name no episodes, or the run's copies of episode files can't be read.
pub fn planned(folder: &RunFolder, options: &RunOptions) -> Result<Vec<Item>> {
    let own = if options.split == FILES { read_copies(folder)? } else { vec![] };
    plan(options, &own)
}

/// Reads the run's copies of episodes, sorted by id.
fn read_copies(folder: &RunFolder) -> Result<Vec<Episode>> {
    parse_files(&folder.episode_files(), &|path| folder.copy_bytes(path))
}

/// The same for a run whose episodes are not copied yet.
pub(super) fn plan(options: &RunOptions, own: &[Episode]) -> Result<Vec<Item>> {
    /// A longer list is no benchmark but a mistake, and fills the memory.
    const MAX_ITEMS: usize = 1_000_000;
    let n_each = options.helpers.len().saturating_mul(options.seeds as usize);
    let mut items = Vec::new();
    for task in &options.tasks {
        let limit = (MAX_ITEMS - items.len()) / n_each.max(1);
        let episodes = episodes(options, own, *task, limit)?;
        if episodes.is_empty() {
            let hint = match task.info().origin {
                Origin::Ours if options.split != FILES => {
                    "; it has generated ones: give --split gen:0..12"
                }
                _ => "",
            };
            let text = format!("there is no episode of {task} to play{hint}");
            return Err(EvalError::Options(text));
        }
        for Entry { id, horizon, environment } in episodes {
            for seed in 0..options.seeds {
                for helper in &options.helpers {
                    let (task, helper, episode) = (*task, helper.clone(), id.clone());
                    let key = RunKey { task, helper, episode, seed };
                    items.push(Item { key, horizon, environment: environment.clone() });
                }
            }
        }
    }
    Ok(items)
}

/// Whether another partner than the task's can play at all: looks at the first episode of each task.
pub(super) fn check_partner(items: &[Item]) -> Result<()> {
    let mut tasks = BTreeSet::new();
    let mut firsts = items.iter().filter(|item| tasks.insert(item.key.task));
    firsts.try_for_each(|item| Ok(find_episode(&item.key.episode).map(|_| ())?))
}

/// An episode as far as a plan needs it.
struct Entry {
    id: String,
    horizon: Frame,
    environment: String,
}

/// A task's episodes, `at_most` so many generated ones; `own` are those of the
/// run's files. Generated episodes are made when they are played: there may be more than memory
/// holds.
fn episodes(
    options: &RunOptions,
    own: &[Episode],
    task: TaskId,
    at_most: usize,
) -> Result<Vec<Entry>> {
    let limit = options.first.map_or(usize::MAX, |n| n as usize);
    if options.split == FILES {
        let entry = |e: &Episode| {
            let (id, horizon) = (e.id().to_owned(), e.setup().horizon);
            Entry { id, horizon, environment: environment(e) }
        };
        let of_task = || own.iter().filter(|e| e.task() == task).take(limit);
        check_number(of_task().count(), at_most, task)?;
        return Ok(of_task().map(entry).collect());
    }
    let split: Split = options.split.parse()?;
    let horizon = task.info().horizon;
    let n = split.len_of(task).min(limit);
    check_number(n, at_most, task)?;
    let partner = options.partner_is.map_or_else(String::new, |kind| format!("/{kind}"));
    let entry = |k: usize| Entry {
        id: split.episode_id(task, k) + &partner,
        horizon,
        environment: split.environment(task, k as u64),
    };
    Ok((0..n).map(entry).collect())
}

/// Refuses more episodes of a task than a run has room for.
fn check_number(n: usize, at_most: usize, task: TaskId) -> Result<()> {
    if n > at_most {
        let text =
            format!("{n} episodes of {task} are too many for one run; give --first or fewer seeds");
        return Err(EvalError::Options(text));
    }
    Ok(())
}

/// Reads the `.json` files of a folder that a user named, sorted by id.
fn read_files(folder: &Path) -> Result<Vec<Episode>> {
    parse_files(folder, &read_episode_file)
}

fn parse_files(folder: &Path, read: &dyn Fn(&Path) -> Result<Vec<u8>>) -> Result<Vec<Episode>> {
    let mut episodes = Vec::new();
    for path in episode_files(folder)? {
        let bytes = read(&path)?;
        episodes.push(Episode::parse(&bytes, &path.display().to_string())?);
    }
    episodes.sort_by(|a, b| a.id().cmp(b.id()));
    Ok(episodes)
}

/// A folder's `.json` files, in the order of their names.
fn episode_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = entries(folder)?;
    files.retain(|p| p.extension().is_some_and(|e| e == "json"));
    Ok(files)
}

/// The tasks of the episodes in a folder, in the paper's order.
pub fn tasks_of_files(folder: &Path) -> Result<Vec<TaskId>> {
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
    options: &RunOptions,
    folder: &RunFolder,
) -> Result<()> {
    if same_files(source, folder)? {
        return Ok(());
    }
    let named = read_with_partner(source, options)?;
    let copies = read_copies(folder)?;
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

/// Compares the episode files of a folder with those of the run byte by byte, which is faster than parsing
/// them.
fn same_files(source: &Path, folder: &RunFolder) -> Result<bool> {
    let (a, b) = (episode_files(source)?, episode_files(&folder.episode_files())?);
    let names = |files: &[PathBuf]| -> Vec<_> {
        files.iter().filter_map(|p| p.file_name().map(ToOwned::to_owned)).collect()
    };
    if names(&a) != names(&b) {
        return Ok(false);
    }
    for (a, b) in a.iter().zip(&b) {
        if read_episode_file(a)? != folder.copy_bytes(b)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The episodes of the run's tasks in a user's folder, with the run's partner.
fn read_with_partner(source: &Path, options: &RunOptions) -> Result<Vec<Episode>> {
    let episodes = read_files(source)?.into_iter();
    let of_tasks = episodes.filter(|e| options.tasks.contains(&e.task()));
    of_tasks
        .map(|episode| match options.partner_is {
            Some(kind) => Ok(episode.with_partner(kind)?),
            None => Ok(episode),
        })
        .collect()
}

/// The episodes of the run's tasks in a user's folder, as they are copied.
///
/// # Errors
/// If one can't be read, or two of them would be copied to the same file.
pub(super) fn read_source(source: &Path, options: &RunOptions) -> Result<Vec<Episode>> {
    let episodes = read_with_partner(source, options)?;
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

/// Copies episodes into the run, which then needs nothing from elsewhere.
pub(super) fn copy_episodes(episodes: &[Episode], folder: &RunFolder) -> Result<()> {
    make_folders_below(folder.path(), &folder.episode_files())?;
    for episode in episodes {
        let copy = folder.episode_copy(episode.task(), episode.id());
        write_whole(&copy, episode.to_json().as_bytes())?;
    }
    Ok(())
}
