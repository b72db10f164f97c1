//! Ranges of numeric options. Each option states its range in its help; a test compares both.

use std::ops::RangeInclusive;

use chaic_eval::run::{MAX_IMAGE_SIZE, MIN_IMAGE_SIZE};
use chaic_learn::opponent::collect::MAX_WINDOWS;
use chaic_study::MAX_PARTICIPANTS;
use chaic_training::bounds::MAX_STEPS;
use chaic_vision::behavior::config::{MAX_CLIPS, MAX_EPISODES};
use chaic_vision::track_evaluation::MAX_EPISODES as MAX_TRACK_EPISODES;

/// Parallel jobs: more than the cores of any machine.
pub(super) const JOBS: RangeInclusive<i64> = 1..=1024;
/// Episodes of each task; no run needs more.
pub(super) const N_EPISODES: RangeInclusive<i64> = 1..=1_000_000;
/// Seeds of each episode. 10,000 seeds reduce standard errors to a hundredth.
pub(super) const SEEDS: RangeInclusive<i64> = 1..=10_000;
/// One seed of an episode, counted from 0.
pub(super) const SEED: RangeInclusive<i64> = 0..=9999;
/// Side of the images of a run, pixels.
pub(super) const RUN_SIZE: RangeInclusive<i64> = MIN_IMAGE_SIZE as i64..=MAX_IMAGE_SIZE as i64;
/// Frame of an episode; all episodes are shorter.
pub(super) const FRAME: RangeInclusive<i64> = 0..=1_000_000;
/// Distance between the frames of a video.
pub(super) const EVERY: RangeInclusive<i64> = 1..=10_000;
/// Images per second of a video: the limit of MP4. The limit of GIF is lower.
pub(super) const FPS: RangeInclusive<i64> = 1..=240;
/// Objects in the house of `chaic bench`, which has room for a few hundred.
pub(super) const OBJECTS: RangeInclusive<u64> = 0..=1000;
/// Clips per behavior.
pub(super) const CLIPS: RangeInclusive<i64> = 1..=MAX_CLIPS as i64;
/// Windows per goal.
pub(super) const WINDOWS: RangeInclusive<i64> = 1..=MAX_WINDOWS as i64;
/// Episodes from which clips or windows are collected.
pub(super) const EPISODES: RangeInclusive<i64> = 1..=MAX_EPISODES as i64;
/// Episodes in which tracks are evaluated.
pub(super) const TRACK_EPISODES: RangeInclusive<i64> = 1..=MAX_TRACK_EPISODES as i64;
/// Simulated participants of a study.
pub(super) const PARTICIPANTS: RangeInclusive<i64> = 1..=MAX_PARTICIPANTS as i64;
/// Steps of a training.
pub(super) const STEPS: RangeInclusive<u64> = 1..=MAX_STEPS;
