//! `chaic train` and `chaic eval-perception`.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, Result};
use chaic_files::{read_bounded, write_whole};
use chaic_vision::evaluate::{DetectionReport, LEAST_PX, report};
use chaic_vision::train::TrainingRules;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::training_run::{Record, TrainingRun, WEIGHTS, read_rules};
use chaic_vision::views::{Part, ViewRules};

use super::{bars, jobs};
use crate::arguments::{
    DetectionArguments, EvalPerceptionCommand, Look, TrainArguments, TrainCommand,
};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// No weights are larger, bytes.
const MOST_BYTES: u64 = 1 << 28;

/// Trains.
pub fn train(command: &TrainCommand) -> Result<Ended> {
    let TrainCommand::Detector(arguments) = command;
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let mut run = open(arguments)?;
    let (done, steps) = run.extent();
    let bar = bars::plain(steps, "steps");
    bar.set_position(done);
    let began = Instant::now();
    let is_whole = run.go_on(stop, &mut |record| match record {
        Record::Loss { step, labels, offsets, right_of_things, .. } => {
            bar.set_position(*step);
            bar.set_message(format!(
                "loss {labels:.3} + {offsets:.3}, right {:.1} %",
                100.0 * right_of_things
            ));
        }
        Record::Validation { step, map50, map } => bar.suspend(|| {
            let s = began.elapsed().as_secs();
            complain(&format!("step {step}, {s} s: map50 {map50:.3}, map {map:.3}"));
        }),
    });
    bar.finish_and_clear();
    let out = quoted_path(&arguments.out);
    if !is_whole? {
        let (done, steps) = run.extent();
        complain(&format!("stopped after {done} of {steps} steps"));
        complain(&format!("go on with: chaic train detector --resume --out {out}"));
        return Ok(Ended::Interrupted);
    }
    let weights = quoted_path(&arguments.out.join(WEIGHTS));
    say(&format!("Weights:  {weights}\n"))?;
    say(&format!("Evaluate: chaic eval-perception detection --weights {weights}\n"))?;
    Ok(Ended::Well)
}

fn open(arguments: &TrainArguments) -> Result<TrainingRun> {
    if arguments.resume {
        return Ok(TrainingRun::resume(&arguments.out)?);
    }
    let rules = arguments.config.as_deref().map(read_rules).transpose()?;
    let rules = rules.unwrap_or_default();
    let steps = arguments.steps.unwrap_or(rules.steps);
    Ok(TrainingRun::begin(&arguments.out, TrainingRules { steps, ..rules })?)
}

/// Tells how good perception is.
pub fn evaluate(command: &EvalPerceptionCommand) -> Result<Ended> {
    let EvalPerceptionCommand::Detection(arguments) = command;
    let detector = read_detector(&arguments.weights)?;
    let varied = if arguments.look == Look::Varied { 1.0 } else { 0.0 };
    let rules = ViewRules { varied, ..ViewRules::TRAINING };
    let n_views = arguments.views as usize;
    let found = report(&detector, (Part::Test, rules), n_views, jobs(arguments.jobs));
    say(&text(&found, arguments))?;
    if let Some(path) = &arguments.json {
        let json = serde_json::to_string_pretty(&found).expect("a report is plain data") + "\n";
        write_whole(path, json.as_bytes())?;
    }
    Ok(Ended::Well)
}

/// The detector in a file.
pub(super) fn read_detector(path: &Path) -> Result<TrainedDetector> {
    let bytes = read_bounded(path, MOST_BYTES)?;
    TrainedDetector::from_bytes(&bytes).with_context(|| path.display().to_string())
}

fn text(found: &DetectionReport, arguments: &DetectionArguments) -> String {
    let mut text = format!("{:24} {:>6} {:>6} {:>9}\n", "class", "AP50", "AP", "instances");
    for (name, (ap50, ap, n)) in &found.classes {
        text += &format!("{name:24} {ap50:6.3} {ap:6.3} {n:9}\n");
    }
    let DetectionReport { views, map50, map, smaller, calibration_error, failures, .. } = found;
    text += &format!(
        "\n{views} views, {:?} look, instances of {LEAST_PX} pixels and more: map50 {map50:.3}, map \
         {map:.3}\n",
        arguments.look
    );
    for (px, [map50, map]) in smaller {
        text += &format!("with those of {px} and more: map50 {map50:.3}, map {map:.3}\n");
    }
    text += &format!("calibration error of scores: {calibration_error:.3}\n");
    text += &format!(
        "at a score of one half, found {}, poor mask {}, wrong class {}, merged {}, missed {}; told \
         besides: pieces {}, nothing there {}\n",
        failures.found,
        failures.poor_mask,
        failures.wrong_class,
        failures.merged,
        failures.missed,
        failures.split,
        failures.nothing_there
    );
    text
}
