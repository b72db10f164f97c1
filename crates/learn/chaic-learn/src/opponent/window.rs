//! Input of the opponent model: five consecutive observations of a helper, encoded as features of
//! the partner and of each class that the partner may want to pick up.

use std::collections::{BTreeMap, VecDeque};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::belief::Belief;
use chaic_agents::mapping::MappedObject;
use chaic_agents::memory::Memory;
use chaic_agents::track::{Intent, TrackId};
use chaic_core::briefing::CompanionRole;
use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::{Action, AgentId, Briefing, ClassId, Frame, Role, Vec3};

use super::is_pickable;
use super::walk::{PartnerWalk, goal_places, resting_objects};
use super::walk_features::{NEAR_SCALE_M, WALK_CLASS_FEATURES, WALK_STATE_FEATURES, WalkFeatures};
use crate::candidate_scorer::CandidateSet;
use crate::scales::{TARGET_SETS, TIME_SCALE_FRAMES, flag, log_mass, normalize_clamped, recency};

/// Number of observations in a window (paper, appendix on learning).
pub const LENGTH: usize = 5;

/// Features of the state.
pub const STATE_FEATURES: [&str; 44] = [
    "visible_fraction",
    "is_in_view",
    "distance",
    "height",
    "speed",
    "last_speed",
    "goal_is_known",
    "goal_distance",
    "goal_approach",
    "goal_heading",
    "nearest_distance",
    "nearest_approach",
    "nearest_heading",
    "n_held",
    "holds_target",
    "holds_container",
    "holds_vehicle",
    "holds_furniture",
    "held_recency",
    "bicycle_is_near",
    "last_was_pick_up",
    "last_was_put_in",
    "last_was_put_on",
    "last_was_other",
    "last_is_in_progress",
    "last_has_failed",
    "last_recency",
    "n_taken",
    "n_failed",
    "failed_min_height",
    "failed_max_height",
    "failed_max_mass",
    "taken_min_height",
    "taken_max_height",
    "taken_max_mass",
    "took_obstacle",
    "time",
    "horizon",
    "has_child",
    "moves_furniture",
    "fills_basket",
    "n_known",
    "has_containers",
    "obstacle_is_known",
];

/// Features of a class, before one flag per target set.
pub const CLASS_FEATURES: [&str; 23] = [
    "n_known",
    "distance",
    "approach",
    "heading",
    "is_nearest",
    "is_second_nearest",
    "min_distance",
    "top_height",
    "bottom_height",
    "mass",
    "is_target",
    "is_container",
    "is_fragile",
    "is_obstacle",
    "is_furniture",
    "is_in_view",
    "partner_holds",
    "partner_n_taken",
    "partner_n_failed",
    "is_last_object",
    "last_has_failed",
    "is_held_by_helper",
    "partner_n_taken_same_sets",
];

/// Number of state features.
pub const N_STATE_FEATURES: usize = STATE_FEATURES.len() + WALK_STATE_FEATURES.len();
/// Number of class features.
pub const N_CLASS_FEATURES: usize =
    CLASS_FEATURES.len() + TARGET_SETS.len() + WALK_CLASS_FEATURES.len();

/// Height at which features of height saturate, meters.
const HEIGHT_SCALE_M: f32 = 2.0;
/// Change of distance within a window at which the feature saturates, meters.
const APPROACH_SCALE_M: f32 = 1.0;
/// Speed at which the feature saturates, meters per frame.
const SPEED_SCALE_M_PER_FRAME: f32 = 0.05;
/// Maximum distance between a person and a bicycle that belongs to it, meters.
const MAX_BICYCLE_DISTANCE_M: f32 = 1.5;

/// One observation.
#[derive(Clone, Debug)]
struct Snapshot {
    frame: Frame,
    /// Position of the partner, if visible.
    partner: Option<Vec3>,
    /// Distance between partner and nearest object of each class, meters.
    distances_m: Vec<f32>,
    /// Distance between partner and goal place, meters.
    goal_m: f32,
}

/// Last observations of an episode, and heights of objects at rest.
#[derive(Clone, Debug, Default)]
pub struct ObservationHistory {
    classes: Vec<ClassId>,
    snapshots: VecDeque<Snapshot>,
    walk: PartnerWalk,
    /// Belief about the partner's goal.
    belief: Option<Belief>,
    /// Height of the top of each object when it was last seen at rest, meters.
    tops_m: BTreeMap<TrackId, f32>,
}

impl ObservationHistory {
    /// Starts an episode.
    pub fn reset(&mut self, briefing: &Briefing) {
        let Briefing { possible_targets, containers, obstacles, .. } = briefing;
        let classes = possible_targets.iter().chain(containers).chain(obstacles);
        let mut classes: Vec<ClassId> =
            classes.copied().filter(|class| is_pickable(*class)).collect();
        classes.sort_unstable();
        classes.dedup();
        let belief = Some(Belief::new(briefing));
        *self = ObservationHistory { classes, belief, ..ObservationHistory::default() };
    }

    /// Returns the classes that the partner may want to pick up, in the order of the candidates.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// Returns whether the partner is visible in any observation of the window.
    pub fn has_partner(&self) -> bool {
        self.snapshots.iter().any(|s| s.partner.is_some())
    }

    /// Adds an observation, after the memory has.
    pub fn add(&mut self, memory: &Memory, briefing: &Briefing, behavior: &BehaviorLog) {
        if let Some(belief) = &mut self.belief {
            belief.observe(briefing, memory, behavior);
        }
        for object in resting_objects(memory) {
            self.tops_m.insert(object.track, object.top_m);
        }
        let partner = memory.companion(briefing, CompanionRole::Partner).filter(|p| p.is_in_view);
        let partner = partner.map(|p| p.position_in_world);
        self.walk.observe(memory, behavior, partner.map(to_xz));
        let distances_m = self.classes.iter().map(|class| {
            let objects = resting_objects(memory).filter(|t| t.class == *class);
            nearest(objects, partner).map_or(f32::INFINITY, |(m, _)| m)
        });
        let snapshot = Snapshot {
            frame: memory.frame,
            partner,
            distances_m: distances_m.collect(),
            goal_m: nearest(goal_places(memory, briefing), partner)
                .map_or(f32::INFINITY, |(m, _)| m),
        };
        if self.snapshots.len() == LENGTH {
            self.snapshots.pop_front();
        }
        self.snapshots.push_back(snapshot);
    }

    /// Encodes the window; candidates are [`ObservationHistory::classes`].
    pub fn encode(
        &mut self,
        memory: &Memory,
        briefing: &Briefing,
        behavior: &BehaviorLog,
    ) -> CandidateSet {
        let paths = if self.has_partner() {
            let is_destination = |object: &&MappedObject| {
                self.classes.contains(&object.class) || briefing.goal_places.contains(&object.class)
            };
            self.walk.paths(memory, resting_objects(memory).filter(is_destination))
        } else {
            None
        };
        let observed: Vec<(&Snapshot, Vec3)> =
            self.snapshots.iter().filter_map(|s| Some((s, s.partner?))).collect();
        let path = PartnerPath {
            first: observed.first().copied(),
            last: observed.last().copied(),
            before_last: observed.len().checked_sub(2).map(|k| observed[k]),
        };
        let actions = PartnerActions::new(behavior, memory, &self.tops_m);
        let nearest_class = path.nearest_class();
        let mut state = self.state(&path, &actions, nearest_class, memory, briefing, behavior);
        let belief = self.belief.as_ref();
        let walk = WalkFeatures::new(&self.walk, paths.as_ref(), belief, &self.classes, memory);
        state.extend(walk.state(memory, briefing, behavior));
        let mut candidates = Vec::with_capacity(self.classes.len() * N_CLASS_FEATURES);
        for k in 0..self.classes.len() {
            let features = self.class_features(k, &path, &actions, nearest_class, memory, behavior);
            candidates.extend(features);
            let sets = self.classes[k].info().sets;
            candidates.extend(TARGET_SETS.iter().map(|set| flag(sets.contains(set))));
            candidates.extend(walk.class(k));
        }
        CandidateSet { state, candidates, n_candidates: self.classes.len(), memory: Vec::new() }
    }

    fn state(
        &self,
        path: &PartnerPath<'_>,
        actions: &PartnerActions,
        nearest_class: [Option<usize>; 2],
        memory: &Memory,
        briefing: &Briefing,
        behavior: &BehaviorLog,
    ) -> Vec<f32> {
        let partner = path.last.map(|(_, at)| at);
        let n_seen = self.snapshots.iter().filter(|s| s.partner.is_some()).count();
        let goal_m = |s: &Snapshot| s.goal_m;
        let goal =
            nearest(goal_places(memory, briefing), partner).map(|(_, t)| t.position_in_world);
        let nearest_at = nearest_class[0].and_then(|k| {
            nearest(resting_objects(memory).filter(|t| t.class == self.classes[k]), partner)
                .map(|(_, t)| t.position_in_world)
        });
        let nearest_m = |s: &Snapshot| nearest_class[0].map_or(f32::INFINITY, |k| s.distances_m[k]);
        let holds = |is_match: &dyn Fn(ClassId) -> bool| {
            flag(behavior.partner_holds.iter().any(|(_, class)| is_match(*class)))
        };
        let role = |role: Role| move |class: ClassId| class.info().role == role;
        let bicycle = memory.objects.iter().filter(|t| t.class.info().role == Role::Vehicle);
        let last = actions.last;
        let is_last = |kind: usize| flag(last.is_some_and(|a| a.kind == kind));
        let known = resting_objects(memory).filter(|t| self.classes.contains(&t.class));
        let moves_furniture = briefing.possible_targets.iter().any(|c| role(Role::HeavyTarget)(*c));
        let has_child = briefing.companion(CompanionRole::Child).is_some();
        let state: [f32; STATE_FEATURES.len()] = [
            n_seen as f32 / LENGTH as f32,
            flag(self.snapshots.back().is_some_and(|s| s.partner.is_some())),
            partner.map_or(1.0, |at| {
                normalize_clamped(horizontal_distance(memory.pose.position, at), NEAR_SCALE_M)
            }),
            partner.map_or(0.0, |at| normalize_clamped(at.y, HEIGHT_SCALE_M)),
            path.speed(path.first),
            path.speed(path.before_last),
            flag(goal.is_some()),
            path.last.map_or(1.0, |(s, _)| normalize_clamped(s.goal_m, NEAR_SCALE_M)),
            path.approach(goal_m),
            path.heading(goal),
            path.last.map_or(1.0, |(s, _)| normalize_clamped(nearest_m(s), NEAR_SCALE_M)),
            path.approach(nearest_m),
            path.heading(nearest_at),
            normalize_clamped(behavior.partner_holds.len() as f32, 3.0),
            holds(&|class| class.info().is_possible_target()),
            holds(&role(Role::Container)),
            holds(&role(Role::Vehicle)),
            holds(&role(Role::HeavyTarget)),
            behavior.partner_holds_frame.map_or(0.0, |f| recency(memory.frame - f)),
            flag(nearest(bicycle, partner).is_some_and(|(m, _)| m < MAX_BICYCLE_DISTANCE_M)),
            is_last(0),
            is_last(1),
            is_last(2),
            is_last(3),
            flag(last.is_some_and(|a| a.is_in_progress)),
            flag(last.is_some_and(|a| a.has_failed)),
            last.map_or(0.0, |a| recency(memory.frame - a.frame)),
            normalize_clamped(actions.taken.len() as f32, 6.0),
            normalize_clamped(actions.failed.len() as f32, 4.0),
            actions.lowest(&actions.failed),
            actions.highest(&actions.failed),
            log_mass(actions.heaviest_kg(&actions.failed)),
            actions.lowest(&actions.taken),
            actions.highest(&actions.taken),
            log_mass(actions.heaviest_kg(&actions.taken)),
            flag(actions.taken.iter().any(|object| object.class.info().role == Role::Obstacle)),
            memory.frame as f32 / briefing.horizon.max(1) as f32,
            normalize_clamped(briefing.horizon as f32, TIME_SCALE_FRAMES),
            flag(has_child),
            flag(moves_furniture),
            flag(has_child && briefing.containers.is_empty()),
            normalize_clamped(known.count() as f32, 10.0),
            flag(!briefing.containers.is_empty()),
            flag(resting_objects(memory).any(|t| t.class.info().role == Role::Obstacle)),
        ];
        state.to_vec()
    }

    fn class_features(
        &self,
        k: usize,
        path: &PartnerPath<'_>,
        actions: &PartnerActions,
        nearest_class: [Option<usize>; 2],
        memory: &Memory,
        behavior: &BehaviorLog,
    ) -> [f32; CLASS_FEATURES.len()] {
        let class = self.classes[k];
        let info = class.info();
        let partner = path.last.map(|(_, at)| at);
        let objects = || resting_objects(memory).filter(|t| t.class == class);
        let nearest_object = nearest(objects(), partner).map(|(_, object)| object);
        let distance_m = |s: &Snapshot| s.distances_m[k];
        let min_m = self.snapshots.iter().map(distance_m).min_by(f32::total_cmp);
        let n_of_class = |handled: &[HandledObject]| {
            normalize_clamped(
                handled.iter().filter(|object| object.class == class).count() as f32,
                3.0,
            )
        };
        let last = actions.last.filter(|a| a.class == Some(class));
        let is_held_by_helper = memory.hands.all().any(|(_, c)| c == class);
        let shares_set = |object: &&HandledObject| {
            object.class.info().sets.iter().any(|set| info.sets.contains(set))
        };
        [
            normalize_clamped(objects().count() as f32, 4.0),
            path.last.map_or(1.0, |(s, _)| normalize_clamped(s.distances_m[k], NEAR_SCALE_M)),
            path.approach(distance_m),
            path.heading(nearest_object.map(|t| t.position_in_world)),
            flag(nearest_class[0] == Some(k)),
            flag(nearest_class[1] == Some(k)),
            min_m.map_or(1.0, |m| normalize_clamped(m, NEAR_SCALE_M)),
            nearest_object.map_or(0.0, |t| normalize_clamped(t.top_m, HEIGHT_SCALE_M)),
            nearest_object.map_or(0.0, |t| normalize_clamped(t.bottom_m, HEIGHT_SCALE_M)),
            log_mass(info.mass_kg),
            flag(info.role == Role::Target),
            flag(info.role == Role::Container),
            flag(info.role == Role::Fragile),
            flag(info.role == Role::Obstacle),
            flag(info.role == Role::HeavyTarget),
            flag(objects().any(|t| t.last_seen == memory.frame)),
            flag(behavior.partner_holds.iter().any(|(_, c)| *c == class)),
            n_of_class(&actions.taken),
            n_of_class(&actions.failed),
            flag(last.is_some()),
            flag(last.is_some_and(|a| a.has_failed)),
            flag(is_held_by_helper),
            normalize_clamped(actions.taken.iter().filter(shares_set).count() as f32, 3.0),
        ]
    }
}

/// Returns the nearest object and its horizontal distance, meters.
fn nearest<'a>(
    objects: impl Iterator<Item = &'a MappedObject>,
    to: Option<Vec3>,
) -> Option<(f32, &'a MappedObject)> {
    let to = to_xz(to?);
    objects.map(|t| (t.distance_from(to), t)).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Observed path of the partner.
struct PartnerPath<'a> {
    first: Option<(&'a Snapshot, Vec3)>,
    before_last: Option<(&'a Snapshot, Vec3)>,
    last: Option<(&'a Snapshot, Vec3)>,
}

impl PartnerPath<'_> {
    /// Returns the mean speed since an observation, 0 to 1.
    fn speed(&self, since: Option<(&Snapshot, Vec3)>) -> f32 {
        let Some(((start, from), (end, to))) = since.zip(self.last) else { return 0.0 };
        let frames = end.frame.saturating_sub(start.frame).max(1);
        normalize_clamped(horizontal_distance(from, to) / frames as f32, SPEED_SCALE_M_PER_FRAME)
    }

    /// Returns the decrease of a distance since the first observation, -1 to 1.
    fn approach(&self, distance: impl Fn(&Snapshot) -> f32) -> f32 {
        let Some(((start, _), (end, _))) = self.first.zip(self.last) else { return 0.0 };
        let decrease = distance(start) - distance(end);
        if decrease.is_finite() { (decrease / APPROACH_SCALE_M).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// Returns the cosine between the displacement since the first observation and the direction to
    /// a position.
    fn heading(&self, to: Option<Vec3>) -> f32 {
        let Some(((_, from), (_, at))) = self.first.zip(self.last) else { return 0.0 };
        let Some(to) = to else { return 0.0 };
        let (moved, ahead) = (to_xz(at) - to_xz(from), to_xz(to) - to_xz(at));
        let lengths = moved.length() * ahead.length();
        if lengths > 1e-3 { (moved.dot(ahead) / lengths).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// Returns the classes of the nearest and second nearest objects.
    fn nearest_class(&self) -> [Option<usize>; 2] {
        let Some((snapshot, _)) = self.last else { return [None; 2] };
        let mut order: Vec<usize> = (0..snapshot.distances_m.len()).collect();
        order.retain(|k| snapshot.distances_m[*k].is_finite());
        order.sort_by(|a, b| snapshot.distances_m[*a].total_cmp(&snapshot.distances_m[*b]));
        [order.first().copied(), order.get(1).copied()]
    }
}

/// Object that the partner took, or failed to take.
#[derive(Clone, Copy, Debug)]
struct HandledObject {
    class: ClassId,
    top_m: Option<f32>,
}

/// Last action of the partner.
#[derive(Clone, Copy, Debug)]
struct LastAction {
    frame: Frame,
    /// 0 for picking up, 1 for putting in, 2 for putting on, 3 for others.
    kind: usize,
    class: Option<ClassId>,
    is_in_progress: bool,
    has_failed: bool,
}

/// Observed actions of the partner.
struct PartnerActions {
    taken: Vec<HandledObject>,
    failed: Vec<HandledObject>,
    last: Option<LastAction>,
}

impl PartnerActions {
    fn new(
        behavior: &BehaviorLog,
        memory: &Memory,
        tops_m: &BTreeMap<TrackId, f32>,
    ) -> PartnerActions {
        let handled = |track: TrackId, class: Option<ClassId>| {
            let class = class.or_else(|| memory.objects.get(track).map(|t| t.class))?;
            Some(HandledObject { class, top_m: tops_m.get(&track).copied() })
        };
        let partner_actions = || behavior.actions.iter().filter(|a| a.agent == AgentId::PARTNER);
        let failed = partner_actions().filter(|a| a.outcome.is_some_and(|o| !o.is_success()));
        let kind = |action: &Intent| match action {
            Action::PickUp { .. } => 0,
            Action::PutIn => 1,
            Action::PutOn { .. } => 2,
            _ => 3,
        };
        let last = partner_actions().next_back().map(|observed| LastAction {
            frame: observed.frame,
            kind: kind(&observed.action),
            class: observed.action.subject().and_then(|t| memory.objects.get(t)).map(|t| t.class),
            is_in_progress: observed.outcome.is_none(),
            has_failed: observed.outcome.is_some_and(|o| !o.is_success()),
        });
        PartnerActions {
            taken: behavior
                .partner_taken
                .iter()
                .filter_map(|(t, c)| handled(*t, Some(*c)))
                .collect(),
            failed: failed.filter_map(|a| handled(a.action.subject()?, None)).collect(),
            last,
        }
    }

    fn tops<'a>(&self, objects: &'a [HandledObject]) -> impl Iterator<Item = f32> + 'a {
        objects.iter().filter_map(|object| object.top_m)
    }

    fn lowest(&self, objects: &[HandledObject]) -> f32 {
        self.tops(objects)
            .min_by(f32::total_cmp)
            .map_or(-1.0, |m| normalize_clamped(m, HEIGHT_SCALE_M))
    }

    fn highest(&self, objects: &[HandledObject]) -> f32 {
        self.tops(objects)
            .max_by(f32::total_cmp)
            .map_or(-1.0, |m| normalize_clamped(m, HEIGHT_SCALE_M))
    }

    fn heaviest_kg(&self, objects: &[HandledObject]) -> f32 {
        objects
            .iter()
            .map(|object| object.class.info().mass_kg)
            .max_by(f32::total_cmp)
            .unwrap_or(0.0)
    }
}
