//! In which surroundings an episode takes place: those who share them are no independent samples.

use chaic_core::Role;
use chaic_env::Digest;
use chaic_episodes::Episode;
use chaic_world::Setup;

use crate::metrics::Environments;
use crate::run::items::Item;

/// The name of an episode's surroundings. A generated episode knows its own; other episodes share a
/// house if walls and fixed furniture stand alike. Outdoors, where there is nothing to tell places
/// apart by, each episode counts as a place of its own.
pub(crate) fn environment(episode: &Episode) -> String {
    let setup = episode.setup();
    match episode.generator() {
        Some(generator) => generator.environment(),
        None if setup.walls.is_empty() => episode.id().to_owned(),
        None => format!("house/{}", layout(setup)),
    }
}

/// The digest of walls and fixed furniture, whatever their colors.
fn layout(setup: &Setup) -> Digest {
    let walls: Vec<_> = setup.walls.iter().map(|w| (w.a, w.b)).collect();
    let furniture =
        setup.things.iter().filter(|t| t.fixed && t.class.info().role == Role::Furnishing);
    let furniture: Vec<_> = furniture.map(|t| (t.class, t.position, t.yaw_rad)).collect();
    let bytes = serde_json::to_vec(&(walls, furniture)).expect("numbers and names");
    Digest(xxhash_rust::xxh3::xxh3_64(&bytes))
}

/// Where the episodes of these items take place.
pub fn environments(items: &[Item]) -> Environments {
    Environments::new(items.iter().map(|i| (i.key.episode.clone(), i.environment.clone())))
}

#[cfg(test)]
mod tests {
    use chaic_core::TaskId;
    use chaic_episodes::{Split, find_episode};

    use super::*;

    fn of(id: &str) -> String {
        environment(&find_episode(id).unwrap())
    }

    /// The same episode as another program would write it.
    fn anonymous(id: &str) -> Episode {
        let setup = find_episode(id).unwrap().into_setup();
        Episode::new("file", "files", None, setup).unwrap()
    }

    #[test]
    fn houses_are_shared_by_tasks_and_known_without_making_the_episode() {
        assert_eq!(of("low_target/test/01"), of("high_goal/test/07"));
        assert_ne!(of("low_target/test/01"), of("low_target/test/02"));
        assert_ne!(of("low_target/test/01"), of("low_target/train/01"));
        assert_ne!(of("shopping/test/01"), of("moving_house/test/01"));
        for (split, id) in [("test", "obstacle/test/07"), ("gen:5..9", "obstacle/gen/7")] {
            let (split, k): (Split, u64) =
                (split.parse().unwrap(), if split == "test" { 7 } else { 2 });
            assert_eq!(split.environment(TaskId::Obstacle, k), of(id));
        }
    }

    #[test]
    fn houses_from_elsewhere_are_told_apart_by_walls_and_furniture() {
        let of = |id: &str| environment(&anonymous(id));
        assert_eq!(of("low_target/test/01"), of("low_target/test/07"));
        assert_ne!(of("low_target/test/01"), of("low_target/test/02"));
        assert_eq!(of("shopping/test/01"), "file");
    }
}
