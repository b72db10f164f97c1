//! What an agent is told before an episode.

use serde::{Deserialize, Serialize};

use crate::capability::{Capability, PersonKind};
use crate::geom::Rect;
use crate::ids::{AgentId, ClassId, EntityId, Frame};
use crate::observation::Grants;
use crate::task::TaskId;

/// How many of which class are wanted at the goal.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Goal {
    /// Class and required number, in the catalogue's order, each class once.
    pub targets: Vec<(ClassId, u32)>,
}

impl Goal {
    /// How many of this class are wanted.
    pub fn wanted(&self, class: ClassId) -> u32 {
        self.targets.iter().find(|(c, _)| *c == class).map_or(0, |(_, n)| *n)
    }

    /// How many objects are wanted in all.
    pub fn total(&self) -> u32 {
        self.targets.iter().map(|(_, n)| n).sum()
    }
}

/// Another person of the episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Companion {
    /// Who it is; its body's pixels are [`EntityId::of_agent`].
    pub agent: AgentId,
    /// What it is to the agent that reads this.
    pub relation: Relation,
}

/// What another person is to the reader of a briefing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// The two who work together.
    Partner,
    /// The child who comes along and may run away.
    Child,
    /// The adult whom the child belongs to.
    Guardian,
}

/// How bodies move and reach in this world: the constants of its rules that planning needs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// One turn, radians.
    pub turn_rad: f32,
    /// A step ahead ends with the frame in which it has covered more than this, metres.
    pub stride_m: f32,
    /// Lower things are stepped over, metres.
    pub step_over_m: f32,
    /// How near one steps up to the nearest point of a thing before reaching for it, metres.
    pub arm_reach_m: f32,
    /// From how far one still reaches a thing that one can't step up to any nearer, metres.
    pub reach_limit_m: f32,
}

/// What an agent is told before an episode. A helper's says nothing of the partner's goal or
/// constraint unless that is granted, and the grant is on record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Briefing {
    /// Who the reader is.
    pub me: AgentId,
    /// What the reader's own body can do.
    pub capability: Capability,
    /// How bodies move and reach in this world.
    pub motion: Motion,
    /// The other people.
    pub companions: Vec<Companion>,
    /// Seed of the reader's own random streams; differs between agents of one episode. A helper's
    /// derives from the run's seed and the seat alone and is the same in all episodes of a run.
    pub seed: u64,
    /// Frames until the episode ends.
    pub horizon: Frame,
    /// The part of the plane where the episode happens.
    pub bounds: Rect,
    /// Classes that may be targets in this kind of scene, whether or not this episode wants them.
    pub possible_targets: Vec<ClassId>,
    /// Classes that can be carried along to hold targets.
    pub containers: Vec<ClassId>,
    /// Classes that may stand in the way and can be removed.
    pub obstacles: Vec<ClassId>,
    /// Classes of the places that targets may be brought to in this kind of scene; only the one
    /// that they are brought to where the goal place is granted.
    pub goal_places: Vec<ClassId>,
    /// Only tops at least this high count as the goal place, metres; 0 for no condition, or where
    /// the goal is not granted: it tells a task from the others.
    pub goal_place_min_top_m: f32,
    /// Objects that one container or basket holds.
    pub container_capacity: u32,
    /// What has been granted beyond own images and state.
    pub grants: Grants,
    /// The goal: the partner's own, or granted.
    pub goal: Option<Goal>,
    /// The task, if that is granted.
    pub told: Option<Told>,
}

/// What is said of the task to whom it is granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Told {
    /// Which task it is.
    pub task: TaskId,
    /// What kind of person the partner is.
    pub partner: PersonKind,
}

impl Briefing {
    /// The companion of this relation.
    pub fn companion(&self, relation: Relation) -> Option<AgentId> {
        self.companions.iter().find(|c| c.relation == relation).map(|c| c.agent)
    }

    /// The entity of the companion of this relation.
    pub fn companion_entity(&self, relation: Relation) -> Option<EntityId> {
        self.companion(relation).map(EntityId::of_agent)
    }
}
