//! Evaluates the detector with parts left out or replaced by ground truth, on the views of `chaic
//! eval detection`: `cargo run --release -p chaic-vision --example ablation -- [VIEWS] [WEIGHTS]`.

use std::error::Error;
use std::fs;

use chaic_core::EntityId;
use chaic_vision::average_precision::{
    EvaluatedImage, GroundTruthInstance, ScoredDetection, average_precision,
};
use chaic_vision::calibration::Calibration;
use chaic_vision::detector::STRIDE;
use chaic_vision::evaluate::{MIN_AREA_PX, compare};
use chaic_vision::instances::{Instance, Pixels, Segment};
use chaic_vision::labels::{BACKGROUND, class_of};
use chaic_vision::perception::with_true_names;
use chaic_vision::proposals::{GROUPINGS, MAX_PROPOSALS, proposals};
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};

const VARIANTS: [&str; 7] = [
    "first stage alone, uncalibrated",
    "second stage without redrawn masks",
    "both stages",
    "both stages, one grouping of pixels",
    "both stages, ground-truth names",
    "ground-truth masks, names of the second stage",
    "best proposal of each instance, ground-truth names",
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let n_views: u64 = arguments.next().map_or(Ok(200), |n| n.parse())?;
    let both = match arguments.next() {
        Some(weights) => TrainedDetector::from_bytes(&fs::read(weights)?)?,
        None => TrainedDetector::built_in(),
    };
    let calibration = Calibration::default();
    let first = TrainedDetector { second_stage: None, calibration, ..both.clone() };
    let names_only =
        without_redrawn_masks(both.clone()).ok_or("the detector has one stage only")?;
    let [mut of_first, mut of_names_only, mut of_both] =
        [&first, &names_only, &both].map(TrainedDetector::inference);
    let mut images = VARIANTS.map(|_| Vec::new());
    for k in 0..n_views {
        let view = SyntheticViews::new(DatasetSplit::Test, ViewConfig::ALL_CLASSES, 1, k).draw();
        let LabeledView { rgb, depth_m, camera, .. } = &view;
        let pixels = both.first_stage(rgb, depth_m, camera, &mut of_both);
        names_only.first_stage(rgb, depth_m, camera, &mut of_names_only);
        let all = proposals(&pixels);
        let mut of_one_grouping = pixels.segments(&GROUPINGS[0]);
        of_one_grouping.truncate(MAX_PROPOSALS);
        of_one_grouping.iter_mut().for_each(|segment| segment.pixels.sort_unstable());
        let mut among = |proposals: &[Segment], redraws: bool| match redraws {
            true => both.instances_among(&pixels, proposals, depth_m, &mut of_both),
            false => names_only.instances_among(&pixels, proposals, depth_m, &mut of_names_only),
        };
        let found = among(&all, true);
        let class = |id: EntityId| view.labels.get(usize::from(id.0)).and_then(|l| class_of(*l));
        let evaluated = [
            compare(&view, &first.detect(rgb, depth_m, camera, &mut of_first)),
            compare(&view, &among(&all, false)),
            compare(&view, &found),
            compare(&view, &among(&of_one_grouping, true)),
            compare(&view, &with_true_names(found, &view.ids, class)),
            compare(&view, &among(&true_segments(&view, &pixels), false)),
            best_proposals(&view, &pixels, &all),
        ];
        images.iter_mut().zip(evaluated).for_each(|(images, image)| images.push(image));
    }
    println!("{n_views} views, mAP@50 and mAP of instances of at least {MIN_AREA_PX} pixels");
    for (variant, images) in VARIANTS.iter().zip(&images) {
        let found = average_precision(images, &(MIN_AREA_PX..=u32::MAX));
        let number = |x: Option<f64>| x.map_or_else(|| "/".to_owned(), |x| format!("{x:.3}"));
        println!("{variant:52} {:>5} {:>5}", number(found.map50), number(found.map));
    }
    Ok(())
}

/// Sets the predicted quality of redrawn masks to 0, so that instances keep the masks of their
/// proposals.
fn without_redrawn_masks(mut detector: TrainedDetector) -> Option<TrainedDetector> {
    let stage = detector.second_stage.as_mut()?;
    let mut parameters = stage.network.network.parameters().iter();
    let biases = parameters.find(|parameter| parameter.name == "qualities.bias")?;
    // A logit of -100 means a quality of 0.
    stage.parameters[biases.range.clone()][1] = -100.0;
    Some(detector)
}

/// Returns the visible objects at the network's resolution.
fn true_segments(view: &LabeledView, pixels: &Pixels) -> Vec<Segment> {
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let columns = width / STRIDE;
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); view.labels.len()];
    for k in 0..columns * (height / STRIDE) {
        let id = view.ids[STRIDE * (k / columns * width + k % columns)];
        members.get_mut(usize::from(id)).into_iter().for_each(|members| members.push(k as u32));
    }
    let objects = members.into_iter().zip(&view.labels);
    let visible = objects.filter(|(members, label)| !members.is_empty() && **label != BACKGROUND);
    visible.map(|(members, _)| pixels.segment_of(members)).collect()
}

/// Returns, for each object, the proposal with the greatest overlap (intersection over union) as a
/// detection with the object's label and this overlap as its score.
fn best_proposals(view: &LabeledView, pixels: &Pixels, proposals: &[Segment]) -> EvaluatedImage {
    let instance = |proposal: &Segment| Instance {
        names: vec![(proposal.label, proposal.score)],
        pixels: pixels.masks(std::slice::from_ref(proposal), &view.depth_m).concat(),
        center: proposal.center,
    };
    let instances: Vec<Instance> = proposals.iter().map(instance).collect();
    let EvaluatedImage { truths, detections } = compare(view, &instances);
    let best = |(t, truth): (usize, &GroundTruthInstance)| {
        let overlap = |detection: &ScoredDetection| {
            let shared = detection.intersections[t];
            shared as f32 / (detection.area + truth.area - shared).max(1) as f32
        };
        let best = detections.iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b)))?;
        Some(ScoredDetection { label: truth.label, score: overlap(best), ..best.clone() })
    };
    let best = truths.iter().enumerate().filter_map(best).collect();
    EvaluatedImage { truths, detections: best }
}
