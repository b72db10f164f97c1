//! Pick-ups: preconditions, chances, and the fall of objects that lose their support.

use chaic_core::action::{FailureReason, Hand};
use chaic_core::capability::{Tremor, excess};
use chaic_core::catalogue::Role;
use chaic_core::{Action, AgentId, EntityId, Vec3};

use crate::event::EventKind;
use crate::random::RngPurpose;
use crate::state::{ActionStep, Activity, ObjectLocation, Phase};
use crate::tick::StepProgress;
use crate::world::World;

impl World {
    /// Checks the preconditions of a pick-up of a visible object with this hand.
    pub(super) fn check_takeable(
        &self,
        agent: AgentId,
        object: EntityId,
        hand: Hand,
    ) -> Result<(), FailureReason> {
        let (spec, state) = self.object(object);
        if state.location == ObjectLocation::Broken {
            return Err(FailureReason::OutOfReach);
        }
        if spec.fixed || !spec.class.info().is_movable() {
            return Err(FailureReason::Impossible);
        }
        if state.delivered.is_some() {
            return Err(FailureReason::OutOfPlay);
        }
        let outermost = self.outermost(object);
        match self.object(outermost).1.holder() {
            Some(by) if by != agent => return Err(FailureReason::HeldByOther),
            Some(_) if outermost == object || self.vehicle(agent) == Some(outermost) => {
                return Err(FailureReason::Impossible);
            }
            _ => {}
        }
        let (role, capability) = (spec.class.info().role, self.capability(agent));
        let is_able = match role {
            Role::Obstacle => capability.removes_obstacles,
            Role::Container => capability.carries_containers,
            Role::HeavyTarget => capability.lifts_furniture,
            _ => true,
        };
        if !is_able || (role != Role::HeavyTarget && !capability.hands.include(hand)) {
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
            // A basket takes goods but no containers.
            if matches!(role, Role::Obstacle | Role::Container) {
                return Err(FailureReason::Impossible);
            }
            let full = self.contents(vehicle).len() >= self.rules.container_capacity as usize;
            return if full { Err(FailureReason::Full) } else { Ok(()) };
        }
        if hands[hand.index()].is_some() { Err(FailureReason::HandFull) } else { Ok(()) }
    }

    /// Decides whether a pick-up succeeds, and plans the reach, the grasp and the return of the
    /// arm.
    pub(crate) fn decide_pick_up(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        object: EntityId,
    ) -> StepProgress {
        let checks = self
            .check_within_reach(agent, object)
            .and_then(|()| self.check_takeable(agent, object, hand.unwrap_or(Hand::Right)));
        if let Err(reason) = checks {
            return StepProgress::Failed(reason);
        }
        let capability = self.capability(agent);
        let strength_kg = capability.strength_kg * self.remaining_strength(agent);
        let (spec, state) = self.object(object);
        let info = spec.class.info();
        let top = self.top_height_m(object);
        let height_excess = excess(top, capability.pick_range_m);
        let mut to = state.position + state.rotation * (Vec3::Y * 0.5 * spec.size_m().y);
        if capability.breaks_fragile && info.role == Role::Fragile {
            let p = if top > capability.pick_range_m[1] {
                self.rules.break_chance_high
            } else {
                self.rules.break_chance_low
            };
            if self.rng(agent, RngPurpose::Break).chance(p) {
                activity.failing = Some(FailureReason::Broke);
            }
        }
        if activity.failing.is_none() {
            let p = self.rules.pick_penalty.chance(height_excess)
                * self.rules.lift_penalty.chance(info.mass_kg - strength_kg);
            let slips = |world: &mut World, tremor: Tremor| {
                world.rng(agent, RngPurpose::Slip).chance(tremor.slip_chance)
            };
            if !self.rng(agent, RngPurpose::Take).chance(p)
                || capability.tremor.is_some_and(|tremor| slips(self, tremor))
            {
                activity.failing = Some(FailureReason::BeyondLimits);
                // The hand moves as far as it can.
                to.y = to.y.clamp(capability.pick_range_m[0], capability.pick_range_m[1]);
            }
        }
        let breaks = activity.failing == Some(FailureReason::Broke);
        let fails = activity.failing.is_some();
        let d = self.rules.durations;
        // In reverse order.
        activity.queue = vec![match hand {
            Some(_) => self.reset_arms(hand, to),
            None => self.raise_furniture(to),
        }];
        if !fails || breaks {
            activity.queue.push(ActionStep::new(Phase::Grasp { hand, object }, d.grasp));
        } else if d.failed_grasp > 0 {
            activity.queue.push(ActionStep::new(Phase::Stand, d.failed_grasp));
        }
        activity.queue.extend([
            self.pause(),
            ActionStep::new(Phase::Reach { hand, to, fails }, d.reach),
            self.pause(),
            ActionStep::new(Phase::Face { to: object }, d.turn),
        ]);
        StepProgress::Instant
    }

    /// Completes a grasp: the agent takes the object, or the object breaks.
    pub(crate) fn grasp(
        &mut self,
        agent: AgentId,
        activity: &mut Activity,
        hand: Option<Hand>,
        object: EntityId,
    ) -> StepProgress {
        if let Err(reason) = self.check_takeable(agent, object, hand.unwrap_or(Hand::Right)) {
            activity.failing = Some(reason);
            self.cancel_joint_lift(agent, reason);
            return StepProgress::Done;
        }
        if activity.failing == Some(FailureReason::Broke) {
            self.object_mut(object).location = ObjectLocation::Broken;
            self.record_event(EventKind::Broke { agent, object });
            self.drop_dependents(object);
            return StepProgress::Done;
        }
        let taken = self.object_mut(object);
        taken.location = ObjectLocation::Held { by: agent, hand: hand.unwrap_or(Hand::Right) };
        taken.last_holder = Some(agent);
        taken.released_at = None;
        self.record_event(EventKind::Taken { agent, object });
        match hand {
            Some(hand) => self.person_mut(agent).hands[hand.index()] = Some(object),
            None => self.person_mut(agent).hands = [Some(object); 2],
        }
        for inside in self.contents(object) {
            self.object_mut(inside).last_holder = Some(agent);
        }
        self.drop_dependents(object);
        if let Some(vehicle) = self.vehicle(agent).filter(|_| hand.is_some()) {
            let d = self.rules.durations;
            let basket = self.basket_in_world(vehicle);
            activity.queue = vec![
                self.reach(Some(Hand::Right), self.hand_rest_in_world(agent, Hand::Right)),
                ActionStep::new(Phase::Insert { object, container: vehicle }, d.open_hand),
                self.reach(Some(Hand::Right), basket + Vec3::Y * 0.2),
            ];
        } else if matches!(activity.action, Action::RemoveObstacle { .. })
            && let Some(hand) = hand
        {
            let from = self.hand_in_world(agent, hand);
            activity.queue = vec![
                ActionStep::new(Phase::ChooseSetDownSpot { hand, obstacle: object }, 0),
                self.reset_arms(Some(hand), from),
            ];
        }
        self.start_joint_carry(agent, object);
        StepProgress::Done
    }

    /// Starts the fall of all objects that rested, directly or indirectly, on an object that was
    /// taken or broke. Objects on their way to such a support fall on from where they are.
    fn drop_dependents(&mut self, removed: EntityId) {
        let mut falling = Vec::new();
        let mut below = vec![removed];
        while let Some(support) = below.pop() {
            let has_lost_support = |e: &EntityId| {
                let (spec, state) = self.object(*e);
                let depends = match &state.location {
                    ObjectLocation::Resting { on } => {
                        *on == Some(support) && state.delivered.is_none()
                    }
                    ObjectLocation::Falling { on, .. } => *on == Some(support),
                    _ => false,
                };
                depends && spec.class.info().is_movable() && !falling.contains(e)
            };
            let dependents: Vec<EntityId> =
                self.setup.entities().filter(has_lost_support).collect();
            below.extend(&dependents);
            falling.extend(dependents);
        }
        for object in &falling {
            if self.object(*object).1.is_resting() {
                self.record_event(EventKind::LostSupport { object: *object });
            }
        }
        if !falling.is_empty() {
            self.start_fall(&falling);
        }
    }
}
