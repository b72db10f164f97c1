//! The helper of a submission: a program in the sandbox, a policy or a built-in helper.
//!
//! **Invariant:** a submission determines which of its own files its helper reads, and which installed
//! program runs. It cannot make any other file readable.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Result, bail};
use chaic_arena::{HelperSource, Submission};
use chaic_env::helper_registry::{BuiltInWithPerception, HelperRegistry, find};
use chaic_env::recording::RecordedPartners;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_eval::EvalError;
use chaic_learn::helpers::{NamedPolicy, PolicyRegistry};
use chaic_sandbox::Launcher;
use chaic_subprocess::{
    CommandRegistry, Confinement, ConfinementOptions, HelperProgram, Limits, Refusal,
};

use super::given_partners::GivenPartners;
use super::run_perception::perception_by_name;
use crate::output::{print_warning, quoted};

/// Sandbox of the program of a submission.
#[derive(Clone, Copy)]
pub(super) struct SandboxOptions<'a> {
    /// Program that starts the stages of the sandbox.
    pub launcher: &'a Launcher,
    /// Folders that appear empty to the program, and files whose folders are never made readable.
    pub masked: &'a [PathBuf],
    /// True if parts of the sandbox may be missing on this system.
    pub allows_partial: bool,
}

/// Helpers of a run with a submission.
pub(super) struct SubmittedHelpers {
    built_in: BuiltInWithPerception,
    program: Option<HelperProgram>,
    policy: Option<(String, PathBuf)>,
    /// Partners from files.
    partners: GivenPartners,
    stop: &'static AtomicBool,
}

impl SubmittedHelpers {
    /// Prepares the helper of a submission.
    ///
    /// # Errors
    /// [`Refusal`] if the sandbox of a program does not start or lacks a part that is required; if the
    /// perception cannot be loaded.
    pub fn new(
        submission: &Submission,
        sandbox: SandboxOptions<'_>,
        stop: &'static AtomicBool,
    ) -> Result<SubmittedHelpers> {
        let manifest = submission.manifest();
        let play = &manifest.play;
        let perception = perception_by_name(Some(&play.perception), Some(&play.behavior))?;
        let built_in = BuiltInWithPerception { perception };
        let partners = GivenPartners::default();
        let mut helpers =
            SubmittedHelpers { built_in, program: None, policy: None, partners, stop };
        match &manifest.helper {
            HelperSource::BuiltIn(_) => {}
            HelperSource::Policy(path) => {
                let path = submission.helper_folder().join(path);
                helpers.policy = Some((manifest.name.clone(), path));
            }
            HelperSource::Command(words) => {
                helpers.program = Some(program(submission, words, sandbox)?);
            }
        }
        Ok(helpers)
    }

    /// Adds partners from files.
    pub fn with_partners(self, partners: GivenPartners) -> SubmittedHelpers {
        SubmittedHelpers { partners, ..self }
    }

    /// Returns the program of the submission, if it has one.
    pub fn program(&self) -> Option<&HelperProgram> {
        self.program.as_ref()
    }

    /// Passes the registry of these helpers to a function.
    ///
    /// # Errors
    /// Those of the function; if the policy cannot be read, or the name of the helper is taken.
    pub fn with_registry<T>(
        &self,
        play: impl FnOnce(&dyn HelperRegistry) -> Result<T>,
    ) -> Result<T> {
        let perception = Arc::clone(&self.built_in.perception);
        let policies: chaic_env::Result<Vec<NamedPolicy>> =
            self.policy.iter().map(|(name, file)| NamedPolicy::read(name, file)).collect();
        let policies = PolicyRegistry::bundled(&self.built_in, perception)
            .with_partners(&self.partners.policies)
            .with_policies(policies?)?;
        let policies = RecordedPartners::new(&policies, &self.partners.recordings);
        let programs = self.program.clone().into_iter().collect();
        play(&CommandRegistry::new(&policies, programs, self.stop)?)
    }

    /// Checks that the helper requests the grants of the manifest.
    ///
    /// # Errors
    /// If it requests others, or there is no helper of its name.
    pub fn check_grants(&self, submission: &Submission) -> Result<()> {
        let manifest = submission.manifest();
        let rules = RuleSet::named(RuleSetName::Paper).planner;
        let grants = self.with_registry(|helpers| {
            Ok(find(helpers, &manifest.name, rules)?.map(|helper| helper.grants))
        })?;
        if grants == Some(manifest.play.grants) {
            return Ok(());
        }
        let requested = grants.map_or(Vec::new(), |grants| {
            grants.names_beyond(chaic_core::observation::Grants::NONE)
        });
        bail!(
            "{} requests the grants [{}], which submission.toml must list in `play.grants`",
            manifest.name,
            requested.join(", ")
        )
    }
}

/// Returns the program of a submission in its sandbox.
fn program(
    submission: &Submission,
    words: &[String],
    sandbox: SandboxOptions<'_>,
) -> Result<HelperProgram> {
    let SandboxOptions { launcher, masked, allows_partial } = sandbox;
    let manifest = submission.manifest();
    if cfg!(windows) {
        let text = format!("the program of {} runs on Linux and macOS only", manifest.name);
        return Err(Refusal(text).into());
    }
    let folder = std::path::absolute(submission.helper_folder())?;
    let Some(folder_text) = folder.to_str() else {
        let text = format!("{} is not UTF-8; choose another folder", folder.display());
        return Err(EvalError::Options(text).into());
    };
    let words: Vec<String> = words.iter().map(|word| quoted(word).into_owned()).collect();
    let line = format!("cd {} && exec {}", quoted(folder_text), words.join(" "));
    let limits = Limits::default();
    let options = ConfinementOptions {
        is_trusted: false,
        readable: vec![folder.clone()],
        masked: masked.to_vec(),
    };
    let installed = installed_program(&words[0]);
    let confinement = Confinement::new(launcher, installed, &limits, &options)?;
    match confinement.warning() {
        None => {}
        Some(partial) if allows_partial => {
            print_warning(&format!("{} runs in {partial}", manifest.name));
        }
        Some(partial) => {
            return Err(Refusal(format!(
                "{} would run in {partial}, but a submission needs the whole sandbox; use another system, or \
                 give --allow-partial-sandbox",
                manifest.name
            ))
            .into());
        }
    }
    Ok(HelperProgram {
        name: manifest.name.clone(),
        line,
        grants: manifest.play.grants,
        limits,
        environment: Vec::new(),
        confinement: Some(confinement),
    })
}

/// Returns the program name by which the sandbox finds an installed program; empty if the word is a path.
///
/// The sandbox opens every file that a command line names, together with its folder. The command line of a
/// submission could name private files of the organizer.
fn installed_program(word: &str) -> &str {
    let is_name = word.chars().all(|c| c.is_ascii_alphanumeric() || "._-+".contains(c));
    if is_name && !Path::new(word).exists() { word } else { "" }
}
