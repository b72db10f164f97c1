//! Framing of messages on a pipe: a JSON head, then images.
//!
//! A frame is the concatenation of:
//!
//! | bytes | content |
//! |---|---|
//! | 4 | length of the head, u32, little-endian |
//! | 4 | length of the body, u32, little-endian |
//! | .. | head: one JSON object, UTF-8 |
//! | .. | body: raw images, see [`crate::message::ImageHeader`] |

use std::io::{self, Read, Write};

use chaic_core::observation::SensorConfig;

/// Longest head, bytes: 50 times the longest observed one.
pub const MAX_HEAD_BYTES: usize = 1 << 20;
/// Longest body, bytes: the images of the largest observation.
pub const MAX_BODY: usize = SensorConfig::MAX_OBSERVATION_BYTES as usize;

/// One frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MessageFrame {
    /// JSON.
    pub head: Vec<u8>,
    /// Images.
    pub body: Vec<u8>,
}

impl MessageFrame {
    /// Writes the frame and flushes.
    ///
    /// # Errors
    /// If head or body exceed [`MAX_HEAD_BYTES`] or [`MAX_BODY`] (nothing is written then), or if
    /// the pipe is closed.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        self.check().map_err(|text| io::Error::new(io::ErrorKind::InvalidInput, text))?;
        out.write_all(&(self.head.len() as u32).to_le_bytes())?;
        out.write_all(&(self.body.len() as u32).to_le_bytes())?;
        out.write_all(&self.head)?;
        out.write_all(&self.body)?;
        out.flush()
    }

    /// Checks the lengths of head and body.
    ///
    /// # Errors
    /// One line with the lengths and their limits.
    pub fn check(&self) -> Result<(), String> {
        let (head, body) = (self.head.len(), self.body.len());
        if head > MAX_HEAD_BYTES || body > MAX_BODY {
            return Err(format!(
                "a message of {head} and {body} bytes; head and body hold at most \
                 {MAX_HEAD_BYTES} and {MAX_BODY}"
            ));
        }
        Ok(())
    }

    /// Reads the next frame; `None` if the pipe was closed before it.
    ///
    /// # Errors
    /// If the pipe is closed within a frame, or if a length exceeds [`MAX_HEAD_BYTES`] or
    /// `max_body`, which is [`MAX_BODY`] for helpers and 0 for chaic.
    pub fn read(from: &mut dyn Read, max_body: usize) -> io::Result<Option<MessageFrame>> {
        let mut lengths = [0; 8];
        let n = read_up_to(from, &mut lengths)?;
        if n == 0 {
            return Ok(None);
        }
        if n < lengths.len() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let length = |k: usize| {
            u32::from_le_bytes([lengths[k], lengths[k + 1], lengths[k + 2], lengths[k + 3]])
                as usize
        };
        let (head, body) = (length(0), length(4));
        if head > MAX_HEAD_BYTES || body > max_body {
            let text = format!(
                "a frame of {head} and {body} bytes, more than {MAX_HEAD_BYTES} and {max_body}; \
                 does the helper print to the standard output?"
            );
            return Err(io::Error::new(io::ErrorKind::InvalidData, text));
        }
        let mut frame = MessageFrame { head: vec![0; head], body: vec![0; body] };
        from.read_exact(&mut frame.head)?;
        from.read_exact(&mut frame.body)?;
        Ok(Some(frame))
    }
}

/// Reads until the buffer is full or the pipe is closed; returns the number of bytes.
fn read_up_to(from: &mut dyn Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut n = 0;
    while n < buffer.len() {
        match from.read(&mut buffer[n..]) {
            Ok(0) => break,
            Ok(more) => n += more,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let frame = MessageFrame { head: b"{\"type\":\"bye\"}".to_vec(), body: vec![0, 255, 10] };
        let mut bytes = Vec::new();
        frame.write(&mut bytes).unwrap();
        assert_eq!(bytes[..8], [14, 0, 0, 0, 3, 0, 0, 0]);
        let mut pipe = &bytes[..];
        assert_eq!(MessageFrame::read(&mut pipe, 3).unwrap(), Some(frame));
        assert_eq!(MessageFrame::read(&mut pipe, 3).unwrap(), None);
        for cut in 1..bytes.len() {
            assert!(MessageFrame::read(&mut &bytes[..cut], 3).is_err(), "cut after {cut} bytes");
        }
        assert!(MessageFrame::read(&mut &bytes[..], 2).is_err(), "a body that is too long");
    }

    #[test]
    fn a_frame_that_is_too_long_is_refused_and_not_written() {
        for frame in [
            MessageFrame { head: vec![b' '; MAX_HEAD_BYTES + 1], body: Vec::new() },
            MessageFrame { head: Vec::new(), body: vec![0; MAX_BODY + 1] },
        ] {
            let mut written = Vec::new();
            let error = frame.write(&mut written).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
            assert!(error.to_string().contains("at most 1048576 and 67108864"), "{error}");
            assert!(written.is_empty());
        }
    }

    #[test]
    fn text_on_the_pipe_is_not_a_frame() {
        let error = MessageFrame::read(&mut &b"Hello world, I am loading weights"[..], MAX_BODY)
            .unwrap_err();
        assert!(error.to_string().contains("standard output"), "{error}");
    }
}
