//! How good a detector is on views that nothing was learned from.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use crate::average_precision::{
    Areas, AveragePrecision, Detection, Image, Truth, average_precision,
};
use crate::calibration::{Calibration, Sample, calibration_error, predictors};
use crate::failures::Failures;
use crate::instances::Instance;
use crate::labels::{BACKGROUND, class_of};
use crate::noisy::FaultRates;
use crate::parallel::in_order;
use crate::trained::TrainedDetector;
use crate::views::{LabelledView, Part, ViewRules, Views};

/// Instances that fewer pixels show are neither asked for nor wrong to find.
pub const LEAST_PX: u32 = 100;
const ASKED: Areas = LEAST_PX..=u32::MAX;

/// What is in a view beside what was seen in it.
pub fn compare(view: &LabelledView, found: &[Instance]) -> Image {
    let mut areas = vec![0u32; view.labels.len()];
    for id in &view.ids {
        if let Some(area) = areas.get_mut(usize::from(*id)) {
            *area += 1;
        }
    }
    let there: Vec<usize> =
        (0..areas.len()).filter(|id| areas[*id] > 0 && view.labels[*id] != BACKGROUND).collect();
    let mut index = vec![usize::MAX; areas.len()];
    there.iter().enumerate().for_each(|(k, id)| index[*id] = k);
    let truth = |id: &usize| Truth { label: view.labels[*id], area: areas[*id] };
    let detection = |instance: &Instance| {
        let mut shared = vec![0; there.len()];
        for k in &instance.pixels {
            let id = usize::from(view.ids[*k as usize]);
            if let Some(n) = index.get(id).and_then(|k| shared.get_mut(*k)) {
                *n += 1;
            }
        }
        let area = instance.pixels.len() as u32;
        Detection { label: instance.label, score: instance.score, area, shared }
    };
    Image {
        truths: there.iter().map(truth).collect(),
        detections: found.iter().map(detection).collect(),
    }
}

/// Returns the average precision on the first views of the validation part; `None` if `stop` is raised meanwhile.
pub fn evaluate(
    detector: &TrainedDetector,
    rules: ViewRules,
    n_views: usize,
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<AveragePrecision> {
    let views = (Part::Validation, rules);
    let images =
        look(detector, views, n_views, n_threads, stop, |_, view, found| compare(view, found))?;
    Some(average_precision(&images, &ASKED))
}

/// A calibration by what the detector sees in the first so many views of the training part, drawn by
/// these rules: those that a helper has, [`ViewRules::NATURAL`]. Returns `None` if `stop` is raised meanwhile.
pub fn calibrate(
    detector: &TrainedDetector,
    rules: ViewRules,
    n_views: usize,
    n_threads: usize,
    stop: &AtomicBool,
) -> Option<Calibration> {
    let views = (Part::Training, rules);
    let of_view =
        |_, view: &LabelledView, found: &[Instance]| samples(found, &compare(view, found));
    let samples = look(detector, views, n_views, n_threads, stop, of_view)?;
    Some(Calibration::fit(&samples.concat()))
}

/// What is known of each detection, and whether it is right.
fn samples(found: &[Instance], image: &Image) -> Vec<Sample> {
    let is_right = |detection: &Detection| {
        image.truths.iter().zip(&detection.shared).any(|(truth, shared)| {
            truth.label == detection.label && 3 * shared >= truth.area + detection.area
        })
    };
    let found = found.iter().zip(&image.detections);
    found.map(|(f, d)| Sample { predictors: predictors(f), is_right: is_right(d) }).collect()
}

/// What comes of each of the first so many views, in their order, whatever the number of threads; `None` if `stop`
/// is raised meanwhile.
fn look<T: Send>(
    detector: &TrainedDetector,
    (part, rules): (Part, ViewRules),
    n_views: usize,
    n_threads: usize,
    stop: &AtomicBool,
    one: impl Fn(usize, &LabelledView, &[Instance]) -> T + Sync + Send,
) -> Option<Vec<T>> {
    in_order(
        0..n_views,
        n_threads,
        stop,
        || detector.inference(),
        |inference, k| {
            let view = Views::new(part, rules, 1, k as u64).draw();
            let image = (&view.rgb[..], &view.depth_m[..], &view.camera);
            one(k, &view, &detector.detect(image, inference))
        },
    )
}

/// How good a detector is, as a JSON file has it.
#[derive(Clone, Debug, Serialize)]
pub struct DetectionReport {
    /// Views that were looked at.
    pub views: usize,
    /// Mean average precision at an overlap of one half, of instances of [`LEAST_PX`] pixels and more.
    pub map50: f64,
    /// The same over overlaps from 0.5 to 0.95.
    pub map: f64,
    /// Both with smaller instances, by their least number of pixels.
    pub smaller: BTreeMap<u32, [f64; 2]>,
    /// Both for instances of some sizes alone.
    pub sizes: BTreeMap<&'static str, [f64; 2]>,
    /// `map50` over the classes of which there are at least [`ENOUGH`] instances, and how many these are.
    pub map50_of_frequent: (f64, usize),
    /// How far scores are from the share of detections that are right.
    pub calibration_error: f64,
    /// What goes wrong, and how often.
    pub failures: Failures,
    /// The same as ground truth is degraded by it.
    pub fault_rates: FaultRates,
    /// By class: average precision at one half, over all overlaps, and how many instances there are.
    pub classes: BTreeMap<&'static str, (f64, f64, usize)>,
}

/// Smaller instances that are reported beside, pixels.
const SMALLER_PX: [u32; 2] = [64, 32];
/// Sizes by COCO's names, from [`LEAST_PX`] on.
const SIZES: [(&str, Areas); 3] = [
    ("small", LEAST_PX..=32 * 32),
    ("medium", 32 * 32 + 1..=96 * 96),
    ("large", 96 * 96 + 1..=u32::MAX),
];
/// The average precision of a class of which there are fewer instances says little.
pub const ENOUGH: usize = 50;

/// How good a detector is on the first so many views, and what `also` makes of each of them, by its
/// number, and of what was found in it.
pub fn report<A: Send>(
    detector: &TrainedDetector,
    views: (Part, ViewRules),
    n_views: usize,
    n_threads: usize,
    also: impl Fn(usize, &LabelledView, &[Instance]) -> A + Sync + Send,
) -> (DetectionReport, Vec<A>) {
    let one = |k: usize, view: &LabelledView, found: &[Instance]| {
        let image = compare(view, found);
        let right = samples(found, &image).into_iter().map(|s| s.is_right);
        let said: Vec<(f32, bool)> = found.iter().map(|f| f.score).zip(right).collect();
        (image, (said, also(k, view, found)))
    };
    let never = AtomicBool::new(false);
    let seen = look(detector, views, n_views, n_threads, &never, one);
    let seen = seen.expect("nobody raises the flag");
    let (images, beside): (Vec<Image>, Vec<_>) = seen.into_iter().unzip();
    let (said, also): (Vec<_>, Vec<A>) = beside.into_iter().unzip();
    let found = average_precision(&images, &ASKED);
    let of = |areas: &Areas| {
        let found = average_precision(&images, areas);
        [found.map50, found.map]
    };
    let name = |label: u8| class_of(label).map_or("", |class| class.name());
    let frequent = found.classes.values().filter(|(_, _, n)| *n >= ENOUGH);
    let frequent: Vec<f64> = frequent.map(|(ap50, _, _)| *ap50).collect();
    let n_frequent = frequent.len();
    let report = DetectionReport {
        views: n_views,
        map50: found.map50,
        map: found.map,
        smaller: SMALLER_PX.iter().map(|px| (*px, of(&(*px..=u32::MAX)))).collect(),
        sizes: SIZES.iter().map(|(name, areas)| (*name, of(areas))).collect(),
        map50_of_frequent: (frequent.iter().sum::<f64>() / n_frequent.max(1) as f64, n_frequent),
        calibration_error: calibration_error(&said.concat()),
        failures: Failures::of(&images, &ASKED),
        fault_rates: FaultRates::measured(&images),
        classes: found.classes.iter().map(|(label, c)| (name(*label), *c)).collect(),
    };
    (report, also)
}
