//! Start of an action: conditions, and the parts up to the decision on its success.

use chaic_core::action::{Action, FailureReason, Hand};
use chaic_core::catalogue::Role;
use chaic_core::geom::wrap_angle;
use chaic_core::{AgentId, EntityId, ResolvedAction};
use chaic_world::EventKind;

use crate::state::{Location, OngoingAction, Part};
use crate::turn::Turn;
use crate::verdict::Verdict;

impl Turn<'_> {
    /// Starts an action of a waiting person.
    pub(crate) fn begin(&mut self, agent: AgentId, action: ResolvedAction) {
        let is_accessible = match action.subject() {
            Some(subject) => self.is_accessible(agent, subject),
            None => Verdict::Yes,
        };
        let plan = if self.choices.decide(is_accessible) {
            self.plan(agent, action)
        } else {
            Err(FailureReason::OutOfReach)
        };
        let is_taking = matches!(action, Action::PickUp { .. } | Action::RemoveObstacle { .. });
        let refusal_frames = if is_taking { self.facts.numbers.refused_pick_up } else { 1 };
        let (parts, failing) = match plan {
            Ok(parts) => (parts, None),
            Err(reason) => (vec![Part::Stand(refusal_frames)], Some(reason)),
        };
        if action != Action::MoveForward {
            self.person_mut(agent).in_stride = false;
        }
        self.emit(EventKind::Began { agent, action });
        let since = self.state.frame;
        self.person_mut(agent).ongoing = Some(OngoingAction { action, since, failing, parts });
        if !self.is_paper() && failing.is_none() {
            self.call_other_to_lift(agent, action);
        }
    }

    /// Returns the parts of an action that can begin, or the reason why it cannot.
    fn plan(&mut self, agent: AgentId, action: ResolvedAction) -> Result<Vec<Part>, FailureReason> {
        let n = self.facts.numbers;
        match action {
            Action::MoveForward => {
                let walks = self.person(agent).in_stride;
                let latency = if walks { n.keep_walking } else { n.start_walking };
                let walk = Part::Walk { left_m: n.stride_m, covered_m: 0.0 };
                Ok(vec![Part::Stand(latency), walk])
            }
            Action::TurnLeft | Action::TurnRight => {
                let by = if action == Action::TurnLeft { n.turn_deg } else { -n.turn_deg };
                let yaw = self.state.scene.people[agent.index()].yaw_rad;
                let yaw_rad = wrap_angle(yaw + by.to_radians());
                Ok(vec![Part::Turn { left: n.turn, yaw_rad }])
            }
            Action::Wait { frames } => {
                Ok(vec![Part::Stand(frames.max(1).min(self.facts.setup.horizon))])
            }
            Action::PickUp { object, hand } => self.plan_pick_up(agent, object, hand),
            Action::RemoveObstacle { obstacle, hand } => {
                if let Some(reason) = self.refusal(agent, obstacle, hand) {
                    return Err(reason);
                }
                if self.role(obstacle) != Role::Obstacle {
                    return Err(FailureReason::Impossible);
                }
                let mut parts = self.approach(agent, obstacle);
                parts.push(Part::DecideTake { hand: Some(hand), object: obstacle });
                Ok(parts)
            }
            Action::PutOn { place, hand } => {
                if self.objects_to_put(agent, hand).is_empty() {
                    return Err(FailureReason::HandEmpty);
                }
                if !matches!(self.thing(place).location, Location::Rests(_)) {
                    return Err(FailureReason::Impossible);
                }
                let is_one_hand = self.furniture(agent).is_none() && self.bicycle(agent).is_none();
                let mut parts = self.approach(agent, place);
                parts.push(Part::DecidePut { hand: is_one_hand.then_some(hand), place });
                Ok(parts)
            }
            Action::PutIn => self.plan_put_in(agent),
        }
    }

    fn plan_pick_up(
        &mut self,
        agent: AgentId,
        object: EntityId,
        hand: Hand,
    ) -> Result<Vec<Part>, FailureReason> {
        if let Some(reason) = self.refusal(agent, object, hand) {
            return Err(reason);
        }
        let is_furniture = self.role(object) == Role::HeavyTarget;
        let mut parts = self.approach(agent, object);
        if self.bicycle(agent).is_some() {
            parts.push(Part::Stand(self.limits(agent).docking));
        }
        if is_furniture {
            parts.push(Part::AwaitOther { object, waited: 0, n_alone: 0 });
        }
        let hand = if is_furniture {
            None
        } else if self.bicycle(agent).is_some() {
            Some(Hand::Right)
        } else {
            Some(hand)
        };
        parts.push(Part::DecideTake { hand, object });
        Ok(parts)
    }

    fn plan_put_in(&mut self, agent: AgentId) -> Result<Vec<Part>, FailureReason> {
        let n = self.facts.numbers;
        let [left, right] = self.person(agent).hands;
        let (Some(left), Some(right)) = (left, right) else {
            return Err(FailureReason::NotContainerAndTarget);
        };
        let is_container = |e: EntityId| self.role(e) == Role::Container;
        let is_target = |e: EntityId| matches!(self.role(e), Role::Target | Role::Fragile);
        let (object, container) = if is_target(left) && is_container(right) {
            (left, right)
        } else if is_target(right) && is_container(left) {
            (right, left)
        } else {
            return Err(FailureReason::NotContainerAndTarget);
        };
        if self.contents(container).len() >= n.capacity {
            return Err(FailureReason::Full);
        }
        // The object stays a frame longer in the air and one beside the container.
        let insert = Part::Insert {
            open: n.open_hand,
            rest: 2 * n.gap,
            object,
            container,
            is_watched: true,
        };
        Ok(vec![
            Part::Stand(n.gap),
            Part::Stand(n.move_arm_away),
            Part::Stand(n.gap),
            Part::Arms(n.reach),
            Part::Stand(n.gap),
            Part::Arms(n.reach),
            Part::Stand(n.gap),
            insert,
            Part::Stand(n.gap),
            Part::Arms(n.return_arms),
        ])
    }

    /// Returns the parts that bring a person to an object.
    fn approach(&mut self, agent: AgentId, to: EntityId) -> Vec<Part> {
        let is_there = self.is_at_arms_length(agent, to);
        if self.choices.decide(is_there) {
            vec![Part::Stand(1)]
        } else {
            let start = self.facts.numbers.start_walking;
            vec![Part::Stand(start), Part::Approach { to, n_stuck: 0 }]
        }
    }

    /// Calls the person whose current or last action was a pick-up of the same furniture (rules of
    /// the original). Both return their arms first.
    fn call_other_to_lift(&mut self, agent: AgentId, action: ResolvedAction) {
        let Action::PickUp { object, .. } = action else { return };
        if self.role(object) != Role::HeavyTarget {
            return;
        }
        let is_same = |a: ResolvedAction| matches!(a, Action::PickUp { object: other, .. } if other == object);
        let called = self.agents().filter(|a| *a != agent).find(|a| {
            let person = self.person(*a);
            let current = person.ongoing.as_ref().map(|d| d.action);
            current.or(person.last.map(|(action, _)| action)).is_some_and(is_same)
        });
        let Some(other) = called else { return };
        let Ok(parts) = self.plan(other, action) else { return };
        let since = self.state.frame;
        self.person_mut(other).ongoing =
            Some(OngoingAction { action, since, failing: None, parts });
        self.emit(EventKind::Began { agent: other, action });
        let return_arms = Part::Arms(self.facts.numbers.return_arms);
        for who in [agent, other] {
            if let Some(ongoing) = &mut self.person_mut(who).ongoing {
                ongoing.parts.insert(0, return_arms);
            }
        }
    }
}
