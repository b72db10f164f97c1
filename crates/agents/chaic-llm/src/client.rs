//! Requests with retries: the reply comes from the record, from a replay, or from the endpoint.

use std::collections::VecDeque;
use std::time::Duration;

use chaic_core::{AgentId, Frame};
use chaic_env::RunKey;

use crate::endpoint::{Client, Failure, ImagesByHash, NoReply};
use crate::error::LlmError;
use crate::exchange::{ChatRequest, DecisionRecord, Exchange, Fault, FaultKind, Reply, Usage};
use crate::rate_limiter::{self, Admission, RateLimiter, Spending};
use crate::record::{self, DecisionLog, DecisionLogWriter, RecordEntry, RecordHeader};
use crate::session::{AnswerSource, Session};
use crate::settings::{AnswerForm, FailureAction, Settings};

/// Requests of one agent in one episode run, with its record.
pub struct LlmClient<'a> {
    session: &'a Session,
    conversation: &'a mut Conversation,
}

/// Record of one agent in one episode run, and the exchanges of a replay.
#[derive(Default)]
pub struct Conversation {
    recorder: Option<DecisionLogWriter>,
    replay: VecDeque<Exchange>,
}

/// The run must stop; no further decision is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Halted;

/// Stops the run because of an error.
fn halt(session: &Session, error: &LlmError) -> Halted {
    session.halt(error.to_string());
    Halted
}

impl Conversation {
    /// Opens the record of an agent; halts the session on failure.
    pub fn open(session: &Session, key: &RunKey, agent: AgentId) -> Conversation {
        let mut conversation = Conversation::default();
        let Some(run) = session.run() else { return conversation };
        if let AnswerSource::Replay(from) = &session.source {
            match DecisionLog::read(from, &record::path(from, key, agent)) {
                Ok(record) => {
                    let exchanges = record.entries.into_iter().filter_map(|entry| match entry {
                        RecordEntry::Exchange(exchange) => Some(*exchange),
                        RecordEntry::Decision(_) => None,
                    });
                    conversation.replay = exchanges.collect();
                }
                Err(error) => session.halt(format!("nothing to replay: {error}")),
            }
        }
        let head = RecordHeader::new(key, agent, &session.settings.request.model);
        match DecisionLogWriter::open(run, &record::path(run, key, agent), &head) {
            Ok(recorder) => conversation.recorder = Some(recorder),
            Err(error) => session.halt(error.to_string()),
        }
        conversation
    }

    fn push(&mut self, session: &Session, entry: RecordEntry) -> Result<(), Halted> {
        let Some(recorder) = &mut self.recorder else { return Ok(()) };
        let pushed = recorder.push(entry);
        if let Some(copy) = recorder.take_copy_path() {
            session.warn_of_kept_record(&copy);
        }
        pushed.map_err(|error| halt(session, &error))
    }

    /// Checks that the record has room for the answer to a request, before the request is paid for.
    fn check_room(&self, session: &Session, request: &ChatRequest) -> Result<(), Halted> {
        let Settings { endpoint, retry, .. } = &session.settings;
        let checked = self.recorder.as_ref().map_or(Ok(()), |r| {
            r.check_room(request, endpoint.max_answer_bytes, retry.max_attempts)
        });
        checked.map_err(|error| halt(session, &error))
    }

    /// Records a decision.
    ///
    /// # Errors
    /// If the record cannot be written; the run then stops.
    pub fn record(&mut self, session: &Session, decided: DecisionRecord) -> Result<(), Halted> {
        self.push(session, RecordEntry::Decision(decided))
    }
}

impl<'a> LlmClient<'a> {
    /// Creates a client with the conversation of an agent.
    pub fn new(session: &'a Session, conversation: &'a mut Conversation) -> LlmClient<'a> {
        LlmClient { session, conversation }
    }

    /// Sends a request with retries; `images` holds the images that it names.
    ///
    /// # Errors
    /// If the run must stop: on interruption, on a pause, or at the end of a replay.
    pub fn request(
        &mut self,
        frame: Frame,
        request: ChatRequest,
        images: &ImagesByHash,
    ) -> Result<Exchange, Halted> {
        let recorded =
            self.conversation.recorder.as_mut().and_then(|r| r.recorded_exchange(&request));
        let exchange = match (recorded, &self.session.source) {
            (Some(exchange), _) => {
                // Answers recorded earlier in this run replace those of the replay.
                self.conversation.replay.pop_front();
                exchange
            }
            (None, AnswerSource::Live(client)) => {
                self.conversation.check_room(self.session, &request)?;
                self.send_with_retries(client, frame, request, images)?
            }
            (None, AnswerSource::Replay(_)) => self.next_replayed(frame, &request)?,
            (None, AnswerSource::Offline) => {
                self.session.halt("no endpoint is configured".to_owned());
                return Err(Halted);
            }
        };
        self.pause_if_schema_required(&exchange)?;
        self.conversation.push(self.session, RecordEntry::Exchange(Box::new(exchange.clone())))?;
        Ok(exchange)
    }

    /// Returns the next exchange of a replayed run.
    fn next_replayed(&mut self, frame: Frame, request: &ChatRequest) -> Result<Exchange, Halted> {
        let problem = match self.conversation.replay.pop_front() {
            Some(exchange)
                if exchange.request_hash == request.hash() && exchange.frame == frame =>
            {
                return Ok(exchange);
            }
            Some(other) => format!("the request differs at frame {}", other.frame),
            None => "there are no further requests".to_owned(),
        };
        self.session.halt(format!(
            "the replay differs at frame {frame}: in the recorded run {problem}; it needs the same \
             episodes, rules and version of chaic"
        ));
        Err(Halted)
    }

    fn send_with_retries(
        &mut self,
        client: &Client,
        frame: Frame,
        request: ChatRequest,
        images: &ImagesByHash,
    ) -> Result<Exchange, Halted> {
        let Some(limiter) = self.session.limiter() else { return Err(Halted) };
        let settings = &self.session.settings;
        let max_cost = Spending::new(1, client.max_usage(&request), &settings.price);
        let mut faults: Vec<Fault> = Vec::new();
        loop {
            match limiter.wait_for_admission(max_cost, self.session.stop) {
                Admission::Admitted => {}
                Admission::Stopped => return Err(Halted),
                Admission::BudgetSpent(limit) => {
                    let fault = self.budget_fault(limit)?;
                    return Ok(Exchange::new(frame, request, faults, Reply::Failed(fault)));
                }
            }
            let failure = match self.send(client, limiter, max_cost, &request, images) {
                Ok(reply) => return Ok(Exchange::new(frame, request, faults, reply)),
                Err(NoReply::Abandoned) => return Err(Halted),
                Err(NoReply::Failed(failure)) => failure,
            };
            let Failure { fault, is_retryable, retry_after } = failure;
            faults.push(fault.clone());
            let attempts = faults.len() as u32;
            if fault.kind == FaultKind::Schema {
                return Ok(Exchange::new(frame, request, faults, Reply::Failed(fault)));
            }
            let is_last_attempt = !is_retryable || attempts >= settings.retry.max_attempts;
            if is_last_attempt {
                self.pause_if_exhausted(&fault, attempts)?;
            }
            self.session.record_failure(&fault);
            if is_last_attempt {
                return Ok(Exchange::new(frame, request, faults, Reply::Failed(fault)));
            }
            let wait = self.wait(&request, attempts, retry_after);
            if !rate_limiter::sleep(wait, self.session.stop) {
                return Err(Halted);
            }
        }
    }

    fn send(
        &self,
        client: &Client,
        limiter: &RateLimiter,
        max_cost: Spending,
        request: &ChatRequest,
        images: &ImagesByHash,
    ) -> Result<Reply, NoReply> {
        let sent = client.send(request, images, &|| self.session.is_interrupted());
        if sent.is_ok() {
            self.session.record_answer();
        }
        let usage = match &sent {
            Ok(Reply::Answer { usage, .. }) => *usage,
            // The cost of a failed or abandoned request is unknown.
            _ => Usage::default(),
        };
        limiter.settle_cost(max_cost, Spending::new(1, usage, &self.session.settings.price));
        sent
    }

    /// Returns the wait before the next attempt: exponential backoff with deterministic jitter in
    /// its upper half, or the endpoint's `Retry-After`.
    fn wait(
        &self,
        request: &ChatRequest,
        attempts: u32,
        retry_after: Option<Duration>,
    ) -> Duration {
        let retry = &self.session.settings.retry;
        let max = Duration::from_secs_f32(retry.max_backoff_secs);
        let initial = Duration::from_secs_f32(retry.initial_backoff_secs);
        let doubled = initial.saturating_mul(1 << (attempts - 1).min(20)).min(max);
        let jitter = request.hash().to_string();
        let jitter = u32::from_str_radix(&jitter[..4], 16).unwrap_or(0) as f32 / 65536.0;
        let wait = doubled.mul_f32(0.5 + 0.5 * jitter);
        retry_after.map_or(wait, |requested| requested.max(wait)).min(max)
    }

    fn budget_fault(&self, limit: &str) -> Result<Fault, Halted> {
        let detail = format!("the budget of {limit} is spent");
        if self.session.settings.budget.on_exhausted == FailureAction::Pause {
            self.session.halt(format!("{detail}; resume with a larger one"));
            return Err(Halted);
        }
        Ok(Fault { kind: FaultKind::Budget, status: None, detail })
    }

    /// Pauses the run if the settings require the JSON schema that the endpoint refused. The refusal is
    /// not recorded, so that another endpoint can continue the run.
    fn pause_if_schema_required(&self, exchange: &Exchange) -> Result<(), Halted> {
        let Reply::Failed(fault) = &exchange.reply else { return Ok(()) };
        let is_required = self.session.settings.request.answer_format == AnswerForm::Schema;
        if !is_required || fault.kind != FaultKind::Schema {
            return Ok(());
        }
        self.session.halt(format!(
            "the endpoint refuses a JSON schema ({fault}); resume with another endpoint, or start a run \
             with request.answer_format \"auto\" or \"text\""
        ));
        Err(Halted)
    }

    fn pause_if_exhausted(&self, fault: &Fault, attempts: u32) -> Result<(), Halted> {
        if self.session.settings.retry.on_failure == FailureAction::Pause {
            let times = if attempts == 1 { "once" } else { &format!("{attempts} times") };
            self.session.halt(format!("the model cannot be reached (tried {times}): {fault}"));
            return Err(Halted);
        }
        Ok(())
    }
}
