//! Paths over straight neighbors only (4-connected), as the original's library finds them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::mapping::grid::Grid;
use crate::planning::bucket_queue::BucketQueue;
use crate::planning::cost_map::{CostMap, FREE};
use crate::planning::path::Path;
use crate::planning::search_nodes::SearchNodes;

/// Queue entry. Entries of equal estimate compare as equal, so the heap decides which of many
/// equally short paths is found. The original's library uses the same kind of heap, so both find
/// the same paths on open floor.
#[derive(Clone, Copy, Debug)]
struct QueueEntry {
    estimate: u32,
    cell: u32,
}

impl PartialEq for QueueEntry {
    fn eq(&self, other: &QueueEntry) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for QueueEntry {}

impl PartialOrd for QueueEntry {
    fn partial_cmp(&self, other: &QueueEntry) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for QueueEntry {
    /// Orders by descending estimate, so that the max-heap returns the lowest estimate.
    fn cmp(&self, other: &QueueEntry) -> Ordering {
        other.estimate.cmp(&self.estimate)
    }
}

/// Search over straight neighbors. Keeps its working memory, and the latest path.
#[derive(Clone, Debug)]
pub struct StraightSearch {
    nodes: SearchNodes,
    queue: BinaryHeap<QueueEntry>,
    /// Latest path, keyed by cost version, start and end.
    latest: Option<((u32, usize, usize), Path)>,
}

impl StraightSearch {
    /// Creates working memory for maps of this many cells.
    pub fn new(n_cells: usize) -> StraightSearch {
        StraightSearch { nodes: SearchNodes::new(n_cells), queue: BinaryHeap::new(), latest: None }
    }

    /// Returns the cheapest 4-connected path from `start` to `end`, at any cost. Of several
    /// cheapest paths it is the one of pyastar2d, the original's library (facts A1.5).
    ///
    /// The latest path is cached until the costs change, so one search is for one cost map.
    pub fn path(&mut self, costs: &CostMap, start: usize, end: usize) -> Option<Path> {
        let key = (costs.version(), start, end);
        if let Some((latest, path)) = &self.latest
            && *latest == key
        {
            return Some(path.clone());
        }
        let path = self.find_path(costs.grid(), costs.costs(), start, end)?;
        self.latest = Some((key, path.clone()));
        Some(path)
    }

    fn find_path(&mut self, grid: &Grid, costs: &[u32], start: usize, end: usize) -> Option<Path> {
        let (nx, nz) = (grid.nx(), grid.nz());
        let (end_i, end_j) = grid.column_row(end);
        let heuristic = |i: usize, j: usize| (i.abs_diff(end_i) + j.abs_diff(end_j)) as u32 * FREE;
        self.nodes.start(start);
        self.queue.clear();
        self.queue.push(QueueEntry { estimate: 0, cell: start as u32 });
        while let Some(QueueEntry { estimate, cell }) = self.queue.pop() {
            let cell = cell as usize;
            let cost = self.nodes.cost(cell);
            if cell == end {
                return Some(Path { cells: self.nodes.path(start, end), cost });
            }
            let (i, j) = grid.column_row(cell);
            if estimate > cost.saturating_add(heuristic(i, j)) {
                continue;
            }
            // In the library's order: its rows are along x.
            let around = [(i.wrapping_sub(1), j), (i, j.wrapping_sub(1)), (i, j + 1), (i + 1, j)];
            for (i, j) in around.into_iter().filter(|&(i, j)| i < nx && j < nz) {
                let next = j * nx + i;
                let total = cost.saturating_add(costs[next]);
                if self.nodes.improve(next, cell, total) {
                    let estimate = total.saturating_add(heuristic(i, j));
                    self.queue.push(QueueEntry { estimate, cell: next as u32 });
                }
            }
        }
        None
    }
}

/// Path cost and number of steps to every cell over straight neighbors, with the costs of
/// [`StraightSearch::path`].
#[derive(Clone, Debug)]
pub struct StraightCostField {
    cost_and_steps: Vec<Option<(u32, u32)>>,
}

impl StraightCostField {
    /// Searches all cells with a path cost of at most `limit`.
    pub fn new(grid: &Grid, costs: &[u32], start: usize, limit: u32) -> StraightCostField {
        let mut cost_and_steps: Vec<Option<(u32, u32)>> = vec![None; grid.n_cells()];
        let mut nodes = SearchNodes::new(grid.n_cells());
        let mut queue = BucketQueue::new(grid.n_cells());
        nodes.start(start);
        queue.push(0, start as u32);
        while let Some((cost, cell)) = queue.pop() {
            let cell = cell as usize;
            if cost > nodes.cost(cell) || cost > limit || cost_and_steps[cell].is_some() {
                continue;
            }
            let before = cost_and_steps[nodes.previous(cell)].map_or(0, |(_, steps)| steps);
            cost_and_steps[cell] = Some((cost, before + u32::from(cell != start)));
            let (i, j) = grid.column_row(cell);
            grid.for_straight_neighbors(i, j, |next, _, _| {
                let total = cost.saturating_add(costs[next]);
                if nodes.improve(next, cell, total) {
                    queue.push(total, next as u32);
                }
            });
        }
        StraightCostField { cost_and_steps }
    }

    /// Returns the path cost plus [`FREE`] times twice the number of steps; `None` beyond the
    /// limit.
    pub fn score(&self, cell: usize) -> Option<u32> {
        self.cost_and_steps[cell].map(|(cost, steps)| cost + 2 * FREE * steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Formats the steps of a path, `i` along x and `j` along z.
    fn steps(nx: usize, path: &Path) -> String {
        let step = |from: usize, to: usize| match to as isize - from as isize {
            1 => "i+",
            -1 => "i-",
            d if d == nx as isize => "j+",
            _ => "j-",
        };
        path.cells.windows(2).map(|w| step(w[0], w[1])).collect()
    }

    #[test]
    fn of_many_shortest_paths_the_one_of_pyastar2d_is_found() {
        // pyastar2d 1.1.4: astar_path(ones((30, 30), float32), start, end, allow_diagonal=False).
        let n = 30;
        let grid = Grid::with_size(n, n);
        let costs = vec![FREE; grid.n_cells()];
        let mut search = StraightSearch::new(grid.n_cells());
        for (start, end, expected) in [
            ((5, 5), (15, 15), "j+i+j+i+i+i+i+i+j+j+i+i+i+j+j+j+j+i+j+j+"),
            ((5, 5), (10, 20), "j+i+j+i+i+j+i+j+j+j+j+j+j+j+i+j+j+j+j+j+"),
            ((20, 20), (5, 12), "i-i-i-j-i-i-j-i-i-i-j-j-j-j-j-i-i-j-i-i-i-i-i-"),
            ((5, 20), (18, 6), "j-j-j-j-j-i+j-i+i+j-i+j-j-i+j-j-j-j-i+i+i+i+i+i+i+i+j-"),
        ] {
            let cell = |(i, j): (usize, usize)| j * n + i;
            let path = search.find_path(&grid, &costs, cell(start), cell(end)).expect("open");
            assert_eq!(steps(n, &path), expected, "{start:?} to {end:?}");
        }
    }
}
