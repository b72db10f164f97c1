//! Worlds on the graphics card.

use std::ops::Range;
use std::sync::Arc;

use chaic_render::Scene;
use chaic_render::geometry::{PortalGraph, ShapeName, Shapes, atlas};
use chaic_world::{Posture, State, World};

use crate::batch::Spare;
use crate::bodies::PlacedBody;
use crate::device::{Adapters, Link};
use crate::error::GpuError;
use crate::lights::{Lights, PlacedLight};
use crate::meshes::Meshes;
use crate::passes::Passes;
use crate::pool::Pool;
use crate::records::InstanceRecord;
use crate::render::Arena;
use crate::upload::instance_record;

/// Names a world on the device that gave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorldId(pub(crate) u32);

/// A graphics card with worlds on it.
#[derive(Debug)]
pub struct Gpu {
    pub(crate) link: Arc<Link>,
    pub(crate) passes: Passes,
    pub(crate) meshes: Meshes,
    pub(crate) instances: Pool<InstanceRecord>,
    pub(crate) lights: Lights,
    pub(crate) atlas: wgpu::Buffer,
    pub(crate) worlds: Vec<Option<Placed>>,
    pub(crate) arena: Arena,
    pub(crate) spare: Spare,
}

/// A world on the device.
#[derive(Debug, Default)]
pub(crate) struct Placed {
    pub instances: Range<u32>,
    pub light: PlacedLight,
    /// Of its scene, whose own they are.
    pub regions: Arc<PortalGraph>,
    pub bodies: Vec<PlacedBody>,
    /// All its other shapes, those of structure first.
    meshes: Vec<PlacedMesh>,
}

/// A shape of a world that is no body.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PlacedMesh {
    name: Option<ShapeName>,
    key: u128,
    /// Where its record is.
    record: u32,
}

/// Pixels name their instance in 16 bits, of which one value means nobody.
const MAX_INSTANCES: usize = 0xffff;

impl Gpu {
    /// Opens a graphics card.
    pub fn new(adapters: Adapters) -> Result<Gpu, GpuError> {
        let link = Arc::new(Link::open(adapters)?);
        Ok(Gpu {
            passes: Passes::new(&link),
            meshes: Meshes::new(&link)?,
            instances: Pool::new(&link, "instances", 1 << 12)?,
            lights: Lights::new(&link)?,
            atlas: link.filled("textures", bytemuck::cast_slice(atlas()))?,
            worlds: Vec::new(),
            arena: Arena::new(&link)?,
            spare: Spare::default(),
            link,
        })
    }

    /// The adapter's name and kind, for people.
    pub fn name(&self) -> String {
        let info = &self.link.info;
        format!("{} ({:?}, {})", info.name, info.device_type, info.driver_info)
    }

    /// The device, for work on images that stay there.
    pub fn device(&self) -> &wgpu::Device {
        &self.link.device
    }

    /// The device's queue; batches are submitted to it in the order of their rendering.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.link.queue
    }

    /// Bytes of the device's memory that worlds take, without images.
    pub fn bytes_of_worlds(&self) -> u64 {
        self.meshes.bytes() + self.instances.bytes() + self.lights.bytes()
    }

    /// Brings a world onto the device as it is now.
    pub fn add(&mut self, scene: &Scene, world: &World) -> Result<WorldId, GpuError> {
        self.add_state(scene, world.state(), &postures(world))
    }

    /// The same for a state and postures that come from elsewhere, those of the agents in order.
    pub fn add_state(
        &mut self,
        scene: &Scene,
        state: &State,
        postures: &[Posture],
    ) -> Result<WorldId, GpuError> {
        let placed = self.place(scene, state, postures, Placed::default())?;
        let free = self.worlds.iter().position(Option::is_none);
        let index = free.unwrap_or_else(|| {
            self.worlds.push(None);
            self.worlds.len() - 1
        });
        self.worlds[index] = Some(placed);
        Ok(WorldId(index as u32))
    }

    /// Shows a world as it is now, be it a moment later or another episode.
    pub fn update(&mut self, id: WorldId, scene: &Scene, world: &World) -> Result<(), GpuError> {
        self.update_state(id, scene, world.state(), &postures(world))
    }

    /// The same for a state and postures that come from elsewhere, those of the agents in order.
    pub fn update_state(
        &mut self,
        id: WorldId,
        scene: &Scene,
        state: &State,
        postures: &[Posture],
    ) -> Result<(), GpuError> {
        let old = self.take(id)?;
        let placed = self.place(scene, state, postures, old)?;
        self.worlds[id.0 as usize] = Some(placed);
        Ok(())
    }

    /// Takes a world off the device.
    pub fn remove(&mut self, id: WorldId) -> Result<(), GpuError> {
        let old = self.take(id)?;
        self.give_up(old);
        Ok(())
    }

    /// The instances of a world.
    pub(crate) fn placed(&self, id: WorldId) -> Result<&Placed, GpuError> {
        let placed = self.worlds.get(id.0 as usize).and_then(Option::as_ref);
        placed.ok_or(GpuError::UnknownWorld(id))
    }

    fn take(&mut self, id: WorldId) -> Result<Placed, GpuError> {
        let placed = self.worlds.get_mut(id.0 as usize).and_then(Option::take);
        placed.ok_or(GpuError::UnknownWorld(id))
    }

    fn give_up(&mut self, old: Placed) {
        old.meshes.into_iter().for_each(|mesh| self.meshes.release(mesh.key));
        old.bodies.into_iter().for_each(|body| body.remove(&mut self.meshes));
        self.instances.remove(old.instances);
        self.lights.remove(old.light);
    }

    /// Puts a world in the place of another. The other's meshes go last: what both share stays.
    fn place(
        &mut self,
        scene: &Scene,
        state: &State,
        postures: &[Posture],
        old: Placed,
    ) -> Result<Placed, GpuError> {
        let mut new = Placed { regions: scene.regions().clone(), ..Placed::default() };
        let mut old = old;
        let result =
            scene.with_shapes(state, postures, |shapes| self.fill(shapes, &mut new, &mut old));
        self.give_up(old);
        match result {
            Ok(()) => Ok(new),
            Err(error) => {
                self.give_up(new);
                Err(error)
            }
        }
    }

    /// Fills in what a world consists of, with all that stays of what was in its place before.
    fn fill(
        &mut self,
        shapes: &Shapes,
        new: &mut Placed,
        old: &mut Placed,
    ) -> Result<(), GpuError> {
        let n = shapes.instances.len();
        if n > MAX_INSTANCES {
            return Err(GpuError::TooManyInstances { n, most: MAX_INSTANCES });
        }
        let is_same_scene = Arc::ptr_eq(&new.regions, &old.regions);
        let mut none = Vec::new();
        let known = if is_same_scene { &mut old.meshes } else { &mut none };
        self.fill_meshes(shapes, &mut new.meshes, known)?;
        let mut records = new.meshes.iter().map(|mesh| mesh.record);
        let mut places = Vec::with_capacity(shapes.len());
        for index in 0..shapes.len() {
            let Some(shape) = shapes.body(index) else {
                places.extend(records.next());
                continue;
            };
            let instance = shapes.instances.iter().find(|i| i.mesh as usize == index);
            let Some(instance) = instance.copied() else { continue };
            let body = PlacedBody::new(&mut self.meshes, &self.link, instance, shape)?;
            places.push(body.record());
            new.bodies.push(body);
        }
        let instances = shapes.instances.iter();
        let records: Vec<InstanceRecord> =
            instances.filter_map(|i| instance_record(i, *places.get(i.mesh as usize)?)).collect();
        new.instances = self.instances.add(&self.link, &records)?;
        if is_same_scene {
            new.light = std::mem::take(&mut old.light);
            self.lights.update(&self.link, &mut new.light, &shapes.lighting());
        } else {
            new.light = self.lights.add(&self.link, &shapes.lighting())?;
        }
        Ok(())
    }

    /// Brings the shapes over that are no bodies; `old` are those of an earlier moment of the same
    /// scene, if there is one.
    fn fill_meshes(
        &mut self,
        shapes: &Shapes,
        new: &mut Vec<PlacedMesh>,
        old: &mut Vec<PlacedMesh>,
    ) -> Result<(), GpuError> {
        let meshes = (0..shapes.len()).filter(|index| !shapes.is_body(*index));
        let names = meshes.clone().map(|index| shapes.name(index));
        if !old.is_empty() && names.eq(old.iter().map(|mesh| mesh.name)) {
            std::mem::swap(new, old);
            return Ok(());
        }
        for index in meshes {
            // Structure never changes.
            let known = old.get(index).filter(|_| shapes.is_structure(index));
            let known = known.map(|mesh| mesh.key);
            let (key, record) = self.meshes.acquire(&self.link, shapes, index, known)?;
            new.push(PlacedMesh { name: shapes.name(index), key, record });
        }
        Ok(())
    }
}

fn postures(world: &World) -> Vec<Posture> {
    world.setup().agents().map(|agent| world.posture(agent)).collect()
}
