//! Draws the detections in held-out views, the best and the worst of them:
//! `cargo run --release -p chaic-vision --example show_detections -- FILE [WEIGHTS]`.

use std::error::Error;
use std::fs;

use chaic_render::text::{self, Align};
use chaic_vision::average_precision::EvaluatedImage;
use chaic_vision::error_breakdown::{ErrorBreakdown, REPORT_SCORE};
use chaic_vision::evaluate::{MIN_AREA_PX, compare};
use chaic_vision::instances::Instance;
use chaic_vision::labels::class_of;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{DatasetSplit, LabeledView, SyntheticViews, ViewConfig};
use image::{Rgb, RgbImage, imageops};

/// Number of evaluated views.
const VIEWS: u64 = 96;
/// Number of best and of worst views that are drawn.
const COLUMNS: usize = 4;
/// Side of a drawn view, pixels.
const SIDE_PX: u32 = 320;
/// Minimum number of instances of a view.
const MIN_INSTANCES: u32 = 5;
const INK: [u8; 3] = [255, 255, 255];
const MISSED: [u8; 3] = [255, 60, 60];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("usage: show_detections FILE [WEIGHTS]")?;
    let detector = match arguments.next() {
        Some(weights) => TrainedDetector::from_bytes(&fs::read(weights)?)?,
        None => TrainedDetector::built_in(),
    };
    let mut inference = detector.inference();
    let mut evaluated: Vec<(f64, LabeledView, Vec<Instance>)> = Vec::new();
    for k in 0..VIEWS {
        let view = SyntheticViews::new(DatasetSplit::Test, ViewConfig::ALL_CLASSES, 2, k).draw();
        let detections = detector.detect(&view.rgb, &view.depth_m, &view.camera, &mut inference);
        let errors = ErrorBreakdown::new(&[compare(&view, &detections)], &(MIN_AREA_PX..=u32::MAX));
        let ErrorBreakdown { detected: correct, poor_mask, wrong_class, merged, missed, .. } =
            errors;
        let n_instances = correct + poor_mask + wrong_class + merged + missed;
        if n_instances >= MIN_INSTANCES {
            evaluated.push((f64::from(correct) / f64::from(n_instances), view, detections));
        }
    }
    evaluated.sort_by(|a, b| b.0.total_cmp(&a.0));
    let rows = evaluated[..COLUMNS].iter().chain(&evaluated[evaluated.len() - COLUMNS..]);
    let mut sheet = RgbImage::new(COLUMNS as u32 * SIDE_PX, 2 * SIDE_PX);
    for (k, (recall, view, detections)) in rows.enumerate() {
        println!("{recall:.2} of the instances found");
        let picture = draw(view, detections);
        let picture = imageops::resize(&picture, SIDE_PX, SIDE_PX, imageops::FilterType::Triangle);
        let [x, y] = [k % COLUMNS, k / COLUMNS].map(|n| n as i64 * i64::from(SIDE_PX));
        imageops::replace(&mut sheet, &picture, x, y);
    }
    Ok(sheet.save(out)?)
}

/// Draws the reported detections of a view; missed instances have a red outline.
fn draw(view: &LabeledView, detections: &[Instance]) -> RgbImage {
    let (width, height) = (view.camera.width, view.camera.height);
    let mut picture = RgbImage::from_raw(width, height, view.rgb.clone())
        .expect("the buffer has the camera's size");
    let reported: Vec<&Instance> =
        detections.iter().filter(|f| f.score() >= REPORT_SCORE).collect();
    for instance in &reported {
        let hue = |m: u32| (u32::from(instance.label()) * m % 160 + 95) as u8;
        for k in &instance.pixels {
            let pixel = picture.get_pixel_mut(k % width, k / width);
            for (c, m) in pixel.0.iter_mut().zip([37, 91, 143]) {
                *c = *c / 2 + hue(m) / 2;
            }
        }
    }
    for id in missed(view, &compare(view, detections)) {
        let is_missed = |x: u32, y: u32| view.ids[(y * width + x) as usize] == id;
        for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
            let neighbors = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
            if is_missed(x, y) && neighbors.into_iter().any(|(x, y)| !is_missed(x, y)) {
                picture.put_pixel(x, y, Rgb(MISSED));
            }
        }
    }
    for instance in reported {
        let n = instance.pixels.len() as u32;
        let mean = |coordinate: fn(u32, u32) -> u32| {
            instance.pixels.iter().map(|k| coordinate(*k, width)).sum::<u32>() as f32 / n as f32
        };
        let at = (mean(|k, width| k % width), mean(|k, width| k / width) - 7.0);
        let name = class_of(instance.label()).map_or("", |class| class.info().label);
        text::draw(&mut picture, (at.0 + 1.0, at.1 + 1.0), 15.0, [0; 3], Align::Center, name);
        text::draw(&mut picture, at, 15.0, INK, Align::Center, name);
    }
    picture
}

/// Returns the ids of evaluated instances without a reported detection of their label at IoU 0.5.
fn missed(view: &LabeledView, image: &EvaluatedImage) -> Vec<u16> {
    let visible = (0..view.labels.len() as u16)
        .filter(|id| view.labels[usize::from(*id)] != 0 && view.ids.contains(id));
    let evaluated = visible.zip(&image.truths).enumerate();
    let evaluated = evaluated.filter(|(_, (_, truth))| truth.area >= MIN_AREA_PX);
    let is_found = |t: usize, label: u8, area: u32| {
        image.detections.iter().any(|d| {
            d.label == label && d.score >= REPORT_SCORE && 3 * d.intersections[t] >= area + d.area
        })
    };
    evaluated
        .filter(|(t, (_, truth))| !is_found(*t, truth.label, truth.area))
        .map(|(_, (id, _))| id)
        .collect()
}
