//! Houses of six to eight rooms, for the six indoor tasks.
//!
//! The surroundings ([`House`]) depend on the place seed alone, so that all tasks can share a
//! house. The contents depend on the task and the episode seed.

mod layout;
mod walls;

mod furnish;
mod recipes;
mod room;

mod objects;
mod slots;

mod doorway_obstacles;
mod populate;

mod decoys;
mod wall_obstacles;

mod crowded;

use chaic_core::TaskId;
use chaic_core::geom::Rect;
use chaic_world::{Floor, ObjectSpec, Opening, Room, Setup, Wall};

use crate::Settings;
use crate::attempts::{GenerateError, first_valid};
use crate::free_space::FreeSpace;
use crate::seeds::GeneratorSeeds;

/// Version of this generator; incremented with every change of its output.
pub const VERSION: u32 = 1;

/// Maximum number of attempts at a house per place seed. Four in seven are valid; of 1,000 seeds
/// none needed more than 11 attempts.
const HOUSE_ATTEMPTS: u64 = 200;
/// Number of attempts at an episode in one house.
const EPISODE_ATTEMPTS: u64 = 12;
/// Maximum number of houses per episode.
const EPISODE_HOUSES: u64 = 4;

pub use crowded::{N_OBJECTS, crowded_house};

/// A furnished house without task objects.
#[derive(Clone, Debug)]
pub struct House {
    pub(crate) bounds: Rect,
    pub(crate) rooms: Vec<Room>,
    pub(crate) walls: Vec<Wall>,
    pub(crate) openings: Vec<Opening>,
    /// True if the doorway belongs to the spanning tree that connects the rooms, per opening.
    pub(crate) is_spanning: Vec<bool>,
    pub(crate) floors: Vec<Floor>,
    pub(crate) furniture: Vec<ObjectSpec>,
    /// Cells in which a wide body can stand.
    pub(crate) ground: FreeSpace,
    /// Cells that are connected to the doorways.
    pub(crate) walkable: Vec<bool>,
}

impl House {
    /// Returns the `nth` valid house of a place seed.
    ///
    /// Returns `None` if the limited number of attempts contains fewer.
    pub fn new(place_seed: u64, settings: Settings, nth: u64) -> Option<House> {
        let house = |attempt| furnish::house(place_seed, settings, attempt).ok();
        (0..HOUSE_ATTEMPTS).filter_map(house).nth(nth as usize)
    }

    /// Makes one attempt at a house of a place seed.
    ///
    /// # Errors
    /// The requirement that the house does not meet.
    pub fn attempt(
        place_seed: u64,
        settings: Settings,
        attempt: u64,
    ) -> Result<House, &'static str> {
        furnish::house(place_seed, settings, attempt)
    }

    /// Returns the number of slots for small objects on low furniture.
    pub fn n_low_slots(&self) -> usize {
        slots::low(self).len()
    }

    /// Returns the furniture, which is the same for all tasks.
    pub fn furniture(&self) -> &[ObjectSpec] {
        &self.furniture
    }

    /// Returns the rooms.
    pub fn rooms(&self) -> &[Room] {
        &self.rooms
    }
}

/// Generates an indoor episode.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
///
/// # Panics
/// Panics if the task does not take place in a house.
pub fn generate(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
) -> Result<Setup, GenerateError> {
    assert_eq!(task.info().scene, chaic_core::task::SceneKind::House, "{task} is outdoors");
    let mut house = None;
    first_valid(task, seeds, EPISODE_HOUSES * EPISODE_ATTEMPTS, |attempt| {
        if attempt % EPISODE_ATTEMPTS == 0 {
            house = House::new(seeds.place, settings, attempt / EPISODE_ATTEMPTS);
        }
        let house = house.as_ref().ok_or("no house is valid")?;
        if settings.decoys {
            decoys::setup(house, task, seeds.episode, attempt)
        } else {
            populate::setup(house, task, seeds.episode, attempt)
        }
    })
}
