//! Floor plans: a rectangle cut into rooms, with doorways that join them.

use chaic_protocol::Vec2;
use chaic_protocol::geom::Rect;
use chaic_protocol::rng::Stream;
use chaic_world::{Opening, RoomKind, Wall};

use crate::solid::mm;

/// Thickness of all walls, metres.
pub(super) const WALL_M: f32 = 0.12;
/// Height of rooms, metres.
pub(super) const CEILING_M: f32 = 2.9;
/// Width of doorways, metres.
pub(super) const DOOR_M: f32 = 1.2;
/// Height of doorways, metres.
const LINTEL_M: f32 = 2.1;
/// From a doorway to the middle of the nearest crossing wall, at least, metres.
const CORNER_M: f32 = 0.5;
/// Sides of rooms, metres.
const SIDE_M: [f32; 2] = [3.5, 7.0];
/// Most doorways of a room that isn't a corridor: each takes away a metre of wall.
const MAX_DOORS: usize = 4;

/// A straight cut through a rectangle.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// 0: the wall stands at one x and runs along z; 1: the other way round.
    axis: usize,
    at: f32,
    from: f32,
    to: f32,
}

/// A doorway.
#[derive(Clone, Copy, Debug)]
pub(super) struct Door {
    /// As [`Cut::axis`].
    pub axis: usize,
    /// Where the wall stands.
    pub at: f32,
    /// Middle along the wall.
    pub middle: f32,
    /// The rooms on its two sides.
    pub rooms: [usize; 2],
    /// Whether it belongs to the tree that joins all rooms.
    pub is_spanning: bool,
}

impl Door {
    /// The point at `across` from the wall's middle and `along` from the doorway's.
    pub fn point(&self, across: f32, along: f32) -> Vec2 {
        if self.axis == 0 {
            Vec2::new(self.at + across, self.middle + along)
        } else {
            Vec2::new(self.middle + along, self.at + across)
        }
    }

    /// As the setup has it.
    pub fn opening(&self) -> Opening {
        Opening {
            a: self.point(0.0, -0.5 * DOOR_M),
            b: self.point(0.0, 0.5 * DOOR_M),
            rooms: self.rooms.map(|r| r as u32),
        }
    }
}

/// Rooms, walls and doorways without furniture.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// Between the middles of the outer walls.
    pub outer: Rect,
    /// Between the middles of their walls.
    pub rooms: Vec<(RoomKind, Rect)>,
    pub doors: Vec<Door>,
    cuts: Vec<Cut>,
}

/// A random floor plan, unless this draw leads to none.
pub(super) fn plan(rng: &mut Stream) -> Option<Plan> {
    let half = Vec2::new(mm(0.5 * rng.range(20.0, 26.0)), mm(0.5 * rng.range(10.0, 12.0)));
    let outer = Rect { min: -half, max: half };
    let (mut rects, mut cuts) = (Vec::new(), Vec::new());
    let n_rooms = 6 + rng.below(3);
    let corridor = if n_rooms >= 7 && rng.chance(0.45) {
        Some(with_corridor(rng, outer, n_rooms, &mut rects, &mut cuts)?)
    } else {
        divide(rng, outer, n_rooms, &mut rects, &mut cuts)?;
        None
    };
    let doors = doors(rng, &rects, corridor)?;
    let kinds = kinds(rng, &rects, corridor)?;
    Some(Plan { outer, rooms: kinds.into_iter().zip(rects).collect(), doors, cuts })
}

/// Cuts `rect` in two at `at` and notes the wall.
fn cut(rect: Rect, axis: usize, at: f32, cuts: &mut Vec<Cut>) -> (Rect, Rect) {
    let (mut low, mut high) = (rect, rect);
    low.max[axis] = at;
    high.min[axis] = at;
    cuts.push(Cut { axis, at, from: rect.min[1 - axis], to: rect.max[1 - axis] });
    (low, high)
}

/// Divides `rect` into `n` rooms of good sizes.
fn divide(
    rng: &mut Stream,
    rect: Rect,
    n: usize,
    rects: &mut Vec<Rect>,
    cuts: &mut Vec<Cut>,
) -> Option<()> {
    let size = rect.size();
    let fits = |s: f32| (SIDE_M[0]..=SIDE_M[1]).contains(&s);
    if n == 1 {
        rects.push(rect);
        return (fits(size.x) && fits(size.y)).then_some(());
    }
    let axis =
        if size.x > 1.15 * size.y || (size.x > 0.85 * size.y && rng.chance(0.5)) { 0 } else { 1 };
    let low_n = 1 + rng.below(n - 1);
    let share = (low_n as f32 / n as f32 + rng.range(-0.09, 0.09)).clamp(0.15, 0.85);
    let at = mm(rect.min[axis] + share * size[axis]);
    if at - rect.min[axis] < SIDE_M[0] || rect.max[axis] - at < SIDE_M[0] {
        return None;
    }
    let (low, high) = cut(rect, axis, at, cuts);
    divide(rng, low, low_n, rects, cuts)?;
    divide(rng, high, n - low_n, rects, cuts)
}

/// Divides `rect` into a full-depth end of two rooms and two rows along a corridor. Returns which
/// of the rooms is the corridor.
fn with_corridor(
    rng: &mut Stream,
    rect: Rect,
    n: usize,
    rects: &mut Vec<Rect>,
    cuts: &mut Vec<Cut>,
) -> Option<usize> {
    let end_m = rng.range(4.5, 6.6);
    let at_low_end = rng.chance(0.5);
    let at = mm(if at_low_end { rect.min.x + end_m } else { rect.max.x - end_m });
    let (low, high) = cut(rect, 0, at, cuts);
    let (end, rest) = if at_low_end { (low, high) } else { (high, low) };
    divide(rng, end, 2, rects, cuts)?;

    let width_m = rng.range(1.8, 2.1);
    let near = mm(rect.min.y + (rect.size().y - width_m) * rng.range(0.44, 0.56));
    let far = mm(near + width_m);
    let (near_row, others) = cut(rest, 1, near, cuts);
    let (corridor, far_row) = cut(others, 1, far, cuts);
    let in_rows = n - 3;
    let in_near =
        if in_rows % 2 == 1 && rng.chance(0.5) { in_rows.div_ceil(2) } else { in_rows / 2 };
    for (row, n) in [(near_row, in_near), (far_row, in_rows - in_near)] {
        let mut left = row;
        for k in 0..n - 1 {
            let even = left.size().x / (n - k) as f32;
            let at = mm(left.min.x + even + rng.range(-0.8, 0.8));
            let (done, more) = cut(left, 0, at, cuts);
            rects.push(done);
            left = more;
        }
        rects.push(left);
    }
    let fits = |s: f32| (SIDE_M[0]..=SIDE_M[1]).contains(&s);
    let all_fit = rects.iter().all(|r| fits(r.size().x) && fits(r.size().y));
    rects.push(corridor);
    all_fit.then_some(rects.len() - 1)
}

/// The stretch of wall that two rooms share: where it stands, and from where to where.
fn shared(a: &Rect, b: &Rect) -> Option<Cut> {
    for axis in 0..2 {
        let other = 1 - axis;
        let (from, to) = (a.min[other].max(b.min[other]), a.max[other].min(b.max[other]));
        let at = if a.max[axis] == b.min[axis] {
            a.max[axis]
        } else if b.max[axis] == a.min[axis] {
            a.min[axis]
        } else {
            continue;
        };
        if to - from >= DOOR_M + 2.0 * CORNER_M + 0.05 {
            return Some(Cut { axis, at, from, to });
        }
    }
    None
}

/// A random tree of doorways that joins all rooms, and up to two more.
fn doors(rng: &mut Stream, rects: &[Rect], corridor: Option<usize>) -> Option<Vec<Door>> {
    let mut edges = Vec::new();
    for b in 0..rects.len() {
        for a in 0..b {
            if let Some(wall) = shared(&rects[a], &rects[b]) {
                // People walk through a corridor rather than through each other's rooms.
                let is_corridor = corridor == Some(a) || corridor == Some(b);
                let weight = rng.unit() + if is_corridor { -0.6 } else { 0.0 };
                edges.push((weight, [a, b], wall));
            }
        }
    }
    edges.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut group: Vec<usize> = (0..rects.len()).collect();
    let mut loops_left = rng.below(3);
    let mut doors: Vec<Door> = Vec::new();
    for is_spanning in [true, false] {
        for (_, rooms, wall) in &edges {
            let joined = group[rooms[0]] == group[rooms[1]];
            let has_door = doors.iter().any(|d| d.rooms == *rooms);
            let is_full = |r: usize| {
                let n = doors.iter().filter(|d| d.rooms.contains(&r)).count();
                corridor != Some(r) && n >= MAX_DOORS
            };
            let wanted = if is_spanning { !joined } else { loops_left > 0 && !has_door };
            if !wanted || rooms.iter().any(|r| is_full(*r)) {
                continue;
            }
            if is_spanning {
                let (from, to) = (group[rooms[1]], group[rooms[0]]);
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            } else {
                loops_left -= 1;
            }
            let middle = mm(door_middle(rng, wall));
            doors.push(Door { axis: wall.axis, at: wall.at, middle, rooms: *rooms, is_spanning });
        }
    }
    group.iter().all(|g| *g == group[0]).then_some(doors)
}

/// Doorways are mostly near an end of their wall, which leaves room for furniture.
fn door_middle(rng: &mut Stream, wall: &Cut) -> f32 {
    let margin = 0.5 * DOOR_M + CORNER_M;
    let (low, high) = (wall.from + margin, wall.to - margin);
    let near_m = rng.range(0.0, 0.4).min(high - low);
    match rng.below(5) {
        0 | 1 => low + near_m,
        2 | 3 => high - near_m,
        _ => rng.range(low, high),
    }
}

/// What each room is for: one kitchen, one bedroom, one or two offices, two to four living rooms.
fn kinds(rng: &mut Stream, rects: &[Rect], corridor: Option<usize>) -> Option<Vec<RoomKind>> {
    let mut order: Vec<usize> = (0..rects.len()).filter(|r| corridor != Some(*r)).collect();
    rng.shuffle(&mut order);
    let mut kinds = vec![RoomKind::LivingRoom; rects.len()];
    let mut take = |kind: RoomKind, side_m: f32| {
        let i = order.iter().position(|r| rects[*r].size().min_element() >= side_m)?;
        kinds[order.remove(i)] = kind;
        Some(())
    };
    take(RoomKind::Bedroom, 4.2)?;
    take(RoomKind::Kitchen, 3.9)?;
    take(RoomKind::Office, SIDE_M[0])?;
    if rects.len() == 8 && corridor.is_none() {
        take(RoomKind::Office, SIDE_M[0])?;
    }
    if let Some(c) = corridor {
        kinds[c] = RoomKind::Corridor;
    }
    Some(kinds)
}

impl Plan {
    /// All walls, cut at doorways, with lintels. Ends are drawn in by half the thickness, which a
    /// wall's box adds again, so that no two boxes share a volume and doorways keep their width.
    pub fn walls(&self, outer_color: [u8; 3], inner_color: [u8; 3]) -> Vec<Wall> {
        let (o, t) = (self.outer, 0.5 * WALL_M);
        let mut walls = Vec::new();
        for (axis, at, from, to) in [
            (1, o.min.y, o.min.x - t, o.max.x + t),
            (1, o.max.y, o.min.x - t, o.max.x + t),
            (0, o.min.x, o.min.y + t, o.max.y - t),
            (0, o.max.x, o.min.y + t, o.max.y - t),
        ] {
            walls.push(wall(axis, at, [from, to], [0.0, CEILING_M], outer_color));
        }
        for c in &self.cuts {
            let on_it = |d: &&Door| {
                d.axis == c.axis && d.at == c.at && d.middle > c.from && d.middle < c.to
            };
            let mut middles: Vec<f32> = self.doors.iter().filter(on_it).map(|d| d.middle).collect();
            middles.sort_by(f32::total_cmp);
            let mut from = c.from + t;
            for middle in middles {
                let (a, b) = (middle - 0.5 * DOOR_M, middle + 0.5 * DOOR_M);
                walls.push(wall(c.axis, c.at, [from, a], [0.0, CEILING_M], inner_color));
                walls.push(wall(c.axis, c.at, [a, b], [LINTEL_M, CEILING_M], inner_color));
                from = b;
            }
            walls.push(wall(c.axis, c.at, [from, c.to - t], [0.0, CEILING_M], inner_color));
        }
        walls
    }
}

fn wall(axis: usize, at: f32, span: [f32; 2], height_m: [f32; 2], color: [u8; 3]) -> Wall {
    let end = |v: f32| {
        let v = mm(v);
        if axis == 0 { Vec2::new(at, v) } else { Vec2::new(v, at) }
    };
    Wall {
        a: end(span[0] + 0.5 * WALL_M),
        b: end(span[1] - 0.5 * WALL_M),
        thickness_m: WALL_M,
        bottom_m: height_m[0],
        top_m: height_m[1],
        color,
    }
}
