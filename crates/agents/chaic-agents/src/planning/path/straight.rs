//! Ways over straight neighbors only, as the original's library finds them.

use std::cmp::Ordering;

use super::{Node, Path, Search};
use crate::mapping::grid::Grid;
use crate::planning::costs::{CostMap, FREE};

/// A cell to visit. Of equal estimates neither comes first: the heap decides, and with it which of
/// many equally short ways is taken. The original's library does the same with a heap of the same
/// kind, so that its ways over open floor wander like these.
#[derive(Clone, Copy, Debug)]
pub(super) struct Visit {
    estimate: u32,
    cell: u32,
}

impl PartialEq for Visit {
    fn eq(&self, other: &Visit) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Visit {}

impl PartialOrd for Visit {
    fn partial_cmp(&self, other: &Visit) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Visit {
    /// The least estimate is the greatest visit.
    fn cmp(&self, other: &Visit) -> Ordering {
        other.estimate.cmp(&self.estimate)
    }
}

impl Search {
    /// The cheapest way from `start` to `end` over straight neighbors only, whatever it costs; of
    /// several the one that pyastar2d finds, the library of the original (facts A1.5).
    ///
    /// A mind has one map of costs, so the latest way is kept for as long as that stays the same.
    pub fn straight_way(&mut self, costs: &CostMap, start: usize, end: usize) -> Option<Path> {
        let asked = (costs.version(), start, end);
        if let Some((found, way)) = &self.latest
            && *found == asked
        {
            return Some(way.clone());
        }
        let way = self.find_straight_way(costs.grid(), costs.costs(), start, end)?;
        self.latest = Some((asked, way.clone()));
        Some(way)
    }

    fn find_straight_way(
        &mut self,
        grid: &Grid,
        costs: &[u32],
        start: usize,
        end: usize,
    ) -> Option<Path> {
        let (nx, nz) = (grid.nx(), grid.nz());
        let (end_i, end_j) = grid.column_row(end);
        let still = |i: usize, j: usize| (i.abs_diff(end_i) + j.abs_diff(end_j)) as u32 * FREE;
        self.begin(start);
        self.visits.clear();
        self.visits.push(Visit { estimate: 0, cell: start as u32 });
        while let Some(Visit { estimate, cell }) = self.visits.pop() {
            let cell = cell as usize;
            let cost = self.nodes[cell].best;
            if cell == end {
                return Some(Path { cells: self.trace(start, end), cost });
            }
            let (i, j) = grid.column_row(cell);
            if estimate > cost.saturating_add(still(i, j)) {
                continue;
            }
            // In the library's order: its rows are along x.
            let around = [(i.wrapping_sub(1), j), (i, j.wrapping_sub(1)), (i, j + 1), (i + 1, j)];
            for (i, j) in around.into_iter().filter(|&(i, j)| i < nx && j < nz) {
                let next = j * nx + i;
                let total = cost.saturating_add(costs[next]);
                let node = &mut self.nodes[next];
                if node.epoch != self.epoch || total < node.best {
                    *node = Node { epoch: self.epoch, best: total, from: cell as u32 };
                    let estimate = total.saturating_add(still(i, j));
                    self.visits.push(Visit { estimate, cell: next as u32 });
                }
            }
        }
        None
    }
}

/// How far every cell is over straight neighbors, by the same costs as [`Search::straight_way`].
#[derive(Clone, Debug)]
pub struct StraightCostField {
    cost_and_steps: Vec<Option<(u32, u32)>>,
}

impl StraightCostField {
    /// Everything that costs at most `limit` to get to.
    pub fn from(
        grid: &Grid,
        costs: &[u32],
        start: usize,
        limit: u32,
        search: &mut Search,
    ) -> StraightCostField {
        let mut cost_and_steps: Vec<Option<(u32, u32)>> = vec![None; grid.n_cells()];
        search.begin(start);
        while let Some((cost, cell)) = search.queue.pop() {
            let cell = cell as usize;
            if cost > search.nodes[cell].best || cost > limit || cost_and_steps[cell].is_some() {
                continue;
            }
            let before =
                cost_and_steps[search.nodes[cell].from as usize].map_or(0, |(_, steps)| steps);
            cost_and_steps[cell] = Some((cost, before + u32::from(cell != start)));
            let (i, j) = grid.column_row(cell);
            grid.for_straight_neighbors(i, j, |next, _, _| {
                search.improve(next, cell, cost.saturating_add(costs[next]), || 0);
            });
        }
        StraightCostField { cost_and_steps }
    }

    /// Twice the cells of the way and its cost, in costs of a free cell times [`FREE`]; `None` if
    /// it is too far.
    pub fn score(&self, cell: usize) -> Option<u32> {
        self.cost_and_steps[cell].map(|(cost, steps)| cost + 2 * FREE * steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The steps of a way, `i` along x and `j` along z.
    fn steps(nx: usize, way: &Path) -> String {
        let step = |from: usize, to: usize| match to as isize - from as isize {
            1 => "i+",
            -1 => "i-",
            d if d == nx as isize => "j+",
            _ => "j-",
        };
        way.cells.windows(2).map(|w| step(w[0], w[1])).collect()
    }

    #[test]
    fn of_many_shortest_ways_the_one_of_pyastar2d_is_found() {
        // pyastar2d 1.1.4: astar_path(ones((30, 30), float32), start, end, allow_diagonal=False).
        let n = 30;
        let grid = Grid::of_cells(n, n);
        let costs = vec![FREE; grid.n_cells()];
        let mut search = Search::new(grid.n_cells());
        for (start, end, expected) in [
            ((5, 5), (15, 15), "j+i+j+i+i+i+i+i+j+j+i+i+i+j+j+j+j+i+j+j+"),
            ((5, 5), (10, 20), "j+i+j+i+i+j+i+j+j+j+j+j+j+j+i+j+j+j+j+j+"),
            ((20, 20), (5, 12), "i-i-i-j-i-i-j-i-i-i-j-j-j-j-j-i-i-j-i-i-i-i-i-"),
            ((5, 20), (18, 6), "j-j-j-j-j-i+j-i+i+j-i+j-j-i+j-j-j-j-i+i+i+i+i+i+i+i+j-"),
        ] {
            let cell = |(i, j): (usize, usize)| j * n + i;
            let way =
                search.find_straight_way(&grid, &costs, cell(start), cell(end)).expect("open");
            assert_eq!(steps(n, &way), expected, "{start:?} to {end:?}");
        }
    }
}
