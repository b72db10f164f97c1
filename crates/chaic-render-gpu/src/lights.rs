//! The light of worlds.

use std::ops::Range;

use chaic_render::lighting::Lighting;

use crate::device::Link;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::LightRecord;

/// The light of each world.
#[derive(Debug)]
pub(crate) struct Lights {
    pub records: Pool<LightRecord>,
    pub lamps: Pool<[f32; 4]>,
    /// Two cells a word, of each brightness and room.
    pub cells: Pool<[u8; 4]>,
}

/// The light of a world on the device.
#[derive(Debug, Default)]
pub(crate) struct PlacedLight {
    pub record: Range<u32>,
    lamps: Range<u32>,
    cells: Range<u32>,
}

impl Lights {
    pub fn new(link: &Link) -> Result<Lights, GpuError> {
        Ok(Lights {
            records: Pool::new(link, "lights", 1 << 8)?,
            lamps: Pool::new(link, "lamps", 1 << 10)?,
            cells: Pool::new(link, "the ground", 1 << 18)?,
        })
    }

    /// Brings the light of a world onto the device.
    pub fn add(&mut self, link: &Link, light: &Lighting) -> Result<PlacedLight, GpuError> {
        let places = light.lamps_in_world.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]);
        let ground = &light.cells;
        let mut cells = Vec::with_capacity(ground.brightness.len().div_ceil(2));
        for (bright, rooms) in ground.brightness.chunks(2).zip(ground.rooms.chunks(2)) {
            let last = bright.len() - 1;
            cells.push([bright[0], rooms[0], bright[last], rooms[last]]);
        }
        let lamps = self.lamps.add(link, &places.collect::<Vec<_>>())?;
        let cells = self.cells.add(link, &cells)?;
        let record = LightRecord {
            to_sun: light.to_sun,
            ceiling_m: light.ceiling_m.unwrap_or(NO_CEILING_M),
            sun: light.sun,
            first_lamp: lamps.start,
            lamp: light.lamp,
            n_lamps: lamps.end - lamps.start,
            outdoors_high: light.outdoors[0],
            first_cell: 2 * cells.start,
            outdoors_low: light.outdoors[1],
            n_x: ground.n_x as u32,
            indoors_high: light.indoors[0],
            n_z: ground.n_z as u32,
            indoors_low: light.indoors[1],
            cells_per_m: ground.cells_per_m,
            horizon: light.sky[0],
            min_x: ground.min[0],
            zenith: light.sky[1],
            min_z: ground.min[1],
            below: light.sky[2],
            padding: 0,
        };
        let record = self.records.add(link, &[record])?;
        Ok(PlacedLight { record, lamps, cells })
    }

    /// Takes the light of a world off the device.
    pub fn remove(&mut self, light: PlacedLight) {
        self.records.remove(light.record);
        self.lamps.remove(light.lamps);
        self.cells.remove(light.cells);
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.records.bytes() + self.lamps.bytes() + self.cells.bytes()
    }
}

/// A ceiling so high that it darkens no wall.
const NO_CEILING_M: f32 = 1e6;
