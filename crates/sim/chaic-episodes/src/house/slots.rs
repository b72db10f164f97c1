//! Slots for small objects: on low furniture, on high tops, and on the floor.

use chaic_core::geom::{math, rotate_yaw, to_xz};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::{ObjectSpec, Surface, top_surfaces};

use super::House;
use super::room::footprint;
use crate::upright_box::{UprightBox, mm, mm3, rect_distance};

/// Classes of furniture on which small objects lie (facts S11.2: tables, sofas, chairs).
const LOW_HOSTS: [&str; 10] = [
    "dining_table",
    "coffee_table",
    "desk",
    "kitchen_counter",
    "tv_stand",
    "nightstand",
    "side_chair",
    "armchair",
    "long_sofa",
    "stool",
];
/// Classes of furniture with a high top (facts S11.1).
pub(super) const HIGH_HOSTS: [&str; 2] = ["cabinet", "refrigerator"];
/// Surfaces below this height are low, meters (paper: "tables, chairs, sofas").
const LOW_M: f32 = 1.2;
/// Tops from this height on are high, meters (facts S11.1).
pub(super) const HIGH_M: f32 = 1.5;
/// Maximum distance from the center of a slot to a cell in which a wide body can stand, meters. An
/// arm reaches 0.7 m from there, and a wheelchair can stand 0.05 m nearer.
const REACH_M: f32 = 0.70;
/// Gap between objects on one surface, meters.
const APART_M: f32 = 0.015;
/// Clearance of an object on the floor from furniture, walls and doorways, meters (facts S11.2:
/// 0.65).
const FLOOR_CLEAR_M: f32 = 0.65;

/// A position on a top surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    host: usize,
    surface: Surface,
    /// Position on the surface, from its center along its own x and z, as fractions of the half
    /// extents.
    uv: Vec2,
}

/// A high top with its slots.
#[derive(Clone, Debug)]
pub(super) struct HighTop {
    pub class: ClassId,
    /// Slot at the center of the top.
    pub middle: Slot,
    pub slots: Vec<Slot>,
}

impl Slot {
    fn point(&self) -> Vec3 {
        let offset =
            Vec3::new(self.uv.x * self.surface.half[0], 0.0, self.uv.y * self.surface.half[1]);
        self.surface.center + rotate_yaw(offset, self.surface.yaw_rad)
    }

    /// Returns an object of this class at the slot if it lies fully on the top and clear of other
    /// objects. `turn_rad` is its yaw relative to the furniture's.
    pub fn place(
        &self,
        house: &House,
        class: ClassId,
        turn_rad: f32,
        others: &[ObjectSpec],
    ) -> Option<ObjectSpec> {
        let [sx, _, sz] = class.info().size_m;
        let (s, c) = (math::sin(turn_rad).abs(), math::cos(turn_rad).abs());
        let reach = 0.5 * Vec2::new(c * sx + s * sz, s * sx + c * sz);
        let room = Vec2::from(self.surface.half) - reach;
        if room.min_element() < -0.0005 {
            return None;
        }
        let room = room.max(Vec2::ZERO);
        let at = (self.uv * Vec2::from(self.surface.half)).clamp(-room, room);
        let offset = rotate_yaw(Vec3::new(at.x, 0.0, at.y), self.surface.yaw_rad);
        let position = mm3(self.surface.center + offset);
        let yaw_rad = mm(chaic_core::geom::wrap_angle(self.surface.yaw_rad + turn_rad));
        let object = ObjectSpec::new(class, position, yaw_rad);
        let solids = UprightBox::from_object(&object);
        let touches =
            |other: &UprightBox, slack: f32| solids.iter().any(|s| s.overlap(other) > slack);
        let host = UprightBox::from_object(&house.furniture[self.host]);
        let near = |t: &&ObjectSpec| to_xz(t.position).distance(to_xz(position)) < 0.8;
        let is_clear = !host.iter().any(|h| touches(h, 0.004))
            && !others.iter().filter(near).any(|t| {
                let apart = 0.5 * (t.size_m().max_element() + object.size_m().max_element());
                let close = to_xz(t.position).distance(to_xz(position)) < apart + APART_M;
                close && UprightBox::from_object(t).iter().any(|o| touches(o, -APART_M))
            });
        is_clear.then_some(object)
    }
}

/// Returns whether a wheelchair user gets within `reach_m` of a point without a wall in between.
fn within_reach(house: &House, room: usize, p: Vec2, reach_m: f32) -> bool {
    let around = chaic_core::geom::Rect { min: p, max: p }.expanded(reach_m);
    let rect = house.rooms[room].rect;
    house.ground.cells_in(around).any(|i| {
        let m = house.ground.middle(i);
        house.walkable[i] && rect.contains(m) && m.distance(p) <= reach_m
    })
}

fn room_of(house: &House, object: &ObjectSpec) -> Option<usize> {
    house.rooms.iter().position(|r| r.rect.contains(to_xz(object.position)))
}

/// Returns all reachable slots on low furniture: up to four per table, two per seat (facts S11.2).
pub(super) fn low(house: &House) -> Vec<Slot> {
    let mut slots = Vec::new();
    for (host, object) in house.furniture.iter().enumerate() {
        if !LOW_HOSTS.contains(&object.class.name()) {
            continue;
        }
        let Some(room) = room_of(house, object) else { continue };
        for surface in top_surfaces(object).into_iter().filter(|s| s.center.y < LOW_M) {
            for slot in spread(host, object.class, surface) {
                if within_reach(house, room, to_xz(slot.point()), REACH_M) {
                    slots.push(slot);
                }
            }
        }
    }
    slots
}

/// Returns the slots on one surface, as many as it has space for.
fn spread(host: usize, class: ClassId, surface: Surface) -> Vec<Slot> {
    let [hx, hz] = surface.half;
    let area_m2 = 4.0 * hx * hz;
    // The front (-z) first: the back mostly faces a wall and is out of reach.
    // Chairs stand with their front at a table.
    let uvs: &[[f32; 2]] = if class.name() == "side_chair" {
        &[[-0.45, 0.15], [0.45, 0.15]]
    } else if area_m2 < 0.16 {
        &[[0.0, 0.0]]
    } else if hx.max(hz) < 0.35 {
        &[[-0.45, -0.4], [0.45, -0.3]]
    } else if hz < 0.34 {
        &[[-0.65, -0.35], [0.0, -0.35], [0.65, -0.35]]
    } else {
        // Towards the ends, which chairs do not block.
        &[[-0.78, -0.45], [0.78, -0.45], [-0.78, 0.45], [0.78, 0.45]]
    };
    uvs.iter().map(|uv| Slot { host, surface, uv: Vec2::from(*uv) }).collect()
}

/// Returns the reachable tops of cabinets and refrigerators, with two or three slots each.
pub(super) fn high(house: &House) -> Vec<HighTop> {
    let mut tops = Vec::new();
    for (host, object) in house.furniture.iter().enumerate() {
        if !HIGH_HOSTS.contains(&object.class.name()) {
            continue;
        }
        let Some(room) = room_of(house, object) else { continue };
        let highest =
            top_surfaces(object).into_iter().max_by(|a, b| a.center.y.total_cmp(&b.center.y));
        let Some(surface) = highest.filter(|s| s.center.y >= HIGH_M) else { continue };
        // Towards the front, within reach.
        let slot = |u: f32| Slot { host, surface, uv: Vec2::new(u, -0.45) };
        if !within_reach(house, room, to_xz(slot(0.0).point()), REACH_M) {
            continue;
        }
        // Tops have three and two slots in turn, so that a house has ten to fifteen high slots.
        let us: &[f32] = if tops.len() % 2 == 0 { &[-0.66, 0.0, 0.66] } else { &[-0.45, 0.45] };
        let slots = us.iter().map(|u| slot(*u)).collect();
        tops.push(HighTop { class: object.class, middle: slot(0.0), slots });
    }
    tops
}

impl Slot {
    /// Returns the slot on the same surface at this fraction of its half length from the center.
    pub fn along(mut self, u: f32) -> Slot {
        self.uv.x = u;
        self
    }

    /// Returns the slot with a small random offset, so that episodes differ.
    pub fn jittered(mut self, rng: &mut RngStream) -> Slot {
        self.uv += Vec2::new(rng.range(-0.12, 0.12), rng.range(-0.12, 0.12));
        self
    }
}

/// Returns walkable points on the floor of all rooms, away from furniture, walls and doorways, in
/// the grid's order.
pub(super) fn floor(house: &House, clear_m: f32) -> Vec<Vec2> {
    let footprints: Vec<_> = house.furniture.iter().map(footprint).collect();
    let rooms: Vec<_> = house.rooms.iter().map(|r| r.rect.expanded(-clear_m)).collect();
    let mut points = Vec::new();
    for i in (0..house.walkable.len()).filter(|i| house.walkable[*i]) {
        let (p, ground) = (house.ground.middle(i), &house.ground);
        // Every third cell along each axis is enough.
        if (i % ground.nx) % 3 != 0 || (i / ground.nx) % 3 != 0 {
            continue;
        }
        let in_room = rooms.iter().any(|r| r.contains(p));
        let is_clear = footprints.iter().all(|f| rect_distance(f, p) >= clear_m.min(0.45));
        let doorways = house.openings.iter().map(|o| 0.5 * (o.a + o.b));
        if in_room && is_clear && doorways.into_iter().all(|d| d.distance(p) > 1.1) {
            points.push(p);
        }
    }
    points
}

/// Returns points on the floor at which targets may lie.
pub(super) fn floor_for_targets(house: &House) -> Vec<Vec2> {
    floor(house, FLOOR_CLEAR_M)
}
