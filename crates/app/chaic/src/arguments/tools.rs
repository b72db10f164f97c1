//! Options of `chaic list`, `chaic completions` and `chaic man`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use clap_complete::Shell;

/// `chaic list`.
#[derive(Debug, Subcommand)]
pub enum ListCommand {
    /// List the built-in helpers with their grants.
    Helpers,
    /// List the tasks.
    Tasks,
    /// List the kinds of people and their impairments.
    People,
    /// List the agents that may control the partner.
    Partners,
    /// List the rules with their values in both rule sets.
    Rules,
    /// List the runs in a folder.
    Runs {
        /// Folder that contains run folders.
        #[arg(value_name = "DIR", default_value = "runs")]
        folder: PathBuf,
    },
}

/// `chaic completions`.
#[derive(Args, Debug)]
pub struct CompletionsArguments {
    /// Shell that reads the script.
    #[arg(value_enum)]
    pub shell: Shell,
}

/// `chaic man`.
#[derive(Args, Debug)]
pub struct ManArguments {
    /// Folder for the pages, for example ~/.local/share/man/man1.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}
