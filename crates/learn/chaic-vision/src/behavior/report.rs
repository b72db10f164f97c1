//! How well behaviors are told.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::Behavior;
use super::clip::{Clip, SLACK};
use super::network::{Outputs, TrainedBehavior, softmax};
use crate::parallel::in_order;

const N: usize = Behavior::ALL.len();

/// How good a network is on clips that it hasn't learned from.
#[derive(Clone, Debug, Serialize)]
pub struct BehaviorReport {
    /// Clips that were looked at.
    pub clips: usize,
    /// Share of them that is told right.
    pub top1: f64,
    /// Half of the 95 % interval of that share, by the normal approximation.
    pub interval: f64,
    /// The mean of each behavior's share.
    pub balanced: f64,
    /// Mean difference between how sure it is and how often it is right, over tenths of sureness.
    pub calibration_error: f64,
    /// Of mixed clips, in which something went on but did not end just now: share told as moving.
    pub mixed_as_moving: f64,
    /// How many clips of the first behavior were told as the second.
    pub confusion: BTreeMap<&'static str, BTreeMap<&'static str, usize>>,
}

/// Returns the outputs for each clip, in their order; where a clip is read from changes from one to the next.
/// Returns `None` if `stop` is raised meanwhile.
pub fn outputs_of(
    trained: &TrainedBehavior,
    clips: &[Clip],
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<Vec<Outputs>> {
    in_order(
        0..clips.len(),
        n_threads,
        stop,
        || trained.pass(),
        |pass, k| trained.outputs(&clips[k].crops, k % (SLACK + 1), pass),
    )
}

/// The likeliest behavior, and its probability.
pub fn likeliest(probabilities: &Outputs) -> (Behavior, f32) {
    let sure = |b: &Behavior| probabilities[b.index()];
    let best = Behavior::ALL.into_iter().max_by(|a, b| sure(a).total_cmp(&sure(b)));
    best.map_or((Behavior::Moving, 0.0), |best| (best, sure(&best)))
}

/// Returns how good a network is on these clips; `None` if `stop` is raised meanwhile.
pub fn report(
    trained: &TrainedBehavior,
    clips: &[Clip],
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<BehaviorReport> {
    let outputs = outputs_of(trained, clips, n_threads, stop)?;
    let told: Vec<(Behavior, f32)> =
        outputs.iter().map(|o| likeliest(&trained.probabilities(o))).collect();
    let mut counts = [[0usize; N]; N];
    let mut said = Vec::new();
    let (mut mixed, mut mixed_right) = (0usize, 0usize);
    for (clip, (behavior, sure)) in clips.iter().zip(told) {
        if clip.is_mixed {
            mixed += 1;
            mixed_right += usize::from(behavior == Behavior::Moving);
            continue;
        }
        counts[clip.label.index()][behavior.index()] += 1;
        said.push((sure, behavior == clip.label));
    }
    let n = said.len().max(1) as f64;
    let top1 = said.iter().filter(|(_, right)| *right).count() as f64 / n;
    let rows = counts.iter().enumerate().filter(|(_, row)| row.iter().sum::<usize>() > 0);
    let shares: Vec<f64> =
        rows.map(|(k, row)| row[k] as f64 / row.iter().sum::<usize>() as f64).collect();
    let named =
        |row: &[usize; N]| Behavior::ALL.map(Behavior::name).into_iter().zip(*row).collect();
    Some(BehaviorReport {
        clips: said.len(),
        top1,
        interval: 1.96 * (top1 * (1.0 - top1) / n).sqrt(),
        balanced: shares.iter().sum::<f64>() / shares.len().max(1) as f64,
        calibration_error: crate::calibration::calibration_error(&said),
        mixed_as_moving: mixed_right as f64 / mixed.max(1) as f64,
        confusion: Behavior::ALL.iter().map(|b| (b.name(), named(&counts[b.index()]))).collect(),
    })
}

/// The sharpness by which the probability of what was right is greatest, by golden-section steps.
pub fn calibrate(clips: &[Clip], outputs: &[Outputs]) -> f32 {
    let loss = |sharpness: f32| -> f64 {
        let of = |(clip, o): (&Clip, &Outputs)| {
            let p = softmax(&o.map(|x| sharpness * x))[clip.label.index()];
            -f64::from(crate::loss::ln(p.max(1e-6)))
        };
        clips.iter().zip(outputs).filter(|(clip, _)| !clip.is_mixed).map(of).sum()
    };
    let (mut low, mut high) = (0.1f32, 4.0f32);
    for _ in 0..30 {
        let (a, b) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
        if loss(a) < loss(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
