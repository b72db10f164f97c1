//! The meshes on the device: each once, however many worlds use it.

use std::collections::BTreeMap;
use std::ops::Range;

use chaic_render::geometry::{ShapeName, Shapes};

use crate::device::Link;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::{MeshRecord, SkinRecord};
use crate::upload::PackedMesh;

/// All meshes on the device.
#[derive(Debug)]
pub(crate) struct Meshes {
    pub records: Pool<MeshRecord>,
    pub corners: Pool<[u32; 4]>,
    pub triangles: Pool<[u32; 2]>,
    pub skins: Pool<SkinRecord>,
    known: BTreeMap<u128, Stored>,
    /// Keys of the catalogue's shapes that are stored.
    named: BTreeMap<ShapeName, u128>,
}

#[derive(Debug)]
struct Stored {
    name: Option<ShapeName>,
    record: Range<u32>,
    corners: Range<u32>,
    triangles: Range<u32>,
    skins: Range<u32>,
    users: u32,
}

impl Meshes {
    pub fn new(link: &Link) -> Result<Meshes, GpuError> {
        Ok(Meshes {
            records: Pool::new(link, "meshes", 1 << 10)?,
            corners: Pool::new(link, "corners", 1 << 16)?,
            triangles: Pool::new(link, "triangles", 1 << 16)?,
            skins: Pool::new(link, "skins", 1 << 12)?,
            known: BTreeMap::new(),
            named: BTreeMap::new(),
        })
    }

    /// Keeps a shape for one user more; says its key and where its record is.
    pub fn acquire(
        &mut self,
        link: &Link,
        shapes: &Shapes,
        index: usize,
    ) -> Result<(u128, u32), GpuError> {
        let name = shapes.name(index);
        if let Some(key) = name.and_then(|name| self.named.get(&name)).copied()
            && let Some(place) = self.share(key)
        {
            return Ok((key, place));
        }
        let mesh = PackedMesh::of(shapes, index);
        let key = mesh.key();
        match self.share(key) {
            Some(place) => Ok((key, place)),
            None => Ok((key, self.store(link, &mesh, key, name)?)),
        }
    }

    /// Counts one user more of a mesh, if it is there.
    fn share(&mut self, key: u128) -> Option<u32> {
        let stored = self.known.get_mut(&key)?;
        stored.users += 1;
        Some(stored.record.start)
    }

    fn store(
        &mut self,
        link: &Link,
        mesh: &PackedMesh,
        key: u128,
        name: Option<ShapeName>,
    ) -> Result<u32, GpuError> {
        let corners = self.corners.add(link, &mesh.corners)?;
        let triangles = self.triangles.add(link, &mesh.triangles)?;
        let skins = self.skins.add(link, &mesh.skins)?;
        let mut record = mesh.record;
        for level in &mut record.levels {
            level[0] += corners.start;
            level[1] += triangles.start;
            level[3] += skins.start;
        }
        let record = self.records.add(link, &[record])?;
        let first = record.start;
        self.known.insert(key, Stored { name, record, corners, triangles, skins, users: 1 });
        if let Some(name) = name {
            self.named.insert(name, key);
        }
        Ok(first)
    }

    /// Gives up a mesh for one user.
    pub fn release(&mut self, key: u128) {
        let Some(stored) = self.known.get_mut(&key) else { return };
        stored.users -= 1;
        if stored.users == 0
            && let Some(stored) = self.known.remove(&key)
        {
            if let Some(name) = stored.name {
                self.named.remove(&name);
            }
            self.records.remove(stored.record);
            self.corners.remove(stored.corners);
            self.triangles.remove(stored.triangles);
            self.skins.remove(stored.skins);
        }
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.records.bytes() + self.corners.bytes() + self.triangles.bytes() + self.skins.bytes()
    }
}
