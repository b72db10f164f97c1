//! Policy that stays near the partner, for collecting videos of people's actions.

use chaic_core::briefing::CompanionRole;
use chaic_core::{AgentError, Briefing, Frame};

use crate::decision::{Context, Plan, Policy};

/// Maximum age of a sighting that is followed, frames; after an unsuccessful walk it is older. Ours.
const MAX_SIGHTING_AGE_FRAMES: Frame = 60;

/// Follows the partner, and searches for it when it is lost.
#[derive(Clone, Debug, Default)]
pub struct FollowPolicy {
    has_looked_around: bool,
}

impl FollowPolicy {
    /// Returns a plan to follow the partner or, if its position is unknown, to search for it.
    pub fn decide(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        let partner = context.memory.companion(context.briefing, CompanionRole::Partner);
        let is_fresh =
            partner.is_some_and(|p| p.frame + MAX_SIGHTING_AGE_FRAMES > context.memory.frame);
        if valid.contains(&Plan::FollowPartner) && is_fresh {
            self.has_looked_around = false;
            return Plan::FollowPartner;
        }
        if std::mem::replace(&mut self.has_looked_around, true) {
            Plan::Explore
        } else {
            Plan::TurnAround
        }
    }
}

impl Policy for FollowPolicy {
    fn reset(&mut self, _: &Briefing) {
        self.has_looked_around = false;
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        Ok(self.decide(context, valid))
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, _: bool) -> bool {
        let person = context.memory.companion(context.briefing, CompanionRole::Partner);
        *current != Plan::FollowPartner && person.is_some_and(|p| p.is_in_view)
    }

    fn fork(&self) -> Option<FollowPolicy> {
        Some(self.clone())
    }
}
