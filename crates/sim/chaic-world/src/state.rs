//! Complete state of an episode, as plain data.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::geom::Pose;
use chaic_core::{AgentId, EntityId, Frame, Outcome, Quat, ResolvedAction, Vec3};
use serde::{Deserialize, Serialize};

/// Everything that changes during an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Number of elapsed frames.
    pub frame: Frame,
    /// State of each object, in the order of the setup.
    pub objects: Vec<ObjectState>,
    /// State of each agent, in the order of the setup.
    pub agents: Vec<AgentState>,
    /// Furniture that two agents carry together.
    pub joint: Option<JointCarry>,
    /// Number of frames in which the child was away from its guardian.
    pub child_away_frames: u32,
    /// True if the child is away now.
    pub child_is_away: bool,
    /// Number of frames in which the partner or the helper was stuck.
    pub stuck_frames: u32,
    /// True if the episode has ended.
    pub over: bool,
    /// Fatigue and tremor draws of each agent; empty if no agent tires or has a tremor. Snapshots
    /// append it after the other fields, so worlds without such agents keep their previous
    /// encoding.
    #[serde(skip)]
    pub impairment_states: Vec<ImpairmentState>,
}

/// State of an agent that tires or has a tremor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImpairmentState {
    /// Fatigue: 0 rested, 1 exhausted.
    pub fatigue: f32,
    /// Number of draws that decided whether a grasp slips.
    pub slips: u32,
    /// Number of draws that decided whether a held object drops.
    pub drops: u32,
}

/// Number of draws of each purpose for an agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RandomDrawCounts {
    /// Draws of whether a fragile object breaks.
    pub breaks: u32,
    /// Draws of whether a pick-up succeeds.
    pub takes: u32,
    /// Draws of whether a put-on succeeds.
    pub puts_on: u32,
    /// Draws of the number of frames for watching a put-in.
    pub puts_in: u32,
}

/// State of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectState {
    /// Center of the bottom face in the world, meters.
    pub position: Vec3,
    /// Rotation from the object frame to the world frame.
    pub rotation: Quat,
    /// Location in terms of the rules.
    pub location: ObjectLocation,
    /// Frame of the delivery.
    pub delivered: Option<Frame>,
    /// Agent that delivered the object.
    pub delivered_by: Option<AgentId>,
    /// Agent that held the object last.
    pub last_holder: Option<AgentId>,
    /// Goal place on which a successful put-on released the object, until the next pick-up.
    pub released_at: Option<EntityId>,
}

/// Location of an object in terms of the rules.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ObjectLocation {
    /// At rest on the ground or on another object.
    Resting {
        /// Supporting object; `None` for the ground.
        on: Option<EntityId>,
    },
    /// Falling along a path that was computed at the release.
    Falling {
        /// Remaining positions and rotations, in reverse order.
        path: Vec<(Vec3, Quat)>,
        /// Object that will support it; `None` for the ground.
        on: Option<EntityId>,
    },
    /// In a hand. Furniture has `Right`, a bicycle `Left`.
    Held {
        /// Agent that holds it.
        by: AgentId,
        /// Hand that holds it.
        hand: Hand,
    },
    /// In a container or the basket of a bicycle.
    Inside {
        /// Container or bicycle.
        container: EntityId,
        /// Slot in the container.
        slot: u8,
    },
    /// Broken and removed from the scene.
    Broken,
}

/// State of an agent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgentState {
    /// Current pose.
    pub pose: Pose,
    /// Objects in the left and the right hand. Furniture is in both.
    pub hands: [Option<EntityId>; 2],
    /// Current action; `None` if the agent waits for a decision.
    pub activity: Option<Activity>,
    /// Last completed action with its outcome.
    pub last: Option<(ResolvedAction, Outcome)>,
    /// Last completed action other than movement and waiting: end frame, action and outcome.
    pub last_interaction: Option<(Frame, ResolvedAction, Outcome)>,
    /// True if the legs keep moving from the previous frame.
    pub in_stride: bool,
    /// Total distance walked, meters; the animation of legs and wheels depends on it.
    pub walked_m: f32,
    /// Number of random draws per purpose.
    pub draws: RandomDrawCounts,
    /// Last progress of the agent.
    pub progress: LastProgress,
}

/// An agent without progress for this number of frames is stuck. Our choice: longer than
/// any action other than waiting for another agent.
pub const STUCK_AFTER_FRAMES: Frame = 200;
/// A move of more than this distance from the position of the last progress is progress, meters.
/// Our choice: more than one step, so that stepping back and forth is none.
pub const PROGRESS_M: f32 = 0.5;

/// Time and position of the last progress of an agent.
///
/// Progress is a move of more than [`PROGRESS_M`] from the last such position, walking or carried
/// along. A completed action other than a step, a turn or a wait is also progress. Such an action
/// must succeed or fail by exceeding a limit, which is decided by a random draw. The reason for a
/// lack of progress does not matter: deliberate waiting also counts as none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LastProgress {
    /// Frame of the last progress.
    pub frame: Frame,
    /// Position at that frame.
    pub position: Vec3,
    /// True if the agent is stuck: that frame was at least [`STUCK_AFTER_FRAMES`] ago.
    pub is_stuck: bool,
}

impl AgentState {
    /// Creates an idle agent with empty hands.
    pub fn new(pose: Pose) -> AgentState {
        AgentState {
            pose,
            hands: [None; 2],
            activity: None,
            last: None,
            last_interaction: None,
            in_stride: false,
            walked_m: 0.0,
            draws: RandomDrawCounts::default(),
            progress: LastProgress { frame: 0, position: pose.position, is_stuck: false },
        }
    }
}

/// An action in progress.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// The action.
    pub action: ResolvedAction,
    /// Start frame.
    pub since: Frame,
    /// Current step.
    pub step: ActionStep,
    /// Remaining steps, in reverse order.
    pub queue: Vec<ActionStep>,
    /// Failure with which the action will end, if it is already decided.
    pub failing: Option<FailureReason>,
}

/// Step of an action.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionStep {
    /// Kind of the step, with its parameters.
    pub phase: Phase,
    /// Number of elapsed frames.
    pub elapsed: u32,
    /// Duration in frames, if it is fixed.
    pub frames: u32,
}

/// Kind of a step of an action.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Phase {
    /// Stands between two motions, or waits.
    Stand,
    /// Walks straight ahead.
    Walk {
        /// Remaining distance, meters.
        remaining_m: f32,
        /// Covered distance, meters.
        covered_m: f32,
    },
    /// Walks straight toward an object.
    Approach {
        /// The object.
        to: EntityId,
        /// Number of consecutive frames without approaching.
        stuck: u32,
    },
    /// Turns; the yaw changes in the first frame.
    Turn {
        /// Final yaw, radians.
        to_yaw_rad: f32,
    },
    /// Turns to face an object.
    Face {
        /// The object.
        to: EntityId,
    },
    /// Docks the vehicle.
    Dock,
    /// Moves one hand or both to a point.
    Reach {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// Target point in the world, meters.
        to: Vec3,
        /// True if the attempt fails.
        fails: bool,
    },
    /// Closes the hand around an object.
    Grasp {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// The object.
        object: EntityId,
    },
    /// Stands at furniture until the other agent stands at it too.
    WaitForOtherAgent {
        /// The furniture.
        object: EntityId,
        /// Number of consecutive frames in which no other agent tried to take it.
        absent: u32,
    },
    /// Follows in a joint carry until the leader releases the furniture.
    CarryAlong,
    /// Takes no time: decides whether the pick-up is possible and succeeds.
    DecidePickUp {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// The object.
        object: EntityId,
    },
    /// Takes no time: decides whether the put-on is possible and succeeds.
    DecidePutOn {
        /// The hand; `None` for the contents of a rider's basket or for furniture in both hands.
        hand: Option<Hand>,
        /// The place.
        place: EntityId,
    },
    /// Takes no time: chooses a spot for a removed obstacle.
    ChooseSetDownSpot {
        /// The hand that holds it.
        hand: Hand,
        /// The obstacle.
        obstacle: EntityId,
    },
    /// Opens the hand above a place.
    Release {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// The released object.
        object: EntityId,
        /// The place it is intended for; `None` for a drop.
        on: Option<EntityId>,
        /// Position of its bottom at the release, in the world, meters.
        at: Vec3,
        /// True if it is set down upright at this position instead of dropped.
        set_down: bool,
    },
    /// Puts a held object into the held container.
    Insert {
        /// The object.
        object: EntityId,
        /// The container.
        container: EntityId,
    },
    /// Returns the arms to rest.
    ResetArms {
        /// Start position of the hand in the world, meters.
        from: Option<Vec3>,
        /// The hand; `None` for both.
        hand: Option<Hand>,
    },
}

/// Two agents that carry one piece of furniture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointCarry {
    /// The furniture.
    pub object: EntityId,
    /// Agent that leads and decides.
    pub leader: AgentId,
    /// Agent that follows.
    pub follower: AgentId,
    /// Position of the follower in the frame of the leader, meters.
    pub follower_in_leader: Vec3,
    /// True if the leader holds the furniture already.
    pub under_way: bool,
}

impl ActionStep {
    /// Creates a step with a fixed number of frames.
    pub(crate) fn new(phase: Phase, frames: u32) -> ActionStep {
        ActionStep { phase, elapsed: 0, frames }
    }

    /// Returns the completed fraction, 0 to 1.
    pub fn progress(&self) -> f32 {
        if self.frames == 0 { 1.0 } else { (self.elapsed as f32 / self.frames as f32).min(1.0) }
    }
}

impl ObjectState {
    /// Returns whether the object is at rest and could be taken.
    pub fn is_resting(&self) -> bool {
        matches!(self.location, ObjectLocation::Resting { .. })
    }

    /// Returns the agent whose hand holds the object.
    pub fn holder(&self) -> Option<AgentId> {
        match self.location {
            ObjectLocation::Held { by, .. } => Some(by),
            _ => None,
        }
    }
}

impl AgentState {
    /// Returns the current step of the action.
    pub fn phase(&self) -> Option<&ActionStep> {
        self.activity.as_ref().map(|a| &a.step)
    }
}
