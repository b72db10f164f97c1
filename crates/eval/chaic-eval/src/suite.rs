//! Runs with several partners: one folder that holds an ordinary run per partner.
//!
//! The folder holds `partners.json` (the [`PartnerSuite`]), the folder of a run for the ordinary
//! partner and for each partner of the list, and the robustness report. All commands that read runs
//! read the runs inside it. They differ in the partner only.

mod episodes;
mod folder_check;
mod report;

pub use report::Robustness;

use std::path::{Path, PathBuf};

use chaic_env::partner_suite::{MAX_FILE_BYTES, PartnerSuite, SuitePartner};
use chaic_env::trace::TraceWarning;
use chaic_files::{
    EntryKind, TEMPORARY_SUFFIX, create_folders, entries, kind, read_bounded, write_atomically,
};

use crate::error::{EvalError, Result};
use crate::metrics::RunResult;
use crate::run::{
    EpisodeJob, PARTNERS_FILE, Run, RunFolder, RunOptions, has_partners, merge, planned,
    read_results, reopen_merged,
};

/// File names of the robustness report.
const REPORT: [&str; 2] = ["robustness.json", "robustness.md"];

/// Folder with a run per partner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SuiteFolder {
    path: PathBuf,
    suite: PartnerSuite,
}

/// Returns whether a file is a list of partners whose writer was stopped. The next writer replaces it.
fn is_unfinished_list(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.strip_prefix(PARTNERS_FILE).is_some_and(|rest| rest.ends_with(TEMPORARY_SUFFIX))
}

/// Run with one partner of a [`SuiteFolder`].
#[derive(Debug)]
pub struct PartnerRun {
    /// The partner.
    pub partner: SuitePartner,
    /// Folder of the run.
    pub folder: RunFolder,
    /// Options of the run.
    pub options: RunOptions,
    /// All planned episode runs; empty if the run's episodes can't be read.
    pub planned: Vec<EpisodeJob>,
    /// Results so far.
    pub results: Vec<RunResult>,
}

impl SuiteFolder {
    /// Returns whether the folder holds runs with several partners.
    pub fn is_suite(path: &Path) -> bool {
        has_partners(path)
    }

    /// Starts runs with several partners in a new or empty folder, or continues a start that was
    /// interrupted. It creates no runs.
    ///
    /// # Errors
    /// If the folder has other content, all runs are started, or the start had other partners.
    pub fn start(path: &Path, suite: PartnerSuite) -> Result<SuiteFolder> {
        let not_empty = || EvalError::NotEmpty { path: path.to_owned() };
        if SuiteFolder::is_suite(path) {
            let folder = SuiteFolder::read(path)?;
            folder.check_partners(&suite)?;
            return if folder.unstarted().is_some() { Ok(folder) } else { Err(not_empty()) };
        }
        if path.exists() && entries(path)?.iter().any(|entry| !is_unfinished_list(entry)) {
            return Err(not_empty());
        }
        create_folders(path)?;
        write_atomically(&path.join(PARTNERS_FILE), suite.to_json().as_bytes())?;
        Ok(SuiteFolder { path: path.to_owned(), suite })
    }

    /// Reads the partners of a folder.
    ///
    /// # Errors
    /// If the folder has no list of partners, or it is damaged.
    pub fn read(path: &Path) -> Result<SuiteFolder> {
        let file = path.join(PARTNERS_FILE);
        let bytes = read_bounded(&file, MAX_FILE_BYTES)?;
        let suite = PartnerSuite::parse(&bytes, &file.display().to_string())?;
        Ok(SuiteFolder { path: path.to_owned(), suite })
    }

    /// Checks that the folder has these partners.
    ///
    /// # Errors
    /// [`EvalError::Options`] if it has others.
    pub fn check_partners(&self, suite: &PartnerSuite) -> Result<()> {
        if self.suite == *suite {
            return Ok(());
        }
        Err(EvalError::Options(format!(
            "{} was started with other partners than --partners; omit --partners to resume it, or choose \
             another --out",
            self.path.display()
        )))
    }

    /// Checks that the runs of all partners are started.
    ///
    /// # Errors
    /// [`EvalError::PartnerNotStarted`] with the first partner without a run.
    pub fn check_started(&self) -> Result<()> {
        match self.unstarted() {
            None => Ok(()),
            Some(entry) => {
                Err(EvalError::PartnerNotStarted { path: self.path.clone(), partner: entry.name })
            }
        }
    }

    fn unstarted(&self) -> Option<SuitePartner> {
        self.partners().into_iter().find(|entry| !RunFolder::is_run(&self.run_path(entry)))
    }

    /// Merges shards or other parts of the runs with several partners in a new folder, partner by
    /// partner. Returns the runs of all partners. It writes no robustness report; until there is one,
    /// an interrupted merge can be repeated.
    ///
    /// # Errors
    /// If the parts have different partners, or the folder has runs of other parts; those of
    /// [`merge`].
    pub fn merge(out: &Path, parts: &[PathBuf]) -> Result<(SuiteFolder, Vec<Run>)> {
        let folders: Result<Vec<SuiteFolder>> =
            parts.iter().map(|part| SuiteFolder::read(part)).collect();
        let folders = folders?;
        let Some(first) = folders.first() else {
            return Err(EvalError::Options("name the runs to merge".to_owned()));
        };
        for folder in &folders {
            folder.check_started()?;
            if folder.suite != first.suite {
                return Err(EvalError::Options(format!(
                    "{} and {} have different partners; play all shards with the same --partners",
                    first.path.display(),
                    folder.path.display()
                )));
            }
        }
        let merged = SuiteFolder::start_merge(out, first.suite.clone())?;
        let mut runs = Vec::new();
        for entry in merged.partners() {
            let parts: Vec<PathBuf> =
                folders.iter().map(|folder| folder.run_path(&entry)).collect();
            let path = merged.run_path(&entry);
            let open = if RunFolder::is_run(&path) { reopen_merged } else { merge };
            runs.push(open(&path, &parts)?);
        }
        Ok((merged, runs))
    }

    /// Starts a merge in a new or empty folder, or continues one that was interrupted before it wrote
    /// the robustness report.
    fn start_merge(path: &Path, suite: PartnerSuite) -> Result<SuiteFolder> {
        if !SuiteFolder::is_suite(path) {
            return SuiteFolder::start(path, suite);
        }
        let folder = SuiteFolder::read(path)?;
        folder.check_partners(&suite)?;
        for name in REPORT {
            if kind(&path.join(name))? == EntryKind::Missing {
                return Ok(folder);
            }
        }
        Err(EvalError::NotEmpty { path: path.to_owned() })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the list of partners.
    pub fn suite(&self) -> &PartnerSuite {
        &self.suite
    }

    /// Returns the ordinary partner, and then those of the list.
    pub fn partners(&self) -> Vec<SuitePartner> {
        self.suite.with_ordinary()
    }

    /// Returns the folder of a partner's run.
    pub fn run_path(&self, entry: &SuitePartner) -> PathBuf {
        self.path.join(&entry.name)
    }

    /// Reads the runs of all partners, and warnings about incomplete records.
    ///
    /// # Errors
    /// If a run is not started or can't be read.
    pub fn runs(&self) -> Result<(Vec<PartnerRun>, Vec<TraceWarning>)> {
        self.check_started()?;
        let (mut runs, mut all_warnings) = (Vec::new(), Vec::new());
        for partner in self.partners() {
            let (folder, options) = RunFolder::read(&self.run_path(&partner))?;
            // Results are useful even if the episodes of the run are gone.
            let planned = planned(&folder, &options).unwrap_or_default();
            let (results, warnings) = read_results(&folder.results(), &planned)?;
            all_warnings.extend(warnings);
            runs.push(PartnerRun { partner, folder, options, planned, results });
        }
        Ok((runs, all_warnings))
    }

    /// Writes `robustness.json` and `robustness.md`.
    ///
    /// # Errors
    /// If a file can't be written.
    pub fn write_report(&self, robustness: &Robustness) -> Result<()> {
        for (name, text) in REPORT.into_iter().zip(robustness.files()) {
            write_atomically(&self.path.join(name), text.as_bytes())?;
        }
        Ok(())
    }

    /// Returns the path of the report as Markdown.
    pub fn report_path(&self) -> PathBuf {
        self.path.join(REPORT[1])
    }

    /// Returns the names of the report's files that are missing, and of those that differ from the
    /// results.
    fn differing_files(
        &self,
        robustness: &Robustness,
    ) -> Result<(Vec<&'static str>, Vec<&'static str>)> {
        let (mut missing, mut altered) = (Vec::new(), Vec::new());
        for (name, text) in REPORT.into_iter().zip(robustness.files()) {
            let path = self.path.join(name);
            match kind(&path)? {
                EntryKind::Missing => missing.push(name),
                EntryKind::File
                    if read_bounded(&path, text.len() as u64 + 1)? == text.as_bytes() => {}
                _ => altered.push(name),
            }
        }
        Ok((missing, altered))
    }
}
