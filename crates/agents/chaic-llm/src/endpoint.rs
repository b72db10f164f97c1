//! Sending one question once.

mod wire;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use base64::Engine as _;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::error::Result;
use crate::exchange::{Ask, ContentHash, Fault, FaultKind, Reply, Role, Usage};
use crate::key::Key;
use crate::settings::{Asking, Kind, PictureFormat, Settings};
use crate::tokens;
use wire::{Response, Wire};

/// So much of what an endpoint says of an error is kept, characters.
const MAX_DETAIL: usize = 300;
/// Tokens that a picture is taken for where the endpoint doesn't say (two tiles of 512 pixels and
/// their base in the first vision models' counting).
const PICTURE_TOKENS: u64 = 425;

/// Encoded pictures by their hashes.
pub type PicturesByHash = BTreeMap<ContentHash, Vec<u8>>;

/// A request that didn't bring an answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// What went wrong.
    pub fault: Fault,
    /// Whether it may go well the next time.
    pub may_pass: bool,
    /// For how long the endpoint asks to wait.
    pub retry_after: Option<Duration>,
}

/// Why there is no reply.
#[derive(Clone, Debug, PartialEq)]
pub enum NoReply {
    /// The request failed.
    Failed(Failure),
    /// Nobody waits for it any more.
    Abandoned,
}

impl From<Failure> for NoReply {
    fn from(failure: Failure) -> NoReply {
        NoReply::Failed(failure)
    }
}

/// A way to an endpoint.
pub struct Client {
    wire: Arc<Wire>,
    kind: Kind,
    key: Key,
    asking: Asking,
}

impl Client {
    /// A way to the endpoint of these settings. Nothing is sent yet.
    ///
    /// # Errors
    /// If the key is missing.
    pub fn new(settings: &Settings) -> Result<Client> {
        let key = Key::from_env(&settings.key_env())?;
        Ok(Client::with_key(settings, key))
    }

    /// The same with a key that is known already.
    pub fn with_key(settings: &Settings, key: Key) -> Client {
        let wire = Arc::new(Wire::new(settings, key.clone()));
        Client { wire, kind: settings.endpoint.kind, key, asking: settings.asking.clone() }
    }

    /// What the question's tokens are at most, for the budget.
    pub fn worst(&self, ask: &Ask) -> Usage {
        let text: usize = ask.messages.iter().map(|m| tokens::estimate(&m.text)).sum();
        let images: usize = ask.messages.iter().map(|m| m.images.len()).sum();
        let prompt = text as u64 + images as u64 * PICTURE_TOKENS;
        Usage { prompt, answer: u64::from(self.asking.answer_tokens), estimated: true }
    }

    /// Asks once. Who waits looks now and then whether to go on waiting; an answer that is on its way
    /// still has a moment to arrive then, as it is paid for.
    ///
    /// # Errors
    /// Whatever goes wrong on the way, or with what comes back; or nobody waits any more.
    pub fn send(
        &self,
        ask: &Ask,
        pictures: &PicturesByHash,
        is_given_up: &dyn Fn() -> bool,
    ) -> std::result::Result<Reply, NoReply> {
        let body = self.body(ask, pictures).to_string();
        let Response { status, retry_after, body, latency } =
            wire::post(&self.wire, body, is_given_up)?;
        if !(200..300).contains(&status) {
            let said = body.map_or(String::new(), |b| String::from_utf8_lossy(&b).into_owned());
            return Err(self.refusal(status, &said, retry_after, ask).into());
        }
        Ok(self.reply(ask, body?, latency)?)
    }

    /// The request as the endpoint gets it.
    fn body(&self, ask: &Ask, pictures: &PicturesByHash) -> Value {
        let mut body = Map::new();
        if self.kind == Kind::Openai {
            body.insert("model".to_owned(), json!(ask.model));
        }
        let messages: Vec<Value> = ask.messages.iter().map(|m| self.message(m, pictures)).collect();
        body.insert("messages".to_owned(), Value::Array(messages));
        let Asking { temperature, top_p, seed, answer_tokens, answer_tokens_field, .. } =
            &self.asking;
        let optional = [
            ("temperature", temperature.map(|x| json!(x))),
            ("top_p", top_p.map(|x| json!(x))),
            ("seed", seed.map(|s| json!(s))),
            (answer_tokens_field.as_str(), Some(json!(answer_tokens))),
            ("response_format", ask.schema_of.map(schema)),
        ];
        for (name, value) in optional {
            if let Some(value) = value {
                body.insert(name.to_owned(), value);
            }
        }
        body.retain(|name, _| !self.asking.omit.contains(name));
        body.extend(self.asking.extra.clone());
        Value::Object(body)
    }

    fn message(&self, message: &crate::exchange::Message, pictures: &PicturesByHash) -> Value {
        let role = match message.role {
            Role::User => "user",
            Role::Assistant => "assistant",
        };
        if message.images.is_empty() {
            return json!({ "role": role, "content": message.text });
        }
        let kind = match self.asking.images.format {
            PictureFormat::Png => "image/png",
            PictureFormat::Jpeg => "image/jpeg",
        };
        let encode = |bytes: &Vec<u8>| base64::engine::general_purpose::STANDARD.encode(bytes);
        let image = |hash: &ContentHash| {
            let url =
                format!("data:{kind};base64,{}", pictures.get(hash).map_or(String::new(), encode));
            json!({ "type": "image_url", "image_url": { "url": url } })
        };
        let text = json!({ "type": "text", "text": message.text });
        let parts: Vec<Value> =
            std::iter::once(text).chain(message.images.iter().map(image)).collect();
        json!({ "role": role, "content": parts })
    }

    fn refusal(
        &self,
        status: u16,
        said: &str,
        retry_after: Option<Duration>,
        ask: &Ask,
    ) -> Failure {
        // What is said of a wrong key may repeat part of it.
        let is_about_key = matches!(status, 401 | 403);
        let said: String = if is_about_key { String::new() } else { summary(said) };
        let said = self.key.mask(said);
        let about_schema =
            ["response_format", "json_schema", "schema"].iter().any(|w| said.contains(w));
        let refuses_schema = matches!(status, 400 | 422) && ask.schema_of.is_some() && about_schema;
        let colon = if said.is_empty() { "" } else { ": " };
        let hint = match status {
            401 | 403 => "; is the key right?",
            404 => "; are address and model right?",
            300..=399 => "; give the address that it redirects to",
            _ => "",
        };
        let detail = format!("the endpoint answers with status {status}{colon}{said}{hint}");
        let kind = if refuses_schema { FaultKind::Schema } else { FaultKind::Status };
        let fault = Fault { kind, status: Some(status), detail };
        let may_pass = matches!(status, 408 | 409 | 425 | 429) || status >= 500;
        Failure { fault, may_pass, retry_after }
    }

    /// What an answer's bytes say.
    fn reply(
        &self,
        ask: &Ask,
        bytes: Vec<u8>,
        latency: Duration,
    ) -> std::result::Result<Reply, Failure> {
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(failure(FaultKind::Empty, "the answer is empty".to_owned()));
        }
        let text = String::from_utf8(bytes)
            .map_err(|_| failure(FaultKind::NotText, "the answer is no UTF-8".to_owned()))?;
        let value: Value = serde_json::from_str(&text).map_err(|e| {
            failure(
                FaultKind::NotJson,
                format!("the answer is no whole JSON (line {}, column {})", e.line(), e.column()),
            )
        })?;
        let wrong = |what: &str| {
            failure(FaultKind::WrongShape, format!("the answer is no chat completion: {what}"))
        };
        let completion: Completion =
            serde_json::from_value(value).map_err(|e| wrong(&summary(&e.to_string())))?;
        let choice = completion.choices.into_iter().next().ok_or_else(|| wrong("no choice"))?;
        let text = said(&choice.message.content).or(choice.message.refusal).unwrap_or_default();
        let text = self.key.mask(text);
        let usage = match completion.usage.as_ref().and_then(usage_of) {
            Some(usage) => usage,
            None => Usage { answer: tokens::estimate(&text) as u64, ..self.worst(ask) },
        };
        let finish = choice.finish_reason.map(|reason| self.key.mask(summary(&reason)));
        Ok(Reply::Answer { text, finish, usage, latency_ms: latency.as_millis() as u64 })
    }
}

/// What is read of an answer; everything else is left alone.
#[derive(Deserialize)]
struct Completion {
    choices: Vec<CompletionChoice>,
    #[serde(default)]
    usage: Option<Value>,
}

#[derive(Deserialize)]
struct CompletionChoice {
    message: CompletionMessage,
    #[serde(default)]
    finish_reason: Option<String>,
}

#[derive(Deserialize)]
struct CompletionMessage {
    #[serde(default)]
    content: Value,
    #[serde(default)]
    refusal: Option<String>,
}

/// A message's text: as such, or in parts.
fn said(content: &Value) -> Option<String> {
    let part = |part: &Value| part["text"].as_str().map(str::to_owned);
    let parts = content.as_array().map(|parts| parts.iter().filter_map(part).collect());
    content.as_str().map(str::to_owned).or(parts)
}

/// What an endpoint says a request took, if that makes sense.
fn usage_of(usage: &Value) -> Option<Usage> {
    /// More than any request has.
    const MAX_TOKENS: u64 = 1_000_000_000;
    let tokens = |name: &str| usage[name].as_u64().map(|n| n.min(MAX_TOKENS));
    let (prompt, answer) = (tokens("prompt_tokens")?, tokens("completion_tokens").unwrap_or(0));
    Some(Usage { prompt, answer, estimated: false })
}

/// The form of an answer that names one of `n` plans.
fn schema(n: usize) -> Value {
    let numbers: Vec<usize> = (1..=n).collect();
    json!({
        "type": "json_schema",
        "json_schema": {
            "name": "decision",
            "strict": true,
            "schema": {
                "type": "object",
                "properties": {
                    "reasoning": { "type": "string" },
                    "plan": { "type": "integer", "enum": numbers },
                },
                "required": ["reasoning", "plan"],
                "additionalProperties": false,
            },
        },
    })
}

fn failure(kind: FaultKind, detail: String) -> Failure {
    let fault = Fault { kind, status: None, detail };
    Failure { fault, may_pass: true, retry_after: None }
}

/// The beginning of what somebody else said, as one line.
fn summary(said: &str) -> String {
    let line = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let clean: String = line.chars().filter(|c| !c.is_control()).take(MAX_DETAIL).collect();
    clean
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn settings(url: &str, kind: Kind) -> Settings {
        let mut settings = Settings::default();
        (settings.endpoint.url, settings.endpoint.kind) = (url.to_owned(), kind);
        settings.asking.model = "m".to_owned();
        settings
    }

    #[test]
    fn what_endpoints_say_in_their_own_ways_is_understood() {
        assert_eq!(said(&json!("yes")), Some("yes".to_owned()));
        let parts = json!([{ "type": "text", "text": "y" }, { "text": "es" }]);
        assert_eq!(said(&parts), Some("yes".to_owned()));
        assert_eq!((said(&json!(null)), said(&json!({}))), (None, None));
        let usage = json!({ "prompt_tokens": u64::MAX, "completion_tokens": -1 });
        let counted = usage_of(&usage).expect("it counts prompts");
        assert_eq!((counted.prompt, counted.answer), (1_000_000_000, 0));
        assert_eq!(usage_of(&json!({ "prompt_tokens": "many" })), None);
    }

    #[test]
    fn a_request_has_what_the_settings_say() {
        let mut settings = settings("http://h/v1", Kind::Openai);
        settings.asking.answer_tokens_field = "max_completion_tokens".to_owned();
        settings.asking.extra.insert("think".to_owned(), json!(false));
        settings.asking.omit = vec!["top_p".to_owned()];
        let client = Client::with_key(&settings, Key::new(""));
        let picture = ContentHash::of(b"x");
        let message = crate::exchange::Message {
            role: Role::User,
            text: "hello".to_owned(),
            images: vec![picture],
        };
        let ask = Ask {
            model: "m".to_owned(),
            purpose: crate::exchange::Purpose::Decide,
            messages: vec![message],
            schema_of: Some(2),
        };
        let pictures = PicturesByHash::from([(picture, b"x".to_vec())]);
        let body = client.body(&ask, &pictures);
        assert_eq!((&body["temperature"], body.get("top_p")), (&json!(0.7), None));
        assert_eq!((&body["max_completion_tokens"], &body["think"]), (&json!(512), &json!(false)));
        let numbers =
            &body["response_format"]["json_schema"]["schema"]["properties"]["plan"]["enum"];
        assert_eq!(*numbers, json!([1, 2]));
        let parts = &body["messages"][0]["content"];
        assert_eq!(parts[0]["text"], json!("hello"));
        assert_eq!(parts[1]["image_url"]["url"], json!("data:image/png;base64,eA=="));
        assert_eq!(body["model"], json!("m"));
    }
}
