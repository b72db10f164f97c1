//! Writes the weights of a checkpoint as a file for minds:
//! `cargo run --release -p chaic-vision --example export_detector -- CHECKPOINT FILE`.

use std::error::Error;
use std::fs;

use chaic_nn::weights;
use chaic_vision::perception::DETECTOR_KIND;
use chaic_vision::train::{Trainer, TrainingRules};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(checkpoint), Some(file)) = (arguments.next(), arguments.next()) else {
        return Err("name a checkpoint and a file".into());
    };
    let mut trainer = Trainer::new(TrainingRules::shipped(1));
    if !trainer.resume(&fs::read(&checkpoint)?) {
        return Err(format!("{checkpoint} is of another network").into());
    }
    let network = &trainer.detector.network;
    fs::write(&file, weights::to_bytes(network, &trainer.average, DETECTOR_KIND))?;
    println!("{file}: the numbers after step {}", trainer.adam.steps);
    Ok(())
}
