//! Policies: the paper's rules, goal inference, random choice, following the partner, partners with other
//! habits, recorded partners, and plans chosen by a caller.

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
