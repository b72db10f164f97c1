//! One picture of a replay: what both see, the map, and what is done and planned.

use chaic_core::Vec3;
use chaic_core::agent::Believed;
use chaic_core::geom::Camera;
use chaic_core::observation::Images;
use chaic_env::trace::Header;
use chaic_render::text::{self, Align};
use chaic_world::World;
use image::{Rgb, RgbImage, imageops};

use crate::replay::Caption;

/// Width of a picture, pixels.
pub const WIDTH_PX: u32 = 1440;
/// Height of a picture, pixels.
pub const HEIGHT_PX: u32 = 720;
/// Side of what an eye sees, pixels.
pub const EYE_PX: u32 = 460;
/// Width of the map before it is fitted, pixels.
pub const MAP_PX: u32 = 472;

const MARGIN_PX: u32 = 12;
const HEAD_PX: u32 = 44;
const PAPER: [u8; 3] = [250, 250, 248];
const INK: [u8; 3] = [30, 32, 38];
const FAINT: [u8; 3] = [110, 114, 122];
const BAR: [u8; 3] = [20, 150, 70];
const TROUGH: [u8; 3] = [222, 224, 226];
const LINE_PX: f32 = 17.0;
const NEWS_LINE_PX: u32 = 19;
const NEWS_PX: f32 = 14.0;
/// As wide as the frame number before a piece of news.
const NEWS_INDENT: &str = "       ";
/// News that are kept: as many as fit where there is no map at all.
pub(super) const MAX_NEWS: usize = 30;

/// What a picture shows.
pub(super) struct Contents<'a> {
    pub header: &'a Header,
    pub world: &'a World,
    /// What partner and helper see.
    pub eyes: &'a [Images],
    /// What each of them believes to see.
    pub believed: &'a [Vec<Mark>],
    pub map: &'a RgbImage,
    pub captions: &'a [Caption],
    /// What happened last, newest last.
    pub news: &'a [String],
}

pub(super) fn compose(contents: &Contents<'_>) -> RgbImage {
    let mut image = RgbImage::from_pixel(WIDTH_PX, HEIGHT_PX, Rgb(PAPER));
    head(&mut image, contents);
    for (k, eye) in contents.eyes.iter().enumerate() {
        let x = MARGIN_PX + k as u32 * (EYE_PX + MARGIN_PX);
        let side = eye.rgb.as_ref().map_or(0, |rgb| (rgb.len() / 3).isqrt() as u32);
        let picture = eye.rgb.clone().and_then(|b| RgbImage::from_raw(side, side, b));
        let Some(mut picture) = picture else { continue };
        if side != EYE_PX {
            picture = imageops::resize(&picture, EYE_PX, EYE_PX, imageops::FilterType::Triangle);
        }
        for mark in contents.believed.get(k).into_iter().flatten() {
            draw_mark(&mut picture, mark);
        }
        imageops::replace(&mut image, &picture, i64::from(x), i64::from(HEAD_PX));
    }
    let below = map(&mut image, contents.map);
    captions(&mut image, contents);
    news(&mut image, below, contents.news);
    image
}

/// Something that is written where somebody believes to see it.
pub(super) struct Mark {
    /// Where, as shares of the image's sides, from the left and the top.
    at: [f32; 2],
    words: String,
    color: [u8; 3],
}

/// A color for a label: the same in all pictures, light enough to read over dark.
fn color_of(label: u8) -> [u8; 3] {
    [37u32, 91, 143].map(|m| (u32::from(label) * m % 160 + 95) as u8)
}

/// Colors pixels of an image by a label.
pub(super) fn tint(rgb: &mut [u8], pixels: &[u32], label: u8) {
    let color = color_of(label);
    for k in pixels {
        for (c, of_label) in rgb[3 * *k as usize..][..3].iter_mut().zip(color) {
            *c = *c / 2 + of_label / 2;
        }
    }
}

/// What is believed to be in sight, where this camera has it.
pub(super) fn marks(believed: &[Believed], camera: &Camera) -> Vec<Mark> {
    let mark = |thing: &Believed| {
        let [x, y, z] = thing.at_cm.map(|cm| 0.01 * cm as f32);
        let (at, _) = camera.project(Vec3::new(x, y, z))?;
        let at = [at.x / camera.width as f32, at.y / camera.height as f32];
        let words = format!("{} {}", thing.class.info().label, thing.name);
        // Labels of pixels count the background as 0.
        let color = color_of(thing.class.index() as u8 + 1);
        at.iter().all(|x| (0.0..1.0).contains(x)).then_some(Mark { at, words, color })
    };
    believed.iter().filter_map(mark).collect()
}

fn draw_mark(image: &mut RgbImage, Mark { at, words, color }: &Mark) {
    /// Half the side of the dot, pixels.
    const DOT_PX: u32 = 2;
    const WORDS_PX: f32 = 12.0;
    let side = image.width();
    let [x, y] = at.map(|share| (share * side as f32) as u32);
    let (left, top) = (x.saturating_sub(DOT_PX), y.saturating_sub(DOT_PX));
    for (i, j) in (top..(y + DOT_PX).min(side))
        .flat_map(|j| (left..(x + DOT_PX).min(side)).map(move |i| (i, j)))
    {
        image.put_pixel(i, j, Rgb(*color));
    }
    let from = (x + 2 * DOT_PX) as f32;
    let is_beside = from + text::width(words, WORDS_PX) < side as f32;
    let (from, align) = if is_beside { (from, Align::Left) } else { (left as f32, Align::Right) };
    let y = (y as f32 - 0.5 * WORDS_PX).clamp(0.0, side as f32 - WORDS_PX);
    // A dark edge, since what is behind may be light.
    text::draw(image, (from + 1.0, y + 1.0), WORDS_PX, INK, align, words);
    text::draw(image, (from, y), WORDS_PX, *color, align, words);
}

fn head(image: &mut RgbImage, Contents { header, world, .. }: &Contents<'_>) {
    let title = format!("{}, helper {}, seed {}", header.episode, header.helper, header.seed);
    let left = MARGIN_PX as f32;
    text::draw(image, (left, 10.0), 20.0, INK, Align::Left, &title);
    let (done, total) = world.progress();
    let unit = match world.setup().task.info().worth.unit() {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let (frame, horizon) = (world.state().frame, world.setup().horizon);
    let words = format!("done {done:.0} of {total:.0}{unit}    frame {frame} of {horizon}");
    let right = (WIDTH_PX - MARGIN_PX) as f32;
    text::draw(image, (right, 6.0), LINE_PX, INK, Align::Right, &words);
    // Two bars: what is done, and what of the time has passed.
    let share = if total > 0.0 { done / total } else { 0.0 };
    let passed = f64::from(frame) / f64::from(horizon);
    for (k, (share, color)) in [(share, BAR), (passed, FAINT)].into_iter().enumerate() {
        let (x0, x1) = (WIDTH_PX - MARGIN_PX - EYE_PX, WIDTH_PX - MARGIN_PX);
        let y0 = 27 + 7 * k as u32;
        let filled = x0 + (share.clamp(0.0, 1.0) * f64::from(x1 - x0)) as u32;
        fill(image, [x0, y0, x1, y0 + 5], TROUGH);
        fill(image, [x0, y0, filled, y0 + 5], color);
    }
}

/// Fits the map into what is left to the right of the eyes; returns where it ends.
fn map(image: &mut RgbImage, map: &RgbImage) -> u32 {
    let x = 3 * MARGIN_PX + 2 * EYE_PX;
    let (width, height) = (WIDTH_PX - MARGIN_PX - x, HEIGHT_PX - HEAD_PX - MARGIN_PX);
    let (w, h) = map.dimensions();
    let scale = (f64::from(width) / f64::from(w)).min(f64::from(height) / f64::from(h)).min(1.0);
    let y = i64::from(HEAD_PX);
    if scale < 1.0 {
        let (w, h) = ((f64::from(w) * scale) as u32, (f64::from(h) * scale) as u32);
        let fitted = imageops::resize(map, w.max(1), h.max(1), imageops::FilterType::Triangle);
        imageops::replace(image, &fitted, i64::from(x), y);
        return HEAD_PX + fitted.height();
    }
    imageops::replace(image, map, i64::from(x), y);
    HEAD_PX + h
}

/// The latest news, as many as fit below the map.
fn news(image: &mut RgbImage, top: u32, news: &[String]) {
    let x = (3 * MARGIN_PX + 2 * EYE_PX) as f32;
    let width = WIDTH_PX as f32 - MARGIN_PX as f32 - x;
    let room = HEIGHT_PX.saturating_sub(top + 2 * MARGIN_PX) / NEWS_LINE_PX;
    let rows: Vec<String> =
        news.iter().flat_map(|n| wrapped(n, NEWS_PX, width, NEWS_INDENT)).collect();
    let skipped = rows.len().saturating_sub(room as usize);
    for (k, row) in rows.iter().skip(skipped).enumerate() {
        let y = (top + MARGIN_PX + k as u32 * NEWS_LINE_PX) as f32;
        text::draw(image, (x, y), NEWS_PX, INK, Align::Left, row);
    }
}

fn captions(image: &mut RgbImage, Contents { captions, .. }: &Contents<'_>) {
    let top = (HEAD_PX + EYE_PX + 10) as f32;
    for (k, caption) in captions.iter().enumerate().take(2) {
        let x = (MARGIN_PX + k as u32 * (EYE_PX + MARGIN_PX)) as f32;
        text::draw(image, (x, top), LINE_PX, INK, Align::Left, &caption.who);
        lines(image, x, top + 24.0, &caption.action, INK);
        let noticed = caption.noticed.as_ref().map(|noticed| format!("saw {noticed}"));
        let plan = [caption.plan.clone()].into_iter().chain(noticed).collect::<Vec<_>>().join("; ");
        lines(image, x, top + 70.0, &plan, FAINT);
    }
    let left = MARGIN_PX as f32;
    if let Some(child) = captions.get(2) {
        let words = format!("{}: {}, {}", child.who, child.action, child.plan);
        text::draw(image, (left, top + 122.0), LINE_PX, INK, Align::Left, &words);
    }
}

/// At most two lines, no wider than an eye's picture.
fn lines(image: &mut RgbImage, x: f32, y: f32, words: &str, color: [u8; 3]) {
    for (k, row) in wrapped(words, LINE_PX, EYE_PX as f32, "").iter().take(2).enumerate() {
        text::draw(image, (x, y + 21.0 * k as f32), LINE_PX, color, Align::Left, row);
    }
}

/// Breaks a text between words into rows no wider than `width_px`; rows after the first begin
/// with `indent`.
fn wrapped(words: &str, size_px: f32, width_px: f32, indent: &str) -> Vec<String> {
    let mut rows = Vec::new();
    let mut row = String::new();
    for word in words.split_inclusive(' ') {
        let longer = format!("{row}{word}");
        if !row.trim().is_empty() && text::width(longer.trim_end(), size_px) > width_px {
            rows.push(std::mem::replace(&mut row, format!("{indent}{word}")));
        } else {
            row = longer;
        }
    }
    rows.push(row);
    rows
}

fn fill(image: &mut RgbImage, [x0, y0, x1, y1]: [u32; 4], color: [u8; 3]) {
    for y in y0..y1.min(HEIGHT_PX) {
        for x in x0..x1.min(WIDTH_PX) {
            image.put_pixel(x, y, Rgb(color));
        }
    }
}
