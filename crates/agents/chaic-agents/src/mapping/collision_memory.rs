//! Collisions at positions that the map shows as free.

use chaic_core::{Frame, Vec2};

use super::grid::Grid;

/// Time for which a bump is remembered, frames.
const BUMP_FRAMES: Frame = 300;
/// Radius around a bump that is avoided, meters.
const BUMP_RADIUS_M: f32 = 0.2;
/// Number of bumps that form a barrier, if they are within [`BARRIER_M`] of the latest one.
const BARRIER_BUMPS: usize = 3;
const BARRIER_M: f32 = 0.6;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bump {
    at: Vec2,
    until: Frame,
}

/// Recent bumps, and positions treated as barriers. An obstacle at a barrier is unseen, or leaves
/// too little room.
#[derive(Clone, Debug, Default)]
pub struct CollisionMemory {
    recent: Vec<Bump>,
    barriers: Vec<Bump>,
}

impl CollisionMemory {
    /// Records a bump at `at` (x, z). Repeated bumps at one position form a barrier for
    /// `repeated_collision_frames`.
    pub fn record(&mut self, at: Vec2, now: Frame, repeated_collision_frames: Frame) {
        self.recent.push(Bump { at, until: now + BUMP_FRAMES });
        let is_here = |bump: &Bump| bump.at.distance(at) < BARRIER_M;
        if self.recent.iter().filter(|b| is_here(b)).count() >= BARRIER_BUMPS {
            let here = self.recent.extract_if(.., |b| is_here(b));
            self.barriers
                .extend(here.map(|b| Bump { until: now + repeated_collision_frames, ..b }));
        }
    }

    /// Removes expired entries; returns whether there were any.
    pub fn expire(&mut self, now: Frame) -> bool {
        let n = self.recent.len() + self.barriers.len();
        self.recent.retain(|b| b.until > now);
        self.barriers.retain(|b| b.until > now);
        n != self.recent.len() + self.barriers.len()
    }

    /// Removes all barriers; returns whether there were any.
    pub fn clear_barriers(&mut self) -> bool {
        let had_barriers = !self.barriers.is_empty();
        self.barriers.clear();
        had_barriers
    }

    /// Cells to avoid because of recent bumps; cells near several bumps occur several times.
    pub fn recent_cells(&self, grid: &Grid) -> impl Iterator<Item = usize> {
        self.recent.iter().flat_map(|b| grid.disc(b.at, BUMP_RADIUS_M))
    }

    /// Cells that a body of this radius, meters, cannot enter because of barriers.
    pub fn blocked_cells(&self, grid: &Grid, radius_m: f32) -> impl Iterator<Item = usize> {
        self.barriers.iter().flat_map(move |b| grid.disc(b.at, radius_m))
    }
}

#[cfg(test)]
mod tests {
    use chaic_core::geom::Rect;

    use super::*;

    #[test]
    fn repeated_bumps_form_a_barrier_for_a_while() {
        let grid = Grid::new(&Rect::new([-3.0, -3.0], [3.0, 3.0]));
        let mut bumps = CollisionMemory::default();
        let n_barred = |bumps: &CollisionMemory| bumps.blocked_cells(&grid, 0.35).count();
        for at in [[0.0, -1.0], [0.0, -2.0], [0.2, -1.0]] {
            bumps.record(at.into(), 0, 1000);
        }
        assert_eq!(n_barred(&bumps), 0, "bumps at different positions");
        bumps.record(Vec2::new(-0.2, -1.0), 0, 1000);
        assert!(n_barred(&bumps) > 10);
        assert!(bumps.recent_cells(&grid).count() > 4, "the bump elsewhere is remembered");
        assert!(bumps.expire(BUMP_FRAMES) && !bumps.expire(999));
        assert!(n_barred(&bumps) > 10);
        assert!(bumps.expire(1000));
        assert_eq!(n_barred(&bumps), 0);
    }

    #[test]
    fn barriers_can_be_cleared() {
        let grid = Grid::new(&Rect::new([-3.0, -3.0], [3.0, 3.0]));
        let mut bumps = CollisionMemory::default();
        assert!(!bumps.clear_barriers());
        (0..BARRIER_BUMPS).for_each(|_| bumps.record(Vec2::ZERO, 0, 1000));
        assert!(bumps.clear_barriers());
        assert_eq!(bumps.blocked_cells(&grid, 0.35).count(), 0);
    }
}
