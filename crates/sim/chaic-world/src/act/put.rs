//! Put-in, put-on and setting aside.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::capability::excess;
use chaic_core::catalogue::Role;
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Vec3};

use crate::event::EventKind;
use crate::random::RngPurpose;
use crate::rules::ReachReference;
use crate::state::{ActionStep, Activity, ObjectLocation, Phase};
use crate::tick::StepProgress;
use crate::world::World;

/// Height above the spot at which an object is released, meters (facts S3.7).
const RELEASE_ABOVE_M: f32 = 0.2;
/// Height above the floor from which an object drops after a failed put-on, meters. Our choice: a
/// hand that bends down, so that objects do not roll far.
const DROP_FROM_M: f32 = 0.3;

impl World {
    /// Returns the object, the container and the object's hand of a put-in.
    pub(super) fn check_put_in(
        &self,
        agent: AgentId,
    ) -> Result<(EntityId, EntityId, Hand), FailureReason> {
        let hands = self.person(agent).hands;
        for hand in Hand::BOTH {
            let (Some(object), Some(container)) =
                (hands[hand.index()], hands[hand.other().index()])
            else {
                continue;
            };
            let role = |e: EntityId| self.object(e).0.class.info().role;
            let fits = matches!(role(object), Role::Target | Role::Fragile);
            if fits && role(container) == Role::Container && object != container {
                let full = self.contents(container).len() >= self.rules.container_capacity as usize;
                return if full { Err(FailureReason::Full) } else { Ok((object, container, hand)) };
            }
        }
        Err(FailureReason::NotContainerAndTarget)
    }

    /// Returns the steps of a put-in, in reverse order: 80 frames, plus the drawn number of frames
    /// for watching the object.
    pub(super) fn put_in_steps(
        &self,
        agent: AgentId,
        object: EntityId,
        container: EntityId,
        hand: Hand,
    ) -> Vec<ActionStep> {
        let d = self.rules.durations;
        let to = self.front_in_world(agent);
        // The original attaches the dropped object to the container in one extra frame (facts
        // S2.2).
        let attach_frames = d.pause;
        vec![
            self.reset_arms(Some(hand), to),
            self.pause(),
            ActionStep::new(
                Phase::Insert { object, container },
                d.open_hand + d.pause + attach_frames,
            ),
            self.pause(),
            self.reach(Some(hand), to + Vec3::Y * 0.15),
            self.pause(),
            self.reach(Some(hand.other()), to),
            self.pause(),
            ActionStep::new(Phase::Stand, d.retract_arm),
            self.pause(),
        ]
    }

    /// Draws the number of extra frames for watching the object of a put-in. A basket on a vehicle
    /// has none, because the other hand is on the handlebar (facts S2.2: 2 frames).
    pub(crate) fn draw_watch_frames(&mut self, agent: AgentId, action: ResolvedAction) -> u32 {
        if action != Action::PutIn {
            return 0;
        }
        let max_frames = self.rules.durations.max_put_in_wait;
        self.rng(agent, RngPurpose::WatchPutIn).below(max_frames as usize + 1) as u32
    }

    /// Puts a held object into a container or basket.
    pub(crate) fn insert(&mut self, agent: AgentId, object: EntityId, container: EntityId) {
        let is_taken = |slot: u8| {
            self.contents(container).iter().any(
                |e| matches!(self.object(*e).1.location, ObjectLocation::Inside { slot: s, .. } if s == slot),
            )
        };
        let slot = (0..u8::MAX).find(|slot| !is_taken(*slot)).unwrap_or(u8::MAX);
        let hands = &mut self.person_mut(agent).hands;
        for hand in hands.iter_mut().filter(|h| **h == Some(object)) {
            *hand = None;
        }
        let rotation = self.object(container).1.rotation;
        let state = self.object_mut(object);
        state.location = ObjectLocation::Inside { container, slot };
        state.rotation = rotation;
        self.record_event(EventKind::Stowed { agent, object, container });
    }

    /// Returns the objects that a put-on with this hand would put down.
    pub(super) fn objects_to_put(&self, agent: AgentId, hand: Hand) -> Vec<EntityId> {
        if let Some(vehicle) = self.vehicle(agent) {
            return self.contents(vehicle);
        }
        if let Some(furniture) = self.holds_furniture(agent) {
            return vec![furniture];
        }
        self.person(agent).hands[hand.index()].into_iter().collect()
    }

    /// Decides whether a put-on succeeds, and plans its steps.
    pub(crate) fn decide_put_on(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        place: EntityId,
    ) -> StepProgress {
        // Someone may have taken the place during the approach.
        if !self.object(place).1.is_resting() {
            return StepProgress::Failed(FailureReason::Impossible);
        }
        if self.rules.reach_to == ReachReference::NearestPoint
            && let Err(reason) = self.check_within_reach(agent, place)
        {
            return StepProgress::Failed(reason);
        }
        let objects = self.objects_to_put(agent, hand.unwrap_or(Hand::Right));
        let Some(first) = objects.first().copied() else {
            return StepProgress::Failed(FailureReason::HandEmpty);
        };
        let d = self.rules.durations;
        let from = self.person(agent).pose.position;
        if self.holds_furniture(agent).is_some() {
            let at = self.free_spot_on(place, first, from, &[]);
            let release =
                Phase::Release { hand: None, object: first, on: Some(place), at, set_down: true };
            activity.queue = vec![
                self.reset_arms(None, at),
                ActionStep::new(release, d.open_hand),
                self.reach(None, at + Vec3::Y),
                ActionStep::new(Phase::Face { to: place }, d.turn),
            ];
            return StepProgress::Instant;
        }
        // Facts S3.7: the height of the place's top counts. The whole basket of a rider is one
        // attempt with one draw.
        let height_excess = excess(self.top_height_m(place), self.capability(agent).put_range_m);
        let p = self.rules.put_penalty.chance(height_excess);
        let fails = !self.rng(agent, RngPurpose::PutOn).chance(p);
        let is_rider = self.vehicle(agent).is_some();
        if fails {
            activity.failing = Some(FailureReason::BeyondLimits);
        }
        activity.queue = match (fails, is_rider) {
            (false, false) => self.put_steps(agent, hand, first, place),
            (false, true) => self.unload_steps(agent, objects, place),
            (true, false) => {
                let mut steps = vec![self.reset_arms(hand, self.drop_spot(agent, first))];
                steps.extend(self.failed_put_steps(agent, hand, first, place));
                steps
            }
            (true, true) => {
                let hand = Some(Hand::Right);
                let mut steps = vec![self.reach(hand, self.hand_rest_in_world(agent, Hand::Right))];
                steps.extend(self.failed_put_steps(agent, hand, first, place));
                steps.extend(self.basket_take_steps(agent));
                steps
            }
        };
        activity.queue.push(ActionStep::new(Phase::Face { to: place }, d.turn));
        StepProgress::Instant
    }

    /// Returns the steps that put the object of a hand on a place, in reverse order.
    fn put_steps(
        &self,
        agent: AgentId,
        hand: Option<Hand>,
        object: EntityId,
        place: EntityId,
    ) -> Vec<ActionStep> {
        let d = self.rules.durations;
        let spot = self.free_spot_on(place, object, self.person(agent).pose.position, &[]);
        let at = spot + Vec3::Y * RELEASE_ABOVE_M;
        let release = Phase::Release { hand, object, on: Some(place), at, set_down: false };
        vec![
            self.reset_arms(hand, at),
            self.pause(),
            ActionStep::new(release, d.open_hand + d.max_fall_wait),
            self.pause(),
            self.reach(hand, at),
            self.pause(),
            self.reach(hand, spot),
            self.pause(),
        ]
    }

    /// Returns the steps that put the contents of a rider's basket on a place one by one (facts
    /// S8.2), in reverse order.
    fn unload_steps(
        &self,
        agent: AgentId,
        objects: Vec<EntityId>,
        place: EntityId,
    ) -> Vec<ActionStep> {
        let d = self.rules.durations;
        let hand = Some(Hand::Right);
        let from = self.person(agent).pose.position;
        let mut steps = vec![self.reach(hand, self.hand_rest_in_world(agent, Hand::Right))];
        let mut taken = Vec::new();
        for object in objects.into_iter().rev() {
            let spot = self.free_spot_on(place, object, from, &taken);
            taken.push((spot, self.object(object).0.half_longer_side_m()));
            let at = spot + Vec3::Y * RELEASE_ABOVE_M;
            let release = Phase::Release { hand, object, on: Some(place), at, set_down: false };
            steps.extend([ActionStep::new(release, d.open_hand), self.reach(hand, at)]);
            steps.extend(self.basket_take_steps(agent));
        }
        steps
    }

    /// Returns the steps that take an object out of the agent's basket, in reverse order.
    fn basket_take_steps(&self, agent: AgentId) -> [ActionStep; 2] {
        let d = self.rules.durations;
        [
            ActionStep::new(Phase::Stand, d.grasp + d.pause),
            self.reach(Some(Hand::Right), self.own_basket_in_world(agent)),
        ]
    }

    /// Returns the steps of an attempt beyond a limit, in reverse order. The hand moves as far as
    /// it can, and the object drops to the floor beside the agent (facts S1.4).
    fn failed_put_steps(
        &self,
        agent: AgentId,
        hand: Option<Hand>,
        object: EntityId,
        place: EntityId,
    ) -> [ActionStep; 7] {
        let d = self.rules.durations;
        let mut to = self.free_spot_on(place, object, self.person(agent).pose.position, &[]);
        let [low, high] = self.capability(agent).put_range_m;
        to.y = to.y.clamp(low, high);
        let at = self.drop_spot(agent, object);
        let release = Phase::Release { hand, object, on: None, at, set_down: false };
        [
            self.pause(),
            ActionStep::new(release, d.open_hand + d.max_fall_wait),
            self.pause(),
            self.reach(hand, at),
            self.pause(),
            ActionStep::new(Phase::Reach { hand, to, fails: true }, d.reach),
            self.pause(),
        ]
    }

    /// Returns the release position of an object after a failed put-on.
    pub(crate) fn drop_spot(&self, agent: AgentId, object: EntityId) -> Vec3 {
        self.floor_spot_beside(agent, object) + Vec3::Y * DROP_FROM_M
    }

    /// Chooses a spot for a removed obstacle, and plans the steps.
    pub(crate) fn choose_set_down_spot(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Hand,
        obstacle: EntityId,
    ) -> StepProgress {
        let at = self.set_down_spot(agent, obstacle);
        let d = self.rules.durations;
        let release =
            Phase::Release { hand: Some(hand), object: obstacle, on: None, at, set_down: true };
        activity.queue = vec![
            self.reset_arms(Some(hand), at),
            ActionStep::new(release, d.open_hand),
            self.reach(Some(hand), at),
            self.pause(),
            self.reach(Some(hand), at + Vec3::Y * 0.5),
            ActionStep::new(Phase::Stand, d.turn),
        ];
        StepProgress::Instant
    }

    /// Opens the hand: the object falls, or stands where it is set down.
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
        self.record_event(EventKind::Released { agent, object, on });
        let carried_jointly = self.state.joint.is_some_and(|j| j.object == object);
        let goal_place = on.filter(|place| self.setup.goal_places.contains(place));
        let is_aside = set_down && on.is_none();
        // Someone may have taken the place meanwhile; the object then falls.
        let set_down = set_down && on.is_none_or(|place| self.object(place).1.is_resting());
        // An agent may have moved to the spot meanwhile.
        let is_taken = is_aside && !self.is_free_floor(object, at);
        // Another agent may have put something there meanwhile.
        let radius = self.object(object).0.half_longer_side_m();
        let at = match on {
            _ if is_taken => self.set_down_spot(agent, object),
            Some(place) if set_down && !self.is_free_for(object, at, radius) => {
                self.free_spot_on(place, object, self.person(agent).pose.position, &[])
            }
            _ => at,
        };
        let state = self.object_mut(object);
        state.released_at = goal_place;
        state.last_holder = Some(agent);
        if set_down {
            state.position = at;
            state.location = ObjectLocation::Resting { on };
            self.check_delivery(object);
            if is_aside {
                self.record_event(EventKind::ObstacleRemoved { agent, object });
            }
        } else {
            state.position = at;
            self.start_fall(&[object]);
        }
        if carried_jointly {
            self.end_joint_carry();
        }
    }
}
