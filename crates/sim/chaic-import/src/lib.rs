//! Import of the original CHAIC data set.
//!
//! **What it is**: [`import`] reads the data set folder of the public CHAIC repository and the
//! public `tdw` Python package, and returns episodes. `docs/import.md` documents the sources and
//! accuracy of all values.
//!
//! **What it is not**: it does not download or write files, and does not use a Unity build.
//!
//! **Invariants**
//! - All values are in Unity's frame until `axes` converts them; no other module negates a z.
//! - Values that neither source contains are in the tables under `data/`.
//! - The same sources give the same episodes, bit by bit.

mod axes;
mod dataset;
mod error;
mod files;
mod package;
mod tables;

mod piece;
mod settle;

mod common;
mod house;
mod street;

use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_core::task::SceneKind;
use chaic_episodes::Episode;
use chaic_world::Setup;

use crate::dataset::{Source, TaskFolder};
use crate::package::Package;

pub use dataset::SourceSplit;
pub use error::ImportError;

/// Sources of an import.
#[derive(Clone, Debug)]
pub struct Sources {
    /// Data set folder: contains `train_dataset` or `train`, and `test_dataset` or `test`.
    pub dataset: PathBuf,
    /// Folder of the `tdw` package, or the folder that contains it.
    pub tdw: PathBuf,
    /// Half to import; `None` imports every half that exists.
    pub half: Option<SourceSplit>,
}

/// Result of an import.
#[derive(Debug, Default)]
pub struct Imported {
    /// Episodes in the order of halves, tasks and the data set's lists.
    pub episodes: Vec<Episode>,
    /// Errors of the episodes that were skipped; empty with [`OnError::Stop`].
    pub skipped: Vec<ImportError>,
}

/// Reaction to an episode that cannot be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnError {
    /// Stop with an error.
    Stop,
    /// Skip the episode and import the others.
    Skip,
}

/// Imports all episodes of the sources.
///
/// # Errors
/// Problems of the package or of the data set as a whole. With [`OnError::Stop`] also the first
/// problem of a task or an episode.
pub fn import(sources: &Sources, on_error: OnError) -> Result<Imported, ImportError> {
    let package = Package::read(&sources.tdw)?;
    let mut imported = Imported::default();
    let mut note = |error: ImportError| match on_error {
        OnError::Stop => Err(error),
        OnError::Skip => {
            imported.skipped.push(error);
            Ok(())
        }
    };
    for (half, folder) in halves(sources)? {
        for task in TaskId::paper() {
            match task_episodes(half, &folder, task, &package) {
                Err(error) => note(error)?,
                Ok(results) => {
                    for result in results {
                        match result {
                            Ok(episode) => imported.episodes.push(episode),
                            Err(error) => note(error)?,
                        }
                    }
                }
            }
        }
    }
    Ok(imported)
}

/// Returns a furnished house of the package without people and task objects. `scene` is a floor
/// plan with a variant, such as `2a`; `layout` is 0, 1 or 2. The goal places are the beds.
///
/// # Errors
/// Problems of the sources, or no such house.
pub fn house(sources: &Sources, scene: &str, layout: usize) -> Result<Setup, ImportError> {
    let package = Package::read(&sources.tdw)?;
    let (_, folder) = halves(sources)?.swap_remove(0);
    let (rooms, layout) = (dataset::room_types(&folder)?, layout.to_string());
    let named = house::House::from_names(scene, &layout, &rooms);
    let house = named.map_err(|(field, problem)| ImportError::field(&folder, field, problem))?;
    house.settled(&package)
}

/// Returns the halves to import, with their folders.
fn halves(sources: &Sources) -> Result<Vec<(SourceSplit, PathBuf)>, ImportError> {
    let dataset = &sources.dataset;
    let requested: Vec<SourceSplit> =
        sources.half.map_or(vec![SourceSplit::Train, SourceSplit::Test], |h| vec![h]);
    let found: Vec<(SourceSplit, PathBuf)> =
        requested.iter().filter_map(|h| Some((*h, h.folder(dataset)?))).collect();
    if found.is_empty() {
        let names: Vec<&str> = requested.iter().map(|h| h.name()).collect();
        let names = names.join(" or ");
        let problem =
            format!("contains no half of the data set, expected a folder {names}[_dataset]");
        return Err(ImportError::unreadable(dataset, problem));
    }
    Ok(found)
}

/// Imports the episodes of one task; returns a result for each.
fn task_episodes(
    half: SourceSplit,
    folder: &Path,
    task: TaskId,
    package: &Package,
) -> Result<Vec<Result<Episode, ImportError>>, ImportError> {
    let folder = TaskFolder::read(folder, task)?;
    let is_house = task.info().scene == SceneKind::House;
    let rooms = if is_house { folder.room_types()? } else { Default::default() };
    let episode = |index: usize| {
        let source = folder.episode(index)?;
        let setup = if is_house {
            house::setup(&source, &rooms, package)?
        } else {
            street::setup(&source, package)?
        };
        to_episode(half, &source, setup)
    };
    Ok((0..folder.len()).map(episode).collect())
}

/// Wraps a setup in an episode.
fn to_episode(half: SourceSplit, source: &Source, setup: Setup) -> Result<Episode, ImportError> {
    let split = format!("original-{}", half.name());
    let id = format!("{}/{split}/{:02}", source.task, source.index);
    let path = source.commands_path.clone();
    Episode::new(id, split, None, setup).map_err(|source| ImportError::Unplayable { path, source })
}
