//! The opponent model: a network that reads a window.

use chaic_core::geom::math;
use chaic_nn::Pass;
use chaic_nn::weights::{self, WeightsError};

use super::window::{N_CLASS, N_STATE};
use super::{Goal, N_LIMITS};
use crate::actor_critic::{ActorCritic as _, Said, log_softmax};
use crate::choice_network::{ChoiceNetwork, Decision};

/// How many kinds of goals there are.
pub const N_GOALS: usize = Goal::ALL.len();

/// What files of weights say that they are.
pub const KIND: &str = "chaic opponent model 1";
/// Width of the network's layers.
const WIDTH: usize = 96;

/// The network without its numbers: choices are the classes that the partner may be after.
pub fn network() -> ChoiceNetwork {
    ChoiceNetwork::new((N_STATE, N_CLASS), WIDTH, N_GOALS + N_LIMITS)
}

/// What is believed of a partner.
#[derive(Clone, Debug, PartialEq)]
pub struct Opinion {
    /// How likely each goal is, by [`Goal::index`].
    pub goals: [f32; N_GOALS],
    /// How likely it is to be after which of the window's classes, if it is about to take something.
    pub targets: Vec<f32>,
    /// What it can't do, as [`super::limits_of`] says it.
    pub limits: [f32; N_LIMITS],
}

/// What the network says, taken apart.
pub(crate) struct Heads {
    /// The logarithm of each goal's probability.
    pub log_goals: Vec<f32>,
    /// Limits, between 0 and 1.
    pub limits: [f32; N_LIMITS],
}

impl Heads {
    pub(crate) fn of(said: &Said) -> Heads {
        let (goals, limits) = said.of_state.split_at(N_GOALS);
        let mut numbers = [0.0; N_LIMITS];
        for (number, x) in numbers.iter_mut().zip(limits) {
            *number = 1.0 / (1.0 + math::exp(-x));
        }
        Heads { log_goals: log_softmax(goals), limits: numbers }
    }
}

/// The network with its numbers.
#[derive(Clone, Debug)]
pub struct OpponentModel {
    network: ChoiceNetwork,
    numbers: Vec<f32>,
}

impl OpponentModel {
    /// The network with these numbers.
    ///
    /// # Panics
    /// If there are more or fewer than it has.
    pub fn new(numbers: Vec<f32>) -> OpponentModel {
        let network = network();
        assert_eq!(numbers.len(), network.network.n_numbers());
        OpponentModel { network, numbers }
    }

    /// The model in a file of weights.
    ///
    /// # Errors
    /// [`WeightsError`] if it isn't a whole file of such a network.
    pub fn from_bytes(bytes: &[u8]) -> Result<OpponentModel, WeightsError> {
        let numbers = weights::from_bytes(&network().network, bytes, KIND)?;
        Ok(OpponentModel::new(numbers))
    }

    /// Its numbers.
    pub fn numbers(&self) -> &[f32] {
        &self.numbers
    }

    /// Working space.
    pub fn pass(&self) -> Pass {
        self.network.pass()
    }

    /// What it believes of a partner.
    pub fn opinion(&self, window: &Decision, pass: &mut Pass) -> Opinion {
        let windows = std::iter::once(window);
        let said = self.network.forward(&self.numbers, windows, pass).remove(0);
        let Heads { log_goals, limits } = Heads::of(&said);
        let mut goals = [0.0; N_GOALS];
        goals.iter_mut().zip(log_goals).for_each(|(p, l)| *p = math::exp(l));
        let targets = said.log_probabilities.iter().map(|l| math::exp(*l)).collect();
        Opinion { goals, targets, limits }
    }
}
