//! How each action is made of steps, and where luck and limits come in.
//!
//! There is one implementation of each action for everybody; who may be blocked, who is too
//! short and who is too weak is in [`Capability`](chaic_protocol::capability::Capability).

use chaic_protocol::action::{FailureReason, Hand};
use chaic_protocol::capability::excess;
use chaic_protocol::catalogue::Role;
use chaic_protocol::geom::{horizontal_distance, wrap_angle, xz};
use chaic_protocol::{Action, AgentId, EntityId, Vec3};

use crate::event::EventKind;
use crate::setup::Setup;
use crate::state::{Activity, JointCarry, Phase, Place, Step};
use crate::tick::Progress;
use crate::world::World;

/// Height above its place at which a thing is let go, metres (facts of the original, 3.7).
const RELEASE_ABOVE_M: f32 = 0.2;

impl World {
    /// Begins an action: checks what can be known at once and lays out the steps.
    pub(crate) fn begin(&mut self, agent: AgentId, action: Action) {
        let (queue, failing) = match self.steps_of(agent, action) {
            Ok(queue) => (queue, None),
            Err(reason) => (vec![Step::of(Phase::Stand, 1)], Some(reason)),
        };
        let mut queue = queue;
        let step = queue.pop().expect("every action has at least one step");
        self.person_mut(agent).in_stride &= action == Action::MoveForward;
        let since = self.state.frame;
        self.happened(EventKind::Began { agent, action });
        self.person_mut(agent).activity = Some(Activity { action, since, step, queue, failing });
    }

    /// The first steps of an action, next one last; later ones are added by the judging steps.
    fn steps_of(&self, agent: AgentId, action: Action) -> Result<Vec<Step>, FailureReason> {
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
                if !heavy {
                    self.check_near(agent, object)?;
                }
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
                self.check_near(agent, obstacle)?;
                let judge = Phase::JudgeTake { hand: Some(hand), object: obstacle };
                let mut steps = vec![Step::of(judge, 0)];
                self.push_approach(agent, obstacle, &mut steps);
                Ok(steps)
            }
            Action::PutOn { place, hand } => {
                if self.setup.thing_index(place).is_none() {
                    return Err(FailureReason::Impossible);
                }
                if self.to_put_down(agent, hand).is_empty() {
                    return Err(FailureReason::HandEmpty);
                }
                if person.hands.contains(&Some(place)) || self.root(place) != place {
                    return Err(FailureReason::Impossible);
                }
                let heavy = self.holds_furniture(agent).is_some();
                if !heavy {
                    self.check_near(agent, place)?;
                }
                let whole = heavy || self.vehicle(agent).is_some();
                let hand = if whole { None } else { Some(hand) };
                let mut steps = vec![Step::of(Phase::JudgePut { hand, place }, 0)];
                self.push_approach(agent, place, &mut steps);
                Ok(steps)
            }
            Action::PutIn => {
                let (object, container, hand) = self.check_put_in(agent)?;
                let to = self.front_of(agent);
                Ok(vec![
                    Step::of(Phase::ResetArms { from: Some(to), hand: Some(hand) }, d.reset_arms),
                    Step::of(Phase::Insert { object, container }, d.open_hand + d.gap),
                    self.reach(Some(hand), to + Vec3::Y * 0.15),
                    Step::of(Phase::Stand, d.gap),
                    self.reach(Some(hand.other()), to),
                    Step::of(Phase::Stand, d.gap + d.move_away),
                ])
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
        Step::of(Phase::Reach { hand, to, vain: false }, self.rules.durations.reach)
    }

    fn reset_arms(&self, hand: Option<Hand>, from: Vec3) -> Step {
        Step::of(Phase::ResetArms { from: Some(from), hand }, self.rules.durations.reset_arms)
    }

    fn gap(&self) -> Step {
        Step::of(Phase::Stand, self.rules.durations.gap)
    }

    /// Whether a thing may be stepped up to from here (facts of the original, 3.4).
    fn check_near(&self, agent: AgentId, entity: EntityId) -> Result<(), FailureReason> {
        let (thing, state) = self.thing(entity);
        let size = thing.size_m();
        let limit = self.rules.approach_limit_m + 0.5 * size.x.max(size.z);
        let distance = horizontal_distance(self.person(agent).pose.position, state.position);
        if distance > limit { Err(FailureReason::TooFar) } else { Ok(()) }
    }

    /// Whether a hand gets at a thing from where its owner stands now.
    fn check_within_reach(&self, agent: AgentId, entity: EntityId) -> Result<(), FailureReason> {
        if self.reach_distance(agent, entity) > self.rules.reach_limit_m {
            return Err(FailureReason::Blocked);
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
            let mut walls = self.surroundings.near(xz(p)).filter(|b| b.entity == EntityId::WALL);
            walls.any(|b| b.y_range()[0] < self.rules.step_over_m && b.nearest_in_plan(p).1)
        })
    }

    /// Whether this hand could take this thing, as far as can be said before trying.
    fn check_takeable(
        &self,
        agent: AgentId,
        object: EntityId,
        hand: Hand,
    ) -> Result<(), FailureReason> {
        let Some(index) = self.setup.thing_index(object) else {
            return Err(FailureReason::Impossible);
        };
        let (thing, state) = (&self.setup.things[index], &self.state.things[index]);
        if thing.fixed || !thing.class.info().is_movable() {
            return Err(FailureReason::Impossible);
        }
        if state.delivered.is_some() || state.place == Place::Broken {
            return Err(FailureReason::OutOfPlay);
        }
        let root = self.root(object);
        match self.thing(root).1.holder() {
            Some(by) if by != agent => return Err(FailureReason::HeldByOther),
            Some(_) if root == object || self.vehicle(agent) == Some(root) => {
                return Err(FailureReason::Impossible);
            }
            _ => {}
        }
        let hands = &self.person(agent).hands;
        if thing.class.info().role == Role::HeavyTarget {
            return if hands.iter().all(Option::is_none) {
                Ok(())
            } else {
                Err(FailureReason::HandFull)
            };
        }
        if let Some(vehicle) = self.vehicle(agent) {
            // A basket takes goods, not other baskets.
            if thing.class.info().role == Role::Container
                || thing.class.info().role == Role::Obstacle
            {
                return Err(FailureReason::Impossible);
            }
            let full = self.contents(vehicle).len() >= self.rules.container_capacity as usize;
            return if full { Err(FailureReason::Full) } else { Ok(()) };
        }
        if hands[hand.index()].is_some() { Err(FailureReason::HandFull) } else { Ok(()) }
    }

    /// The object, the container and the object's hand of a put-in.
    fn check_put_in(&self, agent: AgentId) -> Result<(EntityId, EntityId, Hand), FailureReason> {
        let hands = self.person(agent).hands;
        for hand in Hand::BOTH {
            let (Some(object), Some(container)) =
                (hands[hand.index()], hands[hand.other().index()])
            else {
                continue;
            };
            let role = |e: EntityId| self.thing(e).0.class.info().role;
            let fits = matches!(role(object), Role::Target | Role::Fragile);
            if fits && role(container) == Role::Container && object != container {
                let full = self.contents(container).len() >= self.rules.container_capacity as usize;
                return if full { Err(FailureReason::Full) } else { Ok((object, container, hand)) };
            }
        }
        Err(FailureReason::NotContainerAndTarget)
    }

    /// The thing that carries this one: itself, or the container it is in.
    pub(crate) fn root(&self, entity: EntityId) -> EntityId {
        match self.thing(entity).1.place {
            Place::Inside { container, .. } => container,
            _ => entity,
        }
    }

    /// What a put-on with this hand would put down.
    fn to_put_down(&self, agent: AgentId, hand: Hand) -> Vec<EntityId> {
        if let Some(vehicle) = self.vehicle(agent) {
            return self.contents(vehicle);
        }
        if let Some(furniture) = self.holds_furniture(agent) {
            return vec![furniture];
        }
        self.person(agent).hands[hand.index()].into_iter().collect()
    }

    pub(crate) fn holds_furniture(&self, agent: AgentId) -> Option<EntityId> {
        let [left, right] = self.person(agent).hands;
        if left == right { left } else { None }
    }

    /// Decides whether a taking can succeed, and lays out the reach, the grasp and the way back.
    pub(crate) fn judge_take(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        object: EntityId,
    ) -> Progress {
        let checks = self
            .check_takeable(agent, object, hand.unwrap_or(Hand::Right))
            .and_then(|()| self.check_within_reach(agent, object));
        if let Err(reason) = checks {
            return Progress::Fails(reason);
        }
        let capability = self.capability(agent);
        let (thing, state) = self.thing(object);
        let info = thing.class.info();
        let top = self.top_of(object);
        let height_excess = excess(top, capability.pick_range_m);
        let mut to = state.position + state.rotation * (Vec3::Y * 0.5 * thing.size_m().y);
        if capability.breaks_fragile && info.role == Role::Fragile {
            let p = if top > capability.pick_range_m[1] {
                self.rules.break_chance_high
            } else {
                self.rules.break_chance_low
            };
            if self.luck(agent, "break", p) {
                activity.failing = Some(FailureReason::Broke);
            }
        }
        if activity.failing.is_none() {
            let p = self.rules.pick_penalty.chance(height_excess)
                * self.rules.lift_penalty.chance(info.mass_kg - capability.strength_kg);
            if !self.luck(agent, "take", p) {
                activity.failing = Some(FailureReason::BeyondLimits);
                // The hand comes as far as it can.
                to.y = to.y.clamp(capability.pick_range_m[0], capability.pick_range_m[1]);
            }
        }
        let breaks = activity.failing == Some(FailureReason::Broke);
        let vain = activity.failing.is_some();
        let d = self.rules.durations;
        // Next one last.
        activity.queue = vec![self.reset_arms(hand, to)];
        if !vain || breaks {
            activity.queue.extend([Step::of(Phase::Grasp { hand, object }, d.grasp), self.gap()]);
        }
        activity.queue.extend([
            Step::of(Phase::Reach { hand, to, vain }, d.reach),
            self.gap(),
            Step::of(Phase::Face { to: object }, d.turn),
        ]);
        Progress::Instant
    }

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
        let ready = matches!(
            self.person(other).activity.as_ref().map(|a| a.step.phase),
            Some(Phase::AwaitPartner { .. })
        );
        if !ready {
            let patience = self.rules.durations.await_partner;
            return if elapsed >= patience { Progress::Done } else { Progress::Goes };
        }
        if self.check_within_reach(agent, object).is_err()
            || self.check_within_reach(other, object).is_err()
        {
            return Progress::Fails(FailureReason::Blocked);
        }
        self.begin_joint_lift(agent, other, activity, object);
        Progress::Instant
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
            self.reset_arms(None, to),
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

    /// The hand has closed: the thing is taken, or breaks.
    pub(crate) fn grasp(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        object: EntityId,
    ) -> Progress {
        if activity.failing == Some(FailureReason::Broke) {
            self.thing_mut(object).place = Place::Broken;
            self.happened(EventKind::Broke { agent, object });
            return Progress::Done;
        }
        if let Err(reason) = self.check_takeable(agent, object, hand.unwrap_or(Hand::Right)) {
            activity.failing = Some(reason);
            self.abandon_joint(reason);
            return Progress::Done;
        }
        let taken = self.thing_mut(object);
        taken.place = Place::Held { by: agent, hand: hand.unwrap_or(Hand::Right) };
        taken.last_holder = Some(agent);
        taken.released_at = None;
        self.happened(EventKind::Taken { agent, object });
        match hand {
            Some(hand) => self.person_mut(agent).hands[hand.index()] = Some(object),
            None => self.person_mut(agent).hands = [Some(object); 2],
        }
        for inside in self.contents(object) {
            self.thing_mut(inside).last_holder = Some(agent);
        }
        self.drop_dependents(object);
        if let Some(vehicle) = self.vehicle(agent).filter(|_| hand.is_some()) {
            let d = self.rules.durations;
            let basket = self.basket_in_world(vehicle);
            activity.queue = vec![
                self.reach(Some(Hand::Right), self.rest_of(agent, Hand::Right)),
                Step::of(Phase::Insert { object, container: vehicle }, d.open_hand),
                self.reach(Some(Hand::Right), basket + Vec3::Y * 0.2),
            ];
        } else if matches!(activity.action, Action::RemoveObstacle { .. })
            && let Some(hand) = hand
        {
            let from = self.hand_in_world(agent, hand);
            activity.queue = vec![
                Step::of(Phase::JudgeAside { hand, obstacle: object }, 0),
                self.reset_arms(Some(hand), from),
            ];
        }
        self.finish_joint_lift(agent, object);
        Progress::Done
    }

    /// The leader has the furniture: from now on the follower goes along.
    fn finish_joint_lift(&mut self, agent: AgentId, object: EntityId) {
        let Some(joint) = self.state.joint.filter(|j| j.leader == agent && j.object == object)
        else {
            return;
        };
        let leader = self.person(agent).pose;
        let follower = self.person(joint.follower).pose.position;
        let offset = follower - leader.position;
        let follower_in_leader = chaic_protocol::geom::rotate_yaw(offset, -leader.yaw_rad);
        self.state.joint = Some(JointCarry { follower_in_leader, under_way: true, ..joint });
        let follower = joint.follower;
        self.happened(EventKind::LiftedTogether { leader: agent, follower, object });
    }

    /// A joint lift that can't be: the follower is free again.
    fn abandon_joint(&mut self, reason: FailureReason) {
        if let Some(joint) = self.state.joint.take()
            && let Some(activity) = self.person_mut(joint.follower).activity.as_mut()
        {
            activity.failing = Some(reason);
            activity.queue.clear();
            activity.step = Step::of(Phase::Stand, 1);
        }
    }

    /// Puts a held object into a container or basket.
    pub(crate) fn insert(&mut self, agent: AgentId, object: EntityId, container: EntityId) {
        let slot = self.contents(container).len() as u8;
        let hands = &mut self.person_mut(agent).hands;
        for hand in hands.iter_mut().filter(|h| **h == Some(object)) {
            *hand = None;
        }
        let rotation = self.thing(container).1.rotation;
        let thing = self.thing_mut(object);
        thing.place = Place::Inside { container, slot };
        thing.rotation = rotation;
        self.happened(EventKind::Stowed { agent, object, container });
    }

    /// Decides whether putting down succeeds, and lays out the steps.
    pub(crate) fn judge_put(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        place: EntityId,
    ) -> Progress {
        if let Err(reason) = self.check_within_reach(agent, place) {
            return Progress::Fails(reason);
        }
        let objects = self.to_put_down(agent, hand.unwrap_or(Hand::Right));
        let Some(first) = objects.first().copied() else {
            return Progress::Fails(FailureReason::HandEmpty);
        };
        let d = self.rules.durations;
        let from = self.person(agent).pose.position;
        if self.holds_furniture(agent).is_some() {
            let at = self.free_spot_on(place, first, from);
            let release =
                Phase::Release { hand: None, object: first, on: Some(place), at, set_down: true };
            activity.queue = vec![
                self.reset_arms(None, at),
                Step::of(release, d.open_hand),
                self.reach(None, at + Vec3::Y),
                Step::of(Phase::Face { to: place }, d.turn),
            ];
            return Progress::Instant;
        }
        if self.vehicle(agent).is_some() {
            // One after the other out of the basket (facts of the original, 8.2).
            let mut steps = vec![self.reach(Some(Hand::Right), self.rest_of(agent, Hand::Right))];
            for object in objects.into_iter().rev() {
                let at = self.free_spot_on(place, object, from) + Vec3::Y * RELEASE_ABOVE_M;
                let release = Phase::Release {
                    hand: Some(Hand::Right),
                    object,
                    on: Some(place),
                    at,
                    set_down: false,
                };
                steps.extend([
                    Step::of(release, d.open_hand),
                    self.reach(Some(Hand::Right), at),
                    Step::of(Phase::Stand, d.grasp + d.gap),
                    self.reach(Some(Hand::Right), self.basket_of(agent)),
                ]);
            }
            steps.push(Step::of(Phase::Face { to: place }, d.turn));
            activity.queue = steps;
            return Progress::Instant;
        }
        let spot = self.free_spot_on(place, first, from);
        // Facts of the original, 3.7: the height that counts is that of the place's top.
        let height_excess = excess(self.top_of(place), self.capability(agent).put_range_m);
        let p = self.rules.put_penalty.chance(height_excess);
        if self.luck(agent, "put", p) {
            let at = spot + Vec3::Y * RELEASE_ABOVE_M;
            let release =
                Phase::Release { hand, object: first, on: Some(place), at, set_down: false };
            activity.queue = vec![
                self.reset_arms(hand, at),
                Step::of(release, d.open_hand + d.watch_fall),
                self.reach(hand, at),
                self.gap(),
                self.reach(hand, spot),
                Step::of(Phase::Face { to: place }, d.turn),
            ];
        } else {
            // Facts 1.4: after a vain attempt it drops to the floor beside the person.
            activity.failing = Some(FailureReason::BeyondLimits);
            let mut vain_to = spot;
            let [low, high] = self.capability(agent).put_range_m;
            vain_to.y = vain_to.y.clamp(low, high);
            let at = self.floor_spot_beside(agent, first) + Vec3::Y * 0.3;
            let release = Phase::Release { hand, object: first, on: None, at, set_down: false };
            activity.queue = vec![
                self.reset_arms(hand, at),
                Step::of(release, d.open_hand + d.watch_fall),
                self.reach(hand, at),
                self.gap(),
                Step::of(Phase::Reach { hand, to: vain_to, vain: true }, d.reach),
                Step::of(Phase::Face { to: place }, d.turn),
            ];
        }
        Progress::Instant
    }

    /// Finds where to put a removed obstacle, and lays out the steps.
    pub(crate) fn judge_aside(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Hand,
        obstacle: EntityId,
    ) -> Progress {
        let at = self.spot_aside(agent, obstacle);
        let d = self.rules.durations;
        let release =
            Phase::Release { hand: Some(hand), object: obstacle, on: None, at, set_down: true };
        activity.queue = vec![
            self.reset_arms(Some(hand), at),
            Step::of(release, d.open_hand),
            self.reach(Some(hand), at),
            self.gap(),
            self.reach(Some(hand), at + Vec3::Y * 0.5),
            Step::of(Phase::Stand, d.turn),
        ];
        Progress::Instant
    }

    /// Opens the hand: the thing falls, or stands where it is set down.
    pub(crate) fn release(
        &mut self,
        agent: AgentId,
        object: EntityId,
        on: Option<EntityId>,
        at: Vec3,
        set_down: bool,
    ) {
        for hand in self.person_mut(agent).hands.iter_mut().filter(|h| **h == Some(object)) {
            *hand = None;
        }
        self.happened(EventKind::Released { agent, object, on });
        let carried_jointly = self.state.joint.is_some_and(|j| j.object == object);
        let is_goal = on.filter(|place| self.setup.goal_places.contains(place));
        let thing = self.thing_mut(object);
        thing.released_at = is_goal;
        thing.last_holder = Some(agent);
        if set_down {
            thing.position = at;
            thing.place = Place::Resting { on };
            self.come_to_rest(object);
            if on.is_none() {
                self.happened(EventKind::ObstacleRemoved { agent, object });
            }
        } else {
            self.start_fall(object, at);
        }
        if carried_jointly {
            self.end_joint_carry();
        }
    }

    /// The furniture is down: the follower's own pick-up ends well.
    fn end_joint_carry(&mut self) {
        let Some(joint) = self.state.joint.take() else { return };
        let gap = self.gap();
        if let Some(activity) = self.person_mut(joint.follower).activity.as_mut() {
            activity.queue.clear();
            activity.step = gap;
        }
    }

    /// What lay on a thing that was taken falls.
    fn drop_dependents(&mut self, taken: EntityId) {
        let on_it = |e: &EntityId| self.thing(*e).1.place == Place::Resting { on: Some(taken) };
        let dependents: Vec<EntityId> = self.setup.entities().filter(on_it).collect();
        for object in dependents {
            let delivered = self.thing(object).1.delivered.is_some();
            if !delivered && self.thing(object).0.class.info().is_movable() {
                let at = self.thing(object).1.position;
                self.happened(EventKind::LostSupport { object });
                self.start_fall(object, at);
            }
        }
    }
}

fn is_pick_up(action: Action) -> bool {
    matches!(action, Action::PickUp { .. })
}

impl Setup {
    /// Distance in plan from a point to the nearest opening, metres.
    pub(crate) fn distance_to_opening(&self, p: Vec3) -> f32 {
        let to_segment = |a: chaic_protocol::Vec2, b: chaic_protocol::Vec2| {
            let (p, ab) = (xz(p), b - a);
            let t = if ab.length_squared() > 0.0 {
                ((p - a).dot(ab) / ab.length_squared()).clamp(0.0, 1.0)
            } else {
                0.0
            };
            p.distance(a + ab * t)
        };
        self.openings.iter().map(|o| to_segment(o.a, o.b)).fold(f32::INFINITY, f32::min)
    }
}
