//! Folder of a submission: manifest, helper and public run.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use chaic_agents::perception_factory::GROUND_TRUTH;
use chaic_core::TaskId;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::{HelperRegistry, NONE};
use chaic_env::rules::RuleSetName;
use chaic_eval::EvalError;
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::verify::{VerificationReport, verify_run_until};
use chaic_files::{EntryKind, FileError, entries, kind, kind_below, read_bounded};
use tempfile::TempDir;

use crate::archive::{content_sha256, extract, extract_temporarily, pack};
use crate::error::{ArenaError, Result};
use crate::manifest::{
    HelperSource, MANIFEST, MAX_MANIFEST_BYTES, Manifest, PlayConditions, PublicPart,
};

/// Folder of the program or the weights.
const HELPER: &str = "helper";
/// Folder of the public run.
const PUBLIC: &str = "public";
/// Files and folders that a submission may hold.
const ALLOWED: [&str; 5] = [MANIFEST, HELPER, PUBLIC, "README.md", "LICENSE"];

/// A submission in a folder, with a valid manifest and the parts that it names.
#[derive(Clone, Debug)]
pub struct Submission {
    folder: PathBuf,
    /// Name of the folder, or of the archive, in messages.
    label: PathBuf,
    manifest: Manifest,
    sha256: String,
}

impl Submission {
    /// Reads a submission. The public run is not verified; [`Submission::check_public_run`] does that.
    ///
    /// # Errors
    /// If the folder has other entries than a submission, or lacks a part that its manifest names; if the
    /// manifest is invalid; if the folder cannot be packed.
    pub fn read(folder: &Path) -> Result<Submission> {
        Submission::read_as(folder, folder)
    }

    fn read_as(folder: &Path, label: &Path) -> Result<Submission> {
        let refused = |problem: String| Err(refuse(label, problem));
        if kind(&folder.join(MANIFEST))? != EntryKind::File {
            return refused(format!("{MANIFEST} is missing at its top, or is no regular file"));
        }
        for path in entries(folder)? {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if !ALLOWED.contains(&&*name) {
                let known = ALLOWED.join(", ");
                return refused(format!(
                    "it holds `{}`; its entries are {known}",
                    name.escape_debug()
                ));
            }
        }
        let bytes = read_bounded(&folder.join(MANIFEST), MAX_MANIFEST_BYTES + 1)?;
        let manifest = Manifest::parse(&bytes, &label.join(MANIFEST))?;
        // Packing fails for links and special files, also below the top.
        let sha256 = content_sha256(folder)?;
        let (folder, label) = (folder.to_owned(), label.to_owned());
        let submission = Submission { folder, label, manifest, sha256 };
        submission.check_parts()?;
        Ok(submission)
    }

    fn check_parts(&self) -> Result<()> {
        let has_helper = kind(&self.helper_folder())? == EntryKind::Folder;
        let missing = |what: &str| Err(refuse(&self.label, format!("{what} is missing")));
        match &self.manifest.helper {
            HelperSource::BuiltIn(_) if has_helper => {
                let problem = format!("a built-in helper needs no folder `{HELPER}`");
                Err(refuse(&self.label, problem))
            }
            HelperSource::BuiltIn(_) => Ok(()),
            _ if !has_helper => missing(&format!("the folder `{HELPER}`")),
            HelperSource::Command(_) => Ok(()),
            HelperSource::Policy(path) => {
                let found = kind_below(&self.folder, &self.helper_folder().join(path))?;
                match found {
                    EntryKind::File | EntryKind::Folder => Ok(()),
                    _ => missing(&format!("`{HELPER}/{path}`, the policy of the manifest,")),
                }
            }
        }
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns a message with the name of the user's archive or folder in place of a temporary folder.
    pub fn with_label(&self, message: &str) -> String {
        let [folder, label] = [&self.folder, &self.label].map(|path| path.display().to_string());
        message.replace(&folder, &label)
    }

    /// Returns the manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Returns the SHA-256 of the packed submission, hexadecimal. It is the version of the code.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Returns the folder of the program or the weights.
    pub fn helper_folder(&self) -> PathBuf {
        self.folder.join(HELPER)
    }

    /// Returns the folder of the public run.
    pub fn public_run(&self) -> PathBuf {
        self.folder.join(PUBLIC)
    }

    /// Verifies the public run: it has the options and grants of the manifest, and its results follow
    /// from its traces.
    ///
    /// `helpers` are those of [`verify_run_until`]. `progress` gets the number of verified traces. Returns
    /// `None` if `stop` is raised.
    ///
    /// # Errors
    /// [`ArenaError::Submission`] with the first difference; if the run cannot be read.
    pub fn check_public_run(
        &self,
        helpers: &dyn HelperRegistry,
        jobs: usize,
        stop: &AtomicBool,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Option<VerificationReport>> {
        let problem = |problem: String| {
            refuse(&self.label, format!("`{PUBLIC}`: {}", self.with_label(&problem)))
        };
        let (run, options) =
            RunFolder::read(&self.public_run()).map_err(|error| problem(error.to_string()))?;
        self.check_options(&options).map_err(problem)?;
        let granted = run.granted()?;
        let grants = granted.as_ref().and_then(|granted| granted.helpers.get(&self.manifest.name));
        self.check_grants(grants.copied()).map_err(problem)?;
        let report = verify_run_until(&run, &options, helpers, jobs, stop, progress)
            .map_err(|error: EvalError| problem(error.to_string()))?;
        match report.as_ref().and_then(first_difference) {
            Some(difference) => Err(problem(difference)),
            None => Ok(report),
        }
    }

    /// Checks the grants with which the helper plays.
    pub(crate) fn check_grants(&self, found: Option<Grants>) -> std::result::Result<(), String> {
        let declared = self.manifest.play.grants;
        if found == Some(declared) {
            return Ok(());
        }
        let names = |grants: Grants| {
            let names = grants.named().into_iter().filter(|(_, is_granted)| *is_granted);
            let names: Vec<&str> = names.map(|(name, _)| name).collect();
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        };
        Err(format!(
            "{} plays with the grants {}, but {MANIFEST} has {}",
            self.manifest.name,
            found.map_or("of no record".to_owned(), names),
            names(declared)
        ))
    }

    /// Compares the options of the public run with the manifest; the error names the first difference.
    fn check_options(&self, options: &RunOptions) -> std::result::Result<(), String> {
        self.check_play(options)?;
        let PublicPart { split, tasks, n_episodes } = &self.manifest.public;
        let text = |tasks: &[TaskId]| tasks.iter().map(|t| t.name()).collect::<Vec<_>>().join(",");
        let number = |n: Option<u32>| n.map_or("all".to_owned(), |n| n.to_string());
        let paper = || TaskId::paper().collect();
        compare([
            ("tasks", text(&options.tasks), text(&tasks.clone().unwrap_or_else(paper))),
            ("split", options.split.clone(), split.to_string()),
            ("number of episodes", number(options.n_episodes), number(*n_episodes)),
            ("rule set", options.rules.to_string(), RuleSetName::Paper.to_string()),
        ])?;
        let has_defaults = options.rule_overrides.is_empty()
            && options.partner.is_none()
            && options.person.is_none()
            && options.appearance.is_none();
        if has_defaults {
            return Ok(());
        }
        Err("it has another partner, person, appearance or rule than the benchmark".to_owned())
    }

    /// Compares helpers, track and perception of a run with the manifest; the error names the first
    /// difference.
    pub(crate) fn check_play(&self, options: &RunOptions) -> std::result::Result<(), String> {
        let Manifest { name, play, .. } = &self.manifest;
        let PlayConditions { track, perception, behavior, .. } = play;
        if ![NONE, name.as_str()].iter().all(|name| options.helpers.iter().any(|h| h == name)) {
            return Err(format!("it must have the helpers {NONE} and {name}"));
        }
        let or_default = |name: &Option<String>| name.as_deref().unwrap_or(GROUND_TRUTH).to_owned();
        compare([
            ("track", options.track.to_string(), track.to_string()),
            ("perception", or_default(&options.perception), perception.clone()),
            ("behavior", or_default(&options.behavior), behavior.clone()),
        ])
    }
}

/// Compares fields of a run with those of the manifest, each given as name, value of the run and value
/// of the manifest. The error names the first difference.
fn compare<const N: usize>(fields: [(&str, String, String); N]) -> std::result::Result<(), String> {
    match fields.into_iter().find(|(_, found, expected)| found != expected) {
        None => Ok(()),
        Some((field, found, expected)) => {
            Err(format!("the {field} of the run is `{found}`, but {MANIFEST} has `{expected}`"))
        }
    }
}

/// Returns the first problem that verification found; `None` if the run is consistent.
pub(crate) fn first_difference(report: &VerificationReport) -> Option<String> {
    if report.is_consistent() {
        return None;
    }
    let mismatch = report.mismatches.first().map(ToString::to_string);
    let finding = || report.findings.first().map(ToString::to_string);
    let warning = || report.warnings.first().map(ToString::to_string);
    let missing = || (!report.coverage.missing.is_empty()).then(|| report.coverage.to_string());
    let other = || "its report is missing, altered or of another version of chaic".to_owned();
    Some(mismatch.or_else(finding).or_else(warning).or_else(missing).unwrap_or_else(other))
}

fn refuse(label: &Path, problem: impl Into<String>) -> ArenaError {
    ArenaError::Submission { path: label.to_owned(), problem: problem.into() }
}

/// A submission in a temporary folder, which is removed with this value.
#[derive(Debug)]
pub struct UnpackedSubmission {
    submission: Submission,
    archive: PathBuf,
    _folder: TempDir,
}

impl UnpackedSubmission {
    /// Reads a submission from an archive, or from a folder as if it were packed.
    ///
    /// # Errors
    /// Those of [`extract`], [`pack`] and [`Submission::read`], with `source` in their messages.
    pub fn read(source: &Path) -> Result<UnpackedSubmission> {
        let folder = tempfile::Builder::new().prefix("chaic-submission-").tempdir();
        let context = FileError::context("make a folder in", &std::env::temp_dir());
        let folder = folder.map_err(context)?;
        let archive =
            if source.is_dir() { folder.path().join("packed.tar") } else { source.to_owned() };
        if source.is_dir() {
            pack(source, &archive)?;
        }
        let unpacked = folder.path().join("submission");
        extract_temporarily(&archive, &unpacked)?;
        let submission = Submission::read_as(&unpacked, source)?;
        Ok(UnpackedSubmission { submission, archive, _folder: folder })
    }

    /// Returns the submission.
    pub fn submission(&self) -> &Submission {
        &self.submission
    }

    /// Extracts the submission into a new folder.
    ///
    /// # Errors
    /// Those of [`extract`].
    pub(crate) fn extract(&self, target: &Path) -> Result<()> {
        extract(&self.archive, target)
    }
}
