//! Whether settings are within their bounds, and whether an address may be asked at all.

use std::fmt::Display;
use std::net::IpAddr;
use std::ops::RangeInclusive;

use ureq::http::Uri;

use super::{Endpoint, Settings};
use crate::error::{LlmError, Result};

/// Randomness of an answer: what OpenAI's reference of chat completions allows.
const TEMPERATURE: RangeInclusive<f64> = 0.0..=2.0;
/// Money and prices: ours, more than anybody spends, and sums of it stay exact enough.
const MONEY: RangeInclusive<f64> = 0.0..=1e9;
/// Minutes of a session: ours, ten years.
const MINUTES: RangeInclusive<f64> = 0.0..=5_256_000.0;
/// Everything that is waited for, seconds: ours, up to a day.
const SECS: RangeInclusive<f32> = 0.001..=86_400.0;
/// Longest answer, bytes: ours, a thousand times the usual limit.
const ANSWER_BYTES: RangeInclusive<u64> = 1..=1 << 30;

impl Settings {
    /// Whether everything is within its bounds, and the endpoint may be asked.
    ///
    /// # Errors
    /// [`LlmError::Setting`] with the first that isn't.
    pub fn check(&self) -> Result<()> {
        self.check_bounds()?;
        self.endpoint.check()?;
        check_variable(&self.key_env())
    }

    /// Whether everything is within its bounds, for who asks no endpoint.
    ///
    /// # Errors
    /// [`LlmError::Setting`] with the first that isn't.
    pub fn check_bounds(&self) -> Result<()> {
        let Settings { asking, endpoint, faults, budget, price } = self;
        if asking.model.is_empty() {
            return wrong("asking.model", "empty", "the model's name; give --model");
        }
        maybe_within("asking.temperature", asking.temperature, TEMPERATURE)?;
        maybe_within("asking.top_p", asking.top_p, 0.0..=1.0)?;
        within("asking.answer_tokens", asking.answer_tokens, 1..=1_000_000)?;
        within("asking.prompt_tokens", asking.prompt_tokens, 500..=1_000_000)?;
        within("asking.images.count", asking.images.count, 1..=100)?;
        within("asking.images.size", asking.images.size, 16..=2048)?;
        within("asking.wait_frames", asking.wait_frames, 1..=3000)?;
        within("asking.frames_per_second", asking.frames_per_second, 0.0..=1000.0)?;
        within("endpoint.in_flight", endpoint.in_flight, 1..=256)?;
        within("endpoint.max_answer_bytes", endpoint.max_answer_bytes, ANSWER_BYTES)?;
        within("endpoint.timeout_secs", endpoint.timeout_secs, SECS)?;
        within("faults.attempts", faults.attempts, 1..=100)?;
        within("faults.first_wait_secs", faults.first_wait_secs, SECS)?;
        within("faults.longest_wait_secs", faults.longest_wait_secs, SECS)?;
        maybe_within("budget.money", budget.money, MONEY)?;
        maybe_within("budget.minutes", budget.minutes, MINUTES)?;
        within("price.prompt_per_million", price.prompt_per_million, MONEY)?;
        within("price.answer_per_million", price.answer_per_million, MONEY)?;
        if budget.money.is_some() && price.prompt_per_million + price.answer_per_million == 0.0 {
            return wrong("budget.money", "given", "prices in [price] to go with it");
        }
        Ok(())
    }
}

impl Endpoint {
    /// Whether this may be asked: a bare address, by https unless it is on this machine itself or
    /// plain http is allowed.
    fn check(&self) -> Result<()> {
        const FIELD: &str = "endpoint.url";
        if self.url.is_empty() {
            return wrong(FIELD, "empty", "the endpoint's address; give --endpoint");
        }
        // What may hold a secret isn't repeated.
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
                "https; or --llm-allow-http, if everybody on the way may read questions and key",
            );
        }
        let is_harmless = |c: char| c.is_ascii_alphanumeric() || ".-_".contains(c);
        if !self.api_version.chars().all(is_harmless) {
            return wrong("endpoint.api_version", "no version", "one like 2024-10-21");
        }
        Ok(())
    }

    /// Whether the address is on this machine itself.
    pub fn is_local(&self) -> bool {
        let Ok(uri) = self.url.parse::<Uri>() else { return false };
        let Some(host) = uri.host() else { return false };
        let bare = host.trim_start_matches('[').trim_end_matches(']');
        host.eq_ignore_ascii_case("localhost")
            || bare.parse().is_ok_and(|address: IpAddr| address.is_loopback())
    }
}

/// Whether this names an environment variable. It isn't repeated: it may be the key itself, given
/// in its name's place.
fn check_variable(name: &str) -> Result<()> {
    let is_word = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_word || name.starts_with(|c: char| c.is_ascii_digit()) {
        let expected = "the name of an environment variable, like OPENAI_API_KEY";
        return wrong("endpoint.key_env", "no name (not repeated, should it be the key)", expected);
    }
    Ok(())
}

fn maybe_within(field: &'static str, value: Option<f64>, range: RangeInclusive<f64>) -> Result<()> {
    value.map_or(Ok(()), |value| within(field, value, range))
}

/// A NaN is in no range.
fn within<T>(field: &'static str, value: T, range: RangeInclusive<T>) -> Result<()>
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
    use super::super::tests::good;
    use super::*;

    type Change = fn(&mut Settings);

    fn refused(change: Change) -> String {
        let mut settings = good();
        change(&mut settings);
        settings.check().expect_err("it is out of bounds").to_string()
    }

    #[test]
    fn the_usual_settings_are_fine_and_out_of_bounds_ones_are_named() {
        good().check().unwrap();
        let changes: [(Change, &str); 11] = [
            (|s| s.asking.model.clear(), "--model"),
            (|s| s.endpoint.url.clear(), "--endpoint"),
            (|s| s.endpoint.url = "ftp://x".to_owned(), "http://127.0.0.1"),
            (|s| s.endpoint.url = "https://me:sesame@x/v1".to_owned(), "bare address"),
            (|s| s.endpoint.url = "https://x/v1?key=sesame".to_owned(), "bare address"),
            (|s| s.endpoint.key_env = Some("sk-sesame".to_owned()), "endpoint.key_env is no name"),
            (|s| s.endpoint.api_version = "1&x=2".to_owned(), "endpoint.api_version"),
            (|s| s.endpoint.in_flight = 0, "endpoint.in_flight is 0"),
            (|s| s.faults.attempts = 0, "faults.attempts is 0"),
            (|s| s.budget.money = Some(1.0), "[price]"),
            (|s| s.asking.prompt_tokens = 10, "asking.prompt_tokens is 10, expected 500 to"),
        ];
        for (change, words) in changes {
            let said = refused(change);
            assert!(said.contains(words) && !said.contains("sesame"), "{said}");
        }
    }

    #[test]
    fn what_is_no_number_or_out_of_range_is_refused() {
        type Set = fn(&mut Settings, f64);
        let fields: [(Set, &str); 9] = [
            (|s, x| s.asking.temperature = Some(x), "asking.temperature"),
            (|s, x| s.asking.top_p = Some(x), "asking.top_p"),
            (|s, x| s.asking.frames_per_second = x as f32, "asking.frames_per_second"),
            (|s, x| s.endpoint.timeout_secs = x as f32, "endpoint.timeout_secs"),
            (|s, x| s.faults.longest_wait_secs = x as f32, "faults.longest_wait_secs"),
            (|s, x| s.budget.money = Some(x), "budget.money"),
            (|s, x| s.budget.minutes = Some(x), "budget.minutes"),
            (|s, x| s.price.prompt_per_million = x, "price.prompt_per_million"),
            (|s, x| s.price.answer_per_million = x, "price.answer_per_million"),
        ];
        for (set, field) in fields {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.5, 1e12] {
                let mut settings = good();
                set(&mut settings, value);
                let said = settings.check().expect_err(field).to_string();
                assert!(said.starts_with(&format!("{field} is ")), "{said}");
                assert!(settings.check_bounds().is_err(), "also where nobody is asked");
            }
        }
        let said = refused(|s| s.asking.temperature = Some(f64::NAN));
        assert_eq!(said, "asking.temperature is NaN, expected 0 to 2");
    }

    #[test]
    fn plain_http_goes_to_this_machine_only_unless_it_is_allowed() {
        for (url, is_fine) in [
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
            let mut settings = good();
            settings.endpoint.url = url.to_owned();
            assert_eq!(settings.check().is_ok(), is_fine, "{url}: {:?}", settings.check());
        }
        let mut settings = good();
        settings.endpoint.url = "http://192.168.1.7:8000/v1".to_owned();
        let said = settings.check().unwrap_err().to_string();
        assert!(said.contains("plain http") && said.contains("--llm-allow-http"), "{said}");
        settings.endpoint.allow_http = true;
        settings.check().unwrap();
    }
}
