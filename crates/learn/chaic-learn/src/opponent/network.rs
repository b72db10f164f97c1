//! Network of the opponent model.

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::geom::math;
use chaic_core::observation::Grants;
use chaic_nn::TrainingPass;
use chaic_nn::weights::{self, WeightsError};

use super::window::{N_CLASS_FEATURES, N_STATE_FEATURES};
use super::{N_BODY_LIMITS, OpponentGoal};
use crate::actor_critic::{ActorCritic as _, ActorCriticOutput, log_softmax};
use crate::candidate_scorer::{CandidateScorer, CandidateSet};

/// Number of goals.
pub const N_GOALS: usize = OpponentGoal::ALL.len();

/// Kinds in weights files, without and with the partner's actions granted.
const KINDS: [&str; 2] = ["chaic opponent model 3", "chaic opponent model 3, granted"];
/// Name of the opponent model's parameters among those of a policy.
pub(crate) const OPPONENT: &str = "opponent";
/// Width of the hidden layers.
const WIDTH: usize = 96;

/// Creates the network architecture. Candidates are the classes that the partner may want to pick
/// up.
pub fn network() -> CandidateScorer {
    CandidateScorer::new(N_STATE_FEATURES, N_CLASS_FEATURES, WIDTH, N_GOALS + N_BODY_LIMITS)
}

/// Opponent model whose predictions a policy reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpponentInput {
    /// No opponent model.
    None,
    /// A model that sees the partner's actions.
    Observed,
    /// A model that is granted the partner's actions.
    Granted,
}

impl OpponentInput {
    /// All kinds of input.
    pub const ALL: [OpponentInput; 3] =
        [OpponentInput::None, OpponentInput::Observed, OpponentInput::Granted];

    /// Input for this opponent model.
    pub fn from_model(model: Option<&OpponentModel>) -> OpponentInput {
        match model.map(OpponentModel::is_granted) {
            None => OpponentInput::None,
            Some(false) => OpponentInput::Observed,
            Some(true) => OpponentInput::Granted,
        }
    }

    /// Suffix of the kind of a policy in weights files.
    pub(crate) fn kind_suffix(self) -> &'static str {
        match self {
            OpponentInput::None => "",
            OpponentInput::Observed => ", opponent model 3",
            OpponentInput::Granted => ", granted opponent model 3",
        }
    }
}

/// Prediction about the partner.
#[derive(Clone, Debug, PartialEq)]
pub struct OpponentPrediction {
    /// Probability of each goal, by [`OpponentGoal::index`].
    pub goals: [f32; N_GOALS],
    /// Probability of each class of the window to be the partner's target, given the goal to pick
    /// up.
    pub targets: Vec<f32>,
    /// Physical limits, as [`limits`](super::limits) defines them.
    pub limits: [f32; N_BODY_LIMITS],
}

/// Decoded outputs of the state head.
pub(crate) struct Heads {
    /// Log-probability of each goal.
    pub log_goals: Vec<f32>,
    /// Limits, between 0 and 1.
    pub limits: [f32; N_BODY_LIMITS],
}

impl Heads {
    pub(crate) fn new(output: &ActorCriticOutput) -> Heads {
        let (goals, limits) = output.values.split_at(N_GOALS);
        let mut limit_values = [0.0; N_BODY_LIMITS];
        for (value, x) in limit_values.iter_mut().zip(limits) {
            *value = 1.0 / (1.0 + math::exp(-x));
        }
        Heads { log_goals: log_softmax(goals), limits: limit_values }
    }
}

/// Network with parameter values.
#[derive(Clone, Debug)]
pub struct OpponentModel {
    network: CandidateScorer,
    parameters: Vec<f32>,
    is_granted: bool,
}

/// Returns the kind in weights files, for models that get the partner's actions as a grant or from
/// observation.
pub fn kind(is_granted: bool) -> &'static str {
    KINDS[usize::from(is_granted)]
}

impl OpponentModel {
    /// Creates a model with these parameters, for windows with the partner's actions granted or
    /// seen.
    ///
    /// # Panics
    /// If the number of parameters differs from that of the network.
    pub fn new(parameters: Vec<f32>, is_granted: bool) -> OpponentModel {
        let network = network();
        assert_eq!(parameters.len(), network.network.n_parameters());
        OpponentModel { network, parameters, is_granted }
    }

    /// True if the model was trained with the partner's actions granted, and needs them.
    pub fn is_granted(&self) -> bool {
        self.is_granted
    }

    /// Returns whether helpers with this perception have the grant that the model needs, if any.
    /// Learned behavior recognition replaces the granted actions.
    pub fn fits(&self, perception: &dyn PerceptionFactory) -> bool {
        let requested = Grants { behavior: self.is_granted, ..Grants::PLANNER };
        perception.grants(requested).behavior || !self.is_granted
    }

    /// Parses a weights file.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is incomplete or belongs to another network.
    pub fn from_bytes(bytes: &[u8]) -> Result<OpponentModel, WeightsError> {
        let read = |is_granted| {
            let parameters = weights::from_bytes(&network().network, bytes, kind(is_granted))?;
            Ok(OpponentModel::new(parameters, is_granted))
        };
        match read(false) {
            Err(WeightsError::Kind { found, .. }) if found == kind(true) => read(true),
            read => read,
        }
    }

    /// Returns the parameters.
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// Creates the buffers of a pass.
    pub fn pass(&self) -> TrainingPass {
        self.network.pass()
    }

    /// Predicts goal, target and limits of the partner.
    pub fn predict(&self, window: &CandidateSet, pass: &mut TrainingPass) -> OpponentPrediction {
        let windows = std::iter::once(window);
        let output = self.network.forward(&self.parameters, windows, pass).remove(0);
        let Heads { log_goals, limits } = Heads::new(&output);
        let mut goals = [0.0; N_GOALS];
        goals.iter_mut().zip(log_goals).for_each(|(p, l)| *p = math::exp(l));
        let targets = output.log_probs.iter().map(|l| math::exp(*l)).collect();
        OpponentPrediction { goals, targets, limits }
    }
}
