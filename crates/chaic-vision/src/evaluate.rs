//! How good a detector is on views that nothing was learned from.

use std::thread;

use chaic_nn::simd::widest;
use chaic_nn::{Inference, Shape};
use chaic_protocol::geom::Camera;

use crate::average_precision::{AveragePrecision, Detection, Image, Truth, average_precision};
use crate::detector::Detector;
use crate::features::{Crop, N_FEATURES, features};
use crate::instances::{Instance, InstanceRules, Pixels};
use crate::labels::BACKGROUND;
use crate::views::{LabelledView, Part, ViewRules, Views};

/// Instances that fewer pixels show are neither asked for nor wrong to find.
pub const LEAST_PX: u32 = 100;

/// What a detector sees in a view.
pub fn detect(
    detector: &Detector,
    numbers: &[f32],
    view: &LabelledView,
    inference: &mut Inference,
) -> Vec<Instance> {
    detect_in(detector, numbers, (&view.rgb, &view.depth_m, &view.camera), inference)
}

/// What a detector sees in an image: color (u8, shape [height, width, 3]), depth (metres, shape
/// [height, width]) and the camera.
///
/// # Panics
/// If shapes don't fit, or the image's sides are no multiples of the network's stride.
pub fn detect_in(
    detector: &Detector,
    numbers: &[f32],
    (rgb, depth_m, camera): (&[u8], &[f32], &Camera),
    inference: &mut Inference,
) -> Vec<Instance> {
    let crop = Crop::whole(camera);
    let [width, height] = crop.size;
    let shape = Shape { n: 1, height, width, channels: N_FEATURES };
    features(rgb, depth_m, camera, crop, inference.input(shape));
    let mut pixels = Pixels::new(camera);
    inference.run(&detector.network, numbers, |_, row, strip| pixels.read(row, strip, depth_m));
    pixels.instances(depth_m, &InstanceRules::default())
}

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
    detector: &Detector,
    numbers: &[f32],
    rules: ViewRules,
    n_views: usize,
    n_threads: usize,
) -> AveragePrecision {
    let one = |k: usize, inference: &mut Inference| {
        let view = Views::new(Part::Validation, rules, 1, k as u64).draw();
        let found = detect(detector, numbers, &view, inference);
        compare(&view, &found, LEAST_PX)
    };
    let some = |thread: usize| -> Vec<Image> {
        let mut inference = Inference::new(&detector.network, widest());
        (thread..n_views).step_by(n_threads).map(|k| one(k, &mut inference)).collect()
    };
    let some = &some;
    let parts: Vec<Vec<Image>> = thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads).map(|t| scope.spawn(move || some(t))).collect();
        workers.into_iter().map(|w| w.join().expect("it doesn't panic")).collect()
    });
    // In the order of views, whatever the number of threads.
    let in_order = |k: usize| parts[k % n_threads][k / n_threads].clone();
    let images: Vec<Image> = (0..n_views).map(in_order).collect();
    average_precision(&images)
}
