//! Policy whose plans are chosen by the caller, such as a learner that acts at the level of plans.

use chaic_core::{AgentError, Briefing};

use crate::decision::{Context, Plan, Policy};

/// Executes the plans that the caller sets, and stops when the next one is due.
///
/// When a choice is due, the agent's [`next_action`](crate::PlanningAgent::next_action) fails with
/// [`AgentError::Halted`]. Then [`valid`](ExternalPolicy::valid) lists the candidates; after
/// [`set_plan`](ExternalPolicy::set_plan) `next_action` may be called again.
#[derive(Clone, Debug, Default)]
pub struct ExternalPolicy {
    valid: Vec<Plan>,
    next: Option<Plan>,
}

impl ExternalPolicy {
    /// Plans that can be started now, those of one kind nearest first; empty while a plan is
    /// executed.
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
            return Ok(plan);
        }
        self.valid = valid.to_vec();
        Err(AgentError::Halted(
            "no plan is selected: call set_plan with the index of a valid plan".to_owned(),
        ))
    }

    fn fork(&self) -> Option<ExternalPolicy> {
        Some(self.clone())
    }
}
