//! Evaluation of the behavior network.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::Behavior;
use super::calibration::BehaviorScores;
use super::clip::{Clip, ClipSet, N_EXTRA_CROPS};
use super::network::TrainedBehavior;
use crate::calibration::weighted_calibration_error;
use crate::parallel::map_in_order;
use crate::track_evaluation::RateEstimate;

const N: usize = Behavior::ALL.len();

/// Accuracy on held-out clips. Their actions are about as frequent as in training batches, so the accuracy is
/// that of the network before the correction to the frequencies in play. Values in play include the correction.
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
    /// Fraction of correctly classified clips, mixed ones included, if each kind is as frequent as in play;
    /// `None` without clips.
    pub top1_in_play: Option<f64>,
    /// Mean recall over the behaviors that occur; `None` without clips.
    pub balanced: Option<f64>,
    /// Expected calibration error over ten bins, with the clips and frequencies of `top1_in_play`; `None`
    /// without clips.
    pub calibration_error: Option<f64>,
    /// Fraction of mixed clips that are classified as moving with the frequencies in play; `None` without
    /// mixed clips.
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
        |pass, k| trained.outputs(&clips[k].crops, k % (N_EXTRA_CROPS + 1), pass),
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
    clips: &ClipSet,
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<BehaviorReport> {
    let outputs = all_outputs(trained, &clips.clips, n_threads, stop)?;
    Some(report_of_outputs(trained, clips, &outputs))
}

/// Evaluates the logits of clips.
pub fn report_of_outputs(
    trained: &TrainedBehavior,
    set: &ClipSet,
    outputs: &[BehaviorScores],
) -> BehaviorReport {
    let clips = &set.clips;
    let in_play: Vec<(Behavior, f32)> =
        outputs.iter().map(|o| most_probable(&trained.probabilities(o))).collect();
    let scored: Vec<(f32, bool, f64)> = clips
        .iter()
        .zip(&in_play)
        .zip(set.weights())
        .map(|((clip, (behavior, p)), weight)| (*p, *behavior == clip.label, weight))
        .collect();
    let total: f64 = scored.iter().map(|(_, _, weight)| weight).sum();
    let correct: f64 = scored.iter().filter(|(_, is_correct, _)| *is_correct).map(|s| s.2).sum();
    let has_weights = total > 0.0;
    let mut counts = [[0usize; N]; N];
    // Correct and all clips of each episode.
    let mut by_episode: BTreeMap<u32, [usize; 2]> = BTreeMap::new();
    let mut mixed = [0usize; 2];
    for ((clip, output), (behavior_in_play, _)) in clips.iter().zip(outputs).zip(in_play) {
        if clip.is_mixed {
            mixed[0] += usize::from(behavior_in_play == Behavior::Moving);
            mixed[1] += 1;
            continue;
        }
        let (behavior, _) = most_probable(output);
        let is_correct = behavior == clip.label;
        counts[clip.label.index()][behavior.index()] += 1;
        let episode = by_episode.entry(clip.episode).or_default();
        episode[0] += usize::from(is_correct);
        episode[1] += 1;
    }
    let top1 = RateEstimate::new(by_episode.values().copied());
    let rows = counts.iter().enumerate().filter(|(_, row)| row.iter().sum::<usize>() > 0);
    let recalls: Vec<f64> =
        rows.map(|(k, row)| row[k] as f64 / row.iter().sum::<usize>() as f64).collect();
    let counts_by_name =
        |row: &[usize; N]| Behavior::ALL.map(Behavior::name).into_iter().zip(*row).collect();
    BehaviorReport {
        clips: top1.n,
        episodes: by_episode.len(),
        top1: top1.value,
        interval: top1.interval,
        top1_in_play: has_weights.then(|| correct / total),
        balanced: (top1.n > 0).then(|| recalls.iter().sum::<f64>() / recalls.len() as f64),
        calibration_error: has_weights.then(|| weighted_calibration_error(&scored)),
        mixed_as_moving: RateEstimate::new(std::iter::once(mixed)).value,
        confusion: Behavior::ALL
            .iter()
            .map(|b| (b.name(), counts_by_name(&counts[b.index()])))
            .collect(),
    }
}
