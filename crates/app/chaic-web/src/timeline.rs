//! Activities, events and deliveries of an episode, for the timeline and the list of events of a page.

use chaic_core::{AgentId, Frame, Outcome};
use chaic_env::narration::{ActivityKind, event_text};
use chaic_world::{Event, EventKind, World};
use serde::Serialize;

/// Time that an agent spends on one kind of activity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Activity {
    /// The agent.
    pub agent: AgentId,
    /// Kind.
    pub kind: ActivityKind,
    /// First frame.
    pub start: Frame,
    /// Frame after the last one.
    pub end: Frame,
    /// True if the action failed.
    pub failed: bool,
}

/// Event in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StoryLine {
    /// Frame.
    pub frame: Frame,
    /// Sentence.
    pub text: String,
}

/// Delivery that counts toward the goal, with the state of the goal after it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Delivery {
    /// Frame.
    pub frame: Frame,
    /// Agent that delivered it.
    pub by: AgentId,
    /// Achieved value of the goal.
    pub done: f64,
}

/// Activities, events and deliveries of an episode.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Timeline {
    /// Activities in the order of their ends.
    pub activities: Vec<Activity>,
    /// Events in words, in chronological order.
    pub story: Vec<StoryLine>,
    /// Deliveries in chronological order.
    pub deliveries: Vec<Delivery>,
    /// Agents with the first frame of their current action.
    #[serde(skip)]
    started: Vec<(AgentId, Frame)>,
}

impl Timeline {
    /// Adds the events that led to the current state of the world.
    pub fn add(&mut self, world: &World, events: &[Event]) {
        for Event { frame, kind } in events {
            let frame = *frame;
            match kind {
                EventKind::Began { agent, .. } => {
                    self.started.retain(|(other, _)| other != agent);
                    self.started.push((*agent, frame));
                }
                EventKind::Ended { agent, action, outcome } => {
                    let started = self.started.iter().find(|(other, _)| other == agent);
                    let start = started.map_or(frame, |(_, start)| *start);
                    let failed = matches!(outcome, Outcome::Failure(_));
                    let kind = ActivityKind::of(action);
                    self.add_activity(Activity { agent: *agent, kind, start, end: frame, failed });
                }
                EventKind::Delivered { by, counted: true, .. } => {
                    let (done, _) = world.progress();
                    self.deliveries.push(Delivery { frame, by: *by, done });
                }
                _ => {}
            }
            let text = event_text(world.setup(), kind);
            self.story.extend(text.map(|text| StoryLine { frame, text }));
        }
    }

    /// Joins the activity with the last one of the agent if both are of one kind.
    fn add_activity(&mut self, activity: Activity) {
        let mut of_agent = self.activities.iter_mut().rev();
        let last = of_agent.find(|other| other.agent == activity.agent);
        match last {
            Some(last)
                if last.kind == activity.kind
                    && last.failed == activity.failed
                    && activity.kind != ActivityKind::Interact
                    && last.end + 2 >= activity.start =>
            {
                last.end = activity.end;
            }
            _ => self.activities.push(activity),
        }
    }
}
