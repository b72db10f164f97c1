//! Kinds of policies that choose plans, by their inputs, and their weights files.

use std::ops::Range;
use std::sync::Arc;

use chaic_core::observation::Grants;
use chaic_nn::weights::{self, WeightsError};

use crate::candidate_scorer::CandidateScorer;
use crate::decision_memory::N_MEMORY_PLAN_FEATURES;
use crate::features::{
    FeatureEncoder, N_INFER_HINT_FEATURES, N_OPPONENT_PLAN_FEATURES, N_OPPONENT_STATE_FEATURES,
    N_PLAN_FEATURES, N_STATE_FEATURES, OptionalInputs,
};
use crate::opponent::network::{self, OPPONENT, OpponentInput, OpponentModel};

/// Width of the hidden layers.
const WIDTH: usize = 96;
/// Maximum number of earlier decisions that a policy reads. An episode has about 80 decisions, and
/// the cost of attention grows with the square of the number of rows.
pub const MAX_MEMORY: usize = 32;

/// Kind of network that chooses plans: its inputs besides the features of memory and belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PolicyKind {
    /// Predictions of an opponent model (Smart-Help).
    pub opponent: OpponentInput,
    /// True if one feature marks the plan that the helper `infer` would choose.
    pub has_infer_hint: bool,
    /// Number of earlier decisions that the network reads, 0 to [`MAX_MEMORY`].
    pub memory: usize,
}

impl PolicyKind {
    /// Policy without optional inputs.
    pub const PLAIN: PolicyKind =
        PolicyKind { opponent: OpponentInput::None, has_infer_hint: false, memory: 0 };

    /// Returns all kinds.
    fn all() -> impl Iterator<Item = PolicyKind> {
        OpponentInput::ALL.into_iter().flat_map(|opponent| {
            [false, true].into_iter().flat_map(move |has_infer_hint| {
                (0..=MAX_MEMORY).map(move |memory| PolicyKind { opponent, has_infer_hint, memory })
            })
        })
    }

    /// Returns the number of state features and the number of features per plan.
    pub fn n_features(self) -> (usize, usize) {
        let (n_state, n_plan) = match self.opponent {
            OpponentInput::None => (N_STATE_FEATURES, N_PLAN_FEATURES),
            _ => (
                N_STATE_FEATURES + N_OPPONENT_STATE_FEATURES,
                N_PLAN_FEATURES + N_OPPONENT_PLAN_FEATURES,
            ),
        };
        let n_proposal = if self.has_infer_hint { N_INFER_HINT_FEATURES } else { 0 };
        let n_memory = if self.memory > 0 { N_MEMORY_PLAN_FEATURES } else { 0 };
        (n_state, n_plan + n_proposal + n_memory)
    }

    /// Creates the network architecture. Its parameters include those of the opponent model.
    pub fn network(self) -> CandidateScorer {
        let (n_state, n_plan) = self.n_features();
        let mut model = CandidateScorer::new(n_state, n_plan, WIDTH, 1);
        if self.opponent != OpponentInput::None {
            let n = network::network().network.n_parameters();
            model.network.extra_parameters(OPPONENT, n);
        }
        model
    }

    /// Returns the name in weights files.
    pub fn name(self) -> String {
        let proposals = if self.has_infer_hint { ", proposals of infer" } else { "" };
        let memory = match self.memory {
            0 => String::new(),
            n => format!(", memory of {n} decisions"),
        };
        format!("chaic plan policy 4{}{proposals}{memory}", self.opponent.kind_suffix())
    }

    /// Returns the range of the opponent model's parameters, if there is one.
    pub(crate) fn opponent_range(model: &CandidateScorer) -> Option<Range<usize>> {
        let found = model.network.parameters().iter().find(|p| p.name == OPPONENT);
        found.map(|parameter| parameter.range.clone())
    }
}

/// Network with parameter values.
#[derive(Clone, Debug)]
pub struct PolicyWeights {
    /// Inputs of the network.
    pub kind: PolicyKind,
    /// Network architecture.
    pub model: CandidateScorer,
    /// Parameters, with those of the opponent model.
    pub parameters: Vec<f32>,
    /// Opponent model whose predictions are inputs, if the network needs one.
    pub opponent: Option<Arc<OpponentModel>>,
    /// Digest of the weights file, if the parameters come from a file.
    pub digest: Option<String>,
}

impl PolicyWeights {
    /// Combines a network of this kind with parameters.
    pub fn new(kind: PolicyKind, model: &CandidateScorer, parameters: Vec<f32>) -> PolicyWeights {
        let opponent = PolicyKind::opponent_range(model).map(|range| {
            let is_granted = kind.opponent == OpponentInput::Granted;
            Arc::new(OpponentModel::new(parameters[range].to_vec(), is_granted))
        });
        PolicyWeights { kind, model: model.clone(), parameters, opponent, digest: None }
    }

    /// Parses a weights file of any kind.
    ///
    /// # Errors
    /// [`WeightsError`] if the file is incomplete or belongs to another network.
    pub fn from_bytes(bytes: &[u8]) -> Result<PolicyWeights, WeightsError> {
        let name = weights::kind(bytes)?;
        let kind = PolicyKind::all().find(|kind| kind.name() == name);
        let kind = kind.unwrap_or(PolicyKind::PLAIN);
        let model = kind.network();
        let parameters = weights::from_bytes(&model.network, bytes, &kind.name())?;
        let digest = Some(weights::digest(bytes));
        Ok(PolicyWeights { digest, ..PolicyWeights::new(kind, &model, parameters) })
    }

    /// Creates an encoder of the network's inputs.
    pub fn encoder(&self) -> FeatureEncoder {
        let PolicyKind { has_infer_hint, memory, .. } = self.kind;
        let opponent = self.opponent.clone();
        FeatureEncoder::new(OptionalInputs { opponent, has_infer_hint, memory })
    }

    /// Returns the grants of a helper with this policy: the grants of the paper's helpers, and the
    /// partner's actions if the opponent model needs them.
    pub fn grants(&self) -> Grants {
        let behavior = self.opponent.as_ref().is_some_and(|model| model.is_granted());
        Grants { behavior, ..Grants::PLANNER }
    }
}
