//! Which runs there are, and how far they have come.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use chaic_protocol::TaskId;
use serde::{Deserialize, Serialize};

use crate::CHAIC_VERSION;
use crate::error::{EvalError, Result};
use crate::helpers::{Helpers, NONE};
use crate::metrics::{RunKey, RunResult};
use crate::rules::{RuleSetName, differing_rules, rule_values};
use crate::run::{
    Given, RunFolder, helper_names, planned, read_results, tasks_of_files, write_whole,
};

const FORMAT: &str = "chaic-fidelity";
const VERSION: u32 = 1;
const FILE: &str = "fidelity.json";

/// What is played, as `fidelity.json` records it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// The tasks.
    pub tasks: Vec<TaskId>,
    /// The helpers of both rule sets; `none` is among them.
    pub helpers: Vec<String>,
    /// How many episodes of each task, from the first; absent for all.
    pub first: Option<u32>,
    /// With how many seeds both rule sets are played.
    pub seeds: u32,
    /// Side of everybody's images, pixels; absent for what each mind asks for.
    pub size: Option<u32>,
    /// The rules that are switched, one at a time.
    pub switches: Vec<String>,
    /// With which of the helpers.
    pub switch_helpers: Vec<String>,
    /// With how many seeds; at most those of the rule sets.
    pub switch_seeds: u32,
}

/// What the caller says. What isn't said is as recorded, or as usual.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// `--episodes`.
    pub episodes: Option<PathBuf>,
    /// `--task`.
    pub tasks: Option<Vec<TaskId>>,
    /// `--helper`.
    pub helpers: Option<Vec<String>>,
    /// `--first`.
    pub first: Option<u32>,
    /// `--seeds`.
    pub seeds: Option<u32>,
    /// `--size`.
    pub size: Option<u32>,
    /// `--switch`; empty for no switches at all.
    pub switches: Option<Vec<String>>,
    /// `--switch-helper`.
    pub switch_helpers: Option<Vec<String>>,
    /// `--switch-seeds`.
    pub switch_seeds: Option<u32>,
}

/// The seeds of each episode, unless the user says otherwise.
const SEEDS: u32 = 5;
/// The helpers of both rule sets, unless the user says otherwise.
const HELPERS: [&str; 4] = [NONE, "random", "rhp", "oracle"];
/// The helpers of the switches, unless the user says otherwise.
const SWITCH_HELPERS: [&str; 2] = [NONE, "rhp"];

/// All runs below one folder.
#[derive(Clone, Debug)]
pub struct Matrix {
    /// The folder.
    pub path: PathBuf,
    /// What is played there.
    pub plan: Plan,
    episodes: Option<PathBuf>,
}

/// One of the runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its folder below that of the matrix: `paper`, `compat` or `switch/RULE`.
    pub name: String,
    /// By which rule set.
    pub rules: RuleSetName,
    /// Which rule is set as the paper has it.
    pub switch: Option<String>,
    /// The helpers.
    pub helpers: Vec<String>,
    /// The seeds of each episode.
    pub seeds: u32,
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
}

#[derive(Serialize, Deserialize)]
struct PlanFile {
    format: String,
    version: u32,
    chaic: String,
    plan: Plan,
}

impl Matrix {
    /// Begins a matrix in a new or empty folder.
    ///
    /// # Errors
    /// If there is something in the folder, or the options make no matrix.
    pub fn begin(path: &Path, wanted: &Wanted, helpers: &dyn Helpers) -> Result<Matrix> {
        let entries = std::fs::read_dir(path).into_iter().flatten().count();
        if entries > 0 {
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
    pub fn resume(path: &Path, wanted: &Wanted) -> Result<Matrix> {
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
    pub fn given(&self, part: &Part) -> Result<Given> {
        let Plan { tasks, first, size, .. } = &self.plan;
        Ok(Given {
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
        let copies = runs.find(|run| run.join("run.json").exists()).map(|r| r.join("episodes"));
        copies.or_else(|| self.episodes.clone()).ok_or_else(|| {
            let text = "no run has begun yet; give the folder with episode files by --episodes";
            EvalError::Options(text.to_owned())
        })
    }

    fn write(&self) -> Result<()> {
        let (format, chaic) = (FORMAT.to_owned(), CHAIC_VERSION.to_owned());
        let file = PlanFile { format, version: VERSION, chaic, plan: self.plan.clone() };
        let text = serde_json::to_string_pretty(&file).expect("a plan has string keys") + "\n";
        write_whole(&self.path.join(FILE), text.as_bytes())
    }
}

fn read(path: &Path) -> Result<Plan> {
    let file = path.join(FILE);
    if !file.exists() {
        let (path, text) = (path.display(), "give the folder that `chaic fidelity --out` wrote");
        return Err(EvalError::Options(format!("{path} has no {FILE}; {text}")));
    }
    let text = std::fs::read_to_string(&file).map_err(EvalError::io("read", &file))?;
    let read: PlanFile = serde_json::from_str(&text).map_err(|e| EvalError::Unreadable {
        path: file.clone(),
        line: e.line(),
        problem: e.to_string(),
    })?;
    let is_ours = read.format == FORMAT && read.version == VERSION && read.chaic == CHAIC_VERSION;
    if !is_ours {
        return Err(EvalError::OtherVersion {
            path: file,
            found: format!("{} version {} (chaic {})", read.format, read.version, read.chaic),
            expected: format!("{FORMAT} version {VERSION} (chaic {CHAIC_VERSION})"),
        });
    }
    Ok(read.plan)
}

impl Wanted {
    fn begin(&self, episodes: &Path) -> Result<Plan> {
        // What a run says of its options holds here too.
        let run = Given {
            tasks: self.tasks.clone(),
            helpers: Some(self.helpers.clone().unwrap_or_else(|| owned(&HELPERS))),
            first: self.first,
            seeds: Some(self.seeds.unwrap_or(SEEDS)),
            size: self.size,
            episodes: Some(episodes.to_owned()),
            ..Given::default()
        };
        let run = run.begin()?;
        let usual: Vec<String> = owned(&SWITCH_HELPERS);
        let usual = usual.into_iter().filter(|h| run.helpers.contains(h)).collect();
        let plan = Plan {
            tasks: run.tasks,
            helpers: run.helpers,
            first: run.first,
            seeds: run.seeds,
            size: run.size,
            switches: self.switches.clone().unwrap_or_else(differing_rules),
            switch_helpers: self.switch_helpers.clone().unwrap_or(usual),
            switch_seeds: self.switch_seeds.unwrap_or(1),
        };
        plan.checked()
    }

    fn resume(&self, recorded: &Plan, path: &Path) -> Result<Plan> {
        let list = |tasks: &[TaskId]| tasks.iter().map(|t| t.name()).collect::<Vec<_>>().join(",");
        let number = |n: Option<u32>| n.map_or("not given".to_owned(), |n| n.to_string());
        let said = [
            ("--task", self.tasks.as_ref().map(|t| list(t)), list(&recorded.tasks)),
            ("--helper", self.helpers.as_ref().map(|h| h.join(",")), recorded.helpers.join(",")),
            ("--first", self.first.map(|n| n.to_string()), number(recorded.first)),
            ("--seeds", self.seeds.map(|n| n.to_string()), recorded.seeds.to_string()),
            ("--size", self.size.map(|n| n.to_string()), number(recorded.size)),
            (
                "--switch-helper",
                self.switch_helpers.as_ref().map(|h| h.join(",")),
                recorded.switch_helpers.join(","),
            ),
            (
                "--switch-seeds",
                self.switch_seeds.map(|n| n.to_string()),
                recorded.switch_seeds.to_string(),
            ),
        ];
        for (option, given, recorded) in said {
            if let Some(given) = given.filter(|g| *g != recorded) {
                let path = path.to_owned();
                return Err(EvalError::OptionDiffers { path, option, recorded, given });
            }
        }
        let mut plan = recorded.clone();
        plan.switches.extend(self.switches.iter().flatten().cloned());
        plan.checked()
    }
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

impl Plan {
    fn checked(mut self) -> Result<Plan> {
        let wrong = |text: String| Err(EvalError::Options(text));
        if !self.helpers.iter().any(|h| h == NONE) {
            return wrong("--helper needs `none`: the others are compared with it".to_owned());
        }
        if let Some(other) = self.switch_helpers.iter().find(|h| !self.helpers.contains(h)) {
            let text = "is not among those of --helper, with whose runs switches are compared";
            return wrong(format!("--switch-helper {other} {text}"));
        }
        if !(1..=self.seeds).contains(&self.switch_seeds) {
            return wrong(format!("--switch-seeds is 1 to {}, as many as --seeds", self.seeds));
        }
        for rule in &self.switches {
            let (paper, compat) = rule_values(rule)?;
            if paper == compat {
                let known = differing_rules().join(", ");
                let text = format!("{rule} is {paper} in both rule sets; they differ in {known}");
                return wrong(format!("--switch {text}"));
            }
        }
        // In the order of the rules, and each but once.
        let switches: BTreeSet<&String> = self.switches.iter().collect();
        self.switches = differing_rules().into_iter().filter(|r| switches.contains(r)).collect();
        Ok(self)
    }

    /// Before anything is written: whether there are such episodes and helpers.
    fn check_names(&self, episodes: &Path, helpers: &dyn Helpers) -> Result<()> {
        let present = tasks_of_files(episodes)?;
        if let Some(task) = self.tasks.iter().find(|t| !present.contains(t)) {
            let names: Vec<&str> = present.iter().map(|t| t.name()).collect();
            let (folder, names) = (episodes.display(), names.join(", "));
            let text = format!("{folder} has no episode of {task}; it has those of {names}");
            return Err(EvalError::Options(text));
        }
        let known = helper_names(helpers);
        match self.helpers.iter().find(|h| !known.contains(h)) {
            Some(name) => Err(EvalError::UnknownHelper { name: name.clone(), known }),
            None => Ok(()),
        }
    }

    /// The runs, in the order in which they are played.
    pub fn parts(&self) -> Vec<Part> {
        let set = |rules: RuleSetName| {
            let (name, helpers) = (rules.to_string(), self.helpers.clone());
            Part { name, rules, switch: None, helpers, seeds: self.seeds }
        };
        let switch = |rule: &String| Part {
            name: format!("switch/{rule}"),
            rules: RuleSetName::Compat,
            switch: Some(rule.clone()),
            helpers: self.switch_helpers.clone(),
            seeds: self.switch_seeds,
        };
        let sets = [RuleSetName::Paper, RuleSetName::Compat].map(set);
        sets.into_iter().chain(self.switches.iter().map(switch)).collect()
    }

    /// The command that plays this, with EPISODES and OUT for the folders.
    pub fn command(&self) -> String {
        let number =
            |name: &str, n: Option<u32>| n.map_or(String::new(), |n| format!(" {name} {n}"));
        let mut text =
            format!("chaic fidelity --episodes EPISODES --out OUT --seeds {}", self.seeds);
        text += &format!(" --helper {}", self.helpers.join(","));
        if self.tasks != TaskId::all().collect::<Vec<_>>() {
            let names: Vec<&str> = self.tasks.iter().map(|t| t.name()).collect();
            text += &format!(" --task {}", names.join(","));
        }
        text += &number("--first", self.first);
        text += &number("--size", self.size);
        if self.switches.is_empty() {
            return text + " --no-switches";
        }
        if self.switches != differing_rules() {
            text += &format!(" --switch {}", self.switches.join(","));
        }
        text += &number("--switch-seeds", Some(self.switch_seeds));
        text + &format!(" --switch-helper {}", self.switch_helpers.join(","))
    }
}

/// How far all runs of a matrix have come. Runs that have not begun are planned too.
///
/// # Errors
/// If no run has begun, or one can't be read.
pub fn parts(matrix: &Matrix) -> Result<Vec<PartState>> {
    let parts = matrix.plan.parts();
    let begun = |part: &Part| matrix.folder(part).join("run.json").exists();
    let Some(first) = parts.iter().find(|p| begun(p)) else {
        let text = format!("{} has no run yet; begin them first", matrix.path.display());
        return Err(EvalError::Options(text));
    };
    let (folder, options) = RunFolder::read(&matrix.folder(first))?;
    let mut episodes: BTreeMap<(TaskId, String), ()> = BTreeMap::new();
    for key in planned(&folder, &options)? {
        episodes.insert((key.task, key.episode), ());
    }
    let state = |part: Part| {
        let mut planned = Vec::new();
        for (task, episode) in episodes.keys() {
            for (helper, seed) in
                part.helpers.iter().flat_map(|h| (0..part.seeds).map(move |s| (h, s)))
            {
                let (task, episode, helper) = (*task, episode.clone(), helper.clone());
                planned.push(RunKey { task, helper, episode, seed });
            }
        }
        planned.sort();
        let (results, _) = read_results(&matrix.folder(&part).join("results.jsonl"))?;
        let results = results.into_iter().filter(|r| planned.binary_search(&r.key).is_ok());
        Ok(PartState { results: results.collect(), planned, part })
    };
    parts.into_iter().map(state).collect()
}

impl PartState {
    /// The episode runs without a result.
    pub fn missing(&self) -> Vec<&RunKey> {
        let done: BTreeSet<&RunKey> = self.results.iter().map(|r| &r.key).collect();
        self.planned.iter().filter(|k| !done.contains(k)).collect()
    }

    /// The results that broke down.
    pub fn n_broken(&self) -> usize {
        self.results.iter().filter(|r| r.summary().is_none()).count()
    }
}
