//! Update of one frame. All agents continue their actions in the order of their ids. Then falling
//! objects move, held objects follow the hands, and the frame counter advances. An object that
//! comes to rest at the goal is delivered.
//!
//! If two agents reach for one object, the hand that closes first takes it. Within one frame this
//! is the agent with the lower id; the action of the other fails at its grasp. An action that is in
//! progress at the end of the episode is cut off and has no outcome.

use chaic_core::action::FailureReason;
use chaic_core::catalogue::Role;
use chaic_core::geom::{forward, horizontal_distance, yaw_towards};
use chaic_core::{Action, AgentId, EntityId, Hand, Outcome, Vec2, Vec3};

use crate::event::EventKind;
use crate::random::RngPurpose;
use crate::rules::CollisionResponse;
use crate::state::{ActionStep, Activity, ObjectLocation, PROGRESS_M, Phase, STUCK_AFTER_FRAMES};
use crate::world::World;

/// Status of a step after a frame.
pub(crate) enum StepProgress {
    /// The step continues in the next frame.
    Running,
    /// The step ended with this frame.
    Done,
    /// The step takes no time: the next one starts in this frame.
    Instant,
    /// The step failed; the remaining steps are dropped.
    Failed(FailureReason),
}

impl World {
    /// Runs one frame.
    pub fn tick(&mut self) {
        if self.state.over {
            return;
        }
        for agent in self.setup.agents() {
            let is_working = self.is_working(agent);
            self.run_action_frame(agent);
            self.update_fatigue(agent, is_working);
            self.drop_from_tremor(agent);
        }
        self.advance_falls();
        self.update_carried_objects();
        self.state.frame += 1;
        self.update_child_distance();
        self.update_progress();
        self.end_if_over();
    }

    /// Runs one frame of the action of an agent.
    fn run_action_frame(&mut self, agent: AgentId) {
        // The action is taken out while it runs, so that its steps can modify the agent.
        let Some(mut activity) = self.person_mut(agent).activity.take() else { return };
        loop {
            match self.run_step(agent, &mut activity) {
                StepProgress::Running => {
                    // A joint lift may have replaced the action of this agent meanwhile.
                    self.person_mut(agent).activity.get_or_insert(activity);
                    return;
                }
                StepProgress::Instant => match activity.queue.pop() {
                    Some(step) => activity.step = step,
                    None => return self.end_action(agent, activity),
                },
                StepProgress::Done => {
                    match activity.queue.pop() {
                        Some(step) => {
                            activity.step = step;
                            self.person_mut(agent).activity = Some(activity);
                        }
                        None => self.end_action(agent, activity),
                    }
                    return;
                }
                StepProgress::Failed(reason) => {
                    activity.failing = Some(reason);
                    return self.end_action(agent, activity);
                }
            }
        }
    }

    fn end_action(&mut self, agent: AgentId, activity: Activity) {
        let outcome = activity.failing.map_or(Outcome::Success, Outcome::Failure);
        let (action, frame) = (activity.action, self.state.frame + 1);
        let person = self.person_mut(agent);
        let is_put_on = |action| matches!(action, Action::PutOn { .. });
        let has_put_on = person
            .last_interaction
            .is_some_and(|(_, action, o)| is_put_on(action) && o.is_success());
        person.activity = None;
        person.last = Some((action, outcome));
        if action.is_interaction() {
            person.last_interaction = Some((frame, action, outcome));
            let is_beyond_limits = outcome == Outcome::Failure(FailureReason::BeyondLimits);
            if outcome.is_success() || is_beyond_limits {
                (person.progress.frame, person.progress.position) = (frame, person.pose.position);
            }
        }
        person.in_stride = action == Action::MoveForward && outcome.is_success();
        self.record_event(EventKind::Ended { agent, action, outcome });
        // The original rereads its record of actions at every check, so a successful put-on also
        // covers what the agent held then and drops next (facts S5.3).
        if self.rules.put_on_delivers_all_released
            && is_put_on(action)
            && (outcome.is_success() || has_put_on)
        {
            self.deliver_all_released(agent);
        }
    }

    fn run_step(&mut self, agent: AgentId, activity: &mut Activity) -> StepProgress {
        activity.step.elapsed += 1;
        let (elapsed, frames) = (activity.step.elapsed, activity.step.frames);
        let status = if elapsed >= frames { StepProgress::Done } else { StepProgress::Running };
        match activity.step.phase {
            Phase::Stand | Phase::Dock | Phase::Reach { .. } | Phase::ResetArms { .. } => status,
            Phase::CarryAlong => StepProgress::Running,
            Phase::Walk { .. } => self.walk(agent, &mut activity.step),
            Phase::Approach { .. } => self.approach(agent, &mut activity.step),
            Phase::Turn { to_yaw_rad } => {
                let has_turned = self.turn_to(agent, to_yaw_rad);
                if has_turned { status } else { StepProgress::Failed(FailureReason::Blocked) }
            }
            Phase::Face { to } => {
                let to = self.object(to).1.position;
                self.face(agent, to);
                status
            }
            Phase::WaitForOtherAgent { .. } => self.wait_for_other_agent(agent, activity),
            Phase::DecidePickUp { hand, object } => {
                self.decide_pick_up(agent, activity, hand, object)
            }
            Phase::DecidePutOn { hand, place } => self.decide_put_on(agent, activity, hand, place),
            Phase::ChooseSetDownSpot { hand, obstacle } => {
                self.choose_set_down_spot(agent, activity, hand, obstacle)
            }
            Phase::Grasp { hand, object } => match status {
                StepProgress::Done => self.grasp(agent, activity, hand, object),
                other => other,
            },
            Phase::Insert { object, container } => {
                if elapsed == self.rules.durations.open_hand {
                    self.insert(agent, object, container);
                    activity.step.frames += self.draw_watch_frames(agent, activity.action);
                }
                status
            }
            Phase::Release { object, on, at, set_down, .. } => {
                if elapsed == self.rules.durations.open_hand {
                    self.release(agent, object, on, at, set_down);
                }
                let is_watched = elapsed >= self.rules.durations.open_hand
                    && !matches!(self.object(object).1.location, ObjectLocation::Falling { .. });
                if is_watched { StepProgress::Done } else { status }
            }
        }
    }

    /// Runs one frame of a step ahead.
    fn walk(&mut self, agent: AgentId, step: &mut ActionStep) -> StepProgress {
        let Phase::Walk { remaining_m, covered_m } = &mut step.phase else {
            return StepProgress::Done;
        };
        let speed = self.capability(agent).speed_m_per_frame * self.remaining_strength(agent);
        let direction = forward(self.person(agent).pose.yaw_rad);
        let moved = self.step_towards(agent, direction, speed);
        *remaining_m -= speed;
        *covered_m += moved;
        if self.rules.blocking == CollisionResponse::Creeps {
            let is_done = *remaining_m <= 0.0 || self.touches_something(agent);
            return if is_done { StepProgress::Done } else { StepProgress::Running };
        }
        let is_blocked = moved < 0.1 * speed;
        if *remaining_m > 0.0 && !is_blocked {
            return StepProgress::Running;
        }
        if *covered_m < self.rules.min_progress_m {
            StepProgress::Failed(FailureReason::Blocked)
        } else {
            StepProgress::Done
        }
    }

    /// Runs one frame of an approach to an object.
    fn approach(&mut self, agent: AgentId, step: &mut ActionStep) -> StepProgress {
        /// Number of frames without approaching after which the approach ends.
        const GIVE_UP_AFTER: u32 = 4;
        let Phase::Approach { to, stuck } = &mut step.phase else { return StepProgress::Done };
        let entity = *to;
        let before = self.reach_distance(agent, entity);
        if before <= self.rules.arm_reach_m {
            return StepProgress::Done;
        }
        let from = self.person(agent).pose.position;
        let target = self.point_to_reach(from, entity);
        let yaw = yaw_towards(from, target);
        self.turn_to(agent, yaw);
        let speed =
            self.capability(agent).approach_speed_m_per_frame * self.remaining_strength(agent);
        self.step_towards(agent, forward(yaw), speed);
        if self.rules.blocking == CollisionResponse::Creeps && self.touches_something(agent) {
            return StepProgress::Done;
        }
        let approached_m = before - self.reach_distance(agent, entity);
        *stuck = if approached_m < 0.25 * speed { *stuck + 1 } else { 0 };
        if *stuck >= GIVE_UP_AFTER { StepProgress::Done } else { StepProgress::Running }
    }

    /// Moves an agent for one frame, with sliding along obstacles. Returns the distance covered in
    /// `direction`, meters.
    fn step_towards(&mut self, agent: AgentId, direction: Vec3, speed: f32) -> f32 {
        let from = self.person(agent).pose.position;
        let follower = self.state.joint.filter(|j| j.leader == agent).map(|j| j.follower);
        let to = self.move_and_slide(agent, follower, from, from + direction * speed);
        if let Some(joint) = self.state.joint.filter(|j| j.leader == agent) {
            // The two agents and the furniture move as one: if one is blocked, both are.
            let old = self.person(agent).pose.to_world(joint.follower_in_leader);
            let target = old + (to - from);
            let actual = self.move_and_slide(joint.follower, Some(agent), old, target);
            if horizontal_distance(actual, target) > 0.5 * speed {
                return 0.0;
            }
        }
        let moved = (to - from).dot(direction);
        let person = self.person_mut(agent);
        person.pose.position = to;
        person.walked_m += horizontal_distance(from, to);
        moved
    }

    pub(crate) fn move_and_slide(
        &self,
        agent: AgentId,
        except: Option<AgentId>,
        from: Vec3,
        to: Vec3,
    ) -> Vec3 {
        let xz = |v: Vec3| Vec2::new(v.x, v.z);
        if self.rules.blocking == CollisionResponse::Creeps {
            let p = xz(to).clamp(self.setup.bounds.min, self.setup.bounds.max);
            return Vec3::new(p.x, from.y, p.y);
        }
        let p = self.block_index.slide(
            self.body(agent),
            xz(from),
            xz(to),
            &self.movable_blocks(),
            &self.other_discs(agent, except),
        );
        Vec3::new(p.x, from.y, p.y)
    }

    /// Turns an agent if there is room. Returns whether it turned.
    fn turn_to(&mut self, agent: AgentId, yaw_rad: f32) -> bool {
        let has_room = self.make_room_to_turn(agent, yaw_rad);
        if has_room {
            self.person_mut(agent).pose.yaw_rad = yaw_rad;
        }
        has_room
    }

    pub(crate) fn face(&mut self, agent: AgentId, to: Vec3) {
        let from = self.person(agent).pose.position;
        if horizontal_distance(from, to) > 1e-3 {
            self.turn_to(agent, yaw_towards(from, to));
        }
    }

    /// Returns whether the agent walks or handles an object in this frame.
    fn is_working(&self, agent: AgentId) -> bool {
        let is_handling = |phase: Phase| {
            matches!(
                phase,
                Phase::Reach { .. }
                    | Phase::Grasp { .. }
                    | Phase::Release { .. }
                    | Phase::Insert { .. }
                    | Phase::ResetArms { .. }
            )
        };
        self.is_moving(agent) || self.person(agent).phase().is_some_and(|s| is_handling(s.phase))
    }

    fn update_fatigue(&mut self, agent: AgentId, is_working: bool) {
        if let Some(endurance) = self.capability(agent).endurance {
            let condition = &mut self.state.impairment_states[agent.index()];
            condition.fatigue = endurance.after_frame(condition.fatigue, is_working);
        }
    }

    /// Drops objects from trembling hands at random. An agent that performs an action other than
    /// moving and waiting keeps its objects.
    fn drop_from_tremor(&mut self, agent: AgentId) {
        let Some(tremor) = self.capability(agent).tremor else { return };
        let action = self.person(agent).activity.as_ref().map(|a| a.action);
        if action.is_some_and(|a| !a.is_locomotion() && !matches!(a, Action::Wait { .. })) {
            return;
        }
        for hand in Hand::BOTH {
            let held = self.person(agent).hands[hand.index()];
            let can_drop = |e: &EntityId| {
                !matches!(self.object(*e).0.class.info().role, Role::HeavyTarget | Role::Vehicle)
            };
            let Some(object) = held.filter(can_drop) else { continue };
            if self.rng(agent, RngPurpose::Drop).chance(tremor.drop_chance) {
                let at = self.drop_spot(agent, object);
                self.release(agent, object, None, at, false);
            }
        }
    }

    /// Advances all falling objects by one frame.
    fn advance_falls(&mut self) {
        for i in 0..self.state.objects.len() {
            let object = &mut self.state.objects[i];
            let ObjectLocation::Falling { path, on } = &mut object.location else { continue };
            if let Some((position, rotation)) = path.pop() {
                object.position = position;
                object.rotation = rotation;
            }
            if path.is_empty() {
                let on = *on;
                object.location = ObjectLocation::Resting { on };
                self.check_delivery(crate::Setup::entity(i));
            }
        }
    }

    fn update_child_distance(&mut self) {
        if self.state.agents.len() <= AgentId::CHILD.index() {
            return;
        }
        let position = |a: AgentId| self.person(a).pose.position;
        let distance = horizontal_distance(position(AgentId::CHILD), position(AgentId::PARTNER));
        let away = distance > self.rules.child_away_m;
        if away {
            self.state.child_away_frames += 1;
        }
        if away != self.state.child_is_away {
            self.state.child_is_away = away;
            self.record_event(EventKind::ChildAway { away });
        }
    }

    /// Updates the progress of the partner and the helper, and counts the frames in which one of
    /// them is stuck.
    fn update_progress(&mut self) {
        let frame = self.state.frame;
        let mut is_any_stuck = false;
        for agent in self.setup.agents().filter(|a| *a != AgentId::CHILD) {
            let person = self.person_mut(agent);
            let (here, progress) = (person.pose.position, &mut person.progress);
            if horizontal_distance(here, progress.position) > PROGRESS_M {
                (progress.frame, progress.position) = (frame, here);
            }
            let stuck = frame >= progress.frame + STUCK_AFTER_FRAMES;
            is_any_stuck |= stuck;
            if std::mem::replace(&mut progress.is_stuck, stuck) != stuck {
                self.record_event(EventKind::Stuck { agent, stuck });
            }
        }
        self.state.stuck_frames += u32::from(is_any_stuck);
    }

    fn end_if_over(&mut self) {
        let complete = self.is_complete();
        if complete || self.state.frame >= self.setup.horizon {
            self.state.over = true;
            self.record_event(EventKind::Over { complete });
        }
    }
}
