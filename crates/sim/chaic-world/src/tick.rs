//! One frame: everybody goes on with what they do, in the order of their ids; then what falls
//! falls, what is held follows the hands, what has come to rest at the goal is delivered, and the
//! clock moves on.
//!
//! Two people who want one thing: the one whose hand closes first has it, and within one frame
//! that is the one with the lower id; the other's action fails when it would take it. An action
//! that is under way when the time ends is cut off and has no outcome.

use chaic_core::action::FailureReason;
use chaic_core::catalogue::Role;
use chaic_core::geom::{forward, horizontal_distance, yaw_towards};
use chaic_core::{Action, AgentId, EntityId, Hand, Outcome, Vec2, Vec3};

use crate::event::EventKind;
use crate::luck::Luck;
use crate::rules::Blocking;
use crate::state::{Activity, PROGRESS_M, Phase, Place, STUCK_AFTER_FRAMES, Step};
use crate::world::World;

/// What became of a step in this frame.
pub(crate) enum Progress {
    /// It goes on in the next frame.
    Goes,
    /// This was its last frame.
    Done,
    /// It takes no time: the next step begins in this frame.
    Instant,
    /// It failed; what remains of the action is dropped.
    Fails(FailureReason),
}

impl World {
    /// Runs one frame.
    pub fn tick(&mut self) {
        if self.state.over {
            return;
        }
        for agent in self.setup.agents() {
            let works = self.works(agent);
            self.act_for_a_frame(agent);
            self.tire(agent, works);
            self.let_slip(agent);
        }
        self.let_fall();
        self.carry_along();
        self.state.frame += 1;
        self.watch_child();
        self.watch_progress();
        self.end_if_over();
    }

    /// One frame of one person's action.
    fn act_for_a_frame(&mut self, agent: AgentId) {
        // The action is taken out while it runs, so that its steps can change the person.
        let Some(mut activity) = self.person_mut(agent).activity.take() else { return };
        loop {
            match self.run_step(agent, &mut activity) {
                Progress::Goes => {
                    // A joint lift may have given this person something else to do meanwhile.
                    self.person_mut(agent).activity.get_or_insert(activity);
                    return;
                }
                Progress::Instant => match activity.queue.pop() {
                    Some(step) => activity.step = step,
                    None => return self.end_action(agent, activity),
                },
                Progress::Done => {
                    match activity.queue.pop() {
                        Some(step) => {
                            activity.step = step;
                            self.person_mut(agent).activity = Some(activity);
                        }
                        None => self.end_action(agent, activity),
                    }
                    return;
                }
                Progress::Fails(reason) => {
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
        person.activity = None;
        person.last = Some((action, outcome));
        if !action.is_locomotion() && !matches!(action, Action::Wait { .. }) {
            person.last_deed = Some((frame, action, outcome));
            let is_tried = outcome == Outcome::Failure(FailureReason::BeyondLimits);
            if outcome.is_success() || is_tried {
                (person.progress.frame, person.progress.position) = (frame, person.pose.position);
            }
        }
        person.in_stride = action == Action::MoveForward && outcome.is_success();
        self.happened(EventKind::Ended { agent, action, outcome });
        if self.rules.delivered_anywhere
            && outcome.is_success()
            && matches!(action, Action::PutOn { .. })
        {
            self.deliver_all_let_go(agent);
        }
    }

    fn run_step(&mut self, agent: AgentId, activity: &mut Activity) -> Progress {
        activity.step.elapsed += 1;
        let (elapsed, frames) = (activity.step.elapsed, activity.step.frames);
        let counted = if elapsed >= frames { Progress::Done } else { Progress::Goes };
        match activity.step.phase {
            Phase::Stand | Phase::Dock | Phase::Reach { .. } | Phase::ResetArms { .. } => counted,
            Phase::CarryAlong => Progress::Goes,
            Phase::Walk { .. } => self.walk(agent, &mut activity.step),
            Phase::Approach { .. } => self.approach(agent, &mut activity.step),
            Phase::Turn { to_yaw_rad } => {
                let turns = self.turn_to(agent, to_yaw_rad);
                if turns { counted } else { Progress::Fails(FailureReason::Blocked) }
            }
            Phase::Face { to } => {
                let to = self.thing(to).1.position;
                self.face(agent, to);
                counted
            }
            Phase::AwaitPartner { .. } => self.await_partner(agent, activity),
            Phase::JudgeTake { hand, object } => self.judge_take(agent, activity, hand, object),
            Phase::JudgePut { hand, place } => self.judge_put(agent, activity, hand, place),
            Phase::JudgeAside { hand, obstacle } => {
                self.judge_aside(agent, activity, hand, obstacle)
            }
            Phase::Grasp { hand, object } => match counted {
                Progress::Done => self.grasp(agent, activity, hand, object),
                other => other,
            },
            Phase::Insert { object, container } => {
                if elapsed == self.rules.durations.open_hand {
                    self.insert(agent, object, container);
                    activity.step.frames += self.frames_watched(agent, activity.action);
                }
                counted
            }
            Phase::Release { object, on, at, set_down, .. } => {
                if elapsed == self.rules.durations.open_hand {
                    self.release(agent, object, on, at, set_down);
                }
                let watched = elapsed >= self.rules.durations.open_hand
                    && !matches!(self.thing(object).1.place, Place::Falling { .. });
                if watched { Progress::Done } else { counted }
            }
        }
    }

    /// One frame of a step ahead.
    fn walk(&mut self, agent: AgentId, step: &mut Step) -> Progress {
        let Phase::Walk { left_m, made_m } = &mut step.phase else { return Progress::Done };
        let speed = self.capability(agent).speed_m_per_frame * self.part_left(agent);
        let ahead = forward(self.person(agent).pose.yaw_rad);
        let moved = self.step_towards(agent, ahead, speed);
        *left_m -= speed;
        *made_m += moved;
        if self.rules.blocking == Blocking::Creeps {
            let is_done = *left_m <= 0.0 || self.meets_something(agent);
            return if is_done { Progress::Done } else { Progress::Goes };
        }
        let stuck = moved < 0.1 * speed;
        if *left_m > 0.0 && !stuck {
            return Progress::Goes;
        }
        if *made_m < self.rules.min_progress_m {
            Progress::Fails(FailureReason::Blocked)
        } else {
            Progress::Done
        }
    }

    /// One frame of walking straight up to a thing.
    fn approach(&mut self, agent: AgentId, step: &mut Step) -> Progress {
        /// Frames without coming nearer after which one is as near as one gets.
        const GIVE_UP_AFTER: u32 = 4;
        let Phase::Approach { to, stuck } = &mut step.phase else { return Progress::Done };
        let entity = *to;
        let before = self.reach_distance(agent, entity);
        if before <= self.rules.arm_reach_m {
            return Progress::Done;
        }
        let from = self.person(agent).pose.position;
        let target = self.point_to_reach(from, entity);
        let yaw = yaw_towards(from, target);
        self.turn_to(agent, yaw);
        let speed = self.capability(agent).approach_speed_m_per_frame * self.part_left(agent);
        self.step_towards(agent, forward(yaw), speed);
        if self.rules.blocking == Blocking::Creeps && self.meets_something(agent) {
            return Progress::Done;
        }
        let nearer = before - self.reach_distance(agent, entity);
        *stuck = if nearer < 0.25 * speed { *stuck + 1 } else { 0 };
        if *stuck >= GIVE_UP_AFTER { Progress::Done } else { Progress::Goes }
    }

    /// Moves a person by one frame, sliding along what is in the way; returns how far ahead it
    /// came, metres.
    fn step_towards(&mut self, agent: AgentId, direction: Vec3, speed: f32) -> f32 {
        let from = self.person(agent).pose.position;
        let follower = self.state.joint.filter(|j| j.leader == agent).map(|j| j.follower);
        let to = self.slide(agent, follower, from, from + direction * speed);
        if let Some(joint) = self.state.joint.filter(|j| j.leader == agent) {
            // The two and the furniture move as one: where one is blocked, both are.
            let old = self.person(agent).pose.to_world(joint.follower_in_leader);
            let wanted = old + (to - from);
            let got = self.slide(joint.follower, Some(agent), old, wanted);
            if horizontal_distance(got, wanted) > 0.5 * speed {
                return 0.0;
            }
        }
        let moved = (to - from).dot(direction);
        let person = self.person_mut(agent);
        person.pose.position = to;
        person.walked_m += horizontal_distance(from, to);
        moved
    }

    pub(crate) fn slide(
        &self,
        agent: AgentId,
        except: Option<AgentId>,
        from: Vec3,
        to: Vec3,
    ) -> Vec3 {
        let xz = |v: Vec3| Vec2::new(v.x, v.z);
        if self.rules.blocking == Blocking::Creeps {
            let p = xz(to).clamp(self.setup.bounds.min, self.setup.bounds.max);
            return Vec3::new(p.x, from.y, p.y);
        }
        let p = self.block_index.slide(
            self.body(agent),
            xz(from),
            xz(to),
            &self.movable_blocks(),
            &self.others(agent, except),
        );
        Vec3::new(p.x, from.y, p.y)
    }

    /// Turns a person, if there is room. Returns whether there was.
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

    /// Whether what a person is about to do in this frame is work.
    fn works(&self, agent: AgentId) -> bool {
        let handles = |phase: Phase| {
            matches!(
                phase,
                Phase::Reach { .. }
                    | Phase::Grasp { .. }
                    | Phase::Release { .. }
                    | Phase::Insert { .. }
                    | Phase::ResetArms { .. }
            )
        };
        self.is_moving(agent) || self.person(agent).phase().is_some_and(|s| handles(s.phase))
    }

    fn tire(&mut self, agent: AgentId, works: bool) {
        if let Some(endurance) = self.capability(agent).endurance {
            let condition = &mut self.state.conditions[agent.index()];
            condition.fatigue = endurance.after_frame(condition.fatigue, works);
        }
    }

    /// What drops from a trembling hand on the way. Hands that are at work hold on to what they have.
    fn let_slip(&mut self, agent: AgentId) {
        let Some(tremor) = self.capability(agent).tremor else { return };
        let action = self.person(agent).activity.as_ref().map(|a| a.action);
        if action.is_some_and(|a| !a.is_locomotion() && !matches!(a, Action::Wait { .. })) {
            return;
        }
        for hand in Hand::BOTH {
            let held = self.person(agent).hands[hand.index()];
            let slips = |e: &EntityId| {
                !matches!(self.thing(*e).0.class.info().role, Role::HeavyTarget | Role::Vehicle)
            };
            let Some(object) = held.filter(slips) else { continue };
            if self.luck(agent, Luck::Drop).chance(tremor.drop_chance) {
                let at = self.drop_spot(agent, object);
                self.release(agent, object, None, at, false);
            }
        }
    }

    /// One frame of everything that falls.
    fn let_fall(&mut self) {
        for i in 0..self.state.things.len() {
            let thing = &mut self.state.things[i];
            let Place::Falling { path, on } = &mut thing.place else { continue };
            if let Some((position, rotation)) = path.pop() {
                thing.position = position;
                thing.rotation = rotation;
            }
            if path.is_empty() {
                thing.place = Place::Resting { on: *on };
                self.come_to_rest(crate::Setup::entity(i));
            }
        }
    }

    fn watch_child(&mut self) {
        if self.state.people.len() <= AgentId::CHILD.index() {
            return;
        }
        let at = |a: AgentId| self.person(a).pose.position;
        let distance = horizontal_distance(at(AgentId::CHILD), at(AgentId::PARTNER));
        let away = distance > self.rules.child_away_m;
        if away {
            self.state.child_away_frames += 1;
        }
        if away != self.state.child_is_away {
            self.state.child_is_away = away;
            self.happened(EventKind::ChildAway { away });
        }
    }

    /// Notes who of partner and helper makes progress, and counts the frames in which one of them
    /// is stuck.
    fn watch_progress(&mut self) {
        let frame = self.state.frame;
        let mut is_anybody_stuck = false;
        for agent in self.setup.agents().filter(|a| *a != AgentId::CHILD) {
            let person = self.person_mut(agent);
            let (here, progress) = (person.pose.position, &mut person.progress);
            if horizontal_distance(here, progress.position) > PROGRESS_M {
                (progress.frame, progress.position) = (frame, here);
            }
            let stuck = frame >= progress.frame + STUCK_AFTER_FRAMES;
            is_anybody_stuck |= stuck;
            if std::mem::replace(&mut progress.is_stuck, stuck) != stuck {
                self.happened(EventKind::Stuck { agent, stuck });
            }
        }
        self.state.stuck_frames += u32::from(is_anybody_stuck);
    }

    fn end_if_over(&mut self) {
        let complete = self.is_complete();
        if complete || self.state.frame >= self.setup.horizon {
            self.state.over = true;
            self.happened(EventKind::Over { complete });
        }
    }
}
