//! Objects of an indoor episode, and the targets among them.

use chaic_core::briefing::Goal;
use chaic_core::catalogue::TargetSet;
use chaic_core::rng::RngStream;
use chaic_core::task::Arrangement;
use chaic_core::{ClassId, TaskId};

/// Target sets with their entries, among which the objects of a set are divided evenly. The iPhone
/// has two entries, as in the original (facts S11.2), so it is more frequent.
const SETS: [(TargetSet, &[&str]); 4] = [
    (TargetSet::Fruit, &["apple", "banana", "orange"]),
    (TargetSet::Bread, &["bread", "burger", "loaf_bread"]),
    (TargetSet::Work, &["iphone", "iphone", "ipod", "purse", "key"]),
    (TargetSet::School, &["mouse", "pen", "pencil_bucket", "calculator"]),
];
/// Number of objects of a set beyond the number of its entries.
const EXTRA: usize = 4;
/// Number of vases in a high-target episode.
pub(super) const VASES: usize = 2;

/// Containers that hold food, and containers that hold anything (facts S11.2).
pub(super) const DISHES: [&str; 3] = ["bowl", "plate", "tea_tray"];
pub(super) const BASKETS: [&str; 3] = ["plastic_basket", "wicker_basket", "wood_basket"];

/// Objects and goal of an episode.
#[derive(Clone, Debug)]
pub(super) struct ObjectsAndGoal {
    /// 31 objects, without vases, in random order.
    pub objects: Vec<ClassId>,
    pub goal: Goal,
}

/// Draws objects and goal (facts S11.2).
pub(super) fn draw_objects_and_goal(task: TaskId, rng: &mut RngStream) -> ObjectsAndGoal {
    let counts: Vec<Vec<(ClassId, u32)>> = SETS.iter().map(|(_, names)| deal(rng, names)).collect();
    let target_set = rng.below(SETS.len());
    let mut targets = counts[target_set].clone();
    let other = (target_set + 1 + rng.below(SETS.len() - 1)) % SETS.len();
    let classes: Vec<ClassId> = counts[other].iter().map(|(c, _)| *c).collect();
    targets.extend(rng.choose(&classes).map(|c| (*c, 1)));
    if task.info().arrangement == Arrangement::HighTargets {
        targets.push((ClassId::named("vase"), VASES as u32));
    }
    targets.sort();
    let each = counts.iter().flatten();
    let mut objects: Vec<ClassId> =
        each.flat_map(|(c, n)| std::iter::repeat_n(*c, *n as usize)).collect();
    rng.shuffle(&mut objects);
    ObjectsAndGoal { objects, goal: Goal { targets } }
}

/// Deals a set's objects to its entries as evenly as possible, in random order.
fn deal(rng: &mut RngStream, names: &[&str]) -> Vec<(ClassId, u32)> {
    let n = names.len() + EXTRA;
    let mut order: Vec<usize> = (0..names.len()).collect();
    rng.shuffle(&mut order);
    let mut counts: Vec<(ClassId, u32)> = Vec::new();
    for k in 0..n {
        let class = ClassId::named(names[order[k % order.len()]]);
        match counts.iter_mut().find(|(c, _)| *c == class) {
            Some((_, count)) => *count += 1,
            None => counts.push((class, 1)),
        }
    }
    counts
}

/// Draws the containers of an episode with `places` places for them (facts S11.2): all six if they
/// fit. Otherwise three are of one kind, and the others of the other kind.
pub(super) fn containers(rng: &mut RngStream, places: usize) -> Vec<ClassId> {
    let (mut first, mut second) = (DISHES, BASKETS);
    if rng.chance(0.5) {
        std::mem::swap(&mut first, &mut second);
    }
    rng.shuffle(&mut first);
    rng.shuffle(&mut second);
    let mut chosen: Vec<ClassId> =
        first.iter().chain(&second).take(places).map(|name| ClassId::named(name)).collect();
    rng.shuffle(&mut chosen);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn episodes_have_31_objects_and_about_ten_targets() {
        for seed in 0..200 {
            let drawn =
                draw_objects_and_goal(TaskId::NoConstraint, &mut RngStream::new(seed, "test", 0));
            assert_eq!(drawn.objects.len(), 31);
            assert!((8..=10).contains(&drawn.goal.total()), "{:?}", drawn.goal);
            for (class, count) in &drawn.goal.targets {
                let available = drawn.objects.iter().filter(|c| *c == class).count();
                assert!(available >= *count as usize, "{class}");
            }
            let with_vases = super::draw_objects_and_goal(
                TaskId::HighTarget,
                &mut RngStream::new(seed, "test", 0),
            );
            assert!((10..=12).contains(&with_vases.goal.total()));
        }
    }

    #[test]
    fn a_set_is_dealt_evenly() {
        for (names, expected) in SETS.iter().map(|s| s.1).zip([7, 7, 9, 8]) {
            let counts = deal(&mut RngStream::new(1, "test", 0), names);
            assert_eq!(counts.iter().map(|c| c.1).sum::<u32>(), expected);
            assert!(counts.iter().all(|c| (1..=4).contains(&c.1)), "{counts:?}");
        }
    }
}
