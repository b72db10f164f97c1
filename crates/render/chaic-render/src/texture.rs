//! Surface textures: small tiles of brightness, baked once from integer noise, sampled with
//! smaller copies for what is far away. Also the conversion between shown colors and linear light.

use std::sync::OnceLock;

/// What a surface looks like close up: a tile of brightness that repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Texture {
    /// One brightness everywhere.
    Plain,
    /// A painted wall, not quite even.
    Plaster,
    /// Metal with fine lines along it.
    Brushed,
    /// Wood with its grain.
    Grain,
    /// Woven threads.
    Weave,
    /// Woven canes.
    Wicker,
    /// Blotches, as on a fruit's skin.
    Mottle,
    /// A baked crust.
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
    /// Blades of grass.
    Grass,
}

const N_TEXTURES: usize = 14;
/// Texels along a tile's side; a power of two.
pub(crate) const SIDE: usize = 128;
pub(crate) const LEVELS: usize = 8;

/// Tiles of brightness that repeat, of all textures and at all levels, one after the other.
///
/// Each texel comes with its neighbors: itself in the lowest byte, then those to the right, below,
/// and below to the right, so that one load is enough to mix the four. 128 leaves brightness as it
/// is; texels are roots of the factors of linear light, to multiply what is shown.
pub(crate) type Atlas = [u32; N_ATLAS];

/// Texels of one tile at all its levels.
const N_TILE: usize = (4 * SIDE * SIDE - 1) / 3;

/// A power of two with room for all tiles: an index needs no check but a mask.
pub(crate) const N_ATLAS: usize = (N_TEXTURES * N_TILE).next_power_of_two();

/// The tiles, baked when first asked for.
pub(crate) fn atlas() -> &'static Atlas {
    static ATLAS: OnceLock<Box<Atlas>> = OnceLock::new();
    ATLAS.get_or_init(|| {
        let mut texels = vec![0; N_ATLAS];
        for texture in Texture::ALL {
            bake(texture, &mut texels[Tile::of(texture).begin as usize..][..N_TILE]);
        }
        texels.into_boxed_slice().try_into().unwrap_or_else(|_| Box::new([0x8080_8080; N_ATLAS]))
    })
}

/// Where a texture is in the [`Atlas`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub begin: u32,
    pub texels_per_m: f32,
}

impl Tile {
    pub fn of(texture: Texture) -> Tile {
        let begin = texture as usize * N_TILE;
        Tile { begin: begin as u32, texels_per_m: SIDE as f32 / texture.period_m() }
    }

    /// Texels before a level: of 4^n, 4^(n-1), ... the first few together.
    #[inline(always)]
    pub fn before(level: u32) -> u32 {
        (4 * (SIDE * SIDE) as u32 - ((4 * (SIDE * SIDE) as u32) >> (2 * level))) / 3
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

    /// The tile, if the surface has any texture.
    pub(crate) fn tile(self) -> Option<Tile> {
        (self != Texture::Plain).then(|| Tile::of(self))
    }

    /// Side of the square that repeats, metres.
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

/// Writes all levels of a texture.
fn bake(texture: Texture, quads: &mut [u32]) {
    let at = |k: usize| (k as f32 + 0.5) / SIDE as f32;
    let texel = |n: usize| 128.0 * texture.brightness(at(n % SIDE), at(n / SIDE)).max(0.0).sqrt();
    let mut texels: Vec<f32> = (0..SIDE * SIDE).map(texel).collect();
    let mut quads = quads.iter_mut();
    for level in 0..LEVELS {
        let side = SIDE >> level;
        let whole = |j: usize, i: usize| texels[j % side * side + i % side].min(255.0) as u32;
        for (n, quad) in quads.by_ref().take(side * side).enumerate() {
            let (j, i) = (n / side, n % side);
            *quad = whole(j, i)
                | whole(j, i + 1) << 8
                | whole(j + 1, i) << 16
                | whole(j + 1, i + 1) << 24;
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

/// Linear light of a color as it is shown, where 255 is 1: its square, which is near to sRGB's
/// curve and whose inverse, the root, every machine rounds alike.
pub(crate) fn linear_from_shown(shown: [u8; 3]) -> [f32; 3] {
    shown.map(|s| (f32::from(s) / 255.0) * (f32::from(s) / 255.0))
}

/// A color as it is shown, 0 to 255, of linear light: its root; too bright is white.
pub fn shown_from_linear(linear: f32) -> u8 {
    (255.0 * linear.clamp(0.0, 1.0).sqrt() + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_are_subtle_and_fade_to_their_mean_far_away() {
        for texture in [Texture::Grain, Texture::Wicker, Texture::Tiles, Texture::Grass] {
            let tile = texture.tile().expect("has a texture");
            let far = tile.begin + Tile::before(LEVELS as u32 - 1);
            let [mean, right, below, both] = atlas()[far as usize].to_le_bytes();
            assert!((90..166).contains(&mean), "{texture:?}: {mean}");
            assert!(right == mean && below == mean && both == mean, "{texture:?} repeats");
            let texels = atlas()[tile.begin as usize..][..SIDE * SIDE].iter().map(|q| q & 0xff);
            let (low, high) = texels.fold((255, 0), |(l, h), x| (l.min(x), h.max(x)));
            assert!((6..115).contains(&(high - low)), "{texture:?}: {low} to {high}");
        }
        assert_eq!(Texture::ALL.map(|t| t as usize), std::array::from_fn(|k| k));
    }
}
