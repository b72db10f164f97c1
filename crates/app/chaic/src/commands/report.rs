//! `chaic report`.

use std::path::Path;

use anyhow::{Context, Result};
use chaic_eval::EvalError;
use chaic_eval::calibration::read_scores;
use chaic_eval::losses::Losses;
use chaic_eval::metrics::{FormulaSet, RunResult, result_of_trace};
use chaic_eval::report::{Format, Report, untraced_failures, untraced_note, write_figure};
use chaic_eval::run::{
    ComparedRun, EpisodeJob, RunFolder, RunOptions, check_same_episodes, planned, read_results,
    visit_planned_traces,
};
use chaic_eval::suite::{Robustness, SuiteFolder};

use crate::arguments::ReportArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, print, print_warning};

/// Prints the scores of a run.
pub fn run(arguments: &ReportArguments, format: OutputFormat) -> Result<ExitStatus> {
    let format = match format {
        OutputFormat::Text => Format::Table,
        OutputFormat::Json => Format::Json,
        OutputFormat::Markdown => Format::Markdown,
        OutputFormat::Csv => Format::Csv,
    };
    if SuiteFolder::is_suite(&arguments.run) {
        return report_robustness(arguments, format);
    }
    let (folder, options) = RunFolder::read(&arguments.run)?;
    if (arguments.from_traces || arguments.belief) && !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    // Results are useful even if the episode files of the run no longer exist.
    let planned = planned(&folder, &options).unwrap_or_else(|e| {
        print_warning(&format!("can't check whether the run is complete: {e}"));
        Vec::new()
    });
    if arguments.belief {
        return report_beliefs(&folder, &options, &planned, format);
    }
    let results = if arguments.from_traces {
        from_traces(&folder, &planned)?
    } else {
        from_journal(&folder, &planned)?
    };
    if results.is_empty() {
        let missing = if arguments.from_traces { "whole trace" } else { "finished episode" };
        anyhow::bail!("{} has no {missing} yet", arguments.run.display());
    }
    let (granted, formulas) = (folder.granted()?, arguments.formulas);
    let (granted, planned) = (granted.as_ref(), planned.as_slice());
    let version = folder.version()?.unwrap_or_default();
    let (version, options, results) = (version.as_str(), &options, results.as_slice());
    let report = Report { version, options, results, planned, granted, formulas };
    // Tables of scores contain the notes. The other outputs have no place for them.
    let is_table = matches!(format, Format::Table | Format::Markdown);
    let is_other = arguments.figure.is_some() || arguments.losses || arguments.baseline.is_some();
    for note in report.notes().iter().filter(|_| !is_table || is_other) {
        print_warning(note);
    }
    if arguments.losses {
        let losses = Losses::from_report(&report)
            .map_err(|problem| anyhow::anyhow!("{}: {problem}", arguments.run.display()))?;
        print(&losses.text(format))?;
        return Ok(ExitStatus::Success);
    }
    if let Some(path) = &arguments.baseline {
        return report_differences(&folder, &report, path, format);
    }
    match &arguments.figure {
        Some(path) => write_figure(&report.scores(), report.labels(), path)?,
        None => print(&report.text(format))?,
    }
    Ok(ExitStatus::Success)
}

/// Prints the robustness of the helpers of runs with several partners.
fn report_robustness(arguments: &ReportArguments, format: Format) -> Result<ExitStatus> {
    let ReportArguments { run, formulas, from_traces, figure, belief, losses, baseline } =
        arguments;
    let is_plain = *formulas == FormulaSet::Paper && figure.is_none() && baseline.is_none();
    if *from_traces || *belief || *losses || !is_plain {
        return Err(EvalError::SeveralPartners { path: run.clone() }.into());
    }
    let (runs, warnings) = SuiteFolder::read(run)?.runs()?;
    warnings.iter().for_each(|warning| print_warning(&warning.to_string()));
    print(&Robustness::from_runs(&runs).text(format))?;
    Ok(ExitStatus::Success)
}

/// Prints the differences to the run in another folder.
fn report_differences(
    run: &RunFolder,
    report: &Report<'_>,
    path: &Path,
    format: Format,
) -> Result<ExitStatus> {
    if !matches!(format, Format::Table | Format::Markdown) {
        let problem = "--baseline prints a table; choose --format text or md";
        return Err(EvalError::Options(problem.to_owned()).into());
    }
    let (folder, options) = RunFolder::read(path)?;
    let results = from_journal(&folder, &planned(&folder, &options).unwrap_or_default())?;
    check_same_episodes(
        ComparedRun { folder: run, options: report.options, results: report.results },
        ComparedRun { folder: &folder, options: &options, results: &results },
    )?;
    let name = path.display().to_string();
    let text = report.differences_text(&name, &results, format);
    print(&text.with_context(|| format!("{name} has no helper with episodes of this run"))?)?;
    Ok(ExitStatus::Success)
}

/// Prints the quality of the beliefs in the traces.
fn report_beliefs(
    folder: &RunFolder,
    options: &RunOptions,
    planned: &[EpisodeJob],
    format: Format,
) -> Result<ExitStatus> {
    let (scores, warnings) = read_scores(folder, options, planned)?;
    warnings.iter().for_each(|warning| print_warning(warning));
    if scores.helpers.is_empty() {
        anyhow::bail!(
            "{} has no whole trace with a belief about a target set; helpers such as infer record \
             one, except in moving_house, which has a single target set",
            folder.path().display()
        );
    }
    print(&scores.text(format))?;
    Ok(ExitStatus::Success)
}

fn from_journal(folder: &RunFolder, planned: &[EpisodeJob]) -> Result<Vec<RunResult>> {
    let (results, warnings) = read_results(&folder.results(), planned)?;
    for warning in warnings {
        print_warning(&warning.to_string());
    }
    Ok(results)
}

/// Returns the results of the traces of planned episode runs, and those of failed episode runs.
fn from_traces(folder: &RunFolder, planned: &[EpisodeJob]) -> Result<Vec<RunResult>> {
    let mut results = Vec::new();
    let warnings = visit_planned_traces(folder, planned, &mut |trace| {
        results.extend(result_of_trace(trace));
        Ok(())
    })?;
    warnings.iter().for_each(|warning| print_warning(warning));
    match read_results(&folder.results(), planned) {
        Ok((recorded, _)) => {
            if let Some(note) = untraced_note(&recorded, &results) {
                print_warning(&note);
            }
            results.extend(untraced_failures(&recorded, &results));
        }
        Err(e) => print_warning(&format!(
            "can't check whether traces are missing or episode runs failed: {e}"
        )),
    }
    Ok(results)
}
