//! Lighting of one frame as plain data, for other renderers; see [`crate::shapes::Shapes`].
//! Colors are linear, 0 to 1.

use std::ops::Range;

use chaic_core::Vec3;

use crate::ground::Ground;
use crate::light::{Light, Shadows};

/// Lighting of a scene at one frame.
#[derive(Clone, Debug)]
pub struct Lighting<'a> {
    /// Unit vector to the sun.
    pub to_sun: [f32; 3],
    /// Light of the sun.
    pub sun: [f32; 3],
    /// Light of a room's lamp at distance 0.
    pub lamp: [f32; 3],
    /// Ambient light from above and from below, outdoors.
    pub outdoors: [[f32; 3]; 2],
    /// Ambient light from above and from below, indoors.
    pub indoors: [[f32; 3]; 2],
    /// Sky at the horizon, sky at the zenith, ground below the horizon.
    pub sky: [[f32; 3]; 3],
    /// Height of the ceiling, meters.
    pub ceiling_m: Option<f32>,
    /// Position of each room's lamp, meters.
    pub lamps_in_world: Vec<[f32; 3]>,
    /// Ground grid with shadows.
    pub cells: GroundCells<'a>,
}

/// The ground as a grid; shape [n_z, n_x].
#[derive(Clone, Debug)]
pub struct GroundCells<'a> {
    /// Corner of the first cell (x, z), meters.
    pub min: [f32; 2],
    /// Number of cells per meter.
    pub cells_per_m: f32,
    /// Number of cells along x.
    pub n_x: usize,
    /// Number of cells along z.
    pub n_z: usize,
    /// Version of the static shadows. Two frames of a scene with the same version differ only in
    /// the rows of [`GroundCells::changed_rows`].
    pub version: u64,
    ground: &'a Ground,
    shadows: Option<&'a Shadows>,
}

impl GroundCells<'_> {
    /// Returns the room index of each cell in a row along x; 255 for none.
    ///
    /// # Panics
    /// If `z` is out of range.
    pub fn rooms(&self, z: usize) -> &[u8] {
        self.ground.rooms_in_row(z)
    }

    /// Returns the brightness of each cell in a row, darker near walls and objects. Values are
    /// factors on display colors (square roots of linear light); 255 is unshaded.
    pub fn brightness(&self, z: usize) -> impl Iterator<Item = u8> {
        let row = self.shadows.map_or(&[][..], |shadows| shadows.row(z));
        (0..self.n_x).map(|x| row.get(x).map_or(u8::MAX, |quad| *quad as u8))
    }

    /// Returns the ranges of rows with shadows of moving objects; they may overlap.
    pub fn changed_rows(&self) -> impl Iterator<Item = Range<usize>> {
        let changed_rows = self.shadows.map_or(&[][..], Shadows::changed);
        changed_rows.iter().map(|[_, first, _, last]| *first..last + 1)
    }
}

impl Lighting<'_> {
    /// Lighting of a frame that was prepared for color.
    pub(crate) fn from_light<'a>(light: &'a Light) -> Lighting<'a> {
        let (light_rig, ground) = (light.light_rig, light.ground);
        let (cells_per_m, min) = ground.grid();
        Lighting {
            to_sun: light_rig.to_sun.to_array(),
            sun: light_rig.sun.to_array(),
            lamp: light_rig.lamp.to_array(),
            outdoors: light_rig.outdoors.map(|c| c.to_array()),
            indoors: light_rig.indoors.map(|c| c.to_array()),
            sky: light_rig.sky.map(|c| c.to_array()),
            ceiling_m: ground.ceiling_m,
            lamps_in_world: ground.lamps().iter().map(Vec3::to_array).collect(),
            cells: GroundCells {
                min: min.to_array(),
                cells_per_m,
                n_x: ground.nx,
                n_z: ground.nz,
                version: light.version,
                ground,
                shadows: light.shadows.as_ref(),
            },
        }
    }
}
