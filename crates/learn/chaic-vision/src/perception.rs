//! Perception by the learned detector: from color and depth to tracked objects.

use std::collections::BTreeMap;
use std::sync::Arc;

use chaic_agents::perception::{Detection, Perception, Percepts, PixelKind, STRIDE, Segments};
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::track::{Hands, Intent, TrackId};
use chaic_core::geom::Camera;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Briefing, ClassId, EntityId, Observation, Outcome, Target};

use crate::instances::Instance;
use crate::keyframe::Keyframe;
use crate::labels::label_of;
use crate::tracker::{Measurement, Tracker, TrackerConfig};
use crate::trained::{DetectorInference, TrainedDetector};

/// Name of the perception with learned detections and ground-truth classes. It measures the cost of
/// wrong labels.
pub const GT_NAMES: &str = "gt_names";

/// Creates perception with a trained detector.
#[derive(Clone, Debug)]
pub struct LearnedPerceptionFactory {
    detector: Arc<TrainedDetector>,
    name: String,
    has_true_names: bool,
}

impl LearnedPerceptionFactory {
    /// Creates the factory for one detector.
    pub fn new(detector: TrainedDetector) -> LearnedPerceptionFactory {
        let name = format!("learned {}", detector.digest());
        LearnedPerceptionFactory { detector: Arc::new(detector), name, has_true_names: false }
    }

    /// Creates a factory that replaces the labels of each detection by the true class of most of
    /// its pixels, and drops detections of structure. It measures the cost of wrong labels.
    pub fn with_true_names(detector: TrainedDetector) -> LearnedPerceptionFactory {
        let name = format!("{GT_NAMES} {}", detector.digest());
        LearnedPerceptionFactory { detector: Arc::new(detector), name, has_true_names: true }
    }
}

impl PerceptionFactory for LearnedPerceptionFactory {
    fn name(&self) -> Option<String> {
        Some(self.name.clone())
    }

    fn sensors(&self) -> SensorConfig {
        SensorConfig { rgb: true, ids: self.has_true_names, ..SensorConfig::DEPTH_AND_IDS }
    }

    fn grants(&self, requested: Grants) -> Grants {
        // The granted state names objects by ids, which this perception cannot match to its tracks.
        Grants { ids: requested.ids && self.has_true_names, state: false, ..requested }
    }

    fn image_step(&self) -> u32 {
        self.detector.image_step()
    }

    fn perception(&self) -> Box<dyn Perception> {
        let inference = self.detector.inference();
        Box::new(LearnedPerception {
            detector: Arc::clone(&self.detector),
            inference,
            has_true_names: self.has_true_names,
            tracking: Tracking::default(),
            keyframe: None,
        })
    }
}

/// Detects objects in each image and tracks them.
#[derive(Clone, Debug)]
struct LearnedPerception {
    detector: Arc<TrainedDetector>,
    inference: DetectorInference,
    has_true_names: bool,
    tracking: Tracking,
    keyframe: Option<Keyframe>,
}

impl Perception for LearnedPerception {
    fn reset(&mut self, briefing: &Briefing) {
        self.tracking = Tracking::new(briefing);
        self.keyframe = None;
    }

    fn update_hands(&mut self, hands: &Hands, last: Option<(Intent, Outcome)>) {
        self.tracking.tracker.update_hands(hands, last);
    }

    /// Returns no detections if an image is missing or has another size.
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
        if let Some(keyframe) = self.keyframe.as_ref().filter(|k| k.is_similar(observation)) {
            let percepts = keyframe.reuse(observation, depth_m);
            self.tracking.reuse(&percepts.detections, depth_m, observation);
            return percepts;
        }
        let mut instances = self.detector.detect(rgb, depth_m, camera, &mut self.inference);
        if self.has_true_names {
            let ids = images.ids.as_deref().unwrap_or_default();
            instances = with_true_names(instances, ids, |id| observation.granted.class_of(id));
        }
        let percepts = self.tracking.update(&instances, depth_m, observation);
        self.keyframe = Some(Keyframe::new(observation, depth_m, &percepts.detections));
        percepts
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        self.tracking.target(track)
    }

    fn uses_pixel_targets(&self) -> bool {
        true
    }

    fn hides_ids(&self) -> bool {
        self.has_true_names
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}

/// Replaces the labels of each instance by the true class of most of its pixels, given an image of
/// ids. Drops instances of structure. Scores do not change.
pub fn with_true_names(
    instances: Vec<Instance>,
    ids: &[u16],
    class_of: impl Fn(EntityId) -> Option<ClassId>,
) -> Vec<Instance> {
    let named = instances.into_iter().filter_map(|instance| {
        let mut counts: BTreeMap<u16, usize> = BTreeMap::new();
        for id in instance.pixels.iter().filter_map(|pixel| ids.get(*pixel as usize)) {
            *counts.entry(*id).or_default() += 1;
        }
        let (id, _) = counts.into_iter().max_by_key(|(_, n)| *n)?;
        let label = label_of(Some(class_of(EntityId(id))?));
        Some(Instance { names: vec![(label, instance.score())], ..instance })
    });
    named.collect()
}

/// Tracks the detections of successive images.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tracking {
    pub(crate) tracker: Tracker,
    /// Tracks in the last image, each with one pixel: detected tracks, and missed tracks at their
    /// remembered position.
    pub(crate) last: Vec<(TrackId, [u32; 2])>,
}

impl Tracking {
    pub(crate) fn new(briefing: &Briefing) -> Tracking {
        let tracker = Tracker::new(TrackerConfig::default(), briefing);
        Tracking { tracker, last: Vec::new() }
    }

    pub(crate) fn update(
        &mut self,
        instances: &[Instance],
        depth_m: &[f32],
        observation: &Observation,
    ) -> Percepts {
        let camera = &observation.camera;
        let (segment_ids, measurements) = measure(instances, depth_m, camera);
        let (frame, pose) = (observation.frame, observation.proprioception.pose);
        let (detections, mut kinds) =
            self.tracker.update(&measurements, frame, pose, depth_m, camera);
        kinds.insert(0, PixelKind::Background);
        let segments = Segments { segment_ids: &segment_ids, depth_m, camera, kinds: &kinds };
        let (_, mut dynamic_mask) = segments.measure();
        self.tracker.mask_held(pose, depth_m, camera, STRIDE, &mut dynamic_mask);
        self.tracker.mask_movables(depth_m, camera, STRIDE, &mut dynamic_mask);
        self.last = detections.iter().map(|d| (d.track, d.pixel)).collect();
        self.last.extend(self.tracker.missed(frame, depth_m, camera));
        let retracted = self.tracker.take_retracted();
        Percepts { detections, dynamic_mask, stride: STRIDE, retracted, ..Percepts::default() }
    }

    /// Finds the pixels of the tracks in an image whose detections are those of a keyframe.
    fn reuse(&mut self, detections: &[Detection], depth_m: &[f32], observation: &Observation) {
        self.last = detections.iter().map(|d| (d.track, d.pixel)).collect();
        let (frame, camera) = (observation.frame, &observation.camera);
        self.last.extend(self.tracker.missed(frame, depth_m, camera));
    }

    pub(crate) fn target(&self, track: TrackId) -> Option<Target> {
        let (_, [column, row]) = *self.last.iter().find(|(t, _)| *t == track)?;
        Some(Target::Pixel { column, row })
    }
}

/// Assigns pixels to segments, numbered from 1, and measures the extent of each segment.
fn measure(
    instances: &[Instance],
    depth_m: &[f32],
    camera: &Camera,
) -> (Vec<u16>, Vec<Measurement>) {
    let mut segment_ids = vec![0u16; depth_m.len()];
    for (k, instance) in instances.iter().enumerate() {
        instance.pixels.iter().for_each(|p| segment_ids[*p as usize] = 1 + k as u16);
    }
    let kind = |instance: &Instance| {
        crate::labels::class_of(instance.label())
            .map_or(PixelKind::Background, PixelKind::from_class)
    };
    let kinds: Vec<PixelKind> =
        std::iter::once(PixelKind::Background).chain(instances.iter().map(kind)).collect();
    let segments = Segments { segment_ids: &segment_ids, depth_m, camera, kinds: &kinds };
    let (extents, _) = segments.measure();
    // Segments without an extent are too small or too far away and get no pixels.
    let mut segment_numbers = vec![0u16; instances.len() + 1];
    let mut measurements = Vec::new();
    for (k, (instance, extent)) in instances.iter().zip(extents.into_iter().skip(1)).enumerate() {
        if let Some(extent) = extent {
            measurements.push(Measurement { names: instance.names.clone(), extent });
            segment_numbers[k + 1] = measurements.len() as u16;
        }
    }
    segment_ids.iter_mut().for_each(|segment| *segment = segment_numbers[usize::from(*segment)]);
    (segment_ids, measurements)
}

#[cfg(test)]
mod tests {
    use chaic_core::Vec3;
    use chaic_core::geom::{Pose, yaw_rotation};
    use chaic_core::observation::{GrantedInfo, Images, Proprioception};

    use super::*;

    #[test]
    fn images_of_another_size_show_nothing() {
        let factory = LearnedPerceptionFactory::new(TrainedDetector::built_in());
        let refused = factory.check_image_size(65).unwrap_err();
        assert!(refused.contains("multiple of 32, not 65"), "{refused}");
        let observation = |[width, height]: [u32; 2], images: Images| Observation {
            frame: 0,
            proprioception: Proprioception {
                pose: Pose::default(),
                hands: [None, None],
                last: None,
                other_end: None,
            },
            camera: Camera {
                eye_in_world: Vec3::new(0.0, 1.6, 0.0),
                world_from_camera: yaw_rotation(0.0),
                vertical_fov_rad: Camera::EYE_FOV_RAD,
                width,
                height,
            },
            images,
            frame_history: Vec::new(),
            granted: GrantedInfo::default(),
        };
        let images = |n: usize, n_depth: usize| Images {
            rgb: Some(vec![100; 3 * n]),
            depth_m: Some(vec![2.0; n_depth]),
            ids: None,
        };
        let mut perception = factory.perception();
        for (size, images) in [
            ([65, 64], images(65 * 64, 65 * 64)),
            ([64, 64], images(64 * 64, 64 * 63)),
            ([64, 64], images(64 * 63, 64 * 64)),
            ([0, 0], images(0, 0)),
            ([64, 64], Images::default()),
        ] {
            let percepts = perception.perceive(&observation(size, images));
            assert!(percepts.detections.is_empty(), "{size:?}");
        }
    }

    #[test]
    fn true_names_are_those_of_most_pixels() {
        let instance = |pixels: &[u32]| Instance {
            names: vec![(label_of(Some(ClassId::named("banana"))), 0.7)],
            pixels: pixels.to_vec(),
            center: [0.0; 3],
        };
        let ids = [0, 0, 7, 7, 7, 0];
        let class_of = |id: EntityId| (id.0 == 7).then(|| ClassId::named("apple"));
        let named =
            with_true_names(vec![instance(&[1, 2, 3]), instance(&[0, 1, 4])], &ids, class_of);
        let apple = vec![(label_of(Some(ClassId::named("apple"))), 0.7)];
        assert_eq!(named, [Instance { names: apple, ..instance(&[1, 2, 3]) }]);
    }
}
