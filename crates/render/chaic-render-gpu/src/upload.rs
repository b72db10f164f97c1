//! Conversion of geometry to the records that shaders read.

use chaic_render::geometry::{InstanceData, LightAssignment, MeshData, atlas_tile};
use xxhash_rust::xxh3::Xxh3;

use crate::records::{
    InstanceRecord, LIT_BY_LAMP, LIT_BY_POINT, LIT_BY_SKY, MaterialRecord, MeshRecord, words,
};

/// Levels of detail of a mesh in device layout.
pub(crate) struct PackedMesh {
    /// Position, and the normal in two signed 16-bit integers.
    pub vertices: Vec<[u32; 4]>,
    /// Three vertices (16 bits each), material (8 bits), smooth flag (8 bits).
    pub triangles: Vec<[u32; 2]>,
    pub materials: Vec<MaterialRecord>,
    /// Offsets are relative to the mesh's first vertex, triangle and material. Missing levels have
    /// no triangles.
    pub record: MeshRecord,
}

impl PackedMesh {
    /// Packs levels of a shape.
    pub fn new(levels: impl Iterator<Item = (usize, MeshData)>) -> PackedMesh {
        let mut packed = PackedMesh {
            vertices: Vec::new(),
            triangles: Vec::new(),
            materials: Vec::new(),
            record: bytemuck::Zeroable::zeroed(),
        };
        for (level, mesh) in levels {
            packed.record.levels[level] = [
                packed.vertices.len() as u32,
                packed.triangles.len() as u32,
                mesh.triangles.len() as u32,
                packed.materials.len() as u32,
            ];
            packed.add(&mesh);
        }
        packed
    }

    fn add(&mut self, mesh: &MeshData) {
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            self.vertices.push([
                p[0].to_bits(),
                p[1].to_bits(),
                p[2].to_bits(),
                octahedral_normal(*n),
            ]);
        }
        self.triangles.extend(mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.vertices;
            [a | b << 16, c | u32::from(t.material) << 16 | u32::from(t.smooth) << 24]
        }));
        self.materials.extend(mesh.materials.iter().map(|material| {
            let tile = atlas_tile(material.texture);
            MaterialRecord {
                color: material.color,
                texels_per_m: tile.map_or(0.0, |p| p.texels_per_m),
                axes_x: material.axes[0],
                gloss: material.gloss as u32,
                axes_y: material.axes[1],
                is_tinted: u32::from(material.tinted),
                axes_z: material.axes[2],
                first_texel: tile.map_or(0, |p| p.begin),
            }
        }));
    }

    /// Hash key: equal only for equal meshes.
    pub fn key(&self) -> u128 {
        let mut hash = Xxh3::new();
        hash.update(bytemuck::bytes_of(&self.record));
        hash.update(bytemuck::cast_slice(&self.vertices));
        hash.update(bytemuck::cast_slice(&self.triangles));
        hash.update(bytemuck::cast_slice(&self.materials));
        hash.digest128()
    }
}

/// Octahedral encoding of a unit normal as two signed 16-bit integers.
fn octahedral_normal(n: [f32; 3]) -> u32 {
    let sum = n[0].abs() + n[1].abs() + n[2].abs();
    if !(sum > 0.0 && sum < 1e6) {
        return 0;
    }
    let [x, y, z] = n.map(|c| c / sum);
    let fold = |a: f32, b: f32| (1.0 - b.abs()) * if a < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if z < 0.0 { (fold(x, y), fold(y, x)) } else { (x, y) };
    let snorm16 = |x: f32| u32::from((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    snorm16(x) | snorm16(y) << 16
}

/// Record of an instance whose mesh has index `mesh` on the device; `None` if its transform is
/// invalid.
pub(crate) fn instance_record(instance: &InstanceData, mesh: u32) -> Option<InstanceRecord> {
    let values = instance.rotation.iter().flatten().chain(&instance.origin);
    if !values.into_iter().all(|x| x.is_finite() && x.abs() < 1e6) {
        return None;
    }
    let [x, y, z] = instance.rotation;
    let (light_source, lamp) = match instance.light_source {
        LightAssignment::Sky => (LIT_BY_SKY, [0.0; 3]),
        LightAssignment::Lamp(at) => (LIT_BY_LAMP, at),
        LightAssignment::PerPoint => (LIT_BY_POINT, [0.0; 3]),
    };
    let [regions_low, regions_high] = words(instance.regions);
    Some(InstanceRecord {
        x,
        mesh,
        y,
        entity: u32::from(instance.entity.0),
        z,
        light_source,
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
