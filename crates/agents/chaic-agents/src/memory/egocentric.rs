//! Egocentric map of the memory as network input: top view, body in the center, heading up.

use chaic_core::briefing::CompanionRole;
use chaic_core::geom::{forward, right, to_xz};
use chaic_core::{Briefing, Role, Vec2};

use super::Memory;
use crate::mapping::{CellOccupancy, MappedObject};

/// Channels of an [`EgocentricMap`], 1 where the property holds and 0 elsewhere: explored cells,
/// blocked cells, and the last known positions of objects and people.
pub const CHANNELS: [&str; 8] = [
    "known",
    "blocked",
    "target",
    "container",
    "obstacle",
    "goal_place",
    "partner",
    "other_person",
];
const KNOWN: usize = 0;
const BLOCKED: usize = 1;
const TARGET: usize = 2;
const CONTAINER: usize = 3;
const OBSTACLE: usize = 4;
const GOAL_PLACE: usize = 5;
const PARTNER: usize = 6;
const OTHER_PERSON: usize = 7;

/// Layout of an egocentric map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EgocentricMap {
    /// Number of cells along each side.
    pub side: usize,
    /// Side of a cell, meters.
    pub cell_m: f32,
}

impl EgocentricMap {
    /// Number of values, u8, shape [[`CHANNELS`], side, side], row 0 ahead.
    pub fn len(&self) -> usize {
        CHANNELS.len() * self.side * self.side
    }

    /// True if the map has no cells.
    pub fn is_empty(&self) -> bool {
        self.side == 0
    }

    /// Rasterizes the memory into `out`.
    ///
    /// # Panics
    /// If the length of `out` differs from [`EgocentricMap::len`].
    pub fn draw(&self, memory: &Memory, briefing: &Briefing, out: &mut [u8]) {
        assert_eq!(out.len(), self.len(), "the buffer length differs from the length of the map");
        out.fill(0);
        let n = self.side * self.side;
        let (ahead, right_axis) =
            (to_xz(forward(memory.pose.yaw_rad)), to_xz(right(memory.pose.yaw_rad)));
        let center = 0.5 * self.side as f32;
        let position = |k: usize| {
            let (column, row) = (k % self.side, k / self.side);
            let [x, y] = [column as f32 + 0.5 - center, center - row as f32 - 0.5];
            memory.position() + self.cell_m * (x * right_axis + y * ahead)
        };
        let grid = memory.map.grid();
        for k in 0..n {
            let Some(cell) = grid.cell_at(position(k)) else { continue };
            let state = memory.map.state(cell);
            out[KNOWN * n + k] = u8::from(state != CellOccupancy::Unknown);
            out[BLOCKED * n + k] =
                u8::from(matches!(state, CellOccupancy::Occupied | CellOccupancy::Wall));
        }
        let mut mark = |channel: usize, at: Vec2| {
            let offset = (at - memory.position()) / self.cell_m;
            let [column, row] = [center + offset.dot(right_axis), center - offset.dot(ahead)];
            let is_inside = |x: f32| x >= 0.0 && x < self.side as f32;
            if is_inside(column) && is_inside(row) {
                out[channel * n + row as usize * self.side + column as usize] = 1;
            }
        };
        for object in memory.objects.iter().filter(|object| object.is_present) {
            let Some(channel) = channel_of(object, briefing) else { continue };
            mark(channel, to_xz(object.position_in_world));
            object.footprint.iter().for_each(|at| mark(channel, *at));
        }
        for person in memory.people.iter() {
            let is_partner = briefing.companion(CompanionRole::Partner) == Some(person.agent);
            let channel = if is_partner { PARTNER } else { OTHER_PERSON };
            mark(channel, to_xz(person.position_in_world));
        }
    }
}

/// Returns the channel of an object, given the agent's briefing.
fn channel_of(object: &MappedObject, briefing: &Briefing) -> Option<usize> {
    let class = object.class;
    if briefing.goal_places.contains(&class) {
        return Some(GOAL_PLACE);
    }
    if object.is_out_of_play {
        return None;
    }
    if briefing.possible_targets.contains(&class) {
        return Some(TARGET);
    }
    match class.info().role {
        Role::Container => Some(CONTAINER),
        Role::Obstacle => Some(OBSTACLE),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rules::PlannerRules;
    use crate::test_support::{Toy, ToyObject, ToyRun};

    #[test]
    fn objects_ahead_are_drawn_above_the_center() {
        let mut toy = Toy::room(10.0, 10.0);
        toy.add(ToyObject::new("apple", [0.6, 0.0, -2.0], [0.1, 0.1, 0.1]));
        toy.stand([0.0, 0.0], 0.0);
        let briefing = toy.briefing();
        let map = EgocentricMap { side: 48, cell_m: 0.25 };
        let mut out = vec![9; map.len()];
        map.draw(&Memory::new(&briefing, PlannerRules::paper()), &briefing, &mut out);
        assert!(out.iter().all(|x| *x == 0), "nothing has been observed yet");
        let memory = ToyRun::new(toy).observe();
        map.draw(&memory, &briefing, &mut out);
        let marked: Vec<usize> = (0..48 * 48).filter(|k| out[TARGET * 48 * 48 + k] == 1).collect();
        assert!(!marked.is_empty());
        for k in marked {
            let (column, row) = (k % 48, k / 48);
            assert!((25..=27).contains(&column) && (15..=17).contains(&row), "{column} {row}");
        }
        let known =
            |row: usize| (0..48).filter(|c| out[KNOWN * 48 * 48 + row * 48 + c] == 1).count();
        assert!(known(16) > 8, "cells ahead are known: {}", known(16));
        assert_eq!(known(40), 0, "cells behind are unknown");
    }
}
