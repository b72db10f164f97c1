//! Helpers who see by the detector and recognize by the behavior network get pixels and their own body,
//! and nothing else: what the partner wants and can't do changes nothing that they are told before they
//! could see it.

use std::sync::Arc;

use chaic_agents::PlannerRules;
use chaic_agents::sight::Sight as _;
use chaic_core::observation::Grants;
use chaic_env::minds::built_in;
use chaic_env::rules::RuleSet;
use chaic_episodes::find_episode;
use chaic_eval::audit::{Pair, Partner, Secret, compare};
use chaic_vision::behavior::network::{BehaviorNetwork, TrainedBehavior};
use chaic_vision::behavior::recognize::Recognizing;
use chaic_vision::perception::LearnedSight;
use chaic_vision::trained::TrainedDetector;

/// Of the detector, which halves sides five times.
const IMAGE_SIZE: u32 = 96;

fn learned() -> Recognizing {
    let network = BehaviorNetwork::new();
    let numbers = network.network.begin(1);
    let trained = Arc::new(TrainedBehavior { network, numbers, sharpness: 1.0 });
    Recognizing { sight: Arc::new(LearnedSight::new(TrainedDetector::built_in())), trained }
}

#[test]
fn who_sees_by_pixels_is_told_nothing_else() {
    let sight = learned();
    let helper = |name| built_in(name, PlannerRules::paper(), &sight).expect("it is built in");
    let tasks = ["high_goal", "obstacle", "shopping", "low_target", "high_container"];
    for (k, task) in tasks.into_iter().enumerate() {
        let episode = find_episode(&format!("{task}/gen/502")).unwrap();
        let name = ["rhp", "random", "follow"][k % 3];
        assert!(!helper(name).grants.ids, "{name} is granted ids");
        let pair = Pair {
            episode: &episode,
            secret: Secret::ALL[k % 2],
            partner: [Partner::Acts, Partner::Waits][k % 2],
            rules: RuleSet::PAPER,
            frames: 600,
            image_size: IMAGE_SIZE,
        };
        let verdict = compare(&pair, &|| helper(name), None).unwrap();
        assert_eq!(verdict.finding, None, "{task} with {name}");
        assert!(verdict.compared > 0, "{task} with {name}: nothing was compared");
    }
}

#[test]
fn bounds_alone_are_told_what_others_do() {
    let sight = learned();
    let all = Grants { behavior: true, goal: true, ..Grants::IDS };
    assert!(sight.grants(all).behavior && !sight.grants(all).ids);
    assert!(!sight.grants(Grants { goal: false, ..all }).behavior);
}
