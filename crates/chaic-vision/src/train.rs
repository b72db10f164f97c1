//! The training loop of the detector.

use std::thread;

use chaic_nn::simd::widest;
use chaic_nn::{Adam, AdamRules, Network, Pass, Shape, Tensor};
use chaic_protocol::rng::Stream;
use serde::{Deserialize, Serialize};

use crate::detector::Detector;
use crate::features::{Crop, N_FEATURES, features};
use crate::labels::BACKGROUND;
use crate::loss::{Loss, LossRules, Targets, loss};
use crate::views::{LabelledView, Part, ViewRules, Views};

/// Which parts of views are learned from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CropRules {
    /// Views of a batch.
    pub views: usize,
    /// Crops of each of them.
    pub of_view: usize,
    /// Their side, pixels.
    pub side_px: usize,
    /// Share of crops anywhere; the others are around a thing, one of each class that shows equally
    /// often.
    pub anywhere: f32,
}

/// What is trained on, and how.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainingRules {
    /// Of weights and views.
    pub seed: u64,
    /// Steps in all, which the rate is planned by.
    pub steps: u64,
    /// Highest rate of steps; it rises for a while, then falls to a hundredth along a parabola.
    pub rate: f32,
    /// Steps during which it rises.
    pub warm_up: u64,
    /// Parts of a batch that are worked on side by side; their gradients are added in order.
    pub shards: usize,
    /// Crops of each part: parts take turns.
    pub crops: [CropRules; 2],
    /// How views are drawn.
    pub views: ViewRules,
    /// What counts.
    pub loss: LossRules,
    /// How steps are taken.
    pub adam: AdamRules,
}

impl Default for TrainingRules {
    fn default() -> TrainingRules {
        TrainingRules::shipped(30_000)
    }
}

impl TrainingRules {
    /// What the shipped detector is trained with, for so many steps.
    pub fn shipped(steps: u64) -> TrainingRules {
        TrainingRules {
            seed: 1,
            steps,
            rate: 2e-3,
            warm_up: 200,
            shards: 2,
            crops: [
                CropRules { views: 4, of_view: 1, side_px: 256, anywhere: 0.4 },
                CropRules { views: 4, of_view: 4, side_px: 128, anywhere: 0.3 },
            ],
            views: ViewRules::TRAINING,
            loss: LossRules::TRAINING,
            adam: AdamRules::default(),
        }
    }

    /// The rate of a step.
    pub fn rate_at(&self, step: u64) -> f32 {
        let rise = ((step + 1) as f32 / self.warm_up as f32).min(1.0);
        let left = 1.0 - (step as f32 / self.steps as f32).min(1.0);
        self.rate * rise * (0.01 + 0.99 * left * left)
    }
}

/// A batch, or a part of one.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// What the network reads.
    pub input: Tensor,
    /// What it is to say.
    pub targets: Targets,
}

impl Batch {
    /// Adds a part of an image.
    pub fn add(&mut self, view: &LabelledView, crop: Crop, rules: &LossRules) {
        let [width, height] = crop.size;
        let before = self.input.data.len();
        self.input.data.resize(before + width * height * N_FEATURES, 0.0);
        let data = &mut self.input.data[before..];
        features(&view.rgb, &view.depth_m, &view.camera, crop, data);
        let n = self.input.shape.n + 1;
        self.input.shape = Shape { n, height, width, channels: N_FEATURES };
        self.targets.add(view, crop, rules);
    }
}

/// Crops of fresh views.
fn draw(views: &mut Views, rng: &mut Stream, rules: &TrainingRules, crops: &CropRules) -> Batch {
    let mut batch = Batch::default();
    let side = crops.side_px;
    for _ in 0..crops.views {
        let view = views.draw();
        let size = view.camera.width as usize;
        for k in 0..crops.of_view {
            let aimed = view.aimed_at.filter(|_| k == 0).map(|e| e.0);
            let around = if rng.chance(crops.anywhere) {
                None
            } else {
                aimed.or_else(|| shown(&view, &rules.loss, rng))
            };
            let middle = around.and_then(|id| {
                let of_it: Vec<usize> =
                    (0..view.ids.len()).filter(|k| view.ids[*k] == id).collect();
                rng.choose(&of_it).copied()
            });
            let mut place = |middle: Option<usize>| {
                let first = match middle {
                    Some(at) => (at + rng.below(side / 2)).saturating_sub(side * 3 / 4),
                    None => rng.below(size - side + 1),
                };
                // As the network's strides lie on whole images.
                first.min(size - side) / 32 * 32
            };
            let at = [place(middle.map(|k| k % size)), place(middle.map(|k| k / size))];
            batch.add(&view, Crop { at, size: [side, side] }, &rules.loss);
        }
    }
    batch
}

/// Something that shows, each class equally often.
fn shown(view: &LabelledView, rules: &LossRules, rng: &mut Stream) -> Option<u16> {
    let mut n_pixels = vec![0u32; view.labels.len()];
    for id in &view.ids {
        if let Some(n) = n_pixels.get_mut(usize::from(*id)) {
            *n += 1;
        }
    }
    let mut seen: Vec<(u8, u16)> = (0..n_pixels.len())
        .filter(|id| view.labels[*id] != BACKGROUND && n_pixels[*id] >= rules.least_px)
        .map(|id| (view.labels[id], id as u16))
        .collect();
    seen.sort_unstable();
    let mut labels: Vec<u8> = seen.iter().map(|(label, _)| *label).collect();
    labels.dedup();
    let label = *rng.choose(&labels)?;
    let of_it: Vec<u16> = seen.into_iter().filter(|(l, _)| *l == label).map(|(_, id)| id).collect();
    rng.choose(&of_it).copied()
}

/// A detector while it learns.
pub struct Trainer {
    /// Its rules.
    pub rules: TrainingRules,
    /// The network.
    pub detector: Detector,
    /// Its numbers.
    pub numbers: Vec<f32>,
    /// A slow mean of them, which is what is shipped.
    pub average: Vec<f32>,
    /// How steps are taken.
    pub adam: Adam,
    passes: Vec<(Pass, Vec<f32>)>,
}

/// Share of a step's numbers in the slow mean.
const AVERAGE_RATE: f32 = 0.002;

impl Trainer {
    /// Before the first step.
    pub fn new(rules: TrainingRules) -> Trainer {
        let detector = Detector::new();
        let numbers = detector.network.begin(rules.seed);
        let adam = Adam::new(numbers.len());
        let pass = || (Pass::new(&detector.network, widest()), vec![0.0; numbers.len()]);
        let passes = (0..rules.shards).map(|_| pass()).collect();
        Trainer { rules, average: numbers.clone(), numbers, adam, passes, detector }
    }

    /// All that is needed to go on, as bytes.
    pub fn checkpoint(&self) -> Vec<u8> {
        let lists = [&self.numbers, &self.average, &self.adam.mean, &self.adam.square];
        let mut bytes = self.adam.steps.to_le_bytes().to_vec();
        for x in lists.into_iter().flatten() {
            bytes.extend_from_slice(&x.to_le_bytes());
        }
        bytes
    }

    /// Goes on from a checkpoint; `false` if it is of another network.
    pub fn resume(&mut self, bytes: &[u8]) -> bool {
        let n = self.numbers.len();
        let Some((steps, rest)) = bytes.split_first_chunk::<8>() else { return false };
        let numbers: Vec<f32> =
            rest.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        if rest.len() != 16 * n {
            return false;
        }
        let list = |k: usize| numbers[k * n..][..n].to_vec();
        (self.numbers, self.average) = (list(0), list(1));
        let steps = u64::from_le_bytes(*steps);
        self.adam = Adam::resumed(&self.rules.adam, steps, list(2), list(3));
        true
    }

    /// Takes a step on fresh views; which ones depends on the seed and the step alone.
    pub fn step(&mut self) -> Loss {
        let step = self.adam.steps;
        let Trainer { rules, detector, numbers, passes, .. } = self;
        let (rules, numbers, detector) = (&*rules, &*numbers, &*detector);
        let work = |shard: usize, pass: &mut Pass, by: &mut [f32]| {
            let index = step * rules.shards as u64 + shard as u64;
            let mut views = Views::new(Part::Training, rules.views, rules.seed, index);
            let mut rng = Stream::new(rules.seed, "crops", index);
            let crops = &rules.crops[index as usize % rules.crops.len()];
            let batch = draw(&mut views, &mut rng, rules, crops);
            by.fill(0.0);
            gradient(detector, numbers, &batch, &rules.loss, pass, by)
        };
        let losses: Vec<Loss> = thread::scope(|scope| {
            let workers: Vec<_> = passes
                .iter_mut()
                .enumerate()
                .map(|(shard, (pass, by))| scope.spawn(move || work(shard, pass, by)))
                .collect();
            workers.into_iter().map(|w| w.join().expect("it doesn't panic")).collect()
        });
        let part = 1.0 / rules.shards as f32;
        let (first, rest) = self.passes.split_first_mut().expect("there are shards");
        for (_, by) in rest {
            first.1.iter_mut().zip(by.iter()).for_each(|(sum, g)| *sum += g);
        }
        first.1.iter_mut().for_each(|g| *g *= part);
        let rate = self.rules.rate_at(step);
        let network = &self.detector.network;
        self.adam.step(&self.rules.adam, rate, network, &mut self.numbers, &first.1);
        // Of the last eighth of the steps, or the mean would keep what the network began with.
        let share = AVERAGE_RATE.max(8.0 / (self.adam.steps as f32 + 8.0));
        for (mean, x) in self.average.iter_mut().zip(&self.numbers) {
            *mean += share * (x - *mean);
        }
        mean_of(&losses)
    }
}

fn mean_of(losses: &[Loss]) -> Loss {
    let mean = |of: fn(&Loss) -> f64| losses.iter().map(of).sum::<f64>() / losses.len() as f64;
    Loss {
        labels: mean(|l| l.labels),
        offsets: mean(|l| l.offsets),
        right: mean(|l| l.right),
        right_of_things: mean(|l| l.right_of_things),
    }
}

/// The loss of a batch; its gradient is added to `by`.
fn gradient(
    detector: &Detector,
    numbers: &[f32],
    batch: &Batch,
    rules: &LossRules,
    pass: &mut Pass,
    by: &mut [f32],
) -> Loss {
    let network: &Network = &detector.network;
    pass.forward(network, numbers, &batch.input);
    pass.begin_backward();
    let mut by_head = std::mem::take(pass.gradient(detector.head));
    let loss = loss(pass.made(detector.head), &batch.targets, rules, &mut by_head);
    *pass.gradient(detector.head) = by_head;
    pass.backward(network, numbers, by);
    loss
}
