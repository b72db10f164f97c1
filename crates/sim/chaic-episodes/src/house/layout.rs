//! Floor plans: a rectangle divided into rooms, with doorways that connect them.

use chaic_core::Vec2;
use chaic_core::geom::Rect;
use chaic_core::rng::RngStream;
use chaic_world::{Opening, RoomKind};

use crate::upright_box::mm;

/// Thickness of all walls, meters.
pub(super) const WALL_M: f32 = 0.12;
/// Width of doorways, meters.
pub(super) const DOOR_M: f32 = 1.2;
/// Minimum distance from a doorway to the middle of the nearest crossing wall, meters.
const CORNER_M: f32 = 0.5;
/// Minimum and maximum side of a room, meters.
const SIDE_M: [f32; 2] = [3.5, 7.2];
/// Attempts to cut one rectangle.
const ATTEMPTS_PER_CUT: usize = 10;
/// Attempts to cut per house.
const CUT_BUDGET: usize = 2000;
/// Maximum number of doorways of a room other than a corridor: each takes away a meter of wall.
const MAX_DOORS: usize = 4;

/// A straight wall that divides a rectangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// Axis of the wall's normal. 0: the wall stands at one x and runs along z; 1: the reverse.
    pub axis: usize,
    pub at: f32,
    pub from: f32,
    pub to: f32,
}

/// A doorway.
#[derive(Clone, Copy, Debug)]
pub(super) struct Door {
    /// Same as [`Cut::axis`].
    pub axis: usize,
    /// Position of the wall on its normal axis, meters.
    pub at: f32,
    /// Center along the wall, meters.
    pub middle: f32,
    /// Rooms on its two sides.
    pub rooms: [usize; 2],
    /// True if it belongs to the spanning tree that connects all rooms.
    pub is_spanning: bool,
}

impl Door {
    /// Returns the point at `across` from the wall's middle and `along` from the doorway's center.
    pub fn point(&self, across: f32, along: f32) -> Vec2 {
        if self.axis == 0 {
            Vec2::new(self.at + across, self.middle + along)
        } else {
            Vec2::new(self.middle + along, self.at + across)
        }
    }

    /// Converts to the representation in a setup.
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
    /// Outline along the center lines of the outer walls, meters.
    pub outer: Rect,
    /// Kind of each room, and its outline along the center lines of its walls, meters.
    pub rooms: Vec<(RoomKind, Rect)>,
    pub doors: Vec<Door>,
    pub cuts: Vec<Cut>,
}

/// Draws a random floor plan with `n_rooms` rooms; `None` if this draw fails.
pub(super) fn draw_plan(rng: &mut RngStream, n_rooms: usize) -> Option<Plan> {
    let has_corridor = n_rooms >= 7 && rng.chance(0.6);
    // More rooms need a larger house, and two rooms beside a corridor quickly become too long.
    let width_m = match n_rooms {
        _ if has_corridor => [18.2, 20.8],
        6 => [19.0, 21.0],
        7 => [20.0, 22.5],
        _ => [20.5, 26.0],
    };
    let depth_m = if has_corridor { [10.4, 12.2] } else { [9.8, 12.0] };
    let half_x = mm(0.5 * rng.range(width_m[0], width_m[1]));
    let half_z = mm(0.5 * rng.range(depth_m[0], depth_m[1]));
    let outer = Rect::new([-half_x, -half_z], [half_x, half_z]);
    let (mut rects, mut cuts) = (Vec::new(), Vec::new());
    let corridor = if has_corridor {
        Some(divide_with_corridor(rng, outer, n_rooms, &mut rects, &mut cuts)?)
    } else {
        divide(rng, outer, n_rooms, &mut rects, &mut cuts, &mut { CUT_BUDGET })?;
        None
    };
    let doors = draw_doors(rng, &rects, corridor)?;
    let kinds = draw_kinds(rng, &rects, corridor)?;
    Some(Plan { outer, rooms: kinds.into_iter().zip(rects).collect(), doors, cuts })
}

/// Divides `rect` at `at` and records the wall.
fn cut(rect: Rect, axis: usize, at: f32, cuts: &mut Vec<Cut>) -> (Rect, Rect) {
    let (mut low, mut high) = (rect, rect);
    low.max[axis] = at;
    high.min[axis] = at;
    cuts.push(Cut { axis, at, from: rect.min[1 - axis], to: rect.max[1 - axis] });
    (low, high)
}

/// Divides `rect` into `n` rooms of valid sizes. Tries several cuts at every level; `budget` limits
/// their total number.
fn divide(
    rng: &mut RngStream,
    rect: Rect,
    n: usize,
    rects: &mut Vec<Rect>,
    cuts: &mut Vec<Cut>,
    budget: &mut usize,
) -> Option<()> {
    let size = rect.size();
    if n == 1 {
        rects.push(rect);
        return (fits(size.x) && fits(size.y)).then_some(());
    }
    for _ in 0..ATTEMPTS_PER_CUT {
        *budget = budget.checked_sub(1)?;
        let axis = if rng.chance(size.x / (size.x + size.y)) { 0 } else { 1 };
        let low_n = 1 + rng.below(n - 1);
        let fraction = low_n as f32 / n as f32 + rng.range(-0.09, 0.09);
        let at = mm(rect.min[axis] + fraction * size[axis]);
        if at - rect.min[axis] < SIDE_M[0] || rect.max[axis] - at < SIDE_M[0] {
            continue;
        }
        let before = (rects.len(), cuts.len());
        let (low, high) = cut(rect, axis, at, cuts);
        let done = divide(rng, low, low_n, rects, cuts, budget)
            .and_then(|()| divide(rng, high, n - low_n, rects, cuts, budget));
        if done.is_some() {
            return done;
        }
        rects.truncate(before.0);
        cuts.truncate(before.1);
    }
    None
}

fn fits(side_m: f32) -> bool {
    (SIDE_M[0]..=SIDE_M[1]).contains(&side_m)
}

/// Divides `rect` into a full-depth end of two rooms and two rows along a corridor. Returns the
/// index of the corridor.
fn divide_with_corridor(
    rng: &mut RngStream,
    rect: Rect,
    n: usize,
    rects: &mut Vec<Rect>,
    cuts: &mut Vec<Cut>,
) -> Option<usize> {
    let end_m = rng.range(5.0, 7.0);
    let at_low_end = rng.chance(0.5);
    let at = mm(if at_low_end { rect.min.x + end_m } else { rect.max.x - end_m });
    let (low, high) = cut(rect, 0, at, cuts);
    let (end, main) = if at_low_end { (low, high) } else { (high, low) };
    divide(rng, end, 2, rects, cuts, &mut 50)?;

    let width_m = rng.range(1.8, 2.1);
    let near = mm(rect.min.y + (rect.size().y - width_m) * rng.range(0.44, 0.56));
    let far = mm(near + width_m);
    let (near_row, remaining) = cut(main, 1, near, cuts);
    let (corridor, far_row) = cut(remaining, 1, far, cuts);
    let in_rows = n - 3;
    let in_near =
        if in_rows % 2 == 1 && rng.chance(0.5) { in_rows.div_ceil(2) } else { in_rows / 2 };
    for (row, n) in [(near_row, in_near), (far_row, in_rows - in_near)] {
        let mut left = row;
        for k in 0..n - 1 {
            let even = left.size().x / (n - k) as f32;
            let at = mm(left.min.x + even + rng.range(-0.6, 0.6));
            let (done, more) = cut(left, 0, at, cuts);
            rects.push(done);
            left = more;
        }
        rects.push(left);
    }
    let all_fit = rects.iter().all(|r| fits(r.size().x) && fits(r.size().y));
    rects.push(corridor);
    all_fit.then_some(rects.len() - 1)
}

/// Returns the wall segment that two rooms share.
fn shared_wall(a: &Rect, b: &Rect) -> Option<Cut> {
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

/// Draws a random spanning tree of doorways, and up to two more.
fn draw_doors(rng: &mut RngStream, rects: &[Rect], corridor: Option<usize>) -> Option<Vec<Door>> {
    let mut edges = Vec::new();
    for b in 0..rects.len() {
        for a in 0..b {
            if let Some(wall) = shared_wall(&rects[a], &rects[b]) {
                // Corridors are preferred as connections.
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
            let is_needed = if is_spanning { !joined } else { loops_left > 0 && !has_door };
            if !is_needed || rooms.iter().any(|r| is_full(*r)) {
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

/// Draws the center of a doorway: mostly near an end of the wall, which leaves room for furniture.
fn door_middle(rng: &mut RngStream, wall: &Cut) -> f32 {
    let margin = 0.5 * DOOR_M + CORNER_M;
    let (low, high) = (wall.from + margin, wall.to - margin);
    let near_m = rng.range(0.0, 0.4).min(high - low);
    match rng.below(5) {
        0 | 1 => low + near_m,
        2 | 3 => high - near_m,
        _ => rng.range(low, high),
    }
}

/// Assigns a kind to each room: one kitchen, one bedroom, one or two offices, two to four living
/// rooms.
fn draw_kinds(
    rng: &mut RngStream,
    rects: &[Rect],
    corridor: Option<usize>,
) -> Option<Vec<RoomKind>> {
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
