//! Semantic map: all known objects with positions, sighting times and failed attempts.

use std::collections::BTreeMap;

use chaic_core::geom::{horizontal_distance, to_xz};
use chaic_core::observation::ObjectState;
use chaic_core::{ClassId, Frame, Observation, Role, Vec2, Vec3};

use crate::perception::Detection;
use crate::track::TrackId;

/// An object that moved by less counts as unmoved, meters.
const MOVED_M: f32 = 0.5;
/// A place is in clear view if nothing is seen in front of it by more than this, meters. The depth
/// behind an object cannot be tested: for an object on the floor, the floor behind it is only
/// slightly farther away.
const CLEAR_M: f32 = 0.05;
/// Minimum number of pixels in which the object would be visible for a miss to count.
const MISS_PIXELS: f32 = 12.0;
/// Maximum distance at which a missing object counts as a miss, meters.
const MISS_RANGE_M: f32 = 4.0;
/// Border of the image, as a fraction of its width, in which misses do not count.
const MISS_MARGIN: f32 = 0.08;
/// Number of misses after which the object is forgotten.
const MISSES: u32 = 3;
/// Factor by which that number grows when an object is seen again after it was forgotten: it is too
/// small to be seen from all directions.
const MISSES_GROWTH: u32 = 4;
/// Maximum number of footprint points per object: twice as many as the largest class has if its
/// whole area is seen. The rest is for errors of depth.
const MAX_FOOTPRINT: usize = 2048;
/// A granted position that differs by less counts as unchanged, meters.
const PLACED_M: f32 = 0.05;
/// Time for which an object counts as held after a granted state with a holder, frames.
const PLACED_HELD_FRAMES: Frame = 5;

/// Known object.
#[derive(Clone, Debug, PartialEq)]
pub struct MappedObject {
    /// Its track.
    pub track: TrackId,
    /// Its class.
    pub class: ClassId,
    /// Mean of its visible points at the last sighting, meters.
    pub position_in_world: Vec3,
    /// Lowest point seen, meters.
    pub bottom_m: f32,
    /// Highest point seen, meters.
    pub top_m: f32,
    /// Visible points from above (x, z), accumulated over all sightings unless it was moved.
    pub footprint: Vec<Vec2>,
    /// Frame of the first sighting.
    pub first_seen: Frame,
    /// Frame of the last sighting.
    pub last_seen: Frame,
    /// Position of the agent at the nearest sighting in this place; `None` before the first one.
    pub seen_from: Option<Vec2>,
    /// The agent ignores it before this frame.
    pub ignore_until: Frame,
    /// It counts as held by another agent before this frame.
    pub held_until: Frame,
    /// Failed attempts since the last success or reset.
    pub failures: u32,
    /// True if it is assumed to be at its last position.
    pub is_present: bool,
    /// True if it is out of play: delivered, lost or broken.
    pub is_out_of_play: bool,
    /// Observations of its position that did not show it.
    misses: u32,
    /// Number of misses after which it is forgotten.
    misses_to_forget: u32,
    /// Its last granted state, if any. Granted states take precedence over sightings.
    placement: Option<Placement>,
}

/// Granted state of an object, as far as changes of it matter.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placement {
    position_in_world: Vec3,
    bottom_m: f32,
    top_m: f32,
    /// True if it lies somewhere: not held, and not in a container.
    is_lying: bool,
    /// True if it lies somewhere and is in play.
    is_available: bool,
}

impl Placement {
    fn new(object: &ObjectState) -> Placement {
        let is_lying = object.holder.is_none() && object.container.is_none();
        Placement {
            position_in_world: object.position_in_world,
            bottom_m: object.bottom_m,
            top_m: object.top_m,
            is_lying,
            is_available: is_lying && !object.is_gone,
        }
    }

    fn has_moved(&self, to: &Placement) -> bool {
        self.position_in_world.distance(to.position_in_world) > PLACED_M
            || (self.bottom_m - to.bottom_m).abs() > PLACED_M
            || (self.top_m - to.top_m).abs() > PLACED_M
    }
}

impl MappedObject {
    fn new(detection: &Detection, now: Frame) -> MappedObject {
        MappedObject {
            track: detection.track,
            class: detection.class,
            position_in_world: detection.position_in_world,
            bottom_m: detection.bottom_m,
            top_m: detection.top_m,
            footprint: detection.footprint.clone(),
            first_seen: now,
            last_seen: now,
            seen_from: None,
            ignore_until: 0,
            held_until: 0,
            failures: 0,
            is_present: true,
            is_out_of_play: false,
            misses: 0,
            misses_to_forget: MISSES,
            placement: None,
        }
    }

    /// Creates an object that was never seen, from its granted state.
    fn from_state(object: &ObjectState, now: Frame) -> MappedObject {
        MappedObject {
            track: object.entity.into(),
            class: object.class,
            position_in_world: object.position_in_world,
            bottom_m: object.bottom_m,
            top_m: object.top_m,
            footprint: object.footprint.clone(),
            first_seen: now,
            last_seen: 0,
            seen_from: None,
            ignore_until: 0,
            held_until: 0,
            failures: 0,
            is_present: true,
            is_out_of_play: false,
            misses: 0,
            misses_to_forget: MISSES,
            placement: None,
        }
    }

    /// Horizontal distance from `from` to its nearest known point, meters.
    pub fn distance_from(&self, from: Vec2) -> f32 {
        self.nearest_point(from).distance(from)
    }

    /// Returns its known point (x, z) nearest to `from`.
    pub fn nearest_point(&self, from: Vec2) -> Vec2 {
        let mean = to_xz(self.position_in_world);
        if self.class.info().is_carriable() {
            return mean;
        }
        self.footprint
            .iter()
            .copied()
            .min_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
            .unwrap_or(mean)
    }

    /// Returns whether it may be approached now: present, in play, not held, and not ignored.
    pub fn is_available(&self, now: Frame) -> bool {
        self.is_present && !self.is_out_of_play && now >= self.ignore_until.max(self.held_until)
    }

    fn is_fixed(&self) -> bool {
        !self.class.info().is_movable()
    }

    /// Updates the object with a sighting; returns whether the layout of obstacles changed.
    fn update(&mut self, detection: &Detection, now: Frame) -> bool {
        let n_points = self.footprint.len();
        let is_elsewhere = horizontal_distance(detection.position_in_world, self.position_in_world)
            > MOVED_M
            || (detection.position_in_world.y - self.position_in_world.y).abs() > MOVED_M;
        let has_moved = !self.is_present || is_elsewhere;
        if !is_elsewhere && self.misses >= self.misses_to_forget {
            self.misses_to_forget = self.misses_to_forget.saturating_mul(MISSES_GROWTH);
        }
        if self.is_fixed() || (!has_moved && !self.class.info().is_carriable()) {
            self.merge_footprint(&detection.footprint);
            self.bottom_m = self.bottom_m.min(detection.bottom_m);
            self.top_m = self.top_m.max(detection.top_m);
        } else {
            self.footprint.clone_from(&detection.footprint);
            (self.bottom_m, self.top_m) = (detection.bottom_m, detection.top_m);
        }
        self.seen_from = self.seen_from.filter(|_| !has_moved);
        self.class = detection.class;
        self.position_in_world = detection.position_in_world;
        self.last_seen = now;
        self.is_present = true;
        self.misses = 0;
        !self.class.info().is_carriable() && (has_moved || self.footprint.len() != n_points)
    }

    /// Returns whether the object blocks agents at any position: an obstacle, or a piece of
    /// furniture that can be moved. Others are part of the occupancy map or too small.
    pub fn blocks_path(&self) -> bool {
        let info = self.class.info();
        info.is_movable() && !info.is_carriable()
    }

    /// Adds points to the footprint. Most sightings of fixed objects show known points only.
    fn merge_footprint(&mut self, points: &[Vec2]) {
        if !is_merge_unchanged(&self.footprint, points) {
            self.footprint = merge(&self.footprint, points);
        }
    }
}

/// Merges two point lists, both sorted by x, then z.
fn merge(footprint: &[Vec2], points: &[Vec2]) -> Vec<Vec2> {
    let key = |list: &[Vec2], i: usize| list.get(i).map(|p| (p.x, p.y));
    let mut merged = Vec::with_capacity(footprint.len() + points.len());
    let (mut i, mut j) = (0, 0);
    while merged.len() < MAX_FOOTPRINT {
        let (old, new) = (key(footprint, i), key(points, j));
        let Some(first) = old.into_iter().chain(new).min_by(|a, b| compare_points(*a, *b)) else {
            break;
        };
        i += usize::from(old == Some(first));
        j += usize::from(new == Some(first));
        merged.push(Vec2::from(first));
    }
    merged
}

/// Returns true only if [`merge`] returns an unchanged footprint. It does so for a strictly sorted,
/// short enough one that contains `points` in its order: no new point is then before the next old
/// one. A footprint from a granted state may be unsorted.
fn is_merge_unchanged(footprint: &[Vec2], points: &[Vec2]) -> bool {
    if footprint.len() > MAX_FOOTPRINT {
        return false;
    }
    let mut points = points.iter().map(|p| (p.x, p.y)).peekable();
    let mut before = None;
    for point in footprint.iter().map(|p| (p.x, p.y)) {
        let is_sorted = before.is_none_or(|before| compare_points(before, point).is_lt());
        if !is_sorted || point.0.is_nan() || point.1.is_nan() {
            return false;
        }
        points.next_if(|new| compare_points(*new, point).is_eq());
        before = Some(point);
    }
    points.peek().is_none()
}

/// Compares by x, then by z.
fn compare_points(a: (f32, f32), b: (f32, f32)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
}

/// All objects seen so far.
#[derive(Clone, Debug, Default)]
pub struct SemanticMap {
    objects: BTreeMap<TrackId, MappedObject>,
    n_changes: u32,
    layout_version: u32,
}

impl SemanticMap {
    /// Returns all objects, in the order of their tracks.
    pub fn iter(&self) -> impl Iterator<Item = &MappedObject> {
        self.objects.values()
    }

    /// Returns one object.
    pub fn get(&self, track: TrackId) -> Option<&MappedObject> {
        self.objects.get(&track)
    }

    /// Increases with changes that may affect a plan: an object seen for the first time, seen again
    /// after it was missing, or available again.
    pub fn change_count(&self) -> u32 {
        self.n_changes
    }

    /// Increases with new, missed, lost, moved and growing objects, which may affect path costs.
    pub fn layout_version(&self) -> u32 {
        self.layout_version
    }

    /// Returns the objects of one class that may be approached now.
    pub fn available(&self, class: ClassId, now: Frame) -> impl Iterator<Item = &MappedObject> {
        self.iter().filter(move |t| t.class == class && t.is_available(now))
    }

    /// Updates the map with the current detections. `people` are the positions of people in the
    /// image: objects near their hands count as held for `seen_held_ignore_frames`.
    pub fn update(
        &mut self,
        detections: &[Detection],
        people: &[Vec3],
        seen_held_ignore_frames: Frame,
        now: Frame,
    ) {
        for detection in detections.iter().filter(|d| d.person.is_none()) {
            let placed = self.objects.get_mut(&detection.track).filter(|o| o.placement.is_some());
            if let Some(object) = placed {
                object.last_seen = now;
                continue;
            }
            let is_held = looks_held(detection, self.objects.get(&detection.track), people, now);
            match self.objects.get_mut(&detection.track) {
                Some(object) => {
                    self.n_changes += u32::from(!object.is_present);
                    self.layout_version += u32::from(object.update(detection, now));
                }
                None => {
                    self.n_changes += 1;
                    self.layout_version += 1;
                    self.objects.insert(detection.track, MappedObject::new(detection, now));
                }
            }
            if let Some(object) = self.objects.get_mut(&detection.track) {
                let was_held = object.held_until > now;
                if is_held {
                    object.held_until = now + seen_held_ignore_frames;
                } else if was_held {
                    object.held_until = 0;
                    self.n_changes += 1;
                }
                self.layout_version += u32::from(is_held != was_held && object.blocks_path());
            }
        }
    }

    /// Inserts or corrects an object according to its granted state. From then on, sightings of it
    /// only update [`MappedObject::last_seen`], which is 0 before the first sighting. An object
    /// held by another agent keeps its track and counts as held; one in a container that no agent
    /// holds is absent.
    pub fn apply_granted_state(&mut self, state: &ObjectState, now: Frame) {
        let track = TrackId::from(state.entity);
        let is_new = !self.objects.contains_key(&track);
        let object =
            self.objects.entry(track).or_insert_with(|| MappedObject::from_state(state, now));
        let to = Placement::new(state);
        let from = object.placement.replace(to);
        let was_present = object.is_present;
        let has_moved = from.is_none_or(|from| from.has_moved(&to));
        (object.class, object.position_in_world) = (state.class, state.position_in_world);
        if has_moved {
            (object.bottom_m, object.top_m) = (state.bottom_m, state.top_m);
            object.footprint.clone_from(&state.footprint);
        }
        object.is_present = state.holder.is_some() || state.container.is_none();
        object.held_until = if state.holder.is_some() { now + PLACED_HELD_FRAMES } else { 0 };
        object.is_out_of_play |= state.is_gone;
        object.misses = 0;
        let was_lying = from.is_some_and(|from| from.is_lying) && was_present;
        let was_available = from.is_some_and(|from| from.is_available) && was_present;
        if is_new || was_available != to.is_available || (has_moved && to.is_available) {
            self.n_changes += 1;
        }
        if is_new || was_lying != to.is_lying || (has_moved && to.is_lying) {
            let is_large = !object.class.info().is_carriable();
            self.layout_version += u32::from(is_new || is_large);
        }
    }

    /// Counts a change for each object that has become available since `before`, and resets its failures.
    pub fn count_newly_available(&mut self, before: Frame, now: Frame) {
        let passed = |until: Frame| before < until && until <= now;
        for object in self.objects.values_mut() {
            // A granted state includes the release of an object.
            let is_released = object.placement.is_none() && passed(object.held_until);
            self.layout_version += u32::from(is_released && object.blocks_path());
            if passed(object.ignore_until) || is_released {
                self.n_changes += 1;
                object.failures = 0;
            }
        }
    }

    /// Forgets movable objects whose remembered position is in clear view and empty.
    pub fn forget_missing(&mut self, observation: &Observation) {
        let Some(depth) = observation.images.depth_m.as_ref() else { return };
        let camera = &observation.camera;
        if depth.len() != camera.width as usize * camera.height as usize {
            return;
        }
        let margin = MISS_MARGIN * camera.width as f32;
        let (right, bottom) = (camera.width as f32 - margin, camera.height as f32 - margin);
        for object in self.objects.values_mut() {
            let is_certain = object.is_fixed() || object.placement.is_some();
            if is_certain || !object.is_present || object.last_seen == observation.frame {
                continue;
            }
            let Some((px, d)) = camera.project(object.position_in_world) else { continue };
            let inside = px.x > margin && px.x < right && px.y > margin && px.y < bottom;
            if !inside || d > MISS_RANGE_M {
                continue;
            }
            let visible_m = depth[px.y as usize * camera.width as usize + px.x as usize];
            if visible_m > d - CLEAR_M
                && expected_pixels(object.class, d, camera.focal_px()) > MISS_PIXELS
            {
                object.misses += 1;
                object.is_present = object.misses < object.misses_to_forget;
                self.layout_version += 1;
            }
        }
    }

    /// Forgets the small objects that were not seen for more than `span` frames, except `kept`. Their
    /// next sighting counts as a change. Granted positions are not forgotten.
    pub fn forget_unseen(&mut self, span: Frame, kept: Option<TrackId>, now: Frame) {
        for object in self.objects.values_mut() {
            let is_known = object.is_present && object.placement.is_none();
            let is_small = object.class.info().is_carriable() && Some(object.track) != kept;
            if is_known && is_small && object.last_seen + span < now {
                object.is_present = false;
                self.layout_version += 1;
            }
        }
    }

    /// Ignores an object for a while, after a failed attempt.
    pub fn ignore(&mut self, track: TrackId, until: Frame) {
        if let Some(object) = self.objects.get_mut(&track) {
            object.ignore_until = object.ignore_until.max(until);
        }
    }

    /// Counts a failed attempt; returns the new count.
    pub fn count_failure(&mut self, track: TrackId) -> u32 {
        self.objects.get_mut(&track).map_or(0, |object| {
            object.failures += 1;
            object.failures
        })
    }

    /// Resets the failure count.
    pub fn reset_failures(&mut self, track: TrackId) {
        if let Some(object) = self.objects.get_mut(&track) {
            object.failures = 0;
        }
    }

    /// Marks an object as held by another agent until this frame.
    pub fn mark_held(&mut self, track: TrackId, until: Frame) {
        if let Some(object) = self.objects.get_mut(&track) {
            object.held_until = until;
            self.layout_version += u32::from(object.blocks_path());
        }
    }

    /// Marks an object as no longer at its last position, for example after a pick-up.
    pub fn mark_absent(&mut self, track: TrackId) {
        if let Some(object) = self.objects.get_mut(&track) {
            self.layout_version += u32::from(object.is_present);
            object.is_present = false;
        }
    }

    /// Records the agent's position for all objects that are in view now and were not seen from a
    /// nearer one.
    pub fn record_viewpoint(&mut self, here: Vec2, now: Frame) {
        for object in self.objects.values_mut().filter(|o| o.last_seen == now) {
            let at = to_xz(object.position_in_world);
            let is_nearer = |from: &Vec2| from.distance(at) < here.distance(at);
            object.seen_from = object.seen_from.filter(is_nearer).or(Some(here));
        }
    }

    /// Marks the objects of these tracks as absent, because they probably do not exist. Absent targets
    /// would be evidence of a pick-up, so only [`SemanticMap::forget_missing`] decides on targets.
    pub fn retract(&mut self, tracks: &[TrackId], possible_targets: &[ClassId]) {
        for track in tracks {
            let object = self.objects.get(track);
            if object.is_some_and(|object| !possible_targets.contains(&object.class)) {
                self.mark_absent(*track);
            }
        }
    }

    /// Marks an object as in play again.
    pub fn return_to_play(&mut self, track: TrackId) {
        if let Some(object) = self.objects.get_mut(&track) {
            object.is_out_of_play = false;
            self.n_changes += 1;
        }
    }

    /// Marks an object as out of play.
    pub fn mark_out_of_play(&mut self, track: TrackId) {
        if let Some(object) = self.objects.get_mut(&track) {
            object.is_out_of_play = true;
        }
    }
}

/// Returns the minimum number of pixels that an object of this class covers, from its two smallest
/// extents.
fn expected_pixels(class: ClassId, depth_m: f32, focal_px: f32) -> f32 {
    let mut size = class.info().size_m;
    size.sort_by(f32::total_cmp);
    size[0] * size[1] * (focal_px / depth_m) * (focal_px / depth_m)
}

/// Returns whether an object is in the hands of a person in the image.
fn looks_held(
    detection: &Detection,
    before: Option<&MappedObject>,
    people: &[Vec3],
    now: Frame,
) -> bool {
    let is_near =
        |m: f32| people.iter().any(|p| horizontal_distance(*p, detection.position_in_world) < m);
    match detection.class.info().role {
        Role::Target | Role::Container | Role::Fragile => {
            // Hands hold objects at 1 m (a child at 0.4 m), about 0.55 m ahead of the body; the
            // basket of a bicycle is 0.86 m from its rider.
            detection.bottom_m > 0.3
                && is_near(0.9)
                && before.is_none_or(|t| {
                    // An object that lies where it was before the person came is not held. An
                    // object that was held before, by a person who stands still, is still held.
                    now < t.held_until
                        || !t.is_present
                        || t.position_in_world.distance(detection.position_in_world) > 0.15
                })
        }
        Role::HeavyTarget => {
            is_near(1.5)
                && before.is_some_and(|t| {
                    now < t.held_until
                        || horizontal_distance(t.position_in_world, detection.position_in_world)
                            > 0.6
                })
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests;
