//! Average precision by the COCO definition: detections of a class are matched, surest first, to the
//! instances that they overlap most; precision is averaged over 101 levels of recall. The numbers are
//! those of pycocotools (`benches/pycocotools`).

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Overlaps from which a detection counts as right: 0.5 to 0.95.
pub const OVERLAPS: [f64; 10] = [0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95];
/// At most so many detections of an image count, surest first.
pub const MOST_DETECTIONS: usize = 100;

/// An instance that is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Its label.
    pub label: u8,
    /// How many pixels show it.
    pub area: u32,
}

/// Pixels of what is asked for. What has more or fewer is neither asked for nor wrong to find.
pub type Areas = RangeInclusive<u32>;

/// A detection in an image, with how it overlaps what is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Its label.
    pub label: u8,
    /// How sure it is.
    pub score: f32,
    /// How many pixels it has.
    pub area: u32,
    /// Pixels that it shares with each [`Truth`], in their order.
    pub shared: Vec<u32>,
}

/// One image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// What is there.
    pub truths: Vec<Truth>,
    /// What was found.
    pub detections: Vec<Detection>,
}

/// Average precision of one class at one overlap; `None` if nothing of it is asked for.
fn of_class(images: &[Image], label: u8, overlap: f64, areas: &Areas) -> Option<f64> {
    let of_it = images.iter().flat_map(|i| &i.truths).filter(|t| t.label == label);
    let n_asked = of_it.filter(|t| areas.contains(&t.area)).count();
    if n_asked == 0 {
        return None;
    }
    // Score, and whether it is right, of detections that count.
    let mut judged: Vec<(f32, bool)> = Vec::new();
    for image in images {
        judge(image, label, overlap, areas, &mut judged);
    }
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut right, mut curve) = (0, Vec::new());
    for (n, (_, is_right)) in judged.iter().enumerate() {
        right += usize::from(*is_right);
        curve.push((right as f64 / n_asked as f64, right as f64 / (n + 1) as f64));
    }
    // The best precision at this recall or more.
    let mut best = 0.0_f64;
    for (_, precision) in curve.iter_mut().rev() {
        best = best.max(*precision);
        *precision = best;
    }
    let at = |level: u32| {
        // As pycocotools rounds it.
        let recall = f64::from(level) * 0.01;
        let first = curve.partition_point(|(r, _)| *r < recall);
        curve.get(first).map_or(0.0, |(_, precision)| *precision)
    };
    Some((0..=100).map(at).sum::<f64>() / 101.0)
}

fn judge(image: &Image, label: u8, overlap: f64, areas: &Areas, judged: &mut Vec<(f32, bool)>) {
    let is_ignored = |t: usize| !areas.contains(&image.truths[t].area);
    // What is ignored comes last, so that something else is matched first.
    let mut truths: Vec<usize> =
        (0..image.truths.len()).filter(|t| image.truths[*t].label == label).collect();
    truths.sort_by_key(|t| is_ignored(*t));
    let mut is_taken = vec![false; image.truths.len()];
    let mut detections: Vec<&Detection> =
        image.detections.iter().filter(|d| d.label == label).collect();
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    for detection in detections.into_iter().take(MOST_DETECTIONS) {
        let (mut best, mut most) = (None, overlap);
        for &t in truths.iter().filter(|t| !is_taken[**t]) {
            // Once something asked for fits, nothing that is ignored is looked at.
            if best.is_some_and(|b: usize| !is_ignored(b)) && is_ignored(t) {
                break;
            }
            let shared = detection.shared[t];
            let all = (detection.area + image.truths[t].area - shared).max(1);
            let of_all = f64::from(shared) / f64::from(all);
            if of_all >= most {
                (best, most) = (Some(t), of_all);
            }
        }
        best.into_iter().for_each(|t| is_taken[t] = true);
        let counts = best.map_or_else(|| areas.contains(&detection.area), |t| !is_ignored(t));
        if counts {
            judged.push((detection.score, best.is_some()));
        }
    }
}

/// What a detector reaches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AveragePrecision {
    /// At an overlap of one half, mean over classes.
    pub map50: f64,
    /// Mean over [`OVERLAPS`] and classes.
    pub map: f64,
    /// By label: at one half, over all overlaps, and how many instances were asked for.
    pub classes: BTreeMap<u8, (f64, f64, usize)>,
}

/// Over all classes of which something is asked for.
pub fn average_precision(images: &[Image], areas: &Areas) -> AveragePrecision {
    let mut n_asked = BTreeMap::new();
    for truth in images.iter().flat_map(|i| &i.truths).filter(|t| areas.contains(&t.area)) {
        *n_asked.entry(truth.label).or_insert(0) += 1;
    }
    let of_label = |(label, n): (u8, usize)| {
        let at = |overlap: &f64| of_class(images, label, *overlap, areas);
        let all: Vec<f64> = OVERLAPS.iter().filter_map(at).collect();
        (label, (all[0], all.iter().sum::<f64>() / all.len() as f64, n))
    };
    let classes: BTreeMap<u8, (f64, f64, usize)> = n_asked.into_iter().map(of_label).collect();
    let mean = |of: fn(&(f64, f64, usize)) -> f64| {
        classes.values().map(of).sum::<f64>() / classes.len().max(1) as f64
    };
    AveragePrecision { map50: mean(|c| c.0), map: mean(|c| c.1), classes }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Areas = 0..=u32::MAX;

    fn truth(label: u8, area: u32) -> Truth {
        Truth { label, area }
    }

    fn detection(label: u8, score: f32, area: u32, shared: &[u32]) -> Detection {
        Detection { label, score, area, shared: shared.to_vec() }
    }

    #[test]
    fn a_perfect_detector_gets_one_and_a_blind_one_nothing() {
        let truths = vec![truth(1, 100), truth(2, 50)];
        let found = vec![detection(1, 0.9, 100, &[100, 0]), detection(2, 0.4, 50, &[0, 50])];
        let image = Image { truths: truths.clone(), detections: found };
        let perfect = average_precision(&[image], &ALL);
        assert_eq!((perfect.map50, perfect.map), (1.0, 1.0));
        let blind = average_precision(&[Image { truths, detections: Vec::new() }], &ALL);
        assert_eq!((blind.map50, blind.map), (0.0, 0.0));
    }

    /// Right, wrong, right among three: precision 1 up to a third, two thirds up to two thirds.
    #[test]
    fn precision_is_averaged_over_recall() {
        let detections = vec![
            detection(1, 0.9, 100, &[80, 0, 0]),
            detection(1, 0.8, 100, &[0, 10, 0]),
            detection(1, 0.7, 100, &[0, 0, 100]),
        ];
        let image = Image { truths: vec![truth(1, 100); 3], detections };
        let expected = (34.0 + 33.0 * 2.0 / 3.0) / 101.0;
        let found = average_precision(std::slice::from_ref(&image), &ALL);
        assert!((found.map50 - expected).abs() < 1e-12, "{found:?}");
        // Eighty of a hundred and twenty overlap by two thirds.
        assert!(of_class(&[image], 1, 0.7, &ALL).unwrap() < expected);
    }

    #[test]
    fn what_is_too_small_is_neither_right_nor_wrong() {
        let image = Image {
            truths: vec![truth(1, 100), truth(1, 20)],
            detections: vec![
                detection(1, 0.9, 20, &[0, 20]),
                detection(1, 0.8, 30, &[0, 0]),
                detection(1, 0.5, 100, &[100, 0]),
            ],
        };
        assert_eq!(average_precision(std::slice::from_ref(&image), &(50..=u32::MAX)).map50, 1.0);
        let with_small = average_precision(std::slice::from_ref(&image), &ALL).map50;
        assert!(with_small < 0.9, "one of three is wrong: {with_small}");
        // Nothing as large is there.
        assert_eq!(average_precision(&[image], &(500..=u32::MAX)).classes.len(), 0);
    }
}
