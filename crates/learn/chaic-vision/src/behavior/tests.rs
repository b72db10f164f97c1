//! Promises: crops show the person at one scale, clips are those of the world's events, and the network
//! learns and is read back.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::sight::TrueSight;
use chaic_core::Vec3;
use chaic_core::geom::{Camera, yaw_rotation};
use chaic_core::observation::{FilmFrame, Images};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{Checkpoint, Training as _, parse_rules};

use super::Behavior;
use super::clip::{CROPS, Clip, SLACK};
use super::collect::{CollectRules, Collector, Counts, collect};
use super::crop::{Crop, FILM, SIDE};
use super::network::{TrainedBehavior, softmax};
use super::report::{calibrate, outputs_of, report};
use super::store::ClipFolder;
use super::train::{BehaviorRules, BehaviorTrainer, BehaviorTraining};
use crate::views::Part;

static NEVER: AtomicBool = AtomicBool::new(false);

/// A film of a wall with a red column of 0.3 m before it, so many metres ahead.
fn film(distance_m: f32) -> FilmFrame {
    let camera = Camera {
        eye_in_world: Vec3::new(0.0, 1.65, 0.0),
        world_from_camera: yaw_rotation(0.0),
        vertical_fov_rad: Camera::EYE_FOV_RAD,
        width: FILM.image_size,
        height: FILM.image_size,
    };
    let n = FILM.image_size;
    let (mut rgb, mut depth_m) = (Vec::new(), Vec::new());
    for pixel in 0..n * n {
        let aside = camera.unproject(pixel % n, pixel / n, distance_m).x;
        let is_column = aside.abs() < 0.15;
        rgb.extend(if is_column { [255, 0, 0] } else { [128; 3] });
        depth_m.push(if is_column { distance_m } else { distance_m + 2.0 });
    }
    let images = Images { rgb: Some(rgb), depth_m: Some(depth_m), ids: None };
    FilmFrame { frame: 0, camera, images }
}

#[test]
fn a_crop_has_the_same_scale_at_any_distance() {
    for distance_m in [1.5, 3.0, 6.0] {
        let crop = Crop::of(&film(distance_m), Vec3::new(0.0, 0.9, -distance_m), 0.0);
        assert!((crop.distance_m - distance_m).abs() < 1e-4);
        let row = &crop.depth[SIDE * SIDE / 2..][..SIDE];
        let n_near = row.iter().filter(|d| Crop::behind_m(**d).abs() < 0.1).count();
        // 0.3 of 2.4 metres, less or more one pixel of the film.
        assert!((5..=8).contains(&n_near), "{n_near} columns at {distance_m} m");
        assert_eq!(crop.rgb[3 * (SIDE * SIDE / 2 + SIDE / 2)], 255);
    }
    let behind = Crop::of(&film(3.0), Vec3::new(0.0, 0.9, 3.0), 0.0);
    assert!(behind.is_blank(), "who stands behind the eye isn't there");
}

fn few() -> CollectRules {
    CollectRules { of_each: 6, episodes: 6, varied: 0.0, ..CollectRules::default() }
}

#[test]
fn clips_are_whole_show_the_person_and_are_the_same_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let rules = few();
    let folder = ClipFolder::open(dir.path(), Part::Training, &rules).unwrap();
    let clips = |n_threads, folder| {
        let collector =
            Collector { part: Part::Training, rules: &rules, sight: &TrueSight, n_threads, folder };
        collect(&collector, &mut |_, _| (), &NEVER).unwrap().unwrap()
    };
    let one = clips(1, None);
    assert!(one == clips(2, Some(&folder)), "clips differ between one thread and two");
    assert!(one == clips(2, Some(&folder)), "clips differ when they are read again");
    // A flag that is raised while the first round is played leaves nothing behind.
    let (other, stop) = (tempfile::tempdir().unwrap(), AtomicBool::new(false));
    let folder = ClipFolder::open(other.path(), Part::Training, &rules).unwrap();
    let collector = Collector {
        part: Part::Training,
        rules: &rules,
        sight: &TrueSight,
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
        assert!(frames.into_iter().all(|n| n == FILM.every_frames));
        let n_seen = clip.crops[..CROPS].iter().filter(|crop| !crop.is_blank()).count();
        assert!(5 * n_seen >= CROPS && (!clip.is_mixed || clip.label == Behavior::Moving));
    }
}

/// Clips of two behaviors that differ in color.
fn made_up() -> Vec<Clip> {
    let crop = |red: u8, k: usize| Crop {
        frame: FILM.every_frames * k as u32,
        distance_m: 2.0,
        speed: 0.01,
        rgb: (0..3 * SIDE * SIDE).map(|c| if c % 3 == 0 { red } else { 90 }).collect(),
        depth: vec![128; SIDE * SIDE],
    };
    let clip = |label, red| Clip {
        label,
        is_mixed: false,
        crops: (0..CROPS + SLACK).map(|k| crop(red, k)).collect(),
    };
    vec![clip(Behavior::PickedUp, 10), clip(Behavior::PutIn, 245)]
}

#[test]
fn the_network_learns_goes_on_from_a_checkpoint_and_is_read_back() {
    let rules = BehaviorRules { steps: 40, clips: 2, warm_up: 5, ..BehaviorRules::default() };
    let mut trainer = BehaviorTrainer::new(rules, made_up());
    let first = trainer.step().loss;
    let checkpoint = |trainer: &BehaviorTrainer| {
        let mut checkpoint = Checkpoint::default();
        trainer.learner.save(&mut checkpoint);
        checkpoint
    };
    let mut resumed = BehaviorTrainer::new(rules, made_up());
    assert!(resumed.learner.load(&Checkpoint::default()).is_err());
    resumed.learner.load(&checkpoint(&trainer)).unwrap();
    assert_eq!(trainer.step(), resumed.step());
    assert!(checkpoint(&trainer) == checkpoint(&resumed));
    let last = (0..38).map(|_| trainer.step().loss).last().unwrap();
    assert!(last < 0.5 * first, "{first} to {last}");

    let mut trained = trainer.trained();
    trained.sharpness = 1.5;
    let bytes = trained.to_bytes().unwrap();
    let read = TrainedBehavior::from_bytes(&bytes).unwrap();
    assert!(read.numbers == trained.numbers && read.sharpness == 1.5);
    assert!(TrainedBehavior::from_bytes(&bytes[..100]).is_err());
    let outputs = outputs_of(&read, &made_up(), 1, &NEVER).unwrap();
    assert_eq!(Some(&outputs), outputs_of(&read, &made_up(), 2, &NEVER).as_ref());
    let found = report(&read, &made_up(), 1, &NEVER).unwrap();
    assert_eq!((found.clips, found.confusion["put in"].values().sum::<usize>()), (2, 1));
    assert!(softmax(&outputs[0]).iter().sum::<f32>() > 0.999);
}

#[test]
fn calibration_makes_who_is_too_sure_less_sure() {
    let clips = made_up();
    // Half right, and sure of it.
    let sure = [8.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(calibrate(&clips, &[sure, sure]) < 0.3);
    let modest = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert!(calibrate(&clips[..1], &[modest]) > 3.0, "always right, and hardly sure");
}

#[test]
fn damaged_checkpoints_and_numbers_out_of_bounds_are_refused() {
    let rules = BehaviorRules { steps: 40, clips: 2, ..BehaviorRules::default() };
    let mut training = BehaviorTraining::with_clips(rules, made_up(), made_up());
    refuses_damaged_checkpoints(&mut training);
    bounds_every_number::<BehaviorTraining>();
    assert!(parse_rules::<BehaviorTraining>("shards = 256\nclips = 60").is_err());
    assert!(training.validate(&AtomicBool::new(true)).unwrap().is_none());
}
