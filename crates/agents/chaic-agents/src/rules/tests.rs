//! Each rule in which the original's planners differ, against a situation worked out by hand: every
//! case flips one rule of the paper's set. What a random helper draws is tested beside it, and when
//! the child runs away in `child.rs`.

mod constants;
mod others;
mod walking;

use super::*;
use crate::behavior::BehaviorLog;
use crate::decision::{Context, Plan, Policy as _, Subject};
use crate::execution::interact::learn;
use crate::execution::{Executor, Progress, Situation};
use crate::memory::{Done, Memory};
use crate::perception::{GroundTruthIds, Perception as _};
use crate::policies::{RulePolicy, RuleProfile};
use crate::test_support::{Toy, ToyObject, carried, hands};
use crate::track::{Carried, TrackId};
use chaic_core::observation::Grants;
use chaic_core::{Action, ClassId, FailureReason, Hand, Outcome};

const PAPER: PlannerRules = PlannerRules::paper();

fn subject(class: &str, track: u32) -> Subject {
    Subject { track: TrackId(track), class: ClassId::named(class) }
}

/// A choice to make.
struct Situated {
    memory: Memory,
    briefing: Briefing,
    hands: [Option<Carried>; 2],
    valid: Vec<Plan>,
}

impl Situated {
    /// An apple and two bananas are wanted, and there is a lot of time.
    fn new(rules: PlannerRules) -> Situated {
        let mut briefing = Toy::room(4.0, 4.0).briefing();
        briefing.goal = Toy::goal(&[("apple", 1), ("banana", 2)]);
        let mut memory = Memory::new(&briefing, rules);
        memory.frame = 100;
        Situated { memory, briefing, hands: [None, None], valid: vec![Plan::Explore] }
    }

    /// What the partner answers who has (or has not) looked around already.
    fn ask<T>(&self, of: impl Fn(&mut RulePolicy, &Context<'_>) -> T) -> T {
        self.ask_of(&mut RulePolicy::new(RuleProfile::PARTNER), of)
    }

    /// What this one answers.
    fn ask_of<T>(
        &self,
        who: &mut RulePolicy,
        of: impl Fn(&mut RulePolicy, &Context<'_>) -> T,
    ) -> T {
        let behavior = BehaviorLog::default();
        let mut memory = self.memory.clone();
        memory.hands = hands(self.hands.clone());
        let context = Context {
            briefing: &self.briefing,
            memory: &memory,
            behavior: &behavior,
            is_explored: false,
        };
        of(who, &context)
    }

    /// The partner's second choice: at first, one may look around.
    fn choose(&self) -> Plan {
        self.choose_as(RuleProfile::PARTNER)
    }

    /// The second choice of somebody of this profile.
    fn choose_as(&self, profile: RuleProfile) -> Plan {
        self.ask_of(&mut RulePolicy::new(profile), |rules, context| {
            rules.decide(context, &self.valid);
            rules.decide(context, &self.valid)
        })
    }

    /// The first thing that carrying out a plan comes to.
    fn begin(&mut self, executor: &mut Executor, plan: Plan) -> Progress {
        executor.begin(self.memory.frame, &self.memory.rules);
        self.go_on(executor, plan)
    }

    /// What carrying out the same plan comes to next.
    fn go_on(&mut self, executor: &mut Executor, plan: Plan) -> Progress {
        self.memory.hands = hands(self.hands.clone());
        let briefing = &self.briefing;
        executor.step(&plan, &mut Situation { memory: &mut self.memory, briefing })
    }

    /// How often one turns when one looks all around.
    fn n_turns_around(&mut self) -> u32 {
        let mut executor = Executor::new(&self.briefing);
        let mut progress = self.begin(&mut executor, Plan::TurnAround);
        let mut n = 0;
        while progress != Progress::Done {
            assert_eq!(progress, Progress::Act(Action::TurnLeft));
            progress = self.go_on(&mut executor, Plan::TurnAround);
            n += 1;
        }
        n
    }

    /// Stands in a toy world and looks.
    fn look(&mut self, toy: &Toy) {
        self.briefing.bounds = toy.bounds();
        let observation = toy.observe();
        self.memory = Memory::new(&self.briefing, self.memory.rules);
        let percepts = GroundTruthIds.perceive(&observation);
        self.memory.update(&self.briefing, &observation, &percepts);
    }
}

#[test]
fn looking_around_first() {
    for (looks_around_first, expected) in [(true, Plan::TurnAround), (false, Plan::Explore)] {
        let s = Situated::new(PlannerRules { looks_around_first, ..PAPER });
        assert_eq!(s.ask(|rules, context| rules.decide(context, &s.valid)), expected);
    }
}

#[test]
fn a_plan_is_left_on_news_or_not() {
    for reconsiders in [true, false] {
        let s = Situated::new(PlannerRules { reconsiders, ..PAPER });
        let left = s.ask(|rules, context| rules.reconsiders(context, &Plan::Explore, true));
        assert_eq!(left, reconsiders);
    }
}

#[test]
fn a_container_for_a_single_object() {
    let basket = Plan::PickContainer(subject("wicker_basket", 30));
    for (min_for_container, expected) in [(3, Plan::Explore), (0, basket)] {
        let mut s = Situated::new(PlannerRules { min_for_container, ..PAPER });
        s.briefing.goal = Toy::goal(&[("apple", 1)]);
        s.valid.push(basket);
        assert_eq!(s.choose(), expected);
    }
}

#[test]
fn delivering_once_nothing_is_left_or_only_when_time_is_short() {
    for (delivers_when_done, expected) in [(true, Plan::Deliver), (false, Plan::Explore)] {
        let mut s = Situated::new(PlannerRules { delivers_when_done, ..PAPER });
        s.briefing.goal = Toy::goal(&[("apple", 1)]);
        s.hands[0] = Some(carried("apple", 30, &[]));
        s.valid.push(Plan::Deliver);
        assert_eq!(s.choose(), expected);
        s.memory.frame = s.briefing.horizon * 4 / 5;
        assert_eq!(s.choose(), Plan::Deliver);
    }
}

#[test]
fn a_class_wanted_once_is_dropped_after_the_first_pick_and_no_other_ever() {
    let choose = |bookkeeping, taken: &str, seen: Subject| {
        let mut s = Situated::new(PlannerRules { bookkeeping, ..PAPER });
        // Seen and delivered long ago, by oneself.
        let mut toy = Toy::room(8.0, 8.0);
        let track = toy.add(ToyObject::new(taken, [0.0, 0.0, -2.5], [0.3, 0.3, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let observation = toy.observe();
        s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
        let action = Action::PickUp { object: track, hand: Hand::Left };
        s.memory.history.push(Done { frame: 50, action, outcome: Outcome::Success });
        s.memory.delivered.extend([track]);
        s.valid.push(Plan::PickUp(seen));
        s.choose()
    };
    let (apple, banana) = (subject("apple", 60), subject("banana", 61));
    for bookkeeping in [Bookkeeping::Exact, Bookkeeping::FirstPick] {
        assert_eq!(choose(bookkeeping, "apple", apple), Plan::Explore, "one was wanted");
        assert_eq!(choose(bookkeeping, "banana", banana), Plan::PickUp(banana));
        assert_eq!(choose(bookkeeping, "orange", apple), Plan::PickUp(apple));
    }
}

#[test]
fn there_is_no_time_for_what_is_far_off() {
    let mut toy = Toy::room(12.0, 12.0);
    let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -3.0], [0.3, 0.3, 0.3]));
    toy.add(ToyObject::new("bed", [3.0, 0.0, -4.0], [1.0, 0.5, 1.0]));
    toy.stand([0.0, 0.0], 0.0);
    let apple = Plan::PickUp(subject("apple", apple.0));
    for (weighs_time, expected) in [(true, Plan::Explore), (false, apple)] {
        let mut s = Situated::new(PlannerRules { weighs_time, ..PAPER });
        s.briefing.bounds = toy.bounds();
        s.briefing.goal_places = vec![ClassId::named("bed")];
        s.memory = Memory::new(&s.briefing, s.memory.rules);
        let observation = toy.observe();
        s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
        s.memory.frame = s.briefing.horizon - 100;
        s.memory.refresh();
        s.valid.push(apple);
        assert_eq!(s.choose(), expected);
    }
}

/// A memory in which there is one thing, 2.5 m ahead.
fn memory_of(class: &str, rules: PlannerRules) -> (Memory, Briefing, TrackId) {
    let mut toy = Toy::room(8.0, 8.0);
    let track = toy.add(ToyObject::new(class, [0.0, 0.0, -2.5], [0.5, 0.5, 0.5]));
    toy.stand([0.0, 0.0], 0.0);
    let mut briefing = toy.briefing();
    briefing.goal_places = vec![ClassId::named(class)];
    let mut memory = Memory::new(&briefing, rules);
    let observation = toy.observe();
    memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
    (memory, briefing, track)
}

#[test]
fn what_is_left_alone_after_a_failure_and_for_how_long() {
    // Rules, why it failed; from which frame on it is available again.
    let any = PlannerRules { any_failure_counts: true, ..PAPER };
    let longer = PlannerRules { held_frames: 500, ..PAPER };
    for (rules, reason, from) in [
        (PAPER, FailureReason::OutOfReach, 0),
        (any, FailureReason::OutOfReach, 500),
        (PAPER, FailureReason::HeldByOther, 300),
        (longer, FailureReason::HeldByOther, 500),
    ] {
        let (mut memory, briefing, apple) = memory_of("apple", rules);
        let action = Action::PickUp { object: apple, hand: Hand::Left };
        learn(&mut memory, &briefing, (action, Outcome::Failure(reason)), &[], &[]);
        let thing = memory.things.get(apple).expect("seen");
        assert!(thing.is_available(from), "{reason}");
        assert!(from == 0 || !thing.is_available(from - 1), "{reason}");
    }
}

#[test]
fn the_goal_place_is_forgotten_after_a_failed_put() {
    for (goal_blackout_frames, expected) in [(0, [1, 1]), (500, [0, 1])] {
        let rules = PlannerRules { goal_blackout_frames, ..PAPER };
        let (mut memory, briefing, bed) = memory_of("bed", rules);
        let action = Action::PutOn { place: bed, hand: Hand::Left };
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        learn(&mut memory, &briefing, (action, failed), &[], &[]);
        let known = [499, 500].map(|frame| {
            memory.frame = frame;
            memory.goal_places().len()
        });
        assert_eq!(known, expected);
    }
}

#[test]
fn an_empty_place_proves_something_or_nothing() {
    for forgets_missing in [true, false] {
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -1.9], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, PlannerRules { forgets_missing, ..PAPER });
        for k in 0..5 {
            let observation = toy.observe();
            memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
            if k == 0 {
                toy.remove(apple);
            }
            toy.frame += 1;
        }
        assert_eq!(memory.things.get(apple).expect("seen").is_present, !forgets_missing);
    }
}

#[test]
fn only_helpers_without_perfect_eyes_see_nobody_and_know_less() {
    let rules = PlannerRules { helpers_see_people: false, helper_known_range_m: 3.0, ..PAPER };
    for (grants, sees, known_m) in [
        (Grants::IDS, false, 3.0),
        (Grants::PARTNER, true, 5.0),
        (Grants::ORACLE, true, 5.0),
        (Grants::CHILD, true, 5.0),
    ] {
        let briefing = Briefing { grants, ..Toy::room(4.0, 4.0).briefing() };
        assert_eq!((rules.sees_people(&briefing), rules.known_range_m(&briefing)), (sees, known_m));
        assert_eq!((PAPER.sees_people(&briefing), PAPER.known_range_m(&briefing)), (true, 5.0));
    }
}

#[test]
fn a_turn_around_is_as_long_as_the_rules_say() {
    for around_turns in [PAPER.around_turns, PlannerRules::compat().around_turns] {
        let mut s = Situated::new(PlannerRules { around_turns, ..PAPER });
        assert_eq!(s.n_turns_around(), around_turns);
    }
}
