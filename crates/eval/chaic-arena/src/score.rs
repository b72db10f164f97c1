//! Score of a submission: its results on a sealed split, with the digests that prove them.

use std::collections::BTreeMap;
use std::path::Path;

use chaic_agents::perception_factory::GROUND_TRUTH;
use chaic_core::{Frame, TaskId};
use chaic_env::helper_registry::RULES;
use chaic_env::trace::MAX_TRACE_BYTES;
use chaic_env::{Appearance, CHAIC_VERSION, Digest, RunKey};
use chaic_episodes::Episode;
use chaic_eval::metrics::{FormulaSet, RunResult, Score};
use chaic_eval::report::{RecordedGrants, Report};
use chaic_eval::run::{EpisodeJob, RunFolder, RunOptions, planned, read_results};
use chaic_files::read_below;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use crate::error::{ArenaError, Result};
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
    /// Scores by task and helper.
    pub tasks: BTreeMap<TaskId, BTreeMap<String, Score>>,
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
    /// Agent that drives the partner.
    pub partner: String,
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

/// The run of a submission on a sealed split, complete and read from its folder.
#[derive(Debug)]
pub struct PlayedRun {
    /// Folder of the run.
    pub folder: RunFolder,
    /// Options of the run.
    pub options: RunOptions,
    /// All planned episode runs.
    pub planned: Vec<EpisodeJob>,
    /// Results, sorted by key.
    pub results: Vec<RunResult>,
    /// Episodes, in the order of tasks and numbers.
    pub episodes: Vec<Episode>,
}

impl PlayedRun {
    /// Reads a run in which every episode run is finished or failed.
    ///
    /// # Errors
    /// [`ArenaError::Score`] if episode runs are missing; if a file cannot be read.
    pub fn read(path: &Path) -> Result<PlayedRun> {
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
        let mut keys: Vec<&RunKey> = planned.iter().map(|job| &job.key).collect();
        // The numbers of more than 1,000 episodes differ in length.
        keys.sort_by_key(|key| (key.task, key.episode.len(), &key.episode));
        keys.dedup_by_key(|key| (key.task, &key.episode));
        let episodes: std::result::Result<Vec<Episode>, _> =
            keys.into_iter().map(|key| folder.episode(&options, key)).collect();
        let episodes = episodes?;
        Ok(PlayedRun { folder, options, planned, results, episodes })
    }

    fn conditions(&self) -> EvaluationConditions {
        let RunOptions { tasks, seeds, rules, rule_overrides, .. } = &self.options;
        let RunOptions { partner, person, appearance, perception, behavior, .. } = &self.options;
        let mut tasks = tasks.clone();
        tasks.sort_unstable();
        let first = self.episodes.first().map_or("", |episode| episode.id());
        EvaluationConditions {
            chaic: CHAIC_VERSION.to_owned(),
            track: self.options.track.to_string(),
            rules: rules.to_string(),
            set: rule_overrides.clone(),
            tasks,
            // Ids are TASK/SPLIT/NUMBER.
            split: first.split('/').nth(1).unwrap_or(&self.options.split).to_owned(),
            episodes_sha256: episodes_sha256(&self.episodes),
            n_episodes: self.episodes.len(),
            seeds: *seeds,
            size: self.options.image_size,
            partner: partner.clone().unwrap_or_else(|| RULES.to_owned()),
            person: person.map(|change| change.to_string()),
            appearance: appearance.clone().unwrap_or_else(|| Appearance::Canonical.to_string()),
            perception: perception.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned()),
            behavior: behavior.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned()),
        }
    }

    fn record(&self, result: &RunResult) -> Result<EpisodeRunRecord> {
        let key = result.key.clone();
        let Some(summary) = result.summary() else {
            return Ok(EpisodeRunRecord { key, outcome: None });
        };
        let path = self.folder.trace(&key);
        let bytes = read_below(self.folder.path(), &path, MAX_TRACE_BYTES)?;
        let outcome = EpisodeOutcome {
            frames: summary.frames,
            done: summary.done,
            total: summary.total,
            state: summary.digest,
            trace_sha256: to_hex(&Sha256::digest(&bytes)),
        };
        Ok(EpisodeRunRecord { key, outcome: Some(outcome) })
    }
}

impl SubmissionScore {
    /// Scores a submission by its run.
    ///
    /// # Errors
    /// [`ArenaError::Score`] if the helper of the submission did not play, or played with other grants than
    /// those of its manifest; if a trace cannot be read.
    pub fn new(submission: &Submission, run: &PlayedRun) -> Result<SubmissionScore> {
        let path = || run.folder.path().to_owned();
        let manifest = submission.manifest();
        let granted = run.folder.granted()?;
        let grants = granted.as_ref().and_then(|g| g.helpers.get(&manifest.name)).copied();
        submission
            .check_play(&run.options)
            .and_then(|()| submission.check_grants(grants))
            .map_err(|problem| ArenaError::Score { path: path(), problem })?;
        let version = run.folder.version()?.unwrap_or_default();
        let report = Report {
            version: &version,
            options: &run.options,
            results: &run.results,
            planned: &run.planned,
            granted: granted.as_ref(),
            formulas: FormulaSet::Paper,
        };
        let labels = report.labels();
        let records: Result<Vec<EpisodeRunRecord>> =
            run.results.iter().map(|result| run.record(result)).collect();
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
            conditions: run.conditions(),
            grants: labels.helper_grants(&run.options.helpers).unwrap_or_default(),
            partner: labels.partner_grants(),
            tasks: report.scores().tasks,
            episode_runs: records?,
        })
    }

    /// Returns the file content.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain fields") + "\n"
    }
}
