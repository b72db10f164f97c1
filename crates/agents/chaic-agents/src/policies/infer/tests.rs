//! The inferring helper in a toy room, with detections chosen by hand.

use chaic_core::Outcome;
use chaic_core::rng::RngStream;

use super::*;
use crate::PlannerRules;
use crate::belief::{LAST_DELIVERY_FRAMES, PickUpEvidence};
use crate::decision::valid_plans;
use crate::perception::{Detection, Percepts};
use crate::test_support::{Toy, carried, hands, seen, seen_partner};

const BED: TrackId = TrackId(40);
const APPLE: TrackId = TrackId(41);
const BANANA: TrackId = TrackId(42);

fn bed() -> Detection {
    seen(BED, "bed", [-5.0, 0.0, -2.0], 1.4, 0.5)
}

fn apple() -> Detection {
    seen(APPLE, "apple", [3.0, 0.0, 0.0], 0.1, 0.1)
}

fn banana() -> Detection {
    seen(BANANA, "banana", [-1.0, 0.0, 1.0], 0.1, 0.1)
}

fn subject(track: TrackId, class: &str) -> Subject {
    Subject { track, class: ClassId::named(class) }
}

/// Policy in an episode; the helper stands in the middle of a room of 12 by 8 m.
struct Episode {
    toy: Toy,
    briefing: Briefing,
    memory: Memory,
    log: BehaviorLog,
    policy: InferPolicy,
    is_explored: bool,
}

impl Episode {
    fn new(options: InferOptions, change: impl FnOnce(&mut Briefing)) -> Episode {
        let toy = Toy::room(12.0, 8.0);
        let mut briefing = toy.briefing();
        change(&mut briefing);
        let memory = Memory::new(&briefing, PlannerRules::paper());
        let mut policy = InferPolicy::new(options);
        policy.reset(&briefing);
        let log = BehaviorLog::default();
        Episode { toy, briefing, memory, log, policy, is_explored: false }
    }

    /// Creates an episode in which the helper knows the layout and so need not look around.
    fn ready(options: InferOptions, change: impl FnOnce(&mut Briefing)) -> Episode {
        Episode::new(options, |briefing| {
            briefing.layout = Some(Toy::room(12.0, 8.0).layout());
            change(briefing);
        })
    }

    /// Observes and chooses; checks that the plan is valid.
    fn step(&mut self, frame: Frame, detections: &[Detection]) -> Plan {
        self.toy.frame = frame;
        let observation = self.toy.observe();
        let held = self.memory.hands.clone();
        let percepts =
            Percepts { detections: detections.to_vec(), hands: Some(held), ..Percepts::default() };
        self.memory.update(&self.briefing, &observation, &percepts);
        self.policy.observe(&observation, &self.memory, &self.log);
        self.memory.refresh();
        let context = Context {
            briefing: &self.briefing,
            memory: &self.memory,
            behavior: &self.log,
            is_explored: self.is_explored,
        };
        let valid = valid_plans(&self.memory, &self.briefing);
        let plan = self.policy.choose(&context, &valid).expect("it never fails");
        assert!(valid.contains(&plan), "{plan:?} is not among {valid:?}");
        plan
    }

    fn take(&mut self, track: u32, class: &str) {
        let take =
            PickUpEvidence { class: ClassId::named(class), strength: 1.0, frame: 0, top_m: None };
        let belief = self.policy.belief.as_mut().expect("the episode has begun");
        belief.evidence.taken.insert(TrackId(track), take);
    }

    fn mode(&self) -> String {
        self.policy.status().expect("it has one")
    }
}

fn apples(briefing: &mut Briefing) {
    briefing.goal = Toy::goal(&[("apple", 2)]);
}

#[test]
fn with_a_granted_goal_it_plans_as_soon_as_it_has_looked_around() {
    let mut episode = Episode::new(InferOptions::ALL, apples);
    let all = [bed(), apple(), banana(), seen_partner(1.0, -2.0)];
    assert_eq!(episode.step(0, &all), Plan::TurnAround);
    // The banana is nearer, but nobody wants it. The partner is not watched.
    assert_eq!(episode.step(50, &all), Plan::PickUp(subject(APPLE, "apple")));
    assert_eq!(episode.mode(), "plan");
    assert_eq!(episode.policy.identified, Some(50));
    // With full hands it delivers, with nothing to do it explores.
    episode.memory.hands =
        hands([Some(carried("apple", 60, &[])), Some(carried("apple", 61, &[]))]);
    assert_eq!(episode.step(60, &all), Plan::Deliver);
    let mut episode = Episode::ready(InferOptions::ALL, apples);
    assert_eq!(episode.step(0, &[bed(), banana()]), Plan::Explore, "no look around with a layout");
}

#[test]
fn the_description_has_posteriors_evidence_and_the_plans_of_both() {
    let mut episode = Episode::ready(InferOptions::ALL, house);
    let all = [bed(), apple(), banana(), seen_partner(1.0, -2.0)];
    episode.step(0, &all);
    let describe = |episode: &Episode| {
        let belief = episode.policy.partner_belief(&episode.briefing, &episode.memory);
        belief.expect("the episode has begun")
    };
    let before = describe(&episode);
    assert!(before.goals.iter().all(|(_, p)| *p == 250), "{:?}", before.goals);
    assert!(before.evidence.is_empty() && before.plan.is_empty(), "{before:?}");
    let sum: u16 = before.people.iter().map(|(_, p)| p).sum();
    assert!((998..=1002).contains(&sum), "{:?}", before.people);

    episode.take(60, "orange");
    episode.take(61, "orange");
    episode.step(10, &all);
    let after = describe(&episode);
    let fruit = after.goals.iter().find(|(name, _)| name == "fruit").expect("it is possible");
    assert!(fruit.1 > 900, "{:?}", after.goals);
    assert_eq!(after.evidence, [60, 61].map(|t| format!("took orange #{t} (98 % reliable)")));
    assert!(after.plan.iter().any(|step| step == "pick up banana #42"), "{:?}", after.plan);
    let partner = after.partner_plan.first().expect("the partner is known");
    assert!(partner.starts_with("pick up ") && partner.ends_with(" frames"), "{partner}");
    let [x, z] = after.position_cm.expect("it was seen");
    assert!((x - 100).abs() < 20 && (z + 200).abs() < 20, "{x} {z}");
}

#[test]
fn without_a_known_goal_place_it_picks_up_what_is_wanted() {
    let mut episode = Episode::ready(InferOptions::ALL, apples);
    assert_eq!(episode.step(0, &[apple(), banana()]), Plan::PickUp(subject(APPLE, "apple")));
}

/// All possible targets of houses, so that the goal is unclear at first.
fn house(briefing: &mut Briefing) {
    use chaic_core::catalogue::TargetSet::{Bread, Fruit, School, Work};
    let is_possible = |c: &ClassId| {
        let info = c.info();
        [Fruit, Bread, Work, School].iter().any(|s| info.sets.contains(s))
            || info.role == Role::Fragile
    };
    briefing.possible_targets = ClassId::all().filter(is_possible).collect();
}

#[test]
fn without_evidence_it_follows_a_visible_partner_and_explores_otherwise() {
    let fruit = vec![bed(), apple(), banana()];
    let with_partner = [fruit.clone(), vec![seen_partner(1.0, -2.0)]].concat();
    let mut episode = Episode::ready(InferOptions::ALL, house);
    assert_eq!(episode.step(0, &fruit), Plan::Explore, "never seen");
    assert_eq!(episode.step(10, &with_partner), Plan::FollowPartner);
    assert_eq!(episode.mode(), "watch");
    assert_eq!(episode.step(200, &fruit), Plan::FollowPartner, "seen 190 frames ago");
    assert_eq!(episode.step(210, &fruit), Plan::Explore, "lost");
    // It turns where it saw the partner last, or far from there.
    episode.memory.last = Some((Action::TurnLeft, Outcome::Success));
    for (position, is_far) in [([1.0, -1.0], false), ([-2.0, -1.0], true)] {
        episode.toy.stand(position, 0.0);
        assert_eq!(episode.step(300, &with_partner), Plan::FollowPartner);
        let plans: Vec<Plan> = (301..320).map(|frame| episode.step(frame, &fruit)).collect();
        assert!(plans[..17].iter().all(|plan| *plan == Plan::FollowPartner), "{plans:?}");
        let then = if is_far { Plan::FollowPartner } else { Plan::Explore };
        assert_eq!(plans[17..], [then, then], "after 18 turns");
    }
    assert_eq!(episode.policy.identified, None);
    let options = InferOptions::WITHOUT_FOLLOWING;
    let mut episode = Episode::ready(options, house);
    assert_eq!(episode.step(10, &with_partner), Plan::Explore, "it never watches");
}

#[test]
fn while_the_goal_is_unclear_it_still_empties_full_hands() {
    let mut episode = Episode::ready(InferOptions::ALL, house);
    episode.memory.hands = hands([Some(carried("apple", 60, &[])), Some(carried("pen", 61, &[]))]);
    assert_eq!(episode.step(0, &[bed(), apple(), seen_partner(1.0, -2.0)]), Plan::Deliver);
}

#[test]
fn takes_of_fruit_make_it_fetch_fruit() {
    let pen = seen(TrackId(43), "pen", [-0.5, 0.0, 0.5], 0.1, 0.1);
    let all = [bed(), apple(), pen, seen_partner(1.0, -2.0)];
    for (uses_team_planner, mode) in [(true, "plan"), (false, "rules")] {
        let mut episode =
            Episode::ready(InferOptions { uses_team_planner, ..InferOptions::ALL }, house);
        assert_eq!(episode.step(0, &all), Plan::FollowPartner);
        episode.take(60, "apple");
        episode.take(61, "orange");
        // The pen is nearer.
        assert_eq!(episode.step(10, &all), Plan::PickUp(subject(APPLE, "apple")));
        assert_eq!(episode.mode(), mode);
        assert_eq!(episode.policy.identified, Some(10));
        let belief = episode.policy.belief.as_ref().expect("the episode has begun");
        assert_eq!(belief.evidence.taken.len(), 2);
    }
}

#[test]
fn late_in_the_episode_it_acts_without_a_clear_goal() {
    let all = [bed(), apple(), seen_partner(1.0, -2.0)];
    let mut episode = Episode::ready(InferOptions::ALL, house);
    let horizon = episode.briefing.horizon;
    // An object vanished, which may have been overlooked.
    let class = ClassId::named("apple");
    let take = PickUpEvidence { class, strength: 0.3, frame: 0, top_m: None };
    let belief = episode.policy.belief.as_mut().expect("the episode has begun");
    belief.evidence.taken.insert(TrackId(60), take);
    for fraction in [0.0, 0.2] {
        episode.step((fraction * horizon as f32) as Frame, &all);
        assert_eq!(episode.mode(), "watch", "{fraction}");
    }
    assert_eq!(episode.step(horizon / 2, &all), Plan::PickUp(subject(APPLE, "apple")));
}

#[test]
fn objects_of_improbable_sets_are_not_fetched() {
    let bread = seen(TrackId(44), "bread", [1.0, 0.0, 0.5], 0.1, 0.1);
    let mut episode = Episode::ready(InferOptions::ALL, house);
    episode.take(60, "apple");
    // Fruit has about 0.85, each other set 0.05.
    let plan = episode.step(10, &[bed(), bread.clone(), seen_partner(1.0, -2.0)]);
    assert_eq!((plan, episode.mode()), (Plan::Explore, "plan".to_owned()));
    let all = [bed(), bread, apple(), seen_partner(1.0, -2.0)];
    assert_eq!(episode.step(20, &all), Plan::PickUp(subject(APPLE, "apple")));
}

#[test]
fn a_pick_is_switched_only_for_a_gain() {
    let mut episode = Episode::ready(InferOptions::ALL, |briefing| {
        briefing.goal = Toy::goal(&[("apple", 1), ("banana", 1)]);
    });
    let (to_apple, to_banana) =
        (Plan::PickUp(subject(APPLE, "apple")), Plan::PickUp(subject(BANANA, "banana")));
    assert_eq!(episode.step(0, &[bed(), apple()]), to_apple);
    // The same again: nothing is gained by another object.
    assert_eq!(episode.step(100, &[bed(), apple()]), to_apple);
    assert!(!episode.policy.supersedes(&to_banana, &to_apple));
    // A second object in the same trip is one more delivery.
    episode.step(200, &[bed(), apple(), banana()]);
    assert!(episode.policy.supersedes(&to_banana, &to_apple));
    assert!(!episode.policy.supersedes(&to_apple, &to_apple), "the same object");
    // Once it is planned, it is no further gain.
    episode.step(300, &[bed(), apple(), banana()]);
    assert!(!episode.policy.supersedes(&to_banana, &to_apple));
    // A delivery interrupts a walk. Idle plans replace each other, but not themselves.
    assert!(episode.policy.supersedes(&Plan::Deliver, &to_apple));
    assert!(episode.policy.supersedes(&to_apple, &Plan::Explore));
    assert!(!episode.policy.supersedes(&Plan::Explore, &to_apple));
    assert!(episode.policy.supersedes(&Plan::FollowPartner, &Plan::Explore));
    assert!(episode.policy.supersedes(&Plan::Explore, &Plan::FollowPartner));
    assert!(!episode.policy.supersedes(&Plan::Explore, &Plan::Explore));
}

#[test]
fn walks_and_idle_plans_are_reconsidered_after_a_while() {
    let mut episode = Episode::ready(InferOptions::ALL, house);
    episode.step(0, &[bed(), apple(), seen_partner(1.0, -2.0)]);
    let mut reconsiders = |frame: Frame, plan: Plan, has_changed: bool| {
        episode.memory.frame = frame;
        let context = Context {
            briefing: &episode.briefing,
            memory: &episode.memory,
            behavior: &episode.log,
            is_explored: false,
        };
        episode.policy.reconsiders(&context, &plan, has_changed)
    };
    let pick = Plan::PickUp(subject(APPLE, "apple"));
    for (frame, plan, has_changed, expected) in [
        (59, Plan::FollowPartner, false, false),
        (59, Plan::FollowPartner, true, true),
        (60, Plan::Explore, false, true),
        (79, pick, true, false),
        (80, pick, true, true),
        (80, pick, false, false),
        (500, Plan::TurnAround, true, false),
        (500, Plan::PutIn, true, false),
        (500, Plan::Deliver, true, false),
    ] {
        assert_eq!(reconsiders(frame, plan, has_changed), expected, "{frame} {plan:?}");
    }
    // Clear evidence ends the watch at once.
    episode.take(60, "apple");
    episode.take(61, "orange");
    let belief = episode.policy.belief.as_mut().expect("the episode has begun");
    belief.goal.update(&belief.evidence, &belief.constraint);
    episode.memory.frame = 10;
    let (log, briefing, memory) = (&episode.log, &episode.briefing, &episode.memory);
    let context = Context { briefing, memory, behavior: log, is_explored: false };
    assert!(episode.policy.reconsiders(&context, &Plan::FollowPartner, false));
}

#[test]
fn scenes_with_furniture_use_the_rules() {
    let furniture = |briefing: &mut Briefing| {
        briefing.possible_targets = ["drawer", "sofa"].map(ClassId::named).to_vec();
        briefing.goal_places = vec![ClassId::named("truck")];
        briefing.containers.clear();
    };
    let all = [
        seen(TrackId(50), "drawer", [2.0, 0.0, 0.0], 0.8, 1.0),
        seen(TrackId(51), "truck", [-4.0, 0.0, 0.0], 2.0, 1.2),
        seen_partner(1.0, -2.0),
    ];
    let mut episode = Episode::ready(InferOptions::ALL, furniture);
    let mut rules = RulePolicy::new(RuleProfile::ORACLE);
    rules.reset(&episode.briefing);
    for frame in [0, 100] {
        let plan = episode.step(frame, &all);
        assert_eq!(episode.mode(), "rules");
        let context = Context {
            briefing: &episode.briefing,
            memory: &episode.memory,
            behavior: &episode.log,
            is_explored: false,
        };
        let valid = valid_plans(&episode.memory, &episode.briefing);
        assert_eq!(plan, rules.decide(&context, &valid), "{frame}");
        let changed = [true, false].map(|c| {
            (episode.policy.reconsiders(&context, &plan, c), rules.reconsiders(&context, &plan, c))
        });
        assert!(changed.iter().all(|(ours, theirs)| ours == theirs), "{changed:?}");
    }
}

#[test]
fn only_high_goal_places_are_used_while_the_partner_may_be_a_child() {
    let low = |episode: &Episode| episode.policy.goal_place_min_top_m(&episode.memory);
    let mut told = Episode::ready(InferOptions::ALL, apples);
    told.step(0, &[bed()]);
    assert_eq!(low(&told), None, "the briefing says it");
    let options = InferOptions::NO_CONSTRAINT;
    let mut adult = Episode::ready(options, house);
    adult.step(0, &[bed()]);
    assert_eq!(low(&adult), None);
    let mut episode = Episode::ready(InferOptions::ALL, house);
    episode.step(0, &[bed()]);
    assert_eq!(low(&episode), Some(0.0), "nobody was seen");
    let child = Detection { top_m: 1.2, ..seen_partner(1.0, -2.0) };
    episode.step(20, &[bed(), child.clone()]);
    assert_eq!(low(&episode), Some(1.5), "as small as a child");
    let late = episode.briefing.horizon - LAST_DELIVERY_FRAMES + 20;
    episode.step(late, &[bed(), child]);
    assert_eq!(low(&episode), Some(0.0), "the time is short, and all known places are low");
}

#[test]
fn an_empty_list_of_targets_leads_to_exploration() {
    let mut episode = Episode::new(InferOptions::ALL, |b| b.possible_targets.clear());
    assert_eq!(episode.step(0, &[bed(), apple()]), Plan::TurnAround);
    assert_eq!(episode.step(50, &[bed(), apple()]), Plan::Explore);
    assert_eq!(episode.step(100, &[bed(), seen_partner(1.0, -2.0)]), Plan::FollowPartner);
}

#[test]
fn contradictory_takes_still_lead_to_valid_plans() {
    for options in [InferOptions::ALL, InferOptions::NO_PLANNER] {
        let mut episode = Episode::ready(options, house);
        let all = [bed(), apple(), banana(), seen_partner(1.0, -2.0)];
        let classes = episode.briefing.possible_targets.clone();
        for (k, class) in (0..).zip(classes) {
            episode.take(60 + k, class.name());
            episode.step(10 * k, &all);
        }
    }
}

#[test]
fn every_plan_of_random_episodes_is_valid() {
    let mut rng = RngStream::new(5, "infer test", 0);
    let parts = [(true, true, true), (false, true, true), (true, false, true), (true, true, false)];
    for case in 0..12 {
        let (follows_partner, infers_constraint, uses_team_planner) = parts[case % parts.len()];
        let options = InferOptions { follows_partner, infers_constraint, uses_team_planner };
        let mut episode = Episode::new(options, |briefing| match case % 3 {
            0 => house(briefing),
            1 => apples(briefing),
            _ => (),
        });
        let names = ["apple", "banana", "pen", "vase", "wicker_basket", "trashbin", "bed"];
        for frame in (0..3200).step_by(160) {
            let mut all = Vec::new();
            for k in 0..rng.below(8) as u32 {
                let (x, z) = (rng.range(-5.5, 5.5), rng.range(-3.5, 3.5));
                let name = names[(k as usize + case) % names.len()];
                all.push(seen(TrackId(40 + k), name, [x, 0.0, z], 0.2, rng.range(0.1, 2.0)));
            }
            if rng.chance(0.5) {
                all.push(seen_partner(rng.range(-5.0, 5.0), rng.range(-3.0, 3.0)));
            }
            if rng.chance(0.3) {
                let hand = |rng: &mut RngStream, track| {
                    rng.choose(&names[..5]).map(|name| carried(name, track, &[]))
                };
                let held = [hand(&mut rng, 80), hand(&mut rng, 81).filter(|_| frame % 320 == 0)];
                episode.memory.hands = hands(held);
            }
            if rng.chance(0.3) {
                episode.log.partner_holds = vec![(TrackId(40), ClassId::named("apple"))];
                episode.log.partner_holds_frame = Some(frame);
            }
            episode.is_explored = rng.chance(0.5);
            episode.step(frame, &all);
        }
    }
}

#[test]
fn a_copy_continues_identically() {
    let all = [bed(), apple(), banana()];
    let mut episode = Episode::ready(InferOptions::ALL, apples);
    episode.step(0, &all);
    let copy = episode.policy.fork().expect("it can be copied");
    let plan = episode.step(100, &all);
    let steps = std::mem::replace(&mut episode.policy, copy).steps;
    assert_eq!(episode.step(100, &all), plan);
    assert_eq!(episode.policy.steps, steps);
}
