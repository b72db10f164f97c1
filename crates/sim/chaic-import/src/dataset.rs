//! Data set folder of the public CHAIC repository.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use chaic_core::TaskId;
use chaic_world::Setup;
use serde::Deserialize;

use crate::axes::{self, Triple};
use crate::{ImportError, files};

/// Maximum number of episodes of a task and half. The original has 12; each entry of a list can name the same
/// large files.
const MAX_EPISODES: usize = 1000;

/// Training or test part of the data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceSplit {
    /// Floor plans 1 and 4.
    Train,
    /// Floor plans 2 and 5.
    Test,
}

impl SourceSplit {
    /// Returns the name in ids and files.
    pub fn name(self) -> &'static str {
        match self {
            SourceSplit::Train => "train",
            SourceSplit::Test => "test",
        }
    }

    /// Returns the folder in a data set, if it exists.
    pub(crate) fn folder(self, dataset: &Path) -> Option<PathBuf> {
        let name = self.name();
        files::first_folder([dataset.join(format!("{name}_dataset")), dataset.join(name)])
    }
}

/// One episode in `test_env.json`.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Entry {
    /// Floor plan and variant, for example `1a`; only a label outdoors.
    pub scene: String,
    /// Layout and number, for example `2_0`.
    pub layout: String,
    pub seed: u64,
    pub task: Task,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Task {
    pub goal_position_names: Names,
    /// Models with the number of each.
    pub goal_task: Vec<(String, u32)>,
    pub container_names: Vec<String>,
    pub task_kind: String,
    #[serde(default)]
    pub obstacle_names: Vec<String>,
}

/// Categories of goal places: a list indoors, a single one outdoors.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a name or a list of names")]
pub(crate) enum Names {
    Many(Vec<String>),
    One(String),
}

/// Commands that build an episode; all others set up cameras.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "$type", rename_all = "snake_case")]
enum Command {
    AddObject {
        id: u64,
        name: String,
        position: Triple,
        rotation: Option<Triple>,
    },
    RotateObjectToEulerAngles {
        id: u64,
        euler_angles: Triple,
    },
    ScaleObject {
        id: u64,
        scale_factor: Triple,
    },
    ScaleObjectAndMass {
        id: u64,
        scale_factor: Triple,
    },
    #[serde(other)]
    Other,
}

/// An object after all commands.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    id: u64,
    pub model: String,
    pub position: Triple,
    /// Degrees, about z, then x, then y.
    pub euler_deg: Triple,
    pub scale: Triple,
}

/// Content of the metadata file.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Metadata {
    /// Start positions of agents, by their number.
    pub agent: BTreeMap<String, Start>,
    /// Model and room of every object but obstacles; indoors only.
    #[serde(default)]
    pub object_room_list: Vec<(String, String)>,
    /// Height of the bottoms of objects at rest, meters, containers apart; indoors only.
    #[serde(default, deserialize_with = "axes::bounded_numbers")]
    pub object_height: Vec<f32>,
    #[serde(default, deserialize_with = "axes::bounded_numbers")]
    pub container_height: Vec<f32>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a position, {x, y, z} or [x, y, z], of numbers up to 10000 meters"
)]
pub(crate) enum Start {
    Named(Triple),
    Listed([f32; 3]),
}

impl Start {
    pub fn position(self) -> glam::Vec3 {
        match self {
            Start::Named(t) => t.into(),
            // Setups are checked for positions that are too far away.
            Start::Listed(p) => p.into(),
        }
    }
}

/// All data of one episode.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub task: TaskId,
    /// Index among the episodes of task and half.
    pub index: usize,
    pub entry: Entry,
    pub objects: Vec<Object>,
    pub metadata: Metadata,
    /// Source of the objects, for errors.
    pub commands_path: PathBuf,
    pub metadata_path: PathBuf,
    pub list_path: PathBuf,
}

/// Names of rooms by floor plan, layout and region.
pub(crate) type RoomTypes = BTreeMap<String, Vec<Vec<String>>>;

/// Reads the names of rooms, from a folder of episodes or one of the two folders above it.
pub(crate) fn room_types(folder: &Path) -> Result<RoomTypes, ImportError> {
    let file = |p: &Path| p.join("room_types.json");
    let mut candidates = folder.ancestors().take(3).map(file);
    let found = candidates.find(|p| p.is_file()).unwrap_or_else(|| file(folder));
    files::read(&found)
}

/// Folder of the episodes of a task.
#[derive(Debug)]
pub(crate) struct TaskFolder {
    pub task: TaskId,
    path: PathBuf,
    entries: Vec<Entry>,
}

impl TaskFolder {
    /// Reads the list of episodes of a task.
    pub fn read(half: &Path, task: TaskId) -> Result<TaskFolder, ImportError> {
        let path = half.join(task.original_name().unwrap_or_default());
        if !path.is_dir() {
            return Err(ImportError::unreadable(
                &path,
                "is missing, expected a folder of episodes",
            ));
        }
        let list_path = path.join("test_env.json");
        let entries: Vec<Entry> = files::read(&list_path)?;
        if entries.len() > MAX_EPISODES {
            let problem =
                format!("has {} episodes, expected at most {MAX_EPISODES}", entries.len());
            return Err(ImportError::field(&list_path, ".", problem));
        }
        Ok(TaskFolder { task, path, entries })
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Returns the path of the list of episodes.
    pub fn list_path(&self) -> PathBuf {
        self.path.join("test_env.json")
    }

    /// Reads the names of rooms.
    pub fn room_types(&self) -> Result<RoomTypes, ImportError> {
        room_types(&self.path)
    }

    /// Reads one episode.
    pub fn episode(&self, index: usize) -> Result<Source, ImportError> {
        let (entry, list_path) = (self.entries[index].clone(), self.list_path());
        for (field, word) in [("scene", &entry.scene), ("layout", &entry.layout)] {
            if !files::is_plain(word) {
                let problem = format!("is {word:?}, which cannot be part of a file name");
                return Err(ImportError::field(&list_path, format!("[{index}].{field}"), problem));
            }
        }
        let kind = &entry.task.task_kind;
        if self.task.original_name() != Some(kind) {
            let names: Vec<&str> = TaskId::paper().filter_map(TaskId::original_name).collect();
            let field = format!("[{index}].task.task_kind");
            let problem = if names.contains(&kind.as_str()) {
                format!("is {kind:?}, but is in the folder of another task")
            } else {
                format!("is {kind:?}, expected one of {}", names.join(", "))
            };
            return Err(ImportError::field(&list_path, field, problem));
        }
        let stem = format!("{}_{}", entry.scene, entry.layout);
        let commands_path = self.path.join(format!("{stem}.json"));
        let metadata_path = self.path.join(format!("{stem}_metadata.json"));
        let objects = objects(files::read(&commands_path)?, &commands_path)?;
        let metadata = files::read(&metadata_path)?;
        let task = self.task;
        Ok(Source {
            task,
            index,
            entry,
            objects,
            metadata,
            commands_path,
            metadata_path,
            list_path,
        })
    }
}

/// Executes the commands.
fn objects(commands: Vec<Command>, path: &Path) -> Result<Vec<Object>, ImportError> {
    let mut objects: Vec<Object> = Vec::new();
    for (i, command) in commands.into_iter().enumerate() {
        let index_of = |id: u64, objects: &[Object]| {
            objects.iter().position(|o| o.id == id).ok_or_else(|| {
                let problem = format!("is {id}, but no object of this id has been added");
                ImportError::field(path, format!("[{i}].id"), problem)
            })
        };
        match command {
            Command::AddObject { id, name, position, rotation } => {
                let euler_deg = rotation.unwrap_or(Triple { x: 0.0, y: 0.0, z: 0.0 });
                let scale = Triple { x: 1.0, y: 1.0, z: 1.0 };
                let field = format!("[{i}].id");
                if objects.iter().any(|o| o.id == id) {
                    let problem = format!("is {id}, which is the id of another object");
                    return Err(ImportError::field(path, field, problem));
                }
                if objects.len() == Setup::MAX_OBJECTS {
                    let problem = format!("adds more than {} objects", Setup::MAX_OBJECTS);
                    return Err(ImportError::field(path, field, problem));
                }
                objects.push(Object { id, model: name, position, euler_deg, scale });
            }
            Command::RotateObjectToEulerAngles { id, euler_angles } => {
                let k = index_of(id, &objects)?;
                objects[k].euler_deg = euler_angles;
            }
            Command::ScaleObject { id, scale_factor: f }
            | Command::ScaleObjectAndMass { id, scale_factor: f } => {
                let k = index_of(id, &objects)?;
                let s = &mut objects[k].scale;
                *s = Triple { x: s.x * f.x, y: s.y * f.y, z: s.z * f.z };
            }
            Command::Other => {}
        }
    }
    Ok(objects)
}
