//! Folder of an evaluated submission: the submission, its run on a sealed split, and its score.

use std::path::{Path, PathBuf};

use chaic_env::helper_registry::HelperRegistry;
use chaic_eval::EvalError;
use chaic_eval::metrics::RunResult;
use chaic_eval::run::RunFolder;
use chaic_eval::verify::{VerificationReport, verify_run};
use chaic_files::{EntryKind, kind, read_bounded, write_atomically};

use crate::error::Result;
use crate::score::{PlayedRun, SubmissionScore};
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
    /// Verification of the run.
    pub verification: VerificationReport,
    /// All problems, one line each; empty if the score is confirmed.
    pub problems: Vec<String>,
}

impl EvaluationReport {
    /// Returns the simulated time of all verified episode runs, frames.
    pub fn simulated_frames(&self) -> u64 {
        let finished = self.run.results.iter().filter_map(RunResult::summary);
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

    /// Returns the folder of the run.
    pub fn run_folder(&self) -> PathBuf {
        self.folder.join(RUN)
    }

    /// Returns the path of the score.
    pub fn score_file(&self) -> PathBuf {
        self.folder.join(SCORE)
    }

    /// Returns whether the folder holds a part of an evaluation.
    pub fn exists(&self) -> bool {
        kind(&self.folder.join(SUBMISSION)).is_ok_and(|kind| kind == EntryKind::Folder)
    }

    /// Puts a submission into the folder: extracts an archive, or copies a folder. An evaluation that was
    /// started with the same submission is continued.
    ///
    /// # Errors
    /// [`EvalError::Options`] if the folder has another submission; those of
    /// [`UnpackedSubmission::read`].
    pub fn add_submission(&self, source: &Path) -> Result<Submission> {
        let target = self.folder.join(SUBMISSION);
        // A refused submission leaves no folder.
        let unpacked = UnpackedSubmission::read(source)?;
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
    /// Those of [`PlayedRun::read`] and [`SubmissionScore::new`].
    pub fn score(&self) -> Result<SubmissionScore> {
        SubmissionScore::new(&self.submission()?, &PlayedRun::read(&self.run_folder())?)
    }

    /// Writes `score.json`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_score(&self, score: &SubmissionScore) -> Result<()> {
        Ok(write_atomically(&self.score_file(), score.to_json().as_bytes())?)
    }

    /// Re-simulates the run, computes the score again and compares it with `score.json`, byte by byte.
    /// With a commitment, also compares the played episodes with it.
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
        let (folder, options) = RunFolder::read(&self.run_folder())?;
        let verification = verify_run(&folder, &options, helpers, jobs, progress)?;
        let mut problems: Vec<String> = verification
            .mismatches
            .iter()
            .map(ToString::to_string)
            .chain(verification.findings.iter().map(ToString::to_string))
            .collect();
        if problems.is_empty() {
            problems.extend(first_difference(&verification));
        }
        problems.extend(self.score_difference(&score)?);
        let committed = commitment.map_or(Ok(()), |c| c.check_played(&run.episodes));
        problems.extend(committed.err().map(|error| error.to_string()));
        Ok(EvaluationReport { score, run, verification, problems })
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
