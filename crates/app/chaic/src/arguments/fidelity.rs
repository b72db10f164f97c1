//! The options of `chaic fidelity`.

use std::path::PathBuf;

use clap::Args;

use super::{Tasks, ranges, tasks};

/// `chaic fidelity`.
#[derive(Args, Debug)]
pub struct FidelityArguments {
    /// The episode files (*.json) of this folder, for example from `chaic import original`.
    #[arg(long, value_name = "DIR")]
    pub episodes: Option<PathBuf>,
    /// Folder of all runs: `paper`, `compat` and `switch/RULE`, each as `chaic eval` leaves it.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Tasks, separated by commas, or `all`. Usual: those that have episodes.
    #[arg(long, value_name = "NAMES", value_parser = tasks)]
    pub task: Option<Tasks>,
    /// Helpers of both rule sets, separated by commas; none must be among them. Usual:
    /// none,random,rhp,oracle.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub helper: Option<Vec<String>>,
    /// Only the first N episodes of each task, 1 to 1000000.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::FIRST))]
    pub first: Option<u32>,
    /// Play both rule sets with N seeds of each episode, 1 to 10000. Usual: 5.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::SEEDS))]
    pub seeds: Option<u32>,
    /// Rules to switch one at a time from compat to paper, separated by commas, or `all` that
    /// differ (usual).
    #[arg(long, value_name = "RULES", value_delimiter = ',')]
    pub switch: Option<Vec<String>>,
    /// Switch no rules.
    #[arg(long, conflicts_with = "switch")]
    pub no_switches: bool,
    /// Helpers of the switches, separated by commas. Usual: none,rhp.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub switch_helper: Option<Vec<String>>,
    /// Play switches with N seeds of each episode, 1 to 10000, at most --seeds. Usual: 1.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::SEEDS))]
    pub switch_seeds: Option<u32>,
    /// Side of all images in pixels, 16 to 2048, instead of what each agent asks for (512).
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(ranges::RUN_SIZE))]
    pub size: Option<u32>,
    /// Episodes at a time, 1 to 1024; changes no result. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
    /// Go on in --out with what is recorded there; --switch adds switches and plays only these.
    #[arg(long)]
    pub resume: bool,
    /// Play nothing; write the document from what is in --out.
    #[arg(long, conflicts_with_all = ["resume", "episodes"])]
    pub only_document: bool,
    /// The document, Markdown, with its figures in `images` beside it; what is between its marks of
    /// causes is kept. Usual: fidelity.md in --out.
    #[arg(long, value_name = "FILE")]
    pub doc: Option<PathBuf>,
}
