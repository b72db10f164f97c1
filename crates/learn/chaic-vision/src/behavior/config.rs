//! Configuration of clip collection.

use chaic_training::bounds::{BoundTable, FRACTION, SEED, integer};
use serde::{Deserialize, Serialize};
/// Configuration of clip collection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClipCollectionConfig {
    /// Seed of the choice of episodes.
    pub seed: u64,
    /// Maximum number of clips of each behavior, and of mixed clips.
    #[serde(alias = "of_each")]
    pub max_per_class: usize,
    /// Maximum number of episodes.
    pub episodes: usize,
    /// Fraction of episodes with random lights and colors.
    #[serde(alias = "varied")]
    pub varied_fraction: f32,
    /// Fraction of episodes recorded by helpers with the bundled detector. Their crops have
    /// realistic localization errors.
    #[serde(alias = "learned")]
    pub learned_fraction: f32,
    /// Fraction of episodes recorded by helpers with the error rates of the bundled detector and noisy
    /// positions of the partner. They take a small part of the time.
    pub noisy_fraction: f32,
}

impl Default for ClipCollectionConfig {
    fn default() -> ClipCollectionConfig {
        ClipCollectionConfig {
            seed: 1,
            max_per_class: 1200,
            episodes: 700,
            varied_fraction: 0.35,
            learned_fraction: 0.0,
            noisy_fraction: 0.6,
        }
    }
}

impl ClipCollectionConfig {
    /// Checks that the fractions of perceptions do not exceed the whole.
    ///
    /// # Errors
    /// One line that names the keys.
    pub fn check(&self) -> Result<(), String> {
        let sum = self.learned_fraction + self.noisy_fraction;
        if sum > 1.0 {
            return Err(format!(
                "collect.learned_fraction plus collect.noisy_fraction is {sum}; it must be at most 1"
            ));
        }
        Ok(())
    }
}

/// Bounds of [`ClipCollectionConfig`].
pub const COLLECT_BOUNDS: BoundTable = &[
    ("seed", SEED),
    ("max_per_class", integer(1, MAX_CLIPS as i64)),
    ("episodes", integer(1, MAX_EPISODES as i64)),
    ("varied_fraction", FRACTION),
    ("learned_fraction", FRACTION),
    ("noisy_fraction", FRACTION),
];
/// Maximum number of clips of each behavior, and of mixed clips. A clip takes 0.33 MB, which makes
/// 12 GB.
pub const MAX_CLIPS: u32 = 5_000;
/// Maximum number of episodes.
pub const MAX_EPISODES: u32 = 100_000;
