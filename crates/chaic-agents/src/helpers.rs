//! The rule-based helpers, by name.

use chaic_protocol::Agent;
use chaic_protocol::observation::Grants;

use crate::mind::Mind;
use crate::policies::{Follow, Random, RuleProfile, Rules};

/// The names of all helpers of this crate.
pub const HELPERS: &[&str] = &["random", "rhp", "oracle", "follow"];

/// Any valid plan (paper section 5.2).
pub fn random() -> Mind<Random> {
    Mind::new(Random::default())
}

/// The rule-based hierarchical planner: like the partner, without knowing its goal.
pub fn rhp() -> Mind<Rules> {
    Mind::new(Rules::new(RuleProfile::RHP))
}

/// The same rules with the goal, the progress and the partner's doings known.
pub fn oracle() -> Mind<Rules> {
    Mind::new(Rules::new(RuleProfile::ORACLE))
}

/// Always beside the partner.
pub fn follow() -> Mind<Follow> {
    Mind::new(Follow::default())
}

/// The helper of this name.
pub fn helper(name: &str) -> Option<Box<dyn Agent>> {
    Some(match name {
        "random" => Box::new(random()),
        "rhp" => Box::new(rhp()),
        "oracle" => Box::new(oracle()),
        "follow" => Box::new(follow()),
        _ => return None,
    })
}

/// What the helper of this name asks to be granted; nothing for an unknown name.
pub fn helper_grants(name: &str) -> Grants {
    match name {
        "random" | "rhp" | "follow" => Grants::IDS,
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
            assert!(helper(name).is_some(), "{name}");
            assert_eq!(helper_grants(name).goal, *name == "oracle");
            assert!(helper_grants(name).ids);
        }
        assert!(helper("nobody").is_none());
        assert_eq!(helper_grants("nobody"), Grants::NONE);
    }
}
