//! Constants of the simulation. Rule sets are data: a change of rules changes a value here and
//! never adds an `if` elsewhere. `docs/rules.md` lists every field with its source.

use chaic_core::TaskId;
use chaic_core::briefing::MotionParams;
use chaic_core::capability::LimitPenalty;
use chaic_core::task::GoalTop;
use serde::{Deserialize, Serialize};

/// Durations of the phases of actions, frames (facts S2.2, measured on recordings of the original).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Durations {
    /// A turn, by 15 degrees or toward an object.
    pub turn: u32,
    /// From standing to the first frame of walking.
    pub start_walking: u32,
    /// From one step to the next without stopping.
    pub keep_walking: u32,
    /// Movement of a hand to a point.
    pub reach: u32,
    /// Closing a hand.
    pub grasp: u32,
    /// Closing a hand on nothing because a limit is exceeded. Our choice: as long as a successful
    /// grasp, so that both attempts take the same time. The original omits it: 55 frames instead of
    /// 57 (facts S1.4 and S2.2).
    #[serde(alias = "vain_grasp")]
    pub failed_grasp: u32,
    /// Return of both arms to rest.
    pub reset_arms: u32,
    /// Pause between two phases of a composite action.
    #[serde(alias = "gap")]
    pub pause: u32,
    /// A short motion that moves the arm away.
    #[serde(alias = "move_away")]
    pub retract_arm: u32,
    /// Opening a hand; at least 1, because the object is released in its last frame.
    pub open_hand: u32,
    /// Maximum number of extra frames for watching a released object fall.
    #[serde(alias = "watch_fall")]
    pub max_fall_wait: u32,
    /// Maximum number of extra frames for watching an object that was put into a container. The
    /// number is drawn uniformly: a put-in takes 80 to 104 frames (facts S2.2), and the
    /// distribution is unknown.
    #[serde(alias = "watch_put_in")]
    pub max_put_in_wait: u32,
    /// Maximum number of frames that an agent at furniture waits for the other to arrive.
    pub await_partner: u32,
    /// Raising furniture after the grasp.
    pub raise_furniture: u32,
    /// A pick-up that is refused immediately: the object is out of reach, held or out of play.
    #[serde(alias = "refused_pick")]
    pub refused_pick_up: u32,
}

/// Behavior of an agent that walks into something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CollisionResponse {
    /// Bodies are solid: the agent stops, or slides along.
    Stops,
    /// Nothing blocks an agent permanently. A step that touches something ends successfully after
    /// one frame, and the next step continues through it. Targets are not tested; in the street
    /// neither are tents, shelves, bicycles and the goal place (facts S3.3).
    Creeps,
}

/// Reference point for reaching an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReachReference {
    /// Its nearest point; no wall may be in between.
    NearestPoint,
    /// Its center; walls are ignored, and a put-on requires no distance (facts S3.5 and S3.7).
    Middle,
}

/// Condition for a joint lift of furniture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointLift {
    /// Both agents have chosen the furniture and stand at it.
    BothAtIt,
    /// One agent chooses the furniture that the last action of the other was for, at any earlier
    /// time and with any outcome. Both then abort their actions and walk to it (facts S9.4).
    LastChoice,
}

/// Rules of a world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rules {
    /// Durations of the phases of actions, frames.
    pub durations: Durations,
    /// A step ends after more than this distance, meters (facts S2.2).
    pub stride_m: f32,
    /// Angle of one turn, radians (facts S3.1: 15 degrees).
    pub turn_rad: f32,
    /// A step that covered less than this distance fails, meters: an eighth of a step.
    pub min_progress_m: f32,
    /// Behavior of an agent that walks into something.
    pub blocking: CollisionResponse,
    /// Agents step over objects below this height, meters (facts S1.5: probe from 0.12 m).
    pub step_over_m: f32,
    /// Maximum distance from which an agent approaches an object, meters. It is measured from the
    /// center, less half of the longer side (facts S1.1).
    pub approach_limit_m: f32,
    /// Target distance of an approach to the nearest point of an object, meters. The original stops
    /// 0.7 m from the center (facts S2.2). Bodies are solid here, so it is an arm's length from the
    /// edge.
    pub arm_reach_m: f32,
    /// Maximum reach to an object when a closer approach is impossible and no wall is in between,
    /// meters (facts S3.5: 2 m to the center).
    pub reach_limit_m: f32,
    /// The same limit for furniture that is being moved (facts S9.3: 3 m).
    pub furniture_reach_limit_m: f32,
    /// Reference point for reaching.
    pub reach_to: ReachReference,
    /// Condition for a joint lift of furniture.
    pub joint_lift: JointLift,
    /// True if all agents are informed at once about removed obstacles (facts S5.5).
    #[serde(alias = "tells_removed")]
    pub announces_removed_obstacles: bool,
    /// Chance of a pick-up beyond the height range of the agent (facts S1.3).
    pub pick_penalty: LimitPenalty,
    /// Chance of a put-on beyond the height range of the agent (facts S1.3).
    pub put_penalty: LimitPenalty,
    /// Chance of a lift beyond the strength of the agent (facts S1.3).
    pub lift_penalty: LimitPenalty,
    /// Maximum number of objects in a container or basket (paper section 3.3).
    pub container_capacity: u32,
    /// Maximum distance from the goal place at which a released object counts as delivered, meters.
    /// It is measured from the center, less half of the longer side (facts S5.2).
    pub delivery_margin_m: f32,
    /// True if an object that a failed put-on dropped counts if it lands close enough. The radius
    /// rule of the original allows it.
    #[serde(alias = "dropped_counts")]
    pub failed_put_on_can_deliver: bool,
    /// True if a successful put-on anywhere delivers all objects that its agent has released so
    /// far, and the object that the agent drops in the next put-on. It is the second rule of the
    /// original, made for high goal places (facts S5.3): there a failed put-on delivers nothing by
    /// itself.
    #[serde(alias = "delivered_anywhere")]
    pub put_on_delivers_all_released: bool,
    /// True if briefings list containers when a wheelchair user takes part. The agents of the
    /// original ignore containers there (facts S13, number 12).
    pub containers_with_wheelchair: bool,
    /// True if fragile objects may be targets. In the original's data no agent can pick them, but
    /// they count in the total (facts S6).
    pub fragile_targets: bool,
    /// Chance that a fragile object within a child's reach breaks during a pick-up (facts S6).
    pub break_chance_low: f32,
    /// The same chance above the child's reach.
    pub break_chance_high: f32,
    /// Distance from its guardian beyond which the child counts as away, meters (facts S8.4).
    pub child_away_m: f32,
    /// Minimum top height of a high goal place, meters (facts S5.1).
    pub high_goal_min_top_m: f32,
    /// Time step of one frame for falling objects, seconds (facts S2.1: one physics step of 0.01
    /// s).
    pub fall_step_s: f32,
}

impl Rules {
    /// Returns the minimum top height of the goal place of a task, meters; 0 for no condition.
    pub fn goal_min_top_m(&self, task: TaskId) -> f32 {
        match task.info().goal_top {
            GoalTop::High => self.high_goal_min_top_m,
            GoalTop::Any => 0.0,
        }
    }

    /// Returns the motion parameters for the briefing.
    pub fn motion(&self) -> MotionParams {
        let Rules { turn_rad, stride_m, step_over_m, arm_reach_m, reach_limit_m, .. } = *self;
        MotionParams { turn_rad, stride_m, step_over_m, arm_reach_m, reach_limit_m }
    }

    /// Returns the rules of the paper, with measured values of the original where the paper has
    /// none.
    pub const fn paper() -> Rules {
        Rules {
            durations: Durations {
                turn: 2,
                start_walking: 2,
                keep_walking: 1,
                reach: 16,
                grasp: 2,
                failed_grasp: 2,
                reset_arms: 35,
                pause: 1,
                retract_arm: 4,
                open_hand: 2,
                max_fall_wait: 25,
                max_put_in_wait: 24,
                await_partner: 150,
                raise_furniture: 35,
                refused_pick_up: 1,
            },
            stride_m: 0.4,
            turn_rad: std::f32::consts::PI / 12.0,
            min_progress_m: 0.05,
            blocking: CollisionResponse::Stops,
            step_over_m: 0.12,
            approach_limit_m: 3.0,
            arm_reach_m: 0.7,
            reach_limit_m: 2.0,
            furniture_reach_limit_m: 2.0,
            reach_to: ReachReference::NearestPoint,
            joint_lift: JointLift::BothAtIt,
            announces_removed_obstacles: false,
            pick_penalty: LimitPenalty::PICK,
            put_penalty: LimitPenalty::PUT,
            lift_penalty: LimitPenalty::LIFT,
            container_capacity: 3,
            delivery_margin_m: 2.0,
            failed_put_on_can_deliver: false,
            put_on_delivers_all_released: false,
            containers_with_wheelchair: true,
            fragile_targets: true,
            break_chance_low: 0.25,
            break_chance_high: 0.5,
            child_away_m: 3.5,
            high_goal_min_top_m: 1.5,
            fall_step_s: 0.01,
        }
    }

    /// Returns the rules of the original's released code, where a difference affects a score.
    /// `docs/rules.md` gives the reason of each difference.
    pub const fn compat() -> Rules {
        let paper = Rules::paper();
        Rules {
            durations: Durations {
                // Facts S9.4: an agent that is called to lift comes from any distance.
                await_partner: 3000,
                // Facts S9.3: raised by one reach, without returning the arms.
                raise_furniture: 17,
                // Facts S2.2: one frame, then both arms return.
                refused_pick_up: 37,
                // Facts S1.4 and S2.2: after a failed reach the arms return at once.
                failed_grasp: 0,
                ..paper.durations
            },
            blocking: CollisionResponse::Creeps,
            furniture_reach_limit_m: 3.0,
            reach_to: ReachReference::Middle,
            joint_lift: JointLift::LastChoice,
            announces_removed_obstacles: true,
            failed_put_on_can_deliver: true,
            put_on_delivers_all_released: true,
            containers_with_wheelchair: false,
            fragile_targets: false,
            break_chance_low: 0.0,
            break_chance_high: 0.0,
            ..paper
        }
    }
}

impl Default for Rules {
    fn default() -> Rules {
        Rules::paper()
    }
}
