//! Promises: built-in agents act again as recorded, with each rule set; a person has no memory.

use chaic_core::AgentError;
use chaic_episodes::find_episode;

use super::*;
use crate::config::EpisodeConfig;
use crate::env::Env;
use crate::helper_registry::{BuiltInHelpers, built_in_partner};
use crate::rules::RuleSet;
use crate::trace::Record;
use crate::{EpisodeAgents, NoopAgent};

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
    let mut rerun = AgentRerun::new(trace, episode, &BuiltInHelpers).unwrap();
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

#[test]
fn a_person_and_an_unknown_helper_have_no_memory() {
    let episode = find_episode("no_constraint/test/00").unwrap();
    let config = EpisodeConfig::new(&episode, "mine");
    let slot = AgentSlot::with_agent(Box::new(NoopAgent), chaic_core::observation::Grants::NONE);
    let agents = EpisodeAgents { helper: Some(slot), partner: None };
    let mut trace = played(config, agents);
    let statuses = rerun(&trace, &episode);
    assert_eq!(statuses[1], (0, RerunStatus::Unavailable));
    assert!(statuses[0].0 > 5 && statuses[0].1 == RerunStatus::Equal);
    trace.header.people[0].input = Some("plans".to_owned());
    assert!(rerun(&trace, &episode).iter().all(|(_, s)| *s == RerunStatus::Unavailable));
}
