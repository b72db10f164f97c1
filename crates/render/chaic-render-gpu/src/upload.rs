//! Plain geometry as the records that shaders read.

use chaic_render::geometry::{InstanceData, LitBy, MeshData, place_in_atlas};
use xxhash_rust::xxh3::Xxh3;

use crate::records::{
    InstanceRecord, LIT_BY_LAMP, LIT_BY_POINT, LIT_BY_SKY, MeshRecord, SkinRecord, words,
};

/// A mesh at some levels, in the layout of the device.
pub(crate) struct PackedMesh {
    /// Position, and the normal in two signed 16-bit numbers.
    pub vertices: Vec<[u32; 4]>,
    /// Vertex, vertex, vertex, skin, whether smooth: 16, 16, 16, 8 and 8 bits.
    pub triangles: Vec<[u32; 2]>,
    pub skins: Vec<SkinRecord>,
    /// Offsets count from the mesh's own first vertex, triangle and skin. Levels that aren't there
    /// have no triangles.
    pub record: MeshRecord,
}

impl PackedMesh {
    /// Packs levels of a shape.
    pub fn of(levels: impl Iterator<Item = (usize, MeshData)>) -> PackedMesh {
        let mut packed = PackedMesh {
            vertices: Vec::new(),
            triangles: Vec::new(),
            skins: Vec::new(),
            record: bytemuck::Zeroable::zeroed(),
        };
        for (level, mesh) in levels {
            packed.record.levels[level] = [
                packed.vertices.len() as u32,
                packed.triangles.len() as u32,
                mesh.triangles.len() as u32,
                packed.skins.len() as u32,
            ];
            packed.add(&mesh);
        }
        packed
    }

    fn add(&mut self, mesh: &MeshData) {
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            self.vertices.push([p[0].to_bits(), p[1].to_bits(), p[2].to_bits(), packed_normal(*n)]);
        }
        self.triangles.extend(mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.vertices;
            [a | b << 16, c | u32::from(t.skin) << 16 | u32::from(t.smooth) << 24]
        }));
        self.skins.extend(mesh.skins.iter().map(|skin| {
            let place = place_in_atlas(skin.texture);
            SkinRecord {
                color: skin.color,
                texels_per_m: place.map_or(0.0, |p| p.texels_per_m),
                axes_x: skin.axes[0],
                gloss: skin.gloss as u32,
                axes_y: skin.axes[1],
                is_tinted: u32::from(skin.tinted),
                axes_z: skin.axes[2],
                first_texel: place.map_or(0, |p| p.begin),
            }
        }));
    }

    /// A name that only equal meshes share.
    pub fn key(&self) -> u128 {
        let mut hash = Xxh3::new();
        hash.update(bytemuck::bytes_of(&self.record));
        hash.update(bytemuck::cast_slice(&self.vertices));
        hash.update(bytemuck::cast_slice(&self.triangles));
        hash.update(bytemuck::cast_slice(&self.skins));
        hash.digest128()
    }
}

/// A unit normal folded onto an octahedron, as two signed 16-bit numbers.
fn packed_normal(n: [f32; 3]) -> u32 {
    let sum = n[0].abs() + n[1].abs() + n[2].abs();
    if !(sum > 0.0 && sum < 1e6) {
        return 0;
    }
    let [x, y, z] = n.map(|c| c / sum);
    let fold = |a: f32, b: f32| (1.0 - b.abs()) * if a < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if z < 0.0 { (fold(x, y), fold(y, x)) } else { (x, y) };
    let whole = |x: f32| u32::from((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    whole(x) | whole(y) << 16
}

/// The record of an instance whose mesh is at `mesh` on the device; `None` if its numbers are odd.
pub(crate) fn instance_record(instance: &InstanceData, mesh: u32) -> Option<InstanceRecord> {
    let numbers = instance.rotation.iter().flatten().chain(&instance.origin);
    if !numbers.into_iter().all(|x| x.is_finite() && x.abs() < 1e6) {
        return None;
    }
    let [x, y, z] = instance.rotation;
    let (lit_by, lamp) = match instance.lit_by {
        LitBy::Sky => (LIT_BY_SKY, [0.0; 3]),
        LitBy::Lamp(at) => (LIT_BY_LAMP, at),
        LitBy::EachPoint => (LIT_BY_POINT, [0.0; 3]),
    };
    let [regions_low, regions_high] = words(instance.regions);
    Some(InstanceRecord {
        x,
        mesh,
        y,
        entity: u32::from(instance.entity.0),
        z,
        lit_by,
        origin: instance.origin,
        is_tinted: u32::from(instance.tint.is_some()),
        tint: instance.tint.unwrap_or_default(),
        regions_low,
        lamp,
        regions_high,
        low: instance.min,
        padding: 0,
        high: instance.max,
        padding_2: 0,
        factor: instance.factor,
        padding_3: 0,
    })
}
