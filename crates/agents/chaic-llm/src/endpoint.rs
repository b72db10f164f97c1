//! One request to an endpoint, without retries.

mod wire;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use base64::Engine as _;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::error::Result;
use crate::exchange::{ChatRequest, ContentHash, Fault, FaultKind, Reply, Role, Usage};
use crate::key::ApiKey;
use crate::settings::{EndpointKind, ImageEncoding, PromptSettings, Settings};
use crate::tokens;
use wire::{Response, Wire};

/// Maximum length of a stored error description, characters.
const MAX_DETAIL: usize = 300;
/// Estimated tokens of an image if the endpoint reports none (two tiles of 512 pixels and their
/// base in the first vision models).
const IMAGE_TOKENS: u64 = 425;

/// Encoded images by hash.
pub type ImagesByHash = BTreeMap<ContentHash, Vec<u8>>;

/// Failed request.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// Cause.
    pub fault: Fault,
    /// True if a retry may succeed.
    pub is_retryable: bool,
    /// Wait that the endpoint requests.
    pub retry_after: Option<Duration>,
}

/// Reason for a missing reply.
#[derive(Clone, Debug, PartialEq)]
pub enum NoReply {
    /// The request failed.
    Failed(Failure),
    /// The caller stopped waiting.
    Abandoned,
}

impl From<Failure> for NoReply {
    fn from(failure: Failure) -> NoReply {
        NoReply::Failed(failure)
    }
}

/// Client of an endpoint.
pub struct Client {
    wire: Arc<Wire>,
    kind: EndpointKind,
    key: ApiKey,
    settings: PromptSettings,
}

impl Client {
    /// Creates a client of the endpoint in the settings, without sending a request.
    ///
    /// # Errors
    /// If the key is missing.
    pub fn new(settings: &Settings) -> Result<Client> {
        let key = ApiKey::from_env(&settings.key_env())?;
        Ok(Client::with_key(settings, key))
    }

    /// Creates a client with a known key.
    pub fn with_key(settings: &Settings, key: ApiKey) -> Client {
        let wire = Arc::new(Wire::new(settings, key.clone()));
        Client { wire, kind: settings.endpoint.kind, key, settings: settings.request.clone() }
    }

    /// Returns the maximum usage of a request, for the budget.
    pub fn max_usage(&self, request: &ChatRequest) -> Usage {
        let text: usize = request.messages.iter().map(|m| tokens::estimate(&m.text)).sum();
        let images: usize = request.messages.iter().map(|m| m.images.len()).sum();
        let prompt = text as u64 + images as u64 * IMAGE_TOKENS;
        Usage { prompt, answer: u64::from(self.settings.max_answer_tokens), estimated: true }
    }

    /// Sends a request once. `is_abandoned` is polled during the wait; after it returns true, an
    /// answer in transit has a grace period, since it is paid for.
    ///
    /// # Errors
    /// A failed request, an invalid answer, or an abandoned wait.
    pub fn send(
        &self,
        request: &ChatRequest,
        images_by_hash: &ImagesByHash,
        is_abandoned: &dyn Fn() -> bool,
    ) -> std::result::Result<Reply, NoReply> {
        let body = self.body(request, images_by_hash).to_string();
        let Response { status, retry_after, body, latency } =
            wire::post(&self.wire, body, is_abandoned)?;
        if !(200..300).contains(&status) {
            let description =
                body.map_or(String::new(), |b| String::from_utf8_lossy(&b).into_owned());
            return Err(self.refusal(status, &description, retry_after, request).into());
        }
        Ok(self.parse_reply(request, body?, latency)?)
    }

    /// Returns the request body.
    fn body(&self, request: &ChatRequest, images_by_hash: &ImagesByHash) -> Value {
        let mut body = Map::new();
        if self.kind == EndpointKind::Openai {
            body.insert("model".to_owned(), json!(request.model));
        }
        let messages: Vec<Value> =
            request.messages.iter().map(|m| self.message(m, images_by_hash)).collect();
        body.insert("messages".to_owned(), Value::Array(messages));
        let PromptSettings {
            temperature, top_p, seed, max_answer_tokens, max_tokens_field, ..
        } = &self.settings;
        let optional = [
            ("temperature", temperature.map(|x| json!(x))),
            ("top_p", top_p.map(|x| json!(x))),
            ("seed", seed.map(|s| json!(s))),
            (max_tokens_field.as_str(), Some(json!(max_answer_tokens))),
            ("response_format", request.n_schema_plans.map(schema)),
        ];
        for (name, value) in optional {
            if let Some(value) = value {
                body.insert(name.to_owned(), value);
            }
        }
        body.retain(|name, _| !self.settings.omit_fields.contains(name));
        body.extend(self.settings.extra.clone());
        Value::Object(body)
    }

    fn message(&self, message: &crate::exchange::Message, images_by_hash: &ImagesByHash) -> Value {
        let role = match message.role {
            Role::User => "user",
            Role::Assistant => "assistant",
        };
        if message.images.is_empty() {
            return json!({ "role": role, "content": message.text });
        }
        let kind = match self.settings.images.format {
            ImageEncoding::Png => "image/png",
            ImageEncoding::Jpeg => "image/jpeg",
        };
        let encode = |bytes: &Vec<u8>| base64::engine::general_purpose::STANDARD.encode(bytes);
        let image = |hash: &ContentHash| {
            let url = format!(
                "data:{kind};base64,{}",
                images_by_hash.get(hash).map_or(String::new(), encode)
            );
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
        text: &str,
        retry_after: Option<Duration>,
        request: &ChatRequest,
    ) -> Failure {
        // The description of a key error may repeat part of the key.
        let is_about_key = matches!(status, 401 | 403);
        let text = if is_about_key { String::new() } else { self.masked_summary(text) };
        let lower = text.to_lowercase();
        let about_schema = ["response_format", "response format", "schema", "structured output"]
            .iter()
            .any(|w| lower.contains(w));
        let refuses_schema =
            matches!(status, 400 | 422) && request.n_schema_plans.is_some() && about_schema;
        let colon = if text.is_empty() { "" } else { ": " };
        let hint = match status {
            401 | 403 => "; is the key right?",
            404 => "; are address and model right?",
            300..=399 => "; give the address that it redirects to",
            _ => "",
        };
        let detail = format!("the endpoint answers with status {status}{colon}{text}{hint}");
        let kind = if refuses_schema { FaultKind::Schema } else { FaultKind::Status };
        let fault = Fault { kind, status: Some(status), detail };
        let is_retryable = matches!(status, 408 | 409 | 425 | 429) || status >= 500;
        Failure { fault, is_retryable, retry_after }
    }

    /// Parses the bytes of an answer, as [`Client::send`] does.
    ///
    /// # Errors
    /// If they are no chat completion.
    pub fn parse_reply(
        &self,
        request: &ChatRequest,
        bytes: Vec<u8>,
        latency: Duration,
    ) -> std::result::Result<Reply, Failure> {
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(failure(FaultKind::Empty, "the answer is empty".to_owned()));
        }
        let text = String::from_utf8(bytes)
            .map_err(|_| failure(FaultKind::NotText, "the answer is not UTF-8".to_owned()))?;
        let value: Value = serde_json::from_str(&text).map_err(|e| {
            failure(
                FaultKind::NotJson,
                format!(
                    "the answer is not complete JSON (line {}, column {})",
                    e.line(),
                    e.column()
                ),
            )
        })?;
        let wrong = |problem: &str| {
            failure(
                FaultKind::WrongShape,
                format!("the answer is not a chat completion: {problem}"),
            )
        };
        let reported = reported_error(&value);
        // The error quotes the unexpected value.
        let completion: Completion = serde_json::from_value(value)
            .map_err(|e| wrong(&self.masked_summary(&reported.unwrap_or_else(|| e.to_string()))))?;
        let choice = completion.choices.into_iter().next().ok_or_else(|| wrong("no choice"))?;
        let text =
            message_text(&choice.message.content).or(choice.message.refusal).unwrap_or_default();
        let text = self.key.mask(text);
        let usage = match completion.usage.as_ref().and_then(usage_of) {
            Some(usage) => usage,
            None => Usage { answer: tokens::estimate(&text) as u64, ..self.max_usage(request) },
        };
        let finish = choice.finish_reason.map(|reason| self.masked_summary(&reason));
        Ok(Reply::Answer { text, finish, usage, latency_ms: latency.as_millis() as u64 })
    }

    /// Returns the start of a text from the endpoint as one line. The key is masked first, because a
    /// cut could leave a part of it.
    fn masked_summary(&self, text: &str) -> String {
        summary(&self.key.mask(text.to_owned()))
    }
}

/// Fields of an answer that are read; all others are ignored.
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

/// Returns the error in a body with a status of success, as some gateways send it. The description of a key
/// error may repeat part of the key.
fn reported_error(body: &Value) -> Option<String> {
    let error = &body["error"];
    let text = error["message"].as_str().or_else(|| error.as_str())?;
    let text = if text.to_lowercase().contains("key") { "a key error" } else { text };
    Some(format!("the endpoint reports {text}"))
}

/// Returns the text of a message, given as a string or in parts.
fn message_text(content: &Value) -> Option<String> {
    let part = |part: &Value| part["text"].as_str().map(str::to_owned);
    let parts = content.as_array().map(|parts| parts.iter().filter_map(part).collect());
    content.as_str().map(str::to_owned).or(parts)
}

/// Returns the reported usage if it is plausible.
fn usage_of(usage: &Value) -> Option<Usage> {
    /// Upper limit of a plausible token count.
    const MAX_TOKENS: u64 = 1_000_000_000;
    let tokens = |name: &str| usage[name].as_u64().map(|n| n.min(MAX_TOKENS));
    let (prompt, answer) = (tokens("prompt_tokens")?, tokens("completion_tokens").unwrap_or(0));
    Some(Usage { prompt, answer, estimated: false })
}

/// Returns the JSON schema of an answer that names one of `n` plans.
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
    Failure { fault, is_retryable: true, retry_after: None }
}

/// Returns the start of a text from an endpoint as one line.
fn summary(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let clean: String = line.chars().filter(|c| !c.is_control()).take(MAX_DETAIL).collect();
    clean
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn settings(url: &str, kind: EndpointKind) -> Settings {
        let mut settings = Settings::default();
        (settings.endpoint.url, settings.endpoint.kind) = (url.to_owned(), kind);
        settings.request.model = "m".to_owned();
        settings
    }

    #[test]
    fn all_known_forms_of_contents_and_usage_are_parsed() {
        assert_eq!(message_text(&json!("yes")), Some("yes".to_owned()));
        let parts = json!([{ "type": "text", "text": "y" }, { "text": "es" }]);
        assert_eq!(message_text(&parts), Some("yes".to_owned()));
        assert_eq!((message_text(&json!(null)), message_text(&json!({}))), (None, None));
        let usage = json!({ "prompt_tokens": u64::MAX, "completion_tokens": -1 });
        let counted = usage_of(&usage).expect("the prompt tokens are counted");
        assert_eq!((counted.prompt, counted.answer), (1_000_000_000, 0));
        assert_eq!(usage_of(&json!({ "prompt_tokens": "many" })), None);
    }

    fn client_and_request(key: &str, n_schema_plans: Option<usize>) -> (Client, ChatRequest) {
        let settings = settings("http://h/v1", EndpointKind::Openai);
        let (model, messages) = ("m".to_owned(), Vec::new());
        let purpose = crate::exchange::Purpose::Decide;
        let request = ChatRequest { model, purpose, messages, n_schema_plans };
        (Client::with_key(&settings, ApiKey::new(key)), request)
    }

    #[test]
    fn refusals_of_a_schema_are_recognized() {
        let kind = |n_schema_plans, status, text: &str| {
            let (client, request) = client_and_request("", n_schema_plans);
            client.refusal(status, text, None, &request).fault.kind
        };
        for text in [
            "response_format of type json_schema is not supported",
            "JSON Schema is not supported by this model",
            "This model does not support response format `json`",
            "Structured Outputs are unavailable",
        ] {
            assert_eq!(kind(Some(2), 400, text), FaultKind::Schema, "{text}");
            assert_eq!(kind(None, 400, text), FaultKind::Status, "no schema was sent");
            assert_eq!(kind(Some(2), 500, text), FaultKind::Status, "{text}");
        }
        assert_eq!(kind(Some(2), 400, "temperature is too high"), FaultKind::Status);
    }

    #[test]
    fn an_error_with_a_status_of_success_is_described() {
        let (client, request) = client_and_request("", None);
        let detail = |body: Value| {
            let bytes = body.to_string().into_bytes();
            client.parse_reply(&request, bytes, Duration::ZERO).unwrap_err().fault.detail
        };
        for body in [
            json!({ "error": { "message": "no capacity", "code": 502 } }),
            json!({ "error": "no capacity" }),
        ] {
            let detail = detail(body);
            assert!(detail.ends_with("the endpoint reports no capacity"), "{detail}");
        }
        // Endpoints quote the start of a wrong key.
        let wrong_key = json!({ "error": { "message": "Incorrect API key: sk-ses***89" } });
        assert!(detail(wrong_key).ends_with("the endpoint reports a key error"));
        assert!(detail(json!({})).contains("missing field"));
    }

    #[test]
    fn descriptions_of_failures_contain_no_part_of_the_key() {
        const KEY: &str = "sk-sesame-0123456789";
        let (client, request) = client_and_request(KEY, None);
        for body in [
            json!({ "choices": format!("the key is {KEY}") }),
            json!({ "choices": [{ "message": KEY }] }),
        ] {
            let bytes = body.to_string().into_bytes();
            let failure = client.parse_reply(&request, bytes, Duration::ZERO).unwrap_err();
            let detail = failure.fault.detail;
            assert!(detail.contains("[key]") && !detail.contains("sesame"), "{detail}");
        }
        // The limit of a description is in the middle of the key.
        let text = "x".repeat(MAX_DETAIL - 9) + KEY;
        let detail = client.refusal(400, &text, None, &request).fault.detail;
        assert!(!detail.contains("sk-"), "{detail}");
    }

    #[test]
    fn a_request_has_the_fields_of_the_settings() {
        let mut settings = settings("http://h/v1", EndpointKind::Openai);
        settings.request.max_tokens_field = "max_completion_tokens".to_owned();
        settings.request.extra.insert("think".to_owned(), json!(false));
        settings.request.omit_fields = vec!["top_p".to_owned()];
        let client = Client::with_key(&settings, ApiKey::new(""));
        let image = ContentHash::new(b"x");
        let message = crate::exchange::Message {
            role: Role::User,
            text: "hello".to_owned(),
            images: vec![image],
        };
        let request = ChatRequest {
            model: "m".to_owned(),
            purpose: crate::exchange::Purpose::Decide,
            messages: vec![message],
            n_schema_plans: Some(2),
        };
        let images_by_hash = ImagesByHash::from([(image, b"x".to_vec())]);
        let body = client.body(&request, &images_by_hash);
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
