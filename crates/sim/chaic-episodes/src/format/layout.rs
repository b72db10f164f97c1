//! JSON with one line per entry of the outer three levels: short enough to read, and a change of
//! one object changes one line.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::ser::Formatter;

/// Number of nesting levels with line breaks: envelope, setup, list. Deeper values stay on one
/// line.
const BROKEN_LEVELS: usize = 3;

#[derive(Default)]
struct LineFormatter {
    depth: usize,
}

impl LineFormatter {
    fn line_break<W: ?Sized + Write>(&self, writer: &mut W) -> io::Result<()> {
        if self.depth > BROKEN_LEVELS {
            return Ok(());
        }
        writer.write_all(b"\n")?;
        (0..self.depth).try_for_each(|_| writer.write_all(b"  "))
    }

    fn open<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth += 1;
        writer.write_all(bracket)
    }

    fn close<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        if self.depth <= BROKEN_LEVELS {
            writer.write_all(b"\n")?;
            (1..self.depth).try_for_each(|_| writer.write_all(b"  "))?;
        }
        self.depth -= 1;
        writer.write_all(bracket)
    }

    fn entry<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if !first {
            writer.write_all(if self.depth > BROKEN_LEVELS { b", " } else { b"," })?;
        }
        self.line_break(writer)
    }
}

impl Formatter for LineFormatter {
    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"[")
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"]")
    }

    fn begin_array_value<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        self.entry(writer, first)
    }

    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        self.entry(writer, first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
}

/// Serializes a value to JSON text that ends with a line break.
pub(super) fn to_lines(value: &impl Serialize) -> String {
    let mut bytes = Vec::new();
    let mut serializer =
        serde_json::Serializer::with_formatter(&mut bytes, LineFormatter::default());
    value
        .serialize(&mut serializer)
        .expect("writing to memory never fails, and a setup has no maps");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("serde_json writes UTF-8")
}
