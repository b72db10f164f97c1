//! An episode under way.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::agent::{ChildState, Thought};
use chaic_core::observation::{FilmFrame, Images};
use chaic_core::{Action, AgentError, AgentId, Briefing, Frame, Observation, Target};
use chaic_render::{ImagesMut, Scene};
use chaic_world::{Setup, World};

use crate::config::EpisodeConfig;
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::observer::{Glimpse, Observer, resolve_unseen};
use crate::reward::{RewardTerms, Standing};
use crate::run_loop::{Choice, Players, run_loop};
use crate::seat::{Driver, Minds, Seat, seats};
use crate::trace::{End, Header, Record};

/// Why [`Env::run`] returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// The episode ended.
    Ended,
    /// It was told to stop, or has come to the frame until which it was to run.
    Stopped,
    /// The caller's choice is needed, see [`Env::waiting`].
    Waits,
}

/// An episode under way, with everybody in it.
pub struct Env {
    world: World,
    seats: Vec<Seat>,
    filled: Filled,
    observer: Observer,
    header: Header,
    turns: Vec<Turn>,
    /// Images that nobody looks at any more.
    spare: Vec<Images>,
    /// Why a mind couldn't decide, if one couldn't: nobody is asked again then.
    broken: Option<AgentError>,
}

/// All of an episode as it stood, minds included; see [`Env::snapshot`]. It lives in memory only: minds
/// are no data. What can be kept on a disk is the world's [`Snapshot`](chaic_world::Snapshot).
pub struct EnvSnapshot {
    world: World,
    seats: Vec<Seat>,
    turns: Vec<Turn>,
    header: Header,
    filled: Filled,
}

/// Which seats the caller filled; all others are for the rule-based minds of an episode.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Filled {
    Some { helper: bool, partner: bool },
    All,
}

/// The turn of an agent whose action has ended, until all who wait have chosen.
#[derive(Clone, Default)]
struct Turn {
    /// Whether it has begun.
    is_open: bool,
    /// What the agent perceives, once it has looked.
    glimpse: Option<Glimpse>,
    choice: Option<Choice>,
    /// What it last said of itself.
    said: Said,
    /// How things stood when the agent last chose, for callers.
    before: Option<Standing>,
    /// What the agent has seen between its decisions since the last one.
    film: VecDeque<FilmFrame>,
    /// Memory for the ids of its next image.
    spare_ids: Vec<u16>,
}

impl Turn {
    /// Ends the turn with the agent's choice.
    fn close(&mut self) -> Option<Choice> {
        self.is_open = false;
        if let Some(ids) = self.glimpse.take().and_then(|glimpse| glimpse.hidden_ids) {
            self.spare_ids = ids;
        }
        self.choice.take()
    }
}

/// What a mind says of itself.
#[derive(Clone, Default, PartialEq)]
struct Said {
    thought: Option<Thought>,
    child: Option<ChildState>,
}

impl Env {
    /// Begins an episode and briefs everybody.
    ///
    /// # Errors
    /// If the setup can't become a world.
    pub fn new(config: EpisodeConfig<'_>, minds: impl Into<Minds>) -> Result<Env> {
        let minds = minds.into();
        let filled =
            Filled::Some { helper: minds.helper.is_some(), partner: minds.partner.is_some() };
        let setup = config.setup(minds.helper.is_some());
        let world = config.world(&setup)?;
        let seats = seats(&setup, minds, config.rules.planner);
        Ok(Env::begin(config, world, seats, filled))
    }

    /// The same with all seats filled by the caller: scripted partners, other minds for the child.
    ///
    /// # Errors
    /// If the setup can't become a world, or has another number of people.
    pub fn with_seats(config: EpisodeConfig<'_>, seats: Vec<Seat>) -> Result<Env> {
        let setup = config.setup(true);
        check_seats(&config, &setup, seats.len())?;
        let world = config.world(&setup)?;
        Ok(Env::begin(config, world, seats, Filled::All))
    }

    fn begin(config: EpisodeConfig<'_>, world: World, mut seats: Vec<Seat>, filled: Filled) -> Env {
        config.brief(&world, &mut seats);
        let header = config.header(world.setup(), &seats);
        let scene = Scene::with_appearance(world.setup(), config.appearance);
        let observer = Observer::new(Arc::new(scene));
        let turns = seats.iter().map(|_| Turn::default()).collect();
        let broken = refused_senses(&seats);
        Env { world, seats, filled, observer, header, turns, spare: Vec::new(), broken }
    }

    /// Begins another episode with the same minds and callers, and with the rule-based partner and
    /// child that belong to it; for learners that play one episode after the other.
    ///
    /// # Errors
    /// If the setup can't become a world, or has another number of people than all seats that the
    /// caller filled. The environment is as it was then.
    pub fn reset(&mut self, config: EpisodeConfig<'_>) -> Result<()> {
        let setup = config.setup(self.seats.len() > 1);
        if self.filled == Filled::All {
            check_seats(&config, &setup, self.seats.len())?;
        }
        let world = config.world(&setup)?;
        let mut old = std::mem::take(&mut self.seats);
        let seats = match self.filled {
            Filled::All => old,
            Filled::Some { helper, partner } => {
                let helper = helper.then(|| old.swap_remove(AgentId::HELPER.index()));
                let partner = partner.then(|| old.swap_remove(AgentId::PARTNER.index()));
                seats(&setup, Minds { helper, partner }, config.rules.planner)
            }
        };
        *self = Env::begin(config, world, seats, self.filled);
        Ok(())
    }

    /// What stands at the head of its trace.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The world as it stands.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What everybody sees with.
    pub fn observer(&self) -> &Observer {
        &self.observer
    }

    /// What the minds counted of their own doings, by agent and name.
    pub fn counts(&self) -> BTreeMap<String, u64> {
        let minds = self.seats.iter().enumerate().filter_map(|(k, seat)| Some((k, seat.mind()?)));
        minds
            .flat_map(|(k, mind)| {
                let agent = AgentId(k as u8);
                mind.counts().into_iter().map(move |(name, n)| (format!("{agent}.{name}"), n))
            })
            .collect()
    }

    /// Everybody's seats, by agent.
    pub fn seats(&self) -> &[Seat] {
        &self.seats
    }

    /// The agents whose seats the caller drives.
    pub(crate) fn callers(&self) -> impl Iterator<Item = AgentId> + '_ {
        let seats = self.seats.iter().enumerate();
        seats.filter(|(_, seat)| seat.mind().is_none()).map(|(k, _)| AgentId(k as u8))
    }

    /// What the agent in this seat is told at the beginning.
    pub fn briefing(&self, agent: AgentId) -> Briefing {
        let grants = self.seats[agent.index()].grants;
        self.world.briefing(agent, grants, self.header.seed)
    }

    /// The agents whose choices are the caller's and needed now.
    pub fn waiting(&self) -> impl Iterator<Item = AgentId> + '_ {
        let turns = self.turns.iter().enumerate();
        turns
            .filter(|(_, turn)| turn.is_open && turn.choice.is_none())
            .map(|(k, _)| AgentId(k as u8))
    }

    /// What an agent that is [waiting](Env::waiting) perceives; `None` for anybody else. Images are
    /// made at the first call of a turn.
    pub fn observe(&mut self, agent: AgentId) -> Option<&Observation> {
        if !self.is_waiting(agent) {
            return None;
        }
        let turn = &mut self.turns[agent.index()];
        if turn.glimpse.is_none() {
            let looking = [(agent, &self.seats[agent.index()])];
            turn.glimpse = self.observer.observe(&self.world, &looking, &mut self.spare).pop();
            if let Some(glimpse) = &mut turn.glimpse {
                glimpse.observation.film = std::mem::take(&mut turn.film).into();
            }
        }
        turn.glimpse.as_ref().map(|glimpse| &glimpse.observation)
    }

    /// The same with the images in buffers of the caller's, in place of the observation's own.
    pub(crate) fn observe_into(&mut self, agent: AgentId, images: ImagesMut<'_>) {
        let turn = &mut self.turns[agent.index()];
        let ids = std::mem::take(&mut turn.spare_ids);
        let who = (agent, &self.seats[agent.index()]);
        let mut glimpse = self.observer.observe_into(&self.world, who, images, ids);
        glimpse.observation.film = std::mem::take(&mut turn.film).into();
        turn.glimpse = Some(glimpse);
    }

    /// What an agent perceived that is waiting and has looked.
    pub(crate) fn observed(&self, agent: AgentId) -> Option<&Observation> {
        let glimpse = self.turns[agent.index()].glimpse.as_ref();
        glimpse.filter(|_| self.is_waiting(agent)).map(|glimpse| &glimpse.observation)
    }

    pub(crate) fn is_waiting(&self, agent: AgentId) -> bool {
        self.waiting().any(|a| a == agent)
    }

    /// The caller's choice for an agent that is [waiting](Env::waiting); it acts once all have
    /// chosen. Returns false, and changes nothing, if the agent isn't waiting.
    pub fn submit(&mut self, agent: AgentId, action: Action) -> bool {
        let points = matches!(action.subject(), Some(Target::Pixel { .. }));
        if !self.is_waiting(agent) || (points && self.observe(agent).is_none()) {
            return false;
        }
        let turn = &mut self.turns[agent.index()];
        let seat = &mut self.seats[agent.index()];
        let resolved = match &turn.glimpse {
            Some(glimpse) => glimpse.resolve(action),
            None => resolve_unseen(seat, action),
        };
        seat.submitted = Some((action, resolved));
        turn.choice = Some(Choice { agent, action: resolved, thought: None, child: None });
        turn.before = Some(Standing::of(&self.world, agent));
        true
    }

    /// What has come of the action that the caller last chose for an agent, until now: the terms of
    /// a reward. `None` before the first choice.
    pub fn reward(&self, agent: AgentId) -> Option<RewardTerms> {
        let turn = self.turns.get(agent.index())?;
        let terms = RewardTerms::between(turn.before.as_ref()?, &self.world, agent);
        // What is chosen but waits for others has come to nothing yet.
        let is_begun = turn.choice.is_none();
        Some(RewardTerms { is_invalid: terms.is_invalid && is_begun, ..terms })
    }

    /// How the episode would be scored if it ended now.
    pub fn score(&self) -> End {
        End::of(&self.world)
    }

    /// A number that differs between different states of the world, and is the same for equal ones.
    pub fn digest(&self) -> Digest {
        Digest(self.world.digest())
    }

    /// All of the episode as it stands, minds included, to go on from later or more than once.
    ///
    /// # Errors
    /// [`EnvError::NoFork`] if a mind can't be copied: one that lives in another process, or asks a
    /// language model.
    pub fn snapshot(&self) -> Result<EnvSnapshot> {
        Ok(EnvSnapshot {
            world: self.world.clone(),
            seats: fork(&self.seats)?,
            turns: self.turns.clone(),
            header: self.header.clone(),
            filled: self.filled,
        })
    }

    /// Goes back (or on) to a snapshot of the same episode. What follows is what followed then,
    /// where the same is chosen.
    ///
    /// # Errors
    /// [`EnvError::OtherSnapshot`] if the snapshot is of another episode, seed, rules or minds. The
    /// environment is as it was then.
    pub fn restore(&mut self, snapshot: &EnvSnapshot) -> Result<()> {
        let drivers = |seats: &[Seat]| seats.iter().map(|s| s.mind().is_some()).collect::<Vec<_>>();
        if snapshot.header != self.header
            || snapshot.filled != self.filled
            || drivers(&snapshot.seats) != drivers(&self.seats)
        {
            return Err(EnvError::OtherSnapshot {
                id: self.header.episode.clone(),
                of: snapshot.header.episode.clone(),
            });
        }
        self.seats = fork(&snapshot.seats)?;
        self.world = snapshot.world.clone();
        self.turns.clone_from(&snapshot.turns);
        self.broken = refused_senses(&self.seats);
        Ok(())
    }

    /// Plays on without keeping records: until a choice of the caller's is needed or the episode
    /// ends, or to the first frame in which somebody decides at or after `until`.
    ///
    /// # Errors
    /// If a mind can't decide.
    pub fn advance(&mut self, until: Option<Frame>) -> std::result::Result<Flow, AgentError> {
        self.run(&AtomicBool::new(false), until, &mut |_| Ok(()))
    }

    /// Plays until a choice of the caller's is needed or the episode ends, or to the first frame in
    /// which somebody decides at or after `until`. Every record is handed to `sink`, whose error
    /// ends the play.
    ///
    /// # Errors
    /// Those of `sink`, and of a mind that can't decide.
    pub fn run<E: From<AgentError>>(
        &mut self,
        stop: &AtomicBool,
        until: Option<Frame>,
        sink: &mut dyn FnMut(&Record) -> std::result::Result<(), E>,
    ) -> std::result::Result<Flow, E> {
        if let Some(error) = &self.broken {
            return Err(error.clone().into());
        }
        let Env { world, seats, observer, turns, spare, broken, .. } = self;
        let has_film = seats.iter().any(|seat| seat.senses.film.is_some());
        let flow = Flow::Stopped;
        let mut table =
            Table { seats, observer, turns, spare, broken, stop, until, has_film, flow };
        let has_ended = run_loop(world, &mut table, sink)?;
        Ok(if has_ended { Flow::Ended } else { table.flow })
    }
}

/// Everybody in an episode while it is played.
struct Table<'a> {
    seats: &'a mut [Seat],
    observer: &'a Observer,
    turns: &'a mut [Turn],
    spare: &'a mut Vec<Images>,
    broken: &'a mut Option<AgentError>,
    stop: &'a AtomicBool,
    until: Option<Frame>,
    has_film: bool,
    /// Why the play stopped.
    flow: Flow,
}

impl<E: From<AgentError>> Players<E> for Table<'_> {
    fn decide(
        &mut self,
        world: &World,
        waiting: &[AgentId],
    ) -> std::result::Result<Option<Vec<Choice>>, E> {
        let Table { seats, observer, turns, spare, broken, .. } = self;
        let late = self.until.is_some_and(|f| world.state().frame >= f);
        if self.stop.load(Ordering::Relaxed) || late {
            return Ok(None);
        }
        let fresh: Vec<_> = waiting.iter().filter(|a| !turns[a.index()].is_open).copied().collect();
        let minds: Vec<_> =
            fresh.iter().filter(|a| seats[a.index()].mind().is_some()).copied().collect();
        let glimpses = {
            let looking: Vec<_> = minds.iter().map(|a| (*a, &seats[a.index()])).collect();
            observer.observe(world, &looking, spare)
        };
        for (agent, mut glimpse) in minds.into_iter().zip(glimpses) {
            let turn = &mut turns[agent.index()];
            glimpse.observation.film = std::mem::take(&mut turn.film).into();
            let chosen = choose(&mut seats[agent.index()], agent, &glimpse, &mut turn.said);
            turn.choice = chosen.inspect_err(|error| **broken = Some(error.clone()))?;
            if seats[agent.index()].senses.wants_image() {
                spare.push(glimpse.into_images());
            }
        }
        for agent in fresh {
            turns[agent.index()].is_open = true;
        }
        if waiting.iter().any(|a| turns[a.index()].choice.is_none()) {
            self.flow = Flow::Waits;
            return Ok(None);
        }
        Ok(Some(waiting.iter().filter_map(|a| turns[a.index()].close()).collect()))
    }

    fn look_on(&mut self, world: &World) {
        if !self.has_film {
            return;
        }
        for (k, (seat, turn)) in self.seats.iter().zip(self.turns.iter_mut()).enumerate() {
            if let Some(film) = seat.senses.film {
                self.observer.film(world, AgentId(k as u8), film, &mut turn.film);
            }
        }
    }
}

fn check_seats(config: &EpisodeConfig<'_>, setup: &Setup, seats: usize) -> Result<()> {
    let people = setup.people.len();
    let id = || config.episode.id().to_owned();
    if people == seats { Ok(()) } else { Err(EnvError::Seats { id: id(), people, seats }) }
}

/// Returns why the episode can't be played where a seat asks for observations out of bounds.
fn refused_senses(seats: &[Seat]) -> Option<AgentError> {
    let refused = |(k, seat): (usize, &Seat)| {
        let problem = seat.senses.check().err()?;
        Some(AgentError::Broken(format!("the {} {problem}", AgentId(k as u8))))
    };
    seats.iter().enumerate().find_map(refused)
}

fn fork(seats: &[Seat]) -> Result<Vec<Seat>> {
    let fork = |(k, seat): (usize, &Seat)| {
        let agent = AgentId(k as u8);
        seat.fork().ok_or(EnvError::NoFork { agent })
    };
    seats.iter().enumerate().map(fork).collect()
}

/// What the mind of a seat chooses; `None` if the caller drives it.
fn choose(
    seat: &mut Seat,
    agent: AgentId,
    glimpse: &Glimpse,
    said: &mut Said,
) -> std::result::Result<Option<Choice>, AgentError> {
    let Driver::Mind(mind) = &mut seat.driver else { return Ok(None) };
    let meant = mind.act(&glimpse.observation)?;
    let action = glimpse.resolve(meant);
    seat.submitted = Some((meant, action));
    let says = Said { thought: Some(mind.thought()), child: mind.child_state() };
    let thought = says.thought.clone().filter(|_| says.thought != said.thought);
    let child = says.child.filter(|_| says.child != said.child);
    *said = says;
    Ok(Some(Choice { agent, action, thought, child }))
}
