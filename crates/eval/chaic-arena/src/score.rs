//! Score of a submission: its results on a sealed split, with the digests that prove them.

use std::collections::BTreeMap;

use chaic_agents::perception_factory::GROUND_TRUTH;
use chaic_core::{Frame, TaskId};
use chaic_env::helper_registry::RULES;
use chaic_env::partner_suite::SuitePartner;
use chaic_env::trace::MAX_TRACE_BYTES;
use chaic_env::{Appearance, CHAIC_VERSION, Digest, RunKey};
use chaic_eval::metrics::{
    Environments, Estimate, FormulaSet, HelperResults, HelperRobustness, MeanRate, PlayedEpisodes,
    RunResult, Score, Scores, mean_rate,
};
use chaic_eval::report::{Labels, RecordedGrants, Report};
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::suite::{PartnerRun, Robustness};
use chaic_files::read_below;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use crate::error::{ArenaError, Result};
use crate::partners::PartnersDigest;
use crate::played::{PlayedRun, pooled};
use crate::sealed::episodes_sha256;
use crate::secret::to_hex;
use crate::submission::Submission;

/// Format of [`SubmissionScore`].
const FORMAT: &str = "chaic-score";
/// Version of the format.
const VERSION: u32 = 1;

/// Score of a submission, `score.json`. The same submission, run and version of chaic give the same bytes:
/// it has no clock, no path and no name of a machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubmissionScore {
    pub(crate) format: &'static str,
    pub(crate) version: u32,
    /// The submission.
    pub submission: SubmissionRecord,
    /// Conditions under which it was played.
    pub conditions: EvaluationConditions,
    /// Grants by helper.
    pub grants: BTreeMap<String, RecordedGrants>,
    /// Grants of the partner.
    pub partner: Option<RecordedGrants>,
    /// Scores by task and helper with the ordinary partner.
    pub tasks: BTreeMap<TaskId, BTreeMap<String, Score>>,
    /// Result and digests of each episode run with the ordinary partner, sorted by key.
    pub episode_runs: Vec<EpisodeRunRecord>,
    /// Results with the partners of a list; absent if only the ordinary partner played.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partners: Option<PartnersScore>,
}

/// Results with the partners of a list, without the ordinary partner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartnersScore {
    /// Scores by task and helper over the episode runs with all partners of the list. EI and intervals are
    /// over episodes; seeds and partners are averaged. EI leaves out each episode, partner and seed
    /// whose run of `none` failed.
    pub tasks: BTreeMap<TaskId, BTreeMap<String, Score>>,
    /// Robustness by helper, as in `robustness.json`.
    pub robustness: Vec<HelperRobustness>,
    /// Partners, in the order of the list.
    pub list: Vec<PartnerScore>,
}

/// Results with one partner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartnerScore {
    /// Name, agent and change of the person, as in `partners.json`.
    #[serde(flatten)]
    pub partner: SuitePartner,
    /// Grants of the partner.
    pub grants: Option<RecordedGrants>,
    /// Mean transport rate by helper over the episodes of all tasks, 0 to 1.
    pub tr: BTreeMap<String, Estimate>,
    /// Result and digests of each episode run, sorted by key.
    pub episode_runs: Vec<EpisodeRunRecord>,
}

/// The submission of a score.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubmissionRecord {
    /// Name of the helper.
    pub name: String,
    /// Version of the helper.
    pub release: String,
    /// Authors, in order.
    pub authors: Vec<String>,
    /// Description of the helper.
    pub description: String,
    /// License as an SPDX expression.
    pub license: String,
    /// Hardware of training and public run.
    pub hardware: String,
    /// Core hours of training.
    pub core_hours: f64,
    /// SHA-256 of the packed submission.
    pub sha256: String,
}

/// All that scores must have in common to be compared. Scores of different conditions are never in one
/// table.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct EvaluationConditions {
    /// Version of chaic.
    pub chaic: String,
    /// Track.
    pub track: String,
    /// Set of rules.
    pub rules: String,
    /// Rules that override the set.
    pub set: Vec<String>,
    /// Tasks.
    pub tasks: Vec<TaskId>,
    /// Name of the split in the ids of the episodes.
    pub split: String,
    /// SHA-256 of the episodes, each as one line of JSON, in the order of tasks and numbers.
    pub episodes_sha256: String,
    /// Number of episodes of all tasks.
    pub n_episodes: usize,
    /// Number of seeds per episode.
    pub seeds: u32,
    /// Side of images, pixels; absent for the size that each helper requests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<u32>,
    /// Agent that drives the ordinary partner.
    pub partner: String,
    /// Partners of the list, which played too; absent without a list.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partners: Option<PartnersDigest>,
    /// Change of the partner's body; absent for the people of the episodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub person: Option<String>,
    /// Light and colors.
    pub appearance: String,
    /// Perception of all helpers, also of the built-in ones for comparison.
    pub perception: String,
    /// Behavior recognition of all helpers.
    pub behavior: String,
}

/// Result and digests of one episode run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EpisodeRunRecord {
    /// Task, helper, episode and seed.
    #[serde(flatten)]
    pub key: RunKey,
    /// Outcome; absent for a failed run, which scores zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outcome: Option<EpisodeOutcome>,
}

/// Outcome of an episode run that was played to its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EpisodeOutcome {
    /// Number of frames.
    pub frames: Frame,
    /// Delivered amount.
    pub done: f64,
    /// Amount of the goal.
    pub total: f64,
    /// Digest of the last state.
    pub state: Digest,
    /// SHA-256 of the trace file.
    pub trace_sha256: String,
}

impl EvaluationConditions {
    fn new(run: &PlayedRun) -> EvaluationConditions {
        let RunOptions { tasks, seeds, rules, rule_overrides, .. } = &run.ordinary().options;
        let RunOptions { track, image_size, partner, person, .. } = &run.ordinary().options;
        let RunOptions { split, appearance, perception, behavior, .. } = &run.ordinary().options;
        let mut tasks = tasks.clone();
        tasks.sort_unstable();
        let episodes = run.episodes();
        let first = episodes.first().map_or("", |episode| episode.id());
        EvaluationConditions {
            chaic: CHAIC_VERSION.to_owned(),
            track: track.to_string(),
            rules: rules.to_string(),
            set: rule_overrides.clone(),
            tasks,
            // Ids are TASK/SPLIT/NUMBER.
            split: first.split('/').nth(1).unwrap_or(split).to_owned(),
            episodes_sha256: episodes_sha256(episodes),
            n_episodes: episodes.len(),
            seeds: *seeds,
            size: *image_size,
            partner: partner.clone().unwrap_or_else(|| RULES.to_owned()),
            partners: run.suite().map(|folder| PartnersDigest::new(folder.suite())),
            person: person.map(|change| change.to_string()),
            appearance: appearance.clone().unwrap_or_else(|| Appearance::Canonical.to_string()),
            perception: perception.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned()),
            behavior: behavior.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned()),
        }
    }

    /// Returns the partners that the ranked scores are over, in words.
    pub(crate) fn ranked_partners(&self) -> String {
        match &self.partners {
            None => self.partner.clone(),
            Some(partners) => format!("list of {}", partners.n),
        }
    }
}

impl PartnersScore {
    /// Scores the runs with the partners of the list.
    fn new(run: &PlayedRun) -> Result<PartnersScore> {
        let (results, environments) = (run.ranked_results(), run.environments());
        let compared = run.compared_results();
        let list = run.list_runs().iter().map(|partner| PartnerScore::new(partner, &environments));
        let list: Result<Vec<PartnerScore>> = list.collect();
        Ok(PartnersScore {
            tasks: pooled_tasks(&results, compared.as_deref(), &environments),
            robustness: Robustness::from_runs(run.runs()).helpers().to_vec(),
            list: list?,
        })
    }
}

/// Returns the scores by task and helper of results with several partners. EI is computed from
/// `compared` if it is given.
pub(crate) fn pooled_tasks(
    results: &[RunResult],
    compared: Option<&[RunResult]>,
    environments: &Environments,
) -> BTreeMap<TaskId, BTreeMap<String, Score>> {
    let tasks = |results: &[RunResult]| {
        let played = PlayedEpisodes { results, planned: &[], environments };
        Scores::new(played, &FormulaSet::Paper.formulas()).tasks
    };
    let mut scores = tasks(results);
    let Some(compared) = compared.map(tasks) else { return scores };
    for (task, row) in &mut scores {
        for (helper, score) in row {
            let other = compared.get(task).and_then(|row| row.get(helper));
            (score.ei, score.ei_ci) = other.map_or((None, None), |other| (other.ei, other.ei_ci));
        }
    }
    scores
}

impl PartnerScore {
    /// `environments` are those of the episodes with the ordinary partner.
    fn new(run: &PartnerRun, environments: &Environments) -> Result<PartnerScore> {
        let granted = run.folder.granted()?;
        let results = pooled([(run.partner.person, run.results.as_slice())]);
        let rate = |helper: &String| {
            let results = HelperResults { results: &results, helper };
            let MeanRate { mean, interval, .. } = mean_rate(results, environments)?;
            Some((helper.clone(), Estimate { mean, interval }))
        };
        Ok(PartnerScore {
            partner: run.partner.clone(),
            grants: Labels { granted: granted.as_ref() }.partner_grants(),
            tr: run.options.helpers.iter().filter_map(rate).collect(),
            episode_runs: records(run)?,
        })
    }
}

/// Returns the result and digests of each episode run with one partner, sorted by key.
fn records(run: &PartnerRun) -> Result<Vec<EpisodeRunRecord>> {
    run.results.iter().map(|result| record(&run.folder, result)).collect()
}

fn record(folder: &RunFolder, result: &RunResult) -> Result<EpisodeRunRecord> {
    let key = result.key.clone();
    let Some(summary) = result.summary() else {
        return Ok(EpisodeRunRecord { key, outcome: None });
    };
    let bytes = read_below(folder.path(), &folder.trace(&key), MAX_TRACE_BYTES)?;
    let outcome = EpisodeOutcome {
        frames: summary.frames,
        done: summary.done,
        total: summary.total,
        state: summary.digest,
        trace_sha256: to_hex(&Sha256::digest(&bytes)),
    };
    Ok(EpisodeRunRecord { key, outcome: Some(outcome) })
}

impl SubmissionScore {
    /// Scores a submission by its run.
    ///
    /// # Errors
    /// [`ArenaError::Score`] if the helper of the submission did not play, or played with other grants than
    /// those of its manifest; if a trace cannot be read.
    pub fn new(submission: &Submission, run: &PlayedRun) -> Result<SubmissionScore> {
        let manifest = submission.manifest();
        for played in run.runs() {
            let granted = played.folder.granted()?;
            let grants = granted.as_ref().and_then(|g| g.helpers.get(&manifest.name)).copied();
            submission
                .check_play(&played.options)
                .and_then(|()| submission.check_grants(grants))
                .map_err(|problem| {
                let path = played.folder.path().to_owned();
                ArenaError::Score { path, problem }
            })?;
        }
        let ordinary = run.ordinary();
        let granted = ordinary.folder.granted()?;
        let version = ordinary.folder.version()?.unwrap_or_default();
        let report = Report {
            version: &version,
            options: &ordinary.options,
            results: &ordinary.results,
            planned: &ordinary.planned,
            granted: granted.as_ref(),
            formulas: FormulaSet::Paper,
        };
        let labels = report.labels();
        Ok(SubmissionScore {
            format: FORMAT,
            version: VERSION,
            submission: SubmissionRecord {
                name: manifest.name.clone(),
                release: manifest.release.clone(),
                authors: manifest.authors.clone(),
                description: manifest.description.clone(),
                license: manifest.license.clone(),
                hardware: manifest.training.hardware.clone(),
                core_hours: manifest.training.core_hours,
                sha256: submission.sha256().to_owned(),
            },
            conditions: EvaluationConditions::new(run),
            grants: labels.helper_grants(&ordinary.options.helpers).unwrap_or_default(),
            partner: labels.partner_grants(),
            tasks: report.scores().tasks,
            episode_runs: records(ordinary)?,
            partners: run.suite().map(|_| PartnersScore::new(run)).transpose()?,
        })
    }

    /// Returns the scores by task and helper by which leaderboards rank: with all partners of the list, or
    /// with the ordinary partner if there is no list.
    pub(crate) fn ranked_tasks(&self) -> &BTreeMap<TaskId, BTreeMap<String, Score>> {
        self.partners.as_ref().map_or(&self.tasks, |partners| &partners.tasks)
    }

    /// Returns the records of all episode runs, each with the name of its partner.
    pub(crate) fn records(&self) -> impl Iterator<Item = (&str, &EpisodeRunRecord)> {
        let ordinary = self.episode_runs.iter().map(|record| (RULES, record));
        let list = self.partners.iter().flat_map(|partners| &partners.list);
        let others = list.flat_map(|score| {
            score.episode_runs.iter().map(move |record| (score.partner.name.as_str(), record))
        });
        ordinary.chain(others)
    }

    /// Returns the file content.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain fields") + "\n"
    }
}
