//! Rendering throughput of many worlds: `cargo run --release -p chaic-eval --example worlds -- 1000
//! 128`.
//!
//! Generates episodes of all tasks and renders the helpers' views (color, depth and ids) in batches
//! for ten seconds. The arguments are the number of worlds and the side of the images in pixels.
//! Prints images per second and the peak memory.

use std::time::{Duration, Instant};

use chaic_core::{AgentId, TaskId};
use chaic_episodes::{Split, episodes};
use chaic_render::{Channels, Scene, View, WorldViews, render_batch};
use chaic_world::{Rules, World};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default| arguments.next().map_or(Ok(default), |text| text.parse::<u32>());
    let (n, size) = (number(1000)?, number(128)?);
    let n_tasks = TaskId::paper().count() as u64;
    let mut worlds = Vec::new();
    for task in TaskId::paper() {
        for episode in episodes(&Split::Generated(0..u64::from(n).div_ceil(n_tasks)), task) {
            let setup = episode?.setup().clone();
            worlds.push(World::new(setup, Rules::paper()).map_err(|problem| format!("{problem}"))?);
        }
    }
    worlds.truncate(n as usize);
    let scenes: Vec<Scene> = worlds.iter().map(|world| Scene::new(world.setup())).collect();
    let helper = AgentId::HELPER;
    let views: Vec<[View; 1]> = worlds
        .iter()
        .map(|world| [View::from_eye(helper, world.camera(helper, size), Channels::ALL)])
        .collect();
    let batch: Vec<WorldViews> = worlds
        .iter()
        .zip(&scenes)
        .zip(&views)
        .map(|((world, scene), views)| WorldViews { scene, world, views })
        .collect();
    let mut images = Vec::new();
    // The first round creates textures and meshes.
    render_batch(&batch, &mut images);
    let (start, mut n_rounds) = (Instant::now(), 0);
    while start.elapsed() < Duration::from_secs(10) {
        render_batch(&batch, &mut images);
        n_rounds += 1;
    }
    let rate = (n_rounds * batch.len()) as f64 / start.elapsed().as_secs_f64();
    println!("{} worlds, {size} x {size}: {rate:.0} images per second", batch.len());
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    if let Some(peak) = status.lines().find_map(|line| line.strip_prefix("VmHWM:")) {
        println!("peak memory: {}", peak.trim());
    }
    Ok(())
}
