//! `chaic explain`.

use anyhow::Result;
use chaic_eval::explain::{explain, find_trace};

use super::recorded::read_recorded;
use crate::arguments::ExplainArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, print_result};

/// Prints what the helper of a recorded episode believed and planned.
pub fn run(arguments: &ExplainArguments, format: OutputFormat) -> Result<ExitStatus> {
    let ExplainArguments { run, episode, helper, seed } = arguments;
    let recorded = read_recorded(
        run,
        |folder, traces| find_trace(folder, traces, episode, helper.as_deref(), *seed),
        "it is not explained",
    )?;
    let explanation = explain(&recorded.trace, recorded.episode.setup());
    print_result(format, &explanation, &explanation.text())?;
    Ok(ExitStatus::from_findings(!recorded.is_whole))
}
