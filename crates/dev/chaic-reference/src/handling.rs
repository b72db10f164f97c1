//! Decisions on pick-ups and put-ons, and the moments at which hands close and open.

use chaic_core::action::{Action, FailureReason, Hand};
use chaic_core::catalogue::Role;
use chaic_core::rng::RngStream;
use chaic_core::{AgentId, EntityId};
use chaic_world::EventKind;

use crate::frame::PartStatus;
use crate::numbers::SLIP;
use crate::state::{Location, OngoingAction, Part};
use crate::turn::{Turn, outside_m, probability};
use crate::verdict::Verdict;

impl Turn<'_> {
    /// Decides a pick-up.
    pub(crate) fn decide_take(
        &mut self,
        agent: AgentId,
        ongoing: &mut OngoingAction,
        hand: Option<Hand>,
        object: EntityId,
    ) -> PartStatus {
        let n = self.facts.numbers;
        let is_within_reach = self.is_within_reach(agent, object);
        if !self.choices.decide(is_within_reach) {
            return PartStatus::Failed(FailureReason::Blocked);
        }
        if let Some(reason) = self.refusal(agent, object, hand.unwrap_or(Hand::Right)) {
            return PartStatus::Failed(reason);
        }
        let limits = self.limits(agent);
        let top_m = self.geometry().top_m(&self.state.scene, object);
        if limits.breaks_vases && self.role(object) == Role::Fragile {
            let p = probability_of_breaking(
                top_m - limits.pick_m[1],
                n.break_within_range,
                n.break_above_range,
            );
            let count = self.person(agent).n_break;
            self.person_mut(agent).n_break += 1;
            if self.draw(agent, "break", count, p) {
                ongoing.failing = Some(FailureReason::Broke);
            }
        }
        if ongoing.failing.is_none() {
            let mass_kg = f64::from(self.spec(object).class.info().mass_kg);
            let height = probability(outside_m(top_m, limits.pick_m), 1.0, 2.0);
            let mass = probability(mass_kg - limits.lift_kg * self.strength(agent), 50.0, 1.0);
            let count = self.person(agent).n_take;
            self.person_mut(agent).n_take += 1;
            let mut holds =
                self.draw(agent, "take", count, [height[0] * mass[0], height[1] * mass[1]]);
            if holds && limits.trembles {
                let count = self.person(agent).n_slip;
                self.person_mut(agent).n_slip += 1;
                holds = !self.draw(agent, "slip", count, [SLIP; 2]);
            }
            if !holds {
                ongoing.failing = Some(FailureReason::BeyondLimits);
            }
        }
        ongoing.parts.truncate(1);
        ongoing.parts.extend([
            Part::Stand(n.turn),
            Part::Stand(n.gap),
            Part::Arms(n.reach),
            Part::Stand(n.gap),
        ]);
        if ongoing.failing == Some(FailureReason::BeyondLimits) {
            if n.grasp_of_nothing > 0 {
                ongoing.parts.push(Part::Stand(n.grasp_of_nothing));
            }
        } else {
            ongoing.parts.push(Part::Grasp { left: n.grasp, hand, object });
        }
        let is_furniture = hand.is_none();
        let back = if is_furniture { n.raise_furniture } else { n.return_arms };
        ongoing.parts.push(Part::Arms(back));
        PartStatus::TakesNoTime
    }

    /// Closes the hand around an object, which may break. The remaining parts follow.
    pub(crate) fn close_hand(
        &mut self,
        agent: AgentId,
        ongoing: &mut OngoingAction,
        hand: Option<Hand>,
        object: EntityId,
    ) {
        let n = self.facts.numbers;
        if let Some(reason) = self.refusal(agent, object, hand.unwrap_or(Hand::Right)) {
            ongoing.failing = Some(reason);
            self.cancel_carry(agent, reason);
            return;
        }
        self.state.touched.push(object);
        if ongoing.failing == Some(FailureReason::Broke) {
            self.thing_mut(object).location = Location::Broken;
            self.emit(EventKind::Broke { agent, object });
            self.drop_stack(object);
            return;
        }
        let thing = self.thing_mut(object);
        thing.location = Location::Held(agent, hand.unwrap_or(Hand::Right));
        thing.last_holder = Some(agent);
        thing.put_at = None;
        match hand {
            Some(Hand::Left) => self.person_mut(agent).hands[0] = Some(object),
            Some(Hand::Right) => self.person_mut(agent).hands[1] = Some(object),
            None => self.person_mut(agent).hands = [Some(object), Some(object)],
        }
        self.emit(EventKind::Taken { agent, object });
        for inside in self.contents(object) {
            self.thing_mut(inside).last_holder = Some(agent);
        }
        self.drop_stack(object);
        if let Some(bicycle) = self.bicycle(agent)
            && hand.is_some()
        {
            let insert = Part::Insert {
                open: n.open_hand,
                rest: 0,
                object,
                container: bicycle,
                is_watched: false,
            };
            ongoing.parts.truncate(1);
            ongoing.parts.extend([Part::Arms(n.reach), insert, Part::Arms(n.reach)]);
        } else if matches!(ongoing.action, Action::RemoveObstacle { .. }) {
            ongoing.parts.truncate(1);
            ongoing.parts.extend([
                Part::Arms(n.return_arms),
                Part::Stand(n.turn),
                Part::Arms(n.reach),
                Part::Stand(n.gap),
                Part::Arms(n.reach),
                Part::Release { open: n.open_hand, watch: 0, object, on: None, sets_down: true },
                Part::Arms(n.return_arms),
            ]);
        }
        if let Some(carry) = &mut self.state.carry
            && carry.leader == agent
            && carry.object == object
        {
            carry.has_begun = true;
            let (leader, follower) = (carry.leader, carry.follower);
            self.emit(EventKind::LiftedTogether { leader, follower, object });
        }
    }

    /// Lets everything fall that stood, directly or not, on an object.
    fn drop_stack(&mut self, object: EntityId) {
        for entity in self.facts.setup.entities() {
            let thing = self.thing(entity);
            let is_movable =
                !matches!(self.role(entity), Role::Furnishing | Role::Vehicle | Role::Person);
            if thing.location == Location::Rests(Some(object))
                && thing.delivered.is_none()
                && is_movable
            {
                self.thing_mut(entity).location = Location::Falls;
                self.state.touched.push(entity);
                self.emit(EventKind::LostSupport { object: entity });
                self.drop_stack(entity);
            }
        }
    }

    /// Decides a put-on.
    pub(crate) fn decide_put(
        &mut self,
        agent: AgentId,
        ongoing: &mut OngoingAction,
        hand: Option<Hand>,
        place: EntityId,
    ) -> PartStatus {
        let n = self.facts.numbers;
        if !matches!(self.thing(place).location, Location::Rests(_)) {
            return PartStatus::Failed(FailureReason::Impossible);
        }
        if self.is_paper() {
            let is_within_reach = self.is_within_reach(agent, place);
            if !self.choices.decide(is_within_reach) {
                return PartStatus::Failed(FailureReason::Blocked);
            }
        }
        let objects = self.objects_to_put(agent, hand.unwrap_or(Hand::Right));
        if objects.is_empty() {
            return PartStatus::Failed(FailureReason::HandEmpty);
        }
        ongoing.parts.truncate(1);
        ongoing.parts.push(Part::Stand(n.turn));
        if let Some(object) = self.furniture(agent) {
            let (open, on) = (n.open_hand, Some(place));
            ongoing.parts.extend([
                Part::Arms(n.reach),
                Part::Release { open, watch: 0, object, on, sets_down: true },
                Part::Arms(n.return_arms),
            ]);
            return PartStatus::TakesNoTime;
        }
        let height_m = self.geometry().top_m(&self.state.scene, place);
        let p = probability(outside_m(height_m, self.limits(agent).put_m), 1.0, 1.0);
        let count = self.person(agent).n_put_on;
        self.person_mut(agent).n_put_on += 1;
        let succeeds = self.draw(agent, "put on", count, p);
        let is_rider = self.bicycle(agent).is_some();
        let drop = |object: EntityId, on: Option<EntityId>, watch: u32| Part::Release {
            open: n.open_hand,
            watch,
            object,
            on,
            sets_down: false,
        };
        let from_basket = [Part::Arms(n.reach), Part::Stand(n.grasp + n.gap)];
        if !succeeds {
            ongoing.failing = Some(FailureReason::BeyondLimits);
        }
        if succeeds && is_rider {
            for object in objects {
                ongoing.parts.extend(from_basket);
                ongoing.parts.extend([Part::Arms(n.reach), drop(object, Some(place), 0)]);
            }
            ongoing.parts.push(Part::Arms(n.reach));
            return PartStatus::TakesNoTime;
        }
        if is_rider {
            ongoing.parts.extend(from_basket);
        }
        let on = if succeeds { Some(place) } else { None };
        ongoing.parts.extend([
            Part::Stand(n.gap),
            Part::Arms(n.reach),
            Part::Stand(n.gap),
            Part::Arms(n.reach),
            Part::Stand(n.gap),
            drop(objects[0], on, n.max_fall_wait),
            Part::Stand(n.gap),
            Part::Arms(if is_rider { n.reach } else { n.return_arms }),
        ]);
        PartStatus::TakesNoTime
    }

    /// Draws how long a person watches an object that was put into a container.
    pub(crate) fn draw_watch(&mut self, agent: AgentId) -> u32 {
        let count = self.person(agent).n_put_in;
        self.person_mut(agent).n_put_in += 1;
        let index = u64::from(agent.0) << 32 | u64::from(count);
        let mut stream = RngStream::new(self.facts.setup.seed, "watch put in", index);
        stream.below(self.facts.numbers.max_put_in_wait as usize + 1) as u32
    }

    /// Puts an object from a hand into the first free slot of a container or basket.
    pub(crate) fn insert(&mut self, agent: AgentId, object: EntityId, container: EntityId) {
        let mut slot = 0;
        while self
            .facts
            .setup
            .entities()
            .any(|e| self.thing(e).location == Location::Inside(container, slot))
        {
            slot += 1;
        }
        self.empty_hands_of(agent, object);
        self.thing_mut(object).location = Location::Inside(container, slot);
        self.emit(EventKind::Stowed { agent, object, container });
    }

    fn empty_hands_of(&mut self, agent: AgentId, object: EntityId) {
        for held in &mut self.person_mut(agent).hands {
            if *held == Some(object) {
                *held = None;
            }
        }
    }

    /// Opens the hand: the object is set down or falls.
    pub(crate) fn release(
        &mut self,
        agent: AgentId,
        object: EntityId,
        on: Option<EntityId>,
        sets_down: bool,
    ) {
        self.empty_hands_of(agent, object);
        self.state.touched.push(object);
        self.emit(EventKind::Released { agent, object, on });
        let goal = on.filter(|place| self.facts.setup.goal_places.contains(place));
        // Someone may have taken the place meanwhile.
        let is_there =
            on.is_none_or(|place| matches!(self.thing(place).location, Location::Rests(_)));
        let stands = sets_down && is_there;
        let thing = self.thing_mut(object);
        thing.last_holder = Some(agent);
        thing.put_at = goal;
        thing.location = if stands { Location::Rests(on) } else { Location::Falls };
        if stands {
            self.deliver_if_at_goal(object);
            if on.is_none() {
                self.emit(EventKind::ObstacleRemoved { agent, object });
            }
        }
        if let Some(carry) = self.state.carry
            && carry.object == object
        {
            // The pick-up of the follower succeeds after a pause.
            self.state.carry = None;
            let gap = self.facts.numbers.gap;
            if let Some(ongoing) = &mut self.person_mut(carry.follower).ongoing {
                ongoing.parts = vec![Part::Stand(gap)];
            }
        }
    }

    /// Ends a joint lift whose leader could not grasp.
    fn cancel_carry(&mut self, leader: AgentId, reason: FailureReason) {
        let Some(carry) = self.state.carry.filter(|c| c.leader == leader) else { return };
        self.state.carry = None;
        if let Some(ongoing) = &mut self.person_mut(carry.follower).ongoing {
            ongoing.failing = Some(reason);
            ongoing.parts = vec![Part::Stand(1)];
        }
    }
}

/// Returns the probability that a vase breaks whose top is this much above the range of a child.
fn probability_of_breaking(above_m: f64, within: f64, above: f64) -> [f64; 2] {
    match Verdict::at_most(above_m, 0.0) {
        Verdict::Yes => [within; 2],
        Verdict::No => [above; 2],
        Verdict::Open => [within, above],
    }
}
