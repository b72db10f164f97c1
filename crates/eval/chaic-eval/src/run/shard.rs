//! Runs that several machines play together: each a shard of the same run, in a folder of its own, joined
//! afterwards.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use std::io::Write as _;

use chaic_env::RunKey;
use chaic_env::trace::MAX_TRACE_BYTES;
use chaic_files::{
    EntryKind, FileError, create_fresh, entries, kind, make_folders_below, read_below,
};

use super::folder::{COMMANDS, EPISODES, POLICIES, RECORDS};
use super::items::planned;
use super::journal::{Journal, line_of, read_results};
use super::{Access, Run, RunFolder};
use crate::error::{EvalError, Result};
use crate::metrics::{FormulaSet, RunResult};
use crate::report::{Report, write_files};

/// Every so manieth episode run of a run, from one of them on. Its folder says nothing of it: it holds a part of the
/// whole run, and can be gone on with as that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    of: u32,
}

impl Shard {
    /// All of a run.
    pub const WHOLE: Shard = Shard { number: 1, of: 1 };

    /// The shard of this number, from 1, of so many; `None` if there is none.
    pub fn new(number: u32, of: u32) -> Option<Shard> {
        (1..=of).contains(&number).then_some(Shard { number, of })
    }

    /// Whether the episode run of this place in the plan is in it.
    pub fn has(self, index: usize) -> bool {
        index % self.of as usize == (self.number - 1) as usize
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Shard, String> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let shard = numbers.and_then(|(number, of)| Shard::new(number, of));
        shard.ok_or_else(|| format!("no shard `{text}`; write I/N with 1 <= I <= N, like 2/4"))
    }
}

/// Joins shards of one run, or any parts of it, in a new folder, and writes the report. The files equal those
/// of a run played on one machine, except that the lines of the journal are in the order of the plan.
///
/// `run.json` is written last. After an interruption, the folder is either a complete run, or the same merge
/// can be repeated.
///
/// # Errors
/// If they are parts of different runs, tell of an episode run differently, or have helpers that ask language
/// models; if a finished episode run has no trace; if files can't be read or written.
pub fn merge(out: &Path, parts: &[PathBuf]) -> Result<Run> {
    let Some(first) = parts.first() else {
        return Err(EvalError::Options("name the runs to be joined".to_owned()));
    };
    let (source, options) = RunFolder::read(first)?;
    let granted = source.granted()?;
    for part in parts {
        let (folder, other) = RunFolder::read(part)?;
        if other != options || folder.granted()? != granted || folder.other_version()?.is_some() {
            return Err(EvalError::Options(format!(
                "{} and {} are parts of different runs, or of another chaic's; play all shards with \
                 the same options",
                first.display(),
                part.display(),
            )));
        }
        if kind(&folder.join(RECORDS))? != EntryKind::Missing {
            return Err(EvalError::Options(format!(
                "{} has helpers that ask language models, whose records can't be joined; play such a \
                 run in one folder",
                part.display(),
            )));
        }
    }
    let granted = granted.ok_or_else(|| {
        EvalError::Options(format!("{} was begun by an older chaic", first.display()))
    })?;
    let items = planned(&source, &options)?;
    let order: Vec<&RunKey> = items.iter().map(|item| &item.key).collect();
    let from_parts = results(parts, &order)?;
    let is_traced = |result: &RunResult| options.traces && result.summary().is_some();
    for (result, part) in from_parts.iter().filter(|(result, _)| is_traced(result)) {
        check_trace(&RunFolder::read(part)?.0, &result.key)?;
    }

    let (folder, _) = RunFolder::lock(out, Access::Merge)?;
    folder.begin_merge()?;
    copy_episodes(&source, &folder)?;
    for name in [COMMANDS, POLICIES] {
        if kind(&source.join(name))? != EntryKind::Missing {
            copy((&source, &source.join(name)), (&folder, &folder.join(name)))?;
        }
    }
    for (result, part) in from_parts.iter().filter(|(result, _)| is_traced(result)) {
        let (part, _) = RunFolder::read(part)?;
        copy((&part, &part.trace(&result.key)), (&folder, &folder.trace(&result.key)))?;
    }
    let results: Vec<RunResult> = from_parts.into_iter().map(|(result, _)| result).collect();
    let lines: String = results.iter().map(|result| line_of(result) + "\n").collect();
    folder.write("results.jsonl", lines.as_bytes())?;
    if !results.is_empty() {
        let (granted, formulas) = (Some(&granted), FormulaSet::Paper);
        let (options, results, planned) = (&options, &results, &items);
        write_files(&folder, &Report { options, results, planned, granted, formulas })?;
    }
    folder.write_options(&options, &granted)?;
    folder.end_merge()?;
    let (journal, results, _) = Journal::open(&folder.results(), &items)?;
    Ok(Run { folder, options, granted, journal, items, results, untraced: Vec::new() })
}

/// Fails if a part has no trace of a finished episode run.
fn check_trace(part: &RunFolder, key: &RunKey) -> Result<()> {
    if part.has_trace(key) {
        return Ok(());
    }
    Err(EvalError::Untraced { path: part.path().to_owned(), key: key.clone() })
}

/// The results of all parts in the order of the plan, with the part that each is from. Where one part has
/// an episode run that broke down and another one that didn't, the latter.
fn results<'p>(parts: &'p [PathBuf], order: &[&RunKey]) -> Result<Vec<(RunResult, &'p Path)>> {
    let mut found: BTreeMap<RunKey, (RunResult, &Path)> = BTreeMap::new();
    for part in parts {
        let (folder, _) = RunFolder::read(part)?;
        for result in read_results(&folder.results(), &[])?.0 {
            match found.get(&result.key) {
                Some((then, _)) if then.summary().is_some() && result.summary().is_none() => {}
                Some((then, by)) if then.summary().is_some() && *then != result => {
                    return Err(EvalError::Options(format!(
                        "{} with {} and seed {} came out otherwise in {} than in {}",
                        result.key.episode,
                        result.key.helper,
                        result.key.seed,
                        part.display(),
                        by.display(),
                    )));
                }
                _ => {
                    found.insert(result.key.clone(), (result, part));
                }
            }
        }
    }
    Ok(order.iter().filter_map(|key| found.remove(key)).collect())
}

/// Copies the episode files of a run.
fn copy_episodes(source: &RunFolder, folder: &RunFolder) -> Result<()> {
    let copies = source.join(EPISODES);
    if kind(&copies)? == EntryKind::Missing {
        return Ok(());
    }
    for file in entries(&copies)? {
        let name = file.file_name().unwrap_or_default();
        copy((source, &file), (folder, &folder.join(EPISODES).join(name)))?;
    }
    Ok(())
}

/// Copies a regular file from one run to another. It does not sync: an interrupted merge is repeated as a
/// whole.
fn copy((source, from): (&RunFolder, &Path), (folder, to): (&RunFolder, &Path)) -> Result<()> {
    // Traces have the highest limit of all files of a run.
    let bytes = read_below(source.path(), from, MAX_TRACE_BYTES + 1)?;
    if bytes.len() as u64 > MAX_TRACE_BYTES {
        let problem = format!("it is longer than {MAX_TRACE_BYTES} bytes, no file of a run is");
        return Err(FileError::of("copy", from)(std::io::Error::other(problem)).into());
    }
    make_folders_below(folder.path(), to.parent().unwrap_or(folder.path()))?;
    let written = create_fresh(to).and_then(|mut file| file.write_all(&bytes));
    Ok(written.map_err(FileError::of("write", to))?)
}
