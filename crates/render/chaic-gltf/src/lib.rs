//! Scenes as binary glTF files, for viewers, modelling programs and other renderers.
//!
//! **What it is**: the shapes that `chaic-render` draws, encoded as glTF 2.0 by [`glb`], and how an
//! episode begins as such a file by [`write()`].
//! **What it is not**: it draws nothing, and reads no glTF.

mod encode;

use std::path::Path;

use chaic_core::EntityId;
use chaic_core::geom::Camera;
use chaic_episodes::Episode;
use chaic_files::{FileError, write_whole};
use chaic_render::Scene;
use chaic_world::{Posture, Rules, SetupError, World};

pub use encode::glb;

/// Why a scene is no file.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The setup makes no world.
    #[error("{id}: {problem}")]
    Setup {
        /// The episode.
        id: String,
        /// What is wrong with it.
        problem: SetupError,
    },
    /// The operating system refused something.
    #[error(transparent)]
    File(#[from] FileError),
}

/// How a scene becomes a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneOptions {
    /// Level of detail, from 0 to [`chaic_render::geometry::FINEST`].
    pub detail: usize,
    /// Whether ceilings are left out, to look into a house from above.
    pub hide_ceiling: bool,
}

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Nodes that can be seen.
    pub instances: usize,
    /// Triangles of all of them.
    pub triangles: usize,
}

/// Side of the images that the file's cameras are made for, pixels; a file holds only their ratio.
const SIZE_PX: u32 = 512;

/// Writes how an episode begins as binary glTF, with a camera for each agent's eye.
///
/// # Errors
/// If the setup makes no world, or the file system refuses.
pub fn write(episode: &Episode, options: SceneOptions, path: &Path) -> Result<Written, SceneError> {
    let refused = |problem| SceneError::Setup { id: episode.id().to_owned(), problem };
    let world = World::new(episode.setup().clone(), Rules::paper()).map_err(refused)?;
    let agents = episode.setup().agents();
    let eyes: Vec<(String, Camera)> =
        agents.map(|a| (format!("eye of {a}"), world.eye(a, SIZE_PX))).collect();
    Ok(write_world(&world, options, &eyes, path)?)
}

/// The same for a world at any moment, with these cameras.
///
/// # Errors
/// If the file system refuses.
pub fn write_world(
    world: &World,
    options: SceneOptions,
    cameras: &[(String, Camera)],
    path: &Path,
) -> Result<Written, FileError> {
    let setup = world.setup();
    let postures: Vec<Posture> = setup.agents().map(|a| world.posture(a)).collect();
    let mut geometry = Scene::new(setup).geometry(world.state(), &postures, options.detail);
    if options.hide_ceiling {
        geometry.leave_out(EntityId::CEILING);
    }
    let classes = world.classes();
    let bytes = glb(&geometry, &|entity| entity.class_name(&classes), cameras);
    write_whole(path, &bytes)?;
    Ok(Written { instances: geometry.instances.len(), triangles: geometry.count_triangles() })
}
