//! Structures of several panels, such as fences. A structure is one instance, because no helper
//! interacts with single panels.

use chaic_core::EntityId;
use chaic_world::{ObjectSpec, Setup};

/// Classes whose objects are panels of a longer structure.
pub(crate) const PANELS: [&str; 1] = ["fence"];
/// Maximum gap between panels of one structure, meters.
const MAX_PANEL_GAP_M: f32 = 0.1;

/// Returns the instance id of each entity: that of its first panel for the panels of a structure,
/// and its own for other entities.
pub(crate) fn instance_ids(setup: &Setup, n_entities: usize) -> Vec<u16> {
    let mut ids: Vec<u16> = (0..n_entities as u16).collect();
    let is_panel = |object: &&(usize, &ObjectSpec)| PANELS.contains(&object.1.class.name());
    let objects: Vec<(usize, &ObjectSpec)> = setup.things.iter().enumerate().collect();
    let panels: Vec<&(usize, &ObjectSpec)> = objects.iter().filter(is_panel).collect();
    let id_of = |k: usize| k + usize::from(EntityId::FIRST_OBJECT.0);
    for (n, (k, panel)) in panels.iter().enumerate() {
        for (other, other_panel) in &panels[..n] {
            let reach_m = panel.size_m().x.max(panel.size_m().z) + MAX_PANEL_GAP_M;
            let is_adjacent = panel.class == other_panel.class
                && panel.position.distance(other_panel.position) < reach_m;
            let (from, to) = (ids[id_of(*k)], ids[id_of(*other)]);
            if is_adjacent && from != to {
                let (low, high) = (from.min(to), from.max(to));
                ids.iter_mut().filter(|id| **id == high).for_each(|id| *id = low);
            }
        }
    }
    ids
}

#[cfg(test)]
mod tests {
    use chaic_core::{ClassId, TaskId, Vec3};
    use chaic_episodes::{GeneratorSeeds, Settings, generate_with};

    use super::*;

    #[test]
    fn adjacent_panels_are_one_instance_and_other_objects_stay_apart() {
        let panel =
            |x: f32, z: f32| ObjectSpec::new(ClassId::named("fence"), Vec3::new(x, 0.0, z), 0.0);
        let armchair = ObjectSpec::new(ClassId::named("armchair"), Vec3::new(1.0, 0.0, 0.0), 0.0);
        let seeds = GeneratorSeeds { place: 1, episode: 1 };
        let mut setup = generate_with(TaskId::Shopping, seeds, Settings::PAPER).unwrap();
        // Three panels in a row, given out of order; one beyond a gate; one across the street.
        setup.things =
            vec![panel(4.02, 0.0), panel(0.0, 0.0), armchair, panel(2.01, 0.0), panel(8.0, 0.0)];
        setup.things.push(panel(2.0, 9.0));
        let first = usize::from(EntityId::FIRST_OBJECT.0);
        let ids = instance_ids(&setup, first + setup.things.len());
        let row = first as u16;
        assert_eq!(ids[first..], [row, row, row + 2, row, row + 4, row + 5]);
        assert!((0..first).all(|k| ids[k] == k as u16));
    }
}
