//! Learning from a teacher (behavior cloning), and from what it says of one's own mistakes (DAgger, Ross et al. 2011).
//!
//! The teacher follows the oracle's rules and is told the goal, but sees, remembers and is granted no more than the
//! helper that learns: so that what it does can be told from what the helper knows, as far as it can.

use std::sync::PoisonError;

use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::policies::{RulePolicy, RuleProfile};
use chaic_nn::{AdamRules, Pass};
use chaic_protocol::briefing::Goal;
use chaic_protocol::geom::math;
use chaic_protocol::rng::Stream;
use chaic_protocol::{AgentError, Briefing};
use chaic_training::Learner;

use crate::actor_critic::{ActorCritic, BySaid, Decision, Said};
use crate::features::{Choices, decision};
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
    choices: Choices,
    /// Asked when to think again, so that teacher and learner decide at the same moments.
    clock: LearnedPolicy,
}

impl Teacher {
    /// A teacher who knows this goal; `clock` decides when a choice is due.
    pub fn new(goal: Goal, driver: Driver, clock: LearnedPolicy, notes: Notes) -> Teacher {
        let rules = RulePolicy::new(RuleProfile::ORACLE);
        Teacher { rules, goal, driver, notes, choices: Choices::default(), clock }
    }
}

impl Policy for Teacher {
    fn reset(&mut self, briefing: &Briefing) {
        Policy::reset(&mut self.rules, briefing);
        self.clock.reset(briefing);
        self.choices = Choices::default();
        if let Driver::Learner(learner) = &mut self.driver {
            learner.reset(briefing);
        }
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let decision = decision(context, valid, &self.choices);
        let mut told = context.briefing.clone();
        told.goal = Some(self.goal.clone());
        let taught = self.rules.choose(&Context { briefing: &told, ..*context }, valid)?;
        let plan = match &mut self.driver {
            Driver::Teacher => taught,
            Driver::Learner(learner) => learner.choose(context, valid)?,
        };
        self.clock.note(plan, context.memory.frame);
        self.choices.note(plan);
        // What isn't among the choices, like waiting, can't be learned.
        if let Some(choice) = valid.iter().position(|plan| *plan == taught) {
            let noted = Noted {
                frame: context.memory.frame,
                decision,
                choice,
                said: Said::certain(valid.len(), choice),
            };
            self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(noted);
        }
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        self.clock.reconsiders(context, current, is_news)
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

/// Looks at each lesson once, in an order of the iteration's own.
pub fn imitate(
    (adam, rate, batch): (&AdamRules, f32, usize),
    model: &ActorCritic,
    learner: &mut Learner,
    lessons: &[Lesson],
    (seed, iteration): (u64, u64),
) -> Learned {
    let mut order: Vec<usize> = (0..lessons.len()).collect();
    Stream::new(seed, "lessons", iteration).shuffle(&mut order);
    let mut sum = Learned::default();
    for batch in order.chunks(batch) {
        let n_shards = learner.shards();
        let of_shard = batch.len().div_ceil(n_shards);
        let work = |shard: usize, numbers: &[f32], pass: &mut Pass, by: &mut [f32]| {
            let from = (shard * of_shard).min(batch.len());
            let chosen = &batch[from..(from + of_shard).min(batch.len())];
            let part = n_shards as f32 / batch.len() as f32;
            let lessons = || chosen.iter().map(|k| &lessons[*k]);
            let said = model.forward(numbers, lessons().map(|l| &l.decision), pass);
            let mut learned = Learned::default();
            let mut by_said = Vec::with_capacity(chosen.len());
            for (lesson, said) in lessons().zip(&said) {
                let error = said.value - lesson.target;
                learned.loss -= f64::from(said.log_probabilities[lesson.choice]);
                learned.agreement += f64::from(u8::from(said.most_likely() == lesson.choice));
                learned.value_loss += f64::from(0.5 * error * error);
                let logits =
                    said.log_probabilities.iter().enumerate().map(|(k, l)| {
                        part * (math::exp(*l) - f32::from(u8::from(k == lesson.choice)))
                    });
                by_said.push(BySaid { logits: logits.collect(), value: 0.5 * part * error });
            }
            if !chosen.is_empty() {
                model.backward(numbers, &by_said, pass, by);
            }
            learned
        };
        for learned in learner.step(&model.network, (adam, rate), work) {
            sum.loss += learned.loss;
            sum.agreement += learned.agreement;
            sum.value_loss += learned.value_loss;
        }
    }
    let n = lessons.len().max(1) as f64;
    Learned { loss: sum.loss / n, agreement: sum.agreement / n, value_loss: sum.value_loss / n }
}

/// The driver of an episode: the learner in a share of them.
pub fn driver(mixed: f32, rng: &mut Stream, learner: impl FnOnce() -> LearnedPolicy) -> Driver {
    if rng.chance(mixed) { Driver::Learner(Box::new(learner())) } else { Driver::Teacher }
}
