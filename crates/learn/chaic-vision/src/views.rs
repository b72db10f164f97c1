//! Random views of generated episodes with labels: what the detector learns from, and is held
//! against.

use std::f32::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::rng::Stream;
use chaic_core::{ClassId, EntityId, Role, TaskId, Vec2, Vec3};
use chaic_episodes::{Seeds, Settings, generate_with};
use chaic_render::{Appearance, Channels, Scene, View};
use chaic_world::{Posture, Rules, Setup, State, Surface, Thing, World, top_surfaces};

use serde::{Deserialize, Serialize};

use crate::labels::{class_of, label_of};

/// Which episodes views come from. The seeds of parts don't overlap, and lie far beyond those of
/// the standard split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// To learn from.
    Training,
    /// To choose by.
    Validation,
    /// To tell how good the one that was chosen is.
    Test,
}

impl Part {
    /// The first seed, and how many there are.
    pub(crate) fn seeds(self) -> (u64, usize) {
        match self {
            Part::Training => (10_000_000, 1_000_000),
            Part::Validation => (20_000_000, 10_000),
            Part::Test => (30_000_000, 10_000),
        }
    }
}

/// How views are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ViewRules {
    /// Side of images, pixels.
    pub size_px: u32,
    /// Share of carriable things that become another class of carriable thing, each equally often.
    pub swapped: f32,
    /// So many small things are added to a scene, on tops of furniture and on the ground.
    pub added: usize,
    /// Share of added things that are any small thing of the catalogue; the others can be carried.
    pub decor: f32,
    /// Share of added things that are any furniture of the catalogue, on the ground or, if they are flat,
    /// above it.
    pub large: f32,
    /// Share of furniture that becomes another class of about its size, and the largest ratio of two
    /// extents that are about alike.
    pub refurnished: (f32, f32),
    /// Share of scenes in which a class of the catalogue, each equally often, is put and looked at.
    pub wanted: f32,
    /// Share of people who carry something before them, and of views from behind a burden.
    pub carrying: f32,
    /// Share of containers with something in them.
    pub filled: f32,
    /// Share of scenes in light and colors drawn at random.
    pub varied: f32,
    /// Share of views that look at one thing; the others look anywhere.
    pub aimed: f32,
    /// Share of these that look at something that can be moved.
    pub aimed_movable: f32,
    /// Distance to the thing that is looked at, metres; near and far ones equally often by their
    /// logarithm.
    pub distance_m: [f32; 2],
}

impl ViewRules {
    /// What the detector is trained with.
    pub const TRAINING: ViewRules = ViewRules {
        size_px: 512,
        swapped: 0.7,
        added: 24,
        decor: 0.2,
        large: 0.06,
        refurnished: (0.3, 1.8),
        wanted: 0.5,
        carrying: 0.4,
        filled: 0.3,
        varied: 0.35,
        aimed: 0.8,
        aimed_movable: 0.75,
        distance_m: [0.6, 5.0],
    };

    /// Places as episodes begin with other things in them, so that every class of the catalogue is looked
    /// at about equally often; what the detector is told to be good at.
    pub const ALL_CLASSES: ViewRules = ViewRules {
        added: 4,
        decor: 0.3,
        large: 0.1,
        refurnished: (0.2, 1.8),
        wanted: 1.0,
        carrying: 0.2,
        filled: 0.1,
        varied: 0.0,
        aimed: 0.6,
        aimed_movable: 0.5,
        ..ViewRules::TRAINING
    };

    /// Places as episodes begin, seen from anywhere; what scores are calibrated by.
    pub const NATURAL: ViewRules = ViewRules {
        swapped: 0.0,
        added: 0,
        refurnished: (0.0, 1.0),
        wanted: 0.0,
        carrying: 0.2,
        filled: 0.1,
        varied: 0.0,
        aimed: 0.3,
        ..ViewRules::TRAINING
    };
}

impl Default for ViewRules {
    fn default() -> ViewRules {
        ViewRules::TRAINING
    }
}

/// An image with labels.
#[derive(Clone, Debug)]
pub struct LabelledView {
    /// The camera.
    pub camera: Camera,
    /// Color, shape [height, width, 3].
    pub rgb: Vec<u8>,
    /// Depth in metres, shape [height, width].
    pub depth_m: Vec<f32>,
    /// Instance ids, shape [height, width].
    pub ids: Vec<u16>,
    /// The label of each id.
    pub labels: Vec<u8>,
    /// A thing that the view was aimed at, if any.
    pub aimed_at: Option<EntityId>,
}

/// Views of one scene after the other.
pub struct Views {
    part: Part,
    rules: ViewRules,
    rng: Stream,
    scene: Option<Place>,
    /// Views still to be taken of the scene.
    left: usize,
}

/// Views of one scene, before the next one.
const VIEWS_OF_SCENE: usize = 2;
/// Views that are tried before another thing is looked at.
const TRIES: usize = 4;
/// A view with more of this share of pixels nearer than [`TOO_NEAR_M`] stands in something.
const MOST_NEAR: f32 = 0.1;
const TOO_NEAR_M: f32 = 0.3;
/// Things that fewer pixels show aren't aimed at.
const LEAST_AIMED_PX: usize = 24;

/// Added things are no larger than this, and lie no higher, metres.
const LARGEST_ADDED_M: f32 = 0.7;
const HIGHEST_TOP_M: f32 = 2.0;
/// What has an extent below this may hang on a wall, metres.
const FLAT_M: f32 = 0.1;

/// Places that are tried for large things.
const LARGE_PLACES: usize = 12;

struct Place {
    world: World,
    scene: Scene,
    labels: Vec<u8>,
    postures: Vec<Posture>,
    /// The label that views are aimed at.
    wanted: Option<u8>,
}

impl Views {
    /// The stream of views of this name.
    pub fn new(part: Part, rules: ViewRules, seed: u64, index: u64) -> Views {
        let rng = Stream::new(seed, "views", index);
        Views { part, rules, rng, scene: None, left: 0 }
    }

    /// The next one.
    pub fn draw(&mut self) -> LabelledView {
        self.draw_unless(&AtomicBool::new(false)).expect("nobody raises the flag")
    }

    /// Returns the next one; `None` if `stop` is raised meanwhile.
    pub fn draw_unless(&mut self, stop: &AtomicBool) -> Option<LabelledView> {
        loop {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            if self.left == 0 {
                self.scene = self.place();
                self.left = VIEWS_OF_SCENE;
            }
            self.left -= 1;
            let Some(mut place) = self.scene.take() else {
                self.left = 0;
                continue;
            };
            let view = (0..TRIES).find_map(|_| self.look(&mut place));
            self.scene = Some(place);
            if view.is_some() {
                return view;
            }
        }
    }

    fn place(&mut self) -> Option<Place> {
        let rng = &mut self.rng;
        let tasks: Vec<TaskId> = TaskId::all().collect();
        let task = tasks[rng.below(tasks.len())];
        let (first, n) = self.part.seeds();
        let mut seed = || first + rng.below(n) as u64;
        let seeds = Seeds { place: seed(), episode: seed() };
        let settings = if rng.chance(0.7) { Settings::STANDARD } else { Settings::PAPER };
        let usual = generate_with(task, seeds, settings).ok()?;
        let rng = &mut self.rng;
        let classes: Vec<ClassId> = ClassId::all().collect();
        let wanted = rng.chance(self.rules.wanted).then(|| classes[rng.below(classes.len())]);
        let setup = self.swapped(&usual, wanted);
        let rng = &mut self.rng;
        let world = World::new(setup, Rules::paper()).ok()?;
        let appearance = match rng.chance(self.rules.varied) {
            true => Appearance::Varied { seed: rng.below(1 << 24) as u64 },
            false => Appearance::Canonical,
        };
        let scene = Scene::with_appearance(world.setup(), appearance);
        let labels = world.classes().into_iter().map(label_of).collect();
        let postures = world.setup().agents().map(|agent| world.posture(agent)).collect();
        let wanted = wanted.map(|class| label_of(Some(class)));
        Some(Place { world, scene, labels, postures, wanted })
    }

    /// The same with other small things where small things lie, other obstacles and furniture where such
    /// stand, and more things; one of the class that is wanted among them, if it can be put anywhere.
    fn swapped(&mut self, usual: &Setup, wanted: Option<ClassId>) -> Setup {
        let rng = &mut self.rng;
        let of = |is: &dyn Fn(Role) -> bool| -> Vec<ClassId> {
            ClassId::all().filter(|c| is(c.info().role)).collect()
        };
        let small = of(&|r| matches!(r, Role::Target | Role::Container | Role::Fragile));
        let obstacles = of(&|r| r == Role::Obstacle);
        let heavy = of(&|r| r == Role::HeavyTarget);
        let furniture = of(&|r| matches!(r, Role::Furnishing | Role::HeavyTarget));
        let (refurnished, ratio) = self.rules.refurnished;
        let mut setup = usual.clone();
        for thing in &mut setup.things {
            let size_m = thing.size_m();
            let alike = |class: &ClassId| {
                let extents = class.info().size_m.into_iter().zip(size_m.to_array());
                extents.into_iter().all(|(a, b)| a.max(b) < ratio * a.min(b))
            };
            let of_its_size: Vec<ClassId>;
            let (among, share) = match thing.class.info().role {
                Role::Target | Role::Container | Role::Fragile => (&small, self.rules.swapped),
                Role::Obstacle => (&obstacles, self.rules.swapped),
                Role::HeavyTarget if !thing.fixed => (&heavy, self.rules.swapped),
                Role::Furnishing => {
                    of_its_size = furniture.iter().copied().filter(alike).collect();
                    (&of_its_size, refurnished)
                }
                _ => continue,
            };
            if !among.is_empty() && rng.chance(share) {
                let class = among[rng.below(among.len())];
                let yaw_rad = match class.info().role {
                    Role::Furnishing => thing.yaw_rad,
                    _ => rng.range(-PI, PI),
                };
                let variant = rng.below(256) as u8;
                *thing = Thing { variant, ..Thing::new(class, thing.position, yaw_rad) };
            }
        }
        let is_small = |c: &ClassId| c.info().size_m.into_iter().all(|m| m < LARGEST_ADDED_M);
        let decor: Vec<ClassId> = furniture.iter().copied().filter(is_small).collect();
        let mut added: Vec<ClassId> = Vec::new();
        let is_a_thing = |c: &ClassId| {
            [&small, &obstacles, &furniture].into_iter().any(|classes| classes.contains(c))
        };
        added.extend(wanted.filter(is_a_thing));
        for _ in 0..self.rules.added {
            let among = match rng.chance(self.rules.large) {
                true => &furniture,
                false if rng.chance(self.rules.decor) => &decor,
                false => &small,
            };
            added.extend(rng.choose(among));
        }
        let tops: Vec<Surface> = setup
            .things
            .iter()
            .filter(|t| !t.class.info().is_carriable())
            .flat_map(top_surfaces)
            .filter(|top| top.center.y < HIGHEST_TOP_M)
            .collect();
        for class in added {
            let position = match rng.choose(&tops) {
                _ if !is_small(&class) => {
                    let is_flat = class.info().size_m.into_iter().any(|m| m < FLAT_M);
                    let above_m = if is_flat { rng.range(0.0, 1.2) } else { 0.0 };
                    clear_place(&setup, rng) + above_m * Vec3::Y
                }
                Some(top) if rng.chance(0.7) => {
                    let at = Vec3::new(
                        rng.range(-top.half[0], top.half[0]),
                        0.0,
                        rng.range(-top.half[1], top.half[1]),
                    );
                    top.center + yaw_rotation(top.yaw_rad) * (0.9 * at)
                }
                _ => ground(&setup, rng),
            };
            let yaw_rad = rng.range(-PI, PI);
            let variant = rng.below(256) as u8;
            setup.things.push(Thing { variant, ..Thing::new(class, position, yaw_rad) });
        }
        setup
    }

    /// A view of a place; `None` if it shows nothing of what it was aimed at, or stands in something.
    fn look(&mut self, place: &mut Place) -> Option<LabelledView> {
        let rng = &mut self.rng;
        let size = self.rules.size_px;
        let aimed_at = rng.chance(self.rules.aimed).then(|| {
            let is_movable = rng.chance(self.rules.aimed_movable);
            let of_class = place.wanted.and_then(|label| one_of(place, label, rng));
            of_class.or_else(|| aim(place, is_movable, rng))
        });
        let aimed_at = aimed_at.flatten();
        let eye_m = if rng.chance(0.7) { 1.65 } else { rng.range(1.05, 1.75) };
        let bounds = place.world.setup().bounds;
        let (at, yaw_rad) = match aimed_at {
            Some(entity) => {
                let [near_m, far_m] = self.rules.distance_m;
                let far_m = visible_m(place, entity).clamp(1.5 * near_m, far_m);
                let [near, far] = [near_m, far_m].map(log2);
                let distance_m = exp2(rng.range(near, far));
                let way = yaw_rotation(rng.range(-PI, PI)) * Vec3::NEG_Z;
                let to = target_position(place, entity);
                let at = to - distance_m * way;
                let yaw_rad = chaic_core::geom::yaw_towards(at, to) + rng.range(-0.6, 0.6);
                (Vec2::new(at.x, at.z), yaw_rad)
            }
            None => {
                let at = bounds.min + Vec2::new(rng.unit(), rng.unit()) * bounds.size();
                (at, rng.range(-PI, PI))
            }
        };
        if !bounds.contains(at) {
            return None;
        }
        let mut state = place.world.state().clone();
        self.pose_people(place, at);
        self.carry(place, (at, yaw_rad), &mut state);
        self.fill(place, &mut state);
        let camera = Camera {
            eye_in_world: Vec3::new(at.x, eye_m, at.y),
            world_from_camera: yaw_rotation(yaw_rad),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: size,
            height: size,
        };
        let view = View::of_camera(camera, Channels::ALL);
        let images = place.scene.render_state(&state, &place.postures, &[view]).pop()?;
        let (rgb, depth_m, ids) = (images.rgb?, images.depth_m?, images.ids?);
        let n_near = depth_m.iter().filter(|d| **d < TOO_NEAR_M).count();
        let n_aimed = aimed_at.map(|e| ids.iter().filter(|id| **id == e.0).count());
        if n_near as f32 > MOST_NEAR * depth_m.len() as f32
            || n_aimed.is_some_and(|n| n < LEAST_AIMED_PX)
        {
            return None;
        }
        Some(LabelledView { camera, rgb, depth_m, ids, labels: place.labels.clone(), aimed_at })
    }

    /// Puts everybody somewhere else, some of them before the eye.
    fn pose_people(&mut self, place: &mut Place, eye: Vec2) {
        let rng = &mut self.rng;
        let bounds = place.world.setup().bounds;
        for posture in &mut place.postures {
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

    /// Puts things into people's hands, and into those of whoever sees this.
    fn carry(&mut self, place: &mut Place, (eye, yaw_rad): (Vec2, f32), state: &mut State) {
        let rng = &mut self.rng;
        let small = of_roles(place, &[Role::Target, Role::Container, Role::Fragile]);
        let heavy = of_roles(place, &[Role::HeavyTarget]);
        let mut own = place.postures.first().copied();
        if let Some(own) = &mut own {
            (own.pose.position, own.pose.yaw_rad) = (Vec3::new(eye.x, 0.0, eye.y), yaw_rad);
            own.height_m = STANDING_M;
        }
        for posture in place.postures.iter_mut().chain(&mut own) {
            posture.arms.iter_mut().for_each(|arm| arm.grips = false);
            if !rng.chance(self.rules.carrying) {
                continue;
            }
            let turn = yaw_rotation(posture.pose.yaw_rad);
            if rng.chance(0.15)
                && let Some(k) = rng.choose(&heavy).copied()
            {
                // Before the body, as the world has furniture carried.
                let depth = place.world.setup().things[k].size_m().z;
                let ahead = Vec3::new(0.0, 0.45, -(0.3 + 0.5 * depth));
                state.things[k].position = posture.pose.position + turn * ahead;
                state.things[k].rotation = turn;
                continue;
            }
            for (side, arm) in [-1.0, 1.0].into_iter().zip(&mut posture.arms) {
                let Some(k) = rng.choose(&small).copied().filter(|_| rng.chance(0.7)) else {
                    continue;
                };
                // Where hands hold things, in proportion to the body.
                let h = posture.height_m;
                arm.hand_in_body = Vec3::new(side * 0.2, 0.57 * h, -0.31 * h);
                arm.grips = true;
                let half = 0.5 * place.world.setup().things[k].size_m().y * Vec3::Y;
                state.things[k].position = posture.pose.position + turn * arm.hand_in_body - half;
                state.things[k].rotation = turn;
            }
        }
    }

    /// Puts things into containers.
    fn fill(&mut self, place: &Place, state: &mut State) {
        let rng = &mut self.rng;
        let targets = of_roles(place, &[Role::Target, Role::Fragile]);
        for container in of_roles(place, &[Role::Container]) {
            if !rng.chance(self.rules.filled) {
                continue;
            }
            let size = place.world.setup().things[container].size_m();
            let (at, rotation) =
                (state.things[container].position, state.things[container].rotation);
            for slot in 0..1 + rng.below(3) {
                let Some(k) = rng.choose(&targets).copied() else { continue };
                let aside = 0.22 * (yaw_rotation(2.0 * PI / 3.0 * slot as f32) * Vec3::NEG_Z);
                let up = (0.12 * size.y).max(0.01);
                let slot = Vec3::new(aside.x * size.x, up, aside.z * size.z);
                state.things[k].position = at + rotation * slot;
                state.things[k].rotation = rotation;
            }
        }
    }
}

/// How tall the helper is, metres.
const STANDING_M: f32 = 1.75;

/// The things of these roles that aren't fixed, by number.
fn of_roles(place: &Place, roles: &[Role]) -> Vec<usize> {
    let things = &place.world.setup().things;
    let fits = |thing: &Thing| !thing.fixed && roles.contains(&thing.class.info().role);
    (0..things.len()).filter(|k| fits(&things[*k])).collect()
}

/// A thing of a class, each class that is there equally often: of those that can be moved, or of all
/// others, people too.
fn aim(place: &Place, is_movable: bool, rng: &mut Stream) -> Option<EntityId> {
    let fits =
        |label: u8| class_of(label).is_some_and(|class| class.info().is_movable() == is_movable);
    let mut by_label: Vec<(u8, EntityId)> = (0..place.labels.len())
        .map(|k| (place.labels[k], EntityId(k as u16)))
        .filter(|(label, _)| fits(*label))
        .collect();
    by_label.sort();
    let mut labels: Vec<u8> = by_label.iter().map(|(label, _)| *label).collect();
    labels.dedup();
    let label = *rng.choose(&labels)?;
    one_of(place, label, rng)
}

/// A thing or person of this label.
fn one_of(place: &Place, label: u8, rng: &mut Stream) -> Option<EntityId> {
    let of_it: Vec<EntityId> = (0..place.labels.len())
        .filter(|k| place.labels[*k] == label)
        .map(|k| EntityId(k as u16))
        .collect();
    rng.choose(&of_it).copied()
}

/// Anywhere on the ground.
fn ground(setup: &Setup, rng: &mut Stream) -> Vec3 {
    let at = setup.bounds.min + Vec2::new(rng.unit(), rng.unit()) * setup.bounds.size();
    Vec3::new(at.x, 0.0, at.y)
}

/// The one of some places on the ground that is farthest from all other things.
fn clear_place(setup: &Setup, rng: &mut Stream) -> Vec3 {
    let clearance_m = |at: Vec3| {
        let apart_m = setup.things.iter().map(|thing| {
            let apart = (thing.position - at).abs() - 0.5 * thing.size_m();
            apart.x.max(apart.z)
        });
        apart_m.fold(f32::INFINITY, f32::min)
    };
    let places: Vec<Vec3> = (0..LARGE_PLACES).map(|_| ground(setup, rng)).collect();
    let clearest = places.into_iter().max_by(|a, b| clearance_m(*a).total_cmp(&clearance_m(*b)));
    clearest.unwrap_or(Vec3::ZERO)
}

fn target_position(place: &Place, entity: EntityId) -> Vec3 {
    match entity.agent() {
        Some(agent) => place.postures[agent.index()].pose.position,
        None => {
            place.world.state().things[usize::from(entity.0 - EntityId::FIRST_OBJECT.0)].position
        }
    }
}

/// About how far off a thing still shows in a hundred pixels of an image of 512, metres.
fn visible_m(place: &Place, entity: EntityId) -> f32 {
    let class = place.labels.get(usize::from(entity.0)).and_then(|label| class_of(*label));
    let mut size_m = class.map_or([1.0; 3], |class| class.info().size_m);
    size_m.sort_by(f32::total_cmp);
    40.0 * (size_m[1] * size_m[2]).sqrt()
}

/// Base-2 logarithm by the bits and a straight line between powers; the same on every machine.
fn log2(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let mantissa = f32::from_bits(bits & 0x7f_ffff | 127 << 23);
    exponent as f32 + mantissa - 1.0
}

/// The inverse.
fn exp2(x: f32) -> f32 {
    let whole = x.floor();
    f32::from_bits(((whole as i32 + 127) as u32) << 23) * (1.0 + x - whole)
}
