//! What counts as delivered, and how much is.

use chaic_core::catalogue::Role;
use chaic_core::geom::horizontal_distance;
use chaic_core::{AgentId, ClassId, EntityId};

use crate::event::EventKind;
use crate::world::World;

/// What lies on something may have sunk into it by this, metres: the solver's slack, and more.
const SUNK_M: f32 = 0.02;

impl World {
    /// How near to the middle of a goal place a released thing must come to rest, metres
    /// (facts S5.2: the margin plus half of the longer side).
    pub fn delivery_radius_m(&self) -> f32 {
        let (place, _) = self.thing(self.setup.goal_places[0]);
        self.rules.delivery_margin_m + place.half_longer_side_m()
    }

    /// Lowest top that counts as the goal place, metres; 0 for no condition.
    pub fn goal_min_top_m(&self) -> f32 {
        self.rules.goal_min_top_m(self.setup.task)
    }

    /// Whether somebody stands within the delivery radius of a goal place.
    pub fn is_near_goal(&self, agent: AgentId) -> bool {
        let p = self.person(agent).pose.position;
        let radius = self.delivery_radius_m();
        self.setup
            .goal_places
            .iter()
            .any(|g| horizontal_distance(self.thing(*g).1.position, p) <= radius)
    }

    /// Everything delivered so far, wanted or not, in the order of ids.
    pub fn delivered(&self) -> Vec<EntityId> {
        self.setup.entities().filter(|e| self.thing(*e).1.delivered.is_some()).collect()
    }

    /// The obstacles that somebody has taken away, if the rules tell everybody of them.
    pub fn told_removed(&self) -> Vec<EntityId> {
        let is_removed = |e: &EntityId| {
            let (thing, state) = self.thing(*e);
            thing.class.info().role == Role::Obstacle && state.last_holder.is_some()
        };
        let all = self.setup.entities().filter(|_| self.rules.tells_removed);
        all.filter(is_removed).collect()
    }

    /// How many of a class are delivered.
    pub fn n_delivered(&self, class: ClassId) -> u32 {
        let of_class = |e: &EntityId| self.thing(*e).0.class == class;
        self.delivered().iter().filter(|e| of_class(e)).count() as u32
    }

    /// What is done of what is wanted, and all that is wanted, by the task's [`Worth`]: objects, or
    /// kilograms.
    ///
    /// [`Worth`]: chaic_core::task::Worth
    pub fn progress(&self) -> (f64, f64) {
        let goal = &self.setup.goal.targets;
        goal.iter().fold((0.0, 0.0), |(done, all), (class, wanted)| {
            let worth = self.worth(*class);
            let there = self.n_delivered(*class).min(*wanted);
            (done + worth * f64::from(there), all + worth * f64::from(*wanted))
        })
    }

    /// What one object of a class counts for in this task.
    pub fn worth(&self, class: ClassId) -> f64 {
        self.setup.task.info().worth.of(class)
    }

    /// Whether everything the goal asks for has been delivered.
    pub fn is_complete(&self) -> bool {
        self.setup.goal.targets.iter().all(|(class, wanted)| self.n_delivered(*class) >= *wanted)
    }

    /// A thing lies still: is it delivered?
    pub(crate) fn come_to_rest(&mut self, object: EntityId) {
        let state = self.thing(object).1;
        let (at, released_at) = (state.position, state.released_at);
        if state.delivered.is_some() {
            return;
        }
        let radius = self.delivery_radius_m();
        let near = |g: &EntityId| horizontal_distance(self.thing(*g).1.position, at) <= radius;
        let by_rule = if self.rules.dropped_counts {
            state.last_holder.is_some() && self.setup.goal_places.iter().any(near)
        } else {
            released_at.is_some_and(|g| near(&g))
        };
        let min_top_m = self.goal_min_top_m();
        let high_enough = min_top_m <= 0.0 || at.y >= min_top_m - SUNK_M;
        let role = self.thing(object).0.class.info().role;
        let deliverable = role != Role::Obstacle;
        if by_rule && high_enough && deliverable {
            self.deliver(object);
        }
    }

    /// Delivers all that somebody has taken and let go so far, wherever it lies: the original's
    /// second rule (facts S5.3).
    pub(crate) fn deliver_all_let_go(&mut self, agent: AgentId) {
        let is_let_go = |e: &EntityId| {
            let (thing, state) = self.thing(*e);
            state.last_holder == Some(agent)
                && state.is_resting()
                && state.delivered.is_none()
                && thing.class.info().role != Role::Obstacle
        };
        let let_go: Vec<EntityId> = self.setup.entities().filter(is_let_go).collect();
        for object in let_go {
            self.deliver(object);
        }
    }

    /// Takes a thing out of play, with all that is in it.
    fn deliver(&mut self, object: EntityId) {
        let by = self.thing(object).1.last_holder.unwrap_or(AgentId::PARTNER);
        let frame = self.state.frame;
        for entity in std::iter::once(object).chain(self.contents(object)) {
            let class = self.thing(entity).0.class;
            let counted = self.n_delivered(class) < self.setup.goal.wanted(class);
            let thing = self.thing_mut(entity);
            thing.delivered = Some(frame);
            thing.delivered_by = Some(by);
            self.happened(EventKind::Delivered { object: entity, by, counted });
        }
    }
}
