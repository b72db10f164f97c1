//! Episode environment: a world, its agents and the loop between them.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::observation::Images;
use chaic_core::{Action, AgentError, AgentId, Briefing, Frame, Observation, Target};
use chaic_render::{ImagesMut, Scene};
use chaic_world::{Setup, World};

use crate::agent_slot::{AgentSlot, EpisodeAgents, agent_slots};
use crate::config::EpisodeConfig;
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::observer::{ObservationRenderer, resolve_unseen};
use crate::reward::RewardTerms;
use crate::step::{self, ChosenAction, submit_all};
use crate::trace::{End, Header, Record};
use crate::turn::{Turn, choose};

/// Reason why [`Env::run`] returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdvanceOutcome {
    /// The episode ended.
    Ended,
    /// The stop flag was set, or the requested frame was reached.
    Stopped,
    /// An external agent needs an action, see [`Env::waiting`].
    NeedsAction,
}

/// A running episode: the world and the agents in it.
pub struct Env {
    world: World,
    slots: Vec<AgentSlot>,
    supplied: SuppliedSlots,
    renderer: ObservationRenderer,
    header: Header,
    turns: Vec<Turn>,
    /// Image buffers for reuse.
    spare_images: Vec<Images>,
    /// Error of an agent; no agent is asked again after it.
    failure: Option<AgentError>,
    /// True if a sink has received the record of the end.
    has_recorded_end: bool,
}

/// Copy of a running episode with its agents; see [`Env::snapshot`].
///
/// It can't be serialized. To store a world, use its [`Snapshot`](chaic_world::Snapshot).
pub struct EnvSnapshot {
    world: World,
    slots: Vec<AgentSlot>,
    turns: Vec<Turn>,
    header: Header,
    supplied: SuppliedSlots,
    failure: Option<AgentError>,
    has_recorded_end: bool,
}

/// Slots that the caller supplied; the others hold the default rule-based agents of the episode.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SuppliedSlots {
    Some { helper: bool, partner: bool },
    All,
}

impl Env {
    /// Creates an episode and briefs all agents.
    ///
    /// # Errors
    /// [`EnvError::Setup`] if the setup is invalid.
    pub fn new(config: EpisodeConfig<'_>, agents: impl Into<EpisodeAgents>) -> Result<Env> {
        let agents = agents.into();
        let (helper, partner) = (agents.helper.is_some(), agents.partner.is_some());
        let supplied = SuppliedSlots::Some { helper, partner };
        let setup = config.setup(helper);
        let world = config.world(&setup)?;
        let slots = agent_slots(&setup, agents, config.rules.planner);
        Ok(Env::start(config, world, slots, supplied))
    }

    /// Creates an episode in which the caller supplies all slots, for scripted partners or children.
    ///
    /// # Errors
    /// [`EnvError::Setup`] if the setup is invalid, [`EnvError::SlotCount`] if it has another number of
    /// people.
    pub fn with_slots(config: EpisodeConfig<'_>, slots: Vec<AgentSlot>) -> Result<Env> {
        let setup = config.setup(true);
        check_slot_count(&config, &setup, slots.len())?;
        let world = config.world(&setup)?;
        Ok(Env::start(config, world, slots, SuppliedSlots::All))
    }

    fn start(
        config: EpisodeConfig<'_>,
        world: World,
        mut slots: Vec<AgentSlot>,
        supplied: SuppliedSlots,
    ) -> Env {
        config.brief(&world, &mut slots);
        let header = config.header(world.setup(), &slots);
        let scene = Scene::with_appearance(world.setup(), config.appearance);
        let renderer = ObservationRenderer::new(Arc::new(scene));
        let turns = (0..slots.len()).map(|k| Turn::new(AgentId(k as u8))).collect();
        let failure = check_sensors(&slots);
        Env {
            world,
            slots,
            supplied,
            renderer,
            header,
            turns,
            spare_images: Vec::new(),
            failure,
            has_recorded_end: false,
        }
    }

    /// Starts another episode with the agents that the caller supplied, and with its own rule-based
    /// partner and child.
    ///
    /// # Errors
    /// [`EnvError::Setup`] if the setup is invalid, [`EnvError::SlotCount`] if the caller supplied all
    /// slots and their number differs. The environment does not change then.
    pub fn reset(&mut self, config: EpisodeConfig<'_>) -> Result<()> {
        let setup = config.setup(self.slots.len() > 1);
        if self.supplied == SuppliedSlots::All {
            check_slot_count(&config, &setup, self.slots.len())?;
        }
        let world = config.world(&setup)?;
        let mut old = std::mem::take(&mut self.slots);
        let slots = match self.supplied {
            SuppliedSlots::All => old,
            SuppliedSlots::Some { helper, partner } => {
                let helper = helper.then(|| old.swap_remove(AgentId::HELPER.index()));
                let partner = partner.then(|| old.swap_remove(AgentId::PARTNER.index()));
                agent_slots(&setup, EpisodeAgents { helper, partner }, config.rules.planner)
            }
        };
        *self = Env::start(config, world, slots, self.supplied);
        Ok(())
    }

    /// Returns the header of the episode's trace.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Returns the world in its current state.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Returns the renderer of all observations.
    pub fn renderer(&self) -> &ObservationRenderer {
        &self.renderer
    }

    /// Returns the counters of all agents, keyed by `agent.counter`.
    pub fn counts(&self) -> BTreeMap<String, u64> {
        let slots = self.slots.iter().enumerate();
        slots
            .filter_map(|(k, slot)| Some((AgentId(k as u8), slot.agent()?)))
            .flat_map(|(id, agent)| {
                agent.counters().into_iter().map(move |(name, n)| (format!("{id}.{name}"), n))
            })
            .collect()
    }

    /// Returns the slots of all agents, by agent id.
    pub fn slots(&self) -> &[AgentSlot] {
        &self.slots
    }

    /// Returns the agents that the caller controls.
    pub(crate) fn external_agents(&self) -> impl Iterator<Item = AgentId> + '_ {
        let slots = self.slots.iter().enumerate();
        slots.filter(|(_, slot)| slot.agent().is_none()).map(|(k, _)| AgentId(k as u8))
    }

    /// Returns the briefing of an agent.
    ///
    /// # Panics
    /// If the episode has no such agent.
    pub fn briefing(&self, agent: AgentId) -> Briefing {
        let grants = self.slots[agent.index()].grants;
        self.world.briefing(agent, grants, self.header.seed)
    }

    /// Returns the external agents that need an action now.
    pub fn waiting(&self) -> impl Iterator<Item = AgentId> + '_ {
        let turns = self.turns.iter().enumerate();
        turns
            .filter(|(_, turn)| turn.is_open && turn.choice.is_none())
            .map(|(k, _)| AgentId(k as u8))
    }

    /// Returns the observation of a [waiting](Env::waiting) agent; `None` for other agents.
    ///
    /// The first call of a turn renders the images.
    pub fn observe(&mut self, agent: AgentId) -> Option<&Observation> {
        if !self.is_waiting(agent) {
            return None;
        }
        let turn = &mut self.turns[agent.index()];
        if turn.rendered.is_none() {
            let observers = [(agent, &self.slots[agent.index()])];
            turn.rendered =
                self.renderer.observe(&self.world, &observers, &mut self.spare_images).pop();
            if let Some(rendered) = &mut turn.rendered {
                rendered.observation.frame_history = std::mem::take(&mut turn.frame_history).into();
            }
        }
        turn.rendered.as_ref().map(|rendered| &rendered.observation)
    }

    /// Renders the color image of an agent: RGB, u8, shape [height, width, 3].
    ///
    /// It is for learners that need color in few observations. Their sensors request no color, so
    /// the other observations are rendered without it.
    ///
    /// # Panics
    /// If the episode has no such agent.
    pub fn render_color(&self, agent: AgentId) -> Vec<u8> {
        let image_size = self.slots[agent.index()].sensors.image_size;
        self.renderer.render_color(&self.world, agent, image_size)
    }

    /// Renders the observation of an agent with its images in the caller's buffers.
    pub(crate) fn observe_into(&mut self, agent: AgentId, images: ImagesMut<'_>) {
        let turn = &mut self.turns[agent.index()];
        let ids = std::mem::take(&mut turn.spare_ids);
        let slot = &self.slots[agent.index()];
        let mut rendered = self.renderer.observe_into(&self.world, agent, slot, images, ids);
        // A repeated observation keeps the history of the first one.
        rendered.observation.frame_history = match turn.rendered.take() {
            Some(first) => first.observation.frame_history,
            None => std::mem::take(&mut turn.frame_history).into(),
        };
        turn.rendered = Some(rendered);
    }

    /// Returns the rendered observation of a waiting agent.
    pub(crate) fn observed(&self, agent: AgentId) -> Option<&Observation> {
        let rendered = self.turns[agent.index()].rendered.as_ref();
        rendered.filter(|_| self.is_waiting(agent)).map(|rendered| &rendered.observation)
    }

    pub(crate) fn is_waiting(&self, agent: AgentId) -> bool {
        self.waiting().any(|a| a == agent)
    }

    /// Sets the next action of a [waiting](Env::waiting) agent. It starts when all of them have one.
    ///
    /// Returns false, and changes nothing, if the agent is not waiting.
    pub fn submit(&mut self, agent: AgentId, action: Action) -> bool {
        let has_pixel = matches!(action.subject(), Some(Target::Pixel { .. }));
        if !self.is_waiting(agent) || (has_pixel && self.observe(agent).is_none()) {
            return false;
        }
        let turn = &mut self.turns[agent.index()];
        let slot = &mut self.slots[agent.index()];
        // An agent without images can still point at what its camera sees.
        if has_pixel
            && !slot.sensors.wants_image()
            && let Some(rendered) = &mut turn.rendered
        {
            let size = slot.sensors.image_size;
            rendered.hidden_ids = Some(self.renderer.render_ids(&self.world, agent, size));
        }
        let resolved = match &turn.rendered {
            Some(rendered) => rendered.resolve(action),
            None => resolve_unseen(slot, action),
        };
        slot.submitted = Some((action, resolved));
        turn.choice = Some(ChosenAction { agent, action: resolved, thought: None, child: None });
        turn.rewards.begin_action(&self.world);
        true
    }

    /// Returns the reward terms of the last submitted action of an agent, up to now.
    ///
    /// `None` before the first action.
    pub fn reward(&self, agent: AgentId) -> Option<RewardTerms> {
        let turn = self.turns.get(agent.index())?;
        let terms = turn.rewards.action_terms(&self.world)?;
        // An action that waits for other agents has not begun.
        let has_begun = turn.choice.is_none();
        Some(RewardTerms { is_invalid: terms.is_invalid && has_begun, ..terms })
    }

    /// Returns the score of the episode if it ended now.
    pub fn score(&self) -> End {
        End::new(&self.world)
    }

    /// Returns the digest of the world's state.
    pub fn digest(&self) -> Digest {
        Digest(self.world.digest())
    }

    /// Copies the episode with its agents. A copy that is made after an agent failed keeps the failure.
    ///
    /// # Errors
    /// [`EnvError::NoFork`] if an agent can't be copied, such as one in another process or one that
    /// queries a language model.
    pub fn snapshot(&self) -> Result<EnvSnapshot> {
        Ok(EnvSnapshot {
            world: self.world.clone(),
            slots: fork(&self.slots)?,
            turns: self.turns.clone(),
            header: self.header.clone(),
            supplied: self.supplied,
            failure: self.failure.clone(),
            has_recorded_end: self.has_recorded_end,
        })
    }

    /// Replaces the state by a snapshot of the same episode. The same actions then lead to the same
    /// states.
    ///
    /// # Errors
    /// [`EnvError::OtherSnapshot`] if the snapshot is of another episode, seed, rule set or set of
    /// agents. The environment does not change then.
    pub fn restore(&mut self, snapshot: &EnvSnapshot) -> Result<()> {
        let has_agent =
            |slots: &[AgentSlot]| slots.iter().map(|s| s.agent().is_some()).collect::<Vec<_>>();
        if snapshot.header != self.header
            || snapshot.supplied != self.supplied
            || has_agent(&snapshot.slots) != has_agent(&self.slots)
        {
            return Err(EnvError::OtherSnapshot {
                id: self.header.episode.clone(),
                snapshot_of: snapshot.header.episode.clone(),
            });
        }
        self.slots = fork(&snapshot.slots)?;
        self.world = snapshot.world.clone();
        self.has_recorded_end = snapshot.has_recorded_end;
        self.turns.clone_from(&snapshot.turns);
        self.turns.iter_mut().for_each(Turn::discard_images);
        self.failure.clone_from(&snapshot.failure);
        Ok(())
    }

    /// Runs the episode as [`Env::run`] does, without records.
    ///
    /// # Errors
    /// If an agent can't decide.
    pub fn advance(
        &mut self,
        until: Option<Frame>,
    ) -> std::result::Result<AdvanceOutcome, AgentError> {
        self.run(&AtomicBool::new(false), until, &mut |_| Ok(()))
    }

    /// Runs the episode until an external agent needs an action, the episode ends, or an agent waits in
    /// a frame at or after `until`.
    ///
    /// Passes every record to `sink`, and the record of the end only once.
    ///
    /// # Errors
    /// The first error of `sink` or of an agent.
    pub fn run<E: From<AgentError>>(
        &mut self,
        stop: &AtomicBool,
        until: Option<Frame>,
        sink: &mut dyn FnMut(&Record) -> std::result::Result<(), E>,
    ) -> std::result::Result<AdvanceOutcome, E> {
        self.check_failure()?;
        while !self.world.is_over() {
            let waiting = self.world.waiting();
            if !waiting.is_empty() {
                let is_late = until.is_some_and(|frame| self.world.state().frame >= frame);
                if is_late || stop.load(Ordering::Relaxed) {
                    return Ok(AdvanceOutcome::Stopped);
                }
                if !self.submit_choices(&waiting, sink)? {
                    return Ok(AdvanceOutcome::NeedsAction);
                }
            }
            self.run_frames(sink)?;
        }
        self.record_end(sink)?;
        Ok(AdvanceOutcome::Ended)
    }

    /// Advances by one frame, for programs that show each frame; the records are those of [`Env::run`].
    /// Returns [`AdvanceOutcome::Stopped`] after a frame that is not the last one.
    ///
    /// # Errors
    /// The first error of `sink` or of an agent.
    pub fn run_frame<E: From<AgentError>>(
        &mut self,
        sink: &mut dyn FnMut(&Record) -> std::result::Result<(), E>,
    ) -> std::result::Result<AdvanceOutcome, E> {
        self.check_failure()?;
        let waiting = self.world.waiting();
        if !self.world.is_over() {
            if !waiting.is_empty() && !self.submit_choices(&waiting, sink)? {
                return Ok(AdvanceOutcome::NeedsAction);
            }
            let Env { world, slots, renderer, turns, .. } = self;
            world.tick();
            record_histories(world, slots, renderer, turns);
            step::record_events(world, sink)?;
        }
        if !self.world.is_over() {
            return Ok(AdvanceOutcome::Stopped);
        }
        self.record_end(sink)?;
        Ok(AdvanceOutcome::Ended)
    }

    /// Passes the record of the end to a sink, once in an episode.
    fn record_end<E>(
        &mut self,
        sink: &mut dyn FnMut(&Record) -> std::result::Result<(), E>,
    ) -> std::result::Result<(), E> {
        if !self.has_recorded_end {
            sink(&Record::End(End::new(&self.world)))?;
            self.has_recorded_end = true;
        }
        Ok(())
    }

    fn check_failure<E: From<AgentError>>(&self) -> std::result::Result<(), E> {
        self.failure.as_ref().map_or(Ok(()), |error| Err(error.clone().into()))
    }

    /// Lets the agents in the environment choose, and submits the actions of the waiting agents if all
    /// have chosen. Returns false if an external agent has not.
    fn submit_choices<E: From<AgentError>>(
        &mut self,
        waiting: &[AgentId],
        sink: &mut dyn FnMut(&Record) -> std::result::Result<(), E>,
    ) -> std::result::Result<bool, E> {
        self.open_turns(waiting)?;
        if waiting.iter().any(|a| self.turns[a.index()].choice.is_none()) {
            return Ok(false);
        }
        let choices = waiting.iter().filter_map(|a| self.turns[a.index()].close()).collect();
        for agent in submit_all(&mut self.world, choices, sink)? {
            // The trace lacks the thought of this agent, so its next decision always records one.
            self.turns[agent.index()].recorded.thought = None;
        }
        Ok(true)
    }

    /// Opens the turns of the waiting agents that have none yet. Agents in the environment choose here;
    /// the turns of external agents stay open without an action.
    fn open_turns(&mut self, waiting: &[AgentId]) -> std::result::Result<(), AgentError> {
        let Env { world, slots, renderer, turns, spare_images, failure, .. } = self;
        let new: Vec<_> = waiting.iter().filter(|a| !turns[a.index()].is_open).copied().collect();
        let agents: Vec<_> =
            new.iter().filter(|a| slots[a.index()].agent().is_some()).copied().collect();
        let observations = {
            let observers: Vec<_> = agents.iter().map(|a| (*a, &slots[a.index()])).collect();
            renderer.observe(world, &observers, spare_images)
        };
        for (agent, mut rendered) in agents.into_iter().zip(observations) {
            let turn = &mut turns[agent.index()];
            rendered.observation.frame_history = std::mem::take(&mut turn.frame_history).into();
            let chosen = choose(&mut slots[agent.index()], agent, &rendered, &mut turn.recorded);
            turn.choice = chosen.inspect_err(|error| *failure = Some(error.clone()))?;
            if slots[agent.index()].sensors.wants_image() {
                spare_images.push(rendered.into_images());
            }
        }
        for agent in new {
            turns[agent.index()].is_open = true;
        }
        Ok(())
    }

    /// Runs frames until an agent waits or the episode ends, and records frame histories.
    fn run_frames<E>(
        &mut self,
        sink: &mut dyn FnMut(&Record) -> std::result::Result<(), E>,
    ) -> std::result::Result<(), E> {
        let Env { world, slots, renderer, turns, .. } = self;
        world.advance_with_callback(&mut |world| record_histories(world, slots, renderer, turns));
        step::record_events(world, sink)
    }
}

/// Appends the current images to the frame histories of the agents that request one.
fn record_histories(
    world: &World,
    slots: &[AgentSlot],
    renderer: &ObservationRenderer,
    turns: &mut [Turn],
) {
    for (k, (slot, turn)) in slots.iter().zip(turns).enumerate() {
        if let Some(history) = slot.sensors.frame_history {
            let agent = AgentId(k as u8);
            renderer.record_history(world, agent, history, &mut turn.frame_history);
        }
    }
}

fn check_slot_count(config: &EpisodeConfig<'_>, setup: &Setup, slots: usize) -> Result<()> {
    let people = setup.people.len();
    if people == slots {
        return Ok(());
    }
    Err(EnvError::SlotCount { id: config.episode.id().to_owned(), people, slots })
}

/// Returns an error if an agent requests observations that exceed their bounds.
fn check_sensors(slots: &[AgentSlot]) -> Option<AgentError> {
    let check = |(k, slot): (usize, &AgentSlot)| {
        let problem = slot.sensors.check().err()?;
        Some(AgentError::Broken(format!("the {} {problem}", AgentId(k as u8))))
    };
    slots.iter().enumerate().find_map(check)
}

fn fork(slots: &[AgentSlot]) -> Result<Vec<AgentSlot>> {
    let fork = |(k, slot): (usize, &AgentSlot)| {
        let agent = AgentId(k as u8);
        slot.fork().ok_or(EnvError::NoFork { agent })
    };
    slots.iter().enumerate().map(fork).collect()
}
