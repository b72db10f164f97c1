//! Helper that infers what the partner wants and cannot do, and plans for both.
//!
//! It watches the partner while its goal is unclear, and then follows a team plan
//! ([`crate::team`]). With a granted goal or state, the same policy gives upper bounds.

mod description;

use std::collections::BTreeMap;

use chaic_core::agent::PartnerBelief;
use chaic_core::briefing::{CompanionRole, Goal};
use chaic_core::capability::{Capability, Persona};
use chaic_core::geom::to_xz;
use chaic_core::rng::RngStream;
use chaic_core::{Action, AgentError, Briefing, ClassId, Frame, Observation, Role};

use super::rule_policy::{RulePolicy, is_relevant_removal};
use crate::behavior::BehaviorLog;
use crate::belief::Belief;
use crate::decision::{Context, HandState, Plan, Policy, Subject};
use crate::execution::follow::SEARCH_TURNS;
use crate::mapping::TrackedPerson;
use crate::memory::Memory;
use crate::rules::RuleProfile;
use crate::team::builder::{PartnerModel, ProblemBuilder};
use crate::team::{Operation, SearchSettings, TeamProblem, search_operations, simulate};
use crate::track::TrackId;

/// Parts of the helper that an ablation switches off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InferOptions {
    /// True if it follows the partner while the goal is unclear.
    pub follows_partner: bool,
    /// True if it infers the partner's limits; else it assumes an adult without limits.
    pub infers_constraint: bool,
    /// True if it plans for both; else it follows the rules of the oracle once the goal is clear.
    pub uses_team_planner: bool,
}

impl InferOptions {
    /// Everything on.
    pub const ALL: InferOptions =
        InferOptions { follows_partner: true, infers_constraint: true, uses_team_planner: true };
    /// Without following the partner.
    pub const WITHOUT_FOLLOWING: InferOptions =
        InferOptions { follows_partner: false, ..InferOptions::ALL };
    /// Without inference of the partner's limits.
    pub const NO_CONSTRAINT: InferOptions =
        InferOptions { infers_constraint: false, ..InferOptions::ALL };
    /// Without the planner for both people.
    pub const NO_PLANNER: InferOptions =
        InferOptions { uses_team_planner: false, ..InferOptions::ALL };
}

/// Constants of the policy, all ours; chosen on episodes of `gen-standard:7000..7010` and
/// `gen-standard:8100..8140`.
mod constants {
    use chaic_core::Frame;

    /// Probability of the most likely target set from which the helper acts on it.
    pub const IDENTIFIED_PROBABILITY: f32 = 0.7;
    /// The same late in the episode, when there is no time to wait for evidence.
    pub const LATE_PROBABILITY: f32 = 0.25;
    /// Fractions of the episode between which the probability falls linearly.
    pub const LATE_FRACTIONS: [f32; 2] = [0.2, 0.5];
    /// Time after a sighting for which the helper follows the partner while the goal is unclear,
    /// frames. Later it explores, which finds the partner sooner.
    pub const LOST_FRAMES: Frame = 200;
    /// Distance from the partner's last position within which turns count as a search for it, meters: the
    /// stopping distance of a follower and one step.
    pub const SEARCH_RADIUS_M: f32 = 1.3;
    /// Goals with a lower probability are left out of the plan: to explore is better than to fetch
    /// objects that are probably unwanted.
    pub const MIN_GOAL_PROBABILITY: f32 = 0.15;
    /// Probability from which a class outside the target set counts as wanted.
    pub const MIN_EXTRA_PROBABILITY: f32 = 0.5;
    /// Number of objects assumed for each class of a target set: more than any episode has.
    pub const ASSUMED_OBJECTS_PER_CLASS: f32 = 9.0;
    /// Value by which a new plan must exceed the current one before a walk to an object is given
    /// up, deliveries.
    pub const MIN_SWITCH_GAIN: f32 = 0.25;
    /// Interval between reconsiderations of idle plans, frames.
    pub const IDLE_FRAMES: Frame = 60;
    /// Interval between reconsiderations of walks to objects, frames.
    pub const WALK_FRAMES: Frame = 80;
    /// Time left above which a helper with a free hand explores rather than delivers, frames.
    pub const EXPLORE_LOADED_FRAMES: f32 = 900.0;
}
use constants::*;

/// Step of a plan, by tracks instead of places, which change between decisions.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    PickUp(TrackId),
    TakeContainer(TrackId),
    Deliver,
    Remove(TrackId),
}

/// Policy that infers goal and limits of the partner, and plans for both people.
#[derive(Clone, Debug)]
pub struct InferPolicy {
    options: InferOptions,
    rules: RulePolicy,
    briefing: Option<Briefing>,
    belief: Option<Belief>,
    builder: ProblemBuilder,
    rng: RngStream,
    /// Remaining steps of the current team plan.
    steps: Vec<Step>,
    /// Expected operations of the partner as text.
    partner_plan: Vec<String>,
    /// True if the last choice may replace a walk to another object.
    may_switch: bool,
    has_looked_around: bool,
    /// Frame in which the goal became clear.
    identified: Option<Frame>,
    last_choice: Frame,
    search: PartnerSearch,
    mode: &'static str,
}

/// Search for the partner where it was seen last.
#[derive(Clone, Copy, Debug, Default)]
struct PartnerSearch {
    /// Turns near that position since the last sighting.
    n_turns: u32,
}

impl PartnerSearch {
    fn observe(&mut self, memory: &Memory, partner: Option<&TrackedPerson>) {
        let Some(lost) = partner.filter(|p| !p.is_in_view) else {
            self.n_turns = 0;
            return;
        };
        let has_turned = matches!(memory.last, Some((Action::TurnLeft | Action::TurnRight, _)));
        let distance_m = to_xz(lost.position_in_world).distance(memory.position());
        self.n_turns += u32::from(has_turned && distance_m < SEARCH_RADIUS_M);
    }

    /// Returns whether the search has failed; another search there would be useless.
    fn has_failed(&self) -> bool {
        self.n_turns >= SEARCH_TURNS
    }
}

impl InferPolicy {
    /// Creates a policy with these parts switched on.
    pub fn new(options: InferOptions) -> InferPolicy {
        InferPolicy {
            options,
            rules: RulePolicy::new(RuleProfile::ORACLE),
            briefing: None,
            belief: None,
            builder: ProblemBuilder::default(),
            rng: RngStream::new(0, "infer/plan", 0),
            steps: Vec::new(),
            partner_plan: Vec::new(),
            may_switch: false,
            has_looked_around: false,
            identified: None,
            last_choice: 0,
            search: PartnerSearch::default(),
            mode: "watch",
        }
    }

    /// The current belief, once an episode has begun.
    pub fn belief(&self) -> Option<&Belief> {
        self.belief.as_ref()
    }

    fn partner_capability(&self) -> Capability {
        match &self.belief {
            Some(belief) if self.options.infers_constraint => belief.constraint.capability(),
            _ => Persona::Adult.capability(),
        }
    }

    /// Returns the possible goals with their probabilities and wanted numbers.
    fn goals(&self, briefing: &Briefing) -> Vec<(f32, BTreeMap<ClassId, f32>)> {
        if let Some(goal) = &briefing.goal {
            let wanted = goal.targets.iter().map(|(class, n)| (*class, *n as f32));
            return vec![(1.0, wanted.collect())];
        }
        let Some(belief) = &self.belief else { return Vec::new() };
        let mut goals: Vec<(f32, BTreeMap<ClassId, f32>)> = Vec::new();
        for (set, probability) in belief.goal.set_probabilities() {
            if probability < MIN_GOAL_PROBABILITY {
                continue;
            }
            let wanted = briefing.possible_targets.iter().filter_map(|class| {
                let info = class.info();
                if info.sets.contains(&set) {
                    return Some((*class, ASSUMED_OBJECTS_PER_CLASS));
                }
                let wanted = belief.goal.probability_wanted_given(set, *class);
                let is_likely = wanted >= MIN_EXTRA_PROBABILITY;
                let n = if info.role == Role::Fragile { 2.0 } else { 1.0 };
                is_likely.then_some((*class, n))
            });
            goals.push((probability, wanted.collect()));
        }
        let total: f32 = goals.iter().map(|(p, _)| p).sum();
        goals.iter_mut().for_each(|(p, _)| *p /= total.max(1e-6));
        goals
    }

    /// Returns whether the goal is clear enough to act on it, and notes when it became so.
    fn check_goal(&mut self, context: &Context<'_>) -> bool {
        let fraction = context.memory.frame as f32 / context.briefing.horizon as f32;
        let [early, late] = LATE_FRACTIONS;
        let lateness = ((fraction - early) / (late - early)).clamp(0.0, 1.0);
        let required =
            IDENTIFIED_PROBABILITY + lateness * (LATE_PROBABILITY - IDENTIFIED_PROBABILITY);
        let is_clear = context.briefing.goal.is_some()
            || self.belief.as_ref().is_some_and(|belief| belief.goal.most_likely().1 >= required);
        if is_clear && self.identified.is_none() {
            self.identified = Some(context.memory.frame);
        }
        is_clear
    }

    fn partner_model(&self, context: &Context<'_>) -> PartnerModel {
        let position = context
            .memory
            .companion(context.briefing, CompanionRole::Partner)
            .map(|person| to_xz(person.position_in_world));
        let max_age = context.memory.rules.time.partner_load_valid_frames;
        let holds = context.behavior.partner_load(context.memory.frame, max_age).to_vec();
        let goals = self.goals(context.briefing);
        PartnerModel { capability: self.partner_capability(), position, holds, goals }
    }

    /// Returns the plan of the team planner; `None` if it has nothing to do.
    fn team_plan(&mut self, context: &Context<'_>, valid: &[Plan]) -> Option<Plan> {
        let partner = self.partner_model(context);
        let problem = self.builder.build(context.briefing, context.memory, &partner)?;
        let warm = self.operations(&problem);
        let plan =
            search_operations(&problem, warm.as_slice(), SearchSettings::DEFAULT, &mut self.rng);
        let stay = warm.map_or(f32::MIN, |warm| simulate(&problem, &warm));
        self.may_switch = plan.value > stay + MIN_SWITCH_GAIN;
        self.partner_plan = description::expected_partner_plan(&problem, &plan.operations);
        self.steps = plan.operations.iter().map(|o| step(&problem, *o)).collect();
        self.first_valid(context, valid, &problem)
    }

    /// Returns the current steps as operations of this problem; `None` if there are none.
    fn operations(&self, problem: &TeamProblem) -> Option<Vec<Operation>> {
        let find = |track: &TrackId| problem.places.iter().position(|p| p.track == *track);
        let operations = self.steps.iter().filter_map(|step| match step {
            Step::PickUp(track) => find(track).map(Operation::PickUp),
            Step::TakeContainer(track) => find(track).map(Operation::TakeContainer),
            Step::Deliver => Some(Operation::Deliver),
            Step::Remove(track) => find(track).map(Operation::Remove),
        });
        let operations: Vec<Operation> = operations.collect();
        (!operations.is_empty()).then_some(operations)
    }

    /// Returns the first step that is possible now as a plan.
    fn first_valid(
        &self,
        context: &Context<'_>,
        valid: &[Plan],
        problem: &TeamProblem,
    ) -> Option<Plan> {
        let hands = HandState::new(&context.memory.hands, context.briefing);
        let is_valid = |plan: Plan| valid.contains(&plan).then_some(plan);
        let deliver = || hands.to_deliver.and_then(|_| is_valid(Plan::Deliver));
        let subject = |track: TrackId| {
            let place = problem.places.iter().find(|p| p.track == track)?;
            Some(Subject { track, class: place.class })
        };
        self.steps.iter().find_map(|step| match step {
            Step::PickUp(_) if hands.can_put_in => is_valid(Plan::PutIn),
            Step::PickUp(_) if !hands.can_take_target => deliver(),
            Step::PickUp(track) => subject(*track).and_then(|s| is_valid(Plan::PickUp(s))),
            Step::TakeContainer(_) if hands.has_container => None,
            Step::TakeContainer(_) if hands.free_hand.is_none() => deliver(),
            Step::TakeContainer(track) => {
                subject(*track).and_then(|s| is_valid(Plan::PickContainer(s)))
            }
            Step::Deliver => deliver(),
            Step::Remove(_) if hands.free_hand.is_none() => deliver(),
            Step::Remove(track) => subject(*track).and_then(|s| is_valid(Plan::RemoveObstacle(s))),
        })
    }

    /// Returns the plan if the goal is clear but no step is possible: that of the rules without
    /// containers.
    fn without_step(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        let hands = HandState::new(&context.memory.hands, context.briefing);
        let frames_left = context.briefing.horizon.saturating_sub(context.memory.frame) as f32;
        let carries = hands.to_deliver.is_some();
        let may_find_more = !context.is_explored && hands.can_take_target;
        if carries
            && !(may_find_more && frames_left > EXPLORE_LOADED_FRAMES)
            && valid.contains(&Plan::Deliver)
        {
            return Plan::Deliver;
        }
        if let Some(remove) = valid.iter().find(|plan| is_relevant_removal(context, plan)) {
            return *remove;
        }
        let is_container = |plan: &&Plan| matches!(plan, Plan::PickContainer(_));
        let others: Vec<Plan> = valid.iter().filter(|plan| !is_container(plan)).copied().collect();
        let goal = self.most_likely_goal(context.briefing);
        let briefing = Briefing { goal, ..context.briefing.clone() };
        match self.rules.decide(&Context { briefing: &briefing, ..*context }, &others) {
            Plan::Explore
                if context.is_explored
                    && valid.contains(&Plan::FollowPartner)
                    && !self.search.has_failed() =>
            {
                Plan::FollowPartner
            }
            plan => plan,
        }
    }

    /// Returns the most likely goal. Unless the goal is granted, its numbers of objects are those of
    /// [`goals`](Self::goals): more than any episode has, except for fragile and extra classes.
    fn most_likely_goal(&self, briefing: &Briefing) -> Option<Goal> {
        let goals = self.goals(briefing);
        let best = goals.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let targets = best.1.into_iter().map(|(class, n)| (class, n as u32));
        Some(Goal { targets: targets.collect() })
    }

    /// Returns the plan while the goal is unclear.
    fn while_unclear(&mut self, context: &Context<'_>, valid: &[Plan]) -> Plan {
        let memory = context.memory;
        let hands = HandState::new(&memory.hands, context.briefing);
        if hands.to_deliver.is_some() && !hands.can_take_target && valid.contains(&Plan::Deliver) {
            return Plan::Deliver;
        }
        if let Some(remove) = valid.iter().find(|plan| is_relevant_removal(context, plan)) {
            return *remove;
        }
        let partner = memory.companion(context.briefing, CompanionRole::Partner);
        let was_seen = partner.is_some_and(|p| p.frame + LOST_FRAMES > memory.frame);
        let follows = self.options.follows_partner && was_seen && !self.search.has_failed();
        if follows && valid.contains(&Plan::FollowPartner) {
            return Plan::FollowPartner;
        }
        Plan::Explore
    }
}

fn step(problem: &TeamProblem, operation: Operation) -> Step {
    match operation {
        Operation::PickUp(place) => Step::PickUp(problem.places[place].track),
        Operation::TakeContainer(place) => Step::TakeContainer(problem.places[place].track),
        Operation::Deliver => Step::Deliver,
        Operation::Remove(place) => Step::Remove(problem.places[place].track),
    }
}

fn moves_furniture(briefing: &Briefing) -> bool {
    briefing.possible_targets.iter().any(|class| class.info().role == Role::HeavyTarget)
}

impl Policy for InferPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        *self = InferPolicy::new(self.options);
        self.rules.reset(briefing);
        self.rng = RngStream::new(briefing.seed, "infer/plan", 0);
        self.belief = Some(Belief::new(briefing));
        self.briefing = Some(briefing.clone());
        self.has_looked_around = briefing.layout.is_some();
    }

    fn observe(&mut self, _: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        let Some(briefing) = &self.briefing else { return };
        if let Some(belief) = &mut self.belief {
            belief.observe(briefing, memory, behavior);
        }
        let partner = memory.companion(briefing, CompanionRole::Partner);
        self.search.observe(memory, partner);
        self.rules.note_child(briefing, memory);
        if let Some(person) = partner.filter(|p| p.is_in_view) {
            let position = to_xz(person.position_in_world);
            self.builder.observe_partner(memory, position);
        }
    }

    fn goal_place_min_top_m(&self, memory: &Memory) -> Option<f32> {
        let briefing = self.briefing.as_ref().filter(|_| self.options.infers_constraint)?;
        self.belief.as_ref()?.goal_place_min_top_m(briefing, memory)
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.last_choice = context.memory.frame;
        self.may_switch = false;
        if moves_furniture(context.briefing) {
            self.mode = "rules";
            return Ok(self.rules.decide(context, valid));
        }
        if !std::mem::replace(&mut self.has_looked_around, true) {
            self.rules.skip_look_around();
            return Ok(Plan::TurnAround);
        }
        self.rules.skip_look_around();
        if let Some(plan) = self.rules.child_plan(context) {
            return Ok(plan);
        }
        if !self.check_goal(context) {
            self.mode = "watch";
            return Ok(self.while_unclear(context, valid));
        }
        if !self.options.uses_team_planner {
            self.mode = "rules";
            let goal = self.most_likely_goal(context.briefing);
            let briefing = Briefing { goal, ..context.briefing.clone() };
            return Ok(self.rules.decide(&Context { briefing: &briefing, ..*context }, valid));
        }
        self.mode = "plan";
        Ok(match self.team_plan(context, valid) {
            Some(plan) => plan,
            None => self.without_step(context, valid),
        })
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        if moves_furniture(context.briefing) {
            return self.rules.reconsiders(context, current, has_changed);
        }
        let since = context.memory.frame.saturating_sub(self.last_choice);
        match current {
            Plan::PutIn | Plan::FollowChild | Plan::TurnAround => false,
            _ if self.rules.needs_child_care(context) => true,
            Plan::Explore | Plan::FollowPartner | Plan::Wait => {
                has_changed || since >= IDLE_FRAMES || {
                    let was_clear = self.identified.is_some();
                    !was_clear && self.check_goal(context)
                }
            }
            Plan::PickUp(_) | Plan::PickContainer(_) => has_changed && since >= WALK_FRAMES,
            _ => false,
        }
    }

    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        if current.is_pick() && new.is_pick() && new != current {
            return self.may_switch;
        }
        let is_idle = |p: &Plan| matches!(p, Plan::Explore | Plan::FollowPartner | Plan::Wait);
        if is_idle(current) && is_idle(new) {
            return std::mem::discriminant(new) != std::mem::discriminant(current);
        }
        new.supersedes(current)
    }

    fn status(&self) -> Option<String> {
        Some(self.mode.to_owned())
    }

    fn partner_belief(&self, briefing: &Briefing, memory: &Memory) -> Option<PartnerBelief> {
        description::partner_belief(self, briefing, memory)
    }

    fn fork(&self) -> Option<InferPolicy> {
        Some(self.clone())
    }
}

#[cfg(test)]
mod tests;
