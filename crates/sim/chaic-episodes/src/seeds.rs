//! Seeds of generators, and the ranges of seeds that each purpose may use.
//!
//! Evaluation must use episodes that no model was trained on. [`SEED_RANGES`] therefore lists every
//! range with its purpose and its [`DatasetSplit`], and a test asserts that the ranges are pairwise
//! disjoint. A new consumer of generated episodes adds its ranges here.

use std::fmt;
use std::ops::Range;

use chaic_core::TaskId;
use chaic_core::rng::RngStream;
use chaic_core::task::TASKS;

/// Episodes of each task in each of the bundled splits (paper, "Dataset Construction").
pub const BUNDLED_PER_TASK: usize = 12;
/// Episodes of each task in the standard split.
pub const STANDARD_PER_TASK: usize = 100;
/// Number of tasks that the paper defines; only these have bundled and standard episodes.
const N_PAPER_TASKS: u64 = 8;

/// Upper limit of the seeds of `gen:` and `gen-standard:`, and first seed of the bundled episodes.
///
/// It is a multiple of 12, so that a bundled seed modulo 12 is the index of the episode within its
/// task and split.
pub(crate) const FIRST_BUNDLED_SEED: u64 = 12 << 36;

/// Seeds that a generated episode depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeneratorSeeds {
    /// Seed of the surroundings: walls, furniture, scenery.
    pub place: u64,
    /// Seed of the contents: goal, objects, people.
    pub episode: u64,
}

impl GeneratorSeeds {
    /// Returns the seeds of an episode that shares its surroundings with no other seed.
    pub(crate) fn from_seed(seed: u64) -> GeneratorSeeds {
        GeneratorSeeds { place: seed, episode: seed }
    }
}

/// Returns the row of a task in [`TASKS`].
pub(crate) fn task_index(task: TaskId) -> usize {
    TASKS.iter().position(|t| t.id == task).expect("the table lists every task")
}

/// Role of generated data in the development of a model.
///
/// [`Split`](crate::Split) in contrast names a set of benchmark episodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DatasetSplit {
    /// Data that parameters are fitted to.
    Train,
    /// Data that checkpoints and hyperparameters are selected by.
    Validation,
    /// Held-out data that final figures are measured on.
    Test,
}

/// Writes the name as stored in clip folders and COCO files: `Training`, `Validation` or `Test`.
impl fmt::Display for DatasetSplit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            DatasetSplit::Train => "Training",
            DatasetSplit::Validation => "Validation",
            DatasetSplit::Test => "Test",
        })
    }
}

/// Consumer of a range of seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SeedPurpose {
    /// Bundled and standard episodes of the benchmark.
    Benchmark,
    /// Views for the detector and clips for the behavior network.
    Perception,
    /// Rollouts of learned policies.
    Policy,
    /// Observation windows for the opponent model.
    OpponentModel,
}

/// Contiguous range of episode seeds with one purpose and one role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeedRange {
    /// Consumer of the range.
    pub purpose: SeedPurpose,
    /// Role of the episodes.
    pub split: DatasetSplit,
    /// First seed.
    pub first: u64,
    /// Number of seeds.
    pub count: u64,
}

impl SeedRange {
    /// The bundled episodes `train`.
    pub const BUNDLED_TRAIN: SeedRange =
        benchmark(DatasetSplit::Train, FIRST_BUNDLED_SEED, BUNDLED_PER_TASK);
    /// The bundled episodes `test`.
    pub const BUNDLED_TEST: SeedRange =
        benchmark(DatasetSplit::Test, 2 * FIRST_BUNDLED_SEED, BUNDLED_PER_TASK);
    /// The split `standard`.
    pub const STANDARD: SeedRange =
        benchmark(DatasetSplit::Test, 3 * FIRST_BUNDLED_SEED, STANDARD_PER_TASK);

    /// Episodes of sealed splits, whose seeds follow from a secret. The largest is below 2^53, so that
    /// JSON readers with 64-bit floats read it exactly.
    pub const SEALED: SeedRange = SeedRange {
        purpose: SeedPurpose::Benchmark,
        split: DatasetSplit::Test,
        first: 1 << 52,
        count: 1 << 52,
    };

    /// Training episodes of policies.
    pub const POLICY_TRAIN: SeedRange = SeedRange {
        purpose: SeedPurpose::Policy,
        split: DatasetSplit::Train,
        first: 40_000_000,
        count: 1_000_000,
    };
    /// Validation episodes of policies.
    pub const POLICY_VALIDATION: SeedRange = SeedRange {
        purpose: SeedPurpose::Policy,
        split: DatasetSplit::Validation,
        first: 50_000_000,
        count: 1_000,
    };

    /// Returns the seeds of views and clips that perception uses.
    pub const fn perception(split: DatasetSplit) -> SeedRange {
        let (first, count) = match split {
            DatasetSplit::Train => (10_000_000, 1_000_000),
            DatasetSplit::Validation => (20_000_000, 10_000),
            DatasetSplit::Test => (30_000_000, 10_000),
        };
        SeedRange { purpose: SeedPurpose::Perception, split, first, count }
    }

    /// Returns the seeds of episodes that windows for the opponent model are collected from.
    pub const fn opponent_model(split: DatasetSplit) -> SeedRange {
        let first = match split {
            DatasetSplit::Train => 42_000_000,
            DatasetSplit::Validation => 52_000_000,
            DatasetSplit::Test => 62_000_000,
        };
        SeedRange { purpose: SeedPurpose::OpponentModel, split, first, count: 100_000 }
    }

    /// Draws a seed of the range.
    pub fn draw(self, rng: &mut RngStream) -> u64 {
        self.first + rng.below(self.count as usize) as u64
    }

    /// Returns the seeds.
    pub const fn seeds(self) -> Range<u64> {
        self.first..self.first + self.count
    }
}

const fn benchmark(split: DatasetSplit, first: u64, n_per_task: usize) -> SeedRange {
    let count = N_PAPER_TASKS * n_per_task as u64;
    SeedRange { purpose: SeedPurpose::Benchmark, split, first, count }
}

/// All reserved ranges, pairwise disjoint.
pub const SEED_RANGES: [SeedRange; 12] = [
    SeedRange::BUNDLED_TRAIN,
    SeedRange::BUNDLED_TEST,
    SeedRange::STANDARD,
    SeedRange::SEALED,
    SeedRange::perception(DatasetSplit::Train),
    SeedRange::perception(DatasetSplit::Validation),
    SeedRange::perception(DatasetSplit::Test),
    SeedRange::POLICY_TRAIN,
    SeedRange::POLICY_VALIDATION,
    SeedRange::opponent_model(DatasetSplit::Train),
    SeedRange::opponent_model(DatasetSplit::Validation),
    SeedRange::opponent_model(DatasetSplit::Test),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seed_ranges_are_pairwise_disjoint() {
        for (i, a) in SEED_RANGES.iter().enumerate() {
            assert!(!a.seeds().is_empty(), "{a:?}");
            for b in &SEED_RANGES[..i] {
                let is_disjoint = a.seeds().end <= b.first || b.seeds().end <= a.first;
                assert!(is_disjoint, "{a:?} overlaps {b:?}");
            }
        }
    }

    #[test]
    fn only_the_benchmark_uses_seeds_that_generated_episodes_cannot_name() {
        for range in SEED_RANGES {
            let is_generated = range.seeds().end <= FIRST_BUNDLED_SEED;
            assert_eq!(is_generated, range.purpose != SeedPurpose::Benchmark, "{range:?}");
        }
    }

    #[test]
    fn the_paper_has_eight_tasks_in_the_first_rows() {
        assert_eq!(TaskId::paper().count() as u64, N_PAPER_TASKS);
        assert!(TaskId::paper().all(|task| (task_index(task) as u64) < N_PAPER_TASKS));
    }
}
