//! The outer stage: enters namespaces, starts the inner stage and watches it from outside.

use std::fs::{self, File};
use std::os::fd::{AsFd as _, RawFd};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, Command, ExitStatus};
use std::time::Duration;

use nix::sched::{CloneFlags, unshare};
use nix::sys::signal::SigSet;
use nix::sys::signalfd::{SfdFlags, SignalFd};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitOptions, getgid, getpid, getppid, getuid, kill_process,
    pidfd_open, set_child_subreaper, wait,
};
use rustix::stdio::{dup2_stdin, dup2_stdout};

use super::usage::{descendants, usage};
use super::{Setup, SetupError, complain};
use crate::launcher::{Mode, Request, Stage};
use crate::policy::Policy;

/// Time between two looks at memory and tasks: in this time a process writes to some 200 MiB of new memory.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Exit status of a command that was killed at a limit; as a shell gives it for SIGKILL.
const KILLED: u8 = 128 + 9;

/// Runs the stage and returns the exit status of the command.
pub(super) fn run(request: &Request) -> Setup<u8> {
    close_inherited_descriptors()?;
    let asked_to_end = asked_to_end()?;
    if request.mode == Mode::Namespaces {
        enter_namespaces()?;
    } else {
        // Orphans of the command come here, where they are found and ended.
        set_child_subreaper(Pid::from_raw(1)).map_err(SetupError::of("adopt orphans"))?;
    }
    let scratch = match request.mode {
        Mode::Process => {
            Some(tempfile::tempdir().map_err(SetupError::of("make a private folder"))?)
        }
        Mode::Trusted | Mode::Namespaces => None,
    };
    let mut command = match (request.mode, &request.line) {
        (Mode::Trusted, Some(line)) => {
            let mut shell = Command::new("/bin/sh");
            shell.args(["-c", line]);
            shell
        }
        _ => {
            let scratch = scratch.as_ref().map(|folder| folder.path().to_owned());
            Request { stage: Stage::Inner, scratch, ..request.clone() }.command()
        }
    };
    let child = command.spawn().map_err(SetupError::of("start the command"))?;
    let watch = Watch { caller: request.parent, policy: &request.policy, child, asked_to_end };
    let status = watch.run();
    if request.mode != Mode::Namespaces {
        kill_descendants();
    }
    status
}

/// Turns SIGTERM into something to poll. Commands start with an empty signal mask all the same.
fn asked_to_end() -> Setup<SignalFd> {
    let signals = SigSet::from(nix::sys::signal::Signal::SIGTERM);
    signals.thread_block().map_err(SetupError::of("hold back SIGTERM"))?;
    let flags = SfdFlags::SFD_NONBLOCK | SfdFlags::SFD_CLOEXEC;
    SignalFd::with_flags(&signals, flags).map_err(SetupError::of("wait for SIGTERM"))
}

/// Closes what the caller's libraries left open, so that the command inherits its three streams only.
fn close_inherited_descriptors() -> Setup<()> {
    let step = || SetupError::of("list open descriptors");
    let open: Vec<RawFd> = fs::read_dir("/proc/self/fd")
        .map_err(step())?
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
        .filter(|fd| *fd > 2)
        .collect();
    for fd in open {
        // The descriptor of the listing itself is closed already.
        let _ = nix::unistd::close(fd);
    }
    Ok(())
}

/// Enters all namespaces but the mount namespace: this process still needs the caller's `/proc`.
fn enter_namespaces() -> Setup<()> {
    let (user, group) = (getuid().as_raw(), getgid().as_raw());
    let all = CloneFlags::CLONE_NEWUSER
        | CloneFlags::CLONE_NEWPID
        | CloneFlags::CLONE_NEWNET
        | CloneFlags::CLONE_NEWIPC
        | CloneFlags::CLONE_NEWUTS
        | CloneFlags::CLONE_NEWCGROUP;
    unshare(all).map_err(SetupError::of("enter new namespaces"))?;
    let write = |file: &str, text: String| {
        let path = format!("/proc/self/{file}");
        fs::write(&path, text).map_err(SetupError::of(format!("write {path}")))
    };
    write("setgroups", "deny".to_owned())?;
    write("uid_map", format!("0 {user} 1"))?;
    write("gid_map", format!("0 {group} 1"))
}

/// A running command and its limits.
struct Watch<'a> {
    caller: u32,
    policy: &'a Policy,
    child: Child,
    asked_to_end: SignalFd,
}

impl Watch<'_> {
    /// Waits until the command ends, exceeds a limit, or is to end.
    fn run(mut self) -> Setup<u8> {
        const STEP: &str = "watch the command";
        release_streams()?;
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let pid = pid.ok_or_else(|| std::io::Error::other("it has no number"));
        let pid = pid.map_err(SetupError::of(STEP))?;
        let ended = pidfd_open(pid, PidfdFlags::empty()).map_err(SetupError::of(STEP))?;
        let every = Timespec { tv_sec: 0, tv_nsec: LOOK_EVERY.as_nanos() as i64 };
        loop {
            let mut polled = [
                PollFd::from_borrowed_fd(ended.as_fd(), PollFlags::IN),
                PollFd::from_borrowed_fd(self.asked_to_end.as_fd(), PollFlags::IN),
            ];
            // An interrupted wait is a short one.
            let _ = poll(&mut polled, Some(&every));
            let is_asked = !polled[1].revents().is_empty();
            if let Some(status) = self.child.try_wait().map_err(SetupError::of(STEP))? {
                return Ok(status_byte(status));
            }
            let caller = getppid().map(|pid| pid.as_raw_nonzero().get().unsigned_abs());
            let is_orphan = caller != Some(self.caller);
            let excess = self.excess(pid);
            if is_asked || is_orphan || excess.is_some() {
                self.kill(pid);
                if let Some(excess) = excess {
                    complain(&excess);
                }
                return Ok(KILLED);
            }
        }
    }

    /// Returns which limit the command exceeds.
    fn excess(&self, pid: Pid) -> Option<String> {
        let Policy { memory_mib, max_tasks, .. } = *self.policy;
        let usage = usage(pid);
        if usage.memory_kib > memory_mib.saturating_mul(1024) {
            let used = usage.memory_kib / 1024;
            return Some(format!(
                "the processes held {used} MiB of memory, limit {memory_mib} MiB"
            ));
        }
        (usage.tasks > u64::from(max_tasks))
            .then(|| format!("there were {} processes and threads, limit {max_tasks}", usage.tasks))
    }

    /// Kills the command. In a pid namespace, this ends every process in it.
    fn kill(&mut self, pid: Pid) {
        // It may have ended on its own.
        let _ = kill_process(pid, Signal::KILL);
        let _ = self.child.wait();
    }
}

/// Replaces the standard input and output, so that the command alone holds the caller's pipes.
fn release_streams() -> Setup<()> {
    const STEP: &str = "replace the standard streams by /dev/null";
    let null = File::options().read(true).write(true).open("/dev/null");
    let null = null.map_err(SetupError::of(STEP))?;
    dup2_stdin(&null).and_then(|()| dup2_stdout(&null)).map_err(SetupError::of(STEP))
}

fn status_byte(status: ExitStatus) -> u8 {
    let code = status.code().or_else(|| status.signal().map(|signal| 128 + signal));
    code.and_then(|code| u8::try_from(code).ok()).unwrap_or(KILLED)
}

/// Ends what the command left behind, without a namespace that would do it.
fn kill_descendants() {
    /// A process that forks all the time may escape one pass.
    const PASSES: usize = 100;
    for _ in 0..PASSES {
        let left = descendants(getpid());
        if left.is_empty() {
            return;
        }
        for pid in left {
            let _ = kill_process(pid, Signal::KILL);
        }
        while let Ok(Some(_)) = wait(WaitOptions::NOHANG) {}
    }
}
