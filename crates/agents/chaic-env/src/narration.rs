//! Actions and events of an episode in words, for replays.

use std::ops::Deref;

use chaic_core::agent::{BelievedObject, Thought};
use chaic_core::geom::Camera;
use chaic_core::{Action, AgentId, ClassId, EntityId, Outcome, ResolvedAction};
use chaic_world::{EventKind, Setup, World};
use serde::Serialize;

use crate::playback::Playback;
use crate::trace::Trace;

/// Kind of activity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ActivityKind {
    /// Walks or turns.
    Walk,
    /// Picks up, puts down or removes something.
    Interact,
    /// Waits.
    Wait,
}

impl ActivityKind {
    /// Returns the kind of an action.
    pub fn of(action: &ResolvedAction) -> ActivityKind {
        match action {
            Action::Wait { .. } => ActivityKind::Wait,
            action if action.is_locomotion() => ActivityKind::Walk,
            _ => ActivityKind::Interact,
        }
    }
}

/// Text about one agent's current activity.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Caption {
    /// Name of the agent.
    pub agent: String,
    /// Current action.
    pub action: String,
    /// Current plan.
    pub plan: String,
    /// Last observed action of another agent, if the agent recognizes actions.
    pub last_observed: Option<String>,
}

impl Caption {
    /// Describes an agent at the current frame of a playback.
    pub fn new<T: Deref<Target = Trace>>(playback: &Playback<T>, agent: AgentId) -> Caption {
        let thought = &playback.thoughts()[agent.index()];
        Caption::of_agent(playback.world(), agent, &playback.header().helper, thought)
    }

    /// Describes an agent in a world with this helper, and its thought.
    pub fn of_agent(world: &World, agent: AgentId, helper: &str, thought: &Thought) -> Caption {
        let setup = world.setup();
        let person = &world.state().agents[agent.index()];
        let action = match (&person.activity, &person.last) {
            (Some(activity), _) => action_text(setup, &activity.action),
            (None, Some((action, outcome))) => match outcome {
                Outcome::Success => action_text(setup, action),
                Outcome::Failure(reason) => {
                    format!("{} failed: {reason}", action_text(setup, action))
                }
            },
            (None, None) => "about to begin".to_owned(),
        };
        let mode = thought.mode.as_ref().map_or(String::new(), |m| format!(" ({m})"));
        let name = match agent {
            AgentId::HELPER => format!("{agent} ({helper})"),
            _ => agent.to_string(),
        };
        let last_observed = thought.last_observed.clone();
        Caption { agent: name, action, plan: format!("{}{mode}", thought.plan), last_observed }
    }
}

/// Object in an agent's image, as the agent perceives it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DetectedObject {
    /// Class.
    #[serde(skip)]
    pub class: ClassId,
    /// Class and name of the track, for example `apple t13`.
    pub label: String,
    /// Center, as fractions of the image's sides from its left and upper edge.
    pub at: [f32; 2],
}

/// Returns the perceived objects that are in a camera's image.
pub fn detected_objects(perceived: &[BelievedObject], camera: &Camera) -> Vec<DetectedObject> {
    let detected = |object: &BelievedObject| {
        let (center, _) = camera.project(object.position_cm.map(|cm| 0.01 * cm as f32).into())?;
        let at = [center.x / camera.width as f32, center.y / camera.height as f32];
        let (class, label) =
            (object.class, format!("{} {}", object.class.info().label, object.name));
        let is_inside = at.iter().all(|x| (0.0..1.0).contains(x));
        is_inside.then_some(DetectedObject { class, label, at })
    };
    perceived.iter().filter_map(detected).collect()
}

/// Returns the label and the id of an object, for example `apple #31`.
pub fn object_name(setup: &Setup, entity: EntityId) -> String {
    let class = setup.object(entity).map(|thing| thing.class);
    class.map_or(entity.to_string(), |class| format!("{} {entity}", class.info().label))
}

/// Describes an action, for example `picks up apple #31`.
pub fn action_text(setup: &Setup, action: &ResolvedAction) -> String {
    let name = |entity| object_name(setup, entity);
    match *action {
        Action::MoveForward => "walks ahead".to_owned(),
        Action::TurnLeft => "turns left".to_owned(),
        Action::TurnRight => "turns right".to_owned(),
        Action::PickUp { object, .. } => format!("picks up {}", name(object)),
        Action::PutIn => "puts it into the container".to_owned(),
        Action::PutOn { place, .. } => format!("puts it on {}", name(place)),
        Action::RemoveObstacle { obstacle, .. } => format!("removes {}", name(obstacle)),
        Action::Wait { .. } => "waits".to_owned(),
    }
}

/// Describes an event; `None` for events that a viewer sees anyway, such as the start of an action.
pub fn event_text(setup: &Setup, event: &EventKind) -> Option<String> {
    let name = |entity| object_name(setup, entity);
    Some(match *event {
        EventKind::Delivered { object, by, counted } => {
            let note = if counted { "" } else { ", which isn't wanted" };
            format!("{by} delivered {}{note}", name(object))
        }
        EventKind::Broke { agent, object } => format!("{agent} broke {}", name(object)),
        EventKind::Ended { agent, action, outcome: Outcome::Failure(reason) }
            if action.subject().is_some() =>
        {
            format!("{agent} {}, failed: {reason}", action_text(setup, &action))
        }
        EventKind::LiftedTogether { object, .. } => format!("both lift {}", name(object)),
        EventKind::ChildAway { away: true } => "the child is away".to_owned(),
        EventKind::ChildAway { away: false } => "the child is back".to_owned(),
        EventKind::Over { complete: true } => "all is done".to_owned(),
        EventKind::Over { complete: false } => "time is up".to_owned(),
        _ => return None,
    })
}
