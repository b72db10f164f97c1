//! Behavior cloning with an expert that labels the learner's states (DAgger, Ross et al. 2011).
//!
//! The expert follows the oracle's rules and knows the goal. It has the observations, memory and
//! grants of the learner, so most of its choices are predictable from what the learner knows.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::policies::{RulePolicy, RuleProfile};
use chaic_core::briefing::Goal;
use chaic_core::geom::math;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, Briefing, Observation};
use chaic_nn::AdamWConfig;
use chaic_training::Learner;

use crate::actor_critic::{ActorCriticOutput, OutputGrad, optimizer_step};
use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::features::FeatureEncoder;
use crate::opponent::network::OpponentModel;
use crate::policy::{LearnedPolicy, StepLog, StepRecord};

/// Policy that drives the agent during a rollout.
pub enum RolloutActor {
    /// The expert.
    Expert,
    /// The learner; the expert labels its states.
    Learner(Box<LearnedPolicy>),
}

/// Policy that records the expert's choices.
pub struct ExpertPolicy {
    rule_policy: RulePolicy,
    goal: Goal,
    actor: RolloutActor,
    log: StepLog,
    features: FeatureEncoder,
}

impl ExpertPolicy {
    /// Creates an expert that knows this goal. The recorded features include the predictions of the
    /// opponent model, if there is one.
    pub fn new(
        goal: Goal,
        actor: RolloutActor,
        opponent: Option<Arc<OpponentModel>>,
        log: StepLog,
    ) -> ExpertPolicy {
        let rule_policy = RulePolicy::new(RuleProfile::ORACLE);
        ExpertPolicy { rule_policy, goal, actor, log, features: FeatureEncoder::new(opponent) }
    }
}

impl Policy for ExpertPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        Policy::reset(&mut self.rule_policy, briefing);
        self.features.reset(briefing);
        if let RolloutActor::Learner(learner) = &mut self.actor {
            learner.reset(briefing);
        }
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let is_reconsidering = self.features.history.is_reconsidering();
        let candidates = self.features.history.candidates(valid);
        let decision = self.features.encode(context, &candidates);
        let mut briefing = context.briefing.clone();
        briefing.goal = Some(self.goal.clone());
        let expert_plan =
            self.rule_policy.choose(&Context { briefing: &briefing, ..*context }, valid)?;
        let plan = match &mut self.actor {
            RolloutActor::Expert => expert_plan,
            RolloutActor::Learner(learner) => learner.choose(context, valid)?,
        };
        let frame = context.memory.frame;
        self.features.history.record(plan, frame);
        // If the expert's plan does not supersede the current one, the label is to continue.
        let continue_action = if is_reconsidering { Some(0) } else { None };
        let action = candidates.iter().position(|plan| *plan == expert_plan).or(continue_action);
        // Plans outside the candidates, such as waiting, cannot be learned.
        if let Some(action) = action.filter(|_| candidates.len() > 1) {
            let record =
                StepRecord { frame, observation: decision, action, log_prob: 0.0, value: 0.0 };
            self.log.lock().unwrap_or_else(PoisonError::into_inner).push(record);
        }
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        if let RolloutActor::Learner(learner) = &mut self.actor {
            learner.reconsiders(context, current, is_news);
        }
        // At the frames at which the learner would decide.
        self.features.history.is_due(context.memory.frame, current, is_news)
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        self.features.observe(memory);
        if let RolloutActor::Learner(learner) = &mut self.actor {
            learner.observe(observation, memory, behavior);
        }
    }
}

/// Choice of the expert with the return that followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    /// Features of the decision.
    pub observation: CandidateSet,
    /// Index of the expert's choice.
    pub action: usize,
    /// Discounted return from this decision on.
    pub value_target: f32,
}

/// Metrics of one epoch of behavior cloning.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CloningMetrics {
    /// Mean cross entropy of the expert's choices, nats.
    pub loss: f64,
    /// Fraction of the expert's choices that the network ranks first.
    pub agreement: f64,
    /// Mean of half the squared value error.
    pub value_loss: f64,
}

/// Settings of one epoch of behavior cloning.
#[derive(Clone, Copy, Debug)]
pub struct EpochConfig<'a> {
    /// Optimizer.
    pub adam: &'a AdamWConfig,
    /// Learning rate.
    pub learning_rate: f32,
    /// Demonstrations per optimizer step.
    pub batch_size: usize,
    /// Seed of the shuffle.
    pub seed: u64,
    /// Index of the epoch, which selects the shuffle.
    pub iteration: u64,
}

/// Trains one epoch of behavior cloning; `iteration` seeds the shuffle. Returns `None` if `stop` is
/// raised; some steps may have been taken.
pub fn train_epoch(
    config: &EpochConfig<'_>,
    model: &CandidateScorer,
    learner: &mut Learner,
    demonstrations: &[Demonstration],
    stop: &AtomicBool,
) -> Option<CloningMetrics> {
    let EpochConfig { adam, learning_rate, batch_size, seed, iteration } = *config;
    let mut order: Vec<usize> = (0..demonstrations.len()).collect();
    RngStream::new(seed, "lessons", iteration).shuffle(&mut order);
    let mut sum = CloningMetrics::default();
    for batch in order.chunks(batch_size) {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let batch: Vec<&Demonstration> = batch.iter().map(|k| &demonstrations[*k]).collect();
        let shards = optimizer_step(
            model,
            learner,
            adam,
            learning_rate,
            &batch,
            |demonstration| &demonstration.observation,
            gradient,
        );
        for stats in shards {
            sum.loss += stats.loss;
            sum.agreement += stats.agreement;
            sum.value_loss += stats.value_loss;
        }
    }
    let n = demonstrations.len().max(1) as f64;
    let (loss, agreement) = (sum.loss / n, sum.agreement / n);
    Some(CloningMetrics { loss, agreement, value_loss: sum.value_loss / n })
}

/// Returns the gradient of the loss of one demonstration times `weight`, and adds its metrics.
fn gradient(
    demonstration: &Demonstration,
    output: &ActorCriticOutput,
    weight: f32,
    metrics: &mut CloningMetrics,
) -> OutputGrad {
    let error = output.value() - demonstration.value_target;
    metrics.loss -= f64::from(output.log_probs[demonstration.action]);
    metrics.agreement += f64::from(u8::from(output.argmax() == demonstration.action));
    metrics.value_loss += f64::from(0.5 * error * error);
    let label = |k: usize| f32::from(u8::from(k == demonstration.action));
    let logits = output.log_probs.iter().enumerate();
    let logits = logits.map(|(k, l)| weight * (math::exp(*l) - label(k))).collect();
    OutputGrad { logits, values: vec![0.5 * weight * error] }
}

/// Draws the actor of an episode: the learner with probability `learner_fraction`, else the expert.
pub fn sample_actor(
    learner_fraction: f32,
    rng: &mut RngStream,
    learner: impl FnOnce() -> LearnedPolicy,
) -> RolloutActor {
    if rng.chance(learner_fraction) {
        RolloutActor::Learner(Box::new(learner()))
    } else {
        RolloutActor::Expert
    }
}
