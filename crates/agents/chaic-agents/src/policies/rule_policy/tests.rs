//! The paper's rules in situations worked out by hand.

use super::*;
use crate::behavior::BehaviorLog;
use crate::behavior::ObservedInteraction;
use crate::memory::Memory;
use crate::test_support::{Toy, carried, hands};
use crate::track::Carried;
use chaic_core::{Action, AgentId, Hand};

fn subject(class: &str, track: u32) -> Subject {
    Subject { track: TrackId(track), class: ClassId::named(class) }
}

/// Situation and its expected plan.
struct Case {
    name: &'static str,
    frame: Frame,
    hands: [Option<Carried>; 2],
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
