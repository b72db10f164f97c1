//! The light of a moment: what shines, and shadows on the ground.

use std::sync::OnceLock;

use chaic_core::Vec2;

use crate::ground::{Foot, Ground, MAX_CELLS, N_GROUND};
use crate::light_rig::LightRig;

/// The light at one moment.
pub(crate) struct Light<'a> {
    pub ground: &'a Ground,
    pub rig: &'a LightRig,
    /// None if nobody looks at color.
    pub shadows: Option<Shadows>,
    /// Of which arrangement of still things the shadows are.
    pub version: u64,
}

/// Shadows on the ground.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shadows {
    /// Darkness per cell, 0 to 255.
    dark: Vec<u8>,
    /// Brightness of the ground, four neighbors a cell as in [`crate::texture::Atlas`], 255
    /// unshaded; rows of [`MAX_CELLS`], and one more that is unshaded. Empty until it is asked for.
    quads: Vec<u32>,
    /// Where something was added: cells from the first x and z to the last.
    touched: Vec<[usize; 4]>,
}

impl Shadows {
    /// Those of walls.
    pub fn of_walls(ground: &Ground) -> Shadows {
        Shadows { dark: ground.walls.clone(), ..Shadows::default() }
    }

    /// Brightness of the ground in quads, once it is worked out.
    pub fn quads(&self) -> Option<&[u32; N_GROUND]> {
        self.quads.first_chunk()
    }

    /// The quads of a row along x, and what is beyond the ground; none before they are worked out.
    pub fn row(&self, z: usize) -> &[u32] {
        self.quads.get(z * MAX_CELLS..(z + 1) * MAX_CELLS).unwrap_or_default()
    }

    /// Where something was added: cells from the first x and z to the last.
    pub fn touched(&self) -> &[[usize; 4]] {
        &self.touched
    }

    /// Works out the brightness where it has changed.
    fn finish(&mut self, ground: &Ground) {
        if self.quads.is_empty() {
            self.quads.resize(N_GROUND, u32::MAX);
            self.touched.clear();
            self.brighten(ground, [0, 0, ground.nx - 1, ground.nz - 1]);
            return;
        }
        for k in 0..self.touched.len() {
            self.brighten(ground, self.touched[k]);
        }
    }

    /// Works out the brightness of quads that show any of these cells.
    fn brighten(&mut self, ground: &Ground, [x0, z0, x1, z1]: [usize; 4]) {
        let Ground { nx, nz, .. } = *ground;
        let (x0, z0) = (x0.saturating_sub(1), z0.saturating_sub(1));
        let roots = roots();
        let bright = |row: &[u8], i: usize| roots[usize::from(row[i])];
        for z in z0..=z1 {
            let row = |j: usize| &self.dark[j * nx..][..nx];
            let (here, below) = (row(z), row((z + 1).min(nz - 1)));
            let quads = &mut self.quads[z * MAX_CELLS..][x0..=x1];
            for (x, quad) in (x0..=x1).zip(quads) {
                let right = (x + 1).min(nx - 1);
                *quad = bright(here, x)
                    | bright(here, right) << 8
                    | bright(below, x) << 16
                    | bright(below, right) << 24;
            }
        }
    }

    /// Takes back what was added to these shadows.
    pub fn restore(&mut self, from: &Shadows, ground: &Ground) {
        for [x0, z0, x1, z1] in std::mem::take(&mut self.touched) {
            for z in z0.saturating_sub(1)..=z1 {
                let cells = z * ground.nx + x0..=z * ground.nx + x1;
                self.dark[cells.clone()].copy_from_slice(&from.dark[cells]);
                let quads = z * MAX_CELLS + x0.saturating_sub(1)..=z * MAX_CELLS + x1;
                self.quads[quads.clone()].copy_from_slice(&from.quads[quads]);
            }
        }
    }
}

/// What is shown of light, its root, for each darkness; 255 for none.
fn roots() -> &'static [u32; 256] {
    static ROOTS: OnceLock<[u32; 256]> = OnceLock::new();
    let root = |dark: usize| (255.0 * (1.0 - dark as f32 / 255.0).sqrt()) as u32;
    ROOTS.get_or_init(|| std::array::from_fn(root))
}

impl<'a> Light<'a> {
    /// Light with these shadows on the ground, or none if nobody looks at color.
    pub fn new(ground: &'a Ground, rig: &'a LightRig, shadows: Option<Shadows>) -> Light<'a> {
        Light { ground, rig, shadows, version: 0 }
    }

    /// Adds the shadow of a foot.
    pub fn cast(&mut self, foot: &Foot) {
        let is_sane = foot.center.is_finite() && foot.half.max_element() < 50.0;
        if let (Some(shadows), true) = (&mut self.shadows, is_sane) {
            let cells = self.ground.darken(&mut shadows.dark, foot);
            shadows.touched.push(cells);
        }
    }

    /// Adds the sun's shadow of something upright, out of doors: as long as it is high, as wide as
    /// it is on average.
    pub fn cast_by_sun(&mut self, center: Vec2, half: Vec2, height_m: f32) {
        /// Higher things are slender at the top: trees, lamps.
        const LONGEST_M: f32 = 5.0;
        let sun = self.rig.to_sun;
        if self.ground.ceiling_m.is_some() || sun.y < 0.05 {
            return;
        }
        let away = Vec2::new(-sun.x, -sun.z);
        let flat = (away.x * away.x + away.y * away.y).sqrt();
        if flat < 1e-3 {
            return;
        }
        let axis = away / flat;
        let length = (height_m * flat / sun.y).min(LONGEST_M);
        let wide = 0.5 * (half.x + half.y);
        let half = Vec2::new(0.5 * length + 0.5 * wide, wide);
        let center = center + axis * (0.5 * length);
        self.cast(&Foot { center, axis, half, depth: 0.5, round: false });
    }

    /// Makes the ground ready; to be called when all shadows are cast.
    pub fn finish(&mut self) {
        if let Some(shadows) = &mut self.shadows {
            shadows.finish(self.ground);
        }
    }
}
