//! Options of `chaic episodes` and `chaic import`.

use std::ops::Range;
use std::path::PathBuf;

use chaic_core::TaskId;
use chaic_episodes::Split;
use clap::{Args, Subcommand, ValueEnum};

use super::{Tasks, seed_range, task, tasks};

/// `chaic episodes`.
#[derive(Debug, Subcommand)]
pub enum EpisodesCommand {
    /// List the episodes of a split.
    List {
        /// Split of episodes: test, train, standard, gen:A..B or gen-standard:A..B, for example gen:0..100.
        #[arg(long, default_value = "test")]
        split: Split,
        /// Tasks, separated by commas, or `all`.
        #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks, default_value = "all")]
        task: Tasks,
    },
    /// Draw a floor plan of the initial state of an episode.
    Show {
        /// Id of the episode, for example obstacle/test/00, or an episode file.
        episode: String,
        /// Image to write, for example plan.png.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Width of the image, 64 to 8192 pixels.
        #[arg(long, default_value_t = 1200, value_parser = clap::value_parser!(u32).range(64..=8192))]
        width: u32,
    },
    /// Generate episodes and write them as files.
    Generate {
        /// Task of the episodes.
        #[arg(long, value_parser = task)]
        task: TaskId,
        /// Seeds from A to below B, for example 0..100; short for --split gen:A..B.
        #[arg(long, value_name = "A..B", value_parser = seed_range)]
        #[arg(conflicts_with = "split", required_unless_present = "split")]
        seeds: Option<Range<u64>>,
        /// Split to generate: standard, gen:A..B, gen-standard:A..B, test or train, for example gen:0..100.
        #[arg(long)]
        split: Option<Split>,
        /// Folder for the files, for example my_episodes.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Check episode files, or all episodes of a split.
    #[command(
        long_about = "Check episode files, or all episodes of a split. The exit code is 1 if one \
                      cannot be played."
    )]
    Validate {
        /// Episode files.
        #[arg(required_unless_present = "split", conflicts_with = "split")]
        files: Vec<PathBuf>,
        /// Check a split instead, for example standard, whose episodes must also have their committed digests.
        #[arg(long)]
        split: Option<Split>,
    },
    /// Make a sealed split: episodes that follow from a secret, and a public commitment to them.
    Seal {
        /// File of the secret; it is created if it does not exist. Keep the file secret until the split is
        /// opened.
        #[arg(long, value_name = "FILE")]
        secret: PathBuf,
        /// Tasks, separated by commas, or `all`.
        #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks, default_value = "all")]
        task: Tasks,
        /// Episodes of each task, 1 to 10000.
        #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..=10_000))]
        n_episodes: u16,
        /// Partners to draw from the secret, 0 to 100; they are written to partners.json, for --partners.
        #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=100))]
        n_partners: u8,
        /// Folder, for example sealed, for commitment.json, which you publish, and the folder `episodes`, which
        /// you do not.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Open a sealed split: check the secret against the commitment and write the episodes.
    Open {
        /// The published secret.
        #[arg(long, value_name = "FILE")]
        secret: PathBuf,
        /// The published commitment.json.
        #[arg(long, value_name = "FILE")]
        commitment: PathBuf,
        /// Folder for the episode files, for example opened.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// File for the partners of the split, if it has any.
        #[arg(long, value_name = "FILE")]
        partners: Option<PathBuf>,
    },
    /// Print the JSON schema of an episode file.
    Schema,
}

/// `chaic import`.
#[derive(Debug, Subcommand)]
pub enum ImportCommand {
    /// Import the episodes of the original CHAIC; docs/import.md explains how to download them.
    Original(OriginalArguments),
}

/// `chaic import original`.
#[derive(Args, Debug)]
pub struct OriginalArguments {
    /// Data set folder of the CHAIC repository, with train_dataset and test_dataset.
    #[arg(long, value_name = "DIR")]
    pub dataset: PathBuf,
    /// The unpacked tdw Python package, version 1.12.27.x, or the folder that contains it.
    #[arg(long, value_name = "DIR")]
    pub tdw: PathBuf,
    /// Folder for the episode files, for example imported.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Import one half only, for example test [default: every half that exists].
    #[arg(long, value_name = "HALF")]
    pub split: Option<ImportSplit>,
    /// Skip episodes that cannot be imported and list them; the exit code is 1 if any was skipped.
    #[arg(long)]
    pub keep_going: bool,
}

/// A half of the original data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ImportSplit {
    /// Floor plans 1 and 4.
    Train,
    /// Floor plans 2 and 5.
    Test,
}
