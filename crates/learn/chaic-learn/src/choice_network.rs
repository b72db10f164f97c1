//! The network: a logit for each of the choices that there are, and numbers of the state, like its value.
//!
//! The number of choices differs from decision to decision, and their order means nothing, so each is read by
//! itself, beside the state (as in pointer networks, Vinyals et al. 2015).

use std::ops::Range;

use chaic_nn::simd::widest;
use chaic_nn::{Kernel, Network, Node, Pass, Shape, Tensor};

use crate::actor_critic::{ActorCritic, BySaid, Said, log_softmax};

/// What is known when a choice is made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decision {
    /// Numbers of the state.
    pub state: Vec<f32>,
    /// Numbers of the choices, one after the other, as many of each.
    pub choices: Vec<f32>,
    /// How many choices there are.
    pub n_choices: usize,
}

/// A network without its numbers.
#[derive(Clone, Debug)]
pub struct ChoiceNetwork {
    /// Its layers: two of the same width for logits, and two for what it says of the state, which share nothing.
    pub network: Network,
    logit: Node,
    of_state: Node,
    n_outputs: usize,
    n_state: usize,
    n_choice: usize,
    normalizer: Normalizer,
}

/// Where the numbers are by which inputs are normalized: what is taken off each, what it is then multiplied by, and
/// how many states and choices that comes from.
#[derive(Clone, Debug)]
struct Normalizer {
    mean: Range<usize>,
    scale: Range<usize>,
    counts: Range<usize>,
}

/// Normalized inputs are no larger.
const LARGEST_INPUT: f32 = 10.0;
/// The spread of an input counts as no smaller.
const LEAST_SPREAD: f64 = 0.05;
/// Older inputs count no more than so many of them, or what is new would change nothing any more.
const MOST_COUNTED: f64 = 1e6;

impl Normalizer {
    fn new(network: &mut Network, n: usize) -> Normalizer {
        let mut aside = |name: &str, n| {
            network.aside(name, n);
            network.parameters().last().expect("one was added").range.clone()
        };
        let mean = aside("input.mean", n);
        Normalizer { mean, scale: aside("input.scale", n), counts: aside("input.counts", 2) }
    }

    /// Normalizes inputs from the `first` on.
    fn apply(&self, numbers: &[f32], first: usize, inputs: &mut [f32]) {
        let mean = &numbers[self.mean.clone()][first..];
        let scale = &numbers[self.scale.clone()][first..];
        for ((x, mean), scale) in inputs.iter_mut().zip(mean).zip(scale) {
            *x = ((*x - mean) * scale).clamp(-LARGEST_INPUT, LARGEST_INPUT);
        }
    }

    /// Takes rows of inputs from the `first` on into their mean and spread (Chan et al. 1983).
    fn take_in<'a>(
        &self,
        numbers: &mut [f32],
        (first, which): (usize, usize),
        rows: impl Iterator<Item = &'a [f32]> + Clone,
    ) {
        let counted = self.counts.start + which;
        let n_new = rows.clone().count() as f64;
        let n_old = f64::from(numbers[counted]);
        let n_inputs = rows.clone().next().map_or(0, <[f32]>::len);
        for k in 0..n_inputs {
            let new = rows.clone().map(|row| f64::from(row[k]));
            let new_mean = new.clone().sum::<f64>() / n_new;
            let new_square = new.map(|x| (x - new_mean) * (x - new_mean)).sum::<f64>();
            let [mean, scale] = [&self.mean, &self.scale].map(|range| range.start + first + k);
            let old_mean = f64::from(numbers[mean]);
            let old_spread = 1.0 / f64::from(numbers[scale]);
            let change = new_mean - old_mean;
            let n = n_old + n_new;
            let square =
                n_old * old_spread * old_spread + new_square + change * change * n_old * n_new / n;
            numbers[mean] = (old_mean + change * n_new / n) as f32;
            numbers[scale] = (1.0 / (square / n).sqrt().max(LEAST_SPREAD)) as f32;
        }
        numbers[counted] = (n_old + n_new).min(MOST_COUNTED) as f32;
    }
}

impl ChoiceNetwork {
    /// One for so many numbers of a state and of each choice, with layers of this width, that says so many numbers of
    /// the state.
    pub fn new(
        (n_state, n_choice): (usize, usize),
        width: usize,
        n_outputs: usize,
    ) -> ChoiceNetwork {
        let mut network = Network::default();
        let input = network.input(n_state + n_choice);
        let mut trunk = |name: &str, n_outputs: usize| {
            let mut at = input;
            for layer in 0..2 {
                let name = format!("{name}{layer}");
                at = network.conv(&name, at, Kernel::POINTWISE, width);
                at = network.norm_relu(&format!("{name}.norm"), at);
            }
            network.head(&format!("{name}.head"), at, n_outputs)
        };
        let (logit, of_state) = (trunk("choices", 1), trunk("state", n_outputs));
        let normalizer = Normalizer::new(&mut network, n_state + n_choice);
        ChoiceNetwork { network, logit, of_state, n_outputs, n_state, n_choice, normalizer }
    }

    /// Takes decisions into the mean and the spread by which the inputs of those to come are normalized: until then
    /// they are read as they are.
    pub fn normalize_by<'a>(
        &self,
        numbers: &mut [f32],
        decisions: impl Iterator<Item = &'a Decision> + Clone,
    ) {
        let states = decisions.clone().map(|d| &d.state[..]);
        self.normalizer.take_in(numbers, (0, 0), states);
        let choices = decisions.flat_map(|d| d.choices.chunks_exact(self.n_choice));
        self.normalizer.take_in(numbers, (self.n_state, 1), choices);
    }

    /// Working space.
    pub fn pass(&self) -> Pass {
        Pass::new(&self.network, widest())
    }

    /// Rows to read: for each decision one of the state alone, whose value counts, and one for each choice.
    fn rows<'a>(
        &self,
        numbers: &[f32],
        decisions: impl Iterator<Item = &'a Decision> + Clone,
    ) -> Tensor {
        let n = decisions.clone().map(|d| d.n_choices + 1).sum();
        let channels = self.n_state + self.n_choice;
        let mut tensor = Tensor::zeros(Shape { n, height: 1, width: 1, channels });
        let mut rows = tensor.data.chunks_exact_mut(channels);
        for decision in decisions {
            for k in 0..=decision.n_choices {
                let Some(row) = rows.next() else { return tensor };
                let (state, choice) = row.split_at_mut(self.n_state);
                state.copy_from_slice(&decision.state);
                self.normalizer.apply(numbers, 0, state);
                if k > 0 {
                    let from = (k - 1) * self.n_choice;
                    choice.copy_from_slice(&decision.choices[from..from + self.n_choice]);
                    self.normalizer.apply(numbers, self.n_state, choice);
                }
            }
        }
        tensor
    }
}

impl ActorCritic for ChoiceNetwork {
    type Seen = Decision;

    fn network(&self) -> &Network {
        &self.network
    }

    fn forward<'a>(
        &self,
        numbers: &[f32],
        decisions: impl Iterator<Item = &'a Decision> + Clone,
        pass: &mut Pass,
    ) -> Vec<Said> {
        pass.forward(&self.network, numbers, &self.rows(numbers, decisions.clone()));
        let (logits, outputs) = (&pass.made(self.logit).data, &pass.made(self.of_state).data);
        let mut row = 0;
        let mut said = Vec::new();
        for decision in decisions {
            let logits = &logits[row + 1..][..decision.n_choices];
            let of_state = outputs[row * self.n_outputs..][..self.n_outputs].to_vec();
            said.push(Said { log_probabilities: log_softmax(logits), of_state });
            row += decision.n_choices + 1;
        }
        said
    }

    fn backward(&self, numbers: &[f32], by: &[BySaid], pass: &mut Pass, by_numbers: &mut [f32]) {
        pass.begin_backward();
        let mut row = 0;
        for by in by {
            let to = &mut pass.gradient(self.of_state).data[row * self.n_outputs..];
            to[..self.n_outputs].copy_from_slice(&by.of_state);
            let to = &mut pass.gradient(self.logit).data[row + 1..][..by.logits.len()];
            to.copy_from_slice(&by.logits);
            row += by.logits.len() + 1;
        }
        pass.backward(&self.network, numbers, by_numbers);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_core::geom::math;
    use chaic_core::rng::Stream;

    fn decisions() -> Vec<Decision> {
        let mut rng = Stream::new(3, "decisions", 0);
        (1..4)
            .map(|n_choices| Decision {
                state: (0..3).map(|_| rng.unit()).collect(),
                choices: (0..2 * n_choices).map(|_| rng.unit()).collect(),
                n_choices,
            })
            .collect()
    }

    #[test]
    fn probabilities_of_all_choices_sum_to_one_and_are_sampled_as_such() {
        let model = ChoiceNetwork::new((3, 2), 16, 1);
        let numbers = model.network.begin(1);
        for said in model.forward(&numbers, decisions().iter(), &mut model.pass()) {
            let sum: f32 = said.log_probabilities.iter().map(|l| math::exp(*l)).sum();
            assert!((sum - 1.0).abs() < 1e-5);
            let n = 1000;
            let share = (0..n).filter(|k| said.sample(*k as f32 / n as f32) == 0).count() as f32;
            assert!((share / n as f32 - math::exp(said.log_probabilities[0])).abs() < 2e-3);
        }
    }

    #[test]
    fn inputs_are_normalized_by_all_that_was_taken_in() {
        let model = ChoiceNetwork::new((3, 2), 16, 1);
        let mut numbers = model.network.begin(1);
        let all: Vec<Decision> = decisions()
            .into_iter()
            .map(|mut d| {
                d.state.iter_mut().for_each(|x| *x = 100.0 + 7.0 * *x);
                d
            })
            .collect();
        // In two parts, which is no different from one.
        model.normalize_by(&mut numbers, all[..1].iter());
        model.normalize_by(&mut numbers, all[1..].iter());
        let rows = model.rows(&numbers, all.iter());
        let states: Vec<f64> = rows.data.chunks(5).map(|row| f64::from(row[0])).collect();
        // One row of the state alone, and one for each choice, say the same.
        let of_state: Vec<f64> = [0, 2, 5].map(|row| states[row]).to_vec();
        let mean = of_state.iter().sum::<f64>() / 3.0;
        let square = of_state.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 3.0;
        assert!(mean.abs() < 1e-3 && (square - 1.0).abs() < 1e-3, "{of_state:?}");
        // The rows of states alone have no choice.
        assert_eq!(rows.data[3..5], [0.0, 0.0]);
    }

    #[test]
    fn the_gradient_is_that_of_the_numbers() {
        let model = ChoiceNetwork::new((3, 2), 16, 1);
        let numbers = model.network.begin(1);
        let decisions = decisions();
        // Some loss: the log probability of each first choice, and half the square of the value.
        let loss = |numbers: &[f32]| -> f64 {
            let said = model.forward(numbers, decisions.iter(), &mut model.pass());
            said.iter()
                .map(|s| f64::from(s.log_probabilities[0] + 0.5 * s.value() * s.value()))
                .sum()
        };
        let mut pass = model.pass();
        let said = model.forward(&numbers, decisions.iter(), &mut pass);
        let by: Vec<BySaid> = said
            .iter()
            .map(|s| BySaid {
                logits: (0..s.log_probabilities.len())
                    .map(|k| f32::from(u8::from(k == 0)) - math::exp(s.log_probabilities[k]))
                    .collect(),
                of_state: s.of_state.clone(),
            })
            .collect();
        let mut gradient = vec![0.0; numbers.len()];
        model.backward(&numbers, &by, &mut pass, &mut gradient);
        let mut rng = Stream::new(1, "direction", 0);
        let mut direction: Vec<f32> = numbers.iter().map(|_| rng.unit() - 0.5).collect();
        // What inputs are normalized by is no part of what is learned.
        for aside in [&model.normalizer.mean, &model.normalizer.scale, &model.normalizer.counts] {
            direction[aside.clone()].fill(0.0);
        }
        let along: f64 =
            gradient.iter().zip(&direction).map(|(g, d)| f64::from(*g) * f64::from(*d)).sum();
        let step = 2e-3;
        let moved = |by: f32| -> Vec<f32> {
            numbers.iter().zip(&direction).map(|(x, d)| x + by * d).collect()
        };
        let slope = (loss(&moved(step)) - loss(&moved(-step))) / f64::from(2.0 * step);
        assert!((slope - along).abs() < 0.05 * along.abs(), "{slope} {along}");
    }
}
