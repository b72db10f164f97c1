//! Joining of the parts of one object by their centers. A grid keeps the search fast for images in
//! which each pixel is a separate part, such as noise.

use std::collections::BTreeMap;

use super::Segment;

/// Joins each part to the first earlier segment that `is_same` accepts; other parts become segments.
/// `reach_m` is the maximum distance between the center of a segment and the center of a part that
/// joins the segment, meters.
pub(super) fn join(
    parts: Vec<Segment>,
    reach_m: impl Fn(&Segment) -> f32,
    is_same: impl Fn(&Segment, &Segment) -> bool,
) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut grid = CenterGrid::default();
    for part in parts {
        let existing = grid.first(part.center, |k| is_same(&segments[k], &part));
        match existing {
            Some(k) => segments[k].pixels.extend(part.pixels),
            None => {
                grid.insert(segments.len(), part.center, reach_m(&part));
                segments.push(part);
            }
        }
    }
    segments
}

/// Numbered centers, each listed in all cells within its reach. A cell is at least twice the reach of
/// its centers. Segments of one label are far apart, so a cell lists few segments per label.
#[derive(Default)]
struct CenterGrid {
    levels: Vec<Level>,
}

/// Cells of one size.
struct Level {
    cell_m: f64,
    /// For each cell, the numbers of the centers that reach it, ascending.
    cells: BTreeMap<[i64; 3], Vec<usize>>,
}

impl Level {
    /// Returns the cell of a point that is moved by `offset_m` along each axis.
    fn cell(&self, point: [f32; 3], offset_m: f64) -> [i64; 3] {
        point.map(|x| ((f64::from(x) + offset_m) / self.cell_m).floor() as i64)
    }
}

impl CenterGrid {
    /// Adds a center. Numbers ascend. A center that is not finite or has no reach is left out: no
    /// distance from it is less than its reach.
    fn insert(&mut self, number: usize, center: [f32; 3], reach_m: f32) {
        /// Tolerance for the rounding of distances, relative to the reach.
        const TOLERANCE: f64 = 1e-3;
        /// Smallest size of cells, meters.
        const MIN_CELL_M: f64 = 1.0 / 64.0;
        let has_reach = reach_m > 0.0 && is_finite(center);
        if !has_reach {
            return;
        }
        let reach_m = f64::from(reach_m) * (1.0 + TOLERANCE);
        // A center reaches at most two cells along each axis.
        let mut cell_m = MIN_CELL_M;
        while cell_m < 2.0 * reach_m {
            cell_m *= 2.0;
        }
        let index = self.levels.iter().position(|level| level.cell_m == cell_m);
        let index = index.unwrap_or_else(|| {
            self.levels.push(Level { cell_m, cells: BTreeMap::new() });
            self.levels.len() - 1
        });
        let level = &mut self.levels[index];
        let (low, high) = (level.cell(center, -reach_m), level.cell(center, reach_m));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    level.cells.entry([x, y, z]).or_default().push(number);
                }
            }
        }
    }

    /// Returns the smallest number of a center that reaches this point and is accepted.
    fn first(&self, point: [f32; 3], is_accepted: impl Fn(usize) -> bool) -> Option<usize> {
        let first_of_level = |level: &Level| {
            let numbers = level.cells.get(&level.cell(point, 0.0))?;
            numbers.iter().copied().find(|number| is_accepted(*number))
        };
        if !is_finite(point) {
            return None;
        }
        self.levels.iter().filter_map(first_of_level).min()
    }
}

fn is_finite(point: [f32; 3]) -> bool {
    point.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use chaic_core::rng::RngStream;

    use super::*;
    use crate::labels::{half_extents_m, n_labels};
    use crate::proposals::GROUPINGS;

    /// Parts of one pixel with random labels and centers in a room.
    fn parts(n: usize) -> Vec<Segment> {
        let mut rng = RngStream::new(1, "parts", 0);
        let part = |k: usize| Segment {
            label: 1 + rng.below(n_labels() - 1) as u8,
            score: 0.0,
            pixels: vec![k as u32],
            center: [rng.range(-4.0, 4.0), rng.range(-1.6, 0.9), rng.range(-8.0, 0.0)],
        };
        (0..n).map(part).collect()
    }

    /// Joins parts by comparing each with all segments.
    fn scan(parts: Vec<Segment>, is_same: impl Fn(&Segment, &Segment) -> bool) -> Vec<Segment> {
        let mut segments: Vec<Segment> = Vec::new();
        for part in parts {
            let existing = segments.iter_mut().find(|segment| is_same(segment, &part));
            match existing {
                Some(segment) => segment.pixels.extend(part.pixels),
                None => segments.push(part),
            }
        }
        segments
    }

    #[test]
    fn the_grid_joins_the_same_parts_as_a_scan() {
        let mut parts = parts(3000);
        for k in (0..2900).step_by(50) {
            parts[k + 1].center = parts[k].center;
            parts[k + 2].center[0] = f32::NAN;
            parts[k + 3].center[1] = f32::INFINITY;
            parts[k + 4].center = [1e30, -1e30, 0.0];
        }
        let half_extents = half_extents_m();
        let content = |segments: Vec<Segment>| -> Vec<(u8, Vec<u32>)> {
            segments.into_iter().map(|segment| (segment.label, segment.pixels)).collect()
        };
        for config in &GROUPINGS {
            let is_same = |a: &Segment, b: &Segment| config.is_same_object(&half_extents, a, b);
            let reach_m = |segment: &Segment| config.reach_m(&half_extents, segment.label);
            let expected = content(scan(parts.clone(), is_same));
            assert!(content(join(parts.clone(), reach_m, is_same)) == expected, "{config:?}");
            // Two groupings join no parts.
            let joins = config.join_extents > 0.0;
            assert_eq!(expected.len() < parts.len(), joins, "{config:?}");
        }
    }

    #[test]
    fn many_parts_need_few_comparisons() {
        /// Comparisons per part: about 100 are needed, and a scan makes thousands.
        const MAX_COMPARISONS: usize = 200;
        let half_extents = half_extents_m();
        let parts = parts(16_384);
        for config in &GROUPINGS {
            let n_compared = Cell::new(0);
            let is_same = |a: &Segment, b: &Segment| {
                n_compared.set(n_compared.get() + 1);
                config.is_same_object(&half_extents, a, b)
            };
            let reach_m = |segment: &Segment| config.reach_m(&half_extents, segment.label);
            join(parts.clone(), reach_m, is_same);
            let n_compared = n_compared.get();
            assert!(n_compared < MAX_COMPARISONS * parts.len(), "{n_compared} with {config:?}");
        }
    }
}
