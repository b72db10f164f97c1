//! Shortest paths on the grid: A* to a goal, and Dijkstra cost fields.

use std::cell::RefCell;
use std::ops::Range;

use chaic_core::Vec2;

use super::bucket_queue::BucketQueue;
use super::cost_map::{CostMap, FREE, OCCUPIED};
use super::search_nodes::SearchNodes;
use crate::mapping::grid::{CELL_M, Grid};

/// Cost factor of a straight step; with it the factor of a diagonal step is a whole number.
const STRAIGHT: u32 = 10;
const DIAGONAL: u32 = 14;
/// Cost of one meter of free floor.
const COST_PER_M: f32 = (FREE * STRAIGHT) as f32 / CELL_M;
/// Minimum cost of one meter of straight-line distance: a diagonal step costs 14 instead of 14.14
/// tenths of a straight one.
const MIN_COST_PER_M: f32 =
    COST_PER_M * DIAGONAL as f32 / (STRAIGHT as f32 * std::f32::consts::SQRT_2);
/// Range of costs per bucket in a Dijkstra search: at most the cost of the cheapest step.
const BUCKET_WIDTH: usize = 64;
const _: () = assert!(BUCKET_WIDTH <= (FREE * STRAIGHT) as usize);

/// Working memory of searches, kept so that a search allocates nothing.
#[derive(Clone, Debug)]
pub struct Search {
    nodes: SearchNodes,
    queue: BucketQueue,
    dijkstra: DijkstraSearch,
}

/// Path of adjacent cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The cells, including start and end.
    pub cells: Vec<usize>,
    /// Path cost; see [`CostField::meters`].
    pub cost: u32,
}

/// Goal of an A* search.
pub trait SearchGoal {
    /// Returns whether the cell is a goal.
    fn is_goal(&self, cell: usize) -> bool;

    /// Lower bound of the remaining distance from this cell, meters.
    fn min_distance_m(&self, cell: usize) -> f32;
}

/// Visits the neighbors that can be entered from a cell without cutting an occupied corner, with
/// each cell's cost and the step's factor.
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

/// Returns the cost of a step into `cell`; `None` if it cuts an occupied corner.
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
    /// Creates working memory for maps of this many cells.
    pub fn new(n_cells: usize) -> Search {
        Search {
            nodes: SearchNodes::new(n_cells),
            queue: BucketQueue::new(n_cells),
            dijkstra: DijkstraSearch::default(),
        }
    }

    /// Returns a cheapest 8-connected path from `start` to any goal cell, if it costs at most
    /// `limit`. No cell is impassable, but occupied cells and walls cost more than any detour. No
    /// cell may cost less than [`FREE`].
    pub fn a_star(
        &mut self,
        grid: &Grid,
        costs: &[u32],
        start: usize,
        goal: &impl SearchGoal,
        limit: u32,
    ) -> Option<Path> {
        self.nodes.start(start);
        self.queue.clear();
        self.queue.push(0, start as u32);
        // Admissible, so that the first goal cell has the minimum cost.
        let heuristic = |cell: usize| (goal.min_distance_m(cell).max(0.0) * MIN_COST_PER_M) as u32;
        while let Some((estimate, cell)) = self.queue.pop() {
            let cell = cell as usize;
            let cost = self.nodes.cost(cell);
            if cost > limit {
                return None;
            }
            if estimate > cost.saturating_add(heuristic(cell)) {
                continue;
            }
            if goal.is_goal(cell) {
                return Some(Path { cells: self.nodes.path(start, cell), cost });
            }
            for_steps(costs, grid, cell, |next, enter, factor| {
                let step = enter.saturating_mul(factor);
                let total = cost.saturating_add(step);
                if self.nodes.improve(next, cell, total) {
                    self.queue.push(total.saturating_add(heuristic(next)), next as u32);
                }
            });
        }
        None
    }
}

/// Dial's variant of Dijkstra's algorithm from one position over all cells that are not occupied. It
/// can pause after each bucket. It is bound to the costs of the map with which it started.
#[derive(Clone, Debug, Default)]
pub struct DijkstraSearch {
    /// Position from which the first query starts a search.
    pending: Option<Vec2>,
    /// Lowest cost found so far; `u32::MAX` if none.
    cost: Vec<u32>,
    /// Range outside which all of `cost` is `u32::MAX`.
    touched: Range<usize>,
    /// Ring of cells with their path cost, bucketed by that cost. Its length is a power of two.
    buckets: Vec<Vec<(u32, u32)>>,
    n_queued: usize,
    /// Number of expanded buckets; all costs below `n_expanded * BUCKET_WIDTH` are final.
    n_expanded: usize,
}

impl DijkstraSearch {
    /// Starts a search with the first query of [`PathCosts`]; many searches are never queried.
    /// Costs must not change between this call and the queries.
    pub fn start_on_query(&mut self, here: Vec2) {
        self.pending = Some(here);
    }

    /// Starts the search that waits for a query.
    fn start_pending(&mut self, costs: &CostMap) {
        if let Some(here) = self.pending {
            self.start(costs, here);
        }
    }

    /// Starts a search; a position outside the grid reaches no cell.
    fn start(&mut self, costs: &CostMap, here: Vec2) {
        self.pending = None;
        let n_cells = costs.grid().n_cells();
        if self.cost.len() == n_cells {
            self.cost[self.touched.clone()].fill(u32::MAX);
        } else {
            self.cost.clear();
            self.cost.resize(n_cells, u32::MAX);
        }
        self.touched = 0..0;
        self.buckets.iter_mut().for_each(Vec::clear);
        (self.n_queued, self.n_expanded) = (0, 0);
        let open = |cost: u32| if cost < OCCUPIED { cost } else { FREE };
        let most = costs.costs().iter().fold(FREE, |most, cost| most.max(open(*cost)));
        // The most expensive step never wraps around.
        let n_buckets = (most * DIAGONAL) as usize / BUCKET_WIDTH + 2;
        let n_buckets = n_buckets.next_power_of_two().max(self.buckets.len());
        self.buckets.resize_with(n_buckets, Vec::new);
        if let Some(start) = costs.grid().cell_at(here) {
            self.cost[start] = 0;
            self.touched = start..start + 1;
            self.buckets[0].push((0, start as u32));
            self.n_queued = 1;
        }
    }

    /// Expands the cells of the next bucket.
    fn expand_bucket(&mut self, costs: &CostMap) {
        let DijkstraSearch { cost, touched, buckets, n_queued, n_expanded, .. } = self;
        let mask = buckets.len() - 1;
        let bucket = *n_expanded & mask;
        // Cells of one bucket cannot improve each other: no step costs less than its width.
        let mut cells = std::mem::take(&mut buckets[bucket]);
        *n_queued -= cells.len();
        let (mut first, mut last) = (usize::MAX, 0);
        for (cost_so_far, cell) in cells.drain(..) {
            let cell = cell as usize;
            if cost_so_far > cost[cell] {
                continue;
            }
            (first, last) = (first.min(cell), last.max(cell));
            for_steps(costs.costs(), costs.grid(), cell, |next, enter, factor| {
                let total = cost_so_far.saturating_add(enter.saturating_mul(factor));
                if enter < OCCUPIED && total < cost[next] {
                    cost[next] = total;
                    buckets[(total as usize / BUCKET_WIDTH) & mask].push((total, next as u32));
                    *n_queued += 1;
                }
            });
        }
        if first <= last {
            // Neighbors are one row and one cell away at most.
            let margin = costs.grid().nx() + 1;
            touched.start = touched.start.min(first.saturating_sub(margin));
            touched.end = touched.end.max((last + margin + 1).min(cost.len()));
        }
        // Put the bucket back to reuse its allocation.
        buckets[bucket] = cells;
        *n_expanded += 1;
    }

    /// Expands until the cost that `lowest` returns from the costs of all cells is final. Returns
    /// this cost, or `None` if it stays infinite.
    fn expand_until_final(
        &mut self,
        costs: &CostMap,
        lowest: impl Fn(&[u32]) -> u32,
    ) -> Option<u32> {
        /// Number of buckets that are expanded between two checks of an infinite cost.
        const STRIDE: usize = 8;
        loop {
            let cost = lowest(&self.cost);
            let n_until_final = match cost {
                u32::MAX => self.n_expanded + STRIDE,
                cost => cost as usize / BUCKET_WIDTH + 1,
            };
            if self.n_queued == 0 || n_until_final <= self.n_expanded {
                return Some(cost).filter(|cost| *cost < u32::MAX);
            }
            while self.n_queued > 0 && self.n_expanded < n_until_final {
                self.expand_bucket(costs);
            }
        }
    }

    /// Expands until all costs below `limit` are final.
    fn expand_below(&mut self, costs: &CostMap, limit: u32) {
        while self.n_queued > 0 && self.n_expanded * BUCKET_WIDTH < limit as usize {
            self.expand_bucket(costs);
        }
    }

    /// Returns whether a search may reach the cell: it is not occupied, or it is the start.
    fn is_open(&self, costs: &CostMap, cell: usize) -> bool {
        !costs.is_blocked(cell) || self.cost[cell] == 0
    }
}

/// Path costs from one position without passing occupied cells. The search runs only as far as the
/// queries require.
#[derive(Clone, Copy, Debug)]
pub struct PathCosts<'a> {
    /// Costs with which `dijkstra` started.
    pub costs: &'a CostMap,
    /// Search from the position.
    pub dijkstra: &'a RefCell<DijkstraSearch>,
}

impl PathCosts<'_> {
    /// Returns the path cost to a cell, if it is reachable.
    pub fn cost(&self, cell: usize) -> Option<u32> {
        let mut dijkstra = self.dijkstra.borrow_mut();
        dijkstra.start_pending(self.costs);
        if !dijkstra.is_open(self.costs, cell) {
            return None;
        }
        dijkstra.expand_until_final(self.costs, |cost| cost[cell])
    }

    /// Returns the path cost to a cell, if it is less than `limit`. The search ends there.
    pub fn cost_below(&self, cell: usize, limit: u32) -> Option<u32> {
        let mut dijkstra = self.dijkstra.borrow_mut();
        dijkstra.start_pending(self.costs);
        dijkstra.expand_below(self.costs, limit);
        Some(dijkstra.cost[cell]).filter(|cost| *cost < limit)
    }

    /// Returns the lowest path cost to any of these cells, if one is reachable.
    pub fn min_cost(&self, cells: impl Iterator<Item = usize>) -> Option<u32> {
        let mut dijkstra = self.dijkstra.borrow_mut();
        dijkstra.start_pending(self.costs);
        let open: Vec<usize> = cells.filter(|cell| dijkstra.is_open(self.costs, *cell)).collect();
        if open.is_empty() {
            return None;
        }
        dijkstra.expand_until_final(self.costs, |cost| {
            open.iter().map(|cell| cost[*cell]).min().unwrap_or(u32::MAX)
        })
    }
}

/// Path cost from one position to every cell without passing occupied ones.
#[derive(Clone, Debug)]
pub struct CostField {
    cost: Vec<u32>,
    /// Costs below this are final; `u32::MAX` after a search of the whole map.
    final_below: u32,
}

impl CostField {
    /// Searches from `here` over the whole map.
    #[cfg(test)]
    pub fn new(costs: &CostMap, here: Vec2, search: &mut Search) -> CostField {
        CostField::until_final(costs, here, search, &[usize::MAX])
    }

    /// Searches from `here` until the costs of these cells are final, over the whole map if one of
    /// them is unreachable.
    pub fn until_final(
        costs: &CostMap,
        here: Vec2,
        search: &mut Search,
        cells: &[usize],
    ) -> CostField {
        let dijkstra = &mut search.dijkstra;
        dijkstra.start(costs, here);
        let cost_of = |dijkstra: &DijkstraSearch, cell: &usize| {
            dijkstra.cost.get(*cell).copied().unwrap_or(u32::MAX)
        };
        let mut waiting: Vec<usize> = cells.to_vec();
        while dijkstra.n_queued > 0 && !waiting.is_empty() {
            dijkstra.expand_bucket(costs);
            let final_below = (dijkstra.n_expanded * BUCKET_WIDTH) as u32;
            while waiting.last().is_some_and(|cell| cost_of(dijkstra, cell) < final_below) {
                waiting.pop();
            }
        }
        let is_complete = dijkstra.n_queued == 0;
        let final_below =
            if is_complete { u32::MAX } else { (dijkstra.n_expanded * BUCKET_WIDTH) as u32 };
        CostField { cost: dijkstra.cost.clone(), final_below }
    }

    /// Returns the path cost to a cell, if it is reachable and final.
    pub fn cost(&self, cell: usize) -> Option<u32> {
        self.cost.get(cell).copied().filter(|c| *c < self.final_below)
    }

    /// Returns whether [`CostField::cost`] equals that of a search of the whole map for this cell.
    pub fn is_final(&self, cell: usize) -> bool {
        self.final_below == u32::MAX || self.cost(cell).is_some()
    }

    /// Converts a cost to the length of free floor with the same cost, meters.
    pub fn meters(cost: u32) -> f32 {
        cost as f32 / COST_PER_M
    }
}

/// Goal that is a single cell.
#[derive(Clone, Copy, Debug)]
pub struct CellGoal {
    /// Grid of the map.
    pub grid: Grid,
    /// The goal cell.
    pub cell: usize,
}

impl SearchGoal for CellGoal {
    fn is_goal(&self, cell: usize) -> bool {
        cell == self.cell
    }

    fn min_distance_m(&self, cell: usize) -> f32 {
        self.grid.center(cell).distance(self.grid.center(self.cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::geom::Rect;
    use chaic_core::rng::RngStream;

    /// Solves the same problem with the `pathfinding` crate.
    fn reference_cost(grid: &Grid, costs: &[u32], start: usize, end: usize) -> u32 {
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
    fn a_star_finds_paths_of_minimum_cost_on_random_maps() {
        let grid = Grid::new(&Rect::new([0.0, 0.0], [2.0, 1.0]));
        let n = grid.n_cells();
        let mut search = Search::new(n);
        for seed in 0..60 {
            let mut rng = RngStream::new(seed, "a star", 0);
            let costs: Vec<u32> = (0..n)
                .map(|_| match rng.below(10) {
                    0..5 => FREE,
                    5..7 => 35,
                    7 => 610,
                    _ => OCCUPIED,
                })
                .collect();
            let (start, end) = (rng.below(n), rng.below(n));
            let expected = reference_cost(&grid, &costs, start, end);
            match search.a_star(&grid, &costs, start, &CellGoal { grid, cell: end }, u32::MAX) {
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
    fn a_star_finds_paths_of_minimum_cost_in_open_space() {
        let grid = Grid::with_size(44, 44);
        let n = grid.n_cells();
        let mut search = Search::new(n);
        for seed in 0..60 {
            let mut rng = RngStream::new(seed, "open space", 0);
            let costs: Vec<u32> = (0..n).map(|_| FREE + rng.below(3) as u32 / 2).collect();
            let (start, end) = (rng.below(n), rng.below(n));
            let expected = reference_cost(&grid, &costs, start, end);
            let path = search.a_star(&grid, &costs, start, &CellGoal { grid, cell: end }, u32::MAX);
            assert_eq!(path.map(|p| p.cost), Some(expected), "seed {seed}");
        }
    }

    #[test]
    fn a_star_prefers_the_cheaper_of_two_diagonal_corridors() {
        // Both lead 39 cells diagonally. The corridor that begins with two straight steps is
        // cheaper, and the estimate after them is that of a pure diagonal.
        let grid = Grid::with_size(42, 40);
        let cell = |i: usize, j: usize| j * grid.nx() + i;
        let mut costs = vec![OCCUPIED - 1; grid.n_cells()];
        for k in 0..40 {
            (costs[cell(k, k)], costs[cell(k + 2, k)]) = (FREE, FREE);
        }
        (costs[cell(1, 0)], costs[cell(40, 39)]) = (FREE, FREE);
        costs[cell(20, 20)] = FREE + 2;
        let end = cell(41, 39);
        let goal = CellGoal { grid, cell: end };
        let path = Search::new(grid.n_cells()).a_star(&grid, &costs, 0, &goal, u32::MAX);
        let expected = FREE * (2 * STRAIGHT + 39 * DIAGONAL);
        assert_eq!(path.map(|p| p.cost), Some(expected));
        assert_eq!(reference_cost(&grid, &costs, 0, end), expected);
    }

    #[test]
    fn the_cost_field_agrees_with_a_star_and_stops_at_walls() {
        let plan = crate::test_support::DrawnMap::parse(
            "..........#.....
             ..........#.....
             ....#.....#.....
             ....#.....#.....
             ....#.....#.....",
        );
        let costs = plan.costs(0.05);
        let grid = *costs.grid();
        let mut search = Search::new(grid.n_cells());
        let field = CostField::new(&costs, grid.center(64), &mut search);
        let to = 64 + 9;
        let path = search
            .a_star(&grid, costs.costs(), 64, &CellGoal { grid, cell: to }, u32::MAX)
            .unwrap();
        assert_eq!(field.cost(to), Some(path.cost));
        assert_eq!(field.cost(64 + 15), None);
    }

    #[test]
    fn costs_on_demand_equal_those_of_the_whole_field() {
        for seed in 0..40 {
            let mut rng = RngStream::new(seed, "costs on demand", 0);
            let text: String = (0..24 * 16)
                .map(|k| {
                    let symbol = [".", ".", ".", "?", "#"][rng.below(5)];
                    if k % 24 == 23 { format!("{symbol}\n") } else { symbol.to_owned() }
                })
                .collect();
            let costs = crate::test_support::DrawnMap::parse(&text).costs(0.05);
            let (grid, n) = (*costs.grid(), costs.grid().n_cells());
            let here = grid.center(rng.below(n));
            let whole = CostField::new(&costs, here, &mut Search::new(n));
            let dijkstra = RefCell::new(DijkstraSearch::default());
            // A search may be started again, partly expanded or not, with other costs and sizes.
            for size in [[5, 9], [16, 24], [24, 16], [24, 16]] {
                let other = CostMap::new(Grid::with_size(size[0], size[1]), 0.2);
                let n_other = other.grid().n_cells();
                let from = other.grid().center(rng.below(n_other));
                dijkstra.borrow_mut().start_on_query(from);
                let before = PathCosts { costs: &other, dijkstra: &dijkstra };
                if rng.chance(0.7) {
                    assert!(before.cost(rng.below(n_other)).is_some());
                }
            }
            dijkstra.borrow_mut().start_on_query(here);
            let on_demand = PathCosts { costs: &costs, dijkstra: &dijkstra };
            for _ in 0..30 {
                let cells: Vec<usize> = (0..rng.below(6)).map(|_| rng.below(n)).collect();
                let expected = cells.iter().filter_map(|cell| whole.cost(*cell)).min();
                assert_eq!(on_demand.min_cost(cells.into_iter()), expected, "{seed}");
                let (cell, limit) = (rng.below(n), rng.below(8000) as u32);
                let expected = whole.cost(cell).filter(|cost| *cost < limit);
                assert_eq!(on_demand.cost_below(cell, limit), expected, "{seed}");
            }
            assert!((0..n).all(|cell| on_demand.cost(cell) == whole.cost(cell)), "{seed}");
        }
    }
}
