//! The light of a moment as plain data, for other renderers; see [`crate::geometry::Shapes`]. Colors
//! are linear, 0 to 1.

use chaic_protocol::Vec3;

use crate::light::Light;

/// What shines on a scene at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting {
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
    pub cells: Cells,
}

/// The ground as a grid; shapes are [n_z, n_x].
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    /// Where the first cell begins (x, z), metres.
    pub min: [f32; 2],
    /// Cells along a metre.
    pub cells_per_m: f32,
    /// Number of cells along x.
    pub n_x: usize,
    /// Number of cells along z.
    pub n_z: usize,
    /// Index of the room of each cell; 255 for none.
    pub rooms: Vec<u8>,
    /// How bright the middle of each cell is, darker near walls and the feet of things: factors on
    /// what is shown, the root of linear light; 255 unshaded.
    pub brightness: Vec<u8>,
}

impl Lighting {
    /// What shines on a frame that was made to be looked at in color.
    pub(crate) fn of(light: &Light) -> Lighting {
        let lamps = light.lamps;
        Lighting {
            to_sun: lamps.to_sun.to_array(),
            sun: lamps.sun.to_array(),
            lamp: lamps.lamp.to_array(),
            outdoors: lamps.outdoors.map(|c| c.to_array()),
            indoors: lamps.indoors.map(|c| c.to_array()),
            sky: lamps.sky.map(|c| c.to_array()),
            ceiling_m: light.ground.ceiling_m,
            lamps_in_world: light.ground.lamps().iter().map(Vec3::to_array).collect(),
            cells: light.cells(),
        }
    }
}
