//! Breakdown of detection errors by cause, similar to TIDE (Bolya et al. 2020).

use serde::Serialize;

use crate::average_precision::{AreaRange, EvaluatedImage, GroundTruthInstance, ScoredDetection};

/// Minimum score of an evaluated detection.
pub const REPORT_SCORE: f32 = 0.5;
/// Minimum IoU of a correct mask.
const FOREGROUND_IOU: f64 = 0.5;
/// Minimum IoU at which a detection of the same class belongs to an instance, as a poor or merged
/// mask.
const BACKGROUND_IOU: f64 = 0.1;

/// Number of evaluated instances and detections by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ErrorBreakdown {
    /// Instances that were detected.
    #[serde(rename = "found")]
    pub detected: u32,
    /// Instances with a detection of their class whose mask is poor.
    pub poor_mask: u32,
    /// Instances that were detected as another class.
    pub wrong_class: u32,
    /// Instances whose best detection also covers more than half of another instance of their
    /// class.
    pub merged: u32,
    /// Instances that no detection covers well enough for another outcome.
    pub missed: u32,
    /// Further detections: more than half of their pixels lie on an instance of their class.
    #[serde(rename = "split")]
    pub duplicate: u32,
    /// Detections of which at most half of the pixels lie on an instance of their class.
    #[serde(rename = "nothing_there")]
    pub background: u32,
}

fn overlap(truth: &GroundTruthInstance, detection: &ScoredDetection, shared: u32) -> f64 {
    f64::from(shared) / f64::from((truth.area + detection.area - shared).max(1))
}

impl ErrorBreakdown {
    /// Counts the outcomes over all images; `areas` is the range of evaluated areas, pixels.
    pub fn new(images: &[EvaluatedImage], areas: &AreaRange) -> ErrorBreakdown {
        let mut sum = ErrorBreakdown::default();
        images.iter().for_each(|image| sum.add(image, areas));
        sum
    }

    fn add(&mut self, image: &EvaluatedImage, areas: &AreaRange) {
        let reported: Vec<&ScoredDetection> =
            image.detections.iter().filter(|d| d.score >= REPORT_SCORE).collect();
        let mut is_used = vec![false; reported.len()];
        for (t, truth) in image.truths.iter().enumerate() {
            let is_evaluated = areas.contains(&truth.area);
            let best = |same_class: bool| {
                let fits =
                    |d: &&(usize, &&ScoredDetection)| (d.1.label == truth.label) == same_class;
                let all = reported.iter().enumerate();
                let with = all
                    .filter(|d| fits(&d))
                    .map(|(k, d)| (overlap(truth, d, d.intersections[t]), k));
                with.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
            };
            let (same, other) = (best(true), best(false));
            if let Some((_, k)) = same.filter(|(o, _)| *o >= FOREGROUND_IOU) {
                is_used[k] = true;
                self.detected += u32::from(is_evaluated);
                continue;
            }
            if !is_evaluated {
                continue;
            }
            let covers_another = |k: usize| {
                let other_truths = image.truths.iter().enumerate().filter(|(o, _)| *o != t);
                let mut other_truths = other_truths.filter(|(_, other)| other.label == truth.label);
                other_truths.any(|(o, other)| 2 * reported[k].intersections[o] > other.area)
            };
            let (cause, detection_index) = match (same, other) {
                (Some((o, k)), _) if o >= BACKGROUND_IOU && covers_another(k) => {
                    (&mut self.merged, Some(k))
                }
                (Some((o, k)), _) if o >= BACKGROUND_IOU => (&mut self.poor_mask, Some(k)),
                (_, Some((o, k))) if o >= FOREGROUND_IOU => (&mut self.wrong_class, Some(k)),
                _ => (&mut self.missed, None),
            };
            *cause += 1;
            detection_index.into_iter().for_each(|k| is_used[k] = true);
        }
        let unused =
            reported.iter().zip(is_used).filter(|(d, is_used)| !is_used && areas.contains(&d.area));
        for (detection, _) in unused {
            let mut same = image.truths.iter().zip(&detection.intersections);
            let covers_detection = |(truth, shared): (&GroundTruthInstance, &u32)| {
                truth.label == detection.label && 2 * shared > detection.area
            };
            match same.any(covers_detection) {
                true => self.duplicate += 1,
                false => self.background += 1,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_error_has_its_cause() {
        let truth = |label| GroundTruthInstance { label, area: 100 };
        let detection = |label, area, shared: &[u32]| ScoredDetection {
            label,
            score: 0.9,
            area,
            intersections: shared.to_vec(),
        };
        // Detected, poor mask, wrong class, two merged, missed.
        let truths = vec![truth(1), truth(2), truth(3), truth(4), truth(4), truth(5)];
        let detections = vec![
            detection(1, 100, &[90, 0, 0, 0, 0, 0]),
            detection(1, 8, &[8, 0, 0, 0, 0, 0]),
            detection(2, 40, &[0, 40, 0, 0, 0, 0]),
            detection(9, 100, &[0, 0, 100, 0, 0, 0]),
            detection(4, 300, &[0, 0, 0, 100, 100, 0]),
            detection(7, 50, &[0; 6]),
        ];
        let expected = ErrorBreakdown {
            detected: 1,
            poor_mask: 1,
            wrong_class: 1,
            merged: 2,
            missed: 1,
            duplicate: 1,
            background: 1,
        };
        let found = ErrorBreakdown::new(&[EvaluatedImage { truths, detections }], &(5..=u32::MAX));
        assert_eq!(found, expected);
    }
}
