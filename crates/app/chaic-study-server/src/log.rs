//! The file of one participant: appends that are checked, synchronized and repeatable.
//!
//! Each append is one write, which is synchronized (`fdatasync`) before the request is answered.

use std::fs;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use chaic_files::{
    EntryKind, FileError, kind, open_existing_for_append, read_bounded, remove_file,
    write_new_private,
};
use chaic_study::data::{DataRecord, TrialEnd};
use chaic_study::{ParticipantData, RecordCheck, Simulator, StudyPlan, Trial};

use crate::access::TokenDigest;
use crate::error::{Result, ServerError};
use crate::limits::{MAX_FILE_BYTES, MAX_RECORDS, PARTICIPANT_RATE};
use crate::refusal::Refusal;
use crate::token_bucket::TokenBucket;

/// Start of a line with a part of a trace, as [`DataRecord::to_line`] and pages write it.
const TRACE_BEGIN: &str = "{\"type\":\"trace\",";

/// Extension of files with the digest of a token. An export ignores these files.
const TOKEN_ENDING: &str = "token";

/// Returns the path of the token of the participant with this file.
pub fn token_path(path: &Path) -> PathBuf {
    path.with_extension(TOKEN_ENDING)
}

/// File of a participant.
pub struct Log {
    path: PathBuf,
    check: RecordCheck,
    n_records: usize,
    /// Number of records that the page has, too. Traces do not count if the server writes them.
    n_page_records: usize,
    n_bytes: usize,
    /// True after a failed write, which may have left bytes behind.
    is_torn: bool,
    bucket: TokenBucket,
}

impl Log {
    /// Creates the token file, then the data file with its first line.
    pub fn create(
        path: PathBuf,
        check: RecordCheck,
        token: &TokenDigest,
        start: &str,
        now_secs: u64,
    ) -> std::result::Result<Log, Refusal> {
        let token_path = token_path(&path);
        remove_if_present(&token_path)?;
        write_new_private(&token_path, token.to_line().as_bytes())?;
        if let Err(error) = write_new_private(&path, start.as_bytes()) {
            // If the removal fails as well, the next start of the server removes the file.
            let _ = remove_file(&token_path);
            return Err(error.into());
        }
        let bucket = TokenBucket::new(PARTICIPANT_RATE, now_secs);
        let (n_records, n_page_records, n_bytes) = (1, 1, start.len());
        Ok(Log { path, check, n_records, n_page_records, n_bytes, is_torn: false, bucket })
    }

    /// Reads the file of a participant, without an incomplete last line, and removes that line. Also returns the
    /// slot.
    pub fn read(plan: &StudyPlan, code: &str, path: &Path, now_secs: u64) -> Result<(Log, u32)> {
        let wrong = |line: usize, problem: String| ServerError::Data {
            path: path.to_owned(),
            line,
            problem,
        };
        let mut bytes = read_bounded(path, MAX_FILE_BYTES as u64 + 1)?;
        if bytes.len() > MAX_FILE_BYTES {
            return Err(wrong(1, format!("the file is longer than {MAX_FILE_BYTES} bytes")));
        }
        let n_bytes = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |k| k + 1);
        let is_torn = n_bytes < bytes.len();
        bytes.truncate(n_bytes);
        let data = ParticipantData::parse(&bytes, path)?;
        if data.code != code {
            return Err(wrong(1, format!("the code is {}; rename the file", data.code)));
        }
        let check = RecordCheck::new(plan, &data.study, data.slot);
        let mut check = check.map_err(|problem| wrong(1, problem))?;
        for (line, record) in &data.records {
            check.add(plan, record).map_err(|problem| wrong(*line, problem))?;
        }
        if is_torn {
            let file = open_existing_for_append(path)?;
            let shortened = file.set_len(n_bytes as u64).and_then(|()| file.sync_all());
            shortened.map_err(FileError::context("shorten", path))?;
        }
        let bucket = TokenBucket::new(PARTICIPANT_RATE, now_secs);
        let n_records = data.records.len() + 1;
        let text = String::from_utf8_lossy(&bytes);
        let n_page_records = text.lines().filter(|line| is_of_page(plan, line)).count();
        let path = path.to_owned();
        let log = Log { path, check, n_records, n_page_records, n_bytes, is_torn: false, bucket };
        Ok((log, data.slot))
    }

    /// Returns the number of stored records that the page has, too.
    pub fn n_page_records(&self) -> usize {
        self.n_page_records
    }

    /// Returns whether a trial runs; `None` if it has not begun.
    pub fn is_running(&self, trial: usize) -> Option<bool> {
        self.check.is_running(trial)
    }

    /// Returns the trials of the participant.
    pub fn trials(&self) -> &[Trial] {
        self.check.trials()
    }

    /// Returns the stored trace of a trial.
    pub fn trace(&self, wanted: usize) -> std::result::Result<String, Refusal> {
        let text = self.read_stored()?;
        let lines = text.lines().filter(|line| line.starts_with(TRACE_BEGIN));
        let records = lines.filter_map(|line| DataRecord::parse(line).ok());
        let texts = records.filter_map(|record| match record {
            DataRecord::Trace { trial, text } if trial == wanted => Some(text),
            _ => None,
        });
        Ok(texts.collect())
    }

    /// Returns whether the participant has finished.
    pub fn is_complete(&self) -> bool {
        self.check.is_complete()
    }

    /// Counts a request against the rate of the participant.
    pub fn take_token(&mut self, now_secs: u64) -> std::result::Result<(), Refusal> {
        if self.bucket.take(now_secs) { Ok(()) } else { Err(Refusal::Rate) }
    }

    /// Returns the first line.
    pub fn first_line(&self) -> std::result::Result<String, Refusal> {
        let text = self.read_stored()?;
        text.split_inclusive('\n').next().map(str::to_owned).ok_or(Refusal::Changed)
    }

    /// Appends lines of records of the page, the first of which has the number `from`, and compares those that
    /// are stored. Numbers count the records that the page has.
    pub fn append(
        &mut self,
        plan: &StudyPlan,
        from: usize,
        text: &str,
    ) -> std::result::Result<(), Refusal> {
        if from > self.n_page_records {
            return Err(Refusal::Gap { stored: self.n_page_records });
        }
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        let wrong = |k: usize, problem: &str| Refusal::Record {
            number: from + k,
            problem: problem.to_owned(),
        };
        if let Some(k) = lines.iter().position(|line| !line.ends_with('\n')) {
            return Err(wrong(k, "the line has no end"));
        }
        let n_stored = (self.n_page_records - from).min(lines.len());
        let (stored, new) = lines.split_at(n_stored);
        if !stored.is_empty() {
            let known = self.read_stored()?;
            let known =
                known.split_inclusive('\n').filter(|line| is_of_page(plan, line)).skip(from);
            let is_other =
                |(known, sent): (&str, &&str)| known != *sent && !is_same_start(plan, known, sent);
            if let Some(k) = known.zip(stored).position(is_other) {
                return Err(wrong(k, "another record is stored"));
            }
        }
        let mut records = Vec::with_capacity(new.len());
        for (k, line) in new.iter().enumerate() {
            let record = DataRecord::parse(line).and_then(|record| from_page(plan, record));
            records.push(record.map_err(|problem| wrong(n_stored + k, &problem))?);
        }
        self.add(plan, &records, new.concat(), |k, problem| wrong(n_stored + k, problem))?;
        self.n_page_records += new.len();
        Ok(())
    }

    /// Appends the next lines of the trace of a running trial, and its end if the episode has ended.
    pub fn append_trace(
        &mut self,
        plan: &StudyPlan,
        trial: usize,
        text: String,
        has_ended: bool,
    ) -> std::result::Result<(), Refusal> {
        let end = DataRecord::TrialEnd { trial, outcome: TrialEnd::Ended };
        let trace = (!text.is_empty()).then_some(DataRecord::Trace { trial, text });
        let records: Vec<DataRecord> = trace.into_iter().chain(has_ended.then_some(end)).collect();
        let lines = records.iter().map(DataRecord::to_line).collect();
        self.add(plan, &records, lines, |_, _| Refusal::Over)?;
        self.n_page_records += usize::from(has_ended);
        Ok(())
    }

    /// Checks records and appends their lines.
    fn add(
        &mut self,
        plan: &StudyPlan,
        records: &[DataRecord],
        lines: String,
        wrong: impl Fn(usize, &str) -> Refusal,
    ) -> std::result::Result<(), Refusal> {
        if records.is_empty() {
            return Ok(());
        }
        if self.n_records + records.len() > MAX_RECORDS {
            return Err(Refusal::Size(format!("{MAX_RECORDS} records")));
        }
        if self.n_bytes + lines.len() > MAX_FILE_BYTES {
            return Err(Refusal::Size(format!("{} MiB", MAX_FILE_BYTES >> 20)));
        }
        let mut check = self.check.clone();
        for (k, record) in records.iter().enumerate() {
            check.add(plan, record).map_err(|problem| wrong(k, &problem))?;
        }
        self.write(lines.as_bytes())?;
        self.check = check;
        self.n_records += records.len();
        self.n_bytes += lines.len();
        Ok(())
    }

    /// Removes the file and the token.
    pub fn delete(&mut self) -> std::result::Result<(), Refusal> {
        remove_if_present(&self.path)?;
        remove_if_present(&token_path(&self.path))?;
        Ok(())
    }

    /// Reads the stored lines.
    pub fn read_stored(&self) -> std::result::Result<String, Refusal> {
        let bytes = read_bounded(&self.path, self.n_bytes as u64).map_err(refusal_of)?;
        String::from_utf8(bytes).map_err(|_| Refusal::Changed)
    }

    /// Appends bytes, synchronized; after a failure the file is as before, or shortened at the next write.
    fn write(&mut self, bytes: &[u8]) -> std::result::Result<(), Refusal> {
        // Another program may remove the file at any time, for example `chaic study delete`.
        let mut file = open_existing_for_append(&self.path).map_err(refusal_of)?;
        let metadata = fs::metadata(&self.path);
        let metadata = metadata.map_err(FileError::context("read the size of", &self.path));
        let length = metadata.map_err(refusal_of)?.len();
        let expected = self.n_bytes as u64;
        if length != expected && !self.is_torn {
            return Err(Refusal::Changed);
        }
        let mut write = || -> io::Result<()> {
            if length != expected {
                file.set_len(expected)?;
            }
            file.write_all(bytes)?;
            file.sync_data()
        };
        let written = write();
        self.is_torn = written.is_err();
        if written.is_err() {
            // If this fails as well, the next write truncates the file.
            let _ = file.set_len(expected);
        }
        Ok(written.map_err(FileError::context("write", &self.path))?)
    }
}

/// Returns the refusal for a failed operation on the file of a participant; without the file, the participant is
/// unknown.
fn refusal_of(error: FileError) -> Refusal {
    match error.error.kind() {
        ErrorKind::NotFound => Refusal::Unknown,
        _ => error.into(),
    }
}

/// Returns whether the page has this stored line, too.
fn is_of_page(plan: &StudyPlan, line: &str) -> bool {
    plan.study().play.simulator == Simulator::Page || !line.starts_with(TRACE_BEGIN)
}

/// Returns whether two lines are the first record of one participant. In a study that the server simulates, the
/// record of the page has the digest of the page instead of that of the study.
fn is_same_start(plan: &StudyPlan, known: &str, sent: &str) -> bool {
    let start = |line: &str| match DataRecord::parse(line) {
        Ok(DataRecord::Start { format, version, code, slot, .. }) => {
            Some((format, version, code, slot))
        }
        _ => None,
    };
    plan.study().play.simulator == Simulator::Server
        && start(known).is_some_and(|known| start(sent) == Some(known))
}

/// Refuses records of a page that only the server writes.
fn from_page(plan: &StudyPlan, record: DataRecord) -> std::result::Result<DataRecord, String> {
    let is_of_server = match record {
        DataRecord::Trace { .. } => true,
        DataRecord::TrialEnd { outcome, .. } => outcome == TrialEnd::Ended,
        _ => false,
    };
    if is_of_server && plan.study().play.simulator == Simulator::Server {
        return Err("the server of this study writes traces and ends of episodes".to_owned());
    }
    Ok(record)
}

fn remove_if_present(path: &Path) -> chaic_files::Result<()> {
    if kind(path)? == EntryKind::Missing { Ok(()) } else { remove_file(path) }
}
