//! Bounds of settings, and validity of addresses.

use std::fmt::Display;
use std::net::IpAddr;
use std::ops::RangeInclusive;

use ureq::http::Uri;

use super::{Endpoint, Settings};
use crate::error::{LlmError, Result};

/// Range of the sampling temperature (OpenAI's reference of chat completions).
const TEMPERATURE: RangeInclusive<f64> = 0.0..=2.0;
/// Range of money and prices; sums up to it are exact enough.
const MONEY: RangeInclusive<f64> = 0.0..=1e9;
/// Range of minutes of a session, up to ten years.
const MINUTES: RangeInclusive<f64> = 0.0..=5_256_000.0;
/// Range of waits, seconds, up to a day.
const SECS: RangeInclusive<f32> = 0.001..=86_400.0;
/// Range of the maximum answer size, bytes, up to a thousand times the default.
const ANSWER_BYTES: RangeInclusive<u64> = 1..=1 << 30;

impl Settings {
    /// Checks all bounds and the endpoint.
    ///
    /// # Errors
    /// [`LlmError::Setting`] for the first invalid setting.
    pub fn check(&self) -> Result<()> {
        self.check_bounds()?;
        self.endpoint.check()?;
        check_variable(&self.key_env())
    }

    /// Checks all bounds, for runs without an endpoint.
    ///
    /// # Errors
    /// [`LlmError::Setting`] for the first invalid setting.
    pub fn check_bounds(&self) -> Result<()> {
        let Settings { request, endpoint, retry, budget, price } = self;
        if request.model.is_empty() {
            return wrong("request.model", "empty", "the model's name; give --model");
        }
        check_optional("request.temperature", request.temperature, TEMPERATURE)?;
        check_optional("request.top_p", request.top_p, 0.0..=1.0)?;
        check_range("request.max_answer_tokens", request.max_answer_tokens, 1..=1_000_000)?;
        check_range("request.max_prompt_tokens", request.max_prompt_tokens, 500..=1_000_000)?;
        check_range("request.images.count", request.images.count, 1..=100)?;
        check_range("request.images.size", request.images.size, 16..=2048)?;
        check_range("request.wait_frames", request.wait_frames, 1..=3000)?;
        check_range("request.frames_per_second", request.frames_per_second, 0.0..=1000.0)?;
        check_range("endpoint.max_concurrent_requests", endpoint.max_concurrent_requests, 1..=256)?;
        check_range("endpoint.max_answer_bytes", endpoint.max_answer_bytes, ANSWER_BYTES)?;
        check_range("endpoint.timeout_secs", endpoint.timeout_secs, SECS)?;
        check_range("retry.max_attempts", retry.max_attempts, 1..=100)?;
        check_range("retry.initial_backoff_secs", retry.initial_backoff_secs, SECS)?;
        check_range("retry.max_backoff_secs", retry.max_backoff_secs, SECS)?;
        check_optional("budget.max_cost", budget.max_cost, MONEY)?;
        check_optional("budget.max_minutes", budget.max_minutes, MINUTES)?;
        check_range("price.prompt_per_million", price.prompt_per_million, MONEY)?;
        check_range("price.answer_per_million", price.answer_per_million, MONEY)?;
        if budget.max_cost.is_some() && price.prompt_per_million + price.answer_per_million == 0.0 {
            return wrong("budget.max_cost", "given", "prices in [price] to go with it");
        }
        Ok(())
    }
}

impl Endpoint {
    /// Checks the address: without credentials or query, and https unless it is on the same machine
    /// or plain http is allowed.
    fn check(&self) -> Result<()> {
        const FIELD: &str = "endpoint.url";
        if self.url.is_empty() {
            return wrong(FIELD, "empty", "the endpoint's address; give --endpoint");
        }
        // The message omits an address that may contain a secret.
        if self.url.contains(['@', '?', '#']) {
            return wrong(
                FIELD,
                "an address with a name, password or query",
                "the bare address; the key comes from an environment variable (endpoint.key_env)",
            );
        }
        let uri = self.url.parse::<Uri>().ok().filter(|uri| uri.host().is_some());
        let is_plain = match uri.as_ref().and_then(Uri::scheme_str) {
            Some("https") => false,
            Some("http") => true,
            _ => return wrong(FIELD, "no address", "one like http://127.0.0.1:8000/v1"),
        };
        if is_plain && !self.allow_http && !self.is_local() {
            return wrong(
                FIELD,
                "plain http to another machine",
                "https; or --llm-allow-http, if others on the network may read requests and key",
            );
        }
        let is_harmless = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        if !self.api_version.chars().all(is_harmless) {
            return wrong("endpoint.api_version", "no version", "one like 2024-10-21");
        }
        Ok(())
    }

    /// Returns whether the address is on the same machine.
    pub fn is_local(&self) -> bool {
        let Ok(uri) = self.url.parse::<Uri>() else { return false };
        let Some(host) = uri.host() else { return false };
        let bare = host.trim_start_matches('[').trim_end_matches(']');
        host.eq_ignore_ascii_case("localhost")
            || bare.parse().is_ok_and(|address: IpAddr| address.is_loopback())
    }
}

/// Checks the name of an environment variable. The message omits it, since it may be the key
/// itself.
fn check_variable(name: &str) -> Result<()> {
    let is_word = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_word || name.starts_with(|c: char| c.is_ascii_digit()) {
        let expected = "the name of an environment variable, like OPENAI_API_KEY";
        return wrong(
            "endpoint.key_env",
            "no name (not shown, because it may be the key)",
            expected,
        );
    }
    Ok(())
}

fn check_optional(
    field: &'static str,
    value: Option<f64>,
    range: RangeInclusive<f64>,
) -> Result<()> {
    value.map_or(Ok(()), |value| check_range(field, value, range))
}

/// NaN is in no range.
fn check_range<T>(field: &'static str, value: T, range: RangeInclusive<T>) -> Result<()>
where
    T: PartialOrd + Display,
{
    if range.contains(&value) {
        return Ok(());
    }
    wrong(field, &value.to_string(), &format!("{} to {}", range.start(), range.end()))
}

fn wrong(field: &'static str, found: &str, expected: &str) -> Result<()> {
    let (found, expected) = (found.to_owned(), expected.to_owned());
    Err(LlmError::Setting { field, found, expected })
}

#[cfg(test)]
mod tests {
    use super::super::tests::valid_settings;
    use super::*;

    type Change = fn(&mut Settings);

    fn refused(change: Change) -> String {
        let mut settings = valid_settings();
        change(&mut settings);
        settings.check().expect_err("it is out of bounds").to_string()
    }

    #[test]
    fn valid_settings_pass_and_invalid_ones_are_named() {
        valid_settings().check().unwrap();
        let changes: [(Change, &str); 11] = [
            (|s| s.request.model.clear(), "--model"),
            (|s| s.endpoint.url.clear(), "--endpoint"),
            (|s| s.endpoint.url = "ftp://x".to_owned(), "http://127.0.0.1"),
            (|s| s.endpoint.url = "https://me:sesame@x/v1".to_owned(), "bare address"),
            (|s| s.endpoint.url = "https://x/v1?key=sesame".to_owned(), "bare address"),
            (|s| s.endpoint.key_env = Some("sk-sesame".to_owned()), "endpoint.key_env is no name"),
            (|s| s.endpoint.api_version = "1&x=2".to_owned(), "endpoint.api_version"),
            (|s| s.endpoint.max_concurrent_requests = 0, "endpoint.max_concurrent_requests is 0"),
            (|s| s.retry.max_attempts = 0, "retry.max_attempts is 0"),
            (|s| s.budget.max_cost = Some(1.0), "[price]"),
            (
                |s| s.request.max_prompt_tokens = 10,
                "request.max_prompt_tokens is 10, expected 500 to",
            ),
        ];
        for (change, expected) in changes {
            let error = refused(change);
            assert!(error.contains(expected) && !error.contains("sesame"), "{error}");
        }
    }

    #[test]
    fn nan_and_values_out_of_range_are_refused() {
        type Set = fn(&mut Settings, f64);
        let fields: [(Set, &str); 9] = [
            (|s, x| s.request.temperature = Some(x), "request.temperature"),
            (|s, x| s.request.top_p = Some(x), "request.top_p"),
            (|s, x| s.request.frames_per_second = x as f32, "request.frames_per_second"),
            (|s, x| s.endpoint.timeout_secs = x as f32, "endpoint.timeout_secs"),
            (|s, x| s.retry.max_backoff_secs = x as f32, "retry.max_backoff_secs"),
            (|s, x| s.budget.max_cost = Some(x), "budget.max_cost"),
            (|s, x| s.budget.max_minutes = Some(x), "budget.max_minutes"),
            (|s, x| s.price.prompt_per_million = x, "price.prompt_per_million"),
            (|s, x| s.price.answer_per_million = x, "price.answer_per_million"),
        ];
        for (set, field) in fields {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.5, 1e12] {
                let mut settings = valid_settings();
                set(&mut settings, value);
                let error = settings.check().expect_err(field).to_string();
                assert!(error.starts_with(&format!("{field} is ")), "{error}");
                assert!(settings.check_bounds().is_err(), "also without an endpoint");
            }
        }
        let error = refused(|s| s.request.temperature = Some(f64::NAN));
        assert_eq!(error, "request.temperature is NaN, expected 0 to 2");
    }

    #[test]
    fn plain_http_goes_to_this_machine_only_unless_it_is_allowed() {
        for (url, is_valid) in [
            ("http://localhost:8000/v1", true),
            ("http://LOCALHOST/v1", true),
            ("http://127.0.0.1/v1", true),
            ("http://127.1.2.3:80/v1", true),
            ("http://[::1]:8000/v1", true),
            ("https://models.example.org/v1", true),
            ("http://models.example.org/v1", false),
            ("http://localhost.example.org/v1", false),
            ("http://127.0.0.1.example.org/v1", false),
            ("http://192.168.1.7:8000/v1", false),
            ("http://0.0.0.0:8000/v1", false),
            ("http://[::1.example.org/v1", false),
            ("http://models.example.org\\localhost/v1", false),
            ("http:///v1", false),
        ] {
            let mut settings = valid_settings();
            settings.endpoint.url = url.to_owned();
            assert_eq!(settings.check().is_ok(), is_valid, "{url}: {:?}", settings.check());
        }
        let mut settings = valid_settings();
        settings.endpoint.url = "http://192.168.1.7:8000/v1".to_owned();
        let error = settings.check().unwrap_err().to_string();
        assert!(error.contains("plain http") && error.contains("--llm-allow-http"), "{error}");
        settings.endpoint.allow_http = true;
        settings.check().unwrap();
    }
}
