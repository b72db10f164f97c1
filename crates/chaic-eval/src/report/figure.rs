//! Scores as the paper's figure: transport rates with one standard error.

use std::path::Path;

use crate::error::{EvalError, Result};
use crate::figure::{Bar, Bars, FigureError, HelperBars, svg_text, transport_rate};
use crate::metrics::Scores;
use crate::report::tables::title;

/// Draws transport rates with their standard errors into a `.svg` or `.png` file.
///
/// # Errors
/// If the extension is another one, there are more helpers than can be told apart, or the file
/// system refuses.
pub fn write_figure(scores: &Scores, path: &Path) -> Result<()> {
    transport_rate(&bars(scores), path).map_err(error_of)
}

/// The text of the same figure as SVG.
///
/// # Errors
/// If there are more helpers than can be told apart.
pub(super) fn figure_text(scores: &Scores) -> Result<String> {
    svg_text(&bars(scores)).map_err(error_of)
}

fn error_of(error: FigureError) -> EvalError {
    match error {
        FigureError::UnsupportedExtension { .. } => EvalError::Options(error.to_string()),
        FigureError::Write(refusal) => refusal,
        _ => EvalError::Picture(error.to_string()),
    }
}

fn bars(scores: &Scores) -> Bars {
    let tasks = scores.tasks();
    let bars = |helper: &String| {
        let bar =
            |s: &crate::metrics::Score| Bar { mean: s.tr, se: s.tr_se.unwrap_or(0.0), dot: None };
        HelperBars {
            helper: title(helper),
            values: tasks.iter().map(|t| scores.get(*t, helper).map(bar)).collect(),
        }
    };
    Bars {
        tasks: tasks.iter().map(|t| t.info().title.to_owned()).collect(),
        helpers: scores.helpers().iter().map(bars).collect(),
        dots: None,
    }
}
