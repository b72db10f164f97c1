//! Promise: pixels do not change unnoticed. After an intended change, `CHAIC_BLESS=1 cargo test -p
//! chaic-render --test it golden` writes the new digests.

use chaic_render::{Appearance, Channels, Scene, View};
use chaic_test_kit::scenes::{camera, house, street, world};
use xxhash_rust::xxh3::xxh3_64;

#[test]
fn images_match_the_golden_digests() {
    let mut digests = String::new();
    for (name, setup, eye, yaw, appearance) in [
        ("house", house(), [0.6, 1.65, 2.2], -1.57, Appearance::Canonical),
        ("street", street(), [9.0, 1.65, 0.0], 1.3, Appearance::Canonical),
        ("street", street(), [9.0, 1.65, 0.0], 1.3, Appearance::Evening),
        ("house", house(), [0.6, 1.65, 2.2], -1.57, Appearance::Varied { seed: 3 }),
    ] {
        let world = world(setup);
        let camera = camera(eye, yaw, -0.1, 256, 192);
        let view = View::from_camera(camera, Channels::ALL);
        let images = Scene::with_appearance(world.setup(), appearance).render(&world, &[view]);
        let depth: Vec<u8> =
            images[0].depth_m.iter().flatten().flat_map(|d| d.to_bits().to_le_bytes()).collect();
        let ids: Vec<u8> = images[0].ids.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let rgb = images[0].rgb.as_deref().unwrap_or_default();
        let [rgb, depth, ids] = [rgb, &depth, &ids].map(xxh3_64);
        digests +=
            &format!("{name} {appearance}: rgb {rgb:016x} depth {depth:016x} ids {ids:016x}\n");
    }
    if std::env::var_os("CHAIC_BLESS").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/golden.txt");
        std::fs::write(path, &digests).expect("the file is writable");
        return;
    }
    assert_eq!(digests, include_str!("golden.txt"));
}
