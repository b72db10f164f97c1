//! How an episode stands: plain data, and the whole of it.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::geom::Pose;
use chaic_core::{AgentId, EntityId, Frame, Outcome, Quat, ResolvedAction, Vec3};
use serde::{Deserialize, Serialize};

use crate::luck::Draws;

/// Everything that changes during an episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Frames that have passed.
    pub frame: Frame,
    /// Per thing, in the setup's order.
    pub things: Vec<ThingState>,
    /// Per person, in the setup's order.
    pub people: Vec<PersonState>,
    /// The furniture that two people carry together, if any.
    pub joint: Option<JointCarry>,
    /// Frames in which the child was away from its guardian.
    pub child_away_frames: u32,
    /// Whether it is away now.
    pub child_is_away: bool,
    /// Frames in which the partner or the helper was stuck.
    pub stuck_frames: u32,
    /// Whether the episode has ended.
    pub over: bool,
    /// Per person, how tired it is and the like; empty if nobody tires or trembles. It stands behind
    /// the rest in a snapshot, so that worlds without such people have the bytes that they always
    /// had.
    #[serde(skip)]
    pub conditions: Vec<Condition>,
}

/// What changes about a person who tires or trembles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// 0 rested, 1 exhausted.
    pub fatigue: f32,
    /// Draws of whether a grasp slips.
    pub slips: u32,
    /// Draws of whether something drops.
    pub drops: u32,
}

/// One thing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThingState {
    /// Middle of the bottom in the thing's own frame, in the world, metres.
    pub position: Vec3,
    /// Rotates from the thing's own frame to the world.
    pub rotation: Quat,
    /// Where it is in the sense of the rules.
    pub place: Place,
    /// When it was delivered.
    pub delivered: Option<Frame>,
    /// Who delivered it.
    pub delivered_by: Option<AgentId>,
    /// Who held it last.
    pub last_holder: Option<AgentId>,
    /// The goal place that it was released on by a put-on that succeeded, until it is taken again.
    pub released_at: Option<EntityId>,
}

/// Where a thing is, in the sense of the rules.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Place {
    /// It lies still, on the ground or on another thing.
    Resting {
        /// What it lies on, if not the ground.
        on: Option<EntityId>,
    },
    /// It falls along a path that was worked out when it was let go.
    Falling {
        /// Positions and rotations still to come, last first.
        path: Vec<(Vec3, Quat)>,
        /// What it will lie on.
        on: Option<EntityId>,
    },
    /// It is in somebody's hand; furniture and bicycles are held by the right and the left.
    Held {
        /// Whose.
        by: AgentId,
        /// Which.
        hand: Hand,
    },
    /// It is in a container or a bicycle's basket.
    Inside {
        /// Which.
        container: EntityId,
        /// Its place there.
        slot: u8,
    },
    /// It is broken and gone.
    Broken,
}

/// One person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PersonState {
    /// Where.
    pub pose: Pose,
    /// What the left and the right hand hold. Furniture is in both.
    pub hands: [Option<EntityId>; 2],
    /// What this person is doing; `None` while it waits to be asked.
    pub activity: Option<Activity>,
    /// The last action with its outcome.
    pub last: Option<(ResolvedAction, Outcome)>,
    /// The last action other than moving and waiting, for onlookers: when it ended, and how.
    pub last_deed: Option<(Frame, ResolvedAction, Outcome)>,
    /// Whether the legs are still moving from the last frame.
    pub in_stride: bool,
    /// Distance walked so far, metres; legs and wheels turn by it.
    pub walked_m: f32,
    /// How many draws of luck this person has had.
    pub draws: Draws,
    /// The last progress that this person made.
    pub progress: LastProgress,
}

/// Who has made no progress for so many frames is stuck (ours: twice as long as the longest action
/// other than waiting for another takes).
pub const STUCK_AFTER_FRAMES: Frame = 200;
/// Getting farther than this from where one made progress last is progress, metres (ours: more than
/// a step, so that stepping to and fro is none).
pub const PROGRESS_M: f32 = 0.5;

/// When and where a person made progress last: got farther than [`PROGRESS_M`] from where it had
/// made some before, on its own feet or carried along, or carried out an action that was neither a
/// step, nor a turn, nor a wait: well, or failing because it was beyond its limits, which is a draw
/// of luck. Why it makes none does not matter: who waits on purpose makes none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LastProgress {
    /// When.
    pub frame: Frame,
    /// Where it stood then.
    pub position: Vec3,
    /// Whether it is stuck: that was [`STUCK_AFTER_FRAMES`] ago or longer.
    pub is_stuck: bool,
}

impl PersonState {
    /// Somebody who stands there with empty hands and has done nothing yet.
    pub fn at(pose: Pose) -> PersonState {
        PersonState {
            pose,
            hands: [None; 2],
            activity: None,
            last: None,
            last_deed: None,
            in_stride: false,
            walked_m: 0.0,
            draws: Draws::default(),
            progress: LastProgress { frame: 0, position: pose.position, is_stuck: false },
        }
    }
}

/// An action under way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// The action.
    pub action: ResolvedAction,
    /// When it began.
    pub since: Frame,
    /// What is being done right now.
    pub step: Step,
    /// What is still to be done, next one last.
    pub queue: Vec<Step>,
    /// Why the action will have failed when it ends, if that is already certain.
    pub failing: Option<FailureReason>,
}

/// A part of an action.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// What is done.
    pub phase: Phase,
    /// Frames it has taken.
    pub elapsed: u32,
    /// Frames it takes, if that is fixed.
    pub frames: u32,
}

/// What a person does in a part of an action.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Phase {
    /// Standing, between two motions or waiting.
    Stand,
    /// Walking ahead.
    Walk {
        /// Distance still to go, metres.
        left_m: f32,
        /// Distance made so far, metres.
        made_m: f32,
    },
    /// Walking straight up to a thing.
    Approach {
        /// The thing.
        to: EntityId,
        /// Frames in which it came no nearer.
        stuck: u32,
    },
    /// Turning; the yaw snaps at the end of the first frame.
    Turn {
        /// The yaw after it, radians.
        to_yaw_rad: f32,
    },
    /// Turning to face a thing.
    Face {
        /// The thing.
        to: EntityId,
    },
    /// Docking the vehicle.
    Dock,
    /// Moving a hand (or both) to a point.
    Reach {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// Where, in the world, metres.
        to: Vec3,
        /// Whether it is a failed attempt.
        fails: bool,
    },
    /// Closing the hand around a thing.
    Grasp {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// The thing.
        object: EntityId,
    },
    /// Standing at a piece of furniture until the other stands at it too.
    AwaitPartner {
        /// The furniture.
        object: EntityId,
        /// Frames in which the other wasn't after it.
        absent: u32,
    },
    /// Carrying along as the second of two, until the first lets go.
    CarryAlong,
    /// Takes no time: whether taking the object can be tried, and with which luck.
    JudgeTake {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// The object.
        object: EntityId,
    },
    /// Takes no time: whether putting down can be tried, and with which luck.
    JudgePut {
        /// The hand; `None` for whatever a rider's basket or two hands hold.
        hand: Option<Hand>,
        /// The place.
        place: EntityId,
    },
    /// Takes no time: where to put a removed obstacle.
    JudgeAside {
        /// The hand that holds it.
        hand: Hand,
        /// The obstacle.
        obstacle: EntityId,
    },
    /// Opening the hand above a place.
    Release {
        /// The hand; `None` for both.
        hand: Option<Hand>,
        /// The thing let go.
        object: EntityId,
        /// The place it is meant for; `None` where it is just let go.
        on: Option<EntityId>,
        /// Where its bottom is let go, in the world, metres.
        at: Vec3,
        /// Whether it is set down upright where it is rather than dropped.
        set_down: bool,
    },
    /// Putting a held object into the held container.
    Insert {
        /// The object.
        object: EntityId,
        /// The container.
        container: EntityId,
    },
    /// Bringing the arms back to rest.
    ResetArms {
        /// Where the hand comes from, in the world, metres.
        from: Option<Vec3>,
        /// The hand; `None` for both.
        hand: Option<Hand>,
    },
}

/// Two people carrying one piece of furniture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointCarry {
    /// The furniture.
    pub object: EntityId,
    /// The one who leads and decides.
    pub leader: AgentId,
    /// The one who follows.
    pub follower: AgentId,
    /// The follower's position in the leader's frame, metres.
    pub follower_in_leader: Vec3,
    /// Whether the leader has it in hand already.
    pub under_way: bool,
}

impl Step {
    /// A step that takes a fixed number of frames.
    pub(crate) fn of(phase: Phase, frames: u32) -> Step {
        Step { phase, elapsed: 0, frames }
    }

    /// How much of it is done, 0 to 1.
    pub fn progress(&self) -> f32 {
        if self.frames == 0 { 1.0 } else { (self.elapsed as f32 / self.frames as f32).min(1.0) }
    }
}

impl ThingState {
    /// Whether it lies still and could be taken.
    pub fn is_resting(&self) -> bool {
        matches!(self.place, Place::Resting { .. })
    }

    /// The person whose hand holds it.
    pub fn holder(&self) -> Option<AgentId> {
        match self.place {
            Place::Held { by, .. } => Some(by),
            _ => None,
        }
    }
}

impl PersonState {
    /// What this person is doing right now.
    pub fn phase(&self) -> Option<&Step> {
        self.activity.as_ref().map(|a| &a.step)
    }
}
