//! Partner that repeats the interactions of a recorded person in their order.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use chaic_core::task::SceneKind;
use chaic_core::{Action, AgentError, Briefing, FailureReason, Frame, Outcome};

use super::rule_policy::RulePolicy;
use crate::belief::scene_of;
use crate::decision::{Context, HandState, Plan, Policy};
use crate::rules::RuleProfile;
use crate::track::TrackId;

/// Minimum time for one step, frames: 20 s of walking and searching.
const MIN_STEP_FRAMES: Frame = 600;
/// Time for one step, relative to the recorded time. The partner may search where the person did not.
const STEP_TIME_FACTOR: Frame = 2;
/// Minimum search time for the object of a step before the partner continues with later steps, frames: 5
/// s, about the duration of a look around.
const MIN_SEARCH_FRAMES: Frame = 150;
/// Attempts beyond the recorded ones, for a step in which the person succeeded: outcomes are random.
const EXTRA_ATTEMPTS: u32 = 2;

/// Interaction of a recorded person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordedInteraction {
    /// Picks up a target, a container or a piece of furniture.
    PickUp(TrackId),
    /// Puts the object in one hand into the container in the other.
    PutIn,
    /// Puts down what is carried. The place is not repeated: the partner chooses the goal place.
    PutOn,
    /// Removes an obstacle.
    RemoveObstacle(TrackId),
}

/// Step of a recording: consecutive attempts at one interaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordedStep {
    /// Interaction.
    pub interaction: RecordedInteraction,
    /// Number of attempts, at least 1.
    pub n_attempts: u32,
    /// True if the last attempt succeeded.
    pub is_success: bool,
    /// Time since the end of the step before, frames.
    pub duration_frames: Frame,
}

/// Recording of one person in one episode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanRecording {
    /// Steps in their order.
    pub steps: Vec<RecordedStep>,
    /// Digest of the recording, for traces.
    pub digest: String,
}

/// Step that is still to be repeated.
#[derive(Clone, Copy, Debug)]
struct PendingStep {
    step: RecordedStep,
    /// Attempts that are left.
    n_left: u32,
    /// Earliest frame of the next attempt.
    not_before: Frame,
    /// True if its object was not found; later steps come first until it is seen.
    is_postponed: bool,
    /// Progress since the step began; `None` before it began.
    begun: Option<BegunStep>,
}

/// Progress of a step.
#[derive(Clone, Copy, Debug)]
struct BegunStep {
    frame: Frame,
    /// Length of the agent's history of interactions when the step began.
    n_history: usize,
}

/// Next action on a step.
enum StepChoice {
    /// Execute this plan.
    Plan(Plan),
    /// The step is completed, as far as the partner can.
    Done,
    /// The step is not possible any more.
    Skip,
    /// The step is tried again from this frame on.
    Defer(Frame),
    /// The step waits until its object is seen.
    Postpone,
}

/// Policy that repeats the steps of a recording, and then follows the rules. It walks, searches and
/// remembers by itself; of the recording it knows only the interactions of its own person.
#[derive(Clone, Debug)]
pub struct RecordedPolicy {
    recording: Arc<PlanRecording>,
    rules: RulePolicy,
    queue: VecDeque<PendingStep>,
    has_looked_around: bool,
    last_choice: Frame,
    n_repeated: usize,
    /// True if the last choice replaces the current plan in any case.
    ends_current: bool,
    /// True if the last choice is that of the rules.
    follows_rules: bool,
}

impl RecordedPolicy {
    /// Creates the policy of a partner that repeats this recording.
    pub fn new(recording: Arc<PlanRecording>) -> RecordedPolicy {
        let pending = |step: &RecordedStep| PendingStep {
            step: *step,
            n_left: step.n_attempts + if step.is_success { EXTRA_ATTEMPTS } else { 0 },
            not_before: 0,
            is_postponed: false,
            begun: None,
        };
        RecordedPolicy {
            queue: recording.steps.iter().map(pending).collect(),
            recording,
            rules: RulePolicy::new(RuleProfile::PARTNER),
            has_looked_around: false,
            last_choice: 0,
            n_repeated: 0,
            ends_current: false,
            follows_rules: false,
        }
    }

    /// Index of the first step that is neither deferred nor waiting for its object.
    fn due(&self, context: &Context<'_>) -> Option<usize> {
        let now = context.memory.frame;
        let is_due = |pending: &PendingStep| {
            pending.not_before <= now && (!pending.is_postponed || pending.is_known(context))
        };
        self.queue.iter().position(is_due)
    }

    /// Returns the plan for the next step that is possible; `None` if none is possible now.
    fn next_plan(&mut self, context: &Context<'_>, valid: &[Plan]) -> Option<Plan> {
        let now = context.memory.frame;
        while let Some(index) = self.due(context) {
            let n_history = context.memory.history.len();
            let pending = &mut self.queue[index];
            pending.begun.get_or_insert(BegunStep { frame: now, n_history });
            match pending.choose(context, valid) {
                StepChoice::Plan(plan) => return Some(plan),
                StepChoice::Done => {
                    self.n_repeated += 1;
                    self.queue.remove(index);
                }
                StepChoice::Skip => {
                    self.queue.remove(index);
                }
                StepChoice::Defer(until) => {
                    pending.not_before = until.max(now + 1);
                    pending.begun = None;
                }
                StepChoice::Postpone => {
                    pending.is_postponed = true;
                    pending.begun = None;
                }
            }
            self.ends_current = true;
        }
        None
    }
}

impl PendingStep {
    /// Chooses how to continue the step, which has begun.
    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> StepChoice {
        match self.step.interaction {
            RecordedInteraction::PutIn => self.put_in(context, valid),
            RecordedInteraction::PutOn => self.put_on(context, valid),
            RecordedInteraction::PickUp(object) => self.reach(object, context, valid),
            RecordedInteraction::RemoveObstacle(object) => self.reach(object, context, valid),
        }
    }

    fn put_in(&mut self, context: &Context<'_>, valid: &[Plan]) -> StepChoice {
        // The plan is a single action, and its outcome is known when the next choice is due.
        match context.memory.last {
            Some((Action::PutIn, outcome)) if self.n_left == 0 => match outcome {
                Outcome::Success => StepChoice::Done,
                Outcome::Failure(_) => StepChoice::Skip,
            },
            _ if self.n_left > 0 && valid.contains(&Plan::PutIn) => {
                self.n_left = 0;
                StepChoice::Plan(Plan::PutIn)
            }
            _ => StepChoice::Skip,
        }
    }

    fn put_on(&self, context: &Context<'_>, valid: &[Plan]) -> StepChoice {
        let hands = HandState::new(&context.memory.hands, context.briefing);
        let puts = || self.attempts(context).filter(|(action, _)| is_put_on(action));
        if hands.to_deliver.is_none() {
            let has_put = puts().any(|(_, outcome)| outcome.is_success());
            return if has_put { StepChoice::Done } else { StepChoice::Skip };
        }
        let n_failed = puts().filter(|(_, outcome)| is_real_failure(*outcome)).count();
        if n_failed as u32 >= self.n_left || self.is_late(context) {
            return StepChoice::Skip;
        }
        StepChoice::Plan(if valid.contains(&Plan::Deliver) { Plan::Deliver } else { Plan::Explore })
    }

    /// Chooses how to continue a pick-up or a removal.
    fn reach(&mut self, track: TrackId, context: &Context<'_>, valid: &[Plan]) -> StepChoice {
        let memory = context.memory;
        let (mut has_succeeded, mut n_failed) = (false, 0);
        for (action, outcome) in self.attempts(context) {
            let is_own = action.subject() == Some(track) && !is_put_on(&action);
            has_succeeded |= is_own && outcome.is_success();
            n_failed += u32::from(is_own && is_real_failure(outcome));
        }
        if has_succeeded || memory.hands.all().any(|(held, _)| held == track) {
            return StepChoice::Done;
        }
        let plan = valid.iter().find(|plan| plan.subject().is_some_and(|s| s.track == track));
        let object = memory.objects.get(track);
        let is_lost = object.is_some_and(|o| o.is_out_of_play || memory.frame < o.held_until);
        if self.is_late(context) || is_lost || n_failed >= self.n_left {
            return StepChoice::Skip;
        }
        if let Some(plan) = plan {
            return StepChoice::Plan(*plan);
        }
        if let Some(object) = object.filter(|o| memory.frame < o.ignore_until) {
            self.n_left -= n_failed;
            return StepChoice::Defer(object.ignore_until);
        }
        let Some(object) = object.filter(|o| o.is_present) else {
            return self.search(context);
        };
        let Briefing { possible_targets, containers, obstacles, .. } = context.briefing;
        let kinds = [possible_targets, containers, obstacles];
        if !kinds.iter().any(|classes| classes.contains(&object.class)) {
            return StepChoice::Skip;
        }
        let hands = HandState::new(&memory.hands, context.briefing);
        let is_container = containers.contains(&object.class);
        let is_full = if is_container { !hands.can_take_container } else { !hands.can_take_target };
        match is_full {
            // Full hands, or no path.
            true if is_container && hands.has_container => StepChoice::Skip,
            true if valid.contains(&Plan::PutIn) => StepChoice::Plan(Plan::PutIn),
            true if valid.contains(&Plan::Deliver) => StepChoice::Plan(Plan::Deliver),
            _ if context.is_explored => StepChoice::Skip,
            _ => StepChoice::Plan(Plan::Explore),
        }
    }

    /// Chooses how to continue a step whose object was not seen yet, or is no longer in its place.
    fn search(&self, context: &Context<'_>) -> StepChoice {
        let limit = MIN_SEARCH_FRAMES.max(self.step.duration_frames);
        let is_long = self
            .begun
            .is_some_and(|begun| context.memory.frame > begun.frame.saturating_add(limit));
        match (context.is_explored, is_long) {
            (true, _) => StepChoice::Skip,
            (false, true) => StepChoice::Postpone,
            (false, false) => StepChoice::Plan(Plan::Explore),
        }
    }

    /// Returns whether the object of the step is where the partner can see it, as far as it knows.
    fn is_known(&self, context: &Context<'_>) -> bool {
        let track = match self.step.interaction {
            RecordedInteraction::PickUp(track) | RecordedInteraction::RemoveObstacle(track) => {
                track
            }
            RecordedInteraction::PutIn | RecordedInteraction::PutOn => return true,
        };
        let memory = context.memory;
        memory.objects.get(track).is_some_and(|object| object.is_available(memory.frame))
    }

    /// Returns the agent's interactions since the step began.
    fn attempts<'a>(
        &self,
        context: &Context<'a>,
    ) -> impl Iterator<Item = (Action<TrackId>, Outcome)> + use<'a> {
        let n_before = self.begun.map_or(usize::MAX, |begun| begun.n_history);
        let since = context.memory.history.iter().skip(n_before);
        since.map(|record| (record.action, record.outcome))
    }

    /// Returns whether the step takes far longer than recorded.
    fn is_late(&self, context: &Context<'_>) -> bool {
        let limit = MIN_STEP_FRAMES.max(self.step.duration_frames.saturating_mul(STEP_TIME_FACTOR));
        self.begun.is_some_and(|begun| context.memory.frame > begun.frame.saturating_add(limit))
    }

    /// Returns whether the step ends although its plan is unfinished.
    fn is_over(&self, context: &Context<'_>) -> bool {
        let failures = self.attempts(context).filter(|(_, outcome)| is_real_failure(*outcome));
        self.is_late(context) || failures.count() as u32 >= self.n_left.max(1)
    }
}

fn is_put_on(action: &Action<TrackId>) -> bool {
    matches!(action, Action::PutOn { .. })
}

/// Returns whether an attempt failed for a reason that a person finds out only by an attempt. A failure
/// because of a wrong position or full hands counts as part of the way.
pub fn is_real_failure(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Failure(FailureReason::BeyondLimits | FailureReason::Broke))
}

impl Policy for RecordedPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        let is_street = scene_of(&briefing.possible_targets) == Some(SceneKind::Street);
        let profile = if is_street { RuleProfile::RIDER } else { RuleProfile::PARTNER };
        *self = RecordedPolicy {
            rules: RulePolicy::new(profile),
            ..RecordedPolicy::new(Arc::clone(&self.recording))
        };
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.last_choice = context.memory.frame;
        self.ends_current = false;
        if !std::mem::replace(&mut self.has_looked_around, true) {
            self.rules.skip_look_around();
            if context.memory.rules.initial_look_around {
                return Ok(Plan::TurnAround);
            }
        }
        let plan = self.next_plan(context, valid);
        self.follows_rules = plan.is_none();
        Ok(plan.unwrap_or_else(|| self.rules.decide(context, valid)))
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        let now = context.memory.frame;
        let Some(pending) = self.due(context).map(|index| &self.queue[index]) else {
            return self.rules.reconsiders(context, current, has_changed);
        };
        match current {
            Plan::TurnAround | Plan::PutIn => false,
            _ if pending.is_over(context) => true,
            Plan::Explore => {
                let interval = context.memory.rules.time.replan_interval_frames;
                has_changed || now >= self.last_choice + interval
            }
            _ => false,
        }
    }

    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        (self.ends_current && new != current) || new.supersedes(current)
    }

    fn status(&self) -> Option<String> {
        Some(if self.follows_rules { "rules" } else { "recording" }.to_owned())
    }

    fn recording(&self) -> Option<String> {
        Some(self.recording.digest.clone())
    }

    fn counters(&self) -> BTreeMap<String, u64> {
        let n_skipped = self.recording.steps.len() - self.n_repeated;
        let steps = [("repeated", self.n_repeated), ("skipped", n_skipped)];
        steps.into_iter().map(|(name, n)| (name.to_owned(), n as u64)).collect()
    }

    fn fork(&self) -> Option<RecordedPolicy> {
        Some(self.clone())
    }
}

#[cfg(test)]
mod tests;
