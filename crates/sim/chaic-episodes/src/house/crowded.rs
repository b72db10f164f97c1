//! Crowded house for measurements of rendering speed.

use chaic_core::TaskId;
use chaic_core::geom::to_xz;
use chaic_world::{ObjectSpec, Setup};

use super::generate;
use crate::Settings;
use crate::attempts::GenerateError;
use crate::seeds::GeneratorSeeds;

/// Place seed of a house with eight rooms.
const PLACE_SEED: u64 = 12;
/// Default number of objects in the house.
pub const N_OBJECTS: usize = 150;
/// Maximum number of episodes that objects are collected from.
const MAX_EPISODES: u64 = 20;
/// Minimum distance between objects of different episodes, meters.
const APART_M: f32 = 0.3;

/// Returns a house of eight rooms with a partner, a helper and up to `n_objects` objects.
///
/// It is an obstacle episode with the movable objects of further episodes in the same house. They
/// are added where nothing else is near, until the number is reached. It is not meant to be played.
///
/// # Errors
/// [`GenerateError`] if one of these episodes cannot be generated.
pub fn crowded_house(n_objects: usize) -> Result<Setup, GenerateError> {
    let place = PLACE_SEED;
    let mut setup =
        generate(TaskId::Obstacle, GeneratorSeeds { place, episode: 0 }, Settings::PAPER)?;
    for episode in 1..=MAX_EPISODES {
        if setup.things.len() >= n_objects {
            break;
        }
        let other =
            generate(TaskId::LowTarget, GeneratorSeeds { place, episode }, Settings::PAPER)?;
        if other.walls != setup.walls {
            continue;
        }
        for object in other.things.iter().filter(|t| !t.fixed) {
            if setup.things.len() < n_objects && is_clear(object, &setup) {
                setup.things.push(*object);
            }
        }
    }
    Ok(setup)
}

/// Returns whether no movable object and no person is near.
fn is_clear(object: &ObjectSpec, setup: &Setup) -> bool {
    let at = object.position;
    let movable = setup.things.iter().filter(|t| !t.fixed);
    let is_near = |t: &ObjectSpec| {
        let reach = APART_M + t.half_longer_side_m() + object.half_longer_side_m();
        (t.position - at).length() < reach
    };
    let mut people = setup.people.iter().map(|p| to_xz(p.pose.position));
    !movable.into_iter().any(is_near) && !people.any(|p| (p - to_xz(at)).length() < 0.6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crowded_house_is_valid() {
        let setup = crowded_house(N_OBJECTS).expect("the seeds are fixed");
        assert_eq!((setup.rooms.len(), setup.things.len()), (8, N_OBJECTS));
        assert_eq!(crate::validate(&setup), []);
        assert_eq!(setup, crowded_house(N_OBJECTS).expect("the seeds are fixed"));
    }
}
