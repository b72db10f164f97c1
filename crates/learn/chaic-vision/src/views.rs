//! Labeled views of generated episodes with randomized scenes, for training and evaluation of the
//! detector.

use std::f32::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, EntityId, Role, TaskId, Vec2, Vec3};
pub use chaic_episodes::DatasetSplit;
use chaic_episodes::{GeneratorSeeds, SeedRange, Settings, generate_with};
use chaic_render::{Appearance, Channels, Scene, View};
use chaic_world::{ObjectSpec, Posture, Rules, Setup, State, Surface, World, top_surfaces};

use serde::{Deserialize, Serialize};

use crate::labels::{class_of, label_of};
use crate::structures::instance_ids;

/// Distribution of views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ViewConfig {
    /// Side of images, pixels.
    pub size_px: u32,
    /// Fraction of carriable objects, obstacles and movable heavy objects that are replaced by a
    /// random class of the same kind.
    #[serde(alias = "swapped")]
    pub swap_fraction: f32,
    /// Number of objects added to a scene, on top of furniture and on the ground.
    #[serde(alias = "added")]
    pub n_added: usize,
    /// Fraction of added objects drawn from all small classes; the others are carriable.
    #[serde(alias = "decor")]
    pub decor_fraction: f32,
    /// Fraction of added objects drawn from all furniture, on the ground or, if flat, above it.
    #[serde(alias = "large")]
    pub large_fraction: f32,
    /// Fraction of furniture that is replaced by a class of similar size, and the maximum ratio of
    /// their extents.
    #[serde(alias = "refurnished")]
    pub furniture_swap: (f32, f32),
    /// Fraction of scenes that contain and aim at a class drawn uniformly from the catalogue.
    #[serde(alias = "wanted")]
    pub wanted_class_fraction: f32,
    /// Fraction of people who carry objects, and of views from behind a carried object.
    #[serde(alias = "carrying")]
    pub carrying_fraction: f32,
    /// Fraction of containers that are filled.
    #[serde(alias = "filled")]
    pub filled_fraction: f32,
    /// Fraction of scenes with random lights and colors.
    #[serde(alias = "varied")]
    pub varied_fraction: f32,
    /// Fraction of views that aim at an object; the others have a random pose.
    #[serde(alias = "aimed")]
    pub aimed_fraction: f32,
    /// Fraction of aimed views that aim at a movable object.
    #[serde(alias = "aimed_movable")]
    pub aimed_movable_fraction: f32,
    /// Range of distances to the aimed object, meters, log-uniform.
    pub distance_m: [f32; 2],
}

impl ViewConfig {
    /// Distribution of the bundled detector's training.
    pub const TRAINING: ViewConfig = ViewConfig {
        size_px: 512,
        swap_fraction: 0.7,
        n_added: 24,
        decor_fraction: 0.2,
        large_fraction: 0.06,
        furniture_swap: (0.3, 1.8),
        wanted_class_fraction: 0.5,
        carrying_fraction: 0.4,
        filled_fraction: 0.3,
        varied_fraction: 0.35,
        aimed_fraction: 0.8,
        aimed_movable_fraction: 0.75,
        distance_m: [0.6, 5.0],
    };

    /// Initial scenes with additional objects, which show all classes about equally often. The
    /// reported accuracy is measured on this distribution.
    pub const ALL_CLASSES: ViewConfig = ViewConfig {
        n_added: 4,
        decor_fraction: 0.3,
        large_fraction: 0.1,
        furniture_swap: (0.2, 1.8),
        wanted_class_fraction: 1.0,
        carrying_fraction: 0.2,
        filled_fraction: 0.1,
        varied_fraction: 0.0,
        aimed_fraction: 0.6,
        aimed_movable_fraction: 0.5,
        ..ViewConfig::TRAINING
    };

    /// Initial scenes from random poses. Score calibration uses this distribution.
    pub const NATURAL: ViewConfig = ViewConfig {
        swap_fraction: 0.0,
        n_added: 0,
        furniture_swap: (0.0, 1.0),
        wanted_class_fraction: 0.0,
        carrying_fraction: 0.2,
        filled_fraction: 0.1,
        varied_fraction: 0.0,
        aimed_fraction: 0.3,
        ..ViewConfig::TRAINING
    };
}

impl Default for ViewConfig {
    fn default() -> ViewConfig {
        ViewConfig::TRAINING
    }
}

/// Image with labels.
#[derive(Clone, Debug)]
pub struct LabeledView {
    /// The camera.
    pub camera: Camera,
    /// Color, shape [height, width, 3].
    pub rgb: Vec<u8>,
    /// Depth in meters, shape [height, width].
    pub depth_m: Vec<f32>,
    /// Instance ids, shape [height, width].
    pub ids: Vec<u16>,
    /// The label of each id.
    pub labels: Vec<u8>,
    /// Object that the view aims at.
    pub aimed_at: Option<EntityId>,
}

/// Sequence of views, several of each scene.
pub struct SyntheticViews {
    split: DatasetSplit,
    config: ViewConfig,
    rng: RngStream,
    scene: Option<ViewScene>,
    /// Views left before the next scene.
    views_left: usize,
}

/// Number of views per scene.
const VIEWS_PER_SCENE: usize = 2;
/// Maximum number of attempts to render one view.
const MAX_ATTEMPTS: usize = 4;
/// Maximum fraction of pixels nearer than [`NEAR_M`]; more means that the camera is inside an
/// object.
const MAX_NEAR_FRACTION: f32 = 0.1;
const NEAR_M: f32 = 0.3;
/// Side of the reference image for minimum pixel counts, pixels.
const REFERENCE_SIZE_PX: u32 = 512;
/// Minimum pixels of the aimed object in an image of [`REFERENCE_SIZE_PX`].
const MIN_AIMED_PX: usize = 24;

/// Maximum extent of added small objects and maximum height of surfaces below them, meters.
const MAX_ADDED_M: f32 = 0.7;
const MAX_TOP_M: f32 = 2.0;
/// Maximum thickness of wall objects, meters.
const FLAT_M: f32 = 0.1;

/// Number of candidate positions for a large object.
const LARGE_CANDIDATES: usize = 12;

struct ViewScene {
    world: World,
    scene: Scene,
    labels: Vec<u8>,
    /// Instance id of each entity; panels of one structure have the same.
    instance_ids: Vec<u16>,
    postures: Vec<Posture>,
    /// Label that views aim at.
    aimed_label: Option<u8>,
}

impl SyntheticViews {
    /// Creates the sequence with this seed and index.
    pub fn new(split: DatasetSplit, config: ViewConfig, seed: u64, index: u64) -> SyntheticViews {
        let rng = RngStream::new(seed, "views", index);
        SyntheticViews { split, config, rng, scene: None, views_left: 0 }
    }

    /// Returns the next view.
    pub fn draw(&mut self) -> LabeledView {
        self.draw_unless_stopped(&AtomicBool::new(false)).expect("the flag is never set")
    }

    /// Returns the next view; `None` if `stop` is set meanwhile.
    pub fn draw_unless_stopped(&mut self, stop: &AtomicBool) -> Option<LabeledView> {
        loop {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            if self.views_left == 0 {
                self.scene = self.new_scene();
                self.views_left = VIEWS_PER_SCENE;
            }
            self.views_left -= 1;
            let Some(mut scene) = self.scene.take() else {
                self.views_left = 0;
                continue;
            };
            let view = (0..MAX_ATTEMPTS).find_map(|_| self.render_view(&mut scene));
            self.scene = Some(scene);
            if view.is_some() {
                return view;
            }
        }
    }

    fn new_scene(&mut self) -> Option<ViewScene> {
        let rng = &mut self.rng;
        let tasks: Vec<TaskId> = TaskId::all().collect();
        let task = tasks[rng.below(tasks.len())];
        let range = SeedRange::perception(self.split);
        let mut seed = || range.draw(rng);
        let seeds = GeneratorSeeds { place: seed(), episode: seed() };
        let settings = if rng.chance(0.7) { Settings::STANDARD } else { Settings::PAPER };
        let original = generate_with(task, seeds, settings).ok()?;
        let rng = &mut self.rng;
        let classes: Vec<ClassId> = ClassId::all().collect();
        let wanted = rng
            .chance(self.config.wanted_class_fraction)
            .then(|| classes[rng.below(classes.len())]);
        let setup = self.randomize(&original, wanted);
        let rng = &mut self.rng;
        let world = World::new(setup, Rules::paper()).ok()?;
        let appearance = match rng.chance(self.config.varied_fraction) {
            true => Appearance::Varied { seed: rng.below(1 << 24) as u64 },
            false => Appearance::Canonical,
        };
        let scene = Scene::with_appearance(world.setup(), appearance);
        let labels: Vec<u8> = world.classes().into_iter().map(label_of).collect();
        let postures = world.setup().agents().map(|agent| world.posture(agent)).collect();
        let aimed_label = wanted.map(|class| label_of(Some(class)));
        let instance_ids = instance_ids(world.setup(), labels.len());
        Some(ViewScene { world, scene, labels, instance_ids, postures, aimed_label })
    }

    /// Returns the setup with replaced small objects, obstacles and furniture, and with additional
    /// objects; one of them is of the class `wanted` if it fits.
    fn randomize(&mut self, original: &Setup, wanted: Option<ClassId>) -> Setup {
        let rng = &mut self.rng;
        let classes_with_role = |predicate: &dyn Fn(Role) -> bool| -> Vec<ClassId> {
            ClassId::all().filter(|c| predicate(c.info().role)).collect()
        };
        let small =
            classes_with_role(&|r| matches!(r, Role::Target | Role::Container | Role::Fragile));
        let obstacles = classes_with_role(&|r| r == Role::Obstacle);
        let heavy = classes_with_role(&|r| r == Role::HeavyTarget);
        let furniture = classes_with_role(&|r| matches!(r, Role::Furnishing | Role::HeavyTarget));
        let (swap_fraction, max_ratio) = self.config.furniture_swap;
        let mut setup = original.clone();
        for object in &mut setup.things {
            let size_m = object.size_m();
            let is_similar = |class: &ClassId| {
                let extents = class.info().size_m.into_iter().zip(size_m.to_array());
                extents.into_iter().all(|(a, b)| a.max(b) < max_ratio * a.min(b))
            };
            let similar: Vec<ClassId>;
            let (candidates, probability) = match object.class.info().role {
                Role::Target | Role::Container | Role::Fragile => {
                    (&small, self.config.swap_fraction)
                }
                Role::Obstacle => (&obstacles, self.config.swap_fraction),
                Role::HeavyTarget if !object.fixed => (&heavy, self.config.swap_fraction),
                Role::Furnishing => {
                    similar = furniture.iter().copied().filter(is_similar).collect();
                    (&similar, swap_fraction)
                }
                _ => continue,
            };
            if !candidates.is_empty() && rng.chance(probability) {
                let class = candidates[rng.below(candidates.len())];
                let yaw_rad = match class.info().role {
                    Role::Furnishing => object.yaw_rad,
                    _ => rng.range(-PI, PI),
                };
                let variant = rng.below(256) as u8;
                *object =
                    ObjectSpec { variant, ..ObjectSpec::new(class, object.position, yaw_rad) };
            }
        }
        let is_small = |c: &ClassId| c.info().size_m.into_iter().all(|m| m < MAX_ADDED_M);
        let decor: Vec<ClassId> = furniture.iter().copied().filter(is_small).collect();
        let mut added: Vec<ClassId> = Vec::new();
        let is_object = |c: &ClassId| {
            [&small, &obstacles, &furniture].into_iter().any(|classes| classes.contains(c))
        };
        added.extend(wanted.filter(is_object));
        for _ in 0..self.config.n_added {
            let candidates = match rng.chance(self.config.large_fraction) {
                true => &furniture,
                false if rng.chance(self.config.decor_fraction) => &decor,
                false => &small,
            };
            added.extend(rng.choose(candidates));
        }
        let tops: Vec<Surface> = setup
            .things
            .iter()
            .filter(|t| !t.class.info().is_carriable())
            .flat_map(top_surfaces)
            .filter(|top| top.center.y < MAX_TOP_M)
            .collect();
        for class in added {
            let position = match rng.choose(&tops) {
                _ if !is_small(&class) => {
                    let is_flat = class.info().size_m.into_iter().any(|m| m < FLAT_M);
                    let above_m = if is_flat { rng.range(0.0, 1.2) } else { 0.0 };
                    clear_position(&setup, rng) + above_m * Vec3::Y
                }
                Some(top) if rng.chance(0.7) => {
                    let at = Vec3::new(
                        rng.range(-top.half[0], top.half[0]),
                        0.0,
                        rng.range(-top.half[1], top.half[1]),
                    );
                    top.center + yaw_rotation(top.yaw_rad) * (0.9 * at)
                }
                _ => ground_position(&setup, rng),
            };
            let yaw_rad = rng.range(-PI, PI);
            let variant = rng.below(256) as u8;
            setup.things.push(ObjectSpec { variant, ..ObjectSpec::new(class, position, yaw_rad) });
        }
        setup
    }

    /// Renders a view; `None` if the aimed object is not visible or the camera is inside an object.
    fn render_view(&mut self, scene: &mut ViewScene) -> Option<LabeledView> {
        let rng = &mut self.rng;
        let size_px = self.config.size_px;
        let aimed_at = rng.chance(self.config.aimed_fraction).then(|| {
            let is_movable = rng.chance(self.config.aimed_movable_fraction);
            let wanted = scene.aimed_label.and_then(|label| object_with_label(scene, label, rng));
            wanted.or_else(|| random_object(scene, is_movable, rng))
        });
        let aimed_at = aimed_at.flatten();
        let eye_m = if rng.chance(0.7) { 1.65 } else { rng.range(1.05, 1.75) };
        let bounds = scene.world.setup().bounds;
        let (eye, yaw_rad) = match aimed_at {
            Some(entity) => {
                let [near_m, far_m] = self.config.distance_m;
                let visible_m = max_visible_distance_m(object_size_m(scene, entity), size_px);
                let far_m = visible_m.clamp(1.5 * near_m, far_m);
                let [near, far] = [near_m, far_m].map(log2);
                let distance_m = exp2(rng.range(near, far));
                let direction = yaw_rotation(rng.range(-PI, PI)) * Vec3::NEG_Z;
                let target = target_position(scene, entity);
                let eye = target - distance_m * direction;
                let yaw_rad = chaic_core::geom::yaw_towards(eye, target) + rng.range(-0.6, 0.6);
                (Vec2::new(eye.x, eye.z), yaw_rad)
            }
            None => {
                let eye = bounds.min + Vec2::new(rng.unit(), rng.unit()) * bounds.size();
                (eye, rng.range(-PI, PI))
            }
        };
        if !bounds.contains(eye) {
            return None;
        }
        let mut state = scene.world.state().clone();
        self.pose_people(scene, eye);
        self.place_held_objects(scene, eye, yaw_rad, &mut state);
        self.fill_containers(scene, &mut state);
        let camera = Camera {
            eye_in_world: Vec3::new(eye.x, eye_m, eye.y),
            world_from_camera: yaw_rotation(yaw_rad),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: size_px,
            height: size_px,
        };
        let view = View::from_camera(camera, Channels::ALL);
        let images = scene.scene.render_state(&state, &scene.postures, &[view]).pop()?;
        let (rgb, depth_m, mut ids) = (images.rgb?, images.depth_m?, images.ids?);
        let n_near = depth_m.iter().filter(|d| **d < NEAR_M).count();
        let n_aimed = aimed_at.map(|e| ids.iter().filter(|id| **id == e.0).count());
        if n_near as f32 > MAX_NEAR_FRACTION * depth_m.len() as f32
            || n_aimed.is_some_and(|n| n < min_aimed_px(size_px))
        {
            return None;
        }
        for id in &mut ids {
            *id = scene.instance_ids.get(usize::from(*id)).copied().unwrap_or(*id);
        }
        let aimed_at = aimed_at.map(|e| EntityId(scene.instance_ids[usize::from(e.0)]));
        Some(LabeledView { camera, rgb, depth_m, ids, labels: scene.labels.clone(), aimed_at })
    }

    /// Moves all people to random poses, some of them in front of the camera.
    fn pose_people(&mut self, scene: &mut ViewScene, eye: Vec2) {
        let rng = &mut self.rng;
        let bounds = scene.world.setup().bounds;
        for posture in &mut scene.postures {
            let at = match rng.chance(0.3) {
                true => eye + 4.0 * Vec2::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)),
                false => bounds.min + Vec2::new(rng.unit(), rng.unit()) * bounds.size(),
            };
            posture.pose.position = Vec3::new(at.x, 0.0, at.y);
            posture.pose.yaw_rad = rng.range(-PI, PI);
            posture.walked_m = rng.range(0.0, 3.0);
            posture.moving = rng.chance(0.5);
            posture.bend = if rng.chance(0.2) { rng.unit() } else { 0.0 };
            posture.stretch = if rng.chance(0.1) { rng.unit() } else { 0.0 };
        }
    }

    /// Puts objects into the hands of people and of the observer.
    fn place_held_objects(
        &mut self,
        scene: &mut ViewScene,
        eye: Vec2,
        yaw_rad: f32,
        state: &mut State,
    ) {
        let rng = &mut self.rng;
        let small = objects_with_roles(scene, &[Role::Target, Role::Container, Role::Fragile]);
        let heavy = objects_with_roles(scene, &[Role::HeavyTarget]);
        let mut observer = scene.postures.first().copied();
        if let Some(observer) = &mut observer {
            (observer.pose.position, observer.pose.yaw_rad) =
                (Vec3::new(eye.x, 0.0, eye.y), yaw_rad);
            observer.height_m = OBSERVER_HEIGHT_M;
        }
        for posture in scene.postures.iter_mut().chain(&mut observer) {
            posture.arms.iter_mut().for_each(|arm| arm.grips = false);
            if !rng.chance(self.config.carrying_fraction) {
                continue;
            }
            let rotation = yaw_rotation(posture.pose.yaw_rad);
            if rng.chance(0.15)
                && let Some(k) = rng.choose(&heavy).copied()
            {
                // The world holds jointly carried furniture in front of the body.
                let depth = scene.world.setup().things[k].size_m().z;
                let offset = Vec3::new(0.0, 0.45, -(0.3 + 0.5 * depth));
                state.objects[k].position = posture.pose.position + rotation * offset;
                state.objects[k].rotation = rotation;
                continue;
            }
            for (sign, arm) in [-1.0, 1.0].into_iter().zip(&mut posture.arms) {
                let Some(k) = rng.choose(&small).copied().filter(|_| rng.chance(0.7)) else {
                    continue;
                };
                // Position of held objects, relative to the body's height.
                let h = posture.height_m;
                arm.hand_in_body = Vec3::new(sign * 0.2, 0.57 * h, -0.31 * h);
                arm.grips = true;
                let half = 0.5 * scene.world.setup().things[k].size_m().y * Vec3::Y;
                state.objects[k].position =
                    posture.pose.position + rotation * arm.hand_in_body - half;
                state.objects[k].rotation = rotation;
            }
        }
    }

    /// Puts objects into containers.
    fn fill_containers(&mut self, scene: &ViewScene, state: &mut State) {
        let rng = &mut self.rng;
        let targets = objects_with_roles(scene, &[Role::Target, Role::Fragile]);
        for container in objects_with_roles(scene, &[Role::Container]) {
            if !rng.chance(self.config.filled_fraction) {
                continue;
            }
            let size = scene.world.setup().things[container].size_m();
            let (at, rotation) =
                (state.objects[container].position, state.objects[container].rotation);
            for slot in 0..1 + rng.below(3) {
                let Some(k) = rng.choose(&targets).copied() else { continue };
                let offset = 0.22 * (yaw_rotation(2.0 * PI / 3.0 * slot as f32) * Vec3::NEG_Z);
                let up = (0.12 * size.y).max(0.01);
                let slot = Vec3::new(offset.x * size.x, up, offset.z * size.z);
                state.objects[k].position = at + rotation * slot;
                state.objects[k].rotation = rotation;
            }
        }
    }
}

/// Height of the observer, meters.
const OBSERVER_HEIGHT_M: f32 = 1.75;

/// Indices of movable objects with one of these roles.
fn objects_with_roles(scene: &ViewScene, roles: &[Role]) -> Vec<usize> {
    let things = &scene.world.setup().things;
    let has_role = |object: &ObjectSpec| !object.fixed && roles.contains(&object.class.info().role);
    (0..things.len()).filter(|k| has_role(&things[*k])).collect()
}

/// Draws an object, uniformly over the classes in the scene. Draws a movable object, or any other
/// object, including people.
fn random_object(scene: &ViewScene, is_movable: bool, rng: &mut RngStream) -> Option<EntityId> {
    let is_candidate =
        |label: u8| class_of(label).is_some_and(|class| class.info().is_movable() == is_movable);
    let mut by_label: Vec<(u8, EntityId)> = (0..scene.labels.len())
        .map(|k| (scene.labels[k], EntityId(k as u16)))
        .filter(|(label, _)| is_candidate(*label))
        .collect();
    by_label.sort();
    let mut labels: Vec<u8> = by_label.iter().map(|(label, _)| *label).collect();
    labels.dedup();
    let label = *rng.choose(&labels)?;
    object_with_label(scene, label, rng)
}

/// Draws an object or person with this label.
fn object_with_label(scene: &ViewScene, label: u8, rng: &mut RngStream) -> Option<EntityId> {
    let entities: Vec<EntityId> = (0..scene.labels.len())
        .filter(|k| scene.labels[*k] == label)
        .map(|k| EntityId(k as u16))
        .collect();
    rng.choose(&entities).copied()
}

/// Returns a random position on the ground.
fn ground_position(setup: &Setup, rng: &mut RngStream) -> Vec3 {
    let at = setup.bounds.min + Vec2::new(rng.unit(), rng.unit()) * setup.bounds.size();
    Vec3::new(at.x, 0.0, at.y)
}

/// Returns the random position on the ground that is farthest from all objects, among several.
fn clear_position(setup: &Setup, rng: &mut RngStream) -> Vec3 {
    let clearance_m = |at: Vec3| {
        let gap_m = setup.things.iter().map(|object| {
            let gap = (object.position - at).abs() - 0.5 * object.size_m();
            gap.x.max(gap.z)
        });
        gap_m.fold(f32::INFINITY, f32::min)
    };
    let candidates: Vec<Vec3> =
        (0..LARGE_CANDIDATES).map(|_| ground_position(setup, rng)).collect();
    let best = candidates.into_iter().max_by(|a, b| clearance_m(*a).total_cmp(&clearance_m(*b)));
    best.unwrap_or(Vec3::ZERO)
}

fn target_position(scene: &ViewScene, entity: EntityId) -> Vec3 {
    match entity.agent() {
        Some(agent) => scene.postures[agent.index()].pose.position,
        None => {
            scene.world.state().objects[usize::from(entity.0 - EntityId::FIRST_OBJECT.0)].position
        }
    }
}

/// Returns the minimum number of pixels of the aimed object: the fraction of the image is the same at all
/// sizes.
fn min_aimed_px(size_px: u32) -> usize {
    let [side_px, reference_px] = [size_px, REFERENCE_SIZE_PX].map(|px| px as usize);
    (MIN_AIMED_PX * side_px * side_px).div_ceil(reference_px * reference_px)
}

fn object_size_m(scene: &ViewScene, entity: EntityId) -> [f32; 3] {
    let class = scene.labels.get(usize::from(entity.0)).and_then(|label| class_of(*label));
    class.map_or([1.0; 3], |class| class.info().size_m)
}

/// Returns the distance at which an object covers about 41 pixels of the image, meters: the focal length of
/// an image of 512 pixels is 256 pixels, and (256 / 40)² = 41.
fn max_visible_distance_m(mut size_m: [f32; 3], size_px: u32) -> f32 {
    size_m.sort_by(f32::total_cmp);
    let scale = size_px as f32 / REFERENCE_SIZE_PX as f32;
    40.0 * scale * (size_m[1] * size_m[2]).sqrt()
}

/// Base-2 logarithm, piecewise linear between powers of two; equal bits on every machine.
fn log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let mantissa = f32::from_bits(bits & 0x7f_ffff | 127 << 23);
    exponent as f32 + mantissa - 1.0
}

/// Inverse of [`log2`].
fn exp2(x: f32) -> f32 {
    let exponent = x.floor();
    f32::from_bits(((exponent as i32 + 127) as u32) << 23) * (1.0 + x - exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visibility_depends_on_the_size_of_the_image() {
        assert_eq!([32, 64, 128, 512, 1024].map(min_aimed_px), [1, 1, 2, 24, 96]);
        let distances_m = [128, 512].map(|px| max_visible_distance_m([1.0, 0.25, 4.0], px));
        assert_eq!(distances_m, [20.0, 80.0]);
    }
}
