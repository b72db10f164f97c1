//! Learning single actions by proximal policy optimization: by the paper's numbers, unless told otherwise.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::sight::{GROUND_TRUTH, Sight};
use chaic_core::rng::Stream;
use chaic_core::{AgentError, AgentId, TaskId};
use chaic_env::minds::Helper;
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EpisodeConfig, Flow, Minds, RewardWeights, Seat, seeded_by_episode};
use chaic_episodes::find_episode;
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{Network, Pass};
use chaic_render::Appearance;
use chaic_training::bounds::{Bound, BoundTable, SEED, STEPS, integer};
use chaic_training::{
    Checkpoint, CheckpointError, Figures, Learner, Training, TrainingError, figures,
};
use chaic_vision::sights::{self, SightError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::helper::{KIND, Onlooker, PrimitiveHelper, TrainedPrimitive};
use super::network::PrimitiveNetwork;
use super::seen::{IMAGE_SIDE, Seen};
use super::{ACTIONS, PAUSE};
use crate::actor_critic::{ActorCritic as _, Said};
use crate::play_rules::{MAX_VALIDATION_EPISODES, REWARD, TRAINING_SEEDS, VALIDATION_SEEDS};
use crate::ppo::{PpoRules, Told, Trajectory, Transition, improve, ppo_bounds};
use crate::rollout::RolloutError;

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
        let senses =
            chaic_core::observation::Senses { image_size: rules.image_size, ..onlooker.senses() };
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

    fn position(&self) -> Position {
        Position { n_begun: self.n_begun, choices: self.choices.clone() }
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

/// Where a place is: how many episodes it has begun, and what was chosen in the one that is under way.
#[derive(Clone, Debug, Default)]
struct Position {
    n_begun: u64,
    choices: Vec<u8>,
}

/// A policy of single actions while it learns.
pub struct PrimitiveTraining {
    rules: PrimitiveRules,
    sight: Arc<dyn Sight>,
    model: PrimitiveNetwork,
    learner: Learner,
    updates: u64,
    players: Vec<Player>,
    /// Where the players were before an update that was stopped; they are put there before the next one.
    before: Option<Vec<Position>>,
}

impl PrimitiveTraining {
    /// Plays the episodes that are under way up to these positions; `None` if it was stopped.
    fn replay(&self, at: &[Position], stop: &AtomicBool) -> Result<Option<Vec<Player>>, String> {
        let PrimitiveTraining { rules, sight, model, .. } = self;
        replay(rules, &**sight, model, at, stop)
    }

    fn positions(&self) -> Vec<Position> {
        match &self.before {
            Some(before) => before.clone(),
            None => self.players.iter().map(Player::position).collect(),
        }
    }

    /// Plays on in one place; `None` if it was stopped.
    fn roll(
        rules: &PrimitiveRules,
        sight: &dyn Sight,
        (model, numbers): (&PrimitiveNetwork, &[f32]),
        player: &mut Player,
        update: u64,
        stop: &AtomicBool,
    ) -> Result<Option<Played>, RolloutError> {
        let index = update * rules.envs as u64 + player.place as u64;
        let mut rng = Stream::new(rules.seed, "actions", index);
        let mut played = Played::default();
        let mut trajectory = Trajectory::default();
        for _ in 0..rules.rollout {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
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
        Ok(Some(played))
    }
}

/// Plays the episodes that are under way up to these positions; `None` if it was stopped.
///
/// # Errors
/// A predicate that says what is wrong with the positions.
fn replay(
    rules: &PrimitiveRules,
    sight: &dyn Sight,
    model: &PrimitiveNetwork,
    at: &[Position],
    stop: &AtomicBool,
) -> Result<Option<Vec<Player>>, String> {
    let one = |(place, position): (usize, &Position)| {
        let failed = |e: RolloutError| format!("has an episode that can't be played: {e}");
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let begun = Player::begin(rules, sight, (place, position.n_begun), model.pass());
        let mut player = begun.map_err(failed)?;
        for choice in &position.choices {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let came = player.act(usize::from(*choice), &rules.rewards).map_err(failed)?;
            if came.has_ended {
                return Err("goes on after the end of an episode".to_owned());
            }
        }
        Ok(Some(player))
    };
    let players: Result<Vec<Option<Player>>, String> = at.par_iter().enumerate().map(one).collect();
    Ok(players?.into_iter().collect())
}

/// Largest number of decisions between two updates. One is kept in 74 kB, so that all take 5 GB.
const MAX_DECISIONS: usize = 1 << 16;
/// Largest number of pixels of one eye in all environments. Each takes 25 bytes, so that all take 2 GB; beside them an
/// environment takes 4 MB.
const MAX_EYE_PX: usize = 1 << 26;
/// Largest number of decisions of an optimizer step. A pass over their images takes a second, and can't be stopped.
const MAX_BATCH: i64 = 512;

/// Sections of a checkpoint.
const UPDATES: &str = "primitive.updates";
const EPISODES: &str = "primitive.episodes_begun";
const N_CHOICES: &str = "primitive.choices_of_each";
const CHOICES: &str = "primitive.choices";

impl Training for PrimitiveTraining {
    type Rules = PrimitiveRules;
    const KIND: &'static str = "primitive";
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 50;
    const CHECKPOINT_STEPS: u64 = 500;
    const VALIDATION_STEPS: u64 = 2500;
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("updates", STEPS),
        ("envs", integer(1, 1024)),
        ("rollout", integer(1, MAX_DECISIONS as i64)),
        ("image_size", integer(IMAGE_SIDE as i64, 1024)),
        ("validation_episodes", integer(1, MAX_VALIDATION_EPISODES)),
        (
            "rewards",
            Bound::Table(&[
                ("delivered", REWARD),
                ("approached_per_m", REWARD),
                ("invalid", REWARD),
            ]),
        ),
        ("ppo", Bound::Table(&ppo_bounds(MAX_BATCH))),
    ];

    fn new(
        rules: &PrimitiveRules,
        _: &Path,
        _: &mut dyn FnMut(&str),
        stop: &AtomicBool,
    ) -> Result<Option<PrimitiveTraining>, TrainingError> {
        let sight = rules.sight().map_err(TrainingError::of_data)?;
        let model = PrimitiveNetwork::default();
        let learner = Learner::new(model.network(), rules.seed, rules.ppo.shards);
        let at = vec![Position::default(); rules.envs];
        let players = replay(rules, &*sight, &model, &at, stop);
        let players = players.map_err(|e| TrainingError::Rules(format!("`tasks` {e}")))?;
        let Some(players) = players else { return Ok(None) };
        let (rules, before) = (rules.clone(), None);
        Ok(Some(PrimitiveTraining { rules, sight, model, learner, updates: 0, players, before }))
    }

    fn check(rules: &PrimitiveRules) -> Result<(), String> {
        let PrimitiveRules { envs, rollout, image_size, .. } = *rules;
        if rules.tasks.is_empty() {
            return Err("`tasks` names no task".to_owned());
        }
        let side = image_size as usize;
        if !side.is_multiple_of(IMAGE_SIDE) {
            return Err(format!("`image_size` must be a multiple of {IMAGE_SIDE}, up to 1024"));
        }
        if envs * side * side > MAX_EYE_PX {
            return Err(format!(
                "`envs` times the square of `image_size` must be from 1 to {MAX_EYE_PX}, which memory holds"
            ));
        }
        if envs * rollout > MAX_DECISIONS {
            return Err(format!(
                "`envs` times `rollout` must be from 1 to {MAX_DECISIONS}, which memory holds"
            ));
        }
        rules.sight().map(|_| ()).map_err(|e| e.to_string())
    }

    fn read_weights(_: &PrimitiveRules, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        Ok(TrainedPrimitive::from_bytes(weights)?.numbers)
    }

    fn network(&self) -> &Network {
        self.model.network()
    }

    fn steps(&self) -> u64 {
        self.rules.updates
    }

    fn taken(&self) -> u64 {
        self.updates
    }

    fn checkpoint(&self) -> Checkpoint {
        // An episode is played again by what was chosen in it.
        let at = self.positions();
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers(UPDATES, vec![self.updates]);
        checkpoint.insert_integers(EPISODES, at.iter().map(|p| p.n_begun).collect());
        checkpoint.insert_integers(N_CHOICES, at.iter().map(|p| p.choices.len() as u64).collect());
        checkpoint.insert_bytes(CHOICES, at.into_iter().flat_map(|p| p.choices).collect());
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn begin_with(&mut self, numbers: Vec<f32>) {
        self.learner.begin_with(numbers);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        stop: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        let updates = checkpoint.integer(UPDATES)?;
        if updates > self.rules.updates {
            return Err(CheckpointError::section(UPDATES, format!("is {updates}")));
        }
        let at = read_positions(&self.rules, updates, checkpoint)?;
        self.learner.load(checkpoint)?;
        let players = self.replay(&at, stop);
        let players = players.map_err(|e| CheckpointError::section(CHOICES, e))?;
        let Some(players) = players else { return Ok(None) };
        (self.players, self.updates, self.before) = (players, updates, None);
        Ok(Some(()))
    }

    fn step(&mut self, stop: &AtomicBool) -> Option<Figures> {
        let at = self.positions();
        if self.before.is_some() {
            let players = self.replay(&at, stop);
            self.players = players.expect("they were played before")?;
            self.before = None;
        }
        let learner = self.learner.state();
        let figures = self.update(stop);
        if figures.is_none() {
            self.before = Some(at);
            self.learner.set_state(learner);
        }
        figures
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError> {
        let PrimitiveTraining { rules, sight, model, learner, .. } = self;
        let numbers = learner.numbers.clone();
        let weights = weights::to_bytes(model.network(), &numbers, KIND)?;
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
            play(id, rules.image_size, helper, stop)
        };
        let tr: Result<Vec<Option<f64>>, RolloutError> = ids.par_iter().map(tr).collect();
        let tr = tr.expect("generated episodes can be played");
        let Some(tr) = tr.into_iter().collect::<Option<Vec<f64>>>() else { return Ok(None) };
        Ok(Some((figures([("tr", tr.iter().sum::<f64>() / tr.len() as f64)]), weights)))
    }
}

impl PrimitiveTraining {
    /// Plays in all places and learns from it; `None` if it was stopped, with players and learner anywhere.
    fn update(&mut self, stop: &AtomicBool) -> Option<Figures> {
        let PrimitiveTraining { rules, sight, model, learner, updates, players, .. } = self;
        let numbers = learner.numbers.clone();
        let roll = |player: &mut Player| {
            PrimitiveTraining::roll(rules, &**sight, (model, &numbers), player, *updates, stop)
        };
        let played: Result<Vec<Option<Played>>, RolloutError> =
            players.par_iter_mut().map(roll).collect();
        let played = played.expect("generated episodes can be played");
        let played: Vec<Played> = played.into_iter().collect::<Option<_>>()?;
        let n = (rules.envs * rules.rollout) as f64;
        let reward = played.iter().map(|p| p.reward).sum::<f64>() / n;
        let invalid = played.iter().map(|p| p.n_invalid).sum::<usize>() as f64 / n;
        let trajectories: Vec<_> = played.into_iter().flat_map(|p| p.trajectories).collect();
        let rest = 1.0 - *updates as f32 / rules.updates as f32;
        let named = (rules.seed, *updates, rest);
        let told = improve(&rules.ppo, model, learner, &trajectories, named, stop)?;
        *updates += 1;
        let Told { objective, value_loss, entropy, divergence, clipped, explained_variance } = told;
        Some(figures([
            ("reward", reward),
            ("invalid", invalid),
            ("objective", objective),
            ("value_loss", value_loss),
            ("entropy", entropy),
            ("divergence", divergence),
            ("clipped", clipped),
            ("explained_variance", explained_variance),
        ]))
    }
}

/// Returns where each place was, as far as a training of so many updates can have come.
fn read_positions(
    rules: &PrimitiveRules,
    updates: u64,
    checkpoint: &Checkpoint,
) -> Result<Vec<Position>, CheckpointError> {
    let begun = checkpoint.integers(EPISODES, rules.envs)?;
    let n_choices = checkpoint.integers(N_CHOICES, rules.envs)?;
    let mut choices = checkpoint.bytes(CHOICES)?;
    // Every episode but the first one, and every choice, takes a decision.
    let n_decisions = updates * rules.rollout as u64;
    if let Some(n) = begun.iter().find(|n| **n > n_decisions) {
        return Err(CheckpointError::section(EPISODES, format!("has {n}")));
    }
    if choices.iter().any(|choice| usize::from(*choice) >= ACTIONS.len()) {
        return Err(CheckpointError::section(CHOICES, "has a choice that is no action"));
    }
    let mut positions = Vec::new();
    for (n_begun, n) in begun.iter().zip(n_choices) {
        let of_place = usize::try_from(*n).ok().and_then(|n| choices.split_at_checked(n));
        let Some((of_place, rest)) = of_place else {
            return Err(CheckpointError::section(CHOICES, format!("has fewer than {n} left")));
        };
        positions.push(Position { n_begun: *n_begun, choices: of_place.to_vec() });
        choices = rest;
    }
    match choices {
        [] => Ok(positions),
        more => Err(CheckpointError::section(CHOICES, format!("has {} too many", more.len()))),
    }
}

/// Returns the transport rate of an episode; `None` if it was stopped.
fn play(
    id: &str,
    image_size: u32,
    helper: Helper,
    stop: &AtomicBool,
) -> Result<Option<f64>, RolloutError> {
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
    if env.run(stop, None, &mut |_| Ok::<(), AgentError>(()))? != Flow::Ended {
        return Ok(None);
    }
    let (done, total) = env.world().progress();
    Ok(Some(if total > 0.0 { done / total } else { 0.0 }))
}
