//! Settings of language helpers: the configuration file.

mod check;

use std::path::{Path, PathBuf};

use chaic_files::{read_user_file, toml_message};
use serde::{Deserialize, Serialize};

use crate::error::{LlmError, Result};
use crate::exchange::Usage;

/// Maximum size of a configuration file, bytes.
const MAX_CONFIG_BYTES: usize = 1 << 20;

/// All settings. [`PromptSettings`] affect results and must stay equal when a run is resumed or
/// replayed; the others may change.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Requests and the use of answers.
    #[serde(alias = "asking")]
    pub request: PromptSettings,
    /// Endpoint.
    pub endpoint: Endpoint,
    /// Handling of failures.
    #[serde(alias = "faults")]
    pub retry: RetrySettings,
    /// Budget.
    pub budget: Budget,
    /// Prices of tokens.
    pub price: Price,
}

/// Requests and the use of answers: all settings that affect results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PromptSettings {
    /// Name of the model at the endpoint (for Azure: the deployment).
    pub model: String,
    /// Folder of templates that replace built-in ones; missing files are built in.
    pub templates: Option<PathBuf>,
    /// Number of requests per decision.
    pub steps: PromptSteps,
    /// Form of answers.
    #[serde(alias = "form")]
    pub answer_format: AnswerForm,
    /// Sampling temperature; absent for the endpoint's default.
    pub temperature: Option<f64>,
    /// Nucleus sampling probability; absent for the endpoint's default.
    pub top_p: Option<f64>,
    /// Seed of sampling, for endpoints that support it.
    pub seed: Option<u64>,
    /// Maximum tokens of an answer.
    #[serde(alias = "answer_tokens")]
    pub max_answer_tokens: u32,
    /// Name of that limit in a request: `max_tokens`, or `max_completion_tokens` for newer models.
    #[serde(alias = "answer_tokens_field")]
    pub max_tokens_field: String,
    /// Maximum tokens of a prompt without images, by [`crate::tokens::estimate`].
    #[serde(alias = "prompt_tokens")]
    pub max_prompt_tokens: u32,
    /// Fields to omit for models that refuse them, for example `temperature`.
    #[serde(alias = "omit")]
    pub omit_fields: Vec<String>,
    /// Additional fields of each request.
    pub extra: serde_json::Map<String, serde_json::Value>,
    /// Source of the partner's observed interactions.
    pub behavior: BehaviorSource,
    /// Policy for decisions without the model.
    pub fallback: Fallback,
    /// Frames that pass per second of latency.
    pub frames_per_second: f32,
    /// Duration of a chosen wait, frames.
    pub wait_frames: u32,
    /// Images of `vlm`.
    pub images: ImageSettings,
}

/// Number of requests per decision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PromptSteps {
    /// Reasoning and choice in one answer.
    #[default]
    One,
    /// Reasoning first, then a second request for the choice (facts A3.4).
    Two,
}

/// Form of the choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AnswerForm {
    /// JSON schema; text after the endpoint refused a schema.
    #[default]
    Auto,
    /// JSON schema.
    Schema,
    /// Text that ends with a line `Plan: N`.
    Text,
}

/// Source of the partner's observed interactions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BehaviorSource {
    /// The helper's own perception; the `known_task` variants have a grant.
    #[default]
    #[serde(alias = "track")]
    Perceived,
    /// Ground truth while the partner is visible: a grant that every trace names.
    Granted,
}

/// Policy for decisions without the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fallback {
    /// Explores, as the original does; turns around if exploring is impossible.
    #[default]
    Explore,
    /// The rule-based planner, or for a partner its own rules.
    Rules,
    /// Waits.
    Wait,
}

/// Images of `vlm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImageSettings {
    /// Number of most recent images (paper: 10).
    pub count: usize,
    /// Side, pixels; at most that of the helper's own images.
    pub size: u32,
    /// Encoding.
    pub format: ImageEncoding,
}

/// Encoding of images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImageEncoding {
    /// Lossless, as in the original.
    #[default]
    Png,
    /// Lossy, at quality 85.
    Jpeg,
}

/// Endpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Endpoint {
    /// Base of its address, for example `http://127.0.0.1:8000/v1`.
    pub url: String,
    /// Protocol.
    pub kind: EndpointKind,
    /// Azure's protocol version.
    pub api_version: String,
    /// Environment variable of the key; empty for no key. The default is `OPENAI_API_KEY` (Azure:
    /// `AZURE_OPENAI_API_KEY`), or no key on the same machine.
    pub key_env: Option<String>,
    /// Maximum number of concurrent requests.
    #[serde(alias = "in_flight")]
    pub max_concurrent_requests: usize,
    /// Maximum size of an answer, bytes.
    pub max_answer_bytes: u64,
    /// Time limit of a request, seconds.
    pub timeout_secs: f32,
    /// True if plain http to another machine is allowed, which exposes requests and key to the
    /// network.
    pub allow_http: bool,
}

/// Protocol of an endpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndpointKind {
    /// `URL/chat/completions` with a bearer key: hosted services, vLLM, llama.cpp, Ollama.
    #[default]
    Openai,
    /// `URL/openai/deployments/MODEL/chat/completions?api-version=...` with an `api-key` header.
    Azure,
}

/// Handling of failed requests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RetrySettings {
    /// Attempts before a request counts as failed.
    #[serde(alias = "attempts")]
    pub max_attempts: u32,
    /// Wait after the first failure, seconds; doubles after each further one.
    #[serde(alias = "first_wait_secs")]
    pub initial_backoff_secs: f32,
    /// Maximum wait, which also limits the endpoint's `Retry-After`, seconds.
    #[serde(alias = "longest_wait_secs")]
    pub max_backoff_secs: f32,
    /// Consequence for the run.
    #[serde(alias = "then")]
    pub on_failure: FailureAction,
}

/// Consequence of an unavailable model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureAction {
    /// The run stops and can be resumed; answered requests are not sent again.
    #[default]
    Pause,
    /// The fallback decides, and reports count it.
    Fallback,
}

/// Budget of a run over all its sessions; exceeded by one request at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Budget {
    /// Maximum requests, retries included.
    #[serde(alias = "requests")]
    pub max_requests: Option<u64>,
    /// Maximum tokens of prompts and answers together.
    #[serde(alias = "tokens")]
    pub max_tokens: Option<u64>,
    /// Maximum cost, in the currency of the prices.
    #[serde(alias = "money")]
    pub max_cost: Option<f64>,
    /// Maximum minutes of a session.
    #[serde(alias = "minutes")]
    pub max_minutes: Option<f64>,
    /// Consequence of a spent budget.
    #[serde(alias = "then")]
    pub on_exhausted: FailureAction,
}

impl Budget {
    /// Returns whether it limits what all sessions together spend.
    pub fn limits_spending(&self) -> bool {
        self.max_requests.is_some() || self.max_tokens.is_some() || self.max_cost.is_some()
    }
}

/// Prices of tokens.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Price {
    /// Price of a million prompt tokens.
    pub prompt_per_million: f64,
    /// Price of a million answer tokens.
    pub answer_per_million: f64,
    /// Currency, for reports.
    pub currency: String,
}

impl Price {
    /// Returns the cost of this usage, in millionths of the currency.
    pub fn millionths(&self, usage: Usage) -> f64 {
        usage.prompt as f64 * self.prompt_per_million
            + usage.answer as f64 * self.answer_per_million
    }
}

impl Default for PromptSettings {
    fn default() -> PromptSettings {
        PromptSettings {
            model: String::new(),
            templates: None,
            steps: PromptSteps::One,
            answer_format: AnswerForm::Auto,
            // Facts A3.4.
            temperature: Some(0.7),
            top_p: Some(1.0),
            seed: None,
            max_answer_tokens: 512,
            max_tokens_field: "max_tokens".to_owned(),
            max_prompt_tokens: 4000,
            omit_fields: Vec::new(),
            extra: serde_json::Map::new(),
            behavior: BehaviorSource::Perceived,
            fallback: Fallback::Explore,
            frames_per_second: 0.0,
            wait_frames: 50,
            images: ImageSettings::default(),
        }
    }
}

impl Default for ImageSettings {
    fn default() -> ImageSettings {
        ImageSettings { count: 10, size: 512, format: ImageEncoding::Png }
    }
}

impl Default for Endpoint {
    fn default() -> Endpoint {
        Endpoint {
            url: String::new(),
            kind: EndpointKind::Openai,
            api_version: "2024-10-21".to_owned(),
            key_env: None,
            max_concurrent_requests: 16,
            max_answer_bytes: 1 << 20,
            timeout_secs: 120.0,
            allow_http: false,
        }
    }
}

impl Default for RetrySettings {
    fn default() -> RetrySettings {
        RetrySettings {
            max_attempts: 8,
            initial_backoff_secs: 1.0,
            max_backoff_secs: 60.0,
            on_failure: FailureAction::Pause,
        }
    }
}

impl Settings {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// If it cannot be read, is not TOML, or has an unknown field.
    pub fn read(path: &Path) -> Result<Settings> {
        let wrong = |problem: String| LlmError::Config { path: path.to_owned(), problem };
        let bytes = read_user_file(path, MAX_CONFIG_BYTES as u64 + 1)?;
        if bytes.len() > MAX_CONFIG_BYTES {
            return Err(wrong(format!("is longer than {MAX_CONFIG_BYTES} bytes")));
        }
        let text = String::from_utf8(bytes).map_err(|e| wrong(e.to_string()))?;
        let mut settings: Settings =
            toml::from_str(&text).map_err(|e| wrong(toml_message(&text, e.span(), e.message())))?;
        // TOML has no null; nan and inf become null in JSON.
        if let Some((name, _)) =
            settings.request.extra.iter().find(|(_, value)| contains_null(value))
        {
            return Err(wrong(format!("request.extra.{name} is no finite number")));
        }
        if let Some(folder) = &mut settings.request.templates
            && folder.is_relative()
        {
            // Relative to the configuration file.
            *folder = path.parent().unwrap_or(Path::new("")).join(&folder);
        }
        Ok(settings)
    }

    /// Returns the environment variable of the key; empty for none.
    pub fn key_env(&self) -> String {
        let default = match self.endpoint.kind {
            EndpointKind::Azure => "AZURE_OPENAI_API_KEY",
            EndpointKind::Openai if self.endpoint.is_local() => "",
            EndpointKind::Openai => "OPENAI_API_KEY",
        };
        self.endpoint.key_env.clone().unwrap_or_else(|| default.to_owned())
    }
}

fn contains_null(value: &serde_json::Value) -> bool {
    use serde_json::Value;
    match value {
        Value::Null => true,
        Value::Array(values) => values.iter().any(contains_null),
        Value::Object(fields) => fields.values().any(contains_null),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    pub(super) fn valid_settings() -> Settings {
        let mut settings = Settings::default();
        settings.request.model = "m".to_owned();
        settings.endpoint.url = "http://127.0.0.1:8000/v1".to_owned();
        settings
    }

    #[test]
    fn the_default_key_variable_depends_on_the_endpoint() {
        let mut settings = valid_settings();
        assert_eq!(settings.key_env(), "");
        settings.endpoint.url = "https://api.example.org/v1".to_owned();
        assert_eq!(settings.key_env(), "OPENAI_API_KEY");
        settings.endpoint.url = "https://localhost.example.org/v1".to_owned();
        assert_eq!(settings.key_env(), "OPENAI_API_KEY");
        settings.endpoint.kind = EndpointKind::Azure;
        assert_eq!(settings.key_env(), "AZURE_OPENAI_API_KEY");
        settings.endpoint.key_env = Some("MINE".to_owned());
        assert_eq!(settings.key_env(), "MINE");
    }

    #[test]
    fn keys_of_earlier_versions_are_read() {
        let old = "[asking]\nmodel = \"m\"\nform = \"text\"\nanswer_tokens = 64\nanswer_tokens_field = \"n\"\n\
                   prompt_tokens = 900\nomit = [\"seed\"]\nbehavior = \"track\"\n[endpoint]\nin_flight = 3\n\
                   [faults]\nattempts = 2\nfirst_wait_secs = 0.5\nlongest_wait_secs = 2.0\nthen = \"fallback\"\n\
                   [budget]\nrequests = 5\ntokens = 6\nmoney = 7.0\nminutes = 8.0\nthen = \"fallback\"\n";
        let new = "[request]\nmodel = \"m\"\nanswer_format = \"text\"\nmax_answer_tokens = 64\n\
                   max_tokens_field = \"n\"\nmax_prompt_tokens = 900\nomit_fields = [\"seed\"]\n\
                   behavior = \"perceived\"\n[endpoint]\nmax_concurrent_requests = 3\n\
                   [retry]\nmax_attempts = 2\ninitial_backoff_secs = 0.5\nmax_backoff_secs = 2.0\n\
                   on_failure = \"fallback\"\n[budget]\nmax_requests = 5\nmax_tokens = 6\nmax_cost = 7.0\n\
                   max_minutes = 8.0\non_exhausted = \"fallback\"\n";
        let settings = toml::from_str::<Settings>(new).unwrap();
        assert_eq!(toml::from_str::<Settings>(old).unwrap(), settings);
        assert_eq!(settings.retry.on_failure, FailureAction::Fallback);
    }

    #[test]
    fn missing_fields_have_defaults_and_unknown_fields_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("llm.toml");
        fs::write(
            &path,
            "[request]\nmodel = \"m\"\ntemplates = \"mine\"\n[budget]\nmax_requests = 5\n",
        )
        .unwrap();
        let settings = Settings::read(&path).unwrap();
        assert_eq!(settings.request.templates, Some(dir.path().join("mine")));
        assert_eq!(
            (settings.budget.max_requests, settings.request.max_answer_tokens),
            (Some(5), 512)
        );
        fs::write(&path, "[request]\nmodel_name = \"m\"\n").unwrap();
        let error = Settings::read(&path).unwrap_err().to_string();
        assert!(error.contains("model_name") && error.contains("llm.toml"), "{error}");
        for text in ["top_k = nan", "deep = { list = [1.0, inf] }"] {
            fs::write(&path, format!("[request.extra]\n{text}\n")).unwrap();
            let error = Settings::read(&path).unwrap_err().to_string();
            assert!(error.contains("is no finite number"), "{error}");
        }
    }
}
