//! Player of one trace.

use std::path::Path;
use std::sync::Arc;

use chaic_core::agent::PartnerBelief;
use chaic_core::geom::to_xz;
use chaic_core::{AgentId, FRAMES_PER_SECOND, Frame, Vec2};
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _, built_in_partner};
use chaic_env::narration::{Caption, DetectedObject, action_text, detected_objects};
use chaic_env::trace::{Decision, Header, Trace, parse};
use chaic_env::{EnvError, Playback};
use chaic_episodes::{Episode, EpisodeError};
use chaic_render::floor_plan::{self, FloorPlan};
use chaic_render::{Channels, Scene, View};
use chaic_world::World;
use serde::Serialize;

use crate::drawing::{CanvasLabel, DrawnImage, DrawnMap};
use crate::keyframes::Keyframes;
use crate::limits::{TaskObject, task_objects};
use crate::memory_history::{MemoryHistory, MemoryState, RerunInfo, rounded};
use crate::timeline::Timeline;

/// Distance between the points of a trail, frames.
const TRAIL_INTERVAL: Frame = 10;

/// Reason why a replay cannot be opened or drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlayerError {
    /// The trace is unreadable or does not fit the episode.
    #[error(transparent)]
    Trace(#[from] EnvError),
    /// The episode is unreadable.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The episode has no such agent.
    #[error("the episode has no agent {0}")]
    NoAgent(AgentId),
}

/// Facts about a replay, as far as it is re-simulated.
#[derive(Clone, Debug, Serialize)]
pub struct ReplayInfo {
    /// Name of the task.
    pub task: &'static str,
    /// Episode id.
    pub episode: String,
    /// Name of the helper.
    pub helper: String,
    /// Index of the seed.
    pub seed: u32,
    /// Version of the program that wrote the trace.
    pub chaic: String,
    /// Frame from which this trace continues another trace, if any.
    pub branch_at: Option<Frame>,
    /// Helpers that can take over; empty if an agent of the trace cannot act again in a page.
    pub successors: Vec<String>,
    /// Agents with their descriptions, by id.
    pub agents: Vec<AgentInfo>,
    /// Wanted objects, for example `3 apple`.
    pub goal: Vec<String>,
    /// True if the re-simulation has ended.
    pub is_complete: bool,
    /// Last frame that can be shown.
    pub last_frame: Frame,
    /// Length of the trace in frames; larger than `last_frame` if the trace is altered.
    pub length: Frame,
    /// Frames per second of simulated time.
    pub frames_per_second: u32,
    /// Total value of the goal.
    pub total: f64,
    /// Unit of the value; empty for a number of objects.
    pub unit: &'static str,
    /// Number of decisions whose digest equals that of the re-simulation.
    pub n_verified: usize,
    /// Number of decisions in the trace.
    pub n_decisions: usize,
    /// Why the re-simulation stopped; absent for an intact trace.
    pub problem: Option<String>,
    /// Activities, events and deliveries.
    pub timeline: Timeline,
    /// Decisions in chronological order.
    pub decisions: Vec<DecisionLine>,
    /// Height of the map without its legend, relative to its width.
    pub map_height: f32,
    /// Frames between the points of a trail.
    pub trail_interval: Frame,
    /// Positions of each agent on the map at multiples of `trail_interval`: distances from the left and
    /// upper edge, relative to the width of the map.
    pub trails: Vec<Vec<[f32; 2]>>,
}

/// Decision in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DecisionLine {
    /// Frame.
    pub frame: Frame,
    /// The agent.
    pub agent: AgentId,
    /// The action, for example `picks up apple #31`.
    pub text: String,
}

/// Description of an agent.
#[derive(Clone, Debug, Serialize)]
pub struct AgentInfo {
    /// Agent id.
    pub id: AgentId,
    /// Name: partner, helper or child.
    pub name: String,
    /// Kind of person.
    pub person: String,
    /// Lowest and highest reach, meters.
    pub reach_m: [f32; 2],
    /// Maximum lifted mass, kilograms.
    pub strength_kg: f32,
}

/// State of one frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameState {
    /// Frame.
    pub frame: Frame,
    /// Action and plan of each agent.
    pub captions: Vec<Caption>,
    /// Achieved value of the goal.
    pub done: f64,
    /// Number of verified decisions so far.
    pub n_verified: usize,
    /// Belief of the helper, if it records one.
    pub belief: Option<PartnerBelief>,
    /// Objects that each agent detects in its image, if it records them.
    pub detected: Vec<Vec<DetectedObject>>,
}

/// State of the agents that run again beside the replay.
#[derive(Clone, Debug, Serialize)]
pub struct RerunState {
    /// Frame that these agents have reached.
    pub frame: Frame,
    /// True if the agents run no further.
    pub is_complete: bool,
    /// Agreement of each agent with the replay.
    pub agents: Vec<RerunInfo>,
}

/// Re-simulation of a trace with a movable position.
pub struct ReplayPlayer {
    scene: Scene,
    /// Map at the width that was drawn last.
    plan: Option<FloorPlan>,
    current: Playback<Arc<Trace>>,
    /// State at the last verified frame.
    verified: Playback<Arc<Trace>>,
    keyframes: Keyframes<Playback<Arc<Trace>>>,
    timeline: Timeline,
    trails: Vec<Vec<[f32; 2]>>,
    /// Why the re-simulation stopped, or the trace is incomplete.
    problem: Option<String>,
    is_complete: bool,
    trace: Arc<Trace>,
    episode: Episode,
    /// Memories of the agents, once they run again.
    memories: Option<MemoryHistory>,
}

impl ReplayPlayer {
    /// Opens a trace (JSON lines) of an episode (JSON) at its first frame.
    ///
    /// # Errors
    /// If the trace or the episode is unreadable, or they do not belong together.
    pub fn open(trace: &[u8], episode: &[u8]) -> Result<ReplayPlayer, PlayerError> {
        let (trace, warnings) = parse(trace, Path::new("trace"))?;
        let episode = Episode::parse(episode, "episode")?;
        let trace = Arc::new(trace);
        let start = Playback::new(Arc::clone(&trace), &episode)?;
        let world = start.world();
        let scene = Scene::with_appearance(world.setup(), trace.header.appearance);
        let mut trails = vec![Vec::new(); world.state().agents.len()];
        add_positions(&mut trails, world);
        Ok(ReplayPlayer {
            scene,
            plan: None,
            current: start.clone(),
            keyframes: Keyframes::new(start.clone()),
            verified: start,
            timeline: Timeline::default(),
            trails,
            problem: warnings.first().map(ToString::to_string),
            is_complete: false,
            trace,
            episode,
            memories: None,
        })
    }

    /// Re-simulates the trace from the last verified frame, for at most `n_frames`. Returns true once
    /// the re-simulation has ended: with the trace, or before the frame in which an altered trace
    /// differs. Only verified frames can be shown.
    pub fn verify(&mut self, n_frames: Frame) -> bool {
        for _ in 0..n_frames {
            if self.is_complete {
                break;
            }
            self.verify_next();
        }
        self.is_complete
    }

    fn verify_next(&mut self) {
        match self.verified.step() {
            Ok(Some(events)) => self.timeline.add(self.verified.world(), &events),
            end => {
                self.is_complete = true;
                if let Err(error) = end {
                    self.problem = Some(error.to_string());
                }
                return;
            }
        }
        let frame = self.verified.world().state().frame;
        self.keyframes.add(frame, &self.verified);
        if frame.is_multiple_of(TRAIL_INTERVAL) {
            add_positions(&mut self.trails, self.verified.world());
        }
    }

    /// Describes the replay up to the last verified frame.
    pub fn info(&self) -> ReplayInfo {
        let (header, world) = (self.verified.header(), self.verified.world());
        let setup = world.setup();
        let agent = |(id, person): (AgentId, &chaic_world::AgentSpec)| {
            let capability = person.capability();
            AgentInfo {
                id,
                name: id.to_string(),
                person: person.kind().to_string(),
                reach_m: capability.pick_range_m,
                strength_kg: capability.strength_kg,
            }
        };
        let decision = |decision: &Decision| DecisionLine {
            frame: decision.frame,
            agent: decision.agent,
            text: action_text(setup, &decision.action),
        };
        let decisions: Vec<DecisionLine> = self.trace.decisions().map(decision).collect();
        let goal =
            setup.goal.targets.iter().map(|(class, n)| format!("{n} {}", class.info().label));
        ReplayInfo {
            task: header.task.info().title,
            episode: header.episode.clone(),
            helper: header.helper.clone(),
            seed: header.seed,
            chaic: header.chaic.clone(),
            branch_at: header.branch_of.map(|branch| branch.frame),
            successors: successors(header),
            agents: setup.agents().zip(&setup.people).map(agent).collect(),
            goal: goal.collect(),
            is_complete: self.is_complete,
            last_frame: world.state().frame,
            length: self.verified.last_frame(),
            frames_per_second: FRAMES_PER_SECOND,
            total: world.progress().1,
            unit: header.task.info().target_value.unit(),
            n_verified: self.verified.n_decisions(),
            n_decisions: decisions.len(),
            problem: self.problem.clone(),
            timeline: self.timeline.clone(),
            decisions,
            map_height: floor_plan::relative_height(world),
            trail_interval: TRAIL_INTERVAL,
            trails: self.trails.clone(),
        }
    }

    /// Moves to a frame, at most the last verified one.
    ///
    /// # Errors
    /// Never, since the frames are verified.
    pub fn seek(&mut self, frame: Frame) -> Result<(), PlayerError> {
        let frame = frame.min(self.verified.world().state().frame);
        let now = self.current.world().state().frame;
        if let Some(start) = self.keyframes.start_for(frame, now) {
            self.current = start.clone();
        }
        while self.current.world().state().frame < frame && self.current.step()?.is_some() {}
        Ok(())
    }

    /// Returns the state of the current frame.
    pub fn state(&self) -> FrameState {
        let world = self.current.world();
        FrameState {
            frame: world.state().frame,
            captions: world.setup().agents().map(|a| Caption::new(&self.current, a)).collect(),
            done: world.progress().0,
            n_verified: self.current.n_decisions(),
            belief: self.belief().cloned(),
            detected: world.setup().agents().map(|agent| self.detected(agent)).collect(),
        }
    }

    /// Returns the recorded detections of an agent that are in its view.
    fn detected(&self, agent: AgentId) -> Vec<DetectedObject> {
        let Some(thought) = self.current.thoughts().get(agent.index()) else { return Vec::new() };
        if thought.perceived.is_empty() {
            return Vec::new();
        }
        let view = View::from_agent(self.current.world(), agent, 1, Channels::RGB);
        detected_objects(&thought.perceived, &view.camera)
    }

    /// Runs partner and helper again, up to their next decision, so that their memories can be shown.
    ///
    /// # Errors
    /// Never after [`ReplayPlayer::open`].
    pub fn rerun_agents(&mut self) -> Result<RerunState, PlayerError> {
        let memories = match &mut self.memories {
            Some(memories) => memories,
            None => {
                let memories = MemoryHistory::new(Arc::clone(&self.trace), &self.episode)?;
                self.memories.insert(memories)
            }
        };
        let is_complete = !memories.run_to_decision();
        Ok(RerunState { frame: memories.frame(), is_complete, agents: memories.info() })
    }

    /// Returns the memory of an agent at the current frame; `None` before
    /// [`ReplayPlayer::rerun_agents`] has reached the frame, or if the agent does not act as recorded.
    pub fn memory(&self, agent: AgentId) -> Option<MemoryState> {
        let world = self.current.world();
        let belief = self.belief().filter(|_| agent == AgentId::HELPER);
        self.memories.as_ref()?.state(world, agent, world.state().frame, belief)
    }

    /// Returns the map in the memory of an agent at the current frame, row by row: 0 for an unknown
    /// cell, 1 for a free and 2 for an occupied one; empty without a memory.
    pub fn explored(&self, agent: AgentId) -> Vec<u8> {
        let frame = self.current.world().state().frame;
        self.memories.as_ref().map_or(Vec::new(), |memories| memories.explored(agent, frame))
    }

    /// Returns the objects of the task at the current frame, with the limits of the partner that they
    /// exceed.
    pub fn task_objects(&self) -> Vec<TaskObject> {
        task_objects(self.current.world())
    }

    fn belief(&self) -> Option<&PartnerBelief> {
        self.current.thoughts().get(AgentId::HELPER.index())?.belief.as_deref()
    }

    /// Draws what an agent sees at the current frame, as a square image.
    ///
    /// # Errors
    /// If the episode has no such agent.
    pub fn draw_view(&self, agent: AgentId, side_px: u32) -> Result<DrawnImage, PlayerError> {
        let world = self.current.world();
        if !world.setup().agents().any(|other| other == agent) {
            return Err(PlayerError::NoAgent(agent));
        }
        let view = View::from_agent(world, agent, side_px, Channels::RGB);
        let images = self.scene.render(world, &[view]);
        let rgb = images.into_iter().next().and_then(|images| images.rgb).unwrap_or_default();
        Ok(DrawnImage::from_rgb(side_px, side_px, &rgb))
    }

    /// Draws the map of the current frame, with the ring of the helper's belief about the partner's
    /// position if it records one.
    pub fn draw_map(&mut self, width_px: u32) -> DrawnMap {
        let kept = self.plan.take().filter(|plan| plan.width() == width_px);
        let world = self.current.world();
        let plan = kept.unwrap_or_else(|| FloorPlan::new(world, width_px));
        let (mut map, labels) = plan.draw_without_text(&self.scene, world);
        self.plan = Some(plan);
        if let Some([x, z]) = self.belief().and_then(|belief| belief.position_cm) {
            let position = Vec2::new(0.01 * x as f32, 0.01 * z as f32);
            floor_plan::mark_believed_position(&mut map, world, AgentId::HELPER, position);
        }
        DrawnMap {
            image: DrawnImage::from_rgb(map.width(), map.height(), map.as_raw()),
            labels: labels.iter().map(CanvasLabel::new).collect(),
        }
    }
}

/// Returns the helpers that can take over in a trace.
fn successors(header: &Header) -> Vec<String> {
    let can_act_again = |name: &String| built_in_partner(name, header.rules.planner).is_some();
    let has_helper = header.people.iter().any(|person| person.agent == AgentId::HELPER);
    match has_helper && header.partner.as_ref().is_none_or(can_act_again) {
        true => BuiltInHelpers.names(),
        false => Vec::new(),
    }
}

/// Appends the current position of each agent to its trail.
fn add_positions(trails: &mut [Vec<[f32; 2]>], world: &World) {
    for (trail, agent) in trails.iter_mut().zip(&world.state().agents) {
        trail.push(rounded(floor_plan::position_on_map(world, to_xz(agent.pose.position))));
    }
}

#[cfg(test)]
pub(crate) mod tests;
