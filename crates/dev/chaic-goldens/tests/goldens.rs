//! States and pixels do not change unnoticed, and are bitwise equal at every SIMD width of this
//! machine. After an intended change, `cargo run -p chaic-goldens -- --update` writes the new
//! table, which is reviewed like code. `benches/goldens/run.py` compares other processors.

use chaic_core::TaskId;
use chaic_goldens::script::Script;
use chaic_goldens::{GOLDENS, first_difference, table};
use chaic_render::with_each_width;
use chaic_world::{Rules, World};

#[test]
fn every_simd_width_computes_the_committed_table() {
    let mut widths = Vec::new();
    with_each_width(|width| {
        let found = table().expect("the bundled episodes can be played");
        if let Some([here, committed]) = first_difference(&found, GOLDENS) {
            panic!("{width}: first difference\n  here      {here}\n  committed {committed}");
        }
        widths.push(width.to_owned());
    });
    assert!(widths.contains(&"scalar".to_owned()), "{widths:?}");
    #[cfg(target_arch = "x86_64")]
    assert_eq!(widths.len() > 1, std::is_x86_feature_detected!("avx2"), "{widths:?}");
}

#[test]
fn the_script_covers_all_interactions_except_obstacles() {
    // Removing obstacles is not covered: they stand behind walls, and the script walks straight
    // ahead.
    let mut done = [0; 5];
    for task in TaskId::paper() {
        let episode = chaic_episodes::episodes(&chaic_episodes::Split::Test, task).next();
        let setup = episode.expect("bundled").expect("readable").into_setup();
        let mut world = World::new(setup, Rules::paper()).expect("valid");
        let mut script = Script::new(&world);
        script.play(&mut world, 2900);
        let c = script.event_counts();
        let counts = [c.taken, c.stowed, c.released, c.lifted, c.delivered];
        done = std::array::from_fn(|i| done[i] + counts[i]);
    }
    assert!(done.iter().all(|n| *n > 0), "taken, stowed, released, lifted, delivered: {done:?}");
}
