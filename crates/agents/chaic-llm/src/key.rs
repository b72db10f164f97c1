//! The key of an endpoint, which nobody gets to see.

use std::fmt;

use crate::error::{LlmError, Result};

/// What stands in a text where the key stood.
const MASK: &str = "[key]";
/// A key shorter than this would mask words of ordinary text.
const MIN_MASKED: usize = 8;

/// An endpoint's key. It can't be printed or serialized; only a request's header gets it.
#[derive(Clone)]
pub struct Key(Option<String>);

impl Key {
    /// The key in this environment variable; none for an empty name.
    ///
    /// # Errors
    /// [`LlmError::NoKey`] if the variable is unset or empty.
    pub fn from_env(variable: &str) -> Result<Key> {
        if variable.is_empty() {
            return Ok(Key(None));
        }
        let value = std::env::var(variable).ok().map(|v| v.trim().to_owned());
        match value.filter(|v| !v.is_empty()) {
            Some(value) => Ok(Key(Some(value))),
            None => Err(LlmError::NoKey { variable: variable.to_owned() }),
        }
    }

    /// A key that is known already, for tests and other programs.
    pub fn new(value: &str) -> Key {
        Key((!value.is_empty()).then(|| value.to_owned()))
    }

    /// For the request's header alone.
    pub(crate) fn expose(&self) -> Option<&str> {
        self.0.as_deref()
    }

    /// A text from outside without the key, should an endpoint repeat it.
    pub fn mask(&self, text: String) -> String {
        match self.expose() {
            Some(key) if key.len() >= MIN_MASKED && text.contains(key) => text.replace(key, MASK),
            _ => text,
        }
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { MASK } else { "no key" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_never_printed_and_is_masked_in_what_comes_back() {
        let key = Key::new("sk-very-secret");
        assert!(!format!("{key:?} {:#?}", Some(&key)).contains("secret"));
        let said = key.mask("Incorrect API key sk-very-secret!".to_owned());
        assert_eq!(said, "Incorrect API key [key]!");
        assert!(Key::from_env("CHAIC_NO_SUCH_VARIABLE").is_err());
        assert!(Key::from_env("").is_ok_and(|k| k.expose().is_none()));
    }
}
