//! Observations of agents.

use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::action::{Action, Outcome, ResolvedAction};
use crate::geom::{Camera, Pose};
use crate::ids::{AgentId, ClassId, EntityId, Frame};
use crate::task::Goal;

/// Requested image channels and sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorConfig {
    /// Width and height of the images, pixels; 512 in the benchmark.
    pub image_size: u32,
    /// True if the agent uses color.
    pub rgb: bool,
    /// True if the agent uses depth.
    pub depth: bool,
    /// True if the agent uses instance ids (provided only if granted).
    pub ids: bool,
    /// Requested image history between decisions.
    #[serde(alias = "film", default, skip_serializing_if = "Option::is_none")]
    pub frame_history: Option<FrameHistorySpec>,
}

/// Small color and depth images between decisions, from the same camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameHistorySpec {
    /// Width and height of the images, pixels.
    pub image_size: u32,
    /// Interval: an image is taken in every frame whose number is a multiple of this.
    pub every_frames: u32,
    /// Maximum number of images; older ones are dropped.
    #[serde(alias = "most")]
    pub max_len: u32,
}

impl SensorConfig {
    /// Side length of the benchmark's images, pixels (paper section 5).
    pub const IMAGE_SIZE: u32 = 512;
    /// Depth and ids at the benchmark's size, for the rule-based agents.
    pub const DEPTH_AND_IDS: SensorConfig = SensorConfig {
        image_size: SensorConfig::IMAGE_SIZE,
        rgb: false,
        depth: true,
        ids: true,
        frame_history: None,
    };
    /// No image.
    pub const NONE: SensorConfig = SensorConfig {
        image_size: SensorConfig::IMAGE_SIZE,
        rgb: false,
        depth: false,
        ids: false,
        frame_history: None,
    };

    /// Permitted side lengths of images, pixels.
    pub const IMAGE_SIZES: RangeInclusive<u32> = 16..=2048;
    /// Maximum number of history images in one observation.
    pub const MAX_HISTORY_FRAMES: u32 = 256;
    /// Maximum pixel data of one observation, bytes (64 MiB): color, depth and ids of 2,048 by
    /// 2,048 pixels, and a history of 256 images of 128 by 128 pixels.
    pub const MAX_OBSERVATION_BYTES: u64 = 64 << 20;

    /// Returns whether any image channel is requested.
    pub fn wants_image(&self) -> bool {
        self.rgb || self.depth || self.ids
    }

    /// Returns the size of the largest observation's pixel data, bytes: images and a full history.
    pub fn max_observation_bytes(&self) -> u64 {
        self.image_bytes()
            .saturating_add(self.frame_history.map_or(0, |history| history.max_bytes()))
    }

    fn image_bytes(&self) -> u64 {
        let channels = [(self.rgb, 3), (self.depth, 4), (self.ids, 2)];
        let bytes_per_pixel = channels.iter().map(|(wanted, n)| u64::from(*wanted) * n).sum();
        square_bytes(self.image_size, bytes_per_pixel)
    }

    /// Checks image sizes and the length of the history.
    ///
    /// # Errors
    /// One line with the requested and the permitted values, to follow the agent's name.
    pub fn check_counts(&self) -> Result<(), String> {
        let sizes = SensorConfig::IMAGE_SIZES;
        let (min, max) = (sizes.start(), sizes.end());
        let sides = [Some(self.image_size), self.frame_history.map(|history| history.image_size)];
        let is_wrong = |side: &u32| !sizes.contains(side);
        if let Some(side) = sides.into_iter().flatten().find(is_wrong) {
            return Err(format!("asks for images of {side} pixels; a side has {min} to {max}"));
        }
        if let Some(n) = self
            .frame_history
            .map(|history| history.max_len)
            .filter(|n| *n > SensorConfig::MAX_HISTORY_FRAMES)
        {
            let max = SensorConfig::MAX_HISTORY_FRAMES;
            return Err(format!("asks for a frame history of {n} images; it holds at most {max}"));
        }
        if self.frame_history.is_some_and(|history| history.every_frames == 0) {
            return Err("asks for a frame history of every 0 frames; it is at least 1".to_owned());
        }
        Ok(())
    }

    /// Checks image sizes, the length of the history and the size of the largest observation.
    ///
    /// # Errors
    /// One line with the requested and the permitted values, to follow the agent's name.
    pub fn check(&self) -> Result<(), String> {
        self.check_counts()?;
        let Some(history) = self.frame_history else { return Ok(()) };
        if self.max_observation_bytes() > SensorConfig::MAX_OBSERVATION_BYTES {
            return Err(format!(
                "asks for up to {} MiB an observation (images of {} pixels: {} MiB, history of {} \
                 images of {} pixels: {} MiB); an observation holds at most {} MiB; ask for fewer or \
                 smaller history images",
                mib(self.max_observation_bytes()),
                self.image_size,
                mib(self.image_bytes()),
                history.max_len,
                history.image_size,
                mib(history.max_bytes()),
                mib(SensorConfig::MAX_OBSERVATION_BYTES),
            ));
        }
        Ok(())
    }
}

impl FrameHistorySpec {
    /// Returns the size of a full history's color and depth data, bytes.
    pub fn max_bytes(&self) -> u64 {
        square_bytes(self.image_size, 3 + 4).saturating_mul(u64::from(self.max_len))
    }
}

fn square_bytes(side: u32, bytes_per_pixel: u64) -> u64 {
    (u64::from(side) * u64::from(side)).saturating_mul(bytes_per_pixel)
}

fn mib(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}

/// Information that an agent receives in addition to its images and proprioception. Recorded in
/// every trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Grants {
    /// Instance ids of the agent's own image with their classes, the identities of held objects,
    /// and the delivered objects in the image. It is perfect segmentation and association, without
    /// information about anything outside the image.
    pub ids: bool,
    /// Class of the goal place. The paper's prompts and the original's planners have it; it is not
    /// part of the hidden goal.
    #[serde(default)]
    pub goal_place: bool,
    /// The partner's goal, and the minimum top height of the goal place.
    pub goal: bool,
    /// All deliveries, independent of the agent's position.
    pub progress: bool,
    /// The partner's actions and held objects while the partner is in the image. With `state`, at
    /// any place.
    pub behavior: bool,
    /// Positions of all agents.
    pub positions: bool,
    /// Task and kind of person of the partner, which the original's prompts contain.
    #[serde(default, skip_serializing_if = "is_false")]
    pub task: bool,
    /// State of all objects that matter for the tasks, the actual goal places, and the layout of
    /// floors, walls and furniture. It is for upper bounds only.
    #[serde(default, skip_serializing_if = "is_false")]
    pub state: bool,
}

/// Accessor of a grant.
type GrantField = fn(&mut Grants) -> &mut bool;

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(b: &bool) -> bool {
    !b
}

impl Grants {
    /// No additional information.
    pub const NONE: Grants = Grants {
        ids: false,
        goal_place: false,
        goal: false,
        progress: false,
        behavior: false,
        positions: false,
        task: false,
        state: false,
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
        state: true,
    };
    /// Perfect segmentation of the agent's own image only.
    pub const IDS: Grants = Grants { ids: true, ..Grants::NONE };
    /// Grants of the paper's planners: perfect segmentation and the goal place.
    pub const PLANNER: Grants = Grants { goal_place: true, ..Grants::IDS };
    /// Grants of a partner: perfect segmentation, the goal place and its own goal.
    pub const PARTNER: Grants = Grants { goal: true, ..Grants::PLANNER };
    /// Grants of the paper's oracle.
    pub const ORACLE: Grants = Grants { progress: true, behavior: true, ..Grants::PARTNER };
    /// Name and accessor of every grant, in the order of docs/grants.md.
    const FIELDS: [(&'static str, GrantField); 8] = [
        ("ids", |grants| &mut grants.ids),
        ("goal_place", |grants| &mut grants.goal_place),
        ("goal", |grants| &mut grants.goal),
        ("progress", |grants| &mut grants.progress),
        ("behavior", |grants| &mut grants.behavior),
        ("positions", |grants| &mut grants.positions),
        ("task", |grants| &mut grants.task),
        ("state", |grants| &mut grants.state),
    ];

    /// Returns the name of every grant and whether it is set, in the order of docs/grants.md.
    pub fn named(mut self) -> [(&'static str, bool); 8] {
        Grants::FIELDS.map(|(name, field)| (name, *field(&mut self)))
    }

    /// Returns the names of the grants that `allowed` does not contain.
    pub fn names_beyond(self, allowed: Grants) -> Vec<&'static str> {
        let pairs = self.named().into_iter().zip(allowed.named());
        pairs.filter(|((_, has), (_, may))| *has && !may).map(|((name, _), _)| name).collect()
    }

    /// Returns the grants with these names.
    ///
    /// # Errors
    /// The first unknown name.
    ///
    /// ```
    /// use chaic_core::observation::Grants;
    /// assert_eq!(Grants::from_names(["goal_place", "ids"]), Ok(Grants::PLANNER));
    /// assert_eq!(Grants::from_names(["gold"]), Err("gold".to_owned()));
    /// ```
    pub fn from_names<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Grants, String> {
        let mut grants = Grants::NONE;
        for name in names {
            let known = Grants::FIELDS.iter().find(|(known, _)| *known == name);
            let (_, field) = known.ok_or_else(|| name.to_owned())?;
            *field(&mut grants) = true;
        }
        Ok(grants)
    }

    /// Grants of the child.
    pub const CHILD: Grants = Grants { positions: true, ..Grants::IDS };
}

/// A held object, as the hand senses it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeldObject {
    /// Number of contained objects; 0 for all but containers and vehicles.
    pub n_contents: u32,
    /// True if both hands hold this object: furniture.
    pub in_both_hands: bool,
    /// Identity of the object, with the grant of ids. Without the grant, the agent knows only the
    /// objects that it saw when it picked them up.
    pub identity: Option<HeldIdentity>,
}

/// Identity of a held object, with its contents.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeldIdentity {
    /// Id of the object.
    pub entity: EntityId,
    /// Class of the object.
    pub class: ClassId,
    /// Contents in the order of their slots; empty for all but containers and vehicles.
    pub contents: Vec<(EntityId, ClassId)>,
}

/// Second carrier of the furniture that an agent leads with, as its hands sense it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointCarrier {
    /// Id of the second carrier.
    pub agent: AgentId,
    /// Position in the frame of the leader's body, meters; constant until the furniture is put
    /// down.
    pub position_in_body: Vec3,
}

/// Proprioception of an agent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proprioception {
    /// Pose of the agent.
    pub pose: Pose,
    /// Objects in the left and the right hand. A rider's left hand holds the bicycle, whose
    /// contents are those of the basket. Furniture appears in both hands.
    pub hands: [Option<HeldObject>; 2],
    /// Action that has just ended, with the target as the agent named it, and the outcome.
    /// `None` at the start. Also `None` after an action that another agent's choice replaced by a
    /// joint lift (rules of the original), unless ids are granted.
    pub last: Option<(Action, Outcome)>,
    /// Second carrier, for the leader of a joint carry.
    #[serde(default)]
    pub other_end: Option<JointCarrier>,
}

impl Proprioception {
    /// Returns the distinct held objects.
    pub fn held(&self) -> impl Iterator<Item = &HeldObject> {
        let [left, right] = &self.hands;
        let same = left.as_ref().is_some_and(|l| l.in_both_hands);
        left.iter().chain(right.iter().filter(move |_| !same))
    }
}

/// Images from one camera. Buffers are row-major, row 0 at the top. Channels that are not requested
/// or not granted are absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Images {
    /// RGB, u8, shape [height, width, 3], display-encoded: 255 times the square root of linear
    /// light.
    pub rgb: Option<Vec<u8>>,
    /// Depth along the camera's axis, f32 meters, shape [height, width]. [`Camera::FAR_M`] where
    /// the image shows nothing, and 0 where low vision hides the content.
    pub depth_m: Option<Vec<f32>>,
    /// Instance ids ([`EntityId`]), u16, shape [height, width].
    pub ids: Option<Vec<u16>>,
}

/// An image of the history.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryFrame {
    /// Frame at which it was taken.
    pub frame: Frame,
    /// Camera that took it.
    pub camera: Camera,
    /// Color and depth.
    pub images: Images,
}

/// Action of an agent as another agent observes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservedAction {
    /// The acting agent.
    pub agent: AgentId,
    /// Frame of its end, or of its start while in progress.
    pub frame: Frame,
    /// The action.
    pub action: ResolvedAction,
    /// Outcome; `None` while in progress.
    pub outcome: Option<Outcome>,
}

/// State of the objects in the world. The static geometry is in [`crate::briefing::Layout`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorldState {
    /// Carriable objects, heavy targets and obstacles, and all objects whose class may be a goal
    /// place in this kind of scene. In the order of ids. Other furniture is in the layout only.
    pub objects: Vec<ObjectState>,
    /// Goal places of the episode, in the order of ids. Delivery to any of them counts.
    pub goal_places: Vec<EntityId>,
}

/// State of one object in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectState {
    /// Id of the object.
    pub entity: EntityId,
    /// Class of the object.
    pub class: ClassId,
    /// Center of the object's bounding box in the world, meters.
    pub position_in_world: Vec3,
    /// Height of its lowest point, meters.
    pub bottom_m: f32,
    /// Height of its highest point, meters.
    pub top_m: f32,
    /// Outline from above in the world (x, z), meters: the corners, and points at most
    /// [`ObjectState::OUTLINE_SPACING_M`] apart on the edges. Empty for carriable objects.
    pub footprint: Vec<Vec2>,
    /// Agent that holds the object, or the container or basket around it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder: Option<AgentId>,
    /// Container or bicycle that contains the object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub container: Option<EntityId>,
    /// True if the object is out of play: delivered, or broken.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_gone: bool,
}

impl ObjectState {
    /// Maximum spacing of the points of an outline, meters.
    pub const OUTLINE_SPACING_M: f32 = 0.2;
}

/// Granted information; every field is empty without its grant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GrantedInfo {
    /// `ids`: class of each object and person in the agent's own image, in the order of ids.
    /// Structure is not listed.
    pub classes: Vec<(EntityId, ClassId)>,
    /// `ids`: delivered objects in the agent's own image. `progress`: all delivered objects,
    /// targets or not, at any place. In the order of ids.
    pub delivered: Vec<(EntityId, ClassId)>,
    /// `ids`: removed obstacles, if the rules announce them to all agents, as the original's do.
    pub removed: Vec<EntityId>,
    /// `goal`: goal of the partner.
    pub goal: Option<Goal>,
    /// `behavior`: last interaction of each other agent in the image; with `state`, of all other
    /// agents.
    pub behavior: Vec<ObservedAction>,
    /// `behavior`: held objects of the partner (for the partner: of the helper), if in the image.
    /// With `state`, always.
    pub partner_hands: Option<[Option<HeldIdentity>; 2]>,
    /// `positions`: pose of each agent.
    pub poses: Vec<(AgentId, Pose)>,
    /// `state`: state of the objects in the world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<WorldState>,
}

/// Observation of an agent when its action has ended (paper section 3.3, "Observation Space").
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Number of frames since the start of the episode.
    pub frame: Frame,
    /// Proprioception.
    pub proprioception: Proprioception,
    /// Camera that took the images.
    pub camera: Camera,
    /// Images of the camera.
    pub images: Images,
    /// Image history since the last decision, oldest first, if
    /// [requested](SensorConfig::frame_history).
    pub frame_history: Vec<HistoryFrame>,
    /// Granted information.
    pub granted: GrantedInfo,
}

impl GrantedInfo {
    /// Returns the class of an id in the agent's own image; requires the grant of ids.
    pub fn class_of(&self, entity: EntityId) -> Option<ClassId> {
        let at = self.classes.binary_search_by_key(&entity, |(e, _)| *e).ok()?;
        Some(self.classes[at].1)
    }
}

impl Observation {
    /// Returns the observation of an agent with these grants except ids.
    pub fn without_ids(&self, grants: Grants) -> Observation {
        let mut observation = self.clone();
        observation.images.ids = None;
        let granted = &mut observation.granted;
        granted.classes.clear();
        granted.removed.clear();
        if !grants.progress {
            granted.delivered.clear();
        }
        observation.proprioception.hands.iter_mut().flatten().for_each(|held| held.identity = None);
        observation
    }
}

#[cfg(test)]
mod tests;
