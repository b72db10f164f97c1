//! Plan of an experiment: its tasks, helpers, seeds and runs.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_env::EnvError;
use chaic_env::helper_registry::{HelperRegistry, NONE};
use chaic_env::rules::{RuleSetName, differing_rules, rule_values};
use serde::{Deserialize, Serialize};

use chaic_eval::run::{RunRequest, helper_names, tasks_of_files};
use chaic_eval::{EvalError, Result};

/// Plan of an experiment, recorded in `fidelity.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Tasks.
    pub tasks: Vec<TaskId>,
    /// Helpers of both rule sets; `none` is among them.
    pub helpers: Vec<String>,
    /// Number of episodes of each task, from the first; `None` for all.
    #[serde(rename = "first")]
    pub n_episodes: Option<u32>,
    /// Number of seeds for both rule sets.
    pub seeds: u32,
    /// Side of all agents' images, pixels; `None` for the default of each agent.
    #[serde(rename = "size")]
    pub image_size: Option<u32>,
    /// Rules that are switched, one at a time.
    pub switches: Vec<String>,
    /// Helpers of the switch runs.
    pub switch_helpers: Vec<String>,
    /// Number of seeds of the switch runs; at most that of the rule sets.
    pub switch_seeds: u32,
}

/// Options of the caller. Missing options keep the recorded value or the default.
#[derive(Clone, Debug, Default)]
pub struct ExperimentRequest {
    /// Option `--episodes`.
    pub episodes: Option<PathBuf>,
    /// Option `--task`.
    pub tasks: Option<Vec<TaskId>>,
    /// Option `--helper`.
    pub helpers: Option<Vec<String>>,
    /// Option `--n-episodes`.
    pub n_episodes: Option<u32>,
    /// Option `--seeds`.
    pub seeds: Option<u32>,
    /// Option `--size`.
    pub image_size: Option<u32>,
    /// Option `--switch`; empty for no switches.
    pub switches: Option<Vec<String>>,
    /// Option `--switch-helper`.
    pub switch_helpers: Option<Vec<String>>,
    /// Option `--switch-seeds`.
    pub switch_seeds: Option<u32>,
}

/// Default number of seeds per episode.
const SEEDS: u32 = 5;
/// Default helpers of both rule sets.
const HELPERS: [&str; 4] = [NONE, "random", "rhp", "oracle"];
/// Default helpers of the switches.
const SWITCH_HELPERS: [&str; 2] = [NONE, "rhp"];

/// One run of an experiment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExperimentPart {
    /// Folder relative to that of the experiment: `paper`, `compat` or `switch/RULE`.
    pub name: String,
    /// Rule set.
    pub rules: RuleSetName,
    /// Rule that is set to the paper's value, if any.
    pub switch: Option<String>,
    /// Helpers.
    pub helpers: Vec<String>,
    /// Number of seeds per episode.
    pub seeds: u32,
}

impl ExperimentRequest {
    pub(super) fn new_plan(&self, episodes: &Path) -> Result<Experiment> {
        // The run's defaults and checks apply here too.
        let run = RunRequest {
            tasks: self.tasks.clone(),
            helpers: Some(self.helpers.clone().unwrap_or_else(|| to_strings(&HELPERS))),
            n_episodes: self.n_episodes,
            seeds: Some(self.seeds.unwrap_or(SEEDS)),
            image_size: self.image_size,
            episodes: Some(episodes.to_owned()),
            ..RunRequest::default()
        };
        let run = run.new_options()?;
        let default_helpers: Vec<String> = to_strings(&SWITCH_HELPERS);
        let default_helpers =
            default_helpers.into_iter().filter(|h| run.helpers.contains(h)).collect();
        let plan = Experiment {
            tasks: run.tasks,
            helpers: run.helpers,
            n_episodes: run.n_episodes,
            seeds: run.seeds,
            image_size: run.image_size,
            switches: self.switches.clone().unwrap_or_else(differing_rules),
            switch_helpers: self.switch_helpers.clone().unwrap_or(default_helpers),
            switch_seeds: self.switch_seeds.unwrap_or(1),
        };
        plan.check()
    }

    pub(super) fn resumed_plan(&self, recorded: &Experiment, path: &Path) -> Result<Experiment> {
        let list = |tasks: &[TaskId]| tasks.iter().map(|t| t.name()).collect::<Vec<_>>().join(",");
        let number = |n: Option<u32>| n.map_or("not given".to_owned(), |n| n.to_string());
        let given_options = [
            ("--task", self.tasks.as_ref().map(|t| list(t)), list(&recorded.tasks)),
            ("--helper", self.helpers.as_ref().map(|h| h.join(",")), recorded.helpers.join(",")),
            ("--n-episodes", self.n_episodes.map(|n| n.to_string()), number(recorded.n_episodes)),
            ("--seeds", self.seeds.map(|n| n.to_string()), recorded.seeds.to_string()),
            ("--size", self.image_size.map(|n| n.to_string()), number(recorded.image_size)),
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
        for (option, given, recorded) in given_options {
            if let Some(given) = given.filter(|g| *g != recorded) {
                let path = path.to_owned();
                return Err(EvalError::OptionDiffers { path, option, recorded, given });
            }
        }
        let mut plan = recorded.clone();
        plan.switches.extend(self.switches.iter().flatten().cloned());
        plan.check()
    }
}

fn to_strings(names: &[&str]) -> Vec<String> {
    names.iter().map(|n| (*n).to_owned()).collect()
}

impl Experiment {
    fn check(mut self) -> Result<Experiment> {
        let invalid = |text: String| Err(EvalError::Options(text));
        if !self.helpers.iter().any(|h| h == NONE) {
            return invalid("--helper needs `none`: the others are compared with it".to_owned());
        }
        if let Some(other) = self.switch_helpers.iter().find(|h| !self.helpers.contains(h)) {
            let text = "is not among those of --helper; switches are compared with their runs";
            return invalid(format!("--switch-helper {other} {text}"));
        }
        if !(1..=self.seeds).contains(&self.switch_seeds) {
            return invalid(format!("--switch-seeds is 1 to {}, as many as --seeds", self.seeds));
        }
        for rule in &self.switches {
            let (paper, compat) = rule_values(rule)?;
            if paper == compat {
                let known = differing_rules().join(", ");
                let text = format!("{rule} is {paper} in both rule sets; they differ in {known}");
                return invalid(format!("--switch {text}"));
            }
        }
        // Order of the rules, without duplicates.
        let switches: BTreeSet<&String> = self.switches.iter().collect();
        self.switches = differing_rules().into_iter().filter(|r| switches.contains(r)).collect();
        Ok(self)
    }

    /// Checks that the episodes and helpers exist, before anything is written.
    pub(super) fn check_names(&self, episodes: &Path, helpers: &dyn HelperRegistry) -> Result<()> {
        let present = tasks_of_files(episodes)?;
        if let Some(task) = self.tasks.iter().find(|t| !present.contains(t)) {
            let names: Vec<&str> = present.iter().map(|t| t.name()).collect();
            let (folder, names) = (episodes.display(), names.join(", "));
            let text = format!("{folder} has no episode of {task}; it has those of {names}");
            return Err(EvalError::Options(text));
        }
        let known = helper_names(helpers);
        match self.helpers.iter().find(|h| !known.contains(h)) {
            Some(name) => Err(EnvError::UnknownHelper { name: name.clone(), known }.into()),
            None => Ok(()),
        }
    }

    /// Returns the runs in the order in which they are played.
    pub fn parts(&self) -> Vec<ExperimentPart> {
        let set = |rules: RuleSetName| {
            let (name, helpers) = (rules.to_string(), self.helpers.clone());
            ExperimentPart { name, rules, switch: None, helpers, seeds: self.seeds }
        };
        let switch = |rule: &String| ExperimentPart {
            name: format!("switch/{rule}"),
            rules: RuleSetName::Compat,
            switch: Some(rule.clone()),
            helpers: self.switch_helpers.clone(),
            seeds: self.switch_seeds,
        };
        let sets = [RuleSetName::Compat, RuleSetName::Paper].map(set);
        sets.into_iter().chain(self.switches.iter().map(switch)).collect()
    }

    /// Returns the command of this experiment, with EPISODES and OUT as folders.
    pub fn command(&self) -> String {
        let number =
            |name: &str, n: Option<u32>| n.map_or(String::new(), |n| format!(" {name} {n}"));
        let mut text =
            format!("chaic fidelity --episodes EPISODES --out OUT --seeds {}", self.seeds);
        text += &format!(" --helper {}", self.helpers.join(","));
        if self.tasks != TaskId::paper().collect::<Vec<_>>() {
            let names: Vec<&str> = self.tasks.iter().map(|t| t.name()).collect();
            text += &format!(" --task {}", names.join(","));
        }
        text += &number("--n-episodes", self.n_episodes);
        text += &number("--size", self.image_size);
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
