//! The inner stage: gives up all rights and becomes the shell.

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
use super::{Setup, SetupError, filter, root, usage};
use crate::isolation::{Isolation, MissingPart, Part};
use crate::launcher::{Mode, Request};
use crate::policy::{DEVICES, Policy, SYSTEM_FILES, SYSTEM_FOLDERS};

/// The shell script of the first process in the sandbox: it runs the command line, adopts and reaps orphans,
/// and ends with the command's exit status.
const INIT: &str = r#"exec 3<&0
sh -c "$1" sh <&3 3<&- &
exec 3<&- </dev/null >/dev/null
wait $!"#;

/// Open files of a process at most.
const MAX_FILES: u64 = 4096;

/// Sets the sandbox up and becomes the shell; returns only for a request without a command.
pub(super) fn run(request: &Request) -> Setup<u8> {
    set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(SetupError::of("ask to end with the outer stage"))?;
    let policy = &request.policy;
    let private = if request.mode == Mode::Namespaces { Some(root::build(policy)?) } else { None };
    let home = match (&private, &request.scratch) {
        (None, Some(scratch)) => scratch.clone(),
        (Some(writable), _) if !writable.contains(&PathBuf::from("/tmp")) => writable[0].clone(),
        _ => PathBuf::from("/tmp"),
    };
    let mut missing = Vec::new();
    limit(policy, &mut missing)?;
    drop_capabilities()?;
    let access = match private {
        Some(writable) => private_access(writable),
        None => shared_access(policy, home.clone()),
    };
    let mut note = |part, reason: String| missing.push(MissingPart { part, reason });
    match restrict(&access) {
        Ok(true) => {}
        Ok(false) => note(Part::Landlock, "the kernel has no Landlock".to_owned()),
        Err(e) => note(Part::Landlock, e.to_string()),
    }
    if let Err(e) = filter::apply(request.mode == Mode::Namespaces) {
        note(Part::Seccomp, e.to_string());
    }
    if let Some(lost) = missing.iter().find(|m| request.required.contains(&m.part)) {
        let refusal = std::io::Error::other(lost.reason.clone());
        return Err(SetupError { step: format!("enforce {}", lost.part.name()), refusal });
    }
    let start = Some(&policy.start_folder).filter(|folder| folder.is_dir()).unwrap_or(&home);
    std::env::set_current_dir(start)
        .map_err(SetupError::of(format!("enter {}", start.display())))?;
    let Some(line) = &request.line else {
        let report = serde_json::to_vec(&Isolation::Sandboxed(missing)).unwrap_or_default();
        let mut out = std::io::stdout();
        // An interpreter that runs this stage does not flush it at its end.
        out.write_all(&report).and_then(|()| out.flush()).map_err(SetupError::of("report"))?;
        return Ok(0);
    };
    let mut shell = Command::new("/bin/sh");
    shell.args(["-c", INIT, "sh", line]).env("HOME", &home).env("TMPDIR", &home);
    Err(SetupError::of("run /bin/sh")(shell.exec()))
}

/// Bounds each process; the outer stage bounds their sum.
fn limit(policy: &Policy, missing: &mut Vec<MissingPart>) -> Setup<()> {
    let bound = |resource: Resource, most: u64| {
        let held = getrlimit(resource).maximum;
        let most = held.map_or(most, |held| held.min(most));
        setrlimit(resource, Rlimit { current: Some(most), maximum: Some(most) })
            .map_err(SetupError::of("set a resource limit"))
    };
    bound(Resource::Data, policy.memory_mib.saturating_mul(1 << 20))?;
    bound(Resource::Core, 0)?;
    bound(Resource::Nofile, MAX_FILES)?;
    bound(Resource::Memlock, 1 << 20)?;
    if !usage::is_available() {
        let reason = "the kernel lists no children in /proc, so that sums are not bounded";
        missing.push(MissingPart { part: Part::Limits, reason: reason.to_owned() });
    }
    Ok(())
}

/// Gives up all capabilities for good, also those that the root user would get back.
fn drop_capabilities() -> Setup<()> {
    let step = || SetupError::of("give up capabilities");
    let none = CapabilitySet::empty();
    let has_any = rustix::thread::capabilities(None).map_err(step())?.permitted != none;
    if has_any {
        let bits = CapabilitiesSecureBits::NO_ROOT
            | CapabilitiesSecureBits::NO_ROOT_LOCKED
            | CapabilitiesSecureBits::NO_SETUID_FIXUP
            | CapabilitiesSecureBits::NO_SETUID_FIXUP_LOCKED;
        set_capabilities_secure_bits(bits).map_err(step())?;
        for bit in 0..64 {
            // The kernel knows fewer than 64.
            let _ = remove_capability_from_bounding_set(CapabilitySet::from_bits_retain(1 << bit));
        }
        clear_ambient_capability_set().map_err(step())?;
        let sets = CapabilitySets { effective: none, permitted: none, inheritable: none };
        set_capabilities(None, sets).map_err(step())?;
    }
    set_no_new_privs(true).map_err(step())
}

/// Access within a private root folder, which holds nothing but what may be read.
fn private_access(writable: Vec<PathBuf>) -> Access {
    let devices = DEVICES.iter().map(PathBuf::from).collect();
    Access { read: vec!["/".into()], write: writable, devices }
}

/// Access within the file system that the command shares with the caller.
fn shared_access(policy: &Policy, scratch: PathBuf) -> Access {
    let system = SYSTEM_FOLDERS.iter().chain(SYSTEM_FILES).map(PathBuf::from);
    let devices = DEVICES.iter().map(PathBuf::from).collect();
    Access { read: system.chain(policy.readable.clone()).collect(), write: vec![scratch], devices }
}
