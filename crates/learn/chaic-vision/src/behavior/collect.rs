//! Clips with labels: helpers who follow partners through generated episodes, and what the world says
//! that the partners did (paper, appendix on action recognition).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::Mind;
use chaic_agents::behavior::{BehaviorLog, BehaviorModel};
use chaic_agents::memory::Memory;
use chaic_agents::policies::Follow;
use chaic_agents::sight::Sight;
use chaic_core::observation::{Film, Grants};
use chaic_core::rng::Stream;
use chaic_core::{Action, AgentError, AgentId, Frame, Observation, TaskId};
use chaic_env::minds::Helper;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::trace::Record;
use chaic_env::{Appearance, Env, EpisodeConfig, Flow, seeded_by_episode};
use chaic_episodes::find_episode;
use chaic_training::bounds::{BoundTable, SEED, SHARE, integer};
use chaic_world::EventKind;
use serde::{Deserialize, Serialize};

use super::Behavior;
use super::clip::{CROPS, Clip, SLACK};
use super::crop::{Crop, FILM, Watcher};
use super::store::{ClipFolder, StoreError};
use crate::parallel::in_order;
use crate::perception::LearnedSight;
use crate::trained::TrainedDetector;
use crate::views::Part;

/// How clips are made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CollectRules {
    /// Picks the episodes.
    pub seed: u64,
    /// So many clips of each behavior at most, and as many mixed ones.
    pub of_each: usize,
    /// Episodes are played until there are that many, but no more than these.
    pub episodes: usize,
    /// Share of episodes in light and colors drawn at random.
    pub varied: f32,
    /// Share of episodes that are filmed by helpers who see by the detector that comes with chaic: who
    /// learns from those alone who know where their partner is can't tell much from crops that miss it.
    pub learned: f32,
}

impl Default for CollectRules {
    fn default() -> CollectRules {
        CollectRules { seed: 1, of_each: 900, episodes: 1000, varied: 0.35, learned: 0.0 }
    }
}

/// Bounds of [`CollectRules`].
pub const COLLECT_BOUNDS: BoundTable = &[
    ("seed", SEED),
    ("of_each", integer(1, MAX_CLIPS as i64)),
    ("episodes", integer(1, MAX_EPISODES as i64)),
    ("varied", SHARE),
    ("learned", SHARE),
];
/// Largest number of clips of each behavior, and of mixed ones. A clip takes 0.33 MB, so that all take 12 GB.
pub const MAX_CLIPS: u32 = 5_000;
/// Largest number of episodes that clips are made of.
pub const MAX_EPISODES: u32 = 100_000;

/// The least share of crops that must show the person (paper: 20 % of an action's observations).
const LEAST_SEEN: f32 = 0.2;
/// Crops between two clips of somebody who moves.
const MOVING_STEP: usize = 24;
/// What has ended this long before the end of a clip is not told of it any more, frames.
const FORGOTTEN_FRAMES: Frame = 24;
/// Episodes that are played before it is asked whether there are enough clips.
const ROUND: usize = 16;
/// How often episodes of a task are played: failed put-ons and put-ins are rare elsewhere.
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

/// How many clips there are of each behavior, mixed ones last.
pub type Counts = [usize; Behavior::ALL.len() + 1];

/// By whom and where clips are made.
#[derive(Clone, Copy)]
pub struct Collector<'a> {
    /// Whose episodes are played.
    pub part: Part,
    /// How.
    pub rules: &'a CollectRules,
    /// By what the helpers who film see, but for the share of [`CollectRules::learned`].
    pub sight: &'a dyn Sight,
    /// Episodes at a time; changes no clip.
    pub n_threads: usize,
    /// Where clips are kept, and found again, if anywhere.
    pub folder: Option<&'a ClipFolder>,
}

/// Returns the clips, in the order in which they were made; `None` if `stop` is raised meanwhile. `progress` is
/// called with the number of episodes that were played.
///
/// # Errors
/// If the folder can't be read or written.
pub fn collect(
    collector: &Collector<'_>,
    progress: &mut dyn FnMut(usize, &Counts),
    stop: &AtomicBool,
) -> Result<Option<Vec<Clip>>, StoreError> {
    let Collector { part, rules, sight, n_threads, folder } = *collector;
    let (mut clips, mut counts): (Vec<Clip>, Counts) = Default::default();
    let learned = (rules.learned > 0.0).then(|| LearnedSight::new(TrainedDetector::built_in()));
    let sight_of = |index: usize| match &learned {
        Some(learned) if Stream::new(rules.seed, "film", index as u64).chance(rules.learned) => {
            learned
        }
        _ => sight,
    };
    for first in (0..rules.episodes).step_by(ROUND) {
        if counts.iter().all(|n| *n >= rules.of_each) {
            return Ok(Some(clips));
        }
        progress(first, &counts);
        let kept = folder.map_or(Ok(None), |folder| folder.read(first))?;
        let is_new = kept.is_none();
        let play = || {
            let indices = first..(first + ROUND).min(rules.episodes);
            let one = |(): &mut (), index: usize| {
                of_episode(part, rules, sight_of(index), index as u64, stop)
            };
            let made = in_order(indices, n_threads, stop, || (), one)?;
            // A round in which an episode was stopped is played again.
            (!stop.load(Ordering::Relaxed)).then(|| made.into_iter().flatten().collect())
        };
        let Some(mut made) = kept.or_else(play) else { return Ok(None) };
        made.retain(|clip| {
            let kind = if clip.is_mixed { counts.len() - 1 } else { clip.label.index() };
            counts[kind] += 1;
            counts[kind] <= rules.of_each
        });
        counts.iter_mut().for_each(|n| *n = (*n).min(rules.of_each));
        if let Some(folder) = folder.filter(|_| is_new) {
            folder.write(first, &made)?;
        }
        clips.extend(made);
    }
    progress(rules.episodes, &counts);
    Ok(Some(clips))
}

/// Returns the clips of one episode; none if `stop` is raised meanwhile.
fn of_episode(
    part: Part,
    rules: &CollectRules,
    sight: &dyn Sight,
    index: u64,
    stop: &AtomicBool,
) -> Vec<Clip> {
    let mut rng = Stream::new(rules.seed, "behavior", index);
    let among: Vec<TaskId> =
        TASKS.into_iter().flat_map(|(task, n)| std::iter::repeat_n(task, n)).collect();
    let task = among[rng.below(among.len())];
    let (first, n) = part.seeds();
    let word = if rng.chance(0.7) { "gen-standard" } else { "gen" };
    let id = format!("{task}/{word}/{}", first + rng.below(n) as u64);
    let appearance = match rng.chance(rules.varied) {
        true => Appearance::Varied { seed: rng.below(1 << 24) as u64 },
        false => Appearance::Canonical,
    };
    // A seed of which nothing can be made is left out.
    let Ok(episode) = find_episode(&id) else { return Vec::new() };
    let rule_set = RuleSet::named(RuleSetName::Paper);
    let config = EpisodeConfig {
        episode: &episode,
        seed: 0,
        rules: rule_set,
        helper: "follow",
        partner: None,
        image_size: None,
        appearance,
    };
    let recorder = Recorder::default();
    let crops = Arc::clone(&recorder.crops);
    let mind =
        Mind::with(Follow::default(), sight.perception(), Box::new(recorder), rule_set.planner);
    let mind = Box::new(mind.with_sight(sight));
    let helper = Helper { mind, grants: sight.grants(Grants::PLANNER) };
    let helper = seeded_by_episode(helper, &config);
    let Ok(mut env) = Env::new(config, Some(helper)) else { return Vec::new() };
    let mut doings = Doings::default();
    let played = env.run(stop, None, &mut |record| -> Result<(), AgentError> {
        doings.note(record);
        Ok(())
    });
    if !matches!(played, Ok(Flow::Ended)) {
        return Vec::new();
    }
    let crops = crops.lock().unwrap_or_else(PoisonError::into_inner);
    doings.clips(&crops)
}

/// Keeps the crops of the partner.
#[derive(Clone, Debug)]
struct Recorder {
    watcher: Watcher,
    crops: Arc<Mutex<Vec<Crop>>>,
    log: BehaviorLog,
}

impl Default for Recorder {
    fn default() -> Recorder {
        Recorder {
            watcher: Watcher::of(AgentId::PARTNER),
            crops: Arc::default(),
            log: BehaviorLog::default(),
        }
    }
}

impl BehaviorModel for Recorder {
    fn reset(&mut self) {
        self.watcher = Watcher::of(AgentId::PARTNER);
    }

    fn film(&self) -> Option<Film> {
        Some(FILM)
    }

    fn watch(&mut self, observation: &Observation, memory: &Memory) {
        let crops = self.watcher.watch(observation, memory);
        self.crops.lock().unwrap_or_else(PoisonError::into_inner).extend(crops);
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        Box::new(self.clone())
    }
}

/// Something that the partner did besides moving about.
#[derive(Clone, Copy, Debug)]
struct Doing {
    began: Frame,
    ended: Frame,
    behavior: Option<Behavior>,
}

/// All of that in one episode.
#[derive(Debug, Default)]
struct Doings {
    done: Vec<Doing>,
    began: Option<Frame>,
}

impl Doings {
    fn note(&mut self, record: &Record) {
        match record {
            Record::Decision(d) if d.agent == AgentId::PARTNER => {
                let moves = d.action.is_locomotion() || matches!(d.action, Action::Wait { .. });
                self.began = (!moves).then_some(d.frame);
            }
            Record::Event(told) => {
                if let EventKind::Ended { agent: AgentId::PARTNER, action, outcome } =
                    &told.event.kind
                    && let Some(began) = self.began.take()
                {
                    let behavior = Behavior::of(action, *outcome);
                    self.done.push(Doing { began, ended: told.event.frame, behavior });
                }
            }
            _ => {}
        }
    }

    /// Clips of these crops.
    fn clips(&self, crops: &[Crop]) -> Vec<Clip> {
        let ended = self.done.iter().filter_map(|doing| {
            let label = doing.behavior?;
            let end = crops.partition_point(|crop| crop.frame < doing.ended);
            let clip = cut(crops, (end + 1).checked_sub(CROPS)?, (label, false))?;
            let last = clip.crops[CROPS + SLACK - 1].frame;
            let is_next =
                |d: &&Doing| (doing.ended + 1..=last).contains(&d.ended) && d.behavior.is_some();
            (self.done.iter().find(is_next).is_none()).then_some(clip)
        });
        let moving = (0..crops.len()).step_by(MOVING_STEP).filter_map(|first| {
            let frames =
                [0, CROPS - 1, CROPS + SLACK - 1].map(|k| Some(crops.get(first + k)?.frame));
            let [Some(begin), Some(end), Some(last)] = frames else { return None };
            let mut is_mixed = false;
            for doing in &self.done {
                let is_beside = doing.ended < begin || doing.began > last;
                let is_told = (end.saturating_sub(FORGOTTEN_FRAMES)..=last).contains(&doing.ended);
                if is_told {
                    return None;
                }
                is_mixed |= !is_beside;
            }
            cut(crops, first, (Behavior::Moving, is_mixed))
        });
        ended.chain(moving).collect()
    }
}

/// The clip that begins with this crop, if it is whole and shows the person.
fn cut(crops: &[Crop], first: usize, (label, is_mixed): (Behavior, bool)) -> Option<Clip> {
    let crops = crops.get(first..first + CROPS + SLACK)?;
    let is_whole = crops.windows(2).all(|pair| pair[1].frame == pair[0].frame + FILM.every_frames);
    let n_seen = crops[..CROPS].iter().filter(|crop| !crop.is_blank()).count();
    let is_seen = n_seen as f32 >= LEAST_SEEN * CROPS as f32;
    (is_whole && is_seen).then(|| Clip { label, is_mixed, crops: crops.to_vec() })
}
