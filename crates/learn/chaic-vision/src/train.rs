//! The training loop of the detector: first stage, then second stage.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

use chaic_core::rng::RngStream;
use chaic_nn::simd::widest;
use chaic_nn::weights::WeightsError;
use chaic_nn::{AdamWConfig, Inference, Network, Shape, Tensor, TrainingPass};
use chaic_training::bounds::{
    ADAM, Bound, BoundTable, FRACTION, LEARNING_RATE, MAX_STEPS, SEED, SHARDS, STEPS, integer, real,
};
use chaic_training::{
    Checkpoint, CheckpointError, Learner, Metrics, Trainer, TrainingError, defined_metrics,
    learning_rate_at, metrics,
};
use serde::{Deserialize, Serialize};

use crate::detector::{BlockType, Detector};
use crate::evaluate::{calibrate, evaluate};
use crate::features::{ImageCrop, N_FEATURES, features};
use crate::labels::BACKGROUND;
use crate::loss::{CropTargets, Loss, LossConfig, loss};
use crate::roi_loss::RoiLoss;
use crate::roi_network::RoiNetwork;
use crate::roi_train::{ROI_BOUNDS, RoiBatch, RoiTrainingConfig, mean_roi_loss};
use crate::second_stage::SecondStage;
use crate::trained::{SECOND_STAGE, TrainedDetector, both_stages};
use crate::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};

/// Crops of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CropConfig {
    /// Number of views.
    pub views: usize,
    /// Crops per view.
    #[serde(alias = "of_view")]
    pub crops_per_view: usize,
    /// Side of a crop, pixels.
    pub side_px: usize,
    /// Fraction of crops at uniformly random positions. The others are centered on an object whose
    /// class is drawn uniformly from the visible classes.
    #[serde(alias = "anywhere")]
    pub uniform_crop_fraction: f32,
}

/// Configuration of a detector training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectorTrainingConfig {
    /// Seed of weights and views.
    pub seed: u64,
    /// Number of steps of the first stage; its learning rate schedule ends there.
    pub steps: u64,
    /// Maximum learning rate. The rate rises linearly, then falls along a parabola to a hundredth.
    #[serde(alias = "rate")]
    pub learning_rate: f32,
    /// Steps of linear warm-up.
    pub warm_up: u64,
    /// Parts of a batch that are processed in parallel. Their gradients are added in a fixed order.
    pub shards: usize,
    /// Blocks of the encoder. Only training can read weights with other than the default blocks.
    pub blocks: BlockType,
    /// Crops of the shards, which alternate between the two.
    pub crops: [CropConfig; 2],
    /// Distribution of views.
    pub views: ViewConfig,
    /// Number of validation views on which a validation measures the precision.
    pub validation_views: usize,
    /// Number of training views on which a validation calibrates scores; they are distributed like
    /// the views of a helper.
    pub calibration_views: usize,
    /// Weights of the loss.
    pub loss: LossConfig,
    /// Training of the second stage.
    pub second_stage: RoiTrainingConfig,
    /// Configuration of the optimizer.
    pub adam: AdamWConfig,
}

impl Default for DetectorTrainingConfig {
    fn default() -> DetectorTrainingConfig {
        DetectorTrainingConfig::bundled(30_000)
    }
}

impl DetectorTrainingConfig {
    /// Returns the configuration of the bundled detector with this number of steps.
    pub fn bundled(steps: u64) -> DetectorTrainingConfig {
        DetectorTrainingConfig {
            seed: 1,
            steps,
            learning_rate: 2e-3,
            warm_up: 200,
            shards: 2,
            blocks: BlockType::Depthwise,
            crops: [
                CropConfig {
                    views: 4,
                    crops_per_view: 1,
                    side_px: 256,
                    uniform_crop_fraction: 0.4,
                },
                CropConfig {
                    views: 4,
                    crops_per_view: 4,
                    side_px: 128,
                    uniform_crop_fraction: 0.3,
                },
            ],
            views: ViewConfig::TRAINING,
            validation_views: 200,
            calibration_views: 400,
            loss: LossConfig::TRAINING,
            second_stage: RoiTrainingConfig::default(),
            adam: AdamWConfig::default(),
        }
    }

    /// Returns the learning rate of a step.
    pub fn rate_at(&self, step: u64) -> f32 {
        learning_rate_at(step, self.learning_rate, self.warm_up, self.steps)
    }
}

/// Batch or shard of a batch.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Input of the network.
    pub input: Tensor,
    /// Targets of the network.
    pub targets: CropTargets,
}

impl Batch {
    /// Appends a crop of a view.
    pub fn add(&mut self, view: &LabeledView, crop: ImageCrop, config: &LossConfig) {
        let [width, height] = crop.size;
        let before = self.input.data.len();
        self.input.data.resize(before + width * height * N_FEATURES, 0.0);
        let data = &mut self.input.data[before..];
        features(&view.rgb, &view.depth_m, &view.camera, crop, data);
        let n = self.input.shape.n + 1;
        self.input.shape = Shape { n, height, width, channels: N_FEATURES };
        self.targets.add(view, crop, config);
    }
}

/// Draws crops of new views; returns `None` if `stop` is set meanwhile.
fn draw_batch(
    views: &mut SyntheticViews,
    rng: &mut RngStream,
    config: &DetectorTrainingConfig,
    crops: &CropConfig,
    stop: &AtomicBool,
) -> Option<Batch> {
    let mut batch = Batch::default();
    let side = crops.side_px;
    for _ in 0..crops.views {
        let view = views.draw_unless_stopped(stop)?;
        let size = view.camera.width as usize;
        for k in 0..crops.crops_per_view {
            let aimed_object = view.aimed_at.filter(|_| k == 0).map(|e| e.0);
            let object = if rng.chance(crops.uniform_crop_fraction) {
                None
            } else {
                aimed_object.or_else(|| random_visible_object(&view, &config.loss, rng))
            };
            let center = object.and_then(|id| {
                let pixels: Vec<usize> =
                    (0..view.ids.len()).filter(|k| view.ids[*k] == id).collect();
                rng.choose(&pixels).copied()
            });
            let mut crop_start = |center: Option<usize>| {
                /// Crops are aligned to the network's strides, as whole images are.
                const STRIDE: usize = 32;
                let first = match center {
                    Some(at) => (at + rng.below(side / 2)).saturating_sub(side * 3 / 4),
                    None => rng.below(size - side + 1),
                };
                let aligned = first.min(size - side) / STRIDE * STRIDE;
                // Without this shift, a small crop could end before the pixel.
                center.map_or(aligned, |at| {
                    aligned.max((at + 1).saturating_sub(side).next_multiple_of(STRIDE))
                })
            };
            let origin =
                [crop_start(center.map(|k| k % size)), crop_start(center.map(|k| k / size))];
            batch.add(&view, ImageCrop { origin, size: [side, side] }, &config.loss);
        }
    }
    Some(batch)
}

/// Draws a visible object, uniformly over the visible classes.
fn random_visible_object(
    view: &LabeledView,
    config: &LossConfig,
    rng: &mut RngStream,
) -> Option<u16> {
    let mut n_pixels = vec![0u32; view.labels.len()];
    for id in &view.ids {
        if let Some(n) = n_pixels.get_mut(usize::from(*id)) {
            *n += 1;
        }
    }
    let mut visible: Vec<(u8, u16)> = (0..n_pixels.len())
        .filter(|id| view.labels[*id] != BACKGROUND && n_pixels[*id] >= config.min_px)
        .map(|id| (view.labels[id], id as u16))
        .collect();
    visible.sort_unstable();
    let mut labels: Vec<u8> = visible.iter().map(|(label, _)| *label).collect();
    labels.dedup();
    let label = *rng.choose(&labels)?;
    let ids: Vec<u16> =
        visible.into_iter().filter(|(l, _)| *l == label).map(|(_, id)| id).collect();
    rng.choose(&ids).copied()
}

/// State of a detector training.
pub struct DetectorLearner {
    /// Its configuration.
    pub config: DetectorTrainingConfig,
    /// Network of the first stage.
    pub detector: Detector,
    /// Parameters and optimizer of the first stage.
    pub learner: Learner,
    /// Network of the second stage.
    pub roi_network: RoiNetwork,
    /// Parameters and optimizer of the second stage.
    pub roi_learner: Learner,
    /// Parameters of both stages.
    layout: Network,
    /// The trained first stage, for each shard of the second.
    first_stages: Vec<Mutex<Inference>>,
}

/// Metrics of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DetectorLoss {
    /// Step of the first stage.
    FirstStage(Loss),
    /// Step of the second stage.
    SecondStage(RoiLoss),
}

impl DetectorLearner {
    /// Creates the state before the first step.
    pub fn new(config: DetectorTrainingConfig) -> DetectorLearner {
        let detector = Detector::with_blocks(config.blocks);
        let roi_network = RoiNetwork::new();
        DetectorLearner {
            learner: Learner::new(&detector.network, config.seed, config.shards),
            roi_learner: Learner::new(&roi_network.network, config.seed, config.shards),
            layout: both_stages(&detector, &roi_network),
            first_stages: Vec::new(),
            config,
            detector,
            roi_network,
        }
    }

    /// Trains on new views, which depend on the seed and the step only. Returns `None`, without a
    /// step, if `stop` is set meanwhile.
    pub fn step(&mut self, stop: &AtomicBool) -> Option<DetectorLoss> {
        if self.learner.adam.steps < self.config.steps {
            self.first_stage_step(stop).map(DetectorLoss::FirstStage)
        } else {
            self.second_stage_step(stop).map(DetectorLoss::SecondStage)
        }
    }

    fn first_stage_step(&mut self, stop: &AtomicBool) -> Option<Loss> {
        let step = self.learner.adam.steps;
        let DetectorLearner { config, detector, learner, .. } = self;
        let (config, detector) = (&*config, &*detector);
        let shard_gradient = |shard: usize,
                              parameters: &[f32],
                              pass: &mut TrainingPass,
                              grad_parameters: &mut [f32]| {
            let index = step * config.shards as u64 + shard as u64;
            let mut views =
                SyntheticViews::new(DatasetSplit::Train, config.views, config.seed, index);
            let mut rng = RngStream::new(config.seed, "crops", index);
            let crops = &config.crops[index as usize % config.crops.len()];
            let batch = draw_batch(&mut views, &mut rng, config, crops, stop)?;
            Some(gradient(detector, parameters, &batch, &config.loss, pass, grad_parameters))
        };
        let losses =
            learner.step(&detector.network, &config.adam, config.rate_at(step), shard_gradient)?;
        Some(mean_loss(&losses))
    }

    fn second_stage_step(&mut self, stop: &AtomicBool) -> Option<RoiLoss> {
        let step = self.roi_learner.adam.steps;
        let DetectorLearner { config, detector, learner, roi_network, roi_learner, .. } = self;
        if self.first_stages.is_empty() {
            let first_stage = Inference::new(&detector.network, &learner.ema_parameters, widest());
            self.first_stages =
                (0..config.shards).map(|_| Mutex::new(first_stage.clone())).collect();
        }
        let (config, network, first_stages) = (&*config, &*roi_network, &self.first_stages);
        let roi = &config.second_stage;
        let shard_gradient = |shard: usize,
                              parameters: &[f32],
                              pass: &mut TrainingPass,
                              grad_parameters: &mut [f32]| {
            let index = step * config.shards as u64 + shard as u64;
            let seed = config.seed;
            let mut views = SyntheticViews::new(DatasetSplit::Train, config.views, seed, index);
            let mut rng = RngStream::new(seed, "proposals", index);
            let first_stage = first_stages[shard].lock();
            let first_stage = &mut *first_stage.unwrap_or_else(PoisonError::into_inner);
            let batch = RoiBatch::draw(roi, &mut views, &mut rng, first_stage, stop)?;
            Some(batch.gradient(network, parameters, pass, grad_parameters))
        };
        let rate = learning_rate_at(step, roi.learning_rate, roi.warm_up, roi.steps);
        let losses = roi_learner.step(&network.network, &config.adam, rate, shard_gradient)?;
        Some(mean_roi_loss(&losses))
    }

    /// Returns the detector with the averaged parameters, without score calibration.
    pub(crate) fn trained(&self) -> TrainedDetector {
        let first_stage =
            TrainedDetector::uncalibrated(&self.detector, &self.learner.ema_parameters);
        // The file of `--weights` can contain a trained second stage.
        let initial = || self.roi_network.network.init_parameters(self.config.seed);
        let is_trained =
            self.roi_learner.adam.steps > 0 || self.roi_learner.parameters != initial();
        let second_stage = is_trained.then(|| SecondStage {
            network: self.roi_network.clone(),
            parameters: self.roi_learner.ema_parameters.clone(),
        });
        TrainedDetector { second_stage, ..first_stage }
    }
}

/// Maximum number of pixels that all shards process at once. A pixel takes 2.1 kB, which makes 9
/// GB.
const MAX_CROP_PX: usize = 1 << 22;
/// Maximum number of pixels of a shard. A pass takes 1.5 s and cannot be interrupted.
const MAX_SHARD_PX: usize = 1 << 20;

const CROP_BOUNDS: BoundTable = &[
    ("views", integer(1, 256)),
    ("crops_per_view", integer(1, 256)),
    ("side_px", integer(32, 1024)),
    ("uniform_crop_fraction", FRACTION),
];

/// Bounds of the view distribution. Views with more added objects would show little else.
const VIEW_BOUNDS: BoundTable = &[
    ("size_px", integer(32, 1024)),
    ("swap_fraction", FRACTION),
    ("n_added", integer(0, 200)),
    ("decor_fraction", FRACTION),
    ("large_fraction", FRACTION),
    ("furniture_swap", Bound::List(&[FRACTION, real(1.0, 10.0)])),
    ("wanted_class_fraction", FRACTION),
    ("carrying_fraction", FRACTION),
    ("filled_fraction", FRACTION),
    ("varied_fraction", FRACTION),
    ("aimed_fraction", FRACTION),
    ("aimed_movable_fraction", FRACTION),
    ("distance_m", Bound::List(&[real(0.3, 3.0), real(0.5, 20.0)])),
];

const LOSS_BOUNDS: BoundTable = &[
    ("reference_area_px", real(1.0, 1e6)),
    ("area_exponent", real(0.0, 1.0)),
    ("weight_range", real(1e-3, 1e3)),
    ("offset_coef", real(0.0, 100.0)),
    ("min_px", integer(1, 1 << 16)),
];

impl CropConfig {
    /// Checks one set of crops.
    fn check(&self, views: &ViewConfig, shards: usize) -> Result<(), String> {
        if !self.side_px.is_multiple_of(32) || self.side_px > views.size_px as usize {
            return Err(
                "crops.side_px must be a multiple of 32, from 32 to views.size_px".to_owned()
            );
        }
        let shard_px = self.views * self.crops_per_view * self.side_px * self.side_px;
        if shard_px > MAX_SHARD_PX || shards * shard_px > MAX_CROP_PX {
            return Err(format!(
                "crops.views times crops.crops_per_view times the square of crops.side_px is {shard_px} pixels; it must \
                 be from 1 to {MAX_SHARD_PX}, and times shards, which is {shards}, up to {MAX_CROP_PX}"
            ));
        }
        Ok(())
    }
}

impl Trainer for DetectorLearner {
    type Config = DetectorTrainingConfig;
    const KIND: &'static str = "detector";
    const WEIGHTS: &'static str = "detector.safetensors";
    const VALIDATION_STEPS: u64 = 2000;
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("steps", integer(0, MAX_STEPS as i64)),
        ("learning_rate", LEARNING_RATE),
        ("warm_up", STEPS),
        ("shards", SHARDS),
        ("crops", Bound::Table(CROP_BOUNDS)),
        ("views", Bound::Table(VIEW_BOUNDS)),
        ("validation_views", integer(1, 100_000)),
        ("calibration_views", integer(1, 100_000)),
        ("loss", Bound::Table(LOSS_BOUNDS)),
        ("second_stage", Bound::Table(ROI_BOUNDS)),
        ("adam", ADAM),
    ];

    fn new(
        config: &DetectorTrainingConfig,
        _: &Path,
        _: &mut dyn FnMut(&str),
        _: &AtomicBool,
    ) -> Result<Option<DetectorLearner>, TrainingError> {
        Ok(Some(DetectorLearner::new(*config)))
    }

    fn check(config: &DetectorTrainingConfig) -> Result<(), String> {
        let DetectorTrainingConfig { views, loss, shards, .. } = config;
        if !views.size_px.is_multiple_of(32) {
            return Err("views.size_px must be a multiple of 32, from 32 to 1024".to_owned());
        }
        let [near_m, far_m] = views.distance_m;
        if far_m < 1.5 * near_m {
            return Err("views.distance_m must be from near to far, the second at least 1.5 times the first"
                .to_owned());
        }
        if config.steps == 0 && config.second_stage.steps == 0 {
            return Err(
                "steps and second_stage.steps are both 0; nothing would be trained".to_owned()
            );
        }
        if loss.weight_range[0] > loss.weight_range[1] {
            return Err("loss.weight_range must be minimum and maximum".to_owned());
        }
        config.crops.iter().try_for_each(|crops| crops.check(views, *shards))?;
        config.second_stage.check(*shards)
    }

    fn read_weights(
        config: &DetectorTrainingConfig,
        weights: &[u8],
    ) -> Result<Vec<f32>, WeightsError> {
        let detector = Detector::with_blocks(config.blocks);
        let trained = TrainedDetector::from_bytes_with_detector(detector, weights)?;
        let second_stage = match trained.second_stage {
            Some(stage) => stage.parameters,
            None => RoiNetwork::new().network.init_parameters(config.seed),
        };
        Ok([trained.parameters, second_stage].concat())
    }

    fn fixed_keys() -> Vec<&'static str> {
        // `blocks` determines the network. `seed` determines the initial parameters; a comparison with them
        // shows whether the second stage is trained. Views are drawn by step and shard.
        vec!["blocks", "seed", "shards"]
    }

    fn network(&self) -> &Network {
        &self.layout
    }

    fn total_steps(&self) -> u64 {
        self.config.steps + self.config.second_stage.steps
    }

    fn steps_done(&self) -> u64 {
        self.learner.adam.steps + self.roi_learner.adam.steps
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        self.learner.save(&mut checkpoint);
        self.roi_learner.save_as(SECOND_STAGE, &mut checkpoint);
        checkpoint
    }

    fn load_parameters(&mut self, mut parameters: Vec<f32>) {
        let second_stage = parameters.split_off(self.detector.network.n_parameters());
        self.learner.load_parameters(parameters);
        self.roi_learner.load_parameters(second_stage);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        let before = self.learner.state();
        self.learner.load(checkpoint)?;
        if let Err(error) = self.roi_learner.load_as(SECOND_STAGE, checkpoint) {
            self.learner.set_state(before);
            return Err(error);
        }
        self.first_stages.clear();
        Ok(Some(()))
    }

    fn step(&mut self, stop: &AtomicBool) -> Result<Option<Metrics>, TrainingError> {
        let Some(loss) = DetectorLearner::step(self, stop) else { return Ok(None) };
        Ok(Some(match loss {
            DetectorLoss::FirstStage(Loss { labels, offsets, accuracy, object_accuracy }) => {
                metrics([
                    ("label_loss", labels),
                    ("offset_loss", offsets),
                    ("accuracy", accuracy),
                    ("object_accuracy", object_accuracy),
                ])
            }
            DetectorLoss::SecondStage(RoiLoss { labels, mask, qualities, accuracy, iou }) => {
                metrics([
                    ("roi_label_loss", labels),
                    ("roi_mask_loss", mask),
                    ("roi_quality_loss", qualities),
                    ("roi_accuracy", accuracy),
                    ("proposal_iou", iou[0]),
                    ("redrawn_iou", iou[1]),
                ])
            }
        }))
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Metrics, Vec<u8>)>, WeightsError> {
        let mut detector = self.trained();
        let DetectorTrainingConfig { views, shards, validation_views, calibration_views, .. } =
            self.config;
        let precision = evaluate(&detector, views, validation_views, shards, stop);
        let natural = ViewConfig { size_px: views.size_px, ..ViewConfig::NATURAL };
        let Some(precision) = precision else { return Ok(None) };
        let calibration = calibrate(&detector, natural, calibration_views, shards, stop);
        let Some(calibration) = calibration else { return Ok(None) };
        detector.calibration = calibration;
        let metrics = defined_metrics([("map50", precision.map50), ("map", precision.map)]);
        Ok(Some((metrics, detector.to_bytes()?)))
    }
}

fn mean_loss(losses: &[Loss]) -> Loss {
    let mean = |component: fn(&Loss) -> f64| {
        losses.iter().map(component).sum::<f64>() / losses.len() as f64
    };
    Loss {
        labels: mean(|l| l.labels),
        offsets: mean(|l| l.offsets),
        accuracy: mean(|l| l.accuracy),
        object_accuracy: mean(|l| l.object_accuracy),
    }
}

/// Computes the loss of a batch and adds its gradient to `grad_parameters`.
fn gradient(
    detector: &Detector,
    parameters: &[f32],
    batch: &Batch,
    config: &LossConfig,
    pass: &mut TrainingPass,
    grad_parameters: &mut [f32],
) -> Loss {
    let network: &Network = &detector.network;
    pass.forward(network, parameters, &batch.input);
    pass.zero_gradients();
    let mut grad_head = std::mem::take(pass.gradient(detector.head));
    let loss = loss(pass.activation(detector.head), &batch.targets, config, &mut grad_head);
    *pass.gradient(detector.head) = grad_head;
    pass.backward(network, parameters, grad_parameters);
    loss
}
