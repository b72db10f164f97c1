//! With decoys, the contents of a house do not reveal the task, except for task-relevant
//! properties. A simple classifier of inventories must be near chance with decoys, and must find
//! the task without.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use chaic_core::task::SceneKind;
use chaic_core::{ClassId, Role, TaskId};
use chaic_episodes::{GeneratorSeeds, Settings, generate_with, validate};
use chaic_world::{ObjectSpec, Rules, Setup, World};

/// Episodes per task; the first half is the training set.
const N: u64 = 48;
/// Accuracy of a guess among six tasks.
const CHANCE: f64 = 1.0 / 6.0;
/// Margin above chance for random deviation: four standard errors of 144 guesses.
const MARGIN: f64 = 0.125;
/// Margin above chance for a classifier that knows how many containers are high: four are high in
/// all episodes of high container, and in a quarter of the others.
const CONTAINER_MARGIN: f64 = 0.125;

fn indoor() -> Vec<TaskId> {
    TaskId::paper().filter(|t| t.info().scene == SceneKind::House).collect()
}

/// Setups with decoys, generated once for all tests.
static WITH_DECOYS: LazyLock<Vec<(TaskId, Vec<Setup>)>> = LazyLock::new(|| {
    indoor().into_iter().map(|task| (task, setups(task, Settings::STANDARD))).collect()
});

/// Generates setups. Every task has its own places and seeds, as in the standard split.
fn setups(task: TaskId, settings: Settings) -> Vec<Setup> {
    let first = 10_000 * indoor().iter().position(|t| *t == task).expect("it is indoors") as u64;
    let seeds = (first..first + N).map(|seed| GeneratorSeeds { place: seed, episode: seed });
    seeds
        .map(|seeds| generate_with(task, seeds, settings).expect("every seed has an episode"))
        .collect()
}

fn top_m(object: &ObjectSpec) -> f32 {
    object.position.y + object.size_m().y
}

/// Returns the counts that are observable in the house, and the information that a helper receives.
fn features(setup: &Setup) -> BTreeMap<&'static str, u64> {
    let count =
        |is: &dyn Fn(&ObjectSpec) -> bool| setup.things.iter().filter(|t| is(t)).count() as u64;
    let role = |t: &ObjectSpec, role: Role| t.class.info().role == role;
    let good = |t: &ObjectSpec| !t.fixed && (role(t, Role::Target) || role(t, Role::Fragile));
    let named = |t: &ObjectSpec, name: &str| t.class == ClassId::named(name);
    let briefed = World::new(setup.clone(), Rules::paper()).expect("it is valid");
    let delivery_mm = 1000.0 * briefed.delivery_radius_m();
    let goal_place = setup.object(setup.goal_places[0]).expect("it is valid").class;
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

/// Returns the test accuracy of naive Bayes: it is trained on the first half of all episodes and
/// predicts the task of the second half.
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
fn inventories_with_decoys_do_not_reveal_the_task() {
    let with = labeled(&*WITH_DECOYS);
    let (blind, seeing) = (accuracy(&with, &["containers high"]), accuracy(&with, &[]));
    assert!(blind <= CHANCE + MARGIN, "{blind}");
    assert!(seeing <= CHANCE + CONTAINER_MARGIN + MARGIN, "{seeing}");
    let paper: Vec<_> =
        indoor().into_iter().map(|task| (task, setups(task, Settings::PAPER))).collect();
    let without = accuracy(&labeled(&paper), &[]);
    println!("{blind:.2} without heights of containers, {seeing:.2} with, {without:.2} on paper");
    assert!(
        without >= 0.75,
        "the same classifier finds the task with the paper's settings: {without}"
    );
}

#[test]
fn decoys_keep_the_properties_of_each_task() {
    for (task, setups) in &*WITH_DECOYS {
        let task = *task;
        let [lowest_m, highest_m] = task.info().partner.capability().pick_range_m;
        for setup in setups {
            assert_eq!(validate(setup), [], "{task}");
            let goods = || {
                let is_good = |t: &&ObjectSpec| t.class.info().is_possible_target() && !t.fixed;
                setup.things.iter().filter(is_good)
            };
            let is_target = |t: &&ObjectSpec| setup.goal.count(t.class) > 0;
            let high = goods().filter(is_target).filter(|t| top_m(t) > highest_m).count();
            let low = goods().filter(is_target).filter(|t| top_m(t) < lowest_m).count();
            assert_eq!(high > 0, task == TaskId::HighTarget, "{task}: {high} targets are high");
            assert_eq!(low > 0, task == TaskId::LowTarget, "{task}: {low} targets are low");
            let vase = ClassId::named("vase");
            assert_eq!(goods().filter(|t| t.class == vase).count(), 2, "{task}");
            let vases = if task == TaskId::HighTarget { 2 } else { 0 };
            assert_eq!(setup.goal.count(vase), vases, "{task}");
            let of = |role: Role| setup.things.iter().filter(move |t| t.class.info().role == role);
            assert!((5..=7).contains(&of(Role::Obstacle).count()), "{task}");
            let containers_high = of(Role::Container).filter(|t| top_m(t) > 1.5).count();
            assert_eq!(of(Role::Container).count(), 6, "{task}");
            assert!((1..6).contains(&containers_high), "{task}: containers on both heights");
        }
    }
}

/// Decoy obstacles keep their distance from doorways.
#[test]
fn decoy_obstacles_keep_clear_of_doorways() {
    for (task, setups) in WITH_DECOYS.iter().filter(|(t, _)| *t != TaskId::Obstacle) {
        for setup in setups {
            for object in setup.things.iter().filter(|t| t.class.info().role == Role::Obstacle) {
                let at = chaic_core::geom::to_xz(object.position);
                let doorways = setup.openings.iter().map(|o| 0.5 * (o.a + o.b));
                let nearest_m = doorways.map(|d| d.distance(at)).fold(f32::MAX, f32::min);
                assert!(nearest_m > 1.5, "{task}: {nearest_m} m from a doorway");
            }
        }
    }
}

/// The validator detects generated setups whose task was replaced.
#[test]
fn the_validator_detects_a_replaced_task() {
    let setup = |task| {
        let seeds = GeneratorSeeds { place: 3, episode: 3 };
        generate_with(task, seeds, Settings::STANDARD).expect("every seed has an episode")
    };
    let problems = |setup: &Setup| {
        validate(setup).iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    let mut relabeled = setup(TaskId::NoConstraint);
    relabeled.task = TaskId::Obstacle;
    let found = problems(&relabeled);
    assert!(found.contains("no obstacle that blocks the partner"), "{found}");
    let mut relabeled = setup(TaskId::Obstacle);
    relabeled.task = TaskId::LowTarget;
    let found = problems(&relabeled);
    assert!(found.contains("no target that is low"), "{found}");
    let mut relabeled = setup(TaskId::Obstacle);
    relabeled.task = TaskId::NoConstraint;
    let found = problems(&relabeled);
    assert!(found.contains("cut off from the partner by obstacles"), "{found}");
    let mut relabeled = setup(TaskId::NoConstraint);
    let containers = relabeled.things.iter_mut().filter(|t| t.class.info().role == Role::Container);
    containers.filter(|t| top_m(t) > 1.5).for_each(|t| t.fixed = true);
    relabeled.task = TaskId::HighContainer;
    let found = problems(&relabeled);
    assert!(found.contains("fewer high containers than low ones"), "{found}");
}
