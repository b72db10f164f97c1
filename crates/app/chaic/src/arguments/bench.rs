//! `chaic bench`, and `chaic scene`.

use std::path::PathBuf;

use chaic_bench::{channels_named, channels_or_none};
use chaic_episodes::house;
use chaic_render::Channels;
use chaic_render::geometry::FINEST;
use clap::{Args, Subcommand, ValueEnum};

use super::{Tasks, tasks};

/// `chaic scene`.
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Write how an episode begins as binary glTF, with a camera for each agent's eye.
    Export(ExportArguments),
}

/// `chaic scene export`.
#[derive(Args, Debug)]
pub struct ExportArguments {
    /// The episode's id, for example obstacle/test/00, or an episode file.
    pub episode: String,
    /// The file, .glb.
    #[arg(long, value_name = "FILE", value_parser = glb_file)]
    pub out: PathBuf,
    /// Level of detail, 0 to 6, from coarsest to finest.
    #[arg(long, value_name = "LEVEL", default_value_t = FINEST as u8,
        value_parser = clap::value_parser!(u8).range(0..=FINEST as i64))]
    pub detail: u8,
    /// Leave ceilings out, to look into a house from above.
    #[arg(long)]
    pub no_ceiling: bool,
}

fn glb_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_glb = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    if is_glb {
        Ok(path)
    } else {
        Err("binary glTF is written; name a file that ends in .glb".to_owned())
    }
}

/// `chaic bench`.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Measure how fast this machine draws what eyes see.
    Render(RenderBenchArguments),
    /// Measure how fast this machine steps worlds; people act at random and nothing is drawn.
    World(WorldBenchArguments),
    /// Measure how fast this machine steps many environments side by side: worlds, rule-based partners
    /// and what random helpers see.
    Env(EnvBenchArguments),
    /// Write what the render bench looks at, for other renderers: scene.glb, cameras.json, chaic.png.
    Scene(SceneBenchArguments),
}

/// What is looked at.
#[derive(Args, Debug)]
pub struct LookedAt {
    /// house: eight rooms with 150 things, seen from 16 places.
    #[arg(long, value_name = "NAME", default_value = "house", conflicts_with = "episode")]
    pub scene: SceneName,
    /// Up to so many things in the house, 0 to 1000, if there is room for them.
    #[arg(long, value_name = "N", default_value_t = house::N_THINGS as u64, conflicts_with = "episode")]
    #[arg(value_parser = clap::value_parser!(u64).range(super::ranges::THINGS))]
    pub things: u64,
    /// The beginning of this episode instead: an id, for example shopping/test/00, or a file.
    #[arg(long, value_name = "EPISODE")]
    pub episode: Option<String>,
    /// Side of the images, 16 to 4096 pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
}

/// Scenes made for measuring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SceneName {
    /// Eight rooms.
    House,
}

/// `chaic bench render`.
#[derive(Args, Debug)]
pub struct RenderBenchArguments {
    #[command(flatten)]
    pub looked_at: LookedAt,
    /// Which images: rgb, depth and ids, joined by +.
    #[arg(long, value_name = "NAMES", default_value = "rgb+depth+ids", value_parser = channels_named)]
    pub channels: Channels,
    /// Threads that draw, each its own pictures, 1 to 1024.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    #[command(flatten)]
    pub measuring: Measuring,
}

/// `chaic bench world`.
#[derive(Args, Debug)]
pub struct WorldBenchArguments {
    /// Tasks, separated by commas, or `all`: the first test episode of each.
    #[arg(long, value_name = "NAMES", value_parser = tasks, default_value = "all")]
    pub task: Tasks,
    #[command(flatten)]
    pub measuring: Measuring,
}

/// `chaic bench env`.
#[derive(Args, Debug)]
pub struct EnvBenchArguments {
    /// Tasks, separated by commas, or `all`: their bundled training episodes, by turns.
    #[arg(long, value_name = "NAMES", value_parser = tasks, default_value = "all")]
    pub task: Tasks,
    /// How many environments are stepped together, 1 to 8192.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=8192))]
    pub envs: u16,
    /// Side of the helpers' images, 16 to 1024 pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 128, value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub size: u32,
    /// Side of the partners' images, 16 to 1024 pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 128, value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub minds_size: u32,
    /// What the helpers look at: rgb, depth and ids, joined by +; or none, their own state alone.
    #[arg(long, value_name = "NAMES", default_value = "rgb+depth", value_parser = channels_or_none)]
    pub channels: Channels,
    /// Threads, 1 to 1024.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    #[command(flatten)]
    pub measuring: Measuring,
}

/// How it is measured and printed.
#[derive(Args, Debug)]
pub struct Measuring {
    /// Measure for this long, 0.001 to 3600 seconds, of each task.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    pub seconds: f32,
    /// text or json.
    #[arg(long, default_value = "text")]
    pub format: BenchFormat,
}

/// `chaic bench scene`.
#[derive(Args, Debug)]
pub struct SceneBenchArguments {
    #[command(flatten)]
    pub looked_at: LookedAt,
    /// The folder for the files.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// How figures are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BenchFormat {
    /// Lines to read.
    Text,
    /// JSON.
    Json,
}

fn seconds(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s| (0.001..=3600.0).contains(s));
    seconds.ok_or_else(|| format!("no time `{text}`; write seconds, from 0.001 to 3600"))
}
