//! State shared by all agents of a run: settings, templates, endpoint and budget.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock};

use chaic_env::CHAIC_VERSION;
use chaic_files::{
    EntryKind, create_folders, create_folders_below, kind_below, read_below, write_atomically,
};
use serde::{Deserialize, Serialize};

use crate::endpoint::Client;
use crate::error::{LlmError, Result};
use crate::exchange::{ContentHash, Fault};
use crate::rate_limiter::{RateLimiter, Spending};
use crate::record::{self, DecisionLog, RecordEntry};
use crate::settings::{Budget, Endpoint, Price, PromptSettings, RetrySettings, Settings};
use crate::templates::Templates;

/// Source of answers.
pub enum AnswerSource {
    /// An endpoint.
    Live(Box<Client>),
    /// The record of another run, in this folder.
    Replay(PathBuf),
    /// None: the agents only describe their sensors.
    Offline,
}

/// State shared by all agents of a run.
pub struct Session {
    /// Settings.
    pub settings: Settings,
    /// Templates of prompts.
    pub templates: Templates,
    /// Source of answers.
    pub source: AnswerSource,
    /// Stop flag of the run; a pause sets it, too.
    pub stop: &'static AtomicBool,
    problem: Mutex<Option<String>>,
    listener: OnceLock<Listener>,
    /// Consecutive failed requests. The initial value makes the first failure visible to the user.
    failures: AtomicU32,
    /// True after the message about a kept record.
    has_warned: AtomicBool,
    run: OnceLock<(PathBuf, RateLimiter)>,
}

/// Receiver of messages to the user.
pub type Listener = Box<dyn Fn(&str) + Send + Sync>;

/// Number of consecutive failed requests after which the user is notified. Chosen so that an
/// unreachable endpoint is reported after a few seconds, and 30 % failures rarely are.
const NOTIFY_AFTER: u32 = 4;

const FORMAT: &str = "chaic-llm-settings";
const VERSION: u32 = 1;
/// File of the recorded settings.
const FILE: &str = "settings.json";
/// Maximum size of that file, bytes: a thousand times a typical one.
const MAX_FILE_BYTES: u64 = 1 << 20;

/// Recorded settings of a run, without the key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Recorded {
    format: String,
    version: u32,
    chaic: String,
    /// Settings that affect results. The templates are beside this file.
    #[serde(alias = "asking")]
    request: PromptSettings,
    /// Digest of all templates.
    templates: ContentHash,
    /// Endpoint, for information only; it may change on resume. Absent for a replay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    endpoint: Option<Endpoint>,
    #[serde(alias = "faults")]
    retry: RetrySettings,
    budget: Budget,
    price: Price,
}

impl Session {
    /// Creates a session.
    ///
    /// # Errors
    /// If settings are out of bounds, or a template is invalid.
    pub fn new(
        settings: Settings,
        source: AnswerSource,
        stop: &'static AtomicBool,
    ) -> Result<Session> {
        settings.check_bounds()?;
        let templates = Templates::load(settings.request.templates.as_deref())?;
        let (problem, listener, run) = (Mutex::new(None), OnceLock::new(), OnceLock::new());
        let failures = AtomicU32::new(NOTIFY_AFTER - 1);
        let has_warned = AtomicBool::new(false);
        Ok(Session {
            settings,
            templates,
            source,
            stop,
            problem,
            listener,
            failures,
            has_warned,
            run,
        })
    }

    /// Binds the session to a run folder: records the settings, or compares them with the recorded
    /// ones.
    ///
    /// # Errors
    /// If they differ, or a file cannot be read or written.
    pub fn attach(&self, run: &Path) -> Result<()> {
        let folder = record::folder(run);
        create_folders(run)?;
        create_folders_below(run, &folder)?;
        let current = self.recorded();
        match read_recorded(run)? {
            Some(recorded) => compare(run, &recorded, &current)?,
            None => {
                create_folders_below(run, &folder.join("templates"))?;
                self.templates.write(&folder.join("templates"))?;
                let text =
                    serde_json::to_string_pretty(&current).expect("settings have string keys");
                let path = folder.join(FILE);
                // Written last: it marks a complete record of the settings.
                write_atomically(&path, (text + "\n").as_bytes())?;
            }
        }
        let is_limited =
            matches!(self.source, AnswerSource::Live(_)) && self.settings.budget.limits_spending();
        let earlier = spent_before(run, &self.settings.price, is_limited)?;
        let limiter = RateLimiter::new(
            self.settings.budget,
            self.settings.endpoint.max_concurrent_requests,
            earlier,
        );
        // A second call keeps the first folder.
        let _ = self.run.set((run.to_owned(), limiter));
        Ok(())
    }

    fn recorded(&self) -> Recorded {
        let endpoint =
            matches!(self.source, AnswerSource::Live(_)).then(|| self.settings.endpoint.clone());
        Recorded {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            request: PromptSettings { templates: None, ..self.settings.request.clone() },
            templates: self.templates.hash(),
            endpoint,
            retry: self.settings.retry,
            budget: self.settings.budget,
            price: self.settings.price.clone(),
        }
    }

    /// Returns the run folder, once it is known.
    pub fn run(&self) -> Option<&Path> {
        self.run.get().map(|(path, _)| path.as_path())
    }

    /// Returns the limiter of the run, once its folder is known.
    pub fn limiter(&self) -> Option<&RateLimiter> {
        self.run.get().map(|(_, limiter)| limiter)
    }

    /// Sets the receiver of messages to the user; later calls have no effect.
    pub fn listen(&self, listener: Listener) {
        let _ = self.listener.set(listener);
    }

    /// Resets the count of failed requests after an answer.
    pub fn record_answer(&self) {
        self.failures.store(0, Ordering::Relaxed);
    }

    /// Counts a failed request after which the run continues. The user is notified if no request
    /// was answered before, and after several consecutive failures.
    pub fn record_failure(&self, fault: &Fault) {
        let n = self.failures.fetch_add(1, Ordering::Relaxed).saturating_add(1);
        if let (NOTIFY_AFTER, Some(listener)) = (n, self.listener.get()) {
            let attempts = self.settings.retry.max_attempts;
            listener(&format!(
                "the model cannot be reached at the moment: {fault}; each request is tried up to \
                 {attempts} times"
            ));
        }
    }

    /// Warns the user, once, that a resumed episode asks other questions than its record has.
    pub fn warn_of_kept_record(&self, copy: &Path) {
        let Some(listener) = self.listener.get() else { return };
        if !self.has_warned.swap(true, Ordering::Relaxed) {
            listener(&format!(
                "warning: a resumed episode asks other questions than before, so another build of chaic or a \
                 process that decides differently each time plays it; the questions are asked again, and the \
                 old record with its paid answers is kept as {}; further ones are kept without a message",
                copy.display()
            ));
        }
    }

    /// Stops the run with a reason for the user. The first reason is kept; an interruption by the
    /// user has none.
    pub fn halt(&self, reason: String) {
        // The lock is held until flag and reason are both set.
        let mut problem = self.problem.lock().unwrap_or_else(|e| e.into_inner());
        if !self.stop.swap(true, Ordering::SeqCst) {
            problem.get_or_insert(reason);
        }
    }

    /// Returns whether the run must stop for another reason than a pause of the session. Only then
    /// are requests in flight abandoned, since they count in the budget.
    pub fn is_interrupted(&self) -> bool {
        self.stop.load(Ordering::SeqCst) && self.problem().is_none()
    }

    /// Returns the reason for which the session stopped the run, if it did.
    pub fn problem(&self) -> Option<String> {
        self.problem.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }
}

/// Reads the settings of a run, with its copies of the templates; `None` if the run used no
/// language model.
///
/// # Errors
/// If the file exists and cannot be read.
pub fn settings_of(run: &Path) -> Result<Option<Settings>> {
    let Some(recorded) = read_recorded(run)? else { return Ok(None) };
    let templates = record::folder(run).join("templates");
    if kind_below(run, &templates)? == EntryKind::Link {
        let problem = "it is a link; put the folder itself there";
        return Err(LlmError::io("read", &templates)(std::io::Error::other(problem)));
    }
    Ok(Some(Settings {
        request: PromptSettings { templates: Some(templates), ..recorded.request },
        endpoint: recorded.endpoint.unwrap_or_default(),
        retry: recorded.retry,
        budget: recorded.budget,
        price: recorded.price,
    }))
}

fn read_recorded(run: &Path) -> Result<Option<Recorded>> {
    let path = record::folder(run).join(FILE);
    if kind_below(run, &path)? == EntryKind::Missing {
        return Ok(None);
    }
    let bytes = read_below(run, &path, MAX_FILE_BYTES)?;
    let wrong = |line, problem| LlmError::Unreadable { path: path.clone(), line, problem };
    let recorded: Recorded =
        serde_json::from_slice(&bytes).map_err(|e| wrong(e.line(), e.to_string()))?;
    if recorded.format != FORMAT || recorded.version != VERSION {
        let found = format!("{} version {}", recorded.format, recorded.version);
        return Err(wrong(1, format!("is of {found}, expected {FORMAT} version {VERSION}")));
    }
    Ok(Some(recorded))
}

fn compare(run: &Path, recorded: &Recorded, current: &Recorded) -> Result<()> {
    let differs = |field: &str, recorded: String, given: String| {
        let (path, field) = (run.to_owned(), field.to_owned());
        Err(LlmError::SettingDiffers { path, field, recorded, given })
    };
    let value = |r: &Recorded| serde_json::to_value(&r.request).expect("settings have string keys");
    let (recorded_value, current_value) = (value(recorded), value(current));
    for (name, old) in recorded_value.as_object().into_iter().flatten() {
        let given = &current_value[name];
        if old != given {
            let field = format!("request.{name}");
            return differs(&field, old.to_string(), given.to_string());
        }
    }
    if recorded.templates != current.templates {
        let (old, given) = (recorded.templates.to_string(), current.templates.to_string());
        return differs("templates", old, given);
    }
    Ok(())
}

/// Sums up the spending in a run's records and in the copies of replaced ones.
///
/// # Errors
/// [`LlmError::UnknownSpending`] if one can't be read and `is_limited`.
fn spent_before(run: &Path, price: &Price, is_limited: bool) -> Result<Spending> {
    let mut spent = Spending::default();
    for files in record::with_copies(run)? {
        let mut logs: Vec<Vec<RecordEntry>> = Vec::new();
        for path in files {
            if record::is_unstarted(run, &path)? {
                continue;
            }
            let entries = match DecisionLog::read(run, &path) {
                Ok(record) => record.entries,
                Err(LlmError::Unreadable { path, line, problem }) if is_limited => {
                    return Err(LlmError::UnknownSpending { path, line, problem });
                }
                // A damaged record stops the run when its episode is played again.
                Err(LlmError::Unreadable { .. }) => continue,
                Err(error) => return Err(error),
            };
            // A copy and its record begin with the same entries.
            let n_shared = logs.iter().map(|log| shared_len(log, &entries)).max().unwrap_or(0);
            for entry in &entries[n_shared..] {
                if let RecordEntry::Exchange(exchange) = entry {
                    spent.add(Spending::new(exchange.requests(), exchange.usage(), price));
                }
            }
            logs.push(entries);
        }
    }
    Ok(spent)
}

/// Returns the number of equal entries at the start of two records.
fn shared_len(a: &[RecordEntry], b: &[RecordEntry]) -> usize {
    a.iter().zip(b).take_while(|(a, b)| a == b).count()
}

#[cfg(test)]
mod tests {
    use chaic_core::{AgentId, TaskId};
    use chaic_env::RunKey;

    use super::*;
    use crate::exchange::{ChatRequest, Exchange, Message, Purpose, Reply, Role, Usage};
    use crate::record::{DecisionLogWriter, RecordHeader};

    fn session() -> Session {
        let mut settings = Settings::default();
        settings.request.model = "m".to_owned();
        let stop = Box::leak(Box::new(AtomicBool::new(false)));
        Session::new(settings, AnswerSource::Offline, stop).unwrap()
    }

    #[test]
    fn answers_are_waited_for_unless_the_user_stops_the_run() {
        let paused = session();
        assert!(!paused.is_interrupted());
        paused.halt("the budget is spent".to_owned());
        paused.halt("another reason".to_owned());
        assert!(!paused.is_interrupted());
        assert_eq!(paused.problem().as_deref(), Some("the budget is spent"));

        let stopped = session();
        stopped.stop.store(true, Ordering::SeqCst);
        assert!(stopped.is_interrupted());
        stopped.halt("the model cannot be reached".to_owned());
        assert!(stopped.is_interrupted(), "the user stopped the run first");
        assert_eq!(stopped.problem(), None);
    }

    #[test]
    fn the_user_is_warned_of_the_first_kept_record() {
        let session = session();
        let lines = std::sync::Arc::new(Mutex::new(Vec::new()));
        let heard = std::sync::Arc::clone(&lines);
        session.listen(Box::new(move |line: &str| heard.lock().unwrap().push(line.to_owned())));
        for name in ["a.jsonl.old-1", "b.jsonl.old-1"] {
            session.warn_of_kept_record(Path::new(name));
        }
        let lines = lines.lock().unwrap();
        assert!(lines.len() == 1 && lines[0].contains("is kept as a.jsonl.old-1;"), "{lines:?}");
    }

    /// Returns an answered request of 10 tokens.
    fn exchange(text: &str) -> RecordEntry {
        let message = Message { role: Role::User, text: text.to_owned(), images: Vec::new() };
        let (model, messages) = ("m".to_owned(), vec![message]);
        let request =
            ChatRequest { model, purpose: Purpose::Decide, messages, n_schema_plans: None };
        let usage = Usage { prompt: 8, answer: 2, estimated: false };
        let reply = Reply::Answer { text: "1".to_owned(), finish: None, usage, latency_ms: 0 };
        RecordEntry::Exchange(Box::new(Exchange::new(1, request, Vec::new(), reply)))
    }

    #[test]
    fn replaced_answers_count_once_and_unknown_spending_stops_a_run_with_a_budget() {
        let dir = tempfile::tempdir().unwrap();
        let run = dir.path();
        let (task, helper) = (TaskId::Obstacle, "llm".to_owned());
        let key = RunKey { task, helper, episode: "obstacle/test/00".to_owned(), seed: 0 };
        let path = record::path(run, &key, AgentId::HELPER);
        let header = RecordHeader::new(&key, AgentId::HELPER, "m");
        for texts in [["one", "two"], ["one", "three"], ["four", "five"]] {
            let mut writer = DecisionLogWriter::open(run, &path, &header).unwrap();
            texts.into_iter().for_each(|text| writer.push(exchange(text)).unwrap());
        }
        let price = Price::default();
        let spent = |is_limited| spent_before(run, &price, is_limited);
        let all = Spending { requests: 5, tokens: 50, cost: 0.0 };
        assert_eq!(spent(true).unwrap(), all);
        // It was stopped in its first line.
        std::fs::write(path.with_file_name("torn.jsonl"), "{\"format\"").unwrap();
        assert_eq!(spent(true).unwrap(), all);
        std::fs::write(path.with_file_name("damaged.jsonl"), "{}\n").unwrap();
        assert_eq!(spent(false).unwrap(), all);
        let error = spent(true).unwrap_err().to_string();
        assert!(error.contains("damaged.jsonl can't be read, so what the run"), "{error}");
    }
}
