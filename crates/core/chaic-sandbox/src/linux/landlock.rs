//! Landlock: restricts the files that the process and its descendants can open.

use std::path::PathBuf;

use landlock::{
    ABI, Access as _, AccessFs, CompatLevel, Compatible as _, Ruleset, RulesetAttr as _,
    RulesetCreatedAttr as _, RulesetError, RulesetStatus, Scope, path_beneath_rules,
};

/// Newest version of Landlock whose restrictions are used; older kernels enforce the subset they
/// support.
const NEWEST: ABI = ABI::V6;

/// Paths to which the process keeps access. Missing ones are ignored.
pub(super) struct Access {
    /// Paths to read and execute.
    pub read: Vec<PathBuf>,
    /// Paths to read, write, create and remove.
    pub write: Vec<PathBuf>,
    /// Devices to read and write.
    pub devices: Vec<PathBuf>,
}

/// Restricts the process to these paths, and its signals and abstract sockets to its own
/// descendants. Returns whether the kernel enforces it.
pub(super) fn restrict(access: &Access) -> Result<bool, RulesetError> {
    let files = AccessFs::from_file(NEWEST);
    let status = Ruleset::default()
        .set_compatibility(CompatLevel::BestEffort)
        .handle_access(AccessFs::from_all(NEWEST))?
        .scope(Scope::from_all(NEWEST))?
        .create()?
        .add_rules(path_beneath_rules(&access.read, AccessFs::from_read(NEWEST)))?
        .add_rules(path_beneath_rules(&access.write, AccessFs::from_all(NEWEST)))?
        .add_rules(path_beneath_rules(&access.devices, files))?
        .restrict_self()?;
    Ok(status.ruleset != RulesetStatus::NotEnforced)
}
