//! Changes in a trace that are worth a line.

use chaic_core::agent::{PartnerBelief, Thought};
use chaic_core::{Action, AgentId, EntityId, Frame, Outcome, ResolvedAction};
use chaic_env::narration::object_name;
use chaic_env::trace::{Record, Trace};
use chaic_world::{EventKind, Setup};

use super::{HypothesisChange, ModeChange, TimelineChange};
use crate::recorded_belief::{Distribution, IDENTIFIED_PER_MILLE, most_likely, per_mille_of};

/// Probabilities whose crossing is reported, per mille.
const THRESHOLDS_PER_MILLE: [u16; 3] = [500, IDENTIFIED_PER_MILLE, 900];

/// Returns the changes with their frames, in chronological order.
pub(super) fn changes(trace: &Trace, setup: &Setup) -> Vec<(Frame, TimelineChange)> {
    let mut reported = Reported::default();
    let mut found = Vec::new();
    for record in &trace.records {
        match record {
            Record::Decision(decision) if decision.agent == AgentId::HELPER => {
                let changes = decision.thought.iter().flat_map(|t| reported.changes(t));
                found.extend(changes.map(|change| (decision.frame, change)));
            }
            Record::Event(event) => {
                let change = event_change(&event.event.kind, setup);
                found.extend(change.map(|change| (event.event.frame, change)));
            }
            _ => {}
        }
    }
    found
}

/// The thought of the helper as reported so far.
#[derive(Default)]
struct Reported {
    belief: Option<PartnerBelief>,
    goal: Hypotheses,
    person: Hypotheses,
    mode: Option<String>,
    /// First planned operation, or the plan of a helper that records none.
    operation: Option<String>,
}

impl Reported {
    /// Returns the changes in a new thought.
    fn changes(&mut self, thought: &Thought) -> Vec<TimelineChange> {
        let mut found = Vec::new();
        if let Some(belief) = &thought.belief {
            self.add_belief(belief, &mut found);
        }
        found.extend(self.plan_change(thought));
        found
    }

    fn add_belief(&mut self, belief: &PartnerBelief, found: &mut Vec<TimelineChange>) {
        let Some(old) = self.belief.replace(belief.clone()) else {
            self.goal.reset(&belief.goals);
            self.person.reset(&belief.people);
            let (goals, people) = (belief.goals.clone(), belief.people.clone());
            found.push(TimelineChange::FirstBelief { goals, people });
            return;
        };
        let added = missing_in(&old.evidence, &belief.evidence);
        let retracted = missing_in(&belief.evidence, &old.evidence);
        let crosses = self.goal.crosses(&belief.goals);
        if !added.is_empty() || !retracted.is_empty() {
            let goal = self.goal.shift(&belief.goals);
            found.push(TimelineChange::Evidence { added, retracted, goal });
        } else if crosses {
            found.extend(self.goal.shift(&belief.goals).map(TimelineChange::Goal));
        }
        if self.person.crosses(&belief.people) {
            found.extend(self.person.shift(&belief.people).map(TimelineChange::Person));
        }
    }

    /// Returns the change of the mode or of the first operation.
    fn plan_change(&mut self, thought: &Thought) -> Option<TimelineChange> {
        let planned = thought.belief.as_ref().map_or(&[][..], |belief| &belief.plan);
        let current = [thought.plan.clone()];
        let operations = if planned.is_empty() { &current[..] } else { planned };
        let operation = operations.first().filter(|text| !text.is_empty());
        let mode = match (&self.mode, &thought.mode) {
            (Some(from), Some(to)) if from != to => Some(ModeChange {
                from: from.clone(),
                to: to.clone(),
                goal_is_clear: self.goal.is_identified(),
            }),
            _ => None,
        };
        let has_changed = mode.is_some() || self.operation.as_ref() != operation;
        self.mode.clone_from(&thought.mode);
        self.operation = operation.cloned();
        let operations = operations.iter().filter(|text| !text.is_empty()).cloned().collect();
        has_changed.then_some(TimelineChange::Plan { mode, operations })
    }
}

/// A distribution as reported so far, per mille.
#[derive(Default)]
struct Hypotheses {
    /// Distribution of the last reported shift.
    reported: Vec<(String, u16)>,
    /// Most likely hypothesis and number of thresholds that it reaches, in the last belief.
    last: Option<(String, usize)>,
    /// Probability of the most likely hypothesis in the last belief.
    highest: u16,
}

impl Hypotheses {
    fn reset(&mut self, distribution: &Distribution) {
        self.reported = distribution.to_vec();
        self.crosses(distribution);
    }

    /// Returns whether the most likely hypothesis or its thresholds differ from the last call.
    fn crosses(&mut self, distribution: &Distribution) -> bool {
        let level = |p: u16| THRESHOLDS_PER_MILLE.iter().filter(|t| p >= **t).count();
        let best = most_likely(distribution);
        self.highest = best.map_or(0, |(_, p)| p);
        let state = best.map(|(name, p)| (name.to_owned(), level(p)));
        let has_changed = state != self.last;
        self.last = state;
        has_changed
    }

    /// Returns the most likely hypothesis if its percentage differs from the reported one, and marks
    /// the distribution as reported.
    fn shift(&mut self, distribution: &Distribution) -> Option<HypothesisChange> {
        let (name, probability) = most_likely(distribution)?;
        let previous = per_mille_of(&self.reported, name);
        self.reported = distribution.to_vec();
        let hypothesis = name.to_owned();
        // Texts have whole percents.
        let percent = |per_mille: u16| (per_mille + 5) / 10;
        (percent(probability) != percent(previous)).then_some(HypothesisChange {
            hypothesis,
            probability,
            previous,
        })
    }

    fn is_identified(&self) -> bool {
        self.highest >= IDENTIFIED_PER_MILLE
    }
}

/// Returns the observations of `new` without one of the same object in `old`. The remark in
/// parentheses, such as the reliability, does not count.
fn missing_in(old: &[String], new: &[String]) -> Vec<String> {
    fn key(text: &str) -> &str {
        text.split(" (").next().unwrap_or(text)
    }
    new.iter().filter(|text| !old.iter().any(|known| key(known) == key(text))).cloned().collect()
}

fn event_change(kind: &EventKind, setup: &Setup) -> Option<TimelineChange> {
    let name = |entity: EntityId| object_name(setup, entity);
    let event = match *kind {
        EventKind::Delivered { object, by, counted } => {
            return Some(TimelineChange::Delivered {
                by: by.role_name(),
                object: name(object),
                counted,
            });
        }
        EventKind::Ended { agent, action, outcome: Outcome::Failure(reason) } => {
            return Some(TimelineChange::Failed {
                agent: agent.role_name(),
                action: attempt(&action, setup)?,
                reason: reason.to_string(),
            });
        }
        EventKind::Broke { agent, object } => format!("{agent} breaks {}", name(object)),
        EventKind::ObstacleRemoved { agent, object } => {
            format!("{agent} removes {}", name(object))
        }
        EventKind::LiftedTogether { object, .. } => {
            format!("partner and helper lift {} together", name(object))
        }
        EventKind::ChildAway { away: true } => "the child is away".to_owned(),
        EventKind::ChildAway { away: false } => "the child is back".to_owned(),
        _ => return None,
    };
    Some(TimelineChange::Event { event })
}

/// Describes an action with an object or place; `None` for steps, turns and waits.
fn attempt(action: &ResolvedAction, setup: &Setup) -> Option<String> {
    match *action {
        Action::PickUp { object, .. } => Some(format!("pick up {}", object_name(setup, object))),
        Action::PutIn => Some("put an object into the container".to_owned()),
        Action::PutOn { place, .. } => {
            Some(format!("put an object on {}", object_name(setup, place)))
        }
        Action::RemoveObstacle { obstacle, .. } => {
            Some(format!("remove {}", object_name(setup, obstacle)))
        }
        Action::MoveForward | Action::TurnLeft | Action::TurnRight | Action::Wait { .. } => None,
    }
}
