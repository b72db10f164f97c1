//! What happens, one record per happening.

use chaic_core::{AgentId, EntityId, Frame, Outcome, ResolvedAction};
use serde::{Deserialize, Serialize};

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When.
    pub frame: Frame,
    /// What.
    #[serde(flatten)]
    pub kind: EventKind,
}

/// What can happen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum EventKind {
    /// An agent began an action.
    Began {
        /// Who.
        agent: AgentId,
        /// What.
        action: ResolvedAction,
    },
    /// An agent's action ended.
    Ended {
        /// Who.
        agent: AgentId,
        /// What.
        action: ResolvedAction,
        /// How.
        outcome: Outcome,
    },
    /// A thing was taken.
    Taken {
        /// By whom.
        agent: AgentId,
        /// The thing.
        object: EntityId,
    },
    /// A thing was put into a container or basket.
    Stowed {
        /// By whom.
        agent: AgentId,
        /// The thing.
        object: EntityId,
        /// Where.
        container: EntityId,
    },
    /// A thing was let go.
    Released {
        /// By whom.
        agent: AgentId,
        /// The thing.
        object: EntityId,
        /// The place it was meant for.
        on: Option<EntityId>,
    },
    /// A thing began to fall because what it lay on was taken away.
    LostSupport {
        /// The thing.
        object: EntityId,
    },
    /// A fragile thing broke.
    Broke {
        /// In whose hands.
        agent: AgentId,
        /// The thing.
        object: EntityId,
    },
    /// A thing was delivered.
    Delivered {
        /// The thing.
        object: EntityId,
        /// Who let it go there.
        by: AgentId,
        /// Whether it was wanted and not yet there often enough.
        counted: bool,
    },
    /// An obstacle was put aside.
    ObstacleRemoved {
        /// By whom.
        agent: AgentId,
        /// The obstacle.
        object: EntityId,
    },
    /// Two people began to carry a piece of furniture together.
    LiftedTogether {
        /// Who leads.
        leader: AgentId,
        /// Who follows.
        follower: AgentId,
        /// The furniture.
        object: EntityId,
    },
    /// The child left its guardian's vicinity, or came back.
    ChildAway {
        /// Whether it is away now.
        away: bool,
    },
    /// The partner or the helper has made no progress for long, or makes some again.
    Stuck {
        /// Who.
        agent: AgentId,
        /// Whether it is stuck now.
        stuck: bool,
    },
    /// The episode ended.
    Over {
        /// Whether everything wanted was delivered.
        complete: bool,
    },
}
