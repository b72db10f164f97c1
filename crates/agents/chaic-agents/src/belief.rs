//! Belief about the partner: the hidden goal and the physical constraint, inferred from sightings.
//!
//! [`Evidence`] collects observations of the partner. [`GoalBelief`] and [`ConstraintBelief`] are
//! exact posteriors over small sets of hypotheses. Both follow from the evidence alone, so the
//! order of observations does not matter.
//!
//! **What it is not**: it chooses no plans, and it reads nothing that is neither in the image nor
//! granted. Granted goals and constraints are certain.

mod constraint;
mod evidence;
mod goal;
mod observed_walks;
mod scene;
mod visibility;
mod walking_speed;

use chaic_core::capability::Persona;
use chaic_core::{Briefing, Frame};

use crate::behavior::BehaviorLog;
use crate::memory::Memory;

pub use constraint::ConstraintBelief;
pub use evidence::{AttemptKind, Evidence, FailedAttempt, PickUpEvidence};
pub use goal::GoalBelief;
pub use observed_walks::ObservedWalks;
pub use scene::scene_of;
pub use visibility::is_hidden;

/// Time before the end from which any goal place is used, frames (chosen on
/// `gen-standard:7000..7010`, like the next two).
pub(crate) const LAST_DELIVERY_FRAMES: Frame = 1000;
/// Minimum height of a goal place while the partner may be a child, meters. In one of its tasks
/// only high places count, and in the others they count too (`world.high_goal_min_top_m`).
const HIGH_GOAL_M: f32 = 1.5;
/// Probability of a child from which [`HIGH_GOAL_M`] applies.
const CHILD_PROBABILITY: f32 = 0.4;

/// Belief of one agent about its partner.
#[derive(Clone, Debug)]
pub struct Belief {
    /// Classes that the partner wants.
    pub goal: GoalBelief,
    /// Kind of person of the partner.
    pub constraint: ConstraintBelief,
    /// Observations from which both follow.
    pub evidence: Evidence,
}

impl Belief {
    /// Creates the prior belief of an episode.
    pub fn new(briefing: &Briefing) -> Belief {
        let evidence = Evidence::default();
        let constraint = ConstraintBelief::new(briefing);
        let mut goal = GoalBelief::new(briefing);
        goal.update(&evidence, &constraint);
        Belief { goal, constraint, evidence }
    }

    /// Updates the belief, after memory and behavior have been updated with the same observation.
    pub fn observe(&mut self, briefing: &Briefing, memory: &Memory, behavior: &BehaviorLog) {
        self.evidence.observe(briefing, memory, behavior);
        self.constraint.update(&self.evidence);
        self.goal.update(&self.evidence, &self.constraint);
    }

    /// Returns the minimum height of goal places that count in every task that the partner may have,
    /// meters; `None` if the goal is granted.
    pub fn goal_place_min_top_m(&self, briefing: &Briefing, memory: &Memory) -> Option<f32> {
        if briefing.goal.is_some() {
            return None;
        }
        let child = self.constraint.probabilities().into_iter();
        let child: f32 = child.filter(|(p, _)| *p == Persona::Child).map(|(_, p)| p).sum();
        let may_be_high = child >= CHILD_PROBABILITY && self.evidence.n_sightings > 0;
        let is_late = memory.frame + LAST_DELIVERY_FRAMES > briefing.horizon;
        let knows_high = || {
            let is_high = |top_m: f32| top_m >= HIGH_GOAL_M - 0.1;
            memory.goal_places().iter().any(|(place, _)| is_high(place.top_m))
        };
        Some(if may_be_high && (!is_late || knows_high()) { HIGH_GOAL_M } else { 0.0 })
    }
}

/// Returns the weights divided by their sum; unchanged if the sum is 0.
fn normalized(mut weights: Vec<f32>) -> Vec<f32> {
    let sum: f32 = weights.iter().sum();
    if sum > 0.0 {
        weights.iter_mut().for_each(|w| *w /= sum);
    }
    weights
}

/// Returns the posterior of hypotheses, each given as prior and log-likelihood.
fn posterior(hypotheses: &[(f32, f32)]) -> Vec<f32> {
    let possible = hypotheses.iter().filter(|(prior, _)| *prior > 0.0);
    let highest = possible.map(|(_, log_likelihood)| *log_likelihood).fold(f32::MIN, f32::max);
    let weight = |(prior, log_likelihood): &(f32, f32)| match *prior > 0.0 {
        true => prior * chaic_core::geom::math::exp(log_likelihood - highest),
        false => 0.0,
    };
    normalized(hypotheses.iter().map(weight).collect())
}

#[cfg(test)]
mod tests;
