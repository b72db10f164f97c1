//! Public knowledge about scenes: their target sets and the sizes of these sets.

use chaic_core::catalogue::TargetSet;
use chaic_core::task::{SceneKind, TASKS, TaskInfo, TaskOrigin};
use chaic_core::{ClassId, Role};

/// Returns the kind of scene with these possible targets; `None` if none of them belongs to a
/// target set.
pub fn scene_of(possible_targets: &[ClassId]) -> Option<SceneKind> {
    if possible_targets.iter().any(|c| c.info().role == Role::HeavyTarget) {
        return Some(SceneKind::Yard);
    }
    let n_explained = |scene: SceneKind| {
        let sets = target_sets(scene);
        possible_targets.iter().filter(|c| c.info().sets.iter().any(|s| sets.contains(s))).count()
    };
    let (n_house, n_street) = (n_explained(SceneKind::House), n_explained(SceneKind::Street));
    match n_house.max(n_street) {
        0 => None,
        _ if n_house >= n_street => Some(SceneKind::House),
        _ => Some(SceneKind::Street),
    }
}

/// Returns the tasks of the paper in this kind of scene, or all of them.
pub fn paper_tasks(scene: Option<SceneKind>) -> impl Iterator<Item = &'static TaskInfo> {
    let is_here = move |t: &&TaskInfo| scene.is_none_or(|s| t.scene == s);
    TASKS.iter().filter(|t| t.origin != TaskOrigin::Chaic).filter(is_here)
}

/// Returns the target sets of a kind of scene, in their order.
pub fn target_sets(scene: SceneKind) -> Vec<TargetSet> {
    let mut sets: Vec<TargetSet> =
        paper_tasks(Some(scene)).flat_map(|t| t.sets.iter().copied()).collect();
    sets.sort_unstable();
    sets.dedup();
    sets
}

/// Returns the number of objects of a set in an episode. Houses: one for each entry of the set and
/// four more (facts S11.2). Streets: the stock of the two shops of this category (facts S8.1).
/// Furniture: one piece of each class, because the counts vary.
pub fn set_size(set: TargetSet) -> f32 {
    match set {
        TargetSet::Fruit | TargetSet::Bread => 7.0,
        TargetSet::Work => 9.0,
        TargetSet::School => 8.0,
        TargetSet::ShopFruit => 12.0,
        TargetSet::ShopBakery => 10.0,
        TargetSet::ShopDrinks => 11.0,
        TargetSet::Furniture => n_classes(set) as f32,
    }
}

/// Returns the expected number of objects of each class of a set.
pub fn expected_per_class(set: TargetSet) -> f32 {
    set_size(set) / n_classes(set).max(1) as f32
}

fn n_classes(set: TargetSet) -> usize {
    ClassId::all().filter(|c| c.info().sets.contains(&set)).count()
}
