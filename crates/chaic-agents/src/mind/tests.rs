//! Whole minds in a toy house: they get things delivered, and never get stuck.

use super::*;
use crate::test_support::{Toy, ToyObject};
use crate::{helpers, partners};

/// Three rooms side by side with doors of 1.2 m, furniture, a bed and fruit; and the fruit.
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
fn the_partner_delivers_all_that_is_wanted_with_time_to_spare() {
    let (mut toy, n) = house();
    let mut briefing = toy.briefing();
    briefing.goal = Toy::goal(&[("apple", 3), ("banana", 2)]);
    let plans = toy.live(&mut partners::constrained(), &briefing);
    let story = plans.join("; ");
    assert!(toy.delivered.len() >= n, "{} delivered by {}: {story}", toy.delivered.len(), toy.frame);
    assert!(toy.frame < 2400, "{}: {story}", toy.frame);
    assert!(story.contains("container"), "{story}");
    assert!(toy.n_blocked <= 6, "bumped {} times", toy.n_blocked);
}

#[test]
fn rhp_clears_the_doorway_and_delivers_what_is_behind() {
    let mut toy = Toy::room(8.0, 5.0);
    toy.add_wall([-0.05, -2.5], [0.05, -0.6]);
    toy.add_wall([-0.05, 0.6], [0.05, 2.5]);
    let bin = toy.add(ToyObject::new("trashbin", [0.0, 0.0, 0.0], [0.7, 0.9, 0.9]));
    toy.add(ToyObject::new("bed", [-3.2, 0.0, -1.5], [1.4, 0.5, 1.6]));
    let apple = toy.add(ToyObject::new("apple", [3.0, 0.0, 1.5], [0.16, 0.12, 0.16]));
    toy.stand([-2.5, 1.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.horizon = 1500;
    let plans = toy.live(&mut helpers::rhp(), &briefing);
    assert!(plans.iter().any(|p| p.contains("obstacle")), "{plans:?}");
    assert!(toy.delivered.contains(&apple), "{plans:?}");
    assert!(!toy.delivered.contains(&bin));
}

#[test]
fn the_same_episode_is_lived_the_same_way_twice() {
    let [a, b] = [0, 1].map(|_| {
        let (mut toy, _) = house();
        let briefing = Briefing { horizon: 800, ..toy.briefing() };
        let plans = toy.live(&mut helpers::random(), &briefing);
        (plans, toy.here(), toy.frame)
    });
    assert_eq!(a, b);
}

#[test]
fn the_random_helper_chooses_all_valid_plans_equally_often() {
    use crate::policies::Random;
    let toy = Toy::room(4.0, 4.0);
    let (briefing, observation) = (toy.briefing(), toy.observe());
    let memory = Memory::new(&briefing);
    let behavior = GroundTruthBehavior::default();
    let context = Context {
        briefing: &briefing,
        memory: &memory,
        behavior: behavior.log(),
        own: &observation.own,
        is_explored: false,
    };
    let valid = [Plan::Explore, Plan::Deliver, Plan::TurnAround];
    let mut random = Random::default();
    random.reset(&briefing);
    let mut counts = [0; 3];
    for _ in 0..3000 {
        let plan = random.choose(&context, &valid);
        counts[valid.iter().position(|p| *p == plan).expect("valid")] += 1;
    }
    assert!(counts.iter().all(|c| (900..1100).contains(c)), "{counts:?}");
}

#[test]
fn an_unbriefed_or_blind_mind_does_not_panic() {
    let (toy, _) = house();
    let mut observation = toy.observe();
    let mut mind = helpers::rhp();
    assert_eq!(mind.act(&observation), Action::Wait { frames: PAUSE_FRAMES });
    mind.reset(&toy.briefing());
    observation.images = Default::default();
    for frame in 0..60 {
        observation.frame = frame;
        mind.act(&observation);
    }
}
