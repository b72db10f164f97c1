//! `chaic collect`.

use std::collections::BTreeMap;
use std::fs;
use std::sync::atomic::Ordering;

use anyhow::{Result, bail};
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::store::ClipFolder;
use chaic_vision::coco;
use serde_json::json;

use super::datasets::{clip_config, collect_clips, dataset_split, view_config};
use super::{bars, jobs, opponent, run_perception};
use crate::arguments::{CollectBehaviorArguments, CollectCommand, CollectDetectionArguments};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, json_path, print_error, print_result, quoted_path};

/// Collects training data.
pub fn run(command: &CollectCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        CollectCommand::Detection(arguments) => detection(arguments, format),
        CollectCommand::Behavior(arguments) => behavior(arguments, format),
        CollectCommand::Opponent(arguments) => opponent::collect_windows(arguments, format),
    }
}

fn detection(arguments: &CollectDetectionArguments, format: OutputFormat) -> Result<ExitStatus> {
    let out = &arguments.out;
    if fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
        bail!("{} isn't empty; choose another --out", out.display());
    }
    let stop = interrupt::stop_flag()?;
    let split = dataset_split(arguments.split);
    let config = view_config(arguments.scenes, arguments.appearance);
    let bar = bars::count_bar(u64::from(arguments.views), "views");
    let mut is_complete = true;
    let mut progress = |n: usize| {
        bar.set_position(n as u64);
        is_complete = !stop.load(Ordering::Relaxed);
        is_complete
    };
    let n_views = arguments.views as usize;
    let n_threads = jobs(arguments.jobs);
    let counts = coco::collect(out, split, config, n_views, n_threads, &mut progress);
    bar.finish_and_clear();
    let mut text =
        format!("{:24} {:>7} {:>7} {:>7} {:>7}\n", "class", "< 100", "small", "medium", "large");
    let mut classes = BTreeMap::new();
    for (name, sizes) in counts? {
        text += &format!("{name:24}");
        text += &sizes.map(|n| format!(" {n:7}")).concat();
        text += "\n";
        classes.insert(name.to_string(), sizes.to_vec());
    }
    text += &format!("Images:  {}\n", quoted_path(out));
    let json = json!({
        "images": json_path(out), "complete": is_complete,
        "sizes": ["below_100_px", "small", "medium", "large"], "instances": classes,
    });
    print_result(format, &json, &text)?;
    if !is_complete {
        print_error("stopped; the folder holds a valid data set of fewer views");
        return Ok(ExitStatus::Interrupted);
    }
    Ok(ExitStatus::Success)
}

fn behavior(arguments: &CollectBehaviorArguments, format: OutputFormat) -> Result<ExitStatus> {
    let split = dataset_split(arguments.split);
    let config = clip_config(&arguments.clips);
    let perception = run_perception::perception_by_name(Some(&arguments.clips.perception), None)?;
    let folder = ClipFolder::open(&arguments.out, split, &config, &*perception)?;
    let stop = interrupt::stop_flag()?;
    let clips = collect_clips(&arguments.clips, &*perception, split, Some(&folder), stop)?;
    let Some(clips) = clips.map(|set| set.clips) else {
        print_error("stopped; run the same command again to continue");
        return Ok(ExitStatus::Interrupted);
    };
    let count = |behavior| clips.iter().filter(|c| c.label == behavior && !c.is_mixed).count();
    let n_mixed = clips.iter().filter(|c| c.is_mixed).count();
    let mut text = String::new();
    for behavior in Behavior::ALL {
        text += &format!("{:18} {:6}\n", behavior.name(), count(behavior));
    }
    text += &format!("{:18} {n_mixed:6}\n", "moving, mixed");
    text += &format!("Clips: {}\n", quoted_path(&arguments.out));
    let counts: BTreeMap<&str, usize> =
        Behavior::ALL.into_iter().map(|behavior| (behavior.name(), count(behavior))).collect();
    let json = json!({
        "clips": json_path(&arguments.out), "behaviors": counts, "moving_mixed": n_mixed,
    });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}
