//! Recorder of an agent's observations.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use chaic_core::observation::{Observation, SensorConfig};
use chaic_core::{
    Action, Agent, AgentError, AgentId, Briefing, ClassId, EntityId, FailureReason, Outcome, Target,
};
use chaic_world::World;

/// Artificial leak that tests whether the audit finds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leak {
    /// A failed pick-up reveals that another agent holds the object, at any distance.
    HeldFromAfar,
    /// All delivered objects are revealed, at any distance.
    DeliveredFromAfar,
    /// The classes of all remaining objects are revealed, not only of those in the image.
    ClassesOfAll,
    /// A failed attempt at an object that another agent holds takes a different time.
    Duration,
}

impl Leak {
    /// All leaks.
    pub const ALL: [Leak; 4] =
        [Leak::HeldFromAfar, Leak::DeliveredFromAfar, Leak::ClassesOfAll, Leak::Duration];
}

/// One decision of the watched agent.
#[derive(Debug)]
pub(super) struct RecordedDecision {
    pub(super) observation: Observation,
    pub(super) action: Action,
}

/// Briefing, observations and actions of an agent.
#[derive(Debug, Default)]
pub(super) struct ObservationLog {
    pub(super) briefing: Option<Briefing>,
    /// Decisions that are not compared yet.
    pub(super) decisions: VecDeque<RecordedDecision>,
    pub(super) leak: Option<Leak>,
    /// Information that the artificial leak reveals.
    held_by_other: Vec<EntityId>,
    delivered: Vec<(EntityId, ClassId)>,
    remaining: Vec<(EntityId, ClassId)>,
}

impl ObservationLog {
    /// Creates an empty log, with an artificial leak or without.
    pub(super) fn with_leak(leak: Option<Leak>) -> ObservationLog {
        ObservationLog { leak, ..ObservationLog::default() }
    }

    /// Reads the information of the artificial leak from the world.
    pub(super) fn read_leak(&mut self, world: &World) {
        if self.leak.is_none() {
            return;
        }
        let class = |e: EntityId| world.setup().object(e).map(|t| (e, t.class));
        let is_held = |e: &EntityId| {
            let mut holders = world.setup().agents().filter(|a| *a != AgentId::HELPER);
            holders.any(|a| world.state().agents[a.index()].hands.contains(&Some(*e)))
        };
        self.held_by_other = world.setup().entities().filter(is_held).collect();
        let delivered = world.delivered();
        self.delivered = delivered.iter().copied().filter_map(class).collect();
        let remaining = world.setup().entities().filter(|e| !delivered.contains(e));
        self.remaining = remaining.filter(|e| !is_held(e)).filter_map(class).collect();
    }

    /// Adds the artificial leak to an observation.
    fn add_leak(&self, mut observation: Observation) -> Observation {
        let last_target = |o: &Observation| match o
            .proprioception
            .last
            .and_then(|(action, _)| action.subject())
        {
            Some(Target::Entity(entity)) => Some(entity),
            _ => None,
        };
        let was_held = last_target(&observation).is_some_and(|e| self.held_by_other.contains(&e));
        match self.leak {
            None => {}
            Some(Leak::HeldFromAfar) => {
                if let Some((_, Outcome::Failure(reason))) = &mut observation.proprioception.last
                    && was_held
                {
                    *reason = FailureReason::HeldByOther;
                }
            }
            Some(Leak::DeliveredFromAfar) => observation.granted.delivered = self.delivered.clone(),
            Some(Leak::ClassesOfAll) => observation.granted.classes = self.remaining.clone(),
            Some(Leak::Duration) => observation.frame += u32::from(was_held),
        }
        observation
    }
}

/// An agent with a log.
pub(super) struct RecordingAgent {
    pub(super) agent: Box<dyn Agent>,
    pub(super) log: Arc<Mutex<ObservationLog>>,
}

impl RecordingAgent {
    fn log(&self) -> std::sync::MutexGuard<'_, ObservationLog> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Agent for RecordingAgent {
    fn sensors(&self) -> SensorConfig {
        let sensors = self.agent.sensors();
        // Requests color and depth as well, because images could also reveal hidden state.
        let has_images = sensors.wants_image();
        SensorConfig { rgb: has_images, depth: has_images, ..sensors }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.log().briefing = Some(briefing.clone());
        self.agent.reset(briefing);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let observation = self.log().add_leak(observation.clone());
        let action = self.agent.act(&observation)?;
        self.log().decisions.push_back(RecordedDecision { observation, action });
        Ok(action)
    }
}
