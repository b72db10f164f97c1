//! The handwritten rules of the paper (section 5.1.1), for partners and helpers alike.

use chaic_core::briefing::{Goal, Relation};
use chaic_core::geom::horizontal_distance;
use chaic_core::{Action, AgentError, Briefing, ClassId, FailureReason, Frame, Outcome, Role};

use crate::decision::{Context, HandState, Plan, Policy, Subject};
use crate::mapping::Person;
use crate::memory::Memory;
use crate::rules::Bookkeeping;
use crate::track::TrackId;

/// Which objects one goes for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// What the goal asks for and is neither delivered nor in hand.
    ByGoal,
    /// Whatever may be a target.
    AnyPossible,
}

/// Which of several wanted objects comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetOrder {
    /// The nearest.
    Nearest,
    /// The heaviest that one can lift alone; then the nearest.
    HeaviestLiftable,
}

/// What distinguishes one rule-based mind from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RuleProfile {
    /// Which objects it goes for.
    pub wanted: Wanted,
    /// In which order.
    pub order: TargetOrder,
    /// Whether it clears away the obstacles that its body can lift.
    pub removes_obstacles: bool,
    /// Whether it looks after the child.
    pub minds_child: bool,
    /// Whether it helps the partner lift what is too heavy for one.
    pub lifts_together: bool,
    /// Whether it counts what it takes itself, where bookkeeping is the original's.
    pub counts_picks: bool,
    /// With more than this part of the time left, a container comes first (facts A2.2).
    pub container_above: f32,
    /// With less than this part of the time left, what is carried is delivered at once (facts
    /// A2.2).
    pub deliver_below: f32,
    /// The same while no goal place is known (facts A2.2).
    pub deliver_below_unknown: f32,
}

impl RuleProfile {
    /// The constrained partner (paper section 5.1.1).
    pub const PARTNER: RuleProfile = RuleProfile {
        wanted: Wanted::ByGoal,
        order: TargetOrder::Nearest,
        removes_obstacles: false,
        minds_child: false,
        lifts_together: false,
        counts_picks: true,
        container_above: 0.5,
        deliver_below: 0.25,
        deliver_below_unknown: 0.375,
    };
    /// The rider: delivers in the last 1000 of 3000 frames, 1500 with the goal place unknown
    /// (facts A2.4).
    pub const RIDER: RuleProfile = RuleProfile {
        deliver_below: 1.0 / 3.0,
        deliver_below_unknown: 0.5,
        ..RuleProfile::PARTNER
    };
    /// The rule-based helper (paper, "Detailed RulePolicy for RHP").
    pub const RHP: RuleProfile = RuleProfile {
        wanted: Wanted::AnyPossible,
        removes_obstacles: true,
        minds_child: true,
        lifts_together: true,
        counts_picks: false,
        ..RuleProfile::PARTNER
    };
    /// The oracle: knows the goal and what is done.
    pub const ORACLE: RuleProfile = RuleProfile {
        wanted: Wanted::ByGoal,
        order: TargetOrder::HeaviestLiftable,
        ..RuleProfile::RHP
    };
}

/// Chooses by the paper's rules.
#[derive(Clone, Debug)]
pub struct RulePolicy {
    profile: RuleProfile,
    has_looked_around: bool,
    last_around: Frame,
    last_choice: Frame,
    beside_child: Option<Frame>,
}

impl RulePolicy {
    /// The plan that the rules choose.
    pub fn decide(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        self.last_choice = context.memory.frame;
        let rules = context.memory.rules;
        if !std::mem::replace(&mut self.has_looked_around, true) && rules.looks_around_first {
            return Plan::TurnAround;
        }
        let hands = HandState::of(&context.memory.hands, context.briefing);
        let need = Need::of(context, &hands, &self.profile);
        let is_valid = |plan: Plan| valid.contains(&plan).then_some(plan);
        // Delivering needs a goal place: without one, look for it.
        let deliver = is_valid(Plan::Deliver).unwrap_or(Plan::Explore);
        let carries = hands.to_deliver.is_some();
        if let Some(plan) = self.mind_child(context) {
            return plan;
        }
        if let Some(plan) = is_valid(Plan::PutIn) {
            return plan;
        }
        if carries && (!hands.can_take_target || must_go(context, &self.profile)) {
            return deliver;
        }
        if self.profile.removes_obstacles
            && let Some(plan) = valid.iter().find(|p| matches!(p, Plan::RemoveObstacle(_)))
        {
            return *plan;
        }
        let left = part_left(context);
        if left > self.profile.container_above
            && need.n_left() >= rules.min_for_container
            && let Some(plan) = valid.iter().find(|p| matches!(p, Plan::PickContainer(_)))
        {
            return *plan;
        }
        if let Some(plan) = self.to_lift_together(context, valid) {
            return plan;
        }
        if let Some(subject) = self.targets(context, valid, &need).first() {
            return Plan::PickUp(*subject);
        }
        if carries && rules.delivers_when_done && (need.is_nothing_left() || context.is_explored) {
            return deliver;
        }
        Plan::Explore
    }

    /// RulePolicy of this profile.
    pub fn new(profile: RuleProfile) -> RulePolicy {
        RulePolicy {
            profile,
            has_looked_around: false,
            last_around: 0,
            last_choice: 0,
            beside_child: None,
        }
    }

    /// The child's rules (facts A2.4), before all others.
    fn mind_child(&mut self, context: &Context<'_>) -> Option<Plan> {
        let (memory, now) = (context.memory, context.memory.frame);
        let child = context.briefing.companion(Relation::Child)?;
        if !(self.profile.minds_child && memory.rules.minds_child) {
            return None;
        }
        let guardian = memory.companion(context.briefing, Relation::Partner);
        let child = memory.people.get(child);
        let people = memory.rules.people;
        let beside = |c: &Person| {
            let apart_m = horizontal_distance(memory.pose.position, c.position_in_world);
            c.is_in_view && apart_m < people.child_beside_m
        };
        // The child turns back at its next decision; from then on it needs no company.
        let has_stood = |since: Frame| now > since + people.child_stand_frames;
        let is_overdue = |since: Frame| now >= since + people.child_trust_frames;
        let trusted = memory.rules.trusts_child
            && self.beside_child.is_some_and(|since| has_stood(since) && !is_overdue(since));
        if self.beside_child.is_some_and(is_overdue) {
            self.beside_child = None;
        }
        if let Some(c) = child {
            let away = memory.child_is_away(context.briefing);
            if away && beside(c) {
                self.beside_child.get_or_insert(now);
            }
            if away && !trusted {
                return Some(Plan::FollowChild);
            }
        }
        let patience = memory.rules.child_unseen_frames;
        let unseen = |p: Option<&Person>| p.map_or(0, |p| p.frame) + patience < now;
        let is_lost = unseen(guardian) || unseen(child);
        (is_lost && self.last_around + patience < now).then(|| {
            self.last_around = now;
            Plan::TurnAround
        })
    }

    /// Targets among the valid plans that are wanted and for which there is time, best first.
    fn targets(&self, context: &Context<'_>, valid: &[Plan], need: &Need<'_>) -> Vec<Subject> {
        let mut found: Vec<Subject> = valid
            .iter()
            .filter_map(|plan| match plan {
                Plan::PickUp(subject) => Some(*subject),
                _ => None,
            })
            .filter(|s| need.wants(s.class) && there_is_time(context, s.track))
            .collect();
        if self.profile.order == TargetOrder::HeaviestLiftable {
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

    /// The piece that the partner can't manage and one should lift with it.
    fn to_lift_together(&self, context: &Context<'_>, valid: &[Plan]) -> Option<Plan> {
        if !self.profile.lifts_together || !context.memory.rules.lifts_together {
            return None;
        }
        let now = context.memory.frame;
        let call_frames = context.memory.rules.lifting.call_frames;
        let failed = Outcome::Failure(FailureReason::BeyondLimits);
        let partner = context.briefing.companion(Relation::Partner);
        let failed_on = partner
            .and_then(|p| context.behavior.last_pick_of(p))
            .filter(|(seen, _)| seen.frame + call_frames > now && seen.outcome == Some(failed))
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

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        let rules = context.memory.rules;
        if !rules.reconsiders {
            return self.is_interrupted(context, current);
        }
        if matches!(current, Plan::Deliver | Plan::PutIn | Plan::LiftWith(_) | Plan::TurnAround) {
            // These are only left for the child.
            return !matches!(current, Plan::PutIn) && self.child_calls(context);
        }
        if matches!(current, Plan::FollowChild) {
            return false;
        }
        is_news
            || self.child_calls(context)
            || context.memory.frame >= self.last_choice + rules.time.reconsider_frames
    }

    fn fork(&self) -> Option<RulePolicy> {
        Some(self.clone())
    }
}

impl RulePolicy {
    /// Whether the child's rules, which are all that interrupts a plan of the original, do so now
    /// (facts A2.4).
    fn is_interrupted(&mut self, context: &Context<'_>, current: &Plan) -> bool {
        match current {
            // The time since looking around begins when that has ended.
            Plan::TurnAround => self.last_around = context.memory.frame,
            Plan::FollowChild => {}
            _ => return self.clone().mind_child(context).is_some(),
        }
        false
    }

    /// Whether the child's rules would interrupt now. A copy is asked, so that nothing is noted.
    fn child_calls(&self, context: &Context<'_>) -> bool {
        self.has_looked_around && self.clone().mind_child(context) == Some(Plan::FollowChild)
    }
}

/// What is still wanted.
struct Need<'a> {
    goal: Option<&'a Goal>,
    /// Delivered or held, by class; or, by the original's bookkeeping, the classes of which the
    /// reader has ever taken one.
    done: Vec<ClassId>,
}

impl<'a> Need<'a> {
    fn of(context: &Context<'a>, hands: &HandState, profile: &RuleProfile) -> Need<'a> {
        let goal = match profile.wanted {
            Wanted::ByGoal => context.briefing.goal.as_ref(),
            Wanted::AnyPossible => None,
        };
        let memory = context.memory;
        if memory.rules.bookkeeping == Bookkeeping::FirstPick {
            let done = if profile.counts_picks { first_picks(memory) } else { Vec::new() };
            return Need { goal, done };
        }
        let mut done: Vec<ClassId> =
            memory.delivered.iter().filter_map(|e| memory.class_of(*e)).collect();
        done.extend(hands.targets.iter().map(|(_, class)| *class));
        let behavior = context.behavior;
        let holds_frames = memory.rules.time.partner_holds_frames;
        if behavior.partner_holds_frame.is_some_and(|f| f + holds_frames > memory.frame) {
            let still =
                behavior.partner_holds.iter().filter(|(e, _)| !memory.delivered.contains(e));
            done.extend(still.map(|(_, class)| *class));
        }
        Need { goal, done }
    }

    fn missing(&self, class: ClassId, wanted: u32) -> u32 {
        let done = self.done.iter().filter(|c| **c == class).count();
        wanted.saturating_sub(done as u32)
    }

    fn wants(&self, class: ClassId) -> bool {
        self.goal.is_none_or(|goal| self.missing(class, goal.wanted(class)) > 0)
    }

    /// How many objects are wanted yet; many if nobody knows.
    fn n_left(&self) -> u32 {
        self.goal.map_or(u32::MAX, |goal| {
            goal.targets.iter().map(|(class, n)| self.missing(*class, *n)).sum()
        })
    }

    fn is_nothing_left(&self) -> bool {
        self.n_left() == 0
    }
}

/// The classes of which one has taken something, each once.
fn first_picks(memory: &Memory) -> Vec<ClassId> {
    let taken = memory.history.iter().filter_map(|done| match done.action {
        Action::PickUp { object, .. } if done.outcome.is_success() => memory.class_of(object),
        _ => None,
    });
    let classes: std::collections::BTreeSet<ClassId> = taken.collect();
    classes.into_iter().collect()
}

fn part_left(context: &Context<'_>) -> f32 {
    let horizon = context.briefing.horizon.max(1);
    horizon.saturating_sub(context.memory.frame) as f32 / horizon as f32
}

fn frames_left(context: &Context<'_>) -> f32 {
    context.briefing.horizon.saturating_sub(context.memory.frame) as f32
}

/// Frames to walk so far.
fn frames_for(context: &Context<'_>, way_m: f32) -> f32 {
    context.memory.rules.time.walk_factor * way_m
        / context.briefing.capability.speed_m_per_frame.max(1e-3)
}

/// Whether what is carried must be brought now: by the paper's rule, or because the way is long.
fn must_go(context: &Context<'_>, profile: &RuleProfile) -> bool {
    let place = context.memory.goal_places().first().map(|(_, way_m)| *way_m);
    let below = match place {
        Some(_) => profile.deliver_below,
        None => profile.deliver_below_unknown,
    };
    let rules = context.memory.rules;
    let spare = rules.time.spare_frames as f32;
    let is_far = rules.weighs_time
        && place.is_some_and(|m| frames_left(context) < frames_for(context, m) + spare);
    part_left(context) < below || is_far
}

/// Whether there may be time to fetch an object and bring it to a known goal place: on the
/// straightest way, at full speed.
fn there_is_time(context: &Context<'_>, track: TrackId) -> bool {
    let memory = context.memory;
    let Some(thing) = memory.things.get(track).filter(|_| memory.rules.weighs_time) else {
        return true;
    };
    let at = chaic_core::geom::xz(thing.position_in_world);
    let places = memory.goal_places();
    let onward_m = places.iter().map(|(place, _)| place.distance_from(at)).min_by(f32::total_cmp);
    let Some(onward_m) = onward_m else { return true };
    let way_m = thing.distance_from(memory.here()) + onward_m;
    let speed = context.briefing.capability.speed_m_per_frame.max(1e-3);
    frames_left(context) > way_m / speed + memory.rules.time.pick_and_put_frames as f32
}

#[cfg(test)]
mod tests;
