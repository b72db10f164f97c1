//! By which rules minds plan. Like the world's rules they are data: every difference between the
//! paper's planners and the original's code is a value here, read where it matters.
//! `docs/rules.md` lists every field with its reason.

mod groups;

use chaic_core::Frame;
use chaic_core::briefing::Briefing;
use serde::{Deserialize, Serialize};

pub use groups::{ChildRules, FailureRules, LiftingRules, PeopleRules, PlanLimits, TimeRules};

/// How ways are planned and walked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Walking {
    /// A body of its true width keeps clear of things, stands where the arm reaches, and gets free
    /// when stuck.
    Careful,
    /// The original's: 4-connected ways over soft costs, from which nothing is quite impassable;
    /// near enough is near enough as the crow flies; one goes to where an object was when the plan
    /// began; nothing is ever stuck, but obstacles keep the person in the wheelchair turning on
    /// the spot (facts A1.5, A1.6, A2.1).
    Lattice,
}

/// Where one goes to find out more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exploration {
    /// To the nearest border of the known (paper section 5.1.1).
    Frontier,
    /// To the cheapest of some hundred random cells within the unknown (facts A1.10).
    Sampled,
}

/// How one keeps track of what is still wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bookkeeping {
    /// What is wanted less what is delivered or held, by anybody.
    Exact,
    /// The partner drops a class of which one is wanted after its own first pick, and no other
    /// class ever; helpers who know the goal never drop any (facts A2.2).
    FirstPick,
}

/// Which of several goal places one goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlaceChoice {
    /// The nearest.
    Nearest,
    /// Any (facts A2.1).
    Random,
}

/// What a random helper draws from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RandomDraw {
    /// From all valid plans.
    Plans,
    /// From the kinds of valid plans, then from those of that kind (facts A2.2).
    KindsFirst,
}

/// When the child runs away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChildDraws {
    /// By the episode's own luck.
    Seeded,
    /// By the same draws in each episode, of which the 6th, 14th and 26th are escapes (facts A2.4).
    Constant,
}

/// The rules of all minds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannerRules {
    /// How ways are planned and walked.
    pub walking: Walking,
    /// Where one goes to find out more.
    pub exploration: Exploration,
    /// Whether everybody begins by looking all around.
    pub looks_around_first: bool,
    /// Whether a plan under way is left when a better one comes up.
    pub reconsiders: bool,
    /// Whether one weighs whether there is time to fetch an object, or to reach the goal place.
    pub weighs_time: bool,
    /// Whether one delivers as soon as nothing is left to find, rather than when time runs out.
    pub delivers_when_done: bool,
    /// A container is fetched for at least so many objects still wanted.
    pub min_for_container: u32,
    /// How one keeps track of what is still wanted.
    pub bookkeeping: Bookkeeping,
    /// Which of several goal places one goes to.
    pub place_choice: PlaceChoice,
    /// How near to go before an object is picked up, metres (the world steps up from 3 m).
    pub pick_within_m: f32,
    /// How near to go before something is put on a goal place, metres.
    pub put_within_m: f32,
    /// Whether an object is left alone after any failed attempt, not only one beyond one's limits.
    pub any_failure_counts: bool,
    /// How long a goal place is forgotten after a failed put-on, frames.
    pub goal_blackout_frames: Frame,
    /// How long something that somebody else was seen, told or found to hold is left alone,
    /// frames.
    pub held_frames: Frame,
    /// Whether an object is forgotten whose place is seen empty.
    pub forgets_missing: bool,
    /// Whether one sees that something is in another's hands.
    pub sees_holding: bool,
    /// Whether partner and rule-based helpers are told what the other holds while it is in view.
    pub knows_holding: bool,
    /// Whether rule-based helpers perceive people at all: the original's detector has no class for
    /// them, and its result replaces what the environment would tell (facts A5).
    pub helpers_see_people: bool,
    /// How far helpers without perfect segmentation know the place they look at, metres: it moves
    /// what is left to explore.
    pub helper_known_range_m: f32,
    /// Whether helpers lift together with the partner on purpose.
    pub lifts_together: bool,
    /// What a random helper draws from.
    pub random_draw: RandomDraw,
    /// Turns of looking all around.
    pub around_turns: u32,
    /// Whether looking around ends as soon as partner and child have both been seen.
    pub stops_turning_when_found: bool,
    /// Whether helpers with the child's rules heed them at all; without them one sees what they are
    /// worth (ours).
    pub minds_child: bool,
    /// Child or guardian unseen for so long is looked for, frames.
    pub child_unseen_frames: Frame,
    /// Whether a helper stays with the child only until it turns back, rather than for the time of
    /// following after it was last seen away.
    pub trusts_child: bool,
    /// When the child runs away.
    pub child_draws: ChildDraws,
    /// How time is weighed, and when a plan is looked at again.
    #[serde(default)]
    pub time: TimeRules,
    /// How long a plan lasts at most.
    #[serde(default)]
    pub limits: PlanLimits,
    /// What is made of failed attempts.
    #[serde(default)]
    pub failures: FailureRules,
    /// When one lifts furniture together with the partner.
    #[serde(default)]
    pub lifting: LiftingRules,
    /// How near one stays to people, and what is made of the child.
    #[serde(default)]
    pub people: PeopleRules,
    /// What the child itself does.
    #[serde(default)]
    pub child: ChildRules,
}

impl PlannerRules {
    /// The paper's planners.
    pub const fn paper() -> PlannerRules {
        PlannerRules {
            walking: Walking::Careful,
            exploration: Exploration::Frontier,
            looks_around_first: true,
            reconsiders: true,
            weighs_time: true,
            delivers_when_done: true,
            min_for_container: 3,
            bookkeeping: Bookkeeping::Exact,
            place_choice: PlaceChoice::Nearest,
            pick_within_m: 1.4,
            put_within_m: 1.8,
            any_failure_counts: false,
            goal_blackout_frames: 0,
            held_frames: 300,
            forgets_missing: true,
            sees_holding: true,
            knows_holding: false,
            helpers_see_people: true,
            helper_known_range_m: 5.0,
            lifts_together: true,
            random_draw: RandomDraw::Plans,
            around_turns: 18,
            stops_turning_when_found: false,
            minds_child: true,
            child_unseen_frames: 200,
            trusts_child: true,
            child_draws: ChildDraws::Seeded,
            time: TimeRules::STANDARD,
            limits: PlanLimits::STANDARD,
            failures: FailureRules::STANDARD,
            lifting: LiftingRules::STANDARD,
            people: PeopleRules::STANDARD,
            child: ChildRules::STANDARD,
        }
    }

    /// What the original's released planners do.
    pub const fn compat() -> PlannerRules {
        PlannerRules {
            walking: Walking::Lattice,
            exploration: Exploration::Sampled,
            looks_around_first: false,
            reconsiders: false,
            weighs_time: false,
            delivers_when_done: false,
            min_for_container: 0,
            bookkeeping: Bookkeeping::FirstPick,
            place_choice: PlaceChoice::Random,
            pick_within_m: 1.5,
            put_within_m: 2.0,
            any_failure_counts: true,
            goal_blackout_frames: 500,
            held_frames: 500,
            forgets_missing: false,
            sees_holding: false,
            knows_holding: true,
            helpers_see_people: false,
            helper_known_range_m: 3.0,
            lifts_together: false,
            random_draw: RandomDraw::KindsFirst,
            around_turns: 24,
            stops_turning_when_found: true,
            minds_child: true,
            child_unseen_frames: 200,
            trusts_child: false,
            child_draws: ChildDraws::Constant,
            time: TimeRules::STANDARD,
            limits: PlanLimits::STANDARD,
            failures: FailureRules::STANDARD,
            lifting: LiftingRules::STANDARD,
            people: PeopleRules::STANDARD,
            child: ChildRules::STANDARD,
        }
    }

    /// Whether a mind with this briefing perceives people. Whoever knows the goal has perfect
    /// segmentation in the original too; the child knows everybody's place.
    pub(crate) fn sees_people(&self, briefing: &Briefing) -> bool {
        self.helpers_see_people || has_perfect_eyes(briefing)
    }

    /// How far this mind knows the place it looks at, metres.
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
