//! Features of the opponent model that follow from the partner's walk and from the belief about its
//! goal: which object the partner would fetch next by its rules.

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::belief::Belief;
use chaic_agents::memory::Memory;
use chaic_core::{Briefing, ClassId, Role};

use super::walk::{Destination, PartnerWalk, WalkPaths, goal_places, resting_objects};
use crate::scales::{flag, normalize_clamped};

/// Features of the state: of the partner's walk, and of the belief about its goal.
pub const WALK_STATE_FEATURES: [&str; 11] = [
    "load",
    "walk_length",
    "still_time",
    "goal_path",
    "goal_detour",
    "goal_progress",
    "goal_is_noticed",
    "container_is_noticed",
    "wanted_is_noticed",
    "goal_entropy",
    "n_missing",
];

/// Features of a class.
pub const WALK_CLASS_FEATURES: [&str; 7] =
    ["is_noticed", "path", "detour", "progress", "wanted", "n_missing", "is_next"];

/// Distance at which features of distance saturate, meters.
pub(super) const NEAR_SCALE_M: f32 = 10.0;
/// Number of held objects at which the feature saturates: a full container and an object.
const LOAD_SCALE: f32 = 5.0;
/// Detour at which the feature saturates, meters.
const DETOUR_SCALE_M: f32 = 3.0;
/// Time of standing at which the feature saturates, frames.
const STILL_SCALE_FRAMES: f32 = 120.0;
/// Entropy of the goal at which the feature saturates, bits: that of eight sets.
const ENTROPY_SCALE_BITS: f32 = 3.0;
/// Number of missing objects at which the feature of the state saturates: that of the largest goal.
const MISSING_SCALE: f32 = 10.0;
/// Number of missing objects of a class at which its feature saturates.
const MISSING_OF_CLASS_SCALE: f32 = 3.0;

/// Encoder of these features for one observation.
pub(super) struct WalkFeatures<'a> {
    walk: &'a PartnerWalk,
    paths: Option<&'a WalkPaths>,
    entropy_bits: f32,
    has_noticed_container: bool,
    targets: Vec<NextTarget>,
}

/// Object of a class that the partner may fetch next.
#[derive(Clone, Copy, Debug, Default)]
struct NextTarget {
    /// Relation of the walk to the nearest noticed object, or else to the nearest known one.
    destination: Option<Destination>,
    /// True if the partner has noticed an object of the class.
    is_noticed: bool,
    /// Probability that the class is wanted.
    wanted: f32,
    /// Expected number of objects that are wanted and neither delivered nor held.
    n_missing: f32,
    /// Probability that an object of the class is the nearest wanted one.
    is_next: f32,
}

impl<'a> WalkFeatures<'a> {
    /// Relates the walk to the nearest object of each class. The partner's rules fetch the nearest
    /// wanted object that it knows (paper section 5.1.1).
    pub fn new(
        walk: &'a PartnerWalk,
        paths: Option<&'a WalkPaths>,
        belief: Option<&Belief>,
        classes: &[ClassId],
        memory: &Memory,
    ) -> WalkFeatures<'a> {
        let goal = belief.map(|belief| &belief.goal);
        let target = |class: &ClassId| NextTarget {
            wanted: goal.map_or(0.0, |goal| goal.probability_wanted(*class)),
            n_missing: goal.map_or(0.0, |goal| goal.expected_missing(*class)),
            ..NextTarget::default()
        };
        let mut targets: Vec<NextTarget> = classes.iter().map(target).collect();
        for object in resting_objects(memory) {
            let Some(k) = classes.iter().position(|class| *class == object.class) else { continue };
            let Some(destination) = paths.and_then(|p| p.destination(object)) else { continue };
            let is_noticed = walk.has_noticed(object.track);
            let best = &mut targets[k];
            let is_better = best.destination.is_none_or(|b| {
                (best.is_noticed, -b.remaining_m) < (is_noticed, -destination.remaining_m)
            });
            if is_better {
                (best.destination, best.is_noticed) = (Some(destination), is_noticed);
            }
        }
        let initial_m = |t: &NextTarget| Some(t.destination.filter(|_| t.is_noticed)?.initial_m);
        let noticed = targets.iter().enumerate().filter_map(|(k, t)| Some((initial_m(t)?, k)));
        let mut noticed: Vec<(f32, usize)> = noticed.collect();
        noticed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut no_nearer = 1.0;
        for (_, k) in noticed {
            targets[k].is_next = no_nearer * targets[k].wanted;
            no_nearer *= 1.0 - targets[k].wanted;
        }
        let is_container = |class: &ClassId| class.info().role == Role::Container;
        let has_noticed_container =
            classes.iter().zip(&targets).any(|(class, t)| is_container(class) && t.is_noticed);
        let entropy_bits = goal.map_or(0.0, |goal| goal.entropy_bits());
        WalkFeatures { walk, paths, entropy_bits, has_noticed_container, targets }
    }

    /// Returns [`WALK_STATE_FEATURES`].
    pub fn state(
        &self,
        memory: &Memory,
        briefing: &Briefing,
        behavior: &BehaviorLog,
    ) -> [f32; WALK_STATE_FEATURES.len()] {
        let places = || goal_places(memory, briefing);
        let goal = places().filter_map(|place| self.paths?.destination(place));
        let goal = goal.min_by(|a, b| a.remaining_m.total_cmp(&b.remaining_m));
        let [path, detour, progress] = destination_features(goal);
        let sum = |value: fn(&NextTarget) -> f32| self.targets.iter().map(value).sum::<f32>();
        [
            normalize_clamped(behavior.partner_holds.len() as f32, LOAD_SCALE),
            self.paths.map_or(0.0, |paths| normalize_clamped(paths.walked_m, NEAR_SCALE_M)),
            normalize_clamped(self.walk.standing_frames() as f32, STILL_SCALE_FRAMES),
            path,
            detour,
            progress,
            flag(places().any(|place| self.walk.has_noticed(place.track))),
            flag(self.has_noticed_container),
            normalize_clamped(sum(|t| t.is_next), 1.0),
            normalize_clamped(self.entropy_bits, ENTROPY_SCALE_BITS),
            normalize_clamped(sum(|t| t.n_missing), MISSING_SCALE),
        ]
    }

    /// Returns [`WALK_CLASS_FEATURES`] of the class with this index.
    pub fn class(&self, k: usize) -> [f32; WALK_CLASS_FEATURES.len()] {
        let NextTarget { destination, is_noticed, wanted, n_missing, is_next } = self.targets[k];
        let [path, detour, progress] = destination_features(destination);
        let n_missing = normalize_clamped(n_missing, MISSING_OF_CLASS_SCALE);
        [flag(is_noticed), path, detour, progress, wanted, n_missing, is_next]
    }
}

/// Encodes path length, detour and progress.
fn destination_features(destination: Option<Destination>) -> [f32; 3] {
    destination.map_or([1.0, 1.0, 0.0], |d| {
        [
            normalize_clamped(d.remaining_m, NEAR_SCALE_M),
            normalize_clamped(d.detour_m, DETOUR_SCALE_M),
            d.progress,
        ]
    })
}
