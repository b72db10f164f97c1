//! Shared test helpers: a device if there is one, and worlds of every task.
#![allow(dead_code, reason = "each test takes what it needs")]

use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::{AgentId, Vec3};
use chaic_episodes::find_episode;
use chaic_render::{Channels, Scene, View};
use chaic_render_gpu::{Adapters, Gpu, GpuError};
use chaic_world::{Rules, World};

/// Returns a device of any kind, or prints a warning and returns `None`. On continuous integration,
/// a missing device is a failure.
pub fn gpu(test: &str) -> Option<Gpu> {
    match Gpu::new(Adapters::Any) {
        Ok(gpu) => {
            println!("{test} on {}", gpu.name());
            Some(gpu)
        }
        Err(error @ GpuError::NoAdapter { .. }) => {
            let in_ci = std::env::var("CI").is_ok_and(|v| v == "true" || v == "1");
            assert!(!in_ci, "{error}");
            eprintln!("SKIPPED: {test}: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Returns the world of an episode and its scene.
pub fn episode(id: &str) -> (World, Scene) {
    let episode = find_episode(id).expect("the episode is bundled");
    let world = World::new(episode.setup().clone(), Rules::paper()).expect("the setup is valid");
    let scene = Scene::new(world.setup());
    (world, scene)
}

/// Views from the eyes of all agents, and in further directions from each eye.
pub fn views(world: &World, size: u32, channels: Channels) -> Vec<View> {
    let mut views = Vec::new();
    for agent in world.setup().agents() {
        let eye = world.camera(agent, size);
        views.push(View::from_eye(agent, eye, channels));
        for k in 1..4 {
            let camera = Camera { world_from_camera: yaw_rotation(1.6 * k as f32), ..eye };
            views.push(View::from_eye(agent, camera, channels));
        }
    }
    // A view from above, with people in view and without ceilings.
    let eye = world.camera(AgentId::PARTNER, size);
    let down = chaic_core::Quat::from_rotation_x(-1.1);
    let above = Camera {
        eye_in_world: eye.eye_in_world + Vec3::new(0.3, 3.0, 1.5),
        world_from_camera: down,
        ..eye
    };
    views.push(View { hide_ceiling: true, ..View::from_camera(above, channels) });
    views
}
