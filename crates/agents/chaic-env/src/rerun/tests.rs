//! Promises: built-in agents act again as recorded, with each rule set; so does an agent whose choice a joint
//! lift replaced; a person has no memory.

use chaic_core::memory_view::{ExploredCell, ExploredMap};
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{AgentError, Briefing, ClassId, Hand, Observation, Vec2, Vec3};
use chaic_episodes::find_episode;
use chaic_world::Setup;

use super::*;
use crate::config::EpisodeConfig;
use crate::env::Env;
use crate::helper_registry::{BuiltInHelpers, Helper, built_in_partner};
use crate::rules::{PlannerRules, RuleSet};
use crate::trace::Record;
use crate::{EpisodeAgents, NoopAgent, RunKey};

/// Plays the first frames of an episode with images of 64 pixels.
fn played(config: EpisodeConfig<'_>, agents: EpisodeAgents) -> Trace {
    let mut env = Env::new(EpisodeConfig { image_size: Some(64), ..config }, agents).unwrap();
    let (header, mut records) = (env.header().clone(), Vec::new());
    let stop = std::sync::atomic::AtomicBool::new(false);
    let mut sink = |record: &Record| -> std::result::Result<(), AgentError> {
        records.push(record.clone());
        Ok(())
    };
    env.run(&stop, Some(300), &mut sink).unwrap();
    Trace { header, records }
}

/// Runs the agents again; returns the number of moments of each, and the agreement.
fn rerun(trace: &Trace, episode: &Episode) -> Vec<(usize, RerunStatus)> {
    rerun_with(trace, episode, &BuiltInHelpers)
}

fn rerun_with(
    trace: &Trace,
    episode: &Episode,
    helpers: &dyn HelperRegistry,
) -> Vec<(usize, RerunStatus)> {
    let mut rerun = AgentRerun::new(trace, episode, helpers).unwrap();
    let mut n_moments = vec![0; trace.header.people.len()];
    while let Some(moments) = rerun.step().unwrap() {
        for moment in moments {
            assert!(!moment.memory.map.cells.is_empty());
            n_moments[moment.agent.index()] += 1;
        }
    }
    n_moments.into_iter().zip(rerun.statuses().map(|(_, status)| status)).collect()
}

#[test]
fn agents_act_again_as_recorded() {
    let episode = find_episode("no_constraint/test/00").unwrap();
    for (rules, seed, partner) in [
        (RuleSet::PAPER, 0, None),
        (RuleSet::PAPER, 2, Some("habits:load=1")),
        (RuleSet::COMPAT, 0, None),
    ] {
        let config = EpisodeConfig { rules, seed, partner, ..EpisodeConfig::new(&episode, "rhp") };
        let made = partner.map(|name| built_in_partner(name, rules.planner).unwrap());
        let helper = BuiltInHelpers.make("rhp", rules.planner);
        let trace = played(config, EpisodeAgents::new(helper, made));
        for (n, status) in rerun(&trace, &episode) {
            assert!(n > 5 && status == RerunStatus::Equal, "{n} {status:?} {partner:?}");
        }
    }
}

/// Agent that takes one action after the other and repeats the last one.
struct Scripted {
    actions: Vec<Action>,
    n_acts: usize,
}

impl Agent for Scripted {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> std::result::Result<Action, AgentError> {
        let action = self.actions[self.n_acts.min(self.actions.len() - 1)];
        self.n_acts += 1;
        Ok(action)
    }

    /// Changes for the last time at the second action.
    fn thought(&self) -> Thought {
        Thought { plan: format!("step {}", self.n_acts.min(2)), ..Thought::default() }
    }

    fn memory_view(&self) -> Option<MemoryView> {
        let cells = vec![ExploredCell::Unknown];
        let map = ExploredMap { min: Vec2::ZERO, cell_m: 1.0, n_columns: 1, cells };
        Some(MemoryView { map, objects: Vec::new(), people: Vec::new(), path: Vec::new() })
    }
}

/// Registry of a scripted partner and a scripted helper.
struct Scripts {
    partner: Vec<Action>,
    helper: Vec<Action>,
}

fn scripted(actions: &[Action]) -> Option<Helper> {
    let agent = Box::new(Scripted { actions: actions.to_vec(), n_acts: 0 });
    Some(Helper { agent, grants: Grants::IDS })
}

impl HelperRegistry for Scripts {
    fn names(&self) -> Vec<String> {
        vec!["script".to_owned()]
    }

    fn make(&self, _: &str, _: PlannerRules) -> Option<Helper> {
        scripted(&self.helper)
    }

    fn partner(&self, _: &str, _: Option<&RunKey>, _: PlannerRules) -> Option<Helper> {
        scripted(&self.partner)
    }
}

#[test]
fn an_agent_acts_again_after_a_joint_lift_replaced_its_choice() {
    let id = "moving_house/train/01";
    let mut setup = find_episode(id).unwrap().into_setup();
    // The partner reaches the furniture, the helper does not.
    setup.people[AgentId::HELPER.index()].pose.position = Vec3::new(9.0, 0.0, 1.0);
    let furniture = |class: &str| {
        let class = ClassId::named(class);
        let k = setup.things.iter().position(|thing| thing.class == class).unwrap();
        Target::Entity(Setup::entity(k))
    };
    let hand = Hand::Left;
    let lift = Action::PickUp { object: furniture("wood_shelving"), hand };
    let release = Action::PutOn { place: furniture("drawer"), hand };
    // Both wait when the helper's attempt has failed. Then the partner calls it to the furniture.
    let frames = RuleSet::COMPAT.world.durations.refused_pick_up;
    let scripts = Scripts {
        partner: vec![Action::Wait { frames }, lift, release, Action::TurnLeft],
        helper: vec![lift, Action::Wait { frames: 7 }, Action::TurnRight],
    };
    let episode = Episode::new(id, "changed", None, setup).unwrap();
    let rules = RuleSet::COMPAT;
    let partner = Some("script");
    let config = EpisodeConfig { rules, partner, ..EpisodeConfig::new(&episode, "script") };
    let [made, made_partner] = [&scripts.helper, &scripts.partner].map(|script| scripted(script));
    let trace = played(config, EpisodeAgents::new(made, made_partner));
    let of_helper = trace.decisions().filter(|decision| decision.agent == AgentId::HELPER);
    let of_helper: Vec<_> = of_helper.collect();
    assert_eq!(of_helper[1].action, Action::TurnRight, "the second choice was replaced");
    let plan = of_helper[1].thought.as_ref().map(|thought| thought.plan.as_str());
    assert_eq!(plan, Some("step 2"), "the thought of the replaced choice is recorded later");
    for (n, status) in rerun_with(&trace, &episode, &scripts) {
        assert!(n > 3 && status == RerunStatus::Equal, "{n} {status:?}");
    }
}

#[test]
fn a_person_and_an_unknown_helper_have_no_memory() {
    let episode = find_episode("no_constraint/test/00").unwrap();
    let config = EpisodeConfig::new(&episode, "mine");
    let slot = AgentSlot::with_agent(Box::new(NoopAgent), Grants::NONE);
    let agents = EpisodeAgents { helper: Some(slot), partner: None };
    let mut trace = played(config, agents);
    let statuses = rerun(&trace, &episode);
    assert_eq!(statuses[1], (0, RerunStatus::Unavailable));
    assert!(statuses[0].0 > 5 && statuses[0].1 == RerunStatus::Equal);
    trace.header.people[0].input = Some("plans".to_owned());
    assert!(rerun(&trace, &episode).iter().all(|(_, s)| *s == RerunStatus::Unavailable));
}

#[test]
fn no_agent_runs_with_images_that_exceed_their_bounds() {
    let episode = find_episode("no_constraint/test/00").unwrap();
    let helper = BuiltInHelpers.make("rhp", PlannerRules::paper());
    let config = EpisodeConfig::new(&episode, "rhp");
    let mut trace = played(config, EpisodeAgents::new(helper, None));
    for image_size in [0, u32::MAX] {
        for person in &mut trace.header.people {
            person.sensors.image_size = image_size;
        }
        let statuses = rerun(&trace, &episode);
        assert!(statuses.iter().all(|status| *status == (0, RerunStatus::Unavailable)));
    }
}
