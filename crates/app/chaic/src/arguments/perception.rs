//! Of `chaic train` and `chaic eval-perception`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::opponent::CollectOpponentArguments;
use super::ranges;

/// What to train.
#[derive(Debug, Subcommand)]
pub enum TrainCommand {
    /// The detector: which things are in an image, and where.
    Detector(TrainArguments),
    /// The behavior network: what a person in a film does.
    Behavior(TrainArguments),
    /// A helper's policy, which chooses plans, by proximal policy optimization.
    Ppo(TrainArguments),
    /// The same policy by what a teacher would choose.
    Clone(TrainArguments),
    /// A helper's policy of single actions, from images: the paper's way.
    Primitive(TrainArguments),
    /// The opponent model: what a partner is about, and what it can't do.
    Opponent(TrainArguments),
}

/// Of `chaic train`.
#[derive(Debug, Args)]
pub struct TrainArguments {
    /// The training's folder: configuration, checkpoint, curves, weights.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// A TOML file with what differs from the usual training; what it can name is in the config.toml of
    /// any training.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    pub config: Option<PathBuf>,
    /// Begin with these weights, a safetensors file, in place of random ones.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    pub weights: Option<PathBuf>,
    /// Steps in all, 1 to 1000000000, by which the rate is planned.
    #[arg(long, value_name = "N", conflicts_with = "resume")]
    #[arg(value_parser = clap::value_parser!(u64).range(ranges::STEPS))]
    pub steps: Option<u64>,
    /// Go on with the training in --out, from its last checkpoint.
    #[arg(long)]
    pub resume: bool,
}

/// What to collect.
#[derive(Debug, Subcommand)]
pub enum CollectCommand {
    /// Views with what is in them: COCO annotations, color and 16-bit depth.
    Detection(CollectDetectionArguments),
    /// Clips of what partners do, with labels: safetensors files.
    Behavior(CollectBehaviorArguments),
    /// Windows of what helpers saw of their partner, with what it was about: a safetensors file.
    Opponent(CollectOpponentArguments),
}

/// Whose environments are seen; those of evaluation are left to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Of {
    /// What is learned from.
    Training,
    /// What is chosen by.
    Validation,
}

/// Of `chaic collect detection`.
#[derive(Debug, Args)]
pub struct CollectDetectionArguments {
    /// An empty folder: images, depth, annotations.json, statistics.json.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How many views, 1 to 999999.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=999_999))]
    pub views: u32,
    /// Environments.
    #[arg(long, value_enum, default_value_t = Of::Training)]
    pub of: Of,
    /// Places that are looked at.
    #[arg(long, value_enum, default_value_t = Scenes::Crowded)]
    pub scenes: Scenes,
    /// Light and colors; usual: as for training, a third of the scenes varied.
    #[arg(long, value_enum)]
    pub look: Option<Look>,
    /// Views at a time, 1 to 1024; changes no view. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// Of `chaic collect behavior`.
#[derive(Debug, Args)]
pub struct CollectBehaviorArguments {
    /// A folder of its own; if it has clips by the same rules, these are gone on with.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Environments.
    #[arg(long, value_enum, default_value_t = Of::Training)]
    pub of: Of,
    #[command(flatten)]
    pub clips: ClipArguments,
}

/// How clips are made.
#[derive(Debug, Args)]
pub struct ClipArguments {
    /// Clips of each behavior at most, 1 to 5000.
    #[arg(long, value_name = "N", default_value_t = 100)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::CLIPS))]
    pub clips: u32,
    /// Episodes that are played for them at most, 1 to 100000.
    #[arg(long, value_name = "N", default_value_t = 200)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::EPISODES))]
    pub episodes: u32,
    /// By what the helper who films knows the partner in its images: gt, learned, learned:FILE,
    /// noisy or noisy:FILE.
    #[arg(long, value_name = "KIND", default_value = "learned")]
    pub perception: String,
    /// Light and colors.
    #[arg(long, value_enum, default_value_t = Look::Canonical)]
    pub look: Look,
    /// Episodes at a time, 1 to 1024; changes no clip. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// What to evaluate.
#[derive(Debug, Subcommand)]
pub enum EvalPerceptionCommand {
    /// The detector: mean average precision by the COCO definition, failures by cause.
    Detection(DetectionArguments),
    /// The behavior network, on clips that a following helper filmed: share told right, confusion.
    Behavior(BehaviorArguments),
}

/// How views are lit and colored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Look {
    /// The benchmark's own look.
    Canonical,
    /// Light and colors drawn at random, for each scene anew.
    Varied,
}

/// Which places are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scenes {
    /// As episodes begin.
    Natural,
    /// The same with small things and some furniture swapped for others, so that every class occurs.
    AllClasses,
    /// As the detector is trained: crowded.
    Crowded,
}

/// Of `chaic eval-perception detection`.
#[derive(Debug, Args)]
pub struct DetectionArguments {
    /// The weights, a safetensors file; usual: those that come with chaic.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Places that are looked at.
    #[arg(long, value_enum, default_value_t = Scenes::AllClasses)]
    pub scenes: Scenes,
    /// Views that are looked at, 1 to 100000, from environments that nothing was learned from.
    #[arg(long, value_name = "N", default_value_t = 4000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub views: u32,
    /// Light and colors.
    #[arg(long, value_enum, default_value_t = Look::Canonical)]
    pub look: Look,
    /// Write all figures into a JSON file, too.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the rates of faults into a JSON file, for `chaic eval --perception noisy:FILE`.
    #[arg(long, value_name = "FILE")]
    pub faults: Option<PathBuf>,
    /// Write annotations.json and detections.json into a folder, which pycocotools reads.
    #[arg(long, value_name = "DIR")]
    pub coco: Option<PathBuf>,
    /// Views at a time, 1 to 1024; changes no figure. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// Of `chaic eval-perception behavior`.
#[derive(Debug, Args)]
pub struct BehaviorArguments {
    /// The weights, a safetensors file; usual: those that come with chaic.
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    #[command(flatten)]
    pub clips: ClipArguments,
    /// Write all figures into a JSON file, too.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}
