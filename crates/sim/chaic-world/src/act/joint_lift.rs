//! Joint lifts of furniture, and turns during a joint carry.

use chaic_core::action::FailureReason;
use chaic_core::catalogue::Role;
use chaic_core::geom::{Pose, horizontal_distance, wrap_angle};
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Vec3};

use crate::event::EventKind;
use crate::rules::CollisionResponse;
use crate::state::{ActionStep, Activity, JointCarry, Phase};
use crate::tick::StepProgress;
use crate::world::World;

impl World {
    /// Waits at furniture for another agent that wants the same piece. Starts a joint lift when
    /// both stand at it.
    pub(crate) fn wait_for_other_agent(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
    ) -> StepProgress {
        /// The other agent may wait for a decision between two attempts; this must not count as
        /// giving up.
        const GRACE_FRAMES: u32 = 3;
        let elapsed = activity.step.elapsed;
        let Phase::WaitForOtherAgent { object, absent } = &mut activity.step.phase else {
            return StepProgress::Done;
        };
        let object = *object;
        let wants_it = |a: &AgentId| {
            let other = self.person(*a).activity.as_ref();
            *a != agent
                && other.is_some_and(|o| o.action.subject() == Some(object) && is_pick_up(o.action))
        };
        let other = self.setup.agents().find(wants_it);
        let Some(other) = other else {
            *absent += 1;
            return if *absent >= GRACE_FRAMES {
                StepProgress::Done
            } else {
                StepProgress::Running
            };
        };
        *absent = 0;
        if self.check_within_reach(agent, object).is_err() {
            return StepProgress::Failed(FailureReason::Blocked);
        }
        let ready = matches!(
            self.person(other).activity.as_ref().map(|a| a.step.phase),
            Some(Phase::WaitForOtherAgent { .. })
        ) && self.check_within_reach(other, object).is_ok();
        if !ready {
            let max_frames = self.rules.durations.await_partner;
            return if elapsed >= max_frames { StepProgress::Done } else { StepProgress::Running };
        }
        self.begin_joint_lift(agent, other, activity, object);
        StepProgress::Instant
    }

    /// Calls the agent that last chose the same piece of furniture. That agent aborts its action
    /// and walks to the furniture too ([`JointLift::LastChoice`](crate::JointLift)).
    pub(super) fn call_partner_to_lift(&mut self, agent: AgentId, action: ResolvedAction) {
        let Action::PickUp { object, .. } = action else { return };
        if self.object(object).0.class.info().role != Role::HeavyTarget {
            return;
        }
        let chose_it = |a: &AgentId| {
            let person = self.person(*a);
            let last = person.activity.as_ref().map(|o| o.action).or(person.last.map(|l| l.0));
            *a != agent && last.is_some_and(|o| is_pick_up(o) && o.subject() == Some(object))
        };
        let Some(other) = self.setup.agents().find(chose_it) else { return };
        let Ok(mut queue) = self.plan_steps(other, action) else { return };
        let Some(step) = queue.pop() else { return };
        let activity = Activity { action, since: self.state.frame, step, queue, failing: None };
        self.person_mut(other).activity = Some(activity);
        self.record_event(EventKind::Began { agent: other, action });
        // Both return their arms first.
        let frames = self.rules.durations.reset_arms;
        let arms = ActionStep::new(Phase::ResetArms { from: None, hand: None }, frames);
        for member in [agent, other] {
            if let Some(activity) = self.person_mut(member).activity.as_mut() {
                activity.queue.push(std::mem::replace(&mut activity.step, arms));
            }
        }
    }

    /// Plans the steps of both agents; the one with the lower id leads.
    fn begin_joint_lift(
        &mut self,
        agent: AgentId,
        other: AgentId,
        activity: &mut Activity,
        object: EntityId,
    ) {
        let (leader, follower) = if agent < other { (agent, other) } else { (other, agent) };
        let d = self.rules.durations;
        let (spec, state) = self.object(object);
        let to = state.position + Vec3::Y * 0.5 * spec.size_m().y;
        let leader_steps = vec![
            self.raise_furniture(to),
            ActionStep::new(Phase::Grasp { hand: None, object }, d.grasp),
            self.pause(),
            self.reach(None, to),
            self.pause(),
            ActionStep::new(Phase::Face { to: object }, d.turn),
        ];
        let follower_steps = vec![
            ActionStep::new(Phase::CarryAlong, 0),
            self.reach(None, to),
            self.pause(),
            ActionStep::new(Phase::Face { to: object }, d.turn),
        ];
        self.state.joint = Some(JointCarry {
            object,
            leader,
            follower,
            follower_in_leader: Vec3::ZERO,
            under_way: false,
        });
        let (own_steps, other_steps) = if agent == leader {
            (leader_steps, follower_steps)
        } else {
            (follower_steps, leader_steps)
        };
        activity.queue = own_steps;
        if let Some(activity) = self.person_mut(other).activity.as_mut() {
            activity.queue = other_steps;
            activity.step = activity.queue.pop().expect("both have steps");
        }
    }

    /// Starts the joint carry: the leader has the furniture, and the follower moves along.
    pub(super) fn start_joint_carry(&mut self, agent: AgentId, object: EntityId) {
        let Some(joint) = self.state.joint.filter(|j| j.leader == agent && j.object == object)
        else {
            return;
        };
        let leader = self.person(agent).pose;
        let follower = self.person(joint.follower).pose.position;
        let offset = follower - leader.position;
        let follower_in_leader = chaic_core::geom::rotate_yaw(offset, -leader.yaw_rad);
        self.state.joint = Some(JointCarry { follower_in_leader, under_way: true, ..joint });
        let follower = joint.follower;
        self.record_event(EventKind::LiftedTogether { leader: agent, follower, object });
    }

    /// Makes room for a turn of the leader, which swings the follower around. If the follower is
    /// blocked anywhere on its way, the leader steps so that both turn about the follower. Returns
    /// whether there is room.
    pub(crate) fn make_room_to_turn(&mut self, agent: AgentId, yaw_rad: f32) -> bool {
        let joint = self.state.joint.filter(|j| j.leader == agent && j.under_way);
        let Some(joint) = joint.filter(|_| self.rules.blocking == CollisionResponse::Stops) else {
            return true;
        };
        let pose = self.person(agent).pose;
        let other = pose.to_world(joint.follower_in_leader);
        let swung = |yaw_rad: f32| Pose { yaw_rad, ..pose }.to_world(joint.follower_in_leader);
        let stepped = |yaw_rad: f32| pose.position + other - swung(yaw_rad);
        // The arc is tested in pieces of at most a radius, as a walk is.
        let radius_m =
            self.capability(agent).radius_m.min(self.capability(joint.follower).radius_m);
        let angle_rad = wrap_angle(yaw_rad - pose.yaw_rad);
        let arc_m = angle_rad.abs() * horizontal_distance(pose.position, other);
        let n = (arc_m / radius_m).ceil() as u32;
        let between = (1..n).map(|i| pose.yaw_rad + angle_rad * (i as f32 / n as f32));
        let yaws: Vec<f32> = between.chain([yaw_rad]).collect();
        if yaws.iter().all(|yaw| self.has_room(joint.follower, agent, other, swung(*yaw))) {
            return true;
        }
        let has_room = yaws
            .iter()
            .all(|yaw| self.has_room(agent, joint.follower, pose.position, stepped(*yaw)));
        if has_room {
            let to = stepped(yaw_rad);
            let person = self.person_mut(agent);
            person.pose.position = to;
            person.walked_m += horizontal_distance(pose.position, to);
        }
        has_room
    }

    /// Returns whether an agent of a joint carry can move between two points without increasing its
    /// overlap.
    fn has_room(&self, agent: AgentId, partner: AgentId, from: Vec3, to: Vec3) -> bool {
        /// Overlap that counts as none, meters.
        const TOLERANCE_M: f32 = 0.02;
        let pushed =
            |to: Vec3| horizontal_distance(self.move_and_slide(agent, Some(partner), from, to), to);
        pushed(to) <= pushed(from).max(TOLERANCE_M)
    }

    /// Cancels a joint lift that failed, which frees the follower.
    pub(super) fn cancel_joint_lift(&mut self, leader: AgentId, reason: FailureReason) {
        if let Some(joint) = self.state.joint.take_if(|j| j.leader == leader)
            && let Some(activity) = self.person_mut(joint.follower).activity.as_mut()
        {
            activity.failing = Some(reason);
            activity.queue.clear();
            activity.step = ActionStep::new(Phase::Stand, 1);
        }
    }

    /// Ends a joint carry: the follower's pick-up succeeds.
    pub(super) fn end_joint_carry(&mut self) {
        let Some(joint) = self.state.joint.take() else { return };
        let pause = self.pause();
        if let Some(activity) = self.person_mut(joint.follower).activity.as_mut() {
            activity.queue.clear();
            activity.step = pause;
        }
    }
}

fn is_pick_up(action: ResolvedAction) -> bool {
    matches!(action, Action::PickUp { .. })
}
