//! Clips in a folder: a safetensors file for each round of episodes, so that collecting can be stopped
//! and gone on with, and a training needn't collect again.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use chaic_core::Frame;
use chaic_files::{FileError, read_bounded, write_whole};
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};

use super::Behavior;
use super::clip::{CROPS, Clip, SLACK};
use super::collect::CollectRules;
use super::crop::{Crop, SIDE};
use crate::views::Part;

/// What clips were collected by.
const RULES: &str = "rules.toml";
/// No file is larger, bytes.
const MOST_BYTES: u64 = 1 << 30;
/// Crops of a clip, and pixels of a crop.
const N_CROPS: usize = CROPS + SLACK;
const N_PIXELS: usize = SIDE * SIDE;

/// Why clips can't be kept or read.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refuses.
    #[error(transparent)]
    File(#[from] FileError),
    /// It isn't what was written.
    #[error("{path} holds no clips: {problem}")]
    Format {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// They were collected by other rules.
    #[error("{0} has clips by other rules; choose another folder, or remove it")]
    Rules(PathBuf),
}

/// A folder of clips of one part by the same rules.
#[derive(Clone, Debug)]
pub struct ClipFolder(PathBuf);

impl ClipFolder {
    /// A new one, or one whose clips were collected by these rules.
    ///
    /// # Errors
    /// If they weren't, or the file system refuses.
    pub fn open(folder: &Path, part: Part, rules: &CollectRules) -> Result<ClipFolder, StoreError> {
        fs::create_dir_all(folder).map_err(FileError::of("make", folder))?;
        let path = folder.join(RULES);
        let text = format!(
            "part = \"{part:?}\"\n{}",
            toml::to_string(rules).expect("rules are plain data")
        );
        if !path.exists() {
            write_whole(&path, text.as_bytes())?;
        } else if read_bounded(&path, MOST_BYTES)? != text.as_bytes() {
            return Err(StoreError::Rules(folder.to_owned()));
        }
        Ok(ClipFolder(folder.to_owned()))
    }

    fn path(&self, first_episode: usize) -> PathBuf {
        self.0.join(format!("clips-{first_episode:06}.safetensors"))
    }

    /// Those of the round that begins with this episode; `None` if it hasn't been played.
    ///
    /// # Errors
    /// If they can't be read.
    pub fn read(&self, first_episode: usize) -> Result<Option<Vec<Clip>>, StoreError> {
        let path = self.path(first_episode);
        if !path.exists() {
            return Ok(None);
        }
        let bytes = read_bounded(&path, MOST_BYTES)?;
        let clips = from_bytes(&bytes);
        clips.map(Some).map_err(|problem| StoreError::Format { path, problem })
    }

    /// Keeps those of a round.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, first_episode: usize, clips: &[Clip]) -> Result<(), StoreError> {
        Ok(write_whole(&self.path(first_episode), &to_bytes(clips))?)
    }
}

/// The tensors of a file, with their types and shapes of one clip.
const TENSORS: [(&str, Dtype, &[usize]); 7] = [
    ("label", Dtype::U8, &[]),
    ("mixed", Dtype::U8, &[]),
    ("frame", Dtype::U32, &[N_CROPS]),
    ("distance_m", Dtype::F32, &[N_CROPS]),
    ("speed", Dtype::F32, &[N_CROPS]),
    ("rgb", Dtype::U8, &[N_CROPS, SIDE, SIDE, 3]),
    ("depth", Dtype::U8, &[N_CROPS, SIDE, SIDE]),
];

/// Clips as a safetensors file; crops that show nobody are black, at distance 0.
pub fn to_bytes(clips: &[Clip]) -> Vec<u8> {
    let of_crops = |of: &dyn Fn(&Crop) -> [u8; 4]| -> Vec<u8> {
        clips.iter().flat_map(|clip| clip.crops.iter().flat_map(of)).collect()
    };
    let images = |of: fn(&Crop) -> &Vec<u8>, n: usize| -> Vec<u8> {
        let mut bytes = Vec::with_capacity(clips.len() * N_CROPS * n);
        for crop in clips.iter().flat_map(|clip| &clip.crops) {
            let image = match crop.is_blank() {
                true => Cow::Owned(vec![0; n]),
                false => Cow::Borrowed(of(crop)),
            };
            bytes.extend_from_slice(&image);
        }
        bytes
    };
    let columns: [Vec<u8>; TENSORS.len()] = [
        clips.iter().map(|clip| clip.label.index() as u8).collect(),
        clips.iter().map(|clip| u8::from(clip.is_mixed)).collect(),
        of_crops(&|crop| crop.frame.to_le_bytes()),
        of_crops(&|crop| crop.distance_m.to_le_bytes()),
        of_crops(&|crop| crop.speed.to_le_bytes()),
        images(|crop| &crop.rgb, 3 * N_PIXELS),
        images(|crop| &crop.depth, N_PIXELS),
    ];
    let views = TENSORS.iter().zip(&columns).map(|((name, dtype, of_clip), bytes)| {
        let shape = std::iter::once(clips.len()).chain(of_clip.iter().copied()).collect();
        let view = TensorView::new(*dtype, shape, bytes);
        ((*name).to_owned(), view.expect("as many bytes as its shape says"))
    });
    serialize(views, None).expect("names and shapes are small")
}

/// The clips in such a file; or what is wrong with it.
fn from_bytes(bytes: &[u8]) -> Result<Vec<Clip>, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
    let n = file.tensor("label").map_err(|e| e.to_string())?.shape().first().copied();
    let n = n.unwrap_or(0);
    let mut columns: Vec<&[u8]> = Vec::new();
    for (name, dtype, of_clip) in TENSORS {
        let tensor = file.tensor(name).map_err(|e| e.to_string())?;
        let shape: Vec<usize> = std::iter::once(n).chain(of_clip.iter().copied()).collect();
        if tensor.dtype() != dtype || tensor.shape() != shape {
            return Err(format!("{name} is not {dtype:?} {shape:?}"));
        }
        columns.push(tensor.data());
    }
    let four = |column: usize, k: usize| -> [u8; 4] {
        std::array::from_fn(|byte| columns[column][4 * k + byte])
    };
    let crop = |k: usize| -> Result<Crop, String> {
        let [distance_m, speed] = [3, 4].map(|column| f32::from_le_bytes(four(column, k)));
        if !distance_m.is_finite() || !speed.is_finite() {
            return Err("a number is not finite".to_owned());
        }
        let frame: Frame = Frame::from_le_bytes(four(2, k));
        let image = |column: usize, n: usize| columns[column][k * n..][..n].to_vec();
        Ok(match distance_m == 0.0 {
            true => Crop::blank(frame),
            false => Crop {
                frame,
                distance_m,
                speed,
                rgb: image(5, 3 * N_PIXELS),
                depth: image(6, N_PIXELS),
            },
        })
    };
    let clip = |k: usize| {
        let label = Behavior::ALL.get(usize::from(columns[0][k])).ok_or("no such behavior")?;
        let crops: Result<Vec<Crop>, String> = (N_CROPS * k..N_CROPS * (k + 1)).map(crop).collect();
        Ok(Clip { label: *label, is_mixed: columns[1][k] != 0, crops: crops? })
    };
    (0..n).map(clip).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(label: Behavior, first: Frame) -> Clip {
        let shown = |frame| Crop {
            frame,
            distance_m: 2.5,
            speed: 0.01,
            rgb: (0..3 * N_PIXELS).map(|k| (k % 251) as u8).collect(),
            depth: vec![7; N_PIXELS],
        };
        let frames = (0..N_CROPS as Frame).map(|k| first + 3 * k);
        let crops = frames.map(|f| if f % 2 == 0 { shown(f) } else { Crop::blank(f) }).collect();
        Clip { label, is_mixed: label == Behavior::Moving, crops }
    }

    #[test]
    fn clips_are_read_as_they_were_written() {
        let dir = tempfile::tempdir().unwrap();
        let rules = CollectRules::default();
        let folder = ClipFolder::open(dir.path(), Part::Training, &rules).unwrap();
        let clips = vec![clip(Behavior::PutIn, 5), clip(Behavior::Moving, 90)];
        folder.write(16, &clips).unwrap();
        assert!(folder.read(16).unwrap() == Some(clips));
        assert!(folder.read(0).unwrap().is_none());
        folder.write(32, &[]).unwrap();
        assert!(folder.read(32).unwrap() == Some(Vec::new()));
    }

    #[test]
    fn other_rules_and_broken_files_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let rules = CollectRules::default();
        let folder = ClipFolder::open(dir.path(), Part::Training, &rules).unwrap();
        let other = CollectRules { seed: 2, ..rules };
        let refused = ClipFolder::open(dir.path(), Part::Training, &other).unwrap_err();
        assert!(refused.to_string().contains("by other rules"), "{refused}");
        assert!(ClipFolder::open(dir.path(), Part::Test, &rules).is_err());
        let bytes = to_bytes(&[clip(Behavior::PutOn, 0)]);
        for cut in [0, 7, 100, bytes.len() - 1] {
            fs::write(folder.path(0), &bytes[..cut]).unwrap();
            let error = folder.read(0).unwrap_err().to_string();
            assert!(error.contains("holds no clips"), "{error}");
        }
    }
}
