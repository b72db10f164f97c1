//! `chaic bench`.

use anyhow::Result;
use chaic_bench::{
    BenchScene, EnvBench, EnvSpeed, Machine, N_VIEWS, RenderBench, RenderSpeed, WorldSpeed,
    measure_world,
};
use chaic_eval::EvalError;
use chaic_gltf::Written;
use comfy_table::{ContentArrangement, Table, presets};
use serde::Serialize;

use super::bars;
use crate::arguments::{
    BenchCommand, BenchFormat, EnvBenchArguments, LookedAt, RenderBenchArguments,
    SceneBenchArguments, SceneName, WorldBenchArguments,
};
use crate::exit::Ended;
use crate::output::{complain, say};

/// Measures what this machine reaches.
pub fn run(command: &BenchCommand) -> Result<Ended> {
    match command {
        BenchCommand::Render(arguments) => render(arguments),
        BenchCommand::World(arguments) => world(arguments),
        BenchCommand::Env(arguments) => env(arguments),
        BenchCommand::Scene(arguments) => scene(arguments),
    }
}

fn looked_at(wanted: &LookedAt) -> Result<BenchScene> {
    match (&wanted.episode, wanted.scene) {
        (Some(episode), _) => Ok(BenchScene::episode(&super::episode(episode)?, wanted.size)?),
        (None, SceneName::House) => Ok(BenchScene::house(wanted.things as usize, wanted.size)?),
    }
}

/// Measures, with a bar for the part of the time that has passed.
fn with_bar<T, E>(measure: impl FnOnce(&mut dyn FnMut(f32)) -> Result<T, E>) -> Result<T, E> {
    let bar = bars::plain(100, "% of the time");
    let measured = measure(&mut |part| bar.set_position((100.0 * part) as u64));
    bar.finish_and_clear();
    measured
}

fn print<S: Serialize>(
    speed: &S,
    format: BenchFormat,
    text: impl FnOnce(&S) -> String,
) -> Result<Ended> {
    match format {
        BenchFormat::Json => say(&(serde_json::to_string_pretty(speed)? + "\n"))?,
        BenchFormat::Text => say(&text(speed))?,
    }
    Ok(Ended::Well)
}

fn render(arguments: &RenderBenchArguments) -> Result<Ended> {
    let scene = looked_at(&arguments.looked_at)?;
    warn_of_slow_build();
    let bench = RenderBench {
        scene: &scene,
        channels: arguments.channels,
        threads: usize::from(arguments.threads),
        seconds: arguments.measuring.seconds,
    };
    let speed = with_bar(|progress| bench.measure(progress))?;
    print(&speed, arguments.measuring.format, render_text)
}

fn render_text(speed: &RenderSpeed) -> String {
    let RenderSpeed { scene, size, channels, threads, views, objects, triangles, .. } = speed;
    let (each, fastest) = (speed.ms_per_frame, speed.ms_per_frame_in_fastest_round);
    let cpu =
        speed.cpu_ms_per_frame.map_or(String::new(), |ms| format!(", processor time {ms:.2} ms"));
    let rate = speed.frames_per_second;
    let threads = crate::output::counted(*threads, "thread");
    format!(
        "{scene}: {objects} things, {triangles} triangles at the finest level, seen from {views} \
         places\n{channels}, {size} x {size}, {threads}: {each:.2} ms a frame{cpu}, {rate:.1} \
         frames a second (fastest round {fastest:.2} ms)\n{}",
        machine_text(&speed.machine)
    )
}

fn world(arguments: &WorldBenchArguments) -> Result<Ended> {
    warn_of_slow_build();
    let tasks = &arguments.task.0;
    let bar = bars::plain(100 * tasks.len() as u64, "% of a task's time");
    let mut speeds = Vec::new();
    for (k, task) in tasks.iter().enumerate() {
        let mut progress = |part: f32| bar.set_position(100 * k as u64 + (100.0 * part) as u64);
        speeds.push(measure_world(*task, arguments.measuring.seconds, &mut progress)?);
    }
    bar.finish_and_clear();
    print(&speeds, arguments.measuring.format, |speeds| world_text(speeds))
}

fn world_text(speeds: &[WorldSpeed]) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(["Episode", "People", "Things", "Frames/s", "Frames/s of processor time"]);
    for speed in speeds {
        let whole = |rate: f64| format!("{rate:.0}");
        table.add_row([
            speed.episode.clone(),
            speed.agents.to_string(),
            speed.things.to_string(),
            whole(speed.frames_per_second),
            speed.frames_per_cpu_second.map_or(String::new(), whole),
        ]);
    }
    let machine = speeds.first().map_or(String::new(), |s| machine_text(&s.machine));
    table.trim_fmt() + "\n" + &machine
}

/// Largest number of pixels that helpers and partners of all environments see at once. Each takes 25 bytes, so that
/// all take 7 GB.
const MAX_EYE_PX: u64 = 1 << 28;

/// Refuses more images than memory holds.
fn check_images(arguments: &EnvBenchArguments) -> Result<(), EvalError> {
    let [helper, partner] =
        [arguments.size, arguments.minds_size].map(|side| u64::from(side).pow(2));
    let px = u64::from(arguments.envs) * (helper + partner);
    if px <= MAX_EYE_PX {
        return Ok(());
    }
    Err(EvalError::Options(format!(
        "--envs times the pixels of --size and --minds-size is {px}, at most {MAX_EYE_PX} fit into memory; give less"
    )))
}

fn env(arguments: &EnvBenchArguments) -> Result<Ended> {
    check_images(arguments)?;
    warn_of_slow_build();
    let bench = EnvBench {
        tasks: arguments.task.0.clone(),
        envs: usize::from(arguments.envs),
        size: arguments.size,
        minds_size: arguments.minds_size,
        channels: arguments.channels,
        threads: usize::from(arguments.threads),
        seconds: arguments.measuring.seconds,
    };
    let speed = with_bar(|progress| bench.measure(progress))?;
    print(&speed, arguments.measuring.format, env_text)
}

fn env_text(speed: &EnvSpeed) -> String {
    let EnvSpeed { envs, size, minds_size, channels, threads, episodes, .. } = speed;
    let (steps, frames) = (speed.steps_per_second, speed.frames_per_second);
    let threads = crate::output::counted(*threads, "thread");
    format!(
        "{envs} environments, {channels}, {size} x {size}, partners {minds_size} x {minds_size}, \
         {threads}: {steps:.0} decisions of the helpers a second, {frames:.0} frames a second; {episodes} episodes ended\n{}",
        machine_text(&speed.machine)
    )
}

fn scene(arguments: &SceneBenchArguments) -> Result<Ended> {
    let scene = looked_at(&arguments.looked_at)?;
    let Written { instances, triangles } = scene.write(&arguments.out)?;
    let (out, name) = (arguments.out.display(), &scene.name);
    let what = format!("{instances} nodes with {triangles} triangles, {N_VIEWS} cameras");
    say(&format!("{out}: {name} in {what}\n"))?;
    Ok(Ended::Well)
}

fn machine_text(machine: &Machine) -> String {
    let Machine { cpu, cores, platform, target_features, chaic, .. } = machine;
    let cpu = if cpu.is_empty() { "unknown processor" } else { cpu };
    let built_for = if target_features.is_empty() {
        "no more than the least".to_owned()
    } else {
        target_features.join(", ")
    };
    let cores = crate::output::counted(*cores, "core");
    format!("{cpu}, {cores}, {platform}; chaic {chaic} built for {built_for}\n")
}

fn warn_of_slow_build() {
    if !Machine::this().optimized {
        complain("warning: this build isn't made for speed; measure with `cargo run --release`");
    }
}
