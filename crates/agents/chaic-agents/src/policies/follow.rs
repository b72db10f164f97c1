//! Always beside the partner: for collecting videos of what people do.

use chaic_core::briefing::Relation;
use chaic_core::{AgentError, Briefing};

use crate::decision::{Context, Plan, Policy};

/// Follows the partner, and looks for it when it is lost.
#[derive(Clone, Debug, Default)]
pub struct Follow {
    was_around: bool,
}

impl Follow {
    /// The partner's place if it is known, or where to look for it.
    pub fn decide(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        // A sighting that led nowhere is 60 frames old by then.
        let partner = context.memory.companion(context.briefing, Relation::Partner);
        let is_fresh = partner.is_some_and(|p| p.frame + 60 > context.memory.frame);
        if valid.contains(&Plan::FollowPartner) && is_fresh {
            self.was_around = false;
            return Plan::FollowPartner;
        }
        if std::mem::replace(&mut self.was_around, true) { Plan::Explore } else { Plan::TurnAround }
    }
}

impl Policy for Follow {
    fn reset(&mut self, _: &Briefing) {
        self.was_around = false;
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        Ok(self.decide(context, valid))
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, _: bool) -> bool {
        let person = context.memory.companion(context.briefing, Relation::Partner);
        *current != Plan::FollowPartner && person.is_some_and(|p| p.is_in_view)
    }

    fn fork(&self) -> Option<Follow> {
        Some(self.clone())
    }
}
