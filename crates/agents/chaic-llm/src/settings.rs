//! How a language model is asked: what a configuration file says.

mod check;

use std::path::{Path, PathBuf};

use chaic_files::read_user_file;
use serde::{Deserialize, Serialize};

use crate::error::{LlmError, Result};
use crate::exchange::Usage;

/// Largest configuration file that is read, bytes.
const MAX_CONFIG_BYTES: usize = 1 << 20;

/// All settings. Those of [`Asking`] move results: a run is gone on with and played again by the
/// same ones only. The others are about how to get at the model, and may change.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// What is asked, and what becomes of the answer.
    pub asking: Asking,
    /// Whom to ask.
    pub endpoint: Endpoint,
    /// What to do when the endpoint fails.
    pub faults: Faults,
    /// What may be spent.
    pub budget: Budget,
    /// What tokens cost.
    pub price: Price,
}

/// What is asked, and what becomes of the answer: all that moves results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Asking {
    /// The model, as the endpoint calls it (for Azure: the deployment).
    pub model: String,
    /// A folder with templates in place of the built-in ones; files that are missing are built in.
    pub templates: Option<PathBuf>,
    /// In how many steps the model answers.
    pub steps: Steps,
    /// In which form.
    pub form: Form,
    /// Randomness of the answer; absent for the endpoint's own.
    pub temperature: Option<f64>,
    /// Part of the probability that is sampled from; absent for the endpoint's own.
    pub top_p: Option<f64>,
    /// Seed of the sampling, for endpoints that know one.
    pub seed: Option<u64>,
    /// Tokens that an answer may have.
    pub answer_tokens: u32,
    /// Name of that limit in a request: `max_tokens`, or `max_completion_tokens` for newer models.
    pub answer_tokens_field: String,
    /// Tokens that a prompt may have, images not counted, by [`crate::tokens::estimate`].
    pub prompt_tokens: u32,
    /// Fields that are not sent, for models that refuse them: `temperature`, say.
    pub omit: Vec<String>,
    /// Further fields of every request, for what this program doesn't know.
    pub extra: serde_json::Map<String, serde_json::Value>,
    /// What the helper knows of its partner's doings.
    pub behavior: Behavior,
    /// Who decides where the model doesn't.
    pub fallback: Fallback,
    /// Frames that pass for each second that the model takes to answer.
    pub frames_per_second: f32,
    /// How long a chosen wait lasts, frames.
    pub wait_frames: u32,
    /// Pictures for `vlm`.
    pub images: Pictures,
}

/// In how many steps the model answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Steps {
    /// Reasoning and choice in one answer.
    #[default]
    One,
    /// First the reasoning, then, asked again, the choice (facts A3.4).
    Two,
}

/// In which form the choice comes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// By JSON schema; as text from the moment on when the endpoint refuses a schema.
    #[default]
    Auto,
    /// By JSON schema.
    Schema,
    /// As text that ends with a line `Plan: N`.
    Text,
}

/// What the helper knows of its partner's doings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Behavior {
    /// What its own eyes tell; the `told` variants are granted them.
    #[default]
    Track,
    /// Perfect recognition while the partner is in view: a grant that every trace names.
    Granted,
}

/// Who decides where the model doesn't.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fallback {
    /// Explores, as the original does; turns around where that can't be begun.
    #[default]
    Explore,
    /// The rule-based planner (for a partner: its own rules).
    Rules,
    /// Waits.
    Wait,
}

/// Pictures for `vlm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pictures {
    /// How many: the last ones that the helper has looked at (paper: 10).
    pub count: usize,
    /// Their side, pixels; at most that of the helper's own images.
    pub size: u32,
    /// `png` or `jpeg`.
    pub format: PictureFormat,
}

/// How pictures are encoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureFormat {
    /// Without loss, as the original does.
    #[default]
    Png,
    /// Smaller, at quality 85.
    Jpeg,
}

/// Whom to ask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Endpoint {
    /// The base of its address, for example `http://127.0.0.1:8000/v1`.
    pub url: String,
    /// Which dialect it speaks.
    pub kind: Kind,
    /// Azure's version of the protocol.
    pub api_version: String,
    /// The environment variable that holds the key; empty if none is asked for. Absent for
    /// `OPENAI_API_KEY` (Azure: `AZURE_OPENAI_API_KEY`), or no key on this machine itself.
    pub key_env: Option<String>,
    /// Requests at a time.
    pub in_flight: usize,
    /// Longest answer that is read, bytes.
    pub max_answer_bytes: u64,
    /// How long one request may take, seconds.
    pub timeout_secs: f32,
    /// Whether plain http to another machine is fine: everybody on the way can read questions and
    /// key.
    pub allow_http: bool,
}

/// Which dialect an endpoint speaks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// `URL/chat/completions`, the key as bearer: hosted services, vLLM, llama.cpp, Ollama.
    #[default]
    Openai,
    /// `URL/openai/deployments/MODEL/chat/completions?api-version=...`, the key as `api-key`.
    Azure,
}

/// What to do when the endpoint fails.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Faults {
    /// How often a request is sent before it counts as failed.
    pub attempts: u32,
    /// How long to wait after the first failure, seconds; twice as long after each further one.
    pub first_wait_secs: f32,
    /// The longest wait, also where the endpoint names one, seconds.
    pub longest_wait_secs: f32,
    /// What becomes of the run then.
    pub then: Then,
}

/// What becomes of a run when the model can't be asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Then {
    /// It stops, and can be gone on with; nothing that was answered is asked again.
    #[default]
    Pause,
    /// The fallback decides, and it counts.
    Fallback,
}

/// What may be spent in a run, all its sessions together; overrun by at most one request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Budget {
    /// Requests, repeated ones included.
    pub requests: Option<u64>,
    /// Tokens, those of prompts and of answers together.
    pub tokens: Option<u64>,
    /// Money, in the currency of the price table.
    pub money: Option<f64>,
    /// Minutes since this session began.
    pub minutes: Option<f64>,
    /// What becomes of the run when one of them is spent.
    pub then: Then,
}

/// What tokens cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Price {
    /// A million tokens of prompts.
    pub prompt_per_million: f64,
    /// A million tokens of answers.
    pub answer_per_million: f64,
    /// In which currency, for reports.
    pub currency: String,
}

impl Price {
    /// What this usage costs, in millionths of the currency.
    pub fn millionths(&self, usage: Usage) -> f64 {
        usage.prompt as f64 * self.prompt_per_million
            + usage.answer as f64 * self.answer_per_million
    }
}

impl Default for Asking {
    fn default() -> Asking {
        Asking {
            model: String::new(),
            templates: None,
            steps: Steps::One,
            form: Form::Auto,
            // Facts A3.4.
            temperature: Some(0.7),
            top_p: Some(1.0),
            seed: None,
            answer_tokens: 512,
            answer_tokens_field: "max_tokens".to_owned(),
            prompt_tokens: 4000,
            omit: Vec::new(),
            extra: serde_json::Map::new(),
            behavior: Behavior::Track,
            fallback: Fallback::Explore,
            frames_per_second: 0.0,
            wait_frames: 50,
            images: Pictures::default(),
        }
    }
}

impl Default for Pictures {
    fn default() -> Pictures {
        Pictures { count: 10, size: 512, format: PictureFormat::Png }
    }
}

impl Default for Endpoint {
    fn default() -> Endpoint {
        Endpoint {
            url: String::new(),
            kind: Kind::Openai,
            api_version: "2024-10-21".to_owned(),
            key_env: None,
            in_flight: 16,
            max_answer_bytes: 1 << 20,
            timeout_secs: 120.0,
            allow_http: false,
        }
    }
}

impl Default for Faults {
    fn default() -> Faults {
        Faults { attempts: 8, first_wait_secs: 1.0, longest_wait_secs: 60.0, then: Then::Pause }
    }
}

impl Settings {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// If it can't be read, isn't TOML, or has a field that isn't known.
    pub fn read(path: &Path) -> Result<Settings> {
        let wrong = |problem: String| LlmError::Config { path: path.to_owned(), problem };
        let bytes = read_user_file(path, MAX_CONFIG_BYTES as u64 + 1)?;
        if bytes.len() > MAX_CONFIG_BYTES {
            return Err(wrong(format!("is longer than {MAX_CONFIG_BYTES} bytes")));
        }
        let text = String::from_utf8(bytes).map_err(|e| wrong(e.to_string()))?;
        let mut settings: Settings =
            toml::from_str(&text).map_err(|e| wrong(e.to_string().trim().to_owned()))?;
        // TOML has no null: it is what nan and inf become on their way to JSON.
        if let Some((name, _)) = settings.asking.extra.iter().find(|(_, value)| holds_null(value)) {
            return Err(wrong(format!("asking.extra.{name} is no finite number")));
        }
        if let Some(folder) = &mut settings.asking.templates
            && folder.is_relative()
        {
            // Beside the file that names it.
            *folder = path.parent().unwrap_or(Path::new("")).join(&folder);
        }
        Ok(settings)
    }

    /// The environment variable that holds the key; empty for none.
    pub fn key_env(&self) -> String {
        let usual = match self.endpoint.kind {
            Kind::Azure => "AZURE_OPENAI_API_KEY",
            Kind::Openai if self.endpoint.is_local() => "",
            Kind::Openai => "OPENAI_API_KEY",
        };
        self.endpoint.key_env.clone().unwrap_or_else(|| usual.to_owned())
    }
}

fn holds_null(value: &serde_json::Value) -> bool {
    use serde_json::Value;
    match value {
        Value::Null => true,
        Value::Array(values) => values.iter().any(holds_null),
        Value::Object(fields) => fields.values().any(holds_null),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    pub(super) fn good() -> Settings {
        let mut settings = Settings::default();
        settings.asking.model = "m".to_owned();
        settings.endpoint.url = "http://127.0.0.1:8000/v1".to_owned();
        settings
    }

    #[test]
    fn a_key_is_asked_for_where_it_is_usual() {
        let mut settings = good();
        assert_eq!(settings.key_env(), "");
        settings.endpoint.url = "https://api.example.org/v1".to_owned();
        assert_eq!(settings.key_env(), "OPENAI_API_KEY");
        settings.endpoint.url = "https://localhost.example.org/v1".to_owned();
        assert_eq!(settings.key_env(), "OPENAI_API_KEY");
        settings.endpoint.kind = Kind::Azure;
        assert_eq!(settings.key_env(), "AZURE_OPENAI_API_KEY");
        settings.endpoint.key_env = Some("MINE".to_owned());
        assert_eq!(settings.key_env(), "MINE");
    }

    #[test]
    fn a_file_may_say_little_and_nothing_unknown() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("llm.toml");
        fs::write(&path, "[asking]\nmodel = \"m\"\ntemplates = \"mine\"\n[budget]\nrequests = 5\n")
            .unwrap();
        let settings = Settings::read(&path).unwrap();
        assert_eq!(settings.asking.templates, Some(dir.path().join("mine")));
        assert_eq!((settings.budget.requests, settings.asking.answer_tokens), (Some(5), 512));
        fs::write(&path, "[asking]\nmodel_name = \"m\"\n").unwrap();
        let said = Settings::read(&path).unwrap_err().to_string();
        assert!(said.contains("model_name") && said.contains("llm.toml"), "{said}");
        for text in ["top_k = nan", "deep = { list = [1.0, inf] }"] {
            fs::write(&path, format!("[asking.extra]\n{text}\n")).unwrap();
            let said = Settings::read(&path).unwrap_err().to_string();
            assert!(said.contains("is no finite number"), "{said}");
        }
    }
}
