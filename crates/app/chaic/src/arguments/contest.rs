//! Options of `chaic submit` and `chaic leaderboard`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::ranges;

/// `chaic submit`.
#[derive(Debug, Subcommand)]
pub enum SubmitCommand {
    /// Pack the folder of a submission; the same content gives the same archive.
    Pack(SubmitPackArguments),
    /// Check a submission: archive, manifest, license, helper and public run.
    #[command(
        long_about = "Check a submission: archive, manifest, license, helper and public run. The exit \
                      code is 1 if a check fails. Nothing is kept."
    )]
    Check(SubmitCheckArguments),
    /// Play a submission on a sealed split; the same command continues after an interruption.
    Run(SubmitRunArguments),
    /// Write the score of a played submission; the same run gives the same bytes.
    Score(SubmitScoreArguments),
    /// Re-simulate a played submission and compare its score.
    #[command(
        long_about = "Re-simulate a played submission and compare its score. The exit code is 1 if \
                      anything differs or is missing."
    )]
    Verify(SubmitVerifyArguments),
}

/// `chaic submit pack`.
#[derive(Args, Debug)]
pub struct SubmitPackArguments {
    /// Folder with submission.toml, helper/ and public/.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Archive to write, for example submission.tar.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// `chaic submit check`.
#[derive(Args, Debug)]
pub struct SubmitCheckArguments {
    /// Archive (.tar, .tar.gz) or folder.
    #[arg(value_name = "SUBMISSION")]
    pub submission: PathBuf,
    /// Run a program although this system lacks a part of the sandbox; records and tables name the part.
    #[arg(long)]
    pub allow_partial_sandbox: bool,
    /// Traces in parallel, 1 to 1024 [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic submit run`.
#[derive(Args, Debug)]
pub struct SubmitRunArguments {
    /// Archive (.tar, .tar.gz) or folder.
    #[arg(value_name = "SUBMISSION")]
    pub submission: PathBuf,
    /// Folder of the sealed episodes (*.json).
    #[arg(long, value_name = "DIR")]
    pub episodes: PathBuf,
    /// Folder, for example results/mine, for the submission, its run and its score.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Also play the helper rhp, as the reference for differences.
    #[arg(long)]
    pub rhp: bool,
    /// Play with the ordinary partner and with each partner of a list: `suite` or a file, for example
    /// sealed/partners.json; docs/arena.md.
    #[arg(long, value_name = "LIST")]
    pub partners: Option<String>,
    /// Run a program although this system lacks a part of the sandbox; records and tables name the part.
    #[arg(long)]
    pub allow_partial_sandbox: bool,
    /// Episodes in parallel, 1 to 1024; does not change results [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic submit score`.
#[derive(Args, Debug)]
pub struct SubmitScoreArguments {
    /// Folder of `chaic submit run`.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Score to write, for example score.json [default: score.json in the folder].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `chaic submit verify`.
#[derive(Args, Debug)]
pub struct SubmitVerifyArguments {
    /// Folder of `chaic submit run`, or the score.json in it.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The published commitment.json: the run must have played exactly its episodes, and with a list of
    /// partners exactly its partners.
    #[arg(long, value_name = "FILE")]
    pub commitment: Option<PathBuf>,
    /// Traces in parallel, 1 to 1024 [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic leaderboard`.
#[derive(Debug, Subcommand)]
pub enum LeaderboardCommand {
    /// Verify all scored submissions of a folder and write a page with their tables.
    #[command(
        long_about = "Verify all scored submissions of a folder and write a page with their tables. A \
                      submission that cannot be confirmed is in no table: the page lists it with the \
                      reason, and the exit code is 1."
    )]
    Build(LeaderboardBuildArguments),
}

/// `chaic leaderboard build`.
#[derive(Args, Debug)]
pub struct LeaderboardBuildArguments {
    /// Folder with a folder of `chaic submit run` for each submission.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Page to write, for example page.html, with the values beside it as .json and .csv.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Title of the page.
    #[arg(long, value_name = "TEXT", default_value = "chaic leaderboard")]
    pub title: String,
    /// The published commitment.json: runs on other episodes or with another list of partners are refused.
    #[arg(long, value_name = "FILE")]
    pub commitment: Option<PathBuf>,
    /// Traces in parallel, 1 to 1024 [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}
