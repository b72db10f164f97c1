//! Where things may be put: places on low furniture, on high tops, and on the floor.

use chaic_core::geom::{math, rotate_yaw, xz};
use chaic_core::rng::Stream;
use chaic_core::{ClassId, Vec2, Vec3};
use chaic_world::{Surface, Thing, top_surfaces};

use super::House;
use super::room::foot;
use crate::upright_box::{UprightBox, mm, mm3, rect_distance};

/// Furniture on which small things lie in ordinary life (facts S11.2: tables, sofas, chairs).
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
/// Furniture whose top is high (facts S11.1).
pub(super) const HIGH_HOSTS: [&str; 2] = ["cabinet", "refrigerator"];
/// Below this surfaces are low, metres (paper: "tables, chairs, sofas").
const LOW_M: f32 = 1.2;
/// From here on tops are high, metres (facts S11.1).
pub(super) const HIGH_M: f32 = 1.5;
/// From the middle of a place to where a wide body can stand, metres; an arm reaches 0.7 from
/// there to the nearest point, and a wheelchair stands 0.05 nearer.
const REACH_M: f32 = 0.70;
/// Between things on one surface, metres.
const APART_M: f32 = 0.015;
/// Around a thing on the floor, metres from furniture, walls and doorways (facts S11.2: 0.65).
const FLOOR_CLEAR_M: f32 = 0.65;

/// A place on a top.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    host: usize,
    surface: Surface,
    /// Place on the surface, from its middle along its own x and z, as shares of the half extents.
    uv: Vec2,
}

/// A high top with its places.
#[derive(Clone, Debug)]
pub(super) struct HighTop {
    pub class: ClassId,
    /// The middle, then places side by side.
    pub middle: Slot,
    pub slots: Vec<Slot>,
}

impl Slot {
    fn point(&self) -> Vec3 {
        let offset =
            Vec3::new(self.uv.x * self.surface.half[0], 0.0, self.uv.y * self.surface.half[1]);
        self.surface.center + rotate_yaw(offset, self.surface.yaw_rad)
    }

    /// A thing of this class here, with its yaw relative to the furniture's, if it lies fully on
    /// the top and clear of everything else there.
    pub fn put(
        &self,
        house: &House,
        class: ClassId,
        turn_rad: f32,
        others: &[Thing],
    ) -> Option<Thing> {
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
        let thing = Thing::new(class, position, yaw_rad);
        let solids = UprightBox::of_thing(&thing);
        let touches =
            |other: &UprightBox, slack: f32| solids.iter().any(|s| s.overlap(other) > slack);
        let host = UprightBox::of_thing(&house.furniture[self.host]);
        let near = |t: &&Thing| xz(t.position).distance(xz(position)) < 0.8;
        let is_clear = !host.iter().any(|h| touches(h, 0.004))
            && !others.iter().filter(near).any(|t| {
                let apart = 0.5 * (t.size_m().max_element() + thing.size_m().max_element());
                let close = xz(t.position).distance(xz(position)) < apart + APART_M;
                close && UprightBox::of_thing(t).iter().any(|o| touches(o, -APART_M))
            });
        is_clear.then_some(thing)
    }
}

/// Whether somebody in a wheelchair can get so near to a point, without a wall between.
fn within_reach(house: &House, room: usize, p: Vec2, reach_m: f32) -> bool {
    let around = chaic_core::geom::Rect { min: p, max: p }.grown(reach_m);
    let rect = house.rooms[room].rect;
    house.ground.cells_in(around).any(|i| {
        let m = house.ground.middle(i);
        house.walkable[i] && rect.contains(m) && m.distance(p) <= reach_m
    })
}

fn room_of(house: &House, thing: &Thing) -> Option<usize> {
    house.rooms.iter().position(|r| r.rect.contains(xz(thing.position)))
}

/// All places on low furniture that anybody reaches: three a table, two a seat (facts S11.2).
pub(super) fn low(house: &House) -> Vec<Slot> {
    let mut slots = Vec::new();
    for (host, thing) in house.furniture.iter().enumerate() {
        if !LOW_HOSTS.contains(&thing.class.name()) {
            continue;
        }
        let Some(room) = room_of(house, thing) else { continue };
        for surface in top_surfaces(thing).into_iter().filter(|s| s.center.y < LOW_M) {
            for slot in spread(host, thing.class, surface) {
                if within_reach(house, room, xz(slot.point()), REACH_M) {
                    slots.push(slot);
                }
            }
        }
    }
    slots
}

/// Places on one surface, as many as it has room for.
fn spread(host: usize, class: ClassId, surface: Surface) -> Vec<Slot> {
    let [hx, hz] = surface.half;
    let area_m2 = 4.0 * hx * hz;
    // The front (-z) first: the back is mostly to a wall, and farther than an arm.
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
        // Towards the ends, which no chair keeps people from.
        &[[-0.78, -0.45], [0.78, -0.45], [-0.78, 0.45], [0.78, 0.45]]
    };
    uvs.iter().map(|uv| Slot { host, surface, uv: Vec2::from(*uv) }).collect()
}

/// The tops of cabinets and refrigerators that anybody can stand before, two or three places each.
pub(super) fn high(house: &House) -> Vec<HighTop> {
    let mut tops = Vec::new();
    for (host, thing) in house.furniture.iter().enumerate() {
        if !HIGH_HOSTS.contains(&thing.class.name()) {
            continue;
        }
        let Some(room) = room_of(house, thing) else { continue };
        let highest =
            top_surfaces(thing).into_iter().max_by(|a, b| a.center.y.total_cmp(&b.center.y));
        let Some(surface) = highest.filter(|s| s.center.y >= HIGH_M) else { continue };
        // Towards the front, where an arm gets to.
        let slot = |u: f32| Slot { host, surface, uv: Vec2::new(u, -0.45) };
        if !within_reach(house, room, xz(slot(0.0).point()), REACH_M) {
            continue;
        }
        // Every other top takes three things, so that ten to fifteen go up in a house.
        let us: &[f32] = if tops.len() % 2 == 0 { &[-0.66, 0.0, 0.66] } else { &[-0.45, 0.45] };
        let slots = us.iter().map(|u| slot(*u)).collect();
        tops.push(HighTop { class: thing.class, middle: slot(0.0), slots });
    }
    tops
}

impl Slot {
    /// The place on the same surface at this share of its half length, from its middle.
    pub fn along(mut self, u: f32) -> Slot {
        self.uv.x = u;
        self
    }

    /// The same place a little aside, so that no two episodes look alike.
    pub fn jittered(mut self, rng: &mut Stream) -> Slot {
        self.uv += Vec2::new(rng.range(-0.12, 0.12), rng.range(-0.12, 0.12));
        self
    }
}

/// Points on the floor of all rooms that are well away from furniture, walls and doorways and that
/// can be walked to, in the grid's order.
pub(super) fn floor(house: &House, clear_m: f32) -> Vec<Vec2> {
    let feet: Vec<_> = house.furniture.iter().map(foot).collect();
    let rooms: Vec<_> = house.rooms.iter().map(|r| r.rect.grown(-clear_m)).collect();
    let mut points = Vec::new();
    for i in (0..house.walkable.len()).filter(|i| house.walkable[*i]) {
        let (p, ground) = (house.ground.middle(i), &house.ground);
        // Every third cell either way is enough to choose from.
        if (i % ground.nx) % 3 != 0 || (i / ground.nx) % 3 != 0 {
            continue;
        }
        let in_room = rooms.iter().any(|r| r.contains(p));
        let is_clear = feet.iter().all(|f| rect_distance(f, p) >= clear_m.min(0.45));
        let doorways = house.openings.iter().map(|o| 0.5 * (o.a + o.b));
        if in_room && is_clear && doorways.into_iter().all(|d| d.distance(p) > 1.1) {
            points.push(p);
        }
    }
    points
}

/// Points on which targets may lie on the floor.
pub(super) fn floor_for_goods(house: &House) -> Vec<Vec2> {
    floor(house, FLOOR_CLEAR_M)
}
