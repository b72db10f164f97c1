//! The record of one mind in one episode: a file of JSON lines that is only ever appended to.
//!
//! What is there already when an episode is played (because the run was cut short) is used again
//! as long as the questions are the same: nothing that was answered is asked twice.

use std::fs::File;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use chaic_core::AgentId;
use chaic_env::{RunKey, slug};
use chaic_files::{EntryKind, kind_below, make_folders_below, open_or_create, read_below, walk};
use serde::{Deserialize, Serialize};

use crate::error::{LlmError, Result};
use crate::exchange::{Ask, Decided, Exchange};

/// What the first line says.
pub const FORMAT: &str = "chaic-llm";
/// The version of the format.
pub const VERSION: u32 = 1;
/// Longest record that is read, bytes: a hundred times a usual one.
const MAX_RECORD_BYTES: u64 = 256 << 20;

/// The folder of a run's records.
pub fn folder(run: &Path) -> PathBuf {
    run.join("llm")
}

/// The record of one mind in one episode run.
pub fn path(run: &Path, key: &RunKey, agent: AgentId) -> PathBuf {
    let name = format!("{}-s{}.{agent}.jsonl", slug(key.task, &key.episode), key.seed);
    folder(run).join(key.task.name()).join(&key.helper).join(name)
}

/// The first line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Always [`FORMAT`].
    pub format: String,
    /// Always [`VERSION`].
    pub version: u32,
    /// The episode run.
    pub of: RunKey,
    /// Whose mind.
    pub agent: AgentId,
    /// The model.
    pub model: String,
}

impl Head {
    /// Of a mind in an episode run.
    pub fn new(key: &RunKey, agent: AgentId, model: &str) -> Head {
        let (format, model) = (FORMAT.to_owned(), model.to_owned());
        Head { format, version: VERSION, of: key.clone(), agent, model }
    }
}

/// A further line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Entry {
    /// The model was asked.
    Exchange(Box<Exchange>),
    /// Something was decided.
    Decided(Decided),
}

impl Entry {
    fn to_line(&self) -> String {
        serde_json::to_string(self).expect("an entry has string keys and finite numbers") + "\n"
    }
}

/// A whole record in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Whose.
    pub head: Head,
    /// What happened, in order.
    pub entries: Vec<Entry>,
    /// Where each entry ends, bytes from the beginning.
    ends: Vec<u64>,
    /// Where the first line ends.
    head_end: u64,
}

impl Record {
    /// Reads a record below the folder of its run up to its last complete line.
    ///
    /// # Errors
    /// If it can't be read, is no regular file or behind a link, is something else, or is damaged before its
    /// last line.
    pub fn read(run: &Path, path: &Path) -> Result<Record> {
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
        let first = first.ok_or_else(|| wrong(1, "has no whole first line".to_owned()))?;
        let head: Head = serde_json::from_slice(first).map_err(|e| wrong(1, e.to_string()))?;
        if head.format != FORMAT || head.version != VERSION {
            let found = format!("{} version {}", head.format, head.version);
            return Err(wrong(1, format!("is of {found}, expected {FORMAT} version {VERSION}")));
        }
        let mut end = first.len() as u64 + 1;
        let mut record = Record { head, entries: Vec::new(), ends: Vec::new(), head_end: end };
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

fn parse(line: &[u8]) -> std::result::Result<Entry, String> {
    let line = line.strip_suffix(b"\n").ok_or("is cut off")?;
    let entry: Entry = serde_json::from_slice(line).map_err(|e| e.to_string())?;
    match &entry {
        Entry::Exchange(exchange) if exchange.damage().is_some() => {
            Err(exchange.damage().unwrap_or_default().to_owned())
        }
        _ => Ok(entry),
    }
}

/// A record that is being written.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    file: File,
    /// What was there before.
    before: Record,
    /// How much of it has come true again.
    used: usize,
    /// Whether what follows in the file is to be cut off before writing.
    is_behind: bool,
}

impl Recorder {
    /// Begins a record below the folder of a run, or continues an existing record of the same mind.
    ///
    /// # Errors
    /// If it is a link or no regular file, or the file system refuses.
    pub fn open(run: &Path, path: &Path, head: &Head) -> Result<Recorder> {
        make_folders_below(run, path.parent().unwrap_or(run))?;
        let before = match kind_below(run, path)? {
            EntryKind::Missing => None,
            // Damaged or of something else: of no use, and replaced.
            _ => Record::read(run, path).ok().filter(|record| record.head == *head),
        };
        let is_new = before.is_none();
        let refused = || LlmError::io("write", path);
        let mut file = open_or_create(path)?;
        let first = serde_json::to_string(head).expect("a head has string keys") + "\n";
        if is_new {
            file.set_len(0).map_err(refused())?;
            file.write_all(first.as_bytes()).map_err(refused())?;
        }
        let before = before.unwrap_or_else(|| Record {
            head: head.clone(),
            entries: Vec::new(),
            ends: Vec::new(),
            head_end: first.len() as u64,
        });
        Ok(Recorder { path: path.to_owned(), file, before, used: 0, is_behind: true })
    }

    /// The exchange that was recorded for this question at this point, if the record is still
    /// ahead.
    pub fn known(&mut self, ask: &Ask) -> Option<Exchange> {
        let Entry::Exchange(exchange) = self.before.entries.get(self.used)? else { return None };
        (exchange.ask_hash == ask.hash()).then(|| (**exchange).clone())
    }

    /// Appends an entry, unless it stands there already.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn push(&mut self, entry: Entry) -> Result<()> {
        if self.before.entries.get(self.used) == Some(&entry) {
            self.used += 1;
            return Ok(());
        }
        let refused = || LlmError::io("write", &self.path);
        if std::mem::take(&mut self.is_behind) {
            let end = self.used.checked_sub(1).and_then(|k| self.before.ends.get(k));
            let end = end.copied().unwrap_or(self.before.head_end);
            self.file.set_len(end).map_err(refused())?;
            self.file.seek(SeekFrom::Start(end)).map_err(refused())?;
            self.before.entries.truncate(self.used);
        }
        self.file.write_all(entry.to_line().as_bytes()).map_err(refused())
    }
}

/// Returns the paths of all records of a run, sorted. Links are left out.
///
/// # Errors
/// If the file system refuses.
pub fn all(run: &Path) -> Result<Vec<PathBuf>> {
    let is_record = |entry: &chaic_files::Entry| {
        entry.kind == EntryKind::File && entry.path.extension().is_some_and(|e| e == "jsonl")
    };
    Ok(walk(&folder(run), 2)?.into_iter().filter(is_record).map(|entry| entry.path).collect())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use chaic_core::TaskId;

    use super::*;
    use crate::exchange::{By, Fault, FaultKind, Message, Purpose, Reply, Role};

    fn ask(text: &str) -> Ask {
        let message = Message { role: Role::User, text: text.to_owned(), images: Vec::new() };
        let (model, messages) = ("m".to_owned(), vec![message]);
        Ask { model, purpose: Purpose::Decide, messages, schema_of: Some(3) }
    }

    fn exchange(text: &str) -> Entry {
        let fault = Fault { kind: FaultKind::Empty, status: None, detail: "empty".to_owned() };
        Entry::Exchange(Box::new(Exchange::new(7, ask(text), vec![], Reply::Failed(fault))))
    }

    fn decided(frame: u32) -> Entry {
        Entry::Decided(Decided {
            frame,
            number: Some(1),
            plan: "explore".to_owned(),
            by: By::Model,
            lenient: false,
            prompt_tokens: None,
            shortened: 0,
            thinking_frames: 0,
        })
    }

    fn head() -> Head {
        let (task, helper) = (TaskId::Obstacle, "llm".to_owned());
        let key = RunKey { task, helper, episode: "obstacle/test/00".to_owned(), seed: 0 };
        Head::new(&key, AgentId::HELPER, "m")
    }

    fn write(path: &Path, entries: &[Entry]) {
        let run = path.parent().unwrap();
        let mut recorder = Recorder::open(run, path, &head()).unwrap();
        entries.iter().for_each(|e| recorder.push(e.clone()).unwrap());
    }

    #[test]
    fn what_was_answered_is_known_again_until_something_differs() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("a")).unwrap();
        let path = dir.path().join("a/r.jsonl");
        let whole = [exchange("one"), decided(1), exchange("two"), decided(2)];
        write(&path, &whole);
        let bytes = fs::read(&path).unwrap();
        assert_eq!(Record::read(dir.path(), &path).unwrap().entries, whole);

        let mut again = Recorder::open(dir.path(), &path, &head()).unwrap();
        assert!(again.known(&ask("other")).is_none());
        assert!(again.known(&ask("one")).is_some());
        again.push(exchange("one")).unwrap();
        assert!(again.known(&ask("two")).is_none(), "first comes the decision");
        again.push(decided(1)).unwrap();
        assert!(again.known(&ask("two")).is_some());
        drop(again);
        assert_eq!(
            fs::read(&path).unwrap(),
            bytes,
            "as long as nothing differs nothing is written"
        );

        write(&path, &[exchange("one"), decided(1), exchange("three")]);
        let other = Record::read(dir.path(), &path).unwrap().entries;
        assert_eq!(other, [exchange("one"), decided(1), exchange("three")]);
    }

    #[test]
    fn a_torn_line_is_left_out_and_a_changed_one_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        write(&path, &[exchange("one"), decided(1), exchange("two")]);
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        assert_eq!(Record::read(dir.path(), &path).unwrap().entries, [exchange("one"), decided(1)]);
        // Going on after a torn line cuts it off.
        write(&path, &[exchange("one"), decided(1), exchange("two")]);
        assert_eq!(fs::read_to_string(&path).unwrap(), whole);

        fs::write(&path, whole.replacen("one", "0ne", 1)).unwrap();
        let said = Record::read(dir.path(), &path).unwrap_err().to_string();
        assert!(said.contains("line 2") && said.contains("question"), "{said}");
    }

    #[test]
    fn a_record_of_something_else_is_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.jsonl");
        fs::write(&path, "{}\n").unwrap();
        write(&path, &[decided(1)]);
        assert_eq!(Record::read(dir.path(), &path).unwrap().entries, [decided(1)]);
    }

    #[cfg(unix)]
    #[test]
    fn no_record_is_read_or_written_through_a_link() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let (run, own) = (dir.path().join("run"), dir.path().join("own.jsonl"));
        fs::create_dir_all(run.join("llm/a")).unwrap();
        fs::write(&own, "dear").unwrap();
        symlink(&own, run.join("llm/a/r.jsonl")).unwrap();
        symlink(run.join("llm/a"), run.join("llm/b")).unwrap();
        for name in ["llm/a/r.jsonl", "llm/b/r.jsonl", "llm/b/new.jsonl"] {
            let path = run.join(name);
            let said = Recorder::open(&run, &path, &head()).unwrap_err().to_string();
            assert!(said.contains("it is a link"), "{said}");
            assert!(Record::read(&run, &path).is_err(), "{name}");
        }
        assert_eq!(fs::read(&own).unwrap(), b"dear");
        assert_eq!(all(&run).unwrap(), [] as [PathBuf; 0]);
    }
}
