//! Where a run gets its language helpers and partners from.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::mind::watcher;
use chaic_agents::perception::GroundTruthIds;
use chaic_agents::sight::{Sight, TrueSight};
use chaic_agents::{Mind, PlannerRules, partner_grants};
use chaic_core::AgentId;
use chaic_core::observation::{Grants, Senses};
use chaic_env::minds::{BuiltIn, Helper, Helpers, built_in};
use chaic_env::{EnvError, RunKey};

use crate::endpoint::Client;
use crate::error::{LlmError, Result};
use crate::gate::Spent;
use crate::policy::LanguagePolicy;
use crate::session::{Listener, Session, Source, settings_of};
use crate::settings::{Behavior, Settings};
use crate::templates::Track;

/// A name that stands behind `--helper`.
#[derive(Clone, Copy, Debug)]
struct Kind {
    name: &'static str,
    track: Track,
    looks: bool,
}

const HELPERS: [Kind; 4] = [
    Kind { name: "llm", track: Track::Hidden, looks: false },
    Kind { name: "llm-told", track: Track::Told, looks: false },
    Kind { name: "vlm", track: Track::Hidden, looks: true },
    Kind { name: "vlm-told", track: Track::Told, looks: true },
];
const PARTNERS: [Kind; 2] = [
    Kind { name: "llm", track: Track::Partner, looks: false },
    Kind { name: "vlm", track: Track::Partner, looks: true },
];

/// The names that may stand behind `--helper`, without `none`: the built-in ones first.
pub fn helper_names() -> Vec<String> {
    let own = HELPERS.iter().map(|k| k.name.to_owned());
    BuiltIn.names().into_iter().chain(own).collect()
}

/// The names of partners that ask a language model.
pub fn partner_names() -> Vec<String> {
    PARTNERS.iter().map(|k| k.name.to_owned()).collect()
}

/// Whether a helper of this name asks a language model.
pub fn is_language_helper(name: &str) -> bool {
    HELPERS.iter().any(|k| k.name == name)
}

/// Whether a partner of this name asks a language model.
pub fn is_language_partner(name: &str) -> bool {
    PARTNERS.iter().any(|k| k.name == name)
}

/// The language helpers of a run, besides all built-in ones.
pub struct Language {
    session: Arc<Session>,
    sight: Arc<dyn Sight>,
}

impl Language {
    /// Asks an endpoint.
    ///
    /// # Errors
    /// If settings are out of bounds, the key is missing, or a template can't be filled in.
    pub fn live(settings: Settings, stop: &'static AtomicBool) -> Result<Language> {
        settings.check()?;
        let client = Client::new(&settings)?;
        Language::with(settings, Source::Live(Box::new(client)), stop)
    }

    /// Plays the record of another run again, with its settings.
    ///
    /// # Errors
    /// If that run has no record.
    pub fn replay(run: &Path, stop: &'static AtomicBool) -> Result<Language> {
        let settings =
            settings_of(run)?.ok_or_else(|| LlmError::NoRecord { path: run.to_owned() })?;
        Language::with(settings, Source::Replay(run.to_owned()), stop)
    }

    /// Only to know what the helpers of a recorded run ask for; `None` if it has none.
    ///
    /// # Errors
    /// If its record can't be read.
    pub fn recorded(run: &Path, stop: &'static AtomicBool) -> Result<Option<Language>> {
        let settings = settings_of(run)?;
        settings.map(|s| Language::with(s, Source::Offline, stop)).transpose()
    }

    /// With answers from a source of the caller's.
    ///
    /// # Errors
    /// If a template can't be filled in.
    pub fn with(settings: Settings, source: Source, stop: &'static AtomicBool) -> Result<Language> {
        let session = Arc::new(Session::new(settings, source, stop)?);
        Ok(Language { session, sight: Arc::new(TrueSight) })
    }

    /// The same, whose helpers see by this.
    pub fn with_sight(self, sight: Arc<dyn Sight>) -> Language {
        Language { sight, ..self }
    }

    /// Ties it to a run's folder, before anything is played.
    ///
    /// # Errors
    /// If the run was begun with other settings, or the file system refuses.
    pub fn attach(&self, run: &Path) -> Result<()> {
        self.session.attach(run)
    }

    /// Tells this listener what a user should know while the run goes on.
    pub fn listen(&self, listener: Listener) {
        self.session.listen(listener);
    }

    /// Why it stopped the run, if it did.
    pub fn problem(&self) -> Option<String> {
        self.session.problem()
    }

    /// The flag that stops the run, which it raises itself when it pauses.
    pub fn stop(&self) -> &'static AtomicBool {
        self.session.stop
    }

    /// What has been spent in this run.
    pub fn spent(&self) -> Option<Spent> {
        self.session.gate().map(crate::gate::Gate::spent)
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.session.settings
    }

    fn is_live(&self) -> bool {
        matches!(self.session.source, Source::Live(_))
    }

    fn helper(&self, name: &str, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        let kind = HELPERS.into_iter().find(|k| k.name == name)?;
        let is_told = kind.track == Track::Told;
        let is_granted = self.session.settings.asking.behavior == Behavior::Granted;
        let behavior = is_told || is_granted || rules.knows_holding;
        let grants = Grants { behavior, task: is_told, ..Grants::PLANNER };
        let grants = self.sight.grants(grants);
        Some(self.mind((kind, key), grants, AgentId::PARTNER, rules, &*self.sight))
    }

    fn mind(
        &self,
        (kind, key): (Kind, Option<&RunKey>),
        grants: Grants,
        watched: AgentId,
        rules: PlannerRules,
        sight: &dyn Sight,
    ) -> Helper {
        let session = Arc::clone(&self.session);
        let policy = LanguagePolicy::new(session, key.cloned(), kind.track, kind.looks);
        let behavior = watcher(watched, grants, sight);
        let senses = Senses { rgb: kind.looks, ..Senses::DEPTH_AND_IDS };
        let mind = Mind::with(policy, Box::new(GroundTruthIds), behavior, rules);
        Helper { mind: Box::new(mind.with_senses(senses).with_sight(sight)), grants }
    }
}

impl Helpers for Language {
    fn names(&self) -> Vec<String> {
        helper_names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        built_in(name, rules, &*self.sight).or_else(|| self.helper(name, None, rules))
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        let usual = built_in(&key.helper, rules, &*self.sight);
        usual.or_else(|| self.helper(&key.helper, Some(key), rules))
    }

    fn partner_names(&self) -> Vec<String> {
        partner_names()
    }

    fn attach(&self, run: &Path) -> chaic_env::Result<()> {
        self.session.attach(run).map_err(|e| EnvError::Minds(e.into()))
    }

    fn partner(&self, name: &str, of: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        let kind = PARTNERS.into_iter().find(|k| k.name == name)?;
        let grants = partner_grants(rules);
        Some(self.mind((kind, of), grants, AgentId::HELPER, rules, &TrueSight))
    }

    fn waiting_jobs(&self) -> usize {
        if self.is_live() { self.session.settings.endpoint.in_flight } else { 0 }
    }

    fn waits(&self, name: &str) -> bool {
        // Names of partners are among those of helpers.
        self.is_live() && is_language_helper(name)
    }
}

/// `replay:DIR`, as `--llm` has it.
///
/// # Errors
/// If it is something else.
pub fn replay_folder(text: &str) -> std::result::Result<PathBuf, String> {
    let folder = text.strip_prefix("replay:").filter(|f| !f.is_empty());
    folder.map(PathBuf::from).ok_or_else(|| format!("no source `{text}`; write replay:DIR"))
}
