//! One door to all generators.

use chaic_core::TaskId;
use chaic_core::task::SceneKind;
use chaic_world::Setup;

use crate::format::GeneratorInfo;
use crate::{Problem, Settings, house, street, yard};

/// Seeds from here on belong to the bundled episodes; a multiple of 12, so that a seed modulo 12
/// is the place of its episode within task and split.
pub(crate) const FIRST_BUNDLED_SEED: u64 = 12 << 36;

/// What a generator depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// The seed of the surroundings: walls, furniture, scenery.
    pub place: u64,
    /// The seed of what happens there: goal, objects, people.
    pub episode: u64,
}

/// No episode came out of many attempts: a fault of the generator, which `examples/soak.rs` looks
/// for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "no {task} episode for seeds {place}/{episode} after {attempts} attempts: {last}; report this, \
     and use another seed"
)]
pub struct GenerateError {
    /// The task.
    pub task: TaskId,
    /// The seed of the surroundings.
    pub place: u64,
    /// The seed of the episode.
    pub episode: u64,
    /// How many were made and thrown away.
    pub attempts: u64,
    /// What was wrong with the last one.
    pub last: String,
}

/// An episode's beginning of the paper's shape: valid, and the same on every machine.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate(task: TaskId, seeds: Seeds) -> Result<Setup, GenerateError> {
    generate_with(task, seeds, Settings::PAPER)
}

/// The same with other settings.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate_with(
    task: TaskId,
    seeds: Seeds,
    settings: Settings,
) -> Result<Setup, GenerateError> {
    match task.info().scene {
        SceneKind::House => house::generate(task, seeds, settings),
        SceneKind::Street => street::generate(task, seeds, settings),
        SceneKind::Yard => yard::generate(task, seeds, settings),
    }
}

/// Who makes episodes of this task.
pub(crate) fn generator_info(task: TaskId, seeds: Seeds, settings: Settings) -> GeneratorInfo {
    let (name, version) = match task.info().scene {
        SceneKind::House => ("house", house::VERSION),
        SceneKind::Street => ("street", street::VERSION),
        SceneKind::Yard => ("yard", yard::VERSION),
    };
    let (seed, place_seed) = (seeds.episode, seeds.place);
    GeneratorInfo { name: name.to_owned(), version, seed, place_seed, settings }
}

/// Takes the first valid setup of at most `attempts` tries; a try that can't go on says why.
pub(crate) fn first_valid(
    task: TaskId,
    seeds: Seeds,
    attempts: u64,
    mut attempt: impl FnMut(u64) -> Result<Setup, &'static str>,
) -> Result<Setup, GenerateError> {
    let mut last = String::new();
    for k in 0..attempts {
        match attempt(k) {
            Err(why) => last = why.to_owned(),
            Ok(setup) => match crate::validate(&setup).first() {
                None => return Ok(setup),
                Some(Problem { field, problem }) => last = format!("{field}: {problem}"),
            },
        }
    }
    Err(GenerateError { task, place: seeds.place, episode: seeds.episode, attempts, last })
}
