//! Agents that run again beside a playback, for drawings of what they know.

use std::ops::Deref;
use std::sync::Arc;

use chaic_agents::partners;
use chaic_core::agent::Thought;
use chaic_core::memory_view::MemoryView;
use chaic_core::observation::Images;
use chaic_core::{Action, Agent, AgentId, Frame, Target};
use chaic_episodes::Episode;
use chaic_render::Scene;
use chaic_world::World;

use crate::agent_slot::{AgentSlot, Driver};
use crate::error::Result;
use crate::helper_registry::{HelperRegistry, NONE};
use crate::observer::ObservationRenderer;
use crate::playback::Playback;
use crate::trace::{Header, Participant, Trace};

/// Agreement of an agent that runs again with the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RerunStatus {
    /// All actions so far equal those of the trace.
    Equal,
    /// The action of this frame differs; the agent does not run from there on.
    Differs(Frame),
    /// The agent cannot run here: a person, a process, or a network without its weights.
    Unavailable,
}

/// Memory of an agent at a decision whose action equals the recorded one.
#[derive(Clone, Debug)]
pub struct RerunMoment {
    /// Frame of the decision.
    pub frame: Frame,
    /// The agent.
    pub agent: AgentId,
    /// Content of its memory.
    pub memory: MemoryView,
    /// Its plan and belief.
    pub thought: Thought,
}

/// Partner and helper of a trace that run again beside its playback. The world follows the trace; the
/// agents only observe it, and their actions are compared with the recorded ones. A helper that took over
/// is compared from that frame on.
pub struct AgentRerun<T> {
    playback: Playback<T>,
    renderer: ObservationRenderer,
    seats: Vec<Seat>,
    spare_images: Vec<Images>,
}

struct Seat {
    agent: AgentId,
    slot: AgentSlot,
    status: RerunStatus,
}

impl<T: Deref<Target = Trace>> AgentRerun<T> {
    /// Creates the agents of a trace and a playback at its first frame. The registry creates the
    /// helper and a partner that deviates from the rules.
    ///
    /// # Errors
    /// If the episode is not the one of the trace.
    pub fn new(trace: T, episode: &Episode, helpers: &dyn HelperRegistry) -> Result<AgentRerun<T>> {
        let playback = Playback::new(trace, episode)?;
        let (header, world) = (playback.header(), playback.world());
        // The header of an altered trace may name an agent that the episode lacks.
        let n_people = world.setup().people.len();
        let exists = |agent: AgentId| agent <= AgentId::HELPER && agent.index() < n_people;
        let people = header.people.iter().filter(|person| exists(person.agent));
        let seats = people.map(|person| seat(header, person, world, helpers)).collect();
        let scene = Scene::with_appearance(world.setup(), header.appearance);
        let renderer = ObservationRenderer::new(Arc::new(scene));
        Ok(AgentRerun { playback, renderer, seats, spare_images: Vec::new() })
    }

    /// Returns the frame up to which the agents have run.
    pub fn frame(&self) -> Frame {
        self.playback.world().state().frame
    }

    /// Returns partner and helper with their agreement so far.
    pub fn statuses(&self) -> impl Iterator<Item = (AgentId, RerunStatus)> + '_ {
        self.seats.iter().map(|seat| (seat.agent, seat.status))
    }

    /// Runs the agents that wait in the current frame, and advances the world by one frame; `None` at
    /// the end of the trace, and once no agent runs.
    ///
    /// # Errors
    /// If the trace does not fit the world.
    pub fn step(&mut self) -> Result<Option<Vec<RerunMoment>>> {
        if self.seats.iter().all(|seat| seat.status != RerunStatus::Equal) {
            return Ok(None);
        }
        let moments = self.decide();
        Ok(self.playback.step()?.map(|_| moments))
    }

    /// Asks each waiting agent for its action, as the episode did. The trace lacks the choice of an
    /// agent that an earlier choice of the same frame engaged in a joint lift.
    fn decide(&mut self) -> Vec<RerunMoment> {
        let AgentRerun { playback, renderer, seats, spare_images } = self;
        let world = playback.world();
        let frame = world.state().frame;
        let takes_over = playback.header().helper_takes_over();
        let mut moments = Vec::new();
        for id in world.waiting() {
            let running = |seat: &&mut Seat| seat.agent == id && seat.status == RerunStatus::Equal;
            let Some(seat) = seats.iter_mut().find(running) else { continue };
            let mut due = playback.due_decisions();
            let recorded = due.find(|decision| decision.agent == id).map(|d| d.action);
            let observers = [(id, &seat.slot)];
            let Some(rendered) = renderer.observe(world, &observers, spare_images).pop() else {
                continue;
            };
            let Driver::Agent(agent) = &mut seat.slot.driver else { continue };
            if id == AgentId::HELPER && takes_over.is_some_and(|from| frame < from) {
                agent.observe(&rendered.observation);
                // As in a continuation, whose helper waits if its choice is not recorded.
                let action = recorded.unwrap_or(Action::Wait { frames: 1 });
                seat.slot.submitted = Some((action.map(Target::Entity), action));
                spare_images.push(rendered.into_images());
                continue;
            }
            let chosen = agent.act(&rendered.observation).ok();
            let submitted = chosen.map(|action| (action, rendered.resolve(action)));
            let equal =
                submitted.filter(|(_, resolved)| recorded.is_none_or(|action| action == *resolved));
            match (equal, agent.memory_view()) {
                (None, _) => seat.status = RerunStatus::Differs(frame),
                (Some(_), None) => seat.status = RerunStatus::Unavailable,
                (Some(_), Some(memory)) => {
                    seat.slot.submitted = equal;
                    if recorded.is_some() {
                        let (agent, thought) = (id, agent.thought());
                        moments.push(RerunMoment { frame, agent, memory, thought });
                    }
                }
            }
            spare_images.push(rendered.into_images());
        }
        moments
    }
}

/// Creates the agent of a participant with the recorded grants and sensors.
fn seat(
    header: &Header,
    person: &Participant,
    world: &World,
    helpers: &dyn HelperRegistry,
) -> Seat {
    let created = agent(header, person, helpers);
    let mut slot = match created {
        Some(agent) => AgentSlot::with_agent(agent, person.grants),
        None => AgentSlot::external(person.grants, person.sensors),
    };
    slot.reset(person.agent, world, header.seed, Some(person.sensors.image_size));
    // A playback has no history of images, and other sensors mean another agent. An altered header may
    // have images that exceed their bounds.
    let is_runnable = slot.agent().is_some()
        && slot.sensors == person.sensors
        && slot.sensors.check().is_ok()
        && slot.sensors.frame_history.is_none();
    let status = if is_runnable { RerunStatus::Equal } else { RerunStatus::Unavailable };
    Seat { agent: person.agent, slot, status }
}

fn agent(
    header: &Header,
    person: &Participant,
    helpers: &dyn HelperRegistry,
) -> Option<Box<dyn Agent>> {
    let needs_more = person.input.is_some()
        || person.perception.is_some()
        || person.weights.is_some()
        || person.isolation.is_some();
    if needs_more {
        return None;
    }
    let rules = header.rules.planner;
    if person.agent == AgentId::HELPER {
        let name = Some(header.helper.as_str()).filter(|name| *name != NONE);
        return Some(helpers.make(name?, rules)?.agent);
    }
    match header.partner.as_deref() {
        Some(name) => Some(helpers.partner(name, Some(&header.key()), rules)?.agent),
        None => {
            let scene = header.task.info().scene;
            Some(partners::partner(person.persona, scene, rules))
        }
    }
}

#[cfg(test)]
mod tests;
