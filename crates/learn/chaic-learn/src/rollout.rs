//! Episodes that are played by a network, and what came of its choices.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};

use chaic_agents::decision::Policy;
use chaic_agents::sight::Sight;
use chaic_core::briefing::Goal;
use chaic_core::geom::math;
use chaic_core::rng::Stream;
use chaic_core::{AgentError, Frame};
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EnvError, EpisodeConfig, Flow, Minds, seeded_by_episode};
use chaic_episodes::{SplitError, find_episode};
use chaic_render::Appearance;
use rayon::prelude::*;

use crate::cloning::{Lesson, Teacher, driver};
use crate::policy::{Choosing, LearnedPolicy, Noted, Notes, Trained, drive};
use crate::ppo::{Trajectory, Transition};
use crate::rewards::{Account, Rewards};

/// Why an episode can't be played.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// There is no such episode.
    #[error(transparent)]
    Episode(#[from] SplitError),
    /// It can't become a world.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// A mind broke down.
    #[error("a mind broke down: {0}")]
    Mind(#[from] AgentError),
}

/// How episodes are played.
#[derive(Clone, Copy)]
pub struct RolloutRules<'a> {
    /// By what the helper sees.
    pub sight: &'a dyn Sight,
    /// Side of all images, pixels.
    pub image_size: u32,
    /// How choices are made.
    pub choosing: Choosing,
    /// What is rewarded.
    pub rewards: Rewards,
    /// Flag that stops the play; what was played so far comes to nothing.
    pub stop: &'a AtomicBool,
}

/// What came of an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Played {
    /// Its choices and rewards; durations are frames.
    pub trajectory: Trajectory,
    /// Transport rate.
    pub tr: f64,
    /// Frames that passed.
    pub frames: Frame,
}

/// An episode that was played.
struct Recording {
    noted: Vec<Noted>,
    /// What had been earned at which frame, whenever somebody decided.
    earned: Vec<(Frame, f32)>,
    tr: f64,
    frames: Frame,
}

impl Recording {
    /// What had been earned when a frame began.
    fn earned_at(&self, frame: Frame) -> f32 {
        let k = self.earned.partition_point(|(f, _)| *f < frame);
        self.earned.get(k).or(self.earned.last()).map_or(0.0, |(_, earned)| *earned)
    }

    /// When each choice's time was over.
    fn ends(&self) -> impl Iterator<Item = Frame> + '_ {
        self.noted.iter().skip(1).map(|n| n.frame).chain([self.frames])
    }
}

/// Plays an episode with a helper whose policy is made for its goal; `None` if it was stopped.
fn record<P: Policy>(
    (id, seed): (&str, u32),
    rules: &RolloutRules<'_>,
    make: impl FnOnce(&Goal, Notes) -> P,
) -> Result<Option<Recording>, RolloutError> {
    let episode = find_episode(id)?;
    let notes = Notes::default();
    let policy = make(&episode.setup().goal, Arc::clone(&notes));
    let helper = drive(policy, RuleSet::PAPER.planner, rules.sight);
    let config = EpisodeConfig {
        episode: &episode,
        seed,
        rules: RuleSet::PAPER,
        helper: "learner",
        partner: None,
        image_size: Some(rules.image_size),
        appearance: Appearance::Canonical,
    };
    let minds = Minds::of(Some(seeded_by_episode(helper, &config)), None);
    let mut env = Env::new(config, minds)?;
    let mut account = Account::new(rules.rewards);
    let mut earned = Vec::new();
    loop {
        if rules.stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let frame = env.world().state().frame;
        earned.push((frame, account.earned(env.world())));
        if env.advance(Some(frame + 1))? == Flow::Ended {
            break;
        }
    }
    let frames = env.world().state().frame;
    earned.push((frames, account.earned(env.world())));
    let noted = std::mem::take(&mut *notes.lock().unwrap_or_else(PoisonError::into_inner));
    let (done, total) = env.world().progress();
    let tr = if total > 0.0 { done / total } else { 0.0 };
    Ok(Some(Recording { noted, earned, tr, frames }))
}

/// Plays an episode with a network as the helper; `None` if it was stopped.
///
/// # Errors
/// [`RolloutError`]
pub fn play(
    id: &str,
    seed: u32,
    trained: &Arc<Trained>,
    rules: &RolloutRules<'_>,
) -> Result<Option<Played>, RolloutError> {
    let recording = record((id, seed), rules, |_, notes| {
        LearnedPolicy::new(Arc::clone(trained), rules.choosing, Some(notes))
    })?;
    let Some(recording) = recording else { return Ok(None) };
    let transitions = recording.noted.iter().zip(recording.ends()).map(|(noted, end)| Transition {
        choice: noted.choice,
        log_probability: noted.log_probability,
        value: noted.value,
        reward: recording.earned_at(end) - recording.earned_at(noted.frame),
        duration: (end - noted.frame) as f32,
        decision: noted.decision.clone(),
    });
    let trajectory = Trajectory { transitions: transitions.collect(), value_after: 0.0 };
    Ok(Some(Played { trajectory, tr: recording.tr, frames: recording.frames }))
}

/// Plays an episode with a teacher at hand, who drives the helper itself or lets the network do so: what it taught,
/// and the transport rate; `None` if it was stopped. Returns are discounted by this for each frame.
///
/// # Errors
/// [`RolloutError`]
pub fn play_taught(
    (id, seed): (&str, u32),
    trained: &Arc<Trained>,
    rules: &RolloutRules<'_>,
    (mixed, discount): (f32, f32),
) -> Result<Option<(Vec<Lesson>, f64)>, RolloutError> {
    let learner = || LearnedPolicy::new(Arc::clone(trained), Choosing::Sampled, None);
    let recording = record((id, seed), rules, |goal, notes| {
        let mut rng = Stream::new(u64::from(seed), id, 0);
        let driver = driver(mixed, &mut rng, learner);
        Teacher::new(goal.clone(), driver, trained.opponent.clone(), notes)
    })?;
    let Some(recording) = recording else { return Ok(None) };
    let ends: Vec<Frame> = recording.ends().collect();
    let mut following = 0.0;
    let mut lessons: Vec<Lesson> = recording
        .noted
        .iter()
        .zip(&ends)
        .rev()
        .map(|(noted, end)| {
            let reward = recording.earned_at(*end) - recording.earned_at(noted.frame);
            following = reward + math::powf(discount, (end - noted.frame) as f32) * following;
            Lesson { decision: noted.decision.clone(), choice: noted.choice, target: following }
        })
        .collect();
    lessons.reverse();
    Ok(Some((lessons, recording.tr)))
}

/// Plays episodes side by side on all cores; what comes of each depends on nothing but itself. Returns `None` if
/// they were stopped.
///
/// # Errors
/// The first one's that couldn't be played.
pub fn play_all(
    ids: &[(String, u32)],
    trained: &Arc<Trained>,
    rules: &RolloutRules<'_>,
) -> Result<Option<Vec<Played>>, RolloutError> {
    let played: Result<Vec<Option<Played>>, RolloutError> =
        ids.par_iter().map(|(id, seed)| play(id, *seed, trained, rules)).collect();
    Ok(played?.into_iter().collect())
}
