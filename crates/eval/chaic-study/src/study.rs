//! The definition of a study: `study.toml` and the texts that it names.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_core::capability::PersonKind;
use chaic_env::helper_registry::check_new_name;
use chaic_files::{read_user_file, toml_message};
use serde::{Deserialize, Serialize};

use crate::error::{Result, StudyError};
use crate::forms::Questionnaire;

/// Name of a person in traces.
pub const PERSON: &str = "human";
/// Maximum size of `study.toml` and of each text, bytes: a text of 10,000 words.
const MAX_TEXT_BYTES: u64 = 64 << 10;
/// Maximum number of participants, which bounds the size of the page.
pub const MAX_PARTICIPANTS: u32 = 10_000;
/// Maximum number of listed episodes.
const MAX_EPISODES: usize = 100;
/// Maximum number of practice episodes.
const MAX_PRACTICE: usize = 5;
/// Maximum number of episodes of each condition.
const MAX_TRIALS: u32 = 10;
/// Maximum number of levels of a factor.
const MAX_LEVELS: usize = 16;
/// Maximum time-out of a slot, minutes: a week.
const MAX_TIMEOUT_MINUTES: u32 = 7 * 24 * 60;
/// Maximum number of characters of a title or a completion code.
const MAX_TITLE: usize = 200;
/// Speeds of the world, simulated seconds per second.
const SPEEDS: [u32; 4] = [1, 2, 4, 8];

/// Order of the conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Design {
    /// Within participants: each plays all conditions in the order of a balanced Latin square.
    LatinSquare,
    /// Between participants: each plays one condition, drawn in permuted blocks.
    BlockRandom,
}

/// Agent that the person controls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Seat {
    /// The partner, with its body, its view and its goal.
    Partner,
    /// The helper, who learns neither goal nor constraint.
    Helper,
}

impl Seat {
    /// Returns the name in `study.toml`.
    pub fn name(self) -> &'static str {
        match self {
            Seat::Partner => "partner",
            Seat::Helper => "helper",
        }
    }
}

/// Level of the person's decisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// Plans, which a planner executes.
    Plans,
    /// Single actions.
    Steps,
}

impl Input {
    /// Returns the name in `study.toml` and in traces.
    pub fn name(self) -> &'static str {
        match self {
            Input::Plans => "plans",
            Input::Steps => "steps",
        }
    }
}

/// Behavior of the world while the person thinks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum WorldPace {
    /// The world waits for each decision.
    #[serde(rename = "waits")]
    TurnBased,
    /// The world continues, and the person's agent stands still.
    #[serde(rename = "goes_on")]
    RealTime,
}

/// Place where the simulator runs while a person plays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Simulator {
    /// The page, which contains the episodes with their goals.
    #[default]
    Page,
    /// The server, which sends pictures and the state of the person's agent.
    Server,
}

impl Simulator {
    fn is_page(&self) -> bool {
        *self == Simulator::Page
    }
}

/// Settings of all episodes, unless a factor differs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaySettings {
    /// Agent that the person controls.
    #[serde(default = "partner")]
    pub seat: Seat,
    /// Helper beside a person who plays the partner; on a server, also one that is given to it.
    #[serde(default = "no_helper")]
    pub helper: String,
    /// Level of the decisions.
    #[serde(default = "plans")]
    pub input: Input,
    /// Behavior of the world while the person thinks.
    #[serde(default = "waits")]
    pub world: WorldPace,
    /// Simulated seconds per second: 1, 2, 4 or 8.
    #[serde(default = "one")]
    pub speed: u32,
    /// Place where the simulator runs. The default is not part of the digest.
    #[serde(default, skip_serializing_if = "Simulator::is_page")]
    pub simulator: Simulator,
}

fn partner() -> Seat {
    Seat::Partner
}

fn no_helper() -> String {
    chaic_env::helper_registry::NONE.to_owned()
}

fn plans() -> Input {
    Input::Plans
}

fn waits() -> WorldPace {
    WorldPace::TurnBased
}

fn one() -> u32 {
    1
}

impl Default for PlaySettings {
    fn default() -> PlaySettings {
        let (seat, helper, input) = (partner(), no_helper(), plans());
        let simulator = Simulator::Page;
        PlaySettings { seat, helper, input, world: waits(), speed: one(), simulator }
    }
}

/// Forms that the participants answer.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FormPlan {
    /// Names of the forms after the episodes of each condition.
    #[serde(default)]
    pub after_condition: Vec<String>,
    /// Names of the forms after all episodes.
    #[serde(default)]
    pub at_end: Vec<String>,
}

/// Factors with their levels. The conditions are all combinations.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factors {
    /// Helpers beside a person who plays the partner.
    #[serde(default)]
    pub helper: Vec<String>,
    /// Tasks; each selects the listed episodes of this task.
    #[serde(default)]
    pub task: Vec<TaskId>,
    /// Kinds of person of the partner.
    #[serde(default)]
    pub person: Vec<PersonKind>,
    /// Agents that the person controls.
    #[serde(default)]
    pub seat: Vec<Seat>,
    /// Levels of the decisions.
    #[serde(default)]
    pub input: Vec<Input>,
}

/// `study.toml` as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyFile {
    title: String,
    consent: PathBuf,
    instructions: PathBuf,
    debrief: PathBuf,
    completion_code: String,
    participants: u32,
    timeout_minutes: u32,
    design: Design,
    #[serde(default)]
    practice: Vec<String>,
    episodes: Vec<String>,
    #[serde(default = "one")]
    trials: u32,
    #[serde(default)]
    play: PlaySettings,
    #[serde(default)]
    forms: FormPlan,
    #[serde(default)]
    factors: Factors,
}

/// A valid definition of a study. Its serialization has all that participants see, so it determines the
/// digest of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// Heading of the page.
    pub title: String,
    /// Text that a participant reads before anything is stored.
    pub consent: String,
    /// Text before the practice episodes.
    pub instructions: String,
    /// Text at the end.
    pub debrief: String,
    /// Code at the end, for the platform that pays the participants.
    pub completion_code: String,
    /// Number of slots.
    pub participants: u32,
    /// Time after which the slot of a participant is free again, minutes.
    pub timeout_minutes: u32,
    /// Order of the conditions.
    pub design: Design,
    /// Ids of the practice episodes.
    pub practice: Vec<String>,
    /// Ids of the episodes.
    pub episodes: Vec<String>,
    /// Number of episodes of each condition.
    pub trials: u32,
    /// Settings of all episodes, unless a factor differs.
    pub play: PlaySettings,
    /// Names of the forms.
    pub forms: FormPlan,
    /// Factors with their levels.
    pub factors: Factors,
}

impl Study {
    /// Reads `study.toml` and the texts that it names, relative to its folder.
    ///
    /// # Errors
    /// [`StudyError::Definition`] with the key and the expectation, or if a file cannot be read.
    pub fn read(path: &Path) -> Result<Study> {
        let file: StudyFile = {
            let text = read_text(path)?;
            let wrong = |error: toml::de::Error| {
                definition(path, toml_message(&text, error.span(), error.message()))
            };
            toml::from_str(&text).map_err(wrong)?
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let text = |name: &Path| -> Result<String> {
            let path = folder.join(name);
            let text = read_text(&path)?;
            let is_blank = text.trim().is_empty();
            if is_blank {
                Err(definition(&path, "must have some text".to_owned()))
            } else {
                Ok(text)
            }
        };
        let study = Study {
            title: file.title,
            consent: text(&file.consent)?,
            instructions: text(&file.instructions)?,
            debrief: text(&file.debrief)?,
            completion_code: file.completion_code,
            participants: file.participants,
            timeout_minutes: file.timeout_minutes,
            design: file.design,
            practice: file.practice,
            episodes: file.episodes,
            trials: file.trials,
            play: file.play,
            forms: file.forms,
            factors: file.factors,
        };
        match study.problem() {
            Some(problem) => Err(definition(path, problem)),
            None => Ok(study),
        }
    }

    /// Returns the names of all forms, in the order of their first use.
    pub fn form_names(&self) -> Vec<&str> {
        let FormPlan { after_condition, at_end } = &self.forms;
        let mut names: Vec<&str> = Vec::new();
        for name in after_condition.iter().chain(at_end) {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the first invalid value, as key and expectation.
    fn problem(&self) -> Option<String> {
        let count = |key: &str, n: usize, [low, high]: [usize; 2]| {
            let is_valid = (low..=high).contains(&n);
            (!is_valid).then(|| format!("`{key}` must have from {low} to {high} entries, not {n}"))
        };
        let number = |key: &str, n: u32, high: u32| {
            let is_valid = (1..=high).contains(&n);
            (!is_valid).then(|| format!("`{key}` must be from 1 to {high}, not {n}"))
        };
        let Factors { helper, task, person, seat, input } = &self.factors;
        self.text_problem()
            .or_else(|| number("participants", self.participants, MAX_PARTICIPANTS))
            .or_else(|| number("timeout_minutes", self.timeout_minutes, MAX_TIMEOUT_MINUTES))
            .or_else(|| number("trials", self.trials, MAX_TRIALS))
            .or_else(|| count("practice", self.practice.len(), [0, MAX_PRACTICE]))
            .or_else(|| count("episodes", self.episodes.len(), [1, MAX_EPISODES]))
            .or_else(|| {
                repeated("practice` and `episodes", self.practice.iter().chain(&self.episodes))
            })
            .or_else(|| level_problem("helper", helper))
            .or_else(|| level_problem("task", task))
            .or_else(|| level_problem("person", person))
            .or_else(|| level_problem("seat", seat))
            .or_else(|| level_problem("input", input))
            .or_else(|| self.play_problem())
            .or_else(|| self.form_problem())
    }

    fn text_problem(&self) -> Option<String> {
        let is_title = |text: &str| {
            let n = text.chars().count();
            (1..=MAX_TITLE).contains(&n) && !text.chars().any(char::is_control)
        };
        if !is_title(&self.title) {
            return Some(format!("`title` must be one line of 1 to {MAX_TITLE} characters"));
        }
        let code = &self.completion_code;
        let is_code = is_title(code) && code.chars().all(|c| c.is_ascii_graphic());
        (!is_code).then(|| {
            format!("`completion_code` must have 1 to {MAX_TITLE} ASCII characters without spaces")
        })
    }

    fn play_problem(&self) -> Option<String> {
        let PlaySettings { helper, speed, seat, simulator, .. } = &self.play;
        let mut helpers = self.factors.helper.iter().chain([helper]);
        if let Some(unknown) = helpers.find(|name| !is_helper(name, *simulator)) {
            let names = helper_names().join(", ");
            return Some(match simulator {
                Simulator::Page => format!(
                    "`helper` names `{unknown}`; expected one of {names}; others need \
                     `play.simulator = \"server\"`"
                ),
                Simulator::Server => {
                    format!("`helper` names `{unknown}`; expected one of {names}, or another name")
                }
            });
        }
        let seats = self.factors.seat.iter().chain([seat]);
        if !self.factors.helper.is_empty() && seats.clone().any(|seat| *seat == Seat::Helper) {
            return Some(
                "`factors.helper` needs `play.seat = \"partner\"` and no `factors.seat`, since the \
                 person may not be the helper"
                    .to_owned(),
            );
        }
        (!SPEEDS.contains(speed)).then(|| format!("`play.speed` must be 1, 2, 4 or 8, not {speed}"))
    }

    fn form_problem(&self) -> Option<String> {
        let FormPlan { after_condition, at_end } = &self.forms;
        let known = Questionnaire::standard_names();
        let mut all = after_condition.iter().chain(at_end);
        if let Some(unknown) = all.find(|name| !known.contains(&name.as_str())) {
            return Some(format!("no form `{unknown}`; expected one of {}", known.join(", ")));
        }
        repeated("forms.after_condition", after_condition)
            .or_else(|| repeated("forms.at_end", at_end))
    }
}

/// Returns the names of the helpers that run in a page.
pub(crate) fn helper_names() -> Vec<&'static str> {
    let built_in = chaic_agents::HELPERS.iter().map(|helper| helper.name);
    std::iter::once(chaic_env::helper_registry::NONE).chain(built_in).collect()
}

/// Returns whether a helper of this name can exist. A server can have other ones than a page.
fn is_helper(name: &str, simulator: Simulator) -> bool {
    let is_valid = || name != PERSON && check_new_name(name, &[], "").is_ok();
    helper_names().contains(&name) || (simulator == Simulator::Server && is_valid())
}

/// Returns a problem if an entry is repeated.
fn repeated<'a>(key: &str, entries: impl IntoIterator<Item = &'a String>) -> Option<String> {
    let mut seen = BTreeSet::new();
    let repeated = entries.into_iter().find(|entry| !seen.insert(*entry))?;
    Some(format!("`{key}` must not repeat `{repeated}`"))
}

/// Returns a problem if a factor has one level, too many or equal ones.
fn level_problem<T: PartialEq>(factor: &str, levels: &[T]) -> Option<String> {
    let has_duplicates = (1..levels.len()).any(|k| levels[..k].contains(&levels[k]));
    let is_valid = levels.is_empty() || (2..=MAX_LEVELS).contains(&levels.len());
    (has_duplicates || !is_valid)
        .then(|| format!("`factors.{factor}` must have from 2 to {MAX_LEVELS} different levels"))
}

fn definition(path: &Path, problem: String) -> StudyError {
    StudyError::Definition { path: path.to_owned(), problem }
}

/// Reads a text of limited size.
fn read_text(path: &Path) -> Result<String> {
    let bytes = read_user_file(path, MAX_TEXT_BYTES + 1)?;
    if bytes.len() as u64 > MAX_TEXT_BYTES {
        return Err(definition(path, format!("is longer than {MAX_TEXT_BYTES} bytes")));
    }
    String::from_utf8(bytes).map_err(|_| definition(path, "must be UTF-8".to_owned()))
}
