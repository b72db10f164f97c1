//! Counts of what a run has exercised.

use std::collections::BTreeMap;
use std::fmt;

use chaic_core::action::FailureReason;
use chaic_core::{Action, Outcome, ResolvedAction};
use chaic_world::{Event, EventKind};

/// Returns the name of an action in tables.
pub(crate) fn action_name(action: ResolvedAction) -> &'static str {
    match action {
        Action::MoveForward => "move forward",
        Action::TurnLeft => "turn left",
        Action::TurnRight => "turn right",
        Action::PickUp { .. } => "pick up",
        Action::PutIn => "put in",
        Action::PutOn { .. } => "put on",
        Action::RemoveObstacle { .. } => "remove obstacle",
        Action::Wait { .. } => "wait",
    }
}

/// Returns the name of an event that is not the start or end of an action.
fn event_name(kind: EventKind) -> Option<&'static str> {
    match kind {
        EventKind::Began { .. } | EventKind::Ended { .. } => None,
        EventKind::Taken { .. } => Some("object taken"),
        EventKind::Stowed { .. } => Some("object stowed"),
        EventKind::Released { .. } => Some("object released"),
        EventKind::LostSupport { .. } => Some("object lost its support"),
        EventKind::Broke { .. } => Some("vase broke"),
        EventKind::Delivered { counted: true, .. } => Some("wanted object delivered"),
        EventKind::Delivered { counted: false, .. } => Some("other object delivered"),
        EventKind::ObstacleRemoved { .. } => Some("obstacle removed"),
        EventKind::LiftedTogether { .. } => Some("furniture lifted together"),
        EventKind::ChildAway { away: true } => Some("child ran away"),
        EventKind::ChildAway { away: false } => Some("child came back"),
        EventKind::Stuck { stuck: true, .. } => Some("person stuck"),
        EventKind::Stuck { stuck: false, .. } => Some("person free again"),
        EventKind::Over { complete: true } => Some("goal complete"),
        EventKind::Over { complete: false } => Some("time over"),
    }
}

/// Counts of a run.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    /// Number of episodes.
    pub n_episodes: u64,
    /// Number of frames.
    pub n_frames: u64,
    /// Number of joint actions: moments at which at least one person chose an action, while the
    /// actions of the others went on.
    pub n_joint_actions: u64,
    /// Number of conditions within rounding of their limit.
    pub n_open: u64,
    /// Number of ended actions by name and outcome.
    pub ended: BTreeMap<(&'static str, Option<FailureReason>), u64>,
    /// Number of other events by name.
    pub events: BTreeMap<&'static str, u64>,
    /// Number of submitted actions by kind of person.
    pub people: BTreeMap<String, u64>,
    /// Number of joint actions by task and rule set.
    pub tasks: BTreeMap<String, u64>,
}

impl Coverage {
    /// All failure reasons.
    pub const REASONS: [FailureReason; 11] = [
        FailureReason::Blocked,
        FailureReason::OutOfReach,
        FailureReason::BeyondLimits,
        FailureReason::Broke,
        FailureReason::HandFull,
        FailureReason::HandEmpty,
        FailureReason::HeldByOther,
        FailureReason::OutOfPlay,
        FailureReason::Impossible,
        FailureReason::Full,
        FailureReason::NotContainerAndTarget,
    ];
    /// Names of all events other than start and end of an action.
    pub const EVENTS: [&'static str; 15] = [
        "object taken",
        "object stowed",
        "object released",
        "object lost its support",
        "vase broke",
        "wanted object delivered",
        "other object delivered",
        "obstacle removed",
        "furniture lifted together",
        "child ran away",
        "child came back",
        "person stuck",
        "person free again",
        "goal complete",
        "time over",
    ];

    /// Counts the events of a frame.
    pub(crate) fn count(&mut self, events: &[Event]) {
        for event in events {
            if let EventKind::Ended { action, outcome, .. } = event.kind {
                let reason = match outcome {
                    Outcome::Success => None,
                    Outcome::Failure(reason) => Some(reason),
                };
                *self.ended.entry((action_name(action), reason)).or_default() += 1;
            }
            if let Some(name) = event_name(event.kind) {
                *self.events.entry(name).or_default() += 1;
            }
        }
    }

    /// Adds the counts of another run.
    pub fn add(&mut self, other: &Coverage) {
        self.n_episodes += other.n_episodes;
        self.n_frames += other.n_frames;
        self.n_joint_actions += other.n_joint_actions;
        self.n_open += other.n_open;
        for (key, n) in &other.ended {
            *self.ended.entry(*key).or_default() += n;
        }
        for (key, n) in &other.events {
            *self.events.entry(key).or_default() += n;
        }
        for (key, n) in &other.people {
            *self.people.entry(key.clone()).or_default() += n;
        }
        for (key, n) in &other.tasks {
            *self.tasks.entry(key.clone()).or_default() += n;
        }
    }

    /// Returns the number of actions that ended with a failure reason.
    pub fn n_failed(&self, reason: FailureReason) -> u64 {
        self.ended.iter().filter(|((_, r), _)| *r == Some(reason)).map(|(_, n)| n).sum()
    }
}

impl fmt::Display for Coverage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Coverage { n_episodes, n_frames, n_joint_actions, n_open, .. } = self;
        writeln!(f, "{n_joint_actions} joint actions in {n_episodes} episodes, {n_frames} frames")?;
        writeln!(f, "{n_open} conditions within rounding of a limit")?;
        writeln!(f, "\nactions")?;
        for ((action, reason), n) in &self.ended {
            let outcome = reason.map_or("success".to_owned(), |r| r.to_string());
            writeln!(f, "{n:>9}  {action}: {outcome}")?;
        }
        writeln!(f, "\nevents")?;
        for (name, n) in &self.events {
            writeln!(f, "{n:>9}  {name}")?;
        }
        writeln!(f, "\nactions by person")?;
        for (name, n) in &self.people {
            writeln!(f, "{n:>9}  {name}")?;
        }
        writeln!(f, "\njoint actions by task and rules")?;
        for (name, n) in &self.tasks {
            writeln!(f, "{n:>9}  {name}")?;
        }
        Ok(())
    }
}
