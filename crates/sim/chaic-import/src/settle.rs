//! Where things come to rest.
//!
//! The original drops its objects from where it puts them and records the height at which each
//! lay in the end, but not where. What was put over the back of a chair lies on its seat then. So
//! each is laid on the nearest surface of about that height that has room for it.

use chaic_core::geom::{Rect, math, rotate_yaw, xz};
use chaic_core::{Role, Vec2, Vec3};
use chaic_episodes::UprightBox;
use chaic_world::{Rules, Setup, Surface, Thing, blocks_of, ghosts_of};

/// At most this deep two things touch, metres.
const TOUCH_M: f32 = 0.01;
/// Heights that count as the recorded one, metres.
const SAME_M: f32 = 0.05;
/// What leans against a back or lies on a neighbor has its bottom this far above the surface that
/// bears it at most, metres.
const LEANS_M: f32 = 0.28;
/// How far a thing may have slid or rolled on furniture, metres: first it is looked for near by,
/// then farther.
const SLID_M: [f32; 2] = [0.25, 0.6];
/// How far a thing is moved where nothing of the recorded height has room for it, metres.
const ANYWHERE_M: f32 = 2.0;
/// How far from the furniture it fell off a thing may lie on the floor, metres.
const FALLEN_M: f32 = 3.0;
/// Around a thing that has fallen to the floor, metres: it isn't under anything either.
const FLOOR_CLEAR_M: f32 = 0.06;

/// Where a thing was put and at what height it was found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rest<'a> {
    /// Height of its bottom, metres.
    pub height_m: f32,
    /// Rooms it may lie in.
    pub rooms: &'a [Rect],
}

/// All that stands and lies around.
#[derive(Debug)]
pub(crate) struct Surroundings {
    /// Nothing comes to rest outside of these.
    bounds: Rect,
    surfaces: Vec<Surface>,
    solids: Vec<(Rect, UprightBox)>,
    /// What can't be seen into, but isn't in anybody's way.
    hidden: Vec<(Rect, UprightBox)>,
    /// Furniture seen from above.
    shadows: Vec<UprightBox>,
}

impl Surroundings {
    /// The walls of a setup and the things in it.
    pub fn of(setup: &Setup) -> Surroundings {
        let mut all = Surroundings {
            bounds: setup.bounds,
            surfaces: Vec::new(),
            solids: Vec::new(),
            hidden: Vec::new(),
            shadows: Vec::new(),
        };
        all.add_solids(UprightBox::of_walls(setup));
        // A bicycle is in nobody's way, least of all its rider's.
        let stays = |t: &&Thing| t.class.info().role != Role::Vehicle;
        for thing in setup.things.iter().filter(stays) {
            all.surfaces.extend(tops(thing));
            all.shadows.extend(UprightBox::of_thing(thing));
            all.add_solids(UprightBox::of_thing(thing));
            // Nobody finds what is inside a cushion.
            all.hidden.extend(ghosts_of(thing).iter().map(UprightBox::of_block).map(with_bounds));
        }
        all
    }

    /// Adds a thing that has come to rest.
    pub fn add(&mut self, thing: &Thing) {
        self.add_solids(UprightBox::of_thing(thing));
    }

    fn add_solids(&mut self, solids: Vec<UprightBox>) {
        self.solids.extend(solids.into_iter().map(with_bounds));
    }

    /// The thing on furniture near where it was put; `None` if there is no room for it.
    pub fn laid_on_furniture(&self, thing: &Thing, rest: &Rest) -> Option<Thing> {
        let on_top = |y: f32| ((y - rest.height_m).abs() <= SAME_M).then_some(y);
        let leaning = |y: f32| {
            let above_m = rest.height_m - y;
            (above_m > 0.0 && above_m <= LEANS_M).then_some(rest.height_m)
        };
        SLID_M
            .into_iter()
            .find_map(|slid_m| {
                let on_top = self.laid(thing, rest, slid_m, on_top);
                on_top.or_else(|| self.laid(thing, rest, slid_m, leaning))
            })
            .or_else(|| self.laid(thing, rest, ANYWHERE_M, Some))
            .or_else(|| self.fallen(thing, rest))
    }

    /// The thing on the nearest surface within `reach_m` that has room for it at the height that
    /// `height` gives for the surface's, if it gives one; of several the height nearest to the
    /// recorded one.
    fn laid(
        &self,
        thing: &Thing,
        rest: &Rest,
        reach_m: f32,
        height: impl Fn(f32) -> Option<f32>,
    ) -> Option<Thing> {
        around(reach_m, 0.04).find_map(|offset| {
            let p = xz(thing.position) + offset;
            let under = self.surfaces.iter().filter(|s| bears(s, p)).map(|s| s.center.y);
            let mut heights: Vec<f32> = under.chain([0.0]).filter_map(&height).collect();
            let off = |y: &f32| (y - rest.height_m).abs();
            heights.sort_by(|a, b| off(a).total_cmp(&off(b)));
            heights.into_iter().map(|y| moved(thing, p, y)).find(|t| self.fits(t, rest))
        })
    }

    /// Height of the surface under a thing that has just been put over it, metres.
    pub fn height_under(&self, thing: &Thing) -> Option<f32> {
        let p = xz(thing.position);
        let own: Vec<Surface> = tops(thing).collect();
        let others = self.surfaces.iter().filter(|s| !own.contains(s));
        let under = others.filter(|s| bears(s, p)).map(|s| s.center.y);
        under.filter(|y| *y <= thing.position.y + SAME_M).max_by(f32::total_cmp)
    }

    /// The thing on the floor where it was put, or as near as it has room.
    pub fn laid_on_floor(&self, thing: &Thing, rest: &Rest) -> Option<Thing> {
        around(FALLEN_M, 0.05)
            .map(|offset| moved(thing, xz(thing.position) + offset, 0.0))
            .find(|t| self.fits(t, rest))
    }

    /// The thing on open floor beside the furniture that it has fallen off.
    pub fn fallen(&self, thing: &Thing, rest: &Rest) -> Option<Thing> {
        let is_open = |t: &Thing| {
            let reach = t.half_longer_side_m() + FLOOR_CLEAR_M;
            self.shadows.iter().all(|s| s.distance(xz(t.position)) >= reach)
        };
        around(FALLEN_M, 0.06)
            .map(|offset| moved(thing, xz(thing.position) + offset, 0.0))
            .find(|t| is_open(t) && self.fits(t, rest))
            .or_else(|| self.laid_on_floor(thing, rest))
    }

    /// The place nearest to where somebody was put that has room for a body of this radius.
    pub fn free_place(&self, p: Vec2, radius_m: f32, apart: &[(Vec2, f32)]) -> Option<Vec2> {
        let stands = [Rules::paper().step_over_m, 2.0];
        let blocks: Vec<&UprightBox> =
            self.solids.iter().map(|(_, s)| s).filter(|s| s.spans(stands)).collect();
        around(FALLEN_M, 0.02).map(|offset| p + offset).find(|p| {
            self.bounds.grown(-radius_m).contains(*p)
                && blocks.iter().all(|s| s.distance(*p) >= radius_m)
                && apart.iter().all(|(other, apart_m)| other.distance(*p) >= *apart_m)
        })
    }

    fn fits(&self, thing: &Thing, rest: &Rest) -> bool {
        let p = xz(thing.position);
        let in_room = rest.rooms.is_empty() || rest.rooms.iter().any(|r| r.contains(p));
        in_room
            && self.bounds.contains(p)
            && UprightBox::of_thing(thing).iter().all(|own| {
                let bounds = own.bounds();
                let all = self.solids.iter().chain(&self.hidden);
                let near = all.filter(|(b, _)| b.overlaps(&bounds));
                near.into_iter().all(|(_, s)| s.overlap(own) <= TOUCH_M)
            })
    }
}

fn with_bounds(solid: UprightBox) -> (Rect, UprightBox) {
    (solid.bounds(), solid)
}

/// The tops of all parts: things may lie on an arm or a back as well.
fn tops(thing: &Thing) -> impl Iterator<Item = Surface> {
    blocks_of(thing).into_iter().map(|block| Surface {
        center: block.center + block.half.y * Vec3::Y,
        half: [block.half.x, block.half.z],
        yaw_rad: block.yaw_rad,
    })
}

fn moved(thing: &Thing, p: Vec2, height_m: f32) -> Thing {
    let position = chaic_episodes::mm3(Vec3::new(p.x, height_m, p.y));
    Thing { position, ..*thing }
}

/// Whether the surface is under a point.
fn bears(surface: &Surface, p: Vec2) -> bool {
    let d = Vec3::new(p.x - surface.center.x, 0.0, p.y - surface.center.z);
    let local = rotate_yaw(d, -surface.yaw_rad);
    local.x.abs() <= surface.half[0] && local.z.abs() <= surface.half[1]
}

/// Offsets in plan, the nearest first: rings `step_m` apart out to `radius_m`.
fn around(radius_m: f32, step_m: f32) -> impl Iterator<Item = Vec2> {
    let n_rings = (radius_m / step_m) as u32;
    (0..=n_rings).flat_map(move |ring| {
        let n = if ring == 0 { 1 } else { 16 };
        (0..n).map(move |k| {
            let angle = std::f32::consts::TAU * k as f32 / n as f32;
            ring as f32 * step_m * Vec2::new(math::cos(angle), math::sin(angle))
        })
    })
}
