//! A whole mind: perceives, remembers, infers, decides, acts.

use std::collections::BTreeMap;

use chaic_protocol::agent::Thought;
use chaic_protocol::observation::Senses;
use chaic_protocol::{Action, Agent, Briefing, EntityId, Observation};

use crate::behavior::{BehaviorModel, GroundTruthBehavior};
use crate::decision::{Context, Plan, Policy, valid_plans};
use crate::execution::interact::learn;
use crate::execution::{Executor, Progress, Situation};
use crate::memory::Memory;
use crate::perception::{GroundTruthIds, Perception};
use crate::rules::PlannerRules;

/// So many plans may end without an action within one decision; then one waits for a moment.
const MAX_PLANS: usize = 6;
/// How long that moment is, frames.
const PAUSE_FRAMES: u32 = 5;

/// A mind whose plans are chosen by a policy. Partners and helpers are both of this kind.
pub struct Mind<P: Policy> {
    perception: Box<dyn Perception>,
    behavior: Box<dyn BehaviorModel>,
    policy: P,
    senses: Senses,
    rules: PlannerRules,
    episode: Option<Episode>,
}

/// What lasts for one episode.
struct Episode {
    briefing: Briefing,
    memory: Memory,
    executor: Executor,
    plan: Option<Plan>,
    news: u32,
    held: Vec<EntityId>,
}

impl<P: Policy> Mind<P> {
    /// A mind with perfect segmentation that knows of the others' doings what it is granted.
    pub fn new(policy: P, rules: PlannerRules) -> Mind<P> {
        let behavior = Box::new(GroundTruthBehavior::default());
        Mind::with(policy, Box::new(GroundTruthIds), behavior, rules)
    }

    /// A mind made of the given parts.
    pub fn with(
        policy: P,
        perception: Box<dyn Perception>,
        behavior: Box<dyn BehaviorModel>,
        rules: PlannerRules,
    ) -> Mind<P> {
        let senses = Senses::DEPTH_AND_IDS;
        Mind { perception, behavior, policy, senses, rules, episode: None }
    }

    /// The same mind with other senses: smaller images, or color for a learned perception.
    pub fn with_senses(mut self, senses: Senses) -> Mind<P> {
        self.senses = senses;
        self
    }

    /// The plan it follows.
    pub fn plan(&self) -> Option<Plan> {
        self.episode.as_ref()?.plan
    }

    /// What it remembers of the present episode.
    pub fn memory(&self) -> Option<&Memory> {
        self.episode.as_ref().map(|e| &e.memory)
    }

    /// Its policy.
    pub fn policy(&self) -> &P {
        &self.policy
    }
}

impl Episode {
    fn new(briefing: &Briefing, rules: PlannerRules) -> Episode {
        Episode {
            briefing: briefing.clone(),
            memory: Memory::new(briefing, rules),
            executor: Executor::new(briefing),
            plan: None,
            news: 0,
            held: Vec::new(),
        }
    }

    fn context<'a>(
        &'a self,
        behavior: &'a dyn BehaviorModel,
        observation: &'a Observation,
    ) -> Context<'a> {
        Context {
            briefing: &self.briefing,
            memory: &self.memory,
            behavior: behavior.log(),
            own: &observation.own,
            is_explored: self.executor.is_explored(),
        }
    }

    /// Takes in the observation and what it says of the last action.
    fn take_in(&mut self, observation: &Observation, perception: &mut dyn Perception) {
        if let Some(goal) = &observation.granted.goal {
            self.briefing.goal.get_or_insert_with(|| goal.clone());
        }
        let percepts = perception.perceive(observation);
        self.memory.update(&self.briefing, observation, &percepts);
        let holds: Vec<EntityId> = observation
            .own
            .held()
            .flat_map(|h| std::iter::once(h.entity).chain(h.contents.iter().map(|(e, _)| *e)))
            .collect();
        if let Some(last) = observation.own.last {
            let knows = observation.delivered.is_some();
            learn(&mut self.memory, &self.briefing, last, &self.held, &holds, knows);
        }
        self.held = holds;
    }

    /// Lets the policy choose; `None` if it sticks to the current plan.
    fn choose<P: Policy>(
        &mut self,
        policy: &mut P,
        behavior: &dyn BehaviorModel,
        observation: &Observation,
    ) -> Option<Plan> {
        let news = self.memory.things.news();
        if let Some(current) = self.plan {
            let context = self.context(behavior, observation);
            if !policy.reconsiders(&context, &current, news != self.news) {
                return None;
            }
        }
        self.news = news;
        self.memory.refresh();
        let context = self.context(behavior, observation);
        let valid = valid_plans(&self.memory, &observation.own, &self.briefing);
        let chosen = policy.choose(&context, &valid);
        match self.plan {
            Some(current) if !chosen.supersedes(&current) => None,
            _ => Some(chosen),
        }
    }
}

impl<P: Policy> Agent for Mind<P> {
    fn senses(&self) -> Senses {
        self.senses
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.policy.reset(briefing);
        self.behavior.reset();
        self.episode = Some(Episode::new(briefing, self.rules));
    }

    fn act(&mut self, observation: &Observation) -> Action {
        let pause = Action::Wait { frames: PAUSE_FRAMES };
        let Some(episode) = self.episode.as_mut() else { return pause };
        episode.take_in(observation, self.perception.as_mut());
        self.behavior.watch(observation, &episode.memory);
        self.policy.look(observation);
        for _ in 0..MAX_PLANS {
            let chosen = episode.choose(&mut self.policy, self.behavior.as_ref(), observation);
            if let Some(plan) = chosen {
                let thinking = self.policy.thinking_frames();
                episode.executor.begin(episode.memory.frame + thinking);
                episode.plan = Some(plan);
                if thinking > 0 {
                    return Action::Wait { frames: thinking };
                }
            }
            let Some(plan) = episode.plan else { return pause };
            let mut situation = Situation {
                memory: &mut episode.memory,
                own: &observation.own,
                briefing: &episode.briefing,
            };
            match episode.executor.step(&plan, &mut situation) {
                Progress::Act(action) => return action,
                Progress::Done | Progress::Failed => episode.plan = None,
            }
        }
        pause
    }

    fn thought(&self) -> Thought {
        Thought {
            plan: self.plan().map_or_else(|| "think".to_owned(), |plan| plan.to_string()),
            mood: self.policy.mood(),
        }
    }

    fn counts(&self) -> BTreeMap<String, u64> {
        self.policy.counts()
    }
}

#[cfg(test)]
mod tests;
