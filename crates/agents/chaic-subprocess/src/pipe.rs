//! Pipes that can be abandoned while another process keeps their other end open.

use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// This program's end of a pipe. Reads and writes block until the pipe is abandoned.
pub(crate) struct Pipe<F> {
    file: F,
    is_over: Arc<AtomicBool>,
}

#[cfg(unix)]
impl<F: std::os::fd::AsFd> Pipe<F> {
    /// Wraps one end of a pipe. Setting `is_over` ends all waiting.
    ///
    /// # Errors
    /// If the system refuses non-blocking mode.
    pub fn new(file: F, is_over: &Arc<AtomicBool>) -> io::Result<Pipe<F>> {
        use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
        fcntl_setfl(&file, fcntl_getfl(&file)? | OFlags::NONBLOCK)?;
        Ok(Pipe { file, is_over: Arc::clone(is_over) })
    }

    /// Repeats a non-blocking call until it completes.
    fn retry(
        &mut self,
        ready: rustix::event::PollFlags,
        mut call: impl FnMut(&mut F) -> io::Result<usize>,
    ) -> io::Result<usize> {
        use rustix::event::{PollFd, Timespec, poll};
        /// Polling period of `is_over`: 50 ms.
        const POLL_PERIOD: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
        loop {
            // Before each call: the other end may always be ready.
            if self.is_over.load(Ordering::Relaxed) {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            match call(&mut self.file) {
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                done => return done,
            }
            match poll(&mut [PollFd::new(&self.file, ready)], Some(&POLL_PERIOD)) {
                Ok(_) | Err(rustix::io::Errno::INTR) => {}
                Err(e) => return Err(e.into()),
            }
        }
    }
}

#[cfg(unix)]
impl<F: Read + std::os::fd::AsFd> Read for Pipe<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.retry(rustix::event::PollFlags::IN, |file| file.read(buffer))
    }
}

#[cfg(unix)]
impl<F: Write + std::os::fd::AsFd> Write for Pipe<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.retry(rustix::event::PollFlags::OUT, |file| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(not(unix))]
impl<F> Pipe<F> {
    /// Wraps one end of a pipe. Blocking calls can't be interrupted on this system.
    pub fn new(file: F, is_over: &Arc<AtomicBool>) -> io::Result<Pipe<F>> {
        Ok(Pipe { file, is_over: Arc::clone(is_over) })
    }

    /// Returns an error once the pipe is abandoned.
    fn check(&self) -> io::Result<()> {
        match self.is_over.load(Ordering::Relaxed) {
            true => Err(io::ErrorKind::BrokenPipe.into()),
            false => Ok(()),
        }
    }
}

#[cfg(not(unix))]
impl<F: Read> Read for Pipe<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.check()?;
        self.file.read(buffer)
    }
}

#[cfg(not(unix))]
impl<F: Write> Write for Pipe<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.check()?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn an_abandoned_pipe_ends_although_it_always_has_data() {
        let is_over = Arc::new(AtomicBool::new(false));
        let mut pipe = Pipe::new(std::fs::File::open("/dev/zero").unwrap(), &is_over).unwrap();
        let mut buffer = [1; 8];
        assert_eq!(pipe.read(&mut buffer).unwrap(), 8);
        is_over.store(true, Ordering::Relaxed);
        assert_eq!(pipe.read(&mut buffer).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
    }
}
