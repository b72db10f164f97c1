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
use crate::rate_limiter::{RateLimiter, Spent};
use crate::record::{self, DecisionLog, RecordEntry};
use crate::settings::{Budget, Endpoint, Price, PromptSettings, RetrySettings, Settings};
use crate::templates::Templates;

/// Source of answers.
pub enum Source {
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
    pub source: Source,
    /// Stop flag of the run; a pause sets it, too.
    pub stop: &'static AtomicBool,
    problem: Mutex<Option<String>>,
    listener: OnceLock<Listener>,
    /// Consecutive failed requests. The initial value makes the first failure visible to the user.
    failures: AtomicU32,
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
    pub fn new(settings: Settings, source: Source, stop: &'static AtomicBool) -> Result<Session> {
        settings.check_bounds()?;
        let templates = Templates::load(settings.request.templates.as_deref())?;
        let (problem, listener, run) = (Mutex::new(None), OnceLock::new(), OnceLock::new());
        let failures = AtomicU32::new(NOTIFY_AFTER - 1);
        Ok(Session { settings, templates, source, stop, problem, listener, failures, run })
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
        let earlier = spent_before(run, &self.settings.price)?;
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
            matches!(self.source, Source::Live(_)).then(|| self.settings.endpoint.clone());
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

/// Sums up the spending in a run's records.
fn spent_before(run: &Path, price: &Price) -> Result<Spent> {
    let mut spent = Spent::default();
    for path in record::all(run)? {
        let record = match DecisionLog::read(run, &path) {
            Ok(record) => record,
            // A damaged record is replaced when its episode is played again.
            Err(LlmError::Unreadable { .. }) => continue,
            Err(error) => return Err(error),
        };
        for entry in record.entries {
            if let RecordEntry::Exchange(exchange) = entry {
                spent.add(Spent::new(exchange.requests(), exchange.usage(), price));
            }
        }
    }
    Ok(spent)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn session() -> Session {
        let mut settings = Settings::default();
        settings.request.model = "m".to_owned();
        let stop = Box::leak(Box::new(AtomicBool::new(false)));
        Session::new(settings, Source::Offline, stop).unwrap()
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
}
