//! The folder of a run: where what lies, and who may write.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use chaic_env::{CHAIC_VERSION, Digest, EnvError, RunKey, slug};
use chaic_episodes::{Episode, find_episode};
use chaic_files::{UNFINISHED, entries, read_bounded, write_whole};
use serde::{Deserialize, Serialize};

use crate::error::{EvalError, Result};
use crate::run::granted::RunGrants;
use crate::run::options::RunOptions;

const FORMAT: &str = "chaic-run";
/// 2: with the digest of the options.
const VERSION: u32 = 2;
/// Longest `run.json` that is read, bytes: a thousand times a usual one.
const MAX_RUN_FILE_BYTES: u64 = 1 << 20;
/// Its presence makes a folder a run, so it is written after all that a run needs.
const RUN_FILE: &str = "run.json";
/// The first file that a run writes; whoever holds its lock may write the others.
const LOCK: &str = ".lock";
/// Copies of episode files.
pub(super) const EPISODES: &str = "episodes";
/// What helpers that ask language models record; `chaic-llm` writes it.
pub(super) const RECORDS: &str = "llm";
/// The commands of helpers that run in other processes; `chaic-subprocess` writes it.
pub(super) const COMMANDS: &str = "commands.json";
/// What lies there before the first question is asked.
const RECORDS_OF_BEGINNING: [&str; 3] = ["settings.json", "settings.json.tmp", "templates"];

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
    /// Of the options as compact JSON, so that a change by hand is found.
    digest: Digest,
    options: RunOptions,
    /// Absent in runs of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    granted: Option<RunGrants>,
}

/// What lies in a folder that is to become a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contents {
    /// Nothing, or a lock that nobody holds.
    Nothing,
    /// What a run leaves that is stopped before its `run.json` is written.
    Beginning,
    /// A run.
    Run,
    /// Something that no run has left.
    Other,
}

impl Contents {
    fn of(path: &Path) -> Result<Contents> {
        if path.join(RUN_FILE).exists() {
            return Ok(Contents::Run);
        }
        let found = if path.exists() { entries(path)? } else { Vec::new() };
        let is_locked = found.iter().any(|p| name(p) == LOCK);
        let rest: Vec<&PathBuf> = found.iter().filter(|p| name(p) != LOCK).collect();
        Ok(match rest[..] {
            [] => Contents::Nothing,
            _ if is_locked && rest.iter().all(|p| is_of_beginning(p)) => Contents::Beginning,
            _ => Contents::Other,
        })
    }
}

/// Whether a run writes this before its `run.json`.
fn is_of_beginning(path: &Path) -> bool {
    let all = |folder: &Path, is_known: &dyn Fn(&str) -> bool| {
        entries(folder).is_ok_and(|found| found.iter().all(|p| is_known(name(p))))
    };
    match name(path) {
        EPISODES => {
            all(path, &|file| file.strip_suffix(UNFINISHED).unwrap_or(file).ends_with(".json"))
        }
        RECORDS => all(path, &|file| RECORDS_OF_BEGINNING.contains(&file)),
        COMMANDS => true,
        file => [RUN_FILE, COMMANDS].map(Some).contains(&file.strip_suffix(UNFINISHED)),
    }
}

/// The name of a file; empty where it is no text, as no file of a run is named.
fn name(path: &Path) -> &str {
    path.file_name().and_then(|n| n.to_str()).unwrap_or_default()
}

impl RunFolder {
    /// Whether there is a run to go on with or to read.
    pub fn is_run(path: &Path) -> bool {
        path.join(RUN_FILE).exists()
    }

    /// Refuses a folder in which no run can be resumed.
    ///
    /// # Errors
    /// [`EvalError::NotBegun`] if a run was stopped there before it began, [`EvalError::NotARun`]
    /// for any other folder without a run.
    pub fn check_begun(path: &Path) -> Result<()> {
        match Contents::of(path)? {
            Contents::Run => Ok(()),
            Contents::Nothing | Contents::Beginning if path.join(LOCK).exists() => {
                Err(EvalError::NotBegun { path: path.to_owned() })
            }
            _ => Err(EvalError::NotARun { path: path.to_owned() }),
        }
    }

    /// Opens a folder for writing, and the options recorded there. What a run has left that was
    /// stopped before it began is removed.
    ///
    /// # Errors
    /// If it is in use, or holds a run and `access` is to begin, or holds anything else; if
    /// `run.json` was changed by hand or is of another version.
    pub fn lock(path: &Path, access: Access) -> Result<(RunFolder, Option<RunOptions>)> {
        if let Err(refusal) = check_access(path, access) {
            // Whoever is at work here says more than that something lies here.
            if path.join(LOCK).exists() {
                take_lock(path)?;
            }
            return Err(refusal);
        }
        fs::create_dir_all(path).map_err(EvalError::io("make the folder", path))?;
        let lock = take_lock(path)?;
        // Another process may have been at work between the first look and the lock.
        check_access(path, access)?;
        let folder = RunFolder { path: path.to_owned(), _lock: Some(lock) };
        let Some(file) = folder.recorded()? else {
            folder.clear_beginning()?;
            return Ok((folder, None));
        };
        if file.chaic != CHAIC_VERSION {
            return Err(EvalError::Env(EnvError::OtherVersion {
                path: folder.join(RUN_FILE),
                found: format!("a run begun by chaic {}", file.chaic),
                expected: format!("and resumes runs of chaic {CHAIC_VERSION}"),
            }));
        }
        Ok((folder, Some(file.options)))
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
        let path = self.path.join("run.json");
        let Some(then) = self.granted()?.filter(|then| then != now) else { return Ok(()) };
        for (name, confined) in &then.isolation {
            let other = now.isolation.get(name).filter(|other| *other != confined);
            if let Some(other) = other {
                return Err(EvalError::Options(format!(
                    "{name} runs as `{other}` now, but {} says `{confined}`; give --exec-trust as before, \
                     or begin a new run",
                    path.display()
                )));
            }
        }
        Err(EvalError::Options(format!(
            "helpers or partner are granted something else than {} says; begin a new run",
            path.display()
        )))
    }

    /// The version of chaic that began the run, if it is another one.
    pub(crate) fn other_version(&self) -> Result<Option<String>> {
        Ok(self.recorded()?.map(|file| file.chaic).filter(|chaic| chaic != CHAIC_VERSION))
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
            let bytes = crate::read_episode_file(&copy)?;
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
            digest: options.digest(),
            options: options.clone(),
            granted: Some(granted.clone()),
        };
        let text = serde_json::to_string_pretty(&file).expect("options have string keys") + "\n";
        self.write(RUN_FILE, text.as_bytes())
    }

    /// Removes what [`Contents::Beginning`] consists of, but the lock.
    fn clear_beginning(&self) -> Result<()> {
        let leftovers = entries(&self.path)?;
        for path in leftovers.iter().filter(|p| name(p) != LOCK) {
            let removed =
                if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            removed.map_err(EvalError::io("remove", path))?;
        }
        Ok(())
    }

    /// Writes a file of the run as a whole or not at all.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        Ok(write_whole(&self.path.join(name), bytes)?)
    }

    fn recorded(&self) -> Result<Option<RunFile>> {
        let path = self.path.join(RUN_FILE);
        if !path.exists() {
            return Ok(None);
        }
        let text = read_bounded(&path, MAX_RUN_FILE_BYTES)?;
        #[derive(Deserialize)]
        struct Version {
            format: String,
            version: u32,
            #[serde(default)]
            chaic: String,
        }
        let bad = |e: serde_json::Error| EnvError::Unreadable {
            path: path.clone(),
            line: e.line(),
            problem: e.to_string(),
        };
        let v: Version = serde_json::from_slice(&text).map_err(bad)?;
        if v.format != FORMAT || v.version != VERSION {
            return Err(EvalError::Env(EnvError::OtherVersion {
                found: format!("{} version {} (written by chaic {})", v.format, v.version, v.chaic),
                expected: format!("{FORMAT} version {VERSION}"),
                path,
            }));
        }
        let file: RunFile = serde_json::from_slice(&text).map_err(bad)?;
        if file.options.digest() != file.digest {
            return Err(EvalError::Altered { path });
        }
        Ok(Some(file))
    }
}

/// Whether a folder may be begun in or gone on with.
fn check_access(path: &Path, access: Access) -> Result<()> {
    match (Contents::of(path)?, access) {
        (Contents::Run | Contents::Other, Access::Begin) => {
            Err(EvalError::NotEmpty { path: path.to_owned() })
        }
        (Contents::Other, Access::Resume) => Err(EvalError::NotARun { path: path.to_owned() }),
        _ => Ok(()),
    }
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
