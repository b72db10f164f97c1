//! What is in the image: detections, and which pixels tell nothing of the room.

mod segments;

use chaic_core::observation::Identity;
use chaic_core::{AgentId, Briefing, ClassId, EntityId, Observation, Outcome, Target, Vec2, Vec3};

use crate::track::{Carried, Hands, Intent, TrackId};

pub(crate) use segments::Rays;
pub use segments::{Extent, MIN_PIXELS, PixelKind, STRIDE, Segments};

/// One thing seen in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// The same thing has the same track in all images.
    pub track: TrackId,
    /// Its class.
    pub class: ClassId,
    /// Whose body it is, for people.
    pub person: Option<AgentId>,
    /// Column and row of a pixel that shows it.
    pub pixel: [u32; 2],
    /// Mean of its visible points, metres.
    pub position_in_world: Vec3,
    /// Height of its lowest visible point, metres.
    pub bottom_m: f32,
    /// Height of its highest visible point, metres.
    pub top_m: f32,
    /// How many pixels show it.
    pub n_pixels: u32,
    /// Its visible points seen from above (x, z), at most one per 0.125 m square.
    pub footprint: Vec<Vec2>,
}

impl Detection {
    /// A thing of this extent.
    pub fn new(
        track: TrackId,
        class: ClassId,
        person: Option<AgentId>,
        extent: Extent,
    ) -> Detection {
        let Extent { pixel, position_in_world, bottom_m, top_m, n_pixels, footprint } = extent;
        Detection {
            track,
            class,
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

/// What one image shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Percepts {
    /// The things seen, in the order of their names.
    pub detections: Vec<Detection>,
    /// Pixels that say nothing of what stands firmly in the room: own burden, people, and whatever
    /// can be carried or moved. Bool, shape [height / stride, width / stride] rounded up.
    pub dynamic_mask: Vec<bool>,
    /// Which pixels `dynamic_mask` samples: every how many rows and columns.
    pub stride: u32,
    /// What the own hands hold, if perception can tell; otherwise the mind keeps account of what it
    /// saw itself take.
    pub hands: Option<Hands>,
}

/// Turns images into detections.
pub trait Perception: Send {
    /// Begins an episode.
    fn reset(&mut self, _briefing: &Briefing) {}

    /// Is told before it looks what the own hands hold, as far as their owner knows, and how the last
    /// action ended.
    fn feel(&mut self, _hands: &Hands, _last: Option<(Intent, Outcome)>) {}

    /// Looks at one observation. Images that are missing show nothing.
    fn perceive(&mut self, observation: &Observation) -> Percepts;

    /// How an action can name this thing now; `None` if it can't, because the thing is not in the
    /// image looked at last.
    fn target(&self, track: TrackId) -> Option<Target>;

    /// Whether things must be in the image to be named, so that actions need them in view.
    fn points(&self) -> bool {
        false
    }

    /// Whether ids reach nobody but the perception itself, which makes something worse of them.
    fn hides_ids(&self) -> bool {
        false
    }

    /// A copy that goes on as this one would.
    fn fork(&self) -> Box<dyn Perception>;
}

/// Perfect segmentation, classification and association; needs [`Grants::ids`].
///
/// [`Grants::ids`]: chaic_core::observation::Grants
#[derive(Clone, Debug, Default)]
pub struct GroundTruthIds;

/// Names things by pixels of the last image instead of whatever the perception within would use:
/// for minds that see perfectly and act as if they were granted no ids.
#[derive(Clone, Debug, Default)]
pub struct Pointing<P> {
    /// What does the seeing.
    pub inner: P,
    last: Vec<(TrackId, [u32; 2])>,
}

impl<P: Perception + Clone + 'static> Perception for Pointing<P> {
    fn perceive(&mut self, observation: &Observation) -> Percepts {
        let percepts = self.inner.perceive(observation);
        self.last = percepts.detections.iter().map(|d| (d.track, d.pixel)).collect();
        percepts
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        let (_, [column, row]) = *self.last.iter().find(|(t, _)| *t == track)?;
        Some(Target::Pixel { column, row })
    }

    fn points(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(self.clone())
    }
}

impl GroundTruthIds {
    /// How each entity is looked at, by entity number.
    fn kinds(observation: &Observation) -> Option<Vec<PixelKind>> {
        let classes = &observation.granted.classes;
        let n = usize::from(classes.last()?.0.0) + 1;
        let mut kinds = vec![PixelKind::Firm; n];
        for (entity, class) in classes {
            kinds[usize::from(entity.0)] = PixelKind::of(*class);
        }
        let own = observation.own.held().filter_map(|held| held.identity.as_ref());
        let own = own
            .flat_map(|it| std::iter::once(it.entity).chain(it.contents.iter().map(|(e, _)| *e)));
        for entity in own {
            if let Some(kind) = kinds.get_mut(usize::from(entity.0)) {
                *kind = PixelKind::Own;
            }
        }
        Some(kinds)
    }

    /// What the hands hold, as the grant of ids tells.
    fn hands(observation: &Observation) -> Option<Hands> {
        let own = &observation.own;
        let is_told = own.held().all(|held| held.identity.is_some());
        let carried = |it: &Identity| Carried {
            what: Some((it.entity.into(), it.class)),
            contents: it.contents.iter().map(|(e, class)| ((*e).into(), *class)).collect(),
            n_contents: it.contents.len() as u32,
        };
        is_told.then(|| Hands {
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
        // An image without any object shows structure alone.
        let kinds = GroundTruthIds::kinds(observation).unwrap_or_default();
        if ids.len() != width * height || depth.len() != width * height {
            return Percepts { hands, ..Percepts::default() };
        }
        let camera = &observation.camera;
        let segments = Segments { of_pixels: ids, depth_m: depth, camera, kinds: &kinds };
        let (extents, dynamic_mask) = segments.measure();
        let detection = |(i, extent): (usize, Option<Extent>)| {
            let entity = EntityId(i as u16);
            let class = observation.granted.class_of(entity)?;
            Some(Detection::new(entity.into(), class, entity.agent(), extent?))
        };
        let detections = extents.into_iter().enumerate().filter_map(detection).collect();
        Percepts { detections, dynamic_mask, stride: STRIDE, hands }
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
    fn a_detection_is_where_the_object_is_and_knows_how_high_it_is() {
        let mut toy = Toy::room(6.0, 6.0);
        let apple = toy.add(ToyObject::new("apple", [1.0, 0.5, -2.0], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let percepts = GroundTruthIds.perceive(&toy.observe());
        let seen = percepts.detections.iter().find(|d| d.track == apple).expect("it is in view");
        assert_eq!(seen.class.name(), "apple");
        assert!((seen.position_in_world - Vec3::new(0.95, 0.65, -1.9)).length() < 0.12, "{seen:?}");
        assert!((seen.top_m - 0.7).abs() < 0.03, "{}", seen.top_m);
        assert_eq!(percepts.dynamic_mask.len(), toy.pixels().div_ceil(4) as usize);
    }

    #[test]
    fn what_is_behind_or_too_small_is_not_seen() {
        let mut toy = Toy::room(20.0, 20.0);
        let behind = toy.add(ToyObject::new("apple", [0.0, 0.5, 2.0], [0.2, 0.2, 0.2]));
        let speck = toy.add(ToyObject::new("apple", [0.0, 1.6, -8.0], [0.02, 0.02, 0.02]));
        toy.stand([0.0, 0.0], 0.0);
        let percepts = GroundTruthIds.perceive(&toy.observe());
        assert!(percepts.detections.iter().all(|d| d.track != behind && d.track != speck));
    }

    #[test]
    fn objects_are_seen_up_to_ten_metres_off_and_people_from_anywhere() {
        for (z, is_seen) in [(-8.0, true), (-14.0, false)] {
            let mut toy = Toy::room(40.0, 40.0);
            let bed = toy.add(ToyObject::new("bed", [2.0, 0.0, z], [1.6, 1.0, 1.6]));
            let partner = toy.add_person(AgentId::PARTNER, [-2.0, z]);
            toy.stand([0.0, 0.0], 0.0);
            let seen = GroundTruthIds.perceive(&toy.observe()).detections;
            let sees = |track| seen.iter().any(|d| d.track == track);
            assert_eq!((sees(bed), sees(partner)), (is_seen, true), "{z} m off");
        }
    }

    #[test]
    fn the_own_burden_is_loose_and_no_detection() {
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
