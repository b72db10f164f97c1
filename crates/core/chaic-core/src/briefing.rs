//! Briefing of an agent before an episode.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::capability::{Capability, PersonKind};
use crate::geom::{Rect, rotate_yaw};
use crate::ids::{AgentId, ClassId, EntityId, Frame};
use crate::observation::Grants;
pub use crate::task::Goal;
use crate::task::TaskId;

/// Another person of the episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Companion {
    /// Id of the person; pixels of the body are [`EntityId::from_agent`].
    pub agent: AgentId,
    /// Role from the point of view of the reader.
    pub role: CompanionRole,
}

/// Role of another person from the point of view of the reader of a briefing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompanionRole {
    /// The partner of the helper, or the helper of the partner.
    Partner,
    /// The child, who may run away.
    Child,
    /// The adult who is responsible for the child.
    Guardian,
}

/// Motion and reach parameters of the rules that planning requires.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionParams {
    /// Angle of one turn, radians.
    pub turn_rad: f32,
    /// A step ends with the frame in which it has covered more than this distance, meters.
    pub stride_m: f32,
    /// Height below which agents step over objects, meters.
    pub step_over_m: f32,
    /// Target distance of an approach to the nearest point of an object, meters.
    pub arm_reach_m: f32,
    /// Maximum reach to an object when a closer approach is impossible, meters.
    pub reach_limit_m: f32,
}

/// Briefing of an agent before an episode. The briefing of a helper contains the partner's goal or
/// constraint only if it is granted, and traces record the grant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Briefing {
    /// Id of the reader.
    pub me: AgentId,
    /// Capability of the reader's own body.
    pub capability: Capability,
    /// Motion and reach parameters of the world.
    pub motion: MotionParams,
    /// The other people.
    pub companions: Vec<Companion>,
    /// Seed of the reader's own random streams; it differs between agents of one episode. The seed
    /// of a helper derives from the run's seed and the agent id, and is the same in all episodes of
    /// a run.
    pub seed: u64,
    /// Number of frames until the episode ends.
    pub horizon: Frame,
    /// Part of the plane where the episode takes place.
    pub bounds: Rect,
    /// Possible target classes in this kind of scene, independent of this episode's goal.
    pub possible_targets: Vec<ClassId>,
    /// Classes of portable containers for targets.
    pub containers: Vec<ClassId>,
    /// Classes of removable obstacles.
    pub obstacles: Vec<ClassId>,
    /// Classes of possible goal places in this kind of scene; only the actual one if the goal place
    /// is granted.
    pub goal_places: Vec<ClassId>,
    /// Minimum top height of the goal place, meters. 0 for no condition, and without the grant of
    /// the goal, because the value would identify the task.
    pub goal_place_min_top_m: f32,
    /// Maximum number of objects in one container or basket.
    pub container_capacity: u32,
    /// Granted information in addition to images and proprioception.
    pub grants: Grants,
    /// Goal: the reader's own, or granted.
    pub goal: Option<Goal>,
    /// Task and partner, if granted.
    pub disclosure: Option<TaskDisclosure>,
    /// Static geometry, if the state is granted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<Layout>,
}

/// Granted information about the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskDisclosure {
    /// Task of the episode.
    pub task: TaskId,
    /// Kind of person of the partner.
    pub partner: PersonKind,
}

/// Static geometry of an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layout {
    /// Floors: rooms and doorways indoors, the bounds of the episode outdoors.
    pub floors: Vec<Rect>,
    /// Fixed boxes that block bodies: walls, lintels and furniture. Movable obstacles and heavy
    /// targets are in [`crate::observation::WorldState`].
    pub blocks: Vec<LayoutBlock>,
}

/// Upright box that blocks bodies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayoutBlock {
    /// Center in the world (x, z), meters.
    pub center_xz: Vec2,
    /// Half extents along the box's own x and z axes, meters.
    pub half_xz: Vec2,
    /// Rotation about the vertical axis, radians.
    pub yaw_rad: f32,
    /// Lowest and highest y coordinate, meters.
    pub y_range_m: [f32; 2],
}

impl LayoutBlock {
    /// Returns whether a point (x, z) is inside the box in plan, after the box is grown by
    /// `margin_m` on each side.
    pub fn contains(&self, p: Vec2, margin_m: f32) -> bool {
        let offset = p - self.center_xz;
        let local = rotate_yaw(Vec3::new(offset.x, 0.0, offset.y), -self.yaw_rad);
        local.x.abs() <= self.half_xz.x + margin_m && local.z.abs() <= self.half_xz.y + margin_m
    }
}

impl Briefing {
    /// Returns the id of the companion with this role.
    pub fn companion(&self, role: CompanionRole) -> Option<AgentId> {
        self.companions.iter().find(|c| c.role == role).map(|c| c.agent)
    }

    /// Returns the entity id of the companion's body.
    pub fn companion_entity(&self, role: CompanionRole) -> Option<EntityId> {
        self.companion(role).map(EntityId::from_agent)
    }
}
