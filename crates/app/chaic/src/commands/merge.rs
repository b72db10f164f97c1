//! `chaic merge`.

use anyhow::Result;
use chaic_eval::EvalError;
use chaic_eval::run::merge;
use chaic_eval::suite::SuiteFolder;
use chaic_page::write_report;

use super::eval_partners::print_robustness;
use super::llm::shown_language;
use super::summary::{print_scores, report_of};
use crate::arguments::MergeArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, print_warning};

/// Joins the shards of a run.
pub fn run(arguments: &MergeArguments, format: OutputFormat) -> Result<ExitStatus> {
    if arguments.runs.iter().any(|run| SuiteFolder::is_suite(run)) {
        return merge_partners(arguments, format);
    }
    let run = merge(&arguments.out, &arguments.runs)?;
    let extent = run.progress();
    let missing = extent.total - extent.finished;
    if missing > 0 {
        let runs = counted(missing, "episode run");
        print_warning(&format!("{runs} of {} missing", extent.total));
    }
    if extent.finished > 0 {
        // `merge` has already written the other files of the report.
        let report = report_of(&run);
        write_report(run.folder(), &report, &shown_language(run.folder().path()))?;
        print_scores(format, &report, run.folder(), &[])?;
    }
    Ok(ExitStatus::from_findings(missing > 0 || extent.errors > 0))
}

/// Joins the shards of runs with several partners.
fn merge_partners(arguments: &MergeArguments, format: OutputFormat) -> Result<ExitStatus> {
    if let Some(run) = arguments.runs.iter().find(|run| !SuiteFolder::is_suite(run)) {
        let text = format!("{} has no runs with several partners, as the others do", run.display());
        return Err(EvalError::Options(text).into());
    }
    let (folder, merged) = SuiteFolder::merge(&arguments.out, &arguments.runs)?;
    let mut has_passed = true;
    for run in &merged {
        let extent = run.progress();
        has_passed &= extent.finished == extent.total && extent.errors == 0;
        if extent.finished > 0 {
            write_report(run.folder(), &report_of(run), &shown_language(run.folder().path()))?;
        }
    }
    print_robustness(&folder, format, None)?;
    Ok(ExitStatus::from_findings(!has_passed))
}
