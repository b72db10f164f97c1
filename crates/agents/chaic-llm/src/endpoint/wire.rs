//! One HTTP request with `ureq`, which blocks. It runs on its own thread, so that the caller can
//! stop waiting; an abandoned thread ends at its time limit or with the process.

use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use ureq::Agent;

use super::{Failure, NoReply, failure};
use crate::exchange::FaultKind;
use crate::key::ApiKey;
use crate::rate_limiter::POLL_INTERVAL;
use crate::retry_after::retry_after;
use crate::settings::{Endpoint, EndpointKind, Settings};

/// Time limit of name resolution and of connecting, each.
const CONNECT: Duration = Duration::from_secs(10);
/// Time that an answer in transit has after the caller stops waiting. Chosen so that an interrupted
/// run ends within two seconds.
const GRACE: Duration = Duration::from_secs(1);

/// Parameters of a request.
pub(super) struct Wire {
    agent: Agent,
    address: String,
    kind: EndpointKind,
    key: ApiKey,
    max_answer_bytes: u64,
}

/// HTTP response.
pub(super) struct Response {
    /// Status code.
    pub status: u16,
    /// Value of `Retry-After`.
    pub retry_after: Option<Duration>,
    /// Body, or the failure that interrupted it.
    pub body: Result<Vec<u8>, Failure>,
    /// Time from the start of the request to the end of the answer.
    pub latency: Duration,
}

impl Wire {
    pub(super) fn new(settings: &Settings, key: ApiKey) -> Wire {
        let endpoint = &settings.endpoint;
        let Endpoint { kind, max_answer_bytes, timeout_secs, max_concurrent_requests, .. } =
            *endpoint;
        let timeout = Duration::from_secs_f32(timeout_secs);
        let mut config = Agent::config_builder()
            .http_status_as_error(false)
            // A redirect target gets neither key nor request.
            .max_redirects(0)
            .max_redirects_will_error(false)
            .timeout_global(Some(timeout))
            .timeout_resolve(Some(timeout.min(CONNECT)))
            .timeout_connect(Some(timeout.min(CONNECT)))
            .max_idle_connections_per_host(max_concurrent_requests)
            .user_agent(concat!("chaic/", env!("CARGO_PKG_VERSION")));
        if endpoint.is_local() {
            config = config.proxy(None);
        }
        let agent = config.build().new_agent();
        let address = address(endpoint, &settings.request.model);
        Wire { agent, address, kind, key, max_answer_bytes }
    }

    fn post(&self, body: &str) -> Result<Response, Failure> {
        let start = Instant::now();
        let mut request = self.agent.post(&self.address).header("content-type", "application/json");
        if let Some(key) = self.key.expose() {
            request = match self.kind {
                EndpointKind::Openai => request.header("authorization", format!("Bearer {key}")),
                EndpointKind::Azure => request.header("api-key", key),
            };
        }
        let mut response = request.send(body.as_bytes()).map_err(|e| transport(&e))?;
        let status = response.status().as_u16();
        let header = |name: &str| response.headers().get(name).and_then(|v| v.to_str().ok());
        let retry_after = header("retry-after").and_then(retry_after);
        let limit = self.max_answer_bytes;
        let bytes = response.body_mut().with_config().limit(limit).read_to_vec();
        let latency = start.elapsed();
        let body = bytes.map_err(|e| match e {
            ureq::Error::BodyExceedsLimit(_) => {
                failure(FaultKind::TooLong, format!("the answer is longer than {limit} bytes"))
            }
            other => transport(&other),
        });
        Ok(Response { status, retry_after, body, latency })
    }
}

/// Sends a request and waits for the response, or until `is_abandoned` has been true for [`GRACE`].
pub(super) fn post(
    wire: &Arc<Wire>,
    body: String,
    is_abandoned: &dyn Fn() -> bool,
) -> Result<Response, NoReply> {
    let (sender, receiver) = sync_channel(1);
    let wire_of_thread = Arc::clone(wire);
    let spawned = std::thread::Builder::new().name("chaic-request".to_owned()).spawn(move || {
        // The receiver may be gone.
        let _ = sender.send(wire_of_thread.post(&body));
    });
    if let Err(refusal) = spawned {
        let problem = format!("the system has no thread for a request ({})", refusal.kind());
        return Err(failure(FaultKind::Connection, problem).into());
    }
    let mut abandoned_at = None;
    loop {
        match receiver.recv_timeout(POLL_INTERVAL) {
            Ok(response) => return Ok(response?),
            Err(RecvTimeoutError::Disconnected) => {
                let problem = "the request failed unexpectedly".to_owned();
                return Err(failure(FaultKind::Connection, problem).into());
            }
            Err(RecvTimeoutError::Timeout) if is_abandoned() => {
                let since = *abandoned_at.get_or_insert_with(Instant::now);
                if since.elapsed() >= GRACE {
                    return Err(NoReply::Abandoned);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// Returns the URL of requests.
fn address(endpoint: &Endpoint, model: &str) -> String {
    const PATH: &str = "/chat/completions";
    let base = endpoint.url.trim_end_matches('/');
    match endpoint.kind {
        EndpointKind::Openai if base.ends_with(PATH) => base.to_owned(),
        EndpointKind::Openai => format!("{base}{PATH}"),
        EndpointKind::Azure => {
            let version = &endpoint.api_version;
            format!("{base}/openai/deployments/{model}{PATH}?api-version={version}")
        }
    }
}

/// Converts a transport error. The message omits the address, which is in the settings.
fn transport(error: &ureq::Error) -> Failure {
    use ureq::Error;
    let connection_failure = |problem: String| failure(FaultKind::Connection, problem);
    let unknown_host = || connection_failure("the endpoint's host can't be found".to_owned());
    match error {
        Error::Timeout(_) => failure(FaultKind::Timeout, "the endpoint takes too long".to_owned()),
        Error::Io(e) if e.kind() == std::io::ErrorKind::TimedOut => {
            failure(FaultKind::Timeout, "the endpoint takes too long".to_owned())
        }
        // This error kind is unstable; only the standard library's message identifies it.
        Error::Io(e) if e.to_string().starts_with("failed to lookup address") => unknown_host(),
        Error::HostNotFound => unknown_host(),
        Error::Io(e) => connection_failure(format!("the connection failed ({})", e.kind())),
        Error::ConnectionFailed => connection_failure("no connection".to_owned()),
        Error::Protocol(_) => {
            connection_failure("the endpoint violates HTTP or closed the connection".to_owned())
        }
        Error::Tls(_) | Error::Rustls(_) => {
            let failure =
                connection_failure("no secure connection: is the certificate valid?".to_owned());
            Failure { is_retryable: false, ..failure }
        }
        Error::BadUri(_) | Error::Http(_) => {
            let failure =
                connection_failure("the address or the key has invalid characters".to_owned());
            Failure { is_retryable: false, ..failure }
        }
        _ => connection_failure("the request failed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::settings;
    use super::*;

    #[test]
    fn addresses_of_all_dialects() {
        for (url, kind, expected) in [
            ("http://h:1/v1", EndpointKind::Openai, "http://h:1/v1/chat/completions"),
            ("http://h:1/v1/", EndpointKind::Openai, "http://h:1/v1/chat/completions"),
            ("http://h/v1/chat/completions", EndpointKind::Openai, "http://h/v1/chat/completions"),
            (
                "https://me.openai.azure.com",
                EndpointKind::Azure,
                "https://me.openai.azure.com/openai/deployments/m/chat/completions?api-version=2024-10-21",
            ),
        ] {
            assert_eq!(address(&settings(url, kind).endpoint, "m"), expected);
        }
    }

    #[test]
    fn an_unknown_host_is_reported() {
        let message = "failed to lookup address information: Name or service not known";
        let failure = transport(&ureq::Error::Io(std::io::Error::other(message)));
        assert!(failure.fault.detail.contains("host can't be found"), "{failure:?}");
        assert!(failure.is_retryable, "the network may recover");
    }
}
