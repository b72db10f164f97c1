//! `chaic train`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use anyhow::Result;
use chaic_eval::curves::{Curve, draw};
use chaic_files::read_bounded;
use chaic_learn::opponent::train::OpponentTrainer;
use chaic_learn::partner::train::PartnerCloningTrainer;
use chaic_learn::train::{CloningConfig, PolicyTrainer, PpoTrainingConfig};
use chaic_learn::visual::train::VisualTrainer;
use chaic_training::{CURVES, CurveRecord, Phase, Trainer, TrainingRun, read_config_with};
use chaic_vision::behavior::train::BehaviorTrainer;
use chaic_vision::train::DetectorLearner;
use serde_json::json;

use super::bars;
use crate::arguments::{TrainArguments, TrainCommand};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{
    OutputFormat, counted, json_path, print_error, print_progress, print_result, quoted_path,
};

/// Largest size of a curves file, bytes.
const MAX_BYTES: u64 = 1 << 28;
/// File name of the figure of a training's curves.
const CURVES_FIGURE: &str = "curves.svg";

/// Trains a network.
pub fn run(command: &TrainCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        TrainCommand::Detection(arguments) => {
            let names = CommandNames::for_network("detection");
            train::<DetectorLearner>(&names, arguments, format, |config, n| config.steps = n)
        }
        TrainCommand::Behavior(arguments) => {
            let names = CommandNames::for_network("behavior");
            train::<BehaviorTrainer>(&names, arguments, format, |config, n| config.steps = n)
        }
        TrainCommand::Opponent(arguments) => {
            let names = CommandNames::for_network("opponent");
            train::<OpponentTrainer>(&names, arguments, format, |config, n| config.steps = n)
        }
        TrainCommand::Ppo(arguments) => {
            let names = CommandNames::for_policy("ppo");
            train::<PolicyTrainer<PpoTrainingConfig>>(&names, arguments, format, |config, n| {
                config.iterations = n;
            })
        }
        TrainCommand::Clone(arguments) => {
            let names = CommandNames::for_policy("clone");
            train::<PolicyTrainer<CloningConfig>>(&names, arguments, format, |config, n| {
                config.iterations = n;
            })
        }
        TrainCommand::Partner(arguments) => {
            let evaluate = "chaic eval --partner policy:FILE".to_owned();
            let names = CommandNames { train: "partner", evaluate };
            train::<PartnerCloningTrainer>(&names, arguments, format, |config, n| {
                config.iterations = n;
            })
        }
        TrainCommand::Visual(arguments) => {
            let names = CommandNames::for_policy("visual");
            train::<VisualTrainer>(&names, arguments, format, |config, n| config.n_updates = n)
        }
    }
}

/// Commands that a training names in its output.
struct CommandNames {
    /// Name of the subcommand of `chaic train`.
    train: &'static str,
    /// Command that evaluates the weights; FILE stands for their path.
    evaluate: String,
}

impl CommandNames {
    fn for_network(name: &'static str) -> CommandNames {
        CommandNames { train: name, evaluate: format!("chaic eval {name} --weights FILE") }
    }

    fn for_policy(name: &'static str) -> CommandNames {
        let evaluate = "chaic eval --helper mine=policy:FILE".to_owned();
        CommandNames { train: name, evaluate }
    }
}

/// Runs a training.
fn train<T: Trainer>(
    names: &CommandNames,
    arguments: &TrainArguments,
    format: OutputFormat,
    set_steps: impl FnOnce(&mut T::Config, u64),
) -> Result<ExitStatus> {
    let stop = interrupt::stop_flag()?;
    let out = quoted_path(&arguments.out);
    let how_to_resume = format!("continue with: chaic train {} --resume --out {out}", names.train);
    let bar = bars::count_bar(0, "steps");
    let mut progress = |message: &str| {
        bar.set_message(message.to_owned());
        if bar.is_hidden() {
            print_progress(message);
        }
    };
    let Some(mut run) = open::<T>(arguments, set_steps, &mut progress, stop)? else {
        print_error(&format!("stopped before the first step; {how_to_resume}"));
        return Ok(ExitStatus::Interrupted);
    };
    let (done, steps) = run.progress();
    bar.set_length(steps);
    bar.set_position(done);
    let start = Instant::now();
    let mut is_plotted = true;
    let is_finished = run.run(stop, &mut |record| {
        let metrics: Vec<String> =
            record.metrics.iter().map(|(name, x)| format!("{name} {x:.3}")).collect();
        let metrics = metrics.join(", ");
        match record.phase {
            Phase::Train => {
                bar.set_position(record.step);
                bar.set_message(metrics);
            }
            Phase::Validation => bar.suspend(|| {
                let s = start.elapsed().as_secs();
                print_progress(&format!("step {}, {s} s: {metrics}", record.step));
                // A failed plot does not stop the training, because the curves file has all
                // metrics. The next validation or the end of the training draws it again.
                let plot = draw_curves(&arguments.out);
                is_plotted = plot.is_ok();
                if let Err(e) = plot {
                    print_error(&format!("{e:#}"));
                }
            }),
        }
    });
    bar.finish_and_clear();
    if !is_finished? {
        let (done, steps) = run.progress();
        let steps = counted(steps as usize, "step");
        print_error(&format!("stopped after {done} of {steps}; {how_to_resume}"));
        return Ok(ExitStatus::Interrupted);
    }
    if !is_plotted {
        draw_curves(&arguments.out)?;
    }
    let weights = arguments.out.join(T::WEIGHTS);
    let evaluate = names.evaluate.replace("FILE", &quoted_path(&weights));
    let text = format!("Weights:  {}\nEvaluate: {evaluate}\n", quoted_path(&weights));
    let json = json!({ "weights": json_path(&weights), "evaluate": evaluate });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Starts or resumes a training; `None` if it was stopped before the first step.
fn open<T: Trainer>(
    arguments: &TrainArguments,
    set_steps: impl FnOnce(&mut T::Config, u64),
    progress: &mut dyn FnMut(&str),
    stop: &AtomicBool,
) -> Result<Option<TrainingRun<T>>> {
    if arguments.resume {
        return Ok(TrainingRun::resume(&arguments.out, progress, stop)?);
    }
    let mut config = read_config_with::<T>(arguments.config.as_deref(), &arguments.set)?;
    if let Some(steps) = arguments.steps {
        set_steps(&mut config, steps);
    }
    let weights = arguments.weights.as_deref();
    Ok(TrainingRun::start(&arguments.out, &config, weights, progress, stop)?)
}

/// Plots the learning curves of a training into its folder.
fn draw_curves(folder: &Path) -> Result<()> {
    let text = String::from_utf8(read_bounded(&folder.join(CURVES), MAX_BYTES)?)?;
    let mut curves: BTreeMap<(Phase, String), Vec<(f64, f64)>> = BTreeMap::new();
    for record in text.lines().filter_map(|line| serde_json::from_str::<CurveRecord>(line).ok()) {
        for (name, y) in record.metrics {
            curves.entry((record.phase, name)).or_default().push((record.step as f64, y));
        }
    }
    let curves: Vec<Curve> = curves
        .into_iter()
        .map(|((phase, name), points)| {
            let phase = if phase == Phase::Train { "training" } else { "validation" };
            Curve { title: format!("{name}, {phase}"), points }
        })
        .collect();
    Ok(draw(&curves, "steps", &folder.join(CURVES_FIGURE))?)
}
