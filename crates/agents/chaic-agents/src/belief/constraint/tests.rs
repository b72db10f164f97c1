use chaic_core::briefing::TaskDisclosure;
use chaic_core::capability::{Impairment, Impairments};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, TaskId};

use super::*;
use crate::belief::tests::{evidence_with, failed, house, street, taken, yard};

fn probability(belief: &ConstraintBelief, persona: Persona) -> f32 {
    let each = belief.probabilities();
    each.iter().find(|(p, _)| *p == persona).map_or(0.0, |(_, probability)| *probability)
}

fn belief_of(evidence: &Evidence) -> ConstraintBelief {
    let mut belief = ConstraintBelief::new(&house());
    belief.update(evidence);
    belief
}

fn check(belief: &ConstraintBelief, expected: [f32; 3]) {
    let found =
        [Persona::Adult, Persona::Child, Persona::Wheelchair].map(|p| probability(belief, p));
    let sum: f32 = found.iter().sum();
    assert!((sum - 1.0).abs() < 1e-5, "{found:?} sums to {sum}");
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() < 2e-3, "{found:?} is not {expected:?}");
    }
}

#[test]
fn the_prior_is_the_share_of_the_papers_tasks() {
    check(&belief_of(&Evidence::default()), [1.0 / 6.0, 3.0 / 6.0, 2.0 / 6.0]);
    for (briefing, persona) in [(street(), Persona::Rider), (yard(), Persona::Frail)] {
        assert_eq!(ConstraintBelief::new(&briefing).probabilities(), vec![(persona, 1.0)]);
    }
    let mut unknown = house();
    unknown.possible_targets.clear();
    let unknown = ConstraintBelief::new(&unknown);
    assert_eq!(unknown.probabilities().len(), 5);
    assert_eq!(probability(&unknown, Persona::Child), 3.0 / 8.0);
}

#[test]
fn a_disclosed_partner_is_certain_whatever_is_seen() {
    let mut briefing = house();
    let impairments = Impairments::new(Impairment::OneHanded);
    let partner = PersonKind { persona: Persona::Wheelchair, impairments };
    briefing.disclosure = Some(TaskDisclosure { task: TaskId::Obstacle, partner });
    let mut belief = ConstraintBelief::new(&briefing);
    belief.update(&evidence_with(|e| {
        e.max_top_m = 1.75;
        e.n_sightings = 50;
    }));
    assert_eq!(belief.probabilities(), vec![(Persona::Wheelchair, 1.0)]);
    assert_eq!(belief.capability(), partner.capability());
}

#[test]
fn heights_lead_to_hand_worked_posteriors() {
    // Likelihoods of adult (1.75 m), child (1.2 m) and wheelchair user (1.35 m) after five
    // sightings, where an occluded top has 0.25 / 5 = 0.05:
    // 1.20 m: 0.05, 1, and exp(-0.5 (0.09 / 0.05)^2) = 0.198 for 0.15 m less.
    //   1/6 * 0.05 = 0.00833, 3/6 = 0.5, 2/6 * 0.198 = 0.0660; the sum is 0.5743.
    // 1.35 m: 0.05, 0.198 and 1. 0.00833, 0.0990, 0.3333; the sum is 0.4406.
    // 1.75 m: 1, 0.003 and 0.003. 0.1667, 0.0015, 0.001; the sum is 0.1692.
    // 0.60 m: occluded for all, so the prior.
    for (max_top_m, expected) in [
        (1.20, [0.0145, 0.8706, 0.1149]),
        (1.35, [0.0189, 0.2246, 0.7565]),
        (1.75, [0.9852, 0.0089, 0.0059]),
        (0.60, [1.0 / 6.0, 0.5, 1.0 / 3.0]),
    ] {
        let evidence = evidence_with(|e| {
            e.max_top_m = max_top_m;
            e.n_sightings = 5;
        });
        check(&belief_of(&evidence), expected);
    }
    // More sightings of the same height leave less chance to occlusion.
    let after = |n_sightings: u32| {
        let evidence = evidence_with(|e| {
            e.max_top_m = 1.2;
            e.n_sightings = n_sightings;
        });
        probability(&belief_of(&evidence), Persona::Adult)
    };
    assert!(after(1) > after(3) && after(3) > after(20) && after(20) > 0.0);
}

#[test]
fn failures_and_takes_lead_to_hand_worked_posteriors() {
    // A failure at a top of 0.1 m. The wheelchair user (from 0.25 m) succeeds with
    // exp(-0.15) / 2 = 0.4304: 0.98 * 0.5696 + 0.02 * 0.5 = 0.5682. The others fail for unknown
    // reasons: 0.98 * 0.02 + 0.01 = 0.0296.
    // 1/6 * 0.0296 = 0.00493, 1/2 * 0.0296 = 0.0148, 1/3 * 0.5682 = 0.1894; the sum is 0.2091.
    let fails = evidence_with(|e| e.failed = vec![failed(20, "apple", 0.1)]);
    check(&belief_of(&fails), [0.0236, 0.0708, 0.9056]);
    // A take at 2 m. Child and wheelchair user (up to 1.5 m) succeed with exp(-0.5) / 2 = 0.3033:
    // 0.98 * 0.3033 + 0.02 = 0.3172. 1/6, 0.1586, 0.1057; the sum is 0.4310.
    let mut take = taken("apple", 1.0);
    take.top_m = Some(2.0);
    let takes = evidence_with(|e| e.taken = [(crate::TrackId(20), take)].into());
    check(&belief_of(&takes), [0.3867, 0.3680, 0.2453]);
    // A place of 2 m: exp(-0.5) = 0.6065 is the chance of child and wheelchair user, so
    // 0.98 * 0.3935 + 0.01 = 0.3956; the adult fails for unknown reasons.
    // 0.00493, 0.1978, 0.1319; the sum is 0.3346.
    let kind = AttemptKind::PutOn;
    let put = FailedAttempt { kind, ..failed(30, "refrigerator", 2.0) };
    check(&belief_of(&evidence_with(|e| e.failed = vec![put])), [0.0147, 0.5911, 0.3941]);
    // Only the wheelchair user cannot remove obstacles: 0.99 against 0.0296.
    let kind = AttemptKind::RemoveObstacle;
    let remove = FailedAttempt { kind, ..failed(31, "trashbin", 0.6) };
    let belief = belief_of(&evidence_with(|e| e.failed = vec![remove]));
    check(&belief, [0.0141, 0.0423, 0.9436]);
}

#[test]
fn a_slow_walk_indicates_a_child() {
    let evidence = evidence_with(|e| e.speed = Some(0.023));
    // 0.023 is half of the others' 0.047: z = -2.04, exp(-0.5 z^2) = 0.1245; the child has about 1.
    // 1/6 * 0.1245 = 0.02075, 0.4990, 0.0415; the sum is 0.5617.
    check(&belief_of(&evidence), [0.037, 0.889, 0.074]);
    // Impossible speeds have the same minimum for all.
    let evidence = evidence_with(|e| e.speed = Some(1.0));
    check(&belief_of(&evidence), [1.0 / 6.0, 0.5, 1.0 / 3.0]);
}

/// Attempts a pick-up without the formula: the excess must survive an exponential draw, and beyond
/// the limit one of two attempts fails.
fn succeeds(capability: &Capability, top_m: f32, rng: &mut RngStream) -> bool {
    let delta = excess(top_m, capability.pick_range_m);
    let survives = -math::ln(1.0 - rng.unit()) * LimitPenalty::PICK.alpha > delta;
    delta <= 0.0 || (survives && rng.below(2) == 0)
}

#[test]
fn likelihoods_match_simulated_attempts() {
    const ATTEMPTS: u32 = 100_000;
    let apple = ClassId::named("apple").info().mass_kg;
    let rng = &mut RngStream::new(1, "attempts", 0);
    for persona in [Persona::Adult, Persona::Child, Persona::Wheelchair] {
        let capability = persona.capability();
        for top_m in [0.05, 0.2, 1.0, 1.6, 2.1] {
            let attempt = |rng: &mut RngStream| u32::from(succeeds(&capability, top_m, rng));
            let n: u32 = (0..ATTEMPTS).map(|_| attempt(rng)).sum();
            let (frequency, chance) =
                (n as f32 / ATTEMPTS as f32, take_chance(&capability, top_m, apple));
            assert!((frequency - chance).abs() < 6e-3, "{persona:?} {top_m}: {frequency} {chance}");
            let mut take = taken("apple", 1.0);
            take.top_m = Some(top_m);
            let mixed = 0.98 * frequency + 0.02;
            assert!((take_likelihood(&capability, &take) - mixed).abs() < 6e-3);
            if frequency < 0.9 {
                let mixed = 0.98 * (1.0 - frequency) + 0.01;
                let likelihood = failure_likelihood(&capability, &failed(20, "apple", top_m));
                assert!((likelihood - mixed).abs() < 6e-3);
            }
        }
    }
}

#[test]
fn posteriors_are_calibrated_on_simulated_partners() {
    const EPISODES: u64 = 5_000;
    let personas = [Persona::Adult, Persona::Child, Persona::Wheelchair];
    let (mut sums, mut n_true) = ([0.0; 3], [0.0; 3]);
    let mut sum_of_true = 0.0;
    for episode in 0..EPISODES {
        let rng = &mut RngStream::new(2, "partners", episode);
        let truth = [0, 1, 1, 1, 2, 2][rng.below(6)];
        let mut evidence = Evidence::default();
        for k in 0..6 {
            let top_m = [0.1, 0.8, 1.8, 2.2][rng.below(4)];
            if succeeds(&personas[truth].capability(), top_m, rng) {
                let mut take = taken("apple", 1.0);
                take.top_m = Some(top_m);
                evidence.taken.insert(crate::TrackId(20 + k), take);
            } else {
                evidence.failed.push(failed(20 + k, "apple", top_m));
            }
        }
        let belief = belief_of(&evidence);
        for (i, persona) in personas.into_iter().enumerate() {
            sums[i] += probability(&belief, persona) / EPISODES as f32;
        }
        n_true[truth] += 1.0 / EPISODES as f32;
        sum_of_true += probability(&belief, personas[truth]) / EPISODES as f32;
    }
    for (mean, frequency) in sums.iter().zip(n_true) {
        assert!((mean - frequency).abs() < 0.02, "{sums:?} {n_true:?}");
    }
    // The prior gives the true person (1 + 9 + 4) / 36 = 0.39 on average.
    assert!(sum_of_true > 0.6, "{sum_of_true}");
}

#[test]
fn probabilities_are_expectations_over_the_posterior() {
    let belief = ConstraintBelief::new(&house());
    // Only the adult reaches 2 m, and only the wheelchair user does not reach the floor.
    assert!((belief.reach_probability(2.0) - 1.0 / 6.0).abs() < 1e-5);
    assert!((belief.reach_probability(0.1) - 4.0 / 6.0).abs() < 1e-5);
    assert_eq!(belief.capability(), Persona::Child.capability());
    assert!((belief.fragile_task_probability() - 1.0 / 6.0).abs() < 1e-5);
}

#[test]
fn the_order_of_failures_does_not_matter() {
    let attempts = [failed(20, "apple", 1.8), failed(21, "pen", 0.1), failed(22, "key", 2.1)];
    let of = |order: [usize; 3]| {
        let failed = order.map(|i| attempts[i]).to_vec();
        belief_of(&evidence_with(|e| e.failed = failed)).probabilities()
    };
    for order in [[0, 2, 1], [1, 0, 2], [2, 1, 0]] {
        for (a, b) in of([0, 1, 2]).into_iter().zip(of(order)) {
            assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-6);
        }
    }
}
