//! What a choice between plans is seen as: numbers of the state, and of each plan. All of it follows from what the
//! helper's own mind remembers and was told; distances are scaled so that most numbers lie between 0 and 1.

use std::sync::Arc;

use chaic_agents::decision::{Context, HandState, Plan};
use chaic_agents::mapping::Thing;
use chaic_agents::memory::Memory;
use chaic_agents::track::TrackId;
use chaic_core::briefing::Relation;
use chaic_core::geom::{horizontal_distance, xz};
use chaic_core::{Briefing, ClassId, Frame, Role, Vec3};
use chaic_nn::Pass;

use crate::choice_network::Decision;
use crate::opponent::network::{N_GOALS, Opinion, OpponentModel};
use crate::opponent::window::Window;
use crate::opponent::{Goal, N_LIMITS};
use crate::scales::{SETS, flag, fresh, share};

/// Numbers of the state, before two for each set: what of it the partner is believed to have taken, and what can be
/// taken.
pub const STATE: [&str; 30] = [
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
    "goal_way",
    "known_targets",
    "known_containers",
    "known_obstacles",
    "is_explored",
    "unexplored",
    "size_of_place",
    "partner_was_seen",
    "partner_is_fresh",
    "partner_is_in_view",
    "partner_distance",
    "partner_holds",
    "partner_took",
    "partner_failed",
    "partner_failed_height",
    "has_child",
    "child_is_fresh",
    "child_is_away",
    "delivered",
    "moves_furniture",
];

/// Numbers of a plan, after one for each of [`Plan::KINDS`] and before one for each set: whether the thing that it
/// is about belongs to it.
pub const PLAN: [&str; 22] = [
    "is_as_before",
    "is_nearest_of_kind",
    "way",
    "way_on_to_goal",
    "time_to_spare",
    "height",
    "mass",
    "is_too_heavy",
    "is_fragile",
    "is_container",
    "partner_distance",
    "partner_is_nearer",
    "partner_way_to_goal",
    "alike_known",
    "partner_took_class",
    "partner_took_set",
    "partner_took_other_set",
    "partner_failed",
    "partner_failed_class",
    "failures",
    "age",
    "decisions_of_kind",
];

/// How many numbers a state has.
pub const N_STATE: usize = STATE.len() + 2 * SETS.len();
/// How many numbers a plan has.
pub const N_PLAN: usize = N_KINDS + PLAN.len() + SETS.len();
/// How many more numbers a state has where an opponent model tells of the partner: its goal and its limits.
pub const N_STATE_OF_OPPONENT: usize = N_GOALS + N_LIMITS;
/// How many more numbers a plan has then: how likely its class is what the partner is after, by itself and times how
/// likely it is about to take something.
pub const N_PLAN_OF_OPPONENT: usize = 2;
/// How many kinds of plans there are.
const N_KINDS: usize = Plan::KINDS.len();

/// What one divides by, metres, frames and kilograms.
const FAR_M: f32 = 20.0;
const LONG_FRAMES: f32 = 3000.0;
const HEAVY_KG: f32 = 20.0;
/// How far a body gets in a frame, roughly, metres: a measure for the time to spare, no more.
const M_PER_FRAME: f32 = 0.04;

/// A plan under way is thought over after so many frames, if nothing came up before.
const RECONSIDER_FRAMES: Frame = 150;

/// What a policy remembers of its own choices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choices {
    /// The latest.
    pub last: Option<Plan>,
    /// When that was.
    pub last_frame: Frame,
    /// How often each kind was chosen.
    pub n_of_kind: [u32; N_KINDS],
    /// The plan under way that is being thought over.
    under_way: Option<Plan>,
}

impl Choices {
    /// Notes a choice that is made at this frame.
    pub fn note(&mut self, plan: Plan, frame: Frame) {
        if self.under_way.take() != Some(plan) {
            self.n_of_kind[plan.kind()] += 1;
        }
        self.last = Some(plan);
        self.last_frame = frame;
    }

    /// Whether another one is due at this frame although `current` is not finished.
    pub fn is_due(&mut self, frame: Frame, current: &Plan, is_news: bool) -> bool {
        let is_bound = matches!(current, Plan::Deliver | Plan::PutIn | Plan::LiftWith(_));
        let is_due = !is_bound && (is_news || frame >= self.last_frame + RECONSIDER_FRAMES);
        self.under_way = is_due.then_some(*current);
        is_due
    }

    /// Whether the next choice is about a plan that is under way.
    pub fn is_under_way(&self) -> bool {
        self.under_way.is_some()
    }

    /// What there is to choose from, of the plans that are valid: where a plan is under way, to go on with it or one that
    /// [supersedes](Plan::supersedes) it. Never empty.
    pub fn offered(&self, valid: &[Plan]) -> Vec<Plan> {
        let Some(current) = self.under_way else { return valid.to_vec() };
        let others = valid.iter().filter(|plan| plan.supersedes(&current));
        std::iter::once(&current).chain(others).copied().collect()
    }
}

/// What is believed to have been taken by the partner: what it was seen to take or hold, and what isn't where it
/// was and was not taken by oneself.
fn taken_by_partner(context: &Context<'_>) -> Vec<ClassId> {
    let Context { memory, behavior, .. } = context;
    let mut tracks: Vec<_> = behavior.partner_took.clone();
    let own = |t: &Thing| {
        memory.history.iter().any(|done| done.action.subject() == Some(t.track))
            || memory.hands.all().any(|(track, _)| track == t.track)
    };
    let targets = memory.things.iter().filter(|t| {
        context.briefing.possible_targets.contains(&t.class)
            && (!t.is_present || t.held_until > memory.frame)
            && !own(t)
    });
    tracks.extend(targets.map(|t| (t.track, t.class)));
    tracks.sort_unstable();
    tracks.dedup_by_key(|(track, _)| *track);
    tracks.into_iter().map(|(_, class)| class).collect()
}

/// What the partner was noticed to take in vain, with its class if that is known.
fn failed_by_partner(context: &Context<'_>) -> Vec<(TrackId, Option<ClassId>)> {
    let Context { briefing, memory, behavior, .. } = context;
    let partner = briefing.companion(Relation::Partner);
    let failed = behavior.actions.iter().filter(|seen| {
        Some(seen.agent) == partner && seen.outcome.is_some_and(|o| !o.is_success())
    });
    let class = |track| memory.things.get(track).map(|t| t.class);
    failed.filter_map(|seen| seen.action.subject()).map(|track| (track, class(track))).collect()
}

/// Share of the place that is still to be explored.
fn unexplored(memory: &Memory) -> f32 {
    let n = memory.map.grid().n_cells();
    (0..n).filter(|cell| memory.map.is_unexplored(*cell)).count() as f32 / n.max(1) as f32
}

/// What a policy reads, besides what its mind remembers.
#[derive(Clone)]
pub struct Features {
    /// What it chose so far.
    pub choices: Choices,
    opponent: Option<Watch>,
}

/// An opponent model that looks on.
#[derive(Clone)]
struct Watch {
    model: Arc<OpponentModel>,
    pass: Pass,
    window: Window,
    briefing: Option<Briefing>,
}

impl Features {
    /// With what this opponent model tells, if there is one.
    pub fn new(opponent: Option<Arc<OpponentModel>>) -> Features {
        let watch = |model: Arc<OpponentModel>| Watch {
            pass: model.pass(),
            model,
            window: Window::default(),
            briefing: None,
        };
        Features { choices: Choices::default(), opponent: opponent.map(watch) }
    }

    /// Begins an episode.
    pub fn reset(&mut self, briefing: &Briefing) {
        self.choices = Choices::default();
        if let Some(watch) = &mut self.opponent {
            watch.window.reset(briefing);
            watch.briefing = Some(briefing.clone());
        }
    }

    /// Takes in an observation, after the memory has.
    pub fn look(&mut self, memory: &Memory) {
        if let Some(Watch { window, briefing: Some(briefing), .. }) = &mut self.opponent {
            window.look(memory, briefing);
        }
    }

    /// What is known when one of these plans is to be chosen.
    pub fn decision(&mut self, context: &Context<'_>, offered: &[Plan]) -> Decision {
        let mut seen = decision(context, offered, &self.choices);
        let Some(Watch { model, pass, window, .. }) = &mut self.opponent else { return seen };
        let read = window.decision(context.memory, context.briefing, context.behavior);
        let Opinion { goals, targets, limits } = model.opinion(&read, pass);
        seen.state.extend(goals);
        seen.state.extend(limits);
        let rows = seen.choices.chunks_exact(N_PLAN).zip(offered);
        let likely = |plan: &Plan| {
            let class = plan.subject()?.class;
            window.classes().iter().position(|c| *c == class).map(|k| targets[k])
        };
        seen.choices = rows
            .flat_map(|(row, plan)| {
                let p = likely(plan).unwrap_or(0.0);
                row.iter().copied().chain([p, p * goals[Goal::Pick.index()]])
            })
            .collect();
        seen
    }
}

/// What all plans of a decision are seen by.
struct Scene<'a> {
    memory: &'a Memory,
    choices: &'a Choices,
    time_left_frames: f32,
    strength_kg: f32,
    partner: Option<Vec3>,
    goal: Option<(Vec3, f32)>,
    taken: Vec<ClassId>,
    failed: Vec<(TrackId, Option<ClassId>)>,
    available: Vec<ClassId>,
}

/// What is known when one of these plans is to be chosen, of the partner's mind apart.
fn decision(context: &Context<'_>, valid: &[Plan], choices: &Choices) -> Decision {
    let Context { briefing, memory, behavior, is_explored } = *context;
    let hands = HandState::of(&memory.hands, briefing);
    let taken = taken_by_partner(context);
    let failed = failed_by_partner(context);
    let failed_at = failed.iter().filter_map(|(track, _)| memory.things.get(*track));
    let failed_height = failed_at.last().map_or(0.0, |t| share(t.position_in_world.y, 2.0));
    let available: Vec<ClassId> =
        memory.things.iter().filter(|t| t.is_available(memory.frame)).map(|t| t.class).collect();
    let known = |of: &[ClassId]| available.iter().filter(|c| of.contains(c)).count() as f32;
    let goal = memory.goal_places().first().map(|(place, way)| (place.position_in_world, *way));
    let partner = memory.companion(briefing, Relation::Partner);
    let child = memory.companion(briefing, Relation::Child);
    let here = memory.pose.position;
    let time_left_frames = briefing.horizon.saturating_sub(memory.frame) as f32;
    let n_free = memory.hands.hands.iter().filter(|h| h.is_none()).count();
    let size = briefing.bounds.size();
    let moves = briefing.possible_targets.iter().any(|c| c.info().role == Role::HeavyTarget);
    let numbers: [f32; STATE.len()] = [
        time_left_frames / briefing.horizon.max(1) as f32,
        briefing.horizon as f32 / LONG_FRAMES,
        n_free as f32 / 2.0,
        flag(hands.has_container),
        share(hands.targets.len() as f32, 4.0),
        flag(hands.can_take_target),
        flag(hands.can_take_container),
        flag(hands.can_put_in),
        flag(hands.to_deliver.is_some()),
        flag(goal.is_some()),
        goal.map_or(1.0, |(_, way)| share(way, FAR_M)),
        share(known(&briefing.possible_targets), 10.0),
        share(known(&briefing.containers), 3.0),
        share(known(&briefing.obstacles), 4.0),
        flag(is_explored),
        unexplored(memory),
        share((size.x * size.y).max(0.0).sqrt(), 40.0),
        flag(partner.is_some()),
        partner.map_or(0.0, |p| fresh(memory.frame - p.frame)),
        flag(partner.is_some_and(|p| p.is_in_view)),
        partner.map_or(1.0, |p| share(horizontal_distance(here, p.position_in_world), FAR_M)),
        share(behavior.partner_holds.len() as f32, 3.0),
        share(taken.len() as f32, 6.0),
        share(failed.len() as f32, 4.0),
        failed_height,
        flag(briefing.companion(Relation::Child).is_some()),
        child.map_or(0.0, |c| fresh(memory.frame - c.frame)),
        flag(memory.child_is_away(briefing)),
        share(memory.delivered.len() as f32, 10.0),
        flag(moves),
    ];
    let mut state = numbers.to_vec();
    for (classes, most) in [(&taken, 3.0), (&available, 5.0)] {
        let of = |set| classes.iter().filter(|c| c.info().sets.contains(set)).count();
        state.extend(SETS.iter().map(|set| share(of(set) as f32, most)));
    }
    let scene = Scene {
        memory,
        choices,
        time_left_frames,
        strength_kg: briefing.capability.strength_kg,
        partner: partner.map(|p| p.position_in_world),
        goal,
        taken,
        failed,
        available,
    };
    let mut seen = [false; N_KINDS];
    let mut numbers = Vec::with_capacity(valid.len() * N_PLAN);
    for plan in valid {
        let is_first = !std::mem::replace(&mut seen[plan.kind()], true);
        scene.push_plan(plan, is_first, &mut numbers);
    }
    Decision { state, choices: numbers, n_choices: valid.len() }
}

impl Scene<'_> {
    fn push_plan(&self, plan: &Plan, is_first_of_kind: bool, to: &mut Vec<f32>) {
        let (kind, subject) = (plan.kind(), plan.subject());
        let begin = to.len();
        to.extend((0..N_KINDS).map(|k| flag(k == kind)));
        to.push(flag(self.choices.last == Some(*plan)));
        to.push(flag(is_first_of_kind));
        let thing = subject.and_then(|it| self.memory.things.get(it.track));
        let at = match plan {
            Plan::Deliver => self.goal.map(|(at, _)| at),
            Plan::FollowPartner => self.partner,
            _ => thing.map(|t| t.position_in_world),
        };
        let here = self.memory.pose.position;
        let way_m = match (plan, thing) {
            (Plan::Deliver, _) => self.goal.map(|(_, way)| way),
            (_, Some(thing)) => self.memory.way_to(thing),
            _ => at.map(|at| horizontal_distance(here, at)),
        };
        let between =
            |a: Option<Vec3>, b: Option<Vec3>| a.zip(b).map(|(a, b)| horizontal_distance(a, b));
        let goal = self.goal.map(|(at, _)| at);
        let on_m = if thing.is_some() { between(at, goal) } else { None };
        let in_all_m = way_m.unwrap_or(0.0) + on_m.unwrap_or(0.0);
        to.push(way_m.map_or(0.0, |m| share(m, FAR_M)));
        to.push(on_m.map_or(0.0, |m| share(m, FAR_M)));
        let to_spare = self.time_left_frames - in_all_m / M_PER_FRAME;
        to.push((to_spare / LONG_FRAMES).clamp(-1.0, 1.0));
        let info = subject.map(|it| it.class.info());
        to.push(thing.map_or(0.0, |t| share(t.position_in_world.y, 2.0)));
        to.push(info.map_or(0.0, |i| share(i.mass_kg, HEAVY_KG)));
        to.push(flag(info.is_some_and(|i| i.mass_kg > self.strength_kg)));
        to.push(flag(info.is_some_and(|i| i.role == Role::Fragile)));
        to.push(flag(info.is_some_and(|i| i.role == Role::Container)));
        let partner_m = thing.and_then(|t| self.partner.map(|p| t.distance_from(xz(p))));
        to.push(partner_m.map_or(0.0, |m| share(m, FAR_M)));
        to.push(flag(partner_m.zip(way_m).is_some_and(|(of_partner, own)| of_partner < own)));
        to.push(between(self.partner, goal).map_or(0.0, |m| share(m, FAR_M)));
        let class = subject.map(|it| it.class);
        let alike = self.available.iter().filter(|c| Some(**c) == class).count();
        to.push(share(alike as f32, 4.0));
        let is_alike = |other: &&ClassId| {
            info.is_some_and(|i| i.sets.iter().any(|set| other.info().sets.contains(set)))
        };
        let of_set = self.taken.iter().filter(is_alike).count();
        to.push(share(self.taken.iter().filter(|c| Some(**c) == class).count() as f32, 3.0));
        to.push(share(of_set as f32, 3.0));
        let of_others = if info.is_some() { self.taken.len() - of_set } else { 0 };
        to.push(share(of_others as f32, 3.0));
        let track = subject.map(|it| it.track);
        let n_it = self.failed.iter().filter(|(failed, _)| Some(*failed) == track).count();
        let is_class = |of: Option<ClassId>| of.is_some() && of == class;
        let n_class = self.failed.iter().filter(|(_, of)| is_class(*of)).count();
        to.push(share(n_it as f32, 3.0));
        to.push(share(n_class as f32, 3.0));
        to.push(thing.map_or(0.0, |t| share(t.failures as f32, 3.0)));
        to.push(thing.map_or(0.0, |t| share((self.memory.frame - t.last_seen) as f32, 1000.0)));
        to.push(share(self.choices.n_of_kind[kind] as f32, 20.0));
        to.extend(SETS.iter().map(|set| flag(info.is_some_and(|i| i.sets.contains(set)))));
        debug_assert_eq!(to.len() - begin, N_PLAN);
    }
}
