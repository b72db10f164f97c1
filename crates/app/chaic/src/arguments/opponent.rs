//! What can be said of the opponent model.

use std::path::PathBuf;

use clap::Args;

use super::{Of, ranges};

/// Of `chaic collect opponent`.
#[derive(Debug, Args)]
pub struct CollectOpponentArguments {
    /// The file to write, safetensors.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Environments.
    #[arg(long, value_enum, default_value_t = Of::Training)]
    pub of: Of,
    #[command(flatten)]
    pub windows: WindowArguments,
}

/// Of `chaic eval-opponent`.
#[derive(Debug, Args)]
pub struct OpponentArguments {
    /// The weights, a safetensors file.
    #[arg(long, value_name = "FILE")]
    pub weights: PathBuf,
    #[command(flatten)]
    pub windows: WindowArguments,
    /// Write all figures into a JSON file, too.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// How windows are made.
#[derive(Debug, Args)]
pub struct WindowArguments {
    /// Windows of each goal at most, 1 to 1000000.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::WINDOWS))]
    pub of_each: u32,
    /// Episodes that are played for them at most, 1 to 100000.
    #[arg(long, value_name = "N", default_value_t = 200)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::EPISODES))]
    pub episodes: u32,
    /// By what the helper sees: gt, learned, learned:FILE, noisy or noisy:FILE.
    #[arg(long, value_name = "KIND", default_value = "gt")]
    pub perception: String,
    /// By what it tells what its partner does: gt (what is granted, and what follows from things in hands), learned or
    /// learned:FILE.
    #[arg(long, value_name = "KIND", default_value = "gt")]
    pub behavior: String,
    /// Grant it what its partner does, as in the paper.
    #[arg(long)]
    pub granted: bool,
    /// Side of everybody's images, 16 to 1024 pixels.
    #[arg(long, value_name = "N", default_value_t = 128)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub image_size: u32,
}
