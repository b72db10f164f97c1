//! The simulated people: part of the benchmark's definition, so that changing them moves scores.

use chaic_core::Agent;
use chaic_core::capability::Persona;
use chaic_core::observation::Grants;
use chaic_core::task::SceneKind;

pub use crate::child::Child;
use crate::mind::Mind;
use crate::policies::{RulePolicy, RuleProfile};
use crate::rules::PlannerRules;

/// What a partner is granted: perfect segmentation and its own goal.
pub const PARTNER_GRANTS: Grants = Grants::PARTNER;

/// The policy of a task's partner.
///
/// The constrained person indoors is an adult, a child or in a wheelchair, and leaves obstacles to others (paper section
/// 5.1.1). The rider fills the basket, then delivers it. The frail person takes the nearest furniture, and tries again when
/// it is too heavy: with furniture the rules of time come to "carry what you hold to the truck".
pub fn policy(persona: Persona, scene: SceneKind) -> RulePolicy {
    let is_rider = persona == Persona::Rider || scene == SceneKind::Street;
    RulePolicy::new(if is_rider { RuleProfile::RIDER } else { RuleProfile::PARTNER })
}

/// The mind of a task's partner.
pub fn partner(persona: Persona, scene: SceneKind, rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(Mind::new(policy(persona, scene), rules))
}

/// What the mind of a task's partner is granted.
pub fn partner_grants(rules: PlannerRules) -> Grants {
    Grants { behavior: rules.knows_holding, ..PARTNER_GRANTS }
}

/// The mind of the child who comes along while shopping; it is granted [`Grants::CHILD`].
pub fn child(rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(Child::new(rules))
}
