//! Text output of a record, beside the events of the trace.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use chaic_core::{AgentId, Frame};
use chaic_env::RunKey;
use chaic_env::trace::{self, Trace};
use chaic_files::{EntryKind, kind_below};
use serde_json::Value;

use crate::error::{LlmError, Result};
use crate::exchange::{DecisionRecord, DecisionSource, Exchange, Purpose, Reply, Role};
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
        Purpose::Again => "asked again",
    };
    let _ = writeln!(text, "\n=== frame {}: {purpose}, {}", exchange.frame, exchange.request_hash);
    let last_message = exchange.request.messages.last();
    match (detail, exchange.request.purpose) {
        (Detail::Full, Purpose::Decide | Purpose::Think) => {
            for message in &exchange.request.messages {
                let author = match message.role {
                    Role::User => "to the model",
                    Role::Assistant => "by the model",
                };
                let pictures = match message.images.len() {
                    0 => String::new(),
                    n => format!(", with {n} pictures"),
                };
                let _ = writeln!(text, "--- {author}{pictures}\n{}", message.text);
            }
        }
        // Earlier messages are printed above.
        (_, Purpose::Choose | Purpose::Again) => {
            let _ = writeln!(text, "--- to the model\n{}", last_message.map_or("", |m| &m.text));
        }
        (Detail::Brief, _) => {}
    }
    for fault in &exchange.faults {
        let _ = writeln!(text, "--- failed: {fault}");
    }
    if let Reply::Answer { text: answer, usage, latency_ms, .. } = &exchange.reply {
        let about = if usage.estimated { "about " } else { "" };
        let _ = writeln!(
            text,
            "--- answer ({about}{} + {} tokens, {:.1} s)\n{answer}",
            usage.prompt,
            usage.answer,
            *latency_ms as f64 / 1000.0
        );
    }
}

fn write_decision(text: &mut String, decided: &DecisionRecord) {
    let by = match decided.source {
        DecisionSource::Model => "by the model",
        DecisionSource::FallbackInvalid => "by the fallback: no answer was of use",
        DecisionSource::FallbackFault => "by the fallback: the model couldn't be asked",
        DecisionSource::FallbackBudget => "by the fallback: the budget is spent",
        DecisionSource::OnlyPlan => "the only plan",
    };
    let number = decided.number.map_or(String::new(), |n| format!("plan {n}, "));
    let lenient = if decided.lenient { ", read leniently" } else { "" };
    let DecisionRecord { frame, plan, .. } = decided;
    let _ = writeln!(text, ">>> frame {frame}: {plan} ({number}{by}{lenient})");
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
                add("asked again", u64::from(exchange.request.purpose == Purpose::Again));
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
