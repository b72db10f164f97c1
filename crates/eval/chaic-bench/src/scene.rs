//! What the render bench looks at, and from where.

use std::path::Path;

use chaic_core::geom::{Camera, Rect, math, yaw_rotation};
use chaic_core::{EntityId, Vec2, Vec3};
use chaic_env::EnvError;
use chaic_episodes::{Episode, house};
use chaic_files::write_whole;
use chaic_render::geometry::FINEST;
use chaic_render::{Channels, Scene, View, image_out};
use chaic_world::{Posture, RoomKind, Rules, Setup, Thing, World};
use serde_json::json;

use chaic_eval::frame_export::save;
use chaic_eval::{EvalError, Result};
use chaic_gltf::{SceneOptions, Written, write_world};

/// Number of eye poses.
pub const N_VIEWS: usize = 16;
/// Height of these eyes, metres: an adult's.
const EYE_M: f32 = 1.65;
/// Between an eye and the walls of its room, metres.
const FROM_WALL_M: f32 = 0.45;
/// Between an eye and anything that reaches its height, metres.
const FROM_THING_M: f32 = 0.35;
/// Between the places that are tried, metres.
const STEP_M: f32 = 0.1;

/// A world that stands still, and eyes in it.
#[derive(Debug)]
pub struct BenchScene {
    /// What it is called.
    pub name: String,
    /// The world.
    pub world: World,
    /// The eyes; always the same for the same scene.
    pub cameras: Vec<Camera>,
}

impl BenchScene {
    /// The usual one, with [`house::N_THINGS`] things or up to so many others: [`house::filled`].
    ///
    /// # Errors
    /// If the house can't be made.
    pub fn house(n_things: usize, size_px: u32) -> Result<BenchScene> {
        let setup = house::filled(n_things).map_err(|e| EvalError::Options(e.to_string()))?;
        BenchScene::of("house".to_owned(), setup, size_px)
    }

    /// The beginning of an episode.
    ///
    /// # Errors
    /// If its setup makes no world.
    pub fn episode(episode: &Episode, size_px: u32) -> Result<BenchScene> {
        BenchScene::of(episode.id().to_owned(), episode.setup().clone(), size_px)
    }

    fn of(name: String, setup: Setup, size_px: u32) -> Result<BenchScene> {
        let cameras = cameras(&setup, size_px);
        let refused = |problem| EnvError::Setup { id: name.clone(), problem };
        let world = World::new(setup, Rules::paper()).map_err(refused)?;
        Ok(BenchScene { name, world, cameras })
    }

    /// What is wanted of the eyes.
    pub fn views(&self, channels: Channels) -> Vec<View> {
        let view = |camera| View::of_camera(camera, channels);
        self.cameras.iter().map(|c| view(*c)).collect()
    }

    /// Triangles of everything that can be seen, at the finest level of detail.
    pub fn count_triangles(&self) -> usize {
        let setup = self.world.setup();
        let postures: Vec<Posture> = setup.agents().map(|a| self.world.posture(a)).collect();
        Scene::new(setup).geometry(self.world.state(), &postures, FINEST).count_triangles()
    }

    /// Writes the scene for other renderers: `scene.glb`, `cameras.json`, and `chaic.png`, what the
    /// first eye sees.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, out: &Path) -> Result<Written> {
        std::fs::create_dir_all(out).map_err(EvalError::io("make the folder", out))?;
        let name = |k: usize| format!("view {k:02}");
        let named: Vec<(String, Camera)> =
            self.cameras.iter().enumerate().map(|(k, c)| (name(k), *c)).collect();
        let options = SceneOptions { detail: FINEST, hide_ceiling: false };
        let written = write_world(&self.world, options, &named, &out.join("scene.glb"))?;
        let described: Vec<_> = named.iter().map(|(name, c)| described(name, c)).collect();
        let entities = json!({
            "structure": [EntityId::FLOOR.0, EntityId::WALL.0, EntityId::CEILING.0],
            "first_person": EntityId::FIRST_PERSON.0,
            "first_object": EntityId::FIRST_OBJECT.0,
        });
        let json = json!({ "scene": self.name, "entities": entities, "cameras": described });
        let text = serde_json::to_string_pretty(&json).expect("names and finite numbers") + "\n";
        write_whole(&out.join("cameras.json"), text.as_bytes())?;
        self.write_picture(&out.join("chaic.png"))?;
        Ok(written)
    }

    fn write_picture(&self, path: &Path) -> Result<()> {
        let view = self.views(Channels::RGB)[0];
        let (width, height) = (view.camera.width, view.camera.height);
        let scene = Scene::new(self.world.setup());
        let rgb = scene.render(&self.world, &[view]).pop().and_then(|i| i.rgb);
        let picture = rgb.as_deref().and_then(|rgb| image_out::rgb(rgb, width, height));
        let picture = picture
            .ok_or_else(|| EvalError::Picture(format!("{width} is no size of a picture")))?;
        save(picture.into(), path)
    }
}

/// A camera in plain numbers: directions in the world, metres, radians.
fn described(name: &str, camera: &Camera) -> serde_json::Value {
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

/// Two eyes or more in each room, from its corners in turn, looking at its middle; outdoors the
/// whole ground is the room.
fn cameras(setup: &Setup, size_px: u32) -> Vec<Camera> {
    let inside = setup.rooms.iter().filter(|r| r.kind != RoomKind::Outdoors);
    let mut rooms: Vec<Rect> = inside.map(|r| r.rect).collect();
    if rooms.is_empty() {
        rooms.push(setup.bounds);
    }
    let views = (0..N_VIEWS).map(|k| {
        let (room, corner) = (&rooms[k % rooms.len()], k / rooms.len());
        let from = stand(setup, room, corner);
        let ahead = room.center() - from;
        Camera {
            eye_in_world: Vec3::new(from.x, EYE_M, from.y),
            world_from_camera: yaw_rotation(math::atan2(-ahead.x, -ahead.y)),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: size_px,
            height: size_px,
        }
    });
    views.collect()
}

/// The clear point (x, z) nearest to a corner of a room, corners counted from the least
/// coordinates across the room and on.
fn stand(setup: &Setup, room: &Rect, corner: usize) -> Vec2 {
    let (min, max) = (room.min + FROM_WALL_M, room.max - FROM_WALL_M);
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
            let away = (p - corner).length_squared();
            if away < best.0 && setup.things.iter().all(|t| is_clear_of(p, t)) {
                best = (away, p);
            }
        }
    }
    best.1
}

/// Whether an eye at (x, z) isn't in or right before a thing.
fn is_clear_of(p: Vec2, thing: &Thing) -> bool {
    let half = 0.5 * thing.size_m();
    let reach = FROM_THING_M + Vec2::new(half.x, half.z).length();
    let d = p - Vec2::new(thing.position.x, thing.position.z);
    let top = thing.position.y + thing.size_m().y;
    // What is low is looked over.
    top < EYE_M - 0.4 || thing.position.y > EYE_M || d.length() > reach
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eyes_are_spread_over_the_rooms_and_see_things() {
        let scene = BenchScene::house(house::N_THINGS, 64).expect("its seeds are fixed");
        let setup = scene.world.setup();
        for room in &setup.rooms {
            let inside =
                |c: &&Camera| room.rect.contains(Vec2::new(c.eye_in_world.x, c.eye_in_world.z));
            assert!(scene.cameras.iter().filter(inside).count() >= 2, "{room:?}");
        }
        let images = Scene::new(setup).render(&scene.world, &scene.views(Channels::DEPTH_AND_IDS));
        for (k, image) in images.into_iter().enumerate() {
            let (ids, depth) = (image.ids.expect("asked for"), image.depth_m.expect("asked for"));
            let things: std::collections::BTreeSet<u16> =
                ids.into_iter().filter(|id| EntityId(*id).is_object()).collect();
            assert!(things.len() >= 5, "view {k} sees {} things", things.len());
            let mean = depth.iter().sum::<f32>() / depth.len() as f32;
            assert!((1.0..12.0).contains(&mean), "view {k} looks {mean} m far");
        }
    }
}
