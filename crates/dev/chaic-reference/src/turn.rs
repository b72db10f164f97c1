//! One frame of the reference: its inputs, and the conditions that several actions share.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::catalogue::Role;
use chaic_core::rng::RngStream;
use chaic_core::task::GoalApproach;
use chaic_core::{AgentId, EntityId, Vec3};
use chaic_world::{Event, EventKind, ObjectSpec, Setup};

use crate::numbers::{EXHAUSTED, Limits, Numbers, RuleSet};
use crate::scene::{Geometry, GivenQuantities, distance_m};
use crate::state::{Location, Person, RefState, Thing};
use crate::verdict::{Choices, TOLERANCE, Verdict};

/// Data of an episode that never change.
pub(crate) struct Facts<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) set: RuleSet,
    pub(crate) numbers: Numbers,
    pub(crate) limits: Vec<Limits>,
}

impl<'a> Facts<'a> {
    /// Collects the facts of an episode.
    pub(crate) fn new(setup: &'a Setup, set: RuleSet) -> Facts<'a> {
        let limits = setup.people.iter().map(Limits::of).collect();
        Facts { setup, set, numbers: Numbers::of(set), limits }
    }
}

/// State and inputs of the reference during one frame.
pub(crate) struct Turn<'a> {
    pub(crate) facts: &'a Facts<'a>,
    pub(crate) state: RefState,
    pub(crate) given: &'a GivenQuantities,
    pub(crate) choices: &'a mut Choices,
}

/// Smallest and largest probability that are consistent with the rounding of a limit.
pub(crate) type Probability = [f64; 2];

/// Returns exp(-excess / alpha) / beta, and 1 within the limit (paper, section 3.1).
pub(crate) fn probability(excess: f64, alpha: f64, beta: f64) -> Probability {
    [excess + TOLERANCE, excess - TOLERANCE]
        .map(|excess| if excess <= 0.0 { 1.0 } else { libm::exp(-excess / alpha) / beta })
}

/// Returns by how much a height is outside a range; negative inside.
pub(crate) fn outside_m(height_m: f64, range_m: [f64; 2]) -> f64 {
    f64::max(range_m[0] - height_m, height_m - range_m[1])
}

impl Turn<'_> {
    pub(crate) fn agents(&self) -> impl Iterator<Item = AgentId> + use<> {
        (0..self.state.people.len() as u8).map(AgentId)
    }

    pub(crate) fn person(&self, agent: AgentId) -> &Person {
        &self.state.people[agent.index()]
    }

    pub(crate) fn person_mut(&mut self, agent: AgentId) -> &mut Person {
        &mut self.state.people[agent.index()]
    }

    pub(crate) fn limits(&self, agent: AgentId) -> Limits {
        self.facts.limits[agent.index()]
    }

    fn index(&self, entity: EntityId) -> usize {
        self.facts.setup.object_index(entity).expect("the object exists")
    }

    pub(crate) fn thing(&self, entity: EntityId) -> Thing {
        self.state.things[self.index(entity)]
    }

    pub(crate) fn thing_mut(&mut self, entity: EntityId) -> &mut Thing {
        let k = self.index(entity);
        &mut self.state.things[k]
    }

    pub(crate) fn spec(&self, entity: EntityId) -> &ObjectSpec {
        &self.facts.setup.things[self.index(entity)]
    }

    pub(crate) fn role(&self, entity: EntityId) -> Role {
        self.spec(entity).class.info().role
    }

    pub(crate) fn geometry(&self) -> Geometry<'_> {
        Geometry { setup: self.facts.setup, step_over_m: self.facts.numbers.step_over_m }
    }

    pub(crate) fn emit(&mut self, kind: EventKind) {
        self.state.events.push(Event { frame: self.state.frame, kind });
    }

    pub(crate) fn is_paper(&self) -> bool {
        self.facts.set == RuleSet::Paper
    }

    /// Returns the fraction of speed and strength that remains with fatigue.
    pub(crate) fn strength(&self, agent: AgentId) -> f64 {
        let fatigue = f64::from(self.person(agent).fatigue);
        if self.limits(agent).tires { 1.0 - (1.0 - EXHAUSTED) * fatigue } else { 1.0 }
    }

    /// Returns the bicycle of a rider.
    pub(crate) fn bicycle(&self, agent: AgentId) -> Option<EntityId> {
        self.person(agent).hands[0].filter(|e| self.role(*e) == Role::Vehicle)
    }

    /// Returns the furniture in both hands.
    pub(crate) fn furniture(&self, agent: AgentId) -> Option<EntityId> {
        match self.person(agent).hands {
            [Some(a), Some(b)] if a == b => Some(a),
            _ => None,
        }
    }

    /// Returns the contents of a container in the order of slots.
    pub(crate) fn contents(&self, container: EntityId) -> Vec<EntityId> {
        let mut found = Vec::new();
        for slot in 0..=u8::MAX {
            for entity in self.facts.setup.entities() {
                if self.thing(entity).location == Location::Inside(container, slot) {
                    found.push(entity);
                }
            }
            if usize::from(slot) > self.facts.numbers.capacity {
                break;
            }
        }
        found
    }

    /// Returns the person who holds an object or the container in which it is.
    pub(crate) fn holder(&self, entity: EntityId) -> Option<AgentId> {
        match self.thing(entity).location {
            Location::Held(by, _) => Some(by),
            Location::Inside(container, _) => self.holder(container),
            _ => None,
        }
    }

    /// Returns the follower of a person who leads a carry of furniture.
    pub(crate) fn follower(&self, leader: AgentId) -> Option<AgentId> {
        let carry = self.state.carry?;
        (carry.leader == leader && carry.has_begun).then_some(carry.follower)
    }

    /// Draws a random event of a person. Each use has its own stream and counter.
    pub(crate) fn draw(
        &mut self,
        agent: AgentId,
        stream: &str,
        count: u32,
        probability: Probability,
    ) -> bool {
        let index = u64::from(agent.0) << 32 | u64::from(count);
        let unit = f64::from(RngStream::new(self.facts.setup.seed, stream, index).unit());
        let [low, high] =
            [probability[0].min(probability[1]) - 1e-6, probability[0].max(probability[1]) + 1e-6];
        let happens = if unit < low || low > 1.0 - 2e-6 {
            Verdict::Yes
        } else if unit >= high || high < 2e-6 {
            Verdict::No
        } else {
            Verdict::Open
        };
        self.choices.decide(happens)
    }

    /// Returns the distance from a point to the object, as far as walking counts: to its nearest
    /// point, or to its center under the rules of the original.
    fn distance_to_object_m(&self, from: Vec3, entity: EntityId) -> f64 {
        let setup = self.facts.setup;
        let is_reached_at_edge = setup.goal_places.contains(&entity)
            && setup.task.info().goal_approach == GoalApproach::NearestPoint;
        if self.is_paper() || is_reached_at_edge {
            self.geometry().distance_to_edge_m(&self.state.scene, from, entity)
        } else {
            distance_m(from, self.state.scene.objects[self.index(entity)].0)
        }
    }

    /// Returns the distance of a person at `own` to an object. The follower of a carry counts too.
    pub(crate) fn reach_m(&self, agent: AgentId, own: Vec3, entity: EntityId) -> f64 {
        let mut distance = self.distance_to_object_m(own, entity);
        if let Some(follower) = self.follower(agent) {
            let other = self.state.scene.people[follower.index()].position;
            distance = distance.min(self.distance_to_object_m(other, entity));
        }
        distance
    }

    /// Returns whether a person is within an arm's length of an object.
    pub(crate) fn is_at_arms_length(&self, agent: AgentId, entity: EntityId) -> Verdict {
        let own = self.state.scene.people[agent.index()].position;
        Verdict::at_most(self.distance_to_object_m(own, entity), self.facts.numbers.arm_m)
    }

    /// Returns whether the object exists and an approach to it can begin.
    pub(crate) fn is_accessible(&self, agent: AgentId, entity: EntityId) -> Verdict {
        if self.facts.setup.object_index(entity).is_none()
            || self.thing(entity).location == Location::Broken
        {
            return Verdict::No;
        }
        let scene = &self.state.scene;
        let geometry = self.geometry();
        let limit_m = self.facts.numbers.approach_limit_m + geometry.half_longer_side_m(entity);
        let center = scene.objects[self.index(entity)].0;
        let mut accessible = Verdict::No;
        for who in [Some(agent), self.follower(agent)].into_iter().flatten() {
            let from = scene.people[who.index()].position;
            let mut near = Verdict::at_most(distance_m(from, center), limit_m);
            if self.is_paper() && near != Verdict::No {
                let nearest = geometry.nearest(scene, from, entity);
                near = near.and(geometry.sees(from, center).or(geometry.sees(from, nearest)));
            }
            accessible = accessible.or(near);
        }
        accessible
    }

    /// Returns whether the arm of a person reaches an object: close enough, and under the paper's
    /// rules not through a wall.
    pub(crate) fn is_within_reach(&self, agent: AgentId, entity: EntityId) -> Verdict {
        if self.state.touched.contains(&entity) {
            return Verdict::Open;
        }
        let own = self.state.scene.people[agent.index()].position;
        let limit_m = if self.role(entity) == Role::HeavyTarget {
            self.facts.numbers.furniture_reach_limit_m
        } else {
            self.facts.numbers.reach_limit_m
        };
        let near = Verdict::at_most(self.reach_m(agent, own, entity), limit_m);
        if !self.is_paper() || near == Verdict::No {
            return near;
        }
        let geometry = self.geometry();
        near.and(geometry.sees(own, geometry.nearest(&self.state.scene, own, entity)))
    }

    /// Returns the reason why a person cannot take an object with a hand: the first that applies,
    /// in the order of this function.
    pub(crate) fn refusal(
        &self,
        agent: AgentId,
        entity: EntityId,
        hand: Hand,
    ) -> Option<FailureReason> {
        let thing = self.thing(entity);
        let role = self.role(entity);
        let limits = self.limits(agent);
        let hands = self.person(agent).hands;
        let is_movable = matches!(
            role,
            Role::Target | Role::Fragile | Role::Container | Role::Obstacle | Role::HeavyTarget
        );
        if thing.location == Location::Broken {
            return Some(FailureReason::OutOfReach);
        }
        if !is_movable || self.spec(entity).fixed {
            return Some(FailureReason::Impossible);
        }
        if thing.delivered.is_some() {
            return Some(FailureReason::OutOfPlay);
        }
        if self.holder(entity).is_some_and(|by| by != agent) {
            return Some(FailureReason::HeldByOther);
        }
        // The object is in a hand of this person, or in the person's basket.
        let is_in_basket = matches!((thing.location, self.bicycle(agent)),
            (Location::Inside(container, _), Some(bicycle)) if container == bicycle);
        if matches!(thing.location, Location::Held(..)) || is_in_basket {
            return Some(FailureReason::Impossible);
        }
        if role == Role::Obstacle && !limits.lifts_obstacles {
            return Some(FailureReason::BeyondLimits);
        }
        // A person with one hand can take neither containers nor furniture.
        if !limits.has_left_hand
            && (matches!(role, Role::Container | Role::HeavyTarget) || hand == Hand::Left)
        {
            return Some(FailureReason::BeyondLimits);
        }
        if role == Role::HeavyTarget {
            let is_free = hands == [None, None];
            return if is_free { None } else { Some(FailureReason::HandFull) };
        }
        if let Some(bicycle) = self.bicycle(agent) {
            if matches!(role, Role::Container | Role::Obstacle) {
                return Some(FailureReason::Impossible);
            }
            let is_full = self.contents(bicycle).len() >= self.facts.numbers.capacity;
            return if is_full { Some(FailureReason::Full) } else { None };
        }
        let is_free = hands[if hand == Hand::Left { 0 } else { 1 }].is_none();
        if is_free { None } else { Some(FailureReason::HandFull) }
    }

    /// Returns the objects that a put-on with this hand puts down.
    pub(crate) fn objects_to_put(&self, agent: AgentId, hand: Hand) -> Vec<EntityId> {
        if let Some(bicycle) = self.bicycle(agent) {
            return self.contents(bicycle);
        }
        let held = self.person(agent).hands[if hand == Hand::Left { 0 } else { 1 }];
        self.furniture(agent).or(held).into_iter().collect()
    }
}
