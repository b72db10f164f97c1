//! Opponent model of one agent during an episode.

use std::sync::Arc;

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::memory::Memory;
use chaic_core::{Briefing, ClassId};
use chaic_nn::TrainingPass;

use super::network::{OpponentModel, OpponentPrediction};
use super::window::ObservationHistory;

/// Opponent model with the observations of an episode.
#[derive(Clone)]
pub struct OpponentTracker {
    model: Arc<OpponentModel>,
    pass: TrainingPass,
    history: ObservationHistory,
}

impl OpponentTracker {
    /// Creates a tracker; call [`OpponentTracker::reset`] before an episode.
    pub fn new(model: Arc<OpponentModel>) -> OpponentTracker {
        OpponentTracker { pass: model.pass(), model, history: ObservationHistory::default() }
    }

    /// Starts an episode.
    pub fn reset(&mut self, briefing: &Briefing) {
        self.history.reset(briefing);
    }

    /// Adds an observation, after the memory has.
    pub fn observe(&mut self, memory: &Memory, briefing: &Briefing, behavior: &BehaviorLog) {
        self.history.add(memory, briefing, behavior);
    }

    /// Predicts goal, target and limits of the partner from the last observations.
    pub fn predict(
        &mut self,
        memory: &Memory,
        briefing: &Briefing,
        behavior: &BehaviorLog,
    ) -> OpponentPrediction {
        let window = self.history.encode(memory, briefing, behavior);
        self.model.predict(&window, &mut self.pass)
    }

    /// Returns the predicted probability that the partner wants to pick up objects of this class.
    pub fn target_probability(&self, prediction: &OpponentPrediction, class: ClassId) -> f32 {
        let index = self.history.classes().iter().position(|c| *c == class);
        index.map_or(0.0, |k| prediction.targets[k])
    }
}
