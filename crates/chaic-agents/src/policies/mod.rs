//! Who chooses: by rules, at random, or always the same.

mod follow;
mod random;
mod rule_policy;

pub use follow::Follow;
pub use random::Random;
pub use rule_policy::{RulePolicy, RuleProfile, TargetOrder, Wanted};
