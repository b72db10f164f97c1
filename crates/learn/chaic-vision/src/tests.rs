//! Promises: features of a wall and a floor are those of geometry, gradients of the loss are those of
//! finite differences, views and training are the same bits each time, and training learns.

use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::rng::Stream;
use chaic_core::{EntityId, Vec3};
use chaic_nn::{Shape, Tensor};

use crate::average_precision::average_precision;
use crate::detector::{Detector, N_OFFSETS, STRIDE};
use crate::evaluate::{LEAST_PX, compare, report};
use crate::features::{Crop, N_FEATURES, features};
use crate::instances::{InstanceRules, instances};
use crate::labels::{BACKGROUND, class_of, label_of, n_labels};
use crate::loss::{LossRules, Targets, loss};
use crate::train::{CropRules, Trainer, TrainingRules};
use crate::trained::TrainedDetector;
use crate::views::{LabelledView, Part, ViewRules, Views};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{
    CHECKPOINT, CONFIG, Checkpoint, Of, Record, Training as _, TrainingError, TrainingRun,
    parse_rules, read_rules,
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
fn a_wall_faces_the_eye_and_the_floor_upwards() {
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
    features(&rgb, &depth_m, &camera, Crop::whole(&camera), &mut out);
    let pixel = |row: usize| &out[(row * side as usize + 9) * N_FEATURES..][..N_FEATURES];
    let is_near = |a: &[f32], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
    let (wall, floor) = (pixel(8), pixel(30));
    assert!(is_near(&wall[5..], [0.0, 0.0, 1.0]), "{wall:?}");
    assert!(is_near(&floor[5..], [0.0, 1.0, 0.0]), "{floor:?}");
    assert!((wall[3] - 0.5).abs() < 1e-5 && floor[4].abs() < 1e-3, "{wall:?}, {floor:?}");
    assert_eq!(wall[..3], [1.0; 3]);
}

#[test]
fn labels_name_the_background_and_every_class() {
    assert_eq!(label_of(None), BACKGROUND);
    assert_eq!(class_of(BACKGROUND), None);
    for label in 1..n_labels() as u8 {
        assert_eq!(label_of(class_of(label)), label);
    }
}

#[test]
fn gradients_of_the_loss_are_those_of_finite_differences() {
    let mut rng = Stream::new(1, "loss", 0);
    let channels = n_labels() + N_OFFSETS;
    let shape = Shape { n: 1, height: 2, width: 3, channels };
    let data = (0..shape.numbers()).map(|_| rng.range(-2.0, 2.0)).collect();
    let head = Tensor { shape, data };
    let targets = Targets {
        labels: vec![0, 3, 7, 3, 0, 9],
        weights: vec![1.0, 4.0, 0.5, 2.0, 1.0, 0.0],
        offsets: vec![[0.1, -0.2, 0.3]; 6],
    };
    let rules = LossRules::TRAINING;
    let of = |head: &Tensor| {
        let mut gradient = Tensor::zeros(head.shape);
        let loss = loss(head, &targets, &rules, &mut gradient);
        (loss.labels + f64::from(rules.offset) * loss.offsets, gradient)
    };
    let (_, exact) = of(&head);
    let h = 1e-2;
    let is_offset = |k: usize| k % channels >= n_labels();
    for k in (0..head.data.len()).filter(|k| k % 5 == 0 || is_offset(*k)) {
        let at = |h: f32| {
            let mut moved = head.clone();
            moved.data[k] += h;
            of(&moved).0
        };
        let measured = (at(h) - at(-h)) / (2.0 * f64::from(h));
        let exact = f64::from(exact.data[k]);
        assert!((measured - exact).abs() < 3e-3, "{k}: {measured} for {exact}");
    }
}

/// Small images and crops.
fn tiny() -> TrainingRules {
    let crops = |of_view, side_px| CropRules { views: 2, of_view, side_px, anywhere: 0.3 };
    TrainingRules {
        views: ViewRules { size_px: 128, ..ViewRules::TRAINING },
        crops: [crops(1, 96), crops(2, 64)],
        warm_up: 2,
        rate: 5e-3,
        ..TrainingRules::shipped(400)
    }
}

#[test]
fn views_are_the_same_each_time_and_others_elsewhere() {
    let draw = |part, index| Views::new(part, tiny().views, 1, index).draw();
    let (view, again) = (draw(Part::Training, 3), draw(Part::Training, 3));
    assert!(view.rgb == again.rgb && view.ids == again.ids && view.depth_m == again.depth_m);
    assert!(draw(Part::Validation, 3).rgb != view.rgb && draw(Part::Training, 4).rgb != view.rgb);
    let structure = [EntityId::NOTHING, EntityId::FLOOR, EntityId::WALL, EntityId::CEILING];
    for id in structure {
        assert_eq!(view.labels[usize::from(id.0)], BACKGROUND);
    }
    let of_id = |id: &u16| view.labels.get(usize::from(*id)).is_some();
    assert!(view.ids.iter().all(of_id), "ids beyond the labels");
}

static NEVER: AtomicBool = AtomicBool::new(false);

#[test]
fn training_goes_on_from_a_checkpoint_as_if_it_had_not_stopped() {
    let mut straight = Trainer::new(tiny());
    straight.step(&NEVER);
    let checkpoint = straight.checkpoint();
    let expected = (straight.step(&NEVER), straight.checkpoint());
    let mut resumed = Trainer::new(tiny());
    assert!(resumed.resume(&Checkpoint::default(), &NEVER).is_err());
    assert_eq!(resumed.resume(&checkpoint, &NEVER), Ok(Some(())));
    assert!((resumed.step(&NEVER), resumed.checkpoint()) == expected);
}

#[test]
fn damaged_checkpoints_and_numbers_out_of_bounds_are_refused() {
    refuses_damaged_checkpoints(&mut Trainer::new(tiny()));
    bounds_every_number::<Trainer>();
}

#[test]
fn configurations_whose_keys_contradict_each_other_are_refused() {
    for (text, problem) in [
        ("[views]\nsize_px = 500", "multiple of 32"),
        ("[views]\ndistance_m = [3.0, 4.0]", "distance_m"),
        ("[loss]\nweights = [2.0, 1.0]", "weights"),
        ("[views]\nsize_px = 128", "side_px"),
        ("shards = 200", "shards"),
    ] {
        let refused = parse_rules::<Trainer>(text).unwrap_err();
        assert!(refused.contains(problem), "{refused}");
    }
}

#[test]
fn a_raised_flag_stops_steps_and_validations_which_change_nothing() {
    let raised = AtomicBool::new(true);
    let mut trainer = Trainer::new(tiny());
    let before = trainer.checkpoint();
    assert!(trainer.step(&raised).is_none() && trainer.checkpoint() == before);
    assert!(trainer.validate(&raised).unwrap().is_none());
    trainer.learner.average[7] = f32::NAN;
    assert!(
        TrainedDetector::uncalibrated(&trainer.detector, &trainer.learner.average)
            .to_bytes()
            .is_err()
    );
}

#[test]
fn a_training_leaves_what_it_takes_to_go_on_and_weights_that_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("training");
    let rules = TrainingRules { steps: 1, ..tiny() };
    let quiet = &mut |_: &str| ();
    let mut run =
        TrainingRun::<Trainer>::begin(&out, &rules, None, quiet, &NEVER).unwrap().unwrap();
    let stopped = AtomicBool::new(true);
    assert!(!run.go_on(&stopped, &mut |_| ()).unwrap() && run.extent() == (0, 1));
    let mut again = || TrainingRun::<Trainer>::begin(&out, &rules, None, quiet, &NEVER);
    assert!(matches!(again(), Err(TrainingError::Locked(_))));
    drop(run);
    assert!(matches!(again(), Err(TrainingError::NotEmpty(_))));
    assert_eq!(read_rules::<Trainer>(&out.join(CONFIG)).unwrap(), rules);
    let mut resumed = TrainingRun::<Trainer>::resume(&out, quiet, &NEVER).unwrap().unwrap();
    let mut told = Vec::new();
    stopped.store(false, Ordering::Relaxed);
    assert!(resumed.go_on(&stopped, &mut |record| told.push(record.clone())).unwrap());
    assert!(matches!(
        told[..],
        [Record { of: Of::Loss, step: 1, .. }, Record { of: Of::Validation, step: 1, .. }]
    ));
    let bytes = std::fs::read(out.join(Trainer::WEIGHTS)).unwrap();
    let trained = TrainedDetector::from_bytes(&bytes).unwrap();
    assert_eq!(trained.to_bytes().as_ref(), Ok(&bytes));
    drop(resumed);
    assert!(TrainedDetector::from_bytes(&bytes[..bytes.len() - 1]).is_err());
    std::fs::write(out.join(CHECKPOINT), b"short").unwrap();
    assert!(matches!(
        TrainingRun::<Trainer>::resume(&out, quiet, &NEVER),
        Err(TrainingError::Checkpoint { .. })
    ));
    std::fs::write(out.join(CONFIG), "stepps = 3").unwrap();
    let error = TrainingRun::<Trainer>::resume(&out, quiet, &NEVER).err().unwrap().to_string();
    assert!(error.contains("stepps"), "{error}");
}

#[test]
fn images_that_are_none_show_nothing_and_break_nothing() {
    let detector = Detector::new();
    let trained = TrainedDetector::uncalibrated(&detector, &detector.network.begin(1));
    let mut inference = trained.inference();
    let camera = camera(64);
    for depth_m in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -1.0, 2.0] {
        for gray in [0, 255] {
            let (rgb, depth_m) = (vec![gray; 3 * 64 * 64], vec![depth_m; 64 * 64]);
            let found = trained.detect((&rgb, &depth_m, &camera), &mut inference);
            assert!(found.iter().all(|f| f.score.is_finite() && (0.0..=1.0).contains(&f.score)));
        }
    }
    assert!(!trained.fits(&Camera { width: 65, ..camera }));
}

#[test]
fn the_detector_that_comes_with_chaic_is_read_and_finds_most_of_what_it_is_shown() {
    let trained = TrainedDetector::built_in();
    let natural = (Part::Validation, ViewRules::NATURAL);
    let (found, _) = report(&trained, natural, 8, 2, |_, _, _| ());
    assert!(found.map50 > 0.5, "{}", found.map50);
}

#[test]
fn training_learns() {
    let mut trainer = Trainer::new(tiny());
    let losses: Vec<f64> = (0..30).map(|_| trainer.step(&NEVER).unwrap().labels).collect();
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    let (first, last) = (mean(&losses[..3]), mean(&losses[27..]));
    assert!(last < 0.8 * first, "{first} to {last}");
}

/// What a network that makes no mistake would say of a view.
fn perfect(view: &LabelledView) -> Tensor {
    let mut targets = Targets::default();
    targets.add(view, Crop::whole(&view.camera), &LossRules::TRAINING);
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
fn instances_of_perfect_labels_and_offsets_are_those_that_are_there() {
    let rules = ViewRules::TRAINING;
    let images: Vec<_> = (0..16)
        .map(|k| {
            let view = Views::new(Part::Validation, rules, 7, k).draw();
            let (head, rules) = (perfect(&view), InstanceRules::default());
            let found = instances(&head, &view.depth_m, &view.camera, &rules);
            compare(&view, &found)
        })
        .collect();
    let asked = LEAST_PX..=u32::MAX;
    let n_asked = images.iter().flat_map(|i| &i.truths).filter(|t| asked.contains(&t.area)).count();
    let found = average_precision(&images, &asked);
    println!("{n_asked} instances: {:.3}, {:.3}", found.map50, found.map);
    assert!(n_asked > 60 && found.map50 > 0.9, "{n_asked}: {found:?}");
}
