//! Resting positions of objects.
//!
//! The original drops its objects and records the final height of each, but not its position. An
//! object placed over the back of a chair, for example, ends on the seat. Each object is therefore
//! placed on the nearest surface of about the recorded height that has space for it.

use chaic_core::geom::{Rect, math, rotate_yaw, to_xz};
use chaic_core::{Role, Vec2, Vec3};
use chaic_episodes::UprightBox;
use chaic_world::{ObjectSpec, Rules, Setup, Surface, blocks_of, non_colliding_blocks};

/// Maximum penetration depth of objects in contact, meters.
const TOUCH_M: f32 = 0.01;
/// Tolerance of the recorded height, meters.
const HEIGHT_TOLERANCE_M: f32 = 0.05;
/// Maximum height of an object's bottom above its support, meters, for objects that lean against a
/// back or a neighbor.
const MAX_LEAN_M: f32 = 0.28;
/// Maximum distances that an object may have slid or rolled on furniture, meters. The smaller one
/// is tried first.
const SLIDE_DISTANCES_M: [f32; 2] = [0.25, 0.6];
/// Maximum distance that an object is moved if no surface of the recorded height has space, meters.
const MAX_MOVE_M: f32 = 2.0;
/// Maximum distance between an object on the floor and the furniture that it fell off, meters.
const MAX_FALL_DISTANCE_M: f32 = 3.0;
/// Clearance of a fallen object from furniture, meters, so that it does not lie under any.
const FLOOR_CLEAR_M: f32 = 0.06;

/// Recorded height and possible rooms of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestConstraint<'a> {
    /// Height of the bottom, meters.
    pub height_m: f32,
    /// Rooms in which it may lie; empty for any room.
    pub rooms: &'a [Rect],
}

/// Walls and objects that affect resting positions.
#[derive(Debug)]
pub(crate) struct Surroundings {
    /// Area in which objects may come to rest.
    bounds: Rect,
    surfaces: Vec<Surface>,
    solids: Vec<(Rect, UprightBox)>,
    /// Blocks that do not collide but hide objects.
    hidden: Vec<(Rect, UprightBox)>,
    /// Footprints of furniture.
    footprints: Vec<UprightBox>,
}

impl Surroundings {
    /// Collects the walls and objects of a setup.
    pub fn new(setup: &Setup) -> Surroundings {
        let mut all = Surroundings {
            bounds: setup.bounds,
            surfaces: Vec::new(),
            solids: Vec::new(),
            hidden: Vec::new(),
            footprints: Vec::new(),
        };
        all.add_solids(UprightBox::from_walls(setup));
        // Bicycles block nothing; the rider starts beside one.
        let stays = |t: &&ObjectSpec| t.class.info().role != Role::Vehicle;
        for object in setup.things.iter().filter(stays) {
            all.surfaces.extend(tops(object));
            all.footprints.extend(UprightBox::from_object(object));
            all.add_solids(UprightBox::from_object(object));
            // Objects inside a cushion cannot be found.
            all.hidden.extend(
                non_colliding_blocks(object).iter().map(UprightBox::from_block).map(with_bounds),
            );
        }
        all
    }

    /// Adds an object at rest.
    pub fn add(&mut self, object: &ObjectSpec) {
        self.add_solids(UprightBox::from_object(object));
    }

    fn add_solids(&mut self, solids: Vec<UprightBox>) {
        self.solids.extend(solids.into_iter().map(with_bounds));
    }

    /// Returns the object on furniture near its position; `None` if there is no space.
    pub fn place_on_furniture(
        &self,
        object: &ObjectSpec,
        constraint: &RestConstraint,
    ) -> Option<ObjectSpec> {
        let on_top = |y: f32| ((y - constraint.height_m).abs() <= HEIGHT_TOLERANCE_M).then_some(y);
        let leaning = |y: f32| {
            let above_m = constraint.height_m - y;
            (above_m > 0.0 && above_m <= MAX_LEAN_M).then_some(constraint.height_m)
        };
        SLIDE_DISTANCES_M
            .into_iter()
            .find_map(|slide_m| {
                let on_top = self.place_on_surface(object, constraint, slide_m, on_top);
                on_top.or_else(|| self.place_on_surface(object, constraint, slide_m, leaning))
            })
            .or_else(|| self.place_on_surface(object, constraint, MAX_MOVE_M, Some))
            .or_else(|| self.place_fallen(object, constraint))
    }

    /// Returns the object on the nearest surface within `reach_m` that has space for it. `height`
    /// maps the height of a surface to that of the object, or to `None` if the surface is
    /// unsuitable. Of several heights, the nearest to the recorded one is used.
    fn place_on_surface(
        &self,
        object: &ObjectSpec,
        constraint: &RestConstraint,
        reach_m: f32,
        height: impl Fn(f32) -> Option<f32>,
    ) -> Option<ObjectSpec> {
        ring_offsets(reach_m, 0.04).find_map(|offset| {
            let p = to_xz(object.position) + offset;
            let under = self.surfaces.iter().filter(|s| is_below(s, p)).map(|s| s.center.y);
            let mut heights: Vec<f32> = under.chain([0.0]).filter_map(&height).collect();
            let off = |y: &f32| (y - constraint.height_m).abs();
            heights.sort_by(|a, b| off(a).total_cmp(&off(b)));
            heights.into_iter().map(|y| moved_to(object, p, y)).find(|t| self.fits(t, constraint))
        })
    }

    /// Returns the height of the surface below an object, meters.
    pub fn height_under(&self, object: &ObjectSpec) -> Option<f32> {
        let p = to_xz(object.position);
        let own_tops: Vec<Surface> = tops(object).collect();
        let other_surfaces = self.surfaces.iter().filter(|s| !own_tops.contains(s));
        let under = other_surfaces.filter(|s| is_below(s, p)).map(|s| s.center.y);
        under.filter(|y| *y <= object.position.y + HEIGHT_TOLERANCE_M).max_by(f32::total_cmp)
    }

    /// Returns the object on the floor, as near to its position as possible.
    pub fn place_on_floor(
        &self,
        object: &ObjectSpec,
        constraint: &RestConstraint,
    ) -> Option<ObjectSpec> {
        ring_offsets(MAX_FALL_DISTANCE_M, 0.05)
            .map(|offset| moved_to(object, to_xz(object.position) + offset, 0.0))
            .find(|t| self.fits(t, constraint))
    }

    /// Returns the object on open floor beside the furniture that it fell off.
    pub fn place_fallen(
        &self,
        object: &ObjectSpec,
        constraint: &RestConstraint,
    ) -> Option<ObjectSpec> {
        let is_open = |t: &ObjectSpec| {
            let reach = t.half_longer_side_m() + FLOOR_CLEAR_M;
            self.footprints.iter().all(|s| s.distance(to_xz(t.position)) >= reach)
        };
        ring_offsets(MAX_FALL_DISTANCE_M, 0.06)
            .map(|offset| moved_to(object, to_xz(object.position) + offset, 0.0))
            .find(|t| is_open(t) && self.fits(t, constraint))
            .or_else(|| self.place_on_floor(object, constraint))
    }

    /// Returns the nearest free position for a body of this radius. `apart` lists other people with
    /// the minimum distances to them.
    pub fn free_position(&self, p: Vec2, radius_m: f32, apart: &[(Vec2, f32)]) -> Option<Vec2> {
        let stands = [Rules::paper().step_over_m, 2.0];
        let blocks: Vec<&UprightBox> =
            self.solids.iter().map(|(_, s)| s).filter(|s| s.spans(stands)).collect();
        ring_offsets(MAX_FALL_DISTANCE_M, 0.02).map(|offset| p + offset).find(|p| {
            self.bounds.expanded(-radius_m).contains(*p)
                && blocks.iter().all(|s| s.distance(*p) >= radius_m)
                && apart.iter().all(|(other, apart_m)| other.distance(*p) >= *apart_m)
        })
    }

    fn fits(&self, object: &ObjectSpec, constraint: &RestConstraint) -> bool {
        let p = to_xz(object.position);
        let in_room = constraint.rooms.is_empty() || constraint.rooms.iter().any(|r| r.contains(p));
        in_room
            && self.bounds.contains(p)
            && UprightBox::from_object(object).iter().all(|part| {
                let bounds = part.bounds();
                let all = self.solids.iter().chain(&self.hidden);
                let near = all.filter(|(b, _)| b.overlaps(&bounds));
                near.into_iter().all(|(_, s)| s.overlap(part) <= TOUCH_M)
            })
    }
}

fn with_bounds(solid: UprightBox) -> (Rect, UprightBox) {
    (solid.bounds(), solid)
}

/// Returns the tops of all parts: objects may also lie on an arm or a back.
fn tops(object: &ObjectSpec) -> impl Iterator<Item = Surface> {
    blocks_of(object).into_iter().map(|block| Surface {
        center: block.center + block.half.y * Vec3::Y,
        half: [block.half.x, block.half.z],
        yaw_rad: block.yaw_rad,
    })
}

fn moved_to(object: &ObjectSpec, p: Vec2, height_m: f32) -> ObjectSpec {
    let position = chaic_episodes::mm3(Vec3::new(p.x, height_m, p.y));
    ObjectSpec { position, ..*object }
}

/// Returns whether the surface is below a point.
fn is_below(surface: &Surface, p: Vec2) -> bool {
    let d = Vec3::new(p.x - surface.center.x, 0.0, p.y - surface.center.z);
    let local = rotate_yaw(d, -surface.yaw_rad);
    local.x.abs() <= surface.half[0] && local.z.abs() <= surface.half[1]
}

/// Returns offsets in plan by increasing distance: rings `step_m` apart up to `radius_m`.
fn ring_offsets(radius_m: f32, step_m: f32) -> impl Iterator<Item = Vec2> {
    let n_rings = (radius_m / step_m) as u32;
    (0..=n_rings).flat_map(move |ring| {
        let n = if ring == 0 { 1 } else { 16 };
        (0..n).map(move |k| {
            let angle = std::f32::consts::TAU * k as f32 / n as f32;
            ring as f32 * step_m * Vec2::new(math::cos(angle), math::sin(angle))
        })
    })
}
