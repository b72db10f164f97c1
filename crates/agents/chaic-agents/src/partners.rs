//! Simulated people. They are part of the benchmark's definition: a change to them moves scores.

use std::sync::Arc;

use chaic_core::Agent;
use chaic_core::capability::Persona;
use chaic_core::observation::Grants;
use chaic_core::task::SceneKind;

pub use crate::child::ChildAgent;
use crate::planning_agent::PlanningAgent;
pub use crate::policies::{
    FetchOrder, HabitsError, PARTNER_VARIANTS, PartnerHabits, PartnerVariant, partner_habits,
    recorded_partner_name,
};
use crate::policies::{PartnerVariantPolicy, RecordedPolicy, RulePolicy, RuleProfile};
pub use crate::policies::{PlanRecording, RecordedInteraction, RecordedStep, is_real_failure};
use crate::rules::PlannerRules;

/// Grants of a partner: `ids`, `goal_place` and its own `goal`.
pub const PARTNER_GRANTS: Grants = Grants::PARTNER;

/// Returns the policy of a task's partner.
///
/// The indoor partner is an adult, a child or a person in a wheelchair, and leaves obstacles to
/// others (paper section 5.1.1). The rider fills the basket, then delivers it. The frail person
/// takes the nearest furniture and tries again when a piece is too heavy. Because both hands hold
/// the furniture, its time rules reduce to "carry what you hold to the truck".
pub fn policy(persona: Persona, scene: SceneKind) -> RulePolicy {
    let is_rider = persona == Persona::Rider || scene == SceneKind::Street;
    RulePolicy::new(if is_rider { RuleProfile::RIDER } else { RuleProfile::PARTNER })
}

/// Constructs the agent of a task's partner.
pub fn partner(persona: Persona, scene: SceneKind, rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(PlanningAgent::new(policy(persona, scene), rules))
}

/// Constructs the agent of a partner that deviates from the rules.
pub fn partner_variant(habits: PartnerHabits, rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(PlanningAgent::new(PartnerVariantPolicy::new(habits), rules))
}

/// Constructs the agent of a partner that repeats a recording.
pub fn recorded_partner(recording: Arc<PlanRecording>, rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(PlanningAgent::new(RecordedPolicy::new(recording), rules))
}

/// Returns the grants of a task's partner under these rules.
pub fn partner_grants(rules: PlannerRules) -> Grants {
    Grants { behavior: rules.knows_partner_behavior, ..PARTNER_GRANTS }
}

/// Constructs the agent of the child in the shopping task. It requires [`Grants::CHILD`].
pub fn child(rules: PlannerRules) -> Box<dyn Agent> {
    Box::new(ChildAgent::new(rules))
}
