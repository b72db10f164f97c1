//! Folder of an evaluated submission: the submission, its run on a sealed split, and its score.

use std::path::{Path, PathBuf};

use chaic_env::helper_registry::HelperRegistry;
use chaic_eval::EvalError;
use chaic_eval::metrics::RunResult;
use chaic_eval::run::RunFolder;
use chaic_eval::suite::SuiteFolder;
use chaic_eval::verify::{VerificationReport, verify_run};
use chaic_files::{EntryKind, FolderLock, create_folders, kind, read_bounded, write_atomically};

use crate::error::{ArenaError, Result};
use crate::played::PlayedRun;
use crate::score::SubmissionScore;
use crate::sealed::Commitment;
use crate::submission::{Submission, UnpackedSubmission, first_difference};

/// File of the score.
pub const SCORE: &str = "score.json";
/// Folder of the submission.
const SUBMISSION: &str = "submission";
/// Folder of the run.
const RUN: &str = "run";

/// Folder of an evaluated submission.
#[derive(Clone, Debug)]
pub struct Evaluation {
    folder: PathBuf,
}

/// Result of verifying an evaluated submission.
#[derive(Debug)]
pub struct EvaluationReport {
    /// The score, computed again.
    pub score: SubmissionScore,
    /// The run.
    pub run: PlayedRun,
    /// Number of traces without a difference.
    pub traces: usize,
    /// Number of decisions in all traces.
    pub decisions: usize,
    /// All problems, one line each; empty if the score is confirmed.
    pub problems: Vec<String>,
}

impl EvaluationReport {
    /// Returns the simulated time of all verified episode runs, frames.
    pub fn simulated_frames(&self) -> u64 {
        let results = self.run.runs().iter().flat_map(|run| &run.results);
        let finished = results.filter_map(RunResult::summary);
        finished.map(|summary| u64::from(summary.frames)).sum()
    }
}

impl Evaluation {
    /// Returns the evaluation in a folder, or in the folder of a `score.json`. Reads nothing.
    pub fn at(path: &Path) -> Evaluation {
        let is_score = path.file_name().is_some_and(|name| name == SCORE);
        let folder = if is_score { path.parent().unwrap_or(Path::new("")) } else { path };
        let is_here = folder.as_os_str().is_empty();
        Evaluation { folder: if is_here { PathBuf::from(".") } else { folder.to_owned() } }
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the folder of the run, which holds a run per partner if it was played with a list.
    pub fn run_folder(&self) -> PathBuf {
        self.folder.join(RUN)
    }

    /// Returns the folders of the runs: with the ordinary partner, and then with each partner of the list.
    ///
    /// # Errors
    /// If the list of partners cannot be read.
    pub fn partner_runs(&self) -> Result<Vec<PathBuf>> {
        let path = self.run_folder();
        if !SuiteFolder::is_suite(&path) {
            return Ok(vec![path]);
        }
        let folder = SuiteFolder::read(&path)?;
        Ok(folder.partners().iter().map(|entry| folder.run_path(entry)).collect())
    }

    /// Returns the path of the score.
    pub fn score_file(&self) -> PathBuf {
        self.folder.join(SCORE)
    }

    /// Returns whether the folder holds a part of an evaluation.
    pub fn exists(&self) -> bool {
        kind(&self.folder.join(SUBMISSION)).is_ok_and(|kind| kind == EntryKind::Folder)
    }

    /// Checks that the folder has a submission with a run.
    ///
    /// # Errors
    /// [`ArenaError::Score`] if one of them is missing.
    pub fn check_parts(&self) -> Result<()> {
        let run = self.run_folder();
        let problem = if !self.exists() {
            "it has no submission; name the folder that `chaic submit run` wrote"
        } else if !RunFolder::is_run(&run) && !SuiteFolder::is_suite(&run) {
            "its run is missing; repeat `chaic submit run` to play it"
        } else {
            return Ok(());
        };
        Err(ArenaError::Score { path: self.folder.clone(), problem: problem.to_owned() })
    }

    /// Puts a submission into the folder: extracts an archive, or copies a folder. An evaluation that was
    /// started with the same submission is continued.
    ///
    /// # Errors
    /// [`EvalError::Options`] if the folder has another submission; [`LockError`](chaic_files::LockError)
    /// while another process puts one there; those of [`UnpackedSubmission::read`].
    pub fn add_submission(&self, source: &Path) -> Result<Submission> {
        let target = self.folder.join(SUBMISSION);
        // A refused submission leaves no folder.
        let unpacked = UnpackedSubmission::read(source)?;
        create_folders(&self.folder)?;
        let _lock = FolderLock::acquire(&self.folder)?;
        if !self.exists() {
            unpacked.extract(&target)?;
            return Submission::read(&target);
        }
        let present = Submission::read(&target)?;
        if present.sha256() == unpacked.submission().sha256() {
            return Ok(present);
        }
        let (present, given) = (target.display(), source.display());
        let problem = format!("the submission in {present} is not {given}; choose another --out");
        Err(EvalError::Options(problem).into())
    }

    /// Reads the submission.
    ///
    /// # Errors
    /// Those of [`Submission::read`].
    pub fn submission(&self) -> Result<Submission> {
        Submission::read(&self.folder.join(SUBMISSION))
    }

    /// Computes the score from the run. The run is not verified.
    ///
    /// # Errors
    /// Those of [`Evaluation::check_parts`], [`PlayedRun::read`] and [`SubmissionScore::new`].
    pub fn score(&self) -> Result<SubmissionScore> {
        self.check_parts()?;
        SubmissionScore::new(&self.submission()?, &PlayedRun::read(&self.run_folder())?)
    }

    /// Writes `score.json`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_score(&self, score: &SubmissionScore) -> Result<()> {
        Ok(write_atomically(&self.score_file(), score.to_json().as_bytes())?)
    }

    /// Re-simulates the run with each partner, computes the score again and compares it with `score.json`,
    /// byte by byte. With a commitment, also compares the played episodes and partners with it.
    ///
    /// `helpers` are those of [`verify_run`]; `progress` gets the number of verified traces.
    ///
    /// # Errors
    /// If the submission, the run or the score cannot be read. Differences are no errors.
    pub fn verify(
        &self,
        helpers: &dyn HelperRegistry,
        commitment: Option<&Commitment>,
        jobs: usize,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<EvaluationReport> {
        let submission = self.submission()?;
        let run = PlayedRun::read(&self.run_folder())?;
        let score = SubmissionScore::new(&submission, &run)?;
        let (mut traces, mut decisions, mut n_checked) = (0, 0, 0);
        let mut problems = Vec::new();
        for part in run.runs() {
            let progress = |n: usize| progress(n_checked + n);
            let report = verify_run(&part.folder, &part.options, helpers, jobs, &progress)?;
            n_checked += part.folder.traces()?.len();
            traces += report.agreeing;
            decisions += report.decisions;
            problems.extend(differences(&report));
        }
        if let Some(folder) = run.suite() {
            problems.extend(folder.findings(run.runs())?.iter().map(ToString::to_string));
        }
        problems.extend(self.score_difference(&score)?);
        if let Some(commitment) = commitment {
            let episodes = commitment.check_played(run.episodes());
            let partners = run
                .suite()
                .map_or(Ok(()), |folder| commitment.check_played_partners(folder.suite()));
            let differing = [episodes, partners].into_iter().filter_map(std::result::Result::err);
            problems.extend(differing.map(|error| error.to_string()));
        }
        Ok(EvaluationReport { score, run, traces, decisions, problems })
    }

    /// Compares `score.json` with a score; returns the difference in one line.
    fn score_difference(&self, score: &SubmissionScore) -> Result<Option<String>> {
        let (path, expected) = (self.score_file(), score.to_json());
        let shown = path.display();
        match kind(&path)? {
            EntryKind::File => {}
            EntryKind::Missing => {
                return Ok(Some(format!("{shown} is missing; write it with chaic submit score")));
            }
            other => return Ok(Some(format!("{shown}: {other}"))),
        }
        // One byte more distinguishes a longer file.
        let found = read_bounded(&path, expected.len() as u64 + 1)?;
        if found == expected.as_bytes() {
            return Ok(None);
        }
        let found = String::from_utf8_lossy(&found);
        let lines = found.lines().zip(expected.lines());
        let n_equal = lines.take_while(|(found, expected)| found == expected).count();
        Ok(Some(format!(
            "{shown}: line {} differs from the score that the traces give",
            n_equal + 1
        )))
    }
}

/// Returns all differences that the verification of a run found, one line each.
fn differences(report: &VerificationReport) -> Vec<String> {
    let mismatches = report.mismatches.iter().map(ToString::to_string);
    let findings = report.findings.iter().map(ToString::to_string);
    let differences: Vec<String> = mismatches.chain(findings).collect();
    if differences.is_empty() {
        first_difference(report).into_iter().collect()
    } else {
        differences
    }
}
