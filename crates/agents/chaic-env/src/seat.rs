//! Who takes part in an episode: seats, with who drives each and what it is granted.

use chaic_agents::{PlannerRules, partners};
use chaic_core::observation::{Grants, Senses};
use chaic_core::rng::Stream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, ResolvedAction};
use chaic_world::{Setup, World};

use crate::config::EpisodeConfig;
use crate::minds::Helper;

/// Who decides for a seat.
pub enum Driver {
    /// A mind, which the environment asks.
    Mind(Box<dyn Agent>),
    /// The caller of the environment: a learner, or a program that speaks another language.
    Caller,
}

/// A place in an episode: who drives it, what that one is granted, and what it wants to perceive.
pub struct Seat {
    /// Who decides.
    pub driver: Driver,
    /// What it is granted.
    pub grants: Grants,
    /// What it wants to perceive; a mind says so once the episode has begun.
    pub senses: Senses,
    /// Its last action, as it named it and as it was resolved.
    pub(crate) submitted: Option<(Action, ResolvedAction)>,
}

impl Seat {
    /// For a mind before its first episode.
    pub fn of_mind(mind: Box<dyn Agent>, grants: Grants) -> Seat {
        Seat { driver: Driver::Mind(mind), grants, senses: Senses::NONE, submitted: None }
    }

    /// For a caller who perceives by these senses.
    pub fn of_caller(grants: Grants, senses: Senses) -> Seat {
        Seat { driver: Driver::Caller, grants, senses, submitted: None }
    }

    /// A copy that goes on as this one would; `None` if its mind can't be copied.
    pub(crate) fn fork(&self) -> Option<Seat> {
        let driver = match &self.driver {
            Driver::Mind(mind) => Driver::Mind(mind.fork()?),
            Driver::Caller => Driver::Caller,
        };
        Some(Seat { driver, ..*self })
    }

    /// Briefs a mind and asks what it wants to perceive.
    pub(crate) fn begin(&mut self, agent: AgentId, world: &World, config: &EpisodeConfig<'_>) {
        self.submitted = None;
        if let Driver::Mind(mind) = &mut self.driver {
            mind.reset(&world.briefing(agent, self.grants, config.seed));
            self.senses = mind.senses();
            self.senses.image_size = config.image_size.unwrap_or(self.senses.image_size);
        }
    }

    /// Its mind, if it has one.
    pub fn mind(&self) -> Option<&dyn Agent> {
        match &self.driver {
            Driver::Mind(mind) => Some(&**mind),
            Driver::Caller => None,
        }
    }
}

impl From<Helper> for Seat {
    fn from(Helper { mind, grants }: Helper) -> Seat {
        Seat::of_mind(mind, grants)
    }
}

/// The seats that a run fills.
pub struct Minds {
    /// The helper's; `None` where the partner is alone.
    pub helper: Option<Seat>,
    /// The partner's; `None` for the rule-based mind of its task.
    pub partner: Option<Seat>,
}

impl Minds {
    /// A helper's mind, and one for the partner in place of the rule-based one.
    pub fn of(helper: Option<Helper>, partner: Option<Helper>) -> Minds {
        Minds { helper: helper.map(Seat::from), partner: partner.map(Seat::from) }
    }
}

impl From<Option<Helper>> for Minds {
    fn from(helper: Option<Helper>) -> Minds {
        Minds::of(helper, None)
    }
}

/// Partner, helper and child of a setup, in the order of their ids; nobody but the partner if there
/// is no helper.
pub fn seats(setup: &Setup, minds: Minds, rules: PlannerRules) -> Vec<Seat> {
    let info = setup.task.info();
    let persona = setup.people.first().map_or(info.partner.persona, |p| p.persona);
    let by_rules = || {
        let mind = partners::partner(persona, info.scene, rules);
        Seat::of_mind(mind, partners::partner_grants(rules))
    };
    let mut seats = vec![minds.partner.unwrap_or_else(by_rules)];
    seats.extend(minds.helper);
    if setup.people.len() > AgentId::CHILD.index() {
        seats.push(Seat::of_mind(partners::child(rules), Grants::CHILD));
    }
    // The world's rules allow more people than the tasks have; anybody further only stands there.
    while seats.len() < setup.people.len() {
        seats.push(Seat::of_mind(Box::new(Idle), Grants::NONE));
    }
    seats
}

/// Somebody who stands there and looks at nothing.
#[derive(Clone, Copy, Debug)]
pub struct Idle;

impl Agent for Idle {
    fn senses(&self) -> Senses {
        Senses::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        Ok(Action::Wait { frames: 100 })
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        Some(Box::new(*self))
    }
}

/// The seed that the world is played with: the episode's own for seed 0, another one for each
/// further seed.
pub fn world_seed(episode_seed: u64, seed: u32) -> u64 {
    if seed == 0 {
        return episode_seed;
    }
    let mut stream = Stream::new(episode_seed, "eval seed", u64::from(seed));
    (0..4).fold(0, |s, _| s << 16 | stream.below(1 << 16) as u64)
}
