//! Features of a partner's choice: one vector for the state and one per candidate plan. They follow from the
//! partner's own memory, briefing and goal, and most lie between 0 and 1.

use chaic_agents::belief::scene_of;
use chaic_agents::decision::{Context, HandState, Plan};
use chaic_core::briefing::CompanionRole;
use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::task::SceneKind;
use chaic_core::{Action, ClassId, Frame, Role, Vec3};

use crate::candidate_scorer::CandidateSet;
use crate::scales::{
    DISTANCE_SCALE_M, TIME_SCALE_FRAMES, flag, log_mass, normalize_clamped, recency,
};

/// Number of kinds of plans.
const N_KINDS: usize = Plan::KINDS.len();
/// Features of the state, before a one-hot of the kind of the last finished plan.
pub const PARTNER_STATE_FEATURES: [&str; 29] = [
    "is_first",
    "time_left",
    "horizon",
    "n_free_hands",
    "has_container",
    "n_targets_in_hand",
    "can_take_target",
    "can_take_container",
    "can_put_in",
    "can_deliver",
    "goal_place_is_known",
    "goal_path_length",
    "n_missing",
    "n_wanted_known",
    "n_containers_known",
    "is_explored",
    "n_delivered",
    "helper_recency",
    "helper_is_in_view",
    "helper_distance",
    "moves_furniture",
    "is_rider",
    "lowest_pick",
    "highest_pick",
    "strength",
    "speed",
    "n_hands",
    "n_last_failed",
    "is_reconsidering",
];
/// Features of a plan, after a one-hot of its kind.
pub const PARTNER_PLAN_FEATURES: [&str; 20] = [
    "is_current",
    "is_last_subject",
    "is_nearest_of_kind",
    "is_nearest_wanted",
    "is_farthest_wanted",
    "wanted_rank",
    "is_wanted",
    "n_missing_of_class",
    "path_length",
    "object_to_goal_distance",
    "slack_time",
    "height",
    "is_in_reach",
    "mass",
    "is_too_heavy",
    "is_fragile",
    "helper_distance",
    "helper_is_nearer",
    "n_failures",
    "age",
];
/// Number of state features.
pub const N_PARTNER_STATE_FEATURES: usize = PARTNER_STATE_FEATURES.len() + N_KINDS;
/// Number of plan features.
pub const N_PARTNER_PLAN_FEATURES: usize = N_KINDS + PARTNER_PLAN_FEATURES.len();

/// Returns the index of the nearest wanted target among the candidates, if there is one.
pub fn nearest_wanted(observation: &CandidateSet) -> Option<usize> {
    let feature = PARTNER_PLAN_FEATURES.iter().position(|name| *name == "is_nearest_wanted")?;
    let rows = observation.candidates.chunks_exact(N_PARTNER_PLAN_FEATURES);
    rows.map(|row| row[N_KINDS + feature]).position(|flag| flag > 0.0)
}

/// Scale of the speed, meters per frame: twice that of an adult.
const SPEED_SCALE: f32 = 0.1;
/// Scale of heights, meters.
const HEIGHT_SCALE_M: f32 = 2.0;

/// Encoder of a partner's choices. It also keeps the history, which the partner's memory does not
/// contain.
#[derive(Clone, Debug, Default)]
pub struct PartnerEncoder {
    /// Last chosen plan that was not continued.
    last: Option<Plan>,
    /// Frame of the last choice.
    last_frame: Frame,
    /// Current plan that is being reconsidered.
    reconsidered: Option<Plan>,
}

impl PartnerEncoder {
    /// Returns the unfinished plan that the next choice reconsiders, if any.
    pub fn reconsidered(&self) -> Option<Plan> {
        self.reconsidered
    }

    /// Sets the unfinished plan that the next choice reconsiders.
    pub fn set_reconsidered(&mut self, current: Option<Plan>) {
        self.reconsidered = current;
    }

    /// Frame of the last choice.
    pub fn last_frame(&self) -> Frame {
        self.last_frame
    }

    /// Records a choice at a frame.
    pub fn record(&mut self, plan: Plan, frame: Frame) {
        self.reconsidered = None;
        self.last = Some(plan);
        self.last_frame = frame;
    }

    /// Returns the candidates among the valid plans, without those to follow people; never empty. While a
    /// plan is reconsidered, they are that plan and those that supersede it.
    pub fn candidates(&self, valid: &[Plan]) -> Vec<Plan> {
        let follows = |plan: &Plan| matches!(plan, Plan::FollowPartner | Plan::FollowChild);
        let own = valid.iter().copied().filter(|plan| !follows(plan));
        let Some(current) = self.reconsidered else { return own.collect() };
        let others = own.filter(|plan| *plan != current && plan.supersedes(&current));
        std::iter::once(current).chain(others).collect()
    }

    /// Encodes a choice among these candidates.
    pub fn encode(&self, context: &Context<'_>, candidates: &[Plan]) -> CandidateSet {
        let choice = ChoiceContext::new(context, self);
        let wanted: Vec<&Plan> = candidates.iter().filter(|plan| choice.is_wanted(plan)).collect();
        let mut has_kind = [false; N_KINDS];
        let mut features = Vec::with_capacity(candidates.len() * N_PARTNER_PLAN_FEATURES);
        for plan in candidates {
            let is_first = !std::mem::replace(&mut has_kind[plan.kind()], true);
            let rank = wanted.iter().position(|other| *other == plan);
            let rank = rank.map(|rank| (rank, wanted.len()));
            choice.push_plan(plan, flag(is_first), rank, &mut features);
        }
        let n_wanted = wanted.len();
        CandidateSet {
            state: choice.state(n_wanted),
            candidates: features,
            n_candidates: candidates.len(),
            memory: Vec::new(),
        }
    }
}

/// Data that all plans of a choice share.
struct ChoiceContext<'a> {
    context: &'a Context<'a>,
    encoder: &'a PartnerEncoder,
    hands: HandState,
    /// Class of each delivered or carried object; a class may occur several times.
    done: Vec<ClassId>,
    goal_place: Option<(Vec3, f32)>,
    helper: Option<Vec3>,
}

impl<'a> ChoiceContext<'a> {
    fn new(context: &'a Context<'a>, encoder: &'a PartnerEncoder) -> ChoiceContext<'a> {
        let Context { briefing, memory, .. } = context;
        let hands = HandState::new(&memory.hands, briefing);
        let mut done: Vec<ClassId> =
            memory.delivered.iter().filter_map(|track| memory.class_of(*track)).collect();
        done.extend(hands.targets.iter().map(|(_, class)| *class));
        let places = memory.goal_places();
        let goal_place = places.first().map(|(place, m)| (place.position_in_world, *m));
        let helper = memory.companion(briefing, CompanionRole::Partner);
        let helper = helper.map(|person| person.position_in_world);
        ChoiceContext { context, encoder, hands, done, goal_place, helper }
    }

    fn n_missing(&self, class: ClassId) -> u32 {
        let wanted = self.context.briefing.goal.as_ref().map_or(0, |goal| goal.count(class));
        let done = self.done.iter().filter(|c| **c == class).count();
        wanted.saturating_sub(done as u32)
    }

    fn is_wanted(&self, plan: &Plan) -> bool {
        matches!(plan, Plan::PickUp(subject) if self.n_missing(subject.class) > 0)
    }

    fn state(&self, n_wanted_known: usize) -> Vec<f32> {
        let Context { briefing, memory, is_explored, .. } = *self.context;
        let (hands, body) = (&self.hands, &briefing.capability);
        let goal = briefing.goal.as_ref();
        let n_missing: u32 = goal
            .map_or(0, |goal| goal.targets.iter().map(|(class, _)| self.n_missing(*class)).sum());
        let now = memory.frame;
        let available = memory.objects.iter().filter(|object| object.is_available(now));
        let n_containers = available.filter(|o| briefing.containers.contains(&o.class)).count();
        let helper = memory.companion(briefing, CompanionRole::Partner);
        let position = memory.pose.position;
        let interactions = memory.history.iter().rev();
        // Policies were trained without put-ins in the history.
        let interactions = interactions.filter(|r| !matches!(r.action, Action::PutIn));
        let failures = interactions.take_while(|r| !r.outcome.is_success());
        let is_furniture = |class: &ClassId| class.info().role == Role::HeavyTarget;
        let is_street = scene_of(&briefing.possible_targets) == Some(SceneKind::Street);
        let [low_m, high_m] = body.pick_range_m;
        let features: [f32; PARTNER_STATE_FEATURES.len()] = [
            flag(self.encoder.last.is_none()),
            briefing.horizon.saturating_sub(now) as f32 / briefing.horizon.max(1) as f32,
            briefing.horizon as f32 / TIME_SCALE_FRAMES,
            memory.hands.hands.iter().filter(|hand| hand.is_none()).count() as f32 / 2.0,
            flag(hands.has_container),
            normalize_clamped(hands.targets.len() as f32, 4.0),
            flag(hands.can_take_target),
            flag(hands.can_take_container),
            flag(hands.can_put_in),
            flag(hands.to_deliver.is_some()),
            flag(self.goal_place.is_some()),
            self.goal_place.map_or(1.0, |(_, m)| normalize_clamped(m, DISTANCE_SCALE_M)),
            normalize_clamped(n_missing as f32, 10.0),
            normalize_clamped(n_wanted_known as f32, 10.0),
            normalize_clamped(n_containers as f32, 3.0),
            flag(is_explored),
            normalize_clamped(memory.delivered.len() as f32, 10.0),
            helper.map_or(0.0, |p| recency(now - p.frame)),
            flag(helper.is_some_and(|p| p.is_in_view)),
            self.helper.map_or(1.0, |at| {
                normalize_clamped(horizontal_distance(position, at), DISTANCE_SCALE_M)
            }),
            flag(briefing.possible_targets.iter().any(is_furniture)),
            flag(is_street),
            normalize_clamped(low_m, HEIGHT_SCALE_M),
            normalize_clamped(high_m, HEIGHT_SCALE_M),
            log_mass(body.strength_kg),
            normalize_clamped(body.speed_m_per_frame, SPEED_SCALE),
            body.hands.all().len() as f32 / 2.0,
            normalize_clamped(failures.count() as f32, 4.0),
            flag(self.encoder.reconsidered.is_some()),
        ];
        let last = self.encoder.last.map(|plan| plan.kind());
        features.into_iter().chain((0..N_KINDS).map(|kind| flag(Some(kind) == last))).collect()
    }

    /// Appends the features of a plan. `rank` is its index among the wanted pick-ups, nearest first, and
    /// their number.
    fn push_plan(
        &self,
        plan: &Plan,
        is_first_of_kind: f32,
        rank: Option<(usize, usize)>,
        to: &mut Vec<f32>,
    ) {
        let Context { briefing, memory, .. } = *self.context;
        let (now, position) = (memory.frame, memory.pose.position);
        let subject = plan.subject();
        let object = subject.and_then(|subject| memory.objects.get(subject.track));
        let info = subject.map(|subject| subject.class.info());
        let path_m = match (plan, object) {
            (Plan::Deliver, _) => self.goal_place.map(|(_, path_m)| path_m),
            (_, object) => object.and_then(|object| memory.path_length_to(object)),
        };
        let onward_m = object
            .zip(self.goal_place)
            .map(|(object, (place, _))| horizontal_distance(object.position_in_world, place));
        let total_m = path_m.unwrap_or(0.0) + onward_m.unwrap_or(0.0);
        let body = &briefing.capability;
        let walk_frames = total_m / body.speed_m_per_frame.max(1e-3);
        let slack_frames = briefing.horizon.saturating_sub(now) as f32 - walk_frames;
        let helper_m = object.and_then(|o| self.helper.map(|at| o.distance_from(to_xz(at))));
        let is_near = helper_m.is_some_and(|m| {
            object.is_some_and(|object| m < object.distance_from(to_xz(position)))
        });
        let [low_m, high_m] = body.pick_range_m;
        let last_subject = self.encoder.last.and_then(|last| last.subject());
        let distance = |m: Option<f32>| m.map_or(0.0, |m| normalize_clamped(m, DISTANCE_SCALE_M));
        to.extend((0..N_KINDS).map(|kind| flag(kind == plan.kind())));
        let features: [f32; PARTNER_PLAN_FEATURES.len()] = [
            flag(self.encoder.reconsidered == Some(*plan)),
            flag(subject.is_some() && subject == last_subject),
            is_first_of_kind,
            flag(rank.is_some_and(|(rank, _)| rank == 0)),
            flag(rank.is_some_and(|(rank, n)| rank + 1 == n)),
            rank.map_or(0.0, |(rank, n)| rank as f32 / n.max(1) as f32),
            flag(self.is_wanted(plan)),
            subject.map_or(0.0, |s| normalize_clamped(self.n_missing(s.class) as f32, 5.0)),
            distance(path_m),
            distance(onward_m),
            (slack_frames / TIME_SCALE_FRAMES).clamp(-1.0, 1.0),
            object.map_or(0.0, |o| normalize_clamped(o.top_m, HEIGHT_SCALE_M)),
            flag(object.is_some_and(|o| (low_m..=high_m).contains(&o.top_m))),
            info.map_or(0.0, |info| log_mass(info.mass_kg)),
            flag(info.is_some_and(|info| info.mass_kg > body.strength_kg)),
            flag(info.is_some_and(|info| info.role == Role::Fragile)),
            distance(helper_m),
            flag(is_near),
            object.map_or(0.0, |o| normalize_clamped(o.failures as f32, 3.0)),
            object.map_or(0.0, |o| normalize_clamped((now - o.last_seen) as f32, 1000.0)),
        ];
        to.extend(features);
    }
}
