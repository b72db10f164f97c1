//! The rule-based helpers, by name.

use chaic_core::Agent;
use chaic_core::observation::Grants;

use crate::behavior::GroundTruthBehavior;
use crate::mind::Mind;
use crate::policies::{Follow, Random, RulePolicy, RuleProfile};
use crate::rules::PlannerRules;
use crate::sight::Sight;

/// A helper as runs and tables know it.
#[derive(Clone, Copy, Debug)]
pub struct HelperInfo {
    /// Its name in commands and files.
    pub name: &'static str,
    /// What tables call it.
    pub title: &'static str,
    /// Makes one that plans by these rules and sees by this.
    pub make: fn(PlannerRules, &dyn Sight) -> Box<dyn Agent>,
    /// What it asks to be granted under these rules.
    pub grants: fn(PlannerRules) -> Grants,
}

/// All helpers of this crate.
pub static HELPERS: [HelperInfo; 4] = [
    HelperInfo {
        name: "random",
        title: "Random",
        make: |rules, sight| Box::new(random(rules, sight)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "rhp",
        title: "RHP",
        make: |rules, sight| Box::new(rhp(rules, sight)),
        grants: planner_grants,
    },
    HelperInfo {
        name: "oracle",
        title: "Oracle",
        make: |rules, sight| Box::new(oracle(rules, sight)),
        grants: |_| Grants::ORACLE,
    },
    HelperInfo {
        name: "follow",
        title: "Follow",
        make: |rules, sight| Box::new(follow(rules, sight)),
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
pub fn random(rules: PlannerRules, sight: &dyn Sight) -> Mind<Random> {
    Mind::seeing(Random::default(), rules, sight)
}

/// The rule-based hierarchical planner: like the partner, without knowing its goal.
pub fn rhp(rules: PlannerRules, sight: &dyn Sight) -> Mind<RulePolicy> {
    Mind::seeing(RulePolicy::new(RuleProfile::RHP), rules, sight)
}

/// The same rules with the goal, the progress and the partner's doings known.
pub fn oracle(rules: PlannerRules, sight: &dyn Sight) -> Mind<RulePolicy> {
    let behavior = Box::new(GroundTruthBehavior::default());
    let policy = RulePolicy::new(RuleProfile::ORACLE);
    Mind::with(policy, sight.perception(), behavior, rules).with_sight(sight)
}

/// Always beside the partner.
pub fn follow(rules: PlannerRules, sight: &dyn Sight) -> Mind<Follow> {
    Mind::seeing(Follow::default(), rules, sight)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sight::TrueSight;

    #[test]
    fn every_name_has_a_helper_and_only_the_oracle_is_told_the_goal() {
        for info in &HELPERS {
            let name = info.name;
            assert!((info.make)(PlannerRules::paper(), &TrueSight).senses().depth, "{name}");
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
