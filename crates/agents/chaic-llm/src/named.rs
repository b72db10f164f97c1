//! Whom to ask, as the user names it. A run's folder may come from somebody else, so it never says
//! where questions and keys go.

use std::path::Path;

use crate::error::{LlmError, Result};
use crate::settings::Settings;

/// What a user names beside a configuration file; absent is what the file says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Named {
    /// The endpoint's address.
    pub url: Option<String>,
    /// The model.
    pub model: Option<String>,
    /// The environment variable that holds the key; empty for no key.
    pub key_env: Option<String>,
    /// Whether plain http to another machine is fine.
    pub allow_http: bool,
}

impl Named {
    /// Settings that the user gave, with what is named in their place.
    pub fn over(&self, mut settings: Settings) -> Settings {
        if let Some(url) = &self.url {
            settings.endpoint.url.clone_from(url);
        }
        if let Some(model) = &self.model {
            settings.asking.model.clone_from(model);
        }
        if self.key_env.is_some() {
            settings.endpoint.key_env.clone_from(&self.key_env);
        }
        settings.endpoint.allow_http |= self.allow_http;
        settings
    }

    /// Settings that stand in a run's folder, with whom to ask from the user alone: the address must
    /// be named, and a recorded key variable that isn't the usual one of that address, too.
    ///
    /// # Errors
    /// [`LlmError::NotNamed`] if one of them isn't named.
    pub fn over_recorded(&self, run: &Path, recorded: Settings) -> Result<Settings> {
        let mut settings = recorded.clone();
        settings.endpoint.key_env = None;
        settings.endpoint.allow_http = false;
        if recorded.endpoint.url.is_empty() {
            // The run has asked nobody yet: it played a record.
            return Ok(self.over(settings));
        }
        let settings = self.over(settings);
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
    use crate::settings::Kind;

    fn recorded(url: &str, key_env: Option<&str>) -> Settings {
        let mut settings = Settings::default();
        settings.asking.model = "m".to_owned();
        settings.endpoint.url = url.to_owned();
        settings.endpoint.key_env = key_env.map(str::to_owned);
        settings.endpoint.allow_http = true;
        settings
    }

    fn named(url: Option<&str>, key_env: Option<&str>) -> Named {
        let (url, key_env) = (url.map(str::to_owned), key_env.map(str::to_owned));
        Named { url, key_env, ..Named::default() }
    }

    const MINE: Option<&str> = Some("https://mine.example.org/v1");

    /// The address and the key's variable that are used, or what is said instead.
    fn used(named: &Named, recorded: Settings) -> std::result::Result<(String, String), String> {
        let settings =
            named.over_recorded(Path::new("run"), recorded).map_err(|e| e.to_string())?;
        assert!(!settings.endpoint.allow_http, "plain http is allowed by the user alone");
        Ok((settings.endpoint.url.clone(), settings.key_env()))
    }

    #[test]
    fn a_run_folder_names_neither_address_nor_key() {
        let theirs = || recorded("https://evil.example.org/v1", Some("AWS_SECRET_ACCESS_KEY"));
        let key = Some("AWS_SECRET_ACCESS_KEY");
        for named in [named(None, None), named(MINE, None), named(None, key)] {
            let said = used(&named, theirs()).expect_err("the folder decided");
            for words in ["evil.example.org", "AWS_SECRET_ACCESS_KEY", "--endpoint"] {
                assert!(said.contains(words), "{words}: {said}");
            }
            assert_eq!(said.contains("--llm-key-env"), named.key_env.is_none(), "{said}");
        }
        let mine = |key: &str| Ok((MINE.unwrap().to_owned(), key.to_owned()));
        assert_eq!(used(&named(MINE, Some("MY_KEY")), theirs()), mine("MY_KEY"));
        assert_eq!(used(&named(MINE, Some("")), theirs()), mine(""));
    }

    #[test]
    fn what_is_usual_for_the_named_address_needs_no_second_word() {
        let hosted = || recorded("https://api.example.org/v1", None);
        let said = used(&named(None, None), hosted()).unwrap_err();
        assert!(said.contains("the key in OPENAI_API_KEY"), "{said}");
        assert!(!said.contains("--llm-key-env"), "{said}");
        let (url, key) = used(&named(MINE, None), hosted()).unwrap();
        assert_eq!((Some(url.as_str()), key.as_str()), (MINE, "OPENAI_API_KEY"));
        let here = named(Some("http://127.0.0.1:1/v1"), None);
        assert_eq!(used(&here, hosted()).unwrap().1, "", "no key is asked for on this machine");
        let mut azure = recorded("https://a.openai.azure.com", Some("AZURE_OPENAI_API_KEY"));
        azure.endpoint.kind = Kind::Azure;
        assert_eq!(used(&named(MINE, None), azure).unwrap().1, "AZURE_OPENAI_API_KEY");
    }

    #[test]
    fn a_run_that_asked_nobody_brings_no_key_along() {
        let silent = recorded("", Some("AWS_SECRET_ACCESS_KEY"));
        assert_eq!(used(&named(MINE, None), silent).unwrap().1, "OPENAI_API_KEY");
    }
}
