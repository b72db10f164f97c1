//! Floor plans: a rectangle cut into rooms, with doorways that join them.

use chaic_core::Vec2;
use chaic_core::geom::Rect;
use chaic_core::rng::Stream;
use chaic_world::{Opening, RoomKind};

use crate::upright_box::mm;

/// Thickness of all walls, metres.
pub(super) const WALL_M: f32 = 0.12;
/// Width of doorways, metres.
pub(super) const DOOR_M: f32 = 1.2;
/// From a doorway to the middle of the nearest crossing wall, at least, metres.
const CORNER_M: f32 = 0.5;
/// Sides of rooms, metres.
const SIDE_M: [f32; 2] = [3.5, 7.2];
/// Cuts that are tried for one rectangle.
const TRIES_PER_CUT: usize = 10;
/// Cuts that are tried for one house.
const CUT_BUDGET: usize = 2000;
/// Most doorways of a room that isn't a corridor: each takes away a metre of wall.
const MAX_DOORS: usize = 4;

/// A straight cut through a rectangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// 0: the wall stands at one x and runs along z; 1: the other way round.
    pub axis: usize,
    pub at: f32,
    pub from: f32,
    pub to: f32,
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
    pub cuts: Vec<Cut>,
}

/// A random floor plan of so many rooms, unless this draw leads to none.
pub(super) fn plan(rng: &mut Stream, n_rooms: usize) -> Option<Plan> {
    let has_corridor = n_rooms >= 7 && rng.chance(0.6);
    // More rooms need more house, and two rooms beside a corridor are soon too long.
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
        Some(with_corridor(rng, outer, n_rooms, &mut rects, &mut cuts)?)
    } else {
        divide(rng, outer, n_rooms, &mut rects, &mut cuts, &mut { CUT_BUDGET })?;
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

/// Divides `rect` into `n` rooms of good sizes. Tries several cuts at every level; `budget` bounds
/// how many in all.
fn divide(
    rng: &mut Stream,
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
    for _ in 0..TRIES_PER_CUT {
        *budget = budget.checked_sub(1)?;
        let axis = if rng.chance(size.x / (size.x + size.y)) { 0 } else { 1 };
        let low_n = 1 + rng.below(n - 1);
        let share = low_n as f32 / n as f32 + rng.range(-0.09, 0.09);
        let at = mm(rect.min[axis] + share * size[axis]);
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

/// Divides `rect` into a full-depth end of two rooms and two rows along a corridor. Returns which
/// of the rooms is the corridor.
fn with_corridor(
    rng: &mut Stream,
    rect: Rect,
    n: usize,
    rects: &mut Vec<Rect>,
    cuts: &mut Vec<Cut>,
) -> Option<usize> {
    let end_m = rng.range(5.0, 7.0);
    let at_low_end = rng.chance(0.5);
    let at = mm(if at_low_end { rect.min.x + end_m } else { rect.max.x - end_m });
    let (low, high) = cut(rect, 0, at, cuts);
    let (end, rest) = if at_low_end { (low, high) } else { (high, low) };
    divide(rng, end, 2, rects, cuts, &mut 50)?;

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
