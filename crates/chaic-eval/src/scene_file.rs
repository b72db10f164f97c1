//! How an episode looks at its beginning as a file, for other programs.

use std::path::Path;

use chaic_env::EnvError;
use chaic_episodes::Episode;
use chaic_files::write_whole;
use chaic_protocol::EntityId;
use chaic_protocol::geom::Camera;
use chaic_render::{Scene, gltf_out};
use chaic_world::{Posture, Rules, World};

use crate::error::Result;
use crate::frame_export::name_of;

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
pub fn write(episode: &Episode, options: SceneOptions, path: &Path) -> Result<Written> {
    let refused = |problem| EnvError::Setup { id: episode.id().to_owned(), problem };
    let world = World::new(episode.setup().clone(), Rules::paper()).map_err(refused)?;
    let agents = episode.setup().agents();
    let eyes: Vec<(String, Camera)> =
        agents.map(|a| (format!("eye of {a}"), world.eye(a, SIZE_PX))).collect();
    write_world(&world, options, &eyes, path)
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
) -> Result<Written> {
    let setup = world.setup();
    let postures: Vec<Posture> = setup.agents().map(|a| world.posture(a)).collect();
    let mut geometry = Scene::new(setup).geometry(world.state(), &postures, options.detail);
    if options.hide_ceiling {
        geometry.leave_out(EntityId::CEILING);
    }
    let classes = world.classes();
    let bytes = gltf_out::glb(&geometry, &|entity| name_of(entity, &classes), cameras);
    write_whole(path, &bytes)?;
    Ok(Written { instances: geometry.instances.len(), triangles: geometry.count_triangles() })
}
