//! Worlds on the GPU.

use std::ops::Range;
use std::sync::Arc;

use chaic_render::Scene;
use chaic_render::geometry::{PortalGraph, atlas};
use chaic_render::shapes::{ShapeId, Shapes};
use chaic_world::{Posture, State, World};

use crate::batch::FreeOutputs;
use crate::bodies::PlacedBody;
use crate::device::{Adapters, GpuContext};
use crate::error::GpuError;
use crate::lights::{Lights, PlacedLight};
use crate::meshes::Meshes;
use crate::passes::Passes;
use crate::pool::Pool;
use crate::records::InstanceRecord;
use crate::render::Arena;
use crate::upload::instance_record;
use crate::world_id::WorldId;

/// GPU device with the worlds uploaded to it.
#[derive(Debug)]
pub struct Gpu {
    pub(crate) context: Arc<GpuContext>,
    pub(crate) passes: Passes,
    pub(crate) meshes: Meshes,
    pub(crate) instances: Pool<InstanceRecord>,
    pub(crate) lights: Lights,
    pub(crate) atlas: wgpu::Buffer,
    pub(crate) worlds: Vec<Option<PlacedWorld>>,
    pub(crate) arena: Arena,
    pub(crate) free_outputs: FreeOutputs,
}

/// A world on the device.
#[derive(Debug, Default)]
pub(crate) struct PlacedWorld {
    pub instances: Range<u32>,
    pub light: PlacedLight,
    /// Portal graph of its scene.
    pub regions: Arc<PortalGraph>,
    pub bodies: Vec<PlacedBody>,
    /// All shapes except bodies, structure first.
    meshes: Vec<PlacedMesh>,
}

/// A shape of a world that is not a body.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PlacedMesh {
    shape_id: Option<ShapeId>,
    key: u128,
    /// Index of its record.
    record: u32,
}

/// Visibility ids hold the instance in 16 bits, of which one value means background.
const MAX_INSTANCES: usize = 0xffff;

impl Gpu {
    /// Opens a device.
    pub fn new(adapters: Adapters) -> Result<Gpu, GpuError> {
        let context = Arc::new(GpuContext::open(adapters)?);
        Ok(Gpu {
            passes: Passes::new(&context),
            meshes: Meshes::new(&context)?,
            instances: Pool::new(&context, "instances", 1 << 12)?,
            lights: Lights::new(&context)?,
            atlas: context.buffer_with("textures", bytemuck::cast_slice(atlas()))?,
            worlds: Vec::new(),
            arena: Arena::new(&context)?,
            free_outputs: FreeOutputs::default(),
            context,
        })
    }

    /// Name and kind of the adapter, for display.
    pub fn name(&self) -> String {
        let info = &self.context.info;
        format!("{} ({:?}, {})", info.name, info.device_type, info.driver_info)
    }

    /// Device, for further processing of the images.
    pub fn device(&self) -> &wgpu::Device {
        &self.context.device
    }

    /// Queue of the device; batches are submitted in the order of the render calls.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.context.queue
    }

    /// Device memory of all worlds without images, bytes.
    pub fn world_bytes(&self) -> u64 {
        self.meshes.bytes() + self.instances.bytes() + self.lights.bytes()
    }

    /// Uploads a world in its current state.
    pub fn add(&mut self, scene: &Scene, world: &World) -> Result<WorldId, GpuError> {
        self.add_state(scene, world.state(), &postures(world))
    }

    /// Uploads a given state and the postures of its agents in order.
    pub fn add_state(
        &mut self,
        scene: &Scene,
        state: &State,
        postures: &[Posture],
    ) -> Result<WorldId, GpuError> {
        let mut placed = PlacedWorld::default();
        self.place(scene, state, postures, &mut placed)?;
        let free = self.worlds.iter().position(Option::is_none);
        let index = free.unwrap_or_else(|| {
            self.worlds.push(None);
            self.worlds.len() - 1
        });
        self.worlds[index] = Some(placed);
        Ok(WorldId(index as u32))
    }

    /// Updates a world to its current state, or to another episode. After an error, the world keeps
    /// its state of the last successful update.
    pub fn update(&mut self, id: WorldId, scene: &Scene, world: &World) -> Result<(), GpuError> {
        self.update_state(id, scene, world.state(), &postures(world))
    }

    /// Updates a world to a given state and the postures of its agents in order. After an error,
    /// the world keeps its state of the last successful update.
    pub fn update_state(
        &mut self,
        id: WorldId,
        scene: &Scene,
        state: &State,
        postures: &[Posture],
    ) -> Result<(), GpuError> {
        let mut placed = self.take_world(id)?;
        let result = self.place(scene, state, postures, &mut placed);
        self.worlds[id.0 as usize] = Some(placed);
        result
    }

    /// Removes a world from the device.
    pub fn remove(&mut self, id: WorldId) -> Result<(), GpuError> {
        let old = self.take_world(id)?;
        self.release(old);
        Ok(())
    }

    /// Returns a world on the device.
    pub(crate) fn placed(&self, id: WorldId) -> Result<&PlacedWorld, GpuError> {
        let placed = self.worlds.get(id.0 as usize).and_then(Option::as_ref);
        placed.ok_or(GpuError::UnknownWorld(id))
    }

    fn take_world(&mut self, id: WorldId) -> Result<PlacedWorld, GpuError> {
        let placed = self.worlds.get_mut(id.0 as usize).and_then(Option::take);
        placed.ok_or(GpuError::UnknownWorld(id))
    }

    fn release(&mut self, old: PlacedWorld) {
        old.meshes.into_iter().for_each(|mesh| self.meshes.release(mesh.key));
        old.bodies.into_iter().for_each(|body| body.remove(&mut self.meshes));
        self.instances.remove(old.instances);
        self.lights.remove(old.light);
    }

    /// Replaces a world; does not change it after an error. The old meshes are released last, so
    /// that shared ones stay on the device.
    fn place(
        &mut self,
        scene: &Scene,
        state: &State,
        postures: &[Posture],
        placed: &mut PlacedWorld,
    ) -> Result<(), GpuError> {
        let mut new =
            PlacedWorld { regions: scene.portal_graph().clone(), ..PlacedWorld::default() };
        let result =
            scene.with_shapes(state, postures, |shapes| self.fill_world(shapes, &mut new, placed));
        let unused = if result.is_ok() { std::mem::replace(placed, new) } else { new };
        self.release(unused);
        result
    }

    /// Fills a world and moves unchanged parts of the old one into it. Parts are moved after all
    /// steps that can fail, so an error leaves the old world complete.
    fn fill_world(
        &mut self,
        shapes: &Shapes,
        new: &mut PlacedWorld,
        old: &mut PlacedWorld,
    ) -> Result<(), GpuError> {
        let n = shapes.instances.len();
        if n > MAX_INSTANCES {
            return Err(GpuError::TooManyInstances { n, max: MAX_INSTANCES });
        }
        let is_same_scene = Arc::ptr_eq(&new.regions, &old.regions);
        let reusable: &[PlacedMesh] = if is_same_scene { &old.meshes } else { &[] };
        let keeps_meshes = !reusable.is_empty() && has_shapes_of(reusable, shapes);
        if !keeps_meshes {
            self.fill_meshes(shapes, &mut new.meshes, reusable)?;
        }
        let meshes = if keeps_meshes { &old.meshes } else { &new.meshes };
        let mut records = meshes.iter().map(|mesh| mesh.record);
        let mut record_indices = Vec::with_capacity(shapes.len());
        for index in 0..shapes.len() {
            let Some(shape) = shapes.body(index) else {
                record_indices.extend(records.next());
                continue;
            };
            let instance = shapes.instances.iter().find(|i| i.mesh as usize == index);
            let Some(instance) = instance.copied() else { continue };
            let body = PlacedBody::new(&mut self.meshes, &self.context, instance, shape)?;
            record_indices.push(body.record());
            new.bodies.push(body);
        }
        let instances = shapes.instances.iter();
        let records: Vec<InstanceRecord> = instances
            .filter_map(|i| instance_record(i, *record_indices.get(i.mesh as usize)?))
            .collect();
        new.instances = self.instances.add(&self.context, &records)?;
        if is_same_scene {
            new.light = std::mem::take(&mut old.light);
            self.lights.update(&self.context, &mut new.light, &shapes.lighting());
        } else {
            new.light = self.lights.add(&self.context, &shapes.lighting())?;
        }
        if keeps_meshes {
            new.meshes = std::mem::take(&mut old.meshes);
        }
        Ok(())
    }

    /// Uploads all shapes except bodies. `old` holds the meshes of an earlier frame of the same
    /// scene; it is empty otherwise.
    fn fill_meshes(
        &mut self,
        shapes: &Shapes,
        new: &mut Vec<PlacedMesh>,
        old: &[PlacedMesh],
    ) -> Result<(), GpuError> {
        for index in mesh_indices(shapes) {
            // Structure never changes.
            let reusable = old.get(index).filter(|_| shapes.is_structure(index));
            let reusable = reusable.map(|mesh| mesh.key);
            let (key, record) = self.meshes.acquire(&self.context, shapes, index, reusable)?;
            new.push(PlacedMesh { shape_id: shapes.shape_id(index), key, record });
        }
        Ok(())
    }
}

/// Returns the indices of all shapes except bodies.
fn mesh_indices(shapes: &Shapes) -> impl Iterator<Item = usize> {
    (0..shapes.len()).filter(move |index| !shapes.is_body(*index))
}

/// Returns whether the meshes are those of these shapes.
fn has_shapes_of(meshes: &[PlacedMesh], shapes: &Shapes) -> bool {
    mesh_indices(shapes)
        .map(|index| shapes.shape_id(index))
        .eq(meshes.iter().map(|mesh| mesh.shape_id))
}

fn postures(world: &World) -> Vec<Posture> {
    world.setup().agents().map(|agent| world.posture(agent)).collect()
}

#[cfg(test)]
mod tests;
