//! Views and clips for `chaic collect` and `chaic eval detection|behavior`.

use std::sync::atomic::AtomicBool;

use anyhow::Result;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_episodes::DatasetSplit;
use chaic_vision::behavior::clip::ClipSet;
use chaic_vision::behavior::collect::{Collector, collect};
use chaic_vision::behavior::config::ClipCollectionConfig;
use chaic_vision::behavior::store::ClipFolder;
use chaic_vision::views::ViewConfig;

use super::{bars, jobs};
use crate::arguments::{AppearanceArgument, ClipArguments, SceneSelection, SplitArgument};

/// Returns the part of the data that an option names.
pub fn dataset_split(split: SplitArgument) -> DatasetSplit {
    match split {
        SplitArgument::Train => DatasetSplit::Train,
        SplitArgument::Validation => DatasetSplit::Validation,
    }
}

/// Returns the configuration of views of this kind of scenes.
pub fn view_config(scenes: SceneSelection, appearance: Option<AppearanceArgument>) -> ViewConfig {
    let config = match scenes {
        SceneSelection::Natural => ViewConfig::NATURAL,
        SceneSelection::AllClasses => ViewConfig::ALL_CLASSES,
        SceneSelection::Crowded => ViewConfig::TRAINING,
    };
    let varied_fraction = appearance.map_or(config.varied_fraction, appearance_fraction);
    ViewConfig { varied_fraction, ..config }
}

/// Returns the fraction of scenes with random light and colors.
fn appearance_fraction(appearance: AppearanceArgument) -> f32 {
    if appearance == AppearanceArgument::Varied { 1.0 } else { 0.0 }
}

/// Returns the configuration of clips.
pub fn clip_config(arguments: &ClipArguments) -> ClipCollectionConfig {
    ClipCollectionConfig {
        max_per_class: arguments.max_per_class as usize,
        episodes: arguments.n_episodes as usize,
        varied_fraction: appearance_fraction(arguments.appearance),
        learned_fraction: 0.0,
        noisy_fraction: 0.0,
        ..ClipCollectionConfig::default()
    }
}

/// Plays episodes and returns their clips; `None` if it was stopped.
///
/// # Errors
/// If the file system refuses.
pub fn collect_clips(
    arguments: &ClipArguments,
    perception: &dyn PerceptionFactory,
    split: DatasetSplit,
    folder: Option<&ClipFolder>,
    stop: &AtomicBool,
) -> Result<Option<ClipSet>> {
    let bar = bars::count_bar(u64::from(arguments.n_episodes), "episodes");
    let (config, n_threads) = (clip_config(arguments), jobs(arguments.jobs));
    let collector = Collector { split, config: &config, perception, n_threads, folder };
    let clips = collect(&collector, &mut |n, _| bar.set_position(n as u64), stop);
    bar.finish_and_clear();
    Ok(clips?)
}
