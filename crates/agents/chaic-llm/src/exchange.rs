//! Recorded request and reply.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use chaic_core::Frame;

/// Content digest: XXH3, 128 bits, 32 hexadecimal digits. It detects damage, not forgery.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContentHash(u128);

impl ContentHash {
    /// Computes the digest of bytes.
    pub fn new(bytes: &[u8]) -> ContentHash {
        ContentHash(xxhash_rust::xxh3::xxh3_128(bytes))
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl fmt::Debug for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for ContentHash {
    type Err = String;

    fn from_str(text: &str) -> Result<ContentHash, String> {
        let value = (text.len() == 32).then(|| u128::from_str_radix(text, 16).ok()).flatten();
        value.map(ContentHash).ok_or_else(|| format!("`{text}` is not a hash of 32 hex digits"))
    }
}

impl Serialize for ContentHash {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for ContentHash {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<ContentHash, D::Error> {
        <std::borrow::Cow<'de, str>>::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

/// Author of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// This program.
    User,
    /// The model.
    Assistant,
}

/// Message of a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Message {
    /// Author.
    pub role: Role,
    /// Text.
    pub text: String,
    /// Hashes of the attached encoded images, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<ContentHash>,
}

/// Purpose of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Reasoning and choice.
    Decide,
    /// Reasoning only.
    Think,
    /// Choice after the reasoning.
    Choose,
    /// Repetition with a description of the problem.
    #[serde(rename = "again")]
    Retry,
}

/// Request: all inputs of the answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChatRequest {
    /// Name of the model.
    pub model: String,
    /// Purpose.
    pub purpose: Purpose,
    /// Messages, in order.
    pub messages: Vec<Message>,
    /// Number of plans in the JSON schema; absent for a text answer.
    #[serde(rename = "schema_of", default, skip_serializing_if = "Option::is_none")]
    pub n_schema_plans: Option<usize>,
}

impl ChatRequest {
    /// Returns the digest, which identifies the request under the recorded settings.
    pub fn hash(&self) -> ContentHash {
        let bytes = serde_json::to_vec(self).expect("a request has string keys");
        ContentHash::new(&bytes)
    }
}

/// Kind of a failed request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No connection, or it was interrupted.
    Connection,
    /// The time limit was exceeded.
    Timeout,
    /// The endpoint returned an error status.
    Status,
    /// The endpoint refused the JSON schema.
    Schema,
    /// The answer is empty.
    Empty,
    /// The answer exceeds the limit.
    TooLong,
    /// The answer is not UTF-8 text.
    NotText,
    /// The answer is not valid JSON, or truncated.
    NotJson,
    /// The answer is not a chat completion.
    WrongShape,
    /// The budget is spent; no request was sent.
    Budget,
}

/// Failed request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Kind.
    pub kind: FaultKind,
    /// Status code, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<u16>,
    /// Description.
    pub detail: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.detail)
    }
}

/// Tokens of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Usage {
    /// Tokens of the prompt.
    pub prompt: u64,
    /// Tokens of the answer.
    pub answer: u64,
    /// True if the counts are estimates, because the endpoint reports none.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub estimated: bool,
}

/// Final reply of a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Reply {
    /// Answer with any content.
    Answer {
        /// Text.
        text: String,
        /// Reason of its end, as reported.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        finish: Option<String>,
        /// Tokens.
        usage: Usage,
        /// Latency of the successful request, milliseconds, without retries and waits.
        latency_ms: u64,
    },
    /// No answer.
    Failed(Fault),
}

impl Reply {
    /// Returns whether the endpoint cut the answer off at the maximum length.
    pub fn is_truncated(&self) -> bool {
        matches!(self, Reply::Answer { finish: Some(reason), .. } if reason == "length")
    }

    /// Returns the digest of the reply.
    pub fn hash(&self) -> ContentHash {
        let bytes = serde_json::to_vec(self).expect("a reply has string keys");
        ContentHash::new(&bytes)
    }
}

/// Request with its reply.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exchange {
    /// Frame of the decision.
    pub frame: Frame,
    /// Digest of the request.
    #[serde(rename = "ask_hash")]
    pub request_hash: ContentHash,
    /// Request.
    #[serde(rename = "ask")]
    pub request: ChatRequest,
    /// Failures of the attempts, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// Digest of the reply.
    pub reply_hash: ContentHash,
    /// Final reply.
    pub reply: Reply,
}

impl Exchange {
    /// Creates an exchange with its digests.
    pub fn new(frame: Frame, request: ChatRequest, faults: Vec<Fault>, reply: Reply) -> Exchange {
        let (request_hash, reply_hash) = (request.hash(), reply.hash());
        Exchange { frame, request_hash, request, faults, reply_hash, reply }
    }

    /// Returns a description of damage, if any.
    pub fn damage(&self) -> Option<&'static str> {
        if self.request.hash() != self.request_hash {
            return Some("the request differs from its hash");
        }
        (self.reply.hash() != self.reply_hash).then_some("the reply differs from its hash")
    }

    /// Returns the number of requests sent.
    pub fn requests(&self) -> u64 {
        let last = match &self.reply {
            Reply::Answer { .. } => 1,
            // The last fault is the reply.
            Reply::Failed(_) => 0,
        };
        self.faults.len() as u64 + last
    }

    /// Returns the tokens of the reply.
    pub fn usage(&self) -> Usage {
        match &self.reply {
            Reply::Answer { usage, .. } => *usage,
            Reply::Failed(_) => Usage::default(),
        }
    }
}

/// Source of a decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DecisionSource {
    /// The model.
    Model,
    /// The fallback, after an invalid answer.
    FallbackInvalid,
    /// The fallback, after failed requests.
    FallbackFault,
    /// The fallback, with a spent budget.
    FallbackBudget,
    /// No choice: a single plan was valid.
    OnlyPlan,
}

/// Recorded decision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DecisionRecord {
    /// Frame of the decision.
    pub frame: Frame,
    /// Number of the listed plan, from 1; absent for a fallback plan outside of the list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Plan in words.
    pub plan: String,
    /// Source.
    #[serde(rename = "by")]
    pub source: DecisionSource,
    /// True if the answer was parsed leniently.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub lenient: bool,
    /// Estimated tokens of the prompt; absent without a prompt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prompt_tokens: Option<usize>,
    /// Level of shortening of the prompt, 0 for none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub shortened: usize,
    /// Frames that passed for thinking.
    #[serde(default, skip_serializing_if = "is_zero_frames")]
    pub thinking_frames: Frame,
}

// `skip_serializing_if` passes a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero(n: &usize) -> bool {
    *n == 0
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero_frames(n: &Frame) -> bool {
    *n == 0
}
