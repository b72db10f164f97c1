//! Learning from a teacher (behavior cloning), and from what it says of one's own mistakes (DAgger, Ross et al. 2011).
//!
//! The teacher follows the oracle's rules and is told the goal, but sees, remembers and is granted no more than the
//! helper that learns: so that what it does can be told from what the helper knows, as far as it can.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::policies::{RulePolicy, RuleProfile};
use chaic_core::briefing::Goal;
use chaic_core::geom::math;
use chaic_core::rng::Stream;
use chaic_core::{AgentError, Briefing, Observation};
use chaic_nn::AdamRules;
use chaic_training::Learner;

use crate::actor_critic::{BySaid, Said, step};
use crate::choice_network::{ChoiceNetwork, Decision};
use crate::features::Features;
use crate::opponent::network::OpponentModel;
use crate::policy::{LearnedPolicy, Noted, Notes};

/// Who drives the mind whose choices the teacher tells.
pub enum Driver {
    /// The teacher itself.
    Teacher,
    /// Who learns from it.
    Learner(Box<LearnedPolicy>),
}

/// Notes what the teacher would choose.
pub struct Teacher {
    rules: RulePolicy,
    goal: Goal,
    driver: Driver,
    notes: Notes,
    features: Features,
}

impl Teacher {
    /// A teacher who knows this goal, of those who learn with what this opponent model tells, if there is one.
    pub fn new(
        goal: Goal,
        driver: Driver,
        opponent: Option<Arc<OpponentModel>>,
        notes: Notes,
    ) -> Teacher {
        let rules = RulePolicy::new(RuleProfile::ORACLE);
        Teacher { rules, goal, driver, notes, features: Features::new(opponent) }
    }
}

impl Policy for Teacher {
    fn reset(&mut self, briefing: &Briefing) {
        Policy::reset(&mut self.rules, briefing);
        self.features.reset(briefing);
        if let Driver::Learner(learner) = &mut self.driver {
            learner.reset(briefing);
        }
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let is_under_way = self.features.choices.is_under_way();
        let offered = self.features.choices.offered(valid);
        let decision = self.features.decision(context, &offered);
        let mut told = context.briefing.clone();
        told.goal = Some(self.goal.clone());
        let taught = self.rules.choose(&Context { briefing: &told, ..*context }, valid)?;
        let plan = match &mut self.driver {
            Driver::Teacher => taught,
            Driver::Learner(learner) => learner.choose(context, valid)?,
        };
        let frame = context.memory.frame;
        self.features.choices.note(plan, frame);
        // What makes no room for what is under way comes to going on with it.
        let goes_on = if is_under_way { Some(0) } else { None };
        let choice = offered.iter().position(|plan| *plan == taught).or(goes_on);
        // What isn't among the choices, like waiting, can't be learned.
        if let Some(choice) = choice.filter(|_| offered.len() > 1) {
            let noted = Noted { frame, decision, choice, log_probability: 0.0, value: 0.0 };
            self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(noted);
        }
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        if let Driver::Learner(learner) = &mut self.driver {
            learner.reconsiders(context, current, is_news);
        }
        // When the learner would, so that both decide at the same moments.
        self.features.choices.is_due(context.memory.frame, current, is_news)
    }

    fn look(&mut self, observation: &Observation, memory: &Memory, behavior: &BehaviorLog) {
        self.features.look(memory);
        if let Driver::Learner(learner) = &mut self.driver {
            learner.look(observation, memory, behavior);
        }
    }
}

/// A choice that the teacher told, and the return that followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesson {
    /// What was known.
    pub decision: Decision,
    /// What the teacher chose.
    pub choice: usize,
    /// The return from there on.
    pub target: f32,
}

/// What learning lessons was like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learned {
    /// Mean cross entropy of the teacher's choices, nats.
    pub loss: f64,
    /// Share of them that the network would have made.
    pub agreement: f64,
    /// Mean squared error of values, halved.
    pub value_loss: f64,
}

/// Looks at each lesson once, in an order of the iteration's own. Returns `None` if `stop` is raised meanwhile;
/// some steps may have been taken then.
pub fn imitate(
    (adam, rate, batch): (&AdamRules, f32, usize),
    model: &ChoiceNetwork,
    learner: &mut Learner,
    lessons: &[Lesson],
    (seed, iteration): (u64, u64),
    stop: &AtomicBool,
) -> Option<Learned> {
    let mut order: Vec<usize> = (0..lessons.len()).collect();
    Stream::new(seed, "lessons", iteration).shuffle(&mut order);
    let mut sum = Learned::default();
    for batch in order.chunks(batch) {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let batch: Vec<&Lesson> = batch.iter().map(|k| &lessons[*k]).collect();
        let parts = step(model, (&mut *learner, adam, rate), &batch, |l| &l.decision, gradient);
        for learned in parts {
            sum.loss += learned.loss;
            sum.agreement += learned.agreement;
            sum.value_loss += learned.value_loss;
        }
    }
    let n = lessons.len().max(1) as f64;
    let (loss, agreement) = (sum.loss / n, sum.agreement / n);
    Some(Learned { loss, agreement, value_loss: sum.value_loss / n })
}

/// The gradient of the loss of one lesson; adds what it was like to `learned`.
fn gradient(lesson: &Lesson, said: &Said, share: f32, learned: &mut Learned) -> BySaid {
    let error = said.value() - lesson.target;
    learned.loss -= f64::from(said.log_probabilities[lesson.choice]);
    learned.agreement += f64::from(u8::from(said.most_likely() == lesson.choice));
    learned.value_loss += f64::from(0.5 * error * error);
    let taught = |k: usize| f32::from(u8::from(k == lesson.choice));
    let logits = said.log_probabilities.iter().enumerate();
    let logits = logits.map(|(k, l)| share * (math::exp(*l) - taught(k))).collect();
    BySaid { logits, of_state: vec![0.5 * share * error] }
}

/// The driver of an episode: the learner in a share of them.
pub fn driver(mixed: f32, rng: &mut Stream, learner: impl FnOnce() -> LearnedPolicy) -> Driver {
    if rng.chance(mixed) { Driver::Learner(Box::new(learner())) } else { Driver::Teacher }
}
