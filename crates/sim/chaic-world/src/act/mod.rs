//! How each action is made of steps, and where luck and limits come in.
//!
//! There is one implementation of each action for everybody; who may be blocked, who is too
//! short and who is too weak is in [`Capability`](chaic_core::capability::Capability).

mod joint_lift;
mod put;
mod take;

use chaic_core::action::{FailureReason, Hand};
use chaic_core::catalogue::Role;
use chaic_core::geom::{horizontal_distance, wrap_angle, xz};
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Vec3};

use crate::event::EventKind;
use crate::rules::{JointLift, ReachTo};
use crate::state::{Activity, Phase, Place, Step};
use crate::world::World;

impl World {
    /// Begins an action: checks what can be known at once and lays out the steps.
    ///
    /// Reach and sight come first: whatever is not there to be felt or seen fails for one reason
    /// and in the same time, be it far away, in somebody's hands elsewhere, or nothing at all.
    pub(crate) fn begin(&mut self, agent: AgentId, action: ResolvedAction) {
        let steps = match action.subject() {
            Some(subject) if !self.is_at_hand(agent, subject) => Err(FailureReason::OutOfReach),
            _ => self.steps_of(agent, action),
        };
        let (mut queue, failing) = match steps {
            Ok(queue) => (queue, None),
            Err(reason) => {
                let is_taking =
                    matches!(action, Action::PickUp { .. } | Action::RemoveObstacle { .. });
                let frames = if is_taking { self.rules.durations.refused_pick } else { 1 };
                (vec![Step::of(Phase::Stand, frames)], Some(reason))
            }
        };
        let step = queue.pop().expect("every action has at least one step");
        self.person_mut(agent).in_stride &= action == Action::MoveForward;
        let since = self.state.frame;
        self.happened(EventKind::Began { agent, action });
        self.person_mut(agent).activity = Some(Activity { action, since, step, queue, failing });
        if self.rules.joint_lift == JointLift::LastChoice && failing.is_none() {
            self.call_to_lift(agent, action);
        }
    }

    /// The first steps of an action, next one last; later ones are added by the judging steps.
    fn steps_of(&self, agent: AgentId, action: ResolvedAction) -> Result<Vec<Step>, FailureReason> {
        let d = &self.rules.durations;
        let person = self.person(agent);
        match action {
            Action::MoveForward => {
                let latency = if person.in_stride { d.keep_walking } else { d.start_walking };
                let walk = Phase::Walk { left_m: self.rules.stride_m, made_m: 0.0 };
                Ok(vec![Step::of(walk, 0), Step::of(Phase::Stand, latency)])
            }
            Action::TurnLeft | Action::TurnRight => {
                let sign = if action == Action::TurnLeft { 1.0 } else { -1.0 };
                let to_yaw_rad = wrap_angle(person.pose.yaw_rad + sign * self.rules.turn_rad);
                Ok(vec![Step::of(Phase::Turn { to_yaw_rad }, d.turn)])
            }
            Action::Wait { frames } => {
                Ok(vec![Step::of(Phase::Stand, frames.clamp(1, self.setup.horizon))])
            }
            Action::PickUp { object, hand } => {
                self.check_takeable(agent, object, hand)?;
                let role = self.thing(object).0.class.info().role;
                let heavy = role == Role::HeavyTarget;
                let hand = if heavy {
                    None
                } else if self.vehicle(agent).is_some() {
                    Some(Hand::Right)
                } else {
                    Some(hand)
                };
                let mut steps = vec![Step::of(Phase::JudgeTake { hand, object }, 0)];
                if heavy {
                    steps.push(Step::of(Phase::AwaitPartner { object, absent: 0 }, 0));
                }
                let docking = self.capability(agent).docking_frames;
                if docking > 0 && self.vehicle(agent).is_some() {
                    steps.push(Step::of(Phase::Dock, docking));
                }
                self.push_approach(agent, object, &mut steps);
                Ok(steps)
            }
            Action::RemoveObstacle { obstacle, hand } => {
                self.check_takeable(agent, obstacle, hand)?;
                if self.thing(obstacle).0.class.info().role != Role::Obstacle {
                    return Err(FailureReason::Impossible);
                }
                let judge = Phase::JudgeTake { hand: Some(hand), object: obstacle };
                let mut steps = vec![Step::of(judge, 0)];
                self.push_approach(agent, obstacle, &mut steps);
                Ok(steps)
            }
            Action::PutOn { place, hand } => {
                if self.to_put_down(agent, hand).is_empty() {
                    return Err(FailureReason::HandEmpty);
                }
                if !self.thing(place).1.is_resting() || self.root(place) != place {
                    return Err(FailureReason::Impossible);
                }
                let heavy = self.holds_furniture(agent).is_some();
                let whole = heavy || self.vehicle(agent).is_some();
                let hand = if whole { None } else { Some(hand) };
                let mut steps = vec![Step::of(Phase::JudgePut { hand, place }, 0)];
                self.push_approach(agent, place, &mut steps);
                Ok(steps)
            }
            Action::PutIn => {
                let (object, container, hand) = self.check_put_in(agent)?;
                Ok(self.put_in_steps(agent, object, container, hand))
            }
        }
    }

    /// Steps for walking up to a thing, if it isn't within reach.
    fn push_approach(&self, agent: AgentId, to: EntityId, steps: &mut Vec<Step>) {
        if self.distance_to(agent, to) <= self.rules.arm_reach_m {
            steps.push(Step::of(Phase::Stand, 1));
        } else {
            steps.push(Step::of(Phase::Approach { to, stuck: 0 }, 0));
            steps.push(Step::of(Phase::Stand, self.rules.durations.start_walking));
        }
    }

    fn reach(&self, hand: Option<Hand>, to: Vec3) -> Step {
        Step::of(Phase::Reach { hand, to, fails: false }, self.rules.durations.reach)
    }

    fn reset_arms(&self, hand: Option<Hand>, from: Vec3) -> Step {
        Step::of(Phase::ResetArms { from: Some(from), hand }, self.rules.durations.reset_arms)
    }

    /// Lifting what both hands have closed around.
    fn raise_furniture(&self, from: Vec3) -> Step {
        let arms = Phase::ResetArms { from: Some(from), hand: None };
        Step::of(arms, self.rules.durations.raise_furniture)
    }

    fn gap(&self) -> Step {
        Step::of(Phase::Stand, self.rules.durations.gap)
    }

    /// Whether a thing exists, may be stepped up to from here (facts S3.4), and is
    /// not behind a wall where walls count. Furniture that two carry is brought by either of them.
    fn is_at_hand(&self, agent: AgentId, entity: EntityId) -> bool {
        if !self.is_visible(entity) {
            return false;
        }
        let (thing, state) = self.thing(entity);
        let limit_m = self.rules.approach_limit_m + thing.half_longer_side_m();
        let joint = self.state.joint.filter(|j| j.leader == agent && j.under_way);
        let near = |a: AgentId| {
            let from = self.person(a).pose.position;
            let is_in_sight = |to| !self.wall_between(from, to);
            horizontal_distance(from, state.position) <= limit_m
                && (self.rules.reach_to == ReachTo::Middle
                    || is_in_sight(state.position)
                    || is_in_sight(self.nearest_point(from, entity)))
        };
        near(agent) || joint.is_some_and(|j| near(j.follower))
    }

    /// Whether a hand gets at a thing from where its owner stands now.
    fn check_within_reach(&self, agent: AgentId, entity: EntityId) -> Result<(), FailureReason> {
        let is_heavy = self.thing(entity).0.class.info().role == Role::HeavyTarget;
        let limit_m =
            if is_heavy { self.rules.furniture_reach_limit_m } else { self.rules.reach_limit_m };
        if self.reach_distance(agent, entity) > limit_m {
            return Err(FailureReason::Blocked);
        }
        if self.rules.reach_to == ReachTo::Middle {
            return Ok(());
        }
        let from = self.person(agent).pose.position;
        let to = self.nearest_point(from, entity);
        if self.wall_between(from, to) { Err(FailureReason::Blocked) } else { Ok(()) }
    }

    /// Whether a wall that stands on the floor crosses the line between two points in plan.
    fn wall_between(&self, from: Vec3, to: Vec3) -> bool {
        /// Spacing of the points looked at; walls are at least twice as thick in practice.
        const SPACING_M: f32 = 0.04;
        let n = (horizontal_distance(from, to) / SPACING_M).ceil() as u32;
        (1..n).any(|i| {
            let p = from.lerp(to, i as f32 / n as f32);
            let mut walls = self.block_index.near(xz(p)).filter(|b| b.entity == EntityId::WALL);
            walls.any(|b| b.y_range()[0] < self.rules.step_over_m && b.nearest_in_plan(p).1)
        })
    }

    /// The thing that carries this one: itself, or the container it is in.
    pub(crate) fn root(&self, entity: EntityId) -> EntityId {
        match self.thing(entity).1.place {
            Place::Inside { container, .. } => container,
            _ => entity,
        }
    }

    pub(crate) fn holds_furniture(&self, agent: AgentId) -> Option<EntityId> {
        let [left, right] = self.person(agent).hands;
        if left == right { left } else { None }
    }
}
