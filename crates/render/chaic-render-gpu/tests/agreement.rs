//! The promise of this file: the graphics card draws what the CPU renderer draws. Ids agree on at
//! least 99.5 % of all pixels, depth is within 5 mm wherever they do, and colors are within 4 gray
//! levels on average, in worlds of every task.

mod common;

use chaic_core::TaskId;
use chaic_core::Vec3;
use chaic_core::observation::Images;
use chaic_render::{Appearance, Channels, Scene, View};
use chaic_render_gpu::WorldId;
use chaic_world::{Place, World};
use common::{episode, gpu, views};

/// How far two renderings of a view are from each other.
#[derive(Debug, Default)]
struct Difference {
    pixels: usize,
    other_ids: usize,
    /// Pixels of equal id whose depth differs by more than 5 mm.
    other_depths: usize,
    most_depth_m: f32,
    /// Sum of the differences of all channels.
    colors: u64,
}

impl Difference {
    fn add(&mut self, cpu: &Images, gpu: &Images) {
        let ids = |images: &Images| images.ids.clone().expect("asked for");
        let depths = |images: &Images| images.depth_m.clone().expect("asked for");
        let (a, b) = (ids(cpu), ids(gpu));
        assert_eq!(a.len(), b.len());
        let depths = depths(cpu).into_iter().zip(depths(gpu));
        for ((a, b), (da, db)) in a.iter().zip(&b).zip(depths) {
            self.pixels += 1;
            if a != b {
                self.other_ids += 1;
                continue;
            }
            let d = (da - db).abs();
            self.most_depth_m = self.most_depth_m.max(d);
            self.other_depths += usize::from(d > 0.005);
        }
        if let (Some(a), Some(b)) = (&cpu.rgb, &gpu.rgb) {
            assert_eq!(a.len(), b.len());
            self.colors += a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum::<u64>();
        }
    }

    fn check(&self, what: &str) {
        let share = |n: usize| n as f64 / self.pixels as f64;
        let gray_levels = self.colors as f64 / (3 * self.pixels) as f64;
        println!(
            "{what}: {:.3} % other ids, {:.4} % other depths (most {:.4} m), colors {gray_levels:.2}",
            100.0 * share(self.other_ids),
            100.0 * share(self.other_depths),
            self.most_depth_m,
        );
        assert!(share(self.other_ids) < 0.005, "{what}: {self:?}");
        assert!(share(self.other_depths) < 0.0005, "{what}: {self:?}");
        assert!(gray_levels < 4.0, "{what}: {self:?}");
    }
}

#[test]
fn pictures_of_every_task_agree_with_the_cpu() {
    let Some(mut gpu) = gpu("agreement") else { return };
    let mut worlds = Vec::new();
    for task in TaskId::paper() {
        for split in ["train/03", "test/05"] {
            let id = format!("{task}/{split}");
            let (world, scene) = episode(&id);
            let on_device = gpu.add(&scene, &world).expect("it fits");
            worlds.push((id, world, scene, on_device));
        }
    }
    for size in [128, 256] {
        // All worlds and cameras in one batch.
        let mut asked: Vec<(WorldId, View)> = Vec::new();
        let looks = |world: &World| views(world, size, Channels::ALL);
        for (_, world, _, on_device) in &worlds {
            asked.extend(looks(world).into_iter().map(|view| (*on_device, view)));
        }
        let batch = gpu.render(&asked).expect("it is drawn");
        let mut got = batch.read().expect("it comes back").into_iter();
        for (id, world, scene, _) in &worlds {
            let mut difference = Difference::default();
            for cpu in scene.render(world, &looks(world)) {
                difference.add(&cpu, &got.next().expect("as many as asked for"));
            }
            difference.check(&format!("{id} at {size}"));
        }
    }
}

#[test]
fn other_light_and_colors_agree_too() {
    let Some(mut gpu) = gpu("appearances") else { return };
    for (id, appearance) in [
        ("low_target/train/02", Appearance::Evening),
        ("shopping/train/02", Appearance::Evening),
        ("high_target/train/02", Appearance::Varied { seed: 3 }),
        ("moving_house/train/02", Appearance::Varied { seed: 4 }),
    ] {
        let (world, _) = episode(id);
        let scene = Scene::with_appearance(world.setup(), appearance);
        let on_device = gpu.add(&scene, &world).expect("it fits");
        let looks = views(&world, 128, Channels::ALL);
        let asked: Vec<_> = looks.iter().map(|view| (on_device, *view)).collect();
        let got = gpu.render(&asked).expect("it is drawn").read().expect("it comes back");
        let mut difference = Difference::default();
        scene.render(&world, &looks).iter().zip(&got).for_each(|(a, b)| difference.add(a, b));
        difference.check(&format!("{id}, {appearance}"));
    }
}

#[test]
fn a_world_that_moved_is_shown_as_it_is_now() {
    let Some(mut gpu) = gpu("updates") else { return };
    let (world, scene) = episode("obstacle/train/04");
    let on_device = gpu.add(&scene, &world).expect("it fits");
    let mut state = world.state().clone();
    let mut postures: Vec<_> = world.setup().agents().map(|a| world.posture(a)).collect();
    let looks = views(&world, 128, Channels::ALL);
    let asked: Vec<_> = looks.iter().map(|view| (on_device, *view)).collect();
    let before = gpu.render(&asked).expect("it is drawn").read().expect("it comes back");
    for step in 0..4 {
        state.frame += 7;
        // Everything moves; then only people do; then something is gone.
        for (k, thing) in state.things.iter_mut().enumerate().filter(|_| step < 2) {
            thing.position += Vec3::new(0.05, 0.01 * (k % 3) as f32, -0.04);
        }
        if step == 3 {
            state.things[4].place = Place::Broken;
        }
        for posture in &mut postures {
            posture.pose.position.x += 0.1;
            posture.pose.yaw_rad += 0.4;
            posture.walked_m += 0.3;
            posture.bend += 0.2;
        }
        gpu.update_state(on_device, &scene, &state, &postures).expect("it is there");
        let got = gpu.render(&asked).expect("it is drawn").read().expect("it comes back");
        assert_ne!(got, before);
        let mut difference = Difference::default();
        let cpu = scene.render_state(&state, &postures, &looks);
        cpu.iter().zip(&got).for_each(|(a, b)| difference.add(a, b));
        difference.check(&format!("frame {}", state.frame));
        let anew = gpu.add_state(&scene, &state, &postures).expect("it fits");
        let asked: Vec<_> = looks.iter().map(|view| (anew, *view)).collect();
        let fresh = gpu.render(&asked).expect("it is drawn").read().expect("it comes back");
        assert!(got == fresh, "step {step}: what was there before shows");
        gpu.remove(anew).expect("it is there");
    }
}
