//! Average precision as defined by COCO. Detections of a class are matched, in order of their
//! score, to the instance with the greatest overlap; precision is averaged over 101 levels of
//! recall. The values equal those of pycocotools (`benches/pycocotools`).

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// IoU thresholds of a match: 0.5 to 0.95.
pub const IOU_THRESHOLDS: [f64; 10] = [0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95];
/// Maximum number of detections per image; those with the highest scores count.
pub const MAX_DETECTIONS: usize = 100;

/// Annotated instance of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTruthInstance {
    /// Its label.
    pub label: u8,
    /// Visible pixels.
    pub area: u32,
}

/// Range of areas of evaluated instances, pixels. Instances outside this range are ignored: they
/// count neither as missed nor as wrong.
pub type AreaRange = RangeInclusive<u32>;

/// Detection in an image, with its overlaps with the annotated instances.
#[derive(Clone, Debug, PartialEq)]
pub struct ScoredDetection {
    /// Its label.
    pub label: u8,
    /// Score, 0 to 1.
    pub score: f32,
    /// Number of pixels.
    pub area: u32,
    /// Pixels shared with each [`GroundTruthInstance`], in their order.
    pub intersections: Vec<u32>,
}

/// Annotations and detections of one image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EvaluatedImage {
    /// Annotated instances.
    pub truths: Vec<GroundTruthInstance>,
    /// Detections.
    pub detections: Vec<ScoredDetection>,
}

/// Returns the average precision of one class at one IoU threshold; `None` if no instance of the
/// class is evaluated.
fn class_precision(
    images: &[EvaluatedImage],
    label: u8,
    iou_threshold: f64,
    areas: &AreaRange,
) -> Option<f64> {
    let instances = images.iter().flat_map(|i| &i.truths).filter(|t| t.label == label);
    let n_evaluated = instances.filter(|t| areas.contains(&t.area)).count();
    if n_evaluated == 0 {
        return None;
    }
    // Score and correctness of the detections that are not ignored.
    let mut scored: Vec<(f32, bool)> = Vec::new();
    for image in images {
        match_detections(image, label, iou_threshold, areas, &mut scored);
    }
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut correct, mut curve) = (0, Vec::new());
    for (n, (_, is_correct)) in scored.iter().enumerate() {
        correct += usize::from(*is_correct);
        curve.push((correct as f64 / n_evaluated as f64, correct as f64 / (n + 1) as f64));
    }
    // Interpolated precision: the maximum precision at this or a higher recall.
    let mut best = 0.0_f64;
    for (_, precision) in curve.iter_mut().rev() {
        best = best.max(*precision);
        *precision = best;
    }
    let at = |level: u32| {
        // pycocotools rounds recall like this.
        let recall = f64::from(level) * 0.01;
        let first = curve.partition_point(|(r, _)| *r < recall);
        curve.get(first).map_or(0.0, |(_, precision)| *precision)
    };
    Some((0..=100).map(at).sum::<f64>() / 101.0)
}

fn match_detections(
    image: &EvaluatedImage,
    label: u8,
    iou_threshold: f64,
    areas: &AreaRange,
    scored: &mut Vec<(f32, bool)>,
) {
    let is_ignored = |t: usize| !areas.contains(&image.truths[t].area);
    // Ignored instances come last, so that evaluated ones match first.
    let mut truths: Vec<usize> =
        (0..image.truths.len()).filter(|t| image.truths[*t].label == label).collect();
    truths.sort_by_key(|t| is_ignored(*t));
    let mut is_matched = vec![false; image.truths.len()];
    let mut detections: Vec<&ScoredDetection> =
        image.detections.iter().filter(|d| d.label == label).collect();
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    for detection in detections.into_iter().take(MAX_DETECTIONS) {
        let (mut best, mut best_iou) = (None, iou_threshold);
        for &t in truths.iter().filter(|t| !is_matched[**t]) {
            // A match with an evaluated instance is never replaced by one with an ignored instance.
            if best.is_some_and(|b: usize| !is_ignored(b)) && is_ignored(t) {
                break;
            }
            let shared = detection.intersections[t];
            let union = (detection.area + image.truths[t].area - shared).max(1);
            let iou = f64::from(shared) / f64::from(union);
            if iou >= best_iou {
                (best, best_iou) = (Some(t), iou);
            }
        }
        best.into_iter().for_each(|t| is_matched[t] = true);
        let counts = best.map_or_else(|| areas.contains(&detection.area), |t| !is_ignored(t));
        if counts {
            scored.push((detection.score, best.is_some()));
        }
    }
}

/// Average precision of a detector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AveragePrecision {
    /// Mean over classes at IoU 0.5; `None` without evaluated instances.
    pub map50: Option<f64>,
    /// Mean over classes and [`IOU_THRESHOLDS`]; `None` without evaluated instances.
    pub map: Option<f64>,
    /// By label: average precision at IoU 0.5, mean over all thresholds, and the number of
    /// evaluated instances.
    pub classes: BTreeMap<u8, (f64, f64, usize)>,
}

/// Computes average precision over all classes with evaluated instances.
pub fn average_precision(images: &[EvaluatedImage], areas: &AreaRange) -> AveragePrecision {
    let mut n_evaluated = BTreeMap::new();
    for truth in images.iter().flat_map(|i| &i.truths).filter(|t| areas.contains(&t.area)) {
        *n_evaluated.entry(truth.label).or_insert(0) += 1;
    }
    let evaluate = |(label, n): (u8, usize)| {
        let at = |iou_threshold: &f64| class_precision(images, label, *iou_threshold, areas);
        let all: Vec<f64> = IOU_THRESHOLDS.iter().filter_map(at).collect();
        (label, (all[0], all.iter().sum::<f64>() / all.len() as f64, n))
    };
    let classes: BTreeMap<u8, (f64, f64, usize)> = n_evaluated.into_iter().map(evaluate).collect();
    let of_classes = |of: fn(&(f64, f64, usize)) -> f64| mean(classes.values().map(of));
    AveragePrecision { map50: of_classes(|c| c.0), map: of_classes(|c| c.1), classes }
}

/// Returns the mean of values; `None` if there are none.
pub(crate) fn mean(values: impl ExactSizeIterator<Item = f64>) -> Option<f64> {
    let n = values.len();
    (n > 0).then(|| values.sum::<f64>() / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: AreaRange = 0..=u32::MAX;

    fn truth(label: u8, area: u32) -> GroundTruthInstance {
        GroundTruthInstance { label, area }
    }

    fn detection(label: u8, score: f32, area: u32, shared: &[u32]) -> ScoredDetection {
        ScoredDetection { label, score, area, intersections: shared.to_vec() }
    }

    #[test]
    fn a_perfect_detector_scores_one_and_an_empty_one_zero() {
        let truths = vec![truth(1, 100), truth(2, 50)];
        let found = vec![detection(1, 0.9, 100, &[100, 0]), detection(2, 0.4, 50, &[0, 50])];
        let image = EvaluatedImage { truths: truths.clone(), detections: found };
        let perfect = average_precision(&[image], &ALL);
        assert_eq!((perfect.map50, perfect.map), (Some(1.0), Some(1.0)));
        let blind = average_precision(&[EvaluatedImage { truths, detections: Vec::new() }], &ALL);
        assert_eq!((blind.map50, blind.map), (Some(0.0), Some(0.0)));
    }

    /// Detections are correct, wrong, correct among three instances: precision is 1 up to recall
    /// 1/3 and 2/3 up to recall 2/3.
    #[test]
    fn precision_is_averaged_over_recall() {
        let detections = vec![
            detection(1, 0.9, 100, &[80, 0, 0]),
            detection(1, 0.8, 100, &[0, 10, 0]),
            detection(1, 0.7, 100, &[0, 0, 100]),
        ];
        let image = EvaluatedImage { truths: vec![truth(1, 100); 3], detections };
        let expected = (34.0 + 33.0 * 2.0 / 3.0) / 101.0;
        let found = average_precision(std::slice::from_ref(&image), &ALL);
        assert!((found.map50.unwrap() - expected).abs() < 1e-12, "{found:?}");
        // 80 shared pixels of 120 in the union: IoU 2/3.
        assert!(class_precision(&[image], 1, 0.7, &ALL).unwrap() < expected);
    }

    #[test]
    fn instances_outside_the_area_range_are_ignored() {
        let image = EvaluatedImage {
            truths: vec![truth(1, 100), truth(1, 20)],
            detections: vec![
                detection(1, 0.9, 20, &[0, 20]),
                detection(1, 0.8, 30, &[0, 0]),
                detection(1, 0.5, 100, &[100, 0]),
            ],
        };
        let large = average_precision(std::slice::from_ref(&image), &(50..=u32::MAX));
        assert_eq!(large.map50, Some(1.0));
        let with_small = average_precision(std::slice::from_ref(&image), &ALL).map50.unwrap();
        assert!(with_small < 0.9, "one of three is wrong: {with_small}");
        // No instance is that large, so the mean is undefined.
        let none = average_precision(&[image], &(500..=u32::MAX));
        assert_eq!(none, AveragePrecision::default());
        assert_eq!((none.map50, none.map), (None, None));
    }
}
