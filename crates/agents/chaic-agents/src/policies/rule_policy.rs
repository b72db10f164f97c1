//! Handwritten rules of the paper (section 5.1.1), for partners and helpers.

use chaic_core::briefing::{CompanionRole, Goal};
use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::{Action, AgentError, Briefing, ClassId, FailureReason, Frame, Outcome, Role};

use crate::decision::{Context, HandState, Plan, PlanFilter, Policy, Subject};
use crate::mapping::passage::stands_in_passage;
use crate::mapping::{MappedObject, TrackedPerson};
use crate::memory::Memory;
use crate::rules::{Bookkeeping, ObstacleChoice, RuleProfile, TargetFilter, TargetOrder};
use crate::track::TrackId;

/// Chooses by the paper's rules.
#[derive(Clone, Debug)]
pub struct RulePolicy {
    profile: RuleProfile,
    has_looked_around: bool,
    last_look_around: Frame,
    last_choice: Frame,
    /// Frame since which the helper has stood beside the child that ran away.
    beside_child: Option<Frame>,
}

impl RulePolicy {
    /// Returns the plan that the rules choose.
    pub fn decide(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        // Keep `plan_filter` in the same order.
        self.last_choice = context.memory.frame;
        let rules = context.memory.rules;
        if !std::mem::replace(&mut self.has_looked_around, true) && rules.initial_look_around {
            return Plan::TurnAround;
        }
        let hands = HandState::new(&context.memory.hands, context.briefing);
        let need = RemainingNeeds::new(context, &hands, &self.profile);
        let is_valid = |plan: Plan| valid.contains(&plan).then_some(plan);
        // Delivery needs a goal place: without one, explore.
        let deliver = is_valid(Plan::Deliver).unwrap_or(Plan::Explore);
        let carries = hands.to_deliver.is_some();
        if let Some(plan) = self.child_plan(context) {
            return plan;
        }
        if let Some(plan) = is_valid(Plan::PutIn) {
            return plan;
        }
        if delivers_before_targets(context, &hands, &self.profile) {
            return deliver;
        }
        if self.profile.removes_obstacles
            && let Some(plan) = valid.iter().find(|plan| is_relevant_removal(context, plan))
        {
            return *plan;
        }
        if self.takes_container(context, &need)
            && let Some(plan) = valid.iter().find(|p| matches!(p, Plan::PickContainer(_)))
        {
            return *plan;
        }
        if let Some(plan) = self.lift_together_plan(context, valid) {
            return plan;
        }
        if let Some(subject) = self.targets(context, valid, &need).first() {
            return Plan::PickUp(*subject);
        }
        if delivers_without_target(context, carries, &need) {
            return deliver;
        }
        Plan::Explore
    }

    /// Returns whether there is time to use a container, and need for one.
    fn takes_container(&self, context: &Context<'_>, need: &RemainingNeeds<'_>) -> bool {
        fraction_left(context) > self.profile.container_above
            && need.n_left() >= context.memory.rules.min_for_container
    }

    /// Creates a policy with this profile.
    pub fn new(profile: RuleProfile) -> RulePolicy {
        RulePolicy {
            profile,
            has_looked_around: false,
            last_look_around: 0,
            last_choice: 0,
            beside_child: None,
        }
    }

    /// Skips the turn with which a policy begins.
    pub(super) fn skip_look_around(&mut self) {
        self.has_looked_around = true;
    }

    /// Returns the wanted targets among the valid plans for which there is time, nearest first.
    pub(super) fn wanted_targets(&self, context: &Context<'_>, valid: &[Plan]) -> Vec<Subject> {
        let hands = HandState::new(&context.memory.hands, context.briefing);
        self.targets(context, valid, &RemainingNeeds::new(context, &hands, &self.profile))
    }

    /// Applies the rules for the child (facts A2.4), which have priority.
    pub(super) fn child_plan(&mut self, context: &Context<'_>) -> Option<Plan> {
        let (memory, now) = (context.memory, context.memory.frame);
        let child = context.briefing.companion(CompanionRole::Child)?;
        if !(self.profile.supervises_child && memory.rules.supervises_child) {
            return None;
        }
        let guardian = memory.companion(context.briefing, CompanionRole::Partner);
        let child = memory.people.get(child);
        let people = memory.rules.people;
        // The child turns back at its next decision; from then on it needs no company.
        let has_stood = |since: Frame| now > since + people.child_stand_frames;
        let is_overdue = |since: Frame| now >= since + people.child_return_frames;
        let is_trusted = memory.rules.leaves_returning_child
            && self.beside_child.is_some_and(|since| has_stood(since) && !is_overdue(since));
        if self.beside_child.is_some_and(is_overdue) {
            self.beside_child = None;
        }
        self.note_child(context.briefing, memory);
        if memory.child_is_away(context.briefing) && !is_trusted {
            return Some(Plan::FollowChild);
        }
        let max_unseen_frames = memory.rules.child_unseen_frames;
        let is_unseen =
            |p: Option<&TrackedPerson>| p.map_or(0, |p| p.frame) + max_unseen_frames < now;
        let is_lost = is_unseen(guardian) || is_unseen(child);
        (is_lost && self.last_look_around + max_unseen_frames < now).then(|| {
            self.last_look_around = now;
            Plan::TurnAround
        })
    }

    /// Notes the first frame beside a child that is away from its guardian.
    pub(super) fn note_child(&mut self, briefing: &Briefing, memory: &Memory) {
        let child = memory.companion(briefing, CompanionRole::Child);
        let is_beside = |c: &TrackedPerson| {
            let apart_m = horizontal_distance(memory.pose.position, c.position_in_world);
            c.is_in_view && apart_m < memory.rules.people.child_beside_m
        };
        if memory.child_is_away(briefing) && child.is_some_and(is_beside) {
            self.beside_child.get_or_insert(memory.frame);
        }
    }

    /// Returns the needed targets among the valid plans for which there is time, best first.
    fn targets(
        &self,
        context: &Context<'_>,
        valid: &[Plan],
        need: &RemainingNeeds<'_>,
    ) -> Vec<Subject> {
        let mut found: Vec<Subject> = valid
            .iter()
            .filter_map(|plan| match plan {
                Plan::PickUp(subject) => Some(*subject),
                _ => None,
            })
            .filter(|s| need.wants(s.class))
            .collect();
        if context.memory.rules.checks_time_to_deliver && !found.is_empty() {
            // These lengths are the same for all targets.
            let places = context.memory.goal_places();
            found.retain(|s| has_time_for(context, s.track, &places));
        }
        if self.profile.target_order == TargetOrder::HeaviestLiftable {
            let strength_kg = context.briefing.capability.strength_kg;
            let rank = |s: &Subject| {
                let info = s.class.info();
                match info.role {
                    Role::HeavyTarget if info.mass_kg <= strength_kg => -info.mass_kg,
                    _ => 0.0,
                }
            };
            found.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
        }
        found
    }

    /// Returns a plan to lift a piece that the partner cannot lift alone.
    fn lift_together_plan(&self, context: &Context<'_>, valid: &[Plan]) -> Option<Plan> {
        if !self.profile.lifts_together || !context.memory.rules.lifts_together {
            return None;
        }
        let now = context.memory.frame;
        let help_request_frames = context.memory.rules.lifting.help_request_frames;
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        let partner = context.briefing.companion(CompanionRole::Partner);
        let failed_on = partner
            .and_then(|p| context.behavior.last_pick_of(p))
            .filter(|(pick, _)| {
                pick.frame + help_request_frames > now && pick.outcome == Some(failed)
            })
            .map(|(_, object)| object);
        let strength_kg = context.briefing.capability.strength_kg;
        valid.iter().copied().find(|plan| match plan {
            Plan::LiftWith(it) => {
                it.class.info().mass_kg > strength_kg || failed_on == Some(it.track)
            }
            _ => false,
        })
    }
}

impl Policy for RulePolicy {
    fn reset(&mut self, _: &Briefing) {
        *self = RulePolicy::new(self.profile);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        Ok(self.decide(context, valid))
    }

    /// Omits the plans on which [`RulePolicy::decide`] does not depend now.
    fn plan_filter(&self, context: &Context<'_>, current: Option<&Plan>) -> PlanFilter {
        let (rules, briefing) = (context.memory.rules, context.briefing);
        let hands = HandState::new(&context.memory.hands, briefing);
        let looks_around = !self.has_looked_around && rules.initial_look_around;
        if looks_around
            || self.clone().child_plan(context).is_some()
            || hands.can_put_in
            || delivers_before_targets(context, &hands, &self.profile)
        {
            return PlanFilter::NO_OBJECTS;
        }
        let need = RemainingNeeds::new(context, &hands, &self.profile);
        let carries = hands.to_deliver.is_some();
        // A pick-up never replaces a pick-up. Targets then matter only if their absence leads to a
        // delivery, and containers only if their absence leads to a lift.
        let keeps_pick =
            current.is_some_and(Plan::is_pick) && !delivers_without_target(context, carries, &need);
        let may_lift = self.profile.lifts_together
            && rules.lifts_together
            && briefing.capability.lifts_furniture;
        let is_wanted = |class: &ClassId| !keeps_pick && need.wants(*class);
        PlanFilter {
            targets: Some(briefing.possible_targets.iter().copied().filter(is_wanted).collect()),
            containers: self.takes_container(context, &need) && (may_lift || !keeps_pick),
            obstacles: self.profile.removes_obstacles,
        }
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        let rules = context.memory.rules;
        if !rules.replans {
            return self.check_interruption(context, current);
        }
        if matches!(current, Plan::Deliver | Plan::PutIn | Plan::LiftWith(_) | Plan::TurnAround) {
            // These are interrupted only for the child.
            return !matches!(current, Plan::PutIn) && self.needs_child_care(context);
        }
        if matches!(current, Plan::FollowChild) {
            self.note_child(context.briefing, context.memory);
            return false;
        }
        has_changed
            || self.needs_child_care(context)
            || context.memory.frame >= self.last_choice + rules.time.replan_interval_frames
    }

    fn fork(&self) -> Option<RulePolicy> {
        Some(self.clone())
    }
}

impl RulePolicy {
    /// Returns whether the rules for the child interrupt the plan, and notes a finished look around. In
    /// the original, nothing else interrupts it (facts A2.4).
    fn check_interruption(&mut self, context: &Context<'_>, current: &Plan) -> bool {
        match current {
            // The time since looking around starts at its end.
            Plan::TurnAround => self.last_look_around = context.memory.frame,
            Plan::FollowChild => {}
            _ => return self.clone().child_plan(context).is_some(),
        }
        false
    }

    /// Returns whether the rules for the child would interrupt now. Evaluates them on a copy, so
    /// that the state is unchanged.
    pub(super) fn needs_child_care(&self, context: &Context<'_>) -> bool {
        self.has_looked_around && self.clone().child_plan(context) == Some(Plan::FollowChild)
    }
}

/// Objects that are still needed.
struct RemainingNeeds<'a> {
    goal: Option<&'a Goal>,
    /// Classes of the objects delivered or held; with the original's bookkeeping, the classes of
    /// which the agent has ever picked one.
    done: Vec<ClassId>,
}

impl<'a> RemainingNeeds<'a> {
    fn new(context: &Context<'a>, hands: &HandState, profile: &RuleProfile) -> RemainingNeeds<'a> {
        let goal = match profile.target_filter {
            TargetFilter::ByGoal => context.briefing.goal.as_ref(),
            TargetFilter::AnyPossible => None,
        };
        let memory = context.memory;
        if memory.rules.bookkeeping == Bookkeeping::FirstPick {
            let done = if profile.counts_picks { first_picks(memory) } else { Vec::new() };
            return RemainingNeeds { goal, done };
        }
        let mut done: Vec<ClassId> =
            memory.delivered.iter().filter_map(|e| memory.class_of(*e)).collect();
        done.extend(hands.targets.iter().map(|(_, class)| *class));
        let max_age = memory.rules.time.partner_load_valid_frames;
        let held = context.behavior.partner_load(memory.frame, max_age).iter();
        done.extend(held.filter(|(e, _)| !memory.delivered.contains(e)).map(|(_, class)| *class));
        RemainingNeeds { goal, done }
    }

    fn missing(&self, class: ClassId, wanted: u32) -> u32 {
        let done = self.done.iter().filter(|c| **c == class).count();
        wanted.saturating_sub(done as u32)
    }

    fn wants(&self, class: ClassId) -> bool {
        self.goal.is_none_or(|goal| self.missing(class, goal.count(class)) > 0)
    }

    /// Number of objects still needed; `u32::MAX` if the goal is unknown.
    fn n_left(&self) -> u32 {
        self.goal.map_or(u32::MAX, |goal| {
            goal.targets.iter().map(|(class, n)| self.missing(*class, *n)).sum()
        })
    }

    fn is_satisfied(&self) -> bool {
        self.n_left() == 0
    }
}

/// Returns the classes of all objects that the agent has picked up, each once.
fn first_picks(memory: &Memory) -> Vec<ClassId> {
    let taken = memory.history.iter().filter_map(|record| match record.action {
        Action::PickUp { object, .. } if record.outcome.is_success() => memory.class_of(object),
        _ => None,
    });
    let classes: std::collections::BTreeSet<ClassId> = taken.collect();
    classes.into_iter().collect()
}

/// Returns whether the plan removes an obstacle that may block the partner.
pub(super) fn is_relevant_removal(context: &Context<'_>, plan: &Plan) -> bool {
    let Plan::RemoveObstacle(subject) = plan else { return false };
    let memory = context.memory;
    match memory.rules.obstacle_choice {
        ObstacleChoice::All => true,
        ObstacleChoice::InPassages => {
            let object = memory.objects.get(subject.track);
            object.is_some_and(|object| stands_in_passage(&memory.map, object))
        }
    }
}

/// Returns whether carried objects are delivered before any target is picked up.
fn delivers_before_targets(
    context: &Context<'_>,
    hands: &HandState,
    profile: &RuleProfile,
) -> bool {
    hands.to_deliver.is_some() && (!hands.can_take_target || must_deliver(context, profile))
}

/// Returns whether carried objects are delivered when no target is left to pick up.
fn delivers_without_target(
    context: &Context<'_>,
    carries: bool,
    need: &RemainingNeeds<'_>,
) -> bool {
    carries
        && context.memory.rules.delivers_when_done
        && (need.is_satisfied() || context.is_explored)
}

fn fraction_left(context: &Context<'_>) -> f32 {
    let horizon = context.briefing.horizon.max(1);
    horizon.saturating_sub(context.memory.frame) as f32 / horizon as f32
}

fn frames_left(context: &Context<'_>) -> f32 {
    context.briefing.horizon.saturating_sub(context.memory.frame) as f32
}

/// Estimated walking time for this path length, frames.
fn walking_frames(context: &Context<'_>, path_m: f32) -> f32 {
    context.memory.rules.time.path_time_factor * path_m
        / context.briefing.capability.speed_m_per_frame.max(1e-3)
}

/// Returns whether carried objects must be delivered now: by the paper's rule, or because the path
/// is long.
fn must_deliver(context: &Context<'_>, profile: &RuleProfile) -> bool {
    let place = context.memory.goal_places().first().map(|(_, path_m)| *path_m);
    let threshold = match place {
        Some(_) => profile.deliver_below,
        None => profile.deliver_below_unknown,
    };
    let rules = context.memory.rules;
    let delivery_reserve_frames = rules.time.delivery_reserve_frames as f32;
    let is_far = rules.checks_time_to_deliver
        && place.is_some_and(|m| {
            frames_left(context) < walking_frames(context, m) + delivery_reserve_frames
        });
    fraction_left(context) < threshold || is_far
}

/// Returns whether there may be time to fetch an object and bring it to one of these goal places, in a
/// straight line at full speed.
fn has_time_for(context: &Context<'_>, track: TrackId, places: &[(&MappedObject, f32)]) -> bool {
    let memory = context.memory;
    let Some(object) = memory.objects.get(track) else { return true };
    let at = to_xz(object.position_in_world);
    let onward_m = places.iter().map(|(place, _)| place.distance_from(at)).min_by(f32::total_cmp);
    let Some(onward_m) = onward_m else { return true };
    let path_m = object.distance_from(memory.position()) + onward_m;
    let speed = context.briefing.capability.speed_m_per_frame.max(1e-3);
    frames_left(context) > path_m / speed + memory.rules.time.pick_and_put_frames as f32
}

#[cfg(test)]
mod tests;
