//! The light of worlds, and the textures that all share.

use std::ops::Range;

use chaic_render::geometry::{TEXTURES, Texture, TileData, tile};
use chaic_render::lighting::Lighting;

use crate::device::Link;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::LightRecord;

/// Texels along a tile's side.
pub(crate) const TILE_TEXELS: usize = 128;

/// Every texture's tile at all sizes, on the device.
#[derive(Debug)]
pub(crate) struct Tiles {
    pub quads: wgpu::Buffer,
    /// Where each texture's tile begins, and its texels per metre.
    known: Vec<(Texture, u32, f32)>,
}

impl Tiles {
    pub fn new(link: &Link) -> Result<Tiles, GpuError> {
        let (mut quads, mut known) = (Vec::new(), Vec::new());
        for texture in TEXTURES {
            let Some(data) = tile(texture).filter(|t| t.side_texels == TILE_TEXELS) else {
                continue;
            };
            let scale = TILE_TEXELS as f32 / data.side_m;
            known.push((texture, quads.len() as u32, scale));
            add_levels(&data, &mut quads);
        }
        let quads = link.filled("textures", bytemuck::cast_slice(&quads))?;
        Ok(Tiles { quads, known })
    }

    /// Where a texture's tile begins, and its texels per metre; 0 without one.
    pub fn of(&self, texture: Texture) -> (u32, f32) {
        let found = self.known.iter().find(|(t, ..)| *t == texture);
        found.map_or((0, 0.0), |(_, first, scale)| (*first, *scale))
    }
}

/// The light of each world.
#[derive(Debug)]
pub(crate) struct Lights {
    pub records: Pool<LightRecord>,
    pub lamps: Pool<[f32; 4]>,
    /// Brightness, and the room in the second byte.
    pub cells: Pool<u32>,
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
        let cells = ground.brightness.iter().zip(&ground.rooms);
        let cells: Vec<u32> =
            cells.map(|(b, room)| u32::from(*b) | u32::from(*room) << 8).collect();
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

/// Adds a tile at all sizes down to one texel, each texel with its right, lower and lower right
/// neighbors.
fn add_levels(data: &TileData, quads: &mut Vec<u32>) {
    let mut side = data.side_texels;
    let mut texels: Vec<f32> = data.texels.iter().map(|t| f32::from(*t)).collect();
    loop {
        let at = |j: usize, i: usize| texels[j % side * side + i % side];
        let whole = |j: usize, i: usize| (at(j, i) + 0.5) as u32;
        quads.extend((0..side * side).map(|n| {
            let (j, i) = (n / side, n % side);
            whole(j, i) | whole(j, i + 1) << 8 | whole(j + 1, i) << 16 | whole(j + 1, i + 1) << 24
        }));
        if side == 1 {
            return;
        }
        side /= 2;
        texels = (0..side * side)
            .map(|n| {
                let (j, i) = (2 * (n / side), 2 * (n % side));
                let at = |dj: usize, di: usize| texels[(j + dj) * 2 * side + i + di];
                0.25 * (at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1))
            })
            .collect();
    }
}
