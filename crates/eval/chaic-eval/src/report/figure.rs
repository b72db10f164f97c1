//! Figure of transport rates with 95 % intervals, in the layout of the paper's figure.

use std::path::Path;

use crate::error::{EvalError, Result};
use crate::figure::{
    BarChart, BarValue, FigureError, HelperBars, MAX_HELPERS, MAX_TASKS, svg_text, transport_rate,
};
use crate::metrics::{Score, Scores};
use crate::report::labels::Labels;
use crate::report::tables::shown_interval;

/// Draws transport rates with their 95 % intervals into a `.svg` or `.png` file.
///
/// # Errors
/// If the extension is not supported, there are more helpers than colors, or the file can't be
/// written.
pub fn write_figure(scores: &Scores, labels: Labels<'_>, path: &Path) -> Result<()> {
    transport_rate(&bars(scores, labels), path).map_err(convert_error)
}

/// Returns true if a figure can show that many tasks and helpers.
pub(super) fn fits_figure(scores: &Scores) -> bool {
    (1..=MAX_TASKS).contains(&scores.tasks().len())
        && (1..=MAX_HELPERS).contains(&scores.helpers().len())
}

/// Returns the same figure as SVG text.
///
/// # Errors
/// If there are more helpers than colors.
pub(super) fn figure_text(scores: &Scores, labels: Labels<'_>) -> Result<String> {
    svg_text(&bars(scores, labels)).map_err(convert_error)
}

/// Returns the interval of [`shown_interval`], extended to contain the mean as figures require.
pub fn drawn_interval(score: &Score) -> Option<[f64; 2]> {
    // The interval is computed from sums over environments. With equal rates its width is 0, and
    // its rounding may differ from that of the mean.
    shown_interval(score).map(|[low, high]| [low.min(score.tr), high.max(score.tr)])
}

fn convert_error(error: FigureError) -> EvalError {
    match error {
        FigureError::UnsupportedExtension { .. } => EvalError::Options(error.to_string()),
        FigureError::Write(error) => error.into(),
        _ => EvalError::Image(error.to_string()),
    }
}

fn bars(scores: &Scores, labels: Labels<'_>) -> BarChart {
    let tasks = scores.tasks();
    let bars = |helper: &String| {
        let bar = |s: &Score| BarValue { mean: s.tr, interval: drawn_interval(s), dot: None };
        let is_incomplete = tasks.iter().any(|t| {
            scores.is_unplayed(*t, helper) || scores.get(*t, helper).is_some_and(|s| s.incomplete)
        });
        let mark = if is_incomplete { ", incomplete" } else { "" };
        HelperBars {
            helper: labels.title(helper) + mark,
            values: tasks.iter().map(|t| scores.get(*t, helper).map(bar)).collect(),
        }
    };
    BarChart {
        tasks: tasks.iter().map(|t| t.info().title.to_owned()).collect(),
        helpers: scores.helpers().iter().map(bars).collect(),
        dots: None,
    }
}
