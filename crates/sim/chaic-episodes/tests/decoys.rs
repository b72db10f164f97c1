//! Promise of decoys: what stands and lies in a house doesn't tell the task, but for what the task
//! is about. A simple classifier of inventories must be near chance with decoys, and must find the
//! task without.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use chaic_core::task::SceneKind;
use chaic_core::{ClassId, Role, TaskId};
use chaic_episodes::{Seeds, Settings, generate_with, validate};
use chaic_world::{Rules, Setup, Thing, World};

/// Episodes of each task; the first half is learned from.
const N: u64 = 48;
/// Chance of a guess among six tasks.
const CHANCE: f64 = 1.0 / 6.0;
/// How far above chance luck gets: four standard errors of 144 guesses.
const LUCK: f64 = 0.125;
/// How far above chance the heights of containers get somebody who knows their distribution: four
/// are high in all episodes of high container, and in a quarter of the others.
const CONTAINERS: f64 = 0.125;

fn indoor() -> Vec<TaskId> {
    TaskId::paper().filter(|t| t.info().scene == SceneKind::House).collect()
}

/// Those of [`setups`] with decoys, made once for all tests.
static WITH_DECOYS: LazyLock<Vec<(TaskId, Vec<Setup>)>> = LazyLock::new(|| {
    indoor().into_iter().map(|task| (task, setups(task, Settings::STANDARD))).collect()
});

/// Every task has places and seeds of its own, as in the standard split.
fn setups(task: TaskId, settings: Settings) -> Vec<Setup> {
    let first = 10_000 * indoor().iter().position(|t| *t == task).expect("it is indoors") as u64;
    let seeds = (first..first + N).map(|seed| Seeds { place: seed, episode: seed });
    seeds.map(|seeds| generate_with(task, seeds, settings).expect("every seed works")).collect()
}

fn top_m(thing: &Thing) -> f32 {
    thing.position.y + thing.size_m().y
}

/// What anybody can count who walks through the house, and what a helper is told.
fn features(setup: &Setup) -> BTreeMap<&'static str, u64> {
    let count = |is: &dyn Fn(&Thing) -> bool| setup.things.iter().filter(|t| is(t)).count() as u64;
    let role = |t: &Thing, role: Role| t.class.info().role == role;
    let good = |t: &Thing| !t.fixed && (role(t, Role::Target) || role(t, Role::Fragile));
    let named = |t: &Thing, name: &str| t.class == ClassId::named(name);
    let briefed = World::new(setup.clone(), Rules::paper()).expect("it is valid");
    let delivery_mm = 1000.0 * briefed.delivery_radius_m();
    let goal_place = setup.thing(setup.goal_places[0]).expect("it is valid").class;
    BTreeMap::from([
        ("vases", count(&|t| named(t, "vase"))),
        ("vases high", count(&|t| named(t, "vase") && top_m(t) > 1.5)),
        ("obstacles", count(&|t| role(t, Role::Obstacle))),
        ("trashbins", count(&|t| named(t, "trashbin"))),
        ("containers", count(&|t| role(t, Role::Container))),
        ("containers high", count(&|t| role(t, Role::Container) && top_m(t) > 1.5)),
        ("goods", count(&good)),
        ("goods high", count(&|t| good(t) && top_m(t) > 1.5)),
        ("goods on the floor", count(&|t| good(t) && t.position.y == 0.0)),
        ("cabinets", count(&|t| named(t, "cabinet"))),
        ("refrigerators low", count(&|t| named(t, "refrigerator") && top_m(t) < 1.5)),
        ("beds", count(&|t| named(t, "bed"))),
        ("goal place", goal_place.index() as u64),
        ("delivery radius", delivery_mm as u64),
    ])
}

type Labeled = Vec<(TaskId, BTreeMap<&'static str, u64>)>;

/// How often naive Bayes on the second half of all episodes names the task after the first half.
fn accuracy(of: &Labeled, unseen: &[&str]) -> f64 {
    let (learned, asked): (Vec<_>, Vec<_>) =
        of.iter().enumerate().partition(|(i, _)| (*i as u64 % N) < N / 2);
    let mut counts: BTreeMap<(TaskId, &str, u64), f64> = BTreeMap::new();
    let mut values: BTreeMap<&str, BTreeSet<u64>> = BTreeMap::new();
    for (_, (task, features)) in &learned {
        for (name, value) in features {
            *counts.entry((*task, name, *value)).or_default() += 1.0;
            values.entry(name).or_default().insert(*value);
        }
    }
    #[expect(clippy::disallowed_methods, reason = "a test's own statistics")]
    let score = |task: TaskId, features: &BTreeMap<&'static str, u64>| -> f64 {
        let used = features.iter().filter(|(name, _)| !unseen.contains(name));
        used.map(|(name, value)| {
            let n = counts.get(&(task, *name, *value)).copied().unwrap_or(0.0);
            ((n + 1.0) / (N as f64 / 2.0 + values[name].len() as f64 + 1.0)).ln()
        })
        .sum()
    };
    let named = asked.iter().filter(|(_, (task, features))| {
        let best =
            indoor().into_iter().max_by(|a, b| score(*a, features).total_cmp(&score(*b, features)));
        best == Some(*task)
    });
    named.count() as f64 / asked.len() as f64
}

fn labeled<'a>(of: impl IntoIterator<Item = &'a (TaskId, Vec<Setup>)>) -> Labeled {
    let each =
        |(task, setups): &'a (TaskId, Vec<Setup>)| setups.iter().map(|s| (*task, features(s)));
    of.into_iter().flat_map(each).collect()
}

#[test]
fn inventories_with_decoys_do_not_tell_the_task() {
    let with = labeled(&*WITH_DECOYS);
    let (blind, seeing) = (accuracy(&with, &["containers high"]), accuracy(&with, &[]));
    assert!(blind <= CHANCE + LUCK, "{blind}");
    assert!(seeing <= CHANCE + CONTAINERS + LUCK, "{seeing}");
    let paper: Vec<_> =
        indoor().into_iter().map(|task| (task, setups(task, Settings::PAPER))).collect();
    let without = accuracy(&labeled(&paper), &[]);
    println!("{blind:.2} without heights of containers, {seeing:.2} with, {without:.2} on paper");
    assert!(without >= 0.75, "the same classifier finds the task of the paper's shape: {without}");
}

#[test]
fn decoys_leave_each_task_what_it_is() {
    for (task, setups) in &*WITH_DECOYS {
        let task = *task;
        let [lowest_m, highest_m] = task.info().partner.capability().pick_range_m;
        for setup in setups {
            assert_eq!(validate(setup), [], "{task}");
            let goods = || {
                let is_good = |t: &&Thing| t.class.info().is_possible_target() && !t.fixed;
                setup.things.iter().filter(is_good)
            };
            let wanted = |t: &&Thing| setup.goal.wanted(t.class) > 0;
            let high = goods().filter(wanted).filter(|t| top_m(t) > highest_m).count();
            let low = goods().filter(wanted).filter(|t| top_m(t) < lowest_m).count();
            assert_eq!(high > 0, task == TaskId::HighTarget, "{task}: {high} wanted are high");
            assert_eq!(low > 0, task == TaskId::LowTarget, "{task}: {low} wanted are low");
            let vase = ClassId::named("vase");
            assert_eq!(goods().filter(|t| t.class == vase).count(), 2, "{task}");
            let vases = if task == TaskId::HighTarget { 2 } else { 0 };
            assert_eq!(setup.goal.wanted(vase), vases, "{task}");
            let of = |role: Role| setup.things.iter().filter(move |t| t.class.info().role == role);
            assert!((5..=7).contains(&of(Role::Obstacle).count()), "{task}");
            let containers_high = of(Role::Container).filter(|t| top_m(t) > 1.5).count();
            assert_eq!(of(Role::Container).count(), 6, "{task}");
            assert!((1..6).contains(&containers_high), "{task}: containers on both heights");
        }
    }
}

/// Obstacles that are decoys stand well away from doorways.
#[test]
fn decoy_obstacles_stand_in_no_doorway() {
    for (task, setups) in WITH_DECOYS.iter().filter(|(t, _)| *t != TaskId::Obstacle) {
        for setup in setups {
            for thing in setup.things.iter().filter(|t| t.class.info().role == Role::Obstacle) {
                let at = chaic_core::geom::xz(thing.position);
                let doorways = setup.openings.iter().map(|o| 0.5 * (o.a + o.b));
                let nearest_m = doorways.map(|d| d.distance(at)).fold(f32::MAX, f32::min);
                assert!(nearest_m > 1.5, "{task}: {nearest_m} m from a doorway");
            }
        }
    }
}

/// A world of the generator's that has been changed by hand is found by the validator.
#[test]
fn the_validator_knows_decoys_from_what_the_task_needs() {
    let setup = |task| {
        let seeds = Seeds { place: 3, episode: 3 };
        generate_with(task, seeds, Settings::STANDARD).expect("every seed works")
    };
    let problems = |setup: &Setup| {
        validate(setup).iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    let mut retold = setup(TaskId::NoConstraint);
    retold.task = TaskId::Obstacle;
    let found = problems(&retold);
    assert!(found.contains("no obstacle that keeps the partner"), "{found}");
    let mut retold = setup(TaskId::Obstacle);
    retold.task = TaskId::LowTarget;
    let found = problems(&retold);
    assert!(found.contains("nothing wanted that is low"), "{found}");
    let mut retold = setup(TaskId::Obstacle);
    retold.task = TaskId::NoConstraint;
    let found = problems(&retold);
    assert!(found.contains("cut off from the partner by obstacles"), "{found}");
    let mut retold = setup(TaskId::NoConstraint);
    let containers = retold.things.iter_mut().filter(|t| t.class.info().role == Role::Container);
    containers.filter(|t| top_m(t) > 1.5).for_each(|t| t.fixed = true);
    retold.task = TaskId::HighContainer;
    let found = problems(&retold);
    assert!(found.contains("no more containers high than low"), "{found}");
}
