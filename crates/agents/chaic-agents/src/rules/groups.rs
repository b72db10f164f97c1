//! The constants of the planners, in groups. Both rule sets have the same ones: what the original's
//! code does otherwise is a field of [`PlannerRules`](super::PlannerRules) itself.

use chaic_core::Frame;
use serde::{Deserialize, Serialize};

/// How time is weighed, and when a plan is looked at again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeRules {
    /// A plan under way is looked at again after so long, frames. Ours: a walk of four steps; what
    /// comes up is looked at at once.
    pub reconsider_frames: Frame,
    /// What the partner was last known to hold counts as done for so long, frames. Ours: as long
    /// as what somebody else holds is left alone (`held_frames` of the paper's rules).
    pub partner_holds_frames: Frame,
    /// One sets out for the goal place so long before one would have to, frames. Ours: a put-on
    /// takes up to 100, and a bump or a closed way on the way costs more.
    pub spare_frames: Frame,
    /// Walking takes longer than the way at full speed by this factor. Ours: for turns, and for
    /// starting and stopping.
    pub walk_factor: f32,
    /// A pick-up and a put-on take at least so long together, frames. Ours: a little less than the
    /// 58 and 75 that they take in the world at least, so that nothing is left that can be done.
    pub pick_and_put_frames: Frame,
}

/// How long a plan lasts at most. All are the original's (facts A2.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanLimits {
    /// Exploring towards one place, frames.
    pub explore_frames: Frame,
    /// Picking up, putting, removing and all that is not named here, frames.
    pub interact_frames: Frame,
    /// Following the partner, frames.
    pub follow_partner_frames: Frame,
    /// Following the child since it was last needed, frames.
    pub follow_child_frames: Frame,
    /// A wait, frames.
    pub wait_frames: Frame,
}

/// What is made of failed attempts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailureRules {
    /// An object is left alone for so long after a failed attempt, frames (facts A1.1, A2.1).
    pub ignore_frames: Frame,
    /// Failed lifts of one piece of furniture before it is left alone (facts A2.5).
    pub lift_tries: u32,
    /// From so many places an object is tried in one plan. Ours: one for each of its sides.
    pub places_tried: u32,
    /// A place from where something could not be done is remembered so long, frames. Ours: longer
    /// than an object is left alone, so that the next attempt begins elsewhere.
    pub bad_place_frames: Frame,
    /// An object without a way to it is left alone for so long, frames. Ours: as long as exploring
    /// one more place may take, which may show a way.
    pub unreachable_frames: Frame,
    /// An object that one found in somebody else's hands is left alone for so long, whatever it
    /// looks like, frames. Ours: about as long as a pick-up takes.
    pub held_for_sure_frames: Frame,
    /// An object with which what was tried is impossible is left alone for so long, frames. Ours:
    /// two thirds of an episode, as what is impossible stays so.
    pub impossible_frames: Frame,
    /// Where one has bumped into something again and again, nobody gets through for so long, frames.
    /// Ours: a third of an episode, as obstacles stay unless somebody clears them away.
    pub barred_frames: Frame,
    /// Who waits for somebody to clear an obstacle away, where ways are those of the original, gives
    /// up after so long, frames, and for `ignore_frames` goes where there is just enough room to get
    /// past, or does other things. Ours: less than after which one counts as stuck. The original
    /// waits until its plan ends (facts A1.6), and then makes the same plan again.
    pub obstacle_patience_frames: Frame,
}

/// When one lifts furniture together with the partner. The original's planners never mean to
/// (facts A2.5), so all of this is ours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiftingRules {
    /// The partner is at a piece if it is this near to the nearest known point of it, metres: twice
    /// the arm's length of 0.7 m, as parts of a piece may be unseen.
    pub at_piece_m: f32,
    /// And was seen there so recently, frames: as long as who stands at furniture waits for the
    /// other (`world.durations.await_partner`).
    pub at_piece_frames: Frame,
    /// A failed lift of the partner calls for help for so long, frames: time to walk 14 m.
    pub call_frames: Frame,
    /// A partner seen this far from the piece won't lift it now, metres: from beyond 3 m the world
    /// lets nobody step up to a thing.
    pub left_piece_m: f32,
    /// So many lifts of one plan may fail. Eight that wait for the other to the end take longer
    /// than a plan may; it bounds those that fail early.
    pub tries_together: u32,
}

/// How near one stays to people, and what is made of the child.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeopleRules {
    /// Who follows the partner stays this near, metres. Ours: nearer than the original's 3 m (facts
    /// A1.6), so that fewer corners come between.
    pub partner_within_m: f32,
    /// Who follows the child gets this near, metres. Ours: the original's 2 m (facts A1.6), less
    /// what a map of cells of 0.125 m may err.
    pub child_within_m: f32,
    /// One stands beside the child from this near on, metres. Ours: less than the 2.5 m from which
    /// it turns back (facts A2.4), as both move between two looks.
    pub child_beside_m: f32,
    /// One stands beside the child for so long, frames. Ours: it decides after each of its steps,
    /// which take 18 or 19.
    pub child_stand_frames: Frame,
    /// The child is trusted to come back by itself for so long after one first stood beside it,
    /// frames. Ours: it walks 5.9 m in that time, and escapes to more than 5 m (facts A2.4).
    pub child_trust_frames: Frame,
    /// People count as seen a moment ago for so long, frames (facts A2.1).
    pub fresh_frames: Frame,
    /// The child is away if it is in view with the partner farther apart than this, metres (facts
    /// A2.1).
    pub child_apart_in_view_m: f32,
    /// Or if both were seen a moment ago farther apart than this, metres (facts A2.1).
    pub child_apart_remembered_m: f32,
}

/// What the child itself does: the original's numbers (facts A2.4), but for the last two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChildRules {
    /// Between two draws whether it runs away pass more than so many frames.
    pub plan_frames: Frame,
    /// Chance to run away at each draw, where draws are by the episode's luck.
    pub run_chance: f32,
    /// It turns back once the helper is this near, metres.
    pub caught_m: f32,
    /// It is back with its guardian from here, metres.
    pub home_m: f32,
    /// How near it follows its guardian, metres.
    pub follow_m: f32,
    /// It runs at least so far, metres.
    pub run_min_m: f32,
    /// To a point that lies off its guardian's direction by more than this, radians: 60 degrees.
    pub off_rad: f32,
    /// Or by more than this, radians, where the point is far from the guardian: 30 degrees.
    pub off_far_rad: f32,
    /// Farther from the guardian than this is far, metres.
    pub far_m: f32,
    /// The point is at least so far inside the place, metres: 6 cells of the original's map.
    pub border_m: f32,
    /// Nothing is known to stand so near to the point, metres. Ours: room for the child.
    pub free_m: f32,
    /// So near to the point it is there, metres. Ours: a little more than a step.
    pub there_m: f32,
}

impl TimeRules {
    /// Of both rule sets.
    pub const STANDARD: TimeRules = TimeRules {
        reconsider_frames: 40,
        partner_holds_frames: 300,
        spare_frames: 240,
        walk_factor: 1.5,
        pick_and_put_frames: 130,
    };
}

impl PlanLimits {
    /// Of both rule sets.
    pub const STANDARD: PlanLimits = PlanLimits {
        explore_frames: 250,
        interact_frames: 1000,
        follow_partner_frames: 250,
        follow_child_frames: 300,
        wait_frames: 10,
    };
}

impl FailureRules {
    /// Of both rule sets.
    pub const STANDARD: FailureRules = FailureRules {
        ignore_frames: 500,
        lift_tries: 5,
        places_tried: 4,
        bad_place_frames: 800,
        unreachable_frames: 250,
        held_for_sure_frames: 60,
        impossible_frames: 2000,
        barred_frames: 1000,
        obstacle_patience_frames: 150,
    };
}

impl LiftingRules {
    /// Of both rule sets.
    pub const STANDARD: LiftingRules = LiftingRules {
        at_piece_m: 1.5,
        at_piece_frames: 150,
        call_frames: 300,
        left_piece_m: 3.0,
        tries_together: 8,
    };
}

impl PeopleRules {
    /// Of both rule sets.
    pub const STANDARD: PeopleRules = PeopleRules {
        partner_within_m: 2.2,
        child_within_m: 1.9,
        child_beside_m: 2.3,
        child_stand_frames: 30,
        child_trust_frames: 250,
        fresh_frames: 50,
        child_apart_in_view_m: 3.5,
        child_apart_remembered_m: 5.5,
    };
}

impl ChildRules {
    /// Of both rule sets.
    pub const STANDARD: ChildRules = ChildRules {
        plan_frames: 100,
        run_chance: 0.2,
        caught_m: 2.5,
        home_m: 3.0,
        follow_m: 2.0,
        run_min_m: 5.0,
        off_rad: std::f32::consts::FRAC_PI_3,
        off_far_rad: std::f32::consts::FRAC_PI_6,
        far_m: 10.0,
        border_m: 0.75,
        free_m: 1.0,
        there_m: 0.5,
    };
}

/// For listings of rules that were written before these constants were rules: they were played
/// by just these.
macro_rules! standard_by_default {
    ($($group:ty),*) => {$(
        impl Default for $group {
            fn default() -> $group {
                <$group>::STANDARD
            }
        }
    )*};
}

standard_by_default!(TimeRules, PlanLimits, FailureRules, LiftingRules, PeopleRules, ChildRules);
