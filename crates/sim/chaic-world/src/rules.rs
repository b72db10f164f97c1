//! By which constants a world goes on. Rule sets are data: a change of rules is a change of a
//! value here, never an `if` elsewhere. `docs/rules.md` lists every field with its source.

use chaic_core::TaskId;
use chaic_core::briefing::Motion;
use chaic_core::capability::LimitPenalty;
use chaic_core::task::GoalTop;
use serde::{Deserialize, Serialize};

/// Frames that the parts of actions take (facts S2.2, measured on the original's
/// recordings).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Durations {
    /// A turn, be it by 15 degrees or towards a thing.
    pub turn: u32,
    /// From standing to the first frame of walking.
    pub start_walking: u32,
    /// From one step ahead to the next without stopping.
    pub keep_walking: u32,
    /// Moving a hand to a point.
    pub reach: u32,
    /// Closing a hand.
    pub grasp: u32,
    /// Closing a hand on nothing, where a limit is exceeded. As long as a good one, so that both
    /// attempts take the same time: ours. The original leaves it out (facts S1.4 and S2.2: 55
    /// frames in place of 57).
    pub vain_grasp: u32,
    /// Bringing both arms back.
    pub reset_arms: u32,
    /// Between two parts of a composite action.
    pub gap: u32,
    /// A short motion of the arm out of the way.
    pub move_away: u32,
    /// Opening a hand.
    pub open_hand: u32,
    /// Most further frames in which one watches what was let go.
    pub watch_fall: u32,
    /// Most further frames in which one watches what was put into a container. How many they are
    /// is drawn evenly: a put-in takes 80 to 104 frames (facts S2.2), and nothing says how often
    /// which.
    pub watch_put_in: u32,
    /// Most frames that one who stands at furniture waits for the other who is on the way to it.
    pub await_partner: u32,
    /// Raising furniture once it is in hand.
    pub raise_furniture: u32,
    /// A pick-up that is refused at once: the thing is too far off, held or out of play.
    pub refused_pick: u32,
}

/// What becomes of somebody who walks against something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Blocking {
    /// Bodies are solid: it stops, or slides along.
    Stops,
    /// Nothing stops it for good: a step that meets something ends after one frame, well, and the
    /// next one goes on through. Targets, and in the street tents, shelves, bicycle and goal place
    /// are not even met (facts S3.3).
    Creeps,
}

/// From where one reaches a thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReachTo {
    /// Its nearest point counts, and no wall may be between.
    NearestPoint,
    /// Its middle counts, walls don't, and putting something somewhere asks for no distance at
    /// all (facts S3.5 and S3.7).
    Middle,
}

/// When two lift furniture together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointLift {
    /// When both have chosen to, and stand at it.
    BothAtIt,
    /// When one chooses to and the other's last choice was the same piece, however long ago and
    /// however it ended: both drop what they do and go there (facts S9.4).
    LastChoice,
}

/// The rules of a world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rules {
    /// Frames of the parts of actions.
    pub durations: Durations,
    /// A step ahead ends once it has covered more than this, metres (facts S2.2).
    pub stride_m: f32,
    /// One turn, radians (facts S3.1: 15 degrees).
    pub turn_rad: f32,
    /// A step ahead that covered less than this failed, metres: an eighth of a step.
    pub min_progress_m: f32,
    /// What becomes of somebody who walks against something.
    pub blocking: Blocking,
    /// Lower things are stepped over, metres (facts S1.5: the original's probe begins at 0.12 m).
    pub step_over_m: f32,
    /// Farthest that one steps up to a thing, from its middle less half its longer side, metres
    /// (facts S1.1).
    pub approach_limit_m: f32,
    /// How near one steps up to the nearest point of a thing, metres: the original stops 0.7 m
    /// from the middle (facts S2.2); here bodies are solid, so it is an arm's length from the edge.
    pub arm_reach_m: f32,
    /// From how far one still reaches a thing that one can't step up to any nearer, metres, if no
    /// wall is between (facts S3.5: 2 m to the middle).
    pub reach_limit_m: f32,
    /// The same for furniture that is being moved (facts S9.3: 3 m).
    pub furniture_reach_limit_m: f32,
    /// From where reaching is measured.
    pub reach_to: ReachTo,
    /// When two lift furniture together.
    pub joint_lift: JointLift,
    /// Whether everybody is told at once which obstacles have been removed (facts S5.5).
    pub tells_removed: bool,
    /// Chance of picking up beyond one's range of heights (facts S1.3).
    pub pick_penalty: LimitPenalty,
    /// Chance of putting on beyond one's range of heights (facts S1.3).
    pub put_penalty: LimitPenalty,
    /// Chance of lifting beyond one's strength (facts S1.3).
    pub lift_penalty: LimitPenalty,
    /// Objects in one container or basket (paper section 3.3).
    pub container_capacity: u32,
    /// How far from the goal place's middle, less half its longer side, a released thing may come
    /// to rest and still count, metres (facts S5.2).
    pub delivery_margin_m: f32,
    /// Whether a thing that was dropped by a put-on beyond one's limits counts if it lands near
    /// enough; the original's radius rule lets it.
    pub dropped_counts: bool,
    /// Whether a put-on that succeeded anywhere delivers all that its agent has let go so far:
    /// the original's second rule (facts S5.3), taken for a mistake and off in both rule sets.
    pub delivered_anywhere: bool,
    /// Whether containers are offered where a wheelchair takes part; the original's minds never
    /// take note of one there (facts S13, number 12).
    pub containers_with_wheelchair: bool,
    /// Whether fragile things may be targets; in the original's data nobody can go for them, but
    /// they count in the total (facts S6).
    pub fragile_targets: bool,
    /// Chance that a fragile thing within a child's reach breaks when picked up (facts S6).
    pub break_chance_low: f32,
    /// The same above the child's reach.
    pub break_chance_high: f32,
    /// The child is away beyond this distance from its guardian, metres (facts S8.4).
    pub child_away_m: f32,
    /// Lowest top that counts as a high goal place, metres (facts S5.1).
    pub high_goal_min_top_m: f32,
    /// Time of one frame for falling things, seconds (facts S2.1: one physics step of 0.01 s).
    pub fall_step_s: f32,
}

impl Rules {
    /// Lowest top that counts as a task's goal place, metres; 0 for no condition.
    pub fn goal_min_top_m(&self, task: TaskId) -> f32 {
        match task.info().goal_top {
            GoalTop::High => self.high_goal_min_top_m,
            GoalTop::Any => 0.0,
        }
    }

    /// What a briefing says of these rules.
    pub fn motion(&self) -> Motion {
        let Rules { turn_rad, stride_m, step_over_m, arm_reach_m, reach_limit_m, .. } = *self;
        Motion { turn_rad, stride_m, step_over_m, arm_reach_m, reach_limit_m }
    }

    /// The paper's rules, with the original's measured numbers where the paper gives none.
    pub const fn paper() -> Rules {
        Rules {
            durations: Durations {
                turn: 2,
                start_walking: 2,
                keep_walking: 1,
                reach: 16,
                grasp: 2,
                vain_grasp: 2,
                reset_arms: 35,
                gap: 1,
                move_away: 4,
                open_hand: 2,
                watch_fall: 25,
                watch_put_in: 24,
                await_partner: 150,
                raise_furniture: 35,
                refused_pick: 1,
            },
            stride_m: 0.4,
            turn_rad: std::f32::consts::PI / 12.0,
            min_progress_m: 0.05,
            blocking: Blocking::Stops,
            step_over_m: 0.12,
            approach_limit_m: 3.0,
            arm_reach_m: 0.7,
            reach_limit_m: 2.0,
            furniture_reach_limit_m: 2.0,
            reach_to: ReachTo::NearestPoint,
            joint_lift: JointLift::BothAtIt,
            tells_removed: false,
            pick_penalty: LimitPenalty { alpha: 1.0, beta: 2.0 },
            put_penalty: LimitPenalty { alpha: 1.0, beta: 1.0 },
            lift_penalty: LimitPenalty { alpha: 50.0, beta: 1.0 },
            container_capacity: 3,
            delivery_margin_m: 2.0,
            dropped_counts: false,
            delivered_anywhere: false,
            containers_with_wheelchair: true,
            fragile_targets: true,
            break_chance_low: 0.25,
            break_chance_high: 0.5,
            child_away_m: 3.5,
            high_goal_min_top_m: 1.5,
            fall_step_s: 0.01,
        }
    }

    /// What the original's released code does, where that moves a score: see `docs/rules.md` for
    /// the reason of each difference.
    pub const fn compat() -> Rules {
        let paper = Rules::paper();
        Rules {
            durations: Durations {
                // Whoever is called to lift comes, from wherever (facts S9.4).
                await_partner: 3000,
                // Facts S9.3: raised by one reach, without bringing the arms back.
                raise_furniture: 17,
                // Facts S2.2: one frame, then both arms are brought back.
                refused_pick: 37,
                // Facts S1.4 and S2.2: after a failed reach the arms are brought back at once.
                vain_grasp: 0,
                ..paper.durations
            },
            blocking: Blocking::Creeps,
            furniture_reach_limit_m: 3.0,
            reach_to: ReachTo::Middle,
            joint_lift: JointLift::LastChoice,
            tells_removed: true,
            dropped_counts: true,
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
