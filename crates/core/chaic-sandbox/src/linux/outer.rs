//! Outer stage: enters namespaces, starts the inner stage and monitors it from outside.

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
use super::{SetupError, SetupResult, print_error};

use crate::policy::Policy;
use crate::request::{Mode, Request, Stage};

/// Interval of the memory and task checks. Within one interval, a process can fill about 200 MiB of
/// new memory.
const CHECK_INTERVAL: Duration = Duration::from_millis(20);
/// Exit status of a command that was killed at a limit, as a shell reports SIGKILL.
const KILLED: u8 = 128 + 9;

/// Runs the stage and returns the exit status of the command.
pub(super) fn run(request: &Request) -> SetupResult<u8> {
    close_inherited_descriptors()?;
    let termination_signal = termination_signal()?;
    if request.mode == Mode::Namespaces {
        enter_namespaces()?;
    } else {
        // Orphans of the command become children of this process, which finds and ends them.
        set_child_subreaper(Pid::from_raw(1)).map_err(SetupError::context("adopt orphans"))?;
    }
    let scratch = match request.mode {
        Mode::Process => {
            Some(tempfile::tempdir().map_err(SetupError::context("make a private folder"))?)
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
    let child = command.spawn().map_err(SetupError::context("start the command"))?;
    let monitor =
        Monitor { caller: request.parent, policy: &request.policy, child, termination_signal };
    let status = monitor.run();
    if request.mode != Mode::Namespaces {
        kill_descendants();
    }
    status
}

/// Blocks SIGTERM and returns a descriptor for polling it. Commands start with an empty signal
/// mask.
fn termination_signal() -> SetupResult<SignalFd> {
    let signals = SigSet::from(nix::sys::signal::Signal::SIGTERM);
    signals.thread_block().map_err(SetupError::context("block SIGTERM"))?;
    let flags = SfdFlags::SFD_NONBLOCK | SfdFlags::SFD_CLOEXEC;
    SignalFd::with_flags(&signals, flags).map_err(SetupError::context("wait for SIGTERM"))
}

/// Closes the descriptors of the caller's libraries, so that the command inherits only three
/// streams.
fn close_inherited_descriptors() -> SetupResult<()> {
    let step = || SetupError::context("list open descriptors");
    let open: Vec<RawFd> = fs::read_dir("/proc/self/fd")
        .map_err(step())?
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
        .filter(|fd| *fd > 2)
        .collect();
    for fd in open {
        // The descriptor of the listing itself is already closed.
        let _ = nix::unistd::close(fd);
    }
    Ok(())
}

/// Enters all namespaces except the mount namespace, because this process still needs the caller's
/// `/proc`.
fn enter_namespaces() -> SetupResult<()> {
    let (user, group) = (getuid().as_raw(), getgid().as_raw());
    let all = CloneFlags::CLONE_NEWUSER
        | CloneFlags::CLONE_NEWPID
        | CloneFlags::CLONE_NEWNET
        | CloneFlags::CLONE_NEWIPC
        | CloneFlags::CLONE_NEWUTS
        | CloneFlags::CLONE_NEWCGROUP;
    unshare(all).map_err(SetupError::context("enter new namespaces"))?;
    let write = |file: &str, text: String| {
        let path = format!("/proc/self/{file}");
        fs::write(&path, text).map_err(SetupError::context(format!("write {path}")))
    };
    write("setgroups", "deny".to_owned())?;
    write("uid_map", format!("0 {user} 1"))?;
    write("gid_map", format!("0 {group} 1"))
}

/// A running command and its limits.
struct Monitor<'a> {
    caller: u32,
    policy: &'a Policy,
    child: Child,
    termination_signal: SignalFd,
}

impl Monitor<'_> {
    /// Waits until the command ends, exceeds a limit, or is terminated.
    fn run(mut self) -> SetupResult<u8> {
        const STEP: &str = "watch the command";
        release_streams()?;
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let pid = pid.ok_or_else(|| std::io::Error::other("the process id is invalid"));
        let pid = pid.map_err(SetupError::context(STEP))?;
        let ended = pidfd_open(pid, PidfdFlags::empty()).map_err(SetupError::context(STEP))?;
        let interval = Timespec { tv_sec: 0, tv_nsec: CHECK_INTERVAL.as_nanos() as i64 };
        loop {
            let mut polled = [
                PollFd::from_borrowed_fd(ended.as_fd(), PollFlags::IN),
                PollFd::from_borrowed_fd(self.termination_signal.as_fd(), PollFlags::IN),
            ];
            // An interrupted wait only shortens the interval.
            let _ = poll(&mut polled, Some(&interval));
            let is_terminated = !polled[1].revents().is_empty();
            if let Some(status) = self.child.try_wait().map_err(SetupError::context(STEP))? {
                return Ok(status_byte(status));
            }
            let caller = getppid().map(|pid| pid.as_raw_nonzero().get().unsigned_abs());
            let is_orphan = caller != Some(self.caller);
            let excess = self.excess(pid);
            if is_terminated || is_orphan || excess.is_some() {
                self.kill(pid);
                if let Some(excess) = excess {
                    print_error(&excess);
                }
                return Ok(KILLED);
            }
        }
    }

    /// Returns a description of an exceeded limit.
    fn excess(&self, pid: Pid) -> Option<String> {
        let Policy { memory_mib, max_tasks, .. } = *self.policy;
        let usage = usage(pid);
        if usage.memory_kib > memory_mib.saturating_mul(1024) {
            let used = usage.memory_kib / 1024;
            return Some(format!(
                "the processes used {used} MiB of memory, limit {memory_mib} MiB"
            ));
        }
        (usage.tasks > u64::from(max_tasks))
            .then(|| format!("there were {} processes and threads, limit {max_tasks}", usage.tasks))
    }

    /// Kills the command. In a pid namespace, this ends every process in it.
    fn kill(&mut self, pid: Pid) {
        // The process may have ended already.
        let _ = kill_process(pid, Signal::KILL);
        let _ = self.child.wait();
    }
}

/// Replaces the standard input and output, so that only the command holds the caller's pipes.
fn release_streams() -> SetupResult<()> {
    const STEP: &str = "replace the standard streams by /dev/null";
    let null = File::options().read(true).write(true).open("/dev/null");
    let null = null.map_err(SetupError::context(STEP))?;
    dup2_stdin(&null).and_then(|()| dup2_stdout(&null)).map_err(SetupError::context(STEP))
}

fn status_byte(status: ExitStatus) -> u8 {
    let code = status.code().or_else(|| status.signal().map(|signal| 128 + signal));
    code.and_then(|code| u8::try_from(code).ok()).unwrap_or(KILLED)
}

/// Ends the remaining processes of the command if no pid namespace does it.
fn kill_descendants() {
    /// Number of passes, because a process that forks continuously may escape one pass.
    const PASSES: usize = 100;
    for _ in 0..PASSES {
        let remaining = descendants(getpid());
        if remaining.is_empty() {
            return;
        }
        for pid in remaining {
            let _ = kill_process(pid, Signal::KILL);
        }
        while let Ok(Some(_)) = wait(WaitOptions::NOHANG) {}
    }
}
