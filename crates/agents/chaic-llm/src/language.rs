//! Language helpers and partners of a run.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::perception::GroundTruthIds;
use chaic_agents::perception_factory::{GroundTruthPerceptionFactory, PerceptionFactory};
use chaic_agents::planning_agent::behavior_model;
use chaic_agents::{PlannerRules, PlanningAgent, partner_grants};
use chaic_core::AgentId;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_env::helper_registry::{
    BuiltInHelpers, Helper, HelperRegistry, built_in, built_in_partner, built_in_partner_names,
};
use chaic_env::{EnvError, RunKey};

use crate::endpoint::Client;
use crate::error::{LlmError, Result};
use crate::policy::LanguagePolicy;
use crate::prompt_track::PromptTrack;
use crate::rate_limiter::Spending;
use crate::session::{AnswerSource, Listener, Session, settings_of};
use crate::settings::{BehaviorSource, Settings};

/// Name of a language helper or partner.
#[derive(Clone, Copy, Debug)]
struct Kind {
    name: &'static str,
    track: PromptTrack,
    has_images: bool,
}

const HELPERS: [Kind; 4] = [
    Kind { name: "llm", track: PromptTrack::Hidden, has_images: false },
    Kind { name: "llm_known_task", track: PromptTrack::KnownTask, has_images: false },
    Kind { name: "vlm", track: PromptTrack::Hidden, has_images: true },
    Kind { name: "vlm_known_task", track: PromptTrack::KnownTask, has_images: true },
];
const PARTNERS: [Kind; 2] = [
    Kind { name: "llm", track: PromptTrack::Partner, has_images: false },
    Kind { name: "vlm", track: PromptTrack::Partner, has_images: true },
];

/// Returns all values of `--helper` except `none`; built-in helpers come first.
pub fn helper_names() -> Vec<String> {
    let language = HELPERS.iter().map(|k| k.name.to_owned());
    BuiltInHelpers.names().into_iter().chain(language).collect()
}

/// Returns all values of `--partner` except `rules`; built-in partners come first.
pub fn partner_names() -> Vec<String> {
    let language = PARTNERS.iter().map(|k| k.name.to_owned());
    built_in_partner_names().into_iter().chain(language).collect()
}

/// Returns whether this name is a language helper.
pub fn is_language_helper(name: &str) -> bool {
    HELPERS.iter().any(|k| k.name == name)
}

/// Returns whether this name is a language partner.
pub fn is_language_partner(name: &str) -> bool {
    PARTNERS.iter().any(|k| k.name == name)
}

/// Registry of all built-in and language helpers of a run.
pub struct LanguageHelpers {
    session: Arc<Session>,
    perception: Arc<dyn PerceptionFactory>,
}

impl LanguageHelpers {
    /// Creates helpers that query an endpoint.
    ///
    /// # Errors
    /// If settings are out of bounds, the key is missing, or a template is invalid.
    pub fn live(settings: Settings, stop: &'static AtomicBool) -> Result<LanguageHelpers> {
        settings.check()?;
        let client = Client::new(&settings)?;
        LanguageHelpers::with(settings, AnswerSource::Live(Box::new(client)), stop)
    }

    /// Creates helpers that replay the record of a run with its settings.
    ///
    /// # Errors
    /// If the run has no record.
    pub fn replay(run: &Path, stop: &'static AtomicBool) -> Result<LanguageHelpers> {
        let settings =
            settings_of(run)?.ok_or_else(|| LlmError::NoRecord { path: run.to_owned() })?;
        LanguageHelpers::with(settings, AnswerSource::Replay(run.to_owned()), stop)
    }

    /// Creates helpers that only describe the sensors and grants of a recorded run; `None` if it
    /// has no record.
    ///
    /// # Errors
    /// If the record cannot be read.
    pub fn recorded(run: &Path, stop: &'static AtomicBool) -> Result<Option<LanguageHelpers>> {
        let settings = settings_of(run)?;
        settings.map(|s| LanguageHelpers::with(s, AnswerSource::Offline, stop)).transpose()
    }

    /// Creates helpers with a source of answers.
    ///
    /// # Errors
    /// If a template is invalid.
    pub fn with(
        settings: Settings,
        source: AnswerSource,
        stop: &'static AtomicBool,
    ) -> Result<LanguageHelpers> {
        let session = Arc::new(Session::new(settings, source, stop)?);
        Ok(LanguageHelpers { session, perception: Arc::new(GroundTruthPerceptionFactory) })
    }

    /// Replaces the perception of the helpers.
    pub fn with_perception(self, factory: Arc<dyn PerceptionFactory>) -> LanguageHelpers {
        LanguageHelpers { perception: factory, ..self }
    }

    /// Binds the helpers to a run folder, before the first episode.
    ///
    /// # Errors
    /// If the run has other settings, or a file cannot be written.
    pub fn attach(&self, run: &Path) -> Result<()> {
        self.session.attach(run)
    }

    /// Sets a listener for messages to the user.
    pub fn listen(&self, listener: Listener) {
        self.session.listen(listener);
    }

    /// Returns the reason for which the session stopped the run, if it did.
    pub fn problem(&self) -> Option<String> {
        self.session.problem()
    }

    /// Returns the stop flag of the run, which a pause also sets.
    pub fn stop(&self) -> &'static AtomicBool {
        self.session.stop
    }

    /// Returns the amount spent in this run.
    pub fn spent(&self) -> Option<Spending> {
        self.session.limiter().map(crate::rate_limiter::RateLimiter::spent)
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.session.settings
    }

    fn is_live(&self) -> bool {
        matches!(self.session.source, AnswerSource::Live(_))
    }

    fn helper(&self, name: &str, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        let kind = HELPERS.into_iter().find(|k| k.name == name)?;
        let knows_task = kind.track == PromptTrack::KnownTask;
        let is_granted = self.session.settings.request.behavior == BehaviorSource::Granted;
        let behavior = knows_task || is_granted || rules.knows_partner_behavior;
        let grants = Grants { behavior, task: knows_task, ..Grants::PLANNER };
        let grants = self.perception.grants(grants);
        Some(self.agent(kind, key, grants, AgentId::PARTNER, rules, &*self.perception))
    }

    /// Creates an agent of this kind that watches another agent.
    fn agent(
        &self,
        kind: Kind,
        key: Option<&RunKey>,
        grants: Grants,
        watched: AgentId,
        rules: PlannerRules,
        factory: &dyn PerceptionFactory,
    ) -> Helper {
        let session = Arc::clone(&self.session);
        let policy = LanguagePolicy::new(session, key.cloned(), kind.track, kind.has_images);
        let behavior = behavior_model(watched, grants, factory);
        let sensors = SensorConfig { rgb: kind.has_images, ..SensorConfig::DEPTH_AND_IDS };
        let agent = PlanningAgent::with(policy, Box::new(GroundTruthIds), behavior, rules);
        Helper { agent: Box::new(agent.with_sensors(sensors).replace_perception(factory)), grants }
    }
}

impl HelperRegistry for LanguageHelpers {
    fn names(&self) -> Vec<String> {
        helper_names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        built_in(name, rules, &*self.perception).or_else(|| self.helper(name, None, rules))
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        let built_in_helper = built_in(&key.helper, rules, &*self.perception);
        built_in_helper.or_else(|| self.helper(&key.helper, Some(key), rules))
    }

    fn partner_names(&self) -> Vec<String> {
        partner_names()
    }

    fn attach_run(&self, run: &Path) -> chaic_env::Result<()> {
        self.session.attach(run).map_err(|e| EnvError::Registry(e.into()))
    }

    fn partner(&self, name: &str, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        let Some(kind) = PARTNERS.into_iter().find(|k| k.name == name) else {
            return built_in_partner(name, rules);
        };
        let grants = partner_grants(rules);
        Some(self.agent(kind, key, grants, AgentId::HELPER, rules, &GroundTruthPerceptionFactory))
    }

    fn waiting_jobs(&self) -> usize {
        if self.is_live() { self.session.settings.endpoint.max_concurrent_requests } else { 0 }
    }

    fn is_slow(&self, name: &str) -> bool {
        // Every name of a partner is also the name of a helper.
        self.is_live() && is_language_helper(name)
    }
}

/// Parses `replay:DIR`, a value of `--llm`.
///
/// # Errors
/// For any other text.
pub fn replay_folder(text: &str) -> std::result::Result<PathBuf, String> {
    let folder = text.strip_prefix("replay:").filter(|f| !f.is_empty());
    folder.map(PathBuf::from).ok_or_else(|| format!("no source `{text}`; write replay:DIR"))
}
