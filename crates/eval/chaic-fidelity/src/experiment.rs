//! Which runs there are.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_env::EnvError;
use chaic_env::minds::{Helpers, NONE};
use chaic_env::rules::{RuleSetName, differing_rules, rule_values};
use serde::{Deserialize, Serialize};

use chaic_eval::run::{RunRequest, helper_names, tasks_of_files};
use chaic_eval::{EvalError, Result};

/// What is played, as `fidelity.json` records it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
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
pub struct ExperimentRequest {
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

impl ExperimentRequest {
    pub(super) fn begin(&self, episodes: &Path) -> Result<Experiment> {
        // What a run says of its options holds here too.
        let run = RunRequest {
            tasks: self.tasks.clone(),
            helpers: Some(self.helpers.clone().unwrap_or_else(|| owned(&HELPERS))),
            first: self.first,
            seeds: Some(self.seeds.unwrap_or(SEEDS)),
            size: self.size,
            episodes: Some(episodes.to_owned()),
            ..RunRequest::default()
        };
        let run = run.begin()?;
        let usual: Vec<String> = owned(&SWITCH_HELPERS);
        let usual = usual.into_iter().filter(|h| run.helpers.contains(h)).collect();
        let plan = Experiment {
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

    pub(super) fn resume(&self, recorded: &Experiment, path: &Path) -> Result<Experiment> {
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

impl Experiment {
    fn checked(mut self) -> Result<Experiment> {
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
    pub(super) fn check_names(&self, episodes: &Path, helpers: &dyn Helpers) -> Result<()> {
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
        let sets = [RuleSetName::Compat, RuleSetName::Paper].map(set);
        sets.into_iter().chain(self.switches.iter().map(switch)).collect()
    }

    /// The command that plays this, with EPISODES and OUT for the folders.
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
