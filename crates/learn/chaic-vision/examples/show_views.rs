//! Writes views that the detector is trained with, as one picture, each beside its labels:
//! `cargo run --release -p chaic-vision --example show_views -- FILE`.

use std::time::Instant;

use chaic_vision::labels::{class_of, n_labels};
use chaic_vision::views::{DatasetSplit, SyntheticViews, ViewConfig};
use image::{Rgb, RgbImage};

const COLUMNS: u32 = 4;
const ROWS: u32 = 4;
const SIDE: u32 = 256;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "views.png".to_owned());
    let mut picture = RgbImage::new(2 * SIDE * COLUMNS, SIDE * ROWS);
    for k in 0..COLUMNS * ROWS {
        let view =
            SyntheticViews::new(DatasetSplit::Train, ViewConfig::TRAINING, 1, u64::from(k)).draw();
        let (x0, y0) = (2 * SIDE * (k % COLUMNS), SIDE * (k / COLUMNS));
        for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
            let at = (2 * y * view.camera.width + 2 * x) as usize;
            let rgb = &view.rgb[3 * at..][..3];
            picture.put_pixel(x0 + x, y0 + y, Rgb([rgb[0], rgb[1], rgb[2]]));
            let label = view.labels.get(usize::from(view.ids[at])).copied().unwrap_or(0);
            let hue = |n: u32| (u32::from(label) * n % 200 + 55) as u8;
            let color = if label == 0 { [0; 3] } else { [hue(37), hue(91), hue(143)] };
            picture.put_pixel(x0 + SIDE + x, y0 + y, Rgb(color));
        }
        let aimed = view.aimed_at.and_then(|e| class_of(view.labels[usize::from(e.0)]));
        println!("{k}: {}", aimed.map_or("anywhere", |class| class.name()));
    }
    picture.save(&out)?;
    let (start, mut n_instances, mut n_views) = (Instant::now(), vec![0u32; n_labels()], 0);
    for k in 0..800 {
        let view = SyntheticViews::new(DatasetSplit::Train, ViewConfig::TRAINING, 2, k).draw();
        let mut sizes = vec![0u32; view.labels.len()];
        for id in &view.ids {
            if let Some(size) = sizes.get_mut(usize::from(*id)) {
                *size += 1;
            }
        }
        n_views += 1;
        for (label, size) in view.labels.iter().zip(sizes) {
            n_instances[usize::from(*label)] += u32::from(size >= 100);
        }
    }
    println!("{n_views} views in {:?}; instances of 100 pixels or more:", start.elapsed());
    let mut all: Vec<(u32, &str)> = (1..n_labels())
        .map(|l| (n_instances[l], class_of(l as u8).map_or("", |class| class.name())))
        .collect();
    all.sort();
    all.iter().for_each(|(n, name)| print!("{name} {n}, "));
    println!();
    Ok(())
}
