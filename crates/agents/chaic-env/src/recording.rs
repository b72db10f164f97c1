//! Recordings of partners: their interactions in traces, and partners that repeat them.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::partners::{
    PlanRecording, RecordedInteraction, RecordedStep, is_real_failure, partner_grants,
    recorded_partner,
};
use chaic_core::{Action, AgentId, Frame};
use chaic_world::EventKind;

use crate::digest::Digest;
use crate::error::EnvError;
use crate::helper_registry::{Helper, HelperRegistry, RECORDED};
use crate::key::RunKey;
use crate::trace::{FORMAT, Record, Trace, TraceWarning, parse};

/// Maximum number of recordings: a study of a thousand participants with ten episodes each.
const MAX_RECORDINGS: usize = 10_000;

/// Recording of one partner in one episode.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Episode id.
    pub episode: String,
    /// Digest of the episode's setup.
    pub setup: Digest,
    /// Digest of the trace's bytes.
    pub digest: Digest,
    plan: Arc<PlanRecording>,
}

/// Reason why a trace is no recording of a partner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordingError {
    /// A person plays, but not the partner.
    #[error("a person plays the helper, not the partner")]
    OtherSeat,
    /// The partner does nothing that can be repeated.
    #[error("the partner picks nothing up")]
    Empty,
}

impl Recording {
    /// Returns the recording in a trace; `digest` is that of the trace's bytes.
    ///
    /// # Errors
    /// If a person controls another agent than the partner, or the partner has no interaction.
    pub fn from_trace(trace: &Trace, digest: Digest) -> Result<Recording, RecordingError> {
        let mut people = trace.header.people.iter().filter(|person| person.input.is_some());
        if people.any(|person| person.agent != AgentId::PARTNER) {
            return Err(RecordingError::OtherSeat);
        }
        let steps = recorded_steps(trace);
        if steps.is_empty() {
            return Err(RecordingError::Empty);
        }
        let plan = Arc::new(PlanRecording { steps, digest: digest.to_string() });
        let (episode, setup) = (trace.header.episode.clone(), trace.header.setup);
        Ok(Recording { episode, setup, digest, plan })
    }

    /// Steps and digest, for a policy that repeats them.
    pub fn plan(&self) -> Arc<PlanRecording> {
        Arc::clone(&self.plan)
    }

    /// Steps of the partner in their order.
    pub fn steps(&self) -> &[RecordedStep] {
        &self.plan.steps
    }
}

/// Returns the interactions of the partner, consecutive attempts at one of them joined.
fn recorded_steps(trace: &Trace) -> Vec<RecordedStep> {
    let mut steps: Vec<RecordedStep> = Vec::new();
    let mut last_frame: Frame = 0;
    for record in &trace.records {
        let Record::Event(event) = record else { continue };
        let EventKind::Ended { agent: AgentId::PARTNER, action, outcome } = event.event.kind else {
            continue;
        };
        let interaction = match action {
            Action::PickUp { object, .. } => RecordedInteraction::PickUp(object.into()),
            Action::PutIn => RecordedInteraction::PutIn,
            Action::PutOn { .. } => RecordedInteraction::PutOn,
            Action::RemoveObstacle { obstacle, .. } => {
                RecordedInteraction::RemoveObstacle(obstacle.into())
            }
            _ => continue,
        };
        let is_success = outcome.is_success();
        if !is_success && !is_real_failure(outcome) {
            continue;
        }
        let duration_frames = event.event.frame.saturating_sub(last_frame);
        last_frame = event.event.frame;
        // A delivery empties both hands; the second object in a container is a step of its own.
        let continues = |step: &RecordedStep| {
            step.interaction == interaction
                && (interaction == RecordedInteraction::PutOn || !step.is_success)
        };
        match steps.last_mut().filter(|step| continues(step)) {
            Some(step) => {
                step.n_attempts += u32::from(!step.is_success || !is_success);
                step.is_success = is_success;
                step.duration_frames += duration_frames;
            }
            None => {
                steps.push(RecordedStep {
                    interaction,
                    n_attempts: 1,
                    is_success,
                    duration_frames,
                });
            }
        }
    }
    steps
}

/// Returns whether a file begins with the header of a trace.
fn is_trace(bytes: &[u8]) -> bool {
    bytes.starts_with(format!("{{\"format\":\"{FORMAT}\"").as_bytes())
}

/// Recordings of one or more partners, in different episodes or in the same.
#[derive(Clone, Debug)]
pub struct Recordings {
    /// By episode, sorted by digest.
    by_episode: BTreeMap<String, Vec<Recording>>,
    digest: Digest,
}

impl Recordings {
    /// Creates a set of recordings; `None` if it is empty. Copies of a recording count once.
    pub fn new(mut recordings: Vec<Recording>) -> Option<Recordings> {
        recordings.sort_by_key(|recording| recording.digest);
        recordings.dedup_by_key(|recording| recording.digest);
        let digest = match &recordings[..] {
            [] => return None,
            [single] => single.digest,
            all => {
                let digests: Vec<String> = all.iter().map(|r| r.digest.to_string()).collect();
                Digest::of_bytes(digests.join("\n").as_bytes())
            }
        };
        let mut by_episode: BTreeMap<String, Vec<Recording>> = BTreeMap::new();
        for recording in recordings {
            by_episode.entry(recording.episode.clone()).or_default().push(recording);
        }
        Some(Recordings { by_episode, digest })
    }

    /// Collects the recordings in files: the path of each and its content. If `source` is one of them, it
    /// must be the trace of a partner. If it is a folder, files without such a trace are ignored.
    ///
    /// # Errors
    /// [`EnvError::Recording`] with the first damaged trace, or if there are no or too many recordings;
    /// errors of the iterator.
    pub fn collect<E: From<EnvError>>(
        source: &Path,
        files: impl Iterator<Item = Result<(PathBuf, Vec<u8>), E>>,
    ) -> Result<Recordings, E> {
        let wrong = |path: &Path, problem: String| -> E {
            EnvError::Recording { path: path.to_owned(), problem }.into()
        };
        let mut found: Vec<Recording> = Vec::new();
        for file in files {
            let (path, bytes) = file?;
            if path != source && !is_trace(&bytes) {
                continue;
            }
            let (trace, warnings) = parse(&bytes, &path)?;
            if let Some(TraceWarning::Torn { line, problem, .. }) = warnings.first() {
                return Err(wrong(&path, format!("line {line}: {problem}")));
            }
            match Recording::from_trace(&trace, Digest::of_bytes(&bytes)) {
                Ok(recording) => found.push(recording),
                Err(problem) if path == source => return Err(wrong(&path, problem.to_string())),
                Err(_) => {}
            }
            if found.len() > MAX_RECORDINGS {
                return Err(wrong(source, format!("has more than {MAX_RECORDINGS} recordings")));
            }
        }
        for recording in &found {
            let is_same_episode = |other: &&Recording| other.episode == recording.episode;
            if found.iter().find(is_same_episode).is_some_and(|r| r.setup != recording.setup) {
                let id = &recording.episode;
                return Err(wrong(source, format!("has recordings of two versions of {id}")));
            }
        }
        let none =
            || wrong(source, "has no trace in which a partner picks something up".to_owned());
        Recordings::new(found).ok_or_else(none)
    }

    /// Returns all recordings, by episode and digest.
    pub fn iter(&self) -> impl Iterator<Item = &Recording> {
        self.by_episode.values().flatten()
    }

    /// Returns the recording of an episode run. Of several recordings of an episode, seed K has the one
    /// with index K modulo their number.
    fn recording(&self, episode: &str, seed: u32) -> Option<&Recording> {
        let recordings = self.by_episode.get(episode)?;
        recordings.get(seed as usize % recordings.len())
    }

    /// Returns the episodes with the digests of their setups.
    fn episodes(&self) -> BTreeMap<String, Digest> {
        self.iter().map(|recording| (recording.episode.clone(), recording.setup)).collect()
    }

    /// Creates the partner of one episode run; without a key, that of any episode.
    fn partner(&self, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        let recording = match key {
            Some(key) => self.recording(&key.episode, key.seed),
            None => self.iter().next(),
        }?;
        let agent = recorded_partner(Arc::clone(&recording.plan), rules);
        Some(Helper { agent, grants: partner_grants(rules) })
    }
}

/// Formats the name of the partner in runs: `recorded:DIGEST`. The digest is that of the only recording,
/// or of the digests of all.
impl fmt::Display for Recordings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{RECORDED}{}", self.digest)
    }
}

/// Registry of partners that repeat recordings, with another registry as fallback.
pub struct RecordedPartners<'a> {
    fallback: &'a dyn HelperRegistry,
    recordings: &'a [Recordings],
}

impl<'a> RecordedPartners<'a> {
    /// Adds partners to those of another registry.
    pub fn new(
        fallback: &'a dyn HelperRegistry,
        recordings: &'a [Recordings],
    ) -> RecordedPartners<'a> {
        RecordedPartners { fallback, recordings }
    }

    fn find(&self, name: &str) -> Option<&Recordings> {
        self.recordings.iter().find(|recordings| recordings.to_string() == name)
    }
}

impl HelperRegistry for RecordedPartners<'_> {
    fn names(&self) -> Vec<String> {
        self.fallback.names()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        self.fallback.make(name, rules)
    }

    fn make_for(&self, key: &RunKey, rules: PlannerRules) -> Option<Helper> {
        self.fallback.make_for(key, rules)
    }

    fn fallback(&self) -> Option<&dyn HelperRegistry> {
        Some(self.fallback)
    }

    fn partner(&self, name: &str, key: Option<&RunKey>, rules: PlannerRules) -> Option<Helper> {
        match self.find(name) {
            Some(recordings) => recordings.partner(key, rules),
            None => self.fallback.partner(name, key, rules),
        }
    }

    fn partner_episodes(&self, name: &str) -> Option<BTreeMap<String, Digest>> {
        match self.find(name) {
            Some(recordings) => Some(recordings.episodes()),
            None => self.fallback.partner_episodes(name),
        }
    }
}

#[cfg(test)]
mod tests;
