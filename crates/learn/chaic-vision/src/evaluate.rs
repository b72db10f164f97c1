//! Evaluation of a detector on held-out views.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use crate::average_precision::{
    AreaRange, AveragePrecision, EvaluatedImage, GroundTruthInstance, ScoredDetection,
    average_precision, mean,
};
use crate::calibration::{Calibration, CalibrationSample, calibration_error, predictors};
use crate::error_breakdown::ErrorBreakdown;
use crate::instances::Instance;
use crate::labels::{BACKGROUND, class_of};
use crate::noisy::DetectorNoiseModel;
use crate::parallel::map_in_order;
use crate::trained::TrainedDetector;
use crate::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};

/// Minimum visible pixels of evaluated instances; smaller ones are ignored.
pub const MIN_AREA_PX: u32 = 100;
const EVALUATED_AREAS: AreaRange = MIN_AREA_PX..=u32::MAX;

/// Computes the overlaps between the instances of a view and the detections, with one detection per
/// candidate label of a detected instance.
pub fn compare(view: &LabeledView, detections: &[Instance]) -> EvaluatedImage {
    let mut areas = vec![0u32; view.labels.len()];
    for id in &view.ids {
        if let Some(area) = areas.get_mut(usize::from(*id)) {
            *area += 1;
        }
    }
    let visible: Vec<usize> =
        (0..areas.len()).filter(|id| areas[*id] > 0 && view.labels[*id] != BACKGROUND).collect();
    let mut index = vec![usize::MAX; areas.len()];
    visible.iter().enumerate().for_each(|(k, id)| index[*id] = k);
    let truth = |id: &usize| GroundTruthInstance { label: view.labels[*id], area: areas[*id] };
    let detections_of = |instance: &Instance| {
        let mut intersections = vec![0; visible.len()];
        for k in &instance.pixels {
            let id = usize::from(view.ids[*k as usize]);
            if let Some(n) = index.get(id).and_then(|k| intersections.get_mut(*k)) {
                *n += 1;
            }
        }
        let area = instance.pixels.len() as u32;
        let detection = |&(label, score): &(u8, f32)| ScoredDetection {
            label,
            score,
            area,
            intersections: intersections.clone(),
        };
        instance.names.iter().map(detection).collect::<Vec<ScoredDetection>>()
    };
    EvaluatedImage {
        truths: visible.iter().map(truth).collect(),
        detections: detections.iter().flat_map(detections_of).collect(),
    }
}

/// Computes average precision on the first validation views; returns `None` if `stop` is set
/// meanwhile.
pub fn evaluate(
    detector: &TrainedDetector,
    config: ViewConfig,
    n_views: usize,
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<AveragePrecision> {
    let split = DatasetSplit::Validation;
    let images =
        map_views(detector, split, config, n_views, n_threads, stop, |_, view, detections| {
            compare(view, detections)
        })?;
    Some(average_precision(&images, &EVALUATED_AREAS))
}

/// Fits a calibration on detections in the first training views. The view configuration should be a
/// helper's, [`ViewConfig::NATURAL`]. Returns `None` if `stop` is set meanwhile.
pub fn calibrate(
    detector: &TrainedDetector,
    config: ViewConfig,
    n_views: usize,
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<Calibration> {
    let split = DatasetSplit::Train;
    let view_samples = |_, view: &LabeledView, detections: &[Instance]| {
        calibration_samples(detections, &compare(view, detections))
    };
    let calibration_samples =
        map_views(detector, split, config, n_views, n_threads, stop, view_samples)?;
    Some(Calibration::fit(&calibration_samples.concat()))
}

/// Predictors and correctness of each detection.
fn calibration_samples(detections: &[Instance], image: &EvaluatedImage) -> Vec<CalibrationSample> {
    let is_correct = |detection: &ScoredDetection| {
        image.truths.iter().zip(&detection.intersections).any(|(truth, intersection)| {
            truth.label == detection.label && 3 * intersection >= truth.area + detection.area
        })
    };
    let named = detections.iter().flat_map(|d| d.names.iter().map(move |name| (d, name)));
    let samples = named.zip(&image.detections).map(|((instance, (_, score)), detection)| {
        let predictors = predictors(*score, instance.pixels.len(), instance.center);
        CalibrationSample { predictors, is_correct: is_correct(detection) }
    });
    samples.collect()
}

/// Maps the first views and their detections to values, in order, on any number of threads; returns
/// `None` if `stop` is set meanwhile.
fn map_views<T: Send>(
    detector: &TrainedDetector,
    split: DatasetSplit,
    config: ViewConfig,
    n_views: usize,
    n_threads: usize,
    stop: &AtomicBool,
    map: impl Fn(usize, &LabeledView, &[Instance]) -> T + Sync + Send,
) -> Option<Vec<T>> {
    map_in_order(
        0..n_views,
        n_threads,
        stop,
        || detector.inference(),
        |inference, k| {
            let view = SyntheticViews::new(split, config, 1, k as u64).draw();
            let detections = detector.detect(&view.rgb, &view.depth_m, &view.camera, inference);
            map(k, &view, &detections)
        },
    )
}

/// Accuracy of a detector, serialized as JSON. Values that no instance or detection defines are
/// `None`.
#[derive(Clone, Debug, Serialize)]
pub struct DetectionReport {
    /// Number of evaluated views.
    pub views: usize,
    /// Mean average precision at IoU 0.5, for instances of [`MIN_AREA_PX`] pixels and more.
    pub map50: Option<f64>,
    /// Mean average precision over IoU 0.5 to 0.95.
    pub map: Option<f64>,
    /// Both values with smaller instances included, by minimum area in pixels.
    pub smaller: BTreeMap<u32, [Option<f64>; 2]>,
    /// Both values by size range.
    pub sizes: BTreeMap<&'static str, [Option<f64>; 2]>,
    /// `map50` over the classes with at least [`MIN_FREQUENT_INSTANCES`] instances, and the number
    /// of these classes.
    pub map50_of_frequent: (Option<f64>, usize),
    /// Expected calibration error of scores.
    pub calibration_error: Option<f64>,
    /// Errors by cause.
    #[serde(rename = "failures")]
    pub errors: ErrorBreakdown,
    /// The same errors as rates of the noise model.
    #[serde(rename = "fault_rates")]
    pub noise_model: DetectorNoiseModel,
    /// By class: average precision at IoU 0.5, mean over all thresholds, number of instances.
    pub classes: BTreeMap<&'static str, (f64, f64, usize)>,
}

/// Additional minimum areas that are reported, pixels.
const SMALLER_PX: [u32; 2] = [64, 32];
/// COCO's size ranges, from [`MIN_AREA_PX`].
const SIZES: [(&str, AreaRange); 3] = [
    ("small", MIN_AREA_PX..=32 * 32),
    ("medium", 32 * 32 + 1..=96 * 96),
    ("large", 96 * 96 + 1..=u32::MAX),
];
/// Minimum number of instances for a reliable average precision of a class.
pub const MIN_FREQUENT_INSTANCES: usize = 50;

/// Evaluates a detector on the first views. `map_view` maps each view, by index, and its detections
/// to an additional value. Returns `None` if `stop` is set meanwhile.
pub fn report<A: Send>(
    detector: &TrainedDetector,
    split: DatasetSplit,
    config: ViewConfig,
    n_views: usize,
    n_threads: usize,
    map_view: impl Fn(usize, &LabeledView, &[Instance]) -> A + Sync + Send,
    stop: &AtomicBool,
) -> Option<(DetectionReport, Vec<A>)> {
    let evaluate_view = |k: usize, view: &LabeledView, detections: &[Instance]| {
        let image = compare(view, detections);
        let correct = calibration_samples(detections, &image).into_iter().map(|s| s.is_correct);
        let scores = image.detections.iter().map(|detection| detection.score);
        let scored: Vec<(f32, bool)> = scores.zip(correct).collect();
        (image, (scored, map_view(k, view, detections)))
    };
    let evaluated = map_views(detector, split, config, n_views, n_threads, stop, evaluate_view)?;
    let (images, details): (Vec<EvaluatedImage>, Vec<_>) = evaluated.into_iter().unzip();
    let (scored, mapped): (Vec<_>, Vec<A>) = details.into_iter().unzip();
    let detections = average_precision(&images, &EVALUATED_AREAS);
    let map_in = |areas: &AreaRange| {
        let detections = average_precision(&images, areas);
        [detections.map50, detections.map]
    };
    let name = |label: u8| class_of(label).map_or("", |class| class.name());
    let frequent = detections.classes.values().filter(|(_, _, n)| *n >= MIN_FREQUENT_INSTANCES);
    let frequent: Vec<f64> = frequent.map(|(ap50, _, _)| *ap50).collect();
    let n_frequent = frequent.len();
    let scored = scored.concat();
    let report = DetectionReport {
        views: n_views,
        map50: detections.map50,
        map: detections.map,
        smaller: SMALLER_PX.iter().map(|px| (*px, map_in(&(*px..=u32::MAX)))).collect(),
        sizes: SIZES.iter().map(|(name, areas)| (*name, map_in(areas))).collect(),
        map50_of_frequent: (mean(frequent.into_iter()), n_frequent),
        calibration_error: (!scored.is_empty()).then(|| calibration_error(&scored)),
        errors: ErrorBreakdown::new(&images, &EVALUATED_AREAS),
        noise_model: DetectorNoiseModel::measured(&images),
        classes: detections.classes.iter().map(|(label, c)| (name(*label), *c)).collect(),
    };
    Some((report, mapped))
}
