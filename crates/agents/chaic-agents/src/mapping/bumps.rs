//! Where one could not get on although the map said so.

use chaic_core::{Frame, Vec2};

use super::grid::Grid;

/// How long a bump is remembered, frames.
const BUMP_FRAMES: Frame = 300;
/// Radius of the place around a bump that is avoided, metres.
const BUMP_RADIUS_M: f32 = 0.2;
/// So many bumps within this of the latest are a barrier, metres.
const BARRIER_BUMPS: usize = 3;
const BARRIER_M: f32 = 0.6;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bump {
    at: Vec2,
    until: Frame,
}

/// Bumps of late, and the places that are taken for barriers: something is there that isn't seen, or
/// that leaves too little room.
#[derive(Clone, Debug, Default)]
pub struct Bumps {
    lately: Vec<Bump>,
    barriers: Vec<Bump>,
}

impl Bumps {
    /// Remembers one at `at` (x, z). Where that happens again and again, there is a barrier for
    /// `barred_frames`.
    pub fn note(&mut self, at: Vec2, now: Frame, barred_frames: Frame) {
        self.lately.push(Bump { at, until: now + BUMP_FRAMES });
        let is_here = |bump: &Bump| bump.at.distance(at) < BARRIER_M;
        if self.lately.iter().filter(|b| is_here(b)).count() >= BARRIER_BUMPS {
            let here = self.lately.extract_if(.., |b| is_here(b));
            self.barriers.extend(here.map(|b| Bump { until: now + barred_frames, ..b }));
        }
    }

    /// Forgets what is over by now; tells whether anything was.
    pub fn expire(&mut self, now: Frame) -> bool {
        let n = self.lately.len() + self.barriers.len();
        self.lately.retain(|b| b.until > now);
        self.barriers.retain(|b| b.until > now);
        n != self.lately.len() + self.barriers.len()
    }

    /// Takes no place for a barrier any more; tells whether one was.
    pub fn forget_barriers(&mut self) -> bool {
        let were_there = !self.barriers.is_empty();
        self.barriers.clear();
        were_there
    }

    /// Cells to avoid because of bumps of late; one that was bumped into twice comes twice.
    pub fn cells(&self, grid: &Grid) -> impl Iterator<Item = usize> {
        self.lately.iter().flat_map(|b| grid.disc(b.at, BUMP_RADIUS_M))
    }

    /// Cells in the way of a body of this radius, metres, because of barriers.
    pub fn barred_cells(&self, grid: &Grid, radius_m: f32) -> impl Iterator<Item = usize> {
        self.barriers.iter().flat_map(move |b| grid.disc(b.at, radius_m))
    }
}

#[cfg(test)]
mod tests {
    use chaic_core::geom::Rect;

    use super::*;

    #[test]
    fn where_one_bumps_again_and_again_is_a_barrier_for_a_while() {
        let grid = Grid::over(&Rect::new([-3.0, -3.0], [3.0, 3.0]));
        let mut bumps = Bumps::default();
        let n_barred = |bumps: &Bumps| bumps.barred_cells(&grid, 0.35).count();
        for at in [[0.0, -1.0], [0.0, -2.0], [0.2, -1.0]] {
            bumps.note(at.into(), 0, 1000);
        }
        assert_eq!(n_barred(&bumps), 0, "bumps here and there");
        bumps.note(Vec2::new(-0.2, -1.0), 0, 1000);
        assert!(n_barred(&bumps) > 10);
        assert!(bumps.cells(&grid).count() > 4, "the one elsewhere is remembered");
        assert!(bumps.expire(BUMP_FRAMES) && !bumps.expire(999));
        assert!(n_barred(&bumps) > 10);
        assert!(bumps.expire(1000));
        assert_eq!(n_barred(&bumps), 0);
    }

    #[test]
    fn barriers_are_forgotten_at_once_if_need_be() {
        let grid = Grid::over(&Rect::new([-3.0, -3.0], [3.0, 3.0]));
        let mut bumps = Bumps::default();
        assert!(!bumps.forget_barriers());
        (0..BARRIER_BUMPS).for_each(|_| bumps.note(Vec2::ZERO, 0, 1000));
        assert!(bumps.forget_barriers());
        assert_eq!(bumps.barred_cells(&grid, 0.35).count(), 0);
    }
}
