//! Test request, to verify the setup of an endpoint.

use std::fmt::Write as _;

use crate::endpoint::{Client, Failure, ImagesByHash, NoReply};
use crate::error::{LlmError, Result};
use crate::exchange::{ChatRequest, FaultKind, Message, Purpose, Reply, Role};
use crate::settings::Settings;

/// Requests a number from a list of two, by JSON schema and as text; returns a summary of the
/// answers.
///
/// # Errors
/// [`LlmError::Endpoint`] without an answer.
pub fn check(settings: &Settings) -> Result<String> {
    let client = Client::new(settings)?;
    let text = "## Plans\n1. explore\n2. wait\n\nChoose one. Answer with JSON alone: \
                {\"reasoning\": \"why\", \"plan\": NUMBER}";
    let message = Message { role: Role::User, text: text.to_owned(), images: Vec::new() };
    let mut summary = String::new();
    for (n_schema_plans, form) in [(Some(2), "by JSON schema"), (None, "as text")] {
        let (model, messages) = (settings.request.model.clone(), vec![message.clone()]);
        let request = ChatRequest { model, purpose: Purpose::Decide, messages, n_schema_plans };
        match client.send(&request, &ImagesByHash::new(), &|| false) {
            Ok(Reply::Answer { text, usage, latency_ms, .. }) => {
                let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
                let _ = writeln!(
                    summary,
                    "{form}: answers in {latency_ms} ms with {} + {} tokens{}: {}",
                    usage.prompt,
                    usage.answer,
                    if usage.estimated { " (estimated)" } else { "" },
                    text.chars().take(200).collect::<String>()
                );
            }
            Err(NoReply::Failed(Failure { fault, .. })) if fault.kind == FaultKind::Schema => {
                let _ = writeln!(summary, "{form}: refused; answers are asked for as text");
            }
            Err(NoReply::Failed(Failure { fault, .. })) => {
                return Err(LlmError::Endpoint { problem: fault.detail });
            }
            Err(NoReply::Abandoned) => {
                return Err(LlmError::Endpoint { problem: "the request was abandoned".to_owned() });
            }
            Ok(Reply::Failed(fault)) => {
                return Err(LlmError::Endpoint { problem: fault.detail });
            }
        }
    }
    Ok(summary)
}
