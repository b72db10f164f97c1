//! Secret key of an endpoint.

use std::fmt;

use crate::error::{LlmError, Result};

/// Replacement of the key in texts.
const MASK: &str = "[key]";
/// Minimum length of a masked key; a shorter one could mask ordinary words.
const MIN_MASKED: usize = 8;

/// Key of an endpoint. It cannot be printed or serialized; only the request header contains it.
#[derive(Clone)]
pub struct ApiKey(Option<String>);

impl ApiKey {
    /// Reads the key from an environment variable; no key for an empty name.
    ///
    /// # Errors
    /// [`LlmError::NoKey`] if the variable is unset or empty.
    pub fn from_env(variable: &str) -> Result<ApiKey> {
        if variable.is_empty() {
            return Ok(ApiKey(None));
        }
        let value = std::env::var(variable).ok().map(|v| v.trim().to_owned());
        match value.filter(|v| !v.is_empty()) {
            Some(value) => Ok(ApiKey(Some(value))),
            None => Err(LlmError::NoKey { variable: variable.to_owned() }),
        }
    }

    /// Creates a key from a known value, for tests and other programs.
    pub fn new(value: &str) -> ApiKey {
        ApiKey((!value.is_empty()).then(|| value.to_owned()))
    }

    /// Returns the key for the request header.
    pub(crate) fn expose(&self) -> Option<&str> {
        self.0.as_deref()
    }

    /// Replaces the key in a text from an endpoint, which may repeat the key.
    pub fn mask(&self, text: String) -> String {
        match self.expose() {
            Some(key) if key.len() >= MIN_MASKED && text.contains(key) => text.replace(key, MASK),
            _ => text,
        }
    }
}

impl fmt::Debug for ApiKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { MASK } else { "no key" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_never_printed_and_is_masked_in_answers() {
        let key = ApiKey::new("sk-very-secret");
        assert!(!format!("{key:?} {:#?}", Some(&key)).contains("secret"));
        let masked = key.mask("Incorrect API key sk-very-secret!".to_owned());
        assert_eq!(masked, "Incorrect API key [key]!");
        assert!(ApiKey::from_env("CHAIC_NO_SUCH_VARIABLE").is_err());
        assert!(ApiKey::from_env("").is_ok_and(|k| k.expose().is_none()));
    }
}
