//! Trained policies as helpers of runs.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_core::{Action, AgentError, AgentId, EntityId, TaskId};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, HelperRegistry as _};
use chaic_env::rules::RuleSet;
use chaic_env::trace::Record;
use chaic_env::{Env, EpisodeConfig};
use chaic_episodes::find_episode;
use chaic_eval::audit::{HiddenProperty, PartnerMode, RunPair, compare};
use chaic_learn::actor_critic::ActorCritic as _;
use chaic_learn::bundled::BundledHelper;
use chaic_learn::helpers::{NamedPolicy, PolicyRegistry};
use chaic_learn::opponent::network::OpponentInput;
use chaic_learn::opponent::train::OpponentTrainer;
use chaic_learn::partner::train::PartnerCloningTrainer;
use chaic_learn::train::{CloningConfig, PolicyTrainer, PpoTrainingConfig};
use chaic_learn::visual::actions::ActionSpace;
use chaic_learn::visual::network::VisualNetwork;
use chaic_learn::visual::train::VisualTrainer;
use chaic_nn::weights;
use chaic_training::parse_config;
use chaic_vision::perception_registry::perception_from_name;

fn bundled() -> PolicyRegistry<'static> {
    PolicyRegistry::bundled(&BuiltInHelpers, Arc::new(GroundTruthPerceptionFactory))
}

/// Writes random weights of a visual policy.
fn write_visual_policy(file: &Path, opponent: OpponentInput, seed: u64) {
    let model = VisualNetwork::new(ActionSpace::Primitives, opponent);
    let parameters = model.network().init_parameters(seed);
    let bytes = weights::to_bytes(model.network(), &parameters, &model.kind()).unwrap();
    fs::write(file, bytes).unwrap();
}

/// Plays the first 400 frames of an episode; returns the helper's actions.
fn play(helper: Helper, task: TaskId) -> Result<Vec<Action<EntityId>>, AgentError> {
    let episode = find_episode(&format!("{task}/gen/40000001")).unwrap();
    let config = EpisodeConfig { image_size: Some(128), ..EpisodeConfig::new(&episode, "mine") };
    let mut actions = Vec::new();
    Env::new(config, Some(helper)).unwrap().run(
        &AtomicBool::new(false),
        Some(400),
        &mut |record| {
            if let Record::Decision(decision) = record
                && decision.agent == AgentId::HELPER
            {
                actions.push(decision.action);
            }
            Ok::<(), AgentError>(())
        },
    )?;
    Ok(actions)
}

#[test]
fn bundled_helpers_have_weights_with_a_digest() {
    let registry = bundled();
    let names = registry.names();
    for BundledHelper { name, .. } in BundledHelper::all() {
        assert_eq!(names.iter().filter(|n| n == name).count(), 1, "{name}");
        let helper = registry.make(name, PlannerRules::paper()).unwrap();
        assert_eq!(helper.agent.weights().map(|digest| digest.len()), Some(12), "{name}");
        assert!(!helper.grants.goal && !helper.grants.progress, "{name}");
        // Without the grant, one policy plays all tasks.
        let tasks = if helper.grants.task { 8 } else { 1 };
        for task in TaskId::paper().take(tasks) {
            let helper = registry.make(name, PlannerRules::paper()).unwrap();
            assert!(play(helper, task).unwrap().len() > 5, "{name}, {task}");
        }
    }
}

/// Else each episode of the run would fail.
#[test]
fn bundled_helpers_with_a_policy_per_task_are_refused_in_other_tasks() {
    let registry = bundled();
    for name in ["rl_paper", "smart_help"] {
        assert!(TaskId::paper().all(|task| registry.check_task(name, task).is_ok()), "{name}");
        for task in TaskId::chaic() {
            let problem = registry.check_task(name, task).unwrap_err();
            assert_eq!(problem, format!("`{name}` has no policy for {task}; select other tasks"));
        }
    }
    for name in ["cloned", "rhp", "none"] {
        assert!(TaskId::all().all(|task| registry.check_task(name, task).is_ok()), "{name}");
    }
}

/// Else its opponent model would read inputs on which it was not trained.
#[test]
fn a_policy_with_granted_behavior_is_refused_with_learned_behavior() {
    let folder = tempfile::tempdir().unwrap();
    for (behavior, is_refused) in [("gt", false), ("learned", true)] {
        let inputs = [("mine", OpponentInput::Granted), ("other", OpponentInput::Observed)];
        let policies = inputs.map(|(name, opponent)| {
            let file = folder.path().join(format!("{name}.safetensors"));
            write_visual_policy(&file, opponent, 1);
            NamedPolicy::read(name, &file).unwrap()
        });
        let perception = perception_from_name("gt", behavior).unwrap();
        let registry = PolicyRegistry::bundled(&BuiltInHelpers, perception);
        let registry = registry.with_policies(policies.into()).unwrap();
        for name in ["other", "cloned", "smart_help_plus", "rhp", "none"] {
            assert_eq!(registry.check_task(name, TaskId::Obstacle), Ok(()), "{name}");
        }
        for name in ["mine", "smart_help"] {
            let checked = registry.check_task(name, TaskId::Obstacle);
            assert_eq!(checked.is_err(), is_refused, "{name}");
            let Err(problem) = checked else { continue };
            let words = ["the grant `behavior`", "`--behavior gt`"];
            assert!(words.iter().all(|word| problem.contains(word)), "{problem}");
            assert!(problem.starts_with(&format!("`{name}`")), "{problem}");
            assert_eq!(problem.contains("mine.safetensors)"), name == "mine", "{problem}");
        }
    }
}

#[test]
fn the_recipes_of_bundled_weights_are_valid() {
    for recipe in
        [include_str!("../../weights/cloned.toml"), include_str!("../../weights/rl_clone.toml")]
    {
        assert!(parse_config::<PolicyTrainer<CloningConfig>>(recipe).is_ok());
    }
    let recipe = include_str!("../../weights/rl.toml");
    assert!(parse_config::<PolicyTrainer<PpoTrainingConfig>>(recipe).is_ok());
    for recipe in [
        include_str!("../../weights/smart_help_opponent.toml"),
        include_str!("../../weights/smart_help_plus_opponent.toml"),
    ] {
        assert!(parse_config::<OpponentTrainer>(recipe).is_ok());
    }
    let recipe = include_str!("../../weights/rl_paper.toml");
    assert!(parse_config::<VisualTrainer>(recipe).is_ok());
    let recipe = include_str!("../../weights/partner.toml");
    assert!(parse_config::<PartnerCloningTrainer>(recipe).is_ok());
    // These need the weights of an opponent model.
    let without_opponent = |recipe: &str| {
        let line = "opponent = \"opponent/opponent.safetensors\"\n";
        assert!(recipe.contains(line));
        recipe.replace(line, "")
    };
    let recipe = without_opponent(include_str!("../../weights/smart_help.toml"));
    assert!(parse_config::<VisualTrainer>(&recipe).is_ok());
    let recipe = without_opponent(include_str!("../../weights/smart_help_plus.toml"));
    assert!(parse_config::<PolicyTrainer<CloningConfig>>(&recipe).is_ok());
}

/// Asserts that a helper cannot distinguish two episodes of each task that differ in a secret of the partner.
/// The secrets take turns.
fn check_secrets(name: &str, tasks: impl Iterator<Item = TaskId>) {
    let registry = bundled();
    for (k, task) in tasks.enumerate() {
        let episode = find_episode(&format!("{task}/gen/501")).unwrap();
        let secret = HiddenProperty::ALL[k % HiddenProperty::ALL.len()];
        let helper = || registry.make(name, PlannerRules::paper()).unwrap();
        for partner in [PartnerMode::Acts, PartnerMode::Waits] {
            let rules = RuleSet::PAPER;
            let episode = &episode;
            let pair = RunPair { episode, secret, partner, rules, frames: 900, image_size: 48 };
            let result = compare(&pair, &helper, None).unwrap();
            if let Some(violation) = result.violation {
                panic!("{name} in {task}, {secret:?}, partner {partner:?}: {violation}");
            }
            let is_long = partner == PartnerMode::Acts || result.compared > 20;
            assert!(is_long, "{name} in {task}: {} observations", result.compared);
        }
    }
}

#[test]
fn bundled_helpers_learn_no_secret() {
    check_secrets("cloned", TaskId::paper());
}

#[test]
fn bundled_helpers_with_a_hint_or_images_learn_no_secret() {
    // The grant `task` of `rl_paper` discloses the kind of person, which both runs share.
    for name in ["rl", "rl_paper"] {
        check_secrets(name, [TaskId::LowTarget, TaskId::Obstacle].into_iter());
    }
}

#[test]
fn the_name_of_a_bundled_helper_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("policy.safetensors");
    write_visual_policy(&file, OpponentInput::None, 1);
    let name = BundledHelper::all()[0].name;
    let policy = NamedPolicy::read(name, &file).unwrap();
    let error = bundled().with_policies(vec![policy]).err().unwrap();
    let refused = error.to_string();
    assert!(refused.contains(&format!("there is a helper `{name}` already")), "{refused}");
    assert!(error.is_usage());
    let policy = NamedPolicy::read("a b", &file).unwrap();
    let error = bundled().with_policies(vec![policy]).err().unwrap();
    assert!(error.is_usage() && error.to_string().contains("not a valid name"), "{error}");
}

#[test]
fn a_folder_of_weights_is_a_policy_per_task() {
    let folder = tempfile::tempdir().unwrap();
    let registry = |path: &Path| {
        let policy = NamedPolicy::read("mine", path).unwrap();
        bundled().with_policies(vec![policy]).unwrap()
    };
    let make = |path: &Path| registry(path).make("mine", PlannerRules::paper()).unwrap();
    let tasks = [TaskId::MovingHouse, TaskId::Shopping];
    let files = tasks.map(|task| folder.path().join(format!("{task}.safetensors")));
    for (seed, file) in (1..).zip(&files) {
        write_visual_policy(file, OpponentInput::None, seed);
    }
    assert!(make(folder.path()).grants.task, "the task selects the policy");
    assert!(!make(&files[0]).grants.task);
    for (task, file) in tasks.into_iter().zip(&files) {
        let [all, single] = [folder.path(), file].map(|path| play(make(path), task).unwrap());
        assert!(single.len() > 10 && all == single, "{task}");
    }
    let [first, second] = files.each_ref().map(|file| play(make(file), tasks[0]).unwrap());
    assert_ne!(first, second, "the two policies differ");
    let problem = play(make(folder.path()), TaskId::LowTarget).unwrap_err().to_string();
    assert!(problem.contains("no policy for low_target"), "{problem}");
    assert!(problem.contains("the file low_target.safetensors"), "{problem}");
    // A run is refused before it plays.
    let registry_of_both = registry(folder.path());
    assert!(tasks.iter().all(|task| registry_of_both.check_task("mine", *task).is_ok()));
    let problem = registry_of_both.check_task("mine", TaskId::LowTarget).unwrap_err();
    let expected = format!("{} has no low_target.safetensors", folder.path().display());
    assert!(problem.starts_with(&expected), "{problem}");
    assert!(registry(&files[0]).check_task("mine", TaskId::LowTarget).is_ok());
    let digest = make(folder.path()).agent.weights();
    write_visual_policy(&files[1], OpponentInput::None, 3);
    assert_ne!(make(folder.path()).agent.weights(), digest, "every file counts");
    // Policies with other inputs, and a folder without weights.
    write_visual_policy(&files[1], OpponentInput::Observed, 2);
    let problem = NamedPolicy::read("mine", folder.path()).err().unwrap().to_string();
    assert!(problem.contains("other inputs"), "{problem}");
    let empty = tempfile::tempdir().unwrap();
    let problem = NamedPolicy::read("mine", empty.path()).err().unwrap().to_string();
    assert!(problem.contains("no weights file of a task"), "{problem}");
}

#[test]
fn visual_weights_for_other_classes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("policy.safetensors");
    let model = VisualNetwork::new(ActionSpace::Plans, OpponentInput::None);
    let parameters = model.network().init_parameters(1);
    let read = |kind: &str| {
        let bytes = weights::to_bytes(model.network(), &parameters, kind).unwrap();
        fs::write(&file, bytes).unwrap();
        NamedPolicy::read("mine", &file).map(drop)
    };
    let kind = model.kind();
    let (before, digest) = kind.split_once(", classes ").unwrap();
    assert_eq!(digest.len(), 12);
    assert!(read(&kind).is_ok());
    assert!(read(before).is_ok(), "weights of earlier versions name no classes");
    let problem = read(&format!("{before}, classes 0123456789ab")).unwrap_err().to_string();
    assert!(problem.contains("policy.safetensors: trained with other object classes"), "{problem}");
    assert!(!problem.contains('\n'), "{problem}");
}

#[test]
fn files_without_policy_weights_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("other.safetensors");
    for bytes in [&b""[..], b"not a file of weights", include_bytes!("policies.rs")] {
        fs::write(&file, bytes).unwrap();
        let problem = NamedPolicy::read("mine", &file).err().unwrap().to_string();
        assert!(problem.contains("other.safetensors") && !problem.contains('\n'), "{problem}");
    }
    assert!(NamedPolicy::read("mine", &folder.path().join("missing")).is_err());
}
