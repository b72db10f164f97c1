//! Implementation of the actions: their steps, random draws and limits.
//!
//! Every action has one implementation for all agents. Individual limits, such as radius, height
//! range and strength, are in [`Capability`](chaic_core::capability::Capability).

mod joint_lift;
mod put;
mod take;

use chaic_core::action::{FailureReason, Hand};
use chaic_core::catalogue::Role;
use chaic_core::geom::{horizontal_distance, to_xz, wrap_angle};
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Vec3};

use crate::event::EventKind;
use crate::rules::{JointLift, ReachReference};
use crate::state::{ActionStep, Activity, ObjectLocation, Phase};
use crate::world::World;

impl World {
    /// Starts an action: checks its preconditions and plans its steps.
    ///
    /// Reach and visibility are checked first. Every object that the agent can neither touch nor
    /// see fails with the same reason after the same time, whether it is far away, held elsewhere
    /// or nonexistent.
    pub(crate) fn start_action(&mut self, agent: AgentId, action: ResolvedAction) {
        let steps = match action.subject() {
            Some(subject) if !self.is_accessible(agent, subject) => Err(FailureReason::OutOfReach),
            _ => self.plan_steps(agent, action),
        };
        let (mut queue, failing) = match steps {
            Ok(queue) => (queue, None),
            Err(reason) => {
                let is_taking =
                    matches!(action, Action::PickUp { .. } | Action::RemoveObstacle { .. });
                let frames = if is_taking { self.rules.durations.refused_pick_up } else { 1 };
                (vec![ActionStep::new(Phase::Stand, frames)], Some(reason))
            }
        };
        let step = queue.pop().expect("every action has at least one step");
        self.person_mut(agent).in_stride &= action == Action::MoveForward;
        let since = self.state.frame;
        self.record_event(EventKind::Began { agent, action });
        self.person_mut(agent).activity = Some(Activity { action, since, step, queue, failing });
        if self.rules.joint_lift == JointLift::LastChoice && failing.is_none() {
            self.call_partner_to_lift(agent, action);
        }
    }

    /// Plans the first steps of an action, in reverse order. `Decide...` phases add later steps.
    fn plan_steps(
        &self,
        agent: AgentId,
        action: ResolvedAction,
    ) -> Result<Vec<ActionStep>, FailureReason> {
        let d = &self.rules.durations;
        let person = self.person(agent);
        match action {
            Action::MoveForward => {
                let latency = if person.in_stride { d.keep_walking } else { d.start_walking };
                let walk = Phase::Walk { remaining_m: self.rules.stride_m, covered_m: 0.0 };
                Ok(vec![ActionStep::new(walk, 0), ActionStep::new(Phase::Stand, latency)])
            }
            Action::TurnLeft | Action::TurnRight => {
                let sign = if action == Action::TurnLeft { 1.0 } else { -1.0 };
                let to_yaw_rad = wrap_angle(person.pose.yaw_rad + sign * self.rules.turn_rad);
                Ok(vec![ActionStep::new(Phase::Turn { to_yaw_rad }, d.turn)])
            }
            Action::Wait { frames } => {
                Ok(vec![ActionStep::new(Phase::Stand, frames.clamp(1, self.setup.horizon))])
            }
            Action::PickUp { object, hand } => {
                self.check_takeable(agent, object, hand)?;
                let role = self.object(object).0.class.info().role;
                let is_heavy = role == Role::HeavyTarget;
                let hand = if is_heavy {
                    None
                } else if self.vehicle(agent).is_some() {
                    Some(Hand::Right)
                } else {
                    Some(hand)
                };
                let mut steps = vec![ActionStep::new(Phase::DecidePickUp { hand, object }, 0)];
                if is_heavy {
                    steps.push(ActionStep::new(Phase::WaitForOtherAgent { object, absent: 0 }, 0));
                }
                let docking = self.capability(agent).docking_frames;
                if docking > 0 && self.vehicle(agent).is_some() {
                    steps.push(ActionStep::new(Phase::Dock, docking));
                }
                self.push_approach(agent, object, &mut steps);
                Ok(steps)
            }
            Action::RemoveObstacle { obstacle, hand } => {
                self.check_takeable(agent, obstacle, hand)?;
                if self.object(obstacle).0.class.info().role != Role::Obstacle {
                    return Err(FailureReason::Impossible);
                }
                let judge = Phase::DecidePickUp { hand: Some(hand), object: obstacle };
                let mut steps = vec![ActionStep::new(judge, 0)];
                self.push_approach(agent, obstacle, &mut steps);
                Ok(steps)
            }
            Action::PutOn { place, hand } => {
                if self.objects_to_put(agent, hand).is_empty() {
                    return Err(FailureReason::HandEmpty);
                }
                if !self.object(place).1.is_resting() {
                    return Err(FailureReason::Impossible);
                }
                let uses_both = self.holds_furniture(agent).is_some();
                let hand =
                    if uses_both || self.vehicle(agent).is_some() { None } else { Some(hand) };
                let mut steps = vec![ActionStep::new(Phase::DecidePutOn { hand, place }, 0)];
                self.push_approach(agent, place, &mut steps);
                Ok(steps)
            }
            Action::PutIn => {
                let (object, container, hand) = self.check_put_in(agent)?;
                Ok(self.put_in_steps(agent, object, container, hand))
            }
        }
    }

    /// Adds the steps of an approach to an object, if it is not within reach.
    fn push_approach(&self, agent: AgentId, to: EntityId, steps: &mut Vec<ActionStep>) {
        if self.distance_to(agent, to) <= self.rules.arm_reach_m {
            steps.push(ActionStep::new(Phase::Stand, 1));
        } else {
            steps.push(ActionStep::new(Phase::Approach { to, stuck: 0 }, 0));
            steps.push(ActionStep::new(Phase::Stand, self.rules.durations.start_walking));
        }
    }

    fn reach(&self, hand: Option<Hand>, to: Vec3) -> ActionStep {
        ActionStep::new(Phase::Reach { hand, to, fails: false }, self.rules.durations.reach)
    }

    fn reset_arms(&self, hand: Option<Hand>, from: Vec3) -> ActionStep {
        ActionStep::new(
            Phase::ResetArms { from: Some(from), hand },
            self.rules.durations.reset_arms,
        )
    }

    /// Returns the step that raises furniture in both hands.
    fn raise_furniture(&self, from: Vec3) -> ActionStep {
        let arms = Phase::ResetArms { from: Some(from), hand: None };
        ActionStep::new(arms, self.rules.durations.raise_furniture)
    }

    fn pause(&self) -> ActionStep {
        ActionStep::new(Phase::Stand, self.rules.durations.pause)
    }

    /// Returns whether an object exists, is close enough for an approach (facts S3.4), and is not
    /// behind a wall if the rules test walls. In a joint carry, the position of either agent may
    /// satisfy this.
    fn is_accessible(&self, agent: AgentId, entity: EntityId) -> bool {
        if !self.is_visible(entity) {
            return false;
        }
        let (spec, state) = self.object(entity);
        let limit_m = self.rules.approach_limit_m + spec.half_longer_side_m();
        let joint = self.state.joint.filter(|j| j.leader == agent && j.under_way);
        let is_near = |a: AgentId| {
            let from = self.person(a).pose.position;
            let is_visible = |to| !self.wall_between(from, to);
            horizontal_distance(from, state.position) <= limit_m
                && (self.rules.reach_to == ReachReference::Middle
                    || is_visible(state.position)
                    || is_visible(self.nearest_point(from, entity)))
        };
        is_near(agent) || joint.is_some_and(|j| is_near(j.follower))
    }

    /// Checks that a hand reaches an object from the current position of the agent.
    fn check_within_reach(&self, agent: AgentId, entity: EntityId) -> Result<(), FailureReason> {
        let is_heavy = self.object(entity).0.class.info().role == Role::HeavyTarget;
        let limit_m =
            if is_heavy { self.rules.furniture_reach_limit_m } else { self.rules.reach_limit_m };
        if self.reach_distance(agent, entity) > limit_m {
            return Err(FailureReason::Blocked);
        }
        if self.rules.reach_to == ReachReference::Middle {
            return Ok(());
        }
        let from = self.person(agent).pose.position;
        let to = self.nearest_point(from, entity);
        if self.wall_between(from, to) { Err(FailureReason::Blocked) } else { Ok(()) }
    }

    /// Returns whether a wall that stands on the floor crosses the line between two points in plan.
    fn wall_between(&self, from: Vec3, to: Vec3) -> bool {
        /// Spacing of the sample points; walls are at least twice as thick in practice.
        const SPACING_M: f32 = 0.04;
        let n = (horizontal_distance(from, to) / SPACING_M).ceil() as u32;
        (1..n).any(|i| {
            let p = from.lerp(to, i as f32 / n as f32);
            let near = self.block_index.near(to_xz(p), 0.0);
            let mut walls = near.filter(|b| b.entity == EntityId::WALL);
            walls.any(|b| b.y_range()[0] < self.rules.step_over_m && b.nearest_in_plan(p).1)
        })
    }

    /// Returns the container of an object, or the object itself if it is in none.
    pub(crate) fn outermost(&self, entity: EntityId) -> EntityId {
        match self.object(entity).1.location {
            ObjectLocation::Inside { container, .. } => container,
            _ => entity,
        }
    }

    pub(crate) fn holds_furniture(&self, agent: AgentId) -> Option<EntityId> {
        let [left, right] = self.person(agent).hands;
        if left == right { left } else { None }
    }
}
