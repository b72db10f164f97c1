//! Policies: rule-based, inferring, random, following the partner, of partners with other habits,
//! repeating a recording, or controlled by a caller.

mod external;
mod follow;
mod infer;
mod partner_habits;
mod partner_variant;
mod random;
mod recorded;
mod rule_policy;

pub use external::ExternalPolicy;
pub use follow::FollowPolicy;
pub use infer::{InferOptions, InferPolicy};
pub use partner_habits::{FetchOrder, HabitsError, PartnerHabits};
pub use partner_variant::{
    PARTNER_VARIANTS, PartnerVariant, PartnerVariantPolicy, partner_habits, recorded_partner_name,
};
pub use random::RandomPolicy;
pub use recorded::{
    PlanRecording, RecordedInteraction, RecordedPolicy, RecordedStep, is_real_failure,
};
pub use rule_policy::RulePolicy;

pub use crate::rules::{RuleProfile, TargetFilter, TargetOrder};
