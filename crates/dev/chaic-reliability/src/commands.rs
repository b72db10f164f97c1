//! Runs the command `chaic` in separate processes, with or without a fault.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context as _, Result, bail};
use chaic_files::TEMPORARY_SUFFIX;
use chaic_files::faults::{self, FaultKind, FaultPlan, Operation};
use chaic_sandbox::Launcher;

use crate::command_output::CommandOutput;

/// Suffix of the names of temporary files in lists of operations and in fault plans. It replaces the
/// process id, which differs in every process.
const PROCESS_SUFFIX: &str = ".PROCESS.tmp";

/// Returns the command line of this program as `chaic`, in a folder.
pub fn chaic(folder: &Path, fault: Option<&FaultPlan>, log: Option<&Path>) -> Result<Command> {
    let program = std::env::current_exe().context("can't find this program")?;
    let mut command = Command::new(program);
    // A crash leaves temporary files, which are removed with the folder.
    command.current_dir(folder).env("TMPDIR", folder).stdin(Stdio::null()).arg("chaic");
    if let Some(FaultPlan { path, index, kind }) = fault {
        command.args(["--fault", kind.name(), "--at", &index.to_string()]).arg("--path").arg(path);
    }
    if let Some(log) = log {
        command.arg("--log").arg(log);
    }
    command.arg("--");
    Ok(command)
}

/// Runs `chaic` in a folder until it ends.
///
/// # Errors
/// If the process cannot be started.
pub fn run(folder: &Path, arguments: &[&str], fault: Option<&FaultPlan>) -> Result<CommandOutput> {
    let output = chaic(folder, fault, None)?.args(arguments).output().context("can't start")?;
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    Ok(CommandOutput { code: output.status.code(), stdout, stderr })
}

/// Runs `chaic` in a folder; it must succeed.
///
/// # Errors
/// If it fails.
pub fn run_ok(folder: &Path, arguments: &[&str]) -> Result<CommandOutput> {
    let ended = run(folder, arguments, None)?;
    if ended.code != Some(0) {
        let code = ended.code;
        bail!("`chaic {}`: exit code {code:?}: {}", arguments.join(" "), ended.stderr.trim());
    }
    Ok(ended)
}

/// File operation of a command.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FileOperation {
    /// The file or folder that it changes. Process ids are left out.
    pub path: String,
    /// Index among the operations on this path, from 0.
    pub index: usize,
    /// Name of its kind.
    pub kind: String,
}

/// Runs `chaic` in a folder, and returns its file operations, sorted: threads may change their order.
///
/// Scenarios name their files relative to the folder. Files with absolute paths are temporary and have random
/// names, so their operations are left out.
///
/// # Errors
/// If it fails.
pub fn operations(folder: &Path, arguments: &[&str], log: &Path) -> Result<Vec<FileOperation>> {
    let output = chaic(folder, None, Some(log))?.args(arguments).output().context("can't start")?;
    if !output.status.success() {
        let stderr = String::from_utf8_lossy(&output.stderr);
        bail!("`chaic {}` without faults: {}", arguments.join(" "), stderr.trim());
    }
    let text = std::fs::read_to_string(log).context("can't read the list of operations")?;
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut found = Vec::new();
    let records = text.lines().filter_map(|line| line.split_once('\t'));
    for (kind, path) in records.filter(|(_, path)| Path::new(path).is_relative()) {
        let count = counts.entry(path).or_default();
        found.push(FileOperation { path: path.to_owned(), index: *count, kind: kind.to_owned() });
        *count += 1;
    }
    found.sort();
    Ok(found)
}

/// Runs the command `chaic` in this process, with a fault.
pub fn run_chaic(
    fault: Option<FaultPlan>,
    log: Option<&Path>,
    arguments: Vec<OsString>,
) -> ExitCode {
    if fault.is_some() || log.is_some() {
        let with_id = |plan: FaultPlan| FaultPlan { path: with_process_id(plan.path), ..plan };
        faults::install(fault.map(with_id));
    }
    let arguments = std::iter::once("chaic".into()).chain(arguments);
    let code = chaic::run(arguments, &Launcher::this_program());
    if let Some(log) = log {
        let text = faults::operations().iter().fold(String::new(), |mut text, record| {
            let _ = writeln!(text, "{:?}\t{}", record.operation, without_process_id(&record.path));
            text
        });
        if let Err(error) = std::fs::write(log, text) {
            eprintln!("error: can't write {}: {error}", log.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::from(code)
}

/// Returns the suffix of the names of this process's temporary files.
fn this_process_suffix() -> String {
    format!(".{}{TEMPORARY_SUFFIX}", std::process::id())
}

/// Replaces the id of this process at the end of a path by [`PROCESS_SUFFIX`].
fn without_process_id(path: &Path) -> String {
    let text = path.display().to_string();
    let stem =
        text.strip_suffix(&this_process_suffix()).map(|stem| format!("{stem}{PROCESS_SUFFIX}"));
    stem.unwrap_or(text)
}

/// Replaces [`PROCESS_SUFFIX`] at the end of a path by the id of this process.
fn with_process_id(path: PathBuf) -> PathBuf {
    let stem = path.to_str().and_then(|text| text.strip_suffix(PROCESS_SUFFIX));
    stem.map(|stem| PathBuf::from(format!("{stem}{}", this_process_suffix()))).unwrap_or(path)
}

impl FileOperation {
    /// Returns whether the operation can fail in this way.
    pub fn can_fail(&self, kind: FaultKind) -> bool {
        let is_named = |o: &Operation| format!("{o:?}") == self.kind;
        Operation::ALL.into_iter().find(is_named).is_some_and(|o| kind.applies_to(o))
    }
}
