//! Notes all that a mind is told.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use chaic_core::observation::{Observation, Senses};
use chaic_core::{
    Action, Agent, AgentError, AgentId, Briefing, ClassId, EntityId, FailureReason, Outcome, Target,
};
use chaic_world::World;

/// A leak that is planted, to show that it is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leak {
    /// A failed attempt at a thing tells that somebody else holds it, wherever that is.
    HeldFromAfar,
    /// All that is delivered is told, wherever the reader is.
    DeliveredFromAfar,
    /// The classes of all things still in play are told, not only of those in the image.
    ClassesOfAll,
    /// An attempt at a thing that somebody else took fails in another time.
    Duration,
}

impl Leak {
    /// Every one.
    pub const ALL: [Leak; 4] =
        [Leak::HeldFromAfar, Leak::DeliveredFromAfar, Leak::ClassesOfAll, Leak::Duration];
}

/// One decision of the watched mind.
#[derive(Debug)]
pub(super) struct Seen {
    pub(super) observation: Observation,
    pub(super) action: Action,
}

/// All that a mind was told, and what it answered.
#[derive(Debug, Default)]
pub(super) struct Log {
    pub(super) briefing: Option<Briefing>,
    /// What hasn't been compared yet.
    pub(super) seen: VecDeque<Seen>,
    pub(super) leak: Option<Leak>,
    /// What the planted leak has to tell now.
    held_by_other: Vec<EntityId>,
    delivered: Vec<(EntityId, ClassId)>,
    in_play: Vec<(EntityId, ClassId)>,
}

impl Log {
    /// Nothing told yet, with a leak planted or without.
    pub(super) fn leaking_by(leak: Option<Leak>) -> Log {
        Log { leak, ..Log::default() }
    }

    /// Looks into the world for the planted leak, if there is one.
    pub(super) fn overhear(&mut self, world: &World) {
        if self.leak.is_none() {
            return;
        }
        let class = |e: EntityId| world.setup().thing(e).map(|t| (e, t.class));
        let is_held = |e: &EntityId| {
            let mut holders = world.setup().agents().filter(|a| *a != AgentId::HELPER);
            holders.any(|a| world.state().people[a.index()].hands.contains(&Some(*e)))
        };
        self.held_by_other = world.setup().entities().filter(is_held).collect();
        let delivered = world.delivered();
        self.delivered = delivered.iter().copied().filter_map(class).collect();
        let in_play = world.setup().entities().filter(|e| !delivered.contains(e));
        self.in_play = in_play.filter(|e| !is_held(e)).filter_map(class).collect();
    }

    /// What the mind is told with the planted leak.
    fn leaking(&self, mut observation: Observation) -> Observation {
        let last_at = |o: &Observation| match o.own.last.and_then(|(action, _)| action.subject()) {
            Some(Target::Entity(entity)) => Some(entity),
            _ => None,
        };
        let was_held = last_at(&observation).is_some_and(|e| self.held_by_other.contains(&e));
        match self.leak {
            None => {}
            Some(Leak::HeldFromAfar) => {
                if let Some((_, Outcome::Failure(reason))) = &mut observation.own.last
                    && was_held
                {
                    *reason = FailureReason::HeldByOther;
                }
            }
            Some(Leak::DeliveredFromAfar) => observation.granted.delivered = self.delivered.clone(),
            Some(Leak::ClassesOfAll) => observation.granted.classes = self.in_play.clone(),
            Some(Leak::Duration) => observation.frame += u32::from(was_held),
        }
        observation
    }
}

/// A mind that is watched.
pub(super) struct Spy {
    pub(super) mind: Box<dyn Agent>,
    pub(super) log: Arc<Mutex<Log>>,
}

impl Spy {
    fn log(&self) -> std::sync::MutexGuard<'_, Log> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Agent for Spy {
    fn senses(&self) -> Senses {
        let senses = self.mind.senses();
        // Color and depth too: nothing of what is hidden may be painted on anything.
        let looks = senses.wants_image();
        Senses { rgb: looks, depth: looks, ..senses }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.log().briefing = Some(briefing.clone());
        self.mind.reset(briefing);
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        let observation = self.log().leaking(observation.clone());
        let action = self.mind.act(&observation)?;
        self.log().seen.push_back(Seen { observation, action });
        Ok(action)
    }
}
