//! How many pictures a second a card draws: `cargo run --release -p chaic-render-gpu --example bench`.
//!
//! Worlds of all tasks, two eyes each, images left on the device; once at rest, and once with all of
//! them brought up to date before each batch. Takes the number of worlds; with `--any` a program in a
//! card's place will do, whose speed says nothing.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use chaic_core::AgentId;
use chaic_core::TaskId;
use chaic_episodes::find_episode;
use chaic_render::{Channels, Scene, View};
use chaic_render_gpu::{Adapters, Gpu, GpuError, WorldId};
use chaic_world::{Rules, World};

/// How long each setting is measured.
const LONG: Duration = Duration::from_secs(3);

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let any = arguments.iter().any(|a| a == "--any");
    let number = arguments.iter().find(|a| *a != "--any");
    let n_worlds: usize = number.map_or(Ok(512), |n| {
        n.parse().map_err(|_| format!("`{n}` is no number of worlds; write for example 512"))
    })?;
    let mut gpu = Gpu::new(if any { Adapters::AnyKind } else { Adapters::Cards })?;
    println!("{}", gpu.name());
    let begin = Instant::now();
    let mut worlds = Vec::new();
    let tasks: Vec<TaskId> = TaskId::paper().collect();
    for k in 0..n_worlds {
        let task = tasks[k % tasks.len()];
        let id = format!("{task}/train/{:02}", k / tasks.len() % 12);
        let world = World::new(find_episode(&id)?.setup().clone(), Rules::paper())?;
        let scene = Scene::new(world.setup());
        let id = gpu.add(&scene, &world)?;
        worlds.push((id, world, scene));
    }
    println!(
        "{n_worlds} worlds brought in {:.1} s, {} MiB on the device",
        begin.elapsed().as_secs_f64(),
        gpu.bytes_of_worlds() >> 20
    );
    let rate = updates_per_second(&mut gpu, &worlds)?;
    println!("{rate:.0} updates of a world a second");
    for (size, views_of_world) in [(128, 2), (512, 1)] {
        for (what, channels) in [("depth and ids", Channels::DEPTH_AND_IDS), ("all", Channels::ALL)]
        {
            let mut views = eyes(&worlds, size, views_of_world, channels);
            if let Err(GpuError::TooLargeBatch { most, .. }) = gpu.render(&views) {
                views.truncate(most as usize);
            }
            let [rest, moving] = [false, true].map(|moves| {
                frames_per_second(&mut gpu, &views, if moves { &worlds } else { &[] })
            });
            let (rest, moving, n) = (rest?, moving?, views.len());
            println!(
                "{size}x{size}, {what}: {rest:.0} frames/s of worlds at rest, {moving:.0} if all are \
                 updated before each batch of {n} views"
            );
        }
    }
    Ok(())
}

fn eyes(
    worlds: &[(WorldId, World, Scene)],
    size: u32,
    n: usize,
    channels: Channels,
) -> Vec<(WorldId, View)> {
    let eye = |id: WorldId, world: &World, agent: AgentId| {
        (id, View::of_eye(agent, world.eye(agent, size), channels))
    };
    let of_world = |(id, world, _): &(WorldId, World, Scene)| {
        let agents: Vec<AgentId> = world.setup().agents().take(n).collect();
        agents.into_iter().map(|agent| eye(*id, world, agent)).collect::<Vec<_>>()
    };
    worlds.iter().flat_map(of_world).collect()
}

/// Worlds brought up to date a second, on one thread. What moved is drawn now and then, so that memory
/// on its way is used again.
fn updates_per_second(gpu: &mut Gpu, worlds: &[(WorldId, World, Scene)]) -> Result<f64, GpuError> {
    let (mut took, mut n) = (Duration::ZERO, 0);
    while took < LONG {
        let begin = Instant::now();
        for (id, world, scene) in worlds {
            gpu.update(*id, scene, world)?;
        }
        took += begin.elapsed();
        n += worlds.len();
        gpu.render(&eyes(&worlds[..1], 8, 1, Channels::DEPTH_AND_IDS))?.wait()?;
    }
    Ok(n as f64 / took.as_secs_f64())
}

/// Frames a second; the worlds are brought up to date before each batch.
fn frames_per_second(
    gpu: &mut Gpu,
    views: &[(WorldId, View)],
    worlds: &[(WorldId, World, Scene)],
) -> Result<f64, GpuError> {
    gpu.render(views)?.wait()?;
    let (begin, mut n) = (Instant::now(), 0);
    while begin.elapsed() < LONG {
        for (id, world, scene) in worlds {
            gpu.update(*id, scene, world)?;
        }
        gpu.render(views)?.wait()?;
        n += views.len();
    }
    Ok(n as f64 / begin.elapsed().as_secs_f64())
}
