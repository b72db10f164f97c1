//! Promise: a failed update leaves its world on the device as it was, and occupies no memory.

use bytemuck::Zeroable as _;
use chaic_core::AgentId;
use chaic_core::observation::Images;
use chaic_episodes::find_episode;
use chaic_render::{Channels, View};
use chaic_world::Rules;

use super::*;
use crate::records::{LightRecord, MaterialRecord};

fn episode(id: &str) -> (World, Scene) {
    let episode = find_episode(id).expect("the episode is bundled");
    let world = World::new(episode.setup().clone(), Rules::paper()).expect("the setup is valid");
    let scene = Scene::new(world.setup());
    (world, scene)
}

fn images(gpu: &mut Gpu, id: WorldId, view: View) -> Vec<Images> {
    let batch = gpu.render(&[(id, view)]).expect("the batch is valid");
    batch.read().expect("the images can be read")
}

/// Fills the array of instances, so that it must grow for the next world.
fn fill_instances(gpu: &mut Gpu, last_world: WorldId) {
    let capacity = gpu.instances.bytes() as usize / size_of::<InstanceRecord>();
    let used = gpu.placed(last_world).expect("the world is on the device").instances.end;
    let rest = vec![InstanceRecord::zeroed(); capacity - used as usize];
    gpu.instances.add(&gpu.context, &rest).expect("the rest fits without growth");
}

/// Sets the maximum size of a buffer; returns the old one.
fn set_max_buffer_size(gpu: &mut Gpu, bytes: u64) -> u64 {
    let context = Arc::get_mut(&mut gpu.context).expect("no batch is alive");
    std::mem::replace(&mut context.limits.max_buffer_size, bytes)
}

/// Opens a device; `None` without one, which skips the test.
fn open_gpu() -> Option<Gpu> {
    match Gpu::new(Adapters::Any) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            // As in the integration tests: on continuous integration, a missing device is a failure.
            let in_ci = std::env::var("CI").is_ok_and(|v| v == "true" || v == "1");
            assert!(!in_ci, "{error}");
            eprintln!("SKIPPED: {error}");
            None
        }
    }
}

/// Returns the first free vertex, lamp and ground cell.
fn first_free(gpu: &mut Gpu) -> [u32; 3] {
    let Gpu { context, meshes, lights, .. } = gpu;
    let vertices = meshes.vertices.add(context, &[[0; 4]]).expect("a vertex fits");
    let lamps = lights.lamps.add(context, &[[0.0; 4]]).expect("a lamp fits");
    let cells = lights.cells.add(context, &[[0; 4]]).expect("a cell fits");
    let first = [vertices.start, lamps.start, cells.start];
    meshes.vertices.remove(vertices);
    lights.lamps.remove(lamps);
    lights.cells.remove(cells);
    first
}

#[test]
fn a_failed_upload_frees_its_ranges() {
    let Some(mut gpu) = open_gpu() else { return };
    let (world, scene) = episode("obstacle/train/04");
    let before = first_free(&mut gpu);
    let max_buffer_size = set_max_buffer_size(&mut gpu, 0);
    let Gpu { context, lights, meshes, .. } = &mut gpu;
    // The arrays that an upload reaches last have no space.
    let all = vec![LightRecord::zeroed(); 1 << 8];
    let filled_lights = lights.records.add(context, &all).expect("the lights fit");
    let all = vec![MaterialRecord::zeroed(); 1 << 12];
    let filled_materials = meshes.materials.add(context, &all).expect("the materials fit");
    scene.with_shapes(world.state(), &postures(&world), |shapes| {
        let object = (0..shapes.len()).find(|k| shapes.shape_id(*k).is_some());
        let object = object.expect("the scene has objects");
        assert!(lights.add(context, &shapes.lighting()).is_err(), "there is no space");
        assert!(meshes.acquire(context, shapes, object, None).is_err(), "there is no space");
    });
    lights.records.remove(filled_lights);
    meshes.materials.remove(filled_materials);
    set_max_buffer_size(&mut gpu, max_buffer_size);
    assert_eq!(first_free(&mut gpu), before);
    gpu.add(&scene, &world).expect("the world fits on the device");
}

#[test]
fn a_failed_update_keeps_the_world() {
    let Some(mut gpu) = open_gpu() else { return };
    let (world, scene) = episode("obstacle/train/04");
    let (other, other_scene) = episode("shopping/train/01");
    let id = gpu.add(&scene, &world).expect("the world fits on the device");
    let camera = world.camera(AgentId::PARTNER, 64);
    let view = View::from_eye(AgentId::PARTNER, camera, Channels::ALL);
    let before = images(&mut gpu, id, view);
    fill_instances(&mut gpu, id);
    let max_buffer_size = set_max_buffer_size(&mut gpu, 0);
    // The first update would keep the meshes, the second one replaces everything.
    for (scene, world) in [(&scene, &world), (&other_scene, &other)] {
        let error = gpu.update(id, scene, world).expect_err("no buffer can grow");
        assert!(matches!(error, GpuError::OutOfMemory { .. }), "{error}");
    }
    set_max_buffer_size(&mut gpu, max_buffer_size);
    assert!(images(&mut gpu, id, view) == before, "the world has changed");
    gpu.update(id, &other_scene, &other).expect("buffers can grow again");
    assert!(images(&mut gpu, id, view) != before, "the world has not changed");
}
