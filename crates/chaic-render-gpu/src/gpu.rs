//! Worlds on the graphics card.

use std::ops::Range;
use std::sync::Arc;

use chaic_render::Scene;
use chaic_render::geometry::{Regions, Shapes, atlas};
use chaic_world::{Posture, State, World};

use crate::batch::Spare;
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
    pub regions: Arc<Regions>,
    meshes: Vec<u128>,
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
        old.meshes.into_iter().for_each(|key| self.meshes.release(key));
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
        let result = scene.with_shapes(state, postures, |shapes| self.fill(shapes, &mut new));
        self.give_up(old);
        match result {
            Ok(()) => Ok(new),
            Err(error) => {
                self.give_up(new);
                Err(error)
            }
        }
    }

    fn fill(&mut self, shapes: &Shapes, new: &mut Placed) -> Result<(), GpuError> {
        let n = shapes.instances.len();
        if n > MAX_INSTANCES {
            return Err(GpuError::TooManyInstances { n, most: MAX_INSTANCES });
        }
        let mut places = Vec::with_capacity(shapes.len());
        for index in 0..shapes.len() {
            let (key, place) = self.meshes.acquire(&self.link, shapes, index)?;
            new.meshes.push(key);
            places.push(place);
        }
        let instances = shapes.instances.iter();
        let records: Vec<InstanceRecord> =
            instances.filter_map(|i| instance_record(i, *places.get(i.mesh as usize)?)).collect();
        new.instances = self.instances.add(&self.link, &records)?;
        new.light = self.lights.add(&self.link, &shapes.lighting())?;
        Ok(())
    }
}

fn postures(world: &World) -> Vec<Posture> {
    world.setup().agents().map(|agent| world.posture(agent)).collect()
}
