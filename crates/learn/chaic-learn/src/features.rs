//! Feature encoding of a plan choice: one vector for the state and one per candidate plan. All
//! features follow from the helper's memory, its briefing, and the belief that it forms from them.
//! They are scaled so that most lie between 0 and 1.

use std::sync::Arc;

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::belief::Belief;
use chaic_agents::decision::{Context, HandState, Plan, Policy as _};
use chaic_agents::mapping::MappedObject;
use chaic_agents::mapping::passage::stands_in_passage;
use chaic_agents::memory::Memory;
use chaic_agents::policies::{InferOptions, InferPolicy};
use chaic_core::briefing::CompanionRole;
use chaic_core::capability::Persona;
use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::{Briefing, ClassId, Frame, Observation, Role, Vec3};

use crate::candidate_scorer::CandidateSet;
use crate::decision_memory::DecisionMemory;
use crate::opponent::network::{N_GOALS, OpponentModel, OpponentPrediction};
use crate::opponent::tracker::OpponentTracker;
use crate::opponent::{N_BODY_LIMITS, OpponentGoal};
use crate::plan_history::PlanHistory;
use crate::scales::{
    DISTANCE_SCALE_M, TARGET_SETS, TIME_SCALE_FRAMES, flag, log_mass, normalize_clamped, recency,
};

/// Features of the state. Three features per target set follow: the number of objects that the
/// partner has probably taken, the number of available objects, and the probability that the
/// partner wants the set. The last features are the probabilities of each kind of person.
pub const STATE_FEATURES: [&str; 35] = [
    "time_left",
    "horizon",
    "free_hands",
    "has_container",
    "targets_in_hand",
    "can_take_target",
    "can_take_container",
    "can_put_in",
    "can_deliver",
    "goal_is_known",
    "goal_path_length",
    "known_targets",
    "known_containers",
    "known_obstacles",
    "is_explored",
    "unexplored_fraction",
    "scene_size",
    "partner_was_seen",
    "partner_recency",
    "partner_is_in_view",
    "partner_distance",
    "partner_n_held",
    "partner_n_taken",
    "partner_n_failed",
    "partner_failed_height",
    "partner_age",
    "partner_n_certain",
    "goal_entropy",
    "partner_can_put",
    "has_child",
    "child_recency",
    "child_is_away",
    "n_delivered",
    "moves_furniture",
    "n_wanted_known",
];

/// Features of a plan, after a one-hot of [`Plan::KINDS`] and before one flag per target set of the
/// plan's object.
pub const PLAN_FEATURES: [&str; 27] = [
    "is_last_plan",
    "is_nearest_of_kind",
    "path_length",
    "object_to_goal_distance",
    "slack_time",
    "height",
    "mass",
    "is_too_heavy",
    "is_fragile",
    "is_container",
    "partner_distance",
    "partner_is_nearer",
    "partner_goal_distance",
    "n_same_class",
    "partner_n_taken_class",
    "partner_n_taken_set",
    "partner_n_taken_other_sets",
    "partner_n_failed_object",
    "partner_n_failed_class",
    "n_failures",
    "age",
    "n_chosen_of_kind",
    "wanted_probability",
    "expected_missing",
    "partner_reach_probability",
    "partner_lift_probability",
    "stands_in_passage",
];

/// Kinds of people that a partner can be.
const PERSONAS: [Persona; 5] =
    [Persona::Adult, Persona::Child, Persona::Wheelchair, Persona::Rider, Persona::Frail];

/// Number of state features.
pub const N_STATE_FEATURES: usize = STATE_FEATURES.len() + 3 * TARGET_SETS.len() + PERSONAS.len();
/// Number of plan features.
pub const N_PLAN_FEATURES: usize = N_KINDS + PLAN_FEATURES.len() + TARGET_SETS.len();
/// Number of additional state features with an opponent model: goal probabilities and limits.
pub const N_OPPONENT_STATE_FEATURES: usize = N_GOALS + N_BODY_LIMITS;
/// Number of additional plan features with an opponent model. They are the probability that the
/// plan's class is the partner's target, given the goal to pick up, and its product with the
/// probability of that goal.
pub const N_OPPONENT_PLAN_FEATURES: usize = 2;
/// Number of additional plan features with the infer hint: whether the helper `infer` would choose
/// the plan.
pub const N_INFER_HINT_FEATURES: usize = 1;
/// Number of kinds of plans.
const N_KINDS: usize = Plan::KINDS.len();

/// Approximate walking speed, meters per frame, to estimate the remaining time.
const WALKING_M_PER_FRAME: f32 = 0.04;

/// Returns the classes of the objects that the partner has probably taken. The partner was seen to
/// take or hold them, or they are missing and the helper did not handle them.
fn taken_by_partner(context: &Context<'_>) -> Vec<ClassId> {
    let Context { memory, behavior, .. } = context;
    let mut tracks: Vec<_> = behavior.partner_taken.clone();
    let is_handled_by_helper = |t: &MappedObject| {
        memory.history.iter().any(|record| record.action.subject() == Some(t.track))
            || memory.hands.all().any(|(track, _)| track == t.track)
    };
    let targets = memory.objects.iter().filter(|t| {
        context.briefing.possible_targets.contains(&t.class)
            && (!t.is_present || t.held_until > memory.frame)
            && !is_handled_by_helper(t)
    });
    tracks.extend(targets.map(|t| (t.track, t.class)));
    tracks.sort_unstable();
    tracks.dedup_by_key(|(track, _)| *track);
    tracks.into_iter().map(|(_, class)| class).collect()
}

/// Returns the fraction of the scene that is unexplored.
fn unexplored(memory: &Memory) -> f32 {
    let n = memory.map.grid().n_cells();
    (0..n).filter(|cell| memory.map.is_unexplored(*cell)).count() as f32 / n.max(1) as f32
}

/// Encoder of plan choices. It also keeps the history and the belief, which the memory does not
/// contain.
#[derive(Clone)]
pub struct FeatureEncoder {
    /// Previous choices.
    pub history: PlanHistory,
    episode: Option<(Briefing, Belief)>,
    opponent: Option<OpponentTracker>,
    /// Policy of the helper `infer`, whose choice is marked as a hint.
    infer_policy: Option<InferPolicy>,
    memory: DecisionMemory,
}

/// Optional inputs of a policy, in addition to the features of memory and belief.
#[derive(Clone, Debug, Default)]
pub struct OptionalInputs {
    /// Opponent model whose predictions are added.
    pub opponent: Option<Arc<OpponentModel>>,
    /// True to mark the plan that the helper `infer` would choose.
    pub has_infer_hint: bool,
    /// Number of earlier decisions.
    pub memory: usize,
}

impl FeatureEncoder {
    /// Creates an encoder.
    pub fn new(inputs: OptionalInputs) -> FeatureEncoder {
        FeatureEncoder {
            history: PlanHistory::default(),
            episode: None,
            opponent: inputs.opponent.map(OpponentTracker::new),
            infer_policy: inputs.has_infer_hint.then(|| InferPolicy::new(InferOptions::ALL)),
            memory: DecisionMemory::new(inputs.memory),
        }
    }

    /// Starts an episode.
    pub fn reset(&mut self, briefing: &Briefing) {
        self.history = PlanHistory::new(briefing);
        self.memory.clear();
        self.episode = Some((briefing.clone(), Belief::new(briefing)));
        if let Some(opponent) = &mut self.opponent {
            opponent.reset(briefing);
        }
        if let Some(infer_policy) = &mut self.infer_policy {
            infer_policy.reset(briefing);
        }
    }

    /// Adds an observation, after the memory has.
    pub fn observe(&mut self, observation: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        if let Some(infer_policy) = &mut self.infer_policy {
            infer_policy.observe(observation, memory, behavior);
        }
        let Some((briefing, belief)) = &mut self.episode else { return };
        // The policy of `infer` maintains the same belief, so it is updated only once.
        if self.infer_policy.is_none() {
            belief.observe(briefing, memory, behavior);
        }
        if let Some(opponent) = &mut self.opponent {
            opponent.observe(memory, briefing, behavior);
        }
    }

    /// Returns the minimum height of goal places that count in every task that the partner may
    /// have, meters.
    pub fn goal_place_min_top_m(&self, memory: &Memory) -> Option<f32> {
        let (briefing, belief) = self.episode.as_ref()?;
        let belief = self.infer_policy.as_ref().and_then(InferPolicy::belief).unwrap_or(belief);
        belief.goal_place_min_top_m(briefing, memory)
    }

    /// Encodes a choice between these candidates among the valid plans.
    pub fn encode(
        &mut self,
        context: &Context<'_>,
        valid: &[Plan],
        candidates: &[Plan],
    ) -> CandidateSet {
        let mut encoded = self.encode_without_infer_hint(context, candidates);
        if let Some(infer_policy) = &mut self.infer_policy {
            let hinted_plan = infer_policy.choose(context, valid).ok();
            // If the hinted plan does not supersede the current plan, the hint is to continue the
            // current plan.
            let hinted_plan = match self.history.reconsidered() {
                Some(current)
                    if !hinted_plan.is_some_and(|p| infer_policy.supersedes(&p, &current)) =>
                {
                    Some(current)
                }
                _ => hinted_plan,
            };
            let rows = encoded.candidates.chunks_exact(encoded.candidates.len() / candidates.len());
            let mark = |(row, plan): (&[f32], &Plan)| {
                let mut row = row.to_vec();
                row.push(flag(Some(*plan) == hinted_plan));
                row
            };
            encoded.candidates = rows.zip(candidates).flat_map(mark).collect();
        }
        self.memory.add_to(&mut encoded, context.memory.frame);
        encoded
    }

    /// Records the choice of a plan at a frame. `chosen` is the index of the adopted plan among the
    /// candidates of the last encoding; `None` if there was no encoding or it is no candidate.
    pub fn record(&mut self, plan: Plan, chosen: Option<usize>, frame: Frame) {
        self.history.record(plan, frame);
        self.memory.record(chosen, frame);
    }

    fn encode_without_infer_hint(
        &mut self,
        context: &Context<'_>,
        candidates: &[Plan],
    ) -> CandidateSet {
        let prior;
        let infer_belief = self.infer_policy.as_ref().and_then(InferPolicy::belief);
        let belief = match (infer_belief, &self.episode) {
            (Some(belief), _) | (None, Some((_, belief))) => belief,
            (None, None) => {
                prior = Belief::new(context.briefing);
                &prior
            }
        };
        let mut encoded = encode_plans(context, belief, candidates, &self.history);
        let Some(opponent) = &mut self.opponent else {
            return encoded;
        };
        let Context { memory, briefing, behavior, .. } = *context;
        let prediction = opponent.predict(memory, briefing, behavior);
        let OpponentPrediction { goals, limits, .. } = &prediction;
        encoded.state.extend(goals);
        encoded.state.extend(limits);
        let rows = encoded.candidates.chunks_exact(N_PLAN_FEATURES).zip(candidates);
        let target_probability =
            |plan: &Plan| Some(opponent.target_probability(&prediction, plan.subject()?.class));
        encoded.candidates = rows
            .flat_map(|(row, plan)| {
                let p = target_probability(plan).unwrap_or(0.0);
                row.iter().copied().chain([p, p * goals[OpponentGoal::Pick.index()]])
            })
            .collect();
        encoded
    }
}

/// Data that all plans of a decision share.
struct DecisionContext<'a> {
    memory: &'a Memory,
    belief: &'a Belief,
    history: &'a PlanHistory,
    time_left_frames: f32,
    strength_kg: f32,
    partner: Option<Vec3>,
    goal: Option<(Vec3, f32)>,
    taken: Vec<ClassId>,
    available: Vec<ClassId>,
}

/// Encodes a choice without the opponent model.
fn encode_plans(
    context: &Context<'_>,
    belief: &Belief,
    valid: &[Plan],
    history: &PlanHistory,
) -> CandidateSet {
    let Context { briefing, memory, behavior, is_explored } = *context;
    let hands = HandState::new(&memory.hands, briefing);
    let taken = taken_by_partner(context);
    let failed = &belief.evidence.failed;
    let failed_height = failed.last().map_or(0.0, |f| normalize_clamped(f.top_m, 2.0));
    let n_certain: f32 = belief.evidence.taken.values().map(|take| take.reliability()).sum();
    let available: Vec<ClassId> =
        memory.objects.iter().filter(|t| t.is_available(memory.frame)).map(|t| t.class).collect();
    let known =
        |classes: &[ClassId]| available.iter().filter(|c| classes.contains(c)).count() as f32;
    let targets = available.iter().filter(|c| briefing.possible_targets.contains(c));
    let n_wanted: f32 = targets.map(|c| belief.goal.probability_wanted(*c)).sum();
    let goal_places = memory.goal_places();
    let goal_place = goal_places.first();
    let goal = goal_place.map(|(place, path_m)| (place.position_in_world, *path_m));
    let partner = memory.companion(briefing, CompanionRole::Partner);
    let child = memory.companion(briefing, CompanionRole::Child);
    let position = memory.pose.position;
    let time_left_frames = briefing.horizon.saturating_sub(memory.frame) as f32;
    let n_free = memory.hands.hands.iter().filter(|h| h.is_none()).count();
    let scene_size = briefing.bounds.size();
    let moves_furniture =
        briefing.possible_targets.iter().any(|c| c.info().role == Role::HeavyTarget);
    let features: [f32; STATE_FEATURES.len()] = [
        time_left_frames / briefing.horizon.max(1) as f32,
        briefing.horizon as f32 / TIME_SCALE_FRAMES,
        n_free as f32 / 2.0,
        flag(hands.has_container),
        normalize_clamped(hands.targets.len() as f32, 4.0),
        flag(hands.can_take_target),
        flag(hands.can_take_container),
        flag(hands.can_put_in),
        flag(hands.to_deliver.is_some()),
        flag(goal.is_some()),
        goal.map_or(1.0, |(_, path_m)| normalize_clamped(path_m, DISTANCE_SCALE_M)),
        normalize_clamped(known(&briefing.possible_targets), 10.0),
        normalize_clamped(known(&briefing.containers), 3.0),
        normalize_clamped(known(&briefing.obstacles), 4.0),
        flag(is_explored),
        unexplored(memory),
        normalize_clamped((scene_size.x * scene_size.y).max(0.0).sqrt(), 40.0),
        flag(partner.is_some()),
        partner.map_or(0.0, |p| recency(memory.frame - p.frame)),
        flag(partner.is_some_and(|p| p.is_in_view)),
        partner.map_or(1.0, |p| {
            normalize_clamped(horizontal_distance(position, p.position_in_world), DISTANCE_SCALE_M)
        }),
        normalize_clamped(behavior.partner_holds.len() as f32, 3.0),
        normalize_clamped(taken.len() as f32, 6.0),
        normalize_clamped(failed.len() as f32, 4.0),
        failed_height,
        partner.map_or(1.0, |p| normalize_clamped((memory.frame - p.frame) as f32, 1000.0)),
        normalize_clamped(n_certain, 6.0),
        normalize_clamped(belief.goal.entropy_bits(), 3.0),
        goal_place.map_or(0.5, |(place, _)| belief.constraint.put_probability(place.top_m)),
        flag(briefing.companion(CompanionRole::Child).is_some()),
        child.map_or(0.0, |c| recency(memory.frame - c.frame)),
        flag(memory.child_is_away(briefing)),
        normalize_clamped(memory.delivered.len() as f32, 10.0),
        flag(moves_furniture),
        normalize_clamped(n_wanted, 10.0),
    ];
    let mut state = features.to_vec();
    for (classes, max) in [(&taken, 3.0), (&available, 5.0)] {
        let n_in_set = |set| classes.iter().filter(|c| c.info().sets.contains(set)).count();
        state.extend(TARGET_SETS.iter().map(|set| normalize_clamped(n_in_set(set) as f32, max)));
    }
    let sets = belief.goal.set_probabilities();
    state.extend(TARGET_SETS.map(|set| probability_of(&sets, &set)));
    let people = belief.constraint.probabilities();
    state.extend(PERSONAS.map(|persona| probability_of(&people, &persona)));
    let shared = DecisionContext {
        memory,
        belief,
        history,
        time_left_frames,
        strength_kg: briefing.capability.strength_kg,
        partner: partner.map(|p| p.position_in_world),
        goal,
        taken,
        available,
    };
    let mut has_kind = [false; N_KINDS];
    let mut features = Vec::with_capacity(valid.len() * N_PLAN_FEATURES);
    for plan in valid {
        let is_first = !std::mem::replace(&mut has_kind[plan.kind()], true);
        shared.push_plan(plan, is_first, &mut features);
    }
    CandidateSet { state, candidates: features, n_candidates: valid.len(), memory: Vec::new() }
}

/// Returns the sum of the probabilities of one outcome.
fn probability_of<T: PartialEq>(distribution: &[(T, f32)], outcome: &T) -> f32 {
    distribution.iter().filter(|(x, _)| x == outcome).map(|(_, p)| p).sum()
}

impl DecisionContext<'_> {
    fn push_plan(&self, plan: &Plan, is_first_of_kind: bool, to: &mut Vec<f32>) {
        let (kind, subject) = (plan.kind(), plan.subject());
        let start = to.len();
        to.extend((0..N_KINDS).map(|k| flag(k == kind)));
        to.push(flag(self.history.last == Some(*plan)));
        to.push(flag(is_first_of_kind));
        let object = subject.and_then(|subject| self.memory.objects.get(subject.track));
        let at = match plan {
            Plan::Deliver => self.goal.map(|(at, _)| at),
            Plan::FollowPartner => self.partner,
            _ => object.map(|t| t.position_in_world),
        };
        let position = self.memory.pose.position;
        let path_length_m = match (plan, object) {
            (Plan::Deliver, _) => self.goal.map(|(_, path_m)| path_m),
            (_, Some(object)) => self.memory.path_length_to(object),
            _ => at.map(|at| horizontal_distance(position, at)),
        };
        let between =
            |a: Option<Vec3>, b: Option<Vec3>| a.zip(b).map(|(a, b)| horizontal_distance(a, b));
        let goal = self.goal.map(|(at, _)| at);
        let onward_m = if object.is_some() { between(at, goal) } else { None };
        let total_m = path_length_m.unwrap_or(0.0) + onward_m.unwrap_or(0.0);
        to.push(path_length_m.map_or(0.0, |m| normalize_clamped(m, DISTANCE_SCALE_M)));
        to.push(onward_m.map_or(0.0, |m| normalize_clamped(m, DISTANCE_SCALE_M)));
        let slack_frames = self.time_left_frames - total_m / WALKING_M_PER_FRAME;
        to.push((slack_frames / TIME_SCALE_FRAMES).clamp(-1.0, 1.0));
        let info = subject.map(|subject| subject.class.info());
        to.push(object.map_or(0.0, |t| normalize_clamped(t.position_in_world.y, 2.0)));
        to.push(info.map_or(0.0, |i| log_mass(i.mass_kg)));
        to.push(flag(info.is_some_and(|i| i.mass_kg > self.strength_kg)));
        to.push(flag(info.is_some_and(|i| i.role == Role::Fragile)));
        to.push(flag(info.is_some_and(|i| i.role == Role::Container)));
        let partner_m = object.and_then(|t| self.partner.map(|p| t.distance_from(to_xz(p))));
        to.push(partner_m.map_or(0.0, |m| normalize_clamped(m, DISTANCE_SCALE_M)));
        to.push(flag(
            partner_m.zip(path_length_m).is_some_and(|(partner_m, path_m)| partner_m < path_m),
        ));
        to.push(
            between(self.partner, goal).map_or(0.0, |m| normalize_clamped(m, DISTANCE_SCALE_M)),
        );
        let class = subject.map(|subject| subject.class);
        let n_same_class = self.available.iter().filter(|c| Some(**c) == class).count();
        to.push(normalize_clamped(n_same_class as f32, 4.0));
        let shares_set = |other: &&ClassId| {
            info.is_some_and(|i| i.sets.iter().any(|set| other.info().sets.contains(set)))
        };
        let n_taken_same_set = self.taken.iter().filter(shares_set).count();
        to.push(normalize_clamped(
            self.taken.iter().filter(|c| Some(**c) == class).count() as f32,
            3.0,
        ));
        to.push(normalize_clamped(n_taken_same_set as f32, 3.0));
        let n_taken_other_sets =
            if info.is_some() { self.taken.len() - n_taken_same_set } else { 0 };
        to.push(normalize_clamped(n_taken_other_sets as f32, 3.0));
        let track = subject.map(|subject| subject.track);
        let failed = self.belief.evidence.failed.iter();
        let n_failed_object = failed.clone().filter(|f| Some(f.track) == track).count();
        let n_failed_class = failed.filter(|f| Some(f.class) == class).count();
        to.push(normalize_clamped(n_failed_object as f32, 3.0));
        to.push(normalize_clamped(n_failed_class as f32, 3.0));
        to.push(object.map_or(0.0, |t| normalize_clamped(t.failures as f32, 3.0)));
        to.push(
            object.map_or(0.0, |t| {
                normalize_clamped((self.memory.frame - t.last_seen) as f32, 1000.0)
            }),
        );
        to.push(normalize_clamped(self.history.n_chosen_by_kind[kind] as f32, 20.0));
        let Belief { goal, constraint, .. } = self.belief;
        to.push(class.map_or(0.0, |class| goal.probability_wanted(class)));
        to.push(class.map_or(0.0, |c| normalize_clamped(goal.expected_missing(c), 3.0)));
        to.push(object.map_or(0.0, |t| constraint.reach_probability(t.top_m)));
        to.push(info.map_or(0.0, |i| constraint.lift_probability(i.mass_kg)));
        let is_obstacle = |t: &&MappedObject| t.class.info().role == Role::Obstacle;
        let obstacle = object.filter(is_obstacle);
        to.push(flag(obstacle.is_some_and(|t| stands_in_passage(&self.memory.map, t))));
        to.extend(TARGET_SETS.iter().map(|set| flag(info.is_some_and(|i| i.sets.contains(set)))));
        debug_assert_eq!(to.len() - start, N_PLAN_FEATURES);
    }
}
