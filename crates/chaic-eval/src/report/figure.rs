//! Scores as the paper's figure: transport rates with one standard error.

use std::path::Path;

use crate::error::{EvalError, Result};
use crate::figure::{Bar, Bars, FigureError, HelperBars, transport_rate};
use crate::metrics::Scores;
use crate::report::tables::title;

/// Draws transport rates with their standard errors into a `.svg` or `.png` file.
///
/// # Errors
/// If the extension is another one, there are more helpers than can be told apart, or the file
/// system refuses.
pub fn write_figure(scores: &Scores, path: &Path) -> Result<()> {
    let tasks = scores.tasks();
    let bars = |helper: &String| {
        let bar =
            |s: &crate::metrics::Score| Bar { mean: s.tr, se: s.tr_se.unwrap_or(0.0), dot: None };
        HelperBars {
            helper: title(helper),
            values: tasks.iter().map(|t| scores.get(*t, helper).map(bar)).collect(),
        }
    };
    let bars = Bars {
        tasks: tasks.iter().map(|t| t.info().title.to_owned()).collect(),
        helpers: scores.helpers().iter().map(bars).collect(),
        dots: None,
    };
    transport_rate(&bars, path).map_err(|e| match e {
        FigureError::UnsupportedExtension { .. } => EvalError::Options(e.to_string()),
        _ => EvalError::Picture(e.to_string()),
    })
}
