//! Earlier decisions of an episode, as inputs of a policy with memory.

use std::collections::VecDeque;

use chaic_core::Frame;

use crate::candidate_scorer::CandidateSet;
use crate::scales::{TIME_SCALE_FRAMES, normalize_clamped};

/// Number of additional features per row with memory: whether the row is an earlier decision, and its
/// age. Both are 0 for the candidates of this decision.
pub const N_MEMORY_PLAN_FEATURES: usize = 2;

/// The last decisions between several candidates.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DecisionMemory {
    capacity: usize,
    decisions: VecDeque<EarlierDecision>,
    /// Encoded decision whose choice is not known yet. Its rows lack the [`N_MEMORY_PLAN_FEATURES`]
    /// features.
    pending: Option<CandidateSet>,
}

/// Decision whose choice is known.
#[derive(Clone, Debug, PartialEq)]
struct EarlierDecision {
    frame: Frame,
    /// State features and features of the chosen candidate, without [`N_MEMORY_PLAN_FEATURES`].
    features: Vec<f32>,
}

impl DecisionMemory {
    /// Creates a memory of this many decisions.
    pub(crate) fn new(capacity: usize) -> DecisionMemory {
        DecisionMemory { capacity, ..DecisionMemory::default() }
    }

    /// Forgets all decisions.
    pub(crate) fn clear(&mut self) {
        self.decisions.clear();
        self.pending = None;
    }

    /// Adds the earlier decisions to an encoded decision.
    pub(crate) fn add_to(&mut self, encoded: &mut CandidateSet, frame: Frame) {
        if self.capacity == 0 || encoded.n_candidates == 0 {
            return;
        }
        let pending = self.pending.insert(encoded.clone());
        let rows = pending.candidates.chunks_exact(pending.candidates.len() / pending.n_candidates);
        encoded.candidates =
            rows.flat_map(|row| row.iter().copied().chain([0.0; N_MEMORY_PLAN_FEATURES])).collect();
        encoded.memory = self.decisions.iter().flat_map(|decision| decision.row(frame)).collect();
    }

    /// Records the chosen candidate of the last encoded decision; `None` if the agent did something
    /// else, so nothing is remembered.
    pub(crate) fn record(&mut self, chosen: Option<usize>, frame: Frame) {
        let (Some(pending), Some(chosen)) = (self.pending.take(), chosen) else { return };
        let CandidateSet { state, candidates, n_candidates, .. } = pending;
        let n = candidates.len() / n_candidates;
        let features = [&state[..], &candidates[chosen * n..][..n]].concat();
        if self.decisions.len() == self.capacity {
            self.decisions.pop_front();
        }
        self.decisions.push_back(EarlierDecision { frame, features });
    }
}

impl EarlierDecision {
    /// Returns the input row at a later frame.
    fn row(&self, frame: Frame) -> impl Iterator<Item = f32> + '_ {
        let age = frame.saturating_sub(self.frame) as f32;
        let age_features: [f32; N_MEMORY_PLAN_FEATURES] =
            [1.0, normalize_clamped(age, TIME_SCALE_FRAMES)];
        self.features.iter().copied().chain(age_features)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(frame: Frame) -> CandidateSet {
        let x = frame as f32;
        CandidateSet {
            state: vec![x],
            candidates: vec![x + 1.0, x + 2.0],
            n_candidates: 2,
            memory: Vec::new(),
        }
    }

    /// Each row is the state, the chosen candidate, a mark and the age.
    #[test]
    fn the_last_choices_are_remembered_with_their_age() {
        let mut memory = DecisionMemory::new(2);
        let mut decide = |frame, chosen| {
            let mut decision = encoded(frame);
            memory.add_to(&mut decision, frame);
            memory.record(chosen, frame);
            decision
        };
        let first = decide(300, Some(1));
        assert_eq!(first.candidates, [301.0, 0.0, 0.0, 302.0, 0.0, 0.0]);
        assert!(first.memory.is_empty());
        assert_eq!(decide(600, Some(0)).memory, [300.0, 302.0, 1.0, 0.1]);
        let rows = [300.0, 302.0, 1.0, 0.2, 600.0, 601.0, 1.0, 0.1];
        assert_eq!(decide(900, None).memory, rows);
        decide(1200, Some(1));
        let rows = [600.0, 601.0, 1.0, 0.3, 1200.0, 1202.0, 1.0, 0.1];
        assert_eq!(decide(1500, None).memory, rows);
    }

    #[test]
    fn without_capacity_nothing_is_added() {
        let mut memory = DecisionMemory::new(0);
        let mut decision = encoded(1);
        memory.add_to(&mut decision, 1);
        memory.record(Some(1), 1);
        assert_eq!((decision, memory), (encoded(1), DecisionMemory::new(0)));
    }
}
