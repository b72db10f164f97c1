//! Goal and constraint of the partner reach a language model neither through what its mind is told
//! nor through the prompt, until the mind has seen them.

use std::sync::atomic::{AtomicU32, Ordering};

use chaic_core::TaskId;
use chaic_env::RunKey;
use chaic_env::minds::Helpers as _;
use chaic_env::rules::RuleSet;
use chaic_episodes::find_episode;
use chaic_eval::audit::{Pair, Partner, Secret, compare};
use chaic_llm::Language;
use chaic_llm_standin::Options;

use crate::common::{SIZE, flag, standin};

#[test]
fn language_helpers_are_told_nothing() {
    let (_standin, settings) = standin(Options::default());
    let language = Language::live(settings, flag()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    language.attach(folder.path()).unwrap();
    let rules = RuleSet::PAPER;
    // A record of its own for each mind.
    let seed = AtomicU32::new(0);
    let cases =
        [("llm", TaskId::HighTarget, Secret::Goal), ("vlm", TaskId::Shopping, Secret::Constraint)];
    for (helper, task, secret) in cases {
        let episode = find_episode(&format!("{task}/test/01")).unwrap();
        let make = || {
            let (helper, episode) = (helper.to_owned(), episode.id().to_owned());
            let key = RunKey { task, helper, episode, seed: seed.fetch_add(1, Ordering::Relaxed) };
            language.make_for(&key, rules.planner).expect("it is a language helper")
        };
        for partner in [Partner::Acts, Partner::Waits] {
            let (episode, frames) = (&episode, 400);
            let pair = Pair { episode, secret, partner, rules, frames, image_size: SIZE };
            let verdict = compare(&pair, &make, None).unwrap();
            assert_eq!(verdict.finding, None, "{helper}, {task}");
            assert!(verdict.compared > 0);
        }
    }
}
