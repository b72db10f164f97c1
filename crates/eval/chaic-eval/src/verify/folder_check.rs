//! Comparison of the files in a run's folder with its plan and results.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::PathBuf;

use chaic_env::helper_registry::NONE;
use chaic_env::{CHAIC_VERSION, RunKey};
use chaic_files::{DirectoryEntry, EntryKind, walk};

use super::{Mismatch, finished};
use crate::error::Result;
use crate::metrics::RunResult;
use crate::run::{FILES, RunFolder, RunOptions};

/// Problem in a run's folder that is not the difference of a single trace.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Finding {
    /// The file or folder.
    pub path: PathBuf,
    /// The problem, in one line.
    pub problem: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.problem)
    }
}

/// Check of a run's folder against its plan and results.
pub(super) struct FolderCheck<'a> {
    pub folder: &'a RunFolder,
    pub options: &'a RunOptions,
    /// All planned episode runs; empty if the episodes can't be read.
    pub planned: &'a [RunKey],
    pub results: &'a [RunResult],
}

/// Outcome of a [`FolderCheck`].
#[derive(Default)]
pub(super) struct FolderContents {
    /// Traces to be simulated again.
    pub traces: Vec<PathBuf>,
    /// Finished results without a trace.
    pub missing: Vec<Mismatch>,
    pub findings: Vec<Finding>,
}

impl FolderCheck<'_> {
    /// Checks traces, episode files, `run.json` and repeated results. `repeated` lists results that
    /// later lines of the journal replace.
    ///
    /// # Errors
    /// If a file or folder can't be read.
    pub fn run(&self, repeated: &[(usize, RunKey)]) -> Result<FolderContents> {
        let mut contents = FolderContents::default();
        self.check_traces(&mut contents)?;
        self.check_episodes(&mut contents)?;
        self.check_run_file(&mut contents)?;
        for (line, RunKey { helper, episode, seed, .. }) in repeated {
            let problem = format!(
                "line {line} is a second result of {episode} with {helper} and seed {seed}, which was \
                 finished"
            );
            contents.findings.push(Finding { path: self.folder.results(), problem });
        }
        contents.findings.sort();
        Ok(contents)
    }

    fn check_traces(&self, contents: &mut FolderContents) -> Result<()> {
        let finished = finished(self.results);
        for key in finished.keys() {
            let problem = match self.folder.kind_of_trace(key)? {
                EntryKind::File => continue,
                EntryKind::Missing => {
                    "results.jsonl has this run, but its trace is missing".to_owned()
                }
                other => format!(
                    "results.jsonl has this run, but its trace is not a regular file: {other}"
                ),
            };
            let path = self.folder.trace(key);
            contents.missing.push(Mismatch { path, frame: 0, agent: None, problem });
        }
        let planned: BTreeMap<PathBuf, &RunKey> =
            self.planned.iter().map(|key| (self.folder.trace(key), key)).collect();
        for DirectoryEntry { path, kind } in self.folder.trace_entries()? {
            let key = planned.get(&path);
            let has_name = path.extension().is_some_and(|e| e == "jsonl");
            let problem = match kind {
                EntryKind::File if key.is_some() || planned.is_empty() && has_name => {
                    contents.traces.push(path);
                    continue;
                }
                EntryKind::File if has_name => "this run doesn't play that episode run".to_owned(),
                EntryKind::File if path.extension().is_some_and(|e| e == "partial") => {
                    "it is an unfinished trace".to_owned()
                }
                EntryKind::File => "it is not a trace of this run".to_owned(),
                // Reported with its result above.
                _ if key.is_some_and(|key| finished.contains_key(key)) => continue,
                other => format!("it is not a trace: {other}"),
            };
            contents.findings.push(Finding { path, problem });
        }
        Ok(())
    }

    /// Checks that only a run with the split `files` has episode files, and that they are named
    /// after their episodes.
    fn check_episodes(&self, contents: &mut FolderContents) -> Result<()> {
        let has_files = self.options.split == FILES;
        for DirectoryEntry { path, kind } in walk(&self.folder.episode_files(), 0)? {
            let problem = match kind {
                _ if !has_files => {
                    format!(
                        "this run plays the split {}, which has no episode files",
                        self.options.split
                    )
                }
                EntryKind::File => match self.folder.read_copy(&path) {
                    Ok(e) if self.folder.episode_copy(e.task(), e.id()) == path => continue,
                    Ok(e) => format!("it holds the episode {} under another name", e.id()),
                    Err(e) => format!("it is not an episode: {e}"),
                },
                other => format!("it is not an episode: {other}"),
            };
            contents.findings.push(Finding { path, problem });
        }
        Ok(())
    }

    fn check_run_file(&self, contents: &mut FolderContents) -> Result<()> {
        let path = self.folder.join("run.json");
        // The format of another version is unknown here.
        if self.folder.version()?.is_none_or(|chaic| chaic != CHAIC_VERSION) {
            return Ok(());
        }
        let mut add = |problem: &str| {
            contents.findings.push(Finding { path: path.clone(), problem: problem.to_owned() });
        };
        if !self.folder.has_canonical_run_file()? {
            add("its form differs from what chaic writes");
        }
        let Some(granted) = self.folder.granted()? else {
            add("it lacks the grants of helpers");
            return Ok(());
        };
        // `none` has no grants.
        let helpers: BTreeSet<&String> =
            self.options.helpers.iter().filter(|name| *name != NONE).collect();
        if granted.helpers.keys().collect::<BTreeSet<_>>() != helpers {
            add("its grants are not those of the helpers that play");
        }
        for (what, by_helper) in [
            ("perception", &granted.perception),
            ("isolation", &granted.isolation),
            ("weights", &granted.weights),
        ] {
            if !by_helper.keys().all(|name| helpers.contains(name)) {
                add(&format!("it names the {what} of helpers that do not play"));
            }
        }
        if !self.folder.helper_files()?.keys().all(|name| helpers.contains(name)) {
            add("it names the files of helpers that do not play");
        }
        Ok(())
    }
}
