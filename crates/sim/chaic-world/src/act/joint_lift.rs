//! Lifting furniture by two, and turning with it.

use chaic_core::action::FailureReason;
use chaic_core::catalogue::Role;
use chaic_core::geom::{Pose, horizontal_distance};
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Vec3};

use crate::event::EventKind;
use crate::rules::Blocking;
use crate::state::{Activity, JointCarry, Phase, Step};
use crate::tick::Progress;
use crate::world::World;

impl World {
    /// Waits at furniture for somebody else who is after the same piece, and starts a joint lift
    /// when both stand at it.
    pub(crate) fn await_partner(&mut self, agent: AgentId, activity: &mut Activity) -> Progress {
        /// Between two attempts the other is asked again; that must not count as giving up.
        const GRACE_FRAMES: u32 = 3;
        let elapsed = activity.step.elapsed;
        let Phase::AwaitPartner { object, absent } = &mut activity.step.phase else {
            return Progress::Done;
        };
        let object = *object;
        let after_it = |a: &AgentId| {
            let other = self.person(*a).activity.as_ref();
            *a != agent
                && other.is_some_and(|o| o.action.subject() == Some(object) && is_pick_up(o.action))
        };
        let other = self.setup.agents().find(after_it);
        let Some(other) = other else {
            *absent += 1;
            return if *absent >= GRACE_FRAMES { Progress::Done } else { Progress::Goes };
        };
        *absent = 0;
        if self.check_within_reach(agent, object).is_err() {
            return Progress::Fails(FailureReason::Blocked);
        }
        let ready = matches!(
            self.person(other).activity.as_ref().map(|a| a.step.phase),
            Some(Phase::AwaitPartner { .. })
        ) && self.check_within_reach(other, object).is_ok();
        if !ready {
            let patience = self.rules.durations.await_partner;
            return if elapsed >= patience { Progress::Done } else { Progress::Goes };
        }
        self.begin_joint_lift(agent, other, activity, object);
        Progress::Instant
    }

    /// Somebody chooses a piece of furniture: whoever chose the same piece last drops what it does
    /// and goes there too ([`JointLift::LastChoice`](crate::JointLift)).
    pub(super) fn call_to_lift(&mut self, agent: AgentId, action: ResolvedAction) {
        let Action::PickUp { object, .. } = action else { return };
        if self.thing(object).0.class.info().role != Role::HeavyTarget {
            return;
        }
        let chose_it = |a: &AgentId| {
            let person = self.person(*a);
            let last = person.activity.as_ref().map(|o| o.action).or(person.last.map(|l| l.0));
            *a != agent && last.is_some_and(|o| is_pick_up(o) && o.subject() == Some(object))
        };
        let Some(other) = self.setup.agents().find(chose_it) else { return };
        let Ok(mut queue) = self.steps_of(other, action) else { return };
        let Some(step) = queue.pop() else { return };
        let theirs = Activity { action, since: self.state.frame, step, queue, failing: None };
        self.person_mut(other).activity = Some(theirs);
        self.happened(EventKind::Began { agent: other, action });
        // Both bring their arms back first.
        let frames = self.rules.durations.reset_arms;
        let arms = Step::of(Phase::ResetArms { from: None, hand: None }, frames);
        for both in [agent, other] {
            if let Some(activity) = self.person_mut(both).activity.as_mut() {
                activity.queue.push(std::mem::replace(&mut activity.step, arms));
            }
        }
    }

    /// Lays out the steps of both: the one with the lower id leads.
    fn begin_joint_lift(
        &mut self,
        agent: AgentId,
        other: AgentId,
        activity: &mut Activity,
        object: EntityId,
    ) {
        let (leader, follower) = if agent < other { (agent, other) } else { (other, agent) };
        let d = self.rules.durations;
        let (thing, state) = self.thing(object);
        let to = state.position + Vec3::Y * 0.5 * thing.size_m().y;
        let lead = vec![
            self.raise_furniture(to),
            Step::of(Phase::Grasp { hand: None, object }, d.grasp),
            self.gap(),
            self.reach(None, to),
            self.gap(),
            Step::of(Phase::Face { to: object }, d.turn),
        ];
        let follow = vec![
            Step::of(Phase::CarryAlong, 0),
            self.reach(None, to),
            self.gap(),
            Step::of(Phase::Face { to: object }, d.turn),
        ];
        self.state.joint = Some(JointCarry {
            object,
            leader,
            follower,
            follower_in_leader: Vec3::ZERO,
            under_way: false,
        });
        let (own, others) = if agent == leader { (lead, follow) } else { (follow, lead) };
        activity.queue = own;
        if let Some(theirs) = self.person_mut(other).activity.as_mut() {
            theirs.queue = others;
            theirs.step = theirs.queue.pop().expect("both have steps");
        }
    }

    /// The leader has the furniture: from now on the follower goes along.
    pub(super) fn finish_joint_lift(&mut self, agent: AgentId, object: EntityId) {
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
        self.happened(EventKind::LiftedTogether { leader: agent, follower, object });
    }

    /// Makes room for a turn of who leads at furniture, which swings the other one around: where
    /// something is in the other's way, the leader steps so that the two turn about the other.
    /// Returns whether there is room.
    pub(crate) fn make_room_to_turn(&mut self, agent: AgentId, yaw_rad: f32) -> bool {
        let joint = self.state.joint.filter(|j| j.leader == agent && j.under_way);
        let Some(joint) = joint.filter(|_| self.rules.blocking == Blocking::Stops) else {
            return true;
        };
        let pose = self.person(agent).pose;
        let other = pose.to_world(joint.follower_in_leader);
        let swung = Pose { yaw_rad, ..pose }.to_world(joint.follower_in_leader);
        if self.has_room(joint.follower, agent, other, swung) {
            return true;
        }
        let stepped = pose.position + other - swung;
        let has_room = self.has_room(agent, joint.follower, pose.position, stepped);
        if has_room {
            let person = self.person_mut(agent);
            person.pose.position = stepped;
            person.walked_m += horizontal_distance(pose.position, stepped);
        }
        has_room
    }

    /// Whether one of two who carry furniture can be moved from one point to another, and stands there
    /// no tighter than before.
    fn has_room(&self, agent: AgentId, partner: AgentId, from: Vec3, to: Vec3) -> bool {
        /// Nearer to things than this is as good as beside them, metres.
        const SLACK_M: f32 = 0.02;
        let pushed = |to: Vec3| horizontal_distance(self.slide(agent, Some(partner), from, to), to);
        pushed(to) <= pushed(from).max(SLACK_M)
    }

    /// A joint lift that can't be: the follower is free again.
    pub(super) fn abandon_joint(&mut self, leader: AgentId, reason: FailureReason) {
        if let Some(joint) = self.state.joint.take_if(|j| j.leader == leader)
            && let Some(activity) = self.person_mut(joint.follower).activity.as_mut()
        {
            activity.failing = Some(reason);
            activity.queue.clear();
            activity.step = Step::of(Phase::Stand, 1);
        }
    }

    /// The furniture is down: the follower's own pick-up ends well.
    pub(super) fn end_joint_carry(&mut self) {
        let Some(joint) = self.state.joint.take() else { return };
        let gap = self.gap();
        if let Some(activity) = self.person_mut(joint.follower).activity.as_mut() {
            activity.queue.clear();
            activity.step = gap;
        }
    }
}

fn is_pick_up(action: ResolvedAction) -> bool {
    matches!(action, Action::PickUp { .. })
}
