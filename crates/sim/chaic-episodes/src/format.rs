//! Episode file: a JSON envelope around a setup.

mod error;
mod layout;

pub use error::EpisodeError;

use chaic_core::TaskId;
use chaic_core::capability::PersonChange;
use chaic_core::task::SceneKind;
use chaic_world::Setup;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Settings;
use crate::validate::{playable, validate};

/// Largest episode file that is read, bytes: a hundred times a bundled episode.
pub const MAX_EPISODE_BYTES: usize = 16 << 20;
/// Maximum length of `id` and `split`, bytes: they become file names and table rows.
const MAX_NAME_BYTES: usize = 128;

/// Value of the field `format`.
const FORMAT: &str = "chaic-episode";
/// Value of the field `version`.
const VERSION: u32 = 1;

/// Generator of an episode with its inputs; enough to generate the episode again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GeneratorInfo {
    /// Name of the generator: `house`, `street` or `yard`.
    pub name: String,
    /// Version of the generator; another version may produce another episode from the same seeds.
    pub version: u32,
    /// Seed of the contents: goal, objects, people.
    pub seed: u64,
    /// Seed of the surroundings: walls, furniture, scenery.
    pub place_seed: u64,
    /// Settings of the generator; absent for the paper's settings.
    #[serde(default, skip_serializing_if = "Settings::is_paper")]
    pub settings: Settings,
}

impl GeneratorInfo {
    /// Returns a name of the surroundings. Episodes with the same name take place in the same
    /// house, street or yard, so they are not independent samples.
    pub fn environment(&self) -> String {
        format!("{}/{}", self.name, self.place_seed)
    }
}

/// Returns the name of the task's generator.
pub(crate) fn generator_name(task: TaskId) -> &'static str {
    match task.info().scene {
        SceneKind::House => "house",
        SceneKind::Street => "street",
        SceneKind::Yard => "yard",
    }
}

/// Content of an episode file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    title = "chaic-episode",
    description = "One episode of chaic. The schema describes the format; `chaic episodes validate` \
                   checks whether the episode can be played"
)]
struct EpisodeFile {
    /// Always `chaic-episode`.
    format: String,
    /// Version of the format, 1.
    version: u32,
    /// Name of the episode, for example `obstacle/test/07`.
    id: String,
    /// Split that the episode belongs to: `train`, `test`, `standard`, `generated`, or any other word.
    split: String,
    /// Generator that made it, if any.
    generator: Option<GeneratorInfo>,
    /// Initial state of the episode.
    setup: Setup,
}

/// Fields that decide whether the file can be read.
#[derive(Deserialize)]
#[serde(expecting = "an object with the fields of an episode")]
struct Header {
    format: Option<serde_json::Value>,
    version: Option<serde_json::Value>,
}

/// A valid episode: one that can be played to the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Episode {
    file: EpisodeFile,
}

impl Episode {
    /// Creates an episode from a setup. The setup must pass [`validate`], or only [`playable`] if
    /// no generator made it.
    ///
    /// # Errors
    /// [`EpisodeError::Invalid`] with all problems.
    pub fn new(
        id: impl Into<String>,
        split: impl Into<String>,
        generator: Option<GeneratorInfo>,
        setup: Setup,
    ) -> Result<Episode, EpisodeError> {
        let file = EpisodeFile {
            format: FORMAT.to_owned(),
            version: VERSION,
            id: id.into(),
            split: split.into(),
            generator,
            setup,
        };
        let source_name = file.id.clone();
        Episode::checked(file, &source_name)
    }

    /// Reads an episode file. `source_name` names the source in errors; usually its path.
    ///
    /// # Errors
    /// [`EpisodeError`] with the place, the problem, and the expected value.
    pub fn parse(bytes: &[u8], source_name: &str) -> Result<Episode, EpisodeError> {
        Episode::checked(read(bytes, source_name)?, source_name)
    }

    /// Reads an episode that a test has validated: a bundled one.
    pub(crate) fn parse_trusted(text: &str, source_name: &str) -> Result<Episode, EpisodeError> {
        Ok(Episode { file: read(text.as_bytes(), source_name)? })
    }

    /// Creates an episode from a setup that its generator has validated.
    pub(crate) fn trusted(
        id: String,
        split: String,
        generator: GeneratorInfo,
        setup: Setup,
    ) -> Episode {
        let (format, version) = (FORMAT.to_owned(), VERSION);
        Episode {
            file: EpisodeFile { format, version, id, split, generator: Some(generator), setup },
        }
    }

    fn checked(file: EpisodeFile, source_name: &str) -> Result<Episode, EpisodeError> {
        // A file that names one of our generators must meet the stricter checks of that
        // generator.
        let strictness = if file.generator.is_some() { validate } else { playable };
        let mut problems = strictness(&file.setup);
        for problem in &mut problems {
            problem.field = format!("setup.{}", problem.field);
        }
        for (field, name) in [("id", &file.id), ("split", &file.split)] {
            if let Some(problem) = find_name_problem(name) {
                problems.push(crate::Problem { field: field.into(), problem });
            }
        }
        // The name becomes part of that of the environment, by which reports group episodes.
        let expected = generator_name(file.setup.task);
        if let Some(info) = file.generator.as_ref().filter(|info| info.name != expected) {
            let found = error::truncated(&format!("{:?}", info.name));
            let problem = format!("is {found}, expected {expected:?} for {}", file.setup.task);
            problems.push(crate::Problem { field: "generator.name".into(), problem });
        }
        if problems.is_empty() {
            Ok(Episode { file })
        } else {
            Err(EpisodeError::Invalid { source_name: source_name.to_owned(), problems })
        }
    }

    /// Returns the episode with another or a changed partner. The change is appended to the name.
    ///
    /// # Errors
    /// [`EpisodeError::Invalid`] if such a person cannot play it, for example if it does not fit at
    /// the start or has no bicycle.
    pub fn with_partner(self, change: PersonChange) -> Result<Episode, EpisodeError> {
        let EpisodeFile { id, split, mut setup, .. } = self.file;
        setup.people[0] = setup.people[0].changed(change);
        // Generator information is dropped, because it implies the task's own partner.
        Episode::new(format!("{id}/{change}"), split, None, setup)
    }

    /// Returns the name, for example `obstacle/test/07`.
    pub fn id(&self) -> &str {
        &self.file.id
    }

    /// Returns the split that the episode belongs to.
    pub fn split(&self) -> &str {
        &self.file.split
    }

    /// Returns the task.
    pub fn task(&self) -> TaskId {
        self.file.setup.task
    }

    /// Returns the seed of all random draws during the episode.
    pub fn seed(&self) -> u64 {
        self.file.setup.seed
    }

    /// Returns the generator that made the episode, if any.
    pub fn generator(&self) -> Option<&GeneratorInfo> {
        self.file.generator.as_ref()
    }

    /// Returns the initial state.
    pub fn setup(&self) -> &Setup {
        &self.file.setup
    }

    /// Returns the initial state without the envelope.
    pub fn into_setup(self) -> Setup {
        self.file.setup
    }

    /// Returns the file content. Equal episodes have equal bytes; each object is on its own line,
    /// so that two versions can be compared with `diff`.
    pub fn to_json(&self) -> String {
        layout::to_lines(&self.file)
    }

    /// Returns the file content on a single line, without a trailing line break.
    pub fn to_json_line(&self) -> String {
        serde_json::to_string(&self.file)
            .expect("a setup has no maps, and serialization of its parts never fails")
    }
}

/// Returns the problem of an invalid name, if any.
fn find_name_problem(name: &str) -> Option<String> {
    if name.is_empty() || name.len() > MAX_NAME_BYTES {
        return Some(format!("has {} bytes, expected 1 to {MAX_NAME_BYTES}", name.len()));
    }
    let invalid = name.chars().find(|c| !(c.is_ascii_alphanumeric() || "_-./:+".contains(*c)))?;
    Some(format!("contains {invalid:?}, expected letters, digits and any of _-./:+"))
}

/// Name of positions outside all fields in messages.
const TOP_LEVEL: &str = "top level";

/// Parses the JSON; an error comes with the name of the field.
#[cfg(feature = "error-paths")]
fn parse_json(bytes: &[u8]) -> Result<EpisodeFile, (String, serde_json::Error)> {
    let mut json = serde_json::Deserializer::from_slice(bytes);
    serde_path_to_error::deserialize(&mut json).map_err(|e| {
        let is_top_level = e.path().iter().next().is_none();
        let field = if is_top_level { TOP_LEVEL.to_owned() } else { e.path().to_string() };
        (field, e.into_inner())
    })
}

#[cfg(not(feature = "error-paths"))]
fn parse_json(bytes: &[u8]) -> Result<EpisodeFile, (String, serde_json::Error)> {
    serde_json::from_slice(bytes).map_err(|e| (TOP_LEVEL.to_owned(), e))
}

/// Parses the file content if format, version and all fields are valid.
fn read(bytes: &[u8], source_name: &str) -> Result<EpisodeFile, EpisodeError> {
    let source = || source_name.to_owned();
    if bytes.len() > MAX_EPISODE_BYTES {
        let (bytes, limit) = (bytes.len(), MAX_EPISODE_BYTES);
        return Err(EpisodeError::TooLong { source_name: source(), bytes, limit });
    }
    // Some editors put a byte order mark first.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let field_of = || parse_json(bytes).err().map_or(TOP_LEVEL.to_owned(), |(field, _)| field);
    let syntax = |e: serde_json::Error| EpisodeError::from_syntax(source_name, &e, field_of);
    // The first pass checks syntax only, so that a truncated file is not reported as an invalid
    // one.
    let header: Header = serde_json::from_slice(bytes).map_err(syntax)?;
    if header.format.as_ref().and_then(|f| f.as_str()) != Some(FORMAT) {
        let found =
            header.format.map_or("nothing".to_owned(), |f| error::truncated(&f.to_string()));
        return Err(EpisodeError::WrongFormat { source_name: source(), found, expected: FORMAT });
    }
    if header.version.as_ref().and_then(|v| v.as_u64()) != Some(u64::from(VERSION)) {
        let found =
            header.version.map_or("nothing".to_owned(), |v| error::truncated(&v.to_string()));
        return Err(EpisodeError::WrongVersion { source_name: source(), found, expected: VERSION });
    }
    parse_json(bytes).map_err(|(field, problem)| {
        let problem = problem.to_string();
        EpisodeError::Field { source_name: source(), field, problem }
    })
}

/// Returns the JSON schema of an episode file, for editors and other programs.
pub fn json_schema() -> serde_json::Value {
    schemars::schema_for!(EpisodeFile).to_value()
}
