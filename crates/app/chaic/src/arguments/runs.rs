//! Options of the commands that read a run folder, and of `chaic render`.

use std::path::PathBuf;

use chaic_core::AgentId;
use chaic_env::Appearance;
use chaic_env::rules::RuleSetName;
use chaic_eval::metrics::FormulaSet;
use clap::Args;

use super::{agent, ranges};

/// `chaic merge`.
#[derive(Args, Debug)]
pub struct MergeArguments {
    /// Folders of the shards.
    #[arg(required = true)]
    pub runs: Vec<PathBuf>,
    /// A new folder for the whole run, for example runs/standard.
    #[arg(long)]
    pub out: PathBuf,
}

/// `chaic report`.
#[derive(Args, Debug)]
pub struct ReportArguments {
    /// Folder of the run.
    pub run: PathBuf,
    /// Formulas: paper, or original for those of the original's scripts.
    #[arg(long, default_value = "paper")]
    pub formulas: FormulaSet,
    /// Compute the scores from the traces instead of the recorded results.
    #[arg(long)]
    pub from_traces: bool,
    /// Write the figure with error bars to a .svg or .png file and print nothing.
    #[arg(long, value_name = "FILE")]
    pub figure: Option<PathBuf>,
    /// Print the accuracy and calibration of recorded beliefs; docs/metrics.md.
    #[arg(long, conflicts_with_all = ["formulas", "from_traces", "figure"])]
    pub belief: bool,
    /// Print what each helper loses against oracle_plan, by cause; docs/metrics.md.
    #[arg(long, conflicts_with_all = ["formulas", "belief", "figure"])]
    pub losses: bool,
    /// Print the differences of TR to another run on the same episodes, for each helper of both.
    #[arg(long, value_name = "RUN", conflicts_with_all = ["formulas", "belief", "figure", "losses"])]
    pub baseline: Option<PathBuf>,
}

/// `chaic show`.
#[derive(Args, Debug)]
pub struct ShowArguments {
    /// Folder of the run.
    pub run: PathBuf,
}

/// `chaic verify`.
#[derive(Args, Debug)]
pub struct VerifyArguments {
    /// Folder of the run, or a single trace (*.jsonl) of a bundled or generated episode.
    pub run: PathBuf,
    /// Traces in parallel, 1 to 1024 [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic explain`.
#[derive(Args, Debug)]
pub struct ExplainArguments {
    /// Folder of the run.
    pub run: PathBuf,
    /// Id of the episode, for example obstacle/test/00.
    pub episode: String,
    /// Helper of the episode run [default: infer if the run has it].
    #[arg(long, value_name = "NAME")]
    pub helper: Option<String>,
    /// Seed of the episode run, 0 to 9999 [default: the lowest].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(ranges::SEED))]
    pub seed: Option<u32>,
}

/// `chaic replay`.
#[derive(Args, Debug)]
pub struct ReplayArguments {
    /// Folder of the run.
    pub run: PathBuf,
    /// Id of the episode, for example obstacle/test/00.
    pub episode: String,
    /// Video to write, .mp4 or .gif, for example replay.mp4.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Helper of the episode run [default: your own helper, or else infer, rhp, oracle ...].
    #[arg(long, value_name = "NAME")]
    pub helper: Option<String>,
    /// Seed of the episode run, 0 to 9999 [default: the lowest].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(ranges::SEED))]
    pub seed: Option<u32>,
    /// Images per second, 1 to 240.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(ranges::FPS))]
    pub fps: u32,
    /// Draw every N-th frame, 1 to 10000; 30 frames are one second of walking.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(ranges::EVERY))]
    pub every: u32,
    /// Draw detections over the helper's view, by the detector of the run or else the built-in one.
    #[arg(long)]
    pub masks: bool,
}

/// `chaic view`.
#[derive(Args, Debug)]
pub struct ViewArguments {
    /// Folder of the run.
    pub run: PathBuf,
    /// Id of the episode, for example obstacle/test/00 [default: all, at most --max].
    pub episode: Option<String>,
    /// Page to write, for example page.html [default: view.html in the folder of the run].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Only replays of this helper.
    #[arg(long, value_name = "NAME")]
    pub helper: Option<String>,
    /// Largest number of replays in the page, 1 to 1000.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub max: u32,
}

/// `chaic render`.
#[derive(Args, Debug)]
pub struct RenderArguments {
    /// Id of the episode, for example obstacle/test/00, or an episode file.
    pub episode: String,
    /// Agent whose view is rendered: partner, helper or child.
    #[arg(long, default_value = "helper", value_parser = agent)]
    pub agent: AgentId,
    /// Frame, 0 to 1000000; the next frame with a decision is rendered.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(ranges::FRAME))]
    pub frame: u32,
    /// Folder, for example frame, for rgb.png, depth.png (16 bit, millimeters), ids.png (16 bit) and ids.json,
    /// classes.png and classes.json, normals.png (in world coordinates), and plan.png.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Side of the images, 16 to 4096 pixels.
    #[arg(long, alias = "image-size", value_name = "PIXELS", default_value_t = 512)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
    /// Helper of the episode run.
    #[arg(long, default_value = "rhp")]
    pub helper: String,
    /// Seed of the episode run, 0 to 9999.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(ranges::SEED))]
    pub seed: u32,
    /// Rule set: paper, or compat for the behavior of the original's code.
    #[arg(long, value_name = "NAME", default_value = "paper")]
    pub rules: RuleSetName,
    /// Light and colors: canonical, evening, or varied:SEED for domain randomization.
    #[arg(long, value_name = "APPEARANCE", default_value = "canonical")]
    pub appearance: Appearance,
}

/// `chaic play`.
#[derive(Args, Debug)]
pub struct PlayArguments {
    /// Ids of the episodes, for example obstacle/test/00 or shopping/gen/7 [default: the first test
    /// episode of each of the eight tasks].
    pub episodes: Vec<String>,
    /// Page to write, for example game.html.
    #[arg(long, value_name = "FILE", default_value = "play.html")]
    pub out: PathBuf,
}
