//! A house with more in it than any task needs, to measure how fast it is drawn.

use chaic_core::TaskId;
use chaic_core::geom::xz;
use chaic_world::{Setup, Thing};

use crate::generate::{GenerateError, Seeds, generate};

/// The place seed of a house of eight rooms.
const PLACE_SEED: u64 = 12;
/// Usual number of things in the house.
pub const N_THINGS: usize = 150;
/// Episodes whose things are gathered until there are that many.
const MOST_EPISODES: u64 = 20;
/// Between things of different episodes, metres.
const APART_M: f32 = 0.3;

/// A house of eight rooms with up to so many things, and a partner and a helper in it.
///
/// It is an obstacle episode with the loose things of further episodes in the same house, wherever
/// nothing else is near, until there are that many or there is no room left. It isn't meant to be
/// played.
///
/// # Errors
/// [`GenerateError`] if one of these episodes can't be made.
pub fn filled(n_things: usize) -> Result<Setup, GenerateError> {
    let place = PLACE_SEED;
    let mut setup = generate(TaskId::Obstacle, Seeds { place, episode: 0 })?;
    for episode in 1..=MOST_EPISODES {
        if setup.things.len() >= n_things {
            break;
        }
        let other = generate(TaskId::LowTarget, Seeds { place, episode })?;
        if other.walls != setup.walls {
            continue;
        }
        for thing in other.things.iter().filter(|t| !t.fixed) {
            if setup.things.len() < n_things && is_clear(thing, &setup) {
                setup.things.push(*thing);
            }
        }
    }
    Ok(setup)
}

/// Whether nothing loose, and nobody, is near.
fn is_clear(thing: &Thing, setup: &Setup) -> bool {
    let at = thing.position;
    let loose = setup.things.iter().filter(|t| !t.fixed);
    let is_near = |t: &Thing| {
        let reach = APART_M + t.half_longer_side_m() + thing.half_longer_side_m();
        (t.position - at).length() < reach
    };
    let mut people = setup.people.iter().map(|p| xz(p.pose.position));
    !loose.into_iter().any(is_near) && !people.any(|p| (p - xz(at)).length() < 0.6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_full_house_has_eight_rooms_and_is_sound() {
        let setup = filled(N_THINGS).expect("its seeds are fixed");
        assert_eq!((setup.rooms.len(), setup.things.len()), (8, N_THINGS));
        assert_eq!(crate::validate(&setup), []);
        assert_eq!(setup, filled(N_THINGS).expect("its seeds are fixed"));
    }
}
