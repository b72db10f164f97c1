//! Named random streams.
//!
//! Every draw comes from a stream named by `(seed, purpose, index)`. Streams are independent, so
//! adding a draw in one place can't shift another, and the same name gives the same numbers on
//! every machine and in every version that keeps the name.

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

/// A stream of random numbers with a name.
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of this name. `purpose` says what it is for (`"house"`, `"lift"`), `index`
    /// tells apart streams of one purpose (an agent, an attempt, an object).
    pub fn new(seed: u64, purpose: &str, index: u64) -> Stream {
        let mut key = [0u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&index.to_le_bytes());
        key[16..24].copy_from_slice(&fnv1a(purpose.as_bytes()).to_le_bytes());
        key[24..].copy_from_slice(b"chaic-v1");
        Stream(ChaCha8Rng::from_seed(key))
    }

    /// A number in [0, 1) with 24 random bits.
    pub fn unit(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / (1u32 << 24) as f32
    }

    /// A number in [`low`, `high`).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f32) -> bool {
        self.unit() < p
    }

    /// A whole number in 0..`n`.
    ///
    /// # Panics
    /// If `n` is 0: there is nothing to choose from.
    pub fn below(&mut self, n: usize) -> usize {
        assert!(n > 0, "a choice needs at least one option");
        // Multiply-shift: the bias is below n / 2^64.
        ((u128::from(self.0.next_u64()) * n as u128) >> 64) as usize
    }

    /// Draws a seed for further streams, from which this stream's own seed can't be read off.
    pub fn seed(&mut self) -> u64 {
        (0..4).fold(0, |seed, _| seed << 16 | self.below(1 << 16) as u64)
    }

    /// One element, or `None` of an empty slice.
    pub fn choose<'a, T>(&mut self, items: &'a [T]) -> Option<&'a T> {
        if items.is_empty() { None } else { Some(&items[self.below(items.len())]) }
    }

    /// Puts the elements into a random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            let j = self.below(i + 1);
            items.swap(i, j);
        }
    }
}

/// FNV-1a, 64 bits: only has to tell purposes apart.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_gives_the_same_numbers_for_ever() {
        let mut s = Stream::new(7, "golden", 3);
        let drawn: Vec<usize> = (0..6).map(|_| s.below(1000)).collect();
        let mut again = Stream::new(7, "golden", 3);
        assert_eq!(drawn, (0..6).map(|_| again.below(1000)).collect::<Vec<_>>());
        for other in
            [Stream::new(8, "golden", 3), Stream::new(7, "other", 3), Stream::new(7, "golden", 4)]
        {
            let mut other = other;
            assert_ne!(drawn, (0..6).map(|_| other.below(1000)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn draws_fill_their_range_evenly() {
        let mut s = Stream::new(1, "even", 0);
        let mut counts = [0u32; 5];
        for _ in 0..10_000 {
            counts[s.below(5)] += 1;
            let u = s.unit();
            assert!((0.0..1.0).contains(&u));
        }
        assert!(counts.iter().all(|c| (1_800..2_200).contains(c)), "{counts:?}");
    }
}
