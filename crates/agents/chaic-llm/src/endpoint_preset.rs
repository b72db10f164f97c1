//! Endpoint and key as named by the user. Run folders can come from other people, so they never
//! select where requests and keys go.

use std::path::Path;

use crate::error::{LlmError, Result};
use crate::settings::Settings;

/// Values that override a configuration file; absent values do not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EndpointPreset {
    /// Address of the endpoint.
    pub url: Option<String>,
    /// Model.
    pub model: Option<String>,
    /// Environment variable of the key; empty for no key.
    pub key_env: Option<String>,
    /// True if plain http to another machine is allowed.
    pub allow_http: bool,
}

impl EndpointPreset {
    /// Returns the settings with the named values.
    pub fn apply_to(&self, mut settings: Settings) -> Settings {
        if let Some(url) = &self.url {
            settings.endpoint.url.clone_from(url);
        }
        if let Some(model) = &self.model {
            settings.request.model.clone_from(model);
        }
        if self.key_env.is_some() {
            settings.endpoint.key_env.clone_from(&self.key_env);
        }
        settings.endpoint.allow_http |= self.allow_http;
        settings
    }

    /// Returns recorded settings with the user's endpoint. The user must name the address, and also
    /// the key variable if the recorded one is not the address's default.
    ///
    /// # Errors
    /// [`LlmError::NotNamed`] if one of them is missing.
    pub fn apply_to_recorded(&self, run: &Path, recorded: Settings) -> Result<Settings> {
        let mut settings = recorded.clone();
        settings.endpoint.key_env = None;
        settings.endpoint.allow_http = false;
        if recorded.endpoint.url.is_empty() {
            // A replayed run has used no endpoint.
            return Ok(self.apply_to(settings));
        }
        let settings = self.apply_to(settings);
        let used = settings.key_env();
        let is_key_named = self.key_env.is_some()
            || recorded.endpoint.key_env.as_ref().is_none_or(|name| *name == used);
        if self.url.is_some() && is_key_named {
            return Ok(settings);
        }
        let key_env = recorded.key_env();
        Err(LlmError::NotNamed {
            path: run.to_owned(),
            url: recorded.endpoint.url,
            key_env,
            is_key_named,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::EndpointKind;

    fn recorded(url: &str, key_env: Option<&str>) -> Settings {
        let mut settings = Settings::default();
        settings.request.model = "m".to_owned();
        settings.endpoint.url = url.to_owned();
        settings.endpoint.key_env = key_env.map(str::to_owned);
        settings.endpoint.allow_http = true;
        settings
    }

    fn named(url: Option<&str>, key_env: Option<&str>) -> EndpointPreset {
        let (url, key_env) = (url.map(str::to_owned), key_env.map(str::to_owned));
        EndpointPreset { url, key_env, ..EndpointPreset::default() }
    }

    const MINE: Option<&str> = Some("https://mine.example.org/v1");

    /// Returns the address and key variable in use, or the replacement text.
    fn used(
        named: &EndpointPreset,
        recorded: Settings,
    ) -> std::result::Result<(String, String), String> {
        let settings =
            named.apply_to_recorded(Path::new("run"), recorded).map_err(|e| e.to_string())?;
        assert!(!settings.endpoint.allow_http, "only the user allows plain http");
        Ok((settings.endpoint.url.clone(), settings.key_env()))
    }

    #[test]
    fn a_run_folder_selects_neither_address_nor_key() {
        let untrusted = || recorded("https://evil.example.org/v1", Some("AWS_SECRET_ACCESS_KEY"));
        let key = Some("AWS_SECRET_ACCESS_KEY");
        for named in [named(None, None), named(MINE, None), named(None, key)] {
            let error = used(&named, untrusted()).expect_err("the folder must not decide");
            for expected in ["evil.example.org", "AWS_SECRET_ACCESS_KEY", "--endpoint"] {
                assert!(error.contains(expected), "{expected}: {error}");
            }
            assert_eq!(error.contains("--llm-key-env"), named.key_env.is_none(), "{error}");
        }
        let mine = |key: &str| Ok((MINE.unwrap().to_owned(), key.to_owned()));
        assert_eq!(used(&named(MINE, Some("MY_KEY")), untrusted()), mine("MY_KEY"));
        assert_eq!(used(&named(MINE, Some("")), untrusted()), mine(""));
    }

    #[test]
    fn the_default_key_variable_of_the_named_address_need_not_be_named() {
        let hosted = || recorded("https://api.example.org/v1", None);
        let error = used(&named(None, None), hosted()).unwrap_err();
        assert!(error.contains("the key in OPENAI_API_KEY"), "{error}");
        assert!(!error.contains("--llm-key-env"), "{error}");
        let (url, key) = used(&named(MINE, None), hosted()).unwrap();
        assert_eq!((Some(url.as_str()), key.as_str()), (MINE, "OPENAI_API_KEY"));
        let here = named(Some("http://127.0.0.1:1/v1"), None);
        assert_eq!(used(&here, hosted()).unwrap().1, "", "this machine needs no key");
        let mut azure = recorded("https://a.openai.azure.com", Some("AZURE_OPENAI_API_KEY"));
        azure.endpoint.kind = EndpointKind::Azure;
        assert_eq!(used(&named(MINE, None), azure).unwrap().1, "AZURE_OPENAI_API_KEY");
    }

    #[test]
    fn a_run_without_requests_provides_no_key_variable() {
        let without_requests = recorded("", Some("AWS_SECRET_ACCESS_KEY"));
        assert_eq!(used(&named(MINE, None), without_requests).unwrap().1, "OPENAI_API_KEY");
    }
}
