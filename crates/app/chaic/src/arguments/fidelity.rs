//! Options of `chaic fidelity`.

use std::path::PathBuf;

use clap::Args;

use super::{Tasks, ranges, tasks};

/// `chaic fidelity`.
#[derive(Args, Debug)]
pub struct FidelityArguments {
    /// Folder of episode files (*.json), for example from `chaic import original`; with --resume, of the same episodes.
    #[arg(long, value_name = "DIR")]
    pub episodes: Option<PathBuf>,
    /// Folder of all runs, for example runs/fidelity: `paper`, `compat` and `switch/RULE`, each written as by
    /// `chaic eval`.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Tasks, separated by commas, or `all` [default: those that have episodes].
    #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks)]
    pub task: Option<Tasks>,
    /// Helpers of both rule sets, separated by commas, among them none
    /// [default: none,random,rhp,oracle].
    #[arg(long, alias = "helpers", value_name = "NAMES", value_delimiter = ',')]
    pub helper: Option<Vec<String>>,
    /// Only the first N episodes of each task, 1 to 1000000.
    #[arg(long, alias = "first", value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::N_EPISODES))]
    pub n_episodes: Option<u32>,
    /// Number of seeds per episode with both rule sets, 1 to 10000, for example 10 [default: 5].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::SEEDS))]
    pub seeds: Option<u32>,
    /// Rules to switch one at a time from compat to paper, separated by commas, or `all` that differ
    /// [default: all].
    #[arg(long, value_name = "RULES", value_delimiter = ',')]
    pub switch: Option<Vec<String>>,
    /// Switch no rules.
    #[arg(long, conflicts_with = "switch")]
    pub no_switches: bool,
    /// Helpers of the switches, separated by commas [default: none,rhp].
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub switch_helper: Option<Vec<String>>,
    /// Seeds per episode with switches, 1 to 10000, at most --seeds [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::SEEDS))]
    pub switch_seeds: Option<u32>,
    /// Side of all images in pixels, 16 to 2048 [default: 512, or as each agent requests].
    #[arg(long, alias = "image-size", value_name = "PIXELS")]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::RUN_SIZE))]
    pub size: Option<u32>,
    /// Episodes in parallel, 1 to 1024; does not change results [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
    /// Continue the runs in --out; --switch adds switches and plays only these.
    #[arg(long)]
    pub resume: bool,
    /// Play nothing; write the document from the runs in --out.
    #[arg(long, conflicts_with_all = ["resume", "episodes"])]
    pub only_document: bool,
    /// Markdown document to write, with its figures in `images` next to it. Text between `<!-- causes` and
    /// `<!-- end of causes -->` in an existing document is kept [default: fidelity.md in --out].
    #[arg(long, value_name = "FILE")]
    pub doc: Option<PathBuf>,
}
