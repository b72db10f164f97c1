//! Posterior over the kinds of people that the partner can be.

use chaic_core::Briefing;
use chaic_core::capability::{Capability, LimitPenalty, PersonKind, Persona, excess};
use chaic_core::geom::math;
use chaic_core::task::{Arrangement, TaskInfo};

use super::evidence::{AttemptKind, Evidence, FailedAttempt, PickUpEvidence, reliability};
use super::scene::{paper_tasks, scene_of};
use super::{normalized, posterior};

/// Chance of a failure within all limits, for example by a tremor.
const UNEXPLAINED_FAILURE: f32 = 0.02;
/// Likelihood of an observed failure if the attempt was recognized wrongly. It is the same for all
/// people, so such an attempt carries no information.
const MISRECOGNIZED_FAILURE: f32 = 0.5;

/// Distance from the height within which the top of a fully visible body is equally likely, meters.
const TOP_TOLERANCE_M: f32 = 0.06;
/// Standard deviation of the top beyond this distance, meters.
const TOP_SD_M: f32 = 0.05;
/// Chance that one sighting shows no part near the top of the body. After n sightings the chance is
/// this divided by n: successive sightings are not independent.
const OCCLUDED: f32 = 0.25;
/// Minimum of that chance.
const MIN_OCCLUDED: f32 = 0.01;
/// Chance of a point above the body: another person or a piece of furniture counted as body.
const ABOVE_BODY: f32 = 0.003;

/// Standard deviation of the estimated speed relative to the true one.
const SPEED_SD: f32 = 0.25;
/// Minimum likelihood of an estimated speed.
const MIN_SPEED_LIKELIHOOD: f32 = 0.05;

/// Belief about the kind of person of the partner.
#[derive(Clone, Debug)]
pub struct ConstraintBelief {
    candidates: Vec<Candidate>,
    probabilities: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    kind: PersonKind,
    prior: f32,
    /// Fraction of this person's tasks in which fragile objects are targets.
    fragile_share: f32,
}

impl ConstraintBelief {
    /// Creates the prior: the fraction of the paper's tasks in this kind of scene with each kind of
    /// partner. A disclosed partner is certain.
    pub fn new(briefing: &Briefing) -> ConstraintBelief {
        let has_fragile = |t: &TaskInfo| t.arrangement == Arrangement::HighTargets;
        let share = |is: bool| f32::from(u8::from(is));
        let candidates: Vec<Candidate> = match &briefing.disclosure {
            Some(disclosure) => vec![Candidate {
                kind: disclosure.partner,
                prior: 1.0,
                fragile_share: share(has_fragile(disclosure.task.info())),
            }],
            None => {
                let tasks: Vec<&TaskInfo> =
                    paper_tasks(scene_of(&briefing.possible_targets)).collect();
                let mut kinds: Vec<PersonKind> = tasks.iter().map(|t| t.partner).collect();
                kinds.sort_unstable();
                kinds.dedup();
                let candidate = |kind: PersonKind| {
                    let own: Vec<_> = tasks.iter().filter(|t| t.partner == kind).collect();
                    let n_fragile = own.iter().filter(|t| has_fragile(t)).count();
                    Candidate {
                        kind,
                        prior: own.len() as f32 / tasks.len() as f32,
                        fragile_share: n_fragile as f32 / own.len() as f32,
                    }
                };
                kinds.into_iter().map(candidate).collect()
            }
        };
        let probabilities = normalized(candidates.iter().map(|c| c.prior).collect());
        ConstraintBelief { candidates, probabilities }
    }

    /// Replaces the posterior by that of the evidence.
    pub fn update(&mut self, evidence: &Evidence) {
        let weight = |c: &Candidate| (c.prior, log_likelihood(&c.kind.capability(), evidence));
        self.probabilities = posterior(&self.candidates.iter().map(weight).collect::<Vec<_>>());
    }

    /// Returns the probability of each persona that is possible in this kind of scene.
    pub fn probabilities(&self) -> Vec<(Persona, f32)> {
        let personas = self.candidates.iter().map(|c| c.kind.persona);
        personas.zip(self.probabilities.iter().copied()).collect()
    }

    /// Returns the capability of the most likely person (the first one of equally likely ones), with
    /// disclosed impairments.
    pub fn capability(&self) -> Capability {
        let each = self.candidates.iter().zip(self.probabilities.iter().copied());
        each.reduce(|best, next| if next.1 > best.1 { next } else { best })
            .expect("each kind of scene has a task, and each task a partner")
            .0
            .kind
            .capability()
    }

    /// Returns the probability that an object with its top at `top_m` meters is within the
    /// partner's range for pick-ups.
    pub fn reach_probability(&self, top_m: f32) -> f32 {
        self.expect(|c| f32::from(u8::from(excess(top_m, c.pick_range_m) <= 0.0)))
    }

    /// Returns the probability that a surface with its top at `top_m` meters is within the partner's
    /// range for put-ons.
    pub fn put_probability(&self, top_m: f32) -> f32 {
        self.expect(|c| f32::from(u8::from(excess(top_m, c.put_range_m) <= 0.0)))
    }

    /// Returns the probability that the partner can lift this mass alone, kilograms.
    pub fn lift_probability(&self, mass_kg: f32) -> f32 {
        self.expect(|c| f32::from(u8::from(mass_kg <= c.strength_kg)))
    }

    /// Returns the probability that the task of this person has fragile targets.
    pub(super) fn fragile_task_probability(&self) -> f32 {
        let each = self.candidates.iter().zip(&self.probabilities);
        each.map(|(c, p)| p * c.fragile_share).sum()
    }

    fn expect(&self, value: impl Fn(&Capability) -> f32) -> f32 {
        let each = self.candidates.iter().zip(&self.probabilities);
        each.map(|(c, p)| p * value(&c.kind.capability())).sum::<f32>().min(1.0)
    }
}

/// Returns the log-likelihood of all evidence for a person.
fn log_likelihood(capability: &Capability, evidence: &Evidence) -> f32 {
    let tops = match evidence.n_sightings {
        0 => 0.0,
        n => math::ln(top_likelihood(evidence.max_top_m, capability.height_m, n)),
    };
    let takes = evidence.taken.values().map(|t| math::ln(take_likelihood(capability, t)));
    let failures = evidence.failed.iter().map(|f| math::ln(failure_likelihood(capability, f)));
    let speed =
        evidence.speed.map_or(0.0, |v| math::ln(speed_likelihood(v, capability.speed_m_per_frame)));
    tops + takes.sum::<f32>() + failures.sum::<f32>() + speed
}

/// Returns the likelihood of the highest point among `n` sightings of a body of this height.
fn top_likelihood(max_top_m: f32, height_m: f32, n: u32) -> f32 {
    let distance_m = max_top_m - height_m;
    let z = (distance_m.abs() - TOP_TOLERANCE_M).max(0.0) / TOP_SD_M;
    let floor = match distance_m < 0.0 {
        true => (OCCLUDED / n as f32).max(MIN_OCCLUDED),
        false => ABOVE_BODY,
    };
    math::exp(-0.5 * z * z).max(floor)
}

/// Returns the success chance of a person's pick-up of an object.
fn take_chance(capability: &Capability, top_m: f32, mass_kg: f32) -> f32 {
    LimitPenalty::PICK.chance(excess(top_m, capability.pick_range_m))
        * LimitPenalty::LIFT.chance(mass_kg - capability.strength_kg)
}

/// Returns the likelihood of a take. A take that is not real is equally likely for all people.
fn take_likelihood(capability: &Capability, take: &PickUpEvidence) -> f32 {
    let Some(top_m) = take.top_m else { return 1.0 };
    let real = take.reliability();
    real * take_chance(capability, top_m, take.class.info().mass_kg) + (1.0 - real)
}

/// Returns the likelihood of a failed attempt.
fn failure_likelihood(capability: &Capability, failed: &FailedAttempt) -> f32 {
    let chance = match failed.kind {
        AttemptKind::PickUp => take_chance(capability, failed.top_m, failed.class.info().mass_kg),
        AttemptKind::PutOn => {
            LimitPenalty::PUT.chance(excess(failed.top_m, capability.put_range_m))
        }
        AttemptKind::RemoveObstacle => f32::from(u8::from(capability.removes_obstacles)),
    };
    let real = reliability(failed.strength);
    real * (1.0 - chance).max(UNEXPLAINED_FAILURE) + (1.0 - real) * MISRECOGNIZED_FAILURE
}

/// Returns the likelihood of an estimated speed for a person of this true speed, in meters per
/// frame.
fn speed_likelihood(speed: f32, true_speed: f32) -> f32 {
    let z = (speed / true_speed - 1.0) / SPEED_SD;
    math::exp(-0.5 * z * z).max(MIN_SPEED_LIKELIHOOD)
}

#[cfg(test)]
mod tests;
