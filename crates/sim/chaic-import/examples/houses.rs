//! Prints path lengths to the bed in each house of the original: `cargo run --release -p
//! chaic-import --example houses -- DATASET TDW [OUT]`. With OUT it also draws each house from
//! above, `OUT/SCENE-LAYOUT.png`.
//!
//! Paths are those of an adult, from each piece of furniture that can hold objects to the bed.

use std::error::Error;
use std::path::PathBuf;

use chaic_core::ClassId;
use chaic_core::capability::Persona;
use chaic_core::geom::Pose;
use chaic_episodes::{ReachabilityParams, path_lengths_from};
use chaic_import::{Sources, house};
use chaic_world::{AgentSpec, Rules, Setup, World};
use glam::Vec3Swizzles as _;

/// Floor plans with the half of the episodes that uses them.
const FLOORPLANS: [(&str, &str); 4] =
    [("1a", "training"), ("4a", "training"), ("2a", "test"), ("5a", "test")];
/// Side of the grid's cells, meters.
const CELL_M: f32 = 0.05;
/// Returns the distance that a child walks in the last quarter of an episode, meters.
fn child_distance_m() -> f32 {
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
    let far_m = child_distance_m();
    println!("house     half      pieces  mean path (m)  within {far_m:.1} m");
    for (scene, half) in FLOORPLANS {
        for layout in 0..3 {
            let setup = house(&sources, scene, layout)?;
            let lengths_m = path_lengths_to_bed(&setup);
            let n = lengths_m.len() as f32;
            let mean_m = lengths_m.iter().sum::<f32>() / n;
            let near = lengths_m.iter().filter(|m| **m <= far_m).count() as f32 / n;
            println!("{scene}/{layout}      {half:8}  {n:6}  {mean_m:13.1}  {near:13.2}");
            if let Some(out) = &out {
                std::fs::create_dir_all(out)?;
                draw(setup, &out.join(format!("{scene}-{layout}.png")))?;
            }
        }
    }
    Ok(())
}

/// Returns the path lengths from all reachable furniture that can hold objects, meters.
fn path_lengths_to_bed(setup: &Setup) -> Vec<f32> {
    let Some(bed) = setup.goal_places.first().and_then(|e| setup.object_index(*e)) else {
        return Vec::new();
    };
    let radius_m = Persona::Adult.capability().radius_m;
    let params =
        ReachabilityParams { radius_m, reach_m: Rules::paper().arm_reach_m, cell_m: CELL_M };
    let lengths_m = path_lengths_from(setup, bed, params);
    let is_below = |k: &usize| {
        *k != bed && setup.things[*k].class.info().parts.iter().any(|part| part.supports)
    };
    (0..setup.things.len())
        .filter(is_below)
        .map(|k| lengths_m[k])
        .filter(|m| m.is_finite())
        .collect()
}

/// Draws a house from above.
fn draw(mut setup: Setup, path: &std::path::Path) -> Result<(), Box<dyn Error>> {
    // A world needs a goal: every layout has an object of this class. It also needs a partner, who
    // is placed outside of the image.
    setup.goal.targets.push((ClassId::named("pencil_bucket"), 1));
    let position = (setup.bounds.min - 5.0).extend(0.0).xzy();
    let pose = Pose { position, yaw_rad: 0.0 };
    setup.people.push(AgentSpec::new(Persona::Adult, pose, 0));
    let world = World::new(setup, Rules::paper())?;
    chaic_render::floor_plan::draw(&world, 960).save(path)?;
    Ok(())
}
