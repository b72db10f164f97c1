//! `chaic collect opponent` and `chaic eval-opponent`.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result};
use chaic_files::read_user_file;
use chaic_learn::opponent::Goal;
use chaic_learn::opponent::collect::{CollectRules, Part, Sample, collect, write};
use chaic_learn::opponent::network::OpponentModel;
use chaic_learn::opponent::report::Report;

use super::bars;
use super::collect::part;
use super::perception::write_json;
use crate::arguments::{CollectOpponentArguments, OpponentArguments, WindowArguments};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// No file of weights is larger, bytes.
const MOST_BYTES: u64 = 1 << 28;

/// Writes windows into a file.
pub fn collect_windows(arguments: &CollectOpponentArguments) -> Result<Ended> {
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let Some(samples) = play(&arguments.windows, part(arguments.of), stop)? else {
        return Ok(Ended::Interrupted);
    };
    write(&arguments.out, &samples)?;
    for goal in Goal::ALL {
        let n = samples.iter().filter(|s| s.goal == goal).count();
        say(&format!("{:8} {n:6}\n", goal.name()))?;
    }
    say(&format!("Windows: {}\n", quoted_path(&arguments.out)))?;
    Ok(Ended::Well)
}

/// Tells how good an opponent model is on episodes that nothing was learned from.
pub fn evaluate(arguments: &OpponentArguments) -> Result<Ended> {
    let model = read_model(&arguments.weights)?;
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let samples = play(&arguments.windows, Part::Test, stop)?;
    let report = samples.and_then(|samples| Report::of(&model, &samples, stop));
    let Some(report) = report else { return Ok(Ended::Interrupted) };
    say(&report.text())?;
    write_json(arguments.json.as_deref(), &report)
}

fn read_model(path: &Path) -> Result<OpponentModel> {
    let bytes = read_user_file(path, MOST_BYTES)?;
    OpponentModel::from_bytes(&bytes).with_context(|| path.display().to_string())
}

/// Windows of episodes of this part; `None` if it was stopped.
fn play(arguments: &WindowArguments, part: Part, stop: &AtomicBool) -> Result<Option<Vec<Sample>>> {
    let rules = CollectRules {
        of_each: arguments.of_each as usize,
        episodes: arguments.episodes as usize,
        image_size: arguments.image_size,
        perception: arguments.perception.clone(),
        behavior: arguments.behavior.clone(),
        granted: arguments.granted,
        ..CollectRules::default()
    };
    let bar = bars::plain(u64::from(arguments.episodes), "episodes");
    let mut progress = |done: &str| {
        bar.set_message(done.to_owned());
        if bar.is_hidden() {
            complain(done);
        }
    };
    let samples = collect(part, &rules, &mut progress, stop);
    bar.finish_and_clear();
    let samples = samples?;
    if samples.is_none() {
        complain("stopped; nothing was written");
    }
    Ok(samples)
}
