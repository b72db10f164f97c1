//! Promise: helpers with learned perception and action recognition get pixels and their own body
//! only. The partner's goal and constraint change none of their observations before they are
//! visible.

use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::perception_factory::PerceptionFactory as _;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::built_in;
use chaic_env::rules::RuleSet;
use chaic_episodes::find_episode;
use chaic_eval::audit::{HiddenProperty, PartnerMode, RunPair, compare};
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::recognize::LearnedBehaviorFactory;
use chaic_vision::perception::LearnedPerceptionFactory;
use chaic_vision::trained::TrainedDetector;

/// Image size, a multiple of the detector's stride of 32.
const IMAGE_SIZE: u32 = 96;

/// Perception of `--track hidden`: the bundled networks.
fn learned() -> LearnedBehaviorFactory {
    LearnedBehaviorFactory {
        perception: Arc::new(LearnedPerceptionFactory::new(TrainedDetector::built_in())),
        model: Arc::new(TrainedBehavior::built_in()),
    }
}

#[test]
fn learned_perception_reveals_nothing_hidden() {
    let perception = learned();
    let helper =
        |name| built_in(name, PlannerRules::paper(), &perception).expect("the helper is built in");
    let observers = [
        ("high_goal", "rhp"),
        ("obstacle", "random"),
        ("shopping", "follow"),
        ("low_target", "infer"),
        ("high_container", "infer"),
    ];
    for (k, (task, name)) in observers.into_iter().enumerate() {
        let episode = find_episode(&format!("{task}/gen/502")).unwrap();
        assert!(!helper(name).grants.ids, "{name} has the grant of ids");
        let pair = RunPair {
            episode: &episode,
            secret: HiddenProperty::ALL[k % 2],
            partner: [PartnerMode::Acts, PartnerMode::Waits][k % 2],
            rules: RuleSet::PAPER,
            frames: 600,
            image_size: IMAGE_SIZE,
        };
        let result = compare(&pair, &|| helper(name), None).unwrap();
        assert_eq!(result.violation, None, "{task} with {name}");
        assert!(result.compared > 0, "{task} with {name}: nothing was compared");
    }
}

#[test]
fn only_upper_bounds_are_granted_behaviors() {
    let perception = learned();
    let all = Grants { behavior: true, goal: true, ..Grants::IDS };
    assert!(perception.grants(all).behavior && !perception.grants(all).ids);
    assert!(!perception.grants(Grants { goal: false, ..all }).behavior);
}
