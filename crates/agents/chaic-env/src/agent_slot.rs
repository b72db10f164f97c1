//! Slots of the agents in an episode: who controls each agent, its grants and its sensors.

use chaic_agents::{PlannerRules, partners};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, ResolvedAction};
use chaic_world::{Setup, World};

use crate::helper_registry::Helper;

/// Controller of an agent.
pub enum Driver {
    /// An agent that the environment asks for actions.
    Agent(Box<dyn Agent>),
    /// The caller of the environment, such as a learner or a program in another language.
    External,
}

/// An agent of an episode: its controller, grants and sensors.
pub struct AgentSlot {
    /// Controller.
    pub driver: Driver,
    /// Granted information.
    pub grants: Grants,
    /// Requested sensors; those of an agent in the environment are set when the episode starts.
    pub sensors: SensorConfig,
    /// Last action, as submitted and as resolved.
    pub(crate) submitted: Option<(Action, ResolvedAction)>,
}

impl AgentSlot {
    /// Creates the slot of an agent that the environment asks for actions.
    pub fn with_agent(agent: Box<dyn Agent>, grants: Grants) -> AgentSlot {
        AgentSlot {
            driver: Driver::Agent(agent),
            grants,
            sensors: SensorConfig::NONE,
            submitted: None,
        }
    }

    /// Creates the slot of an agent that the caller controls.
    pub fn external(grants: Grants, sensors: SensorConfig) -> AgentSlot {
        AgentSlot { driver: Driver::External, grants, sensors, submitted: None }
    }

    /// Copies the slot with its agent; `None` if the agent can't be copied.
    pub(crate) fn fork(&self) -> Option<AgentSlot> {
        let driver = match &self.driver {
            Driver::Agent(agent) => Driver::Agent(agent.fork()?),
            Driver::External => Driver::External,
        };
        Some(AgentSlot { driver, ..*self })
    }

    /// Briefs the agent and sets its sensors; `image_size` overrides the requested size.
    pub(crate) fn reset(&mut self, id: AgentId, world: &World, seed: u32, image_size: Option<u32>) {
        self.submitted = None;
        if let Driver::Agent(agent) = &mut self.driver {
            agent.reset(&world.briefing(id, self.grants, seed));
            self.sensors = agent.sensors();
            self.sensors.image_size = image_size.unwrap_or(self.sensors.image_size);
        }
    }

    /// Returns the agent; `None` if the caller controls it.
    pub fn agent(&self) -> Option<&dyn Agent> {
        match &self.driver {
            Driver::Agent(agent) => Some(&**agent),
            Driver::External => None,
        }
    }
}

impl From<Helper> for AgentSlot {
    fn from(Helper { agent, grants }: Helper) -> AgentSlot {
        AgentSlot::with_agent(agent, grants)
    }
}

/// Helper and partner of an episode.
pub struct EpisodeAgents {
    /// Slot of the helper; `None` if the partner is alone.
    pub helper: Option<AgentSlot>,
    /// Slot of the partner; `None` for the rule-based partner of the task.
    pub partner: Option<AgentSlot>,
}

impl EpisodeAgents {
    /// Creates the slots of a helper and of an agent that replaces the rule-based partner.
    pub fn new(helper: Option<Helper>, partner: Option<Helper>) -> EpisodeAgents {
        EpisodeAgents { helper: helper.map(AgentSlot::from), partner: partner.map(AgentSlot::from) }
    }
}

impl From<Option<Helper>> for EpisodeAgents {
    fn from(helper: Option<Helper>) -> EpisodeAgents {
        EpisodeAgents::new(helper, None)
    }
}

/// Returns the slots of partner, helper and child in the order of their ids; the partner's only if there
/// is no helper.
pub fn agent_slots(setup: &Setup, agents: EpisodeAgents, rules: PlannerRules) -> Vec<AgentSlot> {
    let info = setup.task.info();
    let persona = setup.people.first().map_or(info.partner.persona, |p| p.persona);
    let rule_based = || {
        let partner = partners::partner(persona, info.scene, rules);
        AgentSlot::with_agent(partner, partners::partner_grants(rules))
    };
    let mut slots = vec![agents.partner.unwrap_or_else(rule_based)];
    slots.extend(agents.helper);
    if setup.people.len() > AgentId::CHILD.index() {
        slots.push(AgentSlot::with_agent(partners::child(rules), Grants::CHILD));
    }
    // Setups may have more people than the tasks; further people stand still.
    while slots.len() < setup.people.len() {
        slots.push(AgentSlot::with_agent(Box::new(NoopAgent), Grants::NONE));
    }
    slots
}

/// Agent that waits forever and requests no images.
#[derive(Clone, Copy, Debug)]
pub struct NoopAgent;

impl Agent for NoopAgent {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        Ok(Action::Wait { frames: 100 })
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        Some(Box::new(*self))
    }
}

/// Returns the seed of the world: the episode's own for seed 0, a derived one for each other seed.
pub fn world_seed(episode_seed: u64, seed: u32) -> u64 {
    if seed == 0 {
        return episode_seed;
    }
    let mut stream = RngStream::new(episode_seed, "eval seed", u64::from(seed));
    (0..4).fold(0, |s, _| s << 16 | stream.below(1 << 16) as u64)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::Arc;

    use chaic_episodes::find_episode;
    use chaic_world::Rules;

    use super::*;

    fn setup(episode: &str) -> Setup {
        find_episode(episode).expect("a bundled episode").into_setup()
    }

    /// Returns the slot of a caller with these grants.
    fn external(grants: Grants) -> Option<AgentSlot> {
        Some(AgentSlot::external(grants, SensorConfig::NONE))
    }

    #[test]
    fn each_person_has_a_slot_with_its_own_grants() {
        let rules = PlannerRules::paper();
        let rule_based = partners::partner_grants(rules);
        let helper = Grants { task: true, ..Grants::NONE };
        let other = Grants { progress: true, ..Grants::NONE };
        let grants = |setup: &Setup, helper, partner| -> Vec<Grants> {
            let slots = agent_slots(setup, EpisodeAgents { helper, partner }, rules);
            slots.iter().map(|slot| slot.grants).collect()
        };
        let mut alone = setup("high_target/test/02");
        assert_eq!(grants(&alone, external(helper), None), [rule_based, helper]);
        assert_eq!(grants(&alone, external(helper), external(other)), [other, helper]);
        alone.people.truncate(1);
        assert_eq!(grants(&alone, None, None), [rule_based]);
        let mut crowd = setup("shopping/test/02");
        assert_eq!(grants(&crowd, external(helper), None), [rule_based, helper, Grants::CHILD]);
        crowd.people.push(crowd.people[0]);
        let expected = [rule_based, helper, Grants::CHILD, Grants::NONE];
        assert_eq!(grants(&crowd, external(helper), None), expected, "one stands still");
    }

    #[test]
    fn a_start_sets_the_sensors_of_agents_in_the_environment_only() {
        let setup = Arc::new(setup("high_target/test/02"));
        let world = World::new(setup, Rules::default()).expect("a valid episode");
        let sensors = SensorConfig { image_size: 64, rgb: true, ..SensorConfig::NONE };
        let inside = AgentSlot::with_agent(Box::new(NoopAgent), Grants::NONE);
        for (mut slot, image_size, expected) in [
            (inside, Some(32), SensorConfig { image_size: 32, ..SensorConfig::NONE }),
            (AgentSlot::external(Grants::IDS, sensors), Some(32), sensors),
        ] {
            assert_eq!(slot.agent().is_some(), expected != sensors);
            slot.submitted = Some((Action::TurnLeft, Action::TurnLeft));
            slot.reset(AgentId::HELPER, &world, 0, image_size);
            assert_eq!((slot.sensors, slot.submitted), (expected, None));
        }
    }

    #[test]
    fn seeds_of_worlds_differ_in_all_bits_and_seed_0_is_that_of_the_episode() {
        assert_eq!(world_seed(77, 0), 77);
        assert_eq!(world_seed(77, 1), world_seed(77, 1));
        assert_ne!(world_seed(77, 1), world_seed(78, 1));
        let seeds: Vec<u64> = (1..=64).map(|seed| world_seed(77, seed)).collect();
        for shift in [0, 16, 32, 48] {
            let words: BTreeSet<u64> = seeds.iter().map(|seed| seed >> shift & 0xffff).collect();
            assert!(words.len() > 60, "bits from {shift}: {words:?}");
        }
    }
}
