//! What is where: every object seen, where, when, and how attempts at it went.

use std::collections::BTreeMap;

use chaic_core::geom::{horizontal_distance, xz};
use chaic_core::{ClassId, Frame, Observation, Role, Vec2, Vec3};

use crate::perception::Detection;
use crate::track::TrackId;

/// Something that moved by less has not been moved, metres.
const MOVED_M: f32 = 0.5;
/// A place is in clear view if nothing is seen before it by more than this, metres. (That
/// something deeper is seen there can't be asked for: behind a thing on the floor, seen from above,
/// the floor is hardly farther away.)
const CLEAR_M: f32 = 0.05;
/// A place proves nothing if the thing would show in fewer pixels than this.
const MISS_PIXELS: f32 = 12.0;
/// Farther away than this a missing object proves nothing, metres.
const MISS_RANGE_M: f32 = 4.0;
/// Part of the image's width that is too near to the border to prove anything.
const MISS_MARGIN: f32 = 0.08;
/// Looks at an empty place before the object is forgotten.
const MISSES: u32 = 3;
/// What turns up again where it was given up takes so many times as many looks the next time: it
/// shows too little to be found from everywhere.
const MISSES_GROW: u32 = 4;
/// Most footprint points kept for one thing: a truck's outline and more.
const MAX_FOOTPRINT: usize = 512;

/// What is remembered of one object.
#[derive(Clone, Debug, PartialEq)]
pub struct Thing {
    /// Which one it is.
    pub track: TrackId,
    /// Its class.
    pub class: ClassId,
    /// Mean of its points when seen last, metres.
    pub position_in_world: Vec3,
    /// Lowest point seen, metres.
    pub bottom_m: f32,
    /// Highest point seen, metres.
    pub top_m: f32,
    /// Points of it seen from above (x, z); all sides ever seen, unless it was moved.
    pub footprint: Vec<Vec2>,
    /// When it was seen first.
    pub first_seen: Frame,
    /// When it was seen last.
    pub last_seen: Frame,
    /// It is left alone before this frame.
    pub ignore_until: Frame,
    /// It counts as held by somebody else before this frame.
    pub held_until: Frame,
    /// Failed attempts since the last success or rest.
    pub failures: u32,
    /// Whether it is still believed to be where it was seen.
    pub is_present: bool,
    /// Whether it is out of play: delivered, lost or broken.
    pub is_gone: bool,
    /// Looks at its place that did not show it.
    misses: u32,
    /// So many of them and it is forgotten.
    misses_to_forget: u32,
}

impl Thing {
    fn new(seen: &Detection, now: Frame) -> Thing {
        Thing {
            track: seen.track,
            class: seen.class,
            position_in_world: seen.position_in_world,
            bottom_m: seen.bottom_m,
            top_m: seen.top_m,
            footprint: seen.footprint.clone(),
            first_seen: now,
            last_seen: now,
            ignore_until: 0,
            held_until: 0,
            failures: 0,
            is_present: true,
            is_gone: false,
            misses: 0,
            misses_to_forget: MISSES,
        }
    }

    /// Distance in plan from `from` to its nearest known point, metres.
    pub fn distance_from(&self, from: Vec2) -> f32 {
        self.nearest_point(from).distance(from)
    }

    /// Its known point (x, z) nearest to `from`.
    pub fn nearest_point(&self, from: Vec2) -> Vec2 {
        let mean = xz(self.position_in_world);
        if self.class.info().is_carriable() {
            return mean;
        }
        self.footprint
            .iter()
            .copied()
            .min_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
            .unwrap_or(mean)
    }

    /// Whether one may go for it now: there, in play, in nobody's hands, not left alone.
    pub fn is_available(&self, now: Frame) -> bool {
        self.is_present && !self.is_gone && now >= self.ignore_until && now >= self.held_until
    }

    fn is_fixed(&self) -> bool {
        !self.class.info().is_movable()
    }

    /// Takes in a sighting; whether that changes what is in the way.
    fn see(&mut self, seen: &Detection, now: Frame) -> bool {
        let n_points = self.footprint.len();
        let elsewhere = horizontal_distance(seen.position_in_world, self.position_in_world)
            > MOVED_M
            || (seen.position_in_world.y - self.position_in_world.y).abs() > MOVED_M;
        let moved = !self.is_present || elsewhere;
        if !elsewhere && self.misses >= self.misses_to_forget {
            self.misses_to_forget = self.misses_to_forget.saturating_mul(MISSES_GROW);
        }
        if self.is_fixed() || (!moved && !self.class.info().is_carriable()) {
            self.merge_footprint(&seen.footprint);
            self.bottom_m = self.bottom_m.min(seen.bottom_m);
            self.top_m = self.top_m.max(seen.top_m);
        } else {
            self.footprint.clone_from(&seen.footprint);
            (self.bottom_m, self.top_m) = (seen.bottom_m, seen.top_m);
        }
        self.class = seen.class;
        self.position_in_world = seen.position_in_world;
        self.last_seen = now;
        self.is_present = true;
        self.misses = 0;
        !self.class.info().is_carriable() && (moved || self.footprint.len() != n_points)
    }

    /// Both lists are in the order of x, then z, and stay so.
    fn merge_footprint(&mut self, points: &[Vec2]) {
        let key = |list: &[Vec2], i: usize| list.get(i).map(|p| (p.x, p.y));
        let mut merged = Vec::with_capacity(self.footprint.len() + points.len());
        let (mut i, mut j) = (0, 0);
        while merged.len() < MAX_FOOTPRINT {
            let (old, new) = (key(&self.footprint, i), key(points, j));
            let Some(least) = old.into_iter().chain(new).min_by(|a, b| order(*a, *b)) else {
                break;
            };
            i += usize::from(old == Some(least));
            j += usize::from(new == Some(least));
            merged.push(Vec2::from(least));
        }
        self.footprint = merged;
    }
}

/// By x, then by z.
fn order(a: (f32, f32), b: (f32, f32)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
}

/// Every object seen so far.
#[derive(Clone, Debug, Default)]
pub struct SemanticMap {
    things: BTreeMap<TrackId, Thing>,
    news: u32,
    layout: u32,
}

impl SemanticMap {
    /// All that is remembered, in the order of names.
    pub fn iter(&self) -> impl Iterator<Item = &Thing> {
        self.things.values()
    }

    /// What is remembered of one object.
    pub fn get(&self, track: TrackId) -> Option<&Thing> {
        self.things.get(&track)
    }

    /// Grows when something comes up that may change a plan: an object seen for the first time,
    /// seen again where none was believed to be, or available again.
    pub fn news(&self) -> u32 {
        self.news
    }

    /// Grows when something large has come, gone, moved or grown.
    pub fn layout(&self) -> u32 {
        self.layout
    }

    /// Things of one class that one may go for now.
    pub fn available(&self, class: ClassId, now: Frame) -> impl Iterator<Item = &Thing> {
        self.iter().filter(move |t| t.class == class && t.is_available(now))
    }

    /// Takes in what is seen now. `people` are the places of the people in the image: what is
    /// between their hands counts as held for `held_frames`.
    pub fn see(
        &mut self,
        detections: &[Detection],
        people: &[Vec3],
        held_frames: Frame,
        now: Frame,
    ) {
        for seen in detections.iter().filter(|d| d.person.is_none()) {
            let held = looks_held(seen, self.things.get(&seen.track), people, now);
            match self.things.get_mut(&seen.track) {
                Some(thing) => {
                    self.news += u32::from(!thing.is_present);
                    self.layout += u32::from(thing.see(seen, now));
                }
                None => {
                    self.news += 1;
                    self.layout += 1;
                    self.things.insert(seen.track, Thing::new(seen, now));
                }
            }
            if let Some(thing) = self.things.get_mut(&seen.track) {
                if held {
                    thing.held_until = now + held_frames;
                } else if thing.held_until > now {
                    thing.held_until = 0;
                    self.news += 1;
                }
            }
        }
    }

    /// Notes when things become available again.
    pub fn expire(&mut self, before: Frame, now: Frame) {
        let passed = |until: Frame| before < until && until <= now;
        for thing in self.things.values_mut() {
            if passed(thing.ignore_until) || passed(thing.held_until) {
                self.news += 1;
                thing.failures = 0;
            }
        }
    }

    /// Forgets movable things whose remembered place is in clear view and empty.
    pub fn forget_missing(&mut self, observation: &Observation) {
        let Some(depth) = observation.images.depth_m.as_ref() else { return };
        let camera = &observation.camera;
        if depth.len() != camera.width as usize * camera.height as usize {
            return;
        }
        let margin = MISS_MARGIN * camera.width as f32;
        let (right, bottom) = (camera.width as f32 - margin, camera.height as f32 - margin);
        for thing in self.things.values_mut() {
            if thing.is_fixed() || !thing.is_present || thing.last_seen == observation.frame {
                continue;
            }
            let Some((px, d)) = camera.project(thing.position_in_world) else { continue };
            let inside = px.x > margin && px.x < right && px.y > margin && px.y < bottom;
            if !inside || d > MISS_RANGE_M {
                continue;
            }
            let there = depth[px.y as usize * camera.width as usize + px.x as usize];
            if there > d - CLEAR_M
                && expected_pixels(thing.class, d, camera.focal_px()) > MISS_PIXELS
            {
                thing.misses += 1;
                thing.is_present = thing.misses < thing.misses_to_forget;
                self.layout += 1;
            }
        }
    }

    /// After a failed attempt: leaves the object alone for a while.
    pub fn ignore(&mut self, track: TrackId, until: Frame) {
        if let Some(thing) = self.things.get_mut(&track) {
            thing.ignore_until = thing.ignore_until.max(until);
        }
    }

    /// Counts a failed attempt; the new count.
    pub fn count_failure(&mut self, track: TrackId) -> u32 {
        self.things.get_mut(&track).map_or(0, |thing| {
            thing.failures += 1;
            thing.failures
        })
    }

    /// Forgives earlier failures.
    pub fn forgive(&mut self, track: TrackId) {
        if let Some(thing) = self.things.get_mut(&track) {
            thing.failures = 0;
        }
    }

    /// Somebody else has it, and will have it until then as far as one can tell.
    pub fn mark_held(&mut self, track: TrackId, until: Frame) {
        if let Some(thing) = self.things.get_mut(&track) {
            thing.held_until = until;
        }
    }

    /// It is no longer where it was seen (one has taken it oneself, say).
    pub fn mark_absent(&mut self, track: TrackId) {
        if let Some(thing) = self.things.get_mut(&track) {
            self.layout += u32::from(thing.is_present);
            thing.is_present = false;
        }
    }

    /// It is in play again.
    pub fn return_to_play(&mut self, track: TrackId) {
        if let Some(thing) = self.things.get_mut(&track) {
            thing.is_gone = false;
            self.news += 1;
        }
    }

    /// It is out of play.
    pub fn mark_gone(&mut self, track: TrackId) {
        if let Some(thing) = self.things.get_mut(&track) {
            thing.is_gone = true;
        }
    }
}

/// How many pixels a thing of this class covers at least, from its two smallest extents.
fn expected_pixels(class: ClassId, depth_m: f32, focal_px: f32) -> f32 {
    let mut size = class.info().size_m;
    size.sort_by(f32::total_cmp);
    size[0] * size[1] * (focal_px / depth_m) * (focal_px / depth_m)
}

/// Whether something is in the hands of one of the people in the image.
fn looks_held(seen: &Detection, before: Option<&Thing>, people: &[Vec3], now: Frame) -> bool {
    let near = |m: f32| people.iter().any(|p| horizontal_distance(*p, seen.position_in_world) < m);
    match seen.class.info().role {
        Role::Target | Role::Container | Role::Fragile => {
            // Hands hold things at 1 m (a child at 0.4 m), about 0.55 m ahead of the body; the
            // basket of a bicycle is 0.86 m from its rider.
            seen.bottom_m > 0.3
                && near(0.9)
                && before.is_none_or(|t| {
                    // Lying untouched where it was seen before anybody came near, it is not held;
                    // in the hand of somebody who stands still, it is.
                    now < t.held_until
                        || !t.is_present
                        || t.position_in_world.distance(seen.position_in_world) > 0.15
                })
        }
        Role::HeavyTarget => {
            near(1.5)
                && before.is_some_and(|t| {
                    now < t.held_until
                        || horizontal_distance(t.position_in_world, seen.position_in_world) > 0.6
                })
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::{GroundTruthIds, Perception as _};
    use crate::test_support::{Toy, ToyObject};

    fn look(map: &mut SemanticMap, toy: &Toy, people: &[Vec3]) {
        let observation = toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        map.see(&percepts.detections, people, 300, observation.frame);
        map.forget_missing(&observation);
    }

    #[test]
    fn an_object_is_forgotten_when_its_place_is_seen_empty_but_not_when_hidden() {
        for hidden in [false, true] {
            let mut toy = Toy::room(8.0, 8.0);
            toy.size = 256;
            let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -1.9], [0.2, 0.2, 0.2]));
            toy.stand([0.0, 0.0], 0.0);
            let mut map = SemanticMap::default();
            look(&mut map, &toy, &[]);
            assert!(map.get(apple).expect("seen").is_available(toy.frame));
            toy.remove(apple);
            if hidden {
                toy.add(ToyObject::new("cabinet", [0.0, 0.0, -1.5], [1.0, 1.0, 0.3]));
            }
            for _ in 0..MISSES {
                toy.frame += 1;
                look(&mut map, &toy, &[]);
            }
            assert_eq!(map.get(apple).expect("still on record").is_present, hidden);
        }
    }

    #[test]
    fn what_shows_from_here_and_not_from_there_is_given_up_ever_more_seldom() {
        let mut toy = Toy::room(8.0, 8.0);
        toy.size = 256;
        let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -1.9], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let shown = GroundTruthIds.perceive(&toy.observe()).detections;
        toy.remove(apple);
        let mut map = SemanticMap::default();
        let mut n_given_up = 0;
        for _ in 0..50 {
            map.see(&shown, &[], 300, toy.frame);
            for _ in 0..2 * MISSES {
                toy.frame += 1;
                look(&mut map, &toy, &[]);
            }
            n_given_up += u32::from(!map.get(apple).expect("on record").is_present);
        }
        assert_eq!(n_given_up, 1);
    }

    #[test]
    fn what_a_person_carries_is_not_available() {
        let mut toy = Toy::room(8.0, 8.0);
        let apple = toy.add(ToyObject::new("apple", [0.0, 1.0, -2.5], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = SemanticMap::default();
        look(&mut map, &toy, &[Vec3::new(0.0, 0.9, -2.9)]);
        assert!(!map.get(apple).expect("seen").is_available(toy.frame));
        toy.frame += 1;
        look(&mut map, &toy, &[Vec3::new(0.0, 0.9, -2.9)]);
        assert!(!map.get(apple).expect("seen").is_available(toy.frame), "still in hand");
        toy.frame += 1;
        look(&mut map, &toy, &[Vec3::new(2.0, 0.9, -2.9)]);
        assert!(map.get(apple).expect("seen").is_available(toy.frame), "put down again");
    }

    #[test]
    fn an_object_left_alone_comes_back_as_news() {
        let mut toy = Toy::room(8.0, 8.0);
        let apple = toy.add(ToyObject::new("apple", [0.0, 0.0, -2.5], [0.2, 0.2, 0.2]));
        toy.stand([0.0, 0.0], 0.0);
        let mut map = SemanticMap::default();
        look(&mut map, &toy, &[]);
        map.ignore(apple, 500);
        assert!(!map.get(apple).expect("seen").is_available(499));
        let news = map.news();
        map.expire(400, 500);
        assert!(map.get(apple).expect("seen").is_available(500) && map.news() > news);
    }

    #[test]
    fn large_things_are_as_near_as_their_nearest_point() {
        let mut toy = Toy::room(12.0, 12.0);
        let bed = toy.add(ToyObject::new("bed", [0.0, 0.0, -3.0], [6.0, 0.5, 2.0]));
        toy.stand([0.0, 1.0], 0.0);
        let mut map = SemanticMap::default();
        look(&mut map, &toy, &[]);
        let bed = map.get(bed).expect("seen");
        assert!((bed.distance_from(Vec2::new(2.4, -1.0)) - 1.0).abs() < 0.15);
        assert!(bed.distance_from(Vec2::new(0.0, 0.0)) > 1.8);
    }
}
