//! Export of scenes as binary glTF files, for viewers, modeling programs and other renderers.
//!
//! **What it is**: [`glb`] encodes the geometry of `chaic-render` as glTF 2.0. [`write()`] writes
//! the initial state of an episode to such a file. **What it is not**: it renders nothing, and
//! reads no glTF.

mod encode;

use std::path::Path;

use chaic_core::EntityId;
use chaic_core::geom::Camera;
use chaic_episodes::Episode;
use chaic_files::{FileError, write_atomically};
use chaic_render::Scene;
use chaic_world::{Posture, Rules, SetupError, World};

pub use encode::glb;

/// Error of the glTF export.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The setup is invalid.
    #[error("{id}: {problem}")]
    Setup {
        /// Id of the episode.
        id: String,
        /// Problem of the setup.
        problem: SetupError,
    },
    /// The file could not be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Options of the glTF export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneOptions {
    /// Level of detail, from 0 to [`chaic_render::geometry::FINEST_LEVEL`].
    pub detail: usize,
    /// Hides ceilings, to look into a house from above.
    pub hide_ceiling: bool,
}

/// Contents of a written file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneSummary {
    /// Number of nodes with a mesh.
    pub instances: usize,
    /// Number of triangles of all nodes.
    pub triangles: usize,
}

/// Image side of the exported cameras, pixels; a file holds only the aspect ratio.
const SIZE_PX: u32 = 512;

/// Writes the initial state of an episode as binary glTF, with a camera for the eye of each agent.
///
/// # Errors
/// If the setup is invalid, or the file cannot be written.
pub fn write(
    episode: &Episode,
    options: SceneOptions,
    path: &Path,
) -> Result<SceneSummary, SceneError> {
    let setup_error = |problem| SceneError::Setup { id: episode.id().to_owned(), problem };
    let world = World::new(episode.setup().clone(), Rules::paper()).map_err(setup_error)?;
    let agents = episode.setup().agents();
    let eyes: Vec<(String, Camera)> =
        agents.map(|a| (format!("eye of {a}"), world.camera(a, SIZE_PX))).collect();
    Ok(write_world(&world, options, &eyes, path)?)
}

/// Writes the current state of a world as binary glTF, with these cameras.
///
/// # Errors
/// If the file cannot be written.
pub fn write_world(
    world: &World,
    options: SceneOptions,
    cameras: &[(String, Camera)],
    path: &Path,
) -> Result<SceneSummary, FileError> {
    let setup = world.setup();
    let postures: Vec<Posture> = setup.agents().map(|a| world.posture(a)).collect();
    let mut geometry = Scene::new(setup).geometry(world.state(), &postures, options.detail);
    if options.hide_ceiling {
        geometry.remove_entity(EntityId::CEILING);
    }
    let classes = world.classes();
    let bytes = glb(&geometry, &|entity| entity.class_name(&classes), cameras);
    write_atomically(path, &bytes)?;
    Ok(SceneSummary { instances: geometry.instances.len(), triangles: geometry.count_triangles() })
}
