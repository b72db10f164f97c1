//! Trains the detector: `cargo run --release -p chaic-vision --example train_detector -- STEPS OUT`.
use std::fs;
use std::io::Write as _;
use std::time::Instant;

use chaic_vision::evaluate::evaluate;
use chaic_vision::train::{Trainer, TrainingRules};
use chaic_vision::trained::TrainedDetector;

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let steps = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1000);
    let out = arguments.next().unwrap_or_else(|| "runs/detector".to_owned());
    fs::create_dir_all(&out)?;
    let rules = TrainingRules::shipped(steps);
    let mut trainer = Trainer::new(rules);
    let checkpoint = format!("{out}/checkpoint.bin");
    if let Ok(bytes) = fs::read(&checkpoint) {
        assert!(trainer.resume(&bytes), "{checkpoint} is of another network");
    }
    println!("{} numbers, from step {}", trainer.numbers.len(), trainer.adam.steps);
    let mut log =
        fs::OpenOptions::new().create(true).append(true).open(format!("{out}/log.txt"))?;
    let began = Instant::now();
    let (mut sum, mut n) = ([0.0; 4], 0);
    while trainer.adam.steps < steps {
        let loss = trainer.step();
        for (sum, x) in
            sum.iter_mut().zip([loss.labels, loss.offsets, loss.right, loss.right_of_things])
        {
            *sum += x;
        }
        n += 1;
        let step = trainer.adam.steps;
        if step.is_multiple_of(20) {
            let [labels, offsets, right, things] = sum.map(|x| x / f64::from(n));
            let line = format!(
                "{step} {:.0}s labels {labels:.4} offsets {offsets:.4} right {right:.3} things {things:.3}",
                began.elapsed().as_secs_f64()
            );
            println!("{line}");
            writeln!(log, "{line}")?;
            (sum, n) = ([0.0; 4], 0);
        }
        if step.is_multiple_of(250) {
            fs::write(format!("{checkpoint}.new"), trainer.checkpoint())?;
            fs::rename(format!("{checkpoint}.new"), &checkpoint)?;
        }
        if step.is_multiple_of(1000) || step == steps {
            let detector = TrainedDetector::uncalibrated(&trainer.detector, &trainer.average);
            let found = evaluate(&detector, rules.views, 200, 2);
            let line =
                format!("validation at {step}: map50 {:.3}, map {:.3}", found.map50, found.map);
            println!("{line}");
            writeln!(log, "{line}")?;
        }
    }
    Ok(())
}
