//! How the process of a helper is confined: in a sandbox, or trusted by its user.

use std::path::{Path, PathBuf};

use chaic_sandbox::{Isolation, Launcher, Part, Policy};

use crate::commands::{Limits, Refusal};

/// What a user chooses about the confinement of commands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfinementOptions {
    /// Runs commands with all rights of the user.
    pub is_trusted: bool,
    /// Files and folders that commands can read besides the system folders and what their lines name.
    pub readable: Vec<PathBuf>,
    /// Folders that stay empty for commands, such as that of the run.
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
    /// Decides what a command line can read and finds out what the system enforces.
    ///
    /// # Errors
    /// [`Refusal`] if a path is not there or the launcher cannot be started.
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
        // A command reaches a masked folder by its real name too.
        let masked = masked.map(|paths| {
            let real: Vec<PathBuf> = paths.iter().map(|path| resolved(path)).collect();
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
            let isolation = Isolation::Trusted;
            return Ok(Confinement { launcher: launcher.clone(), policy, isolation });
        }
        options.readable.iter().try_for_each(|p| policy.add_readable(p)).map_err(|e| refuse(&e))?;
        policy.add_named_by(line);
        let isolation = launcher.probe(&policy).map_err(|e| refuse(&e))?;
        Ok(Confinement { launcher: launcher.clone(), policy, isolation })
    }

    /// Returns what the system enforces.
    pub fn isolation(&self) -> &Isolation {
        &self.isolation
    }

    /// Returns the missing parts in words, for a warning; `None` if there are none, or by the user's choice.
    pub fn warning(&self) -> Option<String> {
        let Isolation::Sandboxed(missing) = &self.isolation else { return None };
        (!missing.is_empty()).then(|| in_words(&self.isolation))
    }

    /// Returns whether a stage of the sandbox watches the process and ends all that it leaves behind.
    pub(crate) fn is_watched(&self) -> bool {
        cfg!(target_os = "linux")
    }

    /// Returns the process that runs a command line.
    pub(crate) fn command(&self, line: &str) -> std::process::Command {
        self.launcher.command(&self.policy, &self.isolation, line)
    }
}

/// Resolves links in an absolute path of which the last parts may not exist yet.
fn resolved(path: &Path) -> PathBuf {
    let found =
        path.ancestors().find_map(|ancestor| Some((ancestor, ancestor.canonicalize().ok()?)));
    let Some((ancestor, real)) = found else { return path.to_owned() };
    path.strip_prefix(ancestor).map_or(real.clone(), |rest| real.join(rest))
}

fn in_words(isolation: &Isolation) -> String {
    let Isolation::Sandboxed(missing) = isolation else { return isolation.to_string() };
    let reasons: Vec<String> = missing
        .iter()
        .map(|m| format!("{}: {}", m.part.name(), m.reason.trim_start_matches("chaic sandbox: ")))
        .collect();
    if missing.len() == Part::ALL.len() {
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
        assert_eq!(resolved(&top.join("link/runs/new")), top.join("real/runs/new"));
        assert_eq!(resolved(&top.join("link")), top.join("real"));
    }
}
