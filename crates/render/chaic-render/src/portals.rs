//! Cells-and-portals visibility: what can be seen of a house's rooms from one of them. Whatever lies
//! only where no line of sight gets to is culled.
//!
//! The plan is a grid of cells. Those that walls as high as the ceiling fill are opaque; all others
//! belong to a region: a room, or what lies between rooms (a doorway, say), or outdoors. Where cells
//! of two regions meet there is a portal. A line of sight can only leave a region through its
//! portals, so that what is seen of the next region is seen through the portal's outline on the
//! image.
//!
//! PortalGraph only ever leave out what walls hide: pictures are the same with and without. Where
//! things are odd (no ceiling, an eye in a wall or above it, a plan of tatters) everything may be
//! seen.

use chaic_core::geom::Rect;
use chaic_core::{Vec2, Vec3};
use chaic_world::Setup;
use glam::Mat3;

use crate::lens::Lens;

mod floor_grid;

use floor_grid::FloorGrid;

/// A cell of the plan that walls fill.
const WALL: u8 = u8::MAX;
/// As many regions as a [`RegionSet`] tells apart; the last one stands for all further ones.
const MAX_REGIONS: usize = 64;
/// With more portals than these, looking is cheaper than finding out.
const MAX_PORTALS: usize = 512;
/// Portals looked through for one view at most, again and again those that more is seen through.
const MAX_STEPS: usize = 512;
/// How far under the floor and above the walls something may reach, metres: less than a pixel.
const SLACK_M: f32 = 1e-3;

/// Some regions of a plan. What reaches into none that a view may see isn't seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RegionSet(u64);

impl RegionSet {
    /// All there may be.
    pub const ALL: RegionSet = RegionSet(u64::MAX);

    fn insert(&mut self, region: u8) {
        self.0 |= 1 << (region % MAX_REGIONS as u8);
    }

    /// Whether they have one in common.
    pub fn overlaps(self, other: RegionSet) -> bool {
        self.0 & other.0 != 0
    }

    fn iter(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let next = (left != 0).then(|| left.trailing_zeros() as usize);
            left &= left.wrapping_sub(1);
            next
        })
    }

    /// One bit for each region.
    pub fn bits(self) -> u64 {
        self.0
    }
}

/// Least u, least v, most u, most v on the image, pixels.
type Outline = [f32; 4];

fn overlap(a: Outline, b: Outline) -> Outline {
    [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]
}

/// What holds both.
fn hull(a: Outline, b: Outline) -> Outline {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
}

/// Where nothing is.
const NOWHERE: Outline = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
/// Wherever one looks.
const EVERYWHERE: Outline = [f32::NEG_INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY];

fn is_empty(o: Outline) -> bool {
    !(o[0] < o[2] && o[1] < o[3])
}

/// What a view sees of regions; used again and again.
#[derive(Debug)]
pub(crate) struct VisibleRegions {
    set: RegionSet,
    outlines: [Outline; MAX_REGIONS],
    todo: Vec<(u8, Outline)>,
}

impl Default for VisibleRegions {
    fn default() -> VisibleRegions {
        VisibleRegions { set: RegionSet::ALL, outlines: [[0.0; 4]; MAX_REGIONS], todo: Vec::new() }
    }
}

impl VisibleRegions {
    /// Whether something in these regions may be seen, which lies within `outline` on the image;
    /// wherever it likes if that is unknown.
    pub fn shows(&self, regions: RegionSet, outline: Option<Outline>) -> bool {
        if self.set == RegionSet::ALL || regions == RegionSet::ALL {
            return true;
        }
        match outline {
            None => regions.overlaps(self.set),
            Some(outline) => RegionSet(regions.0 & self.set.0)
                .iter()
                .any(|region| !is_empty(overlap(self.outlines[region], outline))),
        }
    }
}

/// Cells side by side, of one region or opaque, up to where the next run begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    end: u16,
    /// Or [`WALL`].
    region: u8,
}

/// Where cells of two regions meet: a stretch of the plan, open from floor to ceiling.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Portal {
    a: Vec2,
    b: Vec2,
    regions: [u8; 2],
}

/// The regions of a house's plan, which its walls part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortalGraph {
    /// Where the first cell begins.
    min: Vec2,
    cell_m: f32,
    /// Cells along x and z. What is outside of the plan has the region of the nearest cell.
    n: [usize; 2],
    /// Rows of cells that are alike: the end of each band, and its runs. Empty if everything may be
    /// seen from everywhere.
    bands: Vec<(u16, Vec<Run>)>,
    portals: Vec<Portal>,
    /// Height up to which walls are opaque, metres.
    top_m: f32,
}

impl PortalGraph {
    /// Those of an episode's plan.
    pub(crate) fn new(setup: &Setup) -> PortalGraph {
        let Some(ceiling_m) = setup.ceiling_m else { return PortalGraph::default() };
        let Some(plan) = FloorGrid::new(setup, ceiling_m) else { return PortalGraph::default() };
        let portals = plan.portals();
        if portals.len() > MAX_PORTALS {
            return PortalGraph::default();
        }
        PortalGraph {
            min: plan.min,
            cell_m: plan.cell_m,
            n: [plan.n_x, plan.n_z],
            bands: plan.bands(),
            portals,
            top_m: ceiling_m - SLACK_M,
        }
    }

    /// The regions, or [`WALL`], of the cells that a rectangle touches; each at least once.
    fn regions_in(&self, rect: &Rect) -> impl Iterator<Item = u8> {
        // Casts of floats end at the least and the greatest number there is.
        let cell = |m: f32, n: usize| ((m / self.cell_m) as usize).min(n - 1) as u16;
        let (low, high) = (rect.min - self.min, rect.max - self.min);
        let [n_x, n_z] = self.n;
        let (first, last) = (cell(low.x, n_x), cell(high.x, n_x));
        let (top, bottom) = (cell(low.y, n_z), cell(high.y, n_z));
        let begin = self.bands.partition_point(|(end, _)| *end <= top);
        // A band or run is the last one if it ends past the last cell.
        let upto = |last: u16| {
            let mut is_past = false;
            move |end: u16| {
                let goes_on = !is_past;
                is_past = end > last;
                goes_on
            }
        };
        let mut is_in_rows = upto(bottom);
        let bands = self.bands[begin..].iter().take_while(move |(end, _)| is_in_rows(*end));
        bands.flat_map(move |(_, runs)| {
            let mut is_in_columns = upto(last);
            let runs = runs.iter().skip_while(move |run| run.end <= first);
            runs.take_while(move |run| is_in_columns(run.end)).map(|run| run.region)
        })
    }

    /// The regions that a box in the world reaches into.
    pub(crate) fn of_box(&self, min: Vec3, max: Vec3) -> RegionSet {
        let is_between = min.y >= -SLACK_M && max.y <= self.top_m + 2.0 * SLACK_M;
        if self.bands.is_empty() || !is_between {
            return RegionSet::ALL;
        }
        // What touches a wall is in front of it.
        let rect = Rect { min: Vec2::new(min.x, min.z), max: Vec2::new(max.x, max.z) };
        let mut set = RegionSet::default();
        for region in self.regions_in(&rect.grown(0.1 * self.cell_m)).filter(|r| *r != WALL) {
            set.insert(region);
        }
        set
    }

    /// What a lens may see.
    pub fn seen_by(&self, lens: &Lens) -> RegionSet {
        let mut seen = VisibleRegions::default();
        self.find_visible(lens, &mut seen);
        seen.set
    }

    /// Finds out what a lens sees, and through which outlines.
    pub(crate) fn find_visible(&self, lens: &Lens, seen: &mut VisibleRegions) {
        seen.set = RegionSet::ALL;
        let Some(start) = self.region_of_eye(lens) else { return };
        let whole = [0.0, 0.0, lens.width as f32, lens.height as f32];
        let VisibleRegions { outlines, todo, .. } = seen;
        outlines.fill(NOWHERE);
        todo.clear();
        let mut set = RegionSet::default();
        let mut see = |region: u8, outline: Outline, todo: &mut Vec<_>| {
            let known = &mut outlines[usize::from(region)];
            let both = hull(*known, outline);
            if both != *known {
                *known = both;
                set.insert(region);
                todo.push((region, outline));
            }
        };
        see(start, whole, todo);
        let mut n_steps = 0;
        while let Some((region, outline)) = todo.pop() {
            for portal in &self.portals {
                let next = match portal.regions {
                    [a, b] if a == region => b,
                    [a, b] if b == region => a,
                    _ => continue,
                };
                n_steps += 1;
                if n_steps > MAX_STEPS {
                    return;
                }
                let through = overlap(self.outline(portal, lens), outline);
                if !is_empty(through) {
                    see(next, through, todo);
                }
            }
        }
        seen.set = set;
    }

    /// The region that an eye is in, if walls hide anything from it.
    fn region_of_eye(&self, lens: &Lens) -> Option<u8> {
        let eye = Vec2::new(lens.eye.x, lens.eye.z);
        let d = eye - self.min;
        let end = self.cell_m * Vec2::new(self.n[0] as f32, self.n[1] as f32);
        let is_on_plan = d.cmpge(Vec2::ZERO).all() && d.cmplt(end).all();
        let is_between = lens.eye.y >= 0.0 && lens.eye.y <= self.top_m;
        if self.bands.is_empty() || lens.is_plan || !is_on_plan || !is_between {
            return None;
        }
        // What is nearer than the near plane isn't drawn, and walls aren't when seen from inside.
        let (mu, mv) = (lens.middle().0 / lens.focal, lens.middle().1 / lens.focal);
        let reach_m = lens.near_m() * (1.0 + mu * mu + mv * mv).sqrt() + 2.0 * self.cell_m;
        let here = Rect { min: eye, max: eye };
        if self.regions_in(&here.grown(reach_m)).any(|region| region == WALL) {
            return None;
        }
        self.regions_in(&here).next()
    }

    /// Where a portal is on the image, with a pixel to spare.
    fn outline(&self, portal: &Portal, lens: &Lens) -> Outline {
        /// Depth at which portals are cut, metres.
        const CUT_M: f32 = 1e-3;
        let eye = Vec2::new(lens.eye.x, lens.eye.z);
        let nearest = eye.max(portal.a.min(portal.b)).min(portal.a.max(portal.b));
        if (eye - nearest).abs().max_element() < 2.0 * self.cell_m {
            return EVERYWHERE;
        }
        let into = lens.camera_from(&Mat3::IDENTITY, Vec3::ZERO);
        let at = |p: Vec2, y: f32| into.map(Vec3::new(p.x, y, p.y));
        let top = self.top_m + 2.0 * SLACK_M;
        let ring =
            [at(portal.a, -SLACK_M), at(portal.b, -SLACK_M), at(portal.b, top), at(portal.a, top)];
        let (mu, mv) = lens.middle();
        let mut outline = NOWHERE;
        let mut add = |p: Vec3| {
            let (u, v) = (mu + p.x / p.z, mv + p.y / p.z);
            outline = hull(outline, [u - 1.0, v - 1.0, u + 1.0, v + 1.0]);
        };
        for (from, to) in ring.into_iter().zip(ring.into_iter().cycle().skip(1)) {
            if from.z >= CUT_M {
                add(from);
            }
            if (from.z >= CUT_M) != (to.z >= CUT_M) {
                let t = (CUT_M - from.z) / (to.z - from.z);
                let cut = from + (to - from) * t;
                add(Vec3::new(cut.x, cut.y, CUT_M));
            }
        }
        outline
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, Scene, View};
    use chaic_core::rng::Stream;
    use chaic_test_kit::hostile::{self, Case};
    use chaic_test_kit::scenes::{camera, empty, house, wall, world};
    use chaic_world::{Room, RoomKind, Wall};
    use std::f32::consts::{FRAC_PI_2, PI};

    /// Two rooms of 4 by 4 m side by side; the wall between them has a doorway in its middle.
    fn two_rooms() -> Setup {
        let mut setup = empty();
        setup.bounds = Rect::new([0.0, 0.0], [8.0, 4.0]);
        setup.ceiling_m = Some(2.8);
        let room = |x: f32| Room {
            kind: RoomKind::Office,
            rect: Rect::new([x + 0.06, 0.06], [x + 3.94, 3.94]),
        };
        setup.rooms = vec![room(0.0), room(4.0)];
        setup.walls = vec![
            wall([0.0, 0.0], [8.0, 0.0]),
            wall([8.0, 0.0], [8.0, 4.0]),
            wall([8.0, 4.0], [0.0, 4.0]),
            wall([0.0, 4.0], [0.0, 0.0]),
            wall([4.0, 0.06], [4.0, 1.5]),
            wall([4.0, 2.5], [4.0, 3.94]),
            Wall { bottom_m: 2.1, ..wall([4.0, 1.5], [4.0, 2.5]) },
        ];
        setup
    }

    fn seen(regions: &PortalGraph, eye: [f32; 3], yaw_rad: f32) -> VisibleRegions {
        let lens = Lens::of(&camera(eye, yaw_rad, 0.0, 128, 128)).expect("a camera");
        let mut seen = VisibleRegions::default();
        regions.find_visible(&lens, &mut seen);
        seen
    }

    fn at(regions: &PortalGraph, x: f32, z: f32) -> RegionSet {
        let p = Vec3::new(x, 1.0, z);
        regions.of_box(p - 0.1, p + 0.1)
    }

    #[test]
    fn the_next_room_is_seen_through_its_doorway_only() {
        let regions = PortalGraph::new(&two_rooms());
        let (near, far, outside) =
            (at(&regions, 2.0, 2.0), at(&regions, 6.0, 2.0), at(&regions, 9.0, 2.0));
        let sets = [near, far, outside];
        assert!(sets.iter().all(|set| set.0.count_ones() == 1), "{sets:?}");
        // A yaw of -90 degrees looks along x.
        let toward = seen(&regions, [2.0, 1.5, 2.0], -FRAC_PI_2);
        assert!(toward.shows(near, None) && toward.shows(far, None));
        assert!(!toward.shows(outside, None), "there is no way out");
        // The doorway is 0.88 m wide (a wall's box is longer by half its thickness) and ends 2.06 m
        // away: 13.7 pixels to either side of the middle, one to spare, and what cells round it by.
        let [u0, _, u1, _] = toward.outlines[far.iter().next().expect("one region")];
        assert!(u0 > 47.5 && u0 < 49.3 && u1 > 78.7 && u1 < 80.5, "{u0} to {u1}");
        assert!(toward.shows(far, Some([40.0, 40.0, 50.0, 60.0])));
        assert!(!toward.shows(far, Some([90.0, 0.0, 99.0, 99.0])));
        for (eye, yaw) in [([2.0, 1.5, 2.0], FRAC_PI_2), ([3.5, 1.5, 0.5], 0.0)] {
            let away = seen(&regions, eye, yaw);
            assert!(away.shows(near, None) && !away.shows(far, None), "{eye:?}");
        }
        let beside = regions.of_box(Vec3::new(3.9, 0.0, 0.5), Vec3::new(4.1, 1.0, 1.0));
        assert_eq!(beside.0, near.0 | far.0, "a wall is in front of both");
    }

    #[test]
    fn odd_eyes_and_odd_plans_see_everything() {
        let regions = PortalGraph::new(&two_rooms());
        for eye in [[4.0, 1.5, 0.7], [2.0, 3.5, 2.0], [-3.0, 1.5, 2.0], [3.9, 1.5, 0.7]] {
            assert_eq!(seen(&regions, eye, PI).set, RegionSet::ALL, "{eye:?}");
        }
        let high = regions.of_box(Vec3::ZERO, Vec3::new(1.0, 3.0, 1.0));
        assert_eq!(high, RegionSet::ALL, "what stands out above the walls");
        let roofless = Setup { ceiling_m: None, ..two_rooms() };
        assert_eq!(PortalGraph::new(&roofless), PortalGraph::default());
    }

    /// Eyes anywhere in a plan, in walls and out of doors too.
    fn views(rng: &mut Stream, bounds: &Rect, n: usize) -> Vec<View> {
        let view = |_| {
            let Rect { min, max } = bounds.grown(0.5);
            let [x, z] = [rng.range(min.x, max.x), rng.range(min.y, max.y)];
            let eye = [x, rng.range(0.2, 2.2), z];
            let camera = camera(eye, rng.range(-PI, PI), rng.range(-0.6, 0.3), 120, 90);
            View::of_camera(camera, Channels::ALL)
        };
        (0..n).map(view).collect()
    }

    #[test]
    fn houses_look_the_same_without_regions() {
        let mut rng = Stream::new(5, "regions", 0);
        let seeds = |k: u64| chaic_episodes::Seeds { place: k, episode: 3 };
        let generated = (0..6).map(|k| {
            chaic_episodes::generate(chaic_core::TaskId::HighTarget, seeds(k)).expect("a house")
        });
        for setup in [house(), two_rooms()].into_iter().chain(generated) {
            let (world, bounds) = (world(setup.clone()), setup.bounds);
            let scene = Scene::new(&setup);
            let views = views(&mut rng, &bounds, 40);
            let mut hidden = 0;
            for view in &views {
                let lens = Lens::of(&view.camera).expect("a camera");
                let mut seen = VisibleRegions::default();
                scene.regions().find_visible(&lens, &mut seen);
                hidden += usize::from(seen.set != RegionSet::ALL);
            }
            assert!(hidden > 15, "regions of {hidden} views only");
            let with = scene.render(&world, &views);
            let without = Scene::new(&setup).without_regions().render(&world, &views);
            assert!(with == without, "regions have changed a picture");
        }
    }

    #[test]
    fn odd_worlds_look_the_same_without_regions() {
        let mut n_walled = 0;
        for seed in 0..300 {
            let Case { setup, state, postures, views, .. } = hostile::case(seed, None);
            // The kit was built with this crate as a library, whose views are another type.
            let own_view = |v: &chaic_test_kit::View| View {
                hide: v.hide,
                hide_ceiling: v.hide_ceiling,
                sight: v.sight,
                ..View::of_camera(v.camera, Channels::ALL)
            };
            let views: Vec<View> = views.iter().map(own_view).collect();
            let scene = Scene::new(&setup);
            n_walled += usize::from(!scene.regions().portals.is_empty());
            let with = scene.render_state(&state, &postures, &views);
            let without = scene.without_regions().render_state(&state, &postures, &views);
            assert!(with == without, "seed {seed}: regions have changed a picture");
        }
        assert!(n_walled > 30, "{n_walled} plans have portals");
    }
}
