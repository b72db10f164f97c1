//! The run of a submission, read from its folder.

use std::path::Path;

use chaic_core::capability::PersonChange;
use chaic_env::RunKey;
use chaic_env::partner_suite::SuitePartner;
use chaic_episodes::Episode;
use chaic_eval::EvalError;
use chaic_eval::metrics::{Environments, RunResult};
use chaic_eval::run::{RunFolder, environments, planned, read_results};
use chaic_eval::suite::{PartnerRun, SuiteFolder};

use crate::error::{ArenaError, Result};

/// The run of a submission on a sealed split, complete and read from its folder: a run with the ordinary
/// partner, and one with each partner of a list if it was played with a list.
#[derive(Debug)]
pub struct PlayedRun {
    /// Run with the ordinary partner, and then with each partner of the list. Results are sorted by key.
    runs: Vec<PartnerRun>,
    /// Folder of the runs; `None` without a list of partners.
    suite: Option<SuiteFolder>,
    /// Episodes with the ordinary partner, in the order of tasks and numbers.
    episodes: Vec<Episode>,
}

impl PlayedRun {
    /// Reads a run in which every episode run is finished or failed, with every partner.
    ///
    /// # Errors
    /// [`ArenaError::Score`] if episode runs or runs with partners are missing, or if a partner has other
    /// episodes than the ordinary one; if a file cannot be read.
    pub fn read(path: &Path) -> Result<PlayedRun> {
        if !SuiteFolder::is_suite(path) {
            let run = read_run(path, SuitePartner::ordinary())?;
            let episodes = episodes(&run).collect::<Result<Vec<Episode>>>()?;
            return Ok(PlayedRun { runs: vec![run], suite: None, episodes });
        }
        let folder = SuiteFolder::read(path)?;
        let mut runs = Vec::new();
        for partner in folder.partners() {
            let path = folder.run_path(&partner);
            if !RunFolder::is_run(&path) {
                let name = &partner.name;
                let problem = format!(
                    "the run with partner {name} is missing; repeat `chaic submit run` to play it"
                );
                return Err(ArenaError::Score { path, problem });
            }
            runs.push(read_run(&path, partner)?);
        }
        let episodes = episodes(&runs[0]).collect::<Result<Vec<Episode>>>()?;
        runs[1..].iter().try_for_each(|run| check_episodes(run, &episodes))?;
        Ok(PlayedRun { runs, suite: Some(folder), episodes })
    }

    /// Returns the runs: with the ordinary partner, and then with each partner of the list.
    pub fn runs(&self) -> &[PartnerRun] {
        &self.runs
    }

    /// Returns the run with the ordinary partner.
    pub fn ordinary(&self) -> &PartnerRun {
        &self.runs[0]
    }

    /// Returns the runs with the partners of the list, without the ordinary one.
    pub fn list_runs(&self) -> &[PartnerRun] {
        &self.runs[1..]
    }

    /// Returns the folder of the runs with several partners; `None` without a list of partners.
    pub fn suite(&self) -> Option<&SuiteFolder> {
        self.suite.as_ref()
    }

    /// Returns the episodes with the ordinary partner, in the order of tasks and numbers.
    pub fn episodes(&self) -> &[Episode] {
        &self.episodes
    }

    /// Returns the environments of the episodes.
    pub fn environments(&self) -> Environments {
        environments(&self.ordinary().planned)
    }

    /// Returns the results by which leaderboards rank: with all partners of the list, or with the ordinary
    /// partner if there is no list. Results of an episode with several partners have the same key.
    pub(crate) fn ranked_results(&self) -> Vec<RunResult> {
        if self.suite.is_none() {
            return self.ordinary().results.clone();
        }
        pooled(self.list_runs().iter().map(|run| (run.partner.person, run.results.as_slice())))
    }
}

/// Joins the results with several partners. The names of the episodes lose the change of the person, so
/// that the means over an episode are means over its partners too.
pub(crate) fn pooled<'a>(
    runs: impl IntoIterator<Item = (Option<PersonChange>, &'a [RunResult])>,
) -> Vec<RunResult> {
    let mut pooled = Vec::new();
    for (person, results) in runs {
        let suffix = person.map_or_else(String::new, |change| format!("/{change}"));
        pooled.extend(results.iter().map(|result| {
            let RunKey { episode, .. } = &result.key;
            let episode = episode.strip_suffix(suffix.as_str()).unwrap_or(episode).to_owned();
            let key = RunKey { episode, ..result.key.clone() };
            RunResult { key, status: result.status.clone() }
        }));
    }
    pooled
}

/// Reads the run with one partner.
fn read_run(path: &Path, partner: SuitePartner) -> Result<PartnerRun> {
    let (folder, options) = RunFolder::read(path)?;
    let planned = planned(&folder, &options)?;
    let (mut results, warnings) = read_results(&folder.results(), &planned)?;
    let n_missing = planned.len().saturating_sub(results.len());
    if n_missing > 0 || !warnings.is_empty() {
        let problem = match (n_missing, warnings.first()) {
            (0, Some(warning)) => format!("{warning}; repeat `chaic submit run`"),
            _ => format!(
                "{n_missing} of {} episode runs are missing; repeat `chaic submit run` to play them",
                planned.len()
            ),
        };
        return Err(ArenaError::Score { path: path.to_owned(), problem });
    }
    results.sort_by(|a, b| a.key.cmp(&b.key));
    Ok(PartnerRun { partner, folder, options, planned, results })
}

/// Reads the episodes of a run, in the order of tasks and numbers.
fn episodes(run: &PartnerRun) -> impl Iterator<Item = Result<Episode>> {
    let mut keys: Vec<&RunKey> = run.planned.iter().map(|job| &job.key).collect();
    // The numbers of more than 1,000 episodes differ in length.
    keys.sort_by_key(|key| (key.task, key.episode.len(), &key.episode));
    keys.dedup_by_key(|key| (key.task, &key.episode));
    keys.into_iter().map(move |key| Ok(run.folder.episode(&run.options, key)?))
}

/// Checks that a run has these episodes with its partner.
fn check_episodes(run: &PartnerRun, ordinary: &[Episode]) -> Result<()> {
    let path = || run.folder.path().to_owned();
    let mut n_found = 0;
    for found in episodes(run) {
        let found = found?;
        let expected = match (ordinary.get(n_found).cloned(), run.partner.person) {
            (Some(episode), Some(change)) => {
                Some(episode.with_partner(change).map_err(EvalError::from)?)
            }
            (episode, _) => episode,
        };
        if expected.as_ref() != Some(&found) {
            let problem =
                format!("{} is not that of the run with the ordinary partner", found.id());
            return Err(ArenaError::Score { path: path(), problem });
        }
        n_found += 1;
    }
    if n_found == ordinary.len() {
        return Ok(());
    }
    let n = ordinary.len();
    let problem =
        format!("it has {n_found} of the {n} episodes of the run with the ordinary partner");
    Err(ArenaError::Score { path: path(), problem })
}
