//! Demonstrations of partners: their choices in episodes, with the inputs of a network that imitates them.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::PlanningAgent;
use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::partner_grants;
use chaic_agents::partners::PartnerHabits;
use chaic_agents::policies::{PartnerVariantPolicy, RecordedPolicy};
use chaic_core::{AgentError, Briefing, Frame, Observation};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, find};
use chaic_env::recording::Recording;
use chaic_env::rules::RuleSet;
use chaic_env::{AdvanceOutcome, Env, EpisodeAgents, EpisodeConfig};
use chaic_episodes::find_episode;

use super::features::PartnerEncoder;
use crate::candidate_scorer::CandidateSet;
use crate::rollout::RolloutError;

/// Recorded choice of a partner among several plans.
#[derive(Clone, Debug, PartialEq)]
pub struct PartnerDecision {
    /// Features of the choice.
    pub observation: CandidateSet,
    /// Index of the chosen plan.
    pub action: usize,
    /// Index of the plan that the rules choose; `None` if it is no candidate.
    pub rules_action: Option<usize>,
    /// True if the partner picks up one of several targets.
    pub is_pick: bool,
}

/// Choices of one episode.
pub type DecisionLog = Arc<Mutex<Vec<PartnerDecision>>>;

/// Partner that is demonstrated in an episode.
#[derive(Clone, Debug)]
pub enum Demonstrator {
    /// Partner with these habits.
    Habits(PartnerHabits),
    /// Partner that repeats the actions of a recorded partner.
    Recorded(Recording),
}

/// Episode that demonstrates a partner.
#[derive(Clone, Debug)]
pub struct DemonstrationEpisode {
    /// Episode id.
    pub id: String,
    /// Partner.
    pub partner: Demonstrator,
    /// Name of the helper, or `none`.
    pub helper: String,
}

impl DemonstrationEpisode {
    /// Plays the episode and returns the partner's choices; `None` if it was stopped.
    ///
    /// # Errors
    /// [`RolloutError`]
    pub fn play(
        &self,
        image_size: u32,
        stop: &AtomicBool,
    ) -> Result<Option<Vec<PartnerDecision>>, RolloutError> {
        let log = DecisionLog::default();
        let partner = match &self.partner {
            Demonstrator::Habits(habits) => {
                demonstrator(PartnerVariantPolicy::new(*habits), Arc::clone(&log))
            }
            Demonstrator::Recorded(recording) => {
                demonstrator(RecordedPolicy::new(recording.plan()), Arc::clone(&log))
            }
        };
        let episode = find_episode(&self.id)?;
        let config = EpisodeConfig {
            image_size: Some(image_size),
            ..EpisodeConfig::new(&episode, &self.helper)
        };
        let helper = find(&BuiltInHelpers, &self.helper, RuleSet::PAPER.planner)?;
        let mut env = Env::new(config, EpisodeAgents::new(helper, Some(partner)))?;
        let outcome = env.run(stop, None, &mut |_| Ok::<(), AgentError>(()))?;
        let decisions = std::mem::take(&mut *log.lock().unwrap_or_else(PoisonError::into_inner));
        Ok((outcome == AdvanceOutcome::Ended).then_some(decisions))
    }
}

fn demonstrator<P: Policy>(expert: P, log: DecisionLog) -> Helper {
    let rules = RuleSet::PAPER.planner;
    let agent = Box::new(PlanningAgent::new(DemonstratorPolicy::new(expert, log), rules));
    Helper { agent, grants: partner_grants(rules) }
}

/// Policy that records the choices of another policy, and for comparison those of the rules.
struct DemonstratorPolicy<P> {
    expert: P,
    rules: PartnerVariantPolicy,
    encoder: PartnerEncoder,
    log: DecisionLog,
}

impl<P: Policy> DemonstratorPolicy<P> {
    fn new(expert: P, log: DecisionLog) -> DemonstratorPolicy<P> {
        let rules = PartnerVariantPolicy::new(PartnerHabits::RULES);
        DemonstratorPolicy { expert, rules, encoder: PartnerEncoder::default(), log }
    }
}

impl<P: Policy> Policy for DemonstratorPolicy<P> {
    fn reset(&mut self, briefing: &Briefing) {
        self.expert.reset(briefing);
        self.rules.reset(briefing);
        self.encoder = PartnerEncoder::default();
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let reconsidered = self.encoder.reconsidered();
        let candidates = self.encoder.candidates(valid);
        let plan = self.expert.choose(context, valid)?;
        let rules_plan = self.rules.choose(context, valid)?;
        // If the new plan does not supersede the current plan, the partner continues the current
        // plan.
        let continued = |policy: &dyn Fn(&Plan, &Plan) -> bool, plan: Plan| {
            reconsidered.filter(|current| !policy(&plan, current)).unwrap_or(plan)
        };
        let adopted = continued(&|new, current| self.expert.supersedes(new, current), plan);
        let rules_plan = continued(&|new, current| new.supersedes(current), rules_plan);
        let index = |plan: Plan| candidates.iter().position(|candidate| *candidate == plan);
        let action = index(adopted);
        if let Some(action) = action.filter(|_| candidates.len() > 1) {
            let is_target = |plan: &Plan| matches!(plan, Plan::PickUp(_));
            let n_targets = candidates.iter().filter(|plan| is_target(plan)).count();
            let decision = PartnerDecision {
                observation: self.encoder.encode(context, &candidates),
                action,
                rules_action: index(rules_plan),
                is_pick: is_target(&candidates[action]) && n_targets > 1,
            };
            self.log.lock().unwrap_or_else(PoisonError::into_inner).push(decision);
        }
        self.encoder.record(adopted, context.memory.frame);
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        let is_due = self.expert.reconsiders(context, current, has_changed);
        self.encoder.set_reconsidered(is_due.then_some(*current));
        is_due
    }

    fn supersedes(&self, new: &Plan, current: &Plan) -> bool {
        self.expert.supersedes(new, current)
    }

    fn observe(&mut self, observation: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        self.expert.observe(observation, memory, behavior);
    }

    fn thinking_frames(&self) -> Frame {
        self.expert.thinking_frames()
    }

    fn memory_frames(&self) -> Option<Frame> {
        self.expert.memory_frames()
    }
}
