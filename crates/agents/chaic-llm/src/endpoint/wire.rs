//! One request on its way, over `ureq`, which blocks: on a thread of its own, so that who waits can
//! stop waiting. A thread that nobody waits for ends with its time limit, or with the process.

use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use ureq::Agent;

use super::{Failure, NoReply, failure};
use crate::exchange::FaultKind;
use crate::gate::LOOK_EVERY;
use crate::key::Key;
use crate::retry_after::retry_after;
use crate::settings::{Endpoint, Kind, Settings};

/// Finding a host and connecting to it take at most so long, each.
const CONNECT: Duration = Duration::from_secs(10);
/// So long an answer that is on its way may still arrive when its asker is to stop. Ours: with what
/// comes after, a run ends within two seconds.
const GRACE: Duration = Duration::from_secs(1);

/// What a request needs to get on its way.
pub(super) struct Wire {
    agent: Agent,
    address: String,
    kind: Kind,
    key: Key,
    max_answer_bytes: u64,
}

/// What came back.
pub(super) struct Response {
    /// The endpoint's status.
    pub status: u16,
    /// For how long it asks to wait.
    pub retry_after: Option<Duration>,
    /// Its answer, or why that broke off.
    pub body: Result<Vec<u8>, Failure>,
    /// From the request's beginning to the answer's end.
    pub latency: Duration,
}

impl Wire {
    pub(super) fn new(settings: &Settings, key: Key) -> Wire {
        let endpoint = &settings.endpoint;
        let Endpoint { kind, max_answer_bytes, timeout_secs, in_flight, .. } = *endpoint;
        let timeout = Duration::from_secs_f32(timeout_secs);
        let mut config = Agent::config_builder()
            .http_status_as_error(false)
            // Whoever redirects gets neither key nor question.
            .max_redirects(0)
            .max_redirects_will_error(false)
            .timeout_global(Some(timeout))
            .timeout_resolve(Some(timeout.min(CONNECT)))
            .timeout_connect(Some(timeout.min(CONNECT)))
            .max_idle_connections_per_host(in_flight)
            .user_agent(concat!("chaic/", env!("CARGO_PKG_VERSION")));
        if endpoint.is_local() {
            config = config.proxy(None);
        }
        let agent = config.build().new_agent();
        let address = address(endpoint, &settings.asking.model);
        Wire { agent, address, kind, key, max_answer_bytes }
    }

    fn post(&self, body: &str) -> Result<Response, Failure> {
        let began = Instant::now();
        let mut request = self.agent.post(&self.address).header("content-type", "application/json");
        if let Some(key) = self.key.expose() {
            request = match self.kind {
                Kind::Openai => request.header("authorization", format!("Bearer {key}")),
                Kind::Azure => request.header("api-key", key),
            };
        }
        let mut response = request.send(body.as_bytes()).map_err(|e| transport(&e))?;
        let status = response.status().as_u16();
        let header = |name: &str| response.headers().get(name).and_then(|v| v.to_str().ok());
        let retry_after = header("retry-after").and_then(retry_after);
        let limit = self.max_answer_bytes;
        let bytes = response.body_mut().with_config().limit(limit).read_to_vec();
        let latency = began.elapsed();
        let body = bytes.map_err(|e| match e {
            ureq::Error::BodyExceedsLimit(_) => {
                failure(FaultKind::TooLong, format!("the answer is longer than {limit} bytes"))
            }
            other => transport(&other),
        });
        Ok(Response { status, retry_after, body, latency })
    }
}

/// Sends a request, and waits until something comes back or `is_given_up` has been true for
/// [`GRACE`].
pub(super) fn post(
    wire: &Arc<Wire>,
    body: String,
    is_given_up: &dyn Fn() -> bool,
) -> Result<Response, NoReply> {
    let (sender, receiver) = sync_channel(1);
    let for_thread = Arc::clone(wire);
    let spawned = std::thread::Builder::new().name("chaic-request".to_owned()).spawn(move || {
        // Who has stopped waiting doesn't receive it.
        let _ = sender.send(for_thread.post(&body));
    });
    if let Err(refusal) = spawned {
        let what = format!("the system has no thread for a request ({})", refusal.kind());
        return Err(failure(FaultKind::Connection, what).into());
    }
    let mut given_up_at = None;
    loop {
        match receiver.recv_timeout(LOOK_EVERY) {
            Ok(response) => return Ok(response?),
            Err(RecvTimeoutError::Disconnected) => {
                let what = "the request broke down".to_owned();
                return Err(failure(FaultKind::Connection, what).into());
            }
            Err(RecvTimeoutError::Timeout) if is_given_up() => {
                let since = *given_up_at.get_or_insert_with(Instant::now);
                if since.elapsed() >= GRACE {
                    return Err(NoReply::Abandoned);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// Where requests go.
fn address(endpoint: &Endpoint, model: &str) -> String {
    const PATH: &str = "/chat/completions";
    let base = endpoint.url.trim_end_matches('/');
    match endpoint.kind {
        Kind::Openai if base.ends_with(PATH) => base.to_owned(),
        Kind::Openai => format!("{base}{PATH}"),
        Kind::Azure => {
            let version = &endpoint.api_version;
            format!("{base}/openai/deployments/{model}{PATH}?api-version={version}")
        }
    }
}

/// What went wrong before there was an answer. The address isn't repeated: it is in the settings.
fn transport(error: &ureq::Error) -> Failure {
    use ureq::Error;
    let broken = |what: String| failure(FaultKind::Connection, what);
    let unknown_host = || broken("the endpoint's host can't be found".to_owned());
    match error {
        Error::Timeout(_) => failure(FaultKind::Timeout, "the endpoint takes too long".to_owned()),
        Error::Io(e) if e.kind() == std::io::ErrorKind::TimedOut => {
            failure(FaultKind::Timeout, "the endpoint takes too long".to_owned())
        }
        // The kind of this one has no name yet; the standard library's message has.
        Error::Io(e) if e.to_string().starts_with("failed to lookup address") => unknown_host(),
        Error::HostNotFound => unknown_host(),
        Error::Io(e) => broken(format!("the connection failed ({})", e.kind())),
        Error::ConnectionFailed => broken("no connection".to_owned()),
        Error::Protocol(_) => broken("the endpoint doesn't keep to HTTP, or broke off".to_owned()),
        Error::Tls(_) | Error::Rustls(_) => {
            let failure = broken("no secure connection: is the certificate valid?".to_owned());
            Failure { may_pass: false, ..failure }
        }
        Error::BadUri(_) | Error::Http(_) => {
            let failure = broken("the address or the key can't stand in a request".to_owned());
            Failure { may_pass: false, ..failure }
        }
        _ => broken("the request failed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::settings;
    use super::*;

    #[test]
    fn addresses_of_all_dialects() {
        for (url, kind, expected) in [
            ("http://h:1/v1", Kind::Openai, "http://h:1/v1/chat/completions"),
            ("http://h:1/v1/", Kind::Openai, "http://h:1/v1/chat/completions"),
            ("http://h/v1/chat/completions", Kind::Openai, "http://h/v1/chat/completions"),
            (
                "https://me.openai.azure.com",
                Kind::Azure,
                "https://me.openai.azure.com/openai/deployments/m/chat/completions?api-version=2024-10-21",
            ),
        ] {
            assert_eq!(address(&settings(url, kind).endpoint, "m"), expected);
        }
    }

    #[test]
    fn a_host_that_is_not_known_is_said_to_be_so() {
        let said = "failed to lookup address information: Name or service not known";
        let failure = transport(&ureq::Error::Io(std::io::Error::other(said)));
        assert!(failure.fault.detail.contains("host can't be found"), "{failure:?}");
        assert!(failure.may_pass, "a network may come back");
    }
}
