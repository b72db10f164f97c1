//! Helper process with pipes, time limits and resource limits.

use std::io::{ErrorKind, Read, Write};
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

use crate::environment::inherited;
use crate::frame::MessageFrame;
use crate::message::{RequestMessage, ResponseMessage, cut, message, plain};
use crate::pipe::Pipe;
use crate::program::HelperProgram;

/// Polling period of the stop flag while waiting.
const POLL_PERIOD: Duration = Duration::from_millis(50);
/// Time in which a process must exit after `bye` or a termination signal.
const EXIT_TIMEOUT: Duration = Duration::from_secs(2);
/// Problem of a process that closes its standard output within a message, as `echo hello` does.
const INCOMPLETE: &str =
    "sent an incomplete message; does the helper print to the standard output?";
/// Length of the kept end of standard error, bytes.
const STDERR_LEN: usize = 2000;

/// A running command.
pub(crate) struct HelperProcess {
    child: Child,
    requests: Option<Sender<MessageFrame>>,
    responses: Receiver<Result<MessageFrame, String>>,
    /// End of standard error.
    stderr: Arc<Mutex<Vec<u8>>>,
    /// Closed once standard error is read to its end.
    stderr_end: Receiver<()>,
    command: Arc<HelperProgram>,
    /// Set when the pipes are abandoned; their threads end then.
    is_over: Arc<AtomicBool>,
    /// Total waiting time in this episode.
    waited: Duration,
    stop: &'static AtomicBool,
}

impl HelperProcess {
    /// Starts the command.
    pub fn start(
        command: &Arc<HelperProgram>,
        stop: &'static AtomicBool,
    ) -> Result<HelperProcess, AgentError> {
        let mut builder = process_builder(command);
        builder.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        builder.env_clear().envs(inherited(&command.environment));
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut builder, 0);
        let failed =
            |e: std::io::Error| AgentError::Broken(format!("a process can't be started: {e}"));
        // Dropping it ends the process, also after an error.
        let mut process = HelperProcess {
            child: builder.spawn().map_err(failed)?,
            requests: None,
            responses: channel().1,
            stderr: Arc::default(),
            stderr_end: channel().1,
            command: Arc::clone(command),
            is_over: Arc::default(),
            waited: Duration::ZERO,
            stop,
        };
        process.connect().map_err(|e| {
            AgentError::Broken(format!("the pipes of a process can't be set up: {e}"))
        })?;
        Ok(process)
    }

    /// Starts the threads that write to and read from its pipes.
    fn connect(&mut self) -> std::io::Result<()> {
        let missing = || std::io::Error::from(ErrorKind::BrokenPipe);
        let stdin = Pipe::new(self.child.stdin.take().ok_or_else(missing)?, &self.is_over)?;
        let stdout = Pipe::new(self.child.stdout.take().ok_or_else(missing)?, &self.is_over)?;
        let stderr = Pipe::new(self.child.stderr.take().ok_or_else(missing)?, &self.is_over)?;
        let kept = Arc::clone(&self.stderr);
        let (end, stderr_end) = channel();
        self.stderr_end = stderr_end;
        spawn(move || {
            keep_stderr(stderr, &kept);
            drop(end);
        })?;
        self.responses = reader(stdout)?;
        self.requests = Some(writer(stdin)?);
        Ok(())
    }

    /// Sends a frame and waits for the answer.
    pub fn ask(
        &mut self,
        frame: MessageFrame,
        within: Duration,
    ) -> Result<ResponseMessage, AgentError> {
        match self.responses.try_recv() {
            Ok(Ok(_)) => return Err(self.broken("sent a message without being asked")),
            Ok(Err(text)) => return Err(self.broken(&text)),
            Err(_) => {}
        }
        frame.check().map_err(|text| self.broken(&format!("can't be sent {text}")))?;
        // If the process has closed the pipe, the wait below returns the reason.
        let sent = self.requests.as_ref().map(|requests| requests.send(frame));
        let start = Instant::now();
        let left = self.command.limits.episode.saturating_sub(self.waited);
        let answer = match sent {
            Some(_) => self.wait(within.min(left), left < within),
            None => Err(self.broken("has no open standard input")),
        };
        self.waited += start.elapsed();
        match message(&answer?).map_err(|text| self.broken(&format!("sent {text}")))? {
            ResponseMessage::Failed { problem } => {
                Err(self.broken(&format!("failed: {}", cut(&problem))))
            }
            answer => Ok(answer),
        }
    }

    /// Waits for a frame. `is_last` is true if the limit is the remaining time of the episode.
    fn wait(&mut self, within: Duration, is_last: bool) -> Result<MessageFrame, AgentError> {
        let start = Instant::now();
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Err(AgentError::Halted("the run stops".to_owned()));
            }
            let left = within.saturating_sub(start.elapsed());
            match self.responses.recv_timeout(left.min(POLL_PERIOD)) {
                Ok(Ok(frame)) => return Ok(frame),
                Ok(Err(text)) => return Err(self.broken(&text)),
                Err(RecvTimeoutError::Timeout) if left > POLL_PERIOD => {}
                Err(RecvTimeoutError::Timeout) => {
                    let text = format!("gave no answer within {} s", within.as_secs_f32());
                    let used_up = ", which used up the time of the episode";
                    return Err(self.broken(&(text + if is_last { used_up } else { "" })));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(self.broken("exited before its answer"));
                }
            }
        }
    }

    /// Ends the process and returns an error with the end of its standard error.
    fn broken(&mut self, problem: &str) -> AgentError {
        self.kill();
        // Standard error ends with the process, unless a descendant keeps it open.
        let _ = self.stderr_end.recv_timeout(Duration::from_secs(1));
        let stderr = self.stderr.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(&stderr).trim().to_owned();
        let text = if text.is_empty() { text } else { format!("; standard error: {text}") };
        AgentError::Broken(format!("`{}` {problem}{text}", self.command.label()))
    }

    /// Returns its process id, which is the id of its process group too.
    #[cfg(unix)]
    fn pid(&self) -> Option<Pid> {
        i32::try_from(self.child.id()).ok().and_then(Pid::from_raw)
    }

    fn kill(&mut self) {
        self.requests = None;
        #[cfg(unix)]
        if self.command.confinement.as_ref().is_some_and(|c| c.is_supervised()) {
            self.terminate();
        }
        #[cfg(unix)]
        if let Some(group) = self.pid() {
            // It may have ended already.
            let _ = kill_process_group(group, Signal::KILL);
        }
        let _ = self.child.kill();
    }

    /// Asks the supervising stage to end the command with its descendants, and waits for it.
    #[cfg(unix)]
    fn terminate(&mut self) {
        if let Some(pid) = self.pid() {
            // It may have ended already.
            let _ = kill_process(pid, Signal::TERM);
        }
        let start = Instant::now();
        while !self.has_ended() && start.elapsed() < EXIT_TIMEOUT {
            std::thread::sleep(POLL_PERIOD / 50);
        }
    }

    /// Closes its standard input, after `bye` if `send_bye`. Returns whether it ends within this time.
    pub fn close(&mut self, send_bye: bool, within: Duration) -> bool {
        let Some(requests) = self.requests.take() else { return false };
        if send_bye {
            let _ = requests.send(plain(&RequestMessage::Bye));
        }
        drop(requests);
        let start = Instant::now();
        while start.elapsed() < within && !self.stop.load(Ordering::Relaxed) {
            if self.has_ended() {
                return true;
            }
            std::thread::sleep(POLL_PERIOD / 50);
        }
        false
    }

    /// Resets the waiting time for a new episode.
    pub fn reset_waiting_time(&mut self) {
        self.waited = Duration::ZERO;
    }

    /// Returns whether it has ended. Its process id is not reused yet.
    #[cfg(unix)]
    pub fn has_ended(&mut self) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        self.pid().is_none_or(|pid| !matches!(waitid(WaitId::Pid(pid), options), Ok(None)))
    }

    #[cfg(not(unix))]
    pub fn has_ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }
}

impl Drop for HelperProcess {
    fn drop(&mut self) {
        self.close(true, EXIT_TIMEOUT);
        self.kill();
        let _ = self.child.wait();
        self.is_over.store(true, Ordering::Relaxed);
    }
}

/// Returns the process builder of a command, in its sandbox if it has one.
fn process_builder(command: &HelperProgram) -> std::process::Command {
    match &command.confinement {
        Some(confinement) if confinement.is_supervised() => match confinement.isolation() {
            Isolation::Trusted => confinement.command(&script(command)),
            Isolation::Sandboxed(_) => confinement.command(&command.line),
        },
        _ => shell(command),
    }
}

/// Returns the shell of this system with the command.
#[cfg(not(windows))]
fn shell(command: &HelperProgram) -> std::process::Command {
    let mut shell = std::process::Command::new("sh");
    shell.arg("-c").arg(script(command));
    shell
}

/// Returns the shell of this system with the command, which has no memory limit.
#[cfg(windows)]
fn shell(command: &HelperProgram) -> std::process::Command {
    use std::os::windows::process::CommandExt as _;
    let mut shell = std::process::Command::new("cmd");
    // With /s, `cmd` removes the outer quotes and leaves the rest unchanged.
    shell.args(["/d", "/s", "/c"]).raw_arg(format!("\"{}\"", command.line));
    shell
}

/// Returns a shell script that runs the command with its memory limit per process.
fn script(command: &HelperProgram) -> String {
    let kib = command.limits.memory_mib.saturating_mul(1024);
    format!("ulimit -d {kib} || exit 125\n{}", command.line)
}

/// Starts a thread, which may fail if the system has no more of them.
fn spawn(work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    std::thread::Builder::new().spawn(work).map(drop)
}

/// Starts a thread that writes frames, so that a process that does not read blocks no caller.
fn writer(mut stdin: impl Write + Send + 'static) -> std::io::Result<Sender<MessageFrame>> {
    let (sender, frames) = channel::<MessageFrame>();
    spawn(move || {
        for frame in frames {
            if frame.write(&mut stdin).is_err() {
                return;
            }
        }
    })?;
    Ok(sender)
}

/// Starts a thread that reads frames until the pipe is closed.
fn reader(
    mut stdout: impl Read + Send + 'static,
) -> std::io::Result<Receiver<Result<MessageFrame, String>>> {
    // At most one answer is due at a time.
    let (sender, frames) = sync_channel(1);
    spawn(move || {
        loop {
            let read = match MessageFrame::read(&mut stdout, 0) {
                Ok(Some(frame)) => Ok(frame),
                Ok(None) => return,
                Err(e) if e.kind() == ErrorKind::UnexpectedEof => Err(INCOMPLETE.to_owned()),
                Err(e) => Err(format!("sent {e}")),
            };
            let is_last = read.is_err();
            if sender.send(read).is_err() || is_last {
                return;
            }
        }
    })?;
    Ok(frames)
}

/// Reads standard error to its end and keeps the last [`STDERR_LEN`] bytes.
fn keep_stderr(mut stderr: impl Read, kept: &Mutex<Vec<u8>>) {
    let mut buffer = [0; 1024];
    while let Ok(n @ 1..) = stderr.read(&mut buffer) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(&buffer[..n]);
        let excess = kept.len().saturating_sub(STDERR_LEN);
        kept.drain(..excess);
    }
}
