//! Options of a run. A run can only be resumed with the same options.

use std::path::{Path, PathBuf};

use chaic_agents::partners::recorded_partner_name;
use chaic_agents::perception_factory::GROUND_TRUTH;
use chaic_core::TaskId;
use chaic_core::capability::PersonChange;
use chaic_env::helper_registry::RULES;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::{Digest, Track};
use chaic_episodes::Split;
use chaic_render::Appearance;
use serde::{Deserialize, Serialize};

use crate::episode_file::tasks_of_files;
use crate::error::{EvalError, Result};
use crate::run::helper_files::HelperFiles;

/// Maximum side of agents' images, pixels: 16 times the benchmark's area.
pub const MAX_IMAGE_SIZE: u32 = 2048;
/// Minimum side of agents' images, pixels; smaller images show no details.
pub const MIN_IMAGE_SIZE: u32 = 16;

/// Options of a run, as in `run.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunOptions {
    /// Tasks to play.
    pub tasks: Vec<TaskId>,
    /// Helpers to play.
    pub helpers: Vec<String>,
    /// Split; `files` if the episodes are files.
    pub split: String,
    /// Number of episodes of each task, from the first; absent for all.
    #[serde(rename = "first")]
    pub n_episodes: Option<u32>,
    /// Number of seeds per episode.
    pub seeds: u32,
    /// Side of all agents' images, pixels; absent for the size that each agent requests.
    #[serde(rename = "size")]
    pub image_size: Option<u32>,
    /// Set of rules.
    pub rules: RuleSetName,
    /// Rules that override the set, as `NAME=VALUE`.
    #[serde(rename = "set", default, skip_serializing_if = "Vec::is_empty")]
    pub rule_overrides: Vec<String>,
    /// True if traces are written. Without traces, a run needs little disk space but can't be
    /// verified or replayed.
    #[serde(default = "default_true", skip_serializing_if = "is_true")]
    pub traces: bool,
    /// Agent that controls the partner, the value of `--partner`; absent for the rule-based partner.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner: Option<String>,
    /// Change of the partner's body; absent for the person in each episode.
    #[serde(rename = "partner_is", default, skip_serializing_if = "Option::is_none")]
    pub person: Option<PersonChange>,
    /// Light and colors of scenes; absent for the benchmark's default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub appearance: Option<String>,
    /// Object detection of helpers, the value of `--perception`; absent for ids from ground truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perception: Option<String>,
    /// Behavior recognition of helpers, the value of `--behavior`; absent for `gt`: granted actions, or else
    /// inference from the objects in the partner's hands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub behavior: Option<String>,
    /// Track, which limits the grants of helpers; the default allows all grants.
    #[serde(default, skip_serializing_if = "is_default")]
    pub track: Track,
}

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_default(track: &Track) -> bool {
    *track == Track::default()
}

fn default_true() -> bool {
    true
}

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_true(b: &bool) -> bool {
    *b
}

/// Options that the caller requests. Absent values are the recorded ones, or the defaults for a new
/// run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunRequest {
    /// `--task`.
    pub tasks: Option<Vec<TaskId>>,
    /// `--helper`.
    pub helpers: Option<Vec<String>>,
    /// `--split`.
    pub split: Option<Split>,
    /// `--n-episodes`.
    pub n_episodes: Option<u32>,
    /// `--seeds`.
    pub seeds: Option<u32>,
    /// `--size`.
    pub image_size: Option<u32>,
    /// `--episodes`: a folder with episode files instead of a split.
    pub episodes: Option<PathBuf>,
    /// `--rules`.
    pub rules: Option<RuleSetName>,
    /// `--set`, one entry per use.
    pub rule_overrides: Vec<String>,
    /// `--no-traces`.
    pub no_traces: bool,
    /// `--partner`.
    pub partner: Option<String>,
    /// `--person`.
    pub person: Option<PersonChange>,
    /// `--appearance`.
    pub appearance: Option<Appearance>,
    /// `--perception`.
    pub perception: Option<String>,
    /// `--behavior`.
    pub behavior: Option<String>,
    /// `--track`.
    pub track: Option<Track>,
    /// Files that the commands of helper processes name. A helper without an entry is not compared on
    /// resume.
    pub helper_files: HelperFiles,
}

/// Value of `split` for episodes from files.
pub const FILES: &str = "files";

impl RunOptions {
    /// Returns the rules, with overrides applied.
    ///
    /// # Errors
    /// If an override names an unknown rule or an invalid value.
    pub fn rules(&self) -> Result<RuleSet> {
        let named = RuleSet::named(self.rules);
        let mut overrides = self.rule_overrides.iter();
        Ok(overrides.try_fold(named, |rules, setting| rules.with_recorded(setting))?)
    }

    /// Returns the digest of all options as compact JSON.
    pub fn digest(&self) -> Digest {
        Digest::of_bytes(&serde_json::to_vec(self).expect("options have string keys"))
    }

    /// Returns the command that plays the same run. Helpers that are not built in appear by their name
    /// only, and the folder of episode files as `DIR`.
    pub fn command(&self) -> String {
        let tasks: Vec<&str> = self.tasks.iter().map(|task| task.name()).collect();
        let mut words = vec!["chaic eval".to_owned()];
        let mut option = |name: &str, value: Option<String>| {
            words.extend(value.map(|value| format!("--{name} {value}")));
        };
        let is_all = self.tasks.iter().copied().eq(TaskId::paper());
        option("task", (!is_all).then(|| tasks.join(",")));
        option("helper", (self.helpers != DEFAULT_HELPERS).then(|| self.helpers.join(",")));
        match self.split.as_str() {
            FILES => option("episodes", Some("DIR".to_owned())),
            split => option("split", (split != Split::Test.to_string()).then(|| split.to_owned())),
        }
        option("n-episodes", self.n_episodes.map(|n| n.to_string()));
        option("seeds", (self.seeds != 1).then(|| self.seeds.to_string()));
        option("size", self.image_size.map(|px| px.to_string()));
        option("rules", (self.rules != RuleSetName::Paper).then(|| self.rules.to_string()));
        for setting in &self.rule_overrides {
            option("set", Some(setting.clone()));
        }
        option("partner", self.partner.clone());
        option("person", self.person.map(|kind| kind.to_string()));
        option("appearance", self.appearance.clone());
        option("perception", self.perception.clone());
        option("behavior", self.behavior.clone());
        option("track", (self.track != Track::default()).then(|| self.track.to_string()));
        if !self.traces {
            words.push("--no-traces".to_owned());
        }
        words.join(" ")
    }

    /// Returns the appearance of scenes.
    ///
    /// # Errors
    /// If the appearance is unknown.
    pub fn appearance(&self) -> Result<Appearance> {
        let named = self.appearance.as_deref().unwrap_or("canonical");
        named.parse().map_err(EvalError::Options)
    }
}

impl RunRequest {
    /// Returns the options of a new run.
    ///
    /// # Errors
    /// If options contradict each other or are out of range.
    pub fn new_options(&self) -> Result<RunOptions> {
        let invalid = |text: String| Err(EvalError::Options(text));
        let (seeds, image_size) = (self.seeds.unwrap_or(1), self.image_size);
        if seeds == 0 || self.n_episodes == Some(0) {
            return invalid("--seeds and --n-episodes are at least 1".to_owned());
        }
        if let Some(px) = image_size.filter(|s| !(MIN_IMAGE_SIZE..=MAX_IMAGE_SIZE).contains(s)) {
            let range = format!("{MIN_IMAGE_SIZE} to {MAX_IMAGE_SIZE}");
            return invalid(format!("--size is {px}, expected {range} pixels"));
        }
        if self.split.is_some() && self.episodes.is_some() {
            return invalid("give --split or --episodes, not both".to_owned());
        }
        let split = match &self.episodes {
            Some(_) => FILES.to_owned(),
            None => self.split.clone().unwrap_or(Split::Test).to_string(),
        };
        let helpers =
            self.helpers.clone().unwrap_or_else(|| DEFAULT_HELPERS.map(str::to_owned).to_vec());
        let tasks = match (&self.tasks, &self.episodes) {
            (Some(tasks), _) => tasks.clone(),
            (None, Some(folder)) => tasks_of_files(folder)?,
            (None, None) => TaskId::paper().collect(),
        };
        let (tasks, helpers) = (without_repeats(tasks), without_repeats(helpers));
        if tasks.is_empty() || helpers.is_empty() {
            return invalid("a run needs at least one task and one helper".to_owned());
        }
        let partner =
            self.partner.as_deref().filter(|name| *name != RULES).map(recorded_partner_name);
        let appearance = self.appearance.filter(|a| *a != Appearance::Canonical);
        let options = RunOptions {
            tasks,
            helpers,
            split,
            n_episodes: self.n_episodes,
            seeds,
            image_size,
            rules: self.rules.unwrap_or(RuleSetName::Paper),
            rule_overrides: self.rule_overrides.clone(),
            traces: !self.no_traces,
            partner,
            person: self.person,
            appearance: appearance.map(|a| a.to_string()),
            perception: self.perception.clone().filter(|name| name != GROUND_TRUTH),
            behavior: self.behavior.clone().filter(|name| name != GROUND_TRUTH),
            track: self.track.unwrap_or_default(),
        };
        options.rules()?;
        options.appearance()?;
        Ok(options)
    }

    /// Returns the options of a resumed run.
    ///
    /// # Errors
    /// [`EvalError::OptionDiffers`] if an option differs from the recorded one.
    pub fn resumed_options(&self, recorded: &RunOptions, path: &Path) -> Result<RunOptions> {
        let list = |tasks: &[TaskId]| tasks.iter().map(|t| t.name()).collect::<Vec<_>>().join(",");
        let number = |n: Option<u32>| n.map_or("not given".to_owned(), |n| n.to_string());
        let has_files = recorded.split == FILES;
        let tasks = self.tasks.as_ref().filter(|t| !have_same_elements(t, &recorded.tasks));
        let helpers = self.helpers.as_ref().filter(|h| !have_same_elements(h, &recorded.helpers));
        let options = [
            ("--task", tasks.map(|t| list(t)), list(&recorded.tasks)),
            ("--helper", helpers.map(|h| h.join(",")), recorded.helpers.join(",")),
            (
                "--split",
                self.split.as_ref().map(Split::to_string),
                if has_files { number(None) } else { recorded.split.clone() },
            ),
            (
                "--episodes",
                // `check_episode_files` compares the files with those of the run.
                self.episodes.as_ref().filter(|_| !has_files).map(|p| p.display().to_string()),
                number(None),
            ),
            ("--n-episodes", self.n_episodes.map(|n| n.to_string()), number(recorded.n_episodes)),
            ("--seeds", self.seeds.map(|n| n.to_string()), recorded.seeds.to_string()),
            ("--rules", self.rules.map(|r| r.to_string()), recorded.rules.to_string()),
            (
                "--set",
                (!self.rule_overrides.is_empty()).then(|| self.rule_overrides.join(" ")),
                if recorded.rule_overrides.is_empty() {
                    number(None)
                } else {
                    recorded.rule_overrides.join(" ")
                },
            ),
            (
                "--partner",
                self.partner.as_deref().map(recorded_partner_name),
                recorded.partner.clone().unwrap_or_else(|| RULES.to_owned()),
            ),
            (
                "--person",
                self.person.map(|k| k.to_string()),
                recorded.person.map_or("not given".to_owned(), |k| k.to_string()),
            ),
            (
                "--appearance",
                self.appearance.map(|a| a.to_string()),
                recorded.appearance.clone().unwrap_or_else(|| Appearance::Canonical.to_string()),
            ),
            (
                "--perception",
                self.perception.clone(),
                recorded.perception.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned()),
            ),
            (
                "--behavior",
                self.behavior.clone(),
                recorded.behavior.clone().unwrap_or_else(|| GROUND_TRUTH.to_owned()),
            ),
            ("--track", self.track.map(|t| t.to_string()), recorded.track.to_string()),
            ("--size", self.image_size.map(|n| n.to_string()), number(recorded.image_size)),
            (
                "--no-traces",
                self.no_traces.then(|| "on".to_owned()),
                if recorded.traces { "off" } else { "on" }.to_owned(),
            ),
        ];
        for (option, given, recorded) in options {
            if let Some(given) = given.filter(|g| *g != recorded) {
                return Err(EvalError::OptionDiffers {
                    path: path.to_owned(),
                    option,
                    recorded,
                    given,
                });
            }
        }
        Ok(recorded.clone())
    }
}

/// Helpers of a run that names none.
pub const DEFAULT_HELPERS: [&str; 4] = ["none", "random", "rhp", "oracle"];

/// Returns whether two lists have the same elements, ignoring order and repetitions.
fn have_same_elements<T: PartialEq>(a: &[T], b: &[T]) -> bool {
    a.iter().all(|x| b.contains(x)) && b.iter().all(|x| a.contains(x))
}

fn without_repeats<T: PartialEq>(items: Vec<T>) -> Vec<T> {
    items.into_iter().fold(Vec::new(), |mut kept, item| {
        if !kept.contains(&item) {
            kept.push(item);
        }
        kept
    })
}
