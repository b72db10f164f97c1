//! Options of the opponent model.

use std::path::PathBuf;

use clap::Args;

use super::{SplitArgument, ranges};

/// `chaic collect opponent`.
#[derive(Args, Debug)]
pub struct CollectOpponentArguments {
    /// File to write, for example windows.safetensors.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Part of the training data, for example validation.
    #[arg(long, alias = "of", value_enum, default_value_t = SplitArgument::Train)]
    pub split: SplitArgument,
    #[command(flatten)]
    pub windows: WindowArguments,
}

/// `chaic eval opponent`.
#[derive(Args, Debug)]
pub struct OpponentArguments {
    /// Weights: a safetensors file of an opponent model, or of a policy that includes one.
    #[arg(long, value_name = "FILE")]
    pub weights: PathBuf,
    #[command(flatten)]
    pub windows: WindowArguments,
    /// Also write all metrics to a JSON file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// Windows of observations of a partner.
#[derive(Args, Debug)]
pub struct WindowArguments {
    /// Maximum number of windows per goal, 1 to 1000000.
    #[arg(long, alias = "of-each", value_name = "N", default_value_t = 1000)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::WINDOWS))]
    pub max_per_class: u32,
    /// Maximum number of episodes to play, 1 to 100000.
    #[arg(long, alias = "episodes", value_name = "N", default_value_t = 200)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::EPISODES))]
    pub n_episodes: u32,
    /// Object detection of the helper: gt, learned, learned:FILE, noisy or noisy:FILE.
    #[arg(long, value_name = "KIND", default_value = "gt")]
    pub perception: String,
    /// Behavior recognition of the helper: gt (granted state and held objects), learned or learned:FILE.
    #[arg(long, value_name = "KIND", default_value = "gt")]
    pub behavior: String,
    /// Grant the partner's current behavior to the helper, as in the paper.
    #[arg(long, alias = "granted")]
    pub grant_behavior: bool,
    /// Side of the images of all agents, 16 to 1024 pixels.
    #[arg(long, alias = "image-size", value_name = "PIXELS", default_value_t = 128)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub size: u32,
}
