//! Participants with their slots and files. The module is independent of HTTP, and time is a
//! parameter.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chaic_files::{
    EntryKind, FolderLock, TEMPORARY_SUFFIX, create_folders, entries, kind, read_bounded,
    remove_file,
};
use chaic_study::data::{DataRecord, is_code};
use chaic_study::{RecordCheck, SlotHolder, StudyPlan, Trial, lowest_free_slot};

use crate::access::TokenDigest;
use crate::error::{Result, ServerError};
use crate::limits::{ENTRY_RATE, PARTICIPANTS_PER_SLOT};
use crate::log::{Log, token_path};
use crate::refusal::Refusal;
use crate::token_bucket::TokenBucket;

/// Extension of the files of participants.
const ENDING: &str = "jsonl";
/// Seconds of a minute.
const SECS_PER_MINUTE: u64 = 60;

/// Participants of a study in a folder, which is locked.
///
/// Slots follow from the files ([`lowest_free_slot`]). After a restart of the server, time-outs start again.
pub struct Store {
    plan: StudyPlan,
    folder: PathBuf,
    participants: Mutex<Participants>,
    _lock: FolderLock,
}

struct Participants {
    by_code: BTreeMap<String, Arc<Participant>>,
    entry_bucket: TokenBucket,
}

/// A participant with a file.
struct Participant {
    slot: u32,
    /// Time of the entry.
    since_secs: u64,
    /// `None` for a file that was not collected by a server.
    token: Option<TokenDigest>,
    is_complete: AtomicBool,
    /// `None` after the data were deleted.
    log: Mutex<Option<Log>>,
}

/// Answer to a participant who enters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EntryAnswer {
    /// Line of the first record.
    pub start: String,
    /// Slot.
    pub slot: u32,
    /// Number of stored records.
    pub stored: usize,
}

/// Trial that a participant plays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunningTrial {
    /// The trial.
    pub trial: Trial,
    /// Its stored trace.
    pub trace: String,
}

/// Number of participants with files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParticipantCounts {
    /// All participants.
    pub participants: usize,
    /// Participants who have finished.
    pub complete: usize,
}

impl Store {
    /// Opens a folder, which is created if it is missing, and reads the files of its participants.
    ///
    /// An incomplete last line, which a power failure leaves, was not acknowledged and is removed.
    ///
    /// # Errors
    /// If the folder is in use, or a file is not one of this study.
    pub fn open(plan: StudyPlan, folder: &Path, now_secs: u64) -> Result<Store> {
        create_folders(folder)?;
        let lock = FolderLock::acquire(folder)?;
        let mut by_code = BTreeMap::new();
        for path in entries(folder)? {
            if let Some(code) = code_of(&path) {
                let participant = Participant::read(&plan, code, &path, now_secs)?;
                by_code.insert(code.to_owned(), Arc::new(participant));
            }
        }
        remove_leftovers(folder, &by_code)?;
        let entry_bucket = TokenBucket::new(ENTRY_RATE, now_secs);
        let participants = Mutex::new(Participants { by_code, entry_bucket });
        Ok(Store { plan, folder: folder.to_owned(), participants, _lock: lock })
    }

    /// Gives a slot to a new participant and creates the file; a repetition has the same answer.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn enter(
        &self,
        code: &str,
        token: &TokenDigest,
        now_secs: u64,
    ) -> std::result::Result<EntryAnswer, Refusal> {
        let mut participants = lock(&self.participants);
        if let Some(known) = participants.by_code.get(code).cloned() {
            drop(participants);
            known.authorize(token)?;
            let mut log = lock(&known.log);
            let log = log.as_mut().ok_or(Refusal::Unknown)?;
            log.take_token(now_secs)?;
            let (start, slot) = (log.first_line()?, known.slot);
            return Ok(EntryAnswer { start, slot, stored: log.n_page_records() });
        }
        if !participants.entry_bucket.take(now_secs) {
            return Err(Refusal::Rate);
        }
        let slot = self.free_slot(&participants.by_code, now_secs).ok_or(Refusal::Full)?;
        let participant = Arc::new(Participant {
            slot,
            since_secs: now_secs,
            token: Some(token.clone()),
            is_complete: AtomicBool::new(false),
            log: Mutex::new(None),
        });
        // Other requests for this code wait until the file exists.
        let mut log = lock(&participant.log);
        participants.by_code.insert(code.to_owned(), Arc::clone(&participant));
        drop(participants);
        let start = DataRecord::start(self.plan.digest(), code, slot).to_line();
        let check = RecordCheck::new(&self.plan, self.plan.digest(), slot);
        let check = check.expect("a slot of the study");
        match Log::create(self.path(code), check, token, &start, now_secs) {
            Ok(created) => {
                *log = Some(created);
                Ok(EntryAnswer { start, slot, stored: 1 })
            }
            Err(refusal) => {
                lock(&self.participants).by_code.remove(code);
                Err(refusal)
            }
        }
    }

    /// Returns the number of stored records of a participant.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn stored(
        &self,
        code: &str,
        token: &TokenDigest,
        now_secs: u64,
    ) -> std::result::Result<usize, Refusal> {
        let participant = self.find(code, token)?;
        let mut log = lock(&participant.log);
        let log = log.as_mut().ok_or(Refusal::Unknown)?;
        log.take_token(now_secs)?;
        Ok(log.n_page_records())
    }

    /// Returns a running trial of a participant.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn running_trial(
        &self,
        code: &str,
        token: &TokenDigest,
        number: usize,
        now_secs: u64,
    ) -> std::result::Result<RunningTrial, Refusal> {
        let participant = self.find(code, token)?;
        let mut log = lock(&participant.log);
        let log = log.as_mut().ok_or(Refusal::Unknown)?;
        log.take_token(now_secs)?;
        match log.is_running(number) {
            None => Err(Refusal::NotBegun(number)),
            Some(false) => Err(Refusal::Over),
            Some(true) => {
                Ok(RunningTrial { trial: log.trials()[number], trace: log.trace(number)? })
            }
        }
    }

    /// Returns whether a trial of a participant runs.
    pub fn is_running(&self, code: &str, number: usize) -> bool {
        let found = lock(&self.participants).by_code.get(code).cloned();
        found.is_some_and(|participant| {
            lock(&participant.log).as_ref().and_then(|log| log.is_running(number)) == Some(true)
        })
    }

    /// Appends the next lines of the trace of a running trial, and its end if the episode has ended.
    ///
    /// # Errors
    /// The [`Refusal`]; nothing is stored then.
    pub fn append_trace(
        &self,
        code: &str,
        number: usize,
        text: String,
        has_ended: bool,
    ) -> std::result::Result<(), Refusal> {
        let found = lock(&self.participants).by_code.get(code).cloned();
        let participant = found.ok_or(Refusal::Unknown)?;
        let mut guard = lock(&participant.log);
        let log = guard.as_mut().ok_or(Refusal::Unknown)?;
        log.append_trace(&self.plan, number, text, has_ended)
    }

    /// Returns the file of a participant who has finished.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn complete_data(
        &self,
        code: &str,
        token: &TokenDigest,
        now_secs: u64,
    ) -> std::result::Result<String, Refusal> {
        let participant = self.find(code, token)?;
        let mut log = lock(&participant.log);
        let log = log.as_mut().ok_or(Refusal::Unknown)?;
        log.take_token(now_secs)?;
        if log.is_complete() { log.read_stored() } else { Err(Refusal::Unfinished) }
    }

    /// Returns the plan of the study.
    pub fn plan(&self) -> &StudyPlan {
        &self.plan
    }

    /// Checks that a participant exists and has this token.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn authorize(&self, code: &str, token: &TokenDigest) -> std::result::Result<(), Refusal> {
        self.find(code, token).map(|_| ())
    }

    /// Appends lines of records, the first of which has the number `from`. Stored records that are sent again
    /// are compared. Returns the number of stored records after the new ones are on the disk.
    ///
    /// # Errors
    /// The [`Refusal`]; no record is stored then.
    pub fn append(
        &self,
        code: &str,
        token: &TokenDigest,
        from: usize,
        text: &str,
        now_secs: u64,
    ) -> std::result::Result<usize, Refusal> {
        let participant = self.find(code, token)?;
        let mut guard = lock(&participant.log);
        let log = guard.as_mut().ok_or(Refusal::Unknown)?;
        log.take_token(now_secs)?;
        match log.append(&self.plan, from, text) {
            Ok(()) => {
                participant.is_complete.store(log.is_complete(), Ordering::Relaxed);
                Ok(log.n_page_records())
            }
            // Another program has removed the file, for example `chaic study delete`.
            Err(Refusal::Unknown) => {
                *guard = None;
                drop(guard);
                lock(&self.participants).by_code.remove(code);
                Err(Refusal::Unknown)
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Deletes all data of a participant and frees the slot.
    ///
    /// # Errors
    /// The [`Refusal`]. Repeat the request after a failed file operation.
    pub fn withdraw(&self, code: &str, token: &TokenDigest) -> std::result::Result<(), Refusal> {
        let participant = self.find(code, token)?;
        let mut log = lock(&participant.log);
        log.as_mut().ok_or(Refusal::Unknown)?.delete()?;
        *log = None;
        drop(log);
        lock(&self.participants).by_code.remove(code);
        Ok(())
    }

    /// Counts the participants.
    pub fn counts(&self) -> ParticipantCounts {
        let participants = lock(&self.participants);
        let all = participants.by_code.values();
        let complete = all.filter(|p| p.is_complete.load(Ordering::Relaxed)).count();
        ParticipantCounts { participants: participants.by_code.len(), complete }
    }

    fn path(&self, code: &str) -> PathBuf {
        self.folder.join(format!("{code}.{ENDING}"))
    }

    fn find(
        &self,
        code: &str,
        token: &TokenDigest,
    ) -> std::result::Result<Arc<Participant>, Refusal> {
        let found = lock(&self.participants).by_code.get(code).cloned();
        let participant = found.ok_or(Refusal::Unknown)?;
        participant.authorize(token)?;
        Ok(participant)
    }

    /// Returns the lowest free slot.
    fn free_slot(
        &self,
        by_code: &BTreeMap<String, Arc<Participant>>,
        now_secs: u64,
    ) -> Option<u32> {
        let study = self.plan.study();
        let mut n_by_slot: BTreeMap<u32, usize> = BTreeMap::new();
        for participant in by_code.values() {
            *n_by_slot.entry(participant.slot).or_default() += 1;
        }
        let timeout_secs = u64::from(study.timeout_minutes) * SECS_PER_MINUTE;
        let holders = by_code.values().map(|participant| SlotHolder {
            slot: participant.slot,
            since_secs: participant.since_secs,
            // A slot that has had the maximum number of participants is never free again.
            is_complete: participant.is_complete.load(Ordering::Relaxed)
                || n_by_slot[&participant.slot] >= PARTICIPANTS_PER_SLOT,
        });
        lowest_free_slot(study.participants, timeout_secs, now_secs, holders)
    }
}

impl Participant {
    /// Reads the file of a participant.
    fn read(plan: &StudyPlan, code: &str, path: &Path, now_secs: u64) -> Result<Participant> {
        let (log, slot) = Log::read(plan, code, path, now_secs)?;
        Ok(Participant {
            slot,
            since_secs: now_secs,
            token: read_token(&token_path(path))?,
            is_complete: AtomicBool::new(log.is_complete()),
            log: Mutex::new(Some(log)),
        })
    }

    /// Compares digests of tokens. Unequal digests differ at random positions, so the duration of the
    /// comparison reveals nothing.
    fn authorize(&self, token: &TokenDigest) -> std::result::Result<(), Refusal> {
        if self.token.as_ref() == Some(token) { Ok(()) } else { Err(Refusal::Token) }
    }
}

/// Returns the participant code in the path of a file; `None` for a file that no server has written, which
/// only an export reads.
fn code_of(path: &Path) -> Option<&str> {
    let is_data = path.extension().is_some_and(|ending| ending == ENDING);
    path.file_stem()?.to_str().filter(|stem| is_data && is_code(stem))
}

fn read_token(path: &Path) -> Result<Option<TokenDigest>> {
    /// Maximum size of a token file, bytes: more than a digest needs.
    const MAX_BYTES: u64 = 128;
    if kind(path)? == EntryKind::Missing {
        return Ok(None);
    }
    let bytes = read_bounded(path, MAX_BYTES)?;
    let token = std::str::from_utf8(&bytes).ok().and_then(TokenDigest::parse);
    token.map(Some).ok_or_else(|| ServerError::Token(path.to_owned()))
}

/// Removes files that an interrupted entry or deletion left: temporary ones, and tokens without data.
fn remove_leftovers(folder: &Path, by_code: &BTreeMap<String, Arc<Participant>>) -> Result<()> {
    for path in entries(folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let Some((code, ending)) = name.split_once('.').filter(|(code, _)| is_code(code)) else {
            continue;
        };
        let is_temporary = ending.ends_with(TEMPORARY_SUFFIX);
        if is_temporary || path == token_path(&path) && !by_code.contains_key(code) {
            remove_file(&path)?;
        }
    }
    Ok(())
}

/// Locks a mutex. A panic while it was held left a consistent state, since changes follow all checks.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
