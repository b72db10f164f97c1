//! Promise: a language model learns goal and constraint of the partner neither from disclosures nor
//! from prompts, until its agent has seen them.

use std::sync::atomic::{AtomicU32, Ordering};

use chaic_core::TaskId;
use chaic_env::RunKey;
use chaic_env::helper_registry::HelperRegistry as _;
use chaic_env::rules::RuleSet;
use chaic_episodes::find_episode;
use chaic_eval::audit::{HiddenProperty, PartnerMode, RunPair, compare};
use chaic_llm::LanguageHelpers;
use chaic_llm_standin::Options;

use crate::common::{SIZE, flag, standin};

#[test]
fn language_helpers_learn_neither_goal_nor_constraint() {
    let (_standin, settings) = standin(Options::default());
    let language = LanguageHelpers::live(settings, flag()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    language.attach(folder.path()).unwrap();
    let rules = RuleSet::PAPER;
    // Each agent has its own record.
    let seed = AtomicU32::new(0);
    let cases = [
        ("llm", TaskId::HighTarget, HiddenProperty::Goal),
        ("vlm", TaskId::Shopping, HiddenProperty::Constraint),
    ];
    for (helper, task, secret) in cases {
        let episode = find_episode(&format!("{task}/test/01")).unwrap();
        let make = || {
            let (helper, episode) = (helper.to_owned(), episode.id().to_owned());
            let key = RunKey { task, helper, episode, seed: seed.fetch_add(1, Ordering::Relaxed) };
            language.make_for(&key, rules.planner).expect("it is a language helper")
        };
        for partner in [PartnerMode::Acts, PartnerMode::Waits] {
            let (episode, frames) = (&episode, 400);
            let pair = RunPair { episode, secret, partner, rules, frames, image_size: SIZE };
            let result = compare(&pair, &make, None).unwrap();
            assert_eq!(result.violation, None, "{helper}, {task}");
            assert!(result.compared > 0);
        }
    }
}
