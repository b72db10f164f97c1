//! Labeled clips: helpers follow partners through generated episodes; labels are the world's
//! events (paper, appendix on action recognition).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::PlanningAgent;
use chaic_agents::behavior::{BehaviorLog, BehaviorModel};
use chaic_agents::memory::Memory;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::policies::FollowPolicy;
use chaic_core::observation::{FrameHistorySpec, Grants};
use chaic_core::rng::RngStream;
use chaic_core::{Action, AgentError, AgentId, Frame, Observation, TaskId, Vec3};
use chaic_env::helper_registry::Helper;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::trace::Record;
use chaic_env::{AdvanceOutcome, Appearance, Env, EpisodeConfig, seeded_by_episode};
use chaic_episodes::{SeedRange, find_episode};
use chaic_nn::normal;
use chaic_world::EventKind;

use super::Behavior;
use super::clip::{CROPS, Clip, ClipCounts, ClipSet, N_EXTRA_CROPS, is_seen_enough};
use super::config::ClipCollectionConfig;
use super::crop::{HISTORY, PersonCrop, PersonCropper, visible_position};
use super::store::{ClipFolder, StoreError};
use crate::noisy::{DetectorNoiseModel, NoisyPerceptionFactory};
use crate::parallel::map_in_order;
use crate::perception::LearnedPerceptionFactory;
use crate::perception_registry::NOISY;
use crate::trained::TrainedDetector;
use crate::views::DatasetSplit;

/// Crops between the starts of two clips of a moving person.
const MOVING_STEP: usize = 24;
/// Clips exclude interactions that ended within this time before their end, frames.
const RECENT_FRAMES: Frame = 24;
/// Episodes per round.
const EPISODES_PER_ROUND: usize = 16;
/// Relative frequency of tasks; failed put-on and put-in actions are rare in most tasks.
const TASKS: [(TaskId, usize); 12] = [
    (TaskId::NoConstraint, 1),
    (TaskId::LowTarget, 1),
    (TaskId::Obstacle, 1),
    (TaskId::HighTarget, 2),
    (TaskId::HighGoal, 8),
    (TaskId::HighContainer, 2),
    (TaskId::Shopping, 2),
    (TaskId::MovingHouse, 2),
    (TaskId::OneHanded, 1),
    (TaskId::LowVision, 1),
    (TaskId::Tires, 1),
    (TaskId::Tremor, 1),
];

/// Source of clips.
#[derive(Clone, Copy)]
pub struct Collector<'a> {
    /// Split of the episodes.
    pub split: DatasetSplit,
    /// Configuration.
    pub config: &'a ClipCollectionConfig,
    /// Perception of the recording helpers, except for the fractions with learned and noisy perception
    /// of the configuration.
    pub perception: &'a dyn PerceptionFactory,
    /// Number of parallel episodes; does not affect the clips.
    pub n_threads: usize,
    /// Folder that stores the clips.
    pub folder: Option<&'a ClipFolder>,
}

/// Returns clips in a fixed order; `None` if `stop` is set meanwhile. `progress` receives the
/// number of played episodes.
///
/// # Errors
/// If the folder cannot be read or written.
pub fn collect(
    collector: &Collector<'_>,
    progress: &mut dyn FnMut(usize, &ClipCounts),
    stop: &AtomicBool,
) -> Result<Option<ClipSet>, StoreError> {
    let Collector { split, config, perception, n_threads, folder } = *collector;
    let (mut collected, mut counts): (ClipSet, ClipCounts) = Default::default();
    let learned_perception = (config.learned_fraction > 0.0)
        .then(|| LearnedPerceptionFactory::new(TrainedDetector::built_in()));
    let noisy_perception =
        NoisyPerceptionFactory::new(DetectorNoiseModel::built_in(), NOISY.to_owned());
    // The perception of an episode, and whether the person's positions are noisy.
    let perception_for = |index: usize| -> (&dyn PerceptionFactory, bool) {
        let drawn = RngStream::new(config.seed, "film", index as u64).unit();
        match &learned_perception {
            Some(learned) if drawn < config.learned_fraction => (learned, false),
            _ if drawn < config.learned_fraction + config.noisy_fraction => {
                (&noisy_perception, true)
            }
            _ => (perception, false),
        }
    };
    for first in (0..config.episodes).step_by(EPISODES_PER_ROUND) {
        if counts.iter().all(|n| *n >= config.max_per_class) {
            return Ok(Some(collected));
        }
        progress(first, &counts);
        let stored = folder.map_or(Ok(None), |folder| folder.read(first))?;
        let is_new = stored.is_none();
        let play_round = || {
            let indices = first..(first + EPISODES_PER_ROUND).min(config.episodes);
            let play_episode = |(): &mut (), index: usize| {
                episode_clips(split, config, perception_for(index), index as u64, stop)
            };
            let new_clips = map_in_order(indices, n_threads, stop, || (), play_episode)?;
            // A round with an interrupted episode is played again.
            (!stop.load(Ordering::Relaxed))
                .then(|| ClipSet::new(new_clips.into_iter().flatten().collect()))
        };
        let Some(mut round) = stored.or_else(play_round) else { return Ok(None) };
        round.clips.retain(|clip| {
            let is_kept = counts[clip.kind()] < config.max_per_class;
            counts[clip.kind()] += usize::from(is_kept);
            is_kept
        });
        if let Some(folder) = folder.filter(|_| is_new) {
            folder.write(first, &round)?;
        }
        collected.found.iter_mut().zip(round.found).for_each(|(found, n)| *found += n);
        collected.clips.extend(round.clips);
    }
    progress(config.episodes, &counts);
    Ok(Some(collected))
}

/// Returns the clips of one episode; none if `stop` is set meanwhile.
fn episode_clips(
    split: DatasetSplit,
    config: &ClipCollectionConfig,
    (perception, is_noisy): (&dyn PerceptionFactory, bool),
    index: u64,
    stop: &AtomicBool,
) -> Vec<Clip> {
    let mut rng = RngStream::new(config.seed, "behavior", index);
    let position_noise = is_noisy.then(|| RngStream::new(config.seed, "positions", index));
    let tasks: Vec<TaskId> =
        TASKS.into_iter().flat_map(|(task, n)| std::iter::repeat_n(task, n)).collect();
    let task = tasks[rng.below(tasks.len())];
    let generator = if rng.chance(0.7) { "gen-standard" } else { "gen" };
    let id = format!("{task}/{generator}/{}", SeedRange::perception(split).draw(&mut rng));
    let appearance = match rng.chance(config.varied_fraction) {
        true => Appearance::Varied { seed: rng.below(1 << 24) as u64 },
        false => Appearance::Canonical,
    };
    // Seeds without a valid episode are skipped.
    let Ok(episode) = find_episode(&id) else { return Vec::new() };
    let rule_set = RuleSet::named(RuleSetName::Paper);
    let config =
        EpisodeConfig { rules: rule_set, appearance, ..EpisodeConfig::new(&episode, "follow") };
    let recorder = Recorder { position_noise, ..Recorder::default() };
    let crops = Arc::clone(&recorder.crops);
    let agent = PlanningAgent::with(
        FollowPolicy::default(),
        perception.perception(),
        Box::new(recorder),
        rule_set.planner,
    );
    let agent = Box::new(agent.replace_perception(perception));
    let helper = Helper { agent, grants: perception.grants(Grants::PLANNER) };
    let helper = seeded_by_episode(helper, &config);
    let Ok(mut env) = Env::new(config, Some(helper)) else { return Vec::new() };
    let mut interactions = Interactions::default();
    let played = env.run(stop, None, &mut |record| -> Result<(), AgentError> {
        interactions.record(record);
        Ok(())
    });
    if !matches!(played, Ok(AdvanceOutcome::Ended)) {
        return Vec::new();
    }
    let crops = crops.lock().unwrap_or_else(PoisonError::into_inner);
    let mut clips = interactions.clips(&crops);
    clips.iter_mut().for_each(|clip| clip.episode = index as u32);
    clips
}

/// Behavior model that records crops of the partner.
#[derive(Clone, Debug, Default)]
struct Recorder {
    cropper: PersonCropper,
    crops: Arc<Mutex<Vec<PersonCrop>>>,
    position_noise: Option<RngStream>,
    log: BehaviorLog,
}

/// Adds a random error to a position. Its length is distributed as for the bundled detector, in meters:
///
/// | quantile | detector | here |
/// |---|---|---|
/// | 50 % | 0.015 | 0.018 |
/// | 90 % | 0.074 | 0.081 |
/// | 99 % | 0.167 | 0.151 |
///
/// The detector's errors are those of 672 people of at least 100 pixels in 8 held-out episodes of RHP.
pub(super) fn with_noise(at: Vec3, rng: &mut RngStream) -> Vec3 {
    let std_dev_m = if rng.chance(0.75) { 0.012 } else { 0.06 };
    let mut error_m = || std_dev_m * normal(rng);
    Vec3::new(at.x + error_m(), at.y, at.z + error_m())
}

impl BehaviorModel for Recorder {
    fn reset(&mut self) {
        self.cropper = PersonCropper::default();
    }

    fn frame_history(&self) -> Option<FrameHistorySpec> {
        Some(HISTORY)
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory) {
        let mut at = visible_position(memory, AgentId::PARTNER);
        if let Some(rng) = &mut self.position_noise {
            at = at.map(|at| with_noise(at, rng));
        }
        let crops = self.cropper.crop(observation.frame, &observation.frame_history, at);
        self.crops.lock().unwrap_or_else(PoisonError::into_inner).extend(crops);
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        Box::new(self.clone())
    }
}

/// Interaction of the partner.
#[derive(Clone, Copy, Debug)]
struct Interaction {
    started: Frame,
    end: Frame,
    behavior: Option<Behavior>,
}

/// Interactions of one episode.
#[derive(Debug, Default)]
struct Interactions {
    ended: Vec<Interaction>,
    started: Option<Frame>,
}

impl Interactions {
    fn record(&mut self, record: &Record) {
        match record {
            Record::Decision(d) if d.agent == AgentId::PARTNER => {
                let is_movement =
                    d.action.is_locomotion() || matches!(d.action, Action::Wait { .. });
                self.started = (!is_movement).then_some(d.frame);
            }
            Record::Event(event) => {
                if let EventKind::Ended { agent: AgentId::PARTNER, action, outcome } =
                    &event.event.kind
                    && let Some(started) = self.started.take()
                {
                    let behavior = Behavior::from_action(action, *outcome);
                    self.ended.push(Interaction { started, end: event.event.frame, behavior });
                }
            }
            _ => {}
        }
    }

    /// Returns all interactions. One that the end of the episode interrupts has no outcome; its clips show
    /// an action that still runs.
    fn all(&self) -> impl Iterator<Item = Interaction> + '_ {
        let interrupted =
            self.started.map(|started| Interaction { started, end: Frame::MAX, behavior: None });
        self.ended.iter().copied().chain(interrupted)
    }

    /// Cuts clips from these crops.
    fn clips(&self, crops: &[PersonCrop]) -> Vec<Clip> {
        let ended = self.ended.iter().filter_map(|interaction| {
            let label = interaction.behavior?;
            let end = crops.partition_point(|crop| crop.frame < interaction.end);
            let clip = clip_at(crops, (end + 1).checked_sub(CROPS)?, label, false)?;
            let last = clip.crops[CROPS + N_EXTRA_CROPS - 1].frame;
            let is_next = |d: &&Interaction| {
                (interaction.end + 1..=last).contains(&d.end) && d.behavior.is_some()
            };
            (self.ended.iter().find(is_next).is_none()).then_some(clip)
        });
        let moving = (0..crops.len()).step_by(MOVING_STEP).filter_map(|first| {
            let frames = [0, CROPS - 1, CROPS + N_EXTRA_CROPS - 1]
                .map(|k| Some(crops.get(first + k)?.frame));
            let [Some(start), Some(end), Some(last)] = frames else { return None };
            let mut is_mixed = false;
            for interaction in self.all() {
                let is_disjoint = interaction.end < start || interaction.started > last;
                let is_recent =
                    (end.saturating_sub(RECENT_FRAMES)..=last).contains(&interaction.end);
                if is_recent {
                    return None;
                }
                is_mixed |= !is_disjoint;
            }
            clip_at(crops, first, Behavior::Moving, is_mixed)
        });
        ended.chain(moving).collect()
    }
}

/// Returns the clip that starts at this crop, if it has no gap and every input that it contains shows the
/// person.
fn clip_at(crops: &[PersonCrop], first: usize, label: Behavior, is_mixed: bool) -> Option<Clip> {
    let crops = crops.get(first..first + CROPS + N_EXTRA_CROPS)?;
    let is_contiguous =
        crops.windows(2).all(|pair| pair[1].frame == pair[0].frame + HISTORY.every_frames);
    let is_seen = crops.windows(CROPS).all(is_seen_enough);
    let clip = || Clip { label, is_mixed, episode: 0, crops: crops.to_vec() };
    (is_contiguous && is_seen).then(clip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behavior::crop::SIDE;

    /// Successive crops; those of these indices show the person.
    fn crops(n: usize, is_seen: impl Fn(usize) -> bool) -> Vec<PersonCrop> {
        let crop = |k: usize| PersonCrop {
            frame: HISTORY.every_frames * k as Frame,
            distance_m: 2.0,
            speed: None,
            is_seen: is_seen(k),
            rgb: vec![0; 3 * SIDE * SIDE],
            depth: vec![0; SIDE * SIDE],
        };
        (0..n).map(crop).collect()
    }

    #[test]
    fn an_action_that_the_end_of_the_episode_interrupts_still_runs() {
        let crops = crops(150, |_| true);
        let mut interactions = Interactions::default();
        let is_mixed = |interactions: &Interactions| -> Vec<bool> {
            interactions.clips(&crops).iter().map(|clip| clip.is_mixed).collect()
        };
        assert_eq!(is_mixed(&interactions), [false; 5]);
        // Clips start at frames 0, 72, ... and end 105 frames later.
        interactions.started = Some(178);
        assert_eq!(is_mixed(&interactions), [false, false, true, true, true]);
        let ended = Interaction { started: 178, end: 420, behavior: Some(Behavior::PutIn) };
        let interactions = Interactions { ended: vec![ended], started: None };
        assert_eq!(is_mixed(&interactions), [false, false, false, true, true, true]);
        assert_eq!(interactions.clips(&crops)[0].label, Behavior::PutIn);
    }

    #[test]
    fn every_input_of_a_clip_shows_the_person() {
        let label = Behavior::Moving;
        let n = CROPS + N_EXTRA_CROPS;
        let n_seen = 7;
        for first in 0..n - n_seen {
            let crops = crops(n, |k| (first..first + n_seen).contains(&k));
            // The inputs have all crops but up to four at the start and at the end.
            let are_common = (N_EXTRA_CROPS..=CROPS - n_seen).contains(&first);
            assert_eq!(clip_at(&crops, 0, label, false).is_some(), are_common, "from {first}");
        }
    }
}
