//! The file of one participant: JSON lines that the page wrote, in the order in which they happened.

use std::collections::BTreeMap;
use std::path::Path;

use chaic_env::CHAIC_VERSION;
use chaic_files::read_user_file;
use serde::{Deserialize, Serialize};

use crate::error::{Result, StudyError};

/// Value of `format` in the first record.
pub const FORMAT: &str = "chaic-study-data";
/// Version of the format.
pub const VERSION: u32 = 1;
/// Maximum size of a file, bytes: a participation has a few hundred kilobytes. While a record is parsed, it takes
/// up to 48 times its size: 32 bytes for a value of 2, in a vector that grows. So a file takes less than 1 GiB.
const MAX_BYTES: u64 = 16 << 20;
/// Maximum number of records: more than the decisions of a day.
const MAX_RECORDS: usize = 500_000;
/// Letters and digits of participant codes: those that are not mistaken for each other.
pub const CODE_ALPHABET: &[u8] = b"ABCDEFGHJKLMNPQRSTUVWXYZ23456789";
/// Number of characters of a participant code.
const CODE_LENGTH: usize = 10;

/// End of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrialEnd {
    /// The episode ended.
    Ended,
    /// The participant ended it.
    Stopped,
    /// The page was left or loaded again.
    Left,
}

impl TrialEnd {
    /// Returns the name in the data.
    pub fn name(self) -> &'static str {
        match self {
            TrialEnd::Ended => "ended",
            TrialEnd::Stopped => "stopped",
            TrialEnd::Left => "left",
        }
    }
}

/// A record of a participant's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum DataRecord {
    /// First record: the participant has agreed.
    Start {
        /// Always [`FORMAT`].
        format: String,
        /// Always [`VERSION`].
        version: u32,
        /// Version of chaic that built the page.
        chaic: String,
        /// Digest of the study.
        study: String,
        /// Random code of the participant.
        code: String,
        /// Slot, from 1.
        slot: u32,
    },
    /// The instructions were read.
    Instructed {},
    /// A trial begins.
    Trial {
        /// Number of the trial, from 0.
        trial: usize,
    },
    /// The next lines of the trace of a trial.
    Trace {
        /// Number of the trial.
        trial: usize,
        /// Complete lines.
        text: String,
    },
    /// A trial has ended.
    TrialEnd {
        /// Number of the trial.
        trial: usize,
        /// Reason of the end.
        outcome: TrialEnd,
    },
    /// A form is answered.
    Answers {
        /// Position of the condition, from 1; 0 at the end of the study.
        position: u32,
        /// Name of the form.
        form: String,
        /// Rating of each item; null if the participant gave none.
        ratings: BTreeMap<String, Option<i32>>,
    },
    /// Last record: the participant has seen the debriefing.
    Complete {},
}

impl DataRecord {
    /// Creates the first record of a participant.
    pub fn start(digest: &str, code: &str, slot: u32) -> DataRecord {
        DataRecord::Start {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            study: digest.to_owned(),
            code: code.to_owned(),
            slot,
        }
    }

    /// Parses a line.
    ///
    /// # Errors
    /// Returns the problem.
    pub fn parse(line: &str) -> std::result::Result<DataRecord, String> {
        serde_json::from_str(line).map_err(|error| format!("no record: {error}"))
    }

    /// Returns the line of the record, with its end.
    pub fn to_line(&self) -> String {
        serde_json::to_string(self).expect("a record has string keys") + "\n"
    }
}

/// Records of one participant.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticipantData {
    /// Digest of the study.
    pub study: String,
    /// Code of the participant.
    pub code: String,
    /// Slot, from 1.
    pub slot: u32,
    /// Records after the first one, each with the number of its line.
    pub records: Vec<(usize, DataRecord)>,
    /// Number of an incomplete last line, which is left out: a write was interrupted or still runs.
    pub torn_line: Option<usize>,
}

impl ParticipantData {
    /// Reads the file of a participant.
    ///
    /// # Errors
    /// [`StudyError::Data`] with the line and the problem.
    pub fn read(path: &Path) -> Result<ParticipantData> {
        ParticipantData::parse(&read_user_file(path, MAX_BYTES + 1)?, path)
    }

    /// Parses the content of a participant's file; `path` is for messages. An incomplete last line is left out.
    ///
    /// # Errors
    /// [`StudyError::Data`] with the line and the problem.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<ParticipantData> {
        let wrong = |line: usize, problem: String| StudyError::Data {
            path: path.to_owned(),
            line,
            problem,
        };
        if bytes.len() as u64 > MAX_BYTES {
            return Err(wrong(1, format!("the file is longer than {MAX_BYTES} bytes")));
        }
        let n_whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |k| k + 1);
        let (whole, last) = bytes.split_at(n_whole);
        let text = std::str::from_utf8(whole).map_err(|e| wrong(1, format!("not UTF-8: {e}")))?;
        let mut records = Vec::new();
        for (line, text) in (1..).zip(text.lines()) {
            if line > MAX_RECORDS {
                return Err(wrong(line, format!("more than {MAX_RECORDS} records")));
            }
            let record = DataRecord::parse(text).map_err(|problem| wrong(line, problem))?;
            records.push((line, record));
        }
        // Only the end of a line may be missing, for example after an editor.
        let last_line = records.len() + 1;
        let last_record =
            std::str::from_utf8(last).ok().and_then(|text| DataRecord::parse(text).ok());
        let is_torn = !last.is_empty() && last_record.is_none();
        let torn_line = is_torn.then_some(last_line);
        records.extend(last_record.map(|record| (last_line, record)));
        let mut records = records.into_iter();
        match records.next() {
            Some((_, DataRecord::Start { format, version, study, code, slot, .. })) => {
                if format != FORMAT || version != VERSION {
                    let expected = format!("expected `{FORMAT}` {VERSION}");
                    return Err(wrong(1, format!("`{format}` {version}, {expected}")));
                }
                if !is_code(&code) {
                    return Err(wrong(1, StudyError::Code(code).to_string()));
                }
                Ok(ParticipantData { study, code, slot, records: records.collect(), torn_line })
            }
            _ => Err(wrong(1, format!("the first record must be `start` of `{FORMAT}`"))),
        }
    }
}

/// Returns whether a text is a participant code.
pub fn is_code(text: &str) -> bool {
    text.len() == CODE_LENGTH && text.bytes().all(|byte| CODE_ALPHABET.contains(&byte))
}
