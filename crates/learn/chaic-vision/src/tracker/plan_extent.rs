//! Horizontal extent of an object's visible points, for the association of large objects: the mean of
//! the visible points depends on the view, but the union of all views does not exceed the object.

use chaic_core::Vec2;

/// Directions in which the extent is measured, at equal angles over a half turn. The diameter is
/// underestimated by at most 1 - cos(pi / 16), 2 %.
const DIRECTIONS: [Vec2; 8] = [
    Vec2::new(1.0, 0.0),
    Vec2::new(0.923_879_5, 0.382_683_43),
    Vec2::new(0.707_106_77, 0.707_106_77),
    Vec2::new(0.382_683_43, 0.923_879_5),
    Vec2::new(0.0, 1.0),
    Vec2::new(-0.382_683_43, 0.923_879_5),
    Vec2::new(-0.707_106_77, 0.707_106_77),
    Vec2::new(-0.923_879_5, 0.382_683_43),
];

/// Fraction of the points that are outliers, at each end.
const OUTLIERS: f32 = 0.05;

/// Smallest and largest coordinate of a set of points (x, z) in each direction, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlanExtent {
    ranges: [[f32; 2]; DIRECTIONS.len()],
}

impl PlanExtent {
    /// Measures points; `None` without any. Masks contain some pixels of the background, so
    /// [`OUTLIERS`] of the points are left out at both ends of each direction.
    pub fn new(points: &[Vec2]) -> Option<PlanExtent> {
        let n_outliers = (OUTLIERS * points.len() as f32) as usize;
        let range = |direction: Vec2| {
            let mut values: Vec<f32> = points.iter().map(|point| direction.dot(*point)).collect();
            values.sort_by(f32::total_cmp);
            [values[n_outliers], values[values.len() - 1 - n_outliers]]
        };
        (!points.is_empty()).then(|| PlanExtent { ranges: DIRECTIONS.map(range) })
    }

    /// Extent of the points of both sets.
    pub fn union(&self, other: &PlanExtent) -> PlanExtent {
        let union = |k: usize| {
            let ([a, b], [c, d]) = (self.ranges[k], other.ranges[k]);
            [a.min(c), b.max(d)]
        };
        PlanExtent { ranges: std::array::from_fn(union) }
    }

    /// Largest distance between two points, meters.
    pub fn diameter_m(&self) -> f32 {
        self.ranges.iter().map(|[low, high]| high - low).fold(0.0, f32::max)
    }

    /// Returns whether a point lies inside, or at most `margin_m` outside.
    pub fn contains(&self, point: Vec2, margin_m: f32) -> bool {
        DIRECTIONS.iter().zip(self.ranges).all(|(direction, [low, high])| {
            let at = direction.dot(point);
            at >= low - margin_m && at <= high + margin_m
        })
    }

    /// Middle of the axis-parallel bounding box.
    pub fn center(&self) -> Vec2 {
        let middle = |k: usize| 0.5 * (self.ranges[k][0] + self.ranges[k][1]);
        Vec2::new(middle(0), middle(DIRECTIONS.len() / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_union_of_two_sides_has_the_diameter_of_the_object() {
        let front: Vec<Vec2> = (0..=8).map(|k| Vec2::new(0.25 * k as f32, 0.0)).collect();
        let side: Vec<Vec2> = (0..=4).map(|k| Vec2::new(0.0, -0.25 * k as f32)).collect();
        let [front, side] = [front, side].map(|points| PlanExtent::new(&points).unwrap());
        assert_eq!((front.diameter_m(), side.diameter_m()), (2.0, 1.0));
        let both = front.union(&side);
        assert!((2.15..2.24).contains(&both.diameter_m()), "{}", both.diameter_m());
        assert_eq!(both.center(), Vec2::new(1.0, -0.5));
        let inside =
            [(1.0, -0.4, true), (1.9, -0.9, false), (2.05, -0.02, true), (2.2, 0.0, false)];
        for (x, z, expected) in inside {
            assert_eq!(both.contains(Vec2::new(x, z), 0.1), expected, "{x} {z}");
        }
        assert_eq!(PlanExtent::new(&[]), None);
        let mut points: Vec<Vec2> = (0..=40).map(|k| Vec2::new(0.05 * k as f32, 0.0)).collect();
        points.push(Vec2::new(9.0, 0.0));
        let diameter_m = PlanExtent::new(&points).unwrap().diameter_m();
        assert!((1.7..2.0).contains(&diameter_m), "{diameter_m}");
    }
}
