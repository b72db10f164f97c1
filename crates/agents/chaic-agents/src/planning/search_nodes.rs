//! Search trees on the grid: the cheapest known path to each cell.

/// Search state of a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    /// Search that set this state; states of earlier searches are invalid.
    epoch: u32,
    /// Lowest path cost found.
    cost: u32,
    /// Previous cell on that path.
    from: u32,
}

/// Search states of all cells, kept so that a search allocates nothing.
#[derive(Clone, Debug)]
pub struct SearchNodes {
    nodes: Vec<Node>,
    epoch: u32,
}

impl SearchNodes {
    /// Creates the states of this many cells.
    pub fn new(n_cells: usize) -> SearchNodes {
        SearchNodes { nodes: vec![Node::default(); n_cells], epoch: 0 }
    }

    /// Starts a search from a cell.
    pub fn start(&mut self, cell: usize) {
        self.epoch += 1;
        self.improve(cell, cell, 0);
    }

    /// Updates a cell if this path to it is the cheapest so far; returns whether it is.
    #[inline]
    pub fn improve(&mut self, cell: usize, from: usize, cost: u32) -> bool {
        let node = &mut self.nodes[cell];
        let is_better = node.epoch != self.epoch || cost < node.cost;
        if is_better {
            *node = Node { epoch: self.epoch, cost, from: from as u32 };
        }
        is_better
    }

    /// Lowest path cost to a cell that this search has reached.
    #[inline]
    pub fn cost(&self, cell: usize) -> u32 {
        self.nodes[cell].cost
    }

    /// Previous cell on that path; the start is its own previous cell.
    #[inline]
    pub fn previous(&self, cell: usize) -> usize {
        self.nodes[cell].from as usize
    }

    /// Returns the cells of the path from `start` to `end`, including both.
    pub fn path(&self, start: usize, end: usize) -> Vec<usize> {
        let mut cells = vec![end];
        let mut cell = end;
        while cell != start {
            cell = self.previous(cell);
            cells.push(cell);
        }
        cells.reverse();
        cells
    }
}
