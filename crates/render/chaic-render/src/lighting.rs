//! The light of a moment as plain data, for other renderers; see [`crate::geometry::Shapes`]. Colors
//! are linear, 0 to 1.

use std::ops::Range;

use chaic_core::Vec3;

use crate::ground::Ground;
use crate::light::{Light, Shadows};

/// What shines on a scene at one moment.
#[derive(Clone, Debug)]
pub struct Lighting<'a> {
    /// Unit vector to the sun.
    pub to_sun: [f32; 3],
    /// The sun.
    pub sun: [f32; 3],
    /// A room's lamp, at no distance.
    pub lamp: [f32; 3],
    /// Light from above and from below, out of doors.
    pub outdoors: [[f32; 3]; 2],
    /// The same in a room.
    pub indoors: [[f32; 3]; 2],
    /// The sky at the horizon and in the zenith, and the ground below the horizon.
    pub sky: [[f32; 3]; 3],
    /// Height of the ceiling, metres.
    pub ceiling_m: Option<f32>,
    /// Where the lamp of each room hangs, metres.
    pub lamps_in_world: Vec<[f32; 3]>,
    /// The ground.
    pub cells: Cells<'a>,
}

/// The ground as a grid; shape [n_z, n_x].
#[derive(Clone, Debug)]
pub struct Cells<'a> {
    /// Where the first cell begins (x, z), metres.
    pub min: [f32; 2],
    /// Cells along a metre.
    pub cells_per_m: f32,
    /// Number of cells along x.
    pub n_x: usize,
    /// Number of cells along z.
    pub n_z: usize,
    /// Counts what has become of the shadows of all that lies still. Between two moments of a scene
    /// for which it is the same, only [`Cells::touched`] of either differ.
    pub version: u64,
    ground: &'a Ground,
    shadows: Option<&'a Shadows>,
}

impl Cells<'_> {
    /// Index of the room of each cell in a row along x; 255 for none.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn rooms(&self, z: usize) -> &[u8] {
        self.ground.rooms_in_row(z)
    }

    /// How bright the middle of each cell in a row is, darker near walls and the feet of things:
    /// factors on what is shown, the root of linear light; 255 unshaded.
    pub fn brightness(&self, z: usize) -> impl Iterator<Item = u8> {
        let row = self.shadows.map_or(&[][..], |shadows| shadows.row(z));
        (0..self.n_x).map(|x| row.get(x).map_or(u8::MAX, |quad| *quad as u8))
    }

    /// Rows with shadows of what moves; some may overlap.
    pub fn touched(&self) -> impl Iterator<Item = Range<usize>> {
        let touched = self.shadows.map_or(&[][..], Shadows::touched);
        touched.iter().map(|[_, first, _, last]| *first..last + 1)
    }
}

impl Lighting<'_> {
    /// What shines on a frame that was made to be looked at in color.
    pub(crate) fn of<'a>(light: &'a Light) -> Lighting<'a> {
        let (rig, ground) = (light.rig, light.ground);
        let (cells_per_m, min) = ground.grid();
        Lighting {
            to_sun: rig.to_sun.to_array(),
            sun: rig.sun.to_array(),
            lamp: rig.lamp.to_array(),
            outdoors: rig.outdoors.map(|c| c.to_array()),
            indoors: rig.indoors.map(|c| c.to_array()),
            sky: rig.sky.map(|c| c.to_array()),
            ceiling_m: ground.ceiling_m,
            lamps_in_world: ground.lamps().iter().map(Vec3::to_array).collect(),
            cells: Cells {
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
