//! Scene and cameras of the rendering benchmark.

use std::path::Path;

use chaic_core::geom::{Camera, Rect, math, yaw_rotation};
use chaic_core::{EntityId, Vec2, Vec3};
use chaic_env::EnvError;
use chaic_episodes::{Episode, house};
use chaic_files::{create_folders, write_atomically};
use chaic_render::geometry::FINEST_LEVEL;
use chaic_render::{Channels, Scene, View, image_out};
use chaic_world::{ObjectSpec, Posture, RoomKind, Rules, Setup, World};
use serde_json::json;

use chaic_eval::frame_export::save;
use chaic_eval::{EvalError, Result};
use chaic_gltf::{SceneOptions, SceneSummary, write_world};

/// Number of cameras.
pub const N_VIEWS: usize = 16;
/// Height of the cameras, meters: an adult's eyes.
const CAMERA_HEIGHT_M: f32 = 1.65;
/// Minimum distance between a camera and the walls of its room, meters.
const MIN_WALL_DISTANCE_M: f32 = 0.45;
/// Minimum distance between a camera and objects that reach its height, meters.
const MIN_OBJECT_DISTANCE_M: f32 = 0.35;
/// Step between candidate positions, meters.
const STEP_M: f32 = 0.1;

/// A static world with cameras.
#[derive(Debug)]
pub struct BenchScene {
    /// Name of the scene.
    pub name: String,
    /// World of the scene.
    pub world: World,
    /// Cameras; the same for the same scene.
    pub cameras: Vec<Camera>,
}

impl BenchScene {
    /// Returns the default scene with up to `n_objects` objects; see [`house::crowded_house`].
    ///
    /// # Errors
    /// If the house cannot be generated.
    pub fn house(n_objects: usize, size_px: u32) -> Result<BenchScene> {
        let setup =
            house::crowded_house(n_objects).map_err(|e| EvalError::Options(e.to_string()))?;
        BenchScene::new("house".to_owned(), setup, size_px)
    }

    /// Returns the initial state of an episode.
    ///
    /// # Errors
    /// If its setup is not a valid world.
    pub fn episode(episode: &Episode, size_px: u32) -> Result<BenchScene> {
        BenchScene::new(episode.id().to_owned(), episode.setup().clone(), size_px)
    }

    fn new(name: String, setup: Setup, size_px: u32) -> Result<BenchScene> {
        let cameras = cameras(&setup, size_px);
        let error = |problem| EnvError::Setup { id: name.clone(), problem };
        let world = World::new(setup, Rules::paper()).map_err(error)?;
        Ok(BenchScene { name, world, cameras })
    }

    /// Returns the views of all cameras.
    pub fn views(&self, channels: Channels) -> Vec<View> {
        let view = |camera| View::from_camera(camera, channels);
        self.cameras.iter().map(|c| view(*c)).collect()
    }

    /// Returns the number of triangles of everything visible, at the finest level of detail.
    pub fn count_triangles(&self) -> usize {
        let setup = self.world.setup();
        let postures: Vec<Posture> = setup.agents().map(|a| self.world.posture(a)).collect();
        Scene::new(setup).geometry(self.world.state(), &postures, FINEST_LEVEL).count_triangles()
    }

    /// Writes the scene for other renderers: `scene.glb`, `cameras.json`, and `chaic.png` with the
    /// image of the first camera.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, out: &Path) -> Result<SceneSummary> {
        create_folders(out)?;
        let name = |k: usize| format!("view {k:02}");
        let named: Vec<(String, Camera)> =
            self.cameras.iter().enumerate().map(|(k, c)| (name(k), *c)).collect();
        let options = SceneOptions { detail: FINEST_LEVEL, hide_ceiling: false };
        let summary = write_world(&self.world, options, &named, &out.join("scene.glb"))?;
        let cameras: Vec<_> = named.iter().map(|(name, c)| describe(name, c)).collect();
        let entities = json!({
            "structure": [EntityId::FLOOR.0, EntityId::WALL.0, EntityId::CEILING.0],
            "first_person": EntityId::FIRST_PERSON.0,
            "first_object": EntityId::FIRST_OBJECT.0,
        });
        let json = json!({ "scene": self.name, "entities": entities, "cameras": cameras });
        let text = serde_json::to_string_pretty(&json)
            .expect("the value has string keys and finite numbers")
            + "\n";
        write_atomically(&out.join("cameras.json"), text.as_bytes())?;
        self.write_image(&out.join("chaic.png"))?;
        Ok(summary)
    }

    fn write_image(&self, path: &Path) -> Result<()> {
        let view = self.views(Channels::RGB)[0];
        let (width, height) = (view.camera.width, view.camera.height);
        let scene = Scene::new(self.world.setup());
        let rgb = scene.render(&self.world, &[view]).pop().and_then(|i| i.rgb);
        let image = rgb.as_deref().and_then(|rgb| image_out::rgb(rgb, width, height));
        let image =
            image.ok_or_else(|| EvalError::Image(format!("{width} is not a valid image size")))?;
        save(image.into(), path)
    }
}

/// Describes a camera by plain numbers: directions in the world, meters, radians.
fn describe(name: &str, camera: &Camera) -> serde_json::Value {
    let direction = |d: Vec3| (camera.world_from_camera * d).to_array();
    json!({
        "name": name,
        "eye": camera.eye_in_world.to_array(),
        "right": direction(Vec3::X),
        "up": direction(Vec3::Y),
        "forward": direction(Vec3::NEG_Z),
        "vertical_fov_rad": camera.vertical_fov_rad,
        "width": camera.width,
        "height": camera.height,
        "near_m": Camera::NEAR_M,
        "far_m": Camera::FAR_M,
    })
}

/// Returns cameras: at least two per room, near its corners in turn, facing its center. Outdoors
/// the whole ground is one room.
fn cameras(setup: &Setup, size_px: u32) -> Vec<Camera> {
    let inside = setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors);
    let mut rooms: Vec<Rect> = inside.map(|r| r.rect).collect();
    if rooms.is_empty() {
        rooms.push(setup.bounds);
    }
    let views = (0..N_VIEWS).map(|k| {
        let (room, corner) = (&rooms[k % rooms.len()], k / rooms.len());
        let from = standing_point(setup, room, corner);
        let ahead = room.center() - from;
        Camera {
            eye_in_world: Vec3::new(from.x, CAMERA_HEIGHT_M, from.y),
            world_from_camera: yaw_rotation(math::atan2(-ahead.x, -ahead.y)),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: size_px,
            height: size_px,
        }
    });
    views.collect()
}

/// Returns the free point (x, z) nearest to a corner of a room. Corners are numbered from the
/// minimum corner, opposite corners in succession.
fn standing_point(setup: &Setup, room: &Rect, corner: usize) -> Vec2 {
    let (min, max) = (room.min + MIN_WALL_DISTANCE_M, room.max - MIN_WALL_DISTANCE_M);
    let corner = match corner % 4 {
        0 => min,
        1 => max,
        2 => Vec2::new(max.x, min.y),
        _ => Vec2::new(min.x, max.y),
    };
    let steps = |low: f32, high: f32| ((high - low) / STEP_M).max(0.0) as usize;
    let mut best = (f32::INFINITY, room.center());
    for i in 0..=steps(min.x, max.x) {
        for k in 0..=steps(min.y, max.y) {
            let p = min + STEP_M * Vec2::new(i as f32, k as f32);
            let distance = (p - corner).length_squared();
            if distance < best.0 && setup.things.iter().all(|t| is_clear_of(p, t)) {
                best = (distance, p);
            }
        }
    }
    best.1
}

/// Returns whether a camera at (x, z) is neither inside nor directly in front of an object.
fn is_clear_of(p: Vec2, object: &ObjectSpec) -> bool {
    let half = 0.5 * object.size_m();
    let reach = MIN_OBJECT_DISTANCE_M + Vec2::new(half.x, half.z).length();
    let d = p - Vec2::new(object.position.x, object.position.z);
    let top = object.position.y + object.size_m().y;
    // Low objects do not block the view.
    top < CAMERA_HEIGHT_M - 0.4 || object.position.y > CAMERA_HEIGHT_M || d.length() > reach
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_cover_all_rooms_and_show_objects() {
        let scene = BenchScene::house(house::N_OBJECTS, 64).expect("the seeds are fixed");
        let setup = scene.world.setup();
        for room in &setup.rooms {
            let inside =
                |c: &&Camera| room.rect.contains(Vec2::new(c.eye_in_world.x, c.eye_in_world.z));
            assert!(scene.cameras.iter().filter(inside).count() >= 2, "{room:?}");
        }
        let images = Scene::new(setup).render(&scene.world, &scene.views(Channels::DEPTH_AND_IDS));
        for (k, image) in images.into_iter().enumerate() {
            let (ids, depth) = (image.ids.expect("requested"), image.depth_m.expect("requested"));
            let objects: std::collections::BTreeSet<u16> =
                ids.into_iter().filter(|id| EntityId(*id).is_object()).collect();
            assert!(objects.len() >= 5, "view {k} shows {} objects", objects.len());
            let mean = depth.iter().sum::<f32>() / depth.len() as f32;
            assert!((1.0..12.0).contains(&mean), "mean depth of view {k} is {mean} m");
        }
    }
}
