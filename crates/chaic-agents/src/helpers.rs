//! The rule-based helpers, by name.

use chaic_protocol::Agent;
use chaic_protocol::observation::Grants;

use crate::mind::Mind;
use crate::policies::{Follow, Random, RulePolicy, RuleProfile};
use crate::rules::PlannerRules;

/// The names of all helpers of this crate.
pub const HELPERS: &[&str] = &["random", "rhp", "oracle", "follow"];

/// Any valid plan (paper section 5.2).
pub fn random(rules: PlannerRules) -> Mind<Random> {
    Mind::new(Random::default(), rules)
}

/// The rule-based hierarchical planner: like the partner, without knowing its goal.
pub fn rhp(rules: PlannerRules) -> Mind<RulePolicy> {
    Mind::new(RulePolicy::new(RuleProfile::RHP), rules)
}

/// The same rules with the goal, the progress and the partner's doings known.
pub fn oracle(rules: PlannerRules) -> Mind<RulePolicy> {
    Mind::new(RulePolicy::new(RuleProfile::ORACLE), rules)
}

/// Always beside the partner.
pub fn follow(rules: PlannerRules) -> Mind<Follow> {
    Mind::new(Follow::default(), rules)
}

/// The helper of this name.
pub fn helper(name: &str, rules: PlannerRules) -> Option<Box<dyn Agent>> {
    Some(match name {
        "random" => Box::new(random(rules)),
        "rhp" => Box::new(rhp(rules)),
        "oracle" => Box::new(oracle(rules)),
        "follow" => Box::new(follow(rules)),
        _ => return None,
    })
}

/// What the helper of this name asks to be granted; nothing for an unknown name.
pub fn helper_grants(name: &str, rules: PlannerRules) -> Grants {
    match name {
        "random" | "rhp" | "follow" => Grants { behavior: rules.knows_holding, ..Grants::PLANNER },
        "oracle" => Grants::ORACLE,
        _ => Grants::NONE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_a_helper_and_only_the_oracle_is_told_the_goal() {
        for name in HELPERS {
            assert!(helper(name, PlannerRules::paper()).is_some(), "{name}");
            for rules in [PlannerRules::paper(), PlannerRules::compat()] {
                let grants = helper_grants(name, rules);
                assert_eq!(grants.goal, *name == "oracle");
                assert!(grants.ids);
                assert_eq!(grants.behavior, *name == "oracle" || rules.knows_holding);
            }
        }
        assert!(helper("nobody", PlannerRules::paper()).is_none());
        assert_eq!(helper_grants("nobody", PlannerRules::paper()), Grants::NONE);
    }
}
