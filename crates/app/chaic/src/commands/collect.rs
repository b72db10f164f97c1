//! `chaic collect`: what networks learn from, as files.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result, bail};
use chaic_vision::behavior::Behavior;
use chaic_vision::behavior::clip::Clip;
use chaic_vision::behavior::collect::{CollectRules, Collector, collect as collect_clips};
use chaic_vision::behavior::store::ClipFolder;
use chaic_vision::coco;
use chaic_vision::views::{Part, ViewRules};

use super::{bars, jobs};
use crate::arguments::{
    ClipArguments, CollectBehaviorArguments, CollectCommand, CollectDetectionArguments, Look, Of,
    Scenes,
};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// Collects.
pub fn collect(command: &CollectCommand) -> Result<Ended> {
    match command {
        CollectCommand::Detection(arguments) => detection(arguments),
        CollectCommand::Behavior(arguments) => behavior(arguments),
        CollectCommand::Opponent(arguments) => super::opponent::collect_windows(arguments),
    }
}

/// The part of all environments that is meant.
pub(super) fn part(of: Of) -> Part {
    match of {
        Of::Training => Part::Training,
        Of::Validation => Part::Validation,
    }
}

/// How views of these places are drawn.
pub(super) fn view_rules(scenes: Scenes, look: Option<Look>) -> ViewRules {
    let rules = match scenes {
        Scenes::Natural => ViewRules::NATURAL,
        Scenes::AllClasses => ViewRules::ALL_CLASSES,
        Scenes::Crowded => ViewRules::TRAINING,
    };
    let varied = look.map_or(rules.varied, varied);
    ViewRules { varied, ..rules }
}

/// The share of scenes in light and colors drawn at random.
fn varied(look: Look) -> f32 {
    if look == Look::Varied { 1.0 } else { 0.0 }
}

fn detection(arguments: &CollectDetectionArguments) -> Result<Ended> {
    let out = &arguments.out;
    if fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
        bail!("{} isn't empty; choose another --out", out.display());
    }
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let views = (part(arguments.of), view_rules(arguments.scenes, arguments.look));
    let bar = bars::plain(u64::from(arguments.views), "views");
    let mut is_whole = true;
    let mut go_on = |n: usize| {
        bar.set_position(n as u64);
        is_whole = !stop.load(Ordering::Relaxed);
        is_whole
    };
    let counts =
        coco::collect(out, views, arguments.views as usize, jobs(arguments.jobs), &mut go_on);
    bar.finish_and_clear();
    let mut text =
        format!("{:24} {:>7} {:>7} {:>7} {:>7}\n", "class", "< 100", "small", "medium", "large");
    for (name, sizes) in counts? {
        text += &format!("{name:24}");
        text += &sizes.map(|n| format!(" {n:7}")).concat();
        text += "\n";
    }
    say(&text)?;
    say(&format!("Images:  {}\n", quoted_path(out)))?;
    if !is_whole {
        complain("stopped; what is there is a whole data set of fewer views");
        return Ok(Ended::Interrupted);
    }
    Ok(Ended::Well)
}

fn behavior(arguments: &CollectBehaviorArguments) -> Result<Ended> {
    let rules = clip_rules(&arguments.clips);
    let folder = ClipFolder::open(&arguments.out, part(arguments.of), &rules)?;
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let clips = play(&arguments.clips, part(arguments.of), Some(&folder), stop)?;
    let Some(clips) = clips else {
        complain("stopped; the same command goes on");
        return Ok(Ended::Interrupted);
    };
    let mut text = String::new();
    for behavior in Behavior::ALL {
        let n = clips.iter().filter(|c| c.label == behavior && !c.is_mixed).count();
        text += &format!("{:18} {n:6}\n", behavior.name());
    }
    let n_mixed = clips.iter().filter(|c| c.is_mixed).count();
    text += &format!("{:18} {n_mixed:6}\n", "moving, mixed");
    say(&text)?;
    say(&format!("Clips: {}\n", quoted_path(&arguments.out)))?;
    Ok(Ended::Well)
}

fn clip_rules(arguments: &ClipArguments) -> CollectRules {
    CollectRules {
        of_each: arguments.clips as usize,
        episodes: arguments.episodes as usize,
        varied: varied(arguments.look),
        ..CollectRules::default()
    }
}

/// Clips of episodes of this part; `None` if it was stopped.
pub(super) fn play(
    arguments: &ClipArguments,
    part: Part,
    folder: Option<&ClipFolder>,
    stop: &AtomicBool,
) -> Result<Option<Vec<Clip>>> {
    let sight = super::sight::of_names(Some(&arguments.perception), None)?;
    let bar = bars::plain(u64::from(arguments.episodes), "episodes");
    let (rules, n_threads) = (clip_rules(arguments), jobs(arguments.jobs));
    let collector = Collector { part, rules: &rules, sight: &*sight, n_threads, folder };
    let clips = collect_clips(&collector, &mut |n, _| bar.set_position(n as u64), stop);
    bar.finish_and_clear();
    Ok(clips?)
}
