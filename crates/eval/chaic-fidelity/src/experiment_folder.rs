//! Folders of an experiment's runs, and their progress.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use chaic_core::{Frame, TaskId};
use chaic_env::helper_registry::HelperRegistry;
use chaic_env::{CHAIC_VERSION, EnvError, RunKey};
use chaic_files::{
    EntryKind, TEMPORARY_SUFFIX, create_folders, kind, read_bounded, write_atomically,
};
use serde::{Deserialize, Serialize};

use crate::experiment::{Experiment, ExperimentPart, ExperimentRequest};
use chaic_eval::metrics::{Environments, PlayedEpisodes, RunResult};
use chaic_eval::report::Labels;
use chaic_eval::run::{
    EpisodeJob, RunFolder, RunGrants, RunRequest, environments, planned, read_results,
};
use chaic_eval::{EvalError, Result};

const FORMAT: &str = "chaic-fidelity";
const VERSION: u32 = 1;
const FILE: &str = "fidelity.json";
/// Largest plan that is read, bytes: a thousand times the typical size.
const MAX_FILE_BYTES: u64 = 1 << 20;

/// All runs below one folder.
#[derive(Clone, Debug)]
pub struct ExperimentFolder {
    /// Path of the folder.
    pub path: PathBuf,
    /// Plan of the runs.
    pub plan: Experiment,
    episodes: Option<PathBuf>,
}

/// Progress of one run.
#[derive(Clone, Debug)]
pub struct PartState {
    /// Definition of the run.
    pub part: ExperimentPart,
    /// Keys of all its episode runs.
    pub planned: Vec<RunKey>,
    /// Results so far.
    pub results: Vec<RunResult>,
    /// Environments of the episodes.
    pub environments: Environments,
    /// Granted information; `None` if the run has not started.
    pub granted: Option<RunGrants>,
}

#[derive(Serialize, Deserialize)]
struct PlanFile {
    format: String,
    version: u32,
    chaic: String,
    plan: Experiment,
}

impl ExperimentFolder {
    /// Creates an experiment in a new or empty folder.
    ///
    /// # Errors
    /// If the folder is not empty, or the options are invalid.
    pub fn create(
        path: &Path,
        request: &ExperimentRequest,
        helpers: &dyn HelperRegistry,
    ) -> Result<ExperimentFolder> {
        // An experiment that was interrupted while it was created leaves only this file.
        let unfinished = format!("{FILE}{TEMPORARY_SUFFIX}");
        let mut entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        if entries.any(|e| e.file_name() != *unfinished) {
            return Err(EvalError::NotEmpty { path: path.to_owned() });
        }
        let episodes = request.episodes.clone().ok_or_else(|| {
            EvalError::Options("give the folder with episode files by --episodes".to_owned())
        })?;
        let experiment = ExperimentFolder {
            path: path.to_owned(),
            plan: request.new_plan(&episodes)?,
            episodes: None,
        };
        experiment.plan.check_names(&episodes, helpers)?;
        let experiment = ExperimentFolder { episodes: Some(episodes), ..experiment };
        create_folders(path)?;
        experiment.write()?;
        Ok(experiment)
    }

    /// Resumes the experiment in a folder. Switches may be added; other options must not change.
    ///
    /// # Errors
    /// If there is no experiment, or it was created with other options.
    pub fn resume(path: &Path, request: &ExperimentRequest) -> Result<ExperimentFolder> {
        let recorded = read(path)?;
        let plan = request.resumed_plan(&recorded, path)?;
        let experiment =
            ExperimentFolder { path: path.to_owned(), plan, episodes: request.episodes.clone() };
        if experiment.plan != recorded {
            experiment.write()?;
        }
        Ok(experiment)
    }

    /// Returns the run request of a part.
    ///
    /// # Errors
    /// If the folder of episodes is unknown.
    pub fn run_request(&self, part: &ExperimentPart) -> Result<RunRequest> {
        let Experiment { tasks, n_episodes, image_size, .. } = &self.plan;
        Ok(RunRequest {
            tasks: Some(tasks.clone()),
            helpers: Some(part.helpers.clone()),
            n_episodes: *n_episodes,
            seeds: Some(part.seeds),
            image_size: *image_size,
            episodes: Some(self.episodes(part)?),
            rules: Some(part.rules),
            rule_overrides: part.switch.iter().map(|rule| format!("{rule}=paper")).collect(),
            no_traces: part.switch.is_some(),
            ..RunRequest::default()
        })
    }

    /// Returns the folder of a part.
    pub fn folder(&self, part: &ExperimentPart) -> PathBuf {
        self.path.join(&part.name)
    }

    /// Returns whether a run exists. Its copies of the episodes make `--episodes` optional.
    pub fn has_run(&self) -> bool {
        self.first_run().is_some()
    }

    /// Returns the folder of the first part that is a run.
    fn first_run(&self) -> Option<PathBuf> {
        let mut folders = self.plan.parts().into_iter().map(|part| self.folder(&part));
        folders.find(|folder| RunFolder::is_run(folder))
    }

    /// Returns the episodes of a part. A resumed run compares those of the option with its copies. A new
    /// run has those that the first run copied, so that all runs use the same; before it, those of the option.
    fn episodes(&self, part: &ExperimentPart) -> Result<PathBuf> {
        if let Some(given) = &self.episodes
            && RunFolder::is_run(&self.folder(part))
        {
            return Ok(given.clone());
        }
        let copies = self.first_run().map(|run| run.join("episodes"));
        copies.or_else(|| self.episodes.clone()).ok_or_else(|| {
            let text = "no run has started yet; give the folder with episode files by --episodes";
            EvalError::Options(text.to_owned())
        })
    }

    fn write(&self) -> Result<()> {
        let (format, chaic) = (FORMAT.to_owned(), CHAIC_VERSION.to_owned());
        let file = PlanFile { format, version: VERSION, chaic, plan: self.plan.clone() };
        let text = serde_json::to_string_pretty(&file).expect("a plan has string keys") + "\n";
        Ok(write_atomically(&self.path.join(FILE), text.as_bytes())?)
    }
}

fn read(path: &Path) -> Result<Experiment> {
    let file = path.join(FILE);
    if kind(&file)? == EntryKind::Missing {
        let (path, text) = (path.display(), "give the folder that `chaic fidelity --out` wrote");
        return Err(EvalError::Options(format!("{path} has no {FILE}; {text}")));
    }
    let bytes = read_bounded(&file, MAX_FILE_BYTES)?;
    let read: PlanFile = serde_json::from_slice(&bytes).map_err(|e| EnvError::Unreadable {
        path: file.clone(),
        line: e.line(),
        problem: e.to_string(),
    })?;
    let is_compatible =
        read.format == FORMAT && read.version == VERSION && read.chaic == CHAIC_VERSION;
    if !is_compatible {
        return Err(EvalError::Env(EnvError::OtherVersion {
            path: file,
            found: format!("{} version {} (chaic {})", read.format, read.version, read.chaic),
            expected: format!("{FORMAT} version {VERSION} (chaic {CHAIC_VERSION})"),
        }));
    }
    Ok(read.plan)
}

/// Reads the progress of all runs. Runs that have not started are included.
///
/// # Errors
/// If no run has started, or one cannot be read.
pub fn parts(experiment: &ExperimentFolder) -> Result<Vec<PartState>> {
    let parts = experiment.plan.parts();
    let has_started = |part: &ExperimentPart| RunFolder::is_run(&experiment.folder(part));
    let Some(first) = parts.iter().find(|p| has_started(p)) else {
        let text = format!("{} has no run yet; start the runs first", experiment.path.display());
        return Err(EvalError::Options(text));
    };
    let (folder, options) = RunFolder::read(&experiment.folder(first))?;
    let planned = planned(&folder, &options)?;
    let environments = environments(&planned);
    let episodes: BTreeMap<(TaskId, String), (Frame, String)> = planned
        .into_iter()
        .map(|job| ((job.key.task, job.key.episode), (job.horizon, job.environment)))
        .collect();
    let state = |part: ExperimentPart| {
        let mut jobs = Vec::new();
        for ((task, episode), (horizon, environment)) in &episodes {
            for (helper, seed) in
                part.helpers.iter().flat_map(|h| (0..part.seeds).map(move |s| (h, s)))
            {
                let (task, episode, helper) = (*task, episode.clone(), helper.clone());
                let key = RunKey { task, helper, episode, seed };
                jobs.push(EpisodeJob { key, horizon: *horizon, environment: environment.clone() });
            }
        }
        let (results, _) = read_results(&experiment.folder(&part).join("results.jsonl"), &jobs)?;
        let mut planned: Vec<RunKey> = jobs.into_iter().map(|job| job.key).collect();
        planned.sort();
        let granted = match has_started(&part) {
            true => RunFolder::read(&experiment.folder(&part))?.0.granted()?,
            false => None,
        };
        Ok(PartState { results, planned, part, environments: environments.clone(), granted })
    };
    parts.into_iter().map(state).collect()
}

impl PartState {
    /// Returns the results that scores are computed from.
    pub fn played(&self) -> PlayedEpisodes<'_> {
        let PartState { planned, results, environments, .. } = self;
        PlayedEpisodes { results, planned, environments }
    }

    /// Returns the labels of its rows.
    pub fn labels(&self) -> Labels<'_> {
        Labels { granted: self.granted.as_ref() }
    }

    /// Returns the episode runs without a result.
    pub fn missing(&self) -> Vec<&RunKey> {
        self.played().missing()
    }

    /// Returns the number of failed results.
    pub fn n_failed(&self) -> usize {
        self.results.iter().filter(|r| r.summary().is_none()).count()
    }
}
