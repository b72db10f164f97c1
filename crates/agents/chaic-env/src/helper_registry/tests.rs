//! Promise: partners with habits play the same episodes as in all earlier versions, and habits in the
//! name of a partner have an effect.

use std::sync::atomic::AtomicBool;

use chaic_core::AgentError;
use chaic_episodes::{Episode, find_episode};

use super::*;
use crate::{Digest, Env, EnvError, EpisodeAgents, EpisodeConfig};

/// Returns an episode that ends at this frame.
fn shortened(id: &str, horizon: u32) -> Episode {
    let json = find_episode(id).expect("a generated episode").to_json();
    let begin = json.find("\"horizon\": ").expect("an episode has one") + 11;
    let end = begin + json[begin..].find(',').expect("more follows");
    let text = format!("{}{horizon}{}", &json[..begin], &json[end..]);
    Episode::parse(text.as_bytes(), id).expect("a valid episode")
}

/// Plays an episode with a partner alone; returns the digest of the last state.
fn last_digest(episode: &Episode, partner: &str) -> Digest {
    let agent = find_partner(&BuiltInHelpers, Some(partner), None, PlannerRules::paper());
    let config = EpisodeConfig {
        partner: Some(partner),
        image_size: Some(64),
        ..EpisodeConfig::new(episode, "none")
    };
    let agents = EpisodeAgents::new(None, agent.expect("a known partner"));
    let mut env = Env::new(config, agents).expect("a valid episode");
    env.run(&AtomicBool::new(false), None, &mut |_| Ok::<(), AgentError>(())).expect("it plays");
    Digest(env.world().digest())
}

/// A change of these digests moves the scores of all runs with such partners, so the changelog must
/// state it.
#[test]
fn named_partners_play_as_before() {
    let house = shortened("no_constraint/gen/12", 2600);
    let other_house = shortened("low_target/gen/13", 1800);
    let expected = [
        ("farthest", "e4bc979a2a445900"),
        ("shuffled", "e4bc979a2a445900"),
        ("slow", "be05361d0d2002b0"),
        ("no_containers", "6b29abc3be0c5387"),
        ("habits:order=nearest", "d068cc4043791672"),
        ("noisy", "b240a62ca8a2f452"),
    ];
    let found = expected.map(|(partner, _)| {
        let episode = if partner == "noisy" { &other_house } else { &house };
        (partner, last_digest(episode, partner).to_string())
    });
    assert_eq!(found, expected.map(|(partner, digest)| (partner, digest.to_owned())));
}

#[test]
fn a_partner_whose_name_lists_its_habits_is_that_partner() {
    let episode = shortened("no_constraint/gen/12", 900);
    let slow = last_digest(&episode, "slow");
    assert_eq!(last_digest(&episode, "habits:pause=90"), slow);
    assert_ne!(last_digest(&episode, "habits:pause=91"), slow);
}

#[test]
fn wrong_habits_are_named() {
    let problem = |name: &str| {
        let found = find_partner(&BuiltInHelpers, Some(name), None, PlannerRules::paper());
        found.err().expect("no such partner")
    };
    let error = problem("habits:noise=101");
    assert!(matches!(error, EnvError::InvalidPartner { .. }) && error.is_usage(), "{error}");
    assert!(matches!(problem("ogre"), EnvError::UnknownPartner { .. }));
}
