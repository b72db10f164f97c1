//! The folder of a run: where what lies, and who may write.

use std::fs;
use std::path::{Path, PathBuf};

use chaic_env::trace::{Trace, Warning};
use chaic_env::{CHAIC_VERSION, Digest, EnvError, RunKey, slug};
use chaic_episodes::{Episode, MAX_EPISODE_BYTES, find_episode};
use chaic_files::{
    Entry, EntryKind, FolderLock, LOCK, LockError, UNFINISHED, entries, is_file_below, kind,
    kind_below, open_or_create, read_below, read_bounded, walk, write_whole,
};
use serde::{Deserialize, Serialize};

use crate::error::{EvalError, Result};
use crate::run::granted::RunGrants;
use crate::run::options::{FILES, RunOptions};
use crate::trace_file;

const FORMAT: &str = "chaic-run";
/// 2: with the digest of the options.
const VERSION: u32 = 2;
/// Longest `run.json` that is read, bytes: a thousand times a usual one.
const MAX_RUN_FILE_BYTES: u64 = 1 << 20;
/// Its presence makes a folder a run, so it is written after all that a run needs.
const RUN_FILE: &str = "run.json";
/// Copies of episode files.
pub(super) const EPISODES: &str = "episodes";
/// What helpers that ask language models record; `chaic-llm` writes it.
pub(super) const RECORDS: &str = "llm";
/// The commands of helpers that run in other processes; `chaic-subprocess` writes it.
pub(super) const COMMANDS: &str = "commands.json";
/// Digests of trained policies that play as helpers; `chaic-learn` writes it.
pub(super) const POLICIES: &str = "policies.json";
/// Folder of the traces.
const TRACES: &str = "traces";
/// Levels of folders below [`TRACES`]: one per task, one per helper.
const TRACE_DEPTH: u32 = 2;
/// File name of the journal.
const RESULTS: &str = "results.jsonl";
/// File names of a report.
const REPORT: [&str; 4] = ["scores.json", "report.md", "figure.svg", "figure.png"];
/// Marker file of a merge in progress. It is removed after `run.json` is written.
const MERGING: &str = ".merging";
/// What lies there before the first question is asked.
const RECORDS_OF_BEGINNING: [&str; 3] = ["settings.json", "settings.json.tmp", "templates"];

/// Whether a run is begun or gone on with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The folder must be new or empty.
    Begin,
    /// What is there is gone on with; nothing there is a beginning.
    Resume,
    /// The folder must be new, empty, or left by an interrupted merge, whose files are removed.
    Merge,
}

/// The folder of a run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Held as long as this exists, if the folder was opened for writing.
    _lock: Option<FolderLock>,
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

impl RunFile {
    /// Returns the text of the file.
    fn to_text(&self) -> String {
        serde_json::to_string_pretty(self).expect("options have string keys") + "\n"
    }
}

/// What lies in a folder that is to become a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contents {
    /// Nothing, or a lock that nobody holds.
    Nothing,
    /// What a run leaves that is stopped before its `run.json` is written.
    Beginning,
    /// Files of a merge that was interrupted before its `run.json` was written.
    StoppedMerge,
    /// A run.
    Run,
    /// Something that no run has left.
    Other,
}

impl Contents {
    fn of(path: &Path) -> Result<Contents> {
        if RunFolder::is_run(path) {
            return Ok(Contents::Run);
        }
        let found = if path.exists() { entries(path)? } else { Vec::new() };
        let is_locked = found.iter().any(|p| name(p) == LOCK);
        let is_merge = found.iter().any(|p| name(p) == MERGING);
        let rest: Vec<&PathBuf> =
            found.iter().filter(|p| ![LOCK, MERGING].contains(&name(p))).collect();
        Ok(match rest[..] {
            _ if is_merge && rest.iter().all(|p| is_of_merge(p)) => Contents::StoppedMerge,
            [] => Contents::Nothing,
            _ if is_locked && rest.iter().all(|p| is_of_beginning(p)) => Contents::Beginning,
            _ => Contents::Other,
        })
    }
}

/// Whether a run writes this before its `run.json`.
fn is_of_beginning(path: &Path) -> bool {
    let all = |folder: &Path, is_known: &dyn Fn(&str) -> bool| {
        kind(folder).is_ok_and(|kind| kind == EntryKind::Folder)
            && entries(folder).is_ok_and(|found| found.iter().all(|p| is_known(name(p))))
    };
    match name(path) {
        EPISODES => {
            all(path, &|file| file.strip_suffix(UNFINISHED).unwrap_or(file).ends_with(".json"))
        }
        RECORDS => all(path, &|file| RECORDS_OF_BEGINNING.contains(&file)),
        COMMANDS | POLICIES => true,
        file => [RUN_FILE, COMMANDS, POLICIES].map(Some).contains(&file.strip_suffix(UNFINISHED)),
    }
}

/// Returns whether a merge writes a file or folder of this name before its `run.json`.
fn is_of_merge(path: &Path) -> bool {
    let whole = name(path).strip_suffix(UNFINISHED).unwrap_or(name(path));
    [EPISODES, TRACES, COMMANDS, POLICIES, RESULTS, RUN_FILE].contains(&whole)
        || REPORT.contains(&whole)
}

/// Returns whether an entry of this name exists, even if it is a dangling link.
fn has_entry(path: &Path) -> bool {
    kind(path).is_ok_and(|kind| kind != EntryKind::Missing)
}

/// The name of a file; empty where it is no text, as no file of a run is named.
fn name(path: &Path) -> &str {
    path.file_name().and_then(|n| n.to_str()).unwrap_or_default()
}

impl RunFolder {
    /// Whether there is a run to go on with or to read.
    pub fn is_run(path: &Path) -> bool {
        has_entry(&path.join(RUN_FILE))
    }

    /// Refuses a folder in which no run can be resumed.
    ///
    /// # Errors
    /// [`EvalError::NotBegun`] if a run was stopped there before it began,
    /// [`EvalError::StoppedMerge`] if a merge was, [`EvalError::NotARun`] for any other folder
    /// without a run.
    pub fn check_begun(path: &Path) -> Result<()> {
        match Contents::of(path)? {
            Contents::Run => Ok(()),
            Contents::StoppedMerge => Err(EvalError::StoppedMerge { path: path.to_owned() }),
            Contents::Nothing | Contents::Beginning if has_entry(&path.join(LOCK)) => {
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
            if has_entry(&path.join(LOCK)) {
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
        // Left by a merge that was killed after its last step; without effect if it can not be removed.
        let _ = fs::remove_file(folder.join(MERGING));
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

    /// Returns the version of chaic in `run.json`.
    ///
    /// # Errors
    /// If `run.json` can't be read.
    pub(crate) fn version(&self) -> Result<Option<String>> {
        Ok(self.recorded()?.map(|file| file.chaic))
    }

    /// Returns whether `run.json` equals its own content written again, byte by byte. Additional or repeated
    /// fields make it differ.
    pub(crate) fn has_canonical_run_file(&self) -> Result<bool> {
        let bytes = read_bounded(&self.join(RUN_FILE), MAX_RUN_FILE_BYTES)?;
        Ok(self.recorded()?.is_some_and(|file| file.to_text().into_bytes() == bytes))
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
        self.path.join(RESULTS)
    }

    /// The trace of an episode run.
    pub fn trace(&self, key: &RunKey) -> PathBuf {
        let name = format!("{}-s{}.jsonl", slug(key.task, &key.episode), key.seed);
        self.path.join(TRACES).join(key.task.name()).join(&key.helper).join(name)
    }

    /// Returns whether an episode run has a trace: a regular file, reached without a link inside the run.
    pub fn has_trace(&self, key: &RunKey) -> bool {
        is_file_below(&self.path, &self.trace(key))
    }

    /// Returns the kind of directory entry at the path of a trace.
    pub(crate) fn kind_of_trace(&self, key: &RunKey) -> Result<EntryKind> {
        Ok(kind_below(&self.path, &self.trace(key))?)
    }

    /// Returns the paths of all complete traces, sorted. Links and files in linked folders are left out.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn traces(&self) -> Result<Vec<PathBuf>> {
        let is_trace = |e: &Entry| {
            e.kind == EntryKind::File && e.path.extension().is_some_and(|e| e == "jsonl")
        };
        Ok(self.trace_entries()?.into_iter().filter(is_trace).map(|e| e.path).collect())
    }

    /// Lists all entries below the folder of the traces.
    pub(crate) fn trace_entries(&self) -> Result<Vec<Entry>> {
        Ok(walk(&self.path.join(TRACES), TRACE_DEPTH)?)
    }

    /// Reads a trace of this run up to its last complete record. Warnings describe what is left out.
    ///
    /// # Errors
    /// If it is reached through a link or is no regular file; otherwise those of [`trace_file::read`].
    pub fn read_trace(&self, path: &Path) -> Result<(Trace, Vec<Warning>)> {
        Ok(chaic_env::trace::parse(&trace_file::bytes(&self.path, path)?, path)?)
    }

    /// The folder with copies of episode files.
    pub(crate) fn episode_files(&self) -> PathBuf {
        self.path.join(EPISODES)
    }

    /// Returns the episode of this id. A run with the split `files` uses its own copies; any other run uses
    /// the bundled or generated episodes and ignores files in its folder.
    ///
    /// # Errors
    /// If there is none, or its file is damaged.
    pub fn episode(&self, options: &RunOptions, key: &RunKey) -> Result<Episode> {
        if options.split != FILES {
            return Ok(find_episode(&key.episode)?);
        }
        self.read_copy(&self.episode_copy(key.task, &key.episode))
    }

    /// Reads one of the run's copies of episodes.
    pub(crate) fn read_copy(&self, copy: &Path) -> Result<Episode> {
        let bytes = self.copy_bytes(copy)?;
        Ok(Episode::parse(&bytes, &copy.display().to_string())?)
    }

    /// Returns the bytes of one of the run's copies of episodes.
    pub(crate) fn copy_bytes(&self, copy: &Path) -> Result<Vec<u8>> {
        // One byte more than the limit, so that the parser reports a longer file.
        Ok(read_below(&self.path, copy, MAX_EPISODE_BYTES as u64 + 1)?)
    }

    pub(crate) fn episode_copy(&self, task: chaic_core::TaskId, id: &str) -> PathBuf {
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
        self.write(RUN_FILE, file.to_text().as_bytes())
    }

    /// Creates the marker file of a merge.
    pub(crate) fn begin_merge(&self) -> Result<()> {
        let marker = self.join(MERGING);
        open_or_create(&marker)?;
        Ok(())
    }

    /// Removes the marker file of a merge.
    pub(crate) fn end_merge(&self) -> Result<()> {
        let marker = self.join(MERGING);
        fs::remove_file(&marker).map_err(EvalError::io("remove", &marker))
    }

    /// Removes the files of [`Contents::Beginning`] or [`Contents::StoppedMerge`] except the lock and the
    /// marker: without the marker, a clearing that is interrupted could not be continued.
    fn clear_beginning(&self) -> Result<()> {
        let leftovers = entries(&self.path)?;
        for path in leftovers.iter().filter(|p| ![LOCK, MERGING].contains(&name(p))) {
            let removed = match kind(path)? {
                EntryKind::Folder => fs::remove_dir_all(path),
                _ => fs::remove_file(path),
            };
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
        if kind(&path)? == EntryKind::Missing {
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
        (Contents::Run | Contents::Other, Access::Begin | Access::Merge) => {
            Err(EvalError::NotEmpty { path: path.to_owned() })
        }
        (Contents::StoppedMerge, Access::Begin | Access::Resume) => {
            Err(EvalError::StoppedMerge { path: path.to_owned() })
        }
        (Contents::Other, Access::Resume) => Err(EvalError::NotARun { path: path.to_owned() }),
        _ => Ok(()),
    }
}

fn take_lock(path: &Path) -> Result<FolderLock> {
    FolderLock::take(path).map_err(|error| match error {
        LockError::Held(path) => EvalError::Locked { path },
        LockError::File(refused) => refused.into(),
    })
}
