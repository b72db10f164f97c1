//! What all minds of a run share: settings, templates, the way to the endpoint, and the budget.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock};

use chaic_env::CHAIC_VERSION;
use chaic_files::{EntryKind, kind_below, make_folders_below, read_below, write_whole};
use serde::{Deserialize, Serialize};

use crate::endpoint::Client;
use crate::error::{LlmError, Result};
use crate::exchange::{ContentHash, Fault};
use crate::gate::{Gate, Spent};
use crate::record::{self, Entry, Record};
use crate::settings::{Asking, Budget, Endpoint, Faults, Price, Settings};
use crate::templates::Templates;

/// Where answers come from.
pub enum Source {
    /// From an endpoint.
    Live(Box<Client>),
    /// From the record of another run, in this folder.
    Replay(PathBuf),
    /// From nowhere: only to know what minds ask for.
    Offline,
}

/// What all minds of a run share.
pub struct Session {
    /// How the model is asked.
    pub settings: Settings,
    /// The prompts.
    pub templates: Templates,
    /// Where answers come from.
    pub source: Source,
    /// Raised to stop the run; by the session itself when it is to pause.
    pub stop: &'static AtomicBool,
    problem: Mutex<Option<String>>,
    listener: OnceLock<Listener>,
    /// Requests that failed since the last that didn't. Begins so that the very first failure is
    /// told.
    failures: AtomicU32,
    run: OnceLock<(PathBuf, Gate)>,
}

/// Hears what a user should know while the run goes on.
pub type Listener = Box<dyn Fn(&str) + Send + Sync>;

/// The user is told when so many requests in a row have failed. Ours: with the usual waits a few
/// seconds of an endpoint that is gone, and rare where three in ten requests fail.
const TOLD_AFTER: u32 = 4;

const FORMAT: &str = "chaic-llm-settings";
const VERSION: u32 = 1;
/// The file of the recorded settings.
const FILE: &str = "settings.json";
/// Longest file of settings that is read, bytes: a thousand times a usual one.
const MAX_FILE_BYTES: u64 = 1 << 20;

/// What a run records of its settings; there is no key in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Recorded {
    format: String,
    version: u32,
    chaic: String,
    /// All that moves results. The templates are beside this file.
    asking: Asking,
    /// Hash of all templates.
    templates: ContentHash,
    /// For the record only: may change while a run is gone on with. Absent for a replay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    endpoint: Option<Endpoint>,
    faults: Faults,
    budget: Budget,
    price: Price,
}

impl Session {
    /// A session of these settings.
    ///
    /// # Errors
    /// If settings are out of bounds, or templates can't be filled in.
    pub fn new(settings: Settings, source: Source, stop: &'static AtomicBool) -> Result<Session> {
        settings.check_bounds()?;
        let templates = Templates::load(settings.asking.templates.as_deref())?;
        let (problem, listener, run) = (Mutex::new(None), OnceLock::new(), OnceLock::new());
        let failures = AtomicU32::new(TOLD_AFTER - 1);
        Ok(Session { settings, templates, source, stop, problem, listener, failures, run })
    }

    /// Ties the session to a run's folder: the settings are recorded there, or held against those
    /// that are.
    ///
    /// # Errors
    /// If they differ, or the file system refuses.
    pub fn attach(&self, run: &Path) -> Result<()> {
        let folder = record::folder(run);
        fs::create_dir_all(run).map_err(LlmError::io("make the folder", run))?;
        make_folders_below(run, &folder)?;
        let ours = self.recorded();
        match read_recorded(run)? {
            Some(theirs) => compare(run, &theirs, &ours)?,
            None => {
                make_folders_below(run, &folder.join("templates"))?;
                self.templates.write(&folder.join("templates"))?;
                let text = serde_json::to_string_pretty(&ours).expect("settings have string keys");
                let path = folder.join(FILE);
                // The last: until it is there whole, nothing is recorded.
                write_whole(&path, (text + "\n").as_bytes())?;
            }
        }
        let before = spent_before(run, &self.settings.price)?;
        let gate = Gate::new(self.settings.budget, self.settings.endpoint.in_flight, before);
        // Whoever attaches twice goes on with the first.
        let _ = self.run.set((run.to_owned(), gate));
        Ok(())
    }

    fn recorded(&self) -> Recorded {
        let endpoint =
            matches!(self.source, Source::Live(_)).then(|| self.settings.endpoint.clone());
        Recorded {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            asking: Asking { templates: None, ..self.settings.asking.clone() },
            templates: self.templates.hash(),
            endpoint,
            faults: self.settings.faults,
            budget: self.settings.budget,
            price: self.settings.price.clone(),
        }
    }

    /// The run's folder, once it is known.
    pub fn run(&self) -> Option<&Path> {
        self.run.get().map(|(path, _)| path.as_path())
    }

    /// The gate of the run, once its folder is known.
    pub fn gate(&self) -> Option<&Gate> {
        self.run.get().map(|(_, gate)| gate)
    }

    /// Tells this listener what a user should know while the run goes on; the first one holds.
    pub fn listen(&self, listener: Listener) {
        let _ = self.listener.set(listener);
    }

    /// A request was answered.
    pub fn answered(&self) {
        self.failures.store(0, Ordering::Relaxed);
    }

    /// A request failed and the run goes on. The user hears of it if nothing was answered before, and
    /// whenever several in a row have failed.
    pub fn failed(&self, fault: &Fault) {
        let n = self.failures.fetch_add(1, Ordering::Relaxed).saturating_add(1);
        if let (TOLD_AFTER, Some(listener)) = (n, self.listener.get()) {
            let attempts = self.settings.faults.attempts;
            listener(&format!(
                "the model can't be asked just now: {fault}; each question is tried up to \
                 {attempts} times"
            ));
        }
    }

    /// Stops the run for a reason that its user should know; the first one holds, and none does if
    /// the user has stopped the run before.
    pub fn halt(&self, why: String) {
        // Held until both are set: who sees the flag sees the reason.
        let mut problem = self.problem.lock().unwrap_or_else(|e| e.into_inner());
        if !self.stop.swap(true, Ordering::SeqCst) {
            problem.get_or_insert(why);
        }
    }

    /// Whether the run is to stop and the session isn't the reason. Then nobody waits for answers;
    /// where it is, those that are on their way are waited for, as they count in the budget.
    pub fn is_interrupted(&self) -> bool {
        self.stop.load(Ordering::SeqCst) && self.problem().is_none()
    }

    /// Why the session stopped the run, if it did.
    pub fn problem(&self) -> Option<String> {
        self.problem.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }
}

/// The settings that a run was begun with, with its own copies of the templates; `None` if no
/// language model took part.
///
/// # Errors
/// If the file is there and can't be read.
pub fn settings_of(run: &Path) -> Result<Option<Settings>> {
    let Some(recorded) = read_recorded(run)? else { return Ok(None) };
    let templates = record::folder(run).join("templates");
    if kind_below(run, &templates)? == EntryKind::Link {
        let problem = "it is a link; put the folder itself there";
        return Err(LlmError::io("read", &templates)(std::io::Error::other(problem)));
    }
    Ok(Some(Settings {
        asking: Asking { templates: Some(templates), ..recorded.asking },
        endpoint: recorded.endpoint.unwrap_or_default(),
        faults: recorded.faults,
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

fn compare(run: &Path, theirs: &Recorded, ours: &Recorded) -> Result<()> {
    let differs = |field: &str, recorded: String, given: String| {
        let (path, field) = (run.to_owned(), field.to_owned());
        Err(LlmError::SettingDiffers { path, field, recorded, given })
    };
    let value = |r: &Recorded| serde_json::to_value(&r.asking).expect("settings have string keys");
    let (theirs_value, ours_value) = (value(theirs), value(ours));
    for (name, recorded) in theirs_value.as_object().into_iter().flatten() {
        let given = &ours_value[name];
        if recorded != given {
            let field = format!("asking.{name}");
            return differs(&field, recorded.to_string(), given.to_string());
        }
    }
    if theirs.templates != ours.templates {
        let (recorded, given) = (theirs.templates.to_string(), ours.templates.to_string());
        return differs("templates", recorded, given);
    }
    Ok(())
}

/// What a run's records say has been spent.
fn spent_before(run: &Path, price: &Price) -> Result<Spent> {
    let mut spent = Spent::default();
    for path in record::all(run)? {
        // A damaged record is replaced when its episode is played again.
        let Ok(record) = Record::read(run, &path) else { continue };
        for entry in record.entries {
            if let Entry::Exchange(exchange) = entry {
                spent.add(Spent::of(exchange.requests(), exchange.usage(), price));
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
        settings.asking.model = "m".to_owned();
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
        stopped.halt("the model can't be asked".to_owned());
        assert!(stopped.is_interrupted(), "the user was first");
        assert_eq!(stopped.problem(), None);
    }
}
