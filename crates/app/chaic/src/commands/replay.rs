//! `chaic replay`.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use chaic_core::geom::Camera;
use chaic_core::observation::Senses;
use chaic_env::minds::{Helpers, Seeing};
use chaic_eval::EvalError;
use chaic_eval::replay::{self, Masks, ReplayOptions};
use chaic_eval::run::{RunFolder, RunOptions};
use chaic_eval::verify::verify_trace;
use chaic_llm::Language;
use chaic_vision::failures::TOLD_SCORE;
use chaic_vision::sights::{read_detector, weights_of};
use chaic_vision::trained::{Inference, TrainedDetector};

use super::{bars, llm, sight};
use crate::arguments::ReplayArguments;
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, counted, say};

/// Makes a video of a recorded episode.
pub fn run(arguments: &ReplayArguments) -> Result<Ended> {
    let ReplayArguments { run, episode, out, helper, seed, fps, every, masks } = arguments;
    let (folder, options) = RunFolder::read(run)?;
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() }.into());
    }
    let path = replay::find_trace(&folder, episode, helper.as_deref(), *seed)?;
    let (trace, warnings) = folder.read_trace(&path)?;
    for warning in &warnings {
        complain(&format!("warning: {warning}"));
    }
    let seeing = Seeing { sight: sight::recorded(&options) };
    let language = Language::recorded(run, llm::never())?;
    let language = language.map(|language| language.with_sight(Arc::clone(&seeing.sight)));
    let helpers = language.as_ref().map_or(&seeing as &dyn Helpers, |l| l);
    if let Some(difference) = verify_trace(&folder, &options, helpers, &trace, &path)? {
        bail!("the trace was altered, so no video is made: {difference}");
    }
    let key = trace.header.key();
    let episode = folder.episode(&options, &key)?;
    let bar = bars::plain(trace.end().map_or(0, |e| u64::from(e.frame)), "frames");
    let video = ReplayOptions { fps: *fps, every: *every };
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let mut progress = |frame| {
        bar.set_position(u64::from(frame));
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let mut detector = masks.then(|| detector_of(&options)).transpose()?.map(DetectedMasks::new);
    let masks = detector.as_mut().map(|detector| detector as &mut dyn Masks);
    let pictures = replay::write(&trace, &episode, video, masks, out, &mut progress);
    bar.finish_and_clear();
    let Some(pictures) = pictures? else {
        complain(&format!("stopped; {} is not written", out.display()));
        return Ok(Ended::Interrupted);
    };
    say(&format!(
        "{}: {} of {} with {}\n",
        out.display(),
        counted(pictures as usize, "picture"),
        key.episode,
        key.helper
    ))?;
    // The video of a cut-off trace shows only the part that is left.
    Ok(if warnings.is_empty() { Ended::Well } else { Ended::WithFindings })
}

/// The detector by which the run's helpers saw, if it is known and still there.
fn detector_of(options: &RunOptions) -> Result<TrainedDetector> {
    match options.perception.as_deref().and_then(weights_of) {
        Some(file) => Ok(read_detector(file)?),
        None => Ok(TrainedDetector::built_in()),
    }
}

/// What a detector finds.
struct DetectedMasks {
    detector: TrainedDetector,
    inference: Inference,
}

impl DetectedMasks {
    fn new(detector: TrainedDetector) -> DetectedMasks {
        let inference = detector.inference();
        DetectedMasks { detector, inference }
    }
}

impl Masks for DetectedMasks {
    fn find(&mut self, rgb: &[u8], depth_m: &[f32], camera: &Camera) -> Vec<(u8, Vec<u32>)> {
        let found = self.detector.detect((rgb, depth_m, camera), &mut self.inference);
        let told = found.into_iter().filter(|instance| instance.score >= TOLD_SCORE);
        told.map(|instance| (instance.label, instance.pixels)).collect()
    }

    fn image_size(&self) -> u32 {
        Senses::IMAGE_SIZE
    }
}
