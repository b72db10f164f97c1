//! Windows of generated episodes, with what was true of the partner.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::Mind;
use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::partners::{self, PARTNER_GRANTS};
use chaic_agents::policies::{Random, RulePolicy, RuleProfile};
use chaic_agents::sight::{GROUND_TRUTH, Sight};
use chaic_core::observation::Grants;
use chaic_core::rng::Stream;
use chaic_core::{AgentError, AgentId, Briefing, Observation, TaskId};
use chaic_env::minds::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EpisodeConfig, Minds, seeded_by_episode};
use chaic_episodes::find_episode;
use chaic_files::{FileError, read_bounded, read_user_file, write_whole};
use chaic_render::Appearance;
use chaic_training::bounds::{BoundTable, integer};
use chaic_vision::sights::{self, SightError};
pub use chaic_vision::views::Part;
use chaic_world::Person;
use rayon::prelude::*;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};

use super::window::{N_CLASS, N_STATE, Window};
use super::{Goal, N_LIMITS, limits_of};
use crate::choice_network::Decision;
use crate::rollout::RolloutError;

/// A window and what was true when it ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The window as numbers.
    pub window: Decision,
    /// What the partner was about.
    pub goal: Goal,
    /// Which of the choices it was after, if it was about to take something.
    pub target: Option<usize>,
    /// What it can't do.
    pub limits: [f32; N_LIMITS],
    /// Which episode of the collection it is of.
    pub episode: u32,
}

/// The seed of a part's first episode: none of any split, nor of those that policies and perception learn from.
fn first_seed(part: Part) -> u64 {
    match part {
        Part::Training => 42_000_000,
        Part::Validation => 52_000_000,
        Part::Test => 62_000_000,
    }
}

/// Largest number of windows of each goal. A window takes about 1.5 kB, so that all take 8 GB.
pub const MAX_WINDOWS: u32 = 1_000_000;
/// Largest number of episodes that windows are made of.
pub const MAX_EPISODES: u32 = 100_000;
/// Bounds of [`CollectRules`].
pub const COLLECT_BOUNDS: BoundTable = &[
    ("of_each", integer(1, MAX_WINDOWS as i64)),
    ("episodes", integer(1, MAX_EPISODES as i64)),
    ("image_size", integer(16, 1024)),
];

/// Which windows are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CollectRules {
    /// Of each goal at most. The paper has 8,355 windows in all.
    pub of_each: usize,
    /// Episodes that are played for them at most.
    pub episodes: usize,
    /// The tasks whose episodes are played, by turns.
    pub tasks: Vec<TaskId>,
    /// Side of everybody's images, pixels.
    pub image_size: u32,
    /// By what the helper sees, as `chaic eval` names it.
    pub perception: String,
    /// By what it tells what its partner does.
    pub behavior: String,
    /// Whether it is granted what its partner does, as in the paper.
    pub granted: bool,
}

impl Default for CollectRules {
    fn default() -> CollectRules {
        CollectRules {
            of_each: 20_000,
            episodes: 2_000,
            tasks: TaskId::paper().collect(),
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            granted: false,
        }
    }
}

impl CollectRules {
    /// What is wrong with them.
    ///
    /// # Errors
    /// That, in a sentence.
    pub fn check(&self) -> Result<(), String> {
        if self.tasks.is_empty() {
            return Err("`collect.tasks` names no task".to_owned());
        }
        self.sight().map(|_| ()).map_err(|e| e.to_string())
    }

    fn sight(&self) -> Result<Arc<dyn Sight>, SightError> {
        sights::named(&self.perception, &self.behavior)
    }
}

/// Observations from one window to the next: those in between differ by one observation.
const EVERY: usize = 4;
/// Windows of each goal from one episode at most, so that there are many.
const OF_EPISODE: usize = 40;
/// Episodes that are played before it is asked whether there are enough windows.
const ROUND: usize = 32;

/// The windows, in an order that doesn't depend on threads, balanced: no goal has more than the rules say, or than
/// twice as many as the rarest but one. Returns `None` if `stop` is raised meanwhile. `progress` is called with what has
/// been done.
///
/// # Errors
/// If nobody can see so, or an episode can't be played.
pub fn collect(
    part: Part,
    rules: &CollectRules,
    progress: &mut dyn FnMut(&str),
    stop: &AtomicBool,
) -> Result<Option<Vec<Sample>>, CollectError> {
    let sight = rules.sight()?;
    let mut samples: Vec<Sample> = Vec::new();
    let mut counts = [0usize; Goal::ALL.len()];
    for first in (0..rules.episodes).step_by(ROUND) {
        let told: Vec<String> =
            Goal::ALL.iter().zip(counts).map(|(goal, n)| format!("{} {n}", goal.name())).collect();
        progress(&format!("{first} episodes, windows: {}", told.join(", ")));
        // Nobody stands still as long as others walk: waiting stays rare.
        let is_enough = |goal: &&Goal| **goal != Goal::Wait && counts[goal.index()] < rules.of_each;
        if Goal::ALL.iter().find(is_enough).is_none() {
            break;
        }
        let round: Result<Vec<Vec<Sample>>, CollectError> = (first
            ..(first + ROUND).min(rules.episodes))
            .into_par_iter()
            .map(|index| of_episode(part, rules, &*sight, index as u32, stop))
            .collect();
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        for sample in round?.into_iter().flatten() {
            let count = &mut counts[sample.goal.index()];
            if *count < rules.of_each {
                *count += 1;
                samples.push(sample);
            }
        }
    }
    Ok(Some(samples))
}

/// Why there are no windows.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// Nobody can see so.
    #[error(transparent)]
    Sight(#[from] SightError),
    /// An episode can't be played.
    #[error(transparent)]
    Rollout(#[from] RolloutError),
    /// The file system refuses.
    #[error(transparent)]
    File(#[from] FileError),
    /// There is nothing to learn from.
    #[error("there are no windows; play more episodes")]
    Empty,
    /// A file is no file of windows.
    #[error("{path}: {problem}")]
    Format {
        /// Where.
        path: std::path::PathBuf,
        /// What is wrong.
        problem: String,
    },
}

/// Returns the windows of one episode, thinned out; some of them if `stop` is raised meanwhile.
fn of_episode(
    part: Part,
    rules: &CollectRules,
    sight: &dyn Sight,
    index: u32,
    stop: &AtomicBool,
) -> Result<Vec<Sample>, CollectError> {
    let task = rules.tasks[index as usize % rules.tasks.len()];
    let seed = first_seed(part) + u64::from(index);
    let id = format!("{}/gen/{seed}", task.name());
    let episode = find_episode(&id).map_err(RolloutError::from)?;
    let setup = episode.setup();
    let planner = RuleSet::PAPER.planner;
    let overheard: Arc<Mutex<Option<Plan>>> = Arc::default();
    let persona = setup.people.first().map_or(task.info().partner.persona, |p| p.persona);
    let partner = Overheard {
        policy: partners::policy(persona, task.info().scene),
        plan: Arc::clone(&overheard),
    };
    let partner = Helper { mind: Box::new(Mind::new(partner, planner)), grants: PARTNER_GRANTS };
    let body = setup.people.first().map_or_else(|| persona.capability(), Person::capability);
    let notes: Arc<Mutex<Vec<Sample>>> = Arc::default();
    let truth = Truth { overheard, limits: limits_of(&body), episode: index };
    let grants = sight.grants(Grants { behavior: rules.granted, ..Grants::PLANNER });
    let seeing = Seeing { sight, grants, truth, notes: Arc::clone(&notes) };
    // The paper's windows are seen by a random helper; RHP stays nearer to its partner.
    let helper = if index.is_multiple_of(2) {
        seeing.drive(Random::default())
    } else {
        seeing.drive(RulePolicy::new(RuleProfile::RHP))
    };
    let config = EpisodeConfig {
        episode: &episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper: "watching",
        partner: None,
        image_size: Some(rules.image_size),
        appearance: Appearance::Canonical,
    };
    let minds = Minds::of(Some(seeded_by_episode(helper, &config)), Some(partner));
    let mut env = Env::new(config, minds).map_err(RolloutError::from)?;
    env.run(stop, None, &mut |_| Ok::<(), AgentError>(())).map_err(RolloutError::from)?;
    let mut samples = std::mem::take(&mut *notes.lock().unwrap_or_else(PoisonError::into_inner));
    // Any of them, as the goals of an episode's beginning are not those of its end.
    Stream::new(seed, "windows", 0).shuffle(&mut samples);
    let mut counts = [0usize; Goal::ALL.len()];
    samples.retain(|sample| {
        counts[sample.goal.index()] += 1;
        counts[sample.goal.index()] <= OF_EPISODE
    });
    Ok(samples)
}

/// The partner's own policy, whose plan somebody may ask for.
struct Overheard {
    policy: RulePolicy,
    plan: Arc<Mutex<Option<Plan>>>,
}

impl Overheard {
    fn tell(&self, plan: Plan) {
        *self.plan.lock().unwrap_or_else(PoisonError::into_inner) = Some(plan);
    }
}

impl Policy for Overheard {
    fn reset(&mut self, briefing: &Briefing) {
        Policy::reset(&mut self.policy, briefing);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let plan = self.policy.choose(context, valid)?;
        self.tell(plan);
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        self.tell(*current);
        self.policy.reconsiders(context, current, is_news)
    }
}

/// What is true of the partner.
struct Truth {
    overheard: Arc<Mutex<Option<Plan>>>,
    limits: [f32; N_LIMITS],
    episode: u32,
}

/// What a helper that notes windows has besides its policy.
struct Seeing<'a> {
    sight: &'a dyn Sight,
    grants: Grants,
    truth: Truth,
    notes: Arc<Mutex<Vec<Sample>>>,
}

impl Seeing<'_> {
    fn drive<P: Policy>(self, driver: P) -> Helper {
        let Seeing { sight, grants, truth, notes } = self;
        let window = Window::default();
        let watching = Watching { driver, window, briefing: None, looks: 0, truth, notes };
        let who = (AgentId::PARTNER, grants);
        let mind = Mind::watching(watching, RuleSet::PAPER.planner, sight, who);
        Helper { mind: Box::new(mind), grants }
    }
}

/// A policy that notes windows besides.
struct Watching<P> {
    driver: P,
    window: Window,
    briefing: Option<Briefing>,
    looks: usize,
    truth: Truth,
    notes: Arc<Mutex<Vec<Sample>>>,
}

impl<P: Policy> Policy for Watching<P> {
    fn reset(&mut self, briefing: &Briefing) {
        self.driver.reset(briefing);
        self.window.reset(briefing);
        (self.briefing, self.looks) = (Some(briefing.clone()), 0);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.driver.choose(context, valid)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        self.driver.reconsiders(context, current, is_news)
    }

    fn look(&mut self, _: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        let Some(briefing) = &self.briefing else { return };
        self.window.look(memory, briefing);
        self.looks += 1;
        if !self.looks.is_multiple_of(EVERY) {
            return;
        }
        let plan = *self.truth.overheard.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(plan) = plan else { return };
        let goal = if self.window.has_partner() { Goal::of(&plan) } else { Goal::Unknown };
        let class = plan.subject().filter(|_| goal == Goal::Pick).map(|it| it.class);
        let sample = Sample {
            window: self.window.decision(memory, briefing, behavior),
            goal,
            target: class.and_then(|c| self.window.classes().iter().position(|k| *k == c)),
            limits: self.truth.limits,
            episode: self.truth.episode,
        };
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(sample);
    }
}

/// No file of windows is larger, bytes.
const MOST_BYTES: u64 = 1 << 33;

/// Writes windows as a safetensors file, a row each: `state` (44 numbers), `n_choices`, `goal` (by [`Goal::index`]),
/// `target` (a choice, or -1), `limits` (5), `episode`; and `choices` (31 numbers), those of one window after the other.
///
/// # Errors
/// If the file system refuses.
pub fn write(path: &Path, samples: &[Sample]) -> Result<(), FileError> {
    let of_f32 = |numbers: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
        numbers.flat_map(f32::to_le_bytes).collect()
    };
    let of_i32 = |numbers: &mut dyn Iterator<Item = i32>| -> Vec<u8> {
        numbers.flat_map(i32::to_le_bytes).collect()
    };
    let n = samples.len();
    let n_choices: usize = samples.iter().map(|s| s.window.n_choices).sum();
    let target = |s: &Sample| s.target.map_or(-1, |k| k as i32);
    let lists = [
        ("choices", Dtype::F32, vec![n_choices, N_CLASS], {
            of_f32(&mut samples.iter().flat_map(|s| s.window.choices.iter().copied()))
        }),
        ("episode", Dtype::I32, vec![n], of_i32(&mut samples.iter().map(|s| s.episode as i32))),
        ("goal", Dtype::I32, vec![n], of_i32(&mut samples.iter().map(|s| s.goal.index() as i32))),
        ("limits", Dtype::F32, vec![n, N_LIMITS], {
            of_f32(&mut samples.iter().flat_map(|s| s.limits))
        }),
        ("n_choices", Dtype::I32, vec![n], {
            of_i32(&mut samples.iter().map(|s| s.window.n_choices as i32))
        }),
        ("state", Dtype::F32, vec![n, N_STATE], {
            of_f32(&mut samples.iter().flat_map(|s| s.window.state.iter().copied()))
        }),
        ("target", Dtype::I32, vec![n], of_i32(&mut samples.iter().map(target))),
    ];
    let views = lists.iter().map(|(name, dtype, shape, bytes)| {
        let view = TensorView::new(*dtype, shape.clone(), bytes);
        (*name, view.expect("as many bytes as its shape says"))
    });
    let bytes = serialize(views, None).expect("names and shapes are small");
    write_whole(path, &bytes)
}

/// Reads windows that [`write()`] wrote into the folder of a training.
///
/// # Errors
/// If the file is a link, can't be read, or isn't one.
pub fn read(path: &Path) -> Result<Vec<Sample>, CollectError> {
    parsed(path, &read_bounded(path, MOST_BYTES)?)
}

/// Reads windows from a file that a user named, which may be a link.
///
/// # Errors
/// If the file can't be read, or isn't one.
pub fn read_given(path: &Path) -> Result<Vec<Sample>, CollectError> {
    parsed(path, &read_user_file(path, MOST_BYTES)?)
}

fn parsed(path: &Path, bytes: &[u8]) -> Result<Vec<Sample>, CollectError> {
    parse(bytes).map_err(|problem| CollectError::Format { path: path.to_owned(), problem })
}

fn parse(bytes: &[u8]) -> Result<Vec<Sample>, String> {
    let file = SafeTensors::deserialize(bytes).map_err(|e| format!("no file of windows: {e}"))?;
    let list = |name: &str, dtype: Dtype, columns: usize| -> Result<Vec<[u8; 4]>, String> {
        let tensor = file.tensor(name).map_err(|_| format!("there is no `{name}`"))?;
        let width: usize = tensor.shape().iter().skip(1).product();
        if tensor.dtype() != dtype || width != columns {
            let (found, shape) = (tensor.dtype(), tensor.shape());
            return Err(format!(
                "`{name}` is {found:?} {shape:?}; {dtype:?} [n, {columns}] is needed"
            ));
        }
        Ok(tensor.data().as_chunks::<4>().0.to_vec())
    };
    let f32s = |name, columns| -> Result<Vec<f32>, String> {
        Ok(list(name, Dtype::F32, columns)?.into_iter().map(f32::from_le_bytes).collect())
    };
    let i32s = |name| -> Result<Vec<i32>, String> {
        Ok(list(name, Dtype::I32, 1)?.into_iter().map(i32::from_le_bytes).collect())
    };
    let (state, choices) = (f32s("state", N_STATE)?, f32s("choices", N_CLASS)?);
    let limits = f32s("limits", N_LIMITS)?;
    if !state.iter().chain(&choices).chain(&limits).all(|x| x.is_finite()) {
        return Err("it has a number that is not finite".to_owned());
    }
    let [n_choices, goals] = [i32s("n_choices")?, i32s("goal")?];
    let [targets, episodes] = [i32s("target")?, i32s("episode")?];
    let n = n_choices.len();
    let lengths = [state.len() / N_STATE, limits.len() / N_LIMITS];
    let is_whole = lengths.into_iter().chain([goals.len(), targets.len(), episodes.len()]);
    let total: i64 = n_choices.iter().map(|n| i64::from(*n).max(0)).sum();
    if is_whole.into_iter().any(|len| len != n) || total != (choices.len() / N_CLASS) as i64 {
        return Err("its lists are of different lengths".to_owned());
    }
    let mut choices = choices.chunks_exact(N_CLASS);
    (0..n)
        .map(|k| {
            let n_choices = n_choices[k].max(0) as usize;
            let goal = usize::try_from(goals[k]).ok().and_then(|g| Goal::ALL.get(g).copied());
            let target = usize::try_from(targets[k]).ok();
            if target.is_some_and(|t| t >= n_choices) {
                return Err(format!("target {} of window {k} is no choice", targets[k]));
            }
            let mut of_window = [0.0; N_LIMITS];
            of_window.copy_from_slice(&limits[k * N_LIMITS..][..N_LIMITS]);
            Ok(Sample {
                window: Decision {
                    state: state[k * N_STATE..][..N_STATE].to_vec(),
                    choices: choices.by_ref().take(n_choices).flatten().copied().collect(),
                    n_choices,
                },
                goal: goal.ok_or_else(|| format!("goal {} of window {k} is none", goals[k]))?,
                target,
                limits: of_window,
                episode: episodes[k].max(0) as u32,
            })
        })
        .collect()
}
