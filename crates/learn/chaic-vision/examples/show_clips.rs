//! Clips with labels as pictures, a row each: `cargo run --release -p chaic-vision --example show_clips
//! -- CLIPS OUT.png`.
use std::sync::atomic::AtomicBool;

use chaic_agents::sight::TrueSight;
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::clip::CROPS;
use chaic_vision::behavior::collect::{CollectRules, Collector, Counts, collect};
use chaic_vision::behavior::crop::SIDE;
use chaic_vision::views::Part;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let of_each = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(4);
    let out = arguments.next().unwrap_or_else(|| "clips.png".to_owned());
    let rules = CollectRules { of_each, episodes: 64, ..CollectRules::default() };
    let (part, sight) = (Part::Training, &TrueSight);
    let collector = Collector { part, rules: &rules, sight, n_threads: 2, folder: None };
    let began = std::time::Instant::now();
    let mut progress = |n: usize, counts: &Counts| {
        println!("{n} episodes, {:.0} s: {counts:?}", began.elapsed().as_secs_f64());
    };
    let clips = collect(&collector, &mut progress, &AtomicBool::new(false))?;
    let mut clips = clips.expect("nobody stops it");
    clips.sort_by_key(|clip| (clip.is_mixed, clip.label));
    println!("{:?}, then mixed, from top to bottom", Behavior::ALL);
    let shown = CROPS / 2;
    let mut sheet = image::RgbImage::new((shown * SIDE) as u32, (clips.len() * SIDE) as u32);
    for (row, clip) in clips.iter().enumerate() {
        for (column, crop) in clip.crops.iter().take(CROPS).step_by(2).enumerate() {
            for (k, rgb) in crop.rgb.as_chunks::<3>().0.iter().enumerate() {
                let x = (column * SIDE + k % SIDE) as u32;
                sheet.put_pixel(x, (row * SIDE + k / SIDE) as u32, image::Rgb(*rgb));
            }
        }
    }
    Ok(sheet.save(out)?)
}
