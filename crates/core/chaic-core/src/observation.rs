//! What an agent perceives when it is asked.

use std::ops::RangeInclusive;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::action::{Action, Outcome, ResolvedAction};
use crate::briefing::Goal;
use crate::geom::{Camera, Pose};
use crate::ids::{AgentId, ClassId, EntityId, Frame};

/// Which images an agent wants, and how large.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Senses {
    /// Width and height of its images, pixels; 512 in the benchmark.
    pub image_size: u32,
    /// Whether it looks at color.
    pub rgb: bool,
    /// Whether it looks at depth.
    pub depth: bool,
    /// Whether it looks at instance ids (given only if granted).
    pub ids: bool,
    /// The film that it wants of what it sees between decisions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film: Option<Film>,
}

/// Small images of color and depth between decisions, from the same eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Film {
    /// Width and height of its images, pixels.
    pub image_size: u32,
    /// An image is taken whenever the number of the frame is a multiple of this.
    pub every_frames: u32,
    /// No more images than these last ones.
    pub most: u32,
}

impl Senses {
    /// Side of the benchmark's images, pixels (paper section 5).
    pub const IMAGE_SIZE: u32 = 512;
    /// Depth and ids at the benchmark's size: what the rule-based minds look at.
    pub const DEPTH_AND_IDS: Senses =
        Senses { image_size: Senses::IMAGE_SIZE, rgb: false, depth: true, ids: true, film: None };
    /// No image at all.
    pub const NONE: Senses =
        Senses { image_size: Senses::IMAGE_SIZE, rgb: false, depth: false, ids: false, film: None };

    /// Sides of images that an agent may ask for, pixels.
    pub const IMAGE_SIZES: RangeInclusive<u32> = 16..=2048;
    /// Most film images that an agent may ask for in one observation.
    pub const MAX_FILM_FRAMES: u32 = 256;
    /// Largest pixel data of one observation, bytes (64 MiB): color, depth and ids of 2,048 pixels,
    /// and a film of 256 images of 128 pixels.
    pub const MAX_OBSERVATION_BYTES: u64 = 64 << 20;

    /// Whether any image must be made.
    pub fn wants_image(&self) -> bool {
        self.rgb || self.depth || self.ids
    }

    /// Returns the pixel data of the largest observation, bytes: images, and a full film.
    pub fn max_observation_bytes(&self) -> u64 {
        self.image_bytes().saturating_add(self.film.map_or(0, |film| film.max_bytes()))
    }

    fn image_bytes(&self) -> u64 {
        let channels = [(self.rgb, 3), (self.depth, 4), (self.ids, 2)];
        let bytes_per_pixel = channels.iter().map(|(wanted, n)| u64::from(*wanted) * n).sum();
        square_bytes(self.image_size, bytes_per_pixel)
    }

    /// Checks sides of images and length of the film.
    ///
    /// # Errors
    /// One line with the requested and the allowed numbers, to be read after the agent's name.
    pub fn check_counts(&self) -> Result<(), String> {
        let sizes = Senses::IMAGE_SIZES;
        let (min, max) = (sizes.start(), sizes.end());
        let sides = [Some(self.image_size), self.film.map(|film| film.image_size)];
        let is_wrong = |side: &u32| !sizes.contains(side);
        if let Some(side) = sides.into_iter().flatten().find(is_wrong) {
            return Err(format!("asks for images of {side} pixels; a side has {min} to {max}"));
        }
        if let Some(n) = self.film.map(|film| film.most).filter(|n| *n > Senses::MAX_FILM_FRAMES) {
            let max = Senses::MAX_FILM_FRAMES;
            return Err(format!("asks for a film of {n} images; a film holds at most {max}"));
        }
        Ok(())
    }

    /// Checks sides of images, length of the film and size of the largest observation.
    ///
    /// # Errors
    /// One line with the requested and the allowed numbers, to be read after the agent's name.
    pub fn check(&self) -> Result<(), String> {
        self.check_counts()?;
        let Some(film) = self.film else { return Ok(()) };
        if self.max_observation_bytes() > Senses::MAX_OBSERVATION_BYTES {
            return Err(format!(
                "asks for up to {} MiB an observation (images of {} pixels: {} MiB, film of {} images \
                 of {} pixels: {} MiB); an observation holds at most {} MiB; ask for fewer or smaller \
                 film images",
                mib(self.max_observation_bytes()),
                self.image_size,
                mib(self.image_bytes()),
                film.most,
                film.image_size,
                mib(film.max_bytes()),
                mib(Senses::MAX_OBSERVATION_BYTES),
            ));
        }
        Ok(())
    }
}

impl Film {
    /// Returns the pixel data of a full film in color and depth, bytes.
    pub fn max_bytes(&self) -> u64 {
        square_bytes(self.image_size, 3 + 4).saturating_mul(u64::from(self.most))
    }
}

fn square_bytes(side: u32, bytes_per_pixel: u64) -> u64 {
    (u64::from(side) * u64::from(side)).saturating_mul(bytes_per_pixel)
}

fn mib(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// What an agent is given beyond its own images and state. Written into every trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Grants {
    /// Instance ids of its own image, with the classes of the ids in that image; which thing each
    /// hand holds; which things in the image are delivered. Perfect segmentation and association,
    /// and nothing of what is not in the image.
    pub ids: bool,
    /// The class of the goal place. The paper's prompts and the original's planners have it; it is
    /// no part of the hidden goal.
    #[serde(default)]
    pub goal_place: bool,
    /// The partner's goal, and the least height of the goal place's top.
    pub goal: bool,
    /// What has been delivered, wherever the agent is.
    pub progress: bool,
    /// The partner's actions and holdings while the partner is in the image.
    pub behavior: bool,
    /// Where everybody is.
    pub positions: bool,
    /// Which task it is and what kind of person the partner is: what the original's prompts tell.
    #[serde(default, skip_serializing_if = "is_false")]
    pub task: bool,
}

/// Where a grant stands.
type GrantField = fn(&mut Grants) -> &mut bool;

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(b: &bool) -> bool {
    !b
}

impl Grants {
    /// Nothing beyond own images and state.
    pub const NONE: Grants = Grants {
        ids: false,
        goal_place: false,
        goal: false,
        progress: false,
        behavior: false,
        positions: false,
        task: false,
    };
    /// Every grant.
    pub const ALL: Grants = Grants {
        ids: true,
        goal_place: true,
        goal: true,
        progress: true,
        behavior: true,
        positions: true,
        task: true,
    };
    /// Perfect segmentation of the own image, nothing else.
    pub const IDS: Grants = Grants { ids: true, ..Grants::NONE };
    /// What the paper's planners stand on: perfect segmentation and the goal place.
    pub const PLANNER: Grants = Grants { goal_place: true, ..Grants::IDS };
    /// What a partner has: perfect segmentation, the goal place and its own goal.
    pub const PARTNER: Grants = Grants { goal: true, ..Grants::PLANNER };
    /// What the paper's oracle has.
    pub const ORACLE: Grants = Grants { progress: true, behavior: true, ..Grants::PARTNER };
    /// Every grant by its name, in the order of docs/grants.md, with where it stands.
    const FIELDS: [(&'static str, GrantField); 7] = [
        ("ids", |grants| &mut grants.ids),
        ("goal_place", |grants| &mut grants.goal_place),
        ("goal", |grants| &mut grants.goal),
        ("progress", |grants| &mut grants.progress),
        ("behavior", |grants| &mut grants.behavior),
        ("positions", |grants| &mut grants.positions),
        ("task", |grants| &mut grants.task),
    ];

    /// Every grant by its name, in the order of docs/grants.md, and whether it is given.
    pub fn named(mut self) -> [(&'static str, bool); 7] {
        Grants::FIELDS.map(|(name, field)| (name, *field(&mut self)))
    }

    /// Returns the names of the grants that `allowed` doesn't have.
    pub fn names_beyond(self, allowed: Grants) -> Vec<&'static str> {
        let pairs = self.named().into_iter().zip(allowed.named());
        pairs.filter(|((_, has), (_, may))| *has && !may).map(|((name, _), _)| name).collect()
    }

    /// The grants of these names.
    ///
    /// # Errors
    /// The first name that is no grant's.
    ///
    /// ```
    /// use chaic_core::observation::Grants;
    /// assert_eq!(Grants::of_names(["goal_place", "ids"]), Ok(Grants::PLANNER));
    /// assert_eq!(Grants::of_names(["gold"]), Err("gold".to_owned()));
    /// ```
    pub fn of_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Grants, String> {
        let mut grants = Grants::NONE;
        for name in names {
            let known = Grants::FIELDS.iter().find(|(known, _)| *known == name);
            let (_, field) = known.ok_or_else(|| name.to_owned())?;
            *field(&mut grants) = true;
        }
        Ok(grants)
    }

    /// What the child has.
    pub const CHILD: Grants = Grants { positions: true, ..Grants::IDS };
}

/// Something in a hand, as the hand feels it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Held {
    /// How many things are in it; 0 for anything but containers and vehicles.
    pub n_contents: u32,
    /// Whether both hands hold this one thing: furniture.
    pub in_both_hands: bool,
    /// Which thing it is; only where ids are granted. Otherwise an agent knows what it saw itself
    /// take.
    pub identity: Option<Identity>,
}

/// Which thing something is, with what it contains.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The object.
    pub entity: EntityId,
    /// Its class.
    pub class: ClassId,
    /// What is in it, in the order it was put in; empty for anything but containers and vehicles.
    pub contents: Vec<(EntityId, ClassId)>,
}

/// Who holds the other end of the furniture that an agent leads with, as its hands tell it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OtherEnd {
    /// Who.
    pub agent: AgentId,
    /// Where, in the own body's frame, metres; it stays so until the furniture is put down.
    pub position_in_body: Vec3,
}

/// What an agent knows of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SelfState {
    /// Where it stands and looks.
    pub pose: Pose,
    /// What the left and the right hand hold. A rider's left hand holds the bicycle, whose
    /// contents are the basket's. Furniture is held by both: it appears in both.
    pub hands: [Option<Held>; 2],
    /// The action that has just ended, its object named as the agent named it, with its outcome.
    /// `None` at the start, and after an action that another one's choice replaced by a joint lift
    /// (original's rules), unless ids are granted.
    pub last: Option<(Action, Outcome)>,
    /// Who carries along, for the one who leads.
    #[serde(default)]
    pub other_end: Option<OtherEnd>,
}

impl SelfState {
    /// The distinct things held.
    pub fn held(&self) -> impl Iterator<Item = &Held> {
        let [left, right] = &self.hands;
        let same = left.as_ref().is_some_and(|l| l.in_both_hands);
        left.iter().chain(right.iter().filter(move |_| !same))
    }
}

/// Images from one eye. Buffers are row-major, row 0 at the top; those not asked for or not
/// granted are absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Images {
    /// RGB, u8, shape [height, width, 3], as screens show it: 255 times the root of linear light.
    pub rgb: Option<Vec<u8>>,
    /// Depth along the camera's axis, f32 metres, shape [height, width]; [`Camera::FAR_M`] where
    /// there is nothing, 0 where eyes of low vision make out nothing.
    pub depth_m: Option<Vec<f32>>,
    /// Instance ids ([`EntityId`]), u16, shape [height, width].
    pub ids: Option<Vec<u16>>,
}

/// An image of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFrame {
    /// When it was taken.
    pub frame: Frame,
    /// The camera that took it.
    pub camera: Camera,
    /// Color and depth.
    pub images: Images,
}

/// Something an agent did, as an onlooker sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenAction {
    /// Who did it.
    pub agent: AgentId,
    /// When it ended (or began, if under way).
    pub frame: Frame,
    /// What it was.
    pub action: ResolvedAction,
    /// How it ended; `None` while under way.
    pub outcome: Option<Outcome>,
}

/// What was granted beyond the own image and state; every field is empty without its grant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Granted {
    /// `ids`: the class of each object and person in the own image, in the order of ids. Structure
    /// has none.
    pub classes: Vec<(EntityId, ClassId)>,
    /// `ids`: what is delivered among the things in the own image; `progress`: all that is
    /// delivered, wanted or not, wherever the agent is. In the order of ids.
    pub delivered: Vec<(EntityId, ClassId)>,
    /// `ids`: the obstacles that have been removed, where the rules tell everybody of them (the
    /// original's do).
    pub removed: Vec<EntityId>,
    /// `goal`: what the partner wants.
    pub goal: Option<Goal>,
    /// `behavior`: what the others did last other than moving about, if they are in the image.
    pub behavior: Vec<SeenAction>,
    /// `behavior`: what the partner (for the partner: the helper) holds, if in the image.
    pub partner_hands: Option<[Option<Identity>; 2]>,
    /// `positions`: where everybody is, by agent.
    pub poses: Vec<(AgentId, Pose)>,
}

/// What an agent perceives when its action has ended (paper section 3.3, "Observation Space").
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Frames since the episode began.
    pub frame: Frame,
    /// What the agent knows of itself.
    pub own: SelfState,
    /// The camera that took the images.
    pub camera: Camera,
    /// What the eye sees.
    pub images: Images,
    /// What it saw since the last decision, oldest first, where that was [asked for](Senses::film).
    pub film: Vec<FilmFrame>,
    /// What was granted beyond that.
    pub granted: Granted,
}

impl Granted {
    /// The class of an id of the own image; needs the grant of ids.
    pub fn class_of(&self, entity: EntityId) -> Option<ClassId> {
        let at = self.classes.binary_search_by_key(&entity, |(e, _)| *e).ok()?;
        Some(self.classes[at].1)
    }
}

impl Observation {
    /// Position of the eye in the world, metres.
    pub fn eye(&self) -> Vec3 {
        self.camera.eye_in_world
    }

    /// The same for who is granted the rest of these grants, but no ids.
    pub fn without_ids(&self, grants: Grants) -> Observation {
        let mut observation = self.clone();
        observation.images.ids = None;
        let granted = &mut observation.granted;
        granted.classes.clear();
        granted.removed.clear();
        if !grants.progress {
            granted.delivered.clear();
        }
        observation.own.hands.iter_mut().flatten().for_each(|held| held.identity = None);
        observation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Color, depth and ids, with a film of `most` images.
    fn senses(image_size: u32, film_size: u32, most: u32) -> Senses {
        let film = Some(Film { image_size: film_size, every_frames: 3, most });
        Senses { image_size, rgb: true, depth: true, ids: true, film }
    }

    #[test]
    fn the_largest_observation_is_bounded() {
        let full = senses(2048, 128, 256);
        assert_eq!(full.max_observation_bytes(), Senses::MAX_OBSERVATION_BYTES);
        assert_eq!(full.check(), Ok(()));
        let problem = senses(2048, 129, 256).check().unwrap_err();
        assert!(
            problem.contains("up to 65 MiB") && problem.contains("at most 64 MiB"),
            "{problem}"
        );
        let problem = senses(512, 2048, 256).check().unwrap_err();
        assert!(problem.contains("256 images of 2048 pixels: 7168 MiB"), "{problem}");
        assert_eq!(senses(16, 2048, 2).check(), Ok(()));
        for wrong in [senses(15, 16, 1), senses(2049, 16, 1), senses(16, u32::MAX, 1)] {
            assert!(wrong.check().unwrap_err().contains("16 to 2048"), "{wrong:?}");
        }
        assert!(senses(16, 16, 257).check().unwrap_err().contains("at most 256"));
        assert_eq!(senses(u32::MAX, u32::MAX, u32::MAX).max_observation_bytes(), u64::MAX);
    }
}
