//! `chaic collect opponent` and `chaic eval opponent`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result};
use chaic_eval::EvalError;
use chaic_files::read_user_file;
use chaic_learn::opponent::OpponentGoal;
use chaic_learn::opponent::collect::{
    DatasetSplit, LabeledWindow, WindowCollectionConfig, collect, write,
};
use chaic_learn::opponent::network::OpponentModel;
use chaic_learn::opponent::report::OpponentReport;
use chaic_learn::policy_kind::PolicyWeights;
use chaic_learn::visual::helper::VisualWeights;
use serde_json::json;

use super::datasets::dataset_split;
use super::output_path::check_output_file;
use super::{bars, stopped_without_result, write_json};
use crate::arguments::{CollectOpponentArguments, OpponentArguments, WindowArguments};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, json_path, print_progress, print_result, quoted_path};

/// Maximum size of a weights file, bytes.
const MAX_BYTES: u64 = 1 << 28;

/// Collects windows and writes them to a file.
pub fn collect_windows(
    arguments: &CollectOpponentArguments,
    format: OutputFormat,
) -> Result<ExitStatus> {
    check_output_file(Some(&arguments.out))?;
    let stop = interrupt::stop_flag()?;
    let split = dataset_split(arguments.split);
    let config = collection(&arguments.windows);
    let Some(windows) = play(&config, split, stop)? else { return Ok(stopped_without_result()) };
    write(&arguments.out, &windows, arguments.windows.grant_behavior)?;
    let mut text = String::new();
    let mut counts = BTreeMap::new();
    for goal in OpponentGoal::ALL {
        let n = windows.iter().filter(|window| window.goal == goal).count();
        text += &format!("{:8} {n:6}\n", goal.name());
        counts.insert(goal.name(), n);
    }
    text += &format!("Windows: {}\n", quoted_path(&arguments.out));
    let json = json!({ "windows": json_path(&arguments.out), "goals": counts });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Evaluates an opponent model on held-out episodes.
pub fn evaluate(arguments: &OpponentArguments, format: OutputFormat) -> Result<ExitStatus> {
    check_output_file(arguments.json.as_deref())?;
    let model = read_model(&arguments.weights)?;
    let stop = interrupt::stop_flag()?;
    let mut config = collection(&arguments.windows);
    if config.granted && !model.is_granted() {
        return Err(EvalError::Options(format!(
            "--grant-behavior: {} was trained without the partner's actions; leave the option out",
            quoted_path(&arguments.weights)
        ))
        .into());
    }
    config.granted = model.is_granted();
    let windows = play(&config, DatasetSplit::Test, stop)?;
    let report = windows.and_then(|windows| OpponentReport::new(&model, &windows, stop));
    let Some(report) = report else { return Ok(stopped_without_result()) };
    print_result(format, &report, &report.text())?;
    write_json(arguments.json.as_deref(), &report)?;
    Ok(ExitStatus::Success)
}

/// Reads an opponent model from its own weights file, or from the weights file of a policy that
/// includes one.
fn read_model(path: &Path) -> Result<Arc<OpponentModel>> {
    let bytes = read_user_file(path, MAX_BYTES)?;
    let of_policy = || PolicyWeights::from_bytes(&bytes).ok()?.opponent;
    let of_visual_policy = || VisualWeights::from_bytes(&bytes).ok()?.opponent;
    match of_policy().or_else(of_visual_policy) {
        Some(model) => Ok(model),
        None => Ok(Arc::new(
            OpponentModel::from_bytes(&bytes).with_context(|| path.display().to_string())?,
        )),
    }
}

/// Returns the collection that these options describe.
fn collection(arguments: &WindowArguments) -> WindowCollectionConfig {
    WindowCollectionConfig {
        max_per_class: arguments.max_per_class as usize,
        episodes: arguments.n_episodes as usize,
        image_size: arguments.size,
        perception: arguments.perception.clone(),
        behavior: arguments.behavior.clone(),
        granted: arguments.grant_behavior,
        ..WindowCollectionConfig::default()
    }
}

/// Plays episodes of a part of the data and returns their windows; `None` if it was stopped.
fn play(
    config: &WindowCollectionConfig,
    split: DatasetSplit,
    stop: &AtomicBool,
) -> Result<Option<Vec<LabeledWindow>>> {
    config.check().and_then(|()| config.check_memory()).map_err(EvalError::Options)?;
    let bar = bars::count_bar(config.episodes as u64, "episodes");
    let mut progress = |message: &str| {
        bar.set_message(message.to_owned());
        if bar.is_hidden() {
            print_progress(message);
        }
    };
    let windows = collect(split, config, &mut progress, stop);
    bar.finish_and_clear();
    Ok(windows?)
}
