//! Lighting of worlds on the device.

use std::ops::Range;

use chaic_render::lighting::{GroundCells, Lighting};

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::LightRecord;

/// Lighting of all worlds.
#[derive(Debug)]
pub(crate) struct Lights {
    pub records: Pool<LightRecord>,
    pub lamps: Pool<[f32; 4]>,
    /// Ground cells: brightness and room of two cells per word; each row begins with a new word.
    pub cells: Pool<[u8; 4]>,
}

/// Lighting of one world on the device.
#[derive(Debug, Default)]
pub(crate) struct PlacedLight {
    pub record: Range<u32>,
    lamps: Range<u32>,
    cells: Range<u32>,
    /// State of the ground cells: [`GroundCells::version`] and [`GroundCells::changed_rows`].
    version: u64,
    changed_rows: Vec<Range<usize>>,
}

impl Lights {
    pub fn new(context: &GpuContext) -> Result<Lights, GpuError> {
        Ok(Lights {
            records: Pool::new(context, "lights", 1 << 8)?,
            lamps: Pool::new(context, "lamps", 1 << 10)?,
            cells: Pool::new(context, "ground cells", 1 << 18)?,
        })
    }

    /// Uploads the lighting of a world. Frees its ranges after an error.
    pub fn add(&mut self, context: &GpuContext, light: &Lighting) -> Result<PlacedLight, GpuError> {
        let mut placed = PlacedLight::default();
        match self.fill(context, light, &mut placed) {
            Ok(()) => Ok(placed),
            Err(error) => {
                self.remove(placed);
                Err(error)
            }
        }
    }

    fn fill(
        &mut self,
        context: &GpuContext,
        light: &Lighting,
        placed: &mut PlacedLight,
    ) -> Result<(), GpuError> {
        let lamp_records = light.lamps_in_world.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]);
        let ground = &light.cells;
        placed.lamps = self.lamps.add(context, &lamp_records.collect::<Vec<_>>())?;
        placed.cells = self.cells.add(context, &words(ground, 0..ground.n_z))?;
        let record = LightRecord {
            to_sun: light.to_sun,
            ceiling_m: light.ceiling_m.unwrap_or(NO_CEILING_M),
            sun: light.sun,
            first_lamp: placed.lamps.start,
            lamp: light.lamp,
            n_lamps: placed.lamps.end - placed.lamps.start,
            outdoors_high: light.outdoors[0],
            first_cell: placed.cells.start,
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
        placed.record = self.records.add(context, &[record])?;
        placed.version = ground.version;
        placed.changed_rows = ground.changed_rows().collect();
        Ok(())
    }

    /// Uploads the changed ground cells of another frame of the same scene.
    pub fn update(&self, context: &GpuContext, placed: &mut PlacedLight, light: &Lighting) {
        let ground = &light.cells;
        let mut changed =
            std::mem::replace(&mut placed.changed_rows, ground.changed_rows().collect());
        let is_same_version =
            std::mem::replace(&mut placed.version, ground.version) == ground.version;
        changed.extend(placed.changed_rows.iter().cloned());
        if !is_same_version {
            changed.push(0..ground.n_z);
        }
        changed.sort_unstable_by_key(|rows| rows.start);
        let mut end_of_written = 0;
        for Range { start, end } in changed {
            let rows = start.max(end_of_written)..end;
            if !rows.is_empty() {
                end_of_written = rows.end;
                let first = placed.cells.start + (rows.start * words_in_row(ground)) as u32;
                self.cells.write(context, first, &words(ground, rows));
            }
        }
    }

    /// Removes the lighting of a world.
    pub fn remove(&mut self, light: PlacedLight) {
        self.records.remove(light.record);
        self.lamps.remove(light.lamps);
        self.cells.remove(light.cells);
    }

    /// Size on the device, bytes.
    pub fn bytes(&self) -> u64 {
        self.records.bytes() + self.lamps.bytes() + self.cells.bytes()
    }
}

/// Number of words in a row of cells: two cells per word, rounded up.
fn words_in_row(cells: &GroundCells) -> usize {
    cells.n_x.div_ceil(2)
}

/// Packs rows of cells into device words.
fn words(cells: &GroundCells, rows: Range<usize>) -> Vec<[u8; 4]> {
    let mut words = vec![[0; 4]; rows.len() * words_in_row(cells)];
    for (z, words) in rows.zip(words.chunks_mut(words_in_row(cells))) {
        let pairs = cells.brightness(z).zip(cells.rooms(z));
        for (x, (brightness, room)) in pairs.enumerate() {
            let k = 2 * (x % 2);
            words[x / 2][k..k + 2].copy_from_slice(&[brightness, *room]);
        }
    }
    words
}

/// Ceiling height that darkens no wall, for worlds without ceiling.
const NO_CEILING_M: f32 = 1e6;
