//! Targets and loss of the detector's second stage.

use chaic_nn::{Tensor, TrainingPass};

use crate::detector::STRIDE;
use crate::instances::Segment;
use crate::labels::BACKGROUND;
use crate::loss::{exp, ln, sigmoid, softmax};
use crate::roi::{RoiBox, SIDE};
use crate::roi_network::{N_QUALITIES, RoiNetwork};
use crate::views::LabeledView;

/// Coefficients of the mask loss and the quality loss, relative to the label loss.
const MASK_COEF: f32 = 1.0;
const QUALITY_COEF: f32 = 0.5;
/// Minimum fraction of a proposal's pixels that an object must cover; otherwise the proposal is
/// background.
const MIN_COVERAGE: f32 = 0.5;

/// Target of a proposal.
#[derive(Clone, Debug, PartialEq)]
pub struct RoiTarget {
    /// Label of the object that covers most of the proposal; the background if none does.
    pub label: u8,
    /// For each sample of the crop: 1 inside the object, 0 outside the object, -1 outside the
    /// image.
    pub mask: Vec<i8>,
    /// Pixels of the object outside of the crop, in samples.
    pub n_outside: f32,
    /// Intersection over union of the proposal with the object.
    pub iou: f32,
}

/// Ground truth of a view at the network's resolution.
pub struct ViewTruth<'a> {
    view: &'a LabeledView,
    /// Instance id of each network pixel.
    ids: Vec<u16>,
    /// Number of network pixels of each id.
    areas: Vec<u32>,
}

impl ViewTruth<'_> {
    /// Reads a view.
    pub fn new(view: &LabeledView) -> ViewTruth<'_> {
        let width = view.camera.width as usize;
        let height = view.camera.height as usize;
        let rows = (0..height).step_by(STRIDE);
        let ids: Vec<u16> = rows
            .flat_map(|y| (0..width).step_by(STRIDE).map(move |x| y * width + x))
            .map(|k| view.ids[k])
            .collect();
        let mut areas = vec![0; view.labels.len()];
        for id in &ids {
            if let Some(area) = areas.get_mut(usize::from(*id)) {
                *area += 1;
            }
        }
        ViewTruth { view, ids, areas }
    }

    /// Returns the object that covers most of a proposal, and the number of shared pixels; `None` if
    /// no object covers at least half of the proposal.
    fn object(&self, proposal: &Segment) -> Option<(usize, u32)> {
        let mut shared = vec![0u32; self.areas.len()];
        for k in &proposal.pixels {
            if let Some(n) = shared.get_mut(usize::from(self.ids[*k as usize])) {
                *n += 1;
            }
        }
        let objects = (0..shared.len()).filter(|id| self.view.labels[*id] != BACKGROUND);
        let best = objects.max_by(|a, b| shared[*a].cmp(&shared[*b]).then(b.cmp(a)))?;
        let is_covered = shared[best] as f32 >= MIN_COVERAGE * proposal.pixels.len() as f32;
        is_covered.then_some((best, shared[best]))
    }

    /// Returns the label of a proposal, as in [`ViewTruth::target`].
    pub fn label(&self, proposal: &Segment) -> u8 {
        self.object(proposal).map_or(BACKGROUND, |(id, _)| self.view.labels[id])
    }

    /// Returns the target of a proposal with this crop.
    pub fn target(&self, proposal: &Segment, roi: RoiBox) -> RoiTarget {
        let columns = self.view.camera.width as usize / STRIDE;
        let object = self.object(proposal);
        let n = proposal.pixels.len() as f32;
        let mut n_inside = 0;
        let samples = roi.sample_pixels(columns, self.ids.len() / columns);
        let mask: Vec<i8> = samples
            .map(|at| match at {
                None => -1,
                Some(at) if object.is_some_and(|(id, _)| id == usize::from(self.ids[at])) => {
                    n_inside += 1;
                    1
                }
                Some(_) => 0,
            })
            .collect();
        let (label, area, iou) = object.map_or((BACKGROUND, 0.0, 0.0), |(id, shared)| {
            let (area, shared) = (self.areas[id] as f32, shared as f32);
            (self.view.labels[id], area, shared / (n + area - shared))
        });
        let n_outside = (area / (roi.step() * roi.step()) - n_inside as f32).max(0.0);
        RoiTarget { label, mask, n_outside, iou }
    }
}

/// Losses of a batch, means over its proposals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoiLoss {
    /// Cross entropy of labels.
    pub labels: f64,
    /// Binary cross entropy of masks, of proposals that show an object.
    pub mask: f64,
    /// Cross entropy of qualities above the entropy of their targets.
    pub qualities: f64,
    /// Fraction of objects with the correct label.
    pub accuracy: f64,
    /// Mean intersection over union of objects with their proposals, then with the redrawn masks.
    pub iou: [f64; N_QUALITIES],
}

/// Binary cross entropy with logits.
fn binary_cross_entropy(logit: f32, target: f32) -> f32 {
    logit.max(0.0) - logit * target + ln(1.0 + exp(-logit.abs()))
}

/// Computes the loss of the outputs in `pass` and writes its gradients there.
pub fn roi_loss(network: &RoiNetwork, targets: &[RoiTarget], pass: &mut TrainingPass) -> RoiLoss {
    let RoiNetwork { labels, qualities, mask, .. } = network;
    let normalizer = 1.0 / targets.len() as f32;
    let n_objects = targets.iter().filter(|t| t.label != BACKGROUND).count();
    let object_normalizer = 1.0 / n_objects.max(1) as f32;
    let mut loss = RoiLoss::default();
    let take = |pass: &mut TrainingPass, node| -> (Tensor, Tensor) {
        (pass.activation(node).clone(), std::mem::take(pass.gradient(node)))
    };
    let (label_logits, mut grad_labels) = take(pass, *labels);
    let (quality_logits, mut grad_qualities) = take(pass, *qualities);
    let (mask_logits, mut grad_mask) = take(pass, *mask);
    let n_labels = label_logits.shape.channels;
    for (k, target) in targets.iter().enumerate() {
        let row = &label_logits.data[k * n_labels..][..n_labels];
        let mut probabilities = row.to_vec();
        softmax(&mut probabilities);
        let wanted = usize::from(target.label);
        let max = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        loss.labels -= f64::from(normalizer * ln(probabilities[wanted].max(1e-12)));
        let gradient = &mut grad_labels.data[k * n_labels..][..n_labels];
        for (g, p) in gradient.iter_mut().zip(&probabilities) {
            *g = normalizer * p;
        }
        gradient[wanted] -= normalizer;
        let logits = &mask_logits.data[k * SIDE * SIDE..][..SIDE * SIDE];
        let mut ious = [target.iou, 0.0];
        if target.label != BACKGROUND {
            loss.accuracy += f64::from(object_normalizer) * f64::from(u8::from(row[wanted] >= max));
            let n_inside = target.mask.iter().filter(|m| **m >= 0).count().max(1);
            let scale = object_normalizer / n_inside as f32;
            let (mut shared, mut union) = (0.0, target.n_outside);
            let gradient = &mut grad_mask.data[k * SIDE * SIDE..][..SIDE * SIDE];
            for ((logit, target), gradient) in logits.iter().zip(&target.mask).zip(gradient) {
                if *target < 0 {
                    continue;
                }
                let truth = f32::from(*target);
                loss.mask += f64::from(scale * binary_cross_entropy(*logit, truth));
                *gradient = MASK_COEF * scale * (sigmoid(*logit) - truth);
                let drawn = f32::from(u8::from(*logit > 0.0));
                shared += drawn * truth;
                union += drawn.max(truth);
            }
            ious[1] = shared / union.max(1.0);
            for (sum, iou) in loss.iou.iter_mut().zip(ious) {
                *sum += f64::from(object_normalizer * iou);
            }
        }
        for (q, iou) in ious.into_iter().enumerate() {
            let at = k * N_QUALITIES + q;
            let logit = quality_logits.data[at];
            let least = binary_cross_entropy(ln(iou.max(1e-4) / (1.0 - iou).max(1e-4)), iou);
            loss.qualities += f64::from(normalizer * (binary_cross_entropy(logit, iou) - least));
            grad_qualities.data[at] = QUALITY_COEF * normalizer * (sigmoid(logit) - iou);
        }
    }
    *pass.gradient(*labels) = grad_labels;
    *pass.gradient(*qualities) = grad_qualities;
    *pass.gradient(*mask) = grad_mask;
    loss
}
