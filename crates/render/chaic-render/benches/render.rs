//! Time to render one view on one thread: `cargo bench -p chaic-render`.

use chaic_test_kit::scenes;
use std::hint::black_box;

use chaic_render::{Channels, Scene, View};
use chaic_test_kit::scenes::camera;
use criterion::{Criterion, criterion_group, criterion_main};

fn render(c: &mut Criterion) {
    let house = scenes::world(scenes::house());
    let street = scenes::world(scenes::street());
    // Through two doors; a crowded table close by; the whole street.
    for (name, world, eye, yaw) in [
        ("house_long", &house, [0.6, 1.65, 2.2], -1.57),
        ("house_kitchen", &house, [0.7, 1.65, 4.2], -0.7),
        ("street", &street, [9.0, 1.65, 0.0], 1.3),
    ] {
        let scene = Scene::new(world.setup());
        for (what, channels) in [("depth_ids", Channels::DEPTH_AND_IDS), ("rgb", Channels::RGB)] {
            let view = View::from_camera(camera(eye, yaw, 0.0, 512, 512), channels);
            c.bench_function(&format!("{name}/512/{what}"), |b| {
                let mut images = Vec::new();
                b.iter(|| {
                    scene.render_into(world, &[view], &mut images);
                    black_box(&images);
                });
            });
        }
    }
    let scene = Scene::new(house.setup());
    let views: Vec<View> = (0..16)
        .map(|k| {
            let camera = camera([5.0, 1.6, 4.0], 0.4 * k as f32, 0.0, 128, 128);
            View::from_camera(camera, Channels::DEPTH_AND_IDS)
        })
        .collect();
    c.bench_function("house/16x128/depth_ids", |b| {
        b.iter(|| black_box(scene.render(&house, &views)))
    });
    c.bench_function("scene_new", |b| b.iter(|| black_box(Scene::new(house.setup()))));
}

criterion_group!(benches, render);
criterion_main!(benches);
