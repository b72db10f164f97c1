//! History of a policy's choices, and the frames at which its next choice is due.

use chaic_agents::decision::{Context, Plan};
use chaic_core::{Briefing, ClassId, Frame, Role};

/// Number of kinds of plans.
const N_KINDS: usize = Plan::KINDS.len();

/// Minimum time between reconsiderations of plans to explore, follow or wait, frames: as in
/// `chaic_agents::policies::infer`.
const IDLE_FRAMES: Frame = 60;
/// Minimum time between reconsiderations of walks to objects, frames: as above.
const WALK_FRAMES: Frame = 80;
/// Minimum time between reconsiderations while the child is away, or of walks to furniture, frames:
/// that of the rules (`planner.time.replan_interval_frames`).
const URGENT_FRAMES: Frame = 40;

/// History of a policy's choices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanHistory {
    /// Last chosen plan.
    pub last: Option<Plan>,
    /// Frame of the last choice.
    pub last_frame: Frame,
    /// Number of choices by kind of plan.
    pub n_chosen_by_kind: [u32; N_KINDS],
    moves_furniture: bool,
    /// Current plan that is being reconsidered.
    reconsidered: Option<Plan>,
}

impl PlanHistory {
    /// Creates the history at the start of an episode.
    pub fn new(briefing: &Briefing) -> PlanHistory {
        let is_furniture = |class: &ClassId| class.info().role == Role::HeavyTarget;
        let moves_furniture = briefing.possible_targets.iter().any(is_furniture);
        PlanHistory { moves_furniture, ..PlanHistory::default() }
    }

    /// Records a choice at a frame.
    pub fn record(&mut self, plan: Plan, frame: Frame) {
        if self.reconsidered.take() != Some(plan) {
            self.n_chosen_by_kind[plan.kind()] += 1;
        }
        self.last = Some(plan);
        self.last_frame = frame;
    }

    /// Returns whether a new choice is due although `current` is not finished, and notes it. `has_changed` is
    /// true if the map has changed in a relevant way since the last choice.
    pub fn begin_reconsideration(
        &mut self,
        context: &Context<'_>,
        current: &Plan,
        has_changed: bool,
    ) -> bool {
        let since = context.memory.frame.saturating_sub(self.last_frame);
        let is_urgent = since >= URGENT_FRAMES && context.memory.child_is_away(context.briefing);
        let is_due = match current {
            Plan::PutIn | Plan::TurnAround | Plan::FollowChild => false,
            _ if is_urgent => true,
            Plan::Deliver | Plan::LiftWith(_) => false,
            _ if self.moves_furniture => has_changed || since >= URGENT_FRAMES,
            Plan::Explore | Plan::FollowPartner | Plan::Wait => has_changed || since >= IDLE_FRAMES,
            Plan::PickUp(_) | Plan::PickContainer(_) => has_changed && since >= WALK_FRAMES,
            Plan::RemoveObstacle(_) => false,
        };
        self.reconsidered = is_due.then_some(*current);
        is_due
    }

    /// Returns the unfinished plan that the next choice reconsiders, if any.
    pub fn reconsidered(&self) -> Option<Plan> {
        self.reconsidered
    }

    /// Sets the unfinished plan that the next choice reconsiders, for a policy with other intervals.
    pub fn set_reconsidered(&mut self, current: Option<Plan>) {
        self.reconsidered = current;
    }

    /// Returns the candidates among the valid plans; never empty. While a plan is reconsidered,
    /// they are that plan and those that [may replace](may_replace) it.
    pub fn candidates(&self, valid: &[Plan]) -> Vec<Plan> {
        let Some(current) = self.reconsidered else { return valid.to_vec() };
        let alternatives = valid.iter().filter(|plan| may_replace(plan, &current));
        std::iter::once(&current).chain(alternatives).copied().collect()
    }
}

/// Returns whether a learned policy may replace the unfinished plan `current` by `new`. It may if
/// [`Plan::supersedes`] holds, if both plans are pick-ups ([`Plan::is_pick`]), or if both are idle
/// plans.
pub fn may_replace(new: &Plan, current: &Plan) -> bool {
    let is_idle = |p: &Plan| matches!(p, Plan::Explore | Plan::FollowPartner | Plan::Wait);
    let is_exchange =
        new.is_pick() && current.is_pick() || is_idle(new) && is_idle(current) && new != current;
    new != current && (is_exchange || new.supersedes(current))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_agents::PlannerRules;
    use chaic_agents::behavior::BehaviorLog;
    use chaic_agents::decision::Subject;
    use chaic_agents::memory::Memory;
    use chaic_agents::track::TrackId;
    use chaic_core::geom::Pose;
    use chaic_core::{AgentId, TaskId, Vec3};

    use crate::test_support::start;

    fn subject(track: u32) -> Subject {
        Subject { track: TrackId(track), class: ClassId::named("apple") }
    }

    fn pick_up(track: u32) -> Plan {
        Plan::PickUp(subject(track))
    }

    /// Asserts whether plans are reconsidered, given the frames since the last choice and whether the map
    /// has changed.
    fn check(briefing: &Briefing, memory: &Memory, expected: &[(Plan, Frame, bool, bool)]) {
        let behavior = BehaviorLog::default();
        for (plan, since, has_changed, is_due) in expected {
            let mut history = PlanHistory::new(briefing);
            history.record(*plan, memory.frame - since);
            let context = Context { briefing, memory, behavior: &behavior, is_explored: false };
            let found = history.begin_reconsideration(&context, plan, *has_changed);
            assert_eq!(found, *is_due, "{plan:?} after {since} frames, changed: {has_changed}");
            assert_eq!(history.reconsidered(), is_due.then_some(*plan));
        }
    }

    #[test]
    fn idle_plans_and_walks_are_reconsidered_at_their_intervals() {
        let (briefing, _) = start(TaskId::LowTarget);
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        memory.frame = 1000;
        for idle in [Plan::Explore, Plan::FollowPartner, Plan::Wait] {
            let expected =
                [(idle, 59, false, false), (idle, 60, false, true), (idle, 1, true, true)];
            check(&briefing, &memory, &expected);
        }
        for walk in [pick_up(1), Plan::PickContainer(subject(2))] {
            let expected =
                [(walk, 79, true, false), (walk, 80, true, true), (walk, 900, false, false)];
            check(&briefing, &memory, &expected);
        }
        let others = [
            Plan::Deliver,
            Plan::PutIn,
            Plan::TurnAround,
            Plan::FollowChild,
            Plan::LiftWith(subject(3)),
            Plan::RemoveObstacle(subject(4)),
        ];
        check(&briefing, &memory, &others.map(|plan| (plan, 900, true, false)));
    }

    #[test]
    fn in_moving_house_all_walks_are_reconsidered_sooner() {
        let (briefing, _) = start(TaskId::MovingHouse);
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        memory.frame = 1000;
        for plan in [Plan::Explore, pick_up(1), Plan::RemoveObstacle(subject(4))] {
            let expected =
                [(plan, 39, false, false), (plan, 40, false, true), (plan, 1, true, true)];
            check(&briefing, &memory, &expected);
        }
        for plan in [Plan::Deliver, Plan::LiftWith(subject(3)), Plan::PutIn] {
            check(&briefing, &memory, &[(plan, 900, true, false)]);
        }
    }

    #[test]
    fn a_child_that_is_away_makes_all_walks_urgent() {
        let (briefing, mut observation) = start(TaskId::Shopping);
        let mut memory = Memory::new(&briefing, PlannerRules::paper());
        memory.frame = 1000;
        observation.frame = 1000;
        let pose = |x| Pose { position: Vec3::new(x, 0.0, 0.0), yaw_rad: 0.0 };
        for (child_x_m, is_away) in [(1.0, false), (9.0, true)] {
            observation.granted.poses =
                vec![(AgentId::PARTNER, pose(0.0)), (AgentId::CHILD, pose(child_x_m))];
            memory.people.update(&briefing, &observation, &[]);
            for plan in [Plan::Deliver, pick_up(1)] {
                check(&briefing, &memory, &[(plan, 39, false, false), (plan, 40, false, is_away)]);
            }
            check(&briefing, &memory, &[(Plan::FollowChild, 900, true, false)]);
        }
    }

    #[test]
    fn a_reconsidered_plan_competes_with_those_that_may_replace_it() {
        let valid = [Plan::Explore, pick_up(1), pick_up(2), Plan::FollowPartner, Plan::TurnAround];
        let mut history = PlanHistory::default();
        assert_eq!(history.candidates(&valid), valid);
        for (current, expected) in [
            (pick_up(1), vec![pick_up(1), pick_up(2), Plan::TurnAround]),
            (
                Plan::Explore,
                vec![Plan::Explore, pick_up(1), pick_up(2), Plan::FollowPartner, Plan::TurnAround],
            ),
            (Plan::Deliver, vec![Plan::Deliver, pick_up(1), pick_up(2), Plan::TurnAround]),
        ] {
            history.set_reconsidered(Some(current));
            assert_eq!(history.candidates(&valid), expected);
        }
    }

    #[test]
    fn a_continued_plan_counts_once() {
        let mut history = PlanHistory::default();
        history.record(Plan::Explore, 10);
        history.set_reconsidered(Some(Plan::Explore));
        history.record(Plan::Explore, 70);
        assert_eq!(history.n_chosen_by_kind[Plan::Explore.kind()], 1);
        assert_eq!((history.last_frame, history.reconsidered()), (70, None));
        history.record(Plan::Explore, 90);
        assert_eq!(history.n_chosen_by_kind[Plan::Explore.kind()], 2);
    }
}
