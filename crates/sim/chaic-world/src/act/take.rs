//! Taking things: who may, who can, and what comes down with them.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::capability::{Tremor, excess};
use chaic_core::catalogue::Role;
use chaic_core::{Action, AgentId, EntityId, Vec3};

use crate::event::EventKind;
use crate::luck::Luck;
use crate::state::{Activity, Phase, Place, Step};
use crate::tick::Progress;
use crate::world::World;

impl World {
    /// Whether this hand could take this thing, which is at hand, as far as can be said before
    /// trying.
    pub(super) fn check_takeable(
        &self,
        agent: AgentId,
        object: EntityId,
        hand: Hand,
    ) -> Result<(), FailureReason> {
        let (thing, state) = self.thing(object);
        if state.place == Place::Broken {
            return Err(FailureReason::OutOfReach);
        }
        if thing.fixed || !thing.class.info().is_movable() {
            return Err(FailureReason::Impossible);
        }
        if state.delivered.is_some() {
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
        let (role, body) = (thing.class.info().role, self.capability(agent));
        let is_able = match role {
            Role::Obstacle => body.removes_obstacles,
            Role::Container => body.carries_containers,
            Role::HeavyTarget => body.lifts_furniture,
            _ => true,
        };
        if !is_able || (role != Role::HeavyTarget && !body.hands.include(hand)) {
            return Err(FailureReason::BeyondLimits);
        }
        let hands = &self.person(agent).hands;
        if role == Role::HeavyTarget {
            return if hands.iter().all(Option::is_none) {
                Ok(())
            } else {
                Err(FailureReason::HandFull)
            };
        }
        if let Some(vehicle) = self.vehicle(agent) {
            // A basket takes goods, not other baskets.
            if matches!(role, Role::Obstacle | Role::Container) {
                return Err(FailureReason::Impossible);
            }
            let full = self.contents(vehicle).len() >= self.rules.container_capacity as usize;
            return if full { Err(FailureReason::Full) } else { Ok(()) };
        }
        if hands[hand.index()].is_some() { Err(FailureReason::HandFull) } else { Ok(()) }
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
            .check_within_reach(agent, object)
            .and_then(|()| self.check_takeable(agent, object, hand.unwrap_or(Hand::Right)));
        if let Err(reason) = checks {
            return Progress::Fails(reason);
        }
        let capability = self.capability(agent);
        let strength_kg = capability.strength_kg * self.part_left(agent);
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
            if self.luck(agent, Luck::Break).chance(p) {
                activity.failing = Some(FailureReason::Broke);
            }
        }
        if activity.failing.is_none() {
            let p = self.rules.pick_penalty.chance(height_excess)
                * self.rules.lift_penalty.chance(info.mass_kg - strength_kg);
            let slips = |world: &mut World, tremor: Tremor| {
                world.luck(agent, Luck::Slip).chance(tremor.slip_chance)
            };
            if !self.luck(agent, Luck::Take).chance(p)
                || capability.tremor.is_some_and(|tremor| slips(self, tremor))
            {
                activity.failing = Some(FailureReason::BeyondLimits);
                // The hand comes as far as it can.
                to.y = to.y.clamp(capability.pick_range_m[0], capability.pick_range_m[1]);
            }
        }
        let breaks = activity.failing == Some(FailureReason::Broke);
        let fails = activity.failing.is_some();
        let d = self.rules.durations;
        // Next one last.
        activity.queue = vec![match hand {
            Some(_) => self.reset_arms(hand, to),
            None => self.raise_furniture(to),
        }];
        if !fails || breaks {
            activity.queue.push(Step::of(Phase::Grasp { hand, object }, d.grasp));
        } else if d.vain_grasp > 0 {
            activity.queue.push(Step::of(Phase::Stand, d.vain_grasp));
        }
        activity.queue.extend([
            self.gap(),
            Step::of(Phase::Reach { hand, to, fails }, d.reach),
            self.gap(),
            Step::of(Phase::Face { to: object }, d.turn),
        ]);
        Progress::Instant
    }

    /// The hand has closed: the thing is taken, or breaks.
    pub(crate) fn grasp(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        object: EntityId,
    ) -> Progress {
        if let Err(reason) = self.check_takeable(agent, object, hand.unwrap_or(Hand::Right)) {
            activity.failing = Some(reason);
            self.abandon_joint(agent, reason);
            return Progress::Done;
        }
        if activity.failing == Some(FailureReason::Broke) {
            self.thing_mut(object).place = Place::Broken;
            self.happened(EventKind::Broke { agent, object });
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

    /// What lay on a thing that was taken falls, and what lay on that.
    fn drop_dependents(&mut self, taken: EntityId) {
        let mut falling = Vec::new();
        let mut below = vec![taken];
        while let Some(support) = below.pop() {
            let lost_it = |e: &EntityId| {
                let (thing, state) = self.thing(*e);
                state.place == Place::Resting { on: Some(support) }
                    && state.delivered.is_none()
                    && thing.class.info().is_movable()
                    && !falling.contains(e)
            };
            let dependents: Vec<EntityId> = self.setup.entities().filter(lost_it).collect();
            below.extend(&dependents);
            falling.extend(dependents);
        }
        for object in &falling {
            self.happened(EventKind::LostSupport { object: *object });
        }
        if !falling.is_empty() {
            self.start_fall(&falling);
        }
    }
}
