//! Who chooses: by rules, at random, or always the same.

mod follow;
mod random;
mod rules;

pub use follow::Follow;
pub use random::Random;
pub use rules::{RuleProfile, Rules, TargetOrder, Wanted};
