//! Time limit of answers: a client that reads too slowly loses its connection.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::{Sleep, sleep};

/// Stream whose writes fail if the peer does not accept an answer in time.
///
/// The time starts when the peer stops reading. It ends when the operating system has all bytes, which is when the
/// writer flushes. A peer therefore gains no time by reading a byte from time to time.
pub struct WriteTimeout<S> {
    stream: S,
    limit: Duration,
    /// End of the time for the current answer; `None` while no write waits.
    deadline: Option<Pin<Box<Sleep>>>,
}

impl<S> WriteTimeout<S> {
    /// Wraps a stream. `limit` is the time for each answer.
    pub fn new(stream: S, limit: Duration) -> WriteTimeout<S> {
        WriteTimeout { stream, limit, deadline: None }
    }

    /// Fails instead of waiting if the time is over.
    fn in_time<T>(
        &mut self,
        context: &mut Context<'_>,
        written: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if written.is_ready() {
            return written;
        }
        let limit = self.limit;
        let deadline = self.deadline.get_or_insert_with(|| Box::pin(sleep(limit)));
        ready!(deadline.as_mut().poll(context));
        Poll::Ready(Err(io::Error::from(io::ErrorKind::TimedOut)))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for WriteTimeout<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for WriteTimeout<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.in_time(context, written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, parts);
        self.in_time(context, written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let flushed = Pin::new(&mut self.stream).poll_flush(context);
        if flushed.is_ready() {
            self.deadline = None;
        }
        self.in_time(context, flushed)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let closed = Pin::new(&mut self.stream).poll_shutdown(context);
        self.in_time(context, closed)
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use tokio::runtime::Builder;

    use super::*;

    /// Peer that accepts a number of bytes, one at a time with a pause before each, and then none.
    struct SlowPeer {
        n_bytes: usize,
        is_paused: bool,
    }

    impl AsyncWrite for SlowPeer {
        fn poll_write(
            mut self: Pin<&mut Self>,
            context: &mut Context<'_>,
            _: &[u8],
        ) -> Poll<io::Result<usize>> {
            self.is_paused = !self.is_paused;
            if self.n_bytes == 0 {
                return Poll::Pending;
            }
            if self.is_paused {
                context.waker().wake_by_ref();
                return Poll::Pending;
            }
            self.n_bytes -= 1;
            Poll::Ready(Ok(1))
        }

        fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }

        fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
            Poll::Ready(Ok(()))
        }
    }

    /// Writes bytes one at a time, and flushes after each `flush_interval` of them. Returns the number of written
    /// bytes before the first error, and the error.
    fn write(
        n_accepted: usize,
        n_bytes: usize,
        flush_interval: usize,
        limit: Duration,
    ) -> (usize, Option<io::ErrorKind>) {
        let runtime = Builder::new_current_thread().enable_time().build().expect("a runtime");
        runtime.block_on(async {
            let peer = SlowPeer { n_bytes: n_accepted, is_paused: false };
            let mut stream = WriteTimeout::new(peer, limit);
            for k in 0..n_bytes {
                let written = poll_fn(|context| Pin::new(&mut stream).poll_write(context, b"a"));
                if let Err(error) = written.await {
                    return (k, Some(error.kind()));
                }
                if (k + 1).is_multiple_of(flush_interval) {
                    poll_fn(|context| Pin::new(&mut stream).poll_flush(context))
                        .await
                        .expect("the peer has all bytes");
                    assert!(stream.deadline.is_none());
                } else {
                    assert!(stream.deadline.is_some(), "one deadline for all bytes");
                }
            }
            (n_bytes, None)
        })
    }

    #[test]
    fn a_peer_that_stops_reading_ends_the_connection() {
        let limit = Duration::from_millis(1);
        assert_eq!(write(0, 1, 1, limit), (0, Some(io::ErrorKind::TimedOut)));
    }

    #[test]
    fn slow_bytes_share_one_deadline_until_they_are_flushed() {
        let limit = Duration::from_secs(3600);
        assert_eq!(write(6, 6, 3, limit), (6, None));
        // Each byte is accepted in time, but not all of them.
        let limit = Duration::from_millis(1);
        let (n_written, error) = write(usize::MAX, 1_000_000, usize::MAX, limit);
        assert_eq!(error, Some(io::ErrorKind::TimedOut), "after {n_written} bytes");
    }
}
