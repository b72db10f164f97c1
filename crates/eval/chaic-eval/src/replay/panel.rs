//! One image of a replay: the views of both agents, the map, captions and events.

use chaic_core::observation::Images;
use chaic_env::narration::{Caption, DetectedObject};
use chaic_env::trace::Header;
use chaic_render::text::{self, Align};
use chaic_world::World;
use image::{Rgb, RgbImage, imageops};

use crate::replay::belief_panel::{self, BeliefView};
use crate::replay::layout::{
    BAR, BAR_BACKGROUND, FAINT, HEIGHT_PX, INK, MARGIN_PX, SIDE_COLUMN_PX, SIDE_X_PX, VIEW_PX,
    WIDTH_PX, fill, wrapped,
};

const HEADER_PX: u32 = 44;
const BACKGROUND: [u8; 3] = [250, 250, 248];
const LINE_PX: f32 = 17.0;
/// Tops of the captions, and of the caption of the child below them.
const CAPTIONS_Y_PX: u32 = HEADER_PX + VIEW_PX + 10;
const CHILD_Y_PX: u32 = CAPTIONS_Y_PX + 122;
const CAPTION_LINE_PX: u32 = 22;
const EVENT_LINE_PX: u32 = 19;
const EVENT_PX: f32 = 14.0;
/// Minimum number of rows of events below the belief.
const MIN_EVENT_ROWS: u32 = 4;
/// Indentation that is as wide as the frame number of an event.
const EVENT_INDENT: &str = "       ";
/// Maximum number of events: as many as fit without a map.
pub(super) const MAX_EVENTS: usize = 30;

/// Content of an image.
pub(super) struct Contents<'a> {
    pub header: &'a Header,
    pub world: &'a World,
    /// Views of partner and helper.
    pub views: &'a [Images],
    /// Objects that each of them believes to see.
    pub believed: &'a [Vec<DetectedObject>],
    pub map: &'a RgbImage,
    pub captions: &'a [Caption],
    /// Last events, newest last.
    pub events: &'a [String],
    /// Belief of the helper, if it records one.
    pub belief: Option<&'a BeliefView>,
}

pub(super) fn compose(contents: &Contents<'_>) -> RgbImage {
    let mut image = RgbImage::from_pixel(WIDTH_PX, HEIGHT_PX, Rgb(BACKGROUND));
    draw_header(&mut image, contents);
    for (k, view) in contents.views.iter().enumerate() {
        let x = MARGIN_PX + k as u32 * (VIEW_PX + MARGIN_PX);
        let side = view.rgb.as_ref().map_or(0, |rgb| (rgb.len() / 3).isqrt() as u32);
        let picture = view.rgb.clone().and_then(|b| RgbImage::from_raw(side, side, b));
        let Some(mut picture) = picture else { continue };
        if side != VIEW_PX {
            picture = imageops::resize(&picture, VIEW_PX, VIEW_PX, imageops::FilterType::Triangle);
        }
        for mark in contents.believed.get(k).into_iter().flatten() {
            draw_mark(&mut picture, mark);
        }
        imageops::replace(&mut image, &picture, i64::from(x), i64::from(HEADER_PX));
    }
    // Events keep some rows below the bars, so that a high map gets smaller.
    let reserved = belief_panel::HEIGHT_PX + MIN_EVENT_ROWS * EVENT_LINE_PX + 2 * MARGIN_PX;
    let reserved = if contents.belief.is_some() { reserved } else { 0 };
    let mut below = draw_map(&mut image, contents.map, reserved);
    draw_captions(&mut image, contents);
    if let Some(view) = contents.belief {
        belief_panel::draw_bars(&mut image, below + MARGIN_PX / 2, view);
        below += belief_panel::HEIGHT_PX;
        let has_child = contents.captions.len() > 2;
        let (top, max_rows) =
            if has_child { (CHILD_Y_PX + CAPTION_LINE_PX, 3) } else { (CHILD_Y_PX, 4) };
        belief_panel::draw_plans(&mut image, top, max_rows, &view.belief);
    }
    draw_events(&mut image, below, contents.events);
    image
}

/// Returns the color of a label: the same in all images, and light enough to read on dark images.
fn label_color(label: u8) -> [u8; 3] {
    [37u32, 91, 143].map(|m| (u32::from(label) * m % 160 + 95) as u8)
}

/// Blends the color of a label into pixels.
pub(super) fn tint(rgb: &mut [u8], pixels: &[u32], label: u8) {
    let color = label_color(label);
    for k in pixels {
        for (c, channel) in rgb[3 * *k as usize..][..3].iter_mut().zip(color) {
            *c = *c / 2 + channel / 2;
        }
    }
}

fn draw_mark(image: &mut RgbImage, DetectedObject { class, label, at }: &DetectedObject) {
    /// Half the side of the dot, pixels.
    const DOT_PX: u32 = 2;
    const LABEL_PX: f32 = 12.0;
    // Pixel labels use 0 for the background.
    let color = label_color(class.index() as u8 + 1);
    let side = image.width();
    let [x, y] = at.map(|fraction| (fraction * side as f32) as u32);
    let (left, top) = (x.saturating_sub(DOT_PX), y.saturating_sub(DOT_PX));
    for (i, j) in (top..(y + DOT_PX).min(side))
        .flat_map(|j| (left..(x + DOT_PX).min(side)).map(move |i| (i, j)))
    {
        image.put_pixel(i, j, Rgb(color));
    }
    let start = (x + 2 * DOT_PX) as f32;
    let is_beside = start + text::width(label, LABEL_PX) < side as f32;
    let (start, align) = if is_beside { (start, Align::Left) } else { (left as f32, Align::Right) };
    let y = (y as f32 - 0.5 * LABEL_PX).clamp(0.0, side as f32 - LABEL_PX);
    // A dark shadow keeps the text readable on light images.
    text::draw(image, (start + 1.0, y + 1.0), LABEL_PX, INK, align, label);
    text::draw(image, (start, y), LABEL_PX, color, align, label);
}

fn draw_header(image: &mut RgbImage, Contents { header, world, .. }: &Contents<'_>) {
    let title = format!("{}, helper {}, seed {}", header.episode, header.helper, header.seed);
    let left = MARGIN_PX as f32;
    text::draw(image, (left, 10.0), 20.0, INK, Align::Left, &title);
    let (done, total) = world.progress();
    let unit = match world.setup().task.info().target_value.unit() {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let (frame, horizon) = (world.state().frame, world.setup().horizon);
    let progress = format!("done {done:.0} of {total:.0}{unit}    frame {frame} of {horizon}");
    let right = (WIDTH_PX - MARGIN_PX) as f32;
    text::draw(image, (right, 6.0), LINE_PX, INK, Align::Right, &progress);
    // Two bars: the delivered part of the goal, and the elapsed part of the time.
    let fraction = if total > 0.0 { done / total } else { 0.0 };
    let elapsed = f64::from(frame) / f64::from(horizon);
    for (k, (fraction, color)) in [(fraction, BAR), (elapsed, FAINT)].into_iter().enumerate() {
        let (x0, x1) = (WIDTH_PX - MARGIN_PX - VIEW_PX, WIDTH_PX - MARGIN_PX);
        let y0 = 27 + 7 * k as u32;
        let filled = x0 + (fraction.clamp(0.0, 1.0) * f64::from(x1 - x0)) as u32;
        fill(image, [x0, y0, x1, y0 + 5], BAR_BACKGROUND);
        fill(image, [x0, y0, filled, y0 + 5], color);
    }
}

/// Fits the map into the space to the right of the views, without `reserved_px` rows below it;
/// returns its bottom row.
fn draw_map(image: &mut RgbImage, map: &RgbImage, reserved_px: u32) -> u32 {
    let x = SIDE_X_PX;
    let (width, height) = (SIDE_COLUMN_PX, HEIGHT_PX - HEADER_PX - MARGIN_PX - reserved_px);
    let (w, h) = map.dimensions();
    let scale = (f64::from(width) / f64::from(w)).min(f64::from(height) / f64::from(h)).min(1.0);
    let y = i64::from(HEADER_PX);
    if scale < 1.0 {
        let (w, h) = ((f64::from(w) * scale) as u32, (f64::from(h) * scale) as u32);
        let fitted = imageops::resize(map, w.max(1), h.max(1), imageops::FilterType::Triangle);
        imageops::replace(image, &fitted, i64::from(x), y);
        return HEADER_PX + fitted.height();
    }
    imageops::replace(image, map, i64::from(x), y);
    HEADER_PX + h
}

/// Draws the last events, as many as fit below the map.
fn draw_events(image: &mut RgbImage, top: u32, events: &[String]) {
    let (x, width) = (SIDE_X_PX as f32, SIDE_COLUMN_PX as f32);
    let max_rows = HEIGHT_PX.saturating_sub(top + 2 * MARGIN_PX) / EVENT_LINE_PX;
    let rows: Vec<String> =
        events.iter().flat_map(|n| wrapped(n, EVENT_PX, width, EVENT_INDENT)).collect();
    let skipped = rows.len().saturating_sub(max_rows as usize);
    for (k, row) in rows.iter().skip(skipped).enumerate() {
        let y = (top + MARGIN_PX + k as u32 * EVENT_LINE_PX) as f32;
        text::draw(image, (x, y), EVENT_PX, INK, Align::Left, row);
    }
}

fn draw_captions(image: &mut RgbImage, Contents { captions, .. }: &Contents<'_>) {
    let top = CAPTIONS_Y_PX as f32;
    for (k, caption) in captions.iter().enumerate().take(2) {
        let x = (MARGIN_PX + k as u32 * (VIEW_PX + MARGIN_PX)) as f32;
        text::draw(image, (x, top), LINE_PX, INK, Align::Left, &caption.agent);
        draw_lines(image, x, top + 24.0, &caption.action, INK);
        let last_observed = caption.last_observed.as_ref().map(|action| format!("saw {action}"));
        let plan =
            [caption.plan.clone()].into_iter().chain(last_observed).collect::<Vec<_>>().join("; ");
        draw_lines(image, x, top + 70.0, &plan, FAINT);
    }
    let left = MARGIN_PX as f32;
    if let Some(child) = captions.get(2) {
        let caption = format!("{}: {}, {}", child.agent, child.action, child.plan);
        text::draw(image, (left, CHILD_Y_PX as f32), LINE_PX, INK, Align::Left, &caption);
    }
}

/// Draws at most two lines, no wider than an agent's view.
fn draw_lines(image: &mut RgbImage, x: f32, y: f32, text: &str, color: [u8; 3]) {
    for (k, row) in wrapped(text, LINE_PX, VIEW_PX as f32, "").iter().take(2).enumerate() {
        text::draw(image, (x, y + 21.0 * k as f32), LINE_PX, color, Align::Left, row);
    }
}
