//! Scores as the paper's figure: transport rates with 95 % intervals.

use std::path::Path;

use crate::error::{EvalError, Result};
use crate::figure::{Bar, Bars, FigureError, HelperBars, svg_text, transport_rate};
use crate::metrics::{Score, Scores};
use crate::report::labels::Labels;
use crate::report::tables::shown_interval;

/// Draws transport rates with their 95 % intervals into a `.svg` or `.png` file.
///
/// # Errors
/// If the extension is another one, there are more helpers than can be told apart, or the file
/// system refuses.
pub fn write_figure(scores: &Scores, labels: Labels<'_>, path: &Path) -> Result<()> {
    transport_rate(&bars(scores, labels), path).map_err(error_of)
}

/// The text of the same figure as SVG.
///
/// # Errors
/// If there are more helpers than can be told apart.
pub(super) fn figure_text(scores: &Scores, labels: Labels<'_>) -> Result<String> {
    svg_text(&bars(scores, labels)).map_err(error_of)
}

fn error_of(error: FigureError) -> EvalError {
    match error {
        FigureError::UnsupportedExtension { .. } => EvalError::Options(error.to_string()),
        FigureError::Write(refusal) => refusal.into(),
        _ => EvalError::Picture(error.to_string()),
    }
}

fn bars(scores: &Scores, labels: Labels<'_>) -> Bars {
    let tasks = scores.tasks();
    let bars = |helper: &String| {
        let bar = |s: &Score| Bar { mean: s.tr, interval: shown_interval(s), dot: None };
        let is_incomplete = tasks.iter().any(|t| {
            scores.is_unplayed(*t, helper) || scores.get(*t, helper).is_some_and(|s| s.incomplete)
        });
        let mark = if is_incomplete { ", incomplete" } else { "" };
        HelperBars {
            helper: labels.title(helper) + mark,
            values: tasks.iter().map(|t| scores.get(*t, helper).map(bar)).collect(),
        }
    };
    Bars {
        tasks: tasks.iter().map(|t| t.info().title.to_owned()).collect(),
        helpers: scores.helpers().iter().map(bars).collect(),
        dots: None,
    }
}
