//! `chaic eval-perception`.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};
use chaic_files::{FileError, write_whole};
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::report::report as behavior_report;
use chaic_vision::coco::{ANNOTATIONS, DETECTIONS, annotate, annotations_json, results};
use chaic_vision::evaluate::{DetectionReport, ENOUGH, LEAST_PX, report};
use chaic_vision::instances::Instance;
use chaic_vision::sights::{read_behavior, read_detector};
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::{LabelledView, Part};
use serde::Serialize;

use super::collect::{play, view_rules};
use super::jobs;
use crate::arguments::{BehaviorArguments, DetectionArguments, EvalPerceptionCommand};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::say;

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
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let clips = play(&arguments.clips, Part::Test, None, stop)?;
    let n_threads = jobs(arguments.clips.jobs);
    let found = clips.and_then(|clips| behavior_report(&trained, &clips, n_threads, stop));
    let Some(found) = found else { return Ok(Ended::Interrupted) };
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

pub(super) fn write_json(path: Option<&Path>, found: &impl Serialize) -> Result<Ended> {
    if let Some(path) = path {
        let json = serde_json::to_string_pretty(found).expect("a report is plain data") + "\n";
        write_whole(path, json.as_bytes())?;
    }
    Ok(Ended::Well)
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
