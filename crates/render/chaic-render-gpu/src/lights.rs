//! The light of worlds.

use std::ops::Range;

use chaic_render::lighting::{Cells, Lighting};

use crate::device::Link;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::LightRecord;

/// The light of each world.
#[derive(Debug)]
pub(crate) struct Lights {
    pub records: Pool<LightRecord>,
    pub lamps: Pool<[f32; 4]>,
    /// Two cells a word, of each brightness and room; each row begins with a word.
    pub cells: Pool<[u8; 4]>,
}

/// The light of a world on the device.
#[derive(Debug, Default)]
pub(crate) struct PlacedLight {
    pub record: Range<u32>,
    lamps: Range<u32>,
    cells: Range<u32>,
    /// Of the ground's cells: [`Cells::version`], and the rows that were touched.
    version: u64,
    touched: Vec<Range<usize>>,
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
        let lamps = self.lamps.add(link, &places.collect::<Vec<_>>())?;
        let cells = self.cells.add(link, &words(ground, 0..ground.n_z))?;
        let record = LightRecord {
            to_sun: light.to_sun,
            ceiling_m: light.ceiling_m.unwrap_or(NO_CEILING_M),
            sun: light.sun,
            first_lamp: lamps.start,
            lamp: light.lamp,
            n_lamps: lamps.end - lamps.start,
            outdoors_high: light.outdoors[0],
            first_cell: cells.start,
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
        let (version, touched) = (ground.version, ground.touched().collect());
        Ok(PlacedLight { record, lamps, cells, version, touched })
    }

    /// Brings a later moment of the same scene onto the device: what has changed of the ground.
    pub fn update(&self, link: &Link, placed: &mut PlacedLight, light: &Lighting) {
        let ground = &light.cells;
        let mut changed = std::mem::replace(&mut placed.touched, ground.touched().collect());
        let is_same = std::mem::replace(&mut placed.version, ground.version) == ground.version;
        changed.extend(placed.touched.iter().cloned());
        if !is_same {
            changed.push(0..ground.n_z);
        }
        changed.sort_unstable_by_key(|rows| rows.start);
        let mut done = 0;
        for Range { start, end } in changed {
            let rows = start.max(done)..end;
            if !rows.is_empty() {
                done = rows.end;
                let first = placed.cells.start + (rows.start * words_in_row(ground)) as u32;
                self.cells.write(link, first, &words(ground, rows));
            }
        }
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

/// Words that a row of cells takes: two cells each, the last one maybe of one.
fn words_in_row(cells: &Cells) -> usize {
    cells.n_x.div_ceil(2)
}

/// Rows of cells as they lie on the device.
fn words(cells: &Cells, rows: Range<usize>) -> Vec<[u8; 4]> {
    let mut words = vec![[0; 4]; rows.len() * words_in_row(cells)];
    for (z, words) in rows.zip(words.chunks_mut(words_in_row(cells))) {
        let pairs = cells.brightness(z).zip(cells.rooms(z));
        for (x, (bright, room)) in pairs.enumerate() {
            let k = 2 * (x % 2);
            words[x / 2][k..k + 2].copy_from_slice(&[bright, *room]);
        }
    }
    words
}

/// A ceiling so high that it darkens no wall.
const NO_CEILING_M: f32 = 1e6;
