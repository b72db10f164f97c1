//! The planning problem of two people who carry objects to a goal place.

use chaic_core::{ClassId, Vec2};

use crate::rules::PlannerRules;
use crate::track::TrackId;

/// Maximum number of places in a problem: sets of places are bits of a `u64`.
pub const MAX_PLACES: usize = 64;
/// Maximum number of classes in a problem.
pub const MAX_CLASSES: usize = 24;
/// Path length that stands for "no path", meters.
pub const NO_PATH_M: f32 = 1e6;

/// Use of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaceKind {
    /// A target lies there.
    Target,
    /// A container stands there.
    Container,
    /// A goal place.
    Goal,
    /// An obstacle in a passage.
    Obstacle,
}

/// An object that one of the people may go to.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Track of the object.
    pub track: TrackId,
    /// Class of the object.
    pub class: ClassId,
    /// Use of the place.
    pub kind: PlaceKind,
    /// Index of the class in [`TeamProblem::classes`]; `None` unless a target lies there.
    pub class_index: Option<usize>,
    /// Position of the object (x, z), meters.
    pub position: Vec2,
    /// Position at which a person stands to use it (x, z), meters.
    pub stand: Vec2,
    /// True if the partner has probably seen it.
    pub is_known_to_partner: bool,
    /// Probability that one attempt of the partner succeeds: a pick-up, or a put-on at a goal place.
    pub partner_chance: f32,
}

/// A person and what they carry.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamMember {
    /// Walking speed along a path, including turns and starts, meters per frame.
    pub speed_m_per_frame: f32,
    /// Time before each pick-up and put-on, frames: a rider docks the bicycle.
    pub docking_frames: f32,
    /// Class indices of the objects in hands or basket.
    pub loose: Vec<usize>,
    /// Class indices of the objects in the carried container; `None` without a container.
    pub contained: Option<Vec<usize>>,
    /// Maximum number of objects carried without a container: the usable hands, or the basket.
    pub n_loose: usize,
    /// True if it may carry a container beside one object in the other hand.
    pub carries_containers: bool,
    /// True if obstacles in passages stop it.
    pub is_blocked: bool,
    /// Fraction of the episode left below which it delivers what it carries.
    pub deliver_below: f32,
}

/// A goal that the partner may have.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalHypothesis {
    /// Probability of this goal.
    pub probability: f32,
    /// Number of objects still to be delivered by class index.
    pub missing: Vec<f32>,
}

/// Average durations of operations beside walking, frames. Measured in episodes of
/// `gen-standard:7000..7010`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OperationFrames {
    /// Picking up, including the final approach.
    pub pick_up: f32,
    /// Putting an object into a container.
    pub put_in: f32,
    /// Putting the contents of one hand on a goal place.
    pub put_on: f32,
    /// Removing an obstacle.
    pub remove: f32,
}

impl OperationFrames {
    /// The measured values.
    pub const MEASURED: OperationFrames =
        OperationFrames { pick_up: 78.0, put_in: 96.0, put_on: 108.0, remove: 160.0 };
}

/// Operation of the helper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// Pick up the target at this place.
    PickUp(usize),
    /// Pick up the container at this place.
    TakeContainer(usize),
    /// Bring everything to the nearest goal place.
    Deliver,
    /// Remove the obstacle at this place.
    Remove(usize),
}

/// The rest of an episode as a planning problem.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamProblem {
    /// Places, at most [`MAX_PLACES`].
    pub places: Vec<Place>,
    /// Path lengths `[from][to]` in meters, `NO_PATH_M` without a path. Rows: the places, then the
    /// helper, then the partner. Columns: the places.
    pub path_m: Vec<Vec<f32>>,
    /// Obstacles on each of these paths, as bits of their places.
    pub obstacles_on_path: Vec<Vec<u64>>,
    /// Classes of the targets, at most [`MAX_CLASSES`].
    pub classes: Vec<ClassId>,
    /// Possible goals; their probabilities sum to 1.
    pub hypotheses: Vec<GoalHypothesis>,
    /// Frames until the episode ends.
    pub frames_left: f32,
    /// Length of the whole episode, frames.
    pub horizon: f32,
    /// The helper.
    pub helper: TeamMember,
    /// The partner; `None` plans for the helper alone.
    pub partner: Option<TeamMember>,
    /// Maximum number of objects in a container.
    pub container_capacity: usize,
    /// Rules that the partner follows.
    pub rules: PlannerRules,
}

impl TeamProblem {
    /// Row of the helper in the matrices.
    pub fn helper_row(&self) -> usize {
        self.places.len()
    }

    /// Row of the partner in the matrices.
    pub fn partner_row(&self) -> usize {
        self.places.len() + 1
    }

    /// Indices of the places of one kind.
    pub fn places_of(&self, kind: PlaceKind) -> impl Iterator<Item = usize> + '_ {
        self.places.iter().enumerate().filter(move |(_, p)| p.kind == kind).map(|(i, _)| i)
    }
}
