//! The rule-based helpers, by name.

use chaic_protocol::Agent;
use chaic_protocol::observation::Grants;

use crate::mind::Mind;
use crate::policies::{Follow, Random, RulePolicy, RuleProfile};
use crate::rules::PlannerRules;

/// A helper as runs and tables know it.
#[derive(Clone, Copy, Debug)]
pub struct HelperInfo {
    /// Its name in commands and files.
    pub name: &'static str,
    /// What tables call it.
    pub title: &'static str,
    /// Makes one that plans by these rules.
    pub make: fn(PlannerRules) -> Box<dyn Agent>,
    /// What it asks to be granted under these rules.
    pub grants: fn(PlannerRules) -> Grants,
}

/// All helpers of this crate.
pub static HELPERS: [HelperInfo; 4] = [
    HelperInfo {
        name: "random",
        title: "Random",
        make: |rules| Box::new(random(rules)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "rhp",
        title: "RHP",
        make: |rules| Box::new(rhp(rules)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "oracle",
        title: "Oracle",
        make: |rules| Box::new(oracle(rules)),
        grants: |_| Grants::ORACLE,
    },
    HelperInfo {
        name: "follow",
        title: "Follow",
        make: |rules| Box::new(follow(rules)),
        grants: planner_grants,
    },
];

fn planner_grants(rules: PlannerRules) -> Grants {
    Grants { behavior: rules.knows_holding, ..Grants::PLANNER }
}

impl HelperInfo {
    /// The helper of this name.
    pub fn named(name: &str) -> Option<&'static HelperInfo> {
        HELPERS.iter().find(|helper| helper.name == name)
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_a_helper_and_only_the_oracle_is_told_the_goal() {
        for info in &HELPERS {
            let name = info.name;
            assert!((info.make)(PlannerRules::paper()).senses().depth, "{name}");
            for rules in [PlannerRules::paper(), PlannerRules::compat()] {
                let grants = (info.grants)(rules);
                assert_eq!(grants.goal, name == "oracle");
                assert!(grants.ids);
                assert_eq!(grants.behavior, name == "oracle" || rules.knows_holding);
            }
            assert_eq!(HelperInfo::named(name).map(|h| h.title), Some(info.title));
        }
        assert!(HelperInfo::named("nobody").is_none());
    }
}
