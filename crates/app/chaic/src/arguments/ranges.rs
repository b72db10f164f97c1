//! Ranges of numeric options. Each option states its range in its help; a test compares both.

use std::ops::RangeInclusive;

use chaic_eval::run::{MAX_IMAGE_SIZE, MIN_IMAGE_SIZE};
use chaic_learn::opponent::collect::MAX_WINDOWS;
use chaic_training::bounds::MAX_STEPS;
use chaic_vision::behavior::collect::{MAX_CLIPS, MAX_EPISODES};

/// Work done side by side: more threads than any machine has cores.
pub(super) const JOBS: RangeInclusive<i64> = 1..=1024;
/// Episodes of each task: as many as the longest run has.
pub(super) const FIRST: RangeInclusive<i64> = 1..=1_000_000;
/// Seeds of each episode. Standard errors after 10,000 are a hundredth of those after one.
pub(super) const SEEDS: RangeInclusive<i64> = 1..=10_000;
/// One of the seeds of an episode, counted from 0.
pub(super) const SEED: RangeInclusive<i64> = 0..=9999;
/// Side of images of a run, pixels.
pub(super) const RUN_SIZE: RangeInclusive<i64> = MIN_IMAGE_SIZE as i64..=MAX_IMAGE_SIZE as i64;
/// Frames of an episode: longer than any has.
pub(super) const FRAME: RangeInclusive<i64> = 0..=1_000_000;
/// Distance of frames that are drawn.
pub(super) const EVERY: RangeInclusive<i64> = 1..=10_000;
/// Pictures a second of a video: as many as MP4 takes; GIF takes fewer.
pub(super) const FPS: RangeInclusive<i64> = 1..=240;
/// Things in the house of a bench, which has room for a few hundred.
pub(super) const THINGS: RangeInclusive<u64> = 0..=1000;
/// Clips of each behavior.
pub(super) const CLIPS: RangeInclusive<i64> = 1..=MAX_CLIPS as i64;
/// Windows of each goal.
pub(super) const WINDOWS: RangeInclusive<i64> = 1..=MAX_WINDOWS as i64;
/// Episodes that clips or windows are made of.
pub(super) const EPISODES: RangeInclusive<i64> = 1..=MAX_EPISODES as i64;
/// Steps of a training.
pub(super) const STEPS: RangeInclusive<u64> = 1..=MAX_STEPS;
