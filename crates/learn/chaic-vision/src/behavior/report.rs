//! Evaluation of the behavior network.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::Behavior;
use super::clip::{Clip, SLACK};
use super::network::{BehaviorScores, TrainedBehavior, softmax};
use crate::parallel::map_in_order;
use crate::track_evaluation::Rate;

const N: usize = Behavior::ALL.len();

/// Accuracy on held-out clips.
#[derive(Clone, Debug, Serialize)]
pub struct BehaviorReport {
    /// Number of evaluated clips.
    pub clips: usize,
    /// Number of episodes with evaluated clips.
    pub episodes: usize,
    /// Fraction of correctly classified clips; `None` without clips.
    pub top1: Option<f64>,
    /// Half width of the 95 % interval of `top1` over episodes; `None` with fewer than two.
    pub interval: Option<f64>,
    /// Mean recall over the behaviors that occur; `None` without clips.
    pub balanced: Option<f64>,
    /// Expected calibration error over ten bins; `None` without clips.
    pub calibration_error: Option<f64>,
    /// Fraction of mixed clips that are classified as moving; `None` without mixed clips.
    pub mixed_as_moving: Option<f64>,
    /// Number of clips by true and predicted behavior.
    pub confusion: BTreeMap<&'static str, BTreeMap<&'static str, usize>>,
}

/// Returns the logits of each clip, in order. Successive clips start at different crops. Returns
/// `None` if `stop` is set meanwhile.
pub fn all_outputs(
    trained: &TrainedBehavior,
    clips: &[Clip],
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<Vec<BehaviorScores>> {
    map_in_order(
        0..clips.len(),
        n_threads,
        stop,
        || trained.pass(),
        |pass, k| trained.outputs(&clips[k].crops, k % (SLACK + 1), pass),
    )
}

/// Returns the most probable behavior and its probability.
pub fn most_probable(probabilities: &BehaviorScores) -> (Behavior, f32) {
    let probability = |b: &Behavior| probabilities[b.index()];
    let best = Behavior::ALL.into_iter().max_by(|a, b| probability(a).total_cmp(&probability(b)));
    best.map_or((Behavior::Moving, 0.0), |best| (best, probability(&best)))
}

/// Evaluates a network on clips; returns `None` if `stop` is set meanwhile.
pub fn report(
    trained: &TrainedBehavior,
    clips: &[Clip],
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<BehaviorReport> {
    let outputs = all_outputs(trained, clips, n_threads, stop)?;
    let predictions: Vec<(Behavior, f32)> =
        outputs.iter().map(|o| most_probable(&trained.probabilities(o))).collect();
    let mut counts = [[0usize; N]; N];
    let mut scored = Vec::new();
    // Correct and all clips of each episode.
    let mut by_episode: BTreeMap<u32, [usize; 2]> = BTreeMap::new();
    let mut mixed = [0usize; 2];
    for (clip, (behavior, probability)) in clips.iter().zip(predictions) {
        if clip.is_mixed {
            mixed[0] += usize::from(behavior == Behavior::Moving);
            mixed[1] += 1;
            continue;
        }
        let is_correct = behavior == clip.label;
        counts[clip.label.index()][behavior.index()] += 1;
        scored.push((probability, is_correct));
        let episode = by_episode.entry(clip.episode).or_default();
        episode[0] += usize::from(is_correct);
        episode[1] += 1;
    }
    let top1 = Rate::new(by_episode.values().copied());
    let rows = counts.iter().enumerate().filter(|(_, row)| row.iter().sum::<usize>() > 0);
    let recalls: Vec<f64> =
        rows.map(|(k, row)| row[k] as f64 / row.iter().sum::<usize>() as f64).collect();
    let has_clips = !scored.is_empty();
    let counts_by_name =
        |row: &[usize; N]| Behavior::ALL.map(Behavior::name).into_iter().zip(*row).collect();
    Some(BehaviorReport {
        clips: scored.len(),
        episodes: by_episode.len(),
        top1: top1.value,
        interval: top1.interval,
        balanced: has_clips.then(|| recalls.iter().sum::<f64>() / recalls.len() as f64),
        calibration_error: has_clips.then(|| crate::calibration::calibration_error(&scored)),
        mixed_as_moving: Rate::new(std::iter::once(mixed)).value,
        confusion: Behavior::ALL
            .iter()
            .map(|b| (b.name(), counts_by_name(&counts[b.index()])))
            .collect(),
    })
}

/// Returns the inverse temperature that maximizes the likelihood of the labels, by golden-section
/// search; 1 if all clips are mixed or there are none.
pub fn calibrate(clips: &[Clip], outputs: &[BehaviorScores]) -> f32 {
    if clips.iter().all(|clip| clip.is_mixed) {
        return 1.0;
    }
    let loss = |inverse_temperature: f32| -> f64 {
        let clip_loss = |(clip, o): (&Clip, &BehaviorScores)| {
            let p = softmax(&o.map(|x| inverse_temperature * x))[clip.label.index()];
            -f64::from(crate::loss::ln(p.max(1e-6)))
        };
        clips.iter().zip(outputs).filter(|(clip, _)| !clip.is_mixed).map(clip_loss).sum()
    };
    let (mut low, mut high) = (0.1f32, 4.0f32);
    for _ in 0..30 {
        let (a, b) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
        if loss(a) < loss(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
