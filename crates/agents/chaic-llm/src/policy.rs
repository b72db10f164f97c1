//! Who lets a language model choose among the valid plans.

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
use crate::asker::{Asker, Halted, Thread};
use crate::endpoint::PicturesByHash;
use crate::exchange::{
    Ask, By, Decided, Exchange, FaultKind, Message, Purpose, Reply, Role, Usage,
};
use crate::pictures::Album;
use crate::prompt_context::{LENGTHS, PromptContext};
use crate::session::Session;
use crate::settings::{Asking, Fallback, Form, Steps};
use crate::templates::{Question, Track};
use crate::tokens;

/// So much of an answer of no use is repeated to the model, characters.
const REPEATED: usize = 300;
/// Tokens that asking again takes, about: what is repeated, and the reason.
const AGAIN_TOKENS: usize = 200;

/// Lets a language model choose; held to the listed plans, whatever it says.
pub struct LanguagePolicy {
    session: Arc<Session>,
    key: Option<RunKey>,
    track: Track,
    looks: bool,
    rules: RulePolicy,
    thread: Thread,
    by_schema: bool,
    album: Album,
    last_plan: Option<Plan>,
    /// Plans that were begun in this frame and ended at once.
    tried: (Frame, Vec<Plan>),
    wait_until: Frame,
    thinking_frames: Frame,
    fell_back: bool,
    counts: BTreeMap<String, u64>,
}

/// A prompt with what it lists.
struct Prompt {
    facts: PromptContext,
    plans: Vec<Plan>,
    texts: Vec<String>,
    text: String,
    tokens: usize,
    shortened: usize,
}

/// What came of asking.
enum Outcome {
    /// A plan, by its place in the list.
    Chosen { index: usize, lenient: bool },
    /// Nothing of use.
    Failed(By),
}

impl LanguagePolicy {
    /// For one episode run; without a key only to know what it asks for. `looks` is whether
    /// pictures go with the questions.
    pub fn new(session: Arc<Session>, key: Option<RunKey>, track: Track, looks: bool) -> Self {
        LanguagePolicy {
            session,
            key,
            track,
            looks,
            rules: RulePolicy::new(RuleProfile::RHP),
            thread: Thread::default(),
            by_schema: false,
            album: Album::default(),
            last_plan: None,
            tried: (0, Vec::new()),
            wait_until: 0,
            thinking_frames: 0,
            fell_back: false,
            counts: BTreeMap::new(),
        }
    }

    fn asking(&self) -> &Asking {
        &self.session.settings.asking
    }

    fn count(&mut self, name: &str, n: u64) {
        if n > 0 {
            *self.counts.entry(name.to_owned()).or_default() += n;
        }
    }

    /// The plans that may be listed: valid ones that were not tried in this very moment. Obstacles
    /// are left to others by whoever is the partner (paper section 5.1.1).
    fn menu(&mut self, now: Frame, valid: &[Plan]) -> Vec<Plan> {
        if self.tried.0 != now {
            self.tried = (now, Vec::new());
        }
        let is_open = |plan: &&Plan| {
            let is_theirs = matches!(plan, Plan::RemoveObstacle(_)) && self.track == Track::Partner;
            !is_theirs && !self.tried.1.contains(plan) && **plan != Plan::Wait
        };
        valid.iter().filter(is_open).copied().chain([Plan::Wait]).collect()
    }

    fn decide(&mut self, context: &Context<'_>, menu: &[Plan]) -> Result<Plan, Halted> {
        let frame = context.memory.frame;
        if let [only] = menu {
            self.note(frame, *only, Some(1), By::OnlyPlan, None, false)?;
            return Ok(*only);
        }
        let mut latency_ms = 0;
        let (prompt, outcome) = self.ask(context, menu, &mut latency_ms)?;
        let seconds = latency_ms as f32 / 1000.0;
        let left = context.briefing.horizon.saturating_sub(frame);
        self.thinking_frames =
            ((seconds * self.asking().frames_per_second).ceil() as Frame).min(left);
        match outcome {
            Outcome::Chosen { index, lenient } => {
                let plan = prompt.plans[index];
                self.note(frame, plan, Some(index + 1), By::Model, Some(&prompt), lenient)?;
                Ok(plan)
            }
            Outcome::Failed(by) => {
                let plan = self.fall_back(context, menu);
                let number = prompt.plans.iter().position(|p| *p == plan).map(|i| i + 1);
                self.note(frame, plan, number, by, Some(&prompt), false)?;
                Ok(plan)
            }
        }
    }

    /// Asks, and once more if the answer is of no use.
    fn ask(
        &mut self,
        context: &Context<'_>,
        menu: &[Plan],
        latency_ms: &mut u64,
    ) -> Result<(Prompt, Outcome), Halted> {
        let frame = context.memory.frame;
        let (hashes, pictures) = match self.looks {
            true => self.album.encoded(self.asking().images),
            false => Default::default(),
        };
        let mut prompt = self.prompt(context, menu)?;
        let message =
            |role, text: &str| Message { role, text: text.to_owned(), images: Vec::new() };
        let first =
            |text: &str| vec![Message { images: hashes.clone(), ..message(Role::User, text) }];
        let mut messages = first(&prompt.text);
        let mut purpose = Purpose::Decide;
        if self.asking().steps == Steps::Two {
            let exchange = self.exchange(frame, Purpose::Think, &messages, None, &pictures)?;
            let Reply::Answer { text, latency_ms: ms, .. } = exchange.reply else {
                return Ok((prompt, Outcome::Failed(failed_by(&exchange))));
            };
            *latency_ms += ms;
            messages.push(message(Role::Assistant, &text));
            let choose = self.fill(self.session.templates.choose(&prompt.facts))?;
            messages.push(message(Role::User, &choose));
            purpose = Purpose::Choose;
        }
        loop {
            let schema_of = self.by_schema.then_some(prompt.plans.len());
            let exchange = self.exchange(frame, purpose, &messages, schema_of, &pictures)?;
            let text = match &exchange.reply {
                Reply::Answer { text, latency_ms: ms, .. } => {
                    *latency_ms += ms;
                    text
                }
                Reply::Failed(fault) if fault.kind == FaultKind::Schema => {
                    self.without_schema(&fault.detail)?;
                    prompt = self.prompt(context, menu)?;
                    messages = first(&prompt.text);
                    continue;
                }
                Reply::Failed(_) => return Ok((prompt, Outcome::Failed(failed_by(&exchange)))),
            };
            let problem = match answer::read(text, &prompt.texts, self.by_schema) {
                Ok(answer::Choice { index, lenient }) => {
                    return Ok((prompt, Outcome::Chosen { index, lenient }));
                }
                Err(problem) => problem,
            };
            self.count("invalid_answers", 1);
            if purpose == Purpose::Again {
                return Ok((prompt, Outcome::Failed(By::FallbackInvalid)));
            }
            purpose = Purpose::Again;
            let repeated: String = text.chars().take(REPEATED).collect();
            // An empty message is refused by some endpoints.
            let repeated = if repeated.trim().is_empty() { "(nothing)" } else { &repeated };
            messages.push(message(Role::Assistant, repeated));
            let again = self.session.templates.again(&prompt.facts, &problem, self.by_schema);
            messages.push(message(Role::User, &self.fill(again)?));
        }
    }

    fn exchange(
        &mut self,
        frame: Frame,
        purpose: Purpose,
        messages: &[Message],
        schema_of: Option<usize>,
        pictures: &PicturesByHash,
    ) -> Result<Exchange, Halted> {
        let model = self.asking().model.clone();
        let ask = Ask { model, purpose, messages: messages.to_vec(), schema_of };
        let exchange = Asker::new(&self.session, &mut self.thread).ask(frame, ask, pictures)?;
        let usage = exchange.usage();
        let Usage { prompt, answer, estimated } = usage;
        let cost_millionths = self.session.settings.price.millionths(usage).round() as u64;
        let n_faults = exchange.faults.len() as u64;
        for (name, n) in [
            ("questions", 1),
            ("requests", exchange.requests()),
            ("faults", n_faults),
            ("asked_again", u64::from(purpose == Purpose::Again)),
            ("prompt_tokens", prompt),
            ("answer_tokens", answer),
            ("estimated_usage", u64::from(estimated)),
            ("cost_millionths", cost_millionths),
        ] {
            self.count(name, n);
        }
        Ok(exchange)
    }

    /// The endpoint refuses a JSON schema: texts from now on, if the settings allow.
    fn without_schema(&mut self, detail: &str) -> Result<(), Halted> {
        if self.asking().form == Form::Schema {
            let hint = "set asking.form to \"auto\" or \"text\"";
            self.session.halt(format!("the endpoint refuses a JSON schema ({detail}); {hint}"));
            return Err(Halted);
        }
        self.by_schema = false;
        Ok(())
    }

    /// The longest prompt that the settings allow.
    fn prompt(&self, context: &Context<'_>, menu: &[Plan]) -> Result<Prompt, Halted> {
        let asking = self.asking();
        let question = match (asking.steps, self.by_schema) {
            (Steps::Two, _) => Question::Think,
            (Steps::One, true) => Question::Schema,
            (Steps::One, false) => Question::Text,
        };
        let images = if self.looks { self.album.count() } else { 0 };
        let mut shortest = None;
        for (shortened, length) in LENGTHS.into_iter().enumerate() {
            let (facts, plans) =
                PromptContext::of(self.track, context, menu, self.last_plan, images, length);
            let text = self.fill(self.session.templates.prompt(&facts, question))?;
            let mut tokens = tokens::estimate(&text) + AGAIN_TOKENS;
            if asking.steps == Steps::Two {
                let choose = self.fill(self.session.templates.choose(&facts))?;
                tokens += asking.answer_tokens as usize + tokens::estimate(&choose);
            }
            let texts = facts.plans.iter().map(|p| p.text.clone()).collect();
            let fits = tokens <= asking.prompt_tokens as usize;
            shortest = Some(Prompt { facts, plans, texts, text, tokens, shortened });
            if fits {
                break;
            }
        }
        Ok(shortest.expect("there is at least one length"))
    }

    fn fill(&self, filled: crate::error::Result<String>) -> Result<String, Halted> {
        filled.map_err(|error| {
            self.session.halt(error.to_string());
            Halted
        })
    }

    /// What is done where the model doesn't decide.
    fn fall_back(&mut self, context: &Context<'_>, menu: &[Plan]) -> Plan {
        let first_of = |plans: &[Plan]| plans.iter().copied().find(|p| menu.contains(p));
        let chosen = match self.asking().fallback {
            Fallback::Wait => Some(Plan::Wait),
            Fallback::Explore => None,
            Fallback::Rules => Some(self.rules.decide(context, menu)),
        };
        let usual = [Plan::Explore, Plan::TurnAround, Plan::Wait];
        chosen.filter(|p| menu.contains(p)).or_else(|| first_of(&usual)).unwrap_or(Plan::Wait)
    }

    fn note(
        &mut self,
        frame: Frame,
        plan: Plan,
        number: Option<usize>,
        by: By,
        prompt: Option<&Prompt>,
        lenient: bool,
    ) -> Result<(), Halted> {
        self.fell_back = !matches!(by, By::Model | By::OnlyPlan);
        let shortened = prompt.map_or(0, |p| p.shortened);
        let is_over = prompt.is_some_and(|p| p.tokens > self.asking().prompt_tokens as usize);
        for (name, n) in [
            ("decisions", 1),
            ("decided_by_model", u64::from(by == By::Model)),
            ("fallback_invalid", u64::from(by == By::FallbackInvalid)),
            ("fallback_fault", u64::from(by == By::FallbackFault)),
            ("fallback_budget", u64::from(by == By::FallbackBudget)),
            ("only_plan", u64::from(by == By::OnlyPlan)),
            ("read_leniently", u64::from(lenient)),
            ("shortened_prompts", u64::from(shortened > 0)),
            ("overlong_prompts", u64::from(is_over)),
            ("thinking_frames", u64::from(self.thinking_frames)),
        ] {
            self.count(name, n);
        }
        let decided = Decided {
            frame,
            number,
            plan: crate::prompt_context::plan_text(&plan),
            by,
            lenient,
            prompt_tokens: prompt.map(|p| p.tokens),
            shortened,
            thinking_frames: self.thinking_frames,
        };
        self.thread.note(&self.session, decided)
    }
}

fn failed_by(exchange: &Exchange) -> By {
    match &exchange.reply {
        Reply::Failed(fault) if fault.kind == FaultKind::Budget => By::FallbackBudget,
        _ => By::FallbackFault,
    }
}

impl Policy for LanguagePolicy {
    fn reset(&mut self, briefing: &Briefing) {
        let profile = match (self.track, briefing.capability.gait) {
            (Track::Partner, Gait::WalkBike) => RuleProfile::RIDER,
            (Track::Partner, _) => RuleProfile::PARTNER,
            (Track::Hidden | Track::Told, _) => RuleProfile::RHP,
        };
        self.rules = RulePolicy::new(profile);
        self.rules.reset(briefing);
        self.thread = match &self.key {
            Some(key) => Thread::open(&self.session, key, briefing.me),
            None => Thread::default(),
        };
        self.by_schema = self.asking().form != Form::Text && self.asking().steps == Steps::One;
        self.album.clear();
        (self.last_plan, self.tried) = (None, (0, Vec::new()));
        (self.wait_until, self.thinking_frames, self.fell_back) = (0, 0, false);
        self.counts.clear();
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        self.thinking_frames = 0;
        let now = context.memory.frame;
        if now < self.wait_until {
            return Ok(Plan::Wait);
        }
        let menu = self.menu(now, valid);
        let plan = self.decide(context, &menu).map_err(|Halted| {
            let why = self.session.problem();
            AgentError::Halted(why.unwrap_or_else(|| "its user stops the run".to_owned()))
        })?;
        self.tried.1.push(plan);
        self.last_plan = Some(plan);
        if plan == Plan::Wait {
            self.wait_until = now + self.thinking_frames + self.asking().wait_frames;
        }
        Ok(plan)
    }

    fn look(&mut self, observation: &Observation, _: &Memory, _: &BehaviorLog) {
        if self.looks {
            self.album.see(observation, self.session.settings.asking.images);
        }
    }

    fn thinking_frames(&self) -> Frame {
        self.thinking_frames
    }

    fn mood(&self) -> Option<String> {
        self.fell_back.then(|| "fallback".to_owned())
    }

    fn counts(&self) -> BTreeMap<String, u64> {
        self.counts.clone()
    }
}
