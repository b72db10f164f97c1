//! Surface textures: small brightness tiles with mip levels, generated once from integer noise.
//! Also conversion between display colors and linear light.

use std::sync::OnceLock;

/// Texture of a surface: a repeating brightness tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Texture {
    /// Constant brightness.
    Plain,
    /// Slightly uneven paint on a wall.
    Plaster,
    /// Brushed metal with fine lines.
    Brushed,
    /// Wood grain.
    Grain,
    /// Woven cloth.
    Weave,
    /// Wicker.
    Wicker,
    /// Blotches, as on the skin of a fruit.
    Mottle,
    /// Crust of bread.
    Crust,
    /// Floorboards.
    Planks,
    /// Square tiles with joints.
    Tiles,
    /// Carpet pile.
    Carpet,
    /// Asphalt.
    Asphalt,
    /// Paving stones with joints.
    Pavement,
    /// Grass.
    Grass,
}

const N_TEXTURES: usize = 14;
/// Texels along the side of a tile; a power of two.
pub(crate) const TILE_SIDE: usize = 128;
pub(crate) const MIP_LEVELS: usize = 8;

/// Texture atlas: repeating brightness tiles of all textures, each with all mip levels.
///
/// Each texel holds its neighbors for bilinear interpolation with one load: itself in the lowest
/// byte, then those to the right, below, and below to the right. 128 means factor 1. Texels are
/// square roots of factors on linear light, so that they apply to display colors.
pub(crate) type Atlas = [u32; N_ATLAS];

/// Texels of one tile at all mip levels.
const N_TILE: usize = (4 * TILE_SIDE * TILE_SIDE - 1) / 3;

/// A power of two with room for all tiles: an index needs a mask instead of a bounds check.
pub(crate) const N_ATLAS: usize = (N_TEXTURES * N_TILE).next_power_of_two();

/// Returns the atlas, which is generated on first use.
pub(crate) fn atlas() -> &'static Atlas {
    static ATLAS: OnceLock<Box<Atlas>> = OnceLock::new();
    ATLAS.get_or_init(|| {
        let mut texels = vec![0; N_ATLAS];
        for texture in Texture::ALL {
            bake(texture, &mut texels[Tile::new(texture).begin as usize..][..N_TILE]);
        }
        texels.into_boxed_slice().try_into().unwrap_or_else(|_| Box::new([0x8080_8080; N_ATLAS]))
    })
}

/// Position of a texture in the [`Atlas`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub begin: u32,
    pub texels_per_m: f32,
}

impl Tile {
    pub fn new(texture: Texture) -> Tile {
        let begin = texture as usize * N_TILE;
        Tile { begin: begin as u32, texels_per_m: TILE_SIDE as f32 / texture.period_m() }
    }

    /// Returns whether a texel belongs to the tile of [`Texture::Plain`], which has brightness 1.
    #[inline(always)]
    pub fn is_plain(texel: u32) -> bool {
        texel < N_TILE as u32
    }

    /// Returns the number of texels before a mip level: the sum of the first terms of 4^n, 4^(n-1),
    /// ...
    #[inline(always)]
    pub fn texels_before(level: u32) -> u32 {
        (4 * (TILE_SIDE * TILE_SIDE) as u32 - ((4 * (TILE_SIDE * TILE_SIDE) as u32) >> (2 * level)))
            / 3
    }
}

impl Texture {
    const ALL: [Texture; N_TEXTURES] = [
        Texture::Plain,
        Texture::Plaster,
        Texture::Brushed,
        Texture::Grain,
        Texture::Weave,
        Texture::Wicker,
        Texture::Mottle,
        Texture::Crust,
        Texture::Planks,
        Texture::Tiles,
        Texture::Carpet,
        Texture::Asphalt,
        Texture::Pavement,
        Texture::Grass,
    ];

    /// Returns the tile; `None` for [`Texture::Plain`].
    pub(crate) fn tile(self) -> Option<Tile> {
        (self != Texture::Plain).then(|| Tile::new(self))
    }

    /// Side of the repeating square, meters.
    pub fn period_m(self) -> f32 {
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

    /// Returns the brightness, around 1, at a point of the tile in [0, 1).
    fn brightness(self, u: f32, v: f32) -> f32 {
        let fine = |amount: f32, seed: u32| amount * (noise(u, v, 64, 64, seed) - 0.5);
        let broad = |amount: f32, seed: u32| amount * (fractal_noise(u, v, 4, seed) - 0.5);
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
            Texture::Crust => 1.0 + 0.45 * (fractal_noise(u, v, 6, 9) - 0.5) + fine(0.12, 10),
            Texture::Planks => planks(u, v),
            Texture::Tiles => {
                let gap = joint_mask(u * 4.0, 0.018).min(joint_mask(v * 4.0, 0.018));
                let tint = 0.06 * (cell(u * 4.0, v * 4.0, 4, 11) - 0.5);
                (0.72 + 0.28 * gap) * (1.0 + tint) + broad(0.04, 12)
            }
            Texture::Carpet => 1.0 + fine(0.3, 13) + broad(0.1, 14),
            Texture::Asphalt => 1.0 + fine(0.36, 15) + broad(0.16, 16),
            Texture::Pavement => {
                let row = (v * 4.0) as u32;
                let x = u * 2.0 + 0.5 * (row % 2) as f32;
                let gap = joint_mask(x, 0.012).min(joint_mask(v * 4.0, 0.024));
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
    // Twelve rows of planks, each with one plank per tile, at different offsets.
    let row = (v * 12.0) as u32;
    let shift = hash(row, 77, 22) as f32 / u32::MAX as f32;
    let x = u + shift;
    let gap = joint_mask(v * 12.0, 0.03).min(joint_mask(x, 0.003));
    let tint = 0.16 * (hash(row, 5, 23) as f32 / u32::MAX as f32 - 0.5);
    let lines = 0.14 * (noise(x % 1.0, v, 6, 96, 24) - 0.5);
    (0.72 + 0.28 * gap) * (1.0 + tint + lines)
}

/// Returns 0 within `half_width` of an integer, 1 elsewhere.
fn joint_mask(x: f32, half_width: f32) -> f32 {
    let d = (x % 1.0).min(1.0 - x % 1.0);
    if d < half_width { 0.0 } else { 1.0 }
}

/// Smoothed triangle wave of period 1, 0 to 1.
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

/// Returns a random number in [0, 1) per unit cell.
fn cell(x: f32, y: f32, period: u32, seed: u32) -> f32 {
    hash(x as u32 % period, y as u32 % period, seed) as f32 / 4_294_967_296.0
}

/// Value noise in [0, 1) with `nu` by `nv` cells per tile.
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

fn fractal_noise(u: f32, v: f32, n: u32, seed: u32) -> f32 {
    0.55 * noise(u, v, n, n, seed)
        + 0.3 * noise(u, v, 2 * n, 2 * n, seed + 40)
        + 0.15 * noise(u, v, 4 * n, 4 * n, seed + 80)
}

/// Writes all mip levels of a texture.
fn bake(texture: Texture, quads: &mut [u32]) {
    let at = |k: usize| (k as f32 + 0.5) / TILE_SIDE as f32;
    let texel =
        |n: usize| 128.0 * texture.brightness(at(n % TILE_SIDE), at(n / TILE_SIDE)).max(0.0).sqrt();
    let mut texels: Vec<f32> = (0..TILE_SIDE * TILE_SIDE).map(texel).collect();
    let mut quads = quads.iter_mut();
    for level in 0..MIP_LEVELS {
        let side = TILE_SIDE >> level;
        let texel_u8 = |j: usize, i: usize| texels[j % side * side + i % side].min(255.0) as u32;
        for (n, quad) in quads.by_ref().take(side * side).enumerate() {
            let (j, i) = (n / side, n % side);
            *quad = texel_u8(j, i)
                | texel_u8(j, i + 1) << 8
                | texel_u8(j + 1, i) << 16
                | texel_u8(j + 1, i + 1) << 24;
        }
        let half = side / 2;
        let mean = |n: usize| {
            let at =
                |dj: usize, di: usize| texels[(2 * (n / half) + dj) * side + 2 * (n % half) + di];
            0.25 * (at(0, 0) + at(0, 1) + at(1, 0) + at(1, 1))
        };
        texels = (0..half * half).map(mean).collect();
    }
}

/// Converts a display color to linear light: the square of the value, where 255 is 1. The square is
/// close to the sRGB curve, and every machine rounds its inverse, the square root, alike.
pub(crate) fn linear_from_display(display: [u8; 3]) -> [f32; 3] {
    display.map(|s| (f32::from(s) / 255.0) * (f32::from(s) / 255.0))
}

/// Converts linear light to a display color, 0 to 255, by the square root; values above 1 become
/// white.
pub fn display_from_linear(linear: f32) -> u8 {
    (255.0 * linear.clamp(0.0, 1.0).sqrt() + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_are_subtle_and_the_coarsest_mip_level_is_their_mean() {
        for texture in [Texture::Grain, Texture::Wicker, Texture::Tiles, Texture::Grass] {
            let tile = texture.tile().expect("has a texture");
            let far = tile.begin + Tile::texels_before(MIP_LEVELS as u32 - 1);
            let [mean, right, below, both] = atlas()[far as usize].to_le_bytes();
            assert!((90..166).contains(&mean), "{texture:?}: {mean}");
            assert!(right == mean && below == mean && both == mean, "{texture:?} repeats");
            let texels =
                atlas()[tile.begin as usize..][..TILE_SIDE * TILE_SIDE].iter().map(|q| q & 0xff);
            let (low, high) = texels.fold((255, 0), |(l, h), x| (l.min(x), h.max(x)));
            assert!((6..115).contains(&(high - low)), "{texture:?}: {low} to {high}");
        }
        assert_eq!(Texture::ALL.map(|t| t as usize), std::array::from_fn(|k| k));
    }
}
