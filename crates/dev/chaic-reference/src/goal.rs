//! Deliveries and the transport rate.

use chaic_core::catalogue::Role;
use chaic_core::task::{GoalTop, TargetValue};
use chaic_core::{AgentId, ClassId, EntityId};
use chaic_world::EventKind;

use crate::scene::distance_m;
use crate::state::Location;
use crate::turn::Turn;
use crate::verdict::Verdict;

/// Depth to which an object may sink into a high goal place, meters.
const SINK_M: f64 = 0.02;

impl Turn<'_> {
    /// Delivers an object that came to rest, if it is at the goal.
    pub(crate) fn deliver_if_at_goal(&mut self, object: EntityId) {
        let thing = self.thing(object);
        if thing.delivered.is_some() || self.role(object) == Role::Obstacle {
            return;
        }
        let setup = self.facts.setup;
        let k = setup.object_index(object).expect("the object exists");
        let at = self.given.after.objects[k].0;
        let radius_m = self.facts.numbers.delivery_margin_m
            + self.geometry().half_longer_side_m(setup.goal_places[0]);
        let is_near = |place: EntityId| {
            let k = setup.object_index(place).expect("the place exists");
            Verdict::at_most(distance_m(self.given.after.objects[k].0, at), radius_m)
        };
        let mut is_at_goal = Verdict::No;
        if self.is_paper() {
            // The last put-on was a successful one, on a goal place.
            if let Some(place) = thing.put_at {
                is_at_goal = is_near(place);
            }
        } else if thing.last_holder.is_some() {
            for place in &setup.goal_places {
                is_at_goal = is_at_goal.or(is_near(*place));
            }
        }
        if setup.task.info().goal_top == GoalTop::High {
            let least_m = self.facts.numbers.high_goal_m - SINK_M;
            is_at_goal = is_at_goal.and(Verdict::at_most(least_m, f64::from(at.y)));
        }
        if self.choices.decide(is_at_goal) {
            self.deliver(object);
        }
    }

    /// Delivers all that a person has released (second rule of the original).
    pub(crate) fn deliver_all_of(&mut self, agent: AgentId) {
        for entity in self.facts.setup.entities() {
            let thing = self.thing(entity);
            let is_released = thing.last_holder == Some(agent)
                && matches!(thing.location, Location::Rests(_) | Location::Falls)
                && thing.delivered.is_none();
            if is_released && self.role(entity) != Role::Obstacle {
                self.deliver(entity);
            }
        }
    }

    /// Delivers an object and its contents.
    fn deliver(&mut self, object: EntityId) {
        let by = self.thing(object).last_holder.unwrap_or(AgentId::PARTNER);
        let mut all = vec![object];
        all.extend(self.contents(object));
        for entity in all {
            let class = self.spec(entity).class;
            let counted = self.n_delivered(class) < self.n_wanted(class);
            let frame = self.state.frame;
            let thing = self.thing_mut(entity);
            thing.delivered = Some(frame);
            thing.delivered_by = Some(by);
            self.emit(EventKind::Delivered { object: entity, by, counted });
        }
    }

    fn n_delivered(&self, class: ClassId) -> u32 {
        let mut n = 0;
        for entity in self.facts.setup.entities() {
            let is_class = self.spec(entity).class == class;
            n += u32::from(is_class && self.thing(entity).delivered.is_some());
        }
        n
    }

    fn n_wanted(&self, class: ClassId) -> u32 {
        let mut n = 0;
        for (wanted, count) in &self.facts.setup.goal.targets {
            if *wanted == class {
                n += count;
            }
        }
        n
    }

    /// Returns whether all wanted objects are delivered.
    pub(crate) fn is_complete(&self) -> bool {
        let targets = &self.facts.setup.goal.targets;
        targets.iter().all(|(class, wanted)| self.n_delivered(*class) >= *wanted)
    }

    /// Returns the delivered and the wanted value: objects or kilograms.
    pub(crate) fn progress(&self) -> [f64; 2] {
        let mut progress = [0.0; 2];
        for (class, wanted) in &self.facts.setup.goal.targets {
            let value = match self.facts.setup.task.info().target_value {
                TargetValue::Count => 1.0,
                TargetValue::Mass => f64::from(class.info().mass_kg),
            };
            let delivered = self.n_delivered(*class).min(*wanted);
            progress[0] += value * f64::from(delivered);
            progress[1] += value * f64::from(*wanted);
        }
        progress
    }
}
