//! `chaic merge`.

use anyhow::Result;
use chaic_eval::report::Format;
use chaic_eval::run::merge;

use super::eval::report_of;
use crate::arguments::MergeArguments;
use crate::exit::Ended;
use crate::output::{complain, counted, say};

/// Joins the shards of a run.
pub fn run(arguments: &MergeArguments) -> Result<Ended> {
    let run = merge(&arguments.out, &arguments.runs)?;
    let extent = run.extent();
    let missing = extent.total - extent.finished;
    if missing > 0 {
        complain(&format!(
            "warning: {} of {} missing",
            counted(missing, "episode run"),
            extent.total
        ));
    }
    if extent.finished > 0 {
        // The merge has written it already.
        say(&report_of(&run).text(Format::Table))?;
    }
    Ok(if missing > 0 || extent.errors > 0 { Ended::WithFindings } else { Ended::Well })
}
