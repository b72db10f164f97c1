//! What goes wrong in a detector, by cause.

use serde::Serialize;

use crate::average_precision::{Areas, Detection, Image, Truth};

/// A detection counts as told from this score on.
pub const TOLD_SCORE: f32 = 0.5;
/// Masks that share less than this of their union are poor.
const GOOD_OVERLAP: f64 = 0.5;
/// Masks that share less than this of their union have nothing to do with each other.
const SOME_OVERLAP: f64 = 0.1;

/// How many instances that are asked for were found, or why not; and what else was told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Failures {
    /// Asked for, and found.
    pub found: u32,
    /// Asked for; something of its class is there, but its mask is poor.
    pub poor_mask: u32,
    /// Asked for; found as something of another class.
    pub wrong_class: u32,
    /// Asked for; one detection covers it with another thing of its class.
    pub merged: u32,
    /// Asked for; nothing was told there.
    pub missed: u32,
    /// Told; a piece of a thing that was found otherwise.
    pub split: u32,
    /// Told; nothing of the kind is there.
    pub nothing_there: u32,
}

fn overlap(truth: &Truth, detection: &Detection, shared: u32) -> f64 {
    f64::from(shared) / f64::from((truth.area + detection.area - shared).max(1))
}

impl Failures {
    /// Of all images; what has so many pixels is asked for.
    pub fn of(images: &[Image], areas: &Areas) -> Failures {
        let mut sum = Failures::default();
        images.iter().for_each(|image| sum.add(image, areas));
        sum
    }

    fn add(&mut self, image: &Image, areas: &Areas) {
        let told: Vec<&Detection> =
            image.detections.iter().filter(|d| d.score >= TOLD_SCORE).collect();
        let mut is_used = vec![false; told.len()];
        for (t, truth) in image.truths.iter().enumerate() {
            let is_asked = areas.contains(&truth.area);
            let best = |of_class: bool| {
                let fits = |d: &&(usize, &&Detection)| (d.1.label == truth.label) == of_class;
                let all = told.iter().enumerate();
                let with =
                    all.filter(|d| fits(&d)).map(|(k, d)| (overlap(truth, d, d.shared[t]), k));
                with.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
            };
            let (same, other) = (best(true), best(false));
            if let Some((_, k)) = same.filter(|(o, _)| *o >= GOOD_OVERLAP) {
                is_used[k] = true;
                self.found += u32::from(is_asked);
                continue;
            }
            if !is_asked {
                continue;
            }
            let covers_another = |k: usize| {
                let others = image.truths.iter().enumerate().filter(|(o, _)| *o != t);
                let mut others = others.filter(|(_, other)| other.label == truth.label);
                others.any(|(o, other)| 2 * told[k].shared[o] > other.area)
            };
            let (cause, by) = match (same, other) {
                (Some((o, k)), _) if o >= SOME_OVERLAP && covers_another(k) => {
                    (&mut self.merged, Some(k))
                }
                (Some((o, k)), _) if o >= SOME_OVERLAP => (&mut self.poor_mask, Some(k)),
                (_, Some((o, k))) if o >= GOOD_OVERLAP => (&mut self.wrong_class, Some(k)),
                _ => (&mut self.missed, None),
            };
            *cause += 1;
            by.into_iter().for_each(|k| is_used[k] = true);
        }
        let unused =
            told.iter().zip(is_used).filter(|(d, is_used)| !is_used && areas.contains(&d.area));
        for (detection, _) in unused {
            let mut same = image.truths.iter().zip(&detection.shared);
            let of_its_class = |(truth, shared): (&Truth, &u32)| {
                truth.label == detection.label && 2 * shared > detection.area
            };
            match same.any(of_its_class) {
                true => self.split += 1,
                false => self.nothing_there += 1,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_failure_has_its_cause() {
        let truth = |label| Truth { label, area: 100 };
        let detection = |label, area, shared: &[u32]| Detection {
            label,
            score: 0.9,
            area,
            shared: shared.to_vec(),
        };
        // Found, with a poor mask, as another class, merged with its like, missed.
        let truths = vec![truth(1), truth(2), truth(3), truth(4), truth(4), truth(5)];
        let detections = vec![
            detection(1, 100, &[90, 0, 0, 0, 0, 0]),
            detection(1, 8, &[8, 0, 0, 0, 0, 0]),
            detection(2, 40, &[0, 40, 0, 0, 0, 0]),
            detection(9, 100, &[0, 0, 100, 0, 0, 0]),
            detection(4, 300, &[0, 0, 0, 100, 100, 0]),
            detection(7, 50, &[0; 6]),
        ];
        let expected = Failures {
            found: 1,
            poor_mask: 1,
            wrong_class: 1,
            merged: 2,
            missed: 1,
            split: 1,
            nothing_there: 1,
        };
        let found = Failures::of(&[Image { truths, detections }], &(5..=u32::MAX));
        assert_eq!(found, expected);
    }
}
