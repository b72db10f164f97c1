//! Learning single actions by proximal policy optimization: by the paper's numbers, unless told otherwise.

use std::path::Path;
use std::sync::Arc;

use chaic_agents::sight::{GROUND_TRUTH, Sight};
use chaic_env::minds::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EpisodeConfig, Flow, Minds, RewardWeights, Seat, seeded_by_episode};
use chaic_episodes::find_episode;
use chaic_nn::Pass;
use chaic_nn::weights::{self, WeightsError};
use chaic_protocol::rng::Stream;
use chaic_protocol::{AgentId, TaskId};
use chaic_render::Appearance;
use chaic_training::{Figures, Learner, Training, TrainingError, figures};
use chaic_vision::sights::{self, SightError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::PAUSE;
use super::helper::{KIND, Onlooker, PrimitiveHelper, TrainedPrimitive};
use super::network::PrimitiveNetwork;
use super::seen::{IMAGE_SIDE, Seen};
use crate::actor_critic::{ActorCritic as _, Said};
use crate::ppo::{PpoRules, Told, Trajectory, Transition, improve};
use crate::rollout::RolloutError;
use crate::train::{TRAINING_SEEDS, VALIDATION_SEEDS};

/// How single actions are learned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PrimitiveRules {
    /// Of weights, episodes and batches.
    pub seed: u64,
    /// Updates in all.
    pub updates: u64,
    /// Episodes that are played side by side.
    pub envs: usize,
    /// Decisions of each of them between updates.
    pub rollout: usize,
    /// The tasks whose episodes are played, by turns. The paper trains a policy for each.
    pub tasks: Vec<TaskId>,
    /// Side of the images by which the helper and its partner see, pixels; a multiple of 128.
    pub image_size: u32,
    /// By what the helper sees, and tells what its partner does: as `chaic eval` names it.
    pub perception: String,
    /// See `perception`.
    pub behavior: String,
    /// Episodes of each task that validations play.
    pub validation_episodes: usize,
    /// What is rewarded.
    pub rewards: RewardWeights,
    /// How it learns; the discount is of a decision.
    pub ppo: PpoRules,
}

impl Default for PrimitiveRules {
    /// The paper's: 10^4 decisions, an update after every two, batches of two, all else as in Stable-Baselines3.
    fn default() -> PrimitiveRules {
        let sb3 = PpoRules::default();
        PrimitiveRules {
            seed: 1,
            updates: 5000,
            envs: 1,
            rollout: 2,
            tasks: vec![TaskId::NoConstraint],
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            validation_episodes: 4,
            rewards: RewardWeights::STANDARD,
            ppo: PpoRules { batch: 2, shards: 1, ..sb3 },
        }
    }
}

impl PrimitiveRules {
    fn sight(&self) -> Result<Arc<dyn Sight>, SightError> {
        sights::named(&self.perception, &self.behavior)
    }

    /// The `k`th episode that is played in one of the places.
    fn episode(&self, place: usize, k: u64) -> String {
        let index = k * self.envs as u64 + place as u64;
        let (first, n) = TRAINING_SEEDS;
        let task = self.tasks[index as usize % self.tasks.len()];
        let seed = first + Stream::new(self.seed, "episodes", index).below(n) as u64;
        format!("{}/gen/{seed}", task.name())
    }
}

/// A helper that is learning while it plays one episode after the other.
struct Player {
    place: usize,
    n_begun: u64,
    env: Env,
    onlooker: Onlooker,
    /// What was chosen in this episode so far.
    choices: Vec<u8>,
    /// What is seen now.
    seen: Seen,
    pass: Pass,
}

/// What came of a choice.
struct Came {
    reward: f32,
    is_invalid: bool,
    has_ended: bool,
}

impl Player {
    fn begin(
        rules: &PrimitiveRules,
        sight: &dyn Sight,
        (place, n_begun): (usize, u64),
        pass: Pass,
    ) -> Result<Player, RolloutError> {
        let episode = find_episode(&rules.episode(place, n_begun))?;
        let (mut onlooker, grants) = Onlooker::new(RuleSet::PAPER.planner, sight);
        let senses = chaic_protocol::observation::Senses {
            image_size: rules.image_size,
            ..onlooker.senses()
        };
        let minds = Minds { helper: Some(Seat::of_caller(grants, senses)), partner: None };
        let config = EpisodeConfig {
            episode: &episode,
            seed: 0,
            rules: RuleSet::PAPER,
            helper: "learner",
            partner: None,
            image_size: Some(rules.image_size),
            appearance: Appearance::Canonical,
        };
        let mut env = Env::new(config, minds)?;
        onlooker.reset(&env.briefing(AgentId::HELPER));
        env.advance(None)?;
        let seen = env.observe(AgentId::HELPER).and_then(|o| onlooker.look(o));
        let seen = seen.expect("the helper is asked before an episode ends");
        Ok(Player { place, n_begun, env, onlooker, choices: Vec::new(), seen, pass })
    }

    /// Acts, until the next choice or the end; what is seen then is new only if it hasn't ended.
    fn act(&mut self, choice: usize, rewards: &RewardWeights) -> Result<Came, RolloutError> {
        self.choices.push(choice as u8);
        let action = self.onlooker.action(choice);
        self.env.submit(AgentId::HELPER, action.unwrap_or(PAUSE));
        let has_ended = self.env.advance(None)? == Flow::Ended;
        let terms = self.env.reward(AgentId::HELPER);
        let is_invalid = action.is_none() || terms.is_some_and(|t| t.is_invalid);
        let terms = terms.map(|t| chaic_env::RewardTerms { is_invalid, ..t });
        if !has_ended && let Some(observation) = self.env.observe(AgentId::HELPER) {
            self.seen = self.onlooker.look(observation).unwrap_or_else(|| self.seen.clone());
        }
        let reward = terms.map_or(0.0, |t| t.weigh(rewards)) as f32;
        Ok(Came { reward, is_invalid, has_ended })
    }

    fn say(&mut self, model: &PrimitiveNetwork, numbers: &[f32]) -> Said {
        model.forward(numbers, std::iter::once(&self.seen), &mut self.pass).remove(0)
    }
}

/// What a place played between two updates.
#[derive(Default)]
struct Played {
    trajectories: Vec<Trajectory<Seen>>,
    reward: f64,
    n_invalid: usize,
}

/// A policy of single actions while it learns.
pub struct PrimitiveTraining {
    rules: PrimitiveRules,
    sight: Arc<dyn Sight>,
    model: PrimitiveNetwork,
    learner: Learner,
    updates: u64,
    players: Vec<Player>,
}

impl PrimitiveTraining {
    fn players(
        rules: &PrimitiveRules,
        sight: &dyn Sight,
        model: &PrimitiveNetwork,
    ) -> Result<Vec<Player>, RolloutError> {
        let begin = |place| Player::begin(rules, sight, (place, 0), model.pass());
        (0..rules.envs).into_par_iter().map(begin).collect()
    }

    /// Plays on in one place.
    fn roll(
        rules: &PrimitiveRules,
        sight: &dyn Sight,
        (model, numbers): (&PrimitiveNetwork, &[f32]),
        player: &mut Player,
        update: u64,
    ) -> Result<Played, RolloutError> {
        let index = update * rules.envs as u64 + player.place as u64;
        let mut rng = Stream::new(rules.seed, "actions", index);
        let mut played = Played::default();
        let mut trajectory = Trajectory::default();
        for _ in 0..rules.rollout {
            let said = player.say(model, numbers);
            let choice = said.sample(rng.unit());
            let decision = player.seen.clone();
            let came = player.act(choice, &rules.rewards)?;
            played.reward += f64::from(came.reward);
            played.n_invalid += usize::from(came.is_invalid);
            trajectory.transitions.push(Transition {
                decision,
                choice,
                log_probability: said.log_probabilities[choice],
                value: said.value(),
                reward: came.reward,
                duration: 1.0,
            });
            if came.has_ended {
                played.trajectories.push(std::mem::take(&mut trajectory));
                let next = (player.place, player.n_begun + 1);
                let pass = player.pass.clone();
                *player = Player::begin(rules, sight, next, pass)?;
            }
        }
        if !trajectory.transitions.is_empty() {
            trajectory.value_after = player.say(model, numbers).value();
            played.trajectories.push(trajectory);
        }
        Ok(played)
    }
}

impl Training for PrimitiveTraining {
    type Rules = PrimitiveRules;
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 50;
    const CHECKPOINT_STEPS: u64 = 500;
    const VALIDATION_STEPS: u64 = 2500;

    fn new(
        rules: &PrimitiveRules,
        _: &Path,
        _: &mut dyn FnMut(&str) -> bool,
    ) -> Result<Option<PrimitiveTraining>, TrainingError> {
        let sight = rules.sight().map_err(TrainingError::of_data)?;
        let model = PrimitiveNetwork::default();
        let learner = Learner::new(model.network(), rules.seed, rules.ppo.shards);
        let players = PrimitiveTraining::players(rules, &*sight, &model);
        let players = players.map_err(TrainingError::of_data)?;
        let rules = rules.clone();
        Ok(Some(PrimitiveTraining { rules, sight, model, learner, updates: 0, players }))
    }

    fn check(rules: &PrimitiveRules) -> Result<(), String> {
        let PpoRules { epochs, batch, shards, .. } = rules.ppo;
        let least = [rules.envs, rules.rollout, rules.tasks.len(), epochs, batch, shards];
        if rules.updates == 0 || least.contains(&0) || rules.validation_episodes == 0 {
            let what = "updates, envs, rollout, validation_episodes, ppo.epochs, ppo.batch and \
                        ppo.shards are at least 1, and there is a task";
            return Err(what.to_owned());
        }
        let is_multiple = (rules.image_size as usize).is_multiple_of(IMAGE_SIDE);
        if !is_multiple || !(IMAGE_SIDE as u32..=1024).contains(&rules.image_size) {
            return Err(format!("image_size is a multiple of {IMAGE_SIDE} up to 1024"));
        }
        rules.sight().map(|_| ()).map_err(|e| e.to_string())
    }

    fn steps(&self) -> u64 {
        self.rules.updates
    }

    fn taken(&self) -> u64 {
        self.updates
    }

    fn checkpoint(&self) -> Vec<u8> {
        let mut bytes = self.updates.to_le_bytes().to_vec();
        // An episode is played again by what was chosen in it.
        for player in &self.players {
            bytes.extend(player.n_begun.to_le_bytes());
            bytes.extend((player.choices.len() as u64).to_le_bytes());
            bytes.extend(&player.choices);
        }
        bytes.extend(self.learner.checkpoint());
        bytes
    }

    fn begin_with(&mut self, weights: &[u8]) -> Result<(), WeightsError> {
        self.learner.begin_with(TrainedPrimitive::from_bytes(weights)?.numbers);
        Ok(())
    }

    fn resume(&mut self, bytes: &[u8]) -> bool {
        let PrimitiveTraining { rules, sight, model, .. } = self;
        let mut rest = bytes;
        let Some(updates) = take_number(&mut rest) else { return false };
        let mut episodes = Vec::new();
        for place in 0..rules.envs {
            let (Some(n_begun), Some(n)) = (take_number(&mut rest), take_number(&mut rest)) else {
                return false;
            };
            let Some((choices, after)) =
                usize::try_from(n).ok().and_then(|n| rest.split_at_checked(n))
            else {
                return false;
            };
            rest = after;
            episodes.push((place, n_begun, choices.to_vec()));
        }
        if !self.learner.resume(&rules.ppo.adam, rest) {
            return false;
        }
        let again = |(place, n_begun, choices): (usize, u64, Vec<u8>)| {
            let mut player = Player::begin(rules, &**sight, (place, n_begun), model.pass())?;
            for choice in choices {
                player.act(usize::from(choice), &rules.rewards)?;
            }
            Ok::<Player, RolloutError>(player)
        };
        let players: Result<Vec<Player>, RolloutError> =
            episodes.into_par_iter().map(again).collect();
        let Ok(players) = players else { return false };
        (self.players, self.updates) = (players, updates);
        true
    }

    fn step(&mut self) -> Figures {
        let PrimitiveTraining { rules, sight, model, learner, updates, players } = self;
        let numbers = learner.numbers.clone();
        let roll = |player: &mut Player| {
            PrimitiveTraining::roll(rules, &**sight, (model, &numbers), player, *updates)
        };
        let played: Result<Vec<Played>, RolloutError> = players.par_iter_mut().map(roll).collect();
        let played = played.expect("generated episodes can be played");
        let n = (rules.envs * rules.rollout) as f64;
        let reward = played.iter().map(|p| p.reward).sum::<f64>() / n;
        let invalid = played.iter().map(|p| p.n_invalid).sum::<usize>() as f64 / n;
        let trajectories: Vec<_> = played.into_iter().flat_map(|p| p.trajectories).collect();
        let rest = 1.0 - *updates as f32 / rules.updates as f32;
        let named = (rules.seed, *updates, rest);
        let told = improve(&rules.ppo, model, learner, &trajectories, named);
        *updates += 1;
        let Told { objective, value_loss, entropy, divergence, clipped, explained_variance } = told;
        figures([
            ("reward", reward),
            ("invalid", invalid),
            ("objective", objective),
            ("value_loss", value_loss),
            ("entropy", entropy),
            ("divergence", divergence),
            ("clipped", clipped),
            ("explained_variance", explained_variance),
        ])
    }

    fn validate(&self) -> (Figures, Vec<u8>) {
        let PrimitiveTraining { rules, sight, model, learner, .. } = self;
        let numbers = learner.numbers.clone();
        let weights = weights::to_bytes(model.network(), &numbers, KIND);
        let trained = Arc::new(TrainedPrimitive { model: model.clone(), numbers });
        let seeds = || VALIDATION_SEEDS..VALIDATION_SEEDS + rules.validation_episodes as u64;
        let ids: Vec<String> = rules
            .tasks
            .iter()
            .flat_map(|task| seeds().map(|seed| format!("{}/gen/{seed}", task.name())))
            .collect();
        let tr = |id: &String| {
            let helper =
                PrimitiveHelper::helper(Arc::clone(&trained), RuleSet::PAPER.planner, &**sight);
            play(id, rules.image_size, helper)
        };
        let tr: Result<Vec<f64>, RolloutError> = ids.par_iter().map(tr).collect();
        let tr = tr.expect("generated episodes can be played");
        (figures([("tr", tr.iter().sum::<f64>() / tr.len() as f64)]), weights)
    }
}

/// A number at the beginning of bytes, which is taken off.
fn take_number(bytes: &mut &[u8]) -> Option<u64> {
    let (first, rest) = bytes.split_first_chunk::<8>()?;
    *bytes = rest;
    Some(u64::from_le_bytes(*first))
}

/// The transport rate of an episode.
fn play(id: &str, image_size: u32, helper: Helper) -> Result<f64, RolloutError> {
    let episode = find_episode(id)?;
    let config = EpisodeConfig {
        episode: &episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper: "learner",
        partner: None,
        image_size: Some(image_size),
        appearance: Appearance::Canonical,
    };
    let mut env = Env::new(config, Some(seeded_by_episode(helper, &config)))?;
    env.advance(None)?;
    let (done, total) = env.world().progress();
    Ok(if total > 0.0 { done / total } else { 0.0 })
}
