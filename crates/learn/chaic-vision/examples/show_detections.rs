//! Draws what the detector finds in unseen views, the best and the worst of them:
//! `cargo run --release -p chaic-vision --example show_detections -- FILE [WEIGHTS]`.

use std::error::Error;
use std::fs;

use chaic_render::text::{self, Align};
use chaic_vision::average_precision::Image;
use chaic_vision::evaluate::{LEAST_PX, compare};
use chaic_vision::failures::{Failures, TOLD_SCORE};
use chaic_vision::instances::Instance;
use chaic_vision::labels::class_of;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{LabelledView, Part, ViewRules, Views};
use image::{Rgb, RgbImage, imageops};

/// Views that are looked at, how many of the best and of the worst are drawn, and how wide.
const VIEWS: u64 = 96;
const COLUMNS: usize = 4;
const SIDE_PX: u32 = 320;
/// Views with fewer instances show little.
const LEAST_INSTANCES: u32 = 5;
const INK: [u8; 3] = [255, 255, 255];
const MISSED: [u8; 3] = [255, 60, 60];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("into which file?")?;
    let detector = match arguments.next() {
        Some(weights) => TrainedDetector::from_bytes(&fs::read(weights)?)?,
        None => TrainedDetector::built_in(),
    };
    let mut inference = detector.inference();
    let mut seen: Vec<(f64, LabelledView, Vec<Instance>)> = Vec::new();
    for k in 0..VIEWS {
        let view = Views::new(Part::Test, ViewRules::ALL_CLASSES, 2, k).draw();
        let found = detector.detect((&view.rgb, &view.depth_m, &view.camera), &mut inference);
        let failures = Failures::of(&[compare(&view, &found)], &(LEAST_PX..=u32::MAX));
        let Failures { found: right, poor_mask, wrong_class, merged, missed, .. } = failures;
        let asked = right + poor_mask + wrong_class + merged + missed;
        if asked >= LEAST_INSTANCES {
            seen.push((f64::from(right) / f64::from(asked), view, found));
        }
    }
    seen.sort_by(|a, b| b.0.total_cmp(&a.0));
    let rows = seen[..COLUMNS].iter().chain(&seen[seen.len() - COLUMNS..]);
    let mut sheet = RgbImage::new(COLUMNS as u32 * SIDE_PX, 2 * SIDE_PX);
    for (k, (share, view, found)) in rows.enumerate() {
        println!("{share:.2} of the instances found");
        let picture = draw(view, found);
        let picture = imageops::resize(&picture, SIDE_PX, SIDE_PX, imageops::FilterType::Triangle);
        let [x, y] = [k % COLUMNS, k / COLUMNS].map(|n| n as i64 * i64::from(SIDE_PX));
        imageops::replace(&mut sheet, &picture, x, y);
    }
    Ok(sheet.save(out)?)
}

/// A view with what is told in it; what is missed has a red edge.
fn draw(view: &LabelledView, found: &[Instance]) -> RgbImage {
    let (width, height) = (view.camera.width, view.camera.height);
    let mut picture =
        RgbImage::from_raw(width, height, view.rgb.clone()).expect("a view has this shape");
    let told: Vec<&Instance> = found.iter().filter(|f| f.score >= TOLD_SCORE).collect();
    for instance in &told {
        let hue = |m: u32| (u32::from(instance.label) * m % 160 + 95) as u8;
        for k in &instance.pixels {
            let pixel = picture.get_pixel_mut(k % width, k / width);
            for (c, m) in pixel.0.iter_mut().zip([37, 91, 143]) {
                *c = *c / 2 + hue(m) / 2;
            }
        }
    }
    for id in missed(view, &compare(view, found)) {
        let is_it = |x: u32, y: u32| view.ids[(y * width + x) as usize] == id;
        for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
            let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
            if is_it(x, y) && around.into_iter().any(|(x, y)| !is_it(x, y)) {
                picture.put_pixel(x, y, Rgb(MISSED));
            }
        }
    }
    for instance in told {
        let n = instance.pixels.len() as u32;
        let mean = |of: fn(u32, u32) -> u32| {
            instance.pixels.iter().map(|k| of(*k, width)).sum::<u32>() as f32 / n as f32
        };
        let at = (mean(|k, width| k % width), mean(|k, width| k / width) - 7.0);
        let name = class_of(instance.label).map_or("", |class| class.info().label);
        text::draw(&mut picture, (at.0 + 1.0, at.1 + 1.0), 15.0, [0; 3], Align::Center, name);
        text::draw(&mut picture, at, 15.0, INK, Align::Center, name);
    }
    picture
}

/// The ids of things that are asked for and overlap nothing of their label that is told by half.
fn missed(view: &LabelledView, image: &Image) -> Vec<u16> {
    let shown = (0..view.labels.len() as u16)
        .filter(|id| view.labels[usize::from(*id)] != 0 && view.ids.contains(id));
    let asked = shown.zip(&image.truths).enumerate();
    let asked = asked.filter(|(_, (_, truth))| truth.area >= LEAST_PX);
    let is_found = |t: usize, label: u8, area: u32| {
        image
            .detections
            .iter()
            .any(|d| d.label == label && d.score >= TOLD_SCORE && 3 * d.shared[t] >= area + d.area)
    };
    asked
        .filter(|(t, (_, truth))| !is_found(*t, truth.label, truth.area))
        .map(|(_, (id, _))| id)
        .collect()
}
