//! `chaic train` and `chaic eval-perception`.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, Result};
use chaic_files::{read_bounded, write_whole};
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::collect::{CollectRules, collect};
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::report::report as behavior_report;
use chaic_vision::behavior::train::BehaviorTraining;
use chaic_vision::evaluate::{DetectionReport, LEAST_PX, report};
use chaic_vision::train::Trainer;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::training_run::{Of, Training, TrainingRun, read_rules};
use chaic_vision::views::{Part, ViewRules};
use serde::Serialize;

use super::{bars, jobs};
use crate::arguments::{
    BehaviorArguments, DetectionArguments, EvalPerceptionCommand, Look, Scenes, TrainArguments,
    TrainCommand,
};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// No weights are larger, bytes.
const MOST_BYTES: u64 = 1 << 28;

/// Trains.
pub fn train(command: &TrainCommand) -> Result<Ended> {
    match command {
        TrainCommand::Detector(arguments) => {
            train_one::<Trainer>("detector", "detection", arguments, |rules, steps| {
                rules.steps = steps;
            })
        }
        TrainCommand::Behavior(arguments) => {
            train_one::<BehaviorTraining>("behavior", "behavior", arguments, |rules, steps| {
                rules.steps = steps;
            })
        }
    }
}

/// Trains what `chaic train` and `chaic eval-perception` call by these names.
fn train_one<T: Training>(
    name: &str,
    evaluated: &str,
    arguments: &TrainArguments,
    set_steps: impl FnOnce(&mut T::Rules, u64),
) -> Result<Ended> {
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let bar = bars::plain(0, "steps");
    let mut run = open::<T>(arguments, set_steps, &mut |done| bar.set_message(done.to_owned()))?;
    let (done, steps) = run.extent();
    bar.set_length(steps);
    bar.set_position(done);
    let began = Instant::now();
    let is_whole = run.go_on(stop, &mut |record| {
        let figures: Vec<String> =
            record.figures.iter().map(|(name, x)| format!("{name} {x:.3}")).collect();
        let figures = figures.join(", ");
        match record.of {
            Of::Loss => {
                bar.set_position(record.step);
                bar.set_message(figures);
            }
            Of::Validation => bar.suspend(|| {
                let s = began.elapsed().as_secs();
                complain(&format!("step {}, {s} s: {figures}", record.step));
            }),
        }
    });
    bar.finish_and_clear();
    let out = quoted_path(&arguments.out);
    if !is_whole? {
        let (done, steps) = run.extent();
        complain(&format!("stopped after {done} of {steps} steps"));
        complain(&format!("go on with: chaic train {name} --resume --out {out}"));
        return Ok(Ended::Interrupted);
    }
    let weights = quoted_path(&arguments.out.join(T::WEIGHTS));
    say(&format!("Weights:  {weights}\n"))?;
    say(&format!("Evaluate: chaic eval-perception {evaluated} --weights {weights}\n"))?;
    Ok(Ended::Well)
}

fn open<T: Training>(
    arguments: &TrainArguments,
    set_steps: impl FnOnce(&mut T::Rules, u64),
    tell: &mut dyn FnMut(&str),
) -> Result<TrainingRun<T>> {
    if arguments.resume {
        return Ok(TrainingRun::resume(&arguments.out, tell)?);
    }
    let rules = arguments.config.as_deref().map(read_rules::<T>).transpose()?;
    let mut rules = rules.unwrap_or_default();
    if let Some(steps) = arguments.steps {
        set_steps(&mut rules, steps);
    }
    Ok(TrainingRun::begin(&arguments.out, &rules, tell)?)
}

/// Tells how good perception is.
pub fn evaluate(command: &EvalPerceptionCommand) -> Result<Ended> {
    match command {
        EvalPerceptionCommand::Detection(arguments) => evaluate_detection(arguments),
        EvalPerceptionCommand::Behavior(arguments) => evaluate_behavior(arguments),
    }
}

fn evaluate_detection(arguments: &DetectionArguments) -> Result<Ended> {
    let detector = match &arguments.weights {
        Some(path) => read_detector(path)?,
        None => TrainedDetector::built_in(),
    };
    let varied = if arguments.look == Look::Varied { 1.0 } else { 0.0 };
    let rules = match arguments.scenes {
        Scenes::Natural => ViewRules::NATURAL,
        Scenes::AllClasses => ViewRules::ALL_CLASSES,
        Scenes::Crowded => ViewRules::TRAINING,
    };
    let rules = ViewRules { varied, ..rules };
    let n_views = arguments.views as usize;
    let found = report(&detector, (Part::Test, rules), n_views, jobs(arguments.jobs));
    say(&text(&found, arguments))?;
    write_json(arguments.json.as_deref(), &found)
}

fn evaluate_behavior(arguments: &BehaviorArguments) -> Result<Ended> {
    let trained = read_behavior(&arguments.weights)?;
    let sight = super::sight::named_sight(&arguments.perception)?;
    let rules = CollectRules {
        of_each: arguments.clips as usize,
        episodes: arguments.episodes as usize,
        varied: if arguments.look == Look::Varied { 1.0 } else { 0.0 },
        ..CollectRules::default()
    };
    let n_threads = jobs(arguments.jobs);
    let bar = bars::plain(u64::from(arguments.episodes), "episodes");
    let clips = collect(Part::Test, &rules, &*sight, n_threads, &mut |n, _| {
        bar.set_position(n as u64);
    });
    bar.finish_and_clear();
    let found = behavior_report(&trained, &clips, n_threads);
    let mut text = format!("{:18}", "");
    for told in Behavior::ALL {
        text += &format!(" {:>17}", told.name());
    }
    for (label, told) in
        Behavior::ALL.iter().filter_map(|b| Some((b, found.confusion.get(b.name())?)))
    {
        text += &format!("\n{:18}", label.name());
        for b in Behavior::ALL {
            text += &format!(" {:17}", told.get(b.name()).copied().unwrap_or(0));
        }
    }
    text += &format!(
        "\n\n{} clips of {} perception, {:?} look, told as in each column\n\
         top1 {:.3} +- {:.3}; mean of classes {:.3}; calibration error {:.3}\n\
         of clips in which something goes on but has not just ended, told as moving: {:.3}\n",
        found.clips,
        arguments.perception,
        arguments.look,
        found.top1,
        found.interval,
        found.balanced,
        found.calibration_error,
        found.mixed_as_moving
    );
    say(&text)?;
    write_json(arguments.json.as_deref(), &found)
}

fn write_json(path: Option<&Path>, found: &impl Serialize) -> Result<Ended> {
    if let Some(path) = path {
        let json = serde_json::to_string_pretty(found).expect("a report is plain data") + "\n";
        write_whole(path, json.as_bytes())?;
    }
    Ok(Ended::Well)
}

/// The behavior network in a file.
pub(super) fn read_behavior(path: &Path) -> Result<TrainedBehavior> {
    let bytes = read_bounded(path, MOST_BYTES)?;
    TrainedBehavior::from_bytes(&bytes).with_context(|| path.display().to_string())
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
        "\n{views} {:?} views, {:?} look, instances of {LEAST_PX} pixels and more: map50 {map50:.3}, map \
         {map:.3}\n",
        arguments.scenes, arguments.look
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
