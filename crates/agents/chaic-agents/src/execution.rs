//! Execution of plans, one action at a time.

pub mod destination;
pub mod navigation;
pub mod steering;

pub(crate) mod careful_approach;
pub mod careful_navigation;
pub mod joint_navigation;

pub mod exploration;
pub mod follow;
pub mod frontier_exploration;
pub mod interaction;
pub mod recovery;

pub mod compat;

use chaic_core::briefing::CompanionRole;
use chaic_core::geom::to_xz;
use chaic_core::rng::RngStream;
use chaic_core::{Action, Briefing, FailureReason, Frame, Hand, Outcome, Role, Vec2};

use crate::decision::{HandState, Plan};
use crate::memory::Memory;
use crate::rules::{Exploration, PlaceChoice, PlanTimeouts, PlannerRules, Walking};
use crate::track::{Intent, TrackId};
use careful_navigation::CarefulNavigator;
use compat::lattice_navigation::LatticeNavigator;
use compat::random_exploration::RandomExplorer;
use exploration::ExplorationStep;
use follow::{FollowStep, Follower};
use frontier_exploration::FrontierExplorer;
use interaction::{ApproachStep, Interaction};
use navigation::Navigator;
use recovery::Recovery;

/// Creates the navigator of a navigation rule.
pub fn new_navigator(walking: Walking) -> Box<dyn Navigator> {
    match walking {
        Walking::Careful => Box::<CarefulNavigator>::default(),
        Walking::Lattice => Box::<LatticeNavigator>::default(),
    }
}

/// Number of sides from which one plan looks for a small object.
const MAX_SIDES_VIEWED: u32 = 2;

/// Result of one execution step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Take this action next.
    Act(Intent),
    /// The plan is completed.
    Done,
    /// The plan cannot be completed.
    Failed,
}

/// Inputs of plan execution.
#[derive(Debug)]
pub struct ExecutionContext<'a> {
    /// Memory of the agent.
    pub memory: &'a mut Memory,
    /// Briefing of the agent.
    pub briefing: &'a Briefing,
}

/// Executes one plan after the other.
#[derive(Clone, Debug)]
pub struct Executor {
    navigator: Box<dyn Navigator>,
    recovery: Recovery,
    frontier_explorer: FrontierExplorer,
    random_explorer: RandomExplorer,
    follower: Follower,
    interaction: Option<Interaction>,
    /// Positions from which an interaction with an object failed, with the frame.
    failed_positions: Vec<(TrackId, Vec2, Frame)>,
    rng: RngStream,
    /// Frame in which the current plan began; it advances while the child must be followed.
    plan_start: Frame,
    n_turns: u32,
    n_lifts: u32,
    /// Frame of this plan since which the followed person has been near.
    near_since: Option<Frame>,
    /// Goal place of the current delivery.
    place: Option<TrackId>,
    /// True if the last action was the plan's interaction.
    has_acted: bool,
}

impl Executor {
    /// Creates the executor of one episode.
    pub fn new(briefing: &Briefing, rules: &PlannerRules) -> Executor {
        Executor {
            navigator: new_navigator(rules.walking),
            recovery: Recovery::default(),
            frontier_explorer: FrontierExplorer::new(briefing.bounds),
            random_explorer: RandomExplorer::new(briefing),
            follower: Follower::default(),
            interaction: None,
            failed_positions: Vec::new(),
            rng: RngStream::new(briefing.seed, "execution", 0),
            plan_start: 0,
            n_turns: 0,
            n_lifts: 0,
            near_since: None,
            place: None,
            has_acted: false,
        }
    }

    /// Returns whether all reachable space has been explored.
    pub fn is_explored(&self) -> bool {
        self.frontier_explorer.is_exhausted()
    }

    /// Returns the cells of the current path from the agent on; empty without a path.
    pub fn path(&self) -> &[usize] {
        self.navigator.path()
    }

    /// Starts a plan.
    pub fn start_plan(&mut self, now: Frame, rules: &PlannerRules) {
        self.navigator.reset();
        self.recovery.reset();
        self.follower = Follower::default();
        self.frontier_explorer.reset();
        self.random_explorer.reset();
        self.interaction = None;
        let kept_frames = rules.failures.failed_position_frames;
        self.failed_positions.retain(|(_, _, since)| since + kept_frames > now);
        self.plan_start = now;
        (self.n_turns, self.n_lifts) = (0, 0);
        (self.near_since, self.place, self.has_acted) = (None, None, false);
    }

    /// Returns the next action of `plan`.
    pub fn step(&mut self, plan: &Plan, s: &mut ExecutionContext<'_>) -> Progress {
        if *plan == Plan::FollowChild {
            // The time limit runs only while the child is lost or, without trust in the child,
            // while it is not away.
            let child = s.memory.companion(s.briefing, CompanionRole::Child);
            let is_needed = match s.memory.rules.leaves_returning_child {
                true => child.is_some_and(|c| c.is_in_view),
                false => s.memory.child_is_away(s.briefing),
            };
            self.plan_start = if is_needed { s.memory.frame } else { self.plan_start };
        }
        let elapsed = s.memory.frame.saturating_sub(self.plan_start);
        if elapsed > time_limit(plan, &s.memory.rules.plan_timeouts) {
            return self.time_out(plan, s);
        }
        let is_standing = matches!(plan, Plan::PutIn | Plan::TurnAround | Plan::Wait);
        if is_standing || self.has_acted {
            self.recovery.record_stop();
        }
        // Joint carriers avoid getting stuck by planning for both bodies.
        let is_pair = s.memory.other_end.is_some();
        if !is_standing && !is_pair && self.navigator.needs_recovery() {
            let action = self.recovery.step(s.memory, s.memory.last, &mut self.rng);
            if self.recovery.should_give_up() {
                self.recovery = Recovery::default();
                self.give_up(plan, s);
                return Progress::Failed;
            }
            if let Some(action) = action {
                return Progress::Act(action);
            }
        }
        match *plan {
            Plan::Explore => {
                let step = match s.memory.rules.exploration {
                    Exploration::Frontier | Exploration::UnknownArea => {
                        self.frontier_explorer.step(s.memory, self.navigator.as_mut())
                    }
                    Exploration::Sampled => {
                        self.random_explorer.step(s.memory, self.navigator.as_mut())
                    }
                };
                match step {
                    ExplorationStep::Act(action) => Progress::Act(action),
                    ExplorationStep::Resolved => Progress::Done,
                }
            }
            Plan::PickUp(subject) | Plan::PickContainer(subject) => {
                self.pick_up(subject.track, s, false)
            }
            Plan::LiftWith(subject) => self.pick_up(subject.track, s, true),
            Plan::RemoveObstacle(subject) => self.remove_obstacle(subject.track, s),
            Plan::PutIn => self.put_in(s),
            Plan::Deliver => self.deliver(s),
            Plan::FollowPartner => {
                self.follow(CompanionRole::Partner, s.memory.rules.people.partner_within_m, s)
            }
            Plan::FollowChild => {
                self.follow(CompanionRole::Child, s.memory.rules.people.child_within_m, s)
            }
            Plan::TurnAround => {
                self.n_turns += 1;
                let has_seen = s.memory.rules.look_around_stops_when_found && has_seen_both(s);
                let is_done = self.n_turns > s.memory.rules.look_around_turns || has_seen;
                if is_done { Progress::Done } else { Progress::Act(Action::TurnLeft) }
            }
            Plan::Wait => {
                self.n_turns += 1;
                let action = Action::Wait { frames: s.memory.rules.plan_timeouts.wait_frames };
                if self.n_turns > 1 { Progress::Done } else { Progress::Act(action) }
            }
        }
    }

    /// Ends a plan at its time limit. The last action may have completed it.
    fn time_out(&mut self, plan: &Plan, s: &mut ExecutionContext<'_>) -> Progress {
        let place = self.place.filter(|_| *plan == Plan::Deliver);
        let subject = plan.subject().map(|subject| subject.track).or(place);
        let outcome = subject.and_then(|track| self.interaction_outcome(s, track));
        let is_done = if *plan == Plan::Deliver {
            HandState::new(&s.memory.hands, s.briefing).to_deliver.is_none()
        } else {
            outcome == Some(Outcome::Success)
        };
        if is_done {
            return Progress::Done;
        }
        self.give_up(plan, s);
        Progress::Failed
    }

    /// Prevents the same plan from being repeated at once, after a timeout or when stuck.
    fn give_up(&mut self, plan: &Plan, s: &mut ExecutionContext<'_>) {
        match plan {
            Plan::Explore => self.frontier_explorer.give_up(s.memory.frame),
            Plan::PickUp(subject)
            | Plan::PickContainer(subject)
            | Plan::LiftWith(subject)
            | Plan::RemoveObstacle(subject) => {
                let until = s.memory.frame + s.memory.rules.failures.ignore_frames;
                s.memory.objects.ignore(subject.track, until);
            }
            Plan::Deliver => {
                if let Some(place) = self.place {
                    let rules = &s.memory.rules;
                    let frames =
                        rules.failed_goal_place_frames.max(rules.failures.unreachable_frames);
                    s.memory.objects.ignore(place, s.memory.frame + frames);
                }
            }
            _ => {}
        }
    }

    /// Records that no image from here shows an object on which the plan acts. Returns whether
    /// another side may show it: a wall may hide a large object, the back of a chair a small one.
    /// A small object above the eyes is hidden from all sides, by the edge of what it lies on.
    pub fn record_unseen(&mut self, memory: &Memory, track: TrackId) -> bool {
        let Some(object) = memory.objects.get(track) else { return false };
        let here = memory.position();
        self.failed_positions.push((track, here, memory.frame));
        let max_sides = match memory.eyes_above_m(object) {
            Some(above_m) if above_m <= 0.0 => return false,
            Some(_) => MAX_SIDES_VIEWED,
            None => memory.rules.failures.max_positions_tried,
        };
        let Some(interaction) = self.interaction.as_mut() else { return false };
        interaction.record_failed_position(here);
        self.navigator.reset();
        self.has_acted = false;
        interaction.n_failed() < max_sides
    }

    /// Returns the outcome of the plan's interaction, if it was the last action.
    fn interaction_outcome(
        &mut self,
        s: &ExecutionContext<'_>,
        subject: TrackId,
    ) -> Option<Outcome> {
        let (action, outcome) = s.memory.last?;
        let is_own = std::mem::take(&mut self.has_acted) && action.subject() == Some(subject);
        if is_own
            && let Outcome::Failure(FailureReason::Blocked | FailureReason::OutOfReach) = outcome
        {
            let here = s.memory.position();
            self.failed_positions.push((subject, here, s.memory.frame));
            if let Some(interaction) = &mut self.interaction {
                interaction.record_failed_position(here);
            }
            self.navigator.reset();
        }
        is_own.then_some(outcome)
    }

    fn pick_up(
        &mut self,
        track: TrackId,
        s: &mut ExecutionContext<'_>,
        together: bool,
    ) -> Progress {
        match self.interaction_outcome(s, track) {
            Some(Outcome::Success) => return Progress::Done,
            Some(Outcome::Failure(_)) => self.n_lifts += 1,
            None => {}
        }
        if s.memory.hands.holds(track) {
            return Progress::Done;
        }
        let hands = HandState::new(&s.memory.hands, s.briefing);
        let now = s.memory.frame;
        let Some(object) = s.memory.objects.get(track) else { return Progress::Failed };
        let is_heavy = object.class.info().role == Role::HeavyTarget;
        let is_ignored = !together && now < object.ignore_until;
        if !object.is_present || object.is_out_of_play || now < object.held_until || is_ignored {
            return Progress::Failed;
        }
        let Some(hand) = hands.free_hand else { return Progress::Failed };
        let partner = s.memory.companion(s.briefing, CompanionRole::Partner);
        let lifting = s.memory.rules.lifting;
        let partner_left = partner.is_some_and(|p| {
            p.is_in_view
                && object.distance_from(to_xz(p.position_in_world))
                    > lifting.partner_left_furniture_m
        });
        if together && (partner_left || self.n_lifts >= lifting.max_failed_joint_lifts) {
            return Progress::Failed;
        }
        let hand = if is_heavy { Hand::Left } else { hand };
        let act = Action::PickUp { object: track, hand };
        self.approach(track, s.memory.rules.pick_within_m, act, s)
    }

    fn remove_obstacle(&mut self, track: TrackId, s: &mut ExecutionContext<'_>) -> Progress {
        match self.interaction_outcome(s, track) {
            Some(Outcome::Success) => return Progress::Done,
            Some(Outcome::Failure(_)) | None => {}
        }
        let now = s.memory.frame;
        let is_available = s.memory.objects.get(track).is_some_and(|t| t.is_available(now));
        let (true, Some(hand)) =
            (is_available, HandState::new(&s.memory.hands, s.briefing).free_hand)
        else {
            return Progress::Failed;
        };
        let act = Action::RemoveObstacle { obstacle: track, hand };
        self.approach(track, s.memory.rules.pick_within_m, act, s)
    }

    fn approach(
        &mut self,
        track: TrackId,
        within_m: f32,
        act: Intent,
        s: &mut ExecutionContext<'_>,
    ) -> Progress {
        let interaction = self.interaction.get_or_insert_with(|| {
            let at_track = self.failed_positions.iter().filter(|(e, ..)| *e == track);
            let failed_positions = at_track.map(|(_, position, _)| *position).collect();
            Interaction::new(self.navigator.new_approach(), failed_positions)
        });
        match interaction.step(s.memory, self.navigator.as_mut(), track, within_m) {
            ApproachStep::Walk(action) => Progress::Act(action),
            ApproachStep::Arrived => {
                self.has_acted = true;
                Progress::Act(act)
            }
            ApproachStep::GiveUp => Progress::Failed,
        }
    }

    fn put_in(&mut self, s: &mut ExecutionContext<'_>) -> Progress {
        if std::mem::replace(&mut self.has_acted, true) {
            let is_done = matches!(s.memory.last, Some((Action::PutIn, o)) if o.is_success());
            return if is_done { Progress::Done } else { Progress::Failed };
        }
        let can_put_in = HandState::new(&s.memory.hands, s.briefing).can_put_in;
        if can_put_in { Progress::Act(Action::PutIn) } else { Progress::Failed }
    }

    fn deliver(&mut self, s: &mut ExecutionContext<'_>) -> Progress {
        let Some(hand) = HandState::new(&s.memory.hands, s.briefing).to_deliver else {
            return Progress::Done;
        };
        if let Some(place) = self.place
            && let Some(Outcome::Failure(FailureReason::Impossible)) =
                self.interaction_outcome(s, place)
        {
            return Progress::Failed;
        }
        if self.place.is_none_or(|p| s.memory.objects.get(p).is_none_or(|t| !t.is_present)) {
            s.memory.refresh();
            let places = s.memory.goal_places();
            let chosen = match s.memory.rules.place_choice {
                PlaceChoice::Nearest => places.first(),
                PlaceChoice::Random => self.rng.choose(&places),
            };
            self.place = chosen.map(|(t, _)| t.track);
            // An approach is bound to its place.
            self.interaction = None;
        }
        let Some(place) = self.place else { return Progress::Failed };
        // A failed put-on ends the plan, because its place is ignored (facts A2.1).
        let is_ignored = s.memory.objects.get(place).is_some_and(|t| s.memory.is_blacked_out(t));
        if is_ignored {
            return Progress::Failed;
        }
        let within_m = s.memory.rules.put_within_m;
        self.approach(place, within_m, Action::PutOn { place, hand }, s)
    }

    fn follow(
        &mut self,
        role: CompanionRole,
        keep_m: f32,
        s: &mut ExecutionContext<'_>,
    ) -> Progress {
        let Some(agent) = s.briefing.companion(role) else { return Progress::Failed };
        // The agent gives way to the partner, not to the child. The original's helpers never do.
        let gives_way =
            role == CompanionRole::Partner && s.memory.rules.walking == Walking::Careful;
        let navigator = self.navigator.as_mut();
        if gives_way && let Some(action) = self.follower.give_way(s.memory, navigator, agent) {
            return Progress::Act(action);
        }
        match self.follower.step(s.memory, navigator, agent, keep_m) {
            FollowStep::Act(action) => {
                // Slightly farther than `keep_m` still counts as near: both bodies move in steps.
                let is_near = s.memory.people.get(agent).is_some_and(|p| {
                    let distance_m = s.memory.position().distance(to_xz(p.position_in_world));
                    p.is_in_view && distance_m < s.memory.rules.people.child_beside_m.max(keep_m)
                });
                self.near_since = self.near_since.filter(|_| is_near);
                Progress::Act(action)
            }
            FollowStep::Near(action) => {
                self.recovery.record_stop();
                let since = *self.near_since.get_or_insert(s.memory.frame);
                let stood_frames = s.memory.frame.saturating_sub(since);
                let rules = s.memory.rules;
                let is_enough =
                    rules.leaves_returning_child && stood_frames > rules.people.child_stand_frames;
                if role == CompanionRole::Child && is_enough {
                    return Progress::Done;
                }
                Progress::Act(action)
            }
            FollowStep::Lost => Progress::Failed,
        }
    }
}

/// Returns whether partner and child were both seen recently (facts A2.1).
fn has_seen_both(s: &ExecutionContext<'_>) -> bool {
    let fresh_frames = s.memory.rules.people.fresh_frames;
    [CompanionRole::Partner, CompanionRole::Child].into_iter().all(|role| {
        let person = s.memory.companion(s.briefing, role);
        person.is_some_and(|p| p.frame + fresh_frames > s.memory.frame)
    })
}

fn time_limit(plan: &Plan, limits: &PlanTimeouts) -> Frame {
    match plan {
        Plan::Explore => limits.explore_frames,
        Plan::FollowPartner => limits.follow_partner_frames,
        Plan::FollowChild => limits.follow_child_frames,
        _ => limits.interact_frames,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{Toy, ToyObject, ToyRun};

    #[test]
    fn a_position_that_does_not_show_a_high_object_is_kept_for_later_plans() {
        let mut toy = Toy::room(6.0, 6.0);
        let apple = toy.add(ToyObject::new("apple", [0.0, 2.0, -2.0], [0.1, 0.1, 0.1]));
        let (rules, state) = (PlannerRules::paper(), toy.state(&[]));
        let mut executor = Executor::new(&toy.briefing(), &rules);
        let mut memory = ToyRun::new(toy).observe();
        memory.needs_view = true;
        memory.objects.apply_granted_state(&state.objects[0], memory.frame);
        assert!(!executor.record_unseen(&memory, apple), "no side shows it");
        executor.start_plan(memory.frame + 1, &rules);
        assert_eq!(executor.failed_positions, [(apple, memory.position(), memory.frame)]);
    }
}
