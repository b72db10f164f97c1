//! Color, depth and ids of pixels whose triangles are known, one row of the image at a time.
//!
//! Neighboring pixels of one triangle are a run. Its colors and texture coordinates are worked out
//! at knots at most [`STEP`] pixels apart and run linearly between; the texture is looked up for
//! each pixel. Lanes are plain arrays, which the compiler makes vectors of, as wide as the
//! machine's (see [`Rows`]); each lane's operations stay the same.

use chaic_protocol::EntityId;
use chaic_protocol::geom::Camera;
use glam::Vec4;

use crate::frame::Frame;
use crate::lens::Lens;
use crate::light::{MAX_CELLS, N_GROUND};
use crate::paint::{Kind, Paint, Painter, Rays, Sight};
use crate::raster::{NOBODY, Target, owner_parts};
use crate::texture::{Atlas, Level, N_ATLAS, PLAIN, Tile, atlas};

/// Most pixels between two knots.
const STEP: usize = 32;

/// Buffers for shading, used again and again.
#[derive(Default)]
pub(crate) struct Canvas {
    /// Where each triangle's paint is, by [`crate::draw::Work::firsts`]; [`EMPTY`] if not there.
    slots: Vec<u32>,
    paints: Vec<Paint>,
    sights: Vec<Option<Sight>>,
    row: Row,
}

/// The pixels of one row, each array longer by a step than the row is.
#[derive(Default)]
struct Row {
    /// What is shown but for textures, 0 to 255.
    colors: [Vec<f32>; 3],
    /// The texel in the atlas, and how far the pixel is from it to the right (low 16 bits) and
    /// down, in parts of 256.
    texel: Vec<u32>,
    within: Vec<u32>,
    /// The same on the ground's grid.
    cell: Vec<u32>,
    within_cell: Vec<u32>,
    /// Red in the lowest byte, then green and blue.
    packed: Vec<u32>,
}

const EMPTY: u32 = u32::MAX;

/// The images of a view that are wanted; shape [height, width], colors [height, width, 3].
pub(crate) struct Wanted<'a> {
    pub rgb: &'a mut [u8],
    pub depth_m: Option<&'a mut [f32]>,
    pub ids: Option<&'a mut [u16]>,
}

/// What is drawn: instances with the level and the number of the first triangle of each.
pub(crate) struct Drawn<'a> {
    pub levels: &'a [u8],
    pub firsts: &'a [u32],
    pub n_triangles: usize,
}

impl<'a> Drawn<'a> {
    /// What has just been drawn.
    pub fn of(work: &'a crate::draw::Work) -> Drawn<'a> {
        Drawn { levels: &work.levels, firsts: &work.firsts, n_triangles: work.n_triangles }
    }
}

/// Shades a view.
pub(crate) fn shade(
    frame: &Frame,
    lens: &Lens,
    drawn: &Drawn,
    target: &Target<u32>,
    canvas: &mut Canvas,
    wanted: Wanted,
) {
    canvas.slots.clear();
    canvas.slots.resize(drawn.n_triangles, EMPTY);
    canvas.paints.clear();
    canvas.sights.clear();
    canvas.sights.resize(frame.instances.len(), None);
    canvas.row.resize(lens.width);
    let painter = Painter { frame, is_plan: lens.is_plan, rays: Rays::of(lens) };
    pulp::Arch::new().dispatch(Rows {
        painter,
        lens,
        drawn,
        target,
        canvas,
        wanted,
        atlas: atlas(),
        has_floor: false,
    });
}

/// All rows of an image, compiled for each kind of vectors and called for the widest that the
/// machine has.
struct Rows<'a> {
    painter: Painter<'a>,
    lens: &'a Lens,
    drawn: &'a Drawn<'a>,
    target: &'a Target<u32>,
    canvas: &'a mut Canvas,
    wanted: Wanted<'a>,
    atlas: &'static Atlas,
    /// Whether the row under way shows any floor.
    has_floor: bool,
}

impl pulp::NullaryFnOnce for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let width = self.lens.width;
        if width == 0 {
            return;
        }
        for j in 0..self.lens.height {
            let line = j * width..(j + 1) * width;
            let nearness = &self.target.nearness[line.clone()];
            if let Some(depth) = &mut self.wanted.depth_m {
                depths(nearness, &mut depth[line.clone()]);
            }
            let owners = &self.target.owner[line.clone()];
            self.has_floor = false;
            let mut begin = 0;
            while begin < width {
                let owner = owners[begin];
                let end = begin + run_length(&owners[begin..], owner);
                let id = self.run(j, begin, end, owner, nearness);
                if let Some(ids) = &mut self.wanted.ids {
                    ids[line.start + begin..line.start + end].fill(id);
                }
                begin = end;
            }
            let ground = self.painter.frame.light.quads.first_chunk().filter(|_| self.has_floor);
            self.canvas.row.pack(self.atlas, ground);
            let out = &mut self.wanted.rgb[3 * line.start..3 * line.end];
            write(&self.canvas.row.packed, out);
        }
    }
}

/// How many pixels at the beginning have this owner.
#[inline(always)]
fn run_length(owners: &[u32], owner: u32) -> usize {
    let mut n = 0;
    for chunk in owners.as_chunks::<STEP>().0 {
        if chunk.iter().fold(0, |other, o| other | (o ^ owner)) != 0 {
            break;
        }
        n += STEP;
    }
    n + owners[n..].iter().take_while(|o| **o == owner).count()
}

/// Depths of nearnesses of an eye; what is farther than can be seen is as far as that.
#[inline(always)]
fn depths(nearness: &[f32], depths: &mut [f32]) {
    let far = 1.0 / Camera::FAR_M;
    for (q, depth) in nearness.iter().zip(depths) {
        *depth = if *q > far { 1.0 / *q } else { Camera::FAR_M };
    }
}

/// Writes three bytes for each color.
#[inline(always)]
fn write(colors: &[u32], out: &mut [u8]) {
    for (pixel, color) in out.chunks_exact_mut(3).zip(colors) {
        let [r, g, b, _] = color.to_le_bytes();
        pixel.copy_from_slice(&[r, g, b]);
    }
}

impl Row {
    fn resize(&mut self, width: usize) {
        // A whole number of steps, and one more for what is written beyond a run's end.
        let n = width.div_ceil(STEP) * STEP + STEP;
        self.colors.iter_mut().for_each(|c| c.resize(n, 0.0));
        let Row { texel, within, cell, within_cell, packed, .. } = self;
        for array in [texel, within, cell, within_cell, packed] {
            array.resize(n, 0);
        }
    }

    /// Mixes textures into colors. Plain loops over a whole number of steps, so that no pixel is
    /// left for a slower one.
    #[inline(always)]
    fn pack(&mut self, atlas: &Atlas, ground: Option<&[u32; N_GROUND]>) {
        let n = self.packed.len() / STEP * STEP;
        let [r, g, b] = &mut self.colors;
        let (r, g, b) = (&mut r[..n], &mut g[..n], &mut b[..n]);
        let (texel, within) = (&self.texel[..n], &self.within[..n]);
        let packed = &mut self.packed[..n];
        if let Some(ground) = ground {
            let (cell, within_cell) = (&self.cell[..n], &self.within_cell[..n]);
            for k in 0..n {
                let quad = ground[(cell[k] as usize).min(N_GROUND - 1)];
                let bright = mixed(quad, within_cell[k]) * (1.0 / (255.0 * 65536.0));
                r[k] *= bright;
                g[k] *= bright;
                b[k] *= bright;
            }
        }
        for k in 0..n {
            let quad = atlas[texel[k] as usize % N_ATLAS];
            let bright = mixed(quad, within[k]) * (1.0 / (128.0 * 65536.0));
            packed[k] =
                whole(r[k] * bright) | whole(g[k] * bright) << 8 | whole(b[k] * bright) << 16;
        }
    }
}

/// A number from 0 to 255 without its fraction; more is 255.
#[inline(always)]
fn whole(x: f32) -> u32 {
    let x = if x < 255.0 { x } else { 255.0 };
    // 2^23 added, a number has its whole part in the lowest bits.
    (x + 8_388_608.0).to_bits() & 0xff
}

/// Mixes the four bytes of a quad by how far right (low 16 bits) and down the point is; 65,536
/// times their mean.
#[inline(always)]
fn mixed(quad: u32, within: u32) -> f32 {
    let (right, down) = (within & 0xffff, within >> 16);
    let (left_bytes, right_bytes) = (quad & 0x00ff_00ff, quad >> 8 & 0x00ff_00ff);
    let rows = left_bytes * (256 - right) + right_bytes * right;
    let (above, below) = (rows & 0xffff, rows >> 16);
    (above * (256 - down) + below * down) as i32 as f32
}

/// What runs linearly between two knots.
#[derive(Clone, Copy)]
struct Knot {
    /// What is shown, 0 to 255.
    color: Vec4,
    /// Texture coordinates, metres.
    texture: Vec4,
    /// Cells on the ground's grid; NaN for what isn't ground.
    ground: (f32, f32),
    /// Side of the patch that the pixel covers, metres.
    covers_m: f32,
}

impl Knot {
    #[inline(always)]
    fn plain(color: Vec4) -> Knot {
        Knot { color, texture: Vec4::ZERO, ground: (f32::NAN, f32::NAN), covers_m: 0.0 }
    }

    /// With texture coordinates and their slopes, for a pixel that covers `straight_m` seen
    /// straight on.
    #[inline(always)]
    fn textured(mut self, (texture, slope): (Vec4, Vec4), straight_m: f32) -> Knot {
        self.texture = texture;
        // Seen at a slant it covers more; the root keeps textures from blurring too early.
        self.covers_m = straight_m / slope.z.abs().max(0.05).sqrt();
        self
    }
}

impl Rows<'_> {
    /// Colors the run of pixels `begin..end` of row `j`; tells whose it is.
    #[inline(always)]
    fn run(&mut self, j: usize, begin: usize, end: usize, owner: u32, nearness: &[f32]) -> u16 {
        let v = j as f32 + 0.5;
        if owner == NOBODY {
            let (painter, row) = (&self.painter, &mut self.canvas.row);
            ramps(row, begin, end, None, |k| Knot::plain(painter.sky(k as f32 + 0.5, v)));
            return EntityId::NOTHING.0;
        }
        let at = self.find_paint(owner);
        let Canvas { paints, row, .. } = &mut *self.canvas;
        let paint = &paints[at];
        let (color, texture) = (paint.color.row(v), paint.texture.row(v));
        let (painter, lens) = (&self.painter, self.lens);
        let per_px = 1.0 / lens.focal;
        match paint.kind {
            Kind::Even if paint.tile.is_none() => {
                let knot = Knot::plain(paint.low);
                ramps(row, begin, end, None, |_| knot);
            }
            Kind::Even | Kind::Smooth => ramps(row, begin, end, paint.tile, |k| {
                let (u, depth) = (k as f32 + 0.5, lens.depth(nearness[k]));
                let w = if lens.is_plan { 1.0 } else { depth };
                let color = color.at(u, w).0.clamp(paint.low, paint.high);
                Knot::plain(color).textured(texture.at(u, w), w * per_px)
            }),
            Kind::Structure { floor } => {
                self.has_floor |= floor;
                ramps(row, begin, end, paint.tile, |k| {
                    let (u, depth) = (k as f32 + 0.5, lens.depth(nearness[k]));
                    let w = if lens.is_plan { 1.0 } else { depth };
                    let (p, ray) = painter.rays.point(u, v, depth);
                    let mut knot = Knot::plain(painter.shown_structure(paint, p, ray));
                    if floor {
                        knot.ground = painter.frame.light.on_ground(p.x, p.z);
                    }
                    knot.textured(texture.at(u, w), w * per_px)
                });
            }
        }
        paint.entity
    }

    /// Where the paint of a triangle is; worked out when first asked for.
    #[inline(always)]
    fn find_paint(&mut self, owner: u32) -> usize {
        let (index, triangle) = owner_parts(owner);
        let slot = self.drawn.firsts[index] as usize + triangle;
        let known = self.canvas.slots[slot];
        if known != EMPTY {
            return known as usize;
        }
        let paint = self.new_paint(index, triangle);
        self.canvas.slots[slot] = self.canvas.paints.len() as u32;
        self.canvas.paints.push(paint);
        self.canvas.paints.len() - 1
    }

    #[inline(never)]
    fn new_paint(&mut self, index: usize, triangle: usize) -> Paint {
        let instance = &self.painter.frame.instances[index];
        let mesh = instance.shape.mesh(usize::from(self.drawn.levels[index]));
        let sight = self.canvas.sights[index].get_or_insert_with(|| self.painter.sight(instance));
        self.painter.paint(instance, sight, mesh, &mesh.triangles[triangle])
    }
}

/// 1 / n for a distance of n pixels; 0 for none.
const PER_PIXEL: [f32; STEP + 1] = {
    let mut table = [0.0; STEP + 1];
    let mut n = 1;
    while n <= STEP {
        table[n] = 1.0 / n as f32;
        n += 1;
    }
    table
};

/// Fills a run from knot to knot.
#[inline(always)]
fn ramps(
    row: &mut Row,
    begin: usize,
    end: usize,
    tile: Option<Tile>,
    knot: impl Fn(usize) -> Knot,
) {
    let mut from = begin;
    let mut here = knot(from);
    loop {
        let left = end - from;
        let (next, distance) = if left > STEP { (from + STEP, STEP) } else { (end - 1, left - 1) };
        let there = if distance == 0 { here } else { knot(next) };
        let ramp = Ramp { here, there, per_pixel: PER_PIXEL[distance], tile };
        if left > 16 {
            ramp.fill::<STEP>(row, from);
        } else if left > 8 {
            ramp.fill::<16>(row, from);
        } else if left > 4 {
            ramp.fill::<8>(row, from);
        } else {
            ramp.fill::<4>(row, from);
        }
        if left <= STEP {
            break;
        }
        (from, here) = (next, there);
    }
}

/// From one knot towards the next.
struct Ramp {
    here: Knot,
    there: Knot,
    /// One pixel's share of the way.
    per_pixel: f32,
    tile: Option<Tile>,
}

impl Ramp {
    /// Writes N pixels; those behind the run's end are written again by the next run.
    #[inline(always)]
    fn fill<const N: usize>(&self, row: &mut Row, from: usize) {
        let (here, there) = (self.here.color.to_array(), self.there.color.to_array());
        for (c, channel) in row.colors.iter_mut().enumerate() {
            let step = (there[c] - here[c]) * self.per_pixel;
            fill::<f32, N>(channel, from, |k| here[c] + step * k as f32);
        }
        if let Some(tile) = self.tile {
            let Level { begin, log2_side, texels_per_m } = tile.level(self.here.covers_m);
            let scale = 256.0 * texels_per_m;
            let [u, v, ..] = self.here.texture.to_array();
            let [u_end, v_end, ..] = self.there.texture.to_array();
            // Middles of texels lie at halves.
            let u = Steps::new(u * scale - 128.0, (u_end - u) * scale * self.per_pixel);
            let v = Steps::new(v * scale - 128.0, (v_end - v) * scale * self.per_pixel);
            let mask = (1u32 << log2_side) - 1;
            fill::<u32, N>(&mut row.texel, from, |k| {
                begin + ((v.at(k) >> 8 & mask) << log2_side) + (u.at(k) >> 8 & mask)
            });
            fill::<u32, N>(&mut row.within, from, |k| u.at(k) & 0xff | (v.at(k) & 0xff) << 16);
        } else {
            fill::<u32, N>(&mut row.texel, from, |_| PLAIN);
        }
        let ((x, z), (x_end, z_end)) = (self.here.ground, self.there.ground);
        if x.is_nan() {
            fill::<u32, N>(&mut row.cell, from, |_| N_GROUND as u32 - 1);
            return;
        }
        let x = Steps::new(256.0 * x, 256.0 * (x_end - x) * self.per_pixel);
        let z = Steps::new(256.0 * z, 256.0 * (z_end - z) * self.per_pixel);
        let inside = |t: u32| (t as i32).clamp(0, 256 * (MAX_CELLS as i32 - 1)) as u32;
        fill::<u32, N>(&mut row.cell, from, |k| {
            (inside(z.at(k)) >> 8) * MAX_CELLS as u32 + (inside(x.at(k)) >> 8)
        });
        fill::<u32, N>(&mut row.within_cell, from, |k| {
            inside(x.at(k)) & 0xff | (inside(z.at(k)) & 0xff) << 16
        });
    }
}

#[inline(always)]
fn fill<T, const N: usize>(array: &mut [T], from: usize, value: impl Fn(usize) -> T) {
    if let Some(lanes) = array[from..].first_chunk_mut::<N>() {
        for (k, lane) in lanes.iter_mut().enumerate() {
            *lane = value(k);
        }
    }
}

/// Equal steps in whole numbers.
#[derive(Clone, Copy)]
struct Steps {
    start: u32,
    step: u32,
}

impl Steps {
    #[inline(always)]
    fn new(start: f32, step: f32) -> Steps {
        // 64 bits hold what any sane picture needs; the low ones are those that count.
        Steps { start: start as i64 as u32, step: step as i64 as u32 }
    }

    #[inline(always)]
    fn at(&self, k: usize) -> u32 {
        self.start.wrapping_add(self.step.wrapping_mul(k as u32))
    }
}
