//! Description of the policy's belief and plans for traces.

use chaic_core::agent::PartnerBelief;
use chaic_core::briefing::CompanionRole;
use chaic_core::{Briefing, ClassId, Frame};

use super::constants::MIN_EXTRA_PROBABILITY;
use super::{InferPolicy, Step};
use crate::belief::{AttemptKind, Belief, Evidence};
use crate::memory::Memory;
use crate::team::simulation::{SimulatedEvent, timeline};
use crate::team::{Operation, PlaceKind, TeamProblem};
use crate::track::TrackId;

/// Maximum number of described operations of one person.
const MAX_OPERATIONS: usize = 6;

/// Returns the belief, the evidence for it, and the plans.
pub(super) fn partner_belief(
    policy: &InferPolicy,
    briefing: &Briefing,
    memory: &Memory,
) -> Option<PartnerBelief> {
    let belief = policy.belief.as_ref()?;
    let per_mille = |p: f32| (1000.0 * p).round() as u16;
    let goals = belief.goal.set_probabilities().into_iter();
    let people = belief.constraint.probabilities().into_iter();
    let partner = memory.companion(briefing, CompanionRole::Partner);
    let centimeters = |m: f32| (100.0 * m).round() as i32;
    Some(PartnerBelief {
        goals: goals.map(|(set, p)| (set.name().to_owned(), per_mille(p))).collect(),
        people: people.map(|(who, p)| (who.name().to_owned(), per_mille(p))).collect(),
        extra: extra_classes(belief, briefing),
        position_cm: partner
            .map(|p| [centimeters(p.position_in_world.x), centimeters(p.position_in_world.z)]),
        evidence: describe_evidence(&belief.evidence),
        plan: policy.steps.iter().take(MAX_OPERATIONS).map(|s| describe_step(s, memory)).collect(),
        partner_plan: policy.partner_plan.clone(),
    })
}

/// Returns the classes outside the most likely set that are probably wanted.
fn extra_classes(belief: &Belief, briefing: &Briefing) -> Vec<ClassId> {
    let (set, probability) = belief.goal.most_likely();
    if probability < MIN_EXTRA_PROBABILITY {
        return Vec::new();
    }
    let outside = briefing.possible_targets.iter().filter(|c| !c.info().sets.contains(&set));
    outside
        .filter(|c| belief.goal.probability_wanted(**c) >= MIN_EXTRA_PROBABILITY)
        .copied()
        .collect()
}

/// Describes the observations of the partner in the order of their frames, then the objects that it
/// passed.
fn describe_evidence(evidence: &Evidence) -> Vec<String> {
    let mut lines: Vec<(Frame, String)> = Vec::new();
    for (track, take) in &evidence.taken {
        let percent = (100.0 * take.reliability()).round();
        let text = format!("took {} {track} ({percent} % reliable)", take.class.info().label);
        lines.push((take.frame, text));
    }
    for attempt in &evidence.failed {
        let what = match attempt.kind {
            AttemptKind::PickUp => "pick up",
            AttemptKind::PutOn => "put something on",
            AttemptKind::RemoveObstacle => "remove",
        };
        let (label, track) = (attempt.class.info().label, attempt.track);
        lines.push((attempt.frame, format!("failed to {what} {label} {track}")));
    }
    lines.sort();
    let passed = evidence.passed.iter();
    let mut left: Vec<String> =
        passed.map(|(track, class)| format!("left {} {track}", class.info().label)).collect();
    left.sort();
    lines.into_iter().map(|(_, text)| text).chain(left).collect()
}

fn describe_step(step: &Step, memory: &Memory) -> String {
    let name = |track: TrackId| match memory.class_of(track) {
        Some(class) => format!("{} {track}", class.info().label),
        None => track.to_string(),
    };
    match step {
        Step::PickUp(track) => format!("pick up {}", name(*track)),
        Step::TakeContainer(track) => format!("take container {}", name(*track)),
        Step::Deliver => "deliver".to_owned(),
        Step::Remove(track) => format!("remove {}", name(*track)),
    }
}

/// Describes what the partner is expected to do under the most likely goal.
pub(super) fn expected_partner_plan(
    problem: &TeamProblem,
    operations: &[Operation],
) -> Vec<String> {
    let probability = |i: &usize| problem.hypotheses[*i].probability;
    let hypotheses = 0..problem.hypotheses.len();
    let best = hypotheses.max_by(|a, b| probability(a).total_cmp(&probability(b)));
    let Some(hypothesis) = best else { return Vec::new() };
    let mut lines: Vec<String> = Vec::new();
    for event in timeline(problem, operations, hypothesis) {
        let line = match event {
            SimulatedEvent::Arrival { frames, by_helper: false, place } => {
                let info = &problem.places[place];
                let what = match info.kind {
                    PlaceKind::Container => "take container",
                    _ => "pick up",
                };
                format!("{what} {} {} in {:.0} frames", info.class.info().label, info.track, frames)
            }
            SimulatedEvent::Delivery(delivery) if !delivery.by_helper => {
                let class = problem.classes.get(delivery.class_index);
                let label = class.map_or("an object", |c| c.info().label);
                format!("deliver {label} in {:.0} frames", delivery.frames)
            }
            _ => continue,
        };
        lines.push(line);
    }
    lines.truncate(MAX_OPERATIONS);
    lines
}
