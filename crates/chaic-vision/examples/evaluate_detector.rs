//! How good a checkpoint is:
//! `cargo run --release -p chaic-vision --example evaluate_detector -- CHECKPOINT VIEWS [PICTURE]`.

use std::fs;

use chaic_nn::Inference;
use chaic_nn::simd::widest;
use chaic_vision::evaluate::{calibrate, evaluate};
use chaic_vision::labels::class_of;
use chaic_vision::train::{Trainer, TrainingRules};
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{Part, ViewRules, Views};
use image::{Rgb, RgbImage};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let checkpoint = arguments.next().ok_or("which checkpoint?")?;
    let n_views = arguments.next().map_or(Ok(200), |n| n.parse())?;
    let mut trainer = Trainer::new(TrainingRules::shipped(1));
    if !trainer.resume(&fs::read(&checkpoint)?) {
        return Err(format!("{checkpoint} is of another network").into());
    }
    let mut detector = TrainedDetector::uncalibrated(&trainer.detector, &trainer.learner.average);
    detector.calibration = calibrate(&detector, ViewRules::NATURAL, n_views, 2);
    println!("step {}: {:?}", trainer.learner.adam.steps, detector.calibration);
    let canonical = ViewRules { varied: 0.0, ..ViewRules::TRAINING };
    for (name, rules) in [("training", ViewRules::TRAINING), ("natural", ViewRules::NATURAL)] {
        let found = evaluate(&detector, rules, n_views, 2);
        println!("{name} views: map50 {:.3}, map {:.3}", found.map50, found.map);
    }
    let found = evaluate(&detector, canonical, n_views, 2);
    println!("canonical views: map50 {:.3}, map {:.3}", found.map50, found.map);
    for (label, (ap50, ap, n)) in &found.classes {
        let name = class_of(*label).map_or("", |class| class.name());
        println!("{name:24} {ap50:.3} {ap:.3} {n}");
    }
    let Some(out) = arguments.next() else { return Ok(()) };
    let mut inference = Inference::new(&trainer.detector.network, widest());
    let mut picture = RgbImage::new(2048, 1024);
    for n in 0..8u32 {
        let view = Views::new(Part::Validation, canonical, 1, u64::from(n)).draw();
        let (x0, y0) = (512 * (n % 4), 512 * (n / 4));
        for k in 0..512 * 512u32 {
            let rgb = &view.rgb[3 * k as usize..][..3];
            picture.put_pixel(x0 + k % 512, y0 + k / 512, Rgb([rgb[0], rgb[1], rgb[2]]));
        }
        let image = (&view.rgb[..], &view.depth_m[..], &view.camera);
        for instance in detector.detect(image, &mut inference) {
            let name = class_of(instance.label).map_or("", |class| class.name());
            print!("{name} {:.2}, ", instance.score);
            let hue = |m: u32| (u32::from(instance.label) * m % 200 + 55) as u8;
            for k in instance.pixels {
                let pixel = picture.get_pixel_mut(x0 + k % 512, y0 + k / 512);
                for (c, m) in pixel.0.iter_mut().zip([37, 91, 143]) {
                    *c = *c / 2 + hue(m) / 2;
                }
            }
        }
        println!();
    }
    picture.save(&out)?;
    Ok(())
}
