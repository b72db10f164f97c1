//! Lighting of one frame: light sources, and shadows on the ground.

use std::sync::OnceLock;

use chaic_core::Vec2;

use crate::ground::{Footprint, Ground, MAX_CELLS, N_GROUND};
use crate::light_rig::LightRig;

/// Lighting of one frame.
pub(crate) struct Light<'a> {
    pub ground: &'a Ground,
    pub light_rig: &'a LightRig,
    /// `None` if no view renders color.
    pub shadows: Option<Shadows>,
    /// Version of the static shadows on which `shadows` are based.
    pub version: u64,
}

/// Shadows on the ground.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shadows {
    /// Shadow per cell, 0 to 255.
    shadow: Vec<u8>,
    /// Brightness of the ground: four neighbors per cell as in [`crate::texture::Atlas`], 255
    /// unshaded. Rows of [`MAX_CELLS`], and one unshaded element at the end. Empty until it is
    /// requested.
    quads: Vec<u32>,
    /// Changed cells: first x, first z, last x, last z.
    changed: Vec<[usize; 4]>,
}

impl Shadows {
    /// Shadows of walls.
    pub fn from_walls(ground: &Ground) -> Shadows {
        Shadows { shadow: ground.wall_shadows.clone(), ..Shadows::default() }
    }

    /// Returns the brightness of the ground; `None` before it is computed.
    pub fn quads(&self) -> Option<&[u32; N_GROUND]> {
        self.quads.first_chunk()
    }

    /// Returns the brightness of a row along x; empty before it is computed.
    pub fn row(&self, z: usize) -> &[u32] {
        self.quads.get(z * MAX_CELLS..(z + 1) * MAX_CELLS).unwrap_or_default()
    }

    /// Returns the changed cells: first x, first z, last x, last z.
    pub fn changed(&self) -> &[[usize; 4]] {
        &self.changed
    }

    /// Updates the brightness of changed cells.
    fn finish(&mut self, ground: &Ground) {
        if self.quads.is_empty() {
            self.quads.resize(N_GROUND, u32::MAX);
            self.changed.clear();
            self.update_brightness(ground, [0, 0, ground.nx - 1, ground.nz - 1]);
            return;
        }
        for k in 0..self.changed.len() {
            self.update_brightness(ground, self.changed[k]);
        }
    }

    /// Computes the brightness of the quads that contain any of these cells.
    fn update_brightness(&mut self, ground: &Ground, [x0, z0, x1, z1]: [usize; 4]) {
        let Ground { nx, nz, .. } = *ground;
        let (x0, z0) = (x0.saturating_sub(1), z0.saturating_sub(1));
        let brightness_table = brightness_table();
        let brightness = |row: &[u8], i: usize| brightness_table[usize::from(row[i])];
        for z in z0..=z1 {
            let row = |j: usize| &self.shadow[j * nx..][..nx];
            let (here, below) = (row(z), row((z + 1).min(nz - 1)));
            let quads = &mut self.quads[z * MAX_CELLS..][x0..=x1];
            for (x, quad) in (x0..=x1).zip(quads) {
                let right = (x + 1).min(nx - 1);
                *quad = brightness(here, x)
                    | brightness(here, right) << 8
                    | brightness(below, x) << 16
                    | brightness(below, right) << 24;
            }
        }
    }

    /// Reverts the changed cells to the static shadows.
    pub fn restore(&mut self, from: &Shadows, ground: &Ground) {
        for [x0, z0, x1, z1] in std::mem::take(&mut self.changed) {
            for z in z0.saturating_sub(1)..=z1 {
                let cells = z * ground.nx + x0..=z * ground.nx + x1;
                self.shadow[cells.clone()].copy_from_slice(&from.shadow[cells]);
                let quads = z * MAX_CELLS + x0.saturating_sub(1)..=z * MAX_CELLS + x1;
                self.quads[quads.clone()].copy_from_slice(&from.quads[quads]);
            }
        }
    }
}

/// Square root of the remaining light for each shadow value; 255 is unshaded.
fn brightness_table() -> &'static [u32; 256] {
    static TABLE: OnceLock<[u32; 256]> = OnceLock::new();
    let entry = |shadow: usize| (255.0 * (1.0 - shadow as f32 / 255.0).sqrt()) as u32;
    TABLE.get_or_init(|| std::array::from_fn(entry))
}

impl<'a> Light<'a> {
    /// Lighting with these shadows on the ground; `None` if no view renders color.
    pub fn new(ground: &'a Ground, light_rig: &'a LightRig, shadows: Option<Shadows>) -> Light<'a> {
        Light { ground, light_rig, shadows, version: 0 }
    }

    /// Adds the contact shadow of a footprint.
    pub fn splat_contact_shadow(&mut self, footprint: &Footprint) {
        let is_valid = footprint.center.is_finite() && footprint.half_extent.max_element() < 50.0;
        if let (Some(shadows), true) = (&mut self.shadows, is_valid) {
            let cells = self.ground.splat_shadow(&mut shadows.shadow, footprint);
            shadows.changed.push(cells);
        }
    }

    /// Adds the sun shadow of an upright object, outdoors only. Its length follows from the height,
    /// its width from the mean of the half extents.
    pub fn cast_sun_shadow(&mut self, center: Vec2, half_extent: Vec2, height_m: f32) {
        /// Limit of the length, meters: tall objects such as trees and lamps are thin at the top.
        const MAX_SHADOW_M: f32 = 5.0;
        let sun = self.light_rig.to_sun;
        if self.ground.ceiling_m.is_some() || sun.y < 0.05 {
            return;
        }
        let away = Vec2::new(-sun.x, -sun.z);
        let horizontal = (away.x * away.x + away.y * away.y).sqrt();
        if horizontal < 1e-3 {
            return;
        }
        let axis = away / horizontal;
        let length = (height_m * horizontal / sun.y).min(MAX_SHADOW_M);
        let half_width = 0.5 * (half_extent.x + half_extent.y);
        let half_extent = Vec2::new(0.5 * length + 0.5 * half_width, half_width);
        let center = center + axis * (0.5 * length);
        self.splat_contact_shadow(&Footprint {
            center,
            axis,
            half_extent,
            strength: 0.5,
            is_round: false,
        });
    }

    /// Updates the brightness of the ground; call it after the last shadow.
    pub fn finish(&mut self) {
        if let Some(shadows) = &mut self.shadows {
            shadows.finish(self.ground);
        }
    }
}
