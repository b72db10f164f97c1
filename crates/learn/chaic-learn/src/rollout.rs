//! Episodes that a network plays, with the rewards of its decisions.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};

use chaic_agents::decision::Policy;
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::briefing::Goal;
use chaic_core::geom::math;
use chaic_core::observation::Grants;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, AgentId, Frame};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, find_partner};
use chaic_env::rules::RuleSet;
use chaic_env::{
    AdvanceOutcome, Appearance, Env, EnvError, EpisodeAgents, EpisodeConfig, RewardTracker,
    RewardWeights, seeded_by_episode,
};
use chaic_episodes::{SplitError, find_episode};
use rayon::prelude::*;

use crate::cloning::{Demonstration, ExpertInfo, ExpertPolicy, RolloutActor};
use crate::policy::{ActionSelection, LearnedPolicy, StepLog, StepRecord, policy_helper};
use crate::policy_kind::PolicyWeights;
use crate::ppo::{Trajectory, Transition};

/// Reason why an episode cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// The episode does not exist.
    #[error(transparent)]
    Episode(#[from] SplitError),
    /// The environment cannot be created.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// An agent failed.
    #[error("an agent failed: {0}")]
    Agent(#[from] AgentError),
}

/// Settings of a rollout.
#[derive(Clone, Copy)]
pub struct RolloutContext<'a> {
    /// Perception of the helper.
    pub perception: &'a dyn PerceptionFactory,
    /// Width and height of all images, pixels.
    pub image_size: u32,
    /// Selection of actions.
    pub selection: ActionSelection,
    /// Weights of the reward terms.
    pub rewards: RewardWeights,
    /// Discount factor per frame for the rewards between two decisions.
    pub gamma: f32,
    /// Stop flag; a stopped rollout returns nothing.
    pub stop: &'a AtomicBool,
}

/// Episode to play.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RolloutEpisode {
    /// Episode id.
    pub id: String,
    /// Name of a partner that deviates from the rules; `None` for the rule-based one.
    pub partner: Option<String>,
    /// Light and colors.
    pub appearance: Appearance,
}

impl RolloutEpisode {
    /// Episode with the rule-based partner and the canonical appearance.
    pub fn new(id: impl Into<String>) -> RolloutEpisode {
        RolloutEpisode { id: id.into(), partner: None, appearance: Appearance::Canonical }
    }

    /// Creates the environment of a helper.
    fn env(&self, helper: Helper, image_size: u32) -> Result<Env, RolloutError> {
        let episode = find_episode(&self.id)?;
        let config = EpisodeConfig {
            image_size: Some(image_size),
            partner: self.partner.as_deref(),
            appearance: self.appearance,
            ..EpisodeConfig::new(&episode, "learner")
        };
        let name = self.partner.as_deref();
        let partner = find_partner(&BuiltInHelpers, name, None, RuleSet::PAPER.planner)?;
        let agents = EpisodeAgents::new(Some(seeded_by_episode(helper, &config)), partner);
        Ok(Env::new(config, agents)?)
    }

    /// Plays the episode with a helper and returns its transport rate; `None` if it was stopped.
    ///
    /// # Errors
    /// [`RolloutError`]
    pub(crate) fn play(
        &self,
        helper: Helper,
        image_size: u32,
        stop: &AtomicBool,
    ) -> Result<Option<f64>, RolloutError> {
        let mut env = self.env(helper, image_size)?;
        let outcome = env.run(stop, None, &mut |_| Ok::<(), AgentError>(()))?;
        Ok((outcome == AdvanceOutcome::Ended).then(|| transport_rate(&env)))
    }
}

fn transport_rate(env: &Env) -> f64 {
    let (done, total) = env.world().progress();
    if total > 0.0 { done / total } else { 0.0 }
}

/// Result of an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EpisodeResult {
    /// Decisions with rewards; durations are frames.
    pub trajectory: Trajectory,
    /// Transport rate.
    pub tr: f64,
    /// Length of the episode, frames.
    pub frames: Frame,
}

/// Recording of a played episode.
struct EpisodeRecording {
    records: Vec<StepRecord>,
    /// Cumulative reward at each frame in which an agent decided.
    cumulative_rewards: Vec<(Frame, f32)>,
    tr: f64,
    frames: Frame,
}

impl EpisodeRecording {
    /// Returns the sum of the rewards from one frame to another, discounted to the first.
    fn discounted_reward(&self, start: Frame, end: Frame, gamma: f32) -> f32 {
        let from = self.cumulative_rewards.partition_point(|(frame, _)| *frame < start);
        let mut sum = 0.0;
        for pair in self.cumulative_rewards[from..].windows(2) {
            let [(_, before), (frame, after)] = [pair[0], pair[1]];
            if frame > end {
                break;
            }
            sum += math::powf(gamma, (frame - start) as f32) * (after - before);
        }
        sum
    }

    /// Returns the end frame of each decision.
    fn ends(&self) -> impl Iterator<Item = Frame> + '_ {
        self.records.iter().skip(1).map(|record| record.frame).chain([self.frames])
    }
}

/// Plays an episode with the policy that `make_policy` creates for its goal; `None` if it was
/// stopped.
fn record_episode<P: Policy>(
    episode: &RolloutEpisode,
    context: &RolloutContext<'_>,
    grants: Grants,
    make_policy: impl FnOnce(&Goal, StepLog) -> P,
) -> Result<Option<EpisodeRecording>, RolloutError> {
    let log = StepLog::default();
    let goal = find_episode(&episode.id)?.setup().goal.clone();
    let policy = make_policy(&goal, Arc::clone(&log));
    let helper = policy_helper(policy, RuleSet::PAPER.planner, context.perception, grants);
    let mut env = episode.env(helper, context.image_size)?;
    let mut tracker = RewardTracker::new(AgentId::HELPER);
    let mut cumulative_rewards = Vec::new();
    loop {
        if context.stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let frame = env.world().state().frame;
        cumulative_rewards.push((frame, tracker.cumulative(env.world(), &context.rewards)));
        if env.advance(Some(frame + 1))? == AdvanceOutcome::Ended {
            break;
        }
    }
    let frames = env.world().state().frame;
    cumulative_rewards.push((frames, tracker.cumulative(env.world(), &context.rewards)));
    let records = std::mem::take(&mut *log.lock().unwrap_or_else(PoisonError::into_inner));
    Ok(Some(EpisodeRecording { records, cumulative_rewards, tr: transport_rate(&env), frames }))
}

/// Plays an episode with a network as the helper; `None` if it was stopped.
///
/// # Errors
/// [`RolloutError`]
pub fn rollout(
    episode: &RolloutEpisode,
    weights: &Arc<PolicyWeights>,
    context: &RolloutContext<'_>,
) -> Result<Option<EpisodeResult>, RolloutError> {
    let recording = record_episode(episode, context, weights.grants(), |_, log| {
        LearnedPolicy::new(Arc::clone(weights), context.selection, Some(log))
    })?;
    let Some(recording) = recording else { return Ok(None) };
    let transitions =
        recording.records.iter().zip(recording.ends()).map(|(record, end)| Transition {
            action: record.action,
            log_prob: record.log_prob,
            value: record.value,
            reward: recording.discounted_reward(record.frame, end, context.gamma),
            duration: (end - record.frame) as f32,
            observation: record.observation.clone(),
        });
    let trajectory = Trajectory { transitions: transitions.collect(), bootstrap_value: 0.0 };
    Ok(Some(EpisodeResult { trajectory, tr: recording.tr, frames: recording.frames }))
}

/// Returns whether the learner drives an episode, with probability `learner_fraction`.
fn learner_drives(id: &str, learner_fraction: f32) -> bool {
    RngStream::new(0, id, 0).chance(learner_fraction)
}

/// Plays an episode in which the expert labels the decisions, driven by the expert or, with
/// probability `learner_fraction`, by the network. Returns the demonstrations and the transport
/// rate; `None` if it was stopped.
///
/// # Errors
/// [`RolloutError`]
pub fn rollout_with_expert(
    episode: &RolloutEpisode,
    weights: &Arc<PolicyWeights>,
    context: &RolloutContext<'_>,
    expert: &ExpertInfo,
    learner_fraction: f32,
) -> Result<Option<(Vec<Demonstration>, f64)>, RolloutError> {
    let recording = record_episode(episode, context, weights.grants(), |goal, log| {
        let actor = if learner_drives(&episode.id, learner_fraction) {
            let learner = LearnedPolicy::new(Arc::clone(weights), context.selection, None);
            RolloutActor::Learner(Box::new(learner))
        } else {
            RolloutActor::Expert(Box::new(weights.encoder()))
        };
        ExpertPolicy::new(expert, goal, actor, log)
    })?;
    let Some(recording) = recording else { return Ok(None) };
    let ends: Vec<Frame> = recording.ends().collect();
    let mut value_target = 0.0;
    let mut demonstrations: Vec<Demonstration> = recording
        .records
        .iter()
        .zip(&ends)
        .rev()
        .map(|(record, end)| {
            let reward = recording.discounted_reward(record.frame, *end, context.gamma);
            let discount = math::powf(context.gamma, (end - record.frame) as f32);
            value_target = reward + discount * value_target;
            Demonstration {
                observation: record.observation.clone(),
                action: record.action,
                value_target,
            }
        })
        .collect();
    demonstrations.reverse();
    Ok(Some((demonstrations, recording.tr)))
}

/// Plays episodes in parallel; results do not depend on the number of threads. Returns `None` if it
/// was stopped.
///
/// # Errors
/// The error of the first episode that cannot be played.
pub fn rollout_all(
    episodes: &[RolloutEpisode],
    weights: &Arc<PolicyWeights>,
    context: &RolloutContext<'_>,
) -> Result<Option<Vec<EpisodeResult>>, RolloutError> {
    let results: Result<Vec<Option<EpisodeResult>>, RolloutError> =
        episodes.par_iter().map(|episode| rollout(episode, weights, context)).collect();
    Ok(results?.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_learner_drives_its_fraction_of_the_episodes() {
        let n_driven = |learner_fraction| {
            let ids = (0..1000).map(|seed| format!("low_target/gen/{}", 40_000_000 + seed));
            ids.filter(|id| learner_drives(id, learner_fraction)).count()
        };
        assert_eq!([n_driven(0.0), n_driven(1.0)], [0, 1000]);
        // The standard deviation is 14.
        assert!((630..=770).contains(&n_driven(0.7)), "{}", n_driven(0.7));
    }

    #[test]
    fn rewards_between_decisions_are_discounted_to_the_first() {
        let recording = EpisodeRecording {
            records: Vec::new(),
            cumulative_rewards: vec![(0, 0.0), (2, 1.0), (3, 1.0), (5, 4.0), (9, 5.0)],
            tr: 0.0,
            frames: 9,
        };
        // A reward of 1 after two frames, one of 3 after five.
        let early = recording.discounted_reward(0, 5, 0.5);
        assert_eq!(early, 0.25 + 3.0 / 32.0);
        assert_eq!(recording.discounted_reward(5, 9, 0.5), 1.0 / 16.0);
        assert_eq!(recording.discounted_reward(0, 9, 1.0), 5.0);
        assert_eq!(recording.discounted_reward(3, 3, 0.5), 0.0);
    }
}
