//! The simulated people: part of the benchmark's definition, so that changing them moves scores.

use chaic_protocol::Agent;
use chaic_protocol::capability::Persona;
use chaic_protocol::observation::Grants;
use chaic_protocol::task::SceneKind;

pub use crate::child::Child;
use crate::mind::Mind;
use crate::policies::{RulePolicy, RuleProfile};
use crate::rules::PlannerRules;

/// What a partner is granted: perfect segmentation and its own goal.
pub const PARTNER_GRANTS: Grants = Grants::PARTNER;

/// The constrained person indoors: adult, child or in a wheelchair. Obstacles are left to others
/// (paper section 5.1.1).
pub fn constrained(rules: PlannerRules) -> Mind<RulePolicy> {
    Mind::new(RulePolicy::new(RuleProfile::PARTNER), rules)
}

/// The person with the bicycle: fills the basket, then delivers it.
pub fn rider(rules: PlannerRules) -> Mind<RulePolicy> {
    Mind::new(RulePolicy::new(RuleProfile::RIDER), rules)
}

/// The frail person who moves house: takes the nearest furniture, and tries again when it is too
/// heavy. With furniture the rules of time come to "carry what you hold to the truck".
pub fn frail(rules: PlannerRules) -> Mind<RulePolicy> {
    Mind::new(RulePolicy::new(RuleProfile::PARTNER), rules)
}

/// The mind of a task's partner.
pub fn partner(persona: Persona, scene: SceneKind, rules: PlannerRules) -> Box<dyn Agent> {
    match (persona, scene) {
        (Persona::Rider, _) | (_, SceneKind::Street) => Box::new(rider(rules)),
        (Persona::Frail, _) | (_, SceneKind::Yard) => Box::new(frail(rules)),
        _ => Box::new(constrained(rules)),
    }
}

/// What the mind of a task's partner is granted.
pub fn partner_grants(rules: PlannerRules) -> Grants {
    Grants { behavior: rules.knows_holding, ..PARTNER_GRANTS }
}

/// The mind of the child who comes along while shopping; it is granted [`Grants::CHILD`].
pub fn child(rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(Child::new(rules))
}
