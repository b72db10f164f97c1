//! Destinations of navigation, and the conditions of arrival.

use chaic_core::Vec2;
use chaic_core::geom::to_xz;

use crate::mapping::MappedObject;
use crate::planning::cost_map::CostMap;

/// Initial part of a straight line that is not tested, because the body already occupies it,
/// meters.
pub(super) const OWN_BODY_M: f32 = 0.22;
/// The side of an object from which an attempt failed is avoided: directions with a greater cosine
/// (40 degrees either way) at points of the object nearer to each other than this, meters.
const AVOID_COS: f32 = 0.77;
const AVOID_POINTS_M: f32 = 0.4;
/// The same for large objects, seen from their center: 70 degrees either way.
const AVOID_COS_LARGE: f32 = 0.34;

/// Tolerance of arrival, meters: a step is longer than a position beside furniture is wide.
const ARRIVAL_M: f32 = 0.12;

/// Destination of a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Destination {
    /// Points (x, z) of which one is to be approached; not empty.
    pub points: Vec<Vec2>,
    /// Arrival distance from one of the points, meters.
    pub within_m: f32,
    /// Minimum distance from the nearest point, meters; 0 for none.
    pub min_m: f32,
    /// If set, the straight line to the point must be clear except for its last part of this
    /// length, meters, where the arm reaches over what the object lies on.
    pub arm_m: Option<f32>,
    /// Center of an object from which no wall may separate the arrival position. The object may
    /// stand against a wall with the agent behind it.
    pub same_room_as: Option<Vec2>,
    /// If set, the arrival position must be on the side of the point on which this position is:
    /// directions with at least this cosine.
    pub side_of: Option<(Vec2, f32)>,
    /// Positions of failed attempts; the arrival position must be on another side.
    pub failed_positions: Vec<Vec2>,
}

impl Destination {
    /// Creates a destination near one point.
    pub fn near(point: Vec2, within_m: f32) -> Destination {
        Destination {
            points: vec![point],
            within_m,
            min_m: 0.0,
            arm_m: None,
            same_room_as: None,
            side_of: None,
            failed_positions: Vec::new(),
        }
    }

    /// Creates the destination of an interaction with an object.
    pub fn at_object(object: &MappedObject, within_m: f32) -> Destination {
        let is_small = object.class.info().is_carriable() || object.footprint.is_empty();
        let mean = to_xz(object.position_in_world);
        let points = if is_small { vec![mean] } else { object.footprint.clone() };
        let center = points.iter().copied().sum::<Vec2>() / points.len() as f32;
        Destination {
            points,
            same_room_as: (!is_small).then_some(center),
            ..Destination::near(mean, within_m)
        }
    }

    /// Returns the point nearest to `from`.
    pub(super) fn nearest_point(&self, from: Vec2) -> Vec2 {
        let mut best = (f32::INFINITY, from);
        for p in &self.points {
            let d = p.distance_squared(from);
            if d < best.0 {
                best = (d, *p);
            }
        }
        best.1
    }

    /// Returns the mean of the points, and the radius of the circle around it that contains them.
    pub(crate) fn center_and_radius(&self) -> (Vec2, f32) {
        let center = self.points.iter().copied().sum::<Vec2>() / self.points.len() as f32;
        let radius = self.points.iter().map(|p| p.distance(center)).fold(0.0, f32::max);
        (center, radius)
    }

    /// Returns whether an agent at `here` has arrived. The condition is slightly weaker than in
    /// planning, to avoid oscillation around the position.
    pub fn is_reached(&self, costs: &CostMap, here: Vec2) -> bool {
        self.accepts(costs, here, ARRIVAL_M)
    }

    /// Returns whether `here` is an arrival position, with this tolerance of the arm's reach and of
    /// the minimum distance.
    pub(crate) fn accepts(&self, costs: &CostMap, here: Vec2, tolerance_m: f32) -> bool {
        let point = self.nearest_point(here);
        let distance_m = point.distance(here);
        distance_m <= self.within_m
            && distance_m + tolerance_m >= self.min_m
            && self.side_of.is_none_or(|(at, cos)| cosine(at - point, here - point) >= cos)
            && self
                .failed_positions
                .iter()
                .all(|failed| self.is_on_other_side(*failed, here, point))
            && self.arm_m.is_none_or(|arm_m| is_line_clear(costs, here, point, arm_m + tolerance_m))
            && !self.is_walled_off(costs, here)
    }

    /// Returns whether a wall separates `here` from the large object of this destination. The map
    /// may mark tall objects as walls, so the object's own outline does not count.
    pub(super) fn is_walled_off(&self, costs: &CostMap, here: Vec2) -> bool {
        let Some(center) = self.same_room_as else { return false };
        /// Part of the line inside the object, meters: the wall may be all that it touches.
        const INSIDE_M: f32 = 0.35;
        let nearest = self.nearest_point(here);
        let end = nearest + (center - nearest).clamp_length_max(INSIDE_M);
        let grid = costs.grid();
        let mut walls = grid.line(here, end).filter(|cell| costs.is_wall(*cell));
        walls.any(|cell| !self.points.iter().any(|p| grid.cell_at(*p) == Some(cell)))
    }

    fn is_on_other_side(&self, failed: Vec2, here: Vec2, point: Vec2) -> bool {
        if let Some(center) = self.same_room_as {
            // A failure near a large object was probably caused by a wall, so this side is
            // excluded.
            let (a, b) = (failed - center, here - center);
            return cosine(a, b) < AVOID_COS_LARGE;
        }
        let failed_point = self.nearest_point(failed);
        failed_point.distance(point) > AVOID_POINTS_M
            || cosine(failed - failed_point, here - point) < AVOID_COS
    }
}

/// Returns the cosine between two directions; 0 if one of them is undefined.
fn cosine(a: Vec2, b: Vec2) -> f32 {
    a.normalize_or_zero().dot(b.normalize_or_zero())
}

/// Returns whether the body can move from `from` to within an arm's length of `to`.
fn is_line_clear(costs: &CostMap, from: Vec2, to: Vec2, arm_m: f32) -> bool {
    let length = from.distance(to);
    if length <= OWN_BODY_M + arm_m {
        return true;
    }
    let at = |m: f32| from.lerp(to, m / length);
    costs.is_straight_clear(at(OWN_BODY_M), at(length - arm_m))
}
