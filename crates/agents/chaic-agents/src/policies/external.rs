//! The plans that a caller chooses: what learners act by above single actions.

use chaic_core::{AgentError, Briefing};

use crate::decision::{Context, Plan, Policy};

/// Follows what it is told to, and asks when it has come to an end of that.
///
/// Its mind's [`proceed`](crate::Mind::proceed) fails with [`AgentError::Halted`] when a choice is due; then
/// [`valid`](External::valid) has the plans to choose among, and after [`tell`](External::tell) it may be called
/// again.
#[derive(Clone, Debug, Default)]
pub struct External {
    valid: Vec<Plan>,
    told: Option<Plan>,
}

impl External {
    /// The plans that can be begun now, those of one kind nearest first; empty while one is followed.
    pub fn valid(&self) -> &[Plan] {
        &self.valid
    }

    /// Chooses one of the valid plans. Returns false, and changes nothing, if there is none of this
    /// index.
    pub fn tell(&mut self, index: usize) -> bool {
        let told = self.valid.get(index).copied();
        if told.is_some() {
            self.told = told;
            self.valid.clear();
        }
        told.is_some()
    }
}

impl Policy for External {
    fn reset(&mut self, _: &Briefing) {
        *self = External::default();
    }

    fn choose(&mut self, _: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        if let Some(told) = self.told.take() {
            return Ok(told);
        }
        self.valid = valid.to_vec();
        Err(AgentError::Halted("a plan is to be chosen".to_owned()))
    }

    fn fork(&self) -> Option<External> {
        Some(self.clone())
    }
}
