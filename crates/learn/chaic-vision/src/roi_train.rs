//! Training of the detector's second stage on proposals of the first.

use std::sync::atomic::AtomicBool;

use chaic_core::rng::RngStream;
use chaic_nn::{Inference, Tensor, TrainingPass};
use chaic_training::bounds::{BoundTable, LEARNING_RATE, MAX_STEPS, STEPS, integer};
use serde::{Deserialize, Serialize};

use crate::instances::Segment;
use crate::proposals::{MAX_PROPOSALS, proposals};
use crate::roi::RoiSource;
use crate::roi_loss::{RoiLoss, RoiTarget, ViewTruth, roi_loss};
use crate::roi_network::RoiNetwork;
use crate::second_stage::fill_inputs;
use crate::trained::first_stage_pixels;
use crate::views::SyntheticViews;

/// Configuration of the training of the second stage, which follows that of the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoiTrainingConfig {
    /// Number of steps.
    pub steps: u64,
    /// Maximum learning rate.
    pub learning_rate: f32,
    /// Steps of linear warm-up.
    pub warm_up: u64,
    /// Views per shard.
    pub views: usize,
    /// Proposals per view, at most.
    pub proposals_per_view: usize,
}

impl Default for RoiTrainingConfig {
    fn default() -> RoiTrainingConfig {
        RoiTrainingConfig {
            steps: 20_000,
            learning_rate: 1e-3,
            warm_up: 200,
            views: 4,
            proposals_per_view: 16,
        }
    }
}

/// Bounds of [`RoiTrainingConfig`].
pub(crate) const ROI_BOUNDS: BoundTable = &[
    ("steps", integer(0, MAX_STEPS as i64)),
    ("learning_rate", LEARNING_RATE),
    ("warm_up", STEPS),
    ("views", integer(1, 64)),
    ("proposals_per_view", integer(1, MAX_PROPOSALS as i64)),
];

/// Maximum number of proposals of a shard. A pass cannot be interrupted.
const MAX_SHARD_PROPOSALS: usize = 512;
/// Maximum number of proposals that all shards process at once. A proposal takes 3.4 MB, which makes
/// 14 GB.
const MAX_BATCH_PROPOSALS: usize = 4096;

impl RoiTrainingConfig {
    /// Checks that the proposals of a step fit in memory.
    ///
    /// # Errors
    /// One line that names the keys.
    pub(crate) fn check(&self, shards: usize) -> Result<(), String> {
        let n = self.views * self.proposals_per_view;
        if n > MAX_SHARD_PROPOSALS || shards * n > MAX_BATCH_PROPOSALS {
            return Err(format!(
                "second_stage.views times second_stage.proposals_per_view is {n}; it must be from 1 to \
                 {MAX_SHARD_PROPOSALS}, and times shards, which is {shards}, up to {MAX_BATCH_PROPOSALS}"
            ));
        }
        Ok(())
    }
}

/// Proposals of several views.
#[derive(Default)]
pub(crate) struct RoiBatch {
    /// Crops and scalars.
    inputs: [Tensor; 2],
    targets: Vec<RoiTarget>,
}

impl RoiBatch {
    /// Draws proposals of the first stage in new views; returns `None` if `stop` is set meanwhile.
    pub(crate) fn draw(
        config: &RoiTrainingConfig,
        views: &mut SyntheticViews,
        rng: &mut RngStream,
        first_stage: &mut Inference,
        stop: &AtomicBool,
    ) -> Option<RoiBatch> {
        let mut batch = RoiBatch::default();
        let mut view_inputs: [Tensor; 2] = Default::default();
        for _ in 0..config.views {
            let view = views.draw_unless_stopped(stop)?;
            let pixels = first_stage_pixels(&view.rgb, &view.depth_m, &view.camera, first_stage);
            let source = RoiSource { features: first_stage.last_input(), pixels: &pixels };
            let truth = ViewTruth::new(&view);
            let drawn = draw_proposals(proposals(&pixels), &truth, config.proposals_per_view, rng);
            let boxes = fill_inputs(&source, &drawn, &mut view_inputs);
            let targets = drawn.iter().zip(boxes).map(|(segment, roi)| truth.target(segment, roi));
            batch.targets.extend(targets);
            for (all, new) in batch.inputs.iter_mut().zip(&view_inputs) {
                all.data.extend(&new.data);
            }
        }
        let shapes = RoiNetwork::input_shapes(batch.targets.len());
        for (input, shape) in batch.inputs.iter_mut().zip(shapes) {
            input.shape = shape;
        }
        Some(batch)
    }

    /// Computes the loss and adds its gradient to `grad_parameters`.
    pub(crate) fn gradient(
        &self,
        network: &RoiNetwork,
        parameters: &[f32],
        pass: &mut TrainingPass,
        grad_parameters: &mut [f32],
    ) -> RoiLoss {
        if self.targets.is_empty() {
            return RoiLoss::default();
        }
        let [crops, scalars] = &self.inputs;
        pass.forward_all(&network.network, parameters, &[crops, scalars]);
        pass.zero_gradients();
        let loss = roi_loss(network, &self.targets, pass);
        pass.backward(&network.network, parameters, grad_parameters);
        loss
    }
}

/// Draws proposals: first a label, uniformly over those that the proposals show, then one of its
/// proposals that was not drawn before.
fn draw_proposals(
    proposals: Vec<Segment>,
    truth: &ViewTruth<'_>,
    n: usize,
    rng: &mut RngStream,
) -> Vec<Segment> {
    let mut by_label: Vec<(u8, Vec<Segment>)> = Vec::new();
    for proposal in proposals {
        let label = truth.label(&proposal);
        match by_label.iter_mut().find(|(other, _)| *other == label) {
            Some((_, segments)) => segments.push(proposal),
            None => by_label.push((label, vec![proposal])),
        }
    }
    let mut drawn = Vec::new();
    while drawn.len() < n && !by_label.is_empty() {
        let k = rng.below(by_label.len());
        let segments = &mut by_label[k].1;
        let which = rng.below(segments.len());
        drawn.push(segments.swap_remove(which));
        if segments.is_empty() {
            by_label.swap_remove(k);
        }
    }
    drawn
}

/// Returns the means over shards.
pub(crate) fn mean_roi_loss(losses: &[RoiLoss]) -> RoiLoss {
    let mean = |component: fn(&RoiLoss) -> f64| {
        losses.iter().map(component).sum::<f64>() / losses.len() as f64
    };
    RoiLoss {
        labels: mean(|l| l.labels),
        mask: mean(|l| l.mask),
        qualities: mean(|l| l.qualities),
        accuracy: mean(|l| l.accuracy),
        iou: [mean(|l| l.iou[0]), mean(|l| l.iou[1])],
    }
}
