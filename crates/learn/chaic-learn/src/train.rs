//! The loops: episodes are played, and the network learns from them.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use chaic_agents::sight::Sight;
use chaic_nn::weights::{self, WeightsError};
use chaic_nn::{AdamRules, Network};
use chaic_training::bounds::{ADAM, Bound, BoundTable, RATE, SEED, SHARDS, SHARE, STEPS, integer};
use chaic_training::{
    Checkpoint, CheckpointError, Figures, Learner, Training, TrainingError, figures, rate_at,
};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::choice_network::{ChoiceNetwork, Decision};
use crate::cloning::{Learned, Lesson, imitate};
use crate::features::{N_PLAN, N_PLAN_OF_OPPONENT, N_STATE, N_STATE_OF_OPPONENT};
use crate::opponent::{self, network::OpponentModel};
use crate::play_rules::{PLAY_BOUNDS, mean_tr};
use crate::policy::{Choosing, Trained};
use crate::ppo::{MAX_BATCH, PPO_BOUNDS, PpoRules, Told, improve};
use crate::rollout::{play_all, play_taught};

pub use crate::play_rules::PlayRules;

/// What files of weights say that they are.
const KIND: &str = "chaic plan policy 2";
/// The same of those with an opponent model.
const KIND_WITH_OPPONENT: &str = "chaic plan policy with opponent model 1";
/// What the numbers of the opponent model are called among a policy's.
const OPPONENT: &str = "opponent";
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

/// Section of a checkpoint.
const ITERATIONS: &str = "policy.iterations";

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

    fn weights(&self) -> Result<Vec<u8>, WeightsError> {
        weights::to_bytes(&self.model.network, &self.learner.numbers, self.kind.name())
    }

    fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers(ITERATIONS, vec![self.iterations]);
        self.learner.save(&mut checkpoint);
        checkpoint
    }

    fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        let iterations = checkpoint.integer(ITERATIONS)?;
        self.learner.load(checkpoint)?;
        self.iterations = iterations;
        Ok(())
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
}

/// A way to learn, with all that it depends on.
pub trait Method: Clone + Default + Serialize + DeserializeOwned {
    /// Name of the training, as `chaic train` takes it.
    const KIND: &'static str;
    /// Bounds of every number.
    const BOUNDS: BoundTable;

    /// What all ways to learn have.
    fn course(&self) -> Course<'_>;

    /// Does an iteration of a helper who sees by this; `None` if `stop` is raised meanwhile.
    fn learn(
        &self,
        sight: &dyn Sight,
        learning: &mut Learning,
        stop: &AtomicBool,
    ) -> Option<Figures>;
}

/// A policy that is trained in a folder of its own.
pub struct PolicyTraining<M> {
    method: M,
    sight: Arc<dyn Sight>,
    learning: Learning,
}

impl<M: Method> Training for PolicyTraining<M> {
    type Rules = M;
    const KIND: &'static str = M::KIND;
    const BOUNDS: BoundTable = M::BOUNDS;
    const WEIGHTS: &'static str = "policy.safetensors";
    const RECORD_STEPS: u64 = 1;
    const CHECKPOINT_STEPS: u64 = 5;
    const VALIDATION_STEPS: u64 = 25;

    fn new(
        method: &M,
        _: &Path,
        _: &mut dyn FnMut(&str),
        _: &AtomicBool,
    ) -> Result<Option<PolicyTraining<M>>, TrainingError> {
        let Course { seed, shards, play, .. } = method.course();
        let sight = play.sight().map_err(TrainingError::of_data)?;
        let opponent = play.read_opponent()?;
        let learning = Learning::new(seed, shards, opponent.as_ref());
        Ok(Some(PolicyTraining { method: method.clone(), sight, learning }))
    }

    fn check(method: &M) -> Result<(), String> {
        method.course().play.check()
    }

    fn read_weights(method: &M, weights: &[u8]) -> Result<Vec<f32>, WeightsError> {
        let has_opponent = method.course().play.opponent.is_some();
        let kind = if has_opponent { Kind::WithOpponent } else { Kind::Plain };
        weights::from_bytes(&kind.network().network, weights, kind.name())
    }

    fn network(&self) -> &Network {
        &self.learning.model.network
    }

    fn steps(&self) -> u64 {
        self.method.course().iterations
    }

    fn taken(&self) -> u64 {
        self.learning.iterations
    }

    fn checkpoint(&self) -> Checkpoint {
        self.learning.checkpoint()
    }

    fn begin_with(&mut self, numbers: Vec<f32>) {
        self.learning.learner.begin_with(numbers);
    }

    fn resume(
        &mut self,
        checkpoint: &Checkpoint,
        _: &AtomicBool,
    ) -> Result<Option<()>, CheckpointError> {
        self.learning.resume(checkpoint).map(Some)
    }

    fn step(&mut self, stop: &AtomicBool) -> Option<Figures> {
        let before = self.learning.learner.state();
        let figures = self.method.learn(&*self.sight, &mut self.learning, stop);
        match figures {
            Some(_) => self.learning.iterations += 1,
            None => self.learning.learner.set_state(before),
        }
        figures
    }

    fn validate(&self, stop: &AtomicBool) -> Result<Option<(Figures, Vec<u8>)>, WeightsError> {
        let weights = self.learning.weights()?;
        let trained = self.learning.trained();
        let figures = self.method.course().play.validate(&*self.sight, &trained, stop);
        Ok(figures.map(|figures| (figures, weights)))
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
    const KIND: &'static str = "ppo";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("iterations", STEPS),
        ("play", Bound::Table(PLAY_BOUNDS)),
        ("ppo", Bound::Table(PPO_BOUNDS)),
    ];

    fn course(&self) -> Course<'_> {
        let Reinforcement { seed, iterations, play, .. } = self;
        Course { seed: *seed, iterations: *iterations, play, shards: self.ppo.shards }
    }

    fn learn(
        &self,
        sight: &dyn Sight,
        learning: &mut Learning,
        stop: &AtomicBool,
    ) -> Option<Figures> {
        let ids = self.play.episodes_of(self.seed, learning.iterations);
        let rollout = self.play.rollout(sight, Choosing::Sampled, stop);
        let played = play_all(&ids, &learning.trained(), &rollout);
        let played = played.expect("generated episodes can be played")?;
        let tr = mean_tr(&played);
        let frames = played.iter().map(|p| f64::from(p.frames)).sum();
        let trajectories: Vec<_> = played.into_iter().map(|p| p.trajectory).collect();
        let decisions: usize = trajectories.iter().map(|t| t.transitions.len()).sum();
        let rest = 1.0 - learning.iterations as f32 / self.iterations as f32;
        let named = (self.seed, learning.iterations, rest);
        let Learning { model, learner, .. } = learning;
        let told = improve(&self.ppo, model, learner, &trajectories, named, stop)?;
        if self.play.normalize {
            let all = trajectories.iter().flat_map(|t| &t.transitions);
            learning.normalize_by(all.map(|t| &t.decision));
        }
        let Told { objective, value_loss, entropy, divergence, clipped, explained_variance } = told;
        Some(figures([
            ("tr", tr),
            ("frames", frames),
            ("decisions", decisions as f64),
            ("objective", objective),
            ("value_loss", value_loss),
            ("entropy", entropy),
            ("divergence", divergence),
            ("clipped", clipped),
            ("explained_variance", explained_variance),
        ]))
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
    const KIND: &'static str = "clone";
    const BOUNDS: BoundTable = &[
        ("seed", SEED),
        ("iterations", STEPS),
        ("play", Bound::Table(PLAY_BOUNDS)),
        ("mixed", SHARE),
        ("discount", SHARE),
        ("batch", integer(1, MAX_BATCH)),
        ("rate", RATE),
        ("shards", SHARDS),
        ("adam", ADAM),
    ];

    fn course(&self) -> Course<'_> {
        let Cloning { seed, iterations, play, shards, .. } = self;
        Course { seed: *seed, iterations: *iterations, play, shards: *shards }
    }

    fn learn(
        &self,
        sight: &dyn Sight,
        learning: &mut Learning,
        stop: &AtomicBool,
    ) -> Option<Figures> {
        let ids = self.play.episodes_of(self.seed, learning.iterations);
        let rollout = self.play.rollout(sight, Choosing::Sampled, stop);
        let trained = learning.trained();
        let taught = |(id, seed): &(String, u32)| {
            play_taught((id, *seed), &trained, &rollout, (self.mixed, self.discount))
        };
        let taught: Result<Vec<_>, _> = ids.par_iter().map(taught).collect();
        let taught = taught.expect("generated episodes can be played");
        let taught: Vec<_> = taught.into_iter().collect::<Option<_>>()?;
        let tr = taught.iter().map(|(_, tr)| tr).sum::<f64>() / taught.len().max(1) as f64;
        let lessons: Vec<Lesson> = taught.into_iter().flat_map(|(lessons, _)| lessons).collect();
        let rate = rate_at(learning.iterations, (self.rate, 1, self.iterations));
        let how = (&self.adam, rate, self.batch);
        let Learning { model, learner, iterations, .. } = learning;
        let learned = imitate(how, model, learner, &lessons, (self.seed, *iterations), stop)?;
        if self.play.normalize {
            learning.normalize_by(lessons.iter().map(|l| &l.decision));
        }
        let Learned { loss, agreement, value_loss } = learned;
        Some(figures([
            ("tr", tr),
            ("lessons", lessons.len() as f64),
            ("loss", loss),
            ("agreement", agreement),
            ("value_loss", value_loss),
        ]))
    }
}
