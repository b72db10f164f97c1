//! Ways through the map: A* to a goal, and the cost of getting anywhere.

mod straight;

use std::collections::BinaryHeap;

use chaic_core::Vec2;

use super::bucket_queue::BucketQueue;
use crate::mapping::grid::{CELL_M, Grid};
use crate::planning::costs::{CostMap, FREE, OCCUPIED};
pub use straight::StraightCostField;
use straight::Visit;

/// Costs are multiplied by this for a straight step, so that a diagonal one is a whole number.
const STRAIGHT: u32 = 10;
const DIAGONAL: u32 = 14;
/// Cost of a metre of free floor.
const COST_PER_M: f32 = (FREE * STRAIGHT) as f32 / CELL_M;
/// Costs that share a bucket in a search for all costs: as many as the least step costs at most.
const BUCKET_WIDTH: usize = 64;
/// Buckets used in turn: enough that the dearest step leads to no bucket of an earlier turn.
const N_BUCKETS: usize = (OCCUPIED * DIAGONAL) as usize / BUCKET_WIDTH + 2;
const _: () = assert!(BUCKET_WIDTH <= (FREE * STRAIGHT) as usize);

/// Working space of searches, kept so that a search allocates nothing.
#[derive(Clone, Debug)]
pub struct Search {
    nodes: Vec<Node>,
    epoch: u32,
    queue: BucketQueue,
    /// Cells with what a way to them costs, by that cost.
    buckets: Vec<Vec<(u32, u32)>>,
    /// The queue of straight ways.
    visits: BinaryHeap<Visit>,
    /// The latest straight way: version of the costs, start and end.
    latest: Option<((u32, usize, usize), Path)>,
}

/// What a search knows of a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    /// The search that knows it; what an earlier one knew counts no more.
    epoch: u32,
    /// Least cost of getting there that was found.
    best: u32,
    /// The cell before it on that way.
    from: u32,
}

/// A way from cell to cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The cells, start and end included.
    pub cells: Vec<usize>,
    /// Its cost; see [`CostField::metres`].
    pub cost: u32,
}

/// Where A* is to end.
pub trait Goal {
    /// Whether this cell will do.
    fn is_goal(&self, cell: usize) -> bool;

    /// A distance in metres that is certainly still to go from this cell.
    fn at_least_m(&self, cell: usize) -> f32;
}

/// Visits the neighbors that one can step to from a cell without cutting an occupied corner, with
/// the cost of each cell and what it is multiplied by.
#[inline(always)]
fn for_steps(costs: &[u32], grid: &Grid, from: usize, mut visit: impl FnMut(usize, u32, u32)) {
    let (i, j) = grid.column_row(from);
    let nx = grid.nx();
    if i == 0 || j == 0 || i + 1 == nx || j + 1 == grid.nz() {
        for (next, diagonal) in grid.neighbors(from) {
            if step_cost(costs, grid, from, next, diagonal).is_some() {
                visit(next, costs[next], if diagonal { DIAGONAL } else { STRAIGHT });
            }
        }
        return;
    }
    let (above, below) = (from - nx, from + nx);
    let [up, left, right, down] = [above, from - 1, from + 1, below].map(|c| costs[c]);
    visit(above, up, STRAIGHT);
    visit(from - 1, left, STRAIGHT);
    visit(from + 1, right, STRAIGHT);
    visit(below, down, STRAIGHT);
    for (beside, row) in [(up, above), (down, below)] {
        for (corner, next) in [(left, row - 1), (right, row + 1)] {
            if beside < OCCUPIED && corner < OCCUPIED {
                visit(next, costs[next], DIAGONAL);
            }
        }
    }
}

/// What a step into `cell` costs; `None` if it cuts an occupied corner.
fn step_cost(costs: &[u32], grid: &Grid, from: usize, cell: usize, diagonal: bool) -> Option<u32> {
    if !diagonal {
        return Some(costs[cell].saturating_mul(STRAIGHT));
    }
    let ((i0, j0), (i1, j1)) = (grid.column_row(from), grid.column_row(cell));
    let corners = [j0 * grid.nx() + i1, j1 * grid.nx() + i0];
    let cuts = corners.iter().any(|c| costs[*c] >= OCCUPIED);
    (!cuts).then(|| costs[cell].saturating_mul(DIAGONAL))
}

impl Search {
    /// Working space for maps of this many cells.
    pub fn new(n_cells: usize) -> Search {
        Search {
            nodes: vec![Node::default(); n_cells],
            epoch: 0,
            queue: BucketQueue::new(n_cells),
            buckets: Vec::new(),
            visits: BinaryHeap::new(),
            latest: None,
        }
    }

    fn begin(&mut self, start: usize) {
        self.epoch += 1;
        self.queue.clear();
        self.improve(start, start, 0, || 0);
    }

    /// Takes a way to a cell if it is the best so far.
    #[inline]
    fn improve(&mut self, cell: usize, from: usize, cost: u32, still: impl FnOnce() -> u32) {
        let node = &mut self.nodes[cell];
        if node.epoch != self.epoch || cost < node.best {
            *node = Node { epoch: self.epoch, best: cost, from: from as u32 };
            self.queue.push(cost.saturating_add(still()), cell as u32);
        }
    }

    /// The cheapest way from `start` to any goal cell, 8-connected, if it costs at most `limit`.
    /// Nothing is impassable, but occupied cells and walls cost more than any detour.
    pub fn a_star(
        &mut self,
        grid: &Grid,
        costs: &[u32],
        start: usize,
        goal: &impl Goal,
        limit: u32,
    ) -> Option<Path> {
        self.begin(start);
        // Rounded down, so that it never exceeds the true cost.
        let still = |cell: usize| (goal.at_least_m(cell).max(0.0) * COST_PER_M) as u32;
        while let Some((estimate, cell)) = self.queue.pop() {
            let cell = cell as usize;
            let cost = self.nodes[cell].best;
            if cost > limit {
                return None;
            }
            if estimate > cost.saturating_add(still(cell)) {
                continue;
            }
            if goal.is_goal(cell) {
                return Some(Path { cells: self.trace(start, cell), cost });
            }
            for_steps(costs, grid, cell, |next, enter, factor| {
                let step = enter.saturating_mul(factor);
                self.improve(next, cell, cost.saturating_add(step), || still(next));
            });
        }
        None
    }

    fn trace(&self, start: usize, end: usize) -> Vec<usize> {
        let mut cells = vec![end];
        let mut cell = end;
        while cell != start {
            cell = self.nodes[cell].from as usize;
            cells.push(cell);
        }
        cells.reverse();
        cells
    }
}

/// The cost of getting from one place to every cell without passing occupied ones.
#[derive(Clone, Debug)]
pub struct CostField {
    cost: Vec<u32>,
}

impl CostField {
    /// Dial's form of Dijkstra's algorithm from `here` over everything that is not occupied.
    pub fn from(costs: &CostMap, here: Vec2, search: &mut Search) -> CostField {
        let mut cost = vec![u32::MAX; costs.grid().n_cells()];
        let Some(start) = costs.grid().cell_at(here) else { return CostField { cost } };
        let buckets = &mut search.buckets;
        buckets.resize_with(N_BUCKETS, Vec::new);
        cost[start] = 0;
        buckets[0].push((0, start as u32));
        let mut n_queued = 1;
        for bucket in (0..N_BUCKETS).cycle() {
            if n_queued == 0 {
                break;
            }
            // Cells of one bucket can't improve each other: no step costs less than its width.
            let mut cells = std::mem::take(&mut buckets[bucket]);
            n_queued -= cells.len();
            for (known, cell) in cells.drain(..) {
                let cell = cell as usize;
                if known > cost[cell] {
                    continue;
                }
                for_steps(costs.costs(), costs.grid(), cell, |next, enter, factor| {
                    let through = known.saturating_add(enter.saturating_mul(factor));
                    if enter < OCCUPIED && through < cost[next] {
                        cost[next] = through;
                        buckets[through as usize / BUCKET_WIDTH % N_BUCKETS]
                            .push((through, next as u32));
                        n_queued += 1;
                    }
                });
            }
            // Back with it, so that its memory is used again.
            buckets[bucket] = cells;
        }
        CostField { cost }
    }

    /// The cost of getting to a cell, if one can.
    pub fn cost(&self, cell: usize) -> Option<u32> {
        self.cost.get(cell).copied().filter(|c| *c < u32::MAX)
    }

    /// The length of free floor that costs as much, metres.
    pub fn metres(cost: u32) -> f32 {
        cost as f32 / COST_PER_M
    }
}

/// A goal that is one cell.
#[derive(Clone, Copy, Debug)]
pub struct ToCell {
    /// The lattice.
    pub grid: Grid,
    /// The cell.
    pub cell: usize,
}

impl Goal for ToCell {
    fn is_goal(&self, cell: usize) -> bool {
        cell == self.cell
    }

    fn at_least_m(&self, cell: usize) -> f32 {
        self.grid.center(cell).distance(self.grid.center(self.cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::geom::Rect;
    use chaic_core::rng::Stream;

    /// The same problem for the `pathfinding` crate.
    fn oracle(grid: &Grid, costs: &[u32], start: usize, end: usize) -> u32 {
        pathfinding::prelude::dijkstra(
            &start,
            |cell| {
                let from = *cell;
                grid.neighbors(from)
                    .filter_map(|(n, d)| Some((n, step_cost(costs, grid, from, n, d)?)))
                    .collect::<Vec<_>>()
            },
            |cell| *cell == end,
        )
        .map_or(u32::MAX, |(_, cost)| cost)
    }

    #[test]
    fn a_star_is_as_good_as_the_oracle_on_random_maps() {
        let grid = Grid::over(&Rect::new([0.0, 0.0], [2.0, 1.0]));
        let n = grid.n_cells();
        let mut search = Search::new(n);
        for seed in 0..60 {
            let mut rng = Stream::new(seed, "a star", 0);
            let costs: Vec<u32> = (0..n)
                .map(|_| match rng.below(10) {
                    0..5 => FREE,
                    5..7 => 35,
                    7 => 610,
                    _ => OCCUPIED,
                })
                .collect();
            let (start, end) = (rng.below(n), rng.below(n));
            let expected = oracle(&grid, &costs, start, end);
            match search.a_star(&grid, &costs, start, &ToCell { grid, cell: end }, u32::MAX) {
                Some(path) => {
                    assert_eq!(path.cost, expected, "seed {seed}");
                    assert_eq!((path.cells[0], *path.cells.last().unwrap()), (start, end));
                    let walked: u32 = path
                        .cells
                        .windows(2)
                        .map(|w| {
                            let (_, d) = grid.neighbors(w[0]).find(|(c, _)| *c == w[1]).unwrap();
                            step_cost(&costs, &grid, w[0], w[1], d).unwrap()
                        })
                        .sum();
                    assert_eq!(walked, path.cost);
                }
                None => assert_eq!(expected, u32::MAX, "seed {seed}"),
            }
        }
    }

    #[test]
    fn reach_agrees_with_a_star_and_stops_at_walls() {
        let plan = crate::test_support::Plan2d::parse(
            "..........#.....
             ..........#.....
             ....#.....#.....
             ....#.....#.....
             ....#.....#.....",
        );
        let costs = plan.costs(0.05);
        let grid = *costs.grid();
        let mut search = Search::new(grid.n_cells());
        let field = CostField::from(&costs, grid.center(64), &mut search);
        let to = 64 + 9;
        let path =
            search.a_star(&grid, costs.costs(), 64, &ToCell { grid, cell: to }, u32::MAX).unwrap();
        assert_eq!(field.cost(to), Some(path.cost));
        assert_eq!(field.cost(64 + 15), None);
    }
}
