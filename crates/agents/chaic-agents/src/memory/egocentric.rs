//! What is remembered as an image for networks: seen from above, the own body in the middle, ahead upward.

use chaic_core::briefing::Relation;
use chaic_core::geom::{forward, right, xz};
use chaic_core::{Briefing, Role, Vec2};

use super::Memory;
use crate::mapping::{Space, Thing};

/// What the channels of an [`EgocentricMap`] show, 1 where it is so and 0 elsewhere: what was seen of the place, what
/// can't be walked through, and what is believed to be where it was seen last.
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

/// How large such a map is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EgocentricMap {
    /// Cells along each side.
    pub side: usize,
    /// Side of a cell, metres.
    pub cell_m: f32,
}

impl EgocentricMap {
    /// How many numbers it has: shape [[`CHANNELS`], side, side], row 0 ahead.
    pub fn len(&self) -> usize {
        CHANNELS.len() * self.side * self.side
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.side == 0
    }

    /// Draws what is remembered.
    ///
    /// # Panics
    /// If `out` has another length than [`EgocentricMap::len`].
    pub fn draw(&self, memory: &Memory, briefing: &Briefing, out: &mut [u8]) {
        assert_eq!(out.len(), self.len(), "the map has another shape");
        out.fill(0);
        let n = self.side * self.side;
        let (ahead, aside) = (xz(forward(memory.pose.yaw_rad)), xz(right(memory.pose.yaw_rad)));
        let middle = 0.5 * self.side as f32;
        let place = |k: usize| {
            let (column, row) = (k % self.side, k / self.side);
            let [x, y] = [column as f32 + 0.5 - middle, middle - row as f32 - 0.5];
            memory.here() + self.cell_m * (x * aside + y * ahead)
        };
        let grid = memory.map.grid();
        for k in 0..n {
            let Some(cell) = grid.cell_at(place(k)) else { continue };
            let space = memory.map.space(cell);
            out[KNOWN * n + k] = u8::from(space != Space::Unknown);
            out[BLOCKED * n + k] = u8::from(matches!(space, Space::Occupied | Space::Wall));
        }
        let mut mark = |channel: usize, at: Vec2| {
            let way = (at - memory.here()) / self.cell_m;
            let [column, row] = [middle + way.dot(aside), middle - way.dot(ahead)];
            let is_inside = |x: f32| x >= 0.0 && x < self.side as f32;
            if is_inside(column) && is_inside(row) {
                out[channel * n + row as usize * self.side + column as usize] = 1;
            }
        };
        for thing in memory.things.iter().filter(|thing| thing.is_present) {
            let Some(channel) = channel_of(thing, briefing) else { continue };
            mark(channel, xz(thing.position_in_world));
            thing.footprint.iter().for_each(|at| mark(channel, *at));
        }
        for person in memory.people.iter() {
            let is_partner = briefing.companion(Relation::Partner) == Some(person.agent);
            let channel = if is_partner { PARTNER } else { OTHER_PERSON };
            mark(channel, xz(person.position_in_world));
        }
    }
}

/// What a thing is to the reader of a briefing.
fn channel_of(thing: &Thing, briefing: &Briefing) -> Option<usize> {
    let class = thing.class;
    if briefing.goal_places.contains(&class) {
        return Some(GOAL_PLACE);
    }
    if thing.is_gone {
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
    fn what_was_seen_ahead_lies_above_the_middle() {
        let mut toy = Toy::room(10.0, 10.0);
        toy.add(ToyObject::new("apple", [0.6, 0.0, -2.0], [0.1, 0.1, 0.1]));
        toy.stand([0.0, 0.0], 0.0);
        let briefing = toy.briefing();
        let map = EgocentricMap { side: 48, cell_m: 0.25 };
        let mut out = vec![9; map.len()];
        map.draw(&Memory::new(&briefing, PlannerRules::paper()), &briefing, &mut out);
        assert!(out.iter().all(|x| *x == 0), "nothing was seen yet");
        let memory = ToyRun::new(toy).look();
        map.draw(&memory, &briefing, &mut out);
        let marked: Vec<usize> = (0..48 * 48).filter(|k| out[TARGET * 48 * 48 + k] == 1).collect();
        assert!(!marked.is_empty());
        for k in marked {
            let (column, row) = (k % 48, k / 48);
            assert!((25..=27).contains(&column) && (15..=17).contains(&row), "{column} {row}");
        }
        let known =
            |row: usize| (0..48).filter(|c| out[KNOWN * 48 * 48 + row * 48 + c] == 1).count();
        assert!(known(16) > 8, "one sees ahead: {}", known(16));
        assert_eq!(known(40), 0, "and not behind");
    }
}
