//! Partners from files: recorded people and trained policies.

use std::path::Path;

use anyhow::Result;
use chaic_env::helper_registry::{PARTNER_FILES, POLICY, RECORDED};
use chaic_env::partner_suite::SuitePartner;
use chaic_env::recording::Recordings;
use chaic_eval::EvalError;
use chaic_eval::suite::SuiteFolder;
use chaic_learn::helpers::PartnerPolicy;
use chaic_learn::partner::recordings::read_recordings;

/// Partners from files that a command names.
#[derive(Default)]
pub(super) struct GivenPartners {
    pub recordings: Vec<Recordings>,
    pub policies: Vec<PartnerPolicy>,
}

impl GivenPartners {
    /// Reads the file of a partner and returns the partner's name in runs, which contains a digest
    /// instead of the path. Other names are returned unchanged.
    ///
    /// # Errors
    /// If the path is missing, or a file can't be read or is of another kind.
    pub fn resolve(&mut self, name: &str) -> Result<String> {
        if PARTNER_FILES.contains(&name) {
            let text = format!("the partner `{name}` has no path after the colon");
            return Err(EvalError::Options(text).into());
        }
        if let Some(path) = name.strip_prefix(RECORDED) {
            let recordings = read_recordings(Path::new(path))?;
            let name = recordings.to_string();
            self.recordings.push(recordings);
            return Ok(name);
        }
        if let Some(path) = name.strip_prefix(POLICY) {
            let policy = PartnerPolicy::read(Path::new(path))?;
            let name = policy.name().to_owned();
            self.policies.push(policy);
            return Ok(name);
        }
        Ok(name.to_owned())
    }
}

/// Returns whether a partner comes from a file.
pub(super) fn is_partner_file(name: &str) -> bool {
    PARTNER_FILES.iter().any(|prefix| name.starts_with(prefix))
}

/// Refuses to continue runs without their list of partners if a partner comes from a file. Only the list
/// contains the path.
///
/// # Errors
/// [`EvalError::Options`] with the first such partner.
pub(super) fn require_no_files(folder: &SuiteFolder) -> Result<()> {
    let from_file = |entry: &&SuitePartner| entry.partner.as_deref().is_some_and(is_partner_file);
    let Some(entry) = folder.suite().partners().iter().find(from_file) else { return Ok(()) };
    let problem = format!(
        "the partner `{}` of {} comes from a file; give the list again with --partners FILE",
        entry.name,
        folder.path().display()
    );
    Err(EvalError::Options(problem).into())
}
