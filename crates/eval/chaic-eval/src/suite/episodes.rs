//! Comparison of the episodes that runs with several partners play.

use chaic_env::RunKey;
use chaic_episodes::Episode;

use super::PartnerRun;
use crate::error::{EvalError, Result};
use crate::run::FILES;

impl PartnerRun {
    /// Reads the episodes of the run, in the order of tasks and numbers. An item is an error if its
    /// episode can't be read.
    pub fn episodes(&self) -> impl Iterator<Item = Result<Episode>> {
        let mut keys: Vec<&RunKey> = self.planned.iter().map(|job| &job.key).collect();
        // The numbers of more than 1,000 episodes differ in length.
        keys.sort_by_key(|key| (key.task, key.episode.len(), &key.episode));
        keys.dedup_by_key(|key| (key.task, &key.episode));
        keys.into_iter().map(move |key| self.folder.episode(&self.options, key))
    }

    /// Compares the episodes with `ordinary`, those of the run with the ordinary partner in the
    /// same order. Returns the first difference beside this run's person, in one line.
    ///
    /// # Errors
    /// If an episode can't be read, or an ordinary one can't be played with this person.
    pub fn episode_difference(&self, ordinary: &[Episode]) -> Result<Option<String>> {
        let mut n_found = 0;
        for found in self.episodes() {
            let found = found?;
            let expected = match (ordinary.get(n_found).cloned(), self.partner.person) {
                (Some(episode), Some(change)) => Some(episode.with_partner(change)?),
                (episode, _) => episode,
            };
            if expected.as_ref() != Some(&found) {
                let id = found.id();
                let problem = format!("{id} is not that of the run with the ordinary partner");
                return Ok(Some(problem));
            }
            n_found += 1;
        }
        let n = ordinary.len();
        let problem =
            || format!("it has {n_found} of the {n} episodes of the run with the ordinary partner");
        Ok((n_found != n).then(problem))
    }
}

/// Returns the runs whose episodes are not those of the first run with their own partner, each with
/// the problem. Episodes that can't be read are a problem too.
pub(super) fn episode_problems(runs: &[PartnerRun]) -> Vec<(&str, String)> {
    let unplanned = runs.iter().filter(|run| run.planned.is_empty());
    let mut problems: Vec<(&str, String)> = unplanned
        .map(|run| (run.partner.name.as_str(), "its episodes can't be read".to_owned()))
        .collect();
    let Some((ordinary, others)) = runs.split_first() else { return problems };
    // Runs with the same options have the same episodes unless these are files.
    if !problems.is_empty() || ordinary.options.split != FILES {
        return problems;
    }
    let not_compared = |error: EvalError| format!("its episodes can't be compared: {error}");
    let episodes = match ordinary.episodes().collect::<Result<Vec<Episode>>>() {
        Ok(episodes) => episodes,
        Err(error) => return vec![(ordinary.partner.name.as_str(), not_compared(error))],
    };
    for run in others {
        let compared = run.episode_difference(&episodes);
        let problem = compared.unwrap_or_else(|error| Some(not_compared(error)));
        problems.extend(problem.map(|problem| (run.partner.name.as_str(), problem)));
    }
    problems
}
