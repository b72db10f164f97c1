//! Surface textures: small tiles of brightness, baked once from integer noise, sampled with
//! smaller copies for what is far away. Also the conversion between sRGB and linear light.

use std::sync::{LazyLock, OnceLock};

use chaic_protocol::geom::math;

/// What a surface looks like close up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Texture {
    Plain,
    Plaster,
    Brushed,
    Grain,
    Weave,
    Wicker,
    Mottle,
    Crust,
    Planks,
    Tiles,
    Carpet,
    Asphalt,
    Pavement,
    Grass,
}

const N_TEXTURES: usize = 14;
/// Texels along a tile's side; a power of two.
const SIDE: usize = 128;
const LEVELS: usize = 8;

/// A square of brightness that repeats, 128 meaning unchanged.
pub(crate) struct Tile {
    texels_per_m: f32,
    texels: Vec<u8>,
    /// Where each level begins.
    begins: [usize; LEVELS],
    /// Texels per metre of each level.
    scales: [f32; LEVELS],
}

static TILES: [OnceLock<Tile>; N_TEXTURES] = [const { OnceLock::new() }; N_TEXTURES];

impl Texture {
    /// The tile, if the surface has any texture.
    pub fn tile(self) -> Option<&'static Tile> {
        (self != Texture::Plain).then(|| TILES[self as usize].get_or_init(|| bake(self)))
    }

    /// Side of the square that repeats, metres.
    fn period_m(self) -> f32 {
        match self {
            Texture::Plain => 1.0,
            Texture::Plaster => 0.9,
            Texture::Brushed => 0.25,
            Texture::Grain => 0.6,
            Texture::Weave => 0.08,
            Texture::Wicker => 0.16,
            Texture::Mottle => 0.12,
            Texture::Crust => 0.16,
            Texture::Planks => 1.6,
            Texture::Tiles => 1.2,
            Texture::Carpet => 0.6,
            Texture::Asphalt => 1.0,
            Texture::Pavement => 1.6,
            Texture::Grass => 1.2,
        }
    }

    /// Brightness around 1 at a point of the tile given in [0, 1).
    fn brightness(self, u: f32, v: f32) -> f32 {
        let fine = |amount: f32, seed: u32| amount * (noise(u, v, 64, 64, seed) - 0.5);
        let broad = |amount: f32, seed: u32| amount * (clouds(u, v, 4, seed) - 0.5);
        match self {
            Texture::Plain => 1.0,
            Texture::Plaster => 1.0 + broad(0.05, 1) + fine(0.03, 2),
            Texture::Brushed => 1.0 + 0.14 * (noise(u, v, 3, 90, 3) - 0.5),
            Texture::Grain => grain(u, v, 4),
            Texture::Weave => {
                let (a, b) = (wave(u * 16.0), wave(v * 16.0));
                0.9 + 0.16 * a.max(b) + fine(0.08, 5)
            }
            Texture::Wicker => wicker(u, v),
            Texture::Mottle => 1.0 + broad(0.28, 7) + fine(0.06, 8),
            Texture::Crust => 1.0 + 0.45 * (clouds(u, v, 6, 9) - 0.5) + fine(0.12, 10),
            Texture::Planks => planks(u, v),
            Texture::Tiles => {
                let gap = joint(u * 4.0, 0.018).min(joint(v * 4.0, 0.018));
                let tint = 0.06 * (cell(u * 4.0, v * 4.0, 4, 11) - 0.5);
                (0.72 + 0.28 * gap) * (1.0 + tint) + broad(0.04, 12)
            }
            Texture::Carpet => 1.0 + fine(0.3, 13) + broad(0.1, 14),
            Texture::Asphalt => 1.0 + fine(0.36, 15) + broad(0.16, 16),
            Texture::Pavement => {
                let row = (v * 4.0) as u32;
                let x = u * 2.0 + 0.5 * (row % 2) as f32;
                let gap = joint(x, 0.012).min(joint(v * 4.0, 0.024));
                let tint = 0.12 * (cell(x % 2.0, v * 4.0, 4, 17) - 0.5);
                (0.7 + 0.3 * gap) * (1.0 + tint) + fine(0.1, 18)
            }
            Texture::Grass => {
                let blades = noise(u, v, 64, 24, 19) + noise(u, v, 24, 64, 20);
                0.68 + 0.3 * blades + broad(0.4, 21)
            }
        }
    }
}

fn grain(u: f32, v: f32, seed: u32) -> f32 {
    let bend = noise(u, v, 2, 4, seed);
    let rings = wave(7.0 * v + 1.6 * bend);
    0.9 + 0.13 * rings + 0.12 * (noise(u, v, 4, 60, seed + 100) - 0.5)
}

fn wicker(u: f32, v: f32) -> f32 {
    let (i, j) = ((u * 8.0) as u32, (v * 8.0) as u32);
    let (x, y) = if (i + j) % 2 == 0 { (u, v) } else { (v, u) };
    let across = (y * 8.0) % 1.0 - 0.5;
    let along = (x * 8.0) % 1.0 - 0.5;
    1.18 - 1.5 * across * across - 0.9 * along * along
}

fn planks(u: f32, v: f32) -> f32 {
    // Twelve rows of planks, each of one plank a tile, shifted against each other.
    let row = (v * 12.0) as u32;
    let shift = hash(row, 77, 22) as f32 / u32::MAX as f32;
    let x = u + shift;
    let gap = joint(v * 12.0, 0.03).min(joint(x, 0.003));
    let tint = 0.16 * (hash(row, 5, 23) as f32 / u32::MAX as f32 - 0.5);
    let lines = 0.14 * (noise(x % 1.0, v, 6, 96, 24) - 0.5);
    (0.72 + 0.28 * gap) * (1.0 + tint + lines)
}

/// 0 within `half_width` of a whole number, 1 elsewhere.
fn joint(x: f32, half_width: f32) -> f32 {
    let d = (x % 1.0).min(1.0 - x % 1.0);
    if d < half_width { 0.0 } else { 1.0 }
}

/// A triangle wave of period 1, smoothed, 0 to 1.
fn wave(x: f32) -> f32 {
    let t = (2.0 * (x - (x as i32) as f32) - 1.0).abs();
    t * t * (3.0 - 2.0 * t)
}

fn hash(x: u32, y: u32, seed: u32) -> u32 {
    let mut h =
        x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// A number in [0, 1) per unit cell.
fn cell(x: f32, y: f32, period: u32, seed: u32) -> f32 {
    hash(x as u32 % period, y as u32 % period, seed) as f32 / 4_294_967_296.0
}

/// Smooth noise in [0, 1) with `nu` by `nv` cells per tile.
fn noise(u: f32, v: f32, nu: u32, nv: u32, seed: u32) -> f32 {
    let (x, y) = (u * nu as f32, v * nv as f32);
    let (i, j) = (x as u32, y as u32);
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (ease(x - i as f32), ease(y - j as f32));
    let at = |di: u32, dj: u32| hash((i + di) % nu, (j + dj) % nv, seed) as f32 / 4_294_967_296.0;
    let low = at(0, 0) + (at(1, 0) - at(0, 0)) * fx;
    let high = at(0, 1) + (at(1, 1) - at(0, 1)) * fx;
    low + (high - low) * fy
}

fn clouds(u: f32, v: f32, n: u32, seed: u32) -> f32 {
    0.55 * noise(u, v, n, n, seed)
        + 0.3 * noise(u, v, 2 * n, 2 * n, seed + 40)
        + 0.15 * noise(u, v, 4 * n, 4 * n, seed + 80)
}

fn bake(texture: Texture) -> Tile {
    let mut texels = Vec::with_capacity(SIDE * SIDE * 3 / 2);
    let mut begins = [0; LEVELS];
    for j in 0..SIDE {
        for i in 0..SIDE {
            let at = |k: usize| (k as f32 + 0.5) / SIDE as f32;
            texels.push((128.0 * texture.brightness(at(i), at(j))).clamp(0.0, 255.0) as u8);
        }
    }
    for level in 1..LEVELS {
        begins[level] = texels.len();
        let (from, side) = (begins[level - 1], SIDE >> level);
        for j in 0..side {
            for i in 0..side {
                let at = |di: usize, dj: usize| {
                    u32::from(texels[from + (2 * j + dj) * 2 * side + 2 * i + di])
                };
                let sum = at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1);
                texels.push(((sum + 2) / 4) as u8);
            }
        }
    }
    let texels_per_m = SIDE as f32 / texture.period_m();
    let scales = std::array::from_fn(|level| texels_per_m / (1u32 << level) as f32);
    Tile { texels_per_m, texels, begins, scales }
}

impl Tile {
    /// Brightness around 1 at a point given in metres, for a pixel that covers `pixel_m`.
    #[inline]
    pub fn sample(&self, u_m: f32, v_m: f32, pixel_m: f32) -> f32 {
        let covered = (pixel_m * self.texels_per_m).clamp(1.0, 128.0);
        let level = ((covered.to_bits() >> 23) as usize - 127).min(LEVELS - 1);
        let side = SIDE >> level;
        let (u, v) = (u_m * self.scales[level], v_m * self.scales[level]);
        let ((i, fu), (j, fv)) = (split(u), split(v));
        let mask = side - 1;
        let (i0, i1) = (i as usize & mask, i.wrapping_add(1) as usize & mask);
        let (j0, j1) = (j as usize & mask, j.wrapping_add(1) as usize & mask);
        let level_texels = &self.texels[self.begins[level]..][..side * side];
        let at = |i: usize, j: usize| f32::from(level_texels[j * side + i]);
        let low = at(i0, j0) + (at(i1, j0) - at(i0, j0)) * fu;
        let high = at(i0, j1) + (at(i1, j1) - at(i0, j1)) * fu;
        (low + (high - low) * fv) * (1.0 / 128.0)
    }
}

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let s = k as f32 / 255.0;
        if s <= 0.040_45 { s / 12.92 } else { math::powf((s + 0.055) / 1.055, 2.4) }
    })
});

const N_SRGB: usize = 4096;

/// From linear light in [0, 1], in steps of 1 / 4095, to sRGB.
pub(crate) static SRGB: LazyLock<Box<[u8; N_SRGB]>> = LazyLock::new(|| {
    Box::new(std::array::from_fn(|k| {
        let x = k as f32 / (N_SRGB - 1) as f32;
        let s = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * math::powf(x, 1.0 / 2.4) - 0.055 };
        (255.0 * s + 0.5) as u8
    }))
});

/// Linear light of an sRGB color.
pub(crate) fn linear_from_srgb(srgb: [u8; 3]) -> [f32; 3] {
    srgb.map(|s| LINEAR[usize::from(s)])
}

/// 1.5 * 2^23: a number below 2^22 added to it has its whole part in the sum's low bits. Cheaper
/// than a cast, which must mind numbers that don't fit.
const WHOLE: f32 = 12_582_912.0;

/// The whole number at or next below `x` (|x| < 2^22) and how far `x` is above it, 0 to 1.
#[inline]
pub(crate) fn split(x: f32) -> (i32, f32) {
    let sum = (x - 0.5) + WHOLE;
    (sum.to_bits().wrapping_sub(WHOLE.to_bits()) as i32, x - (sum - WHOLE))
}

/// sRGB of linear light; too bright is white.
#[inline]
pub(crate) fn srgb_from_linear(table: &[u8; N_SRGB], x: f32) -> u8 {
    let x = if x < 1.0 { x } else { 1.0 };
    let x = if x > 0.0 { x } else { 0.0 };
    let k = (x * (N_SRGB - 1) as f32 + WHOLE).to_bits() as usize;
    table[k % N_SRGB]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_survives_the_way_through_linear_light() {
        for s in 0..=255u8 {
            let [x, ..] = linear_from_srgb([s; 3]);
            assert!(srgb_from_linear(&SRGB, x).abs_diff(s) <= 1, "{s}");
        }
    }

    #[test]
    fn textures_are_subtle_and_fade_to_their_mean_far_away() {
        for texture in [Texture::Grain, Texture::Wicker, Texture::Tiles, Texture::Grass] {
            let tile = texture.tile().expect("has a texture");
            let far = tile.sample(3.3, -7.1, 10.0);
            assert!((0.7..1.3).contains(&far), "{texture:?}: {far}");
            assert_eq!(far, tile.sample(-120.0, 55.5, 10.0), "{texture:?}");
            let near = (0..500).map(|k| tile.sample(0.0037 * k as f32, 0.0021 * k as f32, 1e-4));
            let (low, high) = near.fold((9.0f32, 0.0f32), |(l, h), x| (l.min(x), h.max(x)));
            assert!(high - low > 0.05 && high - low < 0.9, "{texture:?}: {low} to {high}");
        }
    }
}
