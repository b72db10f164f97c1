//! Folder of clips: one safetensors file per round of episodes. Collection can be interrupted and
//! resumed, and trainings reuse the clips.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_core::Frame;
use chaic_files::{FileError, create_folders, read_bounded, write_atomically};
use chaic_training::settings::to_table;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};

use super::Behavior;
use super::clip::{CROPS, Clip, ClipCounts, ClipSet, N_EXTRA_CROPS};
use super::config::ClipCollectionConfig;
use super::crop::{PersonCrop, SIDE};
use crate::views::DatasetSplit;

/// File of the collection's configuration.
const CONFIG: &str = "rules.toml";
/// Version of the clips: increased when the meaning of a crop changes.
const CLIPS_VERSION: i64 = 4;
/// Maximum size of a file, bytes.
const MAX_BYTES: u64 = 1 << 30;
/// Crops of a clip.
const N_CROPS: usize = CROPS + N_EXTRA_CROPS;
const N_PIXELS: usize = SIDE * SIDE;
/// Tensor with the number of clips of each kind that the episodes gave, u32.
const FOUND: &str = "found";
/// Value in a file for an unknown speed.
const UNKNOWN_SPEED: f32 = -1.0;

/// Error of a clip folder.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file is damaged.
    #[error("{path} holds no clips: {problem}")]
    Format {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        problem: String,
    },
    /// The folder holds clips of another split, perception or version.
    #[error(
        "{0} has clips of another configuration or version; choose another folder, or remove it"
    )]
    Config(PathBuf),
    /// The folder holds clips of another configuration.
    #[error(
        "{path} has clips of another configuration: `{key}` is {requested}, but was {recorded} when they were \
         collected; choose another folder, or remove it",
        path = path.display()
    )]
    Setting {
        /// The folder.
        path: PathBuf,
        /// Key whose value differs.
        key: String,
        /// Value with which the clips were collected.
        recorded: String,
        /// Requested value.
        requested: String,
    },
    /// There are no clips to train on.
    #[error("the episodes gave no clips to train on; set collect.episodes to a larger number")]
    Empty,
}

impl StoreError {
    /// Returns whether the caller's request caused the error.
    pub fn is_usage(&self) -> bool {
        matches!(self, StoreError::Config(_) | StoreError::Setting { .. })
    }
}

/// Folder of clips of one split, perception and configuration.
#[derive(Clone, Debug)]
pub struct ClipFolder(PathBuf);

impl ClipFolder {
    /// Opens a folder, or creates it.
    ///
    /// # Errors
    /// If the folder has clips of another configuration, perception or version, or a file cannot be read or written.
    pub fn open(
        folder: &Path,
        split: DatasetSplit,
        config: &ClipCollectionConfig,
        perception: &dyn PerceptionFactory,
    ) -> Result<ClipFolder, StoreError> {
        create_folders(folder)?;
        let path = folder.join(CONFIG);
        let perception = perception.name().unwrap_or_else(|| GROUND_TRUTH.to_owned());
        let text = format!(
            "part = \"{split}\"\nclips_version = {CLIPS_VERSION}\nperception = {}\n{}",
            toml::Value::from(&*perception),
            toml::to_string(config).expect("the configuration has string keys only")
        );
        if !path.exists() {
            write_atomically(&path, text.as_bytes())?;
            return Ok(ClipFolder(folder.to_owned()));
        }
        let found = parse_config(&read_bounded(&path, MAX_BYTES)?);
        let same_source = found.filter(|(found_split, found_perception, _)| {
            found_split.as_str() == Some(&*split.to_string())
                && found_perception.as_str() == Some(&*perception)
        });
        let Some((_, _, found_config)) = same_source else {
            return Err(StoreError::Config(folder.to_owned()));
        };
        let (recorded, requested) = (to_table(&found_config), to_table(config));
        let changed = requested.iter().find_map(|(key, value)| {
            let before = recorded.get(key).filter(|before| *before != value)?;
            Some(StoreError::Setting {
                path: folder.to_owned(),
                key: key.clone(),
                recorded: before.to_string(),
                requested: value.to_string(),
            })
        });
        changed.map_or_else(|| Ok(ClipFolder(folder.to_owned())), Err)
    }

    fn path(&self, first_episode: usize) -> PathBuf {
        self.0.join(format!("clips-{first_episode:06}.safetensors"))
    }

    /// Reads the clips of the round that starts with this episode; `None` if the round has not been
    /// played.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn read(&self, first_episode: usize) -> Result<Option<ClipSet>, StoreError> {
        let path = self.path(first_episode);
        if !path.exists() {
            return Ok(None);
        }
        let bytes = read_bounded(&path, MAX_BYTES)?;
        let round = from_bytes(&bytes);
        round.map(Some).map_err(|problem| StoreError::Format { path, problem })
    }

    /// Writes the clips of a round.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, first_episode: usize, round: &ClipSet) -> Result<(), StoreError> {
        Ok(write_atomically(&self.path(first_episode), &to_bytes(round))?)
    }
}

/// Parses a configuration file into split, perception and configuration; `None` if it is not one of
/// this version.
fn parse_config(text: &[u8]) -> Option<(toml::Value, toml::Value, ClipCollectionConfig)> {
    let mut table: toml::Table = std::str::from_utf8(text).ok()?.parse().ok()?;
    if table.remove("clips_version")?.as_integer() != Some(CLIPS_VERSION) {
        return None;
    }
    let (split, perception) = (table.remove("part")?, table.remove("perception")?);
    Some((split, perception, table.try_into().ok()?))
}

/// Tensors of a file: name, type and shape per clip.
const TENSORS: [(&str, Dtype, &[usize]); 9] = [
    ("label", Dtype::U8, &[]),
    ("mixed", Dtype::U8, &[]),
    ("frame", Dtype::U32, &[N_CROPS]),
    ("distance_m", Dtype::F32, &[N_CROPS]),
    ("speed", Dtype::F32, &[N_CROPS]),
    ("rgb", Dtype::U8, &[N_CROPS, SIDE, SIDE, 3]),
    ("depth", Dtype::U8, &[N_CROPS, SIDE, SIDE]),
    ("seen", Dtype::U8, &[N_CROPS]),
    ("episode", Dtype::U32, &[]),
];

/// Serializes clips as safetensors; crops without a person are black, at distance 0.
pub fn to_bytes(ClipSet { clips, found }: &ClipSet) -> Vec<u8> {
    let crop_values = |value: &dyn Fn(&PersonCrop) -> [u8; 4]| -> Vec<u8> {
        clips.iter().flat_map(|clip| clip.crops.iter().flat_map(value)).collect()
    };
    let images = |channel: fn(&PersonCrop) -> &Vec<u8>, n: usize| -> Vec<u8> {
        let mut bytes = Vec::with_capacity(clips.len() * N_CROPS * n);
        for crop in clips.iter().flat_map(|clip| &clip.crops) {
            let image = match crop.is_blank() {
                true => Cow::Owned(vec![0; n]),
                false => Cow::Borrowed(channel(crop)),
            };
            bytes.extend_from_slice(&image);
        }
        bytes
    };
    let columns: [Vec<u8>; TENSORS.len()] = [
        clips.iter().map(|clip| clip.label.index() as u8).collect(),
        clips.iter().map(|clip| u8::from(clip.is_mixed)).collect(),
        crop_values(&|crop| crop.frame.to_le_bytes()),
        crop_values(&|crop| crop.distance_m.to_le_bytes()),
        crop_values(&|crop| crop.speed.unwrap_or(UNKNOWN_SPEED).to_le_bytes()),
        images(|crop| &crop.rgb, 3 * N_PIXELS),
        images(|crop| &crop.depth, N_PIXELS),
        clips.iter().flat_map(|clip| &clip.crops).map(|crop| u8::from(crop.is_seen)).collect(),
        clips.iter().flat_map(|clip| clip.episode.to_le_bytes()).collect(),
    ];
    let views = TENSORS.iter().zip(&columns).map(|((name, dtype, clip_shape), bytes)| {
        let shape = std::iter::once(clips.len()).chain(clip_shape.iter().copied()).collect();
        let view = TensorView::new(*dtype, shape, bytes);
        ((*name).to_owned(), view.expect("the length matches the shape"))
    });
    let found: Vec<u8> = found.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect();
    let found_view = TensorView::new(Dtype::U32, vec![ClipCounts::default().len()], &found);
    let found_view = found_view.expect("the length matches the shape");
    let views = views.chain([(FOUND.to_owned(), found_view)]);
    serialize(views, None).expect("names are unique and shapes fit")
}

/// Parses a file of clips; the error names the fault.
fn from_bytes(bytes: &[u8]) -> Result<ClipSet, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
    let n = file.tensor("label").map_err(|e| e.to_string())?.shape().first().copied();
    let n = n.unwrap_or(0);
    let mut columns: Vec<&[u8]> = Vec::new();
    for (name, dtype, clip_shape) in TENSORS {
        let tensor = file.tensor(name).map_err(|e| e.to_string())?;
        let shape: Vec<usize> = std::iter::once(n).chain(clip_shape.iter().copied()).collect();
        if tensor.dtype() != dtype || tensor.shape() != shape {
            return Err(format!("{name} is not {dtype:?} {shape:?}"));
        }
        columns.push(tensor.data());
    }
    let found_tensor = file.tensor(FOUND).map_err(|e| e.to_string())?;
    let mut found = ClipCounts::default();
    if found_tensor.dtype() != Dtype::U32 || found_tensor.shape() != [found.len()] {
        return Err(format!("{FOUND} is not {:?} {:?}", Dtype::U32, [found.len()]));
    }
    for (n, bytes) in found.iter_mut().zip(found_tensor.data().as_chunks::<4>().0) {
        *n = u32::from_le_bytes(*bytes) as usize;
    }
    let bytes_at = |column: usize, k: usize| -> [u8; 4] {
        std::array::from_fn(|byte| columns[column][4 * k + byte])
    };
    let crop = |k: usize| -> Result<PersonCrop, String> {
        let [distance_m, speed] = [3, 4].map(|column| f32::from_le_bytes(bytes_at(column, k)));
        if !distance_m.is_finite() || !speed.is_finite() {
            return Err("a number is not finite".to_owned());
        }
        let frame: Frame = Frame::from_le_bytes(bytes_at(2, k));
        let image = |column: usize, n: usize| columns[column][k * n..][..n].to_vec();
        Ok(match distance_m == 0.0 {
            true => PersonCrop::blank(frame),
            false => PersonCrop {
                frame,
                distance_m,
                speed: (speed >= 0.0).then_some(speed),
                is_seen: columns[7][k] != 0,
                rgb: image(5, 3 * N_PIXELS),
                depth: image(6, N_PIXELS),
            },
        })
    };
    let clip = |k: usize| {
        let label = Behavior::ALL.get(usize::from(columns[0][k])).ok_or("no such behavior")?;
        let crops: Result<Vec<PersonCrop>, String> =
            (N_CROPS * k..N_CROPS * (k + 1)).map(crop).collect();
        let (is_mixed, episode) = (columns[1][k] != 0, u32::from_le_bytes(bytes_at(8, k)));
        Ok(Clip { label: *label, is_mixed, episode, crops: crops? })
    };
    let clips = (0..n).map(clip).collect::<Result<Vec<Clip>, String>>()?;
    let round = ClipSet::new(clips);
    if round.found.iter().zip(found).any(|(kept, found)| *kept > found) {
        return Err(format!("{FOUND} is less than the number of clips"));
    }
    Ok(ClipSet { found, ..round })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use chaic_agents::perception_factory::GroundTruthPerceptionFactory;

    use super::*;
    use crate::perception_registry::perception_from_name;

    fn clip(label: Behavior, first: Frame) -> Clip {
        let visible = |frame| PersonCrop {
            frame,
            distance_m: 2.5,
            speed: (frame % 4 == 0).then_some(0.01),
            is_seen: frame % 3 == 0,
            rgb: (0..3 * N_PIXELS).map(|k| (k % 251) as u8).collect(),
            depth: vec![7; N_PIXELS],
        };
        let frames = (0..N_CROPS as Frame).map(|k| first + 3 * k);
        let crops =
            frames.map(|f| if f % 2 == 0 { visible(f) } else { PersonCrop::blank(f) }).collect();
        Clip { label, is_mixed: label == Behavior::Moving, episode: 70_000 + first, crops }
    }

    fn open(
        folder: &Path,
        split: DatasetSplit,
        config: &ClipCollectionConfig,
    ) -> Result<ClipFolder, StoreError> {
        ClipFolder::open(folder, split, config, &GroundTruthPerceptionFactory)
    }

    #[test]
    fn clips_are_read_as_they_were_written() {
        let dir = tempfile::tempdir().unwrap();
        let config = ClipCollectionConfig::default();
        let folder = open(dir.path(), DatasetSplit::Train, &config).unwrap();
        let mut round = ClipSet::new(vec![clip(Behavior::PutIn, 5), clip(Behavior::Moving, 90)]);
        // Clips that were not kept.
        round.found[Behavior::Moving.index()] += 70_000;
        folder.write(16, &round).unwrap();
        assert!(folder.read(16).unwrap() == Some(round));
        assert!(folder.read(0).unwrap().is_none());
        folder.write(32, &ClipSet::default()).unwrap();
        assert!(folder.read(32).unwrap() == Some(ClipSet::default()));
    }

    #[test]
    fn clips_of_another_perception_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let config = ClipCollectionConfig::default();
        open(dir.path(), DatasetSplit::Train, &config).unwrap();
        let noisy = perception_from_name("noisy", GROUND_TRUTH).unwrap();
        let opened = ClipFolder::open(dir.path(), DatasetSplit::Train, &config, &*noisy);
        assert!(matches!(opened, Err(StoreError::Config(_))));
        open(dir.path(), DatasetSplit::Train, &config).unwrap();
    }

    #[test]
    fn a_folder_of_an_earlier_version_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let config = ClipCollectionConfig::default();
        open(dir.path(), DatasetSplit::Train, &config).unwrap();
        let text = fs::read_to_string(dir.path().join(CONFIG)).unwrap();
        let version = format!("clips_version = {CLIPS_VERSION}\n");
        for other in ["", "clips_version = 3\n"] {
            fs::write(dir.path().join(CONFIG), text.replace(&version, other)).unwrap();
            let opened = open(dir.path(), DatasetSplit::Train, &config);
            assert!(matches!(opened, Err(StoreError::Config(_))), "{other}");
        }
        fs::write(dir.path().join(CONFIG), text).unwrap();
        open(dir.path(), DatasetSplit::Train, &config).unwrap();
    }

    #[test]
    fn other_configurations_and_damaged_files_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let config = ClipCollectionConfig::default();
        let folder = open(dir.path(), DatasetSplit::Train, &config).unwrap();
        let other_config = ClipCollectionConfig { seed: 2, ..config };
        let refused = open(dir.path(), DatasetSplit::Train, &other_config).unwrap_err();
        assert!(refused.to_string().contains("of another configuration"), "{refused}");
        assert!(open(dir.path(), DatasetSplit::Test, &config).is_err());
        let round = ClipSet::new(vec![clip(Behavior::PutOn, 0)]);
        let fewer = ClipSet { found: ClipCounts::default(), ..round.clone() };
        fs::write(folder.path(0), to_bytes(&fewer)).unwrap();
        let error = folder.read(0).unwrap_err().to_string();
        assert!(error.contains("found"), "{error}");
        let bytes = to_bytes(&round);
        for length in [0, 7, 100, bytes.len() - 1] {
            fs::write(folder.path(0), &bytes[..length]).unwrap();
            let error = folder.read(0).unwrap_err().to_string();
            assert!(error.contains("holds no clips"), "{error}");
        }
    }

    #[test]
    fn a_changed_setting_is_named_with_both_values() {
        let dir = tempfile::tempdir().unwrap();
        let config = ClipCollectionConfig::default();
        open(dir.path(), DatasetSplit::Train, &config).unwrap();
        let other_config = ClipCollectionConfig { varied_fraction: 0.5, ..config };
        let refused = open(dir.path(), DatasetSplit::Train, &other_config).unwrap_err();
        let expected =
            "configuration: `varied_fraction` is 0.5, but was 0.35 when they were collected";
        assert!(refused.is_usage() && refused.to_string().contains(expected), "{refused}");
    }
}
