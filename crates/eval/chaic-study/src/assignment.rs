//! Assignment of slots to orders of conditions: a pure function of the study's digest and the slot.

use chaic_core::rng::RngStream;

use crate::study::Design;

/// Orders of a design, and their assignment to slots.
///
/// Slots are numbered from 1. Each block of consecutive slots has every order once, in a random
/// permutation, so that any number of complete blocks is balanced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    seed: u64,
    /// Conditions of each order.
    orders: Vec<Vec<usize>>,
}

impl Assignment {
    /// Creates the assignment of `n_conditions` (at least 1) for a study with this seed.
    pub fn new(design: Design, n_conditions: usize, seed: u64) -> Assignment {
        let orders = match design {
            Design::LatinSquare => latin_square(n_conditions),
            Design::BlockRandom => (0..n_conditions).map(|condition| vec![condition]).collect(),
        };
        // The square favors no condition, but its first row is fixed; labels are drawn.
        let labels = permutation(n_conditions, seed, "study_conditions", 0);
        let relabel = |order: Vec<usize>| order.into_iter().map(|label| labels[label]).collect();
        Assignment { seed, orders: orders.into_iter().map(relabel).collect() }
    }

    /// Returns all orders of conditions.
    pub fn orders(&self) -> &[Vec<usize>] {
        &self.orders
    }

    /// Returns the number of the block of a slot, from 0.
    pub fn block(&self, slot: u32) -> usize {
        (slot.saturating_sub(1)) as usize / self.orders.len()
    }

    /// Returns the conditions of a slot in their order.
    pub fn order(&self, slot: u32) -> &[usize] {
        let block = self.block(slot);
        let rows = permutation(self.orders.len(), self.seed, "study_orders", block as u64);
        &self.orders[rows[slot.saturating_sub(1) as usize % rows.len()]]
    }
}

/// Draws a permutation of 0..`n`.
fn permutation(n: usize, seed: u64, purpose: &str, index: u64) -> Vec<usize> {
    let mut permutation: Vec<usize> = (0..n).collect();
    RngStream::new(seed, purpose, index).shuffle(&mut permutation);
    permutation
}

/// Returns a balanced Latin square (Williams, 1949): each condition is in each position equally often, and
/// follows each other condition equally often. An even number of conditions needs as many orders, an odd
/// number twice as many.
fn latin_square(n: usize) -> Vec<Vec<usize>> {
    // 0, 1, n - 1, 2, n - 2, ...: neighbors have all differences.
    let first = (0..n).map(|k| if k % 2 == 1 { k.div_ceil(2) } else { (n - k / 2) % n });
    let first: Vec<usize> = first.collect();
    let row = |shift: usize| first.iter().map(|c| (c + shift) % n).collect::<Vec<usize>>();
    let square: Vec<Vec<usize>> = (0..n).map(row).collect();
    if n.is_multiple_of(2) || n == 1 {
        return square;
    }
    let mirrored = square.iter().map(|row| row.iter().rev().copied().collect());
    square.iter().cloned().chain(mirrored).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latin_squares_balance_positions_and_neighbors() {
        for n in 1..=16 {
            let square = latin_square(n);
            let n_rows = if n.is_multiple_of(2) || n == 1 { n } else { 2 * n };
            assert_eq!(square.len(), n_rows);
            let mut positions = vec![vec![0; n]; n];
            let mut neighbors = vec![vec![0; n]; n];
            for row in &square {
                for (position, condition) in row.iter().enumerate() {
                    positions[position][*condition] += 1;
                }
                for pair in row.windows(2) {
                    neighbors[pair[0]][pair[1]] += 1;
                }
            }
            let share = n_rows / n;
            assert!(positions.iter().flatten().all(|count| *count == share), "{n}: {positions:?}");
            for (a, row) in neighbors.iter().enumerate() {
                let is_balanced =
                    |(b, count): (usize, &usize)| *count == share * usize::from(a != b);
                assert!(row.iter().enumerate().all(is_balanced), "{n}: {neighbors:?}");
            }
        }
    }

    #[test]
    fn the_order_of_each_pair_is_balanced_in_squares_of_even_size() {
        for n in [2, 4, 6, 16] {
            let square = latin_square(n);
            for a in 0..n {
                for b in 0..a {
                    let place = |row: &[usize], c| row.iter().position(|x| *x == c);
                    let n_before =
                        square.iter().filter(|row| place(row, a) < place(row, b)).count();
                    assert_eq!(2 * n_before, square.len(), "{a} before {b} of {n}");
                }
            }
        }
    }

    #[test]
    fn blocks_have_every_order_once_and_equal_digests_give_equal_orders() {
        for (design, n) in
            [(Design::LatinSquare, 4), (Design::LatinSquare, 3), (Design::BlockRandom, 5)]
        {
            let assignment = Assignment::new(design, n, 7);
            let n_orders = assignment.orders().len();
            for block in 0..50 {
                let slots = (0..n_orders as u32).map(|k| block * n_orders as u32 + k + 1);
                let mut orders: Vec<&[usize]> = slots.map(|slot| assignment.order(slot)).collect();
                orders.sort_unstable();
                orders.dedup();
                assert_eq!(orders.len(), n_orders);
            }
            let all = |seed| {
                let assignment = Assignment::new(design, n, seed);
                (1..=100).map(|slot| assignment.order(slot).to_vec()).collect::<Vec<_>>()
            };
            assert_eq!(all(7), all(7));
            assert_ne!(all(7), all(8));
        }
    }
}
