//! Promise: the GPU renderer agrees with the CPU renderer in worlds of every task. Ids agree on at
//! least 99.5 % of all pixels, depth is within 5 mm where they do, and colors are within 4 gray
//! levels on average.

use crate::common::{episode, gpu, views};
use chaic_core::geom::Camera;
use chaic_core::observation::Images;
use chaic_core::{AgentId, EntityId, TaskId, Vec3};
use chaic_render::{Appearance, Channels, Scene, View};
use chaic_render_gpu::WorldId;
use chaic_world::{ObjectLocation, World};

/// Difference between two renderings of a view.
#[derive(Debug, Default)]
struct Difference {
    n_pixels: usize,
    n_other_ids: usize,
    /// Pixels with equal ids whose depth differs by more than 5 mm.
    n_other_depths: usize,
    max_depth_m: f32,
    /// Sum of the differences of all channels.
    color_difference: u64,
}

impl Difference {
    fn add(&mut self, cpu: &Images, gpu: &Images) {
        let ids = |images: &Images| images.ids.clone().expect("the channel was requested");
        let depths = |images: &Images| images.depth_m.clone().expect("the channel was requested");
        let (a, b) = (ids(cpu), ids(gpu));
        assert_eq!(a.len(), b.len());
        let depths = depths(cpu).into_iter().zip(depths(gpu));
        for ((a, b), (da, db)) in a.iter().zip(&b).zip(depths) {
            self.n_pixels += 1;
            if a != b {
                self.n_other_ids += 1;
                continue;
            }
            let d = (da - db).abs();
            self.max_depth_m = self.max_depth_m.max(d);
            self.n_other_depths += usize::from(d > 0.005);
        }
        if let (Some(a), Some(b)) = (&cpu.rgb, &gpu.rgb) {
            assert_eq!(a.len(), b.len());
            self.color_difference +=
                a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
        }
    }

    fn check(&self, name: &str) {
        let fraction = |n: usize| n as f64 / self.n_pixels as f64;
        let gray_levels = self.color_difference as f64 / (3 * self.n_pixels) as f64;
        println!(
            "{name}: {:.3} % other ids, {:.4} % other depths (most {:.4} m), colors {gray_levels:.2}",
            100.0 * fraction(self.n_other_ids),
            100.0 * fraction(self.n_other_depths),
            self.max_depth_m,
        );
        assert!(fraction(self.n_other_ids) < 0.005, "{name}: {self:?}");
        assert!(fraction(self.n_other_depths) < 0.0005, "{name}: {self:?}");
        assert!(gray_levels < 4.0, "{name}: {self:?}");
    }
}

#[test]
fn images_of_every_task_agree_with_the_cpu() {
    let Some(mut gpu) = gpu("agreement") else { return };
    let mut worlds = Vec::new();
    for task in TaskId::paper() {
        for split in ["train/03", "test/05"] {
            let id = format!("{task}/{split}");
            let (world, scene) = episode(&id);
            let world_id = gpu.add(&scene, &world).expect("the world fits on the device");
            worlds.push((id, world, scene, world_id));
        }
    }
    for size in [128, 256] {
        // All worlds and cameras in one batch.
        let mut requests: Vec<(WorldId, View)> = Vec::new();
        let agent_views = |world: &World| views(world, size, Channels::ALL);
        for (_, world, _, world_id) in &worlds {
            requests.extend(agent_views(world).into_iter().map(|view| (*world_id, view)));
        }
        let batch = gpu.render(&requests).expect("the batch is valid");
        let mut images = batch.read().expect("the images can be read").into_iter();
        for (id, world, scene, _) in &worlds {
            let mut difference = Difference::default();
            for cpu in scene.render(world, &agent_views(world)) {
                difference.add(&cpu, &images.next().expect("one image per view"));
            }
            difference.check(&format!("{id} at {size}"));
        }
    }
}

#[test]
fn other_appearances_agree_with_the_cpu() {
    let Some(mut gpu) = gpu("appearances") else { return };
    for (id, appearance) in [
        ("low_target/train/02", Appearance::Evening),
        ("shopping/train/02", Appearance::Evening),
        ("high_target/train/02", Appearance::Varied { seed: 3 }),
        ("moving_house/train/02", Appearance::Varied { seed: 4 }),
    ] {
        let (world, _) = episode(id);
        let scene = Scene::with_appearance(world.setup(), appearance);
        let world_id = gpu.add(&scene, &world).expect("the world fits on the device");
        let agent_views = views(&world, 128, Channels::ALL);
        let requests: Vec<_> = agent_views.iter().map(|view| (world_id, *view)).collect();
        let images = gpu
            .render(&requests)
            .expect("the batch is valid")
            .read()
            .expect("the images can be read");
        let mut difference = Difference::default();
        scene
            .render(&world, &agent_views)
            .iter()
            .zip(&images)
            .for_each(|(a, b)| difference.add(a, b));
        difference.check(&format!("{id}, {appearance}"));
    }
}

/// Returns the color of each pixel that shows the sky.
fn sky_colors(images: &Images) -> Vec<Option<[u8; 3]>> {
    let rgb = images.rgb.as_ref().expect("the channel was requested").as_chunks::<3>().0;
    let ids = images.ids.as_ref().expect("the channel was requested");
    let is_sky = |id: u16| id == EntityId::NOTHING.0;
    rgb.iter().zip(ids).map(|(color, id)| is_sky(*id).then_some(*color)).collect()
}

#[test]
fn colors_are_rounded_as_on_the_cpu() {
    /// Side of the image. The CPU interpolates the sky between samples 64 pixels apart, here with
    /// an error of 0.05 gray levels. Truncated colors differ by half a level.
    const SIZE_PX: u32 = 512;
    let Some(mut gpu) = gpu("rounding") else { return };
    let (world, scene) = episode("shopping/train/02");
    let id = gpu.add(&scene, &world).expect("the world fits on the device");
    let up = chaic_core::Quat::from_rotation_x(1.2);
    let camera = Camera { world_from_camera: up, ..world.camera(AgentId::PARTNER, SIZE_PX) };
    let view = View::from_eye(AgentId::PARTNER, camera, Channels::ALL);
    let batch = gpu.render(&[(id, view)]).expect("the batch is valid");
    let gpu_colors = sky_colors(&batch.read().expect("the images can be read")[0]);
    let cpu_colors = sky_colors(&scene.render(&world, &[view])[0]);
    let (mut n, mut sum) = (0_u64, 0_u64);
    for (a, b) in gpu_colors.into_iter().zip(cpu_colors) {
        let (Some(a), Some(b)) = (a, b) else { continue };
        n += 3;
        sum += a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(b))).sum::<u64>();
    }
    assert!(n > 30_000, "{n} values of sky");
    let gray_levels = sum as f64 / n as f64;
    assert!(gray_levels < 0.25, "{gray_levels:.2} gray levels");
}

#[test]
fn an_updated_world_is_rendered_in_its_new_state() {
    let Some(mut gpu) = gpu("updates") else { return };
    let (world, scene) = episode("obstacle/train/04");
    let world_id = gpu.add(&scene, &world).expect("the world fits on the device");
    let mut state = world.state().clone();
    let mut postures: Vec<_> = world.setup().agents().map(|a| world.posture(a)).collect();
    let agent_views = views(&world, 128, Channels::ALL);
    let requests: Vec<_> = agent_views.iter().map(|view| (world_id, *view)).collect();
    let before =
        gpu.render(&requests).expect("the batch is valid").read().expect("the images can be read");
    for step in 0..4 {
        state.frame += 7;
        // First everything moves, then only people, then one object is gone.
        for (k, object) in state.objects.iter_mut().enumerate().filter(|_| step < 2) {
            object.position += Vec3::new(0.05, 0.01 * (k % 3) as f32, -0.04);
        }
        if step == 3 {
            state.objects[4].location = ObjectLocation::Broken;
        }
        for posture in &mut postures {
            posture.pose.position.x += 0.1;
            posture.pose.yaw_rad += 0.4;
            posture.walked_m += 0.3;
            posture.bend += 0.2;
        }
        gpu.update_state(world_id, &scene, &state, &postures).expect("the world is on the device");
        let images = gpu
            .render(&requests)
            .expect("the batch is valid")
            .read()
            .expect("the images can be read");
        assert_ne!(images, before);
        let mut difference = Difference::default();
        let cpu = scene.render_state(&state, &postures, &agent_views);
        cpu.iter().zip(&images).for_each(|(a, b)| difference.add(a, b));
        difference.check(&format!("frame {}", state.frame));
        let fresh_id =
            gpu.add_state(&scene, &state, &postures).expect("the world fits on the device");
        let requests: Vec<_> = agent_views.iter().map(|view| (fresh_id, *view)).collect();
        let fresh = gpu
            .render(&requests)
            .expect("the batch is valid")
            .read()
            .expect("the images can be read");
        assert!(images == fresh, "step {step}: the update differs from a new upload");
        gpu.remove(fresh_id).expect("the world is on the device");
    }
}
