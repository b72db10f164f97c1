//! What street and yard share: ground, houses, trees, lamps and fences around the scene.

use std::f32::consts::PI;

use chaic_core::briefing::Goal;
use chaic_core::geom::{Rect, wrap_angle};
use chaic_core::rng::Stream;
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_world::{Floor, FloorMaterial, Person, Room, RoomKind, Setup, Thing};

use crate::upright_box::{mm, mm3, plan_bounds, rect_distance};

/// How far the ground goes beyond the bounds, metres: nobody sees its edge from eye height.
const GROUND_M: f32 = 40.0;
/// Around a trunk, metres: crowns may touch.
const TREE_CLEAR_M: f32 = 1.7;
/// Places that are tried for one piece of scenery.
const TRIES: usize = 24;

/// What makes one outdoor episode differ from another.
pub(crate) struct OutdoorParts {
    pub(crate) floors: Vec<Floor>,
    pub(crate) things: Vec<Thing>,
    pub(crate) people: Vec<Person>,
    pub(crate) goal: Goal,
    /// Index of the goal place among the things.
    pub(crate) goal_place: usize,
}

/// An episode under the open sky: one room without walls.
pub(crate) fn setup(task: TaskId, seed: u64, bounds: Rect, parts: OutdoorParts) -> Setup {
    Setup {
        task,
        seed,
        horizon: task.info().horizon,
        bounds,
        ceiling_m: None,
        rooms: vec![Room { kind: RoomKind::Outdoors, rect: bounds }],
        walls: Vec::new(),
        openings: Vec::new(),
        floors: parts.floors,
        things: parts.things,
        people: parts.people,
        goal: parts.goal,
        goal_places: vec![Setup::entity(parts.goal_place)],
    }
}

/// Things of an outdoor scene while they are being placed.
pub(crate) struct Scenery {
    pub(crate) things: Vec<Thing>,
    /// What scenery must keep clear of.
    reserved: Vec<Rect>,
}

impl Scenery {
    pub(crate) fn new(reserved: Vec<Rect>) -> Scenery {
        Scenery { things: Vec::new(), reserved }
    }

    /// Puts a thing exactly there.
    pub(crate) fn put(&mut self, class: &str, at: [f32; 2], yaw_rad: f32, variant: usize) -> usize {
        let position = mm3(Vec3::new(at[0], 0.0, at[1]));
        let mut thing = Thing::new(ClassId::named(class), position, mm(yaw_rad));
        thing.variant = variant as u8;
        thing.fixed = true;
        self.things.push(thing);
        self.things.len() - 1
    }

    /// Puts a thing there if it is `apart_m` from everything else.
    pub(crate) fn put_if_free(
        &mut self,
        class: &str,
        at: [f32; 2],
        yaw_rad: f32,
        variant: usize,
        apart_m: f32,
    ) -> bool {
        self.put(class, at, yaw_rad, variant);
        let (new, others) = self.things.split_last().expect("it has just been put");
        let bounds = plan_bounds(new).grown(apart_m);
        let is_free = !self.reserved.iter().any(|r| r.overlaps(&bounds))
            && !others.iter().any(|t| plan_bounds(t).overlaps(&bounds));
        if !is_free {
            self.things.pop();
        }
        is_free
    }

    /// Trees here and there within a strip.
    pub(crate) fn trees(&mut self, rng: &mut Stream, strip: Rect, n: usize) {
        for _ in 0..n {
            for _ in 0..TRIES {
                let at = [rng.range(strip.min.x, strip.max.x), rng.range(strip.min.y, strip.max.y)];
                let (yaw_rad, variant) = (rng.range(-PI, PI), rng.below(8));
                if self.put_if_free("tree", at, yaw_rad, variant, TREE_CLEAR_M) {
                    break;
                }
            }
        }
    }

    /// A row of fences along x from `x[0]` to `x[1]`, leaving out what is taken.
    pub(crate) fn fence(&mut self, x: [f32; 2], z: f32, yaw_rad: f32, variant: usize) {
        let step_m = 2.0;
        let mut at = x[0] + 0.5 * step_m;
        while at + 0.5 * step_m <= x[1] + 0.01 {
            // Posts of neighbors stand side by side, a hair apart.
            self.put_if_free("fence", [at, z], yaw_rad, variant, -0.01);
            at += step_m;
        }
    }

    /// Houses along x beyond the bounds, at least as far out as `z`.
    pub(crate) fn houses(&mut self, rng: &mut Stream, x: [f32; 2], z: f32, yaw_rad: f32) {
        let mut at = x[0] + 4.0 + rng.range(0.0, 3.0);
        while at + 4.0 <= x[1] {
            let back = rng.range(0.0, 2.5) * z.signum();
            let variant = rng.below(8);
            self.put_if_free("house_front", [at, z + back], yaw_rad, variant, 0.3);
            at += 8.5 + rng.range(0.0, 4.0);
        }
    }
}

/// Grass all around, a road along x with pavements on both sides.
pub(crate) fn ground(
    bounds: Rect,
    road_z: [f32; 2],
    pavement_z: [f32; 2],
    rng: &mut Stream,
) -> Vec<Floor> {
    let around = bounds.grown(GROUND_M);
    let strip = |z: [f32; 2], material: FloorMaterial, color: [u8; 3]| {
        let rect = Rect::new([around.min.x, z[0]], [around.max.x, z[1]]);
        Floor { rect, material, color }
    };
    let shade = |base: [u8; 3], rng: &mut Stream| {
        let d = rng.below(25) as i16 - 12;
        base.map(|c| (i16::from(c) + d).clamp(0, 255) as u8)
    };
    vec![
        Floor { rect: around, material: FloorMaterial::Grass, color: shade([104, 140, 72], rng) },
        strip(pavement_z, FloorMaterial::Pavement, shade([178, 172, 162], rng)),
        strip(road_z, FloorMaterial::Asphalt, shade([92, 94, 98], rng)),
    ]
}

/// Mirrors positions and headings at the plane of this x; what they are of keeps its shape.
pub(crate) fn mirror(things: &mut [Thing], people: &mut [Person], at_x: f32) {
    let mirrored = |x: f32| mm(2.0 * at_x - x);
    for thing in things {
        thing.position.x = mirrored(thing.position.x);
        thing.yaw_rad = mm(wrap_angle(-thing.yaw_rad));
    }
    for person in people {
        person.pose.position.x = mirrored(person.pose.position.x);
        person.pose.yaw_rad = mm(wrap_angle(-person.pose.yaw_rad));
    }
}

/// One of 24 headings.
pub(crate) fn heading(rng: &mut Stream) -> f32 {
    mm((rng.below(24) as f32 - 11.0) * PI / 12.0)
}

/// Whether a point keeps clear of all these.
pub(crate) fn is_clear(p: Vec2, of: &[Rect], apart_m: f32) -> bool {
    of.iter().all(|r| rect_distance(r, p) >= apart_m)
}
