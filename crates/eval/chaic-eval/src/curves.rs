//! Line charts as SVG, one panel per curve.

use std::path::Path;

use chaic_files::write_atomically;
use plotters::prelude::*;

use crate::figure::{FONT, FigureError, GRID, INK, PALETTE, register_font};

/// Number of panels per row, and the size of a panel.
const COLUMNS: usize = 2;
const PANEL_PX: (u32, u32) = (700, 280);
const TEXT_PX: i32 = 15;
/// Space for axis labels.
const LABELS_PX: i32 = 56;

/// Maximum number of points that are drawn with markers.
const MAX_MARKED_POINTS: usize = 40;

/// A named series of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Caption above the panel.
    pub title: String,
    /// Points in the order in which they are connected.
    pub points: Vec<(f64, f64)>,
}

/// Draws each curve in its own panel; all panels share the `x_title`.
///
/// # Errors
/// [`FigureError`] if the chart can't be drawn or written.
pub fn draw(curves: &[Curve], x_title: &str, out: &Path) -> Result<(), FigureError> {
    register_font();
    let rows = curves.len().div_ceil(COLUMNS).max(1);
    let size = (COLUMNS as u32 * PANEL_PX.0, rows as u32 * PANEL_PX.1);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw_panels(&root, curves, rows, x_title)
            .map_err(|e| FigureError::Draw { source: e.to_string().into() })?;
    }
    Ok(write_atomically(out, text.as_bytes())?)
}

/// Returns the range from the minimum to the maximum. The range is never empty.
fn range(values: impl Iterator<Item = f64> + Clone) -> std::ops::Range<f64> {
    let min = values.clone().fold(f64::INFINITY, f64::min);
    let max = values.fold(f64::NEG_INFINITY, f64::max);
    match min < max {
        true => min..max,
        false if min.is_finite() => min - 0.5..min + 0.5,
        false => 0.0..1.0,
    }
}

fn draw_panels<DB: DrawingBackend>(
    root: &DrawingArea<DB, plotters::coord::Shift>,
    curves: &[Curve],
    rows: usize,
    x_title: &str,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    root.fill(&WHITE)?;
    for (k, (curve, panel)) in curves.iter().zip(root.split_evenly((rows, COLUMNS))).enumerate() {
        let finite = curve.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        let xs = range(finite.clone().map(|(x, _)| *x));
        let ys = range(finite.clone().map(|(_, y)| *y));
        let text = (FONT, TEXT_PX).into_font().color(&INK);
        let mut chart = ChartBuilder::on(&panel)
            .margin(12)
            .caption(&curve.title, text.clone())
            .x_label_area_size(LABELS_PX)
            .y_label_area_size(LABELS_PX)
            .build_cartesian_2d(xs, ys)?;
        chart
            .configure_mesh()
            .x_desc(x_title)
            .label_style(text)
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .draw()?;
        let color = PALETTE[k % PALETTE.len()];
        // A line of few points is hard to see without markers.
        let size = if curve.points.len() <= MAX_MARKED_POINTS { 4 } else { 0 };
        let style = color.stroke_width(2).filled();
        chart.draw_series(LineSeries::new(finite.copied(), style).point_size(size))?;
    }
    root.present()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_curve_has_a_panel_with_its_title() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("curves.svg");
        let curve = |title: &str, points: &[(f64, f64)]| Curve {
            title: title.to_owned(),
            points: points.to_vec(),
        };
        let curves = [
            curve("falling", &[(0.0, 3.0), (10.0, 1.0), (20.0, 0.5)]),
            curve("one point", &[(5.0, 0.25)]),
            curve("nothing", &[]),
            curve("not a number", &[(0.0, f64::NAN)]),
        ];
        draw(&curves, "steps", &out).unwrap();
        let text = std::fs::read_to_string(&out).unwrap();
        for title in ["falling", "one point", "nothing", "not a number", "steps"] {
            assert!(text.contains(title), "no `{title}`");
        }
        assert!(!text.contains("NaN"));
    }
}
