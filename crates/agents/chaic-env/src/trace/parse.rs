//! Reading a trace, as far as it is whole.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{EnvError, Result};
use crate::trace::{FORMAT, Header, Record, Trace, VERSION};

/// Longest trace that is read, bytes: a thousand times a usual one.
pub const MAX_TRACE_BYTES: u64 = 256 << 20;

/// Something about a file that its reader should know; what could be read is still good.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Warning {
    /// From this line on the file is damaged.
    Torn {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// The records stop before the episode's end.
    NoEnd {
        /// The file.
        path: PathBuf,
        /// How many records there are.
        records: usize,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Torn { path, line, problem } => {
                let path = path.display();
                write!(f, "{path}: read up to line {}; line {line}: {problem}", line - 1)
            }
            Warning::NoEnd { path, records } => {
                write!(
                    f,
                    "{}: the episode's end is missing after {records} records",
                    path.display()
                )
            }
        }
    }
}

/// Reads a trace up to its last whole record, and says so where that isn't all; `path` is what
/// messages call it.
///
/// # Errors
/// If it has no whole header, is too long, or is of another format or version.
pub fn parse(bytes: &[u8], path: &Path) -> Result<(Trace, Vec<Warning>)> {
    let bad = |line, problem: &str| EnvError::Unreadable {
        path: path.to_owned(),
        line,
        problem: problem.to_owned(),
    };
    if bytes.len() as u64 > MAX_TRACE_BYTES {
        return Err(bad(1, &format!("is longer than {MAX_TRACE_BYTES} bytes, no trace is")));
    }
    let mut lines = bytes.split_inclusive(|b| *b == b'\n').enumerate();
    let first = lines.next().and_then(|(_, l)| whole(l)).ok_or_else(|| {
        bad(1, "has no whole first line, expected the header of a trace; is the file cut off?")
    })?;
    let header = header(first, path)?;
    let mut trace = Trace { header, records: Vec::new() };
    let mut warnings = Vec::new();
    for (k, line) in lines {
        let record = match whole(line) {
            None => Err("is cut off".to_owned()),
            Some(_) if trace.end().is_some() => Err("comes after the end".to_owned()),
            Some(line) => Record::from_line(line).map_err(|e| e.to_string()),
        };
        match record {
            Ok(record) => trace.records.push(record),
            Err(problem) => {
                warnings.push(Warning::Torn { path: path.to_owned(), line: k + 1, problem });
                break;
            }
        }
    }
    if trace.end().is_none() {
        let records = trace.records.len();
        warnings.push(Warning::NoEnd { path: path.to_owned(), records });
    }
    Ok((trace, warnings))
}

/// The text of a line that ends with a line break.
fn whole(line: &[u8]) -> Option<&str> {
    std::str::from_utf8(line.strip_suffix(b"\n")?).ok()
}

fn header(line: &str, path: &Path) -> Result<Header> {
    #[derive(Deserialize)]
    struct Version {
        format: String,
        version: u32,
        #[serde(default)]
        chaic: String,
    }
    let bad = |problem| EnvError::Unreadable { path: path.to_owned(), line: 1, problem };
    let v: Version =
        serde_json::from_str(line).map_err(|e| bad(format!("is no header of a trace: {e}")))?;
    if v.format != FORMAT || v.version != VERSION {
        return Err(EnvError::OtherVersion {
            path: path.to_owned(),
            found: format!("{} version {} (written by chaic {})", v.format, v.version, v.chaic),
            expected: format!("{FORMAT} version {VERSION}"),
        });
    }
    serde_json::from_str(line).map_err(|e| bad(e.to_string()))
}
