//! The folder of a run: where what lies, and who may write.

use std::fs::{self, File, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use chaic_episodes::{Episode, find_episode};
use serde::{Deserialize, Serialize};

use crate::CHAIC_VERSION;
use crate::error::{EvalError, Result};
use crate::metrics::RunKey;
use crate::run::granted::RunGrants;
use crate::run::items::{read_bounded, slug};
use crate::run::options::RunOptions;

const FORMAT: &str = "chaic-run";
const VERSION: u32 = 1;
const LOCK: &str = ".lock";
const EPISODES: &str = "episodes";

/// Whether a run is begun or gone on with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The folder must be new or empty.
    Begin,
    /// What is there is gone on with; nothing there is a beginning.
    Resume,
}

/// The folder of a run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Held as long as this exists, if the folder was opened for writing.
    _lock: Option<File>,
}

#[derive(Serialize, Deserialize)]
struct RunFile {
    format: String,
    version: u32,
    chaic: String,
    renderer: String,
    options: RunOptions,
    /// Absent in runs of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    granted: Option<RunGrants>,
}

impl RunFolder {
    /// Opens a folder for writing, and the options recorded there.
    ///
    /// # Errors
    /// If it is in use, or not empty and `access` is to begin, or no run and not empty.
    pub fn lock(path: &Path, access: Access) -> Result<(RunFolder, Option<RunOptions>)> {
        if access == Access::Begin && !is_empty(path)? {
            // Whoever is at work here says more than that something lies here.
            if path.join(LOCK).exists() {
                take_lock(path)?;
            }
            return Err(EvalError::NotEmpty { path: path.to_owned() });
        }
        if access == Access::Resume && !path.join("run.json").exists() && !nothing_yet(path)? {
            return Err(EvalError::NotARun { path: path.to_owned() });
        }
        fs::create_dir_all(path).map_err(EvalError::io("make the folder", path))?;
        let lock = take_lock(path)?;
        let folder = RunFolder { path: path.to_owned(), _lock: Some(lock) };
        let recorded = folder.recorded()?;
        match (&recorded, access) {
            // Another process began a run between the first look and the lock.
            (Some(_), Access::Begin) => Err(EvalError::NotEmpty { path: path.to_owned() }),
            (Some(file), Access::Resume) if file.chaic != CHAIC_VERSION => {
                Err(EvalError::OtherVersion {
                    path: folder.path.join("run.json"),
                    found: format!("a run begun by chaic {}", file.chaic),
                    expected: format!("and resumes runs of chaic {CHAIC_VERSION}"),
                })
            }
            _ => Ok((folder, recorded.map(|f| f.options))),
        }
    }

    /// Opens a run for reading.
    ///
    /// # Errors
    /// If it is none, or of another version.
    pub fn read(path: &Path) -> Result<(RunFolder, RunOptions)> {
        let folder = RunFolder { path: path.to_owned(), _lock: None };
        let file =
            folder.recorded()?.ok_or_else(|| EvalError::NotARun { path: path.to_owned() })?;
        Ok((folder, file.options))
    }

    /// What everybody of the run is granted; `None` if an older version began it.
    ///
    /// # Errors
    /// If `run.json` can't be read.
    pub fn granted(&self) -> Result<Option<RunGrants>> {
        Ok(self.recorded()?.and_then(|file| file.granted))
    }

    /// Refuses to go on with a run whose helpers would be granted something else from now on.
    pub(crate) fn check_grants(&self, now: &RunGrants) -> Result<()> {
        if self.granted()?.is_none_or(|then| then == *now) {
            return Ok(());
        }
        let path = self.path.join("run.json");
        Err(EvalError::Options(format!(
            "helpers or partner are granted something else than {} says; begin a new run",
            path.display()
        )))
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in it.
    pub fn join(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Its journal.
    pub fn results(&self) -> PathBuf {
        self.path.join("results.jsonl")
    }

    /// The trace of an episode run.
    pub fn trace(&self, key: &RunKey) -> PathBuf {
        let name = format!("{}-s{}.jsonl", slug(key.task, &key.episode), key.seed);
        self.path.join("traces").join(key.task.name()).join(&key.helper).join(name)
    }

    /// Every whole trace, in the order of their paths.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn traces(&self) -> Result<Vec<PathBuf>> {
        let mut found = Vec::new();
        let root = self.path.join("traces");
        if root.exists() {
            walk(&root, 3, &mut found)?;
        }
        found.retain(|p| p.extension().is_some_and(|e| e == "jsonl"));
        found.sort();
        Ok(found)
    }

    /// The folder with copies of episode files.
    pub(crate) fn episode_files(&self) -> PathBuf {
        self.path.join(EPISODES)
    }

    /// The episode of this id: the run's own copy, or one of those that every chaic has.
    ///
    /// # Errors
    /// If there is none, or its file is damaged.
    pub fn episode(&self, key: &RunKey) -> Result<Episode> {
        let copy = self.episode_copy(key.task, &key.episode);
        if copy.exists() {
            let bytes = read_bounded(&copy)?;
            return Ok(Episode::parse(&bytes, &copy.display().to_string())?);
        }
        Ok(find_episode(&key.episode)?)
    }

    pub(crate) fn episode_copy(&self, task: chaic_protocol::TaskId, id: &str) -> PathBuf {
        self.episode_files().join(format!("{task}-{}.json", slug(task, id)))
    }

    pub(crate) fn write_options(&self, options: &RunOptions, granted: &RunGrants) -> Result<()> {
        let file = RunFile {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            renderer: "cpu".to_owned(),
            options: options.clone(),
            granted: Some(granted.clone()),
        };
        let text = serde_json::to_string_pretty(&file).expect("options have string keys") + "\n";
        self.write("run.json", text.as_bytes())
    }

    /// Writes a file of the run as a whole or not at all.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        write_whole(&self.path.join(name), bytes)
    }

    fn recorded(&self) -> Result<Option<RunFile>> {
        let path = self.path.join("run.json");
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(EvalError::io("read", &path))?;
        #[derive(Deserialize)]
        struct Version {
            format: String,
            version: u32,
            #[serde(default)]
            chaic: String,
        }
        let bad = |e: serde_json::Error| EvalError::Unreadable {
            path: path.clone(),
            line: e.line(),
            problem: e.to_string(),
        };
        let v: Version = serde_json::from_str(&text).map_err(bad)?;
        if v.format != FORMAT || v.version != VERSION {
            return Err(EvalError::OtherVersion {
                found: format!("{} version {} (written by chaic {})", v.format, v.version, v.chaic),
                expected: format!("{FORMAT} version {VERSION}"),
                path,
            });
        }
        serde_json::from_str(&text).map(Some).map_err(bad)
    }
}

/// Writes a file as a whole or not at all: to a name beside it, which then becomes its own.
///
/// # Errors
/// If the file system refuses.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".tmp");
    let beside = path.with_file_name(name);
    let write = || -> std::io::Result<()> {
        let mut file = File::create(&beside)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&beside, path)
    };
    write().map_err(EvalError::io("write", path))
}

fn take_lock(path: &Path) -> Result<File> {
    let name = path.join(LOCK);
    let refused = || EvalError::io("lock", &name);
    let file = File::options().create(true).truncate(false).write(true).open(&name);
    let file = file.map_err(refused())?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(EvalError::Locked { path: path.to_owned() }),
        Err(TryLockError::Error(e)) => Err(refused()(e)),
    }
}

fn entries(path: &Path) -> Result<Vec<PathBuf>> {
    let list = fs::read_dir(path).and_then(|d| d.map(|e| e.map(|e| e.path())).collect());
    list.map_err(EvalError::io("list", path))
}

/// A lock alone, of which nobody holds the key any more, is nothing.
fn is_empty(path: &Path) -> Result<bool> {
    Ok(!path.exists() || entries(path)?.iter().all(|p| p.file_name().is_some_and(|n| n == LOCK)))
}

/// Whether a folder holds at most what a run that was killed in its first moment leaves.
fn nothing_yet(path: &Path) -> Result<bool> {
    if !path.exists() {
        return Ok(true);
    }
    let known = [LOCK, EPISODES, "run.json.tmp"];
    let is_known = |p: &PathBuf| p.file_name().is_some_and(|n| known.iter().any(|k| n == *k));
    Ok(entries(path)?.iter().all(is_known))
}

fn walk(folder: &Path, depth: u32, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in entries(folder)? {
        if entry.is_dir() && depth > 0 {
            walk(&entry, depth - 1, found)?;
        } else if entry.is_file() {
            found.push(entry);
        }
    }
    Ok(())
}
