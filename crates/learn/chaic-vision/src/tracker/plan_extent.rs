//! Horizontal extent of an object's visible points, for the association of large objects: the mean of
//! the visible points depends on the view, the union of all views does not exceed the object.

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

/// Smallest and largest coordinate of a set of points (x, z) in each direction, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlanExtent {
    ranges: [[f32; 2]; DIRECTIONS.len()],
}

impl PlanExtent {
    /// Measures points; `None` without any.
    pub fn new(points: &[Vec2]) -> Option<PlanExtent> {
        let (first, rest) = points.split_first()?;
        let of_point = |point: &Vec2| PlanExtent {
            ranges: DIRECTIONS.map(|direction| [direction.dot(*point); 2]),
        };
        Some(rest.iter().fold(of_point(first), |extent, point| extent.union(&of_point(point))))
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
        assert_eq!(PlanExtent::new(&[]), None);
    }
}
