//! Options of `chaic collect`, `chaic train`, and `chaic eval detection|behavior|tracks`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::opponent::CollectOpponentArguments;
use super::{SplitArgument, ranges};

/// `chaic train`.
#[derive(Debug, Subcommand)]
pub enum TrainCommand {
    /// Train the detector: class, mask and position of each object in an image.
    #[command(aliases = ["detector", "perception"])]
    Detection(TrainArguments),
    /// Train the behavior network, which classifies the action of a person in a clip.
    Behavior(TrainArguments),
    /// Train a policy that chooses plans, by proximal policy optimization.
    Ppo(TrainArguments),
    /// Train the same policy by behavior cloning of an expert.
    Clone(TrainArguments),
    /// Train a policy that reads images, as in the paper.
    #[command(alias = "primitive")]
    Visual(TrainArguments),
    /// Train the policy of a partner by behavior cloning of other partners, simulated or recorded.
    Partner(TrainArguments),
    /// Train the opponent model, which infers the partner's goal and limits.
    Opponent(TrainArguments),
}

/// Options of all trainings.
#[derive(Args, Debug)]
pub struct TrainArguments {
    /// Folder of the training, for example runs/ppo: configuration, checkpoint, curves, weights.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// TOML file with the keys that differ from the default. The config.toml of a training has all keys with a value.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    pub config: Option<PathBuf>,
    /// Change one key of the configuration, for example rollout.image_size=128; repeatable.
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "resume")]
    pub set: Vec<String>,
    /// Initial weights, a safetensors file, instead of random ones.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    pub weights: Option<PathBuf>,
    /// Number of steps, of the first stage for `detection`, 1 to 1000000000; the learning rate schedule depends on it.
    #[arg(long, value_name = "N", conflicts_with = "resume")]
    #[arg(value_parser = clap::value_parser!(u64).range(ranges::STEPS))]
    pub steps: Option<u64>,
    /// Continue the training in --out from its last checkpoint.
    #[arg(long)]
    pub resume: bool,
}

/// `chaic collect`.
#[derive(Debug, Subcommand)]
pub enum CollectCommand {
    /// Collect images with COCO annotations, color and 16-bit depth.
    #[command(aliases = ["perception", "detector"])]
    Detection(CollectDetectionArguments),
    /// Collect labeled clips of partners: safetensors files.
    Behavior(CollectBehaviorArguments),
    /// Collect observations of partners with their goals: a safetensors file.
    Opponent(CollectOpponentArguments),
}

/// `chaic collect detection`.
#[derive(Args, Debug)]
pub struct CollectDetectionArguments {
    /// An empty folder, for example views, for images, depth, annotations.json and statistics.json.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Number of views, 1 to 999999.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=999_999))]
    pub views: u32,
    /// Part of the training data, for example validation.
    #[arg(long, alias = "of", value_enum, default_value_t = SplitArgument::Train)]
    pub split: SplitArgument,
    /// Kind of scenes.
    #[arg(long, value_enum, default_value_t = SceneSelection::Crowded)]
    pub scenes: SceneSelection,
    /// Light and colors [default: a third of crowded scenes varied, as in the training, others canonical].
    #[arg(long, alias = "look", value_enum)]
    pub appearance: Option<AppearanceArgument>,
    /// Views in parallel, 1 to 1024; does not change the views [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic collect behavior`.
#[derive(Args, Debug)]
pub struct CollectBehaviorArguments {
    /// A new folder, for example clips, or one with clips of the same configuration, which is continued.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Part of the training data, for example validation.
    #[arg(long, alias = "of", value_enum, default_value_t = SplitArgument::Train)]
    pub split: SplitArgument,
    #[command(flatten)]
    pub clips: ClipArguments,
}

/// Clips of partners.
#[derive(Args, Debug)]
pub struct ClipArguments {
    /// Maximum number of clips per behavior, 1 to 5000.
    #[arg(long, alias = "clips", value_name = "N", default_value_t = 100)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::CLIPS))]
    pub max_per_class: u32,
    /// Maximum number of episodes to play, 1 to 100000.
    #[arg(long, alias = "episodes", value_name = "N", default_value_t = 200)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::EPISODES))]
    pub n_episodes: u32,
    /// Detection of the partner in the helper's images: gt, learned, learned:FILE, noisy or noisy:FILE.
    #[arg(long, value_name = "KIND", default_value = "learned")]
    pub perception: String,
    /// Light and colors.
    #[arg(long, alias = "look", value_enum, default_value_t = AppearanceArgument::Canonical)]
    pub appearance: AppearanceArgument,
    /// Episodes in parallel, 1 to 1024; does not change the clips [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// Old spelling of `chaic eval detection` and `chaic eval behavior`.
#[derive(Debug, Subcommand)]
pub enum PerceptionEvaluation {
    /// Old spelling of `chaic eval detection`.
    Detection(DetectionArguments),
    /// Old spelling of `chaic eval behavior`.
    Behavior(BehaviorArguments),
}

/// Light and colors of views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AppearanceArgument {
    /// Appearance of the benchmark.
    Canonical,
    /// Random light and colors for each scene.
    Varied,
}

/// Kind of scenes of views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SceneSelection {
    /// Initial states of episodes.
    Natural,
    /// The same with random replacements of small objects and furniture, so that every class occurs.
    AllClasses,
    /// Crowded scenes, as in the training of the detector.
    Crowded,
}

/// `chaic eval detection`.
#[derive(Args, Debug)]
pub struct DetectionArguments {
    /// Weights: a safetensors file [default: the built-in weights].
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    /// Kind of scenes.
    #[arg(long, value_enum, default_value_t = SceneSelection::AllClasses)]
    pub scenes: SceneSelection,
    /// Number of views of held-out environments, 1 to 100000.
    #[arg(long, value_name = "N", default_value_t = 4000)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub views: u32,
    /// Light and colors.
    #[arg(long, alias = "look", value_enum, default_value_t = AppearanceArgument::Canonical)]
    pub appearance: AppearanceArgument,
    /// Also write all metrics to a JSON file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the error rates to a JSON file for `chaic eval --perception noisy:FILE`.
    #[arg(long, alias = "faults", value_name = "FILE")]
    pub error_rates: Option<PathBuf>,
    /// Write annotations.json and detections.json for pycocotools into a folder.
    #[arg(long, value_name = "DIR")]
    pub coco: Option<PathBuf>,
    /// Views in parallel, 1 to 1024; does not change the metrics [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic eval behavior`.
#[derive(Args, Debug)]
pub struct BehaviorArguments {
    /// Weights: a safetensors file [default: the built-in weights].
    #[arg(long, value_name = "FILE")]
    pub weights: Option<PathBuf>,
    #[command(flatten)]
    pub clips: ClipArguments,
    /// Keep the clips in this folder. The next evaluation with the same options reads them, and an
    /// interrupted one continues.
    #[arg(long, value_name = "DIR")]
    pub clip_folder: Option<PathBuf>,
    /// Also write all metrics to a JSON file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// `chaic eval tracks`.
#[derive(Args, Debug)]
pub struct TracksArguments {
    /// Evaluated perception: learned, noisy, gt_names (each also as NAME:FILE), gt_masks or gt_tracks.
    #[arg(long, value_name = "KIND", default_value = "learned")]
    pub perception: String,
    /// Number of episodes, 1 to 5000; tasks take turns.
    #[arg(long, value_name = "N", default_value_t = 32)]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::TRACK_EPISODES))]
    pub n_episodes: u32,
    /// Also write all metrics to a JSON file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Episodes in parallel, 1 to 1024; does not change the metrics [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}
