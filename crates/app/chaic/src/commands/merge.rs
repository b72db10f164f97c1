//! `chaic merge`.

use anyhow::Result;
use chaic_eval::run::merge;
use chaic_page::write_report;

use super::summary::{print_scores, report_of};
use crate::arguments::MergeArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, print_warning};

/// Joins the shards of a run.
pub fn run(arguments: &MergeArguments, format: OutputFormat) -> Result<ExitStatus> {
    let run = merge(&arguments.out, &arguments.runs)?;
    let extent = run.progress();
    let missing = extent.total - extent.finished;
    if missing > 0 {
        let runs = counted(missing, "episode run");
        print_warning(&format!("{runs} of {} missing", extent.total));
    }
    if extent.finished > 0 {
        // The merge has written the other files of the report.
        let report = report_of(&run);
        write_report(run.folder(), &report)?;
        print_scores(format, &report, run.folder(), &[])?;
    }
    Ok(ExitStatus::from_findings(missing > 0 || extent.errors > 0))
}
