//! Parsing of a trace up to its last complete record.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{EnvError, Result};
use crate::trace::{FORMAT, Header, MIN_VERSION, Record, Trace, VERSION};

/// Longest trace that is read, bytes: about a thousand times a typical one.
pub const MAX_TRACE_BYTES: u64 = 256 << 20;

/// Warning about a file; the parsed part is valid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TraceWarning {
    /// The file is damaged from this line on.
    Torn {
        /// File.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Problem.
        problem: String,
    },
    /// The end of the episode is missing.
    NoEnd {
        /// File.
        path: PathBuf,
        /// Number of records.
        records: usize,
    },
}

impl fmt::Display for TraceWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TraceWarning::Torn { path, line, problem } => {
                let path = path.display();
                write!(f, "{path}: read up to line {}; line {line}: {problem}", line - 1)
            }
            TraceWarning::NoEnd { path, records } => {
                write!(
                    f,
                    "{}: the episode's end is missing after {records} records",
                    path.display()
                )
            }
        }
    }
}

/// Parses a trace up to its last complete record, and returns warnings if lines are left. Messages name
/// the trace by `path`.
///
/// # Errors
/// If the header is incomplete, the trace is too long, or its format or version differs.
pub fn parse(bytes: &[u8], path: &Path) -> Result<(Trace, Vec<TraceWarning>)> {
    let bad = |line, problem: &str| EnvError::Unreadable {
        path: path.to_owned(),
        line,
        problem: problem.to_owned(),
    };
    if bytes.len() as u64 > MAX_TRACE_BYTES {
        return Err(bad(
            1,
            &format!("is longer than {MAX_TRACE_BYTES} bytes, the largest trace that is read"),
        ));
    }
    let mut lines = bytes.split_inclusive(|b| *b == b'\n').enumerate();
    let first = lines.next().and_then(|(_, l)| complete_line(l)).ok_or_else(|| {
        bad(1, "has no complete first line, expected the header of a trace; is the file cut off?")
    })?;
    let header = header(first, path)?;
    let mut trace = Trace { header, records: Vec::new() };
    let mut warnings = Vec::new();
    for (k, line) in lines {
        let record = match complete_line(line) {
            None => Err("is cut off".to_owned()),
            Some(_) if trace.end().is_some() => Err("comes after the end".to_owned()),
            Some(line) => Record::from_line(line).map_err(|e| e.to_string()),
        };
        match record {
            Ok(record) => trace.records.push(record),
            Err(problem) => {
                warnings.push(TraceWarning::Torn { path: path.to_owned(), line: k + 1, problem });
                break;
            }
        }
    }
    if trace.end().is_none() {
        let records = trace.records.len();
        warnings.push(TraceWarning::NoEnd { path: path.to_owned(), records });
    }
    Ok((trace, warnings))
}

/// Returns the text of a line that ends with a line break.
fn complete_line(line: &[u8]) -> Option<&str> {
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
    let v: Version = serde_json::from_slice(line.as_bytes())
        .map_err(|e| bad(format!("is not the header of a trace: {e}")))?;
    if v.format != FORMAT {
        let found = v.format.escape_debug();
        return Err(bad(format!("is not the header of a trace: its format is `{found}`")));
    }
    if !(MIN_VERSION..=VERSION).contains(&v.version) {
        return Err(EnvError::OtherVersion {
            path: path.to_owned(),
            found: format!("{} version {} (written by chaic {})", v.format, v.version, v.chaic),
            expected: format!("{FORMAT} versions {MIN_VERSION} to {VERSION}"),
        });
    }
    let header: Header = serde_json::from_slice(line.as_bytes()).map_err(|e| bad(e.to_string()))?;
    header.rules.check().map_err(bad)?;
    Ok(header)
}
