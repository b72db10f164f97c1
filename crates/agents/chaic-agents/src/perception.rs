//! Perception: detections, and the pixels of an image that do not show static structure.

mod segments;

use chaic_core::observation::HeldIdentity;
use chaic_core::{AgentId, Briefing, ClassId, EntityId, Observation, Outcome, Target, Vec2, Vec3};

use crate::track::{CarriedObject, Hands, Intent, TrackId};

pub(crate) use segments::Rays;
pub use segments::{MIN_PIXELS, OBJECT_RANGE_M, PixelKind, STRIDE, SegmentMeasurement, Segments};

/// Object detected in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Track; the same object has the same track in all images.
    pub track: TrackId,
    /// Class of the object.
    pub class: ClassId,
    /// Probability that the object exists and has this class.
    pub confidence: f32,
    /// The person's agent id, for people.
    pub person: Option<AgentId>,
    /// Column and row of a pixel that shows it.
    pub pixel: [u32; 2],
    /// Mean of its visible points, meters.
    pub position_in_world: Vec3,
    /// Height of its lowest visible point, meters.
    pub bottom_m: f32,
    /// Height of its highest visible point, meters.
    pub top_m: f32,
    /// Number of pixels that show it.
    pub n_pixels: u32,
    /// Visible points from above (x, z), at most one per 0.125 m square.
    pub footprint: Vec<Vec2>,
}

impl Detection {
    /// Creates a certain detection from a measured segment.
    pub fn new(
        track: TrackId,
        class: ClassId,
        person: Option<AgentId>,
        measurement: SegmentMeasurement,
    ) -> Detection {
        let SegmentMeasurement { pixel, position_in_world, bottom_m, top_m, n_pixels, footprint } =
            measurement;
        Detection {
            track,
            class,
            confidence: 1.0,
            person,
            pixel,
            position_in_world,
            bottom_m,
            top_m,
            n_pixels,
            footprint,
        }
    }
}

/// Result of perceiving one image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Percepts {
    /// Detected objects, in the order of their tracks.
    pub detections: Vec<Detection>,
    /// Pixels that do not show static structure: carried objects, people, and everything portable
    /// or movable. Bool, shape [height / stride, width / stride] rounded up.
    pub dynamic_mask: Vec<bool>,
    /// Spacing of the rows and columns that `dynamic_mask` samples.
    pub stride: u32,
    /// Objects in the agent's hands, if perception knows them; otherwise the memory infers them
    /// from the agent's actions.
    pub hands: Option<Hands>,
    /// True if the image was not searched for objects, and the detections are those of an earlier
    /// image. A missing detection then means nothing.
    pub is_reused: bool,
    /// Tracks of earlier detections whose objects probably do not exist.
    pub retracted: Vec<TrackId>,
}

/// Turns images into detections.
pub trait Perception: Send {
    /// Starts an episode.
    fn reset(&mut self, _briefing: &Briefing) {}

    /// Receives, before each image, the objects in the agent's hands as far as known, and the
    /// outcome of the last action.
    fn update_hands(&mut self, _hands: &Hands, _last: Option<(Intent, Outcome)>) {}

    /// Processes one observation. Missing images yield no detections.
    fn perceive(&mut self, observation: &Observation) -> Percepts;

    /// Returns the target by which an action refers to this object; `None` if the object is not in
    /// the last image.
    fn target(&self, track: TrackId) -> Option<Target>;

    /// Returns whether actions can refer only to objects in the image. Interactions then require
    /// the object in view.
    fn uses_pixel_targets(&self) -> bool {
        false
    }

    /// Returns whether only the perception sees ids, which it uses to imitate detection errors.
    fn hides_ids(&self) -> bool {
        false
    }

    /// Returns a copy that continues identically.
    fn fork(&self) -> Box<dyn Perception>;
}

/// Perfect segmentation, classification and association; requires [`Grants::ids`].
///
/// [`Grants::ids`]: chaic_core::observation::Grants
#[derive(Clone, Debug, Default)]
pub struct GroundTruthIds;

/// Names objects by pixels of the last image instead of the wrapped perception's targets. Used for
/// agents with perfect perception that act as if no ids were granted.
#[derive(Clone, Debug, Default)]
pub struct PixelTargets<P> {
    /// The wrapped perception.
    pub inner: P,
    last: Vec<(TrackId, [u32; 2])>,
}

impl<P: Perception + Clone + 'static> Perception for PixelTargets<P> {
    fn reset(&mut self, briefing: &Briefing) {
        self.inner.reset(briefing);
        self.last.clear();
    }

    fn update_hands(&mut self, hands: &Hands, last: Option<(Intent, Outcome)>) {
        self.inner.update_hands(hands, last);
    }

    fn perceive(&mut self, observation: &Observation) -> Percepts {
        let percepts = self.inner.perceive(observation);
        self.last = percepts.detections.iter().map(|d| (d.track, d.pixel)).collect();
        percepts
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        let (_, [column, row]) = *self.last.iter().find(|(t, _)| *t == track)?;
        Some(Target::Pixel { column, row })
    }

    fn uses_pixel_targets(&self) -> bool {
        true
    }

    fn hides_ids(&self) -> bool {
        self.inner.hides_ids()
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}

impl GroundTruthIds {
    /// Returns the pixel kind of each entity, by entity id.
    fn kinds(observation: &Observation) -> Option<Vec<PixelKind>> {
        let classes = &observation.granted.classes;
        let n = usize::from(classes.last()?.0.0) + 1;
        let mut kinds = vec![PixelKind::Background; n];
        for (entity, class) in classes {
            kinds[usize::from(entity.0)] = PixelKind::from_class(*class);
        }
        let own = observation.proprioception.held().filter_map(|held| held.identity.as_ref());
        let own = own.flat_map(|held| {
            std::iter::once(held.entity).chain(held.contents.iter().map(|(e, _)| *e))
        });
        for entity in own {
            if let Some(kind) = kinds.get_mut(usize::from(entity.0)) {
                *kind = PixelKind::Carried;
            }
        }
        Some(kinds)
    }

    /// Returns the objects in the hands from the grant of ids.
    fn hands(observation: &Observation) -> Option<Hands> {
        let own = &observation.proprioception;
        let is_granted = own.held().all(|held| held.identity.is_some());
        let carried = |held: &HeldIdentity| CarriedObject {
            object: Some((held.entity.into(), held.class)),
            contents: held.contents.iter().map(|(e, class)| ((*e).into(), *class)).collect(),
            n_contents: held.contents.len() as u32,
        };
        is_granted.then(|| Hands {
            hands: [0, 1].map(|k| own.hands[k].as_ref()?.identity.as_ref().map(carried)),
            is_joint: own.held().any(|h| h.in_both_hands),
        })
    }
}

impl Perception for GroundTruthIds {
    fn perceive(&mut self, observation: &Observation) -> Percepts {
        let (width, height) =
            (observation.camera.width as usize, observation.camera.height as usize);
        let images = &observation.images;
        let hands = GroundTruthIds::hands(observation);
        let (Some(ids), Some(depth)) = (images.ids.as_ref(), images.depth_m.as_ref()) else {
            return Percepts { hands, ..Percepts::default() };
        };
        // An image without any object shows structure only.
        let kinds = GroundTruthIds::kinds(observation).unwrap_or_default();
        if ids.len() != width * height || depth.len() != width * height {
            return Percepts { hands, ..Percepts::default() };
        }
        let camera = &observation.camera;
        let segments = Segments { segment_ids: ids, depth_m: depth, camera, kinds: &kinds };
        let (measurements, dynamic_mask) = segments.measure();
        let detection = |(i, measurement): (usize, Option<SegmentMeasurement>)| {
            let entity = EntityId(i as u16);
            let class = observation.granted.class_of(entity)?;
            Some(Detection::new(entity.into(), class, entity.agent(), measurement?))
        };
        let detections = measurements.into_iter().enumerate().filter_map(detection).collect();
        Percepts { detections, dynamic_mask, stride: STRIDE, hands, ..Percepts::default() }
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        u16::try_from(track.0).ok().map(|e| Target::Entity(EntityId(e)))
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Toy, ToyObject};
    use chaic_core::AgentId;

    #[test]
    fn a_detection_has_the_position_and_height_of_its_object() {
        let mut toy = Toy::room(6.0, 6.0);
        let apple = toy.add(ToyObject::new("apple", [1.0, 0.5, -2.0], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let percepts = GroundTruthIds.perceive(&toy.observe());
        let detection =
            percepts.detections.iter().find(|d| d.track == apple).expect("it is in view");
        assert_eq!(detection.class.name(), "apple");
        assert!(
            (detection.position_in_world - Vec3::new(0.95, 0.65, -1.9)).length() < 0.12,
            "{detection:?}"
        );
        assert!((detection.top_m - 0.7).abs() < 0.03, "{}", detection.top_m);
        assert_eq!(percepts.dynamic_mask.len(), toy.pixels().div_ceil(4) as usize);
    }

    #[test]
    fn objects_behind_the_camera_or_too_small_are_not_detected() {
        let mut toy = Toy::room(20.0, 20.0);
        let behind = toy.add(ToyObject::new("apple", [0.0, 0.5, 2.0], [0.2, 0.2, 0.2]));
        let small = toy.add(ToyObject::new("apple", [0.0, 1.6, -8.0], [0.02, 0.02, 0.02]));
        toy.stand([0.0, 0.0], 0.0);
        let percepts = GroundTruthIds.perceive(&toy.observe());
        assert!(percepts.detections.iter().all(|d| d.track != behind && d.track != small));
    }

    #[test]
    fn objects_are_detected_up_to_ten_meters_and_people_at_any_distance() {
        for (z, is_seen) in [(-8.0, true), (-14.0, false)] {
            let mut toy = Toy::room(40.0, 40.0);
            let bed = toy.add(ToyObject::new("bed", [2.0, 0.0, z], [1.6, 1.0, 1.6]));
            let partner = toy.add_person(AgentId::PARTNER, [-2.0, z]);
            toy.stand([0.0, 0.0], 0.0);
            let detections = GroundTruthIds.perceive(&toy.observe()).detections;
            let sees = |track| detections.iter().any(|d| d.track == track);
            assert_eq!((sees(bed), sees(partner)), (is_seen, true), "at {z} m");
        }
    }

    #[test]
    fn a_carried_object_is_dynamic_and_not_detected() {
        let mut toy = Toy::room(6.0, 6.0);
        let apple = toy.add(ToyObject::new("apple", [0.0, 1.0, -0.6], [0.3, 0.3, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let before = GroundTruthIds.perceive(&toy.observe());
        assert!(before.detections.iter().any(|d| d.track == apple));
        toy.hold(0, apple);
        let after = GroundTruthIds.perceive(&toy.observe());
        assert!(after.detections.iter().all(|d| d.track != apple));
    }
}
