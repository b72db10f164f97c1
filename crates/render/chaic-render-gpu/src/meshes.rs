//! Meshes on the device, shared by all worlds.

use std::collections::BTreeMap;
use std::ops::Range;

use chaic_render::geometry::N_LEVELS;
use chaic_render::shapes::{ShapeId, Shapes};

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::{MaterialRecord, MeshRecord};
use crate::upload::PackedMesh;

/// All meshes on the device.
#[derive(Debug)]
pub(crate) struct Meshes {
    pub records: Pool<MeshRecord>,
    pub vertices: Pool<[u32; 4]>,
    pub triangles: Pool<[u32; 2]>,
    pub materials: Pool<MaterialRecord>,
    stored: BTreeMap<u128, SharedMesh>,
    /// Keys of the stored shapes of the catalogue.
    key_by_shape: BTreeMap<ShapeId, u128>,
}

#[derive(Debug)]
struct SharedMesh {
    /// Names in the catalogue: several styles of a class may have the same shape.
    shape_ids: Vec<ShapeId>,
    record: Range<u32>,
    ranges: MeshRanges,
    users: u32,
}

/// Ranges of a mesh in the pools.
#[derive(Debug, Default)]
pub(crate) struct MeshRanges {
    vertices: Range<u32>,
    triangles: Range<u32>,
    materials: Range<u32>,
}

impl Meshes {
    pub fn new(context: &GpuContext) -> Result<Meshes, GpuError> {
        Ok(Meshes {
            records: Pool::new(context, "meshes", 1 << 10)?,
            vertices: Pool::new(context, "vertices", 1 << 16)?,
            triangles: Pool::new(context, "triangles", 1 << 16)?,
            materials: Pool::new(context, "materials", 1 << 12)?,
            stored: BTreeMap::new(),
            key_by_shape: BTreeMap::new(),
        })
    }

    /// Adds one user of a shape and uploads it if needed. `stored` is its key, if it is stored
    /// already. Returns its key and the index of its record.
    pub fn acquire(
        &mut self,
        context: &GpuContext,
        shapes: &Shapes,
        index: usize,
        stored: Option<u128>,
    ) -> Result<(u128, u32), GpuError> {
        if let Some(key) = stored
            && let Some(record_index) = self.add_user(key)
        {
            return Ok((key, record_index));
        }
        let shape_id = shapes.shape_id(index);
        if let Some(key) = shape_id.and_then(|shape_id| self.key_by_shape.get(&shape_id)).copied()
            && let Some(record_index) = self.add_user(key)
        {
            return Ok((key, record_index));
        }
        let mesh = PackedMesh::new((0..N_LEVELS).map(|level| (level, shapes.mesh(index, level))));
        let key = mesh.key();
        let record_index = match self.add_user(key) {
            Some(record_index) => record_index,
            None => self.store(context, &mesh, key)?,
        };
        if let (Some(shape_id), Some(shared)) = (shape_id, self.stored.get_mut(&key)) {
            shared.shape_ids.push(shape_id);
            self.key_by_shape.insert(shape_id, key);
        }
        Ok((key, record_index))
    }

    /// Adds one user of a stored mesh; returns the index of its record.
    fn add_user(&mut self, key: u128) -> Option<u32> {
        let entry = self.stored.get_mut(&key)?;
        entry.users += 1;
        Some(entry.record.start)
    }

    /// Uploads a mesh for its first user; returns the index of its record.
    fn store(
        &mut self,
        context: &GpuContext,
        mesh: &PackedMesh,
        key: u128,
    ) -> Result<u32, GpuError> {
        let (ranges, record) = self.upload_ranges(context, mesh)?;
        let record = match self.records.add(context, &[record]) {
            Ok(record) => record,
            Err(error) => {
                self.remove_ranges(ranges);
                return Err(error);
            }
        };
        let first = record.start;
        self.stored.insert(key, SharedMesh { shape_ids: Vec::new(), record, ranges, users: 1 });
        Ok(first)
    }

    /// Uploads the data of a mesh; returns its ranges and its record, which is not uploaded. Frees
    /// the ranges after an error.
    pub fn upload_ranges(
        &mut self,
        context: &GpuContext,
        mesh: &PackedMesh,
    ) -> Result<(MeshRanges, MeshRecord), GpuError> {
        let mut ranges = MeshRanges::default();
        if let Err(error) = self.fill_ranges(context, mesh, &mut ranges) {
            self.remove_ranges(ranges);
            return Err(error);
        }
        let mut record = mesh.record;
        for level in &mut record.levels {
            level[0] += ranges.vertices.start;
            level[1] += ranges.triangles.start;
            level[3] += ranges.materials.start;
        }
        Ok((ranges, record))
    }

    fn fill_ranges(
        &mut self,
        context: &GpuContext,
        mesh: &PackedMesh,
        ranges: &mut MeshRanges,
    ) -> Result<(), GpuError> {
        ranges.vertices = self.vertices.add(context, &mesh.vertices)?;
        ranges.triangles = self.triangles.add(context, &mesh.triangles)?;
        ranges.materials = self.materials.add(context, &mesh.materials)?;
        Ok(())
    }

    /// Removes the data of a mesh.
    pub fn remove_ranges(&mut self, ranges: MeshRanges) {
        self.vertices.remove(ranges.vertices);
        self.triangles.remove(ranges.triangles);
        self.materials.remove(ranges.materials);
    }

    /// Removes one user of a mesh.
    pub fn release(&mut self, key: u128) {
        let Some(entry) = self.stored.get_mut(&key) else { return };
        entry.users -= 1;
        if entry.users == 0
            && let Some(entry) = self.stored.remove(&key)
        {
            for shape_id in &entry.shape_ids {
                self.key_by_shape.remove(shape_id);
            }
            self.records.remove(entry.record);
            self.remove_ranges(entry.ranges);
        }
    }

    /// Size on the device, bytes.
    pub fn bytes(&self) -> u64 {
        self.records.bytes()
            + self.vertices.bytes()
            + self.triangles.bytes()
            + self.materials.bytes()
    }
}
