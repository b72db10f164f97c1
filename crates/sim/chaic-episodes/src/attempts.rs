//! Retries of generators: the first attempt that passes validation is used.

use chaic_core::TaskId;
use chaic_world::Setup;

use crate::Problem;
use crate::seeds::GeneratorSeeds;

/// No attempt of a generator led to a valid episode. This is a defect of the generator;
/// `examples/soak.rs` searches for such seeds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "no {task} episode for seeds {place}/{episode} after {attempts} attempts: {last}; report this, \
     and use another seed"
)]
pub struct GenerateError {
    /// Task of the episode.
    pub task: TaskId,
    /// Seed of the surroundings.
    pub place: u64,
    /// Seed of the episode.
    pub episode: u64,
    /// Number of attempts that failed.
    pub attempts: u64,
    /// Problem of the last attempt.
    pub last: String,
}

/// Returns the first valid setup of at most `attempts` attempts. An attempt that fails returns the
/// reason.
pub(crate) fn first_valid(
    task: TaskId,
    seeds: GeneratorSeeds,
    attempts: u64,
    mut attempt: impl FnMut(u64) -> Result<Setup, &'static str>,
) -> Result<Setup, GenerateError> {
    let mut last = String::new();
    for k in 0..attempts {
        match attempt(k) {
            Err(reason) => last = reason.to_owned(),
            Ok(setup) => match crate::validate(&setup).first() {
                None => return Ok(setup),
                Some(Problem { field, problem }) => last = format!("{field}: {problem}"),
            },
        }
    }
    Err(GenerateError { task, place: seeds.place, episode: seeds.episode, attempts, last })
}
