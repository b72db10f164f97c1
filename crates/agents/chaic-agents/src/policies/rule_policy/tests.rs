//! The paper's rules in situations worked out by hand.

use super::*;
use crate::PlannerRules;
use crate::behavior::BehaviorLog;
use crate::behavior::ObservedInteraction;
use crate::decision::{filtered_plans, valid_plans};
use crate::memory::Memory;
use crate::test_support::{Toy, carried, hands, seen, seen_partner};
use crate::track::CarriedObject;
use chaic_core::briefing::Companion;
use chaic_core::rng::RngStream;
use chaic_core::{Action, AgentId, EntityId, Hand, Vec3};

fn subject(class: &str, track: u32) -> Subject {
    Subject { track: TrackId(track), class: ClassId::named(class) }
}

/// Situation and its expected plan.
struct Case {
    name: &'static str,
    frame: Frame,
    hands: [Option<CarriedObject>; 2],
    valid: Vec<Plan>,
    expected: Plan,
}

fn choose(profile: RuleProfile, case: &Case, log: &BehaviorLog) -> Plan {
    let mut briefing = Toy::room(4.0, 4.0).briefing();
    briefing.goal = Toy::goal(&[("apple", 3), ("banana", 2)]);
    // The empty map has no passages.
    let obstacle_choice = ObstacleChoice::All;
    let rules = crate::PlannerRules { obstacle_choice, ..crate::PlannerRules::paper() };
    let mut memory = Memory::new(&briefing, rules);
    memory.frame = case.frame;
    memory.hands = hands(case.hands.clone());
    let context =
        Context { briefing: &briefing, memory: &memory, behavior: log, is_explored: false };
    let mut rules = RulePolicy::new(profile);
    rules.has_looked_around = true;
    rules.decide(&context, &case.valid)
}

#[test]
fn the_partner_follows_the_rules_of_the_paper() {
    use Plan::*;
    let (apple, orange, banana) =
        (subject("apple", 20), subject("orange", 21), subject("banana", 22));
    let basket = subject("wicker_basket", 23);
    let hold = |class, n: u16| Some(carried(class, n, &[]));
    let fruit = ["apple"; 3];
    let cases = [
        Case {
            name: "nothing known: explore",
            frame: 100,
            hands: [None, None],
            valid: vec![Explore, TurnAround],
            expected: Explore,
        },
        Case {
            name: "more than half the time left: container first",
            frame: 1400,
            hands: [None, None],
            valid: vec![Explore, PickUp(apple), PickContainer(basket)],
            expected: PickContainer(basket),
        },
        Case {
            name: "less than half the time left: target first",
            frame: 1600,
            hands: [None, None],
            valid: vec![Explore, PickUp(apple), PickContainer(basket)],
            expected: PickUp(apple),
        },
        Case {
            name: "what the goal does not contain is ignored, though nearer",
            frame: 100,
            hands: [None, None],
            valid: vec![Explore, PickUp(orange), PickUp(banana), PickUp(apple)],
            expected: PickUp(banana),
        },
        Case {
            name: "put in whenever possible",
            frame: 2900,
            hands: [hold("apple", 40), hold("wicker_basket", 41)],
            valid: vec![Explore, PutIn, Deliver],
            expected: PutIn,
        },
        Case {
            name: "both hands full: deliver",
            frame: 500,
            hands: [hold("apple", 40), hold("apple", 41)],
            valid: vec![Explore, Deliver],
            expected: Deliver,
        },
        Case {
            name: "both hands full and no goal place known: explore",
            frame: 500,
            hands: [hold("apple", 40), hold("apple", 41)],
            valid: vec![Explore],
            expected: Explore,
        },
        Case {
            name: "one hand full: another target",
            frame: 1600,
            hands: [hold("apple", 40), None],
            valid: vec![Explore, Deliver, PickUp(apple)],
            expected: PickUp(apple),
        },
        Case {
            name: "less than 37.5 % left, no goal place known, carrying: explore",
            frame: 1900,
            hands: [hold("apple", 40), None],
            valid: vec![Explore, PickUp(apple)],
            expected: Explore,
        },
        Case {
            name: "a full basket leaves a hand for one more target",
            frame: 1000,
            hands: [Some(carried("wicker_basket", 41, &fruit[..1])), None],
            valid: vec![Explore, Deliver, PickUp(banana)],
            expected: PickUp(banana),
        },
        Case {
            name: "enough apples in hand: no more of them",
            frame: 1000,
            hands: [Some(carried("wicker_basket", 41, &fruit)), None],
            valid: vec![Explore, Deliver, PickUp(apple), PickUp(banana)],
            expected: PickUp(banana),
        },
        Case {
            name: "the partner clears no obstacles",
            frame: 1000,
            hands: [None, None],
            valid: vec![Explore, RemoveObstacle(subject("trashbin", 50))],
            expected: Explore,
        },
    ];
    for case in &cases {
        assert_eq!(
            choose(RuleProfile::PARTNER, case, &BehaviorLog::default()),
            case.expected,
            "{}",
            case.name
        );
    }
}

#[test]
fn helpers_remove_obstacles_first_and_pick_up_all_possible_targets() {
    let bin = subject("trashbin", 50);
    let orange = subject("orange", 21);
    let mut case = Case {
        name: "",
        frame: 100,
        hands: [None, None],
        valid: vec![Plan::Explore, Plan::PickUp(orange), Plan::RemoveObstacle(bin)],
        expected: Plan::RemoveObstacle(bin),
    };
    let log = BehaviorLog::default();
    assert_eq!(choose(RuleProfile::RHP, &case, &log), case.expected);
    case.valid.pop();
    assert_eq!(choose(RuleProfile::RHP, &case, &log), Plan::PickUp(orange));
    assert_eq!(
        choose(RuleProfile::ORACLE, &case, &log),
        Plan::Explore,
        "the goal contains no orange"
    );
}

#[test]
fn objects_held_by_the_partner_are_no_longer_needed_by_the_oracle() {
    let banana = subject("banana", 22);
    let case = Case {
        name: "",
        frame: 1600,
        hands: [None, None],
        valid: vec![Plan::Explore, Plan::PickUp(banana)],
        expected: Plan::PickUp(banana),
    };
    let mut log = BehaviorLog::default();
    assert_eq!(choose(RuleProfile::ORACLE, &case, &log), case.expected);
    let class = ClassId::named("banana");
    log.partner_holds = vec![(TrackId(60), class), (TrackId(61), class)];
    log.partner_holds_frame = Some(1500);
    assert_eq!(choose(RuleProfile::ORACLE, &case, &log), Plan::Explore);
}

#[test]
fn the_oracle_picks_up_the_heaviest_piece_it_can_lift_and_helps_with_heavier_ones() {
    let pieces: Vec<Subject> = ClassId::all()
        .filter(|c| c.info().role == Role::HeavyTarget)
        .zip(70..)
        .map(|(class, n)| Subject { track: TrackId(n), class })
        .collect();
    let mass = |s: &Subject| s.class.info().mass_kg;
    let heaviest = pieces
        .iter()
        .filter(|s| mass(s) <= 600.0)
        .max_by(|a, b| mass(a).total_cmp(&mass(b)))
        .expect("the catalogue has furniture light enough to lift");
    let too_heavy = pieces
        .iter()
        .find(|s| mass(s) > 600.0)
        .expect("the catalogue has furniture that is too heavy");
    let mut case = Case {
        name: "",
        frame: 100,
        hands: [None, None],
        valid: pieces.iter().map(|s| Plan::PickUp(*s)).collect(),
        expected: Plan::PickUp(*heaviest),
    };
    let profile = RuleProfile { target_filter: TargetFilter::AnyPossible, ..RuleProfile::ORACLE };
    let mut log = BehaviorLog::default();
    let Plan::PickUp(chosen) = choose(profile, &case, &log) else { panic!("it picks up") };
    assert_eq!(mass(&chosen), mass(heaviest));
    case.valid.push(Plan::LiftWith(*too_heavy));
    assert_eq!(choose(profile, &case, &log), Plan::LiftWith(*too_heavy));
    case.valid.pop();
    let lightest = pieces.iter().min_by(|a, b| mass(a).total_cmp(&mass(b))).expect("some");
    case.valid.push(Plan::LiftWith(*lightest));
    assert!(matches!(choose(profile, &case, &log), Plan::PickUp(_)), "no call for help");
    log.actions.push(ObservedInteraction {
        agent: AgentId::PARTNER,
        frame: 90,
        action: Action::PickUp { object: lightest.track, hand: Hand::Left },
        outcome: Some(Outcome::Failure(FailureReason::BeyondLimits)),
    });
    assert_eq!(choose(profile, &case, &log), Plan::LiftWith(*lightest));
}

const PIANO: TrackId = TrackId(50);
/// Strength that suffices for the piano, kilograms.
const STRONG_KG: f32 = 1000.0;

/// Returns what one hand holds, drawn at random.
fn random_load(rng: &mut RngStream, track: u16) -> Option<CarriedObject> {
    match rng.below(10) {
        0..6 => None,
        6 | 7 => Some(carried("apple", track, &[])),
        8 => Some(carried("orange", track, &[])),
        _ => Some(carried("wicker_basket", track, &["apple"; 3][..rng.below(4)])),
    }
}

/// Returns a briefing, a memory of objects, people and hands, and whether all space is explored.
fn random_situation(rng: &mut RngStream) -> (Briefing, Memory, bool) {
    let mut toy = Toy::room(8.0, 6.0);
    toy.size = 4;
    toy.frame = rng.below(3000) as Frame;
    let mut briefing = toy.briefing();
    briefing.goal = Toy::goal(&[("apple", rng.below(4) as u32), ("banana", rng.below(3) as u32)]);
    if rng.chance(0.15) {
        let child = Companion { agent: AgentId::CHILD, role: CompanionRole::Child };
        briefing.companions.push(child);
    }
    let body = &mut briefing.capability;
    // A strong body lifts the piano only if the partner calls for help.
    (body.strength_kg, body.lifts_furniture) = ([1.0, STRONG_KG][rng.below(2)], rng.chance(0.6));
    body.removes_obstacles = rng.chance(0.8);
    let rules = match rng.below(5) {
        0 => PlannerRules::compat(),
        // The empty map has no passages.
        _ => PlannerRules { obstacle_choice: ObstacleChoice::All, ..PlannerRules::paper() },
    };
    let mut memory = Memory::new(&briefing, rules);
    memory.frame = toy.frame;
    memory.pose.position = Vec3::new(rng.range(-3.0, 3.0), 0.0, rng.range(-2.0, 2.0));
    memory.hands = hands([random_load(rng, 40), random_load(rng, 41)]);
    let classes = ["apple", "banana", "orange", "wicker_basket", "trashbin", "bed"];
    let mut detections = Vec::new();
    for track in 20..20 + rng.below(8) as u32 {
        let at = [rng.range(-3.8, 3.8), 0.0, rng.range(-2.8, 2.8)];
        detections.push(seen(TrackId(track), classes[rng.below(classes.len())], at, 0.4, 0.4));
    }
    let (x, z) = (rng.range(-3.0, 3.0), rng.range(-2.0, 2.0));
    if rng.chance(0.7) {
        detections.push(seen(PIANO, "piano", [x, 0.0, z], 0.6, 1.0));
    }
    memory.objects.update(&detections, &[], 0, memory.frame);
    let mut people = vec![seen_partner(x + 1.0, z)];
    if briefing.companion(CompanionRole::Child).is_some() && rng.chance(0.7) {
        let child = EntityId::from_agent(AgentId::CHILD).into();
        let at = [rng.range(-3.8, 3.8), 0.0, rng.range(-2.8, 2.8)];
        people.push(seen(child, "person", at, 0.3, 1.2));
    }
    memory.people.update(&briefing, &toy.observe(), &people);
    memory.refresh();
    (briefing, memory, rng.chance(0.3))
}

/// Returns the partner's load and failed lift of the piano, recent or old, drawn at random.
fn random_behavior(rng: &mut RngStream, now: Frame) -> BehaviorLog {
    let mut log = BehaviorLog::default();
    let fruit = ["apple", "banana"].map(ClassId::named);
    if rng.chance(0.6) {
        let held = 60..60 + rng.below(4) as u32;
        log.partner_holds = held.map(|track| (TrackId(track), fruit[rng.below(2)])).collect();
        log.partner_holds_frame = Some(now.saturating_sub(rng.below(400) as Frame));
    }
    if rng.chance(0.8) {
        log.actions.push(ObservedInteraction {
            agent: AgentId::PARTNER,
            frame: now.saturating_sub(rng.below(400) as Frame),
            action: Action::PickUp { object: PIANO, hand: Hand::Left },
            outcome: Some(Outcome::Failure(FailureReason::BeyondLimits)),
        });
    }
    log
}

#[test]
fn the_filter_of_plans_and_shared_goal_places_change_no_choice() {
    let no_behavior = BehaviorLog::default();
    let profiles =
        [RuleProfile::PARTNER, RuleProfile::RIDER, RuleProfile::RHP, RuleProfile::ORACLE];
    let (mut n_omitted, mut n_late, mut n_help_requests, mut n_loads) = (0, 0, 0, 0);
    // Number of adopted plans by kind, without a current plan and during a pick-up.
    let mut n_adopted = [[0; Plan::KINDS.len()]; 2];
    for seed in 0..1000 {
        let mut rng = RngStream::new(seed, "rules with a filter", 0);
        let (briefing, memory, is_explored) = random_situation(&mut rng);
        let behavior = random_behavior(&mut rng, memory.frame);
        let context =
            Context { briefing: &briefing, memory: &memory, behavior: &behavior, is_explored };
        let mut policy = RulePolicy::new(profiles[rng.below(profiles.len())]);
        policy.has_looked_around = rng.chance(0.9);
        let all = valid_plans(&memory, &briefing);
        let without_behavior = Context { behavior: &no_behavior, ..context };
        let choices = [context, without_behavior].map(|c| policy.clone().decide(&c, &all));
        let is_strong = briefing.capability.strength_kg == STRONG_KG;
        let is_joint_lift = matches!(choices[0], Plan::LiftWith(_));
        n_help_requests += usize::from(is_strong && is_joint_lift);
        n_loads += usize::from(choices[0] != choices[1] && !is_joint_lift);
        let current_pick = all.iter().copied().find(Plan::is_pick);
        for current in [None, Some(Plan::Explore), current_pick] {
            let filter = policy.plan_filter(&context, current.as_ref());
            let some = filtered_plans(&memory, &briefing, &filter);
            n_omitted += all.len() - some.len();
            let [(expected, state), (plan, filtered_state)] = [&all, &some].map(|valid| {
                let mut policy = policy.clone();
                let plan = policy.decide(&context, valid);
                (plan, format!("{policy:?}"))
            });
            let adopted = |plan: Plan| current.is_none_or(|c| plan.supersedes(&c)).then_some(plan);
            let message = || format!("seed {seed}, during {current:?}: {plan} of {filter:?}");
            assert_eq!(adopted(plan), adopted(expected), "{}", message());
            assert_eq!(filtered_state, state, "{}", message());
            if let Some(plan) = adopted(plan).filter(|_| current != Some(Plan::Explore)) {
                n_adopted[usize::from(current.is_some())][plan.kind()] += 1;
            }
        }
        // The goal places are computed for each target.
        let hands = HandState::new(&memory.hands, &briefing);
        let need = RemainingNeeds::new(&context, &hands, &policy.profile);
        let mut expected: Vec<Subject> =
            all.iter().filter(|p| matches!(p, Plan::PickUp(_))).filter_map(Plan::subject).collect();
        expected.retain(|s| need.wants(s.class));
        let n_wanted = expected.len();
        expected.retain(|s| {
            !memory.rules.checks_time_to_deliver
                || has_time_for(&context, s.track, &memory.goal_places())
        });
        n_late += n_wanted - expected.len();
        assert_eq!(policy.wanted_targets(&context, &all), expected, "seed {seed}");
    }
    assert!(n_omitted > 1000 && n_late > 0, "{n_omitted} omitted, {n_late} late");
    let n_by_behavior = [n_help_requests, n_loads];
    assert!(n_by_behavior.iter().all(|n| *n > 0), "{n_by_behavior:?}");
    let [first, replacing] = n_adopted;
    let kinds = ["explore", "pick_up", "pick_container", "put_in", "deliver", "follow_child"];
    for name in kinds.into_iter().chain(["turn_around"]) {
        assert!(first[kind_index(name)] > 0, "{name}: {first:?}");
    }
    for name in ["deliver", "remove_obstacle", "lift_with", "follow_child", "turn_around"] {
        assert!(replacing[kind_index(name)] > 0, "{name}: {replacing:?}");
    }
}

fn kind_index(name: &str) -> usize {
    Plan::KINDS.iter().position(|kind| *kind == name).expect("a kind of plan")
}
