//! Constants of the planners, in groups. Both rule sets use the same values; differences of the
//! original's code are fields of [`PlannerRules`](super::PlannerRules) itself.

use chaic_core::Frame;
use serde::{Deserialize, Serialize};

/// Time budgeting and replanning.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeRules {
    /// Time after which a plan is reconsidered, frames. Ours: a walk of four steps; relevant map
    /// changes trigger it at once.
    #[serde(alias = "reconsider_frames")]
    pub replan_interval_frames: Frame,
    /// Time for which the partner's last known held objects count as done, frames. Ours: as long as
    /// objects held by others are avoided (`seen_held_ignore_frames` of the paper's rules).
    #[serde(alias = "partner_holds_frames")]
    pub partner_load_valid_frames: Frame,
    /// Time reserve for the walk to the goal place, frames. Ours: a put-on takes up to 100, and a
    /// bump or a blocked path costs more.
    #[serde(alias = "spare_frames")]
    pub delivery_reserve_frames: Frame,
    /// Ratio of walking time to path length at full speed. Ours: it covers turns, starts and stops.
    #[serde(alias = "walk_factor")]
    pub path_time_factor: f32,
    /// Minimum time of a pick-up and a put-on together, frames. Ours: slightly less than the
    /// world's minimum of 58 + 76, so that no feasible delivery is ruled out.
    pub pick_and_put_frames: Frame,
}

/// Time limits of plans. All are the original's (facts A2.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanTimeouts {
    /// Exploration of one target, frames.
    pub explore_frames: Frame,
    /// Picking up, putting, removing and all plans not listed here, frames.
    pub interact_frames: Frame,
    /// Following the partner, frames.
    pub follow_partner_frames: Frame,
    /// Following the child, since it was last needed, frames.
    pub follow_child_frames: Frame,
    /// Waiting, frames.
    pub wait_frames: Frame,
}

/// Consequences of failed attempts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailureRules {
    /// Time for which an object is ignored after a failed attempt, frames (facts A1.1, A2.1).
    pub ignore_frames: Frame,
    /// Failed lifts of one piece of furniture before it is ignored (facts A2.5).
    #[serde(alias = "lift_tries")]
    pub max_failed_lifts: u32,
    /// Number of positions from which an object is tried in one plan. Ours: one for each of its
    /// sides.
    #[serde(alias = "places_tried")]
    pub max_positions_tried: u32,
    /// Time for which a position with a failed interaction is remembered, frames. Ours: longer than
    /// an object is ignored, so that the next attempt starts elsewhere.
    #[serde(alias = "bad_place_frames")]
    pub failed_position_frames: Frame,
    /// Time for which an unreachable object is ignored, frames. Other goal places are preferred for
    /// this time after a delivery that timed out or got stuck. Ours: as long as one exploration plan
    /// may take, which may reveal a path.
    pub unreachable_frames: Frame,
    /// Time for which an object is ignored after a pick-up failed because another agent holds it,
    /// frames. Ours: about as long as a pick-up takes.
    #[serde(alias = "held_for_sure_frames")]
    pub held_refusal_ignore_frames: Frame,
    /// Time for which an object is ignored after an impossible interaction, frames. Ours: two
    /// thirds of an episode, because what is impossible stays so.
    pub impossible_frames: Frame,
    /// Time for which the position of repeated bumps counts as occupied, frames. Ours: a third of
    /// an episode, because obstacles stay unless an agent removes them.
    #[serde(alias = "barred_frames")]
    pub repeated_collision_frames: Frame,
}

/// Lifting furniture together with the partner. The original's planners never plan to do so (facts
/// A2.5), so all of this is ours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiftingRules {
    /// Maximum distance of a partner at a piece from its nearest known point, meters. It is twice
    /// the arm's length of 0.7 m, because parts of a piece may be unseen.
    #[serde(alias = "at_piece_m")]
    pub partner_at_furniture_m: f32,
    /// Maximum age of that sighting, frames. It equals the time for which an agent waits at
    /// furniture for the other (`world.durations.await_partner`).
    #[serde(alias = "at_piece_frames")]
    pub partner_sighting_max_age_frames: Frame,
    /// Time for which a failed lift of the partner counts as a call for help, frames: enough to
    /// walk 14 m.
    #[serde(alias = "call_frames")]
    pub help_request_frames: Frame,
    /// Distance from which a partner has left the piece, meters: the world lets agents step up from
    /// at most 3 m.
    #[serde(alias = "left_piece_m")]
    pub partner_left_furniture_m: f32,
    /// Maximum number of failed lifts per plan. Eight lifts that wait for the partner until the
    /// timeout exceed the plan's time limit; the bound is for those that fail early.
    #[serde(alias = "tries_together")]
    pub max_failed_joint_lifts: u32,
}

/// Distances to people, and tracking of the child.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeopleRules {
    /// Following distance to the partner, meters. Ours: less than the original's 3 m (facts A1.6),
    /// so that fewer corners occlude it.
    pub partner_within_m: f32,
    /// Following distance to the child, meters. Ours: the original's 2 m (facts A1.6) minus the
    /// error of a map with cells of 0.125 m.
    pub child_within_m: f32,
    /// Distance that counts as beside the child, meters. Ours: less than the 2.5 m at which it
    /// turns back (facts A2.4), because both move between two observations.
    pub child_beside_m: f32,
    /// Time to stand beside the child, frames. Ours: the child decides after each of its steps,
    /// which take 18 or 19.
    pub child_stand_frames: Frame,
    /// Time for which the child is trusted to come back after the helper first stood beside it,
    /// frames. Ours: it walks 5.9 m in that time, and escapes to more than 5 m (facts A2.4).
    #[serde(alias = "child_trust_frames")]
    pub child_return_frames: Frame,
    /// Time for which a person counts as recently seen, frames (facts A2.1).
    pub fresh_frames: Frame,
    /// Distance between child and partner, both in view, from which the child is away, meters
    /// (facts A2.1).
    pub child_apart_in_view_m: f32,
    /// The same if both were seen recently, meters (facts A2.1).
    pub child_apart_remembered_m: f32,
}

/// Behavior of the child: the original's parameters (facts A2.4), except for the last two.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChildRules {
    /// Minimum time between two draws whether it runs away, frames.
    #[serde(alias = "plan_frames")]
    pub decision_interval_frames: Frame,
    /// Probability to run away per draw, with draws from the episode's random stream.
    #[serde(alias = "run_chance")]
    pub escape_probability: f32,
    /// Distance of the helper at which it turns back, meters.
    #[serde(alias = "caught_m")]
    pub turn_back_distance_m: f32,
    /// Distance from its guardian at which it has returned, meters.
    #[serde(alias = "home_m")]
    pub returned_distance_m: f32,
    /// Following distance to its guardian, meters.
    #[serde(alias = "follow_m")]
    pub follow_distance_m: f32,
    /// Minimum length of an escape, meters.
    #[serde(alias = "run_min_m")]
    pub escape_min_m: f32,
    /// Minimum angle between the escape and the guardian's direction, radians: 60 degrees.
    #[serde(alias = "off_rad")]
    pub escape_min_angle_rad: f32,
    /// The same if the target is far from the guardian, radians: 30 degrees.
    #[serde(alias = "off_far_rad")]
    pub escape_min_angle_far_rad: f32,
    /// Distance from the guardian that counts as far, meters.
    #[serde(alias = "far_m")]
    pub far_from_guardian_m: f32,
    /// Minimum distance of the target from the bounds, meters: 6 cells of the original's map.
    #[serde(alias = "border_m")]
    pub bounds_margin_m: f32,
    /// Radius around the target without known obstacles, meters. Ours: room for the child.
    #[serde(alias = "free_m")]
    pub target_clearance_m: f32,
    /// Arrival distance, meters. Ours: slightly more than a step.
    #[serde(alias = "there_m")]
    pub arrival_distance_m: f32,
}

impl TimeRules {
    /// Values of both rule sets.
    pub const STANDARD: TimeRules = TimeRules {
        replan_interval_frames: 40,
        partner_load_valid_frames: 300,
        delivery_reserve_frames: 240,
        path_time_factor: 1.5,
        pick_and_put_frames: 130,
    };
}

impl PlanTimeouts {
    /// Values of both rule sets.
    pub const STANDARD: PlanTimeouts = PlanTimeouts {
        explore_frames: 250,
        interact_frames: 1000,
        follow_partner_frames: 250,
        follow_child_frames: 300,
        wait_frames: 10,
    };
}

impl FailureRules {
    /// Values of both rule sets.
    pub const STANDARD: FailureRules = FailureRules {
        ignore_frames: 500,
        max_failed_lifts: 5,
        max_positions_tried: 4,
        failed_position_frames: 800,
        unreachable_frames: 250,
        held_refusal_ignore_frames: 60,
        impossible_frames: 2000,
        repeated_collision_frames: 1000,
    };
}

impl LiftingRules {
    /// Values of both rule sets.
    pub const STANDARD: LiftingRules = LiftingRules {
        partner_at_furniture_m: 1.5,
        partner_sighting_max_age_frames: 150,
        help_request_frames: 300,
        partner_left_furniture_m: 3.0,
        max_failed_joint_lifts: 8,
    };
}

impl PeopleRules {
    /// Values of both rule sets.
    pub const STANDARD: PeopleRules = PeopleRules {
        partner_within_m: 2.2,
        child_within_m: 1.9,
        child_beside_m: 2.3,
        child_stand_frames: 30,
        child_return_frames: 250,
        fresh_frames: 50,
        child_apart_in_view_m: 3.5,
        child_apart_remembered_m: 5.5,
    };
}

impl ChildRules {
    /// Values of both rule sets.
    pub const STANDARD: ChildRules = ChildRules {
        decision_interval_frames: 100,
        escape_probability: 0.2,
        turn_back_distance_m: 2.5,
        returned_distance_m: 3.0,
        follow_distance_m: 2.0,
        escape_min_m: 5.0,
        escape_min_angle_rad: std::f32::consts::FRAC_PI_3,
        escape_min_angle_far_rad: std::f32::consts::FRAC_PI_6,
        far_from_guardian_m: 10.0,
        bounds_margin_m: 0.75,
        target_clearance_m: 1.0,
        arrival_distance_m: 0.5,
    };
}

/// Defaults for stored rules that predate these fields: they were run with exactly these values.
macro_rules! standard_by_default {
    ($($group:ty),*) => {$(
        impl Default for $group {
            fn default() -> $group {
                <$group>::STANDARD
            }
        }
    )*};
}

standard_by_default!(TimeRules, PlanTimeouts, FailureRules, LiftingRules, PeopleRules, ChildRules);
