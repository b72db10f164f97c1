//! Policy that lets a language model choose among the valid plans.

use std::collections::BTreeMap;
use std::sync::Arc;

use chaic_agents::behavior::BehaviorLog;
use chaic_agents::decision::{Context, Plan, Policy};
use chaic_agents::memory::Memory;
use chaic_agents::policies::{RulePolicy, RuleProfile};
use chaic_core::capability::Gait;
use chaic_core::{AgentError, Briefing, Frame, Observation};
use chaic_env::RunKey;

use crate::answer;
use crate::client::{Conversation, Halted, LlmClient};
use crate::endpoint::ImagesByHash;
use crate::exchange::{
    ChatRequest, DecisionRecord, DecisionSource, Exchange, FaultKind, Message, Purpose, Reply,
    Role, Usage,
};
use crate::images::RecentImages;
use crate::prompt_context::{LIST_LIMITS, PromptContext};
use crate::prompt_track::PromptTrack;
use crate::session::Session;
use crate::settings::{AnswerForm, Fallback, PromptSettings, PromptSteps};
use crate::templates::PromptQuestion;
use crate::tokens;

/// Maximum length of an invalid answer that is repeated to the model, characters.
const MAX_REPEATED: usize = 300;
/// Estimated tokens of a repetition: the answer and the reason.
const REPETITION_TOKENS: usize = 200;

/// Policy of a language model; its result is always a listed plan.
pub struct LanguagePolicy {
    session: Arc<Session>,
    key: Option<RunKey>,
    track: PromptTrack,
    has_images: bool,
    rules: RulePolicy,
    conversation: Conversation,
    by_schema: bool,
    recent_images: RecentImages,
    last_plan: Option<Plan>,
    /// Plans that were started in this frame and ended at once.
    tried: (Frame, Vec<Plan>),
    wait_until: Frame,
    thinking_frames: Frame,
    used_fallback: bool,
    counts: BTreeMap<String, u64>,
}

/// Prompt with its listed plans.
struct Prompt {
    facts: PromptContext,
    plans: Vec<Plan>,
    texts: Vec<String>,
    text: String,
    tokens: usize,
    shortened: usize,
}

/// Result of a request.
enum Outcome {
    /// Index of the plan in the list.
    Chosen { index: usize, lenient: bool },
    /// No valid choice.
    Failed(DecisionSource),
}

impl LanguagePolicy {
    /// Creates the policy for one episode run; without a run key it only describes its sensors.
    /// `has_images` selects requests with images.
    pub fn new(
        session: Arc<Session>,
        key: Option<RunKey>,
        track: PromptTrack,
        has_images: bool,
    ) -> Self {
        LanguagePolicy {
            session,
            key,
            track,
            has_images,
            rules: RulePolicy::new(RuleProfile::RHP),
            conversation: Conversation::default(),
            by_schema: false,
            recent_images: RecentImages::default(),
            last_plan: None,
            tried: (0, Vec::new()),
            wait_until: 0,
            thinking_frames: 0,
            used_fallback: false,
            counts: BTreeMap::new(),
        }
    }

    fn settings(&self) -> &PromptSettings {
        &self.session.settings.request
    }

    fn count(&mut self, name: &str, n: u64) {
        if n > 0 {
            *self.counts.entry(name.to_owned()).or_default() += n;
        }
    }

    /// Returns the plans to list: valid ones that were not tried in this frame. Partners leave
    /// obstacles to others (paper, section 5.1.1).
    fn listed_plans(&mut self, now: Frame, valid: &[Plan]) -> Vec<Plan> {
        if self.tried.0 != now {
            self.tried = (now, Vec::new());
        }
        let is_open = |plan: &&Plan| {
            let is_left_to_helper =
                matches!(plan, Plan::RemoveObstacle(_)) && self.track == PromptTrack::Partner;
            !is_left_to_helper && !self.tried.1.contains(plan) && **plan != Plan::Wait
        };
        valid.iter().filter(is_open).copied().chain([Plan::Wait]).collect()
    }

    fn decide(&mut self, context: &Context<'_>, listed: &[Plan]) -> Result<Plan, Halted> {
        let frame = context.memory.frame;
        if let [only] = listed {
            self.record(frame, *only, Some(1), DecisionSource::OnlyPlan, None, false)?;
            return Ok(*only);
        }
        let mut latency_ms = 0;
        let (prompt, outcome) = self.ask(context, listed, &mut latency_ms)?;
        let seconds = latency_ms as f32 / 1000.0;
        let left = context.briefing.horizon.saturating_sub(frame);
        self.thinking_frames =
            ((seconds * self.settings().frames_per_second).ceil() as Frame).min(left);
        match outcome {
            Outcome::Chosen { index, lenient } => {
                let plan = prompt.plans[index];
                self.record(
                    frame,
                    plan,
                    Some(index + 1),
                    DecisionSource::Model,
                    Some(&prompt),
                    lenient,
                )?;
                Ok(plan)
            }
            Outcome::Failed(source) => {
                let plan = self.fall_back(context, listed);
                let number = prompt.plans.iter().position(|p| *p == plan).map(|i| i + 1);
                self.record(frame, plan, number, source, Some(&prompt), false)?;
                Ok(plan)
            }
        }
    }

    /// Sends a request, and repeats it once after an invalid answer.
    fn ask(
        &mut self,
        context: &Context<'_>,
        listed: &[Plan],
        latency_ms: &mut u64,
    ) -> Result<(Prompt, Outcome), Halted> {
        let frame = context.memory.frame;
        let (hashes, images) = match self.has_images {
            true => self.recent_images.encoded(self.settings().images),
            false => Default::default(),
        };
        let mut prompt = self.prompt(context, listed)?;
        let message =
            |role, text: &str| Message { role, text: text.to_owned(), images: Vec::new() };
        let first =
            |text: &str| vec![Message { images: hashes.clone(), ..message(Role::User, text) }];
        let mut messages = first(&prompt.text);
        let mut purpose = Purpose::Decide;
        if self.settings().steps == PromptSteps::Two {
            let exchange = self.exchange(frame, Purpose::Think, &messages, None, &images)?;
            let Reply::Answer { text, latency_ms: ms, .. } = exchange.reply else {
                return Ok((prompt, Outcome::Failed(failure_source(&exchange))));
            };
            *latency_ms += ms;
            messages.push(message(Role::Assistant, non_empty(&text)));
            let choose = self.or_halt(self.session.templates.choose(&prompt.facts))?;
            messages.push(message(Role::User, &choose));
            purpose = Purpose::Choose;
        }
        loop {
            let n_schema_plans = self.by_schema.then_some(prompt.plans.len());
            let exchange = self.exchange(frame, purpose, &messages, n_schema_plans, &images)?;
            let text = match &exchange.reply {
                Reply::Answer { text, latency_ms: ms, .. } => {
                    *latency_ms += ms;
                    text
                }
                Reply::Failed(fault) if fault.kind == FaultKind::Schema => {
                    // If the settings require a schema, the client has paused the run.
                    self.by_schema = false;
                    prompt = self.prompt(context, listed)?;
                    messages = first(&prompt.text);
                    continue;
                }
                Reply::Failed(_) => {
                    return Ok((prompt, Outcome::Failed(failure_source(&exchange))));
                }
            };
            let parse = match exchange.reply.is_truncated() {
                true => answer::parse_truncated,
                false => answer::parse,
            };
            let problem = match parse(text, &prompt.texts, self.by_schema) {
                Ok(answer::Choice { index, lenient }) => {
                    return Ok((prompt, Outcome::Chosen { index, lenient }));
                }
                Err(problem) => problem,
            };
            self.count("invalid_answers", 1);
            if purpose == Purpose::Retry {
                return Ok((prompt, Outcome::Failed(DecisionSource::FallbackInvalid)));
            }
            purpose = Purpose::Retry;
            let repeated: String = text.chars().take(MAX_REPEATED).collect();
            messages.push(message(Role::Assistant, non_empty(&repeated)));
            let repeat = self.session.templates.repeat(&prompt.facts, &problem, self.by_schema);
            messages.push(message(Role::User, &self.or_halt(repeat)?));
        }
    }

    fn exchange(
        &mut self,
        frame: Frame,
        purpose: Purpose,
        messages: &[Message],
        n_schema_plans: Option<usize>,
        images: &ImagesByHash,
    ) -> Result<Exchange, Halted> {
        let model = self.settings().model.clone();
        let request = ChatRequest { model, purpose, messages: messages.to_vec(), n_schema_plans };
        let exchange = LlmClient::new(&self.session, &mut self.conversation)
            .request(frame, request, images)?;
        let usage = exchange.usage();
        let Usage { prompt, answer, estimated } = usage;
        let cost_millionths = self.session.settings.price.millionths(usage).round() as u64;
        let n_faults = exchange.faults.len() as u64;
        for (name, n) in [
            ("questions", 1),
            ("requests", exchange.requests()),
            ("faults", n_faults),
            ("asked_again", u64::from(purpose == Purpose::Retry)),
            ("prompt_tokens", prompt),
            ("answer_tokens", answer),
            ("estimated_usage", u64::from(estimated)),
            ("cost_millionths", cost_millionths),
        ] {
            self.count(name, n);
        }
        Ok(exchange)
    }

    /// Returns the longest prompt within the settings' limit.
    fn prompt(&self, context: &Context<'_>, listed: &[Plan]) -> Result<Prompt, Halted> {
        let settings = self.settings();
        let question = match (settings.steps, self.by_schema) {
            (PromptSteps::Two, _) => PromptQuestion::Think,
            (PromptSteps::One, true) => PromptQuestion::Schema,
            (PromptSteps::One, false) => PromptQuestion::Text,
        };
        let images = if self.has_images { self.recent_images.count() } else { 0 };
        let mut shortest = None;
        for (shortened, length) in LIST_LIMITS.into_iter().enumerate() {
            let (facts, plans) =
                PromptContext::new(self.track, context, listed, self.last_plan, images, length);
            let text = self.or_halt(self.session.templates.prompt(&facts, question))?;
            let mut tokens = tokens::estimate(&text) + REPETITION_TOKENS;
            if settings.steps == PromptSteps::Two {
                let choose = self.or_halt(self.session.templates.choose(&facts))?;
                tokens += settings.max_answer_tokens as usize + tokens::estimate(&choose);
            }
            let texts = facts.plans.iter().map(|p| p.text.clone()).collect();
            let fits = tokens <= settings.max_prompt_tokens as usize;
            shortest = Some(Prompt { facts, plans, texts, text, tokens, shortened });
            if fits {
                break;
            }
        }
        Ok(shortest.expect("there is at least one length"))
    }

    fn or_halt(&self, filled: crate::error::Result<String>) -> Result<String, Halted> {
        filled.map_err(|error| {
            self.session.halt(error.to_string());
            Halted
        })
    }

    /// Chooses a plan without the model.
    fn fall_back(&mut self, context: &Context<'_>, listed: &[Plan]) -> Plan {
        let first_of = |plans: &[Plan]| plans.iter().copied().find(|p| listed.contains(p));
        let chosen = match self.settings().fallback {
            Fallback::Wait => Some(Plan::Wait),
            Fallback::Explore => None,
            Fallback::Rules => Some(self.rules.decide(context, listed)),
        };
        let alternatives = [Plan::Explore, Plan::TurnAround, Plan::Wait];
        chosen
            .filter(|p| listed.contains(p))
            .or_else(|| first_of(&alternatives))
            .unwrap_or(Plan::Wait)
    }

    fn record(
        &mut self,
        frame: Frame,
        plan: Plan,
        number: Option<usize>,
        source: DecisionSource,
        prompt: Option<&Prompt>,
        lenient: bool,
    ) -> Result<(), Halted> {
        self.used_fallback = !matches!(source, DecisionSource::Model | DecisionSource::OnlyPlan);
        let shortened = prompt.map_or(0, |p| p.shortened);
        let is_too_long =
            prompt.is_some_and(|p| p.tokens > self.settings().max_prompt_tokens as usize);
        for (name, n) in [
            ("decisions", 1),
            ("decided_by_model", u64::from(source == DecisionSource::Model)),
            ("fallback_invalid", u64::from(source == DecisionSource::FallbackInvalid)),
            ("fallback_fault", u64::from(source == DecisionSource::FallbackFault)),
            ("fallback_budget", u64::from(source == DecisionSource::FallbackBudget)),
            ("only_plan", u64::from(source == DecisionSource::OnlyPlan)),
            ("read_leniently", u64::from(lenient)),
            ("shortened_prompts", u64::from(shortened > 0)),
            ("overlong_prompts", u64::from(is_too_long)),
            ("thinking_frames", u64::from(self.thinking_frames)),
        ] {
            self.count(name, n);
        }
        let decided = DecisionRecord {
            frame,
            number,
            plan: crate::prompt_context::plan_text(&plan),
            source,
            lenient,
            prompt_tokens: prompt.map(|p| p.tokens),
            shortened,
            thinking_frames: self.thinking_frames,
        };
        self.conversation.record(&self.session, decided)
    }
}

/// Returns a message of the model, or a replacement if it is blank: some endpoints refuse empty messages.
fn non_empty(text: &str) -> &str {
    if text.trim().is_empty() { "(nothing)" } else { text }
}

fn failure_source(exchange: &Exchange) -> DecisionSource {
    match &exchange.reply {
        Reply::Failed(fault) if fault.kind == FaultKind::Budget => DecisionSource::FallbackBudget,
        _ => DecisionSource::FallbackFault,
    }
}

impl Policy for LanguagePolicy {
    fn reset(&mut self, briefing: &Briefing) {
        let profile = match (self.track, briefing.capability.gait) {
            (PromptTrack::Partner, Gait::WalkBike) => RuleProfile::RIDER,
            (PromptTrack::Partner, _) => RuleProfile::PARTNER,
            (PromptTrack::Hidden | PromptTrack::KnownTask, _) => RuleProfile::RHP,
        };
        self.rules = RulePolicy::new(profile);
        self.rules.reset(briefing);
        self.conversation = match &self.key {
            Some(key) => Conversation::open(&self.session, key, briefing.me),
            None => Conversation::default(),
        };
        self.by_schema = self.settings().answer_format != AnswerForm::Text
            && self.settings().steps == PromptSteps::One;
        self.recent_images.clear();
        (self.last_plan, self.tried) = (None, (0, Vec::new()));
        (self.wait_until, self.thinking_frames, self.used_fallback) = (0, 0, false);
        self.counts.clear();
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.thinking_frames = 0;
        let now = context.memory.frame;
        if now < self.wait_until {
            return Ok(Plan::Wait);
        }
        let listed = self.listed_plans(now, valid);
        let plan = self.decide(context, &listed).map_err(|Halted| {
            let problem = self.session.problem();
            AgentError::Halted(problem.unwrap_or_else(|| "the user stopped the run".to_owned()))
        })?;
        self.tried.1.push(plan);
        self.last_plan = Some(plan);
        if plan == Plan::Wait {
            self.wait_until = now + self.thinking_frames + self.settings().wait_frames;
        }
        Ok(plan)
    }

    fn observe(&mut self, observation: &Observation, _: &Memory, _: &BehaviorLog) {
        if self.has_images {
            self.recent_images.push(observation, self.session.settings.request.images);
        }
    }

    fn thinking_frames(&self) -> Frame {
        self.thinking_frames
    }

    fn status(&self) -> Option<String> {
        self.used_fallback.then(|| "fallback".to_owned())
    }

    fn counters(&self) -> BTreeMap<String, u64> {
        self.counts.clone()
    }
}
