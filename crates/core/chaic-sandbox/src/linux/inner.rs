//! Inner stage: drops all rights and becomes the shell.

use std::io::Write as _;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::Command;

use rustix::process::{
    Resource, Rlimit, Signal, getrlimit, set_parent_process_death_signal, setrlimit,
};
use rustix::thread::{
    CapabilitiesSecureBits, CapabilitySet, CapabilitySets, clear_ambient_capability_set,
    remove_capability_from_bounding_set, set_capabilities, set_capabilities_secure_bits,
    set_no_new_privs,
};

use super::landlock::{Access, restrict};
use super::{SetupError, SetupResult, filter, root, shared, usage};
use crate::isolation::{Isolation, IsolationPart, MissingPart};
use crate::policy::{DEVICES, Policy};
use crate::request::{Mode, Request};

/// Shell script of the first process in the sandbox. It runs the command line, adopts and reaps
/// orphans, and ends with the command's exit status.
const INIT: &str = r#"exec 3<&0
sh -c "$1" sh <&3 3<&- &
exec 3<&- </dev/null >/dev/null
wait $!"#;

/// Maximum number of open files per process.
const MAX_FILES: u64 = 4096;

/// Sets up the sandbox and becomes the shell; returns only for a request without a command.
pub(super) fn run(request: &Request) -> SetupResult<u8> {
    set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(SetupError::context("set the parent death signal"))?;
    let policy = &request.policy;
    let writable = if request.mode == Mode::Namespaces { Some(root::build(policy)?) } else { None };
    let home = match (&writable, &request.scratch) {
        (None, Some(scratch)) => scratch.clone(),
        (Some(writable), _) if !writable.contains(&PathBuf::from("/tmp")) => writable[0].clone(),
        _ => PathBuf::from("/tmp"),
    };
    let mut missing = Vec::new();
    set_limits(policy, &mut missing)?;
    drop_capabilities()?;
    let access = match writable {
        Some(writable) => private_access(writable),
        None => shared::access(policy, home.clone()),
    };
    let mut add_missing = |part, reason: String| missing.push(MissingPart { part, reason });
    match restrict(&access) {
        Ok(true) => {}
        Ok(false) => add_missing(IsolationPart::Landlock, "the kernel has no Landlock".to_owned()),
        Err(e) => add_missing(IsolationPart::Landlock, e.to_string()),
    }
    if let Err(e) = filter::apply(request.mode == Mode::Namespaces) {
        add_missing(IsolationPart::Seccomp, e.to_string());
    }
    if let Some(required) = missing.iter().find(|m| request.required.contains(&m.part)) {
        let error = std::io::Error::other(required.reason.clone());
        return Err(SetupError { step: format!("enforce {}", required.part.name()), error });
    }
    let start = Some(&policy.start_folder).filter(|folder| folder.is_dir()).unwrap_or(&home);
    std::env::set_current_dir(start)
        .map_err(SetupError::context(format!("enter {}", start.display())))?;
    let Some(line) = &request.line else {
        let report = serde_json::to_vec(&Isolation::Sandboxed(missing)).unwrap_or_default();
        let mut out = std::io::stdout();
        // An interpreter that runs this stage does not flush the stream at its end.
        out.write_all(&report).and_then(|()| out.flush()).map_err(SetupError::context("report"))?;
        return Ok(0);
    };
    let mut shell = Command::new("/bin/sh");
    shell.args(["-c", INIT, "sh", line]).env("HOME", &home).env("TMPDIR", &home);
    Err(SetupError::context("run /bin/sh")(shell.exec()))
}

/// Limits each process; the outer stage limits their sum.
fn set_limits(policy: &Policy, missing: &mut Vec<MissingPart>) -> SetupResult<()> {
    let set_limit = |resource: Resource, max: u64| {
        let current_max = getrlimit(resource).maximum;
        let max = current_max.map_or(max, |current| current.min(max));
        setrlimit(resource, Rlimit { current: Some(max), maximum: Some(max) })
            .map_err(SetupError::context("set a resource limit"))
    };
    set_limit(Resource::Data, policy.memory_mib.saturating_mul(1 << 20))?;
    set_limit(Resource::Core, 0)?;
    set_limit(Resource::Nofile, MAX_FILES)?;
    set_limit(Resource::Memlock, 1 << 20)?;
    if !usage::is_available() {
        let reason = "the kernel lists no children in /proc, so sums are not limited";
        missing.push(MissingPart { part: IsolationPart::Limits, reason: reason.to_owned() });
    }
    Ok(())
}

/// Drops all capabilities permanently, including those that the root user would regain.
fn drop_capabilities() -> SetupResult<()> {
    let step = || SetupError::context("drop capabilities");
    let none = CapabilitySet::empty();
    let has_any = rustix::thread::capabilities(None).map_err(step())?.permitted != none;
    if has_any {
        let bits = CapabilitiesSecureBits::NO_ROOT
            | CapabilitiesSecureBits::NO_ROOT_LOCKED
            | CapabilitiesSecureBits::NO_SETUID_FIXUP
            | CapabilitiesSecureBits::NO_SETUID_FIXUP_LOCKED;
        set_capabilities_secure_bits(bits).map_err(step())?;
        for bit in 0..64 {
            // The kernel defines fewer than 64.
            let _ = remove_capability_from_bounding_set(CapabilitySet::from_bits_retain(1 << bit));
        }
        clear_ambient_capability_set().map_err(step())?;
        let sets = CapabilitySets { effective: none, permitted: none, inheritable: none };
        set_capabilities(None, sets).map_err(step())?;
    }
    set_no_new_privs(true).map_err(step())
}

/// Returns the access within a private root folder, which contains only readable paths.
fn private_access(writable: Vec<PathBuf>) -> Access {
    let devices = DEVICES.iter().map(PathBuf::from).collect();
    Access { read: vec!["/".into()], write: writable, devices }
}
