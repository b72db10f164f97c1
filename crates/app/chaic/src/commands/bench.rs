//! `chaic bench`.

use anyhow::Result;
use chaic_bench::{
    BenchScene, Cluster, EnvBench, EnvSetup, EnvSpeed, GpuBench, GpuSpeed, Machine, N_VIEWS,
    RenderBench, RenderSpeed, ScalingBench, ScalingEstimate, WorldSpeed, measure_world,
};
use chaic_eval::EvalError;
use chaic_gltf::SceneSummary;
use serde_json::json;

use super::{bars, table};
use crate::arguments::{
    BenchCommand, EnvBenchArguments, EnvChoice, GpuAdapter, RenderBenchArguments, ScalingArguments,
    SceneBenchArguments, SceneChoice, SceneName, WorldBenchArguments,
};
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, print_result, print_warning};

/// Measures the speed of this machine.
pub fn run(command: &BenchCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        BenchCommand::Render(arguments) => render(arguments, format),
        BenchCommand::World(arguments) => world(arguments, format),
        BenchCommand::Env(arguments) => env(arguments, format),
        BenchCommand::Scaling(arguments) => scaling(arguments, format),
        BenchCommand::Scene(arguments) => scene(arguments, format),
    }?;
    Ok(ExitStatus::Success)
}

fn bench_scene(choice: &SceneChoice) -> Result<BenchScene> {
    match (&choice.episode, choice.scene) {
        (Some(episode), _) => Ok(BenchScene::episode(&super::episode(episode)?, choice.size)?),
        (None, SceneName::House) => Ok(BenchScene::house(choice.objects as usize, choice.size)?),
    }
}

/// Measures with a bar for the elapsed fraction of the time.
fn with_bar<T, E>(measure: impl FnOnce(&mut dyn FnMut(f32)) -> Result<T, E>) -> Result<T, E> {
    let bar = bars::count_bar(100, "% of the time");
    let measured = measure(&mut |fraction| bar.set_position((100.0 * fraction) as u64));
    bar.finish_and_clear();
    measured
}

fn render(arguments: &RenderBenchArguments, format: OutputFormat) -> Result<()> {
    if let Some(adapter) = arguments.gpu {
        return render_gpu(arguments, adapter, format);
    }
    let scene = bench_scene(&arguments.scene)?;
    warn_of_slow_build();
    let bench = RenderBench {
        scene: &scene,
        channels: arguments.channels,
        threads: usize::from(arguments.threads),
        seconds: arguments.duration.seconds,
    };
    let speed = with_bar(|progress| bench.measure(progress))?;
    print_result(format, &speed, &render_text(&speed))
}

fn render_gpu(
    arguments: &RenderBenchArguments,
    adapter: GpuAdapter,
    format: OutputFormat,
) -> Result<()> {
    let bench = GpuBench {
        worlds: usize::from(arguments.worlds),
        size: arguments.scene.size,
        channels: arguments.channels,
        allows_software: adapter == GpuAdapter::Any,
        seconds: arguments.duration.seconds,
    };
    let speed = bench.measure()?;
    print_result(format, &speed, &gpu_text(&speed))
}

fn gpu_text(speed: &GpuSpeed) -> String {
    let GpuSpeed { adapter, worlds, views, size, channels, world_bytes, .. } = speed;
    format!(
        "{adapter}: {}, {} MiB on the device, {:.0} world updates a second\n\
         {channels}, {size} x {size}, batches of {}: {:.0} frames a second of worlds at rest, {:.0} if \
         all worlds change before each batch\n{}",
        counted(*worlds, "world"),
        world_bytes >> 20,
        speed.updates_per_second,
        counted(*views, "view"),
        speed.frames_per_second,
        speed.frames_per_second_with_updates,
        machine_text(&speed.machine)
    )
}

fn render_text(speed: &RenderSpeed) -> String {
    let RenderSpeed { scene, size, channels, threads, views, objects, triangles, .. } = speed;
    let (mean, fastest) = (speed.ms_per_frame, speed.ms_per_frame_in_fastest_round);
    let cpu =
        speed.cpu_ms_per_frame.map_or(String::new(), |ms| format!(", processor time {ms:.2} ms"));
    let rate = speed.frames_per_second;
    let threads = counted(*threads, "thread");
    format!(
        "{scene}: {objects} objects, {triangles} triangles at the finest level, {views} views\n\
         {channels}, {size} x {size}, {threads}: {mean:.2} ms a frame{cpu}, {rate:.1} frames a \
         second (fastest round {fastest:.2} ms)\n{}",
        machine_text(&speed.machine)
    )
}

fn world(arguments: &WorldBenchArguments, format: OutputFormat) -> Result<()> {
    warn_of_slow_build();
    let tasks = &arguments.task.0;
    let bar = bars::count_bar(100 * tasks.len() as u64, "% of a task's time");
    let mut speeds = Vec::new();
    for (k, task) in tasks.iter().enumerate() {
        let mut progress =
            |fraction: f32| bar.set_position(100 * k as u64 + (100.0 * fraction) as u64);
        speeds.push(measure_world(*task, arguments.duration.seconds, &mut progress)?);
    }
    bar.finish_and_clear();
    print_result(format, &speeds, &world_text(&speeds))
}

fn world_text(speeds: &[WorldSpeed]) -> String {
    let mut table =
        table(["Episode", "People", "Objects", "Frames/s", "Frames/s of processor time"]);
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
    let machine = speeds.first().map_or(String::new(), |speed| machine_text(&speed.machine));
    table.trim_fmt() + "\n" + &machine
}

/// Largest total number of pixels of all helpers and partners. A pixel takes 25 bytes, so that all take 7 GB.
const MAX_PIXELS: u64 = 1 << 28;

/// Refuses images that do not fit into memory.
fn check_images(arguments: &EnvChoice) -> Result<(), EvalError> {
    let [helper, partner] =
        [arguments.size, arguments.partner_size].map(|side| u64::from(side).pow(2));
    let px = u64::from(arguments.envs) * (helper + partner);
    if px <= MAX_PIXELS {
        return Ok(());
    }
    Err(EvalError::Options(format!(
        "--envs times the pixels of --size and --partner-size is {px}; at most {MAX_PIXELS} fit into memory"
    )))
}

fn env_setup(choice: &EnvChoice) -> Result<EnvSetup> {
    check_images(choice)?;
    Ok(EnvSetup {
        tasks: choice.task.0.clone(),
        envs: usize::from(choice.envs),
        size: choice.size,
        partner_size: choice.partner_size,
        channels: choice.channels,
    })
}

fn env(arguments: &EnvBenchArguments, format: OutputFormat) -> Result<()> {
    let setup = env_setup(&arguments.envs)?;
    warn_of_slow_build();
    let bench = EnvBench {
        setup,
        threads: usize::from(arguments.threads),
        seconds: arguments.duration.seconds,
    };
    let speed = with_bar(|progress| bench.measure(progress))?;
    print_result(format, &speed, &env_text(&speed))
}

fn env_text(speed: &EnvSpeed) -> String {
    let EnvSpeed { envs, size, partner_size, channels, threads, episodes, .. } = speed;
    let (steps, frames) = (speed.steps_per_second, speed.frames_per_second);
    let threads = counted(*threads, "thread");
    let episodes = counted(*episodes as usize, "episode");
    format!(
        "{envs} environments, {channels}, {size} x {size}, partners {partner_size} x {partner_size}, \
         {threads}: {steps:.0} helper steps a second, {frames:.0} frames a second; {episodes} ended\n{}",
        machine_text(&speed.machine)
    )
}

fn scaling(arguments: &ScalingArguments, format: OutputFormat) -> Result<()> {
    let setup = env_setup(&arguments.envs)?;
    warn_of_slow_build();
    let cluster = Cluster {
        cores_per_node: usize::from(arguments.cores_per_node),
        network_mbit_s: f64::from(arguments.network),
        learner_rate: f64::from(arguments.learner_rate),
    };
    let bench = ScalingBench { setup, seconds: arguments.duration.seconds, cluster };
    let estimate = with_bar(|progress| bench.measure(progress))?;
    print_result(format, &estimate, &scaling_text(&estimate))
}

fn scaling_text(estimate: &ScalingEstimate) -> String {
    let ScalingEstimate { envs, steps, mean_ms, p99_ms, max_ms, image_bytes, cluster, .. } =
        estimate;
    let whole = |rate: f64| format!("{rate:.0}");
    let percent = |fraction: f64| format!("{:.0} %", 100.0 * fraction);
    let large = format!("Batch of {}", estimate.large_envs);
    let mut cores = table(["Cores", &format!("Batch of {envs}"), &large, "Independent"]);
    for speed in &estimate.cores {
        let rates = [speed.batch, speed.large_batch, speed.independent].map(whole);
        cores.add_row(std::iter::once(speed.cores.to_string()).chain(rates));
    }
    let mut nodes = table(["Machines", "Decisions/s", "Network busy", "Learner busy"]);
    for speed in &estimate.nodes {
        nodes.add_row([
            speed.nodes.to_string(),
            whole(speed.steps_per_second),
            percent(speed.network_utilization),
            percent(speed.learner_utilization),
        ]);
    }
    format!(
        "Measured on one core: {steps} decisions, {mean_ms:.2} ms each (99th percentile {p99_ms:.1} ms, \
         maximum {max_ms:.1} ms), {image_bytes} bytes of images each\n\n\
         Estimate for one machine, decisions a second:\n{}\n\n\
         Estimate for machines of {}, a learner of {:.0} decisions a second behind {:.0} Mbit/s:\n{}\n{}",
        cores.trim_fmt(),
        counted(cluster.cores_per_node, "core"),
        cluster.learner_rate,
        cluster.network_mbit_s,
        nodes.trim_fmt(),
        machine_text(&estimate.machine)
    )
}

fn scene(arguments: &SceneBenchArguments, format: OutputFormat) -> Result<()> {
    let scene = bench_scene(&arguments.scene)?;
    let SceneSummary { instances, triangles } = scene.write(&arguments.out)?;
    let (out, name) = (arguments.out.display().to_string(), &scene.name);
    let json = json!({
        "out": out, "scene": name, "nodes": instances, "triangles": triangles, "cameras": N_VIEWS,
    });
    let text = format!(
        "{out}: {name} with {instances} nodes, {triangles} triangles and {N_VIEWS} cameras\n"
    );
    print_result(format, &json, &text)
}

fn machine_text(machine: &Machine) -> String {
    let Machine { cpu, cores, platform, target_features, chaic, .. } = machine;
    let cpu = if cpu.is_empty() { "unknown processor" } else { cpu };
    let features = if target_features.is_empty() {
        "the baseline of the architecture".to_owned()
    } else {
        target_features.join(", ")
    };
    let cores = counted(*cores, "core");
    format!("{cpu}, {cores}, {platform}; chaic {chaic} built for {features}\n")
}

fn warn_of_slow_build() {
    if !Machine::current().optimized {
        print_warning("this is a debug build; measure with `cargo run --release`");
    }
}
