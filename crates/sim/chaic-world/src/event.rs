//! Events of an episode.

use chaic_core::{AgentId, EntityId, Frame, Outcome, ResolvedAction};
use serde::{Deserialize, Serialize};

/// An event with its frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Frame of the event.
    pub frame: Frame,
    /// Kind of the event, with its data.
    #[serde(flatten)]
    pub kind: EventKind,
}

/// Kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum EventKind {
    /// An agent started an action.
    Began {
        /// The agent.
        agent: AgentId,
        /// The action.
        action: ResolvedAction,
    },
    /// An action ended.
    Ended {
        /// The agent.
        agent: AgentId,
        /// The action.
        action: ResolvedAction,
        /// Outcome of the action.
        outcome: Outcome,
    },
    /// An object was picked up.
    Taken {
        /// Agent that took it.
        agent: AgentId,
        /// The object.
        object: EntityId,
    },
    /// An object was put into a container or basket.
    Stowed {
        /// Agent that put it there.
        agent: AgentId,
        /// The object.
        object: EntityId,
        /// The container.
        container: EntityId,
    },
    /// An object was released.
    Released {
        /// Agent that released it.
        agent: AgentId,
        /// The object.
        object: EntityId,
        /// Intended place.
        on: Option<EntityId>,
    },
    /// An object started to fall because its support was removed.
    LostSupport {
        /// The object.
        object: EntityId,
    },
    /// A fragile object broke.
    Broke {
        /// Agent that held it.
        agent: AgentId,
        /// The object.
        object: EntityId,
    },
    /// An object was delivered.
    Delivered {
        /// The object.
        object: EntityId,
        /// Agent that released it last.
        by: AgentId,
        /// True if it counts toward the goal: its class is a target with deliveries still missing.
        counted: bool,
    },
    /// An obstacle was set aside.
    ObstacleRemoved {
        /// Agent that moved it.
        agent: AgentId,
        /// The obstacle.
        object: EntityId,
    },
    /// Two agents lifted a piece of furniture together.
    LiftedTogether {
        /// Agent that leads.
        leader: AgentId,
        /// Agent that follows.
        follower: AgentId,
        /// The furniture.
        object: EntityId,
    },
    /// The child left the vicinity of its guardian, or returned.
    ChildAway {
        /// True if the child is away now.
        away: bool,
    },
    /// The partner or the helper became stuck, or made progress again.
    Stuck {
        /// The agent.
        agent: AgentId,
        /// True if the agent is stuck now.
        stuck: bool,
    },
    /// The episode ended.
    Over {
        /// True if all targets were delivered.
        complete: bool,
    },
}
