//! Beliefs in traces: the most likely hypotheses, and the true ones to compare them with.

use std::collections::BTreeMap;

use chaic_core::agent::PartnerBelief;
use chaic_core::capability::Persona;
use chaic_core::catalogue::TargetSet;
use chaic_core::task::Goal;
use chaic_core::{AgentId, Frame};
use chaic_env::trace::{Header, Trace};

/// Probability from which a hypothesis counts as identified, per mille; `infer` plans for a target
/// set from the same probability.
pub const IDENTIFIED_PER_MILLE: u16 = 700;

/// Hypotheses with their probabilities, per mille.
pub type Distribution = [(String, u16)];

/// Returns the most likely hypothesis, the first one of equally likely ones.
pub fn most_likely(distribution: &Distribution) -> Option<(&str, u16)> {
    let each = distribution.iter().map(|(name, p)| (name.as_str(), *p));
    each.reduce(|best, next| if next.1 > best.1 { next } else { best })
}

/// Returns the probability of a hypothesis, per mille; 0 if the distribution lacks it.
pub fn per_mille_of(distribution: &Distribution, name: &str) -> u16 {
    distribution.iter().find(|(known, _)| known == name).map_or(0, |(_, p)| *p)
}

/// Returns the target set of a belief with most required objects of a goal, the first one of the
/// catalogue if several have as many. `None` if the goal requires no object of these sets.
pub fn true_set(goal: &Goal, belief: &PartnerBelief) -> Option<TargetSet> {
    let mut counts: BTreeMap<TargetSet, u32> = BTreeMap::new();
    for (class, n) in &goal.targets {
        let is_candidate =
            |set: &&TargetSet| belief.goals.iter().any(|(name, _)| name == set.name());
        for set in class.info().sets.iter().filter(is_candidate) {
            *counts.entry(*set).or_default() += n;
        }
    }
    let each = counts.into_iter().filter(|(_, n)| *n > 0);
    each.reduce(|best, next| if next.1 > best.1 { next } else { best }).map(|(set, _)| set)
}

/// Returns the kind of person of the partner.
pub fn true_person(header: &Header) -> Option<Persona> {
    header.people.iter().find(|p| p.agent == AgentId::PARTNER).map(|p| p.persona)
}

/// Returns the changes of the helper's belief with their frames, in order.
pub fn beliefs(trace: &Trace) -> impl Iterator<Item = (Frame, &PartnerBelief)> {
    let decisions = trace.decisions().filter(|d| d.agent == AgentId::HELPER);
    decisions.filter_map(|d| Some((d.frame, d.thought.as_ref()?.belief.as_deref()?)))
}

/// Returns the frame from which a target set stays the most likely one until the end, with a
/// probability of at least [`IDENTIFIED_PER_MILLE`].
pub fn identified(trace: &Trace, set: &str) -> Option<Frame> {
    let is_identified = |belief: &PartnerBelief| {
        most_likely(&belief.goals).is_some_and(|(name, p)| name == set && p >= IDENTIFIED_PER_MILLE)
    };
    let each = beliefs(trace).map(|(frame, belief)| (frame, is_identified(belief)));
    each.fold(None, |since, (frame, holds)| if holds { since.or(Some(frame)) } else { None })
}

#[cfg(test)]
mod tests {
    use chaic_core::ClassId;

    use super::*;

    fn distribution(entries: &[(&str, u16)]) -> Vec<(String, u16)> {
        entries.iter().map(|(name, p)| ((*name).to_owned(), *p)).collect()
    }

    #[test]
    fn the_first_of_equally_likely_hypotheses_is_the_most_likely() {
        let belief = distribution(&[("a", 200), ("b", 400), ("c", 400)]);
        assert_eq!(most_likely(&belief), Some(("b", 400)));
        assert_eq!((per_mille_of(&belief, "c"), per_mille_of(&belief, "d")), (400, 0));
        assert_eq!(most_likely(&[]), None);
    }

    #[test]
    fn the_true_set_has_most_required_objects() {
        let goal = |targets: &[(&str, u32)]| Goal {
            targets: targets.iter().map(|(name, n)| (ClassId::named(name), *n)).collect(),
        };
        let sets = |names: &[&str]| PartnerBelief {
            goals: names.iter().map(|name| ((*name).to_owned(), 0)).collect(),
            ..PartnerBelief::default()
        };
        // An apple is a fruit of houses and of shops.
        let fruit = goal(&[("apple", 4), ("banana", 3), ("pen", 1)]);
        assert_eq!(true_set(&fruit, &sets(&["work", "fruit"])), Some(TargetSet::Fruit));
        assert_eq!(true_set(&fruit, &sets(&["shop_fruit"])), Some(TargetSet::ShopFruit));
        assert_eq!(true_set(&fruit, &sets(&["work"])), None);
        let equal = goal(&[("apple", 2), ("pen", 2)]);
        assert_eq!(true_set(&equal, &sets(&["school", "fruit"])), Some(TargetSet::Fruit));
    }
}
