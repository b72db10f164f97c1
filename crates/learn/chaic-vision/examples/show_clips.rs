//! Draws labeled clips, one per row:
//! `cargo run --release -p chaic-vision --example show_clips -- CLIPS OUT.png`.
use std::sync::atomic::AtomicBool;

use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::clip::{CROPS, ClipCounts};
use chaic_vision::behavior::collect::{Collector, collect};
use chaic_vision::behavior::config::ClipCollectionConfig;
use chaic_vision::behavior::crop::SIDE;
use chaic_vision::views::DatasetSplit;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let max_per_class = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(4);
    let out = arguments.next().unwrap_or_else(|| "clips.png".to_owned());
    let config =
        ClipCollectionConfig { max_per_class, episodes: 64, ..ClipCollectionConfig::default() };
    let (split, perception) = (DatasetSplit::Train, &GroundTruthPerceptionFactory);
    let collector = Collector { split, config: &config, perception, n_threads: 2, folder: None };
    let start = std::time::Instant::now();
    let mut progress = |n: usize, counts: &ClipCounts| {
        println!("{n} episodes, {:.0} s: {counts:?}", start.elapsed().as_secs_f64());
    };
    let clips = collect(&collector, &mut progress, &AtomicBool::new(false))?;
    let mut clips = clips.expect("the flag is not set").clips;
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
