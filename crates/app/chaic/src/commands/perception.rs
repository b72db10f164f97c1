//! `chaic eval detection`, `chaic eval behavior` and `chaic eval tracks`.

use std::path::PathBuf;

use anyhow::Result;
use chaic_episodes::DatasetSplit;
use chaic_files::{create_folders, write_atomically};
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::report::{BehaviorReport, report as behavior_report};
use chaic_vision::behavior::store::ClipFolder;
use chaic_vision::coco::{ANNOTATIONS, DETECTIONS, annotate, annotations_json, results};
use chaic_vision::evaluate::{DetectionReport, MIN_AREA_PX, MIN_FREQUENT_INSTANCES, report};
use chaic_vision::instances::Instance;
use chaic_vision::perception_registry::{read_behavior, read_detector};
use chaic_vision::track_evaluation::{self, EpisodeFailure, RateEstimate, TrackReport};
use chaic_vision::trained::TrainedDetector;
use chaic_vision::views::LabeledView;
use clap::ValueEnum;

use super::datasets::{clip_config, collect_clips, view_config};
use super::output_path::{check_output_file, check_output_folder};
use super::{bars, jobs, run_perception, stopped_without_result, write_json};
use crate::arguments::{BehaviorArguments, ClipArguments, DetectionArguments, TracksArguments};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, counted, print_progress, print_result, print_warning};

/// Evaluates a detector on held-out environments.
pub fn evaluate_detection(
    arguments: &DetectionArguments,
    format: OutputFormat,
) -> Result<ExitStatus> {
    check_output_file(arguments.json.as_deref())?;
    check_output_file(arguments.error_rates.as_deref())?;
    check_output_folder(arguments.coco.as_deref())?;
    let detector = match &arguments.weights {
        Some(path) => read_detector(path)?,
        None => TrainedDetector::built_in(),
    };
    if detector.second_stage.is_none() {
        print_warning("the detector has its first stage only; helpers need both stages");
    }
    let DetectionArguments { scenes, appearance, .. } = arguments;
    let config = view_config(*scenes, Some(*appearance));
    let stop = interrupt::stop_flag()?;
    let n_views = arguments.views as usize;
    print_progress(&counted(n_views, "view"));
    let bar = bars::count_bar(n_views as u64, "views");
    let coco_records = |k: usize, view: &LabeledView, found: &[Instance]| {
        bar.inc(1);
        let is_wanted = arguments.coco.is_some();
        is_wanted.then(|| (annotate(k, view), results(k, view, found)))
    };
    let n_threads = jobs(arguments.jobs);
    let split = DatasetSplit::Test;
    let evaluated = report(&detector, split, config, n_views, n_threads, coco_records, stop);
    bar.finish_and_clear();
    let Some((report, records)) = evaluated else { return Ok(stopped_without_result()) };
    print_result(format, &report, &detection_text(&report, arguments))?;
    if let Some(folder) = &arguments.coco {
        let (annotations, results): (Vec<_>, Vec<_>) = records.into_iter().flatten().unzip();
        create_folders(folder)?;
        let (scenes, appearance) = (option_name(scenes), option_name(appearance));
        let description = format!("{scenes} views of chaic, {appearance} look");
        write_atomically(&folder.join(ANNOTATIONS), &annotations_json(&annotations, &description))?;
        let results = serde_json::to_vec(&results.concat()).expect("detections serialize");
        write_atomically(&folder.join(DETECTIONS), &results)?;
    }
    write_json(arguments.error_rates.as_deref(), &report.noise_model)?;
    write_json(arguments.json.as_deref(), &report)?;
    Ok(ExitStatus::Success)
}

/// Evaluates a behavior network on clips of held-out episodes.
pub fn evaluate_behavior(
    arguments: &BehaviorArguments,
    format: OutputFormat,
) -> Result<ExitStatus> {
    check_output_file(arguments.json.as_deref())?;
    let network = match &arguments.weights {
        Some(path) => read_behavior(path)?,
        None => TrainedBehavior::built_in(),
    };
    let stop = interrupt::stop_flag()?;
    let perception = run_perception::perception_by_name(Some(&arguments.clips.perception), None)?;
    let split = DatasetSplit::Test;
    let open = |path: &PathBuf| {
        ClipFolder::open(path, split, &clip_config(&arguments.clips), &*perception)
    };
    let folder = arguments.clip_folder.as_ref().map(open).transpose()?;
    let clips = collect_clips(&arguments.clips, &*perception, split, folder.as_ref(), stop)?;
    let n_threads = jobs(arguments.clips.jobs);
    let report = clips.and_then(|clips| behavior_report(&network, &clips, n_threads, stop));
    let Some(report) = report else { return Ok(stopped_without_result()) };
    print_result(format, &report, &behavior_text(&report, &arguments.clips))?;
    write_json(arguments.json.as_deref(), &report)?;
    Ok(ExitStatus::Success)
}

/// Evaluates the tracks of a perception over whole held-out episodes.
pub fn evaluate_tracks(arguments: &TracksArguments, format: OutputFormat) -> Result<ExitStatus> {
    check_output_file(arguments.json.as_deref())?;
    let perception = run_perception::perception_by_name(Some(&arguments.perception), None)?;
    let stop = interrupt::stop_flag()?;
    let bar = bars::count_bar(u64::from(arguments.n_episodes), "episodes");
    let (n_episodes, n_threads) = (arguments.n_episodes as usize, jobs(arguments.jobs));
    let progress = || bar.inc(1);
    let split = DatasetSplit::Test;
    let report = track_evaluation::evaluate_tracks(
        perception.as_ref(),
        split,
        n_episodes,
        n_threads,
        &progress,
        stop,
    );
    bar.finish_and_clear();
    let Some(report) = report else { return Ok(stopped_without_result()) };
    print_result(format, &report, &tracks_text(&report, &arguments.perception))?;
    write_json(arguments.json.as_deref(), &report)?;
    if let Some(EpisodeFailure { episode, problem }) = report.failures.first() {
        let left_out = counted(report.failures.len(), "episode");
        print_warning(&format!(
            "the report leaves out {left_out} that broke down, first {episode}: {problem}"
        ));
    }
    Ok(ExitStatus::from_findings(!report.failures.is_empty()))
}

/// Formats a value; `/` if it is undefined.
fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "/".to_owned(), |x| format!("{x:.3}"))
}

/// Returns the value of an option as on the command line.
fn option_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

fn tracks_text(report: &TrackReport, perception: &str) -> String {
    let rate =
        |r: &RateEstimate| format!("{} +- {} of {}", number(r.value), number(r.interval), r.n);
    let mut text = format!(
        "{}, {}, {perception} perception\n\
         precision of detections     {}\n\
         recall of visible objects   {}\n",
        counted(report.episodes, "episode"),
        counted(report.images, "image"),
        rate(&report.detection_precision),
        rate(&report.detection_recall)
    );
    for (m, recall) in &report.detection_recall_by_m {
        text += &format!("  up to {m:2} m                {}\n", rate(recall));
    }
    for (title, all, by_m) in [
        ("precision of memory   ", &report.memory_precision, &report.memory_precision_by_m),
        ("recall of seen objects", &report.memory_recall, &report.memory_recall_by_m),
    ] {
        text += &format!("{title}      {}\n", rate(all));
        for (m, rate_at_m) in by_m {
            text += &format!("  nearest sight up to {m:2} m  {}\n", rate(rate_at_m));
        }
    }
    text + &format!(
        "identity switches per object {}\n\
         precision of people         {}\n\
         recall of visible people    {}\n\
         calibration error of confidences {}\n",
        rate(&report.identity_switches),
        rate(&report.person_precision),
        rate(&report.person_recall),
        number(report.calibration_error)
    )
}

/// Formats the confusion matrix, one row per label, and the scores.
fn behavior_text(report: &BehaviorReport, clips: &ClipArguments) -> String {
    let mut text = format!("{:18}", "");
    for predicted in Behavior::ALL {
        text += &format!(" {:>17}", predicted.name());
    }
    for label in Behavior::ALL {
        let Some(row) = report.confusion.get(label.name()) else { continue };
        text += &format!("\n{:18}", label.name());
        for predicted in Behavior::ALL {
            text += &format!(" {:17}", row.get(predicted.name()).copied().unwrap_or(0));
        }
    }
    text + &format!(
        "\n\n{} of {} with {} perception, {} appearance; columns are predictions\n\
         top1 {} +- {}; mean of classes {}\n\
         with the frequencies in play: top1 {}; calibration error {}\n\
         mixed clips predicted as moving: {}\n",
        counted(report.clips, "clip"),
        counted(report.episodes, "episode"),
        clips.perception,
        option_name(&clips.appearance),
        number(report.top1),
        number(report.interval),
        number(report.balanced),
        number(report.top1_in_play),
        number(report.calibration_error),
        number(report.mixed_as_moving)
    )
}

/// Formats average precision by class and size, and the failures.
fn detection_text(report: &DetectionReport, arguments: &DetectionArguments) -> String {
    let mut text = format!("{:24} {:>6} {:>6} {:>9}\n", "class", "AP50", "AP", "instances");
    for (name, (ap50, ap, n)) in &report.classes {
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
        errors,
        ..
    } = report;
    let means = |map50: &Option<f64>, map: &Option<f64>| {
        format!("map50 {}, map {}", number(*map50), number(*map))
    };
    text += &format!(
        "\n{}, {} appearance, instances of at least {MIN_AREA_PX} pixels: {}\n",
        counted(*views, &format!("{} view", option_name(&arguments.scenes))),
        option_name(&arguments.appearance),
        means(map50, map)
    );
    for (px, [map50, map]) in smaller {
        text += &format!("instances of at least {px} pixels: {}\n", means(map50, map));
    }
    for (size, [map50, map]) in sizes {
        text += &format!("{size} instances: {}\n", means(map50, map));
    }
    let (of_frequent, n_frequent) = map50_of_frequent;
    let classes = if *n_frequent == 1 { "class" } else { "classes" };
    text += &format!(
        "{n_frequent} {classes} with at least {MIN_FREQUENT_INSTANCES} instances: map50 {}\n\
         calibration error of scores: {}\n",
        number(*of_frequent),
        number(*calibration_error)
    );
    text += &format!(
        "at score 0.5: found {}, poor mask {}, wrong class {}, merged {}, missed {}; false \
         detections: pieces {}, nothing there {}\n",
        errors.detected,
        errors.poor_mask,
        errors.wrong_class,
        errors.merged,
        errors.missed,
        errors.duplicate,
        errors.background
    );
    text
}
