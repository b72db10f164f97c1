//! The run of a submission, read from its folder.

use std::collections::BTreeSet;
use std::path::Path;

use chaic_core::TaskId;
use chaic_core::capability::PersonChange;
use chaic_env::RunKey;
use chaic_env::helper_registry::NONE;
use chaic_env::partner_suite::SuitePartner;
use chaic_episodes::Episode;
use chaic_eval::metrics::{Environments, RunResult};
use chaic_eval::run::{RunFolder, environments, planned, read_results};
use chaic_eval::suite::{PartnerRun, SuiteFolder};

use crate::error::{ArenaError, Result};

/// Complete run of a submission on a sealed split, read from its folder. It has a run with the ordinary
/// partner and, if it was played with a list of partners, one with each of them.
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
            let episodes = run.episodes().collect::<chaic_eval::Result<Vec<Episode>>>()?;
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
        let episodes = runs[0].episodes().collect::<chaic_eval::Result<Vec<Episode>>>()?;
        for run in &runs[1..] {
            if let Some(problem) = run.episode_difference(&episodes)? {
                let path = run.folder.path().to_owned();
                return Err(ArenaError::Score { path, problem });
            }
        }
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
        pooled(self.list_results())
    }

    /// Returns the [ranked results](PlayedRun::ranked_results) that are compared with `none`;
    /// `None` if they are all compared.
    pub(crate) fn compared_results(&self) -> Option<Vec<RunResult>> {
        self.suite.as_ref().and_then(|_| compared(self.list_results()))
    }

    /// Returns the results with each partner of the list, and the change of its person.
    fn list_results(&self) -> impl Iterator<Item = (Option<PersonChange>, &[RunResult])> {
        self.list_runs().iter().map(|run| (run.partner.person, run.results.as_slice()))
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

/// Joins the results with several partners that are compared with `none`, as [`pooled`] does;
/// returns `None` if they are all compared. If the run of `none` with an episode, partner and seed
/// failed, those of all helpers are left out. Otherwise the means with and without helper would be
/// over different partners.
pub(crate) fn compared<'a>(
    runs: impl IntoIterator<Item = (Option<PersonChange>, &'a [RunResult])>,
) -> Option<Vec<RunResult>> {
    let runs: Vec<(Option<PersonChange>, &[RunResult])> = runs.into_iter().collect();
    if !runs.iter().any(|(_, results)| results.iter().any(is_failed_alone)) {
        return None;
    }
    let kept: Vec<(Option<PersonChange>, Vec<RunResult>)> =
        runs.into_iter().map(|(person, results)| (person, without_failed_alone(results))).collect();
    Some(pooled(kept.iter().map(|(person, results)| (*person, results.as_slice()))))
}

/// Returns the results of all helpers whose episode and seed `none` completed.
fn without_failed_alone(results: &[RunResult]) -> Vec<RunResult> {
    let failed: BTreeSet<(TaskId, &str, u32)> =
        results.iter().filter(|result| is_failed_alone(result)).map(played_episode).collect();
    let is_kept = |result: &&RunResult| !failed.contains(&played_episode(result));
    results.iter().filter(is_kept).cloned().collect()
}

fn is_failed_alone(result: &RunResult) -> bool {
    result.key.helper == NONE && result.summary().is_none()
}

/// Returns task, episode and seed.
fn played_episode(result: &RunResult) -> (TaskId, &str, u32) {
    (result.key.task, result.key.episode.as_str(), result.key.seed)
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
