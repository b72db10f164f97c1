//! Numbers of the rules, copied by hand from `docs/rules.md` and `docs/people.md`.
//!
//! The world has its own tables. A wrong number in either copy is a difference.

use chaic_core::capability::{Impairment, Persona};
use chaic_world::AgentSpec;

/// Rule set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RuleSet {
    /// Rules of the paper.
    Paper,
    /// Rules of the original's code.
    Compat,
}

/// Frames of the parts of actions, and the distances and counts of the rules.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbers {
    pub(crate) turn: u32,
    pub(crate) start_walking: u32,
    pub(crate) keep_walking: u32,
    pub(crate) reach: u32,
    pub(crate) grasp: u32,
    pub(crate) grasp_of_nothing: u32,
    pub(crate) return_arms: u32,
    pub(crate) gap: u32,
    pub(crate) move_arm_away: u32,
    pub(crate) open_hand: u32,
    pub(crate) max_fall_wait: u32,
    pub(crate) max_put_in_wait: u32,
    pub(crate) await_other: u32,
    pub(crate) raise_furniture: u32,
    pub(crate) refused_pick_up: u32,
    pub(crate) stride_m: f64,
    pub(crate) turn_deg: f32,
    pub(crate) min_progress_m: f64,
    pub(crate) approach_limit_m: f64,
    pub(crate) arm_m: f64,
    pub(crate) reach_limit_m: f64,
    pub(crate) furniture_reach_limit_m: f64,
    pub(crate) step_over_m: f32,
    pub(crate) capacity: usize,
    pub(crate) delivery_margin_m: f64,
    pub(crate) high_goal_m: f64,
    pub(crate) child_away_m: f64,
    pub(crate) break_within_range: f64,
    pub(crate) break_above_range: f64,
}

impl Numbers {
    /// Returns the numbers of a rule set.
    pub(crate) fn of(set: RuleSet) -> Numbers {
        let is_paper = set == RuleSet::Paper;
        Numbers {
            turn: 2,
            start_walking: 2,
            keep_walking: 1,
            reach: 16,
            grasp: 2,
            grasp_of_nothing: if is_paper { 2 } else { 0 },
            return_arms: 35,
            gap: 1,
            move_arm_away: 4,
            open_hand: 2,
            max_fall_wait: 25,
            max_put_in_wait: 24,
            await_other: if is_paper { 150 } else { 3000 },
            raise_furniture: if is_paper { 35 } else { 17 },
            refused_pick_up: if is_paper { 1 } else { 37 },
            stride_m: 0.4,
            turn_deg: 15.0,
            min_progress_m: 0.05,
            approach_limit_m: 3.0,
            arm_m: 0.7,
            reach_limit_m: 2.0,
            furniture_reach_limit_m: if is_paper { 2.0 } else { 3.0 },
            step_over_m: 0.12,
            capacity: 3,
            delivery_margin_m: 2.0,
            high_goal_m: 1.5,
            child_away_m: 3.5,
            break_within_range: if is_paper { 0.25 } else { 0.0 },
            break_above_range: if is_paper { 0.5 } else { 0.0 },
        }
    }
}

/// Limits of a person.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) pick_m: [f64; 2],
    pub(crate) put_m: [f64; 2],
    pub(crate) lift_kg: f64,
    pub(crate) speed_m: f64,
    pub(crate) approach_speed_m: f64,
    pub(crate) docking: u32,
    pub(crate) breaks_vases: bool,
    pub(crate) lifts_obstacles: bool,
    pub(crate) has_left_hand: bool,
    pub(crate) tires: bool,
    pub(crate) trembles: bool,
}

/// Work from rested to exhausted, frames.
pub(crate) const WORK_FRAMES: f32 = 400.0;
/// Rest from exhausted to rested, frames.
pub(crate) const REST_FRAMES: f32 = 200.0;
/// Share of speed and strength of an exhausted person.
pub(crate) const EXHAUSTED: f64 = 0.4;
/// Probability that a grasp of trembling hands slips.
pub(crate) const SLIP: f64 = 0.35;
/// Probability that a trembling hand drops its object in a frame.
pub(crate) const DROP: f64 = 0.001;
/// Time without progress after which a person is stuck, frames.
pub(crate) const STUCK_FRAMES: u32 = 200;
/// Minimum distance of a move that counts as progress, meters.
pub(crate) const PROGRESS_M: f64 = 0.5;

impl Limits {
    /// Returns the limits of a person.
    ///
    /// # Panics
    /// If the setup replaces the capability of the person, which generated episodes never do.
    pub(crate) fn of(person: &AgentSpec) -> Limits {
        assert!(person.capability.is_none(), "the numbers are those of the tables");
        let adult = Limits {
            pick_m: [0.0, 3.0],
            put_m: [0.0, 3.0],
            lift_kg: 600.0,
            speed_m: 0.047,
            approach_speed_m: 0.047,
            docking: 0,
            breaks_vases: false,
            lifts_obstacles: true,
            has_left_hand: true,
            tires: false,
            trembles: false,
        };
        let mut limits = match person.persona {
            Persona::Adult | Persona::Helper => adult,
            Persona::Child => Limits {
                pick_m: [0.0, 1.5],
                put_m: [0.0, 1.5],
                lift_kg: 100.0,
                speed_m: 0.0236,
                approach_speed_m: 0.0236,
                breaks_vases: true,
                ..adult
            },
            Persona::Wheelchair => Limits {
                pick_m: [0.25, 1.5],
                put_m: [0.25, 1.5],
                lift_kg: 500.0,
                lifts_obstacles: false,
                ..adult
            },
            Persona::Rider => Limits { speed_m: 0.0236, docking: 50, ..adult },
            Persona::Frail => Limits { lift_kg: 100.0, ..adult },
        };
        for impairment in person.impairments.iter() {
            match impairment {
                Impairment::OneHanded => limits.has_left_hand = false,
                Impairment::LowVision => {}
                Impairment::Tires => limits.tires = true,
                Impairment::Tremor => limits.trembles = true,
            }
        }
        limits
    }
}
