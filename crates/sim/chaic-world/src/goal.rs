//! Deliveries and the progress toward the goal.

use chaic_core::catalogue::Role;
use chaic_core::geom::horizontal_distance;
use chaic_core::{AgentId, ClassId, EntityId};

use crate::event::EventKind;
use crate::setup::Setup;
use crate::state::ObjectLocation;
use crate::world::World;

/// Maximum penetration of a resting object into its support, meters: solver tolerance and a margin.
const MAX_PENETRATION_M: f32 = 0.02;

/// Number of occurrences of a class.
fn count(classes: &[ClassId], class: ClassId) -> u32 {
    classes.iter().filter(|c| **c == class).count() as u32
}

impl World {
    /// Returns the maximum distance from the center of a goal place at which a released object
    /// counts as delivered, meters. It is the margin plus half of the longer side (facts S5.2).
    pub fn delivery_radius_m(&self) -> f32 {
        let (place, _) = self.object(self.setup.goal_places[0]);
        self.rules.delivery_margin_m + place.half_longer_side_m()
    }

    /// Returns the minimum top height of the goal place, meters; 0 for no condition.
    pub fn goal_min_top_m(&self) -> f32 {
        self.rules.goal_min_top_m(self.setup.task)
    }

    /// Returns all delivered objects, targets or not, in the order of ids.
    pub fn delivered(&self) -> Vec<EntityId> {
        let objects = self.state.objects.iter().enumerate();
        let delivered = objects.filter(|(_, object)| object.delivered.is_some());
        delivered.map(|(k, _)| Setup::entity(k)).collect()
    }

    /// Returns the classes of all delivered objects, in the order of ids.
    fn delivered_classes(&self) -> Vec<ClassId> {
        self.delivered().into_iter().map(|e| self.object(e).0.class).collect()
    }

    /// Returns the obstacles that were removed, if the rules announce them to all agents.
    pub fn announced_obstacles(&self) -> Vec<EntityId> {
        let is_removed = |e: &EntityId| {
            let (spec, state) = self.object(*e);
            spec.class.info().role == Role::Obstacle && state.last_holder.is_some()
        };
        let announced = self.setup.entities().filter(|_| self.rules.announces_removed_obstacles);
        announced.filter(is_removed).collect()
    }

    /// Returns the number of delivered objects of a class.
    pub fn n_delivered(&self, class: ClassId) -> u32 {
        count(&self.delivered_classes(), class)
    }

    /// Returns the achieved and the total value of the goal by the task's [`TargetValue`]: a number
    /// of objects, or kilograms.
    ///
    /// [`TargetValue`]: chaic_core::task::TargetValue
    pub fn progress(&self) -> (f64, f64) {
        let (goal, delivered) = (&self.setup.goal.targets, self.delivered_classes());
        goal.iter().fold((0.0, 0.0), |(achieved, total), (class, wanted)| {
            let value = self.target_value(*class);
            let n_counted = count(&delivered, *class).min(*wanted);
            (achieved + value * f64::from(n_counted), total + value * f64::from(*wanted))
        })
    }

    /// Returns the value of one object of a class in this task.
    pub fn target_value(&self, class: ClassId) -> f64 {
        self.setup.task.info().target_value.value(class)
    }

    /// Returns whether all targets have been delivered.
    pub fn is_complete(&self) -> bool {
        let delivered = self.delivered_classes();
        self.setup.goal.targets.iter().all(|(class, wanted)| count(&delivered, *class) >= *wanted)
    }

    /// Delivers an object that has come to rest, if it is at the goal.
    pub(crate) fn check_delivery(&mut self, object: EntityId) {
        let state = self.object(object).1;
        let (position, released_at) = (state.position, state.released_at);
        if state.delivered.is_some() {
            return;
        }
        let radius = self.delivery_radius_m();
        let near =
            |g: &EntityId| horizontal_distance(self.object(*g).1.position, position) <= radius;
        let is_at_goal = if self.rules.failed_put_on_can_deliver {
            state.last_holder.is_some() && self.setup.goal_places.iter().any(near)
        } else {
            released_at.is_some_and(|g| near(&g))
        };
        let min_top_m = self.goal_min_top_m();
        let is_high_enough = min_top_m <= 0.0 || position.y >= min_top_m - MAX_PENETRATION_M;
        let role = self.object(object).0.class.info().role;
        let is_deliverable = role != Role::Obstacle;
        if is_at_goal && is_high_enough && is_deliverable {
            self.deliver(object);
        }
    }

    /// Delivers all objects that an agent has taken and released so far, at any place, even while
    /// they fall: the second rule of the original (facts S5.3).
    pub(crate) fn deliver_all_released(&mut self, agent: AgentId) {
        let is_released = |e: &EntityId| {
            let (spec, state) = self.object(*e);
            let is_free = matches!(
                state.location,
                ObjectLocation::Resting { .. } | ObjectLocation::Falling { .. }
            );
            state.last_holder == Some(agent)
                && is_free
                && state.delivered.is_none()
                && spec.class.info().role != Role::Obstacle
        };
        let released: Vec<EntityId> = self.setup.entities().filter(is_released).collect();
        for object in released {
            self.deliver(object);
        }
    }

    /// Marks an object and its contents as delivered, which takes them out of play.
    fn deliver(&mut self, object: EntityId) {
        let by = self.object(object).1.last_holder.unwrap_or(AgentId::PARTNER);
        let frame = self.state.frame;
        for entity in std::iter::once(object).chain(self.contents(object)) {
            let class = self.object(entity).0.class;
            let counted = self.n_delivered(class) < self.setup.goal.count(class);
            let state = self.object_mut(entity);
            state.delivered = Some(frame);
            state.delivered_by = Some(by);
            self.record_event(EventKind::Delivered { object: entity, by, counted });
        }
    }
}
