//! Selects the generator of a task.

use chaic_core::TaskId;
use chaic_core::task::SceneKind;
use chaic_world::Setup;

use crate::attempts::GenerateError;
use crate::format::{Episode, GeneratorInfo, generator_name};
use crate::seeds::GeneratorSeeds;
use crate::{Settings, house, street, yard};

/// Generates a valid setup with the paper's settings. The result is the same on every machine.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate(task: TaskId, seeds: GeneratorSeeds) -> Result<Setup, GenerateError> {
    generate_with(task, seeds, Settings::PAPER)
}

/// Generates a valid setup with the given settings.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate_with(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
) -> Result<Setup, GenerateError> {
    match task.info().scene {
        SceneKind::House => house::generate(task, seeds, settings),
        SceneKind::Street => street::generate(task, seeds, settings),
        SceneKind::Yard => yard::generate(task, seeds, settings),
    }
}

/// Generates an episode with this name, of a split with this name.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate_episode(
    id: String,
    split: String,
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
) -> Result<Episode, GenerateError> {
    let setup = generate_with(task, seeds, settings)?;
    Ok(Episode::trusted(id, split, generator_info(task, seeds, settings), setup))
}

/// Returns the name and version of the task's generator, with its inputs.
pub(crate) fn generator_info(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
) -> GeneratorInfo {
    let version = match task.info().scene {
        SceneKind::House => house::VERSION,
        SceneKind::Street => street::VERSION,
        SceneKind::Yard => yard::VERSION,
    };
    let (name, seed, place_seed) = (generator_name(task).to_owned(), seeds.episode, seeds.place);
    GeneratorInfo { name, version, seed, place_seed, settings }
}
