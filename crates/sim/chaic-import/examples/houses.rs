//! Tells how far things lie from the bed in each house of the original:
//! `cargo run --release -p chaic-import --example houses -- DATASET TDW [OUT]`; with OUT it also
//! draws each house from above, `OUT/SCENE-LAYOUT.png`.
//!
//! The way is a grown-up's, from every piece of furniture that may have something lying on it to
//! the bed.

use std::error::Error;
use std::path::PathBuf;

use chaic_core::ClassId;
use chaic_core::capability::Persona;
use chaic_core::geom::Pose;
use chaic_episodes::{Walker, ways_from};
use chaic_import::{Sources, house};
use chaic_world::{Person, Rules, Setup, World};
use glam::Vec3Swizzles as _;

/// Floor plans with the half of the episodes that plays in them.
const FLOORPLANS: [(&str, &str); 4] =
    [("1a", "training"), ("4a", "training"), ("2a", "test"), ("5a", "test")];
/// Side of the grid's cells, metres.
const CELL_M: f32 = 0.05;
/// A child's way in the last quarter of an episode, when what is carried must be brought, metres.
fn child_way_m() -> f32 {
    Persona::Child.capability().speed_m_per_frame * 750.0
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (dataset, tdw, out) = match &arguments[..] {
        [dataset, tdw] => (dataset, tdw, None),
        [dataset, tdw, out] => (dataset, tdw, Some(PathBuf::from(out))),
        _ => return Err("usage: houses DATASET TDW [OUT]".into()),
    };
    let sources = Sources { dataset: dataset.into(), tdw: tdw.into(), half: None };
    let far_m = child_way_m();
    println!("house     half      pieces  mean way (m)  within {far_m:.1} m");
    for (scene, half) in FLOORPLANS {
        for layout in 0..3 {
            let setup = house(&sources, scene, layout)?;
            let ways_m = ways_to_bed(&setup);
            let n = ways_m.len() as f32;
            let mean_m = ways_m.iter().sum::<f32>() / n;
            let near = ways_m.iter().filter(|m| **m <= far_m).count() as f32 / n;
            println!("{scene}/{layout}      {half:8}  {n:6}  {mean_m:12.1}  {near:13.2}");
            if let Some(out) = &out {
                std::fs::create_dir_all(out)?;
                draw(setup, &out.join(format!("{scene}-{layout}.png")))?;
            }
        }
    }
    Ok(())
}

/// The ways from all furniture that things may lie on, as far as it can be got at, metres.
fn ways_to_bed(setup: &Setup) -> Vec<f32> {
    let Some(bed) = setup.goal_places.first().and_then(|e| setup.thing_index(*e)) else {
        return Vec::new();
    };
    let radius_m = Persona::Adult.capability().radius_m;
    let walker = Walker { radius_m, reach_m: Rules::paper().arm_reach_m, cell_m: CELL_M };
    let ways_m = ways_from(setup, bed, walker);
    let bears = |k: &usize| {
        *k != bed && setup.things[*k].class.info().parts.iter().any(|part| part.supports)
    };
    (0..setup.things.len()).filter(bears).map(|k| ways_m[k]).filter(|m| m.is_finite()).collect()
}

/// Draws a house from above.
fn draw(mut setup: Setup, path: &std::path::Path) -> Result<(), Box<dyn Error>> {
    // A world has a goal: every layout has such a thing. And a partner: outside, where the picture
    // ends.
    setup.goal.targets.push((ClassId::named("pencil_bucket"), 1));
    let position = (setup.bounds.min - 5.0).extend(0.0).xzy();
    let pose = Pose { position, yaw_rad: 0.0 };
    setup.people.push(Person::new(Persona::Adult, pose, 0));
    let world = World::new(setup, Rules::paper())?;
    chaic_render::floor_plan::draw(&world, 960).save(path)?;
    Ok(())
}
