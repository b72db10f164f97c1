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
use super::calibration::{BehaviorScores, Calibration, softmax};
use super::clip::{
    CROPS, Clip, ClipAugmentation, ClipCounts, ClipSet, N_CHANNELS, N_EXTRA_CROPS, fill_input,
    is_seen_enough,
};
use super::collect::{Collector, collect, with_noise};
use super::config::ClipCollectionConfig;
use super::crop::{HISTORY, PersonCrop, PersonCropper, SIDE};
use super::network::TrainedBehavior;
use super::report::{all_outputs, report, report_of_outputs};
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
            PersonCrop::new(&history_frame(distance_m), Vec3::new(0.0, 0.9, -distance_m), None);
        assert!((crop.distance_m - distance_m).abs() < 1e-4 && crop.is_seen);
        let row = &crop.depth[SIDE * SIDE / 2..][..SIDE];
        let n_near = row.iter().filter(|d| PersonCrop::behind_m(**d).abs() < 0.1).count();
        // 0.3 of 2.4 meters, plus or minus one pixel of the image.
        assert!((5..=8).contains(&n_near), "{n_near} columns at {distance_m} m");
        assert_eq!(crop.rgb[3 * (SIDE * SIDE / 2 + SIDE / 2)], 255);
    }
    let behind = PersonCrop::new(&history_frame(3.0), Vec3::new(0.0, 0.9, 3.0), None);
    assert!(behind.is_blank(), "a person behind the camera is not visible");
}

#[test]
fn a_hidden_or_absent_person_is_not_seen() {
    let at = Vec3::new(0.0, 0.9, -4.0);
    // A column at 3 m hides the place, one at 5 m stands behind it.
    for (distance_m, is_seen) in [(3.0, false), (3.9, true), (4.1, true), (5.0, false)] {
        let crop = PersonCrop::new(&history_frame(distance_m), at, None);
        assert!(!crop.is_blank() && crop.is_seen == is_seen, "column at {distance_m} m");
    }
}

#[test]
fn an_unknown_speed_differs_from_standing() {
    let at = Vec3::new(0.0, 0.9, -3.0);
    let mut input = vec![0.0; CROPS * SIDE * SIDE * N_CHANNELS];
    for (speed, expected) in [(None, -1.0), (Some(0.0), 0.0), (Some(0.05), 1.0)] {
        let crops = vec![PersonCrop::new(&history_frame(3.0), at, speed); CROPS];
        fill_input(&crops, &ClipAugmentation::identity(0), &mut input);
        let last = input[N_CHANNELS - 1];
        assert!((last - expected).abs() < 1e-6, "{last} for {speed:?}");
    }
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
    let mut check = |now: Frame, at: Option<f32>, expected: (f32, Option<f32>)| {
        let (distance_m, speed) = crop(now, at);
        let is_close = (distance_m - expected.0).abs() < 1e-4
            && speed.is_some() == expected.1.is_some()
            && (speed.unwrap_or(0.0) - expected.1.unwrap_or(0.0)).abs() < 1e-4;
        assert!(is_close, "{distance_m} m, speed {speed:?} at frame {now}");
    };
    check(0, Some(3.0), (3.0, None));
    check(3, Some(3.08), (3.0, Some(0.0)));
    check(6, Some(2.93), (3.0, Some(0.0)));
    check(9, None, (3.0, None));
    // The last sighting was at frame 6. The crop follows all but 0.1 m of a longer displacement.
    check(12, Some(3.7), (3.6, Some(0.1)));
    check(15, None, (3.6, None));
    // An old sighting determines no crop, and no speed.
    check(12 + 45, None, (0.0, None));
    check(60, Some(2.0), (2.0, None));
}

#[test]
fn crops_follow_the_person_during_a_long_action() {
    let mut cropper = PersonCropper::default();
    let image = |frame: Frame, distance_m| HistoryFrame { frame, ..history_frame(distance_m) };
    let at = |distance_m: f32| Some(Vec3::new(0.0, 0.9, -distance_m));
    assert!(cropper.crop(0, &[image(0, 3.0)], at(3.0))[0].is_seen);
    // An action of 60 frames, longer than the maximum age of a sighting. Images 5 to 9 do not show the person.
    let is_shown = |k: usize| !(5..10).contains(&k);
    let shown_m = |k: usize| if is_shown(k) { 3.0 + 0.1 * (k + 1) as f32 } else { 8.0 };
    let images: Vec<HistoryFrame> =
        (0..20usize).map(|k| image(3 * (k as Frame + 1), shown_m(k))).collect();
    let seen = cropper.clone().crop(60, &images, at(5.1));
    let distances_m: Vec<f32> = seen.iter().map(|crop| crop.distance_m).collect();
    for (k, distance_m) in [(0, 3.1), (9, 4.0), (19, 5.0)] {
        assert!((distances_m[k] - distance_m).abs() < 1e-3, "{distances_m:?}");
    }
    assert!(seen.iter().enumerate().all(|(k, crop)| crop.is_seen == is_shown(k)));
    assert!(seen.iter().all(|crop| crop.speed.is_some_and(|v| (v - 2.0 / 60.0).abs() < 1e-4)));
    // Without another sighting the place is known for 45 frames.
    let assumed = cropper.crop(60, &images, None);
    let is_blank: Vec<bool> = assumed.iter().map(PersonCrop::is_blank).collect();
    assert!(!is_blank[13] && is_blank[14], "{is_blank:?}");
    assert!(assumed.iter().all(|crop| crop.speed.is_none()));
    let n_seen = assumed.iter().filter(|crop| crop.is_seen).count();
    assert!(assumed[0].is_seen && n_seen <= 4, "the person leaves the place: {n_seen}");
}

#[test]
fn a_first_sighting_determines_crops_of_the_last_seconds_only() {
    let images: Vec<HistoryFrame> =
        (1..=20).map(|k| HistoryFrame { frame: 3 * k, ..history_frame(3.0) }).collect();
    let crops = PersonCropper::default().crop(60, &images, Some(Vec3::new(0.0, 0.9, -3.0)));
    // Frames 3 to 15 are 45 frames before the sighting or more.
    assert!(crops[..5].iter().all(PersonCrop::is_blank));
    assert!(crops[5..].iter().all(|crop| crop.is_seen && crop.speed.is_none()));
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
    let mut raise = |_, _: &ClipCounts| stop.store(true, Ordering::Relaxed);
    assert!(collect(&collector, &mut raise, &stop).unwrap().is_none());
    assert!(folder.read(0).unwrap().is_none());
    let kept = ClipSet::new(one.clips.clone()).found;
    assert!(kept.iter().zip(one.found).all(|(kept, found)| *kept == found.min(4)), "{kept:?}");
    assert!(one.found[Behavior::Moving.index()] > 4, "the maximum applies to no kind");
    let one = one.clips;
    let labels: BTreeSet<Behavior> = one.iter().map(|clip| clip.label).collect();
    assert!(labels.contains(&Behavior::PickedUp) && labels.contains(&Behavior::Moving));
    for clip in &one {
        assert_eq!(clip.crops.len(), CROPS + N_EXTRA_CROPS);
        let frames = clip.crops.windows(2).map(|pair| pair[1].frame - pair[0].frame);
        assert!(frames.into_iter().all(|n| n == HISTORY.every_frames));
        assert!(clip.crops.windows(CROPS).all(is_seen_enough));
        assert!(!clip.is_mixed || clip.label == Behavior::Moving);
    }
}

/// Clips of two behaviors that differ in color.
fn synthetic_clips() -> Vec<Clip> {
    let crop = |red: u8, k: usize| PersonCrop {
        frame: HISTORY.every_frames * k as u32,
        distance_m: 2.0,
        speed: Some(0.01),
        is_seen: true,
        rgb: (0..3 * SIDE * SIDE).map(|c| if c % 3 == 0 { red } else { 90 }).collect(),
        depth: vec![128; SIDE * SIDE],
    };
    let clip = |label, red| Clip {
        label,
        is_mixed: false,
        episode: 0,
        crops: (0..CROPS + N_EXTRA_CROPS).map(|k| crop(red, k)).collect(),
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
    let class_bias = [0.5, -1.0, 0.25, 0.0, -2.0, 2.0];
    trained.calibration = Calibration { inverse_temperature: 1.5, class_bias };
    let bytes = trained.to_bytes().unwrap();
    let read = TrainedBehavior::from_bytes(&bytes).unwrap();
    assert!(read.parameters == trained.parameters && read.calibration == trained.calibration);
    assert!(TrainedBehavior::from_bytes(&bytes[..100]).is_err());
    let outputs = all_outputs(&read, &synthetic_clips(), 1, &NEVER_STOP).unwrap();
    assert_eq!(Some(&outputs), all_outputs(&read, &synthetic_clips(), 2, &NEVER_STOP).as_ref());
    let found = report(&read, &ClipSet::new(synthetic_clips()), 1, &NEVER_STOP).unwrap();
    assert_eq!((found.clips, found.confusion["put in"].values().sum::<usize>()), (2, 1));
    assert_eq!((found.episodes, found.interval, found.mixed_as_moving), (1, None, None));
    let of_two = synthetic_clips().into_iter().enumerate();
    let of_two: Vec<Clip> = of_two.map(|(k, clip)| Clip { episode: k as u32, ..clip }).collect();
    let found = report(&read, &ClipSet::new(of_two), 1, &NEVER_STOP).unwrap();
    assert!(found.episodes == 2 && found.interval.is_some());
    let found = report(&read, &ClipSet::default(), 1, &NEVER_STOP).unwrap();
    assert_eq!((found.top1, found.top1_in_play, found.calibration_error), (None, None, None));
    assert!(softmax(&outputs[0]).iter().sum::<f32>() > 0.999);
}

#[test]
fn calibration_lowers_overconfident_probabilities() {
    let clips = synthetic_clips();
    let fit = |clips: &[Clip], outputs: &[BehaviorScores]| {
        Calibration::fit(&ClipSet::new(clips.to_vec()), outputs, &[1.0 / 6.0; 6])
    };
    // Half of the predictions are correct, with high confidence.
    let confident = [8.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(fit(&clips, &[confident, confident]).inverse_temperature < 0.3);
    let uncertain = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
    let always_correct = fit(&clips[..1], &[uncertain]);
    assert!(always_correct.inverse_temperature > 3.0, "low confidence: {always_correct:?}");
    assert_eq!(fit(&[], &[]), Calibration::default());
}

/// Plain and mixed clips of a moving person, and those of two actions, with frequencies in play.
fn clips_in_play() -> ClipSet {
    let [picked_up, put_in] = <[Clip; 2]>::try_from(synthetic_clips()).unwrap();
    let moving = Clip { label: Behavior::Moving, ..picked_up.clone() };
    let mixed = Clip { is_mixed: true, ..moving.clone() };
    let clips = vec![picked_up, put_in, moving, mixed];
    // Each behavior counts one more, which makes 100.
    ClipSet { clips, found: [9, 0, 4, 0, 0, 49, 32] }
}

#[test]
fn probabilities_are_those_of_play_not_of_training_batches() {
    let set = clips_in_play();
    assert_eq!(set.weights(), [9.0, 4.0, 49.0, 32.0]);
    // Outputs that hold no information are the frequencies of batches.
    let outputs = [[0.0; 6]; 4];
    let calibration = Calibration::fit(&set, &outputs, &[1.0 / 6.0; 6]);
    let p = calibration.probabilities(&outputs[0]);
    for (p, expected) in p.iter().zip([0.1, 0.01, 0.05, 0.01, 0.01, 0.82]) {
        assert!((p - expected).abs() < 0.005, "{p}, not {expected}");
    }
    // Batches without a behavior say nothing of it.
    let calibration = Calibration::fit(&set, &outputs, &[0.5, 0.0, 0.0, 0.0, 0.0, 0.5]);
    assert_eq!(calibration.class_bias[Behavior::PutIn.index()], 0.0);
}

#[test]
fn a_report_weights_clips_by_their_frequency_in_play() {
    let mut trained = BehaviorLearner::new(BehaviorTrainingConfig::default(), Vec::new()).trained();
    let output = |behavior: Behavior| -> BehaviorScores {
        std::array::from_fn(|k| if k == behavior.index() { 20.0 } else { 0.0 })
    };
    // The mixed clip and the put-in are classified as pick-ups.
    let predictions =
        [Behavior::PickedUp, Behavior::PickedUp, Behavior::Moving, Behavior::PickedUp];
    let found = report_of_outputs(&trained, &clips_in_play(), &predictions.map(output));
    assert!((found.top1.unwrap() - 2.0 / 3.0).abs() < 1e-9, "{found:?}");
    assert!((found.top1_in_play.unwrap() - 58.0 / 94.0).abs() < 1e-9, "{found:?}");
    assert!((found.calibration_error.unwrap() - 36.0 / 94.0).abs() < 1e-3, "{found:?}");
    assert_eq!(found.mixed_as_moving, Some(0.0));
    // If everything moves in play, helpers report no action. The accuracy of the clips stays the same.
    trained.calibration.class_bias[Behavior::Moving.index()] = 40.0;
    let still = report_of_outputs(&trained, &clips_in_play(), &predictions.map(output));
    assert_eq!((still.top1, still.mixed_as_moving), (found.top1, Some(1.0)), "{still:?}");
    assert!((still.top1_in_play.unwrap() - 81.0 / 94.0).abs() < 1e-9, "{still:?}");
}

#[test]
fn a_training_without_clips_is_refused() {
    let mixed = synthetic_clips().into_iter().map(|clip| Clip { is_mixed: true, ..clip });
    for clips in [Vec::new(), mixed.collect()] {
        let refused = BehaviorTrainer::with_clips(
            BehaviorTrainingConfig::default(),
            clips,
            ClipSet::default(),
        );
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
        BehaviorTrainer::with_clips(config, synthetic_clips(), ClipSet::new(synthetic_clips()))
            .unwrap();
    refuses_damaged_checkpoints(&mut trainer);
    bounds_every_number::<BehaviorTrainer>();
    assert!(parse_config::<BehaviorTrainer>("shards = 256\nclips = 60").is_err());
    let fractions = "[collect]\nlearned_fraction = 0.6\nnoisy_fraction = 0.5";
    let refused = parse_config::<BehaviorTrainer>(fractions).unwrap_err().to_string();
    assert!(refused.contains("noisy_fraction"), "{refused}");
    assert!(trainer.validate(&AtomicBool::new(true)).unwrap().is_none());
}
