//! Cells-and-portals visibility: culls instances in rooms to which the camera has no line of sight.
//!
//! The floor plan is a grid of cells. Cells inside walls of full height are opaque. Every other
//! cell belongs to a region: a room, a space between rooms (a doorway, for example), or outdoors. A
//! portal is an edge where cells of two regions meet. A line of sight can leave a region only
//! through its portals. The next region is therefore visible only inside the screen rectangle of
//! the portal.
//!
//! Portal culling removes only what walls hide: images are the same with and without it. In unusual
//! cases (no ceiling, an eye inside or above a wall, a very fragmented plan) everything counts as
//! visible.

use chaic_core::geom::Rect;
use chaic_core::{Vec2, Vec3};
use chaic_world::Setup;
use glam::Mat3;

use crate::projection::Projection;

mod floor_grid;

use floor_grid::FloorGrid;

/// Marker of an opaque cell.
const WALL: u8 = u8::MAX;
/// Maximum number of regions in a [`RegionSet`]. The last one stands for all further regions.
const MAX_REGIONS: usize = 64;
/// Maximum number of portals. With more, rendering is cheaper than portal traversal.
const MAX_PORTALS: usize = 512;
/// Maximum number of portal steps per view. A region whose visible rectangle grows is visited
/// again.
const MAX_STEPS: usize = 512;
/// Tolerance below the floor and above the walls, meters: less than a pixel.
const TOLERANCE_M: f32 = 1e-3;

/// A set of regions of a floor plan. An instance that overlaps no visible region is culled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RegionSet(u64);

impl RegionSet {
    /// Every possible region.
    pub const ALL: RegionSet = RegionSet(u64::MAX);

    fn insert(&mut self, region: u8) {
        self.0 |= 1 << (region % MAX_REGIONS as u8);
    }

    /// Returns whether the sets have a common region.
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

    /// Returns one bit per region.
    pub fn bits(self) -> u64 {
        self.0
    }
}

/// A rectangle on the image: minimum u, minimum v, maximum u, maximum v, pixels.
type ScreenRect = [f32; 4];

fn intersection(a: ScreenRect, b: ScreenRect) -> ScreenRect {
    [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]
}

/// Bounding rectangle of both.
fn bounding_rect(a: ScreenRect, b: ScreenRect) -> ScreenRect {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
}

/// Empty rectangle.
const EMPTY_RECT: ScreenRect = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
/// Unbounded rectangle.
const UNBOUNDED_RECT: ScreenRect =
    [f32::NEG_INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY];

fn is_empty(o: ScreenRect) -> bool {
    !(o[0] < o[2] && o[1] < o[3])
}

/// Visible regions of a view, in reusable buffers.
#[derive(Debug)]
pub(crate) struct VisibleRegions {
    set: RegionSet,
    rects: [ScreenRect; MAX_REGIONS],
    stack: Vec<(u8, ScreenRect)>,
}

impl Default for VisibleRegions {
    fn default() -> VisibleRegions {
        VisibleRegions { set: RegionSet::ALL, rects: [[0.0; 4]; MAX_REGIONS], stack: Vec::new() }
    }
}

impl VisibleRegions {
    /// Returns whether an object in these regions may be visible. `rect` is its bounding rectangle
    /// on the image; `None` if it is unknown.
    pub fn may_show(&self, regions: RegionSet, rect: Option<ScreenRect>) -> bool {
        if self.set == RegionSet::ALL || regions == RegionSet::ALL {
            return true;
        }
        match rect {
            None => regions.overlaps(self.set),
            Some(rect) => RegionSet(regions.0 & self.set.0)
                .iter()
                .any(|region| !is_empty(intersection(self.rects[region], rect))),
        }
    }
}

/// A run of neighboring cells of one region, or opaque. It ends where the next run begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    end: u16,
    /// Region, or [`WALL`].
    region: u8,
}

/// A segment of the floor plan where cells of two regions meet, open from floor to ceiling.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Portal {
    a: Vec2,
    b: Vec2,
    regions: [u8; 2],
}

/// Regions and portals of a house.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortalGraph {
    /// Corner of the first cell.
    min: Vec2,
    cell_m: f32,
    /// Number of cells along x and z. A point outside the grid has the region of the nearest cell.
    n: [usize; 2],
    /// Bands of identical rows of cells: the end of each band and its runs. Empty if portal culling
    /// is disabled.
    bands: Vec<(u16, Vec<Run>)>,
    portals: Vec<Portal>,
    /// Height of opaque walls, meters.
    top_m: f32,
}

impl PortalGraph {
    /// Builds the portal graph of an episode.
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
            top_m: ceiling_m - TOLERANCE_M,
        }
    }

    /// Iterates over the regions, or [`WALL`], of the cells that a rectangle touches; each at least
    /// once.
    fn regions_in_rect(&self, rect: &Rect) -> impl Iterator<Item = u8> {
        // Casts from float to integer saturate.
        let cell = |m: f32, n: usize| ((m / self.cell_m) as usize).min(n - 1) as u16;
        let (low, high) = (rect.min - self.min, rect.max - self.min);
        let [n_x, n_z] = self.n;
        let (first, last) = (cell(low.x, n_x), cell(high.x, n_x));
        let (top, bottom) = (cell(low.y, n_z), cell(high.y, n_z));
        let begin = self.bands.partition_point(|(end, _)| *end <= top);
        // A band or run is the last one if it ends past the last cell.
        let until_past = |last: u16| {
            let mut is_past = false;
            move |end: u16| {
                let continues = !is_past;
                is_past = end > last;
                continues
            }
        };
        let mut is_in_rows = until_past(bottom);
        let bands = self.bands[begin..].iter().take_while(move |(end, _)| is_in_rows(*end));
        bands.flat_map(move |(_, runs)| {
            let mut is_in_columns = until_past(last);
            let runs = runs.iter().skip_while(move |run| run.end <= first);
            runs.take_while(move |run| is_in_columns(run.end)).map(|run| run.region)
        })
    }

    /// Returns the regions that a box in the world overlaps.
    pub(crate) fn regions_in_box(&self, min: Vec3, max: Vec3) -> RegionSet {
        let is_between = min.y >= -TOLERANCE_M && max.y <= self.top_m + 2.0 * TOLERANCE_M;
        if self.bands.is_empty() || !is_between {
            return RegionSet::ALL;
        }
        // An object that touches a wall is in front of it.
        let rect = Rect { min: Vec2::new(min.x, min.z), max: Vec2::new(max.x, max.z) };
        let mut set = RegionSet::default();
        for region in self.regions_in_rect(&rect.expanded(0.1 * self.cell_m)).filter(|r| *r != WALL)
        {
            set.insert(region);
        }
        set
    }

    /// Returns the regions that a camera may see.
    pub fn visible_regions(&self, projection: &Projection) -> RegionSet {
        let mut visible = VisibleRegions::default();
        self.find_visible(projection, &mut visible);
        visible.set
    }

    /// Computes the visible regions and the screen rectangles through which they are visible.
    pub(crate) fn find_visible(&self, projection: &Projection, visible: &mut VisibleRegions) {
        visible.set = RegionSet::ALL;
        let Some(start) = self.region_of_eye(projection) else { return };
        let whole = [0.0, 0.0, projection.width as f32, projection.height as f32];
        let VisibleRegions { rects, stack, .. } = visible;
        rects.fill(EMPTY_RECT);
        stack.clear();
        let mut set = RegionSet::default();
        let mut visit = |region: u8, rect: ScreenRect, stack: &mut Vec<_>| {
            let previous = &mut rects[usize::from(region)];
            let merged = bounding_rect(*previous, rect);
            if merged != *previous {
                *previous = merged;
                set.insert(region);
                stack.push((region, rect));
            }
        };
        visit(start, whole, stack);
        let mut n_steps = 0;
        while let Some((region, rect)) = stack.pop() {
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
                let visible_rect = intersection(self.portal_rect(portal, projection), rect);
                if !is_empty(visible_rect) {
                    visit(next, visible_rect, stack);
                }
            }
        }
        visible.set = set;
    }

    /// Returns the region of the eye; `None` if portal culling does not apply to it.
    fn region_of_eye(&self, projection: &Projection) -> Option<u8> {
        let eye = Vec2::new(projection.eye.x, projection.eye.z);
        let d = eye - self.min;
        let end = self.cell_m * Vec2::new(self.n[0] as f32, self.n[1] as f32);
        let is_on_plan = d.cmpge(Vec2::ZERO).all() && d.cmplt(end).all();
        let is_between = projection.eye.y >= 0.0 && projection.eye.y <= self.top_m;
        if self.bands.is_empty() || projection.is_plan || !is_on_plan || !is_between {
            return None;
        }
        // Surfaces nearer than the near plane and the inner sides of walls are not drawn.
        let (mu, mv) =
            (projection.center().0 / projection.focal, projection.center().1 / projection.focal);
        let reach_m = projection.near_m() * (1.0 + mu * mu + mv * mv).sqrt() + 2.0 * self.cell_m;
        let here = Rect { min: eye, max: eye };
        if self.regions_in_rect(&here.expanded(reach_m)).any(|region| region == WALL) {
            return None;
        }
        self.regions_in_rect(&here).next()
    }

    /// Returns the bounding rectangle of a portal on the image, with a margin of one pixel.
    fn portal_rect(&self, portal: &Portal, projection: &Projection) -> ScreenRect {
        /// Depth at which portals are clipped, meters.
        const CLIP_M: f32 = 1e-3;
        let eye = Vec2::new(projection.eye.x, projection.eye.z);
        let nearest = eye.max(portal.a.min(portal.b)).min(portal.a.max(portal.b));
        if (eye - nearest).abs().max_element() < 2.0 * self.cell_m {
            return UNBOUNDED_RECT;
        }
        let transform = projection.camera_from(&Mat3::IDENTITY, Vec3::ZERO);
        let at = |p: Vec2, y: f32| transform.map(Vec3::new(p.x, y, p.y));
        let top = self.top_m + 2.0 * TOLERANCE_M;
        let corners_in_camera = [
            at(portal.a, -TOLERANCE_M),
            at(portal.b, -TOLERANCE_M),
            at(portal.b, top),
            at(portal.a, top),
        ];
        let (mu, mv) = projection.center();
        let mut rect = EMPTY_RECT;
        let mut add = |p: Vec3| {
            let (u, v) = (mu + p.x / p.z, mv + p.y / p.z);
            rect = bounding_rect(rect, [u - 1.0, v - 1.0, u + 1.0, v + 1.0]);
        };
        for (from, to) in
            corners_in_camera.into_iter().zip(corners_in_camera.into_iter().cycle().skip(1))
        {
            if from.z >= CLIP_M {
                add(from);
            }
            if (from.z >= CLIP_M) != (to.z >= CLIP_M) {
                let t = (CLIP_M - from.z) / (to.z - from.z);
                let clipped = from + (to - from) * t;
                add(Vec3::new(clipped.x, clipped.y, CLIP_M));
            }
        }
        rect
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, Scene, View};
    use chaic_core::rng::RngStream;
    use chaic_test_kit::hostile::{self, Case};
    use chaic_test_kit::scenes::{camera, empty, house, object, wall, world};
    use chaic_world::{Room, RoomKind, Wall};
    use std::f32::consts::{FRAC_PI_2, PI};

    /// Two rooms of 4 by 4 m side by side, with a doorway in the middle of the shared wall.
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

    fn visible_from(portals: &PortalGraph, eye: [f32; 3], yaw_rad: f32) -> VisibleRegions {
        let projection = Projection::from_camera(&camera(eye, yaw_rad, 0.0, 128, 128))
            .expect("the camera is valid");
        let mut visible = VisibleRegions::default();
        portals.find_visible(&projection, &mut visible);
        visible
    }

    fn regions_at(portals: &PortalGraph, x: f32, z: f32) -> RegionSet {
        let p = Vec3::new(x, 1.0, z);
        portals.regions_in_box(p - 0.1, p + 0.1)
    }

    #[test]
    fn the_next_room_is_visible_only_through_its_doorway() {
        let portals = PortalGraph::new(&two_rooms());
        let (near, far, outside) = (
            regions_at(&portals, 2.0, 2.0),
            regions_at(&portals, 6.0, 2.0),
            regions_at(&portals, 9.0, 2.0),
        );
        let sets = [near, far, outside];
        assert!(sets.iter().all(|set| set.0.count_ones() == 1), "{sets:?}");
        // A yaw of -90 degrees looks along x.
        let toward = visible_from(&portals, [2.0, 1.5, 2.0], -FRAC_PI_2);
        assert!(toward.may_show(near, None) && toward.may_show(far, None));
        assert!(!toward.may_show(outside, None), "there is no way out");
        // The doorway is 0.88 m wide (a wall's box is longer by half its thickness) and ends 2.06 m
        // away. That is 13.7 pixels to either side of the center, plus the margin of one pixel and
        // the rounding to cells.
        let [u0, _, u1, _] = toward.rects[far.iter().next().expect("one region")];
        assert!(u0 > 47.5 && u0 < 49.3 && u1 > 78.7 && u1 < 80.5, "{u0} to {u1}");
        assert!(toward.may_show(far, Some([40.0, 40.0, 50.0, 60.0])));
        assert!(!toward.may_show(far, Some([90.0, 0.0, 99.0, 99.0])));
        for (eye, yaw) in [([2.0, 1.5, 2.0], FRAC_PI_2), ([3.5, 1.5, 0.5], 0.0)] {
            let away = visible_from(&portals, eye, yaw);
            assert!(away.may_show(near, None) && !away.may_show(far, None), "{eye:?}");
        }
        let beside = portals.regions_in_box(Vec3::new(3.9, 0.0, 0.5), Vec3::new(4.1, 1.0, 1.0));
        assert_eq!(beside.0, near.0 | far.0, "a wall is in front of both");
    }

    #[test]
    fn invalid_eyes_and_plans_disable_culling() {
        let portals = PortalGraph::new(&two_rooms());
        for eye in [[4.0, 1.5, 0.7], [2.0, 3.5, 2.0], [-3.0, 1.5, 2.0], [3.9, 1.5, 0.7]] {
            assert_eq!(visible_from(&portals, eye, PI).set, RegionSet::ALL, "{eye:?}");
        }
        let high = portals.regions_in_box(Vec3::ZERO, Vec3::new(1.0, 3.0, 1.0));
        assert_eq!(high, RegionSet::ALL, "a box that reaches above the walls");
        let roofless = Setup { ceiling_m: None, ..two_rooms() };
        assert_eq!(PortalGraph::new(&roofless), PortalGraph::default());
    }

    /// Cameras anywhere in a plan, including inside walls and outdoors.
    fn views(rng: &mut RngStream, bounds: &Rect, n: usize) -> Vec<View> {
        let view = |_| {
            let Rect { min, max } = bounds.expanded(0.5);
            let [x, z] = [rng.range(min.x, max.x), rng.range(min.y, max.y)];
            let eye = [x, rng.range(0.2, 2.2), z];
            let camera = camera(eye, rng.range(-PI, PI), rng.range(-0.6, 0.3), 120, 90);
            View::from_camera(camera, Channels::ALL)
        };
        (0..n).map(view).collect()
    }

    #[test]
    fn houses_render_the_same_without_portals() {
        let mut rng = RngStream::new(5, "regions", 0);
        let seeds = |k: u64| chaic_episodes::GeneratorSeeds { place: k, episode: 3 };
        let generated = (0..6).map(|k| {
            chaic_episodes::generate(chaic_core::TaskId::HighTarget, seeds(k)).expect("a house")
        });
        for setup in [house(), two_rooms()].into_iter().chain(generated) {
            let (world, bounds) = (world(setup.clone()), setup.bounds);
            let scene = Scene::new(&setup);
            let views = views(&mut rng, &bounds, 40);
            let mut n_culled = 0;
            for view in &views {
                let projection =
                    Projection::from_camera(&view.camera).expect("the camera is valid");
                let mut visible = VisibleRegions::default();
                scene.portal_graph().find_visible(&projection, &mut visible);
                n_culled += usize::from(visible.set != RegionSet::ALL);
            }
            assert!(n_culled > 15, "regions of {n_culled} views only");
            let with = scene.render(&world, &views);
            let without = Scene::new(&setup).without_portals().render(&world, &views);
            assert!(with == without, "portal culling changed an image");
        }
    }

    #[test]
    fn hostile_worlds_render_the_same_without_portals() {
        let mut n_with_portals = 0;
        for seed in 0..300 {
            let Case { setup, state, postures, views, .. } = hostile::case(seed, None);
            // The test kit was built with this crate as a library, whose `View` is another type.
            let own_view = |v: &chaic_test_kit::View| View {
                hide: v.hide,
                hide_ceiling: v.hide_ceiling,
                sight: v.sight,
                ..View::from_camera(v.camera, Channels::ALL)
            };
            let views: Vec<View> = views.iter().map(own_view).collect();
            let scene = Scene::new(&setup);
            n_with_portals += usize::from(!scene.portal_graph().portals.is_empty());
            let with = scene.render_state(&state, &postures, &views);
            let without = scene.without_portals().render_state(&state, &postures, &views);
            assert!(with == without, "seed {seed}: portal culling changed an image");
        }
        assert!(n_with_portals > 30, "{n_with_portals} plans have portals");
    }

    /// A house with four outer walls and no room.
    fn enclosed(end: [f32; 2]) -> Setup {
        let mut setup = empty();
        setup.bounds = Rect::new([0.0; 2], end);
        setup.ceiling_m = Some(2.8);
        setup.walls = vec![
            wall([0.0, 0.0], [end[0], 0.0]),
            wall([end[0], 0.0], end),
            wall(end, [0.0, end[1]]),
            wall([0.0, end[1]], [0.0, 0.0]),
        ];
        setup
    }

    /// `n_x` by `n_z` rooms of 1.2 m with two doorways to each neighbor, and an apple in each room.
    fn maze(n_x: usize, n_z: usize) -> Setup {
        const SIDE_M: f32 = 1.2;
        let mut setup = enclosed([SIDE_M * n_x as f32, SIDE_M * n_z as f32]);
        for k in 0..n_x * n_z {
            let (x, z) = (SIDE_M * (k % n_x) as f32, SIDE_M * (k / n_x) as f32);
            let rect = Rect::new([x, z], [x + SIDE_M, z + SIDE_M]);
            setup.rooms.push(Room { kind: RoomKind::Office, rect });
            setup.things.push(object("apple", x + 0.5 * SIDE_M, z + 0.3 * SIDE_M, 0.0));
            // The box of a wall is longer by half of its thickness at each end.
            for [from, to] in [[0.0, 0.2], [0.5, 0.7], [1.0, 1.2]] {
                if k % n_x > 0 {
                    setup.walls.push(wall([x, z + from], [x, z + to]));
                }
                if k / n_x > 0 {
                    setup.walls.push(wall([x + from, z], [x + to, z]));
                }
            }
        }
        setup
    }

    #[test]
    fn plans_with_more_regions_than_bits_share_the_last_one() {
        // With the outdoors, 64 regions, 65, and far more.
        for (n_x, n_z) in [(9, 7), (8, 8), (10, 9)] {
            let setup = maze(n_x, n_z);
            let scene = Scene::new(&setup);
            let portals = scene.portal_graph();
            assert!(!portals.portals.is_empty() && portals.portals.len() <= MAX_PORTALS);
            let center = |k: usize| setup.rooms[k].rect.center();
            let regions = |k: usize| regions_at(portals, center(k).x, center(k).y);
            let n = setup.rooms.len();
            for k in 0..n {
                assert_eq!(regions(k).bits(), 1 << k.min(MAX_REGIONS - 1), "room {k} of {n}");
            }
            assert_eq!(regions_at(portals, -0.15, 1.0).bits(), 1 << (MAX_REGIONS - 1));
            // A yaw of 90 degrees looks away from all other rooms.
            let eye = |k: usize| [center(k).x, 1.5, center(k).y];
            let away = visible_from(portals, eye(0), FRAC_PI_2);
            assert!(away.may_show(regions(0), None) && !away.may_show(regions(n - 1), None));
            let world = world(setup.clone());
            let view = |(k, yaw_rad): (usize, f32)| {
                let camera = camera(eye(k), yaw_rad, -0.4, 60, 45);
                View::from_camera(camera, Channels::DEPTH_AND_IDS)
            };
            let views: Vec<View> =
                [0, n / 2, n - 1].into_iter().zip([-FRAC_PI_2, 0.4, 2.0]).map(view).collect();
            let with = scene.render(&world, &views);
            let without = Scene::new(&setup).without_portals().render(&world, &views);
            assert!(with == without, "{n} rooms: portal culling changed an image");
        }
    }

    /// Six rooms side by side with a row of `n` pillars between two neighbors.
    fn colonnades(n: usize) -> Setup {
        let end = [6.0, 24.0];
        let mut setup = enclosed(end);
        for x in [0.0, 1.0, 2.0, 3.0, 4.0, 5.0] {
            let rect = Rect::new([x, 0.0], [x + 1.0, end[1]]);
            setup.rooms.push(Room { kind: RoomKind::Office, rect });
            for z in (0..n).map(|k| 0.2 * k as f32 + 0.1).filter(|_| x > 0.0) {
                setup.walls.push(wall([x, z], [x, z + 0.01]));
            }
        }
        setup
    }

    #[test]
    fn plans_with_too_many_portals_have_none() {
        let portals = PortalGraph::new(&colonnades(95)).portals;
        assert!((MAX_PORTALS - 100..=MAX_PORTALS).contains(&portals.len()), "{}", portals.len());
        // Slightly above the maximum, and as many as the grid resolves.
        for n in [104, 119] {
            assert_eq!(PortalGraph::new(&colonnades(n)), PortalGraph::default(), "{n} pillars");
        }
    }
}
