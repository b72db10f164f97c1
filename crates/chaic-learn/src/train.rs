//! The loops: episodes are played, and the network learns from them.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use chaic_agents::sight::{GROUND_TRUTH, Sight};
use chaic_files::read_user_file;
use chaic_nn::AdamRules;
use chaic_nn::weights::{self, WeightsError};
use chaic_protocol::TaskId;
use chaic_protocol::rng::Stream;
use chaic_training::{Figures, Learner, Training, TrainingError, figures, rate_at};
use chaic_vision::sights::{self, SightError};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::choice_network::{ChoiceNetwork, Decision};
use crate::cloning::{Learned, Lesson, imitate};
use crate::features::{N_PLAN, N_PLAN_OF_OPPONENT, N_STATE, N_STATE_OF_OPPONENT};
use crate::opponent::{self, network::OpponentModel};
use crate::policy::{Choosing, Trained};
use crate::ppo::{PpoRules, Told, improve};
use crate::rewards::Rewards;
use crate::rollout::{Played, RolloutRules, play_all, play_taught};

/// Seeds of generated episodes to learn from, and to validate by: none of any split, and none that perception
/// was trained on.
pub(crate) const TRAINING_SEEDS: (u64, usize) = (40_000_000, 1_000_000);
pub(crate) const VALIDATION_SEEDS: u64 = 50_000_000;

/// What files of weights say that they are.
const KIND: &str = "chaic plan policy 2";
/// The same of those with an opponent model.
const KIND_WITH_OPPONENT: &str = "chaic plan policy with opponent model 1";
/// What the numbers of the opponent model are called among a policy's.
const OPPONENT: &str = "opponent";
/// No file of weights is larger, bytes.
const MOST_BYTES: u64 = 1 << 28;
/// Width of the network's layers.
const WIDTH: usize = 96;

/// Which network chooses plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// By what its mind remembers.
    Plain,
    /// By what an opponent model tells of the partner, too (Smart-Help).
    WithOpponent,
}

impl Kind {
    /// The network, whose numbers include those of the opponent model: they belong together.
    pub fn network(self) -> ChoiceNetwork {
        if self == Kind::Plain {
            return ChoiceNetwork::new((N_STATE, N_PLAN), WIDTH, 1);
        }
        let inputs = (N_STATE + N_STATE_OF_OPPONENT, N_PLAN + N_PLAN_OF_OPPONENT);
        let mut model = ChoiceNetwork::new(inputs, WIDTH, 1);
        model.network.aside(OPPONENT, opponent::network::network().network.n_numbers());
        model
    }

    fn name(self) -> &'static str {
        if self == Kind::Plain { KIND } else { KIND_WITH_OPPONENT }
    }

    /// A network of this kind that plays by these numbers.
    pub fn trained(self, model: &ChoiceNetwork, numbers: Vec<f32>) -> Trained {
        let of_opponent = |model: &ChoiceNetwork| {
            let range = opponent_range(model);
            Arc::new(OpponentModel::new(numbers[range].to_vec()))
        };
        let opponent = (self == Kind::WithOpponent).then(|| of_opponent(model));
        Trained { model: model.clone(), numbers, opponent }
    }
}

/// Where the opponent model's numbers are.
fn opponent_range(model: &ChoiceNetwork) -> Range<usize> {
    let found = model.network.parameters().iter().find(|p| p.name == OPPONENT);
    found.expect("it is of the kind that has one").range.clone()
}

/// The network in a file of weights.
///
/// # Errors
/// [`WeightsError`] if it isn't a whole file of such a network.
pub fn from_bytes(bytes: &[u8]) -> Result<(Kind, Trained), WeightsError> {
    let read = |kind: Kind| {
        let model = kind.network();
        let numbers = weights::from_bytes(&model.network, bytes, kind.name())?;
        Ok((kind, kind.trained(&model, numbers)))
    };
    match read(Kind::Plain) {
        Err(WeightsError::Kind { found, .. }) if found == KIND_WITH_OPPONENT => {
            read(Kind::WithOpponent)
        }
        read => read,
    }
}

/// Which episodes are played, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlayRules {
    /// Episodes of each iteration.
    pub episodes: usize,
    /// The tasks whose episodes are played, by turns.
    pub tasks: Vec<TaskId>,
    /// Side of everybody's images while training, pixels.
    pub image_size: u32,
    /// By what the helper sees, and tells what its partner does: as `chaic eval` names it.
    pub perception: String,
    /// See `perception`.
    pub behavior: String,
    /// The weights of the opponent model that tells the policy of its partner (`chaic train opponent`), if there
    /// is to be one.
    pub opponent: Option<PathBuf>,
    /// Whether the network's inputs are normalized by their mean and spread so far.
    pub normalize: bool,
    /// Episodes of each task that validations play.
    pub validation_episodes: usize,
    /// What is rewarded.
    pub rewards: Rewards,
}

impl Default for PlayRules {
    fn default() -> PlayRules {
        PlayRules {
            episodes: 32,
            tasks: TaskId::paper().collect(),
            image_size: 128,
            perception: GROUND_TRUTH.to_owned(),
            behavior: GROUND_TRUTH.to_owned(),
            opponent: None,
            normalize: false,
            validation_episodes: 3,
            rewards: Rewards::default(),
        }
    }
}

impl PlayRules {
    fn check(&self) -> Result<(), String> {
        if self.episodes.min(self.tasks.len()).min(self.validation_episodes) == 0 {
            let least =
                "play.episodes and play.validation_episodes are at least 1, and there is a task";
            return Err(least.to_owned());
        }
        if !(16..=1024).contains(&self.image_size) {
            return Err("play.image_size is 16 to 1024".to_owned());
        }
        self.sight().map_err(|e| e.to_string())?;
        self.read_opponent().map_err(|e| e.to_string())?;
        Ok(())
    }

    fn read_opponent(&self) -> Result<Option<OpponentModel>, TrainingError> {
        let read = |path: &PathBuf| {
            let wrong = |problem| TrainingError::Weights { path: path.clone(), problem };
            OpponentModel::from_bytes(&read_user_file(path, MOST_BYTES)?).map_err(wrong)
        };
        self.opponent.as_ref().map(read).transpose()
    }

    fn sight(&self) -> Result<Arc<dyn Sight>, SightError> {
        sights::named(&self.perception, &self.behavior)
    }

    fn rollout<'a>(&self, sight: &'a dyn Sight, choosing: Choosing) -> RolloutRules<'a> {
        let PlayRules { image_size, rewards, .. } = *self;
        RolloutRules { sight, image_size, choosing, rewards }
    }

    /// The episodes of an iteration.
    fn episodes_of(&self, seed: u64, iteration: u64) -> Vec<(String, u32)> {
        let (first, n) = TRAINING_SEEDS;
        (0..self.episodes as u64)
            .map(|k| {
                let index = iteration * self.episodes as u64 + k;
                let task = self.tasks[index as usize % self.tasks.len()];
                let drawn = Stream::new(seed, "episodes", index).below(n) as u64;
                (format!("{}/gen/{}", task.name(), first + drawn), 0)
            })
            .collect()
    }

    /// Transport rates on episodes that nothing is learned from.
    fn validate(&self, sight: &dyn Sight, trained: &Arc<Trained>) -> Figures {
        let seeds = || VALIDATION_SEEDS..VALIDATION_SEEDS + self.validation_episodes as u64;
        let ids: Vec<(String, u32)> = self
            .tasks
            .iter()
            .flat_map(|task| seeds().map(|seed| (format!("{}/gen/{seed}", task.name()), 0)))
            .collect();
        let ways = [("tr_sampled", Choosing::Sampled), ("tr_likeliest", Choosing::Likeliest)];
        let tr = |choosing| {
            let played = play_all(&ids, trained, &self.rollout(sight, choosing));
            mean_tr(&played.expect("generated episodes can be played"))
        };
        figures(ways.map(|(name, choosing)| (name, tr(choosing))))
    }
}

fn mean_tr(played: &[Played]) -> f64 {
    played.iter().map(|p| p.tr).sum::<f64>() / played.len().max(1) as f64
}

/// A network while it learns, with the iterations so far.
pub struct Learning {
    kind: Kind,
    model: ChoiceNetwork,
    learner: Learner,
    iterations: u64,
}

impl Learning {
    fn new(seed: u64, shards: usize, opponent: Option<&OpponentModel>) -> Learning {
        let kind = if opponent.is_some() { Kind::WithOpponent } else { Kind::Plain };
        let model = kind.network();
        let mut learner = Learner::new(&model.network, seed, shards);
        if let Some(opponent) = opponent {
            learner.numbers[opponent_range(&model)].copy_from_slice(opponent.numbers());
        }
        Learning { kind, model, learner, iterations: 0 }
    }

    fn trained(&self) -> Arc<Trained> {
        Arc::new(self.kind.trained(&self.model, self.learner.numbers.clone()))
    }

    /// Takes decisions into what inputs are normalized by.
    fn normalize_by<'a>(&mut self, decisions: impl Iterator<Item = &'a Decision> + Clone) {
        self.model.normalize_by(&mut self.learner.numbers, decisions);
    }

    fn weights(&self) -> Vec<u8> {
        weights::to_bytes(&self.model.network, &self.learner.numbers, self.kind.name())
    }

    fn checkpoint(&self) -> Vec<u8> {
        let mut bytes = self.iterations.to_le_bytes().to_vec();
        bytes.extend(self.learner.checkpoint());
        bytes
    }

    fn resume(&mut self, adam: &AdamRules, bytes: &[u8]) -> bool {
        let Some((iterations, rest)) = bytes.split_first_chunk::<8>() else { return false };
        self.iterations = u64::from_le_bytes(*iterations);
        self.learner.resume(adam, rest)
    }
}

/// What all ways to learn have.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a> {
    /// Of weights, episodes and batches.
    pub seed: u64,
    /// Iterations in all.
    pub iterations: u64,
    /// What is played.
    pub play: &'a PlayRules,
    /// Parts of a batch that are worked on side by side.
    pub shards: usize,
    /// How steps are taken.
    pub adam: &'a AdamRules,
}

/// A way to learn, with all that it depends on.
pub trait Method: Clone + Default + Serialize + DeserializeOwned {
    /// What is wrong with it.
    ///
    /// # Errors
    /// That, in a sentence.
    fn check(&self) -> Result<(), String>;

    /// What all ways to learn have.
    fn course(&self) -> Course<'_>;

    /// An iteration of a helper who sees by this.
    fn learn(&self, sight: &dyn Sight, learning: &mut Learning) -> Figures;
}

/// A policy that is trained in a folder of its own.
pub struct PolicyTraining<M> {
    method: M,
    sight: Arc<dyn Sight>,
    learning: Learning,
}

impl<M: Method> Training for PolicyTraining<M> {
    type Rules = M;
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 1;
    const CHECKPOINT_STEPS: u64 = 5;
    const VALIDATION_STEPS: u64 = 25;

    fn new(
        method: &M,
        _: &Path,
        _: &mut dyn FnMut(&str) -> bool,
    ) -> Result<Option<PolicyTraining<M>>, TrainingError> {
        let Course { seed, shards, play, .. } = method.course();
        let sight = play.sight().map_err(TrainingError::of_data)?;
        let opponent = play.read_opponent()?;
        let learning = Learning::new(seed, shards, opponent.as_ref());
        Ok(Some(PolicyTraining { method: method.clone(), sight, learning }))
    }

    fn check(method: &M) -> Result<(), String> {
        let Course { iterations, play, .. } = method.course();
        if iterations == 0 {
            return Err("there is at least one iteration".to_owned());
        }
        play.check()?;
        method.check()
    }

    fn steps(&self) -> u64 {
        self.method.course().iterations
    }

    fn taken(&self) -> u64 {
        self.learning.iterations
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.learning.checkpoint()
    }

    fn begin_with(&mut self, weights: &[u8]) -> Result<(), WeightsError> {
        let Learning { kind, model, learner, .. } = &mut self.learning;
        learner.begin_with(weights::from_bytes(&model.network, weights, kind.name())?);
        Ok(())
    }

    fn resume(&mut self, bytes: &[u8]) -> bool {
        self.learning.resume(self.method.course().adam, bytes)
    }

    fn step(&mut self) -> Figures {
        let figures = self.method.learn(&*self.sight, &mut self.learning);
        self.learning.iterations += 1;
        figures
    }

    fn validate(&self) -> (Figures, Vec<u8>) {
        let trained = self.learning.trained();
        let figures = self.method.course().play.validate(&*self.sight, &trained);
        (figures, self.learning.weights())
    }
}

/// Learning from what comes of choices, by proximal policy optimization.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Reinforcement {
    /// Of weights, episodes and batches.
    pub seed: u64,
    /// Iterations in all.
    pub iterations: u64,
    /// What is played.
    pub play: PlayRules,
    /// How it learns; the discount is of a frame.
    pub ppo: PpoRules,
}

impl Default for Reinforcement {
    fn default() -> Reinforcement {
        Reinforcement {
            seed: 1,
            iterations: 600,
            play: PlayRules::default(),
            ppo: PpoRules {
                discount: 0.9995,
                trace: 0.98,
                entropy: 0.01,
                epochs: 4,
                batch: 512,
                rate: 1e-3,
                rate_falls: true,
                divergence: 0.02,
                ..PpoRules::default()
            },
        }
    }
}

impl Method for Reinforcement {
    fn check(&self) -> Result<(), String> {
        let PpoRules { epochs, batch, shards, .. } = self.ppo;
        if epochs.min(batch).min(shards) == 0 {
            return Err("ppo.epochs, ppo.batch and ppo.shards are at least 1".to_owned());
        }
        Ok(())
    }

    fn course(&self) -> Course<'_> {
        let Reinforcement { seed, iterations, play, .. } = self;
        let (shards, adam) = (self.ppo.shards, &self.ppo.adam);
        Course { seed: *seed, iterations: *iterations, play, shards, adam }
    }

    fn learn(&self, sight: &dyn Sight, learning: &mut Learning) -> Figures {
        let ids = self.play.episodes_of(self.seed, learning.iterations);
        let rollout = self.play.rollout(sight, Choosing::Sampled);
        let played = play_all(&ids, &learning.trained(), &rollout);
        let played = played.expect("generated episodes can be played");
        let tr = mean_tr(&played);
        let frames = played.iter().map(|p| f64::from(p.frames)).sum();
        let trajectories: Vec<_> = played.into_iter().map(|p| p.trajectory).collect();
        let decisions: usize = trajectories.iter().map(|t| t.transitions.len()).sum();
        let rest = 1.0 - learning.iterations as f32 / self.iterations as f32;
        let named = (self.seed, learning.iterations, rest);
        let Learning { model, learner, .. } = learning;
        let told = improve(&self.ppo, model, learner, &trajectories, named);
        if self.play.normalize {
            let all = trajectories.iter().flat_map(|t| &t.transitions);
            learning.normalize_by(all.map(|t| &t.decision));
        }
        let Told { objective, value_loss, entropy, divergence, clipped, explained_variance } = told;
        figures([
            ("tr", tr),
            ("frames", frames),
            ("decisions", decisions as f64),
            ("objective", objective),
            ("value_loss", value_loss),
            ("entropy", entropy),
            ("divergence", divergence),
            ("clipped", clipped),
            ("explained_variance", explained_variance),
        ])
    }
}

/// Learning from a teacher.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cloning {
    /// Of weights, episodes and batches.
    pub seed: u64,
    /// Iterations in all.
    pub iterations: u64,
    /// What is played.
    pub play: PlayRules,
    /// Share of episodes that the learner drives while the teacher says what it would do.
    pub mixed: f32,
    /// How much less a reward counts that comes a frame later, for values.
    pub discount: f32,
    /// Lessons of each step.
    pub batch: usize,
    /// Highest rate of steps.
    pub rate: f32,
    /// Parts of a batch that are worked on side by side.
    pub shards: usize,
    /// How steps are taken.
    pub adam: AdamRules,
}

impl Default for Cloning {
    fn default() -> Cloning {
        Cloning {
            seed: 1,
            iterations: 100,
            play: PlayRules::default(),
            mixed: 0.5,
            discount: 0.9995,
            batch: 64,
            rate: 2e-3,
            shards: 2,
            adam: AdamRules {
                beta2: 0.999,
                weight_decay: 0.0,
                clip_norm: 1.0,
                ..AdamRules::default()
            },
        }
    }
}

impl Method for Cloning {
    fn check(&self) -> Result<(), String> {
        if self.batch.min(self.shards) == 0 {
            Err("batch and shards are at least 1".to_owned())
        } else {
            Ok(())
        }
    }

    fn course(&self) -> Course<'_> {
        let Cloning { seed, iterations, play, .. } = self;
        let (shards, adam) = (self.shards, &self.adam);
        Course { seed: *seed, iterations: *iterations, play, shards, adam }
    }

    fn learn(&self, sight: &dyn Sight, learning: &mut Learning) -> Figures {
        let ids = self.play.episodes_of(self.seed, learning.iterations);
        let (rollout, trained) = (self.play.rollout(sight, Choosing::Sampled), learning.trained());
        let taught = |(id, seed): &(String, u32)| {
            play_taught((id, *seed), &trained, &rollout, (self.mixed, self.discount))
        };
        let taught: Result<Vec<_>, _> = ids.par_iter().map(taught).collect();
        let taught = taught.expect("generated episodes can be played");
        let tr = taught.iter().map(|(_, tr)| tr).sum::<f64>() / taught.len().max(1) as f64;
        let lessons: Vec<Lesson> = taught.into_iter().flat_map(|(lessons, _)| lessons).collect();
        let rate = rate_at(learning.iterations, (self.rate, 1, self.iterations));
        let how = (&self.adam, rate, self.batch);
        let Learning { model, learner, iterations, .. } = learning;
        let learned = imitate(how, model, learner, &lessons, (self.seed, *iterations));
        if self.play.normalize {
            learning.normalize_by(lessons.iter().map(|l| &l.decision));
        }
        let Learned { loss, agreement, value_loss } = learned;
        figures([
            ("tr", tr),
            ("lessons", lessons.len() as f64),
            ("loss", loss),
            ("agreement", agreement),
            ("value_loss", value_loss),
        ])
    }
}
