//! Posterior over the goals that the partner can have.

use std::collections::BTreeMap;

use chaic_core::briefing::Goal;
use chaic_core::catalogue::TargetSet;
use chaic_core::geom::math;
use chaic_core::task::SceneKind;
use chaic_core::{Briefing, ClassId, Role};

use super::constraint::ConstraintBelief;
use super::evidence::{AttemptKind, Evidence, reliability};
use super::observed_walks::ObservedWalks;
use super::posterior;
use super::scene::{expected_per_class, scene_of, set_size, target_sets};

/// Number of fragile objects that are wanted, if any are (facts S11.2).
const N_FRAGILE: u32 = 2;
/// Number of objects of the extra class (facts S8.1, S11.2).
const N_EXTRA: u32 = 1;
/// Required number of each class in a goal with unknown counts: more than any episode has.
const UNKNOWN_COUNT: u32 = 9;
/// Factor of the likelihood for each wanted object within reach that the partner passed.
const PASSED_FACTOR: f32 = 0.74;
/// Time after which the partner would have gone to a wanted object that it knows, frames: the
/// likelihood of walking elsewhere falls to 1/e. Ours, chosen on `gen-standard:7000..7010`.
const WALK_ELSEWHERE_FRAMES: f32 = 60.0;
/// Maximum effect of such walks on the logarithm of the likelihood: walks around furniture may look
/// like walks elsewhere.
const MAX_WALKS_EFFECT: f32 = 4.0;
/// Minimum probability of the extra class and of fragile targets in a concluded goal.
const MIN_ADDITION: f32 = 0.5;

/// Belief about the goal of the partner.
#[derive(Clone, Debug)]
pub struct GoalBelief {
    granted: Option<Goal>,
    possible: Vec<ClassId>,
    sets: Vec<TargetSet>,
    hypotheses: Vec<Hypothesis>,
    probabilities: Vec<f32>,
    /// [`Hypothesis::count`] of each possible class: shape [possible, hypotheses].
    counts: Vec<f32>,
    /// Expected number of objects that are delivered or in the partner's hands, by class.
    secured: BTreeMap<ClassId, f32>,
    wants_everything: bool,
}

/// A possible goal.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hypothesis {
    set: TargetSet,
    /// Class of another set of which one object is wanted.
    extra: Option<ClassId>,
    wants_fragile: bool,
    /// Prior without the probability of fragile targets.
    prior: f32,
}

impl Hypothesis {
    /// Returns the expected number of wanted objects of a class.
    fn count(&self, class: ClassId) -> f32 {
        if class.info().sets.contains(&self.set) {
            expected_per_class(self.set)
        } else {
            self.limit(class).unwrap_or(0) as f32
        }
    }

    /// Returns the exact number of wanted objects of a class outside the set; `None` inside.
    fn limit(&self, class: ClassId) -> Option<u32> {
        if class.info().sets.contains(&self.set) {
            return None;
        }
        let is_fragile = class.info().role == Role::Fragile;
        Some(match () {
            () if self.extra == Some(class) => N_EXTRA,
            () if is_fragile && self.wants_fragile => N_FRAGILE,
            () => 0,
        })
    }

    fn total(&self) -> f32 {
        let extra = if self.extra.is_some() { N_EXTRA } else { 0 };
        let fragile = if self.wants_fragile { N_FRAGILE } else { 0 };
        set_size(self.set) + (extra + fragile) as f32
    }
}

/// Summary of the evidence for all hypotheses.
struct Summary<'a> {
    possible: &'a [ClassId],
    walks: &'a ObservedWalks,
    /// Reliabilities of the takes, by class, highest first.
    takes: BTreeMap<ClassId, Vec<f32>>,
    /// Classes of passed objects with the probability that the object is within reach.
    passed: Vec<(ClassId, f32)>,
    /// Probability that a take that is not real shows this class.
    background: f32,
}

impl<'a> Summary<'a> {
    fn new(
        evidence: &'a Evidence,
        constraint: &ConstraintBelief,
        possible: &'a [ClassId],
    ) -> Summary<'a> {
        let mut by_track: BTreeMap<_, (ClassId, f32)> = BTreeMap::new();
        let takes = evidence.taken.iter().map(|(track, t)| (*track, t.class, t.reliability()));
        // A failed attempt shows the intention as a take does; repetitions show nothing new.
        let failed = evidence.failed.iter().filter(|f| f.kind == AttemptKind::PickUp);
        let failed = failed.map(|f| (f.track, f.class, reliability(f.strength)));
        for (track, class, reliability) in takes.chain(failed) {
            let known = by_track.entry(track).or_insert((class, reliability));
            known.1 = known.1.max(reliability);
        }
        let mut takes: BTreeMap<ClassId, Vec<f32>> = BTreeMap::new();
        for (class, reliability) in by_track.into_values().filter(|(c, _)| possible.contains(c)) {
            takes.entry(class).or_default().push(reliability);
        }
        takes.values_mut().for_each(|list| list.sort_by(|a, b| b.total_cmp(a)));
        let reach = |track| evidence.lying_top_m(track).map(|m| constraint.reach_probability(m));
        let passed = evidence.passed.iter().map(|(t, class)| (*class, reach(*t).unwrap_or(1.0)));
        let background = 1.0 / possible.len().max(1) as f32;
        let (passed, walks) = (passed.collect(), &evidence.walks);
        Summary { possible, walks, takes, passed, background }
    }

    fn log_likelihood(&self, hypothesis: &Hypothesis) -> f32 {
        let total = hypothesis.total();
        let mut sum = 0.0;
        for (class, reliabilities) in &self.takes {
            let limit = hypothesis.limit(*class).map_or(usize::MAX, |n| n as usize);
            for (k, real) in reliabilities.iter().enumerate() {
                let wanted = if k < limit { hypothesis.count(*class) / total } else { 0.0 };
                sum += math::ln(real * wanted + (1.0 - real) * self.background);
            }
        }
        for (class, reach) in &self.passed {
            let n_taken = self.takes.get(class).map_or(0, Vec::len);
            let is_satisfied = hypothesis.limit(*class).is_some_and(|n| n_taken >= n as usize);
            if !is_satisfied {
                sum += math::ln(1.0 - (1.0 - PASSED_FACTOR) * reach);
            }
        }
        sum - (self.contradicting_frames(hypothesis) / WALK_ELSEWHERE_FRAMES).min(MAX_WALKS_EFFECT)
    }

    /// Returns the frames in which the partner knew of an object that this hypothesis still wants,
    /// and approached none.
    fn contradicting_frames(&self, hypothesis: &Hypothesis) -> f32 {
        let mut wanted = 0;
        for (k, class) in self.possible.iter().enumerate().take(32) {
            let n_taken = self.takes.get(class).map_or(0, Vec::len);
            let is_wanted = match hypothesis.limit(*class) {
                None => true,
                Some(limit) => n_taken < limit as usize,
            };
            wanted |= u32::from(is_wanted) << k;
        }
        self.walks.frames(wanted)
    }
}

impl GoalBelief {
    /// Creates the prior: uniform over the target sets of the scene, then over the classes of the
    /// other sets for the extra object. A granted goal is certain.
    pub fn new(briefing: &Briefing) -> GoalBelief {
        let possible = briefing.possible_targets.clone();
        let granted = briefing.goal.clone();
        let scene = scene_of(&possible);
        let has_set = |set: &TargetSet| possible.iter().any(|c| c.info().sets.contains(set));
        let mut sets = scene.map(target_sets).unwrap_or_default();
        sets.retain(has_set);
        let hypotheses = sets.iter().flat_map(|set| hypotheses_of(*set, &sets, &possible));
        let hypotheses: Vec<Hypothesis> = hypotheses.collect();
        let probabilities = vec![0.0; hypotheses.len()];
        let count_of = |class: &ClassId| {
            let class = *class;
            hypotheses.iter().map(move |h| h.count(class))
        };
        let counts = possible.iter().flat_map(count_of).collect();
        let wants_everything = scene == Some(SceneKind::Yard);
        let secured = BTreeMap::new();
        GoalBelief {
            granted,
            possible,
            sets,
            hypotheses,
            probabilities,
            counts,
            secured,
            wants_everything,
        }
    }

    /// Replaces the posterior by that of the evidence. The constraint determines which objects the
    /// partner can reach, and the prior of fragile targets.
    pub fn update(&mut self, evidence: &Evidence, constraint: &ConstraintBelief) {
        let summary = Summary::new(evidence, constraint, &self.possible);
        let fragile = match self.possible.iter().any(|c| c.info().role == Role::Fragile) {
            true => constraint.fragile_task_probability(),
            false => 0.0,
        };
        let weight = |h: &Hypothesis| {
            let fragile = if h.wants_fragile { fragile } else { 1.0 - fragile };
            (h.prior * fragile, summary.log_likelihood(h))
        };
        self.probabilities = posterior(&self.hypotheses.iter().map(weight).collect::<Vec<_>>());
        self.secured.clear();
        let not_delivered =
            evidence.taken.iter().filter(|(track, _)| !evidence.delivered.contains_key(track));
        let taken = not_delivered.map(|(_, t)| (t.class, t.reliability()));
        for (class, n) in evidence.delivered.values().map(|class| (*class, 1.0)).chain(taken) {
            *self.secured.entry(class).or_default() += n;
        }
    }

    /// Returns the probability of each target set of the scene.
    pub fn set_probabilities(&self) -> Vec<(TargetSet, f32)> {
        if let Some(granted) = &self.granted {
            let best = self.set_of(granted);
            return self.sets.iter().map(|s| (*s, f32::from(u8::from(best == Some(*s))))).collect();
        }
        let probability = |set: TargetSet| self.sum(|h| h.set == set);
        self.sets.iter().map(|set| (*set, probability(*set))).collect()
    }

    /// Returns the probability that at least one object of this class is wanted.
    pub fn probability_wanted(&self, class: ClassId) -> f32 {
        match &self.granted {
            Some(granted) => f32::from(u8::from(granted.count(class) > 0)),
            None if !self.possible.contains(&class) => 0.0,
            None => {
                let wanted = self.counts_of(class).filter(|(count, _)| *count > 0.0);
                wanted.map(|(_, p)| p).sum::<f32>().min(1.0)
            }
        }
    }

    /// Returns the probability that at least one object of this class is wanted, given the target
    /// set.
    pub fn probability_wanted_given(&self, set: TargetSet, class: ClassId) -> f32 {
        let of_set = self.sum(|h| h.set == set);
        self.sum(|h| h.set == set && h.count(class) > 0.0) / of_set.max(f32::MIN_POSITIVE)
    }

    /// Returns the expected number of wanted objects of this class that are neither delivered nor
    /// held by the partner.
    pub fn expected_missing(&self, class: ClassId) -> f32 {
        let secured = self.secured.get(&class).copied().unwrap_or(0.0);
        let missing = |count: f32| (count - secured).max(0.0);
        match &self.granted {
            Some(granted) => missing(granted.count(class) as f32),
            None if !self.possible.contains(&class) => 0.0,
            None => self.counts_of(class).map(|(count, p)| p * missing(count)).sum(),
        }
    }

    /// Returns the most likely target set and its probability; the first one of equally likely
    /// ones. Without possible targets the probability is 0.
    pub fn most_likely(&self) -> (TargetSet, f32) {
        let sets = self.set_probabilities().into_iter();
        sets.reduce(|best, next| if next.1 > best.1 { next } else { best })
            .unwrap_or((TargetSet::Fruit, 0.0))
    }

    /// Returns the concluded goal; `None` while the probability of the most likely set is below
    /// `min_probability`. Counts of the set are unknown, so they are 9 for each class. The extra
    /// class and fragile targets are included from a probability of 0.5, given the set. A granted
    /// goal is returned as it is.
    pub fn goal(&self, min_probability: f32) -> Option<Goal> {
        if self.granted.is_some() {
            return self.granted.clone();
        }
        let (set, probability) = self.most_likely();
        if probability <= 0.0 || probability < min_probability {
            return None;
        }
        let given_set =
            |is: &dyn Fn(&Hypothesis) -> bool| self.sum(|h| h.set == set && is(h)) / probability;
        let count = |class: ClassId| {
            if class.info().sets.contains(&set) {
                UNKNOWN_COUNT
            } else if class.info().role == Role::Fragile {
                let is_wanted = given_set(&|h| h.wants_fragile) >= MIN_ADDITION;
                if is_wanted { N_FRAGILE } else { 0 }
            } else {
                let is_wanted = given_set(&|h| h.extra == Some(class)) >= MIN_ADDITION;
                if is_wanted { N_EXTRA } else { 0 }
            }
        };
        let targets = self.possible.iter().map(|class| (*class, count(*class)));
        let mut targets: Vec<(ClassId, u32)> = targets.filter(|(_, n)| *n > 0).collect();
        targets.sort_unstable();
        Some(Goal { targets })
    }

    /// Returns the entropy of the target set, bits.
    pub fn entropy_bits(&self) -> f32 {
        let term = |p: f32| if p > 0.0 { -p * math::ln(p) / std::f32::consts::LN_2 } else { 0.0 };
        self.set_probabilities().into_iter().map(|(_, p)| term(p)).sum::<f32>().max(0.0)
    }

    /// Returns whether all possible targets are wanted, as in a yard.
    pub fn wants_everything(&self) -> bool {
        self.wants_everything
    }

    /// Returns the expected number of wanted objects of a class and the probability, for each
    /// hypothesis; nothing for a class that is no possible target.
    fn counts_of(&self, class: ClassId) -> impl Iterator<Item = (f32, f32)> {
        let n = self.hypotheses.len();
        let row = self.possible.iter().position(|possible| *possible == class);
        let counts = row.map_or(&[][..], |row| &self.counts[row * n..(row + 1) * n]);
        counts.iter().copied().zip(self.probabilities.iter().copied())
    }

    fn sum(&self, is: impl Fn(&Hypothesis) -> bool) -> f32 {
        let each = self.hypotheses.iter().zip(&self.probabilities);
        each.filter(|(h, _)| is(h)).map(|(_, p)| *p).sum::<f32>().min(1.0)
    }

    /// Returns the set that most objects of a goal belong to.
    fn set_of(&self, goal: &Goal) -> Option<TargetSet> {
        let n = |set: TargetSet| -> u32 {
            let targets = goal.targets.iter();
            targets.filter(|(c, _)| c.info().sets.contains(&set)).map(|(_, n)| n).sum()
        };
        let sets = self.sets.iter().copied().filter(|set| n(*set) > 0);
        sets.reduce(|best, next| if n(next) > n(best) { next } else { best })
    }
}

/// Returns the hypotheses with this target set; their priors sum to the set's prior.
fn hypotheses_of(set: TargetSet, sets: &[TargetSet], possible: &[ClassId]) -> Vec<Hypothesis> {
    let is_other = |class: &ClassId| {
        let of = class.info().sets;
        !of.contains(&set) && of.iter().any(|s| sets.contains(s))
    };
    let mut extras: Vec<Option<ClassId>> =
        possible.iter().copied().filter(is_other).map(Some).collect();
    if extras.is_empty() {
        extras.push(None);
    }
    let prior = 1.0 / (sets.len() * extras.len()) as f32;
    let with = |extra: Option<ClassId>| {
        [false, true].map(|wants_fragile| Hypothesis { set, extra, wants_fragile, prior })
    };
    extras.into_iter().flat_map(with).collect()
}

#[cfg(test)]
mod tests;
