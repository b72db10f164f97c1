//! The meshes on the device: each once, however many worlds use it.

use std::collections::BTreeMap;
use std::ops::Range;

use chaic_render::geometry::{N_LEVELS, ShapeName, Shapes};

use crate::device::Link;
use crate::error::GpuError;
use crate::pool::Pool;
use crate::records::{MeshRecord, SkinRecord};
use crate::upload::PackedMesh;

/// All meshes on the device.
#[derive(Debug)]
pub(crate) struct Meshes {
    pub records: Pool<MeshRecord>,
    pub vertices: Pool<[u32; 4]>,
    pub triangles: Pool<[u32; 2]>,
    pub skins: Pool<SkinRecord>,
    known: BTreeMap<u128, Shared>,
    /// Keys of the catalogue's shapes that are stored.
    named: BTreeMap<ShapeName, u128>,
}

#[derive(Debug)]
struct Shared {
    /// Its names in the catalogue: styles of a class may be the same shape.
    names: Vec<ShapeName>,
    record: Range<u32>,
    parts: Parts,
    users: u32,
}

/// Where the parts of a mesh are.
#[derive(Debug)]
pub(crate) struct Parts {
    vertices: Range<u32>,
    triangles: Range<u32>,
    skins: Range<u32>,
}

impl Meshes {
    pub fn new(link: &Link) -> Result<Meshes, GpuError> {
        Ok(Meshes {
            records: Pool::new(link, "meshes", 1 << 10)?,
            vertices: Pool::new(link, "vertices", 1 << 16)?,
            triangles: Pool::new(link, "triangles", 1 << 16)?,
            skins: Pool::new(link, "skins", 1 << 12)?,
            known: BTreeMap::new(),
            named: BTreeMap::new(),
        })
    }

    /// Keeps a shape for one user more, whose key is `known` if it is stored already; says its key
    /// and where its record is.
    pub fn acquire(
        &mut self,
        link: &Link,
        shapes: &Shapes,
        index: usize,
        known: Option<u128>,
    ) -> Result<(u128, u32), GpuError> {
        if let Some(key) = known
            && let Some(place) = self.share(key)
        {
            return Ok((key, place));
        }
        let name = shapes.name(index);
        if let Some(key) = name.and_then(|name| self.named.get(&name)).copied()
            && let Some(place) = self.share(key)
        {
            return Ok((key, place));
        }
        let mesh = PackedMesh::of((0..N_LEVELS).map(|level| (level, shapes.mesh(index, level))));
        let key = mesh.key();
        let place = match self.share(key) {
            Some(place) => place,
            None => self.store(link, &mesh, key)?,
        };
        if let (Some(name), Some(shared)) = (name, self.known.get_mut(&key)) {
            shared.names.push(name);
            self.named.insert(name, key);
        }
        Ok((key, place))
    }

    /// Counts one user more of a mesh, if it is there.
    fn share(&mut self, key: u128) -> Option<u32> {
        let stored = self.known.get_mut(&key)?;
        stored.users += 1;
        Some(stored.record.start)
    }

    /// Brings a mesh onto the device for a first user; says where its record is.
    fn store(&mut self, link: &Link, mesh: &PackedMesh, key: u128) -> Result<u32, GpuError> {
        let (parts, record) = self.put(link, mesh)?;
        let record = self.records.add(link, &[record])?;
        let first = record.start;
        self.known.insert(key, Shared { names: Vec::new(), record, parts, users: 1 });
        Ok(first)
    }

    /// Brings the parts of a mesh onto the device, but no record of it; gives that.
    pub fn put(&mut self, link: &Link, mesh: &PackedMesh) -> Result<(Parts, MeshRecord), GpuError> {
        let parts = Parts {
            vertices: self.vertices.add(link, &mesh.vertices)?,
            triangles: self.triangles.add(link, &mesh.triangles)?,
            skins: self.skins.add(link, &mesh.skins)?,
        };
        let mut record = mesh.record;
        for level in &mut record.levels {
            level[0] += parts.vertices.start;
            level[1] += parts.triangles.start;
            level[3] += parts.skins.start;
        }
        Ok((parts, record))
    }

    /// Takes the parts of a mesh off the device.
    pub fn take(&mut self, parts: Parts) {
        self.vertices.remove(parts.vertices);
        self.triangles.remove(parts.triangles);
        self.skins.remove(parts.skins);
    }

    /// Gives up a mesh for one user.
    pub fn release(&mut self, key: u128) {
        let Some(stored) = self.known.get_mut(&key) else { return };
        stored.users -= 1;
        if stored.users == 0
            && let Some(stored) = self.known.remove(&key)
        {
            for name in &stored.names {
                self.named.remove(name);
            }
            self.records.remove(stored.record);
            self.take(stored.parts);
        }
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.records.bytes() + self.vertices.bytes() + self.triangles.bytes() + self.skins.bytes()
    }
}
