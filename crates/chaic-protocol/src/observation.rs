//! What an agent perceives when it is asked.

use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::action::{Action, Outcome};
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
}

impl Senses {
    /// Depth and ids at the benchmark's size: what the rule-based minds look at.
    pub const DEPTH_AND_IDS: Senses =
        Senses { image_size: 512, rgb: false, depth: true, ids: true };
    /// No image at all.
    pub const NONE: Senses = Senses { image_size: 512, rgb: false, depth: false, ids: false };

    /// Whether any image must be made.
    pub fn wants_image(&self) -> bool {
        self.rgb || self.depth || self.ids
    }
}

/// What an agent is given beyond its own images and state. Written into every trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Grants {
    /// Instance ids of its image with their classes: perfect segmentation and association.
    pub ids: bool,
    /// The partner's goal.
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

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(b: &bool) -> bool {
    !b
}

impl Grants {
    /// Nothing beyond own images and state: the `hidden` track proper.
    pub const NONE: Grants = Grants {
        ids: false,
        goal: false,
        progress: false,
        behavior: false,
        positions: false,
        task: false,
    };
    /// Perfect segmentation of the own image, nothing else.
    pub const IDS: Grants = Grants { ids: true, ..Grants::NONE };
    /// What a partner has: perfect segmentation and its own goal.
    pub const PARTNER: Grants = Grants { goal: true, ..Grants::IDS };
    /// What the paper's oracle has.
    pub const ORACLE: Grants = Grants { progress: true, behavior: true, ..Grants::PARTNER };
    /// What the child has.
    pub const CHILD: Grants = Grants { positions: true, ..Grants::IDS };
}

/// One object in a hand, with what it contains.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Held {
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
    /// The action that has just ended, with its outcome; `None` at the start.
    pub last: Option<(Action, Outcome)>,
    /// Who carries along, for the one who leads.
    #[serde(default)]
    pub other_end: Option<OtherEnd>,
}

impl SelfState {
    /// The distinct things held.
    pub fn held(&self) -> impl Iterator<Item = &Held> {
        let [left, right] = &self.hands;
        let same = matches!((left, right), (Some(l), Some(r)) if l.entity == r.entity);
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
    /// nothing is seen.
    pub depth_m: Option<Vec<f32>>,
    /// Instance ids ([`EntityId`]), u16, shape [height, width].
    pub ids: Option<Vec<u16>>,
}

/// Something an agent did, as an onlooker sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenAction {
    /// Who did it.
    pub agent: AgentId,
    /// When it ended (or began, if under way).
    pub frame: Frame,
    /// What it was.
    pub action: Action,
    /// How it ended; `None` while under way.
    pub outcome: Option<Outcome>,
}

/// What was granted beyond the own image and state; every field is empty without its grant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Granted {
    /// `ids`: class of every entity of the episode, indexed by [`EntityId`]; shared, constant.
    pub classes: Option<Arc<Vec<Option<ClassId>>>>,
    /// `goal`: what the partner wants.
    pub goal: Option<Goal>,
    /// `behavior`: what the others did last other than moving about, if they are in the image.
    pub behavior: Vec<SeenAction>,
    /// `behavior`: what the partner (for the partner: the helper) holds, if in the image.
    pub partner_hands: Option<[Option<Held>; 2]>,
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
    /// Everything delivered so far, wanted or not, if the goal place is in view or near (or
    /// progress is granted); otherwise `None`.
    pub delivered: Option<Vec<EntityId>>,
    /// The obstacles that have been removed, where the rules tell everybody of them.
    pub removed: Vec<EntityId>,
    /// What was granted beyond that.
    pub granted: Granted,
}

impl Observation {
    /// Position of the eye in the world, metres.
    pub fn eye(&self) -> Vec3 {
        self.camera.eye_in_world
    }
}
