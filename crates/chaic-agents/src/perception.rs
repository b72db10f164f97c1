//! What is in the image: detections, and which pixels tell nothing of the room.

use chaic_protocol::observation::Identity;
use chaic_protocol::{AgentId, ClassId, EntityId, Observation, Role, Target, Vec2, Vec3};

use crate::track::{Carried, Hands, TrackId};

/// Fewer pixels than this are no detection (facts A1.8).
pub const MIN_PIXELS: u32 = 5;
/// Every how many rows and columns it is looked at what says nothing of the room.
pub const STRIDE: u32 = 2;
/// A row of an image is measured at so many points at least, as far as large things go: at 5 m they
/// are 8 cm apart then, less than points of a footprint.
const MEASURED_PER_ROW: usize = 128;
/// Points farther than this say nothing of where an object is, metres (facts A1.1).
const OBJECT_RANGE_M: f32 = 10.0;
/// People are seen from anywhere (facts A1.8: whoever is in the image is placed where it is).
const PERSON_RANGE_M: f32 = f32::INFINITY;
/// Points higher than this belong to no footprint: nobody bumps into them, metres.
const FOOTPRINT_HEIGHT_M: f32 = 2.0;
/// Spacing of footprint points, metres.
const FOOTPRINT_M: f32 = 0.125;

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
    /// Looks at one observation. Images that are missing show nothing.
    fn perceive(&mut self, observation: &Observation) -> Percepts;

    /// How an action can name this thing now; `None` if it can't, because the thing is not in the
    /// image looked at last.
    fn target(&self, track: TrackId) -> Option<Target>;

    /// Whether things must be in the image to be named, so that actions need them in view.
    fn points(&self) -> bool {
        false
    }

    /// A copy that goes on as this one would.
    fn fork(&self) -> Box<dyn Perception>;
}

/// Perfect segmentation, classification and association; needs [`Grants::ids`].
///
/// [`Grants::ids`]: chaic_protocol::observation::Grants
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

#[derive(Clone, Copy, PartialEq)]
enum PixelKind {
    /// Structure, or something that is not to be reported.
    Firm,
    /// Own burden.
    Own,
    /// Small: every pixel counts.
    Small,
    /// Large and movable, or a person.
    Dynamic,
    /// Large and fixed.
    Fixed,
}

impl PixelKind {
    fn of(entity: EntityId, class: Option<ClassId>) -> PixelKind {
        match class.map(|c| c.info().role) {
            _ if entity.agent().is_some() => PixelKind::Dynamic,
            Some(Role::Target | Role::Container | Role::Fragile) => PixelKind::Small,
            Some(Role::Obstacle | Role::HeavyTarget | Role::Vehicle | Role::Person) => {
                PixelKind::Dynamic
            }
            Some(Role::Furnishing) => PixelKind::Fixed,
            None => PixelKind::Firm,
        }
    }
}

/// Sums over the pixels of one thing.
struct Tally {
    n_pixels: u32,
    n_points: u32,
    sum: Vec3,
    low: f32,
    high: f32,
    squares: Vec<[i16; 2]>,
    /// The longest run of pixels, and its middle.
    longest: u32,
    pixel: [u32; 2],
}

impl Tally {
    const NEW: Tally = Tally {
        longest: 0,
        pixel: [0, 0],
        n_pixels: 0,
        n_points: 0,
        sum: Vec3::ZERO,
        low: f32::INFINITY,
        high: f32::NEG_INFINITY,
        squares: Vec::new(),
    };

    #[inline(always)]
    fn add(&mut self, p: Vec3) {
        self.n_points += 1;
        self.sum += p;
        self.low = self.low.min(p.y);
        self.high = self.high.max(p.y);
        if p.y <= FOOTPRINT_HEIGHT_M {
            let square = [nearest_whole(p.x / FOOTPRINT_M), nearest_whole(p.z / FOOTPRINT_M)];
            if self.squares.last() != Some(&square) {
                self.squares.push(square);
            }
        }
    }

    #[inline(always)]
    fn run(&mut self, row: usize, from: usize, end: usize) {
        let n = (end - from) as u32;
        self.n_pixels += n;
        if n > self.longest {
            self.longest = n;
            self.pixel = [(from + end) as u32 / 2, row as u32];
        }
    }

    fn detection(mut self, entity: EntityId, class: ClassId) -> Detection {
        self.squares.sort_unstable();
        self.squares.dedup();
        Detection {
            track: entity.into(),
            class,
            person: entity.agent(),
            pixel: self.pixel,
            position_in_world: self.sum / self.n_points as f32,
            bottom_m: self.low,
            top_m: self.high,
            n_pixels: self.n_pixels,
            footprint: self
                .squares
                .iter()
                .map(|s| FOOTPRINT_M * Vec2::new(f32::from(s[0]), f32::from(s[1])))
                .collect(),
        }
    }
}

/// Rounds half away from zero, as `f32::round` does in a call to the C library for every point.
#[inline(always)]
fn nearest_whole(x: f32) -> i16 {
    let x = x.clamp(-40_000.0, 40_000.0);
    let whole = x as i32;
    let rest = x - whole as f32;
    let whole = whole + i32::from(rest >= 0.5) - i32::from(rest <= -0.5);
    whole.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
}

/// How many of the first ids are the same.
#[inline(always)]
fn run_length(ids: &[u16]) -> usize {
    const AT_ONCE: usize = 32;
    let Some(first) = ids.first() else { return 0 };
    let same = |chunk: &&[u16]| chunk.iter().fold(true, |same, id| same & (id == first));
    let n = AT_ONCE * ids.chunks_exact(AT_ONCE).take_while(same).count();
    n + ids[n..].iter().take_while(|id| *id == first).count()
}

/// Directions through pixel centers per metre of depth: the world point of a pixel is
/// `eye + depth * (column + row)`.
pub(crate) struct Rays {
    pub eye: Vec3,
    pub columns: Vec<Vec3>,
    pub rows: Vec<Vec3>,
}

impl Rays {
    pub(crate) fn new(camera: &chaic_protocol::geom::Camera) -> Rays {
        let rotation = camera.rotation();
        let f = camera.focal_px();
        let (half_w, half_h) = (0.5 * camera.width as f32, 0.5 * camera.height as f32);
        Rays {
            eye: camera.eye_in_world,
            columns: (0..camera.width)
                .map(|c| rotation.x_axis * ((c as f32 + 0.5 - half_w) / f))
                .collect(),
            rows: (0..camera.height)
                .map(|r| -rotation.y_axis * ((r as f32 + 0.5 - half_h) / f) - rotation.z_axis)
                .collect(),
        }
    }

    #[inline(always)]
    pub(crate) fn point(&self, column: usize, row: usize, depth_m: f32) -> Vec3 {
        self.eye + depth_m * (self.columns[column] + self.rows[row])
    }
}

/// A walk over the pixels of one image, compiled for vectors of each width: the sums over each thing,
/// and [`Percepts::dynamic_mask`].
struct Measure<'a> {
    ids: &'a [u16],
    depth: &'a [f32],
    width: usize,
    kinds: &'a [PixelKind],
    rays: &'a Rays,
}

impl pulp::NullaryFnOnce for Measure<'_> {
    type Output = (Vec<Tally>, Vec<bool>);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Measure { ids, depth, width, kinds, rays } = self;
        let height = rays.rows.len();
        let stride = STRIDE as usize;
        let coarse_stride = (width / MEASURED_PER_ROW).max(stride);
        let mut tallies: Vec<Tally> = kinds.iter().map(|_| Tally::NEW).collect();
        let sampled_width = width.div_ceil(stride);
        let mut dynamic_mask = vec![false; sampled_width * height.div_ceil(stride)];
        for row in 0..height {
            let (ids, depth) = (&ids[row * width..][..width], &depth[row * width..][..width]);
            let on_row = row % stride == 0;
            let mut end = 0;
            while end < width {
                let from = end;
                end += run_length(&ids[from..]);
                let id = usize::from(ids[from]);
                let kind = kinds.get(id).copied().unwrap_or(PixelKind::Firm);
                if on_row && !matches!(kind, PixelKind::Firm | PixelKind::Fixed) {
                    let sampled = from.div_ceil(stride)..end.div_ceil(stride);
                    dynamic_mask[row / stride * sampled_width..][sampled].fill(true);
                }
                if matches!(kind, PixelKind::Firm | PixelKind::Own) {
                    continue;
                }
                let tally = &mut tallies[id];
                tally.run(row, from, end);
                let is_person = EntityId(id as u16).agent().is_some();
                let range_m = if is_person { PERSON_RANGE_M } else { OBJECT_RANGE_M };
                let mut add = |column: usize| {
                    if depth[column] < range_m {
                        tally.add(rays.point(column, row, depth[column]));
                    }
                };
                if kind == PixelKind::Small {
                    (from..end).for_each(add);
                } else if row % coarse_stride == 0 {
                    let first = from.next_multiple_of(coarse_stride);
                    (first..end).step_by(coarse_stride).for_each(&mut add);
                }
            }
        }
        (tallies, dynamic_mask)
    }
}

impl GroundTruthIds {
    /// How each entity is looked at, by entity number.
    fn kinds(observation: &Observation) -> Option<Vec<PixelKind>> {
        let classes = &observation.granted.classes;
        let n = usize::from(classes.last()?.0.0) + 1;
        let mut kinds = vec![PixelKind::Firm; n];
        for (entity, class) in classes {
            kinds[usize::from(entity.0)] = PixelKind::of(*entity, Some(*class));
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
        let rays = Rays::new(&observation.camera);
        let measure = Measure { ids, depth, width, kinds: &kinds, rays: &rays };
        let (tallies, dynamic_mask) = pulp::Arch::new().dispatch(measure);
        let detections = tallies
            .into_iter()
            .enumerate()
            .filter(|(_, t)| t.n_pixels >= MIN_PIXELS && t.n_points > 0)
            .filter_map(|(i, t)| {
                let entity = EntityId(i as u16);
                Some(t.detection(entity, observation.granted.class_of(entity)?))
            })
            .collect();
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
    use chaic_protocol::AgentId;

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
    fn rounds_as_the_library_does() {
        let odd =
            [f32::NAN, f32::INFINITY, -1e9, 0.49999997, -0.49999997, -0.0, 32767.5, 8388609.0];
        let usual = (-4000..4000).map(|k| k as f32 * 0.0625);
        for x in usual.chain(odd) {
            assert_eq!(nearest_whole(x), x.round() as i16, "{x}");
        }
    }

    #[test]
    fn runs_end_where_the_ids_change() {
        for n in 0..70usize {
            let mut ids = vec![7; n];
            assert_eq!(run_length(&ids), n);
            ids.extend([8, 7, 7]);
            assert_eq!(run_length(&ids), n.max(1));
        }
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
