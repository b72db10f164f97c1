//! The episode file: a JSON envelope around a setup.

mod error;
mod layout;

pub use error::EpisodeError;

use chaic_core::TaskId;
use chaic_core::capability::PersonKind;
use chaic_world::{Person, Setup};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Settings;
use crate::validate::{playable, validate};

/// Longest episode file that is read, bytes: a hundred times a bundled episode.
pub const MAX_EPISODE_BYTES: usize = 16 << 20;
/// Longest `id` and `split`, bytes: they become names of files and rows of tables.
const MAX_NAME_BYTES: usize = 128;

/// What the field `format` says.
const FORMAT: &str = "chaic-episode";
/// What the field `version` says.
const VERSION: u32 = 1;

/// Who made an episode, and from which seeds; enough to make it again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GeneratorInfo {
    /// Name of the generator: `house`, `street` or `yard`.
    pub name: String,
    /// Its version; another version may make another episode from the same seeds.
    pub version: u32,
    /// The seed of what happens: goal, objects, people.
    pub seed: u64,
    /// The seed of the surroundings: walls, furniture, scenery.
    pub place_seed: u64,
    /// What it was asked for besides; absent for the paper's shape.
    #[serde(default, skip_serializing_if = "Settings::is_paper")]
    pub settings: Settings,
}

impl GeneratorInfo {
    /// A name of the surroundings: episodes that share it happen in the same house, street or yard,
    /// and so are no independent samples.
    pub fn environment(&self) -> String {
        format!("{}/{}", self.name, self.place_seed)
    }
}

/// The file as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(
    title = "chaic-episode",
    description = "One episode of chaic. This schema says how it is written; whether it can be played \
                   is for `chaic episodes validate` to decide"
)]
struct EpisodeFile {
    /// Always `chaic-episode`.
    format: String,
    /// Version of the format, 1.
    version: u32,
    /// Name of the episode, for example `obstacle/test/07`.
    id: String,
    /// The split it belongs to: `train`, `test`, `generated`, or any other word.
    split: String,
    /// Who made it, if a generator did.
    generator: Option<GeneratorInfo>,
    /// How it begins.
    setup: Setup,
}

/// As much of the file as says whether to read on.
#[derive(Deserialize)]
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
    /// An episode of a setup that [`validate`] has nothing against, or, if no generator made it,
    /// [`playable`].
    ///
    /// # Errors
    /// [`EpisodeError::Invalid`] with everything that is wrong.
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

    /// Reads an episode file. `source_name` is what errors call it, mostly its path.
    ///
    /// # Errors
    /// What is wrong, where, and what was expected: see [`EpisodeError`].
    pub fn parse(bytes: &[u8], source_name: &str) -> Result<Episode, EpisodeError> {
        Episode::checked(read(bytes, source_name)?, source_name)
    }

    /// Reads an episode that a test has validated: one of the bundled ones.
    pub(crate) fn parse_trusted(text: &str, source_name: &str) -> Result<Episode, EpisodeError> {
        Ok(Episode { file: read(text.as_bytes(), source_name)? })
    }

    /// An episode of a setup that its generator has validated.
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
        // Who names one of our generators keeps its promises.
        let demand = if file.generator.is_some() { validate } else { playable };
        let mut problems = demand(&file.setup);
        for problem in &mut problems {
            problem.field = format!("setup.{}", problem.field);
        }
        for (field, name) in [("id", &file.id), ("split", &file.split)] {
            if let Some(problem) = name_problem(name) {
                problems.push(crate::Problem { field: field.into(), problem });
            }
        }
        if problems.is_empty() {
            Ok(Episode { file })
        } else {
            Err(EpisodeError::Invalid { source_name: source_name.to_owned(), problems })
        }
    }

    /// The same with somebody of this kind for a partner; its name is followed by the kind's.
    ///
    /// # Errors
    /// [`EpisodeError::Invalid`] if such a person can't play it: has no room to start, or no bicycle.
    pub fn with_partner(self, kind: PersonKind) -> Result<Episode, EpisodeError> {
        let EpisodeFile { id, split, mut setup, .. } = self.file;
        let Person { pose, look, .. } = setup.people[0];
        setup.people[0] = Person::new(kind, pose, look);
        // Without its generator's name: that promises who the partner is.
        Episode::new(format!("{id}/{kind}"), split, None, setup)
    }

    /// Its name, for example `obstacle/test/07`.
    pub fn id(&self) -> &str {
        &self.file.id
    }

    /// The split it belongs to.
    pub fn split(&self) -> &str {
        &self.file.split
    }

    /// Its task.
    pub fn task(&self) -> TaskId {
        self.file.setup.task
    }

    /// The seed of every random draw while it is played.
    pub fn seed(&self) -> u64 {
        self.file.setup.seed
    }

    /// Who made it, if a generator did.
    pub fn generator(&self) -> Option<&GeneratorInfo> {
        self.file.generator.as_ref()
    }

    /// How it begins.
    pub fn setup(&self) -> &Setup {
        &self.file.setup
    }

    /// How it begins, without the envelope.
    pub fn into_setup(self) -> Setup {
        self.file.setup
    }

    /// The text of its file: the same bytes for the same episode, one thing a line, so that two
    /// versions can be compared.
    pub fn to_json(&self) -> String {
        layout::by_lines(&self.file)
    }

    /// The text of its file on a single line, without a line break at its end.
    pub fn to_json_line(&self) -> String {
        serde_json::to_string(&self.file).expect("a setup has no maps and no failing parts")
    }
}

/// Why a name can't be one of an episode.
fn name_problem(name: &str) -> Option<String> {
    if name.is_empty() || name.len() > MAX_NAME_BYTES {
        return Some(format!("has {} bytes, expected 1 to {MAX_NAME_BYTES}", name.len()));
    }
    let odd = name.chars().find(|c| !(c.is_ascii_alphanumeric() || "_-./:+".contains(*c)))?;
    Some(format!("holds {odd:?}, expected letters, digits and any of _-./:+"))
}

/// What messages call a place outside all fields.
const TOP_LEVEL: &str = "top level";

fn field_name(path: &serde_path_to_error::Path) -> String {
    if path.iter().next().is_none() { TOP_LEVEL.to_owned() } else { path.to_string() }
}

/// The file's content, if it is one of ours and every field fits.
fn read(bytes: &[u8], source_name: &str) -> Result<EpisodeFile, EpisodeError> {
    let source = || source_name.to_owned();
    if bytes.len() > MAX_EPISODE_BYTES {
        let (bytes, limit) = (bytes.len(), MAX_EPISODE_BYTES);
        return Err(EpisodeError::TooLong { source_name: source(), bytes, limit });
    }
    // Some editors begin a text with a byte order mark.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let whole = || -> Result<EpisodeFile, serde_path_to_error::Error<serde_json::Error>> {
        let mut json = serde_json::Deserializer::from_slice(bytes);
        serde_path_to_error::deserialize(&mut json)
    };
    let field_of = || whole().err().map_or(TOP_LEVEL.to_owned(), |e| field_name(e.path()));
    let syntax = |e: serde_json::Error| EpisodeError::of_syntax(source_name, &e, field_of);
    // The first pass sees syntax only, so that a torn file isn't taken for a wrong one.
    let header: Header = serde_json::from_slice(bytes).map_err(syntax)?;
    if header.format.as_ref().and_then(|f| f.as_str()) != Some(FORMAT) {
        let found =
            header.format.map_or("nothing".to_owned(), |f| error::shortened(&f.to_string()));
        return Err(EpisodeError::WrongFormat { source_name: source(), found, expected: FORMAT });
    }
    if header.version.as_ref().and_then(|v| v.as_u64()) != Some(u64::from(VERSION)) {
        let found =
            header.version.map_or("nothing".to_owned(), |v| error::shortened(&v.to_string()));
        return Err(EpisodeError::WrongVersion { source_name: source(), found, expected: VERSION });
    }
    whole().map_err(|e| {
        let field = field_name(e.path());
        EpisodeError::Field { source_name: source(), field, problem: e.into_inner().to_string() }
    })
}

/// The JSON schema of an episode file, for editors and for other programs.
pub fn json_schema() -> serde_json::Value {
    schemars::schema_for!(EpisodeFile).to_value()
}
