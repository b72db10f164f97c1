//! Promises: damaged images give valid detections, and images of another size one clear panic. Files
//! of other detectors are refused in one line.

use chaic_core::Vec3;
use chaic_core::geom::yaw_rotation;
use chaic_core::rng::RngStream;

use super::*;
use crate::detector::{N_OFFSETS, STRIDE};
use crate::labels::{BACKGROUND, half_extents_m, n_labels};
use crate::proposals::MAX_PROPOSALS;
use crate::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};

const SIDE_PX: u32 = 128;
const N_PX: usize = (SIDE_PX * SIDE_PX) as usize;

fn camera(width: u32, height: u32) -> Camera {
    Camera {
        eye_in_world: Vec3::new(1.0, 1.5, 2.0),
        world_from_camera: yaw_rotation(0.7),
        vertical_fov_rad: Camera::EYE_FOV_RAD,
        width,
        height,
    }
}

/// Detector of two stages with random parameters.
fn untrained() -> TrainedDetector {
    let (detector, network) = (Detector::new(), RoiNetwork::new());
    let parameters = network.network.init_parameters(1);
    TrainedDetector {
        second_stage: Some(SecondStage { network, parameters }),
        ..TrainedDetector::uncalibrated(&detector, &detector.network.init_parameters(1))
    }
}

fn one_stage() -> TrainedDetector {
    TrainedDetector { second_stage: None, ..TrainedDetector::built_in() }
}

/// Checks names, scores and centers, and that masks are disjoint parts of the image.
fn check(detections: &[Instance], what: &str) {
    let mut is_owned = vec![false; N_PX];
    for instance in detections {
        assert!(!instance.names.is_empty() && !instance.pixels.is_empty(), "{what}");
        for (label, score) in &instance.names {
            assert!(*label != BACKGROUND && usize::from(*label) < n_labels(), "{what}: {label}");
            assert!((0.0..=1.0).contains(score), "{what}: {score}");
        }
        let is_finite = instance.center.iter().all(|x| x.is_finite());
        assert!(is_finite && instance.pixels.is_sorted(), "{what}: {:?}", instance.center);
        for k in &instance.pixels {
            assert!(!std::mem::replace(&mut is_owned[*k as usize], true), "{what}: masks overlap");
        }
    }
}

/// Returns the first view in which the detector reports an object.
fn view_with_an_object(
    trained: &TrainedDetector,
    inference: &mut DetectorInference,
) -> LabeledView {
    let config = ViewConfig { size_px: SIDE_PX, ..ViewConfig::ALL_CLASSES };
    let views = (0..40).map(|k| SyntheticViews::new(DatasetSplit::Validation, config, 1, k).draw());
    let mut reported = views.filter(|view| {
        let found = trained.detect(&view.rgb, &view.depth_m, &view.camera, inference);
        found.first().is_some_and(|instance| instance.score() > 0.5)
    });
    reported.next().expect("one of several views shows an object")
}

#[test]
fn damaged_images_give_valid_detections() {
    let mut detectors =
        [TrainedDetector::built_in(), one_stage(), untrained()].map(|d| (d.inference(), d));
    let (inference, trained) = &mut detectors[0];
    let LabeledView { rgb, depth_m, camera, .. } = view_with_an_object(trained, inference);
    let mut rng = RngStream::new(1, "noise", 0);
    let noise: Vec<u8> = (0..3 * N_PX).map(|_| rng.below(256) as u8).collect();
    let depth_noise: Vec<f32> = (0..N_PX).map(|_| rng.range(-1.0, 20.0)).collect();
    // Replaces the depth of every n-th pixel.
    let damaged = |depth: f32, step: usize| {
        let mut damaged = depth_m.clone();
        damaged.iter_mut().step_by(step).for_each(|d| *d = depth);
        damaged
    };
    let mut images = vec![
        ("no damage".to_owned(), rgb.clone(), depth_m.clone()),
        ("one pixel without depth".to_owned(), rgb.clone(), damaged(f32::NAN, N_PX)),
        ("black".to_owned(), vec![0; 3 * N_PX], depth_m.clone()),
        ("white".to_owned(), vec![255; 3 * N_PX], depth_m.clone()),
        ("noise".to_owned(), noise, depth_noise),
    ];
    for depth in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -1.0, 1e30] {
        for step in [1, 2, 7] {
            let what = format!("depth {depth} at one of {step} pixels");
            images.push((what, rgb.clone(), damaged(depth, step)));
        }
    }
    for (what, rgb, depth_m) in &images {
        for (k, (inference, trained)) in detectors.iter_mut().enumerate() {
            let found = trained.detect(rgb, depth_m, &camera, inference);
            check(&found, what);
            let is_intact = ["no damage", "one pixel without depth"].contains(&what.as_str());
            assert!(k == 2 || !is_intact || !found.is_empty(), "{what}: no detections");
        }
    }
}

#[test]
fn images_without_and_with_many_proposals_give_valid_detections() {
    let trained = TrainedDetector::built_in();
    let mut inference = trained.inference();
    let camera = camera(SIDE_PX, SIDE_PX);
    // A pixel of the head covers 0.06 m of a wall.
    let (rgb, depth_m) = (vec![128; 3 * N_PX], vec![2.0; N_PX]);
    trained.first_stage(&rgb, &depth_m, &camera, &mut inference);
    let half_extents = half_extents_m();
    let is_medium = |label: &usize| (0.15..0.24).contains(&half_extents[*label]);
    let medium = (1..n_labels()).find(is_medium).expect("the catalogue has such a class");
    let (columns, channels) = (SIDE_PX as usize / STRIDE, n_labels() + N_OFFSETS);
    // Squares of three pixels, one pixel apart, show an object each.
    let is_in_square = |k: usize| k % columns % 4 < 3 && k / columns % 4 < 3;
    let mut proposals_of = |has_objects: bool| {
        let mut head = vec![0.0; columns * columns * channels];
        for (k, row) in head.chunks_exact_mut(channels).enumerate() {
            let is_object = has_objects && is_in_square(k);
            row[if is_object { medium } else { usize::from(BACKGROUND) }] = 10.0;
        }
        let mut pixels = Pixels::new(&camera);
        pixels.read(0, &head, &depth_m);
        let proposals = proposals(&pixels);
        let found = trained.instances_among(&pixels, &proposals, &depth_m, &mut inference);
        check(&found, "squares");
        (proposals.len(), found.len())
    };
    assert_eq!(proposals_of(false), (0, 0));
    assert_eq!(proposals_of(true).0, MAX_PROPOSALS);
}

#[test]
#[should_panic(expected = "64 x 65 pixels are not multiples of 32")]
fn a_camera_that_does_not_fit_the_network_is_refused() {
    let (trained, camera) = (untrained(), camera(64, 65));
    assert!(!trained.fits(&camera) && !trained.fits(&Camera { width: 0, height: 0, ..camera }));
    trained.detect(&[0; 3 * 64 * 65], &[1.0; 64 * 65], &camera, &mut trained.inference());
}

#[test]
#[should_panic(expected = "color or depth do not have the camera's 64 x 64 pixels")]
fn images_of_another_size_than_the_camera_are_refused() {
    let trained = untrained();
    let depth_m = [1.0_f32; 64 * 64 - 1];
    trained.detect(&[0; 3 * 64 * 64], &depth_m, &camera(64, 64), &mut trained.inference());
}

#[test]
fn files_of_other_detectors_are_refused_in_one_line() {
    let [bytes, first_stage] =
        [TrainedDetector::built_in(), one_stage()].map(|trained| trained.to_bytes().unwrap());
    assert!(TrainedDetector::from_bytes(&first_stage).unwrap().second_stage.is_none());
    let replaced = |bytes: &[u8], from: &str, to: &str| {
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        let mut replaced = bytes.to_vec();
        replaced[at..][..from.len()].copy_from_slice(to.as_bytes());
        replaced
    };
    let name = kind(2);
    let classes = name.rsplit(' ').next().unwrap();
    let (one, two, three) = ("chaic detector 1", "chaic detector 2", "chaic detector 3");
    let mut files = vec![
        (replaced(&bytes, two, three), "weights of `chaic detector 3"),
        (replaced(&bytes, classes, "000000000000"), "classes 000000000000`, expected `chaic"),
        (replaced(&first_stage, classes, "000000000000"), "classes 000000000000`, expected"),
        (replaced(&bytes, two, one), "the weights have `roi."),
        (replaced(&first_stage, one, two), "the weights lack `roi."),
    ];
    for n in [0, 7, 8, 100, bytes.len() / 2, bytes.len() - 1] {
        files.push((bytes[..n].to_vec(), "not a weights file: "));
    }
    for (file, words) in files {
        let problem = TrainedDetector::from_bytes(&file).expect_err(words).to_string();
        assert!(problem.contains(words) && !problem.contains('\n'), "{words}: {problem}");
    }
}
