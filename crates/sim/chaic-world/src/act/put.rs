//! Putting things into, onto and aside.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::capability::excess;
use chaic_core::catalogue::Role;
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Vec3};

use crate::event::EventKind;
use crate::luck::Luck;
use crate::rules::ReachTo;
use crate::state::{Activity, Phase, Place, Step};
use crate::tick::Progress;
use crate::world::World;

/// Height above its place at which a thing is let go, metres (facts S3.7).
const RELEASE_ABOVE_M: f32 = 0.2;
/// Height above the floor from which a thing drops after a failed put-on, metres: ours, that of a
/// hand that bends down, so that nothing rolls far.
const DROP_FROM_M: f32 = 0.3;

impl World {
    /// The object, the container and the object's hand of a put-in.
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
            let role = |e: EntityId| self.thing(e).0.class.info().role;
            let fits = matches!(role(object), Role::Target | Role::Fragile);
            if fits && role(container) == Role::Container && object != container {
                let full = self.contents(container).len() >= self.rules.container_capacity as usize;
                return if full { Err(FailureReason::Full) } else { Ok((object, container, hand)) };
            }
        }
        Err(FailureReason::NotContainerAndTarget)
    }

    /// The steps of a put-in, next one last: 80 frames and those in which one watches what was
    /// dropped.
    pub(super) fn put_in_steps(
        &self,
        agent: AgentId,
        object: EntityId,
        container: EntityId,
        hand: Hand,
    ) -> Vec<Step> {
        let d = self.rules.durations;
        let to = self.front_of(agent);
        // To be part of the container takes what was dropped a frame (facts S2.2).
        let parented = d.gap;
        vec![
            self.reset_arms(Some(hand), to),
            self.gap(),
            Step::of(Phase::Insert { object, container }, d.open_hand + d.gap + parented),
            self.gap(),
            self.reach(Some(hand), to + Vec3::Y * 0.15),
            self.gap(),
            self.reach(Some(hand.other()), to),
            self.gap(),
            Step::of(Phase::Stand, d.move_away),
            self.gap(),
        ]
    }

    /// How many frames longer one watches what came into a container. A basket is no place to
    /// watch: its owner's other hand is on the handlebar (facts S2.2: 2 frames).
    pub(crate) fn frames_watched(&mut self, agent: AgentId, action: ResolvedAction) -> u32 {
        if action != Action::PutIn {
            return 0;
        }
        let most = self.rules.durations.watch_put_in;
        self.luck(agent, Luck::WatchPutIn).below(most as usize + 1) as u32
    }

    /// Puts a held object into a container or basket.
    pub(crate) fn insert(&mut self, agent: AgentId, object: EntityId, container: EntityId) {
        let is_taken = |slot: u8| {
            self.contents(container).iter().any(
                |e| matches!(self.thing(*e).1.place, Place::Inside { slot: s, .. } if s == slot),
            )
        };
        let slot = (0..u8::MAX).find(|slot| !is_taken(*slot)).unwrap_or(u8::MAX);
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

    /// What a put-on with this hand would put down.
    pub(super) fn to_put_down(&self, agent: AgentId, hand: Hand) -> Vec<EntityId> {
        if let Some(vehicle) = self.vehicle(agent) {
            return self.contents(vehicle);
        }
        if let Some(furniture) = self.holds_furniture(agent) {
            return vec![furniture];
        }
        self.person(agent).hands[hand.index()].into_iter().collect()
    }

    /// Decides whether putting down succeeds, and lays out the steps.
    pub(crate) fn judge_put(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        place: EntityId,
    ) -> Progress {
        if self.rules.reach_to == ReachTo::NearestPoint
            && let Err(reason) = self.check_within_reach(agent, place)
        {
            return Progress::Fails(reason);
        }
        let objects = self.to_put_down(agent, hand.unwrap_or(Hand::Right));
        let Some(first) = objects.first().copied() else {
            return Progress::Fails(FailureReason::HandEmpty);
        };
        let d = self.rules.durations;
        let from = self.person(agent).pose.position;
        if self.holds_furniture(agent).is_some() {
            let at = self.free_spot_on(place, first, from, &[]);
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
        // Facts S3.7: the height that counts is that of the place's top. One draw for
        // the whole of a rider's basket: it is one attempt.
        let height_excess = excess(self.top_of(place), self.capability(agent).put_range_m);
        let p = self.rules.put_penalty.chance(height_excess);
        let fails = !self.luck(agent, Luck::PutOn).chance(p);
        let is_rider = self.vehicle(agent).is_some();
        if fails {
            activity.failing = Some(FailureReason::BeyondLimits);
        }
        activity.queue = match (fails, is_rider) {
            (false, false) => self.put_steps(agent, hand, first, place),
            (false, true) => self.unload_steps(agent, objects, place),
            (true, false) => {
                let mut steps = vec![self.reset_arms(hand, self.drop_spot(agent, first))];
                steps.extend(self.vain_put_steps(agent, hand, first, place));
                steps
            }
            (true, true) => {
                let hand = Some(Hand::Right);
                let mut steps = vec![self.reach(hand, self.rest_of(agent, Hand::Right))];
                steps.extend(self.vain_put_steps(agent, hand, first, place));
                steps.extend(self.out_of_basket(agent));
                steps
            }
        };
        activity.queue.push(Step::of(Phase::Face { to: place }, d.turn));
        Progress::Instant
    }

    /// Putting what a hand holds on a place, next step last.
    fn put_steps(
        &self,
        agent: AgentId,
        hand: Option<Hand>,
        object: EntityId,
        place: EntityId,
    ) -> Vec<Step> {
        let d = self.rules.durations;
        let spot = self.free_spot_on(place, object, self.person(agent).pose.position, &[]);
        let at = spot + Vec3::Y * RELEASE_ABOVE_M;
        let release = Phase::Release { hand, object, on: Some(place), at, set_down: false };
        vec![
            self.reset_arms(hand, at),
            Step::of(release, d.open_hand + d.watch_fall),
            self.reach(hand, at),
            self.gap(),
            self.reach(hand, spot),
        ]
    }

    /// Putting on a place what is in a rider's basket, one after the other (facts
    /// S8.2), next step last.
    fn unload_steps(&self, agent: AgentId, objects: Vec<EntityId>, place: EntityId) -> Vec<Step> {
        let d = self.rules.durations;
        let hand = Some(Hand::Right);
        let from = self.person(agent).pose.position;
        let mut steps = vec![self.reach(hand, self.rest_of(agent, Hand::Right))];
        let mut taken = Vec::new();
        for object in objects.into_iter().rev() {
            let spot = self.free_spot_on(place, object, from, &taken);
            taken.push((spot, self.thing(object).0.half_longer_side_m()));
            let at = spot + Vec3::Y * RELEASE_ABOVE_M;
            let release = Phase::Release { hand, object, on: Some(place), at, set_down: false };
            steps.extend([Step::of(release, d.open_hand), self.reach(hand, at)]);
            steps.extend(self.out_of_basket(agent));
        }
        steps
    }

    /// Taking a thing out of one's basket, next step last.
    fn out_of_basket(&self, agent: AgentId) -> [Step; 2] {
        let d = self.rules.durations;
        [
            Step::of(Phase::Stand, d.grasp + d.gap),
            self.reach(Some(Hand::Right), self.basket_of(agent)),
        ]
    }

    /// A try beyond one's limits, next step last: the hand comes as far as it can, and the thing
    /// drops to the floor beside the person (facts S1.4).
    fn vain_put_steps(
        &self,
        agent: AgentId,
        hand: Option<Hand>,
        object: EntityId,
        place: EntityId,
    ) -> [Step; 4] {
        let d = self.rules.durations;
        let mut to = self.free_spot_on(place, object, self.person(agent).pose.position, &[]);
        let [low, high] = self.capability(agent).put_range_m;
        to.y = to.y.clamp(low, high);
        let at = self.drop_spot(agent, object);
        let release = Phase::Release { hand, object, on: None, at, set_down: false };
        [
            Step::of(release, d.open_hand + d.watch_fall),
            self.reach(hand, at),
            self.gap(),
            Step::of(Phase::Reach { hand, to, fails: true }, d.reach),
        ]
    }

    /// Where a thing is let go after a failed put-on.
    pub(crate) fn drop_spot(&self, agent: AgentId, object: EntityId) -> Vec3 {
        self.floor_spot_beside(agent, object) + Vec3::Y * DROP_FROM_M
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
        let is_aside = set_down && on.is_none();
        // Somebody may have come there meanwhile.
        let is_taken = is_aside && !self.is_free_floor(object, at);
        let at = if is_taken { self.spot_aside(agent, object) } else { at };
        let thing = self.thing_mut(object);
        thing.released_at = is_goal;
        thing.last_holder = Some(agent);
        if set_down {
            thing.position = at;
            thing.place = Place::Resting { on };
            self.come_to_rest(object);
            if is_aside {
                self.happened(EventKind::ObstacleRemoved { agent, object });
            }
        } else {
            thing.position = at;
            self.start_fall(&[object]);
        }
        if carried_jointly {
            self.end_joint_carry();
        }
    }
}
