//! Policy whose plans are chosen by the caller, such as a learner that acts at the level of plans.

use chaic_core::{AgentError, Briefing, Observation};

use crate::behavior::BehaviorLog;
use crate::decision::{Context, Plan, Policy};
use crate::memory::Memory;

/// Executes the plans that the caller sets, and stops when the next one is due.
///
/// When a choice is due, the agent's [`next_action`](crate::PlanningAgent::next_action) fails with
/// [`AgentError::Halted`]. Then [`valid`](ExternalPolicy::valid) lists the candidates; after
/// [`set_plan`](ExternalPolicy::set_plan) `next_action` may be called again.
#[derive(Clone, Debug, Default)]
pub struct ExternalPolicy {
    valid: Vec<Plan>,
    next: Option<Plan>,
    /// Plans that were chosen since the last observation. They ended at once, without an action.
    tried: Vec<Plan>,
}

impl ExternalPolicy {
    /// Returns the plans that can be started now, the nearest of each kind first; none while a plan
    /// is executed. A plan that ended at once is omitted until the next observation. If all did,
    /// only waiting remains, so a caller cannot choose the same plans forever.
    pub fn valid(&self) -> &[Plan] {
        &self.valid
    }

    /// Selects one of the valid plans. Returns false, without any change, if the index is out of
    /// range.
    pub fn set_plan(&mut self, index: usize) -> bool {
        let plan = self.valid.get(index).copied();
        if plan.is_some() {
            self.next = plan;
            self.valid.clear();
        }
        plan.is_some()
    }
}

impl Policy for ExternalPolicy {
    fn reset(&mut self, _: &Briefing) {
        *self = ExternalPolicy::default();
    }

    fn choose(&mut self, _: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        if let Some(plan) = self.next.take() {
            self.tried.push(plan);
            return Ok(plan);
        }
        self.valid = valid.iter().filter(|plan| !self.tried.contains(plan)).copied().collect();
        if self.valid.is_empty() {
            self.valid.push(Plan::Wait);
        }
        Err(AgentError::Halted(
            "no plan is selected: call set_plan with the index of a valid plan".to_owned(),
        ))
    }

    fn observe(&mut self, _: &Observation, _: &Memory, _: &BehaviorLog) {
        self.tried.clear();
    }

    fn fork(&self) -> Option<ExternalPolicy> {
        Some(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerRules;
    use crate::test_support::Toy;

    #[test]
    fn plans_that_end_at_once_are_not_offered_again_until_the_next_observation() {
        let toy = Toy::room(4.0, 4.0);
        let briefing = toy.briefing();
        let memory = Memory::new(&briefing, PlannerRules::paper());
        let behavior = BehaviorLog::default();
        let context = Context {
            briefing: &briefing,
            memory: &memory,
            behavior: &behavior,
            is_explored: false,
        };
        let valid = [Plan::Explore, Plan::Deliver];
        let mut policy = ExternalPolicy::default();
        let mut offered = Vec::new();
        // The caller always takes the first plan, which never begins.
        for _ in 0..3 {
            assert!(policy.choose(&context, &valid).is_err());
            offered.push(policy.valid().to_vec());
            assert!(policy.set_plan(0) && !policy.set_plan(0));
            policy.choose(&context, &valid).unwrap();
        }
        assert_eq!(offered, [valid.to_vec(), vec![Plan::Deliver], vec![Plan::Wait]]);
        policy.observe(&toy.observe(), &memory, &behavior);
        assert!(policy.choose(&context, &valid).is_err());
        assert_eq!(policy.valid(), valid);
    }
}
