//! Runs that several machines play together: each a shard of the same run, in a folder of its own, joined
//! afterwards.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use chaic_env::RunKey;
use chaic_files::entries;

use super::folder::{COMMANDS, RECORDS};
use super::items::planned;
use super::journal::{Journal, read_results};
use super::{Access, Run, RunFolder};
use crate::error::{EvalError, Result};
use crate::metrics::RunResult;

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

/// Joins shards of one run, or any parts of it, in a new folder. Its files are those of the run played at
/// once, but for the order of the lines in the journal, which is that of the plan here.
///
/// # Errors
/// If they are parts of different runs, tell of an episode run differently, or have helpers that ask language
/// models; if files can't be read or written.
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
        if folder.join(RECORDS).exists() {
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
    let results = results(parts, &items.iter().map(|item| &item.key).collect::<Vec<_>>())?;

    let (folder, _) = RunFolder::lock(out, Access::Begin)?;
    if source.episode_files().exists() {
        copy_all(&source.episode_files(), &folder.episode_files())?;
    }
    if source.join(COMMANDS).exists() {
        copy(&source.join(COMMANDS), &folder.join(COMMANDS))?;
    }
    for (result, part) in &results {
        let traced = options.traces && result.summary().is_some();
        if traced {
            let (part, _) = RunFolder::read(part)?;
            copy(&part.trace(&result.key), &folder.trace(&result.key))?;
        }
    }
    let line = |result: &RunResult| {
        serde_json::to_string(result).expect("a result has string keys") + "\n"
    };
    let lines: String = results.iter().map(|(result, _)| line(result)).collect();
    folder.write("results.jsonl", lines.as_bytes())?;
    folder.write_options(&options, &granted)?;
    let (journal, results, _) = Journal::open(&folder.results(), &items)?;
    Ok(Run { folder, options, granted, journal, items, results })
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

fn copy_all(from: &Path, to: &Path) -> Result<()> {
    for file in entries(from)? {
        let name = file.file_name().unwrap_or_default();
        copy(&file, &to.join(name))?;
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let folder = to.parent().unwrap_or(to);
    fs::create_dir_all(folder).map_err(EvalError::io("make the folder", folder))?;
    fs::copy(from, to).map_err(EvalError::io("copy", from))?;
    Ok(())
}
