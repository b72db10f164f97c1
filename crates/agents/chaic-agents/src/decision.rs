//! Decisions: the plans, their preconditions, and the policy interface.

use std::collections::BTreeMap;
use std::fmt;

use chaic_core::agent::PartnerBelief;
use chaic_core::briefing::CompanionRole;
use chaic_core::geom::to_xz;
use chaic_core::{AgentError, Briefing, ClassId, Frame, Hand, Observation, Role};

use crate::behavior::BehaviorLog;
use crate::mapping::MappedObject;
use crate::memory::Memory;
use crate::track::{CarriedObject, Hands, TrackId};

/// Object that a plan refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Subject {
    /// Track of the object.
    pub track: TrackId,
    /// Class of the object.
    pub class: ClassId,
}

impl Subject {
    fn from_object(object: &MappedObject) -> Subject {
        Subject { track: object.track, class: object.class }
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.class.info().label, self.track)
    }
}

/// Subgoal that takes many actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Plan {
    /// Explore unknown parts of the map.
    Explore,
    /// Pick up a target.
    PickUp(Subject),
    /// Pick up a container.
    PickContainer(Subject),
    /// Put the target in one hand into the container in the other.
    PutIn,
    /// Bring the carried objects to the goal place.
    Deliver,
    /// Remove an obstacle.
    RemoveObstacle(Subject),
    /// Lift a piece of furniture together with the partner beside it.
    LiftWith(Subject),
    /// Stay near the partner.
    FollowPartner,
    /// Go to the child.
    FollowChild,
    /// Turn through a full circle to look around.
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
    /// Names of the plan kinds, indexed by [`Plan::kind`].
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

    /// Index of the plan's kind in [`Plan::KINDS`].
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

    /// Returns the object that the plan refers to, if it has exactly one.
    pub fn subject(&self) -> Option<Subject> {
        match self {
            Plan::PickUp(it)
            | Plan::PickContainer(it)
            | Plan::RemoveObstacle(it)
            | Plan::LiftWith(it) => Some(*it),
            _ => None,
        }
    }

    /// Returns whether this plan replaces `current`, when both come from the same policy.
    ///
    /// A plan is never replaced by one of the same kind, or by an idle plan (explore, follow,
    /// wait). A walk to one object is not replaced by a walk to another.
    pub fn supersedes(&self, current: &Plan) -> bool {
        let is_idle = matches!(self, Plan::Explore | Plan::FollowPartner | Plan::Wait);
        let is_same_kind = std::mem::discriminant(self) == std::mem::discriminant(current);
        !(is_same_kind || is_idle || current.is_pick() && self.is_pick())
    }

    /// Returns whether the plan is to pick up a target or a container.
    pub fn is_pick(&self) -> bool {
        matches!(self, Plan::PickUp(_) | Plan::PickContainer(_))
    }
}

/// Load of the hands, as far as decisions depend on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HandState {
    /// An empty hand, if any.
    pub free_hand: Option<Hand>,
    /// True if a hand holds a container.
    pub has_container: bool,
    /// Possible targets carried, including those in containers and baskets.
    pub targets: Vec<(TrackId, ClassId)>,
    /// True if another target can be picked up.
    pub can_take_target: bool,
    /// True if a container can be picked up.
    pub can_take_container: bool,
    /// True if one hand holds a target and the other a container with room.
    pub can_put_in: bool,
    /// A hand that holds something to deliver.
    pub to_deliver: Option<Hand>,
}

impl HandState {
    /// Computes the state of these hands for the agent with this briefing.
    pub fn new(hands: &Hands, briefing: &Briefing) -> HandState {
        let capacity = briefing.container_capacity;
        let is_target = |class: ClassId| briefing.possible_targets.contains(&class);
        let role = |held: &CarriedObject| held.class().map(|c| c.info().role);
        let is_container = |held: &CarriedObject| role(held) == Some(Role::Container);
        let basket = hands.held().find(|h| role(h) == Some(Role::Vehicle));
        let moves_furniture =
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
            None if moves_furniture => body.lifts_furniture && hands.held().next().is_none(),
            None => free_hand.is_some(),
        };
        // An unidentified object is delivered too, to free the hand.
        let carries =
            |h: &CarriedObject| h.object.is_none() || h.all().any(|(_, class)| is_target(class));
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

/// Inputs of a decision.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Briefing of the agent.
    pub briefing: &'a Briefing,
    /// The agent's memory; path lengths are up to date when a choice is requested.
    pub memory: &'a Memory,
    /// Known actions of the other agents.
    pub behavior: &'a BehaviorLog,
    /// True if all reachable space has been explored.
    pub is_explored: bool,
}

/// Plans that a choice may depend on. The agent computes no path lengths for the others. Plans of other
/// kinds than these three always pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanFilter {
    /// Classes to pick up, a subset of the possible targets; `None` for all of them.
    pub targets: Option<Vec<ClassId>>,
    /// True if containers to pick up matter.
    pub containers: bool,
    /// True if obstacles to remove matter.
    pub obstacles: bool,
}

impl PlanFilter {
    /// All plans.
    pub const ALL: PlanFilter = PlanFilter { targets: None, containers: true, obstacles: true };
    /// No target, container or obstacle.
    pub const NO_OBJECTS: PlanFilter =
        PlanFilter { targets: Some(Vec::new()), containers: false, obstacles: false };
}

/// Chooses among valid plans.
pub trait Policy: Send + 'static {
    /// Starts an episode.
    fn reset(&mut self, briefing: &Briefing);

    /// Returns the plan to execute next. `valid` contains the plans that pass
    /// [`plan_filter`](Policy::plan_filter) and is never empty. Plans of one kind are sorted by
    /// distance, nearest first. [`Plan::LiftWith`] is sorted by distance from the partner.
    ///
    /// # Errors
    /// If the policy cannot choose; the agent then takes no decision.
    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError>;

    /// Returns the plans that the next choice may depend on; `choose` receives no others. Without the
    /// omitted plans, the choice must have the same effect: the same plan, or another one that does
    /// not [supersede](Policy::supersedes) the unfinished plan `current` either.
    ///
    /// A wrapper that records or inspects `valid` or the choice must keep [`PlanFilter::ALL`].
    fn plan_filter(&self, _context: &Context<'_>, _current: Option<&Plan>) -> PlanFilter {
        PlanFilter::ALL
    }

    /// Returns whether to call `choose` although `current` is unfinished. `has_changed` is true if
    /// the map has changed in a relevant way since the last choice. The new choice is adopted only
    /// if it [supersedes](Policy::supersedes) the current plan.
    fn reconsiders(&mut self, _context: &Context<'_>, _current: &Plan, _has_changed: bool) -> bool {
        false
    }

    /// Returns whether a new choice replaces the unfinished plan `current`.
    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        new.supersedes(current)
    }

    /// Returns the minimum top height of goal places that the agent uses from now on, meters;
    /// `None` for that of the briefing.
    fn goal_place_min_top_m(&self, _memory: &Memory) -> Option<f32> {
        None
    }

    /// Receives each observation before the action. Needed by policies that use images or changes
    /// over time.
    fn observe(&mut self, _observation: &Observation, _memory: &Memory, _behavior: &BehaviorLog) {}

    /// Number of frames that the body waits before it starts the chosen plan.
    fn thinking_frames(&self) -> Frame {
        0
    }

    /// Number of frames after which the agent forgets a small object that it has not seen; `None` if
    /// it never forgets.
    fn memory_frames(&self) -> Option<Frame> {
        None
    }

    /// Short label of the policy's state for traces, if it has one.
    fn status(&self) -> Option<String> {
        None
    }

    /// Belief about the partner and the plans that follow, for traces; `None` if the policy infers
    /// nothing.
    fn partner_belief(&self, _briefing: &Briefing, _memory: &Memory) -> Option<PartnerBelief> {
        None
    }

    /// Returns the digest of the trained weights that choose the plans, if there are any.
    fn weights(&self) -> Option<String> {
        None
    }

    /// Returns the digest of the recording that the policy repeats, if it repeats one.
    fn recording(&self) -> Option<String> {
        None
    }

    /// Counters of this episode, by name.
    fn counters(&self) -> BTreeMap<String, u64> {
        BTreeMap::new()
    }

    /// Returns a copy that continues identically, or `None` if the policy cannot be copied.
    fn fork(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// Returns all plans that can be started now.
#[cfg(test)]
pub(crate) fn valid_plans(memory: &Memory, briefing: &Briefing) -> Vec<Plan> {
    filtered_plans(memory, briefing, &PlanFilter::ALL)
}

/// Returns the plans that can be started now and pass the filter. Never empty. Plans of one kind are
/// sorted by distance, [`Plan::LiftWith`] by distance from the partner.
pub fn filtered_plans(memory: &Memory, briefing: &Briefing, filter: &PlanFilter) -> Vec<Plan> {
    let hands = HandState::new(&memory.hands, briefing);
    let mut plans = vec![Plan::Explore];
    if hands.can_put_in {
        plans.push(Plan::PutIn);
    }
    if hands.to_deliver.is_some() && !memory.goal_places().is_empty() {
        plans.push(Plan::Deliver);
    }
    if hands.can_take_target {
        let targets = filter.targets.as_ref().unwrap_or(&briefing.possible_targets);
        plans.extend(reachable(memory, targets).map(Plan::PickUp));
    }
    if filter.containers && hands.can_take_container {
        plans.extend(reachable(memory, &briefing.containers).map(Plan::PickContainer));
    }
    let removes_obstacles = filter.obstacles && briefing.capability.removes_obstacles;
    if removes_obstacles && hands.free_hand.is_some() {
        plans.extend(reachable(memory, &briefing.obstacles).map(Plan::RemoveObstacle));
    }
    if briefing.capability.lifts_furniture && memory.hands.held().next().is_none() {
        plans.extend(furniture_at_partner(memory, briefing).map(Plan::LiftWith));
    }
    if memory.companion(briefing, CompanionRole::Partner).is_some() {
        plans.push(Plan::FollowPartner);
    }
    if memory.companion(briefing, CompanionRole::Child).is_some() {
        plans.push(Plan::FollowChild);
    }
    plans.push(Plan::TurnAround);
    plans
}

/// Returns the available and reachable objects of these classes, nearest first.
fn reachable<'a>(
    memory: &'a Memory,
    classes: &[ClassId],
) -> impl Iterator<Item = Subject> + use<'a> {
    let mut found: Vec<(f32, &MappedObject)> = memory
        .objects
        .iter()
        .filter(|t| classes.contains(&t.class) && t.is_available(memory.frame))
        .filter_map(|t| Some((memory.path_length_to(t)?, t)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, t)| Subject::from_object(t))
}

/// Returns the furniture that the partner stands beside, nearest to the partner first. Pieces at
/// the same distance are in the order of tracks.
fn furniture_at_partner<'a>(
    memory: &'a Memory,
    briefing: &Briefing,
) -> impl Iterator<Item = Subject> + use<'a> {
    let rules = memory.rules.lifting;
    let partner = memory
        .companion(briefing, CompanionRole::Partner)
        .filter(|p| p.frame + rules.partner_sighting_max_age_frames > memory.frame)
        .map(|p| to_xz(p.position_in_world));
    let mut found: Vec<(f32, &MappedObject)> = memory
        .objects
        .iter()
        .filter(|t| t.class.info().role == Role::HeavyTarget && t.is_available(memory.frame))
        .filter_map(|t| Some((t.distance_from(partner?), t)))
        .filter(|(distance_m, _)| *distance_m < rules.partner_at_furniture_m)
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, t)| Subject::from_object(t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::planning::path::CostField;
    use crate::test_support::{Toy, ToyObject, carried, hands, seen};
    use chaic_core::geom::Pose;
    use chaic_core::rng::RngStream;
    use chaic_core::{AgentId, Vec2, Vec3};

    fn briefing() -> Briefing {
        Toy::room(4.0, 4.0).briefing()
    }

    #[test]
    fn hands_determine_the_possible_actions() {
        let apple = || Some(carried("apple", 30, &[]));
        let basket =
            |n: usize| Some(carried("wicker_basket", 31, &["apple", "apple", "apple"][..n]));
        let bike = |n: usize| Some(carried("bike", 32, &["apple", "apple", "apple"][..n]));
        // Hands; whether they can pick up a target, pick up a container, put in, and deliver.
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
            let hands = HandState::new(&hands(held.clone()), &briefing());
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
    fn the_piece_nearest_to_the_partner_is_lifted_first() {
        let mut toy = Toy::room(10.0, 10.0);
        let [far, near] =
            [-1.2, 1.2].map(|x| toy.add(ToyObject::new("piano", [x, 0.0, -3.0], [0.6, 1.0, 0.6])));
        toy.stand([0.0, 0.0], 0.0);
        let briefing = toy.briefing();
        let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
        let mut observation = toy.observe();
        let at = Pose { position: Vec3::new(0.2, 0.0, -1.9), yaw_rad: 0.0 };
        observation.granted.poses = vec![(AgentId::PARTNER, at)];
        memory.update(&briefing, &observation, &GroundTruthIds.perceive(&observation));
        let pieces = furniture_at_partner(&memory, &briefing).map(|subject| subject.track);
        assert_eq!(pieces.collect::<Vec<_>>(), [near, far]);
    }

    /// Returns the path length by its definition: the cheapest cell near the object's nearest point or
    /// its center.
    fn reference_path_length_m(memory: &Memory, object: &MappedObject) -> Option<f32> {
        let here = memory.position();
        let grid = memory.map.grid();
        let points = [object.nearest_point(here), to_xz(object.position_in_world)];
        let cells = points.into_iter().flat_map(|p| grid.disc(p, 1.5));
        let cost = memory.path_costs().expect("refreshed").min_cost(cells)?;
        Some(CostField::meters(cost).max(object.distance_from(here)))
    }

    #[test]
    fn a_filter_omits_plans_and_changes_neither_order_nor_path_lengths() {
        let classes = ["apple", "banana", "orange", "wicker_basket", "trashbin", "bed"];
        let (mut n_omitted, mut n_ties) = (0, 0);
        for seed in 0..60 {
            let mut rng = RngStream::new(seed, "plan filter", 0);
            let mut toy = Toy::room(10.0, 6.0);
            toy.add_wall([-0.05, -3.0], [0.05, 0.4]);
            toy.add_wall([-0.05, 1.4], [0.05, 3.0]);
            let briefing = Briefing { layout: Some(toy.layout()), ..toy.briefing() };
            let mut memory = Memory::new(&briefing, crate::PlannerRules::paper());
            let mut at = Vec2::ZERO;
            let detections = (0..24).map(|n| {
                // Objects of several classes may lie at one place, and have equal path lengths.
                if !rng.chance(0.3) {
                    at = Vec2::new(rng.range(-4.6, 4.6), rng.range(-2.6, 2.6));
                }
                let class = classes[rng.below(classes.len())];
                seen(TrackId(20 + n), class, [at.x, 0.0, at.y], 0.3, 0.3)
            });
            memory.objects.update(&detections.collect::<Vec<_>>(), &[], 0, 10);
            memory.pose.position = Vec3::new(rng.range(-4.0, 4.0), 0.0, rng.range(-2.0, 2.0));
            memory.refresh();
            let mut targets = briefing.possible_targets.clone();
            targets.retain(|_| rng.chance(0.5));
            let (containers, obstacles) = (rng.chance(0.5), rng.chance(0.5));
            let filter = PlanFilter { targets: Some(targets), containers, obstacles };
            // The copy is asked for fewer path lengths, and for those first.
            let copy = memory.clone();
            let some = filtered_plans(&copy, &briefing, &filter);
            let all = valid_plans(&memory, &briefing);
            let passes = |plan: &&Plan| match plan {
                Plan::PickUp(it) => {
                    filter.targets.as_ref().is_some_and(|all| all.contains(&it.class))
                }
                Plan::PickContainer(_) => filter.containers,
                Plan::RemoveObstacle(_) => filter.obstacles,
                _ => true,
            };
            let expected: Vec<Plan> = all.iter().filter(passes).copied().collect();
            assert_eq!(some, expected, "seed {seed}");
            n_omitted += all.len() - some.len();
            let bits = |length_m: Option<f32>| length_m.map(f32::to_bits);
            let mut lengths = Vec::new();
            for object in memory.objects.iter() {
                let length = bits(memory.path_length_to(object));
                assert_eq!(bits(copy.path_length_to(object)), length, "seed {seed}");
                assert_eq!(bits(reference_path_length_m(&memory, object)), length, "seed {seed}");
                n_ties += usize::from(lengths.contains(&length));
                lengths.push(length);
            }
            assert_eq!(filtered_plans(&memory, &briefing, &PlanFilter::ALL), all);
        }
        assert!(n_omitted > 300 && n_ties > 60, "{n_omitted} omitted, {n_ties} ties");
    }

    #[test]
    fn plans_are_formatted_as_sentences() {
        let it = Subject { track: TrackId(31), class: ClassId::named("apple") };
        assert_eq!(Plan::PickUp(it).to_string(), "go to apple #31 and pick it up");
    }

    #[test]
    fn a_walk_to_an_object_is_replaced_for_an_obstacle_but_not_for_another_object() {
        let it = |n| Subject { track: TrackId(n), class: ClassId::named("apple") };
        let current = Plan::PickUp(it(30));
        assert!(!Plan::PickUp(it(31)).supersedes(&current));
        assert!(!Plan::Explore.supersedes(&current));
        assert!(Plan::RemoveObstacle(it(32)).supersedes(&current));
        assert!(Plan::Deliver.supersedes(&current));
        assert!(current.supersedes(&Plan::Explore));
    }
}
