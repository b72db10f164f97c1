//! A network that drives a mind.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::sight::Sight;
use chaic_agents::{Mind, PlannerRules};
use chaic_core::observation::Grants;
use chaic_core::rng::Stream;
use chaic_core::{AgentError, AgentId, Briefing, Frame, Observation};
use chaic_env::minds::Helper;
use chaic_nn::Pass;

use crate::actor_critic::ActorCritic as _;
use crate::choice_network::{ChoiceNetwork, Decision};
use crate::features::Features;
use crate::opponent::network::OpponentModel;

/// A helper whose mind this policy drives: it is granted what the paper's helpers are, as far as `sight` needs that,
/// and watches its partner by what it sees.
pub fn drive<P: Policy>(policy: P, rules: PlannerRules, sight: &dyn Sight) -> Helper {
    let grants = sight.grants(Grants::PLANNER);
    let mind = Mind::watching(policy, rules, sight, (AgentId::PARTNER, grants));
    Helper { mind: Box::new(mind), grants }
}

/// A network with its numbers.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The network.
    pub model: ChoiceNetwork,
    /// Its numbers.
    pub numbers: Vec<f32>,
    /// The opponent model that tells it of its partner, if it needs one.
    pub opponent: Option<Arc<OpponentModel>>,
}

/// How choices are made of probabilities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choosing {
    /// By chance, as likely as the network says.
    Sampled,
    /// Always the likeliest.
    Likeliest,
}

/// A choice that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Noted {
    /// When.
    pub frame: Frame,
    /// What was known.
    pub decision: Decision,
    /// Which choice.
    pub choice: usize,
    /// The logarithm of its probability.
    pub log_probability: f32,
    /// The return that was expected.
    pub value: f32,
}

/// Choices of one episode, for those who learn from them.
pub type Notes = Arc<Mutex<Vec<Noted>>>;

/// Chooses plans as a network says.
#[derive(Clone)]
pub struct LearnedPolicy {
    trained: Arc<Trained>,
    choosing: Choosing,
    notes: Option<Notes>,
    pass: Pass,
    rng: Stream,
    features: Features,
}

impl LearnedPolicy {
    /// One that notes its choices, if somebody wants to know them.
    pub fn new(trained: Arc<Trained>, choosing: Choosing, notes: Option<Notes>) -> LearnedPolicy {
        let pass = trained.model.pass();
        let rng = Stream::new(0, "plans", 0);
        let features = Features::new(trained.opponent.clone());
        LearnedPolicy { trained, choosing, notes, pass, rng, features }
    }
}

impl Policy for LearnedPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        self.rng = Stream::new(briefing.seed, "learned policy", 0);
        self.features.reset(briefing);
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let offered = self.features.choices.offered(valid);
        let frame = context.memory.frame;
        if let [only] = offered[..] {
            self.features.choices.note(only, frame);
            return Ok(only);
        }
        let decision = self.features.decision(context, &offered);
        let Trained { model, numbers, .. } = &*self.trained;
        let said = model.forward(numbers, std::iter::once(&decision), &mut self.pass).remove(0);
        let choice = match self.choosing {
            Choosing::Sampled => said.sample(self.rng.unit()),
            Choosing::Likeliest => said.most_likely(),
        };
        let plan = offered[choice];
        self.features.choices.note(plan, frame);
        if let Some(notes) = &self.notes {
            let log_probability = said.log_probabilities[choice];
            let noted = Noted { frame, decision, choice, log_probability, value: said.value() };
            notes.lock().unwrap_or_else(PoisonError::into_inner).push(noted);
        }
        Ok(plan)
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, is_news: bool) -> bool {
        self.features.choices.is_due(context.memory.frame, current, is_news)
    }

    fn look(&mut self, _: &Observation, memory: &Memory, _: &BehaviorLog) {
        self.features.look(memory);
    }

    fn counts(&self) -> BTreeMap<String, u64> {
        let n = self.features.choices.n_of_kind.iter().map(|n| u64::from(*n)).sum();
        BTreeMap::from([("choices".to_owned(), n)])
    }

    fn fork(&self) -> Option<LearnedPolicy> {
        self.notes.is_none().then(|| self.clone())
    }
}
