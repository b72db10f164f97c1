//! Simulated detector: ground truth with errors at measured rates, for fast experiments.

use std::sync::Arc;

use chaic_agents::perception::{Perception, Percepts};
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::track::{Hands, Intent, TrackId};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Briefing, ClassId, Observation, Outcome, Target};
use serde::{Deserialize, Serialize};

use crate::average_precision::{EvaluatedImage, ScoredDetection};
use crate::error_breakdown::REPORT_SCORE;
use crate::instances::Instance;
use crate::labels::label_of;
use crate::perception::Tracking;

/// Number of pixels of the images for which rates are measured.
const MEASURED_PX: usize = 512 * 512;

/// Error rates of a detector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorNoiseModel {
    /// Rows of (minimum visible pixels in a 512x512 image, fraction of such objects that are
    /// missed), ascending. A row applies up to the next row's minimum; objects below the first row
    /// are always missed. Areas in smaller images are scaled to 512x512.
    #[serde(alias = "missed")]
    pub miss_rate_by_area: Vec<(u32, f32)>,
    /// Fraction of detected objects that get the label of a random class of the same role. The
    /// random class may be the true class.
    #[serde(alias = "misnamed")]
    pub misclassification_rate: f32,
    /// Mean number of false positives per image.
    #[serde(alias = "invented")]
    pub false_positives_per_image: f32,
    /// Mean score of correct detections, then of false positives and misclassified detections.
    pub scores: [f32; 2],
}

impl DetectorNoiseModel {
    /// Returns a model without errors.
    pub fn none() -> DetectorNoiseModel {
        DetectorNoiseModel {
            miss_rate_by_area: vec![(5, 0.0)],
            misclassification_rate: 0.0,
            false_positives_per_image: 0.0,
            scores: [1.0, 0.5],
        }
    }

    /// Returns the rates of the bundled detector (crates/learn/chaic-vision/weights).
    pub fn built_in() -> DetectorNoiseModel {
        let text = include_bytes!("../weights/faults.json");
        serde_json::from_slice(text).expect("a test reads it")
    }

    /// Measures the rates of a detector on evaluated images.
    pub fn measured(images: &[EvaluatedImage]) -> DetectorNoiseModel {
        /// Minimum pixels of the rows of [`DetectorNoiseModel::miss_rate_by_area`].
        const MIN_PX: [u32; 6] = [24, 64, 100, 400, 1000, 5000];
        let fraction = |n: usize, total: usize| n as f32 / total.max(1) as f32;
        let mut counts_by_area = [[0usize; 2]; MIN_PX.len()];
        let (mut n_found, mut n_misclassified, mut n_false_positives) = (0, 0, 0);
        let mut scores = [(0.0f32, 0usize); 2];
        for image in images {
            let detections: Vec<_> =
                image.detections.iter().filter(|d| d.score >= REPORT_SCORE).collect();
            for (t, truth) in image.truths.iter().enumerate() {
                let Some(row) = MIN_PX.iter().rposition(|px| truth.area >= *px) else { continue };
                let overlaps =
                    |d: &&&ScoredDetection| 3 * d.intersections[t] >= truth.area + d.area;
                let mut covering: Vec<_> = detections.iter().filter(overlaps).collect();
                covering.sort_by_key(|d| d.label != truth.label);
                counts_by_area[row][1] += 1;
                counts_by_area[row][0] += usize::from(covering.is_empty());
                let Some(best) = covering.first() else { continue };
                let is_misclassified = best.label != truth.label;
                n_found += 1;
                n_misclassified += usize::from(is_misclassified);
                let (sum, n) = &mut scores[usize::from(is_misclassified)];
                (*sum, *n) = (*sum + best.score, *n + 1);
            }
            let false_positives =
                detections.iter().filter(|d| d.intersections.iter().all(|s| 5 * s < d.area));
            for detection in false_positives {
                n_false_positives += 1;
                let (sum, n) = &mut scores[1];
                (*sum, *n) = (*sum + detection.score, *n + 1);
            }
        }
        let rows = MIN_PX.into_iter().zip(counts_by_area);
        DetectorNoiseModel {
            miss_rate_by_area: rows
                .map(|(px, [missed, all])| (px, fraction(missed, all)))
                .collect(),
            misclassification_rate: fraction(n_misclassified, n_found),
            false_positives_per_image: fraction(n_false_positives, images.len()),
            scores: scores.map(|(sum, n)| if n == 0 { REPORT_SCORE } else { sum / n as f32 }),
        }
    }

    /// Checks that rates and scores are fractions, areas ascend, and false positives are few.
    ///
    /// # Errors
    /// One line that names the key.
    pub fn check(&self) -> Result<(), String> {
        /// Maximum mean number of false positives per image; more would cover the image.
        const MAX_FALSE_POSITIVES: f32 = 1000.0;
        let is_fraction = |x: &f32| (0.0..=1.0).contains(x);
        let rates = &self.miss_rate_by_area;
        if !rates.iter().all(|(_, rate)| is_fraction(rate)) {
            return Err("miss_rate_by_area has a rate outside 0 to 1".to_owned());
        }
        if !rates.is_sorted_by(|(a, _), (b, _)| a < b) {
            return Err("miss_rate_by_area must have ascending areas".to_owned());
        }
        if !is_fraction(&self.misclassification_rate) {
            return Err("misclassification_rate must be from 0 to 1".to_owned());
        }
        if !self.scores.iter().all(is_fraction) {
            return Err("scores must be from 0 to 1".to_owned());
        }
        if !(0.0..=MAX_FALSE_POSITIVES).contains(&self.false_positives_per_image) {
            return Err(format!(
                "false_positives_per_image must be from 0 to {MAX_FALSE_POSITIVES}"
            ));
        }
        Ok(())
    }

    /// Returns the miss rate of an object with `n_pixels` visible pixels in an image of `image_px`
    /// pixels.
    fn miss_rate(&self, n_pixels: usize, image_px: usize) -> f32 {
        let n_pixels = n_pixels * MEASURED_PX / image_px;
        let row =
            self.miss_rate_by_area.iter().rev().find(|(min_px, _)| n_pixels >= *min_px as usize);
        row.map_or(1.0, |(_, rate)| *rate)
    }
}

/// Creates perception from ground truth with simulated errors.
#[derive(Clone, Debug)]
pub struct NoisyPerceptionFactory {
    noise: Arc<DetectorNoiseModel>,
    name: String,
}

impl NoisyPerceptionFactory {
    /// Creates a factory with these rates under a name.
    pub fn new(noise: DetectorNoiseModel, name: String) -> NoisyPerceptionFactory {
        NoisyPerceptionFactory { noise: Arc::new(noise), name }
    }
}

impl PerceptionFactory for NoisyPerceptionFactory {
    fn name(&self) -> Option<String> {
        Some(self.name.clone())
    }

    fn sensors(&self) -> SensorConfig {
        SensorConfig::DEPTH_AND_IDS
    }

    fn grants(&self, requested: Grants) -> Grants {
        // The granted state names objects by ids, which this perception cannot match to its tracks.
        Grants { state: false, ..requested }
    }

    fn perception(&self) -> Box<dyn Perception> {
        let noise = Arc::clone(&self.noise);
        Box::new(NoisyPerception { noise, tracking: Tracking::default(), seed: 0 })
    }
}

#[derive(Clone, Debug)]
struct NoisyPerception {
    noise: Arc<DetectorNoiseModel>,
    tracking: Tracking,
    seed: u64,
}

impl NoisyPerception {
    /// Returns the instances of an image with known ids, with simulated errors.
    fn instances(&self, ids: &[u16], observation: &Observation) -> Vec<Instance> {
        let mut rng =
            RngStream::new(self.seed, "faults of perception", u64::from(observation.frame));
        let classes = &observation.granted.classes;
        let mut pixels: Vec<Vec<u32>> = vec![Vec::new(); classes.len()];
        let n = classes.last().map_or(0, |(entity, _)| usize::from(entity.0) + 1);
        let mut class_index = vec![usize::MAX; n];
        classes
            .iter()
            .enumerate()
            .for_each(|(k, (entity, _))| class_index[usize::from(entity.0)] = k);
        for (k, id) in ids.iter().enumerate() {
            let row = class_index.get(usize::from(*id)).and_then(|row| pixels.get_mut(*row));
            row.into_iter().for_each(|pixels| pixels.push(k as u32));
        }
        let mut instances = Vec::new();
        let [correct_score, wrong_score] = self.noise.scores;
        for ((_, class), pixels) in classes.iter().zip(pixels) {
            if rng.chance(self.noise.miss_rate(pixels.len(), ids.len())) {
                continue;
            }
            let candidates: Vec<ClassId> =
                ClassId::all().filter(|c| c.info().role == class.info().role).collect();
            let (class, score) = match rng.choose(&candidates) {
                Some(wrong_class) if rng.chance(self.noise.misclassification_rate) => {
                    (*wrong_class, wrong_score)
                }
                _ => (*class, correct_score),
            };
            let label = label_of(Some(class));
            instances.push(Instance { names: vec![(label, score)], pixels, center: [0.0; 3] });
        }
        let (width, height) = (observation.camera.width, observation.camera.height);
        let classes: Vec<ClassId> = ClassId::all().filter(|c| c.info().is_carriable()).collect();
        while rng.chance(
            self.noise.false_positives_per_image / (1.0 + self.noise.false_positives_per_image),
        ) {
            /// Side of a false positive, pixels.
            const SIDE: u32 = 12;
            let Some(class) = rng.choose(&classes) else { break };
            let [x, y] = [width, height].map(|n| rng.below((n - SIDE) as usize) as u32);
            let row = |y: u32| (y * width + x..y * width + x + SIDE).collect::<Vec<u32>>();
            let pixels = (y..y + SIDE).flat_map(row).collect();
            let label = label_of(Some(*class));
            let names = vec![(label, wrong_score)];
            instances.push(Instance { names, pixels, center: [0.0; 3] });
        }
        instances
    }
}

impl Perception for NoisyPerception {
    fn reset(&mut self, briefing: &Briefing) {
        (self.tracking, self.seed) = (Tracking::new(briefing), briefing.seed);
    }

    fn update_hands(&mut self, hands: &Hands, last: Option<(Intent, Outcome)>) {
        self.tracking.tracker.update_hands(hands, last);
    }

    fn perceive(&mut self, observation: &Observation) -> Percepts {
        self.tracking.last.clear();
        let images = &observation.images;
        let n_pixels = observation.camera.width as usize * observation.camera.height as usize;
        match (&images.ids, &images.depth_m) {
            (Some(ids), Some(depth_m)) if ids.len() == n_pixels && depth_m.len() == n_pixels => {
                let found = self.instances(ids, observation);
                self.tracking.update(&found, depth_m, observation)
            }
            _ => Percepts::default(),
        }
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        self.tracking.target(track)
    }

    fn uses_pixel_targets(&self) -> bool {
        true
    }

    fn hides_ids(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_rates_are_refused_by_key() {
        DetectorNoiseModel::built_in().check().unwrap();
        let none = DetectorNoiseModel::none;
        let wrong = [
            (
                "miss_rate_by_area",
                DetectorNoiseModel { miss_rate_by_area: vec![(24, 61.0)], ..none() },
            ),
            (
                "miss_rate_by_area",
                DetectorNoiseModel { miss_rate_by_area: vec![(64, 0.1), (24, 0.5)], ..none() },
            ),
            (
                "misclassification_rate",
                DetectorNoiseModel { misclassification_rate: f32::NAN, ..none() },
            ),
            // With this rate, the generation of an image would take too long.
            (
                "false_positives_per_image",
                DetectorNoiseModel { false_positives_per_image: 1e9, ..none() },
            ),
            ("scores", DetectorNoiseModel { scores: [0.9, -0.1], ..none() }),
        ];
        for (key, noise) in wrong {
            let problem = noise.check().unwrap_err();
            assert!(problem.starts_with(key), "{problem}");
        }
    }
}
