//! `chaic train`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use anyhow::{Context as _, Result};
use chaic_eval::curves::{Curve, draw};
use chaic_files::read_bounded;
use chaic_learn::opponent::train::OpponentTraining;
use chaic_learn::primitive::train::PrimitiveTraining;
use chaic_learn::train::{Cloning, PolicyTraining, Reinforcement};
use chaic_training::{CURVES, Of, Record, Training, TrainingRun, read_rules};
use chaic_vision::behavior::train::BehaviorTraining;
use chaic_vision::train::Trainer;

use super::bars;
use crate::arguments::{TrainArguments, TrainCommand};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// No file of curves is larger, bytes.
const MOST_BYTES: u64 = 1 << 28;
/// The picture of a training's curves.
const CURVES_PICTURE: &str = "curves.svg";

/// What tells how good a policy is.
const EVALUATE_POLICY: &str = "chaic eval --helper mine=policy:FILE";

/// Trains.
pub fn train(command: &TrainCommand) -> Result<Ended> {
    match command {
        TrainCommand::Detector(arguments) => {
            let evaluate = "chaic eval-perception detection --weights FILE";
            train_one::<Trainer>(evaluate, arguments, |rules, steps| {
                rules.steps = steps;
            })
        }
        TrainCommand::Behavior(arguments) => {
            let evaluate = "chaic eval-perception behavior --weights FILE";
            train_one::<BehaviorTraining>(evaluate, arguments, |rules, steps| {
                rules.steps = steps;
            })
        }
        TrainCommand::Opponent(arguments) => train_one::<OpponentTraining>(
            "chaic eval-opponent --weights FILE",
            arguments,
            |rules, steps| {
                rules.steps = steps;
            },
        ),
        TrainCommand::Ppo(arguments) => train_one::<PolicyTraining<Reinforcement>>(
            EVALUATE_POLICY,
            arguments,
            |rules, steps| {
                rules.iterations = steps;
            },
        ),
        TrainCommand::Primitive(arguments) => {
            train_one::<PrimitiveTraining>(EVALUATE_POLICY, arguments, |rules, steps| {
                rules.updates = steps;
            })
        }
        TrainCommand::Clone(arguments) => {
            train_one::<PolicyTraining<Cloning>>(EVALUATE_POLICY, arguments, |rules, steps| {
                rules.iterations = steps;
            })
        }
    }
}

/// Trains; `evaluate`, FILE being the weights, tells how good it is.
fn train_one<T: Training>(
    evaluate: &str,
    arguments: &TrainArguments,
    set_steps: impl FnOnce(&mut T::Rules, u64),
) -> Result<Ended> {
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let out = quoted_path(&arguments.out);
    let how_to_go_on = format!("go on with: chaic train {} --resume --out {out}", T::KIND);
    let bar = bars::plain(0, "steps");
    let mut progress = |done: &str| {
        bar.set_message(done.to_owned());
        if bar.is_hidden() {
            complain(done);
        }
    };
    let Some(mut run) = open::<T>(arguments, set_steps, &mut progress, stop)? else {
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
    say(&format!("Evaluate: {}\n", evaluate.replace("FILE", &weights)))?;
    Ok(Ended::Well)
}

fn open<T: Training>(
    arguments: &TrainArguments,
    set_steps: impl FnOnce(&mut T::Rules, u64),
    progress: &mut dyn FnMut(&str),
    stop: &AtomicBool,
) -> Result<Option<TrainingRun<T>>> {
    if arguments.resume {
        return Ok(TrainingRun::resume(&arguments.out, progress, stop)?);
    }
    let rules = arguments.config.as_deref().map(read_rules::<T>).transpose()?;
    let mut rules = rules.unwrap_or_default();
    if let Some(steps) = arguments.steps {
        set_steps(&mut rules, steps);
    }
    let weights = arguments.weights.as_deref();
    Ok(TrainingRun::begin(&arguments.out, &rules, weights, progress, stop)?)
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
