//! Options of `chaic llm`.

use std::path::PathBuf;

use chaic_core::AgentId;
use clap::Subcommand;

use super::{EndpointArguments, agent, ranges};

/// `chaic llm`.
#[derive(Debug, Subcommand)]
pub enum LlmCommand {
    /// Write the prompt templates into a folder for editing.
    Templates {
        /// An empty folder for the templates, for example templates.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Print prompts, answers and choices of an episode with the events between them.
    Show {
        /// Folder of the run.
        run: PathBuf,
        /// Id of the episode, for example obstacle/test/00.
        episode: String,
        /// Helper of the episode run [default: the first that uses a language model].
        #[arg(long, value_name = "NAME")]
        helper: Option<String>,
        /// Seed of the episode run, 0 to 9999 [default: the lowest].
        #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(ranges::SEED))]
        seed: Option<u32>,
        /// Agent whose decisions are printed: helper or partner.
        #[arg(long, default_value = "helper", value_parser = agent)]
        agent: AgentId,
        /// Leave the prompts out.
        #[arg(long)]
        brief: bool,
    },
    /// Send two test questions to the endpoint: one with a JSON schema, one as text.
    Check {
        #[command(flatten)]
        endpoint: EndpointArguments,
    },
}
