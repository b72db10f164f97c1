//! `chaic train` and `chaic eval-perception`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

use anyhow::{Context as _, Result};
use chaic_eval::curves::{Curve, draw};
use chaic_files::{FileError, read_bounded, write_whole};
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::report::report as behavior_report;
use chaic_vision::behavior::train::BehaviorTraining;
use chaic_vision::coco::{ANNOTATIONS, DETECTIONS, annotate, annotations_json, results};
use chaic_vision::evaluate::{DetectionReport, ENOUGH, LEAST_PX, report};
use chaic_vision::instances::Instance;
use chaic_vision::train::Trainer;
use chaic_vision::trained::TrainedDetector;
use chaic_vision::training_run::{CURVES, Of, Record, Training, TrainingRun, read_rules};
use chaic_vision::views::{LabelledView, Part};
use serde::Serialize;

use super::collect::{play, view_rules};
use super::{bars, jobs};
use crate::arguments::{
    BehaviorArguments, DetectionArguments, EvalPerceptionCommand, TrainArguments, TrainCommand,
};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// No weights are larger, bytes.
const MOST_BYTES: u64 = 1 << 28;
/// The picture of a training's curves.
const CURVES_PICTURE: &str = "curves.svg";

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
    let out = quoted_path(&arguments.out);
    let how_to_go_on = format!("go on with: chaic train {name} --resume --out {out}");
    let bar = bars::plain(0, "steps");
    let mut go_on = |done: &str| {
        bar.set_message(done.to_owned());
        if bar.is_hidden() {
            complain(done);
        }
        !stop.load(Ordering::Relaxed)
    };
    let Some(mut run) = open::<T>(arguments, set_steps, &mut go_on)? else {
        complain(&format!("stopped before the first step; {how_to_go_on}"));
        return Ok(Ended::Interrupted);
    };
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
                // The figures are in the curves' file; a picture of them is no more than that.
                if let Err(e) = draw_curves(&arguments.out) {
                    complain(&format!("{e:#}"));
                }
            }),
        }
    });
    bar.finish_and_clear();
    if !is_whole? {
        let (done, steps) = run.extent();
        complain(&format!("stopped after {done} of {steps} steps; {how_to_go_on}"));
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
    go_on: &mut dyn FnMut(&str) -> bool,
) -> Result<Option<TrainingRun<T>>> {
    if arguments.resume {
        return Ok(TrainingRun::resume(&arguments.out, go_on)?);
    }
    let rules = arguments.config.as_deref().map(read_rules::<T>).transpose()?;
    let mut rules = rules.unwrap_or_default();
    if let Some(steps) = arguments.steps {
        set_steps(&mut rules, steps);
    }
    let mut run = TrainingRun::begin(&arguments.out, &rules, go_on)?;
    if let (Some(run), Some(weights)) = (&mut run, &arguments.weights) {
        run.begin_with(weights)?;
    }
    Ok(run)
}

/// Draws the curves of a training into its folder.
fn draw_curves(folder: &Path) -> Result<()> {
    let text = String::from_utf8(read_bounded(&folder.join(CURVES), MOST_BYTES)?)?;
    let mut curves: BTreeMap<(Of, String), Vec<(f64, f64)>> = BTreeMap::new();
    for record in text.lines().filter_map(|line| serde_json::from_str::<Record>(line).ok()) {
        for (name, y) in record.figures {
            curves.entry((record.of, name)).or_default().push((record.step as f64, y));
        }
    }
    let curves: Vec<Curve> = curves
        .into_iter()
        .map(|((of, name), points)| {
            let of = if of == Of::Loss { "learned from" } else { "validation" };
            Curve { title: format!("{name}, {of}"), points }
        })
        .collect();
    Ok(draw(&curves, "steps", &folder.join(CURVES_PICTURE))?)
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
    let views = (Part::Test, view_rules(arguments.scenes, Some(arguments.look)));
    let also = |k: usize, view: &LabelledView, found: &[Instance]| {
        let wanted = arguments.coco.is_some();
        wanted.then(|| (annotate(k, view), results(k, view, found)))
    };
    let n_views = arguments.views as usize;
    let (found, files) = report(&detector, views, n_views, jobs(arguments.jobs), also);
    say(&text(&found, arguments))?;
    if let Some(folder) = &arguments.coco {
        let (annotated, results): (Vec<_>, Vec<_>) = files.into_iter().flatten().unzip();
        fs::create_dir_all(folder).map_err(FileError::of("make", folder))?;
        let of = format!("{:?} views of chaic, {:?} look", arguments.scenes, arguments.look);
        write_whole(&folder.join(ANNOTATIONS), &annotations_json(&annotated, &of))?;
        let results = serde_json::to_vec(&results.concat()).expect("plain data");
        write_whole(&folder.join(DETECTIONS), &results)?;
    }
    write_json(arguments.faults.as_deref(), &found.fault_rates)?;
    write_json(arguments.json.as_deref(), &found)
}

fn evaluate_behavior(arguments: &BehaviorArguments) -> Result<Ended> {
    let trained = match &arguments.weights {
        Some(path) => read_behavior(path)?,
        None => TrainedBehavior::built_in(),
    };
    let Some(clips) = play(&arguments.clips, Part::Test, None)? else {
        return Ok(Ended::Interrupted);
    };
    let found = behavior_report(&trained, &clips, jobs(arguments.clips.jobs));
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
        arguments.clips.perception,
        arguments.clips.look,
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
    let DetectionReport {
        views,
        map50,
        map,
        smaller,
        sizes,
        map50_of_frequent,
        calibration_error,
        failures,
        ..
    } = found;
    text += &format!(
        "\n{views} {:?} views, {:?} look, instances of {LEAST_PX} pixels and more: map50 {map50:.3}, map \
         {map:.3}\n",
        arguments.scenes, arguments.look
    );
    for (px, [map50, map]) in smaller {
        text += &format!("with those of {px} and more: map50 {map50:.3}, map {map:.3}\n");
    }
    for (size, [map50, map]) in sizes {
        text += &format!("of {size} instances: map50 {map50:.3}, map {map:.3}\n");
    }
    let (of_frequent, n_frequent) = map50_of_frequent;
    text += &format!(
        "over the {n_frequent} classes of {ENOUGH} instances and more: map50 {of_frequent:.3}\n\
         calibration error of scores: {calibration_error:.3}\n"
    );
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
