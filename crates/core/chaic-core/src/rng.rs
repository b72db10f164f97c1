//! Named random streams.
//!
//! Every draw comes from a stream with the name `(seed, purpose, index)`. Streams are independent,
//! so an additional draw in one place cannot shift another. A name gives the same numbers on every
//! machine and in every version that keeps the name.

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

/// A named stream of random numbers.
#[derive(Clone, Debug)]
pub struct RngStream(ChaCha8Rng);

impl RngStream {
    /// Creates the stream with this name. `purpose` is the use (`"house"`, `"lift"`); `index`
    /// separates streams of one purpose (an agent, an attempt, an object).
    pub fn new(seed: u64, purpose: &str, index: u64) -> RngStream {
        let mut key = [0u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&index.to_le_bytes());
        key[16..24].copy_from_slice(&fnv1a(purpose.as_bytes()).to_le_bytes());
        key[24..].copy_from_slice(b"chaic-v1");
        RngStream(ChaCha8Rng::from_seed(key))
    }

    /// Draws a number in [0, 1) with 24 random bits.
    pub fn unit(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / (1u32 << 24) as f32
    }

    /// Draws a number in [`low`, `high`).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Returns true with probability `p`.
    pub fn chance(&mut self, p: f32) -> bool {
        self.unit() < p
    }

    /// Draws an integer in 0..`n`.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        assert!(n > 0, "below requires n > 0");
        // Multiply-shift: the bias is below n / 2^64.
        ((u128::from(self.0.next_u64()) * n as u128) >> 64) as usize
    }

    /// Draws a seed for derived streams; it does not reveal the seed of this stream.
    pub fn seed(&mut self) -> u64 {
        (0..4).fold(0, |seed, _| seed << 16 | self.below(1 << 16) as u64)
    }

    /// Draws an element; `None` for an empty slice.
    pub fn choose<'a, T>(&mut self, items: &'a [T]) -> Option<&'a T> {
        if items.is_empty() { None } else { Some(&items[self.below(items.len())]) }
    }

    /// Shuffles the elements.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            let j = self.below(i + 1);
            items.swap(i, j);
        }
    }
}

/// Returns the 64-bit FNV-1a hash; it only has to separate purposes.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_give_equal_numbers() {
        let mut s = RngStream::new(7, "golden", 3);
        let drawn: Vec<usize> = (0..6).map(|_| s.below(1000)).collect();
        let mut again = RngStream::new(7, "golden", 3);
        assert_eq!(drawn, (0..6).map(|_| again.below(1000)).collect::<Vec<_>>());
        for other in [
            RngStream::new(8, "golden", 3),
            RngStream::new(7, "other", 3),
            RngStream::new(7, "golden", 4),
        ] {
            let mut other = other;
            assert_ne!(drawn, (0..6).map(|_| other.below(1000)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn draws_are_uniform() {
        let mut s = RngStream::new(1, "even", 0);
        let mut counts = [0u32; 5];
        for _ in 0..10_000 {
            counts[s.below(5)] += 1;
            let u = s.unit();
            assert!((0.0..1.0).contains(&u));
        }
        assert!(counts.iter().all(|c| (1_800..2_200).contains(c)), "{counts:?}");
    }
}
