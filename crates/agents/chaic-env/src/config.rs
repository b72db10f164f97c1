//! How an episode begins: what is played, and the world and header that follow from it.

use std::sync::Arc;

use chaic_episodes::Episode;
use chaic_render::Appearance;
use chaic_world::{Rules, Setup, World};

use crate::CHAIC_VERSION;
use crate::digest::Digest;
use crate::error::{EnvError, Result};
use crate::rules::RuleSet;
use crate::seat::{Minds, Seat, seats, world_seed};
use crate::trace::{FORMAT, Header, Participant, VERSION};

/// What is played, apart from the minds.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeConfig<'a> {
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
    /// Side of all minds' images, pixels; `None` for what each asks for. The caller's seats have their own.
    pub image_size: Option<u32>,
    /// How all that is seen is lit and colored.
    pub appearance: Appearance,
}

impl EpisodeConfig<'_> {
    /// The setup as it is played: with its seed, and without helper and child where the partner is
    /// alone (facts A8: the original's runs without helper have no child either).
    pub(crate) fn setup(&self, has_helper: bool) -> Arc<Setup> {
        let mut setup = self.episode.setup().clone();
        setup.seed = world_seed(setup.seed, self.seed);
        if !has_helper {
            setup.people.truncate(1);
        }
        Arc::new(setup)
    }

    /// The world at its beginning.
    pub(crate) fn world(&self, setup: &Arc<Setup>) -> Result<World> {
        new_world(setup, self.rules.world, self.episode.id())
    }

    /// Briefs everybody.
    pub(crate) fn brief(&self, world: &World, seats: &mut [Seat]) {
        for (agent, seat) in world.setup().agents().zip(seats) {
            seat.begin(agent, world, self);
        }
    }

    /// What stands at the head of the trace.
    pub(crate) fn header(&self, setup: &Setup, seats: &[Seat]) -> Header {
        let people = setup.agents().zip(&setup.people).zip(seats);
        Header {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: CHAIC_VERSION.to_owned(),
            task: setup.task,
            episode: self.episode.id().to_owned(),
            setup: Digest::of_setup(self.episode.setup()),
            seed: self.seed,
            world_seed: setup.seed,
            rules: self.rules,
            helper: self.helper.to_owned(),
            partner: self.partner.map(str::to_owned),
            people: people
                .map(|((agent, person), seat)| Participant {
                    agent,
                    persona: person.persona,
                    impairments: person.impairments,
                    grants: seat.grants,
                    senses: seat.senses,
                    perception: seat.mind().and_then(|mind| mind.perception()),
                    isolation: seat.mind().and_then(|mind| mind.isolation()),
                })
                .collect(),
            renderer: "cpu".to_owned(),
            appearance: self.appearance,
        }
    }
}

/// What stands at the head of the trace, without playing.
///
/// # Errors
/// If the setup can't become a world.
pub fn header_of(config: EpisodeConfig<'_>, minds: impl Into<Minds>) -> Result<Header> {
    let minds = minds.into();
    let setup = config.setup(minds.helper.is_some());
    let mut seats = seats(&setup, minds, config.rules.planner);
    config.brief(&config.world(&setup)?, &mut seats);
    Ok(config.header(&setup, &seats))
}

fn new_world(setup: &Arc<Setup>, rules: Rules, id: &str) -> Result<World> {
    let refused = |problem| EnvError::Setup { id: id.to_owned(), problem };
    World::new(Arc::clone(setup), rules).map_err(refused)
}

/// The world of a trace at its beginning, from the episode that it was played on.
///
/// # Errors
/// If the episode isn't the one that was played.
pub fn world_of(header: &Header, episode: &Episode) -> Result<World> {
    let digest = Digest::of_setup(episode.setup());
    if digest != header.setup {
        return Err(EnvError::OtherEpisode {
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
