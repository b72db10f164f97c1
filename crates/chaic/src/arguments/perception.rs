//! Of `chaic train` and `chaic eval-perception`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

/// What to train.
#[derive(Debug, Subcommand)]
pub enum TrainCommand {
    /// The detector: which things are in an image, and where.
    Detector(TrainArguments),
}

/// Of `chaic train`.
#[derive(Debug, Args)]
pub struct TrainArguments {
    /// The training's folder: configuration, checkpoint, curves, weights.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// A TOML file with what differs from the shipped detector's training; what it can name is in the
    /// config.toml of any training.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    pub config: Option<PathBuf>,
    /// Steps in all, by which the rate is planned.
    #[arg(long, value_name = "N", conflicts_with = "resume")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..))]
    pub steps: Option<u64>,
    /// Go on with the training in --out, from its last checkpoint.
    #[arg(long)]
    pub resume: bool,
}

/// What to evaluate.
#[derive(Debug, Subcommand)]
pub enum EvalPerceptionCommand {
    /// The detector: mean average precision by the COCO definition, failures by cause.
    Detection(DetectionArguments),
}

/// How views are lit and colored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Look {
    /// The benchmark's own look.
    Canonical,
    /// Light and colors drawn at random, for each scene anew.
    Varied,
}

/// Of `chaic eval-perception detection`.
#[derive(Debug, Args)]
pub struct DetectionArguments {
    /// The weights, a safetensors file.
    #[arg(long, value_name = "FILE")]
    pub weights: PathBuf,
    /// Views that are looked at, from environments that nothing was learned from.
    #[arg(long, value_name = "N", default_value_t = 2000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub views: u32,
    /// Light and colors.
    #[arg(long, value_enum, default_value_t = Look::Canonical)]
    pub look: Look,
    /// Write all figures into a JSON file, too.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Views at a time; changes no figure. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
}
