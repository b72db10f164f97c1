//! Planner rules. Like the world's rules they are data: every difference between the paper's
//! planners and the original's code is a field, read where it matters. `docs/rules.md` lists every
//! field with its reason.

mod groups;
mod profile;

use chaic_core::Frame;
use chaic_core::briefing::Briefing;
use serde::{Deserialize, Serialize};

pub use groups::{ChildRules, FailureRules, LiftingRules, PeopleRules, PlanTimeouts, TimeRules};
pub use profile::{RuleProfile, TargetFilter, TargetOrder};

/// Navigation: path planning and path following.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Walking {
    /// Ours: a body of its true radius avoids obstacles, stops where the arm reaches, and recovers
    /// when stuck.
    Careful,
    /// The original's: 4-connected paths over soft costs with no impassable cells. Arrival is by
    /// straight-line distance, and the goal is the object's position when the plan began. There is
    /// no stuck recovery, but obstacles keep the person in the wheelchair turning in place
    /// (facts A1.5, A1.6, A2.1).
    Lattice,
}

/// Exploration strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exploration {
    /// The nearest frontier (paper section 5.1.1).
    Frontier,
    /// The cheapest of about a hundred random cells in unknown space (facts A1.10).
    Sampled,
    /// The frontier with the largest unknown area behind it per path length (ours; the inferring
    /// helper's own strategy).
    UnknownArea,
}

/// Bookkeeping of the objects that are still needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bookkeeping {
    /// The objects of the goal without those delivered or held by any agent.
    Exact,
    /// After its first pick-up, the partner stops looking for that class if one object of it was
    /// wanted. It never removes other classes, and helpers that know the goal remove none (facts A2.2).
    FirstPick,
}

/// Choice among several goal places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlaceChoice {
    /// The nearest.
    Nearest,
    /// A random one (facts A2.1).
    Random,
}

/// Obstacles that rule-based helpers remove.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObstacleChoice {
    /// Obstacles in narrow passages, as far as the helper's map shows (paper, table 1: obstacles
    /// between rooms).
    InPassages,
    /// All (facts A2.2). The default of stored rules that predate this field.
    #[default]
    All,
}

/// Distribution of the random helper's plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RandomDraw {
    /// Uniform over all valid plans.
    Plans,
    /// Uniform over the kinds of valid plans, then over the plans of that kind (facts A2.2).
    KindsFirst,
}

/// Source of the draws by which the child runs away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChildDraws {
    /// The episode's random stream.
    Seeded,
    /// The same draws in each episode: the 6th, 14th and 26th are escapes (facts A2.4).
    Constant,
}

/// Rules of all agents.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannerRules {
    /// Path planning and path following.
    pub walking: Walking,
    /// Exploration strategy.
    pub exploration: Exploration,
    /// True if every agent first looks around.
    #[serde(alias = "looks_around_first")]
    pub initial_look_around: bool,
    /// True if a plan is replaced when a better one becomes valid.
    #[serde(alias = "reconsiders")]
    pub replans: bool,
    /// True if decisions consider the time to fetch an object or to reach the goal place.
    #[serde(alias = "weighs_time")]
    pub checks_time_to_deliver: bool,
    /// True if agents deliver as soon as nothing is left to find, rather than when time runs out.
    pub delivers_when_done: bool,
    /// Minimum number of objects still needed for which a container is fetched.
    pub min_for_container: u32,
    /// Bookkeeping of the objects that are still needed.
    pub bookkeeping: Bookkeeping,
    /// Choice among several goal places.
    pub place_choice: PlaceChoice,
    /// Distance from which an object is picked up, meters (the world accepts pick-ups from up to 3 m and
    /// walks the rest).
    pub pick_within_m: f32,
    /// Distance from which an object is put on a goal place, meters.
    pub put_within_m: f32,
    /// True if an object is ignored after any failed attempt, not only after one beyond the agent's
    /// limits.
    pub any_failure_counts: bool,
    /// Time for which a goal place is ignored after a failed put-on or a delivery that timed out,
    /// frames. The plan ends, even if the other hand holds something (facts A1.9, A2.1). If it is 0,
    /// other goal places are preferred for [`FailureRules::unreachable_frames`] after a timeout.
    #[serde(alias = "goal_blackout_frames")]
    pub failed_goal_place_frames: Frame,
    /// Time for which an object is avoided after another agent was observed to hold it, frames.
    #[serde(alias = "held_frames")]
    pub seen_held_ignore_frames: Frame,
    /// True if an object is forgotten when its position is seen empty.
    pub forgets_missing: bool,
    /// True if agents see that an object is in another agent's hands.
    #[serde(alias = "sees_holding")]
    pub sees_held_objects: bool,
    /// True if partner and rule-based helpers know actions, outcomes and held objects of the other while
    /// it is in view.
    #[serde(alias = "knows_holding")]
    pub knows_partner_behavior: bool,
    /// True if rule-based helpers perceive people at all. The original's detector has no class for
    /// people, and its result replaces the environment's data (facts A5).
    pub helpers_see_people: bool,
    /// Range in which helpers without perfect segmentation mark cells as known, meters. It affects
    /// what is left to explore.
    pub helper_known_range_m: f32,
    /// True if helpers plan to lift together with the partner.
    pub lifts_together: bool,
    /// Obstacles that rule-based helpers remove.
    #[serde(default)]
    pub obstacle_choice: ObstacleChoice,
    /// Distribution of the random helper's plans.
    pub random_draw: RandomDraw,
    /// Number of turns to look around.
    #[serde(alias = "around_turns")]
    pub look_around_turns: u32,
    /// True if looking around ends as soon as partner and child have both been seen.
    #[serde(alias = "stops_turning_when_found")]
    pub look_around_stops_when_found: bool,
    /// True if helpers with rules for the child apply them; the ablation shows their benefit
    /// (ours).
    #[serde(alias = "minds_child")]
    pub supervises_child: bool,
    /// Time after which an unseen child or guardian is searched for, frames.
    pub child_unseen_frames: Frame,
    /// True if a helper stays with the child only until it turns back, rather than for a fixed time
    /// after it was last seen away.
    #[serde(alias = "trusts_child")]
    pub leaves_returning_child: bool,
    /// Source of the draws by which the child runs away.
    pub child_draws: ChildDraws,
    /// Time budgeting and replanning.
    #[serde(default)]
    pub time: TimeRules,
    /// Time limits of plans.
    #[serde(default, alias = "limits")]
    pub plan_timeouts: PlanTimeouts,
    /// Consequences of failed attempts.
    #[serde(default)]
    pub failures: FailureRules,
    /// Lifting furniture together with the partner.
    #[serde(default)]
    pub lifting: LiftingRules,
    /// Distances to people, and tracking of the child.
    #[serde(default)]
    pub people: PeopleRules,
    /// Behavior of the child itself.
    #[serde(default)]
    pub child: ChildRules,
}

impl PlannerRules {
    /// Returns the rules of the paper's planners.
    pub const fn paper() -> PlannerRules {
        PlannerRules {
            walking: Walking::Careful,
            exploration: Exploration::Frontier,
            initial_look_around: true,
            replans: true,
            checks_time_to_deliver: true,
            delivers_when_done: true,
            min_for_container: 3,
            bookkeeping: Bookkeeping::Exact,
            place_choice: PlaceChoice::Nearest,
            pick_within_m: 1.4,
            put_within_m: 1.8,
            any_failure_counts: false,
            failed_goal_place_frames: 0,
            seen_held_ignore_frames: 300,
            forgets_missing: true,
            sees_held_objects: true,
            knows_partner_behavior: false,
            helpers_see_people: true,
            helper_known_range_m: 5.0,
            lifts_together: true,
            obstacle_choice: ObstacleChoice::InPassages,
            random_draw: RandomDraw::Plans,
            look_around_turns: 18,
            look_around_stops_when_found: false,
            supervises_child: true,
            child_unseen_frames: 200,
            leaves_returning_child: true,
            child_draws: ChildDraws::Seeded,
            time: TimeRules::STANDARD,
            plan_timeouts: PlanTimeouts::STANDARD,
            failures: FailureRules::STANDARD,
            lifting: LiftingRules::STANDARD,
            people: PeopleRules::STANDARD,
            child: ChildRules::STANDARD,
        }
    }

    /// Returns the rules of the original's released planners.
    pub const fn compat() -> PlannerRules {
        PlannerRules {
            walking: Walking::Lattice,
            exploration: Exploration::Sampled,
            initial_look_around: false,
            replans: false,
            checks_time_to_deliver: false,
            delivers_when_done: false,
            min_for_container: 0,
            bookkeeping: Bookkeeping::FirstPick,
            place_choice: PlaceChoice::Random,
            pick_within_m: 1.5,
            put_within_m: 2.0,
            any_failure_counts: true,
            failed_goal_place_frames: 500,
            seen_held_ignore_frames: 500,
            forgets_missing: false,
            sees_held_objects: false,
            knows_partner_behavior: true,
            helpers_see_people: false,
            helper_known_range_m: 3.0,
            lifts_together: false,
            obstacle_choice: ObstacleChoice::All,
            random_draw: RandomDraw::KindsFirst,
            look_around_turns: 24,
            look_around_stops_when_found: true,
            supervises_child: true,
            child_unseen_frames: 200,
            leaves_returning_child: false,
            child_draws: ChildDraws::Constant,
            time: TimeRules::STANDARD,
            plan_timeouts: PlanTimeouts::STANDARD,
            failures: FailureRules::STANDARD,
            lifting: LiftingRules::STANDARD,
            people: PeopleRules::STANDARD,
            child: ChildRules::STANDARD,
        }
    }

    /// Returns whether an agent with this briefing perceives people. In the original, too, agents
    /// that know the goal have perfect segmentation; the child knows the positions of all agents.
    pub(crate) fn sees_people(&self, briefing: &Briefing) -> bool {
        self.helpers_see_people || has_perfect_eyes(briefing)
    }

    /// Range in which this agent marks cells as known, meters.
    pub(crate) fn known_range_m(&self, briefing: &Briefing) -> f32 {
        let perfect = PlannerRules::paper().helper_known_range_m;
        if has_perfect_eyes(briefing) { perfect } else { self.helper_known_range_m }
    }
}

fn has_perfect_eyes(briefing: &Briefing) -> bool {
    briefing.grants.goal || briefing.grants.positions
}

impl Default for PlannerRules {
    fn default() -> PlannerRules {
        PlannerRules::paper()
    }
}

#[cfg(test)]
mod tests;
