//! Promise: the first observation of a helper reveals neither task nor partner. Briefings of one
//! scene kind differ in listed fields only, and start poses predict nothing.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::TaskId;
use chaic_core::geom::math;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::task::SceneKind;
use chaic_episodes::{Split, episodes};
use chaic_eval::audit::opening::{InitialInformation, distinct, predict, varying_fields};

/// Fields of a briefing that may differ between episodes of one scene kind, with the reason.
const MAY_VARY: [(&str, &str); 1] =
    [("bounds", "each house has its own extent, which all its tasks share")];

/// Minimum accuracy above chance of a leak, standard deviations; the false-positive rate is 1 in
/// 30,000.
const LEAK_Z: f64 = 4.0;

const SCENES: [SceneKind; 3] = [SceneKind::House, SceneKind::Street, SceneKind::Yard];

/// Returns openings of the first episodes of each task, by scene kind.
fn openings(
    split: &Split,
    first: usize,
    grants: Grants,
) -> Vec<(SceneKind, Vec<InitialInformation>)> {
    let scene_openings = |scene: SceneKind| {
        let tasks = TaskId::paper().filter(|task| task.info().scene == scene);
        let all = tasks.flat_map(|task| episodes(split, task).take(first));
        let opening =
            |episode| InitialInformation::new(&episode, grants, SensorConfig::NONE).unwrap();
        (scene, all.map(|episode| opening(episode.unwrap())).collect())
    };
    SCENES.map(scene_openings).into()
}

/// Returns the varying fields that are not in [`MAY_VARY`].
fn unexpected(openings: &[&InitialInformation]) -> Vec<String> {
    let may_vary = |field: &str| {
        let is_below =
            |name: &str| field.strip_prefix(name).is_some_and(|suffix| suffix.starts_with('.'));
        MAY_VARY.iter().any(|(name, _)| is_below(name))
    };
    let varying = varying_fields(openings, |o| &o.briefing).into_iter().map(|(name, _)| name);
    varying.filter(|name| !may_vary(name)).collect()
}

#[test]
fn a_briefing_differs_between_episodes_of_one_scene_kind_in_listed_fields_only() {
    // Without decoys, the class of the goal place reveals the task (docs/grants.md).
    let cases = [
        (Split::Standard, Grants::NONE),
        (Split::Standard, Grants::PLANNER),
        (Split::Test, Grants::NONE),
    ];
    for (split, grants) in cases {
        let mut seeds = BTreeSet::new();
        for (scene, all) in openings(&split, 6, grants) {
            let all: Vec<&InitialInformation> = all.iter().collect();
            assert!(all.len() >= 6, "{split}, {scene:?}");
            assert_eq!(unexpected(&all), Vec::<String>::new(), "{split}, {scene:?}");
            seeds.extend(all.iter().map(|o| o.briefing["seed"].clone()));
        }
        assert_eq!(seeds.len(), 1, "a seed that names no episode: {split}, {seeds:?}");
    }
}

#[test]
fn tasks_of_one_house_share_its_bounds() {
    let (_, all) = openings(&Split::Test, 6, Grants::NONE).remove(0);
    let mut by_task: BTreeMap<TaskId, Vec<Option<&String>>> = BTreeMap::new();
    for opening in &all {
        by_task.entry(opening.task).or_default().push(opening.briefing.get("bounds.max.0"));
    }
    let bounds: BTreeSet<_> = by_task.into_values().collect();
    assert_eq!(bounds.len(), 1, "{bounds:?}");
}

#[test]
fn a_start_pose_predicts_neither_task_nor_partner() {
    for split in [Split::Generated(700_000..700_060), Split::GeneratedStandard(700_000..700_060)] {
        let (_, all) = openings(&split, usize::MAX, Grants::NONE).remove(0);
        let all: Vec<&InitialInformation> = all.iter().collect();
        assert_eq!(
            distinct(&all, |o| o.proprioception.clone()),
            all.len(),
            "poses differ, so there is something to find"
        );
        let labels: [fn(&InitialInformation) -> String; 2] =
            [|o| o.task.to_string(), |o| o.partner.to_string()];
        for label in labels {
            let found = predict(&all, label);
            assert!(found.z() < LEAK_Z, "{split}: {found:?}");
        }
        // Poses are in whole millimeters and multiples of a turn in all tasks, so low-order bits
        // reveal nothing.
        for opening in all {
            let [x, z, sin, cos] = opening.pose;
            let whole = |v: f64, unit: f64| ((v / unit) - (v / unit).round()).abs() < 1e-2;
            let turns = f64::from(math::atan2(sin as f32, cos as f32).to_degrees());
            assert!(whole(x, 1e-3) && whole(z, 1e-3) && whole(turns, 15.0), "{:?}", opening.pose);
        }
    }
}
