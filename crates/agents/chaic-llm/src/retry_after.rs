//! `Retry-After`: seconds, or a date (RFC 9110, sections 10.2.3 and 5.6.7).

use std::time::{Duration, SystemTime};

/// Parses a `Retry-After` header into a wait.
pub(crate) fn retry_after(value: &str) -> Option<Duration> {
    if let Ok(secs) = value.trim().parse::<f64>() {
        return Duration::try_from_secs_f64(secs).ok();
    }
    let at = httpdate::parse_http_date(value.trim()).ok()?;
    Some(at.duration_since(SystemTime::now()).unwrap_or(Duration::ZERO))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_may_ask_to_wait_in_seconds_or_until_a_date() {
        assert_eq!(retry_after("12"), Some(Duration::from_secs(12)));
        assert_eq!(retry_after("0.5"), Some(Duration::from_millis(500)));
        assert_eq!(retry_after("soon"), None);
        assert_eq!(retry_after("-3"), None);
        assert_eq!(retry_after("Sun, 9223372036854775807 Nov 1994 08:49:37 GMT"), None);
        assert_eq!(
            retry_after("Sun, 06 Nov 1994 08:49:37 GMT"),
            Some(Duration::ZERO),
            "a date in the past"
        );
        let far = retry_after("Fri, 31 Dec 9999 23:59:59 GMT").expect("a date");
        assert!(far > Duration::from_secs(1_000_000_000), "{far:?}");
    }
}
