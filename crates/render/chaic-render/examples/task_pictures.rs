//! Renders the images of the eight tasks for docs/benchmark.md:
//! `cargo run --release -p chaic-render --example task_pictures -- FOLDER`.
//!
//! Each image shows the partner in front of the object that its constraint is about. The program
//! tries positions for the partner and the camera around that object, and keeps the view that shows
//! both best.

use std::f32::consts::TAU;
use std::path::Path;

use chaic_core::geom::{Camera, Pose, forward, math, right, to_xz, yaw_towards};
use chaic_core::{EntityId, Role, TaskId, Vec3};
use chaic_episodes::{GeneratorSeeds, generate};
use chaic_render::{Channels, Scene, View, image_out};
use chaic_test_kit::scenes::{self, camera};
use chaic_world::{ObjectSpec, Posture, Setup, World};
use image::RgbImage;
use image::codecs::png::{CompressionType, FilterType as PngFilter, PngEncoder};
use image::imageops::{FilterType, resize};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Size of an image, pixels.
const SIZE_PX: (u32, u32) = (228, 171);
/// Vertical field of view, radians.
const FOV_RAD: f32 = 1.0;
/// Free space around the partner, meters.
const CLEARANCE_M: f32 = 0.25;

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).ok_or("usage: task_pictures FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    for task in TaskId::paper() {
        let world = scenes::world(generate(task, GeneratorSeeds { place: 7, episode: 7 })?);
        let picture = draw(task, &world);
        save(&picture, &folder.join(format!("task_{task}.png")))?;
    }
    Ok(())
}

/// Writes a PNG file with the strongest compression.
fn save(picture: &RgbImage, path: &Path) -> image::ImageResult<()> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, PngFilter::Adaptive);
    picture.write_with_encoder(encoder)
}

/// Objects that show the constraint of a task, the clearest first.
fn subjects(task: TaskId, setup: &Setup) -> Vec<usize> {
    let is_target = |k: usize| setup.goal.count(setup.things[k].class) > 0;
    let role = |k: usize| setup.things[k].class.info().role;
    let height = |k: usize| setup.things[k].position.y;
    let mut all: Vec<usize> = (0..setup.things.len()).collect();
    all.retain(|k| match task {
        TaskId::HighTarget => is_target(*k) && height(*k) > 1.5,
        TaskId::LowTarget => is_target(*k) && height(*k) < 0.1,
        TaskId::HighContainer => role(*k) == Role::Container && height(*k) > 1.5,
        TaskId::Obstacle => role(*k) == Role::Obstacle,
        TaskId::HighGoal => setup.goal_places.contains(&Setup::entity(*k)),
        TaskId::Shopping => role(*k) == Role::Vehicle,
        TaskId::MovingHouse => role(*k) == Role::HeavyTarget,
        _ => is_target(*k) && height(*k) > 0.5,
    });
    let volume = |k: usize| setup.things[k].size_m().element_product();
    all.sort_by(|a, b| volume(*b).total_cmp(&volume(*a)));
    all.truncate(4);
    all
}

/// Posture of the partner at a pose, while it works on the task.
fn partner(task: TaskId, world: &World, pose: Pose) -> Posture {
    let mut p = Posture { pose, ..world.posture(chaic_core::AgentId::PARTNER) };
    let h = p.height_m;
    let mut arms = |y: f32, z: f32, grips: bool| {
        for (arm, side) in p.arms.iter_mut().zip([-1.0, 1.0]) {
            arm.hand_in_body = Vec3::new(0.16 * side, y, z);
            arm.grips = grips;
        }
    };
    match task {
        TaskId::HighTarget | TaskId::HighContainer | TaskId::HighGoal => {
            arms(1.17 * h, -0.2, false);
            p.stretch = 1.0;
        }
        TaskId::MovingHouse => {
            arms(0.4 * h, -0.45, true);
            (p.bend, p.failing) = (0.35, true);
        }
        TaskId::LowTarget => p.arms[1].hand_in_body = Vec3::new(0.36, 0.45, -0.35),
        TaskId::NoConstraint => p.arms[1].hand_in_body = Vec3::new(0.2, 0.55 * h, -0.4),
        _ => {}
    }
    p
}

/// Returns whether a body has space at a point, apart from the object that it handles.
fn is_free(setup: &Setup, at: Vec3, own: usize) -> bool {
    let is_inside = setup.bounds.expanded(-0.3).contains(to_xz(at));
    let is_clear = |k: usize| {
        let object = &setup.things[k];
        let distance = (to_xz(object.position) - to_xz(at)).length();
        k == own || object.position.y > 0.3 || distance > CLEARANCE_M + object.half_longer_side_m()
    };
    is_inside && (0..setup.things.len()).all(is_clear)
}

/// Camera at `eye` that looks at `at`.
fn look(eye: Vec3, at: Vec3) -> Camera {
    let d = at - eye;
    let pitch = math::atan2(d.y, to_xz(d).length());
    let camera = camera(eye.into(), yaw_towards(eye, at), pitch, SIZE_PX.0, SIZE_PX.1);
    Camera { vertical_fov_rad: FOV_RAD, ..camera }
}

/// Postures of the people in an image: the partner in front of an object, and in shopping the child
/// beside it.
fn people(task: TaskId, world: &World, pose: Pose) -> Vec<Posture> {
    let mut postures = vec![partner(task, world, pose)];
    if task == TaskId::Shopping {
        // The helper is out of sight.
        let hidden = Pose { position: Vec3::new(0.0, -9.0, 0.0), yaw_rad: 0.0 };
        let beside = 0.9 * right(pose.yaw_rad) + 0.3 * forward(pose.yaw_rad);
        let child = Pose { position: pose.position + beside, yaw_rad: pose.yaw_rad - 1.6 };
        let others = world.setup().agents().map(|a| world.posture(a)).skip(1).zip([hidden, child]);
        let walking = |(p, pose)| Posture { pose, moving: true, walked_m: 0.3, ..p };
        postures.extend(others.map(walking));
    }
    postures
}

/// Poses from which the partner could handle an object, with free space around.
fn poses(task: TaskId, setup: &Setup, subject: usize) -> Vec<Pose> {
    let object = &setup.things[subject];
    let reach_m = if task == TaskId::LowTarget { 0.85 } else { 0.45 };
    let half_m = 0.5 * object.size_m().x.min(object.size_m().z);
    // High objects stand on furniture, which needs space too.
    let half_m = if object.position.y > 1.2 { half_m.max(0.35) } else { half_m };
    let at = |k: usize| {
        let at = object.position + (reach_m + half_m) * forward(TAU * k as f32 / 16.0);
        let position = Vec3::new(at.x, 0.0, at.z);
        Pose { position, yaw_rad: yaw_towards(position, object.position) }
    };
    (0..16).map(at).filter(|pose| is_free(setup, pose.position, subject)).collect()
}

/// Cameras around the partner and an object.
fn cameras(pose: Pose, height_m: f32, object: &ObjectSpec) -> Vec<Camera> {
    let top_m = (object.position.y + 0.5 * object.size_m().y).min(2.0);
    let middle = 0.5 * (pose.position + object.position);
    let middle = Vec3::new(middle.x, 0.5 * (0.5 * height_m + top_m), middle.z);
    let mut found = Vec::new();
    for k in 0..24 {
        for distance_m in [2.0, 2.6, 3.2] {
            let eye = middle + distance_m * forward(TAU * k as f32 / 24.0);
            found.push(look(Vec3::new(eye.x, 1.5, eye.z), middle));
        }
    }
    found
}

fn draw(task: TaskId, world: &World) -> RgbImage {
    let setup = world.setup();
    let scene = Scene::new(setup);
    let mut best: Option<(f32, Vec<Posture>, Camera)> = None;
    for subject in subjects(task, setup) {
        for pose in poses(task, setup, subject) {
            let postures = people(task, world, pose);
            for camera in cameras(pose, postures[0].height_m, &setup.things[subject]) {
                let visibility_score =
                    visibility_score(&scene, world, &postures, camera, Setup::entity(subject));
                let view = camera.world_from_camera * Vec3::Z;
                let score = visibility_score + 0.5 * right(pose.yaw_rad).dot(view).abs();
                if best.as_ref().is_none_or(|(b, ..)| score > *b) {
                    best = Some((score, postures.clone(), camera));
                }
            }
        }
    }
    let (score, postures, camera) =
        best.expect("every task has a subject with free space beside it");
    println!("{task}: {score:.3}");
    let (width, height) = (3 * camera.width, 3 * camera.height);
    let view = View::from_camera(Camera { width, height, ..camera }, Channels::RGB);
    let images = scene.render_state(world.state(), &postures, &[view]);
    let rgb = images.into_iter().next().and_then(|i| i.rgb).unwrap_or_default();
    let large = image_out::rgb(&rgb, width, height).unwrap_or_else(|| RgbImage::new(width, height));
    resize(&large, camera.width, camera.height, FilterType::Triangle)
}

/// Rates how well a camera shows the people and an object: up to 1 each.
fn visibility_score(
    scene: &Scene,
    world: &World,
    postures: &[Posture],
    camera: Camera,
    object: EntityId,
) -> f32 {
    let camera = Camera { width: camera.width / 3, height: camera.height / 3, ..camera };
    let view = View::from_camera(camera, Channels::DEPTH_AND_IDS);
    let images = scene.render_state(world.state(), postures, &[view]);
    let ids = images.into_iter().next().and_then(|i| i.ids).unwrap_or_default();
    let width = camera.width as usize;
    let is_border = |k: usize| {
        k < width || k >= ids.len() - width || k.is_multiple_of(width) || k % width == width - 1
    };
    // A pixel at the border of the image means that a part is cut off.
    let pixel_share = |entity: u16| {
        let pixels = ids.iter().enumerate().filter(|(_, id)| **id == entity);
        pixels.map(|(k, _)| if is_border(k) { -8.0 } else { 1.0 }).sum::<f32>() / ids.len() as f32
    };
    let people = (0..postures.len() as u16).filter(|k| *k != 1);
    let people = people.map(|k| (pixel_share(EntityId::FIRST_PERSON.0 + k) / 0.05).min(1.0));
    people.fold(f32::INFINITY, f32::min) + (pixel_share(object.0) / 0.012).min(1.0)
}
