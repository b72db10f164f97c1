//! Promises: features of a wall and a floor agree with geometry, gradients of the loss with finite
//! differences; views and training repeat bit for bit; training reduces the loss.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::rng::RngStream;
use chaic_core::{EntityId, Vec3};
use chaic_nn::simd::widest;
use chaic_nn::{Shape, Tensor, TrainingPass};

use crate::average_precision::average_precision;
use crate::coco::results;
use crate::detector::{N_OFFSETS, STRIDE};
use crate::evaluate::{MIN_AREA_PX, compare, report};
use crate::features::{ImageCrop, N_FEATURES, features};
use crate::instances::{Instance, InstanceConfig, Pixels, instances};
use crate::labels::{BACKGROUND, class_of, label_of, n_labels};
use crate::loss::{CropTargets, LossConfig, loss};
use crate::proposals::proposals;
use crate::roi::{RoiBox, SIDE};
use crate::roi_loss::{RoiTarget, ViewTruth, roi_loss};
use crate::roi_network::RoiNetwork;
use crate::roi_train::RoiTrainingConfig;
use crate::train::{CropConfig, DetectorLearner, DetectorLoss, DetectorTrainingConfig};
use crate::trained::TrainedDetector;
use crate::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{
    CHECKPOINT, CONFIG, Checkpoint, CurveRecord, Phase, Trainer as _, TrainingError, TrainingRun,
    parse_config, read_config,
};

const EYE_M: f32 = 1.5;

fn camera(side: u32) -> Camera {
    Camera {
        eye_in_world: Vec3::new(1.0, EYE_M, 2.0),
        world_from_camera: yaw_rotation(0.7),
        vertical_fov_rad: Camera::EYE_FOV_RAD,
        width: side,
        height: side,
    }
}

#[test]
fn normals_of_a_wall_face_the_camera_and_of_the_floor_point_up() {
    let (side, wall_m) = (32, 2.0);
    let camera = camera(side);
    let focal = camera.focal_px();
    let depth = |row: u32| {
        let down = row as f32 + 0.5 - 0.5 * side as f32;
        if down * wall_m / focal > EYE_M { EYE_M * focal / down } else { wall_m }
    };
    let depth_m: Vec<f32> = (0..side * side).map(|k| depth(k / side)).collect();
    let rgb = vec![255; 3 * depth_m.len()];
    let mut out = vec![0.0; depth_m.len() * N_FEATURES];
    features(&rgb, &depth_m, &camera, ImageCrop::whole(&camera), &mut out);
    let pixel = |row: usize| &out[(row * side as usize + 9) * N_FEATURES..][..N_FEATURES];
    let is_near = |a: &[f32], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
    let (wall, floor) = (pixel(8), pixel(30));
    assert!(is_near(&wall[5..], [0.0, 0.0, 1.0]), "{wall:?}");
    assert!(is_near(&floor[5..], [0.0, 1.0, 0.0]), "{floor:?}");
    assert!((wall[3] - 0.5).abs() < 1e-5 && floor[4].abs() < 1e-3, "{wall:?}, {floor:?}");
    assert_eq!(wall[..3], [1.0; 3]);
}

#[test]
fn features_of_a_crop_are_those_of_the_image() {
    const SIDE_PX: usize = 32;
    let camera = camera(SIDE_PX as u32);
    let mut rng = RngStream::new(1, "image", 0);
    let depth_m: Vec<f32> = (0..SIDE_PX * SIDE_PX).map(|_| rng.range(-0.5, 9.0)).collect();
    let rgb: Vec<u8> = (0..3 * SIDE_PX * SIDE_PX).map(|_| rng.below(256) as u8).collect();
    let features_of = |crop: ImageCrop| {
        let mut out = vec![0.0; crop.size[0] * crop.size[1] * N_FEATURES];
        features(&rgb, &depth_m, &camera, crop, &mut out);
        out
    };
    let whole = features_of(ImageCrop::whole(&camera));
    for origin in [[0, 0], [5, 9], [20, 16]] {
        let crop = features_of(ImageCrop { origin, size: [12, 16] });
        for (j, row) in crop.chunks_exact(12 * N_FEATURES).enumerate() {
            let first = ((origin[1] + j) * SIDE_PX + origin[0]) * N_FEATURES;
            assert!(row == &whole[first..][..row.len()], "row {j} at {origin:?}");
        }
    }
}

#[test]
fn labels_cover_the_background_and_all_classes() {
    assert_eq!(label_of(None), BACKGROUND);
    assert_eq!(class_of(BACKGROUND), None);
    for label in 1..n_labels() as u8 {
        assert_eq!(label_of(class_of(label)), label);
    }
}

#[test]
fn loss_gradients_match_finite_differences() {
    let mut rng = RngStream::new(1, "loss", 0);
    let channels = n_labels() + N_OFFSETS;
    let shape = Shape { n: 1, height: 2, width: 3, channels };
    let data = (0..shape.len()).map(|_| rng.range(-2.0, 2.0)).collect();
    let head = Tensor { shape, data };
    let targets = CropTargets {
        labels: vec![0, 3, 7, 3, 0, 9],
        weights: vec![1.0, 4.0, 0.5, 2.0, 1.0, 0.0],
        offsets: vec![[0.1, -0.2, 0.3]; 6],
    };
    let config = LossConfig::TRAINING;
    let loss_and_gradient = |head: &Tensor| {
        let mut gradient = Tensor::zeros(head.shape);
        let loss = loss(head, &targets, &config, &mut gradient);
        (loss.labels + f64::from(config.offset_coef) * loss.offsets, gradient)
    };
    let (_, exact) = loss_and_gradient(&head);
    let h = 1e-2;
    let is_offset = |k: usize| k % channels >= n_labels();
    for k in (0..head.data.len()).filter(|k| k % 5 == 0 || is_offset(*k)) {
        let at = |h: f32| {
            let mut moved = head.clone();
            moved.data[k] += h;
            loss_and_gradient(&moved).0
        };
        let measured = (at(h) - at(-h)) / (2.0 * f64::from(h));
        let exact = f64::from(exact.data[k]);
        assert!((measured - exact).abs() < 3e-3, "{k}: {measured} for {exact}");
    }
}

/// Small images and crops.
fn tiny() -> DetectorTrainingConfig {
    let crops = |crops_per_view, side_px| CropConfig {
        views: 2,
        crops_per_view,
        side_px,
        uniform_crop_fraction: 0.3,
    };
    DetectorTrainingConfig {
        second_stage: RoiTrainingConfig { steps: 0, ..RoiTrainingConfig::default() },
        views: ViewConfig { size_px: 128, ..ViewConfig::TRAINING },
        validation_views: 20,
        calibration_views: 20,
        crops: [crops(1, 96), crops(2, 64)],
        warm_up: 2,
        learning_rate: 5e-3,
        ..DetectorTrainingConfig::bundled(400)
    }
}

#[test]
fn views_repeat_for_equal_seeds_and_differ_for_others() {
    let draw = |split, index| SyntheticViews::new(split, tiny().views, 1, index).draw();
    let (view, again) = (draw(DatasetSplit::Train, 3), draw(DatasetSplit::Train, 3));
    assert!(view.rgb == again.rgb && view.ids == again.ids && view.depth_m == again.depth_m);
    assert!(
        draw(DatasetSplit::Validation, 3).rgb != view.rgb
            && draw(DatasetSplit::Train, 4).rgb != view.rgb
    );
    let structure = [EntityId::NOTHING, EntityId::FLOOR, EntityId::WALL, EntityId::CEILING];
    for id in structure {
        assert_eq!(view.labels[usize::from(id.0)], BACKGROUND);
    }
    let has_label = |id: &u16| view.labels.get(usize::from(*id)).is_some();
    assert!(view.ids.iter().all(has_label), "ids beyond the labels");
}

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

#[test]
fn resumed_training_equals_uninterrupted_training() {
    let mut uninterrupted = DetectorLearner::new(tiny());
    uninterrupted.step(&NEVER_STOP);
    let checkpoint = uninterrupted.checkpoint();
    let expected = (uninterrupted.step(&NEVER_STOP), uninterrupted.checkpoint());
    let mut resumed = DetectorLearner::new(tiny());
    assert!(resumed.resume(&Checkpoint::default(), &NEVER_STOP).is_err());
    assert_eq!(resumed.resume(&checkpoint, &NEVER_STOP), Ok(Some(())));
    assert!((resumed.step(&NEVER_STOP), resumed.checkpoint()) == expected);
}

#[test]
fn damaged_checkpoints_and_values_out_of_bounds_are_refused() {
    refuses_damaged_checkpoints(&mut DetectorLearner::new(tiny()));
    bounds_every_number::<DetectorLearner>();
}

#[test]
fn configurations_whose_keys_contradict_each_other_are_refused() {
    for (text, problem) in [
        ("[views]\nsize_px = 500", "multiple of 32"),
        ("[views]\ndistance_m = [3.0, 4.0]", "distance_m"),
        ("[loss]\nweight_range = [2.0, 1.0]", "weight_range"),
        ("[views]\nsize_px = 128", "side_px"),
        ("shards = 200", "shards"),
        ("[second_stage]\nviews = 64", "second_stage.proposals_per_view is 1024"),
        ("shards = 16\n[second_stage]\nviews = 20", "times shards, which is 16, up to 4096"),
    ] {
        let refused = parse_config::<DetectorLearner>(text).unwrap_err();
        assert!(refused.contains(problem), "{refused}");
    }
    // The last part of the training of the bundled weights.
    let text = "seed = 2\nsteps = 0\nshards = 16\n[second_stage]\nsteps = 280";
    assert!(parse_config::<DetectorLearner>(text).is_ok());
}

#[test]
fn a_stop_flag_interrupts_steps_and_validations_without_effect() {
    let raised = AtomicBool::new(true);
    let mut learner = DetectorLearner::new(tiny());
    let before = learner.checkpoint();
    assert!(learner.step(&raised).is_none() && learner.checkpoint() == before);
    assert!(learner.validate(&raised).unwrap().is_none());
    learner.learner.ema_parameters[7] = f32::NAN;
    assert!(
        TrainedDetector::uncalibrated(&learner.detector, &learner.learner.ema_parameters)
            .to_bytes()
            .is_err()
    );
}

#[test]
fn a_training_writes_a_checkpoint_and_readable_weights() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("training");
    let config = DetectorTrainingConfig { steps: 1, ..tiny() };
    let quiet = &mut |_: &str| ();
    let mut run = TrainingRun::<DetectorLearner>::start(&out, &config, None, quiet, &NEVER_STOP)
        .unwrap()
        .unwrap();
    let stopped = AtomicBool::new(true);
    assert!(!run.run(&stopped, &mut |_| ()).unwrap() && run.progress() == (0, 1));
    let mut again =
        || TrainingRun::<DetectorLearner>::start(&out, &config, None, quiet, &NEVER_STOP);
    assert!(matches!(again(), Err(TrainingError::Locked(_))));
    drop(run);
    assert!(matches!(again(), Err(TrainingError::NotEmpty(_))));
    assert_eq!(read_config::<DetectorLearner>(&out.join(CONFIG)).unwrap(), config);
    let mut resumed =
        TrainingRun::<DetectorLearner>::resume(&out, quiet, &NEVER_STOP).unwrap().unwrap();
    let mut records = Vec::new();
    stopped.store(false, Ordering::Relaxed);
    assert!(resumed.run(&stopped, &mut |record| records.push(record.clone())).unwrap());
    assert!(matches!(
        records[..],
        [
            CurveRecord { phase: Phase::Train, step: 1, .. },
            CurveRecord { phase: Phase::Validation, step: 1, .. }
        ]
    ));
    let bytes = std::fs::read(out.join(DetectorLearner::WEIGHTS)).unwrap();
    let trained = TrainedDetector::from_bytes(&bytes).unwrap();
    assert_eq!(trained.to_bytes().as_ref(), Ok(&bytes));
    drop(resumed);
    assert!(TrainedDetector::from_bytes(&bytes[..bytes.len() - 1]).is_err());
    std::fs::write(out.join(CHECKPOINT), b"short").unwrap();
    assert!(matches!(
        TrainingRun::<DetectorLearner>::resume(&out, quiet, &NEVER_STOP),
        Err(TrainingError::Checkpoint { .. })
    ));
    std::fs::write(out.join(CONFIG), "stepps = 3").unwrap();
    let error =
        TrainingRun::<DetectorLearner>::resume(&out, quiet, &NEVER_STOP).err().unwrap().to_string();
    assert!(error.contains("stepps"), "{error}");
}

#[test]
fn a_training_keeps_its_blocks_seed_and_shards() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("training");
    let quiet = &mut |_: &str| ();
    let run = TrainingRun::<DetectorLearner>::start(&out, &tiny(), None, quiet, &NEVER_STOP);
    drop(run.unwrap());
    let text = std::fs::read_to_string(out.join(CONFIG)).unwrap();
    for (line, other, problem) in [
        (
            "blocks = \"depthwise\"",
            "blocks = \"dense\"",
            "`blocks` is \"dense\", but was \"depthwise\"",
        ),
        ("seed = 1", "seed = 2", "`seed` is 2, but was 1"),
        ("shards = 2", "shards = 3", "`shards` is 3, but was 2"),
    ] {
        assert!(text.contains(line), "{text}");
        std::fs::write(out.join(CONFIG), text.replacen(line, other, 1)).unwrap();
        let refused = TrainingRun::<DetectorLearner>::resume(&out, quiet, &NEVER_STOP);
        let refused = refused.err().unwrap();
        assert!(refused.is_usage() && refused.to_string().contains(problem), "{refused}");
    }
}

#[test]
fn the_bundled_detector_finds_most_objects() {
    let trained = TrainedDetector::built_in();
    let (split, config) = (DatasetSplit::Validation, ViewConfig::NATURAL);
    let evaluated = report(&trained, split, config, 8, 2, |_, _, _| (), &NEVER_STOP);
    let (found, _) = evaluated.expect("it is not stopped");
    assert!(found.map50 > Some(0.5), "{:?}", found.map50);
    assert!(report(&trained, split, config, 8, 2, |_, _, _| (), &AtomicBool::new(true)).is_none());
}

#[test]
fn training_learns() {
    let mut learner = DetectorLearner::new(tiny());
    let mut label_loss = || match learner.step(&NEVER_STOP) {
        Some(DetectorLoss::FirstStage(loss)) => loss.labels,
        other => panic!("{other:?}"),
    };
    let losses: Vec<f64> = (0..30).map(|_| label_loss()).collect();
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    let (first, last) = (mean(&losses[..3]), mean(&losses[27..]));
    assert!(last < 0.8 * first, "{first} to {last}");
}

/// Training of the second stage on the bundled first stage.
fn second_stage_learner(steps: u64) -> DetectorLearner {
    let second_stage = RoiTrainingConfig {
        steps,
        learning_rate: 3e-3,
        warm_up: 2,
        views: 1,
        proposals_per_view: 12,
    };
    let config =
        DetectorTrainingConfig { steps: 0, second_stage, ..DetectorTrainingConfig::bundled(0) };
    let mut learner = DetectorLearner::new(config);
    let first_stage = TrainedDetector { second_stage: None, ..TrainedDetector::built_in() };
    let weights = first_stage.to_bytes().unwrap();
    learner.load_parameters(DetectorLearner::read_weights(&config, &weights).unwrap());
    learner
}

#[test]
fn the_second_stage_learns_on_proposals_of_the_first_and_resumes() {
    let mut learner = second_stage_learner(12);
    let mut losses = Vec::new();
    let mut resumed = second_stage_learner(12);
    for step in 0..12 {
        if step == 10 {
            resumed.resume(&learner.checkpoint(), &NEVER_STOP).unwrap();
        }
        match learner.step(&NEVER_STOP) {
            Some(DetectorLoss::SecondStage(loss)) => losses.push(loss.qualities),
            other => panic!("{other:?}"),
        }
    }
    (10..12).for_each(|_| assert!(resumed.step(&NEVER_STOP).is_some()));
    assert!(resumed.checkpoint() == learner.checkpoint());
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    let (first, last) = (mean(&losses[..3]), mean(&losses[9..]));
    assert!(last < 0.75 * first, "{first} to {last}");
    let bytes = learner.trained().to_bytes().unwrap();
    let trained = TrainedDetector::from_bytes(&bytes).unwrap();
    assert!(trained.second_stage.is_some() && trained.to_bytes().as_ref() == Ok(&bytes));
    let view = SyntheticViews::new(DatasetSplit::Validation, tiny().views, 1, 3).draw();
    let mut inference = trained.inference();
    let detections = trained.detect(&view.rgb, &view.depth_m, &view.camera, &mut inference);
    let mut owned = vec![false; view.ids.len()];
    for k in detections.iter().flat_map(|d| &d.pixels) {
        assert!(!std::mem::replace(&mut owned[*k as usize], true), "instances overlap");
    }
}

#[test]
fn second_stage_gradients_match_finite_differences() {
    let network = RoiNetwork::new();
    let mut rng = RngStream::new(1, "loss", 0);
    let n_samples = SIDE * SIDE;
    // One sample in eight lies outside of the image, and one shows the background: with as many as of
    // the object, the gradient of the mask's bias would be near zero.
    let target = |label: u8| RoiTarget {
        label,
        mask: (0..n_samples).map(|k| ((k % 8) as i8 - 1).min(1)).collect(),
        n_outside: 40.0,
        iou: 0.3,
    };
    let targets = [target(4), target(BACKGROUND), target(9)];
    let mut parameters = network.network.init_parameters(1);
    let inputs = RoiNetwork::input_shapes(targets.len()).map(|shape| Tensor {
        shape,
        data: (0..shape.len()).map(|_| rng.range(-1.0, 1.0)).collect(),
    });
    let mut pass = TrainingPass::new(&network.network, widest());
    let mut loss_and_gradient = |parameters: &[f32]| {
        let [crops, scalars] = &inputs;
        pass.forward_all(&network.network, parameters, &[crops, scalars]);
        pass.zero_gradients();
        let loss = roi_loss(&network, &targets, &mut pass);
        let mut gradient = vec![0.0; parameters.len()];
        pass.backward(&network.network, parameters, &mut gradient);
        ([loss.labels + loss.mask + 0.5 * loss.qualities, loss.mask], gradient)
    };
    let (_, gradient) = loss_and_gradient(&parameters);
    // The quality targets are step functions of the redrawn masks, so the bias of the masks is compared
    // with the loss of the masks alone.
    for (name, which) in [("labels.bias", 0), ("qualities.bias", 0), ("mask.bias", 1)] {
        let range = network.network.parameters().iter().find(|p| p.name == name).unwrap();
        for k in range.range.clone().step_by(20) {
            let (h, before) = (1e-2, parameters[k]);
            let mut at = |value: f32| {
                parameters[k] = value;
                loss_and_gradient(&parameters).0[which]
            };
            let measured = (at(before + h) - at(before - h)) / (2.0 * f64::from(h));
            parameters[k] = before;
            let exact = f64::from(gradient[k]);
            assert!(name != "mask.bias" || exact < -0.2, "{exact} for six of seven samples");
            // The exponential function of the loss is accurate to half a percent.
            let is_equal = (measured - exact).abs() < 2e-3 + 0.02 * exact.abs();
            assert!(is_equal, "{name} {k}: {measured} for {exact}");
        }
    }
}

#[test]
fn each_name_of_an_instance_is_a_detection() {
    let view = SyntheticViews::new(DatasetSplit::Validation, tiny().views, 7, 1).draw();
    let pixels = vec![0, 1, 2];
    let instance = Instance { names: vec![(4, 0.6), (9, 0.2)], pixels, center: [0.0; 3] };
    let found = compare(&view, std::slice::from_ref(&instance)).detections;
    let names: Vec<(u8, f32)> = found.iter().map(|d| (d.label, d.score)).collect();
    assert_eq!(names, instance.names);
    assert_eq!(found[0].intersections, found[1].intersections);
    let results = results(1, &view, &[instance]);
    assert_eq!(results.len(), 2);
}

#[test]
fn proposals_of_a_perfect_first_stage_include_the_true_instances() {
    let (mut n_found, mut n_true) = (0, 0);
    for k in 0..4 {
        let view = SyntheticViews::new(DatasetSplit::Validation, ViewConfig::NATURAL, 7, k).draw();
        let mut pixels = Pixels::new(&view.camera);
        pixels.read(0, &perfect_output(&view).data, &view.depth_m);
        let truth = ViewTruth::new(&view);
        let proposals = proposals(&pixels);
        assert!(proposals.iter().all(|p| p.pixels.is_sorted()));
        let mut best: BTreeMap<u8, f32> = BTreeMap::new();
        for proposal in &proposals {
            let roi = RoiBox::around(&proposal.pixels, view.camera.width as usize / STRIDE);
            let RoiTarget { label, iou, .. } = truth.target(proposal, roi);
            let best = best.entry(label).or_default();
            *best = best.max(iou);
        }
        best.remove(&BACKGROUND);
        n_true += best.len();
        n_found += best.values().filter(|iou| **iou > 0.7).count();
    }
    assert!(n_true > 8 && 10 * n_found >= 9 * n_true, "{n_found} of {n_true}");
}

/// Returns the output of a network without errors.
fn perfect_output(view: &LabeledView) -> Tensor {
    let mut targets = CropTargets::default();
    targets.add(view, ImageCrop::whole(&view.camera), &LossConfig::TRAINING);
    let side = view.camera.width as usize / STRIDE;
    let channels = n_labels() + N_OFFSETS;
    let mut head = Tensor::zeros(Shape { n: 1, height: side, width: side, channels });
    for (k, row) in head.data.chunks_exact_mut(channels).enumerate() {
        row[usize::from(targets.labels[k])] = 10.0;
        row[n_labels()..].copy_from_slice(&targets.offsets[k]);
    }
    head
}

#[test]
fn perfect_labels_and_offsets_give_the_true_instances() {
    let config = ViewConfig::TRAINING;
    let images: Vec<_> = (0..16)
        .map(|k| {
            let view = SyntheticViews::new(DatasetSplit::Validation, config, 7, k).draw();
            let (head, config) = (perfect_output(&view), InstanceConfig::default());
            let found = instances(&head, &view.depth_m, &view.camera, &config);
            compare(&view, &found)
        })
        .collect();
    let evaluated_areas = MIN_AREA_PX..=u32::MAX;
    let n_evaluated =
        images.iter().flat_map(|i| &i.truths).filter(|t| evaluated_areas.contains(&t.area)).count();
    let found = average_precision(&images, &evaluated_areas);
    println!("{n_evaluated} instances: {:?}, {:?}", found.map50, found.map);
    assert!(n_evaluated > 60 && found.map50 > Some(0.9), "{n_evaluated}: {found:?}");
}
