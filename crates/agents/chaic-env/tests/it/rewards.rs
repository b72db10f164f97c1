//! Surplus objects earn no reward.

use chaic_agents::PlannerRules;
use chaic_core::AgentId;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_env::{AdvanceOutcome, Env, EpisodeAgents, EpisodeConfig, RewardTracker, RewardWeights};
use chaic_episodes::{Episode, find_episode};

#[test]
fn objects_beyond_the_wanted_number_earn_nothing() {
    // One object of each class is wanted; RHP, which is not told the goal, brings all it finds.
    let mut setup = find_episode("no_constraint/test/02").unwrap().setup().clone();
    setup.goal.targets.iter_mut().for_each(|(_, n)| *n = 1);
    let episode = Episode::new("surplus", "tests", None, setup).unwrap();
    let config = EpisodeConfig { image_size: Some(128), ..EpisodeConfig::new(&episode, "rhp") };
    let rhp = BuiltInHelpers.make("rhp", PlannerRules::paper());
    let mut env = Env::new(config, EpisodeAgents::new(rhp, None)).unwrap();
    let of = |delivered, own_delivered, held| RewardWeights {
        delivered,
        own_delivered,
        held,
        ..RewardWeights::NONE
    };
    let weights = [of(1.0, 0.0, 0.0), of(0.0, 1.0, 0.0), of(1.0, 0.0, 1.0)];
    let mut trackers = weights.map(|_| RewardTracker::new(AgentId::HELPER));
    let mut is_ended = false;
    let mut max_own = 0.0_f32;
    while !is_ended {
        let frame = env.world().state().frame;
        is_ended = env.advance(Some(frame + 1)).unwrap() == AdvanceOutcome::Ended;
        let mut rewards = [0.0; 3];
        for k in 0..3 {
            rewards[k] = trackers[k].cumulative(env.world(), &weights[k]);
        }
        let [delivered, own, delivered_or_held] = rewards;
        assert!(own <= delivered + 1e-6, "frame {frame}: {own} of {delivered}");
        assert!(delivered_or_held <= 1.0 + 1e-6, "frame {frame}: {delivered_or_held}");
        max_own = max_own.max(own);
    }
    let world = env.world();
    let by_helper = |k: &usize| world.state().objects[*k].delivered_by == Some(AgentId::HELPER);
    let n = (0..world.setup().things.len()).filter(by_helper).count();
    let n_wanted = world.setup().goal.targets.len();
    assert!(n as f32 > max_own * n_wanted as f32 + 0.5, "{n} deliveries earn {max_own}");
}
