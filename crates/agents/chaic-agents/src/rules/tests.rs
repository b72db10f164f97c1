//! Each rule in which the original's planners differ, in a situation worked out by hand: every case
//! changes one rule of the paper's set. The random helper's draws are tested in its own file, and
//! the child's escapes in `child.rs`.

mod constants;
mod navigation;
mod other_agents;

use super::*;
use crate::behavior::BehaviorLog;
use crate::decision::{Context, Plan, Policy as _, Subject};
use crate::execution::interaction::apply_outcome;
use crate::execution::{ExecutionContext, Executor, Progress};
use crate::memory::{ActionRecord, Memory};
use crate::perception::{GroundTruthIds, Perception as _};
use crate::policies::{RulePolicy, RuleProfile};
use crate::test_support::{Toy, ToyObject, carried, hands};
use crate::track::{CarriedObject, TrackId};
use chaic_core::observation::Grants;
use chaic_core::{Action, ClassId, FailureReason, Hand, Outcome};

const PAPER: PlannerRules = PlannerRules::paper();

fn subject(class: &str, track: u32) -> Subject {
    Subject { track: TrackId(track), class: ClassId::named(class) }
}

/// Situation in which a decision is made.
struct Scenario {
    memory: Memory,
    briefing: Briefing,
    hands: [Option<CarriedObject>; 2],
    valid: Vec<Plan>,
}

impl Scenario {
    /// Creates a situation in which an apple and two bananas are needed and plenty of time is left.
    fn new(rules: PlannerRules) -> Scenario {
        let mut briefing = Toy::room(4.0, 4.0).briefing();
        briefing.goal = Toy::goal(&[("apple", 1), ("banana", 2)]);
        let mut memory = Memory::new(&briefing, rules);
        memory.frame = 100;
        Scenario { memory, briefing, hands: [None, None], valid: vec![Plan::Explore] }
    }

    /// Evaluates a function with a fresh partner policy.
    fn evaluate<T>(&self, function: impl Fn(&mut RulePolicy, &Context<'_>) -> T) -> T {
        self.evaluate_with(&mut RulePolicy::new(RuleProfile::PARTNER), function)
    }

    /// Evaluates a function with this policy.
    fn evaluate_with<T>(
        &self,
        policy: &mut RulePolicy,
        function: impl Fn(&mut RulePolicy, &Context<'_>) -> T,
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
        function(policy, &context)
    }

    /// Returns the partner's second choice, because the first may be to look around.
    fn choose(&self) -> Plan {
        self.choose_as(RuleProfile::PARTNER)
    }

    /// Returns the second choice of a policy with this profile.
    fn choose_as(&self, profile: RuleProfile) -> Plan {
        self.evaluate_with(&mut RulePolicy::new(profile), |rules, context| {
            rules.decide(context, &self.valid);
            rules.decide(context, &self.valid)
        })
    }

    /// Starts a plan and returns its first step.
    fn start_plan(&mut self, executor: &mut Executor, plan: Plan) -> Progress {
        executor.start_plan(self.memory.frame, &self.memory.rules);
        self.continue_plan(executor, plan)
    }

    /// Returns the next step of the same plan.
    fn continue_plan(&mut self, executor: &mut Executor, plan: Plan) -> Progress {
        self.memory.hands = hands(self.hands.clone());
        let briefing = &self.briefing;
        executor.step(&plan, &mut ExecutionContext { memory: &mut self.memory, briefing })
    }

    /// Returns the number of turns to look around.
    fn n_turns_around(&mut self) -> u32 {
        let mut executor = Executor::new(&self.briefing, &self.memory.rules);
        let mut progress = self.start_plan(&mut executor, Plan::TurnAround);
        let mut n = 0;
        while progress != Progress::Done {
            assert_eq!(progress, Progress::Act(Action::TurnLeft));
            progress = self.continue_plan(&mut executor, Plan::TurnAround);
            n += 1;
        }
        n
    }

    /// Replaces the memory by one observation of a toy world.
    fn observe(&mut self, toy: &Toy) {
        self.briefing.bounds = toy.bounds();
        let observation = toy.observe();
        self.memory = Memory::new(&self.briefing, self.memory.rules);
        let percepts = GroundTruthIds.perceive(&observation);
        self.memory.update(&self.briefing, &observation, &percepts);
    }
}

#[test]
fn the_first_plan_is_to_look_around() {
    for (initial_look_around, expected) in [(true, Plan::TurnAround), (false, Plan::Explore)] {
        let s = Scenario::new(PlannerRules { initial_look_around, ..PAPER });
        assert_eq!(s.evaluate(|rules, context| rules.decide(context, &s.valid)), expected);
    }
}

#[test]
fn a_plan_is_reconsidered_after_changes_or_not() {
    for replans in [true, false] {
        let s = Scenario::new(PlannerRules { replans, ..PAPER });
        let reconsidered =
            s.evaluate(|rules, context| rules.reconsiders(context, &Plan::Explore, true));
        assert_eq!(reconsidered, replans);
    }
}

#[test]
fn a_container_is_fetched_for_enough_objects_only() {
    let basket = Plan::PickContainer(subject("wicker_basket", 30));
    for (min_for_container, expected) in [(3, Plan::Explore), (0, basket)] {
        let mut s = Scenario::new(PlannerRules { min_for_container, ..PAPER });
        s.briefing.goal = Toy::goal(&[("apple", 1)]);
        s.valid.push(basket);
        assert_eq!(s.choose(), expected);
    }
}

#[test]
fn delivery_starts_when_nothing_is_left_or_only_when_time_is_short() {
    for (delivers_when_done, expected) in [(true, Plan::Deliver), (false, Plan::Explore)] {
        let mut s = Scenario::new(PlannerRules { delivers_when_done, ..PAPER });
        s.briefing.goal = Toy::goal(&[("apple", 1)]);
        s.hands[0] = Some(carried("apple", 30, &[]));
        s.valid.push(Plan::Deliver);
        assert_eq!(s.choose(), expected);
        s.memory.frame = s.briefing.horizon * 4 / 5;
        assert_eq!(s.choose(), Plan::Deliver);
    }
}

#[test]
fn only_a_class_needed_once_is_dropped_after_the_first_pick() {
    let choose = |bookkeeping, taken: &str, visible: Subject| {
        let mut s = Scenario::new(PlannerRules { bookkeeping, ..PAPER });
        // Seen and delivered earlier, by the agent itself.
        let mut toy = Toy::room(8.0, 8.0);
        let track = toy.add(ToyObject::new(taken, [0.0, 0.0, -2.5], [0.3, 0.3, 0.3]));
        toy.stand([0.0, 0.0], 0.0);
        let observation = toy.observe();
        s.memory.update(&s.briefing, &observation, &GroundTruthIds.perceive(&observation));
        let action = Action::PickUp { object: track, hand: Hand::Left };
        s.memory.history.push(ActionRecord { frame: 50, action, outcome: Outcome::Success });
        s.memory.delivered.extend([track]);
        s.valid.push(Plan::PickUp(visible));
        s.choose()
    };
    let (apple, banana) = (subject("apple", 60), subject("banana", 61));
    for bookkeeping in [Bookkeeping::Exact, Bookkeeping::FirstPick] {
        assert_eq!(choose(bookkeeping, "apple", apple), Plan::Explore, "one was needed");
        assert_eq!(choose(bookkeeping, "banana", banana), Plan::PickUp(banana));
        assert_eq!(choose(bookkeeping, "orange", apple), Plan::PickUp(apple));
    }
}

#[test]
fn distant_objects_are_ignored_for_lack_of_time() {
    let mut toy = Toy::room(12.0, 12.0);
    let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -3.0], [0.3, 0.3, 0.3]));
    toy.add(ToyObject::new("bed", [3.0, 0.0, -4.0], [1.0, 0.5, 1.0]));
    toy.stand([0.0, 0.0], 0.0);
    let apple = Plan::PickUp(subject("apple", apple.0));
    for (checks_time_to_deliver, expected) in [(true, Plan::Explore), (false, apple)] {
        let mut s = Scenario::new(PlannerRules { checks_time_to_deliver, ..PAPER });
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

/// Creates a memory that contains one object, 2.5 m ahead.
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
fn a_failure_makes_an_object_ignored_for_a_limited_time() {
    // Rules, reason of the failure, and frame from which the object is available again.
    let any = PlannerRules { any_failure_counts: true, ..PAPER };
    let longer = PlannerRules { seen_held_ignore_frames: 500, ..PAPER };
    for (rules, reason, from) in [
        (PAPER, FailureReason::OutOfReach, 0),
        (any, FailureReason::OutOfReach, 500),
        (PAPER, FailureReason::HeldByOther, 300),
        (longer, FailureReason::HeldByOther, 500),
    ] {
        let (mut memory, briefing, apple) = memory_of("apple", rules);
        let action = Action::PickUp { object: apple, hand: Hand::Left };
        apply_outcome(&mut memory, &briefing, (action, Outcome::Failure(reason)), &[], &[]);
        let object = memory.objects.get(apple).expect("seen");
        assert!(object.is_available(from), "{reason}");
        assert!(from == 0 || !object.is_available(from - 1), "{reason}");
    }
}

#[test]
fn a_goal_place_is_ignored_after_a_failed_put_on() {
    for (failed_goal_place_frames, expected) in [(0, [1, 1]), (500, [0, 1])] {
        let rules = PlannerRules { failed_goal_place_frames, ..PAPER };
        let (mut memory, briefing, bed) = memory_of("bed", rules);
        let action = Action::PutOn { place: bed, hand: Hand::Left };
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        apply_outcome(&mut memory, &briefing, (action, failed), &[], &[]);
        let known = [499, 500].map(|frame| {
            memory.frame = frame;
            memory.goal_places().len()
        });
        assert_eq!(known, expected);
    }
}

#[test]
fn a_failed_put_on_or_a_timeout_ends_the_delivery_and_the_place_is_ignored() {
    let deliver = |failed_goal_place_frames| {
        let rules = PlannerRules { failed_goal_place_frames, put_within_m: 5.0, ..PAPER };
        let (memory, briefing, bed) = memory_of("bed", rules);
        let mut s = Scenario::new(rules);
        (s.memory, s.briefing) = (memory, briefing);
        s.hands = [None, Some(carried("apple", 31, &[]))];
        let mut executor = Executor::new(&s.briefing, &rules);
        let act = s.start_plan(&mut executor, Plan::Deliver);
        assert_eq!(act, Progress::Act(Action::PutOn { place: bed, hand: Hand::Right }));
        (s, executor, bed)
    };
    for (failed_goal_place_frames, ends) in [(0, false), (500, true)] {
        // The left hand's put-on failed, and the right hand still holds an apple.
        let (mut s, mut executor, place) = deliver(failed_goal_place_frames);
        let last = (
            Action::PutOn { place, hand: Hand::Left },
            Outcome::Failure(FailureReason::BeyondLimits),
        );
        s.memory.last = Some(last);
        apply_outcome(&mut s.memory, &s.briefing, last, &[], &[]);
        let progress = s.continue_plan(&mut executor, Plan::Deliver);
        assert_eq!(progress == Progress::Failed, ends, "{progress:?}");
        assert_eq!(s.memory.goal_places().is_empty(), ends);

        let (mut s, mut executor, place) = deliver(failed_goal_place_frames);
        s.memory.frame += s.memory.rules.plan_timeouts.interact_frames + 1;
        assert_eq!(s.continue_plan(&mut executor, Plan::Deliver), Progress::Failed);
        assert_eq!(s.memory.goal_places().is_empty(), ends);
        // Without the rule, other places are preferred for a while.
        let ignored_frames = failed_goal_place_frames.max(PAPER.failures.unreachable_frames);
        let place = s.memory.objects.get(place).expect("seen");
        assert_eq!(place.ignore_until, s.memory.frame + ignored_frames);
        s.memory.frame += ignored_frames;
        assert_eq!(s.memory.goal_places().len(), 1);
    }
}

#[test]
fn a_plan_that_succeeds_at_its_time_limit_is_done() {
    let rules = PlannerRules {
        failed_goal_place_frames: 500,
        pick_within_m: 5.0,
        put_within_m: 5.0,
        ..PAPER
    };
    let late = rules.plan_timeouts.interact_frames + 1;
    for class in ["apple", "bed"] {
        let (memory, briefing, track) = memory_of(class, rules);
        let mut s = Scenario::new(rules);
        (s.memory, s.briefing) = (memory, briefing);
        let (plan, hand) = match class {
            "apple" => (Plan::PickUp(subject(class, track.0)), Hand::Left),
            _ => (Plan::Deliver, Hand::Right),
        };
        s.hands[1] = (plan == Plan::Deliver).then(|| carried("apple", 90, &[]));
        let mut executor = Executor::new(&s.briefing, &rules);
        let Progress::Act(action) = s.start_plan(&mut executor, plan) else {
            panic!("{class} is within reach");
        };
        assert_eq!((action.subject(), action.is_interaction()), (Some(track), true));
        (s.memory.last, s.hands[hand.index()]) = (Some((action, Outcome::Success)), None);
        s.memory.frame += late;
        assert_eq!(s.continue_plan(&mut executor, plan), Progress::Done);
        assert_eq!(s.memory.objects.get(track).expect("seen").ignore_until, 0, "{class}");
    }
}

#[test]
fn an_object_is_forgotten_at_an_empty_position_or_not() {
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
        assert_eq!(memory.objects.get(apple).expect("seen").is_present, !forgets_missing);
    }
}

#[test]
fn only_helpers_without_perfect_segmentation_miss_people_and_know_less() {
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
fn looking_around_takes_the_number_of_turns_in_the_rules() {
    for look_around_turns in [PAPER.look_around_turns, PlannerRules::compat().look_around_turns] {
        let mut s = Scenario::new(PlannerRules { look_around_turns, ..PAPER });
        assert_eq!(s.n_turns_around(), look_around_turns);
    }
}
