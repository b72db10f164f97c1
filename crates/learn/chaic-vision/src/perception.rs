//! The detector as the perception of a mind: from color and depth to things with names of their own.

use std::sync::Arc;

use chaic_agents::perception::{Perception, Percepts, PixelKind, STRIDE, Segments};
use chaic_agents::sight::Sight;
use chaic_agents::track::{Hands, Intent, TrackId};
use chaic_core::geom::Camera;
use chaic_core::observation::{Grants, Senses};
use chaic_core::{Briefing, Observation, Outcome, Target};
use chaic_nn::Inference;

use crate::instances::Instance;
use crate::tracker::{Sighting, Tracker, TrackerRules};
use crate::trained::TrainedDetector;

/// Minds that see by a trained detector.
#[derive(Clone, Debug)]
pub struct LearnedSight {
    detector: Arc<TrainedDetector>,
    digest: String,
}

impl LearnedSight {
    /// By this one.
    pub fn new(detector: TrainedDetector) -> LearnedSight {
        let digest = detector.digest();
        LearnedSight { detector: Arc::new(detector), digest }
    }
}

impl Sight for LearnedSight {
    fn name(&self) -> Option<String> {
        Some(format!("learned {}", self.digest))
    }

    fn senses(&self) -> Senses {
        Senses { rgb: true, ids: false, ..Senses::DEPTH_AND_IDS }
    }

    fn grants(&self, asked: Grants) -> Grants {
        Grants { ids: false, ..asked }
    }

    fn perception(&self) -> Box<dyn Perception> {
        let inference = self.detector.inference();
        Box::new(LearnedPerception {
            detector: Arc::clone(&self.detector),
            inference,
            tracking: Tracking::default(),
        })
    }
}

/// Sees by a detector and keeps track of what it saw.
#[derive(Clone, Debug)]
struct LearnedPerception {
    detector: Arc<TrainedDetector>,
    inference: Inference,
    tracking: Tracking,
}

impl Perception for LearnedPerception {
    fn reset(&mut self, briefing: &Briefing) {
        self.tracking = Tracking::new(briefing);
    }

    fn feel(&mut self, hands: &Hands, last: Option<(Intent, Outcome)>) {
        self.tracking.tracker.feel(hands, last);
    }

    fn perceive(&mut self, observation: &Observation) -> Percepts {
        self.tracking.last.clear();
        let camera = &observation.camera;
        let images = &observation.images;
        let (Some(rgb), Some(depth_m)) = (images.rgb.as_ref(), images.depth_m.as_ref()) else {
            return Percepts::default();
        };
        let n_pixels = camera.width as usize * camera.height as usize;
        if !self.detector.fits(camera) || rgb.len() != 3 * n_pixels || depth_m.len() != n_pixels {
            return Percepts::default();
        }
        let found = self.detector.detect((rgb, depth_m, camera), &mut self.inference);
        self.tracking.take_in(&found, depth_m, observation)
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        self.tracking.target(track)
    }

    fn points(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}

/// Instances in one image after the other as things with names.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracking {
    pub(crate) tracker: Tracker,
    /// What the last image showed, and where.
    pub(crate) last: Vec<(TrackId, [u32; 2])>,
}

impl Tracking {
    pub(crate) fn new(briefing: &Briefing) -> Tracking {
        let tracker = Tracker::new(TrackerRules::default(), briefing);
        Tracking { tracker, last: Vec::new() }
    }

    pub(crate) fn take_in(
        &mut self,
        found: &[Instance],
        depth_m: &[f32],
        observation: &Observation,
    ) -> Percepts {
        let camera = &observation.camera;
        let (of_pixels, sightings) = measure(found, depth_m, camera);
        let at = (observation.frame, observation.own.pose);
        let (detections, mut kinds) = self.tracker.update(&sightings, at, (depth_m, camera));
        kinds.insert(0, PixelKind::Firm);
        let segments = Segments { of_pixels: &of_pixels, depth_m, camera, kinds: &kinds };
        let (_, mut dynamic_mask) = segments.measure();
        self.tracker.mask_own(at.1, (depth_m, camera), STRIDE, &mut dynamic_mask);
        self.last = detections.iter().map(|d| (d.track, d.pixel)).collect();
        Percepts { detections, dynamic_mask, stride: STRIDE, hands: None }
    }

    pub(crate) fn target(&self, track: TrackId) -> Option<Target> {
        let (_, [column, row]) = *self.last.iter().find(|(t, _)| *t == track)?;
        Some(Target::Pixel { column, row })
    }
}

/// The pixels of instances as segments, numbered from 1, and what each of them tells of its thing.
fn measure(found: &[Instance], depth_m: &[f32], camera: &Camera) -> (Vec<u16>, Vec<Sighting>) {
    let mut of_pixels = vec![0u16; depth_m.len()];
    for (k, instance) in found.iter().enumerate() {
        instance.pixels.iter().for_each(|p| of_pixels[*p as usize] = 1 + k as u16);
    }
    let kind = |instance: &Instance| {
        crate::labels::class_of(instance.label).map_or(PixelKind::Firm, PixelKind::of)
    };
    let kinds: Vec<PixelKind> =
        std::iter::once(PixelKind::Firm).chain(found.iter().map(kind)).collect();
    let segments = Segments { of_pixels: &of_pixels, depth_m, camera, kinds: &kinds };
    let (extents, _) = segments.measure();
    // Those without an extent are too small or too far off: nobody's pixels.
    let mut number = vec![0u16; found.len() + 1];
    let mut sightings = Vec::new();
    for (k, (instance, extent)) in found.iter().zip(extents.into_iter().skip(1)).enumerate() {
        if let Some(extent) = extent {
            let Instance { label, score, .. } = *instance;
            sightings.push(Sighting { label, score, extent });
            number[k + 1] = sightings.len() as u16;
        }
    }
    of_pixels.iter_mut().for_each(|of| *of = number[usize::from(*of)]);
    (of_pixels, sightings)
}
