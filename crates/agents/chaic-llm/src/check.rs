//! One small question, to see whether an endpoint is set up.

use std::fmt::Write as _;

use crate::endpoint::{Client, Failure, NoReply, PicturesByHash};
use crate::error::{LlmError, Result};
use crate::exchange::{Ask, FaultKind, Message, Purpose, Reply, Role};
use crate::settings::Settings;

/// Asks for a number of a list of two, by JSON schema and as text, and says in words what came of
/// it.
///
/// # Errors
/// [`LlmError::Endpoint`] if no answer comes.
pub fn check(settings: &Settings) -> Result<String> {
    let client = Client::new(settings)?;
    let text = "## Plans\n1. explore\n2. wait\n\nChoose one. Answer with JSON alone: \
                {\"reasoning\": \"why\", \"plan\": NUMBER}";
    let message = Message { role: Role::User, text: text.to_owned(), images: Vec::new() };
    let mut said = String::new();
    for (schema_of, form) in [(Some(2), "by JSON schema"), (None, "as text")] {
        let (model, messages) = (settings.asking.model.clone(), vec![message.clone()]);
        let ask = Ask { model, purpose: Purpose::Decide, messages, schema_of };
        match client.send(&ask, &PicturesByHash::new(), &|| false) {
            Ok(Reply::Answer { text, usage, latency_ms, .. }) => {
                let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
                let _ = writeln!(
                    said,
                    "{form}: answers in {latency_ms} ms with {} + {} tokens{}: {}",
                    usage.prompt,
                    usage.answer,
                    if usage.estimated { " (estimated)" } else { "" },
                    text.chars().take(200).collect::<String>()
                );
            }
            Err(NoReply::Failed(Failure { fault, .. })) if fault.kind == FaultKind::Schema => {
                let _ = writeln!(said, "{form}: refused; answers are asked for as text");
            }
            Err(NoReply::Failed(Failure { fault, .. })) => {
                return Err(LlmError::Endpoint { problem: fault.detail });
            }
            Err(NoReply::Abandoned) => {
                return Err(LlmError::Endpoint { problem: "nobody waits for it".to_owned() });
            }
            Ok(Reply::Failed(fault)) => {
                return Err(LlmError::Endpoint { problem: fault.detail });
            }
        }
    }
    Ok(said)
}
