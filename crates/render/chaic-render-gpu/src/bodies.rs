//! Bodies of people, which no two moments share: a level of detail is shaped and brought onto the
//! device when a view first needs it.

use std::ops::Range;

use bytemuck::Zeroable as _;
use chaic_core::EntityId;
use chaic_render::geometry::{BodyShape, InstanceData, N_LEVELS, level_for};
use chaic_render::{Lens, View};
use rayon::prelude::*;

use crate::device::Link;
use crate::error::GpuError;
use crate::gpu::{Gpu, WorldId};
use crate::meshes::{Meshes, Parts};
use crate::records::{MeshRecord, Sight};
use crate::upload::PackedMesh;

/// A body of a world in its present posture.
#[derive(Debug)]
pub(crate) struct PlacedBody {
    instance: InstanceData,
    shape: BodyShape,
    /// Where its record is.
    place: Range<u32>,
    record: MeshRecord,
    /// A bit for each level that is there.
    present: u32,
    /// A bit for each that the next batch needs.
    wanted: u32,
    parts: Vec<Parts>,
}

impl PlacedBody {
    /// A body without any level yet.
    pub fn new(
        meshes: &mut Meshes,
        link: &Link,
        instance: InstanceData,
        shape: BodyShape,
    ) -> Result<PlacedBody, GpuError> {
        let record = MeshRecord::zeroed();
        let place = meshes.records.add(link, &[record])?;
        let parts = Vec::new();
        Ok(PlacedBody { instance, shape, place, record, present: 0, wanted: 0, parts })
    }

    /// Where its record is.
    pub fn record(&self) -> u32 {
        self.place.start
    }

    /// Takes it off the device.
    pub fn remove(self, meshes: &mut Meshes) {
        meshes.records.remove(self.place);
        self.parts.into_iter().for_each(|parts| meshes.take(parts));
    }

    /// Notes at which level a view sees it.
    fn look(&mut self, view: &View, sight: &Sight) {
        let is_own =
            view.hide.is_some_and(|agent| self.instance.entity == EntityId::of_agent(agent));
        if is_own || !self.instance.regions.overlaps(sight.regions) {
            return;
        }
        self.wanted |= levels_in(&self.instance, &sight.lens);
    }

    /// The levels that are still to be shaped.
    fn missing(&self) -> impl Iterator<Item = usize> + use<> {
        let missing = self.wanted & !self.present;
        (0..N_LEVELS).filter(move |level| missing >> level & 1 == 1)
    }

    /// Brings levels over that are missing.
    fn add(&mut self, meshes: &mut Meshes, link: &Link, mesh: &PackedMesh) -> Result<(), GpuError> {
        let (parts, record) = meshes.put(link, mesh)?;
        self.parts.push(parts);
        for level in self.missing() {
            self.record.levels[level] = record.levels[level];
        }
        self.present |= self.wanted;
        meshes.records.write(link, self.place.start, &[self.record]);
        Ok(())
    }
}

/// The level at which a lens sees an instance, a bit for each; both, if it is on the edge between two
/// and the device may round the other way.
fn levels_in(instance: &InstanceData, lens: &Lens) -> u32 {
    const SLACK: f32 = 1e-3;
    // What is just outside for one may be inside for the other, but then no pixel shows it.
    instance.radius_px(lens).map_or(0, |radius_px| {
        1 << level_for(radius_px * (1.0 - SLACK)) | 1 << level_for(radius_px * (1.0 + SLACK))
    })
}

impl Gpu {
    /// Shapes what views see of bodies and is not there yet, on all threads.
    pub(crate) fn shape_bodies(
        &mut self,
        views: &[(WorldId, View)],
        sights: &[Option<Sight>],
    ) -> Result<(), GpuError> {
        let Gpu { link, meshes, worlds, .. } = self;
        for ((world, view), sight) in views.iter().zip(sights) {
            if let (Some(Some(world)), Some(sight)) = (worlds.get_mut(world.0 as usize), sight) {
                world.bodies.iter_mut().for_each(|body| body.look(view, sight));
            }
        }
        let bodies = worlds.iter_mut().flatten().flat_map(|world| &mut world.bodies);
        let bodies: Vec<&mut PlacedBody> =
            bodies.filter(|b| b.missing().next().is_some()).collect();
        let shape = |body: &&mut PlacedBody| {
            PackedMesh::of(body.missing().map(|level| (level, body.shape.mesh(level))))
        };
        let packed: Vec<PackedMesh> = bodies.par_iter().map(shape).collect();
        for (body, mesh) in bodies.into_iter().zip(&packed) {
            body.add(meshes, link, mesh)?;
        }
        Ok(())
    }
}
