//! Who chooses: by rules, at random, always the same, or as told.

mod external;
mod follow;
mod random;
mod rule_policy;

pub use external::External;
pub use follow::Follow;
pub use random::Random;
pub use rule_policy::{RulePolicy, RuleProfile, TargetOrder, Wanted};
