//! Demonstrations of a training, aggregated over its iterations (DAgger) and kept in its folder.

use std::io;
use std::path::{Path, PathBuf};

use chaic_files::{FileError, read_bounded, write_atomically};
use chaic_training::checkpoint::Identity;
use chaic_training::{Checkpoint, CheckpointError};

use crate::candidate_scorer::CandidateSet;
use crate::cloning::Demonstration;

/// Maximum size of the file of one iteration, bytes: 4 MiB for each of 4,096 episodes. An episode has
/// about 0.1 MB, or 1.5 MB if each decision holds 32 earlier ones.
const MAX_BYTES: u64 = 1 << 34;

/// Names of the sections of a file. `COUNTS` holds the numbers of episodes and of demonstrations.
const COUNTS: &str = "demonstrations.counts";
const N_CANDIDATES: &str = "demonstrations.n_candidates";
const ACTIONS: &str = "demonstrations.actions";
const STATES: &str = "demonstrations.states";
const CANDIDATES: &str = "demonstrations.candidates";
const VALUE_TARGETS: &str = "demonstrations.value_targets";
const MEMORY_LENS: &str = "demonstrations.memory_lens";
const MEMORY: &str = "demonstrations.memory";
const PER_EPISODE: &str = "demonstrations.per_episode";

/// Demonstrations by episode, oldest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Demonstrations {
    /// Demonstrations of each episode.
    pub episodes: Vec<Vec<Demonstration>>,
}

fn path(folder: &Path, iteration: u64) -> PathBuf {
    folder.join(format!("demonstrations-{iteration:06}.bin"))
}

impl Demonstrations {
    /// Reads the files of iterations 0 to `iterations` - 1 ([`Demonstrations::write`]), newest first,
    /// until `max_episodes` episodes are read. `n_features` are the numbers of features of a state and
    /// of a plan.
    ///
    /// # Errors
    /// One line, if a file cannot be read, is damaged, or belongs to another training.
    pub fn read(
        folder: &Path,
        iterations: u64,
        max_episodes: usize,
        identity: &Identity,
        n_features: (usize, usize),
    ) -> Result<Demonstrations, String> {
        let mut episodes: Vec<Vec<Demonstration>> = Vec::new();
        for iteration in (0..iterations).rev() {
            if episodes.len() >= max_episodes {
                break;
            }
            let path = path(folder, iteration);
            let bytes = read_bounded(&path, MAX_BYTES).map_err(|e| e.to_string())?;
            let file = Checkpoint::from_bytes(&bytes, identity);
            let earlier = file.and_then(|file| from_sections(&file, n_features));
            let mut earlier = earlier.map_err(|problem| format!("{} {problem}", path.display()))?;
            earlier.extend(episodes);
            episodes = earlier;
        }
        let mut all = Demonstrations::default();
        all.add(episodes, max_episodes);
        Ok(all)
    }

    /// Writes the demonstrations of one iteration.
    ///
    /// # Errors
    /// If the file cannot be written, or would be too large to be read back.
    pub fn write(
        folder: &Path,
        iteration: u64,
        episodes: &[Vec<Demonstration>],
        identity: &Identity,
    ) -> Result<(), FileError> {
        let bytes = to_sections(episodes).to_bytes(identity).expect("features are finite");
        write_within(&path(folder, iteration), &bytes, MAX_BYTES)
    }

    /// Returns the demonstrations of the latest `max_episodes` episodes, with these added.
    pub fn with<'a>(
        &'a self,
        episodes: &'a [Vec<Demonstration>],
        max_episodes: usize,
    ) -> Vec<&'a [Demonstration]> {
        let n_surplus = (self.episodes.len() + episodes.len()).saturating_sub(max_episodes);
        let all = self.episodes.iter().chain(episodes).map(Vec::as_slice);
        all.skip(n_surplus).collect()
    }

    /// Adds episodes and drops the oldest beyond `max_episodes`.
    pub fn add(&mut self, episodes: Vec<Vec<Demonstration>>, max_episodes: usize) {
        self.episodes.extend(episodes);
        let n_surplus = self.episodes.len().saturating_sub(max_episodes);
        self.episodes.drain(..n_surplus);
    }
}

/// Writes a file. Refuses more than `max_bytes`, because readers would truncate a larger file.
fn write_within(path: &Path, bytes: &[u8], max_bytes: u64) -> Result<(), FileError> {
    let n = bytes.len() as u64;
    if n > max_bytes {
        let problem = format!(
            "{n} bytes of demonstrations exceed the maximum of {max_bytes}; set fewer episodes per iteration"
        );
        return Err(FileError::context("write", path)(io::Error::other(problem)));
    }
    write_atomically(path, bytes)
}

fn to_sections(episodes: &[Vec<Demonstration>]) -> Checkpoint {
    let all = || episodes.iter().flatten();
    let mut file = Checkpoint::default();
    let integers = |values: &mut dyn Iterator<Item = usize>| values.map(|n| n as u64).collect();
    file.insert_integers(COUNTS, vec![episodes.len() as u64, all().count() as u64]);
    file.insert_integers(PER_EPISODE, integers(&mut episodes.iter().map(Vec::len)));
    file.insert_integers(N_CANDIDATES, integers(&mut all().map(|d| d.observation.n_candidates)));
    file.insert_integers(ACTIONS, integers(&mut all().map(|d| d.action)));
    file.insert_floats(STATES, all().flat_map(|d| d.observation.state.clone()).collect());
    let candidates = all().flat_map(|d| d.observation.candidates.clone());
    file.insert_floats(CANDIDATES, candidates.collect());
    file.insert_integers(MEMORY_LENS, integers(&mut all().map(|d| d.observation.memory.len())));
    file.insert_floats(MEMORY, all().flat_map(|d| d.observation.memory.clone()).collect());
    file.insert_floats(VALUE_TARGETS, all().map(|d| d.value_target).collect());
    file
}

fn from_sections(
    file: &Checkpoint,
    (n_state, n_plan): (usize, usize),
) -> Result<Vec<Vec<Demonstration>>, CheckpointError> {
    let counts = file.integers(COUNTS, 2)?;
    let (n_episodes, n) = (counts[0] as usize, counts[1] as usize);
    let per_episode = file.integers(PER_EPISODE, n_episodes)?;
    let (n_candidates, actions) = (file.integers(N_CANDIDATES, n)?, file.integers(ACTIONS, n)?);
    let n_rows: u64 = n_candidates.iter().sum();
    let states = file.floats(STATES, n * n_state)?;
    let candidates = file.floats(CANDIDATES, n_rows as usize * n_plan)?;
    let value_targets = file.floats(VALUE_TARGETS, n)?;
    let is_valid = |(n, action): (&u64, &u64)| action < n;
    if !n_candidates.iter().zip(actions).all(is_valid) {
        return Err(CheckpointError::section(ACTIONS, "does not fit the candidates"));
    }
    let memory_lens = file.integers(MEMORY_LENS, n)?;
    if memory_lens.iter().any(|len| !len.is_multiple_of((n_state + n_plan) as u64)) {
        return Err(CheckpointError::section(MEMORY_LENS, "does not fit the features"));
    }
    let n_memory = memory_lens.iter().fold(0, |sum: usize, n| sum.saturating_add(*n as usize));
    let mut memory = file.floats(MEMORY, n_memory)?.iter().copied();
    let mut rows = candidates.chunks_exact(n_plan);
    let mut demonstrations = (0..n).map(|k| {
        let n_candidates = n_candidates[k] as usize;
        let observation = CandidateSet {
            state: states[k * n_state..][..n_state].to_vec(),
            candidates: rows.by_ref().take(n_candidates).flatten().copied().collect(),
            n_candidates,
            memory: memory.by_ref().take(memory_lens[k] as usize).collect(),
        };
        Demonstration { observation, action: actions[k] as usize, value_target: value_targets[k] }
    });
    let episode = |n: &u64| demonstrations.by_ref().take(*n as usize).collect();
    Ok(per_episode.iter().map(episode).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::{N_PLAN_FEATURES, N_STATE_FEATURES};
    use chaic_core::rng::RngStream;

    fn episode(seed: u64, n: usize) -> Vec<Demonstration> {
        let mut rng = RngStream::new(seed, "demonstrations", 0);
        let mut demonstration = |k: usize| Demonstration {
            observation: CandidateSet {
                state: (0..N_STATE_FEATURES).map(|_| rng.unit()).collect(),
                candidates: (0..N_PLAN_FEATURES * (k + 2)).map(|_| rng.unit()).collect(),
                n_candidates: k + 2,
                memory: (0..k * (N_STATE_FEATURES + N_PLAN_FEATURES)).map(|_| rng.unit()).collect(),
            },
            action: k,
            value_target: rng.unit(),
        };
        (0..n).map(&mut demonstration).collect()
    }

    #[test]
    fn demonstrations_are_read_back_up_to_the_maximum_number_of_episodes() {
        let folder = tempfile::tempdir().unwrap();
        let identity = Identity { kind: "clone".to_owned(), network: 7 };
        let mut expected = Demonstrations::default();
        for iteration in 0..3 {
            let episodes = vec![episode(iteration, 2), episode(10 + iteration, 3)];
            Demonstrations::write(folder.path(), iteration, &episodes, &identity).unwrap();
            expected.add(episodes, 5);
        }
        assert_eq!(expected.episodes.len(), 5);
        let read = |iterations, identity: &Identity| {
            Demonstrations::read(
                folder.path(),
                iterations,
                5,
                identity,
                (N_STATE_FEATURES, N_PLAN_FEATURES),
            )
        };
        assert_eq!(read(3, &identity).unwrap(), expected);
        assert_eq!(read(1, &identity).unwrap().episodes.len(), 2);
        let other = Identity { network: 8, ..identity.clone() };
        assert!(read(3, &other).unwrap_err().contains("demonstrations-000002.bin"));
        assert!(read(4, &identity).is_err(), "a missing file");
        std::fs::write(path(folder.path(), 2), b"damaged").unwrap();
        assert!(read(3, &identity).is_err());
    }

    #[test]
    fn a_file_that_could_not_be_read_back_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = path(folder.path(), 0);
        let problem = write_within(&path, &[0; 9], 8).unwrap_err().to_string();
        assert!(problem.contains("set fewer episodes"), "{problem}");
        assert!(!path.exists());
        write_within(&path, &[0; 8], 8).unwrap();
        assert!(path.exists());
    }
}
