//! A record in words: as text beside the events of the trace, or as a list of decisions.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use chaic_core::{AgentId, Frame};
use chaic_env::RunKey;
use chaic_env::trace::{self, Trace};
use chaic_files::{EntryKind, kind_below};
use serde::Serialize;
use serde_json::Value;

use crate::error::{LlmError, Result};
use crate::exchange::{
    DecisionRecord, DecisionSource, Exchange, Fault, Message, Purpose, Reply, Role,
};
use crate::record::{self, DecisionLog, RecordEntry};

/// Level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Prompts, answers, choices and events.
    Full,
    /// Answers, choices and events.
    Brief,
}

/// Formats the record of one agent in one episode run, with the events of its trace.
///
/// # Errors
/// If there is no record, or it cannot be read.
pub fn text(
    run: &Path,
    key: &RunKey,
    agent: AgentId,
    trace: Option<&Trace>,
    detail: Detail,
) -> Result<String> {
    let path = record::path(run, key, agent);
    if kind_below(run, &path)? == EntryKind::Missing {
        return Err(LlmError::NoRecord { path });
    }
    let record = DecisionLog::read(run, &path)?;
    let header = &record.header;
    let mut text = format!(
        "{} with helper {}, seed {}: the {agent}'s decisions by {}\n",
        key.episode, key.helper, key.seed, header.model
    );
    let frames: Vec<Frame> = record
        .entries
        .iter()
        .filter_map(|e| match e {
            RecordEntry::Decision(decided) => Some(decided.frame),
            RecordEntry::Exchange(_) => None,
        })
        .collect();
    let mut n = 0;
    for entry in &record.entries {
        match entry {
            RecordEntry::Exchange(exchange) => write_exchange(&mut text, exchange, detail),
            RecordEntry::Decision(decided) => {
                n += 1;
                write_decision(&mut text, decided);
                let until = frames.get(n).copied();
                if let Some(trace) = trace {
                    write_events(&mut text, trace, decided.frame, until);
                }
            }
        }
    }
    write_counts(&mut text, &record);
    Ok(text)
}

fn write_exchange(text: &mut String, exchange: &Exchange, detail: Detail) {
    let purpose = match exchange.request.purpose {
        Purpose::Decide => "asked",
        Purpose::Think => "asked to reason",
        Purpose::Choose => "asked to choose",
        Purpose::Retry => "asked again",
    };
    let _ = writeln!(text, "\n=== frame {}: {purpose}, {}", exchange.frame, exchange.request_hash);
    for ExchangePart { heading, text: content } in passages(exchange, detail) {
        let _ = writeln!(text, "--- {heading}");
        if !content.is_empty() {
            let _ = writeln!(text, "{content}");
        }
    }
}

/// Part of an exchange with a model.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ExchangePart {
    /// Kind, for example `to the model, with 3 pictures`.
    pub heading: String,
    /// Text; empty for a failed request.
    pub text: String,
}

/// Decision with the exchanges before it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ShownDecision {
    /// Frame.
    pub frame: Frame,
    /// Plan, and who chose it.
    pub text: String,
    /// Messages of the exchanges, in order.
    pub passages: Vec<ExchangePart>,
}

/// Agent of an episode run whose plans a language model chose.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ShownAgent {
    /// Name of the agent: `partner` or `helper`.
    pub agent: String,
    /// Name of the model.
    pub model: String,
    /// Decisions, in order; those after [`MAX_SHOWN_BYTES`] have no passages.
    pub decisions: Vec<ShownDecision>,
    /// Number of decisions whose passages are left out.
    pub n_left_out: usize,
    /// Problem of a record that cannot be read; `None` otherwise.
    pub problem: Option<String>,
}

/// Maximum length of the passages of a [`ShownAgent`], bytes: several times that of an episode.
pub const MAX_SHOWN_BYTES: usize = 4 << 20;

impl ShownAgent {
    fn new(agent: AgentId, model: &str, mut decisions: Vec<ShownDecision>) -> ShownAgent {
        let (mut n_bytes, mut n_left_out) = (0, 0);
        for decision in &mut decisions {
            n_bytes += decision.passages.iter().map(|passage| passage.text.len()).sum::<usize>();
            if n_bytes > MAX_SHOWN_BYTES {
                decision.passages.clear();
                n_left_out += 1;
            }
        }
        let (agent, model) = (agent.to_string(), model.to_owned());
        ShownAgent { agent, model, decisions, n_left_out, problem: None }
    }
}

/// Returns the agents of an episode run that have a record. The problem of a damaged record is part of the
/// result.
pub fn agents(run: &Path, key: &RunKey) -> Vec<ShownAgent> {
    let read = |agent| {
        let path = record::path(run, key, agent);
        kind_below(run, &path).ok().filter(|kind| *kind != EntryKind::Missing)?;
        Some(match DecisionLog::read(run, &path) {
            Ok(log) => ShownAgent::new(agent, &log.header.model, decisions(&log)),
            Err(problem) => {
                let shown = ShownAgent::new(agent, "", Vec::new());
                ShownAgent { problem: Some(problem.to_string()), ..shown }
            }
        })
    };
    [AgentId::PARTNER, AgentId::HELPER].into_iter().filter_map(read).collect()
}

/// Returns the decisions of a record in words.
fn decisions(record: &DecisionLog) -> Vec<ShownDecision> {
    let mut decisions = Vec::new();
    let mut before = Vec::new();
    for entry in &record.entries {
        match entry {
            RecordEntry::Exchange(exchange) => before.extend(passages(exchange, Detail::Full)),
            RecordEntry::Decision(decided) => decisions.push(ShownDecision {
                frame: decided.frame,
                text: decision_text(decided),
                passages: std::mem::take(&mut before),
            }),
        }
    }
    decisions
}

/// Returns the messages of an exchange that are not part of an earlier one.
fn passages(exchange: &Exchange, detail: Detail) -> Vec<ExchangePart> {
    let messages = &exchange.request.messages;
    let is_first = matches!(exchange.request.purpose, Purpose::Decide | Purpose::Think);
    let shown = match detail {
        _ if !is_first => &messages[messages.len().saturating_sub(1)..],
        Detail::Full => messages,
        Detail::Brief => &[],
    };
    let message = |message: &Message| {
        let author = match message.role {
            Role::User => "to the model",
            Role::Assistant => "by the model",
        };
        let pictures = match message.images.len() {
            0 => String::new(),
            n => format!(", with {n} pictures"),
        };
        ExchangePart { heading: format!("{author}{pictures}"), text: message.text.clone() }
    };
    let fault =
        |fault: &Fault| ExchangePart { heading: format!("failed: {fault}"), text: String::new() };
    let mut passages: Vec<ExchangePart> = shown.iter().map(message).collect();
    passages.extend(exchange.faults.iter().map(fault));
    if let Reply::Answer { text, usage, latency_ms, .. } = &exchange.reply {
        let about = if usage.estimated { "about " } else { "" };
        let (prompt, answer, s) = (usage.prompt, usage.answer, *latency_ms as f64 / 1000.0);
        let heading = format!("answer ({about}{prompt} + {answer} tokens, {s:.1} s)");
        passages.push(ExchangePart { heading, text: text.clone() });
    }
    passages
}

fn write_decision(text: &mut String, decided: &DecisionRecord) {
    let _ = writeln!(text, ">>> frame {}: {}", decided.frame, decision_text(decided));
}

/// Describes the plan of a decision and who chose it.
fn decision_text(decided: &DecisionRecord) -> String {
    let by = match decided.source {
        DecisionSource::Model => "by the model",
        DecisionSource::FallbackInvalid => "by the fallback: no answer was of use",
        DecisionSource::FallbackFault => "by the fallback: the model couldn't be asked",
        DecisionSource::FallbackBudget => "by the fallback: the budget is spent",
        DecisionSource::OnlyPlan => "the only plan",
    };
    let number = decided.number.map_or(String::new(), |n| format!("plan {n}, "));
    let lenient = if decided.lenient { ", read leniently" } else { "" };
    format!("{} ({number}{by}{lenient})", decided.plan)
}

/// Appends the events of the trace between two decisions.
fn write_events(text: &mut String, trace: &Trace, from: Frame, until: Option<Frame>) {
    let events = trace.records.iter().filter_map(|r| match r {
        trace::Record::Event(event) => Some(event),
        _ => None,
    });
    let is_between = |frame: Frame| frame > from && until.is_none_or(|until| frame <= until);
    for event in events.filter(|e| is_between(e.event.frame)) {
        let value = serde_json::to_value(event).expect("an event has string keys");
        let _ = writeln!(text, "    {}", event_text(&value));
    }
}

/// Formats an event: frame, name, then its fields.
fn event_text(event: &Value) -> String {
    let field = |name: &str, value: &Value| {
        let person =
            value.as_u64().filter(|_| ["agent", "by", "leader", "follower"].contains(&name));
        let object = value.as_u64().filter(|_| ["object", "container", "on"].contains(&name));
        match (person, object, value) {
            (Some(n), _, _) => format!("{name} {}", AgentId(n as u8)),
            (_, Some(n), _) => format!("{name} #{n}"),
            (_, _, Value::String(text)) => format!("{name} {text}"),
            (_, _, other) => format!("{name} {other}"),
        }
    };
    let fields = event.as_object().into_iter().flatten();
    let fields: Vec<String> = fields
        .filter(|(name, value)| !["frame", "event"].contains(&name.as_str()) && !value.is_null())
        .map(|(name, value)| field(name, value))
        .collect();
    let name = event["event"].as_str().unwrap_or("event").replace('_', " ");
    format!("frame {}: {name}, {}", event["frame"], fields.join(", "))
}

fn write_counts(text: &mut String, record: &DecisionLog) {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    let mut add = |name, n: u64| *counts.entry(name).or_default() += n;
    for entry in &record.entries {
        match entry {
            RecordEntry::Exchange(exchange) => {
                add("questions", 1);
                add("requests", exchange.requests());
                add("faults", exchange.faults.len() as u64);
                add("asked again", u64::from(exchange.request.purpose == Purpose::Retry));
                add("prompt tokens", exchange.usage().prompt);
                add("answer tokens", exchange.usage().answer);
            }
            RecordEntry::Decision(decided) => {
                add("decisions", 1);
                add("decided by the model", u64::from(decided.source == DecisionSource::Model));
                let is_fallback =
                    !matches!(decided.source, DecisionSource::Model | DecisionSource::OnlyPlan);
                add("decided by the fallback", u64::from(is_fallback));
                add("read leniently", u64::from(decided.lenient));
                add("shortened prompts", u64::from(decided.shortened > 0));
            }
        }
    }
    text.push('\n');
    for (name, n) in counts {
        let _ = writeln!(text, "{n:>8} {name}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passages_after_the_limit_are_left_out() {
        let passage = || ExchangePart { heading: "answer".to_owned(), text: "x".repeat(3 << 20) };
        let decision =
            |frame| ShownDecision { frame, text: String::new(), passages: vec![passage()] };
        let shown = ShownAgent::new(AgentId::HELPER, "m", vec![decision(1), decision(2)]);
        let lengths: Vec<usize> = shown.decisions.iter().map(|d| d.passages.len()).collect();
        assert_eq!((lengths, shown.n_left_out), (vec![1, 0], 1));
    }
}
