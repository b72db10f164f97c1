//! The runs of a plan in their folders, and how far they have come.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use chaic_core::{Frame, TaskId};
use chaic_env::minds::Helpers;
use chaic_env::{CHAIC_VERSION, EnvError, RunKey};
use chaic_files::{EntryKind, UNFINISHED, kind, read_bounded, write_whole};
use serde::{Deserialize, Serialize};

use crate::experiment::{Experiment, ExperimentRequest, Part};
use chaic_eval::metrics::{Environments, Played, RunResult};
use chaic_eval::report::Labels;
use chaic_eval::run::{
    Item, RunFolder, RunGrants, RunRequest, environments, planned, read_results,
};
use chaic_eval::{EvalError, Result};

const FORMAT: &str = "chaic-fidelity";
const VERSION: u32 = 1;
const FILE: &str = "fidelity.json";
/// Longest plan that is read, bytes: a thousand times a usual one.
const MAX_FILE_BYTES: u64 = 1 << 20;

/// All runs below one folder.
#[derive(Clone, Debug)]
pub struct Matrix {
    /// The folder.
    pub path: PathBuf,
    /// What is played there.
    pub plan: Experiment,
    episodes: Option<PathBuf>,
}

/// How far one of the runs has come.
#[derive(Clone, Debug)]
pub struct PartState {
    /// Which.
    pub part: Part,
    /// All its episode runs.
    pub planned: Vec<RunKey>,
    /// Their results so far.
    pub results: Vec<RunResult>,
    /// Where the episodes take place.
    pub environments: Environments,
    /// What everybody is granted; `None` where the part hasn't begun.
    pub granted: Option<RunGrants>,
}

#[derive(Serialize, Deserialize)]
struct PlanFile {
    format: String,
    version: u32,
    chaic: String,
    plan: Experiment,
}

impl Matrix {
    /// Begins a matrix in a new or empty folder.
    ///
    /// # Errors
    /// If there is something in the folder, or the options make no matrix.
    pub fn begin(path: &Path, wanted: &ExperimentRequest, helpers: &dyn Helpers) -> Result<Matrix> {
        // What a matrix leaves that is stopped in its first moment is nothing.
        let unfinished = format!("{FILE}{UNFINISHED}");
        let mut entries = std::fs::read_dir(path).into_iter().flatten().flatten();
        if entries.any(|e| e.file_name() != *unfinished) {
            return Err(EvalError::NotEmpty { path: path.to_owned() });
        }
        let episodes = wanted.episodes.clone().ok_or_else(|| {
            EvalError::Options("give the folder with episode files by --episodes".to_owned())
        })?;
        let matrix =
            Matrix { path: path.to_owned(), plan: wanted.begin(&episodes)?, episodes: None };
        matrix.plan.check_names(&episodes, helpers)?;
        let matrix = Matrix { episodes: Some(episodes), ..matrix };
        std::fs::create_dir_all(path).map_err(EvalError::io("make the folder", path))?;
        matrix.write()?;
        Ok(matrix)
    }

    /// Goes on with the matrix of a folder. Switches may be added, nothing else changed.
    ///
    /// # Errors
    /// If there is none, or it was begun with other options.
    pub fn resume(path: &Path, wanted: &ExperimentRequest) -> Result<Matrix> {
        let recorded = read(path)?;
        let plan = wanted.resume(&recorded, path)?;
        let matrix = Matrix { path: path.to_owned(), plan, episodes: wanted.episodes.clone() };
        if matrix.plan != recorded {
            matrix.write()?;
        }
        Ok(matrix)
    }

    /// What is to be played for a part.
    ///
    /// # Errors
    /// If nobody says where the episodes are.
    pub fn given(&self, part: &Part) -> Result<RunRequest> {
        let Experiment { tasks, first, size, .. } = &self.plan;
        Ok(RunRequest {
            tasks: Some(tasks.clone()),
            helpers: Some(part.helpers.clone()),
            split: None,
            first: *first,
            seeds: Some(part.seeds),
            size: *size,
            episodes: Some(self.episodes()?),
            rules: Some(part.rules),
            set: part.switch.iter().map(|rule| format!("{rule}=paper")).collect(),
            no_traces: part.switch.is_some(),
            partner: None,
            partner_is: None,
            appearance: None,
            perception: None,
            behavior: None,
            track: None,
        })
    }

    /// The folder of a part.
    pub fn folder(&self, part: &Part) -> PathBuf {
        self.path.join(&part.name)
    }

    /// The copies that the first run made, so that all runs play the same; before it, those that
    /// the user names.
    fn episodes(&self) -> Result<PathBuf> {
        let mut runs = self.plan.parts().into_iter().map(|p| self.folder(&p));
        let copies = runs.find(|run| RunFolder::is_run(run)).map(|r| r.join("episodes"));
        copies.or_else(|| self.episodes.clone()).ok_or_else(|| {
            let text = "no run has begun yet; give the folder with episode files by --episodes";
            EvalError::Options(text.to_owned())
        })
    }

    fn write(&self) -> Result<()> {
        let (format, chaic) = (FORMAT.to_owned(), CHAIC_VERSION.to_owned());
        let file = PlanFile { format, version: VERSION, chaic, plan: self.plan.clone() };
        let text = serde_json::to_string_pretty(&file).expect("a plan has string keys") + "\n";
        Ok(write_whole(&self.path.join(FILE), text.as_bytes())?)
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
    let is_ours = read.format == FORMAT && read.version == VERSION && read.chaic == CHAIC_VERSION;
    if !is_ours {
        return Err(EvalError::Env(EnvError::OtherVersion {
            path: file,
            found: format!("{} version {} (chaic {})", read.format, read.version, read.chaic),
            expected: format!("{FORMAT} version {VERSION} (chaic {CHAIC_VERSION})"),
        }));
    }
    Ok(read.plan)
}

/// How far all runs of a matrix have come. Runs that have not begun are planned too.
///
/// # Errors
/// If no run has begun, or one can't be read.
pub fn parts(matrix: &Matrix) -> Result<Vec<PartState>> {
    let parts = matrix.plan.parts();
    let begun = |part: &Part| RunFolder::is_run(&matrix.folder(part));
    let Some(first) = parts.iter().find(|p| begun(p)) else {
        let text = format!("{} has no run yet; begin them first", matrix.path.display());
        return Err(EvalError::Options(text));
    };
    let (folder, options) = RunFolder::read(&matrix.folder(first))?;
    let planned = planned(&folder, &options)?;
    let environments = environments(&planned);
    let episodes: BTreeMap<(TaskId, String), (Frame, String)> = planned
        .into_iter()
        .map(|i| ((i.key.task, i.key.episode), (i.horizon, i.environment)))
        .collect();
    let state = |part: Part| {
        let mut items = Vec::new();
        for ((task, episode), (horizon, environment)) in &episodes {
            for (helper, seed) in
                part.helpers.iter().flat_map(|h| (0..part.seeds).map(move |s| (h, s)))
            {
                let (task, episode, helper) = (*task, episode.clone(), helper.clone());
                let key = RunKey { task, helper, episode, seed };
                items.push(Item { key, horizon: *horizon, environment: environment.clone() });
            }
        }
        let (results, _) = read_results(&matrix.folder(&part).join("results.jsonl"), &items)?;
        let mut planned: Vec<RunKey> = items.into_iter().map(|i| i.key).collect();
        planned.sort();
        let granted = match begun(&part) {
            true => RunFolder::read(&matrix.folder(&part))?.0.granted()?,
            false => None,
        };
        Ok(PartState { results, planned, part, environments: environments.clone(), granted })
    };
    parts.into_iter().map(state).collect()
}

impl PartState {
    /// What its scores are made from.
    pub fn played(&self) -> Played<'_> {
        let PartState { planned, results, environments, .. } = self;
        Played { results, planned, environments }
    }

    /// What its rows are called.
    pub fn labels(&self) -> Labels<'_> {
        Labels { granted: self.granted.as_ref() }
    }

    /// The episode runs without a result.
    pub fn missing(&self) -> Vec<&RunKey> {
        self.played().missing()
    }

    /// The results that broke down.
    pub fn n_broken(&self) -> usize {
        self.results.iter().filter(|r| r.summary().is_none()).count()
    }
}
