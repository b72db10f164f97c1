//! The belief of the helper in an image of a replay: probabilities as bars, and plans as text.

use chaic_core::agent::PartnerBelief;
use chaic_render::text::{self, Align};
use image::RgbImage;

use super::layout::{
    BAR, BAR_BACKGROUND, FAINT, INK, MARGIN_PX, SIDE_COLUMN_PX, SIDE_X_PX, VIEW_PX, fill, wrapped,
};
use crate::recorded_belief::Distribution;

const TEXT_PX: f32 = 13.0;
const ROW_PX: u32 = 16;
/// Largest number of bars of one distribution.
const MAX_BARS: usize = 4;
/// Widths of the name and of the percentage of a bar.
const NAME_PX: u32 = 96;
const PERCENT_PX: u32 = 42;
/// Largest number of rows of the latest observation.
const MAX_EVIDENCE_ROWS: usize = 2;
/// Height of the heading, the bars, the legend of the ring and the observation, with a margin.
pub(super) const HEIGHT_PX: u32 = (3 + (MAX_BARS + MAX_EVIDENCE_ROWS) as u32) * ROW_PX;

/// A belief, and the true hypotheses.
pub(super) struct BeliefView {
    pub belief: PartnerBelief,
    /// Name of the true target set.
    pub true_set: Option<&'static str>,
    /// Name of the partner's kind of person.
    pub true_person: &'static str,
}

/// Draws the bars below the map, and the legend of the ring and the latest observation below them.
pub(super) fn draw_bars(image: &mut RgbImage, top: u32, view: &BeliefView) {
    let half = SIDE_COLUMN_PX / 2;
    let BeliefView { belief, true_set, true_person } = view;
    let width = half - MARGIN_PX;
    draw_distribution(
        image,
        [SIDE_X_PX, top, width],
        "believed goal (> is true)",
        &belief.goals,
        *true_set,
    );
    let people = [SIDE_X_PX + half, top, width];
    draw_distribution(image, people, "believed person", &belief.people, Some(true_person));
    let n_bars = belief.goals.len().max(belief.people.len()).min(MAX_BARS) as u32;
    let extra: Vec<&str> = belief.extra.iter().map(|class| class.info().label).collect();
    let extra = (!extra.is_empty()).then(|| format!("also wanted: {}", extra.join(", ")));
    let latest = belief.evidence.last().map(|text| format!("saw: {text}"));
    let line = latest.into_iter().chain(extra).collect::<Vec<_>>().join("; ");
    let y = top + (1 + n_bars) * ROW_PX + 4;
    if belief.position_cm.is_some() {
        let ring = "ring on the map: believed position of the partner";
        draw_rows(image, [SIDE_X_PX, y, SIDE_COLUMN_PX], 1, ring);
    }
    let y = y + ROW_PX;
    draw_rows(image, [SIDE_X_PX, y, SIDE_COLUMN_PX], MAX_EVIDENCE_ROWS, &line);
}

/// Draws the plans below the captions of partner and helper.
pub(super) fn draw_plans(image: &mut RgbImage, top: u32, max_rows: usize, belief: &PartnerBelief) {
    let columns = [("helper expects", &belief.partner_plan), ("helper plans", &belief.plan)];
    for (k, (name, operations)) in columns.into_iter().enumerate() {
        let x = MARGIN_PX + k as u32 * (VIEW_PX + MARGIN_PX);
        let text = match operations[..] {
            [] => format!("{name}: nothing"),
            _ => format!("{name}: {}", operations.join(", ")),
        };
        draw_rows(image, [x, top, VIEW_PX], max_rows, &text);
    }
}

/// Draws a heading and one bar per hypothesis at `[x, y, width]`. The bar of the true hypothesis is
/// green and has a mark.
fn draw_distribution(
    image: &mut RgbImage,
    [x, top, width]: [u32; 3],
    title: &str,
    distribution: &Distribution,
    truth: Option<&str>,
) {
    text::draw(image, (x as f32, top as f32), TEXT_PX, FAINT, Align::Left, title);
    for (k, (name, per_mille)) in distribution.iter().take(MAX_BARS).enumerate() {
        let y = top + (1 + k as u32) * ROW_PX;
        let is_true = truth == Some(name);
        let mark = if is_true { ">" } else { " " };
        let label = format!("{mark} {}", name.replace('_', " "));
        let name_rows = wrapped(&label, TEXT_PX, NAME_PX as f32, "");
        let label = name_rows.first().map_or("", String::as_str);
        text::draw(image, (x as f32, y as f32), TEXT_PX, INK, Align::Left, label);
        let (x0, x1) = (x + NAME_PX, x + width - PERCENT_PX);
        let filled = x0 + (x1 - x0) * u32::from(*per_mille).min(1000) / 1000;
        fill(image, [x0, y + 3, x1, y + 12], BAR_BACKGROUND);
        fill(image, [x0, y + 3, filled, y + 12], if is_true { BAR } else { FAINT });
        let percent = format!("{} %", (u32::from(*per_mille) + 5) / 10);
        let right = ((x + width) as f32, y as f32);
        text::draw(image, right, TEXT_PX, INK, Align::Right, &percent);
    }
}

/// Draws a text at `[x, y, width]` with at most `max_rows` rows; a longer one ends in `...`.
fn draw_rows(image: &mut RgbImage, [x, y, width]: [u32; 3], max_rows: usize, text: &str) {
    let mut rows = wrapped(text, TEXT_PX, width as f32, "");
    if rows.len() > max_rows {
        rows.truncate(max_rows);
        if let Some(last) = rows.last_mut() {
            *last = shortened(last, width as f32);
        }
    }
    for (k, row) in rows.iter().enumerate() {
        let at = (x as f32, (y + k as u32 * ROW_PX) as f32);
        text::draw(image, at, TEXT_PX, FAINT, Align::Left, row);
    }
}

/// Returns as many words of a row as fit with `...` after them.
fn shortened(row: &str, width_px: f32) -> String {
    let mut words: Vec<&str> = row.split(' ').filter(|word| !word.is_empty()).collect();
    loop {
        let shorter = format!("{} ...", words.join(" ").trim_end_matches(','));
        if words.pop().is_none() || text::width(&shorter, TEXT_PX) <= width_px {
            return shorter;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shortened_row_fits() {
        let row = "pick up apple #31, deliver, pick up ";
        assert_eq!(shortened(row, 1000.0), "pick up apple #31, deliver, pick up ...");
        let width_px = text::width("pick up apple #31, deliver", TEXT_PX);
        assert_eq!(shortened(row, width_px), "pick up apple #31 ...");
        assert_eq!(shortened("word", 1.0), " ...");
    }
}
