//! Environments of episodes. Episodes in the same environment are not independent samples.

use chaic_core::Role;
use chaic_env::Digest;
use chaic_episodes::{Episode, environment_of_changed};
use chaic_world::Setup;

/// Returns the name of an episode's environment. A generated episode has it in its metadata. Other
/// indoor episodes share an environment if walls and fixed furniture are equal. Another outdoor
/// episode is its own environment, because outdoor layouts have no distinctive parts. If only its
/// partner was changed, it has the environment of the generated episode.
pub(crate) fn environment(episode: &Episode) -> String {
    let setup = episode.setup();
    match episode.generator() {
        Some(generator) => generator.environment(),
        None if setup.walls.is_empty() => {
            environment_of_changed(episode).unwrap_or_else(|| episode.id().to_owned())
        }
        None => format!("house/{}", layout(setup)),
    }
}

/// Returns the digest of walls and fixed furniture; colors do not matter.
fn layout(setup: &Setup) -> Digest {
    let walls: Vec<_> = setup.walls.iter().map(|w| (w.a, w.b)).collect();
    let furniture =
        setup.things.iter().filter(|t| t.fixed && t.class.info().role == Role::Furnishing);
    let furniture: Vec<_> = furniture.map(|t| (t.class, t.position, t.yaw_rad)).collect();
    let bytes = serde_json::to_vec(&(walls, furniture)).expect("numbers and names");
    Digest(xxhash_rust::xxh3::xxh3_64(&bytes))
}

#[cfg(test)]
mod tests {
    use chaic_core::TaskId;
    use chaic_episodes::{Split, find_episode};

    use super::*;

    fn environment_of(id: &str) -> String {
        environment(&find_episode(id).unwrap())
    }

    /// Returns the same episode without generator metadata, as another program would write it.
    fn anonymous(id: &str) -> Episode {
        let setup = find_episode(id).unwrap().into_setup();
        Episode::new("file", "files", None, setup).unwrap()
    }

    #[test]
    fn tasks_share_houses_and_splits_know_environments_without_episodes() {
        assert_eq!(environment_of("low_target/test/01"), environment_of("high_goal/test/07"));
        assert_ne!(environment_of("low_target/test/01"), environment_of("low_target/test/02"));
        assert_ne!(environment_of("low_target/test/01"), environment_of("low_target/train/01"));
        assert_ne!(environment_of("shopping/test/01"), environment_of("moving_house/test/01"));
        for (split, id) in [("test", "obstacle/test/07"), ("gen:5..9", "obstacle/gen/7")] {
            let (split, k): (Split, u64) =
                (split.parse().unwrap(), if split == "test" { 7 } else { 2 });
            assert_eq!(split.environment(TaskId::Obstacle, k), environment_of(id));
        }
    }

    #[test]
    fn a_changed_partner_stays_in_the_environment() {
        for task in ["low_target", "shopping", "moving_house"] {
            let changed = |id: &str| environment_of(&format!("{task}/{id}/+tires"));
            assert_eq!(changed("test/01"), changed("test/07"), "{task}");
            assert_ne!(changed("test/01"), changed("test/02"), "{task}");
            assert_ne!(changed("test/01"), changed("train/01"), "{task}");
        }
        for id in ["shopping/test/03", "moving_house/gen/5", "shopping/gen-standard/5"] {
            assert_eq!(environment_of(&format!("{id}/+tires")), environment_of(id));
        }
        // Another episode with the name of a bundled one.
        let setup = find_episode("shopping/test/01").unwrap().into_setup();
        let other = Episode::new("shopping/test/02/+tires", "files", None, setup).unwrap();
        assert_eq!(environment(&other), "shopping/test/02/+tires");
    }

    #[test]
    fn houses_of_other_programs_are_distinguished_by_walls_and_furniture() {
        let environment_of = |id: &str| environment(&anonymous(id));
        assert_eq!(environment_of("low_target/test/01"), environment_of("low_target/test/07"));
        assert_ne!(environment_of("low_target/test/01"), environment_of("low_target/test/02"));
        assert_eq!(environment_of("shopping/test/01"), "file");
    }
}
