//! Houses of six to eight rooms, for the six indoor tasks.
//!
//! The surroundings ([`House`]) depend on the place seed alone, so that all tasks can share a
//! house; what lies and stands in it depends on the task and the episode seed.

mod layout;
mod walls;

mod furnish;
mod recipes;
mod room;

mod goods;
mod slots;

mod doors;
mod populate;

mod beside;
mod decoys;

mod full;

use chaic_core::TaskId;
use chaic_core::geom::Rect;
use chaic_world::{Floor, Opening, Room, Setup, Thing, Wall};

use crate::Settings;
use crate::free_space::FreeSpace;
use crate::generate::{GenerateError, Seeds, first_valid};

/// Version of this generator; goes up with every change of what it makes.
pub const VERSION: u32 = 1;

/// Houses that are tried for a place seed. Four in seven are fit; of 1,000 seeds none needed more
/// than 11 attempts.
const HOUSE_ATTEMPTS: u64 = 200;
/// Episodes that are tried in a house before another house is.
const EPISODE_ATTEMPTS: u64 = 12;
/// Houses that an episode is tried in.
const EPISODE_HOUSES: u64 = 4;

pub use full::{N_THINGS, filled};

/// An empty house with its furniture.
#[derive(Clone, Debug)]
pub struct House {
    pub(crate) bounds: Rect,
    pub(crate) rooms: Vec<Room>,
    pub(crate) walls: Vec<Wall>,
    pub(crate) openings: Vec<Opening>,
    /// Per opening, whether the rooms hang together without it only by a detour or not at all.
    pub(crate) is_spanning: Vec<bool>,
    pub(crate) floors: Vec<Floor>,
    pub(crate) furniture: Vec<Thing>,
    /// Where a wide body can stand.
    pub(crate) ground: FreeSpace,
    /// Which of these cells hang together with the doorways.
    pub(crate) walkable: Vec<bool>,
}

impl House {
    /// The `nth` house of a place seed that is fit to live in.
    ///
    /// `None` if there are fewer among the bounded number of attempts.
    pub fn new(place_seed: u64, settings: Settings, nth: u64) -> Option<House> {
        let house = |attempt| furnish::house(place_seed, settings, attempt).ok();
        (0..HOUSE_ATTEMPTS).filter_map(house).nth(nth as usize)
    }

    /// One attempt at a house of a place seed, or why it isn't fit to live in.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn attempt(
        place_seed: u64,
        settings: Settings,
        attempt: u64,
    ) -> Result<House, &'static str> {
        furnish::house(place_seed, settings, attempt)
    }

    /// How many places for small things its low furniture has.
    pub fn count_low_places(&self) -> usize {
        slots::low(self).len()
    }

    /// Where everything is that doesn't move, without task.
    pub fn furniture(&self) -> &[Thing] {
        &self.furniture
    }

    /// The rooms.
    pub fn rooms(&self) -> &[Room] {
        &self.rooms
    }
}

/// An indoor episode of these seeds.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
///
/// # Panics
/// If the task isn't one that happens in a house.
pub fn generate(task: TaskId, seeds: Seeds, settings: Settings) -> Result<Setup, GenerateError> {
    assert_eq!(task.info().scene, chaic_core::task::SceneKind::House, "{task} is outdoors");
    let mut house = None;
    first_valid(task, seeds, EPISODE_HOUSES * EPISODE_ATTEMPTS, |attempt| {
        if attempt % EPISODE_ATTEMPTS == 0 {
            house = House::new(seeds.place, settings, attempt / EPISODE_ATTEMPTS);
        }
        let house = house.as_ref().ok_or("no house passes")?;
        if settings.decoys {
            decoys::setup(house, task, seeds.episode, attempt)
        } else {
            populate::setup(house, task, seeds.episode, attempt)
        }
    })
}
