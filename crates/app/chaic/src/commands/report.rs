//! `chaic report`.

use anyhow::Result;
use chaic_eval::EvalError;
use chaic_eval::metrics::{RunResult, tally};
use chaic_eval::report::{Format, Report, without_trace, write_figure};
use chaic_eval::run::{Item, RunFolder, planned, read_results};

use crate::arguments::ReportArguments;
use crate::exit::Ended;
use crate::output::{complain, say};

/// Prints the scores of a run.
pub fn run(arguments: &ReportArguments) -> Result<Ended> {
    let (folder, options) = RunFolder::read(&arguments.run)?;
    if arguments.from_traces && !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    // Results say something even where the run's episodes are gone.
    let planned = planned(&folder, &options).unwrap_or_else(|e| {
        complain(&format!("warning: can't tell whether the run is whole: {e}"));
        Vec::new()
    });
    let results = if arguments.from_traces {
        from_traces(&folder, &planned)?
    } else {
        from_journal(&folder, &planned)?
    };
    if results.is_empty() {
        let what = if arguments.from_traces { "whole trace" } else { "finished episode" };
        anyhow::bail!("{} has no {what} yet", arguments.run.display());
    }
    let (granted, formulas) = (folder.granted()?, arguments.formulas);
    let (granted, planned) = (granted.as_ref(), planned.as_slice());
    let report = Report { options: &options, results: &results, planned, granted, formulas };
    // Tables say it themselves; numbers and figures have hardly a place for it.
    let is_table = matches!(arguments.format, Format::Table | Format::Markdown);
    for note in report.notes().iter().filter(|_| !is_table || arguments.figure.is_some()) {
        complain(&format!("warning: {note}"));
    }
    match &arguments.figure {
        Some(path) => write_figure(&report.scores(), report.labels(), path)?,
        None => say(&report.text(arguments.format))?,
    }
    Ok(Ended::Well)
}

fn from_journal(folder: &RunFolder, planned: &[Item]) -> Result<Vec<RunResult>> {
    let (results, warnings) = read_results(&folder.results(), planned)?;
    for warning in warnings {
        complain(&format!("warning: {warning}"));
    }
    Ok(results)
}

fn from_traces(folder: &RunFolder, planned: &[Item]) -> Result<Vec<RunResult>> {
    let mut results = Vec::new();
    for path in folder.traces()? {
        let (trace, warnings) = folder.read_trace(&path)?;
        for warning in warnings {
            complain(&format!("warning: {warning}"));
        }
        results.extend(tally(&trace));
    }
    match read_results(&folder.results(), planned) {
        Ok((noted, _)) => {
            if let Some(note) = without_trace(&noted, &results) {
                complain(&format!("warning: {note}"));
            }
        }
        Err(e) => complain(&format!("warning: can't tell whether traces are missing: {e}")),
    }
    Ok(results)
}
