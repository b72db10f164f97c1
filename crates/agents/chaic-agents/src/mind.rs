//! A whole mind: perceives, remembers, infers, decides, acts.

use std::collections::BTreeMap;

use chaic_core::agent::{Believed, Thought};
use chaic_core::observation::{Grants, Senses};
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, Observation, Outcome, Target};

use crate::behavior::{BehaviorModel, GroundTruthBehavior, SeenBehavior};
use crate::decision::{Context, Plan, Policy, valid_plans};
use crate::execution::interact::learn;
use crate::execution::navigate::face;
use crate::execution::{Executor, Progress, Situation};
use crate::mapping::Thing;
use crate::memory::Memory;
use crate::perception::Perception;
use crate::rules::PlannerRules;
use crate::sight::{Sight, TrueSight};
use crate::track::{Intent, TrackId, named};

/// So many plans may end without an action within one decision; then one waits for a moment.
const MAX_PLANS: usize = 6;
/// How long that moment is, frames.
const PAUSE_FRAMES: u32 = 5;
/// One who points at things acts from this near on, metres: farther off than an arm, since a level eye
/// at 1.65 m that sees 45 degrees down has the floor in view from 1.65 m on only.
const POINT_FROM_M: f32 = 2.2;
/// Decisions spent on getting a thing into view before it is left alone.
const MAX_GLANCES: u32 = 14;

/// A mind whose plans are chosen by a policy. Partners and helpers are both of this kind.
pub struct Mind<P: Policy> {
    perception: Box<dyn Perception>,
    behavior: Box<dyn BehaviorModel>,
    policy: P,
    senses: Senses,
    sees_by: Option<String>,
    rules: PlannerRules,
    episode: Option<Episode>,
}

/// By what a mind tells what this person does: by what is granted, else by what `sight` tells, else by what follows
/// from its own memory.
pub fn watcher(watched: AgentId, grants: Grants, sight: &dyn Sight) -> Box<dyn BehaviorModel> {
    if grants.behavior {
        return Box::new(GroundTruthBehavior::default());
    }
    sight.behavior(watched).unwrap_or_else(|| Box::new(SeenBehavior::of(watched)))
}

/// What lasts for one episode.
#[derive(Clone)]
struct Episode {
    briefing: Briefing,
    memory: Memory,
    executor: Executor,
    plan: Option<Plan>,
    news: u32,
    held: Vec<TrackId>,
    /// The last action as it was meant and as it was named.
    sent: Option<(Intent, Action)>,
    /// Turns made lately to get the thing that one wants to point at into view.
    n_glances: u32,
}

impl<P: Policy> Mind<P> {
    /// A mind with perfect segmentation that knows of the others' doings what it is granted.
    pub fn new(policy: P, rules: PlannerRules) -> Mind<P> {
        Mind::seeing(policy, rules, &TrueSight)
    }

    /// The same, seeing by something else, which may tell what the partner does, too.
    pub fn seeing(policy: P, rules: PlannerRules, sight: &dyn Sight) -> Mind<P> {
        let told = || Box::new(GroundTruthBehavior::default()) as Box<dyn BehaviorModel>;
        let behavior = sight.behavior(AgentId::PARTNER).unwrap_or_else(told);
        Mind::with(policy, sight.perception(), behavior, rules).with_sight(sight)
    }

    /// One that watches this person: by what is granted, else by what `sight` tells, else by what follows from its own
    /// memory.
    pub fn watching(
        policy: P,
        rules: PlannerRules,
        sight: &dyn Sight,
        (watched, grants): (AgentId, Grants),
    ) -> Mind<P> {
        let behavior = watcher(watched, grants, sight);
        Mind::with(policy, sight.perception(), behavior, rules).with_sight(sight)
    }

    /// The same mind, seeing by something else; with color if it had that before.
    pub fn with_sight(self, sight: &dyn Sight) -> Mind<P> {
        let senses = Senses { rgb: self.senses.rgb || sight.senses().rgb, ..sight.senses() };
        let Mind { policy, behavior, rules, .. } = self;
        let mind = Mind::with(policy, sight.perception(), behavior, rules);
        Mind { sees_by: sight.name(), senses, ..mind }
    }

    /// A mind made of the given parts.
    pub fn with(
        policy: P,
        perception: Box<dyn Perception>,
        behavior: Box<dyn BehaviorModel>,
        mut rules: PlannerRules,
    ) -> Mind<P> {
        if perception.points() {
            rules.pick_within_m = rules.pick_within_m.max(POINT_FROM_M);
            rules.put_within_m = rules.put_within_m.max(POINT_FROM_M);
        }
        let senses = Senses::DEPTH_AND_IDS;
        Mind { perception, behavior, policy, senses, sees_by: None, rules, episode: None }
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

    /// How an action points at a thing that it remembers; `None` if it isn't in view.
    pub fn target(&self, track: TrackId) -> Option<Target> {
        self.perception.target(track)
    }

    /// Its policy.
    pub fn policy(&self) -> &P {
        &self.policy
    }

    /// Its policy, for those who tell it what to choose.
    pub fn policy_mut(&mut self) -> &mut P {
        &mut self.policy
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
            sent: None,
            n_glances: 0,
        }
    }

    fn context<'a>(&'a self, behavior: &'a dyn BehaviorModel) -> Context<'a> {
        Context {
            briefing: &self.briefing,
            memory: &self.memory,
            behavior: behavior.log(),
            is_explored: self.executor.is_explored(),
        }
    }

    /// Takes in the observation and what it says of the last action.
    fn take_in(&mut self, observation: &Observation, perception: &mut dyn Perception) {
        if let Some(goal) = &observation.granted.goal {
            self.briefing.goal.get_or_insert_with(|| goal.clone());
        }
        if perception.hides_ids() {
            self.briefing.grants.ids = false;
        }
        self.memory.last = self.last_intent(observation);
        perception.feel(&self.memory.account(observation), self.memory.last);
        let percepts = perception.perceive(observation);
        let hidden = perception.hides_ids().then(|| observation.without_ids(self.briefing.grants));
        let observation = hidden.as_ref().unwrap_or(observation);
        self.memory.update(&self.briefing, observation, &percepts);
        let holds: Vec<TrackId> = self.memory.hands.all().map(|(track, _)| track).collect();
        if let Some(last) = self.memory.last {
            learn(&mut self.memory, &self.briefing, last, &self.held, &holds);
        }
        self.held = holds;
    }

    /// The action that has ended, as it was meant. With ids granted, another one's choice may have
    /// replaced it by a joint lift (the original's rules).
    fn last_intent(&self, observation: &Observation) -> Option<(Intent, Outcome)> {
        let (action, outcome) = observation.own.last?;
        let meant = self.sent.filter(|(_, sent)| *sent == action).map(|(intent, _)| intent);
        let told = || match action.subject() {
            None | Some(Target::Entity(_)) => Some(action.map(|target| match target {
                Target::Entity(entity) => entity.into(),
                Target::Pixel { .. } => TrackId(0),
            })),
            Some(Target::Pixel { .. }) => None,
        };
        Some((meant.or_else(told)?, outcome))
    }

    /// The action for an intent: if the thing can't be pointed at now, a turn towards where it
    /// is believed to be; `None` if it can't be got into view.
    fn name(&mut self, intent: Intent, perception: &dyn Perception) -> Option<(Intent, Action)> {
        let target = |track| perception.target(track);
        if let Some(action) = named(intent, target) {
            if !action.is_locomotion() {
                self.n_glances = 0;
            }
            return Some((intent, action));
        }
        let track = intent.subject()?;
        self.n_glances += 1;
        let at = self.memory.things.get(track).map(|t| t.nearest_point(self.memory.here()));
        let turn = at.and_then(|at| face(&self.memory, at, 0.0));
        match turn.filter(|_| self.n_glances <= MAX_GLANCES) {
            Some(turn) => named(turn, target).map(|action| (turn, action)),
            None => {
                self.n_glances = 0;
                let until = self.memory.frame + self.memory.rules.failures.ignore_frames;
                self.memory.things.ignore(track, until);
                None
            }
        }
    }

    /// Lets the policy choose; `None` if it sticks to the current plan.
    fn choose<P: Policy>(
        &mut self,
        policy: &mut P,
        behavior: &dyn BehaviorModel,
    ) -> Result<Option<Plan>, AgentError> {
        let news = self.memory.things.news();
        if let Some(current) = self.plan {
            let context = self.context(behavior);
            if !policy.reconsiders(&context, &current, news != self.news) {
                return Ok(None);
            }
        }
        self.news = news;
        self.memory.refresh();
        let context = self.context(behavior);
        let valid = valid_plans(&self.memory, &self.briefing);
        let chosen = policy.choose(&context, &valid)?;
        Ok(match self.plan {
            Some(current) if !chosen.supersedes(&current) => None,
            _ => Some(chosen),
        })
    }

    /// What `plan` comes to next.
    fn step(&mut self, plan: &Plan) -> Progress {
        let mut situation = Situation { memory: &mut self.memory, briefing: &self.briefing };
        self.executor.step(plan, &mut situation)
    }
}

impl<P: Policy> Mind<P> {
    /// What it remembers, if it was told by something learned.
    fn learned(&self) -> Option<&Memory> {
        let episode = self.episode.as_ref().filter(|_| self.sees_by.is_some())?;
        Some(&episode.memory)
    }

    /// What it noticed last that somebody did, in words.
    fn noticed(&self, memory: &Memory) -> Option<String> {
        let last = self.behavior.log().actions.last()?;
        let name = |track: TrackId| match memory.things.get(track) {
            Some(thing) => format!("{} {track}", thing.class.info().label),
            None => track.to_string(),
        };
        let done = match last.action {
            Action::PickUp { object, .. } => format!("picks up {}", name(object)),
            Action::PutIn => "puts something into a container".to_owned(),
            Action::PutOn { place, .. } => format!("puts something on {}", name(place)),
            Action::RemoveObstacle { obstacle, .. } => format!("removes {}", name(obstacle)),
            _ => return None,
        };
        let in_vain = matches!(last.outcome, Some(Outcome::Failure(_)));
        let in_vain = if in_vain { " in vain" } else { "" };
        Some(format!("frame {}: {} {done}{in_vain}", last.frame, last.agent))
    }

    /// Perceives and remembers: the first half of [`Agent::act`].
    pub fn attend(&mut self, observation: &Observation) {
        let Some(episode) = &mut self.episode else { return };
        episode.take_in(observation, self.perception.as_mut());
        self.behavior.watch(observation, &episode.memory);
        self.policy.look(observation, &episode.memory, self.behavior.log());
    }

    /// Decides and acts by what it has [attended](Mind::attend) to: the second half of [`Agent::act`].
    ///
    /// # Errors
    /// The policy's, if it can't choose. All else is as it was, and this may be called again.
    pub fn proceed(&mut self) -> Result<Action, AgentError> {
        let pause = Action::Wait { frames: PAUSE_FRAMES };
        let Some(mut episode) = self.episode.take() else { return Ok(pause) };
        let decided = self.decide(&mut episode);
        if let Ok(sent) = &decided {
            episode.sent = *sent;
        }
        self.episode = Some(episode);
        Ok(decided?.map_or(pause, |(_, action)| action))
    }

    /// What to do next, as it is meant and as it is named; `None` for a pause. Where nothing that the
    /// policy chooses can be done, one looks around elsewhere, from where it may be possible.
    fn decide(&mut self, episode: &mut Episode) -> Result<Option<(Intent, Action)>, AgentError> {
        for _ in 0..MAX_PLANS {
            let chosen = episode.choose(&mut self.policy, self.behavior.as_ref())?;
            if let Some(plan) = chosen {
                let thinking = self.policy.thinking_frames();
                let begin = episode.memory.frame + thinking;
                episode.executor.begin(begin, &episode.memory.rules);
                episode.plan = Some(plan);
                if thinking > 0 {
                    let frames = thinking;
                    return Ok(Some((Action::Wait { frames }, Action::Wait { frames })));
                }
            }
            let Some(plan) = episode.plan else { return Ok(None) };
            match episode.step(&plan) {
                Progress::Act(intent) => match episode.name(intent, self.perception.as_ref()) {
                    Some(named) => return Ok(Some(named)),
                    None => episode.plan = None,
                },
                Progress::Done | Progress::Failed => episode.plan = None,
            }
        }
        episode.executor.begin(episode.memory.frame, &episode.memory.rules);
        episode.plan = Some(Plan::Explore);
        Ok(match episode.step(&Plan::Explore) {
            Progress::Act(intent) => episode.name(intent, self.perception.as_ref()),
            Progress::Done | Progress::Failed => None,
        })
    }
}

/// What is believed to be in sight.
fn sees(memory: &Memory) -> Vec<Believed> {
    let in_sight = memory.things.iter().filter(|t| t.last_seen == memory.frame && t.is_present);
    let believed = |thing: &Thing| Believed {
        name: thing.track.to_string(),
        class: thing.class,
        at_cm: thing.position_in_world.to_array().map(|m| (100.0 * m) as i32),
    };
    in_sight.map(believed).collect()
}

impl<P: Policy> Agent for Mind<P> {
    fn senses(&self) -> Senses {
        Senses { film: self.behavior.film(), ..self.senses }
    }

    fn reset(&mut self, briefing: &Briefing) {
        self.policy.reset(briefing);
        self.behavior.reset();
        self.perception.reset(briefing);
        self.episode = Some(Episode::new(briefing, self.rules));
    }

    fn act(&mut self, observation: &Observation) -> Result<Action, AgentError> {
        self.attend(observation);
        self.proceed()
    }

    fn perception(&self) -> Option<String> {
        self.sees_by.clone()
    }

    fn thought(&self) -> Thought {
        Thought {
            plan: self.plan().map_or_else(|| "think".to_owned(), |plan| plan.to_string()),
            mood: self.policy.mood(),
            noticed: self.learned().and_then(|memory| self.noticed(memory)),
            sees: self.learned().map(sees).unwrap_or_default(),
        }
    }

    fn counts(&self) -> BTreeMap<String, u64> {
        self.policy.counts()
    }

    fn fork(&self) -> Option<Box<dyn Agent>> {
        Some(Box::new(Mind {
            perception: self.perception.fork(),
            behavior: self.behavior.fork(),
            policy: self.policy.fork()?,
            senses: self.senses,
            sees_by: self.sees_by.clone(),
            rules: self.rules,
            episode: self.episode.clone(),
        }))
    }
}

#[cfg(test)]
mod tests;
