//! What the opponent model reads: five observations of a helper in a row, as numbers of what it saw of its partner and
//! of each class of things that the partner may be after.

use std::collections::{BTreeMap, VecDeque};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::mapping::Thing;
use chaic_agents::memory::Memory;
use chaic_agents::track::{Intent, TrackId};
use chaic_core::briefing::Relation;
use chaic_core::geom::{horizontal_distance, xz};
use chaic_core::{Action, AgentId, Briefing, ClassId, Frame, Role, Vec3};

use super::is_pickable;
use crate::choice_network::Decision;
use crate::scales::{SETS, flag, fresh, share};

/// Observations of a window (paper, appendix on learning).
pub const LENGTH: usize = 5;

/// Numbers of the state.
pub const STATE: [&str; 44] = [
    "seen",
    "is_in_view",
    "distance",
    "height",
    "pace",
    "pace_now",
    "goal_is_known",
    "goal_distance",
    "goal_approach",
    "goal_heading",
    "nearest_distance",
    "nearest_approach",
    "nearest_heading",
    "holds",
    "holds_target",
    "holds_container",
    "holds_vehicle",
    "holds_heavy",
    "holds_is_fresh",
    "bicycle_is_near",
    "last_was_pick",
    "last_was_put_in",
    "last_was_put_on",
    "last_was_other",
    "last_is_under_way",
    "last_failed",
    "last_is_fresh",
    "took",
    "failed",
    "failed_lowest",
    "failed_highest",
    "failed_heaviest",
    "took_lowest",
    "took_highest",
    "took_heaviest",
    "took_obstacle",
    "frame",
    "horizon",
    "child",
    "moves_furniture",
    "fills_basket",
    "n_known",
    "container_is_in_question",
    "obstacle_is_known",
];

/// Numbers of a class, before one for each set that it may belong to.
pub const CLASS: [&str; 23] = [
    "known",
    "distance",
    "approach",
    "heading",
    "is_nearest",
    "is_second",
    "least_distance_seen",
    "height",
    "lowest",
    "mass",
    "is_target",
    "is_container",
    "is_fragile",
    "is_obstacle",
    "is_furniture",
    "in_view",
    "partner_holds",
    "partner_took",
    "partner_failed",
    "last_was_about_it",
    "last_failed",
    "own",
    "took_of_its_sets",
];

/// How many numbers a state has.
pub const N_STATE: usize = STATE.len();
/// How many numbers a class has.
pub const N_CLASS: usize = CLASS.len() + SETS.len();

const FAR_M: f32 = 10.0;
const HIGH_M: f32 = 2.0;
const HEAVY_KG: f32 = 20.0;
const VERY_HEAVY_KG: f32 = 300.0;
/// A change of distance within a window that counts as much as any, metres.
const APPROACH_M: f32 = 1.0;
/// A pace in a frame that counts as much as any, metres.
const PACE_M: f32 = 0.05;
/// A bicycle this near to somebody is that person's, metres.
const BESIDE_M: f32 = 1.5;

/// One observation.
#[derive(Clone, Debug)]
struct Glimpse {
    frame: Frame,
    /// Where the partner was, if it was in view.
    partner: Option<Vec3>,
    /// How far the partner was from the nearest thing of each class, metres.
    distances_m: Vec<f32>,
    /// And from the goal place.
    goal_m: f32,
}

/// The last observations of an episode, and what is known of heights of things that lay somewhere.
#[derive(Clone, Debug, Default)]
pub struct Window {
    classes: Vec<ClassId>,
    glimpses: VecDeque<Glimpse>,
    /// Top of things when they were seen lying last, metres.
    tops_m: BTreeMap<TrackId, f32>,
}

impl Window {
    /// Begins an episode.
    pub fn reset(&mut self, briefing: &Briefing) {
        let Briefing { possible_targets, containers, obstacles, .. } = briefing;
        let all = possible_targets.iter().chain(containers).chain(obstacles);
        let mut classes: Vec<ClassId> = all.copied().filter(|class| is_pickable(*class)).collect();
        classes.sort_unstable();
        classes.dedup();
        *self = Window { classes, ..Window::default() };
    }

    /// The classes that the partner may be after, in the order of a decision's choices.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// Whether the partner was in view in any of the last observations.
    pub fn has_partner(&self) -> bool {
        self.glimpses.iter().any(|g| g.partner.is_some())
    }

    /// Takes in an observation, after the memory has.
    pub fn look(&mut self, memory: &Memory, briefing: &Briefing) {
        for thing in lying(memory) {
            self.tops_m.insert(thing.track, thing.top_m);
        }
        let partner = memory.companion(briefing, Relation::Partner).filter(|p| p.is_in_view);
        let partner = partner.map(|p| p.position_in_world);
        let distances_m = self.classes.iter().map(|class| {
            let things = lying(memory).filter(|t| t.class == *class);
            nearest(things, partner).map_or(f32::INFINITY, |(m, _)| m)
        });
        let glimpse = Glimpse {
            frame: memory.frame,
            partner,
            distances_m: distances_m.collect(),
            goal_m: nearest(goals(memory, briefing), partner).map_or(f32::INFINITY, |(m, _)| m),
        };
        if self.glimpses.len() == LENGTH {
            self.glimpses.pop_front();
        }
        self.glimpses.push_back(glimpse);
    }

    /// The window as numbers; the choices are [`Window::classes`].
    pub fn decision(
        &self,
        memory: &Memory,
        briefing: &Briefing,
        behavior: &BehaviorLog,
    ) -> Decision {
        let seen: Vec<(&Glimpse, Vec3)> =
            self.glimpses.iter().filter_map(|g| Some((g, g.partner?))).collect();
        let path = Path {
            first: seen.first().copied(),
            last: seen.last().copied(),
            before_last: seen.len().checked_sub(2).map(|k| seen[k]),
        };
        let deeds = Deeds::of(behavior, memory, &self.tops_m);
        let nearest_class = path.nearest_class();
        let state = self.state(&path, &deeds, nearest_class, (memory, briefing, behavior));
        let mut choices = Vec::with_capacity(self.classes.len() * N_CLASS);
        for k in 0..self.classes.len() {
            self.push_class(k, &path, &deeds, nearest_class, (memory, behavior), &mut choices);
        }
        Decision { state, choices, n_choices: self.classes.len() }
    }

    fn state(
        &self,
        path: &Path<'_>,
        deeds: &Deeds,
        nearest_class: [Option<usize>; 2],
        (memory, briefing, behavior): (&Memory, &Briefing, &BehaviorLog),
    ) -> Vec<f32> {
        let partner = path.last.map(|(_, at)| at);
        let n_seen = self.glimpses.iter().filter(|g| g.partner.is_some()).count();
        let goal_m = |g: &Glimpse| g.goal_m;
        let goal = nearest(goals(memory, briefing), partner).map(|(_, t)| t.position_in_world);
        let nearest_at = nearest_class[0].and_then(|k| {
            nearest(lying(memory).filter(|t| t.class == self.classes[k]), partner)
                .map(|(_, t)| t.position_in_world)
        });
        let nearest_m = |g: &Glimpse| nearest_class[0].map_or(f32::INFINITY, |k| g.distances_m[k]);
        let holds = |is_it: &dyn Fn(ClassId) -> bool| {
            flag(behavior.partner_holds.iter().any(|(_, class)| is_it(*class)))
        };
        let role = |role: Role| move |class: ClassId| class.info().role == role;
        let bicycle = memory.things.iter().filter(|t| t.class.info().role == Role::Vehicle);
        let last = deeds.last;
        let is_last = |kind: usize| flag(last.is_some_and(|d| d.kind == kind));
        let known = lying(memory).filter(|t| self.classes.contains(&t.class));
        let furniture = briefing.possible_targets.iter().any(|c| role(Role::HeavyTarget)(*c));
        let heaviest = |kg: f32| share(kg, if furniture { VERY_HEAVY_KG } else { HEAVY_KG });
        let child = briefing.companion(Relation::Child).is_some();
        let state: [f32; N_STATE] = [
            n_seen as f32 / LENGTH as f32,
            flag(self.glimpses.back().is_some_and(|g| g.partner.is_some())),
            partner.map_or(1.0, |at| share(horizontal_distance(memory.pose.position, at), FAR_M)),
            partner.map_or(0.0, |at| share(at.y, HIGH_M)),
            path.pace(path.first),
            path.pace(path.before_last),
            flag(goal.is_some()),
            path.last.map_or(1.0, |(g, _)| share(g.goal_m, FAR_M)),
            path.approach(goal_m),
            path.heading(goal),
            path.last.map_or(1.0, |(g, _)| share(nearest_m(g), FAR_M)),
            path.approach(nearest_m),
            path.heading(nearest_at),
            share(behavior.partner_holds.len() as f32, 3.0),
            holds(&|class| class.info().is_possible_target()),
            holds(&role(Role::Container)),
            holds(&role(Role::Vehicle)),
            holds(&role(Role::HeavyTarget)),
            behavior.partner_holds_frame.map_or(0.0, |f| fresh(memory.frame - f)),
            flag(nearest(bicycle, partner).is_some_and(|(m, _)| m < BESIDE_M)),
            is_last(0),
            is_last(1),
            is_last(2),
            is_last(3),
            flag(last.is_some_and(|d| d.is_under_way)),
            flag(last.is_some_and(|d| d.has_failed)),
            last.map_or(0.0, |d| fresh(memory.frame - d.frame)),
            share(deeds.took.len() as f32, 6.0),
            share(deeds.failed.len() as f32, 4.0),
            deeds.lowest(&deeds.failed),
            deeds.highest(&deeds.failed),
            heaviest(deeds.heaviest_kg(&deeds.failed)),
            deeds.lowest(&deeds.took),
            deeds.highest(&deeds.took),
            heaviest(deeds.heaviest_kg(&deeds.took)),
            flag(deeds.took.iter().any(|d| d.class.info().role == Role::Obstacle)),
            memory.frame as f32 / briefing.horizon.max(1) as f32,
            share(briefing.horizon as f32, 3000.0),
            flag(child),
            flag(furniture),
            flag(child && briefing.containers.is_empty()),
            share(known.count() as f32, 10.0),
            flag(!briefing.containers.is_empty()),
            flag(lying(memory).any(|t| t.class.info().role == Role::Obstacle)),
        ];
        state.to_vec()
    }

    fn push_class(
        &self,
        k: usize,
        path: &Path<'_>,
        deeds: &Deeds,
        nearest_class: [Option<usize>; 2],
        (memory, behavior): (&Memory, &BehaviorLog),
        to: &mut Vec<f32>,
    ) {
        let begin = to.len();
        let class = self.classes[k];
        let info = class.info();
        let partner = path.last.map(|(_, at)| at);
        let things = || lying(memory).filter(|t| t.class == class);
        let one = nearest(things(), partner).map(|(_, thing)| thing);
        let distance_m = |g: &Glimpse| g.distances_m[k];
        let least_m = self.glimpses.iter().map(distance_m).min_by(f32::total_cmp);
        let n = |of: &[Deed]| share(of.iter().filter(|d| d.class == class).count() as f32, 3.0);
        let last = deeds.last.filter(|d| d.class == Some(class));
        let held_here = memory.hands.all().any(|(_, c)| c == class);
        let is_alike = |d: &&Deed| d.class.info().sets.iter().any(|set| info.sets.contains(set));
        let numbers: [f32; CLASS.len()] = [
            share(things().count() as f32, 4.0),
            path.last.map_or(1.0, |(g, _)| share(g.distances_m[k], FAR_M)),
            path.approach(distance_m),
            path.heading(one.map(|t| t.position_in_world)),
            flag(nearest_class[0] == Some(k)),
            flag(nearest_class[1] == Some(k)),
            least_m.map_or(1.0, |m| share(m, FAR_M)),
            one.map_or(0.0, |t| share(t.top_m, HIGH_M)),
            one.map_or(0.0, |t| share(t.bottom_m, HIGH_M)),
            share(info.mass_kg, HEAVY_KG),
            flag(info.role == Role::Target),
            flag(info.role == Role::Container),
            flag(info.role == Role::Fragile),
            flag(info.role == Role::Obstacle),
            flag(info.role == Role::HeavyTarget),
            flag(things().any(|t| t.last_seen == memory.frame)),
            flag(behavior.partner_holds.iter().any(|(_, c)| *c == class)),
            n(&deeds.took),
            n(&deeds.failed),
            flag(last.is_some()),
            flag(last.is_some_and(|d| d.has_failed)),
            flag(held_here),
            share(deeds.took.iter().filter(is_alike).count() as f32, 3.0),
        ];
        to.extend(numbers);
        to.extend(SETS.iter().map(|set| flag(info.sets.contains(set))));
        debug_assert_eq!(to.len() - begin, N_CLASS);
    }
}

/// Things that lie where they were seen, as far as one knows.
fn lying(memory: &Memory) -> impl Iterator<Item = &Thing> {
    memory.things.iter().filter(|t| t.is_present && !t.is_gone && t.held_until <= memory.frame)
}

/// Places that things may be brought to.
fn goals<'a>(memory: &'a Memory, briefing: &'a Briefing) -> impl Iterator<Item = &'a Thing> {
    memory.things.iter().filter(|t| briefing.goal_places.contains(&t.class))
}

/// The thing nearest to somebody, and how far it is, metres in plan.
fn nearest<'a>(
    things: impl Iterator<Item = &'a Thing>,
    to: Option<Vec3>,
) -> Option<(f32, &'a Thing)> {
    let to = xz(to?);
    things.map(|t| (t.distance_from(to), t)).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// How the partner was seen to move.
struct Path<'a> {
    first: Option<(&'a Glimpse, Vec3)>,
    before_last: Option<(&'a Glimpse, Vec3)>,
    last: Option<(&'a Glimpse, Vec3)>,
}

impl Path<'_> {
    /// How fast it was since a glimpse, 0 to 1.
    fn pace(&self, since: Option<(&Glimpse, Vec3)>) -> f32 {
        let Some(((before, from), (now, to))) = since.zip(self.last) else { return 0.0 };
        let frames = now.frame.saturating_sub(before.frame).max(1);
        share(horizontal_distance(from, to) / frames as f32, PACE_M)
    }

    /// By how much a distance fell since the first glimpse, -1 to 1.
    fn approach(&self, of: impl Fn(&Glimpse) -> f32) -> f32 {
        let Some(((before, _), (now, _))) = self.first.zip(self.last) else { return 0.0 };
        let fell = of(before) - of(now);
        if fell.is_finite() { (fell / APPROACH_M).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// The cosine between its way since the first glimpse and the direction to a place.
    fn heading(&self, to: Option<Vec3>) -> f32 {
        let Some(((_, from), (_, at))) = self.first.zip(self.last) else { return 0.0 };
        let Some(to) = to else { return 0.0 };
        let (moved, ahead) = (xz(at) - xz(from), xz(to) - xz(at));
        let lengths = moved.length() * ahead.length();
        if lengths > 1e-3 { (moved.dot(ahead) / lengths).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// The classes of which a thing is nearest to it, and second.
    fn nearest_class(&self) -> [Option<usize>; 2] {
        let Some((glimpse, _)) = self.last else { return [None; 2] };
        let mut order: Vec<usize> = (0..glimpse.distances_m.len()).collect();
        order.retain(|k| glimpse.distances_m[*k].is_finite());
        order.sort_by(|a, b| glimpse.distances_m[*a].total_cmp(&glimpse.distances_m[*b]));
        [order.first().copied(), order.get(1).copied()]
    }
}

/// Something that the partner took, or failed to take.
#[derive(Clone, Copy, Debug)]
struct Deed {
    class: ClassId,
    top_m: Option<f32>,
}

/// The last that it did.
#[derive(Clone, Copy, Debug)]
struct LastDeed {
    frame: Frame,
    /// 0 picking up, 1 putting in, 2 putting on, 3 something else.
    kind: usize,
    class: Option<ClassId>,
    is_under_way: bool,
    has_failed: bool,
}

/// What is known of the partner's doings.
struct Deeds {
    took: Vec<Deed>,
    failed: Vec<Deed>,
    last: Option<LastDeed>,
}

impl Deeds {
    fn of(behavior: &BehaviorLog, memory: &Memory, tops_m: &BTreeMap<TrackId, f32>) -> Deeds {
        let deed = |track: TrackId, class: Option<ClassId>| {
            let class = class.or_else(|| memory.things.get(track).map(|t| t.class))?;
            Some(Deed { class, top_m: tops_m.get(&track).copied() })
        };
        let of_partner = || behavior.actions.iter().filter(|a| a.agent == AgentId::PARTNER);
        let failed = of_partner().filter(|a| a.outcome.is_some_and(|o| !o.is_success()));
        let kind = |action: &Intent| match action {
            Action::PickUp { .. } => 0,
            Action::PutIn => 1,
            Action::PutOn { .. } => 2,
            _ => 3,
        };
        let last = of_partner().next_back().map(|seen| LastDeed {
            frame: seen.frame,
            kind: kind(&seen.action),
            class: seen.action.subject().and_then(|t| memory.things.get(t)).map(|t| t.class),
            is_under_way: seen.outcome.is_none(),
            has_failed: seen.outcome.is_some_and(|o| !o.is_success()),
        });
        Deeds {
            took: behavior.partner_took.iter().filter_map(|(t, c)| deed(*t, Some(*c))).collect(),
            failed: failed.filter_map(|a| deed(a.action.subject()?, None)).collect(),
            last,
        }
    }

    fn tops<'a>(&self, deeds: &'a [Deed]) -> impl Iterator<Item = f32> + 'a {
        deeds.iter().filter_map(|d| d.top_m)
    }

    fn lowest(&self, deeds: &[Deed]) -> f32 {
        self.tops(deeds).min_by(f32::total_cmp).map_or(-1.0, |m| share(m, HIGH_M))
    }

    fn highest(&self, deeds: &[Deed]) -> f32 {
        self.tops(deeds).max_by(f32::total_cmp).map_or(-1.0, |m| share(m, HIGH_M))
    }

    fn heaviest_kg(&self, deeds: &[Deed]) -> f32 {
        deeds.iter().map(|d| d.class.info().mass_kg).max_by(f32::total_cmp).unwrap_or(0.0)
    }
}
