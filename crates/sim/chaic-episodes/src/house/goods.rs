//! Which objects an indoor episode has, and which of them are wanted.

use chaic_core::briefing::Goal;
use chaic_core::catalogue::TargetSet;
use chaic_core::rng::Stream;
use chaic_core::task::Arrangement;
use chaic_core::{ClassId, TaskId};

/// The sets of targets with the classes that objects are dealt to in turn. The iPhone is listed
/// twice, as in the original (facts S11.2), so that there are more of them.
const SETS: [(TargetSet, &[&str]); 4] = [
    (TargetSet::Fruit, &["apple", "banana", "orange"]),
    (TargetSet::Bread, &["bread", "burger", "loaf_bread"]),
    (TargetSet::Work, &["iphone", "iphone", "ipod", "purse", "key"]),
    (TargetSet::School, &["mouse", "pen", "pencil_bucket", "calculator"]),
];
/// How many more objects than entries a set has.
const EXTRA: usize = 4;
/// Vases of a high-target episode.
pub(super) const VASES: usize = 2;

/// Containers that hold food, and those that hold anything (facts S11.2).
pub(super) const DISHES: [&str; 3] = ["bowl", "plate", "tea_tray"];
pub(super) const BASKETS: [&str; 3] = ["plastic_basket", "wicker_basket", "wood_basket"];

/// The objects of an episode and the goal.
#[derive(Clone, Debug)]
pub(super) struct Goods {
    /// 31 objects, without vases, in random order.
    pub objects: Vec<ClassId>,
    pub goal: Goal,
}

/// Draws objects and goal (facts S11.2).
pub(super) fn goods(task: TaskId, rng: &mut Stream) -> Goods {
    let counts: Vec<Vec<(ClassId, u32)>> =
        SETS.iter().map(|(_, names)| dealt(rng, names)).collect();
    let wanted = rng.below(SETS.len());
    let mut targets = counts[wanted].clone();
    let other = (wanted + 1 + rng.below(SETS.len() - 1)) % SETS.len();
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
    Goods { objects, goal: Goal { targets } }
}

/// Deals a set's objects to its entries as evenly as goes, in random order.
fn dealt(rng: &mut Stream, names: &[&str]) -> Vec<(ClassId, u32)> {
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

/// The containers of an episode with so many places for them (facts S11.2): all six if there is
/// room; else three of one kind and the rest of the other.
pub(super) fn containers(rng: &mut Stream, places: usize) -> Vec<ClassId> {
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
    fn thirty_one_objects_and_about_ten_targets() {
        for seed in 0..200 {
            let goods = goods(TaskId::NoConstraint, &mut Stream::new(seed, "test", 0));
            assert_eq!(goods.objects.len(), 31);
            assert!((8..=10).contains(&goods.goal.total()), "{:?}", goods.goal);
            for (class, wanted) in &goods.goal.targets {
                let there = goods.objects.iter().filter(|c| *c == class).count();
                assert!(there >= *wanted as usize, "{class}");
            }
            let with_vases = super::goods(TaskId::HighTarget, &mut Stream::new(seed, "test", 0));
            assert!((10..=12).contains(&with_vases.goal.total()));
        }
    }

    #[test]
    fn a_set_is_dealt_evenly() {
        for (names, expected) in SETS.iter().map(|s| s.1).zip([7, 7, 9, 8]) {
            let counts = dealt(&mut Stream::new(1, "test", 0), names);
            assert_eq!(counts.iter().map(|c| c.1).sum::<u32>(), expected);
            assert!(counts.iter().all(|c| (1..=4).contains(&c.1)), "{counts:?}");
        }
    }
}
