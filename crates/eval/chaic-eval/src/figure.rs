//! Figures of results, as SVG or PNG.
//!
//! A figure takes labels and plain numbers instead of scores, so that published numbers can be
//! drawn next to those of a run.

use std::error::Error;
use std::io::Cursor;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use chaic_files::{FileError, write_atomically};
use image::{ImageFormat, RgbImage, imageops};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::FontStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Supported file extensions.
pub const EXTENSIONS: &[&str] = &["svg", "png"];

/// Width and height of a figure, pixels.
pub const SIZE_PX: (u32, u32) = (1400, 600);

/// Maximum number of helpers in one figure: eight colors and a light shade of each.
pub const MAX_HELPERS: usize = 2 * PALETTE.len();

/// Maximum number of tasks in one figure; with more, bars are narrower than three pixels.
pub const MAX_TASKS: usize = 24;

/// Colors that color-blind readers can distinguish (Okabe and Ito 2008). The pair with the most
/// contrast is first. Black is last because black bars attract attention.
pub(crate) const PALETTE: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(204, 121, 167),
    RGBColor(240, 228, 66),
    RGBColor(40, 40, 40),
];

pub(crate) const INK: RGBColor = RGBColor(30, 30, 30);
const FAINT_INK: RGBColor = RGBColor(110, 110, 110);
pub(crate) const GRID: RGBColor = RGBColor(222, 222, 222);

/// Viewers of SVG use their own font. PNG and text measurements use the font registered below.
pub(crate) const FONT: &str = "sans-serif";
const TEXT_PX: i32 = 19;
const NOTE_PX: i32 = 16;

/// PNG is drawn larger by this factor and then reduced. Glyphs are placed at whole pixels, and at
/// the final size some would touch.
const PNG_OVERSAMPLING: u32 = 3;

/// Distances of the plot from the left, right and bottom edge of the figure.
const LEFT_PX: i32 = 84;
const RIGHT_PX: i32 = 20;
const BOTTOM_PX: i32 = 44;
/// Distance of the axis title from the left edge of the figure.
const AXIS_TITLE_PX: i32 = 12;
const LEGEND_ROW_PX: i32 = 30;
/// Space between legend and plot.
const LEGEND_GAP_PX: i32 = 26;
/// Fraction of a task's width that its bars occupy.
const GROUP_WIDTH: f64 = 0.82;

/// A mean with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarValue {
    /// Height of the bar, 0 to 1.
    pub mean: f64,
    /// Ends of the whisker, 0 to 1 with the mean between them; `None` for no whisker.
    pub interval: Option<[f64; 2]>,
    /// Reference value that is drawn as a dot, 0 to 1.
    pub dot: Option<f64>,
}

/// The bars of one helper.
#[derive(Clone, Debug, PartialEq)]
pub struct HelperBars {
    /// Name in the legend.
    pub helper: String,
    /// One entry per task; `None` leaves a gap.
    pub values: Vec<Option<BarValue>>,
}

/// Results by task and helper.
#[derive(Clone, Debug, PartialEq)]
pub struct BarChart {
    /// Titles of the tasks, from left to right.
    pub tasks: Vec<String>,
    /// Helpers, from left to right within each task.
    pub helpers: Vec<HelperBars>,
    /// Legend text of the dots; `None` without dots.
    pub dots: Option<String>,
}

/// Error while drawing a figure.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// The file extension is not supported.
    #[error("can't draw a figure with this extension, use one of {}: {path:?}", EXTENSIONS.join(", "))]
    UnsupportedExtension {
        /// Path of the figure.
        path: PathBuf,
    },
    /// The number of tasks or helpers is out of range.
    #[error(
        "can't draw {n_tasks} tasks and {n_helpers} helpers, \
         choose 1 to {MAX_TASKS} tasks and 1 to {MAX_HELPERS} helpers"
    )]
    Count {
        /// Number of tasks.
        n_tasks: usize,
        /// Number of helpers.
        n_helpers: usize,
    },
    /// A helper does not have one entry per task.
    #[error("expected {expected} values, one for each task, got {got} from helper `{helper}`")]
    Shape {
        /// Name of the helper.
        helper: String,
        /// Number of tasks.
        expected: usize,
        /// Number of values.
        got: usize,
    },
    /// A mean, a dot or an end of an interval is outside 0 to 1, or an interval does not contain
    /// its mean.
    #[error("can't draw {bar:?} of helper `{helper}` in task `{task}`, a rate is 0 to 1")]
    Value {
        /// Name of the helper.
        helper: String,
        /// Title of the task.
        task: String,
        /// The invalid value.
        bar: BarValue,
    },
    /// The plotting library failed.
    #[error("can't draw the figure: {source}")]
    Draw {
        /// Error of the library.
        source: DynError,
    },
    /// The file can't be written.
    #[error(transparent)]
    Write(#[from] FileError),
}

/// Draws the transport rate of each helper in each task as grouped bars with whiskers for 95 %
/// intervals. The extension of `out` selects SVG or PNG.
///
/// # Errors
/// [`FigureError`] if the values or the extension are invalid, or the file can't be written.
pub fn transport_rate(bars: &BarChart, out: &Path) -> Result<(), FigureError> {
    bars.check()?;
    let extension = out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let drawn = match extension.as_deref() {
        Some("svg") => draw_svg(bars).map(String::into_bytes),
        Some("png") => draw_png(bars),
        _ => return Err(FigureError::UnsupportedExtension { path: out.to_owned() }),
    };
    let bytes = drawn.map_err(|source| FigureError::Draw { source })?;
    Ok(write_atomically(out, &bytes)?)
}

/// Returns the text of the SVG file that [`transport_rate`] writes.
///
/// # Errors
/// [`FigureError`] if the values are invalid.
pub fn svg_text(bars: &BarChart) -> Result<String, FigureError> {
    bars.check()?;
    draw_svg(bars).map_err(|source| FigureError::Draw { source })
}

impl BarChart {
    fn check(&self) -> Result<(), FigureError> {
        let (n_tasks, n_helpers) = (self.tasks.len(), self.helpers.len());
        if !(1..=MAX_TASKS).contains(&n_tasks) || !(1..=MAX_HELPERS).contains(&n_helpers) {
            return Err(FigureError::Count { n_tasks, n_helpers });
        }
        for HelperBars { helper, values } in &self.helpers {
            if values.len() != n_tasks {
                let (expected, got) = (n_tasks, values.len());
                return Err(FigureError::Shape { helper: helper.clone(), expected, got });
            }
            for (task, bar) in self.tasks.iter().zip(values) {
                let Some(bar) = *bar else { continue };
                let [low, high] = bar.interval.unwrap_or([bar.mean; 2]);
                let all = [bar.mean, low, high, bar.dot.unwrap_or(0.0)];
                let is_ordered = low <= bar.mean && bar.mean <= high;
                let is_drawable = is_ordered && all.iter().all(|v| (0.0..=1.0).contains(v));
                if !is_drawable {
                    let (helper, task) = (helper.clone(), task.clone());
                    return Err(FigureError::Value { helper, task, bar });
                }
            }
        }
        Ok(())
    }
}

type DynError = Box<dyn Error + Send + Sync>;
type DrawError<DB> = DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>;
type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw_svg(bars: &BarChart) -> Result<String, DynError> {
    let mut text = String::new();
    let root = SVGBackend::with_string(&mut text, SIZE_PX).into_drawing_area();
    Canvas { root, scale: 1 }.draw(bars)?;
    Ok(text)
}

/// Returns the bytes of a PNG file.
fn draw_png(bars: &BarChart) -> Result<Vec<u8>, DynError> {
    let scale = PNG_OVERSAMPLING;
    let size = (SIZE_PX.0 * scale, SIZE_PX.1 * scale);
    let mut large = RgbImage::new(size.0, size.1);
    let root = BitMapBackend::with_buffer(&mut large, size).into_drawing_area();
    Canvas { root, scale: scale as i32 }.draw(bars)?;
    let image = imageops::thumbnail(&large, SIZE_PX.0, SIZE_PX.1);
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// Without a system font library, plotters requires that fonts are registered.
static FONT_IS_REGISTERED: LazyLock<()> = LazyLock::new(|| {
    plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .unwrap_or_else(|_| unreachable!("the font is part of the program"));
});

/// Registers [`FONT`]; required before drawing.
pub(crate) fn register_font() {
    LazyLock::force(&FONT_IS_REGISTERED);
}

/// Drawing area of a figure; all constants are in pixels at scale 1.
struct Canvas<DB: DrawingBackend> {
    root: DrawingArea<DB, Shift>,
    scale: i32,
}

impl<DB: DrawingBackend> Canvas<DB> {
    fn draw(&self, bars: &BarChart) -> Result<(), DrawError<DB>> {
        register_font();
        self.root.fill(&WHITE)?;
        let legend_px = self.draw_legend(bars)?;
        let mut chart = ChartBuilder::on(&self.root)
            .margin_top((legend_px + LEGEND_GAP_PX) * self.scale)
            .margin_right(RIGHT_PX * self.scale)
            .margin_left(AXIS_TITLE_PX * self.scale)
            .x_label_area_size(BOTTOM_PX * self.scale)
            .y_label_area_size((LEFT_PX - AXIS_TITLE_PX) * self.scale)
            .build_cartesian_2d(0.0..bars.tasks.len() as f64, 0.0..1.0)?;
        self.draw_axes(&bars.tasks, &mut chart)?;
        self.draw_groups(bars, &chart)?;
        self.root.present()
    }

    /// Draws the helpers' names in rows at the top; returns the height in pixels.
    fn draw_legend(&self, bars: &BarChart) -> Result<i32, DrawError<DB>> {
        const SWATCH_PX: i32 = 18;
        const GAP_PX: i32 = 8;
        const ENTRY_GAP_PX: i32 = 22;
        let right = SIZE_PX.0 as i32 - RIGHT_PX;
        let (mut x, mut y) = (LEFT_PX, LEGEND_ROW_PX);
        for (index, HelperBars { helper, .. }) in bars.helpers.iter().enumerate() {
            let style = self.text_style(TEXT_PX, INK, HPos::Left, VPos::Center);
            // The viewer's font may be wider than the measured one by a tenth.
            let text_px = self.text_width_px(helper, &style)? * 11 / 10;
            let width = SWATCH_PX + GAP_PX + text_px;
            if x > LEFT_PX && x + width > right {
                (x, y) = (LEFT_PX, y + LEGEND_ROW_PX);
            }
            let corners = [(x, y - SWATCH_PX / 2), (x + SWATCH_PX, y + SWATCH_PX / 2)];
            let swatch = Rectangle::new(corners.map(|c| self.scaled(c)), color(index).filled());
            self.root.draw(&swatch)?;
            let at = self.scaled((x + SWATCH_PX + GAP_PX, y));
            self.root.draw(&Text::new(helper.clone(), at, style))?;
            x += width + ENTRY_GAP_PX;
        }
        let dots = bars.dots.as_ref().map_or(String::new(), |text| format!("; dots: {text}"));
        let note = format!("whiskers: 95 % intervals over environments{dots}");
        let style = self.text_style(NOTE_PX, FAINT_INK, HPos::Right, VPos::Center);
        if x + self.text_width_px(&note, &style)? > right {
            y += LEGEND_ROW_PX;
        }
        self.root.draw(&Text::new(note, self.scaled((right, y)), style))?;
        Ok(y + LEGEND_ROW_PX / 2)
    }

    fn draw_axes(&self, tasks: &[String], chart: &mut Chart<'_, DB>) -> Result<(), DrawError<DB>> {
        let text = |size_px| self.text_style(size_px, INK, HPos::Left, VPos::Top);
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(0)
            .y_labels(6)
            .y_label_formatter(&|y| format!("{y:.1}"))
            .y_desc("transport rate")
            .axis_desc_style(text(TEXT_PX + 2))
            .y_label_style(text(TEXT_PX))
            .bold_line_style(self.stroke(GRID))
            .light_line_style(TRANSPARENT)
            .axis_style(self.stroke(INK))
            .set_all_tick_mark_size(5 * self.scale)
            .draw()?;
        let style = self.text_style(TEXT_PX, INK, HPos::Center, VPos::Top);
        for (index, task) in tasks.iter().enumerate() {
            let (x, y) = chart.backend_coord(&(index as f64 + 0.5, 0.0));
            let label = Text::new(task.clone(), (x, y + 12 * self.scale), style.clone());
            self.root.draw(&label)?;
        }
        Ok(())
    }

    fn draw_groups(&self, bars: &BarChart, chart: &Chart<'_, DB>) -> Result<(), DrawError<DB>> {
        let width = GROUP_WIDTH / bars.helpers.len() as f64;
        for (index, HelperBars { values, .. }) in bars.helpers.iter().enumerate() {
            for (task, bar) in values.iter().enumerate() {
                let Some(bar) = bar else { continue };
                let left = task as f64 + (1.0 - GROUP_WIDTH) / 2.0 + index as f64 * width;
                self.draw_bar(*bar, left..left + width, color(index), chart)?;
            }
        }
        Ok(())
    }

    fn draw_bar(
        &self,
        bar: BarValue,
        x: Range<f64>,
        color: RGBColor,
        chart: &Chart<'_, DB>,
    ) -> Result<(), DrawError<DB>> {
        let (left, bottom) = chart.backend_coord(&(x.start, 0.0));
        let (right, top) = chart.backend_coord(&(x.end, bar.mean));
        // One pixel between neighbors, and at least two pixels of height, so that zero differs from
        // a missing value.
        let right = (right - self.scale).max(left + 1);
        let corners = [(left, top.min(bottom - 2 * self.scale)), (right, bottom)];
        self.root.draw(&Rectangle::new(corners, color.filled()))?;
        if let Some(ends) = bar.interval {
            self.draw_whisker(ends, x.start, [left, right], chart)?;
        }
        let Some(dot) = bar.dot else { return Ok(()) };
        let at = ((left + right) / 2, chart.backend_coord(&(x.start, dot)).1);
        let radius = ((right - left) / 4).clamp(2 * self.scale, 6 * self.scale);
        self.root.draw(&Circle::new(at, radius, WHITE.filled()))?;
        self.root.draw(&Circle::new(at, radius, self.stroke(INK)))
    }

    fn draw_whisker(
        &self,
        ends: [f64; 2],
        x: f64,
        [left, right]: [i32; 2],
        chart: &Chart<'_, DB>,
    ) -> Result<(), DrawError<DB>> {
        let middle = (left + right) / 2;
        let cap = ((right - left) / 5).clamp(self.scale, 5 * self.scale);
        let [low, high] = ends.map(|rate| chart.backend_coord(&(x, rate)).1);
        for line in [
            [(middle, low), (middle, high)],
            [(middle - cap, low), (middle + cap, low)],
            [(middle - cap, high), (middle + cap, high)],
        ] {
            self.root.draw(&PathElement::new(line, self.stroke(INK)))?;
        }
        Ok(())
    }

    fn scaled(&self, point: (i32, i32)) -> (i32, i32) {
        (point.0 * self.scale, point.1 * self.scale)
    }

    fn stroke(&self, color: RGBColor) -> ShapeStyle {
        color.stroke_width(self.scale as u32)
    }

    fn text_style(&self, size_px: i32, color: RGBColor, h: HPos, v: VPos) -> TextStyle<'static> {
        (FONT, size_px * self.scale).into_font().color(&color).pos(Pos::new(h, v))
    }

    fn text_width_px(&self, text: &str, style: &TextStyle<'_>) -> Result<i32, DrawError<DB>> {
        Ok(self.root.estimate_text_size(text, style)?.0 as i32 / self.scale)
    }
}

fn color(helper: usize) -> RGBColor {
    let full = PALETTE[helper % PALETTE.len()];
    if helper < PALETTE.len() {
        return full;
    }
    let light = |channel: u8| channel / 2 + 127;
    RGBColor(light(full.0), light(full.1), light(full.2))
}

#[cfg(test)]
mod tests;
