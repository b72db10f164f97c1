//! Record of one agent in one episode run: an append-only file of JSON lines.
//!
//! When an interrupted episode is played again, existing entries are reused as long as the requests
//! are equal, so that no answered request is sent twice. A record that can't be continued is kept, and so
//! is a copy of one whose requests differ. No request is sent whose answer might have no room.

mod kept;

use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use chaic_core::AgentId;
use chaic_env::{RunKey, slug};
use chaic_files::{
    EntryKind, OutputFile, create_folders_below, kind_below, open_or_create, read_below, walk,
};
use serde::{Deserialize, Serialize};

use crate::error::{LlmError, Result};
use crate::exchange::{ChatRequest, DecisionRecord, Exchange};

pub(crate) use kept::with_copies;

/// Format name in the first line.
pub const FORMAT: &str = "chaic-llm";
/// Version of the format.
pub const VERSION: u32 = 1;
/// Extension of the files.
const EXTENSION: &str = "jsonl";
/// Maximum size of a record, MiB: a hundred times a typical one.
const MAX_RECORD_MIB: u64 = 256;
/// The same in bytes.
const MAX_RECORD_BYTES: u64 = MAX_RECORD_MIB << 20;
/// Maximum size of the first line of a record, bytes: a hundred times a typical one.
const MAX_HEADER_BYTES: u64 = 1 << 16;
/// Maximum size of a failed attempt in an entry, bytes: its description has a few hundred characters.
const MAX_FAULT_BYTES: u64 = 1 << 12;
/// Maximum size of the other parts of an exchange besides request, answer and failed attempts, and of
/// its decision, bytes.
const MAX_OVERHEAD_BYTES: u64 = 1 << 13;

/// Returns the folder of a run's records.
pub fn folder(run: &Path) -> PathBuf {
    run.join("llm")
}

/// Returns the path of the record of one agent in one episode run.
pub fn path(run: &Path, key: &RunKey, agent: AgentId) -> PathBuf {
    let name = format!("{}-s{}.{agent}.jsonl", slug(key.task, &key.episode), key.seed);
    folder(run).join(key.task.name()).join(&key.helper).join(name)
}

/// Returns the episode run of an agent's record, by the episode's id with or without the task. Without `seed`,
/// selects the lowest one.
///
/// # Errors
/// If the folder or the record cannot be read, or the record is of another episode run.
pub fn find(
    run: &Path,
    episode: &str,
    helper: &str,
    seed: Option<u32>,
    agent: AgentId,
) -> Result<Option<RunKey>> {
    let seed_of = |record: &Path| {
        // llm/TASK/HELPER/EPISODE-sSEED.AGENT.jsonl
        let part = |up: usize| record.iter().rev().nth(up).and_then(|part| part.to_str());
        let name = part(0)?.strip_suffix(&format!(".{agent}.jsonl"))?;
        let prefix = format!("{}-s", slug(part(2)?.parse().ok()?, episode));
        let found: u32 = name.strip_prefix(&prefix)?.parse().ok()?;
        (part(1) == Some(helper) && seed.is_none_or(|seed| seed == found)).then_some(found)
    };
    let records = all(run)?.into_iter();
    let found = records.filter_map(|record| Some((seed_of(&record)?, record))).min();
    let Some((_, record)) = found else { return Ok(None) };
    let key = DecisionLog::read(run, &record)?.header.key;
    if path(run, &key, agent) != record {
        let problem =
            format!("is of {} with helper {}, seed {}", key.episode, key.helper, key.seed);
        return Err(LlmError::Unreadable { path: record, line: 1, problem });
    }
    Ok(Some(key))
}

/// First line of a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordHeader {
    /// Always [`FORMAT`].
    pub format: String,
    /// Always [`VERSION`].
    pub version: u32,
    /// Episode run.
    #[serde(rename = "of")]
    pub key: RunKey,
    /// Agent.
    pub agent: AgentId,
    /// Model.
    pub model: String,
}

impl RecordHeader {
    /// Creates the header for an agent in an episode run.
    pub fn new(key: &RunKey, agent: AgentId, model: &str) -> RecordHeader {
        let (format, model) = (FORMAT.to_owned(), model.to_owned());
        RecordHeader { format, version: VERSION, key: key.clone(), agent, model }
    }
}

/// Further line of a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordEntry {
    /// Request and reply.
    Exchange(Box<Exchange>),
    /// Decision.
    #[serde(rename = "decided")]
    Decision(DecisionRecord),
}

impl RecordEntry {
    fn to_line(&self) -> String {
        serde_json::to_string(self).expect("an entry has string keys and finite numbers") + "\n"
    }
}

/// Complete record in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct DecisionLog {
    /// Header.
    pub header: RecordHeader,
    /// Entries, in order.
    pub entries: Vec<RecordEntry>,
    /// End of each entry, bytes from the start of the file.
    ends: Vec<u64>,
    /// End of the first line, bytes.
    header_end: u64,
}

impl DecisionLog {
    /// Reads a record in a run folder, up to its last complete line.
    ///
    /// # Errors
    /// If it cannot be read, is no regular file or behind a link, has another format, or is damaged
    /// before its last line.
    pub fn read(run: &Path, path: &Path) -> Result<DecisionLog> {
        let bytes = read_below(run, path, MAX_RECORD_BYTES + 1)?;
        let wrong = |line: usize, problem: String| LlmError::Unreadable {
            path: path.to_owned(),
            line,
            problem,
        };
        if bytes.len() as u64 > MAX_RECORD_BYTES {
            return Err(wrong(1, format!("is longer than {MAX_RECORD_BYTES} bytes")));
        }
        let mut lines = bytes.split_inclusive(|b| *b == b'\n').enumerate();
        let first = lines.next().and_then(|(_, l)| l.strip_suffix(b"\n"));
        let first = first.ok_or_else(|| wrong(1, "has no complete first line".to_owned()))?;
        let header: RecordHeader =
            serde_json::from_slice(first).map_err(|e| wrong(1, e.to_string()))?;
        if header.format != FORMAT || header.version != VERSION {
            let found = format!("{} version {}", header.format, header.version);
            return Err(wrong(1, format!("is of {found}, expected {FORMAT} version {VERSION}")));
        }
        let mut end = first.len() as u64 + 1;
        let mut record =
            DecisionLog { header, entries: Vec::new(), ends: Vec::new(), header_end: end };
        for (k, line) in lines {
            end += line.len() as u64;
            let is_last = end == bytes.len() as u64;
            match parse(line) {
                Ok(entry) => {
                    record.entries.push(entry);
                    record.ends.push(end);
                }
                Err(_) if is_last => break,
                Err(problem) => return Err(wrong(k + 1, problem)),
            }
        }
        Ok(record)
    }
}

fn parse(line: &[u8]) -> std::result::Result<RecordEntry, String> {
    let line = line.strip_suffix(b"\n").ok_or("is cut off")?;
    let entry: RecordEntry = serde_json::from_slice(line).map_err(|e| e.to_string())?;
    match &entry {
        RecordEntry::Exchange(exchange) if exchange.damage().is_some() => {
            Err(exchange.damage().unwrap_or_default().to_owned())
        }
        _ => Ok(entry),
    }
}

/// Record open for writing.
#[derive(Debug)]
pub struct DecisionLogWriter {
    run: PathBuf,
    path: PathBuf,
    file: OutputFile,
    /// Entries from before.
    before: DecisionLog,
    /// Number of these entries that were reused.
    used: usize,
    /// End of the last reused or written entry, bytes from the start of the file.
    end: u64,
    /// True if the rest of the file must be truncated before a write.
    must_truncate: bool,
    /// Copy of the file before it was truncated, until the caller takes it.
    kept: Option<PathBuf>,
}

impl DecisionLogWriter {
    /// Creates a record in a run folder, or continues an existing record of the same agent.
    ///
    /// # Errors
    /// [`LlmError::NotContinued`] if there is a damaged or too long record, or one of another agent; it
    /// stays as it is. Also if the record is a link or no regular file, or cannot be read or written.
    pub fn open(run: &Path, path: &Path, header: &RecordHeader) -> Result<DecisionLogWriter> {
        create_folders_below(run, path.parent().unwrap_or(run))?;
        let before = match kind_below(run, path)? {
            EntryKind::Missing => None,
            _ => read_before(run, path, header)?,
        };
        let is_new = before.is_none();
        let refused = || LlmError::io("write", path);
        let mut file = open_or_create(path)?;
        let first = serde_json::to_string(header).expect("a header has string keys") + "\n";
        if is_new {
            file.set_len(0).map_err(refused())?;
            file.write_all(first.as_bytes()).map_err(refused())?;
        }
        let before = before.unwrap_or_else(|| DecisionLog {
            header: header.clone(),
            entries: Vec::new(),
            ends: Vec::new(),
            header_end: first.len() as u64,
        });
        let (run, path, end) = (run.to_owned(), path.to_owned(), before.header_end);
        let (used, must_truncate, kept) = (0, true, None);
        Ok(DecisionLogWriter { run, path, file, before, used, end, must_truncate, kept })
    }

    /// Returns the recorded exchange of this request, if the record has it at this position.
    pub fn recorded_exchange(&mut self, request: &ChatRequest) -> Option<Exchange> {
        let RecordEntry::Exchange(exchange) = self.before.entries.get(self.used)? else {
            return None;
        };
        (exchange.request_hash == request.hash()).then(|| (**exchange).clone())
    }

    /// Checks that the record has room for the exchange and the decision of a request with the longest
    /// answer and the most failed attempts.
    ///
    /// # Errors
    /// [`LlmError::RecordFull`] if it may have none.
    pub fn check_room(
        &self,
        request: &ChatRequest,
        max_answer_bytes: u64,
        max_attempts: u32,
    ) -> Result<()> {
        let request_bytes = serde_json::to_vec(request).expect("a request has string keys").len();
        // An answer is no longer in the record than in the response, where it was JSON too.
        let max_reply_bytes = max_answer_bytes + u64::from(max_attempts) * MAX_FAULT_BYTES;
        let end = self.end + request_bytes as u64 + max_reply_bytes + MAX_OVERHEAD_BYTES;
        if end > MAX_RECORD_BYTES { Err(self.full()) } else { Ok(()) }
    }

    fn full(&self) -> LlmError {
        LlmError::RecordFull { path: self.path.clone(), max_mib: MAX_RECORD_MIB }
    }

    /// Returns the path of the copy that the last [`DecisionLogWriter::push`] made.
    pub fn take_copy_path(&mut self) -> Option<PathBuf> {
        self.kept.take()
    }

    /// Appends an entry, unless the record has it at this position. If it has other exchanges there, a copy
    /// of the record is kept first.
    ///
    /// # Errors
    /// If the file cannot be written, or would become larger than what [`DecisionLog::read`] reads.
    /// A refused entry leaves the file as it is.
    pub fn push(&mut self, entry: RecordEntry) -> Result<()> {
        if self.before.entries.get(self.used) == Some(&entry) {
            self.end = self.before.ends[self.used];
            self.used += 1;
            return Ok(());
        }
        let line = entry.to_line();
        let end = self.end + line.len() as u64;
        if end > MAX_RECORD_BYTES {
            return Err(self.full());
        }
        let mut rest = self.before.entries[self.used..].iter();
        if self.must_truncate && rest.any(|entry| matches!(entry, RecordEntry::Exchange(_))) {
            self.kept = Some(kept::keep(&self.run, &self.path)?);
        }
        let refused = || LlmError::io("write", &self.path);
        if std::mem::take(&mut self.must_truncate) {
            self.file.set_len(self.end).map_err(refused())?;
            self.file.seek(SeekFrom::Start(self.end)).map_err(refused())?;
            self.before.entries.truncate(self.used);
        }
        let written = self.file.write_all(line.as_bytes());
        written.and_then(|()| self.file.sync_data()).map_err(refused())?;
        self.end = end;
        Ok(())
    }
}

/// Returns whether a record was stopped in its first line, and so has no entry.
pub(crate) fn is_unstarted(run: &Path, path: &Path) -> Result<bool> {
    let start = read_below(run, path, MAX_HEADER_BYTES + 1)?;
    Ok(start.len() as u64 <= MAX_HEADER_BYTES && !start.contains(&b'\n'))
}

/// Reads the record that a resumed episode continues; `None` if it [has no entry](is_unstarted).
fn read_before(run: &Path, path: &Path, header: &RecordHeader) -> Result<Option<DecisionLog>> {
    if is_unstarted(run, path)? {
        return Ok(None);
    }
    let problem = match DecisionLog::read(run, path) {
        Ok(record) if record.header == *header => return Ok(Some(record)),
        Ok(DecisionLog { header: RecordHeader { key, agent, model, .. }, .. }) => format!(
            "is of {} with helper {}, seed {}, agent {agent} and model {model}",
            key.episode, key.helper, key.seed
        ),
        Err(LlmError::Unreadable { line, problem, .. }) => format!("line {line}: {problem}"),
        Err(error) => return Err(error),
    };
    Err(LlmError::NotContinued { path: path.to_owned(), problem })
}

/// Returns the paths of all records of a run, sorted, without links and kept copies.
///
/// # Errors
/// If the folder cannot be read.
pub fn all(run: &Path) -> Result<Vec<PathBuf>> {
    let is_record = |entry: &chaic_files::DirectoryEntry| {
        entry.kind == EntryKind::File && kept::is_record(&entry.path)
    };
    Ok(walk(&folder(run), 2)?.into_iter().filter(is_record).map(|entry| entry.path).collect())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use chaic_core::TaskId;

    use super::*;
    use crate::exchange::{DecisionSource, Fault, FaultKind, Message, Purpose, Reply, Role};

    fn request(text: &str) -> ChatRequest {
        let message = Message { role: Role::User, text: text.to_owned(), images: Vec::new() };
        let (model, messages) = ("m".to_owned(), vec![message]);
        ChatRequest { model, purpose: Purpose::Decide, messages, n_schema_plans: Some(3) }
    }

    pub(super) fn exchange(text: &str) -> RecordEntry {
        let fault = Fault { kind: FaultKind::Empty, status: None, detail: "empty".to_owned() };
        RecordEntry::Exchange(Box::new(Exchange::new(
            7,
            request(text),
            vec![],
            Reply::Failed(fault),
        )))
    }

    pub(super) fn decided(frame: u32) -> RecordEntry {
        RecordEntry::Decision(DecisionRecord {
            frame,
            number: Some(1),
            plan: "explore".to_owned(),
            source: DecisionSource::Model,
            lenient: false,
            prompt_tokens: None,
            shortened: 0,
            thinking_frames: 0,
        })
    }

    pub(super) fn header() -> RecordHeader {
        let (task, helper) = (TaskId::Obstacle, "llm".to_owned());
        let key = RunKey { task, helper, episode: "obstacle/test/00".to_owned(), seed: 0 };
        RecordHeader::new(&key, AgentId::HELPER, "m")
    }

    pub(super) fn write(path: &Path, entries: &[RecordEntry]) {
        let run = path.parent().unwrap();
        let mut recorder = DecisionLogWriter::open(run, path, &header()).unwrap();
        entries.iter().for_each(|e| recorder.push(e.clone()).unwrap());
    }

    #[test]
    fn a_record_is_found_by_its_episode() {
        let dir = tempfile::tempdir().unwrap();
        let run = dir.path();
        let key = |seed| RunKey { seed, ..header().key };
        for seed in [10, 2] {
            let header = RecordHeader::new(&key(seed), AgentId::HELPER, "m");
            DecisionLogWriter::open(run, &path(run, &key(seed), AgentId::HELPER), &header).unwrap();
        }
        let found = |episode: &str, helper: &str, seed, agent| {
            find(run, episode, helper, seed, agent).unwrap().map(|key| key.seed)
        };
        let me = AgentId::HELPER;
        for episode in ["obstacle/test/00", "test/00"] {
            assert_eq!(found(episode, "llm", None, me), Some(2), "{episode}");
            assert_eq!(found(episode, "llm", Some(10), me), Some(10), "{episode}");
        }
        assert_eq!(found("test/00", "llm", Some(1), me), None);
        assert_eq!(found("test/00", "vlm", None, me), None);
        assert_eq!(found("test/0", "llm", None, me), None);
        assert_eq!(found("test/00", "llm", None, AgentId::PARTNER), None);
        // A forged name.
        let forged = path(run, &key(1), me);
        fs::rename(path(run, &key(2), me), forged).unwrap();
        let error = find(run, "test/00", "llm", None, me).unwrap_err().to_string();
        assert!(error.contains("is of obstacle/test/00 with helper llm, seed 2"), "{error}");
    }

    #[test]
    fn recorded_exchanges_are_reused_until_an_entry_differs() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("a")).unwrap();
        let path = dir.path().join("a/r.jsonl");
        let whole = [exchange("one"), decided(1), exchange("two"), decided(2)];
        write(&path, &whole);
        let bytes = fs::read(&path).unwrap();
        assert_eq!(DecisionLog::read(dir.path(), &path).unwrap().entries, whole);

        let mut again = DecisionLogWriter::open(dir.path(), &path, &header()).unwrap();
        assert!(again.recorded_exchange(&request("other")).is_none());
        assert!(again.recorded_exchange(&request("one")).is_some());
        again.push(exchange("one")).unwrap();
        assert!(again.recorded_exchange(&request("two")).is_none(), "the decision comes first");
        again.push(decided(1)).unwrap();
        assert!(again.recorded_exchange(&request("two")).is_some());
        drop(again);
        assert_eq!(fs::read(&path).unwrap(), bytes, "equal entries are not written again");

        write(&path, &[exchange("one"), decided(1), exchange("three")]);
        let other = DecisionLog::read(dir.path(), &path).unwrap().entries;
        assert_eq!(other, [exchange("one"), decided(1), exchange("three")]);
    }

    #[test]
    fn a_torn_last_line_is_ignored_and_a_changed_line_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        write(&path, &[exchange("one"), decided(1), exchange("two")]);
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        assert_eq!(
            DecisionLog::read(dir.path(), &path).unwrap().entries,
            [exchange("one"), decided(1)]
        );
        // Continuing truncates a torn last line.
        write(&path, &[exchange("one"), decided(1), exchange("two")]);
        assert_eq!(fs::read_to_string(&path).unwrap(), whole);

        fs::write(&path, whole.replacen("one", "0ne", 1)).unwrap();
        let error = DecisionLog::read(dir.path(), &path).unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("request differs"), "{error}");
    }

    #[test]
    fn a_record_never_grows_beyond_what_can_be_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        let entries = || DecisionLog::read(dir.path(), &path).unwrap().entries;
        write(&path, &[exchange("one"), exchange("two")]);
        let mut recorder = DecisionLogWriter::open(dir.path(), &path, &header()).unwrap();
        let start = recorder.end;
        recorder.push(exchange("one")).unwrap();
        assert_eq!(recorder.end - start, exchange("one").to_line().len() as u64);
        // As if the record were almost full.
        let end = recorder.end;
        recorder.end = MAX_RECORD_BYTES + 1 - decided(1).to_line().len() as u64;
        let error = recorder.push(decided(1)).unwrap_err().to_string();
        assert!(error.contains("r.jsonl can't grow beyond 256 MiB"), "{error}");
        assert!(!error.contains('\n'), "{error}");
        assert_eq!(entries(), [exchange("one"), exchange("two")], "the file is unchanged");
        recorder.end = end;
        recorder.push(decided(1)).unwrap();
        recorder.end = MAX_RECORD_BYTES - decided(2).to_line().len() as u64;
        recorder.push(decided(2)).unwrap();
        assert_eq!(recorder.end, MAX_RECORD_BYTES);
        assert!(recorder.push(decided(3)).is_err());
        assert_eq!(entries(), [exchange("one"), decided(1), decided(2)]);
    }

    #[test]
    fn a_record_with_room_takes_the_longest_answer() {
        const MAX_ANSWER: usize = 1000;
        const ATTEMPTS: usize = 3;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        let mut recorder = DecisionLogWriter::open(dir.path(), &path, &header()).unwrap();
        recorder.push(decided(0)).unwrap();
        let request = request("two");
        let mut has_room = |left: u64| {
            recorder.end = MAX_RECORD_BYTES - left;
            recorder.check_room(&request, MAX_ANSWER as u64, ATTEMPTS as u32).is_ok()
        };
        let left = (0..).step_by(64).find(|left| has_room(*left)).unwrap();
        assert!(left < 64 << 10 && !has_room(left - 64) && has_room(left));
        let detail = "\u{10ffff}".repeat(300) + &"\"".repeat(100);
        let fault = Fault { kind: FaultKind::Connection, status: Some(u16::MAX), detail };
        let reply = Reply::Answer {
            text: "a".repeat(MAX_ANSWER),
            finish: Some("\u{10ffff}".repeat(300)),
            usage: Default::default(),
            latency_ms: u64::MAX,
        };
        let exchange = Exchange::new(u32::MAX, request.clone(), vec![fault; ATTEMPTS], reply);
        recorder.push(RecordEntry::Exchange(Box::new(exchange))).unwrap();
        recorder.push(decided(1)).unwrap();
    }

    #[test]
    fn a_record_that_was_stopped_in_its_first_line_is_started_again() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        for torn in ["", "{\"format\":\"cha", "\0\0\0\0"] {
            fs::write(&path, torn).unwrap();
            write(&path, &[decided(1)]);
            assert_eq!(DecisionLog::read(dir.path(), &path).unwrap().entries, [decided(1)]);
        }
    }

    #[test]
    fn a_record_that_cannot_be_continued_is_kept() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        write(&path, &[exchange("one"), decided(1)]);
        let whole = fs::read_to_string(&path).unwrap();
        for (text, problem) in [
            ("{}\n".to_owned(), "line 1: missing field"),
            (whole.replacen("\"version\":1", "\"version\":2", 1), "chaic-llm version 2"),
            (whole.replacen("one", "0ne", 1), "line 2: the request differs from its hash"),
            (whole.replacen("\"model\":\"m\"", "\"model\":\"n\"", 1), "and model n"),
            ("x".repeat(MAX_HEADER_BYTES as usize + 1), "line 1: has no complete first line"),
        ] {
            fs::write(&path, &text).unwrap();
            let opened = DecisionLogWriter::open(dir.path(), &path, &header());
            let error = opened.unwrap_err().to_string();
            assert!(error.contains(problem) && error.contains("paid answers"), "{error}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text, "{problem}");
        }
        // An earlier version wrote more than is read.
        fs::write(&path, &whole).unwrap();
        open_or_create(&path).unwrap().set_len(MAX_RECORD_BYTES + 1).unwrap();
        let opened = DecisionLogWriter::open(dir.path(), &path, &header());
        let error = opened.unwrap_err().to_string();
        assert!(error.contains("is longer than 268435456 bytes"), "{error}");
        assert_eq!(fs::metadata(&path).unwrap().len(), MAX_RECORD_BYTES + 1);
    }

    #[cfg(unix)]
    #[test]
    fn no_record_is_read_or_written_through_a_link() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let (run, outside) = (dir.path().join("run"), dir.path().join("outside.jsonl"));
        fs::create_dir_all(run.join("llm/a")).unwrap();
        fs::write(&outside, "unchanged").unwrap();
        symlink(&outside, run.join("llm/a/r.jsonl")).unwrap();
        symlink(run.join("llm/a"), run.join("llm/b")).unwrap();
        for name in ["llm/a/r.jsonl", "llm/b/r.jsonl", "llm/b/new.jsonl"] {
            let path = run.join(name);
            let error = DecisionLogWriter::open(&run, &path, &header()).unwrap_err().to_string();
            assert!(error.contains("it is a link"), "{error}");
            assert!(DecisionLog::read(&run, &path).is_err(), "{name}");
        }
        assert_eq!(fs::read(&outside).unwrap(), b"unchanged");
        assert_eq!(all(&run).unwrap(), [] as [PathBuf; 0]);
    }
}
