//! Folder of a run: paths of its files, and the lock of its writer.

use std::path::{Path, PathBuf};

use chaic_core::observation::SensorConfig;
use chaic_env::trace::{Trace, TraceWarning};
use chaic_env::{CHAIC_VERSION, Digest, EnvError, RunKey, slug};
use chaic_episodes::{Episode, MAX_EPISODE_BYTES, find_episode};
use chaic_files::{
    DirectoryEntry, EntryKind, FolderLock, LOCK, LockError, TEMPORARY_SUFFIX, create_folders,
    entries, is_file_below, kind, kind_below, open_or_create, read_below, read_bounded,
    remove_file, remove_folder, walk, write_atomically,
};
use serde::{Deserialize, Serialize};

use crate::error::{EvalError, Result};
use crate::run::granted::{RequestedImages, RunGrants};
use crate::run::helper_files::{HelperFiles, changed_file};
use crate::run::options::{FILES, RunOptions};
use crate::trace_file;

const FORMAT: &str = "chaic-run";
/// 2: with the digest of the options.
const VERSION: u32 = 2;
/// Maximum size of `run.json`, bytes: a thousand times the typical size.
const MAX_RUN_FILE_BYTES: u64 = 1 << 20;
/// A folder with this file is a run, so the file is written after all others that a run needs.
const RUN_FILE: &str = "run.json";
/// Folder with copies of episode files.
pub(super) const EPISODES: &str = "episodes";
/// Folder with records of helpers that query language models; `chaic-llm` writes it.
pub(super) const RECORDS: &str = "llm";
/// File with the commands of helpers in other processes; `chaic-subprocess` writes it.
pub(super) const COMMANDS: &str = "commands.json";
/// Folder of the traces.
const TRACES: &str = "traces";
/// Levels of folders below [`TRACES`]: one per task, one per helper.
const TRACE_DEPTH: u32 = 2;
/// File name of the journal.
const RESULTS: &str = "results.jsonl";
/// File names of a report.
const REPORT: [&str; 4] = ["scores.json", "report.md", "figure.svg", "figure.png"];
/// File with the partners of a folder that holds a run per partner.
pub(crate) const PARTNERS_FILE: &str = "partners.json";
/// Marker file of a merge in progress. It is removed after `run.json` is written.
const MERGING: &str = ".merging";
/// Files in [`RECORDS`] before the first query.
const STARTUP_RECORDS: [&str; 3] = ["settings.json", "settings.json.tmp", "templates"];

/// Access to a run's folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FolderMode {
    /// The folder must be new or empty.
    New,
    /// A run in the folder is resumed. Without a run, the folder must be new or empty.
    Resume,
    /// The folder must be new, empty, or left by an interrupted merge, whose files are removed.
    Merge,
}

/// The folder of a run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Lock of a folder that was opened for writing.
    _lock: Option<FolderLock>,
}

#[derive(Serialize, Deserialize)]
struct RunFile {
    format: String,
    version: u32,
    chaic: String,
    renderer: String,
    /// Digest of the options as compact JSON; it detects manual changes.
    digest: Digest,
    options: RunOptions,
    /// Absent in runs of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    granted: Option<RunGrants>,
    /// Absent in runs of older versions, and without helpers that have an isolation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    images: Option<RequestedImages>,
    /// Absent in runs of older versions, and without commands that name files.
    #[serde(default, skip_serializing_if = "HelperFiles::is_empty")]
    files: HelperFiles,
}

impl RunFile {
    /// Returns the text of the file.
    fn to_text(&self) -> String {
        serde_json::to_string_pretty(self).expect("options have string keys") + "\n"
    }
}

/// State of a folder before a run is opened in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FolderState {
    /// Empty, apart from an unused lock.
    Empty,
    /// Files of a run that was stopped before its `run.json` was written.
    Unstarted,
    /// Files of a merge that was interrupted before its `run.json` was written.
    InterruptedMerge,
    /// A run.
    Run,
    /// Any other content.
    Other,
}

impl FolderState {
    fn read(path: &Path) -> Result<FolderState> {
        if RunFolder::is_run(path) {
            return Ok(FolderState::Run);
        }
        let found = if path.exists() { entries(path)? } else { Vec::new() };
        let is_locked = found.iter().any(|p| name(p) == LOCK);
        let is_merge = found.iter().any(|p| name(p) == MERGING);
        let content: Vec<&PathBuf> =
            found.iter().filter(|p| ![LOCK, MERGING].contains(&name(p))).collect();
        Ok(match content[..] {
            _ if is_merge && content.iter().all(|p| is_merge_file(p)) => {
                FolderState::InterruptedMerge
            }
            [] => FolderState::Empty,
            _ if is_locked && content.iter().all(|p| is_startup_file(p)) => FolderState::Unstarted,
            _ => FolderState::Other,
        })
    }
}

/// Returns whether a run writes a file or folder of this name before its `run.json`.
fn is_startup_file(path: &Path) -> bool {
    let has_only = |folder: &Path, is_known: &dyn Fn(&str) -> bool| {
        kind(folder).is_ok_and(|kind| kind == EntryKind::Folder)
            && entries(folder).is_ok_and(|found| found.iter().all(|p| is_known(name(p))))
    };
    match name(path) {
        EPISODES => has_only(path, &|file| {
            file.strip_suffix(TEMPORARY_SUFFIX).unwrap_or(file).ends_with(".json")
        }),
        RECORDS => has_only(path, &|file| STARTUP_RECORDS.contains(&file)),
        COMMANDS => true,
        file => [RUN_FILE, COMMANDS].map(Some).contains(&file.strip_suffix(TEMPORARY_SUFFIX)),
    }
}

/// Returns whether a merge writes a file or folder of this name before its `run.json`.
fn is_merge_file(path: &Path) -> bool {
    let file = name(path).strip_suffix(TEMPORARY_SUFFIX).unwrap_or(name(path));
    [EPISODES, TRACES, COMMANDS, RESULTS, RUN_FILE].contains(&file) || REPORT.contains(&file)
}

/// Returns whether an entry of this name exists, even if it is a dangling link.
fn has_entry(path: &Path) -> bool {
    kind(path).is_ok_and(|kind| kind != EntryKind::Missing)
}

/// Returns the name of a file; empty if it is not UTF-8, as no file of a run is.
fn name(path: &Path) -> &str {
    path.file_name().and_then(|n| n.to_str()).unwrap_or_default()
}

/// Returns whether the folder holds a run per partner.
pub(crate) fn has_partners(path: &Path) -> bool {
    !RunFolder::is_run(path) && has_entry(&path.join(PARTNERS_FILE))
}

impl RunFolder {
    /// Returns whether the folder holds a run.
    pub fn is_run(path: &Path) -> bool {
        has_entry(&path.join(RUN_FILE))
    }

    /// Checks that the folder holds a run that can be resumed.
    ///
    /// # Errors
    /// [`EvalError::NotStarted`] for a run that was stopped before `run.json` was written,
    /// [`EvalError::InterruptedMerge`] for an interrupted merge, and [`EvalError::NotARun`] for any
    /// other folder without a run.
    pub fn check_started(path: &Path) -> Result<()> {
        match FolderState::read(path)? {
            FolderState::Run => Ok(()),
            FolderState::InterruptedMerge => {
                Err(EvalError::InterruptedMerge { path: path.to_owned() })
            }
            FolderState::Empty | FolderState::Unstarted if has_entry(&path.join(LOCK)) => {
                Err(EvalError::NotStarted { path: path.to_owned() })
            }
            _ => Err(EvalError::NotARun { path: path.to_owned() }),
        }
    }

    /// Locks a folder for writing and reads the recorded options. Removes the files of a run that
    /// was stopped before `run.json` was written.
    ///
    /// # Errors
    /// If the folder is in use, holds other content than `access` permits, or `run.json` was
    /// changed by hand or has another version.
    pub fn lock(path: &Path, access: FolderMode) -> Result<(RunFolder, Option<RunOptions>)> {
        if let Err(error) = check_access(path, access) {
            // A folder in use is reported as such, not as non-empty.
            if has_entry(&path.join(LOCK)) {
                take_lock(path)?;
            }
            return Err(error);
        }
        create_folders(path)?;
        let lock = take_lock(path)?;
        // Another process may have written between the first check and the lock.
        check_access(path, access)?;
        let folder = RunFolder { path: path.to_owned(), _lock: Some(lock) };
        let Some(file) = folder.recorded()? else {
            folder.clear_leftovers()?;
            return Ok((folder, None));
        };
        // Left by a merge that was killed after its last step. It has no effect if it can't be
        // removed.
        let _ = remove_file(&folder.join(MERGING));
        if file.chaic != CHAIC_VERSION {
            return Err(EvalError::Env(EnvError::OtherVersion {
                path: folder.join(RUN_FILE),
                found: format!("a run started by chaic {}", file.chaic),
                expected: format!("and resumes runs of chaic {CHAIC_VERSION}"),
            }));
        }
        Ok((folder, Some(file.options)))
    }

    /// Opens a run for reading.
    ///
    /// # Errors
    /// If the folder holds no run, or one of another version.
    pub fn read(path: &Path) -> Result<(RunFolder, RunOptions)> {
        let folder = RunFolder { path: path.to_owned(), _lock: None };
        let no_run = || match has_partners(path) {
            true => EvalError::SeveralPartners { path: path.to_owned() },
            false => EvalError::NotARun { path: path.to_owned() },
        };
        let file = folder.recorded()?.ok_or_else(no_run)?;
        Ok((folder, file.options))
    }

    /// Returns the recorded grants; `None` if an older version started the run.
    ///
    /// # Errors
    /// If `run.json` can't be read.
    pub fn granted(&self) -> Result<Option<RunGrants>> {
        Ok(self.recorded()?.and_then(|file| file.granted))
    }

    /// Checks that the helpers of a resumed run are granted what `run.json` records.
    pub(crate) fn check_grants(&self, granted: &RunGrants) -> Result<()> {
        let path = self.path.join("run.json");
        let Some(mut recorded) = self.granted()? else { return Ok(()) };
        if recorded.limits_s.is_empty() {
            // An earlier build started the run.
            recorded.limits_s.clone_from(&granted.limits_s);
        }
        if recorded == *granted {
            return Ok(());
        }
        for (name, isolation) in &recorded.isolation {
            let other = granted.isolation.get(name).filter(|other| *other != isolation);
            if let Some(other) = other {
                return Err(EvalError::Options(format!(
                    "{name} runs as `{other}` now, but {} has `{isolation}`; use the same system and \
                     options, or start a new run",
                    path.display()
                )));
            }
        }
        for (name, perception) in &recorded.perception {
            let other = granted.perception.get(name).filter(|other| *other != perception);
            if let Some(other) = other {
                return Err(EvalError::Options(format!(
                    "the perception of {name} is `{other}` now, but {} has `{perception}`; give the same \
                     files or start a new run",
                    path.display()
                )));
            }
        }
        if let Some(name) = recorded.weights.iter().find_map(|(name, digest)| {
            granted.weights.get(name).filter(|other| *other != digest).map(|_| name)
        }) {
            return Err(EvalError::Options(format!(
                "{} was started with other weights for `{name}`; give the same ones or start a new run",
                path.display()
            )));
        }
        for (name, limit_s) in &recorded.limits_s {
            let other = granted.limits_s.get(name).filter(|other| *other != limit_s);
            if let Some(other) = other {
                return Err(EvalError::Options(format!(
                    "limit_s of {name} is {other} now, but {} has {limit_s}; omit it, or start a new run",
                    path.display()
                )));
            }
        }
        Err(EvalError::Options(format!(
            "the grants of helpers or partner differ from {}; start a new run",
            path.display()
        )))
    }

    /// Returns the recorded images of helpers; see [`RunGrants::requested_images`].
    pub(crate) fn images(&self) -> Result<Option<RequestedImages>> {
        Ok(self.recorded()?.and_then(|file| file.images))
    }

    /// Checks that the helpers of a resumed run request the images that `run.json` records.
    pub(crate) fn check_images(&self, given: Option<&RequestedImages>) -> Result<()> {
        let (Some(recorded), Some(given)) = (self.images()?, given) else { return Ok(()) };
        let differs = |name: &&String| recorded.get(*name) != given.get(*name);
        let Some(name) = recorded.keys().chain(given.keys()).find(differs) else { return Ok(()) };
        Err(EvalError::Options(format!(
            "{name} requests {} now, but {} has {}; give the same helper or start a new run",
            described(given.get(name)),
            self.join(RUN_FILE).display(),
            described(recorded.get(name)),
        )))
    }

    /// Returns the recorded files of the commands of helpers.
    pub(crate) fn helper_files(&self) -> Result<HelperFiles> {
        Ok(self.recorded()?.map_or_else(HelperFiles::new, |file| file.files))
    }

    /// Checks that the commands of a resumed run name files with the content that `run.json` records.
    pub(crate) fn check_helper_files(&self, given: &HelperFiles) -> Result<()> {
        let recorded = self.helper_files()?;
        let Some((helper, file)) = changed_file(&recorded, given) else { return Ok(()) };
        Err(EvalError::Options(format!(
            "{} was started with another content of {file}, which {helper} runs or reads; restore the file, \
             or start a new run",
            self.path.display()
        )))
    }

    /// Returns the version of chaic that started the run if it is not this version.
    pub(crate) fn other_version(&self) -> Result<Option<String>> {
        Ok(self.recorded()?.map(|file| file.chaic).filter(|chaic| chaic != CHAIC_VERSION))
    }

    /// Returns the version of chaic in `run.json`.
    ///
    /// # Errors
    /// If `run.json` can't be read.
    pub fn version(&self) -> Result<Option<String>> {
        Ok(self.recorded()?.map(|file| file.chaic))
    }

    /// Returns whether `run.json` equals its own content written again, byte by byte. Additional or
    /// repeated fields make it differ.
    pub(crate) fn has_canonical_run_file(&self) -> Result<bool> {
        let bytes = read_bounded(&self.join(RUN_FILE), MAX_RUN_FILE_BYTES)?;
        Ok(self.recorded()?.is_some_and(|file| file.to_text().into_bytes() == bytes))
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of a file in the folder.
    pub fn join(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Returns the path of the journal.
    pub fn results(&self) -> PathBuf {
        self.path.join(RESULTS)
    }

    /// Returns the path of the trace of an episode run.
    pub fn trace(&self, key: &RunKey) -> PathBuf {
        let name = format!("{}-s{}.jsonl", slug(key.task, &key.episode), key.seed);
        self.path.join(TRACES).join(key.task.name()).join(&key.helper).join(name)
    }

    /// Returns whether an episode run has a trace: a regular file that is not reached through a
    /// link inside the run.
    pub fn has_trace(&self, key: &RunKey) -> bool {
        is_file_below(&self.path, &self.trace(key))
    }

    /// Returns the kind of directory entry at the path of a trace.
    pub(crate) fn kind_of_trace(&self, key: &RunKey) -> Result<EntryKind> {
        Ok(kind_below(&self.path, &self.trace(key))?)
    }

    /// Returns the paths of all complete traces, sorted. Leaves out links and files in linked
    /// folders.
    ///
    /// # Errors
    /// If a folder can't be read.
    pub fn traces(&self) -> Result<Vec<PathBuf>> {
        let is_trace = |e: &DirectoryEntry| {
            e.kind == EntryKind::File && e.path.extension().is_some_and(|e| e == "jsonl")
        };
        Ok(self.trace_entries()?.into_iter().filter(is_trace).map(|e| e.path).collect())
    }

    /// Lists all entries below the folder of the traces.
    pub(crate) fn trace_entries(&self) -> Result<Vec<DirectoryEntry>> {
        Ok(walk(&self.path.join(TRACES), TRACE_DEPTH)?)
    }

    /// Reads a trace of this run up to its last complete record. Warnings describe what is left out.
    ///
    /// # Errors
    /// If it is reached through a link or is no regular file; otherwise those of [`trace_file::read`].
    pub fn read_trace(&self, path: &Path) -> Result<(Trace, Vec<TraceWarning>)> {
        Ok(chaic_env::trace::parse(&trace_file::bytes(&self.path, path)?, path)?)
    }

    /// Returns the path of the folder with copies of episode files.
    pub(crate) fn episode_files(&self) -> PathBuf {
        self.path.join(EPISODES)
    }

    /// Returns the episode of a key. A run with the split `files` uses its own copies; any other
    /// run uses the bundled or generated episodes and ignores files in its folder.
    ///
    /// # Errors
    /// If there is no such episode, or its file is damaged.
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

    pub(crate) fn write_options(
        &self,
        options: &RunOptions,
        granted: &RunGrants,
        images: Option<RequestedImages>,
        files: HelperFiles,
    ) -> Result<()> {
        let file = RunFile {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            renderer: "cpu".to_owned(),
            digest: options.digest(),
            options: options.clone(),
            granted: Some(granted.clone()),
            images,
            files,
        };
        self.write(RUN_FILE, file.to_text().as_bytes())
    }

    /// Creates the marker file of a merge.
    pub(crate) fn start_merge(&self) -> Result<()> {
        let marker = self.join(MERGING);
        open_or_create(&marker)?;
        Ok(())
    }

    /// Removes the marker file of a merge.
    pub(crate) fn end_merge(&self) -> Result<()> {
        let marker = self.join(MERGING);
        Ok(remove_file(&marker)?)
    }

    /// Removes the files of [`FolderState::Unstarted`] or [`FolderState::InterruptedMerge`] except
    /// the lock and the marker. Without the marker, an interrupted removal could not be continued.
    fn clear_leftovers(&self) -> Result<()> {
        let leftovers = entries(&self.path)?;
        for path in leftovers.iter().filter(|p| ![LOCK, MERGING].contains(&name(p))) {
            match kind(path)? {
                EntryKind::Folder => remove_folder(path)?,
                _ => remove_file(path)?,
            }
        }
        Ok(())
    }

    /// Writes a file of the run atomically.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        Ok(write_atomically(&self.path.join(name), bytes)?)
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
        let unreadable = |e: serde_json::Error| EnvError::Unreadable {
            path: path.clone(),
            line: e.line(),
            problem: e.to_string(),
        };
        let v: Version = serde_json::from_slice(&text).map_err(unreadable)?;
        if v.format != FORMAT || v.version != VERSION {
            return Err(EvalError::Env(EnvError::OtherVersion {
                found: format!("{} version {} (written by chaic {})", v.format, v.version, v.chaic),
                expected: format!("{FORMAT} version {VERSION}"),
                path,
            }));
        }
        let file: RunFile = serde_json::from_slice(&text).map_err(unreadable)?;
        if file.options.digest() != file.digest {
            return Err(EvalError::Altered { path });
        }
        Ok(Some(file))
    }
}

/// Returns a description of requested images, such as `rgb, depth of 64 pixels`.
fn described(images: Option<&SensorConfig>) -> String {
    let Some(images) = images else { return "no images".to_owned() };
    let kinds = [("rgb", images.rgb), ("depth", images.depth), ("ids", images.ids)];
    let kinds = kinds.into_iter().filter(|(_, is_requested)| *is_requested);
    let kinds: Vec<&str> = kinds.map(|(kind, _)| kind).collect();
    format!("{} of {} pixels", kinds.join(", "), images.image_size)
}

/// Checks that the content of a folder permits this access.
fn check_access(path: &Path, access: FolderMode) -> Result<()> {
    match (FolderState::read(path)?, access) {
        (FolderState::Run | FolderState::Other, FolderMode::New | FolderMode::Merge) => {
            Err(EvalError::NotEmpty { path: path.to_owned() })
        }
        (FolderState::InterruptedMerge, FolderMode::New | FolderMode::Resume) => {
            Err(EvalError::InterruptedMerge { path: path.to_owned() })
        }
        (FolderState::Other, FolderMode::Resume) => {
            Err(EvalError::NotARun { path: path.to_owned() })
        }
        _ => Ok(()),
    }
}

fn take_lock(path: &Path) -> Result<FolderLock> {
    FolderLock::acquire(path).map_err(|error| match error {
        LockError::Held(path) => EvalError::Locked { path },
        LockError::File(error) => error.into(),
    })
}
