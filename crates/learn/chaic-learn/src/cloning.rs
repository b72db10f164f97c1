//! Behavior cloning of an expert, which also labels the states that the learner visits (DAgger, Ross
//! et al. 2011).
//!
//! The expert has the observations, memory and grants of the learner, and the goal if
//! [`ExpertInfo::knows_goal`] is true. [`EXPERTS`] lists the experts.

use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::policies::{FollowPolicy, InferOptions, InferPolicy, RulePolicy, RuleProfile};
use chaic_core::briefing::Goal;
use chaic_core::geom::math;
use chaic_core::rng::RngStream;
use chaic_core::{AgentError, Briefing, Observation};
use chaic_training::Learner;

use crate::actor_critic::{ActorCriticOutput, Optimizer, OutputGrad, optimizer_step};
use crate::candidate_scorer::{CandidateScorer, CandidateSet};
use crate::features::FeatureEncoder;
use crate::policy::{LearnedPolicy, StepLog, StepRecord};

/// Expert that can be imitated.
#[derive(Clone, Copy, Debug)]
pub struct ExpertInfo {
    /// Name in configurations, equal to the name of the helper with the same rules.
    pub name: &'static str,
    /// True if the expert knows the partner's goal. Its choices then depend on information that the
    /// learner lacks, so a clone cannot perform as well.
    pub knows_goal: bool,
    /// Creates its policy.
    pub policy: fn() -> Box<dyn Policy>,
}

/// All experts: the rule-based helpers that choose among the learner's plans. The other built-in helpers
/// are no experts: `ideal_observer` and `oracle_plan` need the granted state, which the learner lacks, and
/// `random` chooses at random.
pub static EXPERTS: [ExpertInfo; 8] = [
    ExpertInfo { name: "infer", knows_goal: false, policy: || infer(InferOptions::ALL) },
    ExpertInfo {
        name: "infer_no_watching",
        knows_goal: false,
        policy: || infer(InferOptions::WITHOUT_FOLLOWING),
    },
    ExpertInfo {
        name: "infer_no_planner",
        knows_goal: false,
        policy: || infer(InferOptions::NO_PLANNER),
    },
    ExpertInfo {
        name: "infer_no_constraint",
        knows_goal: false,
        policy: || infer(InferOptions::NO_CONSTRAINT),
    },
    ExpertInfo { name: "infer_known_goal", knows_goal: true, policy: || infer(InferOptions::ALL) },
    ExpertInfo { name: "follow", knows_goal: false, policy: || Box::<FollowPolicy>::default() },
    ExpertInfo {
        name: "rhp",
        knows_goal: false,
        policy: || Box::new(RulePolicy::new(RuleProfile::RHP)),
    },
    ExpertInfo {
        name: "oracle",
        knows_goal: true,
        policy: || Box::new(RulePolicy::new(RuleProfile::ORACLE)),
    },
];

fn infer(options: InferOptions) -> Box<dyn Policy> {
    Box::new(InferPolicy::new(options))
}

impl ExpertInfo {
    /// Returns the expert with this name.
    pub fn find_expert(name: &str) -> Option<&'static ExpertInfo> {
        EXPERTS.iter().find(|expert| expert.name == name)
    }
}

/// Policy that drives the agent during a rollout.
pub enum RolloutActor {
    /// The expert, with the encoder of the learner's inputs.
    Expert(Box<FeatureEncoder>),
    /// The learner; the expert labels its states.
    Learner(Box<LearnedPolicy>),
}

impl RolloutActor {
    /// Encoder of the learner's inputs.
    fn features(&mut self) -> &mut FeatureEncoder {
        match self {
            RolloutActor::Expert(features) => features,
            RolloutActor::Learner(learner) => learner.features(),
        }
    }
}

/// Policy that records the expert's choices.
pub struct ExpertPolicy {
    expert: Box<dyn Policy>,
    /// Goal, if the expert knows it.
    goal: Option<Goal>,
    actor: RolloutActor,
    log: StepLog,
}

impl ExpertPolicy {
    /// Creates a policy that records the choices of this expert. `goal` is the partner's goal, for
    /// experts that know it.
    pub fn new(
        expert: &ExpertInfo,
        goal: &Goal,
        actor: RolloutActor,
        log: StepLog,
    ) -> ExpertPolicy {
        let goal = expert.knows_goal.then(|| goal.clone());
        ExpertPolicy { expert: (expert.policy)(), goal, actor, log }
    }

    /// Returns the expert's briefing if it differs from the learner's.
    fn expert_briefing(&self, briefing: &Briefing) -> Option<Briefing> {
        let goal = self.goal.clone()?;
        Some(Briefing { goal: Some(goal), ..briefing.clone() })
    }
}

impl Policy for ExpertPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        let granted = self.expert_briefing(briefing);
        self.expert.reset(granted.as_ref().unwrap_or(briefing));
        match &mut self.actor {
            RolloutActor::Expert(features) => features.reset(briefing),
            RolloutActor::Learner(learner) => learner.reset(briefing),
        }
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let features = self.actor.features();
        let reconsidered = features.history.reconsidered();
        let candidates = features.history.candidates(valid);
        // A single candidate is no decision.
        let decision = (candidates.len() > 1).then(|| features.encode(context, valid, &candidates));
        let granted = self.expert_briefing(context.briefing);
        let briefing = granted.as_ref().unwrap_or(context.briefing);
        let expert_plan = self.expert.choose(&Context { briefing, ..*context }, valid)?;
        // If the expert's plan does not replace the current one, the label is to continue.
        let continues =
            reconsidered.is_some_and(|current| !self.expert.supersedes(&expert_plan, &current));
        let chosen = candidates.iter().position(|plan| *plan == expert_plan);
        let action = if continues { Some(0) } else { chosen };
        let frame = context.memory.frame;
        let plan = match (&mut self.actor, &decision) {
            (RolloutActor::Learner(learner), Some(decision)) => {
                learner.choose_among(&candidates, decision.clone(), frame)
            }
            (RolloutActor::Learner(learner), None) => learner.choose(context, valid)?,
            (RolloutActor::Expert(features), _) => {
                // The learner's history has the plan that the agent executes.
                let adopted = reconsidered.filter(|_| continues).unwrap_or(expert_plan);
                features.record(adopted, action, frame);
                expert_plan
            }
        };
        // Plans outside the candidates, such as waiting, cannot be learned.
        if let (Some(action), Some(observation)) = (action, decision) {
            let record = StepRecord { frame, observation, action, log_prob: 0.0, value: 0.0 };
            self.log.lock().unwrap_or_else(PoisonError::into_inner).push(record);
        }
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        let granted = self.expert_briefing(context.briefing);
        match &mut self.actor {
            RolloutActor::Learner(learner) => learner.reconsiders(context, current, has_changed),
            RolloutActor::Expert(features) => {
                let briefing = granted.as_ref().unwrap_or(context.briefing);
                let context = Context { briefing, ..*context };
                let is_due = self.expert.reconsiders(&context, current, has_changed);
                features.history.set_reconsidered(is_due.then_some(*current));
                is_due
            }
        }
    }

    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        match &self.actor {
            RolloutActor::Expert(_) => self.expert.supersedes(new, current),
            RolloutActor::Learner(learner) => learner.supersedes(new, current),
        }
    }

    fn goal_place_min_top_m(&self, memory: &Memory) -> Option<f32> {
        match &self.actor {
            RolloutActor::Expert(features) => features.goal_place_min_top_m(memory),
            RolloutActor::Learner(learner) => learner.goal_place_min_top_m(memory),
        }
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        self.expert.observe(observation, memory, behavior);
        match &mut self.actor {
            RolloutActor::Expert(features) => features.observe(observation, memory, behavior),
            RolloutActor::Learner(learner) => learner.observe(observation, memory, behavior),
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

/// Settings of the optimizer steps of one iteration.
#[derive(Clone, Copy, Debug)]
pub struct FitConfig<'a> {
    /// Optimizer.
    pub optimizer: Optimizer<'a>,
    /// Label smoothing: probability mass that is spread evenly over all candidates.
    pub label_smoothing: f32,
    /// Number of optimizer steps.
    pub n_steps: usize,
    /// Demonstrations per optimizer step.
    pub batch_size: usize,
    /// Seed of the batches.
    pub seed: u64,
    /// Index of the iteration, which selects the batches.
    pub iteration: u64,
}

/// Fits the network to the demonstrations of these episodes. Each demonstration of a batch is drawn
/// from a random episode, so that episodes count equally. Returns `None` if `stop` is raised; some
/// steps may have been taken.
pub fn fit(
    config: &FitConfig<'_>,
    model: &CandidateScorer,
    learner: &mut Learner,
    episodes: &[&[Demonstration]],
    stop: &AtomicBool,
) -> Option<CloningMetrics> {
    let FitConfig { optimizer, label_smoothing, n_steps, batch_size, seed, iteration } = *config;
    let episodes: Vec<&[Demonstration]> =
        episodes.iter().copied().filter(|episode| !episode.is_empty()).collect();
    let mut rng = RngStream::new(seed, "demonstrations", iteration);
    let mut sum = CloningMetrics::default();
    let n_steps = if episodes.is_empty() { 0 } else { n_steps };
    for _ in 0..n_steps {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let mut draw = || {
            let episode = episodes[rng.below(episodes.len())];
            &episode[rng.below(episode.len())]
        };
        let batch: Vec<&Demonstration> = (0..batch_size).map(|_| draw()).collect();
        let shards = optimizer_step(
            model,
            learner,
            optimizer,
            &batch,
            |demonstration| &demonstration.observation,
            |demonstration, output, weight, metrics| {
                gradient(demonstration, label_smoothing, output, weight, metrics)
            },
            |_| true,
        );
        for stats in shards {
            sum.loss += stats.loss;
            sum.agreement += stats.agreement;
            sum.value_loss += stats.value_loss;
        }
    }
    let n = (n_steps * batch_size).max(1) as f64;
    let (loss, agreement) = (sum.loss / n, sum.agreement / n);
    Some(CloningMetrics { loss, agreement, value_loss: sum.value_loss / n })
}

/// Returns the gradient of the loss of one demonstration times `weight`, and adds its metrics.
fn gradient(
    demonstration: &Demonstration,
    label_smoothing: f32,
    output: &ActorCriticOutput,
    weight: f32,
    metrics: &mut CloningMetrics,
) -> OutputGrad {
    let error = output.value() - demonstration.value_target;
    metrics.loss -= f64::from(output.log_probs[demonstration.action]);
    metrics.agreement += f64::from(u8::from(output.argmax() == demonstration.action));
    metrics.value_loss += f64::from(0.5 * error * error);
    let uniform = label_smoothing / output.log_probs.len() as f32;
    let label = |k: usize| {
        uniform + (1.0 - label_smoothing) * f32::from(u8::from(k == demonstration.action))
    };
    let logits = output.log_probs.iter().enumerate();
    let logits = logits.map(|(k, l)| weight * (math::exp(*l) - label(k))).collect();
    OutputGrad { logits, values: vec![0.5 * weight * error] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chaic_agents::{HelperInfo, PlannerRules};
    use chaic_nn::AdamWConfig;

    #[test]
    fn experts_are_built_in_helpers_with_the_same_knowledge() {
        for ExpertInfo { name, knows_goal, .. } in &EXPERTS {
            let helper = HelperInfo::find_helper(name).unwrap();
            let grants = (helper.grants)(PlannerRules::paper());
            assert!(grants.goal == *knows_goal && !grants.state, "{name}");
        }
    }

    #[test]
    fn a_long_episode_weighs_as_much_as_a_short_one() {
        let model = CandidateScorer::new(3, 2, 16, 1);
        let mut learner = Learner::new(&model.network, 1, 2);
        let demonstration = |action| Demonstration {
            observation: CandidateSet {
                state: vec![0.5; 3],
                candidates: vec![0.1, 0.2, 0.8, 0.9],
                n_candidates: 2,
                memory: Vec::new(),
            },
            action,
            value_target: 0.0,
        };
        let (short, long) = (vec![demonstration(0)], vec![demonstration(1); 99]);
        let adam = AdamWConfig::default();
        let config = FitConfig {
            // Without a learning rate, the network prefers the same candidate in all steps.
            optimizer: Optimizer { adam: &adam, learning_rate: 0.0 },
            label_smoothing: 0.0,
            n_steps: 50,
            batch_size: 40,
            seed: 1,
            iteration: 0,
        };
        let stop = AtomicBool::new(false);
        let episodes = [&short[..], &[], &long[..]];
        let metrics = fit(&config, &model, &mut learner, &episodes, &stop).unwrap();
        // The standard deviation is 0.011.
        assert!((metrics.agreement - 0.5).abs() < 0.06, "{metrics:?}");
    }
}
