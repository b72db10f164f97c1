//! What a run plays. Everything here moves scores, so a run is resumed with the same only.

use std::path::{Path, PathBuf};

use chaic_agents::sight::GROUND_TRUTH;
use chaic_core::TaskId;
use chaic_core::capability::PersonKind;
use chaic_env::minds::RULES;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::{Digest, Track};
use chaic_episodes::Split;
use chaic_render::Appearance;
use serde::{Deserialize, Serialize};

use crate::error::{EvalError, Result};

/// Largest side of an image that agents may be given, pixels: 16 times the benchmark's area.
pub const MAX_IMAGE_SIZE: u32 = 2048;
/// Smallest one: fewer pixels show nothing.
pub const MIN_IMAGE_SIZE: u32 = 16;

/// What a run plays, as `run.json` records it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunOptions {
    /// The tasks.
    pub tasks: Vec<TaskId>,
    /// The helpers.
    pub helpers: Vec<String>,
    /// The split; `files` if the episodes are files.
    pub split: String,
    /// How many episodes of each task, from the first; absent for all.
    pub first: Option<u32>,
    /// How many seeds each episode is played with.
    pub seeds: u32,
    /// Side of everybody's images, pixels; absent for what each mind asks for.
    pub size: Option<u32>,
    /// The rules.
    pub rules: RuleSetName,
    /// Single rules that are set otherwise, as `NAME=VALUE`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Whether traces are kept. Without them a run takes little room, and can't be verified or
    /// replayed.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub traces: bool,
    /// Who drives the partner; absent for the rule-based minds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner: Option<String>,
    /// What kind of person the partner is; absent for who it is in each episode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner_is: Option<PersonKind>,
    /// How scenes are lit and colored; absent for the benchmark's own look.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub appearance: Option<String>,
    /// By what helpers tell what is in their images, as `--perception` has it; absent for ids from
    /// ground truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perception: Option<String>,
    /// By what helpers tell what others do, as `--behavior` has it; absent for what is granted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub behavior: Option<String>,
    /// What helpers may be granted; absent for any grants.
    #[serde(default, skip_serializing_if = "is_default")]
    pub track: Track,
}

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_default(track: &Track) -> bool {
    *track == Track::default()
}

fn yes() -> bool {
    true
}

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_yes(b: &bool) -> bool {
    *b
}

/// What the caller says of a run. What isn't said is as recorded, or as usual for a new run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunRequest {
    /// `--task`.
    pub tasks: Option<Vec<TaskId>>,
    /// `--helper`.
    pub helpers: Option<Vec<String>>,
    /// `--split`.
    pub split: Option<Split>,
    /// `--first`.
    pub first: Option<u32>,
    /// `--seeds`.
    pub seeds: Option<u32>,
    /// `--size`.
    pub size: Option<u32>,
    /// `--episodes`: a folder with episode files, in place of a split.
    pub episodes: Option<PathBuf>,
    /// `--rules`.
    pub rules: Option<RuleSetName>,
    /// `--set`, once for each.
    pub set: Vec<String>,
    /// `--no-traces`.
    pub no_traces: bool,
    /// `--partner`.
    pub partner: Option<String>,
    /// `--partner-is`.
    pub partner_is: Option<PersonKind>,
    /// `--appearance`.
    pub appearance: Option<Appearance>,
    /// `--perception`.
    pub perception: Option<String>,
    /// `--behavior`.
    pub behavior: Option<String>,
    /// `--track`.
    pub track: Option<Track>,
}

/// What `split` says where the episodes are files.
pub const FILES: &str = "files";

impl RunOptions {
    /// The rules.
    ///
    /// # Errors
    /// If a single rule is set that isn't there, or to what it can't be.
    pub fn rules(&self) -> Result<RuleSet> {
        let named = RuleSet::named(self.rules);
        Ok(self.set.iter().try_fold(named, |rules, setting| rules.with(setting))?)
    }

    /// The digest of all of them, as compact JSON.
    pub fn digest(&self) -> Digest {
        Digest::of_bytes(&serde_json::to_vec(self).expect("options have string keys"))
    }

    /// How scenes are lit and colored.
    ///
    /// # Errors
    /// If there is no such appearance.
    pub fn appearance(&self) -> Result<Appearance> {
        let named = self.appearance.as_deref().unwrap_or("canonical");
        named.parse().map_err(EvalError::Options)
    }
}

impl RunRequest {
    /// The options of a new run.
    ///
    /// # Errors
    /// If they contradict each other, or are out of bounds.
    pub fn begin(&self) -> Result<RunOptions> {
        let wrong = |text: String| Err(EvalError::Options(text));
        let (seeds, size) = (self.seeds.unwrap_or(1), self.size);
        if seeds == 0 || self.first == Some(0) {
            return wrong("--seeds and --first are at least 1".to_owned());
        }
        if let Some(px) = size.filter(|s| !(MIN_IMAGE_SIZE..=MAX_IMAGE_SIZE).contains(s)) {
            let range = format!("{MIN_IMAGE_SIZE} to {MAX_IMAGE_SIZE}");
            return wrong(format!("--size is {px}, expected {range} pixels"));
        }
        if self.split.is_some() && self.episodes.is_some() {
            return wrong("give --split or --episodes, not both".to_owned());
        }
        let split = match &self.episodes {
            Some(_) => FILES.to_owned(),
            None => self.split.clone().unwrap_or(Split::Test).to_string(),
        };
        let helpers =
            self.helpers.clone().unwrap_or_else(|| DEFAULT_HELPERS.map(str::to_owned).to_vec());
        let tasks = match (&self.tasks, &self.episodes) {
            (Some(tasks), _) => tasks.clone(),
            (None, Some(folder)) => super::items::tasks_of_files(folder)?,
            (None, None) => TaskId::paper().collect(),
        };
        let (tasks, helpers) = (without_repeats(tasks), without_repeats(helpers));
        if tasks.is_empty() || helpers.is_empty() {
            return wrong("a run needs at least one task and one helper".to_owned());
        }
        let (first, rules) = (self.first, self.rules.unwrap_or(RuleSetName::Paper));
        let (set, traces) = (self.set.clone(), !self.no_traces);
        let partner = self.partner.clone().filter(|name| name != RULES);
        let varies = self.appearance.filter(|a| *a != Appearance::Canonical);
        let options = RunOptions {
            tasks,
            helpers,
            split,
            first,
            seeds,
            size,
            rules,
            set,
            traces,
            partner,
            partner_is: self.partner_is,
            appearance: varies.map(|a| a.to_string()),
            perception: self.perception.clone().filter(|name| name != GROUND_TRUTH),
            behavior: self.behavior.clone().filter(|name| name != GROUND_TRUTH),
            track: self.track.unwrap_or_default(),
        };
        options.rules()?;
        options.appearance()?;
        Ok(options)
    }

    /// The options of a run that is gone on with.
    ///
    /// # Errors
    /// [`EvalError::OptionDiffers`] if something else is said than what is recorded.
    pub fn resume(&self, recorded: &RunOptions, path: &Path) -> Result<RunOptions> {
        let list = |tasks: &[TaskId]| tasks.iter().map(|t| t.name()).collect::<Vec<_>>().join(",");
        let number = |n: Option<u32>| n.map_or("not given".to_owned(), |n| n.to_string());
        let has_files = recorded.split == FILES;
        let tasks = self.tasks.as_ref().filter(|t| !are_the_same(t, &recorded.tasks));
        let helpers = self.helpers.as_ref().filter(|h| !are_the_same(h, &recorded.helpers));
        let said = [
            ("--task", tasks.map(|t| list(t)), list(&recorded.tasks)),
            ("--helper", helpers.map(|h| h.join(",")), recorded.helpers.join(",")),
            (
                "--split",
                self.split.as_ref().map(Split::to_string),
                if has_files { number(None) } else { recorded.split.clone() },
            ),
            (
                "--episodes",
                // Whether these are the run's own files is for those who read them.
                self.episodes.as_ref().filter(|_| !has_files).map(|p| p.display().to_string()),
                number(None),
            ),
            ("--first", self.first.map(|n| n.to_string()), number(recorded.first)),
            ("--seeds", self.seeds.map(|n| n.to_string()), recorded.seeds.to_string()),
            ("--rules", self.rules.map(|r| r.to_string()), recorded.rules.to_string()),
            (
                "--set",
                (!self.set.is_empty()).then(|| self.set.join(" ")),
                if recorded.set.is_empty() { number(None) } else { recorded.set.join(" ") },
            ),
            (
                "--partner",
                self.partner.clone(),
                recorded.partner.clone().unwrap_or_else(|| RULES.to_owned()),
            ),
            (
                "--partner-is",
                self.partner_is.map(|k| k.to_string()),
                recorded.partner_is.map_or("not given".to_owned(), |k| k.to_string()),
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
            ("--size", self.size.map(|n| n.to_string()), number(recorded.size)),
            (
                "--no-traces",
                self.no_traces.then(|| "on".to_owned()),
                if recorded.traces { "off" } else { "on" }.to_owned(),
            ),
        ];
        for (option, given, recorded) in said {
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

/// The helpers of a run that names none.
pub const DEFAULT_HELPERS: [&str; 4] = ["none", "random", "rhp", "oracle"];

/// Whether two lists name the same, in whatever order and however often.
fn are_the_same<T: PartialEq>(a: &[T], b: &[T]) -> bool {
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
