//! Simulation of one frame: every person continues its action, objects fall, counters advance.

use chaic_core::action::{Action, FailureReason, Outcome};
use chaic_core::catalogue::Role;
use chaic_core::geom::{forward, wrap_angle};
use chaic_core::{AgentId, EntityId, ResolvedAction};
use chaic_world::EventKind;

use crate::numbers::{DROP, PROGRESS_M, REST_FRAMES, STUCK_FRAMES, WORK_FRAMES};
use crate::scene::{Geometry, distance_m};
use crate::state::{Carry, Location, OngoingAction, Part};
use crate::turn::Turn;
use crate::verdict::Verdict;

/// Status of a part of an action after a frame.
pub(crate) enum PartStatus {
    /// The part continues in the next frame.
    Continues,
    /// The part ended with this frame.
    Ended,
    /// The part took no time; the next part starts in the same frame.
    TakesNoTime,
    /// The action failed in this frame.
    Failed(FailureReason),
}

/// Returns whether an action is neither a step, a turn nor a wait.
fn is_interaction(action: ResolvedAction) -> bool {
    !matches!(
        action,
        Action::MoveForward | Action::TurnLeft | Action::TurnRight | Action::Wait { .. }
    )
}

/// Counts down the remaining frames; returns [`PartStatus::Ended`] at 0.
fn count_down(left: &mut u32) -> PartStatus {
    *left = left.saturating_sub(1);
    if *left == 0 { PartStatus::Ended } else { PartStatus::Continues }
}

impl Turn<'_> {
    /// Runs one frame.
    pub(crate) fn run_frame(&mut self) {
        self.state.touched.clear();
        for agent in self.agents() {
            let works = self.works(agent);
            self.check_motion(agent);
            self.continue_action(agent);
            if self.limits(agent).tires {
                let change = if works { 1.0 / WORK_FRAMES } else { -1.0 / REST_FRAMES };
                let fatigue = &mut self.person_mut(agent).fatigue;
                *fatigue = (*fatigue + change).clamp(0.0, 1.0);
            }
            self.tremble(agent);
        }
        self.land();
        self.state.frame += 1;
        self.state.scene = self.given.after.clone();
        self.count_child();
        self.count_stuck();
        let is_complete = self.is_complete();
        if is_complete || self.state.frame >= self.facts.setup.horizon {
            self.state.over = true;
            self.emit(EventKind::Over { complete: is_complete });
        }
    }

    /// Returns whether walking, handling or following tires the person in this frame.
    fn works(&self, agent: AgentId) -> bool {
        let current = |a: AgentId| self.person(a).ongoing.as_ref().map(|d| d.parts[0]);
        let walks = |part| matches!(part, Some(Part::Walk { .. } | Part::Approach { .. }));
        let is_led = self
            .state
            .carry
            .is_some_and(|c| c.has_begun && c.follower == agent && walks(current(c.leader)));
        let handles = matches!(
            current(agent),
            Some(Part::Arms(_) | Part::Grasp { .. } | Part::Release { .. } | Part::Insert { .. })
        );
        let is_between_steps =
            self.person(agent).in_stride && matches!(current(agent), Some(Part::Stand(_)));
        walks(current(agent)) || handles || is_led || is_between_steps
    }

    /// Reports a person who moved without walking, approaching or carrying furniture together.
    fn check_motion(&mut self, agent: AgentId) {
        if !Geometry::has_moved(&self.state.scene, &self.given.after, agent) {
            return;
        }
        let part = self.person(agent).ongoing.as_ref().map(|d| d.parts[0]);
        let walks = matches!(part, Some(Part::Walk { .. } | Part::Approach { .. }));
        let carries = self.state.carry.is_some_and(|c| c.leader == agent || c.follower == agent);
        if !walks && !carries {
            self.state.impossible_motions.push(format!("the {agent} moved during {part:?}"));
        }
    }

    fn continue_action(&mut self, agent: AgentId) {
        let Some(mut ongoing) = self.person_mut(agent).ongoing.take() else { return };
        loop {
            match self.run_part(agent, &mut ongoing) {
                PartStatus::Continues => {
                    // Furniture lifted by two replaces the action of both.
                    self.person_mut(agent).ongoing.get_or_insert(ongoing);
                    return;
                }
                PartStatus::TakesNoTime => {
                    ongoing.parts.remove(0);
                    if ongoing.parts.is_empty() {
                        return self.end(agent, &ongoing);
                    }
                }
                PartStatus::Ended => {
                    ongoing.parts.remove(0);
                    if ongoing.parts.is_empty() {
                        self.end(agent, &ongoing);
                    } else {
                        self.person_mut(agent).ongoing = Some(ongoing);
                    }
                    return;
                }
                PartStatus::Failed(reason) => {
                    ongoing.failing = Some(reason);
                    return self.end(agent, &ongoing);
                }
            }
        }
    }

    fn end(&mut self, agent: AgentId, ongoing: &OngoingAction) {
        let outcome = ongoing.failing.map_or(Outcome::Success, Outcome::Failure);
        let (action, frame) = (ongoing.action, self.state.frame + 1);
        let position = self.state.scene.people[agent.index()].position;
        let person = self.person_mut(agent);
        let is_put_on = |action| matches!(action, Action::PutOn { .. });
        let follows_put_on = person
            .last_interaction
            .is_some_and(|(_, last, result)| is_put_on(last) && result == Outcome::Success);
        person.last = Some((action, outcome));
        if is_interaction(action) {
            person.last_interaction = Some((frame, action, outcome));
            let is_decided_by_chance = outcome == Outcome::Failure(FailureReason::BeyondLimits);
            if outcome == Outcome::Success || is_decided_by_chance {
                person.progress_frame = frame;
                person.progress_at = position;
            }
        }
        person.in_stride = action == Action::MoveForward && outcome == Outcome::Success;
        self.emit(EventKind::Ended { agent, action, outcome });
        let delivers_all = outcome == Outcome::Success || follows_put_on;
        if !self.is_paper() && is_put_on(action) && delivers_all {
            self.deliver_all_of(agent);
        }
    }

    /// Runs one frame of the current part.
    fn run_part(&mut self, agent: AgentId, ongoing: &mut OngoingAction) -> PartStatus {
        let mut part = ongoing.parts[0];
        let step = match &mut part {
            Part::Stand(left) | Part::Arms(left) => count_down(left),
            Part::Turn { left, yaw_rad } => self.turn(agent, left, *yaw_rad),
            Part::Walk { left_m, covered_m } => self.walk(agent, left_m, covered_m),
            Part::Approach { to, n_stuck } => self.approach_frame(agent, *to, n_stuck),
            Part::AwaitOther { object, waited, n_alone } => {
                self.await_other(agent, ongoing, *object, waited, n_alone)
            }
            Part::DecideTake { hand, object } => self.decide_take(agent, ongoing, *hand, *object),
            Part::DecidePut { hand, place } => self.decide_put(agent, ongoing, *hand, *place),
            Part::Grasp { left, hand, object } => match count_down(left) {
                PartStatus::Ended => {
                    self.close_hand(agent, ongoing, *hand, *object);
                    PartStatus::Ended
                }
                other => other,
            },
            Part::Insert { open: 0, rest, .. } => count_down(rest),
            Part::Insert { open, rest, object, container, is_watched } => {
                *open -= 1;
                if *open == 0 {
                    self.insert(agent, *object, *container);
                    if *is_watched {
                        *rest += self.draw_watch(agent);
                    }
                }
                if *open == 0 && *rest == 0 { PartStatus::Ended } else { PartStatus::Continues }
            }
            Part::Release { open, watch, object, on, sets_down } => {
                if *open > 0 {
                    *open -= 1;
                    if *open == 0 {
                        self.release(agent, *object, *on, *sets_down);
                    }
                } else {
                    *watch -= 1;
                }
                let falls = self.thing(*object).location == Location::Falls;
                let is_done = *open == 0 && (*watch == 0 || !falls);
                if is_done { PartStatus::Ended } else { PartStatus::Continues }
            }
            Part::Follow => PartStatus::Continues,
        };
        if matches!(step, PartStatus::Continues) {
            ongoing.parts[0] = part;
        }
        step
    }

    fn turn(&mut self, agent: AgentId, left: &mut u32, yaw_rad: f32) -> PartStatus {
        let yaw = self.given.after.people[agent.index()].yaw_rad;
        if wrap_angle(yaw - yaw_rad).abs() > 1e-4 {
            // Two people who carry furniture may lack the space to turn.
            if self.is_paper() && self.follower(agent).is_some() {
                return PartStatus::Failed(FailureReason::Blocked);
            }
            self.state
                .impossible_motions
                .push(format!("the {agent} turned to {yaw}, not {yaw_rad}"));
        }
        count_down(left)
    }

    fn walk(&mut self, agent: AgentId, left_m: &mut f64, covered_m: &mut f64) -> PartStatus {
        let n = self.facts.numbers;
        let speed_m = self.limits(agent).speed_m * self.strength(agent);
        let pose = self.state.scene.people[agent.index()];
        let moved = self.given.after.people[agent.index()].position - pose.position;
        let moved_m = f64::from(moved.dot(forward(pose.yaw_rad)));
        *left_m -= speed_m;
        *covered_m += moved_m;
        if !self.is_paper() {
            let is_done = Verdict::at_most(*left_m, 0.0);
            let is_done = is_done.or(Verdict::sure(self.given.stopped[agent.index()]));
            return if self.choices.decide(is_done) {
                PartStatus::Ended
            } else {
                PartStatus::Continues
            };
        }
        let ends = Verdict::at_most(*left_m, 0.0).or(Verdict::at_most(moved_m, 0.1 * speed_m));
        if !self.choices.decide(ends) {
            return PartStatus::Continues;
        }
        let is_far = Verdict::at_most(n.min_progress_m, *covered_m);
        if self.choices.decide(is_far) {
            PartStatus::Ended
        } else {
            PartStatus::Failed(FailureReason::Blocked)
        }
    }

    fn approach_frame(&mut self, agent: AgentId, to: EntityId, n_stuck: &mut u32) -> PartStatus {
        /// Number of frames without getting closer after which a person stops.
        const PATIENCE: u32 = 4;
        let n = self.facts.numbers;
        let [own, next] = [&self.state.scene, &self.given.after]
            .map(|scene| scene.people[agent.index()].position);
        let before_m = self.reach_m(agent, own, to);
        if self.choices.decide(Verdict::at_most(before_m, n.arm_m)) {
            return PartStatus::Ended;
        }
        if !self.is_paper() && self.given.stopped[agent.index()] {
            return PartStatus::Ended;
        }
        let speed_m = self.limits(agent).approach_speed_m * self.strength(agent);
        let approached_m = before_m - self.reach_m(agent, next, to);
        let is_stuck = if self.state.touched.contains(&to) {
            Verdict::Open
        } else {
            Verdict::at_most(approached_m, 0.25 * speed_m)
        };
        *n_stuck = if self.choices.decide(is_stuck) { *n_stuck + 1 } else { 0 };
        if *n_stuck >= PATIENCE { PartStatus::Ended } else { PartStatus::Continues }
    }

    /// Waits at furniture while another person has chosen to pick it up.
    fn await_other(
        &mut self,
        agent: AgentId,
        ongoing: &mut OngoingAction,
        object: EntityId,
        waited: &mut u32,
        n_alone: &mut u32,
    ) -> PartStatus {
        /// Number of frames in which the other person may decide again.
        const GRACE: u32 = 3;
        *waited += 1;
        let wants_it = |a: &AgentId| {
            let other = self.person(*a).ongoing.as_ref();
            other.is_some_and(
                |d| matches!(d.action, Action::PickUp { object: o, .. } if o == object),
            )
        };
        let Some(other) = self.agents().filter(|a| *a != agent).find(wants_it) else {
            *n_alone += 1;
            return if *n_alone >= GRACE { PartStatus::Ended } else { PartStatus::Continues };
        };
        *n_alone = 0;
        let own_reach = self.is_within_reach(agent, object);
        if !self.choices.decide(own_reach) {
            return PartStatus::Failed(FailureReason::Blocked);
        }
        let part = self.person(other).ongoing.as_ref().map(|d| d.parts[0]);
        let is_there = match part {
            Some(Part::AwaitOther { .. }) => self.is_within_reach(other, object),
            _ => Verdict::No,
        };
        if !self.choices.decide(is_there) {
            let is_late = *waited >= self.facts.numbers.await_other;
            return if is_late { PartStatus::Ended } else { PartStatus::Continues };
        }
        let (leader, follower) = (agent.min(other), agent.max(other));
        self.state.carry = Some(Carry { object, leader, follower, has_begun: false });
        let n = self.facts.numbers;
        let common = [Part::Stand(n.turn), Part::Stand(n.gap), Part::Arms(n.reach)];
        let mut lead = common.to_vec();
        lead.push(Part::Stand(n.gap));
        lead.push(Part::Grasp { left: n.grasp, hand: None, object });
        lead.push(Part::Arms(n.raise_furniture));
        let mut follow = common.to_vec();
        follow.push(Part::Follow);
        let (own_parts, other_parts) =
            if agent == leader { (lead, follow) } else { (follow, lead) };
        ongoing.parts.truncate(1);
        ongoing.parts.extend(own_parts);
        if let Some(ongoing) = &mut self.person_mut(other).ongoing {
            ongoing.parts = other_parts;
        }
        PartStatus::TakesNoTime
    }

    /// Lets trembling hands drop objects at random, except during an interaction.
    fn tremble(&mut self, agent: AgentId) {
        if !self.limits(agent).trembles {
            return;
        }
        if self.person(agent).ongoing.as_ref().is_some_and(|d| is_interaction(d.action)) {
            return;
        }
        for hand in 0..2 {
            let Some(object) = self.person(agent).hands[hand] else { continue };
            if matches!(self.role(object), Role::HeavyTarget | Role::Vehicle) {
                continue;
            }
            let count = self.person(agent).n_drop;
            self.person_mut(agent).n_drop += 1;
            if self.draw(agent, "drop", count, [DROP; 2]) {
                self.release(agent, object, None, false);
            }
        }
    }

    /// Lets falling objects come to rest where they rest in the world.
    fn land(&mut self) {
        for entity in self.facts.setup.entities() {
            let k = self.facts.setup.object_index(entity).expect("it exists");
            if self.state.things[k].location == Location::Falls
                && let Some(on) = self.given.rests_on[k]
            {
                self.state.things[k].location = Location::Rests(on);
                self.deliver_if_at_goal(entity);
            }
        }
    }

    fn count_child(&mut self) {
        let Some(child) = self.state.scene.people.get(AgentId::CHILD.index()) else { return };
        let guardian = self.state.scene.people[AgentId::PARTNER.index()].position;
        let distance = distance_m(child.position, guardian);
        let is_near = Verdict::at_most(distance, self.facts.numbers.child_away_m);
        let away = !self.choices.decide(is_near);
        self.state.child_away_frames += u32::from(away);
        if away != self.state.child_is_away {
            self.state.child_is_away = away;
            self.emit(EventKind::ChildAway { away });
        }
    }

    fn count_stuck(&mut self) {
        let mut is_any_stuck = false;
        for agent in self.agents().filter(|a| *a != AgentId::CHILD) {
            let here = self.state.scene.people[agent.index()].position;
            let moved_m = distance_m(here, self.person(agent).progress_at);
            if !self.choices.decide(Verdict::at_most(moved_m, PROGRESS_M)) {
                let frame = self.state.frame;
                let person = self.person_mut(agent);
                person.progress_frame = frame;
                person.progress_at = here;
            }
            let stuck = self.state.frame - self.person(agent).progress_frame >= STUCK_FRAMES;
            is_any_stuck |= stuck;
            if stuck != self.person(agent).is_stuck {
                self.person_mut(agent).is_stuck = stuck;
                self.emit(EventKind::Stuck { agent, stuck });
            }
        }
        self.state.stuck_frames += u32::from(is_any_stuck);
    }
}
