//! Of `chaic export`.

use std::path::PathBuf;

use chaic_core::{AgentId, TaskId};
use clap::{Args, Subcommand};

/// Which format.
#[derive(Debug, Subcommand)]
pub enum ExportCommand {
    /// LeRobot, version 3: tables as Parquet, a film of each episode as MP4.
    Lerobot(LeRobotArguments),
}

/// Of `chaic export lerobot`.
#[derive(Debug, Args)]
pub struct LeRobotArguments {
    /// The run's folder; it has traces.
    pub run: PathBuf,
    /// An empty folder: the data set.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Whose eyes and actions: partner or helper.
    #[arg(long, default_value = "helper", value_parser = super::agent)]
    pub agent: AgentId,
    /// Episodes with this helper alone.
    #[arg(long, value_name = "NAME")]
    pub helper: Option<String>,
    /// Episodes of this task alone.
    #[arg(long, value_name = "TASK")]
    pub task: Option<TaskId>,
    /// Every how many frames one moment is written, 1 to 30; a divisor of 30, which are a second.
    #[arg(long, value_name = "N", default_value_t = 6)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=30))]
    pub every: u32,
    /// Side of pictures, 16 to 1024 pixels; an even number.
    #[arg(long, value_name = "N", default_value_t = 256)]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=1024))]
    pub image_size: u32,
}
