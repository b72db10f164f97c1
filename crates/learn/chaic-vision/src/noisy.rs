//! A stand-in for the detector: ground truth with faults at measured rates, for fast experiments.

use std::sync::Arc;

use chaic_agents::perception::{Perception, Percepts};
use chaic_agents::sight::Sight;
use chaic_agents::track::{Hands, Intent, TrackId};
use chaic_core::observation::{Grants, Senses};
use chaic_core::rng::Stream;
use chaic_core::{Briefing, ClassId, Observation, Outcome, Target};
use serde::{Deserialize, Serialize};

use crate::average_precision::{Detection, Image};
use crate::failures::TOLD_SCORE;
use crate::instances::Instance;
use crate::labels::label_of;
use crate::perception::Tracking;

/// Pixels of the images that rates are measured on.
const MEASURED_PX: usize = 512 * 512;

/// How often which fault is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultRates {
    /// Least pixels of 512x512 with the share of things of so many, up to the next row, that are missed; in
    /// the order of pixels. Fewer than the first row's are always missed. In smaller images things count as
    /// many pixels as they would have there.
    pub missed: Vec<(u32, f32)>,
    /// Share of what is found that is taken for another class of about its kind.
    pub misnamed: f32,
    /// Things that aren't there, for each image.
    pub invented: f32,
    /// Mean score of what is there, and of what isn't or has another name.
    pub scores: [f32; 2],
}

impl FaultRates {
    /// No fault at all.
    pub fn none() -> FaultRates {
        FaultRates { missed: vec![(5, 0.0)], misnamed: 0.0, invented: 0.0, scores: [1.0, 0.5] }
    }

    /// Those of the shipped detector (crates/learn/chaic-vision/weights).
    pub fn built_in() -> FaultRates {
        let text = include_bytes!("../weights/faults.json");
        serde_json::from_slice(text).expect("a test reads it")
    }

    /// Those of a detector, by what it told in images.
    pub fn measured(images: &[Image]) -> FaultRates {
        /// Rows of [`FaultRates::missed`], pixels.
        const LEAST_PX: [u32; 6] = [24, 64, 100, 400, 1000, 5000];
        let share = |n: usize, of: usize| n as f32 / of.max(1) as f32;
        let mut by_size = [[0usize; 2]; LEAST_PX.len()];
        let (mut n_found, mut n_misnamed, mut n_invented) = (0, 0, 0);
        let mut scores = [(0.0f32, 0usize); 2];
        for image in images {
            let told: Vec<_> = image.detections.iter().filter(|d| d.score >= TOLD_SCORE).collect();
            for (t, truth) in image.truths.iter().enumerate() {
                let Some(row) = LEAST_PX.iter().rposition(|px| truth.area >= *px) else { continue };
                let overlaps = |d: &&&Detection| 3 * d.shared[t] >= truth.area + d.area;
                let mut covering: Vec<_> = told.iter().filter(overlaps).collect();
                covering.sort_by_key(|d| d.label != truth.label);
                by_size[row][1] += 1;
                by_size[row][0] += usize::from(covering.is_empty());
                let Some(best) = covering.first() else { continue };
                let is_misnamed = best.label != truth.label;
                n_found += 1;
                n_misnamed += usize::from(is_misnamed);
                let (sum, n) = &mut scores[usize::from(is_misnamed)];
                (*sum, *n) = (*sum + best.score, *n + 1);
            }
            let invented = told.iter().filter(|d| d.shared.iter().all(|s| 5 * s < d.area));
            for detection in invented {
                n_invented += 1;
                let (sum, n) = &mut scores[1];
                (*sum, *n) = (*sum + detection.score, *n + 1);
            }
        }
        let rows = LEAST_PX.into_iter().zip(by_size);
        FaultRates {
            missed: rows.map(|(px, [missed, all])| (px, share(missed, all))).collect(),
            misnamed: share(n_misnamed, n_found),
            invented: share(n_invented, images.len()),
            scores: scores.map(|(sum, n)| if n == 0 { TOLD_SCORE } else { sum / n as f32 }),
        }
    }

    /// The share that is missed of things of so many pixels in an image of so many.
    fn missed(&self, n_pixels: usize, of: usize) -> f32 {
        let n_pixels = n_pixels * MEASURED_PX / of;
        let row = self.missed.iter().rev().find(|(least, _)| n_pixels >= *least as usize);
        row.map_or(1.0, |(_, share)| *share)
    }
}

/// Minds that see by ground truth with faults.
#[derive(Clone, Debug)]
pub struct NoisySight {
    rates: Arc<FaultRates>,
    name: String,
}

impl NoisySight {
    /// With these faults, under this name.
    pub fn new(rates: FaultRates, name: String) -> NoisySight {
        NoisySight { rates: Arc::new(rates), name }
    }
}

impl Sight for NoisySight {
    fn name(&self) -> Option<String> {
        Some(self.name.clone())
    }

    fn senses(&self) -> Senses {
        Senses::DEPTH_AND_IDS
    }

    fn grants(&self, asked: Grants) -> Grants {
        asked
    }

    fn perception(&self) -> Box<dyn Perception> {
        let rates = Arc::clone(&self.rates);
        Box::new(NoisyPerception { rates, tracking: Tracking::default(), seed: 0 })
    }
}

#[derive(Clone, Debug)]
struct NoisyPerception {
    rates: Arc<FaultRates>,
    tracking: Tracking,
    seed: u64,
}

impl NoisyPerception {
    /// The instances in an image with known ids, with faults.
    fn instances(&self, ids: &[u16], observation: &Observation) -> Vec<Instance> {
        let mut rng = Stream::new(self.seed, "faults of perception", u64::from(observation.frame));
        let classes = &observation.granted.classes;
        let mut pixels: Vec<Vec<u32>> = vec![Vec::new(); classes.len()];
        let n = classes.last().map_or(0, |(entity, _)| usize::from(entity.0) + 1);
        let mut row_of = vec![usize::MAX; n];
        classes.iter().enumerate().for_each(|(k, (entity, _))| row_of[usize::from(entity.0)] = k);
        for (k, id) in ids.iter().enumerate() {
            let row = row_of.get(usize::from(*id)).and_then(|row| pixels.get_mut(*row));
            row.into_iter().for_each(|pixels| pixels.push(k as u32));
        }
        let mut found = Vec::new();
        let [sure, unsure] = self.rates.scores;
        for ((_, class), pixels) in classes.iter().zip(pixels) {
            if rng.chance(self.rates.missed(pixels.len(), ids.len())) {
                continue;
            }
            let others: Vec<ClassId> =
                ClassId::all().filter(|c| c.info().role == class.info().role).collect();
            let (class, score) = match rng.choose(&others) {
                Some(other) if rng.chance(self.rates.misnamed) => (*other, unsure),
                _ => (*class, sure),
            };
            let label = label_of(Some(class));
            found.push(Instance { label, score, pixels, middle: [0.0; 3] });
        }
        let (width, height) = (observation.camera.width, observation.camera.height);
        let classes: Vec<ClassId> = ClassId::all().filter(|c| c.info().is_carriable()).collect();
        while rng.chance(self.rates.invented / (1.0 + self.rates.invented)) {
            /// Side of what is invented, pixels.
            const SIDE: u32 = 12;
            let Some(class) = rng.choose(&classes) else { break };
            let [x, y] = [width, height].map(|n| rng.below((n - SIDE) as usize) as u32);
            let row = |y: u32| (y * width + x..y * width + x + SIDE).collect::<Vec<u32>>();
            let pixels = (y..y + SIDE).flat_map(row).collect();
            let label = label_of(Some(*class));
            found.push(Instance { label, score: unsure, pixels, middle: [0.0; 3] });
        }
        found
    }
}

impl Perception for NoisyPerception {
    fn reset(&mut self, briefing: &Briefing) {
        (self.tracking, self.seed) = (Tracking::new(briefing), briefing.seed);
    }

    fn feel(&mut self, hands: &Hands, last: Option<(Intent, Outcome)>) {
        self.tracking.tracker.feel(hands, last);
    }

    fn perceive(&mut self, observation: &Observation) -> Percepts {
        self.tracking.last.clear();
        let images = &observation.images;
        let n_pixels = observation.camera.width as usize * observation.camera.height as usize;
        match (&images.ids, &images.depth_m) {
            (Some(ids), Some(depth_m)) if ids.len() == n_pixels && depth_m.len() == n_pixels => {
                let found = self.instances(ids, observation);
                self.tracking.take_in(&found, depth_m, observation)
            }
            _ => Percepts::default(),
        }
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        self.tracking.target(track)
    }

    fn points(&self) -> bool {
        true
    }

    fn hides_ids(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}
