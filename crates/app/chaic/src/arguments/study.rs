//! Options of `chaic study`.

use std::net::SocketAddr;
use std::path::PathBuf;

use chaic_export::card::Creator;
use clap::{Args, Subcommand};

use super::exec::{ExecArguments, HelperList, helpers};
use super::ranges;

/// `chaic study`.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Check a study.toml: conditions, orders, length, and balance with simulated drop-outs.
    Check(StudyCheckArguments),
    /// Write the page of a study: one file that needs no network.
    Build(StudyBuildArguments),
    /// Serve the page of a study, give out its slots and store the data of participants.
    #[command(
        long_about = "Serve the page of a study, give out its slots and store the data of participants, until \
                      Ctrl-C. Needs a build with the feature `study-server`."
    )]
    Serve(StudyServeArguments),
    /// Check collected files and write verified traces and a Psych-DS data set.
    #[command(
        long_about = "Check collected files and write verified traces and a Psych-DS data set. The \
                      exit code is 1 if a trace differs from its re-simulation."
    )]
    Export(StudyExportArguments),
    /// Remove all data of a participant from a folder.
    #[command(
        long_about = "Remove all data of a participant from a folder. The exit code is 1 if an entry \
                      cannot be searched and may still hold data."
    )]
    Delete(StudyDeleteArguments),
}

/// `chaic study check`.
#[derive(Args, Debug)]
pub struct StudyCheckArguments {
    /// Definition of the study.
    pub study: PathBuf,
    /// Simulated participants, 1 to 10000 [default: those of the study].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::PARTICIPANTS))]
    pub participants: Option<u32>,
    /// Share of simulated participants who leave without notice, 0 to 90 percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 20, value_parser = clap::value_parser!(u8).range(0..=90))]
    pub dropout: u8,
}

/// `chaic study build`.
#[derive(Args, Debug)]
pub struct StudyBuildArguments {
    /// Definition of the study.
    pub study: PathBuf,
    /// Page to write, for example my_study.html.
    #[arg(long, value_name = "FILE", default_value = "study.html")]
    pub out: PathBuf,
}

/// `chaic study serve`.
#[derive(Args, Debug)]
pub struct StudyServeArguments {
    /// Definition of the study.
    pub study: PathBuf,
    /// Folder of the participants' files, which is created if it is missing.
    #[arg(long, value_name = "DIR")]
    pub data: PathBuf,
    /// Address and port; port 0 selects a free one.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8040")]
    pub listen: SocketAddr,
    /// Name under which browsers reach the server, such as study.example.org; repeat it for several.
    #[arg(long = "host", value_name = "NAME")]
    pub hosts: Vec<String>,
    /// Helper of your own that study.toml names: NAME=exec:COMMAND or NAME=policy:FILE; repeatable.
    #[arg(long, value_name = "HELPER", value_parser = helpers)]
    pub helper: Vec<HelperList>,
    /// Grants and limits of helper processes.
    #[command(flatten)]
    pub exec: ExecArguments,
}

/// `chaic study export`.
#[derive(Args, Debug)]
pub struct StudyExportArguments {
    /// Files of participants (*.jsonl), or folders with such files.
    #[arg(required = true)]
    pub data: Vec<PathBuf>,
    /// Definition of the study, the one from which the page was built.
    #[arg(long, value_name = "FILE")]
    pub study: PathBuf,
    /// An empty folder for the data set, for example my_data.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Also write the verified episodes as a LeRobot data set, without practice.
    #[arg(long)]
    pub lerobot: bool,
    /// Creator that card and metadata of the LeRobot data set name: person:NAME or organization:NAME;
    /// repeatable [default: none].
    #[arg(long, value_name = "KIND:NAME", requires = "lerobot")]
    pub creator: Vec<Creator>,
}

/// `chaic study delete`.
#[derive(Args, Debug)]
pub struct StudyDeleteArguments {
    /// Code of the participant, for example K7QXM2RBTA.
    pub code: String,
    /// Folder with collected or exported data.
    pub folder: PathBuf,
}
