use chaic_core::capability::Persona;

use super::*;
use crate::TrackId;
use crate::belief::evidence::PickUpEvidence;
use crate::belief::tests::{evidence_with, failed, house, street, taken, yard};

/// Creates evidence of takes; tracks count from `first`.
fn takes(first: u32, list: &[(&str, f32)]) -> Evidence {
    let take = |(class, strength): &(&str, f32)| -> PickUpEvidence { taken(class, *strength) };
    evidence_with(|e| e.taken = (first..).map(TrackId).zip(list.iter().map(take)).collect())
}

fn belief_in(briefing: &Briefing, evidence: &Evidence) -> GoalBelief {
    let mut constraint = ConstraintBelief::new(briefing);
    constraint.update(evidence);
    let mut goal = GoalBelief::new(briefing);
    goal.update(evidence, &constraint);
    goal
}

fn belief_of(evidence: &Evidence) -> GoalBelief {
    belief_in(&house(), evidence)
}

/// Checks the probabilities of fruit, bread, work and school.
fn check(belief: &GoalBelief, expected: [f32; 4]) {
    let found: Vec<f32> = belief.set_probabilities().into_iter().map(|(_, p)| p).collect();
    assert_eq!(found.len(), 4);
    let sum: f32 = found.iter().sum();
    assert!((sum - 1.0).abs() < 1e-5, "{found:?} sums to {sum}");
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() < 5e-4, "{found:?} is not {expected:?}");
    }
}

fn class(name: &str) -> ClassId {
    ClassId::named(name)
}

#[test]
fn without_evidence_the_belief_is_the_prior() {
    let belief = belief_of(&Evidence::default());
    check(&belief, [0.25; 4]);
    assert!((belief.most_likely().1 - 0.25).abs() < 1e-5);
    assert!((belief.entropy_bits() - 2.0).abs() < 1e-5);
    assert_eq!(belief.goal(0.5), None);
    assert!(!belief.wants_everything());
    // Fruit is wanted as a set (1/4), or as the extra class of bread (1 of 11 classes), work or
    // school (1 of 10 each).
    let expected = 0.25 * (1.0 + 1.0 / 11.0 + 2.0 / 10.0);
    assert!((belief.probability_wanted(class("apple")) - expected).abs() < 1e-5);
    assert!((belief.probability_wanted(class("vase")) - 1.0 / 6.0).abs() < 1e-5);
    assert_eq!(belief.probability_wanted(class("bed")), 0.0);
    let expected = 0.25 * (7.0 / 3.0 + 1.0 / 11.0 + 2.0 / 10.0);
    assert!((belief.expected_missing(class("apple")) - expected).abs() < 1e-5);
}

#[test]
fn a_certain_take_leads_to_the_hand_worked_posterior() {
    // A real take (0.98) shows an apple in proportion to the wanted objects. A false one shows
    // each of 15 classes equally: 0.02 / 15 = 0.00133. Fragile targets (chance 1/6) add 2 objects.
    // Fruit, 7/3 of 8 or 10: 5/6 * 0.28717 + 1/6 * 0.23 = 0.27764.
    // Bread, 1 of 8 or 10 if apple is the extra class (1/11):
    //   1/11 * (5/6 * 0.12383 + 1/6 * 0.09933) + 10/11 * 0.00133 = 0.01210.
    // Work, 1 of 10 or 12 (1/10): 1/10 * (5/6 * 0.09933 + 1/6 * 0.083) + 9/10 * 0.00133 = 0.01086.
    // School, 1 of 9 or 11 (1/10):
    //   1/10 * (5/6 * 0.11022 + 1/6 * 0.09042) + 9/10 * 0.00133 = 0.01189.
    // The sum is 0.31249.
    let belief = belief_of(&takes(20, &[("apple", 1.0)]));
    check(&belief, [0.8885, 0.0387, 0.0348, 0.0381]);
    let goal = belief.goal(0.8).expect("it is above");
    assert_eq!(belief.goal(0.9), None);
    let named = |list: [(&str, u32); 3]| list.map(|(name, n)| (class(name), n)).to_vec();
    assert_eq!(goal.targets, named([("apple", 9), ("banana", 9), ("orange", 9)]));
}

#[test]
fn stronger_evidence_moves_the_belief_further() {
    let after = |strength| belief_of(&takes(20, &[("apple", strength)])).most_likely().1;
    let each = [0.1, 0.3, 0.4, 0.8, 1.0].map(after);
    assert!(each[0] > 0.25 && each.windows(2).all(|w| w[1] > w[0]), "{each:?}");
    // Strength 0.3 is real with 0.5: 0.5 * w + 0.5 / 15, with the same w as above.
    // Fruit: 0.5 * (5/6 * 0.29167 + 1/6 * 0.23333) + 0.03333 = 0.17431.
    // Bread: 0.5 / 11 * (5/6 / 8 + 1/6 / 10) + 0.03333 = 0.03883.
    // Work: 0.05 * (5/6 / 10 + 1/6 / 12) + 0.03333 = 0.03819.
    // School: 0.05 * (5/6 / 9 + 1/6 / 11) + 0.03333 = 0.03872. The sum is 0.29005.
    check(&belief_of(&takes(20, &[("apple", 0.3)])), [0.6010, 0.1339, 0.1317, 0.1335]);
}

#[test]
fn objects_left_lying_lead_to_the_hand_worked_posterior() {
    let mut evidence = Evidence::default();
    evidence.passed.extend([(TrackId(20), class("apple")), (TrackId(21), class("apple"))]);
    // Fruit: 0.74^2 = 0.5476. Bread with apple as the extra class: 1/11 * 0.5476 + 10/11 = 0.95887.
    // Work and school: 1/10 * 0.5476 + 9/10 = 0.95476. The sum is 3.41599.
    check(&belief_of(&evidence), [0.1603, 0.2807, 0.2795, 0.2795]);
    // Out of reach, they say nothing. Both lie at 2 m, and the partner is a child.
    evidence.set_lying_top(TrackId(20), 2.0);
    evidence.set_lying_top(TrackId(21), 2.0);
    let mut briefing = house();
    briefing.disclosure = Some(chaic_core::briefing::TaskDisclosure {
        task: chaic_core::TaskId::HighGoal,
        partner: Persona::Child.into(),
    });
    check(&belief_in(&briefing, &evidence), [0.25; 4]);
}

#[test]
fn one_object_of_another_set_is_the_extra_class_and_two_are_not() {
    let fruit = [("apple", 1.0), ("banana", 1.0), ("apple", 1.0)];
    let one = belief_of(&takes(20, &[&fruit[..], &[("pen", 1.0)]].concat()));
    assert_eq!(one.most_likely().0, TargetSet::Fruit);
    let goal = one.goal(0.9).expect("fruit is nearly certain");
    assert_eq!((goal.count(class("pen")), goal.count(class("apple"))), (1, 9));
    assert_eq!(goal.count(class("mouse")), 0);
    assert!(one.probability_wanted(class("pen")) > 0.9);
    // A second pen is explained by a false reading only, with any extra class.
    let two = belief_of(&takes(20, &[&fruit[..], &[("pen", 1.0), ("pen", 1.0)]].concat()));
    assert!(two.most_likely().1 < one.most_likely().1);
    // One apple and two pens are school with an extra apple.
    let pens = belief_of(&takes(20, &[("apple", 1.0), ("pen", 1.0), ("pen", 1.0)]));
    assert_eq!(pens.most_likely().0, TargetSet::School);
    assert_eq!(pens.goal(0.5).map(|g| g.count(class("apple"))), Some(1));
}

#[test]
fn classes_are_wanted_given_a_set_if_they_belong_to_it_or_explain_a_take() {
    let set = |class: &str| chaic_core::ClassId::named(class).info().sets[0];
    let belief = belief_of(&takes(60, &[("apple", 1.0), ("orange", 1.0), ("bread", 1.0)]));
    let given = |set_of: &str, class_name: &str| {
        belief.probability_wanted_given(set(set_of), class(class_name))
    };
    assert!((given("apple", "banana") - 1.0).abs() < 1e-5, "it belongs to the set");
    let bread = given("apple", "bread");
    assert!(bread > 0.9, "the extra class of fruit: {bread}");
    assert!(given("apple", "pen") < 0.1);
    assert!((given("bread", "bread") - 1.0).abs() < 1e-5);
}

#[test]
fn objects_beyond_the_wanted_number_are_explained_by_false_readings_only() {
    let briefing = house();
    let constraint = ConstraintBelief::new(&briefing);
    let extra = Some(class("pen"));
    let fruit = Hypothesis { set: TargetSet::Fruit, extra, wants_fragile: true, prior: 1.0 };
    let log_likelihood = |list: &[(&str, f32)]| {
        Summary::new(&takes(20, list), &constraint, &briefing.possible_targets)
            .log_likelihood(&fruit)
    };
    // Of 10 objects, 1 is a pen and 2 are vases. False readings: 0.02 / 15, and 0.08 / 15 at
    // strength 0.4. The strongest readings are the explained ones.
    let (false_sure, false_weak) = (0.02 / 15.0, 0.08 / 15.0);
    let (pen, vase) = (0.98 * 0.1 + false_sure, 0.98 * 0.2 + false_sure);
    for (list, expected) in [
        (&[("pen", 0.4), ("pen", 1.0)][..], math::ln(pen) + math::ln(false_weak)),
        (&[("pen", 1.0), ("pen", 1.0)], math::ln(pen) + math::ln(false_sure)),
        (&[("vase", 1.0); 3], 2.0 * math::ln(vase) + math::ln(false_sure)),
        (&[("apple", 1.0); 2], 2.0 * math::ln(0.98 * 0.7 / 3.0 + false_sure)),
    ] {
        assert!((log_likelihood(list) - expected).abs() < 1e-3, "{list:?}");
    }
}

#[test]
fn a_taken_vase_makes_fragile_targets_likely() {
    let belief = belief_of(&takes(20, &[("apple", 1.0), ("vase", 1.0)]));
    assert!(belief.probability_wanted(class("vase")) > 0.9);
    assert_eq!(belief.goal(0.5).map(|g| g.count(class("vase"))), Some(2));
    // One of two vases is taken.
    assert!((belief.expected_missing(class("vase")) - 1.0).abs() < 0.1);
    // With another task disclosed, fragile objects are no targets.
    let mut briefing = house();
    briefing.disclosure = Some(chaic_core::briefing::TaskDisclosure {
        task: chaic_core::TaskId::Obstacle,
        partner: Persona::Wheelchair.into(),
    });
    let belief = belief_in(&briefing, &takes(20, &[("vase", 1.0)]));
    assert_eq!(belief.probability_wanted(class("vase")), 0.0);
}

#[test]
fn a_failed_attempt_counts_like_a_certain_take_of_that_object() {
    let mut fails = evidence_with(|e| e.failed = vec![failed(20, "apple", 1.0)]);
    let once = belief_of(&fails).set_probabilities();
    // The constraint changes as well, and the prior of fragile targets only slightly.
    let take = belief_of(&takes(20, &[("apple", 1.0)])).set_probabilities();
    assert!(once.iter().zip(&take).all(|(a, b)| (a.1 - b.1).abs() < 0.01), "{once:?} {take:?}");
    fails.failed.push(failed(20, "apple", 1.0));
    fails.taken = takes(20, &[("apple", 1.0)]).taken;
    let again = belief_of(&fails).set_probabilities();
    assert!(once.iter().zip(&again).all(|(a, b)| (a.1 - b.1).abs() < 0.01), "counted once");
    // A place on which a put-on failed is no target.
    let put = crate::belief::FailedAttempt { kind: AttemptKind::PutOn, ..failed(30, "bed", 0.5) };
    check(&belief_of(&evidence_with(|e| e.failed = vec![put])), [0.25; 4]);
}

#[test]
fn the_order_of_takes_does_not_matter() {
    let list = [("apple", 1.0), ("pen", 0.3), ("pen", 1.0), ("key", 0.4), ("banana", 0.8)];
    let of = |order: [usize; 5]| belief_of(&takes(20, &order.map(|i| list[i]))).set_probabilities();
    let first = of([0, 1, 2, 3, 4]);
    for order in [[4, 3, 2, 1, 0], [2, 1, 4, 0, 3], [1, 2, 0, 4, 3]] {
        for (a, b) in first.iter().zip(of(order)) {
            assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-6, "{order:?}");
        }
    }
}

#[test]
fn contradictory_evidence_keeps_a_proper_distribution() {
    let briefing = house();
    let names: Vec<(&str, f32)> = briefing
        .possible_targets
        .iter()
        .flat_map(|c| std::iter::repeat_n((c.name(), 1.0), 20))
        .collect();
    let mut evidence = takes(100, &names);
    evidence.passed.extend(evidence.taken.keys().map(|t| (TrackId(t.0 + 5000), class("apple"))));
    let belief = belief_of(&evidence);
    let sum: f32 = belief.set_probabilities().iter().map(|(_, p)| *p).sum();
    assert!((sum - 1.0).abs() < 1e-4 && belief.entropy_bits().is_finite());
    for class in &briefing.possible_targets {
        let wanted = belief.probability_wanted(*class);
        assert!((0.0..=1.0).contains(&wanted), "{class}: {wanted}");
        assert!(belief.expected_missing(*class) >= 0.0);
    }
}

#[test]
fn delivered_and_taken_objects_are_no_longer_missing() {
    let mut evidence = takes(20, &[("apple", 1.0)]);
    evidence.delivered.extend([(TrackId(40), class("apple")), (TrackId(20), class("apple"))]);
    let belief = belief_of(&evidence);
    // Two of 7/3 apples are delivered; the taken one counts once.
    let fruit = belief.most_likely().1;
    assert!((belief.expected_missing(class("apple")) - fruit / 3.0).abs() < 1e-4);
}

#[test]
fn a_granted_goal_is_certain() {
    let mut briefing = house();
    let targets = vec![(class("apple"), 3), (class("pen"), 1)];
    briefing.goal = Some(Goal { targets });
    let belief = belief_in(&briefing, &takes(20, &[("key", 1.0), ("apple", 1.0)]));
    assert_eq!(belief.goal(1.0), briefing.goal);
    let wanted = |name: &str| belief.probability_wanted(class(name));
    assert_eq!((wanted("apple"), wanted("pen"), wanted("key")), (1.0, 1.0, 0.0));
    assert_eq!(belief.most_likely(), (TargetSet::Fruit, 1.0));
    assert_eq!(belief.entropy_bits(), 0.0);
    assert!((belief.expected_missing(class("apple")) - 2.02).abs() < 1e-3);
}

#[test]
fn without_possible_targets_nothing_is_wanted() {
    let mut briefing = house();
    briefing.possible_targets.clear();
    let belief = belief_in(&briefing, &takes(20, &[("apple", 1.0)]));
    assert!(belief.set_probabilities().is_empty() && belief.most_likely().1 == 0.0);
    assert_eq!(belief.goal(0.0), None);
    assert_eq!((belief.probability_wanted(class("apple")), belief.entropy_bits()), (0.0, 0.0));
}

#[test]
fn streets_have_their_own_sets_and_yards_want_everything() {
    let belief = belief_in(&street(), &Evidence::default());
    assert!(belief.set_probabilities().iter().all(|(_, p)| (p - 1.0 / 3.0).abs() < 1e-5));
    let belief = belief_in(&street(), &takes(20, &[("pepsi_can", 1.0)]));
    assert_eq!(belief.most_likely().0, TargetSet::ShopDrinks);
    assert!(belief.most_likely().1 > 0.8);
    let belief = belief_in(&yard(), &Evidence::default());
    assert!(belief.wants_everything());
    let goal = belief.goal(1.0).expect("it is certain");
    assert_eq!(goal.targets.len(), yard().possible_targets.len());
    assert!(goal.targets.iter().all(|(c, n)| *n == 9 && belief.probability_wanted(*c) == 1.0));
}
