//! Policy that chooses randomly among the valid plans.

use chaic_core::briefing::CompanionRole;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, Briefing};

use crate::decision::{Context, Plan, Policy};
use crate::rules::RandomDraw;

/// Chooses uniformly among the valid plans (the paper's random helper).
#[derive(Clone, Debug)]
pub struct RandomPolicy {
    rng: RngStream,
}

impl Default for RandomPolicy {
    fn default() -> RandomPolicy {
        RandomPolicy { rng: RngStream::new(0, "random policy", 0) }
    }
}

impl Policy for RandomPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        self.rng = RngStream::new(briefing.seed, "random policy", 0);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        Ok(self.decide(context, valid))
    }

    fn fork(&self) -> Option<RandomPolicy> {
        Some(self.clone())
    }
}

impl RandomPolicy {
    /// Draws one of the valid plans.
    pub fn decide(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        let drawn = match context.memory.rules.random_draw {
            RandomDraw::Plans => self.rng.choose(valid).copied(),
            RandomDraw::KindsFirst => self.choose_kind(context, valid),
        };
        drawn.unwrap_or(Plan::Explore)
    }

    /// Draws a kind of plan, then a plan of that kind.
    fn choose_kind(&mut self, context: &Context<'_>, valid: &[Plan]) -> Option<Plan> {
        let mut kinds: Vec<Plan> = Vec::new();
        for plan in valid {
            if !kinds.iter().any(|k| is_same_kind(k, plan)) {
                kinds.push(*plan);
            }
        }
        // To follow a person at an unknown position is to explore (facts A2.1).
        let followed = [
            (CompanionRole::Partner, Plan::FollowPartner),
            (CompanionRole::Child, Plan::FollowChild),
        ];
        for (role, follow) in followed {
            if context.briefing.companion(role).is_some() && !kinds.contains(&follow) {
                kinds.push(Plan::Explore);
            }
        }
        let kind = *self.rng.choose(&kinds)?;
        let of_kind: Vec<Plan> = valid.iter().copied().filter(|p| is_same_kind(p, &kind)).collect();
        self.rng.choose(&of_kind).copied()
    }
}

fn is_same_kind(a: &Plan, b: &Plan) -> bool {
    std::mem::discriminant(a) == std::mem::discriminant(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerRules;
    use crate::TrackId;
    use crate::behavior::BehaviorLog;
    use crate::decision::Subject;
    use crate::memory::Memory;
    use crate::test_support::Toy;
    use chaic_core::ClassId;

    #[test]
    fn with_kinds_first_nine_objects_have_no_more_weight_than_one_plan() {
        let briefing = Toy::room(4.0, 4.0).briefing();
        let subject = |n| Subject { track: TrackId(n), class: ClassId::named("apple") };
        let mut valid = vec![Plan::Explore, Plan::TurnAround, Plan::FollowPartner];
        valid.extend((20..29).map(|n| Plan::PickUp(subject(n))));
        for (draw, expected) in [(RandomDraw::Plans, 900), (RandomDraw::KindsFirst, 300)] {
            let rules = PlannerRules { random_draw: draw, ..PlannerRules::paper() };
            let memory = Memory::new(&briefing, rules);
            let behavior = BehaviorLog::default();
            let context = Context {
                briefing: &briefing,
                memory: &memory,
                behavior: &behavior,
                is_explored: false,
            };
            let mut random = RandomPolicy::default();
            let n = (0..1200)
                .filter(|_| matches!(random.decide(&context, &valid), Plan::PickUp(_)))
                .count();
            // Standard deviation 15.
            assert!(n.abs_diff(expected) < 75, "{n}, expected about {expected}");
        }
    }
}
