//! `chaic replay`.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use anyhow::Result;
use chaic_core::geom::Camera;
use chaic_core::observation::SensorConfig;
use chaic_eval::replay::{self, MaskDetector, ReplayOptions};
use chaic_eval::run::RunOptions;
use chaic_vision::error_breakdown::REPORT_SCORE;
use chaic_vision::perception_registry::{read_detector, weights_of};
use chaic_vision::trained::{DetectorInference, TrainedDetector};
use serde_json::json;

use super::bars;
use super::recorded::{RecordedEpisode, read_recorded};
use crate::arguments::ReplayArguments;
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, counted, json_path, print_error, print_result};

/// Makes a video of a recorded episode.
pub fn run(arguments: &ReplayArguments, format: OutputFormat) -> Result<ExitStatus> {
    let ReplayArguments { run, episode, out, helper, seed, fps, every, masks } = arguments;
    let RecordedEpisode { options, trace, episode, is_whole } = read_recorded(
        run,
        |folder, traces| replay::find_trace(folder, traces, episode, helper.as_deref(), *seed),
        "no video is made",
    )?;
    let key = trace.header.key();
    let bar = bars::count_bar(trace.end().map_or(0, |e| u64::from(e.frame)), "frames");
    let video = ReplayOptions { fps: *fps, every: *every };
    let stop = interrupt::stop_flag()?;
    let mut progress = |frame| {
        bar.set_position(u64::from(frame));
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let mut detector = masks.then(|| detector_of(&options)).transpose()?.map(DetectedMasks::new);
    let masks = detector.as_mut().map(|detector| detector as &mut dyn MaskDetector);
    let images = replay::write(&trace, &episode, video, masks, out, &mut progress);
    bar.finish_and_clear();
    let Some(images) = images? else {
        print_error(&format!("stopped; {} is not written", out.display()));
        return Ok(ExitStatus::Interrupted);
    };
    let n = counted(images as usize, "image");
    let text = format!("{}: {n} of {} with {}\n", out.display(), key.episode, key.helper);
    let json = json!({
        "out": json_path(out), "images": images, "episode": key.episode, "helper": key.helper,
        "seed": key.seed, "complete": is_whole,
    });
    print_result(format, &json, &text)?;
    // The video of a cut-off trace shows only the recorded part.
    Ok(ExitStatus::from_findings(!is_whole))
}

/// Returns the detector of the run's helpers if its weights file still exists, else the built-in
/// detector.
fn detector_of(options: &RunOptions) -> Result<TrainedDetector> {
    match options.perception.as_deref().and_then(weights_of) {
        Some(file) => Ok(read_detector(file)?),
        None => Ok(TrainedDetector::built_in()),
    }
}

/// A detector that finds masks in views.
struct DetectedMasks {
    detector: TrainedDetector,
    inference: DetectorInference,
}

impl DetectedMasks {
    fn new(detector: TrainedDetector) -> DetectedMasks {
        let inference = detector.inference();
        DetectedMasks { detector, inference }
    }
}

impl MaskDetector for DetectedMasks {
    fn find(&mut self, rgb: &[u8], depth_m: &[f32], camera: &Camera) -> Vec<(u8, Vec<u32>)> {
        let found = self.detector.detect(rgb, depth_m, camera, &mut self.inference);
        let reported = found.into_iter().filter(|instance| instance.score() >= REPORT_SCORE);
        reported.map(|instance| (instance.label(), instance.pixels)).collect()
    }

    fn image_size(&self) -> u32 {
        SensorConfig::IMAGE_SIZE
    }
}
