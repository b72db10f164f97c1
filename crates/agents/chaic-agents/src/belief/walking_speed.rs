//! Walking speed of a person, estimated from sightings.

use chaic_core::{Frame, Vec2};

/// Minimum and maximum time between two sightings of one sample, frames. Over less time, errors of
/// positions exceed the distance walked.
const INTERVAL_FRAMES: [Frame; 2] = [20, 40];
/// Minimum displacement of a sample, meters: below it, the person may have stood.
const MIN_DISPLACEMENT_M: f32 = 0.3;
/// Number of samples for an estimate.
const MIN_SAMPLES: usize = 3;
/// Maximum number of samples: as many as an episode of 3,000 frames can have.
const MAX_SAMPLES: usize = 150;

/// Samples of the walking speed of one person.
#[derive(Clone, Debug, Default)]
pub struct WalkingSpeed {
    /// Recent sightings: frame and position (x, z), oldest first.
    recent: Vec<(Frame, Vec2)>,
    /// Samples, meters per frame, in increasing order.
    samples: Vec<f32>,
}

impl WalkingSpeed {
    /// Records a sighting at `at` (x, z).
    pub fn record(&mut self, frame: Frame, at: Vec2) {
        let [min_frames, max_frames] = INTERVAL_FRAMES;
        self.recent.retain(|(f, _)| f + max_frames >= frame);
        if let Some((first, from)) = self.recent.first().copied()
            && frame >= first + min_frames
        {
            let distance_m = from.distance(at);
            if distance_m > MIN_DISPLACEMENT_M && self.samples.len() < MAX_SAMPLES {
                let speed = distance_m / (frame - first) as f32;
                let i = self.samples.partition_point(|s| *s < speed);
                self.samples.insert(i, speed);
            }
            self.recent.clear();
        }
        self.recent.push((frame, at));
    }

    /// Returns the upper quartile of the samples, meters per frame: people also stop and turn
    /// between two sightings. `None` before there are enough samples.
    pub fn estimate(&self) -> Option<f32> {
        let n = self.samples.len();
        (n >= MIN_SAMPLES).then(|| self.samples[3 * (n - 1) / 4])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_estimate_is_robust_against_stops_and_rejects_single_errors() {
        let mut walk = WalkingSpeed::default();
        let mut x = 0.0;
        for k in 0..200 {
            // Stands in every fourth group of 50 frames; one position is wrong by 3 m.
            let is_standing = (k / 5) % 4 == 3;
            x += if is_standing { 0.0 } else { 0.47 };
            let error = if k == 50 { 3.0 } else { 0.0 };
            walk.record(10 * k, Vec2::new(x + error, 0.0));
        }
        let speed = walk.estimate().expect("many samples");
        assert!((speed - 0.047).abs() < 0.002, "{speed}");
    }

    #[test]
    fn distant_or_resting_sightings_give_no_sample() {
        let mut walk = WalkingSpeed::default();
        for k in 0..20 {
            walk.record(60 * k, Vec2::new(3.0 * k as f32, 0.0));
        }
        for k in 0..20 {
            walk.record(2000 + 10 * k, Vec2::new(0.1 * (k % 2) as f32, 0.0));
        }
        assert_eq!(walk.estimate(), None);
    }
}
