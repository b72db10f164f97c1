//! Promises: perfect detections are tracked and remembered; errors lower the scores; the nearest
//! pairs of one class match; people are found near their position only; no episode is played twice.

use chaic_agents::perception::SegmentMeasurement;

use super::*;
use crate::noisy::{DetectorNoiseModel, NoisyPerceptionFactory};

fn report_of(noise: DetectorNoiseModel) -> TrackReport {
    let perception = NoisyPerceptionFactory::new(noise, "noisy".to_owned());
    let stop = AtomicBool::new(false);
    evaluate_tracks(&perception, DatasetSplit::Validation, 2, 2, &|| (), &stop).expect("no stop")
}

#[test]
fn perfect_detections_are_remembered_and_errors_lower_the_scores() {
    let perfect = report_of(DetectorNoiseModel::none());
    assert!(perfect.episodes == 2 && perfect.failures.is_empty(), "{perfect:?}");
    let value = |rate: RateEstimate| rate.value.unwrap();
    assert!(value(perfect.detection_precision) > 0.99, "{perfect:?}");
    assert!(value(perfect.detection_recall) > 0.95, "{perfect:?}");
    assert!(value(perfect.memory_recall) > 0.9, "{perfect:?}");
    // A few of the 34 sightings show only a part of the person, with another mean of its points.
    assert!(value(perfect.person_precision) > 0.9, "{:?}", perfect.person_precision);
    assert!(value(perfect.person_recall) > 0.9, "{:?}", perfect.person_recall);
    // Nearly all objects are first detected within 10 m.
    let n = perfect.memory_precision.n;
    let in_range: usize = perfect.memory_precision_by_m.values().map(|rate| rate.n).sum();
    assert!(in_range <= n && 10 * in_range >= 9 * n && n > 0, "{perfect:?}");
    let noisy = report_of(DetectorNoiseModel {
        misclassification_rate: 0.3,
        false_positives_per_image: 0.2,
        ..DetectorNoiseModel::none()
    });
    let values =
        |rate: fn(&TrackReport) -> RateEstimate| [&noisy, &perfect].map(|r| value(rate(r)));
    let [noisy_precision, perfect_precision] = values(|report| report.detection_precision);
    assert!(noisy_precision < perfect_precision, "{noisy:?}");
    let [noisy_precision, perfect_precision] = values(|report| report.memory_precision);
    assert!(noisy_precision < perfect_precision, "{noisy:?}");
    let [noisy_switches, perfect_switches] = values(|report| report.identity_switches);
    assert!(noisy_switches > perfect_switches, "{noisy:?}");
}

#[test]
fn ratios_without_counts_and_intervals_of_one_episode_are_undefined() {
    let rate = |counts: &[[usize; 2]]| RateEstimate::new(counts.iter().copied());
    let undefined = RateEstimate { value: None, interval: None, n: 0 };
    assert_eq!(rate(&[]), undefined);
    assert_eq!(rate(&[[0, 0], [0, 0]]), undefined);
    let one_episode = RateEstimate { value: Some(0.5), interval: None, n: 4 };
    assert_eq!(rate(&[[2, 4]]), one_episode);
    assert_eq!(rate(&[[0, 0], [2, 4], [0, 0]]), one_episode);
    assert_eq!(
        rate(&[[1, 2], [2, 4]]),
        RateEstimate { value: Some(0.5), interval: Some(0.0), n: 6 }
    );
    // Without any image, the confidences have no calibration error either.
    assert_eq!(TrackReport::new(&[EpisodeRecord::default()]).calibration_error, None);
}

#[test]
fn no_episode_is_played_twice_whichever_seeds_are_invalid() {
    let n_tasks = TaskId::paper().count() as u64;
    for split in [DatasetSplit::Validation, DatasetSplit::Test] {
        let n_seeds = SeedRange::perception(split).count;
        let mut episodes = BTreeSet::new();
        for k in 0..u64::from(MAX_EPISODES) {
            for attempt in 0..MAX_ATTEMPTS {
                let position = seed_position(k, attempt, n_seeds);
                assert!(position < n_seeds);
                assert!(episodes.insert((k % n_tasks, position)), "{k}, attempt {attempt}");
            }
        }
    }
}

#[test]
fn an_episode_that_broke_down_is_a_failure() {
    let result = |played| evaluated("obstacle/gen-standard/1", &played, EpisodeRecord::default());
    assert!(result(Ok(AdvanceOutcome::Ended)).is_ok());
    let failure = result(Err(AgentError::Broken("no image".to_owned()))).unwrap_err();
    assert_eq!(failure.episode, "obstacle/gen-standard/1");
    assert!(failure.problem.contains("no image"), "{failure:?}");
    assert!(result(Ok(AdvanceOutcome::Stopped)).is_err());
}

#[test]
fn a_person_far_from_its_detection_is_not_found() {
    let person = |agent: u8, x: f32, n_pixels: u32| {
        let extent = SegmentMeasurement {
            pixel: [0; 2],
            position_in_world: Vec3::new(x, 1.0, 0.0),
            bottom_m: 0.0,
            top_m: 1.7,
            n_pixels,
            footprint: Vec::new(),
        };
        let agent = AgentId(agent);
        let track = EntityId::from_agent(agent).into();
        Detection::new(track, ClassId::named("person"), Some(agent), extent)
    };
    let mut counts = PersonCounts::default();
    let truths = [person(1, 0.0, 500), person(2, 5.0, MIN_AREA_PX - 1)];
    counts.add(&[person(1, 0.4, 450)], &truths);
    counts.add(&[person(1, 0.6, 450), person(2, 5.0, 90)], &truths);
    assert_eq!((counts.detected, counts.correct), (3, 2));
    assert_eq!((counts.visible, counts.found), (2, 1));
}

#[test]
fn the_nearest_pairs_of_one_class_match() {
    let sighting = |class: &str, x: f32| Sighting {
        class: ClassId::named(class),
        position_in_world: Vec3::new(x, 0.0, 0.0),
    };
    let remembered = |class: &str, x: f32, nearest_m: f32| RememberedObject {
        sighting: sighting(class, x),
        nearest_m,
    };
    let truth = |class: &str, x: f32, nearest_m: f32| TrueObject {
        last: sighting(class, x),
        nearest_m,
        track: None,
        n_switches: 0,
    };
    let record = EpisodeRecord {
        objects: BTreeMap::from([
            (EntityId(10), truth("apple", 0.0, 1.0)),
            (EntityId(11), truth("apple", 0.4, 3.0)),
            (EntityId(12), truth("banana", 5.0, 3.5)),
            (EntityId(13), truth("banana", 9.0, f32::INFINITY)),
        ]),
        memory: vec![
            remembered("apple", 0.3, 1.5),
            remembered("apple", 0.35, 3.0),
            remembered("bread", 5.0, 3.5),
        ],
        ..EpisodeRecord::default()
    };
    assert_eq!(record.matches(), [Some(EntityId(10)), Some(EntityId(11)), None]);
    assert_eq!(record.memory_recall([0.0, 10.0]), [2, 3]);
    assert_eq!(record.memory_recall([2.0, 4.0]), [1, 2]);
    assert_eq!(record.memory_precision([0.0, 2.0]), [1, 1]);
    assert_eq!(record.memory_precision([2.0, 4.0]), [1, 2]);
    assert_eq!(record.memory_precision([4.0, 10.0]), [0, 0]);
    let rate = RateEstimate::new([[1, 2], [3, 4]].into_iter());
    assert!((rate.value.unwrap() - 4.0 / 6.0).abs() < 1e-9 && rate.n == 6);
    assert!(rate.interval > Some(0.0));
}
