//! From pixels that belong together to where their thing is.

use chaic_core::geom::Camera;
use chaic_core::{ClassId, Role, Vec2, Vec3};

/// Fewer pixels than this are no detection (facts A1.8).
pub const MIN_PIXELS: u32 = 5;
/// Every how many rows and columns it is looked at what says nothing of the room.
pub const STRIDE: u32 = 2;
/// A row of an image is measured at so many points at least, as far as large things go: at 5 m they
/// are 8 cm apart then, less than points of a footprint.
const MEASURED_PER_ROW: usize = 128;
/// Points farther than this say nothing of where an object is, metres (facts A1.1).
const OBJECT_RANGE_M: f32 = 10.0;
/// People are seen from anywhere (facts A1.8: whoever is in the image is placed where it is).
const PERSON_RANGE_M: f32 = f32::INFINITY;
/// Points higher than this belong to no footprint: nobody bumps into them, metres.
const FOOTPRINT_HEIGHT_M: f32 = 2.0;
/// Spacing of footprint points, metres.
const FOOTPRINT_M: f32 = 0.125;

/// How the pixels of a segment are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelKind {
    /// Structure, or something that is not to be reported.
    Firm,
    /// Own burden.
    Own,
    /// Small: every pixel counts.
    Small,
    /// Large and movable.
    Movable,
    /// A person.
    Person,
    /// Large and fixed.
    Fixed,
}

impl PixelKind {
    /// The kind of a class.
    pub fn of(class: ClassId) -> PixelKind {
        match class.info().role {
            Role::Person => PixelKind::Person,
            Role::Target | Role::Container | Role::Fragile => PixelKind::Small,
            Role::Obstacle | Role::HeavyTarget | Role::Vehicle => PixelKind::Movable,
            Role::Furnishing => PixelKind::Fixed,
        }
    }
}

/// What the pixels of one segment tell of its thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    /// Column and row of a pixel that shows it.
    pub pixel: [u32; 2],
    /// Mean of its visible points, metres.
    pub position_in_world: Vec3,
    /// Height of its lowest visible point, metres.
    pub bottom_m: f32,
    /// Height of its highest visible point, metres.
    pub top_m: f32,
    /// How many pixels show it.
    pub n_pixels: u32,
    /// Its visible points seen from above (x, z), at most one per 0.125 m square.
    pub footprint: Vec<Vec2>,
}

/// An image cut into segments.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    /// Which segment each pixel is of, shape [height, width].
    pub of_pixels: &'a [u16],
    /// Depth in metres, shape [height, width].
    pub depth_m: &'a [f32],
    /// The camera.
    pub camera: &'a Camera,
    /// How each segment is looked at, by number; segments beyond are firm.
    pub kinds: &'a [PixelKind],
}

impl Segments<'_> {
    /// The extent of each segment, by number, `None` of those with fewer than [`MIN_PIXELS`] pixels or
    /// none in range; and [`Percepts::dynamic_mask`].
    ///
    /// [`Percepts::dynamic_mask`]: super::Percepts::dynamic_mask
    pub fn measure(&self) -> (Vec<Option<Extent>>, Vec<bool>) {
        let (ids, depth, width) = (self.of_pixels, self.depth_m, self.camera.width as usize);
        let rays = Rays::new(self.camera);
        let measure = Measure { ids, depth, width, kinds: self.kinds, rays: &rays };
        let (tallies, dynamic_mask) = pulp::Arch::new().dispatch(measure);
        (tallies.into_iter().map(Tally::extent).collect(), dynamic_mask)
    }
}

/// Sums over the pixels of one thing.
struct Tally {
    n_pixels: u32,
    n_points: u32,
    sum: Vec3,
    low: f32,
    high: f32,
    squares: Vec<[i16; 2]>,
    /// The longest run of pixels, and its middle.
    longest: u32,
    pixel: [u32; 2],
}

impl Tally {
    const NEW: Tally = Tally {
        longest: 0,
        pixel: [0, 0],
        n_pixels: 0,
        n_points: 0,
        sum: Vec3::ZERO,
        low: f32::INFINITY,
        high: f32::NEG_INFINITY,
        squares: Vec::new(),
    };

    #[inline(always)]
    fn add(&mut self, p: Vec3) {
        self.n_points += 1;
        self.sum += p;
        self.low = self.low.min(p.y);
        self.high = self.high.max(p.y);
        if p.y <= FOOTPRINT_HEIGHT_M {
            let square = [nearest_whole(p.x / FOOTPRINT_M), nearest_whole(p.z / FOOTPRINT_M)];
            if self.squares.last() != Some(&square) {
                self.squares.push(square);
            }
        }
    }

    #[inline(always)]
    fn run(&mut self, row: usize, from: usize, end: usize) {
        let n = (end - from) as u32;
        self.n_pixels += n;
        if n > self.longest {
            self.longest = n;
            self.pixel = [(from + end) as u32 / 2, row as u32];
        }
    }

    fn extent(mut self) -> Option<Extent> {
        if self.n_pixels < MIN_PIXELS || self.n_points == 0 {
            return None;
        }
        self.squares.sort_unstable();
        self.squares.dedup();
        Some(Extent {
            pixel: self.pixel,
            position_in_world: self.sum / self.n_points as f32,
            bottom_m: self.low,
            top_m: self.high,
            n_pixels: self.n_pixels,
            footprint: self
                .squares
                .iter()
                .map(|s| FOOTPRINT_M * Vec2::new(f32::from(s[0]), f32::from(s[1])))
                .collect(),
        })
    }
}

/// Rounds half away from zero, as `f32::round` does in a call to the C library for every point.
#[inline(always)]
fn nearest_whole(x: f32) -> i16 {
    let x = x.clamp(-40_000.0, 40_000.0);
    let whole = x as i32;
    let rest = x - whole as f32;
    let whole = whole + i32::from(rest >= 0.5) - i32::from(rest <= -0.5);
    whole.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
}

/// How many of the first ids are the same.
#[inline(always)]
fn run_length(ids: &[u16]) -> usize {
    const AT_ONCE: usize = 32;
    let Some(first) = ids.first() else { return 0 };
    let same = |chunk: &&[u16]| chunk.iter().fold(true, |same, id| same & (id == first));
    let n = AT_ONCE * ids.chunks_exact(AT_ONCE).take_while(same).count();
    n + ids[n..].iter().take_while(|id| *id == first).count()
}

/// Directions through pixel centers per metre of depth: the world point of a pixel is
/// `eye + depth * (column + row)`.
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

/// A walk over the pixels of one image, compiled for vectors of each width: the sums over each thing,
/// and [`Percepts::dynamic_mask`].
struct Measure<'a> {
    ids: &'a [u16],
    depth: &'a [f32],
    width: usize,
    kinds: &'a [PixelKind],
    rays: &'a Rays,
}

impl pulp::NullaryFnOnce for Measure<'_> {
    type Output = (Vec<Tally>, Vec<bool>);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Measure { ids, depth, width, kinds, rays } = self;
        let height = rays.rows.len();
        let stride = STRIDE as usize;
        let coarse_stride = (width / MEASURED_PER_ROW).max(stride);
        let mut tallies: Vec<Tally> = kinds.iter().map(|_| Tally::NEW).collect();
        let sampled_width = width.div_ceil(stride);
        let mut dynamic_mask = vec![false; sampled_width * height.div_ceil(stride)];
        for row in 0..height {
            let (ids, depth) = (&ids[row * width..][..width], &depth[row * width..][..width]);
            let on_row = row % stride == 0;
            let mut end = 0;
            while end < width {
                let from = end;
                end += run_length(&ids[from..]);
                let id = usize::from(ids[from]);
                let kind = kinds.get(id).copied().unwrap_or(PixelKind::Firm);
                if on_row && !matches!(kind, PixelKind::Firm | PixelKind::Fixed) {
                    let sampled = from.div_ceil(stride)..end.div_ceil(stride);
                    dynamic_mask[row / stride * sampled_width..][sampled].fill(true);
                }
                if matches!(kind, PixelKind::Firm | PixelKind::Own) {
                    continue;
                }
                let tally = &mut tallies[id];
                tally.run(row, from, end);
                let is_person = kind == PixelKind::Person;
                let range_m = if is_person { PERSON_RANGE_M } else { OBJECT_RANGE_M };
                let mut add = |column: usize| {
                    if depth[column] < range_m {
                        tally.add(rays.point(column, row, depth[column]));
                    }
                };
                if kind == PixelKind::Small {
                    (from..end).for_each(add);
                } else if row % coarse_stride == 0 {
                    let first = from.next_multiple_of(coarse_stride);
                    (first..end).step_by(coarse_stride).for_each(&mut add);
                }
            }
        }
        (tallies, dynamic_mask)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_as_the_library_does() {
        let odd =
            [f32::NAN, f32::INFINITY, -1e9, 0.49999997, -0.49999997, -0.0, 32767.5, 8388609.0];
        let usual = (-4000..4000).map(|k| k as f32 * 0.0625);
        for x in usual.chain(odd) {
            assert_eq!(nearest_whole(x), x.round() as i16, "{x}");
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
