//! Promise: a partner learns from drawn partners and from recordings, with the same bits for the same seed;
//! its choices follow from what it perceives. Wrong demonstrations are refused with one line.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_agents::partners::PartnerHabits;
use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::observation::Grants;
use chaic_core::{AgentError, TaskId};
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _, find_partner};
use chaic_env::trace::Record;
use chaic_env::{Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::find_episode;
use chaic_learn::bundled::BundledPartner;
use chaic_learn::helpers::{PartnerPolicy, PolicyRegistry};
use chaic_learn::partner::demonstrator::{DemonstrationEpisode, Demonstrator};
use chaic_learn::partner::features::{
    N_PARTNER_PLAN_FEATURES, N_PARTNER_STATE_FEATURES, nearest_wanted,
};
use chaic_learn::partner::recordings::read_recordings;
use chaic_learn::partner::train::{PartnerCloningConfig, PartnerCloningTrainer};
use chaic_training::conformance::{bounds_every_number, refuses_damaged_checkpoints};
use chaic_training::{Trainer as _, TrainingRun, parse_config};

static NEVER_STOP: AtomicBool = AtomicBool::new(false);
const SIZE: u32 = 64;

fn small() -> PartnerCloningConfig {
    PartnerCloningConfig {
        iterations: 2,
        episodes: 2,
        tasks: vec![TaskId::LowTarget],
        image_size: SIZE,
        validation_episodes: 1,
        n_steps: 20,
        ..PartnerCloningConfig::default()
    }
}

/// Plays an episode alone, and returns its trace as text.
fn play(id: &str, registry: &PolicyRegistry<'_>, partner: Option<&str>) -> String {
    let episode = find_episode(id).unwrap();
    let rules = PlannerRules::paper();
    let agent = find_partner(registry, partner, None, rules).unwrap();
    let image_size = Some(SIZE);
    let config = EpisodeConfig { partner, image_size, ..EpisodeConfig::new(&episode, "none") };
    let mut env = Env::new(config, EpisodeAgents::new(None, agent)).unwrap();
    let mut lines = vec![env.header().to_line()];
    let mut keep = |record: &Record| {
        lines.push(record.to_line());
        Ok::<(), AgentError>(())
    };
    env.run(&NEVER_STOP, None, &mut keep).unwrap();
    lines.join("\n") + "\n"
}

/// Trains for two iterations, and returns the weights.
fn train(config: &PartnerCloningConfig, folder: &Path) -> Vec<u8> {
    let run =
        TrainingRun::<PartnerCloningTrainer>::start(folder, config, None, &mut |_| (), &NEVER_STOP);
    assert!(run.unwrap().unwrap().run(&NEVER_STOP, &mut |_| {}).unwrap());
    fs::read(folder.join(PartnerCloningTrainer::WEIGHTS)).unwrap()
}

#[test]
fn a_partner_that_learned_from_drawn_partners_plays_an_episode() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| train(&small(), &folder.path().join(name)));
    assert!(a == b, "equal seeds give other weights");
    let policy = PartnerPolicy::read(&folder.path().join("a/partner.safetensors")).unwrap();
    let (name, policies) = (policy.name().to_owned(), [policy]);
    let registry = PolicyRegistry::bundled(&BuiltInHelpers, Arc::new(GroundTruthPerceptionFactory))
        .with_partners(&policies);
    let trace = play("low_target/gen/50000000", &registry, Some(&name));
    assert_eq!(play("low_target/gen/50000000", &registry, Some(&name)), trace);
    let digest = name.strip_prefix("policy:").expect("the name has the digest");
    assert!(trace.lines().next().unwrap().contains(&format!("\"weights\":\"{digest}\"")));
    let refused = PartnerPolicy::read(&folder.path().join("a/config.toml")).err().unwrap();
    assert!(refused.to_string().contains("config.toml"), "{refused}");
}

#[test]
fn a_partner_learns_from_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let traces = folder.path().join("traces");
    fs::create_dir(&traces).unwrap();
    let registry = PolicyRegistry::bundled(&BuiltInHelpers, Arc::new(GroundTruthPerceptionFactory));
    let write = |seed: u64| {
        let trace = play(&format!("low_target/gen/{seed}"), &registry, Some("farthest"));
        fs::write(traces.join(format!("{seed}.jsonl")), trace).unwrap();
    };
    write(40_000_001);
    let config = PartnerCloningConfig { recordings: Some(traces.clone()), ..small() };
    let problem = PartnerCloningTrainer::check(&config).unwrap_err();
    assert!(problem.contains("a single recording"), "{problem}");
    write(40_000_002);
    assert_eq!(PartnerCloningTrainer::check(&config), Ok(()));
    let out = folder.path().join("out");
    assert!(!train(&config, &out).is_empty());
    let resume =
        || TrainingRun::<PartnerCloningTrainer>::resume(&out, &mut |_| (), &NEVER_STOP).map(drop);
    resume().unwrap();
    let trace = play("low_target/gen/40000002", &registry, None);
    fs::write(traces.join("40000002.jsonl"), trace).unwrap();
    let problem = resume().unwrap_err().to_string();
    assert!(problem.contains("the data of `recordings` has changed"), "{problem}");
    fs::write(traces.join("cut.jsonl"), "{\"format\":\"chaic-trace\"}\n").unwrap();
    assert!(PartnerCloningTrainer::check(&config).unwrap_err().contains("cut.jsonl"));
}

#[test]
fn demonstrations_hold_the_choices_of_the_partner() {
    let play = |habits| {
        let episode = DemonstrationEpisode {
            id: "no_constraint/gen/40000003".to_owned(),
            partner: Demonstrator::Habits(habits),
            helper: "none".to_owned(),
        };
        episode.play(SIZE, &NEVER_STOP).unwrap().unwrap()
    };
    let decisions = play(PartnerHabits::RULES);
    assert!(decisions.len() > 5, "{}", decisions.len());
    for decision in &decisions {
        let observation = &decision.observation;
        assert_eq!(observation.state.len(), N_PARTNER_STATE_FEATURES);
        assert_eq!(
            observation.candidates.len(),
            N_PARTNER_PLAN_FEATURES * observation.n_candidates
        );
        let features = observation.state.iter().chain(&observation.candidates);
        assert!(features.clone().all(|x| (-1.0..=2.0).contains(x)), "{observation:?}");
        // The rules are their own demonstrator, and fetch the nearest wanted target.
        assert_eq!(decision.rules_action, Some(decision.action));
        if decision.is_pick {
            assert_eq!(nearest_wanted(observation), Some(decision.action));
        }
    }
    let without = play(PartnerHabits { takes_containers: false, ..PartnerHabits::RULES });
    assert!(without.iter().any(|decision| decision.rules_action != Some(decision.action)));
}

#[test]
fn wrong_configurations_are_refused_with_one_line() {
    for (text, words) in [
        ("tasks = []", ["tasks", "empty"]),
        ("splits = [\"test\"]", ["splits", "gen, gen-standard"]),
        ("helpers = [\"ogre\"]", ["helpers", "none, random"]),
        ("recordings = \"missing\"", ["missing", ""]),
    ] {
        let problem = parse_config::<PartnerCloningTrainer>(text).unwrap_err();
        assert!(words.iter().all(|word| problem.contains(word)), "{problem}");
        assert!(!problem.contains('\n'), "{problem}");
    }
    bounds_every_number::<PartnerCloningTrainer>();
    let folder = tempfile::tempdir().unwrap();
    let trainer = PartnerCloningTrainer::new(&small(), folder.path(), &mut |_| (), &NEVER_STOP);
    let mut trainer = trainer.unwrap().unwrap();
    // Sections of demonstrations are empty before the first step.
    trainer.step(&NEVER_STOP).unwrap().unwrap();
    refuses_damaged_checkpoints(&mut trainer);
}

#[test]
fn the_bundled_partner_has_the_grants_of_the_rules() {
    let registry = PolicyRegistry::bundled(&BuiltInHelpers, Arc::new(GroundTruthPerceptionFactory));
    for partner in BundledPartner::all() {
        assert!(registry.partner_names().contains(&partner.name.to_owned()));
        let made = registry.partner(partner.name, None, PlannerRules::paper()).unwrap();
        assert_eq!(made.grants, Grants::PARTNER);
        assert!(made.agent.weights().is_some());
    }
    assert!(read_recordings(Path::new("missing")).is_err());
}
