//! Surplus objects earn no reward.

use chaic_agents::PlannerRules;
use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, Rect};
use chaic_core::{Action, AgentId, ClassId, Hand, Outcome, TaskId, Vec3};
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _};
use chaic_env::{AdvanceOutcome, Env, EpisodeAgents, EpisodeConfig, RewardTracker, RewardWeights};
use chaic_episodes::{Episode, find_episode};
use chaic_world::{AgentSpec, ObjectSpec, Rules, Setup, World};

#[test]
fn objects_beyond_the_wanted_number_earn_nothing() {
    // One object of each class is wanted; RHP, which does not know the goal, delivers all it finds.
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

/// Returns a hall with a bed as the goal place and an apple beside each person. The goal is one apple and one banana.
fn hall_with_two_apples() -> World {
    let thing = |class: &str, x: f32, z: f32| {
        ObjectSpec::new(ClassId::named(class), Vec3::new(x, 0.0, z), 0.0)
    };
    let person = |persona: Persona, z: f32| {
        let pose = Pose { position: Vec3::new(-6.2, 0.0, z), yaw_rad: 0.0 };
        AgentSpec::new(persona, pose, 0)
    };
    let setup = Setup {
        task: TaskId::NoConstraint,
        seed: 1,
        horizon: 3000,
        bounds: Rect::new([-10.0, -10.0], [10.0, 10.0]),
        ceiling_m: Some(2.9),
        rooms: Vec::new(),
        walls: Vec::new(),
        openings: Vec::new(),
        floors: Vec::new(),
        things: vec![
            thing("bed", -8.0, -8.0),
            thing("apple", -6.0, -7.0),
            thing("apple", -6.0, -9.0),
        ],
        people: vec![person(Persona::Adult, -7.2), person(Persona::Helper, -8.8)],
        goal: Goal { targets: vec![(ClassId::named("apple"), 1), (ClassId::named("banana"), 1)] },
        goal_places: vec![Setup::entity(0)],
    };
    World::new(setup, Rules::paper()).unwrap()
}

/// Lets an agent put the apple beside it on the bed.
fn deliver(world: &mut World, agent: AgentId) {
    let (apple, hand) = (1 + agent.index(), Hand::Right);
    let pick_up = Action::PickUp { object: Setup::entity(apple), hand };
    for action in [pick_up, Action::PutOn { place: Setup::entity(0), hand }] {
        world.submit(agent, action).unwrap();
        while world.state().agents[agent.index()].activity.is_some() && !world.is_over() {
            world.tick();
        }
        let last = world.state().agents[agent.index()].last;
        assert_eq!(last, Some((action, Outcome::Success)), "{agent}");
    }
    // The apple falls onto the bed.
    (0..100).for_each(|_| world.tick());
    assert_eq!(world.state().objects[apple].delivered_by, Some(agent));
}

#[test]
fn a_delivery_counts_for_the_agent_that_was_first() {
    const WEIGHTS: RewardWeights = RewardWeights { own_delivered: 1.0, ..RewardWeights::NONE };
    for order in [[AgentId::PARTNER, AgentId::HELPER], [AgentId::HELPER, AgentId::PARTNER]] {
        let mut world = hall_with_two_apples();
        for agent in order {
            deliver(&mut world, agent);
            let own = |agent| RewardTracker::new(agent).cumulative(&world, &WEIGHTS);
            assert_eq!(order.map(own), [0.5, 0.0], "{order:?} after the delivery of the {agent}");
        }
        assert_eq!(world.delivered().len(), 2, "{order:?}");
    }
}
