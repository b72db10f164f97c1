//! Episodes by split and by name.

use chaic_core::TaskId;
use chaic_core::capability::PersonChange;

use crate::Settings;
use crate::bundled::{bundled_test, bundled_train};
use crate::format::Episode;
use crate::generate::{generate_episode, generator_info};
use crate::seeds::{FIRST_BUNDLED_SEED, GeneratorSeeds};
use crate::split::{Split, SplitError};
use crate::standard::standard;

/// Returns the episodes of a task in a split, in order. Each is read or generated when the iterator
/// reaches it.
pub fn episodes(
    split: &Split,
    task: TaskId,
) -> impl Iterator<Item = Result<Episode, SplitError>> + Send + use<> {
    let split = split.clone();
    (0..split.len_of(task) as u64).map(move |k| match &split {
        Split::Train => bundled_train(task, k),
        Split::Test => bundled_test(task, k),
        Split::Standard => standard(task, k),
        Split::Generated(seeds) => generated(task, seeds.start + k, Settings::PAPER),
        Split::GeneratedStandard(seeds) => generated(task, seeds.start + k, Settings::STANDARD),
    })
}

/// Returns the episode with a name of the form `TASK/train/NN`, `TASK/test/NN`,
/// `TASK/standard/NNN`, `TASK/gen/SEED` or `TASK/gen-standard/SEED`. A suffix such as
/// `/child` or `/+tires` is a [change](chaic_core::capability::PersonChange) of the partner.
///
/// # Errors
/// [`SplitError::NoSuchEpisode`], [`SplitError::Partner`] or [`SplitError::Unplayable`] if no episode has
/// this name; another [`SplitError`] if the build is broken.
pub fn find_episode(id: &str) -> Result<Episode, SplitError> {
    let no_such = || SplitError::NoSuchEpisode { id: id.to_owned() };
    let parts: Vec<&str> = id.split('/').collect();
    let (task, split, number) = match parts[..] {
        [task, split, number] => (task, split, number),
        [task, split, number, change] => {
            let partner_error = |problem| SplitError::Partner { id: id.to_owned(), problem };
            let change = change.parse().map_err(partner_error)?;
            let episode = find_episode(&[task, split, number].join("/"))?;
            return episode.with_partner(change).map_err(SplitError::Unplayable);
        }
        _ => return Err(no_such()),
    };
    let task: TaskId = task.parse().map_err(|_| no_such())?;
    let number: u64 = number.parse().map_err(|_| no_such())?;
    match split {
        "train" if number < Split::Train.len_of(task) as u64 => bundled_train(task, number),
        "test" if number < Split::Test.len_of(task) as u64 => bundled_test(task, number),
        "standard" if number < Split::Standard.len_of(task) as u64 => standard(task, number),
        "gen" if number < FIRST_BUNDLED_SEED => generated(task, number, Settings::PAPER),
        "gen-standard" if number < FIRST_BUNDLED_SEED => {
            generated(task, number, Settings::STANDARD)
        }
        _ => Err(no_such()),
    }
}

/// Returns [`GeneratorInfo::environment`](crate::GeneratorInfo::environment) of an episode with a
/// [changed partner](Episode::with_partner), which has no generator information. Name and seed
/// identify the episode that was changed.
///
/// Returns `None` if the partner was not changed, or [`find_episode`] does not know the name.
pub fn environment_of_changed(episode: &Episode) -> Option<String> {
    let (name, change) = episode.id().rsplit_once('/')?;
    change.parse::<PersonChange>().ok()?;
    let parts: Vec<&str> = name.split('/').collect();
    let [task, split, number] = parts[..] else { return None };
    let number: u64 = number.parse().ok()?;
    let (split, k) = match split {
        "train" => (Split::Train, number),
        "test" => (Split::Test, number),
        "standard" => (Split::Standard, number),
        "gen" if number < FIRST_BUNDLED_SEED => (Split::Generated(number..number + 1), 0),
        "gen-standard" if number < FIRST_BUNDLED_SEED => {
            (Split::GeneratedStandard(number..number + 1), 0)
        }
        _ => return None,
    };
    let is_same = task == episode.task().name() && k < split.len_of(episode.task()) as u64;
    let seeds = is_same.then(|| split.seeds(episode.task(), k))?;
    let info = generator_info(episode.task(), seeds, split.settings());
    (seeds.episode == episode.seed()).then(|| info.environment())
}

fn generated(task: TaskId, seed: u64, settings: Settings) -> Result<Episode, SplitError> {
    let seeds = GeneratorSeeds::from_seed(seed);
    let word = if settings == Settings::STANDARD { "gen-standard" } else { "gen" };
    let id = format!("{task}/{word}/{seed}");
    Ok(generate_episode(id, "generated".to_owned(), task, seeds, settings)?)
}
