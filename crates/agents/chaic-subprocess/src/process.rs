//! A process with pipes, deadlines and limits.

use std::io::{Read, Write};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use chaic_core::AgentError;
use chaic_sandbox::Isolation;
#[cfg(unix)]
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, kill_process, kill_process_group, waitid,
};

use crate::commands::Command;
use crate::environment::inherited;
use crate::frame::Frame;
use crate::message::{ToEnv, ToMind, cut, message, plain};
use crate::pipe::Pipe;

/// How often one who waits looks whether it is to stop.
const LOOK: Duration = Duration::from_millis(50);
/// How long a process may take to end by itself when it is told to.
const GRACE: Duration = Duration::from_secs(2);
/// How much of what it said last on its standard error is kept, bytes.
const KEPT_ERRORS: usize = 2000;

/// A running command.
pub(crate) struct Process {
    child: Child,
    to: Option<Sender<Frame>>,
    from: Receiver<Result<Frame, String>>,
    errors: Arc<Mutex<Vec<u8>>>,
    /// Closed once all of its complaints are there.
    no_more_errors: Receiver<()>,
    command: Arc<Command>,
    /// Raised when nobody reads or writes its pipes any more: their threads end then.
    is_over: Arc<AtomicBool>,
    /// How long it has been waited for, in all.
    waited: Duration,
    stop: &'static AtomicBool,
}

impl Process {
    /// Starts the command.
    pub fn start(command: &Arc<Command>, stop: &'static AtomicBool) -> Result<Process, AgentError> {
        let mut starting = starting(command);
        starting.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        starting.env_clear().envs(inherited(&command.environment));
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut starting, 0);
        let failed =
            |e: std::io::Error| AgentError::Broken(format!("a process can't be started: {e}"));
        let mut child = starting.spawn().map_err(failed)?;
        let (stdin, stdout, stderr) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(stdin), Some(stdout), Some(stderr)) = (stdin, stdout, stderr) else {
            return Err(AgentError::Broken("a process without pipes".to_owned()));
        };
        let is_over = Arc::new(AtomicBool::new(false));
        let piped = |e: std::io::Error| AgentError::Broken(format!("its pipes can't be used: {e}"));
        let stdin = Pipe::new(stdin, &is_over).map_err(piped)?;
        let stdout = Pipe::new(stdout, &is_over).map_err(piped)?;
        let stderr = Pipe::new(stderr, &is_over).map_err(piped)?;
        let errors = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&errors);
        let (until, no_more_errors) = channel();
        std::thread::spawn(move || {
            keep_errors(stderr, &kept);
            drop(until);
        });
        Ok(Process {
            child,
            to: Some(writer(stdin)),
            from: reader(stdout),
            errors,
            no_more_errors,
            command: Arc::clone(command),
            is_over,
            waited: Duration::ZERO,
            stop,
        })
    }

    /// Sends a frame, and waits for the answer.
    pub fn ask(&mut self, frame: Frame, within: Duration) -> Result<ToEnv, AgentError> {
        match self.from.try_recv() {
            Ok(Ok(_)) => return Err(self.broken("spoke without being asked")),
            Ok(Err(text)) => return Err(self.broken(&text)),
            Err(_) => {}
        }
        frame.check().map_err(|text| self.broken(&format!("can't be sent {text}")))?;
        // If the pipe is closed, the answer says why.
        let sent = self.to.as_ref().map(|to| to.send(frame));
        let began = Instant::now();
        let left = self.command.limits.episode.saturating_sub(self.waited);
        let answer = match sent {
            Some(_) => self.wait(within.min(left), left < within),
            None => Err(self.broken("was ended")),
        };
        self.waited += began.elapsed();
        match message(&answer?).map_err(|text| self.broken(&format!("sent {text}")))? {
            ToEnv::Failed { problem } => Err(self.broken(&format!("said: {}", cut(&problem)))),
            answer => Ok(answer),
        }
    }

    fn wait(&mut self, within: Duration, is_last: bool) -> Result<Frame, AgentError> {
        let began = Instant::now();
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Err(AgentError::Halted("the run stops".to_owned()));
            }
            let left = within.saturating_sub(began.elapsed());
            match self.from.recv_timeout(left.min(LOOK)) {
                Ok(Ok(frame)) => return Ok(frame),
                Ok(Err(text)) => return Err(self.broken(&text)),
                Err(RecvTimeoutError::Timeout) if left > LOOK => {}
                Err(RecvTimeoutError::Timeout) => {
                    let text = format!("gave no answer within {} s", within.as_secs_f32());
                    let used_up = ", which used up the time of the episode";
                    return Err(self.broken(&(text + if is_last { used_up } else { "" })));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(self.broken("is gone")),
            }
        }
    }

    /// What it did, with what it complained of last.
    fn broken(&mut self, what: &str) -> AgentError {
        self.kill();
        // All of its complaints are there once its pipe is closed, unless somebody holds it open.
        let _ = self.no_more_errors.recv_timeout(Duration::from_secs(1));
        let errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        let said = String::from_utf8_lossy(&errors).trim().to_owned();
        let said = if said.is_empty() { String::new() } else { format!("; it complained: {said}") };
        AgentError::Broken(format!("`{}` {what}{said}", self.command.label()))
    }

    /// Its number, which is that of its process group too.
    #[cfg(unix)]
    fn pid(&self) -> Option<Pid> {
        i32::try_from(self.child.id()).ok().and_then(Pid::from_raw)
    }

    fn kill(&mut self) {
        self.to = None;
        #[cfg(unix)]
        if self.command.confinement.as_ref().is_some_and(|c| c.is_watched()) {
            self.ask_to_end();
        }
        #[cfg(unix)]
        if let Some(group) = self.pid() {
            // It may be gone already.
            let _ = kill_process_group(group, Signal::KILL);
        }
        let _ = self.child.kill();
    }

    /// Asks the stage that watches the command to end it with all that it has started, and waits for that.
    #[cfg(unix)]
    fn ask_to_end(&mut self) {
        if let Some(pid) = self.pid() {
            // It may be gone already.
            let _ = kill_process(pid, Signal::TERM);
        }
        let began = Instant::now();
        while !self.has_ended() && began.elapsed() < GRACE {
            std::thread::sleep(LOOK / 50);
        }
    }

    /// Closes its standard input, having told it to end or not; whether it ended within this time.
    pub fn close(&mut self, told: bool, within: Duration) -> bool {
        let Some(to) = self.to.take() else { return false };
        if told {
            let _ = to.send(plain(&ToMind::Bye));
        }
        drop(to);
        let began = Instant::now();
        while began.elapsed() < within && !self.stop.load(Ordering::Relaxed) {
            if self.has_ended() {
                return true;
            }
            std::thread::sleep(LOOK / 50);
        }
        false
    }

    /// Forgets how long it was waited for in the last episode.
    pub fn begin_episode(&mut self) {
        self.waited = Duration::ZERO;
    }

    /// Whether it has ended; its number isn't given to another process yet.
    #[cfg(unix)]
    pub fn has_ended(&mut self) -> bool {
        let looks = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        self.pid().is_none_or(|pid| !matches!(waitid(WaitId::Pid(pid), looks), Ok(None)))
    }

    #[cfg(not(unix))]
    pub fn has_ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.close(true, GRACE);
        self.kill();
        let _ = self.child.wait();
        self.is_over.store(true, Ordering::Relaxed);
    }
}

/// The process that runs a command, in its sandbox if it has one.
fn starting(command: &Command) -> std::process::Command {
    match &command.confinement {
        Some(confinement) if confinement.is_watched() => match confinement.isolation() {
            Isolation::Trusted => confinement.command(&script(command)),
            Isolation::Sandboxed(_) => confinement.command(&command.line),
        },
        _ => {
            let mut shell = std::process::Command::new("sh");
            shell.arg("-c").arg(script(command));
            shell
        }
    }
}

/// The command under its limit of memory for each process.
fn script(command: &Command) -> String {
    let kib = command.limits.memory_mib.saturating_mul(1024);
    format!("ulimit -d {kib} || exit 125\n{}", command.line)
}

/// A thread that writes, so that a process that doesn't read holds nobody up.
fn writer(mut stdin: impl Write + Send + 'static) -> Sender<Frame> {
    let (to, frames) = channel::<Frame>();
    std::thread::spawn(move || {
        for frame in frames {
            if frame.write(&mut stdin).is_err() {
                return;
            }
        }
    });
    to
}

/// A thread that reads frames until the pipe is closed.
fn reader(mut stdout: impl Read + Send + 'static) -> Receiver<Result<Frame, String>> {
    // No more than one answer is ever due.
    let (sender, frames) = sync_channel(1);
    std::thread::spawn(move || {
        loop {
            let read = match Frame::read(&mut stdout, 0) {
                Ok(Some(frame)) => Ok(frame),
                Ok(None) => return,
                Err(e) => Err(format!("sent {e}")),
            };
            let is_last = read.is_err();
            if sender.send(read).is_err() || is_last {
                return;
            }
        }
    });
    frames
}

fn keep_errors(mut stderr: impl Read, kept: &Mutex<Vec<u8>>) {
    let mut buffer = [0; 1024];
    while let Ok(n @ 1..) = stderr.read(&mut buffer) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(&buffer[..n]);
        let too_many = kept.len().saturating_sub(KEPT_ERRORS);
        kept.drain(..too_many);
    }
}
