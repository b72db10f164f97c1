//! Promises: crops show the person at one scale, clips agree with the world's events, and the
//! network learns and can be read back.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::observation::{HistoryFrame, Images};
use chaic_core::rng::RngStream;
use chaic_core::{Frame, Vec3};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{Checkpoint, Trainer as _, TrainingError, parse_config};

use super::Behavior;
use super::clip::{CROPS, Clip, SLACK};
use super::collect::{Collector, Counts, collect, with_noise};
use super::config::ClipCollectionConfig;
use super::crop::{HISTORY, PersonCrop, PersonCropper, SIDE};
use super::network::{TrainedBehavior, softmax};
use super::report::{all_outputs, calibrate, report};
use super::store::ClipFolder;
use super::train::{BehaviorLearner, BehaviorTrainer, BehaviorTrainingConfig};
use crate::views::DatasetSplit;

static NEVER_STOP: AtomicBool = AtomicBool::new(false);

/// Image of a wall behind a red column of 0.3 m width at this distance.
fn history_frame(distance_m: f32) -> HistoryFrame {
    let camera = Camera {
        eye_in_world: Vec3::new(0.0, 1.65, 0.0),
        world_from_camera: yaw_rotation(0.0),
        vertical_fov_rad: Camera::EYE_FOV_RAD,
        width: HISTORY.image_size,
        height: HISTORY.image_size,
    };
    let n = HISTORY.image_size;
    let (mut rgb, mut depth_m) = (Vec::new(), Vec::new());
    for pixel in 0..n * n {
        let lateral_m = camera.unproject(pixel % n, pixel / n, distance_m).x;
        let is_column = lateral_m.abs() < 0.15;
        rgb.extend(if is_column { [255, 0, 0] } else { [128; 3] });
        depth_m.push(if is_column { distance_m } else { distance_m + 2.0 });
    }
    let images = Images { rgb: Some(rgb), depth_m: Some(depth_m), ids: None };
    HistoryFrame { frame: 0, camera, images }
}

#[test]
fn a_crop_has_the_same_scale_at_any_distance() {
    for distance_m in [1.5, 3.0, 6.0] {
        let crop =
            PersonCrop::new(&history_frame(distance_m), Vec3::new(0.0, 0.9, -distance_m), 0.0);
        assert!((crop.distance_m - distance_m).abs() < 1e-4);
        let row = &crop.depth[SIDE * SIDE / 2..][..SIDE];
        let n_near = row.iter().filter(|d| PersonCrop::behind_m(**d).abs() < 0.1).count();
        // 0.3 of 2.4 meters, plus or minus one pixel of the image.
        assert!((5..=8).contains(&n_near), "{n_near} columns at {distance_m} m");
        assert_eq!(crop.rgb[3 * (SIDE * SIDE / 2 + SIDE / 2)], 255);
    }
    let behind = PersonCrop::new(&history_frame(3.0), Vec3::new(0.0, 0.9, 3.0), 0.0);
    assert!(behind.is_blank(), "a person behind the camera is not visible");
}

#[test]
fn crops_ignore_small_displacements_and_bridge_images_without_the_person() {
    let mut cropper = PersonCropper::default();
    let mut crop = |now: Frame, distance_m: Option<f32>| {
        let image = HistoryFrame { frame: now, ..history_frame(3.0) };
        let at = distance_m.map(|distance_m| Vec3::new(0.0, 0.9, -distance_m));
        let [crop] = &cropper.crop(now, &[image], at)[..] else { panic!("one crop per image") };
        (crop.distance_m, crop.speed)
    };
    let is_close = |(distance_m, speed): (f32, f32), expected: [f32; 2]| {
        (distance_m - expected[0]).abs() < 1e-4 && (speed - expected[1]).abs() < 1e-4
    };
    assert!(is_close(crop(0, Some(3.0)), [3.0, 0.0]));
    for (now, distance_m) in [(3, Some(3.08)), (6, Some(2.93)), (9, None)] {
        assert!(is_close(crop(now, distance_m), [3.0, 0.0]), "at frame {now}");
    }
    // The last sighting was at frame 6. The crop follows all but 0.1 m of a longer displacement.
    assert!(is_close(crop(12, Some(3.7)), [3.6, 0.1]));
    assert!(is_close(crop(15, None), [3.6, 0.1]));
    assert!(crop(12 + 45, None).0 == 0.0, "an old sighting determines no crop");
    assert!(is_close(crop(60, Some(2.0)), [2.0, 0.0]));
}

#[test]
fn crops_follow_the_person_during_a_long_action() {
    let mut cropper = PersonCropper::default();
    let image = |frame: Frame| HistoryFrame { frame, ..history_frame(4.0) };
    let at = |distance_m: f32| Some(Vec3::new(0.0, 0.9, -distance_m));
    assert!(cropper.crop(0, &[image(0)], at(3.0))[0].is_seen);
    // An action of 60 frames, longer than the maximum age of a sighting.
    let images: Vec<HistoryFrame> = (1..=20).map(|k| image(3 * k)).collect();
    let seen = cropper.clone().crop(60, &images, at(5.1));
    let distances_m: Vec<f32> = seen.iter().map(|crop| crop.distance_m).collect();
    for (k, distance_m) in [(0, 3.1), (9, 4.0), (19, 5.0)] {
        assert!((distances_m[k] - distance_m).abs() < 1e-3, "{distances_m:?}");
    }
    assert!(seen.iter().all(|crop| crop.is_seen));
    // Without another sighting the place is known for 45 frames.
    let assumed = cropper.crop(60, &images, None);
    let is_blank: Vec<bool> = assumed.iter().map(PersonCrop::is_blank).collect();
    assert!(!is_blank[13] && is_blank[14], "{is_blank:?}");
    assert!(assumed.iter().all(|crop| !crop.is_seen));
}

#[test]
fn position_noise_has_the_documented_quantiles() {
    let mut rng = RngStream::new(1, "noise", 0);
    let error_m = |_| with_noise(Vec3::ZERO, &mut rng).length();
    let mut errors: Vec<f32> = (0..10_000).map(error_m).collect();
    errors.sort_by(f32::total_cmp);
    for (rank, expected) in [(5_000, 0.018), (9_000, 0.081), (9_900, 0.151)] {
        let error = errors[rank];
        assert!((error / expected - 1.0).abs() < 0.1, "{error} at rank {rank}, not {expected}");
    }
}

fn small_collection() -> ClipCollectionConfig {
    ClipCollectionConfig {
        max_per_class: 4,
        episodes: 3,
        varied_fraction: 0.0,
        noisy_fraction: 0.8,
        ..ClipCollectionConfig::default()
    }
}

#[test]
fn clips_are_contiguous_show_the_person_and_do_not_depend_on_threads() {
    let dir = tempfile::tempdir().unwrap();
    let config = small_collection();
    let folder =
        ClipFolder::open(dir.path(), DatasetSplit::Train, &config, &GroundTruthPerceptionFactory)
            .unwrap();
    let clips_of = |config: &ClipCollectionConfig, n_threads, folder| {
        let collector = Collector {
            split: DatasetSplit::Train,
            config,
            perception: &GroundTruthPerceptionFactory,
            n_threads,
            folder,
        };
        collect(&collector, &mut |_, _| (), &NEVER_STOP).unwrap().unwrap()
    };
    let clips = |n_threads, folder| clips_of(&config, n_threads, folder);
    let one = clips(1, None);
    assert!(one == clips(2, Some(&folder)), "clips differ between one thread and two");
    assert!(one == clips(2, Some(&folder)), "clips differ when they are read again");
    let exact = ClipCollectionConfig { noisy_fraction: 0.0, ..config };
    assert!(one != clips_of(&exact, 2, None), "no episode is noisy");
    // A flag that is set during the first round leaves no files.
    let (other_dir, stop) = (tempfile::tempdir().unwrap(), AtomicBool::new(false));
    let folder = ClipFolder::open(
        other_dir.path(),
        DatasetSplit::Train,
        &config,
        &GroundTruthPerceptionFactory,
    )
    .unwrap();
    let collector = Collector {
        split: DatasetSplit::Train,
        config: &config,
        perception: &GroundTruthPerceptionFactory,
        n_threads: 2,
        folder: Some(&folder),
    };
    let mut raise = |_, _: &Counts| stop.store(true, Ordering::Relaxed);
    assert!(collect(&collector, &mut raise, &stop).unwrap().is_none());
    assert!(folder.read(0).unwrap().is_none());
    let labels: BTreeSet<Behavior> = one.iter().map(|clip| clip.label).collect();
    assert!(labels.contains(&Behavior::PickedUp) && labels.contains(&Behavior::Moving));
    for clip in &one {
        assert_eq!(clip.crops.len(), CROPS + SLACK);
        let frames = clip.crops.windows(2).map(|pair| pair[1].frame - pair[0].frame);
        assert!(frames.into_iter().all(|n| n == HISTORY.every_frames));
        let n_seen = clip.crops[..CROPS].iter().filter(|crop| crop.is_seen).count();
        assert!(5 * n_seen >= CROPS && (!clip.is_mixed || clip.label == Behavior::Moving));
    }
}

/// Clips of two behaviors that differ in color.
fn synthetic_clips() -> Vec<Clip> {
    let crop = |red: u8, k: usize| PersonCrop {
        frame: HISTORY.every_frames * k as u32,
        distance_m: 2.0,
        speed: 0.01,
        is_seen: true,
        rgb: (0..3 * SIDE * SIDE).map(|c| if c % 3 == 0 { red } else { 90 }).collect(),
        depth: vec![128; SIDE * SIDE],
    };
    let clip = |label, red| Clip {
        label,
        is_mixed: false,
        episode: 0,
        crops: (0..CROPS + SLACK).map(|k| crop(red, k)).collect(),
    };
    vec![clip(Behavior::PickedUp, 10), clip(Behavior::PutIn, 245)]
}

#[test]
fn the_network_learns_resumes_and_is_read_back() {
    let config = BehaviorTrainingConfig {
        steps: 40,
        batch_size: 2,
        warm_up: 5,
        ..BehaviorTrainingConfig::default()
    };
    let mut learner = BehaviorLearner::new(config, synthetic_clips());
    let first = learner.step().loss;
    let checkpoint = |learner: &BehaviorLearner| {
        let mut checkpoint = Checkpoint::default();
        learner.learner.save(&mut checkpoint);
        checkpoint
    };
    let mut resumed = BehaviorLearner::new(config, synthetic_clips());
    assert!(resumed.learner.load(&Checkpoint::default()).is_err());
    resumed.learner.load(&checkpoint(&learner)).unwrap();
    assert_eq!(learner.step(), resumed.step());
    assert!(checkpoint(&learner) == checkpoint(&resumed));
    let last = (0..38).map(|_| learner.step().loss).last().unwrap();
    assert!(last < 0.5 * first, "{first} to {last}");

    let mut trained = learner.trained();
    trained.inverse_temperature = 1.5;
    let bytes = trained.to_bytes().unwrap();
    let read = TrainedBehavior::from_bytes(&bytes).unwrap();
    assert!(read.parameters == trained.parameters && read.inverse_temperature == 1.5);
    assert!(TrainedBehavior::from_bytes(&bytes[..100]).is_err());
    let outputs = all_outputs(&read, &synthetic_clips(), 1, &NEVER_STOP).unwrap();
    assert_eq!(Some(&outputs), all_outputs(&read, &synthetic_clips(), 2, &NEVER_STOP).as_ref());
    let found = report(&read, &synthetic_clips(), 1, &NEVER_STOP).unwrap();
    assert_eq!((found.clips, found.confusion["put in"].values().sum::<usize>()), (2, 1));
    assert_eq!((found.episodes, found.interval, found.mixed_as_moving), (1, None, None));
    let of_two = synthetic_clips().into_iter().enumerate();
    let of_two: Vec<Clip> = of_two.map(|(k, clip)| Clip { episode: k as u32, ..clip }).collect();
    let found = report(&read, &of_two, 1, &NEVER_STOP).unwrap();
    assert!(found.episodes == 2 && found.interval.is_some());
    assert_eq!(report(&read, &[], 1, &NEVER_STOP).unwrap().top1, None);
    assert!(softmax(&outputs[0]).iter().sum::<f32>() > 0.999);
}

#[test]
fn calibration_lowers_overconfident_probabilities() {
    let clips = synthetic_clips();
    // Half of the predictions are correct, with high confidence.
    let confident = [8.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(calibrate(&clips, &[confident, confident]) < 0.3);
    let uncertain = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(calibrate(&clips[..1], &[uncertain]) > 3.0, "always correct with low confidence");
    assert_eq!(calibrate(&[], &[]), 1.0);
}

#[test]
fn a_training_without_clips_is_refused() {
    let mixed = synthetic_clips().into_iter().map(|clip| Clip { is_mixed: true, ..clip });
    for clips in [Vec::new(), mixed.collect()] {
        let refused =
            BehaviorTrainer::with_clips(BehaviorTrainingConfig::default(), clips, Vec::new());
        let problem = refused.err().expect("no batch can be drawn").to_string();
        assert!(problem.contains("no clips"), "{problem}");
    }
}

#[test]
fn clips_that_cannot_be_stored_are_a_failed_file_operation() {
    let dir = tempfile::tempdir().unwrap();
    // A file in place of the folder of clips.
    std::fs::write(dir.path().join("clips"), "").unwrap();
    let config = BehaviorTrainingConfig::default();
    let trainer = BehaviorTrainer::new(&config, dir.path(), &mut |_| (), &NEVER_STOP);
    // A training keeps the data that it has collected before such an error.
    assert!(matches!(trainer, Err(TrainingError::File(_))));
}

#[test]
fn a_training_names_the_changed_key_of_its_clips() {
    let dir = tempfile::tempdir().unwrap();
    let stopped = AtomicBool::new(true);
    let new = |episodes| {
        let collect = ClipCollectionConfig { episodes, ..ClipCollectionConfig::default() };
        let config = BehaviorTrainingConfig { collect, ..BehaviorTrainingConfig::default() };
        BehaviorTrainer::new(&config, dir.path(), &mut |_| (), &stopped)
    };
    assert!(new(700).unwrap().is_none());
    let refused = new(8).err().unwrap();
    let expected =
        "`collect.episodes` is 8, but was 700 when the clips were collected; set it back";
    assert!(refused.is_usage() && refused.to_string().contains(expected), "{refused}");
    assert!(new(700).unwrap().is_none());
}

#[test]
fn a_training_that_has_diverged_has_no_finite_loss() {
    let config =
        BehaviorTrainingConfig { steps: 40, batch_size: 1, ..BehaviorTrainingConfig::default() };
    let mut learner = BehaviorLearner::new(config, synthetic_clips());
    assert!(learner.step().loss.is_finite());
    let last = learner.learner.parameters.last_mut().unwrap();
    *last = f32::NAN;
    assert!(learner.step().loss.is_nan());
}

#[test]
fn damaged_checkpoints_and_values_out_of_bounds_are_refused() {
    let config =
        BehaviorTrainingConfig { steps: 40, batch_size: 2, ..BehaviorTrainingConfig::default() };
    let mut trainer =
        BehaviorTrainer::with_clips(config, synthetic_clips(), synthetic_clips()).unwrap();
    refuses_damaged_checkpoints(&mut trainer);
    bounds_every_number::<BehaviorTrainer>();
    assert!(parse_config::<BehaviorTrainer>("shards = 256\nclips = 60").is_err());
    let fractions = "[collect]\nlearned_fraction = 0.6\nnoisy_fraction = 0.5";
    let refused = parse_config::<BehaviorTrainer>(fractions).unwrap_err().to_string();
    assert!(refused.contains("noisy_fraction"), "{refused}");
    assert!(trainer.validate(&AtomicBool::new(true)).unwrap().is_none());
}
