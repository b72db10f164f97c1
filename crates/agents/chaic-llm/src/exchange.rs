//! One question and its answer, as they are recorded.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use chaic_core::Frame;

/// A digest of content: XXH3, 128 bits, 32 hexadecimal digits. It finds damage, not forgery.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContentHash(u128);

impl ContentHash {
    /// Of these bytes.
    pub fn of(bytes: &[u8]) -> ContentHash {
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
        value.map(ContentHash).ok_or_else(|| format!("`{text}` is no hash of 32 hex digits"))
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

/// Who speaks in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// This program.
    User,
    /// The model.
    Assistant,
}

/// One message of a question.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Message {
    /// Who speaks.
    pub role: Role,
    /// What is said.
    pub text: String,
    /// Hashes of the encoded pictures that come with it, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<ContentHash>,
}

/// Why the model is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// For reasoning and choice.
    Decide,
    /// For reasoning alone.
    Think,
    /// For the choice after the reasoning.
    Choose,
    /// Again, with what was wrong with the answer.
    Again,
}

/// A question: all that the answer depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ask {
    /// The model.
    pub model: String,
    /// Why it is asked.
    pub purpose: Purpose,
    /// What is said, in order.
    pub messages: Vec<Message>,
    /// Of how many plans one is to be named by JSON schema; absent for a text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schema_of: Option<usize>,
}

impl Ask {
    /// Its hash: with the recorded settings, the same question.
    pub fn hash(&self) -> ContentHash {
        let bytes = serde_json::to_vec(self).expect("a question has no maps and no failing parts");
        ContentHash::of(&bytes)
    }
}

/// What kind of thing went wrong with a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No connection, or it broke off.
    Connection,
    /// It took too long.
    Timeout,
    /// The endpoint answered with a status that is no success.
    Status,
    /// It refused the JSON schema.
    Schema,
    /// The answer was empty.
    Empty,
    /// The answer was longer than the limit.
    TooLong,
    /// The answer was no text.
    NotText,
    /// The answer was no JSON, or cut off.
    NotJson,
    /// The answer's JSON wasn't that of a chat completion.
    WrongShape,
    /// Nothing was sent, because the budget is spent.
    Budget,
}

/// What went wrong with a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What kind of thing.
    pub kind: FaultKind,
    /// The endpoint's status, if it gave one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<u16>,
    /// In words.
    pub detail: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.detail)
    }
}

/// How many tokens a request took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Usage {
    /// Of the prompt.
    pub prompt: u64,
    /// Of the answer.
    pub answer: u64,
    /// Whether the endpoint didn't say, so that they are estimated.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub estimated: bool,
}

/// What came back in the end.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Reply {
    /// An answer, whatever it says.
    Answer {
        /// What it says.
        text: String,
        /// Why it ends, in the endpoint's words.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        finish: Option<String>,
        /// What it took.
        usage: Usage,
        /// How long the model took, milliseconds; repeated requests and waits not counted.
        latency_ms: u64,
    },
    /// None.
    Failed(Fault),
}

impl Reply {
    /// The hash of what came back.
    pub fn hash(&self) -> ContentHash {
        let bytes = serde_json::to_vec(self).expect("a reply has no maps and no failing parts");
        ContentHash::of(&bytes)
    }
}

/// A question with what came back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exchange {
    /// When in the episode.
    pub frame: Frame,
    /// Hash of the question.
    pub ask_hash: ContentHash,
    /// The question.
    pub ask: Ask,
    /// What went wrong before, request by request.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// Hash of the reply.
    pub reply_hash: ContentHash,
    /// What came back in the end.
    pub reply: Reply,
}

impl Exchange {
    /// Of a question and its reply.
    pub fn new(frame: Frame, ask: Ask, faults: Vec<Fault>, reply: Reply) -> Exchange {
        let (ask_hash, reply_hash) = (ask.hash(), reply.hash());
        Exchange { frame, ask_hash, ask, faults, reply_hash, reply }
    }

    /// What is damaged, if something is.
    pub fn damage(&self) -> Option<&'static str> {
        if self.ask.hash() != self.ask_hash {
            return Some("the question isn't the one that was hashed");
        }
        (self.reply.hash() != self.reply_hash).then_some("the reply isn't the one that was hashed")
    }

    /// How many requests were sent.
    pub fn requests(&self) -> u64 {
        let last = match &self.reply {
            Reply::Answer { .. } => 1,
            // The last of the faults is the reply.
            Reply::Failed(_) => 0,
        };
        self.faults.len() as u64 + last
    }

    /// What it took.
    pub fn usage(&self) -> Usage {
        match &self.reply {
            Reply::Answer { usage, .. } => *usage,
            Reply::Failed(_) => Usage::default(),
        }
    }
}

/// Who made a decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// The model.
    Model,
    /// The fallback: what the model said was of no use.
    FallbackInvalid,
    /// The fallback: the model couldn't be asked.
    FallbackFault,
    /// The fallback: the budget is spent.
    FallbackBudget,
    /// Nobody: there was only one plan.
    OnlyPlan,
}

/// What was decided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decided {
    /// When in the episode.
    pub frame: Frame,
    /// Which of the listed plans, from 1; absent if it is none of them (a fallback's).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// It in words.
    pub plan: String,
    /// By whom.
    pub by: By,
    /// Whether the answer had to be read leniently.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub lenient: bool,
    /// Estimated tokens of the prompt; absent if there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prompt_tokens: Option<usize>,
    /// How much the prompt was shortened, 0 for not at all.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub shortened: usize,
    /// Frames that passed for thinking.
    #[serde(default, skip_serializing_if = "is_no_frame")]
    pub thinking_frames: Frame,
}

// `skip_serializing_if` hands over a reference.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero(n: &usize) -> bool {
    *n == 0
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_no_frame(n: &Frame) -> bool {
    *n == 0
}
