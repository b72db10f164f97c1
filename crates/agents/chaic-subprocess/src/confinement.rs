//! Confinement of a helper's process: a sandbox, or the trust of its user.

use std::path::{Path, PathBuf};

use chaic_sandbox::{Isolation, IsolationPart, Launcher, Policy};

use crate::limits::{Limits, Refusal};

/// User's options for the confinement of commands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfinementOptions {
    /// True to run commands with all rights of the user.
    pub is_trusted: bool,
    /// Files and folders that commands can read in addition to system folders and paths in their lines.
    pub readable: Vec<PathBuf>,
    /// Folders and files that appear empty to commands, such as the folder of the run.
    pub masked: Vec<PathBuf>,
}

/// The confinement of one command, the same for each of its processes.
#[derive(Clone, Debug, PartialEq)]
pub struct Confinement {
    launcher: Launcher,
    policy: Policy,
    isolation: Isolation,
}

impl Confinement {
    /// Determines the paths that a command line can read and the parts that the system enforces.
    ///
    /// # Errors
    /// [`Refusal`] if a path is missing or not UTF-8, or the launcher does not start.
    pub fn new(
        launcher: &Launcher,
        line: &str,
        limits: &Limits,
        options: &ConfinementOptions,
    ) -> Result<Confinement, Refusal> {
        let refuse = |problem: &dyn std::fmt::Display| Refusal(problem.to_string());
        let start_folder = std::env::current_dir().map_err(|e| refuse(&e))?;
        let absolute = |path: &PathBuf| std::path::absolute(path).map_err(|e| refuse(&e));
        let masked: Result<Vec<PathBuf>, _> = options.masked.iter().map(absolute).collect();
        // A command can reach a masked folder by its real path too.
        let masked = masked.map(|paths| {
            let real: Vec<PathBuf> = paths.iter().map(|path| resolve_links(path)).collect();
            [paths, real].concat()
        });
        let mut policy = Policy {
            start_folder,
            readable: Vec::new(),
            masked: masked?,
            memory_mib: limits.memory_mib,
            scratch_mib: limits.scratch_mib,
            max_tasks: limits.max_tasks,
        };
        if options.is_trusted {
            check_names(&policy)?;
            let isolation = Isolation::Trusted;
            return Ok(Confinement { launcher: launcher.clone(), policy, isolation });
        }
        options.readable.iter().try_for_each(|p| policy.add_readable(p)).map_err(|e| refuse(&e))?;
        policy.add_from_command_line(line);
        check_names(&policy)?;
        let isolation = launcher.probe(&policy).map_err(|e| refuse(&e))?;
        Ok(Confinement { launcher: launcher.clone(), policy, isolation })
    }

    /// Returns the enforced isolation.
    pub fn isolation(&self) -> &Isolation {
        &self.isolation
    }

    /// Returns a warning about missing parts; `None` if none is missing or the user trusts the command.
    pub fn warning(&self) -> Option<String> {
        let Isolation::Sandboxed(missing) = &self.isolation else { return None };
        (!missing.is_empty()).then(|| describe(&self.isolation))
    }

    /// Returns whether a sandbox stage supervises the process and ends its descendants.
    pub(crate) fn is_supervised(&self) -> bool {
        cfg!(target_os = "linux")
    }

    /// Returns the process builder of a command line.
    pub(crate) fn command(&self, line: &str) -> std::process::Command {
        self.launcher.command(&self.policy, &self.isolation, line)
    }
}

/// Refuses paths that are not UTF-8, since the request to the sandbox is JSON.
fn check_names(policy: &Policy) -> Result<(), Refusal> {
    let mut paths = policy.readable.iter().chain(&policy.masked).chain([&policy.start_folder]);
    match paths.find(|path| path.to_str().is_none()) {
        Some(path) => Err(Refusal(format!(
            "{} is not UTF-8, so no helper process can be started; choose another name",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// Resolves links in an absolute path whose last parts may not exist yet.
fn resolve_links(path: &Path) -> PathBuf {
    let found =
        path.ancestors().find_map(|ancestor| Some((ancestor, ancestor.canonicalize().ok()?)));
    let Some((ancestor, real)) = found else { return path.to_owned() };
    path.strip_prefix(ancestor).map_or(real.clone(), |suffix| real.join(suffix))
}

fn describe(isolation: &Isolation) -> String {
    let Isolation::Sandboxed(missing) = isolation else { return isolation.to_string() };
    let reasons: Vec<String> = missing
        .iter()
        .map(|m| format!("{}: {}", m.part.name(), m.reason.trim_start_matches("chaic sandbox: ")))
        .collect();
    if missing.len() == IsolationPart::ALL.len() {
        return format!("no sandbox ({})", reasons.first().map_or("", String::as_str));
    }
    format!("a {isolation} ({})", reasons.join("; "))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_folder_behind_a_link_is_masked_by_its_real_name() {
        let top = tempfile::tempdir().unwrap();
        let top = top.path().canonicalize().unwrap();
        std::fs::create_dir(top.join("real")).unwrap();
        std::os::unix::fs::symlink(top.join("real"), top.join("link")).unwrap();
        assert_eq!(resolve_links(&top.join("link/runs/new")), top.join("real/runs/new"));
        assert_eq!(resolve_links(&top.join("link")), top.join("real"));
    }

    #[cfg(unix)]
    #[test]
    fn a_path_that_is_not_utf8_is_refused() {
        use std::os::unix::ffi::OsStrExt as _;
        let name = PathBuf::from(std::ffi::OsStr::from_bytes(b"runs/\xff"));
        let launcher = Launcher::new(["nowhere".into()]);
        for is_trusted in [false, true] {
            let masked = vec![name.clone()];
            let options = ConfinementOptions { is_trusted, masked, ..Default::default() };
            let refusal = Confinement::new(&launcher, "true", &Limits::default(), &options);
            assert!(refusal.unwrap_err().0.contains("is not UTF-8"), "{is_trusted}");
        }
    }
}
