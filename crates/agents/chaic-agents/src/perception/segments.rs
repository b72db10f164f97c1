//! Measures the positions and extents of segmented objects from depth.

use chaic_core::geom::Camera;
use chaic_core::{ClassId, Role, Vec2, Vec3};

/// Minimum number of pixels of a detection (facts A1.8).
pub const MIN_PIXELS: u32 = 5;
/// Spacing of the rows and columns at which dynamic pixels are sampled.
pub const STRIDE: u32 = 2;
/// Minimum number of measured points per image row on large objects: at 5 m they are 8 cm apart,
/// less than the spacing of footprint points.
const MIN_SAMPLES_PER_ROW: usize = 128;
/// Maximum depth of points that are used for object positions, meters (facts A1.1).
pub const OBJECT_RANGE_M: f32 = 10.0;
/// The same for people, who are located at any distance (facts A1.8).
const PERSON_RANGE_M: f32 = f32::INFINITY;
/// Maximum height of footprint points, meters: bodies do not collide above it.
const FOOTPRINT_HEIGHT_M: f32 = 2.0;
/// Spacing of footprint points, meters.
const FOOTPRINT_M: f32 = 0.125;

/// Kinds of segments, which are measured differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelKind {
    /// Structure, or an object that is not reported.
    Background,
    /// Object carried by the agent itself.
    Carried,
    /// Small object: every pixel is measured.
    Small,
    /// Large and movable object.
    Movable,
    /// Person.
    Person,
    /// Large and fixed object.
    Fixed,
}

impl PixelKind {
    /// Returns the kind of a class.
    pub fn from_class(class: ClassId) -> PixelKind {
        match class.info().role {
            Role::Person => PixelKind::Person,
            Role::Target | Role::Container | Role::Fragile => PixelKind::Small,
            Role::Obstacle | Role::HeavyTarget | Role::Vehicle => PixelKind::Movable,
            Role::Furnishing => PixelKind::Fixed,
        }
    }
}

/// Measurement of one segment.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentMeasurement {
    /// Column and row of a pixel inside the segment.
    pub pixel: [u32; 2],
    /// Mean of its visible points, meters.
    pub position_in_world: Vec3,
    /// Height of its lowest visible point, meters.
    pub bottom_m: f32,
    /// Height of its highest visible point, meters.
    pub top_m: f32,
    /// Number of pixels.
    pub n_pixels: u32,
    /// Visible points from above (x, z), at most one per 0.125 m square.
    pub footprint: Vec<Vec2>,
}

/// Segmented depth image.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    /// Segment index of each pixel, shape [height, width].
    pub segment_ids: &'a [u16],
    /// Depth in meters, shape [height, width].
    pub depth_m: &'a [f32],
    /// Camera of the image.
    pub camera: &'a Camera,
    /// Kind of each segment by index; segments beyond are background.
    pub kinds: &'a [PixelKind],
}

impl Segments<'_> {
    /// Measures each segment, and computes [`Percepts::dynamic_mask`]. The result by index is
    /// `None` for segments with fewer than [`MIN_PIXELS`] pixels or without points in range.
    ///
    /// [`Percepts::dynamic_mask`]: super::Percepts::dynamic_mask
    pub fn measure(&self) -> (Vec<Option<SegmentMeasurement>>, Vec<bool>) {
        let (ids, depth, width) = (self.segment_ids, self.depth_m, self.camera.width as usize);
        let rays = Rays::new(self.camera);
        let measure = Measure { ids, depth, width, kinds: self.kinds, rays: &rays };
        let (accumulators, dynamic_mask) = pulp::Arch::new().dispatch(measure);
        (accumulators.into_iter().map(SegmentAccumulator::finish).collect(), dynamic_mask)
    }
}

/// Sum and vertical extent of points.
#[derive(Clone, Copy)]
struct Points {
    n: u32,
    sum: Vec3,
    low: f32,
    high: f32,
}

impl Points {
    const EMPTY: Points =
        Points { n: 0, sum: Vec3::ZERO, low: f32::INFINITY, high: f32::NEG_INFINITY };

    #[inline(always)]
    fn add(&mut self, p: Vec3) {
        self.n += 1;
        self.sum += p;
        self.low = self.low.min(p.y);
        self.high = self.high.max(p.y);
    }
}

/// Direct-mapped cache of the squares of segments. An object repeats its squares in each image row,
/// and the cache recognizes most repetitions. A square that was overwritten counts as new: lists of
/// new squares are complete and may contain repetitions.
struct SquareCache {
    /// Segment and square in one key. Its index is the square's place in a window that repeats, so
    /// that all squares of an object up to 8 m wide have different indices.
    keys: [u64; WINDOW * WINDOW],
}

/// Side of that window, squares.
const WINDOW: usize = 64;

impl SquareCache {
    /// Contains no square: all keys are smaller.
    const EMPTY: SquareCache = SquareCache { keys: [u64::MAX; WINDOW * WINDOW] };

    /// Inserts a square of a segment; returns whether it is new.
    #[inline(always)]
    fn insert(&mut self, segment: usize, square: [i16; 2]) -> bool {
        let (x, z) = (square[0] as u16, square[1] as u16);
        let place = usize::from(x) % WINDOW + WINDOW * (usize::from(z) % WINDOW);
        let key = (segment as u64) << 32 | u64::from(x) << 16 | u64::from(z);
        if self.keys[place] == key {
            return false;
        }
        self.keys[place] = key;
        true
    }
}

/// Accumulated points of one segment.
struct SegmentAccumulator {
    n_pixels: u32,
    points: Points,
    /// Squares with points, each at least once.
    squares: Vec<[i16; 2]>,
    /// Length of the longest run of pixels in a row, and its center.
    longest: u32,
    pixel: [u32; 2],
}

impl SegmentAccumulator {
    const EMPTY: SegmentAccumulator = SegmentAccumulator {
        longest: 0,
        pixel: [0, 0],
        n_pixels: 0,
        points: Points::EMPTY,
        squares: Vec::new(),
    };

    #[inline(always)]
    fn add_run(&mut self, row: usize, from: usize, end: usize) {
        let n = (end - from) as u32;
        self.n_pixels += n;
        if n > self.longest {
            self.longest = n;
            self.pixel = [(from + end) as u32 / 2, row as u32];
        }
    }

    fn finish(mut self) -> Option<SegmentMeasurement> {
        if self.n_pixels < MIN_PIXELS || self.points.n == 0 {
            return None;
        }
        self.squares.sort_unstable();
        self.squares.dedup();
        Some(SegmentMeasurement {
            pixel: self.pixel,
            position_in_world: self.points.sum / self.points.n as f32,
            bottom_m: self.points.low,
            top_m: self.points.high,
            n_pixels: self.n_pixels,
            footprint: self
                .squares
                .iter()
                .map(|s| FOOTPRINT_M * Vec2::new(f32::from(s[0]), f32::from(s[1])))
                .collect(),
        })
    }
}

/// Rounds half away from zero, like `f32::round`, but without a call to the C library per point.
#[inline(always)]
fn round_to_i16(x: f32) -> i16 {
    let x = x.clamp(-40_000.0, 40_000.0);
    let truncated = x as i32;
    let fraction = x - truncated as f32;
    let rounded = truncated + i32::from(fraction >= 0.5) - i32::from(fraction <= -0.5);
    rounded.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
}

/// Returns the number of leading ids that are equal.
#[inline(always)]
fn run_length(ids: &[u16]) -> usize {
    const CHUNK: usize = 32;
    let Some(first) = ids.first() else { return 0 };
    let same = |chunk: &&[u16]| chunk.iter().fold(true, |same, id| same & (id == first));
    let n = CHUNK * ids.chunks_exact(CHUNK).take_while(same).count();
    n + ids[n..].iter().take_while(|id| *id == first).count()
}

/// Directions through pixel centers per meter of depth: the world point of a pixel is `eye + depth
/// * (column + row)`.
pub(crate) struct Rays {
    pub eye: Vec3,
    pub columns: Vec<Vec3>,
    pub rows: Vec<Vec3>,
}

impl Rays {
    pub(crate) fn new(camera: &Camera) -> Rays {
        let rotation = camera.rotation();
        let f = camera.focal_px();
        let (half_w, half_h) = (0.5 * camera.width as f32, 0.5 * camera.height as f32);
        Rays {
            eye: camera.eye_in_world,
            columns: (0..camera.width)
                .map(|c| rotation.x_axis * ((c as f32 + 0.5 - half_w) / f))
                .collect(),
            rows: (0..camera.height)
                .map(|r| -rotation.y_axis * ((r as f32 + 0.5 - half_h) / f) - rotation.z_axis)
                .collect(),
        }
    }

    #[inline(always)]
    pub(crate) fn point(&self, column: usize, row: usize, depth_m: f32) -> Vec3 {
        self.eye + depth_m * (self.columns[column] + self.rows[row])
    }
}

/// Pass over the pixels of one image, compiled for vectors of each width. Accumulates
/// the points of each segment and computes [`Percepts::dynamic_mask`].
struct Measure<'a> {
    ids: &'a [u16],
    depth: &'a [f32],
    width: usize,
    kinds: &'a [PixelKind],
    rays: &'a Rays,
}

impl pulp::NullaryFnOnce for Measure<'_> {
    type Output = (Vec<SegmentAccumulator>, Vec<bool>);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Measure { ids, depth, width, kinds, rays } = self;
        let height = rays.rows.len();
        let stride = STRIDE as usize;
        let coarse_stride = (width / MIN_SAMPLES_PER_ROW).max(stride);
        let mut accumulators: Vec<SegmentAccumulator> =
            kinds.iter().map(|_| SegmentAccumulator::EMPTY).collect();
        let sampled_width = width.div_ceil(stride);
        let mut dynamic_mask = vec![false; sampled_width * height.div_ceil(stride)];
        let mut known_squares = SquareCache::EMPTY;
        for row in 0..height {
            let (ids, depth) = (&ids[row * width..][..width], &depth[row * width..][..width]);
            let on_row = row % stride == 0;
            let mut end = 0;
            while end < width {
                let from = end;
                end += run_length(&ids[from..]);
                let id = usize::from(ids[from]);
                let kind = kinds.get(id).copied().unwrap_or(PixelKind::Background);
                if on_row && !matches!(kind, PixelKind::Background | PixelKind::Fixed) {
                    let sampled = from.div_ceil(stride)..end.div_ceil(stride);
                    dynamic_mask[row / stride * sampled_width..][sampled].fill(true);
                }
                if matches!(kind, PixelKind::Background | PixelKind::Carried) {
                    continue;
                }
                let accumulator = &mut accumulators[id];
                accumulator.add_run(row, from, end);
                let is_person = kind == PixelKind::Person;
                let range_m = if is_person { PERSON_RANGE_M } else { OBJECT_RANGE_M };
                let squares = &mut accumulator.squares;
                // A local copy stays in registers.
                let mut points = accumulator.points;
                let mut add = |column: usize| {
                    if depth[column] < range_m {
                        let p = rays.point(column, row, depth[column]);
                        points.add(p);
                        if p.y <= FOOTPRINT_HEIGHT_M {
                            let (x, z) = (p.x / FOOTPRINT_M, p.z / FOOTPRINT_M);
                            let square = [round_to_i16(x), round_to_i16(z)];
                            if known_squares.insert(id, square) {
                                squares.push(square);
                            }
                        }
                    }
                };
                if kind == PixelKind::Small {
                    (from..end).for_each(add);
                } else if row % coarse_stride == 0 {
                    let first = from.next_multiple_of(coarse_stride);
                    (first..end).step_by(coarse_stride).for_each(&mut add);
                }
                accumulator.points = points;
            }
        }
        (accumulators, dynamic_mask)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use chaic_core::geom::yaw_rotation;
    use chaic_core::rng::RngStream;

    use super::*;

    /// Measures one segment without runs and without the cache of squares. The pixel is left out.
    fn reference_measure(
        segments: &Segments<'_>,
        id: usize,
        kind: PixelKind,
    ) -> Option<SegmentMeasurement> {
        let Segments { segment_ids, depth_m, camera, .. } = *segments;
        if matches!(kind, PixelKind::Background | PixelKind::Carried) {
            return None;
        }
        let (rays, width) = (Rays::new(camera), camera.width as usize);
        let stride = (width / MIN_SAMPLES_PER_ROW).max(STRIDE as usize);
        let range_m = if kind == PixelKind::Person { PERSON_RANGE_M } else { OBJECT_RANGE_M };
        let (mut n_pixels, mut n_points, mut sum) = (0, 0, Vec3::ZERO);
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut squares = BTreeSet::new();
        for i in (0..segment_ids.len()).filter(|i| usize::from(segment_ids[*i]) == id) {
            n_pixels += 1;
            let (row, column) = (i / width, i % width);
            let is_sampled = row.is_multiple_of(stride) && column.is_multiple_of(stride);
            if depth_m[i] < range_m && (is_sampled || kind == PixelKind::Small) {
                let p = rays.point(column, row, depth_m[i]);
                n_points += 1;
                sum += p;
                (low, high) = (low.min(p.y), high.max(p.y));
                if p.y <= FOOTPRINT_HEIGHT_M {
                    squares.insert([p.x, p.z].map(|v| (v / FOOTPRINT_M).round() as i16));
                }
            }
        }
        let point = |[x, z]: [i16; 2]| FOOTPRINT_M * Vec2::new(f32::from(x), f32::from(z));
        (n_pixels >= MIN_PIXELS && n_points > 0).then(|| SegmentMeasurement {
            pixel: [0, 0],
            position_in_world: sum / n_points as f32,
            bottom_m: low,
            top_m: high,
            n_pixels,
            footprint: squares.into_iter().map(point).collect(),
        })
    }

    #[test]
    fn measurements_of_random_images_equal_plain_ones() {
        let kinds = [
            PixelKind::Background,
            PixelKind::Carried,
            PixelKind::Small,
            PixelKind::Movable,
            PixelKind::Person,
            PixelKind::Fixed,
            PixelKind::Small,
            PixelKind::Fixed,
        ];
        let mut n_points = 0;
        for seed in 0..24 {
            let mut rng = RngStream::new(seed, "segments", 0);
            let (width, height) = ([64, 301, 515][rng.below(3)], 48);
            let eye_x = [0.0, -3.7, 4095.5, -5000.0][rng.below(4)];
            let camera = Camera {
                eye_in_world: Vec3::new(eye_x, 1.6, 2.3),
                world_from_camera: yaw_rotation(rng.range(-3.0, 3.0)),
                vertical_fov_rad: 0.3,
                width,
                height,
            };
            // Runs at nearly equal depth repeat squares; the range of depths exceeds the window of
            // the cache.
            let (mut ids, mut depth) = (Vec::new(), Vec::new());
            let n_pixels = (width * height) as usize;
            while ids.len() < n_pixels {
                // Also ids without a kind.
                let (id, depth_m) = (rng.below(kinds.len() + 1) as u16, rng.range(0.2, 11.0));
                for _ in 0..1 + rng.below(80) {
                    ids.push(id);
                    depth.push(match rng.below(40) {
                        0 => f32::NAN,
                        1 => f32::INFINITY,
                        2 => 0.0,
                        _ => depth_m + rng.range(0.0, 0.2),
                    });
                }
            }
            ids.truncate(n_pixels);
            depth.truncate(n_pixels);
            let segments =
                Segments { segment_ids: &ids, depth_m: &depth, camera: &camera, kinds: &kinds };
            let (mut measured, _) = segments.measure();
            measured.iter_mut().flatten().for_each(|segment| segment.pixel = [0, 0]);
            for (id, kind) in kinds.into_iter().enumerate() {
                assert_eq!(measured[id], reference_measure(&segments, id, kind), "{seed} {id}");
                n_points += measured[id].as_ref().map_or(0, |segment| segment.footprint.len());
            }
        }
        assert!(n_points > 5_000, "{n_points} points");
    }

    #[test]
    fn squares_are_new_once_until_another_square_has_their_place() {
        let mut cache = Box::new(SquareCache::EMPTY);
        for x in -32..32 {
            assert!((-32..32).all(|z| cache.insert(3, [x, z])));
            assert!((-32..32).all(|z| !cache.insert(3, [x, z])));
        }
        assert!(!cache.insert(3, [-32, -32]) && !cache.insert(3, [31, 31]));
        assert!(cache.insert(4, [0, 0]) && cache.insert(3, [0, 0]), "another segment");
        assert!(cache.insert(3, [64, 0]) && cache.insert(3, [0, 0]), "another window");
    }

    #[test]
    fn rounding_equals_that_of_the_standard_library() {
        let special =
            [f32::NAN, f32::INFINITY, -1e9, 0.49999997, -0.49999997, -0.0, 32767.5, 8388609.0];
        let regular = (-4000..4000).map(|k| k as f32 * 0.0625);
        for x in regular.chain(special) {
            assert_eq!(round_to_i16(x), x.round() as i16, "{x}");
        }
    }

    #[test]
    fn runs_end_where_the_ids_change() {
        for n in 0..70usize {
            let mut ids = vec![7; n];
            assert_eq!(run_length(&ids), n);
            ids.extend([8, 7, 7]);
            assert_eq!(run_length(&ids), n.max(1));
        }
    }
}
