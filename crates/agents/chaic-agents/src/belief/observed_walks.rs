//! Time in which the partner walked away from objects that it knows.
//!
//! The partner's rules fetch the nearest wanted object that it knows (paper section 5.1.1). While it
//! walks elsewhere with a free hand, the objects around it are probably not wanted.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::geom::to_xz;
use chaic_core::{Briefing, ClassId, Frame, Role, Vec2};

use super::visibility::{is_at_rest, is_hidden};
use crate::behavior::BehaviorLog;
use crate::memory::Memory;
use crate::track::TrackId;

/// Range in which the partner notices objects, meters. Ours: half of the 10 m up to which objects
/// are visible at all, since furniture hides distant ones.
const NOTICE_M: f32 = 5.0;
/// Length of the walks by which directions are judged, meters: two steps.
const WALK_M: f32 = 0.8;
/// Maximum duration of such a walk, frames; longer ones contain stops.
const MAX_WALK_FRAMES: Frame = 90;
/// Cosine of the angle within which a walk approaches an object: 45 degrees.
const TOWARDS_COS: f32 = 0.7;
/// An object nearer than this counts as approached, meters: the arm's length and two steps.
const AT_OBJECT_M: f32 = 1.5;
/// Fraction of the episode after which the partner delivers what it carries (facts A2.2).
const LAST_FRACTION: f32 = 0.6;

/// Set of possible target classes, as bits in the order of the briefing.
pub type ClassBits = u32;

/// Observed walks of the partner.
#[derive(Clone, Debug, Default)]
pub struct ObservedWalks {
    /// Objects that the partner has been near without a wall between.
    known: BTreeSet<TrackId>,
    /// Start of the current walk: frame and position (x, z).
    start: Option<(Frame, Vec2)>,
    /// Frames of walking by the classes of known objects that it did not approach, and of those that
    /// it did.
    frames: BTreeMap<(ClassBits, ClassBits), f32>,
}

impl ObservedWalks {
    /// Adds a sighting of the partner at `at` (x, z).
    pub fn observe(
        &mut self,
        briefing: &Briefing,
        memory: &Memory,
        behavior: &BehaviorLog,
        at: Vec2,
    ) {
        let now = memory.frame;
        let Some((since, from)) = self.start else {
            self.start = Some((now, at));
            return;
        };
        self.notice(briefing, memory, at);
        if at.distance(from) < WALK_M {
            if now > since + MAX_WALK_FRAMES {
                self.start = Some((now, at));
            }
            return;
        }
        self.start = Some((now, at));
        let duration = now - since;
        if duration > MAX_WALK_FRAMES || !may_fetch(briefing, memory, behavior) {
            return;
        }
        let direction = (at - from).normalize_or_zero();
        let approaches = |object: Vec2| {
            let to = object - from;
            at.distance(object) < AT_OBJECT_M || to.normalize_or_zero().dot(direction) > TOWARDS_COS
        };
        if may_fetch_container(briefing, memory, behavior, approaches, at) {
            return;
        }
        let (mut left, mut approached) = (0, 0);
        for track in &self.known {
            let Some(object) = memory.objects.get(*track).filter(|o| is_at_rest(o, now)) else {
                continue;
            };
            let bit = class_bit(briefing, object.class);
            match approaches(to_xz(object.position_in_world)) {
                true => approached |= bit,
                false => left |= bit,
            }
        }
        if left != 0 {
            *self.frames.entry((left, approached)).or_default() += duration as f32;
        }
    }

    fn notice(&mut self, briefing: &Briefing, memory: &Memory, at: Vec2) {
        for object in memory.objects.iter().filter(|o| is_at_rest(o, memory.frame)) {
            let object_at = to_xz(object.position_in_world);
            if briefing.possible_targets.contains(&object.class)
                && at.distance(object_at) < NOTICE_M
                && !is_hidden(memory, at, object_at)
            {
                self.known.insert(object.track);
            }
        }
    }

    /// Returns the frames in which the partner knew of a wanted object and approached none.
    pub fn frames(&self, wanted: ClassBits) -> f32 {
        let contradicting = self
            .frames
            .iter()
            .filter(|((left, approached), _)| left & wanted != 0 && approached & wanted == 0);
        contradicting.map(|(_, frames)| frames).sum()
    }
}

/// Returns the bit of a class; 0 for a class that is no possible target.
pub fn class_bit(briefing: &Briefing, class: ClassId) -> ClassBits {
    let index = briefing.possible_targets.iter().position(|c| *c == class);
    index.filter(|i| *i < 32).map_or(0, |i| 1 << i)
}

/// Returns whether the partner has a free hand and time to fetch something, as far as known.
fn may_fetch(briefing: &Briefing, memory: &Memory, behavior: &BehaviorLog) -> bool {
    let is_late = memory.frame as f32 > LAST_FRACTION * briefing.horizon as f32;
    let max_age = memory.rules.time.partner_load_valid_frames;
    let holds = behavior.partner_load(memory.frame, max_age);
    let n_targets = holds.iter().filter(|(_, c)| briefing.possible_targets.contains(c)).count();
    !is_late && n_targets < 2
}

/// Returns whether the partner may be on its way to a container.
fn may_fetch_container(
    briefing: &Briefing,
    memory: &Memory,
    behavior: &BehaviorLog,
    approaches: impl Fn(Vec2) -> bool,
    at: Vec2,
) -> bool {
    let max_age = memory.rules.time.partner_load_valid_frames;
    let holds = behavior.partner_load(memory.frame, max_age);
    if holds.iter().any(|(_, class)| class.info().role == Role::Container) {
        return false;
    }
    let containers = memory.objects.iter().filter(|o| briefing.containers.contains(&o.class));
    containers.filter(|o| is_at_rest(o, memory.frame)).any(|o| {
        let object_at = to_xz(o.position_in_world);
        approaches(object_at) && !is_hidden(memory, at, object_at)
    })
}

#[cfg(test)]
mod tests;
