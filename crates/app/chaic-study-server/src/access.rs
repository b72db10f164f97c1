//! Checks of a request's sender: names of the server, origin of the page, token of the participant.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::net::SocketAddr;

use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, HOST, HeaderName, ORIGIN};
use sha2::{Digest as _, Sha256};

/// Number of hexadecimal digits of a token: 256 random bits.
const TOKEN_DIGITS: usize = 64;

/// Default port, which browsers leave out.
const HTTP_PORT: &str = ":80";

/// Names under which browsers reach the server, as in the header `Host`.
#[derive(Clone, Debug)]
pub struct AllowedHosts(BTreeSet<String>);

impl AllowedHosts {
    /// Allows an address, `localhost` if it is a loopback address, and further names with or without port. Names
    /// with the default port are allowed without it, too.
    pub fn new(address: SocketAddr, names: &[String]) -> AllowedHosts {
        let port = address.port();
        let mut allowed: BTreeSet<String> = [address.to_string()].into();
        if address.ip().is_loopback() {
            allowed.insert(format!("localhost:{port}"));
        }
        for name in names.iter().map(|name| name.to_ascii_lowercase()) {
            if !name.contains(':') {
                allowed.insert(format!("{name}:{port}"));
            }
            allowed.insert(name);
        }
        let without_port = allowed.iter().filter_map(|name| name.strip_suffix(HTTP_PORT));
        let without_port: Vec<String> = without_port.map(str::to_owned).collect();
        allowed.extend(without_port);
        AllowedHosts(allowed)
    }

    /// Returns whether a request is for this server. A page of another site cannot reach the server through
    /// a name that it resolves to this address (DNS rebinding).
    pub fn has_host(&self, headers: &HeaderMap) -> bool {
        only(headers, &HOST).is_some_and(|host| self.0.contains(&host.to_ascii_lowercase()))
    }

    /// Returns whether a request comes from the page of this server. Browsers send the origin of a page with
    /// each request other than GET and HEAD.
    pub fn has_origin(&self, headers: &HeaderMap) -> bool {
        let origin = only(headers, &ORIGIN).map(str::to_ascii_lowercase).unwrap_or_default();
        let name = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        name.is_some_and(|name| self.0.contains(name))
    }
}

/// Returns whether a text can be a name of the server: letters, digits, `-` and `.`, and a port.
pub fn is_host_name(text: &str) -> bool {
    let (name, port) = text.split_once(':').unwrap_or((text, "1"));
    let is_valid = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
    !name.is_empty() && name.chars().all(is_valid) && port.parse::<u16>().is_ok_and(|port| port > 0)
}

/// SHA-256 of a participant's token. Only the page stores the token itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TokenDigest(String);

impl TokenDigest {
    /// Returns the digest of the token in a request; `None` if there is no valid one.
    pub fn of_request(headers: &HeaderMap) -> Option<TokenDigest> {
        let token = only(headers, &AUTHORIZATION)?.strip_prefix("Bearer ")?;
        if !is_hex(token) {
            return None;
        }
        let mut digits = String::with_capacity(TOKEN_DIGITS);
        for byte in Sha256::digest(token) {
            let _ = write!(digits, "{byte:02x}");
        }
        Some(TokenDigest(digits))
    }

    /// Parses the content of a file with a digest.
    pub fn parse(text: &str) -> Option<TokenDigest> {
        let digits = text.trim_end();
        is_hex(digits).then(|| TokenDigest(digits.to_owned()))
    }

    /// Returns the content of a file with the digest.
    pub fn to_line(&self) -> String {
        format!("{}\n", self.0)
    }
}

fn is_hex(text: &str) -> bool {
    text.len() == TOKEN_DIGITS && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

/// Returns the value of a header that occurs exactly once in a request.
fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(name: HeaderName, values: &[&str]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for value in values {
            headers.append(&name, value.parse().expect("a valid value"));
        }
        headers
    }

    #[test]
    fn requests_need_a_name_of_the_server_and_its_origin() {
        let address = "127.0.0.1:8040".parse().expect("an address");
        let hosts = AllowedHosts::new(address, &["Study.example.org".to_owned(), "b:9".to_owned()]);
        for (host, is_allowed) in [
            ("127.0.0.1:8040", true),
            ("LOCALHOST:8040", true),
            ("study.example.org", true),
            ("study.example.org:8040", true),
            ("b:9", true),
            ("b", false),
            ("localhost", false),
            ("localhost:80", false),
            ("study.example.org.evil.org", false),
            ("", false),
        ] {
            assert_eq!(hosts.has_host(&with(HOST, &[host])), is_allowed, "{host}");
            for scheme in ["http", "https"] {
                let origin = format!("{scheme}://{host}");
                assert_eq!(hosts.has_origin(&with(ORIGIN, &[&origin])), is_allowed, "{origin}");
            }
        }
        for origins in
            [&["null"][..], &[], &["ftp://localhost:8040"], &["http://b:9", "http://b:9"]]
        {
            assert!(!hosts.has_origin(&with(ORIGIN, origins)), "{origins:?}");
        }
        let public = AllowedHosts::new("192.0.2.1:80".parse().expect("an address"), &[]);
        assert!(!public.has_host(&with(HOST, &["localhost:80"])));
        // Browsers leave out the default port.
        assert!(public.has_host(&with(HOST, &["192.0.2.1"])));
        assert!(public.has_origin(&with(ORIGIN, &["http://192.0.2.1"])));
        let other = AllowedHosts::new("192.0.2.1:8080".parse().expect("an address"), &[]);
        assert!(!other.has_host(&with(HOST, &["192.0.2.1"])));
    }

    #[test]
    fn names_have_no_spaces_paths_or_schemes() {
        for (name, is_valid) in [
            ("study.example.org", true),
            ("localhost:8040", true),
            ("https://study.example.org", false),
            ("study.example.org/a", false),
            ("a b", false),
            ("a:0", false),
            (":80", false),
            ("", false),
        ] {
            assert_eq!(is_host_name(name), is_valid, "{name}");
        }
    }

    #[test]
    fn a_token_has_256_bits() {
        let token = "0123456789abcdef".repeat(4);
        let request = |value: &str| TokenDigest::of_request(&with(AUTHORIZATION, &[value]));
        let digest = request(&format!("Bearer {token}")).expect("a token");
        assert_eq!(TokenDigest::parse(&digest.to_line()), Some(digest.clone()));
        assert!(!digest.to_line().contains(&token));
        for value in [&token, "Bearer", "Bearer ", &format!("Bearer {}", &token[1..])] {
            assert_eq!(request(value), None, "{value}");
        }
        assert_eq!(request(&format!("Bearer {}", token.to_uppercase())), None);
    }
}
