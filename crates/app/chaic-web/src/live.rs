//! Episode that a person plays, as partner or helper.

use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_agents::policies::ExternalPolicy;
use chaic_agents::{PlanningAgent, partners};
use chaic_core::agent::Thought;
use chaic_core::observation::{Grants, HeldObject, SensorConfig};
use chaic_core::{
    Action, Agent as _, AgentError, AgentId, FRAMES_PER_SECOND, Frame, Hand, Outcome, Target,
};
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry, find};
use chaic_env::narration::{Caption, event_text, object_name};
use chaic_env::trace::{BranchPoint, Header, Record, Trace};
use chaic_env::{
    AdvanceOutcome, AgentSlot, Env, EnvError, EpisodeAgents, EpisodeConfig, Playback, Successors,
};
use chaic_episodes::{Episode, EpisodeError};
use chaic_render::{Channels, Scene, View};
use chaic_world::{EventKind, Setup};
use serde::{Deserialize, Serialize};

use crate::drawing::DrawnImage;
use crate::timeline::StoryLine;

mod reference;

/// Name in traces of an agent that a person controls.
pub const PERSON: &str = "human";

/// Duration of one pause of a person who has not decided while the world goes on, frames.
const PAUSE_FRAMES: u32 = 3;

/// Reason why an episode cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The episode is unreadable.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The environment refuses the episode, or a trace is unreadable.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// An agent cannot decide.
    #[error(transparent)]
    Agent(#[from] AgentError),
    /// The registry has no partner of this name.
    #[error("the partner `{0}` cannot act here")]
    NoPartner(String),
    /// The seat is neither partner nor helper.
    #[error("agent {0} has no seat for a person")]
    NoSeat(AgentId),
    /// The agents act differently than in the trace, for example those of another version.
    #[error("the other agents do not act as in the trace; take over from an earlier frame")]
    Diverged,
}

/// Level of the person's decisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputLevel {
    /// The person chooses plans, which a planner executes.
    Plans,
    /// The person chooses each action.
    Steps,
}

/// Seat, level of input and helper of a played episode.
#[derive(Clone, Debug, Deserialize)]
pub struct LiveConfig {
    /// Index of the seed.
    pub seed: u32,
    /// Agent that the person controls: partner or helper.
    pub seat: AgentId,
    /// Level of the person's decisions.
    pub level: InputLevel,
    /// Helper if the person is the partner; `none` for no helper.
    pub helper: String,
    /// True if the world goes on while the person thinks; otherwise it waits.
    #[serde(default)]
    pub is_live: bool,
}

/// Decision of a person.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LiveInput {
    /// Text of a plan, if the person chooses plans.
    Plan(String),
    /// Action, if the person chooses each action.
    Action(Action),
}

/// Progress of the episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LiveStatus {
    /// The person acts or waits.
    Running,
    /// The person can decide; the world waits, unless the clock is live.
    Waiting,
    /// The episode is over.
    Ended,
}

/// State of a played episode.
#[derive(Clone, Debug, Serialize)]
pub struct LiveState {
    /// Frame.
    pub frame: Frame,
    /// Last frame of the episode if the goal is not reached before.
    pub horizon: Frame,
    /// Progress.
    pub status: LiveStatus,
    /// Plans that can be started now, if the person chooses plans and must decide.
    pub plans: Vec<String>,
    /// Contents of the left and the right hand in words; absent for an empty hand.
    pub hands: [Option<String>; 2],
    /// Why the person's last action failed, if it did.
    pub failure: Option<String>,
    /// True if the person's last decision could not be taken.
    pub is_refused: bool,
    /// Action and plan of the person's agent.
    pub caption: Caption,
    /// Achieved and total value of the goal; absent for a person who helps, until the end.
    pub progress: Option<[f64; 2]>,
    /// Events since the last state that the person notices.
    pub events: Vec<StoryLine>,
}

/// Facts about a played episode that do not change.
#[derive(Clone, Debug, Serialize)]
pub struct LiveInfo {
    /// Name of the task.
    pub task: &'static str,
    /// Episode id.
    pub episode: String,
    /// Wanted objects, for example `3 apple`; empty for a person who must find out.
    pub goal: Vec<String>,
    /// Unit of the value of the goal; empty for a number of objects.
    pub unit: &'static str,
    /// Kind of person of the person's body: a helper does not learn the partner's.
    pub person: String,
    /// Lowest and highest reach of the person's body, meters.
    pub reach_m: [f32; 2],
    /// Maximum mass that the person's body lifts, kilograms.
    pub strength_kg: f32,
    /// Frames per second of simulated time.
    pub frames_per_second: Frame,
}

/// Episode that a person plays.
pub struct LiveSession {
    env: Env,
    setup: Setup,
    scene: Scene,
    seat: AgentId,
    level: InputLevel,
    is_live: bool,
    /// Chosen action that starts after the pause, if the clock is live.
    next_action: Option<Action>,
    is_refused: bool,
    /// Executes the person's plans; `None` if the person chooses actions.
    planner: Option<Planner>,
    status: LiveStatus,
    branch_of: Option<BranchPoint>,
    /// Records of the trace.
    lines: Vec<String>,
    events: Vec<StoryLine>,
}

/// Planner that executes the person's plans.
struct Planner {
    agent: PlanningAgent<ExternalPolicy>,
    /// True if it has observed the current turn.
    has_observed: bool,
}

impl LiveSession {
    /// Starts an episode (JSON) with the helper of a registry.
    ///
    /// # Errors
    /// If the episode is unreadable, or a helper or seat does not exist.
    pub fn start(
        episode: &[u8],
        config: &LiveConfig,
        helpers: &dyn HelperRegistry,
    ) -> Result<LiveSession, LiveError> {
        let episode = Episode::parse(episode, "episode")?;
        LiveSession::with(EpisodeConfig::new(&episode, PERSON), config, helpers)
    }

    /// Starts an episode with the rules, image size, appearance and partner of `base`.
    fn with(
        base: EpisodeConfig<'_>,
        config: &LiveConfig,
        helpers: &dyn HelperRegistry,
    ) -> Result<LiveSession, LiveError> {
        let rules = base.rules;
        let (grants, is_helper) = match config.seat {
            AgentId::PARTNER => (partners::partner_grants(rules.planner), false),
            AgentId::HELPER => (Grants::PLANNER, true),
            seat => return Err(LiveError::NoSeat(seat)),
        };
        let sensors = match config.level {
            InputLevel::Plans => SensorConfig::DEPTH_AND_IDS,
            InputLevel::Steps => SensorConfig { rgb: true, ..SensorConfig::NONE },
        };
        let person = AgentSlot::external(grants, sensors);
        let agents = if is_helper {
            let partner = base.partner.map(|name| {
                let found = helpers.partner(name, None, rules.planner).map(AgentSlot::from);
                found.ok_or_else(|| LiveError::NoPartner(name.to_owned()))
            });
            EpisodeAgents { helper: Some(person), partner: partner.transpose()? }
        } else {
            let helper = find(helpers, &config.helper, rules.planner)?.map(AgentSlot::from);
            EpisodeAgents { helper, partner: Some(person) }
        };
        let name = if is_helper { PERSON } else { config.helper.as_str() };
        let partner = if is_helper { base.partner } else { Some(PERSON) };
        let env_config = EpisodeConfig { seed: config.seed, helper: name, partner, ..base };
        let env = Env::new(env_config, agents)?;
        let planner = (config.level == InputLevel::Plans).then(|| {
            let mut agent = PlanningAgent::with_watched(
                ExternalPolicy::default(),
                rules.planner,
                &GroundTruthPerceptionFactory,
                AgentId::PARTNER,
                grants,
            );
            agent.reset(&env.briefing(config.seat));
            Planner { agent, has_observed: false }
        });
        Ok(LiveSession {
            scene: Scene::with_appearance(env.world().setup(), base.appearance),
            setup: env.world().setup().clone(),
            lines: Vec::new(),
            branch_of: None,
            env,
            seat: config.seat,
            level: config.level,
            is_live: config.is_live,
            next_action: None,
            is_refused: false,
            planner,
            status: LiveStatus::Running,
            events: Vec::new(),
        })
    }

    /// Starts with the decisions of a trace (JSON lines) before a frame; then the person controls
    /// the agent of the seat. The helper of the trace takes part if the person is the partner, and
    /// must be built in.
    ///
    /// # Errors
    /// If trace or episode are unreadable, or the other agents do not act as in the trace.
    pub fn take_over(
        bytes: &[u8],
        episode: &[u8],
        from: Frame,
        config: &LiveConfig,
    ) -> Result<LiveSession, LiveError> {
        let (trace, _) = chaic_env::trace::parse(bytes, "trace".as_ref())?;
        let episode = Episode::parse(episode, "episode")?;
        let (helper, seed) = (trace.header.helper.clone(), trace.header.seed);
        let config = LiveConfig { helper, seed, ..config.clone() };
        let header = &trace.header;
        let base = EpisodeConfig {
            rules: header.rules,
            appearance: header.appearance,
            image_size: image_size_of_others(header, config.seat),
            partner: header.partner.as_deref(),
            ..EpisodeConfig::new(&episode, PERSON)
        };
        let successors = Successors::of(&trace);
        let helpers: &dyn HelperRegistry = match &successors {
            Some(successors) => successors,
            None => &BuiltInHelpers,
        };
        let mut session = LiveSession::with(base, &config, helpers)?;
        session.repeat(&trace, |session| session.env.world().state().frame >= from)?;
        if Playback::new(&trace, &episode)?.digest_at(from)? != session.env.digest() {
            return Err(LiveError::Diverged);
        }
        session.branch_of = Some(BranchPoint::new(bytes, from));
        Ok(session)
    }

    /// Continues the trace (JSON lines) of a session with the same episode, configuration and
    /// helpers. After an interrupted plan, the person chooses again.
    ///
    /// # Errors
    /// If trace or episode are unreadable, or the session does not repeat the trace.
    pub fn resume(
        bytes: &[u8],
        episode: &[u8],
        config: &LiveConfig,
        helpers: &dyn HelperRegistry,
    ) -> Result<LiveSession, LiveError> {
        let (trace, _) = chaic_env::trace::parse(bytes, "trace".as_ref())?;
        let mut session = LiveSession::start(episode, config, helpers)?;
        let n_lines = bytes.iter().filter(|byte| **byte == b'\n').count();
        session.repeat(&trace, |session| session.n_lines() >= n_lines)?;
        session.events.clear();
        if !session.trace().as_bytes().starts_with(bytes) {
            return Err(LiveError::Diverged);
        }
        Ok(session)
    }

    /// Repeats the decisions of the person in a trace until a condition holds or the episode ends.
    fn repeat(
        &mut self,
        trace: &Trace,
        is_done: impl Fn(&LiveSession) -> bool,
    ) -> Result<(), LiveError> {
        let seat = self.seat;
        let mut decisions = trace.decisions().filter(|d| d.agent == seat).peekable();
        while self.status != LiveStatus::Ended && !is_done(self) {
            if self.run_frame()? != AdvanceOutcome::NeedsAction {
                continue;
            }
            let frame = self.env.world().state().frame;
            let next = decisions.next_if(|decision| decision.frame == frame);
            let action = next.ok_or(LiveError::Diverged)?.action.map(Target::Entity);
            self.observe();
            self.submit(action);
        }
        Ok(())
    }

    /// Returns the facts that do not change. A person who helps does not learn the goal.
    pub fn info(&self) -> LiveInfo {
        let (header, setup) = (self.env.header(), self.env.world().setup());
        let targets = setup.goal.targets.iter();
        let goal = targets.map(|(class, n)| format!("{n} {}", class.info().label));
        let goal: Vec<String> = goal.filter(|_| self.seat == AgentId::PARTNER).collect();
        let body = setup.people[self.seat.index()].capability();
        let task = header.task.info();
        LiveInfo {
            task: task.title,
            episode: header.episode.clone(),
            goal,
            unit: task.target_value.unit(),
            person: setup.people[self.seat.index()].kind().to_string(),
            reach_m: body.pick_range_m,
            strength_kg: body.strength_kg,
            frames_per_second: FRAMES_PER_SECOND,
        }
    }

    /// Advances by at most this many frames, until the person must decide or the episode ends. With a
    /// live clock, the person's agent pauses until a decision.
    ///
    /// # Errors
    /// If an agent cannot decide.
    pub fn advance(&mut self, n_frames: Frame) -> Result<LiveStatus, LiveError> {
        let end = self.env.world().state().frame + n_frames;
        while self.status != LiveStatus::Ended && self.env.world().state().frame < end {
            if self.run_frame()? != AdvanceOutcome::NeedsAction {
                continue;
            }
            match self.chosen_action()? {
                Some(action) => self.submit(action),
                None if self.is_live => {
                    self.submit(Action::Wait { frames: PAUSE_FRAMES });
                    self.status = LiveStatus::Waiting;
                }
                None => {
                    self.status = LiveStatus::Waiting;
                    break;
                }
            }
        }
        Ok(self.status)
    }

    /// Takes a decision. Returns false if it cannot be taken now; then only `LiveState::is_refused` changes.
    pub fn decide(&mut self, input: &LiveInput) -> bool {
        match input {
            LiveInput::Plan(plan) => self.choose_plan(plan),
            LiveInput::Action(action) => self.act(*action),
        }
    }

    /// Returns the progress of the episode.
    pub fn status(&self) -> LiveStatus {
        self.status
    }

    /// Returns the current frame.
    pub fn frame(&self) -> Frame {
        self.env.world().state().frame
    }

    /// Selects a plan by its text. Returns false if it cannot be started now: with a live clock, the
    /// plans may have changed since the last state.
    pub fn choose_plan(&mut self, plan: &str) -> bool {
        let planner = self.planner.as_mut().filter(|_| self.status == LiveStatus::Waiting);
        let is_chosen = planner.is_some_and(|planner| {
            let policy = planner.agent.policy_mut();
            let index = policy.valid().iter().position(|valid| valid.to_string() == plan);
            index.is_some_and(|index| policy.set_plan(index))
        });
        if is_chosen {
            self.status = LiveStatus::Running;
        }
        self.is_refused = !is_chosen;
        is_chosen
    }

    /// Performs an action. Returns false if the person cannot decide now or chooses plans.
    pub fn act(&mut self, action: Action) -> bool {
        let is_due = self.planner.is_none() && self.status == LiveStatus::Waiting;
        if is_due && self.is_live {
            self.next_action = Some(action);
            self.status = LiveStatus::Running;
        } else if is_due {
            self.submit(action);
        }
        self.is_refused = !is_due;
        is_due
    }

    fn submit(&mut self, action: Action) {
        self.env.submit(self.seat, action);
        self.status = LiveStatus::Running;
        if let Some(planner) = &mut self.planner {
            planner.has_observed = false;
        }
    }

    fn run_frame(&mut self) -> Result<AdvanceOutcome, LiveError> {
        let LiveSession { env, setup, lines, events, seat, .. } = self;
        let mut sink = |record: &Record| -> Result<(), AgentError> {
            if let Record::Event(event) = record
                && notices(*seat, &event.event.kind)
            {
                let (frame, text) = (event.event.frame, event_text(setup, &event.event.kind));
                events.extend(text.map(|text| StoryLine { frame, text }));
            }
            lines.push(record.to_line());
            Ok(())
        };
        let outcome = env.run_frame(&mut sink)?;
        if outcome == AdvanceOutcome::Ended {
            self.status = LiveStatus::Ended;
        }
        Ok(outcome)
    }

    /// Shows the current turn to the planner.
    fn observe(&mut self) {
        if let Some(planner) = self.planner.as_mut().filter(|planner| !planner.has_observed)
            && let Some(observation) = self.env.observe(self.seat)
        {
            planner.agent.observe(observation);
            planner.has_observed = true;
        }
    }

    /// Returns the chosen action, or the next one of the person's plan; `None` if the person must decide.
    fn chosen_action(&mut self) -> Result<Option<Action>, LiveError> {
        self.observe();
        let Some(planner) = &mut self.planner else { return Ok(self.next_action.take()) };
        match planner.agent.next_action() {
            Ok(action) => Ok(Some(action)),
            Err(AgentError::Halted(_)) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Returns the current state, with the events since the last call.
    pub fn state(&mut self) -> LiveState {
        let events = std::mem::take(&mut self.events);
        let world = self.env.world();
        let person = &world.state().agents[self.seat.index()];
        let failure = match &person.last {
            Some((_, Outcome::Failure(reason))) if person.activity.is_none() => {
                Some(reason.to_string())
            }
            _ => None,
        };
        let (done, total) = world.progress();
        let knows_progress = self.seat == AgentId::PARTNER || self.status == LiveStatus::Ended;
        LiveState {
            frame: world.state().frame,
            horizon: world.setup().horizon,
            status: self.status,
            plans: self.plans(),
            hands: self.hands(),
            failure,
            is_refused: self.is_refused,
            caption: self.caption(),
            progress: knows_progress.then_some([done, total]),
            events,
        }
    }

    fn plans(&self) -> Vec<String> {
        let planner = self.planner.as_ref().filter(|_| self.status == LiveStatus::Waiting);
        let valid = planner.map_or(&[][..], |planner| planner.agent.policy().valid());
        valid.iter().map(ToString::to_string).collect()
    }

    fn hands(&self) -> [Option<String>; 2] {
        let proprioception = self.env.world().proprioception(self.seat, Grants::IDS, None);
        let text = |held: &HeldObject| {
            let identity = held.identity.as_ref();
            let name = identity.map(|held| object_name(&self.setup, held.entity));
            let name = name.unwrap_or_else(|| "something".to_owned());
            match held.n_contents {
                0 => name,
                n => format!("{name} with {n} inside"),
            }
        };
        Hand::BOTH.map(|hand| proprioception.hands[hand.index()].as_ref().map(text))
    }

    fn caption(&self) -> Caption {
        let plan = self.planner.as_ref().and_then(|planner| planner.agent.plan());
        let plan = plan.map_or_else(String::new, |plan| plan.to_string());
        let thought = Thought { plan, ..Thought::default() };
        Caption::of_agent(self.env.world(), self.seat, PERSON, &thought)
    }

    /// Returns the number of lines of the trace so far, with that of the header.
    pub fn n_lines(&self) -> usize {
        1 + self.lines.len()
    }

    /// Returns the trace so far (JSON lines).
    pub fn trace(&self) -> String {
        self.trace_after(0)
    }

    /// Returns the trace so far without its first `n_lines` lines.
    pub fn trace_after(&self, n_lines: usize) -> String {
        let header = (n_lines == 0).then(|| self.header_line());
        let lines = self.lines.iter().skip(n_lines.saturating_sub(1)).cloned();
        header.into_iter().chain(lines).map(|line| line + "\n").collect()
    }

    fn header_line(&self) -> String {
        let mut header = Header { branch_of: self.branch_of, ..self.env.header().clone() };
        let input = match self.level {
            InputLevel::Plans => "plans",
            InputLevel::Steps => "steps",
        };
        let person = &mut header.people[self.seat.index()];
        (person.input, person.is_live) = (Some(input.to_owned()), self.is_live);
        header.to_line()
    }

    /// Draws what the person sees, as a square image for a canvas.
    pub fn draw_view(&self, side_px: u32) -> DrawnImage {
        DrawnImage::from_rgb(side_px, side_px, &self.draw_view_rgb(side_px))
    }

    /// Draws what the person sees: RGB, u8, shape `[side_px, side_px, 3]`, row 0 at the top.
    pub fn draw_view_rgb(&self, side_px: u32) -> Vec<u8> {
        let view = View::from_agent(self.env.world(), self.seat, side_px, Channels::RGB);
        let images = self.scene.render(self.env.world(), &[view]);
        images.into_iter().next().and_then(|images| images.rgb).unwrap_or_default()
    }
}

/// Returns the side of the images of the agents in other seats, pixels; `None` without such agents.
fn image_size_of_others(header: &Header, seat: AgentId) -> Option<u32> {
    let mut others = header.people.iter().filter(|person| person.agent != seat);
    others.next().map(|person| person.sensors.image_size)
}

/// Returns whether a person in this seat learns of an event: of its own actions, joint lifts and
/// the end; as partner, of deliveries.
fn notices(seat: AgentId, event: &EventKind) -> bool {
    match *event {
        EventKind::Delivered { by, .. } => by == seat || seat == AgentId::PARTNER,
        EventKind::Broke { agent, .. } | EventKind::Ended { agent, .. } => agent == seat,
        EventKind::LiftedTogether { .. } | EventKind::Over { .. } => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests;
