//! Asking until there is a reply: from the record, from a replay, or from the endpoint with as many
//! attempts as the settings allow.

use std::collections::VecDeque;
use std::time::Duration;

use chaic_core::{AgentId, Frame};
use chaic_env::RunKey;

use crate::endpoint::{Client, Failure, NoReply, PicturesByHash};
use crate::exchange::{Ask, Decided, Exchange, Fault, FaultKind, Reply, Usage};
use crate::gate::{self, Admission, Gate, Spent};
use crate::record::{self, Entry, Head, Record, Recorder};
use crate::session::{Session, Source};
use crate::settings::Then;

/// Asks for one mind in one episode run, and keeps its record.
pub struct Asker<'a> {
    session: &'a Session,
    thread: &'a mut Thread,
}

/// The record of one mind in one episode run, and what it is played again from.
#[derive(Default)]
pub struct Thread {
    recorder: Option<Recorder>,
    replay: VecDeque<Exchange>,
}

/// The run is to stop; whoever is asked decides nothing any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Halted;

impl Thread {
    /// Opens the record of this mind; where it can't, the session stops the run.
    pub fn open(session: &Session, key: &RunKey, agent: AgentId) -> Thread {
        let mut thread = Thread::default();
        let Some(run) = session.run() else { return thread };
        if let Source::Replay(from) = &session.source {
            match Record::read(from, &record::path(from, key, agent)) {
                Ok(record) => {
                    let exchanges = record.entries.into_iter().filter_map(|entry| match entry {
                        Entry::Exchange(exchange) => Some(*exchange),
                        Entry::Decided(_) => None,
                    });
                    thread.replay = exchanges.collect();
                }
                Err(error) => session.halt(format!("nothing to replay: {error}")),
            }
        }
        let head = Head::new(key, agent, &session.settings.asking.model);
        match Recorder::open(run, &record::path(run, key, agent), &head) {
            Ok(recorder) => thread.recorder = Some(recorder),
            Err(error) => session.halt(error.to_string()),
        }
        thread
    }

    fn push(&mut self, session: &Session, entry: Entry) -> Result<(), Halted> {
        let pushed = self.recorder.as_mut().map_or(Ok(()), |r| r.push(entry));
        pushed.map_err(|error| {
            session.halt(error.to_string());
            Halted
        })
    }

    /// Notes a decision.
    ///
    /// # Errors
    /// If it can't be written; the run stops.
    pub fn note(&mut self, session: &Session, decided: Decided) -> Result<(), Halted> {
        self.push(session, Entry::Decided(decided))
    }
}

impl<'a> Asker<'a> {
    /// Asks for the mind whose record this is.
    pub fn new(session: &'a Session, thread: &'a mut Thread) -> Asker<'a> {
        Asker { session, thread }
    }

    /// Asks. The pictures are those that the question names.
    ///
    /// # Errors
    /// If the run is to stop: by its user, because it pauses, or because a replay ends.
    pub fn ask(
        &mut self,
        frame: Frame,
        ask: Ask,
        pictures: &PicturesByHash,
    ) -> Result<Exchange, Halted> {
        let known = self.thread.recorder.as_mut().and_then(|r| r.known(&ask));
        let exchange = match (known, &self.session.source) {
            (Some(exchange), _) => {
                // What was answered in an earlier session takes its place in the replay too.
                self.thread.replay.pop_front();
                exchange
            }
            (None, Source::Live(client)) => self.live(client, frame, ask, pictures)?,
            (None, Source::Replay(_)) => self.again(frame, &ask)?,
            (None, Source::Offline) => {
                self.session.halt("there is no endpoint to ask".to_owned());
                return Err(Halted);
            }
        };
        self.thread.push(self.session, Entry::Exchange(Box::new(exchange.clone())))?;
        Ok(exchange)
    }

    /// The next exchange of the run that is played again.
    fn again(&mut self, frame: Frame, ask: &Ask) -> Result<Exchange, Halted> {
        let problem = match self.thread.replay.pop_front() {
            Some(exchange) if exchange.ask_hash == ask.hash() && exchange.frame == frame => {
                return Ok(exchange);
            }
            Some(other) => format!("it was asked something else at frame {}", other.frame),
            None => "it was asked nothing more".to_owned(),
        };
        self.session.halt(format!(
            "the replay differs at frame {frame}: in the recorded run {problem}; it needs the same \
             episodes, rules and version of chaic"
        ));
        Err(Halted)
    }

    fn live(
        &mut self,
        client: &Client,
        frame: Frame,
        ask: Ask,
        pictures: &PicturesByHash,
    ) -> Result<Exchange, Halted> {
        let Some(gate) = self.session.gate() else { return Err(Halted) };
        let settings = &self.session.settings;
        let worst = Spent::of(1, client.worst(&ask), &settings.price);
        let mut faults: Vec<Fault> = Vec::new();
        loop {
            match gate.enter(worst, self.session.stop) {
                Admission::Go => {}
                Admission::Stopped => return Err(Halted),
                Admission::Spent(what) => {
                    let fault = self.spent(what)?;
                    return Ok(Exchange::new(frame, ask, faults, Reply::Failed(fault)));
                }
            }
            let failure = match self.send(client, gate, worst, &ask, pictures) {
                Ok(reply) => return Ok(Exchange::new(frame, ask, faults, reply)),
                Err(NoReply::Abandoned) => return Err(Halted),
                Err(NoReply::Failed(failure)) => failure,
            };
            let Failure { fault, may_pass, retry_after } = failure;
            faults.push(fault.clone());
            let attempts = faults.len() as u32;
            if fault.kind == FaultKind::Schema {
                return Ok(Exchange::new(frame, ask, faults, Reply::Failed(fault)));
            }
            let is_over = !may_pass || attempts >= settings.faults.attempts;
            if is_over {
                self.given_up(&fault, attempts)?;
            }
            self.session.failed(&fault);
            if is_over {
                return Ok(Exchange::new(frame, ask, faults, Reply::Failed(fault)));
            }
            let wait = self.wait(&ask, attempts, retry_after);
            if !gate::sleep(wait, self.session.stop) {
                return Err(Halted);
            }
        }
    }

    fn send(
        &self,
        client: &Client,
        gate: &Gate,
        worst: Spent,
        ask: &Ask,
        pictures: &PicturesByHash,
    ) -> Result<Reply, NoReply> {
        let sent = client.send(ask, pictures, &|| self.session.is_interrupted());
        if sent.is_ok() {
            self.session.answered();
        }
        let usage = match &sent {
            Ok(Reply::Answer { usage, .. }) => *usage,
            // What a failed or abandoned request costs isn't told.
            _ => Usage::default(),
        };
        gate.settle(worst, Spent::of(1, usage, &self.session.settings.price));
        sent
    }

    /// How long to wait before the next attempt: twice as long each time, within the upper half of
    /// it so that those who failed together don't return together; or as long as the endpoint asks.
    fn wait(&self, ask: &Ask, attempts: u32, retry_after: Option<Duration>) -> Duration {
        let faults = &self.session.settings.faults;
        let longest = Duration::from_secs_f32(faults.longest_wait_secs);
        let first = Duration::from_secs_f32(faults.first_wait_secs);
        let doubled = first.saturating_mul(1 << (attempts - 1).min(20)).min(longest);
        let spread = ask.hash().to_string();
        let spread = u32::from_str_radix(&spread[..4], 16).unwrap_or(0) as f32 / 65536.0;
        let own = doubled.mul_f32(0.5 + 0.5 * spread);
        retry_after.map_or(own, |asked| asked.max(own)).min(longest)
    }

    fn spent(&self, what: &str) -> Result<Fault, Halted> {
        let detail = format!("the budget of {what} is spent");
        if self.session.settings.budget.then == Then::Pause {
            self.session.halt(format!("{detail}; go on with a larger one"));
            return Err(Halted);
        }
        Ok(Fault { kind: FaultKind::Budget, status: None, detail })
    }

    fn given_up(&self, fault: &Fault, attempts: u32) -> Result<(), Halted> {
        if self.session.settings.faults.then == Then::Pause {
            let times = if attempts == 1 { "once" } else { &format!("{attempts} times") };
            self.session.halt(format!("the model can't be asked (tried {times}): {fault}"));
            return Err(Halted);
        }
        Ok(())
    }
}
