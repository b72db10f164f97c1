//! Bodies of people, whose meshes differ in every frame: a level of detail is built and uploaded
//! when a view first needs it.

use std::ops::Range;

use bytemuck::Zeroable as _;
use chaic_core::EntityId;
use chaic_render::geometry::{InstanceData, N_LEVELS, level_for};
use chaic_render::shapes::BodyShape;
use chaic_render::{Projection, View};
use rayon::prelude::*;

use crate::device::GpuContext;
use crate::error::GpuError;
use crate::gpu::Gpu;
use crate::meshes::{MeshRanges, Meshes};
use crate::records::{MeshRecord, ViewVisibility};
use crate::upload::PackedMesh;
use crate::world_id::WorldId;

/// A body of a world in its current posture.
#[derive(Debug)]
pub(crate) struct PlacedBody {
    instance: InstanceData,
    shape: BodyShape,
    /// Index range of its record.
    record_range: Range<u32>,
    record: MeshRecord,
    /// One bit per uploaded level.
    uploaded: u32,
    /// One bit per level that the next batch needs.
    requested: u32,
    ranges: Vec<MeshRanges>,
}

impl PlacedBody {
    /// Body without uploaded levels.
    pub fn new(
        meshes: &mut Meshes,
        context: &GpuContext,
        instance: InstanceData,
        shape: BodyShape,
    ) -> Result<PlacedBody, GpuError> {
        let record = MeshRecord::zeroed();
        let record_range = meshes.records.add(context, &[record])?;
        let ranges = Vec::new();
        Ok(PlacedBody { instance, shape, record_range, record, uploaded: 0, requested: 0, ranges })
    }

    /// Index of its record.
    pub fn record(&self) -> u32 {
        self.record_range.start
    }

    /// Removes the body from the device.
    pub fn remove(self, meshes: &mut Meshes) {
        meshes.records.remove(self.record_range);
        self.ranges.into_iter().for_each(|ranges| meshes.remove_ranges(ranges));
    }

    /// Adds the level that a view needs.
    fn request_level(&mut self, view: &View, visibility: &ViewVisibility) {
        let is_hidden =
            view.hide.is_some_and(|agent| self.instance.entity == EntityId::from_agent(agent));
        if is_hidden || !self.instance.regions.overlaps(visibility.regions) {
            return;
        }
        self.requested |= levels_in(&self.instance, &visibility.projection);
    }

    /// Levels to build.
    fn missing(&self) -> impl Iterator<Item = usize> + use<> {
        let missing = self.requested & !self.uploaded;
        (0..N_LEVELS).filter(move |level| missing >> level & 1 == 1)
    }

    /// Uploads missing levels.
    fn add(
        &mut self,
        meshes: &mut Meshes,
        context: &GpuContext,
        mesh: &PackedMesh,
    ) -> Result<(), GpuError> {
        let (ranges, record) = meshes.upload_ranges(context, mesh)?;
        self.ranges.push(ranges);
        for level in self.missing() {
            self.record.levels[level] = record.levels[level];
        }
        self.uploaded |= self.requested;
        meshes.records.write(context, self.record_range.start, &[self.record]);
        Ok(())
    }
}

/// Level of detail of an instance in a view, one bit per level. Two bits are set near a threshold,
/// where the device may round differently.
fn levels_in(instance: &InstanceData, projection: &Projection) -> u32 {
    const TOLERANCE: f32 = 1e-3;
    // An instance outside the frustum on the host may be inside on the device, but then it covers
    // no pixel.
    instance.radius_px(projection).map_or(0, |radius_px| {
        1 << level_for(radius_px * (1.0 - TOLERANCE))
            | 1 << level_for(radius_px * (1.0 + TOLERANCE))
    })
}

impl Gpu {
    /// Builds the missing body meshes of the views on all threads, and uploads them.
    pub(crate) fn build_bodies(
        &mut self,
        views: &[(WorldId, View)],
        visibilities: &[Option<ViewVisibility>],
    ) -> Result<(), GpuError> {
        let Gpu { context, meshes, worlds, .. } = self;
        for ((world, view), visibility) in views.iter().zip(visibilities) {
            if let (Some(Some(world)), Some(visibility)) =
                (worlds.get_mut(world.0 as usize), visibility)
            {
                world.bodies.iter_mut().for_each(|body| body.request_level(view, visibility));
            }
        }
        let bodies = worlds.iter_mut().flatten().flat_map(|world| &mut world.bodies);
        let bodies: Vec<&mut PlacedBody> =
            bodies.filter(|b| b.missing().next().is_some()).collect();
        let shape = |body: &&mut PlacedBody| {
            PackedMesh::new(body.missing().map(|level| (level, body.shape.mesh(level))))
        };
        let packed: Vec<PackedMesh> = bodies.par_iter().map(shape).collect();
        for (body, mesh) in bodies.into_iter().zip(&packed) {
            body.add(meshes, context, mesh)?;
        }
        Ok(())
    }
}
