//! `chaic report`.

use anyhow::Result;
use chaic_eval::metrics::{RunResult, tally};
use chaic_eval::report::{Report, write_figure};
use chaic_eval::run::{RunFolder, read_results};
use chaic_eval::trace;

use crate::Ended;
use crate::arguments::ReportArguments;
use crate::output::{complain, say};

/// Prints the scores of a run.
pub fn run(arguments: &ReportArguments) -> Result<Ended> {
    let (folder, options) = RunFolder::read(&arguments.run)?;
    let results =
        if arguments.from_traces { from_traces(&folder)? } else { from_journal(&folder)? };
    if results.is_empty() {
        anyhow::bail!("{} has no finished episode yet", arguments.run.display());
    }
    let report = Report { options: &options, results: &results, formulas: arguments.formulas };
    match &arguments.figure {
        Some(path) => write_figure(&report.scores(), path)?,
        None => say(&report.text(arguments.format))?,
    }
    Ok(Ended::Well)
}

fn from_journal(folder: &RunFolder) -> Result<Vec<RunResult>> {
    let (results, warnings) = read_results(&folder.results())?;
    for warning in warnings {
        complain(&format!("warning: {warning}"));
    }
    Ok(results)
}

fn from_traces(folder: &RunFolder) -> Result<Vec<RunResult>> {
    let mut results = Vec::new();
    for path in folder.traces()? {
        let (trace, warnings) = trace::read(&path)?;
        for warning in warnings {
            complain(&format!("warning: {warning}"));
        }
        results.extend(tally(&trace));
    }
    Ok(results)
}
