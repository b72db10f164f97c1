//! Manifest of a submission, `submission.toml`.

use std::path::Path;

use chaic_agents::perception_factory::GROUND_TRUTH;
use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::check_new_name;
use chaic_env::{CHAIC_VERSION, Track};
use chaic_episodes::Split;
use chaic_files::toml_problem;
use serde::{Deserialize, Deserializer, de};

use crate::archive::check_path;
use crate::error::{ArenaError, Result};

/// File name of the manifest in the folder of a submission.
pub const MANIFEST: &str = "submission.toml";
/// Maximum size of a manifest, bytes: ten times a long one.
pub const MAX_MANIFEST_BYTES: u64 = 64 << 10;

/// Version of the format.
const VERSION: u32 = 1;
/// Maximum length of a text on one line, bytes.
const MAX_LINE_BYTES: usize = 200;
/// Maximum length of the description, bytes.
const MAX_DESCRIPTION_BYTES: usize = 1000;
/// Maximum length of an error of the TOML parser, characters.
const MAX_PROBLEM_CHARS: usize = 500;
/// Maximum number of authors.
const MAX_AUTHORS: usize = 50;
/// Maximum number of words of a command.
const MAX_WORDS: usize = 64;
/// Maximum core hours of a training: 100 years of 10,000 cores.
const MAX_CORE_HOURS: f64 = 1e10;
/// Perceptions and behavior recognitions that a manifest may name. Those with weights of their own are
/// not part of a submission.
const RECOGNITIONS: [&str; 2] = [GROUND_TRUTH, "learned"];

/// Description of a submission by its authors. Every value has passed validation.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the format.
    version: u32,
    /// Name of the helper in runs and tables.
    pub name: String,
    /// Version of the helper, such as `1.0`.
    pub release: String,
    /// Authors, in order.
    pub authors: Vec<String>,
    /// License as an SPDX expression.
    pub license: String,
    /// Description of the helper.
    pub description: String,
    /// Version of chaic that played the public run.
    pub chaic: String,
    /// The helper.
    pub helper: HelperSource,
    /// Conditions under which the helper plays.
    #[serde(default)]
    pub play: PlayConditions,
    /// Hardware and computing time of the training.
    pub training: Training,
    /// Episodes of the public run.
    pub public: PublicPart,
}

/// Source of the helper.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "HelperTable")]
pub enum HelperSource {
    /// Program and arguments, run in the folder `helper` of the submission.
    Command(Vec<String>),
    /// Policy below the folder `helper`: a weights file, or a folder with one per task.
    Policy(String),
    /// Name of a built-in helper.
    BuiltIn(String),
}

/// Table `helper` of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HelperTable {
    command: Option<Vec<String>>,
    policy: Option<String>,
    built_in: Option<String>,
}

impl TryFrom<HelperTable> for HelperSource {
    type Error = String;

    fn try_from(table: HelperTable) -> std::result::Result<HelperSource, String> {
        match table {
            HelperTable { command: Some(words), policy: None, built_in: None } => {
                Ok(HelperSource::Command(words))
            }
            HelperTable { command: None, policy: Some(path), built_in: None } => {
                Ok(HelperSource::Policy(path))
            }
            HelperTable { command: None, policy: None, built_in: Some(name) } => {
                Ok(HelperSource::BuiltIn(name))
            }
            _ => Err("give exactly one of `command`, `policy` and `built_in`".to_owned()),
        }
    }
}

/// Conditions under which the helper plays.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlayConditions {
    /// Grants of the helper.
    #[serde(deserialize_with = "grants")]
    pub grants: Grants,
    /// Track.
    pub track: Track,
    /// Object detection, `gt` or `learned`.
    pub perception: String,
    /// Behavior recognition, `gt` or `learned`.
    pub behavior: String,
}

impl Default for PlayConditions {
    fn default() -> PlayConditions {
        let (perception, behavior) = (GROUND_TRUTH.to_owned(), GROUND_TRUTH.to_owned());
        PlayConditions { grants: Grants::NONE, track: Track::default(), perception, behavior }
    }
}

/// Hardware and computing time of the training.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Hardware of training and public run, in words.
    pub hardware: String,
    /// Core hours of training; 0 without training.
    pub core_hours: f64,
}

/// Episodes of the public run.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublicPart {
    /// Split, such as `standard`.
    #[serde(deserialize_with = "split")]
    pub split: Split,
    /// Tasks; absent for the eight of the paper.
    #[serde(default)]
    pub tasks: Option<Vec<TaskId>>,
    /// Number of episodes of each task, from the first; absent for all.
    #[serde(default)]
    pub n_episodes: Option<u32>,
}

fn grants<'de, D: Deserializer<'de>>(from: D) -> std::result::Result<Grants, D::Error> {
    let names = Vec::<String>::deserialize(from)?;
    let repeated = (1..names.len()).find(|k| names[..*k].contains(&names[*k]));
    if let Some(k) = repeated {
        return Err(de::Error::custom(format!("`{}` is listed twice", names[k])));
    }
    Grants::from_names(names.iter().map(String::as_str)).map_err(|name| {
        let known: Vec<_> = Grants::NONE.named().iter().map(|(name, _)| *name).collect();
        de::Error::custom(format!("no grant `{name}`; the grants are {}", known.join(", ")))
    })
}

fn split<'de, D: Deserializer<'de>>(from: D) -> std::result::Result<Split, D::Error> {
    String::deserialize(from)?.parse().map_err(de::Error::custom)
}

impl Manifest {
    /// Parses a manifest. `path` is its name in messages.
    ///
    /// # Errors
    /// [`ArenaError::Manifest`] with the line or field of the first problem.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Manifest> {
        let refused = |problem: String| ArenaError::Manifest { path: path.to_owned(), problem };
        if bytes.len() as u64 > MAX_MANIFEST_BYTES {
            return Err(refused(format!("it is longer than {MAX_MANIFEST_BYTES} bytes")));
        }
        let text = str::from_utf8(bytes).map_err(|_| refused("it is not UTF-8".to_owned()))?;
        let table =
            toml::Deserializer::parse(text).map_err(|error| refused(located(text, "", &error)))?;
        let manifest: Manifest = serde_path_to_error::deserialize(table).map_err(|error| {
            let field = error.path().to_string();
            refused(located(text, &field, error.inner()))
        })?;
        manifest.check().map_err(refused)?;
        Ok(manifest)
    }

    fn check(&self) -> std::result::Result<(), String> {
        if self.version != VERSION {
            return Err(format!("`version` is {}, expected {VERSION}", self.version));
        }
        if self.authors.is_empty() || self.authors.len() > MAX_AUTHORS {
            return Err(format!(
                "`authors` has {} entries, expected 1 to {MAX_AUTHORS}",
                self.authors.len()
            ));
        }
        let is_release = |c: char| c.is_ascii_alphanumeric() || "._-+".contains(c);
        if !self.release.chars().all(is_release) {
            return Err("`release` has other characters than letters, digits and ._-+".to_owned());
        }
        let lines = [
            ("name", &self.name),
            ("release", &self.release),
            ("chaic", &self.chaic),
            ("license", &self.license),
            ("training.hardware", &self.training.hardware),
        ];
        let authors = self.authors.iter().map(|author| ("authors", author));
        for (field, line) in lines.into_iter().chain(authors) {
            check_text(field, line, MAX_LINE_BYTES)?;
        }
        check_text("description", &self.description, MAX_DESCRIPTION_BYTES)?;
        check_new_name(&self.name, &[], "name = \"mine\"").map_err(|e| format!("`name`: {e}"))?;
        spdx::Expression::parse(&self.license)
            .map_err(|error| format!("`license` is no SPDX expression: {}", error.reason))?;
        if self.chaic != CHAIC_VERSION {
            return Err(format!(
                "`chaic` is {}, but this is chaic {CHAIC_VERSION}; use the version of the manifest",
                self.chaic
            ));
        }
        if !(0.0..=MAX_CORE_HOURS).contains(&self.training.core_hours) {
            return Err(format!(
                "`training.core_hours` is {}, expected 0 to {MAX_CORE_HOURS:e}",
                self.training.core_hours
            ));
        }
        self.check_helper()?;
        self.check_play()?;
        self.check_public()
    }

    fn check_helper(&self) -> std::result::Result<(), String> {
        match &self.helper {
            HelperSource::Command(words) => {
                if words.is_empty() || words.len() > MAX_WORDS {
                    let n = words.len();
                    return Err(format!(
                        "`helper.command` has {n} words, expected 1 to {MAX_WORDS}"
                    ));
                }
                words.iter().try_for_each(|w| check_text("helper.command", w, MAX_LINE_BYTES))
            }
            HelperSource::Policy(path) => check_path(path.as_bytes())
                .map(drop)
                .map_err(|problem| format!("`helper.policy`: `{}` {problem}", quoted(path))),
            HelperSource::BuiltIn(name) if *name != self.name => Err(format!(
                "`name` is {}, but a built-in helper keeps its name, `{}`",
                self.name,
                quoted(name)
            )),
            HelperSource::BuiltIn(_) => Ok(()),
        }
    }

    fn check_play(&self) -> std::result::Result<(), String> {
        let PlayConditions { grants, track, perception, behavior } = &self.play;
        for (field, name) in [("perception", perception), ("behavior", behavior)] {
            if !RECOGNITIONS.contains(&name.as_str()) {
                let (name, known) = (quoted(name), RECOGNITIONS.join(" and "));
                return Err(format!("`play.{field}` is `{name}`; the choices are {known}"));
            }
        }
        let [perception, behavior] =
            [perception, behavior].map(|name| (name != GROUND_TRUTH).then_some(name.as_str()));
        track
            .check_grants(&self.name, *grants)
            .and_then(|()| track.check_perception(perception, behavior))
            .map_err(|problem| format!("`play`: {problem}"))
    }

    fn check_public(&self) -> std::result::Result<(), String> {
        let PublicPart { tasks, n_episodes, .. } = &self.public;
        if *n_episodes == Some(0) {
            return Err("`public.n_episodes` is 0, expected at least 1".to_owned());
        }
        let Some(tasks) = tasks else { return Ok(()) };
        let has_repeats = (1..tasks.len()).any(|k| tasks[..k].contains(&tasks[k]));
        if tasks.is_empty() || has_repeats {
            return Err("`public.tasks` must name at least one task, each once".to_owned());
        }
        Ok(())
    }
}

/// Checks a text on one line.
fn check_text(field: &str, text: &str, max_bytes: usize) -> std::result::Result<(), String> {
    if text.trim().is_empty() || text.len() > max_bytes {
        return Err(format!("`{field}` has {} bytes, expected 1 to {max_bytes}", text.len()));
    }
    if text.chars().any(char::is_control) {
        return Err(format!("`{field}` has a line break or another control character"));
    }
    Ok(())
}

/// Returns a value of the manifest for a message: escaped, and cut after [`MAX_LINE_BYTES`] characters.
fn quoted(value: &str) -> String {
    value.escape_debug().take(MAX_LINE_BYTES).collect()
}

/// Formats an error of the TOML parser on one line, with the line in the file and the field. The error can
/// quote any part of the file, so control characters become spaces and the text is cut.
fn located(text: &str, field: &str, error: &toml::de::Error) -> String {
    let message = toml_problem(text, error.span(), error.message());
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = before.map(|before| format!("line {}", before.matches('\n').count() + 1));
    let field = (!["", "."].contains(&field)).then(|| format!("`{field}`"));
    let place: Vec<String> = line.into_iter().chain(field).collect();
    let place = if place.is_empty() { String::new() } else { place.join(", ") + ": " };
    let visible = |c: char| if c.is_control() { ' ' } else { c };
    place.chars().chain(message.chars()).map(visible).take(MAX_PROBLEM_CHARS).collect()
}
