//! Options of `chaic export`.

use std::path::PathBuf;

use chaic_core::{AgentId, TaskId};
use chaic_episodes::Split;
use chaic_export::card::Creator;
use clap::{Args, Subcommand};

use super::{Tasks, agent, task, tasks};

/// `chaic export`.
#[derive(Debug, Subcommand)]
pub enum ExportCommand {
    /// Export a LeRobot data set, version 3: Parquet tables and an MP4 video of each episode.
    Lerobot(LeRobotArguments),
    /// Export the initial states of episodes: a JSON file each, a card and Croissant metadata.
    Episodes(EpisodesArguments),
}

/// `chaic export episodes`.
#[derive(Args, Debug)]
pub struct EpisodesArguments {
    /// Split to export: standard, gen:A..B, gen-standard:A..B, test or train, for example gen:0..100.
    #[arg(long, value_name = "SPLIT", required_unless_present = "episodes")]
    pub split: Option<Split>,
    /// Export the generated episode files (*.json) of this folder instead of a split, for example those of an
    /// opened contest.
    #[arg(long, value_name = "DIR", conflicts_with = "split")]
    pub episodes: Option<PathBuf>,
    /// Tasks, separated by commas, or `all` for those of the paper [default: all, or those of the folder].
    #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks)]
    pub task: Option<Tasks>,
    /// An empty folder for the data set, for example my_data.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// `chaic export lerobot`.
#[derive(Args, Debug)]
pub struct LeRobotArguments {
    /// Folder of a run with traces.
    pub run: PathBuf,
    /// An empty folder for the data set, for example my_data.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Agent whose observations and actions are exported: partner or helper.
    #[arg(long, default_value = "helper", value_parser = agent)]
    pub agent: AgentId,
    /// Export episodes with this helper only.
    #[arg(long, value_name = "NAME")]
    pub helper: Option<String>,
    /// Export episodes of this task only.
    #[arg(long, value_name = "TASK", value_parser = task)]
    pub task: Option<TaskId>,
    /// Frames between samples, 1 to 30; a divisor of 30 (30 frames are one second).
    #[arg(long, value_name = "N", default_value_t = 6)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=30))]
    pub every: u32,
    /// Side of the images, 16 to 1024 pixels; an even number.
    #[arg(long, alias = "image-size", value_name = "PIXELS", default_value_t = 256)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub size: u32,
    /// Creator that card and metadata name: person:NAME or organization:NAME; repeatable [default: none].
    #[arg(long, value_name = "KIND:NAME")]
    pub creator: Vec<Creator>,
}
