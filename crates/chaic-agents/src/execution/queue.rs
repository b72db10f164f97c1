//! The queue of a search: cells by what a way through them costs at least.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Estimates that differ in so many low bits only are sorted by the small heap.
const NEAR_BITS: u32 = 4;

/// A queue of cells, least estimate first, of equal ones the cell with the least number first.
///
/// What comes up soon is in a small heap; the rest lies unsorted, by the highest bit in which its
/// estimate differs from the present one (a radix heap). Searches push hardly anything below the
/// present estimate; what they do goes into the small heap too, so that any order of pushes will
/// do.
#[derive(Clone, Debug)]
pub struct Queue {
    /// Estimate and cell in one number.
    near: BinaryHeap<Reverse<u64>>,
    /// In bucket `k` estimates differ from `level` in bit `k` and agree in all higher ones.
    far: [Vec<(u32, u32)>; 32],
    /// A bit for each bucket that holds something.
    filled: u32,
    level: u32,
}

impl Queue {
    /// An empty queue.
    pub fn new() -> Queue {
        Queue { near: BinaryHeap::new(), far: Default::default(), filled: 0, level: 0 }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.near.clear();
        self.far.iter_mut().for_each(Vec::clear);
        (self.filled, self.level) = (0, 0);
    }

    /// Adds a cell.
    #[inline]
    pub fn push(&mut self, estimate: u32, cell: u32) {
        let differs = (estimate ^ self.level) >> NEAR_BITS;
        if differs == 0 || estimate < self.level {
            self.near.push(Reverse(u64::from(estimate) << 32 | u64::from(cell)));
        } else {
            let bucket = NEAR_BITS + differs.ilog2();
            self.far[bucket as usize].push((estimate, cell));
            self.filled |= 1 << bucket;
        }
    }

    /// Takes out the first: its estimate and the cell.
    #[inline]
    pub fn pop(&mut self) -> Option<(u32, u32)> {
        if self.near.is_empty() {
            self.come_nearer();
        }
        self.near.pop().map(|Reverse(key)| ((key >> 32) as u32, key as u32))
    }

    /// Moves the present estimate on to the least there is.
    fn come_nearer(&mut self) {
        if self.filled == 0 {
            return;
        }
        let bucket = self.filled.trailing_zeros() as usize;
        self.filled &= self.filled - 1;
        let mut cells = std::mem::take(&mut self.far[bucket]);
        self.level = cells.iter().map(|(estimate, _)| *estimate).min().unwrap_or(self.level);
        for (estimate, cell) in cells.drain(..) {
            self.push(estimate, cell);
        }
        self.far[bucket] = cells;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_protocol::rng::Stream;

    #[test]
    fn cells_come_out_as_from_a_heap_whatever_the_order_of_pushes() {
        for seed in 0..40 {
            let mut rng = Stream::new(seed, "queue", 0);
            let (mut queue, mut heap) = (Queue::new(), BinaryHeap::new());
            let range = [12, 400, 5_000_000][seed as usize % 3];
            let mut last = 0u32;
            for _ in 0..2000 {
                if rng.chance(0.6) {
                    // Mostly later than what came last, now and then earlier.
                    let back = if rng.chance(0.1) { 15 } else { 0 };
                    let estimate = match rng.below(200) {
                        0 => u32::MAX,
                        _ => last.saturating_add(rng.below(range) as u32).saturating_sub(back),
                    };
                    let cell = rng.below(50) as u32;
                    queue.push(estimate, cell);
                    heap.push(Reverse((estimate, cell)));
                } else {
                    let expected = heap.pop().map(|Reverse(first)| first);
                    assert_eq!(queue.pop(), expected, "seed {seed}");
                    last = expected.map_or(last, |(estimate, _)| estimate.min(u32::MAX / 2));
                }
            }
            queue.clear();
            assert_eq!(queue.pop(), None);
        }
    }
}
