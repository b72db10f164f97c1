//! Injection of faults into file operations, for tests.
//!
//! A test program installs one [`FaultPlan`] for its process and then calls the code under test.
//! Operations are numbered from 0 for each path, so the numbers do not depend on other threads. No
//! option, environment variable or feature installs a plan, so a user cannot do so by accident.
//!
//! **Limits**: a power failure keeps all finished renames, removals and new folders, as a journaling
//! file system does. The removal of a folder with its content is one operation.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process;
use std::str::FromStr;
use std::sync::{Mutex, OnceLock, PoisonError};

/// Exit code of a process that a fault ended.
pub const CRASHED: i32 = 86;

/// Error number of a full disk on Linux (`ENOSPC`).
const NO_SPACE: i32 = 28;
/// Error number of a failed device on Linux (`EIO`).
const IO_ERROR: i32 = 5;

/// Kind of a file operation that changes the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// A file is opened for writing, and created if it is missing.
    Open,
    /// A folder is created.
    CreateFolder,
    /// Bytes are written to a file.
    Write,
    /// The length of a file is set.
    SetLength,
    /// A file is flushed to the device.
    Sync,
    /// A file is renamed or gets a second name.
    Rename,
    /// A file or folder is removed.
    Remove,
}

impl Operation {
    /// All kinds.
    pub const ALL: [Operation; 7] = [
        Operation::Open,
        Operation::CreateFolder,
        Operation::Write,
        Operation::SetLength,
        Operation::Sync,
        Operation::Rename,
        Operation::Remove,
    ];
}

/// Kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The disk is full from this operation on (`ENOSPC`).
    NoSpace,
    /// This operation alone fails (`EIO`).
    IoError,
    /// This write stores half of its bytes and reports so.
    ShortWrite,
    /// The process ends after this write stored half of its bytes.
    TornWrite,
    /// The process ends before this operation.
    CrashBefore,
    /// The process ends after this operation.
    CrashAfter,
    /// Power fails after this operation: the process ends, and files lose all bytes that were not
    /// flushed. A renamed file that was not flushed is torn, also in a renamed folder.
    PowerFailure,
}

/// A fault and the operation at which it occurs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultPlan {
    /// The file or folder that the operation changes, as in [`OperationRecord::path`].
    pub path: PathBuf,
    /// Number of the operation among those on this path, from 0.
    pub index: usize,
    /// Kind of the fault.
    pub kind: FaultKind,
}

/// A recorded operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OperationRecord {
    /// Kind of the operation.
    pub operation: Operation,
    /// The file or folder that it changes; the old name for a rename.
    pub path: PathBuf,
}

impl FaultKind {
    /// All kinds.
    pub const ALL: [FaultKind; 7] = [
        FaultKind::NoSpace,
        FaultKind::IoError,
        FaultKind::ShortWrite,
        FaultKind::TornWrite,
        FaultKind::CrashBefore,
        FaultKind::CrashAfter,
        FaultKind::PowerFailure,
    ];

    /// Returns the name for the command line.
    pub fn name(self) -> &'static str {
        match self {
            FaultKind::NoSpace => "no-space",
            FaultKind::IoError => "io-error",
            FaultKind::ShortWrite => "short-write",
            FaultKind::TornWrite => "torn-write",
            FaultKind::CrashBefore => "crash-before",
            FaultKind::CrashAfter => "crash-after",
            FaultKind::PowerFailure => "power-failure",
        }
    }

    /// Returns whether an operation of this kind can fail in this way.
    pub fn applies_to(self, operation: Operation) -> bool {
        match self {
            FaultKind::NoSpace => !matches!(operation, Operation::SetLength | Operation::Remove),
            FaultKind::ShortWrite | FaultKind::TornWrite => operation == Operation::Write,
            FaultKind::IoError
            | FaultKind::CrashBefore
            | FaultKind::CrashAfter
            | FaultKind::PowerFailure => true,
        }
    }

    /// Returns whether the fault ends the process.
    pub fn ends_process(self) -> bool {
        !matches!(self, FaultKind::NoSpace | FaultKind::IoError | FaultKind::ShortWrite)
    }
}

impl FromStr for FaultKind {
    type Err = String;

    fn from_str(text: &str) -> Result<FaultKind, String> {
        let found = FaultKind::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| {
            let names = FaultKind::ALL.map(FaultKind::name).join(", ");
            format!("no fault `{text}`; the faults are {names}")
        })
    }
}

/// Counter of operations with the fault of this process.
struct Injector {
    plan: Option<FaultPlan>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    operations: Vec<OperationRecord>,
    /// True once the disk is full.
    is_full: bool,
    /// Flushed length of each file that has unflushed bytes.
    flushed_len: BTreeMap<PathBuf, u64>,
}

impl State {
    /// Moves the flushed lengths of a renamed file, or of the files in a renamed folder.
    fn rename(&mut self, from: &Path, to: &Path) {
        let new_path = |path: &Path| match path.strip_prefix(from) {
            Ok(below) if below.as_os_str().is_empty() => to.to_owned(),
            Ok(below) => to.join(below),
            Err(_) => path.to_owned(),
        };
        let kept = std::mem::take(&mut self.flushed_len).into_iter();
        let kept = kept.filter(|(path, _)| !path.starts_with(to));
        self.flushed_len = kept.map(|(path, len)| (new_path(&path), len)).collect();
    }
}

static INJECTOR: OnceLock<Injector> = OnceLock::new();

/// Records the operations of this process from now on, and lets one of them fail. Returns false if
/// an earlier call installed a plan, which stays.
pub fn install(plan: Option<FaultPlan>) -> bool {
    INJECTOR.set(Injector { plan, state: Mutex::default() }).is_ok()
}

/// Returns the operations since [`install`].
pub fn operations() -> Vec<OperationRecord> {
    let state = |injector: &Injector| {
        injector.state.lock().unwrap_or_else(PoisonError::into_inner).operations.clone()
    };
    INJECTOR.get().map(state).unwrap_or_default()
}

/// Performs an operation other than a write and a rename.
pub(crate) fn perform<T>(
    operation: Operation,
    path: &Path,
    action: impl FnOnce() -> io::Result<T>,
) -> io::Result<T> {
    match INJECTOR.get() {
        None => action(),
        Some(injector) => injector.perform(operation, path, action, |state| match operation {
            Operation::Sync | Operation::Remove => {
                state.flushed_len.remove(path);
            }
            _ => {}
        }),
    }
}

/// Performs a rename or a link.
pub(crate) fn perform_rename(
    from: &Path,
    to: &Path,
    action: impl FnOnce() -> io::Result<()>,
) -> io::Result<()> {
    match INJECTOR.get() {
        None => action(),
        Some(injector) => {
            injector.perform(Operation::Rename, from, action, |state| state.rename(from, to))
        }
    }
}

/// Performs a write of bytes to an open file.
pub(crate) fn perform_write(
    path: &Path,
    file: &File,
    bytes: &[u8],
    action: impl FnOnce(&[u8]) -> io::Result<usize>,
) -> io::Result<usize> {
    let Some(injector) = INJECTOR.get() else { return action(bytes) };
    let len_before = file.metadata()?.len();
    let half = &bytes[..bytes.len().div_ceil(2)];
    injector.perform_with_fault(Operation::Write, path, |state, fault| {
        state.flushed_len.entry(path.to_owned()).or_insert(len_before);
        match fault {
            Some(FaultKind::ShortWrite) => action(half),
            Some(FaultKind::TornWrite) => {
                let _ = action(half);
                process::exit(CRASHED)
            }
            _ => action(bytes),
        }
    })
}

impl Injector {
    fn perform<T>(
        &self,
        operation: Operation,
        path: &Path,
        action: impl FnOnce() -> io::Result<T>,
        record: impl FnOnce(&mut State),
    ) -> io::Result<T> {
        self.perform_with_fault(operation, path, |state, _| {
            let result = action()?;
            record(state);
            Ok(result)
        })
    }

    /// Performs an operation. Other threads wait, so no operation follows one that ends the process.
    fn perform_with_fault<T>(
        &self,
        operation: Operation,
        path: &Path,
        action: impl FnOnce(&mut State, Option<FaultKind>) -> io::Result<T>,
    ) -> io::Result<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let index = state.operations.iter().filter(|record| record.path == path).count();
        state.operations.push(OperationRecord { operation, path: path.to_owned() });
        let is_now = |plan: &&FaultPlan| plan.path == path && plan.index == index;
        let mut fault = self.plan.as_ref().filter(is_now).map(|plan| plan.kind);
        state.is_full |= fault == Some(FaultKind::NoSpace);
        if state.is_full {
            fault = Some(FaultKind::NoSpace);
        }
        let fault = fault.filter(|kind| kind.applies_to(operation));
        match fault {
            Some(FaultKind::NoSpace) => return Err(io::Error::from_raw_os_error(NO_SPACE)),
            Some(FaultKind::IoError) => return Err(io::Error::from_raw_os_error(IO_ERROR)),
            Some(FaultKind::CrashBefore) => process::exit(CRASHED),
            _ => {}
        }
        let result = action(&mut state, fault);
        match fault {
            Some(FaultKind::CrashAfter) => process::exit(CRASHED),
            Some(FaultKind::PowerFailure) => {
                drop_unflushed(&state);
                process::exit(CRASHED)
            }
            _ => result,
        }
    }
}

/// Removes the bytes that a power failure loses.
fn drop_unflushed(state: &State) {
    for (path, len) in &state.flushed_len {
        let cut = fs::OpenOptions::new().write(true).open(path).and_then(|file| file.set_len(*len));
        // A removed file has lost its bytes already. Any other error would make the test wrong.
        match cut {
            Err(error) if error.kind() != io::ErrorKind::NotFound => process::abort(),
            _ => {}
        }
    }
}
