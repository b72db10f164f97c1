//! One episode: who takes part, what they see, and the loop.

mod cast;
mod crank;
mod look;

pub use cast::{Actor, Bystander, Cast, Minds, cast, world_seed};
pub use crank::{Choice, Decide, Flow, crank};
pub use look::{Eyes, Glance};

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_episodes::Episode;
use chaic_protocol::agent::Thought;
use chaic_protocol::{AgentId, Frame};
use chaic_render::{Appearance, Scene};
use chaic_world::{Rules, Setup, World};

use crate::CHAIC_VERSION;
use crate::digest::Digest;
use crate::error::{EvalError, Result};
use crate::rules::RuleSet;
use crate::trace::{FORMAT, Header, Participant, Record, VERSION};

/// What is played, apart from the minds.
#[derive(Clone, Copy, Debug)]
pub struct Staging<'a> {
    /// The episode.
    pub episode: &'a Episode,
    /// Which of the run's seeds.
    pub seed: u32,
    /// The rules.
    pub rules: RuleSet,
    /// Name of the helper, for the record.
    pub helper: &'a str,
    /// Name of the partner's mind, for the record; `None` for the rule-based one.
    pub partner: Option<&'a str>,
    /// Side of everybody's images, pixels; `None` for what each mind asks for.
    pub image_size: Option<u32>,
    /// How all that eyes see is lit and colored.
    pub appearance: Appearance,
}

/// An episode under way, with everybody in it.
pub struct Play {
    world: World,
    cast: Cast,
    eyes: Eyes,
    header: Header,
}

impl Play {
    /// Sets the stage and briefs everybody.
    ///
    /// # Errors
    /// If the setup can't become a world.
    pub fn new(staging: Staging<'_>, minds: impl Into<Minds>) -> Result<Play> {
        let minds = minds.into();
        let setup = setup_of(&staging, minds.helper.is_some());
        let cast = cast(&setup, minds, staging.rules.planner);
        Play::stage(staging, setup, cast)
    }

    /// The same with a cast of the caller's: scripted partners, other minds for the child.
    ///
    /// # Errors
    /// If the setup can't become a world, or has another number of people.
    pub fn with_cast(staging: Staging<'_>, cast: Cast) -> Result<Play> {
        let setup = setup_of(&staging, true);
        let (minds, people) = (cast.actors.len(), setup.people.len());
        if minds != people {
            let text = format!("{} has {people} people, not {minds}", staging.episode.id());
            return Err(EvalError::Options(text));
        }
        Play::stage(staging, setup, cast)
    }

    fn stage(staging: Staging<'_>, setup: Arc<Setup>, mut cast: Cast) -> Result<Play> {
        let world = brief(&staging, &setup, &mut cast)?;
        let header = header(&staging, &setup, &cast);
        let eyes = Eyes::new(Arc::new(Scene::with_appearance(&setup, staging.appearance)));
        Ok(Play { world, cast, eyes, header })
    }

    /// What stands at the head of its trace.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The world as it stands.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What partner and helper counted of their own doings, by agent and name.
    pub fn counts(&self) -> BTreeMap<String, u64> {
        let of = |(k, actor): (usize, &Actor)| {
            let agent = AgentId(k as u8);
            actor.mind.counts().into_iter().map(move |(name, n)| (format!("{agent}.{name}"), n))
        };
        self.cast.actors.iter().enumerate().flat_map(of).collect()
    }

    /// What everybody sees with.
    pub fn eyes(&self) -> &Eyes {
        &self.eyes
    }

    /// Plays to the end, or to the first frame in which somebody decides at or after `until`.
    /// Every record is handed to `sink`, whose error ends the play.
    ///
    /// Returns false if `stop` was raised before the end.
    ///
    /// # Errors
    /// Those of `sink`.
    pub fn run(
        &mut self,
        stop: &AtomicBool,
        until: Option<Frame>,
        sink: &mut dyn FnMut(&Record) -> Result<()>,
    ) -> Result<bool> {
        let Play { world, cast, eyes, .. } = self;
        let mut said: Vec<Option<Thought>> = vec![None; cast.actors.len()];
        let mut decide = |world: &World, waiting: &[AgentId]| {
            let late = until.is_some_and(|f| world.state().frame >= f);
            if stop.load(Ordering::Relaxed) || late {
                return Ok(None);
            }
            let wanted: Vec<_> = waiting.iter().map(|a| (*a, &cast.actors[a.index()])).collect();
            let glances = eyes.observe(world, &wanted);
            let choices = waiting.iter().zip(glances).map(|(agent, glance)| {
                let actor = &mut cast.actors[agent.index()];
                let meant = actor.mind.act(&glance.observation);
                let action = glance.resolve(meant);
                actor.submitted = Some((meant, action));
                let (thought, child) = (Some(actor.mind.thought()), actor.mind.child_state());
                let is_news = said[agent.index()] != thought;
                if is_news {
                    said[agent.index()].clone_from(&thought);
                }
                Choice { agent: *agent, action, thought: thought.filter(|_| is_news), child }
            });
            let choices: Vec<Choice> = choices.collect();
            // Who raised `stop` while deciding hasn't decided.
            Ok((!stop.load(Ordering::Relaxed)).then_some(choices))
        };
        let flow = crank(world, &mut decide, sink)?;
        Ok(flow == Flow::Ended)
    }
}

/// The setup as it is played: with its seed, and without helper and child where the partner is
/// alone (facts A8: the original's runs without helper have no child either).
fn setup_of(staging: &Staging<'_>, has_helper: bool) -> Arc<Setup> {
    let mut setup = staging.episode.setup().clone();
    setup.seed = world_seed(setup.seed, staging.seed);
    if !has_helper {
        setup.people.truncate(1);
    }
    Arc::new(setup)
}

/// The world at its beginning, with everybody briefed.
fn brief(staging: &Staging<'_>, setup: &Arc<Setup>, cast: &mut Cast) -> Result<World> {
    let world = new_world(setup, staging.rules.world, staging.episode.id())?;
    for (agent, actor) in setup.agents().zip(&mut cast.actors) {
        actor.begin(agent, &world, staging.image_size);
    }
    Ok(world)
}

/// What stands at the head of the trace, without playing.
///
/// # Errors
/// If the setup can't become a world.
pub fn header_of(staging: Staging<'_>, minds: impl Into<Minds>) -> Result<Header> {
    let minds = minds.into();
    let setup = setup_of(&staging, minds.helper.is_some());
    let mut cast = cast(&setup, minds, staging.rules.planner);
    brief(&staging, &setup, &mut cast)?;
    Ok(header(&staging, &setup, &cast))
}

fn new_world(setup: &Arc<Setup>, rules: Rules, id: &str) -> Result<World> {
    let refused = |problem| EvalError::Setup { id: id.to_owned(), problem };
    World::new(Arc::clone(setup), rules).map_err(refused)
}

/// The world of a trace at its beginning, from the episode that it was played on.
///
/// # Errors
/// If the episode isn't the one that was played.
pub fn world_of(header: &Header, episode: &Episode) -> Result<World> {
    let digest = Digest::of_setup(episode.setup());
    if digest != header.setup {
        return Err(EvalError::OtherEpisode {
            id: header.episode.clone(),
            found: digest.to_string(),
            expected: header.setup.to_string(),
        });
    }
    let mut setup = episode.setup().clone();
    setup.seed = header.world_seed;
    setup.people.truncate(header.people.len().max(1));
    new_world(&Arc::new(setup), header.rules.world, episode.id())
}

fn header(staging: &Staging<'_>, setup: &Setup, cast: &Cast) -> Header {
    let people = setup.agents().zip(&setup.people).zip(&cast.actors);
    Header {
        format: FORMAT.to_owned(),
        version: VERSION,
        chaic: CHAIC_VERSION.to_owned(),
        task: setup.task,
        episode: staging.episode.id().to_owned(),
        setup: Digest::of_setup(staging.episode.setup()),
        seed: staging.seed,
        world_seed: setup.seed,
        rules: staging.rules,
        helper: staging.helper.to_owned(),
        partner: staging.partner.map(str::to_owned),
        people: people
            .map(|((agent, person), actor)| Participant {
                agent,
                persona: person.persona,
                grants: actor.grants,
                senses: actor.senses,
            })
            .collect(),
        renderer: "cpu".to_owned(),
        appearance: staging.appearance,
    }
}
