//! Complete agents in a toy house: they deliver objects, and never get stuck.

use chaic_core::capability::Persona;
use chaic_core::observation::Grants;
use chaic_core::task::SceneKind;
use chaic_core::{ClassId, Hand};

use super::*;
use crate::decision::Subject;
use crate::perception::{GroundTruthIds, PixelTargets};
use crate::perception_factory::{GroundTruthPerceptionFactory, GroundTruthTracksFactory};
use crate::policies::{PartnerVariantPolicy, RulePolicy, RuleProfile};
use crate::rules::ObstacleChoice;
use crate::test_support::{Toy, ToyObject};
use crate::{helpers, partners};

/// Creates the agent of a partner with this persona.
fn partner_agent(persona: Persona) -> PlanningAgent<RulePolicy> {
    PlanningAgent::new(partners::policy(persona, SceneKind::House), PlannerRules::paper())
}

/// Creates three rooms in a row with doors of 1.2 m, furniture, a bed and fruit; returns the number
/// of fruit too.
fn house() -> (Toy, usize) {
    let mut toy = Toy::room(15.0, 6.0);
    for (x, gap) in [(-2.5, -1.5), (2.5, 1.0)] {
        toy.add_wall([x - 0.05, -3.0], [x + 0.05, gap - 0.6]);
        toy.add_wall([x - 0.05, gap + 0.6], [x + 0.05, 3.0]);
    }
    toy.add(ToyObject::new("bed", [6.3, 0.0, -1.8], [2.0, 0.5, 1.6]));
    toy.add(ToyObject::new("cabinet", [-6.5, 0.0, 2.6], [1.2, 1.0, 0.5]));
    toy.add(ToyObject::new("dining_table", [0.0, 0.0, 1.5], [1.4, 0.75, 0.8]));
    let places = [
        ("apple", [-6.5, 1.0, 2.5]),
        ("apple", [0.3, 0.75, 1.6]),
        ("banana", [-5.0, 0.0, -2.5]),
        ("banana", [1.5, 0.0, -2.0]),
        ("apple", [4.0, 0.0, 2.5]),
    ];
    for (class, at) in places {
        toy.add(ToyObject::new(class, at, [0.16, 0.12, 0.16]));
    }
    toy.add(ToyObject::new("wicker_basket", [-4.0, 0.0, 1.0], [0.4, 0.3, 0.4]));
    toy.stand([-6.0, 0.0], 0.7);
    (toy, places.len())
}

#[test]
fn the_partner_delivers_the_whole_goal_with_time_to_spare() {
    let (mut toy, n) = house();
    let mut briefing = toy.briefing();
    briefing.goal = Toy::goal(&[("apple", 3), ("banana", 2)]);
    let plans = toy.run(&mut partner_agent(Persona::Adult), &briefing);
    let history = plans.join("; ");
    assert!(
        toy.delivered.len() >= n,
        "{} delivered by {}: {history}",
        toy.delivered.len(),
        toy.frame
    );
    assert!(toy.frame < 2400, "{}: {history}", toy.frame);
    assert!(history.contains("container"), "{history}");
    assert!(toy.n_blocked <= 6, "bumped {} times", toy.n_blocked);
}

/// Runs a partner with these habits in the toy house until it has delivered everything; returns the
/// frame and the plans.
fn frames_of(habits: &str) -> (u32, Vec<String>) {
    let (mut toy, n) = house();
    let mut briefing = Briefing { horizon: 6000, ..toy.briefing() };
    briefing.goal = Toy::goal(&[("apple", 3), ("banana", 2)]);
    let habits = partners::partner_habits(habits).expect("known habits");
    let mut agent = PlanningAgent::new(PartnerVariantPolicy::new(habits), PlannerRules::paper());
    let plans = toy.run(&mut agent, &briefing);
    assert!(toy.delivered.len() >= n, "{} delivered: {plans:?}", toy.delivered.len());
    (toy.frame, plans)
}

#[test]
fn partners_with_habits_deliver_everything_but_later() {
    let deliveries = |plans: &[String]| plans.iter().filter(|p| p.contains("goal place")).count();
    let (ordinary, plans) = frames_of("habits:order=nearest");
    let trips = deliveries(&plans);
    let (one_by_one, plans) = frames_of("habits:load=1,containers=no");
    assert!(deliveries(&plans) >= 5 && deliveries(&plans) > trips, "{plans:?}");
    assert!(!plans.iter().any(|p| p.contains("container")), "{plans:?}");
    let (forgetful, _) = frames_of("habits:memory=60");
    for frames in [one_by_one, forgetful] {
        assert!(frames > ordinary, "{frames} frames, {ordinary} with the rules");
    }
}

#[test]
fn an_agent_with_pixel_targets_delivers_too() {
    let (mut toy, n) = house();
    toy.grants_ids = false;
    let briefing = Briefing { grants: Grants::NONE, ..toy.briefing() };
    let perception = GroundTruthTracksFactory.perception();
    let behavior = Box::new(GroundTruthBehavior::default());
    let rules = crate::PlannerRules::paper();
    let policy = RulePolicy::new(RuleProfile::RHP);
    let mut agent = PlanningAgent::with(policy, perception, behavior, rules);
    let plans = toy.run(&mut agent, &briefing);
    assert!(toy.delivered.len() >= n, "{} delivered: {}", toy.delivered.len(), plans.join("; "));
}

#[test]
fn rhp_removes_an_obstacle_from_the_doorway_and_delivers_the_object_behind_it() {
    let mut toy = Toy::room(8.0, 5.0);
    toy.add_wall([-0.05, -2.5], [0.05, -0.6]);
    toy.add_wall([-0.05, 0.6], [0.05, 2.5]);
    let bin = toy.add(ToyObject::new("trashbin", [0.0, 0.0, 0.0], [0.7, 0.9, 0.9]));
    toy.add(ToyObject::new("bed", [-3.2, 0.0, -1.5], [1.4, 0.5, 1.6]));
    let apple = toy.add(ToyObject::new("apple", [3.0, 0.0, 1.5], [0.16, 0.12, 0.16]));
    toy.stand([-2.5, 1.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.horizon = 1500;
    let plans = toy.run(
        &mut helpers::rhp(crate::PlannerRules::paper(), &GroundTruthPerceptionFactory),
        &briefing,
    );
    assert!(plans.iter().any(|p| p.contains("obstacle")), "{plans:?}");
    assert!(toy.delivered.contains(&apple), "{plans:?}");
    assert!(!toy.delivered.contains(&bin));
}

#[test]
fn the_same_episode_leads_to_the_same_actions_twice() {
    let [a, b] = [0, 1].map(|_| {
        let (mut toy, _) = house();
        let briefing = Briefing { horizon: 800, ..toy.briefing() };
        let plans = toy.run(
            &mut helpers::random(crate::PlannerRules::paper(), &GroundTruthPerceptionFactory),
            &briefing,
        );
        (plans, toy.here(), toy.frame)
    });
    assert_eq!(a, b);
}

#[test]
fn the_random_helper_chooses_all_valid_plans_equally_often() {
    use crate::policies::RandomPolicy;
    let toy = Toy::room(4.0, 4.0);
    let briefing = toy.briefing();
    let memory = Memory::new(&briefing, crate::PlannerRules::paper());
    let behavior = GroundTruthBehavior::default();
    let context = Context {
        briefing: &briefing,
        memory: &memory,
        behavior: behavior.log(),
        is_explored: false,
    };
    let valid = [Plan::Explore, Plan::Deliver, Plan::TurnAround];
    let mut random = RandomPolicy::default();
    random.reset(&briefing);
    let mut counts = [0; 3];
    for _ in 0..3000 {
        let plan = random.decide(&context, &valid);
        counts[valid.iter().position(|p| *p == plan).expect("valid")] += 1;
    }
    assert!(counts.iter().all(|c| (900..1100).contains(c)), "{counts:?}");
}

#[test]
fn an_agent_without_briefing_or_images_does_not_panic() {
    let (toy, _) = house();
    let mut observation = toy.observe();
    let mut agent = helpers::rhp(crate::PlannerRules::paper(), &GroundTruthPerceptionFactory);
    assert_eq!(agent.act(&observation).unwrap(), Action::Wait { frames: PAUSE_FRAMES });
    agent.reset(&toy.briefing());
    observation.images = Default::default();
    for frame in 0..60 {
        observation.frame = frame;
        agent.act(&observation).unwrap();
    }
}

/// Creates a house of 3 by 2 rooms with doors at random positions, furniture and fruit.
fn random_house(seed: u64, door_m: f32) -> Toy {
    let mut rng = chaic_core::rng::RngStream::new(seed, "toy house", 0);
    let (w, d) = (15.0, 9.0);
    let mut toy = Toy::room(w, d);
    let half = 0.5 * door_m;
    for x in [-2.5f32, 2.5] {
        for (low, high) in [(-4.5f32, 0.0f32), (0.0, 4.5)] {
            let gap = rng.range(low + 1.0, high - 1.0);
            toy.add_wall([x - 0.05, low], [x + 0.05, gap - half]);
            toy.add_wall([x - 0.05, gap + half], [x + 0.05, high]);
        }
    }
    for low in [-7.5f32, -2.5, 2.5] {
        let gap = rng.range(low + 1.0, low + 4.0);
        toy.add_wall([low, -0.05], [gap - half, 0.05]);
        toy.add_wall([gap + half, -0.05], [low + 5.0, 0.05]);
    }
    let mut n = 0;
    for (i, x) in [-5.0f32, 0.0, 5.0].into_iter().enumerate() {
        for z in [-2.25f32, 2.25] {
            // Each room has a table off its center with fruit on it, furniture at its outer wall,
            // and fruit on the floor.
            let (tx, tz) = (x + rng.range(-0.7, 0.7), z + rng.range(-0.5, 0.5));
            toy.add(ToyObject::new("dining_table", [tx, 0.0, tz], [1.2, 0.75, 0.8]));
            let side = z.signum();
            let class = if i == 0 && z > 0.0 { "bed" } else { "cabinet" };
            toy.add(ToyObject::new(
                class,
                [x + rng.range(-1.0, 1.0), 0.0, z + 1.9 * side],
                [1.4, 0.6, 0.6],
            ));
            let class = ["apple", "banana", "orange"][n % 3];
            n += 1;
            toy.add(ToyObject::new(
                class,
                [tx + rng.range(-0.4, 0.4), 0.75, tz + rng.range(-0.25, 0.25)],
                [0.1, 0.1, 0.1],
            ));
            toy.add(ToyObject::new("orange", [x + 1.9, 0.0, z - 1.2 * side], [0.1, 0.1, 0.1]));
        }
    }
    toy.add(ToyObject::new("wicker_basket", [-6.9, 0.0, -1.0], [0.4, 0.3, 0.4]));
    toy.stand([rng.range(-1.5, 1.5), 0.6], 0.3);
    toy.size = 128;
    toy
}

#[test]
fn no_agent_gets_stuck_in_a_house_with_narrow_doors_and_tables() {
    for (radius_m, door_m) in [(0.2, 1.2), (0.2, 0.9), (0.35, 1.2)] {
        let mut toy = random_house(1, door_m);
        toy.radius_m = radius_m;
        let mut briefing = toy.briefing();
        briefing.capability.radius_m = radius_m;
        let plans = toy
            .run(
                &mut helpers::rhp(crate::PlannerRules::paper(), &GroundTruthPerceptionFactory),
                &briefing,
            )
            .join("; ");
        let n = toy.delivered.len();
        assert!(n >= 6, "{radius_m} m through {door_m} m: only {n} delivered: {plans}");
        assert!(toy.n_blocked <= 10, "bumped {} times: {plans}", toy.n_blocked);
    }
}

#[test]
fn the_frail_person_brings_furniture_to_the_truck() {
    let mut toy = Toy::room(14.0, 10.0);
    toy.add(ToyObject::new("truck", [4.5, 0.0, 0.0], [2.4, 1.2, 6.0]));
    for at in [[-4.0, 0.0, -3.0], [-5.0, 0.0, 2.0]] {
        toy.add(ToyObject::new("drawer", at, [0.9, 1.0, 0.5]));
    }
    toy.stand([0.0, 0.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.horizon = 1500;
    briefing.possible_targets = vec![ClassId::named("drawer"), ClassId::named("sofa")];
    briefing.containers.clear();
    briefing.goal_places = vec![ClassId::named("truck")];
    briefing.goal = Toy::goal(&[("drawer", 2)]);
    let plans = toy.run(&mut partner_agent(Persona::Frail), &briefing);
    assert_eq!(toy.delivered.len(), 2, "{plans:?}");
}

#[test]
fn the_rider_fills_the_basket_before_delivering_it() {
    let mut toy = Toy::room(16.0, 6.0);
    toy.add(ToyObject::new("bed", [6.5, 0.0, 0.0], [1.6, 0.5, 2.0]));
    for x in [-6.0, -5.0, -4.0, -3.0] {
        toy.add(ToyObject::new("apple", [x, 0.0, 2.0], [0.16, 0.12, 0.16]));
    }
    let bike = toy.add(ToyObject::new("bike", [0.0, -9.0, 0.0], [0.1, 0.1, 0.1]));
    toy.hold(0, bike);
    toy.stand([-5.0, 0.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.goal = Toy::goal(&[("apple", 4)]);
    let plans = toy.run(&mut partner_agent(Persona::Rider), &briefing);
    assert_eq!(toy.delivered.len(), 4, "{plans:?}");
    assert_eq!(plans.iter().filter(|p| p.starts_with("bring")).count(), 2, "{plans:?}");
}

/// Policy that looks around, with this thinking time in frames.
struct SlowPolicy(chaic_core::Frame);

impl Policy for SlowPolicy {
    fn reset(&mut self, _: &Briefing) {}

    fn choose(&mut self, _: &Context<'_>, _: &[Plan]) -> Result<Plan, AgentError> {
        Ok(Plan::TurnAround)
    }

    fn thinking_frames(&self) -> chaic_core::Frame {
        self.0
    }
}

#[test]
fn a_plan_begins_after_the_thinking_time() {
    for (frames, first) in [(0, Action::TurnLeft), (25, Action::Wait { frames: 25 })] {
        let (mut toy, _) = house();
        let mut agent = PlanningAgent::new(SlowPolicy(frames), PlannerRules::paper());
        agent.reset(&toy.briefing());
        assert_eq!(agent.act(&toy.observe()).unwrap(), first);
        toy.apply(first);
        assert_eq!(agent.act(&toy.observe()).unwrap(), Action::TurnLeft, "it thinks once per plan");
    }
}

/// The rules without their filter of plans.
struct Unfiltered(RulePolicy);

impl Policy for Unfiltered {
    fn reset(&mut self, briefing: &Briefing) {
        self.0.reset(briefing);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.0.choose(context, valid)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        self.0.reconsiders(context, current, has_changed)
    }
}

#[test]
fn the_filter_of_plans_changes_no_action() {
    fn actions<P: Policy>(policy: P) -> Vec<Action> {
        let (mut toy, _) = house();
        toy.add(ToyObject::new("trashbin", [-3.2, 0.0, 2.3], [0.4, 0.6, 0.4]));
        toy.size = 64;
        let goal = Toy::goal(&[("apple", 2), ("banana", 1)]);
        let briefing = Briefing { goal, horizon: 1500, ..toy.briefing() };
        let obstacle_choice = ObstacleChoice::All;
        let rules = PlannerRules { obstacle_choice, ..PlannerRules::paper() };
        let mut agent = PlanningAgent::new(policy, rules);
        agent.reset(&briefing);
        let mut actions = Vec::new();
        while toy.frame < briefing.horizon {
            let action = agent.act(&toy.observe()).expect("the rules always choose");
            toy.apply(action);
            actions.push(action);
        }
        assert!(actions.iter().any(|a| matches!(a, Action::PickUp { .. })), "{actions:?}");
        actions
    }
    for profile in [RuleProfile::PARTNER, RuleProfile::RHP, RuleProfile::ORACLE] {
        let policy = RulePolicy::new(profile);
        assert_eq!(actions(policy.clone()), actions(Unfiltered(policy)), "{profile:?}");
    }
}

/// Policy that reconsiders when the map changes, and counts its choices. The second one fails.
struct HaltingPolicy(u32);

impl Policy for HaltingPolicy {
    fn reset(&mut self, _: &Briefing) {}

    fn choose(&mut self, _: &Context<'_>, _: &[Plan]) -> Result<Plan, AgentError> {
        self.0 += 1;
        match self.0 {
            2 => Err(AgentError::Halted("no answer".to_owned())),
            _ => Ok(Plan::TurnAround),
        }
    }

    fn reconsiders(&mut self, _: &Context<'_>, _: &Plan, has_changed: bool) -> bool {
        has_changed
    }
}

#[test]
fn a_failed_choice_is_repeated_by_the_next_call() {
    let mut toy = Toy::room(6.0, 6.0);
    toy.stand([0.0, 0.0], 0.0);
    let mut agent = PlanningAgent::new(HaltingPolicy(0), PlannerRules::paper());
    agent.reset(&toy.briefing());
    assert_eq!(agent.act(&toy.observe()).unwrap(), Action::TurnLeft);
    toy.add(ToyObject::new("apple", [0.0, 0.5, -2.0], [0.2, 0.2, 0.2]));
    assert!(agent.act(&toy.observe()).is_err());
    assert_eq!(agent.next_action().unwrap(), Action::TurnLeft);
    assert_eq!(agent.policy().0, 3);
}

/// Policy that only chooses plans that cannot be executed.
struct ImpossiblePolicy;

impl Policy for ImpossiblePolicy {
    fn reset(&mut self, _: &Briefing) {}

    fn choose(&mut self, _: &Context<'_>, _: &[Plan]) -> Result<Plan, AgentError> {
        Ok(Plan::PutIn)
    }
}

#[test]
fn an_agent_whose_plans_are_impossible_explores() {
    let (mut toy, _) = house();
    let briefing = Briefing { horizon: 600, ..toy.briefing() };
    let from = toy.here();
    let mut farthest_m: f32 = 0.0;
    let mut agent = PlanningAgent::new(ImpossiblePolicy, PlannerRules::paper());
    agent.reset(&briefing);
    while toy.frame < briefing.horizon {
        let action = agent.act(&toy.observe()).unwrap();
        assert!(action.is_locomotion(), "{action:?}");
        toy.apply(action);
        farthest_m = farthest_m.max(toy.here().distance(from));
    }
    assert!(farthest_m > 3.0, "{farthest_m} m");
}

#[test]
fn a_blocked_doorway_is_not_tried_endlessly() {
    // The doorway looks free, but the body is wider than it believes.
    let mut toy = Toy::room(10.0, 5.0);
    toy.add_wall([-0.05, -2.5], [0.05, -0.55]);
    toy.add_wall([-0.05, 0.55], [0.05, 2.5]);
    toy.radius_m = 0.6;
    toy.stand([-2.5, 0.0], 0.0);
    let mut briefing = toy.briefing();
    (briefing.capability.radius_m, briefing.horizon) = (0.35, 3000);
    let mut agent = helpers::rhp(crate::PlannerRules::paper(), &GroundTruthPerceptionFactory);
    agent.reset(&briefing);
    // The position from which it last moved more than half a meter, and the frame.
    let (mut from, mut since, mut longest) = (toy.here(), 0, 0);
    while toy.frame < briefing.horizon {
        toy.apply(agent.act(&toy.observe()).unwrap());
        if toy.here().distance(from) > 0.5 {
            (from, since) = (toy.here(), toy.frame);
        }
        longest = longest.max(toy.frame - since);
    }
    assert!(longest < 300, "{longest} frames at one place");
}

#[test]
fn turns_to_one_object_do_not_count_for_another() {
    let mut toy = Toy::room(6.0, 6.0);
    for x in [-1.0, 1.0] {
        toy.add(ToyObject::new("apple", [x, 0.5, -2.0], [0.16, 0.12, 0.16]));
    }
    toy.stand([0.0, 1.0], 0.0);
    let briefing = toy.briefing();
    let mut episode = Episode::new(&briefing, PlannerRules::paper());
    let observation = toy.observe();
    let percepts = GroundTruthIds.perceive(&observation);
    assert_eq!(percepts.detections.len(), 2);
    episode.memory.update(&briefing, &observation, &percepts);
    // The objects are behind it, and no image shows them.
    episode.memory.pose.yaw_rad = std::f32::consts::PI;
    let perception = PixelTargets::<GroundTruthIds>::default();
    let mut turns_to = |track: TrackId, n: u32| {
        let pick_up = Action::PickUp { object: track, hand: Hand::Left };
        (0..n).all(|_| episode.resolve(pick_up, &perception).is_some())
    };
    let [a, b] = [0, 1].map(|k| percepts.detections[k].track);
    assert!(turns_to(a, MAX_SEARCH_TURNS - 1));
    assert!(turns_to(b, MAX_SEARCH_TURNS));
    assert!(!turns_to(b, 1), "it turns forever");
}

#[test]
fn what_no_image_shows_is_viewed_from_other_sides_unless_it_is_small_and_high() {
    for (class, y, n_more_sides) in [("apple", 0.5, 1), ("apple", 2.0, 0), ("trashbin", 0.0, 3)] {
        let is_small = class == "apple";
        let mut toy = Toy::room(6.0, 6.0);
        let size = if is_small { [0.16, 0.12, 0.16] } else { [0.4, 0.6, 0.4] };
        let track = toy.add(ToyObject::new(class, [0.0, y, -2.0], size));
        toy.size = 256;
        toy.stand([0.0, 1.0], 0.0);
        let briefing = toy.briefing();
        let rules = PlannerRules { pick_within_m: MIN_PIXEL_TARGET_M, ..PlannerRules::paper() };
        let mut episode = Episode::new(&briefing, rules);
        episode.memory.needs_view = true;
        let subject = Subject { track, class: ClassId::named(class) };
        let plan = if is_small { Plan::PickUp(subject) } else { Plan::RemoveObstacle(subject) };
        let observe_and_step = |episode: &mut Episode, toy: &Toy| {
            let observation = toy.observe();
            let percepts = GroundTruthIds.perceive(&observation);
            episode.memory.update(&briefing, &observation, &percepts);
            match episode.step(&plan) {
                Progress::Act(intent) => intent,
                end => panic!("{end:?}"),
            }
        };
        let mut intent = observe_and_step(&mut episode, &toy);
        while intent.is_locomotion() {
            let target = |track| GroundTruthIds.target(track);
            toy.apply(resolve_target(intent, target).expect("every track has a target"));
            assert!(toy.frame < 200, "it does not arrive");
            intent = observe_and_step(&mut episode, &toy);
        }
        let is_available =
            |e: &Episode| e.memory.objects.get(track).unwrap().is_available(e.memory.frame);
        for _ in 0..n_more_sides {
            assert!(episode.views_from_elsewhere(intent), "{class} at {y} m");
            assert!(is_available(&episode));
            let walk = observe_and_step(&mut episode, &toy);
            assert!(walk.is_locomotion(), "{class}: {walk:?}");
        }
        assert!(!episode.views_from_elsewhere(intent), "it looks at {class} forever");
        assert!(!is_available(&episode));
    }
}
