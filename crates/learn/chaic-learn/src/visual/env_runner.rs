//! Environments in which a visual policy collects experience.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::perception_factory::PerceptionFactory;
use chaic_core::AgentId;
use chaic_core::observation::SensorConfig;
use chaic_core::rng::RngStream;
use chaic_env::rules::RuleSet;
use chaic_env::{
    AdvanceOutcome, AgentSlot, Env, EpisodeAgents, EpisodeConfig, RewardTerms, RewardWeights,
};
use chaic_episodes::find_episode;
use chaic_nn::TrainingPass;
use rayon::prelude::*;

use super::actions::ActionSpace;
use super::config::VisualConfig;
use super::helper::{BegunAction, ObservationEncoder};
use super::network::VisualNetwork;
use super::observation::VisualObservation;
use crate::actor_critic::{ActorCritic as _, ActorCriticOutput};
use crate::opponent::network::OpponentModel;
use crate::ppo::{Trajectory, Transition};
use crate::rollout::RolloutError;

/// Configuration, perception and network of a training, which all environments share.
pub(super) struct TrainingSetup {
    pub config: VisualConfig,
    pub perception: Arc<dyn PerceptionFactory>,
    pub opponent: Option<Arc<OpponentModel>>,
    pub model: VisualNetwork,
}

/// Environment with the learning helper, which plays one episode after another.
pub(super) struct EnvRunner {
    slot: usize,
    n_started: u64,
    env: Env,
    encoder: ObservationEncoder,
    /// Actions chosen in the current episode.
    actions: Vec<u16>,
    /// Current observation.
    observation: VisualObservation,
    pass: TrainingPass,
}

/// Outcome of a decision.
struct StepOutcome {
    reward: f32,
    is_invalid: bool,
    has_ended: bool,
}

impl EnvRunner {
    fn new(
        setup: &TrainingSetup,
        slot: usize,
        n_started: u64,
        pass: TrainingPass,
    ) -> Result<EnvRunner, RolloutError> {
        let TrainingSetup { config, perception, opponent, .. } = setup;
        let id = config.episode(slot, n_started);
        let episode = find_episode(&id)?;
        let (mut encoder, grants) =
            ObservationEncoder::new(RuleSet::PAPER.planner, &**perception, opponent.clone());
        let sensors = SensorConfig { image_size: config.image_size, ..encoder.sensors() };
        let agents =
            EpisodeAgents { helper: Some(AgentSlot::external(grants, sensors)), partner: None };
        let config = EpisodeConfig {
            image_size: Some(config.image_size),
            appearance: config.appearance.of_episode(&id),
            ..EpisodeConfig::new(&episode, "learner")
        };
        let mut env = Env::new(config, agents)?;
        encoder.reset(&env.briefing(AgentId::HELPER));
        env.advance(None)?;
        if let Some(observation) = env.observe(AgentId::HELPER) {
            encoder.observe(observation);
        }
        // No plan has begun: the agent lists the valid ones.
        encoder.continue_plan(setup.model.action_space());
        let observation = encode(&mut encoder, &mut env);
        let observation = observation.expect("the helper decides before an episode ends");
        Ok(EnvRunner { slot, n_started, env, encoder, actions: Vec::new(), observation, pass })
    }

    /// Takes a decision and advances to the next one or the end, at most the duration of a plan (1,000
    /// frames). After the end of the episode, the stored observation is outdated.
    fn act(
        &mut self,
        action_index: usize,
        action_space: ActionSpace,
        rewards: &RewardWeights,
    ) -> Result<StepOutcome, RolloutError> {
        self.actions.push(action_index as u16);
        let BegunAction { mut action, is_invalid } = self.encoder.begin(action_space, action_index);
        let mut outcome = StepOutcome { reward: 0.0, is_invalid, has_ended: false };
        let mut is_first = true;
        loop {
            self.env.submit(AgentId::HELPER, action);
            outcome.has_ended = self.env.advance(None)? == AdvanceOutcome::Ended;
            if let Some(terms) = self.env.reward(AgentId::HELPER) {
                let is_invalid = terms.is_invalid || is_first && is_invalid;
                outcome.is_invalid |= is_invalid;
                outcome.reward += RewardTerms { is_invalid, ..terms }.weighted_sum(rewards) as f32;
            }
            is_first = false;
            if outcome.has_ended {
                return Ok(outcome);
            }
            let Some(observation) = self.env.observe(AgentId::HELPER) else { return Ok(outcome) };
            self.encoder.observe(observation);
            match self.encoder.continue_plan(action_space) {
                Some(next) => action = next,
                None => {
                    if let Some(encoded) = encode(&mut self.encoder, &mut self.env) {
                        self.observation = encoded;
                    }
                    return Ok(outcome);
                }
            }
        }
    }

    /// Progress of the current episode.
    pub(super) fn progress(&self) -> EpisodeProgress {
        EpisodeProgress { n_started: self.n_started, actions: self.actions.clone() }
    }

    /// Collects experience in one environment; `None` if it was stopped.
    pub(super) fn collect(
        &mut self,
        setup: &TrainingSetup,
        parameters: &[f32],
        update: u64,
        stop: &AtomicBool,
    ) -> Result<Option<Experience>, RolloutError> {
        let TrainingSetup { config, model, .. } = setup;
        let index = update * config.n_envs as u64 + self.slot as u64;
        let mut rng = RngStream::new(config.seed, "actions", index);
        let mut experience = Experience::default();
        let mut trajectory = Trajectory::default();
        for _ in 0..config.n_steps {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let output = self.evaluate(model, parameters);
            let action_index = output.sample(rng.unit());
            let observation = self.observation.clone();
            let outcome = self.act(action_index, config.action_space, &config.rewards)?;
            experience.reward += f64::from(outcome.reward);
            experience.n_invalid += usize::from(outcome.is_invalid);
            trajectory.transitions.push(Transition {
                observation,
                action: action_index,
                log_prob: output.log_probs[action_index],
                value: output.value(),
                reward: outcome.reward,
                duration: 1.0,
            });
            if outcome.has_ended {
                experience.trajectories.push(std::mem::take(&mut trajectory));
                let (slot, n_started) = (self.slot, self.n_started + 1);
                let pass = self.pass.clone();
                *self = EnvRunner::new(setup, slot, n_started, pass)?;
            }
        }
        if !trajectory.transitions.is_empty() {
            trajectory.bootstrap_value = self.evaluate(model, parameters).value();
            experience.trajectories.push(trajectory);
        }
        Ok(Some(experience))
    }

    fn evaluate(&mut self, model: &VisualNetwork, parameters: &[f32]) -> ActorCriticOutput {
        model.forward(parameters, std::iter::once(&self.observation), &mut self.pass).remove(0)
    }
}

/// Encodes the last observation. Renders its color image, unless the perception has already requested
/// it. Plans in progress need no color image.
fn encode(encoder: &mut ObservationEncoder, env: &mut Env) -> Option<VisualObservation> {
    let drawn = (!encoder.sensors().rgb).then(|| env.render_color(AgentId::HELPER));
    let observation = env.observe(AgentId::HELPER)?;
    encoder.encode(observation, drawn.as_deref().or(observation.images.rgb.as_deref()))
}

/// Experience of one environment between two updates.
#[derive(Default)]
pub(super) struct Experience {
    pub trajectories: Vec<Trajectory<VisualObservation>>,
    pub reward: f64,
    pub n_invalid: usize,
}

/// Progress of an environment: number of episodes started before, and actions of the current one.
#[derive(Clone, Debug, Default)]
pub(super) struct EpisodeProgress {
    pub n_started: u64,
    pub actions: Vec<u16>,
}

/// Replays the current episodes up to this progress; `None` if it was stopped.
///
/// # Errors
/// Predicate that describes what is wrong with the progress.
pub(super) fn replay(
    setup: &TrainingSetup,
    progress: &[EpisodeProgress],
    stop: &AtomicBool,
) -> Result<Option<Vec<EnvRunner>>, String> {
    let TrainingSetup { config, model, .. } = setup;
    let replay_one = |(slot, progress): (usize, &EpisodeProgress)| {
        let failed = |e: RolloutError| format!("has an episode that cannot be played: {e}");
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let runner = EnvRunner::new(setup, slot, progress.n_started, model.pass());
        let mut runner = runner.map_err(failed)?;
        for action_index in &progress.actions {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let outcome =
                runner.act(usize::from(*action_index), config.action_space, &config.rewards);
            let outcome = outcome.map_err(failed)?;
            if outcome.has_ended {
                return Err("continues after the end of an episode".to_owned());
            }
        }
        Ok(Some(runner))
    };
    let runners: Result<Vec<Option<EnvRunner>>, String> =
        progress.par_iter().enumerate().map(replay_one).collect();
    Ok(runners?.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::opponent::network::OpponentInput;
    use crate::rollout_config::TrainingAppearance;
    use crate::visual::observation::IMAGE_CHANNELS;
    use chaic_agents::perception_factory::GroundTruthPerceptionFactory;

    /// Starts the first episode of a training with this appearance.
    fn start(appearance: TrainingAppearance) -> EnvRunner {
        let config = VisualConfig {
            action_space: ActionSpace::Primitives,
            image_size: 128,
            appearance,
            ..VisualConfig::default()
        };
        let model = VisualNetwork::new(config.action_space, OpponentInput::None);
        let perception: Arc<dyn PerceptionFactory> = Arc::new(GroundTruthPerceptionFactory);
        let pass = model.pass();
        let setup = TrainingSetup { config, perception, opponent: None, model };
        EnvRunner::new(&setup, 0, 0, pass).unwrap()
    }

    #[test]
    fn a_varied_appearance_changes_colors_but_no_state() {
        let mut runners = [TrainingAppearance::Canonical, TrainingAppearance::Varied].map(start);
        // Steps and turns.
        for action_index in [1, 0, 2, 0, 0] {
            let [canonical, varied] = &runners;
            assert_eq!(canonical.env.digest(), varied.env.digest());
            let (a, b) = (&canonical.observation, &varied.observation);
            assert!(a.map == b.map && a.state == b.state);
            let pixels = || a.image.chunks(IMAGE_CHANNELS).zip(b.image.chunks(IMAGE_CHANNELS));
            let n_other = pixels().filter(|(a, b)| a[..3] != b[..3]).count();
            assert!(2 * n_other > pixels().count(), "{n_other} pixels have another color");
            assert!(pixels().all(|(a, b)| a[3] == b[3]), "depth is the same");
            for runner in &mut runners {
                let rewards = &RewardWeights::STANDARD;
                runner.act(action_index, ActionSpace::Primitives, rewards).unwrap();
            }
        }
    }
}
