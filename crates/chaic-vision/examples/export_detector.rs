//! Writes the weights of a checkpoint as a file for minds:
//! `cargo run --release -p chaic-vision --example export_detector -- CHECKPOINT FILE`.

use std::error::Error;
use std::fs;

use chaic_vision::evaluate::calibrate;
use chaic_vision::train::{Trainer, TrainingRules};
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::ViewRules;

/// Views that scores are calibrated by.
const CALIBRATION_VIEWS: usize = 400;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(checkpoint), Some(file)) = (arguments.next(), arguments.next()) else {
        return Err("name a checkpoint and a file".into());
    };
    let mut trainer = Trainer::new(TrainingRules::shipped(1));
    if !trainer.resume(&fs::read(&checkpoint)?) {
        return Err(format!("{checkpoint} is of another network").into());
    }
    let mut detector = TrainedDetector::uncalibrated(&trainer.detector, &trainer.average);
    detector.calibration = calibrate(&detector, ViewRules::NATURAL, CALIBRATION_VIEWS, 2);
    fs::write(&file, detector.to_bytes())?;
    println!("{file}: the numbers after step {}", trainer.adam.steps);
    Ok(())
}
