//! Options of `chaic bench` and `chaic scene`.

use std::path::PathBuf;

use chaic_bench::{parse_channels, parse_channels_or_none};
use chaic_episodes::house;
use chaic_render::Channels;
use chaic_render::geometry::FINEST_LEVEL;
use clap::{Args, Subcommand, ValueEnum};

use super::{Tasks, tasks};

/// `chaic scene`.
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Export the initial state of an episode as binary glTF, with a camera for each agent.
    Export(SceneArguments),
}

/// `chaic scene export`.
#[derive(Args, Debug)]
pub struct SceneArguments {
    /// Id of the episode, for example obstacle/test/00, or an episode file.
    pub episode: String,
    /// File to write, for example scene.glb.
    #[arg(long, value_name = "FILE", value_parser = glb_file)]
    pub out: PathBuf,
    /// Level of detail, 0 to 6; 6 is the finest.
    #[arg(long, value_name = "LEVEL", default_value_t = FINEST_LEVEL as u8,
        value_parser = clap::value_parser!(u8).range(0..=FINEST_LEVEL as i64))]
    pub detail: u8,
    /// Leave out ceilings for views from above.
    #[arg(long)]
    pub no_ceiling: bool,
}

fn glb_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_glb = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    if is_glb {
        Ok(path)
    } else {
        Err("the format is binary glTF; name a file that ends in .glb".to_owned())
    }
}

/// `chaic bench`.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Measure the renderer: images per second.
    Render(RenderBenchArguments),
    /// Measure the simulator: frames per second with random actions and without rendering.
    World(WorldBenchArguments),
    /// Measure batched environments: simulation, rule-based partners and images of random helpers.
    Env(EnvBenchArguments),
    /// Estimate the speed of environments on more cores and machines from times measured on one core.
    Scaling(ScalingArguments),
    /// Write the scene of `chaic bench render` for other renderers: scene.glb, cameras.json, chaic.png.
    Scene(SceneBenchArguments),
}

/// Scene and size of images.
#[derive(Args, Debug)]
pub struct SceneChoice {
    /// Scene: house has eight rooms, 150 objects and 16 cameras.
    #[arg(long, value_name = "NAME", default_value = "house", conflicts_with = "episode")]
    pub scene: SceneName,
    /// Maximum number of objects in the house, 0 to 1000.
    #[arg(long, alias = "things", value_name = "N", default_value_t = house::N_OBJECTS as u64)]
    #[arg(value_parser = clap::value_parser!(u64).range(super::ranges::OBJECTS))]
    #[arg(conflicts_with = "episode")]
    pub objects: u64,
    /// Measure the initial state of this episode instead: an id, for example shopping/test/00, or a file.
    #[arg(long, value_name = "EPISODE")]
    pub episode: Option<String>,
    /// Side of the images, 16 to 4096 pixels.
    #[arg(long, alias = "image-size", value_name = "PIXELS", default_value_t = 512)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
}

/// Scenes for measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SceneName {
    /// Eight rooms.
    House,
}

/// `chaic bench render`.
#[derive(Args, Debug)]
pub struct RenderBenchArguments {
    #[command(flatten)]
    pub scene: SceneChoice,
    /// Channels of the images: rgb, depth and ids, joined by +.
    #[arg(long, value_name = "NAMES", default_value = "rgb+depth+ids", value_parser = parse_channels)]
    pub channels: Channels,
    /// Threads, each of which renders its own images, 1 to 1024.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// Measure the GPU renderer instead, with worlds of all tasks in one batch; `any` accepts a software driver.
    #[arg(long, value_name = "ADAPTER", num_args = 0..=1, require_equals = true, default_missing_value = "hardware",
        conflicts_with_all = ["scene", "objects", "episode", "threads"])]
    pub gpu: Option<GpuAdapter>,
    /// Number of worlds on the GPU, 1 to 8192.
    #[arg(long, value_name = "N", default_value_t = 512, requires = "gpu",
        value_parser = clap::value_parser!(u16).range(1..=8192))]
    pub worlds: u16,
    #[command(flatten)]
    pub duration: DurationArguments,
}

/// Adapters for the GPU renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GpuAdapter {
    /// A GPU.
    Hardware,
    /// A GPU or a software driver.
    Any,
}

/// `chaic bench world`.
#[derive(Args, Debug)]
pub struct WorldBenchArguments {
    /// Tasks, separated by commas, or `all`; the first test episode of each is measured.
    #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks, default_value = "all")]
    pub task: Tasks,
    #[command(flatten)]
    pub duration: DurationArguments,
}

/// Environments of a measurement.
#[derive(Args, Debug)]
pub struct EnvChoice {
    /// Tasks, separated by commas, or `all`; their bundled training episodes take turns.
    #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks, default_value = "all")]
    pub task: Tasks,
    /// Number of environments in the batch, 1 to 8192.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=8192))]
    pub envs: u16,
    /// Side of the helpers' images, 16 to 1024 pixels.
    #[arg(long, alias = "image-size", value_name = "PIXELS", default_value_t = 128)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub size: u32,
    /// Side of the partners' images, 16 to 1024 pixels.
    #[arg(long, alias = "minds-size", value_name = "PIXELS", default_value_t = 128)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub partner_size: u32,
    /// Channels of the helpers' images: rgb, depth and ids, joined by +; or none.
    #[arg(long, value_name = "NAMES", default_value = "rgb+depth", value_parser = parse_channels_or_none)]
    pub channels: Channels,
}

/// `chaic bench env`.
#[derive(Args, Debug)]
pub struct EnvBenchArguments {
    #[command(flatten)]
    pub envs: EnvChoice,
    /// Threads, 1 to 1024.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    #[command(flatten)]
    pub duration: DurationArguments,
}

/// `chaic bench scaling`.
#[derive(Args, Debug)]
pub struct ScalingArguments {
    #[command(flatten)]
    pub envs: EnvChoice,
    /// Cores of each machine of the cluster, 1 to 1024.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub cores_per_node: u16,
    /// Rate of the learner's network connection, 1 to 1000000 Mbit/s.
    #[arg(long, value_name = "MBIT", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub network: u32,
    /// Decisions that the learner processes per second, 1 to 10000000.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub learner_rate: u32,
    #[command(flatten)]
    pub duration: DurationArguments,
}

/// Duration of a measurement.
#[derive(Args, Debug)]
pub struct DurationArguments {
    /// Duration, 0.001 to 3600 seconds; `chaic bench world` measures each task for this time.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    pub seconds: f32,
}

/// `chaic bench scene`.
#[derive(Args, Debug)]
pub struct SceneBenchArguments {
    #[command(flatten)]
    pub scene: SceneChoice,
    /// Folder for the files, for example my_files.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

fn seconds(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s| (0.001..=3600.0).contains(s));
    seconds.ok_or_else(|| format!("no time `{text}`; write seconds, from 0.001 to 3600"))
}
