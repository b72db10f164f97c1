//! Collection of labeled windows from generated episodes.

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::PlanningAgent;
use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::partners::{self, PARTNER_GRANTS};
use chaic_agents::perception_factory::{GROUND_TRUTH, PerceptionFactory};
use chaic_agents::policies::{
    PartnerHabits, PartnerVariantPolicy, RandomPolicy, RulePolicy, RuleProfile,
};
use chaic_core::observation::Grants;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, AgentId, Briefing, ClassId, Frame, Observation, TaskId};
use chaic_env::helper_registry::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{Digest, Env, EpisodeAgents, EpisodeConfig, seeded_by_episode};
pub use chaic_episodes::DatasetSplit;
use chaic_episodes::{SeedRange, find_episode};
use chaic_files::{FileError, read_bounded, read_user_file, write_atomically};
use chaic_training::bounds::{BoundTable, integer};
use chaic_vision::perception_registry::{self, PerceptionError};
use chaic_world::AgentSpec;
use rayon::prelude::*;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};

use super::episode_agents::EpisodeAgentKinds;
use super::window::{N_CLASS_FEATURES, N_STATE_FEATURES, ObservationHistory};
use super::{N_BODY_LIMITS, OpponentGoal, is_pickable, limits};
use crate::candidate_scorer::CandidateSet;
use crate::rollout::RolloutError;

/// Window with the ground truth at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct LabeledWindow {
    /// Features of the window.
    pub window: CandidateSet,
    /// Goal of the partner.
    pub goal: OpponentGoal,
    /// Index of the class that the partner wants to pick up, if that is its goal.
    pub target: Option<usize>,
    /// Physical limits of the partner.
    pub limits: [f32; N_BODY_LIMITS],
    /// Index of the episode in the collection.
    pub episode: u32,
}

/// Maximum number of windows per goal. [`MAX_WINDOW_BYTES`] limits the total number further.
pub const MAX_WINDOWS: u32 = 1_000_000;
/// Maximum memory of the windows of a collection, and maximum size of a file of windows, bytes. Reading
/// a file takes three times its size.
pub const MAX_WINDOW_BYTES: u64 = 1 << 33;
/// Maximum number of episodes of a collection.
pub const MAX_EPISODES: u32 = 100_000;
/// Bounds of [`WindowCollectionConfig`].
pub const COLLECT_BOUNDS: BoundTable = &[
    ("max_per_class", integer(1, MAX_WINDOWS as i64)),
    ("episodes", integer(1, MAX_EPISODES as i64)),
    ("image_size", integer(16, 1024)),
];

/// Configuration of the collection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindowCollectionConfig {
    /// Maximum number of windows per goal. The paper has 8,355 windows in all.
    #[serde(alias = "of_each")]
    pub max_per_class: usize,
    /// Maximum number of episodes.
    pub episodes: usize,
    /// Tasks, used in turn for successive episodes.
    pub tasks: Vec<TaskId>,
    /// Width and height of all agents' images, pixels.
    pub image_size: u32,
    /// Perception of the helper, as `chaic eval --perception`.
    pub perception: String,
    /// Behavior recognition of the helper, as `chaic eval --behavior`.
    pub behavior: String,
    /// Grants the helper the partner's actions, as in the paper.
    pub granted: bool,
}

impl Default for WindowCollectionConfig {
    fn default() -> WindowCollectionConfig {
        WindowCollectionConfig {
            max_per_class: 20_000,
            episodes: 2_000,
            tasks: TaskId::paper().collect(),
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            granted: false,
        }
    }
}

impl WindowCollectionConfig {
    /// Checks the configuration.
    ///
    /// # Errors
    /// One line that describes the problem.
    pub fn check(&self) -> Result<(), String> {
        if self.tasks.is_empty() {
            return Err("`collect.tasks` is empty".to_owned());
        }
        let perception = self.perception_factory().map_err(|e| e.to_string())?;
        let requested = Grants { behavior: self.granted, ..Grants::PLANNER };
        if self.granted && !perception.grants(requested).behavior {
            let options = "`--grant-behavior` needs `--behavior gt`";
            return Err(format!("`collect.granted` needs `collect.behavior = \"gt\"` ({options})"));
        }
        perception.check_image_size(self.image_size)
    }

    /// Checks that the maximum number of windows fits in memory.
    ///
    /// # Errors
    /// One line that describes the problem.
    pub fn check_memory(&self) -> Result<(), String> {
        let n_per_goal = self.max_per_class.min(self.episodes.saturating_mul(MAX_PER_EPISODE));
        let n = OpponentGoal::ALL.len().saturating_mul(n_per_goal) as u64;
        let n_classes = ClassId::all().filter(|class| is_pickable(*class)).count();
        let n_features = N_STATE_FEATURES + n_classes * N_CLASS_FEATURES;
        let window_bytes = size_of::<LabeledWindow>() + n_features * size_of::<f32>();
        let bytes = n.saturating_mul(window_bytes as u64);
        if bytes <= MAX_WINDOW_BYTES {
            return Ok(());
        }
        let [needed, max] = [bytes, MAX_WINDOW_BYTES].map(|n| n as f64 / f64::from(1 << 30));
        Err(format!(
            "{n} windows may take {needed:.1} GiB of memory, more than the maximum of {max} GiB; set \
             `max_per_class` or the number of episodes to a smaller number"
        ))
    }

    fn perception_factory(&self) -> Result<Arc<dyn PerceptionFactory>, PerceptionError> {
        perception_registry::perception_from_name(&self.perception, &self.behavior)
    }
}

/// Maximum number of windows per goal and episode, for variety.
const MAX_PER_EPISODE: usize = 40;
/// Episodes between two checks of the number of windows.
const ROUND_EPISODES: usize = 32;

/// Collects windows, at most `max_per_class` per goal, in an order that does not depend on threads.
/// Returns `None` if `stop` is raised. `progress` is called with descriptions of finished work.
///
/// # Errors
/// If the perception cannot be created, or an episode cannot be played.
pub fn collect(
    split: DatasetSplit,
    config: &WindowCollectionConfig,
    progress: &mut dyn FnMut(&str),
    stop: &AtomicBool,
) -> Result<Option<Vec<LabeledWindow>>, CollectError> {
    let perception = config.perception_factory()?;
    let mut samples: Vec<LabeledWindow> = Vec::new();
    let mut counts = [0usize; OpponentGoal::ALL.len()];
    for first in (0..config.episodes).step_by(ROUND_EPISODES) {
        let counts_by_goal: Vec<String> = OpponentGoal::ALL
            .iter()
            .zip(counts)
            .map(|(goal, n)| format!("{} {n}", goal.name()))
            .collect();
        progress(&format!("{first} episodes, windows: {}", counts_by_goal.join(", ")));
        let is_incomplete = |goal: &&OpponentGoal| counts[goal.index()] < config.max_per_class;
        if OpponentGoal::ALL.iter().find(is_incomplete).is_none() {
            break;
        }
        let round: Result<Vec<Vec<LabeledWindow>>, CollectError> = (first
            ..(first + ROUND_EPISODES).min(config.episodes))
            .into_par_iter()
            .map(|index| windows_of_episode(split, config, &*perception, index as u32, stop))
            .collect();
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        for sample in round?.into_iter().flatten() {
            let count = &mut counts[sample.goal.index()];
            if *count < config.max_per_class {
                *count += 1;
                samples.push(sample);
            }
        }
    }
    Ok(Some(samples))
}

/// Reason why windows cannot be collected or read.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// The perception cannot be created.
    #[error(transparent)]
    Perception(#[from] PerceptionError),
    /// An episode cannot be played.
    #[error(transparent)]
    Rollout(#[from] RolloutError),
    /// A file operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// There are no windows.
    #[error("there are no windows; play more episodes")]
    Empty,
    /// There are no validation windows.
    #[error(
        "there are no validation windows; set `collect.episodes` to a larger number, or `held_out_fraction` above 0"
    )]
    NoValidation,
    /// The file is not a file of windows.
    #[error("{path}: {problem}")]
    Format {
        /// The file.
        path: std::path::PathBuf,
        /// Description of the problem.
        problem: String,
    },
}

/// Returns a random sample of the windows of one episode; incomplete if `stop` is raised.
fn windows_of_episode(
    split: DatasetSplit,
    config: &WindowCollectionConfig,
    perception: &dyn PerceptionFactory,
    index: u32,
    stop: &AtomicBool,
) -> Result<Vec<LabeledWindow>, CollectError> {
    let task = config.tasks[index as usize % config.tasks.len()];
    let seed = SeedRange::opponent_model(split).first + u64::from(index);
    let id = format!("{}/gen/{seed}", task.name());
    // Seeds without a valid episode are skipped.
    let Ok(episode) = find_episode(&id) else { return Ok(Vec::new()) };
    let setup = episode.setup();
    let planner = RuleSet::PAPER.planner;
    let partner_plan: Arc<Mutex<Option<ReportedPlan>>> = Arc::default();
    let persona = setup.people.first().map_or(task.info().partner.persona, |p| p.persona);
    let EpisodeAgentKinds { partner_waits, helper_is_random } = EpisodeAgentKinds::draw(seed);
    let policy: Box<dyn Policy> = if partner_waits {
        Box::new(PartnerVariantPolicy::new(PartnerHabits::SLOW))
    } else {
        Box::new(partners::policy(persona, task.info().scene))
    };
    let partner = PlanReporter { policy, plan: Arc::clone(&partner_plan), reconsidered: None };
    let partner =
        Helper { agent: Box::new(PlanningAgent::new(partner, planner)), grants: PARTNER_GRANTS };
    let capability =
        setup.people.first().map_or_else(|| persona.capability(), AgentSpec::capability);
    let log: Arc<Mutex<Vec<LabeledWindow>>> = Arc::default();
    let truth = GroundTruth { partner_plan, limits: limits(&capability), episode: index };
    let grants = perception.grants(Grants { behavior: config.granted, ..Grants::PLANNER });
    let recording = RecorderParts { perception, grants, truth, log: Arc::clone(&log) };
    let helper = if helper_is_random {
        recording.into_helper(RandomPolicy::default())
    } else {
        recording.into_helper(RulePolicy::new(RuleProfile::RHP))
    };
    let config = EpisodeConfig {
        image_size: Some(config.image_size),
        ..EpisodeConfig::new(&episode, "watching")
    };
    let agents = EpisodeAgents::new(Some(seeded_by_episode(helper, &config)), Some(partner));
    let mut env = Env::new(config, agents).map_err(RolloutError::from)?;
    env.run(stop, None, &mut |_| Ok::<(), AgentError>(())).map_err(RolloutError::from)?;
    let mut samples = std::mem::take(&mut *log.lock().unwrap_or_else(PoisonError::into_inner));
    // Windows are drawn at random, since goals differ between the start and the end of an episode.
    RngStream::new(seed, "windows", 0).shuffle(&mut samples);
    let mut counts = [0usize; OpponentGoal::ALL.len()];
    samples.retain(|sample| {
        counts[sample.goal.index()] += 1;
        counts[sample.goal.index()] <= MAX_PER_EPISODE
    });
    Ok(samples)
}

/// Current plan of the partner.
#[derive(Clone, Copy)]
struct ReportedPlan {
    plan: Plan,
    /// Frame until which the partner waits before it starts the plan.
    waits_until: Frame,
}

/// The partner's policy, which shares its current plan.
struct PlanReporter {
    policy: Box<dyn Policy>,
    plan: Arc<Mutex<Option<ReportedPlan>>>,
    /// Current plan, while the policy decides whether to replace it.
    reconsidered: Option<Plan>,
}

impl PlanReporter {
    fn report(&self, plan: Plan, waits_until: Frame) {
        let reported = Some(ReportedPlan { plan, waits_until });
        *self.plan.lock().unwrap_or_else(PoisonError::into_inner) = reported;
    }
}

impl Policy for PlanReporter {
    fn reset(&mut self, briefing: &Briefing) {
        self.policy.reset(briefing);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let plan = self.policy.choose(context, valid)?;
        let current = self.reconsidered.take();
        // If the new plan does not supersede the current plan, the agent continues the current
        // plan.
        match current.filter(|current| !self.policy.supersedes(&plan, current)) {
            Some(current) => self.report(current, 0),
            None => self.report(plan, context.memory.frame + self.policy.thinking_frames()),
        }
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        self.report(*current, 0);
        let is_due = self.policy.reconsiders(context, current, has_changed);
        self.reconsidered = is_due.then_some(*current);
        is_due
    }

    fn thinking_frames(&self) -> Frame {
        self.policy.thinking_frames()
    }

    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        self.policy.supersedes(new, current)
    }
}

/// Ground truth about the partner.
struct GroundTruth {
    partner_plan: Arc<Mutex<Option<ReportedPlan>>>,
    limits: [f32; N_BODY_LIMITS],
    episode: u32,
}

/// Parts of a recording helper except for its policy.
struct RecorderParts<'a> {
    perception: &'a dyn PerceptionFactory,
    grants: Grants,
    truth: GroundTruth,
    log: Arc<Mutex<Vec<LabeledWindow>>>,
}

impl RecorderParts<'_> {
    fn into_helper<P: Policy>(self, policy: P) -> Helper {
        let RecorderParts { perception, grants, truth, log } = self;
        let window = ObservationHistory::default();
        let recording_policy = RecordingPolicy { policy, window, briefing: None, truth, log };
        let agent = PlanningAgent::with_watched(
            recording_policy,
            RuleSet::PAPER.planner,
            perception,
            AgentId::PARTNER,
            grants,
        );
        Helper { agent: Box::new(agent), grants }
    }
}

/// Policy that also records windows.
struct RecordingPolicy<P> {
    policy: P,
    window: ObservationHistory,
    briefing: Option<Briefing>,
    truth: GroundTruth,
    log: Arc<Mutex<Vec<LabeledWindow>>>,
}

impl<P: Policy> Policy for RecordingPolicy<P> {
    fn reset(&mut self, briefing: &Briefing) {
        self.policy.reset(briefing);
        self.window.reset(briefing);
        self.briefing = Some(briefing.clone());
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.policy.choose(context, valid)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        self.policy.reconsiders(context, current, has_changed)
    }

    fn observe(&mut self, _: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        let Some(briefing) = &self.briefing else { return };
        self.window.add(memory, briefing, behavior);
        let reported = *self.truth.partner_plan.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(ReportedPlan { plan, waits_until }) = reported else { return };
        let plan = if memory.frame < waits_until { Plan::Wait } else { plan };
        let goal = if self.window.has_partner() {
            OpponentGoal::from_plan(&plan)
        } else {
            OpponentGoal::Unknown
        };
        let class =
            plan.subject().filter(|_| goal == OpponentGoal::Pick).map(|subject| subject.class);
        let sample = LabeledWindow {
            window: self.window.encode(memory, briefing, behavior),
            goal,
            target: class.and_then(|c| self.window.classes().iter().position(|k| *k == c)),
            limits: self.truth.limits,
            episode: self.truth.episode,
        };
        self.log.lock().unwrap_or_else(PoisonError::into_inner).push(sample);
    }
}

/// Key of the metadata of a file of windows.
const GRANTED: &str = "granted";

/// Writes windows as a safetensors file with one row per window: `state` (55 features),
/// `n_choices`, `goal` (by [`OpponentGoal::index`]), `target` (candidate index or -1), `limits`
/// (5), `episode`. The rows of `choices` (38 features) are the candidates of all windows in order.
///
/// The metadata `granted` says whether the partner's actions were granted, so that a model is not
/// trained or evaluated with windows of the wrong kind.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, samples: &[LabeledWindow], is_granted: bool) -> Result<(), FileError> {
    let f32_bytes = |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
        values.flat_map(f32::to_le_bytes).collect()
    };
    let i32_bytes = |values: &mut dyn Iterator<Item = i32>| -> Vec<u8> {
        values.flat_map(i32::to_le_bytes).collect()
    };
    let n = samples.len();
    let n_candidates: usize = samples.iter().map(|s| s.window.n_candidates).sum();
    let target = |s: &LabeledWindow| s.target.map_or(-1, |k| k as i32);
    let tensors = [
        ("choices", Dtype::F32, vec![n_candidates, N_CLASS_FEATURES], {
            f32_bytes(&mut samples.iter().flat_map(|s| s.window.candidates.iter().copied()))
        }),
        ("episode", Dtype::I32, vec![n], i32_bytes(&mut samples.iter().map(|s| s.episode as i32))),
        (
            "goal",
            Dtype::I32,
            vec![n],
            i32_bytes(&mut samples.iter().map(|s| s.goal.index() as i32)),
        ),
        ("limits", Dtype::F32, vec![n, N_BODY_LIMITS], {
            f32_bytes(&mut samples.iter().flat_map(|s| s.limits))
        }),
        ("n_choices", Dtype::I32, vec![n], {
            i32_bytes(&mut samples.iter().map(|s| s.window.n_candidates as i32))
        }),
        ("state", Dtype::F32, vec![n, N_STATE_FEATURES], {
            f32_bytes(&mut samples.iter().flat_map(|s| s.window.state.iter().copied()))
        }),
        ("target", Dtype::I32, vec![n], i32_bytes(&mut samples.iter().map(target))),
    ];
    let views = tensors.iter().map(|(name, dtype, shape, bytes)| {
        let view = TensorView::new(*dtype, shape.clone(), bytes);
        (*name, view.expect("the length matches the shape"))
    });
    let metadata = HashMap::from([(GRANTED.to_owned(), is_granted.to_string())]);
    let bytes = serialize(views, Some(metadata)).expect("names and shapes can be encoded");
    write_atomically(path, &bytes)
}

/// Reads windows that [`write()`] wrote into a training folder.
///
/// # Errors
/// As [`read_from_user_path`], and if the file is a link.
pub fn read(path: &Path, is_granted: bool) -> Result<Vec<LabeledWindow>, CollectError> {
    check_size(path)?;
    parse_granted(path, &read_bounded(path, MAX_WINDOW_BYTES)?, is_granted)
}

/// Reads windows from a file that a user named, which may be a link.
///
/// # Errors
/// If the file cannot be read, exceeds [`MAX_WINDOW_BYTES`], holds no windows, or says that the
/// partner's actions were granted although `is_granted` is false, or the reverse.
pub fn read_from_user_path(
    path: &Path,
    is_granted: bool,
) -> Result<Vec<LabeledWindow>, CollectError> {
    read_with_digest(path, is_granted).map(|(windows, _)| windows)
}

/// As [`read_from_user_path`], with the digest of the file.
pub(super) fn read_with_digest(
    path: &Path,
    is_granted: bool,
) -> Result<(Vec<LabeledWindow>, Digest), CollectError> {
    check_size(path)?;
    let bytes = read_user_file(path, MAX_WINDOW_BYTES)?;
    Ok((parse_granted(path, &bytes, is_granted)?, Digest::of_bytes(&bytes)))
}

/// Refuses a file larger than [`MAX_WINDOW_BYTES`], because reading would truncate it.
fn check_size(path: &Path) -> Result<(), CollectError> {
    // If the size cannot be determined, the later read reports the error.
    let n = fs::metadata(path).map_or(0, |metadata| metadata.len());
    if n <= MAX_WINDOW_BYTES {
        return Ok(());
    }
    let problem = format!("has {n} bytes, more than the maximum of {MAX_WINDOW_BYTES}");
    Err(CollectError::Format { path: path.to_owned(), problem })
}

fn parse_granted(
    path: &Path,
    bytes: &[u8],
    is_granted: bool,
) -> Result<Vec<LabeledWindow>, CollectError> {
    let windows = parse_file(path, bytes)?;
    let metadata = SafeTensors::read_metadata(bytes).ok();
    let metadata = metadata.as_ref().and_then(|(_, metadata)| metadata.metadata().as_ref());
    // Files of earlier versions have no metadata.
    match metadata.and_then(|metadata| metadata.get(GRANTED)) {
        Some(granted) if *granted != is_granted.to_string() => Err(CollectError::Format {
            path: path.to_owned(),
            problem: format!(
                "collected with `granted = {granted}`, but the training has `collect.granted = {is_granted}`"
            ),
        }),
        _ => Ok(windows),
    }
}

fn parse_file(path: &Path, bytes: &[u8]) -> Result<Vec<LabeledWindow>, CollectError> {
    parse(bytes).map_err(|problem| CollectError::Format { path: path.to_owned(), problem })
}

fn parse(bytes: &[u8]) -> Result<Vec<LabeledWindow>, String> {
    let file =
        SafeTensors::deserialize(bytes).map_err(|e| format!("not a file of windows: {e}"))?;
    let tensor = |name: &str, dtype: Dtype, columns: usize| -> Result<Vec<[u8; 4]>, String> {
        let tensor_view = file.tensor(name).map_err(|_| format!("`{name}` is missing"))?;
        let width: usize = tensor_view.shape().iter().skip(1).product();
        if tensor_view.dtype() != dtype || width != columns {
            let (found, shape) = (tensor_view.dtype(), tensor_view.shape());
            return Err(format!(
                "`{name}` is {found:?} {shape:?}, expected {dtype:?} [n, {columns}]"
            ));
        }
        Ok(tensor_view.data().as_chunks::<4>().0.to_vec())
    };
    let f32s = |name, columns| -> Result<Vec<f32>, String> {
        Ok(tensor(name, Dtype::F32, columns)?.into_iter().map(f32::from_le_bytes).collect())
    };
    let i32s = |name| -> Result<Vec<i32>, String> {
        Ok(tensor(name, Dtype::I32, 1)?.into_iter().map(i32::from_le_bytes).collect())
    };
    let (state, candidates) =
        (f32s("state", N_STATE_FEATURES)?, f32s("choices", N_CLASS_FEATURES)?);
    let limits = f32s("limits", N_BODY_LIMITS)?;
    if !state.iter().chain(&candidates).chain(&limits).all(|x| x.is_finite()) {
        return Err("a value is not finite".to_owned());
    }
    let [n_candidates, goals] = [i32s("n_choices")?, i32s("goal")?];
    let [targets, episodes] = [i32s("target")?, i32s("episode")?];
    let n = n_candidates.len();
    let lengths = [state.len() / N_STATE_FEATURES, limits.len() / N_BODY_LIMITS];
    let all_lengths = lengths.into_iter().chain([goals.len(), targets.len(), episodes.len()]);
    let total: i64 = n_candidates.iter().map(|n| i64::from(*n).max(0)).sum();
    if all_lengths.into_iter().any(|len| len != n)
        || total != (candidates.len() / N_CLASS_FEATURES) as i64
    {
        return Err("its tensors have different lengths".to_owned());
    }
    let mut candidates = candidates.chunks_exact(N_CLASS_FEATURES);
    (0..n)
        .map(|k| {
            let n_candidates = n_candidates[k].max(0) as usize;
            let goal =
                usize::try_from(goals[k]).ok().and_then(|g| OpponentGoal::ALL.get(g).copied());
            let target = usize::try_from(targets[k]).ok();
            if target.is_some_and(|t| t >= n_candidates) {
                return Err(format!("target {} of window {k} is not a candidate", targets[k]));
            }
            let mut window_limits = [0.0; N_BODY_LIMITS];
            window_limits.copy_from_slice(&limits[k * N_BODY_LIMITS..][..N_BODY_LIMITS]);
            Ok(LabeledWindow {
                window: CandidateSet {
                    state: state[k * N_STATE_FEATURES..][..N_STATE_FEATURES].to_vec(),
                    candidates: candidates.by_ref().take(n_candidates).flatten().copied().collect(),
                    n_candidates,
                    memory: Vec::new(),
                },
                goal: goal
                    .ok_or_else(|| format!("goal {} of window {k} is not a goal", goals[k]))?,
                target,
                limits: window_limits,
                episode: episodes[k].max(0) as u32,
            })
        })
        .collect()
}
