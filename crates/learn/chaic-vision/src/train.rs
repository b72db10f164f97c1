//! The training loop of the detector.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use chaic_core::rng::Stream;
use chaic_nn::weights::WeightsError;
use chaic_nn::{AdamRules, Network, Pass, Shape, Tensor};
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, RATE, SEED, SHARDS, SHARE, STEPS, integer, real,
};
use chaic_training::{
    Checkpoint, CheckpointError, Figures, Learner, Training, TrainingError, figures, rate_at,
};
use serde::{Deserialize, Serialize};

use crate::detector::{Blocks, Detector};
use crate::evaluate::{calibrate, evaluate};
use crate::features::{Crop, N_FEATURES, features};
use crate::labels::BACKGROUND;
use crate::loss::{Loss, LossRules, Targets, loss};
use crate::trained::TrainedDetector;
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
    /// The network's blocks; weights of others than the usual ones are read by trainings only.
    pub blocks: Blocks,
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
            blocks: Blocks::Depthwise,
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
        rate_at(step, (self.rate, self.warm_up, self.steps))
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

/// Draws crops of fresh views; `None` if `stop` is raised meanwhile.
fn draw(
    views: &mut Views,
    rng: &mut Stream,
    rules: &TrainingRules,
    crops: &CropRules,
    stop: &AtomicBool,
) -> Option<Batch> {
    let mut batch = Batch::default();
    let side = crops.side_px;
    for _ in 0..crops.views {
        let view = views.draw_unless(stop)?;
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
    Some(batch)
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
    /// What is learned.
    pub learner: Learner,
}

impl Trainer {
    /// Before the first step.
    pub fn new(rules: TrainingRules) -> Trainer {
        let detector = Detector::of(rules.blocks);
        let learner = Learner::new(&detector.network, rules.seed, rules.shards);
        Trainer { rules, detector, learner }
    }

    /// Takes a step on fresh views; which ones depends on the seed and the step alone. Returns `None`, and takes
    /// no step, if `stop` is raised meanwhile.
    pub fn step(&mut self, stop: &AtomicBool) -> Option<Loss> {
        let step = self.learner.adam.steps;
        let Trainer { rules, detector, learner } = self;
        let (rules, detector) = (&*rules, &*detector);
        let work = |shard: usize, numbers: &[f32], pass: &mut Pass, by: &mut [f32]| {
            let index = step * rules.shards as u64 + shard as u64;
            let mut views = Views::new(Part::Training, rules.views, rules.seed, index);
            let mut rng = Stream::new(rules.seed, "crops", index);
            let crops = &rules.crops[index as usize % rules.crops.len()];
            let batch = draw(&mut views, &mut rng, rules, crops, stop)?;
            Some(gradient(detector, numbers, &batch, &rules.loss, pass, by))
        };
        let losses = learner.step(&detector.network, (&rules.adam, rules.rate_at(step)), work)?;
        Some(mean_of(&losses))
    }
}

/// Views of a validation, and those that scores are calibrated by.
const VALIDATION_VIEWS: usize = 200;
const CALIBRATION_VIEWS: usize = 400;

/// Largest number of pixels of crops that the shards work on at once. Each takes 2.1 kB, so that all take 9 GB.
const MAX_CROP_PX: usize = 1 << 22;
/// Largest number of pixels of crops of one shard. A pass over them takes 1.5 s, and can't be stopped.
const MAX_SHARD_PX: usize = 1 << 20;

const CROP_BOUNDS: BoundTable = &[
    ("views", integer(1, 256)),
    ("of_view", integer(1, 256)),
    ("side_px", integer(32, 1024)),
    ("anywhere", SHARE),
];

/// A view of more added things than this shows little else.
const VIEW_BOUNDS: BoundTable = &[
    ("size_px", integer(32, 1024)),
    ("swapped", SHARE),
    ("added", integer(0, 200)),
    ("decor", SHARE),
    ("large", SHARE),
    ("refurnished", Bound::List(&[SHARE, real(1.0, 10.0)])),
    ("wanted", SHARE),
    ("carrying", SHARE),
    ("filled", SHARE),
    ("varied", SHARE),
    ("aimed", SHARE),
    ("aimed_movable", SHARE),
    ("distance_m", Bound::List(&[real(0.3, 3.0), real(0.5, 20.0)])),
];

const LOSS_BOUNDS: BoundTable = &[
    ("even_px", real(1.0, 1e6)),
    ("power", real(0.0, 1.0)),
    ("weights", real(1e-3, 1e3)),
    ("offset", real(0.0, 100.0)),
    ("least_px", integer(1, 1 << 16)),
];

impl CropRules {
    /// Checks one set of crops of views of this size.
    fn check(&self, views: &ViewRules, shards: usize) -> Result<(), String> {
        if !self.side_px.is_multiple_of(32) || self.side_px > views.size_px as usize {
            return Err(
                "crops.side_px must be a multiple of 32, from 32 to views.size_px".to_owned()
            );
        }
        let of_shard = self.views * self.of_view * self.side_px * self.side_px;
        if of_shard > MAX_SHARD_PX || shards * of_shard > MAX_CROP_PX {
            return Err(format!(
                "crops.views times crops.of_view times the square of crops.side_px is {of_shard} pixels; it must \
                 be from 1 to {MAX_SHARD_PX}, and times shards, which is {shards}, up to {MAX_CROP_PX}"
            ));
        }
        Ok(())
    }
}

impl Training for Trainer {
    type Rules = TrainingRules;
    const KIND: &'static str = "detector";
    const WEIGHTS: &'static str = "detector.safetensors";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("steps", STEPS),
        ("rate", RATE),
        ("warm_up", STEPS),
        ("shards", SHARDS),
        ("crops", Bound::Table(CROP_BOUNDS)),
        ("views", Bound::Table(VIEW_BOUNDS)),
        ("loss", Bound::Table(LOSS_BOUNDS)),
        ("adam", ADAM),
    ];

    fn new(
        rules: &TrainingRules,
        _: &Path,
        _: &mut dyn FnMut(&str),
        _: &AtomicBool,
    ) -> Result<Option<Trainer>, TrainingError> {
        Ok(Some(Trainer::new(*rules)))
    }

    fn check(rules: &TrainingRules) -> Result<(), String> {
        let TrainingRules { views, loss, shards, .. } = rules;
        if !views.size_px.is_multiple_of(32) {
            return Err("views.size_px must be a multiple of 32, from 32 to 1024".to_owned());
        }
        let [near_m, far_m] = views.distance_m;
        if far_m < 1.5 * near_m {
            return Err("views.distance_m must be from near to far, the second at least 1.5 times the first"
                .to_owned());
        }
        if loss.weights[0] > loss.weights[1] {
            return Err("loss.weights must be from least to most".to_owned());
        }
        rules.crops.iter().try_for_each(|crops| crops.check(views, *shards))
    }

    fn read_weights(rules: &TrainingRules, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        Ok(TrainedDetector::of_bytes(Detector::of(rules.blocks), weights)?.numbers)
    }

    fn network(&self) -> &Network {
        &self.detector.network
    }

    fn steps(&self) -> u64 {
        self.rules.steps
    }

    fn taken(&self) -> u64 {
        self.learner.adam.steps
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn begin_with(&mut self, numbers: Vec<f32>) {
        self.learner.begin_with(numbers);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.learner.load(checkpoint).map(Some)
    }

    fn step(&mut self, stop: &AtomicBool) -> Option<Figures> {
        let Loss { labels, offsets, right, right_of_things } = Trainer::step(self, stop)?;
        Some(figures([
            ("labels", labels),
            ("offsets", offsets),
            ("right", right),
            ("right_of_things", right_of_things),
        ]))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError> {
        let average = &self.learner.average;
        let mut detector = TrainedDetector::uncalibrated(&self.detector, average);
        let (views, threads) = (self.rules.views, self.rules.shards);
        let found = evaluate(&detector, views, VALIDATION_VIEWS, threads, stop);
        let natural = ViewRules { size_px: views.size_px, ..ViewRules::NATURAL };
        let Some(found) = found else { return Ok(None) };
        let calibration = calibrate(&detector, natural, CALIBRATION_VIEWS, threads, stop);
        let Some(calibration) = calibration else { return Ok(None) };
        detector.calibration = calibration;
        let figures = figures([("map50", found.map50), ("map", found.map)]);
        Ok(Some((figures, detector.to_bytes()?)))
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
