//! Finding out: goes to the nearest border of the known, and when there is none, to where nobody
//! has looked for longest.

use chaic_core::geom::{Rect, xz};
use chaic_core::{Action, Frame, Vec2};

use super::navigate::{Destination, Nav, Navigator, face};
use crate::mapping::Space;
use crate::memory::Memory;
use crate::planning::path::CostField;
use crate::track::Intent;

/// Borders shorter than this lead nowhere, cells (0.6 m).
const MIN_FRONTIER: usize = 5;
/// A border that could not be resolved is left alone for so long, frames.
const BLACKLIST_FRAMES: Frame = 1000;
/// And everything within this radius of it, metres.
const BLACKLIST_M: f32 = 0.75;
/// So near to a border one should see beyond it, metres.
const ARRIVE_M: f32 = 0.5;
/// A border counts as resolved if none is left within this radius of its middle, metres.
const RESOLVED_M: f32 = 0.3;
/// A cell of border is worth so much of a way, metres, up to that much.
const WORTH_M: (f32, f32) = (0.03, 2.0);
/// How near to go to a place that is looked at again, metres.
const REVISIT_M: f32 = 1.0;
/// Turns to look around at a place that is looked at again.
const REVISIT_TURNS: u32 = 12;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Target {
    at: Vec2,
    /// A place just beyond the border.
    beyond: Vec2,
    is_frontier: bool,
    since: Frame,
    n_turns: u32,
}

/// What exploring says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// Do this next.
    Act(Intent),
    /// The border pursued is known now; ask again for the next.
    Resolved,
}

/// Explores; keeps what it pursues between decisions.
#[derive(Clone, Debug)]
pub struct Explorer {
    bounds: Rect,
    target: Option<Target>,
    blacklist: Vec<(Vec2, Frame)>,
    is_exhausted: bool,
}

impl Explorer {
    /// Explores the inside of `bounds`.
    pub fn new(bounds: Rect) -> Explorer {
        Explorer { bounds, target: None, blacklist: Vec::new(), is_exhausted: false }
    }

    /// Whether no border of the known was left when last looked for.
    pub fn is_exhausted(&self) -> bool {
        self.is_exhausted
    }

    /// Drops what it pursues, and leaves it alone if it could not be got to.
    pub fn give_up(&mut self, now: Frame) {
        if let Some(target) = self.target.take() {
            self.blacklist.push((target.at, now + BLACKLIST_FRAMES));
        }
    }

    /// The next action.
    pub fn step(&mut self, memory: &mut Memory, navigator: &mut Navigator) -> Found {
        let now = memory.frame;
        self.blacklist.retain(|(_, until)| *until > now);
        if self.target.is_some_and(|t| now > t.since + memory.rules.limits.explore_frames) {
            self.give_up(now);
        }
        if let Some(target) = self.target
            && target.is_frontier
            && !self.is_open(memory, target.at)
        {
            self.target = None;
            return Found::Resolved;
        }
        let target = match self.target {
            Some(target) => target,
            None => match self.choose(memory) {
                Some(target) => target,
                None => return Found::Act(Action::TurnLeft),
            },
        };
        self.target = Some(target);
        let within_m = if target.is_frontier { ARRIVE_M } else { REVISIT_M };
        match navigator.step(memory, &Destination::near(target.at, within_m)) {
            Nav::Act(action) => Found::Act(action),
            Nav::Unreachable => {
                self.give_up(now);
                Found::Resolved
            }
            Nav::Arrived => self.look(memory, target),
        }
    }

    /// At the place: looks beyond the border, or around.
    fn look(&mut self, memory: &Memory, target: Target) -> Found {
        if target.is_frontier {
            if let Some(turn) = face(memory, target.beyond, 0.3)
                && target.n_turns < REVISIT_TURNS
            {
                self.target = Some(Target { n_turns: target.n_turns + 1, ..target });
                return Found::Act(turn);
            }
            // One looks straight at it and it is still unknown: it can't be seen from here.
            self.give_up(memory.frame);
            return Found::Resolved;
        }
        if target.n_turns < REVISIT_TURNS {
            self.target = Some(Target { n_turns: target.n_turns + 1, ..target });
            return Found::Act(Action::TurnLeft);
        }
        self.give_up(memory.frame);
        Found::Resolved
    }

    /// Whether there is still border around a point.
    fn is_open(&self, memory: &Memory, at: Vec2) -> bool {
        memory.map.grid().disc(at, RESOLVED_M).any(|c| self.is_frontier(memory, c))
    }

    /// A free cell, where the body fits, beside something unknown.
    fn is_frontier(&self, memory: &Memory, cell: usize) -> bool {
        let (map, costs) = (&memory.map, memory.costs());
        map.space(cell) == Space::Free
            && !costs.is_tight(cell)
            && self.unknown_side(memory, cell).is_some()
    }

    fn unknown_side(&self, memory: &Memory, cell: usize) -> Option<usize> {
        let (map, grid) = (&memory.map, memory.map.grid());
        grid.neighbors(cell)
            .filter(|(_, diagonal)| !diagonal)
            .map(|(c, _)| c)
            .find(|c| map.is_unexplored(*c) && self.bounds.contains(grid.center(*c)))
    }

    fn choose(&mut self, memory: &mut Memory) -> Option<Target> {
        memory.refresh();
        let field = memory.cost_field()?;
        let frontier = self.nearest_frontier(memory, field);
        self.is_exhausted = frontier.is_none();
        let target = frontier.or_else(|| self.longest_unseen(memory, field));
        if target.is_none() {
            let here = memory.here();
            self.blacklist.retain(|(at, _)| at.distance(here) < BLACKLIST_M);
            // Who can get nowhere is not walled in: one of the barriers isn't there.
            memory.map.forget_barriers();
        }
        target
    }

    fn is_blacklisted(&self, at: Vec2) -> bool {
        self.blacklist.iter().any(|(b, _)| b.distance(at) < BLACKLIST_M)
    }

    /// The border that is cheapest to get to, long ones preferred a little.
    fn nearest_frontier(&self, memory: &Memory, field: &CostField) -> Option<Target> {
        let grid = memory.map.grid();
        let mut is_open: Vec<bool> = (0..grid.n_cells())
            .map(|c| field.cost(c).is_some() && self.is_frontier(memory, c))
            .collect();
        let mut best: Option<(f32, Target)> = None;
        let mut cluster = Vec::new();
        for first in 0..grid.n_cells() {
            if !std::mem::take(&mut is_open[first]) {
                continue;
            }
            cluster.clear();
            cluster.push(first);
            let mut k = 0;
            while k < cluster.len() {
                for (next, _) in grid.neighbors(cluster[k]) {
                    if std::mem::take(&mut is_open[next]) {
                        cluster.push(next);
                    }
                }
                k += 1;
            }
            if cluster.len() < MIN_FRONTIER {
                continue;
            }
            let nearest = cluster
                .iter()
                .filter(|c| !self.is_blacklisted(grid.center(**c)))
                .filter_map(|c| Some((field.cost(*c)?, *c)))
                .min();
            let Some((cost, cell)) = nearest else { continue };
            let worth_m = (WORTH_M.0 * cluster.len() as f32).min(WORTH_M.1);
            let score = CostField::metres(cost) - worth_m;
            if best.is_none_or(|(s, _)| score < s) {
                let at = grid.center(cell);
                let side = self.unknown_side(memory, cell).map_or(at, |c| grid.center(c));
                let beyond = at + 4.0 * (side - at);
                let since = memory.frame;
                best = Some((score, Target { at, beyond, is_frontier: true, since, n_turns: 0 }));
            }
        }
        best.map(|(_, target)| target)
    }

    /// The place that nobody has looked at for longest, for the length of the way to it.
    fn longest_unseen(&self, memory: &Memory, field: &CostField) -> Option<Target> {
        let grid = memory.map.grid();
        let mut best: Option<(f32, Vec2)> = None;
        for (i, j) in
            (0..grid.nz()).step_by(4).flat_map(|j| (0..grid.nx()).step_by(4).map(move |i| (i, j)))
        {
            let cell = j * grid.nx() + i;
            let (at, Some(cost)) = (grid.center(cell), field.cost(cell)) else { continue };
            let usable = memory.map.space(cell) == Space::Free
                && !memory.costs().is_tight(cell)
                && self.bounds.contains(at)
                && at.distance(xz(memory.pose.position)) > 1.5
                && !self.is_blacklisted(at);
            if !usable {
                continue;
            }
            let age = (memory.frame + 1).saturating_sub(memory.map.place_seen(cell).unwrap_or(0));
            let score = age as f32 / (5.0 + CostField::metres(cost));
            if best.is_none_or(|(s, _)| score > s) {
                best = Some((score, at));
            }
        }
        best.map(|(_, at)| Target {
            at,
            beyond: at,
            is_frontier: false,
            since: memory.frame,
            n_turns: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Toy, ToyRun};

    #[test]
    fn two_rooms_are_explored_and_then_nothing_is_left() {
        let mut toy = Toy::room(10.0, 6.0);
        toy.add_wall([-0.05, -3.0], [0.05, 0.4]);
        toy.add_wall([-0.05, 1.4], [0.05, 3.0]);
        toy.stand([-4.0, -2.0], 0.0);
        let mut explorer = Explorer::new(toy.bounds());
        let mut navigator = Navigator::default();
        let mut run = ToyRun::new(toy);
        let mut went_across = false;
        for _ in 0..300 {
            let mut memory = run.look();
            went_across |= memory.here().x > 0.3;
            if went_across && explorer.is_exhausted() {
                let grid = *memory.map.grid();
                let known = |x, z| {
                    let cell = grid.cell_at(Vec2::new(x, z)).expect("inside");
                    memory.map.space(cell) == Space::Free
                };
                assert!(known(4.5, 2.5) && known(4.5, -2.5) && known(-4.5, 2.5));
                return;
            }
            match explorer.step(&mut memory, &mut navigator) {
                Found::Act(action) => run.act(action, memory),
                Found::Resolved => run.keep(memory),
            }
        }
        panic!("not done; across: {went_across}, at {:?}", run.toy.here());
    }
}
