//! How good a detector is on views that nothing was learned from.

use std::collections::BTreeMap;
use std::thread;

use chaic_nn::Inference;
use chaic_nn::simd::widest;
use serde::Serialize;

use crate::average_precision::{AveragePrecision, Detection, Image, Truth, average_precision};
use crate::calibration::{Calibration, Sample, calibration_error, predictors};
use crate::failures::Failures;
use crate::instances::Instance;
use crate::labels::{BACKGROUND, class_of};
use crate::trained::TrainedDetector;
use crate::views::{LabelledView, Part, ViewRules, Views};

/// Instances that fewer pixels show are neither asked for nor wrong to find.
pub const LEAST_PX: u32 = 100;

/// What is in a view beside what was seen in it.
pub fn compare(view: &LabelledView, found: &[Instance], least_px: u32) -> Image {
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
    let truth = |id: &usize| Truth {
        label: view.labels[*id],
        area: areas[*id],
        is_ignored: areas[*id] < least_px,
    };
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

/// Average precision on the first so many views of the validation part.
pub fn evaluate(
    detector: &TrainedDetector,
    rules: ViewRules,
    n_views: usize,
    n_threads: usize,
) -> AveragePrecision {
    let one = |view: &LabelledView, found: &[Instance]| compare(view, found, LEAST_PX);
    average_precision(&look(detector, (Part::Validation, rules), n_views, n_threads, one))
}

/// A calibration by what the detector sees in the first so many views of the training part, drawn by
/// these rules: those that a helper has, [`ViewRules::NATURAL`].
pub fn calibrate(
    detector: &TrainedDetector,
    rules: ViewRules,
    n_views: usize,
    n_threads: usize,
) -> Calibration {
    let views = (Part::Training, rules);
    let samples = look(detector, views, n_views, n_threads, samples);
    Calibration::fit(&samples.concat())
}

/// What is known of each detection, and whether it is right.
pub fn samples(view: &LabelledView, found: &[Instance]) -> Vec<Sample> {
    let image = compare(view, found, 0);
    let is_right = |detection: &Detection| {
        image.truths.iter().zip(&detection.shared).any(|(truth, shared)| {
            truth.label == detection.label && 3 * shared >= truth.area + detection.area
        })
    };
    let found = found.iter().zip(&image.detections);
    found.map(|(f, d)| Sample { predictors: predictors(f), is_right: is_right(d) }).collect()
}

/// What comes of each of the first so many views, in their order, whatever the number of threads.
fn look<T: Clone + Send>(
    detector: &TrainedDetector,
    (part, rules): (Part, ViewRules),
    n_views: usize,
    n_threads: usize,
    one: impl Fn(&LabelledView, &[Instance]) -> T + Sync,
) -> Vec<T> {
    let some = |thread: usize| -> Vec<T> {
        let mut inference = Inference::new(&detector.detector.network, widest());
        let mut one = |k: usize| {
            let view = Views::new(part, rules, 1, k as u64).draw();
            let image = (&view.rgb[..], &view.depth_m[..], &view.camera);
            one(&view, &detector.detect(image, &mut inference))
        };
        (thread..n_views).step_by(n_threads).map(&mut one).collect()
    };
    let some = &some;
    let parts: Vec<Vec<T>> = thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads).map(|t| scope.spawn(move || some(t))).collect();
        workers.into_iter().map(|w| w.join().expect("it doesn't panic")).collect()
    });
    (0..n_views).map(|k| parts[k % n_threads][k / n_threads].clone()).collect()
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
    /// How far scores are from the share of detections that are right.
    pub calibration_error: f64,
    /// What goes wrong, and how often.
    pub failures: Failures,
    /// By class: average precision at one half, over all overlaps, and how many instances there are.
    pub classes: BTreeMap<&'static str, (f64, f64, usize)>,
}

/// Smaller instances that are reported beside, pixels.
const SMALLER_PX: [u32; 2] = [64, 32];

/// How good a detector is on the first so many views.
pub fn report(
    detector: &TrainedDetector,
    views: (Part, ViewRules),
    n_views: usize,
    n_threads: usize,
) -> DetectionReport {
    let one = |view: &LabelledView, found: &[Instance]| {
        let images = [LEAST_PX, SMALLER_PX[0], SMALLER_PX[1]].map(|px| compare(view, found, px));
        let right = samples(view, found).into_iter().map(|s| s.is_right);
        let said: Vec<(f32, bool)> = found.iter().map(|f| f.score).zip(right).collect();
        (images, said)
    };
    let seen = look(detector, views, n_views, n_threads, one);
    let (images, said): (Vec<_>, Vec<_>) = seen.into_iter().unzip();
    let of = |k: usize| images.iter().map(|i| i[k].clone()).collect::<Vec<Image>>();
    let all = of(0);
    let found = average_precision(&all);
    let smaller = SMALLER_PX.iter().zip([of(1), of(2)]).map(|(px, images)| {
        let found = average_precision(&images);
        (*px, [found.map50, found.map])
    });
    let name = |label: u8| class_of(label).map_or("", |class| class.name());
    DetectionReport {
        views: n_views,
        map50: found.map50,
        map: found.map,
        smaller: smaller.collect(),
        calibration_error: calibration_error(&said.concat()),
        failures: Failures::of(&all),
        classes: found.classes.iter().map(|(label, c)| (name(*label), *c)).collect(),
    }
}
