//! Priority queue of a grid search: cells ordered by estimated path cost.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Number of estimates, from the current one on, that have their own bucket. Most steps cost less.
const RING: usize = 1024;

/// Priority queue of cells: lowest estimate first, and of equal estimates the lowest cell index
/// first. A cell that is pushed twice with the same estimate may be popped once or twice.
///
/// Searches rarely push below the current estimate, or far above it. Cells of the current estimate
/// are bits of a set, cells of the next estimates are in unsorted buckets, and a heap holds all
/// others. Pushes in any order are correct.
#[derive(Clone, Debug)]
pub struct BucketQueue {
    level: u32,
    present: CellSet,
    /// Cells with estimate `e`, level < e < level + RING, in bucket `e % RING`.
    ring: Vec<Vec<u32>>,
    /// One bit per non-empty bucket.
    filled: [u64; RING / 64],
    /// Estimate (high 32 bits) and cell (low 32 bits) in one key.
    overflow: BinaryHeap<Reverse<u64>>,
}

impl BucketQueue {
    /// Creates an empty queue for cells with indices below `n_cells`.
    pub fn new(n_cells: usize) -> BucketQueue {
        BucketQueue {
            level: 0,
            present: CellSet::new(n_cells),
            ring: vec![Vec::new(); RING],
            filled: [0; RING / 64],
            overflow: BinaryHeap::new(),
        }
    }

    /// Removes all cells.
    pub fn clear(&mut self) {
        while self.present.pop().is_some() {}
        while let Some(next) = self.next_in_ring() {
            self.list(next).clear();
        }
        self.overflow.clear();
        self.level = 0;
    }

    /// Adds a cell.
    #[inline]
    pub fn push(&mut self, estimate: u32, cell: u32) {
        match estimate.checked_sub(self.level) {
            Some(0) => self.present.insert(cell),
            Some(ahead) if (ahead as usize) < RING => {
                let list = estimate as usize % RING;
                self.ring[list].push(cell);
                self.filled[list / 64] |= 1 << (list % 64);
            }
            _ => self.overflow.push(Reverse(u64::from(estimate) << 32 | u64::from(cell))),
        }
    }

    /// Removes and returns the first entry: its estimate and the cell.
    #[inline]
    pub fn pop(&mut self) -> Option<(u32, u32)> {
        let lowest_in_overflow = self.overflow.peek().map(|Reverse(key)| (key >> 32) as u32);
        if lowest_in_overflow.is_some_and(|estimate| estimate < self.level) {
            return self.overflow.pop().map(|Reverse(key)| ((key >> 32) as u32, key as u32));
        }
        let cell = match self.present.pop() {
            Some(cell) => cell,
            None => {
                self.advance(lowest_in_overflow)?;
                self.present.pop()?
            }
        };
        Some((self.level, cell))
    }

    /// Advances to the lowest estimate; `lowest_in_overflow` is that of the heap.
    fn advance(&mut self, lowest_in_overflow: Option<u32>) -> Option<()> {
        let near = self.next_in_ring();
        self.level = near.into_iter().chain(lowest_in_overflow).min()?;
        if near == Some(self.level) {
            let mut list = std::mem::take(self.list(self.level));
            list.drain(..).for_each(|cell| self.present.insert(cell));
            // Put the bucket back to reuse its allocation.
            self.ring[self.level as usize % RING] = list;
        }
        let first = u64::from(self.level) << 32;
        while let Some(Reverse(key)) = self.overflow.peek().filter(|key| key.0 >> 32 == first >> 32)
        {
            self.present.insert(*key as u32);
            self.overflow.pop();
        }
        Some(())
    }

    /// Returns the lowest estimate in the ring.
    fn next_in_ring(&self) -> Option<u32> {
        const WORDS: usize = RING / 64;
        let start = (self.level as usize + 1) % RING;
        let not_before = u64::MAX << (start % 64);
        // The first word is visited twice: its bits before the start come last.
        let masks = [not_before].into_iter().chain([u64::MAX; WORDS - 1]).chain([!not_before]);
        let (list, _) = masks
            .enumerate()
            .map(|(k, mask)| ((start / 64 + k) % WORDS, mask))
            .map(|(word, mask)| (word * 64, self.filled[word] & mask))
            .map(|(first, bits)| (first + bits.trailing_zeros() as usize, bits))
            .find(|(_, bits)| *bits != 0)?;
        let ahead = (list + RING - self.level as usize % RING) % RING;
        Some(self.level + ahead as u32)
    }

    /// Returns the bucket of an estimate in the ring and marks it as empty.
    fn list(&mut self, estimate: u32) -> &mut Vec<u32> {
        let list = estimate as usize % RING;
        self.filled[list / 64] &= !(1 << (list % 64));
        &mut self.ring[list]
    }
}

/// Set of cells with a fast minimum.
#[derive(Clone, Debug)]
struct CellSet {
    /// One bit per cell.
    cells: Vec<u64>,
    /// One bit per word of `cells` that is not zero.
    words: Vec<u64>,
    /// All entries of `words` before this one are zero.
    first: usize,
}

impl CellSet {
    fn new(n_cells: usize) -> CellSet {
        let n_words = n_cells.div_ceil(64);
        CellSet { cells: vec![0; n_words], words: vec![0; n_words.div_ceil(64)], first: 0 }
    }

    #[inline]
    fn insert(&mut self, cell: u32) {
        let word = cell as usize / 64;
        self.cells[word] |= 1 << (cell % 64);
        self.words[word / 64] |= 1 << (word % 64);
        self.first = self.first.min(word / 64);
    }

    /// Removes and returns the lowest cell.
    #[inline]
    fn pop(&mut self) -> Option<u32> {
        while let Some(words) = self.words.get_mut(self.first) {
            if *words != 0 {
                let word = 64 * self.first + words.trailing_zeros() as usize;
                let cells = &mut self.cells[word];
                let cell = 64 * word as u32 + cells.trailing_zeros();
                *cells &= *cells - 1;
                if *cells == 0 {
                    *words &= *words - 1;
                }
                return Some(cell);
            }
            self.first += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::rng::RngStream;

    #[test]
    fn cells_are_popped_as_from_a_heap_for_any_order_of_pushes() {
        let mut queue = BucketQueue::new(10_000);
        for seed in 0..60 {
            let mut rng = RngStream::new(seed, "queue", 0);
            let mut heap = BinaryHeap::new();
            let range = [12, 400, 5000, 5_000_000][seed as usize % 4];
            let mut last = if seed % 5 == 0 { u32::MAX - 3000 } else { 0 };
            for k in 0..3000 {
                if rng.chance(0.6) {
                    // Mostly later than the last popped entry, sometimes earlier.
                    let back = if rng.chance(0.1) { 15 } else { 0 };
                    let estimate = match rng.below(200) {
                        0 => u32::MAX,
                        1 => rng.below(100) as u32,
                        _ => last.saturating_add(rng.below(range) as u32).saturating_sub(back),
                    };
                    // No cell is pushed twice with the same estimate.
                    let cell = (k * 7) % 10_000;
                    queue.push(estimate, cell);
                    heap.push(Reverse((estimate, cell)));
                } else {
                    let expected = heap.pop().map(|Reverse(first)| first);
                    assert_eq!(queue.pop(), expected, "seed {seed}");
                    last = expected.map_or(last, |(estimate, _)| estimate);
                }
            }
            queue.clear();
            assert_eq!(queue.pop(), None);
        }
    }
}
