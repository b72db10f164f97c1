//! Shards: parts of one run that several machines play in folders of their own, to be merged
//! afterwards.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use chaic_env::trace::MAX_TRACE_BYTES;
use chaic_env::{CHAIC_VERSION, EnvError, RunKey};
use chaic_files::{
    EntryKind, FileError, create_folders_below, entries, kind, read_below, write_atomically,
};
use serde_json::Value;

use super::folder::{COMMANDS, EPISODES, RECORDS};
use super::helper_files::{HelperFiles, common_files};
use super::journal::{Journal, read_results, to_line};
use super::options::{FILES, RunOptions};
use super::plan;
use super::{EpisodeJob, FolderMode, Run, RunFolder};
use crate::error::{EvalError, Result};
use crate::metrics::{FormulaSet, RunResult};
use crate::report::{Report, write_files};

/// Maximum size of the commands of a run, bytes, as in `chaic-subprocess`.
const MAX_COMMANDS_BYTES: u64 = 1 << 20;

/// Part of a plan: every `count`-th episode from episode `number` on, with all helpers. Each seed
/// counts as an episode. The folder of a shard does not record the shard; it holds an unfinished run
/// that can be resumed as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    count: u32,
}

impl Shard {
    /// The whole run.
    pub const WHOLE: Shard = Shard { number: 1, count: 1 };

    /// Returns shard `number` of `count`, counted from 1; `None` if it is out of range.
    pub fn new(number: u32, count: u32) -> Option<Shard> {
        (1..=count).contains(&number).then_some(Shard { number, count })
    }

    /// Returns whether the shard contains the episode run with this index in the plan of a run with
    /// `n_helpers` helpers.
    pub fn contains(self, index: usize, n_helpers: usize) -> bool {
        // A plan lists the helpers of an episode one after the other.
        let episode = index / n_helpers.max(1);
        episode % self.count as usize == (self.number - 1) as usize
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Shard, String> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let shard = numbers.and_then(|(number, count)| Shard::new(number, count));
        shard.ok_or_else(|| format!("no shard `{text}`; write I/N with 1 <= I <= N, like 2/4"))
    }
}

/// Merges shards or other parts of one run in a new folder, and writes the report. The files equal
/// those of a run played on one machine, except that the lines of the journal are in the order of
/// the plan.
///
/// `run.json` is written last. After an interruption, the folder is either a complete run, or the
/// same merge can be repeated.
///
/// # Errors
/// If the parts differ in the run, episode files, commands of helpers, files that these name, or
/// results of an episode run. Also if a helper queries a language model, a finished episode run has no
/// trace, or a file cannot be read or written.
pub fn merge(out: &Path, parts: &[PathBuf]) -> Result<Run> {
    let Some(first) = parts.first() else {
        return Err(EvalError::Options("name the runs to merge".to_owned()));
    };
    let (source, options) = RunFolder::read(first)?;
    let folders = read_parts(parts, &source, &options)?;
    let granted = source.granted()?.ok_or_else(|| {
        EvalError::Options(format!("{} was started by an older version of chaic", first.display()))
    })?;
    let images = source.images()?;
    let files = files_of_parts(&folders, &source)?;
    let planned = plan::planned(&source, &options)?;
    let from_parts = results(&folders, &planned)?;
    let is_traced = |result: &RunResult| options.traces && result.summary().is_some();
    for (result, part) in from_parts.iter().filter(|(result, _)| is_traced(result)) {
        check_trace(part, &result.key)?;
    }

    let (folder, _) = RunFolder::lock(out, FolderMode::Merge)?;
    folder.start_merge()?;
    copy_episodes(&source, &folder)?;
    if kind(&source.join(COMMANDS))? != EntryKind::Missing {
        copy(&source, &source.join(COMMANDS), &folder, &folder.join(COMMANDS))?;
    }
    for (result, part) in from_parts.iter().filter(|(result, _)| is_traced(result)) {
        copy(part, &part.trace(&result.key), &folder, &folder.trace(&result.key))?;
    }
    let results: Vec<RunResult> = from_parts.into_iter().map(|(result, _)| result).collect();
    let lines: String = results.iter().map(|result| to_line(result) + "\n").collect();
    folder.write("results.jsonl", lines.as_bytes())?;
    if !results.is_empty() {
        let (granted, formulas) = (Some(&granted), FormulaSet::Paper);
        let (version, options) = (CHAIC_VERSION, &options);
        let (results, planned) = (&results, &planned);
        let report = Report { version, options, results, planned, granted, formulas };
        write_files(&folder, &report)?;
    }
    folder.write_options(&options, &granted, images, files)?;
    folder.end_merge()?;
    let (journal, results, _) = Journal::open(&folder.results(), &planned)?;
    Ok(Run { folder, options, granted, journal, planned, results, untraced: Vec::new() })
}

/// Opens the parts of one run, of which `source` is the first.
///
/// # Errors
/// If a part is of another run, or can't be merged.
fn read_parts(
    parts: &[PathBuf],
    source: &RunFolder,
    options: &RunOptions,
) -> Result<Vec<RunFolder>> {
    let (granted, images) = (source.granted()?, source.images()?);
    let source_commands = commands(source)?;
    let first = source.path().display();
    let refused = |problem: String| Err(EvalError::Options(problem));
    let mut folders = Vec::with_capacity(parts.len());
    for path in parts {
        let (folder, part_options) = RunFolder::read(path)?;
        let part = path.display();
        if part_options != *options
            || folder.granted()? != granted
            || folder.images()? != images
            || folder.other_version()?.is_some()
        {
            return refused(format!(
                "{first} and {part} are parts of different runs, or of another version of chaic; \
                 play all shards with the same options"
            ));
        }
        if options.split == FILES && !plan::same_copies(source, &folder)? {
            return refused(format!(
                "{first} and {part} have other episode files; play all shards with the same \
                 --episodes"
            ));
        }
        if commands(&folder)? != source_commands {
            return refused(format!(
                "{first} and {part} were played with other commands or limits; play all shards with the \
                 same --helper and --exec options"
            ));
        }
        if kind(&folder.join(RECORDS))? != EntryKind::Missing {
            return refused(format!(
                "{part} has helpers that query language models, whose records can't be merged; \
                 play such a run in one folder"
            ));
        }
        folders.push(folder);
    }
    Ok(folders)
}

/// Returns the files of the commands of helpers that all parts record.
///
/// # Errors
/// If a part was played with another content of one of them.
fn files_of_parts(parts: &[RunFolder], first: &RunFolder) -> Result<HelperFiles> {
    let mut files = first.helper_files()?;
    for part in parts {
        files = common_files(files, &part.helper_files()?).ok_or_else(|| {
            EvalError::Options(format!(
                "{} and {} were played with different files of the commands of helpers; play all shards with \
                 the same ones",
                first.path().display(),
                part.path().display()
            ))
        })?;
    }
    Ok(files)
}

/// Returns the recorded commands of a run's helper processes, sorted; empty without any. The file
/// has the order of the last `--helper` options, which may change when a run is resumed.
fn commands(folder: &RunFolder) -> Result<Vec<String>> {
    let path = folder.join(COMMANDS);
    if kind(&path)? == EntryKind::Missing {
        return Ok(Vec::new());
    }
    let bytes = read_below(folder.path(), &path, MAX_COMMANDS_BYTES)?;
    let recorded: Vec<Value> = serde_json::from_slice(&bytes)
        .map_err(|e| EnvError::Unreadable { path, line: e.line(), problem: e.to_string() })?;
    let mut commands: Vec<String> = recorded.iter().map(Value::to_string).collect();
    commands.sort();
    Ok(commands)
}

/// Opens the run of an earlier [`merge`] of the same parts.
///
/// # Errors
/// [`EvalError::NotEmpty`] if the folder has another run, or other results than the parts; if files
/// can't be read.
pub(crate) fn reopen_merged(out: &Path, parts: &[PathBuf]) -> Result<Run> {
    let other_run = || EvalError::NotEmpty { path: out.to_owned() };
    let (folder, recorded) = RunFolder::lock(out, FolderMode::Resume)?;
    let (options, granted) = recorded.zip(folder.granted()?).ok_or_else(other_run)?;
    let (merged_commands, images) = (commands(&folder)?, folder.images()?);
    let files = folder.helper_files()?;
    let mut folders = Vec::with_capacity(parts.len());
    for part in parts {
        let (part, part_options) = RunFolder::read(part)?;
        let is_same = part_options == options
            && part.granted()?.as_ref() == Some(&granted)
            && part.images()? == images
            && common_files(part.helper_files()?, &files).is_some()
            && commands(&part)? == merged_commands;
        if !is_same || (options.split == FILES && !plan::same_copies(&part, &folder)?) {
            return Err(other_run());
        }
        folders.push(part);
    }
    let planned = plan::planned(&folder, &options)?;
    let mut from_parts = results(&folders, &planned)?;
    // A journal is read in the order of the keys.
    from_parts.sort_by(|(a, _), (b, _)| a.key.cmp(&b.key));
    let (journal, results, _) = Journal::open(&folder.results(), &planned)?;
    if !from_parts.iter().map(|(result, _)| result).eq(&results) {
        return Err(other_run());
    }
    Ok(Run { folder, options, granted, journal, planned, results, untraced: Vec::new() })
}

/// Fails if a part has no trace of a finished episode run.
fn check_trace(part: &RunFolder, key: &RunKey) -> Result<()> {
    if part.has_trace(key) {
        return Ok(());
    }
    Err(EvalError::Untraced { path: part.path().to_owned(), key: key.clone() })
}

/// Returns the results of all parts in the order of the plan, each with its part. A completed
/// result replaces a failed one. Of equal results, one with a trace is kept.
fn results<'p>(
    parts: &'p [RunFolder],
    planned: &[EpisodeJob],
) -> Result<Vec<(RunResult, &'p RunFolder)>> {
    let mut found: BTreeMap<RunKey, (RunResult, &RunFolder)> = BTreeMap::new();
    for part in parts {
        for result in read_results(&part.results(), planned)?.0 {
            match found.get(&result.key) {
                Some((other, _)) if other.summary().is_some() && result.summary().is_none() => {}
                Some((other, other_part)) if other.summary().is_some() && *other != result => {
                    return Err(EvalError::Options(format!(
                        "{} with {} and seed {} has different results in {} and {}",
                        result.key.episode,
                        result.key.helper,
                        result.key.seed,
                        part.path().display(),
                        other_part.path().display(),
                    )));
                }
                Some((other, other_part))
                    if *other == result && other_part.has_trace(&result.key) => {}
                _ => {
                    found.insert(result.key.clone(), (result, part));
                }
            }
        }
    }
    Ok(planned.iter().filter_map(|job| found.remove(&job.key)).collect())
}

/// Copies the episode files of a run.
fn copy_episodes(source: &RunFolder, folder: &RunFolder) -> Result<()> {
    let copies = source.join(EPISODES);
    if kind(&copies)? == EntryKind::Missing {
        return Ok(());
    }
    for file in entries(&copies)? {
        let name = file.file_name().unwrap_or_default();
        copy(source, &file, folder, &folder.join(EPISODES).join(name))?;
    }
    Ok(())
}

/// Copies a regular file from one run to another. The copy is on disk before `run.json`, which makes
/// the folder a run.
fn copy(source: &RunFolder, from: &Path, folder: &RunFolder, to: &Path) -> Result<()> {
    // Traces have the highest size limit of all files of a run.
    let bytes = read_below(source.path(), from, MAX_TRACE_BYTES + 1)?;
    if bytes.len() as u64 > MAX_TRACE_BYTES {
        let problem =
            format!("it is longer than {MAX_TRACE_BYTES} bytes, the limit of a file of a run");
        return Err(FileError::context("copy", from)(std::io::Error::other(problem)).into());
    }
    create_folders_below(folder.path(), to.parent().unwrap_or(folder.path()))?;
    Ok(write_atomically(to, &bytes)?)
}
