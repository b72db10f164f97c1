//! Episodes of the original CHAIC data set as episodes of chaic.
//!
//! **What it is**: [`import`] reads the data set folder of the public CHAIC repository and the
//! public `tdw` Python package, and returns episodes. `docs/import.md` tells where each figure
//! comes from and how exact it is.
//!
//! **What it is not**: it fetches nothing, writes nothing, and knows nothing of a Unity build.
//!
//! **Invariants**
//! - All figures are in Unity's frame until `axes` has turned them; nothing else negates a z.
//! - What neither source says is in the tables under `data/`.
//! - The same sources give the same episodes, to the bit.

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

pub use dataset::Half;
pub use error::ImportError;

/// What to import.
#[derive(Clone, Debug)]
pub struct Sources {
    /// The data set folder: holds `train_dataset` or `train`, and `test_dataset` or `test`.
    pub dataset: PathBuf,
    /// The `tdw` package's folder, or the folder that holds it.
    pub tdw: PathBuf,
    /// Only this half; otherwise every half that is there.
    pub half: Option<Half>,
}

/// What came of it.
#[derive(Debug, Default)]
pub struct Imported {
    /// In the order of halves, tasks and the data set's lists.
    pub episodes: Vec<Episode>,
    /// Why others are left out; never more than one unless all is gone through.
    pub left_out: Vec<ImportError>,
}

/// What to do when an episode can't be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnError {
    /// Give up.
    Stop,
    /// Import the others.
    KeepGoing,
}

/// Imports all episodes of the sources.
///
/// # Errors
/// What is wrong with the package or with the data set as a whole, whatever `on_error`; with
/// [`OnError::Stop`] also the first thing that is wrong with a task or an episode.
pub fn import(sources: &Sources, on_error: OnError) -> Result<Imported, ImportError> {
    let package = Package::read(&sources.tdw)?;
    let mut imported = Imported::default();
    let mut note = |error: ImportError| match on_error {
        OnError::Stop => Err(error),
        OnError::KeepGoing => {
            imported.left_out.push(error);
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

/// A furnished house of the package, in which nobody is and no episode has laid anything: `scene`
/// is a floor plan with a variant, like `2a`, `layout` is 0, 1 or 2. Its goal places are its beds.
///
/// # Errors
/// What is wrong with the sources, or that they have no such house.
pub fn house(sources: &Sources, scene: &str, layout: usize) -> Result<Setup, ImportError> {
    let package = Package::read(&sources.tdw)?;
    let (_, folder) = halves(sources)?.swap_remove(0);
    let (rooms, layout) = (dataset::room_types(&folder)?, layout.to_string());
    let named = house::House::named(scene, &layout, &rooms);
    let house = named.map_err(|(field, problem)| ImportError::field(&folder, field, problem))?;
    house.settled(&package)
}

/// The halves to import, with their folders.
fn halves(sources: &Sources) -> Result<Vec<(Half, PathBuf)>, ImportError> {
    let dataset = &sources.dataset;
    let wanted: Vec<Half> = sources.half.map_or(vec![Half::Train, Half::Test], |h| vec![h]);
    let found: Vec<(Half, PathBuf)> =
        wanted.iter().filter_map(|h| Some((*h, h.folder(dataset)?))).collect();
    if found.is_empty() {
        let names: Vec<&str> = wanted.iter().map(|h| h.name()).collect();
        let names = names.join(" or ");
        let problem = format!("holds no half of the data set, expected a folder {names}[_dataset]");
        return Err(ImportError::unreadable(dataset, problem));
    }
    Ok(found)
}

/// The episodes of one task, each with what became of it.
fn task_episodes(
    half: Half,
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
        finished(half, &source, setup)
    };
    Ok((0..folder.len()).map(episode).collect())
}

/// The envelope around a setup.
fn finished(half: Half, source: &Source, setup: Setup) -> Result<Episode, ImportError> {
    let split = format!("original-{}", half.name());
    let id = format!("{}/{split}/{:02}", source.task, source.index);
    let path = source.commands_path.clone();
    Episode::new(id, split, None, setup).map_err(|source| ImportError::Unplayable { path, source })
}
