//! Common parts of street and yard: ground, houses, trees, lamps and fences around the scene.

use std::f32::consts::PI;

use chaic_core::briefing::Goal;
use chaic_core::geom::{Rect, wrap_angle};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_world::{AgentSpec, Floor, FloorMaterial, ObjectSpec, Room, RoomKind, Setup};

use crate::upright_box::{mm, mm3, plan_bounds, rect_distance};

/// Distance that the ground extends beyond the bounds, meters: its edge is not visible from eye
/// height.
const GROUND_M: f32 = 40.0;
/// Clearance around a trunk, meters: crowns may touch.
const TREE_CLEAR_M: f32 = 1.7;
/// Number of positions tried for one piece of scenery.
const MAX_ATTEMPTS: usize = 24;

/// Parts of an outdoor episode that generators provide.
pub(crate) struct OutdoorParts {
    pub(crate) floors: Vec<Floor>,
    pub(crate) things: Vec<ObjectSpec>,
    pub(crate) people: Vec<AgentSpec>,
    pub(crate) goal: Goal,
    /// Index of the goal place among the objects.
    pub(crate) goal_place: usize,
}

/// Returns the setup of an outdoor episode: one room without walls.
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

/// Objects of an outdoor scene during placement.
pub(crate) struct Scenery {
    pub(crate) things: Vec<ObjectSpec>,
    /// Areas that scenery must keep clear of.
    reserved: Vec<Rect>,
}

impl Scenery {
    pub(crate) fn new(reserved: Vec<Rect>) -> Scenery {
        Scenery { things: Vec::new(), reserved }
    }

    /// Adds an object at exactly this position; returns its index.
    pub(crate) fn add(&mut self, class: &str, at: [f32; 2], yaw_rad: f32, variant: usize) -> usize {
        let position = mm3(Vec3::new(at[0], 0.0, at[1]));
        let mut object = ObjectSpec::new(ClassId::named(class), position, mm(yaw_rad));
        object.variant = variant as u8;
        object.fixed = true;
        self.things.push(object);
        self.things.len() - 1
    }

    /// Adds an object at this position if it is at least `apart_m` from all others.
    pub(crate) fn add_if_free(
        &mut self,
        class: &str,
        at: [f32; 2],
        yaw_rad: f32,
        variant: usize,
        apart_m: f32,
    ) -> bool {
        self.add(class, at, yaw_rad, variant);
        let (new, others) = self.things.split_last().expect("it was added above");
        let bounds = plan_bounds(new).expanded(apart_m);
        let is_free = !self.reserved.iter().any(|r| r.overlaps(&bounds))
            && !others.iter().any(|t| plan_bounds(t).overlaps(&bounds));
        if !is_free {
            self.things.pop();
        }
        is_free
    }

    /// Adds up to `n` trees within a strip.
    pub(crate) fn trees(&mut self, rng: &mut RngStream, strip: Rect, n: usize) {
        for _ in 0..n {
            for _ in 0..MAX_ATTEMPTS {
                let at = [rng.range(strip.min.x, strip.max.x), rng.range(strip.min.y, strip.max.y)];
                let (yaw_rad, variant) = (rng.range(-PI, PI), rng.below(8));
                if self.add_if_free("tree", at, yaw_rad, variant, TREE_CLEAR_M) {
                    break;
                }
            }
        }
    }

    /// Adds a row of fences along x from `x[0]` to `x[1]`, except where the space is occupied.
    pub(crate) fn fence(&mut self, x: [f32; 2], z: f32, yaw_rad: f32, variant: usize) {
        let step_m = 2.0;
        let mut at = x[0] + 0.5 * step_m;
        while at + 0.5 * step_m <= x[1] + 0.01 {
            // Posts of neighboring fences are adjacent, 1 cm apart.
            self.add_if_free("fence", [at, z], yaw_rad, variant, -0.01);
            at += step_m;
        }
    }

    /// Adds houses along x beyond the bounds, at least as far out as `z`.
    pub(crate) fn houses(&mut self, rng: &mut RngStream, x: [f32; 2], z: f32, yaw_rad: f32) {
        let mut at = x[0] + 4.0 + rng.range(0.0, 3.0);
        while at + 4.0 <= x[1] {
            let back = rng.range(0.0, 2.5) * z.signum();
            let variant = rng.below(8);
            self.add_if_free("house_front", [at, z + back], yaw_rad, variant, 0.3);
            at += 8.5 + rng.range(0.0, 4.0);
        }
    }
}

/// Returns the ground: grass, and a road along x with pavements on both sides.
pub(crate) fn ground(
    bounds: Rect,
    road_z: [f32; 2],
    pavement_z: [f32; 2],
    rng: &mut RngStream,
) -> Vec<Floor> {
    let around = bounds.expanded(GROUND_M);
    let strip = |z: [f32; 2], material: FloorMaterial, color: [u8; 3]| {
        let rect = Rect::new([around.min.x, z[0]], [around.max.x, z[1]]);
        Floor { rect, material, color }
    };
    let shade = |base: [u8; 3], rng: &mut RngStream| {
        let d = rng.below(25) as i16 - 12;
        base.map(|c| (i16::from(c) + d).clamp(0, 255) as u8)
    };
    vec![
        Floor { rect: around, material: FloorMaterial::Grass, color: shade([104, 140, 72], rng) },
        strip(pavement_z, FloorMaterial::Pavement, shade([178, 172, 162], rng)),
        strip(road_z, FloorMaterial::Asphalt, shade([92, 94, 98], rng)),
    ]
}

/// Mirrors positions and headings at the plane of this x; shapes are not mirrored.
pub(crate) fn mirror(things: &mut [ObjectSpec], people: &mut [AgentSpec], at_x: f32) {
    let mirrored = |x: f32| mm(2.0 * at_x - x);
    for object in things {
        object.position.x = mirrored(object.position.x);
        object.yaw_rad = mm(wrap_angle(-object.yaw_rad));
    }
    for person in people {
        person.pose.position.x = mirrored(person.pose.position.x);
        person.pose.yaw_rad = mm(wrap_angle(-person.pose.yaw_rad));
    }
}

/// Draws one of 24 headings.
pub(crate) fn heading(rng: &mut RngStream) -> f32 {
    mm((rng.below(24) as f32 - 11.0) * PI / 12.0)
}

/// Returns whether a point is at least `apart_m` from all rectangles.
pub(crate) fn is_clear(p: Vec2, of: &[Rect], apart_m: f32) -> bool {
    of.iter().all(|r| rect_distance(r, p) >= apart_m)
}
