//! Actor-critic network for a variable number of candidates.
//!
//! Number and order of candidates differ between decisions. Each candidate is scored together with
//! the state, as in pointer networks (Vinyals et al. 2015). The candidates of a decision, a row for
//! the state and rows of earlier decisions attend to each other (Vaswani et al. 2017), so scores and
//! value depend on all rows, but not on their order.

use std::ops::Range;

use chaic_nn::simd::widest;
use chaic_nn::{Kernel, Network, NodeId, Shape, Tensor, TrainingPass};

use crate::actor_critic::{ActorCritic, ActorCriticOutput, OutputGrad, log_softmax};

/// Features of a decision between candidates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CandidateSet {
    /// Features of the state.
    pub state: Vec<f32>,
    /// Features of the candidates, shape [candidates, features].
    pub candidates: Vec<f32>,
    /// Number of candidates.
    pub n_candidates: usize,
    /// Earlier decisions, shape [decisions, state features + candidate features]: the state of each,
    /// and the candidate that was chosen. Empty for policies without memory.
    pub memory: Vec<f32>,
}

/// Network architecture without parameter values.
#[derive(Clone, Debug)]
pub struct CandidateScorer {
    /// Two hidden layers with attention in between, each for logits and state outputs, with no
    /// shared parameters.
    pub network: Network,
    logit_head: NodeId,
    value_head: NodeId,
    n_outputs: usize,
    n_state: usize,
    n_candidate: usize,
    normalizer: Normalizer,
}

/// Parameter ranges of the input normalization: means, inverse standard deviations, and the numbers
/// of states and candidates in these statistics.
#[derive(Clone, Debug)]
struct Normalizer {
    mean: Range<usize>,
    scale: Range<usize>,
    counts: Range<usize>,
}

/// Number of attention heads.
const N_HEADS: usize = 4;
/// Maximum magnitude of a normalized input.
const MAX_INPUT: f32 = 10.0;
/// Minimum standard deviation of an input.
const MIN_STD_DEV: f64 = 0.05;
/// Maximum weight of earlier inputs in the running statistics, samples. Without it, late inputs
/// would have no effect.
const MAX_COUNT: f64 = 1e6;

impl Normalizer {
    fn new(network: &mut Network, n: usize) -> Normalizer {
        let mut add = |name: &str, n| {
            network.extra_parameters(name, n);
            network.parameters().last().expect("a parameter was added").range.clone()
        };
        let mean = add("input.mean", n);
        Normalizer { mean, scale: add("input.scale", n), counts: add("input.counts", 2) }
    }

    /// Normalizes inputs in place; `first` is the index of the first input.
    fn apply(&self, parameters: &[f32], first: usize, inputs: &mut [f32]) {
        let mean = &parameters[self.mean.clone()][first..];
        let scale = &parameters[self.scale.clone()][first..];
        for ((x, mean), scale) in inputs.iter_mut().zip(mean).zip(scale) {
            *x = ((*x - mean) * scale).clamp(-MAX_INPUT, MAX_INPUT);
        }
    }

    /// Merges rows of inputs into running mean and variance (Chan et al. 1983); `first` is the
    /// index of the first input.
    fn update_running_stats<'a>(
        &self,
        parameters: &mut [f32],
        first: usize,
        group: usize,
        rows: impl Iterator<Item = &'a [f32]> + Clone,
    ) {
        let count = self.counts.start + group;
        let n_new = rows.clone().count() as f64;
        let n_old = f64::from(parameters[count]);
        let n_inputs = rows.clone().next().map_or(0, <[f32]>::len);
        for k in 0..n_inputs {
            let new = rows.clone().map(|row| f64::from(row[k]));
            let new_mean = new.clone().sum::<f64>() / n_new;
            let new_sum_squares = new.map(|x| (x - new_mean) * (x - new_mean)).sum::<f64>();
            let [mean, scale] = [&self.mean, &self.scale].map(|range| range.start + first + k);
            let old_mean = f64::from(parameters[mean]);
            let old_std_dev = 1.0 / f64::from(parameters[scale]);
            let delta = new_mean - old_mean;
            let n = n_old + n_new;
            let sum_squares = n_old * old_std_dev * old_std_dev
                + new_sum_squares
                + delta * delta * n_old * n_new / n;
            parameters[mean] = (old_mean + delta * n_new / n) as f32;
            parameters[scale] = (1.0 / (sum_squares / n).sqrt().max(MIN_STD_DEV)) as f32;
        }
        parameters[count] = (n_old + n_new).min(MAX_COUNT) as f32;
    }
}

impl CandidateScorer {
    /// Creates a network for these numbers of features, with hidden layers of this width.
    pub fn new(
        n_state: usize,
        n_candidate: usize,
        width: usize,
        n_outputs: usize,
    ) -> CandidateScorer {
        let mut network = Network::default();
        let input = network.input(n_state + n_candidate);
        let mut branch = |name: &str, n_outputs: usize| {
            let dense = |network: &mut Network, layer: &str, from: NodeId| {
                network.conv(&format!("{name}.{layer}"), from, Kernel::POINTWISE, width)
            };
            let first = dense(&mut network, "0", input);
            let first = network.norm_relu(&format!("{name}.0.norm"), first);
            let projected = ["query", "key", "value"].map(|l| dense(&mut network, l, first));
            let attended = network.attention(projected, N_HEADS);
            let attended = dense(&mut network, "attended", attended);
            let sum = network.add(first, attended);
            let sum = network.norm_relu(&format!("{name}.sum.norm"), sum);
            let second = dense(&mut network, "1", sum);
            let second = network.norm_relu(&format!("{name}.1.norm"), second);
            network.output_head(&format!("{name}.head"), second, n_outputs)
        };
        let (logit_head, value_head) = (branch("choices", 1), branch("state", n_outputs));
        let normalizer = Normalizer::new(&mut network, n_state + n_candidate);
        CandidateScorer {
            network,
            logit_head,
            value_head,
            n_outputs,
            n_state,
            n_candidate,
            normalizer,
        }
    }

    /// Updates the running statistics that normalize later inputs. Before the first update, inputs
    /// are not normalized. The last `n_raw` features of candidates are never normalized.
    pub fn update_normalizer<'a>(
        &self,
        parameters: &mut [f32],
        decisions: impl Iterator<Item = &'a CandidateSet> + Clone,
        n_raw: usize,
    ) {
        let states = decisions.clone().map(|d| &d.state[..]);
        self.normalizer.update_running_stats(parameters, 0, 0, states);
        let candidates = decisions.flat_map(|d| d.candidates.chunks_exact(self.n_candidate));
        let candidates = candidates.map(|row| &row[..self.n_candidate - n_raw]);
        self.normalizer.update_running_stats(parameters, self.n_state, 1, candidates);
    }

    /// Returns whether these parameters have statistics that normalize inputs.
    pub fn has_normalizer(&self, parameters: &[f32]) -> bool {
        parameters[self.normalizer.counts.clone()].iter().any(|count| *count > 0.0)
    }

    /// Creates the buffers of a pass.
    pub fn pass(&self) -> TrainingPass {
        TrainingPass::new(&self.network, widest())
    }

    /// Returns the number of input rows of a decision.
    fn n_rows(&self, decision: &CandidateSet) -> usize {
        1 + decision.n_candidates + decision.memory.len() / (self.n_state + self.n_candidate)
    }

    /// Returns the input rows of each decision: one row with the state alone (for the state
    /// outputs), one row per candidate, and one row per earlier decision.
    fn rows<'a>(
        &self,
        parameters: &[f32],
        decisions: impl Iterator<Item = &'a CandidateSet> + Clone,
    ) -> Tensor {
        let n = decisions.clone().map(|d| self.n_rows(d)).sum();
        let channels = self.n_state + self.n_candidate;
        let mut tensor = Tensor::zeros(Shape { n, height: 1, width: 1, channels });
        let mut rows = tensor.data.chunks_exact_mut(channels);
        for decision in decisions {
            for k in 0..=decision.n_candidates {
                let Some(row) = rows.next() else { return tensor };
                let (state, candidate) = row.split_at_mut(self.n_state);
                state.copy_from_slice(&decision.state);
                self.normalizer.apply(parameters, 0, state);
                if k > 0 {
                    let from = (k - 1) * self.n_candidate;
                    candidate.copy_from_slice(&decision.candidates[from..from + self.n_candidate]);
                    self.normalizer.apply(parameters, self.n_state, candidate);
                }
            }
            for earlier in decision.memory.chunks_exact(channels) {
                let Some(row) = rows.next() else { return tensor };
                row.copy_from_slice(earlier);
                self.normalizer.apply(parameters, 0, row);
            }
        }
        tensor
    }
}

impl ActorCritic for CandidateScorer {
    type Observation = CandidateSet;

    fn network(&self) -> &Network {
        &self.network
    }

    fn forward<'a>(
        &self,
        parameters: &[f32],
        decisions: impl Iterator<Item = &'a CandidateSet> + Clone,
        pass: &mut TrainingPass,
    ) -> Vec<ActorCriticOutput> {
        pass.set_groups(decisions.clone().map(|d| self.n_rows(d)));
        pass.forward(&self.network, parameters, &self.rows(parameters, decisions.clone()));
        let (logits, state_outputs) =
            (&pass.activation(self.logit_head).data, &pass.activation(self.value_head).data);
        let mut row = 0;
        let mut outputs = Vec::new();
        for decision in decisions {
            let logits = &logits[row + 1..][..decision.n_candidates];
            let values = state_outputs[row * self.n_outputs..][..self.n_outputs].to_vec();
            outputs.push(ActorCriticOutput { log_probs: log_softmax(logits), values });
            row += self.n_rows(decision);
        }
        outputs
    }

    fn backward(
        &self,
        parameters: &[f32],
        grad_outputs: &[OutputGrad],
        pass: &mut TrainingPass,
        grad_parameters: &mut [f32],
    ) {
        pass.zero_gradients();
        let mut row = 0;
        for (k, grad) in grad_outputs.iter().enumerate() {
            let to = &mut pass.gradient(self.value_head).data[row * self.n_outputs..];
            to[..self.n_outputs].copy_from_slice(&grad.values);
            let to = &mut pass.gradient(self.logit_head).data[row + 1..][..grad.logits.len()];
            to.copy_from_slice(&grad.logits);
            row += pass.groups()[k];
        }
        pass.backward(&self.network, parameters, grad_parameters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::geom::math;
    use chaic_core::rng::RngStream;

    fn decisions() -> Vec<CandidateSet> {
        let mut rng = RngStream::new(3, "decisions", 0);
        (1..4)
            .map(|n_candidates| CandidateSet {
                state: (0..3).map(|_| rng.unit()).collect(),
                candidates: (0..2 * n_candidates).map(|_| rng.unit()).collect(),
                n_candidates,
                memory: (0..5 * (n_candidates % 3)).map(|_| rng.unit()).collect(),
            })
            .collect()
    }

    #[test]
    fn probabilities_sum_to_one_and_samples_follow_them() {
        let model = CandidateScorer::new(3, 2, 16, 1);
        let parameters = model.network.init_parameters(1);
        for output in model.forward(&parameters, decisions().iter(), &mut model.pass()) {
            let sum: f32 = output.log_probs.iter().map(|l| math::exp(*l)).sum();
            assert!((sum - 1.0).abs() < 1e-5);
            let n = 1000;
            let fraction =
                (0..n).filter(|k| output.sample(*k as f32 / n as f32) == 0).count() as f32;
            assert!((fraction / n as f32 - math::exp(output.log_probs[0])).abs() < 2e-3);
        }
    }

    #[test]
    fn the_value_depends_on_the_features_of_all_candidates_but_not_on_their_order() {
        let model = CandidateScorer::new(3, 2, 16, 1);
        let parameters = model.network.init_parameters(1);
        let value = |decision: &CandidateSet| {
            model.forward(&parameters, std::iter::once(decision), &mut model.pass())[0].value()
        };
        let decision = decisions().remove(2);
        for k in 0..decision.candidates.len() {
            let mut changed = decision.clone();
            changed.candidates[k] += 1.0;
            let difference = (value(&changed) - value(&decision)).abs();
            assert!(difference > 1e-5, "feature {k}: {difference}");
        }
        let mut reordered = decision.clone();
        reordered.candidates.rotate_left(2);
        assert!((value(&reordered) - value(&decision)).abs() < 1e-6);
    }

    #[test]
    fn inputs_are_normalized_by_running_statistics() {
        let model = CandidateScorer::new(3, 2, 16, 1);
        let mut parameters = model.network.init_parameters(1);
        let all: Vec<CandidateSet> = decisions()
            .into_iter()
            .map(|mut d| {
                d.state.iter_mut().for_each(|x| *x = 100.0 + 7.0 * *x);
                d
            })
            .collect();
        // Two updates have the same effect as one.
        model.update_normalizer(&mut parameters, all[..1].iter(), 0);
        model.update_normalizer(&mut parameters, all[1..].iter(), 0);
        let rows = model.rows(&parameters, all.iter());
        let states: Vec<f64> = rows.data.chunks(5).map(|row| f64::from(row[0])).collect();
        // The row of the state alone and the rows of its candidates hold the same state. The
        // decisions have three, five and four rows.
        let unique: Vec<f64> = [0, 3, 8].map(|row| states[row]).to_vec();
        let mean = unique.iter().sum::<f64>() / 3.0;
        let square = unique.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 3.0;
        assert!(mean.abs() < 1e-3 && (square - 1.0).abs() < 1e-3, "{unique:?}");
        // Rows of states alone have no candidate features.
        assert_eq!(rows.data[3..5], [0.0, 0.0]);
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let model = CandidateScorer::new(3, 2, 16, 1);
        let parameters = model.network.init_parameters(1);
        let decisions = decisions();
        // Test loss: the log-probability of the first candidate plus half the squared value.
        let loss = |parameters: &[f32]| -> f64 {
            let outputs = model.forward(parameters, decisions.iter(), &mut model.pass());
            outputs.iter().map(|s| f64::from(s.log_probs[0] + 0.5 * s.value() * s.value())).sum()
        };
        let mut pass = model.pass();
        let outputs = model.forward(&parameters, decisions.iter(), &mut pass);
        let grad_outputs: Vec<OutputGrad> = outputs
            .iter()
            .map(|s| OutputGrad {
                logits: (0..s.log_probs.len())
                    .map(|k| f32::from(u8::from(k == 0)) - math::exp(s.log_probs[k]))
                    .collect(),
                values: s.values.clone(),
            })
            .collect();
        let mut gradient = vec![0.0; parameters.len()];
        model.backward(&parameters, &grad_outputs, &mut pass, &mut gradient);
        let mut rng = RngStream::new(1, "direction", 0);
        let mut direction: Vec<f32> = parameters.iter().map(|_| rng.unit() - 0.5).collect();
        // Normalization statistics are not trained.
        for range in [&model.normalizer.mean, &model.normalizer.scale, &model.normalizer.counts] {
            direction[range.clone()].fill(0.0);
        }
        let expected: f64 =
            gradient.iter().zip(&direction).map(|(g, d)| f64::from(*g) * f64::from(*d)).sum();
        let step = 2e-3;
        let shifted = |step: f32| -> Vec<f32> {
            parameters.iter().zip(&direction).map(|(x, d)| x + step * d).collect()
        };
        let slope = (loss(&shifted(step)) - loss(&shifted(-step))) / f64::from(2.0 * step);
        assert!((slope - expected).abs() < 0.05 * expected.abs(), "{slope} {expected}");
    }
}
