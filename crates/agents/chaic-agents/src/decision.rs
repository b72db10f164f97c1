//! What to do next: the plans, which of them are valid, and who chooses.

use std::collections::BTreeMap;
use std::fmt;

use chaic_core::briefing::Relation;
use chaic_core::geom::xz;
use chaic_core::{AgentError, Briefing, ClassId, Frame, Hand, Observation, Role};

use crate::behavior::BehaviorLog;
use crate::mapping::Thing;
use crate::memory::Memory;
use crate::track::{Carried, Hands, TrackId};

/// One object that a plan is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Subject {
    /// Which one.
    pub track: TrackId,
    /// Its class.
    pub class: ClassId,
}

impl Subject {
    fn of(thing: &Thing) -> Subject {
        Subject { track: thing.track, class: thing.class }
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.class.info().label, self.track)
    }
}

/// A subgoal that takes many actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Plan {
    /// Find out more of the place.
    Explore,
    /// Take a target.
    PickUp(Subject),
    /// Take a container.
    PickContainer(Subject),
    /// Put the target in one hand into the container in the other.
    PutIn,
    /// Bring what is carried to the goal place.
    Deliver,
    /// Clear an obstacle away.
    RemoveObstacle(Subject),
    /// Lift a piece of furniture together with the partner who is at it.
    LiftWith(Subject),
    /// Stay near the partner.
    FollowPartner,
    /// Go to the child.
    FollowChild,
    /// Look all around.
    TurnAround,
    /// Stand still for a moment.
    Wait,
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Plan::Explore => f.write_str("explore"),
            Plan::PickUp(it) => write!(f, "go to {it} and pick it up"),
            Plan::PickContainer(it) => write!(f, "go to container {it} and pick it up"),
            Plan::PutIn => f.write_str("put what one hand holds into the container in the other"),
            Plan::Deliver => f.write_str("bring what is carried to the goal place"),
            Plan::RemoveObstacle(it) => write!(f, "remove the obstacle {it}"),
            Plan::LiftWith(it) => write!(f, "lift {it} together with the partner"),
            Plan::FollowPartner => f.write_str("follow the partner"),
            Plan::FollowChild => f.write_str("follow the child"),
            Plan::TurnAround => f.write_str("turn around"),
            Plan::Wait => f.write_str("wait"),
        }
    }
}

impl Plan {
    /// What kinds of plans there are called, by [`Plan::kind`].
    pub const KINDS: [&str; 11] = [
        "explore",
        "pick_up",
        "pick_container",
        "put_in",
        "deliver",
        "remove_obstacle",
        "lift_with",
        "follow_partner",
        "follow_child",
        "turn_around",
        "wait",
    ];

    /// Its place in [`Plan::KINDS`].
    pub fn kind(&self) -> usize {
        match self {
            Plan::Explore => 0,
            Plan::PickUp(_) => 1,
            Plan::PickContainer(_) => 2,
            Plan::PutIn => 3,
            Plan::Deliver => 4,
            Plan::RemoveObstacle(_) => 5,
            Plan::LiftWith(_) => 6,
            Plan::FollowPartner => 7,
            Plan::FollowChild => 8,
            Plan::TurnAround => 9,
            Plan::Wait => 10,
        }
    }

    /// What it is about, if it is about one thing.
    pub fn subject(&self) -> Option<Subject> {
        match self {
            Plan::PickUp(it)
            | Plan::PickContainer(it)
            | Plan::RemoveObstacle(it)
            | Plan::LiftWith(it) => Some(*it),
            _ => None,
        }
    }

    /// Whether a plan under way should make room for this one, when both come from the same
    /// policy: nothing is dropped for more of the same, a walk to an object for another, or
    /// anything for having nothing to do.
    pub fn supersedes(&self, current: &Plan) -> bool {
        let is_pick = |p: &Plan| matches!(p, Plan::PickUp(_) | Plan::PickContainer(_));
        let is_idle = matches!(self, Plan::Explore | Plan::FollowPartner | Plan::Wait);
        let same = std::mem::discriminant(self) == std::mem::discriminant(current);
        !(same || is_idle || is_pick(current) && is_pick(self))
    }
}

/// What the hands hold, as far as decisions care.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HandState {
    /// A hand with nothing in it.
    pub free_hand: Option<Hand>,
    /// Whether a container is in hand.
    pub has_container: bool,
    /// Possible targets carried, those in containers and baskets included.
    pub targets: Vec<(TrackId, ClassId)>,
    /// Whether another target can be taken.
    pub can_take_target: bool,
    /// Whether a container can be taken.
    pub can_take_container: bool,
    /// Whether one hand holds a target and the other a container with room.
    pub can_put_in: bool,
    /// A hand that holds something to bring to the goal place.
    pub to_deliver: Option<Hand>,
}

impl HandState {
    /// What these hands of the briefing's reader carry.
    pub fn of(hands: &Hands, briefing: &Briefing) -> HandState {
        let capacity = briefing.container_capacity;
        let is_target = |class: ClassId| briefing.possible_targets.contains(&class);
        let role = |held: &Carried| held.class().map(|c| c.info().role);
        let is_container = |held: &Carried| role(held) == Some(Role::Container);
        let basket = hands.held().find(|h| role(h) == Some(Role::Vehicle));
        let is_moving =
            briefing.possible_targets.iter().any(|c| c.info().role == Role::HeavyTarget);
        let body = &briefing.capability;
        let is_free = |h: &Hand| hands.hands[h.index()].is_none();
        let free_hand = body.hands.all().iter().copied().find(is_free);
        let has_container = hands.held().any(is_container);
        let can_put_in = Hand::BOTH.into_iter().any(|hand| {
            let [one, other] = [hand, hand.other()].map(|h| hands.hands[h.index()].as_ref());
            one.is_some_and(|h| is_container(h) && h.n_contents < capacity)
                && other.is_some_and(|h| h.class().is_some_and(is_target) && !is_container(h))
        });
        let can_take_target = match basket {
            Some(basket) => basket.n_contents < capacity,
            None if is_moving => body.lifts_furniture && hands.held().next().is_none(),
            None => free_hand.is_some(),
        };
        // What nobody knows is got rid of at the goal place, too.
        let carries = |h: &Carried| h.what.is_none() || h.all().any(|(_, class)| is_target(class));
        HandState {
            free_hand,
            has_container,
            targets: hands.all().filter(|(_, class)| is_target(*class)).collect(),
            can_take_target,
            can_take_container: basket.is_none()
                && body.carries_containers
                && !has_container
                && free_hand.is_some(),
            can_put_in,
            to_deliver: Hand::BOTH
                .into_iter()
                .find(|hand| hands.hands[hand.index()].as_ref().is_some_and(carries)),
        }
    }
}

/// All that a decision may rest on.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// What the mind was told.
    pub briefing: &'a Briefing,
    /// What it remembers; distances are up to date when a choice is asked for.
    pub memory: &'a Memory,
    /// What it knows of the others' doings.
    pub behavior: &'a BehaviorLog,
    /// Whether everything that can be got to has been explored.
    pub is_explored: bool,
}

/// Chooses among valid plans.
pub trait Policy: Send + 'static {
    /// Begins an episode.
    fn reset(&mut self, briefing: &Briefing);

    /// The plan to follow next. `valid` is never empty, and holds the plans of one kind nearest
    /// first.
    ///
    /// # Errors
    /// If it can't choose; its mind decides nothing then.
    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError>;

    /// Whether to choose anew although `current` is not finished. `is_news` says that something
    /// has come up since the last choice. The new choice is taken if it [supersedes] the current
    /// plan.
    ///
    /// [supersedes]: Plan::supersedes
    fn reconsiders(&mut self, _context: &Context<'_>, _current: &Plan, _is_news: bool) -> bool {
        false
    }

    /// Sees what its mind sees, before each action; for those who look at pictures, or at what changes, themselves.
    fn look(&mut self, _observation: &Observation, _memory: &Memory, _behavior: &BehaviorLog) {}

    /// For how many frames its body stands still before the plan just chosen is begun.
    fn thinking_frames(&self) -> Frame {
        0
    }

    /// A short word for its state, if it has one.
    fn mood(&self) -> Option<String> {
        None
    }

    /// What it counted in this episode, by name.
    fn counts(&self) -> BTreeMap<String, u64> {
        BTreeMap::new()
    }

    /// A copy that goes on as this one would; `None` if it can't be copied.
    fn fork(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// Every plan that can be begun now, those of one kind nearest first. Never empty.
pub fn valid_plans(memory: &Memory, briefing: &Briefing) -> Vec<Plan> {
    let hands = HandState::of(&memory.hands, briefing);
    let mut plans = vec![Plan::Explore];
    if hands.can_put_in {
        plans.push(Plan::PutIn);
    }
    if hands.to_deliver.is_some() && !memory.goal_places().is_empty() {
        plans.push(Plan::Deliver);
    }
    if hands.can_take_target {
        plans.extend(reachable(memory, &briefing.possible_targets).map(Plan::PickUp));
    }
    if hands.can_take_container {
        plans.extend(reachable(memory, &briefing.containers).map(Plan::PickContainer));
    }
    if hands.free_hand.is_some() && briefing.capability.removes_obstacles {
        plans.extend(reachable(memory, &briefing.obstacles).map(Plan::RemoveObstacle));
    }
    if briefing.capability.lifts_furniture && memory.hands.held().next().is_none() {
        plans.extend(pieces_at_partner(memory, briefing).map(Plan::LiftWith));
    }
    if memory.companion(briefing, Relation::Partner).is_some() {
        plans.push(Plan::FollowPartner);
    }
    if memory.companion(briefing, Relation::Child).is_some() {
        plans.push(Plan::FollowChild);
    }
    plans.push(Plan::TurnAround);
    plans
}

/// Available things of these classes that one can get to, nearest first.
fn reachable<'a>(
    memory: &'a Memory,
    classes: &[ClassId],
) -> impl Iterator<Item = Subject> + use<'a> {
    let mut found: Vec<(f32, &Thing)> = memory
        .things
        .iter()
        .filter(|t| classes.contains(&t.class) && t.is_available(memory.frame))
        .filter_map(|t| Some((memory.way_to(t)?, t)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, t)| Subject::of(t))
}

/// Furniture that the partner stands at.
fn pieces_at_partner<'a>(
    memory: &'a Memory,
    briefing: &Briefing,
) -> impl Iterator<Item = Subject> + use<'a> {
    let rules = memory.rules.lifting;
    let partner = memory
        .companion(briefing, Relation::Partner)
        .filter(|p| p.frame + rules.at_piece_frames > memory.frame)
        .map(|p| xz(p.position_in_world));
    memory
        .things
        .iter()
        .filter(|t| t.class.info().role == Role::HeavyTarget && t.is_available(memory.frame))
        .filter(move |t| partner.is_some_and(|p| t.distance_from(p) < rules.at_piece_m))
        .map(Subject::of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{carried, hands};

    fn briefing() -> Briefing {
        crate::test_support::Toy::room(4.0, 4.0).briefing()
    }

    #[test]
    fn what_hands_allow() {
        let apple = || Some(carried("apple", 30, &[]));
        let basket =
            |n: usize| Some(carried("wicker_basket", 31, &["apple", "apple", "apple"][..n]));
        let bike = |n: usize| Some(carried("bike", 32, &["apple", "apple", "apple"][..n]));
        // Hands; can take a target, take a container, put in; has something to deliver.
        for (held, expected) in [
            ([None, None], [true, true, false, false]),
            ([apple(), None], [true, true, false, true]),
            ([apple(), apple()], [false, false, false, true]),
            ([basket(0), None], [true, false, false, false]),
            ([basket(0), apple()], [false, false, true, true]),
            ([apple(), basket(2)], [false, false, true, true]),
            ([basket(3), apple()], [false, false, false, true]),
            ([basket(3), None], [true, false, false, true]),
            ([bike(0), None], [true, false, false, false]),
            ([bike(2), None], [true, false, false, true]),
            ([bike(3), None], [false, false, false, true]),
        ] {
            let hands = HandState::of(&hands(held.clone()), &briefing());
            let got = [
                hands.can_take_target,
                hands.can_take_container,
                hands.can_put_in,
                hands.to_deliver.is_some(),
            ];
            assert_eq!(got, expected, "{held:?}");
        }
    }

    #[test]
    fn plans_read_as_sentences() {
        let it = Subject { track: TrackId(31), class: ClassId::named("apple") };
        assert_eq!(Plan::PickUp(it).to_string(), "go to apple #31 and pick it up");
    }

    #[test]
    fn a_walk_to_an_object_is_not_dropped_for_another_but_for_an_obstacle() {
        let it = |n| Subject { track: TrackId(n), class: ClassId::named("apple") };
        let current = Plan::PickUp(it(30));
        assert!(!Plan::PickUp(it(31)).supersedes(&current));
        assert!(!Plan::Explore.supersedes(&current));
        assert!(Plan::RemoveObstacle(it(32)).supersedes(&current));
        assert!(Plan::Deliver.supersedes(&current));
        assert!(current.supersedes(&Plan::Explore));
    }
}
